"""Kernels of the strip model: strips of a wheel fitted to its patches, and the strips of the solution.

Equations and sources: see `knothe_le_the`.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.geometry import NO_WHEEL
from wearsim.contact.kernel import kernel
from wearsim.contact.normal.knothe_le_the.equations import pair_up
from wearsim.contact.normal.knothe_le_the.refit import APART, another_part, end_of, refit, rotated
from wearsim.contact.normal.knothe_le_the.solution import newton, relax
from wearsim.contact.normal.knothe_le_the.strips import (
    ANGLE,
    COSINE,
    FIELDS,
    GAP,
    LOAD,
    LOBES,
    LOG,
    MARGIN,
    MIDDLE,
    ORIGIN,
    OUTER,
    PART,
    PLANE,
    SQUARE,
    STRIPS,
    TILT,
    TURN,
    WEIGHT,
    WIDTH,
    S,
    Y,
    cut_strips,
    first_displacement,
    planes_of,
    share_points,
    value_at,
)
from wearsim.contact.normal.model import AT_EDGE, MOST_PATCHES, NO_BALANCE, NO_CONTACT, NOT_SINGLE, TOO_MANY
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
    load: float, vertical: bool, count: int, grid_y: FloatArray, grid_z: FloatArray, slope: FloatArray,
    angle: FloatArray, gap: FloatArray, radius: FloatArray, kappa: float, coarse: int, influence: FloatArray,
    hertz: FloatArray, strips: FloatArray, lobe: IntArray, spans: FloatArray, info: FloatArray,
) -> int:  # fmt: skip
    """Find the strips of one wheel under a load (over pi E*); return a fault or 0.

    `strips` (fields, most strips) and `lobe` (number of the part of the profile each belongs to) get the
    strips; `info` the number of strips, the displacement from initial contact, the lowest gap, stages,
    sweeps, steps.
    """
    low = gap.min()
    if low >= NO_WHEEL:
        return NO_CONTACT
    k = int(gap.argmin())
    if k < 3 or k > gap.size - 4 or gap[k - 1] >= NO_WHEEL or gap[k + 1] >= NO_WHEEL:
        return AT_EDGE
    displacement, parts = first_displacement(
        load, low, vertical, grid_y, grid_z, angle, gap, radius, kappa, hertz, spans
    )
    if parts == 0:
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
        while k + 1 < parts:
            if spans[k + 1, 0] - spans[k, 1] < APART:
                may_split = may_split and splits == 0
                spans[k, 1] = max(spans[k + 1, 1], spans[k, 1])
                spans[k, STRIPS:] = 0.0
                for other in range(k + 1, parts - 1):
                    spans[other] = spans[other + 1]
                parts -= 1
            else:
                k += 1
        planes_of(spans, parts, old, old_total, grid_y, grid_z, angle, planes)
        total = int(np.int64(0))  # numba would compile the kernels for a literal 0 once more
        for k in range(parts):
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
            if not cut_strips(
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
            displacement, steps, done = relax(
                strips, lobe, total, displacement, load, vertical, influence, _CLOSE, active, pairs, near,
                far, plain_matrix, right,
            )  # fmt: skip
            info[4] += steps
            if not done:
                return NO_BALANCE
        again, uncertain, kept, more = True, False, parts, 0
        for tolerance in (_FIRST if stage == 1 else _ROUGH, _DONE):
            if stage > 0:
                kept_displacement = displacement
                for j in range(total):
                    before[0, j], before[1, j] = strips[LOAD, j], strips[SQUARE, j]
                displacement, steps, done = newton(
                    strips, lobe, total, displacement, load, vertical, influence, tolerance, active, pairs,
                    matrix, right, made_for, scale,
                )  # fmt: skip
                info[5] += steps
                if not done:
                    for j in range(total):
                        strips[LOAD, j], strips[SQUARE, j] = before[0, j], before[1, j]
                    made_for[0] = 0
                    displacement, steps, done = relax(
                        strips, lobe, total, kept_displacement, load, vertical, influence, 0.1 * tolerance,
                        active, pairs, near, far, plain_matrix, right,
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
                stage, displacement, low, count, parts, may_split, grid_y, grid_z, angle, gap, strips, lobe,
                total, influence, spans, fresh,
            )  # fmt: skip
            if not again:
                again = rotated(
                    fresh, kept, old, old_total, strips, lobe, total, grid_y, grid_z, angle, planes
                )
            if again and stage < _STAGES - 1:
                break
        info[0], info[1], info[2], info[3] = total, displacement, low, stage
        parts = kept
        splits += more
        uncertain = more > 0
        for k in range(parts):
            for side in range(2):
                moved = abs(fresh[k, side] - spans[k, side]) / (fresh[k, 1] - fresh[k, 0])
                uncertain = uncertain or (stage == 0 and moved * count > _FAR)
            spans[k] = fresh[k]
        if (stage == 1 or not again) and another_part(
            displacement, low, parts, grid_y, grid_z, angle, gap, radius, strips, total, influence, spans
        ):
            parts += 1
            again = uncertain = True
            spans[:, OUTER:] = 0.0
        if not again:
            return 0
    return 0


_SMALLEST = 5e-4  # of the load: patches below are left out
_FINE = 160  # samples of the largest pressure


@kernel
def _slopes(x: FloatArray, f: FloatArray, n: int, slope: FloatArray) -> None:
    """Take derivatives at nodes of the parabolas through each and its neighbours."""
    for k in range(1, n - 1):
        before, after = x[k] - x[k - 1], x[k + 1] - x[k]
        left, right = (f[k] - f[k - 1]) / before, (f[k + 1] - f[k]) / after
        slope[k] = (left * after + right * before) / (before + after)
    slope[0] = 2.0 * (f[1] - f[0]) / (x[1] - x[0]) - slope[1]
    slope[n - 1] = 2.0 * (f[n - 1] - f[n - 2]) / (x[n - 1] - x[n - 2]) - slope[n - 2]


@kernel
def _between(
    x: FloatArray, f: FloatArray, slope: FloatArray, c: FloatArray, k: int, at: float
) -> tuple[float, float]:
    """Squared half-length by a cubic and pressure slope linearly, `at` a place between nodes k and k + 1."""
    step = x[k + 1] - x[k]
    t = (at - x[k]) / step
    u = 1.0 - t
    rise = f[k + 1] - f[k]
    a, b = slope[k] * step - rise, rise - slope[k + 1] * step
    return f[k] + t * rise + t * u * (a * u + b * t), c[k] + t * (c[k + 1] - c[k])


@kernel
def solve_patches(
    load: FloatArray, vertical: bool, modulus: float, count: int, grid_y: FloatArray, grid_z: FloatArray,
    slope: FloatArray, angle: FloatArray, gaps: FloatArray, radii: FloatArray, alongs: FloatArray,
    kappa: float, influence: FloatArray, hertz: FloatArray, number: IntArray, fault: IntArray,
    out_y: FloatArray, out_half: FloatArray, out_skew: FloatArray, out_slope: FloatArray,
    out_edge: FloatArray, values: FloatArray,
) -> None:  # fmt: skip
    """Solve every row and lay its patches, by falling normal force.

    `values` (n, most, 13): centre y, angle of the plane, approach, normal force, largest pressure, load
    scale, displacement, width of the strips; place y from which the patch is seen, its angle for itself,
    approach at that place, and how far across and along its centre lies from there.
    """
    most = 4 * count
    strips, lobe = np.zeros((FIELDS, most)), np.zeros(most, np.int64)
    spans, info = np.zeros((LOBES, PART)), np.zeros(6)
    first, last = np.zeros(most, np.int64), np.zeros(most, np.int64)
    force, order = np.zeros(most), np.zeros(most, np.int64)
    x, f, c, tilt = (np.zeros(most + 2), np.zeros(most + 2), np.zeros(most + 2), np.zeros(most + 2))
    count_out = out_y.shape[2]
    for row in range(load.size):
        gap, along = gaps[row], alongs[row]
        info[:] = 0.0
        fault[row] = solve_wheel(
            load[row] / (np.pi * modulus), vertical, count, grid_y, grid_z, slope, angle, gap, radii[row],
            kappa, max(8, (3 * count) // 5), influence, hertz, strips, lobe, spans, info,
        )  # fmt: skip
        if fault[row] != 0:
            continue
        total, displacement, low = int(info[0]), info[1], info[2]
        # Runs of strips with pressure are patches.
        runs, j = 0, 0
        carried = 0.0
        while j < total:
            if strips[LOAD, j] <= 0.0:
                j += 1
                continue
            first[runs] = j
            force[runs] = 0.0
            while j < total and strips[LOAD, j] > 0.0 and lobe[j] == lobe[first[runs]]:
                force[runs] += 0.5 * np.pi * np.pi * modulus * strips[LOAD, j] * strips[WIDTH, j]
                j += 1
            last[runs] = j - 1
            if force[runs] > _SMALLEST * load[row]:
                carried += force[runs] * (strips[COSINE, first[runs]] if vertical else 1.0)
                runs += 1
        if runs > MOST_PATCHES:
            fault[row] = TOO_MANY
            continue
        if runs > 1 and not vertical:
            fault[row] = NOT_SINGLE
            continue
        scale = load[row] / carried
        number[row] = runs
        for k in range(runs):
            order[k] = k
        for k in range(1, runs):
            m = k
            while m > 0 and force[order[m]] > force[order[m - 1]]:
                swap = order[m]
                order[m] = order[m - 1]
                order[m - 1] = swap
                m -= 1
        for rank in range(runs):
            a, b = first[order[rank]], last[order[rank]]
            n = b - a + 1
            width = strips[WIDTH, a]
            left = strips[S, a] + width * (end_of(strips, a, 1, n) - 0.5)
            right = strips[S, b] - width * (end_of(strips, b, -1, n) - 0.5)
            nodes = 1
            x[0], f[0] = left, 0.0
            for j in range(a, b + 1):
                # The outermost strips may lie in part outside of the patch.
                if n > 2 and j in (a, b):
                    continue
                x[nodes], f[nodes] = strips[S, j], strips[SQUARE, j]
                c[nodes] = strips[LOAD, j] / strips[SQUARE, j]
                nodes += 1
            x[nodes], f[nodes] = right, 0.0
            c[0], c[nodes] = c[1], c[nodes - 1]
            nodes += 1
            _slopes(x, f, nodes, tilt)
            top = 0.0
            for k in range(nodes):
                top = max(top, f[k])
            # The largest pressure on a fine grid of its own.
            k, sum_fine, peak = 0, 0.0, 0.0
            for j in range(_FINE):
                s = left + (right - left) * (j + 0.5) / _FINE
                while k < nodes - 2 and x[k + 1] < s:
                    k += 1
                q, ratio = _between(x, f, tilt, c, k, s)
                q = max(q, 1e-9 * top)
                sum_fine += q * ratio
                peak = max(peak, ratio * np.sqrt(q))
            normal = force[order[rank]] * scale
            peak *= normal / (0.5 * np.pi * sum_fine * (right - left) / _FINE)
            # Strips of the solution, along the profile.
            delta, origin = strips[ANGLE, a], strips[ORIGIN, a]
            cosine, sine = np.cos(delta), np.sin(delta)
            i = np.searchsorted(grid_y, origin) - 1
            share = (origin - grid_y[i]) / (grid_y[i + 1] - grid_y[i])
            base = grid_z[i] + share * (grid_z[i + 1] - grid_z[i])
            base_x = along[i] + share * (along[i + 1] - along[i])
            i = max(i - int(2.0 * (abs(left) + 1e-3) / (grid_y[i + 1] - grid_y[i])), 0)
            s_here = (grid_y[i] - origin) * cosine + (grid_z[i] - base) * sine
            while s_here > left and i > 0:
                i -= 1
                s_here = (grid_y[i] - origin) * cosine + (grid_z[i] - base) * sine
            s_next = (grid_y[i + 1] - origin) * cosine + (grid_z[i + 1] - base) * sine
            step = (right - left) / count_out
            k, volume, moment, lowest = 0, 0.0, 0.0, NO_WHEEL
            for j in range(2 * count_out + 1):
                s = left + 0.5 * j * step
                while s > s_next and i < gap.size - 3:
                    i += 1
                    s_here = s_next
                    s_next = (grid_y[i + 1] - origin) * cosine + (grid_z[i + 1] - base) * sine
                    if s_here >= left:
                        lowest = min(lowest, gap[i])
                share = (s - s_here) / (s_next - s_here)
                if j % 2 == 0:
                    out_edge[row, rank, j // 2] = grid_y[i] + share * (grid_y[i + 1] - grid_y[i])
                    lowest = min(lowest, gap[i] + share * (gap[i + 1] - gap[i]))
                    continue
                while k < nodes - 2 and x[k + 1] < s:
                    k += 1
                q, ratio = _between(x, f, tilt, c, k, s)
                q = max(q, 1e-9 * top)
                out_y[row, rank, j // 2] = s
                out_half[row, rank, j // 2] = np.sqrt(q)
                out_skew[row, rank, j // 2] = along[i] + share * (along[i + 1] - along[i]) - base_x
                out_slope[row, rank, j // 2] = ratio
                volume += q * ratio * step
                moment += q * ratio * step * s
            middle = moment / volume
            for j in range(count_out):
                out_y[row, rank, j] -= middle
                out_slope[row, rank, j] *= normal / (0.5 * np.pi * volume)
            k = min(max(int((middle - left) / step), 0), count_out - 1)
            share = (middle - left) / step - k
            centre = out_edge[row, rank, k] + share * (out_edge[row, rank, k + 1] - out_edge[row, rank, k])
            k = min(max(int((middle - left) / step - 0.5), 0), count_out - 2) if count_out > 1 else 0
            if count_out > 1:
                share = (middle - left) / step - 0.5 - k
                middle_x = out_skew[row, rank, k] + share * (
                    out_skew[row, rank, k + 1] - out_skew[row, rank, k]
                )
            else:
                middle_x = out_skew[row, rank, 0]
            for j in range(count_out):
                out_skew[row, rank, j] -= middle_x
            line = values[row, rank]
            line[0], line[1], line[2], line[3] = (
                centre,
                delta,
                (displacement - (lowest - low)) * cosine,
                normal,
            )
            line[4], line[5], line[6], line[7] = peak, scale, low + displacement, step
            weighted, total_load = 0.0, 0.0
            for j in range(a, b + 1):
                weighted += strips[LOAD, j] * value_at(strips[Y, j], grid_y, angle)
                total_load += strips[LOAD, j]
            line[9] = weighted / total_load
        share_points(runs, displacement, grid_y, grid_z, along, out_edge[row], values[row])
