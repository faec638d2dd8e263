"""How the counterface wears under the wheelset, and when a roller is turned back to its new profile."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class CounterfaceWear:
    r"""Wear of rollers by the wheels' law, or of rails at a stated rate.

    Parameters
    ----------
    factor : float
        Depth per passage of a roller over that of the wheel in the same contact [-]; 0 for a rail.
    radius : float
        Of the rollers at their profile's top [m]; infinite for a rail.
    area_rate : float
        Area of its cross-section that each rail loses per distance the wheelset runs [m2/m]; 0 for rollers.
    redress_distance : float
        Running after which both rollers are turned back to their new profile [m].
    redress_depth : float
        Wear depth of either roller at which both are [m].

    Notes
    -----
    A roller of radius :math:`s_0` passes under its wheel once in :math:`2 \pi s_0` of running, whatever the
    local radius: all its rings turn together, and the distance run is that of its profile's top. A rail is
    passed by other wheels, too, so what it loses is stated, and the campaign's contacts only tell where.
    """

    factor: float = 0.0
    radius: float = math.inf
    area_rate: float = 0.0
    redress_distance: float = math.inf
    redress_depth: float = math.inf

    def passages(self, area: float) -> float:
        """Return how often per metre run the counterface loses what the wheel's law tells for a passage.

        Parameters
        ----------
        area : float
            Area of the wheel's cross-section that the law takes off in one passage of the collective [m2].

        Returns
        -------
        float
            With the factor of a roller [1/m].
        """
        if self.area_rate == 0.0:
            return self.factor / (2.0 * math.pi * self.radius)
        return self.area_rate / area if area > 0.0 else 0.0
