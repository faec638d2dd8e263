"""Figures of rig against field: `plot_x(translation, ax=None) -> Axes`.

The datasets are those of `wearsim.translation.translate.translate`. `basis` is 0 at equal distance, 1 at
equal worn depth; `wheel` 0 for the right, 1 for the left one.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from wearsim.report.figures.campaign import NEW_Y, WHEELS, series_colour
from wearsim.report.style import (
    COLOURS,
    WHEEL_LINES,
    capital,
    label,
    label_axes,
    own_axes,
    shown,
    values_of,
    wrapped,
)

_FACTOR = "Factor, rig over field"
_X_LABELS = ("Distance run by each [km]", "Largest wear depth of each [mm]")


def basis_axis(translation: xr.Dataset, basis: int) -> np.ndarray:
    """Shown x values of a basis: distance run [km] (0), or largest wear depth [mm] (1)."""
    name, of = (("distance", "distance_run"), ("max_wear_depth", "worn_depth"))[basis]
    return shown(name, translation[of].values[basis, :, 0])


def plot_factor(
    translation: xr.Dataset,
    variable: str,
    ax: Axes | None = None,
    *,
    basis: int = 0,
    series: int = 0,
    text: str | None = None,
) -> Axes:
    """Draw a factor rig over field over distance or worn depth; gaps where it is undefined.

    `variable` is one over (basis, progress) or (basis, progress, wheel), of which the last is drawn: both
    wheels; `series` is its colour among the series, `text` its name in the legend.
    """
    ax = own_axes(ax)
    values = translation[f"{variable}_factor"].values[basis]
    values = values[:, -1] if values.ndim == 2 else values
    x = basis_axis(translation, basis)
    reachable = translation["reachable"].values[basis] == 1
    name = text or str(translation[variable].attrs.get("long_name", variable))
    ax.plot(x[reachable], values[reachable], color=series_colour(series), label=name)
    return label_axes(ax, _X_LABELS[basis], _FACTOR)


def mark_one(ax: Axes) -> Axes:
    """Mark the factor 1: rig and field alike."""
    ax.axhline(1.0, color="#999999", lw=0.8, ls=":")
    return ax


def plot_factor_at_points(
    translation: xr.Dataset, name: str, ax: Axes | None = None, *, progress: int = -1
) -> Axes:
    """Draw the factor of a contact quantity, such as "area", over the shift of equal operating points.

    There must be one; the basis is equal distance. `progress` is the index of the state: 0 new wheels, -1 as
    far as both campaigns come.
    """
    ax = own_axes(ax)
    shift = values_of(translation, "shift")
    order = np.argsort(shift, kind="stable")
    values = translation[f"{name}_point_factor"].values[0, progress]
    new = progress == 0
    for wheel, side in enumerate(WHEELS):
        ax.plot(
            shift[order], values[order, wheel], marker="o^"[wheel], ls=WHEEL_LINES[wheel], lw=0.9,
            color=COLOURS["new"] if new else COLOURS["difference"], markerfacecolor="white" if new else None,
            label=f"{'new' if new else 'worn'}, {side} wheel",
        )  # fmt: skip
    text = str(translation[f"{name}_point"].attrs["long_name"]).removesuffix(" at equal operating points")
    ax.set_title(wrapped(capital(text), 30))
    return label_axes(ax, label(translation, "shift"), _FACTOR)


def plot_depth_factor(
    translation: xr.Dataset, position: np.ndarray, ax: Axes | None = None, *, basis: int = 0, wheel: int = 0
) -> Axes:
    """Draw the factor of the wear depth along the profile at the quarters of the common range.

    The scale is logarithmic: twice as much and half as much are equally far from 1. `position`, an (n,)
    array, holds the lateral positions of the profile points on the new wheel [m].
    """
    ax = own_axes(ax)
    values = translation["wear_depth_profile_factor"].values[basis, :, wheel]
    for index, stage in enumerate(translation["stage"].values):
        last = index == translation.sizes["stage"] - 1
        ax.plot(
            shown("profile_y", position), values[index], color=COLOURS["difference"], lw=1.5 if last else 0.8,
            alpha=0.3 + 0.7 * (index + 1) / translation.sizes["stage"], label=f"{stage:.0%} of the range",
        )  # fmt: skip
    ax.set_yscale("log")
    known = values[np.isfinite(values) & (values > 0.0)]
    low, high = (known.min(), known.max()) if known.size else (1.0, 1.0)
    ax.set_ylim(max(0.01, min(0.5, 0.8 * low)), max(2.0, 1.25 * high))
    ax.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    ax.yaxis.set_minor_formatter(lambda _value, _: "")
    return label_axes(ax, NEW_Y, _FACTOR)


def plot_equivalent_distance(translation: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the field distance that wears as much as the rig, both wheels, by depth and by worn area."""
    ax = own_axes(ax)
    x = shown("distance", translation["rig_distance"].values)
    for series, (name, text) in enumerate(
        (("max_wear_depth", "equal largest depth"), ("worn_area", "equal worn area"))
    ):
        values = shown("distance", translation[f"equivalent_distance_{name}"].values[:, -1])
        ax.plot(x, values, color=series_colour(series), label=text)
    ax.set_xlim(left=0.0, auto=None)
    return label_axes(ax, "Distance run on the rig [km]", "Equivalent distance\nin the field [km]", 0.0)
