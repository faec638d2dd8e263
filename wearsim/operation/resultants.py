"""Resultant contact forces on a wheelset: lateral force, steering moment, wheel loads.

They include the roll balance of the axle.

Sums over patches of their forces in the axes of the track (`contact.track_forces`): T
acts to the right, Q upward and X forward on the wheel; H_c = sum of T, M_c of the
moments about the vertical axis through the middle of the axle.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import ContactPatches


class Resultants(NamedTuple):
    """Resultant contact forces of `n` points on each wheel (n, 2), right and left."""

    lateral: FloatArray  # (n, 2) to the right on each wheel, Y [N]
    vertical: FloatArray  # (n, 2) upward on each wheel, Q [N]
    longitudinal: FloatArray  # (n, 2) forward on each wheel [N]
    roll_moment: FloatArray  # (n, 2) sum of y_p Q_p + z_p T_p of each wheel [N m]
    # (n,) of the axle above the contact points, mean weighted with the vertical
    # force [m]
    height: FloatArray
    # (n,) about the vertical axis, M_c: steers to the right where positive [N m]
    moment: FloatArray
    power: FloatArray  # (n,) frictional power of both wheels [W]
    roll: (
        FloatArray  # (n,) of the wheelset, mean weighted with the vertical force [rad]
    )
    angle: FloatArray  # (n, 2) steepest contact angle of each wheel, magnitude [rad]

    def mean(self, of: IntArray, share: FloatArray) -> Resultants:
        """Mean over operating points, weighted with their shares (n,) of the distance.

        Contact angles are the steepest.
        """
        whole = [
            np.zeros((int(of.max()) + 1, *component.shape[1:])) for component in self
        ]
        for total, component in zip(whole[:-1], self[:-1], strict=True):
            np.add.at(
                total, of, share.reshape(-1, *[1] * (component.ndim - 1)) * component
            )
        np.maximum.at(whole[-1], of, self.angle)
        return Resultants(*whole)

    @property
    def force(self) -> FloatArray:
        """Lateral force H_c (n,) of the contact on the wheelset, to the right [N]."""
        return self.lateral.sum(axis=1)

    @property
    def derailment_quotient(self) -> FloatArray:
        """Derailment quotient Y/Q (n, 2) of each wheel [-].

        It is positive where the lateral force pushes the flange off the rail.
        """
        return np.array([-1.0, 1.0]) * self.lateral / self.vertical


def resultants(patches: ContactPatches, count: int) -> Resultants:
    """Sum the contact forces of all patches of each operating point [N, N m].

    Points without patches have zeros.

    Parameters
    ----------
    patches : ContactPatches
        Of both wheels.
    count : int
        Number of points that `point` of the patches counts.
    """
    place = 2 * patches.point + patches.side

    def by_wheel(value: FloatArray) -> FloatArray:
        return np.bincount(place, value, 2 * count).astype(float).reshape(-1, 2)

    angle = np.zeros(2 * count)
    np.maximum.at(angle, place, np.abs(patches.contact_angle))
    vertical = by_wheel(patches.track_vertical)
    carried = vertical.sum(axis=1)

    def mean(value: FloatArray) -> FloatArray:
        weighted = by_wheel(patches.track_vertical * value).sum(axis=1)
        return np.divide(weighted, carried, out=np.zeros(count), where=carried != 0.0)

    return Resultants(
        lateral=by_wheel(patches.track_lateral),
        vertical=vertical,
        longitudinal=by_wheel(patches.track_longitudinal),
        roll_moment=by_wheel(patches.track_roll_moment),
        height=mean(patches.z),
        moment=by_wheel(patches.track_yaw_moment).sum(axis=1),
        power=by_wheel(patches.power).sum(axis=1),
        roll=mean(patches.roll),
        angle=angle.reshape(-1, 2),
    )
