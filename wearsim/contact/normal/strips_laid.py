"""Kernels of the strip model: strips laid on a profile, and what they know of each other.

Equations and sources: see `knothe_le_the`.

Loads are divided by pi E*: P = p a / (pi E*) [m] for a strip of half-length a and largest pressure p;
q = a^2 [m2].
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.geometry import NO_WHEEL
from wearsim.contact.kernel import kernel
from wearsim.contact.patch import FloatArray

LOBES = 6  # parts of the profile laid out with strips, at most
# Fields of a strip: place s in its contact plane, gap, share of the descent in it, radius of the wheel,
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
# Angles between the planes up to which strips feel each other fully, and from which on not at all: next to
# each other, and from 10 mm on as contacts share a plane.
_NEXT, _AWAY = 4e-3, 10e-3
_FULL_NEXT, _NONE_NEXT, _FULL_AWAY, _NONE_AWAY = 0.349, 0.698, 0.2, 0.3


@kernel
def lay(
    left: float,
    right: float,
    middle: float,
    delta: float,
    low: float,
    grid_y: FloatArray,
    grid_z: FloatArray,
    slope: FloatArray,
    gap: FloatArray,
    radius: FloatArray,
    kappa: float,
    strips: FloatArray,
    first: int,
    count: int,
) -> bool:
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
def fade(turn: float, distance: float) -> float:
    """Share to which strips at a distance feel each other whose planes are turned by an angle."""
    away = min(max((distance - _NEXT) / (_AWAY - _NEXT), 0.0), 1.0)
    full = _FULL_NEXT + away * (_FULL_AWAY - _FULL_NEXT)
    none = _NONE_NEXT + away * (_NONE_AWAY - _NONE_NEXT)
    share: float = min(max((none - abs(turn)) / (none - full), 0.0), 1.0)
    return share


@kernel
def bow_of(x_squared: float, radius: float, sigma: float) -> float:
    """Gap that two circles open at a distance from where they are nearest."""
    wheel = x_squared / (radius + np.sqrt(max(radius * radius - x_squared, 0.0)))
    ground = sigma * x_squared / (1.0 + np.sqrt(max(1.0 - sigma * sigma * x_squared, 0.0)))
    rise: float = wheel + ground
    return rise
