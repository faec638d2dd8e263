r"""Forces of contact patches on a wheelset: lateral force, steering moment, wheel loads and roll balance.

With the normal force :math:`N`, contact angle :math:`\delta`, creep forces :math:`F_x, F_y` and spin moment
:math:`M_z` of a patch in its contact frame, all in the axes of the track, and the patch at
:math:`x_p, y_p, z_p` from the middle of the axle,

.. math::
    T_p &= N \sin\delta + F_y \cos\delta \\
    Q_p &= N \cos\delta - F_y \sin\delta - \kappa x_p F_x \\
    X_p &= F_x + \kappa x_p (N \cos\delta - F_y \sin\delta) \\
    H_c &= \sum T_p, \qquad M_c = \sum (x_p T_p - y_p X_p + M_z \cos\delta)

with the curvature :math:`\kappa` of the counterface (0: rail). T acts to the right, Q upward and X forward on
the wheel (`spec/operation.md`, section 1).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import ContactConditions, ContactPatches, Counterface, Wheelset


class PatchForces(NamedTuple):
    """Forces of patches (m,) in the axes of the track, and where they act, from the middle of the axle."""

    lateral: FloatArray  # T_p, to the right [N]
    vertical: FloatArray  # Q_p, upward on the wheel [N]
    longitudinal: FloatArray  # X_p, forward [N]
    y: FloatArray  # [m]


class Resultants(NamedTuple):
    """What the contact forces of `n` points make of each wheel (n, 2), right and left, and the wheelset."""

    lateral: FloatArray  # (n, 2) to the right on each wheel, Y [N]
    vertical: FloatArray  # (n, 2) upward on each wheel, Q [N]
    longitudinal: FloatArray  # (n, 2) forward on each wheel [N]
    roll_moment: FloatArray  # (n, 2) sum of y_p Q_p + z_p T_p of each wheel [N m]
    height: FloatArray  # (n,) of the axle above the contact points, mean weighted with the vertical force [m]
    moment: FloatArray  # (n,) about the vertical axis, M_c: steers to the right where positive [N m]
    power: FloatArray  # (n,) frictional power of both wheels [W]
    roll: FloatArray  # (n,) of the wheelset, mean weighted with the vertical force [rad]
    angle: FloatArray  # (n, 2) steepest contact angle of each wheel, magnitude [rad]

    def mean(self, of: IntArray, share: FloatArray) -> Resultants:
        """Those of operating points, each where it runs in shares (n,) of its distance; steepest angles."""
        whole = [np.zeros((int(of.max()) + 1, *one.shape[1:])) for one in self]
        for total, one in zip(whole[:-1], self[:-1], strict=True):
            np.add.at(total, of, share.reshape(-1, *[1] * (one.ndim - 1)) * one)
        np.maximum.at(whole[-1], of, self.angle)
        return Resultants(*whole)

    @property
    def force(self) -> FloatArray:
        """H_c (n,): lateral force of the contact on the wheelset, to the right [N]."""
        return self.lateral.sum(axis=1)

    @property
    def derailment_quotient(self) -> FloatArray:
        """Y/Q (n, 2) of each wheel, positive where the force pushes its flange off the rail [-]."""
        return np.array([-1.0, 1.0]) * self.lateral / self.vertical


def patch_forces(
    patches: ContactPatches, shift: FloatArray, half_span: float, curvature: float | FloatArray
) -> PatchForces:
    """Return the forces T_p, Q_p, X_p of patches (m,) and their lateral position.

    Parameters
    ----------
    patches : ContactPatches
        Of m patches.
    shift : (m,) array
        Lateral shift of the axle of each [m].
    half_span : float
        From the middle of the track to the origin of the rail profiles [m].
    curvature : float or (m,) array
        Of the counterface [1/m].
    """
    sine, cosine = np.sin(patches.contact_angle), np.cos(patches.contact_angle)
    tilt = curvature * patches.x
    upward = patches.normal_force * cosine - patches.force_y * sine
    return PatchForces(
        lateral=patches.normal_force * sine + patches.force_y * cosine,
        vertical=upward - tilt * patches.force_x,
        longitudinal=patches.force_x + tilt * upward,
        y=np.where(patches.side == 1, -1.0, 1.0) * (half_span + patches.rail_y) - shift,
    )


def resultants(
    patches: ContactPatches, conditions: ContactConditions, wheelset: Wheelset, counterface: Counterface
) -> Resultants:
    """Add up the forces of all patches of `n` operating points; points without patches have zeros.

    Parameters
    ----------
    patches : ContactPatches
        Of both wheels; `point` counts the points of the conditions.
    conditions : ContactConditions
        Of n points.
    wheelset, counterface
        The bodies the patches are of.
    """
    point, count = patches.point, conditions.shift.size
    curvature = np.array(counterface.curvatures)[patches.side]
    shift = conditions.at(point).axle_shift(patches.roll)
    force = patch_forces(patches, shift, wheelset.half_span, curvature)
    place = 2 * point + patches.side

    def by_wheel(value: FloatArray) -> FloatArray:
        return np.bincount(place, value, 2 * count).astype(float).reshape(-1, 2)

    moment = patches.x * force.lateral - force.y * force.longitudinal
    moment = moment + patches.spin_moment * np.cos(patches.contact_angle)
    angle = np.zeros(2 * count)
    np.maximum.at(angle, place, np.abs(patches.contact_angle))
    vertical = by_wheel(force.vertical)
    carried = vertical.sum(axis=1)

    def mean(value: FloatArray) -> FloatArray:
        weighted = by_wheel(force.vertical * value).sum(axis=1)
        return np.divide(weighted, carried, out=np.zeros(count), where=carried != 0.0)

    return Resultants(
        lateral=by_wheel(force.lateral),
        vertical=vertical,
        longitudinal=by_wheel(force.longitudinal),
        roll_moment=by_wheel(force.y * force.vertical + patches.z * force.lateral),
        height=mean(patches.z),
        moment=by_wheel(moment).sum(axis=1),
        power=by_wheel(patches.power).sum(axis=1),
        roll=mean(patches.roll),
        angle=angle.reshape(-1, 2),
    )
