"""Guiding forces on wheelsets in lateral direction and yaw, and their axle loads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import ContactConditions


@dataclass(frozen=True)
class Guidance:
    """Loads of `n` wheelsets, and guiding forces linear in lateral positions and yaws.

    The forces also depend on the positions and yaws of their partners.

    Parameters
    ----------
    axle_load : (n,) array
        That both wheels carry [N].
    wheel_load : (n, 2) array
        Of the right and the left wheel where they are given; NaN where they balance the
        roll [N].
    box_moment : (n,) array
        On the wheelset about its longitudinal axis, right side down positive [N m].
    free : (n, 2) bool array
        Whether the lateral shift and the yaw follow from the forces; else they are
        given.
    force : (n, 2) array
        Lateral force to the right and yaw moment on the wheelset with itself and its
        partner in the middle of the track and without yaw [N, N m].
    slope : (n, 2, 4) array
        Their change by lateral position and yaw of the wheelset, then of its partner
        [N/m, N/rad; N, N m/rad].
    partner : (n,) int array
        The other wheelset of its bogie; itself where it has none.
    """

    axle_load: FloatArray
    wheel_load: FloatArray
    box_moment: FloatArray
    free: NDArray[np.bool_]
    force: FloatArray
    slope: FloatArray
    partner: IntArray

    def at(self, index: IntArray) -> Guidance:
        """Return the wheelsets at `index`, which must include their partners."""
        place = np.full(self.partner.size, -1)
        place[index] = np.arange(index.size)
        partner = place[self.partner[index]]
        assert (partner >= 0).all()
        return self._with_partners(index, partner)

    def alone(self, index: IntArray) -> Guidance:
        """Return the wheelsets at `index`, each without its partner."""
        return self._with_partners(index, np.arange(index.size))

    def _with_partners(self, index: IntArray, partner: IntArray) -> Guidance:
        """Return the wheelsets at `index` with partners (k,) among them."""
        return Guidance(
            self.axle_load[index],
            self.wheel_load[index],
            self.box_moment[index],
            self.free[index],
            self.force[index],
            self.slope[index],
            partner,
        )

    def forces(self, position: FloatArray) -> FloatArray:
        """Lateral force and yaw moment (n, 2) at lateral positions and yaws (n, 2).

        Input in m and rad, output in N and N m.
        """
        both = np.concatenate([position, position[self.partner]], axis=1)
        moved: FloatArray = self.force + (self.slope @ both[:, :, None])[:, :, 0]
        return moved

    def wheel_loads(self, vertical: FloatArray, roll_moment: FloatArray) -> FloatArray:
        """Vertical forces (n, 2) on both wheels [N].

        They are given, or balance the roll with their lever arms.

        Parameters
        ----------
        vertical, roll_moment : (n, 2) array
            Of the contact on each wheel: force [N], and moment about the longitudinal
            axis [N m].
        """
        lever = roll_moment / np.where(vertical > 0.0, vertical, 1.0)
        apart = lever[:, 0] - lever[:, 1]
        apart = np.where(apart == 0.0, 1.0, apart)
        right = (self.box_moment - lever[:, 1] * self.axle_load) / apart
        both = np.stack([right, self.axle_load - right], axis=1)
        return np.where(np.isfinite(self.wheel_load), self.wheel_load, both)


def in_given_place(conditions: ContactConditions) -> Guidance:
    """Return the loads of wheelsets in given positions, without guiding forces."""
    count, loads = conditions.shift.size, conditions.loads
    moment = (
        np.full(count, np.nan)
        if conditions.box_moment is None
        else conditions.box_moment
    )
    shared = np.isfinite(moment)
    return Guidance(
        axle_load=loads.sum(axis=1),
        wheel_load=np.where(shared[:, None], np.nan, loads),
        box_moment=np.where(shared, moment, 0.0),
        free=np.zeros((count, 2), dtype=bool),
        force=np.zeros((count, 2)),
        slope=np.zeros((count, 2, 4)),
        partner=np.arange(count),
    )
