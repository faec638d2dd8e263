"""`wearsim sweep`: many campaigns, from a sweep file or from one scene and the keys to vary."""

from __future__ import annotations

import argparse
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from wearsim.cli import print_json
from wearsim.cli.flags import add_worker_flags
from wearsim.cli.progress import case_lines, observer, with_fault, workers
from wearsim.cli.streams import formula_warning

if TYPE_CHECKING:
    from collections.abc import Sequence

    from wearsim.scene.sweep import Case, Sweep

SUMMARY = "run many campaigns, each resumable by itself, and write one table of them"
EXAMPLES = (
    "wearsim sweep workflows/sweep_rig.toml --out out\n"
    "wearsim sweep rig.toml --vary wheelset.radius_mm=420,460 --vary wear.form=local,patch_mean\n"
    "wearsim sweep cases.toml --out out --case $SLURM_ARRAY_TASK_ID\n"
    "wearsim sweep cases.toml --out /shared/out --cluster tcp://node1:8786"
)


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the flags."""
    parser.add_argument("scene", metavar="SCENE", help='sweep file (kind = "sweep"), or a scene to vary')
    parser.add_argument(
        "--out", metavar="DIR", help="directory of the sweep (default: the file's name without .toml)"
    )
    parser.add_argument(
        "--vary", metavar="KEY=VALUE,...", action="append", default=[],
        help="vary a key of the scene; given several times, every value with every other; an empty value "
        "removes the key, so that its default applies",
    )  # fmt: skip
    parser.add_argument("--table", metavar="CSV", help="cases of the scene, with columns named section.key")
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--case", metavar="K", type=int, help="run case K only, counted from 1 (job arrays)")
    what.add_argument("--list", action="store_true", help="show and check the cases; run nothing")
    add_worker_flags(parser, "the cases")
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
        return _run_one(sweep, out, arguments)
    return run_all(sweep, out, arguments)


def _list(sweep: Sweep, out: Path, as_json: bool) -> int:
    """Print all cases with their states; the exit code is 2 if one is impossible."""
    from wearsim.studies.sweep import case_line, listed_cases

    cases = listed_cases(sweep, out)
    if as_json:
        print_json({"title": sweep.title, "cases": cases})
    else:
        for case in cases:
            print(with_fault(f"{case_line(case)}: {case['state']}", case["fault"]))
    return 2 if any(case["fault"] for case in cases) else 0


def _run_one(sweep: Sweep, out: Path, arguments: argparse.Namespace) -> int:
    """Run one case; the exit code is its own."""
    from wearsim.studies.sweep import chosen, run_one

    case = chosen(sweep, arguments.case)
    _warn((case,), out)
    with observer() as observe:
        outcome = run_one(sweep, case, out, command=arguments.command_line, observer=observe)
    if arguments.json:
        print_json(asdict(outcome))
    elif not outcome.fault:
        print(f"case {case.number}: {outcome.state}, {out / case.name}")
    if outcome.fault:
        print(f"case {case.number}: {outcome.fault}", file=sys.stderr)
    return outcome.exit_code


def run_all(sweep: Sweep, out: Path, arguments: argparse.Namespace) -> int:
    """Run all cases and print where their table is; the exit code is that of the worst case."""
    from wearsim.studies import sweep as study
    from wearsim.studies.ensemble import running_text

    _warn(sweep.cases, out)
    report = case_lines("case", {case.number: case.label for case in sweep.cases})
    try:
        with workers(arguments.cluster, lambda: running_text(out)) as executor:
            outcomes = study.run_sweep(
                sweep, out, executor, jobs=arguments.jobs, command=arguments.command_line, report=report
            )
    except KeyboardInterrupt:
        print("interrupted; the same command goes on where the cases stopped", file=sys.stderr)
        return 130
    formula_warning((out / "sweep.csv").read_text(encoding="utf-8"), "sweep.csv")
    if getattr(arguments, "json", False):
        print_json(study.sweep_rows(study.sweep_dataset(out)))
    else:
        print(study.counted(outcomes))
        print(f"table: {out / 'sweep.csv'}, {out / 'sweep.nc'}")
    return max(outcome.exit_code for outcome in outcomes)


def _warn(cases: Sequence[Case], out: Path) -> None:
    from wearsim.studies.ensemble import check_cases

    for warning in check_cases(cases, out):
        print(f"warning: {warning}", file=sys.stderr)
