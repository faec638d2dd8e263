r"""The damage function of the Whole Life Rail Model: damage of a passage as a function of T-gamma.

Straight lines [1]_: no damage up to a first wear number, rising to a peak, falling to zero, and beyond that
below zero, because wear removes more than cracks grow. The falling branch contains the removal of cracks by
wear. Two uses are right: the function as it is ("net") without any further removal, or its rising branch,
which stays at the peak ("rising"), with the removal computed from the wear of the campaign. Both together
would count the wear twice and are refused by `damage.fatigue`.

References
----------
.. [1] M. Burstow, Whole Life Rail Model application and development for RSSB, AEA Technology 2003-2004.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.patch import FloatArray
from wearsim.damage.coefficients import CoefficientSet
from wearsim.damage.fatigue.law import Branch, FatigueDamage
from wearsim.damage.fatigue.loads import WEAR_NUMBERS, PatchLoads, WearNumber, work_share


def damage_function(
    wear_number: FloatArray, coefficients: CoefficientSet, branch: Branch = "net"
) -> FloatArray:
    """Damage of one passage.

    Parameters
    ----------
    wear_number : (...) array
        T-gamma [N].
    coefficients : CoefficientSet
        Break points `start`, `peak`, `end` [N], `peak_damage` [-], and `floor` [-] if the damage stops
        falling.
    branch : {"net", "rising"}
        As it is, or rising to the peak and staying there.

    Returns
    -------
    (...) array
        [-]; in the net form negative beyond `end`, unless there is a floor.
    """
    start, peak, end = (coefficients[name] for name in ("start", "peak", "end"))
    top = coefficients["peak_damage"]
    rising = top * np.clip((wear_number - start) / (peak - start), 0.0, 1.0)
    if branch == "rising":
        return rising
    falling = top * (wear_number - peak) / (end - peak)
    net: FloatArray = np.where(wear_number > peak, top - falling, rising)
    return np.maximum(net, coefficients["floor"]) if "floor" in coefficients.values else net


def law(
    loads: PatchLoads,
    coefficients: CoefficientSet,
    *,
    wear_number: WearNumber = "without_spin",
    branch: Branch = "net",
) -> FatigueDamage:
    """Damage of each patch, shared by the frictional work of its strips.

    Parameters
    ----------
    loads : PatchLoads
        Of `m` patches.
    coefficients : CoefficientSet
        See `damage_function`.
    wear_number : {"without_spin", "with_spin"}
        Classical sum of force times creepage, or frictional work per metre.
    branch : {"net", "rising"}
        See `damage_function`.

    Returns
    -------
    FatigueDamage
        Index: the wear number [N], at the strip of the most frictional work.
    """
    index = WEAR_NUMBERS[wear_number](loads)
    share = work_share(loads)
    damage = damage_function(index, coefficients, branch)
    place: FloatArray = np.take_along_axis(loads.y, share.argmax(axis=1)[:, None], axis=1)[:, 0]
    return FatigueDamage(index, place, damage, damage[:, None] * share)
