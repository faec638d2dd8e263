"""Kernels of all patches of a wheel: basins of the gap, and the approach that carries the load.

Rule for several patches: see `kik_piotrowski`.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.geometry import NO_WHEEL
from wearsim.contact.kernel import kernel
from wearsim.contact.normal.kik_piotrowski.strips import displacement_at, fill_strips, find_outline
from wearsim.contact.normal.model import AT_EDGE, NO_BALANCE, NO_CONTACT, NOT_SINGLE, TOO_MANY
from wearsim.contact.patch import FloatArray, IntArray

MOST_BASINS = 64


@kernel
def find_basins(
    gap: FloatArray, highest: float, minima: FloatArray, order: IntArray, parent: IntArray, saddle: FloatArray
) -> int:
    """Find local minima of the gap below `highest`, how they join, and return their number.

    Fills `minima` with their places as fractional grid positions and their heights, `order` with their
    indices by rising height. The gap flooded from below joins each basin to a deeper one: `parent` is the
    deepest one that holds the water it joins (-1 for the deepest of all), `saddle` the height of joining.
    """
    number = 0
    top = -np.inf
    between = np.empty(MOST_BASINS)  # highest point between each minimum and the one before
    for i in range(1, gap.size - 1):
        top = max(top, gap[i])
        if gap[i] < gap[i - 1] and gap[i] <= gap[i + 1] and gap[i] < highest:
            if number == MOST_BASINS:
                break
            bend = gap[i - 1] - 2.0 * gap[i] + gap[i + 1]
            move = 0.5 * (gap[i - 1] - gap[i + 1]) / bend
            minima[0, number] = i + move
            minima[1, number] = gap[i] - 0.25 * (gap[i - 1] - gap[i + 1]) * move
            between[number] = top
            top = -np.inf
            number += 1
    for k in range(number):
        j = k
        while j > 0 and minima[1, order[j - 1]] > minima[1, k]:
            order[j] = order[j - 1]
            j -= 1
        order[j] = k
    for k in range(number):
        # The lower of the two walks from here to the first deeper minimum, left or right.
        parent[k], saddle[k] = -1, np.inf
        for way in (-1, 1):
            height = -np.inf
            j = k
            while 0 <= j + way < number:
                height = max(height, between[j] if way < 0 else between[j + 1])
                j += way
                if minima[1, j] < minima[1, k] or (minima[1, j] == minima[1, k] and j < k):
                    if height < saddle[k]:
                        parent[k], saddle[k] = j, height
                    break
    for rank in range(number):
        # Not the first deeper one but the deepest that the flood holds when it reaches the saddle.
        k = order[rank]
        while parent[k] >= 0 and saddle[parent[k]] <= saddle[k]:
            parent[k] = parent[parent[k]]
    return number


LINE = 16
"""What is kept of a patch: first and last grid point, centre y, angle, normal approach, sum of x_l^2 widths,
s of the left and right end, deepest x_l^2, normal force, gap at the rim, load scale, vertical displacement;
three places for work."""

_TOO_THIN = 1  # grid points; what lies between two of them carries less than 1e-4 of the load
_POWER = 1.5  # of the approach that the load grows with, as a first guess
_BEYOND = 1.0001  # overshoot of a guess, to have the solution between two approaches
_COARSE = 0.02  # error of the load without skew from which one more step leads to that with skew
_FAINT = 1e-4  # share of a basin in the condition of displacement that is left out


@kernel
def _spread(
    approach: float, low: float, number: int, minima: FloatArray, order: IntArray, parent: IntArray,
    saddle: FloatArray, factor: float, basins: FloatArray,
) -> None:  # fmt: skip
    """Rim and patch of each basin under an approach.

    Fills `basins` with: 0 height of the rim, 1 the basin whose patch it belongs to (-1: none), 2 how far it
    is separate from its parent (0 one patch or touching, 1 separate), 3 its share in the displacement
    condition.
    """
    depth = factor * approach
    for rank in range(number):
        k = order[rank]
        p = parent[k]
        if p < 0:
            basins[0, k], basins[1, k], basins[2, k], basins[3, k] = low + depth, k, 1.0, 1.0
            continue
        height, joined = minima[1, k], basins[0, p]
        apart = (saddle[k] - max(height, joined)) / depth
        apart = min(max(apart, 0.0), 1.0)
        rim = joined + (height + factor * (approach - (height - low)) - joined) * apart
        basins[0, k], basins[2, k] = rim, apart
        basins[1, k], basins[3, k] = -1.0, 0.0
        if rim > height:
            basins[1, k] = basins[1, p] if saddle[k] < joined else k
            deeper = joined - minima[1, p]
            if deeper > 0.0 and saddle[k] > minima[1, p]:
                share = (saddle[k] - height) / (saddle[k] - minima[1, p]) * (rim - height) / deeper
                basins[3, k] = basins[3, p] * max(share, 0.0) ** 3
            else:
                basins[3, k] = 1.0


@kernel
def _amplitude(
    group: IntArray, chosen: int, number: int, factor: float, first: IntArray, minima: FloatArray,
    basins: FloatArray, lobe: IntArray, profile: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    here: tuple[FloatArray, FloatArray, FloatArray], skewed: bool, work: FloatArray, lines: FloatArray,
) -> float:  # fmt: skip
    """Find the common pressure slope of a group of patches, over pi E*: approach over displacement."""
    # The deepest basin of the group leads; a rim lowered by a neighbour means less approach too.
    lead = 0
    while group[lead] != chosen:
        lead += 1
    height = minima[1, first[lead]]
    bottom = height + (basins[0, first[lead]] - height) / factor
    largest = 0.0
    for k in range(number):
        if lobe[k] >= 0 and group[lobe[k]] == chosen:
            largest = max(largest, basins[3, k])
    pushed, moved = 0.0, 0.0
    for k in range(number):
        if lobe[k] < 0 or group[lobe[k]] != chosen or basins[3, k] < _FAINT * largest:
            continue
        weight = basins[3, k]
        cell = int(minima[0, k])
        share = minima[0, k] - cell
        y = profile[0][cell] + share * (profile[0][cell + 1] - profile[0][cell])
        z = profile[1][cell] + share * (profile[1][cell + 1] - profile[1][cell])
        x = here[2][cell] + share * (here[2][cell + 1] - here[2][cell])
        pushed += weight * (bottom - minima[1, k]) * np.cos(lines[lobe[k], 3])
        for j in range(group.size):
            if group[j] == chosen:
                moved += weight * displacement_at(y, z, x, lines[j], skewed, work)
    return pushed / moved


@kernel
def _wheel_load(
    approach: float, low: float, row: int, number: int, minima: FloatArray, order: IntArray, parent: IntArray,
    saddle: FloatArray, factor: float, vertical: bool,
    profile: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    here: tuple[FloatArray, FloatArray, FloatArray], pose: FloatArray,
    wheel: tuple[FloatArray, FloatArray, FloatArray], skewed: bool, kappa: float, modulus: float,
    basins: FloatArray, work: FloatArray, sections: FloatArray, lines: FloatArray,
) -> tuple[float, int]:  # fmt: skip
    """Load of all patches of one wheel under a rigid approach; `lines` gets one line per patch."""
    _spread(approach, low, number, minima, order, parent, saddle, factor, basins)
    lobe = np.full(number, -1)
    first = np.empty(number, np.int64)  # deepest basin of each patch
    lobes = 0
    for rank in range(number):
        k = order[rank]
        if int(basins[1, k]) == k:
            line = lines[lobes]
            line[10] = basins[0, k]
            count = find_outline(minima[0, k], line[10], profile[0], profile[3], here[0], line)
            if count >= _TOO_THIN:
                lobe[k] = lobes
                first[lobes] = k
                lobes += 1
        elif basins[1, k] >= 0.0:
            lobe[k] = lobe[int(basins[1, k])]
    if lobes == 0:
        return 0.0, 0
    # Patches that are not quite separate lean towards a common plane and a common pressure slope: the pairs
    # of one saddle after the other, the lowest first.
    group = np.arange(lobes)
    joins = np.empty(lobes, np.int64)
    for j in range(lobes):
        place = j
        while place > 0 and saddle[first[joins[place - 1]]] > saddle[first[j]]:
            joins[place] = joins[place - 1]
            place -= 1
        joins[place] = j
    weights, tilts = lines[:, 13].copy(), lines[:, 14].copy()
    for n in range(lobes):
        other = _partner(joins[n], first, parent, lobe)
        if other < 0:
            continue
        a, b = group[joins[n]], group[other]
        apart = basins[2, first[joins[n]]]
        weight, tilt = weights[a] + weights[b], tilts[a] + tilts[b]
        for j in range(lobes):
            if group[j] == a or group[j] == b:
                group[j] = b
                if apart < 1.0:
                    lines[j, 3] = apart * lines[j, 3] + (1.0 - apart) * tilt / weight
        weights[b], tilts[b] = weight, tilt
    slope = np.empty(lobes)
    for j in range(lobes):
        fill_strips(lines[j], row, profile, here, pose, wheel, skewed, kappa, work, sections)
        group[j] = j
    for j in range(lobes):
        slope[j] = _amplitude(
            group, j, number, factor, first, minima, basins, lobe, profile, here, skewed, work, lines
        )
    for n in range(lobes):
        other = _partner(joins[n], first, parent, lobe)
        if other < 0:
            continue
        a, b = group[joins[n]], group[other]
        apart = basins[2, first[joins[n]]]
        for j in range(lobes):
            if group[j] == a:
                group[j] = b
        if apart < 1.0:
            common = _amplitude(
                group, b, number, factor, first, minima, basins, lobe, profile, here, skewed, work, lines
            )
            for j in range(lobes):
                if group[j] == b:
                    slope[j] = apart * slope[j] + (1.0 - apart) * common
    total = 0.0
    for j in range(lobes):
        line = lines[j]
        cosine = np.cos(line[3])
        line[4] = (approach - (minima[1, first[j]] - low)) * cosine
        line[9] = np.pi * modulus * slope[j] * (0.5 * np.pi * line[5])
        total += line[9] * cosine if vertical else line[9]
    return total, lobes


@kernel
def _partner(patch: int, first: IntArray, parent: IntArray, lobe: IntArray) -> int:
    """Patch of the next deeper basin that has one; -1 for the deepest."""
    k = parent[first[patch]]
    while k >= 0 and lobe[k] < 0:
        k = parent[k]
    return lobe[k] if k >= 0 else -1


@kernel
def _move_on(lines: FloatArray, earlier: FloatArray, gap: FloatArray, share: float) -> bool:
    """Carry patches on by `share` of how they changed since an earlier approach.

    Only if they keep their grid points, and the square of the change is too small to matter.
    """
    for j in range(lines.shape[0]):
        start, stop = int(lines[j, 0]), int(lines[j, 1])
        if start != earlier[j, 0] or stop != earlier[j, 1]:
            return False
        rim = lines[j, 10] + share * (lines[j, 10] - earlier[j, 10])
        if min(gap[start - 1], gap[stop + 1]) < rim or max(gap[start], gap[stop]) >= rim:
            return False
        change = lines[j, 9] - earlier[j, 9]
        if abs(share) * change * change > 1e-9 * lines[j, 9] ** 2:
            return False
    for j in range(lines.shape[0]):
        for k in range(2, LINE):
            lines[j, k] += share * (lines[j, k] - earlier[j, k])
    return True


@kernel
def balance(
    profile: tuple[FloatArray, FloatArray, FloatArray, FloatArray], gaps: FloatArray, radii: FloatArray,
    alongs: FloatArray, poses: FloatArray, wheel: tuple[FloatArray, FloatArray, FloatArray], kappa: float,
    load: FloatArray, vertical: bool, factor: float, modulus: float, work: FloatArray, sections: FloatArray,
    count: IntArray, fault: IntArray, patches: FloatArray,
) -> None:  # fmt: skip
    """Find the approach of each row that carries its load.

    `profile` is (y, z, slope, angle) of the counterface, `poses` (n, 8) as for `on_the_wheel`: rows with yaw
    get skewed strips if `wheel` has rings. `patches` (n, most, LINE) gets a line per patch, by falling force.
    """
    minima, saddle = np.empty((2, MOST_BASINS)), np.empty(MOST_BASINS)
    order, parent = np.empty(MOST_BASINS, np.int64), np.empty(MOST_BASINS, np.int64)
    basins, lines = np.empty((4, MOST_BASINS)), np.empty((MOST_BASINS, LINE))
    earlier = np.empty((MOST_BASINS, LINE))
    for row in range(load.size):
        here = (gaps[row], radii[row], alongs[row])
        gap = here[0]
        skewed = wheel[0].size > 0 and poses[row, 0] != 0.0
        low = gap.min()
        if low >= NO_WHEEL:
            fault[row] = NO_CONTACT
            continue
        # Hertz-like guess for a sphere of the wheel's radius; then grow until the load is exceeded.
        approach = (load[row] / modulus) ** (2.0 / 3.0) * 0.8
        number = find_basins(gap, low + 0.02, minima, order, parent, saddle)
        if number == 0:
            fault[row] = AT_EDGE
            continue
        low = minima[1, order[0]]
        lower, upper, load_lower, load_upper = 0.0, -1.0, 0.0, 0.0
        value, used = 0.0, 0
        # Under yaw, strips without skew first: they cost little and lead near the solution.
        coarse = skewed
        before, load_before, power = 0.0, 0.0, _POWER
        for trial in range(200):
            value, used = _wheel_load(
                approach, low, row, number, minima, order, parent, saddle, factor, vertical, profile, here,
                poses[row], wheel, skewed and (not coarse), kappa, modulus, basins, work, sections, lines,
            )  # fmt: skip
            excess = value / load[row] - 1.0
            if not coarse:
                if abs(excess) < 1e-9:
                    break
                share = (load[row] - value) / (value - load_before) if before > 0.0 else 1.0
                if abs(share) < 0.1 and _move_on(lines[:used], earlier, gap, share):
                    approach += share * (approach - before)
                    value = load[row]
                    break
                earlier[:used] = lines[:used]
                earlier[used:, 0] = -1.0
            if excess < 0.0:
                lower, load_lower = approach, value
            else:
                upper, load_upper = approach, value
            if abs(excess) < 0.1 and trial < 20 and (before > 0.0 or power != _POWER):
                # Near the solution: the power of the approach that the last two loads show.
                if before > 0.0:
                    power = np.log(value / load_before) / np.log(approach / before)
                aim = approach * (load[row] / value) ** (1.0 / power) if 1.0 < power < 6.0 else 0.0
                if lower < aim and (aim < upper or upper < 0.0):
                    before, load_before = approach, value
                    approach = aim
                    if coarse and abs(excess) < _COARSE:
                        coarse, lower, upper, before = False, 0.0, -1.0, 0.0
                    continue
            if coarse and abs(excess) < 1e-3:
                coarse, lower, upper, before = False, 0.0, -1.0, 0.0
                continue
            before, load_before = approach, value
            if upper < 0.0:
                grow = (load[row] / value) ** (2.0 / 3.0) * _BEYOND if value > 0.0 else 4.0
                approach *= min(max(grow, 1.0 + 1e-9), 4.0)
                if approach > 0.01:
                    break
            elif lower == 0.0:
                shrink = (load[row] / value) ** (2.0 / 3.0) / _BEYOND
                approach *= min(max(shrink, 0.1), 1.0 - 1e-9)
            else:
                if upper - lower < 1e-14 * upper:
                    break
                # N grows about as the 1.5th power: secant in N^(2/3), guarded by bisection.
                a, b = load_lower ** (2.0 / 3.0), load_upper ** (2.0 / 3.0)
                approach = lower + (upper - lower) * (load[row] ** (2.0 / 3.0) - a) / (b - a)
                margin = 1e-3 * (upper - lower) if trial < 40 else 0.5 * (upper - lower)
                approach = min(max(approach, lower + margin), upper - margin)
        if used == 0 or not value > 0.0:
            fault[row] = AT_EDGE
            continue
        # Pressures are scaled to the last digits of the load.
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
