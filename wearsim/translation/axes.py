"""Where two campaigns are compared: stations of equal distance and of equal worn depth, values there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class CommonAxes:
    """Where two campaigns are compared; basis 0 = equal distance, 1 = equal worn depth."""

    distance: FloatArray  # (2, k, 2) run, by basis, progress and campaign (rig, field) [m]
    depth: FloatArray  # (2, k, 2) largest wear depth of the two wheels there [m]
    reachable: NDArray[np.bool_]  # (2, k) whether both campaigns reach it


def at_distances(distance: FloatArray, values: FloatArray, targets: FloatArray) -> FloatArray:
    """Interpolate linearly between the rows (step, ...) of a result, at distances (k,) within its range [m].

    Returns
    -------
    (k, ...) array
        The row itself where a target meets one, so that a neighbour without value does no harm.
    """
    left = rows_at(distance, targets)
    right = np.minimum(left + 1, distance.size - 1)
    gap = distance[right] - distance[left]
    part = np.divide(targets - distance[left], gap, out=np.zeros_like(gap), where=gap > 0.0)
    part = part.reshape(part.shape + (1,) * (values.ndim - 1))
    return np.where(part == 0.0, values[left], (1.0 - part) * values[left] + part * values[right])


def rows_at(distance: FloatArray, targets: FloatArray) -> IntArray:
    """Row of the last stored state at or before each target distance, (k,) int array."""
    return np.clip(np.searchsorted(distance, targets, side="right") - 1, 0, distance.size - 1)


def distance_at(growing: FloatArray, distance: FloatArray, targets: FloatArray) -> FloatArray:
    """Distance at which a growing measure (step,) first reaches each target (k,).

    Returns
    -------
    (k,) array
        Distance [m], NaN beyond what the campaign reached.
    """
    level = np.maximum.accumulate(growing)
    after = np.minimum(np.searchsorted(level, targets, side="left"), level.size - 1)
    before = np.maximum(after - 1, 0)
    rise = level[after] - level[before]
    # a standstill ends where the next rise begins, so the part counts from the last row of the lower level
    part = np.divide(targets - level[before], rise, out=np.ones_like(rise), where=rise > 0.0)
    reached = np.where(
        part == 1.0, distance[after], distance[before] + part * (distance[after] - distance[before])
    )
    return np.where(targets <= level[-1], np.where(targets <= level[0], distance[0], reached), np.nan)


def common_axes(rig: xr.Dataset, field: xr.Dataset, count: int = 41) -> CommonAxes:
    """Lay `count` equally spaced stations over the range both campaigns cover, by distance and by worn depth.

    Worn depth is the larger one of the two wheels. Without wear in one campaign only the new wheel can be
    compared at equal depth.
    """
    run = [data["distance"].values for data in (rig, field)]
    worst = [data["max_wear_depth"].max("wheel").values for data in (rig, field)]
    part = np.linspace(0.0, 1.0, count)
    equal_distance = part * min(run[0][-1], run[1][-1])
    equal_depth = part * min(worst[0][-1], worst[1][-1])
    distance = np.empty((2, count, 2))
    depth = np.empty((2, count, 2))
    for c in (0, 1):
        distance[0, :, c] = equal_distance
        depth[0, :, c] = at_distances(run[c], worst[c], equal_distance)
        distance[1, :, c] = distance_at(worst[c], run[c], equal_depth)
        depth[1, :, c] = equal_depth
    reachable = np.ones((2, count), dtype=bool)
    reachable[0, 1:] = equal_distance[-1] > 0.0
    reachable[1, 1:] = equal_depth[-1] > 0.0
    return CommonAxes(distance, depth, reachable)
