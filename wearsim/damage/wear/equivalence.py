r"""What wear laws have in common: an energy coefficient, and the coefficient of Archard's law it stands for.

Where the contact slips :math:`|\tau| = \mu p`, so that :math:`k_e = k / (\mu H)`: the straight branches of
all laws are lines of one family.
"""

from __future__ import annotations

import numpy as np

from wearsim.damage.coefficients import CoefficientSet
from wearsim.damage.wear import energy

_GPA = 1e9


def archard_coefficient(volume_per_work: float, friction: float, hardness: float) -> float:
    r"""Return Archard's :math:`k = k_e \mu H` [-] of an energy coefficient [m3/J].

    Parameters
    ----------
    volume_per_work : float
        k_e [m3/J].
    friction : float
        Coulomb's coefficient [-].
    hardness : float
        H [Pa].
    """
    return volume_per_work * friction * hardness


def volume_per_work(archard: float, friction: float, hardness: float) -> float:
    r"""Return the energy coefficient :math:`k_e = k / (\mu H)` [m3/J] of Archard's k [-].

    Parameters
    ----------
    archard : float
        k [-].
    friction : float
        Coulomb's coefficient [-].
    hardness : float
        H [Pa].
    """
    return archard / (friction * hardness)


def branches(coefficients: CoefficientSet, friction: float, density: float = 7850.0) -> dict[str, float]:
    """Energy coefficients of the straight branches of a coefficient set.

    Parameters
    ----------
    coefficients : CoefficientSet
        Of the laws "archard", "brr", "energy" or "usfd"; plateaus are no lines and do not appear, of a
        branch with an offset its slope.
    friction : float
        Coulomb's coefficient; acts for Archard's law [-].
    density : float
        Of the wheel [kg/m3].

    Returns
    -------
    dict of str to float
        k_e by branch [m3/J]; 1e-12 is 1 mm3/kJ.
    """
    law = coefficients.laws[0]
    if law == "archard":
        hardness = coefficients["hardness"] * _GPA
        return {
            name: volume_per_work(coefficients[f"k_{name}"], friction, hardness)
            for name in ("mild", "oxidative", "severe", "seizure")
        }
    if law == "brr":
        per_slope = 1e-12 * np.pi
        return {name: per_slope * coefficients[f"{name}_slope"] for name in ("mild", "severe")}
    if law == "usfd":
        per_slope = 1e-9 / density  # ug/(m mm2) per N/mm2: 1e-3 kg/m3 per 1e6 Pa
        return {name: per_slope * coefficients[f"{name}_slope"] for name in ("mild", "catastrophic")}
    return {
        name: energy.volume_per_work(coefficients, name, density)
        for name in ("mild", "severe")
        if name in coefficients.values
    }
