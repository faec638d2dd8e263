"""`wearsim check`: all faults of a scene, what would be run, or wear by zone."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from threading import Timer

from wearsim.cli import print_json
from wearsim.cli.flags import load_overridden
from wearsim.contact.solve import available_cores
from wearsim.errors import Fault, SceneError, raise_any
from wearsim.scene import Scene, SweepScene
from wearsim.studies.check import check
from wearsim.studies.plan import plan_text, verdict_text
from wearsim.studies.sweep import checked_plan_text
from wearsim.studies.zone_errors import zone_errors, zone_lines

_PATIENCE = 2.0
"""Time after which the command tells what takes it so long [s]."""


@contextmanager
def _progress() -> Iterator[Callable[[str], None]]:
    """Give what is called with each thing that is done.

    A terminal shows those that take long.
    """
    timers = [Timer(_PATIENCE, print)]

    def report(text: str) -> None:
        timers.pop().cancel()
        timers.append(
            Timer(_PATIENCE, print, [f"wearsim: {text} ..."], {"file": sys.stderr})
        )
        if sys.stderr.isatty():
            timers[0].start()

    try:
        yield report
    finally:
        timers.pop().cancel()


def execute(arguments: argparse.Namespace) -> int:
    """Check the scene and print what it would run."""
    scene, _ = load_overridden(arguments)
    if arguments.zones:
        return _zones(scene, arguments)
    if arguments.error:
        raise SceneError([Fault("--error is for --zones; add that", "--error")])
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


def _zones(scene: Scene, arguments: argparse.Namespace) -> int:
    """Print which block wears which zone, and how sure that is."""
    if isinstance(scene, SweepScene):
        text = f"--zones is for campaigns; this scene is of kind {scene.scene.kind}"
        raise SceneError([Fault(text, str(scene.origin.path))])
    errors = _errors(arguments.error)
    tables = {
        prefix.removesuffix(".") or part.scene.kind: zone_errors(
            part, errors, threads=available_cores()
        )
        for prefix, part in scene.prefixed.items()
    }
    if arguments.json:
        print_json({kind: table.to_dict("records") for kind, table in tables.items()})
        return 0
    for kind, table in tables.items():
        print(f"{kind}, wheels of the scene:")
        print(*zone_lines(table, errors, arguments.all), sep="\n")
    return 0


def _errors(texts: Sequence[str]) -> dict[str, float]:
    """Errors of set-points of `--error` flags, KEY=VALUE each."""
    errors, faults = {}, []
    for text in texts:
        key, _, value = (part.strip() for part in text.partition("="))
        try:
            errors[key] = float(value)
        except ValueError:
            message = "write KEY=VALUE with a number, such as shift_mm=0.2"
            faults.append(Fault(message, f"--error {text}"))
    raise_any(faults)
    return errors
