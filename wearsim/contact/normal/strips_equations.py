"""Kernels of the strip model: what the strips do to each other, residuals and Jacobian of their equations.

Equations and sources: see `knothe_le_the`.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.kernel import kernel
from wearsim.contact.normal.strips_influence import averages, averages_and_slopes
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

# Layers of `pairs`: logarithms of the distance to the nearer and to the farther edge, the same for both of a
# pair (of strips of unlike width the mean is taken), and the share of the other strip that one feels.
NEARER, FARTHER, SHARE = range(3)


@kernel
def pair_up(strips: FloatArray, lobe: IntArray, total: int, pairs: FloatArray) -> None:
    """Distances of all strips from each other, and how far they feel each other."""
    i = 0
    while i < total:
        end = i
        while end < total and lobe[end] == lobe[i]:
            end += 1
        # Strips of one part are alike.
        width = strips[WIDTH, i]
        before = np.log(0.5 * width)
        for k in range(end - i):
            after = before if k == 0 else np.log((k + 0.5) * width)
            for j in range(i, end - k):
                pairs[NEARER, j, j + k] = pairs[NEARER, j + k, j] = before
                pairs[FARTHER, j, j + k] = pairs[FARTHER, j + k, j] = after
                pairs[SHARE, j, j + k] = pairs[SHARE, j + k, j] = 1.0
            before = after
        for j in range(i, end):
            for k in range(end, total):
                across, down = strips[Y, j] - strips[Y, k], strips[Z, j] - strips[Z, k]
                distance = np.sqrt(across * across + down * down)
                half = 0.25 * (strips[WIDTH, j] + strips[WIDTH, k])
                share = fade(strips[ANGLE, j] - strips[ANGLE, k], distance) * 0.5 / half
                pairs[NEARER, j, k] = pairs[NEARER, k, j] = np.log(max(distance - half, 0.1 * half))
                pairs[FARTHER, j, k] = pairs[FARTHER, k, j] = np.log(distance + half)
                pairs[SHARE, j, k], pairs[SHARE, k, j] = share * strips[WIDTH, k], share * strips[WIDTH, j]
        i = end


@kernel
def influences(
    strips: FloatArray, total: int, table: FloatArray, pairs: FloatArray, near: FloatArray, far: FloatArray
) -> None:
    """Both averages on every strip (row) per load of every strip (column)."""
    logs = np.empty(total)
    for i in range(total):
        logs[i] = 0.5 * np.log(strips[SQUARE, i])
    for i in range(total):
        a, b, _ = averages(table, 0.0, pairs[FARTHER, i, i] - logs[i])
        near[i, i], far[i, i] = 2.0 * a, 2.0 * b
        for j in range(i + 1, total):
            short, long = (i, j) if logs[i] < logs[j] else (j, i)
            log = logs[long]
            ratio = logs[short] - log
            a, b, c = averages(table, ratio, pairs[FARTHER, i, j] - log)
            d, e, f = averages(table, ratio, pairs[NEARER, i, j] - log)
            share, back = pairs[SHARE, short, long], pairs[SHARE, long, short]
            near[short, long], near[long, short] = share * (a - d), back * (a - d)
            far[short, long], far[long, short] = share * (b - e), back * (c - f)


@kernel
def inner_of(active: IntArray, lobe: IntArray, m: int, row: int) -> int:
    """Row of the one neighbour of a strip at the rim, or -1."""
    i = active[row]
    inner = -1
    if row + 1 < m and active[row + 1] == i + 1 and lobe[i + 1] == lobe[i]:
        inner = row + 1
    if row > 0 and active[row - 1] == i - 1 and lobe[i - 1] == lobe[i]:
        inner = -1 if inner >= 0 else row - 1
    return inner


@kernel
def residuals(
    strips: FloatArray,
    lobe: IntArray,
    descent: float,
    load: float,
    vertical: bool,
    table: FloatArray,
    pairs: FloatArray,
    active: IntArray,
    m: int,
    scale: FloatArray,
    with_matrix: bool,
    matrix: FloatArray,
    right: FloatArray,
    work: FloatArray,
) -> None:
    """Write what is left of the equations of the strips with pressure, and their Jacobian if wanted.

    Unknown are P and q of each and the descent, over `scale`. A strip at the rim takes the ratio P/q from
    its neighbour: alone it could shrink to a point where the surfaces still overlap.
    """
    n = 2 * m + 1
    per_p, per_q, per_descent = scale[0], scale[1], scale[2]
    logs, near, far, near_self, far_self = work[0], work[1], work[2], work[3], work[4]
    for row in range(m):
        logs[row] = 0.5 * np.log(strips[SQUARE, active[row]])
        near[row] = far[row] = near_self[row] = far_self[row] = 0.0
    for row in range(m):
        i = active[row]
        a, b, _, _, b_own, b_other = averages_and_slopes(table, 0.0, pairs[FARTHER, i, i] - logs[row])
        p = strips[LOAD, i]
        near[row] += 2.0 * a * p
        far[row] += 2.0 * b * p
        if with_matrix:
            by_q = 0.5 * p / strips[SQUARE, i] * per_q
            matrix[row, row] = 2.0 * a * per_p
            matrix[m + row, row] = 2.0 * (b - a) * per_p
            matrix[row, m + row] = 4.0 * (b - a) * by_q
            matrix[m + row, m + row] = 2.0 * (b_own + b_other - 2.0 * (b - a)) * by_q
        for column in range(row + 1, m):
            short, long = (row, column) if logs[row] < logs[column] else (column, row)
            log = logs[long]
            ratio = logs[short] - log
            i, j = active[short], active[long]
            share, back = pairs[SHARE, i, j], pairs[SHARE, j, i]
            own, other = strips[LOAD, i], strips[LOAD, j]
            if not with_matrix:
                a, b, c = averages(table, ratio, pairs[FARTHER, i, j] - log)
                d, e, f = averages(table, ratio, pairs[NEARER, i, j] - log)
                near[short] += share * (a - d) * other
                far[short] += share * (b - e) * other
                near[long] += back * (a - d) * own
                far[long] += back * (c - f) * own
                continue
            a, b, c, b_short, c_short, c_long = averages_and_slopes(table, ratio, pairs[FARTHER, i, j] - log)
            d, e, f, e_short, f_short, f_long = averages_and_slopes(table, ratio, pairs[NEARER, i, j] - log)
            a, b, c = a - d, b - e, c - f
            near[short] += share * a * other
            far[short] += share * b * other
            near[long] += back * a * own
            far[long] += back * c * own
            # M - N of either strip is the derivative of N by the logarithm of its half-length.
            b, c = b - a, c - a
            b_short, c_long = b_short - e_short - b, c_long - f_long - c
            both = c_short - f_short - b
            near_self[short] += share * b * other
            near_self[long] += back * c * own
            far_self[short] += share * b_short * other
            far_self[long] += back * c_long * own
            matrix[short, long], matrix[long, short] = share * a * per_p, back * a * per_p
            matrix[m + short, long], matrix[m + long, short] = share * b * per_p, back * c * per_p
            own, other = 0.5 * own / strips[SQUARE, i] * per_q, 0.5 * other / strips[SQUARE, j] * per_q
            matrix[short, m + long], matrix[long, m + short] = share * c * other, back * b * own
            matrix[m + short, m + long], matrix[m + long, m + short] = share * both * other, back * both * own
    carried = 0.0
    for row in range(m):
        i = active[row]
        q = strips[SQUARE, i]
        low_bow = bow_of(0.25 * q, strips[RADIUS, i], strips[SIGMA, i])
        high_bow = bow_of(0.75 * q, strips[RADIUS, i], strips[SIGMA, i])
        right[row] = -(near[row] + strips[GAP, i] + low_bow - descent * strips[TURN, i])
        right[m + row] = -(far[row] - near[row] + high_bow - low_bow)
        lift = 0.5 * np.pi * strips[WIDTH, i] * (strips[COSINE, i] if vertical else 1.0) / load
        carried += lift * strips[LOAD, i]
        if with_matrix:
            matrix[row, m + row] += (0.5 * near_self[row] + low_bow) / q * per_q
            matrix[m + row, m + row] += (0.5 * far_self[row] + high_bow - low_bow) / q * per_q
            matrix[row, n - 1] = -strips[TURN, i] * per_descent
            matrix[m + row, n - 1] = matrix[n - 1, m + row] = 0.0
            matrix[n - 1, row] = lift * per_p
        inner = inner_of(active, lobe, m, row)
        if inner >= 0:
            j = active[inner]
            p, other_p, other_q = strips[LOAD, i] / per_p, strips[LOAD, j] / per_p, strips[SQUARE, j] / per_q
            q /= per_q
            right[m + row] = q * other_p - p * other_q
            if with_matrix:
                matrix[m + row, :n] = 0.0
                matrix[m + row, row], matrix[m + row, inner] = other_q, -q
                matrix[m + row, m + row], matrix[m + row, m + inner] = -other_p, p
    right[n - 1] = 1.0 - carried
    if with_matrix:
        matrix[n - 1, n - 1] = 0.0
