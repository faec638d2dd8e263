"""Kernel of the strip model: all patches of a wheel, from the gap to pressures on fitted strips.

Equations and sources: see `knothe_le_the`.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.geometry import NO_WHEEL
from wearsim.contact.kernel import kernel
from wearsim.contact.normal.refusal import AT_EDGE, NO_BALANCE, NO_TOUCH
from wearsim.contact.normal.strips_laid import ANGLE, GAP, LOAD, SQUARE, TURN, WIDTH, Y, lay, separation
from wearsim.contact.normal.strips_solution import newton, overlap, relax
from wearsim.contact.normal.strips_start import first_descent
from wearsim.contact.patch import FloatArray, IntArray

_STAGES = 12  # of fitting the strips to the patch
_MARGIN = 0.3  # strips' widths laid beyond the end of the patch
_CLOSE = 0.1  # change of q, over the largest, from which Newton's method takes over
_DONE = 2e-5  # change in Newton's method, over the largest, after which the next one is rounding
_WIDEST = 0.65e-3  # m, of a strip: profiles change their radius within wide patches
_SETTLED = 0.03  # widths of a strip, by which the ends of a patch miss their place between the strips
_STILL = 1e-4  # rad, by which the plane of a part turns, at most, in the last stage
_GIVES_WAY = 0.25  # widths of a strip
_EAGER = 5  # stages, after which ends move half the way, so as not to go to and fro
_APART = 0.3e-3  # m, between parts of the profile that have strips of their own
_OVERLAP = 2e-3  # of the descent, that counts as contact


@kernel
def _covered(share: float) -> float:
    """Widths from the outer edge of the outermost strip to the end, from its q over its neighbour's.

    As if q fell linearly within the strip, less what makes it give way to the parabola of a smooth end: it
    counts where the patch is wide up to its end, which the parabola sees far outside.
    """
    end: float = 1.0 - _GIVES_WAY - share - np.sqrt(share * share + share)
    return end


@kernel
def end_of(strips: FloatArray, first: int, step: int, count: int) -> float:
    """Widths of a strip from the outer edge of strip `first` inwards to where the half-length is zero.

    A parabola through q of the strips behind the outermost one with pressure, which may lie in part outside.
    """
    k = 0
    while k < count and strips[LOAD, first + k * step] <= 0.0:
        k += 1
    n = 0
    while k + n < count and n < 4 and strips[LOAD, first + (k + n) * step] > 0.0:
        n += 1
    if n < 3:
        return float(k)
    one, two = strips[SQUARE, first + (k + 1) * step], strips[SQUARE, first + (k + 2) * step]
    rise, bend = two - one, 0.0
    if n > 3:
        bend = min(0.5 * (strips[SQUARE, first + (k + 3) * step] - 2.0 * two + one), 0.0)
    if rise <= 0.0:
        return k + min(max(_covered(strips[SQUARE, first + k * step] / one), -0.5), 1.0)
    tilt = rise - bend
    t = -2.0 * one / (tilt + np.sqrt(tilt * tilt - 4.0 * bend * one))
    covered = _covered(strips[SQUARE, first + k * step] / one)
    end: float = k + min(max(1.5 + t, covered, -0.5), 1.0)
    return end


@kernel
def _plane(
    left: float, right: float, old: FloatArray, total: int, grid_y: FloatArray, angle: FloatArray
) -> tuple[float, float, bool]:
    """Pressure-weighted place and angle of the strips between two places; whether there are any."""
    weight, moment, tilt = 0.0, 0.0, 0.0
    for j in range(total):
        if left <= old[0, j] <= right:
            i = min(max(np.searchsorted(grid_y, old[0, j]) - 1, 0), grid_y.size - 2)
            share = (old[0, j] - grid_y[i]) / (grid_y[i + 1] - grid_y[i])
            load = old[1, j] * old[3, j]
            weight += load
            moment += load * old[0, j]
            tilt += load * (angle[i] + share * (angle[i + 1] - angle[i]))
    if weight > 0.0:
        return moment / weight, tilt / weight, True
    return 0.0, 0.0, False


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
    most = strips.shape[1]
    old = np.empty((4, most))
    old_total = 0
    edges = np.empty((3, most, most))
    near, far = np.empty((most, most)), np.empty((most, most))
    matrix, right = np.empty((2 * most + 1, 2 * most + 1)), np.empty(2 * most + 1)
    active = np.empty(most, np.int64)
    before = np.empty((2, most))
    fresh = np.empty_like(spans)
    may_split, splits = True, 0
    for stage in range(_STAGES):
        # Parts that meet are one.
        k = 0
        while k + 1 < found:
            if spans[k + 1, 0] - spans[k, 1] < _APART:
                may_split = may_split and splits == 0
                spans[k, 1] = max(spans[k + 1, 1], spans[k, 1])
                for other in range(k + 1, found - 1):
                    spans[other] = spans[other + 1]
                found -= 1
            else:
                k += 1
        total = int(np.int64(0))  # numba would compile the kernels for a literal 0 once more
        for k in range(found):
            # Strips much narrower than long make Newton's method fail.
            each = coarse if stage == 0 else count
            if stage > 0:
                each = max(count, min(2 * count, int((spans[k, 1] - spans[k, 0]) / _WIDEST)))
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
            middle, delta, known = _plane(a, b, old, old_total, grid_y, angle)
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
                    i = int(np.searchsorted(old[0, :old_total], strips[Y, j]))
                    if 0 < i < old_total:
                        share = (strips[Y, j] - old[0, i - 1]) / (old[0, i] - old[0, i - 1])
                        strips[LOAD, j] = old[1, i - 1] + share * (old[1, i] - old[1, i - 1])
                        strips[SQUARE, j] = old[2, i - 1] + share * (old[2, i] - old[2, i - 1])
                    else:
                        i = 0 if i == 0 else old_total - 1
                        strips[LOAD, j], strips[SQUARE, j] = 0.3 * old[1, i], 0.3 * old[2, i]
                    if not (strips[LOAD, j] > 0.0 and strips[SQUARE, j] > 0.0):
                        strips[LOAD, j], strips[SQUARE, j] = 0.0, 0.0
                else:
                    depth = spans[k, 3] - strips[GAP, j] / strips[TURN, j]
                    q = max(depth, 0.02 * spans[k, 3]) * spans[k, 2]
                    strips[SQUARE, j], strips[LOAD, j] = q, q * spans[k, 4]
            total += each
        for i in range(total):
            for j in range(total):
                if i == j:
                    edges[0, i, j] = edges[1, i, j] = np.log(0.5 * strips[WIDTH, i])
                    edges[2, i, j] = 1.0
                else:
                    distance, fade = separation(strips, lobe, i, j)
                    half = 0.5 * strips[WIDTH, j]
                    edges[0, i, j] = np.log(max(distance - half, 0.1 * half))
                    edges[1, i, j] = np.log(distance + half)
                    edges[2, i, j] = fade
        for j in range(total):
            strips[SQUARE, j] = max(strips[SQUARE, j], 1e-10)
        descent, steps, done = relax(
            strips, lobe, total, descent, load, vertical, influence, _CLOSE, active, edges, near, far,
            matrix, right,
        )  # fmt: skip
        info[4] += steps
        if stage > 0:
            kept_descent = descent
            for j in range(total):
                before[0, j], before[1, j] = strips[LOAD, j], strips[SQUARE, j]
            descent, steps, done = newton(
                strips, lobe, total, descent, load, vertical, influence, _DONE, active, edges, matrix, right
            )
            info[5] += steps
            if not done:
                for j in range(total):
                    strips[LOAD, j], strips[SQUARE, j] = before[0, j], before[1, j]
                descent, steps, done = relax(
                    strips, lobe, total, kept_descent, load, vertical, influence, 1e-9, active, edges,
                    near, far, matrix, right,
                )  # fmt: skip
                info[4] += steps
        info[0], info[1], info[2], info[3] = total, descent, low, stage
        if not done:
            return NO_BALANCE
        # Ends to where the half-length becomes zero, or the surfaces overlap; parts without pressure leave.
        again = stage == 0
        kept, base = 0, 0
        for k in range(found):
            each = 0
            alive = False
            while base + each < total and lobe[base + each] == k:
                alive = alive or strips[LOAD, base + each] > 0.0
                each += 1
            if not alive:
                again = True
                base += each
                continue
            fresh[kept] = spans[k]
            for side in range(2):
                first, step = (base, 1) if side == 0 else (base + each - 1, -1)
                per = abs(strips[Y, first + step] - strips[Y, first])
                end = end_of(strips, first, step, each)
                move = end
                # Outwards as long as the surfaces overlap, from three quarters of a strip on.
                edge = spans[k, side] - 0.75 * step * per
                i = int(np.searchsorted(grid_y, edge)) - (1 if side == 0 else 0)
                skip = max(int(0.4 * per / (grid_y[i + 1] - grid_y[i])), 1) if 0 < i < gap.size - 2 else 1
                reached = False
                while 2 < i < gap.size - 3 and gap[i] < NO_WHEEL:
                    if (
                        overlap(i, descent, low, grid_y, grid_z, angle, gap, strips, total, influence)
                        < _OVERLAP
                    ):
                        break
                    reached = True
                    i -= step * skip
                if reached:
                    move = min(move, -abs(grid_y[i] - spans[k, side]) / per)
                wanted = _MARGIN * min(each / count, 1.0)
                move = max(move, -0.5 * each) - wanted
                again = again or abs(move) > _SETTLED
                fresh[kept, side] = spans[k, side] + step * per * (move if stage < _EAGER else 0.5 * move)
            # Two humps with strips without pressure between them get strips of their own, once.
            left, right_end = base, base + each - 1
            while strips[LOAD, left] <= 0.0:
                left += 1
            while strips[LOAD, right_end] <= 0.0:
                right_end -= 1
            a = left
            while a <= right_end and strips[LOAD, a] > 0.0:
                a += 1
            b = right_end
            while b >= left and strips[LOAD, b] > 0.0:
                b -= 1
            if a <= b and may_split and kept + found - k < spans.shape[0]:
                stop = strips[Y, a - 1] + 0.8 * (strips[Y, a] - strips[Y, a - 1])
                go = strips[Y, b + 1] - 0.8 * (strips[Y, b + 1] - strips[Y, b])
                if go - stop > _APART:
                    fresh[kept + 1] = fresh[kept]
                    fresh[kept, 1], fresh[kept + 1, 0] = stop, go
                    kept += 1
                    splits += 1
                    again = True
            kept += 1
            base += each
        found = kept
        for k in range(found):
            spans[k] = fresh[k]
        old_total = total
        for j in range(total):
            old[0, j], old[1, j], old[2, j], old[3, j] = (
                strips[Y, j], strips[LOAD, j], strips[SQUARE, j], strips[WIDTH, j],
            )  # fmt: skip
        base = 0
        while base < total and not again:
            _, turned, known = _plane(
                spans[lobe[base], 0], spans[lobe[base], 1], old, old_total, grid_y, angle
            )
            again = known and abs(turned - strips[ANGLE, base]) > _STILL
            k = lobe[base]
            while base < total and lobe[base] == k:
                base += 1
        # Parts that touch now, at most one more each time.
        i = int(np.int64(3))
        while stage > 0 and i < gap.size - 3 and found < spans.shape[0]:
            if gap[i] - low < descent:
                free = True
                for k in range(found):
                    if spans[k, 0] - 1e-3 < grid_y[i] < spans[k, 1] + 1e-3:
                        free = False
                if free:
                    deep = overlap(i, descent, low, grid_y, grid_z, angle, gap, strips, total, influence)
                    if deep > _OVERLAP:
                        a = i
                        while i < gap.size - 3 and gap[i] < NO_WHEEL and deep > 1e-3:
                            i += 2
                            deep = overlap(
                                i, descent, low, grid_y, grid_z, angle, gap, strips, total, influence
                            )
                        k = found
                        while k > 0 and spans[k - 1, 0] > grid_y[a]:
                            spans[k] = spans[k - 1]
                            k -= 1
                        spans[k, 0], spans[k, 1] = grid_y[a - 2], grid_y[i]
                        lowest = gap[a:i].min()
                        spans[k, 2] = 2.0 * radius[a]
                        spans[k, 3] = lowest - low + 0.5 * max(deep, 0.02) * descent
                        spans[k, 4] = 0.5 / (radius[a] * np.pi)
                        found += 1
                        again = True
                        break
            i += 3
        if not again:
            return 0
    return 0
