"""What the reference last said of operating points: their differences from fast models, see `correction`."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearsim.campaign.counterface import per_passage
from wearsim.campaign.evaluate import Passage, Setup, carried, forces_of, solve_passage
from wearsim.campaign.left_out import new_history
from wearsim.campaign.neighbours import between
from wearsim.campaign.state import Correction, CounterfaceState, State
from wearsim.campaign.vertices import spline_sides
from wearsim.contact.patch import FloatArray, IntArray

if TYPE_CHECKING:
    from wearsim.operation.points import OperatingPoints
    from wearsim.operation.states import Running

LONG = 5e-3
"""Wavelength of which half is added for the time of waiting [m]."""

_REMEMBERED = 0.5
"""Share of the drift of a point that stays known."""

_SHARES = 0.02
"""Change of the share past a jump of the lateral force, beyond which it is solved again, too."""


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
    as_before = ~shared_otherwise(old, points)
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
    ours, theirs = (rates_of(one, solved, state, setup) for one in (passage, by_reference))
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
    more = forces_of(by_reference, points).columns - forces_of(passage, points).columns
    more[index] = interpolated(more[solved])
    place = np.stack([points.conditions.shift, points.conditions.yaw], axis=1)
    same = (old.step == state.step) & (old.run == 0.0) & ~other & as_before
    earlier = old.forces.of(~other)
    forces = earlier.renewed(renewed, earlier.seen(more, place, same))
    step = np.where(among, state.step, np.where(rest & ~followed, -1, old.step))
    run, drift = old.run.copy(), old.drift.copy()
    extent = extent_of(change["wheel"][:, :, :regimes])
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


def rates_of(passage: Passage, index: IntArray, state: State, setup: Setup) -> dict[str, FloatArray]:
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


def _shares(place: OperatingPoints | Running, count: int) -> FloatArray:
    """Share (n,) of the distance that each point runs past a jump of the lateral force."""
    share = np.zeros(count)
    if place.beyond is not None:
        share[place.beyond.point] = place.beyond.share
    return share


def shared_otherwise(known: Correction, place: OperatingPoints | Running) -> NDArray[np.bool_]:
    """Points (n,) that run in other shares at both sides of a jump than where the reference solved them."""
    other: NDArray[np.bool_] = np.abs(_shares(place, known.step.size) - known.beyond) > _SHARES
    return other


def extent_of(change: FloatArray) -> FloatArray:
    """Largest change (k,) of the depth of each point, of its changes (k, 2, r, n) by regime."""
    extent: FloatArray = np.abs(change.sum(axis=2)).max(axis=(1, 2))
    return extent


def _short_waves_less(body: State | CounterfaceState, change: FloatArray, share: float) -> FloatArray:
    """Change (k, 2, r, n) of depths along the profiles of a body, with a share of its short waves."""
    return share * change + (1.0 - share) * spline_sides(body.y, body.z, change, LONG)
