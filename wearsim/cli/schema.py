"""`wearsim schema`: JSON schema of the scene file."""

from __future__ import annotations

import argparse

from wearsim.cli import Commands, add_command


def add_parser(commands: Commands) -> None:
    """Add the command."""
    parser = add_command(
        commands,
        "schema",
        "print the JSON schema of scene files, for editors",
        "wearsim schema > scene.schema.json",
    )
    parser.add_argument("--json", action="store_true", help="accepted for uniformity; the schema is JSON")


def execute(arguments: argparse.Namespace) -> int:  # noqa: ARG001  (signature of all commands)
    """Print the schema."""
    import json

    from wearsim.scene import scene_schema

    print(json.dumps(scene_schema(), indent=2))
    return 0
