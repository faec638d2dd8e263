r"""The damage function of the Whole Life Rail Model: damage of a passage as a function of T-gamma.

Straight lines [1]_: no damage up to a first wear number, rising to a peak, falling to zero, and beyond that
below zero, because wear removes more than cracks grow. The falling branch contains the removal of cracks by
wear. Two uses are right: the function as it is ("net") without any further removal, or its rising branch,
which stays at the peak ("rising"), with the removal computed from the wear of the campaign. Both together
would count the wear twice: `damage.fatigue` raises an error.

References
----------
.. [1] M. Burstow, Whole Life Rail Model application and development for RSSB, AEA Technology 2003-2004.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.patch import FloatArray
from wearsim.damage.coefficients.record import Coefficient, CoefficientSet
from wearsim.damage.fatigue.law import Branch, FatigueDamage, FatigueLaw
from wearsim.damage.fatigue.loads import WEAR_NUMBERS, PatchLoads, WearNumber, work_share
from wearsim.errors import Fault, SceneError


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


def own_function(
    *,
    start: float,
    peak: float,
    end: float,
    peak_damage: float,
    source: str,
    certainty: str,
    floor: float | None = None,
) -> CoefficientSet:
    """Return break points of one's own for the law "wlrm", for wheels and other steels.

    The wear numbers [N] must rise, else a SceneError is raised. `floor` is the lowest damage beyond `end`;
    None: it falls on [-]. Source and certainty say where the numbers come from and how sure they are.
    """
    if not 0.0 <= start < peak < end:
        points = f"start_N = {start:g}, peak_N = {peak:g} and end_N = {end:g}"
        raise SceneError([Fault(f"damage_function: {points} must rise; change them")])
    numbers = {"start": start, "peak": peak, "end": end, "peak_damage": peak_damage}
    numbers |= {} if floor is None else {"floor": floor}
    units = {"peak_damage": "-", "floor": "-"}
    return CoefficientSet(
        name="damage_function",
        laws=("wlrm",),
        materials="as given",
        source=source,
        validity=f"As given by the user. Certainty: {certainty}.",
        departures=(),
        values={
            name: Coefficient(value, units.get(name, "N"), source, "given") for name, value in numbers.items()
        },
        certainty=certainty,
    )


def damage(
    loads: PatchLoads,
    coefficients: CoefficientSet,
    *,
    wear_number: WearNumber = "without_spin",
    branch: Branch = "net",
) -> FatigueDamage:
    """Damage of a passage, see `FatigueLaw`, by `damage_function`; the strips share it as frictional work.

    The index is the wear number [N], at the strip of the most frictional work.
    """
    index = WEAR_NUMBERS[wear_number](loads)
    share = work_share(loads)
    passage = damage_function(index, coefficients, branch)
    return FatigueDamage(index, loads.y_of_largest(share), passage, passage[:, None] * share)


WLRM = FatigueLaw(
    "wlrm",
    damage,
    index_quantity="fatigue_index_force",
    coefficients="burstow_2004",
    parameters=("wear_number", "branch", "crack_depth", "damage_function"),
    counts_cycles=True,
)
