r"""Steps, time and end of a campaign, foreseen from one step on its new profiles.

The step is one of all operating points together, as long as its limits allow, whatever
its error: that error, and the stiffness it shows, limit the steps to come. From there
on lengths are taken to grow with the third root of the distance,

.. math:: \Delta s = \Delta s_0 (s / \Delta s_0)^{1/3}, \qquad n = 1.5 (s / \Delta s_0)^{2/3},

because wear slows down while patches widen: an empirical rule. Steps held by their
longest length do not grow. Measures with a limit go on as in the step, lives of
reprofiled wheels are like the first one; redressings at a depth are not looked for, nor
limits of measures that the step leaves as they are.
"""

from __future__ import annotations

import math
import time
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearsim.campaign import control
from wearsim.campaign.attempt import Rates
from wearsim.campaign.evaluate import Evaluation, setup_of
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.campaign.row import NO_STEP
from wearsim.campaign.state import State
from wearsim.contact.patch import FloatArray
from wearsim.results.limits import LIMITED, ending_limits, worst_of
from wearsim.results.schema import FILL_FLOAT
from wearsim.scene import CampaignSetup

_GROWTH = 3.0  # of the first steps from one to the next


class Estimate(NamedTuple):
    """Estimated steps, computing time [s] and end [m] of a campaign."""

    steps: int  # to its end
    seconds: float  # for these steps [s]
    slowest: str  # block or class of operating points that takes most of the time
    share: float  # of the time that it takes [-]
    held_by: str  # what holds most of its steps, one of `quantities.STEP_LIMITS`
    end: float  # distance of the campaign, or where a limit ends it [m]
    limit: str | None  # measure whose limit ends it
    bytes_per_step: int  # of a row of the result file


class Trial(NamedTuple):
    """Trial step of all operating points on new profiles, with its computing time."""

    state: State  # at its end
    evaluation: Evaluation  # of that state
    length: float  # [m]
    seconds: float  # that the step took [s]


class Leg(NamedTuple):
    """Steps with the same acting points."""

    weight: FloatArray  # (n,) share of each step that each point acts for
    share: float  # of the distance [-]
    pieces: int  # in each of which steps begin anew: the passes of a block
    first: float  # length of the first one on new profiles [m]
    length: float  # of the ones after the first few [m]
    reason: str  # what holds them
    alone: int = 0  # blocks that are run one by one before

    def steps(self, distance: float, lives: float) -> float:
        """Count steps to a distance [m] in a number of lives of new profiles."""
        leg_distance = self.share * distance / lives
        if leg_distance <= self.first:
            return max(lives, float(self.pieces))
        growth_steps = (
            max(math.log(self.length / self.first) / math.log(_GROWTH), 0.0)
            + self.alone
        )
        return max(
            lives * (growth_steps + count(leg_distance, self.length, self.reason)),
            float(self.pieces),
        )


def count(distance: float, length: float, reason: str) -> float:
    """Count steps over a distance [m], the first one of a length [m]."""
    ratio = distance / length
    if ratio <= 1.0:
        return 1.0
    return ratio if reason == "max step" else max(1.5 * ratio ** (2.0 / 3.0) - 0.5, 1.0)


def estimate(
    setup: CampaignSetup, start: State, evaluation: Evaluation, threads: int = 1
) -> Estimate:
    """Estimate steps, computing time [s] and end [m] of a campaign.

    Parameters
    ----------
    setup : CampaignSetup
        The campaign.
    start : State
        At its start.
    evaluation : Evaluation
        Of that state, at all points.
    threads : int
        Of the contact solver.

    Raises
    ------
    ContactError, NumericalError
        If the step that is tried fails.
    """
    evolution = WheelsetEvolution(setup, threads=threads)
    row = evolution.row(start, evaluation, NO_STEP)
    limits, new = margins(setup, evaluation)
    ending = np.isin(limits, list(ending_limits(evolution.header.attributes)))
    trial_step = trial(setup, start, evaluation, threads)
    slope = (margins(setup, trial_step.evaluation)[1] - new) / trial_step.length
    end, limit, lives = end_of(setup, (limits, ending, new, slope))
    seconds, held_by, steps = defaultdict[str, float](float), dict[str, str](), 0.0
    for leg in legs_of(setup, trial_step, end, threads):
        leg_steps = leg.steps(end, lives)
        steps += leg_steps
        for name, share in _shares(setup, evaluation, leg.weight).items():
            seconds[name] += leg_steps * share * trial_step.seconds
            held_by[name] = leg.reason
    slowest, total_seconds = (
        max(seconds, key=seconds.__getitem__),
        sum(seconds.values()),
    )
    size = (
        sum(values.nbytes for values in row.values()) + 4
    )  # and the number of the step
    share = seconds[slowest] / total_seconds
    return Estimate(
        round(steps), total_seconds, slowest, share, held_by[slowest], end, limit, size
    )


def trial(
    setup: CampaignSetup, start: State, evaluation: Evaluation, threads: int
) -> Trial:
    """Take one step of all operating points together on new profiles.

    As long as its limits allow.
    """
    points, free = setup.points, math.inf
    stationary = replace(points, block_length=np.zeros_like(points.block_length))
    settings = replace(
        setup.control,
        first_depth=free,
        error_tolerance=free,
        reprofiling=None,
        limits=(),
    )
    evolution = WheelsetEvolution(
        replace(setup, points=stationary, control=settings), threads=threads
    )
    began = time.perf_counter()
    state, taken = evolution.advance(start, evaluation)
    seconds = time.perf_counter() - began
    return Trial(state, evolution.evaluate(state, taken), taken.length, seconds)


def legs_of(
    setup: CampaignSetup, trial_step: Trial, end: float, threads: int
) -> Iterator[Leg]:
    """Give the steps of a campaign up to its end [m].

    Of all points together, or of each block.
    """
    lengths = setup.points.block_length
    passage_setup = setup_of(setup, threads)
    rates = Rates(trial_step.state, setup.points, passage_setup, trial_step.evaluation)
    choose = partial(
        control.choose,
        points=setup.points,
        rate_for_weights=rates.of,
        settings=replace(setup.control, distance=end),
    )
    loop = float(lengths.sum())
    places = np.cumsum(lengths) - lengths if loop else np.zeros(1)
    for k in np.flatnonzero(lengths) if loop else [0]:
        if places[k] >= end and k:
            return
        weight, limit = choose(replace(trial_step.state, distance=float(places[k])))
        depth = float(rates.of(weight).depth.max())
        first = min(setup.control.first_depth / max(depth, 1e-30), limit.step_length)
        joint = np.count_nonzero(weight) > 1 or not loop
        share = 1.0 if joint else float(lengths[k]) / loop
        pieces = 1 if joint else math.ceil(end / loop)
        # the first loop is run block by block where its first step is shorter
        alone = (
            int(np.count_nonzero(lengths[places < end]))
            if joint and first < loop
            else 0
        )
        yield Leg(weight, share, pieces, first, limit.step_length, limit.reason, alone)
        if joint:
            return


def margins(
    setup: CampaignSetup, evaluation: Evaluation
) -> tuple[NDArray[np.str_], FloatArray]:
    """Measures with a limit, by wheel or of the wheelset, and their margins [SI]."""
    laws = [law.law for law in setup.fatigue]
    pairs = [
        (name, math.nan if value == FILL_FLOAT else LIMITED[name] * (limit - value))
        for name, limit in setup.control.limits
        for value in worst_of(name, evaluation.measures[name], laws).tolist()
    ]
    names, left = [name for name, _ in pairs], [value for _, value in pairs]
    return np.array(names, dtype=np.str_), np.array(left, dtype=np.float64)


def end_of(
    setup: CampaignSetup,
    limits: tuple[NDArray[np.str_], NDArray[np.bool_], FloatArray, FloatArray],
) -> tuple[float, str | None, float]:
    """Distance at the end [m], the limit met there.

    And how many lives of new profiles come before.

    Of measures with a limit: their names, whether they end the campaign, how far new
    wheels are from it, and the slope of that.
    """
    (name, ending, margin, slope), rules, total = (
        limits,
        setup.control.reprofiling,
        setup.control.distance,
    )
    at = np.where(slope < 0.0, -margin / np.where(slope < 0.0, slope, 1.0), np.inf)
    life = total
    if rules is not None:
        life = float(
            at[np.isin(name, rules.limits)].min(initial=total / (1 + len(rules.places)))
        )
        at[at > life] = np.inf
        for k in (
            np.flatnonzero(name == "wheel_diameter") if life < total else ()
        ):  # falls at the lathe, too
            spare, worn = float(margin[k]), max(-float(slope[k]) * life, 1e-9)
            loss = 2.0 * rules.cut + worn
            before = max(math.ceil((spare - worn) / loss), 0)
            at[k] = life * (before + max(spare - before * loss, 0.0) / worn)
    first = min(np.flatnonzero(ending & (at < total)), key=at.__getitem__, default=None)
    end, limit = (
        (total, None) if first is None else (float(at[first]), str(name[first]))
    )
    redressed = (
        0.0
        if setup.counterface_wear is None
        else end / setup.counterface_wear.redress_distance
    )
    return end, limit, max(end / life, 1.0 + math.floor(redressed))


def _shares(
    setup: CampaignSetup, evaluation: Evaluation, weight: FloatArray
) -> dict[str, float]:
    """Share of the time of a step of all points by block or class of those that act.

    That of their cells.
    """
    points, contact = setup.points, evaluation.passage.contact
    names, patch = np.array(points.classes), contact.patch
    cells = np.bincount(contact.point, patch.strips * patch.cells, names.size)
    acting, total_cells = (
        cells * (weight > 0.0),
        float(cells[points.weight > 0.0].sum()),
    )
    return {
        str(name): float(acting[names == name].sum()) / total_cells
        for name in np.unique(names[acting > 0.0])
    }
