"""Figures of the wear rates of operating points, see `wearsim.wear_rate`.

`wheel` is 0 for the right one.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from wearsim.report.figures.campaign import NEW_Y, WHEELS, series_colour
from wearsim.report.style import (
    COLOURS,
    WHEEL_LINES,
    label,
    label_axes,
    own_axes,
    shown,
    values_of,
)

DEPTH = "wear_depth_rate"
"""The quantity that every dataset of wear rates has."""

_NAMED = 6  # operating points with a colour and a name of their own
_MARKERS = ("o", "^")


def plot_along(
    dataset: xr.Dataset, name: str, ax: Axes | None = None, *, wheel: int = 0
) -> Axes:
    """Draw a quantity along the profile, a line for each operating point.

    Depths are those of all regimes together.

    Points that wear most have colours and names.
    """
    ax = own_axes(ax)
    rates = dataset.isel(wheel=wheel)
    values = (
        rates[name].sum("regime", keep_attrs=True)
        if "regime" in rates[name].dims
        else rates[name]
    )
    values = values.transpose("operating_point", "point")
    y, heights = (
        shown("profile_y", rates["profile_y"].values),
        shown(name, values.values),
    )
    order = np.argsort(-heights.max(axis=1), kind="stable")
    if order.size > _NAMED:
        look: dict[str, Any] = {"color": COLOURS["new"], "lw": 0.8, "alpha": 0.5}
        ax.plot(y, heights[order[_NAMED:]].T, **look)[0].set_label("others")
    for index, point in enumerate(sorted(order[:_NAMED])):
        text = str(dataset["operating_point"].values[point])
        ax.plot(
            y,
            heights[point],
            color=series_colour(index),
            lw=1.2,
            ls=WHEEL_LINES[wheel],
            label=text,
        )
    return label_axes(ax, NEW_Y, label(dataset, name), 0.0)


def plot_over_shift(dataset: xr.Dataset, name: str, ax: Axes | None = None) -> Axes:
    """Draw a quantity of both wheels over the shift of the operating points."""
    ax = own_axes(ax)
    shift = values_of(dataset, "shift")
    values = shown(name, dataset[name].transpose("operating_point", "wheel").values)
    for wheel, marker in enumerate(_MARKERS):
        ax.plot(
            shift,
            values[:, wheel],
            marker,
            color=series_colour(wheel),
            label=f"{WHEELS[wheel]} wheel",
        )
    return label_axes(ax, label(dataset, "shift"), label(dataset, name), 0.0)
