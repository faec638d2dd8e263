"""Sheffield (USFD) wear law: mass lost per distance and area over T-gamma/A."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.contact.kernel import kernel, plain
from wearsim.contact.patch import FloatArray, SurfaceFields
from wearsim.damage.coefficients.record import CoefficientSet
from wearsim.damage.wear.law import Form, WearLaw
from wearsim.damage.wear.sliding import mean_of, patch_total, spread

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
        Slopes, level and limits as printed: `severe_limit` is the first index of the
        severe regime, `catastrophic_limit` the last.

    Returns
    -------
    (3, ...) array
        :math:`K_w` in the regime the index falls into, zero in the others [ug/(m mm2)].

    Notes
    -----
    Mild: 5.3 I; severe: 55.0; catastrophic: 55.0 + 61.9 (I - 77.2), continuous with the
    severe branch. The coefficient set of [1]_ says why the printed third branch is not
    taken literally.

    References
    ----------
    .. [1] R. Lewis, R. S. Dwyer-Joyce, Proc. IMechE Part J 218 (2004) 467-478.
    """
    index = np.asarray(index)
    rate = _integral(
        index.reshape(1, 1, -1), 1.0, np.ones((1, index.size)), coefficients
    )
    return rate.reshape(len(REGIMES), *index.shape)


class _Law(NamedTuple):
    """Coefficients of the three branches, by the names of a set [N/mm2, ug/(m mm2)]."""

    mild_slope: float
    severe_limit: float
    severe_level: float
    catastrophic_limit: float
    catastrophic_slope: float


def _integral(
    index: FloatArray, unit: float, length: FloatArray, coefficients: CoefficientSet
) -> FloatArray:
    """Integral (3, m, ny) of K_w along strips, from wear indices (m, nx, ny).

    Indices are in the unit of the law; the cell lengths are the step of integration.
    """
    law = _Law(*(float(coefficients[name]) for name in _Law._fields))
    out = np.zeros((len(REGIMES), *length.shape))
    _sum_cells(plain(index), unit, law, out)
    return out * length


@kernel
def _sum_cells(index: FloatArray, unit: float, law: _Law, out: FloatArray) -> None:
    """Add K_w of each cell to the sum of its strip in its regime.

    NaN counts as mild and stays NaN.
    """
    for m in range(index.shape[0]):
        for i in range(index.shape[1]):
            for j in range(index.shape[2]):
                value = index[m, i, j] / unit
                severe, catastrophic = (
                    value >= law.severe_limit,
                    value > law.catastrophic_limit,
                )
                beyond = law.severe_level + law.catastrophic_slope * (
                    value - law.catastrophic_limit
                )
                out[0, m, j] += (
                    0.0 if severe or value <= 0.0 else law.mild_slope * value
                )
                out[1, m, j] += law.severe_level if severe and not catastrophic else 0.0
                out[2, m, j] += beyond if catastrophic else 0.0


def depth(
    fields: SurfaceFields,
    area: FloatArray,
    coefficients: CoefficientSet,
    *,
    form: Form = "local",
    density: float = 7850.0,
) -> FloatArray:
    r"""Depth removed by one passage of each patch [m], see `WearLaw`.

    `work_density` is the local wear index.

    Notes
    -----
    Local: :math:`\Delta z(y) = \frac{1}{\rho} \int
    K_w(I_w)\,dx`. Patch mean: one index :math:`\bar I = \int e\,dy /
    A` gives the volume :math:`K_w(\bar I) A / \rho` per unit width of rolling distance,
    spread over the strips as their frictional work e(y). Where :math:`K_w` is linear
    (mild regime) both are the same; the tests of [1]_ give the mean only.

    References
    ----------
    .. [1] R. Lewis, R. S. Dwyer-Joyce, Proc. IMechE Part J 218 (2004) 467-478.
    """
    if form == "local":
        rate = _integral(
            fields.work_density, _PASCAL_PER_N_MM2, fields.cell_length, coefficients
        )
        return rate * (_KG_M3_PER_UG_M_MM2 / density)
    strip_work = np.maximum(fields.strip_work, 0.0)
    mean_index = mean_of(patch_total(strip_work, fields), area) / _PASCAL_PER_N_MM2
    removed_area = (
        wear_rate(mean_index, coefficients) * area * (_KG_M3_PER_UG_M_MM2 / density)
    )
    return spread(removed_area, strip_work, fields)


USFD = WearLaw(
    "usfd",
    depth,
    REGIMES,
    "lewis_dwyer_joyce_2004",
    parameters=("density",),
    needs_fields=False,
    rising=("severe_limit", "catastrophic_limit"),
    title="USFD",
)
