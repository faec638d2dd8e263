"""Two-level energy law with the coefficients quoted from Krause and Poll (1986)."""

from wearsim.damage.coefficients.record import Coefficient, CoefficientSet

_QUOTED = "sometimes quoted under this paper's name; the paper was not read for them"

KRAUSE_POLL_1986 = CoefficientSet(
    name="krause_poll_1986",
    laws=("energy",),
    materials="wheel and rail steels",
    source=(
        "H. Krause, G. Poll, Wear of wheel-rail surfaces, Wear 113 (1986) 103-122; the switch as in the "
        "law of W. Specht, used by codes of multibody dynamics"
    ),
    validity=(
        "The paper finds the lost volume proportional to frictional work, and its factor governed by the "
        "contact temperature, for which the frictional power per contact area stands. The numbers are "
        "uncertain."
    ),
    departures=(
        "The switch at about 4e6 W/m2 is that of Specht's two-level law; no quotation has one with "
        "these coefficients.",
    ),
    values={
        "mild": Coefficient(9.87e-14, "m3 J-1", _QUOTED, "uncertain"),
        "severe": Coefficient(2.96e-13, "m3 J-1", _QUOTED, "uncertain"),
        "power_limit": Coefficient(
            4e6, "W m-2", "Specht's law as documented by users, about this value", "recalled"
        ),
    },
)
