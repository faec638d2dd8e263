"""`wearsim check`: all faults of a scene, or what would be run."""

from __future__ import annotations

import argparse
from typing import Any

from wearsim.cli import print_json
from wearsim.cli.flags import load_overridden
from wearsim.scene import SweepScene, prepare
from wearsim.scene.initial_contact import check_contact
from wearsim.studies.plan import plan, plan_text
from wearsim.studies.sweep import checked_plan, checked_plan_text


def execute(arguments: argparse.Namespace) -> int:
    """Check the scene and print what it would run."""
    scene, _ = load_overridden(arguments)
    value: dict[str, Any]
    if isinstance(scene, SweepScene):
        value = checked_plan(scene)
        texts = [checked_plan_text(value)]
    else:
        prepared = [prepare(part) for part in scene.parts]
        warnings = check_contact(scene, prepared=prepared)
        plans = [
            plan(part, known, [item for item in warnings if item.file == str(part.origin.path)])
            for part, known in zip(scene.parts, prepared, strict=True)
        ]
        value, texts = {"campaigns": plans}, [plan_text(item) for item in plans]
    kind = scene.scene.kind
    if arguments.json:
        print_json({"scene": str(scene.origin.path), "kind": kind, **value})
    else:
        print("\n\n".join([f"{scene.origin.path}: no faults ({kind})", *texts]))
    return 0
