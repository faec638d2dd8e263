"""Where the contact of a state is expected: on a line through those of the states before.

Roll, rotation speed and loads of a wheelset follow the worn depth: those of the stages of a wear step are
linear in the distance, but for the second order. What the contact solver finds does not depend on where it
begins, beyond its tolerances.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from wearsim.campaign.state import State
from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import ContactPatches

_FALL = 1  # column of what the search for the roll learns now and then: it follows no line


def remembered(state: State, contact: ContactPatches, points: int) -> State:
    """Return a state of so many points that knows its contact; those that did not act last stay there."""
    nearby, rate = state.nearby, state.nearby_rate
    if nearby.size == 0:
        nearby, rate = np.full((points, 5), np.nan), np.zeros((points, 5))
    rate = np.where(state.active_weight[:, None] > 0.0, rate, 0.0)
    return replace(state, nearby=_found(contact, nearby), nearby_rate=rate)


def _found(contact: ContactPatches, before: FloatArray) -> FloatArray:
    """Where the points of a contact were solved, and others before (n, 5)."""
    nearby = before.copy()
    nearby[contact.point[::-1]] = contact.nearby[::-1]
    return nearby


def expected(state: State, ahead: State, rate: FloatArray) -> State:
    """Return a state ahead of one that knows its contact with what is expected there at a rate (n, 5)."""
    if state.nearby.size == 0:
        return ahead
    nearby = state.nearby + (ahead.distance - state.distance) * rate
    return replace(ahead, nearby=nearby, nearby_rate=rate)


def rate_to(state: State, ahead: State, contact: ContactPatches) -> FloatArray:
    """Change per metre (n, 5) from a state that knows its contact to the contact of one ahead."""
    rate = (_found(contact, state.nearby) - state.nearby) / (ahead.distance - state.distance)
    rate[:, _FALL] = 0.0
    return np.where(np.isfinite(rate), rate, 0.0)
