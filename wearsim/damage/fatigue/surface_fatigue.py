r"""Fatigue index of the surface: utilised friction against the shakedown limit.

Above the limit :math:`\mu_u = k/p_0` of the shakedown map the surface flows a little in
each passage, until it cracks [1]_. The index :math:`FI = \mu_u - k/p_0` [2]_ is the
distance to that limit in the map's direction of friction; k is the yield stress in
cyclic shear. Cell by cell it becomes :math:`(|\tau| - k)/p`, which needs no ellipse and
shows where in the patch.

The damage of a passage is the part of the index above zero: it orders passages, it
counts no cycles to failure.

References
----------
.. [1] K. L. Johnson, Proc. IMechE Part C 203 (1989) 151-163.
.. [2] A. Ekberg, E. Kabo, H. Andersson, FFEMS 25 (2002) 899-909.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from wearsim.contact.patch import FloatArray
from wearsim.damage.coefficients.record import CoefficientSet
from wearsim.damage.fatigue.law import FatigueDamage, FatigueLaw
from wearsim.damage.fatigue.loads import PatchLoads, work_share
from wearsim.damage.wear.sliding import share_of

_MPA = 1e6


def surface_index(
    utilised_friction: FloatArray, max_pressure: FloatArray, shear_yield: float
) -> FloatArray:
    r"""Surface fatigue index, :math:`FI = \mu_u - k/p_0` [-].

    Parameters
    ----------
    utilised_friction : (...) array
        Shear over normal force [-].
    max_pressure : (...) array
        p0, above 0 [Pa].
    shear_yield : float
        k [Pa].

    Returns
    -------
    (...) array
        Above 0 the surface ratchets [-].
    """
    return utilised_friction - shear_yield / max_pressure


def subsurface_index(
    utilised_friction: FloatArray, max_pressure: FloatArray
) -> FloatArray:
    r"""Subsurface fatigue index, :math:`p_0 (1 + \mu_u^2)/6` [Pa].

    Parameters
    ----------
    utilised_friction : (...) array
        Shear over normal force [-].
    max_pressure : (...) array
        p0 [Pa].

    Returns
    -------
    (...) array
        Shear stress, to be compared with the user's equivalent shear limit of Dang Van
        [Pa].

    Notes
    -----
    For an elliptic patch :math:`p_0/6 = N/(4\pi a b)` [2]_. The term of the residual
    stress is not included.
    """
    return max_pressure / 6.0 * (1.0 + utilised_friction**2)


def patch(loads: PatchLoads, coefficients: CoefficientSet) -> FatigueDamage:
    """Damage of one passage by the patch form, see `FatigueLaw`.

    The index is that of the whole patch, reported at the strip of the highest pressure.
    Strips share the damage in proportion to their frictional work.
    """
    index = surface_index(
        loads.utilised_friction, loads.max_pressure, _MPA * coefficients["shear_yield"]
    )
    damage = np.maximum(index, 0.0)
    place = loads.y_of_largest(loads.fields.pressure.max(axis=1))
    return FatigueDamage(index, place, damage, damage[:, None] * work_share(loads))


def local(loads: PatchLoads, coefficients: CoefficientSet) -> FatigueDamage:
    r"""Damage of one passage by the local form, see `FatigueLaw`.

    The index is the largest :math:`(|\tau| - k)/p` of the cells.

    The damage of the patch is that of its worst cell, spread over the strips as their
    own largest indices above zero.
    """
    fields = loads.fields
    excess = (
        np.sqrt(fields.shear_x**2 + fields.shear_y**2)
        - _MPA * coefficients["shear_yield"]
    )
    loaded = ~(fields.pressure <= 0.0)
    cells = np.where(loaded, excess / np.where(loaded, fields.pressure, 1.0), -np.inf)
    strips = cells.max(axis=1)
    index = strips.max(axis=1)
    damage = np.maximum(index, 0.0)
    share = share_of(np.maximum(strips, 0.0), fields)
    return FatigueDamage(
        index, loads.y_of_largest(strips), damage, damage[:, None] * share
    )


SURFACE_FATIGUE_INDEX = FatigueLaw(
    "surface_fatigue_index",
    patch,
    index_quantity="fatigue_index",
    coefficients="ekberg_kabo_andersson_2002",
    parameters=("shear_yield",),
)

SURFACE_FATIGUE_INDEX_LOCAL = replace(
    SURFACE_FATIGUE_INDEX, name="surface_fatigue_index_local", damage=local
)
