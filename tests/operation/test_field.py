import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wearsim.operation.points import TrackClass, collective, normal_positions

TANGENT = TrackClass("tangent", 0.0, 2.5e-3, 80e3, 20.0, 0.35, 0.75, positions=15, environment=0.1)
CURVE = TrackClass("curve", 4e-3, 0.0, 90e3, 15.0, 0.30, 0.25, track_curvature=-1 / 500, yaw=1e-3, roll=2e-3)


@given(st.floats(-0.01, 0.01), st.floats(1e-5, 5e-3), st.integers(10, 200))
def test_positions_keep_mean_and_truncated_variance(mean, std, count):
    """Sampling at equal spacing keeps the moments; only the cut at 3 standard deviations changes them."""
    position, weight = normal_positions(mean, std, count)
    assert weight.sum() == pytest.approx(1.0, abs=1e-14)
    assert (weight * (position - mean)).sum() == pytest.approx(0.0, abs=1e-15)
    variance = (weight * (position - mean) ** 2).sum() / std**2
    # variance of a normal distribution cut at 3: 1 - 6 phi(3) / erf(3 / sqrt 2) = 0.9733; the end points
    # count fully where the trapezoidal rule would halve them, which adds at most 6 phi(3) 3 / (count - 1)
    cut = 1.0 - 6.0 * math.exp(-4.5) / math.sqrt(2 * math.pi) / math.erf(3 / math.sqrt(2))
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
