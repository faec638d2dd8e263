"""Where the wheelset runs in a state of a campaign, and what a row says of it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wearsim.campaign.correction import moved
from wearsim.campaign.differences import refreshed
from wearsim.campaign.evaluate import Passage, Setup, forces_of, worn_bodies
from wearsim.campaign.state import PatchWear, State
from wearsim.contact.patch import FloatArray
from wearsim.errors import ContactError, NumericalError
from wearsim.operation.points import OperatingPoints, where_it_runs
from wearsim.operation.refusal import bogie_of, what_helps
from wearsim.operation.resultants import Differences
from wearsim.operation.states import Corrected, Running, StateError, settle
from wearsim.results import FILL_FLOAT

if TYPE_CHECKING:
    from wearsim.scene import CampaignSetup


_ROUNDS = 3
"""After which the reference itself finds where points run whose corrected forces do not settle."""


def settled_state(
    state: State,
    points: OperatingPoints,
    setup: Setup,
    by_reference: NDArray[np.bool_] | None = None,
    stage: NDArray[np.bool_] | None = None,
) -> State:
    """Return the state with the shifts and loads at which its profiles balance what is controlled.

    The forces are those of each point's fast model and what the correction adds to them; of the reference at
    points (n,) that are to be, and where fast models find no balance.

    Raises
    ------
    NumericalError
        If no shift or loads do.
    """
    if state.running is None or points.controlled is None:
        return state
    known, bodies, last = state.correction, worn_bodies(state, setup), len(setup.chain) - 1
    before = state.running
    count, bogies = len(points.label), points.controlled.bogies
    fast = Corrected(setup.chain, np.zeros(count, dtype=np.int64), Differences.none(count))
    if known is not None:
        fast = Corrected(setup.chain, known.model, known.forces.of(known.step >= 0))
    true = np.zeros(count, dtype=bool) if by_reference is None else by_reference.copy()
    while True:
        if bogies is not None:
            true[bogies.points] |= np.roll(true[bogies.points], bogies.leading.size)
        models = Corrected(setup.chain, np.where(true, last, fast.model), fast.differences.of(~true))
        nearby = state.nearby.copy() if state.nearby.size else None
        try:
            after = settle(
                points.conditions, points.controlled, *bodies, models, before.at(state.distance), stage=stage,
                nearby=nearby, threads=setup.threads,
            )  # fmt: skip
            break
        except StateError as error:
            text = "; ".join(f"{points.label[k]}: {text}" for k, text in error.messages.items())
            failed = np.isin(np.arange(count), list(error.messages))
            if (models.model[failed] == last).all():
                fix = "lower the force" if bogies is None else "reprofile earlier, or end there"
                error.bodies = bodies
                raise NumericalError(f"after {state.distance / 1e3:.6g} km {text}; {fix}") from error
        true |= failed
    gone, rate = state.distance - before.distance, before.rate
    if gone > 0.0:
        rate = np.where(np.isfinite(points.controlled.lateral_force), after.shift - before.shift, 0.0) / gone
    running = replace(after, rate=rate, distance=state.distance)
    return replace(state, running=running, nearby=state.nearby if nearby is None else nearby)


def with_help(error: ContactError, points: OperatingPoints, setup: Setup) -> ContactError:
    """Return the error of a campaign that ends, with what would let a bogie without balance run on."""
    lost = error.__cause__
    if not isinstance(lost, StateError) or lost.bodies is None or points.controlled is None:
        return error
    bogie = bogie_of(points.controlled, min(lost.messages))
    if bogie is None:
        return error
    helps = what_helps(points.conditions, points.controlled, bogie, lost.bodies, setup.chain[-1])
    return NumericalError(f"{error}; {helps}")


def refreshed_where_it_runs(
    state: State, points: OperatingPoints, setup: Setup, among: NDArray[np.bool_], share_short: float = 1.0
) -> State:
    """Return the state with what the reference says of some points (n,) where its forces let them run.

    Fast models whose forces are corrected find that place nearly: the reference looks there again.
    `share_short` is that of `differences.refreshed`.
    """
    for number in range(_ROUNDS + 1):
        if not among.any():
            break
        here = where_it_runs(points, state.running)
        new = refreshed(state, here, among, setup, share_short=share_short).correction
        state = replace(state, correction=new)
        if number < _ROUNDS:
            after = settled_state(state, points, setup)
            among = among & moved(after, setup)
            not_yet = among.any() and number == _ROUNDS - 1
            if not_yet and (bogies := points.controlled and points.controlled.bogies):
                among[bogies.points] |= np.roll(among[bogies.points], bogies.leading.size)  # both axles
            state = settled_state(state, points, setup, among) if not_yet else after
    return state


def new_running(setup: CampaignSetup) -> Running:
    """Return where the new wheelset runs."""
    conditions = setup.points.conditions
    given = Running(conditions.shift, conditions.loads, np.zeros(conditions.shift.size), conditions.yaw)
    return setup.running or given


def row_running(
    state: State, setup: CampaignSetup, weight: FloatArray, passage: Passage, wear: PatchWear
) -> dict[str, np.ndarray]:
    """Return the variables of one row on where the wheelset runs and on the forces that act there.

    Parameters
    ----------
    setup : CampaignSetup
        With the operating points where the wheelset runs in the state.
    weight : (n,) array
        Share of the distance each point acts for.
    passage, wear
        Contact of the state, and its wear.
    """
    points, contact = setup.points, passage.contact
    conditions = points.conditions
    forces = forces_of(passage, points, state)
    known = forces.vertical.min(axis=1) > 0.0
    known[list(passage.failed)] = False  # of two sides of a jump one alone says nothing
    count = weight.size
    stiffness = np.zeros(count) if state.running is None else state.running.stiffness
    depth = np.zeros(count) if conditions.shift_depth is None else conditions.shift_depth
    runs, of, share = points.runs
    shift, *loads = (np.bincount(of, share * value, count) for value in (runs.shift, *runs.loads.T))
    area = np.bincount(contact.point, wear.area_rate, count) * weight * points.environment
    total = area.sum()
    with np.errstate(divide="ignore", invalid="ignore"):
        quotient = forces.derailment_quotient
    return {
        "lateral_position": np.where(known | (depth == 0.0), shift + depth * np.sin(forces.roll), FILL_FLOAT),
        "wheel_loads": np.stack(loads, axis=1),
        "share_beyond_jump": 1.0 - share[:count],
        "wheelset_yaw": conditions.yaw,
        "wheelset_roll": np.where(known, forces.roll, FILL_FLOAT),
        "lateral_stiffness": stiffness,
        "lateral_force": np.where(known, -forces.force, FILL_FLOAT),
        "derailment_quotient": np.where(known[:, None], quotient, FILL_FLOAT),
        "steering_moment": np.where(known, forces.moment, FILL_FLOAT),
        "axle_wear_number": np.where(known, forces.power / conditions.speed, FILL_FLOAT),
        "wear_share": area / total if total > 0.0 else np.zeros(count),
    }
