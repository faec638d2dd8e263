r"""Displacement of the surface of a half-space under strips of semi-elliptic pressure.

A strip of half-length a carries :math:`p = c\sqrt{a^2 - x^2}` along the rolling
direction x, uniform across its width. Boussinesq's displacement [1]_ at the distance xi
a along x from its middle, integrated from the line of the point that is displaced to
the distance eta a across, is :math:`c\,a^2 f(\xi, \eta) / (\pi E^*)` with

.. math:: f(\xi, \eta) = \int_{-1}^{1} \sqrt{1-t^2}\; \mathrm{arsinh}\frac{\eta}{|\xi-t|}\,dt,

odd in eta; a strip displaces by the difference of f between its two edges. f and its
derivative by ln eta are tabulated: linear in sgn(xi - 1) sqrt|xi - 1|, which removes
the singular slope at the end of the strip, and cubic in ln eta, because the derivative
by a is a difference of slopes. Beyond the largest eta f is linear in ln eta; beyond
xi = 6 the strip is a point, and f depends on eta / xi alone.

References
----------
.. [1] K. L. Johnson, Contact Mechanics, Cambridge 1985, doi:10.1017/CBO9781139171731,
       chapter 3.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from wearsim.contact.kernel import inlined_bare_kernel, leaf_kernel
from wearsim.contact.patch import FloatArray

# Grid of the table: the root of the distance along x from the end of the strip, and
# log2 of eta.
FARTHEST = 6.0  # largest xi of the table
_FIRST_ROOT, _LAST_ROOT, _ROOTS = -1.0, float(np.sqrt(FARTHEST - 1.0)), 144
LOWEST, _HIGHEST, PER_OCTAVE = -12.0, 6.0, 8.0
STEPS = int((_HIGHEST - LOWEST) * PER_OCTAVE)
ROOT_STEPS = _ROOTS / (_LAST_ROOT - _FIRST_ROOT)
STEP = float(np.log(2.0)) / PER_OCTAVE  # step of ln eta

_COLUMN = np.uint64(2 * (STEPS + 1))  # numbers per column
_NODES = 64  # nodes of the quadrature on either side of xi


@lru_cache(maxsize=1)
def influence_table() -> FloatArray:
    """Influence f and its slope on a grid of xi and eta.

    It is computed once per process, in some 20 ms.

    Returns
    -------
    (places of xi, places of eta, 2) array
        f, and its derivative by ln eta times the step of ln eta.
    """
    place = np.linspace(_FIRST_ROOT, _LAST_ROOT, _ROOTS + 1)
    distance = 2.0 ** np.linspace(LOWEST, _HIGHEST, STEPS + 1)
    table = np.zeros((place.size, distance.size, 2))
    # Tanh-sinh quadrature: nodes as shares of an interval from either end, exact to
    # full precision.
    step = np.linspace(-3.2, 3.2, _NODES)
    stretch = 0.5 * np.pi * np.sinh(step)
    near = 1.0 / (1.0 + np.exp(2.0 * stretch))
    weight = (step[1] - step[0]) * 0.25 * np.pi * np.cosh(step) / np.cosh(stretch) ** 2
    _integrate(1.0 + np.sign(place) * place**2, distance, near, weight, table)
    table[:, :, 1] *= STEP
    return table


@leaf_kernel
def _integrate(
    place: FloatArray,
    distance: FloatArray,
    near: FloatArray,
    weight: FloatArray,
    table: FloatArray,
) -> None:
    """Integrate f and its derivative by ln eta on either side of each xi."""
    for k in range(place.size):
        end = min(place[k], 1.0)
        for piece in range(2):
            length = 1.0 + end if piece == 0 else 1.0 - end
            if length <= 0.0:
                continue
            for n in range(near.size):
                # Distances from the ends of the strip at -1 and 1, and from xi; `near`
                # counts from xi or from 1.
                far = near[near.size - 1 - n]
                if piece == 0:
                    to_back, to_front = length * far, 1.0 - end + length * near[n]
                    away = place[k] - end + length * near[n]
                else:
                    to_back, to_front = 1.0 + end + length * near[n], length * far
                    away = length * near[n]
                load = length * weight[n] * np.sqrt(to_back * to_front)
                away = max(away, 1e-300)
                for e in range(distance.size):
                    ratio = distance[e] / away
                    root = np.sqrt(1.0 + ratio * ratio)
                    table[k, e, 0] += load * (
                        np.log(ratio + root) if ratio > 1e-4 else ratio
                    )
                    table[k, e, 1] += load * ratio / root


@inlined_bare_kernel
def column_at(along: float) -> tuple[int, float, float]:
    """Column of the table at xi, and the share of the next column.

    The third value is the distance of xi beyond the last column.
    """
    away = abs(along)
    beyond = max(away / FARTHEST, 1.0)
    from_end = min(away, FARTHEST) - 1.0
    root = np.sqrt(abs(from_end))
    place = ((root if from_end > 0.0 else -root) - _FIRST_ROOT) * ROOT_STEPS
    column = min(int(place), _ROOTS - 1)
    return column, place - column, beyond


@inlined_bare_kernel
def influence_at(
    table: FloatArray, column: int, share: float, octaves: float
) -> tuple[float, float]:
    """Influence f and its slope per step of ln eta.

    `octaves` counts steps of ln eta from the lowest one of the table. `table` is that
    of `influence_table` in one row.
    """
    t, left, rise, a, b, right_slope = _cubic_at(table, column, share, octaves)
    u = 1.0 - t
    bend = a * u + b * t
    value = left + t * (rise + u * bend)
    slope = rise + (u - t) * bend + t * u * (b - a)
    if octaves > STEPS:
        value += (octaves - STEPS) * right_slope
    return value, slope


@inlined_bare_kernel
def slope_at(
    table: FloatArray, column: int, share: float, octaves: float
) -> tuple[float, float]:
    """Slope of f per step of ln eta, and its own slope; arguments of `influence_at`."""
    t, _, rise, a, b, right_slope = _cubic_at(table, column, share, octaves)
    if octaves > STEPS:
        return right_slope, 0.0
    u = 1.0 - t
    bend = a * u + b * t
    slope = rise + (u - t) * bend + t * u * (b - a)
    return slope, 2.0 * ((u - t) * (b - a) - bend)


@inlined_bare_kernel
def _cubic_at(
    table: FloatArray, column: int, share: float, octaves: float
) -> tuple[float, float, float, float, float, float]:
    """Cubic of f in ln eta: t, value on the left, rise, slopes beyond it, slope right.

    Slopes on the left and the right differ from the rise by a and -b. Indices are
    unsigned, because numba would check each of them for a negative value that counts
    from the end.
    """
    inside = min(max(octaves, 0.0), STEPS - 1e-9)
    k = np.uint64(inside)
    t = inside - k
    index = np.uint64(column) * _COLUMN + np.uint64(2) * k
    next_index = index + _COLUMN
    rest = 1.0 - share
    left = rest * table[index] + share * table[next_index]
    left_slope = (
        rest * table[index + np.uint64(1)] + share * table[next_index + np.uint64(1)]
    )
    right = (
        rest * table[index + np.uint64(2)] + share * table[next_index + np.uint64(2)]
    )
    right_slope = (
        rest * table[index + np.uint64(3)] + share * table[next_index + np.uint64(3)]
    )
    rise = right - left
    return t, left, rise, left_slope - rise, rise - right_slope, right_slope
