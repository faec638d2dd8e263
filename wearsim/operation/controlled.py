"""What is controlled of operating points in place of their shifts, yaws and wheel loads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.guidance import Guidance
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import ContactConditions
from wearsim.operation.bogie import Bogies, spring_slope, suspension


@dataclass(frozen=True)
class Controlled:
    """What is controlled of `n` operating points in place of shift and wheel loads; NaN: those are given."""

    lateral_force: FloatArray  # (n,) on the wheelset at axle height, to the right [N]
    axle_load: FloatArray  # (n,) that both wheels carry [N]
    box_moment: FloatArray  # (n,) of the axle boxes, right side down positive [N m]
    bogies: Bogies | None = None  # points whose shift and yaw follow from the balance of a bogie

    @property
    def any(self) -> NDArray[np.bool_]:
        """Points (n,) whose shift or wheel loads follow from forces."""
        return np.isfinite(self.lateral_force) | np.isfinite(self.axle_load)

    @property
    def on_bogies(self) -> NDArray[np.bool_]:
        """Points (n,) that are axles of bogies."""
        found = np.zeros(self.axle_load.size, dtype=bool)
        if self.bogies is not None:
            found[self.bogies.points] = True
        return found

    def at(self, index: IntArray) -> Controlled:
        """Return forces and loads of the points at `index`; bogies are those of all points."""
        return Controlled(self.lateral_force[index], self.axle_load[index], self.box_moment[index])

    def guidance(self, conditions: ContactConditions) -> Guidance:
        """Return the forces that guide the points: constant ones of actuators, and those of suspensions.

        Parameters
        ----------
        conditions : ContactConditions
            With the wheel loads that are given, and the curvature of the track of bogies.
        """
        count = self.axle_load.size
        shared = np.isfinite(self.axle_load)
        force, slope = np.zeros((count, 2)), np.zeros((count, 2, 4))
        force[:, 0] = np.where(np.isfinite(self.lateral_force), self.lateral_force, 0.0)
        free = np.stack([np.isfinite(self.lateral_force), np.zeros(count, dtype=bool)], axis=1)
        partner = np.arange(count)
        if (bogies := self.bogies) is not None:
            curvature = conditions.track_curvature[bogies.leading]
            middle = np.zeros((curvature.size, 4))
            held = suspension(bogies.vehicle, middle, curvature, bogies.acceleration, bogies.in_front)
            springs = spring_slope(bogies.vehicle)
            free[bogies.points] = True
            force[bogies.leading], force[bogies.trailing] = held[:, :2], held[:, 2:]
            slope[bogies.leading] = springs[:2]
            slope[bogies.trailing] = springs[2:, [2, 3, 0, 1]]
            partner[bogies.leading], partner[bogies.trailing] = bogies.trailing, bogies.leading
        return Guidance(
            axle_load=np.where(shared, self.axle_load, conditions.loads.sum(axis=1)),
            wheel_load=np.where(shared[:, None], np.nan, conditions.loads),
            box_moment=self.box_moment,
            free=free,
            force=force,
            slope=slope,
            partner=partner,
        )
