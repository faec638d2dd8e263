"""Signs and sizes of architecture section 3, written out: whoever flips an axis fails
here.
"""

import numpy as np
import pytest

from wearsim.contact.problem import ContactModels
from wearsim.contact.solve import solve


@pytest.fixture(scope="module")
def right(wheelset, counterface, points):
    return lambda **state: solve(
        points(**state), wheelset, counterface(), ContactModels.of("fast"), sides=(0,)
    )


def test_anchor_of_the_right_wheel(right):
    """S1002 on 60E1 1:40, y = +3 mm: sizes to the rounding of the anchor."""
    contact = right(shift=3e-3)
    assert contact.creepage_x[0] == pytest.approx(-0.0016, abs=1e-4)
    assert contact.spin[0] == pytest.approx(-0.197, abs=6e-3)
    assert contact.contact_angle[0] == pytest.approx(-0.09, abs=2e-3)
    assert contact.creepage_y[0] == 0.0
    assert contact.force_x[0] > 0.0
    assert contact.force_y[0] == pytest.approx(5.5e3, rel=0.08)
    assert contact.power[0] > 0.0


@pytest.mark.parametrize("yaw", [-0.010, -0.002, 0.002, 0.010])
def test_lateral_creepage_is_about_minus_yaw(right, yaw):
    assert right(shift=-4e-3, yaw=yaw).creepage_y[0] == pytest.approx(-yaw, rel=1e-3)


def test_shift_to_the_right_brings_the_right_flange_to_the_rail(right):
    shifts = np.array([-4e-3, 0.0, 3e-3])
    contact = right(shift=shifts)
    assert np.all(np.diff(contact.wheel_y) < 0.0)  # towards the flange, at negative y
    assert np.all(np.diff(contact.contact_angle) < 0.0)
    assert np.all(
        np.diff(contact.creepage_x) < 0.0
    )  # larger rolling radius: it slips backwards


def test_right_curve_slows_the_inner_right_wheel_ground(right):
    """Track curvature > 0: the ground under the right wheel moves back by V (1 -
    l/R).
    """
    straight, curve = right(), right(track_curvature=1.0 / 500.0)
    assert curve.creepage_x[0] - straight.creepage_x[0] == pytest.approx(
        -0.75 / 500.0, rel=0.01
    )


def test_applied_torque_drives_forwards(wheelset, counterface, points):
    both = solve(
        points(rotation="free", torque=4e3),
        wheelset,
        counterface(),
        ContactModels.of("fast"),
    )
    assert np.all(both.force_x > 0.0)
    assert both.force_x.sum() == pytest.approx(
        4e3 / 0.46, rel=2e-3
    )  # rolling radii within 1 mm of 460
    assert np.all(both.rotation_speed > 20.0 / 0.46)
