"""`wearsim report`: the report of a run directory; warnings on its results."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from wearsim.cli.streams import print_warning
from wearsim.errors import NumericalError, ResultError, WearsimError, brief
from wearsim.results import load_results, result_warnings

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


def execute(arguments: argparse.Namespace) -> int:
    """Write the report, and as PDF with --pdf, and print where it is."""
    out = Path(arguments.directory)
    page = write_report(out)
    print(page)
    if arguments.pdf:
        _print_pdf(page)
    return 0


def _print_pdf(page: Path) -> None:
    """Print the report as PDF and its path, or state that no browser can do it.

    Raises `ResultError` if the browser that the user names is missing.
    """
    from wearsim.report import pdf

    program = pdf.browser()
    if program is not None:
        print(pdf.write_pdf(page, program))
        return
    advice = f"open {page} in a browser and print it"
    if named := os.environ.get(pdf.VARIABLE):
        raise ResultError(
            f"no PDF: {pdf.VARIABLE} names {brief(named)}, which is not found; {advice}"
        )
    print(
        f"no PDF: found no Chromium or Chrome, nor {pdf.VARIABLE}; {advice}",
        file=sys.stderr,
    )


def write_report(
    out: Path,
    results: Mapping[Path, xr.Dataset] | None = None,
    *,
    side_by_side: pd.DataFrame | None = None,
) -> Path:
    """Write the report of a campaign, some results of which may be loaded.

    The table of two campaigns `side_by_side` may be made, too. What the report needs is
    imported here, after the campaign has run.
    """
    from wearsim.report import html

    return html.write_report(out, results, side_by_side=side_by_side)


@contextmanager
def reported(out: Path) -> Iterator[None]:
    """Write the report of what a failed campaign has computed, too.

    Its first page states the reason.
    """
    try:
        yield
    except NumericalError:
        with suppress(WearsimError):  # no step was finished
            print(f"report: {write_report(out)}")
        raise


def print_warnings(results: Sequence[Path], name: str = "") -> dict[Path, xr.Dataset]:
    """Print the warnings on results of campaigns to standard error, with their names.

    The results are rig.nc and field.nc; `name` is that of a campaign in place of its
    kind. Returns these results.
    """
    loaded = {
        path: load_results(path) for path in results if path.stem in ("rig", "field")
    }
    for path, dataset in loaded.items():
        for line in result_warnings(dataset):
            print_warning(f"{name or path.stem}: {line}")
    return loaded
