"""Wear laws: one file per published law, one registry."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from wearsim.contact.patch import FloatArray, IntArray, SurfaceFields
from wearsim.damage.coefficients import COEFFICIENT_SETS, CoefficientSet
from wearsim.damage.wear import none, usfd
from wearsim.damage.wear.law import FORMS, Form, WearLaw
from wearsim.errors import Fault, NumericalError, SceneError

WEAR_LAWS: dict[str, WearLaw] = {"usfd": usfd.depth, "none": none.depth}
WEAR_REGIMES: dict[str, tuple[str, ...]] = {"usfd": usfd.REGIMES, "none": none.REGIMES}


@dataclass(frozen=True)
class WearSettings:
    """Which wear law acts, with which numbers.

    Parameters
    ----------
    law : str
        Name in `WEAR_LAWS`.
    coefficients : str
        Name in `damage.coefficients.COEFFICIENT_SETS`.
    form : {"local", "patch_mean"}
        Whether the wear index is taken cell by cell or as its mean over the patch.
    density : float
        Of the wheel [kg/m3].
    """

    law: str = "usfd"
    coefficients: str = "lewis_dwyer_joyce_2004"
    form: Form = "local"
    density: float = 7850.0


def _unknown(what: str, name: str, known: Iterable[str]) -> SceneError:
    names = sorted(known)
    near = difflib.get_close_matches(name, names, n=1, cutoff=0.0)
    return SceneError(
        [Fault(f'{what} "{name}" is unknown; there is {", ".join(names)}; did you mean "{near[0]}"?')]
    )


def wear_law(name: str) -> WearLaw:
    """Return the law called `name`; an unknown name is told with what there is and the nearest.

    Raises
    ------
    SceneError
        For a name that is not in `WEAR_LAWS`.
    """
    if name not in WEAR_LAWS:
        raise _unknown("wear law", name, WEAR_LAWS)
    return WEAR_LAWS[name]


def coefficient_set(name: str, law: str) -> CoefficientSet:
    """Return the coefficient set called `name`, if it belongs to `law`.

    Raises
    ------
    SceneError
        For a name that is not in `COEFFICIENT_SETS`, or a set made for other laws. The law "none"
        takes any.
    """
    if name not in COEFFICIENT_SETS:
        raise _unknown("coefficient set", name, COEFFICIENT_SETS)
    found = COEFFICIENT_SETS[name]
    if law != "none" and law not in found.laws:
        fitting = sorted(key for key, known in COEFFICIENT_SETS.items() if law in known.laws)
        raise SceneError(
            [
                Fault(
                    f'coefficients = "{name}" belong to {", ".join(found.laws)}, not to law = "{law}"; '
                    f"take {', '.join(fitting) or 'another law'}"
                )
            ]
        )
    return found


def regimes(law: str) -> tuple[str, ...]:
    """Return the names of the wear regimes of `law`, in the order of its depths."""
    wear_law(law)
    return WEAR_REGIMES[law]


def passage_depth(fields: SurfaceFields, area: FloatArray, settings: WearSettings) -> FloatArray:
    """Depth removed by one passage of each patch, by the law of the settings.

    Parameters
    ----------
    fields : SurfaceFields
        On the cells of `m` patches.
    area : (m,) array
        Of the patches [m2].
    settings : WearSettings
        Law, coefficients, form, density.

    Returns
    -------
    (n_regimes, m, ny) array
        Depth along the surface normal [m].

    Raises
    ------
    SceneError
        For unknown names or a form that does not exist.
    NumericalError
        When a depth is not finite: the contact fields hold NaN or infinity.
    """
    if settings.form not in FORMS:
        raise _unknown("form of the wear law", settings.form, FORMS)
    law = wear_law(settings.law)
    coefficients = coefficient_set(settings.coefficients, settings.law)
    depth = law(fields, area, coefficients, form=settings.form, density=settings.density)
    bad = ~np.isfinite(depth).all(axis=(0, 2))
    if bad.any():
        raise NumericalError(
            f'wear law "{settings.law}" got contact fields that are not finite in '
            f"{int(bad.sum())} of {bad.size} patches (first: {int(np.argmax(bad))}); "
            "look at this operating point with the contact command"
        )
    return depth


def patch_regime(depth: FloatArray) -> IntArray:
    """Return the regime that removes most in each patch.

    Parameters
    ----------
    depth : (n_regimes, m, ny) array
        Depth per passage by regime [m].

    Returns
    -------
    (m,) int array
        Index into the regimes of the law; -1 where nothing wears.
    """
    by_regime = depth.sum(axis=2)  # strips of a patch are equally wide
    dominant: IntArray = np.argmax(by_regime, axis=0).astype(np.int64)
    dominant[by_regime.sum(axis=0) <= 0.0] = -1
    return dominant


def highest_regime(depth: FloatArray) -> IntArray:
    """Return the last regime, in the order of the law, in which any strip of each patch wears.

    Parameters
    ----------
    depth : (n_regimes, m, ny) array
        Depth per passage by regime [m].

    Returns
    -------
    (m,) int array
        Index into the regimes of the law; -1 where nothing wears. In the local form one cell in a regime
        is enough for it; in the form "patch_mean" a patch has one regime.
    """
    wears = (depth > 0.0).any(axis=2)
    index = np.arange(depth.shape[0])[:, None]
    highest: IntArray = np.where(wears, index, -1).max(axis=0).astype(np.int64)
    return highest


__all__ = [
    "FORMS",
    "WEAR_LAWS",
    "WEAR_REGIMES",
    "Form",
    "WearLaw",
    "WearSettings",
    "coefficient_set",
    "highest_regime",
    "passage_depth",
    "patch_regime",
    "regimes",
    "wear_law",
]
