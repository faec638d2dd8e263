"""Wear of contact patches by zone of the wheel profile."""

from __future__ import annotations

import numpy as np

from wearsim.contact.patch import FloatArray
from wearsim.profile.worn import ZONE_BORDERS
from wearsim.results import FILL_FLOAT


def zone_shares(edges: FloatArray, area: FloatArray) -> FloatArray:
    """Share of each of `WHEEL_ZONES` in the worn area of patches (m, zones) [-].

    Parameters
    ----------
    edges : (m, ny + 1) array
        Lateral position of the edges of the strips [m].
    area : (m, ny) array
        Worn by each strip, in any unit.

    Returns
    -------
    (m, zones) array
        A strip on a border is divided by its width on either side; fill values where
        nothing wears.
    """
    low = np.minimum(edges[:, :-1], edges[:, 1:])
    width = np.maximum(np.abs(np.diff(edges, axis=1)), np.finfo(float).tiny)
    total = area.sum(axis=1)
    cumulated = [np.zeros_like(total)]
    for border in ZONE_BORDERS:
        cumulated.append((area * np.clip((border - low) / width, 0.0, 1.0)).sum(axis=1))
    part = np.diff(np.stack([*cumulated, total], axis=1), axis=1)
    wears = total[:, None] > 0.0
    return np.where(wears, part / np.where(wears, total[:, None], 1.0), FILL_FLOAT)
