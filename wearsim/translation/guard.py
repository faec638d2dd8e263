"""Guard on the wear mechanism of a rig programme: extremes no higher than in the field.

Conditions are by zone of the wheel, and linear in the distances of the candidates, so
that each is a row of the linear programme.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

ZONE_BORDERS = 1e-3 * np.array([-38.0, -26.0, -14.0, -8.0, -3.0, 3.0, 8.0, 14.0, 32.0])
"""Borders of the ten zones of the place of contact [m]: flange, flange root, seven of
the tread from the flange on, and the field side."""

SHARE = 0.95
"""Share of the wear of a zone whose quantile is limited [-]."""

REGIME_SHARE = 0.1
"""Largest difference of the share of a wear regime in the wear of a zone [-]."""


def zone_of(y: FloatArray) -> IntArray:
    """Zone of each lateral position [m], of any shape."""
    return np.asarray(np.digitize(y, ZONE_BORDERS), dtype=np.int64)


def by_zone(y: FloatArray, worn: FloatArray) -> FloatArray:
    """Sum what is worn at places y (p,) [m] by zone: (..., p) to (..., zones)."""
    of_place = zone_of(y)[:, None] == np.arange(len(ZONE_BORDERS) + 1)
    return np.asarray(worn @ of_place.astype(float))


def weighted_quantile(value: FloatArray, weight: FloatArray, share: float) -> float:
    """Quantile of values (m,) by their weight (m,); NaN without weight."""
    order = np.argsort(value, kind="stable")
    reached = np.cumsum(weight[order])
    if not reached.size or reached[-1] <= 0.0:
        return np.nan
    return float(
        value[order][np.searchsorted(reached, share * reached[-1] * (1.0 - 1e-12))]
    )


def zone_quantiles(y: FloatArray, value: FloatArray, wear: FloatArray) -> FloatArray:
    """Quantile of a value of patches in each zone, by their wear.

    Parameters
    ----------
    y : (m,) array
        Place of the patches on the wheel [m].
    value : (m,) array
        Such as the largest pressure [any unit].
    wear : (m,) array
        Worn area of each [any unit].

    Returns
    -------
    (zones,) array
        NaN in zones without wear.
    """
    zone = zone_of(y)
    return np.array(
        [
            weighted_quantile(value[zone == k], wear[zone == k], SHARE)
            for k in range(len(ZONE_BORDERS) + 1)
        ]
    )


def in_all_zones(limit: FloatArray) -> FloatArray:
    """Limit (zones,) of every zone: where the field has none, its largest one.

    A zone that the field does not wear may be worn within the tolerance, by contacts no
    more severe than those of the field elsewhere.
    """
    limited = np.isfinite(limit)
    if not limited.any():
        return limit
    return np.where(limited, limit, limit[limited].max())


def scaled(rows: FloatArray) -> FloatArray:
    """Rows (q, n) with a largest entry of 1, without those of zeros."""
    largest = np.abs(rows).max(axis=1, initial=0.0)
    return np.asarray(rows[largest > 0.0] / largest[largest > 0.0, None])


def extreme_rows(worn: FloatArray, value: FloatArray, limit: FloatArray) -> FloatArray:
    """Rows that keep the quantile of a value in each zone at or below a limit.

    Parameters
    ----------
    worn : (n, 2, zones) array
        Worn area of both wheels per distance by n candidates.
    value : (n, 2) array
        Of each wheel.
    limit : (zones,) array
        Largest quantile; NaN where there is no limit.

    Returns
    -------
    (zones with a limit, n) array
        Worn area above the limit, less the share of the whole that may be above it.
    """
    limited = np.isfinite(limit)
    above = value[:, :, None] > limit[limited]
    rows = (worn[:, :, limited] * (above - (1.0 - SHARE))).sum(axis=1)
    return np.asarray(rows.T)


def regime_rows(
    worn: FloatArray, share: FloatArray, within: float = REGIME_SHARE
) -> FloatArray:
    """Rows that keep the share of each wear regime in each zone near a given one.

    Parameters
    ----------
    worn : (n, regimes, zones) array
        Worn area of both wheels per distance by n candidates.
    share : (regimes, zones) array
        Shares to keep; NaN in zones without any.
    within : float
        Largest difference [-].

    Returns
    -------
    (rows, n) array
        Two rows for each regime and zone.
    """
    limited = np.isfinite(share).all(axis=0)
    part, whole = worn[:, :, limited], worn.sum(axis=1)[:, None, limited]
    low, high = share[:, limited] - within, share[:, limited] + within
    rows = np.concatenate([part - high * whole, low * whole - part], axis=1)
    return np.asarray(rows.reshape(len(worn), -1).T)
