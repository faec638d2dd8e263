r"""Competition of wear and fatigue: magic wear rate and the limit of a wheel's life.

A crack that grows by :math:`g` along a plane at the angle :math:`\theta` to the surface
in each passage loses :math:`\Delta z/\sin\theta` of its length to wear of the depth
:math:`\Delta z` [1]_: it does not grow where :math:`\Delta z = g \sin\theta`, the
"magic wear rate". With damage in place of length, damage 1 standing for a crack of a
stated depth h, wear removes :math:`\Delta z/h`, and the balance is at
:math:`\Delta z = h\,\Delta D`.

References
----------
.. [1] B. Dirks, R. Enblom, A. Ekberg, M. Berg, FFEMS 38 (2015) 1478-1491.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wearsim.contact.patch import FloatArray, IntArray

LIMITED_BY = ("nothing", "wear", "cracks")


def damage_after(
    damage: FloatArray, added: FloatArray, worn: FloatArray, crack_depth: float
) -> FloatArray:
    r"""Damage after a step, :math:`\max(D + \Delta D - \Delta z/h, 0)` [-].

    Both rates are constant over the step.

    Parameters
    ----------
    damage : (...) array
        Before [-].
    added : (...) array
        By the rising branch of the law, without removal [-].
    worn : (...) array
        Wear depth of the step [m].
    crack_depth : float
        h, the depth of a crack of damage 1 [m].

    Returns
    -------
    (...) array
        Exact for constant rates: once at zero it stays there [-].
    """
    return np.maximum(damage + added - worn / crack_depth, 0.0)


@dataclass(frozen=True)
class Balance:
    """Balance of wear and fatigue at each point of a profile.

    Parameters
    ----------
    magic_wear_rate : (...) array
        Wear rate at which cracks just do not grow [m/m].
    crack_distance, wear_distance : (...) array
        Distance to damage 1, and to the wear limit; infinite where it is never met [m].
    limited_by : (...) int array
        Index into `LIMITED_BY`: what is met first.
    """

    magic_wear_rate: FloatArray
    crack_distance: FloatArray
    wear_distance: FloatArray
    limited_by: IntArray


def balance(
    damage_rate: FloatArray,
    wear_rate: FloatArray,
    *,
    crack_depth: float,
    wear_limit: float,
) -> Balance:
    """Find whether wear or cracks limit the life of each point at constant rates.

    Parameters
    ----------
    damage_rate : (...) array
        Damage per metre run without removal by wear [1/m].
    wear_rate : (...) array
        Depth per metre run [m/m].
    crack_depth : float
        Depth of a crack of damage 1 [m].
    wear_limit : float
        Depth that may wear [m].

    Returns
    -------
    Balance
        Where both distances are equal, wear limits.
    """
    grown = damage_rate - wear_rate / crack_depth
    crack_distance = _distance(1.0, grown)
    wear_distance = _distance(wear_limit, wear_rate)
    first = np.where(wear_distance <= crack_distance, 1, 2)
    limited = np.where(np.isinf(crack_distance) & np.isinf(wear_distance), 0, first)
    return Balance(
        damage_rate * crack_depth,
        crack_distance,
        wear_distance,
        limited.astype(np.int64),
    )


def _distance(limit: float, rate: FloatArray) -> FloatArray:
    grows = rate > 0.0
    return np.where(grows, limit / np.where(grows, rate, 1.0), np.inf)
