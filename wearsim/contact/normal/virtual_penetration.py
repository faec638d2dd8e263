"""Kernels of the virtual penetration model: one patch, all patches of a wheel, and the balance of its load.

Equations and sources: see `kik_piotrowski`.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.geometry import NO_WHEEL
from wearsim.contact.kernel import kernel
from wearsim.contact.normal.refusal import AT_EDGE, NO_BALANCE, NO_TOUCH, NOT_SINGLE, TOO_MANY
from wearsim.contact.patch import FloatArray, IntArray

_TOO_THIN = 3  # grid points below which an outline is not resolved


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
def _patch_load(
    first: int,
    last: int,
    touch: float,
    low: float,
    approach: float,
    factor: float,
    grid_y: FloatArray,
    grid_z: FloatArray,
    slope: FloatArray,
    angle: FloatArray,
    gap: FloatArray,
    radius: FloatArray,
    kappa: float,
    modulus: float,
    work: FloatArray,
    out: FloatArray,
) -> float:
    """Return the normal force of the patch of one basin of the gap under a vertical approach.

    Fills `work` with, at the grid points `start..stop` of the patch, position s in the contact plane,
    interpenetration g, integration weight, squared half-length and squared distance from the point of
    first contact; `out` with (start, stop, centre y, angle, normal approach, sum of x_l^2 weights, s of the
    left and right end, deepest x_l^2). The force is 0 where the patch is too thin for the grid.
    """
    limit = low + factor * approach
    start = int(np.floor(touch))
    start = min(max(start, first), last)
    if gap[start] >= limit and start < last:
        start += 1
    stop = start
    if gap[start] >= limit:
        return 0.0
    while start > first and gap[start - 1] < limit:
        start -= 1
    while stop < last and gap[stop + 1] < limit:
        stop += 1
    if stop - start + 1 < _TOO_THIN:
        return 0.0
    moment = 0.0
    weight = 0.0
    tilt = 0.0
    for i in range(start, stop + 1):
        g = (limit - gap[i]) * (grid_y[i + 1] - grid_y[i - 1])
        weight += g
        moment += g * grid_y[i]
        tilt += g * angle[i]
    centre, delta = moment / weight, tilt / weight
    cosine, sine = np.cos(delta), np.sin(delta)
    k = cell_of(grid_y, centre, start, stop)
    share = (centre - grid_y[k]) / (grid_y[k + 1] - grid_y[k])
    centre_z = grid_z[k] + share * (grid_z[k + 1] - grid_z[k])
    k = int(touch)
    touch_y = grid_y[k] + (touch - k) * (grid_y[k + 1] - grid_y[k])
    touch_z = grid_z[k] + (touch - k) * (grid_z[k + 1] - grid_z[k])
    origin = (touch_y - centre) * cosine + (touch_z - centre_z) * sine
    for i in range(start, stop + 1):
        wheel_slope = slope[i] - (gap[i + 1] - gap[i - 1]) / (grid_y[i + 1] - grid_y[i - 1])
        work[0, i] = (grid_y[i] - centre) * cosine + (grid_z[i] - centre_z) * sine
        work[1, i] = (limit - gap[i]) / (cosine + wheel_slope * sine)
    # Ends of the patch: where the interpenetration falls to zero, or the saddle towards a neighbour.
    left, right = work[0, start], work[0, stop]
    if gap[start - 1] >= limit:
        share = (limit - gap[start]) / (gap[start - 1] - gap[start])
        left -= (work[0, start + 1] - work[0, start]) * share
    if gap[stop + 1] >= limit:
        share = (limit - gap[stop]) / (gap[stop + 1] - gap[stop])
        right += (work[0, stop] - work[0, stop - 1]) * share
    volume, displacement, deepest = 0.0, 0.0, 0.0
    for i in range(start, stop + 1):
        before = 0.5 * (work[0, i] + work[0, i - 1]) if i > start else 0.5 * (work[0, i] + left)
        after = 0.5 * (work[0, i] + work[0, i + 1]) if i < stop else 0.5 * (work[0, i] + right)
        width = after - before
        sigma = kappa / (1.0 - kappa * grid_z[i]) * cosine
        half = strip_half_length_squared(work[1, i], radius[i] / cosine, sigma)
        work[2, i] = width
        work[3, i] = half
        volume += half * width
        deepest = max(deepest, half)
        # Mean of ln|s| over the strip: the logarithmic singularity at the point of first contact.
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
        work[4, i] = distance * distance
    for i in range(start, stop + 1):
        displacement += displacement_integral(work[3, i], work[4, i]) * work[2, i]
    normal_approach = approach * cosine
    out[0], out[1], out[2], out[3], out[4] = start, stop, centre, delta, normal_approach
    out[5], out[6], out[7], out[8] = volume, left, right, deepest
    force: float = np.pi * modulus * normal_approach * (0.5 * np.pi * volume) / displacement
    return force


@kernel
def _basins(
    gap: FloatArray,
    low: float,
    deepest_search: float,
    minima: FloatArray,
    saddles: IntArray,
) -> int:
    """Local minima of the gap below `low + deepest_search`, as fractional grid positions, and saddles.

    `saddles[k]` is the index of the highest point between minima k and k + 1. Returns their number.
    """
    found = 0
    top = -1
    for i in range(1, gap.size - 1):
        if found > 0 and (top < 0 or gap[i] > gap[top]):
            top = i
        if gap[i] < gap[i - 1] and gap[i] <= gap[i + 1] and gap[i] < low + deepest_search:
            if found == minima.shape[1]:
                break
            bend = gap[i - 1] - 2.0 * gap[i] + gap[i + 1]
            move = 0.5 * (gap[i - 1] - gap[i + 1]) / bend
            minima[0, found] = i + move
            minima[1, found] = gap[i] - 0.25 * (gap[i - 1] - gap[i + 1]) * move
            if found > 0:
                saddles[found - 1] = top
            found += 1
            top = -1
    return found


@kernel
def _wheel_load(
    approach: float,
    low: float,
    found: int,
    minima: FloatArray,
    saddles: IntArray,
    factor: float,
    vertical: bool,
    grid_y: FloatArray,
    grid_z: FloatArray,
    slope: FloatArray,
    angle: FloatArray,
    gap: FloatArray,
    radius: FloatArray,
    kappa: float,
    modulus: float,
    work: FloatArray,
    patches: FloatArray,
) -> tuple[float, int]:
    """Load of all patches of one wheel under a rigid approach; `patches` gets one line per patch."""
    total, used = 0.0, 0
    k = 0
    last_point = gap.size - 2
    while k < found:
        # A run of basins joined by saddles inside the virtual penetration of the deepest so far.
        deepest, end = k, k
        while end + 1 < found:
            nearer = deepest if minima[1, deepest] <= minima[1, end + 1] else end + 1
            height = minima[1, nearer] - low
            if gap[saddles[end]] - minima[1, nearer] < factor * (approach - height):
                end += 1
                deepest = nearer
            else:
                break
        own = approach - (minima[1, deepest] - low)
        if own > 0.0:
            first = saddles[k - 1] if k > 0 else 1
            last = saddles[end] if end + 1 < found else last_point
            line = patches[min(used, patches.shape[0] - 1)]
            force = _patch_load(
                first,
                last,
                minima[0, deepest],
                minima[1, deepest],
                own,
                factor,
                grid_y,
                grid_z,
                slope,
                angle,
                gap,
                radius,
                kappa,
                modulus,
                work,
                line,
            )
            if force > 0.0:
                line[9] = force
                line[10] = minima[1, deepest] + factor * own
                used += 1
                total += force * np.cos(line[3]) if vertical else force
        k = end + 1
    return total, used


@kernel
def balance(
    grid_y: FloatArray,
    grid_z: FloatArray,
    slope: FloatArray,
    angle: FloatArray,
    gaps: FloatArray,
    radii: FloatArray,
    kappa: float,
    load: FloatArray,
    vertical: bool,
    factor: float,
    modulus: float,
    work: FloatArray,
    count: IntArray,
    fault: IntArray,
    patches: FloatArray,
) -> None:
    """Find the approach of each row that carries its load.

    `patches` (n, most, 13) gets a line per patch, by falling normal force: (first and last grid point,
    centre y, angle, normal approach, sum of x_l^2 weights, s of the left and right end, deepest x_l^2,
    normal force, gap at the rim, load scale, descent).
    """
    minima = np.empty((2, 64))
    saddles = np.empty(64, np.int64)
    lines = np.empty((16, 13))
    for row in range(load.size):
        gap, radius = gaps[row], radii[row]
        low = gap.min()
        if low >= NO_WHEEL:
            fault[row] = NO_TOUCH
            continue
        # Hertz-like guess for a sphere of the wheel's radius; then grow until the load is exceeded.
        approach = (load[row] / modulus) ** (2.0 / 3.0) * 0.8
        found = _basins(gap, low, 0.02, minima, saddles)
        if found == 0:
            fault[row] = AT_EDGE
            continue
        low = minima[1, :found].min()
        lower, upper, load_lower, load_upper = 0.0, -1.0, 0.0, 0.0
        value, used = 0.0, 0
        for trial in range(200):
            value, used = _wheel_load(
                approach,
                low,
                found,
                minima,
                saddles,
                factor,
                vertical,
                grid_y,
                grid_z,
                slope,
                angle,
                gap,
                radius,
                kappa,
                modulus,
                work,
                lines,
            )
            excess = value / load[row] - 1.0
            if abs(excess) < 1e-9:
                break
            if excess < 0.0:
                lower, load_lower = approach, value
            else:
                upper, load_upper = approach, value
            if upper < 0.0:
                grow = (load[row] / value) ** (2.0 / 3.0) * 1.0001 if value > 0.0 else 4.0
                approach *= min(max(grow, 1.0 + 1e-9), 4.0)
                if approach > 0.01:
                    break
            elif lower == 0.0:
                shrink = (load[row] / value) ** (2.0 / 3.0) * 0.9999
                approach *= min(max(shrink, 0.1), 1.0 - 1e-9)
            else:
                if upper - lower < 1e-14 * upper:
                    break
                # N grows about as the 1.5th power: secant in N^(2/3), guarded by bisection.
                a, b = load_lower ** (2.0 / 3.0), load_upper ** (2.0 / 3.0)
                approach = lower + (upper - lower) * (load[row] ** (2.0 / 3.0) - a) / (b - a)
                margin = 1e-3 * (upper - lower) if trial < 40 else 0.5 * (upper - lower)
                approach = min(max(approach, lower + margin), upper - margin)
        if used == 0 or value <= 0.0:
            fault[row] = AT_EDGE
            continue
        # Pressures are scaled to the last digits of the load; where patches merge the load jumps, and what
        # lies between its two sides is met by scaling too.
        scale = load[row] / value
        if abs(scale - 1.0) > 0.3:
            fault[row] = NO_BALANCE
            continue
        if used > patches.shape[1]:
            fault[row] = TOO_MANY
            continue
        if used > 1 and not vertical:
            fault[row] = NOT_SINGLE
            continue
        count[row] = used
        for rank in range(used):  # by falling normal force
            best = 0
            for other in range(used):
                if lines[other, 9] > lines[best, 9]:
                    best = other
            line = lines[best]
            start, stop = int(line[0]), int(line[1])
            if start <= 2 or stop >= gap.size - 3 or gap[start - 1] >= NO_WHEEL or gap[stop + 1] >= NO_WHEEL:
                fault[row] = AT_EDGE
            patches[row, rank] = line
            patches[row, rank, 9] *= scale
            patches[row, rank, 11] = scale
            patches[row, rank, 12] = low + approach
            lines[best, 9] = -1.0
