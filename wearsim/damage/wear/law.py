"""Record of a wear law: its formula and the properties used by other modules."""

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
    """Return False: no coefficient set of the law depends on the sliding speed."""
    return False


@dataclass(frozen=True)
class WearLaw:
    """Record of a wear law.

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
        Name of the default coefficient set; None for a law without a published one.
    forms : tuple of {"local", "patch_mean"}
        Permitted forms of the wear index, by cell or as its mean over the patch; the
        first is the default.
    parameters : tuple of str
        Inputs besides a set: "density", "hardness" and "seizure_blend" (in place of
        those of the set), "seizure_cap", "energy_coefficient" (one constant in place of
        a set), "table" (a user's table).
    wears : bool
        False for the law that removes nothing.
    needs_friction : bool
        True if there is no wear without friction.
    needs_fields : bool
        True if the law uses pressure, shear or slip of the cells; False if it uses
        their frictional work alone.
    rising : tuple of str
        Coefficients whose values rise in this order, such as the limits of regimes.
    by_slip : callable
        ``by_slip(coefficients)`` -> bool: True if the coefficient of the local form
        depends on the sliding speed of each cell. False by default.
    outside : tuple of (str, str)
        Regimes beyond the data of the law, each with its description in messages.
    title : str
        Name in texts, by default `name` with blanks.
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
    title: str = ""

    def __post_init__(self) -> None:
        named = f'wear law "{self.name}"'
        faults = []
        if not self.regimes or not all_words(self.regimes):
            faults.append(
                f'{named}: regimes = {self.regimes!r} must be names, such as ("mild", '
                '"severe")'
            )
        for key, choices in (("forms", FORMS), ("parameters", PARAMETERS)):
            given = getattr(self, key)
            if (
                not all_words(given)
                or not set(given) <= set(choices)
                or (key == "forms" and not given)
            ):
                faults.append(
                    f"{named}: {key} = {given!r} must be a tuple of "
                    f"{', '.join(choices)}"
                )
        raise_any([Fault(text) for text in faults])


def all_words(given: Any) -> bool:
    """Return True for a tuple or list of texts."""
    return isinstance(given, tuple | list) and all(
        isinstance(word, str) and word for word in given
    )
