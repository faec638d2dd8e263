"""The record of a wear law.

Its formula, and all that the rest of the package may ask of it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from wearsim.contact.patch import FloatArray
from wearsim.errors import Fault, raise_any

Form = Literal["local", "patch_mean"]
FORMS: tuple[Form, ...] = ("local", "patch_mean")
PARAMETERS = (
    "density",
    "hardness",
    "seizure_blend",
    "seizure_cap",
    "energy_coefficient",
    "table",
)


def never(coefficients: Any) -> bool:  # noqa: ARG001
    """No set of coefficients depends on the sliding speed."""
    return False


@dataclass(frozen=True)
class WearLaw:
    """A wear law.

    Parameters
    ----------
    name : str
        Key in `WEAR_LAWS`, in scenes and results.
    depth : callable
        ``depth(fields, area, coefficients, *, form)`` -> (n_regimes, m, ny) array:
        depth that one passage of each of `m` patches removes along the normal of each
        strip, never negative [m]; from the `SurfaceFields` of the patches, their areas
        (m,) [m2], which act in the form "patch_mean" only, and a `CoefficientSet`.
        Settings among `parameters` named "density" [kg/m3] and "seizure_cap" are
        further keywords.
    regimes : tuple of str
        Names of the wear regimes, in the order of the depths.
    coefficients : str or None
        Name of the set it takes where none is asked for; None: it has no published one.
    forms : tuple of {"local", "patch_mean"}
        Whether the wear index may be taken cell by cell or as its mean over the patch;
        the first is the default.
    parameters : tuple of str
        What it takes besides a set: "density", "hardness" and "seizure_blend" (in place
        of those of the set), "seizure_cap", "energy_coefficient" (one constant in place
        of a set), "table" (a table of the user's own).
    wears : bool
        False for the law that removes nothing.
    needs_friction : bool
        Whether nothing wears without friction.
    needs_fields : bool
        Whether it takes pressure, shear or slip of the cells; False: their frictional
        work alone.
    rising : tuple of str
        Coefficients whose values rise in this order, such as the limits of regimes.
    by_slip : callable
        ``by_slip(coefficients)`` -> bool: whether the local form takes its coefficient
        from the sliding speed of each cell. Never, by default.
    outside : tuple of (str, str)
        Regimes in which it goes beyond its data, each with the words that say where.
    """

    name: str
    depth: Callable[..., FloatArray]
    regimes: tuple[str, ...]
    coefficients: str | None
    forms: tuple[Form, ...] = FORMS
    parameters: tuple[str, ...] = ()
    wears: bool = True
    needs_friction: bool = True
    needs_fields: bool = True
    rising: tuple[str, ...] = ()
    by_slip: Callable[[Any], bool] = never
    outside: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        named = f'wear law "{self.name}"'
        faults = []
        if not self.regimes or not all_words(self.regimes):
            faults.append(
                f'{named}: regimes = {self.regimes!r} must be names, such as ("mild", '
                '"severe")'
            )
        for key, known in (("forms", FORMS), ("parameters", PARAMETERS)):
            given = getattr(self, key)
            if (
                not all_words(given)
                or not set(given) <= set(known)
                or (key == "forms" and not given)
            ):
                faults.append(
                    f"{named}: {key} = {given!r} must be a tuple of {', '.join(known)}"
                )
        raise_any([Fault(text) for text in faults])


def all_words(given: Any) -> bool:
    """Return True for a tuple or list of texts."""
    return isinstance(given, tuple | list) and all(
        isinstance(one, str) and one for one in given
    )
