"""Attempt of a wear step: the starts of its stages, its rates, its acceptance."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.campaign import control, step
from wearsim.campaign.evaluate import Evaluation, Setup, accumulate, rate
from wearsim.campaign.left_out import Failed
from wearsim.campaign.state import State, WearRate
from wearsim.contact.balance import Equilibria
from wearsim.contact.patch import FloatArray
from wearsim.operation.points import OperatingPoints
from wearsim.operation.states import Running
from wearsim.scene.campaign import ControlSettings

# Largest share of a step's area that may be clipped; more means that patches moved too
# far within the step.
_CLIPPED = 0.01

# factor on the length of a step that was clipped or has stages without contact
_SHORTER = 0.3

# Depth of a step below which clipping and missing contact do not depend on its length:
# a patch vanishes, or a point has no solution [m].
_SHALLOW = 1e-7


class Way(NamedTuple):
    """Last state on the way through a wear step, from which the next one starts."""

    distance: float  # of the state [m]
    running: Running | None  # running state of the wheelset
    # start of the search and of the contact solution; None: a fresh start
    begin: Equilibria | None
    failed: Failed  # points without contact solution in any stage

    def begin_at(self, distance: float, weight: FloatArray) -> Equilibria | None:
        """Start of the search and of the contact solution at another distance [m].

        Points without a weight (n,) are not solved there, and stay.
        """
        if self.begin is None:
            return None
        return self.begin.ahead(distance - self.distance, weight > 0.0)


class Attempt(NamedTuple):
    """Wear step that was attempted."""

    step: step.Step
    error: float  # of its depth [m]
    stiffness: float  # that it showed [1/m]
    end: Evaluation  # contact at its end


class Rates:
    """Wear rates of a state by the weights of its points, each solved once."""

    def __init__(
        self,
        state: State,
        points: OperatingPoints,
        setup: Setup,
        evaluation: Evaluation,
    ) -> None:
        self._state, self._points, self._setup = state, points, setup
        self._passage = evaluation.passage
        self._rates = {evaluation.weight.tobytes(): evaluation.collective}

    def of(self, weight: FloatArray) -> WearRate:
        """Wear rate with the points active by weights (n,)."""
        key = weight.tobytes()
        if key not in self._rates:
            self._rates[key] = self._rate(weight)
        return self._rates[key]

    def _rate(self, weight: FloatArray) -> WearRate:
        passage, covered = (
            self._passage,
            [*self._passage.contact.point, *self._passage.failed],
        )
        if np.isin(np.flatnonzero(weight), covered).all():
            return accumulate(passage, self._points, weight, self._state, self._setup)
        return rate(self._state, self._points, weight, self._setup)


def is_shallow(now: WearRate, length: float) -> bool:
    """Return True if a step [m] is too shallow for a shorter one to help."""
    return float(now.depth.max()) * length < _SHALLOW


def without_contact(length: float) -> tuple[float, str]:
    """Limit of the length of the next attempt if stages lack a contact solution [m]."""
    return _SHORTER * length, "no contact"


def refusal(
    attempt: Attempt, length: float, shallow: bool, settings: ControlSettings
) -> tuple[float, str] | None:
    """Limit of the length [m] of the next attempt, and its reason.

    None if this attempt is accepted.
    """
    clipped = attempt.step.clipped > _CLIPPED and not shallow
    if attempt.error <= settings.error_tolerance and not clipped:
        return None
    limit = control.error_limit(length, attempt.error, settings), "error"
    return min(limit, (_SHORTER * length, "clipping")) if clipped else limit
