"""Kernels of the strip model: the contact planes of parts of the profile, and which of them they share.

Rule and reasons: see `knothe_le_the`.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.kernel import kernel
from wearsim.contact.normal.half_space_lobes import BESIDE, CLEAR, FAR, NEAR, UNLIKE
from wearsim.contact.normal.half_space_regions import ALIKE
from wearsim.contact.normal.strips_laid import MARGIN, STRIPS
from wearsim.contact.patch import FloatArray

MIDDLE, TILT, WEIGHT, OWN = range(4)  # of a plane: place, angle, load, and the angle the part has for itself
PLANE = 4


@kernel
def together(distance: float, turn: float) -> float:
    """Share in which two contacts belong together, by their distance from edge to edge and their angles."""
    near = min(max((FAR - distance) / (FAR - NEAR), 0.0), 1.0)
    alike = min(max((UNLIKE - abs(turn)) / (UNLIKE - ALIKE), 0.0), 1.0)
    beside = min(max((CLEAR - distance) / (CLEAR - BESIDE), 0.0), 1.0)
    share: float = max(near * alike, beside)
    return share


@kernel
def value_at(y: float, grid_y: FloatArray, table: FloatArray) -> float:
    """Value at a place of the profile, linear between its points."""
    i = min(max(int(np.searchsorted(grid_y, y)) - 1, 0), grid_y.size - 2)
    value: float = table[i] + (y - grid_y[i]) / (grid_y[i + 1] - grid_y[i]) * (table[i + 1] - table[i])
    return value


@kernel
def apart(left: float, right: float, grid_y: FloatArray, grid_z: FloatArray) -> float:
    """Straight distance between two places of the profile; nothing if they are in the wrong order."""
    across = right - left
    down = value_at(right, grid_y, grid_z) - value_at(left, grid_y, grid_z)
    distance: float = np.sqrt(across * across + down * down) if across > 0.0 else 0.0
    return distance


@kernel
def planes_of(
    spans: FloatArray,
    found: int,
    old: FloatArray,
    total: int,
    grid_y: FloatArray,
    grid_z: FloatArray,
    angle: FloatArray,
    planes: FloatArray,
) -> None:
    """Pressure-weighted place and angle of every part, the latter leaning towards those it belongs to.

    The weight is zero where no strips with pressure were laid yet.
    """
    for k in range(found):
        weight, moment, tilt = 0.0, 0.0, 0.0
        for j in range(total):
            if spans[k, 0] <= old[0, j] <= spans[k, 1]:
                load = old[1, j] * old[3, j]
                weight += load
                moment += load * old[0, j]
                tilt += load * value_at(old[0, j], grid_y, angle)
        planes[k, WEIGHT] = weight
        if weight > 0.0:
            planes[k, MIDDLE], planes[k, OWN] = moment / weight, tilt / weight
        else:
            planes[k, MIDDLE] = planes[k, OWN] = 0.0
    share = np.eye(found)
    for j in range(found):
        for k in range(j + 1, found):
            # Strips are laid beyond the patch by their margin.
            end = spans[j, 1] - MARGIN * (spans[j, 1] - spans[j, 0]) / max(spans[j, STRIPS], 10.0)
            start = spans[k, 0] + MARGIN * (spans[k, 1] - spans[k, 0]) / max(spans[k, STRIPS], 10.0)
            turn = planes[j, OWN] - planes[k, OWN]
            share[j, k] = share[k, j] = together(apart(end, start, grid_y, grid_z), turn)
    for k in range(found):
        planes[k, TILT] = blended(k, found, share, planes[:, WEIGHT], planes[:, OWN])


@kernel
def blended(k: int, count: int, share: FloatArray, weight: FloatArray, value: FloatArray) -> float:
    """Value of one of several contacts, with that of the others in the share they belong together.

    The weighted mean if all do; linear in the shares.
    """
    lean = 0.0
    for j in range(count):
        if share[k, j] > 0.0 and weight[j] > 0.0 and j != k:
            total = 0.0
            for i in range(count):
                total += max(share[k, i], share[j, i]) * weight[i]
            lean += share[k, j] * weight[j] * (value[j] - value[k]) / total
    result: float = value[k] + lean
    return result


@kernel
def share_points(
    count: int,
    descent: float,
    grid_y: FloatArray,
    grid_z: FloatArray,
    along: FloatArray,
    edges: FloatArray,
    values: FloatArray,
) -> None:
    """Place from which patches that belong together are seen, as `lay_patches` has the columns."""
    last = edges.shape[1] - 1
    share = np.eye(count)
    for j in range(count):
        for k in range(count):
            if values[j, 0] < values[k, 0]:
                distance = apart(edges[j, last], edges[k, 0], grid_y, grid_z)
                whole = together(distance, values[j, 9] - values[k, 9]) ** 4
                share[j, k] = share[k, j] = whole
    for k in range(count):
        own = values[k]
        lowest, deeper = descent - own[2] / np.cos(own[1]), 0.0
        for j in range(count):
            other = descent - values[j, 2] / np.cos(values[j, 1])
            deeper = min(deeper, share[j, k] * (other - lowest))
        place = blended(k, count, share, values[:, 3], values[:, 0])
        own[8] = place
        own[10] = (descent - lowest - deeper) * np.cos(own[1])
        across = (own[0] - place) * np.cos(own[1])
        down = value_at(own[0], grid_y, grid_z) - value_at(place, grid_y, grid_z)
        own[11] = across + down * np.sin(own[1])
        own[12] = value_at(own[0], grid_y, along) - value_at(place, grid_y, along)
