"""Grouping of the contacts of a wheel on common grids.

Lobes are runs of loaded strips. Two of them are coupled by the share

    t = max( ramp(distance; 10 mm, 20 mm) * ramp(angle between them; 0.2 rad, 0.3 rad),
             ramp(distance; 2 mm, 4 mm) ),

each ramp 1 up to the first and 0 from the second value on. With t = 1 both lie on one
grid in one plane. With t = 0 each has its own grid and plane, without mutual influence.
In between each has its own grid, but their planes tend to the common one, and their
mutual elastic influence is weighted with t: only the sampling is discontinuous. Of
three lobes and more, those coupled by t = 1 share a grid (always if less than 2 mm
apart). Between grids t is the mean over the pairs of their lobes, weighted by both
forces.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from wearsim.contact.geometry import Gap
from wearsim.contact.kernel import inner_kernel, kernel, plain
from wearsim.contact.normal.half_space.regions import (
    ALIKE,
    Region,
    Section,
    curvature_along,
    origin_x,
)
from wearsim.contact.patch import FloatArray, IntArray, Resolution

MARGIN = 1.5  # empty cells between a patch and each border of its grid

# Ramps of the coupling t: distances from edge to edge [m] and, with ALIKE, angles
# [rad].
_NEAR, _FAR = 10e-3, 20e-3
_UNLIKE = 0.3
_ADJACENT, _CLEAR = 2e-3, 4e-3  # distances for any angle
_NEXT = 1e-3  # distance from a grid within which no other contact begins [m]
# share of the least number of strips, for narrow lobes on a common grid
_PER_LOBE = 0.25
_SLIGHT = 0.02  # share of the force below which a lobe needs no strips of its own
_GROW = 0.2  # relative growth of a grid whose border the patch reaches


@dataclass(frozen=True)
class Lobe:
    """Lobe: connected loaded strips.

    Positions are on the counterface's profile and from the middle of the axle.

    Parameters
    ----------
    left, right : float
        Edges, y [m].
    x_low, x_high : float
        Ends along the rolling direction [m].
    centre, angle : float
        Pressure-weighted y [m] and contact angle [rad].
    force : float
        [N].
    """

    left: float
    right: float
    x_low: float
    x_high: float
    centre: float
    angle: float
    force: float


def lobes_of(gap: Gap, region: Region, pressure: FloatArray) -> list[Lobe]:
    """Find the runs of loaded strips on a grid.

    Parameters
    ----------
    gap : Gap
        n rows.
    region : Region
        The grid's place.
    pressure : (nx, ny) array
        On it [Pa].

    Returns
    -------
    list of Lobe
        Their edges between the cells: near an edge the square of the pressure along a
        strip, and the load of the strips, grow linearly with the distance from it.
    """
    length, width = region.cell
    section, front = (
        Section(gap, region.y, region.angle),
        region.x_high + origin_x(gap, region),
    )
    y = section.lateral(region.s)
    angle = np.interp(y, gap.counterface.y, gap.counterface.angle)
    lobes, runs = [], _runs(plain(pressure), y, angle).tolist()
    for first, last, lead, trail, before, after, middle, turn, load in runs:
        # extend the run where it reaches the border of the grid
        before = (
            _GROW * region.ny
            if first == 0.0 and not math.isfinite(region.y_low)
            else before
        )
        after = (
            _GROW * region.ny
            if last == region.ny - 1.0 and not math.isfinite(region.y_high)
            else after
        )
        edges = (
            np.array([first + 0.5 - before, last + 0.5 + after]) * width + region.s_low
        )
        left, right = section.lateral(edges).tolist()
        force = load * length * width
        lobes.append(
            Lobe(
                left,
                right,
                front - trail * length,
                front - lead * length,
                middle,
                turn,
                force,
            )
        )
    return lobes


@kernel
def _runs(pressure: FloatArray, y: FloatArray, angle: FloatArray) -> FloatArray:
    """Find the runs of loaded strips (k, 9) on a grid.

    The columns are the first and last strip; leading and trailing end in cells from the
    front, extended where they reach the border of the grid; the distances (in cells) by
    which the first and last strip are passed; weighted y and angle; and the sum of the
    pressures.
    """
    (nx, ny), count = pressure.shape, 0
    runs, loads = np.zeros((ny, 11)), np.zeros(ny + 1)
    for j in range(ny):
        first, behind = nx, -1
        for i in range(nx):
            if pressure[i, j] > 0.0:
                first, behind, loads[j] = min(first, i), i, loads[j] + pressure[i, j]
        if behind < 0:
            continue
        if j == 0 or loads[j - 1] == 0.0:
            runs[count, 0], runs[count, 2] = j, nx
            count += 1
        run = runs[count - 1]
        ahead = (
            first
            + 0.5
            - _reach(pressure[first, j] ** 2, pressure[min(first + 1, nx - 1), j] ** 2)
        )
        back = (
            behind
            + 0.5
            + _reach(pressure[behind, j] ** 2, pressure[max(behind - 1, 0), j] ** 2)
        )
        run[9] = _GROW * nx if first == 0 else run[9]
        run[10] = _GROW * nx if behind == nx - 1 else run[10]
        run[1], run[2], run[3] = j, min(run[2], ahead), max(run[3], back)
        run[6], run[7] = run[6] + loads[j] * y[j], run[7] + loads[j] * angle[j]
        run[8] += loads[j]
    for run in runs[:count]:
        first, behind = int(run[0]), int(run[1])
        run[4] = _reach(loads[first], loads[min(first + 1, behind)])
        run[5] = _reach(loads[behind], loads[max(behind - 1, first)])
        run[6], run[7] = run[6] / run[8], run[7] / run[8]
        run[2], run[3] = run[2] - run[9], run[3] + run[10]
    return runs[:count, :9]


@inner_kernel
def _reach(last: float, inside: float) -> float:
    """Extrapolated length of a linear decrease beyond its last positive value.

    It is in cells, at most one.
    """
    return last / (inside - last) if inside - last > last else 1.0


def angle_of(gap: Gap, region: Region, pressure: FloatArray) -> float:
    """Pressure-weighted contact angle of a grid [rad]."""
    lobes = lobes_of(gap, region, pressure)
    return _merged(lobes).angle if lobes else region.angle


def _distance(gap: Gap, flange_lobe: Lobe, field_lobe: Lobe) -> float:
    """Distance of two lobes from edge to edge [m], that on the flange side first."""
    z = np.interp(
        [flange_lobe.right, field_lobe.left], gap.counterface.y, gap.counterface.z
    )
    return float(np.hypot(max(field_lobe.left - flange_lobe.right, 0.0), z[1] - z[0]))


def _coupling(gap: Gap, flange_lobe: Lobe, field_lobe: Lobe) -> float:
    """Coupling t of two lobes [-], that on the flange side first."""
    distance, turn = (
        _distance(gap, flange_lobe, field_lobe),
        abs(field_lobe.angle - flange_lobe.angle),
    )
    near = min(max((_FAR - distance) / (_FAR - _NEAR), 0.0), 1.0)
    alike = min(max((_UNLIKE - turn) / (_UNLIKE - ALIKE), 0.0), 1.0)
    adjacent = min(max((_CLEAR - distance) / (_CLEAR - _ADJACENT), 0.0), 1.0)
    return max(near * alike, adjacent)


def gather(gap: Gap, lobes: list[Lobe]) -> tuple[list[list[Lobe]], FloatArray]:
    """Group the lobes of a wheel by the rule of this module.

    Parameters
    ----------
    gap : Gap
        n rows.
    lobes : list of Lobe
        Of one wheel, in any order; at least one.

    Returns
    -------
    groups : list of list of Lobe
        Those that share a grid, from the flange to the field side.
    coupled : (k, k) array
        Shares t between the groups, zero on the diagonal.
    """
    runs: list[list[Lobe]] = []
    for lobe in sorted(lobes, key=lambda lobe: lobe.centre):
        if runs and _distance(gap, _merged(runs[-1]), lobe) <= _ADJACENT:
            runs[-1].append(lobe)
        else:
            runs.append([lobe])
    whole = [_merged(run) for run in runs]
    joined: list[list[int]] = []
    for k, lobe in enumerate(whole):
        if joined and all(_coupling(gap, whole[j], lobe) == 1.0 for j in joined[-1]):
            joined[-1].append(k)
        else:
            joined.append([k])
    groups = [[lobe for k in group for lobe in runs[k]] for group in joined]
    coupled = np.zeros((len(groups), len(groups)))
    for k, group in enumerate(joined):
        for j in range(k + 1, len(joined)):
            pairs = [
                (whole[flange_run], whole[field_run])
                for flange_run in group
                for field_run in joined[j]
            ]
            shares = np.array(
                [
                    _coupling(gap, flange_lobe, field_lobe)
                    for flange_lobe, field_lobe in pairs
                ]
            )
            weights = np.array(
                [
                    flange_lobe.force * field_lobe.force
                    for flange_lobe, field_lobe in pairs
                ]
            )
            weights = weights if weights.any() else np.ones(weights.size)
            coupled[k, j] = coupled[j, k] = (weights * shares).sum() / weights.sum()
    return groups, coupled


def place_grids(
    gap: Gap,
    row: int,
    groups: list[list[Lobe]],
    coupled: FloatArray,
    resolution: Resolution,
) -> list[Region]:
    """Place a grid around each group of lobes.

    Parameters
    ----------
    gap : Gap
        n rows.
    row : int
        Which.
    groups, coupled
        As from `gather`.
    resolution : Resolution
        Cells of the grids; `MARGIN` cells are added at each border. Every lobe has at
        least a fourth of the least number of strips.

    Returns
    -------
    list of Region
        One for each group.
    """
    merged = [_merged(group) for group in groups]
    edges = [-np.inf, *(0.5 * (a.right + b.left) for a, b in pairwise(merged)), np.inf]
    regions = []
    for k, (lobe, y_low, y_high) in enumerate(
        zip(merged, edges, edges[1:], strict=False)
    ):
        lean = sum(
            coupled[k, j]
            * neighbour.force
            / (lobe.force + neighbour.force)
            * (neighbour.angle - lobe.angle)
            for j, neighbour in enumerate(merged)
            if coupled[k, j] > 0.0 and neighbour.force > 0.0
        )
        narrowest = min(
            (member.right - member.left) / (lobe.right - lobe.left)
            for member in groups[k]
            if member.force >= _SLIGHT * lobe.force
        )
        angle = float(lobe.angle + lean)
        s = Section(gap, lobe.centre, angle).across(
            np.array([lobe.left, lobe.right, y_low, y_high])
        )
        border = 2.0 * MARGIN * resolution.cell
        ny = int(resolution.strips_across(s[1:2] - s[0] + border)[0])
        ny = max(
            ny, min(int(_PER_LOBE * resolution.strips / narrowest), resolution.most)
        )
        nx = int(
            resolution.cells_along(np.array([lobe.x_high - lobe.x_low + border]))[0]
        )
        width = float(s[1] - s[0]) / (ny - 2.0 * MARGIN)
        length = (lobe.x_high - lobe.x_low) / (nx - 2.0 * MARGIN)
        x = float(np.interp(lobe.centre, gap.counterface.y, gap.x[row]))
        low, high = float(s[0]) - MARGIN * width, float(s[1]) + MARGIN * width
        low = max(low, float(s[2])) if np.isfinite(y_low) else low
        high = min(high, float(s[3])) if np.isfinite(y_high) else high
        ahead, behind = (
            lobe.x_high + MARGIN * length - x,
            lobe.x_low - MARGIN * length - x,
        )
        regions.append(
            Region(
                row, lobe.centre, angle, behind, ahead, low, high, nx, ny, y_low, y_high
            )
        )
    return regions


def _merged(lobes: list[Lobe]) -> Lobe:
    """Outline, centre and angle of several lobes."""
    force = sum(lobe.force for lobe in lobes)
    weights = [
        lobe.force / force if force > 0.0 else 1.0 / len(lobes) for lobe in lobes
    ]
    return Lobe(
        min(lobe.left for lobe in lobes),
        max(lobe.right for lobe in lobes),
        min(lobe.x_low for lobe in lobes),
        max(lobe.x_high for lobe in lobes),
        sum(weight * lobe.centre for weight, lobe in zip(weights, lobes, strict=True)),
        sum(weight * lobe.angle for weight, lobe in zip(weights, lobes, strict=True)),
        force,
    )


def missed(
    gap: Gap,
    regions: Sequence[Region],
    pressure: Sequence[FloatArray],
    displacement: float,
    modulus: float,
) -> list[Lobe]:
    """Contacts outside the grids.

    Parameters
    ----------
    gap : Gap
        n rows.
    regions : sequence of Region
        Grids of one wheel.
    pressure : sequence of (nx, ny) arrays
        On them [Pa].
    displacement : float
        Vertical, of the wheel from initial contact [m].
    modulus : float
        E* [Pa].

    Returns
    -------
    list of Lobe
        Where, along the contact line outside the grids, the rigid surfaces overlap by
        more than they give way under the pressures of the grids; a rough outline, and
        no force.
    """
    grid, curve = gap.counterface, gap.gap[regions[0].row]
    first = float(curve.min())
    outside = curve < first + displacement
    for region in regions:
        # A contact right next to a grid is that of its own patch, and the grid grows.
        edge = np.array([region.s_low - _NEXT, region.s_high + _NEXT])
        ends = Section(gap, region.y, region.angle).lateral(edge)
        outside &= (grid.y < ends[0]) | (grid.y > ends[1])
    places = 1 + np.flatnonzero(outside[1:-1])
    if places.size == 0:
        return []
    y, z, x = grid.y[places], grid.z[places], gap.x[regions[0].row, places]
    depth = (first + displacement - curve[places]) * np.cos(grid.angle[places])
    for region, field in zip(regions, pressure, strict=True):
        length, width = region.cell
        rows, columns = np.arange(0, field.shape[0], 6), np.arange(0, field.shape[1], 3)
        blocks = np.add.reduceat(
            np.add.reduceat(field, rows, axis=0), columns, axis=1
        ) * (length * width)
        along = _middle(region.x, rows) + origin_x(gap, region)
        s = _middle(region.s, columns)
        foot = np.interp(region.y, grid.y, grid.z)
        lateral = np.hypot(
            y[:, None] - region.y - s * np.cos(region.angle),
            z[:, None] - foot - s * np.sin(region.angle),
        )
        share = np.clip((_FAR - lateral.min(axis=1)) / (_FAR - _NEAR), 0.0, 1.0)
        distance = np.sqrt(
            lateral[:, None, :] ** 2 + (x[:, None, None] - along[:, None]) ** 2
        )
        depth -= share * (blocks / distance).sum(axis=(1, 2)) / (np.pi * modulus)
    lobes = []
    deep = np.flatnonzero(depth > 0.0)
    for run in (
        np.split(deep, np.flatnonzero(np.diff(places[deep]) > 1) + 1)
        if deep.size > 0
        else []
    ):
        half = np.sqrt(
            2.0 * depth[run].max() / curvature_along(gap, regions[0].row, y[run]).min()
        )
        top = run[int(depth[run].argmax())]
        left, right = grid.y[places[run[0]] - 1], grid.y[places[run[-1]] + 1]
        angle = grid.angle[places[top]]
        lobes.append(
            Lobe(
                *map(
                    float,
                    (left, right, x[top] - half, x[top] + half, y[top], angle, 0.0),
                )
            )
        )
    return lobes


def _middle(place: FloatArray, starts: IntArray) -> FloatArray:
    """Mean of the positions of each block of cells."""
    return np.add.reduceat(place, starts) / np.diff(np.append(starts, place.size))
