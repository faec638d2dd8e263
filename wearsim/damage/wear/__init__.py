"""Wear laws: one record and one file per published law.

Every `WearLaw` at the top of a module of this folder is registered.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from wearsim.contact.patch import FloatArray, IntArray, SurfaceFields
from wearsim.contact.registry import Registry, discover
from wearsim.damage.batches import batches, require_usable
from wearsim.damage.coefficients import coefficient_set
from wearsim.damage.coefficients.record import CoefficientSet, given_set
from wearsim.damage.wear.archard import SEIZURE_CAPS, SeizureCap
from wearsim.damage.wear.law import Form, WearLaw
from wearsim.damage.within_cells import within_cells
from wearsim.errors import Fault, PluginError, SceneError, raise_any

GIVEN_VALUE = "as given in [wear.values]"
"""Place of a value that replaces a published one."""

WEAR_LAWS: Registry[WearLaw] = discover(
    "wear law",
    __name__,
    __path__,
    WearLaw,
    group="wearsim.wear_laws",
    function="depth",
    returns=np.ndarray,
)


@dataclass(frozen=True)
class WearSettings:
    """Wear law with its coefficients.

    Parameters
    ----------
    law : str
        Name in `WEAR_LAWS`.
    coefficients : str or CoefficientSet
        Name in `damage.coefficients.COEFFICIENT_SETS`, or a user's set, such as a
        `WearTable`.
    form : {"local", "patch_mean"}
        Wear index by cell, or its mean over the patch.
    density : float
        Of the wheel [kg/m3].
    hardness : float, optional
        Of the wheel, in place of that of the set, for laws with a hardness [Pa].
    seizure_blend : float, optional
        Width of the blend into seizure over the hardness, in place of that of the set,
        for laws with seizure [-].
    seizure_cap : {"none", "pressure", "regime"}
        Exclusion of the seizure regime, for laws that have it, see `archard.capped`.
    values : tuple of pairs
        Symbols of the set and values in place of the published ones, in their units.
    scale : float
        Factor on the depths [-].
    """

    law: str = "usfd"
    coefficients: str | CoefficientSet = "lewis_dwyer_joyce_2004"
    form: Form = "local"
    density: float = 7850.0
    hardness: float | None = None
    seizure_blend: float | None = None
    seizure_cap: SeizureCap = "none"
    values: tuple[tuple[str, float], ...] = ()
    scale: float = 1.0

    @property
    def needs_fields(self) -> bool:
        """True if the law uses pressure, shear stress or slip of the cells."""
        return WEAR_LAWS[self.law].needs_fields


def coefficients_of(settings: WearSettings) -> CoefficientSet:
    """Return the coefficients of a set with the values that the settings replace.

    Raises
    ------
    SceneError
        All faults: unknown names, a form the law does not have, a parameter it does not
        take; or values out of their range or order.
    """
    law = WEAR_LAWS[settings.law]
    faults = []
    for name, choices in (("form", law.forms), ("seizure_cap", SEIZURE_CAPS)):
        if (value := getattr(settings, name)) not in choices:
            fix = " or ".join(f'"{choice}"' for choice in choices)
            faults.append(
                Fault(
                    f'{name} = "{value}" is not of law = "{law.name}"; write {name} = '
                    f"{fix}"
                )
            )
    for name, default in (
        ("seizure_cap", "none"),
        ("hardness", None),
        ("seizure_blend", None),
    ):
        if getattr(settings, name) != default and name not in law.parameters:
            takers = WEAR_LAWS.that_take(name)
            faults.append(
                Fault(
                    f'{name} acts with law = {takers} only, not "{law.name}"; delete it'
                )
            )
    given = settings.coefficients
    if not given and law.coefficients is None and "table" not in law.parameters:
        given = given_set("", law.name, {}, "", "")  # the law's default coefficients
    # a law without wear accepts any coefficient set
    coefficients = coefficient_set(given, law.name if law.wears else None, faults)
    raise_any(
        [
            fault
            for symbol, value in settings.values
            if (fault := coefficients.value_fault(symbol, value))
        ]
    )
    for symbol, value in settings.values:
        coefficients = coefficients.with_value(symbol, value, GIVEN_VALUE)
    _require_rising(law, coefficients)
    if settings.hardness is not None:
        value = 1e-9 * settings.hardness
        coefficients = coefficients.with_value(
            "hardness", value, "hardness of the wheel as given"
        )
    if settings.seizure_blend is not None:
        coefficients = coefficients.with_value(
            "seizure_blend", settings.seizure_blend, "as given"
        )
    if settings.scale != 1.0:
        coefficients = coefficients.scaled(settings.scale, "factor as given")
    return coefficients


def _require_rising(law: WearLaw, coefficients: CoefficientSet) -> None:
    """Raise a SceneError if the limits of regimes are not in rising order."""
    for low, high in itertools.pairwise(law.rising):
        if not coefficients[low] < coefficients[high]:
            message = (
                f"{low} = {coefficients[low]:g} must be below {high} = "
                f"{coefficients[high]:g}"
            )
            raise SceneError(
                [Fault(f"{message}{coefficients.values[high].unit_after}")]
            )


def passage_depth(
    fields: SurfaceFields, area: FloatArray, settings: WearSettings
) -> FloatArray:
    """Depth removed by one passage of each patch, by the law of the settings.

    Parameters
    ----------
    fields : SurfaceFields
        On the cells of `m` patches.
    area : (m,) array
        Of the patches [m2].
    settings : WearSettings
        Of the law.

    Returns
    -------
    (n_regimes, m, ny) array
        Depth along the surface normal [m].

    Raises
    ------
    SceneError
        For settings that do not fit together.
    NumericalError
        When a depth is not finite: the contact fields hold NaN or infinity.
    """
    law = WEAR_LAWS[settings.law]
    coefficients = coefficients_of(settings)
    taken = {
        name: getattr(settings, name)
        for name in ("density", "seizure_cap")
        if name in law.parameters
    }
    few = batches((fields, area), area.size) if law.needs_fields else [(fields, area)]
    local = law.needs_fields and settings.form == "local"
    parts = [
        law.depth(
            within_cells(batch_fields) if local else batch_fields,
            batch_area,
            coefficients,
            form=settings.form,
            **taken,
        )
        for batch_fields, batch_area in few
    ]
    depth = parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)
    expected_shape = len(law.regimes), *fields.cell_length.shape
    if depth.shape != expected_shape:
        shapes = f"{depth.shape}, not {expected_shape}"
        raise PluginError(
            f'wear law "{law.name}" gives depths {shapes}: regimes, patches, strips'
        )
    bad = np.asarray(~np.isfinite(depth).all(axis=(0, 2)))
    require_usable(f'wear law "{settings.law}"', bad, "not finite")
    if (depth < 0.0).any():
        raise PluginError(
            f'wear law "{law.name}" gives a depth below 0; check its coefficients'
        )
    return depth if settings.scale == 1.0 else depth * settings.scale


def patch_regime(depth: FloatArray) -> IntArray:
    """Return the regime (m,) with the largest depth in each patch, -1 without wear.

    Parameters
    ----------
    depth : (n_regimes, m, ny) array
        Depth per passage by regime [m].
    """
    by_regime = depth.sum(axis=2)  # strips of a patch have equal width
    dominant: IntArray = np.argmax(by_regime, axis=0).astype(np.int64)
    dominant[by_regime.sum(axis=0) <= 0.0] = -1
    return dominant


def highest_regime(depth: FloatArray) -> IntArray:
    """Return the highest regime (m,) in which any strip of each patch wears.

    Regimes are counted in the order of the law; -1 means no wear. In the local form one
    cell in a regime is enough; in the form "patch_mean" a patch has one regime.

    Parameters
    ----------
    depth : (n_regimes, m, ny) array
        Depth per passage by regime [m].
    """
    wears = (depth > 0.0).any(axis=2)
    return (
        np.where(wears, np.arange(depth.shape[0])[:, None], -1)
        .max(axis=0)
        .astype(np.int64)
    )
