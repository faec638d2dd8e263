"""Fatigue laws: one file per published law, one registry."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from dataclasses import fields as dataclass_fields

import numpy as np

from wearsim.contact.patch import FloatArray, SurfaceFields
from wearsim.damage.coefficients import FATIGUE_SETS, CoefficientSet
from wearsim.damage.fatigue import stress_index, surface_fatigue, wlrm
from wearsim.damage.fatigue.law import Branch, FatigueDamage, FatigueLaw
from wearsim.damage.fatigue.loads import WEAR_NUMBERS, PatchLoads, WearNumber, patch_loads
from wearsim.errors import Fault, NumericalError, SceneError

FATIGUE_LAWS: dict[str, FatigueLaw] = {
    "stress_index": stress_index.law,
    "surface_fatigue_index": surface_fatigue.patch,
    "surface_fatigue_index_local": surface_fatigue.local,
    "wlrm": wlrm.law,
}
INDEX_QUANTITIES: dict[str, str] = {
    "stress_index": "fatigue_index_stress",
    "surface_fatigue_index": "fatigue_index",
    "surface_fatigue_index_local": "fatigue_index",
    "wlrm": "fatigue_index_force",
}
"""Quantity of `wearsim.quantities`, with its unit, that the index is by which each law judges a patch."""

DEFAULT_COEFFICIENTS: dict[str, str] = {
    "stress_index": "dirks_enblom_2011",
    "surface_fatigue_index": "ekberg_kabo_andersson_2002",
    "surface_fatigue_index_local": "ekberg_kabo_andersson_2002",
    "wlrm": "burstow_2004",
}
"""Set each law takes where none is asked for."""

_CHUNK = 16  # patches; their cells fit the cache

BRANCHES: tuple[Branch, ...] = ("net", "rising")
CONTAIN_REMOVAL = ("wlrm",)
"""Laws whose function contains the removal of cracks by wear, and so has a net and a rising form."""
COUNT_CYCLES = ("wlrm",)
"""Laws of which damage 1 is a crack; the others order passages and count no cycles to it."""


@dataclass(frozen=True)
class FatigueSettings:
    """Which fatigue law acts, with which numbers.

    Parameters
    ----------
    law : str
        Name in `FATIGUE_LAWS`.
    coefficients : str or CoefficientSet
        Name in `damage.coefficients.FATIGUE_SETS`, or a set of one's own.
    wear_number : {"without_spin", "with_spin"}
        Which wear number a law of T-gamma takes.
    branch : {"net", "rising"}
        Of a law that contains the removal of cracks by wear: with it, or without.
    crack_depth : float, optional
        Depth of a crack of damage 1; given, the wear of the campaign removes damage [m].
    crack_width : float
        Width of profile over which the damage of a passage counts as that of one place: damage at a point
        is the damage per width times this [m].
    wear_limit : float
        Depth that may wear, against which cracks are weighed where there is a crack depth [m].
    """

    law: str = "surface_fatigue_index"
    coefficients: str | CoefficientSet = "ekberg_kabo_andersson_2002"
    wear_number: WearNumber = "without_spin"
    branch: Branch = "net"
    crack_depth: float | None = None
    crack_width: float = 10e-3
    wear_limit: float = 3e-3


def default_settings(law: str, **changes: object) -> FatigueSettings:
    """Return the settings of a law with its own set.

    Parameters
    ----------
    law : str
        Name in `FATIGUE_LAWS`.
    **changes
        Other fields of `FatigueSettings`.
    """
    if law not in FATIGUE_LAWS:
        raise SceneError([_unknown("fatigue law", law, FATIGUE_LAWS)])
    return FatigueSettings(law=law, **{"coefficients": DEFAULT_COEFFICIENTS[law], **changes})  # type: ignore[arg-type]


def _unknown(what: str, name: str, known: Iterable[str]) -> Fault:
    names = sorted(known)
    near = difflib.get_close_matches(name, names, n=1, cutoff=0.0)
    return Fault(f'{what} "{name}" is unknown; there is {", ".join(names)}; did you mean "{near[0]}"?')


def acting_coefficients(settings: FatigueSettings) -> CoefficientSet:
    """Return the numbers that act under some settings, and check that the settings fit together.

    Parameters
    ----------
    settings : FatigueSettings
        Law, coefficients, branch, removal.

    Returns
    -------
    CoefficientSet
        Of the settings.

    Raises
    ------
    SceneError
        All faults: unknown names, and removal of cracks counted twice or not at all.
    """
    law, name = settings.law, settings.coefficients
    faults: list[Fault] = []
    if law not in FATIGUE_LAWS:
        faults.append(_unknown("fatigue law", law, FATIGUE_LAWS))
    if settings.wear_number not in WEAR_NUMBERS:
        faults.append(_unknown("wear_number", settings.wear_number, WEAR_NUMBERS))
    if settings.branch not in BRANCHES:
        faults.append(_unknown("branch", settings.branch, BRANCHES))
    found = name if isinstance(name, CoefficientSet) else FATIGUE_SETS.get(name)
    if found is None:
        faults.append(_unknown("coefficient set of fatigue laws", str(name), FATIGUE_SETS))
    elif law in FATIGUE_LAWS and law not in found.laws:
        fitting = ", ".join(sorted(key for key, known in FATIGUE_SETS.items() if law in known.laws))
        told = f'coefficients = "{found.name}" belong to {", ".join(found.laws)}, not to law = "{law}"'
        faults.append(Fault(f"{told}; take {fitting}"))
    faults.extend(_removal_faults(settings))
    if faults or found is None:
        raise SceneError(faults)
    return found


def _removal_faults(settings: FatigueSettings) -> list[Fault]:
    law, depth = settings.law, settings.crack_depth
    faults = []
    if law in CONTAIN_REMOVAL:
        if settings.branch == "net" and depth is not None:
            told = f'law = "{law}" contains the removal of cracks by wear in its falling branch'
            faults.append(
                Fault(f'{told}; delete crack_depth, or write branch = "rising": both would count wear twice')
            )
        if settings.branch == "rising" and depth is None:
            told = f'law = "{law}" with branch = "rising" needs the removal of cracks by wear'
            faults.append(Fault(f'{told}; give crack_depth, or write branch = "net"'))
    elif law in FATIGUE_LAWS:
        if settings.branch != "net":
            told = f'branch = "{settings.branch}" acts with law = "{", ".join(CONTAIN_REMOVAL)}" only'
            faults.append(Fault(f"{told}; delete it"))
        if depth is not None:
            told = f'crack_depth: the damage of law = "{law}" orders passages and is no share of a crack'
            faults.append(Fault(f"{told}; delete it"))
    if depth is not None and not 1e-6 <= depth <= 0.1:
        faults.append(Fault(f"crack_depth = {1e3 * depth:g} mm must be from 0.001 to 100 mm"))
    if not 1e-4 <= settings.crack_width <= 0.2:
        faults.append(Fault(f"crack_width = {1e3 * settings.crack_width:g} mm must be from 0.1 to 200 mm"))
    return faults


def _parts(loads: PatchLoads) -> Iterator[PatchLoads]:
    """Yield the loads of a few patches at a time: laws make several copies of the cells."""
    for start in range(0, max(loads.area.size, 1), _CHUNK):
        part = slice(start, start + _CHUNK)
        cells = {f.name: getattr(loads.fields, f.name)[part] for f in dataclass_fields(loads.fields)}
        resultants = {
            f.name: getattr(loads, f.name)[part] for f in dataclass_fields(loads) if f.name != "fields"
        }
        yield PatchLoads(**resultants, fields=SurfaceFields(**cells))


def _joined(parts: Sequence[FatigueDamage]) -> FatigueDamage:
    """Put the patches of several parts behind one another."""
    names = [f.name for f in dataclass_fields(FatigueDamage)]
    return FatigueDamage(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})


def passage_damage(loads: PatchLoads, settings: FatigueSettings) -> FatigueDamage:
    """Damage of one passage of each patch, by the law of the settings.

    Parameters
    ----------
    loads : PatchLoads
        Of `m` patches, see `patch_loads`.
    settings : FatigueSettings
        Law, coefficients, branch, wear number.

    Returns
    -------
    FatigueDamage
        Index, place, damage, and damage per width by strip.

    Raises
    ------
    SceneError
        For settings that do not fit together.
    NumericalError
        When an index is not finite: the contact fields hold NaN or infinity, or a patch carries nothing.
    """
    coefficients = acting_coefficients(settings)
    fields = loads.fields
    cells = (fields.pressure, fields.shear_x, fields.shear_y, fields.work_density)
    good = (loads.normal_force > 0.0) & (loads.max_pressure > 0.0)
    for field in cells:
        good &= np.isfinite(field).all(axis=(1, 2))
    law = FATIGUE_LAWS[settings.law]
    with np.errstate(divide="ignore", invalid="ignore"):
        found = _joined(
            [
                law(part, coefficients, wear_number=settings.wear_number, branch=settings.branch)
                for part in _parts(loads)
            ]
        )
    bad = ~(good & np.isfinite(found.index) & np.isfinite(found.strip_damage).all(axis=1))
    if bad.any():
        raise NumericalError(
            f'fatigue law "{settings.law}" got contact fields that are not finite, or carry no load, in '
            f"{int(bad.sum())} of {bad.size} patches (first: {int(np.argmax(bad))}); "
            "look at this operating point with the contact command"
        )
    return found


def passage_damages(loads: PatchLoads, settings: Sequence[FatigueSettings]) -> tuple[FatigueDamage, ...]:
    """Damage of one passage of each patch by several laws, on the same contact solution.

    Parameters
    ----------
    loads : PatchLoads
        Of `m` patches.
    settings : sequence of FatigueSettings
        One for each law.

    Returns
    -------
    tuple of FatigueDamage
        For each of the settings.
    """
    return tuple(passage_damage(loads, each) for each in settings)


def damage_at_points(per_width: FloatArray, settings: FatigueSettings) -> FloatArray:
    """Damage at points of a profile from damage per width.

    Parameters
    ----------
    per_width : (...) array
        Strip damage carried to the profile [1/m].
    settings : FatigueSettings
        For the width that counts as one place.

    Returns
    -------
    (...) array
        [-].
    """
    return per_width * settings.crack_width


__all__ = [
    "BRANCHES",
    "CONTAIN_REMOVAL",
    "COUNT_CYCLES",
    "DEFAULT_COEFFICIENTS",
    "FATIGUE_LAWS",
    "INDEX_QUANTITIES",
    "WEAR_NUMBERS",
    "Branch",
    "FatigueDamage",
    "FatigueLaw",
    "FatigueSettings",
    "PatchLoads",
    "WearNumber",
    "acting_coefficients",
    "damage_at_points",
    "default_settings",
    "passage_damage",
    "passage_damages",
    "patch_loads",
]
