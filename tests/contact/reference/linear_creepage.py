r"""Creepages of a wheelset on a track or on rollers, to second order in its small
angles.

Equations (35)-(37) of the paper below, its misprints corrected and the one missing term
added: formulas to read and to check with. The solver uses the exact vector form of
`creepage.kinematics`.

The paper has z up, y to the left and lists positive contact angles on both sides. Here
x is the rolling direction, y to the right, z down (the paper's axes rotated by 180
degrees about x), so that

========================================  ====================  ==========================================
here                                      in the paper          remark
========================================  ====================  ==========================================
lateral velocity, vertical velocity       minus y-dot, z-dot    to the right, downwards
yaw, yaw rate                             minus psi, psi-dot    positive turns x towards y
roll, roll rate                           phi, phi-dot          positive lowers the right wheel
contact angle                             phi - delta (right),  here to the track, in the paper to the axle,
                                          phi + delta (left)    if there is no yaw
longitudinal creepage                     xi_x
lateral creepage, spin                    minus xi_y, xi_z
========================================  ====================  ==========================================

References
----------
.. [1] B. Liu, S. Bruni, Urban Rail Transit 1 (2016) 215-226.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from wearsim.contact.patch import FloatArray


def linear_creepage(
    *,
    wheel_radius: ArrayLike,
    counterface_z: ArrayLike,
    contact_angle: ArrayLike,
    half_distance: ArrayLike,
    nominal_radius: float,
    curvature: float,
    speed: ArrayLike,
    yaw: ArrayLike = 0.0,
    roll: ArrayLike = 0.0,
    lateral_velocity: ArrayLike = 0.0,
    vertical_velocity: ArrayLike = 0.0,
    yaw_rate: ArrayLike = 0.0,
    roll_rate: ArrayLike = 0.0,
    side: ArrayLike = 0,
    frame: Literal["counterface", "wheel"] = "counterface",
) -> FloatArray:
    r"""Creepages of wheels that turn with V/r0, on straight track or on rollers.

    Parameters
    ----------
    wheel_radius : (m,) array or float
        Rolling radius r at the contact [m].
    counterface_z : (m,) array or float
        Height of the contact on the counterface's profile, positive below its top, so
        that :math:`s/s_0 = 1 - \kappa z` [m].
    contact_angle : (m,) array or float
        To the track, about x, z down; negative on the right wheel's flange, positive on
        the left one's [rad].
    half_distance : (m,) array or float
        l from the middle of the axle to the contact, along the axle, positive on both
        sides [m].
    nominal_radius : float
        Wheel radius :math:`r_0` at the running circle [m].
    curvature : float
        :math:`\kappa = 1/s_0` of the roller; 0 is the rail [1/m].
    speed : (m,) array or float
        V [m/s].
    yaw, roll : (m,) array or float
        :math:`\psi, \phi` of the wheelset [rad].
    lateral_velocity, vertical_velocity : (m,) array or float
        Of its middle, to the right and downwards [m/s].
    yaw_rate, roll_rate : (m,) array or float
        Of the wheelset [rad/s].
    side : (m,) int array or int
        0 right, 1 left wheel.
    frame : {"counterface", "wheel"}
        x along the rolling direction of rail or roller, as everywhere in this package,
        or in the plane of the yawed wheel, as in the paper. The two differ by a turn
        through the yaw angle: in the second order.

    Returns
    -------
    (m, 3) array
        Longitudinal, lateral creepage and spin [-, -, 1/m]: (wheel - counterface)/V,
        left wheels with the signs of the track axes.

    Notes
    -----
    For a right wheel, in the frame of the wheel, with
    :math:`\beta = l \psi \kappa / (1 + r_0 \kappa)`, the angle by which the contact
    moves around the roller, and :math:`\delta = \phi - \theta - \beta\psi`, the contact
    angle :math:`\theta` relative to the axle, in the paper's sign:

    .. math::

        \xi_x &= \tfrac{s}{s_0} - \tfrac{r}{r_0} - \tfrac{l \dot\psi}{V}
            + \tfrac{\dot y \psi - \dot z \beta - l \dot\phi \beta + r \dot\psi \phi}{V}
            - \tfrac12 \psi^2 \tfrac{s}{s_0} \\
        \xi_y &= \tfrac{\dot y - r \dot\phi + r \dot\psi \beta - l \delta \dot\phi - \dot z \delta
            + \dot z \phi}{V} - \tfrac{s}{s_0} (\psi + \beta \phi) \\
        \varphi &= -\tfrac{\delta}{r_0} - \kappa (\delta - \phi + \beta \psi)
            + \tfrac{\dot\psi + \dot\phi \beta}{V}

    These are (35)-(37) of [1]_ with the corrections: in (36) the yaw comes with s/s0
    and without a rate, and the vertical velocity of the right wheel with the signs
    above; (35) gains the term with the square of the yaw. Complete to second order if
    r - r0 and z count as first order, too. A wheel that turns with another speed adds
    :math:`-(r/r_0)` times the relative excess to the first line.

    References
    ----------
    .. [1] B. Liu, S. Bruni, Urban Rail Transit 1 (2016) 215-226.
    """
    given = (
        wheel_radius,
        counterface_z,
        contact_angle,
        half_distance,
        speed,
        yaw,
        roll,
    )
    moving = (lateral_velocity, vertical_velocity, yaw_rate, roll_rate)
    rows = np.broadcast_arrays(np.zeros(1), *given, *moving, side)
    _, r, z, theta, l, v, psi, phi, y_dot, z_dot, psi_dot, phi_dot, left = rows
    sign = np.where(
        left == 0, 1.0, -1.0
    )  # a left wheel is the mirror image of a right one
    theta, psi, phi, y_dot, psi_dot, phi_dot = (
        sign * value for value in (theta, psi, phi, y_dot, psi_dot, phi_dot)
    )
    surface = 1.0 - curvature * z  # s/s0, 1 on a rail
    beta = l * psi * curvature / (1.0 + nominal_radius * curvature)
    delta = phi - theta - beta * psi
    xi_x = (
        surface
        - r / nominal_radius
        - l * psi_dot / v
        + (y_dot * psi - z_dot * beta - l * phi_dot * beta + r * psi_dot * phi) / v
        - 0.5 * psi**2 * surface
    )
    xi_y = (
        y_dot
        - r * phi_dot
        + r * psi_dot * beta
        - l * delta * phi_dot
        - z_dot * delta
        + z_dot * phi
    ) / v - surface * (psi + beta * phi)
    spin = (
        -delta / nominal_radius
        - curvature * (delta - phi + beta * psi)
        + (psi_dot + phi_dot * beta) / v
    )
    if frame == "counterface":
        cosine, sine = np.cos(psi), np.sin(psi)
        xi_x, xi_y = cosine * xi_x - sine * xi_y, cosine * xi_y + sine * xi_x
    # Adding 0.0 turns a mirrored -0.0 into 0.0.
    return np.stack((xi_x, sign * xi_y + 0.0, sign * spin + 0.0), axis=1)
