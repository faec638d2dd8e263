"""Kernels of the strip model: linear systems, and the solution of its equations for given strips.

Equations and sources: see `knothe_le_the`.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.kernel import bare_kernel
from wearsim.contact.normal.knothe_le_the.equations import (
    NEARBY,
    UNKNOWN,
    bow_of,
    expand,
    in_the_middle,
    inner_of,
    jacobian,
    residuals,
    share_of_neighbour,
)
from wearsim.contact.normal.knothe_le_the.strips import Row, Work
from wearsim.contact.patch import FloatArray

_SMALL = 1e-13  # of a pivot, over its row's largest number before


@bare_kernel
def _eliminate(line: FloatArray, matrix: FloatArray, count: int) -> None:
    """Take the first `count` rows of U off a line, which gets its factors of them; four at a time."""
    n, k = line.size, 0
    while k + 4 <= count:
        a, b, c, d = matrix[k, k:n], matrix[k + 1, k:n], matrix[k + 2, k:n], matrix[k + 3, k:n]
        p = line[k]
        q = line[k + 1] - p * a[1]
        r = (line[k + 2] - p * a[2]) - q * b[2]
        s = ((line[k + 3] - p * a[3]) - q * b[3]) - r * c[3]
        line[k + 1], line[k + 2], line[k + 3] = q, r, s
        rest, a, b, c, d = line[k + 4 :], a[4:], b[4:], c[4:], d[4:]
        for j in range(rest.size):  # of slices, from 0: only so are vector instructions used
            rest[j] -= (p * a[j] + q * b[j]) + (r * c[j] + s * d[j])
        k += 4
    while k < count:
        factor, rest, above = line[k], line[k + 1 :], matrix[k, k + 1 : n]
        for j in range(rest.size):
            rest[j] -= factor * above[j]
        k += 1


@bare_kernel
def factorise(matrix: FloatArray, n: int) -> bool:
    """Factorise in place into L and U; returns whether it went.

    Without pivoting: the strips' equations begin with a block of influences, and the rest follows from it.
    U has a diagonal of ones; the reciprocals of L's are kept.
    """
    for i in range(n):
        line, size = matrix[i, :n], 0.0
        for j in range(n):
            size = max(size, abs(line[j]))
        _eliminate(line, matrix, i)
        if not abs(line[i]) > _SMALL * size:
            return False
        line[i] = 1.0 / line[i]
        rest = line[i + 1 :]
        for j in range(rest.size):
            rest[j] *= line[i]
    return True


@bare_kernel
def substitute(matrix: FloatArray, right: FloatArray, n: int) -> None:
    """Solve in place with what `factorise` made of the transposed matrix: rows of both factors are used."""
    _eliminate(right[:n], matrix, n)
    for k in range(n - 1, -1, -1):
        value = right[k] = right[k] * matrix[k, k]
        rest, before = right[:k], matrix[k, :k]
        for j in range(rest.size):
            rest[j] -= before[j] * value


_SWEEPS = 40  # of lengths and pressures in turn, at most
_TURNS = 40  # of strips that enter or leave, at most
_ENTER, _LEAVE = 4, 8  # turns after which only one strip enters or leaves at a time
_STEPS = 60  # of Newton's method, at most
_OVERLAP = 1e-3  # of the displacement, of a strip that stays without pressure
_RATE = 0.1  # of the change of one step to the next with a Jacobian from nearby, as long as there is one only
_GOOD = 0.4  # of the last step's change, up to which a Jacobian is kept
_BARELY = 1e-12  # m, P of a strip that just got pressure


@bare_kernel
def _gather(work: Work, total: int) -> int:
    """List the strips with pressure; return their number."""
    m = total - total  # numba would compile the kernels for a literal 0 once more
    for j in range(total):
        if work.strips[j].load > 0.0:
            work.active[m] = j
            m += 1
    return m


@bare_kernel
def _press(work: Work, row: Row, total: int, displacement: float) -> tuple[float, int]:
    """Pressures that never pull on strips of given lengths, `bow` apart; 0 strips if there are none.

    All that pull leave at once, then all that overlap enter; one by one should that go in circles.
    """
    strips, active, bow, influence = work.strips, work.active, work.bow, work.exact_terms[0]
    matrix, right = work.plain, work.right
    for turn in range(_TURNS):
        m = _gather(work, total)
        if m == 0:
            break
        for k in range(m):
            one = strips[active[k]]
            for column in range(m):
                matrix[column, k] = influence[active[column], active[k]]
            matrix[m, k] = -one.turn
            right[k] = -one.gap - bow[active[k]]
            matrix[k, m] = 0.5 * np.pi * one.width * (one.cosine if row.vertical else 1.0)
        matrix[m, m], right[m] = 0.0, row.load
        if not factorise(matrix, m + 1):
            break
        substitute(matrix, right, m + 1)
        displacement = right[m]
        worst, place = 0.0, -1
        for k in range(m):
            strips[active[k]].load = max(right[k], _BARELY if turn >= _LEAVE else 0.0)
            if right[k] <= worst:
                worst, place = right[k], active[k]
        if place >= 0:
            strips[place].load = 0.0
            continue
        worst = -1e-9 * displacement
        for i in range(total):
            if strips[i].load > 0.0:
                continue
            lifted = strips[i].gap + bow[i] - displacement * strips[i].turn
            for k in range(m):
                lifted += influence[active[k], i] * strips[active[k]].load
            if lifted < -1e-9 * displacement and turn < _ENTER:
                strips[i].load = _BARELY
            if lifted < worst:
                worst, place = lifted, i
        if place < 0:
            return displacement, m
        strips[place].load = _BARELY
    return displacement, total - total


@bare_kernel
def relax(
    work: Work, row: Row, total: int, displacement: float, table: FloatArray, tolerance: float
) -> tuple[float, bool]:
    """Pressures that never pull on strips of given lengths, and lengths from them, in turn."""
    strips, active, bow, terms = work.strips, work.active, work.bow, work.exact_terms
    work.exact_base[:] = UNKNOWN
    for _ in range(_SWEEPS):
        for i in range(total):
            work.logs[i] = 0.5 * np.log(strips[i].square) - work.states[0].log_width
            bow[i] = bow_of(0.25 * strips[i].square, strips[i])
        expand(work, table, total, work.exact_base, terms, 0.0)
        displacement, m = _press(work, row, total, displacement)
        if m == 0:
            return displacement, False
        change, most = 0.0, 0.0
        for k in range(m):
            i = active[k]
            most = max(most, strips[i].square)
            fall = 0.0
            for column in range(m):
                fall -= terms[1, active[column], i] * strips[active[column]].load
            bow[i] = max(4.0 * fall / (1.0 / strips[i].radius + strips[i].sigma), 0.0)
        for k in range(m):
            one, q = strips[active[k]], bow[active[k]]
            inner = inner_of(work, m, k)
            if inner >= 0:
                j = active[inner]
                share = share_of_neighbour(one.load, strips[j].load)
                q += share * (min(bow[j] * one.load / strips[j].load, bow[j]) - q)
            change = max(change, abs(q - one.square) / most)
            one.square = min(max(q, 0.1 * one.square), 10.0 * one.square)
        # Lengths of strips without pressure, should they get some.
        for i in range(total):
            if strips[i].load <= 0.0:
                lifted = strips[i].gap - displacement * strips[i].turn
                nearest = active[0]
                for k in range(m):
                    lifted += terms[0, active[k], i] * strips[active[k]].load
                    if work.farther[i, active[k]] < work.farther[i, nearest]:
                        nearest = active[k]
                q = -4.0 * lifted / (1.0 / strips[i].radius + strips[i].sigma)
                strips[i].square = min(max(q, 0.001 * strips[nearest].square), strips[nearest].square)
        if change < tolerance:
            break
    return displacement, True


@bare_kernel
def newton(
    work: Work, row: Row, total: int, displacement: float, table: FloatArray, tolerance: float
) -> tuple[float, bool]:
    """Pressures, half-lengths, displacement on given strips; those without pressure leave, overlapped enter.

    A Jacobian serves as long as each step is much smaller than the one before, the next time, too.
    """
    strips, active, matrix, right, logs = work.strips, work.active, work.matrix, work.right, work.logs
    made_for, state, taken, barred = work.made_for, work.states[0], work.taken, work.barred
    taken[:] = 0.0
    barred[:] = 0.0  # a strip that came in and left again stays out
    last = 1.0
    for _ in range(_STEPS):
        m = _gather(work, total)
        if m == 0:
            break
        n = 2 * m + 1
        same = made_for[0] == m
        for k in range(m):
            same = same and made_for[k + 1] == active[k]
        for j in range(total):
            logs[j] = 0.5 * np.log(strips[j].square) - state.log_width if strips[j].load > 0.0 else UNKNOWN
        if not same:
            taken[:n] = 0.0
            state.per_p, state.per_q, state.per_displacement = 0.0, 0.0, displacement
            for k in range(m):
                state.per_p = max(state.per_p, strips[active[k]].load)
                state.per_q = max(state.per_q, strips[active[k]].square)
        expand(work, table, total, work.base, work.terms, NEARBY)
        residuals(work, row, displacement, total, m)
        if not same:
            made_for[0] = 0
            jacobian(work, row, displacement, m)
            if not factorise(matrix, n):
                break
            made_for[0] = m
            for k in range(m):
                made_for[k + 1] = active[k]
        substitute(matrix, right, n)
        change, along, square = 0.0, 0.0, 0.0
        for k in range(n):
            change = max(change, abs(right[k]))
            along += right[k] * taken[k]
            square += taken[k] * taken[k]
        if same and not change < _GOOD * last:
            made_for[0] = 0
            continue
        state.left = change * (min(change / last, 1.0) if last < 1.0 else _RATE)
        last = change
        # As Broyden's method with the step before: what is left of it shows how far the Jacobian is off.
        longer = 1.0 / min(max(1.0 - along / square, 0.6), 1.5) if same and square > 0.0 else 1.0
        for k in range(n):
            taken[k] = right[k] = longer * right[k]
        displacement += state.per_displacement * min(max(right[n - 1], -0.5), 1.0)
        left = False
        for k in range(m):
            one = strips[active[k]]
            q = one.square
            one.square = min(max(q + right[m + k] * state.per_q, 0.25 * q), 4.0 * q)
            one.load += right[k] * state.per_p
            if not one.load > 0.0:
                one.load = 0.0
                left = True
                barred[active[k]] += 1.0
        if left or change > 0.03:
            continue
        # Strips without pressure that overlap come in.
        entered, kept_out = False, False
        for i in range(total):
            if strips[i].load > 0.0:
                continue
            lifted = strips[i].gap - displacement * strips[i].turn
            nearest, distance = -1, 1e9
            for k in range(m):
                j = active[k]
                a = in_the_middle(table, work.farther[i, j] - logs[j])
                b = in_the_middle(table, work.nearer[i, j] - logs[j])
                lifted += work.part[i, j] * (a - b) * strips[j].load
                if work.farther[i, j] < distance and strips[j].load > 0.0:
                    nearest, distance = j, work.farther[i, j]
            if barred[i] > 1.0:
                kept_out = kept_out or lifted < -_OVERLAP * displacement
            elif lifted < -1e-5 * displacement:
                entered = True
                strips[i].load = 0.05 * strips[nearest].load
                strips[i].square = 0.05 * strips[nearest].square
        if not entered and change < tolerance:
            return displacement, not kept_out
    return displacement, False
