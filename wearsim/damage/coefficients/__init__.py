"""Published coefficient sets of wear and fatigue laws, one module per publication.

Every `CoefficientSet` at the top of a module of this folder is registered.
"""

from __future__ import annotations

from wearsim.damage.coefficients.record import CERTAINTIES, Coefficient, CoefficientSet
from wearsim.damage.registry import Registry, discover, unknown
from wearsim.errors import Fault, SceneError

COEFFICIENT_SETS: Registry[CoefficientSet] = discover("coefficient set", __name__, __path__, CoefficientSet)


def coefficient_set(given: str | CoefficientSet, law: str | None) -> CoefficientSet:
    """Return the coefficient set called `given`, or given itself, if it belongs to a law; None: to any.

    Raises
    ------
    SceneError
        For an unknown name, or a set of other laws.
    """
    fitting = sorted(name for name, one in COEFFICIENT_SETS.items() if law is None or law in one.laws)
    if isinstance(given, CoefficientSet):
        chosen = given
    elif given in COEFFICIENT_SETS:
        chosen = COEFFICIENT_SETS[given]
    else:
        raise SceneError([unknown("coefficient set", given, fitting or COEFFICIENT_SETS)])
    if law is not None and law not in chosen.laws:
        message = f'coefficients = "{chosen.name}" belong to {", ".join(chosen.laws)}, not to law = "{law}"'
        raise SceneError([Fault(f"{message}; take {', '.join(fitting) or 'a table of your own'}")])
    return chosen


__all__ = ["CERTAINTIES", "COEFFICIENT_SETS", "Coefficient", "CoefficientSet", "coefficient_set"]
