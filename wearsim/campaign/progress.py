"""How a running campaign tells where it stands: events for an observer, `status.json` for everybody else."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Literal

from wearsim.campaign.directory import write_status
from wearsim.campaign.state import State
from wearsim.errors import WearsimError

Kind = Literal["started", "resumed", "step", "deferred", "rebuilt", "finished", "found"]


@dataclass(frozen=True)
class Event:
    """What a campaign tells its observer.

    Parameters
    ----------
    kind : str
        "started", "resumed", "step", "deferred" (a reader holds the file; the rows follow), "rebuilt" (the
        result file was damaged and written anew from the records), "finished", or "found" (it was
        finished before).
    name : str
        Campaign: rig or field.
    step : int
        Finished wear steps.
    distance, target : float
        Distance run and to run [m].
    worst_depth : float
        Largest wear depth on either wheel [m].
    step_length : float
        Length of the last step [m].
    elapsed : float
        Wall time of this session [s].
    time_left : float or None
        Estimated from this session's pace [s]; None before its first step.
    ended : str
        Why a finished campaign ended: "distance reached" or "limit of ... met".
    """

    kind: Kind
    name: str
    step: int = 0
    distance: float = 0.0
    target: float = 0.0
    worst_depth: float = 0.0
    step_length: float = 0.0
    elapsed: float = 0.0
    time_left: float | None = None
    ended: str = ""


Observer = Callable[[Event], None]


class Progress:
    """Tells observer and status file how far the campaign is."""

    def __init__(self, name: str, target: float, directory: Path, observer: Observer | None) -> None:
        self._event = Event("started", name, target=target)
        self._directory = directory
        self._observer = observer
        self._began = time.monotonic()
        self._from = 0.0

    def start(self, kind: Literal["started", "resumed"], state: State) -> None:
        """Tell that the campaign goes on from a state."""
        self._from = state.distance
        self.tell(kind, state.step, state.distance, float(state.wear_depth.max()))

    def step(self, state: State, step_length: float) -> None:
        """Tell that the step of this length [m] led to a state, now written."""
        self._event = replace(self._event, step_length=step_length)
        self.tell("step", state.step, state.distance, float(state.wear_depth.max()))

    def tell(
        self,
        kind: Kind,
        step: int | None = None,
        distance: float | None = None,
        worst: float | None = None,
        ended: str = "",
    ) -> None:
        """Tell an event; step, distance [m] and worst depth [m] stay as they were unless given."""
        last = self._event
        elapsed = time.monotonic() - self._began
        at = last.distance if distance is None else distance
        run = at - self._from
        self._event = replace(
            last,
            kind=kind,
            step=last.step if step is None else step,
            distance=at,
            worst_depth=last.worst_depth if worst is None else worst,
            elapsed=elapsed,
            ended=ended,
            time_left=elapsed / run * max(last.target - at, 0.0) if run > 0.0 else None,
        )
        self._status("finished" if kind in ("finished", "found") else "running")
        if self._observer is not None:
            self._observer(self._event)

    def close(self, state: str, message: str = "") -> None:
        """Write down how the session ended, if that can still be written."""
        with contextlib.suppress(WearsimError):  # what stopped the campaign matters more
            self._status(state, message)

    def _status(self, state: str, message: str = "") -> None:
        status = asdict(self._event)
        del status["kind"], status["name"]
        write_status(self._directory, self._event.name, {"state": state, **status, "message": message})
