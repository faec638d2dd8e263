r"""Creepage in exact vector form: the kinematic problem.

Creepage is the velocity of the wheel's surface minus that of the counterface, over V,
in the contact frame: e_x along the rolling direction of the counterface, e_s across in
the contact plane, e_n into the counterface. Both surface velocities are those of the
undeformed bodies at the pressure-weighted centre of the patch, in the planes that stand
for them: half-spaces meet in one plane. That of the counterface goes through its
profile at the centre; that of the wheel lies the rigid approach deeper along the
normal, where the wheel would be in its way the most. In a patch that is bent this is
some micrometres off the wheel's profile at the centre. Strips, also those that are rows
of cells in one plane, take the wheel's own points. The counterface turns with
:math:`\omega = (0, \kappa V, -V/R)`; a rail has kappa = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wearsim.contact.geometry import WheelsetPose
from wearsim.contact.kernel import kernel, plain
from wearsim.contact.patch import FloatArray


@dataclass(frozen=True)
class Kinematics:
    """Creepage as a linear function of the wheel's rotation speed.

    It is at_rest + rotation_speed * per_speed.

    Each of m patches has N contact planes: one, or those of its strips.

    Parameters
    ----------
    at_rest, per_speed : (m, N, 3) array
        Longitudinal, lateral creepage and spin [-, -, 1/m], and the same per rotation
        speed [s/rad].
    x : (m, N) array
        Longitudinal position of the contact, from the middle of the axle [m].
    down : (m, N, 3) array
        Parts straight down of the contact frame's directions: rolling, across, normal
        into the counterface.
    """

    at_rest: FloatArray
    per_speed: FloatArray
    x: FloatArray
    down: FloatArray

    def creepage(self, rotation_speed: FloatArray) -> FloatArray:
        """Creepages (m, N, 3) for (m,) rotation speeds [rad/s]."""
        return self.at_rest + rotation_speed[:, None, None] * self.per_speed


def moved(motion: Kinematics, along: FloatArray, across: FloatArray) -> Kinematics:
    """Creepage of the same rigid planes at another point.

    Parameters
    ----------
    motion : Kinematics
        Of the N planes of m patches.
    along, across : (m, N) array
        To the new point, forwards and to the field side [m].

    Returns
    -------
    Kinematics
        With the same spin.
    """

    def at(value: FloatArray) -> FloatArray:
        there = value.copy()
        there[:, :, 0] -= value[:, :, 2] * across
        there[:, :, 1] += value[:, :, 2] * along
        return there

    return Kinematics(
        at(motion.at_rest), at(motion.per_speed), motion.x + along, motion.down
    )


class ContactPoint(NamedTuple):
    """Creepage reference points on wheel and counterface, one for each plane.

    Parameters
    ----------
    wheel_y, wheel_radius : (m, N) array
        On the wheel: lateral position on the profile and rolling radius [m].
    sin_theta : (m, N) array
        Sine of its angle about the axle [-].
    counterface_z : (m, N) array
        Height on the counterface's profile [m].
    contact_angle : (m, N) array
        About e_x, z down [rad].
    approach, overlap : (m, N) array
        Rigid approach of the patch along the normal, and how far the wheel's point
        overlaps the counterface, along the counterface's radius [m]; with zeros the
        wheel's point itself is taken.
    """

    wheel_y: FloatArray
    wheel_radius: FloatArray
    sin_theta: FloatArray
    counterface_z: FloatArray
    contact_angle: FloatArray
    approach: FloatArray
    overlap: FloatArray


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
        N reference points of each of m patches.
    pose : WheelsetPose
        Of the wheelset at each patch, (m,) arrays.
    speed : (m,) array
        V [m/s].
    track_curvature : (m,) array
        1/R, positive to the right [1/m].
    half_span, nominal_radius, curvature : float
        Lateral origin of the profiles, radius of the running circle [m], kappa of the
        counterface [1/m].

    Returns
    -------
    Kinematics
        A rotation speed about y; rolling forwards is negative.

    Notes
    -----
    Rotation (8), surface velocities (15) and (21) of [1]_, in the contact frames of
    (34), without small angles; to first order these are (35)-(37) as corrected in
    `tests/contact/reference/linear_creepage.py`.

    References
    ----------
    .. [1] B. Liu, S. Bruni, Urban Rail Transit 1 (2016) 215-226.
    """
    point, pose = ContactPoint(*map(plain, point)), WheelsetPose(*map(plain, pose))
    shape = point.wheel_y.shape
    at_rest, per_speed, down = np.empty((3, *shape, 3))
    result = Kinematics(at_rest, per_speed, np.empty(shape), down)
    _fill(
        point,
        pose,
        plain(speed),
        plain(track_curvature),
        float(half_span),
        float(nominal_radius),
        float(curvature),
        result.at_rest,
        result.per_speed,
        result.x,
        result.down,
    )
    return result


@kernel
def _fill(
    point: ContactPoint,
    pose: WheelsetPose,
    speed: FloatArray,
    track_curvature: FloatArray,
    half_span: float,
    nominal_radius: float,
    kappa: float,
    at_rest: FloatArray,
    per_speed: FloatArray,
    along: FloatArray,
    down: FloatArray,
) -> None:
    """Creepage at rest and per rotation speed, longitudinal position and frame.

    Each is that of one contact point.
    """
    for m in range(along.shape[0]):
        sy, cy = np.sin(pose.yaw[m]), np.cos(pose.yaw[m])
        sr, cr = np.sin(pose.roll[m]), np.cos(pose.roll[m])
        v, turn = speed[m], track_curvature[m]
        for n in range(along.shape[1]):
            sine, r, a = (
                point.sin_theta[m, n],
                point.wheel_radius[m, n],
                half_span + point.wheel_y[m, n],
            )
            f, d = r * sine, r * np.sqrt(1.0 - sine * sine)
            # From the middle of the axle to the wheel's point; (8) is Rz(yaw) Rx(roll).
            x, y, z = (
                cy * f - sy * cr * a + sy * sr * d,
                sy * f + cy * cr * a - cy * sr * d,
                sr * a + cr * d,
            )
            # Contact frame: e_x = (u, 0, w), e_d = (-w, 0, u).
            u, w = 1.0 - kappa * (z - nominal_radius), kappa * x
            length = np.sqrt(u * u + w * w)
            u, w = u / length, w / length
            si, co = (
                np.sin(point.contact_angle[m, n]),
                np.cos(point.contact_angle[m, n]),
            )
            down[m, n, 0], down[m, n, 1], down[m, n, 2] = w, si * u, co * u
            # Counterface: rolling, and rotation of the track.
            c_x, c_y = turn * (pose.shift[m] + y), -turn * x
            at_rest[m, n, 0] = 1.0 - kappa * point.counterface_z[m, n] - c_x * u
            at_rest[m, n, 1] = c_x * si * w - c_y * co
            at_rest[m, n, 2] = kappa * si + turn * co * u
            # Wheel: axle x arm, in the plane that lies deeper by the approach.
            along[m, n] = x
            approach, overlap = point.approach[m, n], point.overlap[m, n]
            x, y, z = (
                x - w * (co * approach - overlap),
                y - si * approach,
                z + u * (co * approach - overlap),
            )
            w_x, w_y, w_z = (
                cy * cr * z - sr * y,
                sr * x + sy * cr * z,
                -sy * cr * y - cy * cr * x,
            )
            per_speed[m, n, 0] = (w_x * u + w_z * w) / v
            per_speed[m, n, 1] = (si * (w_z * u - w_x * w) + w_y * co) / v
            per_speed[m, n, 2] = (sy * cr * w * co - cy * cr * si + sr * u * co) / v
