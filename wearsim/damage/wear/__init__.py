"""Wear laws: one file per published law, one registry."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from dataclasses import fields as dataclass_fields

import numpy as np

from wearsim.contact.patch import FloatArray, IntArray, SurfaceFields
from wearsim.damage.coefficients import COEFFICIENT_SETS, CoefficientSet
from wearsim.damage.wear import archard, brr, energy, none, table, usfd
from wearsim.damage.wear.archard import SEIZURE_CAPS, SeizureCap
from wearsim.damage.wear.law import FORMS, Form, WearLaw
from wearsim.errors import Fault, NumericalError, SceneError

WEAR_LAWS: dict[str, WearLaw] = {
    "archard": archard.depth,
    "brr": brr.depth,
    "energy": energy.depth,
    "none": none.depth,
    "table": table.depth,
    "usfd": usfd.depth,
}
WEAR_REGIMES: dict[str, tuple[str, ...]] = {
    "archard": archard.REGIMES,
    "brr": brr.REGIMES,
    "energy": energy.REGIMES,
    "none": none.REGIMES,
    "table": table.REGIMES,
    "usfd": usfd.REGIMES,
}
WEAR_FORMS: dict[str, tuple[Form, ...]] = {
    **dict.fromkeys(WEAR_LAWS, FORMS),
    "brr": ("patch_mean",),
}
"""Forms each law has; the first is the one it takes where none is asked for."""

DEFAULT_COEFFICIENTS: dict[str, str] = {
    "archard": "jendel_2002",
    "brr": "pearce_sherratt_1991",
    "energy": "zobory_1997",
    "none": "lewis_dwyer_joyce_2004",
    "usfd": "lewis_dwyer_joyce_2004",
}
"""Set each law takes where none is asked for; a table has none."""

_CHUNK = 16  # patches; their cells fit the cache


@dataclass(frozen=True)
class WearSettings:
    """Which wear law acts, with which numbers.

    Parameters
    ----------
    law : str
        Name in `WEAR_LAWS`.
    coefficients : str or CoefficientSet
        Name in `damage.coefficients.COEFFICIENT_SETS`, or a set of one's own, such as a `WearTable`.
    form : {"local", "patch_mean"}
        Whether the wear index is taken cell by cell or as its mean over the patch.
    density : float
        Of the wheel [kg/m3].
    hardness : float, optional
        Of the wheel, in place of that of the set (law "archard") [Pa].
    seizure_cap : {"none", "pressure", "regime"}
        What keeps the seizure regime out (law "archard"), see `archard.capped`.
    """

    law: str = "usfd"
    coefficients: str | CoefficientSet = "lewis_dwyer_joyce_2004"
    form: Form = "local"
    density: float = 7850.0
    hardness: float | None = None
    seizure_cap: SeizureCap = "none"


def default_settings(law: str, **changes: object) -> WearSettings:
    """Return the settings of a law with its own set and form.

    Parameters
    ----------
    law : str
        Name in `WEAR_LAWS`.
    **changes
        Other fields of `WearSettings`.

    Raises
    ------
    SceneError
        For an unknown law, or a table without its table.
    """
    wear_law(law)
    if law not in DEFAULT_COEFFICIENTS and "coefficients" not in changes:
        raise SceneError([Fault(f'law = "{law}" needs its own table; there is no shipped one')])
    own: dict[str, object] = {"coefficients": DEFAULT_COEFFICIENTS.get(law), "form": WEAR_FORMS[law][0]}
    return WearSettings(law=law, **{**own, **changes})  # type: ignore[arg-type]


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


def coefficient_set(name: str | CoefficientSet, law: str) -> CoefficientSet:
    """Return the coefficient set called `name`, if it belongs to `law`; a set given as such likewise.

    Raises
    ------
    SceneError
        For a name that is not in `COEFFICIENT_SETS`, or a set made for other laws. The law "none"
        takes any.
    """
    if isinstance(name, CoefficientSet):
        found = name
    elif name not in COEFFICIENT_SETS:
        raise _unknown("coefficient set", name, COEFFICIENT_SETS)
    else:
        found = COEFFICIENT_SETS[name]
    if law != "none" and law not in found.laws:
        fitting = sorted(key for key, known in COEFFICIENT_SETS.items() if law in known.laws)
        raise SceneError(
            [
                Fault(
                    f'coefficients = "{found.name}" belong to {", ".join(found.laws)}, not to law = "{law}"; '
                    f"take {', '.join(fitting) or 'a table of your own'}"
                )
            ]
        )
    return found


def acting_coefficients(settings: WearSettings) -> CoefficientSet:
    """Return the numbers that act under some settings, and check that the settings fit together.

    Parameters
    ----------
    settings : WearSettings
        Law, coefficients, form, hardness, cap.

    Returns
    -------
    CoefficientSet
        With the hardness of the settings, if they give one.

    Raises
    ------
    SceneError
        For unknown names, a form the law does not have, or a hardness or cap of a law without them.
    """
    wear_law(settings.law)
    faults: list[Fault] = []
    if settings.form not in FORMS:
        faults.extend(_unknown("form of the wear law", settings.form, FORMS).faults)
    elif settings.form not in WEAR_FORMS[settings.law]:
        only = WEAR_FORMS[settings.law][0]
        faults.append(
            Fault(
                f'form = "{settings.form}": law = "{settings.law}" is a law of the whole patch; '
                f'write form = "{only}"'
            )
        )
    if settings.seizure_cap not in SEIZURE_CAPS:
        faults.extend(_unknown("seizure_cap", settings.seizure_cap, SEIZURE_CAPS).faults)
    elif settings.law != "archard" and settings.seizure_cap != "none":
        faults.append(Fault(f'seizure_cap acts with law = "archard" only, not "{settings.law}"; delete it'))
    if settings.law != "archard" and settings.hardness is not None:
        faults.append(Fault(f'hardness acts with law = "archard" only, not "{settings.law}"; delete it'))
    try:
        found = coefficient_set(settings.coefficients, settings.law)
    except SceneError as error:
        raise SceneError([*faults, *error.faults]) from None
    if faults:
        raise SceneError(faults)
    if settings.law == "archard" and settings.hardness is not None:
        return found.with_value("hardness", 1e-9 * settings.hardness, "hardness of the wheel as given")
    return found


def regimes(law: str) -> tuple[str, ...]:
    """Return the names of the wear regimes of `law`, in the order of its depths."""
    wear_law(law)
    return WEAR_REGIMES[law]


def _parts(fields: SurfaceFields) -> Iterator[tuple[int, SurfaceFields]]:
    """Fields of a few patches at a time: laws make several copies of the cells."""
    count = fields.speed.size
    names = [field.name for field in dataclass_fields(SurfaceFields)]
    for start in range(0, max(count, 1), _CHUNK):
        part = slice(start, start + _CHUNK)
        yield start, SurfaceFields(**{name: getattr(fields, name)[part] for name in names})


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
    law = wear_law(settings.law)
    coefficients = acting_coefficients(settings)
    if settings.law == "archard":
        fields, coefficients = archard.capped(fields, coefficients, settings.seizure_cap)
    parts = [
        law(part, area[start : start + _CHUNK], coefficients, form=settings.form, density=settings.density)
        for start, part in _parts(fields)
    ]
    depth = parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)
    bad = ~np.isfinite(depth).all(axis=(0, 2))
    if bad.any():
        raise NumericalError(
            f'wear law "{settings.law}" got contact fields that are not finite in '
            f"{int(bad.sum())} of {bad.size} patches (first: {int(np.argmax(bad))}); "
            "look at this operating point with the contact command"
        )
    return depth


def passage_depths(
    fields: SurfaceFields, area: FloatArray, settings: Sequence[WearSettings]
) -> tuple[FloatArray, ...]:
    """Depth removed by one passage of each patch by several laws, on the same contact solution.

    Parameters
    ----------
    fields : SurfaceFields
        On the cells of `m` patches.
    area : (m,) array
        Of the patches [m2].
    settings : sequence of WearSettings
        The leading law and those beside it.

    Returns
    -------
    tuple of (n_regimes, m, ny) arrays
        Depth along the surface normal, for each of the settings [m].
    """
    return tuple(passage_depth(fields, area, each) for each in settings)


def worn_volume(depth: FloatArray, strip_width: FloatArray) -> FloatArray:
    """Volume each patch removes per metre rolled, by regime.

    Parameters
    ----------
    depth : (n_regimes, m, ny) array
        Depth per passage [m].
    strip_width : (m,) array
        Of the patches [m].

    Returns
    -------
    (n_regimes, m) array
        [m3/m]: a strip meets one metre of its ring per metre rolled.
    """
    volume: FloatArray = depth.sum(axis=2) * strip_width
    return volume


def regime_shares(depth: FloatArray, strip_width: FloatArray, weight: FloatArray | None = None) -> FloatArray:
    """Share of the worn volume that each regime removes.

    Parameters
    ----------
    depth : (n_regimes, m, ny) array
        Depth per passage [m].
    strip_width : (m,) array
        Of the patches [m].
    weight : (m,) array, optional
        Share of the distance of each patch's operating point, times its environment factor.

    Returns
    -------
    (n_regimes,) array
        Sums to 1; zeros where nothing wears.
    """
    volume = worn_volume(depth, strip_width)
    by_regime: FloatArray = (volume if weight is None else volume * weight).sum(axis=1)
    total = by_regime.sum()
    return by_regime / total if total > 0.0 else np.zeros_like(by_regime)


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
    "DEFAULT_COEFFICIENTS",
    "FORMS",
    "SEIZURE_CAPS",
    "WEAR_FORMS",
    "WEAR_LAWS",
    "WEAR_REGIMES",
    "Form",
    "SeizureCap",
    "WearLaw",
    "WearSettings",
    "acting_coefficients",
    "coefficient_set",
    "default_settings",
    "highest_regime",
    "passage_depth",
    "passage_depths",
    "patch_regime",
    "regime_shares",
    "regimes",
    "wear_law",
    "worn_volume",
]
