"""Two-level energy law of Zobory (1997)."""

from wearsim.damage.coefficients.record import Coefficient, CoefficientSet

_QUOTED = "mass flow density over density of dissipated power; values from memory, page not checked"

ZOBORY_1997 = CoefficientSet(
    name="zobory_1997",
    laws=("energy",),
    materials="wheel and rail steels",
    source="I. Zobory, Prediction of wheel/rail profile wear, Vehicle System Dynamics 28 (1997) 221-259",
    validity=(
        "Mild wear below a dissipated power of 4 W/mm2, severe above. The switch depends on speed: at "
        "20 m/s it lies at a work density of 0.2 N/mm2, far below the 10.4 N/mm2 of the twin discs of "
        "lewis_dwyer_joyce_2004."
    ),
    departures=(),
    values={
        "mild": Coefficient(7e-10, "kg J-1", _QUOTED, "uncertain"),
        "severe": Coefficient(21e-10, "kg J-1", _QUOTED, "uncertain"),
        "power_limit": Coefficient(4.0, "W mm-2", _QUOTED, "uncertain"),
    },
)
