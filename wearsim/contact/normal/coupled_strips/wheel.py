"""Solution of a wheel on its strips, and its patches.

Equations and sources: see `coupled_strips`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.contact.geometry import NO_WHEEL
from wearsim.contact.kernel import bare_kernel, inner_bare_kernel
from wearsim.contact.normal.coupled_strips.equations import (
    Equations,
    equations_for,
    solve_strips,
)
from wearsim.contact.normal.coupled_strips.strips import (
    PENETRATION,
    SHORT,
    Penetration,
    Records,
    Row,
    Strips,
    lay_strips,
    penetrate,
    strips_for,
)
from wearsim.contact.normal.model import (
    AT_EDGE,
    FAINT,
    NO_BALANCE,
    NO_CONTACT,
    NOT_SINGLE,
)
from wearsim.contact.patch import FloatArray, IntArray

NO_ROOM = -1  # fault of a row with more strips than the arrays can store

# first level over the displacement, and factor if it was too low
_MARGIN, _HIGHER = (
    1.5,
    1.1,
)
_LEVELS, _FARTHER = 8, 1.5  # trials of the level, and factor after a failed trial
_FAILURES = 2  # trials in a row without solution after which a wheel has none
# Growth of c / (k E*), which is 1/2 for a cylinder, with the length over width of an
# ellipse.
_SLENDER = 0.137
_STEPS = 40  # largest number of steps of a trial
_EXACT = 3e-5  # tolerance of the load of strips
_ENOUGH = 0.01  # change of the strip load in the last step that is still accepted
_SMALLEST = 1e-5  # share of the load below which patches are omitted


class Wheels(NamedTuple):
    """Surface of the wheel, profile of the counterface, and gap of each row."""

    y: FloatArray
    z: FloatArray
    slope: FloatArray
    angle: FloatArray
    gap: FloatArray
    radius: FloatArray
    along: FloatArray
    wheel_y: FloatArray
    sin_theta: FloatArray
    low: FloatArray
    sin_yaw: FloatArray
    surface_y: FloatArray
    surface_slope: FloatArray
    kappa: float
    step: float
    vertical: bool


# Patch of the solution: first and last strip, and those of them that are nodes;
# vertical displacement from the design height of the wheel, magnitude and direction of
# the sum of its normal forces, factor on them; stations of both ends. The rest is
# filled by `cut_patches`.
PATCH = np.dtype(
    [(name, int) for name in ("first", "last", "first_whole", "last_whole")]
    + [
        (name, float)
        for name in (
            "displacement",
            "force",
            "scale",
            "angle",
            "start",
            "stop",
            "centre",
            "along",
            "approach",
            "pressure",
            "width",
            "left",
            "right",
        )
    ]
)


class Work(NamedTuple):
    """Work arrays of a wheel: strips, previous strips, widths and numbers.

    Widths and numbers are those at the profile's points.
    """

    strips: Strips
    old_number: IntArray
    old_square: FloatArray
    old_ratio: FloatArray
    widths: FloatArray
    number: FloatArray
    equations: Equations


def work_for(most: int, points: int, table: FloatArray) -> Work:
    """Allocate the work arrays for a number of strips and profile points."""
    square, ratio = np.zeros((2, most))
    widths, number = np.empty((2, points))
    return Work(
        strips_for(most),
        np.zeros(most, np.int64),
        square,
        ratio,
        widths,
        number,
        equations_for(most, table),
    )


@bare_kernel
def solve_wheels(
    wheels: Wheels,
    rows: IntArray,
    load: FloatArray,
    count: float,
    work: Work,
    number: IntArray,
    fault: IntArray,
    patches: Records,
    kept: FloatArray,
) -> None:
    """Solve every row and find its patches, by falling normal force.

    `kept` (7, n, most) are place along the arc, q, ratio, width, contact angle, contact
    line and number of strips.
    """
    for n in range(rows.size):
        row = row_of(wheels, rows[n], load[n])
        fault[n], total, displacement = _solve(count, row, work)
        if fault[n] == 0:
            fault[n], number[n] = _find_patches(
                total, displacement, row, work.strips, patches[n], kept[:, n]
            )


@inner_bare_kernel
def row_of(wheels: Wheels, r: int, load: float) -> Row:
    """Gap of one row."""
    return Row(
        wheels.y,
        wheels.z,
        wheels.slope,
        wheels.angle,
        wheels.gap[r],
        wheels.radius[r],
        wheels.along[r],
        wheels.wheel_y[r],
        wheels.sin_theta[r],
        wheels.surface_y,
        wheels.surface_slope,
        wheels.sin_yaw[r],
        wheels.kappa,
        wheels.low[r],
        load,
        wheels.step,
        wheels.vertical,
    )


@inner_bare_kernel
def _solve(count: float, row: Row, work: Work) -> tuple[int, int, float]:
    """Lay and solve the strips of a wheel.

    Return a fault or 0, the number of strips and the displacement.
    """
    if not row.low < NO_WHEEL:
        return NO_CONTACT, 0, 0.0
    strips, first = work.strips, penetrate(row)
    level, displacement = _MARGIN * first.displacement, first.displacement
    before = total = failures = 0
    for _ in range(_LEVELS):
        total = lay_strips(level, count, first, row, strips, work.widths, work.number)
        if total < 0:
            return NO_ROOM, 0, 0.0
        if total == 0:
            return AT_EDGE, 0, 0.0
        if before > 0:
            _go_on(before, total, work)
        else:
            _guess(total, first, strips)
        new_displacement, change = solve_strips(
            strips,
            total,
            row.load,
            displacement,
            row.step,
            _STEPS,
            _EXACT,
            work.equations,
        )
        if change > _ENOUGH:
            failures += 1
            if failures == _FAILURES:
                break
            before = 0
            displacement = first.displacement
            level *= _FARTHER
            continue
        failures = 0
        if new_displacement < level:
            return _edge_or(0, total, row, strips), total, new_displacement
        before, displacement, level = (
            total,
            new_displacement,
            _HIGHER * new_displacement,
        )
        for i in range(total):
            work.old_number[i] = strips.number[i]
            work.old_square[i], work.old_ratio[i] = strips.square[i], strips.ratio[i]
    return _edge_or(NO_BALANCE, total, row, strips), 0, 0.0


@inner_bare_kernel
def _go_on(before: int, total: int, work: Work) -> None:
    """Set half-lengths and ratios from those of fewer strips."""
    strips, k = work.strips, 0
    for i in range(total):
        while k < before - 1 and work.old_number[k] < strips.number[i]:
            k += 1
        strips.ratio[i] = work.old_ratio[k]
        if work.old_number[k] == strips.number[i]:
            strips.square[i] = work.old_square[k]


@inner_bare_kernel
def _guess(total: int, first: Penetration, strips: Strips) -> None:
    """Set initial half-lengths by virtual penetration, and ratios of ellipses.

    The ellipses have the same length and width.
    """
    begin = 0
    while begin < total:
        stop, longest, width = begin, 0.0, 0.0
        while stop < total and strips.run[stop] == strips.run[begin]:
            depth = (
                max(PENETRATION * first.displacement - strips.gap[stop], 0.0)
                * strips.turn[stop]
            )
            strips.square[stop] = 2.0 * depth / strips.bend[stop]
            longest = max(longest, strips.square[stop])
            if depth > 0.0:
                width += strips.width[stop]
            stop += 1
        slender = 2.0 * np.sqrt(longest / PENETRATION) / width if width > 0.0 else 1.0
        for j in range(begin, stop):
            strips.ratio[j] = (0.5 + _SLENDER * slender) / np.pi * strips.bend[j]
        begin = stop


@inner_bare_kernel
def _edge_or(fault: int, total: int, row: Row, strips: Strips) -> int:
    """Fault of a wheel, or that of a loaded strip at the edge of the profile.

    Such a strip has more than a faint load and no wheel beside it.
    """
    for j in range(total):
        carried = strips.ratio[j] * strips.square[j] * strips.width[j]
        if carried < FAINT * row.load:
            continue
        for i in (j - 1, j + 1):
            if (
                0 <= i < total
                and strips.run[i] == strips.run[j]
                and strips.gap[i] >= NO_WHEEL
            ):
                return AT_EDGE
    return fault


@inner_bare_kernel
def end_of(strips: Strips, end: int, inwards: int, count: int) -> float:
    """Station where q of the outermost strips of a patch falls to zero.

    It lies at most a strip beyond them. An outermost strip that hardly carries does not
    count: the end is continuous as it gains and loses contact.
    """
    if count < 2:
        next_one = min(max(end - inwards, 0), strips.run.size - 1)
        return strips.station[end] + 0.5 * (
            strips.station[next_one] - strips.station[end]
        )
    place = _zero_beyond(strips, end, inwards, count)
    share = strips.square[end] / (SHORT * strips.square[end + inwards])
    if share >= 1.0 or count < 3:
        return place
    before = _zero_beyond(strips, end + inwards, inwards, count - 1)
    return before + share * (place - before)


@inner_bare_kernel
def _zero_beyond(strips: Strips, end: int, inwards: int, count: int) -> float:
    """Station where the parabola of q through three strips falls to zero.

    It lies at most a strip beyond them.
    """
    inside = end + inwards
    distance = strips.station[end] - strips.station[inside]
    fall, square = strips.square[inside] - strips.square[end], strips.square[end]
    share = square / fall if fall > square else 1.0
    if count > 2 and fall > 0.0:
        deeper = inside + inwards
        next_distance = strips.station[inside] - strips.station[deeper]
        change = (
            fall / distance
            - (strips.square[deeper] - strips.square[inside]) / next_distance
        )
        bend = change / (distance + next_distance) * distance**2 / fall
        if bend > 0.0:
            # share + share (1 + share) bend = aim
            slope, aim = 1.0 + bend, square / fall
            share = min(
                share, 2.0 * aim / (slope + np.sqrt(slope * slope + 4.0 * bend * aim))
            )
    return strips.station[end] + share * distance


@inner_bare_kernel
def _find_patches(
    total: int,
    displacement: float,
    row: Row,
    strips: Strips,
    patches: Records,
    kept: FloatArray,
) -> tuple[int, int]:
    """Find the patches of a wheel, by falling normal force.

    Return a fault or 0, and their number.
    """
    count, j, carried = 0, 0, 0.0
    for i in range(total):
        kept[0, i] = strips.station[i] * row.step
        kept[1, i], kept[2, i], kept[3, i] = (
            strips.square[i],
            strips.ratio[i],
            strips.width[i],
        )
        kept[4, i], kept[5, i], kept[6, i] = (
            strips.tilt[i],
            strips.middle[i],
            strips.number[i],
        )
    while j < total:
        first, upwards, sideways, lifted = j, 0.0, 0.0, 0.0
        while (
            j < total and strips.square[j] > 0.0 and strips.run[j] == strips.run[first]
        ):
            part = strips.ratio[j] * strips.square[j] * strips.width[j]
            upwards += part * np.cos(strips.tilt[j])
            sideways += part * np.sin(strips.tilt[j])
            lifted += part * strips.lift[j]
            j += 1
        force = np.sqrt(upwards * upwards + sideways * sideways)
        if force <= _SMALLEST * row.load:
            j = max(j, first + 1)
            continue
        if count == patches.size:
            return NO_ROOM, count
        carried += lifted if row.vertical else force
        place = count
        count += 1
        while place > 0 and patches[place - 1].force < force:
            patches[place] = patches[place - 1]
            place -= 1
        patch = patches[place]
        patch.first, patch.last, patch.force = first, j - 1, force
        patch.first_whole, patch.last_whole = first, j - 1
        patch.displacement, patch.angle = (
            displacement + row.low,
            np.arctan2(sideways, upwards),
        )
        patch.start = end_of(strips, first, 1, j - first)
        patch.stop = end_of(strips, j - 1, -1, j - first)
        # Outermost strips that hardly carry are not nodes.
        if j - first > 2:
            if strips.square[first] < SHORT * strips.square[first + 1]:
                patch.first_whole += 1
            if strips.square[j - 1] < SHORT * strips.square[j - 2]:
                patch.last_whole -= 1
    if count == 0:
        return NO_BALANCE, 0
    if count > 1 and not row.vertical:
        return NOT_SINGLE, count
    for m in range(count):
        patches[m].scale = row.load / carried
        patches[m].force *= patches[m].scale
    return 0, count
