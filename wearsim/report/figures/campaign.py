"""Figures of one result: wheels, counterface, contact, comparison laws and fatigue.

A second call on the same axes lays another campaign over the first. Labels and units
come from the attributes of the dataset, colours from what it is: rig, field, rail.
`wheel` and `side` are 0 for the right and 1 for the left one; `distance` [m] is that of
the end if not given.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from wearsim.damage.fatigue.shakedown import boundaries
from wearsim.damage.titles import law_title
from wearsim.profile.shape import arc_length
from wearsim.report.style import (
    COLOURS,
    OUTWARD,
    REGIME_COLOURS,
    SERIES_COLOURS,
    WHEEL_LINES,
    colour_of,
    label,
    label_axes,
    own_axes,
    role_of,
    shape_axes,
    shown,
    values_of,
)
from wearsim.results.checks import last_worn_row, new_row, shear_yield
from wearsim.results.limits import limits_of
from wearsim.translation.factors import at_distances, rows_at

WHEELS = ("right", "left")
NEW_Y = "Lateral position on the new wheel [mm]"
LEAST_SPAN = 0.1
"""Least span of the axis of a measure, in its shown unit: what a gauge resolves."""
_MARKERS = ("o", "^")
_STATES = 5  # earlier states of a counterface drawn at most
_BOUNDARY_LINES = ("-", "--", "_")
_OF_STEPS = {
    "step_length": ("", "Length of the step [km]"),
    "stability_number": ("stability_limit", "Stability number S"),
    "step_error": ("error_tolerance", "Estimated error of the step [µm]"),
}
"""Quantities of the wear steps, with the attribute of their limit and their label."""


def series_colour(index: int) -> str:
    """Colour of a series, in turn."""
    return SERIES_COLOURS[index % len(SERIES_COLOURS)]


def along(dataset: xr.Dataset, name: str, distance: float | None) -> np.ndarray:
    """Give a variable at a distance [m] (None: in the last row that wheels ran)."""
    values: np.ndarray = dataset[name].values
    if distance is not None:
        values = at_distances(dataset["distance"].values, values, np.array([distance]))
    return values[last_worn_row(dataset) if distance is None else 0]


def _row(dataset: xr.Dataset, distance: float | None) -> int:
    if distance is None:
        return last_worn_row(dataset)
    return int(rows_at(dataset["distance"].values, np.array([distance]))[0])


def new_place(
    dataset: xr.Dataset, wheel: int, distance: float | None = None
) -> np.ndarray:
    """Lateral position of a wheel's points when it was new or last reprofiled [m].

    Depth and damage of `distance` stand at these (n,) places.
    """
    return np.asarray(
        dataset["profile_y"].values[new_row(dataset, _row(dataset, distance)), wheel]
    )


DRAWN_DEPTH = 6e-3
"""Depth that wear is drawn at most [m]: normals of a flange tip cross beyond 12 mm."""


def exaggeration(datasets: Iterable[xr.Dataset]) -> float:
    """Round factor that draws the deepest wear 3 to 6 mm deep, else 1."""
    deepest = max(
        float(data["wear_depth"].values[last_worn_row(data)].max()) for data in datasets
    )
    factors = (base * 10.0**power for power in range(7) for base in (1, 2, 3, 5, 7))
    return max(
        (
            factor
            for factor in factors
            if factor * deepest <= DRAWN_DEPTH and deepest > 0.0
        ),
        default=1.0,
    )


def worn_shape(
    dataset: xr.Dataset, wheel: int, distance: float | None, factor: float
) -> np.ndarray:
    """Worn profile, y and z (2, n).

    With its depth along the normal of the new one times a factor [m].
    """
    if factor == 1.0:
        return np.stack([along(dataset, f"profile_{c}", distance)[wheel] for c in "yz"])
    row = new_row(dataset, _row(dataset, distance))
    new = np.stack([dataset[f"profile_{c}"].values[row, wheel] for c in "yz"])
    tangent = np.gradient(new, axis=1)
    inward = np.stack([tangent[1], -tangent[0]]) / np.maximum(np.hypot(*tangent), 1e-12)
    return np.asarray(
        new + factor * along(dataset, "wear_depth", distance)[wheel] * inward
    )


def plot_profile(
    dataset: xr.Dataset,
    ax: Axes | None = None,
    *,
    wheel: int = 0,
    distance: float | None = None,
    new: bool = True,
) -> Axes:
    """Draw the worn wheel profile, flange up and left.

    With `new` the unworn one and the counterface above it, too.
    """
    ax = own_axes(ax)
    role = role_of(dataset)
    if new:
        reprofiled = new_row(dataset, _row(dataset, distance))
        y0, z0 = (dataset[f"profile_{c}"].values[reprofiled, wheel] for c in "yz")
        rail_y, rail_z = (
            dataset["counterface_y"].values,
            dataset["counterface_z"].values,
        )
        # lift the counterface until it touches the new wheel; both z point up here
        inside = (rail_y > y0.min()) & (rail_y < y0.max())
        order = np.argsort(y0)
        lift = np.max(
            np.interp(rail_y[inside], y0[order], z0[order]) - rail_z[inside],
            initial=-np.inf,
        )
        if np.isfinite(lift):
            ax.plot(
                shown("counterface_y", rail_y),
                shown("counterface_z", rail_z + lift),
                color=COLOURS["rail"],
                lw=1.0,
                label="counterface profile",
            )
        ax.plot(
            shown("profile_y", y0),
            shown("profile_z", z0),
            "--",
            color=COLOURS["new"],
            lw=1.2,
            label="reprofiled wheel" if reprofiled else "new wheel",
        )
    y, z = (along(dataset, f"profile_{axis}", distance)[wheel] for axis in "yz")
    ax.plot(
        shown("profile_y", y),
        shown("profile_z", z),
        color=colour_of(dataset),
        label=f"worn, {role}",
    )
    return shape_axes(ax, label(dataset, "profile_y"), OUTWARD, adjustable="datalim")


def plot_wear_depth(
    dataset: xr.Dataset,
    ax: Axes | None = None,
    *,
    wheel: int = 0,
    distance: float | None = None,
    history: bool = False,
) -> Axes:
    """Draw the wear depth along the profile.

    With `history` faintly that at quarters of the distance, too.
    """
    ax = own_axes(ax)
    role = role_of(dataset)
    end = float(dataset["distance"].values[-1]) if distance is None else distance
    faint: dict[str, Any] = {"lw": 0.8, "alpha": 0.45}
    last: dict[str, Any] = {
        "ls": WHEEL_LINES[wheel],
        "label": f"{role}, {WHEELS[wheel]} wheel",
    }
    earlier = [(part * end, faint) for part in (0.25, 0.5, 0.75) if history]
    for at, look in (*earlier, (distance, last)):
        depth = shown("wear_depth", along(dataset, "wear_depth", at)[wheel])
        x = shown("profile_y", new_place(dataset, wheel, at))
        ax.plot(x, depth, color=colour_of(dataset), **look)
    return label_axes(ax, NEW_Y, label(dataset, "wear_depth"), 0.0)


def plot_over_distance(dataset: xr.Dataset, name: str, ax: Axes | None = None) -> Axes:
    """Draw a measure of the wheels, wheelset, counterfaces, steps over the distance.

    Gaps where it is undefined; the depth of rollers is 0 after a redressing. A limit
    stands as a dotted line.
    """
    ax, role = own_axes(ax), role_of(dataset)
    colour, run, values = (
        colour_of(dataset),
        values_of(dataset, "distance"),
        values_of(dataset, name),
    )
    wheels, of_step, counterface = (
        values.ndim > 1,
        name in _OF_STEPS,
        name.startswith("counterface"),
    )
    if name == "counterface_max_wear_depth":
        redressed = (
            np.flatnonzero(np.diff(dataset["counterface_redressed_count"].values) > 0)
            + 1
        )
        run = np.insert(run, redressed + 1, run[redressed])
        values = np.insert(values, redressed + 1, 0.0, axis=0)
    run, values = run[of_step:], values[of_step:]
    for wheel, side in enumerate(WHEELS if wheels else ("",)):
        text = side if counterface else f"{role}, {side} wheel" if wheels else role
        line: dict[str, Any] = (
            {"marker": ".", "lw": 0.8} if of_step else {"ls": WHEEL_LINES[wheel]}
        )
        ax.plot(
            run,
            values[:, wheel] if wheels else values,
            color=colour,
            label=text,
            **line,
        )
    limit = (
        dataset.attrs.get(_OF_STEPS[name][0])
        if of_step
        else limits_of(dataset.attrs).get(name)
    )
    finite = values[np.isfinite(values)]
    if finite.size and not of_step:
        low = 0.5 * (finite.min() + finite.max() - LEAST_SPAN)
        low = max(low, 0.0) if finite.min() >= 0.0 else low
        least = [(run[0], low), (run[0], low + LEAST_SPAN)]
        ax.update_datalim(least, updatex=False)
        ax.autoscale_view()
    if limit is not None and finite.size:
        at, room = float(shown(name, limit)), 2.0 * np.ptp(finite)
        # a limit far away would hide what happens
        if of_step or finite.min() - room <= at <= finite.max() + room:
            ax.axhline(at, color=colour, lw=0.8, ls=":", label=f"limit, {role}")
    floor = 0.0 if of_step or counterface else None
    text = _OF_STEPS[name][1] if of_step else label(dataset, name)
    return label_axes(ax, label(dataset, "distance"), text, floor)


def _patch_marks(
    ax: Axes, dataset: xr.Dataset, row: int, x: np.ndarray, y: np.ndarray, alpha: float
) -> None:
    """Draw a mark for every patch.

    One form for each wheel, hollow ones where it is new.
    """
    colour = colour_of(dataset)
    for wheel, which in enumerate(WHEELS):
        on_wheel = (dataset["side"].values[row] == wheel) & np.isfinite(y)
        ax.plot(
            x[on_wheel],
            y[on_wheel],
            _MARKERS[wheel],
            color=colour,
            markerfacecolor=colour if row else "white",
            alpha=alpha,
            label=f"{'worn' if row else 'new'}, {which} wheel",
        )


def plot_contact(
    dataset: xr.Dataset, name: str, ax: Axes | None = None, *, new: bool = False
) -> Axes:
    """Draw a contact quantity of every patch over the shift of its operating point.

    `name` is a variable over (step, operating_point, patch), such as "wheel_y"; drawn
    is the end, or with `new` the new wheel (hollow marks).
    """
    ax = own_axes(ax)
    row = 0 if new else last_worn_row(dataset)
    values = values_of(dataset, name, row)
    shift = np.broadcast_to(values_of(dataset, "shift")[:, None], values.shape)
    _patch_marks(ax, dataset, row, shift, values, 1.0 if new else 0.75)
    return label_axes(ax, label(dataset, "shift"), label(dataset, name))


def plot_patches(
    dataset: xr.Dataset,
    ax: Axes | None = None,
    *,
    wheel: int = 0,
    distance: float | None = None,
) -> Axes:
    """Draw patches of all operating points, with widths, on the worn wheel profile.

    Patches are those of the last stored state; where several lie on each other the line
    is darker.
    """
    ax, row = (
        plot_profile(dataset, ax, wheel=wheel, distance=distance, new=False),
        _row(dataset, distance),
    )
    y, z = (along(dataset, f"profile_{c}", distance)[wheel] for c in "yz")
    arc = arc_length(y, z)
    on_wheel = (dataset["side"].values[row] == wheel) & np.isfinite(
        dataset["wheel_y"].values[row]
    )
    tip = int(np.argmax(z))  # before it y of the flank occurs once more
    middle = np.interp(
        dataset["wheel_y"].values[row][on_wheel],
        np.maximum.accumulate(y[tip:]),
        arc[tip:],
    )
    half = 0.5 * dataset["width"].values[row][on_wheel]
    look: dict[str, Any] = {
        "color": COLOURS["difference"],
        "lw": 5.0,
        "alpha": 0.3,
        "solid_capstyle": "butt",
    }
    for index, (start, end) in enumerate(
        zip(middle - half, middle + half, strict=True)
    ):
        part = np.concatenate(([start], arc[(arc > start) & (arc < end)], [end]))
        at = (
            shown("profile_y", np.interp(part, arc, y)),
            shown("profile_z", np.interp(part, arc, z)),
        )
        ax.plot(*at, label=None if index else "patches", **look)
    return ax


def plot_wear_by_regime(
    dataset: xr.Dataset, ax: Axes | None = None, *, wheel: int = 0
) -> Axes:
    """Draw the wear depth along the profile, stacked by wear regime."""
    ax = own_axes(ax)
    y = shown("profile_y", new_place(dataset, wheel))
    depth = shown(
        "wear_depth_by_regime", along(dataset, "wear_depth_by_regime", None)[wheel]
    )
    total = np.zeros_like(y)
    for index, name in enumerate(dataset["regime_name"].values):
        colour = REGIME_COLOURS[index % len(REGIME_COLOURS)]
        ax.fill_between(
            y, total, total + depth[index], color=colour, lw=0.0, label=str(name)
        )
        total = total + depth[index]
    ax.plot(y, total, color=colour_of(dataset), lw=1.0)
    return label_axes(ax, NEW_Y, label(dataset, "wear_depth"), 0.0)


def states_shown(dataset: xr.Dataset) -> list[int]:
    """Rows whose counterface depth is drawn, rising, the last of the file at the end.

    Those in which rollers are redressed, some of them if many; of rollers that never
    were, and of rails, rows nearest to a quarter, half and three quarters of the
    distance.
    """
    last = dataset.sizes["step"] - 1
    redressed = dataset["counterface_redressed_count"].values
    earlier = (
        np.flatnonzero(np.diff(redressed) > 0) + 1
    )  # such a row holds the depth before
    if earlier.size == 0:
        run = dataset["distance"].values
        earlier = np.array(
            [np.argmin(np.abs(run - part * run[-1])) for part in (0.25, 0.5, 0.75)]
        )
    elif earlier.size > _STATES:
        earlier = earlier[
            np.linspace(0, earlier.size - 1, _STATES).round().astype(np.int64)
        ]
    return sorted({*(int(row) for row in earlier if 0 < row < last), last})


def plot_counterface_depth(
    dataset: xr.Dataset, ax: Axes | None = None, *, side: int = 0
) -> Axes:
    """Draw the wear depth of a rail or roller along its profile.

    Of `states_shown`, earlier ones faintly.
    """
    ax = own_axes(ax)
    y = shown("counterface_y", dataset["counterface_profile_y"].values[0, side])
    *earlier, end = states_shown(dataset)
    faint: dict[str, Any] = {"lw": 0.8, "alpha": 0.45, "label": "earlier"}
    for row, look in (
        *((row, faint) for row in earlier),
        (end, {"label": "at the end"}),
    ):
        depth = values_of(dataset, "counterface_wear_depth", row, side)
        ax.plot(y, depth, color=colour_of(dataset), **look)
    place = "Lateral position on the new profile [mm]"
    return label_axes(ax, place, label(dataset, "counterface_wear_depth"), 0.0)


def plot_wear_laws(
    dataset: xr.Dataset, ax: Axes | None = None, *, wheel: int = 0
) -> Axes:
    """Draw the wear depth along the profile by the active and each comparison law."""
    ax = own_axes(ax)
    row, y = last_worn_row(dataset), shown("profile_y", new_place(dataset, wheel))
    active = law_title(str(dataset.attrs.get("wear_law", "active law")))
    depth = values_of(dataset, "wear_depth", row, wheel)
    ax.plot(y, depth, color=colour_of(dataset), lw=2.2, label=f"{active}, active")
    for k, name in enumerate(dataset["comparison_name"].values):
        depth = values_of(dataset, "comparison_wear_depth", row, wheel, k)
        ax.plot(
            y, depth, color=series_colour(k + 1), lw=1.2, label=law_title(str(name))
        )
    return label_axes(ax, NEW_Y, label(dataset, "wear_depth"), 0.0)


def plot_fatigue_damage(
    dataset: xr.Dataset, ax: Axes | None = None, *, wheel: int = 0
) -> Axes:
    """Draw the fatigue damage along the profile, each law over its largest."""
    ax = own_axes(ax)
    y = shown("profile_y", new_place(dataset, wheel))
    damage = dataset["fatigue_damage"].values[last_worn_row(dataset)]
    for k, name in enumerate(dataset["fatigue_name"].values):
        largest = float(damage[:, k].max())
        if largest > 0.0:
            ax.plot(
                y,
                damage[wheel, k] / largest,
                color=series_colour(k),
                label=law_title(str(name)),
            )
    ax.set_ylim(0.0, 1.05)
    return label_axes(ax, NEW_Y, "Fatigue damage over the largest of the law")


def plot_magic_wear_rate(
    dataset: xr.Dataset, ax: Axes | None = None, *, law: int, wheel: int = 0
) -> Axes:
    """Draw the wear rate, and the one at which cracks of a law just do not grow.

    Along the profile.
    """
    ax = own_axes(ax)
    row = last_worn_row(dataset)
    y = shown("profile_y", new_place(dataset, wheel))
    wear = values_of(dataset, "wear_depth_rate", row, wheel)
    magic = values_of(dataset, "magic_wear_rate", row, wheel, law)
    text = "magic wear rate: cracks just do not grow"
    look: dict[str, Any] = {
        "color": SERIES_COLOURS[3],
        "alpha": 0.35,
        "lw": 0.0,
        "label": "cracks grow",
    }
    ax.plot(y, wear, color=colour_of(dataset), label="wear")
    ax.plot(y, magic, "--", color=COLOURS["difference"], lw=1.2, label=text)
    ax.fill_between(y, wear, magic, where=magic > wear, **look)
    return label_axes(ax, NEW_Y, label(dataset, "wear_depth_rate"), 0.0)


def shakedown_place(dataset: xr.Dataset, row: int) -> tuple[np.ndarray, np.ndarray]:
    """Return utilised friction and p0/k of a row.

    Shape (operating_point, patch), NaN without a patch [-].
    """
    shear = np.hypot(dataset["force_x"].values[row], dataset["force_y"].values[row])
    load = dataset["normal_force"].values[row]
    friction = np.divide(shear, load, out=np.full_like(shear, np.nan), where=load > 0.0)
    return friction, dataset["max_pressure"].values[row] / shear_yield(dataset)


def plot_shakedown(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the shakedown map with every contact patch, new and worn."""
    ax = own_axes(ax)
    places = {row: shakedown_place(dataset, row) for row in (0, last_worn_row(dataset))}
    most = max(
        float(np.nanmax(friction, initial=0.0)) for friction, _ in places.values()
    )
    for line, curve in zip(
        _BOUNDARY_LINES, boundaries(max(0.6, 1.1 * most)), strict=True
    ):
        ax.plot(
            curve.friction,
            curve.ratio,
            line,
            color="#444444",
            markersize=12.0,
            label=curve.label,
        )
    for row, (friction, ratio) in places.items():
        ratio = np.where(np.isfinite(friction), ratio, np.nan)
        _patch_marks(ax, dataset, row, friction, ratio, 0.75)
    ax.set_xlim(left=0.0)
    return label_axes(
        ax,
        "Utilised friction",
        "Largest pressure over yield stress in shear",
        0.0,
        width=60,
    )


def plot_positions(
    dataset: xr.Dataset, ax: Axes | None = None, *, most: int = 6
) -> Axes:
    """Draw where the wheelset runs over the distance.

    The lateral position of each operating point.

    The `most` that wear the most have colours and names; where a force is controlled
    wear moves the wheelset.
    """
    ax = own_axes(ax)
    x, y = values_of(dataset, "distance"), values_of(dataset, "lateral_position")
    worn = dataset["wear_share"].values.max(axis=0)
    order = [
        int(point) for point in np.argsort(-worn, kind="stable") if worn[point] > 0.0
    ]
    for point in order[most:]:
        ax.plot(
            x, y[:, point], "-", lw=0.8, color=COLOURS["new"], alpha=0.5, label="others"
        )
    for index, point in enumerate(sorted(order[:most])):
        name = str(dataset["operating_point_name"].values[point])
        ax.plot(x, y[:, point], ".-", lw=0.8, color=series_colour(index), label=name)
    return label_axes(
        ax, label(dataset, "distance"), label(dataset, "lateral_position")
    )


def plot_binning(
    dataset: xr.Dataset, ax: Axes | None = None, *, wheel: int = 0, worn: bool = False
) -> Axes:
    """Draw the wear of all samples of a record and of the points in their place.

    On new or worn wheels.

    The place where they differ most is marked, with the difference over the largest
    depth of both wheels.
    """
    ax, end = own_axes(ax), "_worn" if worn else ""
    y = values_of(dataset, "binning_y")
    samples, points = (
        values_of(dataset, f"binning_depth_{name}{end}")
        for name in ("samples", "points")
    )
    ax.plot(
        y, samples[wheel], color=COLOURS["new"], lw=3.0, alpha=0.5, label="all samples"
    )
    ax.plot(y, points[wheel], color=series_colour(1), lw=1.0, label="operating points")
    at = int(np.argmax(np.abs(points - samples)[wheel]))
    ends = samples[wheel, at], points[wheel, at]
    share = abs(ends[1] - ends[0]) / max(float(samples.max()), 1e-300)
    ax.plot(
        [y[at]] * 2, ends, "-_", color=COLOURS["difference"], label="largest difference"
    )
    text = f"{100.0 * share:.2g} % of the largest depth"
    ax.text(0.98, 0.9, text, transform=ax.transAxes, ha="right", fontsize=7.5)
    touched = y[(samples[wheel] + points[wheel]) > 1e-3 * samples.max()]
    if touched.size:
        ax.set_xlim(touched.min() - 3.0, touched.max() + 3.0)
    return label_axes(
        ax,
        "Lateral position on the wheel [mm]",
        "Mean wear depth of one passage [nm]",
        0.0,
    )
