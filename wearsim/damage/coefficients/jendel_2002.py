"""Wear map of sliding speed and pressure by Jendel (2000, 2002), as used at KTH."""

from wearsim.damage.coefficients.record import Coefficient, CoefficientSet

_MIDDLE = "middle of the range of the map, a convention of users of the map, not of the thesis"
_MAP = "limits of the regions of the map; thesis not read again"

JENDEL_2002 = CoefficientSet(
    name="jendel_2002",
    laws=("archard",),
    materials="wheel and rail steels, dry; pin on disc and disc on disc",
    source=(
        "T. Jendel, Prediction of wheel profile wear - comparisons with field measurements, "
        "Wear 253 (2002) 89-99, from: Prediction of wheel profile wear - methodology and verification, "
        "licentiate thesis TRITA-FKT 2000:49, KTH Stockholm 2000; see also R. Enblom, M. Berg, "
        "Wear 258 (2005) 1055-1063"
    ),
    validity=(
        "Dry laboratory tests. In service the surfaces are contaminated and lubricated; the users of the "
        "map divide by about 5.5 (natural lubrication) or 13.75 (lubricated curves), both uncertain: "
        "give the environment factor of each block or class. The speed limits are absolute: the same "
        "creepage at half the speed can be another regime."
    ),
    departures=(
        "k jumps 70 times at 0.8 H; we blend it by a smooth function of the pressure over 5 % of H around "
        "that (seizure_blend), so that wear follows pressure smoothly.",
        "The map prints ranges of k; we take their middle (5, 35, 5, 350) x 1e-4. The ends of the ranges "
        "are a factor 10 apart in the mild regimes.",
        "Elastic contact models exceed 0.8 H in contacts of small radius, so that seizure may "
        "follow from the assumption of elasticity; its share is reported, and seizure_cap limits it.",
    ),
    values={
        "k_mild": Coefficient(5e-4, "-", _MIDDLE, "uncertain", (1e-4, 10e-4)),
        "k_oxidative": Coefficient(5e-4, "-", _MIDDLE, "uncertain", (1e-4, 10e-4)),
        "k_severe": Coefficient(35e-4, "-", _MIDDLE, "uncertain", (30e-4, 40e-4)),
        "k_seizure": Coefficient(350e-4, "-", _MIDDLE, "uncertain", (300e-4, 400e-4)),
        "severe_speed": Coefficient(0.2, "m s-1", _MAP, "recalled"),
        "oxidative_speed": Coefficient(0.7, "m s-1", _MAP, "recalled"),
        "seizure_share": Coefficient(0.8, "-", _MAP, "recalled"),
        "seizure_blend": Coefficient(0.05, "-", "ours, the map jumps: see the departures", "uncertain"),
        "hardness": Coefficient(
            3.0, "GPa", "wheel steels R7 and R8, 260 to 300 HB, have 2.7 to 3.0 GPa", "recalled"
        ),
    },
)
