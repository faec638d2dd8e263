"""Published coefficient sets, one module per publication."""

from __future__ import annotations

from wearsim.damage.coefficients.burstow_2004 import BURSTOW_2004, BURSTOW_2004_20N
from wearsim.damage.coefficients.dirks_enblom_2011 import DIRKS_ENBLOM_2011
from wearsim.damage.coefficients.ekberg_kabo_andersson_2002 import EKBERG_KABO_ANDERSSON_2002
from wearsim.damage.coefficients.jendel_2002 import JENDEL_2002
from wearsim.damage.coefficients.krause_poll_1986 import KRAUSE_POLL_1986
from wearsim.damage.coefficients.lewis_dwyer_joyce_2004 import LEWIS_DWYER_JOYCE_2004
from wearsim.damage.coefficients.pearce_sherratt_1991 import (
    PEARCE_SHERRATT_1991,
    PEARCE_SHERRATT_1991_CONTINUOUS,
)
from wearsim.damage.coefficients.record import CERTAINTIES, DOUBTFUL, Coefficient, CoefficientSet
from wearsim.damage.coefficients.zobory_1997 import ZOBORY_1997

COEFFICIENT_SETS: dict[str, CoefficientSet] = {
    found.name: found
    for found in (
        JENDEL_2002,
        KRAUSE_POLL_1986,
        LEWIS_DWYER_JOYCE_2004,
        PEARCE_SHERRATT_1991,
        PEARCE_SHERRATT_1991_CONTINUOUS,
        ZOBORY_1997,
    )
}
"""Sets of wear laws."""

FATIGUE_SETS: dict[str, CoefficientSet] = {
    found.name: found
    for found in (BURSTOW_2004, BURSTOW_2004_20N, DIRKS_ENBLOM_2011, EKBERG_KABO_ANDERSSON_2002)
}
"""Sets of fatigue laws."""

__all__ = [
    "CERTAINTIES",
    "COEFFICIENT_SETS",
    "DOUBTFUL",
    "FATIGUE_SETS",
    "Coefficient",
    "CoefficientSet",
]
