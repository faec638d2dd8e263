r"""Stress index: the largest local shear stress above the yield stress in shear.

Index of the patch :math:`\max |\tau| - k` over its cells [1]_. The damage of a passage
is the excess over k where it is positive, shared by the strips as their frictional
work; it orders passages and counts no cycles.

References
----------
.. [1] B. Dirks, R. Enblom, Wear 271 (2011) 210-217.
"""

from __future__ import annotations

import numpy as np

from wearsim.damage.coefficients.record import CoefficientSet
from wearsim.damage.fatigue.law import FatigueDamage, FatigueLaw
from wearsim.damage.fatigue.loads import PatchLoads, work_share

_MPA = 1e6


def damage(loads: PatchLoads, coefficients: CoefficientSet) -> FatigueDamage:
    """Damage of one passage [-], see `FatigueLaw`.

    It is the index [Pa] divided by the yield stress, where positive.
    """
    shear_yield = _MPA * coefficients["shear_yield"]
    fields = loads.fields
    strips = np.sqrt((fields.shear_x**2 + fields.shear_y**2).max(axis=1))
    index = strips.max(axis=1) - shear_yield
    passage = np.maximum(index, 0.0) / shear_yield
    return FatigueDamage(
        index, loads.y_of_largest(strips), passage, passage[:, None] * work_share(loads)
    )


STRESS_INDEX = FatigueLaw(
    "stress_index",
    damage,
    index_quantity="fatigue_index_stress",
    coefficients="dirks_enblom_2011",
    parameters=("shear_yield",),
)
