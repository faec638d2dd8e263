"""Own laws and models: registration by a script, and which of them a campaign uses.

Installed packages state theirs as entry points (`Registry`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from wearsim.contact.normal import NORMAL_MODELS, NormalModel
from wearsim.contact.problem import ContactModels
from wearsim.contact.registry import Registry
from wearsim.contact.tangential import TANGENTIAL_MODELS, TangentialModel
from wearsim.damage.coefficients import COEFFICIENT_SETS, CoefficientSet
from wearsim.damage.fatigue import FATIGUE_LAWS, FatigueLaw, FatigueSettings
from wearsim.damage.wear import WEAR_LAWS, WearSettings
from wearsim.damage.wear.law import WearLaw
from wearsim.errors import Fault, SceneError, brief

_REGISTRIES: dict[type, Registry[Any]] = {
    WearLaw: WEAR_LAWS,
    FatigueLaw: FATIGUE_LAWS,
    NormalModel: NORMAL_MODELS,
    TangentialModel: TANGENTIAL_MODELS,
    CoefficientSet: COEFFICIENT_SETS,
}

Registered = tuple[tuple[Any, str], ...]
"""Records that a script registered, and their sources."""
_registered: dict[tuple[type, str], tuple[Any, str]] = {}


def register(*records: Any, source: str = "registered in Python") -> None:
    """Add laws, models and coefficient sets of one's own.

    For scenes and all functions of this process.

    A record replaces an earlier one of the same name, but none that is shipped. The
    command line knows those of installed packages alone: a package names its records as
    entry points of the groups `wearsim.wear_laws`, `wearsim.fatigue_laws`,
    `wearsim.normal_models`, `wearsim.tangential_models` and `wearsim.coefficient_sets`,
    each under its own name.

    Parameters
    ----------
    *records : WearLaw, FatigueLaw, NormalModel, TangentialModel or CoefficientSet
        What each must have stands in the documentation of its class.
    source : str
        Name and version of what they are from: results and reports state it.

    Raises
    ------
    SceneError
        For anything else, the name of a shipped record, or a function that cannot be
        called.

    Examples
    --------
    >>> import wearsim
    >>> def depth(fields, area, coefficients, *, form):
    ...     return coefficients["k"] * fields.strip_work[None]
    >>> wearsim.register(
    ...     wearsim.WearLaw("by_work", depth, regimes=("all",), coefficients="own_tests"),
    ...     wearsim.CoefficientSet(
    ...         "own_tests", laws=("by_work",), materials="ER7 on R260", source="own tests", validity="dry",
    ...         departures=(), values={"k": wearsim.Coefficient(1e-12, "m3 J-1", "own tests", "given")},
    ...     ),
    ...     source="own_laws 1.0",
    ... )
    >>> wearsim.WEAR_LAWS["by_work"].regimes
    ('all',)
    """
    for record in records:
        kind = next((kind for kind in _REGISTRIES if isinstance(record, kind)), None)
        if kind is None:
            kinds = ", ".join(kind.__name__ for kind in _REGISTRIES)
            raise SceneError(
                [
                    Fault(
                        f"{brief(repr(record))} cannot be registered; give one of "
                        f"{kinds}"
                    )
                ]
            )
        _REGISTRIES[kind].add(record, source)
        _registered[kind, record.name] = record, source


def registered() -> Registered:
    """All records that this process registered, for `register_all` in another one."""
    return tuple(_registered.values())


def register_all(records: Registered) -> None:
    """Register what another process has registered."""
    for record, source in records:
        register(record, source=source)


def plug_ins_of(
    models: ContactModels,
    wear: Sequence[WearSettings],
    fatigue: Sequence[FatigueSettings],
) -> dict[str, str]:
    """List what a campaign uses that is not shipped, with sources."""
    sets = [settings.coefficients for settings in wear] + [
        settings.coefficients for settings in fatigue
    ]
    names: list[tuple[Registry[Any], str]] = [
        (NORMAL_MODELS, models.normal),
        (TANGENTIAL_MODELS, models.tangential),
        *((WEAR_LAWS, settings.law) for settings in wear),
        *((FATIGUE_LAWS, settings.law) for settings in fatigue),
        *(
            (
                COEFFICIENT_SETS,
                coefficients if isinstance(coefficients, str) else coefficients.name,
            )
            for coefficients in sets
        ),
    ]
    return {
        f"{registry.kind} {name}": source
        for registry, name in names
        if (source := registry.source_of(name))
    }
