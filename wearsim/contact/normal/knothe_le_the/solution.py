"""Kernels of the strip model: linear systems, and the solution of its equations for given strips.

Equations and sources: see `knothe_le_the`.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.kernel import inner_bare_kernel
from wearsim.contact.normal.knothe_le_the.equations import (
    bow_of,
    expand,
    influences,
    inner_of,
    share_of_neighbour,
)
from wearsim.contact.normal.knothe_le_the.strips import STEPS, Row, Work
from wearsim.contact.patch import FloatArray

_SMALL = 1e-13  # of a pivot, over its row's largest number before


@inner_bare_kernel
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


@inner_bare_kernel
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


@inner_bare_kernel
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
_GROWN = 2.0  # of what was missed, beyond which the steps before are forgotten
_RATE = 0.3  # of what is missed in one turn to the next, as long as there is one only
_SHARPEST = 20.0  # P/q over that of two cylinders across the track; ellipses 30 times as long as wide have 9
_STRETCH = 3.0  # of what was aimed at, that a step may miss it by
_BARELY = 1e-12  # m, P of a strip that just got pressure


@inner_bare_kernel
def _gather(work: Work, total: int) -> int:
    """List the strips with pressure; return their number."""
    m = total - total  # numba would compile the kernels for a literal 0 once more
    for j in range(total):
        if work.strips[j].load > 0.0:
            work.active[m] = j
            m += 1
    return m


@inner_bare_kernel
def _press(work: Work, row: Row, total: int, displacement: float) -> tuple[float, int]:
    """Pressures that never pull on strips of given lengths, `bow` apart; 0 strips if there are none.

    All that pull leave at once, then all that overlap enter; one by one should that go in circles.
    """
    strips, active, bow, influence = work.strips, work.active, work.bow, work.mean
    matrix, right = work.matrix, work.right
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


@inner_bare_kernel
def solve_strips(
    work: Work, row: Row, total: int, displacement: float, table: FloatArray, tolerance: float
) -> tuple[float, bool]:
    """Pressures that never pull on strips of given lengths, and lengths from them, in turn.

    Steps of the lengths are those of Anderson's method.
    """
    strips, active, listed, bow, above = work.strips, work.active, work.listed, work.bow, work.above
    kept, number, last = total - total, total - total, 1.0
    for _ in range(_SWEEPS):
        for i in range(total):
            work.logs[i] = 0.5 * np.log(strips[i].square) - work.states[0].log_width
            bow[i] = bow_of(0.25 * strips[i].square, strips[i])
        expand(work, table, total)
        influences(work, total)
        displacement, m = _press(work, row, total, displacement)
        if m == 0:
            return displacement, False
        fall = work.sums[2][:total]
        for k in range(total):
            fall[k] = 0.0
        for k in range(m):
            load, rises = strips[active[k]].load, above[active[k], :total]
            for i in range(fall.size):
                fall[i] -= rises[i] * load
        same, most = m == number, 0.0
        for k in range(m):
            i = active[k]
            same = same and listed[k] == i
            listed[k] = i
            q = strips[i].square
            most = max(most, q)
            # Of the gap along the strip both means are known, and the difference is that of the pressures.
            bow[i] = max(q * fall[i] / (bow_of(0.75 * q, strips[i]) - bow[i]), 0.0)
        number, change = m, 0.0
        missed = work.right
        for k in range(m):
            one, q = strips[active[k]], bow[active[k]]
            inner, share = inner_of(work, m, k), 0.0
            if inner >= 0:
                j = active[inner]
                share = share_of_neighbour(one.load, strips[j].load)
                q += share * (min(bow[j] * one.load / strips[j].load, bow[j]) - q)
            # A strip could shrink to a point between overlapping surfaces.
            q = max(q, one.load * np.pi / (_SHARPEST * one.bend))
            change = max(change, abs(q - one.square) / most)
            if share == 1.0:  # not part of the steps below
                one.square = q
            missed[k] = q - one.square
        work.states[0].left = change * (min(change / last, 1.0) if same else _RATE)
        if not same or change > _GROWN * last:
            kept = total - total
        elif kept < STEPS:
            kept += 1
        last = change
        _next_step(work, kept, m)
        # Lengths of strips without pressure, should they get some.
        for i in range(total):
            if strips[i].load <= 0.0:
                lifted = strips[i].gap - displacement * strips[i].turn
                nearest = active[0]
                for k in range(m):
                    lifted += work.mean[active[k], i] * strips[active[k]].load
                    if work.farther[i, active[k]] < work.farther[i, nearest]:
                        nearest = active[k]
                q = -2.0 * lifted / strips[i].bend
                strips[i].square = min(max(q, 0.001 * strips[nearest].square), strips[nearest].square)
        if change < tolerance:
            break
    return displacement, True


@inner_bare_kernel
def _next_step(work: Work, kept: int, m: int) -> None:
    """Take a step with what is missed, less what the `kept` steps before say will be missed again.

    Least squares of their differences, by elimination of the normal equations.
    """
    strips, active, missed, gram = work.strips, work.active, work.right, work.gram
    moves, changes = work.moves, work.changes
    if kept > 0:
        for j in range(kept - 1, 0, -1):
            for k in range(m):
                moves[j, k], changes[j, k] = moves[j - 1, k], changes[j - 1, k]
        for k in range(m):
            moves[0, k] = strips[active[k]].square - work.aims[0, k]
            changes[0, k] = missed[k] - work.aims[1, k]
    for k in range(m):
        work.aims[0, k], work.aims[1, k] = strips[active[k]].square, missed[k]
    for i in range(kept):
        for j in range(kept + 1):
            gram[i, j] = 0.0
        for k in range(m):
            for j in range(kept):
                gram[i, j] += changes[i, k] * changes[j, k]
            gram[i, kept] += changes[i, k] * missed[k]
    for i in range(kept):
        gram[i, i] = gram[i, i] * (1.0 + 1e-9) + 1e-60
    for i in range(kept):
        for j in range(i + 1, kept):
            factor = gram[j, i] / gram[i, i]
            for k in range(i, kept + 1):
                gram[j, k] -= factor * gram[i, k]
    for i in range(kept - 1, -1, -1):
        for j in range(i + 1, kept):
            gram[i, kept] -= gram[i, j] * gram[j, kept]
        gram[i, kept] /= gram[i, i]
    for k in range(m):
        one, step = strips[active[k]], missed[k]
        for j in range(kept if step != 0.0 else 0):  # strips at the rim stay where they aim
            step -= gram[j, kept] * (moves[j, k] + changes[j, k])
        aim = one.square + missed[k]
        one.square = min(max(one.square + step, aim / _STRETCH), _STRETCH * aim)
