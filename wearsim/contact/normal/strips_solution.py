"""Kernels of the strip model: pressures and lengths of given strips.

Equations and sources: see `knothe_le_the`.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.kernel import kernel
from wearsim.contact.normal.strips_influence import averages
from wearsim.contact.normal.strips_laid import (
    ANGLE,
    COSINE,
    GAP,
    LOAD,
    RADIUS,
    SIGMA,
    SQUARE,
    TURN,
    WIDTH,
    Y,
    Z,
    bow_of,
    fade,
)
from wearsim.contact.patch import FloatArray, IntArray

_SWEEPS = 100  # of lengths and pressures in turn, at most


@kernel
def _eliminate(matrix: FloatArray, right: FloatArray, n: int) -> bool:
    """Solve a linear system in place by Gauss's elimination with partial pivoting."""
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        if matrix[best, k] == 0.0:
            return False
        if best != k:
            for j in range(k, n):
                swap = matrix[k, j]
                matrix[k, j] = matrix[best, j]
                matrix[best, j] = swap
            swap = right[k]
            right[k] = right[best]
            right[best] = swap
        inverse = 1.0 / matrix[k, k]
        pivot = matrix[k, k + 1 : n]
        for i in range(k + 1, n):
            factor = matrix[i, k] * inverse
            if factor != 0.0:
                line = matrix[i, k + 1 : n]
                for j in range(pivot.size):  # of slices, from 0: only so are vector instructions used
                    line[j] -= factor * pivot[j]
                right[i] -= factor * right[k]
    for k in range(n - 1, -1, -1):
        value = right[k]
        for j in range(k + 1, n):
            value -= matrix[k, j] * right[j]
        right[k] = value / matrix[k, k]
    return True


@kernel
def relax(
    strips: FloatArray,
    lobe: IntArray,
    total: int,
    descent: float,
    load: float,
    vertical: bool,
    table: FloatArray,
    tolerance: float,
    active: IntArray,
    edges: FloatArray,
    near: FloatArray,
    far: FloatArray,
    matrix: FloatArray,
    right: FloatArray,
) -> tuple[float, int, bool]:
    """Pressures that never pull on strips of given lengths, and lengths from them, in turn."""
    bow = np.empty(total)
    for sweep in range(_SWEEPS):
        for i in range(total):
            log_i = 0.5 * np.log(strips[SQUARE, i])
            bow[i] = bow_of(0.25 * strips[SQUARE, i], strips[RADIUS, i], strips[SIGMA, i])
            for j in range(total):
                log_j = 0.5 * np.log(strips[SQUARE, j])
                a, b, _, _, _, _ = averages(table, log_i - log_j, edges[1, i, j] - log_j)
                if i == j:
                    near[i, j], far[i, j] = 2.0 * a, 2.0 * b
                else:
                    c, d, _, _, _, _ = averages(table, log_i - log_j, edges[0, i, j] - log_j)
                    near[i, j], far[i, j] = edges[2, i, j] * (a - c), edges[2, i, j] * (b - d)
        done = False
        for turn in range(40):
            m = 0
            for j in range(total):
                if strips[LOAD, j] > 0.0:
                    active[m] = j
                    m += 1
            if m == 0:
                return descent, sweep, False
            for row in range(m):
                i = active[row]
                for column in range(m):
                    matrix[row, column] = near[i, active[column]]
                matrix[row, m] = -strips[TURN, i]
                right[row] = -strips[GAP, i] - bow[i]
                matrix[m, row] = 0.5 * np.pi * strips[WIDTH, i] * (strips[COSINE, i] if vertical else 1.0)
            matrix[m, m] = 0.0
            right[m] = load
            if not _eliminate(matrix, right, m + 1):
                return descent, sweep, False
            descent = right[m]
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
            worst, worst_row = -1e-9 * descent, -1
            for i in range(total):
                if strips[LOAD, i] > 0.0:
                    continue
                lifted = strips[GAP, i] + bow[i] - descent * strips[TURN, i]
                for row in range(m):
                    lifted += near[i, active[row]] * strips[LOAD, active[row]]
                if lifted < -1e-9 * descent and turn < 4:
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
            return descent, sweep, False
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
            inner = -1
            if row + 1 < m and active[row + 1] == i + 1 and lobe[i + 1] == lobe[i]:
                inner = row + 1
            if row > 0 and active[row - 1] == i - 1 and lobe[i - 1] == lobe[i]:
                inner = -1 if inner >= 0 else row - 1
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
                lifted = strips[GAP, i] - descent * strips[TURN, i]
                nearest, distance = 0, 1e9
                for row in range(m):
                    lifted += near[i, active[row]] * strips[LOAD, active[row]]
                    if edges[1, i, active[row]] < distance:
                        nearest, distance = active[row], edges[1, i, active[row]]
                q = -4.0 * lifted / (1.0 / strips[RADIUS, i] + strips[SIGMA, i])
                strips[SQUARE, i] = min(max(q, 0.001 * strips[SQUARE, nearest]), strips[SQUARE, nearest])
        if change < tolerance:
            return descent, sweep + 1, True
    return descent, _SWEEPS, True


@kernel
def newton(
    strips: FloatArray,
    lobe: IntArray,
    total: int,
    descent: float,
    load: float,
    vertical: bool,
    table: FloatArray,
    tolerance: float,
    active: IntArray,
    edges: FloatArray,
    matrix: FloatArray,
    right: FloatArray,
) -> tuple[float, int, bool]:
    """Pressures, half-lengths and descent on given strips; those without pressure leave, overlapped enter."""
    logs = np.empty(total)
    barred = np.zeros(total)  # a strip that came in and left again stays out
    for step in range(30):
        m = 0
        most_p, most_q = 0.0, 0.0
        for j in range(total):
            if strips[LOAD, j] > 0.0:
                active[m] = j
                m += 1
                most_p, most_q = max(most_p, strips[LOAD, j]), max(most_q, strips[SQUARE, j])
                logs[j] = 0.5 * np.log(strips[SQUARE, j])
        if m == 0:
            return descent, step, False
        n = 2 * m + 1
        for row in range(m):
            i = active[row]
            q = strips[SQUARE, i]
            low_bow = bow_of(0.25 * q, strips[RADIUS, i], strips[SIGMA, i])
            high_bow = bow_of(0.75 * q, strips[RADIUS, i], strips[SIGMA, i])
            near, far = 0.0, 0.0
            near_self, far_self = 0.0, 0.0
            for column in range(m):
                j = active[column]
                ratio = logs[i] - logs[j]
                if i == j:
                    a, b, ax, ay, bx, by = averages(table, 0.0, edges[0, i, i] - logs[j])
                    a, b, ax, ay, bx, by = 2.0 * a, 2.0 * b, 2.0 * ax, 2.0 * ay, 2.0 * bx, 2.0 * by
                else:
                    c, d, cx, cy, dx, dy = averages(table, ratio, edges[0, i, j] - logs[j])
                    a, b, ax, ay, bx, by = averages(table, ratio, edges[1, i, j] - logs[j])
                    share = edges[2, i, j]
                    a, b, ax = share * (a - c), share * (b - d), share * (ax - cx)
                    ay, bx, by = share * (ay - cy), share * (bx - dx), share * (by - dy)
                p = strips[LOAD, j]
                near += a * p
                far += b * p
                near_self += ax * p
                far_self += bx * p
                matrix[row, column] = a * most_p
                matrix[m + row, column] = (b - a) * most_p
                # d/dq = d/d(ln a) / (2 q)
                scale = -0.5 * p / strips[SQUARE, j] * most_q
                matrix[row, m + column] = (ax + ay) * scale
                matrix[m + row, m + column] = (bx + by - ax - ay) * scale
            matrix[row, m + row] += (0.5 * near_self + low_bow) / q * most_q
            matrix[m + row, m + row] += (0.5 * (far_self - near_self) + high_bow - low_bow) / q * most_q
            matrix[row, n - 1] = -strips[TURN, i] * descent
            matrix[m + row, n - 1] = 0.0
            right[row] = -(near + strips[GAP, i] + low_bow - descent * strips[TURN, i])
            right[m + row] = -(far - near + high_bow - low_bow)
            # A strip at the rim takes the ratio P/q from its neighbour: alone it could shrink to a point
            # where the surfaces still overlap.
            inner = -1
            if row + 1 < m and active[row + 1] == i + 1 and lobe[i + 1] == lobe[i]:
                inner = row + 1
            if row > 0 and active[row - 1] == i - 1 and lobe[i - 1] == lobe[i]:
                inner = -1 if inner >= 0 else row - 1
            if inner >= 0:
                for column in range(m):
                    matrix[m + row, column] = 0.0
                    matrix[m + row, m + column] = 0.0
                j = active[inner]
                p, other_p, other_q = (
                    strips[LOAD, i] / most_p,
                    strips[LOAD, j] / most_p,
                    strips[SQUARE, j] / most_q,
                )
                matrix[m + row, row] = other_q
                matrix[m + row, inner] = -q / most_q
                matrix[m + row, m + row] = -other_p
                matrix[m + row, m + inner] = p
                right[m + row] = q / most_q * other_p - p * other_q
            lift = 0.5 * np.pi * strips[WIDTH, i] * (strips[COSINE, i] if vertical else 1.0)
            matrix[n - 1, row] = lift * most_p / load
            matrix[n - 1, m + row] = 0.0
        matrix[n - 1, n - 1] = 0.0
        carried = 0.0
        for row in range(m):
            carried += matrix[n - 1, row] * strips[LOAD, active[row]] / most_p
        right[n - 1] = 1.0 - carried
        if not _eliminate(matrix, right, n):
            return descent, step, False
        change = abs(right[n - 1])
        descent *= 1.0 + min(max(right[n - 1], -0.5), 1.0)
        left = False
        for row in range(m):
            change = max(change, abs(right[row]), abs(right[m + row]))
        wild = False
        for row in range(m):
            j = active[row]
            q = strips[SQUARE, j]
            strips[SQUARE, j] = min(max(q + right[m + row] * most_q, 0.25 * q), 4.0 * q)
            p = strips[LOAD, j]
            strips[LOAD, j] += right[row] * most_p
            if not strips[LOAD, j] > 0.0:
                if wild:
                    strips[LOAD, j] = 0.2 * p
                    continue
                strips[LOAD, j] = 0.0
                left = True
                barred[j] += 1.0
        if left or wild or change > 0.03:
            continue
        # Strips without pressure that overlap come in.
        entered = False
        for i in range(total):
            if strips[LOAD, i] > 0.0 or barred[i] > 4.0:
                continue
            lifted = strips[GAP, i] - descent * strips[TURN, i]
            nearest, distance = -1, 1e9
            for row in range(m):
                j = active[row]
                log = 0.5 * np.log(strips[SQUARE, j])
                a, _, _, _, _, _ = averages(table, -5.0, edges[1, i, j] - log)
                b, _, _, _, _, _ = averages(table, -5.0, edges[0, i, j] - log)
                lifted += edges[2, i, j] * (a - b) * strips[LOAD, j]
                if edges[1, i, j] < distance and strips[LOAD, j] > 0.0:
                    nearest, distance = j, edges[1, i, j]
            if lifted < -1e-3 * descent:
                entered = True
                strips[LOAD, i] = 0.05 * strips[LOAD, nearest]
                strips[SQUARE, i] = 0.05 * strips[SQUARE, nearest]
        if not entered and change < tolerance:
            return descent, step + 1, True
    return descent, 30, False


@kernel
def overlap(
    k: int,
    descent: float,
    low: float,
    grid_y: FloatArray,
    grid_z: FloatArray,
    angle: FloatArray,
    gap: FloatArray,
    strips: FloatArray,
    total: int,
    table: FloatArray,
) -> float:
    """How deep the moved surfaces would overlap at a grid point without pressure, over the descent."""
    away = (gap[k] - low - descent) * np.cos(angle[k])
    if away > 0.0:
        return 0.0
    for j in range(total):
        p = strips[LOAD, j]
        share = fade(strips[ANGLE, j] - angle[k])
        if p > 0.0 and share > 0.0:
            across, down = strips[Y, j] - grid_y[k], strips[Z, j] - grid_z[k]
            distance = np.sqrt(across * across + down * down)
            half = 0.5 * strips[WIDTH, j]
            log = 0.5 * np.log(strips[SQUARE, j])
            a, _, _, _, _, _ = averages(table, -5.0, np.log(distance + half) - log)
            if distance > half:
                b, _, _, _, _, _ = averages(table, -5.0, np.log(max(distance - half, 0.1 * half)) - log)
            else:
                b = 0.0
            away += share * (a - b) * p
    depth: float = -away / descent
    return depth
