"""Position, yaw and loads of the wheelset in a state, and their row variables."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wearsim.campaign.evaluate import Setup, forces_of, worn_bodies
from wearsim.campaign.passage import Passage
from wearsim.campaign.state import PatchWear, State
from wearsim.contact.balance import Equilibria
from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import NEARBY
from wearsim.errors import ContactError, NumericalError
from wearsim.operation.points import OperatingPoints
from wearsim.operation.refusal import bogie_of, what_helps
from wearsim.operation.states import Running, StateError, settle_nearby
from wearsim.quantities import kilometres
from wearsim.results import FILL_FLOAT

if TYPE_CHECKING:
    from wearsim.scene import CampaignSetup


def settled_state(
    state: State,
    points: OperatingPoints,
    setup: Setup,
    stage: NDArray[np.bool_] | None = None,
    begin: Equilibria | None = None,
) -> tuple[State, Equilibria | None]:
    """State with the positions at which its profiles balance the controlled forces.

    In a `stage` of a wear step those of points (n,) that act in it. The second value is
    where the next search can begin: the end of this one, which itself begins at
    `begin`.

    Raises
    ------
    NumericalError
        If no place does.
    """
    if state.running is None or points.controlled is None:
        return state, begin
    bodies, before = worn_bodies(state, setup), state.running
    try:
        after, ends = settle_nearby(
            points.conditions,
            points.controlled,
            bodies,
            setup.models,
            before.at(state.distance),
            begin,
            stage=stage,
            threads=setup.threads,
        )
    except StateError as error:
        text = "; ".join(
            f"{points.label[k]}: {text}" for k, text in error.messages.items()
        )
        fix = (
            "lower the force"
            if points.controlled.bogies is None
            else "reprofile earlier, or end there"
        )
        error.bodies = bodies
        raise NumericalError(
            f"after {kilometres(state.distance)} {text}; {fix}"
        ) from error
    travelled, rate = state.distance - before.distance, before.rate
    if travelled > 0.0:
        rate = (
            np.where(
                np.isfinite(points.controlled.lateral_force),
                after.shift - before.shift,
                0.0,
            )
            / travelled
        )
    running = replace(after, rate=rate, distance=state.distance)
    equilibria = ends.equilibria
    return (
        replace(state, running=running),
        equilibria if begin is None else equilibria.where(equilibria.of_guided, begin),
    )


def equilibria_of(
    passage: Passage, points: OperatingPoints, before: Equilibria | None
) -> Equilibria:
    """Start of the contact solution of the points after a passage.

    Points in equilibrium with forces keep those `before`, the ends of their searches.
    """
    nearby = np.full((len(points.label), NEARBY), np.nan)
    nearby[passage.contact.point[::-1]] = passage.contact.nearby[::-1]
    if points.controlled is not None:
        nearby[points.controlled.any] = np.nan
    equilibria = Equilibria.of_placed(nearby)
    if before is None:
        return equilibria
    has_contact = np.isfinite(nearby).all(axis=1)
    return replace(equilibria.where(has_contact, before), drift=before.drift)


def begun_at(points: OperatingPoints, begin: Equilibria | None) -> OperatingPoints:
    """Operating points whose contact solution starts from known equilibria."""
    if begin is None:
        return points
    return replace(points, conditions=replace(points.conditions, nearby=begin.placed))


def with_help(
    error: ContactError, points: OperatingPoints, setup: Setup
) -> ContactError:
    """Return the error that ends a campaign.

    It lists changes that would let a bogie without balance run.
    """
    lost = error.__cause__
    if (
        not isinstance(lost, StateError)
        or lost.bodies is None
        or points.controlled is None
    ):
        return error
    bogie = bogie_of(points.controlled, min(lost.messages))
    if bogie is None:
        return error
    helps = what_helps(
        points.conditions, points.controlled, bogie, lost.bodies, setup.models
    )
    return NumericalError(f"{error}; {helps}")


def new_running(setup: CampaignSetup) -> Running:
    """Return the running state of the new wheelset."""
    conditions = setup.points.conditions
    zeros = np.zeros(conditions.shift.size)
    return setup.running or Running(conditions.shift, zeros, conditions.yaw, zeros)


def row_running(
    state: State,
    setup: CampaignSetup,
    weight: FloatArray,
    passage: Passage,
    wear: PatchWear,
) -> dict[str, np.ndarray]:
    """Variables of one row on the position of the wheelset and the forces on it.

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
    forces = forces_of(passage, points)
    in_contact = forces.vertical.min(axis=1) > 0.0
    # one side of a jump alone is not a known state
    in_contact[list(passage.failed)] = False
    count = weight.size
    stiffness = np.zeros(count) if state.running is None else state.running.stiffness
    residual = np.full(count, FILL_FLOAT)
    if state.running is not None and points.controlled is not None:
        residual = np.where(points.controlled.any, state.running.residual, residual)
    depth = (
        np.zeros(count) if conditions.shift_depth is None else conditions.shift_depth
    )
    moment = (
        np.full(count, np.nan)
        if conditions.box_moment is None
        else conditions.box_moment
    )
    shared = in_contact & np.isfinite(moment)
    runs, of, share = points.runs
    shift = np.bincount(of, share * runs.shift, count)
    area = (
        np.bincount(contact.point, wear.area_rate, count) * weight * points.environment
    )
    total = area.sum()
    with np.errstate(divide="ignore", invalid="ignore"):
        quotient = forces.derailment_quotient
    return {
        "lateral_position": shift
        + depth * np.sin(np.where(in_contact, forces.roll, conditions.roll)),
        "wheel_loads": np.where(shared[:, None], forces.vertical, conditions.loads),
        "share_beyond_jump": 1.0 - share[:count],
        "wheelset_yaw": conditions.yaw,
        "wheelset_roll": np.where(in_contact, forces.roll, FILL_FLOAT),
        "lateral_stiffness": stiffness,
        "force_residual": residual,
        "lateral_force": np.where(in_contact, -forces.force, FILL_FLOAT),
        "derailment_quotient": np.where(in_contact[:, None], quotient, FILL_FLOAT),
        "steering_moment": np.where(in_contact, forces.moment, FILL_FLOAT),
        "axle_wear_number": np.where(
            in_contact, forces.power / conditions.speed, FILL_FLOAT
        ),
        "wear_share": area / total if total > 0.0 else np.zeros(count),
    }
