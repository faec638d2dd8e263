r"""British Rail Research wear law: cross-section area lost per distance over T-gamma.

The area A that the section of a wheel of diameter D loses per distance is a function of
the patch's wear number :math:`T\gamma` in three branches [1]_. The volume per distance
:math:`\pi D A` does not depend on D, because the law has D in its denominator. It is
distributed over the strips in proportion to their frictional work. A law of the whole
patch has no local form.

References
----------
.. [1] T. G. Pearce, N. D. Sherratt, Wear 144 (1991) 343-351.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.patch import FloatArray, SurfaceFields
from wearsim.damage.coefficients.record import CoefficientSet
from wearsim.damage.wear.law import Form, WearLaw
from wearsim.damage.wear.sliding import patch_total, spread

REGIMES = ("mild", "plateau", "severe")

_M2_PER_MM3_KM = 1e-12  # mm2/km times mm of diameter: 1e-9 m3 per 1e3 m


def area_loss(wear_number: FloatArray, coefficients: CoefficientSet) -> FloatArray:
    r"""Cross-section area lost per km times wheel diameter, by branch.

    Parameters
    ----------
    wear_number : (...) array
        :math:`T\gamma` of a patch [N]; below 0 it wears nothing.
    coefficients : CoefficientSet
        Slopes, level and limits as quoted.

    Returns
    -------
    (3, ...) array
        In the branch the wear number falls into, zero in the others [mm2/km mm].
    """
    mild = wear_number < coefficients["plateau_start"]
    severe = wear_number > coefficients["plateau_end"]
    line = coefficients["severe_slope"] * wear_number - coefficients["severe_offset"]
    return np.stack(
        [
            np.where(
                mild, coefficients["mild_slope"] * np.maximum(wear_number, 0.0), 0.0
            ),
            np.where(~mild & ~severe, coefficients["plateau_level"], 0.0),
            np.where(severe, line, 0.0),
        ]
    )


def depth(
    fields: SurfaceFields,
    area: FloatArray,  # noqa: ARG001 -- the signature of every wear law
    coefficients: CoefficientSet,
    *,
    form: Form = "patch_mean",  # noqa: ARG001
) -> FloatArray:
    r"""Depth removed by one passage of each patch, see `WearLaw`.

    Notes
    -----
    :math:`T\gamma` is the integral of the frictional work over the width, the power
    over the speed, and so with the work of spin. Depth :math:`\Delta z(y) = \pi A D\,
    e(y) / \int e\,dy`: per metre rolled a strip meets one metre of its circumference.
    """
    strip_work = np.maximum(fields.strip_work, 0.0)
    wear_number = patch_total(strip_work, fields)
    volume = np.pi * _M2_PER_MM3_KM * area_loss(wear_number, coefficients)
    return spread(volume, strip_work, fields)


BRR = WearLaw(
    "brr",
    depth,
    REGIMES,
    "pearce_sherratt_1991",
    forms=("patch_mean",),
    needs_fields=False,
    rising=("plateau_start", "plateau_end"),
    title="BRR",
)
