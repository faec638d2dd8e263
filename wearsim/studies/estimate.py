"""Steps and time of a campaign before it is run, from a few of its first steps."""

from __future__ import annotations

import math
import time
from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from wearsim.campaign.control import error_limit, reached
from wearsim.campaign.evaluate import setup_of, solve_points
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.campaign.row import StepTaken
from wearsim.campaign.state import State

if TYPE_CHECKING:
    from wearsim.scene import CampaignSetup
    from wearsim.scene.campaign import ControlSettings

_SETTLED = 3
"""Steps of at least half their later length that are tried with the same points."""

_EFFORT = 5.0
"""Time for the steps that are tried [s]; each block has at least one within twice that."""


class Estimate(NamedTuple):
    """What a campaign takes, about."""

    steps: int  # over its distance
    seconds: float  # for these steps [s]
    slowest: str  # block or class of operating points that takes most of the time
    share: float  # of the time that it takes [-]
    held_by: str  # what holds most of its steps, one of `quantities.STEP_LIMITS`


class _Tried(NamedTuple):
    """Steps tried with the same points."""

    state: State  # at their end
    taken: StepTaken | None = None  # the last one
    steps: int = 0  # how many
    run: float = 0.0  # by them [m]
    length: float = math.inf  # to which the next one is held, whatever its growth [m]
    held_by: str = ""
    seconds: float = 0.0  # for one of as many stages as the last [s]
    loops: bool = False  # whether it was of whole loops of a programme


class _Leg(NamedTuple):
    """Steps of a campaign with the same points."""

    tried: _Tried
    steps: float
    shares: dict[str, float]  # of the time of a step, by block or class


def estimate(setup: CampaignSetup, start: State, threads: int = 1) -> Estimate:
    r"""Estimate steps and time of a campaign.

    Parameters
    ----------
    setup : CampaignSetup
        The campaign; contact models are not chosen again.
    start : State
        At its start, with the contact models chosen for it.
    threads : int
        Of the contact solver.

    Notes
    -----
    In each block of the first loop of a programme, then with what acts in the second loop, steps are tried
    until growth does not hold them. From there steps held by error or depth are taken to grow with the root
    of the distance, :math:`n = 2 (\sqrt{s s_0} - s_0) / \Delta s_0`, because wear slows down while patches
    widen: an empirical rule. Others keep their length, all their time. What compiles is not counted. A limit
    that ends a campaign is not looked for, nor are redressings at a depth.
    """
    evolution = WheelsetEvolution(replace(setup, tolerance=None), threads=threads)
    evolution.advance(start, evolution.evaluate(start))  # compiles
    points, total, began = setup.points, setup.control.distance, time.perf_counter()
    lengths, ends = points.block_length, np.cumsum(points.block_length)
    loop, covered, tried = float(ends[-1]), 0.0, _Tried(start)
    blocks: list[tuple[int, _Tried]] = []
    for block in np.flatnonzero((lengths > 0.0) & (ends - lengths < total)).tolist():
        now, end = time.perf_counter(), float(min(ends[block], total))
        if tried.loops or now - began > 2.0 * _EFFORT:
            break
        until = now + max(began + _EFFORT - now, 0.0) * lengths[block] / (loop - covered)
        tried = _try(evolution, tried, covered, end, until)
        blocks.append((block, tried))
        covered = end
    if loop == 0.0 or (covered == loop < total and not tried.loops):
        end = loop + float(lengths[lengths > 0.0][0]) if loop else total
        tried = _try(evolution, tried, loop, end, time.perf_counter() + _EFFORT)
    fresh = 1 + _restarts(setup)  # how often steps start small
    legs = []
    if loop == 0.0 or tried.loops:
        first = 0 if loop == 0.0 else sum(one.steps for _, one in blocks if not one.loops)
        rest = _further(tried, tried.state.distance, total / fresh)
        shares = _shares(evolution, tried.state)
        return _sum([_Leg(tried, fresh * (first + tried.steps + rest), shares)])
    for block, one in blocks:
        passes = max(total / covered, 1.0)
        whole = passes * min(float(lengths[block]), total - (float(ends[block]) - float(lengths[block])))
        rest = fresh * (one.steps + _further(one, one.run, whole / fresh))
        held_by = one.held_by if rest > passes else "block border"
        legs.append(_Leg(one._replace(held_by=held_by), max(rest, passes), {points.label[block]: 1.0}))
    return _sum(legs)


def _try(evolution: WheelsetEvolution, before: _Tried, begins: float, end: float, until: float) -> _Tried:
    """Take steps from a distance towards the end of a block, or beyond it in whole loops, until a time."""
    control = evolution.setup.control
    state, taken, settled, count, loops, pace = before.state, before.taken, 0, 0, False, math.inf
    if (jump := begins - state.distance) > 0.0:  # over the rest of a block
        rollers = state.counterface
        if rollers is not None:
            rollers = replace(rollers, redressed_at=rollers.redressed_at + jump)
        state = replace(state, distance=begins, counterface=rollers)
    while True:
        began, old = time.perf_counter(), state
        state, taken = evolution.advance(old, evolution.evaluate(old, taken))
        now = time.perf_counter()
        if state.reprofiled == state.step:
            continue
        count += 1
        pace = min(pace, (now - began) / taken.stages)
        length, held_by = _later(control, old, state, taken)
        settled += 2.0 * taken.length >= length
        loops |= state.distance > end * (1.0 + 1e-9)
        over = reached(state.distance, control.distance if loops else end)
        if over or now > until or settled == _SETTLED:
            run = state.distance - begins
            return _Tried(state, taken, count, run, length, held_by, pace * taken.stages, loops)


def _later(control: ControlSettings, old: State, new: State, taken: StepTaken) -> tuple[float, str]:
    """Length of a next step that growth, blocks and distance do not hold [m], and what holds it."""
    length = taken.length
    depth = float((new.wear_depth - old.wear_depth).max())
    limits = {
        "error": error_limit(length, taken.error or 0.0, control),
        "depth cap": control.depth_cap * length / depth if depth > 0.0 else math.inf,
        "max step": control.max_step,
        "remaining distance": control.distance,
    }
    if taken.reason == "stability":  # of models without interpenetration by another measure
        limits[taken.reason] = length
    held_by = min(limits, key=limits.__getitem__)
    return limits[held_by], held_by


def _further(tried: _Tried, run: float, whole: float) -> float:
    """Return how many steps lead from a distance run with the same points to the whole of it [m]."""
    if tried.held_by not in ("error", "depth cap") or whole <= tried.length:
        return max(whole - run, 0.0) / tried.length
    known = max(run, tried.length)
    return max(2.0 * (math.sqrt(whole * known) - known) + known - run, 0.0) / tried.length


def _restarts(setup: CampaignSetup) -> int:
    """How often rollers are redressed and wheels reprofiled at given distances."""
    total, rules = setup.control.distance, setup.control.reprofiling
    redressed = 0.0 if setup.counterface_wear is None else total / setup.counterface_wear.redress_distance
    return math.floor(redressed) + sum(place < total for place in (rules.places if rules else ()))


def _shares(evolution: WheelsetEvolution, state: State) -> dict[str, float]:
    """Share of the time of a step by block or class of the acting points."""
    points, setup = evolution.setup.points, setup_of(evolution.setup, evolution.threads)
    names, acts = np.array(points.class_name or points.label), state.active_weight > 0.0
    seconds: dict[str, float] = {}
    for name in 2 * list(dict.fromkeys(names[acts].tolist())):  # twice: the shorter time is less disturbed
        began = time.perf_counter()
        solve_points(state, points, acts & (names == name), setup)
        seconds[name] = min(time.perf_counter() - began, seconds.get(name, math.inf))
    return {name: one / sum(seconds.values()) for name, one in seconds.items()}


def _sum(legs: list[_Leg]) -> Estimate:
    seconds: Counter[str] = Counter()
    for leg in legs:
        seconds.update({name: share * leg.steps * leg.tried.seconds for name, share in leg.shares.items()})
    slowest, longest = seconds.most_common(1)[0]
    held_by = next(leg.tried.held_by for leg in legs if slowest in leg.shares)
    steps, total = sum(leg.steps for leg in legs), sum(seconds.values())
    return Estimate(math.ceil(steps), total, slowest, longest / total, held_by)
