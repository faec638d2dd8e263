"""Steps, time and end of a campaign before it is run, from its first steps."""

from __future__ import annotations

import math
import time
from collections import Counter, defaultdict
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearsim.campaign.control import error_limit, present_block, reached
from wearsim.campaign.correction import control_at
from wearsim.campaign.evaluate import Evaluation
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.campaign.row import NO_STEP
from wearsim.campaign.state import State
from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import ContactPatches
from wearsim.operation.points import OperatingPoints
from wearsim.results.limits import LIMITED, ending_limits, worst_of
from wearsim.results.schema import FILL_FLOAT
from wearsim.scene import CampaignSetup

_EFFORT = 6.0
"""Time for the steps that are tried [s]; each block has at least one within twice that."""


class Estimate(NamedTuple):
    """What a campaign takes, about."""

    steps: int  # to its end
    seconds: float  # for these steps [s]
    slowest: str  # block or class of operating points that takes most of the time
    share: float  # of the time that it takes [-]
    held_by: str  # what holds most of its steps, one of `quantities.STEP_LIMITS`
    end: float  # distance of the campaign, or where a limit ends it [m]
    limit: str | None  # measure whose limit ends it
    bytes_per_step: int  # of a row of the result file


@dataclass
class _Leg:
    """Steps with the same acting points."""

    contact: ContactPatches  # at the end of the last one
    run: float = 0.0  # by those tried [m]
    length: float = math.inf  # to which the next one is held, whatever its growth [m]
    later: str = ""  # what holds it
    seconds: list[float] = field(default_factory=list)  # of each step
    changes: list[tuple[float, FloatArray]] = field(default_factory=list)  # of the margins in lengths [m]
    reasons: Counter[str] = field(default_factory=Counter)  # what held the steps, those to come as well

    def extend(self, whole: float, lives: float, passes: float) -> None:
        """Count the steps to come over `whole` [m] in each of the lives of new profiles, and one per pass."""
        known, further = max(self.run, self.length), max(whole - self.run, 0.0) / self.length
        if self.later in ("error", "depth cap") and whole > known:
            further = max(2.0 * (math.sqrt(whole * known) - known) + known - self.run, 0.0) / self.length
        tried = self.reasons.total()
        self.reasons[self.later] += round(lives * (tried + further)) - tried
        self.reasons["block border"] += max(math.ceil(passes) - self.reasons.total(), 0)

    def slope(self) -> FloatArray:
        """Return the change of the margins per metre over the second half of the steps tried."""
        late = self.changes[len(self.changes) // 2 :]
        change: FloatArray = np.sum([each for _, each in late], axis=0) / sum(length for length, _ in late)
        return change

    def time(self) -> float:
        """Return that of all its steps [s], without the first one tried, which may have compiled."""
        rest = self.seconds[1:] or self.seconds
        return self.reasons.total() * sum(rest) / len(rest)


def estimate(setup: CampaignSetup, start: State, threads: int = 1) -> Estimate:
    r"""Estimate steps, time and end of a campaign.

    Parameters
    ----------
    setup : CampaignSetup
        The campaign.
    start : State
        At its start.
    threads : int
        Of the contact solver.

    Notes
    -----
    The campaign is run for some seconds, in the first loop of a programme for a share of them in each block,
    whose rest is skipped. If it ends within them, that is its end. Else steps held by error or depth are
    taken to grow with the root of the distance, :math:`n = 2 (\sqrt{s s_0} - s_0) / \Delta s_0`, because wear
    slows down while patches widen: an empirical rule. Others keep their length, all their time. Measures with
    a limit go on as in the last steps tried, lives of reprofiled wheels are like the first one; redressings
    at a depth are not looked for.
    """
    evolution = WheelsetEvolution(setup, threads=threads)
    lengths, total = setup.points.block_length, setup.control.distance
    loop = float(lengths.sum())
    blocks = np.count_nonzero((lengths > 0.0) & (np.cumsum(lengths) - lengths < total))
    evaluation = evolution.evaluate(start)  # compiles most
    row = evolution.row(start, evaluation, NO_STEP)
    limits, margin = _margins(setup, evaluation)
    ending = np.isin(limits, list(ending_limits(evolution.header.attributes)))
    state, legs, lathe = start, dict[bytes, _Leg](), [(0.0, margin)]
    block, until, began = -1, 0.0, time.perf_counter()
    now = began
    while not legs or not (reached(state.distance, total) or (margin[ending] <= 0.0).any()):
        here, rest = present_block(state.distance, lengths) if loop else (0, 0.0)
        entered, first = here != block, state.distance < loop * (1.0 - 1e-9)
        if entered and first:  # one share is left for whole loops
            until = now + max(began + _EFFORT - now, 0.0) / (blocks + (total > loop) - len(legs))
        elif not first:
            until = began + _EFFORT
        if now > began + 2.0 * _EFFORT or (now > until and not entered and not first):
            break
        if now > until and not entered:
            state, block = _skipped(state, min(rest, total - state.distance)), -1
            continue
        old, block = state, here
        state, taken = evolution.advance(old, evaluation)
        evaluation = evolution.evaluate(state, taken)
        before, now, earlier, margin = now, time.perf_counter(), margin, _margins(setup, evaluation)[1]
        if state.reprofiled == state.step:
            lathe.append((state.distance, margin))
            continue
        leg = legs.setdefault(state.active_weight.tobytes(), _Leg(evaluation.passage.contact))
        depth = float((state.wear_depth - old.wear_depth).max())
        settings = control_at(old, setup, setup.control, state.active_weight)
        leg.length, leg.later = min(
            (error_limit(taken.length, taken.error or 0.0, settings), "error"),
            (setup.control.depth_cap * taken.length / max(depth, 1e-30), "depth cap"),
            (setup.control.max_step, "max step"),
            # of models without interpenetration by another measure
            (taken.length if taken.reason == "stability" else math.inf, "stability"),
        )
        leg.contact, leg.run = evaluation.passage.contact, leg.run + taken.length
        leg.seconds.append(now - before)
        leg.changes.append((taken.length, margin - earlier))
        leg.reasons[taken.reason] += 1
    met = limits[ending & (margin <= 0.0)].tolist()
    end, limit = state.distance, met[0] if met else None
    if not met and not reached(sum(leg.run for leg in legs.values()), total):
        weight = {key: np.frombuffer(key) for key in legs}
        many = [key for key in legs if not loop or np.count_nonzero(weight[key]) > 1]
        parts = [(1.0 if many else float(lengths @ weight[key]) / loop, legs[key]) for key in many or legs]
        slope = sum((share * leg.slope() for share, leg in parts), np.zeros(margin.size))
        end, limit, lives = _foreseen(setup, (limits, ending, margin, slope), state.distance, lathe)
        for key, leg in legs.items():
            passes = 1.0 if many else max(end / min(state.distance, loop), 1.0)
            if len(lathe) > 1:  # whole lives were tried
                more = end / state.distance
                leg.reasons = Counter({why: round(n * more) for why, n in leg.reasons.items()})
            elif key in many:
                leg.run = state.distance
                leg.extend(end / lives, lives, lives)
            else:
                leg.extend(passes * float(lengths @ weight[key]) / (1.0 if many else lives), lives, passes)
    seconds: dict[str, float] = defaultdict(float)
    held_by = {}
    for key, leg in legs.items():
        for name, share in _shares(setup.points, leg.contact, np.frombuffer(key)).items():
            seconds[name] += share * leg.time()
            held_by[name] = leg.reasons.most_common(1)[0][0]
    slowest, whole = max(seconds, key=seconds.__getitem__), sum(seconds.values())
    steps = sum(leg.reasons.total() for leg in legs.values())
    size, share = sum(values.nbytes for values in row.values()), seconds[slowest] / whole
    return Estimate(steps, whole, slowest, share, held_by[slowest], end, limit, size)


def _margins(setup: CampaignSetup, evaluation: Evaluation) -> tuple[NDArray[np.str_], FloatArray]:
    """Measures with a limit, by wheel where they have two values, and how far they are from it [SI]."""
    laws = [law.law for law in setup.fatigue]
    pairs = [
        (name, math.nan if value == FILL_FLOAT else LIMITED[name] * (limit - value))
        for name, limit in setup.control.limits
        for value in worst_of(name, evaluation.measures[name], laws).tolist()
    ]
    names, left = [name for name, _ in pairs], [value for _, value in pairs]
    return np.array(names, dtype=np.str_), np.array(left, dtype=np.float64)


def _skipped(state: State, rest: float) -> State:
    """Return the state behind the rest of a block [m]."""
    rollers = state.counterface
    if rollers is not None:
        rollers = replace(rollers, redressed_at=rollers.redressed_at + rest)
    return replace(state, distance=state.distance + rest, counterface=rollers)


def _foreseen(
    setup: CampaignSetup,
    limits: tuple[NDArray[np.str_], NDArray[np.bool_], FloatArray, FloatArray],
    far: float,
    lathe: list[tuple[float, FloatArray]],
) -> tuple[float, str | None, float]:
    """Distance at the end [m], the limit met there, and how many lives of new profiles come before.

    Of measures with a limit: their names, whether they end the campaign, how `far` on [m] they are from it
    and the slope of that; `lathe` has where the wheels were new, and the distances from the limits then.
    """
    (name, ending, margin, slope), rules, total = limits, setup.control.reprofiling, setup.control.distance
    at = np.where(slope < 0.0, far - margin / np.where(slope < 0.0, slope, 1.0), np.inf)
    life, lives = total, len(lathe) - 1
    if rules is not None:
        by_limit = at[np.isin(name, rules.limits)].min(initial=total / (1 + len(rules.places)))
        life = lathe[-1][0] / lives if lives else float(by_limit)
        at[at > lathe[-1][0] + life] = np.inf
        for k in np.flatnonzero(name == "wheel_diameter") if life < total else ():  # falls at the lathe, too
            spare, worn = float(lathe[0][1][k]), max(-float(slope[k]) * life, 1e-9)
            loss = (spare - float(lathe[-1][1][k])) / lives if lives else 2.0 * rules.cut + worn
            before = max(math.ceil((spare - worn) / loss), 0)
            at[k] = life * (before + max(spare - before * loss, 0.0) / worn)
    first = min(np.flatnonzero(ending & (at < total)), key=at.__getitem__, default=None)
    end, limit = (total, None) if first is None else (float(at[first]), str(name[first]))
    redressed = 0.0 if setup.counterface_wear is None else end / setup.counterface_wear.redress_distance
    return end, limit, max(end / life, 1.0 + math.floor(redressed))


def _shares(points: OperatingPoints, contact: ContactPatches, weight: FloatArray) -> dict[str, float]:
    """Share of the time of a step by block or class of the acting points: of the cells of their patches."""
    names, patch = np.array(points.class_name or points.label), contact.patch
    cells = np.bincount(contact.point, patch.strips * patch.cells, names.size) * (weight > 0.0)
    return {
        str(name): float(cells[names == name].sum() / cells.sum()) for name in np.unique(names[cells > 0.0])
    }
