"""Figures of one contact solution.

`plot_x(dataset, ax=None) -> Axes`, seen from above, rolling upwards.

The datasets are those of `wearsim.studies.contact_state`. `patch` is the index of a
patch, `side` 0 for the right and 1 for the left wheel, one of those solved. Outlines of
several states can be laid over each other by further calls on the same axes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch as Swatch

from wearsim.quantities import QUANTITIES
from wearsim.report.figures.campaign import WHEELS
from wearsim.report.style import (
    COLOURS,
    label,
    label_axes,
    own_axes,
    plain,
    shape_axes,
    shown,
    style,
    values_of,
    wrapped,
)

STICK, SLIP = "#cfe3ee", "#f6dca6"
"""Areas of stick and slip."""

STICK_ARROW, SLIP_ARROW = "#1a1a1a", "#882255"
"""Shear arrows there."""

_WHEEL = "#1a1a1a"
_CONTACT = "#882255"
_MAP = "viridis"
_ARROWS = 11  # of shear along the longer side of a patch, about
# width over height of the axes of a patch: what the grid leaves next to a colour bar
_SHAPE = 1.15


def _colour(dataset: xr.Dataset) -> str:
    return COLOURS["rail" if dataset.attrs["counterface"] == "rail" else "rig"]


def _ends(
    dataset: xr.Dataset, patch: int, of: tuple[str, str] = ("x_lead", "x_trail")
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lateral positions of strip edges and centres in turn.

    Leading and trailing ends there, shown units.

    At their centres strips end where they end; in between, neighbours are joined
    half-way.
    """
    y = values_of(dataset, "lateral", patch)
    place = y[0] + 0.5 * (y[1] - y[0]) * np.arange(-1, 2 * y.size)
    ends = np.stack([values_of(dataset, name, patch) for name in of])
    lines = np.stack([np.interp(place, y, end) for end in ends])
    lines[:, [0, -1]] = ends[:, [0, -1]].mean(axis=0)
    return place, lines[0], lines[1]


def outline(dataset: xr.Dataset, patch: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the line around a patch.

    Lateral and longitudinal positions in shown units.

    NaN between the parts of a patch that are not connected.
    """
    place, lead, trail = _ends(dataset, patch)
    # models that find the contact on a grid have strips without contact next to it
    loaded = np.flatnonzero(
        dataset["x_lead"].values[patch] > dataset["x_trail"].values[patch]
    )
    part = slice(2 * int(loaded[0]), 2 * int(loaded[-1]) + 3)
    place, lead, trail = place[part], lead[part], trail[part]
    gap = np.concatenate(([False], (lead == trail)[1:-1], [False]))
    lead, trail = np.where(gap, np.nan, lead), np.where(gap, np.nan, trail)
    return np.concatenate((place, place[::-1])), np.concatenate((lead, trail[::-1]))


def _cells(
    dataset: xr.Dataset, patch: int, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners of the cells, each of two halves across, and their values."""
    place, lead, trail = _ends(dataset, patch, ("cells_lead", "cells_trail"))
    values = np.ma.masked_where(dataset["pressure"].values[patch] == 0.0, values)
    share = np.linspace(0.0, 1.0, dataset.sizes["cell"] + 1)[:, None]
    x = lead - share * (lead - trail)
    return np.broadcast_to(place, x.shape), x, np.ma.repeat(values, 2, axis=1)


def plot_outline(
    dataset: xr.Dataset, ax: Axes | None = None, *, patch: int = 0, **line: Any
) -> Axes:
    """Draw the outline of a patch; `line` are further properties of the line."""
    ax = own_axes(ax)
    look = {
        "color": _colour(dataset),
        "label": dataset.attrs["label"],
        "linewidth": 1.3,
    } | line
    ax.plot(*outline(dataset, patch), **look)
    ax.set_aspect("equal", adjustable="datalim")
    return label_axes(ax, "Lateral, to the right [mm]", "Rolling direction [mm]")


def plot_field(
    dataset: xr.Dataset,
    name: str = "pressure",
    ax: Axes | None = None,
    *,
    patch: int = 0,
) -> Axes:
    """Draw a field of a patch, "pressure" or "work_density", as colours with scale."""
    ax = own_axes(ax)
    y, x, values = _cells(dataset, patch, values_of(dataset, name, patch))
    top = float(values.max())
    if name == "work_density":
        values = np.ma.masked_equal(
            values, 0.0
        )  # nothing is lost where the surfaces stick
    colours = ax.pcolormesh(
        y, x, values, cmap=_MAP, vmin=0.0, vmax=top or 1.0, rasterized=True
    )
    plot_outline(dataset, ax, patch=patch, color=_WHEEL, linewidth=0.8, label="")
    if top > 0.0:  # a bar of zeros has no scale
        text = wrapped(label(dataset, name))
        ax.figure.colorbar(colours, ax=ax, label=text, shrink=0.85, aspect=16, pad=0.02)
    return ax


def plot_shear(
    dataset: xr.Dataset,
    ax: Axes | None = None,
    *,
    patch: int = 0,
    largest: float | None = None,
) -> Axes:
    """Draw the areas of stick and slip with shear stress on the wheel as arrows.

    The longest arrow is that of the shear stress `largest` [Pa], to compare patches, or
    that of the patch.
    """
    ax = own_axes(ax)
    slips = dataset["slipping"].values[patch] == 1
    y, x, area = _cells(dataset, patch, slips.astype(np.float64))
    ax.pcolormesh(
        y,
        x,
        area,
        cmap=ListedColormap([STICK, SLIP]),
        vmin=0.0,
        vmax=1.0,
        rasterized=True,
    )
    plot_outline(dataset, ax, patch=patch, color=_WHEEL, linewidth=0.8, label="")
    spacing, strips, cells = _sampled(dataset, patch)
    whole = [values_of(dataset, f"shear_{axis}", patch) for axis in "yx"]
    shear = np.array([values[cells, strips] for values in whole])
    most = float(
        np.hypot(*whole).max() if largest is None else shown("shear_x", largest)
    )
    if most > 0.0:
        y = values_of(dataset, "lateral", patch)[strips]
        x = values_of(dataset, "longitudinal", patch)[cells, strips]
        slipping = slips[cells, strips]
        for chosen, colour in ((~slipping, STICK_ARROW), (slipping, SLIP_ARROW)):
            part = chosen & (np.hypot(*shear) > 0.02 * most)
            quiver = ax.quiver(
                y[part],
                x[part],
                *shear[:, part],
                angles="xy",
                scale_units="xy",
                scale=most / (1.15 * spacing),
                color=colour,
                width=0.05 * spacing,
                units="xy",
                headwidth=3.6,
                headlength=4.0,
                headaxislength=3.6,
                minlength=0.5,
                pivot="middle",
                zorder=3,
            )
        key = float(f"{most:.1g}")
        ax.quiverkey(
            quiver,
            0.9,
            0.04,
            key,
            f"{plain(key, 1)} {QUANTITIES['shear_x'].shown_unit}",
            labelpos="N",
            coordinates="axes",
            color=_WHEEL,
            fontproperties={"size": 7.5},
        )
    swatches = [Swatch(color=STICK, label="stick"), Swatch(color=SLIP, label="slip")]
    ax.legend(
        handles=swatches,
        loc="upper right",
        handlelength=1.0,
        borderaxespad=0.1,
        fontsize=7.5,
    )
    return ax


def _sampled(dataset: xr.Dataset, patch: int) -> tuple[float, np.ndarray, np.ndarray]:
    """Spacing in shown units.

    And strips and cells about that far from each other in both directions.
    """
    y = values_of(dataset, "lateral", patch)
    x = values_of(dataset, "longitudinal", patch)
    lead, trail = (values_of(dataset, name, patch) for name in ("x_lead", "x_trail"))
    spacing = max(np.ptp(y), float(np.max(lead - trail))) / _ARROWS
    strips, cells = [], []
    middle = 0.5 * (y[0] + y[-1])
    count = int(np.ptp(y) / (2.0 * spacing))
    for place in middle + spacing * np.arange(-count, count + 1):
        j = int(np.argmin(np.abs(y - place)))
        reach = int(np.floor((lead[j] - trail[j]) / (2.0 * spacing)))
        for along in 0.5 * (lead[j] + trail[j]) + spacing * np.arange(
            -reach, reach + 1
        ):
            strips.append(j)
            cells.append(int(np.argmin(np.abs(x[:, j] - along))))
    return spacing, np.array(strips), np.array(cells)


def plot_section(dataset: xr.Dataset, ax: Axes | None = None, *, side: int = 0) -> Axes:
    """Draw wheel and counterface across the track, with the contacts marked."""
    ax = own_axes(ax)
    row = int(np.flatnonzero(dataset["wheel"].values == side)[0])
    names = {
        "counterface": f"{dataset.attrs['counterface']} {dataset.attrs['counterface_profile']}",
        "wheel": f"wheel {dataset.attrs['wheel_profile']}",
    }
    for what, colour in (("counterface", _colour(dataset)), ("wheel", _WHEEL)):
        y, z = (
            shown("section_y", dataset[f"{what}_section_{axis}"].values[row])
            for axis in "yz"
        )
        ax.plot(y, z, color=colour, linewidth=1.4, label=names[what])
    rail_y, rail_z = (
        dataset[f"counterface_section_{axis}"].values[row] for axis in "yz"
    )
    order = np.argsort(rail_y)
    place = (-1.0 if side else 1.0) * dataset["rail_y"].values[
        dataset["side"].values == side
    ]
    height = np.interp(place, rail_y[order], rail_z[order])
    place, height = shown("section_y", place), shown("section_y", height)
    ax.plot(place, height, "o", color=_CONTACT, label="contact", zorder=4)
    for number, at in enumerate(zip(place, height, strict=True), start=1):
        if place.size > 1:
            ax.annotate(
                str(number),
                at,
                (0, 6),
                textcoords="offset points",
                ha="center",
                fontsize=8,
                color=_CONTACT,
            )
    place = "Lateral in the track, to the right [mm]"
    return shape_axes(ax, place, "Height, down [mm]", adjustable="datalim")


def title_of(dataset: xr.Dataset) -> str:
    """Conditions of a contact state in two lines."""

    def text(name: str, digits: int = 4) -> str:
        value = float(values_of(dataset, name))
        number = plain(float(f"{value:.{digits}g}"), digits)
        number = number.rstrip("0").rstrip(".") if value else number
        unit = QUANTITIES[name].shown_unit
        return number if unit == "1" else f"{number} {unit}"

    attrs = dataset.attrs
    sides = " and ".join(WHEELS[side] for side in dataset["wheel"].values)
    kappa = float(dataset["counterface_curvature"])
    on = "rail" if kappa == 0.0 else f"roller of {1e3 / kappa:.6g} mm"
    rotation = f"rotation {text('rotation_speed', 6)} ({attrs['rotation_rule']})"
    return (
        f"{sides.capitalize()} wheel {attrs['wheel_profile']} on {on} "
        f"{attrs['counterface_profile']}: shift {text('shift')}, yaw {text('yaw')}, "
        f"roll {text('roll', 3)}{' (free)' if attrs['free_roll'] else ''}\n"
        f"load {text('wheel_load')}, friction {text('friction')}, speed "
        f"{text('speed')}, "
        f"{'creepages given' if attrs['creepage_given'] else rotation}; patches from "
        "above, rolling upwards, shear on the wheel"
    )


def contact_figure(dataset: xr.Dataset) -> Figure:
    """Draw the section of each side of a contact state.

    Then pressure, shear and work of each patch.
    """
    sides = [int(side) for side in dataset["wheel"].values]
    patches = dataset.sizes["patch"]
    heights = [2.6] * len(sides) + [2.9] * patches
    with style():
        figure = Figure(figsize=(11.0, sum(heights) + 0.7), layout="constrained")
        figure.suptitle(title_of(dataset), fontsize=9.5, x=0.01, ha="left")
        grid = figure.add_gridspec(len(heights), 6, height_ratios=heights)
        for row, side in enumerate(sides):
            section = plot_section(dataset, figure.add_subplot(grid[row, :]), side=side)
            section.set_title(f"Section, {WHEELS[side]} wheel")
            section.legend(loc="best")
        spans = _spans(dataset)
        for patch in range(patches):
            axes = [
                figure.add_subplot(grid[len(sides) + patch, 2 * k : 2 * k + 2])
                for k in range(3)
            ]
            plot_field(dataset, "pressure", axes[0], patch=patch)
            plot_shear(dataset, axes[1], patch=patch)
            plot_field(dataset, "work_density", axes[2], patch=patch)
            for ax, text in zip(axes, _patch_titles(dataset, patch), strict=True):
                ax.set_title(text, fontsize=8.5)
                ax.set_aspect("equal", adjustable="box")
                ax.set_xlim(spans[patch][0])
                ax.set_ylim(spans[patch][1])
    return figure


def _spans(dataset: xr.Dataset) -> list[np.ndarray]:
    """Limits of the axes of each patch, lateral and longitudinal, alike in size."""
    lines = (
        np.array(outline(dataset, patch)) for patch in range(dataset.sizes["patch"])
    )
    ends = np.array(
        [[np.nanmin(line, axis=1), np.nanmax(line, axis=1)] for line in lines]
    )
    width, length = 0.55 * np.ptp(ends, axis=1).max(axis=0)
    half = np.array([max(width, _SHAPE * length), max(length, width / _SHAPE)])
    middle = 0.5 * ends.sum(axis=1)
    return list(np.stack((middle - half, middle + half), axis=-1))


def _patch_titles(dataset: xr.Dataset, patch: int) -> tuple[str, str, str]:
    def text(name: str, places: int) -> str:
        value = round(float(values_of(dataset, name, patch)), places) + 0.0
        return f"{value:.{places}f} {QUANTITIES[name].shown_unit}".replace(
            "-", "\N{MINUS SIGN}"
        )

    side = dataset["side"].values
    same_wheel = np.flatnonzero(side == side[patch])
    number = (
        f", patch {np.searchsorted(same_wheel, patch) + 1}"
        if same_wheel.size > 1
        else ""
    )
    share = float(dataset["slip_area"][patch] / dataset["area"][patch])
    return (
        (
            f"{WHEELS[side[patch]].capitalize()} wheel{number}: "
            f"{text('normal_force', 1)} on {text('area', 0)}"
        ),
        f"Fx {text('force_x', 2)}, Fy {text('force_y', 2)}, slip {100.0 * share:.0f} %",
        f"Frictional power {text('power', 0)}",
    )
