"""Kernels of the strip model: strips on a profile, their contact planes, and the first guess.

Equations and sources: see `knothe_le_the`.

Loads are divided by pi E*: P = p a / (pi E*) [m] for a strip of half-length a and largest pressure p;
q = a^2 [m2].
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.geometry import NO_WHEEL
from wearsim.contact.kernel import kernel
from wearsim.contact.normal.model import ADJACENT, ALIKE, CLEAR, FAR, NEAR, UNLIKE
from wearsim.contact.patch import FloatArray

LOBES = 6  # parts of the profile laid out with strips, at most
# Fields of a strip: place s in its contact plane, gap, share of the displacement in it, radius of the wheel,
# curvature of the counterface, P, q, profile y and z, width, cosine and angle of the plane, y of its origin,
# logarithm of the half-length.
S, GAP, TURN, RADIUS, SIGMA, LOAD, SQUARE, Y, Z, WIDTH, COSINE, ANGLE, ORIGIN, LOG = range(14)
FIELDS = 14
# Of a part of the profile: left and right end, half-length squared per depth, gap where it ends and load per
# half-length squared as first pressed in; number of strips; then places and what was missed there, of both
# ends each: one too far out, one too far in, the last one tried.
STRIPS, OUTER, INNER, LAST = 5, 6, 10, 14
PART = 18
MARGIN = 0.3  # strips' widths laid beyond the end of the patch
# Angles between the planes up to which strips have full influence on each other, and from which on none: next
# to each other, and from 10 mm on as contacts share a plane.
_NEXT, _AWAY = 4e-3, 10e-3
_FULL_NEXT, _NONE_NEXT, _FULL_AWAY, _NONE_AWAY = 0.349, 0.698, 0.2, 0.3


@kernel
def cut_strips(
    left: float, right: float, middle: float, delta: float, low: float, grid_y: FloatArray,
    grid_z: FloatArray, slope: FloatArray, gap: FloatArray, radius: FloatArray, kappa: float,
    strips: FloatArray, first: int, count: int,
) -> bool:  # fmt: skip
    """Lay strips of equal width between two places of a profile in the plane through `middle`.

    The gap of a strip is its mean over the width. Returns whether there is a wheel all along.
    """
    cosine, sine = np.cos(delta), np.sin(delta)
    at = np.searchsorted(grid_y, left) - 1
    end = np.searchsorted(grid_y, right)
    if at < 2 or end > grid_y.size - 3:
        return False
    k = np.searchsorted(grid_y, middle) - 1
    share = (middle - grid_y[k]) / (grid_y[k + 1] - grid_y[k])
    base = grid_z[k] + share * (grid_z[k + 1] - grid_z[k])
    share = (left - grid_y[at]) / (grid_y[at + 1] - grid_y[at])
    z = grid_z[at] + share * (grid_z[at + 1] - grid_z[at])
    s_left = (left - middle) * cosine + (z - base) * sine
    share = (right - grid_y[end - 1]) / (grid_y[end] - grid_y[end - 1])
    z = grid_z[end - 1] + share * (grid_z[end] - grid_z[end - 1])
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
                if i + 2 >= grid_y.size or gap[i + 1] >= NO_WHEEL or gap[i] >= NO_WHEEL:
                    return False
                s_here, h_here, turn_here = s_next, h_next, turn_next
                wheel = slope[i + 1] - (gap[i + 2] - gap[i]) / (grid_y[i + 2] - grid_y[i])
                turn_next = 1.0 / (cosine + wheel * sine)
                s_next = (grid_y[i + 1] - middle) * cosine + (grid_z[i + 1] - base) * sine
                h_next = (gap[i + 1] - low) * turn_next
            if s_here < -1e8:  # the first cell
                wheel = slope[i] - (gap[i + 1] - gap[i - 1]) / (grid_y[i + 1] - grid_y[i - 1])
                turn_here = 1.0 / (cosine + wheel * sine)
                s_here = (grid_y[i] - middle) * cosine + (grid_z[i] - base) * sine
                h_here = (gap[i] - low) * turn_here
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
            strips[S, j] = aim
            strips[TURN, j] = turn_here + share * (turn_next - turn_here)
            ring = radius[i] + share * (radius[i + 1] - radius[i])
            z = grid_z[i] + share * (grid_z[i + 1] - grid_z[i])
            strips[RADIUS, j] = ring / cosine
            strips[SIGMA, j] = kappa / (1.0 - kappa * z) * cosine
            strips[Y, j] = grid_y[i] + share * (grid_y[i + 1] - grid_y[i])
            strips[Z, j] = z
            strips[WIDTH, j] = width
            strips[COSINE, j] = cosine
            strips[ANGLE, j] = delta
            strips[ORIGIN, j] = middle
        elif half > 0:
            strips[GAP, first + half // 2 - 1] = total / width
            total = 0.0
    return True


@kernel
def influence_share(turn: float, distance: float) -> float:
    """Share of the elastic influence of strips at a distance whose planes differ by an angle."""
    away = min(max((distance - _NEXT) / (_AWAY - _NEXT), 0.0), 1.0)
    full = _FULL_NEXT + away * (_FULL_AWAY - _FULL_NEXT)
    none = _NONE_NEXT + away * (_NONE_AWAY - _NONE_NEXT)
    share: float = min(max((none - abs(turn)) / (none - full), 0.0), 1.0)
    return share


@kernel
def bow_of(x_squared: float, radius: float, sigma: float) -> float:
    """Gap that two circles open at a distance from where they are nearest."""
    wheel = x_squared / (radius + np.sqrt(max(radius * radius - x_squared, 0.0)))
    counterface = sigma * x_squared / (1.0 + np.sqrt(max(1.0 - sigma * sigma * x_squared, 0.0)))
    rise: float = wheel + counterface
    return rise


MIDDLE, TILT, WEIGHT, OWN = range(4)  # of a plane: place, angle, load, and the angle the part has for itself
PLANE = 4


@kernel
def plane_share(distance: float, turn: float) -> float:
    """Share in which two contacts have one plane, by their distance from edge to edge and their angles."""
    near = min(max((FAR - distance) / (FAR - NEAR), 0.0), 1.0)
    alike = min(max((UNLIKE - abs(turn)) / (UNLIKE - ALIKE), 0.0), 1.0)
    adjacent = min(max((CLEAR - distance) / (CLEAR - ADJACENT), 0.0), 1.0)
    share: float = max(near * alike, adjacent)
    return share


@kernel
def value_at(y: float, grid_y: FloatArray, table: FloatArray) -> float:
    """Value at a place of the profile, linear between its points."""
    i = min(max(int(np.searchsorted(grid_y, y)) - 1, 0), grid_y.size - 2)
    value: float = table[i] + (y - grid_y[i]) / (grid_y[i + 1] - grid_y[i]) * (table[i + 1] - table[i])
    return value


@kernel
def distance_between(left: float, right: float, grid_y: FloatArray, grid_z: FloatArray) -> float:
    """Straight distance between two places of the profile; nothing if they are in the wrong order."""
    across = right - left
    down = value_at(right, grid_y, grid_z) - value_at(left, grid_y, grid_z)
    distance: float = np.sqrt(across * across + down * down) if across > 0.0 else 0.0
    return distance


@kernel
def planes_of(
    spans: FloatArray,
    parts: int,
    old: FloatArray,
    total: int,
    grid_y: FloatArray,
    grid_z: FloatArray,
    angle: FloatArray,
    planes: FloatArray,
) -> None:
    """Pressure-weighted place and angle of every part, the latter leaning towards those it belongs to.

    The weight is zero where no strips with pressure were laid yet.
    """
    for k in range(parts):
        weight, moment, tilt = 0.0, 0.0, 0.0
        for j in range(total):
            if spans[k, 0] <= old[0, j] <= spans[k, 1]:
                load = old[1, j] * old[3, j]
                weight += load
                moment += load * old[0, j]
                tilt += load * value_at(old[0, j], grid_y, angle)
        planes[k, WEIGHT] = weight
        if weight > 0.0:
            planes[k, MIDDLE], planes[k, OWN] = moment / weight, tilt / weight
        else:
            planes[k, MIDDLE] = planes[k, OWN] = 0.0
    share = np.eye(parts)
    for j in range(parts):
        for k in range(j + 1, parts):
            # Strips are laid beyond the patch by their margin.
            end = spans[j, 1] - MARGIN * (spans[j, 1] - spans[j, 0]) / max(spans[j, STRIPS], 10.0)
            start = spans[k, 0] + MARGIN * (spans[k, 1] - spans[k, 0]) / max(spans[k, STRIPS], 10.0)
            turn = planes[j, OWN] - planes[k, OWN]
            share[j, k] = share[k, j] = plane_share(distance_between(end, start, grid_y, grid_z), turn)
    for k in range(parts):
        planes[k, TILT] = blended(k, parts, share, planes[:, WEIGHT], planes[:, OWN])


@kernel
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


@kernel
def share_points(
    count: int,
    displacement: float,
    grid_y: FloatArray,
    grid_z: FloatArray,
    along: FloatArray,
    edges: FloatArray,
    values: FloatArray,
) -> None:
    """Creepage reference points of patches in one plane, as `solve_patches` has the columns."""
    last = edges.shape[1] - 1
    share = np.eye(count)
    for j in range(count):
        for k in range(count):
            if values[j, 0] < values[k, 0]:
                distance = distance_between(edges[j, last], edges[k, 0], grid_y, grid_z)
                whole = plane_share(distance, values[j, 9] - values[k, 9]) ** 4
                share[j, k] = share[k, j] = whole
    for k in range(count):
        own = values[k]
        lowest, deeper = displacement - own[2] / np.cos(own[1]), 0.0
        for j in range(count):
            other = displacement - values[j, 2] / np.cos(values[j, 1])
            deeper = min(deeper, share[j, k] * (other - lowest))
        place = blended(k, count, share, values[:, 3], values[:, 0])
        own[8] = place
        own[10] = (displacement - lowest - deeper) * np.cos(own[1])
        across = (own[0] - place) * np.cos(own[1])
        down = value_at(own[0], grid_y, grid_z) - value_at(place, grid_y, grid_z)
        own[11] = across + down * np.sin(own[1])
        own[12] = value_at(own[0], grid_y, along) - value_at(place, grid_y, along)


@kernel
def hertz_at(table: FloatArray, ratio: float) -> tuple[float, float, float]:
    """Return A a^2/delta, B b^2/delta and p0/(E* a A) of ellipses at A/B from a table over its logarithm."""
    x = (np.log(ratio) + 14.0) * 8.0
    k = min(max(int(x), 0), table.shape[0] - 2)
    x = min(max(x - k, 0.0), 1.0)
    return (
        table[k, 0] + x * (table[k + 1, 0] - table[k, 0]),
        table[k, 1] + x * (table[k + 1, 1] - table[k, 1]),
        table[k, 2] + x * (table[k + 1, 2] - table[k, 2]),
    )


@kernel
def _start(
    displacement: float, low: float, vertical: bool, grid_y: FloatArray, grid_z: FloatArray,
    angle: FloatArray, gap: FloatArray, radius: FloatArray, kappa: float, table: FloatArray,
    lobes: FloatArray,
) -> tuple[float, int]:  # fmt: skip
    """Return load over pi E* at a displacement, every part pressed into an ellipse, and their number.

    `lobes` gets a line for each: left and right end (profile y), half-length squared per depth, gap where it
    ends, load per half-length squared.
    """
    total, used = 0.0, 0
    i = 1
    last = gap.size - 2
    while i < last and used < lobes.shape[0]:
        if gap[i] - low >= 0.55 * displacement:
            i += 1
            continue
        start = i
        deepest = i
        while i < last and gap[i] - low < 0.55 * displacement:
            if gap[i] < gap[deepest]:
                deepest = i
            i += 1
        stop = i - 1
        cosine = np.cos(angle[deepest])
        reach = 0.55 * displacement - (gap[deepest] - low)
        # Ends between grid points.
        left, right = grid_y[start], grid_y[stop]
        if gap[start - 1] < NO_WHEEL:
            share = (low + 0.55 * displacement - gap[start]) / max(gap[start - 1] - gap[start], 1e-12)
            left -= min(share, 1.0) * (grid_y[start] - grid_y[start - 1])
        if gap[stop + 1] < NO_WHEEL:
            share = (low + 0.55 * displacement - gap[stop]) / max(gap[stop + 1] - gap[stop], 1e-12)
            right += min(share, 1.0) * (grid_y[stop + 1] - grid_y[stop])
        half = 0.5 * (right - left) / cosine
        across = reach * cosine / (half * half)
        along = 0.5 * (cosine / radius[deepest] + kappa / (1.0 - kappa * grid_z[deepest]) * cosine)
        along_share, across_share, slope = hertz_at(table, along / across)
        # Depth below the rim of the ellipse: `across_share` of the part's own displacement.
        own = displacement - (gap[deepest] - low)
        rim = (gap[deepest] - low) + across_share * own
        per_depth = along_share / across_share * cosine / along
        area = 0.0
        a, b = start, stop
        while a > 1 and gap[a - 1] - low < rim:
            a -= 1
        while b < last and gap[b + 1] - low < rim:
            b += 1
        for k in range(a, b + 1):
            depth = rim - (gap[k] - low)
            if depth > 0.0:
                area += depth * per_depth * 0.5 * (grid_y[k + 1] - grid_y[k - 1]) / cosine
        stiff = slope * along / np.pi
        lobes[used, 0] = grid_y[a] - 0.5 * (grid_y[a] - grid_y[a - 1])
        lobes[used, 1] = grid_y[b] + 0.5 * (grid_y[b + 1] - grid_y[b])
        if across_share < 0.55:
            while a < b and gap[a] - low > rim:
                a += 1
            while b > a and gap[b] - low > rim:
                b -= 1
            lobes[used, 0] = grid_y[a] - 0.5 * (grid_y[a] - grid_y[a - 1])
            lobes[used, 1] = grid_y[b] + 0.5 * (grid_y[b + 1] - grid_y[b])
        lobes[used, 2] = per_depth
        lobes[used, 3] = rim
        lobes[used, 4] = stiff
        force = 0.5 * np.pi * stiff * area
        total += force * cosine if vertical else force
        used += 1
    return total, used


@kernel
def first_displacement(
    load: float, low: float, vertical: bool, grid_y: FloatArray, grid_z: FloatArray, angle: FloatArray,
    gap: FloatArray, radius: FloatArray, kappa: float, table: FloatArray, lobes: FloatArray,
) -> tuple[float, int]:  # fmt: skip
    """Vertical displacement at which elliptic patches about carry the load, and their number."""
    small, large = 0.0, 0.0
    displacement = 5e-5
    parts = 0
    for _ in range(40):
        value, parts = _start(
            displacement, low, vertical, grid_y, grid_z, angle, gap, radius, kappa, table, lobes
        )
        if parts > 0 and abs(value / load - 1.0) < 0.02:
            break
        if value < load:
            small = displacement
        else:
            large = displacement
        guess = displacement * (load / value) ** (2.0 / 3.0) if value > 0.0 else 4.0 * displacement
        guess = min(max(guess, 0.25 * displacement), 4.0 * displacement)
        if large > 0.0 and not small < guess < large:
            guess = 0.5 * (small + large)
        displacement = guess
    return displacement, parts
