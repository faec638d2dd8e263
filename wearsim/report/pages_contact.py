"""Whole figures of contact states, put together from the plots of `figures_contact`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from wearsim.errors import ResultError
from wearsim.quantities import QUANTITIES
from wearsim.report import figures_contact
from wearsim.report.figures import WHEELS
from wearsim.report.style import plain, save_svg, style

_SHAPE = 1.15  # width over height of the axes of a patch: what the grid leaves beside a colour bar


def title_of(dataset: xr.Dataset) -> str:
    """Conditions of a contact state in two lines."""

    def said(name: str, digits: int = 4) -> str:
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
        f"{dataset.attrs['counterface_profile']}: shift {said('shift')}, yaw {said('yaw')}, "
        f"roll {said('roll', 3)}" + (" (free)" if dataset.attrs["free_roll"] else "")
    )
    turning = (
        "creepages given"
        if dataset.attrs["creepage_given"]
        else f"rotation {said('rotation_speed', 6)} ({dataset.attrs['rotation_rule']})"
    )
    second = (
        f"load {said('wheel_load')}, friction {said('friction')}, speed {said('speed')}, {turning}; "
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
            section = figures_contact.plot_section(dataset, figure.add_subplot(grid[row, :4]), side=side)
            section.set_title(f"Section, {WHEELS[side]} wheel")
            section.legend(loc="best")
            gap = figures_contact.plot_gap(dataset, figure.add_subplot(grid[row, 4:]), side=side)
            gap.legend(loc="best", frameon=True, facecolor="white", edgecolor="none")
            gap.set_title("Gap before loading")
        spans = _spans(dataset)
        count = dict.fromkeys(sides, 0)
        for patch in range(patches):
            side = int(dataset["side"].values[patch])
            count[side] += 1
            row = len(sides) + patch
            axes = [figure.add_subplot(grid[row, 2 * k : 2 * k + 2]) for k in range(3)]
            figures_contact.plot_field(dataset, "pressure", axes[0], patch=patch)
            figures_contact.plot_shear(dataset, axes[1], patch=patch)
            figures_contact.plot_field(dataset, "work_density", axes[2], patch=patch)
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
    def said(name: str, places: int) -> str:
        value = round(float(figures_contact.shown_values(dataset, name, patch=patch)), places) + 0.0
        return f"{value:.{places}f} {QUANTITIES[name].shown_unit}".replace("-", "\N{MINUS SIGN}")

    several = int((dataset["side"].values == side).sum()) > 1
    name = f"{WHEELS[side].capitalize()} wheel" + (f", patch {number}" if several else "")
    share = float(dataset["slip_area"][patch] / dataset["area"][patch])
    return (
        f"{name}: {said('normal_force', 1)} on {said('area', 0)}",
        f"Fx {said('force_x', 2)}, Fy {said('force_y', 2)}, slip {100.0 * share:.0f} %",
        f"Frictional power {said('power', 0)}",
    )


def _box(dataset: xr.Dataset, patch: int) -> tuple[float, float, float, float]:
    """Return the limits of a patch, lateral and longitudinal, in shown units."""
    y, x = figures_contact.outline(dataset, patch)
    return float(y.min()), float(y.max()), float(np.nanmin(x)), float(np.nanmax(x))


def write_contact_figure(dataset: xr.Dataset, path: Path) -> Path:
    """Draw a contact state into a file; the ending of its name says in which format.

    Parameters
    ----------
    dataset : Dataset
        Contact state.
    path : Path
        Ends with .png, .svg or .pdf.

    Returns
    -------
    Path
        `path`.

    Raises
    ------
    ResultError
        If the file cannot be written.
    """
    figure = contact_figure(dataset)
    kind = path.suffix[1:].lower()
    try:
        if kind == "svg":
            return save_svg(figure, path)
        with style():
            metadata = {"CreationDate": None} if kind == "pdf" else {"Software": None}
            figure.savefig(path, format=kind, dpi=150, metadata=metadata)
    except OSError as error:
        raise ResultError(f"{path}: cannot be written ({error.strerror}); choose another folder") from error
    return path
