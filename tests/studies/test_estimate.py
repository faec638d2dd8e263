"""Steps and end of campaigns, foreseen from one step."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.campaign.run import run_scene
from wearsim.results import open_results
from wearsim.scene import build, load_scene
from wearsim.scene.campaign import ReprofilingRules
from wearsim.scene.overrides import Override
from wearsim.studies.estimate import Leg, count, end_of, estimate

NAMES = np.array(["hollowing", "wheel_diameter"])


def setup_of(rules=None):
    return SimpleNamespace(
        control=SimpleNamespace(distance=1e6, reprofiling=rules), counterface_wear=None
    )


def test_the_first_limit_that_ends_the_campaign_is_foreseen():
    margin, slope = np.array([2e-3, 30e-3]), np.array([-1e-8, -1e-7])
    for ending, expected in (
        ([True, True], (2e5, "hollowing")),
        ([False, True], (3e5, "wheel_diameter")),
    ):
        limits = NAMES, np.array(ending), margin, slope
        assert end_of(setup_of(), limits) == (
            pytest.approx(expected[0]),
            expected[1],
            1.0,
        )
    limits = (*limits[:3], 0.1 * slope)  # too slow for the distance
    assert end_of(setup_of(), limits) == (1e6, None, 1.0)


@pytest.mark.parametrize("diameter", [1.5e-3, 4e-3, 7.9e-3])
def test_the_diameter_falls_by_wear_and_at_the_lathe(diameter):
    """The staircase, metre by metre: after 100 km, and 1 mm of wear, a cut of 0.7 mm
    below the worn tread.
    """
    rules = ReprofilingRules(limits=("hollowing",), cut=0.7e-3)
    left = diameter
    for place in itertools.count(1):
        left -= 1e-8
        if left > 0.0 and place % 100_000 == 0:
            left -= 2.0 * rules.cut
        if left <= 0.0:
            break
    slope = np.array([-2e-3, -1e-3]) / 1e5
    limits = NAMES, np.array([False, True]), np.array([2e-3, diameter]), slope
    end, name, lives = end_of(setup_of(rules), limits)
    assert (end, name) == (pytest.approx(place, abs=2.0), "wheel_diameter")
    assert lives == pytest.approx(max(end / 1e5, 1.0))


@pytest.mark.parametrize("reason", ["stability", "max step"])
def test_steps_that_grow_with_the_third_root_of_the_distance_and_steps_that_do_not(
    reason,
):
    """Counted one by one."""
    length, distance, steps = 5.0, 5.0, 1
    while distance < 1e4:
        distance += length * (
            (distance / length) ** (1.0 / 3.0) if reason == "stability" else 1.0
        )
        steps += 1
    assert count(1e4, length, reason) == pytest.approx(steps, rel=0.03)
    assert count(4.0, length, reason) == 1.0


def test_a_block_takes_a_step_in_each_of_its_passes_at_least():
    leg = Leg(
        np.ones(1), 0.25, pieces=5000, first=100.0, length=300.0, reason="block border"
    )
    assert leg.steps(1e4, 1.0) == 5000
    once = leg._replace(pieces=1)
    assert once.steps(1200.0, 1.0) == pytest.approx(
        1.0 + count(300.0, 300.0, "block border")
    )
    assert once.steps(2400.0, 2.0) == pytest.approx(2.0 * once.steps(1200.0, 1.0))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "distance"),
    [("rig_given", 1260), ("field", 3_000), ("limits", 30_000), ("fatigue", 2_000)],
)
def test_one_step_of_the_shipped_scenes_tells_how_they_end(scene, distance, tmp_path):
    """Within a factor of 2; hollowing, which has wheels of `limits` reprofiled, shows
    after many steps.
    """
    overrides = [
        Override("campaign.distance_km", distance),
        Override("contact.model", "fast"),
    ]
    loaded = load_scene(f"workflows/{scene}.toml", overrides=overrides)
    setup = build(loaded)
    evolution = WheelsetEvolution(setup)
    start, _ = evolution.start()
    found = estimate(setup, start, evolution.evaluate(start))
    (path,) = run_scene(loaded, tmp_path)
    with open_results(path) as result:
        steps, end = result.sizes["step"] - 1, float(result["distance"][-1])
    assert 0.5 < found.steps / steps < 2.0
    assert 0.5 < found.end / end < 2.0
