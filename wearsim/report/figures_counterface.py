"""Figures of rails or rollers that wear: depth along the profile, and over the distance run."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from wearsim.report.figures import WHEELS
from wearsim.report.style import COLOURS, WHEEL_LINES, label, own_axes, role_of, shown, wrapped

_LIVES = 5  # earlier states drawn at most


def states_shown(dataset: xr.Dataset) -> list[int]:
    """Rows whose wear depth is drawn: those in which rollers are turned, some of them if many.

    Parameters
    ----------
    dataset : Dataset
        Result of a campaign whose counterface wears.

    Returns
    -------
    list of int
        Rising, the last row of the file at the end. Of rollers that were never turned, and of rails, rows
        nearest to a quarter, half and three quarters of the distance.
    """
    last = dataset.sizes["step"] - 1
    turnings = dataset["counterface_redressed_count"].values
    earlier = np.flatnonzero(np.diff(turnings) > 0) + 1  # such a row holds the depth before
    if earlier.size == 0:
        run = dataset["distance"].values
        earlier = np.array([np.argmin(np.abs(run - part * run[-1])) for part in (0.25, 0.5, 0.75)])
    elif earlier.size > _LIVES:
        earlier = earlier[np.linspace(0, earlier.size - 1, _LIVES).round().astype(np.int64)]
    return sorted({*(int(row) for row in earlier if 0 < row < last), last})


def plot_counterface_depth(dataset: xr.Dataset, ax: Axes | None = None, *, side: int = 0) -> Axes:
    """Draw the wear depth of a rail or roller along its profile, of `states_shown`, earlier ones faintly.

    Parameters
    ----------
    dataset : Dataset
        Result of a campaign whose counterface wears.
    ax : Axes, optional
        Where to draw.
    side : int
        0 right, 1 left.
    """
    ax = own_axes(ax)
    y = shown("counterface_y", dataset["counterface_profile_y"].values[0, side])
    rows = states_shown(dataset)
    for row in rows:
        end = row == rows[-1]
        ax.plot(
            y,
            shown("counterface_wear_depth", dataset["counterface_wear_depth"].values[row, side]),
            color=COLOURS[role_of(dataset)],
            lw=1.6 if end else 0.8,
            alpha=1.0 if end else 0.45,
            label="at the end" if end else "earlier",
        )
    ax.set_xlabel("Lateral position on the new profile [mm]")
    ax.set_ylabel(wrapped(label(dataset, "counterface_wear_depth")))
    ax.set_ylim(bottom=0.0, auto=None)
    return ax


def plot_counterface_over_distance(dataset: xr.Dataset, name: str, ax: Axes | None = None) -> Axes:
    """Draw a measure of both rails or rollers over the distance run, falling to 0 where they are turned.

    Parameters
    ----------
    dataset : Dataset
        Result of a campaign whose counterface wears.
    name : str
        counterface_max_wear_depth or another variable over (step, wheel).
    ax : Axes, optional
        Where to draw.
    """
    ax = own_axes(ax)
    run = shown("distance", dataset["distance"].values)
    values = shown(name, dataset[name].values)
    if name == "counterface_max_wear_depth":
        turned = np.flatnonzero(np.diff(dataset["counterface_redressed_count"].values) > 0) + 1
        run = np.insert(run, turned + 1, run[turned])
        values = np.insert(values, turned + 1, 0.0, axis=0)
    for side, where in enumerate(WHEELS):
        ax.plot(run, values[:, side], WHEEL_LINES[side], color=COLOURS[role_of(dataset)], label=where)
    ax.set_xlabel(label(dataset, "distance"))
    ax.set_ylabel(wrapped(label(dataset, name)))
    ax.set_ylim(bottom=0.0, auto=None)
    return ax
