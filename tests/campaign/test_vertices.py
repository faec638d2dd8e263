import numpy as np
import pytest
from scipy.interpolate import make_smoothing_spline

from wearsim.campaign.vertices import smooth_sides
from wearsim.profile.shape import vertex_lengths


def smooth(arc, depth, length, wavelength):
    """Rows along one of two straight profiles whose vertices stand for these
    lengths.
    """
    y = np.stack([arc, arc])
    np.testing.assert_allclose(vertex_lengths(y, 0.0 * y)[0], length, rtol=1e-9)
    return smooth_sides(y, 0.0 * y, np.stack([depth, depth]), wavelength)[0]


def uniform(n=801, spacing=0.25e-3):
    arc = np.arange(n) * spacing
    length = np.full(n, spacing)
    length[[0, -1]] *= 0.5
    return arc, length


def uneven(n=300, seed=3):
    rng = np.random.default_rng(seed)
    gap = rng.uniform(0.1e-3, 0.4e-3, n - 1)
    arc = np.concatenate([[0.0], np.cumsum(gap)])
    length = 0.5 * (np.concatenate([[0.0], gap]) + np.concatenate([gap, [0.0]]))
    return arc, length


@pytest.mark.parametrize("wavelength", [1.5e-3, 2.5e-3, 5e-3])
@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0])
def test_amplitude_follows_the_transfer_function(wavelength, ratio):
    """Half the amplitude at the wavelength itself; error: the grid's, below 1 % from 7
    points per wave.
    """
    arc, length = uniform(n=2001, spacing=0.1e-3)
    wave = 1e-6 * np.cos(2 * np.pi * arc / (ratio * wavelength))
    smoothed = smooth(arc, 10e-6 + wave, length, wavelength)
    inner = slice(500, -500)  # away from the free ends
    gain = np.sum((smoothed[inner] - 10e-6) * wave[inner]) / np.sum(wave[inner] ** 2)
    assert gain == pytest.approx(1.0 / (1.0 + ratio**-4), rel=0.01)


def test_equals_the_smoothing_spline_of_scipy():
    """Two algorithms of one definition, 1e-9; a depth far from zero, so that nothing is
    cut off.
    """
    arc, length = uneven()
    rng = np.random.default_rng(1)
    depth = 5e-6 + 1e-6 * rng.random(arc.size)
    reference = make_smoothing_spline(
        arc / 1e-3, depth, w=length / 1e-3, lam=(2.5 / (2 * np.pi)) ** 4
    )(arc / 1e-3)
    reference *= (depth * length).sum() / (reference * length).sum()
    np.testing.assert_allclose(smooth(arc, depth, length, 2.5e-3), reference, rtol=1e-9)


def test_a_result_that_is_changed_does_not_come_again():
    arc, length = uniform()
    depth = np.where(np.abs(arc - 0.1) < 5e-3, 1e-6, 0.0)
    first = smooth(arc, depth, length, 2.5e-3)
    kept = first.copy()
    first[:] = 0.0
    assert np.array_equal(smooth(arc, depth, length, 2.5e-3), kept)


def test_keeps_area_and_sign_of_every_row():
    """Removed area 1e-12; a narrow band has negative lobes before they are cut off."""
    arc, length = uneven()
    depth = np.zeros((2, 3, arc.size))
    depth[0, 0, 100:110] = 8e-6
    depth[1, 2, 40:41] = 3e-6
    smoothed = smooth(arc, depth, length, 2.5e-3)
    assert smoothed.min() >= 0.0
    np.testing.assert_allclose(
        (smoothed * length).sum(-1), (depth * length).sum(-1), rtol=1e-12
    )
    spike = (
        2 * np.pi / (np.sqrt(8) * 2.5e-3) * 3e-6 * length[40]
    )  # kernel of 1/(1 + lam q^4) at 0
    assert smoothed[1, 2].max() == pytest.approx(
        spike, rel=0.1
    )  # grid, and the lobes cut off
    assert not smoothed[0, 1].any()


def test_rows_do_not_see_each_other():
    arc, length = uneven()
    depth = np.random.default_rng(0).random((4, arc.size))
    together = smooth(arc, depth, length, 3e-3)
    for row, alone in zip(depth, together, strict=True):
        np.testing.assert_allclose(smooth(arc, row, length, 3e-3), alone, rtol=1e-9)


def test_wavelength_zero_is_off():
    arc, length = uneven()
    depth = np.random.default_rng(0).random(arc.size)
    np.testing.assert_array_equal(smooth(arc, depth, length, 0.0), depth)


def test_constant_depth_stays():
    """A straight line has no curvature to penalise: imposed, 1e-9."""
    arc, length = uneven()
    np.testing.assert_allclose(
        smooth(arc, np.full(arc.size, 4e-6), length, 2.5e-3), 4e-6, rtol=1e-9
    )
