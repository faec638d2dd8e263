"""`wearsim chart`: speed against accuracy of the contact models."""

from __future__ import annotations

import argparse
import sys
from functools import partial
from pathlib import Path
from typing import Any

from wearsim.cli import print_json
from wearsim.cli.flags import decimal

SUMMARY = (
    "run short campaigns with every combination of contact models, compare their wear with a half-space's"
)
EXAMPLES = "wearsim chart --depth-um 30\nwearsim chart my_scene.toml --tolerances 5,2 --report chart.html"


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the flags."""
    parser.add_argument(
        "scene", metavar="SCENE", nargs="?", default="workflows/rig_vs_field.toml",
        help="scene file of a campaign or comparison (default workflows/rig_vs_field.toml)",
    )  # fmt: skip
    parser.add_argument(
        "--depth-um", metavar="D", type=partial(decimal, 0.5, 5000), default=60.0,
        help="largest wear depth at the end of the campaigns, by the half-space (default 60)",
    )  # fmt: skip
    parser.add_argument(
        "--tolerances", metavar="T,T,...", type=_tolerances, default=[10.0, 5.0, 3.0, 2.0],
        help="of model = \"auto\", in per cent (default 10,5,3,2)",
    )  # fmt: skip
    parser.add_argument("--report", metavar="FILE", help="also write a page with figure and table (.html)")
    parser.add_argument("--json", action="store_true", help="print JSON")


def _tolerances(text: str) -> list[float]:
    return [decimal(0.01, 100, part.strip()) for part in text.split(",")]


def execute(arguments: argparse.Namespace) -> int:
    """Measure and print."""
    from wearsim.report.sweep import render_chart
    from wearsim.scene import build
    from wearsim.scene.read import load_campaign
    from wearsim.studies.chart import speed_and_accuracy
    from wearsim.whole_files import write_whole

    scene = load_campaign(arguments.scene)
    table = speed_and_accuracy(
        [build(part) for part in scene.parts], 1e-6 * arguments.depth_um,
        [0.01 * one for one in arguments.tolerances], report=lambda line: print(line, file=sys.stderr),
    )  # fmt: skip
    columns: dict[str, Any] = {
            "one solution [ms]": 1e3 * table["time_per_solution"], "campaign [s]": table["time"],
            "of half-space": table["time_ratio"], "steps": table["steps"],
            "largest error [%]": 100.0 * table["depth_error"],
            "front": ["yes" if front else "" for front in table["pareto"]],
    }  # fmt: skip
    shown = table[["scene", "models"]].assign(**columns)
    if arguments.report:
        write_whole(Path(arguments.report), render_chart(table, shown))
    if arguments.json:
        print_json(
            {"models": table.astype(object).where(table.notna(), None).to_dict("records")}, allow_nan=False
        )
        return 0
    print("largest difference of wear depth along both profiles and the distance, over the largest depth")
    print(shown.to_string(index=False, na_rep="-", float_format=lambda value: f"{value:.3g}"))
    for row in table[table["refusal"] != ""].itertuples():
        print(f"{row.scene}, {row.models}: no solution, {row.refusal}")
    return 0
