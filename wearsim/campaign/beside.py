"""Laws that act on the same contacts beside the leading wear law, and change no profile.

Further wear laws tell what they would have worn, fatigue laws the damage they add. Each is carried to the
vertices of the profile as wear is, and accumulates there along the campaign that the leading law drives.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from wearsim.campaign.state import State, WearRate
from wearsim.contact.patch import FloatArray
from wearsim.contact.solve import ContactSolution
from wearsim.damage import fatigue
from wearsim.damage.coefficients import CoefficientSet
from wearsim.damage.fatigue import (
    INDEX_QUANTITIES,
    WEAR_NUMBERS,
    FatigueDamage,
    FatigueSettings,
    damage_at_points,
    passage_damages,
    patch_loads,
)
from wearsim.damage.fatigue.balance import balance
from wearsim.damage.fatigue.surface_fatigue import subsurface_index
from wearsim.damage.wear import WearSettings, acting_coefficients, passage_depths, regimes
from wearsim.results import FILL_FLOAT, FILL_INT

if TYPE_CHECKING:
    from wearsim.scene import CampaignSetup

_MPA = 1e6
_TOLD: Mapping[str, Callable[[CoefficientSet], str]] = {
    "numbers": lambda found: ", ".join(found.numbers),
    "materials": lambda found: found.materials,
    "validity": lambda found: found.validity,
    "departures": lambda found: " ".join(found.departures),
}
"""What a result file says of a coefficient set in attributes of its group."""


@dataclass(frozen=True)
class LawsBeside:
    """Settings of the laws beside the leading one.

    Parameters
    ----------
    wear : tuple of WearSettings
        Wear laws.
    fatigue : tuple of FatigueSettings
        Fatigue laws.
    leading : WearSettings, optional
        The leading wear law, from which the names of the others tell them apart.
    """

    wear: tuple[WearSettings, ...] = ()
    fatigue: tuple[FatigueSettings, ...] = ()
    leading: WearSettings | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the wear laws: with form and set, where the same law acts with other ones, too."""
        every = [*self.wear, *([] if self.leading is None else [self.leading])]
        found = []
        for one in self.wear:
            same = [other for other in every if other.law == one.law]
            form = one.form.replace("_", " ") if len({other.form for other in same}) > 1 else ""
            sets = {_set_name(other) for other in same}
            told = ", ".join(filter(None, [form, _set_name(one) if len(sets) > 1 else ""]))
            found.append(f"{one.law} ({told})" if told else one.law)
        return tuple(found)

    @property
    def crack_depth(self) -> tuple[float, ...]:
        """Depth of a crack of damage 1 of each fatigue law, infinite where wear removes no damage [m]."""
        return tuple(math.inf if one.crack_depth is None else one.crack_depth for one in self.fatigue)


@dataclass(frozen=True)
class PassageBeside:
    """What one passage of each of `m` patches is by the laws beside the leading one.

    Parameters
    ----------
    depth : tuple of (n_regimes, m, ny) arrays
        Depth by each wear law and its regimes [m].
    damage : tuple of (m, ny) arrays
        Damage by each fatigue law at a place the strip passes over [-].
    patches : tuple of FatigueDamage
        The same with index and damage of the whole patch.
    """

    depth: tuple[FloatArray, ...] = ()
    damage: tuple[FloatArray, ...] = ()
    patches: tuple[FatigueDamage, ...] = ()


def laws_beside(setup: CampaignSetup) -> LawsBeside:
    """Return the laws beside the leading one of a campaign."""
    return LawsBeside(setup.beside, setup.fatigue, setup.wear)


def _set_name(settings: WearSettings) -> str:
    return settings.coefficients if isinstance(settings.coefficients, str) else settings.coefficients.name


def passage_beside(solution: ContactSolution, laws: LawsBeside) -> PassageBeside:
    """Evaluate the laws beside the leading one on a contact solution.

    Parameters
    ----------
    solution : ContactSolution
        With `m` patches.
    laws : LawsBeside
        Settings of the laws.

    Returns
    -------
    PassageBeside
        Of every patch.
    """
    patches = passage_damages(patch_loads(solution), laws.fatigue) if laws.fatigue else ()
    return PassageBeside(
        depth=passage_depths(solution.fields, solution.area, laws.wear),
        damage=tuple(
            damage_at_points(one.strip_damage, law) for one, law in zip(patches, laws.fatigue, strict=True)
        ),
        patches=patches,
    )


def start_beside(state: State, laws: LawsBeside) -> State:
    """Return the initial state with nothing worn and no damage by any of the laws."""
    return replace(
        state,
        beside_depth=tuple(np.zeros_like(state.y) for _ in laws.wear),
        beside_area=np.zeros((2, sum(len(regimes(one.law)) for one in laws.wear))),
        fatigue_damage=tuple(np.zeros_like(state.y) for _ in laws.fatigue),
    )


def static_beside(laws: LawsBeside) -> dict[str, Any]:
    """Return the static variables of a result file that tell the laws."""
    found: dict[str, Any] = {}
    if laws.wear:
        sets = [acting_coefficients(one) if one.law != "none" else None for one in laws.wear]
        found |= {
            "comparison_name": laws.names,
            "comparison_coefficients": tuple("" if one is None else one.name for one in sets),
            "comparison_source": tuple("" if one is None else one.source for one in sets),
            "comparison_warnings": tuple("" if one is None else "; ".join(one.doubts) for one in sets),
            "comparison_form": tuple(
                one.form + (f", seizure cap {one.seizure_cap}" if one.seizure_cap != "none" else "")
                for one in laws.wear
            ),
            "comparison_regime_name": tuple(
                f"{name}: {regime}"
                for name, one in zip(laws.names, laws.wear, strict=True)
                for regime in regimes(one.law)
            ),
        }
    if laws.fatigue:
        numbers = [fatigue.acting_coefficients(one) for one in laws.fatigue]
        found |= {
            "fatigue_name": tuple(one.law for one in laws.fatigue),
            "fatigue_coefficients": tuple(one.name for one in numbers),
            "fatigue_source": tuple(one.source for one in numbers),
            "fatigue_warnings": tuple("; ".join(one.doubts) for one in numbers),
            "fatigue_form": tuple(_form(one) for one in laws.fatigue),
            "fatigue_crack_width": np.array([one.crack_width for one in laws.fatigue]),
            "fatigue_wear_limit": np.array(
                [FILL_FLOAT if one.crack_depth is None else one.wear_limit for one in laws.fatigue]
            ),
            "fatigue_crack_depth": np.array(
                [FILL_FLOAT if one.crack_depth is None else one.crack_depth for one in laws.fatigue]
            ),
            "fatigue_shear_yield": np.array(
                [_MPA * one["shear_yield"] if "shear_yield" in one.values else FILL_FLOAT for one in numbers]
            ),
        }
    return found


def attributes_beside(laws: LawsBeside) -> dict[str, str]:
    """Return the attributes of a result file with what the numbers of the laws are: one line for each law.

    Numbers that act, materials and tests they are for, departures from the source.
    """
    groups: dict[str, list[CoefficientSet | None]] = {
        "comparison": [None if one.law == "none" else acting_coefficients(one) for one in laws.wear],
        "fatigue": [fatigue.acting_coefficients(one) for one in laws.fatigue],
    }
    return {
        f"{group}_{key}": "\n".join("" if one is None else " ".join(told(one).split("\n")) for one in sets)
        for group, sets in groups.items()
        if sets
        for key, told in _TOLD.items()
    }


def _form(settings: FatigueSettings) -> str:
    if settings.law not in fatigue.CONTAIN_REMOVAL:
        return ""
    branch = {
        "net": "net form, with the removal of cracks by wear in its falling branch",
        "rising": "rising branch, removal of cracks by the wear of the campaign",
    }[settings.branch]
    return f"{branch}; wear number {settings.wear_number.replace('_', ' ')}"


def row_beside(state: State, collective: WearRate, laws: LawsBeside) -> dict[str, np.ndarray]:
    """Return the variables of one row that belong to the laws and stand along the profile.

    Parameters
    ----------
    state : State
        Both wheels.
    collective : WearRate
        In that state under the weights of the full collective.
    laws : LawsBeside
        Settings of the laws.

    Returns
    -------
    dict of arrays
        As the groups of `wearsim.results.GROUPS` name them [SI units].
    """
    row: dict[str, np.ndarray] = {}
    if laws.wear:
        row["comparison_wear_depth"] = np.stack(state.beside_depth, axis=1)
        row["comparison_worn_area"] = state.beside_area
    if not laws.fatigue:
        return row
    row["fatigue_damage"] = np.stack(state.fatigue_damage, axis=1)
    row["fatigue_damage_rate"] = rates = np.stack(collective.fatigue, axis=1)
    row["wear_depth_rate"] = collective.depth
    balanced = np.full(rates.shape, FILL_FLOAT)
    limited = np.full(rates.shape, FILL_INT, dtype=np.int32)
    for k, law in enumerate(laws.fatigue):
        if law.crack_depth is not None:
            found = balance(
                rates[:, k], collective.depth, crack_depth=law.crack_depth, wear_limit=law.wear_limit
            )
            balanced[:, k], limited[:, k] = found.balanced_wear, found.limited_by
    return row | {"magic_wear_rate": balanced, "life_limited_by": limited}


def patch_values(
    solution: ContactSolution, passage: PassageBeside, laws: LawsBeside
) -> Mapping[str, FloatArray]:
    """Return what the fatigue laws make of each patch (m, ...), for the slots of a row.

    Parameters
    ----------
    solution : ContactSolution
        With `m` patches.
    passage : PassageBeside
        Of them.
    laws : LawsBeside
        Settings of the laws.
    """
    if not passage.patches:
        return {}
    loads = patch_loads(solution)
    missing = np.full(loads.area.shape, FILL_FLOAT)
    indices = {
        name: np.stack(
            [
                one.index if INDEX_QUANTITIES[law.law] == name else missing
                for one, law in zip(passage.patches, laws.fatigue, strict=True)
            ],
            axis=1,
        )
        for name in dict.fromkeys(INDEX_QUANTITIES.values())
    }
    return {
        "fatigue_damage_passage": np.stack([one.damage for one in passage.patches], axis=1),
        **indices,
        "fatigue_index_y": np.stack([one.index_y for one in passage.patches], axis=1),
        "subsurface_fatigue_index": subsurface_index(loads.utilised_friction, loads.max_pressure),
        **{f"wear_number_{name}": number(loads) for name, number in WEAR_NUMBERS.items()},
    }
