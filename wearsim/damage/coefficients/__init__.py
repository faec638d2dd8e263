"""Published coefficient sets of wear and fatigue laws.

Each set is a TOML file in this folder.

A file holds the fields of `CoefficientSet`, and below `[values.SYMBOL]` those of each
`Coefficient`.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from pathlib import Path

from wearsim.contact.registry import Registry
from wearsim.damage.coefficients.record import Coefficient, CoefficientSet
from wearsim.errors import Fault, SceneError, brief


def read_set(path: Path) -> CoefficientSet:
    """Read the file of a coefficient set."""
    fields = tomllib.loads(path.read_text(encoding="utf-8"))
    fields["values"] = {
        symbol: Coefficient(**number) for symbol, number in fields["values"].items()
    }
    fields |= {key: tuple(fields[key]) for key in ("laws", "departures")}
    return CoefficientSet(**fields)


COEFFICIENT_SETS: Registry[CoefficientSet] = Registry(
    "coefficient set",
    map(read_set, sorted(Path(__file__).parent.glob("*.toml"))),
    group="wearsim.coefficient_sets",
    record=CoefficientSet,
)


def coefficient_set(
    given: str | CoefficientSet, law: str | None, faults: Iterable[Fault] = ()
) -> CoefficientSet:
    """Return the coefficient set named `given`, or `given` itself if it is a set.

    The set must belong to `law`; with `law` None it may belong to any law.

    Raises
    ------
    SceneError
        For an unknown name, what is neither name nor set, or a set of other laws,
        behind the `faults` found before.
    """
    all_faults = list(faults)
    chosen = COEFFICIENT_SETS.get(given) if isinstance(given, str) else given
    fitting = sorted(
        name
        for name, coefficients in COEFFICIENT_SETS.items()
        if law is None or law in coefficients.laws
    )
    if chosen is None:
        all_faults.append(COEFFICIENT_SETS.unknown(str(given), fitting))
    elif not isinstance(chosen, CoefficientSet):
        message = (
            f"coefficients = {brief(repr(given))} must be the name of a coefficient "
            "set, or a CoefficientSet"
        )
        all_faults.append(Fault(f"{message}; take {_names(fitting)}"))
    elif law is not None and law not in chosen.laws:
        message = (
            f'coefficients = "{chosen.name}" belong to {", ".join(chosen.laws)}, not '
            f'to law = "{law}"'
        )
        all_faults.append(Fault(f"{message}; take {_names(fitting)}"))
    if chosen is None or all_faults:
        raise SceneError(all_faults)
    return chosen


def _names(fitting: list[str]) -> str:
    """List the names of sets that fit a law, in messages."""
    return ", ".join(fitting) or "a table of your own"


__all__ = ["COEFFICIENT_SETS", "Coefficient", "CoefficientSet", "coefficient_set"]
