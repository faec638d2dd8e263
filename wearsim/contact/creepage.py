r"""The kinematical problem: creepage in exact vector form.

Creepage is the velocity of the wheel's surface minus that of the counterface, over V, in the contact
frame: e_x along the rolling direction of the counterface, e_s across in the contact plane, e_n into the
counterface. Both surface velocities are those of the undeformed bodies at the pressure-weighted centre of
the patch, in the planes that stand for them: half-spaces meet in one plane. That of the counterface goes
through its profile at the centre; that of the wheel lies the rigid approach deeper along the normal, where
the wheel would be in its way the most. In a patch that is bent this is some micrometres off the wheel's
profile at the centre. The counterface turns with :math:`\omega = (0, \kappa V, -V/R)`; a rail has kappa = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from wearsim.contact.patch import FloatArray

if TYPE_CHECKING:
    from wearsim.contact.geometry import WheelsetPose


@dataclass(frozen=True)
class Kinematics:
    """Creepage as a linear function of the wheel's rotation speed: at_rest + rotation_speed * per_speed.

    Parameters
    ----------
    at_rest, per_speed : (m, 3) array
        Longitudinal, lateral creepage and spin [-, -, 1/m], and the same per rotation speed [s/rad].
    x : (m,) array
        Longitudinal position of the contact, from the middle of the axle [m].
    down : (m, 3) array
        Parts straight down of the contact frame's directions: rolling, across, normal into the counterface.
    """

    at_rest: FloatArray
    per_speed: FloatArray
    x: FloatArray
    down: FloatArray

    def creepage(self, rotation_speed: FloatArray) -> FloatArray:
        """Creepages (m, 3) for (m,) rotation speeds [rad/s]."""
        return self.at_rest + rotation_speed[:, None] * self.per_speed


def moved(motion: Kinematics, along: FloatArray, across: FloatArray) -> Kinematics:
    """Creepage of the same rigid planes at another point of them.

    Parameters
    ----------
    motion : Kinematics
        Of m patches.
    along, across : (m,) array
        To the new point, forwards and to the field side [m].

    Returns
    -------
    Kinematics
        With the same spin.
    """

    def at(value: FloatArray) -> FloatArray:
        longitudinal, lateral, spin = value.T
        return np.stack((longitudinal - spin * across, lateral + spin * along, spin), axis=1)

    return Kinematics(at(motion.at_rest), at(motion.per_speed), motion.x + along, motion.down)


@dataclass(frozen=True)
class ContactPoint:
    """Creepage reference points on wheel and counterface.

    Parameters
    ----------
    wheel_y, wheel_radius : (m,) array
        On the wheel: lateral position on the profile and rolling radius [m].
    sin_theta : (m,) array
        Sine of its angle about the axle [-].
    counterface_z : (m,) array
        Height on the counterface's profile [m].
    contact_angle : (m,) array
        About e_x, z down [rad].
    approach, overlap : (m,) array, optional
        Rigid approach of the patch along the normal, and how far the wheel's point overlaps the counterface,
        along the counterface's radius [m]; none: the wheel's point itself is taken.
    """

    wheel_y: FloatArray
    wheel_radius: FloatArray
    sin_theta: FloatArray
    counterface_z: FloatArray
    contact_angle: FloatArray
    approach: FloatArray | None = None
    overlap: FloatArray | None = None


def kinematics(
    point: ContactPoint,
    pose: WheelsetPose,
    *,
    speed: FloatArray,
    track_curvature: FloatArray,
    half_span: float,
    nominal_radius: float,
    curvature: float,
) -> Kinematics:
    r"""Creepage of right wheels as a function of their rotation speed.

    Parameters
    ----------
    point : ContactPoint
        m reference points.
    pose : WheelsetPose
        Of the wheelset at each, (m,) arrays.
    speed : (m,) array
        V [m/s].
    track_curvature : (m,) array
        1/R, positive to the right [1/m].
    half_span, nominal_radius, curvature : float
        Lateral origin of the profiles, radius of the running circle [m], kappa of the counterface [1/m].

    Returns
    -------
    Kinematics
        A rotation speed about y; rolling forwards is negative.

    Notes
    -----
    Rotation (8), surface velocities (15) and (21) of [1]_, in the contact frames of (34), without small
    angles; to first order these are (35)-(37) as corrected in `contact.reference.linear_creepage`.

    References
    ----------
    .. [1] B. Liu, S. Bruni, Urban Rail Transit 1 (2016) 215-226.
    """
    wheel_radius, sin_theta = point.wheel_radius, point.sin_theta
    yaw, roll, approach, overlap = pose.yaw, pose.roll, point.approach, point.overlap
    sy, cy, sr, cr = np.sin(yaw), np.cos(yaw), np.sin(roll), np.cos(roll)
    zero, one = np.zeros_like(yaw), np.ones_like(yaw)
    # Columns of Rz(yaw) Rx(roll).
    forward = np.stack((cy, sy, zero), axis=1)
    axle = np.stack((-sy * cr, cy * cr, sr), axis=1)
    down = np.stack((sy * sr, -cy * sr, cr), axis=1)
    cosine = np.sqrt(1.0 - sin_theta**2)
    arm = (
        (wheel_radius * sin_theta)[:, None] * forward
        + (half_span + point.wheel_y)[:, None] * axle
        + (wheel_radius * cosine)[:, None] * down
    )
    x, y, z = arm[:, 0], pose.shift + arm[:, 1], arm[:, 2] - nominal_radius
    along = np.stack((1.0 - curvature * z, zero, curvature * x), axis=1)
    e_x = along / np.linalg.norm(along, axis=1)[:, None]
    e_y = np.stack((zero, one, zero), axis=1)
    e_d = np.stack((-e_x[:, 2], zero, e_x[:, 0]), axis=1)
    angle = point.contact_angle
    sine, cosine = np.sin(angle)[:, None], np.cos(angle)[:, None]
    e_s = cosine * e_y + sine * e_d
    e_n = -sine * e_y + cosine * e_d
    if approach is not None and overlap is not None:
        arm = arm + approach[:, None] * e_n - overlap[:, None] * e_d
    wheel = np.cross(axle, arm)  # surface velocity of the wheel per rotation speed
    rolling = -(speed * (1.0 - curvature * point.counterface_z))[:, None] * e_x
    counterface = rolling + (speed * track_curvature)[:, None] * np.stack((y, -x, zero), axis=1)
    spinning = np.stack((zero, curvature * speed, -speed * track_curvature), axis=1)

    def frame(velocity: FloatArray, spin: FloatArray) -> FloatArray:
        parts = [(velocity * e).sum(axis=1) for e in (e_x, e_s)] + [(spin * e_n).sum(axis=1)]
        return np.stack(parts, axis=1) / speed[:, None]

    downwards = np.stack((e_x[:, 2], e_s[:, 2], e_n[:, 2]), axis=1)
    return Kinematics(frame(-counterface, -spinning), frame(wheel, axle), x, downwards)
