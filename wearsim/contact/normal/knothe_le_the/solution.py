"""Kernels of the strip model: linear systems, and the solution of its equations for given strips.

Equations and sources: see `knothe_le_the`.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.kernel import bare_kernel
from wearsim.contact.normal.knothe_le_the.equations import (
    Work,
    expand,
    in_the_middle,
    influences,
    inner_of,
    jacobian,
    residuals,
)
from wearsim.contact.normal.knothe_le_the.strips import Row, bow_of
from wearsim.contact.patch import FloatArray

_SMALL = 1e-13  # of a pivot, over its row's largest number before


@bare_kernel
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


@bare_kernel
def less_products(start: float, line: FloatArray, right: FloatArray) -> float:
    """Take the products of two rows off a number, in four sums side by side."""
    a, b, c, d = start, 0.0, 0.0, 0.0
    k = 0
    while k + 4 <= line.size:
        a -= line[k] * right[k]
        b -= line[k + 1] * right[k + 1]
        c -= line[k + 2] * right[k + 2]
        d -= line[k + 3] * right[k + 3]
        k += 4
    while k < line.size:
        a -= line[k] * right[k]
        k += 1
    rest: float = (a + b) + (c + d)
    return rest


@bare_kernel
def substitute(matrix: FloatArray, right: FloatArray, n: int) -> None:
    """Solve in place with what `factorise` made."""
    for i in range(1, n):
        right[i] = less_products(right[i], matrix[i, :i], right[:i])
    for i in range(n - 1, -1, -1):
        right[i] = less_products(right[i], matrix[i, i + 1 : n], right[i + 1 : n]) * matrix[i, i]


_SWEEPS = 40  # of lengths and pressures in turn, at most
_STEPS = 60  # of Newton's method, at most
_OVERLAP = 1e-3  # of the displacement, of a strip that stays without pressure
_RATE = 0.1  # of the change of one step to the next with a Jacobian from nearby, as long as there is one only
_GOOD = 0.4  # of the last step's change, up to which a Jacobian is kept


@bare_kernel
def relax(
    work: Work, row: Row, total: int, displacement: float, table: FloatArray, tolerance: float
) -> tuple[float, bool]:
    """Pressures that never pull on strips of given lengths, and lengths from them, in turn."""
    strips, pairs, active, bow = work.strips, work.pairs, work.active, work.bow
    near, far, matrix, right = work.near, work.far, work.plain, work.right
    for _ in range(_SWEEPS):
        influences(work, total, table)
        for i in range(total):
            bow[i] = bow_of(0.25 * strips[i].square, strips[i].radius, strips[i].sigma)
        done = False
        for turn in range(40):
            m = total - total  # numba would compile the kernels for a literal 0 once more
            for j in range(total):
                if strips[j].load > 0.0:
                    active[m] = j
                    m += 1
            if m == 0:
                return displacement, False
            for k in range(m):
                i = active[k]
                for column in range(m):
                    matrix[k, column] = near[i, active[column]]
                matrix[k, m] = -strips[i].turn
                right[k] = -strips[i].gap - bow[i]
                matrix[m, k] = 0.5 * np.pi * strips[i].width * (strips[i].cosine if row.vertical else 1.0)
            matrix[m, m] = 0.0
            right[m] = row.load
            if not factorise(matrix, m + 1):
                return displacement, False
            substitute(matrix, right, m + 1)
            displacement = right[m]
            # All that pull leave at once, then all that overlap enter; one by one should that go in circles.
            changed = False
            worst, worst_row = 0.0, -1
            for k in range(m):
                strips[active[k]].load = right[k]
                if right[k] <= 0.0:
                    changed = True
                    if turn < 8:
                        strips[active[k]].load = 0.0
                    elif right[k] <= worst:
                        worst, worst_row = right[k], k
            if changed:
                if turn >= 8:
                    for k in range(m):
                        strips[active[k]].load = max(right[k], 1e-12)
                    strips[active[worst_row]].load = 0.0
                continue
            worst, worst_row = -1e-9 * displacement, -1
            for i in range(total):
                if strips[i].load > 0.0:
                    continue
                lifted = strips[i].gap + bow[i] - displacement * strips[i].turn
                for k in range(m):
                    lifted += near[i, active[k]] * strips[active[k]].load
                if lifted < -1e-9 * displacement and turn < 4:
                    strips[i].load = 1e-12
                    changed = True
                if lifted < worst:
                    worst, worst_row = lifted, i
            if turn >= 4 and worst_row >= 0:
                strips[worst_row].load = 1e-12
                changed = True
            if not changed:
                done = True
                break
        if not done:
            return displacement, False
        change = 0.0
        most = 0.0
        for k in range(m):
            most = max(most, strips[active[k]].square)
        for k in range(m):
            i = active[k]
            fall = 0.0
            for column in range(m):
                fall += (near[i, active[column]] - far[i, active[column]]) * strips[active[column]].load
            q = max(4.0 * fall / (1.0 / strips[i].radius + strips[i].sigma), 0.0)
            bow[i] = q
        for k in range(m):
            i = active[k]
            inner = inner_of(active, strips, m, k)
            q = bow[i]
            if inner >= 0:
                j = active[inner]
                q = min(bow[j] * strips[i].load / strips[j].load, bow[j])
            old = strips[i].square
            change = max(change, abs(q - old) / most)
            strips[i].square = min(max(q, 0.1 * old), 10.0 * old)
        # Lengths of strips without pressure, should they get some.
        for i in range(total):
            if strips[i].load <= 0.0:
                lifted = strips[i].gap - displacement * strips[i].turn
                nearest, distance = 0, 1e9
                for k in range(m):
                    lifted += near[i, active[k]] * strips[active[k]].load
                    if pairs.farther[i, active[k]] < distance:
                        nearest, distance = active[k], pairs.farther[i, active[k]]
                q = -4.0 * lifted / (1.0 / strips[i].radius + strips[i].sigma)
                strips[i].square = min(max(q, 0.001 * strips[nearest].square), strips[nearest].square)
        if change < tolerance:
            return displacement, True
    return displacement, True


@bare_kernel
def newton(
    work: Work, row: Row, total: int, displacement: float, table: FloatArray, tolerance: float
) -> tuple[float, bool]:
    """Pressures, half-lengths, displacement on given strips; those without pressure leave, overlapped enter.

    A Jacobian serves as long as each step is much smaller than the one before, the next time, too.
    """
    strips, pairs, active, matrix, right = work.strips, work.pairs, work.active, work.matrix, work.right
    made_for, scale, taken, barred = work.made_for, work.scale, work.taken, work.barred
    logs = work.logs
    taken[:] = 0.0
    barred[:] = 0.0  # a strip that came in and left again stays out
    last = 1.0
    for _ in range(_STEPS):
        m = total - total
        same = True
        most_p, most_q = 0.0, 0.0
        for j in range(total):
            if strips[j].load > 0.0:
                active[m] = j
                logs[j] = 0.5 * np.log(strips[j].square) - scale[3]
                m += 1
                same = same and made_for[m] == j
                most_p, most_q = max(most_p, strips[j].load), max(most_q, strips[j].square)
        if m == 0:
            return displacement, False
        n = 2 * m + 1
        same = same and made_for[0] == m
        if not same:
            taken[:n] = 0.0
            scale[0], scale[1], scale[2] = most_p, most_q, displacement
        expand(work, table, total, m)
        residuals(work, row, displacement, total, m)
        if not same:
            made_for[0] = 0
            jacobian(work, row, m)
            if not factorise(matrix, n):
                return displacement, False
            made_for[0] = m
            for k in range(m):
                made_for[k + 1] = active[k]
        substitute(matrix, right, n)
        change = 0.0
        for k in range(n):
            change = max(change, abs(right[k]))
        if same and not change < _GOOD * last:
            made_for[0] = 0
            continue
        work.left[0] = change * (min(change / last, 1.0) if last < 1.0 else _RATE)
        last = change
        # As Broyden's method with the step before: what is left of it shows how far the Jacobian is off.
        along, square = 0.0, 0.0
        for k in range(n):
            along += right[k] * taken[k]
            square += taken[k] * taken[k]
        longer = 1.0
        if same and square > 0.0:
            longer = 1.0 / min(max(1.0 - along / square, 0.6), 1.5)
        for k in range(n):
            right[k] *= longer
            taken[k] = right[k]
        displacement += scale[2] * min(max(right[n - 1], -0.5), 1.0)
        left = False
        for k in range(m):
            j = active[k]
            q = strips[j].square
            strips[j].square = min(max(q + right[m + k] * scale[1], 0.25 * q), 4.0 * q)
            strips[j].load += right[k] * scale[0]
            if not strips[j].load > 0.0:
                strips[j].load = 0.0
                left = True
                barred[j] += 1.0
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
                a = in_the_middle(table, pairs.farther[i, j] - logs[j])
                b = in_the_middle(table, pairs.nearer[i, j] - logs[j])
                lifted += pairs.share[i, j] * (a - b) * strips[j].load
                if pairs.farther[i, j] < distance and strips[j].load > 0.0:
                    nearest, distance = j, pairs.farther[i, j]
            if barred[i] > 1.0:
                kept_out = kept_out or lifted < -_OVERLAP * displacement
            elif lifted < -1e-5 * displacement:
                entered = True
                strips[i].load = 0.05 * strips[nearest].load
                strips[i].square = 0.05 * strips[nearest].square
        if not entered and change < tolerance:
            return displacement, not kept_out
    return displacement, False
