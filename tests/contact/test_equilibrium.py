"""Equilibrium of the wheelset: roll of an axle that rests on both wheels, rules for the
rotation speed.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from wearsim.contact.equilibrium import resting_roll
from wearsim.contact.problem import Wheelset
from wearsim.contact.solve import solve
from wearsim.errors import ContactError, NumericalError
from wearsim.profile.files import load_profile

SHIFTS = np.array([-5.5, -4.5, -2.0, 0.0, 0.7, 3.0, 5.0]) * 1e-3

DATA = Path(__file__).parents[1] / "data"


def by_patch(solution, side):
    """What must be alike for mirrored wheels, patches of one side by point and
    force.
    """
    part = solution.side == side
    names = "wheel_y area max_pressure normal_force creepage_x force_x power"
    return np.stack([getattr(solution, name)[part] for name in names.split()])


def roll_of(solution, rows):
    return solution.roll[np.searchsorted(solution.point, np.arange(rows))]


@pytest.mark.parametrize("kappa", [0.0, 1.0])
def test_a_mirrored_axle_rolls_the_other_way(
    wheelset, counterface, points, coarse, kappa
):
    """Up to rounding: mirrored searches take the same way."""
    conditions = replace(points(shift=SHIFTS, yaw=np.full(7, 2e-3)), free_roll=True)
    mirrored = replace(conditions, shift=-conditions.shift, yaw=-conditions.yaw)
    one, other = (
        solve(c, wheelset, counterface(kappa), coarse) for c in (conditions, mirrored)
    )
    np.testing.assert_allclose(roll_of(one, 7), -roll_of(other, 7), atol=2e-11)
    np.testing.assert_allclose(
        by_patch(one, 0), by_patch(other, 1), rtol=2e-6, atol=1e-8
    )


def test_roll_of_a_central_axle_is_nothing_and_falls_with_the_shift(
    wheelset, counterface, points, coarse
):
    """Towards the flange the wheel rises: it rides on a larger radius. Heights are
    alike to 1e-9 m.
    """
    conditions = replace(points(shift=SHIFTS), free_roll=True)
    roll = roll_of(solve(conditions, wheelset, counterface(), coarse), 7)
    assert abs(roll[3]) < 1e-9 / (2.0 * wheelset.half_span)
    assert np.all(np.diff(roll) < 0.0)


def test_roll_closes_the_difference_of_the_vertical_displacements(
    wheelset, counterface, points, coarse
):
    """The vertical displacements without roll over the span, less what the wheels climb
    by moving sideways.

    A roll moves the contacts by -r roll on slopes tan(angle). Second order in the roll,
    from the curvature of the profiles under a shift of 0.05 mm: below 0.3 % of it; at
    100 N the elastic approaches do not count.
    """
    level = points(shift=np.array([2e-3, 3e-3]), load=100.0)
    ground = counterface()
    solution = solve(level, wheelset, ground, coarse)
    profile = wheelset.right
    wheel = np.interp(solution.wheel_y, profile.y, profile.z)
    rail = np.interp(solution.rail_y, ground.profile.y, ground.profile.z)
    displacement = (rail - wheel).reshape(2, 2)
    climb = 0.46 * np.tan(
        np.where(solution.side == 0, 1.0, -1.0) * solution.contact_angle
    ).reshape(2, 2)
    expected = (displacement[:, 0] - displacement[:, 1]) / (
        2.0 * 0.75 + climb.sum(axis=1)
    )
    rolled = solve(replace(level, free_roll=True), wheelset, ground, coarse)
    np.testing.assert_allclose(roll_of(rolled, 2), expected, rtol=3e-3)


def test_a_given_roll_that_is_free_gives_the_same_solution(
    wheelset, counterface, points, coarse
):
    """Up to the balance, 1e-6 of load and torque, ten times that in power: it begins
    elsewhere.
    """
    conditions = replace(points(shift=SHIFTS), free_roll=True)
    free = solve(conditions, wheelset, counterface(), coarse)
    given = replace(conditions, roll=roll_of(free, 7), free_roll=False)
    again = solve(given, wheelset, counterface(), coarse)
    np.testing.assert_allclose(again.normal_force, free.normal_force, rtol=5e-6)
    np.testing.assert_allclose(again.power, free.power, rtol=2e-5)


def test_a_row_does_not_depend_on_its_batch(wheelset, counterface, points, coarse):
    conditions = replace(points(shift=SHIFTS), free_roll=True)
    together = solve(conditions, wheelset, counterface(), coarse)
    alone = solve(
        replace(points(shift=SHIFTS[5:6]), free_roll=True),
        wheelset,
        counterface(),
        coarse,
    )
    assert alone.roll[0] == together.roll[together.point == 5][0]


def test_a_smaller_left_wheel_lowers_its_side(
    s1002, wheelset, counterface, points, coarse
):
    """1 mm less radius on the left, at zero shift: the axle sinks there, so roll is
    negative.
    """
    thin = replace(s1002, z=s1002.z - 1e-3)
    worn = Wheelset(s1002, thin, 0.46, 0.75)
    conditions = replace(points(rotation="nominal"), free_roll=True)
    roll = roll_of(solve(conditions, worn, counterface(), coarse), 1)
    np.testing.assert_allclose(roll, -1e-3 / 1.5, rtol=0.03)


def torque_of(solution, slower, faster):
    """Torque of the creep forces about the axle: V F . d(creepage) / d(rotation),
    creepages being linear.
    """
    change = (faster.rotation_speed - slower.rotation_speed)[:, None]
    fast, slow = (
        np.stack((s.creepage_x, s.creepage_y, s.spin), axis=1) for s in (faster, slower)
    )
    force = np.stack((solution.force_x, solution.force_y, solution.spin_moment), axis=1)
    work = 20.0 * (force * (fast - slow) / change).sum(axis=1)
    return np.bincount(solution.point, weights=work)


@pytest.mark.parametrize("torque", [0.0, 3e3, -8e3])
@pytest.mark.parametrize("curvature", [0.0, 2.0])
def test_free_rotation_balances_the_applied_torque(
    wheelset, counterface, points, coarse, torque, curvature
):
    """1e-5 of friction x load x radius: the wheels' approaches follow the speed,
    differences feel it.
    """
    state = {
        "shift": np.array([-4e-3, 0.0, 1.5e-3, 3.5e-3]),
        "yaw": np.array([2e-3, 0.0, -1e-3, 5e-3]),
        "track_curvature": 1e-3,
    }
    ground = counterface(curvature)
    free = solve(
        points(**state, rotation="free", torque=torque), wheelset, ground, coarse
    )
    slow, fast = (
        solve(points(**state, rotation=w), wheelset, ground, coarse)
        for w in (43.0, 44.0)
    )
    balance = torque_of(free, slow, fast)
    np.testing.assert_allclose(balance, -torque, atol=1e-5 * 0.35 * 80e3 * 0.46)


def test_uniform_wear_of_the_tread_leaves_no_creepage(
    s1002, wheelset, counterface, points, coarse
):
    """1 mm less radius: nominal rotation would feign 0.002, the balance does not."""
    thin = replace(s1002, z=s1002.z - 1e-3)
    worn = Wheelset(thin, thin, 0.46, 0.75)
    free = solve(points(rotation="free"), worn, counterface(), coarse)
    fresh = solve(points(rotation="free"), wheelset, counterface(), coarse)
    held = solve(points(rotation="nominal"), worn, counterface(), coarse)
    kept = solve(points(rotation="nominal"), wheelset, counterface(), coarse)
    np.testing.assert_allclose(
        held.creepage_x - kept.creepage_x, 1e-3 / 0.46, rtol=1e-3
    )
    np.testing.assert_allclose(free.creepage_x, fresh.creepage_x, atol=3e-6)
    # Spin moments alone act on the axle: a thousandth of what friction could carry.
    np.testing.assert_allclose(free.force_x, 0.0, atol=2e-3 * 0.35 * 80e3)


@pytest.mark.parametrize("free", [{"rotation": "free"}, {"free_roll": True}])
def test_one_side_of_a_free_wheelset_is_that_of_both(
    wheelset, counterface, points, coarse, free
):
    conditions = replace(points(shift=np.array([1e-3, 3e-3])), **free)
    both = solve(conditions, wheelset, counterface(), coarse)
    left = solve(conditions, wheelset, counterface(), coarse, sides=(1,))
    assert left.power.tolist() == both.power[both.side == 1].tolist()


def test_a_fault_of_the_central_position_names_it(
    wheelset, counterface, points, coarse
):
    hertz = replace(coarse, normal="hertz")
    conditions = points(shift=np.array([3e-3]), load=117e3, rotation="centred")
    with pytest.raises(
        ContactError, match=r"^right wheel, shift 0 mm, yaw 0 mrad: no contact ellipse"
    ):
        solve(conditions, wheelset, counterface(), hertz)


def test_centred_rotation_has_no_longitudinal_creepage_at_zero_shift(
    wheelset, counterface, points, coarse
):
    centred = solve(
        points(shift=np.array([0.0, 3e-3]), rotation="centred"),
        wheelset,
        counterface(),
        coarse,
    )
    # The approach under the load at that speed, and at the nominal one it was found
    # with.
    np.testing.assert_allclose(centred.creepage_x[centred.point == 0], 0.0, atol=1e-12)
    assert (
        centred.rotation_speed[0] == centred.rotation_speed[-1]
    )  # no matter where the wheelset is


def test_centred_rotation_is_that_of_a_wheelset_in_the_middle_whether_or_not_it_rolls(
    wheelset, counterface, points, coarse
):
    worn = load_profile(DATA / "real_wheels" / "wheel_worn_left.whl", "wheel")
    for one in (wheelset, replace(wheelset, right=worn, left=worn)):
        conditions = points(shift=np.array([0.0, 3e-3]), rotation="centred")
        given, free = (
            solve(replace(conditions, free_roll=rolls), one, counterface(), coarse)
            for rolls in (False, True)
        )
        np.testing.assert_allclose(
            free.rotation_speed[0], given.rotation_speed[0], rtol=1e-12
        )


def test_nominal_rotation_and_a_given_one(wheelset, counterface, points, coarse):
    nominal = solve(
        points(shift=2e-3, rotation="nominal"), wheelset, counterface(), coarse
    )
    given = solve(
        points(shift=2e-3, rotation=20.0 / 0.46), wheelset, counterface(), coarse
    )
    np.testing.assert_allclose(nominal.rotation_speed, 20.0 / 0.46, rtol=1e-15)
    assert nominal.power.tolist() == given.power.tolist()
    faster = solve(
        points(shift=2e-3, rotation=20.2 / 0.46), wheelset, counterface(), coarse
    )
    np.testing.assert_allclose(faster.creepage_x - nominal.creepage_x, -0.01, rtol=5e-3)


def test_more_torque_than_friction_carries_is_refused(
    wheelset, counterface, points, coarse
):
    for friction, torque in (
        (0.35, 1e5),
        (0.0, 1.0),
        (0.35, 2.05 * 0.35 * 80e3 * 0.46),
    ):
        with pytest.raises(NumericalError, match="torque") as caught:
            solve(
                points(rotation="free", torque=torque, friction=friction),
                wheelset,
                counterface(),
                coarse,
            )
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("fall", [0.08, 0.12, 0.3, 0.94, 3.0, 6.0, 10.0])
@pytest.mark.parametrize("begin", [5e-8, 1e-6, 1e-4])
def test_a_roll_is_at_rest_whatever_the_fall(fall, begin):
    """Flanges fall slowly; 1e-9 m, in 16 rolls."""
    rolls, off = [], []

    def displacements(roll, moving):
        rolls.append(roll[0])
        off.append(begin - fall * 1.5 * roll[0])
        return np.array(off[-1:]), np.zeros(1)

    _, solved = resting_roll(displacements, np.zeros(1), 0.75)
    assert solved.all()
    assert abs(off[-1]) <= 1e-9
    assert len(rolls) <= 16
