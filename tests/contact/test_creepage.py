"""Exact creepage against the linear forms of the seed paper and its limits."""

import numpy as np
import pytest

from wearsim.contact.creepage import ContactPoint, kinematics
from wearsim.contact.geometry import WheelsetPose
from wearsim.contact.solve import solve

RADIUS, SPAN, SPEED = 0.46, 0.75, 20.0


def moved(
    kappa=0.0,
    angle=-0.09,
    wheel_y=-12e-3,
    radius=0.4608,
    height=0.3e-3,
    sine=0.0,
    **state,
):
    """Kinematics of one contact, with all that is not given at zero."""
    names = ("shift", "yaw", "roll", "track_curvature", "approach", "overlap")
    named = dict.fromkeys(names, 0.0) | state
    state = {name: np.atleast_1d(value) for name, value in named.items()}
    point = (np.array([[value]]) for value in (wheel_y, radius, sine, height, angle))
    return kinematics(
        ContactPoint(
            *point,
            approach=state["approach"][:, None],
            overlap=state["overlap"][:, None],
        ),
        WheelsetPose(state["shift"], state["yaw"], state["roll"]),
        speed=np.array([SPEED]),
        half_span=SPAN,
        nominal_radius=RADIUS,
        curvature=kappa,
        track_curvature=state["track_curvature"],
    )


def nominal(motion):
    return motion.creepage(np.array([-SPEED / RADIUS]))[0, 0]


@pytest.mark.parametrize("roller", [1.0, 0.5])
def test_spin_on_a_roller_is_larger_by_the_ratio_of_radii(roller):
    """Table 2 of the seed: 1 + r0/s0 without yaw and roll; imposed, 1e-12."""
    rail, drum = nominal(moved(0.0)), nominal(moved(1.0 / roller))
    assert rail[2] == pytest.approx(np.sin(-0.09) / RADIUS, rel=1e-12)
    assert drum[2] / rail[2] == pytest.approx(1.0 + RADIUS / roller, rel=1e-12)


def test_longitudinal_creepage_without_yaw_is_the_ratio_of_radii():
    """1 - kappa z - r/r0, exactly."""
    for kappa in (0.0, 1.0, 2.0):
        assert nominal(moved(kappa))[0] == pytest.approx(
            1.0 - kappa * 0.3e-3 - 0.4608 / RADIUS, rel=1e-12
        )


@pytest.mark.parametrize("roll", [2e-3, -5e-3])
def test_roll_enters_the_spin_on_a_roller_through_the_wheel_alone(roll):
    """delta/r0 + (delta - roll)/s0 of (37), delta to the axle: the angle to the track
    is delta - roll.
    """
    for kappa in (0.0, 2.0):
        angle = -0.09
        delta = -angle + roll
        linear = -delta / RADIUS - (delta - roll) * kappa
        # Small angles: the cube of 0.1 rad.
        assert nominal(moved(kappa, angle, roll=roll))[2] == pytest.approx(
            linear, rel=2e-3
        )
        assert (
            nominal(moved(kappa, angle, roll=roll))[2]
            != nominal(moved(kappa, angle))[2]
        )


def test_curve_moves_the_ground_under_the_wheels(wheelset, counterface, points, coarse):
    """-+ l/R on the inner and outer wheel, l to the contact itself; exact."""
    curvature = 1.0 / 300.0
    for shift in (-3e-3, 0.0, 4e-3):
        straight = solve(
            points(shift=shift, friction=0.0), wheelset, counterface(), coarse
        )
        curved = points(
            shift=shift, track_curvature=curvature, friction=0.0
        )  # no creep force lifts
        curve = solve(curved, wheelset, counterface(), coarse)
        change = curve.creepage_x - straight.creepage_x
        arm = (SPAN + straight.rail_y) * np.where(straight.side == 0, 1.0, -1.0)
        # rail_y is interpolated on the rail, the creepage's arm on the wheel: microns
        # apart.
        np.testing.assert_allclose(change, -curvature * arm, rtol=1e-5)
        turned = curve.spin - straight.spin
        np.testing.assert_allclose(
            turned, curvature * np.cos(straight.contact_angle), rtol=1e-9
        )


@pytest.mark.parametrize("curvature", [0.0, 1.0, 2.0])
@pytest.mark.parametrize("shift", [-4e-3, 3.5e-3])
def test_linear_forms_of_the_seed(
    wheelset, counterface, points, coarse, curvature, shift
):
    """(35)-(37) as corrected, zero rates, in our axes: what is left falls with the
    square of the yaw.
    """
    yaw = np.array([2.5e-3, 5e-3, 10e-3, 20e-3])
    exact = solve(
        points(shift=shift, yaw=yaw),
        wheelset,
        counterface(curvature),
        coarse,
        sides=(0,),
    )
    profile = counterface(curvature).profile
    wheel = wheelset.right
    height = np.interp(exact.rail_y, profile.y, profile.z)
    radius = RADIUS + np.interp(exact.wheel_y, wheel.y, wheel.z)
    ground = 1.0 - curvature * height  # s/s0
    delta = -exact.contact_angle
    lead = (
        SPAN * yaw * curvature / (1.0 + RADIUS * curvature)
    )  # beta = l yaw / (r0 + s0)
    linear_x = ground - radius / RADIUS
    linear_y = -ground * yaw
    linear_z = -delta / RADIUS - delta * curvature - lead * yaw * curvature
    # The wheel's point is that of the contact plane, micrometres off its profile, alike
    # for all yaws.
    still = solve(
        points(shift=shift), wheelset, counterface(curvature), coarse, sides=(0,)
    )
    height, rolling = (
        np.interp(place, side.y, side.z)
        for place, side in ((still.rail_y, profile), (still.wheel_y, wheel))
    )
    off = still.creepage_x - (1.0 - curvature * height - (RADIUS + rolling) / RADIUS)
    assert abs(off[0]) < 3e-6
    # Longitudinal: the largest omitted term is half the square of the yaw and the
    # wheel's own slope.
    left = abs(exact.creepage_x - off - linear_x)
    assert np.all(left < 1.2 * yaw**2)
    assert np.polyfit(np.log(yaw), np.log(left), 1)[0] == pytest.approx(2.0, abs=0.15)
    # Lateral: projected on the contact plane, 1/cos(delta), and larger by r/r0: second
    # order in angles.
    assert np.all(abs(exact.creepage_y / linear_y - 1.0) < 2.5 * delta**2 + 2e-3)
    # Spin: sine against angle, delta^3/6, and the square of the yaw.
    assert np.all(
        abs(exact.spin - linear_z)
        < (1.0 / RADIUS + curvature) * (delta**3 / 6 + 1.2 * yaw**2)
    )


@pytest.mark.parametrize("angle", [-0.03, -0.4, -1.2])
def test_planes_of_wheel_and_counterface_lie_the_approach_apart(angle):
    """A cone in its contact plane: the rolling radius where the normal meets it, not
    above the centre.
    """
    approach = 0.1e-3
    over = np.array([approach / np.cos(angle)])
    result = nominal(moved(0.0, angle, approach=np.array([approach]), overlap=over))
    along_normal = 0.4608 - approach * np.sin(angle) * np.tan(angle)
    assert result[0] == pytest.approx(1.0 - along_normal / RADIUS, abs=1e-12)
    bent = nominal(
        moved(0.0, angle, approach=np.array([approach]), overlap=over - 2e-6)
    )
    assert bent[0] - result[0] == pytest.approx(
        -2e-6 / RADIUS, rel=1e-9
    )  # the patch is deeper elsewhere
    assert result[2] == nominal(moved(0.0, angle))[2]


def test_creepage_is_linear_in_the_rotation_speed():
    motion = moved(
        1.0, sine=0.01, yaw=0.01, roll=1e-3, shift=2e-3, track_curvature=1e-3
    )
    speeds = np.array([-40.0, -43.0, -46.0])
    values = np.array([motion.creepage(np.array([s]))[0, 0] for s in speeds])
    np.testing.assert_allclose(values[1], 0.5 * (values[0] + values[2]), rtol=1e-12)
    # Turning faster moves the wheel's surface backwards at the contact: by r/V.
    assert motion.per_speed[0, 0, 0] == pytest.approx(0.4608 / SPEED, rel=1e-3)


def test_creepage_against_velocities_by_differences():
    """Wheel and ground as points that move: exact vector form against central
    differences, 1e-7.
    """
    yaw, roll, shift, kappa, curve = 0.03, 4e-3, 3e-3, 2.0, 2e-3
    wheel_y, radius, sine, angle = -10e-3, 0.461, -0.02, -0.12
    speed = -SPEED / RADIUS * 1.001
    motion = moved(
        kappa,
        angle,
        wheel_y,
        radius,
        0.4e-3,
        sine,
        yaw=yaw,
        roll=roll,
        shift=shift,
        track_curvature=curve,
    )
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

    def wheel(time):
        spin = speed * time
        spun = np.array(
            [
                [np.cos(spin), 0.0, np.sin(spin)],
                [0.0, 1.0, 0.0],
                [-np.sin(spin), 0.0, np.cos(spin)],
            ]
        )
        local = np.array(
            [radius * sine, SPAN + wheel_y, radius * np.sqrt(1.0 - sine**2)]
        )
        return turn @ lean @ spun @ local

    step = 1e-6
    wheel_velocity = (wheel(step) - wheel(-step)) / (2.0 * step)
    x, y, z = wheel(0.0) - [0.0, 0.0, RADIUS] + [0.0, shift, 0.0]
    # Roller: axle at z = 1/kappa below its top, turning so that its top moves back at
    # V.
    arm = np.array([x, 0.0, z - 1.0 / kappa])
    e_d = -arm / np.linalg.norm(arm)  # towards the axle
    e_x = np.array([e_d[2], 0.0, -e_d[0]])
    surface = 1.0 / kappa - 0.4e-3  # radius of the roller at the contact
    ground_velocity = -SPEED * kappa * surface * e_x + SPEED * curve * np.array(
        [y, -x, 0.0]
    )
    e_s = np.cos(angle) * np.array([0.0, 1.0, 0.0]) + np.sin(angle) * e_d
    e_n = -np.sin(angle) * np.array([0.0, 1.0, 0.0]) + np.cos(angle) * e_d
    slip = (wheel_velocity - ground_velocity) / SPEED
    omega = speed * (turn @ lean)[:, 1] - np.array([0.0, kappa * SPEED, -SPEED * curve])
    expected = [slip @ e_x, slip @ e_s, omega @ e_n / SPEED]
    np.testing.assert_allclose(
        motion.creepage(np.array([speed]))[0, 0], expected, atol=1e-7
    )
