"""Reprofiling to a template with the least loss of diameter: cases with known
results.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wearsim.errors import ProfileError
from wearsim.profile import standard
from wearsim.profile.measures import flange_thickness
from wearsim.profile.reprofiling import reprofile, reprofile_axle
from wearsim.profile.shape import Profile, resample

DEG = np.pi / 180.0


def wheel(flank=70.0, thinner=0.0, level=0.0, dent=None):
    """Polygon of a wheel: upright back, top from -60 to -50 mm, straight flank down to
    the level tread.

    The flank ends where it meets the tread, which starts at -40 mm unless the flange is
    thinner.
    """
    height = 28e-3
    foot = -40e-3 - thinner
    top = foot - height / np.tan(flank * DEG)
    points = [
        (-70e-3, 5e-3),
        (-70e-3, height - 2e-3),
        (-66e-3, height),
        (top, height),
        (foot, 0.0),
    ]
    points += dent or []
    points += [(60e-3, 0.0)]
    y, z = np.array(points).T
    z = z + np.where(np.arange(len(y)) > 3, level, 0.0)
    # the running circle is found by a cubic through four points: on a straight line
    near = np.array([-2e-3, -1e-3, 1e-3, 2e-3])
    place = np.searchsorted(y, near)
    return Profile(
        "made up",
        "wheel",
        np.insert(y, place, near),
        np.insert(z, place, np.interp(near, y, z)),
    )


S1002 = resample(standard.wheel("S1002"), 0.25e-3)


def test_a_new_wheel_loses_nothing():
    result = reprofile(S1002, S1002)
    assert result.depth == 0.0
    assert abs(result.radius_loss) < 1e-15
    np.testing.assert_array_equal(result.profile.z, S1002.z)


@pytest.mark.slow
@given(depth=st.floats(1e-6, 20e-3))
def test_uniform_radial_wear_costs_itself(depth):
    """Rounding of z only."""
    result = reprofile(replace(S1002, z=S1002.z - depth), S1002)
    assert result.depth == pytest.approx(depth, abs=1e-15)
    assert result.radius_loss == pytest.approx(
        0.0, abs=1e-15
    )  # all of it was worn, the lathe takes nothing


def test_worn_tread_costs_the_wear_of_the_tread():
    result = reprofile(wheel(level=-1.5e-3), wheel())
    assert result.depth == pytest.approx(1.5e-3, abs=1e-15)
    assert result.radius_loss == pytest.approx(0.0, abs=1e-15)


def test_a_hollow_tread_costs_its_deepest_place():
    dent = [(-10e-3, 0.0), (17.3e-3, -3.2e-3), (40e-3, 0.0)]
    result = reprofile(wheel(dent=dent), wheel())
    assert result.depth == pytest.approx(3.2e-3, abs=1e-15)
    assert result.place == 17.3e-3
    # the running circle lies on the slope of the hollow, 10 of 27.3 mm on
    assert result.radius_loss == pytest.approx(3.2e-3 * (1.0 - 10.0 / 27.3), rel=1e-12)


@pytest.mark.parametrize("flank", [60.0, 70.0, 75.0])
def test_a_worn_flank_costs_its_wear_times_its_slope(flank):
    result = reprofile(wheel(flank, thinner=2e-3), wheel(flank))
    assert result.depth == pytest.approx(2e-3 * np.tan(flank * DEG), rel=1e-12)
    assert result.radius_loss == pytest.approx(
        result.depth, abs=1e-15
    )  # the tread was not worn
    assert result.depth > 2e-3
    # the flange has the template's thickness again
    assert flange_thickness(result.profile.y, result.profile.z) == pytest.approx(
        flange_thickness(wheel(flank).y, wheel(flank).z), abs=1e-12
    )


def test_a_thinner_template_saves_diameter():
    worn = wheel(
        thinner=2e-3, level=-0.5e-3
    )  # the foot of its flank lies as low as its tread
    thicker = reprofile(worn, wheel(thinner=1e-3))
    assert thicker.depth == pytest.approx(1e-3 * np.tan(70 * DEG) + 0.5e-3, rel=1e-12)
    assert reprofile(worn, wheel(thinner=2e-3)).depth == pytest.approx(
        0.5e-3, abs=1e-15
    )


def test_places_that_are_not_worn_may_stand_up():
    """Rolled-out steel at the rim and a high flange are turned off; they do not help
    the tread.
    """
    worn = replace(
        S1002,
        z=S1002.z
        + np.where(S1002.y > 50e-3, 2e-3, 0.0)
        + np.where(S1002.y < -45e-3, 1e-3, 0.0),
    )
    assert reprofile(worn, S1002).depth == 0.0


def test_a_groove_under_an_overhang_counts():
    """The flank was worn back under the flange's edge by 0.5 mm, whose height alone
    would hide it.
    """
    template = wheel(flank=80.0)
    y, z = template.y.copy(), template.z.copy()
    foot = 4
    between = [(y[3], 20e-3), (y[3] - 0.5e-3, 15e-3)]
    worn = replace(
        template,
        y=np.concatenate((y[:foot], [a for a, _ in between], y[foot:])),
        z=np.concatenate((z[:foot], [b for _, b in between], z[foot:])),
    )
    # at y[3] the template is at its top, the groove's lower branch comes down to 15 mm
    # half a mm before it
    slope = (0.0 - 15e-3) / (y[foot] - (y[3] - 0.5e-3))
    lowest = 15e-3 + slope * 0.5e-3
    assert reprofile(worn, template).depth == pytest.approx(28e-3 - lowest, rel=1e-12)


@given(st.integers(0, 2**32 - 1))
def test_the_turned_wheel_lies_inside_and_touches(seed):
    """Between the vertices, too: by interpolation both ways, exact for polygons that do
    not turn back.
    """
    rng = np.random.default_rng(seed)
    y = np.unique(
        np.concatenate((S1002.y[S1002.y > -60e-3], rng.uniform(-59e-3, 55e-3, 50)))
    )
    z = np.interp(y, S1002.y, S1002.z) - 1e-3 * rng.random(y.size) * rng.random()
    worn = Profile("noise", "wheel", y, z)
    result = reprofile(worn, S1002)
    zone = (y >= result.start) & (y <= result.end)
    fine = np.sort(
        np.concatenate((y[zone], rng.uniform(result.start, result.end, 1000)))
    )
    cut = np.interp(fine, worn.y, worn.z) - np.interp(
        fine, result.profile.y, result.profile.z
    )
    assert cut.min() >= -1e-12  # interpolation on steep flanks rounds y
    assert result.start <= result.place <= result.end
    touching = np.interp(result.place, worn.y, worn.z) - np.interp(
        result.place, result.profile.y, result.profile.z
    )
    assert touching == pytest.approx(0.0, abs=1e-12)


def test_both_wheels_of_an_axle_get_the_smaller_diameter():
    right, left = wheel(level=-1e-3), wheel(thinner=1e-3)
    first, second = reprofile_axle(right, left, (wheel(), wheel()))
    deeper = 1e-3 * np.tan(70 * DEG)
    assert first.depth == pytest.approx(deeper, rel=1e-12)
    assert second.depth == pytest.approx(deeper, rel=1e-12)
    assert first.radius_loss == pytest.approx(deeper - 1e-3, rel=1e-12)
    np.testing.assert_array_equal(second.profile.z, reprofile(left, wheel()).profile.z)
    swapped = reprofile_axle(left, right, (wheel(), wheel()))
    assert (swapped[0].depth, swapped[1].depth) == (second.depth, first.depth)


def test_wheels_of_unequal_radius_meet_at_the_smaller_turned_one():
    right, left = wheel(level=-1e-3), wheel(level=-2e-3)
    first, second = reprofile_axle(right, left, (wheel(), wheel()), (0.450, 0.4515))
    # 449 against 449.5 mm: the left wheel loses half a mm more than its wear
    assert 0.450 - first.depth == pytest.approx(0.449, rel=1e-12)
    assert 0.4515 - second.depth == pytest.approx(0.449, rel=1e-12)
    assert (first.radius_loss, second.radius_loss) == (
        pytest.approx(0.0, abs=1e-12),
        pytest.approx(0.5e-3),
    )


def test_what_cannot_be_turned_is_told():
    part = S1002.y > -30e-3
    with pytest.raises(ProfileError, match="known from its flange tip"):
        reprofile(replace(S1002, y=S1002.y[part], z=S1002.z[part]), S1002)
    with pytest.raises(ProfileError, match="known from its flange tip"):
        reprofile(
            replace(S1002, y=S1002.y[S1002.y > -50e-3], z=S1002.z[S1002.y > -50e-3]),
            S1002,
        )
