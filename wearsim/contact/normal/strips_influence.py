r"""How a strip with semi-elliptic pressure moves the surface under itself and under other strips.

A strip of half-length a carries :math:`p = p_0\sqrt{1-(x/a)^2}` along the rolling direction x, uniform
across a width. From its own line out to the distance Y a the displacement at X a along x is
:math:`p_0 a F(X, Y) / (\pi E^*)` with

.. math:: F(X, Y) = \int_{-1}^{1} \sqrt{1-t^2}\; \mathrm{arsinh}\frac{Y}{|X-t|}\,dt,

and a strip's displacement is the difference of F between its two edges. A strip of half-length a_i that is
moved averages it with the weights :math:`\sqrt{1-t^2}` and :math:`t^2/\sqrt{1-t^2}`, t = x/a_i: the
averages depend on two numbers, a_i/a and Y, and are tabulated in their logarithms.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.interpolate import RectBivariateSpline

from wearsim.contact.kernel import kernel
from wearsim.contact.patch import FloatArray

# Table over ln(a_i/a) and ln(Y): start and steps per unit. Linear interpolation in these steps is off by
# less than 1e-4 of F; beyond the table it goes on as the straight line F is there.
RATIO_START, RATIO_STEPS, _RATIOS = -5.0, 24.0, 240
DISTANCE_START, DISTANCE_STEPS, _DISTANCES = -9.0, 40.0, 640

_NODES = 48  # of the averages over half a strip; a short strip's field has a kink at its end


def _along_strip(place: FloatArray, distance: FloatArray) -> FloatArray:
    """F at places X >= 0 (n,) and distances Y > 0 (k,), by tanh-sinh quadrature on each side of X."""
    step = np.linspace(-3.2, 3.2, 60)
    stretch = 0.5 * np.pi * np.sinh(step)
    near = 1.0 / (1.0 + np.exp(2.0 * stretch))  # share of the piece from its end, to full precision
    far = near[::-1]
    weight = (step[1] - step[0]) * 0.25 * np.pi * np.cosh(step) / np.cosh(stretch) ** 2
    total = np.zeros((place.size, distance.size))
    for k, x in enumerate(place):
        split = min(x, 1.0)
        for first, length in ((-1.0, 1.0 + split), (split, 1.0 - split)):
            to_left = first + 1.0 + length * near
            to_right = 1.0 - first - length + length * far
            away = x - first - length + length * far if first < split else length * near
            bell = length * weight * np.sqrt(to_left * to_right)
            with np.errstate(divide="ignore"):
                total[k] += np.arcsinh(distance[:, None] / np.maximum(away, 1e-300)) @ bell
    return total


@lru_cache(maxsize=1)
def influence_table() -> FloatArray:
    """Averages of F over a strip: table over ln(a_i/a) and ln(Y), last axis the two weights.

    Returns
    -------
    (ratios, distances, 2) array
        For the kernels that call `averages`; made once per process, in about half a second.
    """
    # F over arsinh(Y / sqrt(1 + X^2)) is a smooth function of X/(1 + X) and ln(Y).
    share = np.concatenate([np.linspace(0.0, 0.6, 90)[:-1], np.linspace(0.6, 0.997, 50)])
    log_distance = np.linspace(DISTANCE_START, DISTANCE_START + _DISTANCES / DISTANCE_STEPS, 140)
    place, distance = share / (1.0 - share), np.exp(log_distance)
    scale = np.arcsinh(distance / np.sqrt(1.0 + place[:, None] ** 2))
    smooth = RectBivariateSpline(share, log_distance, _along_strip(place, distance) / scale)
    ratio = np.exp(RATIO_START + np.arange(_RATIOS + 1) / RATIO_STEPS)
    log_distance = DISTANCE_START + np.arange(_DISTANCES + 1) / DISTANCE_STEPS
    distance = np.exp(log_distance)
    node = np.sin(0.5 * np.pi * (np.arange(_NODES) + 0.5) / _NODES)  # Gauss-Chebyshev
    table = np.zeros((ratio.size, distance.size, 2))
    for t in node:
        first, other = 2.0 * (1.0 - t * t) / _NODES, 2.0 * t * t / _NODES
        x = t * ratio
        values = smooth(x / (1.0 + x), log_distance) * np.arcsinh(distance / np.sqrt(1.0 + x[:, None] ** 2))
        table[:, :, 0] += first * values
        table[:, :, 1] += other * values
    return table


@kernel
def averages(
    table: FloatArray, ratio: float, distance: float
) -> tuple[float, float, float, float, float, float]:
    """Both averages at ln(a_i/a) and ln(Y), and their derivatives by the one and by the other."""
    x, y = (ratio - RATIO_START) * RATIO_STEPS, (distance - DISTANCE_START) * DISTANCE_STEPS
    i = min(max(int(x), 0), table.shape[0] - 2)
    j = min(max(int(y), 0), table.shape[1] - 2)
    x, y = max(x - i, 0.0), y - j
    a, b = table[i, j, 0], table[i, j + 1, 0]
    c, d = table[i + 1, j, 0], table[i + 1, j + 1, 0]
    first, rise = a + y * (b - a), c - a + y * (d - c - b + a)
    across = b - a + x * (d - c - b + a)
    e, f = table[i, j, 1], table[i, j + 1, 1]
    g, h = table[i + 1, j, 1], table[i + 1, j + 1, 1]
    second, climb = e + y * (f - e), g - e + y * (h - g - f + e)
    beside = f - e + x * (h - g - f + e)
    return (
        first + x * rise,
        second + x * climb,
        rise * RATIO_STEPS,
        across * DISTANCE_STEPS,
        climb * RATIO_STEPS,
        beside * DISTANCE_STEPS,
    )
