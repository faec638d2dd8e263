"""How far a wheelset can shift before a wheel climbs its flange."""

from __future__ import annotations

import math

import numpy as np

from wearsim.profile.conicity import facing
from wearsim.profile.shape import Profile

CLIMBING_ANGLE = math.radians(60.0)
"""Contact angle from which on a wheel climbs its flange [rad]."""

_GRID = 0.05e-3  # lateral step of the contact search and of the shifts [m]
_WIDEST = 30e-3  # shift up to which climbing is looked for [m]


def flange_clearance(wheel: Profile, rail: Profile) -> float | None:
    r"""Lateral shift at which a rigid wheel begins to climb its flange.

    Parameters
    ----------
    wheel : Profile
        In the axes of a right wheel.
    rail : Profile
        Placed in the track, so that gauge and flange back distance are in it.

    Returns
    -------
    float or None
        Shift towards the rail, 0 for a wheel that climbs without any, inf if it does not within 30 mm
        [m]; None for a wheel whose flange is nowhere as steep as 60 degrees.

    Notes
    -----
    Rigid profiles without yaw and roll touch where the wheel must be lifted most,
    :math:`h(u) = \max_y (z_w(y - u) - z_r(y))`, and :math:`dh/du` is the tangent of the contact angle
    there. The clearance is the first shift at which this angle is 60 degrees: less than the flank of any
    flange of EN 13715 (70 degrees), and more than the flange root has before the flank takes over. The
    value hardly depends on the choice: S1002 on 60E1 1:40 at gauge 1435 and flange back distance 1360 mm
    passes from 30 to 69 degrees between shifts of 6.55 and 6.65 mm. This definition is wearsim's own.
    """
    from scipy.interpolate import CubicSpline  # 0.5 s to import, only spent where it is needed

    (wheel_y, wheel_z), (rail_y, rail_z) = facing(wheel), facing(rail)
    steep = math.tan(CLIMBING_ANGLE)
    flank = wheel_y < 0.0
    if not np.any(np.diff(wheel_z[flank]) <= -steep * np.diff(wheel_y[flank])):
        return None
    grid = np.arange(rail_y[0], rail_y[-1], _GRID)
    counter = CubicSpline(rail_y, rail_z)(grid)
    height = CubicSpline(wheel_y, wheel_z)
    shift = _GRID * np.arange(round(_WIDEST / _GRID) + 1)
    at = grid - shift[:, None]
    inside = (at >= wheel_y[0]) & (at <= wheel_y[-1])
    lift = np.where(inside, height(np.clip(at, wheel_y[0], wheel_y[-1])) - counter, -np.inf).max(axis=1)
    climbing = np.flatnonzero(np.diff(lift) >= steep * _GRID)
    return float(shift[climbing[0]]) if len(climbing) else math.inf
