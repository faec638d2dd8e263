"""Gauge values of wheel profiles and wheelsets."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wearsim.errors import ProfileError
from wearsim.profile.measures import (
    EN_15313,
    MeasuringRule,
    axle_measures,
    flange_gradient,
    flange_height,
    flange_thickness,
    gauge_value,
    hollowing,
    measure,
    running_circle_level,
    wheel_measures,
)
from wearsim.profile.sources import read_profile
from wearsim.profile.standard import wheel
from wearsim.quantities import QUANTITIES

S1002 = wheel("S1002")
DATA = Path(__file__).parents[1] / "data"


def test_gauge_values_of_the_new_wheel():
    """Nominal values; 0.25 mm chords bulge by 0.6 um on the tip, cubics reduce that
    below 0.1 um.
    """
    y, z = S1002.y, S1002.z
    assert flange_height(y, z) == pytest.approx(28.0e-3, abs=0.1e-6)
    assert flange_thickness(y, z) == pytest.approx(32.5e-3, abs=0.1e-6)
    assert flange_gradient(y, z) == pytest.approx(10.7938e-3, abs=0.1e-6)
    assert hollowing(y, z) == 0.0


@pytest.mark.parametrize(("worn", "thickness"), [(1e-3, 33.133e-3), (2e-3, 33.907e-3)])
def test_tread_wear_alone_raises_the_flange_values(worn, thickness):
    """The levels follow the running circle: known values of the S1002 flange read lower
    down, to 1 um.
    """
    y = S1002.y
    z = np.where(y > -0.025, S1002.z - worn, S1002.z)
    assert flange_height(y, z) == pytest.approx(28e-3 + worn, abs=0.1e-6)
    assert flange_thickness(y, z) == pytest.approx(thickness, abs=1e-6)


def test_hollowing_is_the_rise_towards_the_field_side():
    """A groove of 2 mm: the rise from its bottom to the field side, less the fall of
    the new tread.
    """
    y = S1002.y
    z = S1002.z - 2e-3 * np.exp(-(((y - 5e-3) / 10e-3) ** 2))
    expected = max(
        np.max(z[i:][y[i:] <= 0.06]) - z[i]
        for i in np.flatnonzero((y >= -0.03) & (y <= 0.06))
    )
    assert hollowing(y, z) == pytest.approx(expected, abs=1e-15)
    assert 1.2e-3 < hollowing(y, z) < 2e-3


def test_profiles_without_a_flange_are_refused():
    y = np.linspace(-0.03, 0.06, 50)
    with pytest.raises(
        ProfileError, match=r"does not reach 10 mm above the running circle"
    ):
        flange_thickness(y, -0.05 * y)
    with pytest.raises(ProfileError, match=r"largest z at y = 60 mm"):
        flange_height(y, 0.05 * y)
    with pytest.raises(ProfileError, match=r"no tread within"):
        hollowing(y - 1.0, y)


def test_measures_of_a_new_wheel_and_its_wheelset():
    """Nominal values of EN 13715 and of a back-to-back distance of 1360 mm, to the 0.1
    um of cubics.
    """
    result = wheel_measures(S1002, diameter=0.92)
    axle = axle_measures(result, result, 1.36)
    assert result.missing == {}
    nominal = {
        "flange_height": 28e-3,
        "flange_thickness": 32.5e-3,
        "flange_gradient": 10.7938e-3,
        "hollowing": 0.0,
        "rim_width": 135e-3,
        "wheel_diameter": 0.92,
        "back_to_back": 1.36,
        "front_to_front": 1.425,
        "wheel_diameter_difference": 0.0,
    }
    assert {**result.values, **axle.values} == pytest.approx(nominal, abs=0.1e-6)
    assert set(nominal) <= set(QUANTITIES)
    assert all(type(value) is float for value in result.values.values())


@pytest.mark.parametrize(
    ("name", "width"), [("EPS", 135e-3), ("P8", 135e-3), ("1/40", 135e-3)]
)
def test_rim_width_of_other_wheels(name, width):
    assert wheel_measures(wheel(name)).values["rim_width"] == pytest.approx(
        width, abs=1e-9
    )


@settings(max_examples=20, deadline=None, derandomize=True)
@given(lift=st.floats(-5e-3, 5e-3))
def test_gauge_values_do_not_depend_on_where_z_is_counted_from(lift):
    lifted = wheel_measures(replace(S1002, z=S1002.z + lift))
    usual = wheel_measures(S1002)
    for name in (
        "flange_height",
        "flange_thickness",
        "flange_gradient",
        "hollowing",
        "rim_width",
    ):
        assert lifted.values[name] == pytest.approx(usual.values[name], abs=1e-12)


def test_what_cannot_be_measured_is_missing_with_its_reason():
    tread = S1002.y > -36e-3
    result = wheel_measures(replace(S1002, y=S1002.y[tread], z=S1002.z[tread]))
    assert "begins at its highest point" in result.missing["flange_height"]
    assert "begins at its highest point" in result.missing["flange_gradient"]
    assert (
        "does not reach 10 mm above the running circle"
        in result.missing["flange_thickness"]
    )
    axle = axle_measures(result, result, 1.36)
    assert axle.values == {"back_to_back": 1.36}
    assert result.values["hollowing"] == 0.0
    short = S1002.y < 40e-3
    result = wheel_measures(replace(S1002, y=S1002.y[short], z=S1002.z[short]))
    assert "hollowing needs the tread up to 50 mm" in result.missing["hollowing"]
    assert "ends on the tread at y = 39.86 mm" in result.missing["rim_width"]
    assert axle_measures(result, result).values == {}
    assert set(result.values) == {
        "flange_height",
        "flange_thickness",
        "flange_gradient",
    }


def test_a_shape_without_a_flange_has_no_measures_of_one():
    """A disc bulges by a few hundredths of a millimetre: that is no flange to be
    judged.
    """
    result = wheel_measures(wheel("disc"))
    assert set(result.values) == {"hollowing"}
    for name in ("flange_height", "flange_thickness", "flange_gradient", "rim_width"):
        assert (
            result.missing[name]
            == "there is no flange: the top lies 0.04 mm above the running circle"
        )


def test_a_wheelset_whose_wheels_differ():
    """Thinner left flange by 2 mm, and other diameters."""
    left = wheel("S1002/e30.5")
    right = replace(S1002, z=S1002.z - 1e-3)
    one, other = (
        wheel_measures(right, diameter=0.918),
        wheel_measures(left, diameter=0.919),
    )
    axle = axle_measures(one, other, 1.36)
    assert axle.values["front_to_front"] == pytest.approx(
        1.36 + 32.5e-3 + 30.5e-3, abs=0.2e-6
    )
    assert axle.values["wheel_diameter_difference"] == pytest.approx(-1e-3, abs=1e-9)
    assert other.values["flange_thickness"] == pytest.approx(30.5e-3, abs=0.1e-6)
    assert axle_measures(wheel_measures(right), other).values == {}


def test_odd_sizes_are_refused():
    with pytest.raises(
        ProfileError,
        match=r"back_to_back = 136 must be at least 400 and at most 2000 mm",
    ):
        axle_measures(wheel_measures(S1002), wheel_measures(S1002), 0.136)


def test_the_chinese_lma_has_its_nominal_flange_at_12_mm():
    """Points of public arcs of the LMA, 0.5 mm apart; the drawing has 32 mm, the public
    software of a wheel scanner measures 12 mm above the running circle: 31.98 mm.
    """
    lma = read_profile(DATA / "profile_lma.csv", kind="wheel")
    found = measure(lma, measuring_height=12e-3).values
    assert found["flange_thickness"] == pytest.approx(31.98e-3, abs=0.01e-3)
    at_10 = measure(lma).values
    assert at_10["flange_thickness"] == pytest.approx(32.90e-3, abs=0.01e-3)
    # qR keeps its lower point at 10 mm
    assert found["flange_gradient"] == at_10["flange_gradient"]


@pytest.mark.parametrize("circle", [65e-3, 73e-3])
def test_measures_follow_the_running_circle(circle):
    """Sh and the level of Sd move by the height of the tread there."""
    rule = MeasuringRule(running_circle=circle)
    level = running_circle_level(S1002.y, S1002.z, rule)
    inner = int(np.searchsorted(S1002.y, circle - 70e-3))
    # chords of 0.25 mm on a slope of 0.04 at most
    assert level == pytest.approx(S1002.z[inner], abs=10e-6)
    assert flange_height(S1002.y, S1002.z, rule) == pytest.approx(
        28e-3 - level, abs=0.1e-6
    )
    moved = MeasuringRule(height=10e-3 + level)
    assert flange_thickness(S1002.y, S1002.z, rule) == pytest.approx(
        flange_thickness(S1002.y, S1002.z, moved), abs=1e-9
    )


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"measuring_height": 4e-3}, "measuring_height = 4 must be at least 5"),
        ({"running_circle": 90e-3}, "running_circle = 90 must be at least 55"),
        ({"measuring_height": float("nan")}, "measuring_height = nan must be"),
    ],
)
def test_places_out_of_range_are_one_clear_line(given, message):
    with pytest.raises(ProfileError, match=message):
        measure(S1002, **given)


def test_a_gauge_value_is_that_of_its_name_and_of_no_other():
    y, z = S1002.y, S1002.z
    assert gauge_value("flange_height", y, z, EN_15313) == flange_height(y, z)
    assert gauge_value("hollowing", y, z, EN_15313) == hollowing(y, z)
    with pytest.raises(KeyError, match="rim_width"):
        gauge_value("rim_width", y, z, EN_15313)
