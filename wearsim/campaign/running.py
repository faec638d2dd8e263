"""Where the wheelset runs in a state of a campaign, and what a row says of it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wearsim.campaign.evaluate import Passage, Setup, worn_bodies
from wearsim.campaign.state import PatchWear, State
from wearsim.contact.patch import FloatArray
from wearsim.errors import NumericalError
from wearsim.operation.points import OperatingPoints
from wearsim.operation.resultants import resultants
from wearsim.operation.states import Running, StateError, settle
from wearsim.results import FILL_FLOAT

if TYPE_CHECKING:
    from wearsim.scene import CampaignSetup


def settled_state(
    state: State, points: OperatingPoints, setup: Setup, stage: NDArray[np.bool_] | None = None
) -> State:
    """Return the state with the shifts and loads at which its profiles balance what is controlled.

    Raises
    ------
    NumericalError
        If no shift or loads do.
    """
    if state.running is None or points.controlled is None:
        return state
    bodies, conditions, before = worn_bodies(state, setup), points.conditions, state.running
    try:
        after = settle(
            conditions, points.controlled, *bodies, setup.models, before.at(state.distance), stage=stage,
            threads=setup.threads,
        )  # fmt: skip
    except StateError as error:
        text = "; ".join(f"{points.label[k]}: {text}" for k, text in error.messages.items())
        fix = "lower the force" if points.controlled.bogies is None else "reprofile earlier, or end there"
        raise NumericalError(f"after {state.distance / 1e3:.6g} km {text}; {fix}") from error
    gone, rate = state.distance - before.distance, before.rate
    if gone > 0.0:
        rate = np.where(np.isfinite(points.controlled.lateral_force), after.shift - before.shift, 0.0) / gone
    return replace(state, running=replace(after, rate=rate, distance=state.distance))


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
    forces = resultants(contact, conditions, setup.wheelset, setup.counterface)
    known = forces.vertical.min(axis=1) > 0.0
    count = weight.size
    stiffness = np.zeros(count) if state.running is None else state.running.stiffness
    runs, of, share = points.runs
    shift, *loads = (np.bincount(of, share * value, count) for value in (runs.shift, *runs.loads.T))
    area = np.bincount(contact.point, wear.area_rate, count) * weight * points.environment
    total = area.sum()
    with np.errstate(divide="ignore", invalid="ignore"):
        quotient = forces.derailment_quotient
    return {
        "lateral_position": shift,
        "wheel_loads": np.stack(loads, axis=1),
        "share_beyond_jump": 1.0 - share[:count],
        "wheelset_yaw": conditions.yaw,
        "lateral_stiffness": stiffness,
        "lateral_force": np.where(known, -forces.force, FILL_FLOAT),
        "derailment_quotient": np.where(known[:, None], quotient, FILL_FLOAT),
        "steering_moment": np.where(known, forces.moment, FILL_FLOAT),
        "axle_wear_number": np.where(known, forces.power / conditions.speed, FILL_FLOAT),
        "wear_share": area / total if total > 0.0 else np.zeros(count),
    }
