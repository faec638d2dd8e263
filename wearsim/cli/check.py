"""`wearsim check`: all faults of a scene, or what would be run."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Timer
from typing import Any

from wearsim.cli import print_json
from wearsim.cli.flags import load_overridden
from wearsim.scene import SweepScene, prepare
from wearsim.scene.initial_contact import check_contact
from wearsim.studies.plan import plan, plan_text
from wearsim.studies.sweep import checked_plan, checked_plan_text

_PATIENCE = 2.0
"""Time after which the command tells what takes it so long [s]."""


@contextmanager
def _progress() -> Iterator[Callable[[str], None]]:
    """Give what is called with each thing that is done; a terminal shows those that take long."""
    told = [Timer(_PATIENCE, print)]

    def report(text: str) -> None:
        told.pop().cancel()
        told.append(Timer(_PATIENCE, print, [f"wearsim: {text} ..."], {"file": sys.stderr}))
        if sys.stderr.isatty():
            told[0].start()

    try:
        yield report
    finally:
        told.pop().cancel()


def execute(arguments: argparse.Namespace) -> int:
    """Check the scene and print what it would run."""
    scene, _ = load_overridden(arguments)
    value: dict[str, Any]
    if isinstance(scene, SweepScene):
        value = checked_plan(scene)
        texts = [checked_plan_text(value)]
    else:
        with _progress() as report:
            report("where the wheelset runs")
            prepared = [prepare(part) for part in scene.parts]
            report("initial contact")
            warnings = check_contact(scene, prepared=prepared)
            plans = []
            for part, known in zip(scene.parts, prepared, strict=True):
                own = [item for item in warnings if item.file == str(part.origin.path)]
                plans.append(plan(part, known, own, report=report))
        value, texts = {"campaigns": plans}, [plan_text(item) for item in plans]
    kind = scene.scene.kind
    if arguments.json:
        print_json({"scene": str(scene.origin.path), "kind": kind, **value})
    else:
        print("\n\n".join([f"{scene.origin.path}: no faults ({kind})", *texts]))
    return 0
