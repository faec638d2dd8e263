"""Where two campaigns are compared: stations of equal distance and of equal worn depth, values there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class CommonAxes:
    """Where two campaigns are compared; basis 0: equal distance, 1: equal worn depth, 2: equal worn area."""

    distance: FloatArray  # (3, k, 2) run, by basis, progress and campaign (rig, field) [m]
    depth: FloatArray  # (3, k, 2) largest wear depth of the two wheels there [m]
    reachable: NDArray[np.bool_]  # (3, k) whether both campaigns reach it


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


def equivalent_distance(
    asked: FloatArray, run: Sequence[FloatArray], wear: Sequence[FloatArray]
) -> FloatArray:
    """Distance at which one campaign has worn as much as another one has at the distances asked for.

    Parameters
    ----------
    asked : (k,) array
        Distances of the first campaign [m].
    run, wear : two (step,) arrays each
        Distance [m] and a measure of wear of both campaigns, the first one first.

    Returns
    -------
    (k,) array
        Distance of the second campaign [m], NaN where one of them ends before.
    """
    within = np.where(asked <= run[0][-1], asked, np.nan)
    known = np.isfinite(within)
    found = np.full(asked.shape, np.nan)
    found[known] = distance_at(wear[1], run[1], at_distances(run[0], wear[0], within[known]))
    return found


def common_axes(
    rig: xr.Dataset, field: xr.Dataset, count: int = 41, reach: Sequence[float] | None = None
) -> CommonAxes:
    """Lay `count` stations over the range both campaigns cover, equally spaced by each basis.

    Worn depth is the larger one of the two wheels, worn area the sum of both. Without wear in one campaign
    only the new wheel can be compared at equal depth or area. `reach` gives the range of each basis as other
    campaigns cover it: stations beyond that of these are not reachable, and NaN.
    """
    run = [data["distance"].values for data in (rig, field)]
    worst = [data["max_wear_depth"].max("wheel").values for data in (rig, field)]
    bases = (run, worst, [data["worn_area"].sum("wheel").values for data in (rig, field)])
    part = np.linspace(0.0, 1.0, count)
    distance, depth = np.empty((2, len(bases), count, 2))
    reachable = np.ones((len(bases), count), dtype=bool)
    for b, measure in enumerate(bases):
        common = min(measure[0][-1], measure[1][-1])
        equal = part * (common if reach is None else reach[b])
        reachable[b, 1:] = (equal[1:] <= common * (1.0 + 1e-12)) & (equal[-1] > 0.0)
        equal = np.minimum(equal, common)
        for c in (0, 1):
            distance[b, :, c] = equal if measure is run else distance_at(measure[c], run[c], equal)
            at_station = at_distances(run[c], worst[c], distance[b, :, c])
            depth[b, :, c] = equal if measure is worst else at_station
    return CommonAxes(distance, depth, reachable)
