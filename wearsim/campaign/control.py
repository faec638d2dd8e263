"""Length of the next wear step, and its active operating points."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from wearsim.campaign.counterface import distance_to_redressing
from wearsim.campaign.state import State, WearRate, spacing_of
from wearsim.campaign.step import INTEGRATORS, stability_rate
from wearsim.campaign.vertices import smooth_sides
from wearsim.contact.patch import FloatArray
from wearsim.errors import NumericalError
from wearsim.operation.points import OperatingPoints
from wearsim.quantities import kilometres
from wearsim.scene.campaign import ControlSettings, CounterfaceWear

# Share of the loop within which positions in a programme are equal; it is above the
# rounding of the distance.
_SAME_PLACE = 1e-9

_ROUNDING = 1e-12  # relative to the distance of a campaign

# Factor on the step length that is expected to meet the tolerance, so that few steps
# are repeated.
_SAFETY = 0.9

_GROWTH = 3.0  # largest ratio of a step to the one before with the same points

# Factors on the observed stiffness, which is less than that of the fastest wave, and on
# the stability number, which is that of single strips before smoothing. With 1.25 such
# a wave could persist in steps of three stages that its own error, some tenths of the
# tolerance, keeps short; two more stages damp it within seven steps.
_SEEN, _OF_STRIPS = 1.5, 0.5

# Stability number of a step of length 1 over `half_space_rate`: an explicit step of
# first order, stable up to 2, oscillates above 1.5 times that length.
_HALF_SPACE = 4.0 / 3.0


class StepLimit(NamedTuple):
    """Length of a step and its active limit."""

    step_length: float  # distance to run [m]
    reason: str  # one of `quantities.STEP_LIMITS`
    stiffness: (
        float  # rate of the stability number, which selects the number of stages [1/m]
    )


class StepChoice(NamedTuple):
    """Length and active points of the next step."""

    weight: FloatArray  # (n,) share of the step each operating point acts for
    limit: StepLimit


def half_space_rate(rate: WearRate, state: State, wavelength: float) -> float:
    r"""Rate of the stability number of models without overlap [1/m].

    These are the normal models without interpenetration. Steps of first order are safe
    up to 1 over this rate and oscillate from 1.5 times that length on.

    Parameters
    ----------
    rate : WearRate
        In this state, for the acting points.
    state : State
        Profiles; the distance of their vertices is the shortest half wave they carry.
    wavelength : float
        Of the smoothing, whose amplitude is halved; 0 = no smoothing [m].

    Returns
    -------
    float
        [1/m], 0 where no patch is without interpenetration.

    Notes
    -----
    Largest sum over the patches :math:`m` at a place of the profile, smoothed,

    .. math::
        \frac{1}{\max(\Delta y, \Lambda/2)} \sum_m \frac{\dot d_m E^*}{p_{0,m}},

    with the depth rate :math:`\dot d` and the maximum pressure :math:`p_0` of patches
    that are not faint; :math:`E^* = E / (2 (1 - \nu^2))` for two equal bodies.

    Spec 3.2 (a): explicit steps on a half-space start to oscillate at the grid
    wavelength at about 1.5 times :math:`(p_0/E^*)\,\Delta y`; the bound of a wave is
    :math:`4 \bar p/(E^* q)`. Patches that cover a place damp its waves in sum, as
    strips of virtual penetration do (spec 3.2 (b)). Smoothing passes the share
    :math:`1/(1 + (\Lambda/\lambda)^4)` of a wave, and wave number times share is at
    most :math:`0.57 \cdot 2\pi/\Lambda`: the bound becomes
    :math:`0.88\,(p_0/E^*)\,\Lambda`, of which half of :math:`\Lambda` is used.
    """
    reach = max(spacing_of(state), 0.5 * wavelength)
    lines = [(state.y, state.z, rate.over_strain)]
    if state.counterface is not None and rate.counterface is not None:
        counterface_state = state.counterface
        lines.append(
            (counterface_state.y, counterface_state.z, rate.counterface.over_strain)
        )
    largest = [
        float(smooth_sides(y, z, over_strain, wavelength).max())
        for y, z, over_strain in lines
    ]
    return max(largest) / reach


def remembered_limit(
    state: State, weight: FloatArray, settings: ControlSettings
) -> tuple[float, str]:
    r"""Limit of the next step by the last steps of the active points [m], with reason.

    Each point was part of steps of its own length, share times distance, and error.
    Infinite before anything is known.

    Notes
    -----
    :math:`0.9\,\Delta s\,(\epsilon_{tol} / \epsilon)^{1/(p+1)}` and at most three times
    :math:`\Delta s`: the estimate is the error of one step of a rule of order p.
    """
    active = weight > 0.0
    if not acts_before(state, weight):
        return math.inf, "error"
    length, error = state.point_length[active], state.point_error[active]
    limits = [
        (error_limit(run, of_step, settings) / share, _GROWTH * run / share)
        for run, of_step, share in zip(
            length.tolist(), error.tolist(), weight[active].tolist(), strict=True
        )
    ]
    by_error, by_growth = (min(values) for values in zip(*limits, strict=True))
    return (by_error, "error") if by_error <= by_growth else (by_growth, "growth")


def error_limit(
    step_length: float, step_error: float, settings: ControlSettings
) -> float:
    """Length of the step expected to meet the tolerance [m].

    It follows from the error of an accepted or rejected step.
    """
    if step_error == 0.0 or math.isinf(settings.error_tolerance):
        return math.inf
    order = INTEGRATORS[settings.integrator][0].order
    return float(
        _SAFETY
        * step_length
        * (settings.error_tolerance / step_error) ** (1.0 / (order + 1))
    )


def acts_before(state: State, weight: FloatArray) -> bool:
    """Return True if previous steps of all active points are known.

    A new block and new profiles start with small steps.
    """
    return state.point_length.size > 0 and bool(
        (state.point_length[weight > 0.0] > 0.0).all()
    )


def largest_step(
    rate: WearRate,
    state: State,
    settings: ControlSettings,
    further: tuple[float, str] = (math.inf, "error"),
    counterface_wear: CounterfaceWear | None = None,
    *,
    first: bool = False,
    stiffness: float = 0.0,
) -> StepLimit:
    """Longest step within all limits [m], and the active limit.

    The limits are stability, depth cap, error, longest step and distance.

    Parameters
    ----------
    rate : WearRate
        In this state, for the acting points.
    further : tuple of float and str
        Further limit of the length [m] and its name, such as `remembered_limit`.
    counterface_wear : CounterfaceWear, optional
        How the counterface wears, if it does.
    first : bool
        True if the first depth limits the step, see `acts_before`.
    stiffness : float
        That steps before have shown, 0 if none has [1/m].
    """
    wave = settings.smoothing_wavelength
    wheels = float(
        smooth_sides(state.y, state.z, rate.regime_depth, wave).sum(axis=1).max()
    )
    counterface = 0.0
    if state.counterface is not None and rate.counterface is not None:
        counterface_state = state.counterface
        counterface = float(
            smooth_sides(
                counterface_state.y, counterface_state.z, rate.counterface.depth, wave
            ).max()
        )
    deepest = max(wheels, counterface)
    steepest, half_space = stability_rate(rate), half_space_rate(rate, state, wave)
    if stiffness > 0.0:
        steepest *= _OF_STRIPS

    def over(limit: float, per_metre: float) -> float:
        return limit / per_metre if per_metre > 0.0 else math.inf

    limits = {
        "remaining distance": settings.distance - state.distance,
        "max step": settings.max_step,
        "depth cap": over(settings.depth_cap, deepest),
        "first step": over(settings.first_depth, deepest) if first else math.inf,
        "stability": min(
            over(settings.stability, steepest),
            over(settings.half_space_depths, half_space),
            over(INTEGRATORS[settings.integrator][-1].stable, _SEEN * stiffness),
        ),
    }
    limits[further[1]] = min(further[0], limits.get(further[1], math.inf))
    if counterface_wear is not None:
        limits["redressing"] = distance_to_redressing(
            state, rate, counterface_wear, wave
        )
    reason = min(limits, key=limits.__getitem__)
    if not 0.0 < limits[reason] < math.inf:
        raise NumericalError(
            f"no wear step is possible after {kilometres(state.distance)}: the limit "
            f"by {reason} is {limits[reason]:.3g} m; check loads and the wear law's "
            "coefficients"
        )
    # Below the limit of the most stages the observed stiffness adds stages: a step that
    # is too long for them has a large error.
    return StepLimit(
        limits[reason],
        reason,
        max(steepest, _HALF_SPACE * half_space, _SEEN * stiffness),
    )


def choose(
    state: State,
    points: OperatingPoints,
    rate_for_weights: Callable[[FloatArray], WearRate],
    settings: ControlSettings,
    *,
    length_limit: tuple[float, str] = (math.inf, "error"),
    stiffness: float = 0.0,
    counterface_wear: CounterfaceWear | None = None,
) -> StepChoice:
    """Choose the active points and the length of the next step.

    Parameters
    ----------
    points : OperatingPoints
        Load collective; points with a block length form a programme that is repeated.
    rate_for_weights : callable
        Wear rate in this state as a function of weights (n,).
    length_limit : tuple of float and str
        Of a step that is tried again, by its error [m].
    stiffness : float
        That it has shown [1/m].
    counterface_wear : CounterfaceWear, optional
        How the counterface wears, if it does; a step ends where rollers are redressed.

    Notes
    -----
    A programme is run as the collective of its blocks, for a whole number of loops, if
    at the start of a loop the step may be one loop or longer. Otherwise the present
    block is run alone and the step ends at its border at the latest. If the first block
    alone does not reach its end in one step, the collective, in which it wears as much,
    does not reach it either and is not evaluated. A remaining stretch between one and
    two steps long is halved.
    """

    def largest(weight: FloatArray) -> StepLimit:
        rate = rate_for_weights(weight)
        further = min(length_limit, remembered_limit(state, weight, settings))
        first = not acts_before(state, weight)
        highest_stiffness = (
            stiffness
            if first
            else max(stiffness, float(state.point_stiffness[weight > 0.0].max()))
        )
        return largest_step(
            rate,
            state,
            settings,
            further,
            counterface_wear,
            first=first,
            stiffness=highest_stiffness,
        )

    remaining, last = settings.distance - state.distance, "remaining distance"
    if counterface_wear is not None and state.counterface is not None:
        redressing_distance = (
            state.counterface.redressed_at
            + counterface_wear.redress_distance
            - state.distance
        )
        if redressing_distance < remaining * (1.0 - _SAME_PLACE):
            remaining, last = redressing_distance, "redressing"
    loop = float(points.block_length.sum())
    if loop == 0.0:
        return StepChoice(
            points.weight, _without_sliver(largest(points.weight), remaining, last)
        )

    block, rest = present_block(state.distance, points.block_length)
    weight = present_weight(state.distance, points)
    allowed = largest(weight)
    begins = block == int(
        np.argmax(points.block_length > 0.0)
    ) and rest >= points.block_length[block] * (1.0 - _SAME_PLACE)
    reaches = allowed.step_length >= rest * (1.0 - _SAME_PLACE)
    if begins and reaches and remaining >= loop * (1.0 - _SAME_PLACE):
        collective = points.block_length / loop
        whole = largest(collective)
        loops = math.floor(min(whole.step_length, remaining) / loop + _SAME_PLACE)
        if loops >= 1:
            step, reason = loops * loop, whole.reason
            if abs(remaining - step) <= _SAME_PLACE * loop:
                step, reason = remaining, last
            return StepChoice(
                collective, whole._replace(step_length=step, reason=reason)
            )

    border = "block border"
    if remaining <= rest * (1.0 + _SAME_PLACE):
        rest, border = remaining, last
    return StepChoice(weight, _without_sliver(allowed, rest, border))


def present_weight(distance: float, points: OperatingPoints) -> FloatArray:
    """Share (n,) of the next step for which each point is active.

    It is the weight of the points, or 1 in the present block of a repeated programme.
    """
    if not points.block_length.any():
        return points.weight
    weight = np.zeros_like(points.weight)
    weight[present_block(distance, points.block_length)[0]] = 1.0
    return weight


def reached(distance: float, target: float) -> bool:
    """Return True if a campaign has run its distance [m].

    The comparison allows for rounding of the sum of all steps.
    """
    return target - distance <= _ROUNDING * target


def present_block(distance: float, block_length: FloatArray) -> tuple[int, float]:
    """Block of a repeated programme at a distance, and the distance to its end [m].

    At the end of a block it is the next one. Points outside the programme have a
    `block_length` of 0, (n,) [m].
    """
    ends = np.cumsum(block_length)
    loop = float(ends[-1])
    place = math.fmod(distance, loop)
    if loop - place <= _SAME_PLACE * loop:
        place = 0.0
    ahead = (ends - place > _SAME_PLACE * loop) & (block_length > 0.0)
    index = int(np.argmax(ahead))
    return index, float(ends[index] - place)


def _without_sliver(allowed: StepLimit, stretch: float, border: str) -> StepLimit:
    """Cut a step at the end of a stretch; halve a remainder of less than two steps."""
    if allowed.step_length >= stretch:
        return allowed._replace(step_length=stretch, reason=border)
    return (
        allowed
        if 2.0 * allowed.step_length <= stretch
        else allowed._replace(step_length=0.5 * stretch)
    )
