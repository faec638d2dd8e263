"""`wearsim sweep`: many campaigns, from a sweep file or from one scene and the keys to vary."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wearsim.cli import Commands, add_command

if TYPE_CHECKING:
    from wearsim.scene import SweepScene
    from wearsim.scene.sweep import Sweep
    from wearsim.studies.sweep_directory import Outcome


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
        help="vary a key of the scene; given several times, every value with every other",
    )
    parser.add_argument("--table", metavar="CSV", help="cases of the scene, with columns named section.key")
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--case", metavar="K", type=int, help="run case K only, counted from 1 (job arrays)")
    what.add_argument("--list", action="store_true", help="show and check the cases; run nothing")
    parser.add_argument("--jobs", metavar="N", type=_jobs, help="processes (default: one per core)")
    parser.add_argument("--json", action="store_true", help="print JSON")


def _jobs(text: str) -> int:
    try:
        jobs = int(text)
    except ValueError:
        jobs = 0
    if not 1 <= jobs <= 1024:
        raise argparse.ArgumentTypeError(f"{text} must be a whole number, at least 1 and at most 1024")
    return jobs


def execute(arguments: argparse.Namespace) -> int:
    """Check all cases, then run or list them."""
    from wearsim.errors import Fault, SceneError
    from wearsim.scene import SweepScene, load_scene
    from wearsim.scene.sweep import sweep_of_flags
    from wearsim.studies.sweep import check_cases

    scene = load_scene(arguments.scene)
    if isinstance(scene, SweepScene):
        if arguments.vary or arguments.table:
            told = "a sweep file says itself what is varied; leave --vary and --table out"
            raise SceneError([Fault(told, arguments.scene)])
        sweep = sweep_of_scene(scene)
    else:
        sweep = sweep_of_flags(arguments.scene, arguments.vary, arguments.table)
    out = Path(arguments.out or Path(arguments.scene).stem)
    if arguments.list:
        return _list(sweep, out, arguments.json)
    for warning in check_cases(sweep, out, arguments.case):
        print(f"warning: {warning}", file=sys.stderr)
    if arguments.case is not None:
        return _one(sweep, arguments.case, out, arguments)
    return _all(sweep, out, arguments.jobs, arguments.command_line, arguments.json)


def sweep_of_scene(scene: SweepScene) -> Sweep:
    """Return the cases of a sweep file.

    Parameters
    ----------
    scene : SweepScene
        As loaded.
    """
    from wearsim.scene.sweep import Sweep

    sweep = scene._inputs
    assert isinstance(sweep, Sweep)
    return sweep


def run(scene: SweepScene, out: Path | None, command: str) -> int:
    """Run a sweep file for `wearsim run`.

    Parameters
    ----------
    scene : SweepScene
        As loaded.
    out : Path, optional
        Directory of the sweep; the file's name without .toml if not given.
    command : str
        Command line, for the history of the results.

    Returns
    -------
    int
        Exit code.
    """
    from wearsim.studies.sweep import check_cases

    sweep, out = sweep_of_scene(scene), out or Path(scene.origin.path.stem)
    for warning in check_cases(sweep, out):
        print(f"warning: {warning}", file=sys.stderr)
    return _all(sweep, out, None, command, False)


def plan(scene: SweepScene) -> dict[str, Any]:
    """Tell what a sweep file would run, for `wearsim check`.

    Parameters
    ----------
    scene : SweepScene
        As loaded.

    Returns
    -------
    dict
        Title and cases.
    """
    from wearsim.studies.sweep import check_cases
    from wearsim.studies.sweep_directory import plan_of

    sweep = sweep_of_scene(scene)
    return {**plan_of(sweep), "warnings": [str(warning) for warning in check_cases(sweep)]}


def text(told: dict[str, Any]) -> str:
    """Lines for `wearsim check` from what `plan` told.

    Parameters
    ----------
    told : dict
        From `plan`.
    """
    lines = [f"{told['title']}: {len(told['cases'])} cases"]
    lines += [_case_line(case["case"], case["scene"], case["values"]) for case in told["cases"]]
    return "\n".join(lines + [f"warning: {warning}" for warning in told["warnings"]])


def status_lines(out: Path) -> list[str]:
    """Lines for `wearsim status` on a sweep.

    Parameters
    ----------
    out : Path
        Directory of the sweep.
    """
    from wearsim.campaign.directory import read_status
    from wearsim.cli.progress import status_line
    from wearsim.studies.sweep_directory import outcomes_of, read_plan

    lines = []
    outcomes = outcomes_of(out)
    for entry, outcome in zip(read_plan(out)["cases"], outcomes, strict=True):
        campaigns = read_status(out / entry["directory"]).get("campaigns") or {}
        lines += [status_line(f"case {outcome.number}, {name}", item) for name, item in campaigns.items()]
        if not campaigns or (outcome.fault and not any(item.get("message") for item in campaigns.values())):
            lines.append(
                f"case {outcome.number}: {outcome.state}" + (f"; {outcome.fault}" if outcome.fault else "")
            )
    return [*lines, _counted(outcomes)]


def _counted(outcomes: tuple[Outcome, ...]) -> str:
    states = [outcome.state for outcome in outcomes]
    counts = [f"{states.count(state)} {state}" for state in dict.fromkeys(states)]
    return f"{len(outcomes)} cases: {', '.join(counts)}"


def _case_line(number: int, scene: str, values: dict[str, Any]) -> str:
    told = ", ".join(f"{key} = {value}" for key, value in values.items())
    return f"  case {number}: {scene}" + (f", {told}" if told else "")


def _list(sweep: Sweep, out: Path, as_json: bool) -> int:
    import json

    from wearsim.studies.sweep import fault_of
    from wearsim.studies.sweep_directory import outcomes_of, plan_of, read_plan

    cases = plan_of(sweep)["cases"]
    begun = read_plan(out).get("cases") == cases
    states = [item.state for item in outcomes_of(out)] if begun else ["not started"] * len(cases)
    faults = [
        fault_of(sweep, case["case"], out) if state == "not started" else ""
        for case, state in zip(cases, states, strict=True)
    ]
    states = ["impossible" if fault else state for state, fault in zip(states, faults, strict=True)]
    told = list(zip(cases, states, faults, strict=True))
    if as_json:
        listed = [{**case, "state": state, "fault": fault} for case, state, fault in told]
        print(json.dumps({"title": sweep.title, "cases": listed}, indent=2, ensure_ascii=False))
    else:
        for case, state, fault in told:
            line = f"{_case_line(case['case'], case['scene'], case['values'])}: {state}"
            print(f"{line}; {fault}" if fault else line)
    return 2 if any(faults) else 0


def _one(sweep: Sweep, number: int, out: Path, arguments: argparse.Namespace) -> int:
    import json
    from dataclasses import asdict

    from wearsim.cli.progress import observer
    from wearsim.studies.sweep import run_case

    with observer() as observe:
        outcome = run_case(sweep, number, out, command=arguments.command_line, observer=observe)
    if arguments.json:
        print(json.dumps(asdict(outcome), indent=2, ensure_ascii=False))
    elif not outcome.fault:
        print(f"case {number}: {outcome.state}, {out / sweep.cases[number - 1].name}")
    if outcome.fault:
        print(f"case {number}: {outcome.fault}", file=sys.stderr)
    return outcome.exit_code


def _all(sweep: Sweep, out: Path, jobs: int | None, command: str, as_json: bool) -> int:
    import json

    from wearsim.studies.sweep import run_sweep
    from wearsim.studies.sweep_table import sweep_dataset, sweep_rows

    ended: set[int] = set()

    def tell(outcome: Outcome) -> None:
        case = sweep.cases[outcome.number - 1]
        if outcome.state == "running":
            print(f"case {outcome.number}: begun, {case.label}", file=sys.stderr, flush=True)
            return
        ended.add(outcome.number)
        told = f"case {outcome.number}: {outcome.state} ({len(ended)} of {len(sweep.cases)})"
        print(f"{told}; {outcome.fault}" if outcome.fault else told, file=sys.stderr, flush=True)

    try:
        outcomes = run_sweep(sweep, out, jobs=jobs, command=command, told=tell)
    except KeyboardInterrupt:
        print("interrupted; the same command goes on where the cases stopped", file=sys.stderr)
        return 130
    if as_json:
        print(json.dumps(sweep_rows(sweep_dataset(out)), indent=2, ensure_ascii=False))
    else:
        print(_counted(outcomes))
        print(f"table: {out / 'sweep.csv'}, {out / 'sweep.nc'}")
    return max(outcome.exit_code for outcome in outcomes)
