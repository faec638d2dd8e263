"""Roots of falling functions, one per row, all rows iterated together."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.patch import FloatArray

_MOST_WIDENINGS, _MOST_STEPS = 12, 60


def falling_root(
    function: Callable[[FloatArray], FloatArray],
    first: FloatArray,
    step: FloatArray,
    *,
    goal: FloatArray,
    narrow: FloatArray,
    done: NDArray[np.bool_],
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Root of a function that falls with its argument, by regula falsi (Illinois), bracketed row by row.

    Parameters
    ----------
    function : callable
        Values (n,) at arguments (n,); a row's value depends on its own argument only.
    first, step : (n,) array
        Middle and half width of the first bracket; it is widened up to 4096 times where it holds no root.
    goal : (n,) array
        A row is done where the value's magnitude is at most this,
    narrow : (n,) array
        or its bracket at most this wide.
    done : (n,) bool array
        Rows that keep `first`.

    Returns
    -------
    root : (n,) array
        With the same bits whatever other rows are in the batch.
    found : (n,) bool array
        False where no bracket holds a root.
    """
    low, high = first - step, first + step
    above, below = function(low), function(high)
    for _ in range(_MOST_WIDENINGS):
        wide_low, wide_high = (above < 0.0) & ~done, (below > 0.0) & ~done
        if not (wide_low.any() or wide_high.any()):
            break
        step = 2.0 * step
        low = np.where(wide_low, low - step, low)
        high = np.where(wide_high, high + step, high)
        above = np.where(wide_low, function(low), above)
        below = np.where(wide_high, function(high), below)
    found = ((above >= 0.0) & (below <= 0.0)) | done
    root, last, done = first.copy(), np.zeros(first.size), done | ~found
    for _ in range(_MOST_STEPS):
        width = above - below
        flat = width <= 0.0
        share = np.where(flat, 0.5, above / np.where(flat, 1.0, width))
        # A row that is done keeps its root, so that it does not depend on its neighbours in the batch.
        root = np.where(done, root, low + share * (high - low))
        value = function(root)
        done |= (np.abs(value) <= goal) | (np.abs(high - low) <= narrow)
        if done.all():
            break
        rising = value > 0.0
        low, high = np.where(rising, root, low), np.where(rising, high, root)
        # Illinois: halve the value kept at the end that did not move twice in a row.
        below = np.where(rising, np.where(last > 0, 0.5 * below, below), value)
        above = np.where(rising, value, np.where(last < 0, 0.5 * above, above))
        last = np.where(rising, 1.0, -1.0)
    return root, found
