"""Kernels of the strip model: where a patch ends, and what is in contact outside of the strips.

Equations and sources: see `knothe_le_the`.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.geometry import NO_WHEEL
from wearsim.contact.kernel import kernel
from wearsim.contact.normal.knothe_le_the.equations import in_the_middle
from wearsim.contact.normal.knothe_le_the.strips import (
    ANGLE,
    INNER,
    LAST,
    LOAD,
    LOG,
    MARGIN,
    OUTER,
    SQUARE,
    STRIPS,
    TILT,
    WEIGHT,
    WIDTH,
    Y,
    Z,
    influence_share,
    planes_of,
)
from wearsim.contact.patch import FloatArray, IntArray

_SETTLED = 0.03  # widths of a strip, by which the ends of a patch miss their place between the strips
_STILL = 1e-4  # rad, by which the plane of a part turns, at most, in the last stage
_GIVES_WAY = 0.25  # widths of a strip
_SLOWEST, _FASTEST = 0.5, 6.0  # of what an end moves, by which it comes nearer to its place
APART = 0.3e-3  # m, between parts of the profile that have strips of their own
_OVERLAP = 2e-3  # of the displacement, that counts as contact


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
def overlap(
    k: int, displacement: float, low: float, grid_y: FloatArray, grid_z: FloatArray, angle: FloatArray,
    gap: FloatArray, strips: FloatArray, total: int, table: FloatArray,
) -> float:  # fmt: skip
    """How deep the moved surfaces would overlap at a grid point without pressure, over the displacement."""
    away = (gap[k] - low - displacement) * np.cos(angle[k])
    if away > 0.0:
        return 0.0
    for j in range(total):
        p = strips[LOAD, j]
        if p <= 0.0:
            continue
        across, down = strips[Y, j] - grid_y[k], strips[Z, j] - grid_z[k]
        distance = np.sqrt(across * across + down * down)
        share = influence_share(strips[ANGLE, j] - angle[k], distance)
        if share > 0.0:
            half = 0.5 * strips[WIDTH, j]
            if distance > 3.0 * half:
                # The logarithm as a series: it is off by less than 1e-4 of the difference.
                x = half / distance
                middle = 0.5 * np.log(across * across + down * down) - strips[LOG, j]
                even, odd = x * x * (0.5 + 0.25 * x * x), x * (1.0 + x * x * (1.0 / 3.0 + 0.2 * x * x))
                a = in_the_middle(table, middle + odd - even)
                b = in_the_middle(table, middle - odd - even)
            else:
                a = in_the_middle(table, np.log(distance + half) - strips[LOG, j])
                b = 0.0
                if distance > half:
                    b = in_the_middle(table, np.log(max(distance - half, 0.1 * half)) - strips[LOG, j])
            away += share * (a - b) * p
    depth: float = -away / displacement
    return depth


@kernel
def next_end(place: float, miss: float, per: float, span: FloatArray, side: int) -> tuple[float, bool]:
    """Where to look next for an end that is missed by so much, and whether there is nothing between.

    Places and misses [m] count inwards. What is missed jumps where a strip at the rim gets its pressure: the
    place is kept between those from which it goes inwards and those from which it goes outwards.
    """
    outer, inner, last = span[OUTER + side], span[INNER + side], span[LAST + side]
    outer_miss, inner_miss, last_miss = (
        span[OUTER + 2 + side], span[INNER + 2 + side], span[LAST + 2 + side],
    )  # fmt: skip
    step = miss
    if last_miss != 0.0 and abs(place - last) > 1e-3 * per:
        step = miss / min(max((last_miss - miss) / (place - last), _SLOWEST), _FASTEST)
    span[LAST + side], span[LAST + 2 + side] = place, miss
    if abs(miss) > per or (inner_miss != 0.0 and outer_miss != 0.0 and inner <= outer):
        outer_miss, inner_miss = 0.0, 0.0
    if abs(miss) <= per:
        if miss > 0.0:
            inner_miss *= 0.5 if outer_miss != 0.0 else 1.0
            outer, outer_miss = place, miss
        else:
            outer_miss *= 0.5 if inner_miss != 0.0 else 1.0
            inner, inner_miss = place, miss
    span[OUTER + side], span[OUTER + 2 + side] = outer, outer_miss
    span[INNER + side], span[INNER + 2 + side] = inner, inner_miss
    if outer_miss == 0.0 or inner_miss == 0.0 or inner <= outer:
        return place + step, False
    share = outer_miss / (outer_miss - inner_miss)
    return outer + min(max(share, 0.05), 0.95) * (inner - outer), inner - outer < _SETTLED * per


@kernel
def refit(
    stage: int, displacement: float, low: float, count: int, parts: int, may_split: bool, grid_y: FloatArray,
    grid_z: FloatArray, angle: FloatArray, gap: FloatArray, strips: FloatArray, lobe: IntArray, total: int,
    table: FloatArray, spans: FloatArray, fresh: FloatArray,
) -> tuple[int, int, bool]:  # fmt: skip
    """Write to `fresh` where the parts of the profile end now.

    Return their number, how many split, and whether strips have to be laid again.
    """
    again = stage == 0
    kept, base, splits = 0, 0, 0
    for k in range(parts):
        each = 0
        alive = False
        while base + each < total and lobe[base + each] == k:
            alive = alive or strips[LOAD, base + each] > 0.0
            each += 1
        if not alive:  # parts without pressure leave
            again = True
            base += each
            continue
        fresh[kept] = spans[k]
        for side in range(2):
            first, step = (base, 1) if side == 0 else (base + each - 1, -1)
            per = abs(strips[Y, first + step] - strips[Y, first])
            move = end_of(strips, first, step, each)
            # Outwards as long as the surfaces overlap, from three quarters of a strip on.
            edge = spans[k, side] - 0.75 * step * per
            i = int(np.searchsorted(grid_y, edge)) - (1 if side == 0 else 0)
            skip = max(int(0.4 * per / (grid_y[i + 1] - grid_y[i])), 1) if 0 < i < gap.size - 2 else 1
            reached = False
            while 2 < i < gap.size - 3 and gap[i] < NO_WHEEL:
                if overlap(i, displacement, low, grid_y, grid_z, angle, gap, strips, total, table) < _OVERLAP:
                    break
                reached = True
                i -= step * skip
            if reached:
                move = min(move, -abs(grid_y[i] - spans[k, side]) / per)
            margin = MARGIN * min(each / count, 1.0)
            move = max(move, -0.5 * each) - margin
            if stage == 0:
                fresh[kept, side] = spans[k, side] + step * per * move
            else:
                place, settled = next_end(step * spans[k, side], move * per, per, fresh[kept], side)
                fresh[kept, side] = step * place
                again = again or not (abs(move) < _SETTLED or settled)
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
        if a <= b and may_split and kept + parts - k < spans.shape[0]:
            stop = strips[Y, a - 1] + 0.8 * (strips[Y, a] - strips[Y, a - 1])
            go = strips[Y, b + 1] - 0.8 * (strips[Y, b + 1] - strips[Y, b])
            if go - stop > APART:
                fresh[kept, STRIPS:] = 0.0
                fresh[kept + 1] = fresh[kept]
                fresh[kept, 1], fresh[kept + 1, 0] = stop, go
                kept += 1
                splits += 1
                again = True
        kept += 1
        base += each
    return kept, splits, again


@kernel
def rotated(
    spans: FloatArray, parts: int, old: FloatArray, old_total: int, strips: FloatArray, lobe: IntArray,
    total: int, grid_y: FloatArray, grid_z: FloatArray, angle: FloatArray, planes: FloatArray,
) -> bool:  # fmt: skip
    """Whether the plane of a part is not that of its pressures."""
    planes_of(spans, parts, old, old_total, grid_y, grid_z, angle, planes)
    for j in range(total):
        k = lobe[j]
        if planes[k, WEIGHT] > 0.0 and abs(planes[k, TILT] - strips[ANGLE, j]) > _STILL:
            return True
    return False


@kernel
def another_part(
    displacement: float, low: float, parts: int, grid_y: FloatArray, grid_z: FloatArray, angle: FloatArray,
    gap: FloatArray, radius: FloatArray, strips: FloatArray, total: int, table: FloatArray, spans: FloatArray,
) -> bool:  # fmt: skip
    """Add to the parts one in contact now, if there is any."""
    if parts >= spans.shape[0]:
        return False
    for start in range(3, gap.size - 3, 3):
        if gap[start] - low >= displacement:
            continue
        free = True
        for k in range(parts):
            if spans[k, 0] - 1e-3 < grid_y[start] < spans[k, 1] + 1e-3:
                free = False
        if not free:
            continue
        deep = overlap(start, displacement, low, grid_y, grid_z, angle, gap, strips, total, table)
        if deep > _OVERLAP:
            i = start
            while i < gap.size - 3 and gap[i] < NO_WHEEL and deep > 1e-3:
                i += 2
                deep = overlap(i, displacement, low, grid_y, grid_z, angle, gap, strips, total, table)
            k = parts
            while k > 0 and spans[k - 1, 0] > grid_y[start]:
                spans[k] = spans[k - 1]
                k -= 1
            spans[k, 0], spans[k, 1] = grid_y[start - 2], grid_y[i]
            lowest = gap[start:i].min()
            spans[k, 2] = 2.0 * radius[start]
            spans[k, 3] = lowest - low + 0.5 * max(deep, 0.02) * displacement
            spans[k, 4] = 0.5 / (radius[start] * np.pi)
            spans[k, STRIPS:] = 0.0
            return True
    return False
