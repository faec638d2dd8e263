"""`wearsim schema`: JSON schema of the scene file, or its reference for people."""

from __future__ import annotations

import argparse
import json
import sys

from wearsim.scene.reference import scene_reference, scene_schema


def execute(arguments: argparse.Namespace) -> int:
    """Print the schema or the reference."""
    if arguments.markdown:
        sys.stdout.write(scene_reference())
    else:
        print(json.dumps(scene_schema(), indent=2))
    return 0
