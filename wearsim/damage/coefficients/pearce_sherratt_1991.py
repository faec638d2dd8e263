"""Wheel wear coefficients of British Rail Research by Pearce and Sherratt (1991)."""

from dataclasses import replace

from wearsim.damage.coefficients.record import Coefficient, CoefficientSet

_BRANCH = "area of the section lost per km as quoted widely; page of the original not checked by us"
_UNIT = "mm2 km-1 mm N-1"

PEARCE_SHERRATT_1991 = CoefficientSet(
    name="pearce_sherratt_1991",
    laws=("brr",),
    materials="wheel and rail steels of British Rail",
    source="T. G. Pearce, N. D. Sherratt, Prediction of wheel profile wear, Wear 144 (1991) 343-351",
    validity=(
        "T-gamma of a whole contact patch. How the loss spreads over the patch is not part of the law: "
        "here as its frictional work."
    ),
    departures=(
        "The third branch is used as quoted, 1.19 T-gamma - 154: at 200 N the loss jumps from 25 to 84. "
        'The set "pearce_sherratt_1991_continuous" has the constant without a jump.',
        "T-gamma is the frictional work per metre rolled, with that of spin; the classical sum of force "
        "times creepage leaves spin out, and is smaller where spin is large.",
    ),
    values={
        "mild_slope": Coefficient(0.25, _UNIT, _BRANCH, "recalled"),
        "plateau_level": Coefficient(25.0, "mm2 km-1 mm", _BRANCH, "recalled"),
        "severe_slope": Coefficient(1.19, _UNIT, _BRANCH, "recalled"),
        "severe_offset": Coefficient(154.0, "mm2 km-1 mm", _BRANCH, "uncertain"),
        "plateau_start": Coefficient(100.0, "N", _BRANCH, "recalled"),
        "plateau_end": Coefficient(200.0, "N", _BRANCH, "recalled"),
    },
)

PEARCE_SHERRATT_1991_CONTINUOUS = replace(
    PEARCE_SHERRATT_1991,
    name="pearce_sherratt_1991_continuous",
    departures=(
        "The constant of the third branch is 213 in place of the quoted 154, so that the loss does not "
        "jump at 200 N.",
        PEARCE_SHERRATT_1991.departures[1],
    ),
    values={
        **PEARCE_SHERRATT_1991.values,
        "severe_offset": Coefficient(213.0, "mm2 km-1 mm", "1.19 x 200 - 25: continuous at 200 N", "derived"),
    },
)
