"""Kernels of the strip model: where a patch ends, and what is in contact outside of the strips.

Equations and sources: see `knothe_le_the`.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.geometry import NO_WHEEL
from wearsim.contact.kernel import bare_kernel, inner_bare_kernel
from wearsim.contact.normal.knothe_le_the.equations import in_the_middle
from wearsim.contact.normal.knothe_le_the.strips import (
    MARGIN,
    Record,
    Records,
    Row,
    Work,
    first_beyond,
    influence_share,
    planes_of,
)
from wearsim.contact.patch import FloatArray

_SETTLED = 0.015  # widths of a strip, by which the ends of a patch miss their place between the strips
_STILL = 1e-4  # rad, by which the plane of a part turns, at most, in the last stage
_EARLY = 4  # stages in which ends that miss their place by more than a strip are sought anew
_GIVES_WAY = 0.25  # widths of a strip
_SLOWEST, _FASTEST = 0.5, 6.0  # of what an end moves, by which it comes nearer to its place
APART = 0.3e-3  # m, between parts of the profile that have strips of their own
_UNDER_LESS = 0.7  # of the overlap beyond a first patch: it is too narrow, its pressures too high
_OVERLAP = 2e-3  # of the displacement, that counts as contact


@inner_bare_kernel
def end_of(strips: Records, first: int, step: int, count: int) -> float:
    """Widths of a strip from the outer edge of strip `first` inwards to where the half-length is zero.

    A parabola through q of the strips behind the outermost one with pressure, which may lie in part outside.
    Where the patch is wide up to its end the parabola sees it far outside: then as if q fell linearly within
    the outermost strip, less what makes it give way to the parabola of a smooth end.
    """
    k = 0
    while k < count and strips[first + k * step].load <= 0.0:
        k += 1
    n = 0
    while k + n < count and n < 4 and strips[first + (k + n) * step].load > 0.0:
        n += 1
    if n < 3:
        return float(k)
    one, two = strips[first + (k + 1) * step].square, strips[first + (k + 2) * step].square
    share = strips[first + k * step].square / one
    covered = 1.0 - _GIVES_WAY - share - np.sqrt(share * share + share)
    rise, bend = two - one, 0.0
    if rise > 0.0:
        if n > 3:
            bend = min(0.5 * (strips[first + (k + 3) * step].square - 2.0 * two + one), 0.0)
        tilt = rise - bend
        covered = max(covered, 1.5 - 2.0 * one / (tilt + np.sqrt(tilt * tilt - 4.0 * bend * one)))
    end: float = k + min(max(covered, -0.5), 1.0)
    return end


@bare_kernel
def overlap(k: int, displacement: float, row: Row, strips: Records, total: int, table: FloatArray) -> float:
    """How deep the moved surfaces would overlap at a grid point without pressure, over the displacement.

    Zero if they would not.
    """
    away = (row.gap[k] - row.low - displacement) * np.cos(row.angle[k])
    if away > 0.0:
        return 0.0
    from_left = strips[total - 1].y > row.y[k]  # beyond the last strip from that one on: few are needed
    for n in range(total):
        j = n if from_left else total - 1 - n
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


@inner_bare_kernel
def _next_end(
    place: float, miss: float, per: float, early: bool, span: Record, side: int
) -> tuple[float, bool]:
    """Where to look next for an end that is missed by so much, and whether there is nothing between.

    Places and misses [m] count inwards. What is missed jumps where a strip at the rim gets its pressure: the
    place is kept between those from which it goes inwards and those from which it goes outwards.
    """
    outer, inner, last, last_miss = span.outer[side], span.inner[side], span.last[side], span.last_miss[side]
    outer_miss, inner_miss = span.outer_miss[side], span.inner_miss[side]
    step = miss
    if last_miss != 0.0 and abs(place - last) > 1e-3 * per:
        step = miss / min(max((last_miss - miss) / (place - last), _SLOWEST), _FASTEST)
    far = early and abs(miss) > per
    if far or (inner_miss != 0.0 and outer_miss != 0.0 and inner <= outer):
        outer_miss, inner_miss = 0.0, 0.0
    if miss > 0.0 and not far:
        inner_miss *= 0.5 if outer_miss != 0.0 else 1.0
        outer, outer_miss = place, miss
    elif not far:
        outer_miss *= 0.5 if inner_miss != 0.0 else 1.0
        inner, inner_miss = place, miss
    span.last[side], span.last_miss[side] = place, miss
    span.outer[side], span.outer_miss[side] = outer, outer_miss
    span.inner[side], span.inner_miss[side] = inner, inner_miss
    if outer_miss == 0.0 or inner_miss == 0.0 or inner <= outer:
        return place + step, False
    share = outer_miss / (outer_miss - inner_miss)
    return outer + min(max(share, 0.05), 0.95) * (inner - outer), inner - outer < _SETTLED * per


@inner_bare_kernel
def forget_ends(span: Record) -> None:
    """Forget where the ends of a part were tried."""
    for side in range(2):
        span.outer[side] = span.outer_miss[side] = span.inner[side] = span.inner_miss[side] = 0.0
        span.last[side] = span.last_miss[side] = span.beyond[side] = 0.0


@inner_bare_kernel
def lay_out(span: Record, left: float, right: float) -> None:
    """Put a part between two places, with no strips yet."""
    span.ends[0], span.ends[1], span.strips, span.laid = left, right, 0, 0
    forget_ends(span)


@inner_bare_kernel
def refit(
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
                if overlap(i, displacement, row, strips, total, table) < _OVERLAP:
                    break
                reached = True
                i -= step * skip
            if reached:
                beneath = abs(row.y[i] - spans[k].ends[side]) / per
                move = min(move, -beneath * (_UNDER_LESS if stage == 0 else 1.0))
            move = max(move, -0.5 * each) - MARGIN * min(each / count, 1.0)
            place, settled = spans[k].ends[side] + step * per * move, True
            if stage > 0:
                place, settled = _next_end(
                    step * spans[k].ends[side], move * per, per, stage < _EARLY, fresh[kept], side
                )
                place *= step
            fresh[kept].ends[side] = place
            known, beyond = spans[k].beyond[side], 0.0
            if abs(move) >= _SETTLED:  # no place is without a miss: the one known stays
                held = known != 0.0 and abs(move - known) < _SETTLED
                beyond = known if held else move if stage > 0 and settled else 0.0
                again = again or beyond == 0.0
            fresh[kept].beyond[side] = beyond
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
            if go - stop > APART:
                if kept + parts - k >= spans.size:
                    return spans.size + 1, splits, True
                outer = fresh[kept].ends[1]
                lay_out(fresh[kept], fresh[kept].ends[0], stop)
                lay_out(fresh[kept + 1], go, outer)
                kept += 1
                splits += 1
                again = True
        kept += 1
    return kept, splits, again


@inner_bare_kernel
def rotated(parts: int, old_total: int, total: int, row: Row, work: Work) -> bool:
    """Whether the plane of a part is not that of its pressures."""
    planes_of(work.fresh, parts, old_total, row, work)
    for j in range(total):
        plane = work.planes[work.strips[j].part]
        if plane.weight > 0.0 and abs(plane.tilt - work.strips[j].angle) > _STILL:
            return True
    return False


@inner_bare_kernel
def another_part(
    displacement: float, parts: int, row: Row, work: Work, total: int, table: FloatArray
) -> bool:
    """Add to the parts one in contact now, if there is room; whether there is any."""
    strips, spans, edge = work.strips, work.spans, row.gap.size - 3
    for start in range(3, edge, 3):
        if not row.gap[start] - row.low < displacement:
            continue
        free = True
        for k in range(parts):
            free = free and not spans[k].ends[0] - 1e-3 < row.y[start] < spans[k].ends[1] + 1e-3
        if not free:
            continue
        deep = overlap(start, displacement, row, strips, total, table)
        if deep <= _OVERLAP:
            continue
        if parts == spans.size:
            return True
        i, lowest = start, row.gap[start]
        while i < edge and row.gap[i] < NO_WHEEL and deep > 1e-3:
            i += 2
            deep = overlap(i, displacement, row, strips, total, table)
        for j in range(start, i):
            lowest = min(lowest, row.gap[j])
        k = parts
        while k > 0 and spans[k - 1].ends[0] > row.y[start]:
            spans[k] = spans[k - 1]
            k -= 1
        lay_out(spans[k], row.y[start - 2], row.y[i])
        spans[k].per_depth = 2.0 * row.radius[start]
        spans[k].rim = lowest - row.low + 0.5 * max(deep, 0.02) * displacement
        spans[k].per_square = 0.5 / (row.radius[start] * np.pi)
        return True
    return False
