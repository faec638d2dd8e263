"""Points of a vehicle on its route: motion on straight track, curves of both axles,
shares.
"""

from dataclasses import replace

import numpy as np
import pytest

from wearsim.contact.solve import ContactConditions, Counterface, Wheelset, solve
from wearsim.operation.bogie import Vehicle
from wearsim.operation.points import select
from wearsim.operation.route import (
    POSITIONS,
    AxleShares,
    Curve,
    Motion,
    Tangent,
    creep_coefficients,
    klingel,
    reduced,
    resting,
    route,
    yaw_over_shift,
)
from wearsim.profile import standard

VEHICLE = Vehicle(
    half_wheelbase=1.25,
    half_pivot_distance=8.0,
    wheelset_mass=1500.0,
    bogie_mass=3500.0,
    body_mass=36000.0,
    bogie_height=0.6,
    body_height=1.7,
    lateral_stiffness=10e6,
    yaw_stiffness=10e6,
)
COMMON = {"speed": 20.0, "friction": 0.35, "friction_flange": 0.35, "environment": 1.0}
STRAIGHT = Tangent(name="straight", share=0.5, std=2e-3, **COMMON)
RIGHT = Curve(name="curve", share=0.5, curvature=1e-3, acceleration=-0.5, **COMMON)
MOTION = Motion("suspended", 8.7, (8e6, 8e6), 0.18, 6.6e-3)
HALF = AxleShares(0.5, 0.5)


def test_shares_add_up_and_curves_have_both_axles_as_the_train_stands_and_turned(
    bodies,
):
    points = route([STRAIGHT, RIGHT], VEHICLE, HALF, [MOTION], bodies(0.0)[0])
    assert points.weight.sum() == pytest.approx(1.0)
    assert points.weight[: 2 * POSITIONS].sum() == pytest.approx(0.5)
    np.testing.assert_allclose(points.weight[2 * POSITIONS :], 0.125)
    np.testing.assert_allclose(
        points.conditions.track_curvature[-4:], [1e-3, 1e-3, -1e-3, -1e-3]
    )
    straight = slice(0, 2 * POSITIONS)  # where the path of the wheelset alone is curved
    assert np.abs(points.conditions.track_curvature[straight]).max() > 1e-5
    assert not points.curvature[straight].any()
    np.testing.assert_array_equal(points.curvature[-4:], [1e-3, 1e-3, -1e-3, -1e-3])
    order = np.array([-1, 0])
    np.testing.assert_array_equal(select(points, order).curvature, [-1e-3, 0.0])
    bogies = points.controlled.bogies
    np.testing.assert_array_equal(bogies.leading, 2 * POSITIONS + np.array([0, 2]))
    np.testing.assert_array_equal(bogies.trailing, 2 * POSITIONS + np.array([1, 3]))
    np.testing.assert_allclose(bogies.acceleration, [-0.5, 0.5])
    # centrifugal: the outer, left wheel carries more in a curve to the right, by the
    # height above the axle
    assert points.conditions.box_moment[-4] < 0.0 < points.conditions.box_moment[-1]
    one_way = route(
        [STRAIGHT, RIGHT], VEHICLE, AxleShares(1.0, 0.0), [MOTION], bodies(0.0)[0]
    )
    np.testing.assert_allclose(one_way.weight[-2:], [0.5, 0.0])
    assert one_way.weight.size == POSITIONS + 2


def test_positions_are_those_of_a_normal_process_until_the_flange(bodies):
    free = replace(MOTION, clearance=np.inf)
    points = route([STRAIGHT], VEHICLE, HALF, [free], bodies(0.0)[0])
    shift, weight = points.conditions.shift, points.weight
    for power, moment in ((1, 0.0), (2, 1.0), (4, 3.0)):
        assert weight @ (shift / 2e-3) ** power == pytest.approx(moment, abs=1e-12)
    cut = route([STRAIGHT], VEHICLE, HALF, [MOTION], bodies(0.0)[0])
    assert np.abs(cut.conditions.shift).max() < 6.6e-3
    np.testing.assert_allclose(cut.weight, weight)


def test_a_free_cone_follows_klingel_and_does_not_creep(models):
    """Yaw of the path at its wavelength; the roll moves the contact by 5 % of the
    creepage at rest.
    """
    cone = standard.wheel("cone")
    wheelset = Wheelset(cone, cone, 0.46, 0.75)
    rails = Counterface(standard.rail("60E1", 1 / 20, 1.435, 0.75), 0.0)
    wavelength = klingel(wheelset, 0.05)
    free = replace(
        MOTION, rule="kinematic", conicity=0.05, wavelength=wavelength, clearance=6e-3
    )
    yaws = yaw_over_shift(VEHICLE, free, wheelset)
    np.testing.assert_allclose(yaws, 2.0j * np.pi / wavelength, rtol=1e-9)
    track = [replace(STRAIGHT, std=1e-3)]
    moving = route(track, VEHICLE, HALF, [free], wheelset).conditions
    at_rest = route(
        track, VEHICLE, HALF, [replace(free, rule="shifted")], wheelset
    ).conditions
    creepage = [
        np.abs(solve(one, wheelset, rails, models).creepage_x).max()
        for one in (moving, at_rest)
    ]
    assert creepage[0] < 0.06 * creepage[1]
    assert creepage[1] == pytest.approx(
        np.abs(at_rest.shift).max() * 0.05 / 0.46, rel=0.06
    )


def test_the_yaw_stiffness_goes_from_kinematic_to_guided_motion(bodies):
    """Contact yaw over the slope of the path: spec/operation.md, section 3, in whole
    per cent.
    """
    wheelset, slope = bodies(0.0)[0], 2.0j * np.pi / 8.7
    for stiffness, expected in (
        (0.0, 0.0),
        (1e6, 0.12),
        (5e6, 0.51),
        (10e6, 0.72),
        (40e6, 0.87),
    ):
        leading, _ = yaw_over_shift(
            replace(VEHICLE, yaw_stiffness=stiffness), MOTION, wheelset
        )
        assert abs(leading - slope) / abs(slope) == pytest.approx(expected, abs=0.006)
    guided = yaw_over_shift(VEHICLE, replace(MOTION, rule="guided"), wheelset)
    assert guided == (0.0, 0.0)


def test_a_shifted_wheelset_does_not_move(bodies):
    wheelset = bodies(0.0)[0]
    points = {
        rule: route(
            [STRAIGHT], VEHICLE, HALF, [replace(MOTION, rule=rule)], wheelset
        ).conditions
        for rule in ("shifted", "guided")
    }
    for name in ("yaw", "track_curvature", "drift"):
        assert not np.any(getattr(points["shifted"], name))
    shift, slope = (
        points["guided"].shift,
        points["guided"].drift * MOTION.wavelength / (2.0 * np.pi),
    )
    # on a circle in shift and slope: each amplitude with all its phases
    np.testing.assert_allclose(
        np.hypot(shift, slope).reshape(-1, 8).std(axis=1), 0.0, atol=1e-15
    )


def test_the_creep_coefficients_are_those_of_a_small_creepage(bodies, models):
    wheelset, rails = bodies(0.0)
    creep, across = creep_coefficients(wheelset, rails, models, 8e4)
    yawed = ContactConditions.of(
        [0.0], wheel_load=8e4, creepage=np.array([[1e-6, 0.0, 0.0]])
    )
    contact = solve(yawed, wheelset, rails, models, sides=(0,))
    assert contact.force_x[0] == pytest.approx(-1e-6 * creep, rel=1e-3)
    # Kalker's C11 of ellipses, G a b of this area: 3.5 to 6 between a/b = 0.2 and 3
    assert 3.5 < creep * np.pi / (210e9 / 2.6 * contact.area[0]) < 6.0
    assert 2.5 < across * np.pi / (210e9 / 2.6 * contact.area[0]) < 6.0  # C22


def test_each_state_of_a_class_has_its_share_and_set_points(bodies):
    varied = {
        "torques": ((3e3, 0.2), (-2e3, 0.8)),
        "rails": ((0, 0.7), (1, 0.3)),
        "lubricated": 0.25,
    }
    track = [replace(STRAIGHT, **varied), replace(RIGHT, friction_flange=0.1, **varied)]
    points = route(
        track, VEHICLE, HALF, [MOTION, replace(MOTION, clearance=1e-3)], bodies(0.0)[0]
    )
    conditions, weight, rail = points.conditions, points.weight, points.conditions.rail
    assert weight.sum() == pytest.approx(1.0)
    assert weight[rail == 1].sum() == pytest.approx(0.3)
    assert weight[conditions.torque == 3e3].sum() == pytest.approx(0.2)
    curved = conditions.track_curvature == 1e-3
    assert weight[curved & (conditions.friction_flange == 0.1)].sum() == pytest.approx(
        0.25 * 0.25
    )
    assert weight[curved & (conditions.friction_flange == 0.35)].sum() == pytest.approx(
        0.25 * 0.75
    )
    assert (
        len({label for label in points.label if label.startswith("curve")})
        == 2 * 2 * 2 * 4
    )
    assert set(points.class_name) == {"straight", "curve leading", "curve trailing"}
    straight = conditions.shift[np.array(points.class_name) == "straight"]
    assert (
        np.abs(straight[-10:]).max() < 1e-3 < np.abs(straight).max()
    )  # narrow rails cut the motion
    assert points.of_track == (0,) * 192 + (1,) * 16 + (0,) * 192 + (1,) * 16


def test_a_body_that_holds_the_bogies_parts_the_leading_from_the_trailing_axle(bodies):
    held = replace(VEHICLE, secondary_yaw_stiffness=1e6)
    for outer, front in ((True, [1.0, -1.0]), (False, [-1.0, 1.0])):
        points = route(
            [RIGHT], held, AxleShares(0.7, 0.0, outer), [MOTION], bodies(0.0)[0]
        )
        np.testing.assert_array_equal(points.controlled.bogies.in_front, front)
        np.testing.assert_allclose(points.weight, [0.7, 0.0, 0.0, 0.3])


def test_points_run_on_their_rails(bodies, models):
    """The solution of points on two pairs of rails is that of each pair by itself, bit
    by bit.
    """
    wheelset, rails = bodies(0.0)
    wide = Counterface(standard.rail("60E1", 1 / 20, 1.445, 0.75), 0.0)
    shift, both = np.array([1e-3, 2e-3, 3e-3]), replace(rails, further=(wide,))
    rail = np.array([0, 1, 0])
    found = solve(ContactConditions.of(shift, rail=rail), wheelset, both, models)
    for k, one in ((0, rails), (1, wide)):
        alone = solve(ContactConditions.of(shift[rail == k]), wheelset, one, models)
        own = rail[found.point] == k
        np.testing.assert_array_equal(found.power[own], alone.power)
        np.testing.assert_array_equal(found.wheel_y[own], alone.wheel_y)


def test_unlike_wheels_rest_where_their_rolling_radii_are_alike(models):
    """A free axle with a right wheel larger by D in diameter runs D/(4 lambda) to the
    left, without creepage.

    In the middle it rests at a roll of phi = D/4 / (l - lambda r0), which moves the
    contact by r0 phi under the cone and by rho phi on the head of the rail, rho its
    radius: creepage of a wheel D/(4 r0) and lambda (r0 + rho) phi / r0. Neglected, each
    below 3e-4 of that: contact 2.5 mm off the running circle, where the cone is smaller
    by lambda 2.5 mm / r0 and l longer by 2.5 mm, and squares of D/r0.
    """
    cone, radius, half_span, slope, head, larger = (
        standard.wheel("cone"),
        0.46,
        0.75,
        0.05,
        0.3,
        0.4e-3,
    )
    wheelset = Wheelset(cone, cone, radius, half_span, diameter_difference=larger)
    rails = Counterface(standard.rail("60E1", 1 / 20, 1.435, half_span), 0.0)
    free = replace(MOTION, rule="kinematic", conicity=slope)
    state = resting(VEHICLE, free, wheelset)
    np.testing.assert_allclose(state, [[-2e-3, 0.0]] * 2, atol=1e-9)
    points = ContactConditions.of([state[0, 0], 0.0], free_roll=True)
    right, left = solve(points, wheelset, rails, models).creepage_x.reshape(-1, 2).T
    roll = larger / 4.0 / (half_span - slope * radius)
    expected = (larger / 4.0 + slope * (radius + head) * roll) / radius
    np.testing.assert_allclose(
        0.5 * (left - right), [0.0, expected], atol=1e-3 * expected
    )
    np.testing.assert_allclose(
        0.5 * (left + right), 0.0, atol=1e-3 * expected
    )  # no torque
    held = resting(VEHICLE, replace(MOTION, conicity=0.05), wheelset)
    np.testing.assert_allclose(held, state, atol=1e-9)  # so does a bogie as a whole
    moving = route(
        [replace(STRAIGHT, std=1e-3)], VEHICLE, HALF, [free], wheelset
    ).conditions
    np.testing.assert_allclose(moving.shift.mean(), -2e-3, atol=1e-9)


def test_segments_become_classes_by_what_wears_and_the_same_track_cut_finer_the_same_ones():
    random = np.random.default_rng(5)
    radius, sign = (
        random.choice([400.0, 420.0, 900.0, 2000.0], 40),
        random.choice([-1.0, 1.0], 40),
    )
    bent = [
        replace(RIGHT, curvature=float(curvature), share=float(length))
        for curvature, length in zip(
            sign / radius, random.uniform(0.1, 0.6, 40), strict=True
        )
    ]
    segments = [*bent, replace(STRAIGHT, share=9.0)]

    def worn(track):
        """Wear that goes with the square of the curvature, of either side."""
        made = np.zeros((len(track), 2, 1))
        for k, one in enumerate(track):
            curvature = getattr(one, "curvature", 0.0)
            made[k, int(curvature > 0.0), 0] = one.share * curvature**2
        return made

    def total(track):
        return worn(track).sum(axis=0)

    classes, error = reduced(segments, worn, 0.02)
    assert error <= 0.02
    assert 4 <= len(classes) < 10
    assert sum(one.share for one in classes) == pytest.approx(
        sum(one.share for one in segments)
    )
    np.testing.assert_allclose(total(classes), total(segments), rtol=0.02)
    halves = [replace(one, share=0.5 * one.share) for one in segments for _ in (0, 1)]
    again, _ = reduced(halves, worn, 0.02)
    assert [one.name for one in again] == [one.name for one in classes]
    exact, error = reduced(segments, worn, 1e-15)
    assert error < 1e-12
    assert len(exact) == len({getattr(one, "curvature", 0.0) for one in segments})


def test_segments_that_wear_equally_stay_together():
    """Straight track of many speeds needs no more classes than are tried at first."""
    speeds = np.linspace(20.0, 40.0, 60)
    segments = [replace(STRAIGHT, speed=speed, share=0.5) for speed in speeds]
    segments.append(replace(RIGHT, share=1.0))

    def worn(track):
        """Wear of curves is four times that of straight track, at any speed."""
        factor = [4.0 if hasattr(one, "curvature") else 1.0 for one in track]
        share = [one.share for one in track]
        return np.multiply(factor, share)[:, None, None] * np.ones((2, 5))

    classes, error = reduced(segments, worn, 0.02)
    assert len(classes) == 4
    assert error < 1e-12


def test_segments_of_equal_wear_by_unlike_set_points_are_divided():
    """Wear is the product of environment and friction, not that of their means."""
    pairs = [(1.0, 0.1), (0.2, 0.5)]
    segments = [
        replace(STRAIGHT, environment=environment, friction=friction, share=1.0)
        for environment, friction in pairs
    ]

    def worn(track):
        wear = [one.share * one.environment * one.friction for one in track]
        return np.array(wear)[:, None, None] * np.ones((2, 5))

    classes, error = reduced(segments, worn, 0.02)
    assert len(classes) == 2
    assert error < 1e-12


def test_the_error_of_classes_is_that_against_all_segments():
    random = np.random.default_rng(8)
    radii = random.uniform(250.0, 4000.0, 120)
    segments = [replace(RIGHT, curvature=1.0 / radius, share=1.0) for radius in radii]

    def worn(track):
        """Wear that jumps sevenfold at a radius of 500 m."""
        made = np.zeros((len(track), 2, 3))
        for k, one in enumerate(track):
            severe = 7.0 if one.curvature > 1.0 / 500.0 else 1.0
            made[k, 1, 1] = one.share * severe * one.curvature
        return made

    classes, error = reduced(segments, worn, 0.05)
    of_all, of_classes = (worn(track).sum() for track in (segments, classes))
    assert error <= 0.05
    assert error == pytest.approx(abs(of_classes - of_all) / of_all)
