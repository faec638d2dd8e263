"""Fatigue laws: one record for each published law, one registry.

Every `FatigueLaw` at the top of a module of this folder is registered.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from wearsim.contact.registry import Registry, discover
from wearsim.contact.wheels import joined
from wearsim.damage.batches import batches, require_usable
from wearsim.damage.coefficients import coefficient_set
from wearsim.damage.coefficients.record import CoefficientSet
from wearsim.damage.fatigue.law import Branch, FatigueDamage, FatigueLaw
from wearsim.damage.fatigue.loads import (
    WEAR_NUMBERS,
    PatchLoads,
    WearNumber,
    patch_loads,
)
from wearsim.errors import Fault, PluginError
from wearsim.quantities import QUANTITIES

FATIGUE_LAWS: Registry[FatigueLaw] = discover(
    "fatigue law",
    __name__,
    __path__,
    FatigueLaw,
    group="wearsim.fatigue_laws",
    function="damage",
    returns=FatigueDamage,
)
BRANCHES: tuple[Branch, ...] = ("net", "rising")


@dataclass(frozen=True)
class FatigueSettings:
    """Fatigue law with its coefficients.

    Parameters
    ----------
    law : str
        Name in `FATIGUE_LAWS`.
    coefficients : str or CoefficientSet
        Name in `damage.coefficients.COEFFICIENT_SETS`, or a user's set.
    wear_number : {"without_spin", "with_spin"}
        Which wear number a law of T-gamma takes.
    branch : {"net", "rising"}
        Of a law that contains the removal of cracks by wear: with it, or without.
    crack_depth : float, optional
        Depth of a crack of damage 1; given, the wear of the campaign removes
        damage [m].
    crack_width : float
        Width of profile over which the damage of a passage counts as that of one place:
        damage at a point is the damage per width times this [m].
    wear_limit : float
        Depth that may wear, against which cracks are weighed where there is a crack
        depth [m].
    """

    law: str = "surface_fatigue_index"
    coefficients: str | CoefficientSet = "ekberg_kabo_andersson_2002"
    wear_number: WearNumber = "without_spin"
    branch: Branch = "net"
    crack_depth: float | None = None
    crack_width: float = 10e-3
    wear_limit: float = 3e-3


def coefficients_of(settings: FatigueSettings) -> CoefficientSet:
    """Return the coefficients in force under some settings.

    Raises
    ------
    SceneError
        All faults: unknown names, and removal of cracks counted twice or not at all.
    """
    law = FATIGUE_LAWS[settings.law]
    faults = [
        Fault(f'{name} = "{getattr(settings, name)}" must be {" or ".join(choices)}')
        for name, choices in (
            ("wear_number", tuple(WEAR_NUMBERS)),
            ("branch", BRANCHES),
        )
        if getattr(settings, name) not in choices
    ]
    faults += _removal_faults(law, settings)
    for name, value in (
        ("crack_depth", settings.crack_depth),
        ("crack_width", settings.crack_width),
    ):
        if value is not None and (
            fault := QUANTITIES[f"fatigue_{name}"].fault(value, name)
        ):
            faults.append(Fault(fault))
    return coefficient_set(settings.coefficients, law.name, faults)


def counts_cycles(name: str) -> bool:
    """Return True if damage 1 by a law means a crack; False for an unknown law."""
    return name in FATIGUE_LAWS and FATIGUE_LAWS[name].counts_cycles


def _removal_faults(law: FatigueLaw, settings: FatigueSettings) -> Iterator[Fault]:
    depth, branch = settings.crack_depth, settings.branch
    if law.contains_removal:
        if branch == "net" and depth is not None:
            yield Fault(
                f'law = "{law.name}" contains the removal of cracks by wear in its '
                'falling branch; delete crack_depth or write branch = "rising": both '
                "would count wear twice"
            )
        if branch == "rising" and depth is None:
            yield Fault(
                f'law = "{law.name}" with branch = "rising" needs the removal of '
                'cracks by wear; give crack_depth, or write branch = "net"'
            )
        return
    if branch != "net":
        yield Fault(
            f'branch = "{branch}" acts with law = {FATIGUE_LAWS.that_take("branch")} '
            "only; delete it"
        )
    if depth is not None and not law.counts_cycles:
        yield Fault(
            f'crack_depth: the damage of law = "{law.name}" orders passages and is no '
            "share of a crack; delete it"
        )


def passage_damage(loads: PatchLoads, settings: FatigueSettings) -> FatigueDamage:
    """Damage of one passage of each patch, by the law of the settings.

    Raises
    ------
    SceneError
        For settings that do not fit together.
    NumericalError
        When an index is not finite: the contact fields hold NaN or infinity, or a patch
        carries nothing.
    """
    law = FATIGUE_LAWS[settings.law]
    coefficients = coefficients_of(settings)
    taken = {
        name: getattr(settings, name)
        for name in ("wear_number", "branch")
        if name in law.parameters
    }
    good = (loads.normal_force > 0.0) & (loads.max_pressure > 0.0)
    for name in ("pressure", "shear_x", "shear_y", "work_density"):
        good &= np.isfinite(getattr(loads.fields, name)).all(axis=(1, 2))
    with np.errstate(divide="ignore", invalid="ignore"):
        parts = [
            law.damage(part, coefficients, **taken)
            for part in batches(loads, loads.area.size)
        ]
    for part in parts:
        if (
            part.strip_damage.ndim != 2
            or not part.index.shape == part.index_y.shape == part.damage.shape
        ):
            raise PluginError(
                f'fatigue law "{law.name}" gives arrays that do not fit each other'
            )
    passage: FatigueDamage = joined(parts)
    if passage.strip_damage.shape != loads.fields.cell_length.shape:
        shapes = f"{passage.strip_damage.shape}, not {loads.fields.cell_length.shape}"
        raise PluginError(
            f'fatigue law "{law.name}" gives damage {shapes}: patches, strips'
        )
    bad = ~(
        good
        & np.isfinite(passage.index)
        & np.isfinite(passage.strip_damage).all(axis=1)
    )
    require_usable(
        f'fatigue law "{settings.law}"', bad, "not finite, or carry no load,"
    )
    return passage


__all__ = [
    "BRANCHES",
    "FATIGUE_LAWS",
    "WEAR_NUMBERS",
    "Branch",
    "FatigueDamage",
    "FatigueLaw",
    "FatigueSettings",
    "PatchLoads",
    "WearNumber",
    "coefficients_of",
    "counts_cycles",
    "passage_damage",
    "patch_loads",
]
