"""`wearsim run`: a campaign, or a comparison of two, from a scene file to the report."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from wearsim.campaign.run import run_scene
from wearsim.cli.flags import load_overridden
from wearsim.cli.progress import case_lines, observer, workers
from wearsim.cli.report import print_warnings, reported, write_report
from wearsim.cli.sweep import run_all
from wearsim.errors import Fault, SceneError
from wearsim.scene import SweepScene
from wearsim.scene.overrides import Override
from wearsim.studies.bands import FOLDER, plan_of, run_bands, text_of
from wearsim.studies.ensemble import check_cases, running_text
from wearsim.studies.sweep import sweep_of


def execute(arguments: argparse.Namespace) -> int:
    """Run the scene; a directory in which it runs already is continued."""
    scene, overrides = load_overridden(arguments)
    out = Path(arguments.out or Path(arguments.scene).stem)
    if isinstance(scene, SweepScene):
        if arguments.bands:
            message = f"--bands is for campaigns; this scene is of kind {scene.scene.kind}"
            raise SceneError([Fault(message, str(scene.origin.path))])
        return run_all(sweep_of(scene), out, arguments)
    if arguments.bands:
        check_cases(plan_of(scene.origin.path, overrides).cases(0, 1))  # faults before anything is run
        with workers(arguments.cluster, lambda: ""):
            pass  # a scheduler that does not answer is one, too
    with reported(out), observer() as observe:
        results = run_scene(
            arguments.scene, out, command=arguments.command_line, observer=observe, overrides=overrides,
            warn=lambda warning: print(f"warning: {warning}", file=sys.stderr),
        )  # fmt: skip
    loaded = print_warnings(results)
    if arguments.bands:
        _bands(arguments, out, scene.origin.path, overrides)
    print(f"report: {write_report(out, loaded)}")
    return 0


def _bands(arguments: argparse.Namespace, out: Path, scene: Path, overrides: Sequence[Override]) -> None:
    with workers(arguments.cluster, lambda: running_text(out / FOLDER)) as executor:
        made = run_bands(
            scene, out, executor, overrides=overrides, jobs=arguments.jobs, command=arguments.command_line,
            report=case_lines("draw"),
        )  # fmt: skip
    print(text_of(*made))
