r"""Displacements of an elastic half-space under uniform tractions on grid cells.

Two equal bodies, so that normal and tangential tractions do not influence each other.
Relative displacement of the surfaces, with :math:`\rho` the distance to the loaded
point and 1/E* = (1 - nu)/G:

.. math:: u_z = \frac{1}{\pi E^*}\iint\frac{p}{\rho},\qquad
   u_x = \frac{1}{\pi G}\iint\Big(\frac{1-\nu}{\rho}+\frac{\nu x^2}{\rho^3}\Big)\tau_x
       + \frac{\nu xy}{\rho^3}\tau_y,

u_y likewise. The integrals over a rectangle are sums, with signs, of corner functions
over its corners.

On a uniform grid of n cells in a row the displacements are a convolution. With n - 1
empty cells behind them it is a product of Fourier transforms of period 2 n - 1. Fields
are split into even and odd parts about the middle of the grid, whose waves are cosines
and sines, so that all numbers are real and half as many; the transforms are products of
matrices, which on the grids of patches take less time than fast transforms.

References
----------
.. [1] K. L. Johnson, Contact Mechanics, Cambridge 1985, doi:10.1017/CBO9781139171731,
       sections 3.2 and 3.6.
.. [2] A. E. H. Love, Phil. Trans. R. Soc. A 228 (1929) 377-420,
       doi:10.1098/rsta.1929.0009.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from wearsim.contact.kernel import inner_kernel, kernel
from wearsim.contact.patch import FloatArray

_ONE_THREAD = (
    1 << 18
)  # multiplications of a product up to which OpenBLAS starts no threads


@inner_kernel
def _log_sum(along: float, across: float, distance: float) -> float:
    """ln(along + distance) without cancellation where `along` is negative.

    It is 0 where the logarithm is undefined.
    """
    size = np.log(abs(along) + distance) if distance > 0.0 else 0.0
    if along >= 0.0:
        return float(size)
    return float((2.0 * np.log(abs(across)) if across != 0.0 else 0.0) - size)


@kernel
def _corner_functions(x: FloatArray, y: FloatArray) -> FloatArray:
    """Antiderivatives in x and y of x^2/rho^3, y^2/rho^3 and xy/rho^3.

    They are given at the corners of a grid (3, kx, ky).

    They are y ln(x + rho), x ln(y + rho) and -rho; on the axes, where a logarithm may
    be infinite, its factor is zero and so is the product. ln(x + rho) = ln(y^2/(rho -
    x)) where x is negative.
    """
    out = np.empty((3, x.size, y.size))
    for i in range(x.size):
        for j in range(y.size):
            distance = np.hypot(x[i], y[j])
            out[0, i, j] = y[j] * _log_sum(x[i], y[j], distance)
            out[1, i, j] = x[i] * _log_sum(y[j], x[i], distance)
            out[2, i, j] = -distance
    return out


def cell_integrals(
    cell_length: float, cell_width: float, shape: tuple[int, int]
) -> FloatArray:
    r"""Integrals of :math:`x^2/\rho^3`, :math:`y^2/\rho^3`, :math:`xy/\rho^3` on cells.

    Parameters
    ----------
    cell_length, cell_width : float
        Size of the cells along x and y [m].
    shape : (int, int)
        nx, ny cells.

    Returns
    -------
    (3, nx, ny) array
        Over cell (i, j), centred i lengths and j widths from the origin [m]; the first
        two are even in both directions and add up to the integral of 1/rho, the third
        is odd in both.
    """
    nx, ny = shape
    x: FloatArray = cell_length * (np.arange(nx + 1, dtype=np.float64) - 0.5)
    y: FloatArray = cell_width * (np.arange(ny + 1, dtype=np.float64) - 0.5)
    corner = _corner_functions(x, y)
    along = corner[:, 1:] - corner[:, :-1]
    integral: FloatArray = along[..., 1:] - along[..., :-1]
    integral[2, 0] = integral[2, :, 0] = 0.0  # odd functions vanish in the middle
    return integral


def normal_influence(
    cell_length: float,
    cell_width: float,
    shape: tuple[int, int],
    effective_modulus: float,
) -> FloatArray:
    """Return normal displacements by unit pressure on the first cell (Boussinesq).

    They are those of the cells of a grid.

    Parameters
    ----------
    cell_length, cell_width : float
        Size of the cells along and across [m].
    shape : (int, int)
        nx, ny cells.
    effective_modulus : float
        E* [Pa].

    Returns
    -------
    (nx, ny) array
        At cell (i, j), |i| cells along and |j| across; even in both [m/Pa].
    """
    along, across, _ = cell_integrals(cell_length, cell_width, shape)
    return (along + across) / (np.pi * effective_modulus)


def tangential_influence(
    cell_length: float,
    cell_width: float,
    shape: tuple[int, int],
    shear_modulus: float,
    poisson_ratio: float,
) -> FloatArray:
    """Tangential displacements by unit shear on the first cell of a grid (Cerruti).

    They are given at cell centres.

    Parameters
    ----------
    cell_length, cell_width : float
        Size of the cells along and across [m].
    shape : (int, int)
        nx, ny cells; x index from the leading end.
    shear_modulus : float
        G [Pa].
    poisson_ratio : float
        [-].

    Returns
    -------
    (3, nx, ny) array
        u_x under tau_x, u_y under tau_y (both even in both directions), and u_x under
        tau_y = u_y under tau_x (odd in both), at the cell i places behind and j
        across [m/Pa].
    """
    xx, yy, xy = cell_integrals(cell_length, cell_width, shape)
    both = (1.0 - poisson_ratio) * (xx + yy)
    # The index counts backwards here: only the mixed influence changes sign.
    table = np.stack(
        (both + poisson_ratio * xx, both + poisson_ratio * yy, -poisson_ratio * xy)
    )
    table /= np.pi * shear_modulus
    return table


@kernel
def multiply(left: FloatArray, right: FloatArray, out: FloatArray) -> None:
    """Product of two contiguous matrices, split so that BLAS uses one thread."""
    rows = max(_ONE_THREAD // (left.shape[1] * right.shape[1]), 1)
    for first in range(0, left.shape[0], rows):
        np.dot(left[first : first + rows], right, out[first : first + rows])


@inner_kernel
def scalar_product(left: FloatArray, right: FloatArray) -> float:
    """Scalar product, split so that BLAS uses one thread."""
    total = 0.0
    for first in range(0, left.size, 8192):
        total += np.dot(left[first : first + 8192], right[first : first + 8192])
    return total


@lru_cache(maxsize=512)
def wave_table(count: int) -> FloatArray:
    """Cosines and sines (2, n, h) of n waves at the h cells from the middle on.

    The result is flat and includes the transposed table.
    """
    place = np.arange((count + 1) // 2) + (0.5 if count % 2 == 0 else 0.0)
    turn = (2.0 * np.pi / (2 * count - 1)) * np.outer(np.arange(count), place)
    table = np.stack((np.cos(turn), np.sin(turn)))
    return np.concatenate((table.ravel(), table.transpose(0, 2, 1).ravel()))


def wave_weights(count: int) -> FloatArray:
    """Weights (n,) of the waves of a row in the inverse transform.

    They are part of `spectrum`.
    """
    return np.where(np.arange(count) > 0, 2.0, 1.0) / (2 * count - 1)


@lru_cache(maxsize=512)
def _spectrum_table(count: int) -> FloatArray:
    """Cosines and sines (4, n, n) that transform even and odd influences.

    The tables are weighted and also given transposed.
    """
    period = 2 * count - 1
    number = np.arange(count)
    turn = (2.0 * np.pi / period) * (np.outer(number, number) % period)
    both_signs = np.where(number > 0, 2.0, 1.0)
    table = np.stack((np.cos(turn), np.sin(turn))) * (
        wave_weights(count)[:, None] * both_signs
    )
    return np.concatenate((table, table.transpose(0, 2, 1)))


def spectrum(
    influence: FloatArray, *, odd: tuple[bool, bool] = (False, False)
) -> FloatArray:
    """Transform of the influence of one cell, for the waves of `waves_of`.

    Parameters
    ----------
    influence : (nx, ny) array
        At |i| cells along and |j| across.
    odd : (bool, bool)
        True if the influence changes its sign with i and with j.

    Returns
    -------
    (nx, ny) array
        Factors of the waves. An even influence keeps cosines cosines and sines sines;
        one that is odd in a direction turns cosines into sines and sines into cosines
        with the opposite sign.
    """
    (nx, ny), half = influence.shape, np.empty(influence.shape)
    factors = np.empty(influence.shape)
    multiply(_spectrum_table(nx)[int(odd[0])], influence, half)
    multiply(half, _spectrum_table(ny)[2 + int(odd[1])], factors)
    return factors


@kernel
def waves_of(field: FloatArray, along: FloatArray, across: FloatArray) -> FloatArray:
    """Waves (2, 2, nx, ny) of a field (nx, ny): cosines, then sines in each direction.

    The tables are those of both directions.
    """
    nx, ny = field.shape
    hx, hy = (nx + 1) // 2, (ny + 1) // 2
    part = np.empty((2, 2, hx, hy))  # even and odd parts across, then along
    for i in range(hx):
        front, rear = nx - hx + i, hx - 1 - i
        for j in range(hy):
            right, left = ny - hy + j, hy - 1 - j
            size = (0.5 if front == rear else 1.0) * (0.5 if right == left else 1.0)
            a, b = size * field[front, right], size * field[front, left]
            c, d = size * field[rear, right], size * field[rear, left]
            part[0, 0, i, j], part[0, 1, i, j] = a + b + c + d, a + b - c - d
            part[1, 0, i, j], part[1, 1, i, j] = a - b + c - d, a - b - c + d
    of_x = along[: 2 * nx * hx].reshape(2, nx, hx)
    of_y = across[2 * ny * hy : 4 * ny * hy].reshape(2, hy, ny)
    half, waves = np.empty((2 * hx, ny)), np.empty((2, 2, nx, ny))
    for q in range(2):
        multiply(part[q].reshape(2 * hx, hy), of_y[q], half)
        for p in range(2):
            multiply(of_x[p], half[p * hx : (p + 1) * hx], waves[p, q])
    return waves


@kernel
def field_of(
    waves: FloatArray, along: FloatArray, across: FloatArray, field: FloatArray
) -> None:
    """Field (nx, ny) with given waves: inverse of `waves_of`.

    The weights of the inverse are in `spectrum`.
    """
    nx, ny = field.shape
    hx, hy = (nx + 1) // 2, (ny + 1) // 2
    of_x = along[2 * nx * hx : 4 * nx * hx].reshape(2, hx, nx)
    of_y = across[: 2 * ny * hy].reshape(2, ny, hy)
    half, part = np.empty((2 * hx, ny)), np.empty((2, 2, hx, hy))
    for q in range(2):
        for p in range(2):
            multiply(of_x[p], waves[p, q], half[p * hx : (p + 1) * hx])
        multiply(half, of_y[q], part[q].reshape(2 * hx, hy))
    for i in range(hx):
        front, rear = nx - hx + i, hx - 1 - i
        for j in range(hy):
            right, left = ny - hy + j, hy - 1 - j
            a, b, c, d = (
                part[0, 0, i, j],
                part[0, 1, i, j],
                part[1, 0, i, j],
                part[1, 1, i, j],
            )
            field[front, right], field[front, left] = a + b + c + d, a + b - c - d
            field[rear, right], field[rear, left] = a - b + c - d, a - b - c + d
