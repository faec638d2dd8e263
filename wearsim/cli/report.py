"""`wearsim report`: the HTML report of a run directory; warnings on its results."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from wearsim.errors import NumericalError, WearsimError
from wearsim.results import load_results, result_warnings


def execute(arguments: argparse.Namespace) -> int:
    """Write the report and print where it is."""
    from wearsim.report.html import write_sweep_report
    from wearsim.studies.sweep import SWEEP_FILE

    directory = Path(arguments.directory)
    print((write_sweep_report if (directory / SWEEP_FILE).is_file() else write_report)(directory))
    return 0


def write_report(out: Path) -> Path:
    """Write the report of a campaign; what it needs is imported here, after the campaign has run."""
    from wearsim.report import html

    return html.write_report(out)


@contextmanager
def reported(out: Path) -> Iterator[None]:
    """Write the report of what a failed campaign has computed, too; its first page states the reason."""
    try:
        yield
    except NumericalError:
        with suppress(WearsimError):  # no step was finished
            print(f"report: {write_report(out)}")
        raise


def print_warnings(results: Sequence[Path]) -> None:
    """Print the warnings on the results of campaigns, which are rig.nc and field.nc, to standard error."""
    for path in results:
        if path.stem in ("rig", "field"):
            for line in result_warnings(load_results(path)):
                print(f"warning: {path.stem}: {line}", file=sys.stderr)
