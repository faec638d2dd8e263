"""`wearsim chart`: speed against accuracy of the contact models."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from wearsim.cli import print_json
from wearsim.report.html import render_chart
from wearsim.scene import build
from wearsim.scene.read import load_campaign
from wearsim.studies import chart
from wearsim.whole_files import write_whole


def execute(arguments: argparse.Namespace) -> int:
    """Measure and print."""
    scene = load_campaign(arguments.scene)
    table = chart.speed_and_accuracy(
        [build(part) for part in scene.parts],
        1e-6 * arguments.depth_um,
        report=lambda line: print(line, file=sys.stderr),
    )
    columns: dict[str, Any] = {
        "one solution [ms]": 1e3 * table["time_per_solution"],
        "campaign [s]": table["time"],
        "of half-space": table["time_ratio"],
        "steps": table["steps"],
        "largest error [%]": 100.0 * table["depth_error"],
        "front": ["yes" if front else "" for front in table["pareto"]],
    }
    shown = table[["scene", "models"]].assign(**columns)
    if arguments.report:
        write_whole(Path(arguments.report), render_chart(table, shown))
    if arguments.json:
        print_json({"models": table.to_dict("records")})
        return 0
    print(
        "largest difference of wear depth along both profiles and the distance, over "
        "the largest depth"
    )
    print(
        shown.to_string(
            index=False, na_rep="-", float_format=lambda value: f"{value:.3g}"
        )
    )
    for row in table[table["refusal"] != ""].itertuples():
        print(f"{row.scene}, {row.models}: no solution, {row.refusal}")
    return 0
