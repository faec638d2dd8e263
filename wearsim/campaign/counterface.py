"""Wear of rails or rollers along a campaign: rate, removal, and turning a roller back to its new profile."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from wearsim.campaign.smoothing import smooth_sides
from wearsim.campaign.state import CounterfaceRate, CounterfaceState, State, WearRate
from wearsim.campaign.vertices import sample, share_out, stretches, taken_off
from wearsim.contact.patch import FloatArray
from wearsim.contact.solve import Counterface
from wearsim.operation.counterface import CounterfaceWear
from wearsim.profile.shape import arc_length, vertex_lengths

# A roller this close to the depth at which it is turned is turned: steps are aimed at the depth, and what
# is left by the change of the rate within a step would take another one.
_NEAR = 0.99

_ROUNDING = 1e-9  # of the distance run, as a share of that between turnings


def new_counterface(counterface: Counterface) -> CounterfaceState:
    """Return the initial state of a counterface that wears.

    Parameters
    ----------
    counterface : Counterface
        As new; both sides with the same number of points.
    """
    y, z = (np.stack([getattr(one, axis) for one in counterface.profiles]) for axis in "yz")
    unworn, nothing = np.zeros_like(y), np.zeros(2)
    return CounterfaceState(y, z, unworn, nothing, unworn, nothing)


def worn_counterface(counterface: Counterface, state: CounterfaceState | None) -> Counterface:
    """Return a counterface with the profiles of a state, itself if it does not wear."""
    if state is None:
        return counterface
    right, left = (
        replace(one, y=y, z=z) for one, y, z in zip(counterface.profiles, state.y, state.z, strict=True)
    )
    return replace(counterface, profile=right, left=left)


def with_counterface(
    rate: WearRate,
    law: FloatArray,
    over_gap: FloatArray,
    state: State,
    radius: float,
    settings: CounterfaceWear,
) -> WearRate:
    r"""Add to the rate of the wheels what their counterface loses by the same passages.

    Parameters
    ----------
    rate : WearRate
        Of the wheels alone.
    law : (m, ny) array
        Depth per passage of the wheel in each strip, weighted with the share and the environment factor of
        its operating point [m].
    over_gap : (2, m, ny) array
        The same over the interpenetration, with the rims of the patches and without [-].
    state : State
        With the counterface.
    radius : float
        Of the wheels at the tape circle [m].
    settings : CounterfaceWear
        How it wears.

    Returns
    -------
    WearRate
        Stability and damping count the depth that both bodies lose: each of them opens the same gap.

    Notes
    -----
    Strips are carried to the vertices of the counterface as they are to those of the wheel, by overlap of
    arc lengths. Their depth per metre run is that of a passage times `CounterfaceWear.passages`.
    """
    below, solution = state.counterface, rate.solution
    assert below is not None  # it wears
    assert rate.damping is not None  # `accumulate` gives it
    result = CounterfaceRate(np.zeros_like(below.y), np.zeros_like(below.y), np.zeros_like(below.y))
    stability, damping = rate.stability.copy(), rate.damping.copy()
    for side in (0, 1):
        y, z = below.y[side], below.z[side]
        arc = arc_length(y, z)
        at = np.flatnonzero(solution.side == side)
        top = _running_part(y, z)
        strip_edges = np.interp(solution.strip_edges_rail_y[at], y[top], arc[top])
        width = solution.fields.strip_width[at][:, None]
        passages = settings.passages(float((law[at] * width).sum()))
        edges = solution.strip_edges_wheel_y[at]
        rising_y = np.maximum.accumulate(state.y[side])  # as for the wheel
        height = np.interp(0.5 * (edges[:, 1:] + edges[:, :-1]), rising_y, state.z[side])
        both = passages + 1.0 / (2.0 * np.pi * (radius + height))
        carried = np.stack([law[at] * passages, over_gap[0, at] * both]) * width
        area = np.zeros((2, y.size))
        share_out(strip_edges, stretches(arc), carried, area)
        result.depth[side], result.damping[side] = area / vertex_lengths(y, z)
        sample(strip_edges, arc, over_gap[1, at] * both, result.stability[side])
        more = 1.0 + passages * 2.0 * np.pi * (radius + state.z[side])
        stability[side] *= more
        damping[side] *= more
    return replace(rate, counterface=result, stability=stability, damping=damping)


def _running_part(y: FloatArray, z: FloatArray) -> slice:
    """Vertices around the top between which y rises: a head may be undercut at its sides."""
    top = int(np.argmin(z))
    falls = np.flatnonzero(np.diff(y) <= 0.0)
    first = int(falls[falls < top].max(initial=-1)) + 1
    last = int(falls[falls >= top].min(initial=y.size - 1)) + 1
    return slice(first, last)


def damped_counterface(rate: WearRate, step_length: float) -> FloatArray | None:
    """Depth (2, k) of a semi-implicit step, as `campaign.step.damped` gives that of the wheels [m]."""
    below = rate.counterface
    if below is None:
        return None
    depth: FloatArray = below.depth * step_length / (1.0 + below.damping * step_length)
    return depth


def wear_off_counterface(
    state: CounterfaceState, depth: FloatArray, smoothing_wavelength: float
) -> CounterfaceState:
    """Take a wear increment off rails or rollers.

    Parameters
    ----------
    state : CounterfaceState
        Before.
    depth : (2, k) array
        At the vertices, before smoothing [m].
    smoothing_wavelength : float
        As for the wheels [m].

    Returns
    -------
    CounterfaceState
        After; the area between the polygons is the sum of depth times vertex length.
    """
    increment = smooth_sides(state.y, state.z, depth, smoothing_wavelength)
    moved = [
        taken_off(y, -z, row, f"{side} counterface")  # wheels have z out of the material
        for side, y, z, row in zip(("right", "left"), state.y, state.z, increment, strict=True)
    ]
    lengths = np.stack([vertex_lengths(y, z) for y, z in zip(state.y, state.z, strict=True)])
    worn = state.depth + increment
    return replace(
        state,
        y=np.stack([y for y, _ in moved]),
        z=np.stack([-z for _, z in moved]),
        depth=worn,
        worn_area=state.worn_area + (increment * lengths).sum(axis=1),
        last_depth=worn,
    )


def as_it_is(state: CounterfaceState) -> CounterfaceState:
    """Return the state of a counterface on which nothing has run since: what rollers lost before is told."""
    return replace(state, last_depth=state.depth)


def way_to_turning(state: State, rate: WearRate, settings: CounterfaceWear, wavelength: float) -> float:
    """Distance after which a roller will be as deep as it may be before it is turned.

    Parameters
    ----------
    state : State
        With the counterface.
    rate : WearRate
        In that state.
    settings : CounterfaceWear
        With the depth at which rollers are turned.
    wavelength : float
        Of the smoothing [m].

    Returns
    -------
    float
        At the rate of now, infinite where no roller comes deeper [m].
    """
    below = state.counterface
    if below is None or rate.counterface is None or math.isinf(settings.redress_depth):
        return math.inf
    grows = smooth_sides(below.y, below.z, rate.counterface.depth, wavelength)
    worn = grows > 0.0
    return float(((settings.redress_depth - below.depth[worn]) / grows[worn]).min(initial=math.inf))


def turned(state: State, new: Counterface, settings: CounterfaceWear) -> State:
    """Turn both rollers back to their new profile if it is time to.

    Parameters
    ----------
    state : State
        At the end of a step.
    new : Counterface
        As at the start.
    settings : CounterfaceWear
        With distance and depth at which rollers are turned.

    Returns
    -------
    State
        The same if neither is reached; with the bits of the new profiles if one is.
    """
    below = state.counterface
    if below is None:
        return state
    run = state.distance - below.turned_at
    due = run >= settings.redress_distance * (1.0 - _ROUNDING)
    deepest = below.last_depth.max(axis=1)
    if not due and deepest.max() < _NEAR * settings.redress_depth:
        return state
    fresh = replace(
        new_counterface(new),
        worn_area=below.worn_area,
        last_depth=below.last_depth,
        turned_depth=below.turned_depth + deepest,
        turnings=below.turnings + 1,
        turned_at=state.distance,
    )
    return replace(state, counterface=fresh)
