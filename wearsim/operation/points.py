"""Operating points: how the wheelset runs, for how large a share, in which environment."""

from __future__ import annotations

import math
from dataclasses import dataclass

from wearsim.contact.patch import FloatArray
from wearsim.contact.solve import ContactConditions


@dataclass(frozen=True)
class OperatingPoints:
    """The load collective of a campaign.

    Parameters
    ----------
    conditions : ContactConditions
        Of the `n` points.
    weight : (n,) array
        Share of the distance; of a collective they sum to 1. Monitoring points have 0: they are solved
        and stored, but wear nothing.
    environment : (n,) array
        Environment factor on the wear depth [-], 1 = dry laboratory coefficients.
    block_length : (n,) array
        Length of the block in the programme's loop [m], 0 for points of a stationary collective
        (field classes) and monitoring points.
    label : tuple of str
        One per point.
    """

    conditions: ContactConditions
    weight: FloatArray
    environment: FloatArray
    block_length: FloatArray
    label: tuple[str, ...]


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
