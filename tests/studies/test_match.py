"""A contact of the field matched on a rig: identity, symmetry, limits, faults."""

from dataclasses import replace

import numpy as np
import pytest

import wearsim
from wearsim.errors import ContactError, SceneError
from wearsim.scene import load_scene
from wearsim.scene.actuators import actuators
from wearsim.studies.contact_flags import MATCHED
from wearsim.studies.match import match_contact, matched, rig_of_scene, wheels_of

FAST = wearsim.ContactModels.of("fast", strips=16, cells=16)
RUNNING = {"load_kN": 80, "speed_km_h": 72, "friction": 0.35, "distance_km": 1}
RIG = {
    "scene": {"kind": "rig"},
    "wheelset": {"profile": "S1002"},
    "counterface": {"profile": "60E1", "inclination": "1:40", "roller_radius_mm": 1000},
    "operation": {"block": [{"name": "a", "shift_mm": 0, **RUNNING}]},
    "campaign": {"distance_km": 1},
}
SIDES = ("right", "left")


def changed(programme=None, **counterface):
    """Tables of the rig with other keys."""
    tables = RIG | {"counterface": RIG["counterface"] | counterface}
    return tables if programme is None else tables | {"programme": programme}


def field(shift=1.8e-3, yaw=0.0, **others):
    """Bodies and operating point of the field."""
    return (
        wearsim.wheelset("S1002", radius=0.46),
        wearsim.rails("60E1", inclination=1 / 40),
        wearsim.ContactConditions.of(shift, yaw=yaw, free_roll=True, **others),
    )


def test_rollers_of_zero_curvature_return_the_set_point_of_the_field():
    """From 0.3 mm, 0.2 mrad and 5 kN off, within what ends the search."""
    scene = load_scene(changed())
    rig = rig_of_scene(scene, FAST, SIDES, field()[2])
    rails = replace(rig.counterface, curvature=0.0)
    rig = replace(rig, counterface=rails)
    at, off = np.array([[1.8e-3, 0.5e-3, 80e3, 0.0], [0.3e-3, 0.2e-3, 5e3, 0.0]])
    contact = wheels_of(rig.wheelset, rails, rig.conditions(at[None]), FAST, SIDES)
    found = matched(rig, contact, MATCHED, at + off)
    assert found.worst < 0.2
    np.testing.assert_allclose(found.set_point, at, atol=2e-5, rtol=5e-3)


def test_a_contact_on_the_same_rollers_is_matched_by_its_own_set_point():
    point = field(2e-3)[2]
    same = rig_of_scene(load_scene(RIG), FAST, SIDES, point)
    made = match_contact(same.wheelset, same.counterface, point, RIG, FAST)
    for name in ("shift", "yaw", "wheel_load"):
        of = made[name]
        # the bounds of the search move zero by a rounding error
        assert float(of.sel(state="matched")) == pytest.approx(
            float(of.sel(state="field")), rel=1e-9, abs=1e-12
        )
    assert made.attrs["reached"] == 1
    np.testing.assert_allclose(made["difference"], 0.0, atol=1e-9)
    assert made.attrs["limits"] == made.attrs["missing"] == made.attrs["wheels"] == ""


@pytest.fixture(scope="module")
def right():
    """Match of the right wheel in a point with yaw."""
    return match_contact(*field(1.8e-3, 0.5e-3), RIG, FAST, sides="right")


def test_the_match_has_the_quantities_of_the_field(right):
    assert right.attrs["reached"] == 1
    for name in ("max_pressure", "wear_number"):
        of = right[name].sel(wheel="right")
        assert float(of.sel(state="matched")) == pytest.approx(
            float(of.sel(state="field")), rel=0.01
        )
    place = right["place"].sel(wheel="right")
    assert abs(float(place.sel(state="matched") - place.sel(state="field"))) < 0.5e-3
    # a roller presses more: less load, and nothing equal at the copied set-point
    assert float(right["wheel_load"].sel(state="matched")) < 75e3
    pressure = right["max_pressure"].sel(wheel="right")
    assert float(pressure.sel(state="copied") / pressure.sel(state="field")) > 1.05
    assert (right["sensitivity"].sel(actuator="shift") > 0.0).all()
    assert np.isnan(right["sensitivity"].sel(actuator="speed_difference")).all()


def test_the_mirror_image_is_matched_by_the_mirrored_set_point(right):
    left = match_contact(*field(-1.8e-3, -0.5e-3), RIG, FAST, sides="left")
    for name, sign in {"shift": -1, "yaw": -1, "wheel_load": 1}.items():
        np.testing.assert_allclose(left[name], sign * right[name], rtol=1e-4, atol=1e-7)
    for name in MATCHED:
        np.testing.assert_allclose(left[name].values, right[name].values, rtol=1e-4)


def test_a_limit_that_binds_and_the_range_that_is_missing_are_named():
    rig = changed({"loads_kN": [78, 100], "yaws_mrad": [0]})
    chosen = ("max_pressure", "place")
    made = match_contact(*field(), rig, FAST, quantities=chosen, sides="right")
    assert made.attrs["reached"] == 0
    limit = "wheel load at its smallest, 78 kN ([programme] of the scene)"
    assert made.attrs["limits"] == limit
    assert made.attrs["missing"].startswith("wheel load: at 5")
    assert made.attrs["missing"].endswith("kN the rig would match")
    assert float(made["wheel_load"].sel(state="matched")) == pytest.approx(78e3)


def test_a_missing_shift_ends_at_the_flange_clearance():
    rig = changed({"shift_mm": 2, "yaws_mrad": [0]})
    widest = actuators(load_scene(rig)).ranges[0].widest
    assert widest == pytest.approx((-6.6e-3, 6.6e-3), abs=0.2e-3)
    chosen = ("max_pressure", "place")
    made = match_contact(*field(5e-3), rig, FAST, quantities=chosen, sides="right")
    word, _, value = made.attrs["missing"].partition(": at ")
    assert word == "shift"
    assert 2.0 < float(value.split()[0]) <= 1e3 * widest[1]


def test_the_torque_of_the_blocks_acts():
    driven = {"name": "a", "shift_mm": 0, **RUNNING, "axle_torque_kN_m": 2.0}
    scene = load_scene(RIG | {"operation": {"block": [driven]}})
    rig = rig_of_scene(scene, FAST, SIDES, field()[2])
    assert rig.rules["torque"] == 2e3


@pytest.mark.slow
def test_coupled_rollers_lack_the_speed_difference_of_a_curve():
    point = field(-3.5e-3, -0.5e-3, track_curvature=1e-3)
    made = match_contact(*point, RIG, FAST)
    assert made.attrs["reached"] == 0
    # left by coupled rollers of 1 m: 19 % in the spec, of the worst of both wheels
    off = np.abs(made["difference"].sel(quantity="max_pressure")).max()
    assert 0.1 < float(off) < 0.3
    assert made.attrs["missing"].startswith("speed difference of the rollers: at 0.1")
    free = match_contact(*point, changed(rig="full_scale"), FAST)
    assert free.attrs["reached"] == 1
    assert float(free["speed_difference"].sel(state="matched")) > 0.5e-3


@pytest.mark.parametrize(
    ("others", "message"),
    [
        ({"quantities": ("power",)}, "power cannot be matched; choose from max_p"),
        ({"quantities": ()}, "nothing cannot be matched"),
        (
            {"rig": changed({"shift_mm": 0, "yaws_mrad": [0], "loads_kN": [80]})},
            "no ra",
        ),
        ({"conditions": field([0.0, 1e-3])[2]}, "give a single point"),
        ({"conditions": field(friction=0.0)[2]}, "wear number of the field is 0"),
    ],
)
def test_what_cannot_be_matched_is_refused(others, message):
    wheelset, rails, point = field()
    given = {"conditions": point, "rig": RIG, "models": FAST} | others
    with pytest.raises(ContactError, match=message):
        match_contact(wheelset, rails, **given)


def test_the_load_to_copy_is_that_of_the_wheel_to_match():
    """On the same rollers, so that the copied set-point has the contact of the field;
    loads of both wheels that are unlike are none of a rig.
    """
    loads = np.array([[90e3, 70e3]])
    point = field(2e-3, wheel_load=loads)[2]
    same = rig_of_scene(load_scene(RIG), FAST, SIDES, point)
    given = same.wheelset, same.counterface, point, RIG, FAST
    made = match_contact(*given, quantities=["max_pressure"], sides="left")
    assert made["wheel_load"].values[:2].tolist() == [70e3, 70e3]
    with pytest.raises(ContactError, match="90 and 70 kN in the field"):
        match_contact(*given)


def test_ranges_end_at_the_rig_the_scene_or_the_flange():
    shift, yaw, load, difference = actuators(load_scene(changed())).ranges
    assert (shift.end, yaw.end, load.end) == ("flange", "scene", "scene")
    assert 5e-3 < shift.high == -shift.low < 8e-3
    assert not difference.controlled
    of_rig = actuators(load_scene(changed(rig="full_scale"))).ranges
    highest = [one.high for one in of_rig]
    np.testing.assert_allclose(highest, [15e-3, 40e-3, 125e3, 0.02])
    assert {one.end for one in of_rig} == {"rig"}
    assert of_rig[2].low == 25e3
    stated = {"shift_mm": 2, "yaws_mrad": [-1, 3], "loads_kN": [30, 60]}
    each = actuators(load_scene(changed(stated, rig="full_scale"))).ranges
    ranges = [(one.low, one.high) for one in each[:3]]
    np.testing.assert_allclose(ranges, [(-2e-3, 2e-3), (-1e-3, 3e-3), (30e3, 60e3)])


def test_ranges_beyond_the_rig_and_unlike_friction_are_refused():
    rig = changed({"shift_mm": 20, "loads_kN": [150]}, rig="full_scale")
    blocks = [
        {"name": "a", "shift_mm": 0, **RUNNING},
        {"name": "b", "shift_mm": 1, **RUNNING, "friction": 0.2},
        {"name": "c", "shift_mm": 1, **RUNNING, "friction_flange": 0.2},
    ]
    with pytest.raises(SceneError) as raised:
        actuators(load_scene(rig | {"operation": {"block": blocks}}))
    message = str(raised.value)
    for part in (
        "shift_mm holds 20, beyond the rig, whose limit is 15",
        "loads_kN holds 150",
        "several coefficients of friction",
        "several friction_flange",
    ):
        assert part in message
