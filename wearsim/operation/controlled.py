"""Controlled forces of operating points, in place of shifts, yaws and wheel loads."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.guidance import Guidance, in_given_place
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import ContactConditions
from wearsim.operation.bogie import Bogies, spring_slope, suspension


@dataclass(frozen=True)
class Controlled:
    """Forces that determine the positions of `n` operating points."""

    lateral_force: (
        FloatArray  # (n,) at axle height, to the right; NaN: the shift is given [N]
    )
    bogies: Bogies | None = (
        None  # points whose shift and yaw follow from the balance of a bogie
    )

    @property
    def any(self) -> NDArray[np.bool_]:
        """True for points (n,) whose shift follows from forces."""
        return np.isfinite(self.lateral_force) | self.on_bogies

    @property
    def on_bogies(self) -> NDArray[np.bool_]:
        """True for points (n,) that are axles of bogies."""
        on_bogie = np.zeros(self.lateral_force.size, dtype=bool)
        if self.bogies is not None:
            on_bogie[self.bogies.points] = True
        return on_bogie

    def at(self, index: IntArray) -> Controlled:
        """Return the forces of the points at `index`, without bogies."""
        return Controlled(self.lateral_force[index])

    def guidance(self, conditions: ContactConditions) -> Guidance:
        """Return the forces that guide the axles: those of actuators or suspensions.

        Parameters
        ----------
        conditions : ContactConditions
            With loads, moments of axle boxes, and the curvature of the track of bogies.
        """
        count = self.lateral_force.size
        force, slope = np.zeros((count, 2)), np.zeros((count, 2, 4))
        force[:, 0] = np.where(np.isfinite(self.lateral_force), self.lateral_force, 0.0)
        free = np.stack(
            [np.isfinite(self.lateral_force), np.zeros(count, dtype=bool)], axis=1
        )
        partner = np.arange(count)
        if (bogies := self.bogies) is not None:
            curvature = conditions.track_curvature[bogies.leading]
            middle = np.zeros((curvature.size, 4))
            held = suspension(
                bogies.vehicle, middle, curvature, bogies.acceleration, bogies.in_front
            )
            springs = spring_slope(bogies.vehicle)
            free[bogies.points] = True
            force[bogies.leading], force[bogies.trailing] = held[:, :2], held[:, 2:]
            slope[bogies.leading] = springs[:2]
            slope[bogies.trailing] = springs[2:, [2, 3, 0, 1]]
            partner[bogies.leading], partner[bogies.trailing] = (
                bogies.trailing,
                bogies.leading,
            )
        return replace(
            in_given_place(conditions),
            free=free,
            force=force,
            slope=slope,
            partner=partner,
        )
