r"""Slip that tractions on strips of an elastic half-space cause in steady rolling.

The traction of a strip of half length a is :math:`\tau(t) = \sqrt{1-t^2}\,g(t)`, t from
-1 at the trailing to 1 at the leading end, with a polynomial g that is given by its
values at the n Gauss-Chebyshev points :math:`t_k = \cos\frac{k\pi}{n+1}` [1]_, uniform
over the width of the strip. With X and Y the distances from the loaded point,
:math:`\rho^2 = X^2+Y^2`, the displacements of Cerruti [2]_, differentiated along X and
integrated over Y, hold

.. math:: k_1 = \frac{Y}{X\rho},\quad k_2 = \frac{XY}{\rho^3},\quad k_4 = \frac{Y^2}{\rho^3},\qquad
   f_{i}(\xi,\eta) = \int_{-1}^{1} k_i(\xi-t,\eta)\,\sqrt{1-t^2}\,g(t)\,dt,

all without dimension where lengths are over a. The slip over V at a place :math:`\xi`
of a strip whose edges are :math:`\eta_-` and :math:`\eta_+` off the middle of the
loaded one, with the differences :math:`F = f(\eta_+) - f(\eta_-)` and the tractions
over the shear modulus G, is

.. math:: s_x = \tfrac1\pi\{[(1-\nu)F_1+\nu F_2]\,g_x + \nu F_4\,g_y\},\qquad
   s_y = \tfrac1\pi\{[F_1-\nu F_2]\,g_y + \nu F_4\,g_x\}.

:math:`k_1 = \mathrm{sgn}(Y)\,[1/X - X/(\rho(\rho+|Y|))]`: its first part is that of an
infinitely wide strip, of which :math:`\sqrt{1-t^2}\,U_l` makes
:math:`\pi T_{l+1}(\xi)`, the matrix of strip theory; among different strips it cancels.
The rest is regular and is tabulated over :math:`\xi` and :math:`\eta`.
Beyond the table, far off or for strips that are short against the distance, it is of
degree -1 in both, so that the influence of a strip goes to 0 with its length.

Strips of a wheel stand at their stations along the arc of the profile, with widths of
their own. Between strips whose normals are at an angle, lateral and mixed influences
are those of one plane times its cosine.

References
----------
.. [1] F. Erdogan, G. D. Gupta, Q. Appl. Math. 29 (1972) 525-534,
       doi:10.1090/qam/408277.
.. [2] K. L. Johnson, Contact Mechanics, Cambridge 1985, doi:10.1017/CBO9781139171731,
       section 3.6.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from wearsim.contact.kernel import bare_kernel, inner_bare_kernel, leaf_kernel
from wearsim.contact.patch import FloatArray
from wearsim.contact.tangential.coupled_strips.strips import WheelStrips

# steps of the root of the distance from the end of the strip, up to xi = 6
_PLACES = 144
_STEP = (1.0 + float(np.sqrt(5.0))) / _PLACES
_OCTAVES = -12, 6  # range of log2 eta in the table
_PER_OCTAVE = 4
_ROWS = (_OCTAVES[1] - _OCTAVES[0]) * _PER_OCTAVE + 1
_FARTHEST_XI = 1.0 + (_STEP * _PLACES - 1.0) ** 2
_FARTHEST_ETA = 2.0 ** _OCTAVES[1]
# resolution of the shape over the width: patches stretched in a search share a matrix
_FINEST = 2.0**40


class StripPoints(NamedTuple):
    """Gauss-Chebyshev points along a strip, in half lengths from its middle.

    Parameters
    ----------
    place : (n,) array
        Of the points where tractions are given, from the leading end.
    between : (n + 1,) array
        Where strains are computed: upstream of each point, and behind the last one.
    basis : (n, n) array
        Coefficients of U_l from the values at the points.
    at_stick, at_slip : (n, n + 1) array
        Slip of points that stick, and of those that slip, from the values at `between`.
    alone : (n, n, n, n) array
        Inverse matrices of strip theory, transposed, of stretches of stick: first
        point, points less one.
    """

    place: FloatArray
    between: FloatArray
    basis: FloatArray
    at_stick: FloatArray
    at_slip: FloatArray
    alone: FloatArray


class InfluenceTable(NamedTuple):
    """Tabulated influence of the tractions at n points, over pi, by eta.

    Parameters
    ----------
    coupled : (ne, nx, 3 n) array
        Of a strip on others at places xi >= 0; x by x, y by y, and both by each other.
    own : (ne, n + 1, 3 n) array
        Of a strip of half width eta on itself, where strains are computed.
    """

    coupled: FloatArray
    own: FloatArray


@lru_cache(maxsize=16)
def strip_points(count: int, stick: float = 1.0, slip: float = 1.0) -> StripPoints:
    """Points along a strip.

    Parameters
    ----------
    count : int
        n.
    stick, slip : float
        Where points that stick have no slip, and where those that slip have theirs:
        shares of the angle from the point to the place upstream of it where strains are
        computed.

    Returns
    -------
    StripPoints
    """
    step = np.pi / (count + 1)
    angle, order = step * np.arange(1, count + 1), np.arange(count)
    upstream = step * (np.arange(count + 1) + 0.5)
    basis = 2.0 / (count + 1) * np.sin(angle) * np.sin(np.outer(order + 1, angle))
    powers = np.arange(count + 1)
    of_values = np.linalg.inv(np.cos(np.outer(upstream, powers)))
    places = [angle - 0.5 * step * share for share in (stick, slip)]
    at_stick, at_slip = (np.cos(np.outer(at, powers)) @ of_values for at in places)
    strain = np.cos(np.outer(places[0], order + 1)) @ basis
    alone = np.zeros((count,) * 4)
    for first in range(count):
        for size in range(1, count - first + 1):
            part = slice(first, first + size)
            alone[first, size - 1, :size, :size] = np.linalg.inv(strain[part, part]).T
    return StripPoints(np.cos(angle), np.cos(upstream), basis, at_stick, at_slip, alone)


@lru_cache(maxsize=16)
def influence_table(count: int, poisson_ratio: float) -> InfluenceTable:
    """Table of the influence between strips.

    Parameters
    ----------
    count : int
        Points along a strip.
    poisson_ratio : float
        Of both bodies [-].

    Returns
    -------
    InfluenceTable
    """
    points = strip_points(count)
    root = -1.0 + _STEP * np.arange(_PLACES + 1)
    eta = 2.0 ** (_OCTAVES[0] + np.arange(_ROWS) / _PER_OCTAVE)
    coupled = np.zeros((_ROWS, _PLACES + 1, 3 * count))
    on_itself = np.zeros((_ROWS, count + 1, 3 * count))
    for place, table in (
        (1.0 + np.sign(root) * root**2, coupled),
        (points.between, on_itself),
    ):
        _integrate(place, eta, poisson_ratio, table)
        table[:] = (table.reshape(-1, count) @ points.basis).reshape(table.shape)
    infinite = (
        np.cos(np.outer(np.arccos(points.between), np.arange(1, count + 1)))
        @ points.basis
    )
    on_itself[:, :, :count] += (1.0 - poisson_ratio) * infinite
    on_itself[:, :, count : 2 * count] += infinite
    # Both edges of a strip have the same distance from its middle: odd influences add
    # up, the mixed one cancels.
    on_itself *= 2.0
    on_itself[:, :, 2 * count :] = 0.0
    return InfluenceTable(coupled, on_itself)


@leaf_kernel
def _integrate(
    place: FloatArray, eta: FloatArray, poisson_ratio: float, table: FloatArray
) -> None:
    """Add the regular part (ne, nx, 3 n) of the influence of sqrt(1 - t^2) U_l / pi.

    It is integrated in the angle of t, from the position to either end of the strip, by
    the double exponential rule, whose points concentrate at the position, where the
    integrand is as sharp as eta is small.
    """
    count = table.shape[2] // 3
    shape = np.empty(count)
    for i in range(place.size):
        at = np.arccos(min(max(place[i], -1.0), 1.0))
        beyond = place[i] - np.cos(at)
        for side in range(2):
            length = -at if side == 0 else np.pi - at
            for q in range(-48, 49):
                growth = np.exp(-np.pi * np.sinh(0.08 * q))
                share = 1.0 / (1.0 + growth)
                rate = (
                    abs(length)
                    * 0.08
                    * np.pi
                    * np.cosh(0.08 * q)
                    * growth
                    * share
                    * share
                )
                off = length * share
                sine = np.sin(at + off)
                for l in range(count):
                    shape[l] = np.sin((l + 1) * (at + off)) * sine * rate / np.pi
                x = beyond + 2.0 * np.sin(at + 0.5 * off) * np.sin(0.5 * off)
                for e in range(eta.size):
                    y = eta[e]
                    square = x * x + y * y
                    far = np.sqrt(square)
                    first, second = -x / (far * (far + y)), x * y / (far * square)
                    along = (1.0 - poisson_ratio) * first + poisson_ratio * second
                    across = first - poisson_ratio * second
                    mixed = poisson_ratio * y * y / (far * square)
                    for l in range(count):
                        table[e, i, l] += along * shape[l]
                        table[e, i, count + l] += across * shape[l]
                        table[e, i, 2 * count + l] += mixed * shape[l]


class StripShape(NamedTuple):
    """Shape of the strips of a wheel over their largest width; each (N,).

    Parameters
    ----------
    station, width, half, along : (N,) array
        Position across, width, half-length, and longitudinal position of the middle.
    angle : (N,) array
        Angle from the first strip's plane [rad].
    """

    station: FloatArray
    width: FloatArray
    half: FloatArray
    along: FloatArray
    angle: FloatArray


def slip_influence(
    strips: WheelStrips, count: int, poisson_ratio: float
) -> list[FloatArray]:
    """Matrices of the slip that tractions on the strips of wheels cause.

    Parameters
    ----------
    strips : WheelStrips
        Strips of w wheels.
    count : int
        n, points along a strip.
    poisson_ratio : float
        Of both bodies [-].

    Returns
    -------
    list of (N n, 3, N (n + 1)) arrays
        Slip of each point's traction over G: along x by that along x, the same across,
        and of either by the other; at the places of strains, those of a strip together.
        Read only.
    """
    if strips.width.size == 0:
        return []
    first, end = strips.begin[:-1], strips.begin[1:]
    of_wheel = np.repeat(np.arange(first.size), end - first)
    origin, largest = (
        first[of_wheel],
        np.maximum.reduceat(strips.width, first)[of_wheel],
    )
    shape = np.empty((strips.width.size, len(StripShape._fields)))
    np.divide(strips.station - strips.station[origin], largest, out=shape[:, 0])
    np.divide(strips.width, largest, out=shape[:, 1])
    np.divide(strips.half, largest, out=shape[:, 2])
    np.divide(strips.along - strips.along[origin], largest, out=shape[:, 3])
    np.subtract(strips.angle, strips.angle[origin], out=shape[:, 4])
    shape = np.rint(shape * _FINEST)
    return [
        _of_shape(shape[start:to].tobytes(), count, poisson_ratio)
        for start, to in pairwise(strips.begin.tolist())
    ]


@lru_cache(maxsize=128)
def _of_shape(shape: bytes, count: int, poisson_ratio: float) -> FloatArray:
    """Matrix of strips of a shape (N, 5), in bytes."""
    strips = StripShape(
        *np.ascontiguousarray(np.frombuffer(shape).reshape(-1, 5).T / _FINEST)
    )
    points, table = strip_points(count), influence_table(count, poisson_ratio)
    matrix = np.empty((strips.half.size * count, 3, strips.half.size * (count + 1)))
    _fill(
        table.coupled,
        table.own,
        points.between,
        strips,
        np.empty((count + 1, 3 * count)),
        matrix,
    )
    return matrix


@inner_bare_kernel
def _row_of(eta: float) -> tuple[int, float]:
    """Row of the table below eta, and the share of the next one."""
    place = min(max((np.log2(eta) - _OCTAVES[0]) * _PER_OCTAVE, 0.0), _ROWS - 1.0)
    row = min(int(place), _ROWS - 2)
    share = (eta / 2.0 ** (_OCTAVES[0] + row / _PER_OCTAVE) - 1.0) / (
        2.0 ** (1.0 / _PER_OCTAVE) - 1.0
    )
    return row, min(max(share, 0.0), 1.0)


@bare_kernel
def _fill(
    coupled: FloatArray,
    on_itself: FloatArray,
    between: FloatArray,
    strips: StripShape,
    block: FloatArray,
    matrix: FloatArray,
) -> None:
    """Fill the matrix (N n, 3, N (n + 1)) of the strips of a wheel, block by block."""
    n, count = between.size - 1, strips.half.size
    for j in range(count):
        half = strips.half[j]
        row, share = _row_of(0.5 * strips.width[j] / half)
        for r in range(n + 1):
            for c in range(3 * n):
                block[r, c] = on_itself[row, r, c] + share * (
                    on_itself[row + 1, r, c] - on_itself[row, r, c]
                )
        _place(block, j, j, 1.0, 1.0, matrix)
        for i in range(count):
            if i == j:
                continue
            off = strips.station[i] - strips.station[j]
            near = max(abs(off) - 0.5 * strips.width[j], 0.0) / half
            far = (abs(off) + 0.5 * strips.width[j]) / half
            near_row, of_near = _row_of(near)
            far_row, of_far = _row_of(far)
            for r in range(n + 1):
                xi = (
                    strips.along[i] + strips.half[i] * between[r] - strips.along[j]
                ) / half
                if abs(xi) <= _FARTHEST_XI and far <= _FARTHEST_ETA:
                    _between_rows(
                        coupled, near_row, of_near, far_row, of_far, xi, block[r]
                    )
                else:
                    _from_afar(coupled, near, far, xi, block[r])
            turned = np.cos(strips.angle[i] - strips.angle[j])
            _place(block, i, j, turned, turned if off > 0.0 else -turned, matrix)


@inner_bare_kernel
def _from_afar(
    table: FloatArray, near: float, far: float, xi: float, out: FloatArray
) -> None:
    """Fill the influence (3 n,) beyond the table, of degree -1 in the distance."""
    nearer = min(_FARTHEST_XI / abs(xi), 1.0) if xi != 0.0 else 1.0
    nearer = min(nearer, _FARTHEST_ETA / far)
    near_row, of_near = _row_of(nearer * near)
    far_row, of_far = _row_of(nearer * far)
    _between_rows(table, near_row, of_near, far_row, of_far, nearer * xi, out)
    for m in range(out.size):
        out[m] *= nearer


@inner_bare_kernel
def _between_rows(
    table: FloatArray,
    near: int,
    of_near: float,
    far: int,
    of_far: float,
    xi: float,
    out: FloatArray,
) -> None:
    """Fill the influence (3 n,) at xi between two edges.

    It is linear in eta and in the root of the distance.
    """
    off = abs(xi) - 1.0
    place = min(
        ((np.sqrt(off) if off > 0.0 else -np.sqrt(-off)) + 1.0) / _STEP, float(_PLACES)
    )
    k = min(int(place), _PLACES - 1)
    share = place - k
    far_0, far_1, near_0, near_1 = 1.0 - of_far, of_far, 1.0 - of_near, of_near
    a, b, c, d = (
        table[far, k],
        table[far, k + 1],
        table[far + 1, k],
        table[far + 1, k + 1],
    )
    e, f, g, h = (
        table[near, k],
        table[near, k + 1],
        table[near + 1, k],
        table[near + 1, k + 1],
    )
    for m in range(out.size):
        left, right = far_0 * a[m] + far_1 * c[m], far_0 * b[m] + far_1 * d[m]
        out[m] = left + share * (right - left)
    for m in range(out.size):
        left, right = near_0 * e[m] + near_1 * g[m], near_0 * f[m] + near_1 * h[m]
        out[m] -= left + share * (right - left)
    if xi < 0.0:
        # Mirrored along x: the points are reversed, and odd influences change sign.
        n = out.size // 3
        for m in range(3):
            sign = 1.0 if m == 2 else -1.0
            for k in range((n + 1) // 2):
                first, last = m * n + k, m * n + n - 1 - k
                out[first], out[last] = sign * out[last], sign * out[first]


@inner_bare_kernel
def _place(
    block: FloatArray, i: int, j: int, across: float, mixed: float, matrix: FloatArray
) -> None:
    """Put the influence (n + 1, 3 n) of strip j on strip i into the matrix.

    Its lateral parts are multiplied by factors.
    """
    rows, n = block.shape[0], block.shape[1] // 3
    for k in range(n):
        for r in range(rows):
            matrix[j * n + k, 0, i * rows + r] = block[r, k]
            matrix[j * n + k, 1, i * rows + r] = across * block[r, n + k]
            matrix[j * n + k, 2, i * rows + r] = mixed * block[r, 2 * n + k]
