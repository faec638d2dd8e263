"""Kernels of the strip model: strips on a profile and their contact planes.

Equations and sources: see `knothe_le_the`.

Loads are divided by pi E*: P = p a / (pi E*) [m] for a strip of half-length a and largest pressure p;
q = a^2 [m2].
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np

from wearsim.contact.geometry import NO_WHEEL
from wearsim.contact.kernel import bare_kernel
from wearsim.contact.normal.model import ADJACENT, ALIKE, CLEAR, FAR, NEAR, UNLIKE
from wearsim.contact.patch import FloatArray

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


# Strip: place s in its contact plane, gap, share of the displacement in it, radius of the wheel, curvature of
# the counterface, P, q, profile y and z, width, cosine and angle of the plane, y of its origin, the profile's
# angle, logarithm of the half-length; number of the part of the profile.
STRIP = np.dtype(
    [(name, float) for name in ("s", "gap", "turn", "radius", "sigma", "load", "square", "y", "z", "width")]
    + [(name, float) for name in ("cosine", "angle", "origin", "tilt", "log")]
    + [("part", int)]
)
# Part of the profile: its ends, half-length squared per depth, gap where it ends and load per half-length
# squared as first pressed in; number of strips; then places and what was missed there, of both ends: one too
# far out, one too far in, the last one tried.
SPAN = np.dtype(
    [("ends", float, (2,)), ("per_depth", float), ("rim", float), ("per_square", float), ("strips", int)]
    + [(name, float, (2,)) for name in ("outer", "outer_miss", "inner", "inner_miss", "last", "last_miss")]
)
# Plane of a part: place, angle, load, and the angle the part has for itself.
PLANE = np.dtype([(name, float) for name in ("middle", "tilt", "weight", "own")])
# Patch of the solution: strips it is from, number of nodes, force, load scale, displacement, angle and origin
# of its plane, s of both ends, its angle for itself; centre y, approach, largest pressure and both ends y;
# creepage reference point y, approach there, and how far across and along its centre lies from there.
PATCH = np.dtype(
    [("first", int), ("last", int), ("nodes", int)]
    + [
        (name, float)
        for name in ("force", "scale", "displacement", "angle", "origin", "start", "stop", "own")
    ]
    + [(name, float) for name in ("centre", "approach", "pressure", "left", "right")]
    + [(name, float) for name in ("point", "point_approach", "across", "along")]
)
MARGIN = 0.3  # strips' widths laid beyond the end of the patch
# Angles between the planes up to which strips have full influence on each other, and from which on none: next
# to each other, and from 10 mm on as contacts share a plane.
_NEXT, _AWAY = 4e-3, 10e-3
_FULL_NEXT, _NONE_NEXT, _FULL_AWAY, _NONE_AWAY = 0.349, 0.698, 0.2, 0.3


@bare_kernel
def cut_strips(
    left: float, right: float, middle: float, delta: float, row: Row, strips: Records, first: int, count: int
) -> bool:
    """Lay strips of equal width between two places of a profile in the plane through `middle`.

    The gap of a strip is its mean over the width. Returns whether there is a wheel all along.
    """
    cosine, sine = np.cos(delta), np.sin(delta)
    at = first_beyond(row.y, row.y.size, left) - 1
    end = first_beyond(row.y, row.y.size, right)
    if at < 2 or end > row.y.size - 3:
        return False
    k = first_beyond(row.y, row.y.size, middle) - 1
    share = (middle - row.y[k]) / (row.y[k + 1] - row.y[k])
    base = row.z[k] + share * (row.z[k + 1] - row.z[k])
    share = (left - row.y[at]) / (row.y[at + 1] - row.y[at])
    z = row.z[at] + share * (row.z[at + 1] - row.z[at])
    s_left = (left - middle) * cosine + (z - base) * sine
    share = (right - row.y[end - 1]) / (row.y[end] - row.y[end - 1])
    z = row.z[end - 1] + share * (row.z[end] - row.z[end - 1])
    s_right = (right - middle) * cosine + (z - base) * sine
    width = (s_right - s_left) / count
    i = at - 1
    s_here, h_here, s_next, h_next, turn_next = 0.0, 0.0, -1e9, 0.0, 0.0
    turn_here = 0.0
    place, height, total = s_left, 0.0, 0.0
    begun = False
    for half in range(2 * count + 1):
        aim = s_left + 0.5 * half * width
        while True:
            while s_next < place or i < at:
                i += 1
                if i + 2 >= row.y.size or row.gap[i + 1] >= NO_WHEEL or row.gap[i] >= NO_WHEEL:
                    return False
                s_here, h_here, turn_here = s_next, h_next, turn_next
                wheel = row.slope[i + 1] - (row.gap[i + 2] - row.gap[i]) / (row.y[i + 2] - row.y[i])
                turn_next = 1.0 / (cosine + wheel * sine)
                s_next = (row.y[i + 1] - middle) * cosine + (row.z[i + 1] - base) * sine
                h_next = (row.gap[i + 1] - row.low) * turn_next
            if s_here < -1e8:  # the first cell
                wheel = row.slope[i] - (row.gap[i + 1] - row.gap[i - 1]) / (row.y[i + 1] - row.y[i - 1])
                turn_here = 1.0 / (cosine + wheel * sine)
                s_here = (row.y[i] - middle) * cosine + (row.z[i] - base) * sine
                h_here = (row.gap[i] - row.low) * turn_here
            if not begun:
                height = h_here + (place - s_here) / (s_next - s_here) * (h_next - h_here)
                begun = True
            stop = min(aim, s_next)
            share = (stop - s_here) / (s_next - s_here)
            value = h_here + share * (h_next - h_here)
            total += 0.5 * (height + value) * (stop - place)
            place, height = stop, value
            if aim <= s_next:
                break
            place = s_next + 1e-15
        if half % 2 == 1:
            j = first + half // 2
            strips[j].s = aim
            strips[j].turn = turn_here + share * (turn_next - turn_here)
            ring = row.radius[i] + share * (row.radius[i + 1] - row.radius[i])
            z = row.z[i] + share * (row.z[i + 1] - row.z[i])
            strips[j].radius = ring / cosine
            strips[j].tilt = row.angle[i] + share * (row.angle[i + 1] - row.angle[i])
            strips[j].sigma = row.kappa / (1.0 - row.kappa * z) * cosine
            strips[j].y = row.y[i] + share * (row.y[i + 1] - row.y[i])
            strips[j].z = z
            strips[j].width = width
            strips[j].cosine = cosine
            strips[j].angle = delta
            strips[j].origin = middle
        elif half > 0:
            strips[first + half // 2 - 1].gap = total / width
            total = 0.0
    return True


@bare_kernel
def influence_share(turn: float, distance: float) -> float:
    """Share of the elastic influence of strips at a distance whose planes differ by an angle."""
    away = min(max((distance - _NEXT) / (_AWAY - _NEXT), 0.0), 1.0)
    full = _FULL_NEXT + away * (_FULL_AWAY - _FULL_NEXT)
    none = _NONE_NEXT + away * (_NONE_AWAY - _NONE_NEXT)
    share: float = min(max((none - abs(turn)) / (none - full), 0.0), 1.0)
    return share


@bare_kernel
def bow_of(x_squared: float, radius: float, sigma: float) -> float:
    """Gap that two circles open at a distance from where they are nearest."""
    wheel = x_squared / (radius + np.sqrt(max(radius * radius - x_squared, 0.0)))
    counterface = sigma * x_squared / (1.0 + np.sqrt(max(1.0 - sigma * sigma * x_squared, 0.0)))
    rise: float = wheel + counterface
    return rise


@bare_kernel
def plane_share(distance: float, turn: float) -> float:
    """Share in which two contacts have one plane, by their distance from edge to edge and their angles."""
    near = min(max((FAR - distance) / (FAR - NEAR), 0.0), 1.0)
    alike = min(max((UNLIKE - abs(turn)) / (UNLIKE - ALIKE), 0.0), 1.0)
    adjacent = min(max((CLEAR - distance) / (CLEAR - ADJACENT), 0.0), 1.0)
    share: float = max(near * alike, adjacent)
    return share


@bare_kernel
def value_at(y: float, grid_y: FloatArray, table: FloatArray) -> float:
    """Value at a place of the profile, linear between its points."""
    i = min(max(first_beyond(grid_y, grid_y.size, y) - 1, 0), grid_y.size - 2)
    value: float = table[i] + (y - grid_y[i]) / (grid_y[i + 1] - grid_y[i]) * (table[i + 1] - table[i])
    return value


@bare_kernel
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


@bare_kernel
def distance_between(left: float, right: float, grid_y: FloatArray, grid_z: FloatArray) -> float:
    """Straight distance between two places of the profile; nothing if they are in the wrong order."""
    across = right - left
    down = value_at(right, grid_y, grid_z) - value_at(left, grid_y, grid_z)
    distance: float = np.sqrt(across * across + down * down) if across > 0.0 else 0.0
    return distance


@bare_kernel
def planes_of(
    spans: Records, parts: int, old: Records, total: int, row: Row, share: FloatArray, planes: Records
) -> None:
    """Pressure-weighted place and angle of every part, the latter leaning towards those it belongs to.

    The weight is zero where no strips with pressure were laid yet; `share` is for work.
    """
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
            turn = planes[j].own - planes[k].own
            share[j, k] = share[k, j] = plane_share(distance_between(end, start, row.y, row.z), turn)
    for k in range(parts):
        planes[k].tilt = blended(k, parts, share, planes.weight, planes.own)


@bare_kernel
def blended(k: int, count: int, share: FloatArray, weight: FloatArray, value: FloatArray) -> float:
    """Value of one of several contacts, with that of the others in the share they belong together.

    The weighted mean if all do; linear in the shares.
    """
    lean = 0.0
    for j in range(count):
        if share[k, j] > 0.0 and weight[j] > 0.0 and j != k:
            total = 0.0
            for i in range(count):
                total += max(share[k, i], share[j, i]) * weight[i]
            lean += share[k, j] * weight[j] * (value[j] - value[k]) / total
    result: float = value[k] + lean
    return result


@bare_kernel
def share_points(
    first: int, stop: int, displacement: float,
    profile: tuple[FloatArray, FloatArray, FloatArray, FloatArray], along: FloatArray, share: FloatArray,
    patches: Records,
) -> None:  # fmt: skip
    """Creepage reference points of the patches of a wheel, one for those in a plane; `share` is for work."""
    y, z, count = profile[0], profile[1], stop - first
    for j in range(count):
        for k in range(count):
            one, other = patches[first + j], patches[first + k]
            if one.centre < other.centre:
                distance = distance_between(one.right, other.left, y, z)
                share[j, k] = share[k, j] = plane_share(distance, one.own - other.own) ** 4
    force, centre = patches.force[first:stop], patches.centre[first:stop]
    for k in range(count):
        own = patches[first + k]
        lowest, deeper = displacement - own.approach / np.cos(own.angle), 0.0
        for j in range(count):
            other = patches[first + j]
            if j != k:
                height = displacement - other.approach / np.cos(other.angle)
                deeper = min(deeper, share[j, k] * (height - lowest))
        place = blended(k, count, share, force, centre)
        own.point = place
        own.point_approach = (displacement - lowest - deeper) * np.cos(own.angle)
        down = value_at(own.centre, y, z) - value_at(place, y, z)
        own.across = (own.centre - place) * np.cos(own.angle) + down * np.sin(own.angle)
        own.along = value_at(own.centre, y, along) - value_at(place, y, along)
