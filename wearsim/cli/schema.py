"""`wearsim schema`: JSON schema of the scene file."""

from __future__ import annotations

import argparse

SUMMARY = "print the JSON schema of scene files, for editors"
EXAMPLES = "wearsim schema > scene.schema.json"


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the flags."""
    parser.add_argument("--json", action="store_true", help="accepted for uniformity; the schema is JSON")


def execute(arguments: argparse.Namespace) -> int:  # noqa: ARG001  (signature of all commands)
    """Print the schema."""
    import json

    from wearsim.scene import scene_schema

    print(json.dumps(scene_schema(), indent=2))
    return 0
