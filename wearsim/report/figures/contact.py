"""Figures of one contact solution: `plot_x(dataset, ax=None) -> Axes`, seen from above, rolling upwards.

The datasets are those of `wearsim.studies.contact_state`. Outlines, pressures along the patch and sections of
several states can be laid over each other by further calls on the same axes; labels name the states.
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
from wearsim.report.style import COLOURS, label_axes, own_axes, plain, style, wrapped
from wearsim.report.style import label as label_of

STICK, SLIP = "#cfe3ee", "#f6dca6"
"""Areas of stick and slip."""

STICK_ARROW, SLIP_ARROW = "#1a1a1a", "#882255"
"""Shear arrows there."""

_WHEEL = "#1a1a1a"
_CONTACT = "#882255"
_MAP = "viridis"
_SHAPE = 1.15  # width over height of the axes of a patch: what the grid leaves next to a colour bar


def shown_values(dataset: xr.Dataset, name: str, **at: int) -> np.ndarray:
    """Values in the unit people read."""
    quantity = QUANTITIES[name]
    return np.asarray(dataset[name].isel(at).values, dtype=np.float64) * quantity.shown_factor


def _colour(dataset: xr.Dataset) -> str:
    return COLOURS["rail" if dataset.attrs["counterface"] == "rail" else "rig"]


def _ends(
    dataset: xr.Dataset, patch: int, across: str, of: tuple[str, str] = ("x_lead", "x_trail")
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lateral positions of strip edges and centres in turn, leading and trailing ends there, shown units.

    At their centres strips end where they end; in between, neighbours are joined half-way.
    """
    y = shown_values(dataset, across, patch=patch)
    half = 0.5 * (y[1] - y[0])
    place = np.empty(2 * y.size + 1)
    place[0], place[1::2], place[2::2] = y[0] - half, y, y + half
    ends = [shown_values(dataset, name, patch=patch) for name in of]
    middle = 0.5 * (ends[0] + ends[1])
    lines = []
    for end in ends:
        line = np.empty_like(place)
        line[1::2] = end
        line[2:-1:2] = 0.5 * (end[1:] + end[:-1])
        line[0], line[-1] = middle[0], middle[-1]
        lines.append(line)
    return place, lines[0], lines[1]


def outline(dataset: xr.Dataset, patch: int, across: str = "lateral") -> tuple[np.ndarray, np.ndarray]:
    """Return the line around a patch: lateral and longitudinal positions in shown units.

    NaN between the parts of a patch that are not connected.
    """
    place, lead, trail = _ends(dataset, patch, across)
    # models that find the contact on a grid have strips without contact next to it
    loaded = np.flatnonzero(dataset["x_lead"].values[patch] > dataset["x_trail"].values[patch])
    part = slice(2 * int(loaded[0]), 2 * int(loaded[-1]) + 3)
    place, lead, trail = place[part], lead[part], trail[part]
    gap = np.concatenate(([False], (lead == trail)[1:-1], [False]))
    lead, trail = np.where(gap, np.nan, lead), np.where(gap, np.nan, trail)
    return np.concatenate((place, place[::-1])), np.concatenate((lead, trail[::-1]))


def _cells(dataset: xr.Dataset, patch: int, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners of the cells, each of two halves across, and their values."""
    place, lead, trail = _ends(dataset, patch, "lateral", ("cells_lead", "cells_trail"))
    values = np.ma.masked_where(dataset["pressure"].values[patch] == 0.0, values)
    share = np.linspace(0.0, 1.0, dataset.sizes["cell"] + 1)[:, None]
    x = lead - share * (lead - trail)
    return np.broadcast_to(place, x.shape), x, np.ma.repeat(values, 2, axis=1)


def _across(dataset: xr.Dataset, across: str) -> str:
    return "Lateral, to the right [mm]" if across == "lateral" else label_of(dataset, across)


def plot_outline(
    dataset: xr.Dataset,
    ax: Axes | None = None,
    *,
    patch: int = 0,
    across: str = "lateral",
    label: str | None = None,
    **line: Any,
) -> Axes:
    """Draw the outline of a patch.

    Parameters
    ----------
    dataset : Dataset
        Contact state.
    ax : Axes, optional
        Where to draw.
    patch : int
        Which patch.
    across : {"lateral", "strip_wheel_y"}
        Lateral position from the centre of the patch, or on the wheel profile.
    label : str, optional
        In legends; that of the dataset if not given.
    **line
        Further properties of the line, such as `color` and `linestyle`.
    """
    ax = own_axes(ax)
    y, x = outline(dataset, patch, across)
    look: dict[str, Any] = {"color": _colour(dataset), "linewidth": 1.3} | line
    ax.plot(y, x, label=dataset.attrs["label"] if label is None else label, **look)
    ax.set_aspect("equal", adjustable="datalim")
    return label_axes(ax, _across(dataset, across), "Rolling direction [mm]")


def plot_pressure_along(
    dataset: xr.Dataset,
    ax: Axes | None = None,
    *,
    patch: int = 0,
    across: str = "lateral",
    label: str | None = None,
    **line: Any,
) -> Axes:
    """Draw the largest pressure of each strip across a patch, zero at its ends.

    Parameters are those of `plot_outline`.
    """
    ax = own_axes(ax)
    look: dict[str, Any] = {"color": _colour(dataset)} | line
    pressure = shown_values(dataset, "pressure", patch=patch).max(axis=0)
    name = dataset.attrs["label"] if label is None else label
    place = shown_values(dataset, across, patch=patch)
    before, after = place[0] - 0.5 * (place[1] - place[0]), place[-1] + 0.5 * (place[-1] - place[-2])
    place, pressure = np.r_[before, place, after], np.r_[0.0, pressure, 0.0]
    ax.plot(place, pressure, label=name, **look)
    return label_axes(ax, _across(dataset, across), label_of(dataset, "pressure"), 0.0)


def plot_field(
    dataset: xr.Dataset, name: str = "pressure", ax: Axes | None = None, *, patch: int = 0, bar: bool = True
) -> Axes:
    """Draw a field of a patch as colours.

    Parameters
    ----------
    dataset : Dataset
        Contact state.
    name : {"pressure", "work_density"}
        Which field.
    ax : Axes, optional
        Where to draw.
    patch : int
        Which patch.
    bar : bool
        Whether to draw the colour bar, too.
    """
    ax = own_axes(ax)
    y, x, values = _cells(dataset, patch, shown_values(dataset, name, patch=patch))
    top = float(values.max())
    if name == "work_density":
        values = np.ma.masked_equal(values, 0.0)  # nothing is lost where the surfaces stick
    colours = ax.pcolormesh(y, x, values, cmap=_MAP, vmin=0.0, vmax=top or 1.0, rasterized=True)
    plot_outline(dataset, ax, patch=patch, color=_WHEEL, linewidth=0.8, label="")
    if bar and top > 0.0:  # a bar of zeros has no scale
        text = wrapped(label_of(dataset, name))
        ax.figure.colorbar(colours, ax=ax, label=text, shrink=0.85, aspect=16, pad=0.02)
    return ax


def plot_shear(
    dataset: xr.Dataset,
    ax: Axes | None = None,
    *,
    patch: int = 0,
    arrows: int = 11,
    largest: float | None = None,
) -> Axes:
    """Draw the areas of stick and slip of a patch with the shear stress on the wheel as arrows.

    Parameters
    ----------
    dataset : Dataset
        Contact state.
    ax : Axes, optional
        Where to draw.
    patch : int
        Which patch.
    arrows : int
        Along the longer side of the patch, about.
    largest : float, optional
        Shear stress of the longest arrow [Pa], to compare patches; that of the patch if not given.
    """
    ax = own_axes(ax)
    slips = dataset["slipping"].values[patch] == 1
    y, x, area = _cells(dataset, patch, slips.astype(np.float64))
    ax.pcolormesh(y, x, area, cmap=ListedColormap([STICK, SLIP]), vmin=0.0, vmax=1.0,
                  rasterized=True)  # fmt: skip
    plot_outline(dataset, ax, patch=patch, color=_WHEEL, linewidth=0.8, label="")
    spacing, strips, cells = _sampled(dataset, patch, arrows)
    shear = [shown_values(dataset, f"shear_{axis}", patch=patch)[cells, strips] for axis in "yx"]
    size = np.hypot(*shear)
    most = float(np.hypot(*(shown_values(dataset, f"shear_{axis}", patch=patch) for axis in "xy")).max())
    most = most if largest is None else largest * QUANTITIES["shear_x"].shown_factor
    if most > 0.0:
        at = (
            shown_values(dataset, "lateral", patch=patch)[strips],
            shown_values(dataset, "longitudinal", patch=patch)[cells, strips],
        )
        slipping = slips[cells, strips]
        scale = most / (1.15 * spacing)
        for chosen, colour in ((~slipping, STICK_ARROW), (slipping, SLIP_ARROW)):
            part = chosen & (size > 0.02 * most)
            quiver = ax.quiver(
                at[0][part], at[1][part], shear[0][part], shear[1][part], angles="xy", scale_units="xy",
                scale=scale, color=colour, width=0.05 * spacing, units="xy", headwidth=3.6, headlength=4.0,
                headaxislength=3.6, minlength=0.5, pivot="middle", zorder=3,
            )  # fmt: skip
        key = float(f"{most:.1g}")
        ax.quiverkey(
            quiver, 0.9, 0.04, key, f"{plain(key, 1)} {QUANTITIES['shear_x'].shown_unit}",
            labelpos="N", coordinates="axes", color=_WHEEL, fontproperties={"size": 7.5},
        )  # fmt: skip
    swatches = [Swatch(color=STICK, label="stick"), Swatch(color=SLIP, label="slip")]
    ax.legend(handles=swatches, loc="upper right", handlelength=1.0, borderaxespad=0.1, fontsize=7.5)
    return ax


def _sampled(dataset: xr.Dataset, patch: int, arrows: int) -> tuple[float, np.ndarray, np.ndarray]:
    """Spacing in shown units, and strips and cells about that far from each other in both directions."""
    y = shown_values(dataset, "lateral", patch=patch)
    x = shown_values(dataset, "longitudinal", patch=patch)
    lead, trail = (shown_values(dataset, name, patch=patch) for name in ("x_lead", "x_trail"))
    spacing = max(np.ptp(y), float(np.max(lead - trail))) / arrows
    strips, cells = [], []
    middle = 0.5 * (y[0] + y[-1])
    count = int(np.ptp(y) / (2.0 * spacing))
    for place in middle + spacing * np.arange(-count, count + 1):
        j = int(np.argmin(np.abs(y - place)))
        reach = int(np.floor((lead[j] - trail[j]) / (2.0 * spacing)))
        for along in 0.5 * (lead[j] + trail[j]) + spacing * np.arange(-reach, reach + 1):
            strips.append(j)
            cells.append(int(np.argmin(np.abs(x[:, j] - along))))
    return spacing, np.array(strips), np.array(cells)


def plot_section(dataset: xr.Dataset, ax: Axes | None = None, *, side: int = 0) -> Axes:
    """Draw wheel and counterface across the track, with the contacts marked.

    Parameters
    ----------
    dataset : Dataset
        Contact state.
    ax : Axes, optional
        Where to draw.
    side : int
        0 right, 1 left: one of those solved.
    """
    ax = own_axes(ax)
    row = int(np.flatnonzero(dataset["wheel"].values == side)[0])
    factor = QUANTITIES["section_y"].shown_factor
    for what, colour in (("counterface", _colour(dataset)), ("wheel", _WHEEL)):
        y, z = (dataset[f"{what}_section_{axis}"].values[row] * factor for axis in "yz")
        name = f"wheel {dataset.attrs['wheel_profile']}" if what == "wheel" else (
            f"{dataset.attrs['counterface']} {dataset.attrs['counterface_profile']}"
        )  # fmt: skip
        ax.plot(y, z, color=colour, linewidth=1.4, label=name)
    sign = -1.0 if side else 1.0
    rail_y, rail_z = (dataset[f"counterface_section_{axis}"].values[row] for axis in "yz")
    order = np.argsort(rail_y)
    own = dataset["side"].values == side
    place = sign * dataset["rail_y"].values[own]
    height = np.interp(place, rail_y[order], rail_z[order])
    ax.plot(place * factor, height * factor, "o", color=_CONTACT, label="contact", zorder=4)
    for number, (at, down) in enumerate(zip(place * factor, height * factor, strict=True), start=1):
        if place.size > 1:
            ax.annotate(str(number), (at, down), (0, 6), textcoords="offset points", ha="center",
                        fontsize=8, color=_CONTACT)  # fmt: skip
    ax.set_aspect("equal", adjustable="datalim")
    if not ax.yaxis_inverted():
        ax.invert_yaxis()
    return label_axes(ax, "Lateral in the track, to the right [mm]", "Height, down [mm]")


def plot_gap(dataset: xr.Dataset, ax: Axes | None = None, *, side: int = 0, **line: Any) -> Axes:
    """Draw the gap of the unloaded profiles around the patches of a side, their width and approach.

    Parameters
    ----------
    dataset : Dataset
        Contact state.
    ax : Axes, optional
        Where to draw.
    side : int
        0 right, 1 left: one of those solved.
    **line
        Further properties of the line.
    """
    ax = own_axes(ax)
    row = int(np.flatnonzero(dataset["wheel"].values == side)[0])
    at = dataset["gap_rail_y"].values[row] * 1e3
    gap = dataset["gap"].values[row] * QUANTITIES["gap"].shown_factor
    ax.plot(at, gap, **({"color": _WHEEL} | line))
    own = np.flatnonzero(dataset["side"].values == side)
    deepest, highest = float(gap.max()), 0.0
    sign = -1.0 if side else 1.0
    for number in map(int, own):
        place = _ends(dataset, number, "lateral")[0]
        flat = np.cos(float(dataset["contact_angle"][number]))  # of the contact plane
        ends = shown_values(dataset, "rail_y", patch=number) + sign * flat * place[[0, -1]]
        # counted from the initial contact within the patch
        inside = gap[(at >= ends.min()) & (at <= ends.max())]
        approach = inside.min(initial=deepest) + shown_values(dataset, "approach", patch=number)
        highest = max(highest, float(approach))
        first = number == own[0]
        ax.axvspan(ends.min(), ends.max(), color=STICK, lw=0.0, label="patch" if first else "")
        ax.hlines(approach, ends.min(), ends.max(), color=_CONTACT, lw=1.2, ls="--",
                  label="approach" if first else "")  # fmt: skip
    ax.set_ylim(0.0, 3.0 * highest)
    ax.set_xlim(at[0], at[-1])
    if side and not ax.xaxis_inverted():
        ax.invert_xaxis()
    return label_axes(ax, "Lateral on the counterface profile [mm]", "Gap along the normal [µm]")


def title_of(dataset: xr.Dataset) -> str:
    """Conditions of a contact state in two lines."""

    def text(name: str, digits: int = 4) -> str:
        quantity = QUANTITIES[name]
        value = float(dataset[name]) * quantity.shown_factor
        unit = "" if quantity.shown_unit == "1" else f" {quantity.shown_unit}"
        return (
            plain(float(f"{value:.{digits}g}"), digits).rstrip("0").rstrip(".") + unit
            if value
            else f"0{unit}"
        )

    sides = " and ".join(WHEELS[side] for side in dataset["wheel"].values)
    kappa = float(dataset["counterface_curvature"])
    on = "rail" if kappa == 0.0 else f"roller of {1e3 / kappa:.6g} mm"
    first = (
        f"{sides.capitalize()} wheel {dataset.attrs['wheel_profile']} on {on} "
        f"{dataset.attrs['counterface_profile']}: shift {text('shift')}, yaw {text('yaw')}, "
        f"roll {text('roll', 3)}" + (" (free)" if dataset.attrs["free_roll"] else "")
    )
    motion = (
        "creepages given"
        if dataset.attrs["creepage_given"]
        else f"rotation {text('rotation_speed', 6)} ({dataset.attrs['rotation_rule']})"
    )
    second = (
        f"load {text('wheel_load')}, friction {text('friction')}, speed {text('speed')}, {motion}; "
        "patches from above, rolling upwards, shear on the wheel"
    )
    return f"{first}\n{second}"


def contact_figure(dataset: xr.Dataset) -> Figure:
    """Figure of a contact state: section and gap of each side, then pressure, shear and work of each patch.

    Parameters
    ----------
    dataset : Dataset
        Contact state.

    Returns
    -------
    Figure
        Not yet drawn.
    """
    sides = [int(side) for side in dataset["wheel"].values]
    patches = dataset.sizes["patch"]
    heights = [2.6] * len(sides) + [2.9] * patches
    with style():
        figure = Figure(figsize=(11.0, sum(heights) + 0.7), layout="constrained")
        figure.suptitle(title_of(dataset), fontsize=9.5, x=0.01, ha="left")
        grid = figure.add_gridspec(len(heights), 6, height_ratios=heights)
        for row, side in enumerate(sides):
            section = plot_section(dataset, figure.add_subplot(grid[row, :4]), side=side)
            section.set_title(f"Section, {WHEELS[side]} wheel")
            section.legend(loc="best")
            gap = plot_gap(dataset, figure.add_subplot(grid[row, 4:]), side=side)
            gap.legend(loc="best", frameon=True, facecolor="white", edgecolor="none")
            gap.set_title("Gap before loading")
        spans = _spans(dataset)
        count = dict.fromkeys(sides, 0)
        for patch in range(patches):
            side = int(dataset["side"].values[patch])
            count[side] += 1
            row = len(sides) + patch
            axes = [figure.add_subplot(grid[row, 2 * k : 2 * k + 2]) for k in range(3)]
            plot_field(dataset, "pressure", axes[0], patch=patch)
            plot_shear(dataset, axes[1], patch=patch)
            plot_field(dataset, "work_density", axes[2], patch=patch)
            for ax, text in zip(axes, _patch_titles(dataset, patch, side, count[side]), strict=True):
                ax.set_title(text, fontsize=8.5)
                ax.set_aspect("equal", adjustable="box")
                ax.set_xlim(spans[patch][0])
                ax.set_ylim(spans[patch][1])
    return figure


def _spans(dataset: xr.Dataset) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """Limits of the axes of each patch, alike in size."""
    box = np.array([_box(dataset, patch) for patch in range(dataset.sizes["patch"])])
    half = [0.55 * float((box[:, k + 1] - box[:, k]).max()) for k in (0, 2)]
    half = [max(half[0], _SHAPE * half[1]), max(half[1], half[0] / _SHAPE)]
    middle = 0.5 * (box[:, ::2] + box[:, 1::2])
    return [((m[0] - half[0], m[0] + half[0]), (m[1] - half[1], m[1] + half[1])) for m in middle]


def _patch_titles(dataset: xr.Dataset, patch: int, side: int, number: int) -> tuple[str, str, str]:
    def text(name: str, places: int) -> str:
        value = round(float(shown_values(dataset, name, patch=patch)), places) + 0.0
        return f"{value:.{places}f} {QUANTITIES[name].shown_unit}".replace("-", "\N{MINUS SIGN}")

    several = int((dataset["side"].values == side).sum()) > 1
    name = f"{WHEELS[side].capitalize()} wheel" + (f", patch {number}" if several else "")
    share = float(dataset["slip_area"][patch] / dataset["area"][patch])
    return (
        f"{name}: {text('normal_force', 1)} on {text('area', 0)}",
        f"Fx {text('force_x', 2)}, Fy {text('force_y', 2)}, slip {100.0 * share:.0f} %",
        f"Frictional power {text('power', 0)}",
    )


def _box(dataset: xr.Dataset, patch: int) -> tuple[float, float, float, float]:
    """Return the limits of a patch, lateral and longitudinal, in shown units."""
    y, x = outline(dataset, patch)
    return float(y.min()), float(y.max()), float(np.nanmin(x)), float(np.nanmax(x))
