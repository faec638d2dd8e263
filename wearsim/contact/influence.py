r"""Displacements of an elastic half-space under uniform tractions on the cells of a grid.

Two equal bodies, so that normal and tangential tractions do not influence each other. Relative displacement
of the surfaces, with :math:`\rho` the distance to the loaded point and 1/E* = (1 - nu)/G:

.. math:: u_z = \frac{1}{\pi E^*}\iint\frac{p}{\rho},\qquad
   u_x = \frac{1}{\pi G}\iint\Big(\frac{1-\nu}{\rho}+\frac{\nu x^2}{\rho^3}\Big)\tau_x
       + \frac{\nu xy}{\rho^3}\tau_y,

u_y likewise. The integrals over a rectangle are sums, with signs, of corner functions over its corners.
On a uniform grid the displacements are a convolution, by Fourier transforms on a doubled grid.

References
----------
.. [1] K. L. Johnson, Contact Mechanics, Cambridge 1985, doi:10.1017/CBO9781139171731, sections 3.2 and 3.6.
.. [2] A. E. H. Love, Phil. Trans. R. Soc. A 228 (1929) 377-420, doi:10.1098/rsta.1929.0009.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import fft

from wearsim.contact.patch import FloatArray

ComplexArray = NDArray[np.complex128]


def _log_sum(one: FloatArray, other: FloatArray, distance: FloatArray) -> FloatArray:
    """ln(one + distance) without cancellation where `one` is negative; 0 where it has no value."""
    size = np.abs(one) + distance
    wide = np.log(np.where(size > 0.0, size, 1.0))
    cross = np.log(np.where(other != 0.0, np.abs(other), 1.0))
    return np.where(one >= 0.0, wide, 2.0 * cross - wide)


def corner_functions(x: ArrayLike, y: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    r"""Antiderivatives in x and y of :math:`x^2/\rho^3`, :math:`y^2/\rho^3` and :math:`xy/\rho^3`.

    Parameters
    ----------
    x, y : arrays that broadcast
        A corner, from the point of the displacement [m].

    Returns
    -------
    along, across, mixed : array
        y ln(x + rho), x ln(y + rho) and -rho [m]; the first two add up to the antiderivative of 1/rho. On
        the axes, where the logarithm may be infinite, its factor is zero and so is the product.

    Notes
    -----
    ln(x + rho) = ln(y^2 / (rho - x)) where x is negative: no digits are lost next to the axis.
    """
    at_x, at_y = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
    distance = np.hypot(at_x, at_y)
    along: FloatArray = at_y * _log_sum(at_x, at_y, distance)
    across: FloatArray = at_x * _log_sum(at_y, at_x, distance)
    mixed: FloatArray = -distance
    return along, across, mixed


def _over_corners(corner: FloatArray) -> FloatArray:
    """Sum over the corners of each cell between neighbouring edges, with their signs."""
    along = corner[..., 1:, :] - corner[..., :-1, :]
    return along[..., 1:] - along[..., :-1]


def _edges(count: int, size: FloatArray, start: float) -> FloatArray:
    """Edges of `count` cells, the first of which is centred on `start` sizes; (m, count + 1)."""
    return size[..., None] * (np.arange(count + 1) - 0.5 + start)


def normal_influence(
    cell_length: ArrayLike, cell_width: ArrayLike, shape: tuple[int, int], effective_modulus: float
) -> FloatArray:
    """Displacements along the normal under unit pressure on the first cell of a grid (Boussinesq).

    Parameters
    ----------
    cell_length, cell_width : float or (m,) array
        Size of the cells along and across [m].
    shape : (int, int)
        nx, ny cells.
    effective_modulus : float
        E* [Pa].

    Returns
    -------
    (..., nx, ny) array
        At cell (i, j), |i| cells along and |j| across; even in both [m/Pa].
    """
    nx, ny = shape
    length, width = np.broadcast_arrays(np.asarray(cell_length, float), np.asarray(cell_width, float))
    x, y = _edges(nx, length, 0.0), _edges(ny, width, 0.0)
    along, across, _ = corner_functions(x[..., :, None], y[..., None, :])
    return _over_corners(along + across) / (np.pi * effective_modulus)


def tangential_influence(
    cell_length: ArrayLike,
    cell_width: ArrayLike,
    shape: tuple[int, int],
    shear_modulus: float,
    poisson_ratio: float,
    *,
    ahead: float = 0.0,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Tangential displacements at, or ahead of, cell centres under unit shear on one cell (Cerruti).

    Parameters
    ----------
    cell_length, cell_width : float or (m,) array
        Size of the cells along and across [m].
    shape : (int, int)
        nx, ny cells.
    shear_modulus : float
        G [Pa].
    poisson_ratio : float
        [-].
    ahead : float
        How many cells ahead of the centres (towards the leading end) the displacement is taken: 0, or 1
        for the difference along the way of a particle.

    Returns
    -------
    along, across, mixed : (..., 2 nx - 1, 2 ny - 1) array
        u_x under tau_x, u_y under tau_y, and u_x under tau_y = u_y under tau_x [m/Pa]. Entry
        (nx - 1 + i, ny - 1 + j) is for the cell i places behind and j across from the loaded one: x index
        from the leading end, as in `PatchGrid`.
    """
    nx, ny = shape
    length, width = np.broadcast_arrays(np.asarray(cell_length, float), np.asarray(cell_width, float))
    # In the direction of the index, which is backwards: only the mixed one changes sign.
    x, y = _edges(2 * nx - 1, length, 1.0 - nx - ahead), _edges(2 * ny - 1, width, 1.0 - ny)
    xx, yy, xy = (_over_corners(part) for part in corner_functions(x[..., :, None], y[..., None, :]))
    both = (1.0 - poisson_ratio) * (xx + yy)
    scale = 1.0 / (np.pi * shear_modulus)
    along: FloatArray = (both + poisson_ratio * xx) * scale
    across: FloatArray = (both + poisson_ratio * yy) * scale
    mixed: FloatArray = -poisson_ratio * xy * scale
    return along, across, mixed


@dataclass(frozen=True)
class GridInfluence:
    """Influence of every cell of a grid on every other, as a product of Fourier transforms.

    Parameters
    ----------
    spectrum : (..., mx, my // 2 + 1) complex array
        Transform of the influence on the doubled grid.
    shape : (int, int)
        nx, ny cells.
    doubled : (int, int)
        mx, my: at least twice the cells less one, in numbers that transform fast.
    """

    spectrum: ComplexArray
    shape: tuple[int, int]
    doubled: tuple[int, int]

    def __call__(self, traction: FloatArray) -> FloatArray:
        """Displacement (..., nx, ny) at the cell centres under tractions (..., nx, ny) of the cells."""
        product = transform(traction, self.doubled)
        product *= self.spectrum
        return back(product, self.shape, self.doubled)


def grid_influence(influence: FloatArray, shape: tuple[int, int]) -> GridInfluence:
    """Transform the influence of one cell for use on a whole grid.

    Parameters
    ----------
    influence : (..., nx, ny) or (..., 2 nx - 1, 2 ny - 1) array
        As from `normal_influence` (even in both directions) or `tangential_influence`.
    shape : (int, int)
        nx, ny cells.

    Returns
    -------
    GridInfluence
    """
    nx, ny = shape
    doubled = doubled_shape(shape)
    table = np.zeros((*influence.shape[:-2], *doubled))
    i, j = np.arange(1 - nx, nx), np.arange(1 - ny, ny)
    even = influence.shape[-2:] == (nx, ny)
    whole = influence[..., np.abs(i)[:, None], np.abs(j)] if even else influence
    table[..., (i % doubled[0])[:, None], j % doubled[1]] = whole
    return GridInfluence(transform(table, doubled), shape, doubled)


def doubled_shape(shape: tuple[int, int]) -> tuple[int, int]:
    """Smallest grid that transforms fast and keeps the convolution of `shape` cells from wrapping round."""
    along = int(fft.next_fast_len(2 * shape[0] - 1, real=False))
    across = int(fft.next_fast_len(2 * shape[1] - 1, real=True))
    return along, across


def transform(field: FloatArray, doubled: tuple[int, int]) -> ComplexArray:
    """Fourier transform of fields (..., nx, ny), filled up with zeros to the doubled grid."""
    # First across, where only the rows of the field itself need it.
    half = fft.rfft(field, doubled[1], axis=-1, workers=1)
    whole: ComplexArray = fft.fft(half, doubled[0], axis=-2, workers=1, overwrite_x=True)
    return whole


def back(spectrum: ComplexArray, shape: tuple[int, int], doubled: tuple[int, int]) -> FloatArray:
    """Fields (..., nx, ny) of transforms on the doubled grid, which are overwritten."""
    half = fft.ifft(spectrum, axis=-2, workers=1, overwrite_x=True)[..., : shape[0], :]
    field: FloatArray = fft.irfft(half, doubled[1], axis=-1, workers=1)[..., : shape[1]]
    return field
