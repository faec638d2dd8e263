"""`wearsim check`: all faults of a scene, or what would be run."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Timer

from wearsim.cli import print_json
from wearsim.cli.flags import load_overridden
from wearsim.studies.check import check
from wearsim.studies.plan import plan_text, verdict_text
from wearsim.studies.sweep import checked_plan_text

_PATIENCE = 2.0
"""Time after which the command tells what takes it so long [s]."""


@contextmanager
def _progress() -> Iterator[Callable[[str], None]]:
    """Give what is called with each thing that is done.

    A terminal shows those that take long.
    """
    told = [Timer(_PATIENCE, print)]

    def report(text: str) -> None:
        told.pop().cancel()
        told.append(
            Timer(_PATIENCE, print, [f"wearsim: {text} ..."], {"file": sys.stderr})
        )
        if sys.stderr.isatty():
            told[0].start()

    try:
        yield report
    finally:
        told.pop().cancel()


def execute(arguments: argparse.Namespace) -> int:
    """Check the scene and print what it would run."""
    scene, _ = load_overridden(arguments)
    with _progress() as report:
        value = check(scene, report=report)
    if arguments.json:
        print_json(value)
        return 0
    if "campaigns" in value:
        texts = [plan_text(part, arguments.all) for part in value["campaigns"]]
    else:
        texts = [checked_plan_text(value, arguments.all)]
    print("\n\n".join([verdict_text(value), *texts]))
    if not arguments.all:
        print("more: --all, --json")
    return 0
