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
    mean_on,
    share_of_neighbour,
)
from wearsim.contact.normal.knothe_le_the.strips import STEPS, Row, Work
from wearsim.contact.patch import FloatArray

_SMALL = 1e-13  # of a pivot, over what it was


@inner_bare_kernel
def factorise(matrix: FloatArray, n: int) -> bool:
    """Eliminate in place on and above the diagonal of a symmetric matrix; returns whether it went.

    The rows of U as they come, in place of their diagonal its reciprocal. Without pivoting, which influences
    of strips do not need: they are the energy of pressures.
    """
    for i in range(n):
        line, k = matrix[i, i:n], 0
        size = line[0]
        while k + 4 <= i:  # four rows at a time
            a, b, c, d = matrix[k, i:n], matrix[k + 1, i:n], matrix[k + 2, i:n], matrix[k + 3, i:n]
            p, q = a[0] * matrix[k, k], b[0] * matrix[k + 1, k + 1]
            r, s = c[0] * matrix[k + 2, k + 2], d[0] * matrix[k + 3, k + 3]
            for j in range(line.size):  # of slices, from 0: only so are vector instructions used
                line[j] -= (p * a[j] + q * b[j]) + (r * c[j] + s * d[j])
            k += 4
        while k < i:
            above = matrix[k, i:n]
            factor = above[0] * matrix[k, k]
            for j in range(line.size):
                line[j] -= factor * above[j]
            k += 1
        if not abs(line[0]) > _SMALL * abs(size):
            return False
        line[0] = 1.0 / line[0]
    return True


@inner_bare_kernel
def substitute(matrix: FloatArray, one: FloatArray, other: FloatArray, n: int) -> None:
    """Solve in place for two right sides with what `factorise` made."""
    for k in range(n):
        row, rest, further = matrix[k, k + 1 : n], one[k + 1 : n], other[k + 1 : n]
        first, second = one[k] * matrix[k, k], other[k] * matrix[k, k]
        for j in range(row.size):
            rest[j] -= first * row[j]
            further[j] -= second * row[j]
    for k in range(n - 1, -1, -1):
        first = one[k] = one[k] * matrix[k, k]
        second = other[k] = other[k] * matrix[k, k]
        for i in range(k):
            one[i] -= matrix[i, k] * first
            other[i] -= matrix[i, k] * second


_SWEEPS = 40  # of lengths and pressures in turn, at most
_TURNS = 40  # of strips that enter or leave, at most
_ENTER, _LEAVE = 4, 8  # turns after which only one strip enters or leaves at a time
_GROWN = 2.0  # of what was missed, beyond which the steps before are forgotten
# Of what is missed in one turn to the next, as long as there is one only; with two steps kept, and more.
_RATE, _AGAIN = 0.3, 0.1
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
    matrix, right, turned, width = work.matrix, work.right, work.sums[0], work.sums[1]
    for turn in range(_TURNS):
        m = _gather(work, total)
        if m == 0:
            break
        in_a_row = active[m - 1] - active[0] == m - 1  # then of slices: only so are vector instructions used
        # Forces on forces: each load with the width of its strip, so that the influences are symmetric.
        for k in range(m):
            width[k] = strips[active[k]].width
        for k in range(m):
            one, row_of = strips[active[k]], influence[active[k]]
            if in_a_row:
                line, values, widths = matrix[k, k:m], row_of[active[k] : active[k] + m - k], width[k:m]
                for j in range(line.size):
                    line[j] = values[j] * widths[j]
            else:
                for column in range(k, m):
                    matrix[k, column] = row_of[active[column]] * width[column]
            right[k], turned[k] = -(one.gap + bow[active[k]]) * width[k], one.turn * width[k]
        if not factorise(matrix, m):
            break
        substitute(matrix, right, turned, m)
        carried, per_displacement = 0.0, 0.0
        for k in range(m):
            down = 0.5 * np.pi * width[k] * (strips[active[k]].cosine if row.vertical else 1.0)
            carried += down * right[k]
            per_displacement += down * turned[k]
        if not per_displacement > 0.0:
            break
        displacement = (row.load - carried) / per_displacement
        for k in range(m):
            right[k] += displacement * turned[k]
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
                lifted += mean_on(work, i, active[k]) * strips[active[k]].load
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

    Steps of the lengths are those of Anderson's method, which goes on with those of the set of strips before
    while those of the same places in the list have pressure.
    """
    strips, active, listed, bow, above = work.strips, work.active, work.listed, work.bow, work.above
    state, begun, last = work.states[0], False, 1.0
    for _ in range(_SWEEPS):
        for i in range(total):
            work.logs[i] = 0.5 * np.log(strips[i].square) - state.log_width
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
        same, most = m == state.listed, 0.0
        for k in range(m):
            i = active[k]
            same = same and listed[k] == i
            listed[k] = i
            q = strips[i].square
            most = max(most, q)
            # Of the gap along the strip both means are known, and the difference is that of the pressures.
            bow[i] = max(q * fall[i] / (bow_of(0.75 * q, strips[i]) - bow[i]), 0.0)
        state.listed, change = m, 0.0
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
        rate = _RATE
        if same and begun:
            rate = min(change / last, 1.0)
        elif same and state.steps > 1:
            rate = _AGAIN
        state.left = change * rate
        if not same or change > _GROWN * last:
            state.steps = 0
        elif begun:  # the first one has none before of these strips, but those of the set before
            _keep_step(work, m)
        begun, last = True, change
        _next_step(work, m)
        # Lengths of strips without pressure, should they get some.
        for i in range(total):
            if strips[i].load <= 0.0:
                lifted = strips[i].gap - displacement * strips[i].turn
                nearest = active[0]
                for k in range(m):
                    lifted += mean_on(work, i, active[k]) * strips[active[k]].load
                    if work.farther[i, active[k]] < work.farther[i, nearest]:
                        nearest = active[k]
                q = -2.0 * lifted / strips[i].bend
                strips[i].square = min(max(q, 0.001 * strips[nearest].square), strips[nearest].square)
        if change < tolerance:
            break
    return displacement, True


@inner_bare_kernel
def _keep_step(work: Work, m: int) -> None:
    """Put the last step, and what is missed since, before those that are kept."""
    strips, active, missed, state = work.strips, work.active, work.right, work.states[0]
    moves, changes = work.moves, work.changes
    state.steps = min(state.steps + 1, STEPS)
    for j in range(state.steps - 1, 0, -1):
        for k in range(m):
            moves[j, k], changes[j, k] = moves[j - 1, k], changes[j - 1, k]
    for k in range(m):
        moves[0, k] = strips[active[k]].square - work.aims[0, k]
        changes[0, k] = missed[k] - work.aims[1, k]


@inner_bare_kernel
def _next_step(work: Work, m: int) -> None:
    """Take a step with what is missed, less what the steps before say will be missed again.

    Least squares of their differences, by elimination of the normal equations.
    """
    strips, active, missed, gram = work.strips, work.active, work.right, work.gram
    moves, changes, kept = work.moves, work.changes, work.states[0].steps
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
