"""Figures of profiles: `plot_x(inspection, ax=None) -> Axes`.

Wheels are drawn flange up and left, rails head up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wearsim.errors import listed
from wearsim.profile.conicity import Running
from wearsim.profile.inspection import Comparison, Inspection
from wearsim.profile.inspection.inputs import ProfileInput
from wearsim.profile.inspection.tables import FleetRow, track_text
from wearsim.profile.measures import BELOW_TIP, LEVEL, flange_thickness
from wearsim.profile.placement import RUNNING_CIRCLE
from wearsim.profile.shape import Profile, extremum
from wearsim.quantities import QUANTITIES
from wearsim.report.style import (
    COLOURS,
    OUTWARD,
    SERIES_COLOURS,
    WHEEL_LINES,
    label_axes,
    own_axes,
    plain,
    shape_axes,
    style,
    wrapped,
)

EXCEEDED = "#882255"
"""Measures beyond a limit."""

_BODY = "#1a1a1a"
_DIMENSION = "#0072b2"
_GREY = "#555555"
_FILL = "#f1efe9"
_BEHIND = 9.0  # material drawn behind the surface [mm]
_TREAD_SHIFT = 6e-3  # shifts whose radius differences set the scale [m]
_WIDTH, _PANEL = 10.0, 2.9  # of a figure, height of its lower rows [inch]
_LINE = 125  # characters of a title's line
_LEFT = {"adjustable": "box", "anchor": "W"}  # where axes of equal scales stand
_GAUGED = {"Sh": "flange_height", "Sd": "flange_thickness", "qR": "flange_gradient"}
_MOST_NAMES = 12  # profiles beyond a limit that a legend names


def plot_shape(result: Inspection, ax: Axes | None = None) -> Axes:
    """Draw a profile over its reference.

    Equal aspect, with Sh, Sd and qR of a wheel that has them.
    """
    ax = own_axes(ax)
    y, z = _mm(result.aligned)
    wheel = result.given.kind == "wheel"
    back = min(float(z.min()) - _BEHIND, 0.0) if wheel else float(z.max())
    ax.fill(
        np.concatenate((y, y[[-1, 0]])),
        np.concatenate((z, [back, back])),
        color=_FILL,
        lw=0.0,
    )
    if result.comparison is not None:
        reference = result.comparison.reference.profile
        ax.plot(
            *_mm(reference), color=COLOURS["new"], lw=1.2, ls="--", label=reference.name
        )
    if result.left is not None:
        # its measures have no dimension lines: its label names those beyond a limit
        beyond = ", ".join(QUANTITIES[name].meaning for name in result.beyond("left"))
        text = (
            f"{result.left.profile.name} (left wheel)"
            + f", beyond: {beyond} !" * bool(beyond)
        )
        ax.plot(
            *_mm(result.left.profile),
            color=SERIES_COLOURS[1],
            lw=1.2,
            ls=WHEEL_LINES[1],
            label=text,
        )
    ax.plot(y, z, color=_BODY, lw=1.5, label=result.given.profile.name)
    if wheel and result.measures["right"].values.keys() >= set(_GAUGED.values()):
        _dimensions(result, ax)
    place = (
        "from the running circle" if wheel else _origin(result.given, result.comparison)
    )
    height = OUTWARD if wheel else "Height, down [mm]"
    return shape_axes(
        ax, f"Lateral position {place}, to the field side [mm]", height, **_LEFT
    )


def _mm(profile: Profile) -> np.ndarray:
    """Lateral positions and heights (2, n) [mm]."""
    return 1e3 * np.array([profile.y, profile.z])


def _origin(rail: ProfileInput, comparison: Comparison | None) -> str:
    """Origin of the lateral position of a rail, in words."""
    if comparison is not None:
        return (
            "in the track"
            if comparison.reference.upright
            else f"of {comparison.reference.profile.name}"
        )
    return (
        "as measured"
        if rail.measured
        else "from the symmetry axis"
        if rail.upright
        else "in the track"
    )


def gauge_points(result: Inspection) -> np.ndarray:
    """Flange tip, running circle, points of Sd, qR lower and upper (5, 2) [m].

    Of measured Sh, Sd and qR.
    """
    profile, values = result.given.profile, result.measures["right"].values
    height, thickness, gradient = (values[name] for name in _GAUGED.values())
    tip_y, tip_z = extremum(profile.y, profile.z, int(np.argmax(profile.z)))
    rule = result.conditions.rule
    base, flank = tip_z - height, thickness - RUNNING_CIRCLE
    of_gradient = replace(rule, height=LEVEL)
    lower = (
        flange_thickness(profile.y, profile.z, of_gradient) - RUNNING_CIRCLE
        if rule.height != LEVEL
        else flank
    )
    y = np.array([tip_y, rule.circle_y, flank, lower, lower - gradient])
    z = np.array([tip_z, base, base + rule.height, base + LEVEL, tip_z - BELOW_TIP])
    return np.column_stack(
        (y, z) if result.comparison is None else result.comparison.alignment.moved(y, z)
    )


def _dimensions(result: Inspection, ax: Axes) -> None:
    """Draw Sh, Sd and qR where a gauge takes them."""
    tip, circle, flank, lower, upper = 1e3 * gauge_points(result)
    values, beyond = result.measures["right"].values, result.beyond("right")
    look = {
        name: EXCEEDED if row in beyond else _DIMENSION for name, row in _GAUGED.items()
    }
    back = circle[0] - 1e3 * result.conditions.running_circle
    above = tip[1] + 7.0
    thin: dict[str, Any] = {"color": "#8a8a8a", "lw": 0.6, "zorder": 1.5}
    ax.plot([circle[0]] * 2, [circle[1] - 6.0, above], ls=(0, (8, 2, 2, 2)), **thin)
    ax.plot([back] * 2, [circle[1] - 6.0, above], **thin)
    for point in (tip, circle):
        ax.plot([point[0], 24.0], [point[1]] * 2, **thin)
    for point in (lower, upper):
        ax.plot([point[0]] * 2, [point[1], above], **thin)
    # left of its line, for the legend stands on the right
    ax.text(
        circle[0] - 0.8,
        above - 0.4,
        "running circle",
        color=_GREY,
        fontsize=7.5,
        ha="right",
        va="top",
    )
    spans = {
        # ends of the arrow, place of the text and its alignment
        "Sh": (
            (20.0, circle[1]),
            (20.0, tip[1]),
            (22.2, 0.6 * tip[1] + 0.4 * circle[1]),
            "left",
            "center",
        ),
        "Sd": (
            (back, flank[1]),
            tuple(flank),
            (0.5 * (flank[0] + back), flank[1] - 0.6),
            "center",
            "top",
        ),
        "qR": (
            (upper[0], above - 1.5),
            (lower[0], above - 1.5),
            (lower[0] + 2.2, above - 1.5),
            "left",
            "center",
        ),
    }
    for name, (start, end, place, across, along) in spans.items():
        arrow = {
            "arrowstyle": "<|-|>,head_width=0.18,head_length=0.45",
            "color": look[name],
            "lw": 1.1,
            "shrinkA": 0.0,
            "shrinkB": 0.0,
        }
        ax.annotate("", end, start, arrowprops=arrow, zorder=4)
        text = (
            f"{name} "
            f"{1e3 * values[_GAUGED[name]]:.2f}{' !' if look[name] == EXCEEDED else ''}"
        )
        ax.text(
            *place,
            text.replace("-", "\N{MINUS SIGN}"),
            color=look[name],
            fontsize=9.0,
            weight="bold",
            ha=across,
            va=along,
            zorder=6,
        )
    points = np.array([tip, circle, lower, upper]).T
    ax.plot(*points, "o", color="white", markeredgecolor=_BODY, ms=4.0, zorder=5)


def plot_profiles(profiles: Sequence[Profile], ax: Axes | None = None) -> Axes:
    """Draw profiles of one kind over each other, equal aspect.

    The first of several is grey.
    """
    ax = own_axes(ax)
    if len(profiles) > 1:
        ax.plot(
            *_mm(profiles[0]),
            color=COLOURS["new"],
            lw=1.2,
            ls="--",
            label=profiles[0].name,
        )
    for index, profile in enumerate(profiles[1:] or profiles):
        colour = SERIES_COLOURS[index % len(SERIES_COLOURS)]
        ax.plot(*_mm(profile), color=colour, lw=1.5, label=profile.name)
    height = OUTWARD if profiles[0].kind == "wheel" else "Height, down [mm]"
    return shape_axes(ax, "Lateral position [mm]", height, **_LEFT)


def plot_depth(comparison: Comparison, ax: Axes | None = None) -> Axes:
    """Draw the wear depth along the reference, positive where material is gone."""
    ax = own_axes(ax)
    s, y, depth = (
        1e3 * column
        for column in (comparison.wear.s, comparison.wear.y, comparison.wear.depth)
    )
    ax.axhline(0.0, color=_GREY, lw=0.8)
    ax.fill_between(s, depth, 0.0, color=COLOURS["field"], alpha=0.18, lw=0.0)
    ax.plot(s, depth, color=COLOURS["field"], lw=1.4)
    deepest = int(np.argmax(depth))
    ax.plot(
        s[deepest],
        depth[deepest],
        "o",
        color="white",
        markeredgecolor=COLOURS["field"],
        zorder=4,
    )
    ax.set_xlim(s[0], s[-1])
    ax.margins(y=0.15)
    # second scale above: the lateral position, from the flange tip (rail: the gauge
    # side) on
    reach = np.maximum.accumulate(y)
    rising = np.concatenate(([True], reach[1:] > reach[:-1]))
    step = 10.0 if np.ptp(y) < 90.0 else 20.0
    marks = np.arange(np.ceil(y.min() / step) * step, y.max(), step)
    top = ax.secondary_xaxis("top")
    top.set_xticks(
        np.interp(marks, y[rising], s[rising]),
        [plain(mark, 3).split(".")[0] for mark in marks],
    )
    top.tick_params(labelsize=7.5, colors=_GREY, length=2.0, pad=1.5)
    top.set_xlabel("Lateral position [mm]", fontsize=7.5, color=_GREY, labelpad=3.5)
    area, place = plain(1e6 * comparison.wear.worn_area), plain(y[deepest], 3)
    title = (
        f"Worn area {area} mm², deepest {plain(depth[deepest], 3)} mm at y = {place} mm"
    )
    ax.set_title(title, pad=30.0)  # above the second scale
    x_label = f"Arc length along {comparison.reference.profile.name} [mm]"
    return label_axes(ax, x_label, "Wear depth along the\nnormal [mm]")


def _runs(result: Inspection) -> list[tuple[Running, str, dict[str, Any]]]:
    """Return the running behaviour of the reference and of the profile.

    Its name, and how it is drawn.
    """
    comparison, runs = result.comparison, list[tuple[Running, str, dict[str, Any]]]()
    if comparison is not None and comparison.running is not None:
        look = {"color": COLOURS["new"], "lw": 1.2, "ls": "--", "markersize": 3.5}
        runs.append((comparison.running, comparison.reference.profile.name, look))
    if result.running is not None:
        runs.append(
            (result.running, result.given.profile.name, {"color": SERIES_COLOURS[0]})
        )
    return runs


def plot_radius_difference(result: Inspection, ax: Axes | None = None) -> Axes:
    """Draw the rolling radius difference over the lateral shift."""
    ax = own_axes(ax)
    ax.axhline(0.0, color=_GREY, lw=0.8)
    ax.axvline(0.0, color=_GREY, lw=0.8)
    largest = 0.5
    for run, name, look in _runs(result):
        ax.plot(1e3 * run.shift, 1e3 * run.difference, label=name, **look)
        # beyond flange contact the difference runs off and would flatten all the rest
        inner = np.abs(1e3 * run.difference[np.abs(run.shift) <= _TREAD_SHIFT])
        largest = max(largest, float(inner.max(initial=0.0)))
    ax.set_ylim(-1.3 * largest, 1.3 * largest)
    ax.set_title("Rolling radius difference")
    x_label = "Lateral shift of the wheelset, to the right [mm]"
    return label_axes(ax, x_label, "Rolling radius difference [mm]", width=40)


def plot_conicity(result: Inspection, ax: Axes | None = None) -> Axes:
    """Draw equivalent conicity over the amplitude, where there is one.

    Values are written at the points of the profile, not of the reference.
    """
    ax = own_axes(ax)
    highest, undefined = 0.1, list[str]()
    for run, name, look in _runs(result):
        points = [
            (1e3 * at.amplitude, at.value)
            for at in run.equivalent_conicity
            if at.value is not None
        ]
        highest = max([highest, *(value for _, value in points)])
        ax.plot(
            [at for at, _ in points],
            [value for _, value in points],
            marker="o",
            label=name,
            **look,
        )
        if not points:
            undefined.append(name)
        for at, value in points if run is result.running else ():
            ax.annotate(
                f"{value:.3f}",
                (at, value),
                (0, 6),
                textcoords="offset points",
                ha="center",
                fontsize=7.5,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6},
            )
    if undefined:
        ax.text(
            0.5,
            0.5,
            f"{listed(undefined, ' and ')}: undefined at all amplitudes",
            transform=ax.transAxes,
            ha="center",
            va="center",
        )
    ax.set_xlim(min(0.5, ax.get_xlim()[0]), max(6.5, ax.get_xlim()[1]))
    ax.set_ylim(0.0, 1.25 * highest)
    ax.set_title("Equivalent conicity")
    return label_axes(ax, "Amplitude [mm]", "Equivalent conicity, EN 15302", width=40)


def profile_figure(result: Inspection) -> Figure:
    """Draw the shape of a profile with dimensions.

    Also wear depth, rolling radius difference and conicity.

    Rows without data are left out.
    """
    comparison, run, profiles = result.comparison, result.running, [result.aligned]
    title = [f"{result.given.profile.name}: {result.given.kind}, {result.given.title}"]
    rows: list[Any] = [["shape", "shape"]]
    if comparison is not None:
        rows.append(["depth", "depth"])
        profiles.append(comparison.reference.profile)
        alignment = comparison.alignment
        title.append(f"laid on {profiles[1].name}: {alignment.rule}, {alignment.note}")
    if run is not None:
        title.append(track_text(run))
        rows += [["difference", "conicity"]] if run.shift.size else []
    y, z = np.concatenate([_mm(profile) for profile in profiles], axis=1)
    span = (y.min() - 4.0, y.max() + 4.0)
    # room for the dimension lines and the legend beyond the tip
    wheel = result.given.kind == "wheel"
    heights_drawn = (z.min() - 5.0, z.max() + (14.0 if wheel else 3.0))
    shape = 0.8 + 9.0 * max(np.ptp(heights_drawn) / (span[1] - span[0]), 0.18)
    heights = [shape] + [_PANEL] * (len(rows) - 1)
    with style():
        figure = Figure(
            figsize=(_WIDTH, sum(heights) + 0.2 * len(title)), layout="constrained"
        )
        text = "\n".join(wrapped(line, _LINE) for line in title)
        figure.suptitle(text, x=0.01, ha="left", fontsize=9.5, weight="normal")
        axes = figure.subplot_mosaic(rows, height_ratios=heights)
        ax = plot_shape(result, axes["shape"])
        ax.set_xlim(*span)
        ax.set_ylim(*(heights_drawn if wheel else heights_drawn[::-1]))
        if comparison is not None or result.left is not None:
            ax.legend(loc="upper right" if wheel else "center", handlelength=2.2)
        if comparison is not None:
            plot_depth(comparison, axes["depth"])
        if "conicity" in axes:
            plot_radius_difference(result, axes["difference"])
            plot_conicity(result, axes["conicity"])
    return figure


def fleet_figure(rows: Sequence[FleetRow], reference: Profile | None) -> Figure:
    """Draw the profiles of a folder over each other and the reference.

    Wheels and rails by themselves.

    Those beyond a limit stand out by name.
    """
    measured = [(row.values, row.profile) for row in rows if row.profile is not None]
    kinds = list(dict.fromkeys(profile.kind for _, profile in measured))
    with style():
        figure = Figure(figsize=(_WIDTH, 3.8 * len(kinds)), layout="constrained")
        for ax, kind in zip(
            figure.subplots(len(kinds), 1, squeeze=False)[:, 0], kinds, strict=True
        ):
            if reference is not None and reference.kind == kind:
                ax.plot(
                    *_mm(reference),
                    color=COLOURS["new"],
                    lw=1.2,
                    ls="--",
                    label=reference.name,
                )
            texts = set[str]()
            for values, profile in measured:
                if profile.kind == kind:
                    beyond = ", ".join(
                        QUANTITIES[name].meaning for name in values["exceeded"]
                    )
                    text = (
                        f"{values['wheel']}: {beyond} !"
                        if beyond
                        else "not beyond a limit"
                    )
                    named = text not in texts and len(texts) < _MOST_NAMES
                    texts.add(text)
                    colour, width = (EXCEEDED, 1.2) if beyond else (_BODY, 0.6)
                    ax.plot(
                        *_mm(profile),
                        color=colour,
                        lw=width,
                        label=text if named else None,
                    )
            height = OUTWARD if kind == "wheel" else "Height, down [mm]"
            shape_axes(ax, f"Lateral position of {kind}s [mm]", height, **_LEFT)
            ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.18), ncols=3)
    return figure
