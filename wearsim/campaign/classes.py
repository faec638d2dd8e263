"""Classes of operating points, and the cheapest contact models for each that together are good enough.

A load collective has many points that do little work: how well they are solved hardly matters to what wears.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from wearsim.contact.patch import FloatArray, IntArray

CLASSES = ("least", "minor", "major", "leading")
"""Classes by the work of their points. Those that only monitor are solved as closely as the leading ones."""

EDGES = (0.1, 0.3, 0.6)
"""Shares of the work that the points of the first class do at most, those of the first two, and so on."""


def point_classes(work: FloatArray, weight: FloatArray) -> IntArray:
    """Sort operating points into classes by the share of the work that they do.

    Parameters
    ----------
    work : (n,) array
        Frictional work of each point per distance [J/m].
    weight : (n,) array
        Shares of the distance.

    Returns
    -------
    (n,) int array
        Place in `CLASSES`: the points of least weighted work are of the first one as long as they together
        do at most the first share of `EDGES`, the next ones of the second, and so on. Points without weight
        lead, and all do where none works.
    """
    share = work * weight
    order = np.argsort(share, kind="stable")
    summed = np.cumsum(share[order])
    found = np.full(share.size, len(EDGES), dtype=np.int64)
    if summed[-1] > 0.0:
        found[order] = np.searchsorted(EDGES, summed / summed[-1], side="left")
        found[weight <= 0.0] = len(EDGES)
    return found


def cheapest(
    difference: FloatArray, cost: Sequence[float], count: Sequence[int], bound: float
) -> tuple[tuple[int, ...], float]:
    """Find the models of each class that are cheapest together and keep a bound.

    Parameters
    ----------
    difference : (k, c, ...) array
        Of what class c adds by candidate k from what it adds by a reference; infinite where it refuses.
    cost : (k,) sequence of float
        Of one solution by each candidate, rising.
    count : (c,) sequence of int
        Operating points of each class, which are in order of rising work.
    bound : float
        Of the largest sum of the differences over the classes.

    Returns
    -------
    tuple of int
        Candidate of each class, never one before that of the class before it: the more work, the better
        the models, so that no class makes up for the error of another by chance.
    float
        Largest sum of their differences.

    Raises
    ------
    ValueError
        If none keeps the bound: the reference has to be among the candidates.
    """
    candidates, classes = difference.shape[:2]

    def price(chosen: tuple[int, ...]) -> float:
        return sum(cost[k] * number for k, number in zip(chosen, count, strict=True))

    rising = itertools.combinations_with_replacement(range(candidates), classes)
    for chosen in sorted(rising, key=price):
        error = float(np.abs(sum(difference[k, c] for c, k in enumerate(chosen))).max())
        if error <= bound:
            return chosen, error
    raise ValueError("no candidate keeps the bound")
