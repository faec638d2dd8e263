r"""Curving of a bogie: quasi-static balance of two wheelsets and their frame.

With lateral positions y, yaw p of the leading (1) and the trailing wheelset (2) against
the local track, those of the frame :math:`y_b, p_b`, half the wheelbase a and the
curvature k, the springs are extended by

.. math::
    d_1 &= y_b + a p_b - k a^2/2 - y_1, & t_1 &= p_b - k a - p_1 \\
    d_2 &= y_b - a p_b - k a^2/2 - y_2, & t_2 &= p_b + k a - p_2

and with the unbalanced acceleration A the wheelsets and the frame balance

.. math::
    H_{c,i} + k_y d_i + m_w A &= 0, \qquad M_{c,i} + k_p t_i = 0 \\
    -k_y (d_1 + d_2) + (m_b + m_c/2) A &= 0 \\
    -a k_y (d_1 - d_2) - k_p (t_1 + t_2) + K_s (\mp k c - p_b) &= 0

where :math:`H_c, M_c` are the resultants of the contact
(`wearsim.operation.resultants`). The frame is eliminated.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from wearsim.contact.patch import FloatArray, IntArray
from wearsim.quantities import GRAVITY


@dataclass(frozen=True)
class Vehicle:
    """Vehicle of two bogies of two axles.

    Stiffnesses are those of both springs of an axle together.
    """

    half_wheelbase: float  # of a bogie [m]
    half_pivot_distance: float  # of both bogies [m]
    wheelset_mass: float  # [kg]
    bogie_mass: float
    body_mass: float
    bogie_height: float  # height of the centre of gravity above the rails [m]
    body_height: float
    lateral_stiffness: float  # of the primary suspension, per axle [N/m]
    yaw_stiffness: float  # of the primary suspension, per axle [N m/rad]
    secondary_yaw_stiffness: float = 0.0  # of a bogie against the body [N m/rad]
    roll_coefficient: float = 0.0
    axle_yaw_offset: float = (
        0.0  # of the leading axle in its bogie, -1 times that of the trailing one [rad]
    )

    @property
    def axle_load(self) -> float:
        """Vertical load of each axle on straight track [N]."""
        return GRAVITY * (
            self.wheelset_mass + self.bogie_mass / 2.0 + self.body_mass / 4.0
        )

    def box_moment(self, acceleration: FloatArray, wheel_radius: float) -> FloatArray:
        """Roll moment (n,) of the masses above an axle about x at axle height [N m]."""
        bogie = self.bogie_mass * (self.bogie_height - wheel_radius)
        body = (
            self.body_mass
            / 2.0
            * (self.body_height - wheel_radius)
            * (1.0 + self.roll_coefficient)
        )
        return acceleration * (bogie + body) / 2.0


@dataclass(frozen=True)
class Bogies:
    """Pairs of operating points that are the two axles of a bogie, `m` of them."""

    vehicle: Vehicle
    leading: IntArray  # (m,) operating points
    trailing: IntArray
    acceleration: (
        FloatArray  # (m,) unbalanced, to the right, of forces on the vehicle [m/s2]
    )
    # (m,) 1 for the leading bogie of the vehicle, -1 for the trailing one
    in_front: FloatArray

    @property
    def points(self) -> IntArray:
        """Operating points (2 m,) of all axles, leading ones first."""
        return np.concatenate([self.leading, self.trailing])

    def at(self, index: IntArray) -> Bogies:
        """Return the bogies at `index`."""
        ends = self.leading[index], self.trailing[index]
        return Bogies(
            self.vehicle, *ends, self.acceleration[index], self.in_front[index]
        )


def suspension(
    vehicle: Vehicle,
    state: FloatArray,
    curvature: FloatArray,
    acceleration: FloatArray,
    in_front: FloatArray,
) -> FloatArray:
    """Return the forces of springs and inertia on both wheelsets [N, N m].

    The frame is in balance.

    Parameters
    ----------
    vehicle : Vehicle
        With its stiffness.
    state : (m, 4) array
        Lateral position and yaw of the leading, then of the trailing wheelset [m, rad].
    curvature, acceleration, in_front : (m,) array
        Of the track, positive to the right [1/m]; unbalanced, to the right [m/s2]; see
        `Bogies`.

    Returns
    -------
    (m, 4) array
        Lateral force and yaw moment on the leading, then on the trailing
        wheelset [N, N m].
    """
    y1, p1, y2, p2 = state.T
    a, ky, kp, ks = (
        vehicle.half_wheelbase,
        vehicle.lateral_stiffness,
        vehicle.yaw_stiffness,
        vehicle.secondary_yaw_stiffness,
    )
    sprung = (vehicle.bogie_mass + vehicle.body_mass / 2.0) * acceleration
    p1, p2 = (
        p1 - vehicle.axle_yaw_offset,
        p2 + vehicle.axle_yaw_offset,
    )  # in the coordinates of the springs
    frame_y = 0.5 * (sprung / ky + curvature * a * a + y1 + y2)
    turned = (
        a * ky * (y1 - y2)
        + kp * (p1 + p2)
        - ks * in_front * curvature * vehicle.half_pivot_distance
    )
    frame_yaw = turned / (2.0 * a * a * ky + 2.0 * kp + ks)
    middle = frame_y - curvature * a * a / 2.0
    inertia = vehicle.wheelset_mass * acceleration
    return np.stack(
        [
            ky * (middle + a * frame_yaw - y1) + inertia,
            kp * (frame_yaw - curvature * a - p1),
            ky * (middle - a * frame_yaw - y2) + inertia,
            kp * (frame_yaw + curvature * a - p2),
        ],
        axis=1,
    )


def spring_slope(vehicle: Vehicle) -> FloatArray:
    """Return the derivatives (4, 4) of the linear forces of `suspension` by state."""
    step = 1e-3
    state = np.concatenate([step * np.eye(4), np.zeros((1, 4))])
    force = suspension(replace(vehicle, axle_yaw_offset=0.0), state, *[np.zeros(5)] * 3)
    return np.asarray((force[:4] - force[4]).T / step)
