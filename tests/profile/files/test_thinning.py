"""Long lists are thinned without a loss that matters."""

import numpy as np

from wearsim.profile.files.axes import MOST_POINTS, thinned
from wearsim.profile.inspection import Conditions, inspect_profile
from wearsim.profile.inspection.inputs import read_input
from wearsim.profile.standard import wheel

WHEEL = wheel("S1002")


def long_list(count, noise=0.0):
    at = np.linspace(0, len(WHEEL.y) - 1, count)
    y, z = (np.interp(at, np.arange(len(WHEEL.y)), each) for each in (WHEEL.y, WHEEL.z))
    return y, z + np.random.default_rng(3).normal(0.0, noise, count)


def test_short_lists_are_left_alone():
    y, z = long_list(MOST_POINTS)
    kept, deviation = thinned(y, z)
    assert np.array_equal(kept, np.arange(MOST_POINTS))
    assert deviation == 0.0


def test_corners_are_kept():
    """The list is a polygon: with its corners kept, nothing is lost but the tolerance of 0.1 um."""
    y, z = long_list(300_001)
    kept, deviation = thinned(y, z)
    assert len(kept) <= MOST_POINTS
    assert kept[0] == 0
    assert kept[-1] == len(y) - 1
    assert deviation <= 0.1e-6
    edge = int(np.argmin(np.abs(y - 0.060)))
    assert np.min(np.hypot(y[kept] - y[edge], z[kept] - z[edge])) < 1e-6


def test_noise_is_not_picked():
    """Even points of white noise have its standard deviation, known to 1 % from 5000 of them."""
    y, z = long_list(300_001, noise=10e-6)
    kept, deviation = thinned(y, z)
    tread = kept[(y[kept] > -0.02) & (y[kept] < 0.055)]
    noise = z[tread] - long_list(300_001)[1][tread]
    assert abs(np.std(noise) / 10e-6 - 1.0) < 0.05
    assert deviation > 20e-6


def test_a_wheel_of_many_points_is_measured_against_another(tmp_path):
    """End to end; the worn area is 0 to 0.02 mm2, a tenth of a micrometre over the profile."""
    y, z = long_list(50_000)
    path = tmp_path / "long.csv"
    path.write_text("\n".join(f"{a:.4f},{b:.4f}" for a, b in zip(1e3 * y, 1e3 * z, strict=True)))
    subject = read_input(str(path))
    assert any("of 50000 points taken" in note or "of 499" in note for note in subject.notes)
    result = inspect_profile(subject, Conditions(), against=read_input("S1002"), amplitudes=(3e-3,))
    assert abs(result.comparison.wear.worn_area) < 0.02e-6
    assert abs(result.measures["right"].values["flange_height"] - 28e-3) < 0.2e-6
    smooth = inspect_profile(subject, Conditions(smooth=3e-3), amplitudes=(3e-3,))
    assert abs(smooth.measures["right"].values["flange_height"] - 28e-3) < 5e-6
