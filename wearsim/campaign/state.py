"""State of a campaign between wear steps, and the wear rate of one state."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import ContactPatches, Wheelset
from wearsim.profile.shape import Profile


@dataclass(frozen=True)
class CounterfaceState:
    """Worn rails or rollers; first axis 0 = right, 1 = left, both in the axes of a right side.

    Parameters
    ----------
    y, z : (2, k) array
        Profiles, z positive down [m].
    depth : (2, k) array
        Wear depth at each material point since the start or the last redressing, along the normal [m].
    worn_area : (2,) array
        Area of the cross-section worn off since the start, without what redressing removes [m2].
    last_depth : (2, k) array
        `depth` at the end of the last step, before a redressing that followed it [m].
    redressed_depth : (2,) array
        Sum over all redressings of the largest depth: the least loss of radius [m].
    redressed_count : int
        Number of redressings of both rollers to their new profile.
    redressed_at : float
        Distance of the last redressing [m].
    """

    y: FloatArray
    z: FloatArray
    depth: FloatArray
    worn_area: FloatArray
    last_depth: FloatArray
    redressed_depth: FloatArray
    redressed_count: int = 0
    redressed_at: float = 0.0


@dataclass(frozen=True)
class CounterfaceRate:
    """Wear rate of rails or rollers.

    Parameters
    ----------
    depth : (2, k) array
        Depth per metre at each vertex, before smoothing [m/m].
    stability, damping : (2, k) array
        As in `WearRate`, for the depth removed from wheel and counterface together [1/m].
    """

    depth: FloatArray
    stability: FloatArray
    damping: FloatArray


@dataclass(frozen=True)
class Choice:
    """Contact models chosen for the classes of operating points.

    Parameters
    ----------
    models : tuple of int
        Index in `campaign.choose.candidates` of the models of each class.
    point_class : (n,) int array
        Class of each operating point.
    error : float
        Error of the wear increment when they were chosen [-].
    candidate_error : tuple of (float or None)
        The same for each candidate at all points; None where it was not tried or failed at a point [-].
    """

    models: tuple[int, ...]
    point_class: IntArray
    error: float
    candidate_error: tuple[float | None, ...]


@dataclass(frozen=True)
class State:
    """The state of a campaign; wheel axis 0 = right, 1 = left.

    Parameters
    ----------
    step : int
        Number of finished wear steps.
    distance : float
        Distance run [m].
    y, z : (2, n) array
        Wheel profiles [m].
    wear_depth : (2, n) array
        Wear depth at each material point, along the normal [m].
    regime_depth : (2, n_regimes, n) array
        Wear depth by regime [m].
    worn_area : (2,) array
        Area of the cross-section removed, integral of the law over distance [m2].
    worn_mass : (2,) array
        Mass removed from the whole circumference [kg].
    step_length : float
        Length of the last step [m]; 0 at the start.
    step_error : float or None
        Largest estimated error of the depth of that step [m]; None where it was not estimated.
    choice : Choice or None
        Contact models of `model = "auto"`; None where they are given.
    comparison_depth : tuple of (2, n) arrays
        Wear depth by each comparison law [m].
    comparison_area : (2, regimes of all of them) array
        Area of the cross-section removed by their regimes, law after law [m2].
    fatigue_damage : tuple of (2, n) arrays
        Fatigue damage at each material point, for each fatigue law [-].
    counterface : CounterfaceState, optional
        Rails or rollers, if they wear.
    reprofiled : int
        Step of the last reprofiling of the wheels, 0 before the first. Depths count from it, fatigue damage
        is what it left plus what was added since; area and mass are those of all wear, without reprofiling.
    """

    step: int
    distance: float
    y: FloatArray
    z: FloatArray
    wear_depth: FloatArray
    regime_depth: FloatArray
    worn_area: FloatArray
    worn_mass: FloatArray
    step_length: float = 0.0
    step_error: float | None = None
    choice: Choice | None = None
    comparison_depth: tuple[FloatArray, ...] = ()
    comparison_area: FloatArray = field(default_factory=lambda: np.zeros((2, 0)))
    fatigue_damage: tuple[FloatArray, ...] = ()
    counterface: CounterfaceState | None = None
    reprofiled: int = 0


@dataclass(frozen=True)
class WearRate:
    """Wear and fatigue damage per metre run in one state.

    Parameters
    ----------
    depth : (2, n) array
        Depth per metre at each profile vertex, before smoothing [m/m].
    regime_depth : (2, n_regimes, n) array
        Depth per metre by regime [m/m].
    friction_work : (2, n) array
        Frictional work per area and metre run [J/m3].
    stability : (2, n) array
        Sum over the points of depth rate over interpenetration [1/m]; a step of length ds has
        S = stability * ds.
    solution : ContactPatches
        Contact it follows from.
    damping : (2, n) array or None
        The same sum averaged over the stretch of each vertex, rims of the patches included, for semi-implicit
        steps [1/m].
    comparison : tuple of (2, n_regimes, n) arrays
        Depth per metre by each comparison law and its regimes [m/m].
    fatigue : tuple of (2, n) arrays
        Fatigue damage per metre, without removal by wear, for each fatigue law [1/m].
    counterface : CounterfaceRate, optional
        Rate of the counterface, if it wears; stability and damping then count the depth of both bodies.
    """

    depth: FloatArray
    regime_depth: FloatArray
    friction_work: FloatArray
    stability: FloatArray
    solution: ContactPatches
    damping: FloatArray | None = None
    comparison: tuple[FloatArray, ...] = ()
    fatigue: tuple[FloatArray, ...] = ()
    counterface: CounterfaceRate | None = None


class Increment(NamedTuple):
    """Depth and damage of one step at the vertices, before smoothing and removal.

    Parameters
    ----------
    regime_depth : (2, n_regimes, n) array
        Depth by regime of the active law [m].
    comparison : tuple of (2, n_regimes, n) arrays
        Depth by each comparison law and its regimes [m].
    fatigue : tuple of (2, n) arrays
        Damage by each fatigue law [-].
    counterface : (2, k) array, optional
        Depth of the counterface, if it wears [m].
    """

    regime_depth: FloatArray
    comparison: tuple[FloatArray, ...] = ()
    fatigue: tuple[FloatArray, ...] = ()
    counterface: FloatArray | None = None


@dataclass(frozen=True)
class PatchWear:
    """Wear of each of `m` contact patches, without weight and environment factor.

    Parameters
    ----------
    area_rate : (m,) array
        Worn area of the wheel's cross-section per metre run [m2/m].
    depth_rate_max : (m,) array
        Largest wear depth per metre run, before smoothing [m/m].
    regime : (m,) int array
        Regime that removes most, -1 without wear.
    regime_highest : (m,) int array
        Last regime, in the order of the law, in which a strip of the patch wears; -1 without wear.
    """

    area_rate: FloatArray
    depth_rate_max: FloatArray
    regime: IntArray
    regime_highest: IntArray


def worn_wheels(wheelset: Wheelset, y: FloatArray, z: FloatArray) -> tuple[Profile, Profile]:
    """Return the right and left wheel of a wheelset with other profiles, (2, n) each [m]."""
    return replace(wheelset.right, y=y[0], z=z[0]), replace(wheelset.left, y=y[1], z=z[1])
