"""Gauge values of wheel profiles."""

import numpy as np
import pytest

from wearsim.errors import ProfileError
from wearsim.profile.measures import flange_gradient, flange_height, flange_thickness, hollowing
from wearsim.profile.standard import wheel

S1002 = wheel("S1002")


def test_gauge_values_of_the_new_wheel():
    """Nominal values; 0.25 mm chords bulge by 0.6 um on the tip, cubics reduce that below 0.1 um."""
    y, z = S1002.y, S1002.z
    assert flange_height(y, z) == pytest.approx(28.0e-3, abs=0.1e-6)
    assert flange_thickness(y, z) == pytest.approx(32.5e-3, abs=0.1e-6)
    assert flange_gradient(y, z) == pytest.approx(10.7938e-3, abs=0.1e-6)
    assert hollowing(y, z) == 0.0


@pytest.mark.parametrize(("worn", "thickness"), [(1e-3, 33.133e-3), (2e-3, 33.907e-3)])
def test_tread_wear_alone_raises_the_flange_values(worn, thickness):
    """The levels follow the tape circle: known values of the S1002 flange read lower down, to 1 um."""
    y = S1002.y
    z = np.where(y > -0.025, S1002.z - worn, S1002.z)
    assert flange_height(y, z) == pytest.approx(28e-3 + worn, abs=0.1e-6)
    assert flange_thickness(y, z) == pytest.approx(thickness, abs=1e-6)


def test_gauge_distances_are_parameters():
    """On the 70 degree flank 1 mm of level is 1/2.747 mm of thickness."""
    y, z = S1002.y, S1002.z
    higher = flange_thickness(y, z, level=13e-3)
    lower = flange_thickness(y, z, level=12.5e-3)
    assert lower - higher == pytest.approx(0.5e-3 / 2.747477419, abs=1e-9)
    assert flange_thickness(y, z, flange_back=72e-3) == pytest.approx(34.5e-3, abs=0.1e-6)
    assert flange_gradient(y, z, below_tip=3e-3) < flange_gradient(y, z)


def test_hollowing_is_the_rise_towards_the_field_side():
    """A groove of 2 mm: the rise from its bottom to the field side, less the fall of the new tread."""
    y = S1002.y
    z = S1002.z - 2e-3 * np.exp(-(((y - 5e-3) / 10e-3) ** 2))
    expected = max(np.max(z[i:][y[i:] <= 0.06]) - z[i] for i in np.flatnonzero((y >= -0.03) & (y <= 0.06)))
    assert hollowing(y, z) == pytest.approx(expected, abs=1e-15)
    assert 1.2e-3 < hollowing(y, z) < 2e-3


def test_profiles_without_a_flange_are_refused():
    y = np.linspace(-0.03, 0.06, 50)
    with pytest.raises(ProfileError, match=r"does not reach 10 mm above the tape circle"):
        flange_thickness(y, -0.05 * y)
    with pytest.raises(ProfileError, match=r"largest z at y = 60 mm"):
        flange_height(y, 0.05 * y)
    with pytest.raises(ProfileError, match=r"no tread within"):
        hollowing(y - 1.0, y)
