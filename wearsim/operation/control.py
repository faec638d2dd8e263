"""How far a campaign goes, in which steps, when wheels are turned, and how the counterface wears."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class TurningRules:
    """When the wheels are turned.

    Parameters
    ----------
    limits : tuple of str
        Measures whose limit, once met, has them turned. With fatigue damage among them, every turning
        takes all cracks of a known depth.
    places : tuple of float
        Distances at which they are turned [m].
    cut : float
        Least depth that the lathe takes everywhere [m].
    """

    limits: tuple[str, ...] = ()
    places: tuple[float, ...] = ()
    cut: float = 0.0


@dataclass(frozen=True)
class ControlSettings:
    """How far a campaign goes, in which steps.

    Parameters
    ----------
    distance : float
        Distance to run [m].
    depth_cap : float
        Largest wear depth of one step, after smoothing [m].
    stability : float
        Limit of S = sum of depth over interpenetration in one step [-]; below 1 the explicit update is
        monotone, from 2 on it oscillates.
    smoothing_wavelength : float
        Wavelength whose amplitude in the wear increment is halved; 0 = no smoothing [m].
    integrator : str
        Name in the registry of `campaign.step`.
    max_step : float
        Longest step [m].
    error_tolerance : float
        Largest estimated error of the depth of one step, after smoothing; steps above it are repeated
        shorter. Infinite = not looked at [m].
    first_depth : float
        Largest wear depth of the first step, and of that after wheels or rollers were turned; it may double
        from step to step up to `depth_cap`. A new profile changes its contact fastest [m].
    limits : tuple of (str, float)
        Limits of measures, by variable of the result file [SI].
    end_at_limit : bool
        Whether the campaign ends with the step in which the first of them is met; those at which wheels are
        turned do not end it.
    turning : TurningRules or None
        When the wheels are turned.
    """

    distance: float
    depth_cap: float
    stability: float
    smoothing_wavelength: float
    integrator: str
    max_step: float = math.inf
    error_tolerance: float = math.inf
    first_depth: float = math.inf
    limits: tuple[tuple[str, float], ...] = ()
    end_at_limit: bool = False
    turning: TurningRules | None = None


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
