"""Flange clearance: closed form on shapes with corners, and how gauge and flange move
it.
"""

import math

import numpy as np
import pytest

from wearsim.profile import standard
from wearsim.profile.conicity import flange_clearance
from wearsim.profile.shape import Profile

GRID = 0.05e-3  # of the shifts: the clearance is known to one step


def cornered(steepness, root=-30e-3, gauge_face=-23e-3):
    """Flat tread with a straight flank from `root` on, over a flat head with a steep
    side.
    """
    y = np.arange(-45e-3, 45e-3, 0.05e-3)
    wheel = Profile(
        "wheel", "wheel", y, np.where(y < root, (root - y) * math.tan(steepness), 0.0)
    )
    rail = Profile(
        "rail",
        "rail",
        y,
        np.where(y < gauge_face, (gauge_face - y) * math.tan(1.45), 0.0),
    )
    return wheel, rail


def test_a_straight_flank_climbs_where_its_foot_meets_the_corner_of_the_rail():
    """Closed form: 7 mm. The splines through the corners add up to a point distance."""
    assert flange_clearance(*cornered(math.radians(70))) == pytest.approx(
        7e-3, abs=2 * GRID
    )


def test_a_flank_below_60_degrees_has_no_clearance_and_one_above_has():
    assert flange_clearance(*cornered(math.radians(58))) is None
    assert flange_clearance(*cornered(math.radians(62))) == pytest.approx(
        7e-3, abs=2 * GRID
    )


def test_s1002_on_60e1():
    """6.6 mm; with 6 mm the contact, at y = -30.3 mm on the wheel, is still in the
    flange root.
    """
    wheel = standard.wheel("S1002")
    assert flange_clearance(
        wheel, standard.rail("60E1", 1 / 40, 1.435, 0.75)
    ) == pytest.approx(6.6e-3, abs=GRID)


@pytest.mark.parametrize("widening", [-3e-3, 2e-3, 5e-3])
def test_half_of_the_widening_of_the_gauge_is_added(widening):
    wheel = standard.wheel("S1002")
    near, wide = (
        flange_clearance(wheel, standard.rail("60E1", 1 / 40, gauge, 0.75))
        for gauge in (1.435, 1.435 + widening)
    )
    assert wide - near == pytest.approx(0.5 * widening, abs=1.01 * GRID)


def test_a_thinner_flange_has_more_clearance():
    wheel, rail = standard.wheel("S1002"), standard.rail("60E1", 1 / 40, 1.435, 0.75)
    thin = Profile("thin", "wheel", wheel.y - 2e-3, wheel.z)
    assert flange_clearance(thin, rail) - flange_clearance(
        wheel, rail
    ) == pytest.approx(2e-3, abs=1.01 * GRID)


def test_rails_far_apart_are_never_climbed():
    rail = standard.rail("60E1", 1 / 40, 1.52, 0.75)
    assert flange_clearance(standard.wheel("S1002"), rail) == math.inf
