"""Creepages that are given instead of following from the motion."""

from dataclasses import replace

import numpy as np
import pytest

from wearsim.contact.solve import solve
from wearsim.errors import ContactError


def given(solution):
    return np.stack((solution.creepage_x, solution.creepage_y, solution.spin), axis=1)


@pytest.mark.parametrize("side", [0, 1])
def test_the_creepages_of_a_motion_give_its_forces(
    wheelset, counterface, points, coarse, side
):
    """To the tolerance of the wheel load, 1e-6; left wheels keep the signs of the track
    axes.
    """
    conditions = points(shift=np.array([-2e-3, 3e-3]), yaw=4e-3)
    moved = solve(conditions, wheelset, counterface(1.0), coarse, sides=(side,))
    imposed = solve(
        replace(conditions, creepage=given(moved)),
        wheelset,
        counterface(1.0),
        coarse,
        sides=(side,),
    )
    for name in (
        "creepage_x",
        "creepage_y",
        "spin",
        "force_x",
        "force_y",
        "spin_moment",
        "power",
    ):
        np.testing.assert_allclose(
            getattr(imposed, name),
            getattr(moved, name),
            rtol=2e-6,
            atol=1e-5,
            err_msg=name,
        )


def test_given_creepages_do_not_ask_the_rotation_rule(
    wheelset, counterface, points, coarse
):
    """No balance is sought, so one that could not be found does no harm; the nominal
    speed is reported.
    """
    conditions = points(shift=3e-3, rotation="free", torque=1e9)
    imposed = solve(
        replace(conditions, creepage=np.array([[-0.0017, 0.0, 0.197]])),
        wheelset,
        counterface(),
        coarse,
        sides=(0,),
    )
    assert given(imposed).tolist() == [[-0.0017, 0.0, 0.197]]
    assert imposed.rotation_speed.tolist() == [20.0 / 0.46]


def test_given_creepages_belong_to_one_patch(wheelset, counterface, points, coarse):
    """At 5.5 mm tread and flange root touch."""
    creepage = np.zeros((3, 3))
    conditions = replace(points(shift=np.array([0.0, 3e-3, 5.5e-3])), creepage=creepage)
    with pytest.raises(
        ContactError, match=r"point 2, right wheel.*several patches close"
    ) as caught:
        solve(conditions, wheelset, counterface(), coarse, sides=(0,))
    assert caught.value.row == 2


def test_errors_know_their_point_across_chunks(wheelset, counterface, points, coarse):
    shift = np.zeros(70)
    shift[67] = 60e-3
    with pytest.raises(ContactError, match=r"point 67, right wheel") as caught:
        solve(points(shift=shift), wheelset, counterface(), coarse)
    assert caught.value.row == 67


def test_friction_never_gives_power_back(wheelset, counterface, points, coarse):
    """Random creepages over six decades: -V F . creepage is positive without the guard
    against rounding.
    """
    rng = np.random.default_rng(1)
    direction = rng.normal(size=(2000, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    creepage = (
        direction
        * 10.0 ** rng.uniform(-6.0, 0.0, 2000)[:, None]
        * np.array([1.0, 1.0, 200.0])
    )
    for shift in (0.0, 3e-3):
        conditions = replace(points(shift=np.full(2000, shift)), creepage=creepage)
        solution = solve(conditions, wheelset, counterface(), coarse, sides=(0,))
        force = np.stack(
            (solution.force_x, solution.force_y, solution.spin_moment), axis=1
        )
        assert np.all(-(force * given(solution)).sum(axis=1) > 0.0)
