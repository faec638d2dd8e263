"""Kernels of the strip model: strips of a wheel fitted to its patches, and the strips of the solution.

Equations and sources: see `knothe_le_the`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.contact.geometry import NO_WHEEL
from wearsim.contact.kernel import bare_kernel
from wearsim.contact.normal.knothe_le_the.equations import UNKNOWN, Work, pair_up
from wearsim.contact.normal.knothe_le_the.refit import (
    APART,
    another_part,
    end_of,
    forget,
    forget_ends,
    refit,
    rotated,
)
from wearsim.contact.normal.knothe_le_the.solution import newton, relax
from wearsim.contact.normal.knothe_le_the.strips import (
    MARGIN,
    NO_ROOM,
    Records,
    Row,
    cut_strips,
    first_beyond,
    planes_of,
    share_points,
    value_at,
)
from wearsim.contact.normal.model import AT_EDGE, NO_BALANCE, NO_CONTACT, NOT_SINGLE
from wearsim.contact.patch import FloatArray, IntArray

_STAGES = 12  # of fitting the strips to the patch
_CLOSE = 0.1  # change of q, over the largest, from which Newton's method takes over
# Changes in Newton's method, over the largest: after the first it is seen whether the strips fit at all,
# after the second whether they still do, after the third the next one is rounding.
_FIRST, _ROUGH, _DONE = 3e-2, 3e-3, 1e-4
_LEFT = 3e-6  # change in Newton's method that is to be expected next, below which there is none
_HARD = 8  # stages, after which they do so each time
_FAR = 2.0  # widths of a strip, by which an end moved, from which lengths and pressures take turns first
_WIDEST = 0.65e-3  # m, of a strip: profiles change their radius within wide patches


@bare_kernel
def _is_inside(row: Row) -> bool:
    """Whether the lowest gap lies within both profiles."""
    k = 0
    for i in range(row.gap.size):
        if row.gap[i] < row.gap[k]:
            k = i
    return 3 <= k <= row.gap.size - 4 and row.gap[k - 1] < NO_WHEEL and row.gap[k + 1] < NO_WHEEL


@bare_kernel
def _room(row: Row) -> tuple[float, float]:
    """Find between which places strips can be laid: a wheel over them, neighbours for slopes [m]."""
    first, last = 0, row.gap.size - 1
    while row.gap[first] >= NO_WHEEL:
        first += 1
    while row.gap[last] >= NO_WHEEL:
        last -= 1
    k, n = max(first + 1, 2), min(last - 1, row.gap.size - 3)
    return 0.5 * (row.y[k] + row.y[k + 1]), 0.5 * (row.y[n - 1] + row.y[n])


@bare_kernel
def _lay_parts(stage: int, count: int, parts: int, old_total: int, row: Row, work: Work) -> tuple[int, int]:
    """Lay strips in every part, with the pressures of the set before; a fault or 0, and their number."""
    strips, old, spans, planes = work.strips, work.old, work.spans, work.planes
    total = old_total - old_total
    for k in range(parts):
        # As many as before if that is nearly right: else the ends might wander to and fro.
        wished = (spans[k].ends[1] - spans[k].ends[0]) / _WIDEST
        each = int(spans[k].strips) if abs(wished - spans[k].strips - 0.5) < 0.8 else int(wished)
        each = max(count, min(2 * count, each))
        if stage == 0:
            each = (3 * each) // 5
        else:
            spans[k].strips = each
        longest = 0.0
        for j in range(old_total):
            if spans[k].ends[0] <= old[j].y <= spans[k].ends[1]:
                longest = max(longest, old[j].square)
        if longest > 0.0:  # strips much narrower than long make Newton's method fail
            each = min(each, max(8, int(100.0 * (spans[k].ends[1] - spans[k].ends[0]) / np.sqrt(longest))))
        if total + each > strips.size:
            return NO_ROOM, total
        a, b = spans[k].ends[0], spans[k].ends[1]
        # Middle and angle of the plane: of the pressures, at first of the depths.
        weight, moment, tilt = 0.0, 0.0, 0.0
        known = planes[k].weight > 0.0
        middle, delta = planes[k].middle, planes[k].tilt
        if not known:
            i = max(first_beyond(row.y, row.y.size, a), 1)
            while i < row.y.size - 1 and row.y[i] < b:
                g = max(spans[k].rim - (row.gap[i] - row.low), 1e-12) * (row.y[i + 1] - row.y[i - 1])
                weight += g
                moment += g * row.y[i]
                tilt += g * row.angle[i]
                i += 1
            if weight == 0.0:
                return NO_BALANCE, total
            middle, delta = moment / weight, tilt / weight
        if not cut_strips(a, b, middle, delta, row, strips, total, each):
            return AT_EDGE, total
        for j in range(total, total + each):
            strips[j].part = k
            if known:
                # Linear between strips with pressure and the ends.
                y = strips[j].y
                i = first_beyond(old.y, old_total, y)
                left, left_p, left_q = a + MARGIN * (b - a) / each, 0.0, 0.0
                right_end, right_p, right_q = b - MARGIN * (b - a) / each, 0.0, 0.0
                if i > 0 and (old[i - 1].y > left or y <= left):
                    left, left_p, left_q = old[i - 1].y, old[i - 1].load, old[i - 1].square
                if i < old_total and (old[i].y < right_end or y >= right_end):
                    right_end, right_p, right_q = old[i].y, old[i].load, old[i].square
                share = (y - left) / (right_end - left)
                strips[j].load = left_p + share * (right_p - left_p)
                strips[j].square = left_q + share * (right_q - left_q)
                if not (0.0 < share < 1.0 and strips[j].load > 0.0 and strips[j].square > 0.0):
                    strips[j].load, strips[j].square = 0.0, 0.0
            else:
                depth = spans[k].rim - strips[j].gap / strips[j].turn
                q = max(depth, 0.02 * spans[k].rim) * spans[k].per_depth
                strips[j].square, strips[j].load = q, q * spans[k].per_square
        total += each
    return 0, total


_SMALLEST = 5e-4  # of the load: patches below are left out
_FINE = 160  # samples of the largest pressure


@bare_kernel
def _find_patches(
    total: int, displacement: float, load: float, modulus: float, row: Row, strips: Records, patches: Records,
    nodes: FloatArray,
) -> tuple[int, int]:  # fmt: skip
    """Find the patches of a wheel, by falling normal force; return a fault or 0, and their number."""
    # Runs of strips with pressure are patches.
    runs, j, carried = 0, 0, 0.0
    while j < total:
        if strips[j].load <= 0.0:
            j += 1
            continue
        first, force = j, 0.0
        while j < total and strips[j].load > 0.0 and strips[j].part == strips[first].part:
            force += 0.5 * np.pi * np.pi * modulus * strips[j].load * strips[j].width
            j += 1
        if force > _SMALLEST * load:
            carried += force * (strips[first].cosine if row.vertical else 1.0)
            place = runs
            runs += 1
            if runs > patches.size:
                return NO_ROOM, runs
            while place > 0 and patches[place - 1].force < force:
                patches[place] = patches[place - 1]
                place -= 1
            one = patches[place]
            one.force, one.first, one.last = force, first, j - 1
    if runs > 1 and not row.vertical:
        return NOT_SINGLE, runs
    for rank in range(runs):
        one = patches[rank]
        x, f, c = nodes[0, rank], nodes[1, rank], nodes[2, rank]
        a, b = one.first, one.last
        n = b - a + 1
        width = strips[a].width
        one.scale = load / carried
        one.force *= one.scale
        one.displacement = displacement
        one.angle, one.origin = strips[a].angle, strips[a].origin
        for step in range(1, -2, -2):
            edge = a if step > 0 else b
            end = strips[edge].s + step * width * (end_of(strips, edge, step, n) - 0.5)
            if step > 0:
                one.start = end
            else:
                one.stop = end
        weighted, sum_load = 0.0, 0.0
        one.nodes = 1
        x[0], f[0] = one.start, 0.0
        for j in range(a, b + 1):
            weighted += strips[j].load * strips[j].tilt
            sum_load += strips[j].load
            # The outermost strips may lie in part outside of the patch.
            if n > 2 and j in (a, b):
                continue
            x[one.nodes], f[one.nodes] = strips[j].s, strips[j].square
            c[one.nodes] = strips[j].load / strips[j].square
            one.nodes += 1
        x[one.nodes], f[one.nodes] = one.stop, 0.0
        c[0], c[one.nodes] = c[1], c[one.nodes - 1]
        one.nodes += 1
        one.own = weighted / sum_load
    return 0, runs


class Start(NamedTuple):
    """Patches of a solution nearby, by row and place: which are a row's, their strips and displacement."""

    first: IntArray
    strips: IntArray
    edge: FloatArray
    square: FloatArray
    load: FloatArray
    displacement: FloatArray


@bare_kernel
def _take_over(n: int, start: Start, count: int, row: Row, work: Work) -> tuple[int, int]:
    """Parts of the profile and strips with pressure of a solution nearby; return the numbers of both."""
    spans, old = work.spans, work.old
    parts = total = n - n
    for m in range(start.first[n], start.first[n + 1]):
        edge, strips = start.edge[m], start.strips[m]
        margin = MARGIN / (count - 2.0 * MARGIN) * (edge[strips] - edge[0])
        spans[parts].ends[0], spans[parts].ends[1] = edge[0] - margin, edge[strips] + margin
        forget(spans[parts])
        for j in range(strips):
            old[total].y, old[total].width = 0.5 * (edge[j] + edge[j + 1]), edge[j + 1] - edge[j]
            old[total].load, old[total].square = start.load[m, j], start.square[m, j]
            old[total].tilt = value_at(old[total].y, row.y, row.angle)
            total += 1
        parts += 1
    return parts, total


@bare_kernel
def solve_wheels(
    rows: IntArray, load: FloatArray, start: Start, vertical: bool, modulus: float,
    count: int, profile: tuple[FloatArray, FloatArray, FloatArray, FloatArray], gaps: FloatArray,
    lowest: FloatArray, radii: FloatArray, alongs: FloatArray, kappa: float, table: FloatArray,
    work: Work, number: IntArray, fault: IntArray, patches: Records, nodes: FloatArray,
) -> None:  # fmt: skip
    """Solve every row from its `start` and find its patches, by falling normal force.

    `nodes` (3, n, most, k) get place s, squared half-length and pressure slope between which the patch is
    interpolated.
    """
    strips, old, before, spans, fresh = work.strips, work.old, work.before, work.spans, work.fresh
    none = int(np.int64(0))  # numba would compile the kernels for a literal 0 once more
    for n in range(load.size):
        r = rows[n]
        if lowest[r] >= NO_WHEEL:
            fault[r] = NO_CONTACT
            continue
        row = Row(
            profile[0], profile[1], profile[2], profile[3], gaps[r], radii[r], alongs[r], lowest[r], kappa,
            load[n] / (np.pi * modulus), vertical,
        )  # fmt: skip
        if not _is_inside(row):
            fault[r] = AT_EDGE
            continue
        parts, old_total = _take_over(n, start, count, row, work)
        if parts == 0:
            fault[r] = NO_BALANCE
            continue
        left, right = _room(row)
        displacement = start.displacement[start.first[n]] - row.low
        total = failed = none
        uncertain, may_split, alone, splits = False, True, False, 0
        again = cut = False
        work.made_for[0] = 0
        for stage in range(_STAGES):
            # Parts that meet are one.
            k = 0
            while k + 1 < parts:
                if spans[k + 1].ends[0] - spans[k].ends[1] < APART:
                    may_split = may_split and splits == 0
                    spans[k].ends[1] = max(spans[k + 1].ends[1], spans[k].ends[1])
                    forget(spans[k])
                    for other in range(k + 1, parts - 1):
                        spans[other] = spans[other + 1]
                    parts -= 1
                else:
                    k += 1
            # trial ends may lie beyond the profile: whether the patch itself does is seen when it is settled
            cut = cut or spans[0].ends[0] < left or spans[parts - 1].ends[1] > right
            spans[0].ends[0] = max(spans[0].ends[0], left)
            spans[parts - 1].ends[1] = min(spans[parts - 1].ends[1], right)
            planes_of(spans, parts, old, old_total, row, work.share, work.planes)
            failed, total = _lay_parts(stage, count, parts, old_total, row, work)
            if failed != 0:
                break
            pair_up(work, total)
            if parts > 1 or not alone:
                work.base[:] = UNKNOWN
            alone = parts == 1
            for j in range(total):
                strips[j].square = max(strips[j].square, 1e-10)
            if stage == 0 or uncertain or stage >= _HARD:
                displacement, done = relax(work, row, total, displacement, table, _CLOSE)
                if not done:
                    failed = NO_BALANCE
                    break
            again, uncertain, kept, more = True, False, parts, none
            for tolerance in (_FIRST if stage == 1 else _ROUGH, _DONE):
                if stage > 0:
                    kept_displacement = displacement
                    for j in range(total):
                        before[j].load, before[j].square = strips[j].load, strips[j].square
                    displacement, done = newton(work, row, total, displacement, table, tolerance)
                    if not done:
                        for j in range(total):
                            strips[j].load, strips[j].square = before[j].load, before[j].square
                        work.made_for[0], work.left[0] = 0, 1.0
                        displacement, done = relax(
                            work, row, total, kept_displacement, table, 0.1 * tolerance
                        )
                    if not done:
                        failed = NO_BALANCE
                    if not done:
                        break
                old_total = none
                for j in range(total):
                    if strips[j].load > 0.0:
                        strips[j].log = 0.5 * np.log(strips[j].square)
                        old[old_total].y, old[old_total].load = strips[j].y, strips[j].load
                        old[old_total].square, old[old_total].width = strips[j].square, strips[j].width
                        old[old_total].tilt = strips[j].tilt
                        old_total += 1
                kept, more, again = refit(
                    stage, displacement, count, parts, may_split, row, work, total, table
                )
                if kept > spans.size:
                    failed = NO_ROOM
                    break
                if not again:
                    again = rotated(kept, old_total, total, row, work)
                if (again and stage < _STAGES - 1) or (stage > 0 and work.left[0] < _LEFT):
                    break
            if failed != 0:
                break
            parts = kept
            splits += more
            uncertain = more > 0
            for k in range(parts):
                for side in range(2):
                    moved = abs(fresh[k].ends[side] - spans[k].ends[side]) / (
                        fresh[k].ends[1] - fresh[k].ends[0]
                    )
                    uncertain = uncertain or (stage == 0 and moved * count > _FAR)
                spans[k] = fresh[k]
            if (stage == 1 or not again) and another_part(displacement, parts, row, work, total, table):
                if parts == spans.size:
                    failed = NO_ROOM
                    break
                parts += 1
                again = uncertain = True
                for k in range(spans.size):
                    forget_ends(spans[k])
            if not again:
                break
        if failed == 0 and cut and (again or spans[0].ends[0] < left or spans[parts - 1].ends[1] > right):
            failed = AT_EDGE
        if failed == 0:
            failed, number[n] = _find_patches(
                total, displacement, load[n], modulus, row, strips, patches[n], nodes[:, n]
            )
        fault[r] = failed


@bare_kernel
def _slopes(x: FloatArray, f: FloatArray, n: int, slope: FloatArray) -> None:
    """Take derivatives at nodes of the parabolas through each and its neighbours."""
    for k in range(1, n - 1):
        before, after = x[k] - x[k - 1], x[k + 1] - x[k]
        left, right = (f[k] - f[k - 1]) / before, (f[k + 1] - f[k]) / after
        slope[k] = (left * after + right * before) / (before + after)
    slope[0] = 2.0 * (f[1] - f[0]) / (x[1] - x[0]) - slope[1]
    slope[n - 1] = 2.0 * (f[n - 1] - f[n - 2]) / (x[n - 1] - x[n - 2]) - slope[n - 2]


@bare_kernel
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


class Cut(NamedTuple):
    """Strips of equal width: centres, half-lengths, middles, pressure slopes; edges on the profile."""

    y: FloatArray
    half: FloatArray
    middle: FloatArray
    slope: FloatArray
    edge: FloatArray


@bare_kernel
def cut_patches(
    rows: IntArray, places: IntArray, ranks: IntArray, counts: IntArray, patches: Records, nodes: FloatArray,
    profile: tuple[FloatArray, FloatArray, FloatArray, FloatArray], gaps: FloatArray, lowest: FloatArray,
    alongs: FloatArray, tilt: FloatArray, share: FloatArray, out: Cut,
) -> None:  # fmt: skip
    """Cut patches, by row, into strips of equal width; what lies behind the strips of a patch is padding."""
    grid_y, grid_z = profile[0], profile[1]
    for m in range(rows.size):
        one, strips = patches[m], counts[m]
        gap, along, low = gaps[rows[m]], alongs[rows[m]], lowest[rows[m]]
        x, f, c = nodes[0, places[m], ranks[m]], nodes[1, places[m], ranks[m]], nodes[2, places[m], ranks[m]]
        left, right, last = one.start, one.stop, one.nodes - 2
        _slopes(x, f, one.nodes, tilt)
        top = 0.0
        for k in range(one.nodes):
            top = max(top, f[k])
        # The largest pressure on a fine grid of its own.
        k, total, peak = 0, 0.0, 0.0
        for j in range(_FINE):
            s = left + (right - left) * (j + 0.5) / _FINE
            while k < last and x[k + 1] < s:
                k += 1
            q, ratio = _between(x, f, tilt, c, k, s)
            q = max(q, 1e-9 * top)
            total += q * ratio
            peak = max(peak, ratio * np.sqrt(q))
        one.pressure = peak * one.force / (0.5 * np.pi * total * (right - left) / _FINE)
        # Strips of the solution, along the profile.
        cosine, sine = np.cos(one.angle), np.sin(one.angle)
        i = first_beyond(grid_y, grid_y.size, one.origin) - 1
        to_origin = (one.origin - grid_y[i]) / (grid_y[i + 1] - grid_y[i])
        base = grid_z[i] + to_origin * (grid_z[i + 1] - grid_z[i])
        s_here = (grid_y[i] - one.origin) * cosine + (grid_z[i] - base) * sine
        while s_here > left and i > 0:
            i -= 1
            s_here = (grid_y[i] - one.origin) * cosine + (grid_z[i] - base) * sine
        s_next = (grid_y[i + 1] - one.origin) * cosine + (grid_z[i + 1] - base) * sine
        step = (right - left) / strips
        k, volume, moment, lowest_here = 0, 0.0, 0.0, NO_WHEEL
        for n in range(2 * strips + 1):
            s, j = left + 0.5 * n * step, n // 2
            while s > s_next and i < gap.size - 3:
                i += 1
                s_here = s_next
                s_next = (grid_y[i + 1] - one.origin) * cosine + (grid_z[i + 1] - base) * sine
                if s_here >= left:
                    lowest_here = min(lowest_here, gap[i])
            part = (s - s_here) / (s_next - s_here)
            if n % 2 == 0:
                out.edge[m, j] = grid_y[i] + part * (grid_y[i + 1] - grid_y[i])
                lowest_here = min(lowest_here, gap[i] + part * (gap[i + 1] - gap[i]))
                continue
            while k < last and x[k + 1] < s:
                k += 1
            q, ratio = _between(x, f, tilt, c, k, s)
            q = max(q, 1e-9 * top)
            out.y[m, j] = s
            out.half[m, j] = np.sqrt(q)
            out.middle[m, j] = along[i] + part * (along[i + 1] - along[i])
            out.slope[m, j] = ratio
            volume += q * ratio * step
            moment += q * ratio * step * s
        middle = moment / volume
        place = (middle - left) / step
        k = min(max(int(place), 0), strips - 1)
        one.centre = out.edge[m, k] + (place - k) * (out.edge[m, k + 1] - out.edge[m, k])
        k = max(min(max(int(place - 0.5), 0), strips - 2), 0)
        after = min(k + 1, strips - 1)
        middle_x = out.middle[m, k] + (place - 0.5 - k) * (out.middle[m, after] - out.middle[m, k])
        for j in range(strips):
            out.y[m, j] -= middle
            out.slope[m, j] *= one.force / (0.5 * np.pi * volume)
            out.middle[m, j] -= middle_x
        for j in range(strips, out.y.shape[1]):
            out.y[m, j], out.half[m, j] = out.y[m, strips - 1], 0.0
            out.middle[m, j], out.slope[m, j] = out.middle[m, strips - 1], out.slope[m, strips - 1]
            out.edge[m, j + 1] = out.edge[m, strips]
        one.approach = (one.displacement - (lowest_here - low)) * cosine
        one.left, one.right = out.edge[m, 0], out.edge[m, strips]
        if m + 1 == rows.size or rows[m + 1] != rows[m]:
            share_points(m - ranks[m], m + 1, one.displacement, profile, along, share, patches)
