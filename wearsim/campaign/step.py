"""One wear step: from the rate to the next state."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from wearsim.campaign.counterface import damped_counterface, wear_off_counterface
from wearsim.campaign.state import CounterfaceState, Increment, State, WearRate
from wearsim.campaign.vertices import lengths_of_sides, smooth_sides, worn_off_sides
from wearsim.contact.patch import FloatArray
from wearsim.damage.fatigue.balance import damage_after

RateAt = Callable[[State], WearRate]


@dataclass(frozen=True)
class StepRule:
    """What a wear step depends on besides state, rate and length.

    Parameters
    ----------
    radius, density : float
        Of the wheels at the running circle [m], and of their material [kg/m3].
    smoothing_wavelength : float
        Wavelength whose amplitude in the increment is halved; 0 = no smoothing [m].
    integrator : str
        Name in `INTEGRATORS`.
    estimate : bool
        Whether to estimate the error also where it takes another contact solution.
    crack_depth : tuple of float
        Depth of a crack of damage 1 for each fatigue law; infinite where wear removes no damage [m].
    """

    radius: float
    density: float
    smoothing_wavelength: float
    integrator: str
    estimate: bool = False
    crack_depth: tuple[float, ...] = ()


def damped(rate: WearRate, step_length: float) -> FloatArray:
    r"""Depth by regime (2, n_regimes, n) of a semi-implicit step of a length [m].

    Notes
    -----
    :math:`\sum d / (1 + \sum d/g)` over the operating points (spec 3.2 (b)). Depth and sum of depth over
    interpenetration are averaged over the stretch of each vertex in the same way, so that the strips of the
    patches leave no pattern on the profile.
    """
    depth: FloatArray = rate.regime_depth * step_length / _divisor(rate, step_length)
    return depth


def _divisor(rate: WearRate, step_length: float) -> FloatArray:
    if rate.damping is None:
        raise ValueError("a semi-implicit step needs a wear rate with its damping")
    divisor: FloatArray = (1.0 + rate.damping * step_length)[:, None]
    return divisor


def _at_once(rate: WearRate, step_length: float) -> Increment:
    """Increment of a step at the rate of its beginning."""
    return Increment(
        rate.regime_depth * step_length,
        tuple(depth * step_length for depth in rate.comparison),
        tuple(damage * step_length for damage in rate.fatigue),
        None if rate.counterface is None else rate.counterface.depth * step_length,
    )


def _damped(rate: WearRate, step_length: float) -> Increment:
    """Increment of a step at the rate of its end, linearised; fatigue damage at the rate of its beginning."""
    start, divisor = _at_once(rate, step_length), _divisor(rate, step_length)
    comparison = tuple(depth / divisor for depth in start.comparison)
    return Increment(
        damped(rate, step_length), comparison, start.fatigue, damped_counterface(rate, step_length)
    )


def _mean_of_rates(
    state: State, rate: WearRate, step_length: float, ahead: State, predicted: WearRate
) -> Increment:
    """Increment at the mean of the rates in two states, scaled to the present stretches."""
    stretch = _stretched(state, ahead)

    def mean(here: FloatArray, there: FloatArray, stretch: FloatArray = stretch) -> FloatArray:
        scale = stretch[:, None, :] if here.ndim == 3 else stretch
        value: FloatArray = 0.5 * step_length * (here + there * scale)
        return value

    counterface = None
    if rate.counterface is not None and predicted.counterface is not None:
        assert state.counterface is not None  # it wears
        assert ahead.counterface is not None
        longer = _stretched(state.counterface, ahead.counterface)
        counterface = mean(rate.counterface.depth, predicted.counterface.depth, longer)
    return Increment(
        mean(rate.regime_depth, predicted.regime_depth),
        tuple(mean(*pair) for pair in zip(rate.comparison, predicted.comparison, strict=True)),
        tuple(mean(*pair) for pair in zip(rate.fatigue, predicted.fatigue, strict=True)),
        counterface,
    )


def _stretched(before: State | CounterfaceState, after: State | CounterfaceState) -> FloatArray:
    """Lengths the vertices stand for, (2, n), after over before [-]."""
    return lengths_of_sides(after.y, after.z) / lengths_of_sides(before.y, before.z)


class Integrator(NamedTuple):
    """Rule of a wear step."""

    # of first order, from the rate at the beginning and the length of the step [m]
    increment: Callable[[WearRate, float], Increment]
    # whether the step is that of Heun's rule, at the mean of the rates at the beginning and at the end of the
    # increment of first order; otherwise Heun's rule estimates the error only
    second_order: bool


INTEGRATORS = {
    "euler": Integrator(_at_once, second_order=False),
    "heun": Integrator(_at_once, second_order=True),
    "semi_implicit": Integrator(_damped, second_order=False),
}
r"""Rules by name.

With virtual penetration the rate of a strip falls with :math:`1 - d/g`. Solved for the depth at the end of
the step, "semi_implicit" multiplies a wave by :math:`1/(1 + S)` instead of :math:`1 - S`: it is stable for
any length.
"""


def advance(state: State, rate: WearRate, step_length: float, rule: StepRule, rate_at: RateAt) -> State:
    """Wear both wheels, and a counterface that wears, over a distance.

    Parameters
    ----------
    rate : WearRate
        At the beginning of the step, for the acting points.
    step_length : float
        Distance to run [m].
    rate_at : callable
        Wear rate of the same points as a function of the state.

    Returns
    -------
    State
        At the end of the step. Its error is the largest difference in depth between the rules of first and
        second order, after smoothing, of wheels and counterface, without comparison laws and fatigue damage.

    Raises
    ------
    NumericalError
        When the step is too deep for the curvature of the profile.
    """

    def wear_off(increment: Increment) -> State:
        worn = remove(state, increment.regime_depth, step_length, rule)
        if state.counterface is not None and increment.counterface is not None:
            wave = rule.smoothing_wavelength
            other = wear_off_counterface(state.counterface, increment.counterface, wave)
            worn = replace(worn, counterface=other)
        return _with_comparison_laws(state, worn, increment, rule)

    integrator = INTEGRATORS[rule.integrator]
    first = wear_off(integrator.increment(rate, step_length))
    if not (rule.estimate or integrator.second_order):
        return first
    second = wear_off(_mean_of_rates(state, rate, step_length, first, rate_at(first)))
    after, companion = (second, first) if integrator.second_order else (first, second)
    error = float(np.abs(after.wear_depth - companion.wear_depth).max())
    if after.counterface is not None and companion.counterface is not None:
        error = max(error, float(np.abs(after.counterface.depth - companion.counterface.depth).max()))
    return replace(after, step_error=error)


def remove(state: State, regime_depth: FloatArray, step_length: float, rule: StepRule) -> State:
    r"""Remove a wear increment from the profiles of the wheels.

    The depth by regime (2, n_regimes, n) at the vertices, before smoothing [m], is that of `step_length` [m].
    The area between the polygons is the sum of depth times vertex length.

    Notes
    -----
    Smoothing acts on each regime, so that the depths of the regimes sum to the total. The mass is that of
    rings of radius :math:`r(y) = r_0 + z` before the step:
    :math:`\rho \sum 2 \pi r_j d_j l_j`.
    """
    depth = smooth_sides(state.y, state.z, regime_depth, rule.smoothing_wavelength)
    total, length = depth.sum(axis=1), lengths_of_sides(state.y, state.z)
    y, z = worn_off_sides(state.y, state.z, total, "wheel")
    mass = rule.density * 2.0 * np.pi * ((rule.radius + state.z) * total * length).sum(axis=1)
    return replace(
        state,
        step=state.step + 1,
        distance=state.distance + step_length,
        y=y,
        z=z,
        wear_depth=state.wear_depth + total,
        regime_depth=state.regime_depth + depth,
        worn_area=state.worn_area + (total * length).sum(axis=1),
        worn_mass=state.worn_mass + mass,
        step_length=step_length,
        step_error=None,
    )


def _with_comparison_laws(before: State, worn: State, increment: Increment, rule: StepRule) -> State:
    """Add the smoothed depths of the comparison laws and the fatigue damage that wear leaves."""
    length = lengths_of_sides(before.y, before.z)
    depths: list[FloatArray] = []
    areas: list[FloatArray] = []
    for by_regime, depth in zip(increment.comparison, before.comparison_depth, strict=True):
        smoothed = smooth_sides(before.y, before.z, by_regime, rule.smoothing_wavelength)
        depths.append(depth + smoothed.sum(axis=1))
        areas.append((smoothed * length[:, None]).sum(axis=2))
    taken = worn.wear_depth - before.wear_depth
    damage = tuple(
        damage_after(old, added, taken, depth)
        for old, added, depth in zip(before.fatigue_damage, increment.fatigue, rule.crack_depth, strict=True)
    )
    area = before.comparison_area + np.concatenate(areas, axis=1) if areas else before.comparison_area
    return replace(worn, comparison_depth=tuple(depths), comparison_area=area, fatigue_damage=damage)
