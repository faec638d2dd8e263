"""`wearsim run`: a campaign, or a comparison of two, from a scene file to the report."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from wearsim.cli.flags import add_override_flags, load_overridden, whole
from wearsim.cli.progress import observer
from wearsim.cli.report import print_warnings, reported

if TYPE_CHECKING:
    from wearsim.scene.overrides import Override


SUMMARY = "run the campaign or comparison of a scene file and write its report"
EXAMPLES = (
    "wearsim run workflows/rig_vs_field.toml --out out\n"
    "wearsim run workflows/rig.toml --smoothing half --set campaign.error_tolerance_um=0.5 --out half\n"
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
        "--converge",
        metavar="KM",
        nargs="?",
        const="all",
        type=_kilometres,
        help="also run with refined step, grid, smoothing and operating points, one at a time and together, "
        "over the whole distance or over KM of it; the table goes into the report",
    )
    parser.add_argument(
        "--against",
        metavar="NORMAL+TANGENTIAL",
        action="append",
        default=[],
        type=_models,
        help="also run with these contact models, such as half_space+half_space, and report in the same "
        "table how far the end differs; with --converge KM over that distance; can be repeated",
    )
    parser.add_argument(
        "--bands",
        action="store_true",
        help="also run the draws of [uncertainty] and report the bands that they leave to wear and factors",
    )
    parser.add_argument(
        "--jobs", type=partial(whole, 1, 4096), metavar="N",
        help="processes for the draws of --bands (default: as many as cores)",
    )  # fmt: skip


def _models(text: str) -> tuple[str, str]:
    from wearsim.contact.normal import NORMAL_MODELS
    from wearsim.contact.tangential import TANGENTIAL_MODELS

    normal, plus, tangential = text.partition("+")
    usable = [name for name, model in NORMAL_MODELS.items() if model.can_update_profile]
    if not plus or normal not in usable or tangential not in TANGENTIAL_MODELS:
        pair = f"one of {', '.join(usable)}, a plus sign, and one of {', '.join(TANGENTIAL_MODELS)}"
        raise argparse.ArgumentTypeError(f"{text} must be {pair}")
    return normal, tangential


def _kilometres(text: str) -> float | str:
    try:
        distance = float(text)
    except ValueError:
        distance = math.nan
    if text != "all" and not 0.0 < distance <= 1e7:
        raise argparse.ArgumentTypeError(f"{text} must be a distance above 0 and at most 10000000 km")
    return text if text == "all" else distance


def execute(arguments: argparse.Namespace) -> int:
    """Run the scene; a directory in which it runs already is continued."""
    from wearsim.campaign.run import run_scene
    from wearsim.errors import Fault, SceneError
    from wearsim.report.html import write_report
    from wearsim.scene import SweepScene

    scene, overrides = load_overridden(arguments)
    out = Path(arguments.out or Path(arguments.scene).stem)
    if isinstance(scene, SweepScene):
        if arguments.converge or arguments.against or arguments.bands:
            given = (("--converge", arguments.converge), ("--against", arguments.against))
            flag = next((name for name, value in given if value), "--bands")
            message = f"{flag} is for campaigns; this scene is of kind {scene.scene.kind}"
            raise SceneError([Fault(message, str(scene.origin.path))])
        from wearsim.cli.sweep_run import run_all
        from wearsim.studies.sweep import sweep_of

        return run_all(sweep_of(scene), out, None, arguments.command_line, False)
    if arguments.bands:
        from wearsim.studies.bands import plan_of
        from wearsim.studies.ensemble import check_cases

        check_cases(plan_of(scene.origin.path, overrides).cases(0, 1))  # faults before anything is run
    with reported(out), observer() as observe:
        results = run_scene(
            arguments.scene, out, command=arguments.command_line, observer=observe, overrides=overrides,
            warn=lambda warning: print(f"warning: {warning}", file=sys.stderr),
        )  # fmt: skip
    print_warnings(results)
    if arguments.converge or arguments.against:
        _converge(arguments, out, overrides)
    if arguments.bands:
        _bands(arguments, out, scene.origin.path, overrides)
    print(f"report: {write_report(out)}")
    return 0


def _converge(arguments: argparse.Namespace, out: Path, overrides: Sequence[Override]) -> None:
    from wearsim.report.tables_quality import read_convergence
    from wearsim.studies.converge import converge

    distance = None if arguments.converge in (None, "all") else 1e3 * arguments.converge
    against = tuple(dict.fromkeys(arguments.against))
    with observer() as observe:
        converge(
            arguments.scene, out, overrides=overrides, distance=distance, refine=bool(arguments.converge),
            against=against, command=arguments.command_line, observer=observe,
        )  # fmt: skip
    for table in read_convergence(out):
        print(f"{table.title}\n{table.frame.to_string(index=False)}\n")


def _bands(arguments: argparse.Namespace, out: Path, scene: Path, overrides: Sequence[Override]) -> None:
    from wearsim.studies.bands import run_bands, text_of
    from wearsim.studies.ensemble import Outcome

    ended = 0

    def report(count: int, outcome: Outcome) -> None:
        nonlocal ended
        if outcome.state != "running":
            ended += 1
            text = f"draw {outcome.number}: {outcome.state} ({ended} of {count}) {outcome.fault}"
            print(text.rstrip(), file=sys.stderr, flush=True)

    made = run_bands(
        scene, out, overrides=overrides, jobs=arguments.jobs, command=arguments.command_line, report=report
    )
    print(text_of(*made))
