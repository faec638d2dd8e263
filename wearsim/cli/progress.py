"""What a running campaign shows: one live line in a terminal, plain lines elsewhere."""

from __future__ import annotations

import logging
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from shutil import get_terminal_size
from typing import TYPE_CHECKING, TextIO

from wearsim.campaign.event import Event, line
from wearsim.quantities import duration

if TYPE_CHECKING:
    import argparse
    from pathlib import Path

    from wearsim.campaign.run import Observer
    from wearsim.studies.ensemble import Outcome, Runner

PLAIN_INTERVAL = 10.0
"""Without a terminal a line at most every so many seconds [s]."""

RUNNING_INTERVAL = 30.0
"""Without a terminal, time between lines on how far many cases are [s]."""

LIVE_INTERVAL = 1.0
"""In a terminal, time after which the live line of many cases is written anew [s]."""


@contextmanager
def observer(
    stream: TextIO | None = None,
    interval: float = PLAIN_INTERVAL,
    *,
    quiet: bool = False,
) -> Iterator[Observer]:
    """Give the observer for a campaign run from the command line.

    It writes to standard error by default, so that standard output stays for results:
    in a terminal each step into one live line, elsewhere a line for steps not more
    often than the interval [s]; nothing if quiet. A first run says that it compiles.
    """
    out = sys.stderr if stream is None else stream
    live, last, deferred, open_line = out.isatty(), -float("inf"), False, False

    def show(event: Event) -> None:
        nonlocal last, deferred, open_line
        if (
            quiet
            or (event.kind == "deferred" and deferred)
            or (
                event.kind == "step" and not live and time.monotonic() - last < interval
            )
        ):
            return
        if event.kind == "step":
            last = time.monotonic()
        deferred |= event.kind == "deferred"
        before, open_line = (
            "\r\x1b[K" if open_line else "",
            live and event.kind == "step",
        )
        text = line(event)
        # a line that the terminal wraps could not be written anew
        out.write(
            before
            + (text[: get_terminal_size().columns - 1] if open_line else f"{text}\n")
        )
        out.flush()

    try:
        with nullcontext() if quiet else _shown("wearsim.kernels", out):
            yield show
    finally:
        if open_line:
            out.write("\n")


@contextmanager
def _shown(name: str, out: TextIO) -> Iterator[None]:
    """Write the lines of a logger to a stream."""
    log, handler = logging.getLogger(name), logging.StreamHandler(out)
    before = log.level
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    try:
        yield
    finally:
        log.setLevel(before)
        log.removeHandler(handler)


@contextmanager
def runner(
    arguments: argparse.Namespace, what: str, out: Path, labels: Mapping[int, str] = {}
) -> Iterator[Runner]:
    """Give the runner of the many cases of a command, in processes or on its cluster.

    A terminal has one live line with a bar of all cases and the time left. Elsewhere
    standard error has lines when a labelled case begins, when any ends, of how many,
    and now and then on what runs in the directory `out`. If quiet, only cases that
    failed have lines.
    """
    from wearsim.studies.ensemble import Runner, cluster

    over, live = threading.Event(), sys.stderr.isatty() and not arguments.quiet
    cases = Cases(what, out)

    def report(count: int, outcome: Outcome) -> None:
        number, state = outcome.number, outcome.state
        cases.count(count, outcome)
        if state == "running":
            text = f"begun, {labels[number]}" if number in labels else ""
        else:
            text = with_fault(f"{state} ({cases.done} of {count})", outcome.fault)
        silent = live or arguments.quiet
        if text and not (silent and state in ("running", "finished")):
            before = "\r\x1b[K" if live else ""
            print(f"{before}{what} {number}: {text}", file=sys.stderr, flush=True)
        if live:
            _rewrite(cases.line(with_bar=True))

    def show() -> None:
        while not over.wait(LIVE_INTERVAL if live else RUNNING_INTERVAL):
            text = "" if arguments.quiet else cases.line(with_bar=live)
            if text and live:
                _rewrite(text)
            elif text:
                print(text, file=sys.stderr, flush=True)

    thread = threading.Thread(target=show, daemon=True)
    address = arguments.cluster
    with nullcontext() if address is None else cluster(address) as executor:
        thread.start()
        try:
            yield Runner(executor, arguments.jobs, arguments.command_line, report)
        finally:
            over.set()
            thread.join()
            if live and cases.of:
                print(file=sys.stderr)


def _rewrite(text: str) -> None:
    """Write the live line of a terminal anew, no longer than the terminal is wide."""
    width = get_terminal_size().columns - 1
    print(f"\r\x1b[K{text[:width]}", end="", file=sys.stderr, flush=True)


class Cases:
    """How far many cases are, for a line of text.

    Parameters
    ----------
    what : str
        Word for one of them, such as "draw".
    out : Path
        Folder of their run directories.
    """

    def __init__(self, what: str, out: Path) -> None:
        from wearsim.studies.ensemble import shares_of

        self.of, self._what, self._out = 0, what, out
        self._ended = set[int]()
        self._began, self._at_first = time.monotonic(), shares_of(out)

    @property
    def done(self) -> int:
        """Number of cases that have ended."""
        return len(self._ended)

    def count(self, of: int, outcome: Outcome) -> None:
        """Count a case that begins or ends, of so many."""
        self.of = of
        if outcome.state != "running":
            self._ended.add(outcome.number)

    def line(self, *, with_bar: bool) -> str:
        """Write number of cases, share and time left, "" before the first case.

        Time is left at the pace of this session: what earlier ones ran is not counted.
        """
        from wearsim.studies.ensemble import shares_of

        if not self.of:
            return ""
        finished = [number for number, share in self._at_first.items() if share == 1.0]
        running = shares_of(self._out, leave={*self._ended, *finished})
        running = {number: share for number, share in running.items() if share < 1.0}
        whole = min(self.done + sum(running.values()), self.of)
        earlier = sum(self._at_first.get(k, 0.0) for k in {*self._ended, *running})
        share = whole / self.of
        text = f"{self._what}s: {bar(share) if with_bar else ''}"
        text += f"{self.done} of {self.of} done, {100.0 * share:.0f} %"
        if whole > earlier and whole < self.of:
            pace = (whole - earlier) / (time.monotonic() - self._began)
            text += f", {duration((self.of - whole) / pace)} left"
        return text


def bar(share: float, width: int = 20) -> str:
    """Bar of a share from 0 to 1, with a space behind it."""
    full = round(width * min(max(share, 0.0), 1.0))
    return f"[{'#' * full}{'-' * (width - full)}] "


def with_fault(line: str, fault: str) -> str:
    """Line with its fault, if there is one."""
    return f"{line}; {fault}" if fault else line
