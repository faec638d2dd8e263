"""Figures of a profile: `plot_x(dataset, ax=None) -> Axes`; wheels are drawn flange down.

The datasets are those of `wearsim.profile.inspection.datasets`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wearsim.quantities import QUANTITIES
from wearsim.report.style import (
    COLOURS,
    SERIES_COLOURS,
    WHEEL_LINES,
    label,
    label_axes,
    own_axes,
    plain,
    shown,
    style,
    values_of,
    wrapped,
)

EXCEEDED = "#882255"
"""Measures beyond a limit."""

_BODY = "#1a1a1a"
_DIMENSION = "#0072b2"
_FILL = "#f1efe9"
_BEHIND = 9.0  # material drawn behind the surface [mm]
_ROOM = 2.2  # from a dimension line to its text [mm]
_TREAD_SHIFT = 6.0  # shifts whose radius differences set the scale [mm]
_TIP, _CIRCLE, _LOWER, _UPPER = range(4)
_WIDTH = 10.0  # inch
_EDGE = (0.85, 0.25)  # left and right of the axes [inch]
_PANEL = 2.1  # height of the lower panels [inch]
_LINE = 125  # characters of a title's line
_FLATTEST = 0.18  # height over width of the shape's axes at least
_GAP = 0.85  # between rows [inch]
_GAUGED = {"Sh": "flange_height", "Sd": "flange_thickness", "qR": "flange_gradient"}


def plot_shape(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw a profile over its reference, equal aspect, with Sh, Sd and qR if the dataset has gauge points."""
    ax = own_axes(ax)
    y, z = _points(dataset, "profile")
    wheel = dataset.attrs["kind"] == "wheel"
    back = min(float(z.min()) - _BEHIND, 0.0) if wheel else float(z.max())
    ax.fill(np.concatenate((y, y[[-1, 0]])), np.concatenate((z, [back, back])), color=_FILL, lw=0.0)
    others = {"reference": (COLOURS["new"], "--"), "left": (SERIES_COLOURS[1], WHEEL_LINES[1])}
    for name, (colour, line) in others.items():
        if f"{name}_y" in dataset:
            text = dataset.attrs[f"{name}_label"]
            ax.plot(*_points(dataset, name), color=colour, lw=1.2, ls=line, label=text)
    ax.plot(y, z, color=_BODY, lw=1.5, label=dataset.attrs["label"])
    if "gauge_y" in dataset:
        _dimensions(dataset, ax)
    ax.set_aspect("equal", adjustable="box")
    if not ax.yaxis_inverted():
        ax.invert_yaxis()
    origin = "from the running circle" if wheel else dataset.attrs.get("origin", "")
    place = " ".join(filter(None, ("Lateral position", origin)))
    height = "Height, outward\nis down [mm]" if wheel else "Height, down [mm]"
    return label_axes(ax, f"{place}, to the field side [mm]", height)


def _points(dataset: xr.Dataset, name: str) -> np.ndarray:
    """Lateral positions and heights (2, n) [mm]."""
    return shown("profile_y", [dataset[f"{name}_{axis}"].values for axis in "yz"])


def _dimensions(dataset: xr.Dataset, ax: Axes) -> None:
    """Draw Sh, Sd and qR where a gauge takes them."""
    y, z = _points(dataset, "gauge")
    exceeded = dataset.attrs.get("exceeded", "").split()
    names = [f"{name}_distance" for name in ("level", "below_tip", "running_circle")]
    level, below, circle = shown("profile_z", [dataset.attrs[name] for name in names])
    look = {name: EXCEEDED if row in exceeded else _DIMENSION for name, row in _GAUGED.items()}
    texts = {
        name: f"{name} {values_of(dataset, row):.2f}{' !' if row in exceeded else ''}"
        for name, row in _GAUGED.items()
    }
    back = y[_CIRCLE] - circle
    low = z[_TIP] + 7.0
    # running circle, flange back and the two levels
    _line(ax, (y[_CIRCLE], y[_CIRCLE]), (z[_CIRCLE] - 6.0, low), ls=(0, (8, 2, 2, 2)))
    # left of its line, for the legend stands on the right
    ax.text(
        y[_CIRCLE] - 0.8, low - 0.4, "running circle", color="#555555", fontsize=7.5, ha="right", va="bottom"
    )
    _line(ax, (back, back), (z[_CIRCLE] - 6.0, low))
    _line(ax, (y[_TIP], 24.0), (z[_TIP], z[_TIP]))
    _line(ax, (0.0, 24.0), (z[_CIRCLE], z[_CIRCLE]))
    _arrow(ax, (20.0, z[_CIRCLE]), (20.0, z[_TIP]), look["Sh"])
    _text(ax, 20.0 + _ROOM, 0.6 * z[_TIP] + 0.4 * z[_CIRCLE], texts["Sh"], look["Sh"])
    # Sd at its level, the level itself next to the root
    _arrow(ax, (back, z[_LOWER]), (y[_LOWER], z[_LOWER]), look["Sd"])
    _text(ax, 0.5 * (y[_LOWER] + back), z[_LOWER] - 0.6, texts["Sd"], look["Sd"], "center", "bottom")
    _line(ax, (y[_LOWER], -14.0), (z[_LOWER], z[_LOWER]))
    _arrow(ax, (-17.0, z[_CIRCLE]), (-17.0, z[_LOWER]), "#555555", 0.8)
    _text(ax, -17.0 + 0.6 * _ROOM, z[_LOWER] - 0.35 * level, f"{level:g}", "#555555")
    _line(ax, (-17.0, 0.0), (z[_CIRCLE], z[_CIRCLE]))
    # qR below the flange, its upper level on the other side of the tip
    for k in (_LOWER, _UPPER):
        _line(ax, (y[k], y[k]), (z[k], low))
    _arrow(ax, (y[_UPPER], low - 1.5), (y[_LOWER], low - 1.5), look["qR"])
    _text(ax, y[_LOWER] + _ROOM, low - 1.5, texts["qR"], look["qR"])
    left = back - 4.0
    for k in (_UPPER, _TIP):
        _line(ax, (left - 1.0, y[k]), (z[k], z[k]))
    for k, away in ((_UPPER, -4.0), (_TIP, 4.0)):
        _arrow(ax, (left, z[k] + away), (left, z[k]), "#555555", 0.8, "-|>")
    _text(ax, left - 0.6 * _ROOM, 0.5 * (z[_UPPER] + z[_TIP]), f"{below:g}", "#555555", "right")
    ax.plot(y[:4], z[:4], "o", color="white", markeredgecolor=_BODY, ms=4.0, zorder=5)


def _line(ax: Axes, y: Any, z: Any, ls: Any = "-") -> None:
    ax.plot(y, z, color="#8a8a8a", lw=0.6, ls=ls, zorder=1.5)


def _arrow(ax: Axes, start: Any, end: Any, colour: str, width: float = 1.1, style: str = "<|-|>") -> None:
    ax.annotate("", end, start, arrowprops={
        "arrowstyle": f"{style},head_width=0.18,head_length=0.45", "color": colour, "lw": width,
        "shrinkA": 0.0, "shrinkB": 0.0,
    }, zorder=4)  # fmt: skip


def _text(ax: Axes, y: float, z: float, text: str, colour: str, ha: Any = "left", va: Any = "center") -> None:
    text = text.replace("-", "\N{MINUS SIGN}")
    weight = "bold" if colour in (EXCEEDED, _DIMENSION) else "normal"
    size = 9.0 if weight == "bold" else 7.5
    ax.text(y, z, text, color=colour, fontsize=size, weight=weight, ha=ha, va=va, zorder=6)


def plot_depth(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the wear depth along the reference, positive where material is gone."""
    ax = own_axes(ax)
    s = values_of(dataset, "arc_length")
    depth = values_of(dataset, "wear_depth")
    ax.axhline(0.0, color="#555555", lw=0.8)
    ax.fill_between(s, depth, 0.0, color=COLOURS["field"], alpha=0.18, lw=0.0)
    ax.plot(s, depth, color=COLOURS["field"], lw=1.4)
    deepest = int(np.argmax(depth))
    ax.plot(s[deepest], depth[deepest], "o", color="white", markeredgecolor=COLOURS["field"], zorder=4)
    ax.set_xlim(s[0], s[-1])
    ax.margins(y=0.15)
    _lateral_ticks(dataset, ax, s)
    x_label = f"Arc length along {dataset.attrs['reference_label']} [mm]"
    return label_axes(ax, x_label, "Wear depth along the\nnormal [mm]")


def _lateral_ticks(dataset: xr.Dataset, ax: Axes, s: np.ndarray) -> None:
    """Second scale above: the lateral position, from the flange tip (rail: the gauge side) on."""
    y = shown("profile_y", dataset["wear_y"].values)
    reach = np.maximum.accumulate(y)
    rising = np.concatenate(([True], reach[1:] > reach[:-1]))
    step = 10.0 if np.ptp(y) < 90.0 else 20.0
    marks = np.arange(np.ceil(y.min() / step) * step, y.max(), step)
    top = ax.secondary_xaxis("top")
    top.set_xticks(np.interp(marks, y[rising], s[rising]), [plain(mark, 3).split(".")[0] for mark in marks])
    top.tick_params(labelsize=7.5, colors="#555555", length=2.5, pad=1.5)
    top.set_xlabel("Lateral position [mm]", fontsize=7.5, color="#555555", labelpad=3.5)


def _reference(dataset: xr.Dataset, *names: str) -> list[np.ndarray]:
    return [shown(name, dataset[f"reference_{name}"].values) for name in names]


def plot_radius_difference(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the rolling radius difference over the lateral shift."""
    ax = own_axes(ax)
    shift, values = (values_of(dataset, name) for name in ("shift", "rolling_radius_difference"))
    ax.axhline(0.0, color="#555555", lw=0.8)
    ax.axvline(0.0, color="#555555", lw=0.8)
    if "reference_shift" in dataset:
        line = _reference(dataset, "shift", "rolling_radius_difference")
        ax.plot(*line, color=COLOURS["new"], lw=1.2, ls="--", label=dataset.attrs["reference_label"])
    ax.plot(shift, values, label=dataset.attrs["label"], color=SERIES_COLOURS[0])
    # beyond flange contact the difference runs off and would flatten all the rest
    inner = np.abs(values[np.abs(shift) <= _TREAD_SHIFT])
    reach = 1.3 * max(inner.max(initial=0.0), 0.5)
    ax.set_ylim(-reach, reach)
    x_label = "Lateral shift of the wheelset, to the right [mm]"
    return label_axes(ax, x_label, label(dataset, "rolling_radius_difference"), width=40)


def plot_conicity(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the equivalent conicity over the amplitude."""
    ax = own_axes(ax)
    amplitude, conicity = (values_of(dataset, name) for name in ("amplitude", "equivalent_conicity"))
    highest = float(conicity.max(initial=0.1))
    if "reference_amplitude" in dataset:
        at, before = _reference(dataset, "amplitude", "equivalent_conicity")
        highest = float(before.max(initial=highest))
        ax.plot(at, before, color=COLOURS["new"], lw=1.2, ls="--", marker="o", ms=3.5)
    ax.plot(amplitude, conicity, color=SERIES_COLOURS[0], marker="o")
    for at, value in zip(amplitude, conicity, strict=True):
        ax.annotate(f"{value:.3f}", (at, value), (0, 6), textcoords="offset points", ha="center",
                    fontsize=7.5, bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6})  # fmt: skip
    if amplitude.size == 0:
        ax.text(0.5, 0.5, "undefined over all amplitudes", transform=ax.transAxes, ha="center", va="center")
    ax.set_xlim(0.5, 6.5)
    ax.set_ylim(0.0, 1.25 * highest)
    x_label = f"Amplitude [{QUANTITIES['amplitude'].shown_unit}]"
    return label_axes(ax, x_label, "Equivalent conicity, EN 15302", width=40)


def profile_figure(dataset: xr.Dataset) -> Figure:
    """Draw the shape of a profile with dimensions, wear depth, rolling radius difference and conicity.

    Rows without data are left out.
    """
    wear, runs = "wear_depth" in dataset, "shift" in dataset and dataset.sizes["shift"] > 0
    limits_y, limits_z = _window(dataset)
    inner = _WIDTH - sum(_EDGE)
    shape = min(inner / np.ptp(limits_y), 4.6 / np.ptp(limits_z)) * np.ptp(limits_z)
    heights = [shape] + [_PANEL] * (int(wear) + int(runs))
    # a title of two lines, the scale above the wear depth
    lines = _title(dataset)
    top, bottom = 0.3 + 0.17 * (lines.count("\n") + 1), 0.55
    gaps = [_GAP + (0.35 if wear and k == 0 else 0.0) for k in range(len(heights) - 1)]
    total = top + sum(heights) + sum(gaps) + bottom
    with style():
        figure = Figure(figsize=(_WIDTH, total))
        figure.text(_EDGE[0] / _WIDTH, 1.0 - 0.12 / total, lines, fontsize=9.5, va="top")

        def axes(row: int, column: int = 0, columns: int = 1) -> Axes:
            below = total - top - sum(heights[: row + 1]) - sum(gaps[:row])
            width = (inner - 0.9 * (columns - 1)) / columns
            left = _EDGE[0] + column * (width + 0.9)
            return figure.add_axes((left / _WIDTH, below / total, width / _WIDTH, heights[row] / total))

        ax = plot_shape(dataset, axes(0))
        ax.set_xlim(*limits_y)
        ax.set_ylim(*limits_z[::-1])
        ax.set_anchor("W")
        if "reference_y" in dataset or "left_y" in dataset:
            place: Any = "lower right" if dataset.attrs["kind"] == "wheel" else "center"
            ax.legend(loc=place, handlelength=2.2)
        if wear:
            plot_depth(dataset, axes(1)).set_title(_wear_title(dataset), pad=30.0)  # above the second scale
        if runs:
            row = len(heights) - 1
            plot_radius_difference(dataset, axes(row, 0, 2)).set_title("Rolling radius difference")
            plot_conicity(dataset, axes(row, 1, 2)).set_title("Equivalent conicity")
    return figure


def _window(dataset: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Limits of the shape: all points, and room for the dimension lines."""
    names = [name for name in ("profile", "reference") if f"{name}_y" in dataset]
    y, z = np.concatenate([_points(dataset, name) for name in names], axis=1)
    room = (12.0, 4.0, 5.0, 9.0) if "gauge_y" in dataset else (4.0, 4.0, 3.0, 3.0)
    if {"gauge_y", "reference_y", "left_y"} <= set(dataset.variables):
        room = (*room[:3], room[3] + 4.0)  # three lines of the legend below the tip
    span = np.array([y.min() - room[0], y.max() + room[1]])
    # a shape without a flange would be a stripe too low for its axis
    more = 0.5 * max(_FLATTEST * float(np.ptp(span)) - float(np.ptp(z)) - room[2] - room[3], 0.0)
    return span, np.array([z.min() - room[2] - more, z.max() + room[3] + more])


def _title(dataset: xr.Dataset) -> str:
    lines = [dataset.attrs[key] for key in ("title", "subtitle", "track") if dataset.attrs.get(key)]
    return "\n".join(wrapped(line, _LINE) for line in lines) or dataset.attrs["label"]


def _wear_title(dataset: xr.Dataset) -> str:
    deepest = int(np.argmax(dataset["wear_depth"].values))
    depth = plain(values_of(dataset, "wear_depth", deepest), 3)
    place = plain(shown("profile_y", dataset["wear_y"].values[deepest]), 3)
    area = plain(values_of(dataset, "worn_area"))
    return f"Worn area {area} mm², deepest {depth} mm at y = {place} mm"
