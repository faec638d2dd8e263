"""Strips along the rolling direction on a part of a profile, and the contact planes of the parts.

Equations and sources: see `coupled_strips`.

A station is a place on the counterface's profile, in steps of its grid, whose points are at equal distances
along the arc.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np

from wearsim.contact.geometry import NO_WHEEL
from wearsim.contact.kernel import inner_bare_kernel
from wearsim.contact.normal.model import blended, plane_share
from wearsim.contact.patch import FloatArray, IntArray

Records: TypeAlias = Any  # numpy record array

FLATNESS = 0.002  # deviation of the gap from its chord over a strip, over the displacement, at most
SHORT = 0.25  # of its neighbour's q, below which the outermost strip does not count
_BEND = 3  # steps of the profile on either side over which the gap's curvature is taken
_GROWTH = 0.5  # of the width of strips, per width
_NARROWEST = 80.0  # of the narrowest strips would cover a part
_MULTIPLE = 4  # of which the number of strips of a part is one: it seldom jumps as profiles and loads change
_KEPT = 3.0  # strips by which a part may ask for more or less than it had in the set before
_LEAST_TURN = 0.1  # cosine of the steepest surface of a wheel that strips lie on
_LEAST_BEND = 0.05  # of 1/r: curvature of a yawed wheel along the rolling direction, at least


class Row(NamedTuple):
    """Wheel over its counterface: profile, gap, its lowest value, rolling radius, contact line.

    `wheel_y`, `sin_theta`, `sin_yaw`, `surface_y` and `surface_slope` give the curvature of a yawed wheel.
    `load` counts vertically or, if not `vertical`, along the normal, and is 2 N / (pi^2 E*) [m2].
    """

    y: FloatArray
    z: FloatArray
    slope: FloatArray
    angle: FloatArray
    gap: FloatArray
    radius: FloatArray
    along: FloatArray
    wheel_y: FloatArray
    sin_theta: FloatArray
    surface_y: FloatArray
    surface_slope: FloatArray
    sin_yaw: float
    kappa: float
    low: float
    load: float
    vertical: bool


class Strips(NamedTuple):
    """Strips of a wheel, each array (most,).

    Part of the profile; station, y and z of the middle; width in the plane; gap above its lowest value;
    share `turn` of a vertical displacement along the plane's normal; curvature `bend` of the gap along the
    strip; contact line `middle`; contact angle `tilt` of the profile; share `lift` of the pressure that
    counts as load; half-length squared `square`; pressure over pi E* and half-length, `ratio`; and `reach`,
    where along the strip the surface is compared with its middle.
    """

    part: IntArray
    station: FloatArray
    y: FloatArray
    z: FloatArray
    width: FloatArray
    gap: FloatArray
    turn: FloatArray
    bend: FloatArray
    middle: FloatArray
    tilt: FloatArray
    lift: FloatArray
    square: FloatArray
    ratio: FloatArray
    reach: FloatArray


# Part of the profile in contact: stations of both ends; where they were laid in the set before, and how far
# the ends of the patch were off then; pressure-weighted y, angle and force; angle of its plane; number of its
# strips, that of the set before until they are laid, 0 if there was none.
PART = np.dtype(
    [
        (name, float)
        for name in (
            "left", "right", "left_before", "right_before", "left_missed", "right_missed",
            "middle", "own", "force", "angle",
        )
    ]
    + [("strips", int)]
)  # fmt: skip


def strips_for(most: int) -> Strips:
    """Room for strips."""
    return Strips(np.zeros(most, np.int64), *np.zeros((len(Strips._fields) - 1, most)))


@inner_bare_kernel
def hardly_carries(strips: Strips, end: int, inside: int) -> bool:
    """Whether the outermost strip is so short that the next one is at the edge of the patch."""
    short: bool = strips.square[end] < SHORT * strips.square[inside]
    return short


@inner_bare_kernel
def linear_at(table: FloatArray, station: float) -> float:
    """Value at a station, linear between the points of the profile and beyond its ends."""
    k = min(max(int(station), 0), table.size - 2)
    value: float = table[k] + (station - k) * (table[k + 1] - table[k])
    return value


@inner_bare_kernel
def room_for_strips(row: Row) -> tuple[float, float]:
    """First and last station of the wheel over the profile, between points with neighbours."""
    first, last = 1, row.gap.size - 2
    while first < last and row.gap[first - 1] >= NO_WHEEL:
        first += 1
    while last > first and row.gap[last + 1] >= NO_WHEEL:
        last -= 1
    return float(first), float(last)


@inner_bare_kernel
def lay_strips(
    part: int, count: float, most: int, displacement: float, row: Row, parts: Records, strips: Strips,
    first: int, room: int, widths: FloatArray,
) -> int:  # fmt: skip
    """Lay strips between the ends of a part and a spare one beyond each; return their number.

    At least `count`, more where the gap bends. Zero where there is no `room`.
    """
    left, right = parts[part].left, parts[part].right
    low, high = _limit_widths(left, right, (right - left) / count, displacement, row, widths)
    total = 0.0
    for k in range(low, high):
        total += max(min(k + 1.0, right) - max(float(k), left), 0.0) * _density(widths, k)
    number = parts[part].strips
    if abs(total - number) > _KEPT:
        number = min(_MULTIPLE * max(int(total / _MULTIPLE + 0.5 + 1e-6), 1), most)
    if first + number + 2 > room:
        return 0
    cosine, sine = np.cos(parts[part].angle), np.sin(parts[part].angle)
    edge, k, gone = left, int(left), 0.0
    for j in range(number):
        start, aim = edge, total * (j + 1.0) / number
        while True:
            stop = min(k + 1.0, right)
            more = (stop - edge) * _density(widths, k)
            if gone + more >= aim or stop == right:
                break
            gone += more
            edge = stop
            k += 1
        edge = right if j + 1 == number else min(edge + (aim - gone) / _density(widths, k), right)
        gone = aim
        _fill_strip(first + 1 + j, part, start, edge, cosine, sine, row, strips)
        if j == 0:
            _fill_strip(first, part, start - (edge - start), start, cosine, sine, row, strips)
        if j + 1 == number:
            _fill_strip(first + number + 1, part, edge, edge + (edge - start), cosine, sine, row, strips)
    parts[part].strips = number
    return number + 2


@inner_bare_kernel
def _density(widths: FloatArray, k: int) -> float:
    """Return the strips per step of the profile behind point k."""
    return 0.5 * (1.0 / widths[k] + 1.0 / widths[k + 1])


@inner_bare_kernel
def _limit_widths(
    left: float, right: float, widest: float, displacement: float, row: Row, widths: FloatArray
) -> tuple[int, int]:
    """Find the largest widths of strips at the points of the profile, in its steps; first and last point.

    So narrow that the gap is a chord over a strip, and no more than `_GROWTH` wider from one to the next.
    """
    margin = int(2.0 * widest) + 1
    low, high = max(int(left) - margin, 0), min(int(right) + 1 + margin, row.gap.size - 1)
    flat = 8.0 * FLATNESS * displacement * _BEND**2
    narrowest = min((right - left) / _NARROWEST, widest)
    for k in range(low, high + 1):
        widths[k] = widest
        before, behind = k - _BEND, k + _BEND
        if before < 0 or behind >= row.gap.size:
            continue
        if max(row.gap[before], row.gap[k], row.gap[behind]) >= NO_WHEEL:
            continue
        bend = abs(row.gap[before] - 2.0 * row.gap[k] + row.gap[behind])
        if flat < bend * widest * widest:
            widths[k] = max(np.sqrt(flat / bend), narrowest)
    for k in range(low + 1, high + 1):
        widths[k] = min(widths[k], widths[k - 1] + _GROWTH)
    for k in range(high - 1, low - 1, -1):
        widths[k] = min(widths[k], widths[k + 1] + _GROWTH)
    return low, high


@inner_bare_kernel
def _fill_strip(
    j: int, part: int, start: float, stop: float, cosine: float, sine: float, row: Row, strips: Strips
) -> None:
    """Take what a strip between two stations is from the profile and the gap."""
    across = linear_at(row.y, stop) - linear_at(row.y, start)
    down = linear_at(row.z, stop) - linear_at(row.z, start)
    strips.part[j], strips.width[j] = part, across * cosine + down * sine
    # The middle of the chord: edges of neighbours meet.
    strips.y[j] = linear_at(row.y, start) + 0.5 * across
    strips.z[j] = linear_at(row.z, start) + 0.5 * down
    station = 0.5 * (start + stop)
    strips.station[j] = station
    strips.lift[j] = cosine if row.vertical else 1.0
    strips.square[j], strips.ratio[j] = 0.0, 0.0
    i = min(max(int(station), 1), row.gap.size - 3)
    strips.middle[j], strips.tilt[j] = linear_at(row.along, station), linear_at(row.angle, station)
    strips.gap[j], strips.turn[j], strips.bend[j] = NO_WHEEL, 1.0, 1.0
    if not 1.0 <= station <= row.gap.size - 2.0:
        return
    if max(row.gap[i - 1], row.gap[i], row.gap[i + 1], row.gap[i + 2]) >= NO_WHEEL:
        return
    t = station - i
    u, rise = 1.0 - t, row.gap[i + 1] - row.gap[i]
    slope, next_slope = 0.5 * (row.gap[i + 1] - row.gap[i - 1]), 0.5 * (row.gap[i + 2] - row.gap[i])
    strips.gap[j] = row.gap[i] + t * rise + t * u * ((slope - rise) * u + (rise - next_slope) * t) - row.low
    here = row.slope[i] - 2.0 * slope / (row.y[i + 1] - row.y[i - 1])
    there = row.slope[i + 1] - 2.0 * next_slope / (row.y[i + 2] - row.y[i])
    strips.turn[j] = 1.0 / max(cosine + (here + t * (there - here)) * sine, _LEAST_TURN)
    counterface = row.kappa / (1.0 - row.kappa * linear_at(row.z, station))
    strips.bend[j] = (_bend_of_wheel(station, row) + counterface) * strips.turn[j]


@inner_bare_kernel
def _bend_of_wheel(station: float, row: Row) -> float:
    """Curvature of the wheel's vertical height along the rolling direction [1/m]."""
    radius = linear_at(row.radius, station)
    if row.sin_yaw == 0.0:
        return 1.0 / radius
    place, y = linear_at(row.wheel_y, station), row.surface_y
    low, high = 1, y.size - 3
    while low < high:
        middle = (low + high + 1) // 2
        if y[middle] <= place:
            low = middle
        else:
            high = middle - 1
    slopes = row.surface_slope
    slope = slopes[low] + (place - y[low]) / (y[low + 1] - y[low]) * (slopes[low + 1] - slopes[low])
    curvature = (slopes[low + 2] - slopes[low - 1]) / (y[low + 2] - y[low - 1])
    sine, square = linear_at(row.sin_theta, station), row.sin_yaw * row.sin_yaw
    across = slope * slope + radius * curvature
    bend: float = max(1.0 - square - across * square, _LEAST_BEND) / (radius * np.sqrt(1.0 - sine * sine))
    return bend


@inner_bare_kernel
def share_between(end: float, start: float, turn: float, row: Row) -> float:
    """Share in which two contacts have one plane, by the stations where one ends and the other starts."""
    across, down = 0.0, 0.0
    if start > end:
        across = linear_at(row.y, start) - linear_at(row.y, end)
        down = linear_at(row.z, start) - linear_at(row.z, end)
    share: float = plane_share(np.sqrt(across * across + down * down), turn)
    return share


@inner_bare_kernel
def arrange(parts: Records, count: int, row: Row, share: FloatArray) -> None:
    """Find in which share parts of the profile have one plane, and the angles of their planes."""
    for j in range(count):
        share[j, j] = 1.0
        for k in range(j + 1, count):
            turn = parts[k].own - parts[j].own
            share[j, k] = share[k, j] = share_between(parts[j].right, parts[k].left, turn, row)
    for k in range(count):
        parts[k].angle = blended(k, count, share, parts.force, parts.own)
