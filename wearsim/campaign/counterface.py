"""Wear of rails or rollers in a campaign: rate, removal, redressing, row variables."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from wearsim.campaign.state import CounterfaceRate, CounterfaceState, State, WearRate
from wearsim.campaign.vertices import (
    sample,
    share_out,
    smooth_sides,
    stretches,
    strip_heights,
    worn_off,
)
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import ContactPatches
from wearsim.contact.solve import Counterface
from wearsim.profile.shape import arc_length, vertex_lengths
from wearsim.scene.campaign import CounterfaceWear

if TYPE_CHECKING:
    from wearsim.scene import CampaignSetup

# Share of the redressing depth from which rollers are redressed. Steps aim at the
# depth; without the share a change of the rate within a step would require another
# step.
_NEAR = 0.99

_ROUNDING = 1e-9  # relative to the distance between redressings


def new_counterface(counterface: Counterface) -> CounterfaceState:
    """Return the initial state of rails or rollers that wear.

    Both profiles have the same number of points.
    """
    y, z = (
        np.stack([getattr(profile, axis) for profile in counterface.profiles])
        for axis in "yz"
    )
    unworn, side_zeros = np.zeros_like(y), np.zeros(2)
    return CounterfaceState(y, z, unworn, side_zeros, unworn, side_zeros)


def worn_counterface(
    counterface: Counterface, state: CounterfaceState | None
) -> Counterface:
    """Return a counterface with the profiles of a state.

    A counterface that does not wear is unchanged.
    """
    if state is None:
        return counterface
    right, left = (
        replace(profile, y=y, z=z)
        for profile, y, z in zip(counterface.profiles, state.y, state.z, strict=True)
    )
    return replace(counterface, profile=right, left=left)


def per_passage(
    solution: ContactPatches, law: FloatArray, state: CounterfaceState
) -> FloatArray:
    """Depth of the counterface (2, k) per passage, with its patches as on a wheel [m].

    Strips of the depth `law` (m, ny) of the wheel are transferred to the vertices of
    the counterface as to those of the wheel, by overlap of arc lengths.
    """
    depth = np.zeros_like(state.y)
    for side in (0, 1):
        at = np.flatnonzero(solution.side == side)
        arc = arc_length(state.y[side], state.z[side])
        area = np.zeros((1, arc.size))
        amount = (law[at] * solution.patch.width[at][:, None])[None]
        share_out(_edges_below(solution, at, side, state), stretches(arc), amount, area)
        depth[side] = area[0] / vertex_lengths(state.y[side], state.z[side])
    return depth


def _edges_below(
    solution: ContactPatches, at: IntArray, side: int, state: CounterfaceState
) -> FloatArray:
    """Arc length of the edges of the strips of patches `at` on the counterface [m]."""
    y, z = state.y[side], state.z[side]
    top = _running_part(y, z)
    return np.interp(solution.strip_edges_rail_y[at], y[top], arc_length(y, z)[top])


def with_counterface(
    rate: WearRate,
    law: FloatArray,
    over: tuple[FloatArray, FloatArray],
    state: State,
    radius: float,
    settings: CounterfaceWear,
) -> WearRate:
    r"""Add the wear rate of the counterface by the same passages to that of the wheels.

    Parameters
    ----------
    rate : WearRate
        Of the wheels alone.
    law : (m, ny) array
        Depth per passage of the wheel in each strip, weighted with the share and the
        environment factor of its operating point [m].
    over : tuple of (m, ny) array
        `law` over the interpenetration, without the rims of the patches [-], and over
        p0/E* of patches without interpenetration [m].
    state : State
        With the counterface.
    radius : float
        Of the wheels at the running circle [m].
    settings : CounterfaceWear
        How it wears.

    Returns
    -------
    WearRate
        Stability counts the depth of both bodies: both open the same gap.

    Notes
    -----
    The depth per metre run is that of a passage times `CounterfaceWear.passages`.
    """
    worn, solution = state.counterface, rate.solution
    assert worn is not None  # only called for a counterface that wears
    depth = per_passage(solution, law, worn)
    zeros = np.zeros_like(worn.y)
    result = CounterfaceRate(depth, zeros, zeros.copy())
    stability, height = rate.stability.copy(), strip_heights(solution, state.y, state.z)
    waves = rate.over_strain.copy()
    for side in (0, 1):
        at = np.flatnonzero(solution.side == side)
        area = float((depth[side] * vertex_lengths(worn.y[side], worn.z[side])).sum())
        passages = settings.passages(area)
        depth[side] *= passages
        both = passages + 1.0 / (2.0 * np.pi * (radius + height[at]))
        arc = arc_length(worn.y[side], worn.z[side])
        edges = _edges_below(solution, at, side, worn)
        for part, total in zip(
            over, (result.stability, result.over_strain), strict=True
        ):
            sample(edges, arc, part[at] * both, total[side])
        of_both = 1.0 + passages * 2.0 * np.pi * (radius + state.z[side])
        stability[side] *= of_both
        waves[side] *= of_both
    return replace(rate, counterface=result, stability=stability, over_strain=waves)


def _running_part(y: FloatArray, z: FloatArray) -> slice:
    """Vertices around the top between which y rises.

    The sides of a rail head may be undercut.
    """
    top = int(np.argmin(z))
    falls = np.flatnonzero(np.diff(y) <= 0.0)
    first = int(falls[falls < top].max(initial=-1)) + 1
    last = int(falls[falls >= top].min(initial=y.size - 1)) + 1
    return slice(first, last)


def moved_counterface(state: CounterfaceState, depth: FloatArray) -> CounterfaceState:
    """Rails or rollers with vertices moved by a depth (2, k) of either sign [m]."""
    y, up = worn_off(
        state.y, -state.z, depth, "counterface"
    )  # wheels have z out of the material
    return replace(state, y=y, z=-up, depth=state.depth + depth)


def wear_off_counterface(
    state: CounterfaceState, depth: FloatArray
) -> CounterfaceState:
    """Remove a wear increment from rails or rollers.

    The depth (2, k) at the vertices [m] is smoothed. The area between the polygons is
    the sum of depth times vertex length.
    """
    worn = moved_counterface(state, depth)
    area = (depth * vertex_lengths(state.y, state.z)).sum(axis=1)
    return replace(worn, worn_area=state.worn_area + area, last_depth=worn.depth)


def without_step(state: CounterfaceState) -> CounterfaceState:
    """Return the state of a counterface after a reprofiling of the wheels.

    The counterface does not wear in this step.
    """
    return replace(state, last_depth=state.depth)


def distance_to_redressing(
    state: State, rate: WearRate, settings: CounterfaceWear, wavelength: float
) -> float:
    """Distance after which a roller reaches the depth of redressing [m].

    The rate is the present one, smoothed with a wavelength [m]. The distance is
    infinite if no roller wears.
    """
    rollers = state.counterface
    if (
        rollers is None
        or rate.counterface is None
        or math.isinf(settings.redress_depth)
    ):
        return math.inf
    grows = smooth_sides(rollers.y, rollers.z, rate.counterface.depth, wavelength)
    worn = grows > 0.0
    return float(
        ((settings.redress_depth - rollers.depth[worn]) / grows[worn]).min(
            initial=math.inf
        )
    )


def redressed(state: State, new: Counterface, settings: CounterfaceWear) -> State:
    """Redress both rollers to their new profile, where distance or depth require it.

    The new profile is restored bit by bit.
    """
    rollers = state.counterface
    if rollers is None:
        return state
    run = state.distance - rollers.redressed_at
    due = run >= settings.redress_distance * (1.0 - _ROUNDING)
    deepest = rollers.last_depth.max(axis=1)
    if not due and deepest.max() < _NEAR * settings.redress_depth:
        return state
    fresh = replace(
        new_counterface(new),
        worn_area=rollers.worn_area,
        last_depth=rollers.last_depth,
        redressed_depth=rollers.redressed_depth + deepest,
        redressed_count=rollers.redressed_count + 1,
        redressed_at=state.distance,
    )
    return replace(
        state, counterface=fresh, point_length=np.zeros_like(state.point_length)
    )


def static_counterface(setup: CampaignSetup) -> dict[str, Any]:
    """Return the static variables of a result file whose counterface wears."""
    if setup.counterface_wear is None:
        return {}
    kind = "roller" if setup.kind == "rig" else "rail"
    return {"counterface_name": (f"right {kind}", f"left {kind}")}


def counterface_row(state: CounterfaceState | None) -> dict[str, np.ndarray]:
    """Return the variables of one row on a counterface that wears [SI units].

    The result is empty if it does not wear.
    """
    if state is None:
        return {}
    row = {
        "profile_y": state.y,
        "profile_z": state.z,
        "wear_depth": state.last_depth,
        "worn_area": state.worn_area,
        "max_wear_depth": state.last_depth.max(axis=1),
        "redressed_depth": state.redressed_depth,
        "redressed_count": np.asarray(state.redressed_count, dtype=np.int32),
    }
    return {f"counterface_{name}": value for name, value in row.items()}
