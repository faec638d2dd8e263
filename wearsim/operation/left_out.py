"""Operating points without a contact solution: the share of the wear they carry, and who acts for them."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.patch import FloatArray, IntArray

LARGEST_SHARE = 0.01
"""Of the wear, that operating points without a contact solution may carry together."""


def mask_of(failed: Iterable[int], count: int) -> NDArray[np.bool_]:
    """Return which of `count` points are among those that failed."""
    mask: NDArray[np.bool_] = np.isin(np.arange(count), list(failed))
    return mask


def shared_weight(weight: FloatArray, of_class: IntArray, out: NDArray[np.bool_]) -> FloatArray:
    """Share the weight (n,) of the points `out` (n,) among the others of their class, in proportion.

    A class or block that is out as a whole has no weight: its distance passes without wear, so that the error
    is the wear it carries, however long it is.
    """
    if not out.any():
        return weight
    kept = np.where(out, 0.0, weight)
    whole, left = (np.bincount(of_class, one) for one in (weight, kept))
    factor = np.divide(whole, left, out=np.zeros_like(whole), where=left > 0.0)
    shared: FloatArray = kept * factor[of_class]
    return shared


def carried_share(weight: FloatArray, of_class: IntArray, rate: FloatArray, out: NDArray[np.bool_]) -> float:
    """Share of the wear that the points `out` (n,) carry together.

    Parameters
    ----------
    weight : (n,) array
        Shares of the distance, times the environment factors.
    of_class : (n,) int array
        Number of the class or block of each point.
    rate : (n,) array
        Worn area per distance of each point alone, of those that are out the last one known; NaN where none
        is: the largest rate of the class then stands for it, that of all points if the class has none [m2/m].
    out : (n,) bool array
        Points without a contact solution.

    Returns
    -------
    float
        Of the larger one of what these points wore and what the others of their class wear in their place
        [-]. By the weights where nothing wears.
    """
    if not (weight[out] > 0.0).any():
        return 0.0
    known = np.isfinite(rate)
    if not known.any() or not rate[known].any():
        return float(weight[out].sum() / weight.sum())
    largest = np.full(int(of_class.max()) + 1, -np.inf)
    np.maximum.at(largest, of_class[known], rate[known])
    largest = np.where(largest >= 0.0, largest, rate[known].max())
    worn = weight * np.where(known, rate, largest[of_class])
    instead = shared_weight(weight, of_class, out) - np.where(out, 0.0, weight)
    lost = np.bincount(of_class, np.where(out, worn, 0.0))
    added = np.bincount(of_class, np.where(out, 0.0, instead * np.where(known, rate, 0.0)))
    return float(np.maximum(lost, added).sum() / worn.sum())
