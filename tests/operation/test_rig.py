import numpy as np
import pytest

from wearsim.operation.points import Block, programme, with_monitors

BLOCKS = [
    Block("left", -3e-3, 80e3, 20.0, 0.35, 1000.0, yaw=1e-3, roll=2e-3, environment=0.5),
    Block("right", 4e-3, 90e3, 10.0, 0.30, 3000.0),
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
        programme([Block("a", 0.0, 80e3, 20.0, 0.35, distance)])


def test_an_empty_programme_is_refused():
    with pytest.raises(ValueError, match="needs blocks"):
        programme([])


def test_monitoring_points_are_solved_but_weigh_nothing():
    points = programme(BLOCKS)
    shift = np.array([-1e-3, 0.0, 1e-3])
    watched = with_monitors(points, shift, wheel_load=70e3, speed=15.0, friction=0.4, yaw=5e-4)
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
