"""Lists of far more points than a profile needs, brought down to what the shape asks for."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wearsim.profile.shape import FloatArray, arc_length

MOST_POINTS = 20_000
"""Lists up to here are taken as they are; 160 mm of profile are then 8 um from point to point."""

_TOLERANCE = 0.1e-6  # points left out lie closer to the chords than this, where so few suffice [m]
_NOISE = 1e-6  # usual distances above this are noise, of which no extremes are picked [m]
_CORNER = 5.0  # times the noise stands out as a corner
_COARSE = 2000
_ROUNDS = 12


def thinned(y: FloatArray, z: FloatArray) -> tuple[NDArray[np.intp], float]:
    """Points that carry the shape of a long list.

    Parameters
    ----------
    y, z : (n,) array
        Points along the profile [m].

    Returns
    -------
    kept : (m,) array of int
        Indices of the points that stay, both ends among them.
    deviation : float
        Largest distance of a point left out from the chord that bridges it [m].

    Notes
    -----
    Half of `MOST_POINTS` are spread evenly over the arc length. Then, round by round, the point furthest off
    joins every chord it is too far from, the worst chords first, until none is or the number is used up:
    corners and chamfers keep their points. Of noise the even points are as good as any; its extremes, taken
    on purpose, would double it.
    """
    count = len(y)
    if count <= MOST_POINTS:
        return np.arange(count), 0.0
    # along a coarse path, for the path from point to point is mostly noise and would pick its extremes
    coarse = np.unique(np.append(np.arange(0, count, count // _COARSE), count - 1))
    s = np.interp(np.arange(count), coarse, arc_length(y[coarse], z[coarse]))
    even = np.searchsorted(s, np.linspace(0.0, s[-1], MOST_POINTS // 2))
    kept = np.unique(np.concatenate([[0], np.minimum(even, count - 1), [count - 1]]))
    for _ in range(_ROUNDS):
        worst, off = _furthest(y, z, kept)
        usual = float(np.median(off))
        far = np.flatnonzero(off > (_TOLERANCE if usual < _NOISE else _CORNER * usual))
        room = MOST_POINTS - len(kept)
        if len(far) == 0 or room == 0:
            break
        far = far[np.argsort(-off[far], kind="stable")[:room]]
        kept = np.unique(np.concatenate([kept, worst[far]]))
    return kept, float(_furthest(y, z, kept)[1].max())


def _furthest(y: FloatArray, z: FloatArray, kept: NDArray[np.intp]) -> tuple[NDArray[np.intp], FloatArray]:
    """Index and distance [m] of the point furthest off each chord between neighbours that are kept."""
    chord = np.repeat(np.arange(len(kept) - 1), np.diff(kept))  # of every point but the last
    at = np.arange(len(chord))
    start, end = kept[:-1][chord], kept[1:][chord]
    dy, dz = y[end] - y[start], z[end] - z[start]
    from_y, from_z = y[at] - y[start], z[at] - z[start]
    # to the chord itself, beyond its ends to its end points
    along = np.clip((from_y * dy + from_z * dz) / np.maximum(dy**2 + dz**2, 1e-300), 0.0, 1.0)
    off = np.hypot(from_y - along * dy, from_z - along * dz)
    order = np.lexsort((off, chord))
    last = np.append(np.flatnonzero(np.diff(chord[order])), len(order) - 1)
    worst = order[last]
    return worst, off[worst]
