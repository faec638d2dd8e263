"""Recorded motion: noise of sensors does not become lateral velocity."""

import numpy as np
import pytest

from wearsim.operation.recorded import samples_of
from wearsim.operation.smoothed_motion import (
    curing_wavelength,
    default_wavelength,
    smoothed_motion,
)

SPACING, COUNT = 1.0 / 6.0, 600  # 100 Hz at 60 km/h [m]
PLACE = SPACING * np.arange(COUNT)
WAVE = 2.0 * np.pi / 18.0
HUNTING = 2.2e-3 * np.sin(WAVE * PLACE)
SENSOR = 1e-4 * np.random.default_rng(4).standard_normal(COUNT)
ONE = np.zeros(COUNT, dtype=np.int64)


def record(shift):
    return {
        "place": PLACE,
        "speed": np.full(COUNT, 60 / 3.6),
        "shift": shift,
        "yaw": 2.2e-3 * WAVE * np.cos(WAVE * PLACE),
    }


def test_noise_of_a_sensor_is_measured_and_hardly_left():
    """White noise of 0.1 mm: 0.42 mrad by differences of samples, by the closed form
    0.07 mrad after smoothing; both within the scatter of 600 samples.
    """
    length = default_wavelength(SPACING)
    motion = smoothed_motion(PLACE, HUNTING + SENSOR, ONE, length)
    assert motion.noise == pytest.approx(1e-4, rel=0.1)
    assert motion.rough_rate == pytest.approx(1e-4 / (np.sqrt(2) * SPACING), rel=0.1)
    truth = 2.2e-3 * WAVE * np.cos(WAVE * PLACE)
    left = np.sqrt(np.mean((motion.rate - truth)[12:-12] ** 2))
    assert left == pytest.approx(motion.left_rate, rel=0.25)
    assert left < 0.2 * motion.rough_rate
    longer = curing_wavelength(motion, length, 0.5 * motion.left_rate)
    again = smoothed_motion(PLACE, HUNTING + SENSOR, ONE, longer)
    assert again.left_rate == pytest.approx(0.5 * motion.left_rate, rel=0.1)


def test_a_motion_without_noise_keeps_its_amplitude():
    """A wave of 18 m loses (2/18)^4 of its amplitude, 1.5e-4, but for the ends."""
    motion = smoothed_motion(PLACE, HUNTING, ONE, 2.0)
    inner = slice(24, -24)
    np.testing.assert_allclose(motion.value[inner], HUNTING[inner], atol=3e-4 * 2.2e-3)


def test_gaps_part_the_record():
    """A jump over a gap is no motion."""
    piece = (np.arange(COUNT) > 300).astype(np.int64)
    jump = np.where(piece == 1, 3e-3, -3e-3)
    motion = smoothed_motion(PLACE, jump, piece, 2.0)
    np.testing.assert_allclose(motion.rate, 0.0, atol=1e-12)


def test_a_record_says_what_noise_it_has_and_what_it_would_do():
    assert samples_of(record(HUNTING)).notes == ()
    (note,) = samples_of(record(HUNTING + SENSOR)).notes
    assert "the shift has noise of 0.1 mm rms in waves below 2 m" in note
    assert "differences of samples would add 0.4" in note
    assert "smooth_m" not in note
    (note,) = samples_of(record(HUNTING + 4.0 * SENSOR)).notes
    assert "; write smooth_m = 3." in note


def test_the_wavelength_may_be_stated():
    noisy = samples_of(record(HUNTING + SENSOR), 0.4).values["drift"]
    smooth = samples_of(record(HUNTING + SENSOR), 4.0).values["drift"]
    clean = samples_of(record(HUNTING)).values["drift"]
    rough, left = (np.std((each - clean)[24:-24]) for each in (noisy, smooth))
    assert left < 0.1 * rough
