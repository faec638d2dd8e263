"""What a running campaign shows: one live line in a terminal, plain lines elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, TextIO

from wearsim.quantities import duration

if TYPE_CHECKING:
    from wearsim.campaign.run import Event, Observer

PLAIN_INTERVAL = 10.0
"""Without a terminal a line at most every so many seconds [s]."""


@contextmanager
def observer(stream: TextIO | None = None) -> Iterator[Observer]:
    """Give the observer for a campaign run from the command line.

    It writes to standard error by default, so that standard output stays for results.
    """
    stream = sys.stderr if stream is None else stream
    if stream.isatty():
        with _live(stream) as show:
            yield show
    else:
        yield PlainLines(stream)


class PlainLines:
    """Writes a line for each start and end, and for steps not more often than the interval [s]."""

    def __init__(self, stream: TextIO, interval: float = PLAIN_INTERVAL) -> None:
        self._stream = stream
        self._interval = interval
        self._last = -float("inf")
        self._deferred_shown = False

    def __call__(self, event: Event) -> None:
        """Show an event."""
        if event.kind == "step":
            if time.monotonic() - self._last < self._interval:
                return
            self._last = time.monotonic()
        if event.kind == "deferred" and self._deferred_shown:
            return
        self._deferred_shown |= event.kind == "deferred"
        self._stream.write(line(event) + "\n")
        self._stream.flush()


def line(event: Event) -> str:
    """Put an event of a running campaign into one line."""
    if event.kind == "started":
        return f"{event.name}: started, {_km(event.target)} to run"
    if event.kind == "resumed":
        return f"{event.name}: continued at step {event.step}, {_km(event.distance)} of {_km(event.target)}"
    if event.kind == "rebuilt":
        return f"{event.name}: {event.name}.nc was incomplete and is rebuilt from the records of its steps"
    if event.kind == "deferred":
        return (
            f"{event.name}: another program holds {event.name}.nc open; "
            f"the campaign goes on, the file follows when it is free"
        )
    state = f"worst depth {1e3 * event.worst_depth:.3f} mm, step {event.step}"
    held = held_by(event.step_limits)
    why = "" if event.ended in ("", "distance reached") else f": {event.ended}"
    if event.kind == "complete":
        return f"{event.name}: finished before, {_km(event.distance)}, {state}{held}{why}"
    if event.kind == "finished":
        took = f"in {duration(event.elapsed)}"
        return f"{event.name}: finished, {_km(event.distance)}, {state}, {took}{held}{why}"
    left = "" if event.time_left is None else f", {duration(event.time_left)} left"
    return f"{event.name}: {_km(event.distance)} of {_km(event.target)}, {state}{left}"


def held_by(limits: Mapping[str, int]) -> str:
    """Say which two limits held most steps: ", steps held by error in 38 and by stability in 20 of 60"."""
    held = sorted(limits.items(), key=lambda item: -item[1])[:2]
    parts = " and ".join(f"by {name} in {count}" for name, count in held)
    return f", steps held {parts} of {sum(limits.values())}" if held else ""


def _km(distance: float) -> str:
    return f"{distance / 1e3:.6g} km"


@contextmanager
def _live(stream: TextIO) -> Iterator[Observer]:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskID, TextColumn

    console = Console(file=stream)
    columns = (TextColumn("{task.fields[name]}"), BarColumn(bar_width=24), TextColumn("{task.description}"))
    with Progress(*columns, console=console) as bar:
        tasks: dict[str, TaskID] = {}
        deferred: set[str] = set()

        def show(event: Event) -> None:
            if event.name not in tasks:
                tasks[event.name] = bar.add_task("", name=event.name, total=event.target)
            text = line(event).removeprefix(f"{event.name}: ")
            bar.update(tasks[event.name], completed=event.distance, description=text)
            if event.kind == "rebuilt" or (event.kind == "deferred" and event.name not in deferred):
                bar.console.print(line(event), markup=False, highlight=False)
            if event.kind == "deferred":
                deferred.add(event.name)

        yield show
