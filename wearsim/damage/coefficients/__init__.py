"""Published coefficient sets, one module per publication."""

from __future__ import annotations

from wearsim.damage.coefficients.lewis_dwyer_joyce_2004 import LEWIS_DWYER_JOYCE_2004
from wearsim.damage.coefficients.record import Coefficient, CoefficientSet

COEFFICIENT_SETS: dict[str, CoefficientSet] = {
    LEWIS_DWYER_JOYCE_2004.name: LEWIS_DWYER_JOYCE_2004,
}

__all__ = ["COEFFICIENT_SETS", "Coefficient", "CoefficientSet"]
