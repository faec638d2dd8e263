"""Small figures of many profiles: `plot_member(dataset, member, ax) -> Axes`, wheels flange down.

The datasets are those of `wearsim.profile.inspection.datasets.fleet_dataset`.
"""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure

from wearsim.report.figures.profile import EXCEEDED
from wearsim.report.style import (
    COLOURS,
    grid,
    legend,
    own_axes,
    shown,
    style,
    values_of,
    write_figure,
)
from wearsim.whole_files import write_whole

_BODY = "#1a1a1a"
NOT_JUDGED = "#b07a1e"
"""Colour of profiles that no limits were applied to, or that are open in some."""

_SHORT = {"flange_height": "Sh", "flange_thickness": "Sd", "flange_gradient": "qR", "hollowing": "hollow"}
_REACH = 40.0  # how far beyond the median a profile widens the axes [mm]
_LONGEST = 26  # characters of a title

COLUMNS, ROWS = 4, 7
"""Small figures on a page."""

MOST_PAGES = 40
"""Pages at most; what is beyond is not drawn."""

_WIDTH, _EDGE = 10.0, (0.6, 0.15)  # inch
_TOP, _BOTTOM, _GAP, _BETWEEN = 0.75, 0.5, 0.28, 0.3


def plot_member(dataset: xr.Dataset, member: int, ax: Axes | None = None) -> Axes:
    """Draw one profile over the reference, with its measures; those beyond a limit stand out."""
    ax = own_axes(ax)
    kind = str(dataset["kind"].values[member])
    if "reference_y" in dataset and dataset.attrs["reference_kind"] == kind:
        line = (shown(f"profile_{axis}", dataset[f"reference_{axis}"].values) for axis in "yz")
        ax.plot(*line, color=COLOURS["new"], lw=0.9, label=dataset.attrs["reference_label"])
    exceeded = str(dataset["exceeded"].values[member]).split()
    open_measures = str(dataset["not_judged"].values[member]).split()
    judged = bool(dataset["judged"].values[member]) and not open_measures
    colour = EXCEEDED if exceeded else _BODY if judged else NOT_JUDGED
    label = "beyond a limit" if exceeded else "within the limits" if judged else "not judged, or not in all"
    line = (values_of(dataset, f"profile_{axis}", member) for axis in "yz")
    ax.plot(*line, color=colour, lw=1.1, label=label)
    name = str(dataset["wheel_name"].values[member])
    ax.set_title(
        name if len(name) <= _LONGEST else f"…{name[1 - _LONGEST :]}",  # the end names the side
        fontsize=7.5, color=colour, pad=2.5, fontweight="bold" if exceeded else "normal",
    )  # fmt: skip
    texts = []
    for measure, short in _SHORT.items():
        if measure in dataset and dataset[f"known_{measure}"].values[member]:
            value = float(values_of(dataset, measure, member))
            mark = " !" if measure in exceeded else " ?" if measure in open_measures else ""
            texts.append((f"{short} {value + 0.0:.2f}{mark}", measure in exceeded))
    for k, (text, beyond) in enumerate(texts):
        ax.text(
            0.66 if k % 2 == 0 else 0.98, 0.22 - 0.17 * (k // 2), text,
            transform=ax.transAxes, ha="right", va="bottom", fontsize=6.5,
            color=EXCEEDED if beyond else "#444444", fontweight="bold" if beyond else "normal",
        )  # fmt: skip
    ax.tick_params(labelsize=6.5, length=2.0, pad=1.5)
    ax.grid(visible=True, lw=0.4)
    return ax


def limits_of(dataset: xr.Dataset) -> tuple[tuple[float, float], tuple[float, float]]:
    """Limits of lateral position and height: medians of the profiles' ends, and the reference [mm].

    Profiles that reach at most `_REACH` further widen them; one that was misread does not.
    """
    spans = []
    for axis in "yz":
        values = values_of(dataset, f"profile_{axis}")
        low, high = values.min(axis=1), values.max(axis=1)
        ends = [low[low >= np.median(low) - _REACH], high[high <= np.median(high) + _REACH]]
        if f"reference_{axis}" in dataset:
            ends.append(shown(f"profile_{axis}", dataset[f"reference_{axis}"].values))
        known = np.concatenate(ends)
        spans.append((float(known.min()) - 3.0, float(known.max()) + 3.0))
    return spans[0], spans[1]


def fleet_pages(dataset: xr.Dataset) -> Iterator[Figure]:
    """Give at most `MOST_PAGES` figures of at most `COLUMNS` x `ROWS` profiles with shared axes.

    A page is free before the next one is made.
    """
    total = dataset.sizes["wheel"]
    each = COLUMNS * ROWS
    pages = math.ceil(total / each)
    span_y, span_z = limits_of(dataset)
    columns = min(COLUMNS, total)
    width = (_WIDTH - sum(_EDGE) - (columns - 1) * _GAP) / columns
    height = min(width * (span_z[1] - span_z[0]) / (span_y[1] - span_y[0]), 2.6)
    for page in range(min(pages, MOST_PAGES)):
        members = range(page * each, min((page + 1) * each, total))
        rows = math.ceil(len(members) / columns)
        whole = _TOP + _BOTTOM + rows * height + (rows - 1) * _BETWEEN
        with style():
            edges = (*_EDGE, _BOTTOM, _TOP)
            figure, axes = grid(
                rows, columns, height, _WIDTH, _GAP, _BETWEEN, edges, sharex=True, sharey=True
            )
            for ax in axes.ravel()[len(members) :]:
                ax.set_axis_off()
            for ax, member in zip(axes.ravel(), members, strict=False):
                plot_member(dataset, member, ax)
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
    """Write the pages of a fleet: one PDF, or a PNG or SVG for each page with its number behind the name.

    Returns the files and the number of profiles on them; raises ResultError if one cannot be written.
    """
    drawn = min(dataset.sizes["wheel"], MOST_PAGES * COLUMNS * ROWS)
    if path.suffix.lower() == ".pdf":
        content = io.BytesIO()
        with style(), PdfPages(content, metadata={"CreationDate": None}) as book:
            for figure in fleet_pages(dataset):
                book.savefig(figure)
        write_whole(path, content.getvalue())
        return [path], drawn
    files = []
    for number, figure in enumerate(fleet_pages(dataset), start=1):
        name = path if number == 1 else path.with_name(f"{path.stem}-{number}{path.suffix}")
        files.append(write_figure(figure, name))
    return files, drawn
