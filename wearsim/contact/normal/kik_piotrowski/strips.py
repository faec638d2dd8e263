"""Kernels of one patch of the virtual penetration model: strip ends under yaw, outline, surface displacement.

Equations and sources: see `kik_piotrowski`.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.gap import place_in, smooth_at
from wearsim.contact.kernel import kernel
from wearsim.contact.patch import FloatArray

_STEPS = 12  # of Newton's method, at most
_DONE = 1e-4  # a last step, over the length: what it leaves is the half of its square, 5e-9
_STILL = 1e-8  # m, likewise: its square over a radius of 10 mm is 1e-14 m


@kernel
def on_the_wheel(
    y: float,
    z: float,
    gap: float,
    along: float,
    pose: FloatArray,
    wheel: tuple[FloatArray, FloatArray, FloatArray],
    point: FloatArray,
) -> None:
    """Point of the wheel nearest to a place of the counterface, and the directions of its section there.

    `pose` is (sin yaw, cos yaw, sin roll, cos roll, shift, half span, nominal radius, kappa). Fills `point`
    (12,): components along the wheelset's axes (forward, axle, down) of the point, of the rolling direction
    and of the normal to the roller's top, the curvature of the roller's section, -1 if no wheel is there,
    and the ring.
    """
    sy, cy, sr, cr = pose[0], pose[1], pose[2], pose[3]
    shift, half_span, nominal_radius, kappa = pose[4], pose[5], pose[6], pose[7]
    sine = kappa * along / (1.0 - kappa * (z - gap))
    cosine = np.sqrt(1.0 - sine * sine)
    point[3], point[4], point[5] = cy * cosine, -sy * cr * cosine + sr * sine, sy * sr * cosine + cr * sine
    point[6], point[7], point[8] = -cy * sine, sy * cr * sine + sr * cosine, -sy * sr * sine + cr * cosine
    point[9] = kappa / (1.0 - kappa * z)
    # From the counterface, straight down on a rail, along the radius on a roller.
    x0 = along * (1.0 - kappa * z) / (1.0 - kappa * (z - gap))
    y0 = y - shift + half_span
    z0 = z * cosine + kappa * x0 * x0 / ((1.0 - kappa * z) ** 2 * (1.0 + cosine)) + nominal_radius
    f = cy * x0 + sy * y0
    a = -sy * cr * x0 + cy * cr * y0 + sr * z0 - half_span
    d = sy * sr * x0 - cy * sr * y0 + cr * z0
    n = -gap
    ring = int(point[11])
    point[10] = -1.0
    for _ in range(_STEPS):
        ring = place_in(wheel[0], a + n * point[7], ring)
        if ring < 0:
            return
        radius, slope = smooth_at(wheel[0], wheel[1], wheel[2], ring, a + n * point[7])
        forward, down = f + n * point[6], d + n * point[8]
        length = np.sqrt(forward * forward + down * down)
        move = (radius - length) / ((forward * point[6] + down * point[8]) / length - slope * point[7])
        n += move
        if abs(move) < _STILL:
            point[10] = 1.0
            break
    point[0], point[1], point[2] = f + n * point[6], a + n * point[7], d + n * point[8]
    point[11] = ring


@kernel
def end_of_strip(
    depth: float,
    circle: float,
    factor: float,
    point: FloatArray,
    wheel: tuple[FloatArray, FloatArray, FloatArray],
) -> float:
    """Where the section through `point` leaves the counterface when the wheel is pushed in by `depth`.

    As a multiple of `circle`, the end for circles, whose sign gives the end. Searched from the multiple
    `factor` and, if that leads nowhere, from 1; 1 if there is no end up to five times as far.
    """
    start = factor * circle
    x = start
    ring = int(point[11])
    for _ in range(2 * _STEPS):
        root = np.sqrt(1.0 - (point[9] * x) ** 2)
        n = point[9] * x * x / (1.0 + root) - depth
        tilt = point[9] * x / root
        f = point[0] + x * point[3] + n * point[6]
        a = point[1] + x * point[4] + n * point[7]
        d = point[2] + x * point[5] + n * point[8]
        ring = place_in(wheel[0], a, ring)
        opening, move = 0.0, 0.0
        if ring >= 0:
            radius, slope = smooth_at(wheel[0], wheel[1], wheel[2], ring, a)
            length = np.sqrt(f * f + d * d)
            opening = (f * (point[3] + tilt * point[6]) + d * (point[5] + tilt * point[8])) / length
            opening -= slope * (point[4] + tilt * point[7])
            move = (radius - length) / opening
        if opening * circle <= 0.0 or (x + move) / circle < 0.2 or (x + move) / circle > 5.0:
            if start == circle:
                return 1.0
            x = start = circle
            ring = int(point[11])
            continue
        x += move
        if abs(move) < _DONE * abs(x):
            break
    return x / circle


# Nodes of the quadrature of skewed strips, pairs about the middle: together they reach 1e-9 for distances
# beyond 0.3 of the half length, 2e-5 at 0.001.
_PAIRS = 3
_TURN = np.pi * np.arange(1, _PAIRS + 1) / (2 * _PAIRS + 1)
_COSINE, _WEIGHT = np.cos(_TURN), np.sin(_TURN) * np.pi / (2 * _PAIRS + 1)

WORK_ROWS = 10
"""Rows of the working array of `fill_strips`, one column per grid point."""

SECTION = 16
"""What is kept of the wheel's section at a grid point: 12 numbers of `on_the_wheel`, the row of the batch
they belong to (counted from 1) and both ends as multiples of those of circles; one place is free."""


@kernel
def strip_half_length_squared(depth: float, radius: float, sigma: float) -> float:
    """Half chord, squared, of a circle of `radius` and one of curvature `sigma` overlapping by `depth`.

    Exact for circles: (4)-(6) of Liu and Bruni solved for x with z_w + z_r = g; sigma = 0 is the rail.
    """
    chord = depth * (2.0 * radius - depth) * (2.0 - depth * sigma) * (2.0 + (2.0 * radius - depth) * sigma)
    return chord / (4.0 * (1.0 + (radius - depth) * sigma) ** 2)


@kernel
def displacement_integral(half_squared: float, distance_squared: float) -> float:
    """Integral over x of sqrt(a^2 - x^2) / sqrt(x^2 + y^2): 2 sqrt(a^2 + y^2) (K - E), by the AGM."""
    total = half_squared + distance_squared
    a, b = 1.0, np.sqrt(distance_squared / total)
    c_squared = half_squared / total
    power, weighted = 0.5, 0.5 * c_squared
    # A fixed number of steps lets the loop over the strips use vector instructions.
    for _ in range(4):
        c = 0.5 * (a - b)
        a, b = 0.5 * (a + b), np.sqrt(a * b)
        power *= 2.0
        weighted += power * c * c
    # The rest as power series of c / a, which is below 0.01 for y/a down to 1e-5, finer than any grid
    # point's share: the next steps change the mean by x^2 / 4 + ... and the sum by x^4 / 16 + ...
    c = 0.5 * (a - b)
    a = 0.5 * (a + b)
    x = (c / a) ** 2
    weighted += 16.0 * c * c * (1.0 + x * (0.125 + x * 0.0625))
    mean = 1.0 + x * (0.25 + x * (9.0 / 64.0 + x * (25.0 / 256.0)))
    integral: float = np.pi * np.sqrt(total) * weighted * mean / a
    return integral


@kernel
def cell_of(grid: FloatArray, place: float, first: int, last: int) -> int:
    """Return the grid cell between `first` and `last` that holds `place`."""
    k = first
    while k < last - 1 and grid[k + 1] <= place:
        k += 1
    return k


@kernel
def _half_logarithm(value: float) -> float:
    """Return ln(value) / 2 for values from 1 to 1e10, to rounding; in a loop it takes vector instructions."""
    root = np.sqrt(np.sqrt(np.sqrt(np.sqrt(np.sqrt(np.sqrt(value))))))
    z = (root - 1.0) / (root + 1.0)
    t = z * z
    # 64 areatanh(z)
    series = 1 / 11 + t * (1 / 13 + t * (1 / 15 + t * (1 / 17 + t * (1 / 19))))
    series = 1.0 + t * (1 / 3 + t * (1 / 5 + t * (1 / 7 + t * (1 / 9 + t * series))))
    half: float = 64.0 * z * series
    return half


@kernel
def _exponential(value: float) -> float:
    """Return exp(value) for values from 0 to 12, to rounding; in a loop it takes vector instructions."""
    y = value / 32.0
    series = 1 / 720 + y * (1 / 5040 + y * (1 / 40320 + y * (1 / 362880 + y * (1 / 3628800 + y / 39916800))))
    series = 1.0 + y * (1.0 + y * (1 / 2 + y * (1 / 6 + y * (1 / 24 + y * (1 / 120 + y * series)))))
    for _ in range(5):
        series *= series
    return series


@kernel
def skewed_displacement_integrals(
    half_squared: FloatArray,
    middle: FloatArray,
    touch_x: float,
    distance_squared: FloatArray,
    rising: FloatArray,
    reach: FloatArray,
    integral: FloatArray,
) -> None:
    """Integrals over x of sqrt(a^2 - (x - m)^2) / sqrt(x^2 + y^2), for strips that lie ahead or behind.

    With x = y sinh(u) the integrand in u has no pole, only roots at both ends: Gauss-Chebyshev quadrature.
    m counts from `touch_x`; `rising` and `reach` are for work.
    """
    count = half_squared.size
    for i in range(count):
        half, distance, m = np.sqrt(half_squared[i]), np.sqrt(distance_squared[i]), middle[i] - touch_x
        # exp(u) at both ends, without cancellation: t + sqrt(1 + t^2), or one over that of -t.
        left, right = (m - half) / distance, (m + half) / distance
        first, last = abs(left) + np.sqrt(1.0 + left * left), abs(right) + np.sqrt(1.0 + right * right)
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


@kernel
def find_outline(
    touch: float, limit: float, grid_y: FloatArray, angle: FloatArray, gap: FloatArray, line: FloatArray
) -> int:
    """Grid points around `touch` where the gap is below `limit`; their number.

    Fills `line` with the first and last one, the lateral centre of the interpenetration and its mean angle,
    and from place 13 on the weight, both as sums: weight, weight x centre, weight x angle.
    """
    start = min(max(int(touch), 1), gap.size - 2)
    if gap[start] >= limit and start < gap.size - 2:
        start += 1
    stop = start
    if gap[start] >= limit:
        return 0
    while start > 1 and gap[start - 1] < limit:
        start -= 1
    while stop < gap.size - 2 and gap[stop + 1] < limit:
        stop += 1
    moment = 0.0
    weight = 0.0
    tilt = 0.0
    for i in range(start, stop + 1):
        g = (limit - gap[i]) * (grid_y[i + 1] - grid_y[i - 1])
        weight += g
        moment += g * grid_y[i]
        tilt += g * angle[i]
    line[0], line[1], line[2], line[3] = start, stop, moment / weight, tilt / weight
    line[13], line[14] = weight, tilt
    return stop - start + 1


@kernel
def fill_strips(
    line: FloatArray, row: int, profile: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    here: tuple[FloatArray, FloatArray, FloatArray], pose: FloatArray,
    wheel: tuple[FloatArray, FloatArray, FloatArray], skewed: bool, kappa: float, work: FloatArray,
    sections: FloatArray,
) -> None:  # fmt: skip
    """Cut a patch into strips in its contact plane, at the grid points of `line`.

    Fills `work` with position s in the contact plane, interpenetration g, width of the strip, squared
    half-length and the longitudinal position of its middle; `sections` keeps the section of the wheel at each
    grid point from one approach to the next. `line` gets the sum of x_l^2 widths, s of the left and right end
    and the deepest x_l^2.
    """
    grid_y, grid_z, slope = profile[0], profile[1], profile[2]
    gap, radius = here[0], here[1]
    start, stop = int(line[0]), int(line[1])
    centre, limit = line[2], line[10]
    cosine, sine = np.cos(line[3]), np.sin(line[3])
    k = cell_of(grid_y, centre, start, stop)
    share = (centre - grid_y[k]) / (grid_y[k + 1] - grid_y[k])
    centre_z = grid_z[k] + share * (grid_z[k + 1] - grid_z[k])
    line[15] = centre_z
    # Slices, because the compiler uses vector instructions only where no index can be negative.
    points = slice(start - 1, stop + 2)
    y, z, tilt, opening, ring = grid_y[points], grid_z[points], slope[points], gap[points], radius[points]
    place, depth, halves = work[0][points], work[1][points], work[3][points]
    for i in range(y.size):
        place[i] = (y[i] - centre) * cosine + (z[i] - centre_z) * sine
    for i in range(1, y.size - 1):
        wheel_slope = tilt[i] - (opening[i + 1] - opening[i - 1]) / (y[i + 1] - y[i - 1])
        # No interpenetration where the wheel's edge makes a step of the gap: such a patch is an error later.
        depth[i] = max((limit - opening[i]) / (cosine + wheel_slope * sine), 0.0)
    for i in range(1, y.size - 1):
        bend = kappa / (1.0 - kappa * z[i])
        halves[i] = strip_half_length_squared(depth[i], ring[i] / cosine, bend * cosine)
    if skewed:
        _skew_strips(row, start, stop, limit, profile, here, pose, wheel, work, sections)
    # Ends of the patch: where the interpenetration falls to zero.
    share = (limit - gap[start]) / (gap[start - 1] - gap[start])
    left = work[0, start] + share * (work[0, start - 1] - work[0, start])
    share = (limit - gap[stop]) / (gap[stop + 1] - gap[stop])
    right = work[0, stop] + share * (work[0, stop + 1] - work[0, stop])
    # Each strip reaches half way to the next one.
    edges = work[7][points]
    for i in range(1, y.size):
        edges[i] = 0.5 * (place[i - 1] + place[i])
    edges[1], edges[y.size - 1] = 0.5 * (left + place[1]), 0.5 * (place[y.size - 2] + right)
    widths = work[2][points]
    for i in range(1, y.size - 1):
        widths[i] = edges[i + 1] - edges[i]
    volume, deepest = 0.0, 0.0
    for i in range(1, y.size - 1):
        volume += halves[i] * widths[i]
        deepest = max(deepest, halves[i])
    line[5], line[6], line[7], line[8] = volume, left, right, deepest


@kernel
def _skew_strips(
    row: int, start: int, stop: int, limit: float,
    profile: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    here: tuple[FloatArray, FloatArray, FloatArray], pose: FloatArray,
    wheel: tuple[FloatArray, FloatArray, FloatArray], work: FloatArray, sections: FloatArray,
) -> None:  # fmt: skip
    """Half lengths and middles of the strips of `fill_strips` under a yawed wheel."""
    gap, radius, along = here[0], here[1], here[2]
    for i in range(start, stop + 1):
        section = sections[i]
        if section[12] != row + 1.0:
            # The neighbour's ring and ends are near.
            neighbour = sections[i - 1] if sections[i - 1, 12] == row + 1.0 else sections[i + 1]
            near = neighbour[12] == row + 1.0
            if near:
                section[11] = neighbour[11]
            on_the_wheel(profile[0][i], profile[1][i], gap[i], along[i], pose, wheel, section)
            section[12] = row + 1.0
            section[13] = neighbour[13] if near else 1.0
            section[14] = neighbour[14] if near else 1.0
        half = np.sqrt(work[3, i])
        lead, trail = half, -half
        if section[10] > 0.0:
            circle = np.sqrt(strip_half_length_squared(limit - gap[i], radius[i], section[9]))
            section[13] = end_of_strip(limit - gap[i], circle, section[13], section, wheel)
            section[14] = end_of_strip(limit - gap[i], -circle, section[14], section, wheel)
            lead, trail = half * section[13], -half * section[14]
        work[3, i] = 0.25 * (lead - trail) ** 2
        work[4, i] = along[i] + 0.5 * (lead + trail)


@kernel
def displacement_at(
    touch_y: float, touch_z: float, touch_x: float, line: FloatArray, skewed: bool, work: FloatArray
) -> float:
    """Surface displacement at a point, over 1 / (pi E*) and the pressure slope, by the strips of a patch."""
    start, stop = int(line[0]), int(line[1])
    origin = (touch_y - line[2]) * np.cos(line[3]) + (touch_z - line[15]) * np.sin(line[3])
    points = slice(start, stop + 1)
    edges, halves, widths = work[7][start : stop + 2], work[3][points], work[2][points]
    distances, integrals = work[5][points], work[6][points]
    for i in range(halves.size):
        distances[i] = (0.5 * ((edges[i] - origin) + (edges[i + 1] - origin))) ** 2
    for i in range(halves.size):
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
            halves, work[4][points], touch_x, distances, work[8][points], work[9][points], integrals
        )
    else:
        for i in range(halves.size):
            integrals[i] = displacement_integral(halves[i], distances[i])
    displacement = 0.0
    for i in range(halves.size):
        displacement += integrals[i] * widths[i]
    return displacement
