"""`wearsim sweep`: many campaigns, from a sweep file or from one scene and the keys to vary."""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path

from wearsim.cli.flags import whole

SUMMARY = "run many campaigns, each resumable by itself, and write one table of them"
EXAMPLES = (
    "wearsim sweep workflows/sweep_rig.toml --out out\n"
    "wearsim sweep rig.toml --vary wheelset.radius_mm=420,460 --vary wear.form=local,patch_mean\n"
    "wearsim sweep cases.toml --out out --case $SLURM_ARRAY_TASK_ID"
)


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the flags."""
    parser.add_argument("scene", metavar="SCENE", help='sweep file (kind = "sweep"), or a scene to vary')
    parser.add_argument(
        "--out", metavar="DIR", help="directory of the sweep (default: the file's name without .toml)"
    )
    parser.add_argument(
        "--vary",
        metavar="KEY=VALUE,...",
        action="append",
        default=[],
        help="vary a key of the scene; given several times, every value with every other; an empty value "
        "removes the key, so that its default applies",
    )
    parser.add_argument("--table", metavar="CSV", help="cases of the scene, with columns named section.key")
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--case", metavar="K", type=int, help="run case K only, counted from 1 (job arrays)")
    what.add_argument("--list", action="store_true", help="show and check the cases; run nothing")
    parser.add_argument(
        "--jobs", metavar="N", type=partial(whole, 1, 1024), help="processes (default: one per core)"
    )
    parser.add_argument("--json", action="store_true", help="print JSON")


def execute(arguments: argparse.Namespace) -> int:
    """Check all cases, then run or list them."""
    from wearsim.cli import sweep_run
    from wearsim.errors import Fault, SceneError
    from wearsim.scene import SweepScene, load_scene
    from wearsim.scene.sweep import sweep_of_flags
    from wearsim.studies.sweep import sweep_of

    scene = load_scene(arguments.scene)
    if not isinstance(scene, SweepScene):
        sweep = sweep_of_flags(arguments.scene, arguments.vary, arguments.table)
    elif arguments.vary or arguments.table:
        message = "a sweep file states itself what is varied; leave --vary and --table out"
        raise SceneError([Fault(message, arguments.scene)])
    else:
        sweep = sweep_of(scene)
    out = Path(arguments.out or Path(arguments.scene).stem)
    command, as_json = arguments.command_line, arguments.json
    if arguments.list:
        return sweep_run.list_cases(sweep, out, as_json)
    if arguments.case is not None:
        return sweep_run.run_case(sweep, arguments.case, out, command, as_json)
    return sweep_run.run_all(sweep, out, arguments.jobs, command, as_json)
