r"""Coulomb friction on the strips of one wheel in steady rolling, by Newton's method.

It is semi-smooth with Krylov steps.

Unknown is the traction g at the n points of each strip, over the root of an ellipse:
there Coulomb's bound is one number b per strip. A point that sticks has no slip where
strains are computed upstream of it, which leaves the trailing end free to be singular
and keeps the leading one bounded, as particles enter the contact unstrained. A point
that slips has g of the size b against the slip near the point itself. Both are the
equation of `tangential.semismooth_newton`. Linear steps are preconditioned by strip
theory: each stretch of stick of each strip as if it were alone [1]_.

Slip at unlike places for stick and slip would let forces jump where a point begins to
slip. There the place moves: a point slips by the slip that made it slip, and by that
near it the more, the larger the one is over the growth from one to the other. Under
large spin on narrow patches there still need not be a solution; with one place for both
there is one, which is less accurate at small creepage.

Tractions are over the shear modulus.

References
----------
.. [1] J. J. Kalker, On the rolling contact of two elastic bodies in the presence of dry
   friction, thesis, Delft 1967 (strip theory).
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.kernel import bare_kernel, inner_bare_kernel, inner_kernel, kernel
from wearsim.contact.patch import FloatArray
from wearsim.contact.tangential.coupled_strips.influence import StripPoints
from wearsim.contact.tangential.coupled_strips.strips import WheelStrips
from wearsim.contact.tangential.semismooth_newton import (
    OUTSIDE,
    STICK,
    combine,
    cut_back,
    derivative,
    exactness,
    orthogonalise,
)

MOST_PRODUCTS = 40  # largest number of matrix products of one linear step
_REACH = 0.1  # r of the projection, over the shear modulus
_SOFT = 0.1  # slip of a slipping point per own traction, times r
_GUESS = 1.0  # strip theory has 0.5; patches are narrow and less stiff
# Number of Newton steps that are taken in full; later ones are halved unless the
# residual falls.
_FREE = 4
_FALLS = 0.3
# Ratio of the slip at the position of stick to its growth up to that of slip, above
# which only the latter counts.
_GROWTH = 0.25


@kernel
def roll(
    matrix: FloatArray,
    points: StripPoints,
    poisson_ratio: float,
    rigid_slip: FloatArray,
    bound: FloatArray,
    tolerance: float,
    most_steps: int,
    traction: FloatArray,
    slip: FloatArray,
    marks: FloatArray,
) -> tuple[float, int, int]:
    """Solve for tractions and slip of the strips of a wheel in steady rolling.

    Parameters
    ----------
    matrix : (N n, 3, N (n + 1)) array
        From `influence.slip_influence`.
    points : StripPoints
        Of each strip.
    poisson_ratio : float
        Of both bodies [-].
    rigid_slip : (2, N, n + 1) array
        Slip without deformation where strains are computed [-].
    bound : (N,) array
        Friction coefficient times the root's factor of the pressure, over the shear
        modulus [-].
    tolerance : float
        Sum of the residuals over that of tractions at which the iteration stops.
    most_steps : int
        Newton steps at most.
    traction : (2, N, n) array
        First guess, replaced by the solution [-].
    slip, marks : (2, N, n + 1), (N, n) arrays
        Filled with the slip over V where strains are computed [-], and how points are
        marked.

    Returns
    -------
    float, int, int
        Residual, the caller judges it; Newton steps and products of the matrix that
        were needed.
    """
    shape, size = traction.shape, traction.size
    direction, rest, change = np.zeros(shape), np.empty(shape), np.empty(shape)
    seen, bounds, basis = (
        np.empty((2, *shape)),
        np.empty(marks.shape),
        np.empty((MOST_PRODUCTS + 1, size)),
    )
    slides = np.zeros(marks.shape)
    flat, best, step = traction.reshape(size), np.zeros(size), change.reshape(size)
    for i in range(shape[1]):
        for k in range(shape[2]):
            bounds[i, k] = bound[i]
    before, least, steps, products, back = np.inf, np.inf, 0, 0, False
    while True:
        error = _state(
            matrix,
            points,
            rigid_slip,
            bounds,
            traction,
            slip,
            seen,
            marks,
            slides,
            direction,
            rest,
        )
        products += 1
        if error <= tolerance or back:
            return error, steps, products
        if error < least:
            least = error
            for i in range(size):
                best[i] = flat[i]
        back = steps == most_steps or (not error < np.inf and steps > 0)
        if back:
            for i in range(size):
                flat[i] = best[i]
            continue
        share = exactness(error, before, tolerance)
        products += _linear_step(
            matrix,
            points,
            poisson_ratio,
            marks,
            slides,
            direction,
            rest,
            share,
            basis,
            change,
        )
        part = 0.5 if steps >= _FREE and error > _FALLS * before else 1.0
        before = error
        for i in range(size):
            flat[i] += part * step[i]
        steps += 1


@bare_kernel
def prepare(
    points: StripPoints,
    poisson_ratio: float,
    strips: WheelStrips,
    rigid_slip: FloatArray,
    traction: FloatArray,
) -> None:
    """Fill the rigid slip of the strips of wheels and their first tractions.

    Both are flat arrays, (2, N, n + 1) and (2, N, n) of one wheel after the other. The
    tractions are those of sticking strips by strip theory for twice the creepage, which
    is the stiffness of infinitely wide strips; those of patches are less stiff.
    """
    n = points.place.size
    for w in range(strips.begin.size - 1):
        first, last = strips.begin[w], strips.begin[w + 1]
        rigid = rigid_slip[2 * first * (n + 1) : 2 * last * (n + 1)].reshape(
            2, last - first, n + 1
        )
        guess = traction[2 * first * n : 2 * last * n].reshape(2, last - first, n)
        for i in range(last - first):
            along, across, spin = strips.creepage[first + i]
            half, middle = strips.half[first + i], strips.middle[first + i]
            for r in range(n + 1):
                rigid[0, i, r] = along
                rigid[1, i, r] = across + spin * (middle + half * points.between[r])
            for k in range(n):
                factor = -_GUESS / (1.0 + points.place[k])
                lateral_slip = across + spin * (middle + half * points.place[k])
                guess[0, i, k], guess[1, i, k] = (
                    factor / (1.0 - poisson_ratio) * along,
                    factor * lateral_slip,
                )


@bare_kernel
def add_up(
    points: StripPoints,
    strips: WheelStrips,
    shear_modulus: float,
    traction: FloatArray,
    out: FloatArray,
) -> None:
    """Fill longitudinal and lateral forces of strips and moments (m, N, 3) [N, N, N m].

    Moments are about the strip middle at the patch's centre. `traction` is that of
    `prepare`; sums are exact for the polynomials.
    """
    n = points.place.size
    for w in range(strips.begin.size - 1):
        first, last = strips.begin[w], strips.begin[w + 1]
        solved = traction[2 * first * n : 2 * last * n].reshape(2, last - first, n)
        for i in range(last - first):
            s = first + i
            along, across, moment = 0.0, 0.0, 0.0
            for k in range(n):
                place = points.place[k]
                weight = 1.0 - place * place
                along += weight * solved[0, i, k]
                across += weight * solved[1, i, k]
                moment += (
                    weight
                    * solved[1, i, k]
                    * (strips.middle[s] + strips.half[s] * place)
                )
            whole = shear_modulus * strips.width[s] * strips.half[s] * np.pi / (n + 1)
            force = out[strips.patch[s], strips.number[s]]
            force[0], force[1], force[2] = whole * along, whole * across, whole * moment


@inner_bare_kernel
def _state(
    matrix: FloatArray,
    points: StripPoints,
    rigid_slip: FloatArray,
    bound: FloatArray,
    traction: FloatArray,
    slip: FloatArray,
    seen: FloatArray,
    marks: FloatArray,
    slides: FloatArray,
    direction: FloatArray,
    rest: FloatArray,
) -> float:
    """Fill slip, marks, directions and residuals of tractions limited to the bound.

    Return the relative residual.
    """
    cut_back(traction, bound)
    for c in range(2):
        for i in range(slip.shape[1]):
            for r in range(slip.shape[2]):
                slip[c, i, r] = rigid_slip[c, i, r]
    _add_slip(matrix, traction, slip)
    _at_places(slip, points.at_stick, seen[0])
    _at_places(slip, points.at_slip, seen[1])
    error, size = _residual(
        traction, seen[0], seen[1], bound, marks, slides, direction, rest
    )
    if size > 0.0:
        return float(error / size)
    return 0.0 if error == 0.0 else np.inf


@inner_bare_kernel
def _add_slip(matrix: FloatArray, traction: FloatArray, slip: FloatArray) -> None:
    """Add the slip (2, N, n + 1) of tractions (2, N, n).

    Four points at once, so that slip is loaded and stored less; in vectors of places,
    so that sums keep their order.
    """
    columns, rows = matrix.shape[0], matrix.shape[2]
    x, y = slip[0].reshape(rows), slip[1].reshape(rows)
    t_x, t_y = traction[0].reshape(columns), traction[1].reshape(columns)
    for k in range(0, columns, 4):
        x_0, x_1, x_2, x_3 = (
            matrix[k, 0],
            matrix[k + 1, 0],
            matrix[k + 2, 0],
            matrix[k + 3, 0],
        )
        y_0, y_1, y_2, y_3 = (
            matrix[k, 1],
            matrix[k + 1, 1],
            matrix[k + 2, 1],
            matrix[k + 3, 1],
        )
        m_0, m_1, m_2, m_3 = (
            matrix[k, 2],
            matrix[k + 1, 2],
            matrix[k + 2, 2],
            matrix[k + 3, 2],
        )
        a_0, a_1, a_2, a_3 = t_x[k], t_x[k + 1], t_x[k + 2], t_x[k + 3]
        b_0, b_1, b_2, b_3 = t_y[k], t_y[k + 1], t_y[k + 2], t_y[k + 3]
        for r in range(rows):
            alike = (x_0[r] * a_0 + x_1[r] * a_1) + (x_2[r] * a_2 + x_3[r] * a_3)
            x[r] += alike + (
                (m_0[r] * b_0 + m_1[r] * b_1) + (m_2[r] * b_2 + m_3[r] * b_3)
            )
        for r in range(rows):
            alike = (y_0[r] * b_0 + y_1[r] * b_1) + (y_2[r] * b_2 + y_3[r] * b_3)
            y[r] += alike + (
                (m_0[r] * a_0 + m_1[r] * a_1) + (m_2[r] * a_2 + m_3[r] * a_3)
            )


@inner_bare_kernel
def _at_places(slip: FloatArray, places: FloatArray, out: FloatArray) -> None:
    """Fill the slip (2, N, n) at one place per point; `places` (n, n + 1)."""
    for i in range(out.shape[1]):
        for k in range(out.shape[2]):
            out[0, i, k], out[1, i, k] = _at_place(slip, i, places[k])


@inner_bare_kernel
def _at_places_of_marks(
    slip: FloatArray, slides: FloatArray, points: StripPoints, out: FloatArray
) -> None:
    """Fill the slip (2, N, n) of points at its position of evaluation.

    The position moves from that of stick to that of slip.
    """
    for i in range(out.shape[1]):
        for k in range(out.shape[2]):
            share = slides[i, k]
            x = y = near_x = near_y = 0.0
            if share < 1.0:
                x, y = _at_place(slip, i, points.at_stick[k])
            if share > 0.0:
                near_x, near_y = _at_place(slip, i, points.at_slip[k])
            out[0, i, k] = x + share * (near_x - x)
            out[1, i, k] = y + share * (near_y - y)


@inner_bare_kernel
def _at_place(slip: FloatArray, i: int, place: FloatArray) -> tuple[float, float]:
    """Slip at a place (n + 1,) of strip i."""
    x, y = 0.0, 0.0
    for r in range(place.size):
        x += place[r] * slip[0, i, r]
        y += place[r] * slip[1, i, r]
    return x, y


@inner_bare_kernel
def _residual(
    traction: FloatArray,
    ahead: FloatArray,
    near: FloatArray,
    bound: FloatArray,
    marks: FloatArray,
    slides: FloatArray,
    direction: FloatArray,
    rest: FloatArray,
) -> tuple[float, float]:
    """Mark points by the slip `ahead` of or `near` them.

    Return the sums of the magnitudes of residuals and tractions.
    """
    error, size = 0.0, 0.0
    for i in range(bound.shape[0]):
        for k in range(bound.shape[1]):
            rest[0, i, k], rest[1, i, k] = 0.0, 0.0
            if bound[i, k] <= 0.0:
                marks[i, k] = OUTSIDE
                continue
            t_x, t_y = traction[0, i, k], traction[1, i, k]
            r_x, r_y = _REACH * ahead[0, i, k], _REACH * ahead[1, i, k]
            marks[i, k], slides[i, k] = STICK, 0.0
            if (t_x - r_x) ** 2 + (t_y - r_y) ** 2 > bound[i, k] ** 2:
                # A point starts to slip with the slip that caused it: forces are
                # continuous.
                a_x, a_y = ahead[0, i, k], ahead[1, i, k]
                n_x, n_y = near[0, i, k] - a_x, near[1, i, k] - a_y
                square_ahead, apart = a_x * a_x + a_y * a_y, n_x * n_x + n_y * n_y
                lean = (
                    np.sqrt(square_ahead / apart) / _GROWTH
                    if square_ahead < apart * _GROWTH * _GROWTH
                    else 1.0
                )
                slides[i, k] = lean
                v_x = t_x - _REACH * (a_x + lean * n_x)
                v_y = t_y - _REACH * (a_y + lean * n_y)
                length = np.sqrt(v_x * v_x + v_y * v_y)
                d_x, d_y = (v_x / length, v_y / length) if length > 0.0 else (1.0, 0.0)
                # Beside stick the slip near the point may be less than the slip that
                # marks it.
                marks[i, k] = bound[i, k] / length if length > bound[i, k] else 1.0
                direction[0, i, k], direction[1, i, k] = d_x, d_y
                r_x, r_y = t_x - bound[i, k] * d_x, t_y - bound[i, k] * d_y
            rest[0, i, k], rest[1, i, k] = r_x, r_y
            error += np.sqrt(r_x * r_x + r_y * r_y)
            size += np.sqrt(t_x * t_x + t_y * t_y)
    return error, size


@inner_kernel
def _linear_step(
    matrix: FloatArray,
    points: StripPoints,
    poisson_ratio: float,
    marks: FloatArray,
    slides: FloatArray,
    direction: FloatArray,
    rest: FloatArray,
    share: float,
    basis: FloatArray,
    change: FloatArray,
) -> int:
    """Newton's change of the tractions, accurate to a share of the residual.

    Return the number of matrix products. The method is GMRES (generalised minimal
    residuals), preconditioned on the right.
    """
    most, size, shape = basis.shape[0] - 1, rest.size, rest.shape
    triangle, weight = np.zeros((most, most)), np.empty(most)
    cosine, sine, left = np.empty(most), np.empty(most), np.empty(most + 1)
    slip, seen = np.empty((2, shape[1], shape[2] + 1)), np.empty(shape)
    flat, none, whole = rest.reshape(size), slip.reshape(slip.size), 0.0
    for i in range(size):
        whole += flat[i] * flat[i]
    left[0] = whole = np.sqrt(whole)
    for i in range(size):
        basis[0, i] = -flat[i] / whole
    count = 0
    while count < most and abs(left[count]) > share * whole:
        _precondition(
            basis[count].reshape(shape),
            marks,
            direction,
            points.alone,
            poisson_ratio,
            change,
        )
        for i in range(slip.size):
            none[i] = 0.0
        _add_slip(matrix, change, slip)
        _at_places_of_marks(slip, slides, points, seen)
        derivative(
            change, seen, marks, direction, _REACH, basis[count + 1].reshape(shape)
        )
        orthogonalise(basis, count, triangle, cosine, sine, left)
        count += 1
    combine(basis, count, triangle, left, weight, seen.reshape(size))
    _precondition(seen, marks, direction, points.alone, poisson_ratio, change)
    return count


@inner_bare_kernel
def _precondition(
    given: FloatArray,
    marks: FloatArray,
    direction: FloatArray,
    alone: FloatArray,
    poisson_ratio: float,
    out: FloatArray,
) -> None:
    """Change of tractions with a given derivative, for uncoupled stick zones.

    Stretches of stick and points that slip are treated separately.
    """
    count = marks.shape[1]
    stiff_y = 0.5 / _REACH
    stiff_x = stiff_y / (1.0 - poisson_ratio)
    for i in range(marks.shape[0]):
        k = 0
        while k < count:
            mark, first = marks[i, k], k
            if mark == STICK:
                while k < count and marks[i, k] == STICK:
                    k += 1
                inverse = alone[first, k - first - 1]
                for c in range(2):
                    line, stiff = out[c, i, first:k], stiff_x if c == 0 else stiff_y
                    for m in range(k - first):
                        line[m] = 0.0
                    for l in range(k - first):
                        value = stiff * given[c, i, first + l]
                        for m in range(k - first):
                            line[m] += inverse[l, m] * value
                continue
            out[0, i, k], out[1, i, k] = 0.0, 0.0
            if mark != OUTSIDE:
                d_x, d_y = direction[0, i, k], direction[1, i, k]
                along = d_x * given[0, i, k] + d_y * given[1, i, k]
                soft = 1.0 / (1.0 - mark + mark * _SOFT)
                out[0, i, k] = along * d_x + soft * (given[0, i, k] - along * d_x)
                out[1, i, k] = along * d_y + soft * (given[1, i, k] - along * d_y)
            k += 1
