"""`wearsim chart`: speed against accuracy of the contact models."""

from __future__ import annotations

import argparse
import math
from typing import Any

from wearsim.cli.flags import whole

SUMMARY = "time every combination of contact models here and compare its wear with a half-space solution"
EXAMPLES = "wearsim chart --out reports\nwearsim chart my_scene.toml --grids 20,40 --json"


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the flags."""
    parser.add_argument(
        "scene", metavar="SCENE", nargs="?", default="workflows/rig_vs_field.toml",
        help="scene file of a campaign or comparison (default workflows/rig_vs_field.toml)",
    )  # fmt: skip
    parser.add_argument(
        "--grids", metavar="N,N,...", default="20,30,50", help="strips and cells (default 20,30,50)"
    )
    parser.add_argument("--reference-grid", metavar="N", default="60", help="of the half-space (default 60)")
    parser.add_argument(
        "--points",
        metavar="N",
        default="40",
        help="operating points per scene, at most; but one of each class of operating points (default 40)",
    )
    parser.add_argument(
        "--out", metavar="DIR", default="reports", help="folder of the report (default reports)"
    )
    parser.add_argument("--json", action="store_true", help="print JSON instead of writing a report")


def execute(arguments: argparse.Namespace) -> int:
    """Measure and write."""
    import json
    import sys
    from pathlib import Path

    from wearsim.errors import Fault, SceneError

    grids, reference, points, faults = _numbers(arguments)
    if faults:
        raise SceneError([Fault(fault) for fault in faults])
    from wearsim.report.chart import write_chart
    from wearsim.scene import build
    from wearsim.scene.read import load_campaign
    from wearsim.studies.chart import speed_and_accuracy

    scene = load_campaign(arguments.scene)
    dataset = speed_and_accuracy(
        [build(part) for part in scene.parts], grids, reference, points=points,
        report=lambda line: print(line, file=sys.stderr),
    )  # fmt: skip
    if arguments.json:
        print(json.dumps(_json(dataset), indent=2))
        return 0
    print(f"report: {write_chart(dataset, Path(arguments.out), 'speed_accuracy', arguments.command_line)}")
    return 0


def _numbers(arguments: argparse.Namespace) -> tuple[list[int], int, int, list[str]]:
    """Numbers of the flags, and all that is wrong with them."""
    faults: list[str] = []

    def number(flag: str, text: str, low: int, high: int) -> int:
        try:
            return whole(low, high, text)
        except argparse.ArgumentTypeError as error:
            faults.append(f"--{flag} = {error}")
            return 0

    grids = [number("grids", text.strip(), 5, 200) for text in arguments.grids.split(",")]
    reference = number("reference-grid", arguments.reference_grid, 10, 400)
    if not faults and reference < max(grids):
        faults.append(f"--reference-grid = {reference} must be at least the finest of --grids, {max(grids)}")
    points = number("points", arguments.points, 1, 500)
    return sorted(set(grids)), reference, points, faults


def _json(dataset: Any) -> dict[str, Any]:
    """JSON value, SI units; null where there is no solution."""

    def plain(value: Any) -> Any:
        return None if isinstance(value, float) and not math.isfinite(value) else value

    of_model = ("normal", "tangential", "grid", "can_update_profile", "time", "worst_depth_error", "pareto")
    of_scene = ("scene", "depth_error", "work_error", "power_error", "refusal")
    models = []
    for k in range(dataset.sizes["model"]):
        one = dataset.isel(model=k)
        scenes = zip(*(one[name].values.tolist() for name in of_scene), strict=True)
        entry = {name: plain(one[name].item()) for name in of_model}
        entry["scenes"] = [dict(zip(of_scene, map(plain, values), strict=True)) for values in scenes]
        models.append(entry)
    return {"reference": dataset.attrs["reference"], "models": models}
