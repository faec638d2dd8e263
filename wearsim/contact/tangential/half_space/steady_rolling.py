r"""Coulomb friction on a half-space in steady rolling, for one patch: semi-smooth Newton with Krylov steps.

Unknown is the traction of each cell. In cells that stick the slip s vanishes, in the others the traction
has the size of the bound b and opposes the slip; both are one equation [1]_,
:math:`\tau = P_b(\tau - r s)` with the projection :math:`P_b` on the disc of radius b. The slip follows from
the traction by a convolution. r is one over the largest stiffness the convolution has for any wave: larger
values couple neighbouring cells so much that the steps turn in circles.

Waves along the rolling direction make the convolution all but antisymmetric, on which Krylov methods
converge slowly. What each strip would do alone is therefore taken out first: the Toeplitz matrix of a strip
is split into triangles once, and leading parts of the triangles serve every stretch of stick of every strip:
that halves the convolutions and more.

References
----------
.. [1] P. Alart, A. Curnier, Comput. Methods Appl. Mech. Eng. 92 (1991) 353-375,
   doi:10.1016/0045-7825(91)90022-X.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.influence import (
    ComplexArray,
    back,
    doubled_shape,
    grid_influence,
    tangential_influence,
    transform,
)
from wearsim.contact.kernel import leaf_kernel, plain
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


TOLERANCE = 1e-6  # sum of the residuals of all cells over the sum of their tractions
MOST_STEPS = 40
MOST_PRODUCTS = 80  # convolutions of one linear solution
_STICK, _OUTSIDE = 2.0, -1.0  # marks of cells; between 0 and 1 a cell slips
_LONGEST = 64  # cells of a stretch that are solved together: the work grows with the cells, not faster
_SIDE = 0.28  # what neighbouring strips take from a strip's part; counted out, a fifth of the products less


@dataclass(frozen=True)
class SlipOperator:
    """What tractions in the cells of a grid add to the slip there.

    Parameters
    ----------
    shape : (int, int)
        nx, ny cells; x index from the leading end.
    doubled : (int, int)
        mx, my cells of the grid of the transforms.
    spectrum : (3, mx, my // 2 + 1) complex array
        Transformed kernels: slip along x from traction along x, the same of y, and across [1/Pa].
    strip : (2, k, k) array
        Triangles of the matrix of k cells in a strip on their own, of x and y [1/Pa].
    stiffest : float
        Largest slip per traction of any wave [1/Pa].
    own : float
        Slip per traction of a cell on its own [1/Pa].
    """

    shape: tuple[int, int]
    doubled: tuple[int, int]
    spectrum: ComplexArray
    strip: FloatArray
    stiffest: float
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
        What is left, relative to the sum of tractions [-].
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
    shape: tuple[int, int], cell_length: float, cell_width: float, shear_modulus: float, poisson_ratio: float
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
        Of :math:`(u(x) - u(x + \Delta x)) / \Delta x`: material flows from the leading end downstream.
    """
    nx, ny = shape
    influence = tangential_influence(cell_length, cell_width, (nx + 1, ny), shear_modulus, poisson_ratio)
    kernels = np.stack([np.diff(part[:-1], axis=0) for part in influence]) / cell_length
    spectrum = grid_influence(kernels, shape).spectrum
    longest = np.arange(min(nx, _LONGEST))
    ahead = longest[:, None] - longest + nx - 1
    strip = np.ascontiguousarray(kernels[:2, :, ny - 1][:, ahead])
    _split(strip)
    own = float(0.5 * kernels[:2, nx - 1, ny - 1].sum())
    return SlipOperator(shape, doubled_shape(shape), spectrum, strip, float(np.abs(spectrum[:2]).max()), own)


def elastic_slip(operator: SlipOperator, traction: FloatArray) -> FloatArray:
    """Slip (2, nx, ny) that tractions (2, nx, ny) [Pa] add to the rigid one [-]."""
    wave = transform(traction, operator.doubled)
    _multiply(operator.spectrum, wave)
    return plain(back(wave, operator.shape, operator.doubled))


def solve(
    operator: SlipOperator,
    rigid_slip: FloatArray,
    bound: FloatArray,
    start: FloatArray,
    *,
    most_steps: int = MOST_STEPS,
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

    Returns
    -------
    RollingSolution
        The caller judges its residual: at most `TOLERANCE` unless the steps ran out.
    """
    bound = plain(bound)
    marks, direction = np.empty(operator.shape), np.zeros((2, *operator.shape))
    rest = np.empty((2, *operator.shape))
    reach = 1.0 / operator.stiffest
    traction = np.where(bound > 0.0, start, 0.0)
    _cut_back(traction, bound)
    slip = rigid_slip + elastic_slip(operator, traction)
    products, before, steps = 1, np.inf, 0
    while True:
        error, size = _residual(traction, slip, bound, reach, marks, direction, rest)
        error = error / size if size > 0.0 else 0.0 if error == 0.0 else np.inf
        if error <= TOLERANCE or steps == most_steps or (not error < np.inf and steps > 0):
            break
        # As exact as the outer iteration deserves (Eisenstat and Walker), no more than the last one needs.
        share = 0.2 if not before < np.inf else min(0.2, 0.5 * (error / before) ** 1.6)
        share = max(share, 0.5 * TOLERANCE / error, 1e-4)
        before = error
        change, count = _linear_step(operator, marks, direction, rest, reach, share)
        traction = traction + change
        _cut_back(traction, bound)
        slip = rigid_slip + elastic_slip(operator, traction)
        products += count + 1
        steps += 1
    slipping = (marks >= 0.0) & (marks <= 1.0)
    return RollingSolution(
        traction, np.where(slipping | (bound <= 0.0), slip, 0.0), slipping, float(error), steps, products
    )


def _linear_step(
    operator: SlipOperator,
    marks: FloatArray,
    direction: FloatArray,
    rest: FloatArray,
    reach: float,
    share: float,
) -> tuple[FloatArray, int]:
    """Newton's change of the tractions, exact to a share of the residual; and the convolutions it took."""
    trial, product = np.empty(rest.shape), np.empty(rest.shape)
    line = np.empty(operator.shape[0])
    own = reach * operator.own

    def undone(vector: FloatArray) -> FloatArray:
        given = vector.reshape(rest.shape)
        _precondition(given, marks, direction, operator.strip, reach, own, line, trial)
        return trial

    def derivative(vector: FloatArray) -> FloatArray:
        change = undone(vector)
        _derivative(change, elastic_slip(operator, change), marks, direction, reach, product)
        return product.reshape(-1)

    weights, count = least_residual(derivative, -rest.reshape(-1), share, MOST_PRODUCTS)
    return undone(weights), count


@leaf_kernel
def _multiply(spectrum: ComplexArray, wave: ComplexArray) -> None:
    """Two components by the symmetric two by two matrix of each wave, in place."""
    for i in range(wave.shape[1]):
        for j in range(wave.shape[2]):
            along, across = wave[0, i, j], wave[1, i, j]
            wave[0, i, j] = spectrum[0, i, j] * along + spectrum[2, i, j] * across
            wave[1, i, j] = spectrum[2, i, j] * along + spectrum[1, i, j] * across


@leaf_kernel
def _split(strip: FloatArray) -> None:
    """Triangles of both matrices in place; no pivots: their symmetric part is positive."""
    n = strip.shape[1]
    for c in range(2):
        for k in range(n):
            for i in range(k + 1, n):
                factor = strip[c, i, k] / strip[c, k, k]
                strip[c, i, k] = factor
                for j in range(k + 1, n):
                    strip[c, i, j] -= factor * strip[c, k, j]


@leaf_kernel
def _cut_back(traction: FloatArray, bound: FloatArray) -> None:
    """Shorten tractions above the bound."""
    for i in range(bound.shape[0]):
        for j in range(bound.shape[1]):
            size = np.sqrt(traction[0, i, j] ** 2 + traction[1, i, j] ** 2)
            if size > bound[i, j]:
                traction[0, i, j] *= bound[i, j] / size
                traction[1, i, j] *= bound[i, j] / size


@leaf_kernel
def _residual(
    traction: FloatArray,
    slip: FloatArray,
    bound: FloatArray,
    reach: float,
    marks: FloatArray,
    direction: FloatArray,
    rest: FloatArray,
) -> tuple[float, float]:
    """Residual of each cell, and the sums of the sizes of residuals and tractions.

    `marks` says which cells are outside or stick; for those that slip it is the bound over the size of
    traction - reach x slip, whose direction is kept.
    """
    error, size = 0.0, 0.0
    for i in range(bound.shape[0]):
        for j in range(bound.shape[1]):
            if bound[i, j] <= 0.0:
                marks[i, j] = _OUTSIDE
                rest[0, i, j], rest[1, i, j] = 0.0, 0.0
                continue
            t_x, t_y = traction[0, i, j], traction[1, i, j]
            r_x, r_y = reach * slip[0, i, j], reach * slip[1, i, j]
            length = np.sqrt((t_x - r_x) ** 2 + (t_y - r_y) ** 2)
            if length <= bound[i, j]:
                marks[i, j] = _STICK
            else:
                marks[i, j] = bound[i, j] / length
                d_x, d_y = (t_x - r_x) / length, (t_y - r_y) / length
                direction[0, i, j], direction[1, i, j] = d_x, d_y
                r_x, r_y = t_x - bound[i, j] * d_x, t_y - bound[i, j] * d_y
            rest[0, i, j], rest[1, i, j] = r_x, r_y
            error += np.sqrt(r_x * r_x + r_y * r_y)
            size += np.sqrt(t_x * t_x + t_y * t_y)
    return error, size


@leaf_kernel
def _derivative(
    change: FloatArray,
    slip: FloatArray,
    marks: FloatArray,
    direction: FloatArray,
    reach: float,
    out: FloatArray,
) -> None:
    """Differentiate the residual along a change of tractions that changes the slip by `slip`."""
    for i in range(marks.shape[0]):
        for j in range(marks.shape[1]):
            mark = marks[i, j]
            if mark == _OUTSIDE:
                out[0, i, j], out[1, i, j] = 0.0, 0.0
            elif mark == _STICK:
                out[0, i, j], out[1, i, j] = reach * slip[0, i, j], reach * slip[1, i, j]
            else:
                d_x, d_y = direction[0, i, j], direction[1, i, j]
                v_x, v_y = change[0, i, j] - reach * slip[0, i, j], change[1, i, j] - reach * slip[1, i, j]
                along = d_x * v_x + d_y * v_y
                out[0, i, j] = change[0, i, j] - mark * (v_x - along * d_x)
                out[1, i, j] = change[1, i, j] - mark * (v_y - along * d_y)


@leaf_kernel
def _precondition(
    given: FloatArray,
    marks: FloatArray,
    direction: FloatArray,
    strip: FloatArray,
    reach: float,
    own: float,
    line: FloatArray,
    out: FloatArray,
) -> None:
    """Change of tractions with a given derivative, if stretches of stick and cells that slip were alone."""
    nx, ny = marks.shape
    for i in range(nx):
        for j in range(ny):
            mark = marks[i, j]
            if mark == _OUTSIDE:
                out[0, i, j], out[1, i, j] = 0.0, 0.0
            elif mark != _STICK:
                d_x, d_y = direction[0, i, j], direction[1, i, j]
                along = d_x * given[0, i, j] + d_y * given[1, i, j]
                soft = 1.0 / (1.0 - mark + mark * own)
                out[0, i, j] = along * d_x + soft * (given[0, i, j] - along * d_x)
                out[1, i, j] = along * d_y + soft * (given[1, i, j] - along * d_y)
    for c in range(2):
        for j in range(ny):
            first = 0
            while first < nx:
                if marks[first, j] != _STICK:
                    first += 1
                    continue
                count = 0
                while count < _LONGEST and first + count < nx and marks[first + count, j] == _STICK:
                    i = first + count
                    value = given[c, i, j]
                    if j > 0 and marks[i, j - 1] == _STICK:
                        value -= _SIDE * given[c, i, j - 1]
                    if j + 1 < ny and marks[i, j + 1] == _STICK:
                        value -= _SIDE * given[c, i, j + 1]
                    value /= reach
                    for k in range(count):
                        value -= strip[c, count, k] * line[k]
                    line[count] = value
                    count += 1
                for i in range(count - 1, -1, -1):
                    value = line[i]
                    for k in range(i + 1, count):
                        value -= strip[c, i, k] * line[k]
                    line[i] = value / strip[c, i, i]
                    out[c, first + i, j] = line[i]
                first += count
