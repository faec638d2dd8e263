"""What every fatigue law takes and gives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

from wearsim.contact.patch import FloatArray
from wearsim.damage.coefficients import CoefficientSet
from wearsim.damage.fatigue.loads import PatchLoads, WearNumber

Branch = Literal["net", "rising"]


@dataclass(frozen=True)
class FatigueDamage:
    """What one passage of each of `m` patches does.

    Parameters
    ----------
    index : (m,) array
        What the law judges the patch by, as `INDEX_QUANTITIES` says; above its limit there is damage.
    index_y : (m,) array
        Lateral position on the wheel profile of the strip where the index is largest [m].
    damage : (m,) array
        Of the passage [-].
    strip_damage : (m, ny) array
        The same per width of the strips [1/m]: its integral over the width is the damage, so that it is
        carried to profile coordinates as wear depth is.
    """

    index: FloatArray
    index_y: FloatArray
    damage: FloatArray
    strip_damage: FloatArray


class FatigueLaw(Protocol):
    """Damage of one passage of each patch."""

    def __call__(
        self,
        loads: PatchLoads,
        coefficients: CoefficientSet,
        *,
        wear_number: WearNumber = "without_spin",
        branch: Branch = "net",
    ) -> FatigueDamage:
        """Return index and damage of `m` patches.

        Parameters
        ----------
        loads : PatchLoads
            Of `m` patches.
        coefficients : CoefficientSet
            Numbers of the law.
        wear_number : {"without_spin", "with_spin"}
            Which wear number laws of T-gamma take.
        branch : {"net", "rising"}
            Of laws that contain the removal of cracks by wear: with it, or without.
        """
        ...
