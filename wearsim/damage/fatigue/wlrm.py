r"""Damage function of the Whole Life Rail Model: damage of a passage over T-gamma.

Straight lines [1]_: no damage up to a first wear number, rising to a peak, falling to
zero, and beyond that below zero, because wear removes more than cracks grow. The
falling branch contains the removal of cracks by wear. Two uses are right: the function
as it is ("net") without any further removal, or its rising branch, which stays at the
peak ("rising"), with the removal computed from the wear of the campaign. Both together
would count the wear twice: `damage.fatigue` raises an error.

References
----------
.. [1] M. Burstow, Whole Life Rail Model application and development for RSSB, AEA
       Technology 2003-2004.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.patch import FloatArray
from wearsim.damage.coefficients.record import CoefficientSet, given_set
from wearsim.damage.fatigue.law import Branch, FatigueDamage, FatigueLaw
from wearsim.damage.fatigue.loads import (
    WEAR_NUMBERS,
    PatchLoads,
    WearNumber,
    work_share,
)
from wearsim.errors import Fault, SceneError


def damage_function(
    wear_number: FloatArray, coefficients: CoefficientSet, branch: Branch = "net"
) -> FloatArray:
    """Damage of one passage of the Whole Life Rail Model, over T-gamma [-].

    Parameters
    ----------
    wear_number : (...) array
        T-gamma [N].
    coefficients : CoefficientSet
        Break points `start`, `peak`, `end` [N], `peak_damage` [-], and `floor` [-] if
        the damage stops falling.
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
    return (
        np.maximum(net, coefficients["floor"])
        if "floor" in coefficients.values
        else net
    )


def own_function(
    *, source: str, certainty: str, **given: float | None
) -> CoefficientSet:
    """Return user-defined break points of the law "wlrm", for wheels and other steels.

    The wear numbers start, peak and end [N] must rise, else a SceneError is raised.
    `peak_damage` [-] is reached at the peak; `floor` [-], if given, is the lowest
    damage beyond the end. Source and certainty state the origin of the numbers.
    """
    numbers = {name: value for name, value in given.items() if value is not None}
    start, peak, end = (numbers[name] for name in ("start", "peak", "end"))
    if not 0.0 <= start < peak < end:
        points = f"start_N = {start:g}, peak_N = {peak:g} and end_N = {end:g}"
        raise SceneError([Fault(f"damage_function: {points} must rise; change them")])
    units = {"peak_damage": "-", "floor": "-"}
    values = {name: (value, units.get(name, "N")) for name, value in numbers.items()}
    validity = f"As given by the user. Certainty: {certainty}."
    return given_set("damage_function", "wlrm", values, source, validity, certainty)


def damage(
    loads: PatchLoads,
    coefficients: CoefficientSet,
    *,
    wear_number: WearNumber = "without_spin",
    branch: Branch = "net",
) -> FatigueDamage:
    """Damage of one passage by `damage_function`, see `FatigueLaw`.

    Strips share the damage in proportion to their frictional work.

    The index is the wear number [N], at the strip of the most frictional work.
    """
    index = WEAR_NUMBERS[wear_number](loads)
    share = work_share(loads)
    passage = damage_function(index, coefficients, branch)
    return FatigueDamage(
        index, loads.y_of_largest(share), passage, passage[:, None] * share
    )


WLRM = FatigueLaw(
    "wlrm",
    damage,
    index_quantity="fatigue_index_force",
    coefficients="burstow_2004",
    parameters=("wear_number", "branch", "crack_depth", "damage_function"),
    counts_cycles=True,
    title="WLRM",
)
