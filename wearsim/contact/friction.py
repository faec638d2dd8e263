"""Friction coefficient: contact angles of tread and flange, and its fall with slip.

References
----------
.. [1] O. Polach, Creep forces in simulations of traction vehicles running on adhesion
   limit, Wear 258 (2005) 992-1000, doi:10.1016/j.wear.2004.03.046.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.patch import FloatArray

TREAD_ANGLE, FLANGE_ANGLE = np.radians(20.0), np.radians(40.0)
"""Contact angles up to which tread friction and from which flange friction applies."""


def falling_friction(
    slip_velocity: FloatArray, ratio: float, decrease: float
) -> FloatArray:
    r"""Friction coefficient over that at rest [-].

    Parameters
    ----------
    slip_velocity : array
        Magnitude of the rigid slip velocity V [m/s].
    ratio : float
        Friction coefficient at large slip velocity over that at rest, A [-].
    decrease : float
        Coefficient B of its exponential decrease [s/m].

    Returns
    -------
    array
        As the slip velocity, from 1 at rest to A.

    Notes
    -----
    :math:`\mu(V) = \mu_0 [(1 - A) e^{-B V} + A]` [1]_. V is the rigid slip velocity,
    one for a patch or strip: with a local :math:`\mu(|s|)` steady rolling would have
    several solutions.

    References
    ----------
    .. [1] O. Polach, Wear 258 (2005) 992-1000, doi:10.1016/j.wear.2004.03.046.
    """
    falling: FloatArray = ratio + (1.0 - ratio) * np.exp(-decrease * slip_velocity)
    return falling
