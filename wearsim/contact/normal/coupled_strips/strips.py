"""Strips along the rolling direction on the profile of a counterface: their layout.

Equations and sources: see `coupled_strips`.

A station is a place on the counterface's profile, in steps of its grid, whose points
are at equal distances along the arc.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np

from wearsim.contact.geometry import NO_WHEEL
from wearsim.contact.kernel import inner_bare_kernel
from wearsim.contact.patch import FloatArray, IntArray

Records: TypeAlias = Any  # numpy record array

# displacement over the overlap in virtual penetration
PENETRATION = 0.55
# load per overlap and width of virtual penetration, over pi^2 E* / 2
_STIFFNESS = 4.0 / np.pi**2
_ITERATIONS = 30  # largest number of iterations of virtual penetration
_EXACT = 1e-12  # relative tolerance of its displacement
# Largest deviation of the gap from its chord over a strip, over the displacement.
FLATNESS = 0.002
_BEND = 3  # grid steps on either side over which the curvature of the gap is fitted
# least overlap by which the length of a contact is estimated, over the displacement
_SHALLOW = 0.1
# half-width of a box over that of a triangle of the same variance
_BOX = float(np.sqrt(0.5))
# least width of a strip over the box of the profile in a section of a yawed wheel
_OF_SECTION = 0.25
SHORT = 0.25  # share of the neighbour's q below which a strip hardly carries
_GROWTH = 0.5  # growth of the strip width, per width
_WIDEST = 1.2e-3  # largest strip width [m]
_NARROWEST = 5.0  # ratio of the widest to the narrowest strips
_LEAST_TURN = 0.1  # cosine of the steepest wheel surface on which strips are laid
# least longitudinal curvature of a yawed wheel, as a share of 1/r
_LEAST_BEND = 0.05


class Row(NamedTuple):
    """Wheel over its counterface: profile, gap, rolling radius and contact line.

    The lowest gap is given separately. `wheel_y`, `sin_theta`, `sin_yaw`, `surface_y`
    and `surface_slope` give the curvature of a yawed wheel. `step` is that of the
    profile's grid along the arc. `load` counts vertically or, if not `vertical`, along
    the normals, and is 2 N / (pi^2 E*) [m2].
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
    step: float
    vertical: bool


class Strips(NamedTuple):
    """Strips of a wheel, each array (most,).

    Run of neighbouring strips it belongs to; number of its place on the profile;
    station of the middle; width along the arc; gap above its lowest value; contact
    angle `tilt` of the profile, the plane of the strip; share `turn` of a vertical
    displacement along its normal; curvature `bend` of the gap along the strip; contact
    line `middle`; share `lift` of the pressure that counts as load; half-length squared
    `square`; pressure over pi E* and half-length, `ratio`; and `reach`, where along the
    strip the surface is compared with its middle.
    """

    run: IntArray
    number: IntArray
    station: FloatArray
    width: FloatArray
    gap: FloatArray
    tilt: FloatArray
    turn: FloatArray
    bend: FloatArray
    middle: FloatArray
    lift: FloatArray
    square: FloatArray
    ratio: FloatArray
    reach: FloatArray


class Penetration(NamedTuple):
    """Virtual penetration: displacement of the wheel, width and middle of all contacts.

    The width [steps] is that of a parabola of the same overlap or, if that is wider,
    because of a ridge, of a step of the same mean and mean square. The middle is a
    station.
    """

    displacement: float
    width: float
    middle: float


def strips_for(most: int) -> Strips:
    """Allocate strips."""
    return Strips(
        *np.zeros((2, most), np.int64), *np.zeros((len(Strips._fields) - 2, most))
    )


@inner_bare_kernel
def linear_at(table: FloatArray, station: float) -> float:
    """Value at a station, linear between and beyond the points of the profile."""
    k = min(max(int(station), 0), table.size - 2)
    value: float = table[k] + (station - k) * (table[k + 1] - table[k])
    return value


@inner_bare_kernel
def _mean_over(table: FloatArray, start: float, stop: float) -> float:
    """Mean between two stations of values that are linear between points."""
    total, begin = 0.0, start
    while begin < stop:
        end = min(np.floor(begin) + 1.0, stop)
        total += (end - begin) * linear_at(table, 0.5 * (begin + end))
        begin = end
    return total / (stop - start)


@inner_bare_kernel
def penetrate(row: Row) -> Penetration:
    """Displacement at which the overlap of the rigid surfaces carries the load.

    With half-lengths of virtual penetration and ratios of a sphere the load is
    proportional to the overlap.
    """
    # Value of a sphere of 1 m radius; load is 2 N / (pi^2 E*).
    displacement = 1.5 * (0.5 * np.pi**2 * row.load) ** (2.0 / 3.0)
    overlap = squares = moment = 0.0
    for _ in range(_ITERATIONS):
        depth = row.low + PENETRATION * displacement
        carried = stiffness = overlap = squares = moment = 0.0
        for k in range(row.gap.size):
            if row.gap[k] < depth:
                lift = row.step * _STIFFNESS * np.cos(row.angle[k])
                if row.vertical:
                    lift *= np.cos(row.angle[k])
                carried += lift * (depth - row.gap[k])
                stiffness += lift
                overlap += depth - row.gap[k]
                squares += (depth - row.gap[k]) ** 2
                moment += (depth - row.gap[k]) * k
        if stiffness == 0.0:
            displacement *= 2.0
            continue
        change = (row.load - carried) / (PENETRATION * stiffness)
        displacement += change
        if abs(change) < _EXACT * displacement:
            break
    deepest = PENETRATION * displacement
    width = max(1.5 * overlap / deepest, overlap * overlap / squares)
    return Penetration(displacement, width, moment / overlap)


@inner_bare_kernel
def lay_strips(
    level: float,
    count: float,
    first: Penetration,
    row: Row,
    strips: Strips,
    widths: FloatArray,
    number: FloatArray,
) -> int:
    """Lay strips where the gap is less than a level, one more at each end.

    Return their number, -1 if there is no room. The positions of strips on the whole
    profile do not depend on the level, only on the gap and the displacement of virtual
    penetration: they move continuously with the wheel as contacts split and join.
    `number` becomes the number of strips from the middle of the contacts to each point
    of the profile.
    """
    widest = min(first.width / count, _WIDEST / row.step)
    low, high = _limit_widths(widest, first.displacement, row, widths)
    number[low] = 0.0
    for k in range(low, high):
        number[k + 1] = number[k] + 0.5 * (1.0 / widths[k] + 1.0 / widths[k + 1])
    begin = linear_at(number, min(max(first.middle, float(low)), float(high)))
    for k in range(low, high + 1):
        number[k] -= begin
    total, run, last, k = 0, -1, -(2**62), low
    while k <= high:
        if row.gap[k] - row.low >= level:
            k += 1
            continue
        start = k
        while k <= high and row.gap[k] - row.low < level:
            k += 1
        first_number = int(np.floor(number[max(start - 1, low)])) - 1
        stop = int(np.floor(number[min(k, high)])) + 1
        if first_number > last + 1:
            run += 1
        else:
            first_number = last + 1
        i = max(start - 2, low)
        for j in range(first_number, stop + 1):
            if total == strips.run.size:
                return -1
            while i > low and number[i] > j:
                i -= 1
            edge = _station_of(float(j), i, low, high, number)
            while i < high - 1 and number[i + 1] < j + 1.0:
                i += 1
            strips.run[total], strips.number[total] = run, j
            next_edge = _station_of(j + 1.0, i, low, high, number)
            _fill_strip(total, edge, next_edge, first.displacement, row, strips)
            total += 1
        last = max(stop, last)
    return total


@inner_bare_kernel
def _station_of(
    number: float, k: int, low: int, high: int, numbers: FloatArray
) -> float:
    """Station of a number of strips near point k.

    Beyond the wheel's ends it is extrapolated linearly.
    """
    k = min(max(k, low), high - 1)
    while k < high - 1 and numbers[k + 1] < number:
        k += 1
    station: float = k + (number - numbers[k]) / (numbers[k + 1] - numbers[k])
    return station


@inner_bare_kernel
def _limit_widths(
    widest: float, displacement: float, row: Row, widths: FloatArray
) -> tuple[int, int]:
    """Widths of strips at the points of the profile, in steps of its grid.

    The first and last point of the wheel are also returned. Strips are so narrow that
    the gap is a chord over a strip, and grow by at most `_GROWTH` from one to the next.
    They are not narrower than a sixth of the part of the wheel's profile that lies in a
    section along a strip: sections do not show its details.
    """
    low, high = 0, row.gap.size - 1
    while low < high - 1 and row.gap[low] >= NO_WHEEL:
        low += 1
    while high > low + 1 and row.gap[high] >= NO_WHEEL:
        high -= 1
    flat = 8.0 * FLATNESS * displacement * _BEND**2
    for k in range(low, high + 1):
        widths[k] = widest
        before, behind = k - _BEND, k + _BEND
        if before < 0 or behind >= row.gap.size:
            continue
        if max(row.gap[before], row.gap[k], row.gap[behind]) >= NO_WHEEL:
            continue
        bend = abs(row.gap[before] - 2.0 * row.gap[k] + row.gap[behind])
        if flat < bend * widest * widest:
            narrowest = widest / _NARROWEST
            if row.sin_yaw != 0.0:
                narrowest = max(narrowest, _narrowest_in_section(k, displacement, row))
            widths[k] = min(max(np.sqrt(flat / bend), narrowest), widest)
    for k in range(low + 1, high + 1):
        widths[k] = min(widths[k], widths[k - 1] + _GROWTH)
    for k in range(high - 1, low - 1, -1):
        widths[k] = min(widths[k], widths[k + 1] + _GROWTH)
    return low, high


@inner_bare_kernel
def _bend_of_counterface(station: float, row: Row) -> float:
    """Curvature of the counterface along the rolling direction [1/m]."""
    curvature: float = row.kappa / (1.0 - row.kappa * linear_at(row.z, station))
    return curvature


@inner_bare_kernel
def _aside(gap: float, station: float, displacement: float, row: Row) -> float:
    """Half of the profile of a yawed wheel in a section, as a box [m].

    The half-length of the section is that of virtual penetration.
    """
    counterface = _bend_of_counterface(station, row)
    bend = 1.0 / linear_at(row.radius, station) + max(counterface, 0.0)
    depth = max(PENETRATION * displacement - gap, _SHALLOW * displacement)
    aside: float = _BOX * np.sqrt(2.0 * depth / bend) * abs(row.sin_yaw)
    return aside


@inner_bare_kernel
def _narrowest_in_section(k: int, displacement: float, row: Row) -> float:
    """Least width of a strip of a yawed wheel at a point, in steps."""
    part = 2.0 * _aside(row.gap[k] - row.low, float(k), displacement, row)
    width: float = _OF_SECTION * part / (np.cos(row.angle[k]) * row.step)
    return width


@inner_bare_kernel
def _fill_strip(
    j: int, start: float, stop: float, displacement: float, row: Row, strips: Strips
) -> None:
    """Set a strip between two stations from the profile and the gap.

    The displacement is that of virtual penetration.
    """
    station = 0.5 * (start + stop)
    strips.station[j], strips.width[j] = station, (stop - start) * row.step
    strips.square[j], strips.ratio[j] = 0.0, 0.0
    tilt = linear_at(row.angle, station)
    cosine, sine = np.cos(tilt), np.sin(tilt)
    strips.middle[j], strips.tilt[j] = _mean_over(row.along, start, stop), tilt
    strips.lift[j] = cosine if row.vertical else 1.0
    strips.gap[j], strips.turn[j], strips.bend[j] = NO_WHEEL, 1.0, 1.0
    i = min(max(int(station), 1), row.gap.size - 3)
    if not 1.0 <= station <= row.gap.size - 2.0:
        return
    if max(row.gap[i - 1], row.gap[i], row.gap[i + 1], row.gap[i + 2]) >= NO_WHEEL:
        return
    t = station - i
    u, rise = 1.0 - t, row.gap[i + 1] - row.gap[i]
    slope, next_slope = (
        0.5 * (row.gap[i + 1] - row.gap[i - 1]),
        0.5 * (row.gap[i + 2] - row.gap[i]),
    )
    strips.gap[j] = (
        row.gap[i]
        + t * rise
        + t * u * ((slope - rise) * u + (rise - next_slope) * t)
        - row.low
    )
    wheel_slope = row.slope[i] - 2.0 * slope / (row.y[i + 1] - row.y[i - 1])
    next_wheel_slope = row.slope[i + 1] - 2.0 * next_slope / (row.y[i + 2] - row.y[i])
    strips.turn[j] = 1.0 / max(
        cosine + (wheel_slope + t * (next_wheel_slope - wheel_slope)) * sine,
        _LEAST_TURN,
    )
    wheel = _bend_of_wheel(strips.gap[j], station, displacement, row)
    strips.bend[j] = (wheel + _bend_of_counterface(station, row)) * strips.turn[j]


@inner_bare_kernel
def _place_in(y: FloatArray, place: float) -> int:
    """Point of the wheel's profile at or before a place, not the outermost ones."""
    low, high = 1, y.size - 3
    while low < high:
        middle = (low + high + 1) // 2
        if y[middle] <= place:
            low = middle
        else:
            high = middle - 1
    return low


@inner_bare_kernel
def _slope_at(place: float, low: int, row: Row) -> float:
    """Slope of the wheel's profile at a place after a point."""
    y, slopes = row.surface_y, row.surface_slope
    share = min(max((place - y[low]) / (y[low + 1] - y[low]), 0.0), 1.0)
    slope: float = slopes[low] + share * (slopes[low + 1] - slopes[low])
    return slope


@inner_bare_kernel
def _bend_of_wheel(gap: float, station: float, displacement: float, row: Row) -> float:
    """Curvature of the wheel's vertical height along the rolling direction [1/m].

    That of the profile is the mean over the part of the profile that lies in a section
    of the yawed wheel.
    """
    radius = linear_at(row.radius, station)
    if row.sin_yaw == 0.0:
        return 1.0 / radius
    place, y = linear_at(row.wheel_y, station), row.surface_y
    low = _place_in(y, place)
    slope = _slope_at(place, low, row)
    aside = _aside(gap, station, displacement, row)
    left = max(min(place - aside, y[low - 1]), y[0])
    right = min(max(place + aside, y[low + 2]), y[-1])
    rise = _slope_at(right, _place_in(y, right), row)
    rise -= _slope_at(left, _place_in(y, left), row)
    curvature = rise / (right - left)
    sine, square = linear_at(row.sin_theta, station), row.sin_yaw * row.sin_yaw
    across = slope * slope + radius * curvature
    bend: float = max(1.0 - square - across * square, _LEAST_BEND) / (
        radius * np.sqrt(1.0 - sine * sine)
    )
    return bend
