"""Made-up rigs on which `model = "auto"` has to keep its tolerance; as a program it writes a test's table.

Run `python tests/campaign/auto_scenes.py` (minutes; with a tolerance behind, the rows of that one alone, on
standard output). The seed is not that of the collectives on which the margin of the choice was found.
"""

import csv
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from wearsim.campaign import choose
from wearsim.campaign.classes import CLASSES
from wearsim.campaign.evidence import judge
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.scene import build, load_scene

TABLE = Path(__file__).parents[1] / "data" / "auto_tolerance.csv"
POINTS = 24
SCENES = {0.1: range(30), 0.05: range(30, 50)}  # numbers by tolerance
COLUMNS = (
    "scene",
    "tolerance",
    "alone",
    "alone_cost",
    "alone_whole",
    *CLASSES,
    "points",
    "cost",
    "sample",
    "whole",
)


def tolerance_of(number):
    """Tolerance of a scene."""
    return next(tolerance for tolerance, numbers in SCENES.items() if number in numbers)


def scene(number):
    """Text of a rig scene: any standard wheel and rail, roller, and a collective around some mean shift."""
    random = np.random.default_rng([2026, number])
    mean, spread = random.uniform(-2.0, 2.0), random.uniform(0.5, 2.0)
    text = f"""[scene]
kind = "rig"
[wheelset]
profile = "{random.choice(["S1002", "EPS", "P8", "1in40"])}"
radius_mm = {random.uniform(350.0, 500.0):.0f}
[counterface]
profile = "{random.choice(["60E1", "54E1", "60E2"])}"
inclination = "{random.choice(["1:20", "1:40"])}"
gauge_mm = {random.uniform(1430.0, 1440.0):.0f}
roller_radius_mm = {10.0 ** random.uniform(2.6, 3.6):.0f}
[contact]
model = "auto"
tolerance = {tolerance_of(number)}
[campaign]
distance_km = 10
"""
    for point in range(POINTS):
        text += f"""[[operation.block]]
name = "{point}"
shift_mm = {np.clip(random.normal(mean, spread), -5.0, 5.0):.3f}
yaw_mrad = {random.normal(0.0, 2.0):.3f}
load_kN = {random.uniform(50.0, 120.0):.1f}
speed_km_h = 72
friction = {random.uniform(0.1, 0.5):.2f}
distance_km = 1
"""
    return text


def outcome(number, folder):
    """Row of the table: what is chosen, its cost, its error on the sample and on the whole collective.

    Beside it the one combination that all points would have.
    """
    path = Path(folder) / "rig.toml"
    path.write_text(scene(number))
    setup = build(load_scene(path))
    state, _ = WheelsetEvolution(replace(setup, tolerance=None)).start()
    verdict = choose.choice(setup, state, threads=2)
    alone, chosen = verdict.evidence[-1], verdict.choice
    candidates = choose.candidates(setup.models)
    judged = judge(
        [alone.models, choose.models_of(setup.models, chosen)],
        candidates[-1],
        state,
        setup.points,
        setup.wheelset,
        setup.counterface,
        setup.wear,
        smoothing_wavelength=setup.control.smoothing_wavelength,
        threads=2,
    )
    whole_alone, whole = (one.depth_error for one in judged)
    return {
        "scene": number,
        "tolerance": tolerance_of(number),
        "alone": choose.named(alone.models),
        "alone_cost": choose.COST_ORDER[candidates.index(alone.models)][3],
        "alone_whole": f"{whole_alone:.4f}",
        **{name: choose.named(candidates[k]) for name, k in zip(CLASSES, chosen.models, strict=True)},
        "points": " ".join(map(str, verdict.points)),
        "cost": f"{verdict.cost:.1f}",
        "sample": f"{chosen.error:.4f}",
        "whole": f"{whole:.4f}",
    }


if __name__ == "__main__":
    import tempfile

    wanted = [float(text) for text in sys.argv[1:]] or list(SCENES)
    with open(TABLE, "w", newline="") if len(sys.argv) == 1 else sys.stdout as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        for scene_number in (number for tolerance in wanted for number in SCENES[tolerance]):
            with tempfile.TemporaryDirectory() as scratch:
                row = outcome(scene_number, scratch)
            writer.writerow(row)
            file.flush()
            sys.stderr.write(f"{row}\n")
