"""Turning of the wheels in a campaign: when it is due, and the wheelset that comes back from the lathe."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from wearsim.campaign.counterface import as_it_is
from wearsim.campaign.state import State
from wearsim.operation.points import ControlSettings
from wearsim.profile.turning import turn_axle
from wearsim.results.limits import first_met

if TYPE_CHECKING:
    from wearsim.scene import CampaignSetup

_SAME_PLACE = 1e-9  # of the distance: above the rounding of its sum, below any step


def turning_due(state: State, setup: CampaignSetup, measures: Mapping[str, np.ndarray]) -> bool:
    """Tell whether the wheels are turned before they run on.

    Parameters
    ----------
    state : State
        Both wheels.
    setup : CampaignSetup
        With the rules.
    measures : mapping of arrays
        Of the state, from `row.measures_told`: the conicity alone takes as long as many contact solutions.

    Returns
    -------
    bool
        True at a stated distance or where a limit is met; never of wheels just turned.
    """
    rules = setup.control.turning
    if rules is None or state.turned == state.step > 0:
        return False
    if any(abs(state.distance - place) <= _SAME_PLACE * place for place in rules.places):
        return True
    limits = {name: value for name, value in setup.control.limits if name in rules.limits}
    laws = [one.law for one in setup.fatigue]
    return bool(limits) and first_met(measures, limits, laws) is not None


def turn_wheels(state: State, setup: CampaignSetup) -> State:
    """Turn both wheels to their templates and one diameter, with the least loss of it.

    Parameters
    ----------
    state : State
        Worn wheels.
    setup : CampaignSetup
        With templates and the least depth of cut.

    Returns
    -------
    State
        The next step, at the same distance. Heights stay those of the new wheel's axes, so that
        :math:`r_0 + z` is the rolling radius as before. Depth and fatigue damage begin anew with the
        material that is now the surface; area and mass go on counting what was worn.
    """
    if setup.templates is None or setup.control.turning is None:
        raise ValueError("wheels are turned where the scene has a template")
    worn = (
        replace(setup.wheelset.right, y=state.y[0], z=state.z[0]),
        replace(setup.wheelset.left, y=state.y[1], z=state.z[1]),
    )
    wheels = [one.profile for one in turn_axle(*worn, setup.templates)]
    return replace(
        state,
        step=state.step + 1,
        turned=state.step + 1,
        y=np.stack([wheel.y for wheel in wheels]),
        z=np.stack([wheel.z for wheel in wheels]) - setup.control.turning.cut,
        wear_depth=np.zeros_like(state.wear_depth),
        regime_depth=np.zeros_like(state.regime_depth),
        beside_depth=tuple(np.zeros_like(depth) for depth in state.beside_depth),
        fatigue_damage=tuple(np.zeros_like(damage) for damage in state.fatigue_damage),
        step_length=0.0,
        step_error=None,
        counterface=None if state.counterface is None else as_it_is(state.counterface),
    )


def to_next_turning(state: State, control: ControlSettings) -> ControlSettings:
    """Return the settings with which steps end at the next stated turning.

    Parameters
    ----------
    state : State
        For the distance run.
    control : ControlSettings
        Of the campaign.
    """
    places = () if control.turning is None else control.turning.places
    ahead = [place for place in places if place > state.distance * (1.0 + _SAME_PLACE)]
    return replace(control, distance=min([control.distance, *ahead]))
