"""Operating points that lie between others, alike but for their lateral shift.

Where the contact moves by a small share of its width from one shift to another, what the reference changes
at both holds for the points between them, in proportion to the shift. The points at both ends are others each
time, so that every point is solved itself in turn, and lie alike on both sides of the middle: a mirrored
collective has mirrored ones.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from wearsim.campaign.evaluate import Passage
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.operation.points import OperatingPoints

_MOVED = 0.15
"""Largest distance between the contacts of two ends, over their width."""

_MOST, _FIRST = 4, 2
"""Points from one end to the other at most, where the difference is known and where it is not."""


def between(
    passage: Passage,
    points: OperatingPoints,
    among: NDArray[np.bool_],
    known: NDArray[np.bool_],
    turn: IntArray,
) -> tuple[IntArray, FloatArray]:
    """Return the points between which each point lies.

    Parameters
    ----------
    passage : Passage
        Of the fast models at the `n` points.
    points : OperatingPoints
        All of them; where shifts follow from forces, each is solved itself.
    among, known : (n,) bool array
        Points that are asked for, and those whose difference is known.
    turn : (n,) int array
        How often each was asked for.

    Returns
    -------
    ends : (n, 2) int array
        Itself twice for points to be solved.
    share : (n,) array
        Of the second one [-].
    """
    count, contact = among.size, passage.contact
    ends, share, shift = np.arange(2 * count).reshape(-1, 2) // 2, np.zeros(count), points.conditions.shift
    if points.controlled is not None:
        return ends, share
    others = [
        one.reshape(count, -1).T
        for name, one in vars(points.conditions).items()
        if isinstance(one, np.ndarray) and name not in ("shift", "nearby")
    ]
    others += [points.of_class[None], points.environment[None], known[None]]
    alike = np.unique(np.vstack(others), axis=1, return_inverse=True)[1].ravel()
    first, behind = (np.searchsorted(contact.point, np.arange(count), side) for side in ("left", "right"))
    sort = np.stack([contact.side, passage.model])

    def near(one: int, other: int) -> bool:
        """Whether two points have the same patches, about at the same places."""
        a, b = slice(first[one], behind[one]), slice(first[other], behind[other])
        if alike[one] != alike[other] or not np.array_equal(sort[:, a], sort[:, b]):
            return False
        away = np.abs(contact.wheel_y[a] - contact.wheel_y[b])
        return bool((away <= _MOVED * np.minimum(contact.width[a], contact.width[b])).all())

    order = np.lexsort((shift, alike))
    order = order[among[order] & (behind > first)[order]]
    apart = [not near(*pair) for pair in itertools.pairwise(order)]
    for run in np.split(order, np.flatnonzero(apart) + 1):
        if run.size < 3:
            continue
        most = _MOST if known[run[0]] else min(_FIRST, _MOST)
        from_middle = np.abs(2 * np.arange(run.size) - run.size + 1) // 2
        chosen = (from_middle + turn[run].max()) % most == 0
        chosen[[0, -1]] = True
        if 2 * from_middle[chosen].min() + 1 - run.size % 2 > most:
            chosen |= from_middle == 0
        pairs = list(itertools.pairwise(np.flatnonzero(chosen).tolist()))
        for one, other in pairs:
            inner, both = run[one + 1 : other], run[[one, other]]
            if inner.size > 0 and near(*both):
                ends[inner] = both
                way = shift[both[1]] - shift[both[0]]
                share[inner] = (shift[inner] - shift[both[0]]) / way if way > 0.0 else 0.0
            elif inner.size > 0:  # too far from each other: what lies in the middle is an end, too
                middle, after = (one + other) // 2, (one + other + 1) // 2
                pairs += [(one, middle), (after, other)]
    return ends, share
