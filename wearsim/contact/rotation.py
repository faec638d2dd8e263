"""Rules for the rotation speed of a wheelset."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from wearsim.contact.creepage import Kinematics
from wearsim.contact.patch import FloatArray, IntArray
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
        All rows are iterated together by regula falsi (Illinois), each bracketed.

    Raises
    ------
    NumericalError
        If an applied torque is beyond what friction can carry.
    """
    nothing = scale == 0.0  # without friction any speed balances a zero torque: keep the nominal one
    if applied != 0.0 and (nothing.any() or np.any(abs(applied) > 2.1 * scale)):
        raise NumericalError(
            f"an axle torque of {applied:g} N m is more than friction can carry "
            f"({2.0 * float(scale.min()):.3g} N m); lower the torque or raise the friction coefficient"
        )
    goal = np.maximum(scale, 1e-300) * _TOLERANCE
    step = np.abs(nominal) * 2e-3
    low, high = nominal - step, nominal + step
    above, below = torque(low) - applied, torque(high) - applied
    for _ in range(12):
        wide_low, wide_high = (above < 0.0) & ~nothing, (below > 0.0) & ~nothing
        if not (wide_low.any() or wide_high.any()):
            break
        step = 2.0 * step
        low = np.where(wide_low, low - step, low)
        high = np.where(wide_high, high + step, high)
        above = np.where(wide_low, torque(low) - applied, above)
        below = np.where(wide_high, torque(high) - applied, below)
    if np.any(((above < 0.0) | (below > 0.0)) & ~nothing):
        raise NumericalError("no rotation speed balances the axle torque; lower the applied torque")
    f_low, f_high = above.copy(), below.copy()
    speed, last, done = nominal.copy(), np.zeros(nominal.size), nothing.copy()
    for _ in range(60):
        width = f_low - f_high
        flat = width <= 0.0
        share = np.where(flat, 0.5, f_low / np.where(flat, 1.0, width))
        # A row that is done keeps its speed, so that it does not depend on its neighbours in the batch.
        speed = np.where(done, speed, low + share * (high - low))
        value = torque(speed) - applied
        done |= (np.abs(value) <= goal) | (np.abs(high - low) <= 1e-14 * np.abs(nominal))
        if done.all():
            break
        rising = value > 0.0
        low, high = np.where(rising, speed, low), np.where(rising, high, speed)
        # Illinois: halve the value kept at the end that did not move twice in a row.
        f_high = np.where(rising, np.where(last > 0, 0.5 * f_high, f_high), value)
        f_low = np.where(rising, value, np.where(last < 0, 0.5 * f_low, f_low))
        last = np.where(rising, 1.0, -1.0)
    return speed
