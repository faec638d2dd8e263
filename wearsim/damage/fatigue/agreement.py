"""Agreement of fatigue laws by the normalised damage of each load cycle.

Damage of different laws has different meanings; what compares is how each law spreads
its damage over the same load cycles (or points of a profile) [1]_.

References
----------
.. [1] V. V. Krishna et al., Railway Engineering Science 30 (2022),
       doi:10.1007/s40534-021-00253-y.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wearsim.contact.patch import FloatArray


@dataclass(frozen=True)
class Agreement:
    """Agreement of fatigue laws over the same `n` cases.

    Parameters
    ----------
    laws : tuple of str
        Their names, in the order of the arrays.
    normalised : (laws, n) array
        Damage above zero over the largest of the law; zeros for a law without
        damage [-].
    overlap : (laws, laws) array
        Common part of the two distributions of damage over the cases: 1 where they are
        the same, 0 where no case has damage by both [-].
    """

    laws: tuple[str, ...]
    normalised: FloatArray
    overlap: FloatArray


def normalised(damage: FloatArray) -> FloatArray:
    """Damage (..., n) of n cases over the largest, zero if none is positive [-]."""
    above = np.maximum(damage, 0.0)
    largest = above.max(axis=-1, keepdims=True, initial=0.0)
    return above / np.where(largest > 0.0, largest, 1.0)


def agreement(
    damage: Mapping[str, FloatArray], weight: FloatArray | None = None
) -> Agreement:
    r"""Compare laws over the same cases.

    Parameters
    ----------
    damage : mapping of str to (n,) array
        Damage per passage, by law [-].
    weight : (n,) array, optional
        How often each case occurs; acts on the overlap.

    Returns
    -------
    Agreement
        Overlap :math:`\sum_i \min(p_i, q_i)` with shares p, q of the weighted damage
        that sum to 1; two laws without damage agree.
    """
    laws = tuple(damage)
    values = np.array([normalised(damage[law]) for law in laws])
    weighted = values if weight is None else values * weight
    total = weighted.sum(axis=1, keepdims=True)
    share = weighted / np.where(total > 0.0, total, 1.0)
    overlap = np.minimum(share[:, None, :], share[None, :, :]).sum(axis=2)
    none = total[:, 0] <= 0.0
    overlap = np.where(none[:, None] & none[None, :], 1.0, overlap)
    return Agreement(laws, values, overlap)
