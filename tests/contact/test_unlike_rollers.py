"""Rollers whose radii differ by side: each wheel as on a pair of its own, and the
speeds of one shaft.
"""

from dataclasses import replace

import numpy as np
import pytest

import wearsim
from wearsim.contact.solve import ContactConditions, ContactModels, solve
from wearsim.operation.resultants import resultants

MODELS = ContactModels.of("fast", strips=12, cells=12)
ON = {"inclination": 1 / 40}


def test_each_wheel_runs_on_its_roller_as_on_a_pair_of_them():
    given = ContactConditions.of(
        [-2.0e-3, 3.0e-3], yaw=2e-3, rotation=np.array([43.0, 44.0])
    )
    unlike = wearsim.rollers("60E1", radius=1.0, radius_left=0.5, **ON)
    pairs = [wearsim.rollers("60E1", radius=radius, **ON) for radius in (1.0, 0.5)]
    found, *alike = (
        solve(given, wearsim.wheelset("S1002"), below, MODELS)
        for below in (unlike, *pairs)
    )
    assert set(found.side) == {0, 1}
    for side, pair in enumerate(alike):
        at, own = found.side == side, pair.side == side
        for name in (
            "area",
            "max_pressure",
            "x",
            "creepage_x",
            "spin",
            "force_x",
            "force_y",
            "power",
        ):
            np.testing.assert_allclose(
                getattr(found, name)[at], getattr(pair, name)[own], rtol=1e-12
            )
    forces = [resultants(one, 2) for one in (found, *alike)]
    for side in (0, 1):
        for name in ("vertical", "longitudinal"):
            own, expected = (getattr(forces[k], name)[:, side] for k in (0, 1 + side))
            np.testing.assert_allclose(own, expected, rtol=1e-12)


def test_coupled_rollers_roll_a_wheelset_of_radii_in_the_same_ratio():
    """r_R/r_L = s_R/s_L: without longitudinal creepage; on rollers of equal speed
    +-d/(4 r) of it.

    To first order in the ratio, and to the slope of the tread where the contact lies
    off the running circle.
    """
    radius, apart = 0.46, 2e-3
    wheels = wearsim.wheelset("S1002", radius=radius, diameter_difference=apart)
    ratio = (radius - apart / 4) / (radius + apart / 4)
    unlike = wearsim.rollers("60E1", radius=1.0, radius_left=ratio, **ON)
    assert unlike.coupled_difference == pytest.approx(
        2.0 * (ratio - 1.0) / (ratio + 1.0), rel=1e-12
    )
    independent = ContactConditions.of(0.0, friction=0.3)
    coupled = replace(
        independent, speed_difference=np.array([unlike.coupled_difference])
    )
    slips = [
        solve(one, wheels, unlike, MODELS).creepage_x for one in (coupled, independent)
    ]
    np.testing.assert_allclose(slips[0], 0.0, atol=3e-5)
    np.testing.assert_allclose(np.abs(slips[1]), apart / 4 / radius, atol=3e-5)
    assert slips[1][0] * slips[1][1] < 0.0


def test_rollers_alike_have_no_difference_of_speed():
    assert wearsim.rollers("60E1", radius=0.5, **ON).coupled_difference == 0.0
    assert wearsim.rails("60E1").coupled_difference == 0.0
    with pytest.raises(
        wearsim.errors.ProfileError, match="radius = 4 must be at least 5"
    ):
        wearsim.rollers("60E1", radius=0.5, radius_left=0.004)
