"""`wearsim run`: a campaign, or two compared, from a scene file to the report."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from wearsim.campaign.directory import read_status
from wearsim.campaign.run import run_scene
from wearsim.cli import print_json
from wearsim.cli.compare import table_lines
from wearsim.cli.flags import STDIN, load_overridden
from wearsim.cli.progress import observer, runner
from wearsim.cli.report import print_warnings, reported, write_report
from wearsim.cli.streams import print_warning
from wearsim.cli.sweep import run_all
from wearsim.errors import Fault, SceneError
from wearsim.results import result_warnings
from wearsim.scene import PairScene, SweepScene
from wearsim.scene.overrides import Override
from wearsim.scene.read import of_part
from wearsim.studies.bands import FOLDER, plan_of, run_bands, text_of
from wearsim.studies.ensemble import check_cases
from wearsim.studies.pair import TABLE, compared, run_pair
from wearsim.studies.sweep import sweep_of
from wearsim.whole_files import write_whole


def execute(arguments: argparse.Namespace) -> int:
    """Run the scene; a directory in which it runs already is continued."""
    scene, overrides = load_overridden(arguments)
    if arguments.scene == STDIN and arguments.out is None:
        raise SceneError([Fault("a scene from stdin has no name; give --out DIR")])
    out = Path(arguments.out or Path(arguments.scene).stem)
    if arguments.posterior is not None and not arguments.bands:
        raise SceneError(
            [Fault("--posterior is for the draws of --bands; add --bands")]
        )
    if isinstance(scene, SweepScene):
        if arguments.bands:
            message = (
                f"--bands is for campaigns; this scene is of kind {scene.scene.kind}"
            )
            raise SceneError([Fault(message, str(scene.origin.path))])
        return run_all(sweep_of(scene), out, arguments)
    if isinstance(scene, PairScene):
        return _pair(scene, out, arguments, overrides)
    if arguments.bands:
        if arguments.scene == STDIN:
            raise SceneError(
                [
                    Fault(
                        "--bands reads the scene again for each draw; give a file, "
                        "not stdin"
                    )
                ]
            )
        check_cases(
            plan_of(scene.origin.path, overrides, arguments.posterior).cases(0, 1)
        )  # faults before anything is run
        with runner(arguments, "draw", out / FOLDER):
            pass  # a scheduler that does not answer is one, too
    with reported(out), observer(quiet=arguments.quiet) as observe:
        results = run_scene(
            scene,
            out,
            command=arguments.command_line,
            observer=observe,
            warn=print_warning,
        )
    loaded = print_warnings(results)
    if arguments.bands:
        _bands(arguments, out, scene.origin.path, overrides)
    report = write_report(out, loaded)
    if arguments.json:
        warnings = {
            path.stem: result_warnings(dataset) for path, dataset in loaded.items()
        }
        files = {path.stem: str(path) for path in results}
        ends = read_status(out).get("campaigns", {})
        print_json(
            {
                "results": files,
                "report": str(report),
                "warnings": warnings,
                "campaigns": ends,
            }
        )
    else:
        print(f"report: {report}")
    return 0


def _pair(
    scene: PairScene,
    out: Path,
    arguments: argparse.Namespace,
    overrides: Sequence[Override],
) -> int:
    """Run two campaigns of one kind and print them side by side."""
    drawn = {
        name: (part.origin.path, of_part(overrides, name, tuple(scene.pair)))
        for name, part in scene.pair.items()
        if arguments.bands
    }
    for base, campaign_overrides in drawn.values():  # faults before anything is run
        check_cases(plan_of(base, campaign_overrides, arguments.posterior).cases(0, 1))
    with observer(quiet=arguments.quiet) as observe:
        paths = run_pair(
            scene,
            out,
            command=arguments.command_line,
            observer=observe,
            warn=print_warning,
        )
    for name, (base, campaign_overrides) in drawn.items():
        folder = paths[name].parent
        with runner(arguments, f"{name} draw", folder / FOLDER) as run:
            run_bands(
                base,
                folder,
                run,
                overrides=campaign_overrides,
                posterior=arguments.posterior,
            )
    table = compared(paths)
    write_whole(out / TABLE, table.to_csv(index=False))
    read = {name: print_warnings([path], name) for name, path in paths.items()}
    reports = {
        name: str(write_report(path.parent, read[name])) for name, path in paths.items()
    }
    every = {path: data for results in read.values() for path, data in results.items()}
    page = write_report(out, every, side_by_side=table)
    if arguments.json:
        files = {name: str(path) for name, path in paths.items()}
        print_json(
            {
                "results": files,
                "report": str(page),
                "reports": reports,
                "comparison": table.to_dict("records"),
            }
        )
        return 0
    print(*table_lines(table), sep="\n")
    print(f"report: {page}; of each: {', '.join(reports.values())}")
    return 0


def _bands(
    arguments: argparse.Namespace, out: Path, scene: Path, overrides: Sequence[Override]
) -> None:
    with runner(arguments, "draw", out / FOLDER) as run:
        made = run_bands(
            scene, out, run, overrides=overrides, posterior=arguments.posterior
        )
    print(text_of(*made), file=sys.stderr if arguments.json else sys.stdout)
