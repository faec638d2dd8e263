"""`wearsim run`: a campaign, or a comparison of two, from a scene file to the report."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from wearsim.cli.flags import add_override_flags, add_worker_flags, load_overridden
from wearsim.cli.progress import case_lines, observer, workers
from wearsim.cli.report import print_warnings, reported

if TYPE_CHECKING:
    from wearsim.scene.overrides import Override

SUMMARY = "run the campaign or comparison of a scene file and write its report"
EXAMPLES = (
    "wearsim run workflows/rig_vs_field.toml --out out\n"
    "wearsim run workflows/rig_given.toml --smoothing half --set contact.tolerance=0.015 --out half\n"
    "wearsim run workflows/uncertainty.toml --bands --out bands"
)


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the flags."""
    parser.add_argument("scene", metavar="SCENE", help="scene file (TOML)")
    parser.add_argument(
        "--out", metavar="DIR", help="run directory (default: the scene file's name without .toml)"
    )
    add_override_flags(parser)
    parser.add_argument(
        "--bands", action="store_true",
        help="also run the draws of [uncertainty] and report the bands that they leave to wear and factors",
    )  # fmt: skip
    add_worker_flags(parser, "the draws of --bands, or the cases of a sweep,")


def execute(arguments: argparse.Namespace) -> int:
    """Run the scene; a directory in which it runs already is continued."""
    from wearsim.campaign.run import run_scene
    from wearsim.errors import Fault, SceneError
    from wearsim.report.html import write_report
    from wearsim.scene import SweepScene

    scene, overrides = load_overridden(arguments)
    out = Path(arguments.out or Path(arguments.scene).stem)
    if isinstance(scene, SweepScene):
        if arguments.bands:
            message = f"--bands is for campaigns; this scene is of kind {scene.scene.kind}"
            raise SceneError([Fault(message, str(scene.origin.path))])
        from wearsim.cli.sweep import run_all
        from wearsim.studies.sweep import sweep_of

        return run_all(sweep_of(scene), out, arguments)
    if arguments.bands:
        from wearsim.studies.bands import plan_of
        from wearsim.studies.ensemble import check_cases

        check_cases(plan_of(scene.origin.path, overrides).cases(0, 1))  # faults before anything is run
        with workers(arguments.cluster, lambda: ""):
            pass  # a scheduler that does not answer is one, too
    with reported(out), observer() as observe:
        results = run_scene(
            arguments.scene, out, command=arguments.command_line, observer=observe, overrides=overrides,
            warn=lambda warning: print(f"warning: {warning}", file=sys.stderr),
        )  # fmt: skip
    print_warnings(results)
    if arguments.bands:
        _bands(arguments, out, scene.origin.path, overrides)
    print(f"report: {write_report(out)}")
    return 0


def _bands(arguments: argparse.Namespace, out: Path, scene: Path, overrides: Sequence[Override]) -> None:
    from wearsim.studies.bands import FOLDER, run_bands, text_of
    from wearsim.studies.ensemble import running_text

    with workers(arguments.cluster, lambda: running_text(out / FOLDER)) as executor:
        made = run_bands(
            scene, out, executor, overrides=overrides, jobs=arguments.jobs, command=arguments.command_line,
            report=case_lines("draw"),
        )  # fmt: skip
    print(text_of(*made))
