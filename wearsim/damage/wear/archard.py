r"""Archard's law with a map of the wear coefficient over pressure and sliding speed.

The depth a cell loses in one passage is :math:`\Delta z = k(p, v)\, p\, \Delta s / H`
with the sliding distance :math:`\Delta s = |s| \Delta x / V` [1]_. In the map of [2]_
the coefficient k depends on the sliding speed v in m/s, and so on the running speed:
the same creepage at half the speed may be another regime. Above 0.8 of the hardness H
the surfaces seize; the coefficient, 70 times as large there, is blended over
`seizure_blend` = 5 % of H around that limit, so that wear is a smooth function of the
pressure. At the limits of the speed the coefficient jumps sevenfold; its logarithm is
blended over a range as wide as +-`speed_blend` = 5 % of the limit, moved by about 1 %
so that the mean of the coefficient over the logarithm of the speed is that of the jump:
cells whose slip is known to a per cent would fall on either side by chance. Pressures
of elastic contact models exceed the limit in contacts of small radius, so that the
seizure regime may follow from the assumption of elasticity.

Where the surfaces slip, :math:`|\tau| = \mu p`, so that this law and the energy law
with
:math:`k_e = k / (\mu H)` are one, in any state of partial slip; they differ in what
switches the coefficient.

References
----------
.. [1] J. F. Archard, J. Appl. Phys. 24 (1953) 981, doi:10.1063/1.1721448.
.. [2] T. Jendel, Wear 253 (2002) 89-99.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from wearsim.contact.patch import FloatArray, SurfaceFields
from wearsim.damage.coefficients.record import CoefficientSet
from wearsim.damage.wear.law import Form, WearLaw
from wearsim.damage.wear.sliding import (
    along_strips,
    mean_of,
    patch_total,
    relative_slip,
)

REGIMES = ("mild", "oxidative", "severe", "seizure")
"""Regimes from mild to worst; over the speed they are mild, severe, oxidative."""

SeizureCap = Literal["none", "pressure", "regime"]
SEIZURE_CAPS: tuple[SeizureCap, ...] = ("none", "pressure", "regime")

_COEFFICIENTS = ("k_mild", "k_oxidative", "k_severe", "k_seizure")
_GPA = 1e9
_LEAST = 1e-300  # least value whose logarithm is taken
_OF_MEAN = 201  # number of points of the mean over a blend


def seizure_pressure(coefficients: CoefficientSet) -> float:
    """Return the pressure from which the surfaces seize, to the pascal [Pa]."""
    return float(
        np.round(coefficients["seizure_share"] * coefficients["hardness"] * _GPA)
    )


def by_regime(
    pressure: FloatArray, speed: FloatArray, coefficients: CoefficientSet
) -> FloatArray:
    r"""Part of the wear coefficient in each region of the map, by pressure and speed.

    Parameters
    ----------
    pressure : (...) array
        Contact pressure [Pa].
    speed : (...) array
        Sliding speed [m/s].
    coefficients : CoefficientSet
        With the coefficients, the limits `severe_speed`, `oxidative_speed` and
        `seizure_share` of `hardness`, the width `seizure_blend` of the blend into
        seizure over the hardness, and `speed_blend`, half the width of the blend at a
        limit of the speed over that limit.

    Returns
    -------
    (4, ...) array
        In the order of `REGIMES`; their sum is the wear coefficient [-]. Without blend
        a limit of the speed belongs to the region above it.

    Notes
    -----
    The share of seizure is :math:`s = t^2 (3 - 2t)` with t rising from 0 to 1 over the
    blend, 0.5 at the limit. At a limit of the speed t rises with the logarithm of the
    speed and :math:`k = k_1^{1 - s} k_2^s`, of which the regions below and above the
    limit have 1 - s and s. The blend lies where its mean over the logarithm of the
    speed is that of the jump.
    """
    coefficient = np.array([coefficients[name] for name in _COEFFICIENTS])
    mild, oxidative, severe, seized = coefficient
    limit = seizure_pressure(coefficients)
    blend = coefficients["seizure_blend"] * coefficients["hardness"] * _GPA
    if blend > 0.0 and np.isfinite(limit):
        seizure = _smooth(np.clip((pressure - limit) / blend + 0.5, 0.0, 1.0))
    else:
        seizure = (pressure >= limit).astype(np.float64)
    blend = coefficients["speed_blend"]
    above_mild = _share_above(speed, coefficients["severe_speed"], mild, severe, blend)
    above_severe = _share_above(
        speed, coefficients["oxidative_speed"], severe, oxidative, blend
    )
    above_severe = np.minimum(
        above_severe, above_mild
    )  # limits of a user's set may be close together
    shares = np.stack([1.0 - above_mild, above_severe, above_mild - above_severe])
    logarithm = np.log(np.maximum(coefficient[:3], _LEAST))
    # fixed order: in a matrix product the bits of a patch depend on the other patches
    mean = (
        logarithm[0] * shares[0] + logarithm[1] * shares[1] + logarithm[2] * shares[2]
    )
    unseized = (1.0 - seizure) * np.exp(mean)
    return np.concatenate([shares * unseized, [seizure * seized]])


def _share_above(
    speed: FloatArray,
    limit: float,
    coefficient_below: float,
    coefficient_above: float,
    blend: float,
) -> FloatArray:
    """Share of the region above a speed limit, with coefficients below and above it."""
    if blend == 0.0 or not np.isfinite(limit):
        return (speed >= limit).astype(np.float64)
    half = np.log1p(blend)
    rise = _smooth(np.linspace(0.0, 1.0, _OF_MEAN))
    logarithms = np.log(np.maximum([coefficient_below, coefficient_above], _LEAST))
    mean = np.trapezoid(
        np.exp(logarithms[0] + rise * (logarithms[1] - logarithms[0]))
    ) / (_OF_MEAN - 1)
    moved = (
        0.0
        if coefficient_above == coefficient_below
        else half
        * (2.0 * mean - coefficient_below - coefficient_above)
        / (coefficient_above - coefficient_below)
    )
    away = np.log(np.maximum(speed, _LEAST)) - (np.log(limit) + moved)
    return _smooth(np.clip(0.5 * (away / half + 1.0), 0.0, 1.0))


def _smooth(t: FloatArray) -> FloatArray:
    """Rise smoothly from 0 to 1, with zero slope at both ends."""
    return t * t * (3.0 - 2.0 * t)


def capped(
    fields: SurfaceFields, coefficients: CoefficientSet, cap: SeizureCap
) -> tuple[SurfaceFields, CoefficientSet]:
    """Limit pressures or coefficients so that the seizure regime does not occur.

    With the cap "pressure" no pressure above the seizure limit enters the law, as if
    the material yielded there (the excess load of such cells is discarded). With
    "regime" the pressure is unchanged and the coefficient is that of its slip speed.
    "none" is the map as printed.
    """
    if cap == "none":
        return fields, coefficients
    without = coefficients.with_value("seizure_share", np.inf, f"seizure_cap = {cap}")
    if cap == "regime":
        return fields, without
    # The slip belongs to the pressure of the contact solution: only the load of the
    # cells is cut.
    return replace(
        fields, pressure=np.minimum(fields.pressure, seizure_pressure(coefficients))
    ), without


def depth(
    fields: SurfaceFields,
    area: FloatArray,
    coefficients: CoefficientSet,
    *,
    form: Form = "local",
    seizure_cap: SeizureCap = "none",
) -> FloatArray:
    r"""Depth removed by one passage of each patch [m], see `WearLaw`.

    `seizure_cap` is explained in `capped`.

    Notes
    -----
    :math:`\Delta z(y) = \frac{1}{H}\int k(p, |s|)\, p\, |s|/V\, dx`, the slip scaled as
    the frictional work is, see `relative_slip`. The form "patch_mean" takes the region
    of the map from the mean pressure and the mean sliding speed, weighted with the
    pressure. Both forms agree where k is the same over a patch.
    """
    fields, coefficients = capped(fields, coefficients, seizure_cap)
    hardness = coefficients["hardness"] * _GPA
    slip = relative_slip(fields)
    work = fields.pressure * slip
    if form == "local":
        part = by_regime(
            fields.pressure, slip * fields.speed[:, None, None], coefficients
        )
        return along_strips(part * work, fields) / hardness
    strips = along_strips(work, fields)
    load = patch_total(along_strips(fields.pressure, fields), fields)
    mean_speed = mean_of(patch_total(strips, fields), load) * fields.speed
    part = by_regime(mean_of(load, area), mean_speed, coefficients)
    return part[:, :, None] * strips / hardness


ARCHARD = WearLaw(
    "archard",
    depth,
    REGIMES,
    coefficients="jendel_2002",
    parameters=("hardness", "seizure_blend", "seizure_cap"),
    needs_friction=False,
    rising=("severe_speed", "oxidative_speed"),
    by_slip=lambda coefficients: True,  # noqa: ARG005
    title="Archard",
)
