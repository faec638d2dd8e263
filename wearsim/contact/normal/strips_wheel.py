"""Kernel of the strip model: the strips of a wheel, laid until they fit the patch.

Equations and sources: see `knothe_le_the`.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.geometry import NO_WHEEL
from wearsim.contact.kernel import kernel
from wearsim.contact.normal.refusal import AT_EDGE, NO_BALANCE, NO_TOUCH
from wearsim.contact.normal.strips_equations import pair_up
from wearsim.contact.normal.strips_laid import (
    GAP,
    LOAD,
    LOG,
    MARGIN,
    OUTER,
    SQUARE,
    STRIPS,
    TURN,
    WIDTH,
    Y,
    lay,
)
from wearsim.contact.normal.strips_planes import MIDDLE, PLANE, TILT, WEIGHT, planes_of
from wearsim.contact.normal.strips_refit import APART, another_part, refit, turned
from wearsim.contact.normal.strips_solution import newton, relax
from wearsim.contact.normal.strips_start import first_descent
from wearsim.contact.patch import FloatArray, IntArray

_STAGES = 12  # of fitting the strips to the patch
_CLOSE = 0.1  # change of q, over the largest, from which Newton's method takes over
# Changes in Newton's method, over the largest: after the first it is seen whether the strips fit at all,
# after the second whether they still do, after the third the next one is rounding.
_FIRST, _ROUGH, _DONE = 3e-2, 3e-3, 1e-4
_HARD = 8  # stages, after which they do so each time
_FAR = 0.5  # widths of a strip, by which an end moved, from which lengths and pressures take turns first
_WIDEST = 0.65e-3  # m, of a strip: profiles change their radius within wide patches


@kernel
def solve_wheel(
    load: float,
    vertical: bool,
    count: int,
    grid_y: FloatArray,
    grid_z: FloatArray,
    slope: FloatArray,
    angle: FloatArray,
    gap: FloatArray,
    radius: FloatArray,
    kappa: float,
    coarse: int,
    influence: FloatArray,
    hertz: FloatArray,
    strips: FloatArray,
    lobe: IntArray,
    spans: FloatArray,
    info: FloatArray,
) -> int:
    """Find the strips of one wheel under a load (over pi E*); return a fault or 0.

    `strips` (fields, most strips) and `lobe` (number of the part of the profile each belongs to) get the
    strips; `info` the number of strips, the descent from first touch, the lowest gap, stages, sweeps, steps.
    """
    low = gap.min()
    if low >= NO_WHEEL:
        return NO_TOUCH
    k = int(gap.argmin())
    if k < 3 or k > gap.size - 4 or gap[k - 1] >= NO_WHEEL or gap[k + 1] >= NO_WHEEL:
        return AT_EDGE
    descent, found = first_descent(
        load, low, vertical, grid_y, grid_z, angle, gap, radius, kappa, hertz, spans
    )
    if found == 0:
        return NO_BALANCE
    spans[:, STRIPS:] = 0.0
    most = strips.shape[1]
    old = np.empty((4, most))
    old_total = 0
    pairs = np.empty((3, most, most))
    near, far = np.empty((most, most)), np.empty((most, most))
    matrix, right = np.empty((2 * most + 1, 2 * most + 1)), np.empty(2 * most + 1)
    plain_matrix = np.empty((most + 1, most + 1))
    active = np.empty(most, np.int64)
    before = np.empty((2, most))
    fresh = np.empty_like(spans)
    planes = np.empty((spans.shape[0], PLANE))
    uncertain = False
    made_for, scale = np.zeros(most + 1, np.int64), np.empty(3)
    may_split, splits = True, 0
    for stage in range(_STAGES):
        # Parts that meet are one.
        k = 0
        while k + 1 < found:
            if spans[k + 1, 0] - spans[k, 1] < APART:
                may_split = may_split and splits == 0
                spans[k, 1] = max(spans[k + 1, 1], spans[k, 1])
                spans[k, STRIPS:] = 0.0
                for other in range(k + 1, found - 1):
                    spans[other] = spans[other + 1]
                found -= 1
            else:
                k += 1
        planes_of(spans, found, old, old_total, grid_y, grid_z, angle, planes)
        total = int(np.int64(0))  # numba would compile the kernels for a literal 0 once more
        for k in range(found):
            # Strips much narrower than long make Newton's method fail.
            each = coarse if stage == 0 else count
            if stage > 0:
                # As many as before if that is nearly right: else the ends might wander to and fro.
                wished = (spans[k, 1] - spans[k, 0]) / _WIDEST
                each = int(spans[k, STRIPS]) if abs(wished - spans[k, STRIPS] - 0.5) < 0.8 else int(wished)
                each = max(count, min(2 * count, each))
                spans[k, STRIPS] = each
            longest = 0.0
            for j in range(old_total):
                if spans[k, 0] <= old[0, j] <= spans[k, 1]:
                    longest = max(longest, old[2, j])
            if longest > 0.0:
                each = min(each, max(8, int(100.0 * (spans[k, 1] - spans[k, 0]) / np.sqrt(longest))))
            if total + each > most:
                return NO_BALANCE
            a, b = spans[k, 0], spans[k, 1]
            # Middle and angle of the plane: of the pressures, at first of the depths.
            weight, moment, tilt = 0.0, 0.0, 0.0
            known = planes[k, WEIGHT] > 0.0
            middle, delta = planes[k, MIDDLE], planes[k, TILT]
            if not known:
                i = max(np.searchsorted(grid_y, a), 1)
                while i < grid_y.size - 1 and grid_y[i] < b:
                    g = max(spans[k, 3] - (gap[i] - low), 1e-12) * (grid_y[i + 1] - grid_y[i - 1])
                    weight += g
                    moment += g * grid_y[i]
                    tilt += g * angle[i]
                    i += 1
                if weight == 0.0:
                    return NO_BALANCE
                middle, delta = moment / weight, tilt / weight
            if not lay(
                a, b, middle, delta, low, grid_y, grid_z, slope, gap, radius, kappa, strips, total, each
            ):
                return AT_EDGE
            for j in range(total, total + each):
                lobe[j] = k
                if known:
                    # Linear between strips with pressure and the ends.
                    y = strips[Y, j]
                    i = int(np.searchsorted(old[0, :old_total], y))
                    left, left_p, left_q = a + MARGIN * (b - a) / each, 0.0, 0.0
                    right_end, right_p, right_q = b - MARGIN * (b - a) / each, 0.0, 0.0
                    if i > 0 and (old[0, i - 1] > left or y <= left):
                        left, left_p, left_q = old[0, i - 1], old[1, i - 1], old[2, i - 1]
                    if i < old_total and (old[0, i] < right_end or y >= right_end):
                        right_end, right_p, right_q = old[0, i], old[1, i], old[2, i]
                    share = (y - left) / (right_end - left)
                    strips[LOAD, j] = left_p + share * (right_p - left_p)
                    strips[SQUARE, j] = left_q + share * (right_q - left_q)
                    if not (0.0 < share < 1.0 and strips[LOAD, j] > 0.0 and strips[SQUARE, j] > 0.0):
                        strips[LOAD, j], strips[SQUARE, j] = 0.0, 0.0
                else:
                    depth = spans[k, 3] - strips[GAP, j] / strips[TURN, j]
                    q = max(depth, 0.02 * spans[k, 3]) * spans[k, 2]
                    strips[SQUARE, j], strips[LOAD, j] = q, q * spans[k, 4]
            total += each
        pair_up(strips, lobe, total, pairs)
        for j in range(total):
            strips[SQUARE, j] = max(strips[SQUARE, j], 1e-10)
        if stage == 0 or uncertain or stage >= _HARD:
            descent, steps, done = relax(
                strips, lobe, total, descent, load, vertical, influence, _CLOSE, active, pairs, near, far,
                plain_matrix, right,
            )  # fmt: skip
            info[4] += steps
            if not done:
                return NO_BALANCE
        again, uncertain, kept, more = True, False, found, 0
        for tolerance in (_FIRST if stage == 1 else _ROUGH, _DONE):
            if stage > 0:
                kept_descent = descent
                for j in range(total):
                    before[0, j], before[1, j] = strips[LOAD, j], strips[SQUARE, j]
                descent, steps, done = newton(
                    strips, lobe, total, descent, load, vertical, influence, tolerance, active, pairs,
                    matrix, right, made_for, scale,
                )  # fmt: skip
                info[5] += steps
                if not done:
                    for j in range(total):
                        strips[LOAD, j], strips[SQUARE, j] = before[0, j], before[1, j]
                    made_for[0] = 0
                    descent, steps, done = relax(
                        strips, lobe, total, kept_descent, load, vertical, influence, 0.1 * tolerance, active,
                        pairs, near, far, plain_matrix, right,
                    )  # fmt: skip
                    info[4] += steps
                if not done:
                    return NO_BALANCE
            old_total = 0
            for j in range(total):
                if strips[LOAD, j] > 0.0:
                    strips[LOG, j] = 0.5 * np.log(strips[SQUARE, j])
                    old[0, old_total], old[1, old_total] = strips[Y, j], strips[LOAD, j]
                    old[2, old_total], old[3, old_total] = strips[SQUARE, j], strips[WIDTH, j]
                    old_total += 1
            kept, more, again = refit(
                stage, descent, low, count, found, may_split, grid_y, grid_z, angle, gap, strips, lobe,
                total, influence, spans, fresh,
            )  # fmt: skip
            if not again:
                again = turned(
                    fresh, kept, old, old_total, strips, lobe, total, grid_y, grid_z, angle, planes
                )
            if again and stage < _STAGES - 1:
                break
        info[0], info[1], info[2], info[3] = total, descent, low, stage
        found = kept
        splits += more
        uncertain = more > 0
        for k in range(found):
            for side in range(2):
                moved = abs(fresh[k, side] - spans[k, side]) / (fresh[k, 1] - fresh[k, 0])
                uncertain = uncertain or (stage == 0 and moved * count > _FAR)
            spans[k] = fresh[k]
        if (stage == 1 or not again) and another_part(
            descent, low, found, grid_y, grid_z, angle, gap, radius, strips, total, influence, spans
        ):
            found += 1
            again = uncertain = True
            spans[:, OUTER:] = 0.0
        if not again:
            return 0
    return 0
