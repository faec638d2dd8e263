r"""Energy laws: the volume lost is proportional to the frictional work.

The depth a strip loses in one passage is :math:`\Delta z(y) = k_e\, e(y)` with its
frictional work per area e(y). The coefficient is constant, or has two levels: mild
below a density of the frictional power, severe from it on [1]_ [2]_. The power density
is the work density times the speed, :math:`\tau \cdot s`, and stands for the contact
temperature; such a switch depends on the running speed.

References
----------
.. [1] H. Krause, G. Poll, Wear 113 (1986) 103-122.
.. [2] I. Zobory, Vehicle System Dynamics 28 (1997) 221-259.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.patch import FloatArray, SurfaceFields
from wearsim.damage.coefficients.record import CoefficientSet, given_set
from wearsim.damage.wear.law import Form, WearLaw
from wearsim.damage.wear.sliding import along_strips, mean_of, patch_total

REGIMES = ("mild", "severe")
"""A constant coefficient counts as mild everywhere."""

_WATT_PER_M2 = {"W mm-2": 1e6, "W m-2": 1.0}


def constant(volume_per_work: float, source: str) -> CoefficientSet:
    """Return a coefficient set with one constant k_e [m3/J]; 1e-12 m3/J is 1 mm3/kJ.

    `source` states its origin.
    """
    validity = "As far as the constant holds."
    return given_set(
        "constant", "energy", {"mild": (volume_per_work, "m3 J-1")}, source, validity
    )


def volume_per_work(coefficients: CoefficientSet, level: str, density: float) -> float:
    """Return k_e of the level "mild" or "severe" [m3/J].

    `density` [kg/m3] converts sets given in kg/J.
    """
    number = coefficients.values[level]
    return number.value / density if number.unit == "kg J-1" else number.value


def power_limit(coefficients: CoefficientSet) -> float:
    """Return the power density above which wear is severe [W/m2].

    It is infinite for a constant coefficient.
    """
    number = coefficients.values.get("power_limit")
    return np.inf if number is None else number.value * _WATT_PER_M2[number.unit]


def depth(
    fields: SurfaceFields,
    area: FloatArray,
    coefficients: CoefficientSet,
    *,
    form: Form = "local",
    density: float = 7850.0,
) -> FloatArray:
    """Depth removed by one passage of each patch, see `WearLaw`.

    `form` acts on the power density; `density` acts where the levels of the set are
    mass per work.
    """
    mild = volume_per_work(coefficients, "mild", density)
    work = np.maximum(fields.work_density, 0.0)
    limit = power_limit(coefficients)
    if not np.isfinite(limit):
        strips = mild * along_strips(work, fields)
        return np.stack([strips, np.zeros_like(strips)])
    severe = volume_per_work(coefficients, "severe", density)
    if form == "local":
        switched = work * fields.speed[:, None, None] >= limit
        mild_work, severe_work = (
            np.where(switched, 0.0, work),
            np.where(switched, work, 0.0),
        )
        return np.stack(
            [
                mild * along_strips(mild_work, fields),
                severe * along_strips(severe_work, fields),
            ]
        )
    strips = along_strips(work, fields)
    switched = mean_of(patch_total(strips, fields), area) * fields.speed >= limit
    return np.stack(
        [mild * strips * ~switched[:, None], severe * strips * switched[:, None]]
    )


ENERGY = WearLaw(
    "energy",
    depth,
    REGIMES,
    "zobory_1997",
    parameters=("density", "energy_coefficient"),
    needs_fields=False,
)
