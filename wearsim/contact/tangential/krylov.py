r"""Linear systems that are known by their products only: generalised minimal residuals (GMRES) [1]_.

References
----------
.. [1] Y. Saad, M. H. Schultz, SIAM J. Sci. Stat. Comput. 7 (1986) 856-869.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from wearsim.contact.kernel import leaf_kernel
from wearsim.contact.patch import FloatArray


def least_residual(
    product: Callable[[FloatArray], FloatArray], right: FloatArray, share: float, most: int
) -> tuple[FloatArray, int]:
    """Vector whose product comes close to a given one.

    Parameters
    ----------
    product : callable
        Product of the matrix with a vector (n,); it may return the same array each time.
    right : (n,) array
        What the product shall be; not all zero.
    share : float
        Part of the length of `right` that may be left.
    most : int
        Products before it is content with what it has.

    Returns
    -------
    vector : (n,) array
        Start is zero.
    count : int
        Products it took.
    """
    basis = np.empty((most + 1, right.size))
    triangle = np.zeros((most, most))
    rotation = np.zeros((3, most + 1))  # cosines, sines, what is left of the right-hand side
    whole = _begin(right, basis, rotation)
    count, left = 0, whole
    while count < most and left > share * whole:
        left = _orthogonalise(basis, count, product(basis[count]), triangle, rotation)
        count += 1
    vector = np.empty(right.size)
    _combine(basis, count, triangle, rotation, vector)
    return vector, count


@leaf_kernel
def _begin(right: FloatArray, basis: FloatArray, rotation: FloatArray) -> float:
    """First vector of the basis; returns the length of the right-hand side."""
    total = 0.0
    for i in range(right.size):
        total += right[i] * right[i]
    length = np.sqrt(total)
    for i in range(right.size):
        basis[0, i] = right[i] / length
    rotation[2, 0] = length
    return float(length)


@leaf_kernel
def _orthogonalise(
    basis: FloatArray, count: int, product: FloatArray, triangle: FloatArray, rotation: FloatArray
) -> float:
    """Next vector of the basis and column of the triangle; returns the length of the residual left."""
    size = product.size
    for k in range(count + 1):
        value = 0.0
        for i in range(size):
            value += basis[k, i] * product[i]
        triangle[k, count] = value
        for i in range(size):
            product[i] -= value * basis[k, i]
    total = 0.0
    for i in range(size):
        total += product[i] * product[i]
    length = np.sqrt(total)
    if length > 0.0:
        for i in range(size):
            basis[count + 1, i] = product[i] / length
    for k in range(count):
        upper, lower = triangle[k, count], triangle[k + 1, count]
        triangle[k, count] = rotation[0, k] * upper + rotation[1, k] * lower
        triangle[k + 1, count] = rotation[0, k] * lower - rotation[1, k] * upper
    upper = triangle[count, count]
    whole = np.sqrt(upper * upper + length * length)
    if whole > 0.0:
        rotation[0, count], rotation[1, count] = upper / whole, length / whole
    else:
        rotation[0, count], rotation[1, count] = 1.0, 0.0
    triangle[count, count] = whole
    rotation[2, count + 1] = -rotation[1, count] * rotation[2, count]
    rotation[2, count] *= rotation[0, count]
    return float(abs(rotation[2, count + 1]))


@leaf_kernel
def _combine(
    basis: FloatArray, count: int, triangle: FloatArray, rotation: FloatArray, out: FloatArray
) -> None:
    """Sum of the basis vectors with the weights that leave the least residual."""
    for k in range(count - 1, -1, -1):
        value = rotation[2, k]
        for j in range(k + 1, count):
            value -= triangle[k, j] * rotation[0, j]
        # the cosines are no longer needed: their row takes the weights
        rotation[0, k] = value / triangle[k, k] if triangle[k, k] != 0.0 else 0.0
    for i in range(out.size):
        out[i] = 0.0
    for k in range(count):
        for i in range(out.size):
            out[i] += rotation[0, k] * basis[k, i]
