"""`wearsim chart`: speed against accuracy of the contact models."""

from __future__ import annotations

import argparse
import sys
from functools import partial

from wearsim.cli import print_json
from wearsim.cli.flags import whole

SUMMARY = "time every combination of contact models here and compare its wear with a half-space solution"
EXAMPLES = "wearsim chart --points 10\nwearsim chart my_scene.toml --grids 20,40 --json"


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the flags."""
    parser.add_argument(
        "scene", metavar="SCENE", nargs="?", default="workflows/rig_vs_field.toml",
        help="scene file of a campaign or comparison (default workflows/rig_vs_field.toml)",
    )  # fmt: skip
    parser.add_argument(
        "--grids", metavar="N,N,...", type=_grids, default=[20, 30, 50],
        help="strips and cells (default 20,30,50)",
    )  # fmt: skip
    parser.add_argument(
        "--reference-grid", metavar="N", type=partial(whole, 10, 400), default=60,
        help="of the half-space (default 60)",
    )  # fmt: skip
    parser.add_argument(
        "--points", metavar="N", type=partial(whole, 1, 500), default=40,
        help="operating points per scene, at most; but one of each class of operating points (default 40)",
    )  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print JSON")


def _grids(text: str) -> list[int]:
    return sorted({whole(5, 200, part.strip()) for part in text.split(",")})


def execute(arguments: argparse.Namespace) -> int:
    """Measure and print."""
    from wearsim.errors import Fault, SceneError
    from wearsim.scene import build
    from wearsim.scene.read import load_campaign
    from wearsim.studies.chart import ERRORS, MODEL, speed_and_accuracy, worst_scene

    finest = max(arguments.grids)
    if arguments.reference_grid < finest:
        flag = f"--reference-grid = {arguments.reference_grid}"
        raise SceneError([Fault(f"{flag} must be at least the finest of --grids, {finest}")])
    scene = load_campaign(arguments.scene)
    table = speed_and_accuracy(
        [build(part) for part in scene.parts], arguments.grids, arguments.reference_grid,
        points=arguments.points, report=lambda line: print(line, file=sys.stderr),
    )  # fmt: skip
    if arguments.json:
        whole_table = table.astype(object).where(table.notna(), None)
        print_json({**table.attrs, "models": whole_table.to_dict("records")}, allow_nan=False)
        return 0
    worst = worst_scene(table).sort_values("time")
    shown = worst[MODEL].assign(**{"time [ms]": 1e3 * worst["time"]})
    for name in ERRORS:
        shown[f"{name.replace('_', ' ')} [%]"] = 100.0 * worst[name]
    shown["Pareto"] = ["yes" if front else "" for front in table["pareto"][worst.index]]
    print(f"largest errors of any scene, against {table.attrs['reference']}")
    print(shown.to_string(index=False, na_rep="refused", float_format=lambda value: f"{value:.3g}"))
    return 0
