"""Kernels of one patch of the virtual penetration model: its outline, strips and surface displacement.

Equations and sources: see `kik_piotrowski`.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.kernel import kernel
from wearsim.contact.normal.strip_ends import end_of_strip, on_the_wheel
from wearsim.contact.patch import FloatArray

# Nodes of the quadrature of skewed strips: 1e-9 for distances beyond 0.3 of the half length, 2e-5 at 0.001.
_NODES = 6
_TURN = np.pi * np.arange(1, _NODES + 1) / (_NODES + 1)
_COSINE, _SINE = np.cos(_TURN), np.sin(_TURN)

WORK_ROWS = 21
"""Rows of the working array of `fill_strips`, one column per grid point."""


@kernel
def strip_half_length_squared(
    depth: float,
    radius: float,
    sigma: float,
) -> float:
    """Half chord, squared, of a circle of `radius` and one of curvature `sigma` overlapping by `depth`.

    Exact for circles: (4)-(6) of Liu and Bruni solved for x with z_w + z_r = g; sigma = 0 is the rail.
    """
    chord = depth * (2.0 * radius - depth) * (2.0 - depth * sigma) * (2.0 + (2.0 * radius - depth) * sigma)
    return chord / (4.0 * (1.0 + (radius - depth) * sigma) ** 2)


@kernel
def displacement_integral(
    half_squared: float,
    distance_squared: float,
) -> float:
    """Integral over x of sqrt(a^2 - x^2) / sqrt(x^2 + y^2): 2 sqrt(a^2 + y^2) (K - E), by the AGM."""
    total = half_squared + distance_squared
    a, b = 1.0, np.sqrt(distance_squared / total)
    c_squared = half_squared / total
    power, weighted = 0.5, 0.5 * c_squared
    # Quadratic convergence: seven steps reach rounding for y/a down to 1e-5, finer than any grid point's
    # share. A fixed number of them lets the loop over the strips use vector instructions.
    for _ in range(7):
        c = 0.5 * (a - b)
        a, b = 0.5 * (a + b), np.sqrt(a * b)
        power *= 2.0
        weighted += power * c * c
    integral: float = np.pi * np.sqrt(total) * weighted / a
    return integral


@kernel
def cell_of(grid: FloatArray, place: float, first: int, last: int) -> int:
    """Return the grid cell between `first` and `last` that holds `place`."""
    k = first
    while k < last - 1 and grid[k + 1] <= place:
        k += 1
    return k


@kernel
def skewed_displacement_integral(half: float, middle: float, distance: float) -> float:
    """Integral over x of sqrt(a^2 - (x - m)^2) / sqrt(x^2 + y^2), for strips that lie ahead or behind.

    With x = y sinh(u) the integrand in u has no pole, only roots at both ends: Gauss-Chebyshev quadrature.
    """
    first = np.arcsinh((middle - half) / distance)
    last = np.arcsinh((middle + half) / distance)
    centre, reach = 0.5 * (first + last), 0.5 * (last - first)
    total = 0.0
    for k in range(_NODES):
        power = np.exp(centre + reach * _COSINE[k])
        off = 0.5 * distance * (power - 1.0 / power) - middle
        total += _SINE[k] * np.sqrt(max(half * half - off * off, 0.0))
    integral: float = np.pi * reach / (_NODES + 1) * total
    return integral


@kernel
def find_outline(
    touch: float,
    limit: float,
    grid_y: FloatArray,
    angle: FloatArray,
    gap: FloatArray,
    line: FloatArray,
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
    line: FloatArray,
    row: int,
    ground: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    here: tuple[FloatArray, FloatArray, FloatArray],
    pose: FloatArray,
    rings: tuple[FloatArray, FloatArray, FloatArray],
    skewed: bool,
    kappa: float,
    work: FloatArray,
) -> None:
    """Lay strips of a patch into its contact plane, at the grid points of `line`.

    Fills `work` with position s in the contact plane, interpenetration g, width of the strip, squared
    half-length and the longitudinal position of its middle; from row 5 on it keeps the section of the wheel
    at each grid point (last row: for which row of the batch). `line` gets the sum of x_l^2 widths, s of the
    left and right end and the deepest x_l^2.
    """
    grid_y, grid_z, slope = ground[0], ground[1], ground[2]
    gap, radius, along = here[0], here[1], here[2]
    start, stop = int(line[0]), int(line[1])
    centre, limit = line[2], line[10]
    cosine, sine = np.cos(line[3]), np.sin(line[3])
    k = cell_of(grid_y, centre, start, stop)
    share = (centre - grid_y[k]) / (grid_y[k + 1] - grid_y[k])
    centre_z = grid_z[k] + share * (grid_z[k + 1] - grid_z[k])
    line[15] = centre_z
    for i in range(start - 1, stop + 2):
        work[0, i] = (grid_y[i] - centre) * cosine + (grid_z[i] - centre_z) * sine
    for i in range(start, stop + 1):
        wheel_slope = slope[i] - (gap[i + 1] - gap[i - 1]) / (grid_y[i + 1] - grid_y[i - 1])
        # No interpenetration where the wheel's edge makes a step of the gap: such a patch is refused later.
        work[1, i] = max((limit - gap[i]) / (cosine + wheel_slope * sine), 0.0)
    # Ends of the patch: where the interpenetration falls to zero.
    share = (limit - gap[start]) / (gap[start - 1] - gap[start])
    left = work[0, start] + share * (work[0, start - 1] - work[0, start])
    share = (limit - gap[stop]) / (gap[stop + 1] - gap[stop])
    right = work[0, stop] + share * (work[0, stop + 1] - work[0, stop])
    volume, deepest = 0.0, 0.0
    for i in range(start, stop + 1):
        before = 0.5 * (work[0, i] + (work[0, i - 1] if i > start else left))
        after = 0.5 * (work[0, i] + (work[0, i + 1] if i < stop else right))
        bend = kappa / (1.0 - kappa * grid_z[i])
        half = strip_half_length_squared(work[1, i], radius[i] / cosine, bend * cosine)
        work[2, i] = after - before
        work[4, i] = 0.0
        if skewed:
            section = work[5:17, i]
            if work[17, i] != row + 1.0:
                on_the_wheel(grid_y[i], grid_z[i], gap[i], along[i], pose, rings, section)
                work[17, i] = row + 1.0
                work[19, i] = work[20, i] = 1.0
            circle = np.sqrt(strip_half_length_squared(limit - gap[i], radius[i], section[9]))
            half = np.sqrt(half)
            lead, trail = half, -half
            if section[10] > 0.0:
                # Ends as multiples of those of circles; they start from the last approach's.
                work[19, i] = end_of_strip(limit - gap[i], work[19, i] * circle, section, rings) / circle
                work[20, i] = end_of_strip(limit - gap[i], -work[20, i] * circle, section, rings) / -circle
                lead, trail = half * work[19, i], -half * work[20, i]
            half = 0.25 * (lead - trail) ** 2
            work[4, i] = along[i] + 0.5 * (lead + trail)
        work[3, i] = half
        volume += half * work[2, i]
        deepest = max(deepest, half)
    line[5], line[6], line[7], line[8] = volume, left, right, deepest


@kernel
def skewed_ends(
    depth: float,
    half: float,
    radius: float,
    section: FloatArray,
    rings: tuple[FloatArray, FloatArray, FloatArray],
) -> tuple[float, float]:
    """Find both ends of a strip from its middle under a yawed wheel; `half` is its half length for circles.

    The section at constant y gives by which factors both ends differ from those of circles there; without
    yaw they are 1.
    """
    if depth <= 0.0 or section[10] < 0.0:
        return half, -half
    circle = np.sqrt(strip_half_length_squared(depth, radius, section[9]))
    lead = end_of_strip(depth, circle, section, rings)
    trail = end_of_strip(depth, -circle, section, rings)
    return half * lead / circle, half * trail / circle


@kernel
def displacement_at(
    touch_y: float,
    touch_z: float,
    touch_x: float,
    line: FloatArray,
    skewed: bool,
    work: FloatArray,
) -> float:
    """Surface displacement at a point, over 1 / (pi E*) and the pressure slope, by the strips of a patch."""
    start, stop = int(line[0]), int(line[1])
    left, right = line[6], line[7]
    origin = (touch_y - line[2]) * np.cos(line[3]) + (touch_z - line[15]) * np.sin(line[3])
    displacement = 0.0
    for i in range(start, stop + 1):
        before = 0.5 * (work[0, i] + (work[0, i - 1] if i > start else left))
        after = 0.5 * (work[0, i] + (work[0, i + 1] if i < stop else right))
        width = work[2, i]
        # Mean of ln|s| over the strip: the logarithmic singularity at the point itself.
        lower, upper = before - origin, after - origin
        if max(abs(lower), abs(upper)) < 8.0 * width:
            mean = -1.0
            if upper != 0.0:
                mean += upper * np.log(abs(upper)) / width
            if lower != 0.0:
                mean -= lower * np.log(abs(lower)) / width
            distance = np.exp(mean)
        else:
            distance = abs(0.5 * (lower + upper))
        work[18, i] = distance * distance
    if skewed:
        for i in range(start, stop + 1):
            middle = work[4, i] - touch_x
            displacement += (
                skewed_displacement_integral(np.sqrt(work[3, i]), middle, np.sqrt(work[18, i])) * work[2, i]
            )
    else:
        for i in range(start, stop + 1):
            displacement += displacement_integral(work[3, i], work[18, i]) * work[2, i]
    return displacement
