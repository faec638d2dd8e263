"""Figures of one result: `plot_x(dataset, ax=None) -> Axes`.

A second call on the same axes lays another campaign over the first. Labels and units come from the
attributes of the dataset, colours from what it is: rig, field, rail.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from wearsim.profile.shape import arc_length
from wearsim.report.style import (
    COLOURS,
    REGIME_COLOURS,
    WHEEL_LINES,
    label,
    own_axes,
    role_of,
    shown,
    wrapped,
)
from wearsim.results.turnings import last_worn_row, new_row
from wearsim.translation.axes import at_distances, rows_at

WHEELS = ("right", "left")
_MARKERS = ("o", "^")
_NEW_Y = "Lateral position on the new wheel [mm]"


def _along(dataset: xr.Dataset, name: str, distance: float | None) -> np.ndarray:
    """Rows of a variable at a distance (None: the last one that wheels have run)."""
    values = np.asarray(dataset[name].values, dtype=np.float64)
    if distance is None:
        return np.asarray(values[last_worn_row(dataset)])
    run = np.asarray(dataset["distance"].values, dtype=np.float64)
    return np.asarray(at_distances(run, values, np.array([distance]))[0])


def _row(dataset: xr.Dataset, distance: float | None) -> int:
    run = np.asarray(dataset["distance"].values, dtype=np.float64)
    return last_worn_row(dataset) if distance is None else int(rows_at(run, np.array([distance]))[0])


def new_place(
    dataset: xr.Dataset, wheel: int, distance: float | None = None, *, against: str = "profile_y"
) -> np.ndarray:
    """Points of a wheel as it was new, or came from the lathe, last before a distance.

    Parameters
    ----------
    dataset : Dataset
        Result of a campaign.
    wheel : int
        0 right, 1 left.
    distance : float, optional
        Distance run [m]; the end if not given.
    against : {"profile_y", "arc_length"}
        Lateral position or arc length.

    Returns
    -------
    (n,) array
        Where depth and damage of that distance stand [m].
    """
    row = new_row(dataset, _row(dataset, distance))
    if against == "arc_length" and row == 0:
        return np.asarray(dataset["arc_length"].values)
    y, z = (np.asarray(dataset[f"profile_{c}"].values[row, wheel]) for c in "yz")
    return arc_length(y, z) if against == "arc_length" else y


def plot_profile(
    dataset: xr.Dataset,
    ax: Axes | None = None,
    *,
    wheel: int = 0,
    distance: float | None = None,
    new: bool = True,
) -> Axes:
    """Draw the worn wheel profile over the new or turned one and the counterface it runs on, flange down.

    Parameters
    ----------
    dataset : Dataset
        Result of a campaign.
    ax : Axes, optional
        Where to draw.
    wheel : int
        0 right, 1 left.
    distance : float, optional
        Distance run [m]; the end if not given.
    new : bool
        Whether to draw the new wheel and the counterface, too.
    """
    ax = own_axes(ax)
    role = role_of(dataset)
    if new:
        turned = new_row(dataset, _row(dataset, distance))
        y0, z0 = (dataset[f"profile_{c}"].values[turned, wheel] for c in "yz")
        rail_y, rail_z = dataset["counterface_y"].values, dataset["counterface_z"].values
        # lift the counterface until it touches the new wheel; both z point down here
        inside = (rail_y > y0.min()) & (rail_y < y0.max())
        order = np.argsort(y0)
        touch = np.max(np.interp(rail_y[inside], y0[order], z0[order]) - rail_z[inside], initial=-np.inf)
        if np.isfinite(touch):
            ax.plot(
                shown("counterface_y", rail_y), shown("counterface_z", rail_z + touch),
                color=COLOURS["rail"], lw=1.0, label="counterface profile",
            )  # fmt: skip
        ax.plot(
            shown("profile_y", y0),
            shown("profile_z", z0),
            "--",
            color=COLOURS["new"],
            lw=1.2,
            label="turned wheel" if turned else "new wheel",
        )
    y, z = (_along(dataset, f"profile_{c}", distance)[wheel] for c in "yz")
    ax.plot(shown("profile_y", y), shown("profile_z", z), color=COLOURS[role], label=f"worn, {role}")
    ax.set_aspect("equal", adjustable="datalim")
    if not ax.yaxis_inverted():
        ax.invert_yaxis()
    ax.set_xlabel(label(dataset, "profile_y"))
    ax.set_ylabel("Height, outward is down [mm]")
    return ax


def plot_wear_depth(
    dataset: xr.Dataset,
    ax: Axes | None = None,
    *,
    wheel: int = 0,
    distance: float | None = None,
    against: str = "profile_y",
    history: bool = False,
) -> Axes:
    """Draw the wear depth along the profile.

    Parameters
    ----------
    dataset : Dataset
        Result of a campaign.
    ax : Axes, optional
        Where to draw.
    wheel : int
        0 right, 1 left.
    distance : float, optional
        Distance run [m]; the end if not given.
    against : {"profile_y", "arc_length"}
        Lateral position or arc length of the new (or turned) wheel.
    history : bool
        Whether to draw a quarter, half and three quarters of the distance, too, faintly.
    """
    ax = own_axes(ax)
    role = role_of(dataset)
    end = float(dataset["distance"].values[-1]) if distance is None else distance
    if history:
        for part in (0.25, 0.5, 0.75):
            depth = _along(dataset, "wear_depth", part * end)[wheel]
            x = shown(against, new_place(dataset, wheel, part * end, against=against))
            ax.plot(x, shown("wear_depth", depth), color=COLOURS[role], lw=0.8, alpha=0.45)
    depth = _along(dataset, "wear_depth", distance)[wheel]
    ax.plot(
        shown(against, new_place(dataset, wheel, distance, against=against)),
        shown("wear_depth", depth),
        color=COLOURS[role],
        ls=WHEEL_LINES[wheel],
        label=f"{role}, {WHEELS[wheel]} wheel",
    )
    ax.set_xlabel(_NEW_Y if against == "profile_y" else label(dataset, against))
    ax.set_ylabel(wrapped(label(dataset, "wear_depth")))
    ax.set_ylim(bottom=0.0, auto=None)
    return ax


def plot_over_distance(dataset: xr.Dataset, name: str, ax: Axes | None = None) -> Axes:
    """Draw a measure of the wheels (or of the wheelset) over the distance run.

    Parameters
    ----------
    dataset : Dataset
        Result of a campaign.
    name : str
        Variable over (step, wheel) or (step).
    ax : Axes, optional
        Where to draw.
    """
    ax = own_axes(ax)
    role = role_of(dataset)
    x = shown("distance", dataset["distance"].values)
    values = shown(name, dataset[name].values)
    if values.ndim == 1:
        ax.plot(x, values, color=COLOURS[role], label=role)
    else:
        for wheel, side in enumerate(WHEELS):
            ax.plot(
                x, values[:, wheel], WHEEL_LINES[wheel], color=COLOURS[role], label=f"{role}, {side} wheel"
            )
    ax.set_xlabel(label(dataset, "distance"))
    ax.set_ylabel(wrapped(label(dataset, name)))
    return ax


def plot_conicity(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the equivalent conicity over the distance run; gaps where it is undefined."""
    return plot_over_distance(dataset, "equivalent_conicity", ax)


def plot_contact(
    dataset: xr.Dataset,
    name: str,
    ax: Axes | None = None,
    *,
    distance: float | None = None,
    new: bool = False,
) -> Axes:
    """Draw a contact quantity of every patch over the lateral shift of its operating point.

    Parameters
    ----------
    dataset : Dataset
        Result of a campaign.
    name : str
        Variable over (step, operating_point, patch), such as wheel_y or max_pressure.
    ax : Axes, optional
        Where to draw.
    distance : float, optional
        Distance run [m]: the last state stored before it; the end if not given.
    new : bool
        Draw the new wheel (hollow marks) instead.
    """
    ax = own_axes(ax)
    role = role_of(dataset)
    row = 0 if new else _row(dataset, distance)
    side = dataset["side"].values[row]
    values = shown(name, dataset[name].values[row])
    shift = np.broadcast_to(shown("shift", dataset["shift"].values)[:, None], values.shape)
    for wheel, which in enumerate(WHEELS):
        here = (side == wheel) & np.isfinite(values)
        ax.plot(
            shift[here], values[here], _MARKERS[wheel], color=COLOURS[role],
            markerfacecolor="white" if new else COLOURS[role], alpha=1.0 if new else 0.75,
            label=f"{'new' if new else 'worn'}, {which} wheel",
        )  # fmt: skip
    ax.set_xlabel(label(dataset, "shift"))
    ax.set_ylabel(wrapped(label(dataset, name)))
    return ax


def plot_wear_by_regime(
    dataset: xr.Dataset, ax: Axes | None = None, *, wheel: int = 0, distance: float | None = None
) -> Axes:
    """Draw the wear depth along the profile, stacked by wear regime.

    Parameters
    ----------
    dataset : Dataset
        Result of a campaign.
    ax : Axes, optional
        Where to draw.
    wheel : int
        0 right, 1 left.
    distance : float, optional
        Distance run [m]; the end if not given.
    """
    ax = own_axes(ax)
    y = shown("profile_y", new_place(dataset, wheel, distance))
    depth = shown("wear_depth_by_regime", _along(dataset, "wear_depth_by_regime", distance)[wheel])
    below = np.zeros_like(y)
    for index, name in enumerate(dataset["regime_name"].values):
        colour = REGIME_COLOURS[index % len(REGIME_COLOURS)]
        ax.fill_between(y, below, below + depth[index], color=colour, lw=0.0, label=str(name))
        below = below + depth[index]
    ax.plot(y, below, color=COLOURS[role_of(dataset)], lw=1.0)
    ax.set_xlabel(_NEW_Y)
    ax.set_ylabel(wrapped(label(dataset, "wear_depth")))
    ax.set_ylim(bottom=0.0, auto=None)
    return ax


def plot_steps(dataset: xr.Dataset, name: str, ax: Axes | None = None) -> Axes:
    """Draw a quantity of the wear steps (step_length, stability_number, step_error) over the distance."""
    ax = own_axes(ax)
    role = role_of(dataset)
    x = shown("distance", dataset["distance"].values[1:])
    ax.plot(x, shown(name, dataset[name].values[1:]), ".-", lw=0.8, color=COLOURS[role], label=role)
    limit = dataset.attrs.get(
        {"stability_number": "stability_limit", "step_error": "error_tolerance"}.get(name)
    )
    if limit is not None:
        ax.axhline(float(shown(name, limit)), color=COLOURS[role], lw=0.8, ls=":", label=f"limit, {role}")
    ax.set_xlabel(label(dataset, "distance"))
    ax.set_ylabel(wrapped(label(dataset, name)))
    ax.set_ylim(bottom=0.0, auto=None)
    return ax
