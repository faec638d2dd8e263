"""Rules for the rotation speed of the wheelset."""

from dataclasses import replace

import numpy as np
import pytest

from wearsim.contact.solve import Wheelset, solve
from wearsim.errors import NumericalError


def torque_of(solution, slower, faster):
    """Torque of the creep forces about the axle: V F . d(creepage) / d(rotation), creepages being linear."""
    change = (faster.rotation_speed - slower.rotation_speed)[:, None]
    fast, slow = (np.stack((s.creepage_x, s.creepage_y, s.spin), axis=1) for s in (faster, slower))
    force = np.stack((solution.force_x, solution.force_y, solution.spin_moment), axis=1)
    work = 20.0 * (force * (fast - slow) / change).sum(axis=1)
    return np.bincount(solution.point, weights=work)


@pytest.mark.parametrize("torque", [0.0, 3e3, -8e3])
@pytest.mark.parametrize("curvature", [0.0, 2.0])
def test_free_rotation_balances_the_applied_torque(wheelset, counterface, points, coarse, torque, curvature):
    """1e-8 of friction x load x radius over both wheels."""
    state = {
        "shift": np.array([-4e-3, 0.0, 1.5e-3, 3.5e-3]),
        "yaw": np.array([2e-3, 0.0, -1e-3, 5e-3]),
        "track_curvature": 1e-3,
    }
    ground = counterface(curvature)
    free = solve(points(**state, rotation="free", torque=torque), wheelset, ground, coarse)
    slow, fast = (solve(points(**state, rotation=w), wheelset, ground, coarse) for w in (43.0, 44.0))
    balance = torque_of(free, slow, fast)
    np.testing.assert_allclose(balance, -torque, atol=1e-8 * 0.35 * 80e3 * 0.46)


def test_uniform_wear_of_the_tread_leaves_no_creepage(s1002, wheelset, counterface, points, coarse):
    """1 mm less radius: nominal rotation would feign 0.002, the balance does not."""
    thin = replace(s1002, z=s1002.z - 1e-3)
    worn = Wheelset(thin, thin, 0.46, 0.75)
    free = solve(points(rotation="free"), worn, counterface(), coarse)
    fresh = solve(points(rotation="free"), wheelset, counterface(), coarse)
    held = solve(points(rotation="nominal"), worn, counterface(), coarse)
    kept = solve(points(rotation="nominal"), wheelset, counterface(), coarse)
    np.testing.assert_allclose(held.creepage_x - kept.creepage_x, 1e-3 / 0.46, rtol=1e-3)
    np.testing.assert_allclose(free.creepage_x, fresh.creepage_x, atol=3e-6)
    # Spin moments alone act on the axle: a thousandth of what friction could carry.
    np.testing.assert_allclose(free.force_x, 0.0, atol=2e-3 * 0.35 * 80e3)


def test_one_side_of_a_free_wheelset_is_that_of_both(wheelset, counterface, points, coarse):
    conditions = points(shift=np.array([1e-3, 3e-3]), rotation="free")
    both = solve(conditions, wheelset, counterface(), coarse)
    left = solve(conditions, wheelset, counterface(), coarse, sides=(1,))
    assert left.power.tolist() == both.power[both.side == 1].tolist()


def test_centred_rotation_has_no_longitudinal_creepage_at_zero_shift(wheelset, counterface, points, coarse):
    centred = solve(points(shift=np.array([0.0, 3e-3]), rotation="centred"), wheelset, counterface(), coarse)
    np.testing.assert_allclose(centred.creepage_x[centred.point == 0], 0.0, atol=1e-15)
    assert centred.rotation_speed[0] == centred.rotation_speed[-1]  # no matter where the wheelset is


def test_nominal_rotation_and_a_given_one(wheelset, counterface, points, coarse):
    nominal = solve(points(shift=2e-3, rotation="nominal"), wheelset, counterface(), coarse)
    given = solve(points(shift=2e-3, rotation=20.0 / 0.46), wheelset, counterface(), coarse)
    np.testing.assert_allclose(nominal.rotation_speed, 20.0 / 0.46, rtol=1e-15)
    assert nominal.power.tolist() == given.power.tolist()
    faster = solve(points(shift=2e-3, rotation=20.2 / 0.46), wheelset, counterface(), coarse)
    np.testing.assert_allclose(faster.creepage_x - nominal.creepage_x, -0.01, rtol=5e-3)


def test_more_torque_than_friction_carries_is_refused(wheelset, counterface, points, coarse):
    for friction, torque in ((0.35, 1e5), (0.0, 1.0), (0.35, 2.05 * 0.35 * 80e3 * 0.46)):
        with pytest.raises(NumericalError, match="torque") as caught:
            solve(points(rotation="free", torque=torque, friction=friction), wheelset, counterface(), coarse)
        assert "\n" not in str(caught.value)
