"""Kernels of the strip model: strips on a profile and their contact planes.

Equations and sources: see `knothe_le_the`.

Loads are divided by pi E*: P = p a / (pi E*) [m] for a strip of half-length a and largest pressure p;
q = a^2 [m2].
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np

from wearsim.contact.geometry import NO_WHEEL
from wearsim.contact.kernel import inner_bare_kernel
from wearsim.contact.normal.model import blended, plane_share
from wearsim.contact.patch import FloatArray, IntArray

NO_ROOM = -1  # fault of a row with more parts or strips than there is room for

Records: TypeAlias = Any  # numpy record array
Record: TypeAlias = Any  # one line of it


class Row(NamedTuple):
    """Wheel over its counterface at the grid points: profile, gap, rings; and what is asked of it.

    `low` is the lowest gap, `load` is over pi E* and counts vertically or along the normal.
    """

    y: FloatArray
    z: FloatArray
    slope: FloatArray
    angle: FloatArray
    gap: FloatArray
    radius: FloatArray
    along: FloatArray
    low: float
    kappa: float
    load: float
    vertical: bool


def _record(whole: str, real: str, pairs: str = "") -> np.dtype[np.void]:
    """Record with fields of whole numbers, of real ones, and of one for either end."""
    fields: list[Any] = [(name, int) for name in whole.split()] + [(name, float) for name in real.split()]
    return np.dtype(fields + [(name, float, (2,)) for name in pairs.split()])


# Strip: place s in its contact plane, gap, share of the displacement in it, factors of x^2 and x^4 in the gap
# along it, P, q, profile y and z, width, cosine and angle of the plane, y of its origin, the profile's
# angle, logarithm of the half-length; number of the part of the profile.
STRIP = _record("part", "s gap turn bend bend_more load square y z width cosine angle origin tilt log")
# Part of the profile: number of strips, whether they are those of a start, the angle of their plane then;
# half-length squared per depth, gap where it ends and load per half-length squared as first pressed in; its
# ends, then places and what was missed there, of both: one too far out, one too far in, the last one tried;
# what is missed where no place is without a miss, in widths of a strip.
SPAN = _record(
    "strips laid",
    "angle per_depth rim per_square",
    "ends outer outer_miss inner inner_miss last last_miss beyond",
)
# Plane of a part: place, angle, load, and the angle the part has for itself.
PLANE = _record("", "middle tilt weight own")
# Patch of the solution: strips it is from, number of nodes, strips of its part, force, load scale,
# displacement, angle and origin of its plane, s of both ends, its angle for itself; centre y, approach,
# largest pressure and both ends y; creepage reference point y, approach there, and how far across and along
# its centre lies from there; ends of its part and what is missed beyond them.
PATCH = _record(
    "first last nodes strips",
    "force scale displacement angle origin start stop own centre approach pressure left right "
    "point point_approach across along",
    "ends beyond",
)
# Of how many strips of a part alone the distances are; how many the steps before had, steps kept;
# logarithm of the width the distances are over; what is left to go; change of the logarithm of a half-length
# up to which averages are expanded.
STATE = _record("alone listed steps", "log_width left nearby")


class Work(NamedTuple):
    """Strips of a wheel, their equations, and what is kept of them from one set to the next.

    `nearer` and `farther` are logarithms of the distance of a strip to either edge of another, the same for
    both (of strips of unlike width the mean is taken), and `part` the share of the elastic influence.
    `active` are the strips with pressure, `matrix` and `right` the equations of their loads, `listed` the
    strips of the steps before. `logs` are the logarithms of the half-lengths, `terms` (6, n, n) the
    averages' expansion about the logarithms `base`, `mean` and `above` what it gives; `mean` and terms 0, 2
    and 5 on and above the diagonal only (`mean_on`). `steps` are the logarithms of 0.5, 0.5, 1.5 and so on.
    Of the steps before, `moves` (k, n) are the differences of q, `changes` those of what it missed, `aims`
    both of the last one, and `gram` is the normal equations of the next. `s`, `opening` and `turn` are
    places in a plane, gap and share of the displacement at the points of the profile; `bow` and `sums` (3,
    n) for work.
    """

    strips: Records
    old: Records
    spans: Records
    fresh: Records
    planes: Records
    states: Records
    share: FloatArray
    active: IntArray
    listed: IntArray
    steps: FloatArray
    nearer: FloatArray
    farther: FloatArray
    part: FloatArray
    mean: FloatArray
    above: FloatArray
    matrix: FloatArray
    right: FloatArray
    bow: FloatArray
    logs: FloatArray
    base: FloatArray
    moves: FloatArray
    changes: FloatArray
    aims: FloatArray
    gram: FloatArray
    terms: FloatArray
    sums: FloatArray
    s: FloatArray
    opening: FloatArray
    turn: FloatArray


STEPS = 5  # before, from which the next one is made


def work_for(most: int, parts: int, given: int, points: int) -> Work:
    """Room for `most` strips in parts of a profile of so many points, and their equations."""
    room: tuple[Any, ...] = (
        np.zeros(most, STRIP), np.zeros(max(most, given), STRIP),
        np.zeros(parts, SPAN), np.zeros(parts, SPAN), np.zeros(parts, PLANE), np.zeros(1, STATE),
        np.eye(parts), *np.zeros((2, most + 1), np.int64), np.log(np.abs(np.arange(most + 1) - 0.5)),
        *np.empty((6, most, most)), *np.empty((4, most + 1)),
        *np.empty((2, STEPS, most)), np.empty((2, most)), np.empty((STEPS, STEPS + 1)),
        np.empty((6, most, most)), np.empty((3, most)), *np.empty((3, points)),
    )  # fmt: skip
    return Work(*room)


MARGIN = 0.3  # strips' widths laid beyond the end of the patch
# Angles between the planes up to which strips have full influence on each other, and from which on none: next
# to each other, and from 10 mm on as contacts share a plane.
_NEXT, _AWAY = 4e-3, 10e-3
_FULL_NEXT, _NONE_NEXT, _FULL_AWAY, _NONE_AWAY = 0.349, 0.698, 0.2, 0.3


@inner_bare_kernel
def points_in_plane(
    origin: float, delta: float, left: float, right: float, row: Row, s: FloatArray
) -> tuple[int, int]:
    """Places in a plane of the points of the profile from one before `left` to one behind `right`."""
    cosine, sine, base = np.cos(delta), np.sin(delta), value_at(origin, row.y, row.z)
    first = last = first_beyond(row.y, row.y.size, origin) - 1
    s[first] = (row.y[first] - origin) * cosine + (row.z[first] - base) * sine
    while s[first] > left and first > 0:
        first -= 1
        s[first] = (row.y[first] - origin) * cosine + (row.z[first] - base) * sine
    while s[last] < right and last < row.y.size - 1:
        last += 1
        s[last] = (row.y[last] - origin) * cosine + (row.z[last] - base) * sine
    return first, last


@inner_bare_kernel
def cut_strips(
    ends: FloatArray, middle: float, delta: float, row: Row, work: Work, first: int, count: int
) -> bool:
    """Lay strips of equal width between two places of a profile in the plane through `middle`.

    The gap of a strip is its mean over the width. Returns whether there is a wheel all along.
    """
    strips, s, opening, turn = work.strips, work.s, work.opening, work.turn
    cosine, sine, base = np.cos(delta), np.sin(delta), value_at(middle, row.y, row.z)
    left = (ends[0] - middle) * cosine + (value_at(ends[0], row.y, row.z) - base) * sine
    right = (ends[1] - middle) * cosine + (value_at(ends[1], row.y, row.z) - base) * sine
    i, stop = points_in_plane(middle, delta, left, right, row, s)
    if i < 2 or stop > row.y.size - 3:
        return False
    for k in range(i, stop + 1):
        if row.gap[k] >= NO_WHEEL:
            return False
        wheel = row.slope[k] - (row.gap[k + 1] - row.gap[k - 1]) / (row.y[k + 1] - row.y[k - 1])
        turn[k] = 1.0 / (cosine + wheel * sine)
        opening[k] = (row.gap[k] - row.low) * turn[k]
    width = (right - left) / count
    place, total = left, 0.0
    height = opening[i] + (left - s[i]) / (s[i + 1] - s[i]) * (opening[i + 1] - opening[i])
    for half in range(1, 2 * count + 1):
        aim = left + 0.5 * half * width
        while True:
            until = min(aim, s[i + 1])
            share = (until - s[i]) / (s[i + 1] - s[i])
            value = opening[i] + share * (opening[i + 1] - opening[i])
            total += 0.5 * (height + value) * (until - place)
            place, height = until, value
            if aim <= s[i + 1] or i + 1 == stop:
                break
            i += 1
        one = strips[first + (half - 1) // 2]
        if half % 2 == 0:
            one.gap = total / width
            total = 0.0
            continue
        z = row.z[i] + share * (row.z[i + 1] - row.z[i])
        one.s, one.z, one.width = aim, z, width
        one.y = row.y[i] + share * (row.y[i + 1] - row.y[i])
        one.turn = turn[i] + share * (turn[i + 1] - turn[i])
        one.tilt = row.angle[i] + share * (row.angle[i + 1] - row.angle[i])
        wheel = cosine / (row.radius[i] + share * (row.radius[i + 1] - row.radius[i]))
        counterface = row.kappa / (1.0 - row.kappa * z) * cosine
        one.bend, one.bend_more = 0.5 * (wheel + counterface), 0.125 * (wheel**3 + counterface**3)
        one.cosine, one.angle, one.origin = cosine, delta, middle
    return True


@inner_bare_kernel
def influence_share(turn: float, distance: float) -> float:
    """Share of the elastic influence of strips at a distance whose planes differ by an angle."""
    away = min(max((distance - _NEXT) / (_AWAY - _NEXT), 0.0), 1.0)
    full = _FULL_NEXT + away * (_FULL_AWAY - _FULL_NEXT)
    none = _NONE_NEXT + away * (_NONE_AWAY - _NONE_NEXT)
    share: float = min(max((none - abs(turn)) / (none - full), 0.0), 1.0)
    return share


@inner_bare_kernel
def value_at(y: float, grid_y: FloatArray, table: FloatArray) -> float:
    """Value at a place of the profile, linear between its points."""
    i = min(max(first_beyond(grid_y, grid_y.size, y) - 1, 0), grid_y.size - 2)
    value: float = table[i] + (y - grid_y[i]) / (grid_y[i + 1] - grid_y[i]) * (table[i + 1] - table[i])
    return value


@inner_bare_kernel
def first_beyond(grid: FloatArray, count: int, value: float) -> int:
    """How many of the first `count` values of a rising grid are below a value."""
    low, high = 0, count
    while low < high:
        middle = (low + high) // 2
        if grid[middle] < value:
            low = middle + 1
        else:
            high = middle
    return low


@inner_bare_kernel
def _plane_share_of(left: float, right: float, turn: float, row: Row) -> float:
    """Share in which two contacts have one plane, whose edges are at two places of the profile."""
    across = max(right - left, 0.0)
    down = value_at(right, row.y, row.z) - value_at(left, row.y, row.z) if across > 0.0 else 0.0
    share: float = plane_share(np.sqrt(across * across + down * down), turn)
    return share


@inner_bare_kernel
def planes_of(spans: Records, parts: int, total: int, row: Row, work: Work) -> None:
    """Pressure-weighted place and angle of every part, the latter leaning towards those it belongs to.

    The weight is zero where no strips with pressure were laid yet.
    """
    old, planes, share = work.old, work.planes, work.share
    for k in range(parts):
        weight, moment, tilt = 0.0, 0.0, 0.0
        for j in range(total):
            if spans[k].ends[0] <= old[j].y <= spans[k].ends[1]:
                load = old[j].load * old[j].width
                weight += load
                moment += load * old[j].y
                tilt += load * old[j].tilt
        planes[k].weight = weight
        planes[k].middle = moment / weight if weight > 0.0 else 0.0
        planes[k].own = tilt / weight if weight > 0.0 else 0.0
    for j in range(parts):
        for k in range(j + 1, parts):
            # Strips are laid beyond the patch by their margin.
            one, other = spans[j], spans[k]
            end = one.ends[1] - MARGIN * (one.ends[1] - one.ends[0]) / max(one.strips, 10)
            start = other.ends[0] + MARGIN * (other.ends[1] - other.ends[0]) / max(other.strips, 10)
            share[j, k] = share[k, j] = _plane_share_of(end, start, planes[j].own - planes[k].own, row)
    for k in range(parts):
        planes[k].tilt = blended(k, parts, share, planes.weight, planes.own)


@inner_bare_kernel
def share_points(patches: Records, row: Row, share: FloatArray) -> None:
    """Creepage reference points of the patches of a wheel, one for those in a plane; `share` is for work."""
    for j in range(patches.size):
        for k in range(patches.size):
            one, other = patches[j], patches[k]
            if one.centre < other.centre:
                both = _plane_share_of(one.right, other.left, one.own - other.own, row)
                share[j, k] = share[k, j] = both**4
    for k in range(patches.size):
        own = patches[k]
        lowest, deeper = own.displacement - own.approach / np.cos(own.angle), 0.0
        for j in range(patches.size):
            if j != k:
                height = own.displacement - patches[j].approach / np.cos(patches[j].angle)
                deeper = min(deeper, share[j, k] * (height - lowest))
        place = blended(k, patches.size, share, patches.force, patches.centre)
        own.point = place
        own.point_approach = (own.displacement - lowest - deeper) * np.cos(own.angle)
        down = value_at(own.centre, row.y, row.z) - value_at(place, row.y, row.z)
        own.across = (own.centre - place) * np.cos(own.angle) + down * np.sin(own.angle)
        own.along = value_at(own.centre, row.y, row.along) - value_at(place, row.y, row.along)
