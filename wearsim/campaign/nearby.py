"""Where the contact of a state is expected: on a line through those of the states before.

Roll, rotation speed and loads of a wheelset follow the worn depth: those of the stages of a wear step are
linear in the distance, but for the second order. What the contact solver finds does not depend on where it
begins, beyond its tolerances; where two solutions carry the loads of a wheelset it is the one it began with.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from wearsim.campaign.state import State
from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import NEARBY, ContactPatches

_LATEST = range(4, NEARBY)  # slopes, which the search learns on its way: they follow no line


def remembered(state: State, contact: ContactPatches, points: int) -> State:
    """Return a state of so many points that knows its contact; those that did not act last stay there."""
    nearby, rate = state.nearby, state.nearby_rate
    if nearby.size == 0:
        nearby, rate = np.full((points, NEARBY), np.nan), np.zeros((points, NEARBY))
    rate = np.where(state.active_weight[:, None] > 0.0, rate, 0.0)
    return replace(state, nearby=found(contact, nearby), nearby_rate=rate)


def found(contact: ContactPatches, before: FloatArray) -> FloatArray:
    """Where the points of a contact were solved, and others before (n, 20)."""
    nearby = before.copy()
    nearby[contact.point[::-1]] = contact.nearby[::-1]
    return nearby


def expected(state: State, ahead: State, rate: FloatArray, latest: FloatArray) -> State:
    """Return a state ahead of one that knows its contact with what is expected there.

    At a rate (n, 20), and as the `latest` contact (n, 20) had it what follows no line.
    """
    if state.nearby.size == 0:
        return ahead
    nearby = state.nearby + (ahead.distance - state.distance) * rate
    nearby[:, _LATEST] = latest[:, _LATEST]
    return replace(ahead, nearby=nearby, nearby_rate=rate)


def rate_to(state: State, ahead: State, latest: FloatArray) -> FloatArray:
    """Change per metre (n, 20) from a state that knows its contact to that of one ahead."""
    rate: FloatArray = (latest - state.nearby) / (ahead.distance - state.distance)
    rate[:, _LATEST] = 0.0
    return np.where(np.isfinite(rate), rate, 0.0)
