"""Kernels of all patches of a wheel: basins of the gap, and approach under the load.

Rule for several patches: see `kik_piotrowski`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.contact.geometry import NO_WHEEL, CounterfaceProfile, WheelSurface
from wearsim.contact.kernel import bare_kernel, inner_bare_kernel
from wearsim.contact.normal.kik_piotrowski.strips import (
    Record,
    Records,
    Row,
    Strips,
    between,
    displacement_at,
    find_edges,
    find_outline,
    lay_strips,
)
from wearsim.contact.normal.model import (
    AT_EDGE,
    FAINT,
    NO_BALANCE,
    NO_CONTACT,
    NOT_SINGLE,
)
from wearsim.contact.patch import FloatArray, IntArray

# Position of the lowest point as a fractional grid position and its height; highest
# point between it and the one before; basin that the flood joins it to, -1 for the
# deepest, and the height of the saddle. At an approach: height of the rim, separation
# from its parent (0 one patch or touching, 1 separate), share in the condition of
# displacement, the basin whose patch it belongs to and that patch (-1: none). `order`
# lists the basins by rising height.
BASIN = np.dtype(
    [
        (name, float)
        for name in ("place", "height", "before", "saddle", "rim", "apart", "share")
    ]
    + [(name, int) for name in ("parent", "owner", "patch", "order")]
)


class Work(NamedTuple):
    """Work arrays of a wheel: strips, sections at grid points, basins and patches."""

    strips: Strips
    sections: Records
    basins: Records
    patches: Records
    joins: IntArray
    sums: FloatArray


@bare_kernel
def find_basins(gap: FloatArray, highest: float, basins: Records) -> int:
    """Find local minima of the gap below `highest`, and how they join.

    Return their number. The gap flooded from below joins each basin to a deeper one:
    its parent is the deepest one of the water it joins.
    """
    number, begin = 0, 1
    for i in range(1, gap.size - 1):
        if gap[i] < gap[i - 1] and gap[i] <= gap[i + 1] and gap[i] < highest:
            bend = gap[i - 1] - 2.0 * gap[i] + gap[i + 1]
            move = 0.5 * (gap[i - 1] - gap[i + 1]) / bend
            basin = basins[number]
            basin.place = i + move
            basin.height = gap[i] - 0.25 * (gap[i - 1] - gap[i + 1]) * move
            basin.before = -np.inf
            for j in range(begin if number > 0 else i, i + 1):
                basin.before = max(basin.before, gap[j])
            begin = i + 1
            number += 1
    for k in range(number):
        j = k
        while j > 0 and basins[basins[j - 1].order].height > basins[k].height:
            basins[j].order = basins[j - 1].order
            j -= 1
        basins[j].order = k
    for k in range(number):
        # Take the lower of the two paths from here to the first deeper minimum, left or
        # right.
        basin = basins[k]
        basin.parent, basin.saddle = -1, np.inf
        for way in (-1, 1):
            height = -np.inf
            j = k
            while 0 <= j + way < number:
                height = max(
                    height, basins[j].before if way < 0 else basins[j + 1].before
                )
                j += way
                if basins[j].height < basin.height or (
                    basins[j].height == basin.height and j < k
                ):
                    if height < basin.saddle:
                        basin.parent, basin.saddle = j, height
                    break
    for rank in range(number):
        # The parent is not the first deeper basin but the deepest one flooded at the
        # height of the saddle.
        basin = basins[basins[rank].order]
        while basin.parent >= 0 and basins[basin.parent].saddle <= basin.saddle:
            basin.parent = basins[basin.parent].parent
    return number


# First guess of the exponent of the load over the approach; 1.5 for a quadratic gap.
_POWER = 1.52
# Error of the load without skew below which one more step leads to that with skew.
_COARSE = 0.02
_ROUGH = 0.04  # error of the load of rough solutions
# Errors of the load of one patch, and of several, below which the last step needs no
# new displacement: the known exponent leaves some hundredths of the error.
_NEAR, _DONE = 3e-4, 1e-6
# Load over modulus, approach and mean semi-axis, to some per cent for any axis ratio.
_ELLIPSE = 1.34
_TRIALS = 200
_DEEPEST = 0.01  # largest approach [m]
_FAINT = 1e-4  # share in the condition of displacement below which a basin is omitted


@inner_bare_kernel
def _spread(approach: float, factor: float, number: int, basins: Records) -> None:
    """Rim and patch of each basin at an approach of the deepest one."""
    low = basins[basins[0].order].height
    depth = factor * approach
    for rank in range(number):
        k = basins[rank].order
        basin = basins[k]
        basin.patch = -1
        if basin.parent < 0:
            basin.rim, basin.owner, basin.apart, basin.share = low + depth, k, 1.0, 1.0
            continue
        parent = basins[basin.parent]
        basin.apart = min(
            max((basin.saddle - max(basin.height, parent.rim)) / depth, 0.0), 1.0
        )
        basin.rim = (
            parent.rim
            + (basin.height + factor * (approach - (basin.height - low)) - parent.rim)
            * basin.apart
        )
        basin.owner, basin.share = -1, 0.0
        if basin.rim > basin.height:
            basin.owner = parent.owner if basin.saddle < parent.rim else k
            basin.share = 1.0
            if parent.rim > parent.height and basin.saddle > parent.height:
                share = (basin.saddle - basin.height) / (basin.saddle - parent.height)
                share *= (basin.rim - basin.height) / (parent.rim - parent.height)
                basin.share = parent.share * max(share, 0.0) ** 3


@inner_bare_kernel
def _slope_of(
    group: int,
    used: int,
    factor: float,
    number: int,
    row: Row,
    skewed: bool,
    work: Work,
) -> float:
    """Find the common pressure slope of a group of patches, over pi E*.

    It is the approach over the displacement.
    """
    basins, patches, profile = work.basins, work.patches, row.profile
    # The deepest basin of the group decides; a rim lowered by a neighbour also lowers
    # the approach.
    lead = 0
    while patches[lead].group != group:
        lead += 1
    first = basins[patches[lead].basin]
    bottom = first.height + (first.rim - first.height) / factor
    largest = 0.0
    for k in range(number):
        if basins[k].patch >= 0 and patches[basins[k].patch].group == group:
            largest = max(largest, basins[k].share)
    pushed, moved = 0.0, 0.0
    for k in range(number):
        basin = basins[k]
        if (
            basin.patch < 0
            or patches[basin.patch].group != group
            or basin.share < _FAINT * largest
        ):
            continue
        cell = int(basin.place)
        share = basin.place - cell
        y, z = between(profile.y, cell, share), between(profile.z, cell, share)
        x = between(row.along, cell, share)
        pushed += (
            basin.share * (bottom - basin.height) * np.cos(patches[basin.patch].angle)
        )
        for j in range(used):
            if patches[j].group == group:
                moved += basin.share * displacement_at(
                    y, z, x, patches[j], skewed, work.strips
                )
    return pushed / moved


@inner_bare_kernel
def _partner(patch: Record, basins: Records) -> int:
    """Patch of the next deeper basin that has one, -1 for the deepest."""
    k = basins[patch.basin].parent
    while k >= 0 and basins[k].patch < 0:
        k = basins[k].parent
    return basins[k].patch if k >= 0 else -1


@inner_bare_kernel
def _lay_patches(
    approach: float, factor: float, number: int, row: Row, skewed: bool, work: Work
) -> int:
    """Lay the patches of one wheel under a rigid approach, and return their number."""
    basins, patches, joins, sums = work.basins, work.patches, work.joins, work.sums
    _spread(approach, factor, number, basins)
    used = 0
    for rank in range(number):
        k = basins[rank].order
        basin = basins[k]
        if basin.owner == k:
            patches[used].rim = basin.rim
            if find_outline(basin.place, row, patches[used]):
                patches[used].basin = k
                patches[used].group = basin.patch = used
                used += 1
        elif basin.owner >= 0:
            basin.patch = basins[basin.owner].patch
    # Patches that are not quite separate tend to a common plane and a common pressure
    # slope: pairs are processed by saddle, the lowest first.
    for j in range(used):
        place = j
        while (
            place > 0
            and basins[patches[joins[place - 1]].basin].saddle
            > basins[patches[j].basin].saddle
        ):
            joins[place] = joins[place - 1]
            place -= 1
        joins[place] = j
        sums[0, j], sums[1, j] = patches[j].weight, patches[j].tilt
    for n in range(used):
        partner = _partner(patches[joins[n]], basins)
        if partner < 0:
            continue
        a, b = patches[joins[n]].group, patches[partner].group
        apart = basins[patches[joins[n]].basin].apart
        sums[0, b] += sums[0, a]
        sums[1, b] += sums[1, a]
        for j in range(used):
            if patches[j].group == a or patches[j].group == b:
                patches[j].group = b
                if apart < 1.0:
                    patches[j].angle = (
                        apart * patches[j].angle
                        + (1.0 - apart) * sums[1, b] / sums[0, b]
                    )
    for j in range(used):
        lay_strips(patches[j], row, skewed, work.strips, work.sections)
        patches[j].group = j
    low = basins[basins[0].order].height
    for j in range(used):
        patch = patches[j]
        patch.approach = (approach - (basins[patch.basin].height - low)) * np.cos(
            patch.angle
        )
    return used


@inner_bare_kernel
def _wheel_load(
    approach: float,
    factor: float,
    modulus: float,
    vertical: bool,
    number: int,
    row: Row,
    skewed: bool,
    work: Work,
) -> tuple[float, int]:
    """Load of all patches of one wheel under a rigid approach, and their number."""
    basins, patches, joins = work.basins, work.patches, work.joins
    used = _lay_patches(approach, factor, number, row, skewed, work)
    # Each patch separately, then the pairs.
    for n in range(2 * used):
        patch = patches[n if n < used else joins[n - used]]
        group, apart = patch.group, 0.0
        if n >= used:
            partner = _partner(patch, basins)
            apart = basins[patch.basin].apart
            if partner < 0:
                continue
            for j in range(used):
                if patches[j].group == group:
                    patches[j].group = patches[partner].group
            group = patches[partner].group
            if apart == 1.0:
                continue
        slope = _slope_of(group, used, factor, number, row, skewed, work)
        for j in range(used):
            if patches[j].group == group:
                old = patches[j].slope if n >= used else 0.0
                patches[j].slope = apart * old + (1.0 - apart) * slope
    for j in range(used):
        patches[j].force = (
            np.pi * modulus * patches[j].slope * (0.5 * np.pi * patches[j].volume)
        )
    return _carried(used, vertical, patches), used


@bare_kernel
def _carried(used: int, vertical: bool, patches: Records) -> float:
    """Load carried by the normal forces of patches."""
    total = 0.0
    for j in range(used):
        total += (
            patches[j].force * np.cos(patches[j].angle)
            if vertical
            else patches[j].force
        )
    return total


@inner_bare_kernel
def _power_of(
    patch: Record, gap: FloatArray, depth: float, strips: Strips
) -> tuple[float, float]:
    """Exponents of volume and load of a single patch over its approach.

    Both are 1.5 in a quadratic gap. A strip's x_l^2 grows as its interpenetration, its
    displacement with an exponent of that between a half and 1.
    """
    points = slice(patch.first, patch.last + 1)
    opening, width, square = gap[points], strips.width[points], strips.square[points]
    distance, integral = strips.distance[points], strips.integral[points]
    wider, further, moved = 0.0, 0.0, 0.0
    for i in range(square.size):
        growth = depth / (patch.rim - opening[i])
        near = np.sqrt(np.sqrt(distance[i] / (square[i] + distance[i])))
        wider += growth * square[i] * width[i]
        further += (
            growth
            * integral[i]
            * width[i]
            * (0.5 + 0.5 * near + 0.05 * (1.0 - near) ** 2)
        )
        moved += integral[i] * width[i]
    of_volume = wider / patch.volume
    return of_volume, min(max(1.0 + of_volume - further / moved, 1.0), 6.0)


@inner_bare_kernel
def _move_on(
    patch: Record, row: Row, depth: float, grow: float, strips: Strips
) -> bool:
    """Extrapolate a single patch to `grow` times its approach, to first order.

    `depth` is its interpenetration. The patch must keep its grid points.
    """
    gap, y, angle = row.gap, row.profile.y, row.profile.angle
    first, last = patch.first, patch.last
    rise = (grow - 1.0) * depth
    rim = patch.rim + rise
    if min(gap[first - 1], gap[last + 1]) < rim or max(gap[first], gap[last]) >= rim:
        return False
    patch.volume *= 1.0 + (grow - 1.0) * _power_of(patch, gap, depth, strips)[0]
    patch.deepest *= grow
    patch.approach *= grow
    moment = patch.centre * patch.weight + rise * (
        y[last] * y[last + 1] - y[first - 1] * y[first]
    )
    patch.weight += rise * (y[last] + y[last + 1] - y[first - 1] - y[first])
    for i in range(first, last + 1):
        patch.tilt += rise * (y[i + 1] - y[i - 1]) * angle[i]
    patch.rim, patch.centre, patch.angle = (
        rim,
        moment / patch.weight,
        patch.tilt / patch.weight,
    )
    find_edges(patch, row)
    return True


@inner_bare_kernel
def _first_approach(
    load: float, factor: float, modulus: float, number: int, row: Row, work: Work
) -> float:
    """Approach of a wheel on an ellipse like its deepest patch.

    Length and interpenetration are the same.
    """
    patch, deepest = work.patches[0], work.basins[work.basins[0].order]
    approach: float = 0.8 * (load / modulus) ** (2.0 / 3.0)
    for _ in range(2):
        _spread(approach, factor, number, work.basins)
        patch.rim = deepest.rim
        if find_outline(deepest.place, row, patch):
            radius = row.radius[int(deepest.place)]
            square = 2.0 * factor * approach * radius / (1.0 + row.pose.kappa * radius)
            width = 0.375 * patch.weight / (factor * approach)
            carried = (
                _ELLIPSE
                * modulus
                * approach
                * np.cos(patch.angle)
                * np.sqrt(np.sqrt(square) * width)
            )
            approach *= min(max((load / carried) ** (1.0 / _POWER), 0.2), 4.0)
    return approach


@inner_bare_kernel
def _find_approach(
    load: float,
    factor: float,
    modulus: float,
    vertical: bool,
    number: int,
    row: Row,
    yawed: bool,
    rough: bool,
    work: Work,
) -> tuple[float, float, int]:
    """Approach of a wheel under its load, the load of its patches, and their number."""
    # Under yaw, solve without skew first: this is cheap and close to the solution.
    skewed = False
    approach = _first_approach(load, factor, modulus, number, row, work)
    lower, upper, power = 0.0, np.inf, _POWER
    before, load_before, value, used = 0.0, 0.0, 0.0, 0
    for trial in range(_TRIALS):
        value, used = _wheel_load(
            approach, factor, modulus, vertical, number, row, skewed, work
        )
        excess = value / load - 1.0
        if before > 0.0 and before != approach and load_before > 0.0 and value > 0.0:
            # Exponent of the approach given by the last two loads.
            power = min(
                max(np.log(value / load_before) / np.log(approach / before), 1.0), 6.0
            )
        elif used == 1:
            _, power = _power_of(
                work.patches[0], row.gap, factor * approach, work.strips
            )
        grow = (load / value) ** (1.0 / power) if value > 0.0 else 4.0
        if rough and abs(excess) < _ROUGH:
            # Keep the patches; extrapolate the displacement to the load.
            return approach * grow, value, used
        if skewed == yawed and abs(excess) < (_NEAR if used == 1 else _DONE):
            moved = used == 1 and _move_on(
                work.patches[0], row, factor * approach, grow, work.strips
            )
            if (
                moved
                or _lay_patches(approach * grow, factor, number, row, skewed, work)
                == used
            ):
                carried = _carried(used, vertical, work.patches)
                for j in range(used):
                    work.patches[j].force *= load / carried
                return approach * grow, load, used
        if excess < 0.0:
            lower = approach
        else:
            upper = approach
        if upper - lower < 1e-14 * upper or lower > _DEEPEST:
            break
        before, load_before = approach, value
        approach *= min(max(grow, 0.1), 4.0)
        if upper < np.inf and (trial % 8 == 7 or not lower < approach < upper):
            approach = 0.5 * (lower + upper)
        if yawed and not skewed and not rough and abs(excess) < _COARSE:
            skewed, lower, upper, before = True, 0.0, np.inf, 0.0
    return approach, value, used


@bare_kernel
def balance(
    rows: IntArray,
    load: FloatArray,
    vertical: bool,
    rough: bool,
    factor: float,
    modulus: float,
    gaps: FloatArray,
    lowest: FloatArray,
    radii: FloatArray,
    alongs: FloatArray,
    poses: Records,
    ends: FloatArray,
    profile: CounterfaceProfile,
    wheel: WheelSurface,
    stride: int,
    work: Work,
    count: IntArray,
    fault: IntArray,
    patches: Records,
) -> None:
    """Find the approach of each row at which it carries its load.

    `lowest` is the minimum of each gap. Rows with yaw get skewed strips if the wheel
    has a surface. `patches` of all rows follow one another, each row's in the order of
    falling force. A faint patch at the edge of a profile is omitted.
    """
    total = 0
    for k in range(load.size):
        r = rows[k]
        row = Row(
            profile,
            wheel,
            k + 1,
            stride,
            gaps[r],
            radii[r],
            alongs[r],
            ends[0, k],
            ends[1, k],
            poses[r],
        )
        gap = row.gap
        if lowest[r] >= NO_WHEEL:
            fault[r] = NO_CONTACT
            continue
        number = find_basins(gap, lowest[r] + 0.02, work.basins)
        if number == 0:
            fault[r] = AT_EDGE
            continue
        low = work.basins[work.basins[0].order].height
        yawed = wheel.y.size > 0 and row.pose.sin_yaw != 0.0
        approach, value, used = _find_approach(
            load[k], factor, modulus, vertical, number, row, yawed, rough, work
        )
        if used == 0 or not value > 0.0:
            fault[r] = AT_EDGE
            continue
        if abs(load[k] / value - 1.0) > 0.3:
            fault[r] = NO_BALANCE
            continue
        kept, whole = used, value
        for j in range(used):
            patch = work.patches[j]
            if min(patch.first - 2, gap.size - 3 - patch.last) <= 0 or (
                max(gap[patch.first - 1], gap[patch.last + 1]) >= NO_WHEEL
            ):
                if not patch.force < FAINT * whole:
                    fault[r] = AT_EDGE
                    break
                kept -= 1
                value -= patch.force * np.cos(patch.angle) if vertical else patch.force
                patch.force = -1.0
        if kept > 1 and not vertical:
            fault[r] = NOT_SINGLE
            continue
        # Scale the pressures to the exact load.
        scale = load[k] / value
        count[k] = kept
        for _ in range(kept):  # by falling normal force
            best = 0
            for i in range(used):
                if work.patches[i].force > work.patches[best].force:
                    best = i
            patches[total] = work.patches[best]
            work.patches[best].force = -1.0
            patch = patches[total]
            total += 1
            patch.force *= scale
            patch.scale = scale
            patch.displacement = low + approach
