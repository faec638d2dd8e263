"""Length of the next wear step, and the operating points that act in it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from wearsim.campaign.counterface import damped_counterface, distance_to_redressing
from wearsim.campaign.state import State, WearRate
from wearsim.campaign.step import damped
from wearsim.campaign.vertices import smooth_sides
from wearsim.contact.patch import FloatArray
from wearsim.contact.solve import ContactModels
from wearsim.errors import NumericalError
from wearsim.operation.points import OperatingPoints
from wearsim.scene.campaign import ControlSettings, CounterfaceWear

# share of the loop within which places of a programme are equal: above the rounding of the distance
_SAME_PLACE = 1e-9

_ROUNDING = 1e-12  # of the distance of a campaign

# factor on the step length expected to keep the tolerance, so that few steps are repeated
_SAFETY = 0.9

_BISECTIONS = 20

DepthLimit = Callable[[WearRate, FloatArray], float]


class StepChoice(NamedTuple):
    """The next step."""

    weight: FloatArray  # (n,) share of the step each operating point acts for
    step_length: float  # distance to run [m]
    # what limits it: "stability", "depth cap", "error", "max step", "block border", "whole loops",
    # "redressing" or "remaining distance"
    reason: str


def half_space_depth_limit(
    rate: WearRate, weight: FloatArray, models: ContactModels, spacing: float, wavelength: float = 0.0
) -> float:
    r"""Largest stable depth of a step for normal models without interpenetration.

    Parameters
    ----------
    rate : WearRate
        With the contact solution.
    weight : (n,) array
        Only points with a weight above 0 act.
    models : ContactModels
        Elastic constants.
    spacing : float
        Distance of the profile vertices, the shortest half wave the profile can carry [m].
    wavelength : float
        Of the smoothing, whose amplitude is halved; 0 = no smoothing [m].

    Returns
    -------
    float
        :math:`(p_0/E^*) \max(\Delta y, \Lambda/2)` with the smallest maximum pressure of all acting patches
        without interpenetration that are not faint [m]; infinite where there are none.

    Notes
    -----
    Spec 3.2 (a): explicit steps on a half-space start to oscillate at the grid wavelength at about 1.5
    times :math:`(p_0/E^*)\,\Delta y`; the bound of a wave is :math:`4 \bar p/(E^* q)`. Smoothing passes the
    share :math:`1/(1 + (\Lambda/\lambda)^4)` of a wave, and wave number times share is at most
    :math:`0.57 \cdot 2\pi/\Lambda`: the bound becomes :math:`0.88\,(p_0/E^*)\,\Lambda`, of which half
    of :math:`\Lambda` is used. :math:`E^* = E / (2 (1 - \nu^2))` for two equal bodies.
    """
    solution = rate.solution
    acts = (weight[solution.point] > 0.0) & ~solution.patch.interpenetration.any(axis=1)
    if rate.full is not None:
        acts &= rate.full
    if not acts.any():
        return math.inf
    modulus = models.youngs_modulus / (2.0 * (1.0 - models.poisson_ratio**2))
    return float(solution.max_pressure[acts].min()) / modulus * max(spacing, 0.5 * wavelength)


def error_limit(step_length: float, step_error: float | None, tolerance: float) -> float:
    r"""Length of the step whose error is expected to keep the tolerance, by a step taken or tried [m].

    :math:`0.9\,\Delta s \sqrt{\epsilon_{tol} / \epsilon}`, infinite without a limit: the estimate is the
    error of one step of first order, which grows with the square of the length.
    """
    if not step_error or math.isinf(tolerance):
        return math.inf
    return _SAFETY * step_length * math.sqrt(tolerance / step_error)


def largest_step(
    rate: WearRate,
    state: State,
    settings: ControlSettings,
    depth_limit: float = math.inf,
    length_limit: float = math.inf,
    counterface_wear: CounterfaceWear | None = None,
) -> tuple[float, str]:
    """Longest step within stability, depth cap, error, longest step and distance, and its active limit.

    Parameters
    ----------
    rate : WearRate
        In this state, for the acting points.
    depth_limit, length_limit : float
        Further limits of depth and length, such as `half_space_depth_limit` and `error_limit` [m].
    counterface_wear : CounterfaceWear, optional
        How the counterface wears, if it does.
    """
    wave = settings.smoothing_wavelength
    steepest = stability_rate(rate)
    wheels = _deepest(rate.regime_depth, state, wave)
    depth = None if rate.counterface is None else rate.counterface.depth
    counterface = _deepest_of_counterface(depth, state, wave)
    deepest = max(wheels, counterface)
    depth_cap = min(settings.depth_cap, _first_cap(state, settings, deepest))
    limits = {
        "remaining distance": settings.distance - state.distance,
        "max step": settings.max_step,
        "depth cap": depth_cap / deepest if deepest > 0.0 else math.inf,
        "stability": min(
            settings.stability / steepest if steepest > 0.0 else math.inf,
            depth_limit / (wheels + counterface) if deepest > 0.0 else math.inf,
        ),
        "error": length_limit,
    }
    if counterface_wear is not None:
        limits["redressing"] = distance_to_redressing(state, rate, counterface_wear, wave)
    if settings.integrator == "semi_implicit":
        longest = min(length for name, length in limits.items() if name != "depth cap")
        limits["depth cap"] = _damped_cap(rate, state, settings, depth_cap, limits["depth cap"], longest)
    reason = min(limits, key=limits.__getitem__)
    if not 0.0 < limits[reason] < math.inf:
        raise NumericalError(
            f"no wear step is possible after {state.distance / 1e3:.6g} km: the limit by {reason} is "
            f"{limits[reason]:.3g} m; check loads and the wear law's coefficients"
        )
    return limits[reason], reason


def _first_cap(state: State, settings: ControlSettings, deepest: float) -> float:
    """Depth cap after a new profile: doubled per step of the wheels, or with the distance of rollers."""
    cap = settings.first_depth * 2.0 ** min(state.step - state.reprofiled, 60)
    rollers = state.counterface
    if rollers is None or rollers.redressed_count == 0:
        return cap
    return min(cap, settings.first_depth + deepest * (state.distance - rollers.redressed_at))


def choose(
    state: State,
    points: OperatingPoints,
    rate_for_weights: Callable[[FloatArray], WearRate],
    settings: ControlSettings,
    *,
    depth_limit: DepthLimit | None = None,
    length_limit: float = math.inf,
    counterface_wear: CounterfaceWear | None = None,
) -> StepChoice:
    """Choose the acting points and the length of the next step.

    Parameters
    ----------
    points : OperatingPoints
        Load collective; points with a block length form a programme that is repeated.
    rate_for_weights : callable
        Wear rate in this state as a function of weights (n,).
    depth_limit : callable, optional
        Further limit of the depth per step as a function of a rate and its weights [m].
    length_limit : float
        Limit by the error, such as `error_limit` [m].
    counterface_wear : CounterfaceWear, optional
        How the counterface wears, if it does; a step ends where rollers are redressed.

    Notes
    -----
    A programme acts as the collective of its blocks when the step may be one loop or longer, for a whole
    number of loops; otherwise the present block acts alone and the step ends at its border at the latest. A
    remaining stretch between one and two steps long is halved.
    """

    def largest(weight: FloatArray) -> tuple[float, str]:
        rate = rate_for_weights(weight)
        limit = math.inf if depth_limit is None else depth_limit(rate, weight)
        return largest_step(rate, state, settings, limit, length_limit, counterface_wear)

    remaining, last = settings.distance - state.distance, "remaining distance"
    if counterface_wear is not None and state.counterface is not None:
        until = state.counterface.redressed_at + counterface_wear.redress_distance - state.distance
        if until < remaining * (1.0 - _SAME_PLACE):
            remaining, last = until, "redressing"
    loop = float(points.block_length.sum())
    if loop == 0.0:
        allowed, reason = largest(points.weight)
        return StepChoice(points.weight, *_without_sliver(allowed, reason, remaining, last))

    if remaining >= loop * (1.0 - _SAME_PLACE):
        collective = points.block_length / loop
        allowed, reason = largest(collective)
        loops = math.floor(min(allowed, remaining) / loop + _SAME_PLACE)
        if loops >= 1:
            step = loops * loop
            if abs(remaining - step) <= _SAME_PLACE * loop:
                return StepChoice(collective, remaining, last)
            return StepChoice(collective, step, "whole loops")

    block, rest = present_block(state.distance, points.block_length)
    weight = np.zeros_like(points.weight)
    weight[block] = 1.0
    allowed, reason = largest(weight)
    border = "block border"
    if remaining <= rest * (1.0 + _SAME_PLACE):
        rest, border = remaining, last
    return StepChoice(weight, *_without_sliver(allowed, reason, rest, border))


def stability_rate(rate: WearRate) -> float:
    """Largest rate of the stability number on the wheels and on their counterface, if that wears [1/m]."""
    steepest = float(rate.stability.max(initial=0.0))
    if rate.counterface is None:
        return steepest
    return max(steepest, float(rate.counterface.stability.max(initial=0.0)))


def _deepest_of_counterface(depth: FloatArray | None, state: State, wavelength: float) -> float:
    """Largest depth after smoothing of a depth (2, k) of the counterface, if that wears."""
    if state.counterface is None or depth is None:
        return 0.0
    return float(smooth_sides(state.counterface.y, state.counterface.z, depth, wavelength).max())


def _deepest(regime_depth: FloatArray, state: State, wavelength: float) -> float:
    """Largest depth after smoothing of a depth by regime (2, n_regimes, n)."""
    return float(smooth_sides(state.y, state.z, regime_depth, wavelength).sum(axis=1).max())


def _damped_cap(
    rate: WearRate, state: State, settings: ControlSettings, cap: float, explicit: float, longest: float
) -> float:
    """Length at which a semi-implicit step reaches the cap: between that of an explicit one and `longest`."""
    wave = settings.smoothing_wavelength

    def within(length: float) -> bool:
        other = _deepest_of_counterface(damped_counterface(rate, length), state, wave)
        return max(_deepest(damped(rate, length), state, wave), other) <= cap

    if explicit >= longest or within(longest):
        return math.inf
    low, high = explicit, longest
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if within(middle) else (low, middle)
    return low


def reached(distance: float, target: float) -> bool:
    """Whether the distance of a campaign is reached within the rounding of the sum of all steps [m]."""
    return target - distance <= _ROUNDING * target


def present_block(distance: float, block_length: FloatArray) -> tuple[int, float]:
    """Block of a repeated programme at a distance, and the distance to its end [m].

    At a border it is the next block. Points outside the programme have a `block_length` of 0, (n,) [m].
    """
    ends = np.cumsum(block_length)
    loop = float(ends[-1])
    place = math.fmod(distance, loop)
    if loop - place <= _SAME_PLACE * loop:
        place = 0.0
    ahead = (ends - place > _SAME_PLACE * loop) & (block_length > 0.0)
    index = int(np.argmax(ahead))
    return index, float(ends[index] - place)


def _without_sliver(allowed: float, reason: str, stretch: float, border: str) -> tuple[float, str]:
    """Cut a step at the end of a stretch; halve a rest of less than two steps."""
    if allowed >= stretch:
        return stretch, border
    return (allowed, reason) if 2.0 * allowed <= stretch else (0.5 * stretch, reason)
