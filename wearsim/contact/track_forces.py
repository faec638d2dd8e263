r"""Forces of contact patches in the axes of the track.

With the normal force :math:`N`, contact angle :math:`\delta`, creep forces
:math:`F_x, F_y` and spin moment :math:`M_z` of a contact plane in its frame, and its
place :math:`x, y, z` from the middle of the axle,

.. math::
    T &= N \sin\delta + F_y \cos\delta \\
    Q &= N \cos\delta - F_y \sin\delta - \kappa x_N F_x \\
    X &= F_x + \kappa x_N (N \cos\delta - F_y \sin\delta) \\
    M &= x T + (x_N - x) N \sin\delta - y X + M_z \cos\delta, \qquad R = y Q + z T

with the curvature :math:`\kappa` of the counterface (0: rail) and the longitudinal
position :math:`x_N` of the normal force, which is x but for strips in planes of their
own. Those of a patch are the sums over its planes. T acts to the right, Q upward and X
forward on the wheel (`spec/operation.md`, section 1).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.contact.patch import FloatArray
from wearsim.contact.wheels import Planes, Wheels


class TrackForces(NamedTuple):
    """Forces and moments of patches (m,) in the axes of the track."""

    lateral: FloatArray  # T [N]
    vertical: FloatArray  # Q [N]
    longitudinal: FloatArray  # X [N]
    yaw_moment: (
        FloatArray  # M, about the vertical axis through the middle of the axle [N m]
    )
    # R, about the longitudinal axis through the middle of the axle [N m]
    roll_moment: FloatArray


def track_forces(
    wheels: Wheels,
    planes: Planes,
    force: FloatArray,
    z: FloatArray,
    curvature: FloatArray,
) -> TrackForces:
    """Sum the forces on the planes of each patch.

    Parameters
    ----------
    wheels : Wheels
        Of m patches, in the axes of a right wheel.
    planes : Planes
        Their N planes each.
    force : (m, N, 3) array
        Longitudinal and lateral creep force and moment in each plane [N, N, N m].
    z : (m, N) array
        Vertical position of the planes from the middle of the axle, down [m].
    curvature : (m,) array
        Of the counterface [1/m].

    Returns
    -------
    TrackForces
        In the axes of the track for wheels of both sides.
    """
    normal, middle = planes.normal_force, planes.middle
    sine, cosine = np.sin(planes.angle), np.cos(planes.angle)
    x, y = wheels.kinematics.x, wheels.origin_y[:, None] + planes.y
    along, across, spin_moment = force[:, :, 0], force[:, :, 1], force[:, :, 2]
    tilt = curvature[:, None] * (x + middle)
    upward = normal * cosine - across * sine
    lateral = normal * sine + across * cosine
    vertical = upward - tilt * along
    longitudinal = along + tilt * upward
    yaw_moment = (
        x * lateral + middle * normal * sine - y * longitudinal + spin_moment * cosine
    )
    roll_moment = y * vertical + z * lateral
    sign = wheels.sign
    return TrackForces(
        lateral=sign * lateral.sum(axis=1),
        vertical=vertical.sum(axis=1),
        longitudinal=longitudinal.sum(axis=1),
        yaw_moment=sign * yaw_moment.sum(axis=1),
        roll_moment=sign * roll_moment.sum(axis=1),
    )
