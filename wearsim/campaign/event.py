"""Events of a running campaign, for observers and as text lines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from wearsim.quantities import duration, kilometres

Kind = Literal[
    "started", "resumed", "step", "deferred", "rebuilt", "finished", "complete"
]


@dataclass(frozen=True)
class Event:
    """Progress of a campaign, for an observer.

    `kind` is "started", "resumed", "step", "deferred" (a reader holds the file; the
    rows follow), "rebuilt" (the result file was damaged and written anew from the
    records), "finished", or "complete" (finished before).
    """

    kind: Kind
    name: str  # of the campaign: rig or field
    step: int = 0  # finished wear steps
    distance: float = 0.0  # run [m]
    target: float = 0.0  # distance to run [m]
    worst_depth: float = 0.0  # largest wear depth on either wheel [m]
    reprofiled: bool = False  # True: the depth counts from the last reprofiling
    step_length: float = 0.0  # of the last step [m]
    elapsed: float = 0.0  # wall time of this session [s]
    # from the pace of the last quarter of the steps of this session [s]; None before
    # its first step
    time_left: float | None = None
    # Number of steps that each limit kept short, of `quantities.STEP_LIMITS`; limits
    # without steps are missing.
    step_limits: Mapping[str, int] = field(default_factory=dict)
    step_limit: str = ""  # what limited the last step
    fastest: str = ""  # operating point of the fastest wear in the last step
    ended: str = ""  # reason of the end: "distance reached" or "limit of ... met"
    left_out: int = 0  # operating points without contact solution in the last step
    left_out_share: float = 0.0  # share of the wear of these points


_CRAWLS = 10_000
"""Steps like the last one that are left, from which a campaign makes hardly any
progress.
"""
_SHORT = ("depth cap", "stability", "error", "no contact", "clipping")
"""Limits that make steps short; the others are of the scene or pass within some
steps.
"""


def line(event: Event) -> str:
    """Format an event of a running campaign as one line."""
    at, target = kilometres(event.distance), kilometres(event.target)
    progress = f"{at.removesuffix(' km')} of {target}"
    if event.target > 0.0:
        progress += f" ({100.0 * event.distance / event.target:.0f} %)"
    since = " since reprofiling" if event.reprofiled else ""
    depth = f"worst depth {1e3 * event.worst_depth:.3f} mm{since}"
    state = f"{depth}, {event.step} step{'s' if event.step != 1 else ''}"
    reason = "" if event.ended in ("", "distance reached") else f": {event.ended}"
    left = "" if event.time_left is None else f", {duration(event.time_left)} left"
    slow = crawling(
        event.target - event.distance,
        event.step_length,
        event.step_limit,
        event.fastest,
    )
    texts = {
        "started": f"started, {target} to run",
        "resumed": f"continued at step {event.step}, {progress}",
        "rebuilt": f"{event.name}.nc was incomplete and is rebuilt from the records of "
        "its steps",
        "deferred": (
            f"another program holds {event.name}.nc open; the campaign goes on, the "
            "file follows when it is free"
        ),
        "complete": f"finished before, {at}, {state}{reason}",
        "finished": f"finished, {at}, {state}, in {duration(event.elapsed)}{reason}",
        "step": f"{progress}, {depth}{left}{f'; {slow}' if slow else ''}",
    }
    return f"{event.name}: {texts[event.kind]}"


def crawling(left: float, length: float, limit: str, fastest: str) -> str:
    """Say where a campaign makes hardly any progress, "" if it does make some.

    Parameters
    ----------
    left, length : float
        Distance to run and length of the last step [m].
    limit, fastest : str
        What limited that step, and its operating point of the fastest wear.
    """
    if limit not in _SHORT or left <= _CRAWLS * length:
        return ""
    where = f" in {fastest}" if fastest else ""
    return f"no progress{where}: steps of {length:.3g} m, limited by {limit}"
