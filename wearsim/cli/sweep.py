"""`wearsim sweep`: many campaigns, from a sweep file or from one scene and the keys to vary."""

from __future__ import annotations

import argparse
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from wearsim.cli import Commands, add_command, whole

if TYPE_CHECKING:
    from wearsim.scene import SweepScene
    from wearsim.scene.sweep import Case, Sweep
    from wearsim.studies.ensemble import Outcome


def add_parser(commands: Commands) -> None:
    """Add the command."""
    parser = add_command(
        commands,
        "sweep",
        "run many campaigns, each resumable by itself, and write one table of them",
        "wearsim sweep workflows/sweep_rig.toml --out out\n"
        "wearsim sweep rig.toml --vary wheelset.radius_mm=420,460 --vary wear.form=local,patch_mean\n"
        "wearsim sweep cases.toml --out out --case $SLURM_ARRAY_TASK_ID",
    )
    parser.add_argument("scene", metavar="SCENE", help='sweep file (kind = "sweep"), or a scene to vary')
    parser.add_argument(
        "--out", metavar="DIR", help="directory of the sweep (default: the file's name without .toml)"
    )
    parser.add_argument(
        "--vary",
        metavar="KEY=VALUE,...",
        action="append",
        default=[],
        help="vary a key of the scene; given several times, every value with every other; an empty value "
        "removes the key, so that its default applies",
    )
    parser.add_argument("--table", metavar="CSV", help="cases of the scene, with columns named section.key")
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--case", metavar="K", type=int, help="run case K only, counted from 1 (job arrays)")
    what.add_argument("--list", action="store_true", help="show and check the cases; run nothing")
    parser.add_argument(
        "--jobs", metavar="N", type=partial(whole, 1, 1024), help="processes (default: one per core)"
    )
    parser.add_argument("--json", action="store_true", help="print JSON")


def execute(arguments: argparse.Namespace) -> int:
    """Check all cases, then run or list them."""
    from wearsim.errors import Fault, SceneError
    from wearsim.scene import SweepScene, load_scene
    from wearsim.scene.sweep import sweep_of_flags
    from wearsim.studies.sweep import sweep_of

    scene = load_scene(arguments.scene)
    if not isinstance(scene, SweepScene):
        sweep = sweep_of_flags(arguments.scene, arguments.vary, arguments.table)
    elif arguments.vary or arguments.table:
        message = "a sweep file states itself what is varied; leave --vary and --table out"
        raise SceneError([Fault(message, arguments.scene)])
    else:
        sweep = sweep_of(scene)
    out = Path(arguments.out or Path(arguments.scene).stem)
    if arguments.list:
        return _list(sweep, out, arguments.json)
    if arguments.case is not None:
        return _one(sweep, out, arguments)
    return _all(sweep, out, arguments.jobs, arguments.command_line, arguments.json)


def run(scene: SweepScene, out: Path | None, command: str) -> int:
    """Run a sweep file for `wearsim run`; the exit code."""
    from wearsim.studies.sweep import sweep_of

    return _all(sweep_of(scene), out or Path(scene.origin.path.stem), None, command, False)


def with_fault(line: str, fault: str) -> str:
    """Line with its fault, if there is one."""
    return f"{line}; {fault}" if fault else line


def _list(sweep: Sweep, out: Path, as_json: bool) -> int:
    import json

    from wearsim.studies.sweep import case_line, listed_cases

    cases = listed_cases(sweep, out)
    if as_json:
        print(json.dumps({"title": sweep.title, "cases": cases}, indent=2, ensure_ascii=False))
    else:
        for case in cases:
            print(with_fault(f"{case_line(case)}: {case['state']}", case["fault"]))
    return 2 if any(case["fault"] for case in cases) else 0


def _one(sweep: Sweep, out: Path, arguments: argparse.Namespace) -> int:
    import json
    from dataclasses import asdict

    from wearsim.cli.progress import observer
    from wearsim.studies.sweep import chosen, run_one

    case = chosen(sweep, arguments.case)
    _warn((case,), out)
    with observer() as observe:
        outcome = run_one(sweep, case, out, command=arguments.command_line, observer=observe)
    if arguments.json:
        print(json.dumps(asdict(outcome), indent=2, ensure_ascii=False))
    elif not outcome.fault:
        print(f"case {case.number}: {outcome.state}, {out / case.name}")
    if outcome.fault:
        print(f"case {case.number}: {outcome.fault}", file=sys.stderr)
    return outcome.exit_code


def _all(sweep: Sweep, out: Path, jobs: int | None, command: str, as_json: bool) -> int:
    import json

    from wearsim.studies.sweep import counted, run_sweep, sweep_dataset, sweep_rows

    _warn(sweep.cases, out)
    ended: set[int] = set()

    def report(outcome: Outcome) -> None:
        if outcome.state == "running":
            line = f"case {outcome.number}: begun, {sweep.cases[outcome.number - 1].label}"
        else:
            ended.add(outcome.number)
            count = f"({len(ended)} of {len(sweep.cases)})"
            line = with_fault(f"case {outcome.number}: {outcome.state} {count}", outcome.fault)
        print(line, file=sys.stderr, flush=True)

    try:
        outcomes = run_sweep(sweep, out, jobs=jobs, command=command, report=report)
    except KeyboardInterrupt:
        print("interrupted; the same command goes on where the cases stopped", file=sys.stderr)
        return 130
    if as_json:
        print(json.dumps(sweep_rows(sweep_dataset(out)), indent=2, ensure_ascii=False))
    else:
        print(counted(outcomes))
        print(f"table: {out / 'sweep.csv'}, {out / 'sweep.nc'}")
    return max(outcome.exit_code for outcome in outcomes)


def _warn(cases: tuple[Case, ...], out: Path) -> None:
    from wearsim.studies.ensemble import check_cases

    for warning in check_cases(cases, out):
        print(f"warning: {warning}", file=sys.stderr)
