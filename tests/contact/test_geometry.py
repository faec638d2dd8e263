"""Search for the contact: surfaces of revolution against brute force, limits and
symmetries.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from wearsim.contact import geometry
from wearsim.contact.geometry import WheelsetPose
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.solve import ContactModels, solve
from wearsim.errors import ContactError
from wearsim.profile.shape import Profile

RADIUS, SPAN = 0.46, 0.75


def gap_of(wheel, rail, shift, yaw, kappa, roll=0.0):
    return geometry.gap(
        geometry.wheel_surface(wheel, RADIUS),
        geometry.counterface_profile(rail),
        WheelsetPose(np.array([shift]), np.array([yaw]), np.array([roll])),
        half_span=SPAN,
        nominal_radius=RADIUS,
        curvature=kappa,
    )


def wheel_point(ring_y, radius, theta, shift, yaw, roll):
    """Point of the turned wheel in track axes, z from the rail's top; written out with
    rotation matrices.
    """
    turn = np.array(
        [
            [np.cos(yaw), -np.sin(yaw), 0.0],
            [np.sin(yaw), np.cos(yaw), 0.0],
            [0.0, 0.0, 1.0],
        ]
    )
    lean = np.array(
        [
            [1.0, 0.0, 0.0],
            [0.0, np.cos(roll), -np.sin(roll)],
            [0.0, np.sin(roll), np.cos(roll)],
        ]
    )
    local = np.array(
        [radius * np.sin(theta), SPAN + ring_y + 0.0 * theta, radius * np.cos(theta)]
    )
    x, y, z = np.tensordot(turn @ lean, local, axes=1)
    return x, y + shift - SPAN, z - RADIUS


def overlap(y, x, z, height, kappa):
    """Radial distance between a point and a counterface of revolution with the profile
    `height`(y).
    """
    if kappa == 0.0:
        return height(y) - z
    axle = 1.0 / kappa
    return np.hypot(x, z - axle) - (axle - height(y))


@pytest.mark.parametrize("radius", [np.inf, 1.0, 0.5])
@pytest.mark.parametrize("yaw", [0.0, 0.010, -0.010, 0.060, 0.100, -0.100])
@pytest.mark.parametrize("shift", [0.0, 3e-3, -4e-3])
def test_closest_point_against_brute_force(s1002, rail_60e1, radius, yaw, shift):
    """Dense search over rings and angles, polished; ours samples every 0.1 mm of both
    profiles.
    """
    kappa, roll = 1.0 / radius, 1e-3
    wheel, ground = (
        geometry.wheel_surface(s1002, RADIUS),
        geometry.counterface_profile(rail_60e1),
    )
    height, ring = CubicSpline(ground.y, ground.z), CubicSpline(wheel.y, wheel.radius)
    theta = np.linspace(-0.5, 0.5, 1001)
    # Field side first: only the part of the wheel above the rail.
    rows = [wheel_point(y, ring(y), theta, shift, yaw, roll) for y in wheel.y[::4]]
    x, y, z = np.moveaxis(np.array(rows), 1, 0)
    inside = (y > ground.y[3]) & (y < ground.y[-3])
    distance = np.where(
        inside, overlap(np.where(inside, y, 0.0), x, z, height, kappa), 1.0
    )
    start = np.unravel_index(np.argmin(distance), distance.shape)

    def function(p):
        px, py, pz = wheel_point(1e-3 * p[0], ring(1e-3 * p[0]), p[1], shift, yaw, roll)
        return 1e6 * overlap(py, px, pz, height, kappa)

    result = minimize(
        function,
        [1e3 * wheel.y[::4][start[0]], theta[start[1]]],
        method="Nelder-Mead",
        options={"xatol": 1e-7, "fatol": 1e-7, "maxiter": 4000},
    )
    ours = gap_of(s1002, rail_60e1, shift, yaw, kappa, roll)
    i = int(np.argmin(ours.gap[0]))
    # Half a grid step beside the minimum of a gap of curvature up to 100 1/m: 0.13 um.
    assert ours.gap[0, i] == pytest.approx(1e-6 * result.fun, abs=1.5e-7)
    # A grid step of both profiles, and what the flat bottom of the gap leaves open.
    assert ours.wheel_y[0, i] == pytest.approx(1e-3 * result.x[0], abs=2e-4)
    assert ours.sin_theta[0, i] == pytest.approx(
        np.sin(result.x[1]), abs=2e-4 + 0.03 * abs(yaw)
    )


def test_gap_without_yaw_and_roll_is_the_difference_of_the_profiles(s1002, rail_60e1):
    """Rings lie in vertical planes: heights subtract, to the interpolation of the
    profiles.
    """
    ours = gap_of(s1002, rail_60e1, 2e-3, 0.0, 0.0)
    wheel = geometry.wheel_surface(s1002, RADIUS)
    near = ours.gap[0] < 2e-3
    expected = ours.counterface.z - (
        np.interp(ours.counterface.y - 2e-3, wheel.y, wheel.radius) - RADIUS
    )
    np.testing.assert_allclose(ours.gap[0, near], expected[near], atol=1e-12)
    np.testing.assert_allclose(
        ours.wheel_y[0, near], ours.counterface.y[near] - 2e-3, atol=1e-12
    )
    assert not ours.sin_theta.any()


def test_roller_and_rail_have_one_gap_without_yaw(s1002, rail_60e1):
    """Below the axle the unrolled height is the height itself, whatever the
    curvature.
    """
    rail = gap_of(s1002, rail_60e1, 3e-3, 0.0, 0.0)
    roller = gap_of(s1002, rail_60e1, 3e-3, 0.0, 2.0)
    near = rail.gap[0] < 2e-3
    np.testing.assert_allclose(roller.gap[0, near], rail.gap[0, near], atol=1e-15)


def test_infinite_roller_is_bit_equal_to_the_rail(
    wheelset, counterface, points, coarse
):
    conditions = points(
        shift=np.array([0.0, 3e-3, -4e-3]), yaw=np.array([0.0, 0.01, -0.02])
    )
    rail = solve(conditions, wheelset, counterface(0.0), coarse)
    endless = solve(conditions, wheelset, counterface(1.0 / np.inf), coarse)
    for name in (
        "rail_y",
        "area",
        "max_pressure",
        "creepage_x",
        "spin",
        "force_y",
        "power",
    ):
        assert getattr(rail, name).tobytes() == getattr(endless, name).tobytes(), name


@pytest.mark.parametrize(
    ("shift", "yaw"), [(3e-3, 0.0), (-4e-3, 0.005), (3.5e-3, -0.01)]
)
def test_roller_approaches_the_rail_with_first_order_in_curvature(
    wheelset, counterface, points, coarse, shift, yaw
):
    """Area, pressure, creepage and power away from jumps of the contact."""
    kappa = np.geomspace(1e-4, 1e-1, 7)
    conditions = points(shift=shift, yaw=yaw)
    rail = solve(conditions, wheelset, counterface(0.0), coarse, sides=(0,))
    rollers = [
        solve(conditions, wheelset, counterface(k), coarse, sides=(0,)) for k in kappa
    ]
    for name in ("area", "max_pressure", "creepage_x", "spin", "force_x", "power"):
        difference = [
            abs(getattr(r, name)[0] - getattr(rail, name)[0]) for r in rollers
        ]
        order = np.polyfit(np.log(kappa), np.log(difference), 1)[0]
        assert 0.9 < order < 1.1, name


def test_left_wheel_mirrors_the_right_one(wheelset, counterface, points, coarse):
    """Imposed symmetry: 1e-9."""
    shift = np.array([-4e-3, -1e-3, 2e-3, 4.5e-3])
    yaw, roll = np.array([0.01, -0.02, 0.0, 0.03]), np.array([1e-3, 0.0, -2e-3, 0.0])
    curve = np.array([0.0, 1e-3, -2e-3, 0.0])
    for kappa in (0.0, 2.0):
        right = solve(
            points(shift, yaw, roll, track_curvature=curve),
            wheelset,
            counterface(kappa),
            coarse,
            sides=(0,),
        )
        left = solve(
            points(-shift, -yaw, -roll, track_curvature=-curve),
            wheelset,
            counterface(kappa),
            coarse,
            sides=(1,),
        )
        for name in (
            "wheel_y",
            "rail_y",
            "x",
            "area",
            "max_pressure",
            "creepage_x",
            "force_x",
            "power",
        ):
            np.testing.assert_allclose(
                getattr(left, name), getattr(right, name), rtol=1e-9, err_msg=name
            )
        for name in ("contact_angle", "creepage_y", "spin", "force_y", "spin_moment"):
            np.testing.assert_allclose(
                getattr(left, name), -getattr(right, name), rtol=1e-9, err_msg=name
            )
        np.testing.assert_allclose(
            left.fields.shear_y, -right.fields.shear_y, rtol=1e-9
        )
        np.testing.assert_allclose(
            left.fields.work_density, right.fields.work_density, rtol=1e-9
        )


def test_flange_touches_ahead_of_the_axle_with_yaw(
    wheelset, counterface, points, coarse
):
    """Seen from the wheel's own centre, which yaw > 0 moves back, the flange touches
    ahead of it.
    """
    ahead = solve(
        points(shift=6e-3, yaw=0.02), wheelset, counterface(), coarse, sides=(0,)
    )
    straight = solve(
        points(shift=6e-3, yaw=0.0), wheelset, counterface(), coarse, sides=(0,)
    )
    behind = solve(
        points(shift=6e-3, yaw=-0.02), wheelset, counterface(), coarse, sides=(0,)
    )
    centre = 0.75 * np.sin(0.02)
    assert ahead.x[0] + centre > straight.x[0] + 1e-3
    assert behind.x[0] - centre < straight.x[0] - 1e-3


def test_profile_that_is_too_steep_in_its_middle_is_refused():
    z = np.array([0.0, 0.0, 0.0, -0.005, -0.01, -0.01, -0.01])
    y = np.array([0.0, 0.01, 0.02, 0.02, 0.02, 0.03, 0.04])
    with pytest.raises(ContactError, match="steeper than 86 degrees"):
        geometry.counterface_profile(Profile("step", "rail", y, z))


def test_wheelset_beside_the_rail_names_point_and_wheel(
    wheelset, counterface, points, coarse
):
    with pytest.raises(
        ContactError,
        match=r"point 1, right wheel, shift 70 mm, yaw 0 mrad: .*check shift",
    ):
        solve(
            points(shift=np.array([0.0, 70e-3])),
            wheelset,
            counterface(),
            coarse,
            sides=(0,),
        )


def test_worn_down_wheel_keeps_its_gap_when_its_height_is_free(s1002, rail_60e1):
    """Only differences of the gap count: 1 mm less radius all over moves it by 1 mm."""
    thin = Profile("thin", "wheel", s1002.y, s1002.z - 1e-3)
    fresh, worn = (
        gap_of(s1002, rail_60e1, 1e-3, 0.0, 1.0),
        gap_of(thin, rail_60e1, 1e-3, 0.0, 1.0),
    )
    near = fresh.gap[0] < 1e-3
    np.testing.assert_allclose(worn.gap[0, near], fresh.gap[0, near] + 1e-3, atol=1e-12)


@pytest.mark.parametrize("kappa", [0.0, 1.0, 2.0])
@pytest.mark.parametrize(("yaw", "roll"), [(0.03, 0.0), (-0.1, -5e-3)])
def test_normals_of_the_contact_line_meet_the_axle_of_the_counterface(
    s1002, rail_60e1, kappa, yaw, roll
):
    """Normals from rotation matrices; between two circles to second order of their
    distance.
    """
    turn = Rotation.from_euler("ZX", [yaw, roll]).as_matrix()
    rail = geometry.counterface_profile(rail_60e1)
    pose = WheelsetPose(np.array([2e-3]), np.array([yaw]), np.array([roll]))
    spacing, error = np.array([2e-4, 1e-4, 5e-5]), []
    for one in spacing:
        wheel = geometry.wheel_surface(s1002, RADIUS, one)
        span = {"half_span": SPAN, "nominal_radius": RADIUS}
        ours = geometry.gap(wheel, rail, pose, **span, curvature=kappa)
        there = ours.gap[0] < 5e-3
        y, radius, sine = (
            curve[0, there]
            for curve in (ours.wheel_y, ours.wheel_radius, ours.sin_theta)
        )
        slope, cosine = CubicSpline(wheel.y, wheel.radius)(y, 1), np.sqrt(1.0 - sine**2)
        x, _, z = turn @ np.array([radius * sine, SPAN + y, radius * cosine])
        normal = turn @ np.array([sine, -slope, cosine])
        along = (1.0 - kappa * (z - RADIUS)) * normal[0] + kappa * x * normal[2]
        error.append(np.abs(along / np.linalg.norm(normal, axis=0)).max())
        np.testing.assert_allclose(ours.x[0, there], x, atol=0.3e-6 * (one / 1e-4) ** 2)
    assert error[1] < 1e-5
    assert np.polyfit(np.log(spacing), np.log(error), 1)[0] > 1.6


def stepped(s1002, depth=0.8e-3, foot=10e-3, height=1.5e-3):
    """S1002 whose flank is worn up to a step that overhangs by 5 degrees, 10 mm
    high.
    """
    y, z = s1002.y, s1002.z
    flank = (np.arange(y.size) > np.argmax(z)) & (y < -25e-3)
    worn = (
        depth
        * np.clip((foot + height - z) / height, 0.0, 1.0)
        * np.clip((z - 1e-3) / 3e-3, 0.0, 1.0)
    )
    return replace(s1002, y=y - worn * flank)


@pytest.mark.parametrize("shift", [0.0, 7.5e-3])
def test_a_flange_beyond_a_steep_step_is_still_there(s1002, rail_60e1, shift):
    """Over each point the gap is that of the furthest part of the wheel's polygon;
    nothing is cut off.
    """
    wheel = stepped(s1002)
    surface = geometry.wheel_surface(wheel, RADIUS)
    assert surface.radius[0] == pytest.approx(RADIUS + wheel.z.max(), abs=1e-6)
    assert np.all(np.diff(surface.y) > 0.0)
    ours = gap_of(wheel, rail_60e1, shift, 0.0, 0.0)
    grid, tip = ours.counterface, int(np.argmax(wheel.z))
    y, z = wheel.y[tip:] + shift, wheel.z[tip:]
    low, high = np.minimum(y[1:], y[:-1]), np.maximum(y[1:], y[:-1])
    furthest = np.full(grid.y.size, -np.inf)
    for i, place in enumerate(grid.y):
        over = np.flatnonzero((low <= place) & (place <= high))
        share = (place - y[over]) / (y[over + 1] - y[over])
        furthest[i] = np.max(z[over] + share * (z[over + 1] - z[over]), initial=-np.inf)
    there = np.isfinite(furthest) & (furthest < 8e-3)  # the tread side of the step
    # 89 degrees for the overhang: the wheel is up to 1.5 mm / 57 fuller at its foot,
    # which 60 degrees double
    assert np.max(np.abs((grid.z - furthest - ours.gap[0])[there])) < 60e-6
    assert np.all(ours.gap[0] < geometry.NO_WHEEL)


@pytest.mark.parametrize("normal", NORMAL_MODELS)
def test_steep_parts_are_no_edges_of_a_profile_and_true_ends_are(
    s1002, rail_60e1, normal
):
    """The flank above the step carries the wheel; the same wheel without anything above
    the step does not.
    """

    def solved(wheel, shift):
        models = ContactModels(normal=normal, tangential="fastsim")
        return NORMAL_MODELS[normal](
            gap_of(wheel, rail_60e1, shift, 0.0, 0.0),
            np.zeros(1, dtype=np.int64),
            np.array([60e3]),
            vertical=True,
            effective_modulus=models.effective_modulus,
            resolution=models.resolution,
            parameters=dict(models.parameters),
        )

    wheel = stepped(s1002)
    solution = solved(wheel, 7.5e-3)
    assert np.degrees(np.abs(solution.contact_angle)).max() > 65.0
    kept = slice(int(np.argmin(np.abs(wheel.y + 30e-3))), None)
    with pytest.raises(ContactError, match="edge of a profile"):
        solved(replace(wheel, y=wheel.y[kept], z=wheel.z[kept]), 7.5e-3)


def test_circles_too_steep_for_a_yaw_lie_at_the_height_of_the_axle(s1002, rail_60e1):
    """At 60 mrad nothing steeper than 86.6 degrees comes nearest anywhere; the gap is
    finite all the same.
    """
    ours = gap_of(stepped(s1002), rail_60e1, 6e-3, 0.06, 1.0)
    assert np.all(np.isfinite(ours.gap))
    assert np.all(np.abs(ours.sin_theta) <= 1.0)
