"""Events of a running campaign, for observers and as text lines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from wearsim.quantities import duration

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
    step_length: float = 0.0  # of the last step [m]
    elapsed: float = 0.0  # wall time of this session [s]
    # from the pace of the last quarter of the steps of this session [s]; None before
    # its first step
    time_left: float | None = None
    # Number of steps by limit, of `quantities.STEP_LIMITS`; limits without steps are
    # missing.
    step_limits: Mapping[str, int] = field(default_factory=dict)
    ended: str = ""  # reason of the end: "distance reached" or "limit of ... met"
    left_out: int = 0  # operating points without contact solution in the last step
    left_out_share: float = 0.0  # share of the wear of these points


def line(event: Event) -> str:
    """Format an event of a running campaign as one line."""
    at, target = (
        f"{distance / 1e3:.6g} km" for distance in (event.distance, event.target)
    )
    state = f"worst depth {1e3 * event.worst_depth:.3f} mm, step {event.step}"
    why = "" if event.ended in ("", "distance reached") else f": {event.ended}"
    held = held_by(event.step_limits) + why
    left = "" if event.time_left is None else f", {duration(event.time_left)} left"
    texts = {
        "started": f"started, {target} to run",
        "resumed": f"continued at step {event.step}, {at} of {target}",
        "rebuilt": (
            f"{event.name}.nc was incomplete and is rebuilt from the records of its "
            "steps"
        ),
        "deferred": (
            f"another program holds {event.name}.nc open; the campaign goes on, the "
            "file follows when it is free"
        ),
        "complete": f"finished before, {at}, {state}{held}",
        "finished": f"finished, {at}, {state}, in {duration(event.elapsed)}{held}",
        "step": f"{at} of {target}, {state}{left}",
    }
    return f"{event.name}: {texts[event.kind]}"


def held_by(limits: Mapping[str, int]) -> str:
    """State the two most frequent limits of the steps.

    Example: ", steps held by error in 38 and by stability in 20 of 60".
    """
    held = sorted(limits.items(), key=lambda item: -item[1])[:2]
    parts = " and ".join(f"by {name} in {count}" for name, count in held)
    return f", steps held {parts} of {sum(limits.values())}" if held else ""
