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
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearsim.campaign.control import StepChoice
from wearsim.campaign.counterface import per_passage
from wearsim.campaign.evaluate import Passage, Setup, carried, forces_of, mismatched, solve_passage
from wearsim.campaign.left_out import new_history
from wearsim.campaign.neighbours import between
from wearsim.campaign.state import Correction, CounterfaceState, Increment, State
from wearsim.campaign.step import INTEGRATORS, Step, StepRule, worn_by
from wearsim.campaign.vertices import lengths_of_sides, spline_sides
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.operation.resultants import Differences

if TYPE_CHECKING:
    from wearsim.operation.points import OperatingPoints
    from wearsim.operation.states import Running
    from wearsim.scene import CampaignSetup
    from wearsim.scene.campaign import ControlSettings

LONG = 5e-3
"""Wavelength of which half is added for the time of waiting [m]."""

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

_REMEMBERED = 0.5
"""Share of the drift of a point that stays known."""

_BALANCED = 1e-3
"""Change of the lateral force, over the axle load, from where the reference solved a point to where it runs,
beyond which it is solved there again."""

_SHARES = 0.02
"""Change of the share past a jump of the lateral force, beyond which it is solved again, too."""

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
    far = (change > _BALANCED * running.load.sum(axis=1)) | _shared_otherwise(known, running)
    asked = (known.step == state.step) & (known.model < len(setup.fallbacks)) & ~known.unsolved
    return np.asarray(asked & far)


def _shares(place: OperatingPoints | Running, count: int) -> FloatArray:
    """Share (n,) of the distance that each point runs past a jump of the lateral force."""
    share = np.zeros(count)
    if place.beyond is not None:
        share[place.beyond.point] = place.beyond.share
    return share


def _shared_otherwise(known: Correction, place: OperatingPoints | Running) -> NDArray[np.bool_]:
    """Points (n,) that run in other shares at both sides of a jump than where the reference solved them."""
    other: NDArray[np.bool_] = np.abs(_shares(place, known.step.size) - known.beyond) > _SHARES
    return other


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

    Steps in which the reference solves all acting points are as with it alone.
    """
    known = state.correction
    if known is None or setup.tolerance is None or (known.until[weight > 0.0] > 0.0).all():
        return settings
    depth = max(float(state.wear_depth.max()), _AT_LEAST)
    error = min(settings.error_tolerance, _OF_STEP * setup.tolerance * depth)
    return replace(settings, error_tolerance=error)


class Refreshed(NamedTuple):
    """Points whose differences are new."""

    correction: Correction
    solved: IntArray  # (k,) numbers of the points and of those between them
    change: FloatArray  # (k, 2, q, n) of their differences, 0 where one of another model or none was known


def refreshed(
    state: State,
    points: OperatingPoints,
    among: NDArray[np.bool_],
    setup: Setup,
    passage: Passage | None = None,
    share_short: float = 1.0,
) -> Refreshed:
    """Solve some points with the reference and remember how the fast models differ from it.

    Points that the reference itself solved in the passage have no difference, and are not solved again. Those
    between alike ones take on the change of their differences.

    Parameters
    ----------
    state : State
        Profiles and correction.
    points : OperatingPoints
        All `n`.
    among : (n,) bool array
        Those to solve.
    setup : Setup
        With a reference.
    passage : Passage, optional
        Of the fast models in this state; solved if not given.
    share_short : float
        Share of the change of short waves that known differences of depth take on [-].
    """
    old = state.correction
    assert old is not None
    assert setup.reference is not None
    passage = solve_passage(state, points, setup, among) if passage is None else passage
    as_before = ~_shared_otherwise(old, points)
    old = replace(old, beyond=np.where(among, _shares(points, among.size), old.beyond))
    own = among & solved_by_reference(passage, setup, among.size)
    if own.any():
        old = _taken_over(old, own, passage, state.step)
    among = among & ~own
    if not among.any():
        return Refreshed(old, np.zeros(0, dtype=np.int64), np.zeros((0, *old.wheel.shape[1:])))
    model = old.model.copy()
    model[passage.contact.point] = passage.model
    other = model != old.model  # differences from models that no longer solve the point
    followed = (old.step >= 0) & ~other
    ends, share = between(passage, points, among, followed, old.turn)
    chosen = np.isin(np.arange(among.size), ends[among])
    true = replace(setup, models=setup.reference, fallbacks=())
    alone = replace(state, correction=None, points=state.points or new_history(points))
    by_reference = solve_passage(alone, points, true, chosen)
    solved = np.setdiff1d(by_reference.contact.point, [*by_reference.failed, *passage.failed])
    solved = solved[np.isin(solved, passage.contact.point)]
    renewed = among & np.isin(ends, solved).all(axis=1)
    index, rest = np.flatnonzero(renewed), among & ~chosen & ~renewed  # between points without a solution
    among = among & ~rest
    known, inner = followed[index], np.flatnonzero(share[index] > 0.0)
    low, high = np.searchsorted(solved, ends[index]).T

    def interpolated(values: FloatArray) -> FloatArray:
        """Of points `index`, from values of those solved."""
        part = share[index[inner]].reshape(-1, *[1] * (values.ndim - 1))
        result: FloatArray = values[low]
        result[inner] += part * (values[high[inner]] - result[inner])
        return result

    regimes, change = state.regime_depth.shape[1], {}
    difference: dict[str, Any] = {}
    lost, new_difference = other & ~renewed, (renewed & ~followed)[:, None, None, None]
    ours, theirs = (_of_points(one, solved, state, setup) for one in (passage, by_reference))
    for name, body, depths in (("wheel", state, regimes), ("below", state.counterface, 1)):
        before = np.where(new_difference, 0.0, getattr(old, name))
        seen = theirs[name] - ours[name] - before[solved]
        change[name] = interpolated(seen)
        if share_short < 1.0 and known.any() and body is not None:
            again = followed[solved]
            seen[again, :, :depths] = _short_waves_less(body, seen[again, :, :depths], share_short)
        difference[name] = before.copy()
        difference[name][lost] = 0.0
        difference[name][index] += interpolated(seen)
    more = forces_of(by_reference, points, setup).columns - forces_of(passage, points, setup).columns
    more[index] = interpolated(more[solved])
    place = np.stack([points.conditions.shift, points.conditions.yaw], axis=1)
    same = (old.step == state.step) & (old.run == 0.0) & ~other & as_before
    earlier = old.forces.of(~other)
    forces = earlier.renewed(renewed, earlier.seen(more, place, same))
    step = np.where(among, state.step, np.where(rest & ~followed, -1, old.step))
    run, drift = old.run.copy(), old.drift.copy()
    extent = _extent(change["wheel"][:, :, :regimes])
    moved = known & (run[index] > 0.0)
    drift[index[np.isinf(drift[index]) & moved]] = 0.0
    drift[index[moved]] = np.maximum(extent[moved] / run[index[moved]], _REMEMBERED * drift[index[moved]])
    run[renewed] = 0.0
    unsolved = (old.unsolved | (chosen & ~followed)) & ~renewed
    change["wheel"][~known] = 0.0
    new = replace(
        old, **difference, forces=forces, step=step, model=model, run=run, drift=drift,
        solved=old.solved + int(chosen.sum()), turn=old.turn + among, unsolved=unsolved,
    )  # fmt: skip
    new = _seen(new, among, by_reference)
    for name in ("power", "max_pressure"):
        getattr(new, name)[index] = interpolated(getattr(new, name)[solved])
    if not rest.any():
        return Refreshed(new, index, change["wheel"])
    here = replace(state, correction=new)
    new, further, changed = refreshed(here, points, rest, setup, passage, share_short)
    return Refreshed(new, np.append(index, further), np.concatenate([change["wheel"], changed]))


def solved_by_reference(passage: Passage, setup: Setup, count: int) -> NDArray[np.bool_]:
    """Points (n,) of a passage that the reference itself solved, the last model of the chain."""
    own = np.zeros(count, dtype=bool)
    own[passage.contact.point[passage.model == len(setup.fallbacks)]] = True
    return own


def _taken_over(old: Correction, own: NDArray[np.bool_], passage: Passage, step: int) -> Correction:
    """Correction without differences of points (n,) that the reference solves in all stages."""

    def cleared(values: FloatArray) -> FloatArray:
        return np.where(own.reshape(-1, *[1] * (values.ndim - 1)), 0.0, values)

    at = own[passage.contact.point]
    model = old.model.copy()
    model[passage.contact.point[at]] = passage.model[at]
    kept: dict[str, Any] = {name: cleared(getattr(old, name)) for name in ("wheel", "below", "run")}
    kept["forces"] = old.forces.of(~own)
    drift = np.where(own, math.inf, old.drift)  # unknown for the fast model that comes after it
    asked: dict[str, Any] = {"step": np.where(own, step, old.step), "unsolved": old.unsolved & ~own}
    new = replace(old, **kept, **asked, drift=drift, model=model)
    return _seen(new, own, passage)


def _seen(correction: Correction, points: NDArray[np.bool_], by_reference: Passage) -> Correction:
    """Correction with power and pressure of points (n,) by the reference; 0 without a solution."""
    contact = by_reference.contact
    at = points[contact.point]
    place = contact.point[at], contact.side[at]
    power, pressure = (
        np.where(points[:, None], 0.0, one) for one in (correction.power, correction.max_pressure)
    )
    np.add.at(power, place, contact.power[at])
    np.maximum.at(pressure, place, contact.max_pressure[at])
    return replace(correction, power=power, max_pressure=pressure)


def _of_points(passage: Passage, index: IntArray, state: State, setup: Setup) -> dict[str, FloatArray]:
    """Rates of points `index` (k, 2, q, n), each alone, and depths `below` (k, 2, 1, vertices)."""
    contact, count = passage.contact, index.size
    place = np.searchsorted(index, contact.point)
    there = index[np.minimum(place, count - 1)] == contact.point if count else np.zeros(place.size, bool)
    scale, group = np.where(there, 1.0, 0.0), np.where(there, place, 0)
    below = np.zeros((count, 2, 0))
    if state.counterface is not None:
        law = scale[:, None] * np.sum(passage.depth, axis=0)
        below = per_passage(contact, law, group, count, state.counterface)
    wheel = carried(passage, np.stack([scale, scale]), group, count, state, setup)
    return {"wheel": wheel, "below": below[:, :, None]}


def _extent(change: FloatArray) -> FloatArray:
    """Largest change (k,) of the depth of each point, of its changes (k, 2, r, n) by regime."""
    extent: FloatArray = np.abs(change.sum(axis=2)).max(axis=(1, 2))
    return extent


def _short_waves_less(body: State | CounterfaceState, change: FloatArray, share: float) -> FloatArray:
    """Change (k, 2, r, n) of depths along the profiles of a body, with a share of its short waves."""
    return share * change + (1.0 - share) * spline_sides(body.y, body.z, change, LONG)


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
    other = mismatched(passage, old) | _shared_otherwise(old, points)
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
    stretched = lengths_of_sides(after.y, after.z) / lengths_of_sides(before.y, before.z)
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
    single = waited * points.environment[index] * _extent(change[:, :, :regimes])
    overlap = largest / float(single.sum()) if single.any() else 1.0
    left = old.left + whole - added
    more = float(np.abs(left).max() - np.abs(old.left).max()) + _SECOND * float(np.abs(added).max())
    excess = max(more, 0.0) / allowed if allowed > 0.0 else 0.0
    every = bool((due | own)[acts].all())
    alone = np.flatnonzero(old.unsolved & acts)
    by_fast = _of_points(passage, alone, after, setup)["wheel"][:, :, :regimes].sum(axis=2)
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
