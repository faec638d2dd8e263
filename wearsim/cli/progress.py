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

if TYPE_CHECKING:
    import argparse
    from pathlib import Path

    from wearsim.campaign.run import Observer
    from wearsim.studies.ensemble import Outcome, Runner

PLAIN_INTERVAL = 10.0
"""Without a terminal a line at most every so many seconds [s]."""

RUNNING_INTERVAL = 30.0
"""Between lines on the cases that run [s]."""


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

    Standard error has lines when a labelled case begins, when any ends, of how many,
    and now and then on what runs in the directory `out`. If quiet, only cases that
    failed have lines.
    """
    from wearsim.studies.ensemble import Runner, cluster, running_text

    over, ended, quiet = threading.Event(), set[int](), arguments.quiet

    def report(count: int, outcome: Outcome) -> None:
        number, state = outcome.number, outcome.state
        if state == "running":
            text = f"begun, {labels[number]}" if number in labels else ""
        else:
            ended.add(number)
            text = with_fault(f"{state} ({len(ended)} of {count})", outcome.fault)
        if text and not (quiet and state in ("running", "finished")):
            print(f"{what} {number}: {text}", file=sys.stderr, flush=True)

    def show() -> None:
        while not over.wait(RUNNING_INTERVAL):
            if not quiet and (text := running_text(out)):
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


def with_fault(line: str, fault: str) -> str:
    """Line with its fault, if there is one."""
    return f"{line}; {fault}" if fault else line
