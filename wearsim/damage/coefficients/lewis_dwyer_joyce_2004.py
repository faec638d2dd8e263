"""Twin-disc wear coefficients of R8T wheel steel by Lewis and Dwyer-Joyce (2004)."""

from wearsim.damage.coefficients.record import Coefficient, CoefficientSet

_QUOTED = "wear function of the regimes mild, severe, catastrophic; page of the original not checked by us"
_LIMIT = f"{_QUOTED}; heat in table 3 of the paper: "

LEWIS_DWYER_JOYCE_2004 = CoefficientSet(
    name="lewis_dwyer_joyce_2004",
    laws=("usfd",),
    materials="R8T wheel steel on UIC60 900A rail steel, dry",
    source=(
        "R. Lewis, R. S. Dwyer-Joyce, Wear mechanisms and transitions in railway wheel steels, "
        "Proc. IMechE Part J 218 (2004) 467-478; used on profiles by F. Braghin, R. Lewis, "
        "R. S. Dwyer-Joyce, S. Bruni, Wear 261 (2006) 1253-1264"
    ),
    validity=(
        "Twin discs in line contact, 900 to 1800 MPa, slip 0.2 to 20 %, dry, T-gamma/A as the mean of the "
        "contact up to about 121 N/mm2 (heat in table 3 of the paper at 20 % slip and 1500 MPa, with "
        'disc sizes from memory). Cell by cell (form "local") the index exceeds its mean in '
        "partial slip: an extrapolation, as is anything lubricated, wet or on other steels."
    ),
    departures=(
        "The printed short form of the third branch, 61.9 T-gamma/A, is not used: at 77.2 N/mm2 it would "
        "jump from 55 to 4779. Ours starts at the end of the severe branch and keeps the slope, "
        "55.0 + 61.9 (T-gamma/A - 77.2), about 2766 at 121 N/mm2, as the 15 to 20 % slip tests ask.",
        "The severe branch keeps the printed 55.0, although the mild one ends at 5.3 x 10.4 = 55.12: "
        "the law falls by 0.12, 0.2 %, where the severe regime begins.",
    ),
    values={
        "mild_slope": Coefficient(5.3, "ug m-1 mm-2 per N mm-2", _QUOTED, "confirmed"),
        "severe_level": Coefficient(55.0, "ug m-1 mm-2", _QUOTED, "confirmed"),
        "catastrophic_slope": Coefficient(61.9, "ug m-1 mm-2 per N mm-2", _QUOTED, "confirmed"),
        "severe_limit": Coefficient(10.4, "N mm-2", f"{_LIMIT}4.3 N/mm2 at 1 % slip, 17 at 3 %", "confirmed"),
        "catastrophic_limit": Coefficient(
            77.2, "N mm-2", f"{_LIMIT}55 N/mm2 at 10 % slip, 82 at 15 %", "confirmed"
        ),
    },
)
