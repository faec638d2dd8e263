"""Figures of the comparison laws and of rolling contact fatigue."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from wearsim.damage.coefficients import COEFFICIENT_SETS
from wearsim.damage.fatigue.agreement import normalised
from wearsim.damage.fatigue.shakedown import boundaries
from wearsim.report.figures import WHEELS, new_place
from wearsim.report.style import COLOURS, SERIES_COLOURS, label, own_axes, plain, role_of, shown, wrapped
from wearsim.results.turnings import last_worn_row

_NEW_Y = "Lateral position on the new wheel [mm]"
_MARKERS = ("o", "^", "s", "D", "v", "P")
_YIELD_SET = "ekberg_kabo_andersson_2002"
"""Set the map takes its yield stress from where no law of the scene has one."""
_BOUNDARY_LINES = ("-", "--", "_")


def plot_wear_laws(dataset: xr.Dataset, ax: Axes | None = None, *, wheel: int = 0) -> Axes:
    """Draw the wear depth along the profile by the active law and by each comparison law.

    Parameters
    ----------
    dataset : Dataset
        Result of a campaign with comparison laws.
    ax : Axes, optional
        Where to draw.
    wheel : int
        0 right, 1 left.
    """
    ax = own_axes(ax)
    row = last_worn_row(dataset)
    y = shown("profile_y", new_place(dataset, wheel))
    active = str(dataset.attrs.get("wear_law", "active law"))
    depth = shown("wear_depth", dataset["wear_depth"].values[row, wheel])
    ax.plot(y, depth, color=COLOURS[role_of(dataset)], lw=2.2, label=f"{active}, active")
    for k, name in enumerate(dataset["comparison_name"].values):
        depth = shown("comparison_wear_depth", dataset["comparison_wear_depth"].values[row, wheel, k])
        ax.plot(y, depth, color=_colour(k + 1), lw=1.2, label=str(name))
    ax.set_xlabel(_NEW_Y)
    ax.set_ylabel(wrapped(label(dataset, "wear_depth")))
    ax.set_ylim(bottom=0.0, auto=None)
    return ax


def plot_fatigue_damage(dataset: xr.Dataset, ax: Axes | None = None, *, wheel: int = 0) -> Axes:
    """Draw the fatigue damage along the profile, each law over its largest value on both wheels.

    Parameters
    ----------
    dataset : Dataset
        Result of a campaign with fatigue laws.
    ax : Axes, optional
        Where to draw.
    wheel : int
        0 right, 1 left.
    """
    ax = own_axes(ax)
    y = shown("profile_y", new_place(dataset, wheel))
    damage = dataset["fatigue_damage"].values[last_worn_row(dataset)]
    for k, name in enumerate(dataset["fatigue_name"].values):
        largest = float(damage[:, k].max())
        if largest > 0.0:
            ax.plot(y, damage[wheel, k] / largest, color=_colour(k), label=str(name))
    ax.set_xlabel(_NEW_Y)
    ax.set_ylabel(wrapped("Fatigue damage over the largest of the law"))
    ax.set_ylim(0.0, 1.05)
    return ax


def plot_balance(dataset: xr.Dataset, ax: Axes | None = None, *, law: int, wheel: int = 0) -> Axes:
    """Draw the wear rate, and the one at which cracks just do not grow, along the profile.

    Parameters
    ----------
    dataset : Dataset
        Result of a campaign with fatigue laws.
    ax : Axes, optional
        Where to draw.
    law : int
        Fatigue law, one with a crack depth.
    wheel : int
        0 right, 1 left.
    """
    ax = own_axes(ax)
    row = last_worn_row(dataset)
    y = shown("profile_y", new_place(dataset, wheel))
    wear = shown("wear_depth_rate", dataset["wear_depth_rate"].values[row, wheel])
    balanced = shown("magic_wear_rate", dataset["magic_wear_rate"].values[row, wheel, law])
    ax.plot(y, wear, color=COLOURS[role_of(dataset)], label="wear")
    ax.plot(y, balanced, "--", color=COLOURS["difference"], lw=1.2, label="balance: cracks just do not grow")
    grows = balanced > wear
    ax.fill_between(
        y, wear, balanced, where=grows, color=SERIES_COLOURS[3], alpha=0.35, lw=0.0, label="cracks grow"
    )
    ax.set_xlabel(_NEW_Y)
    ax.set_ylabel(wrapped(label(dataset, "wear_depth_rate")))
    ax.set_ylim(bottom=0.0, auto=None)
    return ax


def map_shear_yield(dataset: xr.Dataset) -> float:
    """Return the yield stress in shear of the shakedown map: that of the laws, or a published one [Pa]."""
    known = dataset["fatigue_shear_yield"].values
    known = known[np.isfinite(known)]
    if known.size:
        return float(known[0])
    return 1e6 * COEFFICIENT_SETS[_YIELD_SET]["shear_yield"]


def shear_yield_told(dataset: xr.Dataset) -> str:
    """Tell the yield stress of the shakedown map with its source, range and certainty."""
    value = f"{plain(1e-6 * map_shear_yield(dataset), 3)} MPa"
    known = np.flatnonzero(np.isfinite(dataset["fatigue_shear_yield"].values))
    if known.size:
        name, numbers, doubts = (
            str(dataset[f"fatigue_{key}"].values[known[0]]) for key in ("name", "coefficients", "warnings")
        )
        doubt = [part for part in doubts.split("; ") if part.startswith("shear_yield")]
        if not doubt:
            return f"{value} as given for {name}"
        return f"{value} of {name} ({numbers}{_range(doubt[0])})"
    doubt = [part for part in COEFFICIENT_SETS[_YIELD_SET].uncertain if part.startswith("shear_yield")]
    return f"{value} of {_YIELD_SET}, as no law of the scene has one ({_range(doubt[0]).removeprefix(', ')})"


def _range(doubt: str) -> str:
    """Range and certainty of a doubt such as "shear_yield = 300 MPa, range 200 to 350 (recalled)"."""
    told, _, certainty = doubt.removesuffix(")").partition(" (")
    _, _, between = told.partition(", range ")
    return f", {certainty}, {between} MPa in use" if between else f", {certainty}"


def shakedown_place(dataset: xr.Dataset, row: int) -> tuple[np.ndarray, np.ndarray]:
    """Return utilised friction and p0/k of every patch slot of a row, NaN where there is no patch.

    Parameters
    ----------
    dataset : Dataset
        Result of a campaign with fatigue laws.
    row : int
        Step.

    Returns
    -------
    friction, ratio : (operating_point, patch) arrays
        Places in the map [-].
    """
    shear = np.hypot(dataset["force_x"].values[row], dataset["force_y"].values[row])
    load = dataset["normal_force"].values[row]
    friction = np.divide(shear, load, out=np.full_like(shear, np.nan), where=load > 0.0)
    return friction, dataset["max_pressure"].values[row] / map_shear_yield(dataset)


def plot_shakedown(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the shakedown map with every contact patch, new and worn.

    Parameters
    ----------
    dataset : Dataset
        Result of a campaign with fatigue laws.
    ax : Axes, optional
        Where to draw.
    """
    ax = own_axes(ax)
    colour = COLOURS[role_of(dataset)]
    places = {row: shakedown_place(dataset, row) for row in (0, last_worn_row(dataset))}
    most = max(float(np.nanmax(friction, initial=0.0)) for friction, _ in places.values())
    for line, curve in zip(_BOUNDARY_LINES, boundaries("point", max(0.6, 1.1 * most)), strict=True):
        told = f"{curve.label} ({curve.certainty})"
        ax.plot(curve.friction, curve.ratio, line, color="#444444", markersize=12.0, label=told)
    for row, (friction, ratio) in places.items():
        side = dataset["side"].values[row]
        for wheel, which in enumerate(WHEELS):
            here = (side == wheel) & np.isfinite(friction)
            ax.plot(
                friction[here], ratio[here], _MARKERS[wheel], color=colour, alpha=0.75,
                markerfacecolor="white" if row == 0 else colour,
                label=f"{'new' if row == 0 else 'worn'}, {which} wheel",
            )  # fmt: skip
    ax.set_xlabel("Utilised friction")
    ax.set_ylabel("Largest pressure over yield stress in shear")
    ax.set_xlim(left=0.0)
    ax.set_ylim(bottom=0.0)
    return ax


def plot_passage_damage(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the normalised damage of each load cycle by every law over the lateral shift.

    Parameters
    ----------
    dataset : Dataset
        Result of a campaign with fatigue laws.
    ax : Axes, optional
        Where to draw.
    """
    ax = own_axes(ax)
    damage = dataset["fatigue_damage_passage"].values[last_worn_row(dataset)]
    shift = np.broadcast_to(shown("shift", dataset["shift"].values)[:, None], damage.shape[:2])
    here = np.isfinite(damage[..., 0])
    for k, name in enumerate(dataset["fatigue_name"].values):
        ax.plot(
            shift[here], normalised(damage[here][:, k]), _MARKERS[k % len(_MARKERS)], color=_colour(k),
            markerfacecolor="none", label=str(name),
        )  # fmt: skip
    ax.set_xlabel(label(dataset, "shift"))
    ax.set_ylabel(wrapped("Damage of a load cycle over the largest of the law"))
    return ax


def _colour(index: int) -> str:
    return SERIES_COLOURS[index % len(SERIES_COLOURS)]
