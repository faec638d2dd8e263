r"""Faint patches fade out of a campaign, and what they lose is counted.

Measured and worn profiles touch in slivers that carry next to nothing, yet hold up the wear step and trip
over the limits of models. The weight of a patch follows from its shares :math:`s_k` of the load, the
frictional power and the wear of its wheel at the operating point,

.. math:: w = 1 - \prod_k (1 - u_k), \qquad u = t^2 (3 - 2 t), \qquad
          t = \operatorname{clip}(\lg(s / 10^{-4}), 0, 1):

smooth in each share, 0 where all of them are below a tenth of `FAINT`, 1 where one of them reaches it: by a
law that jumps with the pressure a thousandth of the load can do much of the wear. Forces, power, work, depths
and damage of each patch are multiplied by w and by the factor that keeps the sum of the normal forces of the
wheel. Depths by a comparison law have a weight of their own, by the wear of that law: it counts where the
active law does not wear, yet changes nothing else. Patches whose weights are all 0 are left out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from wearsim.campaign.passage import Passage
from wearsim.contact.normal.model import FAINT
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.wheels import joined
from wearsim.operation.points import OperatingPoints

_GONE = 0.1 * FAINT

_FORCES = (
    "normal_force", "force_x", "force_y", "spin_moment", "power", "track_lateral", "track_vertical",
    "track_longitudinal", "track_yaw_moment", "track_roll_moment",
)  # fmt: skip


def weight_of(share: FloatArray) -> FloatArray:
    """Weight of patches by their shares of what their wheel carries and does.

    Parameters
    ----------
    share : (k, m) array
        Of load, power and wear [-].

    Returns
    -------
    (m,) array
        0 to 1, once continuously differentiable [-].
    """
    t = np.clip(np.log(np.maximum(share, _GONE) / _GONE) / np.log(FAINT / _GONE), 0.0, 1.0)
    weight: FloatArray = 1.0 - np.prod(1.0 - t * t * (3.0 - 2.0 * t), axis=0)
    return weight


def _by_wheel(passage: Passage) -> tuple[IntArray, IntArray, FloatArray]:
    """Wheel (m,) of each patch; its first patch; load, power and worn area (3, m) of each patch."""
    contact = passage.contact
    _, first, of = np.unique(2 * contact.point + contact.side, return_index=True, return_inverse=True)
    worn = _worn(passage.depth, contact.patch.width)
    return of, first, np.stack([contact.normal_force, contact.power, worn])


def _worn(depth: tuple[FloatArray, ...], width: FloatArray) -> FloatArray:
    """Worn area (m,) of depths (m, ny) by regimes."""
    area: FloatArray = sum((regime.sum(axis=1) for regime in depth), np.zeros(width.size)) * width
    return area


def _summed(of: IntArray, amount: FloatArray) -> FloatArray:
    """Add up amounts (k, m) of the patches of each wheel."""
    return np.stack([np.bincount(of, each) for each in amount])


def _shares(of: IntArray, amount: FloatArray) -> FloatArray:
    """Shares of amounts (k, m) of patches of those of their wheels [-]."""
    whole = _summed(of, amount)
    share: FloatArray = amount / np.where(whole > 0.0, whole, 1.0)[:, of]
    return share


def _factor(of: IntArray, weight: FloatArray, load: FloatArray) -> FloatArray:
    """Factor (m,) of patches by their weights that keeps the load of each wheel."""
    factor: FloatArray = weight * (np.bincount(of, load) / np.bincount(of, weight * load))[of]
    return factor


def faded(passage: Passage) -> Passage:
    """Fade out the faint patches of a passage in which all act in full.

    Returns
    -------
    Passage
        With the weight of each patch left, and what its wheel lost.
    """
    of, _, amount = _by_wheel(passage)
    share = _shares(of, amount)
    weight = weight_of(share)
    if (weight == 1.0).all():
        return passage
    contact, comparison = passage.contact, passage.comparison
    factor, depths, kept = _factor(of, weight, amount[0]), [], weight > 0.0
    for law in comparison.depth:
        worn = _worn(law, contact.patch.width)
        law_weight = np.maximum(weight, weight_of(np.stack([*share[:2], *_shares(of, worn[None])])))
        depths.append(tuple(_factor(of, law_weight, amount[0])[:, None] * depth for depth in law))
        kept |= law_weight > 0.0
    smaller = _times(factor, passage)
    smaller = replace(
        smaller,
        work_density_max=factor * passage.work_density_max,
        comparison=replace(smaller.comparison, depth=tuple(depths)),
        weight=weight,
        lost=_summed(of, (1.0 - weight) * share).T[of],
    )
    left: Passage = joined([smaller], np.flatnonzero(kept))
    return left


def shared(passage: Passage, share: FloatArray) -> Passage:
    """Passage of patches that act in shares of the distance of their points, those of its runs (n,)."""
    factor = share[passage.contact.point]
    return passage if (factor == 1.0).all() else replace(_times(factor, passage), share=factor)


def _times(factor: FloatArray, passage: Passage) -> Passage:
    """Passage with factors (m,) on forces, work, depths and damage of its patches."""

    def of(values: tuple[FloatArray, ...]) -> tuple[FloatArray, ...]:
        return tuple(factor[:, None] * value for value in values)

    contact, comparison = passage.contact, passage.comparison
    forces = {name: factor * getattr(contact, name) for name in _FORCES}
    laws = replace(comparison, depth=tuple(map(of, comparison.depth)), damage=of(comparison.damage))
    (work,), depth = of((passage.strip_work,)), of(passage.depth)
    return replace(passage, contact=replace(contact, **forces), strip_work=work, depth=depth, comparison=laws)


def lost_row(passage: Passage, points: OperatingPoints, weight: FloatArray) -> Mapping[str, FloatArray]:
    """Return what faint patches of points of a weight (n,) lost, by the variables of a row."""
    of, first, each = _by_wheel(passage)
    point, lost = passage.contact.point[first], passage.lost[first].T
    amount = _summed(of, each) * weight[point]
    amount[1] /= points.conditions.speed[point]
    amount[2] *= points.environment[point]
    whole = amount.sum(axis=1)
    mean = (amount * lost).sum(axis=1) / np.where(whole > 0.0, whole, 1.0)
    names = ("faint_load", "faint_power", "faint_wear")
    return {
        **dict(zip(names, mean, strict=True)),
        **{f"{name}_max": most for name, most in zip(names, lost.max(axis=1, initial=0.0), strict=True)},
    }
