"""Pages of small figures of many profiles, all on the same axes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import xarray as xr
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure

from wearsim.errors import ResultError
from wearsim.report import figures_fleet
from wearsim.report.pages_profile import write_figure
from wearsim.report.style import legend, style

COLUMNS, ROWS = 4, 7
"""Small figures on a page."""

MOST_PAGES = 40
"""Pages at most; what is beyond is not drawn."""

_WIDTH, _EDGE = 10.0, (0.6, 0.15)  # inch
_TOP, _BOTTOM, _GAP, _BETWEEN = 0.75, 0.5, 0.28, 0.3


def fleet_pages(dataset: xr.Dataset) -> Iterator[Figure]:
    """Figures of a fleet, one after the other; a page is free before the next one is made.

    Parameters
    ----------
    dataset : Dataset
        Fleet state.

    Yields
    ------
    Figure
        Of at most `COLUMNS` x `ROWS` profiles with shared axes, at most `MOST_PAGES`.
    """
    total = dataset.sizes["wheel"]
    each = COLUMNS * ROWS
    pages = math.ceil(total / each)
    span_y, span_z = figures_fleet.limits_of(dataset)
    columns = min(COLUMNS, total)
    width = (_WIDTH - sum(_EDGE) - (columns - 1) * _GAP) / columns
    height = min(width * (span_z[1] - span_z[0]) / (span_y[1] - span_y[0]), 2.6)
    for page in range(min(pages, MOST_PAGES)):
        members = range(page * each, min((page + 1) * each, total))
        rows = math.ceil(len(members) / columns)
        whole = _TOP + _BOTTOM + rows * height + (rows - 1) * _BETWEEN
        with style():
            figure = Figure(figsize=(_WIDTH, whole))
            figure.subplots_adjust(
                left=_EDGE[0] / _WIDTH, right=1.0 - _EDGE[1] / _WIDTH, bottom=_BOTTOM / whole,
                top=1.0 - _TOP / whole, wspace=_GAP / width, hspace=_BETWEEN / height,
            )  # fmt: skip
            axes = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
            for ax in axes.ravel()[len(members) :]:
                ax.set_axis_off()
            for ax, member in zip(axes.ravel(), members, strict=False):
                figures_fleet.plot_member(dataset, member, ax)
                ax.set_aspect("equal", adjustable="box")
                if member + columns not in members:
                    ax.tick_params(labelbottom=True)  # the lowest of its column
            axes[0, 0].set_xlim(*span_y)
            axes[0, 0].set_ylim(span_z[1], span_z[0])
            figure.supxlabel("Lateral position [mm]", fontsize=8.0, y=0.12 / whole)
            figure.supylabel("Height, down [mm]", fontsize=8.0, x=0.12 / _WIDTH)
            legend(figure)
            figure.text(
                _EDGE[0] / _WIDTH, 1.0 - 0.36 / whole,
                f"profiles {members.start + 1} to {members.stop} of {total}"
                + (f", page {page + 1} of {pages}" if pages > 1 else ""),
                fontsize=7.5, color="#555555", va="center",
            )  # fmt: skip
        yield figure


def write_fleet(dataset: xr.Dataset, path: Path) -> tuple[list[Path], int]:
    """Write the pages of a fleet: one PDF, or a file for each page with its number behind the name.

    Parameters
    ----------
    dataset : Dataset
        Fleet state of at least one profile.
    path : Path
        Ends with .png, .svg or .pdf.

    Returns
    -------
    files : list of Path
        Written.
    drawn : int
        Number of profiles on them.

    Raises
    ------
    ResultError
        If a file cannot be written.
    """
    drawn = min(dataset.sizes["wheel"], MOST_PAGES * COLUMNS * ROWS)
    if path.suffix.lower() == ".pdf":
        try:
            with style(), PdfPages(path, metadata={"CreationDate": None}) as book:
                for figure in fleet_pages(dataset):
                    book.savefig(figure)
        except OSError as error:
            raise ResultError(
                f"{path}: cannot be written ({error.strerror}); choose another folder"
            ) from error
        return [path], drawn
    files = []
    for number, figure in enumerate(fleet_pages(dataset), start=1):
        name = path if number == 1 else path.with_name(f"{path.stem}-{number}{path.suffix}")
        files.append(write_figure(figure, name))
    return files, drawn
