"""`wearsim sweep`: many campaigns, by a sweep file or a scene and keys to vary."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from wearsim.cli import print_json
from wearsim.cli.progress import observer, runner, with_fault
from wearsim.cli.streams import formula_warning, print_layout, print_warning
from wearsim.errors import Fault, SceneError
from wearsim.scene import SweepScene, load_scene
from wearsim.scene.sweep import Case, Sweep, sweep_of_flags
from wearsim.studies import sweep as study
from wearsim.studies.ensemble import check_cases


def execute(arguments: argparse.Namespace) -> int:
    """Check all cases, then run or list them."""
    scene = load_scene(arguments.scene)
    if not isinstance(scene, SweepScene):
        sweep = sweep_of_flags(arguments.scene, arguments.vary, arguments.table)
        if arguments.table is not None:
            print_layout(arguments.table)
    elif arguments.vary or arguments.table:
        message = (
            "a sweep file states itself what is varied; leave --vary and --table out"
        )
        raise SceneError([Fault(message, arguments.scene)])
    else:
        sweep = study.sweep_of(scene)
    out = Path(arguments.out or Path(arguments.scene).stem)
    if arguments.list:
        return _list(sweep, out, arguments.json)
    if arguments.case is not None:
        return _run_one(sweep, out, arguments)
    return run_all(sweep, out, arguments)


def _list(sweep: Sweep, out: Path, as_json: bool) -> int:
    """Print all cases with their states; the exit code is 2 if one is impossible."""
    cases = study.listed_cases(sweep, out)
    if as_json:
        print_json({"title": sweep.title, "cases": cases})
    else:
        for case in cases:
            print(
                with_fault(f"{study.case_line(case)}: {case['state']}", case["fault"])
            )
    return 2 if any(case["fault"] for case in cases) else 0


def _run_one(sweep: Sweep, out: Path, arguments: argparse.Namespace) -> int:
    """Run one case; the exit code is its own."""
    case = study.chosen(sweep, arguments.case)
    _warn((case,), out)
    with observer(quiet=arguments.quiet) as observe:
        outcome = study.run_one(
            sweep, case, out, command=arguments.command_line, observer=observe
        )
    if arguments.json:
        print_json(outcome)
    elif not outcome.fault:
        print(f"case {case.number}: {outcome.state}, {out / case.name}")
    if outcome.fault:
        print(f"case {case.number}: {outcome.fault}", file=sys.stderr)
    return outcome.exit_code


def run_all(sweep: Sweep, out: Path, arguments: argparse.Namespace) -> int:
    """Run all cases and print where their table is.

    The exit code is that of the worst case.
    """
    _warn(sweep.cases, out)
    labels = {case.number: case.label for case in sweep.cases}
    try:
        with runner(arguments, "case", out, labels) as run:
            outcomes = study.run_sweep(sweep, out, run)
    except KeyboardInterrupt:
        print(
            "interrupted; the same command goes on where the cases stopped",
            file=sys.stderr,
        )
        return 130
    formula_warning((out / "sweep.csv").read_text(encoding="utf-8"), "sweep.csv")
    if arguments.json:
        print_json(study.sweep_rows(study.sweep_dataset(out)))
    else:
        print(study.counted(outcomes))
        print(f"table: {out / 'sweep.csv'}, {out / 'sweep.nc'}")
    return max(outcome.exit_code for outcome in outcomes)


def _warn(cases: Sequence[Case], out: Path) -> None:
    for warning in check_cases(cases, out):
        print_warning(warning)
