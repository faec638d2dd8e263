"""Comparison laws: wear and fatigue laws evaluated on the contacts of the active law.

They do not change the profile. Wear laws give a depth, fatigue laws a damage; both
accumulate at the vertices of the profile along the campaign of the active wear law.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from wearsim.campaign.state import State, WearRate
from wearsim.contact.patch import FloatArray
from wearsim.contact.solve import ContactSolution
from wearsim.damage import fatigue
from wearsim.damage.coefficients import CoefficientSet
from wearsim.damage.fatigue import (
    FATIGUE_LAWS,
    FatigueDamage,
    FatigueSettings,
    PatchLoads,
    passage_damage,
    patch_loads,
)
from wearsim.damage.fatigue.surface_fatigue import subsurface_index
from wearsim.damage.wear import WEAR_LAWS, WearSettings, coefficients_of, passage_depth
from wearsim.results import FILL_FLOAT

if TYPE_CHECKING:
    from wearsim.scene import CampaignSetup

_MPA = 1e6

SET_TEXTS: Mapping[str, Callable[[CoefficientSet], str]] = {
    "coefficients": lambda coefficients: coefficients.name,
    "source": lambda coefficients: coefficients.source,
    "warnings": lambda coefficients: "; ".join(coefficients.uncertain),
    "numbers": lambda coefficients: ", ".join(coefficients.numbers),
    "materials": lambda coefficients: coefficients.materials,
    "validity": lambda coefficients: coefficients.validity,
    "departures": lambda coefficients: " ".join(coefficients.departures),
}
"""Texts of a result file about a coefficient set."""

# static variables of the laws; the other data are attributes
_VARIABLES = (
    "coefficients",
    "source",
    "warnings",
)


@dataclass(frozen=True)
class ComparisonLaws:
    """Settings of the comparison laws."""

    wear: tuple[WearSettings, ...] = ()
    fatigue: tuple[FatigueSettings, ...] = ()
    active: WearSettings | None = (
        None  # active wear law, from whose name the others must differ
    )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of wear laws, with form and coefficient set if a law occurs twice."""
        every = [*self.wear, *([] if self.active is None else [self.active])]
        names = []
        for settings in self.wear:
            same = [variant for variant in every if variant.law == settings.law]
            form = (
                settings.form.replace("_", " ")
                if len({variant.form for variant in same}) > 1
                else ""
            )
            sets = {_set_name(variant) for variant in same}
            which = ", ".join(
                filter(None, [form, _set_name(settings) if len(sets) > 1 else ""])
            )
            names.append(f"{settings.law} ({which})" if which else settings.law)
        return tuple(names)

    @property
    def crack_depth(self) -> tuple[float, ...]:
        """Depth of a crack of damage 1 of each fatigue law [m].

        It is infinite where wear removes no damage.
        """
        return tuple(
            math.inf if settings.crack_depth is None else settings.crack_depth
            for settings in self.fatigue
        )


@dataclass(frozen=True)
class ComparisonPassage:
    """Depth and damage of one passage of each of `m` patches, by comparison law."""

    depth: tuple[
        tuple[FloatArray, ...], ...
    ] = ()  # (m, ny) by wear law and its regimes [m]
    damage: tuple[
        FloatArray, ...
    ] = ()  # (m, ny) by fatigue law at a place within the strip [-]
    # (m, ...) index and damage of each patch by fatigue law, by the names of a row of
    # the result file
    patches: dict[str, FloatArray] = field(default_factory=dict)


def comparison_laws(setup: CampaignSetup) -> ComparisonLaws:
    """Return the comparison laws of a campaign."""
    return ComparisonLaws(setup.also_evaluate, setup.fatigue, setup.wear)


def _set_name(settings: WearSettings) -> str:
    """Name of the set of a law, marked if its values are changed."""
    given = settings.coefficients
    name = given if isinstance(given, str) else given.name
    return f"{name}, changed" if settings.values or settings.scale != 1.0 else name


def comparison_passage(
    solution: ContactSolution, laws: ComparisonLaws
) -> ComparisonPassage:
    """Evaluate the comparison laws on every patch of a contact solution."""
    depth = tuple(
        tuple(passage_depth(solution.fields, solution.area, settings))
        for settings in laws.wear
    )
    if not laws.fatigue:
        return ComparisonPassage(depth)
    loads = patch_loads(solution)
    by_law = [passage_damage(loads, settings) for settings in laws.fatigue]
    damage = tuple(
        law_damage.strip_damage * law.crack_width
        for law_damage, law in zip(by_law, laws.fatigue, strict=True)
    )
    return ComparisonPassage(depth, damage, _patch_values(loads, by_law, laws))


def start_comparison(state: State, laws: ComparisonLaws) -> State:
    """Return the initial state, without depth and damage by the laws."""
    return replace(
        state,
        comparison_depth=tuple(np.zeros_like(state.y) for _ in laws.wear),
        comparison_area=np.zeros(
            (2, sum(len(WEAR_LAWS[settings.law].regimes) for settings in laws.wear))
        ),
        fatigue_damage=tuple(np.zeros_like(state.y) for _ in laws.fatigue),
    )


def static_comparison(laws: ComparisonLaws) -> dict[str, Any]:
    """Return static variables of a result file on the laws and their coefficients."""
    static: dict[str, Any] = {
        f"{group}_{key}": tuple(
            "" if coefficients is None else SET_TEXTS[key](coefficients)
            for coefficients in sets
        )
        for group, sets in _sets(laws).items()
        for key in _VARIABLES
    }
    if laws.wear:
        caps = [
            f", seizure cap {settings.seizure_cap}"
            if settings.seizure_cap != "none"
            else ""
            for settings in laws.wear
        ]
        static |= {
            "comparison_name": laws.names,
            "comparison_form": tuple(
                settings.form + cap
                for settings, cap in zip(laws.wear, caps, strict=True)
            ),
            "comparison_regime_name": tuple(
                f"{name}: {regime}"
                for name, settings in zip(laws.names, laws.wear, strict=True)
                for regime in WEAR_LAWS[settings.law].regimes
            ),
        }
    if laws.fatigue:
        sets = [fatigue.coefficients_of(settings) for settings in laws.fatigue]
        has_crack_depth = np.array(
            [settings.crack_depth is not None for settings in laws.fatigue]
        )
        wear_limit = np.array([settings.wear_limit for settings in laws.fatigue])
        static |= {
            "fatigue_name": tuple(settings.law for settings in laws.fatigue),
            "fatigue_form": tuple(_form(settings) for settings in laws.fatigue),
            "fatigue_crack_width": np.array(
                [settings.crack_width for settings in laws.fatigue]
            ),
            "fatigue_wear_limit": np.where(has_crack_depth, wear_limit, FILL_FLOAT),
            "fatigue_crack_depth": np.where(
                has_crack_depth, laws.crack_depth, FILL_FLOAT
            ),
            "fatigue_shear_yield": np.array(
                [
                    _MPA * coefficients["shear_yield"]
                    if "shear_yield" in coefficients.values
                    else FILL_FLOAT
                    for coefficients in sets
                ]
            ),
        }
    return static


def comparison_attributes(laws: ComparisonLaws) -> dict[str, str]:
    """Return the attributes of a result file on the coefficients of the laws.

    Each law has one line.
    """
    return {
        f"{group}_{key}": "\n".join(
            "" if coefficients is None else " ".join(text(coefficients).split("\n"))
            for coefficients in sets
        )
        for group, sets in _sets(laws).items()
        for key, text in SET_TEXTS.items()
        if key not in _VARIABLES
    }


def _sets(laws: ComparisonLaws) -> dict[str, list[CoefficientSet | None]]:
    """Coefficients of each law, by groups that have laws.

    None for the law without wear.
    """
    groups: dict[str, list[CoefficientSet | None]] = {
        "comparison": [
            coefficients_of(settings) if WEAR_LAWS[settings.law].wears else None
            for settings in laws.wear
        ],
        "fatigue": [fatigue.coefficients_of(settings) for settings in laws.fatigue],
    }
    return {group: sets for group, sets in groups.items() if sets}


def _form(settings: FatigueSettings) -> str:
    if not FATIGUE_LAWS[settings.law].contains_removal:
        return ""
    branch = {
        "net": "net form, with the removal of cracks by wear in its falling branch",
        "rising": "rising branch, removal of cracks by the wear of the campaign",
    }[settings.branch]
    return f"{branch}; wear number {settings.wear_number.replace('_', ' ')}"


def comparison_row(
    state: State, collective: WearRate, laws: ComparisonLaws
) -> dict[str, np.ndarray]:
    """Return the variables of one row by law along the profile.

    Their names are those of `wearsim.results.GROUPS`. `collective` is the rate of the
    active points in that state.
    """
    row: dict[str, np.ndarray] = {}
    if laws.wear:
        row["comparison_wear_depth"] = np.stack(state.comparison_depth, axis=1)
        row["comparison_worn_area"] = state.comparison_area
    if not laws.fatigue:
        return row
    row["fatigue_damage"] = np.stack(state.fatigue_damage, axis=1)
    row["fatigue_damage_rate"] = rates = np.stack(collective.fatigue, axis=1)
    row["wear_depth_rate"] = collective.depth
    has_crack_depth = np.isfinite(laws.crack_depth)[:, None]
    depth = np.where(has_crack_depth, np.array(laws.crack_depth)[:, None], 0.0)
    row["magic_wear_rate"] = np.where(
        has_crack_depth, rates * depth, FILL_FLOAT
    )  # see `damage.fatigue.balance`
    return row


def _patch_values(
    loads: PatchLoads, damage: Sequence[FatigueDamage], laws: ComparisonLaws
) -> dict[str, FloatArray]:
    """Return index and damage of each patch (m, ...) by the fatigue laws.

    They are arranged in the slots of a row.
    """
    missing = np.full(loads.area.shape, FILL_FLOAT)
    quantities = [FATIGUE_LAWS[law.law].index_quantity for law in laws.fatigue]

    def index(quantity: str) -> FloatArray:
        pairs = zip(damage, quantities, strict=True)
        return np.stack(
            [
                law_damage.index if name == quantity else missing
                for law_damage, name in pairs
            ],
            axis=1,
        )

    return {
        "fatigue_damage_passage": np.stack(
            [law_damage.damage for law_damage in damage], axis=1
        ),
        **{
            name: index(name)
            for name in dict.fromkeys(
                law.index_quantity for law in FATIGUE_LAWS.values()
            )
        },
        "fatigue_index_y": np.stack(
            [law_damage.index_y for law_damage in damage], axis=1
        ),
        "subsurface_fatigue_index": subsurface_index(
            loads.utilised_friction, loads.max_pressure
        ),
    }
