"""Wheels that rotate independently: the torque of each wheel is balanced."""

from dataclasses import replace

import numpy as np
import pytest

from wearsim.contact.problem import ContactConditions, ContactModels
from wearsim.contact.solve import solve
from wearsim.errors import ContactError, NumericalError

RADIUS = 0.46


@pytest.fixture(scope="module", params=["fast", "standard"])
def models(request):
    return ContactModels.of(request.param, strips=16, cells=16)


def by_wheel(solution, name):
    """Sums over the patches of each wheel (n, 2)."""
    count = int(solution.point.max()) + 1
    place = 2 * solution.point + solution.side
    return np.bincount(place, getattr(solution, name), 2 * count).reshape(-1, 2)


def test_wheels_without_torque_have_no_longitudinal_force(
    wheelset, counterface, points, models
):
    """Spin leaves some N; a rigid axle has 11 kN at 3 mm. Lateral forces stay."""
    conditions = replace(
        points(shift=np.array([0.0, 3e-3, -5e-3]), rotation="independent"),
        free_roll=True,
    )
    wheels = solve(conditions, wheelset, counterface(), models)
    assert np.abs(by_wheel(wheels, "force_x")).max() < 60.0
    axle = solve(replace(conditions, rotation="free"), wheelset, counterface(), models)
    assert np.abs(by_wheel(axle, "force_x")).max() > 5e3


def test_each_wheel_has_half_of_the_torque(wheelset, counterface, points, models):
    """Without yaw the torque is that of the longitudinal forces at the wheel radius,
    but for spin moments: 1 %.
    """
    conditions = points(
        shift=np.array([0.0, 3e-3]), rotation="independent", torque=4000.0
    )
    found = solve(conditions, wheelset, counterface(), models)
    np.testing.assert_allclose(by_wheel(found, "force_x"), 2000.0 / RADIUS, rtol=0.01)


def test_each_wheel_has_its_own_torque(wheelset, counterface, points, models):
    """The right wheel is driven, the left one braked; tolerance as above, at least that
    of spin: 60 N.
    """
    given = points(shift=np.array([0.0, 3e-3]), rotation="independent", torque=1e3)
    conditions = replace(given, torque_difference=np.array([5e3, 0.0]))
    found = by_wheel(solve(conditions, wheelset, counterface(), models), "force_x")
    expected = np.array([[3000.0, -2000.0], [500.0, 500.0]]) / RADIUS
    np.testing.assert_allclose(found, expected, rtol=0.01, atol=60.0)


def test_torques_of_wheels_need_independent_wheels():
    with pytest.raises(ContactError, match="a difference of the torques of both"):
        ContactConditions.of([0.0, 1e-3], torque_difference=100.0)


def test_a_torque_that_one_wheel_cannot_carry_is_an_error_that_states_both(
    wheelset, counterface, points, models
):
    conditions = replace(points(rotation="independent"), torque_difference=40e3)
    with pytest.raises(NumericalError, match=r"of 20000, -20000 N m on the wheels"):
        solve(conditions, wheelset, counterface(), models)


def test_wheels_turn_at_their_own_speeds_in_a_curve(
    wheelset, counterface, points, models
):
    """To the right the left wheel runs faster by 2 l/R of the speed, less what its
    radius is larger: at the track centre, without difference, 1 %.
    """
    conditions = replace(
        points(rotation="independent", track_curvature=1.0 / 50.0), free_roll=True
    )
    found = solve(conditions, wheelset, counterface(), models)
    right, left = (found.rotation_speed[found.side == side][0] for side in (0, 1))
    expected = 1.5 / 50.0 * 20.0 / RADIUS
    np.testing.assert_allclose(left - right, expected, rtol=0.01)


def test_mirrored_points_exchange_the_wheels(wheelset, counterface, points, models):
    """Residuals of torque within their tolerance: 1 N."""
    there, back = (
        solve(
            replace(
                points(
                    shift=sign * 3e-3,
                    yaw=sign * 2e-3,
                    track_curvature=sign / 300.0,
                    rotation="independent",
                ),
                free_roll=True,
            ),
            wheelset,
            counterface(),
            models,
        )
        for sign in (1.0, -1.0)
    )
    for name, sign in (("force_x", 1.0), ("force_y", -1.0)):
        np.testing.assert_allclose(
            by_wheel(back, name)[:, ::-1], sign * by_wheel(there, name), atol=1.0
        )


def test_a_solution_nearby_leads_to_the_same_wheels(
    wheelset, counterface, points, models
):
    """Within the tolerance of torque and loads."""
    conditions = replace(
        points(shift=3e-3, yaw=1e-3, rotation="independent"), free_roll=True
    )
    first = solve(conditions, wheelset, counterface(), models)
    again = solve(
        replace(conditions, nearby=first.nearby[:1]), wheelset, counterface(), models
    )
    np.testing.assert_allclose(again.rotation_speed, first.rotation_speed, rtol=1e-7)
    np.testing.assert_allclose(again.force_y, first.force_y, atol=2.0)
