r"""Equations of the strips of a wheel: half-lengths, displacement and pressures.

The unknowns are half-lengths and vertical displacement; pressures follow from the
curvature.

Equations and sources: see `coupled_strips`. Ratios are divided by pi E*:
:math:`\hat c = c / (\pi E^*)` [1/m], so that a strip displaces by :math:`\hat c\,q\,F`,
and carries :math:`\hat c\,q` times its width of 2 N / (pi^2 E*).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.contact.kernel import inlined_bare_kernel, inner_bare_kernel
from wearsim.contact.normal.coupled_strips.influence import (
    LOWEST,
    PER_OCTAVE,
    STEP,
    column_at,
    influence_at,
    slope_at,
)
from wearsim.contact.normal.coupled_strips.strips import SHORT, Strips
from wearsim.contact.patch import FloatArray, IntArray

# Position on a strip, over its half-length, where the curvature is compared.
_AT = float(np.sqrt(0.75))
_LEAST, _MOST = 0.5, 2.0  # limits of required over present curvature
# Exponent of a patch's mean change of the ratios; the strip's own change has the rest.
_COMMON = 0.1
# limits of q after a step: shares of q before, and of the largest q for a new strip
_BELOW, _ABOVE, _FRESH = (
    0.1,
    4.0,
    0.05,
)
# share of the largest q below which strips may lose all pressure at once
_VANISHING = 1e-4
# Weight of a neighbour's ratio in that of a strip, times its distance squared and over
# the lesser q; and its largest value. Narrow strips on ridges are smoothed most.
_LEANING, _MOST_LEANING = (
    0.003,
    0.2,
)
# Share of the higher neighbour's q above which a strip gets its own ratio as a summit.
_LOWER = 0.7
_SETTLED = 0.3  # change of the load of strips below which their ratios are adapted
# growth of the residual above which a step is halved, and number of halvings
_WORSE, _HALVINGS = (
    2.0,
    3,
)
# Step from which, and ratio of the change of the load to that by the step before above
# which, ratios are changed by less from then on: those of ridges beside a contact go to
# and fro otherwise, and are held in the end. Factor on the exponent of their factors.
_CIRCLES_FROM, _CIRCLING = 12, 0.7
_EASED = 0.7
# tolerance of the change of the load once ratios are eased: they come no nearer, and
# half-lengths drift away from the curvature of the gap
_EASED_TOLERANCE = 1e-3
# largest misfit of the curvature, as a mean over the load, of a solution
_MISFIT = 0.05
_LOST = 1e9  # change of the load that marks strips without solution
# Offset of two middle lines, over the place of comparison, below which the mean of the
# influences ahead and behind is that at the root of the sum of their squares: exact for
# a parabola
_ALIGNED = 0.05
# Steps of ln eta across a strip below which it is distant: its influence is that by the
# slope in its middle, to 0.2 %
_DISTANT = 0.225 / STEP
_SHORTEST = 1e-12  # least q of a strip without pressure [m2]
_NEAREST = 1e-9  # least distance from the edge of a strip [m]


class Equations(NamedTuple):
    """Arrays (n, n) of pairs of strips, source first, and (n,) of strips.

    Distances of the `far` and the `near` edge of a source in steps of the table, share
    `way` of the influence, negative outside of the source; influences `mean` in the
    middle of the strips, `aside` at a share of their half-lengths, `rise` by q;
    `matrix` and right sides of the equations of the `active` strips; residuals `height`
    of the surfaces; `factor` on the ratios, and the `own` one of each strip; q `before`
    the last step; whether distances are `paired` (1) or not yet (0); whether strips are
    `in_reach` (1), with pressure or where the rigid surfaces overlap.
    """

    table: FloatArray
    far: FloatArray
    near: FloatArray
    way: FloatArray
    mean: FloatArray
    aside: FloatArray
    rise: FloatArray
    matrix: FloatArray
    active: IntArray
    in_reach: IntArray
    step: FloatArray
    by_displacement: FloatArray
    height: FloatArray
    factor: FloatArray
    own: FloatArray
    before: FloatArray
    paired: FloatArray


def equations_for(most: int, table: FloatArray) -> Equations:
    """Allocate the arrays for the equations of strips."""
    pairs, active, in_reach = (
        np.empty((7, most, most)),
        np.zeros(most, np.int64),
        np.zeros(most, np.int64),
    )
    far, near, way, mean, aside, rise, matrix = pairs
    return Equations(
        table,
        far,
        near,
        way,
        mean,
        aside,
        rise,
        matrix,
        active,
        in_reach,
        *np.empty((7, most)),
    )


@inner_bare_kernel
def _pair_up(j: int, strips: Strips, total: int, step: float, work: Equations) -> None:
    """Find distances of strips from both edges of others along the arc.

    The cosines between their planes are filled in as well.
    """
    half = 0.5 * strips.width[j]
    for i in range(total):
        distance = step * abs(strips.station[i] - strips.station[j])
        work.far[j, i] = (np.log2(distance + half) - LOWEST) * PER_OCTAVE
        work.near[j, i] = (
            np.log2(max(abs(distance - half), _NEAREST)) - LOWEST
        ) * PER_OCTAVE
        weight = max(np.cos(strips.tilt[i] - strips.tilt[j]), 0.0)
        work.way[j, i] = weight if distance < half else -weight
    work.paired[j] = 1.0


@inner_bare_kernel
def _influence_of(
    j: int, strips: Strips, total: int, step: float, aside: bool, work: Equations
) -> None:
    """Look up the influence of a strip on those in reach.

    On request it is also that `aside` of their middle lines, as a mean of both sides.
    """
    if work.paired[j] == 0.0:
        _pair_up(j, strips, total, step, work)
    table = work.table
    square = max(strips.square[j], _SHORTEST)
    half, octaves = np.sqrt(square), 0.5 * PER_OCTAVE * np.log2(square)
    inverse, middle = 1.0 / half, strips.middle[j]
    for i in range(total):
        if work.in_reach[i] == 0:
            continue
        far, near = work.far[j, i] - octaves, work.near[j, i] - octaves
        along = (strips.middle[i] - middle) * inverse
        mean, bend = _influence_along(table, along, far, near, work.way[j, i])
        work.mean[j, i], work.rise[j, i] = mean, mean - (0.5 / STEP) * bend
    if not aside or strips.square[j] <= 0.0:
        return
    for i in range(total):
        if strips.square[i] == 0.0:
            continue
        far, near = work.far[j, i] - octaves, work.near[j, i] - octaves
        off, place = (strips.middle[i] - middle) * inverse, strips.reach[i] * inverse
        way = work.way[j, i]
        if abs(off) < _ALIGNED * place:
            along = np.sqrt(off * off + place * place)
            work.aside[j, i] = _influence_along(table, along, far, near, way)[0]
            continue
        ahead = _influence_along(table, off + place, far, near, way)[0]
        behind = _influence_along(table, off - place, far, near, way)[0]
        work.aside[j, i] = 0.5 * (ahead + behind)


@inlined_bare_kernel
def _influence_along(
    table: FloatArray, along: float, far: float, near: float, way: float
) -> tuple[float, float]:
    """Influence of a strip at a distance along it, over its half-length.

    The second value is the difference of the slopes at its edges, per step of ln eta.
    """
    column, share, beyond = column_at(along)
    if beyond > 1.0:
        farther = PER_OCTAVE * np.log2(beyond)
        far, near = far - farther, near - farther
    if way < 0.0 and far - near < _DISTANT:
        slope, bend = slope_at(table, column, share, 0.5 * (far + near))
        across = -way * (far - near)
        return across * slope, across * bend
    weight = abs(way)
    value, slope = influence_at(table, column, share, far)
    near_value, near_slope = influence_at(table, column, share, near)
    return weight * value + way * near_value, weight * slope + way * near_slope


@inner_bare_kernel
def _factors(strips: Strips, total: int, work: Equations) -> None:
    """Find the factors by which ratios give the surface the curvature of the gap."""
    factor = work.factor
    for i in range(total):
        factor[i] = 0.0
    for j in range(total):
        carried = strips.ratio[j] * strips.square[j]
        if carried > 0.0:
            for i in range(total):
                if strips.square[i] > 0.0:
                    factor[i] += carried * (work.mean[j, i] - work.aside[j, i])
    i = 0
    while i < total:
        if strips.square[i] <= 0.0:
            factor[i] = 1.0
            i += 1
            continue
        first, load, mean = i, 0.0, 0.0
        while (
            i < total and strips.square[i] > 0.0 and strips.run[i] == strips.run[first]
        ):
            gap_rise = 0.5 * strips.bend[i] * _AT**2 * strips.square[i]
            surface_rise = factor[i]
            factor[i] = (
                min(max(gap_rise / surface_rise, _LEAST), _MOST)
                if surface_rise > 0.0
                else _MOST
            )
            carried = strips.ratio[i] * strips.square[i] * strips.width[i]
            load += carried
            mean += carried * factor[i]
            i += 1
        mean /= load
        for k in range(first, i):
            # Apply the common change of the strips in full and the rest in part, as it
            # also changes the present curvature.
            factor[k] = mean**_COMMON * factor[k] ** (1.0 - _COMMON)
    for k in range(total):
        work.own[k] = _smoothed(k, total, strips, factor)
    for _ in range(2):
        for k in range(total):
            _settle(k, total, strips, work)


@inner_bare_kernel
def _smoothed(k: int, total: int, strips: Strips, factor: FloatArray) -> float:
    """Factor that draws the ratio of a strip towards those of its neighbours.

    Surfaces hardly determine waves of ratios from strip to strip, the shorter the less,
    so that they would grow.
    """
    weight = 1.0
    mean = strips.ratio[k] * factor[k]
    for i in (k - 1, k + 1):
        if 0 <= i < total and strips.run[i] == strips.run[k] and strips.square[k] > 0.0:
            distance = 0.5 * (strips.width[i] + strips.width[k])
            lesser = min(strips.square[i], strips.square[k])
            share = min(_LEANING * lesser / distance**2, _MOST_LEANING)
            weight += share
            mean += share * strips.ratio[i] * factor[i]
    return mean / (weight * strips.ratio[k])


@inner_bare_kernel
def _settle(k: int, total: int, strips: Strips, work: Equations) -> None:
    """Give a strip at the edge of a contact the ratio of its neighbour.

    The surfaces do not determine it there. A strip counts as edge in proportion to how
    little its neighbour carries, so that ratios are continuous as strips gain and lose
    contact, and contacts split and join.
    """
    square = strips.square[k]
    if square <= 0.0:
        return
    left = right = left_ratio = right_ratio = 0.0
    if k > 0 and strips.run[k - 1] == strips.run[k]:
        left = strips.square[k - 1]
        left_ratio = strips.ratio[k - 1] * work.factor[k - 1]
    if k + 1 < total and strips.run[k + 1] == strips.run[k]:
        right = strips.square[k + 1]
        right_ratio = strips.ratio[k + 1] * work.factor[k + 1]
    if left + right <= 0.0:
        return
    inside = min(left / (SHORT * square), 1.0) * min(right / (SHORT * square), 1.0)
    summit = min(max((square / max(left, right) - _LOWER) / (1.0 - _LOWER), 0.0), 1.0)
    weight = max(inside, summit)
    neighbours = (left * left_ratio + right * right_ratio) / (left + right)
    work.factor[k] = (
        weight * work.own[k] + (1.0 - weight) * neighbours / strips.ratio[k]
    )


@inner_bare_kernel
def _solve_active(strips: Strips, count: int, work: Equations) -> None:
    """Solve for steps of q of active strips, and their change by the displacement."""
    matrix, active, step, by_displacement = (
        work.matrix,
        work.active,
        work.step,
        work.by_displacement,
    )
    for a in range(count):
        i = active[a]
        for b in range(count):
            matrix[a, b] = strips.ratio[active[b]] * work.rise[active[b], i]
        step[a], by_displacement[a] = -work.height[i], strips.turn[i]
    for k in range(count):
        pivot = 1.0 / matrix[k, k]
        for a in range(k + 1, count):
            share = matrix[a, k] * pivot
            _subtract(share, matrix[k, k + 1 : count], matrix[a, k + 1 : count])
            step[a] -= share * step[k]
            by_displacement[a] -= share * by_displacement[k]
    for k in range(count - 1, -1, -1):
        for b in range(k + 1, count):
            step[k] -= matrix[k, b] * step[b]
            by_displacement[k] -= matrix[k, b] * by_displacement[b]
        step[k] /= matrix[k, k]
        by_displacement[k] /= matrix[k, k]


@inner_bare_kernel
def _subtract(share: float, row: FloatArray, target: FloatArray) -> None:
    """Subtract a multiple of a row from another row.

    Whole rows use vector instructions.
    """
    for b in range(target.size):
        target[b] -= share * row[b]


@inner_bare_kernel
def solve_strips(
    strips: Strips,
    total: int,
    load: float,
    displacement: float,
    step: float,
    steps: int,
    tolerance: float,
    work: Equations,
) -> tuple[float, float]:
    """Solve for q, ratios and displacement under a load.

    Return the displacement and the last change of the load. `step` is that of stations
    along the arc.
    """
    square, before = strips.square, work.before
    for i in range(total):
        work.paired[i] = 0.0
    change, adapted, halvings = 1.0, False, 0
    missed, displacement_before = np.inf, displacement
    exponent = 1.0
    for number in range(steps):
        adapt = change < _SETTLED
        for i in range(total):
            strips.reach[i] = _AT * np.sqrt(square[i])
            # Where the rigid surfaces are separate, the displacement by the strips
            # separates them further.
            work.in_reach[i] = square[i] > 0.0 or strips.gap[i] < displacement
        for i in range(total):
            if square[i] > 0.0:
                _influence_of(i, strips, total, step, adapt, work)
        missed_before = missed
        missed, count = _open_heights(strips, total, displacement, work)
        if count == 0:
            return displacement, _LOST
        for a in range(count):
            if square[work.active[a]] == 0.0:
                _influence_of(work.active[a], strips, total, step, False, work)
        if missed > _WORSE * missed_before and not adapted and halvings < _HALVINGS:
            _go_half_back(strips, total, work)
            displacement = 0.5 * (displacement + displacement_before)
            missed = missed_before
            halvings += 1
            continue
        if adapt:
            _factors(strips, total, work)
        _solve_active(strips, count, work)
        displacement_before = displacement
        for i in range(total):
            before[i] = square[i]
        change_before = change
        down, more, change = _take_step(strips, count, load, work)
        if number >= _CIRCLES_FROM and change > _CIRCLING * change_before:
            exponent *= _EASED
        displacement += down
        if not (abs(displacement) < 1.0 and change < _LOST):
            return displacement, _LOST
        enough = tolerance if exponent == 1.0 else _EASED_TOLERANCE
        if change < enough and adapted:
            break
        adapted, halvings = adapt, 0
        if adapt:
            _change_ratios(strips, total, exponent, work)
    if _misfit(strips, total, work) > _MISFIT:
        return displacement, _LOST
    return displacement + _balance(strips, total, count, load, more, work), change


@inner_bare_kernel
def _misfit(strips: Strips, total: int, work: Equations) -> float:
    """Deviation of required from present curvature, as a mean over the load.

    It is that of ratios which were held before they agreed with their neighbours.
    """
    missed, load = 0.0, 0.0
    for i in range(total):
        carried = strips.ratio[i] * strips.square[i] * strips.width[i]
        missed += carried * abs(work.factor[i] - 1.0)
        load += carried
    return missed / load if load > 0.0 else 0.0


@inner_bare_kernel
def _go_half_back(strips: Strips, total: int, work: Equations) -> None:
    """Take back half of the last step of the half-lengths."""
    for i in range(total):
        strips.square[i] = 0.5 * (strips.square[i] + work.before[i])


@inner_bare_kernel
def _change_ratios(
    strips: Strips, total: int, exponent: float, work: Equations
) -> None:
    """Change the ratios of strips by a power of their factors.

    Half-lengths follow, as the next step of Newton's method would make them.
    """
    for i in range(total):
        factor = work.factor[i] ** exponent
        strips.ratio[i] *= factor
        strips.square[i] *= factor**-1.75
    _fill_ratios(strips, total)


@inner_bare_kernel
def _open_heights(
    strips: Strips, total: int, displacement: float, work: Equations
) -> tuple[float, int]:
    """Residual gap of the surfaces over every strip.

    Return the residual [m2] and the number of active strips.
    """
    height = work.height
    for i in range(total):
        height[i] = (strips.gap[i] - displacement) * strips.turn[i]
    for j in range(total):
        carried = strips.ratio[j] * strips.square[j]
        if carried > 0.0:
            for i in range(total):
                if work.in_reach[i] == 1:
                    height[i] += carried * work.mean[j, i]
    missed, count = 0.0, 0
    for i in range(total):
        if strips.square[i] > 0.0 or height[i] < 0.0:
            missed += abs(height[i]) * strips.width[i]
            work.active[count] = i
            count += 1
    return missed, count


@inner_bare_kernel
def _take_step(
    strips: Strips, count: int, load: float, work: Equations
) -> tuple[float, float, float]:
    """Take a step of the active strips under the load.

    Return the displacement, the derivative of the load by it, and the change of the
    load.
    """
    carried, more, largest = 0.0, 0.0, 0.0
    for a in range(count):
        i = work.active[a]
        weight = strips.ratio[i] * strips.width[i] * strips.lift[i]
        carried += weight * (strips.square[i] + work.step[a])
        more += weight * work.by_displacement[a]
        largest = max(largest, strips.square[i])
    down, change = (load - carried) / more, 0.0
    for a in range(count):
        i = work.active[a]
        before = strips.square[i]
        aim = before + work.step[a] + down * work.by_displacement[a]
        low = _BELOW * before if before > _VANISHING * largest else 0.0
        change += abs(aim - before) * strips.ratio[i] * strips.width[i]
        strips.square[i] = min(max(aim, low), _ABOVE * before + _FRESH * largest)
    return down, more, change / load


@inner_bare_kernel
def _balance(
    strips: Strips, total: int, count: int, load: float, more: float, work: Equations
) -> float:
    """Restore the load after changes of clipped strips and ratios, by known slopes.

    Return the displacement.
    """
    carried = 0.0
    for i in range(total):
        carried += strips.ratio[i] * strips.square[i] * strips.width[i] * strips.lift[i]
    down = (load - carried) / more
    for a in range(count):
        i = work.active[a]
        if strips.square[i] > 0.0:
            strips.square[i] = max(
                strips.square[i] + down * work.by_displacement[a],
                0.5 * strips.square[i],
            )
    carried = 0.0
    for i in range(total):
        carried += strips.ratio[i] * strips.square[i] * strips.width[i] * strips.lift[i]
    for i in range(total):
        strips.square[i] *= load / carried
    return down


@inner_bare_kernel
def _fill_ratios(strips: Strips, total: int) -> None:
    """Give strips without pressure the ratio of the nearest loaded strip, by part."""
    for i in range(total):
        if strips.square[i] > 0.0:
            continue
        for away in range(1, total):
            before, behind = i - away, i + away
            if (
                before >= 0
                and strips.square[before] > 0.0
                and strips.run[before] == strips.run[i]
            ):
                strips.ratio[i] = strips.ratio[before]
                break
            if (
                behind < total
                and strips.square[behind] > 0.0
                and strips.run[behind] == strips.run[i]
            ):
                strips.ratio[i] = strips.ratio[behind]
                break
