"""Kernels of the strip model: strips of a wheel, fitted to its patches.

Equations and sources: see `knothe_le_the`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.contact.geometry import NO_WHEEL
from wearsim.contact.kernel import bare_kernel
from wearsim.contact.normal.knothe_le_the.equations import UNKNOWN, in_the_middle, pair_up
from wearsim.contact.normal.knothe_le_the.patches import Wheels, end_of, find_patches
from wearsim.contact.normal.knothe_le_the.solution import newton, relax
from wearsim.contact.normal.knothe_le_the.strips import (
    MARGIN,
    NO_ROOM,
    Record,
    Records,
    Row,
    Work,
    cut_strips,
    first_beyond,
    influence_share,
    planes_of,
    value_at,
)
from wearsim.contact.normal.model import AT_EDGE, NO_BALANCE, NO_CONTACT
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
_SETTLED = 0.03  # widths of a strip, by which the ends of a patch miss their place between the strips
_STILL = 1e-4  # rad, by which the plane of a part turns, at most, in the last stage
_SLOWEST, _FASTEST = 0.5, 6.0  # of what an end moves, by which it comes nearer to its place
_APART = 0.3e-3  # m, between parts of the profile that have strips of their own
_OVERLAP = 2e-3  # of the displacement, that counts as contact


class Start(NamedTuple):
    """Patches of a solution nearby, by row and place: which are a row's, their strips and displacement."""

    first: IntArray
    strips: IntArray
    edge: FloatArray
    square: FloatArray
    load: FloatArray
    displacement: FloatArray


@bare_kernel
def solve_wheels(
    wheels: Wheels, rows: IntArray, load: FloatArray, start: Start, modulus: float, count: int,
    table: FloatArray, work: Work, number: IntArray, fault: IntArray, patches: Records, nodes: FloatArray,
) -> None:  # fmt: skip
    """Solve every row from its `start` and find its patches, by falling normal force.

    `nodes` (3, n, most, k) get place s, squared half-length and pressure slope between which the patch is
    interpolated.
    """
    for n in range(rows.size):
        r = rows[n]
        row = Row(
            wheels.y, wheels.z, wheels.slope, wheels.angle, wheels.gap[r], wheels.radius[r],
            wheels.along[r], wheels.low[r], wheels.kappa, load[n] / (np.pi * modulus), wheels.vertical,
        )  # fmt: skip
        fault[r], total, displacement = _fit(n, row, start, count, table, work)
        if fault[r] == 0:
            fault[r], number[n] = find_patches(
                total, displacement, load[n], modulus, row, work.strips, patches[n], nodes[:, n]
            )


@bare_kernel
def _fit(n: int, row: Row, start: Start, count: int, table: FloatArray, work: Work) -> tuple[int, int, float]:
    """Fit strips to the patches of a wheel; a fault or 0, their number, and the displacement."""
    strips, before, spans, fresh = work.strips, work.before, work.spans, work.fresh
    if row.low >= NO_WHEEL:
        return NO_CONTACT, 0, 0.0
    left, right = _room(row)
    if left == right:
        return AT_EDGE, 0, 0.0
    parts, old_total = _take_over(n, start, count, row, work)
    if parts == 0:
        return NO_BALANCE, 0, 0.0
    displacement = start.displacement[start.first[n]] - row.low
    total = splits = parts - parts  # numba would compile the kernels for a literal 0 once more
    uncertain = alone = again = cut = False
    may_split = True
    work.made_for[0] = 0
    for stage in range(_STAGES):
        together = _joined(spans, parts)
        may_split = may_split and (together == parts or splits == 0)
        parts = together
        # trial ends may lie beyond the profile: whether the patch itself does is seen when it is settled
        cut = cut or spans[0].ends[0] < left or spans[parts - 1].ends[1] > right
        spans[0].ends[0] = max(spans[0].ends[0], left)
        spans[parts - 1].ends[1] = min(spans[parts - 1].ends[1], right)
        planes_of(spans, parts, old_total, row, work)
        failed, total = _lay_parts(stage, count, parts, old_total, row, work)
        if failed != 0:
            return failed, total, displacement
        pair_up(work, total)
        if parts > 1 or not alone:
            work.base[:] = UNKNOWN
        alone = parts == 1
        if stage == 0 or uncertain or stage >= _HARD:
            displacement, done = relax(work, row, total, displacement, table, _CLOSE)
            if not done:
                return NO_BALANCE, total, displacement
        kept, more = parts, total - total
        for tolerance in (_FIRST if stage == 1 else _ROUGH, _DONE):
            if stage > 0:
                kept_displacement = displacement
                _copy(strips, before, total)
                displacement, done = newton(work, row, total, displacement, table, tolerance)
                if not done:
                    _copy(before, strips, total)
                    work.made_for[0], work.states[0].left = 0, 1.0
                    displacement, done = relax(work, row, total, kept_displacement, table, 0.1 * tolerance)
                if not done:
                    return NO_BALANCE, total, displacement
            old_total = total - total
            for j in range(total):
                if strips[j].load > 0.0:
                    strips[j].log = 0.5 * np.log(strips[j].square)
                    work.old[old_total] = strips[j]
                    old_total += 1
            kept, more, again = _refit(stage, displacement, count, parts, may_split, row, work, total, table)
            if kept > spans.size:
                return NO_ROOM, total, displacement
            again = again or _rotated(kept, old_total, total, row, work)
            if (again and stage < _STAGES - 1) or (stage > 0 and work.states[0].left < _LEFT):
                break
        parts = kept
        splits += more
        uncertain = more > 0
        for k in range(parts):
            for side in range(2):
                width = fresh[k].ends[1] - fresh[k].ends[0]
                moved = abs(fresh[k].ends[side] - spans[k].ends[side]) / width
                uncertain = uncertain or (stage == 0 and moved * count > _FAR)
        _copy(fresh, spans, parts)
        if (stage == 1 or not again) and _another_part(displacement, parts, row, work, total, table):
            if parts == spans.size:
                return NO_ROOM, total, displacement
            parts += 1
            again = uncertain = True
            for k in range(spans.size):
                _forget_ends(spans[k])
        if not again:
            break
    if cut and (again or spans[0].ends[0] < left or spans[parts - 1].ends[1] > right):
        return AT_EDGE, total, displacement
    return 0, total, displacement


@bare_kernel
def _copy(source: Records, target: Records, count: int) -> None:
    for k in range(count):
        target[k] = source[k]


@bare_kernel
def _room(row: Row) -> tuple[float, float]:
    """Find between which places strips can be laid: a wheel over them, neighbours for slopes [m].

    Twice the same if the lowest gap is not within both profiles.
    """
    gap, first, last = row.gap, 0, row.gap.size - 1
    lowest = int(np.argmin(gap))
    if not 3 <= lowest <= gap.size - 4 or max(gap[lowest - 1], gap[lowest + 1]) >= NO_WHEEL:
        return 0.0, 0.0
    while gap[first] >= NO_WHEEL:
        first += 1
    while gap[last] >= NO_WHEEL:
        last -= 1
    k, n = max(first + 1, 2), min(last - 1, gap.size - 3)
    return 0.5 * (row.y[k] + row.y[k + 1]), 0.5 * (row.y[n - 1] + row.y[n])


@bare_kernel
def _take_over(n: int, start: Start, count: int, row: Row, work: Work) -> tuple[int, int]:
    """Parts of the profile and strips with pressure of a solution nearby; return the numbers of both."""
    parts = total = n - n
    for m in range(start.first[n], start.first[n + 1]):
        edge, strips = start.edge[m], start.strips[m]
        margin = MARGIN / (count - 2.0 * MARGIN) * (edge[strips] - edge[0])
        _lay_out(work.spans[parts], edge[0] - margin, edge[strips] + margin)
        for j in range(strips):
            one = work.old[total]
            one.y, one.width = 0.5 * (edge[j] + edge[j + 1]), edge[j + 1] - edge[j]
            one.load, one.square = start.load[m, j], start.square[m, j]
            one.tilt = value_at(one.y, row.y, row.angle)
            total += 1
        parts += 1
    return parts, total


@bare_kernel
def _joined(spans: Records, parts: int) -> int:
    """Make parts that meet one; return how many are left."""
    kept = parts - parts
    for k in range(1, parts):
        if spans[k].ends[0] - spans[kept].ends[1] < _APART:
            _lay_out(spans[kept], spans[kept].ends[0], max(spans[k].ends[1], spans[kept].ends[1]))
        else:
            kept += 1
            spans[kept] = spans[k]
    return kept + 1


@bare_kernel
def _lay_parts(stage: int, count: int, parts: int, old_total: int, row: Row, work: Work) -> tuple[int, int]:
    """Lay strips in every part, with the pressures of the set before; a fault or 0, and their number."""
    strips, old = work.strips, work.old
    total = old_total - old_total
    for k in range(parts):
        span, plane = work.spans[k], work.planes[k]
        a, b = span.ends[0], span.ends[1]
        # As many as before if that is nearly right: else the ends might wander to and fro.
        wished = (b - a) / _WIDEST
        each = int(span.strips) if abs(wished - span.strips - 0.5) < 0.8 else int(wished)
        each = max(count, min(2 * count, each))
        if stage == 0:
            each = (3 * each) // 5
        else:
            span.strips = each
        longest = 0.0
        for j in range(old_total):
            if a <= old[j].y <= b:
                longest = max(longest, old[j].square)
        if longest > 0.0:  # strips much narrower than long make Newton's method fail
            each = min(each, max(8, int(100.0 * (b - a) / np.sqrt(longest))))
        if total + each > strips.size:
            return NO_ROOM, total
        # The plane is that of the pressures, at first that of the profile.
        known, middle, delta = plane.weight > 0.0, plane.middle, plane.tilt
        if not known:
            middle = 0.5 * (a + b)
            delta = value_at(middle, row.y, row.angle)
        if not cut_strips(span.ends, middle, delta, row, work, total, each):
            return AT_EDGE, total
        for j in range(total, total + each):
            one = strips[j]
            one.part = k
            if known:
                # Linear between strips with pressure and the ends.
                i = first_beyond(old.y, old_total, one.y)
                left, left_p, left_q = a + MARGIN * (b - a) / each, 0.0, 0.0
                right, right_p, right_q = b - MARGIN * (b - a) / each, 0.0, 0.0
                if i > 0 and (old[i - 1].y > left or one.y <= left):
                    left, left_p, left_q = old[i - 1].y, old[i - 1].load, old[i - 1].square
                if i < old_total and (old[i].y < right or one.y >= right):
                    right, right_p, right_q = old[i].y, old[i].load, old[i].square
                share = (one.y - left) / (right - left)
                inside = 0.0 < share < 1.0
                one.load = max(left_p + share * (right_p - left_p), 0.0) if inside else 0.0
                one.square = left_q + share * (right_q - left_q) if one.load > 0.0 else 0.0
            else:
                depth = max(span.rim - one.gap / one.turn, 0.02 * span.rim)
                one.square, one.load = 2.0 * one.radius * depth, depth / np.pi
            one.square = max(one.square, 1e-10)
        total += each
    return 0, total


@bare_kernel
def _overlap(k: int, displacement: float, row: Row, strips: Records, total: int, table: FloatArray) -> float:
    """How deep the moved surfaces would overlap at a grid point without pressure, over the displacement.

    Zero if they would not.
    """
    away = (row.gap[k] - row.low - displacement) * np.cos(row.angle[k])
    if away > 0.0:
        return 0.0
    for j in range(total):
        p = strips[j].load
        if p <= 0.0:
            continue
        across, down = strips[j].y - row.y[k], strips[j].z - row.z[k]
        distance = np.sqrt(across * across + down * down)
        share = influence_share(strips[j].angle - row.angle[k], distance)
        if share > 0.0:
            half = 0.5 * strips[j].width
            a = in_the_middle(table, np.log(distance + half) - strips[j].log)
            b = 0.0
            if distance > half:
                b = in_the_middle(table, np.log(max(distance - half, 0.1 * half)) - strips[j].log)
            away += share * (a - b) * p
            if away > 0.0:
                return 0.0
    depth: float = -away / displacement
    return depth


@bare_kernel
def _next_end(place: float, miss: float, per: float, span: Record, side: int) -> tuple[float, bool]:
    """Where to look next for an end that is missed by so much, and whether there is nothing between.

    Places and misses [m] count inwards. What is missed jumps where a strip at the rim gets its pressure: the
    place is kept between those from which it goes inwards and those from which it goes outwards.
    """
    outer, inner, last, last_miss = span.outer[side], span.inner[side], span.last[side], span.last_miss[side]
    outer_miss, inner_miss = span.outer_miss[side], span.inner_miss[side]
    step = miss
    if last_miss != 0.0 and abs(place - last) > 1e-3 * per:
        step = miss / min(max((last_miss - miss) / (place - last), _SLOWEST), _FASTEST)
    if abs(miss) > per or (inner_miss != 0.0 and outer_miss != 0.0 and inner <= outer):
        outer_miss, inner_miss = 0.0, 0.0
    if 0.0 < miss <= per:
        inner_miss *= 0.5 if outer_miss != 0.0 else 1.0
        outer, outer_miss = place, miss
    elif -per <= miss <= 0.0:
        outer_miss *= 0.5 if inner_miss != 0.0 else 1.0
        inner, inner_miss = place, miss
    span.last[side], span.last_miss[side] = place, miss
    span.outer[side], span.outer_miss[side] = outer, outer_miss
    span.inner[side], span.inner_miss[side] = inner, inner_miss
    if outer_miss == 0.0 or inner_miss == 0.0 or inner <= outer:
        return place + step, False
    share = outer_miss / (outer_miss - inner_miss)
    return outer + min(max(share, 0.05), 0.95) * (inner - outer), inner - outer < _SETTLED * per


@bare_kernel
def _forget_ends(span: Record) -> None:
    """Forget where the ends of a part were tried."""
    for side in range(2):
        span.outer[side] = span.outer_miss[side] = span.inner[side] = span.inner_miss[side] = 0.0
        span.last[side] = span.last_miss[side] = 0.0


@bare_kernel
def _lay_out(span: Record, left: float, right: float) -> None:
    """Put a part between two places, with no strips yet."""
    span.ends[0], span.ends[1], span.strips = left, right, 0
    _forget_ends(span)


@bare_kernel
def _refit(
    stage: int, displacement: float, count: int, parts: int, may_split: bool, row: Row, work: Work,
    total: int, table: FloatArray,
) -> tuple[int, int, bool]:  # fmt: skip
    """Write to `fresh` where the parts of the profile end now.

    Return their number, one more than have room, how many split, and whether strips have to be laid again.
    """
    strips, spans, fresh = work.strips, work.spans, work.fresh
    again, kept, base, splits = stage == 0, 0, 0, 0
    for k in range(parts):
        first = base
        while base < total and strips[base].part == k:
            base += 1
        each = base - first
        left, right = first, base - 1
        while left <= right and strips[left].load <= 0.0:
            left += 1
        if left > right:  # parts without pressure leave
            again = True
            continue
        fresh[kept] = spans[k]
        for side in range(2):
            rim, step = (first, 1) if side == 0 else (base - 1, -1)
            per = abs(strips[rim + step].y - strips[rim].y)
            move = end_of(strips, rim, step, each)
            # Outwards as long as the surfaces overlap, from three quarters of a strip on.
            i = first_beyond(row.y, row.y.size, spans[k].ends[side] - 0.75 * step * per) - (1 - side)
            skip = max(int(0.4 * per / (row.y[i + 1] - row.y[i])), 1) if 0 < i < row.gap.size - 2 else 1
            reached = False
            while 2 < i < row.gap.size - 3 and row.gap[i] < NO_WHEEL:
                if _overlap(i, displacement, row, strips, total, table) < _OVERLAP:
                    break
                reached = True
                i -= step * skip
            if reached:
                move = min(move, -abs(row.y[i] - spans[k].ends[side]) / per)
            move = max(move, -0.5 * each) - MARGIN * min(each / count, 1.0)
            place, settled = spans[k].ends[side] + step * per * move, True
            if stage > 0:
                place, settled = _next_end(step * spans[k].ends[side], move * per, per, fresh[kept], side)
                place *= step
            fresh[kept].ends[side] = place
            again = again or not (settled or abs(move) < _SETTLED)
        # Two humps with strips without pressure between them get strips of their own, once.
        while strips[right].load <= 0.0:
            right -= 1
        a, b = left, right
        while a <= right and strips[a].load > 0.0:
            a += 1
        while b >= left and strips[b].load > 0.0:
            b -= 1
        if a <= b and may_split:
            stop = strips[a - 1].y + 0.8 * (strips[a].y - strips[a - 1].y)
            go = strips[b + 1].y - 0.8 * (strips[b + 1].y - strips[b].y)
            if go - stop > _APART:
                if kept + parts - k >= spans.size:
                    return spans.size + 1, splits, True
                outer = fresh[kept].ends[1]
                _lay_out(fresh[kept], fresh[kept].ends[0], stop)
                _lay_out(fresh[kept + 1], go, outer)
                kept += 1
                splits += 1
                again = True
        kept += 1
    return kept, splits, again


@bare_kernel
def _rotated(parts: int, old_total: int, total: int, row: Row, work: Work) -> bool:
    """Whether the plane of a part is not that of its pressures."""
    planes_of(work.fresh, parts, old_total, row, work)
    for j in range(total):
        plane = work.planes[work.strips[j].part]
        if plane.weight > 0.0 and abs(plane.tilt - work.strips[j].angle) > _STILL:
            return True
    return False


@bare_kernel
def _another_part(
    displacement: float, parts: int, row: Row, work: Work, total: int, table: FloatArray
) -> bool:
    """Add to the parts one in contact now, if there is room; whether there is any."""
    strips, spans, edge = work.strips, work.spans, row.gap.size - 3
    for start in range(3, edge, 3):
        free = row.gap[start] - row.low < displacement
        for k in range(parts):
            free = free and not spans[k].ends[0] - 1e-3 < row.y[start] < spans[k].ends[1] + 1e-3
        if not free:
            continue
        deep = _overlap(start, displacement, row, strips, total, table)
        if deep <= _OVERLAP:
            continue
        if parts == spans.size:
            return True
        i, lowest = start, row.gap[start]
        while i < edge and row.gap[i] < NO_WHEEL and deep > 1e-3:
            i += 2
            deep = _overlap(i, displacement, row, strips, total, table)
        for j in range(start, i):
            lowest = min(lowest, row.gap[j])
        k = parts
        while k > 0 and spans[k - 1].ends[0] > row.y[start]:
            spans[k] = spans[k - 1]
            k -= 1
        _lay_out(spans[k], row.y[start - 2], row.y[i])
        spans[k].rim = lowest - row.low + 0.5 * max(deep, 0.02) * displacement
        return True
    return False
