"""Changes that would let a bogie run in a curve without a balance.

Each change is tested by a solution.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import numpy as np

from wearsim.contact.problem import (
    ContactConditions,
    ContactModels,
    Counterface,
    Wheelset,
)
from wearsim.operation.bogie import Bogies
from wearsim.operation.controlled import Controlled
from wearsim.operation.states import StateError, settle


def bogie_of(controlled: Controlled | None, point: int) -> Bogies | None:
    """Return the bogie whose leading axle is an operating point, or None."""
    bogies = None if controlled is None else controlled.bogies
    if bogies is None or point not in bogies.leading:
        return None
    return bogies.at(np.flatnonzero(bogies.leading == point))


def what_helps(
    conditions: ContactConditions,
    controlled: Controlled,
    bogie: Bogies,
    bodies: tuple[Wheelset, Counterface],
    models: ContactModels,
) -> str:
    """List which of less friction, balanced cant and a wider curve lets a bogie run.

    Tried are half the friction, balanced cant, twice the radius and no torque.

    Parameters
    ----------
    conditions, controlled
        Of all operating points.
    bogie : Bogies
        One without balance.
    bodies : (Wheelset, Counterface)
        As in `settle`.
    models : ContactModels
        As in `settle`.

    Returns
    -------
    str
        The end of a message.
    """
    alone = replace(bogie, leading=np.array([0]), trailing=np.array([1]))
    axles, control = (
        conditions.at(bogie.points),
        replace(controlled.at(bogie.points), bogies=alone),
    )
    flange = axles.friction_flange
    slippery = replace(
        axles,
        friction=0.5 * axles.friction,
        friction_flange=None if flange is None else 0.5 * flange,
    )
    balanced = replace(control, bogies=replace(alone, acceleration=np.zeros(1)))
    upright = replace(axles, box_moment=np.zeros(2))
    wider = replace(axles, track_curvature=0.5 * axles.track_curvature)
    tried = {
        "with half the friction (friction, friction_flange)": (slippery, control),
        "without unbalanced acceleration (speed_km_h, cant_mm, cant_deficiency_mm)": (
            upright,
            balanced,
        ),
        "in a curve twice as wide (curve_radius_m)": (wider, control),
    }
    if np.any(axles.torque):
        rolling = replace(axles, torque=np.zeros(2))
        tried["without torque on the axle (axle_torque_kN_m, torque_Nm)"] = (
            rolling,
            control,
        )
    helps = []
    for change, (changed, forces) in tried.items():
        with suppress(StateError):
            settle(changed, forces, *bodies, models)
            helps.append(change)
    if helps:
        return f"it runs {', or '.join(helps)}"
    return (
        "neither half the friction, nor balanced cant, nor a curve twice as wide "
        "helps: change profiles or vehicle"
    )
