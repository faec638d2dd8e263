"""Strips of a wheel, fitted to its patches.

Equations and sources: see `coupled_strips`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.contact.geometry import NO_WHEEL
from wearsim.contact.kernel import bare_kernel, inner_bare_kernel
from wearsim.contact.normal.coupled_strips.equations import Equations, equations_for, pair_up, solve_strips
from wearsim.contact.normal.coupled_strips.influence import LOWEST, PER_OCTAVE, column_at, influence_at
from wearsim.contact.normal.coupled_strips.strips import (
    PART,
    SHORT,
    Records,
    Row,
    Strips,
    arrange,
    hardly_carries,
    lay_strips,
    linear_at,
    room_for_strips,
    strips_for,
)
from wearsim.contact.normal.model import AT_EDGE, FAINT, NO_BALANCE, NO_CONTACT, NOT_SINGLE
from wearsim.contact.patch import FloatArray, IntArray

NO_ROOM = -1  # fault of a row with more parts or strips than there is room for

MOST_STRIPS = 40  # of a part
_LEVELS = 12  # trials of the overlap that holds all contacts
_OVER, _UNDER = 0.98, 0.4  # displacement over this overlap, within which it is taken
_PENETRATION = 0.55  # displacement over this overlap, in the patch of virtual penetration
_SLENDER = 0.137  # growth of c / (k E*), which is 1/2 of a cylinder, with length over width of an ellipse
_FIRST_STRIPS, _FEWEST_FIRST = 8, 4  # of the widest part and of any, in the first set
_FIRST_STEPS, _STEPS = 12, 12
_FITS = 12  # sets of strips
_FREE_FITS = 4  # sets in which parts may split, and ends go all the way
_FEWEST = 8  # strips of a part
_NARROW = 1.5  # strips of a part go with the root of its width, from the widest divided by its square
_APART = 3.0  # steps of the profile between parts, at least
_EVEN, _FARTHEST = 0.7, 4.0  # of its neighbour's q, from which the patch goes on for so many strips
_SHORT, _LONG = 0.4, 4.0  # of the way to the end of a patch, for the next set of strips
_BARELY = 1e-6  # steps of the profile
_SLIGHT = 2e-4  # of the load: parts below are left out
_STILL, _TURNED = 0.01, 1e-5  # of a strip and rad, by which ends and planes may be off in the end
_NEAR = 0.25  # of a strip, by which ends are off when strips are solved exactly
_ENOUGH = 0.3  # change of the load of strips in the last step that is no failure yet
_FIRST, _ROUGH = 0.1, 1e-2  # tolerance of the load of strips
_EXACT, _SHARED = 5e-4, 3e-4  # in the end: of one part, and of several, which share the load
_SMALLEST = 5e-4  # of the load: patches below are left out
_INSERTED = 2  # parts at most that the overlap of the displaced surfaces adds
_OVERLAP = 1e-3  # of the displacement, of surfaces that have missed each other
_SAMPLED = 5  # steps of the profile between places where surfaces might meet outside of the parts


class Wheels(NamedTuple):
    """Profile of the counterface, gap of every row with the wheel there, and surface of the wheel."""

    y: FloatArray
    z: FloatArray
    slope: FloatArray
    angle: FloatArray
    gap: FloatArray
    radius: FloatArray
    along: FloatArray
    wheel_y: FloatArray
    sin_theta: FloatArray
    low: FloatArray
    sin_yaw: FloatArray
    surface_y: FloatArray
    surface_slope: FloatArray
    kappa: float
    vertical: bool


class Start(NamedTuple):
    """Strips of a solution nearby: of each row the first patch (n + 1,); of each patch its strips.

    `strips` (k,), `edge` (k, j + 1) on the profile, `square` and `ratio` (k, j); `displacement` (k,).
    """

    first: IntArray
    strips: IntArray
    edge: FloatArray
    square: FloatArray
    ratio: FloatArray
    displacement: FloatArray


# Patch of the solution: first and last strip; vertical displacement from the design height of the wheel,
# force, factor on it, angle of the plane and of the patch alone; stations of both ends. The rest is filled by
# `cut_patches`.
PATCH = np.dtype(
    [(name, int) for name in ("first", "last")]
    + [
        (name, float)
        for name in (
            "displacement", "force", "scale", "angle", "own", "start", "stop",
            "centre", "approach", "pressure", "width", "left", "right",
            "point", "point_approach", "across", "along",
        )
    ]
)  # fmt: skip


class Work(NamedTuple):
    """Strips and parts of a wheel, those of the set before, and room for the equations."""

    strips: Strips
    old: Strips
    parts: Records
    fresh: Records
    share: FloatArray
    widths: FloatArray
    equations: Equations


def work_for(most: int, parts: int, given: int, points: int, table: FloatArray) -> Work:
    """Room for so many strips in parts of a profile of so many points; `given` strips to start from."""
    return Work(
        strips_for(max(most, given)),
        strips_for(max(most, given)),
        np.zeros(parts, PART),
        np.zeros(parts, PART),
        np.zeros((parts, parts)),
        np.empty(points),
        equations_for(most, table),
    )


@bare_kernel
def solve_wheels(
    wheels: Wheels, rows: IntArray, load: FloatArray, start: Start, count: int, work: Work,
    number: IntArray, fault: IntArray, patches: Records, kept: FloatArray,
) -> None:  # fmt: skip
    """Solve every row and find its patches, by falling normal force.

    `kept` (3, n, most) are place in the plane, q and ratio of the strips.
    """
    for n in range(rows.size):
        row = row_of(wheels, rows[n], load[n])
        fault[n], total, parts, displacement = NO_BALANCE, 0, 0, 0.0
        if start.first[n + 1] > start.first[n]:
            parts, total = _take_over(n, start, row, work)
            displacement = start.displacement[start.first[n]] - row.low
            fault[n], total, parts, displacement = _fit(total, parts, displacement, count, row, work)
        if fault[n] > 0:
            fault[n], total, parts, displacement = _press(row, work)
            if fault[n] == 0:
                fault[n], total, parts, displacement = _fit(total, parts, displacement, count, row, work)
        if fault[n] == 0:
            fault[n], number[n] = _find_patches(total, displacement, row, work, patches[n], kept[:, n])


@inner_bare_kernel
def row_of(wheels: Wheels, r: int, load: float) -> Row:
    """One row of the gap."""
    return Row(
        wheels.y, wheels.z, wheels.slope, wheels.angle, wheels.gap[r], wheels.radius[r], wheels.along[r],
        wheels.wheel_y[r], wheels.sin_theta[r], wheels.surface_y, wheels.surface_slope, wheels.sin_yaw[r],
        wheels.kappa, wheels.low[r], load, wheels.vertical,
    )  # fmt: skip


@inner_bare_kernel
def _take_over(n: int, start: Start, row: Row, work: Work) -> tuple[int, int]:
    """Take the strips of a solution nearby as those of the set before; return parts and strips."""
    total, count = 0, 0
    for m in range(start.first[n], start.first[n + 1]):
        k = 0
        before = 0.0
        for j in range(start.strips[m] + 1):
            place = start.edge[m, j]
            while k < row.y.size - 2 and row.y[k + 1] < place:
                k += 1
            station = k + (place - row.y[k]) / (row.y[k + 1] - row.y[k])
            if j > 0:
                square, ratio = start.square[m, j - 1], start.ratio[m, j - 1]
                _set_old(total, count, before, station, square, ratio, row, work)
                total += 1
            before = station
        count += 1
    return count, total


@inner_bare_kernel
def _set_old(
    j: int, part: int, start: float, stop: float, square: float, ratio: float, row: Row, work: Work
) -> None:
    """Put a strip between two stations into the set before."""
    strips = work.strips
    across = linear_at(row.y, stop) - linear_at(row.y, start)
    down = linear_at(row.z, stop) - linear_at(row.z, start)
    strips.part[j], strips.station[j] = part, 0.5 * (start + stop)
    strips.width[j] = np.sqrt(across * across + down * down)
    strips.y[j] = linear_at(row.y, strips.station[j])
    strips.tilt[j] = linear_at(row.angle, strips.station[j])
    strips.square[j], strips.ratio[j], strips.gap[j] = square, ratio, 0.0


@inner_bare_kernel
def _press(row: Row, work: Work) -> tuple[int, int, int, float]:
    """Solve a first set of strips over the overlap of the rigid surfaces under a displacement by trial.

    It holds all contacts if the displacement of the solution is less.
    """
    if not row.low < NO_WHEEL:
        return NO_CONTACT, 0, 0, 0.0
    # Of the displacement of a ball of 1 m radius; load is 2 N / (pi^2 E*).
    level = 1.5 * (0.5 * np.pi**2 * row.load) ** (2.0 / 3.0)
    strips, parts, room = work.strips, work.parts, work.equations.active.size
    for trial in range(_LEVELS):
        count = _overlaps(level, row, parts)
        if count < 0:
            return NO_ROOM, 0, 0, 0.0
        if count == 0:
            return AT_EDGE, 0, 0, 0.0
        arrange(parts, count, row, work.share)
        widest = 0.0
        for k in range(count):
            widest = max(widest, parts[k].right - parts[k].left)
        total = 0
        for k in range(count):
            share = np.sqrt((parts[k].right - parts[k].left) / widest)
            fewest = max(int(_FIRST_STRIPS * share), _FEWEST_FIRST)
            more = lay_strips(
                k, float(fewest), 2 * fewest, level, row, parts, strips, total, room, work.widths
            )
            if more == 0:
                return NO_ROOM, 0, 0, 0.0
            total += more
        _guess(total, level, parts, strips)
        pair_up(strips, total, work.share, parts.angle, work.equations)
        displacement, change = solve_strips(
            strips, total, row.load, level, _FIRST_STEPS, _FIRST, work.equations
        )
        if change < _FIRST and _UNDER * level < displacement < _OVER * level:
            return 0, total, count, displacement
        aim = 1.15 * min(max(displacement, 0.1 * level), 10.0 * level) if change < 1.0 else 1.5 * level
        level = aim if trial < 3 else np.sqrt(level * aim)
    return _edge_or(NO_BALANCE, total, row, work), 0, 0, 0.0


@inner_bare_kernel
def _guess(total: int, level: float, parts: Records, strips: Strips) -> None:
    """Set half-lengths by virtual penetration, and ratios as of ellipses of that length and width."""
    first = 0
    while first < total:
        part, stop, longest, width = parts[strips.part[first]], first, 0.0, 0.0
        while stop < total and strips.part[stop] == strips.part[first]:
            depth = max(_PENETRATION * level - strips.gap[stop], 0.0) * strips.turn[stop]
            strips.square[stop] = 2.0 * depth / strips.bend[stop]
            longest = max(longest, strips.square[stop])
            width += strips.width[stop] * part.strips / (part.strips + 2.0)
            stop += 1
        slender = 2.0 * np.sqrt(longest / _PENETRATION) / width
        for j in range(first, stop):
            strips.ratio[j] = (0.5 + _SLENDER * slender) / np.pi * strips.bend[j]
        first = stop


@inner_bare_kernel
def _overlaps(level: float, row: Row, parts: Records) -> int:
    """Find the parts of the profile that overlap under a displacement; -1 where there is no room for them."""
    count, k, points = 0, 0, row.gap.size
    while k < points:
        if row.gap[k] - row.low >= level:
            k += 1
            continue
        first = k
        while k < points and row.gap[k] - row.low < level:
            k += 1
        start, stop = max(first, 1), min(k, points - 2)
        if stop - start < 2:
            continue
        if count == parts.size:
            return -1
        part = parts[count]
        part.left, part.right = float(start), float(stop - 1)
        if start == first and row.gap[first - 1] < NO_WHEEL:
            part.left -= (level - row.gap[first] + row.low) / (row.gap[first - 1] - row.gap[first])
        if stop == k and row.gap[k] < NO_WHEEL:
            part.right += (level - row.gap[k - 1] + row.low) / (row.gap[k] - row.gap[k - 1])
        force, moment, tilt = 0.0, 0.0, 0.0
        for i in range(start, stop):
            depth = (level - row.gap[i] + row.low) * (row.y[i + 1] - row.y[i - 1])
            force += depth
            moment += depth * row.y[i]
            tilt += depth * row.angle[i]
        part.force, part.middle, part.own, part.strips = force, moment / force, tilt / force, 0
        count += 1
    return count


@inner_bare_kernel
def _edge_or(fault: int, total: int, row: Row, work: Work) -> int:
    """Fault of a wheel: that at an edge where a strip with more than a faint load has no wheel beside it."""
    strips = work.strips
    for j in range(total):
        carried = strips.ratio[j] * strips.square[j] * strips.width[j]
        if carried < FAINT * row.load:
            continue
        for i in (j - 1, j + 1):
            if 0 <= i < total and strips.part[i] == strips.part[j] and strips.gap[i] >= NO_WHEEL:
                return AT_EDGE
    return fault


@inner_bare_kernel
def _fit(
    total: int, parts: int, displacement: float, count: int, row: Row, work: Work
) -> tuple[int, int, int, float]:
    """Lay strips between the ends of the patches and solve them, until both stay."""
    tolerance, off, inserted = 1.0, 1.0, 0
    first, last = room_for_strips(row)
    for fit in range(_FITS):
        fresh = _find_parts(total, fit < _FREE_FITS, work)
        if fresh == 0:
            return NO_BALANCE, total, parts, displacement
        if fresh < 0:
            return NO_ROOM, total, parts, displacement
        arrange(work.fresh, fresh, row, work.share)
        off, turned = _aim(fresh, parts, work) if fit > 0 else (1.0, 1.0)
        if tolerance < _ROUGH and off < _STILL and turned < _TURNED:
            missed = _missed(total, parts, displacement, row, work) if inserted < _INSERTED else 0.0
            if missed == 0.0:
                break
            inserted += 1
            if fresh == work.fresh.size:
                return NO_ROOM, total, parts, displacement
            fresh = _insert(missed, fresh, row, work)
            arrange(work.fresh, fresh, row, work.share)
            off = 1.0
        # Strips next to an edge still have a spare one.
        work.fresh[0].left = max(work.fresh[0].left, first)
        work.fresh[fresh - 1].right = min(work.fresh[fresh - 1].right, last)
        total = _lay_again(total, fresh, count, displacement, row, work)
        if total == 0:
            return NO_ROOM, total, parts, displacement
        parts = fresh
        exact = _EXACT if parts == 1 else _SHARED
        tolerance = exact if off < _NEAR or fit >= _FREE_FITS else _ROUGH
        pair_up(work.strips, total, work.share, work.parts.angle, work.equations)
        displacement, change = solve_strips(
            work.strips, total, row.load, displacement, _STEPS, tolerance, work.equations
        )
        if change > _ENOUGH:
            return _edge_or(NO_BALANCE, total, row, work), total, parts, displacement
    return _edge_or(0, total, row, work), total, parts, displacement


@inner_bare_kernel
def _find_parts(total: int, split: bool, work: Work) -> int:
    """Find the runs of strips with pressure, or all of a part unless it may be split, in `fresh`.

    Runs that come near each other are one; -1 where there is no room for them.
    """
    strips, fresh, count, j = work.strips, work.fresh, 0, 0
    whole = 0.0
    for i in range(total):
        whole += strips.ratio[i] * strips.square[i] * strips.width[i]
    while j < total:
        if strips.square[j] <= 0.0:
            j += 1
            continue
        first = last = j
        while j < total and strips.part[j] == strips.part[first]:
            if strips.square[j] > 0.0:
                last = j
            elif split:
                break
            j += 1
        force, moment, tilt = 0.0, 0.0, 0.0
        for i in range(first, last + 1):
            carried = strips.ratio[i] * strips.square[i] * strips.width[i]
            force += carried
            moment += carried * strips.y[i]
            tilt += carried * strips.tilt[i]
        if force < _SLIGHT * whole:
            continue
        left, right = end_of(strips, first, last, -1, total), end_of(strips, first, last, 1, total)
        if count > 0 and left - fresh[count - 1].right < _APART:
            before = fresh[count - 1]
            both = before.force + force
            before.middle = (before.force * before.middle + moment) / both
            before.own = (before.force * before.own + tilt) / both
            before.force, before.right = both, max(before.right, right)
            continue
        if count == fresh.size:
            return -1
        part = fresh[count]
        part.left, part.right, part.force = left, right, force
        part.middle, part.own = moment / force, tilt / force
        part.left_missed = part.right_missed = 0.0
        part.strips = 0
        count += 1
    return count


@inner_bare_kernel
def end_of(strips: Strips, first: int, last: int, way: int, total: int) -> float:
    """Station where q, linear in the outermost strips of a run, is zero; at most a strip beyond them.

    An outermost strip that hardly carries does not count: the end is continuous as it gets and loses contact.
    """
    end = first if way < 0 else last
    inside = end - way
    if first == last:
        beside = end + way
        if not 0 <= beside < total or strips.part[beside] != strips.part[end]:
            beside = end - way
        return strips.station[end] + 0.5 * way * abs(strips.station[beside] - strips.station[end])
    beyond = end + way
    laid = 0 <= beyond < total and strips.part[beyond] == strips.part[end]
    if not laid and strips.square[end] > _EVEN * strips.square[inside]:
        # Contact goes on far beyond the strips.
        return strips.station[end] + _FARTHEST * (strips.station[end] - strips.station[inside])
    place = _zero_beyond(strips, end, inside)
    if not hardly_carries(strips, end, inside) or last - first < 2:
        return place
    before = _zero_beyond(strips, inside, inside - way)
    return before + strips.square[end] / (SHORT * strips.square[inside]) * (place - before)


@inner_bare_kernel
def _zero_beyond(strips: Strips, end: int, inside: int) -> float:
    """Station where q, linear from one strip to the next, is zero; at most a strip beyond it."""
    distance = strips.station[end] - strips.station[inside]
    fall = strips.square[inside] - strips.square[end]
    share = strips.square[end] / fall if fall > strips.square[end] else 1.0
    return strips.station[end] + share * distance


@inner_bare_kernel
def _aim(fresh: int, parts: int, work: Work) -> tuple[float, float]:
    """Move the ends of fresh parts by secants to where the patches would end on strips laid there.

    Return by how much ends [strips] and planes [rad] differ from those of the set before.
    """
    if fresh != parts:
        return 1.0, 1.0
    moved, turned = 0.0, 0.0
    for k in range(parts):
        now, laid = work.fresh[k], work.parts[k]
        now.strips = laid.strips
        width = (now.right - now.left) / laid.strips
        left_missed, right_missed = now.left - laid.left, now.right - laid.right
        if max(abs(left_missed), abs(right_missed)) > width:
            moved = 1.0
            continue
        left = _step(left_missed, laid.left - laid.left_before, laid.left_missed)
        right = _step(right_missed, laid.right - laid.right_before, laid.right_missed)
        now.left_before, now.left_missed, now.left = laid.left, left_missed, laid.left + left
        now.right_before, now.right_missed, now.right = laid.right, right_missed, laid.right + right
        moved = max(moved, abs(left) / width, abs(right) / width)
        turned = max(turned, abs(now.angle - laid.angle))
    return moved, turned


@inner_bare_kernel
def _step(missed: float, moved: float, missed_before: float) -> float:
    """Step of an end that misses its place, from how that changed with the last one."""
    change = missed_before - missed
    share = moved / change if missed_before != 0.0 and abs(change) > _BARELY else 1.0
    return min(max(share, _SHORT), _LONG) * missed


@inner_bare_kernel
def _lay_again(total: int, parts: int, count: int, displacement: float, row: Row, work: Work) -> int:
    """Lay strips in the fresh parts, with the pressures of the set before; return their number."""
    strips, old, room = work.strips, work.old, work.equations.active.size
    for j in range(total):
        old.station[j], old.square[j], old.ratio[j] = strips.station[j], strips.square[j], strips.ratio[j]
    widest = 0.0
    for k in range(parts):
        work.parts[k] = work.fresh[k]
        widest = max(widest, work.parts[k].right - work.parts[k].left)
    number, i = 0, 0
    for k in range(parts):
        left, right = work.parts[k].left, work.parts[k].right
        asked = max(count * min(_NARROW * np.sqrt((right - left) / widest), 1.0), float(_FEWEST))
        more = lay_strips(
            k, asked, MOST_STRIPS, displacement, row, work.parts, strips, number, room, work.widths
        )
        if more == 0:
            return 0
        for j in range(number, number + more):
            place = strips.station[j]
            while i < total and old.station[i] < place:
                i += 1
            before, behind = max(i - 1, 0), min(i, total - 1)
            nearer = before if abs(old.station[before] - place) < abs(old.station[behind] - place) else behind
            strips.ratio[j] = old.ratio[nearer]
            start, low, stop, high = left, 0.0, right, 0.0
            if i > 0 and old.station[before] > left:
                start, low = old.station[before], old.square[before]
            if i < total and old.station[behind] < right:
                stop, high = old.station[behind], old.square[behind]
            share = (place - start) / (stop - start)
            strips.square[j] = low + share * (high - low) if left < place < right else 0.0
            if i > 0 and i < total and old.station[before] > left and old.station[behind] < right:
                strips.ratio[j] = old.ratio[before] + share * (old.ratio[behind] - old.ratio[before])
        number += more
    return number


@inner_bare_kernel
def _missed(total: int, parts: int, displacement: float, row: Row, work: Work) -> float:
    """Station where the displaced surfaces overlap most outside of the parts, or 0."""
    strips, k, station, deepest = work.strips, 0, 0.0, -_OVERLAP * displacement
    table = work.equations.table
    for i in range(1, row.gap.size - 2):
        if row.gap[i] - row.low >= displacement:
            continue
        lowest = row.gap[i] < row.gap[i - 1] and row.gap[i] <= row.gap[i + 1]
        if i % _SAMPLED > 0 and not lowest:
            continue
        while k < parts and work.parts[k].right + _beside(work.parts[k]) < i:
            k += 1
        if k < parts and work.parts[k].left - _beside(work.parts[k]) < i:
            continue
        # Part of the profile next to it, whose share in others it takes.
        near = min(k, parts - 1)
        if 0 < k < parts and i - work.parts[k - 1].right < work.parts[k].left - i:
            near = k - 1
        cosine, sine = np.cos(work.parts[near].angle), np.sin(work.parts[near].angle)
        height = (row.gap[i] - row.low - displacement) * np.cos(row.angle[i])
        for j in range(total):
            share = work.share[strips.part[j], near]
            if strips.square[j] <= 0.0 or share == 0.0:
                continue
            half = np.sqrt(strips.square[j])
            distance = abs((row.y[i] - strips.y[j]) * cosine + (row.z[i] - strips.z[j]) * sine)
            off = (row.along[i] - strips.middle[j]) / half
            far = (np.log2((distance + 0.5 * strips.width[j]) / half) - LOWEST) * PER_OCTAVE
            close = (np.log2(abs(distance - 0.5 * strips.width[j]) / half) - LOWEST) * PER_OCTAVE
            column, part, beyond = column_at(off)
            farther = PER_OCTAVE * np.log2(beyond)
            influence = influence_at(table, column, part, far - farther)[0]
            influence -= influence_at(table, column, part, close - farther)[0]
            height += share * strips.ratio[j] * strips.square[j] * influence
        if height < deepest:
            station, deepest = float(i), height
    return station


@inner_bare_kernel
def _beside(part: Records) -> float:
    """Width of a strip of a part, up to which surfaces next to it are looked after by its spare strips."""
    width: float = (part.right - part.left) / part.strips + _APART
    return width


@inner_bare_kernel
def _insert(station: float, parts: int, row: Row, work: Work) -> int:
    """Put a narrow part without force at a station among the fresh ones; return their number."""
    fresh, k = work.fresh, parts
    while k > 0 and fresh[k - 1].left > station:
        fresh[k] = fresh[k - 1]
        k -= 1
    part = fresh[k]
    part.left, part.right, part.force = station - _APART, station + _APART, 0.0
    part.middle, part.own = linear_at(row.y, station), linear_at(row.angle, station)
    part.left_missed = part.right_missed = 0.0
    part.strips = 0
    return parts + 1


@inner_bare_kernel
def _find_patches(
    total: int, displacement: float, row: Row, work: Work, patches: Records, kept: FloatArray
) -> tuple[int, int]:
    """Find the patches of a wheel, by falling normal force; return a fault or 0, and their number."""
    strips, count, j, carried = work.strips, 0, 0, 0.0
    for i in range(total):
        angle = work.parts[strips.part[i]].angle
        kept[0, i] = strips.y[i] * np.cos(angle) + strips.z[i] * np.sin(angle)
        kept[1, i], kept[2, i] = strips.square[i], strips.ratio[i]
    while j < total:
        first, force, tilt = j, 0.0, 0.0
        while j < total and strips.square[j] > 0.0 and strips.part[j] == strips.part[first]:
            part = strips.ratio[j] * strips.square[j] * strips.width[j]
            force += part
            tilt += part * strips.tilt[j]
            j += 1
        if force <= _SMALLEST * row.load:
            j = max(j, first + 1)
            continue
        if count == patches.size:
            return NO_ROOM, count
        carried += force * strips.lift[first]
        place = count
        count += 1
        while place > 0 and patches[place - 1].force < force:
            patches[place] = patches[place - 1]
            place -= 1
        patch = patches[place]
        patch.first, patch.last, patch.force, patch.own = first, j - 1, force, tilt / force
        patch.displacement, patch.angle = displacement + row.low, work.parts[strips.part[first]].angle
        patch.start = end_of(strips, first, j - 1, -1, total)
        patch.stop = end_of(strips, first, j - 1, 1, total)
        # Strips that hardly carry, beyond the ends.
        while patch.first < patch.last and strips.station[patch.first] < patch.start:
            patch.first += 1
        while patch.first < patch.last and strips.station[patch.last] > patch.stop:
            patch.last -= 1
    if count == 0:
        return NO_BALANCE, 0
    if count > 1 and not row.vertical:
        return NOT_SINGLE, count
    for m in range(count):
        patches[m].scale = row.load / carried
        patches[m].force *= patches[m].scale
    return 0, count
