"""Noise of points: rounding of files and noise of instruments, at any distance."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import wearsim
from wearsim.errors import WearsimWarning
from wearsim.profile.files import write_profile
from wearsim.profile.point_noise import MODULUS, PointNoise, noise_note, point_noise
from wearsim.profile.shape import Profile, resample
from wearsim.profile.smoothing import smoothed
from wearsim.profile.sources import read_profile, standard_profile

WHEEL, RAIL = standard_profile("S1002"), standard_profile("60E1")


def sampled(profile, spacing, digit=0.0):
    """Profile with points at a spacing, rounded to multiples of a digit [m]."""
    points = resample(profile, spacing)
    if not digit:
        return points
    y, z = (digit * np.round(each / digit) for each in (points.y, points.z))
    return replace(points, y=y, z=z)


@pytest.mark.parametrize("profile", [WHEEL, RAIL])
@pytest.mark.parametrize("spacing", [0.25e-3, 0.5e-3, 0.9e-3])
def test_rounding_to_a_hundredth_is_noise_of_its_standard_deviation(profile, spacing):
    """0.01 mm / sqrt(12) = 2.9 um; on flat parts neighbours are rounded alike."""
    rounded = sampled(profile, spacing, 1e-5)
    noise = point_noise(rounded, np.abs(rounded.y) < 25e-3)
    assert noise.height == pytest.approx(2.9e-6, rel=0.3)
    assert noise.spacing == pytest.approx(spacing, rel=0.01)
    assert noise_note(sampled(profile, spacing, 1e-5)) != ""


@pytest.mark.parametrize("profile", [WHEEL, RAIL])
@pytest.mark.parametrize("spacing", [0.25e-3, 0.5e-3, 0.9e-3])
def test_the_shape_of_exact_points_is_no_noise(profile, spacing):
    assert noise_note(sampled(profile, spacing)) == ""


def test_white_noise_has_the_slope_of_its_spectrum():
    """Differences of white noise at a spacing d: s pi/(sqrt 3 d) up to pi/d."""
    noise = PointNoise(3e-6, 3e-6, 0.9e-3)
    assert noise.slope == pytest.approx(3e-6 * np.pi / np.sqrt(3.0) / 0.9e-3)
    assert noise.share(MODULUS, 1e9) == pytest.approx(0.35, abs=0.01)


def test_the_named_smoothing_takes_the_noise_out():
    rough = sampled(WHEEL, 0.9e-3, 1e-5)
    tread = np.abs(rough.y) < 25e-3
    noise = point_noise(rough, tread)
    smooth = smoothed(rough, noise.curing_wavelength(MODULUS, 1e9))
    assert noise_note(smooth) == ""
    assert point_noise(smooth, tread).height < 0.05 * noise.height


def test_the_noise_that_smoothing_leaves_has_the_slope_that_is_stated():
    """Over 900 and 450 wavelengths: 3 % of random error."""
    y = 0.1e-3 * np.arange(9_000)
    noise = PointNoise(3e-6, 3e-6, 0.1e-3)
    flat = Profile(
        "flat", "rail", y, np.random.default_rng(1).normal(0.0, 3e-6, y.size)
    )
    for wavelength in (1e-3, 2e-3):
        slope = np.diff(smoothed(flat, wavelength).z) / 0.1e-3
        stated = noise.left(MODULUS, 1e9, wavelength)
        assert 0.5 * MODULUS * slope.std() / 1e9 == pytest.approx(stated, rel=0.1)


def test_reading_a_rounded_file_warns_and_names_the_smoothing(tmp_path):
    path = tmp_path / "coarse.csv"
    write_profile(sampled(WHEEL, 0.9e-3, 1e-5), path)
    with pytest.warns(
        WearsimWarning,
        match=r"of 1 GPa by \d+ % \(rms\); smoothing with .* leaves about 2.* %",
    ):
        read_profile(path, "wheel")
    read_profile(path, "wheel", smooth=8e-3)  # warnings are errors


@pytest.mark.parametrize(
    ("profile", "body"), [(WHEEL, wearsim.wheelset), (RAIL, wearsim.rails)]
)
def test_bodies_of_a_rounded_file_warn_of_it(tmp_path, profile, body):
    path = tmp_path / "coarse.csv"
    write_profile(sampled(profile, 0.9e-3, 1e-5), path)
    with pytest.warns(WearsimWarning, match="smooth of wearsim.read_profile") as caught:
        body(path)
    assert Path(caught[0].filename) == Path(__file__)


def test_few_points_have_no_estimate():
    assert point_noise(WHEEL, np.arange(WHEEL.y.size) < 5) is None
