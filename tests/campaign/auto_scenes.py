"""Made-up scenes on which `model = "auto"` has to keep its tolerance; as a program it writes a test's table.

Run `python tests/campaign/auto_scenes.py` (minutes; with numbers of scenes behind, their rows alone, on
standard output). On the rigs below 50 the size of the sample was found; one miss among those below 80 led to
the estimate by a fast model at all points. Those from 80 on were drawn after the last thing was changed.
"""

import csv
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from wearsim.campaign import choose
from wearsim.campaign.choose import CLASSES, judge
from wearsim.campaign.evaluate import setup_of
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.scene import build, load_scene

TABLE = Path(__file__).parents[1] / "data" / "auto_tolerance.csv"
SCENES = (
    *((number, "rig", 24, 0.1) for number in range(30)),
    *((number, "rig", 24, 0.05) for number in range(30, 50)),
    *((number, "rig", 60, 0.05) for number in range(50, 60)),
    *((number, "field", 45, 0.05) for number in range(60, 70)),
    *((number, "rig", 60, 0.1) for number in range(70, 75)),
    *((number, "field", 45, 0.1) for number in range(75, 80)),
    *((number, "rig", 36, 0.05) for number in range(80, 90)),
    *((number, "field", 36, 0.05) for number in range(90, 100)),
    *((number, "rig", 36, 0.1) for number in range(100, 105)),
    *((number, "field", 36, 0.1) for number in range(105, 110)),
)
"""Number, kind, operating points, tolerance."""
UNSEEN = 80
"""Number of the first scene on which nothing was tuned."""
COLUMNS = (
    "scene",
    "kind",
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


def scene(number):
    """Text of a scene: any standard wheel and rail, on a roller or in the field, around some mean shift."""
    _, kind, points, tolerance = SCENES[number]
    random = np.random.default_rng([2026, number])
    mean, spread = random.uniform(-2.0, 2.0), random.uniform(0.5, 2.0)
    text = f"""[scene]
kind = "{kind}"
[wheelset]
profile = "{random.choice(["S1002", "EPS", "P8", "1in40"])}"
radius_mm = {random.uniform(350.0, 500.0):.0f}
[counterface]
profile = "{random.choice(["60E1", "54E1", "60E2"])}"
inclination = "{random.choice(["1:20", "1:40"])}"
gauge_mm = {random.uniform(1430.0, 1440.0):.0f}
"""
    if kind == "rig":
        text += f"roller_radius_mm = {10.0 ** random.uniform(2.6, 3.6):.0f}\n"
    text += f"""[contact]
model = "auto"
tolerance = {tolerance}
[campaign]
distance_km = 10
"""
    return text + (_blocks(random, points, mean, spread) if kind == "rig" else _classes(random, points, mean))


def _blocks(random, points, mean, spread):
    """Blocks of a rig."""
    text = ""
    for point in range(points):
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


def _classes(random, points, mean):
    """Tangent track and curves to either side, in which the wheelset runs outwards with its yaw."""
    text = ""
    for name, side, share in (("tangent", 0.0, 0.5), ("right", -1.0, 0.3), ("left", 1.0, 0.2)):
        curve = 10.0 ** random.uniform(2.6, 3.5)
        spread = random.uniform(0.3, 1.5)
        out = side * random.uniform(1.0, 3.5) if side else 0.3 * mean
        text += f"""[[operation.class]]
name = "{name}"
shift_mean_mm = {out:.3f}
shift_std_mm = {min(spread, (5.0 - abs(out)) / 3.0):.3f}
positions = {points // 3}
yaw_mrad = {side * random.uniform(0.0, 3.0):.3f}
{f"curve_radius_m = {-side * curve:.0f}" if side else ""}
load_kN = {random.uniform(50.0, 110.0):.1f}
speed_km_h = 72
friction = {random.uniform(0.1, 0.5):.2f}
share = {share}
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
        setup_of(setup, threads=2),
        smoothing_wavelength=setup.control.smoothing_wavelength,
    )
    whole_alone, whole = (one.depth_error for one in judged)
    return {
        "scene": number,
        "kind": SCENES[number][1],
        "tolerance": SCENES[number][3],
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

    wanted = [int(text) for text in sys.argv[1:]] or range(len(SCENES))
    with open(TABLE, "w", newline="") if len(sys.argv) == 1 else sys.stdout as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        for scene_number in wanted:
            with tempfile.TemporaryDirectory() as scratch:
                row = outcome(scene_number, scratch)
            writer.writerow(row)
            file.flush()
            sys.stderr.write(f"{row}\n")
