"""Settings of a campaign: distance, step length, reprofiling of the wheels, wear of the counterface."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class ReprofilingRules:
    """When the wheels are reprofiled.

    Parameters
    ----------
    limits : tuple of str
        Measures whose limit leads to reprofiling. With fatigue damage among them, every reprofiling removes
        all cracks of known depth.
    places : tuple of float
        Distances of reprofiling [m].
    cut : float
        Least depth of cut over the whole profile [m].
    """

    limits: tuple[str, ...] = ()
    places: tuple[float, ...] = ()
    cut: float = 0.0


@dataclass(frozen=True)
class ControlSettings:
    """Distance of a campaign and length of its steps.

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
        shorter. Infinite = not estimated [m].
    first_depth : float
        Largest wear depth of the first step and of the first after reprofiling or redressing; it doubles from
        step to step up to `depth_cap` [m].
    limits : tuple of (str, float)
        Limits of measures, by variable of the result file [SI].
    end_at_limit : bool
        Whether the campaign ends with the step in which the first limit is met; limits of reprofiling do not
        end it.
    reprofiling : ReprofilingRules or None
        When the wheels are reprofiled.
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
    reprofiling: ReprofilingRules | None = None


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
        Distance after which both rollers are redressed to their new profile [m].
    redress_depth : float
        Wear depth of either roller at which both are redressed [m].

    Notes
    -----
    A roller of radius :math:`s_0` passes under its wheel once in :math:`2 \pi s_0` of running, whatever the
    local radius; the distance run is that of its profile top. A rail is passed by other wheels as well: its
    loss is given, and the contacts of the campaign distribute it.
    """

    factor: float = 0.0
    radius: float = math.inf
    area_rate: float = 0.0
    redress_distance: float = math.inf
    redress_depth: float = math.inf

    def passages(self, area: float) -> float:
        """Return the passages per metre run by which the depth per passage of the wheel is multiplied.

        Parameters
        ----------
        area : float
            Area of the wheel's cross-section removed in one passage of the collective [m2].

        Returns
        -------
        float
            With the factor of a roller [1/m].
        """
        if self.area_rate == 0.0:
            return self.factor / (2.0 * math.pi * self.radius)
        return self.area_rate / area if area > 0.0 else 0.0
