"""`wearsim sweep` on its cases: listed, one run, all run."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path

from wearsim.cli import print_json
from wearsim.cli.progress import observer
from wearsim.cli.streams import formula_warning
from wearsim.scene.sweep import Case, Sweep
from wearsim.studies import sweep as study
from wearsim.studies.ensemble import Outcome, check_cases


def with_fault(line: str, fault: str) -> str:
    """Line with its fault, if there is one."""
    return f"{line}; {fault}" if fault else line


def list_cases(sweep: Sweep, out: Path, as_json: bool) -> int:
    """Print all cases with their states; the exit code is 2 if one is impossible."""
    cases = study.listed_cases(sweep, out)
    if as_json:
        print_json({"title": sweep.title, "cases": cases})
    else:
        for case in cases:
            print(with_fault(f"{study.case_line(case)}: {case['state']}", case["fault"]))
    return 2 if any(case["fault"] for case in cases) else 0


def run_case(sweep: Sweep, number: int, out: Path, command: str, as_json: bool) -> int:
    """Run one case; the exit code is its own."""
    case = study.chosen(sweep, number)
    _warn((case,), out)
    with observer() as observe:
        outcome = study.run_one(sweep, case, out, command=command, observer=observe)
    if as_json:
        print_json(asdict(outcome))
    elif not outcome.fault:
        print(f"case {number}: {outcome.state}, {out / case.name}")
    if outcome.fault:
        print(f"case {number}: {outcome.fault}", file=sys.stderr)
    return outcome.exit_code


def run_all(sweep: Sweep, out: Path, jobs: int | None, command: str, as_json: bool) -> int:
    """Run all cases and print where their table is; the exit code is that of the worst case."""
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
        outcomes = study.run_sweep(sweep, out, jobs=jobs, command=command, report=report)
    except KeyboardInterrupt:
        print("interrupted; the same command goes on where the cases stopped", file=sys.stderr)
        return 130
    formula_warning((out / "sweep.csv").read_text(encoding="utf-8"), "sweep.csv")
    if as_json:
        print_json(study.sweep_rows(study.sweep_dataset(out)))
    else:
        print(study.counted(outcomes))
        print(f"table: {out / 'sweep.csv'}, {out / 'sweep.nc'}")
    return max(outcome.exit_code for outcome in outcomes)


def _warn(cases: tuple[Case, ...], out: Path) -> None:
    for warning in check_cases(cases, out):
        print(f"warning: {warning}", file=sys.stderr)
