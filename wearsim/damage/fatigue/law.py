"""Record of a fatigue law: its formula and the properties used by other modules."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from wearsim.contact.patch import FloatArray
from wearsim.errors import Fault, SceneError

Branch = Literal["net", "rising"]
INDEX_QUANTITIES = ("fatigue_index", "fatigue_index_stress", "fatigue_index_force")
"""Quantities that may be the index of a law: result files have a variable for each."""


@dataclass(frozen=True)
class FatigueDamage:
    """Damage done by one passage of each of `m` patches.

    Parameters
    ----------
    index : (m,) array
        Index of the patch, the quantity `FatigueLaw.index_quantity`; above its limit
        there is damage.
    index_y : (m,) array
        Lateral position on the wheel profile of the strip where the index is
        largest [m].
    damage : (m,) array
        Of the passage [-].
    strip_damage : (m, ny) array
        The same per width of the strips [1/m]: its integral over the width is the
        damage, so that it is carried to profile coordinates as wear depth is.
    """

    index: FloatArray
    index_y: FloatArray
    damage: FloatArray
    strip_damage: FloatArray


@dataclass(frozen=True)
class FatigueLaw:
    """A fatigue law.

    Parameters
    ----------
    name : str
        Key in `FATIGUE_LAWS`, in scenes and results.
    damage : callable
        ``damage(loads, coefficients)`` -> `FatigueDamage` of one passage of each patch,
        from its `PatchLoads` and a `CoefficientSet`. Settings among `parameters` named
        "wear_number" and "branch" are keywords.
    index_quantity : str
        Name and unit of the index, of `INDEX_QUANTITIES`.
    coefficients : str
        Name of the default coefficient set.
    parameters : tuple of str
        Inputs besides a set: "wear_number"; "shear_yield" (in place of that of the
        set); "damage_function" (break points of the user); "branch" and "crack_depth",
        of a law that contains the removal of cracks by wear and therefore has a net and
        a rising form.
    counts_cycles : bool
        True if damage 1 is a crack. Damage of the other laws orders passages and counts
        no cycles.
    title : str
        Name in texts, by default `name` with blanks.
    """

    name: str
    damage: Callable[..., FatigueDamage]
    index_quantity: str
    coefficients: str
    parameters: tuple[str, ...]
    counts_cycles: bool = False
    title: str = ""

    def __post_init__(self) -> None:
        if self.index_quantity not in INDEX_QUANTITIES:
            quantities = ", ".join(INDEX_QUANTITIES)
            given = (
                f'fatigue law "{self.name}" has the index quantity '
                f"{self.index_quantity!r}"
            )
            raise SceneError([Fault(f"{given}; give one of {quantities}")])

    @property
    def contains_removal(self) -> bool:
        """True if the net form of the law contains the removal of cracks by wear."""
        return "branch" in self.parameters
