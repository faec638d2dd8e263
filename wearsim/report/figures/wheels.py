"""Wheels of campaigns as gauges measure them, flange up and left.

Wheels of several campaigns lie on each other; colours are those of the campaigns, lines
those of the wheels.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes

from wearsim.profile.measures import BELOW_TIP, EN_15313, LEVEL, MeasuringRule
from wearsim.profile.placement import RUNNING_CIRCLE
from wearsim.profile.shape import crossing, extremum
from wearsim.report.figures.campaign import NEW_Y, WHEELS, along, new_place
from wearsim.report.style import (
    COLOURS,
    OUTWARD,
    WHEEL_LINES,
    colour_of,
    distance_text,
    label,
    label_axes,
    own_axes,
    plain,
    role_of,
    values_of,
)
from wearsim.results.checks import last_worn_row, new_row

GAUGED = {
    "Sh": "flange_height",
    "Sd": "flange_thickness",
    "qR": "flange_gradient",
}
"""Measures of the flange by their symbols."""

DEPTH_LABEL = "Wear depth [µm]"
WORN_Y = "Lateral position on the wheel [mm]"
_BODY = "#f1efe9"
_DIMENSION = "#333333"
_BELOW = 13.0  # of the body that is drawn below the running circle [mm]
_ABOVE = 45.0  # room for dimension lines above it [mm]
_MARGIN = 3.0  # at both sides [mm]
_SPACING = 0.25  # of places along the wheel [mm]
_PATCH_OFFSET = 1.5  # of patches above the profile [mm]
_TEXT = 7.5
_LINE = 4.2  # height of a line of that text [mm]


def campaign_title(dataset: xr.Dataset, wheel: int) -> str:
    """Campaign, distance run [km] and wheel, for a legend."""
    run = distance_text(dataset["distance"].values[-1], 3)
    return f"{role_of(dataset)}, {run}, {WHEELS[wheel]} wheel"


def depth_title(dataset: xr.Dataset, wheel: int) -> str:
    """Campaign, distance over which a wheel took its wear depth [km], and wheel."""
    end = last_worn_row(dataset)
    start = new_row(dataset, end)
    if start == 0:
        return campaign_title(dataset, wheel)
    run = distance_text(np.diff(dataset["distance"].values[[start, end]])[0], 3)
    return f"{role_of(dataset)}, {run} since reprofiling, {WHEELS[wheel]} wheel"


def plot_shapes(datasets: Sequence[xr.Dataset], ax: Axes | None = None) -> Axes:
    """Draw the new profile and the worn ones of both wheels, in true scale.

    Flange up and left, with Sh, Sd and qR of all of them [mm]. Campaigns with different
    wheel profiles have a new one each.
    """
    ax = own_axes(ax)
    first = datasets[0]
    row = _start(first)
    y, z = (1e3 * first[f"profile_{axis}"].values[row, 0] for axis in "yz")
    ax.fill_between(y, z, -_BELOW, color=_BODY, lw=0.0)
    if _profiles_differ(datasets):
        for dataset in datasets:
            _plot_new(dataset, ax, ":", colour_of(dataset), f"{role_of(dataset)}, ")
    else:
        _plot_new(first, ax, "--", COLOURS["new"])
    for dataset in datasets:
        end = last_worn_row(dataset)
        for wheel, line in enumerate(WHEEL_LINES):
            worn = (
                1e3 * dataset[f"profile_{axis}"].values[end, wheel] for axis in "yz"
            )
            ax.plot(
                *worn,
                ls=line,
                lw=1.2,
                color=colour_of(dataset),
                label=campaign_title(dataset, wheel),
            )
    _call_out(datasets, row, y, z, ax)
    ax.set_aspect("equal", adjustable="box")
    ax.set_xlim(y.min() - _MARGIN, y.max() + _MARGIN)
    ax.set_ylim(-_BELOW, _ABOVE)
    return label_axes(ax, "", OUTWARD)


def _profiles_differ(datasets: Sequence[xr.Dataset]) -> bool:
    """Return True for campaigns whose wheels differ where their wear counts from.

    In the profile of either wheel, in what a gauge measures, in the state, or in the
    material that the lathe took.
    """
    starts = {
        (
            _state(_start(data)),
            *(str(data.attrs.get(f"wheel_profile_{side}")) for side in WHEELS),
            *(_measured_at_start(data, name) for name in GAUGED.values()),
            _place_at_start(data),
        )
        for data in datasets
    }
    return len(starts) > 1


def _start(dataset: xr.Dataset) -> int:
    """Row from which the wear of a campaign counts."""
    return new_row(dataset, last_worn_row(dataset))


def _measured_at_start(dataset: xr.Dataset, name: str) -> str:
    """Measure of the wheels from which wear counts: one of both, or right | left."""
    values = values_of(dataset, name, _start(dataset))
    return " | ".join(dict.fromkeys(f"{value:.2f}" for value in values))


def _place_at_start(dataset: xr.Dataset) -> float:
    """Height of the flange tip from which wear counts, to 0.1 mm [mm]."""
    return round(1e3 * float(dataset["profile_z"].values[_start(dataset), 0].max()), 1)


def _plot_new(
    dataset: xr.Dataset, ax: Axes, line: str, colour: str, whose: str = ""
) -> None:
    """Draw the new or reprofiled wheel of a campaign, both if their profiles differ."""
    row = _start(dataset)
    names = {str(dataset.attrs.get(f"wheel_profile_{side}")) for side in WHEELS}
    for wheel, side in enumerate(WHEELS if len(names) > 1 else ("",)):
        shape = (1e3 * dataset[f"profile_{axis}"].values[row, wheel] for axis in "yz")
        text = " ".join(filter(None, (_state(row), side, "wheel")))
        ax.plot(*shape, line, color=colour, lw=1.2, label=f"{whose}{text}")


def _state(row: int) -> str:
    """Name the state of the wheel from which wear counts, by its row."""
    return "reprofiled" if row else "new"


def _call_out(
    datasets: Sequence[xr.Dataset], row: int, y: np.ndarray, z: np.ndarray, ax: Axes
) -> None:
    """Draw Sh, Sd and qR where a gauge takes them, with their values."""
    height, thickness, gradient = (
        float(values_of(datasets[0], name, row, 0)) for name in GAUGED.values()
    )
    rule = _measuring_rule(datasets[0])
    circle, back = 1e3 * rule.circle_y, -1e3 * RUNNING_CIRCLE
    tip = int(np.argmax(z))
    tip_y, tip_z = extremum(y, z, tip)
    base = tip_z - height
    high = tip_z - 1e3 * BELOW_TIP
    above = tip_z + 5.0
    level, flank = base + 1e3 * rule.height, thickness + back
    upper = crossing(y, z, tip + int(np.flatnonzero(z[tip:] < high)[0]) - 1, high)
    lower, low = upper + gradient, base + 1e3 * LEVEL
    thin: dict[str, Any] = {"color": "#8a8a8a", "lw": 0.6}
    ax.plot([tip_y, circle + 5.0], [tip_z, tip_z], **thin)
    ax.plot([circle, circle], [base - 5.0, base + 5.0], ls=(0, (8, 2, 2, 2)), **thin)
    ax.plot([upper, upper], [high, above + 1.0], **thin)
    ax.plot([lower, lower], [low, above + 1.0], **thin)
    points = [(tip_y, tip_z), (circle, base), (flank, level), (upper, high)]
    points.append((lower, low))
    ax.plot(*np.array(points).T, "o", color="white", mec="#1a1a1a", ms=3.0, zorder=5)
    _dimension((circle + 3.0, base), (circle + 3.0, tip_z), ax)
    _dimension((back, level), (flank, level), ax)
    _dimension((upper, above), (lower, above), ax)
    places = {
        "Sh": (circle + 5.0, 0.5 * (base + tip_z)),
        "Sd": (back + 1.0, level - 8.5),
        "qR": (lower + 1.5, tip_z + 2.5 + 0.5 * _LINE * (1 + len(datasets))),
    }
    for symbol, place in places.items():
        _values(datasets, symbol, place, ax)


def _measuring_rule(dataset: xr.Dataset) -> MeasuringRule:
    """Places at which a result measures Sh and Sd; EN 15313 where it states none."""
    return MeasuringRule(
        float(dataset.attrs.get("measuring_height", EN_15313.height)),
        float(dataset.attrs.get("running_circle", EN_15313.running_circle)),
    )


def _dimension(start: tuple[float, float], end: tuple[float, float], ax: Axes) -> None:
    """Draw a dimension line."""
    arrow = {
        "arrowstyle": "<|-|>,head_width=0.15,head_length=0.4",
        "color": _DIMENSION,
        "lw": 0.9,
        "shrinkA": 0.0,
        "shrinkB": 0.0,
    }
    ax.annotate("", end, start, arrowprops=arrow, zorder=4)


def _values(
    datasets: Sequence[xr.Dataset],
    symbol: str,
    place: tuple[float, float],
    ax: Axes,
) -> None:
    """Write a measure of the wheels from which wear counts and of the worn ones [mm].

    Right | left wheel. Where the former differ, each campaign has its own before its
    worn ones, with its state if these differ, too.
    """
    name, differ = GAUGED[symbol], _profiles_differ(datasets)
    states = [_state(_start(data)) for data in datasets]
    if not differ:
        head = f"{symbol} {_measured_at_start(datasets[0], name)} {states[0]}"
    elif len(set(states)) == 1:
        head = f"{symbol} {states[0]}: worn"
    else:
        head = f"{symbol}: worn"
    lines = [(head, _DIMENSION)]
    for dataset, state in zip(datasets, states, strict=True):
        worn = values_of(dataset, name, last_worn_row(dataset))
        text = " | ".join(f"{value:.2f}" for value in worn)
        if differ:
            start = _measured_at_start(dataset, name)
            text = f"{start}{f' {state}' if len(set(states)) > 1 else ''}: {text}"
        lines.append((text, colour_of(dataset)))
    for index, (text, colour) in enumerate(lines):
        drop = _LINE * (index - 0.5 * (len(lines) - 1))
        ax.text(
            place[0],
            place[1] - drop,
            text,
            color=colour,
            fontsize=_TEXT,
            weight="bold" if index == 0 else "normal",
            va="center",
        )


def plot_depths(
    datasets: Sequence[xr.Dataset],
    ax: Axes | None = None,
    *,
    bands: xr.Dataset | None = None,
) -> Axes:
    """Draw the wear depth of both wheels at the end of campaigns [µm].

    With the band of the draws where there is one, of both wheels.
    """
    ax = own_axes(ax)
    for dataset in datasets:
        role = role_of(dataset)
        colour = colour_of(dataset)
        depth = 1e6 * along(dataset, "wear_depth", None)
        for wheel, line in enumerate(WHEEL_LINES):
            y = 1e3 * new_place(dataset, wheel)
            if bands is not None:
                low, _, high = 1e6 * bands[f"{role}_wear_depth_band"].values[:, wheel]
                text = f"{role}, 90 % of the draws"
                ax.fill_between(
                    y, low, high, color=colour, alpha=0.18, lw=0.0, label=text
                )
            text = depth_title(dataset, wheel)
            ax.plot(y, depth[wheel], ls=line, lw=1.2, color=colour, label=text)
    return label_axes(ax, NEW_Y, DEPTH_LABEL, 0.0)


def envelope(
    dataset: xr.Dataset, name: str, row: int, wheel: int, round_ends: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Largest value of a contact quantity at each place, over all operating points.

    Parameters
    ----------
    dataset : Dataset
        Result of a campaign.
    name : str
        Variable over (step, operating_point, patch).
    row, wheel : int
        Step; 0 for the right and 1 for the left wheel.
    round_ends : bool
        True: a half ellipse over the width of each patch, False: one value.

    Returns
    -------
    y, values : (n,) arrays
        Lateral position on the wheel [mm]; values in the shown unit, NaN where no patch
        lies.
    """
    on_wheel = (dataset["side"].values[row] == wheel) & np.isfinite(
        dataset["wheel_y"].values[row]
    )
    centre, width = (
        1e3 * dataset[key].values[row][on_wheel] for key in ("wheel_y", "width")
    )
    value = values_of(dataset, name, row)[on_wheel]
    y = np.arange(-70.0, 65.0, _SPACING)
    part = 2.0 * (y - centre[:, None]) / width[:, None]
    inside = np.abs(part) <= 1.0
    height = np.sqrt(np.maximum(1.0 - part**2, 0.0)) if round_ends else 1.0
    every = np.where(inside, value[:, None] * height, -np.inf).max(
        axis=0, initial=-np.inf
    )
    return y, np.where(np.isfinite(every), every, np.nan)


def plot_envelope(
    datasets: Sequence[xr.Dataset],
    name: str,
    ax: Axes | None = None,
    *,
    wheel: int = 0,
    round_ends: bool = True,
) -> Axes:
    """Draw the largest value of a contact quantity along the wheel, new and worn.

    See `envelope`.
    """
    ax = own_axes(ax)
    for dataset in datasets:
        role = role_of(dataset)
        looks = ((0, ":", "new"), (last_worn_row(dataset), "-", "worn"))
        for row, line, state in looks:
            y, values = envelope(dataset, name, row, wheel, round_ends)
            text = f"{role}, {state} wheel"
            ax.plot(y, values, line, lw=1.2, color=colour_of(dataset), label=text)
    return label_axes(ax, WORN_Y, label(datasets[0], name), 0.0)


def plot_patches_along(
    datasets: Sequence[xr.Dataset], ax: Axes | None = None, *, wheel: int = 0
) -> Axes:
    """Draw the patches of all operating points on the worn profiles, flange up.

    Those of each campaign lie beyond those of the one before; the more patches lie on
    each other, the darker they are.
    """
    ax = own_axes(ax)
    for index, dataset in enumerate(datasets):
        row = last_worn_row(dataset)
        y, z = (1e3 * dataset[f"profile_{axis}"].values[row, wheel] for axis in "yz")
        colour = colour_of(dataset)
        ax.fill_between(y, z, -_BELOW, color=_BODY, lw=0.0)
        ax.plot(y, z, lw=1.2, color=colour, label=f"{role_of(dataset)}, worn wheel")
        tip = int(np.argmax(z))
        on_wheel = (dataset["side"].values[row] == wheel) & np.isfinite(
            dataset["wheel_y"].values[row]
        )
        centre, width = (
            1e3 * dataset[key].values[row][on_wheel] for key in ("wheel_y", "width")
        )
        places = centre[:, None] + np.outer(width, np.linspace(-0.5, 0.5, 9))
        heights = np.interp(places, np.maximum.accumulate(y[tip:]), z[tip:])
        heights += _PATCH_OFFSET * (1 + index)
        look: dict[str, Any] = {"color": colour, "lw": 2.5}
        ax.plot(places.T, heights.T, alpha=0.35, solid_capstyle="butt", **look)
    ax.set_ylim(-_BELOW, 32.0)
    return label_axes(ax, WORN_Y, OUTWARD)


def plot_shares(shares: pd.DataFrame, ax: Axes | None = None, *, colour: str) -> Axes:
    """Draw shares of the distance and of the wear as bars [%].

    Parameters
    ----------
    shares : DataFrame
        Columns run and wear, a row for each block or class; the first one on top.
    ax : Axes, optional
        By default that of a new figure.
    colour : str
        Of the wear.
    """
    ax = own_axes(ax)
    place = np.arange(len(shares))
    grey = COLOURS["new"]
    ax.barh(place + 0.2, shares["run"], 0.34, color=grey, label="share of the distance")
    ax.barh(place - 0.2, shares["wear"], 0.4, color=colour, label="share of the wear")
    for row, (run, wear) in enumerate(shares[["run", "wear"]].to_numpy()):
        text = f"{shares.index[row]}: {plain(wear, 2)} %"
        ax.annotate(
            text,
            (max(run, wear), row),
            xytext=(4, 0),
            textcoords="offset points",
            va="center",
        )
    ax.set_yticks([])
    ax.set_xticks(np.arange(0, 101, 20))  # the rest is room for the names
    ax.invert_yaxis()
    ax.set_xlim(0.0, 1.6 * max(float(shares.to_numpy().max()), 1.0))
    return label_axes(ax, "Share [%]", "")
