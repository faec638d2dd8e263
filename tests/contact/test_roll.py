"""Free roll: an axle that rests on both wheels."""

from dataclasses import replace

import numpy as np
import pytest

from wearsim.contact.solve import Wheelset, solve

SHIFTS = np.array([-5.5, -4.5, -2.0, 0.0, 0.7, 3.0, 5.0]) * 1e-3


def by_patch(solution, side):
    """What must be alike for mirrored wheels, patches of one side by point and force."""
    part = solution.side == side
    names = "wheel_y area max_pressure normal_force creepage_x force_x power"
    return np.stack([getattr(solution, name)[part] for name in names.split()])


def roll_of(solution, rows):
    return solution.roll[np.searchsorted(solution.point, np.arange(rows))]


@pytest.mark.parametrize("kappa", [0.0, 1.0])
def test_a_mirrored_axle_rolls_the_other_way(wheelset, counterface, points, coarse, kappa):
    """Up to the tolerance on height, 1e-11 m over 1.5 m."""
    conditions = replace(points(shift=SHIFTS, yaw=np.full(7, 2e-3)), free_roll=True)
    mirrored = replace(conditions, shift=-conditions.shift, yaw=-conditions.yaw)
    one, other = (solve(c, wheelset, counterface(kappa), coarse) for c in (conditions, mirrored))
    np.testing.assert_allclose(roll_of(one, 7), -roll_of(other, 7), atol=2e-11)
    np.testing.assert_allclose(by_patch(one, 0), by_patch(other, 1), rtol=2e-6, atol=1e-8)


def test_roll_of_a_central_axle_is_nothing_and_falls_with_the_shift(wheelset, counterface, points, coarse):
    """Towards the flange the wheel rises: it rides on a larger radius."""
    conditions = replace(points(shift=SHIFTS), free_roll=True)
    roll = roll_of(solve(conditions, wheelset, counterface(), coarse), 7)
    assert abs(roll[3]) < 2e-11
    assert np.all(np.diff(roll) < 0.0)


def test_roll_closes_the_difference_of_the_descents(wheelset, counterface, points, coarse):
    """The descents without roll over the span, less what the wheels climb by moving sideways.

    A roll moves the contacts by -r roll on slopes tan(angle). Second order in the roll, from the curvature
    of the profiles under a shift of 0.05 mm: below 0.3 % of it; at 100 N the elastic approaches do not count.
    """
    level = points(shift=np.array([2e-3, 3e-3]), load=100.0)
    ground = counterface()
    solution = solve(level, wheelset, ground, coarse)
    profile = wheelset.right
    wheel = np.interp(solution.wheel_y, profile.y, profile.z)
    rail = np.interp(solution.rail_y, ground.profile.y, ground.profile.z)
    descent = (rail - wheel).reshape(2, 2)
    climb = 0.46 * np.tan(np.where(solution.side == 0, 1.0, -1.0) * solution.contact_angle).reshape(2, 2)
    expected = (descent[:, 0] - descent[:, 1]) / (2.0 * 0.75 + climb.sum(axis=1))
    rolled = solve(replace(level, free_roll=True), wheelset, ground, coarse)
    np.testing.assert_allclose(roll_of(rolled, 2), expected, rtol=3e-3)


def test_a_given_roll_that_is_free_gives_the_same_solution(wheelset, counterface, points, coarse):
    conditions = replace(points(shift=SHIFTS), free_roll=True)
    free = solve(conditions, wheelset, counterface(), coarse)
    given = replace(conditions, roll=roll_of(free, 7), free_roll=False)
    again = solve(given, wheelset, counterface(), coarse)
    assert again.power.tolist() == free.power.tolist()


def test_a_row_does_not_depend_on_its_batch(wheelset, counterface, points, coarse):
    conditions = replace(points(shift=SHIFTS), free_roll=True)
    together = solve(conditions, wheelset, counterface(), coarse)
    alone = solve(replace(points(shift=SHIFTS[5:6]), free_roll=True), wheelset, counterface(), coarse)
    assert alone.roll[0] == together.roll[together.point == 5][0]


def test_a_smaller_left_wheel_lowers_its_side(s1002, wheelset, counterface, points, coarse):
    """1 mm less radius on the left, at zero shift: the axle sinks there, so roll is negative."""
    thin = replace(s1002, z=s1002.z - 1e-3)
    worn = Wheelset(s1002, thin, 0.46, 0.75)
    conditions = replace(points(rotation="nominal"), free_roll=True)
    roll = roll_of(solve(conditions, worn, counterface(), coarse), 1)
    np.testing.assert_allclose(roll, -1e-3 / 1.5, rtol=0.03)
