"""Damage function of the Whole Life Rail Model by Burstow (2003, 2004)."""

from dataclasses import replace

from wearsim.damage.coefficients.record import Coefficient, CoefficientSet

_QUOTED = "break points of the damage function as quoted; the reports were not read"
_TWICE = "break points of the damage function, in two sources that quote them"

BURSTOW_2004 = CoefficientSet(
    name="burstow_2004",
    laws=("wlrm",),
    materials="rail steels R220 and R260",
    source=(
        "M. Burstow, Whole Life Rail Model application and development for RSSB, AEA Technology reports "
        "2003 and 2004"
    ),
    validity=(
        "Calibrated on rails in British service, passage by passage of a wheel; damage 1 is a visible "
        "crack. Wheels and other steels have other functions, whose break points are not known to us: give "
        "your own."
    ),
    departures=(
        "In the net form the damage has no floor: beyond the falling branch it goes on falling below zero "
        "with the same slope, as wear removes cracks. Many codes stop at 0 or at -10e-6.",
    ),
    values={
        "start": Coefficient(15.0, "N", _QUOTED, "recalled"),
        "peak": Coefficient(65.0, "N", _TWICE, "confirmed"),
        "end": Coefficient(175.0, "N", _TWICE, "confirmed"),
        "peak_damage": Coefficient(10e-6, "-", _TWICE, "confirmed"),
    },
)

BURSTOW_2004_20N = replace(
    BURSTOW_2004,
    name="burstow_2004_20n",
    departures=(
        "Variant of a published implementation: damage begins at 20 N in place of 15 N, and is zero beyond "
        "175 N.",
    ),
    values={
        **BURSTOW_2004.values,
        "start": Coefficient(
            20.0, "N", "one published implementation, slopes 2.22e-7 and -9.09e-8 per N", "uncertain"
        ),
        "floor": Coefficient(0.0, "-", "one published implementation", "uncertain"),
    },
)
