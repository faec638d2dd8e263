r"""A fast contact model at every point, corrected by what the half-space last said of each.

The fast model is solved in all stages of a wear step, the reference at some points after each step. Each
point keeps the difference :math:`D` of both wear rates along the profile, as if the wheelset ran in it all
the time, and adds it to what the fast model says: with weights :math:`w_j` the rate is
:math:`\sum_j w_j (f_j(z) + D_j)`.

When a point is solved again after the distance :math:`L` that it acted for, waiting has left
:math:`\tfrac12 L\,\Delta D` out: the trapezoidal rule for :math:`D`. What of it is longer than `LONG` is
added to the step. Shorter waves would grow: a half-space answers to a wave of the profile in proportion to
its wave number, a model with virtual penetration to all waves alike, so that a wave that decays with
:math:`a` in the fast model and with :math:`b` in the half-space is multiplied by
:math:`1 - (b/a)(1 - e^{-S})` from one refreshment to the next. Of the change of short waves a point therefore
takes on the share `_SHORT` :math:`/ (1 - e^{-S})`, stable up to :math:`b/a` of 10.

Of points that differ by little but their lateral shift only some are solved: `neighbours`.

By the change of its difference over the distance each point foretells what it would leave out by waiting for
another step: those are solved again which together would leave out more than a step may add to the error. A
step that adds more than that is followed by shorter ones, and repeated if it is much more. Where steps become
so short that the half-space at every stage of its own steps is cheaper, it takes the acting points over until
the wear is some times as deep: `handover`.

An analysis of stability proposed six rules. Kept are (c), differences belong to operating point and wheel
and include the resultants of forces, so that a wheelset runs where the half-space lets it, but they stay
where they were seen, as patches move little between two refreshments; (d), they are frozen within a step,
in all stages and in its error; (e), the sum is not negative and keeps its area. Replaced are (a), strips as
the base: it is the cheapest model, strips where that fails, because the bound on the stability number
between refreshments is one of short waves, whose change is taken on in part; (b), refreshment at that bound
and where patches appear or move: the drift, in which these show, decides, and a change of models makes it
unknown. (f), to add nothing for waiting, as that destabilizes, holds for short waves alone, which count as
error; long ones are added.

The differences are part of the state: a campaign that is resumed has the same bits.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wearsim.campaign.control import StepChoice
from wearsim.campaign.differences import (
    LONG,
    extent_of,
    rates_of,
    refreshed,
    shared_otherwise,
    solved_by_reference,
)
from wearsim.campaign.evaluate import Passage, Setup, mismatched
from wearsim.campaign.state import Correction, Increment, State
from wearsim.campaign.step import INTEGRATORS, Step, StepRule, worn_by
from wearsim.campaign.vertices import spline_sides
from wearsim.contact.patch import FloatArray
from wearsim.operation.resultants import Differences
from wearsim.profile.shape import vertex_lengths

if TYPE_CHECKING:
    from wearsim.operation.points import OperatingPoints
    from wearsim.scene import CampaignSetup
    from wearsim.scene.campaign import ControlSettings

_SHORT = 0.2
"""Largest share of the change of short waves that a point takes on, over that of a wave that decays."""

_OF_STEP = 1.0 / 6.0
"""What one step may add to the estimated error, and points may leave out by waiting for another one, over the
depth so far, in tolerances; also what the rule of integration may err in it."""

_AT_LEAST = 10e-6
"""Depth so far as which less counts for the error of the rule [m]: campaigns end deeper."""

_MUCH = 2.0
"""Excess of that from which a step is too long even if not all points were solved after it."""

MUCH_SHORTER = 0.7
"""Least factor on the length of a step for the next one; a step that asks for less is repeated."""

_SECOND = 0.15
"""Error of what is added for waiting, over it."""

_BALANCED = 1e-3
"""Change of the lateral force, over the axle load, from where the reference solved a point to where it runs,
beyond which it is solved there again."""

_STIFF = 3e6
"""Least stiffness of that [N/m], and that of axles of a vehicle."""

_STRICTEST = 1.0 / 16.0
"""Smallest factor on it after steps that left out more."""


def new_correction(state: State, points: OperatingPoints) -> Correction:
    """Return the correction of points that were never solved with the reference."""
    count, n = len(points.label), state.y.shape[1]
    rows = state.regime_depth.shape[1] + state.comparison_area.shape[1] + 1 + len(state.fatigue_damage)
    below = 0 if state.counterface is None else state.counterface.y.shape[1]
    nothing, never = np.zeros((count, 2)), np.full(count, -1, dtype=np.int64)
    return Correction(
        np.zeros((count, 2, rows, n)), np.zeros((count, 2, 1, below)), Differences.none(count), never,
        np.zeros(count, dtype=np.int64), np.zeros(count), np.full(count, math.inf),
        np.full(count, math.inf), nothing, nothing,
        until=np.zeros(count), beyond=np.zeros(count), turn=np.zeros(count, np.int64),
        unsolved=np.zeros(count, dtype=bool), left=np.zeros_like(state.y),
    )  # fmt: skip


def forgotten(state: State, *, wheels: bool = False) -> State:
    """State whose points were not solved with the reference on its profiles; of reprofiled `wheels`."""
    correction = state.correction
    if correction is None:
        return state
    unknown: dict[str, Any] = {
        "step": np.full_like(correction.step, -1), "run": np.zeros_like(correction.run),
        "forces": Differences.none(correction.step.size),
    }  # fmt: skip
    if wheels:  # depths count from here, and so does their error
        none = {name: np.zeros_like(getattr(correction, name)) for name in ("model", "until", "left")}
        drift = np.full_like(correction.drift, math.inf)
        unknown |= {**none, "drift": drift, "added": 0.0, "unsolved_depth": 0.0}
        unknown |= {"strictness": 1.0, "overlap": 1.0}
    return replace(state, correction=replace(correction, **unknown))


def moved(state: State, setup: Setup) -> NDArray[np.bool_]:
    """Points (n,) that run so far from where the reference corrected them that their forces differ."""
    known, running = state.correction, state.running
    assert known is not None
    assert running is not None
    away = np.abs(np.stack([running.shift, running.yaw], axis=1) - known.forces.place).max(axis=1)
    change = away * np.maximum(running.stiffness, _STIFF)
    far = (change > _BALANCED * running.load.sum(axis=1)) | shared_otherwise(known, running)
    asked = (known.step == state.step) & (known.model < len(setup.fallbacks)) & ~known.unsolved
    return np.asarray(asked & far)


def stale(state: State, weight: FloatArray) -> NDArray[np.bool_]:
    """Acting points (n,) that have to be solved with the reference before a step: they did not act before."""
    correction = state.correction
    if correction is None:
        return np.zeros(weight.size, dtype=bool)
    followed = (correction.step == state.step) | ((state.active_weight > 0.0) & (correction.step >= 0))
    followed |= correction.until > 0.0  # solved by the reference anyway
    result: NDArray[np.bool_] = (weight > 0.0) & ~followed
    return result


def control_at(
    state: State, setup: CampaignSetup, settings: ControlSettings, weight: FloatArray
) -> ControlSettings:
    """Return the settings of a step, whose rule may err by a share of the tolerance of the correction.

    Steps in which the reference solves all acting points are as with it alone, but not deeper than those of
    first order: short campaigns with a tolerance have few of them.
    """
    known = state.correction
    if known is None or setup.tolerance is None:
        return settings
    settings = replace(settings, half_space_depths=1.0)
    if (known.until[weight > 0.0] > 0.0).all():
        return settings
    depth = max(float(state.wear_depth.max()), _AT_LEAST)
    error = min(settings.error_tolerance, _OF_STEP * setup.tolerance * depth)
    return replace(settings, error_tolerance=error)


def _due(
    old: Correction,
    run: FloatArray,
    ahead: FloatArray,
    environment: FloatArray,
    unknown: NDArray[np.bool_],
    allowed: float,
) -> NDArray[np.bool_]:
    """Points (n,) that together would leave out more than is allowed [m] if they waited for another step.

    They have run a distance (n,) since they were solved, and would run as far `ahead` [m]; those whose drift
    is unknown do not wait, those that do not act are not due.
    """
    waiting = 0.5 * environment * np.where(unknown, 0.0, old.drift) * (run + ahead) ** 2
    waiting = np.where(ahead > 0.0, np.where(unknown, math.inf, waiting), 0.0)
    order = np.argsort(-waiting, kind="stable")
    rest = np.cumsum(waiting[order][::-1])[::-1]  # of each in this order and those behind it
    beyond = order[old.overlap * rest > old.strictness * allowed]
    least = waiting[beyond].min(initial=math.inf)  # with those that are alike but for rounding: mirrored ones
    due: NDArray[np.bool_] = (ahead > 0.0) & (waiting >= least * (1.0 - 1e-9))
    return due


def corrected_step(
    before: State,
    tried: Step,
    choice: StepChoice,
    points: OperatingPoints,
    setup: Setup,
    passage: Passage,
    rule: StepRule,
    tolerance: float,
) -> tuple[State, float, bool]:
    """Solve some points with the reference after a step, and add what waiting for it has left out.

    Parameters
    ----------
    before : State
        At the beginning of the step.
    tried : Step
        The step with the differences known then.
    choice : StepChoice
        Shares with which the points acted, and length of the step.
    points, setup, rule
        As those of the step.
    passage : Passage
        Of the fast models at its end.
    tolerance : float
        Error of the depth over the largest one that is allowed [-].

    Returns
    -------
    State
        At the end of the step.
    float
        Factor on the length of the step with which it would have left out what the tolerance allows [-];
        infinite where it may be longer, or more points need to be solved instead.
    bool
        Whether the drift of all points was known that were solved with the reference.
    """
    weight, length = choice.weight, choice.limit.step_length
    after, old = tried.state, before.correction
    assert old is not None
    run, acts = old.run + weight * length, weight > 0.0
    allowed = _OF_STEP * tolerance * float(after.wear_depth.max())
    own = solved_by_reference(passage, setup, acts.size)
    other = mismatched(passage, old) | shared_otherwise(old, points)
    unknown = (np.isinf(old.drift) | other | (old.step < 0)) & ~own
    due = ~own & _due(old, run, weight * length, points.environment, unknown, allowed)
    first_order = INTEGRATORS[rule.integrator][0].order == 1
    stability = max(choice.limit.stiffness * length, 1e-9)
    short = 1.0 if first_order else min(1.0, _SHORT / -math.expm1(-stability))
    here = replace(after, correction=replace(old, run=run))
    new, index, change = refreshed(here, points, due | own & acts, setup, passage, short)

    regimes = before.regime_depth.shape[1]
    of_laws = regimes + before.comparison_area.shape[1]
    waited = 0.5 * run[index]
    factor = np.where(
        np.arange(change.shape[2])[:, None] < of_laws, waited * points.environment[index], waited
    )
    stretched = vertex_lengths(after.y, after.z) / vertex_lengths(before.y, before.z)
    missing = np.einsum("qj,jwqn->wqn", factor, change) * stretched[:, None]
    summed = missing[:, :regimes].sum(axis=1, keepdims=True)
    whole = spline_sides(before.y, before.z, summed, rule.smoothing_wavelength)[:, 0]
    if first_order:  # Euler's rule takes the rates at the beginning
        missing[:] = 0.0
    depth = spline_sides(before.y, before.z, missing[:, :regimes], LONG)
    sizes = [one.shape[1] for one in tried.increment.comparison]
    further = np.split(missing[:, regimes:of_laws], np.cumsum(sizes)[:-1], axis=1) if sizes else []
    damage = np.moveaxis(missing[:, of_laws + 1 :], 1, 0)
    increment = Increment(
        tried.increment.regime_depth + depth,
        tuple(one + more for one, more in zip(tried.increment.comparison, further, strict=True)),
        tuple(np.maximum(one + more, 0.0) for one, more in zip(tried.increment.fatigue, damage, strict=True)),
        tried.increment.counterface,
    )
    state, _ = worn_by(before, increment, length, rule)

    added = depth.sum(axis=1)
    largest = float(np.abs(whole).max())
    single = waited * points.environment[index] * extent_of(change[:, :, :regimes])
    overlap = largest / float(single.sum()) if single.any() else 1.0
    left = old.left + whole - added
    more = float(np.abs(left).max() - np.abs(old.left).max()) + _SECOND * float(np.abs(added).max())
    excess = max(more, 0.0) / allowed if allowed > 0.0 else 0.0
    every = bool((due | own)[acts].all())
    alone = np.flatnonzero(old.unsolved & acts)
    by_fast = rates_of(passage, alone, after, setup)["wheel"][:, :, :regimes].sum(axis=2)
    worn_alone = np.tensordot((weight * points.environment)[alone], by_fast, 1) * length
    strictness = old.strictness / (1.0 if every else min(2.0, max(0.7, excess)))
    longer = 1.0 / math.sqrt(excess) if excess > (0.0 if every else _MUCH) else math.inf
    lengths, ours = old.length.copy(), acts & ~own
    lengths[ours] = weight[ours] * length * max(longer, MUCH_SHORTER)
    lengths[acts & own & (old.until <= 0.0)] = math.inf  # where fast models had no solution
    new = replace(
        new, length=lengths, strictness=min(1.0, max(_STRICTEST, strictness)), left=left,
        overlap=max(overlap, 0.5 * old.overlap), added=old.added + float(np.abs(added).max()),
        solved=new.solved + tried.stages * int((own & acts).sum()),
        unsolved_depth=old.unsolved_depth + float(worn_alone.max()),
    )  # fmt: skip
    return (
        replace(state, points=after.points, running=after.running, correction=new),
        longer,
        not unknown[index].any(),
    )


def unchanged(before: State, tried: State, worn: State) -> bool:
    """Whether a step was not corrected nor followed by other differences: rates at its end hold."""
    old, new = before.correction, worn.correction
    assert old is not None
    assert new is not None
    same = [np.array_equal(getattr(old, name), getattr(new, name)) for name in ("wheel", "below", "model")]
    same += [np.array_equal(one, vars(new.forces)[name]) for name, one in vars(old.forces).items()]
    return all(same) and np.array_equal(tried.z, worn.z) and np.array_equal(tried.y, worn.y)


def estimated_error(state: State) -> float:
    """Estimated error of the depth so far over its largest value [-].

    All that fast models wear at points without a solution by the reference counts as error.
    """
    correction, deepest = state.correction, float(state.wear_depth.max())
    if correction is None or deepest <= 0.0:
        return 0.0
    waiting = float(np.abs(correction.left).max()) + _SECOND * correction.added
    return (waiting + correction.unsolved_depth) / deepest


def static_correction(setup: CampaignSetup) -> dict[str, Any]:
    """Return the static variables of a result file with correction."""
    if setup.tolerance is None:
        return {}
    chain = (setup.models, *setup.fallbacks)
    return {"contact_model_name": tuple(f"{one.normal} + {one.tangential}" for one in chain)}


def row_correction(state: State) -> dict[str, np.ndarray]:
    """Return the variables of one row on the correction."""
    correction = state.correction
    if correction is None:
        return {}
    return {
        "contact_model": correction.model.astype(np.int32),
        "reference_step": np.where(correction.unsolved, -1, correction.step).astype(np.int32),
        "reference_power": correction.power,
        "reference_max_pressure": correction.max_pressure,
        "reference_solved": np.asarray(correction.solved, dtype=np.int32),
        "correction_error": np.asarray(estimated_error(state)),
    }
