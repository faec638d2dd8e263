"""Rules for the rotation speed of a wheelset."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from wearsim.contact.creepage import Kinematics
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.root import falling_root
from wearsim.errors import NumericalError

RULES = ("free", "centred", "nominal")

_TOLERANCE = 1e-9  # torque, relative to friction coefficient x wheel load x radius


def without_creepage(motion: Kinematics, row: IntArray, rows: int) -> FloatArray:
    """Rotation speed at which the first (most loaded) patch of each row has no longitudinal creepage.

    Parameters
    ----------
    motion : Kinematics
        Of (m,) patches, ordered by row and falling normal force.
    row : (m,) int array
        Row of each patch.
    rows : int
        Number of rows.

    Returns
    -------
    (rows,) array
        [rad/s].
    """
    first = np.searchsorted(row, np.arange(rows))
    speed: FloatArray = -motion.at_rest[first, 0] / motion.per_speed[first, 0]
    return speed


def balanced(
    torque: Callable[[FloatArray], FloatArray], nominal: FloatArray, applied: float, scale: FloatArray
) -> FloatArray:
    """Rotation speed at which the creep forces of both wheels balance the applied torque.

    Parameters
    ----------
    torque : callable
        Torque of the creep forces about the axle [N m] for (n,) rotation speeds [rad/s]; falls with them.
    nominal : (n,) array
        V / r0 with its sign: the first guess [rad/s].
    applied : float
        Applied torque in the rolling direction [N m].
    scale : (n,) array
        Friction coefficient x wheel load x radius: what one wheel can carry at most, about [N m].

    Returns
    -------
    (n,) array
        [rad/s].

    Raises
    ------
    NumericalError
        If an applied torque is beyond what friction can carry.
    """
    nothing = scale == 0.0  # without friction any speed balances a zero torque: keep the nominal one
    beyond = (abs(applied) > 2.1 * scale) | (nothing & (applied != 0.0))
    if beyond.any():
        row = int(np.argmax(beyond))
        raise NumericalError(
            f"an axle torque of {applied:g} N m is more than friction can carry "
            f"({2.0 * scale[row]:.3g} N m); lower the torque or raise the friction coefficient",
            row=row,
        )
    speed, found = falling_root(
        lambda speed: torque(speed) - applied,
        nominal,
        np.abs(nominal) * 2e-3,
        goal=np.maximum(scale, 1e-300) * _TOLERANCE,
        narrow=1e-14 * np.abs(nominal),
        done=nothing,
    )
    if not found.all():
        raise NumericalError(
            "no rotation speed balances the axle torque; lower the applied torque",
            row=int(np.argmin(found)),
        )
    return speed
