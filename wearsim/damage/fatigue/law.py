"""The record of a fatigue law.

Its formula, and all that the rest of the package may ask of it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from wearsim.contact.patch import FloatArray
from wearsim.errors import Fault, SceneError

Branch = Literal["net", "rising"]
INDEX_QUANTITIES = ("fatigue_index", "fatigue_index_stress", "fatigue_index_force")
"""Quantities by which a law may judge: result files have a variable for each."""


@dataclass(frozen=True)
class FatigueDamage:
    """What one passage of each of `m` patches does.

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
        Name of the set it takes where none is asked for.
    parameters : tuple of str
        What it takes besides a set: "wear_number"; "shear_yield" (in place of that of
        the set); "damage_function" (break points of the user's own); "branch" and
        "crack_depth", of a law that contains the removal of cracks by wear and so has a
        net and a rising form.
    counts_cycles : bool
        Whether damage 1 is a crack; damage of the others orders passages and counts no
        cycles.
    """

    name: str
    damage: Callable[..., FatigueDamage]
    index_quantity: str
    coefficients: str
    parameters: tuple[str, ...]
    counts_cycles: bool = False

    def __post_init__(self) -> None:
        if self.index_quantity not in INDEX_QUANTITIES:
            known = ", ".join(INDEX_QUANTITIES)
            given = (
                f'fatigue law "{self.name}" has the index quantity '
                f"{self.index_quantity!r}"
            )
            raise SceneError([Fault(f"{given}; give one of {known}")])

    @property
    def contains_removal(self) -> bool:
        """Whether its net form contains the removal of cracks by wear."""
        return "branch" in self.parameters
