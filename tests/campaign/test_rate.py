"""Wear rates of operating points without a campaign."""

from dataclasses import replace

import numpy as np
import pytest

import wearsim
from wearsim.campaign.evaluate import accumulate, setup_of, solve_passage
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.errors import WearsimError
from wearsim.profile.shape import resample
from wearsim.scene import build, load_scene

RUNNING = {"load_kN": 80, "speed_km_h": 72, "friction": 0.35}
SCENE = {
    "scene": {"kind": "rig"},
    "wheelset": {"profile": "S1002", "profile_left": "S1002/h30"},
    "counterface": {"profile": "60E1", "inclination": "1:40", "roller_radius_mm": 1000},
    "contact": {"model": "fast", "strips": 12, "cells": 12},
    "wear": {"law": "usfd"},
    "operation": {
        "block": [
            {
                "name": "left",
                "shift_mm": -3,
                "distance_km": 1,
                "environment": 0.5,
                **RUNNING,
            },
            {
                "name": "curving",
                "shift_mm": 5,
                "yaw_mrad": 3,
                "distance_km": 3,
                **RUNNING,
            },
        ],
        "monitor": {"shifts_mm": [0.0], **RUNNING},
    },
    "campaign": {"distance_km": 4, "point_spacing_mm": 0.5},
}
FAST = wearsim.ContactModels.of("fast", strips=12, cells=12)
BODIES = wearsim.wheelset("S1002"), wearsim.rails("60E1", inclination=1 / 40)
CURVING = wearsim.ContactConditions.of(5e-3, yaw=3e-3)


@pytest.fixture(scope="module")
def rate():
    return wearsim.wear_rate(SCENE)


def test_weighted_rates_are_those_of_the_campaign(rate):
    setup = build(load_scene(SCENE))
    state, _ = WheelsetEvolution(setup).start()
    of_rate = setup_of(setup)
    points = setup.points
    whole = accumulate(
        solve_passage(state, points, of_rate), points, points.weight, state, of_rate
    )
    summed = (rate["wear_depth_rate"] * rate["weight"] * rate["environment"]).sum(
        "operating_point"
    )
    np.testing.assert_allclose(summed, whole.regime_depth, rtol=1e-12, atol=1e-25)
    work = (rate["friction_work"] * rate["weight"]).sum("operating_point")
    np.testing.assert_allclose(work, whole.friction_work, rtol=1e-12, atol=1e-12)
    assert rate["operating_point"].values.tolist()[:2] == ["left", "curving"]
    assert rate["regime"].values.tolist() == ["mild", "severe", "catastrophic"]
    # a monitoring point has its own rate
    assert float(rate["wear_area_rate"].sel(wheel="right")[2]) > 0.0


def test_area_work_and_wear_number_agree(rate):
    """Of each point and wheel: the depth along the profile holds the area of the
    patches, work is power.
    """
    weight = np.gradient(rate["arc_length"].values, axis=1)
    area = (rate["wear_depth_rate"].sum("regime").values * weight).sum(axis=-1)
    np.testing.assert_allclose(area, rate["wear_area_rate"], rtol=5e-3)
    np.testing.assert_allclose(
        rate["wear_number_with_spin"], rate["power"] / rate["speed"], rtol=1e-9
    )
    assert (rate["max_pressure"] > 5e8).all()


def test_bodies_give_the_rates_of_the_scene(rate):
    bodies = (
        wearsim.wheelset("S1002", left="S1002/h30"),
        wearsim.rollers("60E1", radius=1.0, inclination=1 / 40),
    )
    points = wearsim.ContactConditions.of([-3e-3, 5e-3], yaw=[0.0, 3e-3])
    own = wearsim.wear_rate(bodies, points, models=FAST)
    np.testing.assert_allclose(own["power"], rate["power"][:2], rtol=2e-2)
    np.testing.assert_allclose(
        own["wear_area_rate"], rate["wear_area_rate"][:2], rtol=5e-2
    )
    assert own["operating_point"].values.tolist() == [0, 1]


def test_profiles_stand_for_new_wheels():
    hollow = wearsim.standard_profile("S1002")
    z = hollow.z - 1e-3 * np.exp(-((hollow.y / 10e-3) ** 2))
    new = wearsim.wear_rate(BODIES, CURVING, models=FAST)
    worn = wearsim.wear_rate(
        BODIES, CURVING, models=FAST, profiles=replace(hollow, z=z)
    )
    np.testing.assert_array_equal(worn["profile_z"][0], z)
    assert (worn["power"] != new["power"]).all()
    same = wearsim.wear_rate(BODIES, CURVING, models=FAST, profiles=(hollow, hollow))
    assert same.identical(new)


def test_forces_of_a_scene_find_the_place_of_worn_wheels_anew():
    """As in a scene whose wheels were worn from the start; not where the new wheelset
    runs.
    """
    forced = {
        "name": "forced",
        "lateral_force_kN": 1.5,
        "yaw_mrad": 0,
        "axle_load_kN": 160,
        "distance_km": 1,
    }
    block = forced | {"speed_km_h": 72, "friction": 0.35}
    scene = SCENE | {"wheelset": {"profile": "S1002"}, "operation": {"block": [block]}}
    steep = wearsim.standard_profile("S1002")
    steep = replace(steep, z=steep.z - 0.01 * steep.y)
    own, new = (
        wearsim.wear_rate(scene | {"wheelset": {"profile": steep}}),
        wearsim.wear_rate(scene),
    )
    found = wearsim.wear_rate(scene, profiles=resample(steep, 0.5e-3))
    moved = abs(float(new["shift"][0] - own["shift"][0]))
    assert moved > 0.1e-3
    assert abs(float(found["shift"][0] - own["shift"][0])) < 0.02 * moved
    np.testing.assert_allclose(
        found["wear_area_rate"], own["wear_area_rate"], rtol=1e-2
    )
    other = scene | {"counterface": SCENE["counterface"] | {"inclination": "1:20"}}
    counterface = build(load_scene(other)).counterface
    canted = wearsim.wear_rate(other)["shift"]
    moved = wearsim.wear_rate(scene, counterface=counterface)["shift"]
    np.testing.assert_allclose(moved, canted, atol=1e-6)
    assert abs(float(moved[0] - new["shift"][0])) > 0.05e-3


def test_a_law_and_its_set_are_chosen_by_name():
    one, other = (
        wearsim.wear_rate(BODIES, CURVING, models=FAST, law=law, form="patch_mean")
        for law in ("usfd", "brr")
    )
    np.testing.assert_array_equal(one["power"], other["power"])
    assert (abs(one["wear_area_rate"] / other["wear_area_rate"] - 1.0) > 0.01).all()


@pytest.mark.parametrize(
    ("arguments", "options", "message"),
    [
        ((SCENE,), {"law": "usfd"}, "law is stated by the scene; change it there"),
        (
            (BODIES,),
            {},
            "conditions is a NoneType; give what wearsim.ContactConditions.of returns",
        ),
        ((BODIES[:1], CURVING), {}, "a wheelset and a counterface, not 1 values"),
        ((BODIES[::-1], CURVING), {}, "wheelset is a Counterface; give"),
        ((BODIES, CURVING), {"law": "usfdd"}, "usfdd.* did you mean 'usfd'"),
        ((BODIES, CURVING), {"coefficients": "burstow_2004"}, "burstow_2004"),
        (
            (BODIES, CURVING),
            {"profiles": wearsim.standard_profile("60E1")},
            "give one wheel, or the right",
        ),
        (
            ("workflows/rig_vs_field.toml",),
            {},
            "rig or of the field.*; give its rig or its field",
        ),
        (
            (BODIES, wearsim.ContactConditions.of(80e-3)),
            {"models": FAST},
            "right wheel, shift 80 mm, .* reaches the edge",
        ),
    ],
)
def test_faults_are_one_line(arguments, options, message):
    with pytest.raises(WearsimError, match=message) as caught:
        wearsim.wear_rate(*arguments, **options)
    assert "\n" not in str(caught.value)


def test_points_without_solution_are_left_out_on_request():
    points = wearsim.ContactConditions.of([0.0, 60e-3])
    with pytest.raises(WearsimError):
        wearsim.wear_rate(BODIES, points, models=FAST)
    rate = wearsim.wear_rate(BODIES, points, models=FAST, leave_out=True)
    for name in ("wear_depth_rate", "wear_area_rate", "max_pressure", "power"):
        assert np.isfinite(rate[name][0]).all()
        assert np.isnan(rate[name][1]).all()
    alone = wearsim.wear_rate(BODIES, points.at(np.array([0])), models=FAST)
    np.testing.assert_array_equal(
        rate["wear_depth_rate"][0], alone["wear_depth_rate"][0]
    )
