"""A wear law, its coefficients and a tangential model of a plug-in.

`wearsim` finds them once the package is installed.
"""

from dataclasses import replace

import wearsim


def depth(fields, area, coefficients, *, form):
    """Depth of one passage (1, m, ny) [m].

    k times the frictional work of each strip [J/m2].
    """
    return coefficients["k"] * fields.strip_work[None]


LAW = wearsim.WearLaw("by_work", depth, regimes=("all",), coefficients="made_up_2026")
SET = wearsim.CoefficientSet(
    name="made_up_2026",
    laws=("by_work",),
    materials="none",
    source="made up",
    validity="an example",
    departures=(),
    values={"k": wearsim.Coefficient(1e-12, "m3 J-1", "made up", "given")},
)
MODEL = replace(wearsim.TANGENTIAL_MODELS["fastsim"], name="fine_fastsim", fewest=10)
