"""What a campaign carries from step to step, and what one evaluation gives."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.solve import ContactSolution


@dataclass(frozen=True)
class CounterfaceState:
    """Worn rails or rollers; first axis 0 = right, 1 = left, both in the axes of a right side.

    Parameters
    ----------
    y, z : (2, k) array
        Profiles, z positive down [m].
    depth : (2, k) array
        Depth worn at each material point since the start or the last turning, along the normal [m].
    worn_area : (2,) array
        Area of the cross-section worn off since the start; what turning takes off is not counted [m2].
    last_depth : (2, k) array
        `depth` at the end of the last step, before the rollers were turned if they were then [m].
    turned_depth : (2,) array
        Sum of its largest value over all turnings: the least loss of radius [m].
    turnings : int
        How often both rollers have been turned back to their new profile.
    turned_at : float
        Distance run when they last were [m].
    """

    y: FloatArray
    z: FloatArray
    depth: FloatArray
    worn_area: FloatArray
    last_depth: FloatArray
    turned_depth: FloatArray
    turnings: int = 0
    turned_at: float = 0.0


@dataclass(frozen=True)
class CounterfaceRate:
    """What rails or rollers lose per metre run.

    Parameters
    ----------
    depth : (2, k) array
        Depth per metre at each vertex, before smoothing [m/m].
    stability, damping : (2, k) array
        As of `WearRate`, of the depth that wheel and counterface lose together [1/m].
    """

    depth: FloatArray
    stability: FloatArray
    damping: FloatArray


@dataclass(frozen=True)
class Choice:
    """Contact models that were chosen for a campaign, and what for.

    Parameters
    ----------
    models : tuple of int
        Place of the models of each class of operating points in `campaign.choose.candidates`.
    point_class : (n,) int array
        Class of each operating point.
    error : float
        Error of their wear increment when they were chosen [-].
    candidate_error : tuple of (float or None)
        The same of each candidate for all points; None where it was not tried or refused a point [-].
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
        Depth worn so far at each material point, along the normal [m].
    regime_depth : (2, n_regimes, n) array
        The same, by wear regime [m].
    worn_area : (2,) array
        Area of the cross-section removed, time integral of the law [m2].
    worn_mass : (2,) array
        Mass removed from the whole circumference [kg].
    step_length : float
        Of the step that led here [m]; 0 at the start.
    step_error : float or None
        Estimated error of that step's depth, where it is largest [m]; None where it was not estimated.
    choice : Choice or None
        Contact models, where they are chosen; None where they are given.
    comparison_depth : tuple of (2, n) arrays
        Depth that each comparison law would have worn so far [m].
    comparison_area : (2, regimes of all of them) array
        Area of the cross-section they would have removed, by their own regimes, law after law [m2].
    fatigue_damage : tuple of (2, n) arrays
        Fatigue damage at each material point, for each fatigue law [-].
    counterface : CounterfaceState, optional
        Rails or rollers, if they wear.
    turned : int
        Step in which the wheels were last turned, 0 if they never were. Depths count from then, damage is
        what the lathe left and has come since; area and mass are of all wear, without what the lathe took.
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
    turned: int = 0


@dataclass(frozen=True)
class WearRate:
    """What wears per metre run in one state.

    Parameters
    ----------
    depth : (2, n) array
        Depth per metre at each profile vertex, before smoothing [m/m].
    regime_depth : (2, n_regimes, n) array
        The same by regime [m/m].
    friction_work : (2, n) array
        Frictional work per area and metre run [J/m3].
    stability : (2, n) array
        Sum over the points of depth rate over interpenetration [1/m]; a step of length ds has
        S = stability * ds.
    solution : ContactSolution
        The contact solutions behind it.
    damping : (2, n) array or None
        The same sum averaged over the stretch of each vertex as the depth is, rims of the patches included:
        what a semi-implicit step divides by [1/m]; None where no such step is made.
    comparison : tuple of (2, n_regimes, n) arrays
        Depth per metre by each comparison law and its regimes [m/m].
    fatigue : tuple of (2, n) arrays
        Fatigue damage per metre, without removal by wear, for each fatigue law [1/m].
    counterface : CounterfaceRate, optional
        Of the counterface, if it wears; stability and damping then count what both bodies lose.
    """

    depth: FloatArray
    regime_depth: FloatArray
    friction_work: FloatArray
    stability: FloatArray
    solution: ContactSolution
    damping: FloatArray | None = None
    comparison: tuple[FloatArray, ...] = ()
    fatigue: tuple[FloatArray, ...] = ()
    counterface: CounterfaceRate | None = None


class Increment(NamedTuple):
    """What a step adds at the vertices, before smoothing and removal.

    Parameters
    ----------
    regime_depth : (2, n_regimes, n) array
        Depth by the regimes of the active law [m].
    comparison : tuple of (2, n_regimes, n) arrays
        The same by each comparison law and its regimes [m].
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
    """What the wear law makes of each of `m` contact patches, without weight and environment factor.

    Parameters
    ----------
    area_rate : (m,) array
        Worn area of the wheel's cross-section per metre run [m2/m].
    depth_rate_max : (m,) array
        Wear depth per metre run where the patch wears deepest, before smoothing [m/m].
    regime : (m,) int array
        Wear regime that removes most, -1 where nothing wears.
    regime_highest : (m,) int array
        Last regime, in the order of the law, in which anything of the patch wears; -1 where nothing does.
    """

    area_rate: FloatArray
    depth_rate_max: FloatArray
    regime: IntArray
    regime_highest: IntArray
