r"""Wear step: from the rate to the next state by an explicit Runge-Kutta rule.

The rate of the depth, after smoothing, is a function of the profiles alone. A rule of s
stages combines the rates in s states with the coefficients of its tableau; a stage may
lie above the profile it starts from, the end of a step does not.

Stiffness: with virtual penetration a step of the stability number S multiplies a wave
of the profile by the stability polynomial at -S. The Runge-Kutta-Chebyshev rules of
second order [1]_ stay below 1 up to about :math:`0.59 (s^2 - 1)`, the rule of two
stages (Heun) up to 2. Where the coefficient of a law jumps with the pressure, waves
decay ten times as fast as depth over interpenetration predicts. Each step observes the
decay by the rates in its own stages, `stiffness_of`, which selects the stages of the
next step. In each step of three stages and more, stiff waves are damped more than in
[1]_, to about three quarters: with the :math:`\epsilon = 2/13` of [1]_ they persist for
many steps, and the error they cause shortens these.

References
----------
.. [1] B. P. Sommeijer, L. F. Shampine, J. G. Verwer, RKC: an explicit solver for
   parabolic PDEs, J. Comput. Appl. Math. 88 (1997) 315-326,
   doi:10.1016/S0377-0427(97)00219-7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Chebyshev

from wearsim.campaign.counterface import moved_counterface, wear_off_counterface
from wearsim.campaign.state import CounterfaceState, Increment, State, WearRate
from wearsim.campaign.vertices import only_worn, smooth_sides, worn_off
from wearsim.contact.patch import FloatArray
from wearsim.damage.fatigue.balance import damage_after
from wearsim.profile.shape import vertex_lengths

_DAMPING = 1.0  # epsilon of the Runge-Kutta-Chebyshev rules

# Share of the stability limit of a Runge-Kutta-Chebyshev rule that is used: S 4.1 with
# three stages.
_USED = 0.86

# Norm of a depth change below which the tolerances of the solvers dominate the
# difference of rates [m].
_NOISE = 1e-7

# Share of the largest depth of a step above which a vertex belongs to its worn band.
_BAND = 0.02


class Tableau(NamedTuple):
    """Coefficients of an explicit rule."""

    order: int
    # (s + 1, s) coefficients of the rates by stage, as shares of the step; the last row
    # is the end.
    shares: FloatArray
    stable: float  # largest stability number with which the rule is used [-]


@dataclass(frozen=True)
class StepRule:
    """Rules of a wear step besides state, rate and length.

    Parameters
    ----------
    radius, density : float
        Of the wheels at the running circle [m], and of their material [kg/m3].
    smoothing_wavelength : float
        Wavelength whose amplitude in the increment is halved; 0 = no smoothing [m].
    integrator : str
        Name in `INTEGRATORS`.
    crack_depth : tuple of float
        Depth of a crack of damage 1 for each fatigue law; infinite where wear removes
        no damage [m].
    """

    radius: float
    density: float
    smoothing_wavelength: float
    integrator: str
    crack_depth: tuple[float, ...] = ()


def chebyshev_tableau(stages: int) -> Tableau:
    r"""Runge-Kutta-Chebyshev rule of second order with `stages` of at least 2.

    Its coefficients follow from the Chebyshev recurrence.

    Notes
    -----
    Equations (2.1) to (2.5) of [1]_ of the module with :math:`\epsilon = 1`; the first
    of them, with two stages, is Heun's rule.
    """
    w0 = 1.0 + _DAMPING / stages**2
    t, d, dd = np.array(
        [
            [
                float(Chebyshev.basis(j).deriv(k)(w0))
                if k
                else float(Chebyshev.basis(j)(w0))
                for k in range(3)
            ]
            for j in range(stages + 1)
        ]
    ).T
    w1 = d[stages] / dd[stages]
    b = np.array([0.0, 1.0 / w0, *(dd[2:] / d[2:] ** 2)])
    b[0] = b[2]
    shares = np.zeros((stages + 1, stages))
    shares[1, 0] = b[1] * w1
    for j in range(2, stages + 1):
        shares[j] = (
            2.0 * b[j] * w0 / b[j - 1] * shares[j - 1] - b[j] / b[j - 2] * shares[j - 2]
        )
        slope = 2.0 * b[j] * w1 / b[j - 1]
        shares[j, j - 1] += slope
        shares[j, 0] -= (1.0 - b[j - 1] * t[j - 1]) * slope
    limit = float((w0 + 1.0) * dd[stages] / d[stages])
    return Tableau(2, shares, _USED * limit)


INTEGRATORS: dict[str, tuple[Tableau, ...]] = {
    "rkc": tuple(chebyshev_tableau(stages) for stages in range(2, 9)),
    "euler": (Tableau(1, np.array([[0.0], [1.0]]), 1.0),),
}
"""Integration rules by name, by rising number of stages.

The first stable one takes the step.
"""


def tableau_of(integrator: str, stability: float) -> Tableau:
    """Return the rule with the fewest stages for a stability number.

    Beyond all rules it is the last one.
    """
    rules = INTEGRATORS[integrator]
    return next(
        (tableau for tableau in rules if stability <= tableau.stable * (1.0 + 1e-9)),
        rules[-1],
    )


def stability_rate(rate: WearRate) -> float:
    """Largest rate of the stability number on wheels and wearing counterface [1/m]."""
    steepest = float(rate.stability.max(initial=0.0))
    if rate.counterface is None:
        return steepest
    return max(steepest, float(rate.counterface.stability.max(initial=0.0)))


class Step(NamedTuple):
    """Wear step that was attempted."""

    state: State  # state at the end of the step
    clipped: (
        float  # largest share of the area of a body that was negative and set to 0 [-]
    )
    increment: Increment  # increment before negative depths were set to 0
    start: Increment  # rates at the beginning of the step, after smoothing
    depths: tuple[FloatArray, ...]  # (2, n) of each stage [m]
    rates: tuple[
        FloatArray, ...
    ]  # (2, n) in each stage per stretch at the beginning, after smoothing [-]

    @property
    def stages(self) -> int:
        """Number of stages of the rule."""
        return len(self.rates)


@dataclass(frozen=True)
class Stages:
    """Stages of a wear step with known rates."""

    state: State  # at the beginning of the step
    length: float  # of the step [m]
    rule: StepRule
    tableau: Tableau
    rates: tuple[
        Increment, ...
    ]  # after smoothing, per stretches of the vertices at the beginning
    depths: tuple[FloatArray, ...]  # (2, n) of each stage [m]

    @property
    def left(self) -> int:
        """Number of stages without a rate."""
        return len(self.tableau.shares) - 1 - len(self.rates)

    def ahead(self) -> State:
        """State of the next stage: profiles, depth and distance alone."""
        shares = self.tableau.shares[len(self.rates)]
        return _moved(
            self.state,
            _sum(self.rates, shares * self.length),
            float(shares.sum()) * self.length,
        )

    def with_rate(self, ahead: State, rate: WearRate) -> Stages:
        """Return the stages with the rate in the state of the next one added."""
        increment = _scaled(
            self.state, ahead, smoothed(ahead, rate, self.rule.smoothing_wavelength)
        )
        return replace(
            self,
            rates=(*self.rates, increment),
            depths=(*self.depths, ahead.wear_depth),
        )

    def end(self) -> Step:
        """Return the step, once the rates of all stages are known."""
        increment = _sum(self.rates, self.tableau.shares[-1] * self.length)
        worn, clipped = worn_by(self.state, increment, self.length, self.rule)
        stage_rates = tuple(rate.regime_depth.sum(axis=1) for rate in self.rates)
        return Step(worn, clipped, increment, self.rates[0], self.depths, stage_rates)


def begun(
    state: State, rate: WearRate, step_length: float, rule: StepRule, stability: float
) -> Stages:
    """First stage of a wear step of both wheels, and of a counterface that wears.

    Parameters
    ----------
    state : State
        At the beginning of the step.
    rate : WearRate
        In this state, for the acting points.
    step_length : float
        Distance to run [m].
    rule : StepRule
        Integrator, smoothing and material.
    stability : float
        Stability number of the step, which decides the number of stages [-].

    Returns
    -------
    Stages
        `with_rate` adds the rate of the same points in the state `ahead`, until none is
        `left`; then `end` returns the step.

    Raises
    ------
    NumericalError
        By `ahead` and `end`, when the step is too deep for the curvature of the
        profile.

    Notes
    -----
    Rates in other states are scaled to the stretches of the vertices at the beginning,
    so that areas add up. Stages are not clipped. Negative depths of the sum, where a
    patch has left, are set to 0 and the area is restored.
    """
    tableau = tableau_of(rule.integrator, stability)
    first = smoothed(state, rate, rule.smoothing_wavelength)
    return Stages(state, step_length, rule, tableau, (first,), (state.wear_depth,))


def worn_by(
    state: State, increment: Increment, step_length: float, rule: StepRule
) -> tuple[State, float]:
    """State after an increment over a distance [m], and its negative share [-]."""
    increment, clipped = _without_negative(state, increment)
    worn = remove(state, increment.regime_depth, step_length, rule)
    if state.counterface is not None and increment.counterface is not None:
        counterface = wear_off_counterface(state.counterface, increment.counterface)
        worn = replace(worn, counterface=counterface)
    return _with_comparison_laws(state, worn, increment, rule), clipped


def smoothed_at_end(
    before: State, after: State, rate: WearRate, wavelength: float
) -> Increment:
    """Smoothed rate in the state after a step, per interval of former vertices."""
    return _scaled(before, after, smoothed(after, rate, wavelength))


def stiffness_of(step: Step, end: Increment) -> float:
    """Fastest decay rate of a wave of the profile shown by a step [1/m].

    Parameters
    ----------
    step : Step
        With the rates of its stages.
    end : Increment
        Rates at its end, as of `smoothed_at_end`.

    Notes
    -----
    Largest ratio of the change of the rate to that of the depth from stage to stage, as
    Euclidean norms over the vertices: the differences of stages are what is left of the
    stiff waves, as in the power method.
    """
    last = end.regime_depth.sum(axis=1)
    changes = (
        np.diff([*step.depths, step.state.wear_depth], axis=0),
        np.diff([*step.rates, last], axis=0),
    )
    depth, rate = (np.sqrt((change**2).sum(axis=(1, 2))) for change in changes)
    return float((rate / (depth + _NOISE)).max())


def error_of(before: State, after: State, start: Increment, end: Increment) -> float:
    r"""Estimated error of the depth of a step, RMS over its worn band [m].

    It is that of the body with the largest error.

    Parameters
    ----------
    before, after : State
        At the beginning and the end of the step.
    start, end : Increment
        Smoothed rates in these states, per stretches of the vertices before.

    Notes
    -----
    :math:`0.8 (y_n - y_{n+1}) + 0.4 h (f_n + f_{n+1})` ([1]_ of the module). The band
    is where the depth is above 2 % of the largest one of the body.
    """
    length = after.distance - before.distance
    mean = _sum([start, end], np.array([0.5, 0.5]) * length)

    def of_body(
        body: State | CounterfaceState, worn: FloatArray, expected: FloatArray
    ) -> float:
        deepest = worn.max(axis=1, keepdims=True)
        stretch = np.where(
            (worn > _BAND * deepest) & (deepest > 0.0),
            vertex_lengths(body.y, body.z),
            0.0,
        )
        band = stretch.sum(axis=1)
        square = (stretch * (0.8 * (expected - worn)) ** 2).sum(axis=1)
        return float(np.sqrt(square / np.where(band > 0.0, band, 1.0)).max())

    largest = of_body(
        before, after.wear_depth - before.wear_depth, mean.regime_depth.sum(axis=1)
    )
    if (
        before.counterface is None
        or after.counterface is None
        or mean.counterface is None
    ):
        return largest
    worn = after.counterface.depth - before.counterface.depth
    return max(largest, of_body(before.counterface, worn, mean.counterface))


def smoothed(state: State, rate: WearRate, wavelength: float) -> Increment:
    """Wear and fatigue damage per metre run with smoothed depths."""
    counterface = None
    if rate.counterface is not None and state.counterface is not None:
        body = state.counterface
        counterface = smooth_sides(body.y, body.z, rate.counterface.depth, wavelength)
    return Increment(
        smooth_sides(state.y, state.z, rate.regime_depth, wavelength),
        tuple(
            smooth_sides(state.y, state.z, depth, wavelength)
            for depth in rate.comparison
        ),
        rate.fatigue,
        counterface,
    )


def _sum(rates: Sequence[Increment], lengths: FloatArray) -> Increment:
    """Increment over lengths [m] at rates.

    The lengths of later stages are 0.
    """

    def total(*values: FloatArray) -> FloatArray:
        result: FloatArray = lengths[0] * values[0]
        for length, value in zip(lengths[1:], values[1:], strict=False):
            result = result + length * value
        return result

    regime_depths, comparisons, fatigues, counterfaces = zip(*rates, strict=True)
    counterface = None if counterfaces[0] is None else total(*counterfaces)
    return Increment(
        total(*regime_depths),
        tuple(map(total, *comparisons)),
        tuple(map(total, *fatigues)),
        counterface,
    )


def _scaled(before: State, after: State, rate: Increment) -> Increment:
    """Rate of a later state per interval of the vertices before."""

    def stretched(
        earlier: State | CounterfaceState, later: State | CounterfaceState
    ) -> FloatArray:
        longer: FloatArray = vertex_lengths(later.y, later.z) / vertex_lengths(
            earlier.y, earlier.z
        )
        return longer

    longer, counterface = stretched(before, after), rate.counterface
    if (
        counterface is not None
        and before.counterface is not None
        and after.counterface is not None
    ):
        counterface = counterface * stretched(before.counterface, after.counterface)
    return Increment(
        rate.regime_depth * longer[:, None],
        tuple(depth * longer[:, None] for depth in rate.comparison),
        tuple(damage * longer for damage in rate.fatigue),
        counterface,
    )


def _moved(state: State, increment: Increment, length: float) -> State:
    """State of a stage: profiles, depth and distance alone."""
    total, counterface = increment.regime_depth.sum(axis=1), state.counterface
    y, z = worn_off(state.y, state.z, total, "wheel")
    if counterface is not None and increment.counterface is not None:
        counterface = moved_counterface(counterface, increment.counterface)
    return replace(
        state,
        y=y,
        z=z,
        wear_depth=state.wear_depth + total,
        counterface=counterface,
        distance=state.distance + length,
    )


def _without_negative(state: State, increment: Increment) -> tuple[Increment, float]:
    """Set negative depths to 0 and restore their areas.

    The second value is the largest share set to 0.
    """
    length = vertex_lengths(state.y, state.z)
    regime_depth, clipped = only_worn(increment.regime_depth, length)
    counterface = increment.counterface
    if counterface is not None and state.counterface is not None:
        counterface_length = vertex_lengths(state.counterface.y, state.counterface.z)
        depth, counterface_clipped = only_worn(counterface[:, None], counterface_length)
        counterface, clipped = depth[:, 0], max(clipped, counterface_clipped)
    comparison = tuple(only_worn(depth, length)[0] for depth in increment.comparison)
    return Increment(regime_depth, comparison, increment.fatigue, counterface), clipped


def remove(
    state: State, regime_depth: FloatArray, step_length: float, rule: StepRule
) -> State:
    r"""Remove a wear increment from the profiles of the wheels.

    The depth by regime (2, n_regimes, n) at the vertices, after smoothing [m], is that
    of `step_length` [m]. The area between the polygons is the sum of depth times vertex
    length.

    Notes
    -----
    The mass is that of rings of radius :math:`r(y) = r_0 + z` before the step:
    :math:`\rho \sum 2 \pi r_j d_j l_j`.
    """
    total, length = regime_depth.sum(axis=1), vertex_lengths(state.y, state.z)
    y, z = worn_off(state.y, state.z, total, "wheel")
    mass = (
        rule.density
        * 2.0
        * np.pi
        * ((rule.radius + state.z) * total * length).sum(axis=1)
    )
    return replace(
        state,
        step=state.step + 1,
        distance=state.distance + step_length,
        y=y,
        z=z,
        wear_depth=state.wear_depth + total,
        regime_depth=state.regime_depth + regime_depth,
        worn_area=state.worn_area + (total * length).sum(axis=1),
        worn_mass=state.worn_mass + mass,
    )


def _with_comparison_laws(
    before: State, worn: State, increment: Increment, rule: StepRule
) -> State:
    """Add the depths of the comparison laws and the fatigue damage left by wear."""
    length = vertex_lengths(before.y, before.z)
    pairs = zip(increment.comparison, before.comparison_depth, strict=True)
    depths = tuple(depth + by_regime.sum(axis=1) for by_regime, depth in pairs)
    areas = [
        (by_regime * length[:, None]).sum(axis=2) for by_regime in increment.comparison
    ]
    taken = worn.wear_depth - before.wear_depth
    damage = tuple(
        damage_after(old, added, taken, depth)
        for old, added, depth in zip(
            before.fatigue_damage, increment.fatigue, rule.crack_depth, strict=True
        )
    )
    area = (
        before.comparison_area + np.concatenate(areas, axis=1)
        if areas
        else before.comparison_area
    )
    return replace(
        worn, comparison_depth=depths, comparison_area=area, fatigue_damage=damage
    )
