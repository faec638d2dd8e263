import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wearsim.operation.points import (
    collective,
    normal_positions,
    programme,
    with_monitors,
)


def run(name, load, speed, friction, **others):
    return {"name": name, "load": load, "speed": speed, "friction": friction, **others}


LEFT = {
    "shift": -3e-3,
    "distance": 1000.0,
    "yaw": 1e-3,
    "roll": 2e-3,
    "environment": 0.5,
}
BLOCKS = [
    run("left", 80e3, 20.0, 0.35, **LEFT),
    run("right", 90e3, 10.0, 0.30, shift=4e-3, distance=3000.0),
]


def test_weights_are_shares_of_the_loop():
    points = programme(BLOCKS)
    np.testing.assert_array_equal(points.weight, [0.25, 0.75])
    np.testing.assert_array_equal(points.block_length, [1000.0, 3000.0])


def test_blocks_keep_their_order_and_values():
    points = programme(BLOCKS, rotation="nominal", torque=12.0)
    conditions = points.conditions
    assert points.label == ("left", "right")
    assert (conditions.rotation, conditions.torque) == ("nominal", 12.0)
    np.testing.assert_array_equal(conditions.shift, [-3e-3, 4e-3])
    np.testing.assert_array_equal(conditions.yaw, [1e-3, 0.0])
    np.testing.assert_array_equal(conditions.roll, [2e-3, 0.0])
    np.testing.assert_array_equal(conditions.wheel_load, [80e3, 90e3])
    np.testing.assert_array_equal(conditions.speed, [20.0, 10.0])
    np.testing.assert_array_equal(conditions.friction, [0.35, 0.30])
    np.testing.assert_array_equal(conditions.track_curvature, [0.0, 0.0])
    np.testing.assert_array_equal(points.environment, [0.5, 1.0])


@pytest.mark.parametrize("distance", [0.0, -1.0, float("nan")])
def test_a_block_without_distance_is_refused(distance):
    with pytest.raises(ValueError, match="distance above 0"):
        programme([run("a", 80e3, 20.0, 0.35, shift=0.0, distance=distance)])


def test_a_ramp_goes_from_its_set_points_to_those_of_the_next_block():
    points = programme([{**BLOCKS[0], "positions": 4}, BLOCKS[1]])
    assert points.label == ("left 1", "left 2", "left 3", "left 4", "right")
    assert points.class_name == ("left",) * 4 + ("right",)
    np.testing.assert_allclose(
        points.conditions.shift[:4] * 1e3, -3 + 7 * (np.arange(4) + 0.5) / 4
    )
    np.testing.assert_allclose(
        points.conditions.loads[:4, 0], 80e3 + 10e3 * (np.arange(4) + 0.5) / 4
    )
    np.testing.assert_allclose(points.block_length, [250.0] * 4 + [3000.0])


def test_loads_friction_torque_and_what_is_controlled_are_those_of_each_block():
    sides = {
        "wheel_load_right": 90e3,
        "wheel_load_left": 70e3,
        "friction_flange": 0.1,
        "axle_torque": 2e3,
    }
    force = {
        "axle_load": 150e3,
        "lateral_force": 10e3,
        "box_moment": 500.0,
        "distance": 1.0,
    }
    common = {"speed": 20.0, "friction": 0.3}
    points = programme(
        [
            {"name": "a", "shift": 0.0, "distance": 1.0, **common, **sides},
            {"name": "b", **common, **force},
        ],
        torque=7.0,
    )
    conditions, controlled = points.conditions, points.controlled
    np.testing.assert_array_equal(conditions.loads, [[90e3, 70e3], [75e3, 75e3]])
    np.testing.assert_array_equal(conditions.friction_flange, [0.1, 0.3])
    np.testing.assert_array_equal(conditions.torque, [2e3, 7.0])
    np.testing.assert_array_equal(controlled.lateral_force, [np.nan, 10e3])
    np.testing.assert_array_equal(conditions.box_moment, [np.nan, 500.0])
    watched = with_monitors(
        points, np.zeros(1), wheel_load=1e3, speed=9.0, friction=0.4
    )
    assert not watched.controlled.any[2]
    assert np.isnan(watched.conditions.box_moment[2])
    np.testing.assert_array_equal(watched.conditions.loads[2], 1e3)
    assert watched.conditions.friction_flange[2] == 0.4


def test_an_empty_programme_is_refused():
    with pytest.raises(ValueError, match="needs blocks"):
        programme([])


def test_monitoring_points_are_solved_but_weigh_nothing():
    points = programme(BLOCKS)
    shift = np.array([-1e-3, 0.0, 1e-3])
    watched = with_monitors(
        points, shift, wheel_load=70e3, speed=15.0, friction=0.4, yaw=5e-4
    )
    assert len(watched.label) == 5
    assert watched.label[2] == "monitor -1.00 mm"
    np.testing.assert_array_equal(watched.weight, [0.25, 0.75, 0, 0, 0])
    np.testing.assert_array_equal(watched.block_length[2:], 0)
    np.testing.assert_array_equal(watched.environment[2:], 1)
    np.testing.assert_array_equal(watched.conditions.shift[2:], shift)
    np.testing.assert_array_equal(watched.conditions.yaw[2:], 5e-4)
    np.testing.assert_array_equal(watched.conditions.roll[2:], 0)
    np.testing.assert_array_equal(watched.conditions.wheel_load[2:], 70e3)
    np.testing.assert_array_equal(watched.conditions.speed[2:], 15.0)
    np.testing.assert_array_equal(watched.conditions.friction[2:], 0.4)
    np.testing.assert_array_equal(watched.conditions.shift[:2], points.conditions.shift)


SPREAD = {
    "shift_mean": 0.0,
    "shift_std": 2.5e-3,
    "share": 0.75,
    "positions": 15,
    "environment": 0.1,
}
TANGENT = run("tangent", 80e3, 20.0, 0.35, **SPREAD)
TURN = {
    "shift_mean": 4e-3,
    "shift_std": 0.0,
    "share": 0.25,
    "track_curvature": -1 / 500,
    "yaw": 1e-3,
}
CURVE = run("curve", 90e3, 15.0, 0.30, roll=2e-3, **TURN)


@given(st.floats(-0.01, 0.01), st.floats(1e-5, 5e-3), st.integers(10, 200))
def test_positions_keep_mean_and_truncated_variance(mean, std, count):
    """Sampling at equal spacing keeps the moments; only the cut at 3 standard
    deviations changes them.
    """
    position, weight = normal_positions(mean, std, count)
    assert weight.sum() == pytest.approx(1.0, abs=1e-14)
    assert (weight * (position - mean)).sum() == pytest.approx(0.0, abs=1e-15)
    variance = (weight * (position - mean) ** 2).sum() / std**2
    # variance of a normal distribution cut at 3: 1 - 6 phi(3) / erf(3 / sqrt 2) =
    # 0.9733; the end points count fully where the trapezoidal rule would halve them,
    # which adds at most 6 phi(3) 3 / (count - 1)
    cut = 1.0 - 6.0 * math.exp(-4.5) / math.sqrt(2 * math.pi) / math.erf(
        3 / math.sqrt(2)
    )
    assert cut - 1e-3 <= variance <= cut + 6 * 3 * 0.00443 * 6 / (count - 1) + 1e-3


def test_positions_are_symmetric_to_the_last_bit():
    position, weight = normal_positions(0.0, 2.5e-3, 15)
    assert np.array_equal(position, -position[::-1])
    assert np.array_equal(weight, weight[::-1])
    assert position[7] == 0.0
    assert position[-1] == pytest.approx(7.5e-3, rel=1e-15)


def test_weights_follow_the_normal_density():
    position, weight = normal_positions(1e-3, 2e-3, 21)
    density = np.exp(-0.5 * ((position - 1e-3) / 2e-3) ** 2)
    np.testing.assert_allclose(weight / weight[10], density / density[10], rtol=1e-12)


def test_a_deviation_of_zero_is_one_position():
    position, weight = normal_positions(4e-3, 0.0, 15)
    np.testing.assert_array_equal(position, [4e-3])
    np.testing.assert_array_equal(weight, [1.0])


@pytest.mark.parametrize(("std", "count"), [(-1e-3, 15), (1e-3, 1)])
def test_a_spread_that_cannot_be_is_refused(std, count):
    with pytest.raises(ValueError, match="standard deviation"):
        normal_positions(0.0, std, count)


def test_weights_are_share_of_the_class_times_position():
    points = collective([TANGENT, CURVE])
    assert len(points.label) == 16
    assert points.weight[:15].sum() == pytest.approx(0.75, abs=1e-15)
    assert points.weight[15] == 0.25
    np.testing.assert_array_equal(points.block_length, 0.0)


def test_classes_keep_their_values():
    points = collective([TANGENT, CURVE], rotation="centred", torque=3.0)
    conditions = points.conditions
    assert (conditions.rotation, conditions.torque) == ("centred", 3.0)
    for values, first, second in [
        (conditions.yaw, 0.0, 1e-3),
        (conditions.roll, 0.0, 2e-3),
        (conditions.wheel_load, 80e3, 90e3),
        (conditions.speed, 20.0, 15.0),
        (conditions.friction, 0.35, 0.30),
        (conditions.track_curvature, 0.0, -1 / 500),
        (points.environment, 0.1, 1.0),
    ]:
        np.testing.assert_array_equal(values, [first] * 15 + [second])
    assert conditions.shift[15] == 4e-3
    assert points.label[0] == "tangent -7.50 mm"
    assert points.label[15] == "curve +4.00 mm"


def test_an_empty_collective_is_refused():
    with pytest.raises(ValueError, match="at least one class"):
        collective([])
