r"""Motion of a recorded wheelset without the noise of its sensors, and its rates.

The lateral velocity is the derivative of the shift. A difference of samples raises
noise of a standard deviation s at the spacing d to :math:`s/(\sqrt 2 d)`, which the
lateral creepage then has; the derivative of a smoothed record has much less.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wearsim.contact.patch import FloatArray, IntArray
from wearsim.profile.smoothing import smoothing_spline

SHORTEST = 2.0
"""Default wavelength of the smoothing [m]: a wheelset of 1.5 t hardly moves in shorter
waves, hunting on worn wheels has 5 m and more."""
SPACINGS = 4.0
"""Least default wavelength of the smoothing, in distances of samples [-]."""

_FEWEST = 4  # samples of a piece that can be smoothed
# integral of u^2 / (1 + u^4)^2 over u from 0 on: power of the slope of smoothed noise
_SLOPE = np.pi / (8.0 * np.sqrt(2.0))
# integral of 1 - (1 - T)^2, T = 1 / (1 + u^4): white noise that the residual lacks
_PASSED = 5.0 * np.pi / (8.0 * np.sqrt(2.0))
_LEAST_SEEN = 0.2  # share of the variance of white noise in the residual


@dataclass(frozen=True)
class SmoothedMotion:
    """A recorded motion without noise.

    Parameters
    ----------
    value : (n,) array
        Smoothed motion at the samples.
    rate : (n,) array
        Its derivative by the distance.
    noise : float
        RMS of white noise that would leave the same residual of the smoothing, in the
        unit of the motion.
    rough_rate : float
        RMS that the noise adds to the derivative by differences of samples.
    left_rate : float
        RMS that the noise adds to `rate`, if it is white.
    """

    value: FloatArray
    rate: FloatArray
    noise: float
    rough_rate: float
    left_rate: float


def default_wavelength(spacing: float) -> float:
    """Wavelength of the smoothing of samples at a distance, both in [m]."""
    return max(SHORTEST, SPACINGS * spacing)


def smoothed_motion(
    run: FloatArray, values: FloatArray, piece: IntArray, wavelength: float
) -> SmoothedMotion:
    r"""Motion without waves shorter than a wavelength, and its derivative.

    Parameters
    ----------
    run : (n,) array
        Distance run at the samples, rising within a piece [m].
    values : (n,) array
        Recorded motion.
    piece : (n,) int array
        Rising numbers of pieces of the record without a gap.
    wavelength : float
        Wavelength whose amplitude is halved [m].

    Returns
    -------
    SmoothedMotion

    Notes
    -----
    Each piece is interpolated to equal distances and filtered by the spline of
    `profile.smoothing.smoothing_spline`, of transfer function :math:`T = 1/(1 +
    (q\Lambda/2\pi)^4)`. White noise of variance :math:`s^2` at a spacing d has the
    power :math:`s^2 d/\pi` per wavenumber, and leaves the mean square slope
    :math:`\int q^2 T^2 s^2 d/\pi\,dq = 0.278 (2\pi/\Lambda)^3 s^2 d/\pi`.
    """
    from scipy.interpolate import CubicSpline  # slow import, only when it is needed

    value = values.copy()
    rate = np.zeros(run.size)
    rough = np.zeros(run.size)
    spacing = float(np.median(np.diff(run))) if run.size > 1 else wavelength
    for number in np.unique(piece):
        rows = np.flatnonzero(piece == number)
        if rows.size < 2:
            continue
        along, samples = run[rows], values[rows]
        rough[rows] = np.gradient(samples, along)
        count = max(round(float(np.ptp(along)) / spacing) + 1, 2)
        if rows.size < _FEWEST or count < _FEWEST:
            rate[rows] = rough[rows]
            continue
        grid = np.linspace(along[0], along[-1], count)
        step = np.full(count, grid[1] - grid[0])
        smooth = smoothing_spline(
            grid, np.interp(grid, along, samples)[None, :], step, wavelength
        )[0]
        spline = CubicSpline(grid, smooth)
        value[rows], rate[rows] = spline(along), spline(along, 1)
    seen = max(1.0 - _PASSED * 2.0 * spacing / wavelength, _LEAST_SEEN)
    noise = float(np.sqrt(np.mean((values - value) ** 2) / seen))
    power = noise**2 * spacing / np.pi
    return SmoothedMotion(
        value,
        rate,
        noise,
        float(np.sqrt(np.mean((rough - rate) ** 2))),
        float(np.sqrt(_SLOPE * power * (2.0 * np.pi / wavelength) ** 3)),
    )


def curing_wavelength(motion: SmoothedMotion, wavelength: float, rate: float) -> float:
    """Wavelength that leaves an RMS rate to noise [m]; `wavelength` is that used."""
    return float(wavelength * (motion.left_rate / rate) ** (2.0 / 3.0))
