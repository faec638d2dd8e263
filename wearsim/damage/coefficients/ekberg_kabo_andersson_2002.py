"""Yield stress of the fatigue indices of Ekberg, Kabo and Andersson (2002)."""

from wearsim.damage.coefficients.record import Coefficient, CoefficientSet

EKBERG_KABO_ANDERSSON_2002 = CoefficientSet(
    name="ekberg_kabo_andersson_2002",
    laws=("surface_fatigue_index", "surface_fatigue_index_local"),
    materials="railway wheel steels",
    source=(
        "A. Ekberg, E. Kabo, H. Andersson, An engineering model for prediction of rolling contact fatigue "
        "of railway wheels, Fatigue & Fracture of Engineering Materials & Structures 25 (2002) 899-909"
    ),
    validity=(
        "Shakedown of a rolling and sliding contact after Johnson (1989). The yield stress in cyclic shear "
        "depends on steel and hardening; 200 to 350 MPa are in use, and the index moves with it."
    ),
    departures=(
        "Cell by cell (surface_fatigue_index_local) the index is (|tau| - k)/p: an extension to patches "
        "that are no ellipses.",
        "The damage of a passage is our own choice: the index where it is above zero, to the first power.",
    ),
    values={
        "shear_yield": Coefficient(
            300.0, "MPa", "typical value in use, not checked on a page", "recalled", (200.0, 350.0)
        )
    },
)
