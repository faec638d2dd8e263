"""Noise filter: transmission, what it leaves alone, and what it takes away."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wearsim.errors import ProfileError
from wearsim.profile.shape import Profile, resample, vertex_normals
from wearsim.profile.smoothing import smoothed
from wearsim.profile.standard import rail, wheel
from wearsim.profile.worn import wear_between

NEW = wheel("S1002")
CUTOFF = 3e-3


def noisy(profile, sigma, seed):
    ny, nz = vertex_normals(profile.y, profile.z)
    error = sigma * np.random.default_rng(seed).standard_normal(len(profile.y))
    return replace(profile, y=profile.y + ny * error, z=profile.z + nz * error)


def uneven_line(seed=3):
    """Points 0.05 to 0.35 mm apart over 120 mm."""
    steps = np.random.default_rng(seed).uniform(0.05e-3, 0.35e-3, 600)
    return np.cumsum(steps)


@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0, 4.0])
@pytest.mark.parametrize("even", [True, False])
def test_transmission_is_that_of_the_spline_filter(ratio, even):
    """1/(1 + (cutoff/wavelength)^4); 15 points on a wave of 3 mm bring the discrete
    formula to 2 %.
    """
    y = np.arange(0.0, 120e-3, 0.1e-3) if even else uneven_line()
    wave = np.sin(2.0 * np.pi * y / (ratio * CUTOFF))
    new = smoothed(Profile("wave", "rail", y, 1e-6 * wave), CUTOFF)
    inner = (y > 20e-3) & (y < y[-1] - 20e-3)
    amplitude = np.sum(new.z[inner] * wave[inner]) / np.sum(wave[inner] ** 2) * 1e6
    assert amplitude == pytest.approx(
        1.0 / (1.0 + ratio**-4.0), abs=0.003 if even else 0.03
    )


def test_the_standard_shape_is_left_as_it_is():
    """The jump of curvature from the R 13 fillet to the straight flank is rounded
    most.
    """
    wear = wear_between(NEW, smoothed(NEW, CUTOFF))
    tread = (wear.y > -30e-3) & (wear.y < 64e-3)
    assert np.max(np.abs(wear.depth)) < 3.0e-6
    assert np.max(np.abs(wear.depth[tread])) < 0.25e-6
    assert (
        np.max(np.abs(wear.depth[:50])) < 0.5e-6
    )  # flange back: free ends would move it by 11 um


@pytest.mark.parametrize("spacing", [0.05e-3, 0.1e-3, 0.3e-3])
def test_white_noise_falls_as_the_filter_says(spacing):
    """Variance factor 2 h/cutoff * 3 pi/(8 sqrt 2); mean of 12 seeds, one has an error
    of 15 % at 0.3 mm.
    """
    even = resample(NEW, spacing)
    tread = (even.y > 0.0) & (even.y < 55e-3)
    left = [
        np.mean((smoothed(noisy(even, 10e-6, seed), CUTOFF).z - even.z)[tread] ** 2)
        for seed in range(12)
    ]
    factor = 2.0 * spacing / CUTOFF * 3.0 * np.pi / (8.0 * np.sqrt(2.0))
    assert np.sqrt(np.mean(left)) == pytest.approx(10e-6 * np.sqrt(factor), rel=0.12)


def test_ends_have_more_noise_than_the_middle_but_no_bias():
    """Half the data: 7.9 um of 10 um. The mean of 60 seeds is zero within its error,
    shrinking is 11 um.
    """
    even = resample(NEW, 0.25e-3)
    off = np.array(
        [
            smoothed(noisy(even, 10e-6, seed), CUTOFF).y[0] - even.y[0]
            for seed in range(60)
        ]
    )
    assert np.std(off) == pytest.approx(7.9e-6, rel=0.25)
    assert abs(np.mean(off)) < 3.0 * np.std(off) / np.sqrt(60)


@settings(max_examples=20, deadline=None, derandomize=True)
@given(
    angle=st.floats(-np.pi, np.pi),
    seed=st.integers(0, 10**6),
    wavelength=st.floats(0.3e-3, 10e-3),
)
def test_straight_lines_pass_unchanged(angle, seed, wavelength):
    """To the rounding of a banded system of condition 1e6."""
    along = uneven_line(seed)
    line = Profile("line", "rail", along * np.cos(angle), along * np.sin(angle))
    new = smoothed(line, wavelength)
    assert np.max(np.hypot(new.y - line.y, new.z - line.z)) < 1e-12


@pytest.mark.parametrize(
    ("spacing", "sigma"), [(0.05e-3, 5e-6), (0.1e-3, 20e-6), (0.25e-3, 10e-6)]
)
def test_corners_are_found_in_noise_and_kept(spacing, sigma):
    """Rounding of the rim chamfer would be 120 um; what is left is the noise of the
    corner point itself.
    """
    even = resample(NEW, spacing)
    wear = wear_between(NEW, smoothed(noisy(even, sigma, 1), CUTOFF))
    assert np.max(np.abs(wear.depth)) < 4.0 * sigma + 3e-6


def test_an_exact_corner_stays_where_it_is():
    corner = int(np.argmin(np.abs(NEW.y - 60e-3)))
    new = smoothed(NEW, CUTOFF)
    assert (new.y[corner], new.z[corner]) == (NEW.y[corner], NEW.z[corner])


@pytest.mark.parametrize("name", ["60E1", "60E2", "49E1"])
def test_rails_have_no_corners_and_keep_their_shape(name):
    """Radii of 13 mm, on 60E2 of 8 mm, into straight sides 1.7 mm from the end: that is
    rounded a little.
    """
    new = rail(name, 1.0 / 40.0, 1.435, 0.750)
    assert np.max(np.abs(wear_between(new, smoothed(new, CUTOFF)).depth)) < 6e-6


def test_zero_wavelength_is_no_filter_and_long_ones_are_refused():
    assert smoothed(NEW, 0.0) is NEW
    with pytest.raises(
        ProfileError, match=r"noise wavelength = 40 mm must be below a fifth"
    ):
        smoothed(NEW, 40e-3)


def test_few_points_between_corners_stay():
    """Chamfer and face of drawn profiles have two points each."""
    y = np.concatenate((NEW.y, [65e-3]))
    z = np.concatenate((NEW.z, [NEW.z[-1] - 15e-3]))
    new = smoothed(Profile("drawn", "wheel", y, z), CUTOFF)
    assert (new.y[-1], new.z[-1]) == (y[-1], z[-1])
