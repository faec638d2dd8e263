r"""Coulomb friction on a half-space in steady rolling, for one patch.

The method is semi-smooth Newton with Krylov steps.

The unknowns are the tractions of the cells. In cells that stick the slip s vanishes; in
the others the traction has the magnitude of the bound b and opposes the slip. Both are
one equation [1]_, :math:`\tau = P_b(\tau - r s)` with the projection :math:`P_b` on the
disc of radius b. The slip follows from the traction by a convolution. r is one over the
largest stiffness of the convolution for any wave: larger values couple neighbouring
cells so strongly that the steps circle.

Waves along the rolling direction make the convolution nearly antisymmetric, on which
Krylov methods converge slowly. The behaviour of each strip alone is therefore
preconditioned: the Toeplitz matrix of a strip is split into triangular factors once,
and their leading parts serve every stretch of stick of every strip. This more than
halves the number of convolutions.

References
----------
.. [1] P. Alart, A. Curnier, Comput. Methods Appl. Mech. Eng. 92 (1991) 353-375,
   doi:10.1016/0045-7825(91)90022-X.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.influence import (
    field_of,
    multiply,
    scalar_product,
    spectrum,
    tangential_influence,
    wave_table,
    wave_weights,
    waves_of,
)
from wearsim.contact.kernel import inner_kernel, kernel, plain
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.tangential.semismooth_newton import (
    OUTSIDE,
    STICK,
    combine,
    cut_back,
    derivative,
    exactness,
    orthogonalise,
)

TOLERANCE = 1e-6  # sum of the residuals of all cells over the sum of their tractions
MOST_STEPS = 40
MOST_PRODUCTS = 80  # largest number of convolutions of one linear solution
# Largest number of cells of a stretch that are solved together, so that the work is
# proportional to the cells.
_LONGEST = 64
# Correction of a strip's own influence for its neighbours; it saves a fifth of the
# products.
_SIDE = 0.28


class SlipOperator(NamedTuple):
    """Slip that tractions in the cells of a grid add there.

    Parameters
    ----------
    along, across : array
        Waves of both directions, from `wave_table`; x index from the leading end.
    factor : (3, 2, nx, ny) array
        Factors of the waves: slip along x from traction along x, the same of y, and
        across; of what is even along x, and odd [1/Pa].
    strip : (2, 2, k, k) array
        Inverse triangles, lower and upper one, transposed, of the matrix of k cells in
        a strip on their own, of x and y [Pa].
    reach : float
        One over the largest slip per traction of any wave [Pa].
    own : float
        Slip per traction of a cell on its own, times `reach` [-].
    """

    along: FloatArray
    across: FloatArray
    factor: FloatArray
    strip: FloatArray
    reach: float
    own: float


@dataclass(frozen=True)
class RollingSolution:
    """Tractions and slip of a patch in steady rolling.

    Parameters
    ----------
    traction : (2, nx, ny) array
        On the wheel [Pa].
    slip : (2, nx, ny) array
        At the upstream edges of the cells, over V [-]; exactly 0 in cells that stick.
    slipping : (nx, ny) bool array
        Cells that slip.
    residual : float
        Residual relative to the sum of tractions [-].
    steps, products : int
        Newton steps and convolutions that were needed.
    """

    traction: FloatArray
    slip: FloatArray
    slipping: NDArray[np.bool_]
    residual: float
    steps: int
    products: int


def slip_operator(
    shape: tuple[int, int],
    cell_length: float,
    cell_width: float,
    shear_modulus: float,
    poisson_ratio: float,
) -> SlipOperator:
    r"""Operator of the slip that tractions cause in steady rolling.

    Parameters
    ----------
    shape : (int, int)
        nx, ny cells.
    cell_length, cell_width : float
        Size of a cell [m].
    shear_modulus, poisson_ratio : float
        Of both bodies [Pa], [-].

    Returns
    -------
    SlipOperator
        Of :math:`(u(x) - u(x + \Delta x)) / \Delta x`: material flows from the leading
        end downstream.
    """
    return _of_ratio(
        *shape, float(f"{cell_width / cell_length:.12g}"), shear_modulus, poisson_ratio
    )


@lru_cache(maxsize=64)
def _of_ratio(
    nx: int, ny: int, ratio: float, shear_modulus: float, poisson_ratio: float
) -> SlipOperator:
    """Operator of cells with a ratio of width to length.

    Patches that are stretched in the search of a balance share it.
    """
    table = tangential_influence(1.0, ratio, (nx + 1, ny), shear_modulus, poisson_ratio)
    ahead = np.concatenate((table[:, 1:2], table[:, :-2]), axis=1)
    ahead[2, 0] *= -1.0
    # Difference from cell to cell, split by the sign of the index: second and first
    # differences.
    bend, rise = (
        table[:, :-1] - 0.5 * (ahead + table[:, 1:]),
        0.5 * (table[:, 1:] - ahead),
    )
    factor = np.array(
        [[spectrum(bend[c]), spectrum(rise[c], odd=(True, False))] for c in range(2)]
        + [[spectrum(rise[2], odd=(False, True)), spectrum(bend[2], odd=(True, True))]]
    )
    longest = np.arange(min(nx, _LONGEST))
    place = longest[:, None] - longest
    matrix = (
        bend[:2, :, 0][:, np.abs(place)]
        + np.sign(place) * rise[:2, :, 0][:, np.abs(place)]
    )
    strip = np.zeros((2, 2, longest.size, longest.size))
    _split(matrix, strip)
    reach = 1.0 / float(
        (
            np.hypot(factor[:2, 0], factor[:2, 1])
            / wave_weights(nx)[:, None]
            / wave_weights(ny)
        ).max()
    )
    cell_slip = reach * 0.5 * float(bend[:2, 0, 0].sum())
    strip = np.ascontiguousarray(strip.transpose(0, 1, 3, 2))
    return SlipOperator(wave_table(nx), wave_table(ny), factor, strip, reach, cell_slip)


def solve(
    operator: SlipOperator,
    rigid_slip: FloatArray,
    bound: FloatArray,
    start: FloatArray,
    *,
    most_steps: int = MOST_STEPS,
    tolerance: float = TOLERANCE,
) -> RollingSolution:
    """Tractions and slip of steady rolling.

    Parameters
    ----------
    operator : SlipOperator
        Of the patch's grid.
    rigid_slip : (2, nx, ny) array
        Slip the cells would have without deformation [-].
    bound : (nx, ny) array
        Friction coefficient times pressure [Pa]; cells with 0 are not in contact.
    start : (2, nx, ny) array
        First guess of the tractions [Pa]; cut back to the bound.
    most_steps : int
        Newton steps before it gives up.
    tolerance : float
        Residual at which it stops [-].

    Returns
    -------
    RollingSolution
        The caller judges its residual: at most the tolerance unless the steps ran out.
    """
    bound = plain(bound)
    marks, traction = np.empty(bound.shape), plain(np.where(bound > 0.0, start, 0.0))
    slip = np.empty(traction.shape)
    error, steps, products = _newton(
        operator,
        plain(rigid_slip),
        bound,
        tolerance,
        most_steps,
        MOST_PRODUCTS,
        traction,
        slip,
        marks,
    )
    slipping = (marks >= 0.0) & (marks <= 1.0)
    slip = np.where(slipping | (bound <= 0.0), slip, 0.0)
    return RollingSolution(traction, slip, slipping, error, steps, products)


@kernel
def _newton(
    operator: SlipOperator,
    rigid_slip: FloatArray,
    bound: FloatArray,
    tolerance: float,
    most_steps: int,
    most_products: int,
    traction: FloatArray,
    slip: FloatArray,
    marks: FloatArray,
) -> tuple[float, int, int]:
    """Newton's method from `traction`.

    Return the residual and the numbers of steps and convolutions.
    """
    direction, rest = np.zeros(traction.shape), np.empty(traction.shape)
    change, basis = (
        np.empty(traction.shape),
        np.empty((most_products + 1, traction.size)),
    )
    products, before, steps = 0, np.inf, 0
    while True:
        cut_back(traction, bound)
        _slip(operator, traction, slip)
        slip += rigid_slip
        products += 1
        error, size = _residual(
            traction, slip, bound, operator.reach, marks, direction, rest
        )
        error = error / size if size > 0.0 else (0.0 if error == 0.0 else np.inf)
        if (
            error <= tolerance
            or steps == most_steps
            or (not error < np.inf and steps > 0)
        ):
            return error, steps, products
        share = exactness(error, before, tolerance)
        before = error
        products += _linear_step(operator, marks, direction, rest, share, basis, change)
        traction += change
        steps += 1


@inner_kernel
def _slip(operator: SlipOperator, traction: FloatArray, slip: FloatArray) -> None:
    """Slip (2, nx, ny) added by tractions (2, nx, ny) [Pa] to the rigid slip [-]."""
    factor, along, across = operator.factor, operator.along, operator.across
    x, y = waves_of(traction[0], along, across), waves_of(traction[1], along, across)
    for i in range(factor.shape[2]):
        for j in range(factor.shape[3]):
            e, o = factor[2, 0, i, j], factor[2, 1, i, j]
            # Influence of each component on the other: from cosines across to sines and
            # back.
            x_cc, x_sc = (
                -e * y[0, 1, i, j] + o * y[1, 1, i, j],
                -e * y[1, 1, i, j] - o * y[0, 1, i, j],
            )
            x_cs, x_ss = (
                e * y[0, 0, i, j] - o * y[1, 0, i, j],
                e * y[1, 0, i, j] + o * y[0, 0, i, j],
            )
            y_cc, y_sc = (
                -e * x[0, 1, i, j] + o * x[1, 1, i, j],
                -e * x[1, 1, i, j] - o * x[0, 1, i, j],
            )
            y_cs, y_ss = (
                e * x[0, 0, i, j] - o * x[1, 0, i, j],
                e * x[1, 0, i, j] + o * x[0, 0, i, j],
            )
            e, o = factor[0, 0, i, j], factor[0, 1, i, j]
            x_cc += e * x[0, 0, i, j] - o * x[1, 0, i, j]
            x_sc += e * x[1, 0, i, j] + o * x[0, 0, i, j]
            x_cs += e * x[0, 1, i, j] - o * x[1, 1, i, j]
            x_ss += e * x[1, 1, i, j] + o * x[0, 1, i, j]
            e, o = factor[1, 0, i, j], factor[1, 1, i, j]
            y_cc += e * y[0, 0, i, j] - o * y[1, 0, i, j]
            y_sc += e * y[1, 0, i, j] + o * y[0, 0, i, j]
            y_cs += e * y[0, 1, i, j] - o * y[1, 1, i, j]
            y_ss += e * y[1, 1, i, j] + o * y[0, 1, i, j]
            x[0, 0, i, j], x[1, 0, i, j], x[0, 1, i, j], x[1, 1, i, j] = (
                x_cc,
                x_sc,
                x_cs,
                x_ss,
            )
            y[0, 0, i, j], y[1, 0, i, j], y[0, 1, i, j], y[1, 1, i, j] = (
                y_cc,
                y_sc,
                y_cs,
                y_ss,
            )
    field_of(x, along, across, slip[0])
    field_of(y, along, across, slip[1])


@inner_kernel
def _linear_step(
    operator: SlipOperator,
    marks: FloatArray,
    direction: FloatArray,
    rest: FloatArray,
    share: float,
    basis: FloatArray,
    change: FloatArray,
) -> int:
    """Newton's change of the tractions, accurate to a share of the residual.

    Return the number of convolutions. The method is GMRES (generalised minimal
    residuals), preconditioned on the right.
    """
    most, size, shape = basis.shape[0] - 1, rest.size, rest.shape
    triangle, weight = np.zeros((most, most)), np.empty(most)
    cosine, sine, left = np.empty(most), np.empty(most), np.empty(most + 1)
    slip, stretches = np.empty(shape), _stretches(marks, operator.strip.shape[2])
    flat = rest.reshape(size)
    left[0] = whole = np.sqrt(scalar_product(flat, flat))
    for i in range(size):
        basis[0, i] = -flat[i] / whole
    count = 0
    while count < most and abs(left[count]) > share * whole:
        _precondition(
            basis[count].reshape(shape), marks, direction, operator, stretches, change
        )
        _slip(operator, change, slip)
        derivative(
            change,
            slip,
            marks,
            direction,
            operator.reach,
            basis[count + 1].reshape(shape),
        )
        orthogonalise(basis, count, triangle, cosine, sine, left)
        count += 1
    combine(basis, count, triangle, left, weight, slip.reshape(size))
    _precondition(slip, marks, direction, operator, stretches, change)
    return count


@kernel
def _split(matrix: FloatArray, inverse: FloatArray) -> None:
    """Invert the triangular factors of both matrices in place.

    There is no pivoting, because their symmetric part is positive. Leading parts of the
    inverses are the inverses of the leading parts.
    """
    n = matrix.shape[1]
    for c in range(2):
        upper, lower, whole = matrix[c], inverse[c, 0], inverse[c, 1]
        for k in range(n):
            lower[k, k] = whole[k, k] = 1.0
        for k in range(n):
            for i in range(k + 1, n):
                factor = upper[i, k] / upper[k, k]
                for j in range(n):
                    upper[i, j] -= factor * upper[k, j]
                    lower[i, j] -= factor * lower[k, j]
        for k in range(n - 1, -1, -1):
            for j in range(n):
                whole[k, j] /= upper[k, k]
            for i in range(k):
                for j in range(n):
                    whole[i, j] -= upper[i, k] * whole[k, j]


@kernel
def _residual(
    traction: FloatArray,
    slip: FloatArray,
    bound: FloatArray,
    reach: float,
    marks: FloatArray,
    direction: FloatArray,
    rest: FloatArray,
) -> tuple[float, float]:
    """Residual of each cell, and the sums of magnitudes of residuals and tractions.

    `marks` is OUTSIDE or STICK for such cells; for those that slip it is the bound over
    the magnitude of traction - reach x slip, whose direction is kept.
    """
    error, size = 0.0, 0.0
    for i in range(bound.shape[0]):
        for j in range(bound.shape[1]):
            if bound[i, j] <= 0.0:
                marks[i, j] = OUTSIDE
                rest[0, i, j], rest[1, i, j] = 0.0, 0.0
                continue
            t_x, t_y = traction[0, i, j], traction[1, i, j]
            r_x, r_y = reach * slip[0, i, j], reach * slip[1, i, j]
            length = np.sqrt((t_x - r_x) ** 2 + (t_y - r_y) ** 2)
            if length <= bound[i, j]:
                marks[i, j] = STICK
            else:
                marks[i, j] = bound[i, j] / length
                d_x, d_y = (t_x - r_x) / length, (t_y - r_y) / length
                direction[0, i, j], direction[1, i, j] = d_x, d_y
                r_x, r_y = t_x - bound[i, j] * d_x, t_y - bound[i, j] * d_y
            rest[0, i, j], rest[1, i, j] = r_x, r_y
            error += np.sqrt(r_x * r_x + r_y * r_y)
            size += np.sqrt(t_x * t_x + t_y * t_y)
    return error, size


@inner_kernel
def _stretches(marks: FloatArray, longest: int) -> IntArray:
    """First cell, strip and number of cells (k, 3) of each stretch of stick."""
    nx, ny = marks.shape
    table, lines = np.empty((marks.size, 3), dtype=np.int64), 0
    for j in range(ny):
        count = 0
        for i in range(nx):
            if marks[i, j] == STICK:
                if count == 0:
                    table[lines, 0], table[lines, 1] = i, j
                count += 1
                table[lines, 2] = count
            if count == longest or (
                count > 0 and (marks[i, j] != STICK or i == nx - 1)
            ):
                lines, count = lines + 1, 0
    return table[:lines]


@inner_kernel
def _precondition(
    given: FloatArray,
    marks: FloatArray,
    direction: FloatArray,
    operator: SlipOperator,
    stretches: IntArray,
    out: FloatArray,
) -> None:
    """Change of tractions with a given derivative, for uncoupled stick zones.

    Stretches of stick and cells that slip are treated separately.
    """
    nx, ny = marks.shape
    for i in range(nx):
        for j in range(ny):
            mark = marks[i, j]
            if mark == OUTSIDE:
                out[0, i, j], out[1, i, j] = 0.0, 0.0
            elif mark != STICK:
                d_x, d_y = direction[0, i, j], direction[1, i, j]
                along = d_x * given[0, i, j] + d_y * given[1, i, j]
                soft = 1.0 / (1.0 - mark + mark * operator.own)
                out[0, i, j] = along * d_x + soft * (given[0, i, j] - along * d_x)
                out[1, i, j] = along * d_y + soft * (given[1, i, j] - along * d_y)
    count = stretches.shape[0]
    if count == 0:
        return
    line = np.zeros((count, operator.strip.shape[2]))
    half, whole = np.empty_like(line), np.empty_like(line)
    for c in range(2):
        for m in range(count):
            first, j = stretches[m, 0], stretches[m, 1]
            for k in range(stretches[m, 2]):
                i = first + k
                value = given[c, i, j]
                if j > 0 and marks[i, j - 1] == STICK:
                    value -= _SIDE * given[c, i, j - 1]
                if j + 1 < ny and marks[i, j + 1] == STICK:
                    value -= _SIDE * given[c, i, j + 1]
                line[m, k] = value / operator.reach
        multiply(line, operator.strip[c, 0], half)
        for m in range(count):
            half[m, stretches[m, 2] :] = 0.0
        multiply(half, operator.strip[c, 1], whole)
        for m in range(count):
            first, j = stretches[m, 0], stretches[m, 1]
            for k in range(stretches[m, 2]):
                out[c, first + k, j] = whole[m, k]
