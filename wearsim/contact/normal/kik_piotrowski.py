r"""Virtual penetration after Kik and Piotrowski, with the strip ends for rollers of Liu and Bruni.

The surfaces are pushed into each other by :math:`\varepsilon\delta`; where they intersect is the patch.
Pressure is semi-elliptic along each strip, :math:`p = c\sqrt{x_l(y)^2 - x^2}`, and the approach
:math:`\delta` follows from the half-space displacement at the point of first contact:

.. math:: N = \pi E^* \delta \frac{\iint\sqrt{x_l^2-x^2}\,dx\,dy}
          {\iint\sqrt{x_l^2-x^2}/\sqrt{x^2+y^2}\,dx\,dy}.

Rule for several patches: minima of the gap whose saddle lies inside the virtual penetration of the deeper
one form one patch; others are patches of their own that share the rigid vertical approach, less the
height at which they touch. Loads add up.

References
----------
.. [1] W. Kik, J. Piotrowski, 2nd Mini-Conference on Contact Mechanics and Wear, Budapest 1996.
.. [2] J. Piotrowski, W. Kik, Vehicle System Dynamics 46 (2008) 27-48.
.. [3] B. Liu, S. Bruni, Urban Rail Transit 1 (2016) 215-226, equations (1)-(7), sign of (4) corrected.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.geometry import _NO_WHEEL, Gap
from wearsim.contact.kernel import kernel
from wearsim.contact.normal.model import NormalSolution
from wearsim.contact.patch import FloatArray, IntArray, Patch
from wearsim.errors import ContactError, NumericalError

DEFAULTS = {"virtual_penetration_factor": 0.55}

_MOST_PATCHES = 4  # of one wheel
_NO_TOUCH, _AT_EDGE, _TOO_MANY, _NOT_SINGLE, _NO_BALANCE = 1, 2, 3, 4, 5
_TOO_THIN = 3  # grid points below which an outline is not resolved


def solve(
    gap: Gap,
    load: FloatArray,
    *,
    vertical: bool,
    effective_modulus: float,
    strips: int,
    parameters: dict[str, float],
) -> NormalSolution:
    """Patches and pressures of every row.

    Parameters
    ----------
    gap : Gap
        n rows on a grid of g points.
    load : (n,) array
        Vertical load of the wheel, balanced by the vertical parts of the normal forces of all its
        patches, or (`vertical` false) the normal force of its only patch [N].
    vertical : bool
        Which of the two `load` is.
    effective_modulus : float
        E* = E / (2 (1 - nu^2)) of two equal bodies [Pa].
    strips : int
        Strips per patch.
    parameters : dict
        "virtual_penetration_factor": epsilon of [1]_, 0.55 by default.

    Returns
    -------
    NormalSolution
        The leading axis is the patch.

    Raises
    ------
    ContactError
        If a wheel does not touch, its patch reaches the edge of a profile, or `vertical` is false and
        several patches close.
    """
    rows = load.size
    factor = {**DEFAULTS, **parameters}["virtual_penetration_factor"]
    points = gap.contour.y.size
    slots = (rows, _MOST_PATCHES)
    count, fault = np.zeros(rows, np.int64), np.zeros(rows, np.int64)
    scalars = np.zeros((*slots, 6))
    fields = np.zeros((*slots, 4, strips))
    edges = np.zeros((*slots, strips + 1))
    _balance(
        gap.contour.y,
        gap.contour.z,
        gap.contour.slope,
        gap.contour.angle,
        gap.gap,
        gap.wheel_radius,
        gap.x,
        gap.curvature,
        load,
        vertical,
        factor,
        effective_modulus,
        np.empty((4, points)),
        count,
        fault,
        scalars,
        fields,
        edges,
    )
    _raise_first(fault)
    row = np.repeat(np.arange(rows), count)
    slot = np.concatenate([np.arange(k) for k in count]) if rows else np.empty(0, np.int64)
    centre, angle, approach, force, maximum, slope = scalars[row, slot].T
    y, half, skew, depth = np.moveaxis(fields[row, slot], 1, 0)
    patch = Patch(
        row=row,
        y=np.ascontiguousarray(y),
        width=y[:, 1] - y[:, 0],
        x_lead=skew + half,
        x_trail=skew - half,
        pressure_slope=slope.copy(),
        interpenetration=np.ascontiguousarray(depth),
    )
    return NormalSolution(
        patch,
        centre.copy(),
        angle.copy(),
        approach.copy(),
        force.copy(),
        maximum.copy(),
        np.ascontiguousarray(edges[row, slot]),
    )


def _raise_first(fault: IntArray) -> None:
    """Tell the first row without an answer; the caller knows which operating point it is."""
    failed = np.flatnonzero(fault)
    if failed.size == 0:
        return
    row, kind = int(failed[0]), int(fault[failed[0]])
    text = {
        _NO_TOUCH: "the wheel does not touch the counterface at any lateral position",
        _AT_EDGE: "the contact patch reaches the edge of a profile",
        _TOO_MANY: f"the wheel has more than {_MOST_PATCHES} contact patches",
        _NOT_SINGLE: "several patches close: a normal force belongs to one; give the wheel load instead",
        _NO_BALANCE: "the load cannot be balanced by virtual penetration",
    }[kind]
    raise (NumericalError if kind == _NO_BALANCE else ContactError)(text, row=row)


@kernel
def _strip_half_length_squared(
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
def _displacement_integral(
    half_squared: float,
    distance_squared: float,
) -> float:
    """Integral over x of sqrt(a^2 - x^2) / sqrt(x^2 + y^2): 2 sqrt(a^2 + y^2) (K - E), by the AGM."""
    total = half_squared + distance_squared
    a, b = 1.0, np.sqrt(distance_squared / total)
    c = np.sqrt(half_squared / total)
    power, weighted = 0.5, 0.5 * c * c
    for _ in range(8):
        c = 0.5 * (a - b)
        a, b = 0.5 * (a + b), np.sqrt(a * b)
        power *= 2.0
        weighted += power * c * c
        if c < 1e-6 * a:  # the next term is of the order c^4
            break
    integral: float = np.pi * np.sqrt(total) * weighted / a
    return integral


@kernel
def _cell(grid: FloatArray, place: float, first: int, last: int) -> int:
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
    interpenetration g, integration weight and squared half-length; `out` with (start, stop, centre y,
    angle, normal approach, sum of x_l^2 weights, s of the left and right end, deepest x_l^2). The force
    is 0 where the patch is too thin for the grid.
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
    k = _cell(grid_y, centre, start, stop)
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
        half = _strip_half_length_squared(work[1, i], radius[i] / cosine, sigma)
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
        displacement += _displacement_integral(half, distance * distance) * width
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
def _balance(
    grid_y: FloatArray,
    grid_z: FloatArray,
    slope: FloatArray,
    angle: FloatArray,
    gaps: FloatArray,
    radii: FloatArray,
    lines: FloatArray,
    kappa: float,
    load: FloatArray,
    vertical: bool,
    factor: float,
    modulus: float,
    work: FloatArray,
    count: IntArray,
    fault: IntArray,
    scalars: FloatArray,
    fields: FloatArray,
    edges: FloatArray,
) -> None:
    """Find the approach of each row that carries its load, and lay the strips of its patches."""
    minima = np.empty((2, 64))
    saddles = np.empty(64, np.int64)
    patches = np.empty((16, 11))
    strips = fields.shape[3]
    for row in range(load.size):
        gap, radius = gaps[row], radii[row]
        low = gap.min()
        if low >= _NO_WHEEL:
            fault[row] = _NO_TOUCH
            continue
        # Hertz-like guess for a sphere of the wheel's radius; then grow until the load is exceeded.
        approach = (load[row] / modulus) ** (2.0 / 3.0) * 0.8
        found = _basins(gap, low, 0.02, minima, saddles)
        if found == 0:
            fault[row] = _AT_EDGE
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
                patches,
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
            fault[row] = _AT_EDGE
            continue
        # Pressures are scaled to the last digits of the load; where patches merge the load jumps, and what
        # lies between its two sides is met by scaling too.
        scale = load[row] / value
        if abs(scale - 1.0) > 0.3:
            fault[row] = _NO_BALANCE
            continue
        if used > scalars.shape[1]:
            fault[row] = _TOO_MANY
            continue
        if used > 1 and not vertical:
            fault[row] = _NOT_SINGLE
            continue
        count[row] = used
        for rank in range(used):  # by falling normal force
            best = 0
            for other in range(used):
                if patches[other, 9] > patches[best, 9]:
                    best = other
            line = patches[best]
            start, stop = int(line[0]), int(line[1])
            if (
                start <= 2
                or stop >= gap.size - 3
                or gap[start - 1] >= _NO_WHEEL
                or gap[stop + 1] >= _NO_WHEEL
            ):
                fault[row] = _AT_EDGE
            _lay_strips(
                line,
                scale,
                kappa,
                grid_y,
                grid_z,
                slope,
                gap,
                radius,
                lines[row],
                scalars[row, rank],
                fields[row, rank],
                edges[row, rank],
                strips,
            )
            patches[best, 9] = -1.0


@kernel
def _lay_strips(
    line: FloatArray,
    scale: float,
    kappa: float,
    grid_y: FloatArray,
    grid_z: FloatArray,
    slope: FloatArray,
    gap: FloatArray,
    radius: FloatArray,
    along: FloatArray,
    scalar: FloatArray,
    field: FloatArray,
    edge: FloatArray,
    strips: int,
) -> None:
    """Cut one patch into strips of equal width in its contact plane and make the pressure fit the load."""
    start, stop = int(line[0]), int(line[1])
    centre, delta, left, right, limit = line[2], line[3], line[6], line[7], line[10]
    force = line[9] * scale
    cosine, sine = np.cos(delta), np.sin(delta)
    k = _cell(grid_y, centre, start, stop)
    share = (centre - grid_y[k]) / (grid_y[k + 1] - grid_y[k])
    centre_z = grid_z[k] + share * (grid_z[k + 1] - grid_z[k])
    centre_x = along[k] + share * (along[k + 1] - along[k])
    width = (right - left) / strips
    i = start - 1
    s_here = (grid_y[i] - centre) * cosine + (grid_z[i] - centre_z) * sine
    s_next = (grid_y[i + 1] - centre) * cosine + (grid_z[i + 1] - centre_z) * sine
    volume, moment = 0.0, 0.0
    for j in range(2 * strips + 1):  # strip edges and centres in turn
        s = left + 0.5 * j * width
        while s > s_next and i < stop:
            i += 1
            s_here = s_next
            s_next = (grid_y[i + 1] - centre) * cosine + (grid_z[i + 1] - centre_z) * sine
        share = (s - s_here) / (s_next - s_here)
        if j % 2 == 0:
            edge[j // 2] = grid_y[i] + share * (grid_y[i + 1] - grid_y[i])
            continue
        here = gap[i] + share * (gap[i + 1] - gap[i])
        opening = (gap[i + 1] - gap[i]) / (grid_y[i + 1] - grid_y[i])
        gradient = slope[i] + share * (slope[i + 1] - slope[i]) - opening
        depth = max((limit - here) / (cosine + gradient * sine), 0.0)
        height = grid_z[i] + share * (grid_z[i + 1] - grid_z[i])
        ring = radius[i] + share * (radius[i + 1] - radius[i])
        half = _strip_half_length_squared(depth, ring / cosine, kappa / (1.0 - kappa * height) * cosine)
        field[0, j // 2] = s
        field[1, j // 2] = np.sqrt(half)
        field[2, j // 2] = along[i] + share * (along[i + 1] - along[i]) - centre_x
        field[3, j // 2] = depth
        volume += half * width
        moment += half * width * s
    for j in range(strips):
        field[0, j] -= moment / volume
    scalar[0] = centre + moment / volume * cosine
    scalar[1] = delta
    scalar[2] = line[4]
    scalar[3] = force
    scalar[5] = force / (0.5 * np.pi * volume)
    # The deepest point of the outline, not of a strip's centre.
    scalar[4] = force / (0.5 * np.pi * line[5]) * np.sqrt(line[8])
