"""Whole figures of profiles, put together from the plots of `figures_profile`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from wearsim.errors import ResultError
from wearsim.report import figures_profile
from wearsim.report.style import plain, save_svg, shown, style, wrapped

_WIDTH = 10.0  # inch
_EDGE = (0.85, 0.25)  # left and right of the axes [inch]
_PANEL = 2.1  # height of the lower panels [inch]
_LINE = 125  # characters of a title's line
_FLATTEST = 0.18  # height over width of the shape's axes at least
_GAP = 0.85  # between rows [inch]


def profile_figure(dataset: xr.Dataset) -> Figure:
    """Figure of one profile: shape with dimensions, wear depth, rolling radius difference, conicity.

    Parameters
    ----------
    dataset : Dataset
        Profile state; rows without data are left out.

    Returns
    -------
    Figure
        Not yet drawn.
    """
    wear, runs = "wear_depth" in dataset, "shift" in dataset and dataset.sizes["shift"] > 0
    limits_y, limits_z = _window(dataset)
    inner = _WIDTH - sum(_EDGE)
    scale = min(inner / np.ptp(limits_y), 4.6 / np.ptp(limits_z))
    shape = float(scale * np.ptp(limits_z))
    heights = [shape] + [_PANEL] * (int(wear) + int(runs))
    # a title of two lines, the scale above the wear depth
    lines = _title(dataset)
    top, bottom = 0.3 + 0.17 * (lines.count("\n") + 1), 0.55
    gaps = [_GAP + (0.35 if wear and k == 0 else 0.0) for k in range(len(heights) - 1)]
    total = top + sum(heights) + sum(gaps) + bottom
    with style():
        figure = Figure(figsize=(_WIDTH, total))
        figure.text(_EDGE[0] / _WIDTH, 1.0 - 0.12 / total, lines, fontsize=9.5, va="top")

        def axes(row: int, column: int = 0, columns: int = 1) -> tuple[float, float, float, float]:
            """Place of a panel in parts of the figure."""
            below = total - top - sum(heights[: row + 1]) - sum(gaps[:row])
            width = (inner - 0.9 * (columns - 1)) / columns
            left = _EDGE[0] + column * (width + 0.9)
            return (left / _WIDTH, below / total, width / _WIDTH, heights[row] / total)

        ax = figures_profile.plot_shape(dataset, figure.add_axes(axes(0)))
        ax.set_xlim(limits_y[0], limits_y[1])
        ax.set_ylim(limits_z[1], limits_z[0])
        ax.set_anchor("W")
        if "reference_y" in dataset or "left_y" in dataset:
            place: Any = "lower right" if dataset.attrs["kind"] == "wheel" else "center"
            ax.legend(loc=place, handlelength=2.2)
        row = 1
        if wear:
            panel = figures_profile.plot_depth(dataset, figure.add_axes(axes(row)))
            panel.set_title(_wear_title(dataset), pad=8.0)
            row += 1
        if runs:
            left = figures_profile.plot_radius_difference(dataset, figure.add_axes(axes(row, 0, 2)))
            left.set_title("Rolling radius difference")
            right = figures_profile.plot_conicity(dataset, figure.add_axes(axes(row, 1, 2)))
            right.set_title("Equivalent conicity")
    return figure


def _window(dataset: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Limits of the shape: all points, and room for the dimension lines."""
    y, z = (shown(f"profile_{axis}", dataset[f"profile_{axis}"].values) for axis in "yz")
    if "reference_y" in dataset:
        y = np.concatenate((y, shown("profile_y", dataset["reference_y"].values)))
        z = np.concatenate((z, shown("profile_z", dataset["reference_z"].values)))
    room = (12.0, 4.0, 5.0, 9.0) if "gauge_y" in dataset else (4.0, 4.0, 3.0, 3.0)
    if "gauge_y" in dataset and {"reference_y", "left_y"} <= set(dataset.variables):
        room = (*room[:3], room[3] + 4.0)  # three lines of the legend below the tip
    span = np.array([y.min() - room[0], y.max() + room[1]])
    # a shape without a flange would be a stripe too low for its axis
    more = 0.5 * max(_FLATTEST * float(np.ptp(span)) - float(np.ptp(z)) - room[2] - room[3], 0.0)
    return span, np.array([z.min() - room[2] - more, z.max() + room[3] + more])


def _title(dataset: xr.Dataset) -> str:
    lines = [dataset.attrs[key] for key in ("title", "subtitle", "track") if dataset.attrs.get(key)]
    return "\n".join(wrapped(line, _LINE) for line in lines) or dataset.attrs["label"]


def _wear_title(dataset: xr.Dataset) -> str:
    depth = shown("wear_depth", dataset["wear_depth"].values)
    deepest = int(np.argmax(depth))
    place = float(shown("profile_y", dataset["wear_y"].values)[deepest])
    area = float(shown("worn_area", dataset["worn_area"].values))
    return f"Worn area {plain(area)} mm², deepest {plain(depth[deepest], 3)} mm at y = {plain(place, 3)} mm"


def write_figure(figure: Figure, path: Path) -> Path:
    """Draw a figure into a file; the ending of its name says in which format.

    Parameters
    ----------
    figure : Figure
        Finished figure.
    path : Path
        Ends with .png, .svg or .pdf.

    Returns
    -------
    Path
        `path`.

    Raises
    ------
    ResultError
        If the file cannot be written.
    """
    kind = path.suffix[1:].lower()
    try:
        if kind == "svg":
            return save_svg(figure, path)
        with style():
            metadata = {"CreationDate": None} if kind == "pdf" else {"Software": None}
            figure.savefig(path, format=kind, dpi=150, metadata=metadata)
    except OSError as error:
        raise ResultError(f"{path}: cannot be written ({error.strerror}); choose another folder") from error
    return path
