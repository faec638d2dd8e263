r"""How a strip with semi-elliptic pressure moves the surface under itself and under other strips.

A strip of half-length a carries :math:`p = p_0\sqrt{1-(x/a)^2}` along the rolling direction x, uniform
across a width. From its own line out to the distance Y a the displacement at X a along x is
:math:`p_0 a F(X, Y) / (\pi E^*)` with

.. math:: F(X, Y) = \int_{-1}^{1} \sqrt{1-t^2}\; \mathrm{arsinh}\frac{Y}{|X-t|}\,dt,

and a strip's displacement is the difference of F between its two edges. A strip of half-length a_i that is
moved averages it with the weights :math:`\sqrt{1-t^2}` and :math:`t^2/\sqrt{1-t^2}`, t = x/a_i: the
averages N and M depend on two numbers, a_i/a and Y, and are tabulated in their logarithms.

Which of two strips moves the other is the same for N, and M of one is :math:`\partial (a_i N)/\partial a_i`:
one table for the shorter strip over the longer one holds both, and the derivatives of N.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.interpolate import RectBivariateSpline

from wearsim.contact.kernel import kernel
from wearsim.contact.patch import FloatArray

# Table over ln(shorter/longer) and ln(Y): start and steps per unit. Linear interpolation in these steps is
# off by less than 1e-4 of F; beyond the table it goes on as the straight line F is there.
RATIO_START, RATIO_STEPS, _RATIOS = -5.0, 24.0, 120
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
    """Averages of F of the longer of two strips: table over ln(shorter/longer) and ln(Y).

    Returns
    -------
    (ratios, distances, 3) array
        N, M of the shorter strip, M of the longer one; for the kernels that call `averages`; made once per
        process, in about half a second.
    """
    # F over arsinh(Y / sqrt(1 + X^2)) is a smooth function of X/(1 + X) and ln(Y).
    share = np.linspace(0.0, 0.6, 90)
    log_distance = np.linspace(DISTANCE_START, DISTANCE_START + _DISTANCES / DISTANCE_STEPS, 140)
    place, distance = share / (1.0 - share), np.exp(log_distance)
    scale = np.arcsinh(distance / np.sqrt(1.0 + place[:, None] ** 2))
    smooth = RectBivariateSpline(share, log_distance, _along_strip(place, distance) / scale)
    ratio = np.exp(RATIO_START + np.arange(_RATIOS + 1) / RATIO_STEPS)
    log_distance = DISTANCE_START + np.arange(_DISTANCES + 1) / DISTANCE_STEPS
    distance = np.exp(log_distance)
    node = np.sin(0.5 * np.pi * (np.arange(_NODES) + 0.5) / _NODES)  # Gauss-Chebyshev
    table = np.zeros((ratio.size, distance.size, 3))
    for t in node:
        first, other = 2.0 * (1.0 - t * t) / _NODES, 2.0 * t * t / _NODES
        x = t * ratio
        reach = np.sqrt(1.0 + x[:, None] ** 2)
        scale, rise = np.arcsinh(distance / reach), distance / np.sqrt(reach**2 + distance**2)
        shape = smooth(x / (1.0 + x), log_distance)
        values = shape * scale
        table[:, :, 0] += first * values
        table[:, :, 1] += other * values
        # By ln Y, of which a longer strip sees less.
        table[:, :, 2] -= first * (smooth(x / (1.0 + x), log_distance, dy=1) * scale + shape * rise)
    table[:, :, 2] += 2.0 * table[:, :, 0] - table[:, :, 1]
    return table


@kernel
def averages(table: FloatArray, ratio: float, distance: float) -> tuple[float, float, float]:
    """N, M of the shorter and M of the longer strip at ln(shorter/longer) and ln(Y)."""
    x, y = (ratio - RATIO_START) * RATIO_STEPS, (distance - DISTANCE_START) * DISTANCE_STEPS
    i = min(max(int(x), 0), table.shape[0] - 2)
    j = min(max(int(y), 0), table.shape[1] - 2)
    x, y = max(x - i, 0.0), y - j
    a, b, c = table[i, j, 0], table[i, j, 1], table[i, j, 2]
    d, e, f = table[i + 1, j, 0], table[i + 1, j, 1], table[i + 1, j, 2]
    a += y * (table[i, j + 1, 0] - a)
    b += y * (table[i, j + 1, 1] - b)
    c += y * (table[i, j + 1, 2] - c)
    d += y * (table[i + 1, j + 1, 0] - d)
    e += y * (table[i + 1, j + 1, 1] - e)
    f += y * (table[i + 1, j + 1, 2] - f)
    return a + x * (d - a), b + x * (e - b), c + x * (f - c)


@kernel
def averages_and_slopes(
    table: FloatArray, ratio: float, distance: float
) -> tuple[float, float, float, float, float, float]:
    """N and both M as `averages`; M of the shorter by its own length, M of the longer by either's.

    Derivatives by the logarithms of the half-lengths, the distance being given.
    """
    x, y = (ratio - RATIO_START) * RATIO_STEPS, (distance - DISTANCE_START) * DISTANCE_STEPS
    i = min(max(int(x), 0), table.shape[0] - 2)
    j = min(max(int(y), 0), table.shape[1] - 2)
    x, y = max(x - i, 0.0), y - j
    a, b, c = table[i, j, 0], table[i, j, 1], table[i, j, 2]
    d, e, f = table[i + 1, j, 0], table[i + 1, j, 1], table[i + 1, j, 2]
    across = table[i, j + 1, 2] - c
    across += x * (table[i + 1, j + 1, 2] - f - across)
    a += y * (table[i, j + 1, 0] - a)
    b += y * (table[i, j + 1, 1] - b)
    c += y * (table[i, j + 1, 2] - c)
    d += y * (table[i + 1, j + 1, 0] - d)
    e += y * (table[i + 1, j + 1, 1] - e)
    f += y * (table[i + 1, j + 1, 2] - f)
    by_short = RATIO_STEPS * (f - c)
    return (
        a + x * (d - a),
        b + x * (e - b),
        c + x * (f - c),
        RATIO_STEPS * (e - b),
        by_short,
        -by_short - DISTANCE_STEPS * across,
    )


@kernel
def in_the_middle(table: FloatArray, distance: float) -> float:
    """F in the middle of a strip, X = 0, at ln(Y): what a strip without length sees."""
    y = (distance - DISTANCE_START) * DISTANCE_STEPS
    j = min(max(int(y), 0), table.shape[1] - 2)
    value: float = table[0, j, 0] + (y - j) * (table[0, j + 1, 0] - table[0, j, 0])
    return value
