r"""Parts of the semi-smooth Newton method shared by the models of steady rolling.

Traction and slip of points that stick or slip are one equation [1]_,
:math:`\tau = P_b(\tau - r s)`, with the projection :math:`P_b` on the disc of radius b.
Its linear steps are solved by generalised minimal residuals, as exactly as the outer
iteration deserves [2]_.

Points are marked by `STICK`, by `OUTSIDE` (no bound, no traction), or, where they slip,
by the bound over the size of traction - reach x slip, between 0 and 1.

References
----------
.. [1] P. Alart, A. Curnier, Comput. Methods Appl. Mech. Eng. 92 (1991) 353-375,
   doi:10.1016/0045-7825(91)90022-X.
.. [2] S. C. Eisenstat, H. F. Walker, SIAM J. Sci. Comput. 17 (1996) 16-32,
       doi:10.1137/0917003.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.influence import scalar_product
from wearsim.contact.kernel import inner_bare_kernel
from wearsim.contact.patch import FloatArray

STICK, OUTSIDE = 2.0, -1.0


@inner_bare_kernel
def cut_back(traction: FloatArray, bound: FloatArray) -> None:
    """Limit tractions (2, nx, ny) to the bound (nx, ny)."""
    for i in range(bound.shape[0]):
        for j in range(bound.shape[1]):
            size = np.sqrt(traction[0, i, j] ** 2 + traction[1, i, j] ** 2)
            if size > bound[i, j]:
                traction[0, i, j] *= bound[i, j] / size
                traction[1, i, j] *= bound[i, j] / size


@inner_bare_kernel
def derivative(
    change: FloatArray,
    slip: FloatArray,
    marks: FloatArray,
    direction: FloatArray,
    reach: float,
    out: FloatArray,
) -> None:
    """Return the derivative of the residual by a change of tractions.

    The change of tractions changes the slip by `slip`.
    """
    for i in range(marks.shape[0]):
        for j in range(marks.shape[1]):
            mark = marks[i, j]
            if mark == OUTSIDE:
                out[0, i, j], out[1, i, j] = 0.0, 0.0
            elif mark == STICK:
                out[0, i, j], out[1, i, j] = (
                    reach * slip[0, i, j],
                    reach * slip[1, i, j],
                )
            else:
                d_x, d_y = direction[0, i, j], direction[1, i, j]
                v_x, v_y = (
                    change[0, i, j] - reach * slip[0, i, j],
                    change[1, i, j] - reach * slip[1, i, j],
                )
                along = d_x * v_x + d_y * v_y
                out[0, i, j] = change[0, i, j] - mark * (v_x - along * d_x)
                out[1, i, j] = change[1, i, j] - mark * (v_y - along * d_y)


@inner_bare_kernel
def exactness(error: float, before: float, tolerance: float) -> float:
    """Share of the residual `error` that a linear step may leave [-].

    It falls with the convergence from the residual `before` (inf in the first step),
    and is no smaller than the last step needs.
    """
    share = 0.2 if not before < np.inf else min(0.2, 0.5 * (error / before) ** 1.6)
    return max(share, 0.5 * tolerance / error, 1e-4)


@inner_bare_kernel
def orthogonalise(
    basis: FloatArray,
    count: int,
    triangle: FloatArray,
    cosine: FloatArray,
    sine: FloatArray,
    left: FloatArray,
) -> None:
    """Make the product `basis[count + 1]` part of an orthonormal basis.

    `left` becomes the remaining residual.
    """
    product = basis[count + 1]
    for k in range(count + 1):
        value = scalar_product(basis[k], product)
        triangle[k, count] = value
        for i in range(product.size):
            product[i] -= value * basis[k, i]
    length = np.sqrt(scalar_product(product, product))
    if length > 0.0:
        for i in range(product.size):
            product[i] /= length
    for k in range(count):
        upper, lower = triangle[k, count], triangle[k + 1, count]
        triangle[k, count] = cosine[k] * upper + sine[k] * lower
        triangle[k + 1, count] = cosine[k] * lower - sine[k] * upper
    upper = triangle[count, count]
    total = np.sqrt(upper * upper + length * length)
    cosine[count], sine[count] = (
        (upper / total, length / total) if total > 0.0 else (1.0, 0.0)
    )
    triangle[count, count] = total
    left[count + 1] = -sine[count] * left[count]
    left[count] *= cosine[count]


@inner_bare_kernel
def combine(
    basis: FloatArray,
    count: int,
    triangle: FloatArray,
    left: FloatArray,
    weight: FloatArray,
    out: FloatArray,
) -> None:
    """Sum the first `count` vectors into `out` with the smallest residual."""
    for k in range(count - 1, -1, -1):
        value = left[k]
        for j in range(k + 1, count):
            value -= triangle[k, j] * weight[j]
        weight[k] = value / triangle[k, k] if triangle[k, k] != 0.0 else 0.0
    out[:] = 0.0
    for k in range(count):
        for i in range(out.size):
            out[i] += weight[k] * basis[k, i]
