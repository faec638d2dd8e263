"""The Sheffield (USFD) wear law: mass lost per distance and area as a function of T-gamma/A."""

from __future__ import annotations

import numpy as np

from wearsim.contact.patch import FloatArray, SurfaceFields
from wearsim.damage.coefficients.record import CoefficientSet
from wearsim.damage.wear.law import Form, WearLaw
from wearsim.damage.wear.sliding import along_strips, mean_of, patch_total, spread

REGIMES = ("mild", "severe", "catastrophic")

_PASCAL_PER_N_MM2 = 1e6
_KG_M3_PER_UG_M_MM2 = 1e-3


def wear_rate(index: FloatArray, coefficients: CoefficientSet) -> FloatArray:
    r"""Mass lost per distance rolled and contact area, by regime.

    Parameters
    ----------
    index : (...) array
        Wear index :math:`I_w = T\gamma/A` [N/mm2]; below 0 it wears nothing.
    coefficients : CoefficientSet
        Slopes, level and limits as printed: `severe_limit` is the first index of the severe regime,
        `catastrophic_limit` the last.

    Returns
    -------
    (3, ...) array
        :math:`K_w` in the regime the index falls into, zero in the others [ug/(m mm2)].

    Notes
    -----
    Mild: 5.3 I; severe: 55.0; catastrophic: 55.0 + 61.9 (I - 77.2), continuous with the severe branch.
    The coefficient set of [1]_ says why the printed third branch is not taken literally.

    References
    ----------
    .. [1] R. Lewis, R. S. Dwyer-Joyce, Proc. IMechE Part J 218 (2004) 467-478.
    """
    mild = ~(index >= coefficients["severe_limit"])
    catastrophic = index > coefficients["catastrophic_limit"]
    level = coefficients["severe_level"]
    beyond = index - coefficients["catastrophic_limit"]
    return np.stack(
        [
            np.where(mild, coefficients["mild_slope"] * np.maximum(index, 0.0), 0.0),
            np.where(mild | catastrophic, 0.0, level),
            np.where(catastrophic, level + coefficients["catastrophic_slope"] * beyond, 0.0),
        ]
    )


def depth(
    fields: SurfaceFields,
    area: FloatArray,
    coefficients: CoefficientSet,
    *,
    form: Form = "local",
    density: float = 7850.0,
) -> FloatArray:
    r"""Depth removed by one passage of each patch, see `WearLaw`; `work_density` is the local wear index.

    Notes
    -----
    Local: :math:`\Delta z(y) = \frac{1}{\rho} \int K_w(I_w)\,dx`. Patch mean: one index
    :math:`\bar I = \int e\,dy / A` gives the volume :math:`K_w(\bar I) A / \rho` per unit width of rolling
    distance, spread over the strips as their frictional work e(y). Where :math:`K_w` is linear (mild
    regime) both are the same; the tests of [1]_ give the mean only.

    References
    ----------
    .. [1] R. Lewis, R. S. Dwyer-Joyce, Proc. IMechE Part J 218 (2004) 467-478.
    """
    if form == "local":
        index = fields.work_density / _PASCAL_PER_N_MM2
        return along_strips(wear_rate(index, coefficients), fields) * (_KG_M3_PER_UG_M_MM2 / density)
    strip_work = np.maximum(fields.strip_work, 0.0)
    mean_index = mean_of(patch_total(strip_work, fields), area) / _PASCAL_PER_N_MM2
    removed_area = wear_rate(mean_index, coefficients) * area * (_KG_M3_PER_UG_M_MM2 / density)
    return spread(removed_area, strip_work, fields)


def _energy_coefficients(coefficients: CoefficientSet, friction: float, density: float) -> dict[str, float]:  # noqa: ARG001
    per_slope = _KG_M3_PER_UG_M_MM2 / _PASCAL_PER_N_MM2 / density
    return {name: per_slope * coefficients[f"{name}_slope"] for name in ("mild", "catastrophic")}


USFD = WearLaw(
    "usfd",
    depth,
    REGIMES,
    coefficients="lewis_dwyer_joyce_2004",
    parameters=("density",),
    energy_coefficients=_energy_coefficients,
)
