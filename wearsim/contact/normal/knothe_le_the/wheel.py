"""Kernels of the strip model: strips of a wheel fitted to its patches, and the strips of the solution.

Equations and sources: see `knothe_le_the`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.contact.geometry import NO_WHEEL
from wearsim.contact.kernel import bare_kernel, inner_bare_kernel
from wearsim.contact.normal.knothe_le_the.equations import UNKNOWN, pair_up
from wearsim.contact.normal.knothe_le_the.refit import (
    APART,
    another_part,
    end_of,
    forget_ends,
    lay_out,
    refit,
    rotated,
)
from wearsim.contact.normal.knothe_le_the.solution import solve_strips
from wearsim.contact.normal.knothe_le_the.strips import (
    MARGIN,
    NO_ROOM,
    Records,
    Row,
    Work,
    cut_strips,
    first_beyond,
    planes_of,
    points_in_plane,
    share_points,
    value_at,
)
from wearsim.contact.normal.model import AT_EDGE, NO_BALANCE, NO_CONTACT, NOT_SINGLE
from wearsim.contact.patch import FloatArray, IntArray

_STAGES = 16  # of fitting the strips to the patch
# Changes of q, over the largest: in the first stage, before it is seen whether the strips fit, in the end.
_CLOSE, _ROUGH, _DONE = 0.1, 3e-3, 1e-4
_LEFT = 5e-6  # change that is to be expected next, below which there is none
_NEARBY = 0.2, 0.03, 0.015  # of ln a, up to which averages are expanded: coarse, first fine, later sets
_WIDEST, _NARROW = 0.65e-3, 0.3e-3  # m, of a strip: profiles change their radius within wide patches
_SMOOTH_GAP, _ROUGH_GAP = 0.02, 0.035  # fourth differences of the gap, over the displacement, of these widths
# Strips by which a number of them may be off: half of one in the first sets, else it hangs on the way to it;
# in those laid so before, and later, nearly one, else ends might wander.
_EXACT, _KEPT = 0.5, 0.8
_FIRST_SETS = 2  # the last of them
_SAMPLES = 20  # of the gap over a part, for them
_SMALLEST = 5e-4  # of the load: patches below are left out
_FINE = 160  # samples of the largest pressure


class Wheels(NamedTuple):
    """Points of the counterface's profile, and gap, its lowest value, ring and contact line of every row."""

    y: FloatArray
    z: FloatArray
    slope: FloatArray
    angle: FloatArray
    gap: FloatArray
    low: FloatArray
    radius: FloatArray
    along: FloatArray
    kappa: float
    vertical: bool


class Start(NamedTuple):
    """Patches of a solution nearby, by row and place: which are a row's, their strips and displacement.

    `near` if they are those of this model. How they were `laid` out, if known: number of strips (k,), their
    `ends` (k, 2) and what is missed `beyond`, `angle` (k,) of their plane.
    """

    near: bool
    first: IntArray
    strips: IntArray
    edge: FloatArray
    square: FloatArray
    load: FloatArray
    displacement: FloatArray
    laid: IntArray
    ends: FloatArray
    beyond: FloatArray
    angle: FloatArray


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
            fault[r], number[n] = _find_patches(
                total, displacement, load[n], modulus, row, work, patches[n], nodes[:, n]
            )


@inner_bare_kernel
def _fit(n: int, row: Row, start: Start, count: int, table: FloatArray, work: Work) -> tuple[int, int, float]:
    """Fit strips to the patches of a wheel; a fault or 0, their number, and the displacement."""
    strips, spans, fresh = work.strips, work.spans, work.fresh
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
    alone = again = cut = False
    laid = start.laid[start.first[n]] > 0
    work.states[0].listed = work.states[0].steps = 0
    may_split = True
    for stage in range(int(start.near), _STAGES):
        together = _joined(spans, parts)
        may_split = may_split and (together == parts or splits == 0)
        parts = together
        # trial ends may lie beyond the profile: whether the patch itself does is seen when it is settled
        cut = cut or spans[0].ends[0] < left or spans[parts - 1].ends[1] > right
        spans[0].ends[0] = max(spans[0].ends[0], left)
        spans[parts - 1].ends[1] = min(spans[parts - 1].ends[1], right)
        planes_of(spans, parts, old_total, row, work)
        for k in range(parts):
            if spans[k].laid:
                work.planes[k].tilt, spans[k].laid = spans[k].angle, 0
        off = _KEPT if laid or stage > _FIRST_SETS else _EXACT
        failed, total = _lay_parts(stage, count, parts, old_total, displacement, off, row, work)
        if failed != 0:
            return failed, total, displacement
        pair_up(work, total)
        if parts > 1 or not alone:
            work.base[:] = UNKNOWN
        alone = parts == 1
        work.states[0].nearby = _NEARBY[min(stage, 2)]
        kept, more = parts, total - total
        for tolerance in (_CLOSE if stage == 0 else _ROUGH, _DONE):
            displacement, done = solve_strips(work, row, total, displacement, table, tolerance)
            if not done:
                return NO_BALANCE, total, displacement
            old_total = total - total
            for j in range(total):
                if strips[j].load > 0.0:
                    strips[j].log = 0.5 * np.log(strips[j].square)
                    work.old[old_total] = strips[j]
                    old_total += 1
            kept, more, again = refit(stage, displacement, count, parts, may_split, row, work, total, table)
            if kept > spans.size:
                return NO_ROOM, total, displacement
            again = again or rotated(kept, old_total, total, row, work)
            if (again and stage < _STAGES - 1) or stage == 0 or work.states[0].left < _LEFT:
                break
        parts = kept
        splits += more
        _copy(fresh, spans, parts)
        if (stage in (3, 6, 9) or not again) and another_part(displacement, parts, row, work, total, table):
            if parts == spans.size:
                return NO_ROOM, total, displacement
            parts += 1
            again = True
            for k in range(spans.size):
                forget_ends(spans[k])
        if not again:
            break
    if again:
        for k in range(spans.size):
            forget_ends(spans[k])
    if cut and (spans[0].ends[0] < left or spans[parts - 1].ends[1] > right):
        return AT_EDGE, total, displacement
    return 0, total, displacement


@inner_bare_kernel
def _copy(source: Records, target: Records, count: int) -> None:
    for k in range(count):
        target[k] = source[k]


@inner_bare_kernel
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


@inner_bare_kernel
def _take_over(n: int, start: Start, count: int, row: Row, work: Work) -> tuple[int, int]:
    """Parts of the profile and strips with pressure of a solution nearby; return the numbers of both."""
    parts = total = n - n
    spans = work.spans
    for m in range(start.first[n], start.first[n + 1]):
        edge, strips, ends = start.edge[m], start.strips[m], start.ends[m]
        laid = start.laid[m] > 0
        if laid and parts > 0 and spans[parts - 1].strips > 0 and spans[parts - 1].ends[1] == ends[1]:
            parts -= 1  # another patch on the same strips
        elif laid:
            span = spans[parts]
            lay_out(span, ends[0], ends[1])
            span.strips, span.laid, span.angle = start.laid[m], 1, start.angle[m]
            span.beyond[0], span.beyond[1] = start.beyond[m, 0], start.beyond[m, 1]
        else:
            lay_out(spans[parts], edge[0], edge[strips])
        for j in range(strips):
            one = work.old[total]
            one.y, one.width = 0.5 * (edge[j] + edge[j + 1]), edge[j + 1] - edge[j]
            one.load, one.square = start.load[m, j], start.square[m, j]
            one.tilt = value_at(one.y, row.y, row.angle)
            total += 1
        parts += 1
    for k in range(parts):
        span = spans[k]
        if span.strips > 0:
            continue
        _count_strips(k, parts, count, start.displacement[start.first[n]] - row.low, _EXACT, row, work)
        beyond = MARGIN * min(span.strips / count, 1.0)
        margin = beyond / (span.strips - 2.0 * beyond) * (span.ends[1] - span.ends[0])
        span.ends[0] -= margin
        span.ends[1] += margin
    return parts, total


@inner_bare_kernel
def _count_strips(
    k: int, parts: int, count: int, displacement: float, off: float, row: Row, work: Work
) -> None:
    """Find how many strips a part has: fewer in narrow ones, more where the gap is rough.

    As many as before unless they are `off` by so much.
    """
    widest = 0.0
    for j in range(parts):
        widest = max(widest, work.spans[j].ends[1] - work.spans[j].ends[0])
    span = work.spans[k]
    a, b = span.ends[0], span.ends[1]
    least = count * min(max(2.0 * np.sqrt((b - a) / widest), 0.5), 1.0)
    across = np.hypot(b - a, value_at(b, row.y, row.z) - value_at(a, row.y, row.z))
    wished = min(max(across / _width_of_strips(a, b, displacement, row), least), 2.0 * count)
    if not abs(wished - span.strips) < off:
        span.strips = int(wished + 0.5)


@inner_bare_kernel
def _joined(spans: Records, parts: int) -> int:
    """Make parts that meet one; return how many are left."""
    kept = parts - parts
    for k in range(1, parts):
        if spans[k].ends[0] - spans[kept].ends[1] < APART:
            lay_out(spans[kept], spans[kept].ends[0], max(spans[k].ends[1], spans[kept].ends[1]))
        else:
            kept += 1
            spans[kept] = spans[k]
    return kept + 1


@inner_bare_kernel
def _width_of_strips(a: float, b: float, displacement: float, row: Row) -> float:
    """Largest width of strips between two places: less where the gap is rough, by its fourth differences."""
    total = one = two = three = four = 0.0  # the samples before
    for j in range(_SAMPLES + 1):
        here = value_at(a + j * (b - a) / _SAMPLES, row.y, row.gap)
        if j >= 4:
            total += (here - 4.0 * one + 6.0 * two - 4.0 * three + four) ** 2
        one, two, three, four = here, one, two, three
    rough = np.sqrt(total / (_SAMPLES - 3)) * np.cos(value_at(0.5 * (a + b), row.y, row.angle)) / displacement
    smooth = min(max((_ROUGH_GAP - rough) / (_ROUGH_GAP - _SMOOTH_GAP), 0.0), 1.0)
    width: float = _NARROW + smooth * (_WIDEST - _NARROW)
    return width


@inner_bare_kernel
def _lay_parts(
    stage: int, count: int, parts: int, old_total: int, displacement: float, off: float, row: Row, work: Work
) -> tuple[int, int]:
    """Lay strips in every part, with the pressures of the set before; a fault or 0, and their number."""
    strips, old = work.strips, work.old
    total = old_total - old_total
    for k in range(parts):
        _count_strips(k, parts, count, displacement, off, row, work)
        span, plane = work.spans[k], work.planes[k]
        a, b = span.ends[0], span.ends[1]
        each = int(span.strips) if stage > 0 else (3 * int(span.strips)) // 5
        longest = 0.0
        for j in range(old_total):
            if a <= old[j].y <= b:
                longest = max(longest, old[j].square)
        if longest > 0.0:  # lengths of strips much narrower than long are ill determined
            each = min(each, max(8, int(100.0 * (b - a) / np.sqrt(longest))))
        if total + each > strips.size:
            return NO_ROOM, total
        # Middle and angle of the plane: of the pressures, at first of the depths.
        known, middle, delta = plane.weight > 0.0, plane.middle, plane.tilt
        if not known:
            weight, moment, tilt = 0.0, 0.0, 0.0
            for i in range(1, row.y.size - 1):
                if a <= row.y[i] < b:
                    g = max(span.rim - (row.gap[i] - row.low), 1e-12) * (row.y[i + 1] - row.y[i - 1])
                    weight += g
                    moment += g * row.y[i]
                    tilt += g * row.angle[i]
            if weight == 0.0:
                return NO_BALANCE, total
            middle, delta = moment / weight, tilt / weight
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
                depth = span.rim - one.gap / one.turn
                one.square = max(depth, 0.02 * span.rim) * span.per_depth
                one.load = one.square * span.per_square
            one.square = max(one.square, 1e-10)
        total += each
    return 0, total


@inner_bare_kernel
def _find_patches(
    total: int, displacement: float, load: float, modulus: float, row: Row, work: Work, patches: Records,
    nodes: FloatArray,
) -> tuple[int, int]:  # fmt: skip
    """Find the patches of a wheel, by falling normal force; return a fault or 0, and their number."""
    # Runs of strips with pressure are patches.
    strips = work.strips
    runs, j, carried = 0, 0, 0.0
    while j < total:
        first, force = j, 0.0
        while j < total and strips[j].load > 0.0 and strips[j].part == strips[first].part:
            force += 0.5 * np.pi * np.pi * modulus * strips[j].load * strips[j].width
            j += 1
        j = max(j, first + 1)
        if force > _SMALLEST * load:
            if runs == patches.size:
                return NO_ROOM, runs
            carried += force * (strips[first].cosine if row.vertical else 1.0)
            place = runs
            runs += 1
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
        n, width = b - a + 1, strips[a].width
        one.scale = load / carried
        one.force *= one.scale
        one.displacement, one.angle, one.origin = displacement, strips[a].angle, strips[a].origin
        one.start = strips[a].s + width * (end_of(strips, a, 1, n) - 0.5)
        one.stop = strips[b].s - width * (end_of(strips, b, -1, n) - 0.5)
        weighted, sum_load, count = 0.0, 0.0, 1
        for j in range(a, b + 1):
            weighted += strips[j].load * strips[j].tilt
            sum_load += strips[j].load
            # The outermost strips may lie in part outside of the patch.
            if n <= 2 or a < j < b:
                x[count], f[count] = strips[j].s, strips[j].square
                c[count] = strips[j].load / strips[j].square
                count += 1
        x[0], f[0], c[0] = one.start, 0.0, c[1]
        x[count], f[count], c[count] = one.stop, 0.0, c[count - 1]
        one.nodes = count + 1
        one.own = weighted / sum_load
        span = work.spans[strips[a].part]
        one.strips = span.strips if span.last[0] != 0.0 else 0
        one.ends[0], one.ends[1] = span.last[0], -span.last[1]
        one.beyond[0], one.beyond[1] = span.beyond[0], span.beyond[1]
    return 0, runs


@bare_kernel
def _slopes(x: FloatArray, f: FloatArray, slope: FloatArray) -> None:
    """Take derivatives at nodes of the parabolas through each and its neighbours."""
    n = x.size
    for k in range(1, n - 1):
        before, after = x[k] - x[k - 1], x[k + 1] - x[k]
        left, right = (f[k] - f[k - 1]) / before, (f[k + 1] - f[k]) / after
        slope[k] = (left * after + right * before) / (before + after)
    slope[0] = 2.0 * (f[1] - f[0]) / (x[1] - x[0]) - slope[1]
    slope[n - 1] = 2.0 * (f[n - 1] - f[n - 2]) / (x[n - 1] - x[n - 2]) - slope[n - 2]


@bare_kernel
def _between(
    x: FloatArray, f: FloatArray, slope: FloatArray, c: FloatArray, least: float, at: float, k: int
) -> tuple[float, float]:
    """Squared half-length by a cubic, at least the `least`, and pressure slope linearly, behind node k."""
    step = x[k + 1] - x[k]
    t = (at - x[k]) / step
    u = 1.0 - t
    rise = f[k + 1] - f[k]
    a, b = slope[k] * step - rise, rise - slope[k + 1] * step
    return max(f[k] + t * rise + t * u * (a * u + b * t), least), c[k] + t * (c[k + 1] - c[k])


class Cut(NamedTuple):
    """Strips of equal width: centres, half-lengths, middles, pressure slopes; edges on the profile."""

    y: FloatArray
    half: FloatArray
    middle: FloatArray
    slope: FloatArray
    edge: FloatArray


@bare_kernel
def cut_patches(
    wheels: Wheels, rows: IntArray, places: IntArray, ranks: IntArray, counts: IntArray, patches: Records,
    nodes: FloatArray, work: Work, out: Cut,
) -> None:  # fmt: skip
    """Cut patches, by row, into strips of equal width; what lies behind the strips of a patch is padding."""
    for m in range(rows.size):
        one, strips, r = patches[m], counts[m], rows[m]
        row = Row(
            wheels.y, wheels.z, wheels.slope, wheels.angle, wheels.gap[r], wheels.radius[r],
            wheels.along[r], wheels.low[r], wheels.kappa, 0.0, wheels.vertical,
        )  # fmt: skip
        at, rank, n = places[m], ranks[m], one.nodes
        x, f, c = nodes[0, at, rank][:n], nodes[1, at, rank][:n], nodes[2, at, rank][:n]
        left, right, slope = one.start, one.stop, work.right
        _slopes(x, f, slope)
        least = 0.0
        for k in range(n):
            least = max(least, 1e-9 * f[k])
        # The largest pressure on a fine grid of its own.
        total, peak, k = 0.0, 0.0, 0
        for j in range(_FINE):
            place = left + (right - left) * (j + 0.5) / _FINE
            while k < n - 2 and x[k + 1] < place:
                k += 1
            q, ratio = _between(x, f, slope, c, least, place, k)
            total += q * ratio
            peak = max(peak, ratio * np.sqrt(q))
        one.pressure = peak * one.force / (0.5 * np.pi * total * (right - left) / _FINE)
        # Strips of the solution, along the profile.
        first, last = points_in_plane(one.origin, one.angle, left, right, row, work.s)
        s, y = work.s[first : last + 1], row.y[first : last + 1]
        gap, along = row.gap[first : last + 1], row.along[first : last + 1]
        step = (right - left) / strips
        edge, volume, moment = out.edge[m], 0.0, 0.0
        i = k = 0
        for half in range(2 * strips + 1):  # strip edges and centres in turn
            place, j = left + 0.5 * half * step, half // 2
            while i < s.size - 2 and s[i + 1] < place:
                i += 1
            share = (place - s[i]) / (s[i + 1] - s[i])
            if half % 2 == 0:
                edge[j] = y[i] + share * (y[i + 1] - y[i])
                continue
            while k < n - 2 and x[k + 1] < place:
                k += 1
            q, ratio = _between(x, f, slope, c, least, place, k)
            out.y[m, j], out.half[m, j], out.slope[m, j] = place, np.sqrt(q), ratio
            out.middle[m, j] = along[i] + share * (along[i + 1] - along[i])
            volume += q * ratio * step
            moment += q * ratio * step * place
        middle = moment / volume
        k = min(max(int((middle - left) / step), 0), strips - 1)
        one.centre = edge[k] + ((middle - left) / step - k) * (edge[k + 1] - edge[k])
        middle_x = value_at(middle, out.y[m, :strips], out.middle[m, :strips])
        for j in range(strips):
            out.y[m, j] -= middle
            out.slope[m, j] *= one.force / (0.5 * np.pi * volume)
            out.middle[m, j] -= middle_x
        for j in range(strips, out.y.shape[1]):
            out.y[m, j], out.half[m, j] = out.y[m, strips - 1], 0.0
            out.middle[m, j], out.slope[m, j] = out.middle[m, strips - 1], out.slope[m, strips - 1]
            edge[j + 1] = edge[strips]
        lowest = min(value_at(left, s, gap), value_at(right, s, gap))
        for k in range(gap.size):
            if left < s[k] < right:
                lowest = min(lowest, gap[k])
        one.approach = (one.displacement - (lowest - row.low)) * np.cos(one.angle)
        one.left, one.right = edge[0], edge[strips]
        if m + 1 == rows.size or rows[m + 1] != r:
            share_points(patches[m - ranks[m] : m + 1], row, work.share)
