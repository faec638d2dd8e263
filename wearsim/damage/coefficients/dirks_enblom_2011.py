"""Stress index per strip of Dirks and Enblom (2011)."""

from wearsim.damage.coefficients.record import Coefficient, CoefficientSet

DIRKS_ENBLOM_2011 = CoefficientSet(
    name="dirks_enblom_2011",
    laws=("stress_index",),
    materials="rail and wheel steels",
    source=(
        "B. Dirks, R. Enblom, Prediction model for wheel profile wear and rolling contact fatigue, "
        "Wear 271 (2011) 210-217; B. Dirks, R. Enblom, A. Ekberg, M. Berg, Fatigue & Fracture of "
        "Engineering Materials & Structures 38 (2015) 1478-1491"
    ),
    validity=(
        "The excess of the local shear stress over the yield stress in shear, by strip. How the excess "
        "turns into crack length was calibrated by the authors; those numbers are not shipped, so that "
        "the damage here compares between states of one law only."
    ),
    departures=(
        "The damage of a passage is our own choice: the largest excess over the yield stress, divided by it, "
        "to the first power, shared by the strips as their frictional work.",
    ),
    values={
        "shear_yield": Coefficient(
            300.0, "MPa", "as for the surface fatigue index", "recalled", (200.0, 350.0)
        )
    },
)
