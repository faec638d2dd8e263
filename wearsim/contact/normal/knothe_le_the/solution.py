"""Kernels of the strip model: linear systems, and the solution of its equations for given strips.

Equations and sources: see `knothe_le_the`.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.kernel import kernel
from wearsim.contact.normal.knothe_le_the.equations import (
    FARTHER,
    NEARER,
    SHARE,
    in_the_middle,
    influences,
    inner_of,
    residuals,
)
from wearsim.contact.normal.knothe_le_the.strips import (
    COSINE,
    GAP,
    LOAD,
    RADIUS,
    SIGMA,
    SQUARE,
    TURN,
    WIDTH,
    bow_of,
)
from wearsim.contact.patch import FloatArray, IntArray

_SMALL = 1e-13  # of a pivot, over its row's largest number before


@kernel
def factorise(matrix: FloatArray, n: int) -> bool:
    """Factorise in place into L and U, rows taking from those above four at a time; returns whether it went.

    Without pivoting: the strips' equations begin with a block of influences, and the rest follows from it.
    The reciprocals of U's diagonal are kept.
    """
    for i in range(n):
        line = matrix[i]
        size = 0.0
        for j in range(n):
            size = max(size, abs(line[j]))
        k = 0
        while k + 4 <= i:
            one, two, three, four = matrix[k], matrix[k + 1], matrix[k + 2], matrix[k + 3]
            a = line[k] * one[k]
            b = (line[k + 1] - a * one[k + 1]) * two[k + 1]
            c = (line[k + 2] - a * one[k + 2] - b * two[k + 2]) * three[k + 2]
            d = (line[k + 3] - a * one[k + 3] - b * two[k + 3] - c * three[k + 3]) * four[k + 3]
            line[k], line[k + 1], line[k + 2], line[k + 3] = a, b, c, d
            k += 4
            rest = line[k:n]
            first, second, third, fourth = one[k:n], two[k:n], three[k:n], four[k:n]
            for j in range(rest.size):  # of slices, from 0: only so are vector instructions used
                rest[j] = rest[j] - a * first[j] - b * second[j] - c * third[j] - d * fourth[j]
        while k < i:
            a = line[k] * matrix[k, k]
            line[k] = a
            rest, first = line[k + 1 : n], matrix[k, k + 1 : n]
            for j in range(rest.size):
                rest[j] -= a * first[j]
            k += 1
        if not abs(line[i]) > _SMALL * size:
            return False
        line[i] = 1.0 / line[i]
    return True


@kernel
def less_products(start: float, line: FloatArray, right: FloatArray, first: int, last: int) -> float:
    """Take the products of two rows from `first` up to `last` off a number, in four sums side by side."""
    a, b, c, d = start, 0.0, 0.0, 0.0
    k = first
    while k + 4 <= last:
        a -= line[k] * right[k]
        b -= line[k + 1] * right[k + 1]
        c -= line[k + 2] * right[k + 2]
        d -= line[k + 3] * right[k + 3]
        k += 4
    while k < last:
        a -= line[k] * right[k]
        k += 1
    rest: float = (a + b) + (c + d)
    return rest


@kernel
def substitute(matrix: FloatArray, right: FloatArray, n: int) -> None:
    """Solve in place with what `factorise` made."""
    for i in range(1, n):
        right[i] = less_products(right[i], matrix[i], right, 0, i)
    for i in range(n - 1, -1, -1):
        right[i] = less_products(right[i], matrix[i], right, i + 1, n) * matrix[i, i]


_SWEEPS = 40  # of lengths and pressures in turn, at most
_STEPS = 60  # of Newton's method, at most
_OVERLAP = 1e-3  # of the displacement, of a strip that stays without pressure
_GOOD = 0.4  # of the last step's change, up to which a Jacobian is kept


@kernel
def relax(
    strips: FloatArray, lobe: IntArray, total: int, displacement: float, load: float, vertical: bool,
    table: FloatArray, tolerance: float, active: IntArray, pairs: FloatArray, near: FloatArray,
    far: FloatArray, matrix: FloatArray, right: FloatArray,
) -> tuple[float, int, bool]:  # fmt: skip
    """Pressures that never pull on strips of given lengths, and lengths from them, in turn."""
    bow = np.empty(total)
    for sweep in range(_SWEEPS):
        influences(strips, total, table, pairs, near, far)
        for i in range(total):
            bow[i] = bow_of(0.25 * strips[SQUARE, i], strips[RADIUS, i], strips[SIGMA, i])
        done = False
        for turn in range(40):
            m = 0
            for j in range(total):
                if strips[LOAD, j] > 0.0:
                    active[m] = j
                    m += 1
            if m == 0:
                return displacement, sweep, False
            for row in range(m):
                i = active[row]
                for column in range(m):
                    matrix[row, column] = near[i, active[column]]
                matrix[row, m] = -strips[TURN, i]
                right[row] = -strips[GAP, i] - bow[i]
                matrix[m, row] = 0.5 * np.pi * strips[WIDTH, i] * (strips[COSINE, i] if vertical else 1.0)
            matrix[m, m] = 0.0
            right[m] = load
            if not factorise(matrix, m + 1):
                return displacement, sweep, False
            substitute(matrix, right, m + 1)
            displacement = right[m]
            # All that pull leave at once, then all that overlap enter; one by one should that go in circles.
            changed = False
            worst, worst_row = 0.0, -1
            for row in range(m):
                strips[LOAD, active[row]] = right[row]
                if right[row] <= 0.0:
                    changed = True
                    if turn < 8:
                        strips[LOAD, active[row]] = 0.0
                    elif right[row] <= worst:
                        worst, worst_row = right[row], row
            if changed:
                if turn >= 8:
                    for row in range(m):
                        strips[LOAD, active[row]] = max(right[row], 1e-12)
                    strips[LOAD, active[worst_row]] = 0.0
                continue
            worst, worst_row = -1e-9 * displacement, -1
            for i in range(total):
                if strips[LOAD, i] > 0.0:
                    continue
                lifted = strips[GAP, i] + bow[i] - displacement * strips[TURN, i]
                for row in range(m):
                    lifted += near[i, active[row]] * strips[LOAD, active[row]]
                if lifted < -1e-9 * displacement and turn < 4:
                    strips[LOAD, i] = 1e-12
                    changed = True
                if lifted < worst:
                    worst, worst_row = lifted, i
            if turn >= 4 and worst_row >= 0:
                strips[LOAD, worst_row] = 1e-12
                changed = True
            if not changed:
                done = True
                break
        if not done:
            return displacement, sweep, False
        change = 0.0
        most = 0.0
        for row in range(m):
            most = max(most, strips[SQUARE, active[row]])
        for row in range(m):
            i = active[row]
            fall = 0.0
            for column in range(m):
                fall += (near[i, active[column]] - far[i, active[column]]) * strips[LOAD, active[column]]
            q = max(4.0 * fall / (1.0 / strips[RADIUS, i] + strips[SIGMA, i]), 0.0)
            bow[i] = q
        for row in range(m):
            i = active[row]
            inner = inner_of(active, lobe, m, row)
            q = bow[i]
            if inner >= 0:
                j = active[inner]
                q = min(bow[j] * strips[LOAD, i] / strips[LOAD, j], bow[j])
            old = strips[SQUARE, i]
            change = max(change, abs(q - old) / most)
            strips[SQUARE, i] = min(max(q, 0.1 * old), 10.0 * old)
        # Lengths of strips without pressure, should they get some.
        for i in range(total):
            if strips[LOAD, i] <= 0.0:
                lifted = strips[GAP, i] - displacement * strips[TURN, i]
                nearest, distance = 0, 1e9
                for row in range(m):
                    lifted += near[i, active[row]] * strips[LOAD, active[row]]
                    if pairs[FARTHER, i, active[row]] < distance:
                        nearest, distance = active[row], pairs[FARTHER, i, active[row]]
                q = -4.0 * lifted / (1.0 / strips[RADIUS, i] + strips[SIGMA, i])
                strips[SQUARE, i] = min(max(q, 0.001 * strips[SQUARE, nearest]), strips[SQUARE, nearest])
        if change < tolerance:
            return displacement, sweep + 1, True
    return displacement, _SWEEPS, True


@kernel
def newton(
    strips: FloatArray, lobe: IntArray, total: int, displacement: float, load: float, vertical: bool,
    table: FloatArray, tolerance: float, active: IntArray, pairs: FloatArray, matrix: FloatArray,
    right: FloatArray, made_for: IntArray, scale: FloatArray,
) -> tuple[float, int, bool]:  # fmt: skip
    """Pressures, half-lengths, displacement on given strips; those without pressure leave, overlapped enter.

    A Jacobian serves as long as each step is much smaller than the one before; `made_for` (number of the
    strips with pressure it was made for, and which) and `scale` (what its unknowns are over) let it serve the
    next time, too.
    """
    work = np.empty((5, total))
    taken = np.zeros(2 * total + 1)
    barred = np.zeros(total)  # a strip that came in and left again stays out
    last = 1.0
    for step in range(_STEPS):
        m = 0
        same = True
        most_p, most_q = 0.0, 0.0
        for j in range(total):
            if strips[LOAD, j] > 0.0:
                active[m] = j
                m += 1
                same = same and made_for[m] == j
                most_p, most_q = max(most_p, strips[LOAD, j]), max(most_q, strips[SQUARE, j])
        if m == 0:
            return displacement, step, False
        n = 2 * m + 1
        same = same and made_for[0] == m
        if not same:
            taken[:n] = 0.0
            scale[0], scale[1], scale[2] = most_p, most_q, displacement
        residuals(
            strips, lobe, displacement, load, vertical, table, pairs, active, m, scale, not same, matrix,
            right, work,
        )  # fmt: skip
        if not same:
            made_for[0] = 0
            if not factorise(matrix, n):
                return displacement, step, False
            made_for[0] = m
            for row in range(m):
                made_for[row + 1] = active[row]
        substitute(matrix, right, n)
        change = 0.0
        for row in range(n):
            change = max(change, abs(right[row]))
        if same and not change < _GOOD * last:
            made_for[0] = 0
            continue
        last = change
        # As Broyden's method with the step before: what is left of it shows how far the Jacobian is off.
        along, square = 0.0, 0.0
        for row in range(n):
            along += right[row] * taken[row]
            square += taken[row] * taken[row]
        longer = 1.0
        if same and square > 0.0:
            longer = 1.0 / min(max(1.0 - along / square, 0.6), 1.5)
        for row in range(n):
            right[row] *= longer
            taken[row] = right[row]
        displacement += scale[2] * min(max(right[n - 1], -0.5), 1.0)
        left = False
        for row in range(m):
            j = active[row]
            q = strips[SQUARE, j]
            strips[SQUARE, j] = min(max(q + right[m + row] * scale[1], 0.25 * q), 4.0 * q)
            strips[LOAD, j] += right[row] * scale[0]
            if not strips[LOAD, j] > 0.0:
                strips[LOAD, j] = 0.0
                left = True
                barred[j] += 1.0
        if left or change > 0.03:
            continue
        # Strips without pressure that overlap come in.
        entered, kept_out = False, False
        for i in range(total):
            if strips[LOAD, i] > 0.0:
                continue
            lifted = strips[GAP, i] - displacement * strips[TURN, i]
            nearest, distance = -1, 1e9
            for row in range(m):
                j = active[row]
                a = in_the_middle(table, pairs[FARTHER, i, j] - work[0, row])
                b = in_the_middle(table, pairs[NEARER, i, j] - work[0, row])
                lifted += pairs[SHARE, i, j] * (a - b) * strips[LOAD, j]
                if pairs[FARTHER, i, j] < distance and strips[LOAD, j] > 0.0:
                    nearest, distance = j, pairs[FARTHER, i, j]
            if barred[i] > 1.0:
                kept_out = kept_out or lifted < -_OVERLAP * displacement
            elif lifted < -1e-5 * displacement:
                entered = True
                strips[LOAD, i] = 0.05 * strips[LOAD, nearest]
                strips[SQUARE, i] = 0.05 * strips[SQUARE, nearest]
        if not entered and change < tolerance:
            return displacement, step + 1, not kept_out
    return displacement, _STEPS, False
