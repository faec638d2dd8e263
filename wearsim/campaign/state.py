"""What a campaign carries from step to step, and what one evaluation gives."""

from __future__ import annotations

from dataclasses import dataclass

from wearsim.contact.patch import FloatArray
from wearsim.contact.solve import ContactSolution


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
    """

    step: int
    distance: float
    y: FloatArray
    z: FloatArray
    wear_depth: FloatArray
    regime_depth: FloatArray
    worn_area: FloatArray
    worn_mass: FloatArray


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
    """

    depth: FloatArray
    regime_depth: FloatArray
    friction_work: FloatArray
    stability: FloatArray
    solution: ContactSolution
