"""`wearsim schema`: JSON schema of the scene file, or its reference for people."""

from __future__ import annotations

import argparse

SUMMARY = "print the JSON schema of scene files, for editors, or the reference of their keys"
EXAMPLES = "wearsim schema > scene.schema.json\nwearsim schema --markdown > reference.md"


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the flags."""
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--json", action="store_true", help="accepted for uniformity; the schema is JSON")
    form.add_argument(
        "--markdown", action="store_true", help="every key with unit, values, default and meaning"
    )


def execute(arguments: argparse.Namespace) -> int:
    """Print the schema or the reference."""
    import json
    import sys

    from wearsim.scene import scene_schema
    from wearsim.scene.reference import scene_reference

    if arguments.markdown:
        sys.stdout.write(scene_reference())
    else:
        print(json.dumps(scene_schema(), indent=2))
    return 0
