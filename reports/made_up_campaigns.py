"""Campaigns made up by seeds.

Rigs and fields, wheels new and worn in service, two laws of wear.
"""

import time
from dataclasses import dataclass, replace

import numpy as np
from writing import HERE

from wearsim.campaign.control import reached
from wearsim.campaign.evaluate import Evaluation
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.campaign.state import State
from wearsim.contact.problem import PAIRS
from wearsim.scene import build, load_campaign
from wearsim.studies.chart import run_short

CASES = 40
DEPTHS = (30.0, 60.0, 120.0)
"""Largest depths at the end, case after case [um]."""
PLACES = 10
"""Of the distance, at which campaigns are compared."""
FINER = 4.0
"""Times smaller error of the steps of all campaigns that are compared: what differs are
the models.
"""
WORN = HERE.parent / "tests" / "data" / "real_wheels"


@dataclass(frozen=True)
class Stop:
    """A campaign at one of its places."""

    state: State
    evaluation: Evaluation  # of all operating points


@dataclass(frozen=True)
class Course:
    """A campaign from place to place."""

    y: np.ndarray  # (2, n) of the new wheels [m]
    stops: tuple[Stop, ...]
    seconds: float  # CPU time


def setup_of(number, folder):
    """Set up a case, by the half-space pair of its scene; `folder` takes the scene."""
    path = folder / f"case{number}.toml"
    path.write_text(scene(number))
    setup = build(load_campaign(path))
    finer = setup.control.error_tolerance / FINER
    return replace(setup, control=replace(setup.control, error_tolerance=finer))


def with_pair(setup, pair, **changes):
    """Set up the same with another pair of models and other contact fields."""
    normal, tangential = PAIRS[pair]
    return replace(
        setup,
        models=replace(setup.models, normal=normal, tangential=tangential, **changes),
    )


def distance_of(setup, number):
    """Distance over which `standard` wears a case to its depth, to three digits [m]."""
    distance = run_short(
        with_pair(setup, "standard"), 1e-6 * depth_of(number)
    ).state.distance
    return float(f"{distance:.3g}")


def places_of(setup, distance):
    """Places of a campaign [m]: tenths of the distance.

    Of a programme the nearest loops, or else blocks.
    """
    places = np.linspace(0.0, distance, PLACES + 1)[1:]
    blocks = setup.points.block_length
    blocks = blocks[blocks > 0.0]
    if blocks.size > 1:
        loop = blocks.sum()
        if places[0] >= loop:
            places = np.round(places / loop) * loop
        else:
            ends = (
                np.cumsum(blocks) + loop * np.arange(np.ceil(distance / loop))[:, None]
            ).ravel()
            places = ends[np.abs(ends - places[:, None]).argmin(axis=1)]
    return np.unique(places)


def run(setup, places):
    """Run a campaign on one thread to places (k,) [m].

    There all of its operating points are solved.
    """
    began, stops = time.process_time(), []
    state, taken = WheelsetEvolution(setup).start()
    y = state.y
    for place in places.tolist():
        evolution = WheelsetEvolution(
            replace(setup, control=replace(setup.control, distance=place))
        )
        while not reached(state.distance, place):
            state, taken = evolution.advance(state, evolution.evaluate(state, taken))
        stops.append(Stop(state, evolution.evaluate(state, taken)))
    return Course(y, tuple(stops), time.process_time() - began)


def load_kernels(setup):
    """Compile, or load, what a campaign needs: no part of its time."""
    coarse = replace(
        setup, models=replace(setup.models, strips=10, cells=10, most_cells=10)
    )
    run_short(coarse, 1e-9)


def is_worn(number):
    """Whether the wheels of a case are those worn in service."""
    return number % 5 == 4


def depth_of(number):
    """Largest depth at the end of a case [um]."""
    return DEPTHS[number % len(DEPTHS)]


def scene(number):
    """Text of a scene.

    Any wheel and rail, on a roller or in the field, around some mean shift.
    """
    random = np.random.default_rng([2026, 11, number])
    kind = ("rig", "field")[number % 2]
    wheel = (
        "wheel_worn_right.whl"
        if is_worn(number)
        else str(random.choice(["S1002", "EPS", "P8", "1in40"]))
    )
    profile = f'profile = "{wheel}"'
    if is_worn(number):
        profile = (
            f'profile = "{WORN / wheel}"\nprofile_left = '
            f'"{WORN / "wheel_worn_left.whl"}"'
        )
    radius = 460.0 if is_worn(number) else random.uniform(350.0, 500.0)
    text = f"""[scene]
kind = "{kind}"
[wheelset]
{profile}
radius_mm = {radius:.0f}
[counterface]
profile = "{random.choice(["60E1", "54E1", "60E2"])}"
inclination = "{random.choice(["1:20", "1:40"])}"
gauge_mm = {random.uniform(1433.0, 1438.0):.0f}
"""
    if kind == "rig":
        text += f"roller_radius_mm = {10.0 ** random.uniform(2.6, 3.6):.0f}\n"
    text += f"""[contact]
model = "accurate"
[wear]
law = "{random.choice(["usfd", "archard"])}"
[campaign]
distance_km = 1e6
"""
    running = _blocks if kind == "rig" else _classes
    return text + running(random)


def _blocks(random):
    """Blocks of a rig."""
    text = ""
    for point in range(int(random.integers(1, 7))):
        side = random.choice([-1.0, 1.0])
        text += f"""[[operation.block]]
name = "{point}"
shift_mm = {side * random.uniform(0.0, 4.5):.3f}
yaw_mrad = {side * random.uniform(0.0, 3.0):.3f}
load_kN = {random.uniform(50.0, 110.0):.1f}
speed_km_h = 72
friction = {random.uniform(0.1, 0.5):.2f}
distance_km = {random.uniform(0.5, 4.0):.1f}
"""
    return text


def _classes(random):
    """Classes of straight track and curves to both sides."""
    text = ""
    for name, side, share in (
        ("tangent", 0.0, 0.5),
        ("right", -1.0, 0.3),
        ("left", 1.0, 0.2),
    ):
        out = side * random.uniform(1.0, 3.5)
        text += f"""[[operation.class]]
name = "{name}"
shift_mean_mm = {out:.3f}
shift_std_mm = {min(random.uniform(0.4, 1.5), (5.0 - abs(out)) / 3.0):.3f}
positions = {int(random.integers(10, 13)) if side == 0.0 else 10}
yaw_mrad = {side * random.uniform(0.0, 2.0):.3f}
{f"curve_radius_m = {-side * 10.0 ** random.uniform(2.6, 3.5):.0f}" if side else ""}
load_kN = {random.uniform(50.0, 110.0):.1f}
speed_km_h = 72
friction = {random.uniform(0.1, 0.5):.2f}
share = {share}
"""
    return text
