"""Figures of rig against field: `plot_x(translation, ax=None) -> Axes`.

The datasets are those of `wearsim.translation.translate.translate`. `basis` is 0 at
equal distance, 1 at equal worn depth, 2 at equal worn area; `wheel` 0 for the right, 1
for the left one. Bands are datasets of `wearsim.translation.bands`.
"""

from __future__ import annotations

import itertools

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from wearsim.report.figures.campaign import WHEELS, new_place, series_colour
from wearsim.report.style import (
    COLOURS,
    WHEEL_LINES,
    capital,
    label,
    label_axes,
    own_axes,
    plain,
    role_of,
    shown,
    values_of,
    wrapped,
)
from wearsim.scene.input_names import input_heading
from wearsim.translation.bands import PER_KM, QUANTILES
from wearsim.translation.compare import CAMPAIGN, EQUIVALENT_BY

_FACTOR = "Factor, rig over field"
_X_LABELS = (
    "Distance run by each [km]",
    "Largest wear depth of each [mm]",
    "Worn area of each [mm²]",
)


def basis_axis(translation: xr.Dataset, basis: int) -> np.ndarray:
    """Shown x values of a basis.

    Distance run [km], largest wear depth [mm], or worn area [mm²].
    """
    name, of = (
        ("distance", "distance_run"),
        ("max_wear_depth", "worn_depth"),
        ("worn_area", "worn_area"),
    )[basis]
    values = translation[of].values[basis, :, 0]
    return shown(name, values if values.ndim == 1 else values[:, -1])


def plot_factor(
    translation: xr.Dataset,
    variable: str,
    ax: Axes | None = None,
    *,
    basis: int = 0,
    series: int = 0,
    text: str | None = None,
) -> Axes:
    """Draw a factor rig over field over distance, worn depth or area.

    Gaps where it is undefined.

    `variable` is one over (basis, progress) or (basis, progress, wheel), of which the
    last is drawn: both wheels; `series` is its colour among the series, `text` its name
    in the legend.
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
    """Draw the factor of a contact quantity over the shift of equal operating points.

    Quantities are named as in "area".

    There must be one; the basis is equal distance. `progress` is the index of the
    state: 0 new wheels, -1 as far as both campaigns come.
    """
    ax = own_axes(ax)
    shift = values_of(translation, "shift")
    order = np.argsort(shift, kind="stable")
    values = translation[f"{name}_point_factor"].values[0, progress]
    new = progress == 0
    for wheel, side in enumerate(WHEELS):
        ax.plot(
            shift[order],
            values[order, wheel],
            marker="o^"[wheel],
            ls=WHEEL_LINES[wheel],
            lw=0.9,
            color=COLOURS["new"] if new else COLOURS["difference"],
            markerfacecolor="white" if new else None,
            label=f"{'new' if new else 'worn'}, {side} wheel",
        )
    text = str(translation[f"{name}_point"].attrs["long_name"]).removesuffix(
        " at equal operating points"
    )
    ax.set_title(wrapped(capital(text), 30))
    return label_axes(ax, label(translation, "shift"), _FACTOR)


def plot_equivalent_distance(
    translation: xr.Dataset, ax: Axes | None = None, *, of: str = "rig"
) -> Axes:
    """Draw the distance of the other campaign that wears as much as one.

    By depth and by worn area.
    """
    ax = own_axes(ax)
    x = shown("distance", translation[f"{of}_distance"].values)
    counterpart = next(role for role in CAMPAIGN if role != of)
    for series, (name, text) in enumerate(EQUIVALENT_BY.items()):
        values = shown(
            "distance",
            translation[f"equivalent_{counterpart}_distance_{name}"].values[:, -1],
        )
        ax.plot(x, values, color=series_colour(series), label=f"equal {text}")
    ax.set_xlim(left=0.0, auto=None)
    where = {"rig": "on the rig", "field": "in the field"}
    return label_axes(
        ax,
        f"Distance run {where[of]} [km]",
        f"Equivalent distance\n{where[counterpart]} [km]",
        0.0,
    )


def plot_causes(
    translation: xr.Dataset, ax: Axes | None = None, *, way: int = -1
) -> Axes:
    """Draw how the causes lead from the wear of the field to that of the rig."""
    ax = own_axes(ax)
    factors = translation["cause_factor"].values[way]
    order = np.argsort(-np.abs(np.log(factors)), kind="stable")
    ends = np.cumprod([1.0, *factors[order]])
    names = [capital(str(translation["cause_name"].values[k])) for k in order]
    low, high = min(ends.min(), 1.0), max(ends.max(), 1.0)
    for place, (begin, end) in enumerate(itertools.pairwise(ends)):
        colour = COLOURS["rig"] if end >= begin else COLOURS["field"]
        ax.barh(place, end - begin, left=begin, color=colour, height=0.62)
        late = (
            begin * end > low * high
        )  # the label stands on the side where there is room
        ax.annotate(
            f"{names[place]} \N{MULTIPLICATION SIGN} {plain(end / begin, 3)}",
            ((min if late else max)(begin, end), place),
            xytext=(-4 if late else 4, 0),
            textcoords="offset points",
            va="center",
            ha="right" if late else "left",
        )
        ax.plot([end, end], [place, place + 1], color=COLOURS["difference"], lw=0.6)
    ax.barh(
        len(names), ends[-1] - 1.0, left=1.0, color=COLOURS["difference"], height=0.62
    )
    ax.annotate(
        f"rig over field: {plain(ends[-1], 3)}",
        (max(1.0, ends[-1]), len(names)),
        xytext=(4, 0),
        textcoords="offset points",
        va="center",
    )
    ax.set_xscale("log")
    ax.set_xlim(0.9 * low, high * (high / low) ** 0.3)
    ax.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    ax.xaxis.set_minor_formatter(lambda _value, _: "")
    ax.set_yticks([])
    ax.invert_yaxis()
    ax.axvline(1.0, color=COLOURS["difference"], lw=0.8)
    return label_axes(ax, "Worn area per distance over that of the field", "")


_WIDTH = f"{100 * (QUANTILES[-1] - QUANTILES[0]):.0f} %"


def _draw(
    ax: Axes,
    x: np.ndarray,
    nominal: np.ndarray,
    band: np.ndarray,
    colour: str,
    name: str,
) -> None:
    """Draw a line and its band."""
    ax.fill_between(
        x,
        band[0],
        band[-1],
        color=colour,
        alpha=0.2,
        lw=0,
        label=f"{name}, {_WIDTH} of the draws",
    )
    ax.plot(x, nominal, color=colour, label=f"{name}, nominal")


def plot_band(
    bands: xr.Dataset, role: str, name: str = "max_wear_depth", ax: Axes | None = None
) -> Axes:
    """Draw a measure of both wheels of one campaign ("rig", "field").

    Over its distance, with its band.
    """
    ax = own_axes(ax)
    x, variable = shown("distance", bands[f"{role}_way"].values), f"{role}_{name}"
    values = shown(name, bands[variable].values[:, -1])
    _draw(
        ax,
        x,
        values,
        shown(name, bands[f"{variable}_band"].values[..., -1]),
        COLOURS[role],
        role,
    )
    ax.set_xlim(left=0.0, auto=None)
    meaning = capital(str(bands[variable].attrs["long_name"]))
    return label_axes(ax, f"Distance run, {role} [km]", f"{meaning} [mm]", 0.0)


def plot_depth_band(
    bands: xr.Dataset, dataset: xr.Dataset, ax: Axes | None = None, *, wheel: int = 0
) -> Axes:
    """Draw the band of the wear depth along the profile, at the campaign's end."""
    ax, role = own_axes(ax), role_of(dataset)
    low, _, high = shown(
        "wear_depth", bands[f"{role}_wear_depth_band"].values[:, wheel]
    )
    x, name = (
        shown("profile_y", new_place(dataset, wheel)),
        f"{role}, {_WIDTH} of the draws",
    )
    ax.fill_between(x, low, high, color=COLOURS[role], alpha=0.2, lw=0, label=name)
    return ax


def plot_per_km(bands: xr.Dataset, basis: int = 0, ax: Axes | None = None) -> Axes:
    """Draw what 1 km on the rig stands for.

    Over the worn depth (basis 0) or worn area (1) of each.
    """
    ax = own_axes(ax)
    name = list(PER_KM)[basis]
    if basis:
        reached, text = (
            bands["worn_area_reached"].values[2, :, 0, -1],
            "Worn area of each [mm²]",
        )
        x = shown("worn_area", reached)
    else:
        x, text = (
            shown("max_wear_depth", bands["worn_depth"].values[1, :, 0]),
            "Largest depth of each [mm]",
        )
    _draw(
        ax,
        x,
        bands[name].values,
        bands[f"{name}_band"].values,
        COLOURS["difference"],
        "field over rig",
    )
    return label_axes(ax, text, "Field distance per\nrig distance [km/km]", 0.0)


def plot_sensitivity(bands: xr.Dataset, name: str, ax: Axes | None = None) -> Axes:
    """Draw what each input decides of an answer, with 90 % limits, largest on top."""
    ax = own_axes(ax)
    sensitivity = bands[f"{name}_sensitivity"]
    value, low, high = sensitivity.values.T
    order = np.argsort(np.abs(value), kind="stable")
    rows = np.arange(order.size)
    ax.barh(rows, value[order], color=COLOURS["new"], height=0.6)
    ax.hlines(rows, low[order], high[order], color="black", lw=1.0)
    names = [input_heading(str(name)) for name in bands["input_name"].values[order]]
    ax.set_yticks(rows, [wrapped(name, 44) for name in names])
    return label_axes(ax, capital(str(sensitivity.attrs["kind"])), "")
