"""Steps and end of campaigns, foreseen from a few steps."""

import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest

from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.scene import build, load_scene
from wearsim.scene.campaign import ReprofilingRules
from wearsim.scene.overrides import Override
from wearsim.studies import plan
from wearsim.studies.plan import _end_of, _Leg

NAMES = np.array(["hollowing", "wheel_diameter"])


def setup_of(rules=None):
    return SimpleNamespace(control=SimpleNamespace(distance=1e6, reprofiling=rules), counterface_wear=None)


def test_the_first_limit_that_ends_the_campaign_is_foreseen():
    new = margin = np.array([2e-3, 30e-3])
    slope, lathe = np.array([-1e-8, -1e-7]), [(0.0, new)]
    for ending, expected in (([True, True], (3e5, "hollowing")), ([False, True], (4e5, "wheel_diameter"))):
        limits = NAMES, np.array(ending), margin, slope
        assert _end_of(setup_of(), limits, 1e5, lathe) == (pytest.approx(expected[0]), expected[1], 1.0)
    limits = (*limits[:3], 0.1 * slope)  # too slow for the distance
    assert _end_of(setup_of(), limits, 1e5, lathe) == (1e6, None, 1.0)


@pytest.mark.parametrize("diameter", [1.5e-3, 4e-3, 7.9e-3])
def test_the_diameter_falls_by_wear_and_at_the_lathe(diameter):
    """The staircase, metre by metre: after 100 km, and 1 mm of wear, a cut of 0.7 mm below the worn tread."""
    rules = ReprofilingRules(limits=("hollowing",), cut=0.7e-3)
    left = diameter
    for place in itertools.count(1):
        left -= 1e-8
        if left > 0.0 and place % 100_000 == 0:
            left -= 2.0 * rules.cut
        if left <= 0.0:
            break
    slope = np.array([-2e-3, -1e-3]) / 1e5
    now = np.array([2e-3, diameter]) + 3e4 * slope
    limits = NAMES, np.array([False, True]), now, slope
    end, name, lives = _end_of(setup_of(rules), limits, 3e4, [(0.0, np.array([2e-3, diameter]))])
    assert (end, name) == (pytest.approx(place, abs=2.0), "wheel_diameter")
    assert lives == pytest.approx(max(end / 1e5, 1.0))


@pytest.mark.parametrize("later", ["error", "max step"])
def test_steps_that_grow_with_the_root_of_the_distance_and_steps_that_do_not(later):
    """Counted one by one: to the one that is not whole."""
    run, length, distance, steps = 100.0, 5.0, 100.0, 0
    while distance < 1e4:
        distance += length * (math.sqrt(distance / run) if later == "error" else 1.0)
        steps += 1
    leg = _Leg(None, run=run, length=length, later=later)
    leg.reasons["growth"] = 7
    leg.extend(1e4, 1.0, 0.0)
    assert leg.reasons.total() == pytest.approx(steps + 7, rel=0.03)  # rises within a step are left out
    leg.extend(0.0, 1.0, 5000.0)
    assert leg.reasons["block border"] == 5000 - leg.reasons["growth"] - leg.reasons[later]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "distance"), [("rig", 400), ("field", 3_000), ("limits", 30_000), ("fatigue", 2_000)]
)
def test_a_few_steps_of_the_shipped_scenes_tell_how_they_end(scene, distance, monkeypatch):
    """Within a factor of 2: the time of the trial is counted in steps. By force over a third of the way."""
    ticks = itertools.count()
    monkeypatch.setattr(plan, "time", SimpleNamespace(perf_counter=lambda: float(next(ticks))))
    overrides = [Override("campaign.distance_km", distance), Override("contact.model", "fast")]
    setup = build(load_scene(f"workflows/{scene}.toml", overrides=overrides))
    start, _ = WheelsetEvolution(setup).start()
    few, every = [], []
    for result, effort in ((few, 20.0), (every, math.inf)):
        monkeypatch.setattr(plan, "_EFFORT", effort)
        result.append(plan.estimate(setup, start))
    assert 0.5 < few[0].steps / every[0].steps < 2.0
    assert 0.5 < few[0].end / every[0].end < 2.0
    assert few[0].limit == every[0].limit == ("wheel_diameter" if scene == "limits" else None)
