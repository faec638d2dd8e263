"""Files of a report on published contact cases: Markdown, figures, dataset."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wearsim.report import figures_contact
from wearsim.report.folder import report_folder
from wearsim.report.published import markdown
from wearsim.report.style import COLOURS, SERIES_COLOURS, grid, legend, save_svg, style

_ROLLERS = (COLOURS["rig"], *SERIES_COLOURS[1:])
_LINES = ("-", "--", "-.", ":")


def write_published(
    dataset: xr.Dataset, states: Sequence[xr.Dataset], out: Path, stem: str, command: str
) -> Path:
    """Write the report on published cases with its figures and its dataset.

    Parameters
    ----------
    dataset : Dataset
        From `wearsim.studies.published.solve_published`.
    states : sequence of Dataset
        Contact states of its cases.
    out : Path
        Folder; made if it is not there.
    stem : str
        Of the file names.
    command : str
        Command line, for the report.

    Returns
    -------
    Path
        The Markdown file.

    Raises
    ------
    ResultError
        If the folder cannot be written to.
    """
    pictures = [
        (
            f"{stem}_patches.svg",
            "Outline and pressure of the patches by our solutions, by lateral shift.",
        ),
        (f"{stem}_stress.svg", "Shear stress on the wheel, stick and slip by our solutions."),
    ]
    with report_folder(out):
        for (name, _), figure in zip(pictures, (patches_figure(states), stress_figure(states)), strict=True):
            save_svg(figure, out / name)
        fill = {"_FillValue": netCDF4.default_fillvals["f8"]}
        numbers = {str(name): fill for name, values in dataset.variables.items() if values.dtype.kind == "f"}
        dataset.to_netcdf(out / f"{stem}.nc", engine="netcdf4", encoding=numbers)
        path = out / f"{stem}.md"
        path.write_text(markdown(dataset, command, pictures), encoding="utf-8")
    return path


def _by_shift(states: Sequence[xr.Dataset]) -> dict[float, list[xr.Dataset]]:
    """Group states by lateral shift, in the order of the cases."""
    groups: dict[float, list[xr.Dataset]] = {}
    for state in states:
        groups.setdefault(float(state["shift"]), []).append(state)
    return groups


def _frame(ax: Axes, states: Sequence[xr.Dataset]) -> None:
    """Give axes limits in which the patches of all states fit, so that their sizes can be compared."""
    outlines = [figures_contact.outline(state, 0) for state in states]
    across, along = (1.08 * max(float(np.nanmax(np.abs(line[k]))) for line in outlines) for k in (0, 1))
    box = ax.get_window_extent()
    shape = box.width / box.height
    half = max(along, across / shape)
    ax.set_xlim(-half * shape, half * shape)
    ax.set_ylim(-half, half)
    ax.set_aspect("equal", adjustable="box")


def patches_figure(states: Sequence[xr.Dataset]) -> Figure:
    """Outlines and pressure across the patches of rail and rollers, one column for each shift.

    Parameters
    ----------
    states : sequence of Dataset
        Contact states with one patch each.

    Returns
    -------
    Figure
        Outlines above, pressures below.
    """
    groups = _by_shift(states)
    with style():
        figure, axes = grid(2, len(groups), height=2.6, width=4.8 * len(groups), between=0.6)
        for column, (shift, group) in enumerate(groups.items()):
            rollers = iter(_ROLLERS)
            for number, state in enumerate(group):
                rail = state.attrs["counterface"] == "rail"
                look: dict[str, Any] = {
                    "color": COLOURS["rail"] if rail else next(rollers),
                    "linestyle": _LINES[number % len(_LINES)],
                }
                figures_contact.plot_outline(state, axes[0, column], **look)
                figures_contact.plot_pressure_along(state, axes[1, column], **look)
            _frame(axes[0, column], states)
            axes[1, column].set_xlim(axes[0, column].get_xlim())
            axes[0, column].set_title(f"Shift {1e3 * shift:g} mm")
        legend(figure, [axes[0, 0]])
    return figure


def stress_figure(states: Sequence[xr.Dataset]) -> Figure:
    """Shear stress, stick and slip; one row for each counterface, one column for each shift.

    Parameters
    ----------
    states : sequence of Dataset
        Contact states with one patch each.

    Returns
    -------
    Figure
        Arrows of one column have one scale.
    """
    groups = _by_shift(states)
    rows = max(len(group) for group in groups.values())
    with style():
        figure, axes = grid(rows, len(groups), height=2.9, width=4.8 * len(groups), between=0.75)
        for column, (shift, group) in enumerate(groups.items()):
            largest = max(float(np.hypot(state["shear_x"], state["shear_y"]).max()) for state in group)
            for row, state in enumerate(group):
                ax = figures_contact.plot_shear(state, axes[row, column], largest=largest)
                _frame(ax, group)
                ax.set_title(f"Shift {1e3 * shift:g} mm, {state.attrs['label']}")
            for row in range(len(group), rows):
                axes[row, column].remove()
    return figure
