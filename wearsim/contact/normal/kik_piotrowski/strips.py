"""Kernels of one patch of virtual penetration: strip ends, outline, displacement.

Strip ends are those under yaw.

Equations and sources: see `kik_piotrowski`.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np

from wearsim.contact.gap import place_in, smooth_at
from wearsim.contact.geometry import CounterfaceProfile, WheelSurface
from wearsim.contact.kernel import bare_kernel, inner_bare_kernel
from wearsim.contact.patch import FloatArray

Record: TypeAlias = Any  # one line of a numpy record array
Records: TypeAlias = Any


class Row(NamedTuple):
    """Wheel over its counterface, at the grid points.

    `ahead` and `behind` are both ends of strips as multiples of those of circles,
    filled by `lay_strips` under a yawed wheel from sections at every `stride` grid
    points; `mark` is the row's number, from 1.
    """

    profile: CounterfaceProfile
    wheel: WheelSurface  # empty if only the gap is given
    mark: int
    stride: int
    gap: FloatArray
    radius: FloatArray
    along: FloatArray
    ahead: FloatArray
    behind: FloatArray
    pose: Record


class Strips(NamedTuple):
    """Work arrays: strips of a patch at its grid points, and their displacements.

    Position s in the contact plane, edge to the strip before, width, squared
    half-length, longitudinal middle; squared distance from a point of the surface,
    integral of its displacement, two of its parts.
    """

    s: FloatArray
    edge: FloatArray
    width: FloatArray
    square: FloatArray
    middle: FloatArray
    distance: FloatArray
    integral: FloatArray
    rising: FloatArray
    reach: FloatArray


POSE = np.dtype(
    [
        (name, float)
        for name in ("sin_yaw", "cos_yaw", "sin_roll", "cos_roll", "shift", "half_span")
    ]
    + [("nominal_radius", float), ("kappa", float)]
)
# Section of the wheel at a grid point: components along the wheelset's axes (forward,
# axle, down) of the nearest wheel point, of the rolling direction (t) and of the normal
# to the roller's top (n); curvature of the roller's section; both ends as multiples of
# those of circles; whether there is a wheel; its circle and the row of the batch,
# counted from 1.
SECTION = np.dtype(
    [
        (name, float)
        for name in ("f", "a", "d", "t_f", "t_a", "t_d", "n_f", "n_a", "n_d", "sigma")
    ]
    + [("ahead", float), ("behind", float), ("met", int), ("ring", int), ("row", int)]
)
# First and last grid point; lateral centre of the interpenetration, z there, mean
# angle, sums both are from; gap at the rim, normal approach, s of both ends, sum of
# x_l^2 widths, deepest x_l^2, force, load scale, vertical displacement; while the load
# is balanced: pressure slope, group of patches, and deepest basin.
PATCH = np.dtype(
    [
        ("first", int),
        ("last", int),
        ("centre", float),
        ("foot", float),
        ("angle", float),
        ("weight", float),
    ]
    + [
        (name, float)
        for name in (
            "tilt",
            "rim",
            "approach",
            "left",
            "right",
            "volume",
            "deepest",
            "force",
        )
    ]
    + [
        ("scale", float),
        ("displacement", float),
        ("slope", float),
        ("group", int),
        ("basin", int),
    ]
)

_STEPS = 12  # largest number of Newton steps
# last step over the length; it leaves half of its square, 5e-9
_DONE = 1e-4
# Change of both ends, as multiples of those of circles, below which they are
# interpolated linearly.
_SMOOTH = 0.01
_STILL = 1e-8  # negligible step [m]: its square over a radius of 10 mm is 1e-14 m


@inner_bare_kernel
def _on_the_wheel(
    y: float,
    z: float,
    gap: float,
    along: float,
    pose: Record,
    wheel: WheelSurface,
    at: Record,
) -> None:
    """Point of the wheel nearest to a counterface position, and section directions."""
    sy, cy, sr, cr = pose.sin_yaw, pose.cos_yaw, pose.sin_roll, pose.cos_roll
    kappa = pose.kappa
    sine = kappa * along / (1.0 - kappa * (z - gap))
    cosine = np.sqrt(1.0 - sine * sine)
    at.t_f, at.t_a, at.t_d = (
        cy * cosine,
        -sy * cr * cosine + sr * sine,
        sy * sr * cosine + cr * sine,
    )
    at.n_f, at.n_a, at.n_d = (
        -cy * sine,
        sy * cr * sine + sr * cosine,
        -sy * sr * sine + cr * cosine,
    )
    at.sigma = kappa / (1.0 - kappa * z)
    # From the counterface, straight down on a rail, along the radius on a roller.
    x0 = along * (1.0 - kappa * z) / (1.0 - kappa * (z - gap))
    y0 = y - pose.shift + pose.half_span
    z0 = (
        z * cosine
        + kappa * x0 * x0 / ((1.0 - kappa * z) ** 2 * (1.0 + cosine))
        + pose.nominal_radius
    )
    f = cy * x0 + sy * y0
    a = -sy * cr * x0 + cy * cr * y0 + sr * z0 - pose.half_span
    d = sy * sr * x0 - cy * sr * y0 + cr * z0
    n = -gap
    ring = at.ring
    at.met = 0
    for _ in range(_STEPS):
        ring = place_in(wheel.y, a + n * at.n_a, ring)
        if ring < 0:
            return
        radius, slope = smooth_at(
            wheel.y, wheel.radius, wheel.slope, ring, a + n * at.n_a
        )
        forward, down = f + n * at.n_f, d + n * at.n_d
        length = np.sqrt(forward * forward + down * down)
        move = (radius - length) / (
            (forward * at.n_f + down * at.n_d) / length - slope * at.n_a
        )
        n += move
        if abs(move) < _STILL:
            at.met = 1
            break
    at.f, at.a, at.d = f + n * at.n_f, a + n * at.n_a, d + n * at.n_d
    at.ring = ring


@inner_bare_kernel
def _end_of_strip(
    depth: float, circle: float, factor: float, at: Record, wheel: WheelSurface
) -> float:
    """Strip end of a section at the penetration `depth`, as a multiple of `circle`.

    `circle` is the end for circles, whose sign selects the end. The search starts from
    the multiple `factor` and, if that fails, from 1; the result is 1 if there is no end
    up to five times as far.
    """
    start = factor * circle
    x = start
    ring = at.ring
    for _ in range(2 * _STEPS):
        root = np.sqrt(1.0 - (at.sigma * x) ** 2)
        n = at.sigma * x * x / (1.0 + root) - depth
        tilt = at.sigma * x / root
        f = at.f + x * at.t_f + n * at.n_f
        a = at.a + x * at.t_a + n * at.n_a
        d = at.d + x * at.t_d + n * at.n_d
        ring = place_in(wheel.y, a, ring)
        opening, move = 0.0, 0.0
        if ring >= 0:
            radius, slope = smooth_at(wheel.y, wheel.radius, wheel.slope, ring, a)
            length = np.sqrt(f * f + d * d)
            opening = (
                f * (at.t_f + tilt * at.n_f) + d * (at.t_d + tilt * at.n_d)
            ) / length
            opening -= slope * (at.t_a + tilt * at.n_a)
            move = (radius - length) / opening
        if (
            opening * circle <= 0.0
            or (x + move) / circle < 0.2
            or (x + move) / circle > 5.0
        ):
            if start == circle:
                return 1.0
            x = start = circle
            ring = at.ring
            continue
        x += move
        if abs(move) < _DONE * abs(x):
            break
    return x / circle


# Nodes of the quadrature of skewed strips, pairs about the middle. The accuracy is 1e-9
# for distances beyond 0.3 of the half length, 2e-5 at 0.001.
_PAIRS = 3
_TURN = np.pi * np.arange(1, _PAIRS + 1) / (2 * _PAIRS + 1)
_COSINE, _WEIGHT = np.cos(_TURN), np.sin(_TURN) * np.pi / (2 * _PAIRS + 1)


@bare_kernel
def strip_half_length_squared(depth: float, radius: float, sigma: float) -> float:
    """Squared half chord of two circles that overlap by `depth` [m2].

    One has the radius `radius`, the other the curvature `sigma`, 0 for a rail. Exact
    for circles: (4)-(6) of Liu and Bruni solved for x with z_w + z_r = g.
    """
    chord = (
        depth
        * (2.0 * radius - depth)
        * (2.0 - depth * sigma)
        * (2.0 + (2.0 * radius - depth) * sigma)
    )
    return chord / (4.0 * (1.0 + (radius - depth) * sigma) ** 2)


@bare_kernel
def displacement_integral(half_squared: float, distance_squared: float) -> float:
    """Integral over x of sqrt(a^2 - x^2) / sqrt(x^2 + y^2).

    It is 2 sqrt(a^2 + y^2) (K - E), computed by the arithmetic-geometric mean.
    """
    total = half_squared + distance_squared
    a, b = 1.0, np.sqrt(distance_squared / total)
    c_squared = half_squared / total
    power, weighted = 0.5, 0.5 * c_squared
    # A fixed number of steps allows vector instructions in the loop over the strips.
    for _ in range(4):
        c = 0.5 * (a - b)
        a, b = 0.5 * (a + b), np.sqrt(a * b)
        power *= 2.0
        weighted += power * c * c
    # The rest is a power series of c / a, which is below 0.01 for y/a down to 1e-5,
    # finer than any grid: the next steps change the mean by x^2 / 4 + ... and the sum
    # by x^4 / 16 + ...
    c = 0.5 * (a - b)
    a = 0.5 * (a + b)
    x = (c / a) ** 2
    weighted += 16.0 * c * c * (1.0 + x * (0.125 + x * 0.0625))
    mean = 1.0 + x * (0.25 + x * (9.0 / 64.0 + x * (25.0 / 256.0)))
    return np.pi * np.sqrt(total) * weighted * mean / a


@inner_bare_kernel
def share_at(
    grid: FloatArray, place: float, first: int, last: int
) -> tuple[int, float]:
    """Grid cell between `first` and `last` that contains a position, and its share.

    The share is the part of the cell before the position.
    """
    k = first
    while k < last - 1 and grid[k + 1] <= place:
        k += 1
    return k, (place - grid[k]) / (grid[k + 1] - grid[k])


@bare_kernel
def between(values: FloatArray, k: int, share: float) -> float:
    """Value in a grid cell, linear."""
    return values[k] + share * (values[k + 1] - values[k])


@inner_bare_kernel
def _half_logarithm(value: float) -> float:
    """Return ln(value) / 2 for values from 1 to 1e10, accurate to rounding.

    In a loop it uses vector instructions.
    """
    root = np.sqrt(np.sqrt(np.sqrt(np.sqrt(np.sqrt(np.sqrt(value))))))
    z = (root - 1.0) / (root + 1.0)
    t = z * z
    # 64 areatanh(z)
    series = 1 / 11 + t * (1 / 13 + t * (1 / 15 + t * (1 / 17 + t * (1 / 19))))
    series = 1.0 + t * (1 / 3 + t * (1 / 5 + t * (1 / 7 + t * (1 / 9 + t * series))))
    return 64.0 * z * series


@inner_bare_kernel
def _exponential(value: float) -> float:
    """Return exp(value) for values from 0 to 12, accurate to rounding.

    In a loop it uses vector instructions.
    """
    y = value / 32.0
    series = 1 / 720 + y * (
        1 / 5040 + y * (1 / 40320 + y * (1 / 362880 + y * (1 / 3628800 + y / 39916800)))
    )
    series = 1.0 + y * (
        1.0 + y * (1 / 2 + y * (1 / 6 + y * (1 / 24 + y * (1 / 120 + y * series))))
    )
    for _ in range(5):
        series *= series
    return series


@bare_kernel
def skewed_displacement_integrals(
    half_squared: FloatArray,
    middle: FloatArray,
    touch_x: float,
    distance_squared: FloatArray,
    rising: FloatArray,
    reach: FloatArray,
    integral: FloatArray,
) -> None:
    """Integrals over x of sqrt(a^2 - (x - m)^2) / sqrt(x^2 + y^2).

    They are those of strips ahead of or behind the point. With x = y sinh(u) the
    integrand in u has no pole, only roots at both ends: Gauss-Chebyshev quadrature. m
    counts from `touch_x`; `rising` and `reach` are work arrays.
    """
    count = half_squared.size
    for i in range(count):
        half, distance, m = (
            np.sqrt(half_squared[i]),
            np.sqrt(distance_squared[i]),
            middle[i] - touch_x,
        )
        # exp(u) at both ends without cancellation: t + sqrt(1 + t^2), or one over that
        # of -t.
        left, right = (m - half) / distance, (m + half) / distance
        first, last = (
            abs(left) + np.sqrt(1.0 + left * left),
            abs(right) + np.sqrt(1.0 + right * right),
        )
        first_inverse, last_inverse = 1.0 / first, 1.0 / last
        first = first_inverse if left < 0.0 else first
        last = last_inverse if right < 0.0 else last
        rising[i] = 0.5 * distance * np.sqrt(first * last)  # y exp(u) / 2 in the middle
        reach[i] = last / first
        integral[i] = 0.0
    for i in range(count):
        reach[i] = _half_logarithm(reach[i])
    for k in range(_PAIRS):
        for i in range(count):
            power = _exponential(reach[i] * _COSINE[k])
            inverse, m = 1.0 / power, middle[i] - touch_x
            falling = 0.25 * distance_squared[i] / rising[i]
            ahead = rising[i] * power - falling * inverse - m
            behind = rising[i] * inverse - falling * power - m
            ahead = max(half_squared[i] - ahead * ahead, 0.0)
            behind = max(half_squared[i] - behind * behind, 0.0)
            integral[i] += _WEIGHT[k] * reach[i] * (np.sqrt(ahead) + np.sqrt(behind))


@inner_bare_kernel
def find_outline(touch: float, row: Row, patch: Record) -> bool:
    """Return True if the gap around `touch` is below the rim of the patch.

    The outline, its centre and angle are filled in.
    """
    gap, profile, limit = row.gap, row.profile, patch.rim
    start = min(max(int(touch), 1), gap.size - 2)
    if gap[start] >= limit and start < gap.size - 2:
        start += 1
    stop = start
    if gap[start] >= limit:
        return False
    while start > 1 and gap[start - 1] < limit:
        start -= 1
    while stop < gap.size - 2 and gap[stop + 1] < limit:
        stop += 1
    weight, moment, tilt = 0.0, 0.0, 0.0
    for i in range(start, stop + 1):
        g = (limit - gap[i]) * (profile.y[i + 1] - profile.y[i - 1])
        weight += g
        moment += g * profile.y[i]
        tilt += g * profile.angle[i]
    patch.first, patch.last = start, stop
    patch.centre, patch.angle = moment / weight, tilt / weight
    patch.weight, patch.tilt = weight, tilt
    return True


@inner_bare_kernel
def find_edges(patch: Record, row: Row) -> None:
    """Lateral ends of a patch in its contact plane.

    There the interpenetration falls to zero.
    """
    profile, gap, limit = row.profile, row.gap, patch.rim
    cosine, sine = np.cos(patch.angle), np.sin(patch.angle)
    k, share = share_at(profile.y, patch.centre, patch.first, patch.last)
    patch.foot = between(profile.z, k, share)
    i, j = patch.first, patch.first - 1
    inside = (profile.y[i] - patch.centre) * cosine + (profile.z[i] - patch.foot) * sine
    beyond = (profile.y[j] - patch.centre) * cosine + (profile.z[j] - patch.foot) * sine
    patch.left = inside + (limit - gap[i]) / (gap[j] - gap[i]) * (beyond - inside)
    i, j = patch.last, patch.last + 1
    inside = (profile.y[i] - patch.centre) * cosine + (profile.z[i] - patch.foot) * sine
    beyond = (profile.y[j] - patch.centre) * cosine + (profile.z[j] - patch.foot) * sine
    patch.right = inside + (limit - gap[i]) / (gap[j] - gap[i]) * (beyond - inside)


@inner_bare_kernel
def lay_strips(
    patch: Record, row: Row, skewed: bool, strips: Strips, sections: Records
) -> None:
    """Cut a patch into strips in its contact plane, one at each grid point.

    `sections` keeps the wheel's sections from one approach of a row to the next.
    `patch` gets the sum of x_l^2 widths, s of both ends and the deepest x_l^2.
    """
    profile = row.profile
    start, stop = patch.first, patch.last
    limit, centre = patch.rim, patch.centre
    cosine, sine = np.cos(patch.angle), np.sin(patch.angle)
    find_edges(patch, row)
    base = patch.foot
    kappa = row.pose.kappa
    # Slices, because the compiler uses vector instructions only if no index can be
    # negative.
    points = slice(start - 1, stop + 2)
    y, z, tilt = profile.y[points], profile.z[points], profile.slope[points]
    opening, radius = row.gap[points], row.radius[points]
    s, edges, widths, square = (
        strips.s[points],
        strips.edge[points],
        strips.width[points],
        strips.square[points],
    )
    for i in range(y.size):
        s[i] = (y[i] - centre) * cosine + (z[i] - base) * sine
    for i in range(1, y.size - 1):
        wheel_slope = tilt[i] - (opening[i + 1] - opening[i - 1]) / (
            y[i + 1] - y[i - 1]
        )
        # There is no interpenetration at a step of the gap at the wheel's edge: such a
        # patch becomes an error later.
        depth = max((limit - opening[i]) / (cosine + wheel_slope * sine), 0.0)
        bend = kappa / (1.0 - kappa * z[i])
        square[i] = strip_half_length_squared(depth, radius[i] / cosine, bend * cosine)
    if skewed:
        _find_ends(start, stop, limit, row, sections)
        ahead, behind = row.ahead[points], row.behind[points]
        along, middle = row.along[points], strips.middle[points]
        for i in range(1, y.size - 1):
            half = np.sqrt(square[i])
            middle[i] = along[i] + 0.5 * half * (ahead[i] - behind[i])
            square[i] = 0.25 * square[i] * (ahead[i] + behind[i]) ** 2
    # Each strip extends half way to the next, the outer ones to the ends of the patch.
    last = y.size - 1
    for i in range(1, y.size):
        edges[i] = 0.5 * (s[i - 1] + s[i])
    edges[1], edges[last] = 0.5 * (patch.left + s[1]), 0.5 * (s[last - 1] + patch.right)
    for i in range(1, y.size - 1):
        widths[i] = edges[i + 1] - edges[i]
    volume, deepest = 0.0, 0.0
    for i in range(1, y.size - 1):
        volume += square[i] * widths[i]
        deepest = max(deepest, square[i])
    patch.volume, patch.deepest = volume, deepest


@inner_bare_kernel
def _find_ends(
    start: int, stop: int, limit: float, row: Row, sections: Records
) -> None:
    """Strip ends under a yawed wheel, as multiples of those of circles.

    They are linear between sections.
    """
    profile, wheel, stride = row.profile, row.wheel, row.stride
    before, i = start, start
    while True:
        section, neighbour = sections[i], sections[before]
        if section.row != row.mark:
            # Circle and ends of a neighbour are close.
            reference = (
                neighbour if i > start else sections[min(i - i % stride + stride, stop)]
            )
            near = reference.row == row.mark
            if near:
                section.ring = reference.ring
            _on_the_wheel(
                profile.y[i],
                profile.z[i],
                row.gap[i],
                row.along[i],
                row.pose,
                wheel,
                section,
            )
            section.row = row.mark
            section.ahead = section.behind = 1.0
            if near:
                section.ahead, section.behind = reference.ahead, reference.behind
        if section.met > 0:
            circle = np.sqrt(
                strip_half_length_squared(
                    limit - row.gap[i], row.radius[i], section.sigma
                )
            )
            section.ahead = _end_of_strip(
                limit - row.gap[i], circle, section.ahead, section, wheel
            )
            section.behind = _end_of_strip(
                limit - row.gap[i], -circle, section.behind, section, wheel
            )
        else:
            section.ahead = section.behind = 1.0
        change = abs(section.ahead - neighbour.ahead) + abs(
            section.behind - neighbour.behind
        )
        if change > _SMOOTH and i > before + 1:
            i = (before + i) // 2
            continue
        span = max(i - before, 1)
        for k in range(before, i + 1):
            share = (k - before) / span
            row.ahead[k] = neighbour.ahead + share * (section.ahead - neighbour.ahead)
            row.behind[k] = neighbour.behind + share * (
                section.behind - neighbour.behind
            )
        if i == stop:
            break
        before = i
        i = min(i - i % stride + stride, stop)


@inner_bare_kernel
def displacement_at(
    y: float, z: float, x: float, patch: Record, skewed: bool, strips: Strips
) -> float:
    """Surface displacement at a point by the strips of a patch.

    It is relative to 1 / (pi E*) and the pressure slope.
    """
    start, stop = patch.first, patch.last
    origin = (y - patch.centre) * np.cos(patch.angle) + (z - patch.foot) * np.sin(
        patch.angle
    )
    points = slice(start, stop + 1)
    edges, widths, square = (
        strips.edge[start : stop + 2],
        strips.width[points],
        strips.square[points],
    )
    distances, integrals = strips.distance[points], strips.integral[points]
    for i in range(square.size):
        distances[i] = (0.5 * ((edges[i] - origin) + (edges[i + 1] - origin))) ** 2
    for i in range(square.size):
        # Mean of ln|s| over the strip: the logarithmic singularity at the point itself.
        lower, upper, width = edges[i] - origin, edges[i + 1] - origin, widths[i]
        if max(abs(lower), abs(upper)) < 8.0 * width:
            mean = -1.0
            if upper != 0.0:
                mean += upper * np.log(abs(upper)) / width
            if lower != 0.0:
                mean -= lower * np.log(abs(lower)) / width
            distances[i] = np.exp(2.0 * mean)
    if skewed:
        skewed_displacement_integrals(
            square,
            strips.middle[points],
            x,
            distances,
            strips.rising[points],
            strips.reach[points],
            integrals,
        )
    else:
        for i in range(square.size):
            integrals[i] = displacement_integral(square[i], distances[i])
    displacement = 0.0
    for i in range(square.size):
        displacement += integrals[i] * widths[i]
    return displacement
