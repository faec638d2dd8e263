"""State of a campaign between wear steps, and the wear rate of one state.

Fields have the wheels (0 = right, 1 = left) first, `n` vertices of a wheel or `k` of a
counterface last.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import Any, NamedTuple, get_args, get_type_hints

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.balance import Equilibria
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import ContactPatches, Wheelset
from wearsim.operation.states import Running
from wearsim.profile.shape import Profile, arc_length


@dataclass(frozen=True)
class CounterfaceState:
    """Worn rails or rollers, both in the axes of a right side."""

    y: FloatArray  # (2, k) profiles [m]
    z: FloatArray  # (2, k), positive down [m]
    # (2, k) along the normal, since the start or the last redressing [m]
    depth: FloatArray
    # (2,) of the cross-section, since the start, without what redressing removes [m2]
    worn_area: FloatArray
    # (2, k) `depth` at the end of the last step, before a redressing after it [m]
    last_depth: FloatArray
    # (2,) sum of the largest depths of all redressings: the least loss of radius [m]
    redressed_depth: FloatArray
    redressed_count: int = 0  # redressings of both rollers to their new profile
    redressed_at: float = 0.0  # distance of the last one [m]


@dataclass(frozen=True)
class CounterfaceRate:
    """Wear rate of rails or rollers."""

    depth: FloatArray  # (2, k) before smoothing [m/m]
    # (2, k) as in `WearRate`, for the depth of wheel and counterface together
    stability: FloatArray  # [1/m]
    over_strain: FloatArray  # [-]


@dataclass(frozen=True)
class PointHistory:
    """Data of previous states about each of the `n` operating points."""

    # (n,) of both cross-sections, alone, when last solved; NaN if never [m2/m]
    area_rate: FloatArray
    left_out: NDArray[np.bool_]  # (n,) without contact solution in the last step
    share: float = 0.0  # of the wear that those carry [-]


@dataclass(frozen=True)
class State:
    """State of a campaign; one value for each comparison or fatigue law in a tuple."""

    step: int  # finished wear steps
    distance: float  # run [m]
    y: FloatArray  # (2, n) profiles [m]
    z: FloatArray
    wear_depth: FloatArray  # (2, n) at each material point, along the normal [m]
    regime_depth: FloatArray  # (2, n_regimes, n) by regime [m]
    # (2,) removed from the cross-section, integral of the law over distance [m2]
    worn_area: FloatArray
    worn_mass: FloatArray  # (2,) removed from the whole circumference [kg]
    # Of each operating point: its share in the last step; in the last step in which it
    # was active the distance, the error [m] and the observed stiffness [1/m]. Empty
    # initially; lengths are 0 where unknown.
    active_weight: FloatArray = field(default_factory=lambda: np.zeros(0))
    point_length: FloatArray = field(default_factory=lambda: np.zeros(0))
    point_error: FloatArray = field(default_factory=lambda: np.zeros(0))
    point_stiffness: FloatArray = field(default_factory=lambda: np.zeros(0))
    comparison_depth: tuple[FloatArray, ...] = ()  # (2, n) [m]
    # (2, regimes of all comparison laws), law after law [m2]
    comparison_area: FloatArray = field(default_factory=lambda: np.zeros((2, 0)))
    fatigue_damage: tuple[FloatArray, ...] = ()  # (2, n) at each material point [-]
    counterface: CounterfaceState | None = None  # rails or rollers, if they wear
    # Step of the last reprofiling of the wheels, 0 before the first. Depths count from
    # it. Fatigue damage is what it left plus later damage. Area and mass are those of
    # all wear, without reprofiling.
    reprofiled: int = 0
    reprofiled_at: float = 0.0  # distance of that reprofiling [m]
    points: PointHistory | None = (
        None  # None: a point without contact solution is an error
    )
    running: Running | None = (
        None  # shifts and loads of the operating points; None: those of the scene
    )
    # starting equilibria of the contact and of searches from the state; None: fresh
    # start
    begin: Equilibria | None = None


@dataclass(frozen=True)
class WearRate:
    """Wear and damage per metre run at the vertices, before smoothing."""

    depth: FloatArray  # (2, n) [m/m]
    regime_depth: FloatArray  # (2, n_regimes, n) [m/m]
    friction_work: FloatArray  # (2, n) per area [J/m3]
    # (2, n) sum over the points of depth rate over interpenetration [1/m]; a step of
    # length ds has S = stability * ds
    stability: FloatArray
    # (2, n) sum over the points of depth rate over p0/E*, of patches without
    # interpenetration [-]
    over_strain: FloatArray
    solution: ContactPatches
    comparison: tuple[
        FloatArray, ...
    ] = ()  # (2, n_regimes, n) by each comparison law [m/m]
    fatigue: tuple[
        FloatArray, ...
    ] = ()  # (2, n) by each fatigue law, without removal by wear [1/m]
    # of the counterface, if it wears; stability then counts the depth of both bodies
    counterface: CounterfaceRate | None = None


class Increment(NamedTuple):
    """Depth and damage at the vertices, of a step or per metre run.

    They are smoothed and not yet removed.
    """

    regime_depth: FloatArray  # (2, n_regimes, n) [m]
    comparison: tuple[FloatArray, ...]  # (2, n_regimes, n) by each comparison law [m]
    fatigue: tuple[FloatArray, ...]  # (2, n) by each fatigue law [-]
    counterface: FloatArray | None  # (2, k) if it wears [m]


@dataclass(frozen=True)
class PatchWear:
    """Wear of each of `m` contact patches, without weight and environment factor."""

    area_rate: FloatArray  # (m,) of the wheel's cross-section [m2/m]
    depth_rate_max: FloatArray  # (m,) before smoothing [m/m]
    regime: IntArray  # (m,) regime with the largest depth, -1 without wear
    # (m,) last regime, in the order of the law, in which a strip wears, -1 without wear
    regime_highest: IntArray
    # (m, zones) share of each of `WHEEL_ZONES` in the area, fill value without wear [-]
    zone_share: FloatArray


def worn_wheels(
    wheelset: Wheelset, y: FloatArray, z: FloatArray
) -> tuple[Profile, Profile]:
    """Right and left wheel of a wheelset with other profiles, (2, n) each [m]."""
    return replace(wheelset.right, y=y[0], z=z[0]), replace(
        wheelset.left, y=y[1], z=z[1]
    )


def spacing_of(state: State) -> float:
    """Shortest vertex distance of the wheels, and of a counterface that wears [m]."""
    bodies = (state, state.counterface or state)
    arcs = [
        arc_length(*line)
        for body in bodies
        for line in zip(body.y, body.z, strict=True)
    ]
    return min(float(np.diff(arc).min()) for arc in arcs)


def flattened(value: Any, name: str = "") -> dict[str, np.ndarray]:
    """Arrays by path of a dataclass such as `State`, including nested ones.

    Dataclasses and tuples are traversed; None has no arrays.
    """
    if is_dataclass(value):
        parts = {
            part_field.name: getattr(value, part_field.name)
            for part_field in fields(value)
        }
    elif isinstance(value, tuple):
        parts = {str(number): element for number, element in enumerate(value)}
    else:
        return {} if value is None else {name: np.asarray(value)}
    paths = (flattened(part, f"{name}/{key}") for key, part in parts.items())
    return {path: array for inner in paths for path, array in inner.items()}


def rebuilt(kind: Any, arrays: Mapping[str, np.ndarray], name: str = "") -> Any:
    """Rebuild a value from the arrays of `flattened`, bit by bit.

    Raises KeyError if something is missing.
    """
    inside = {
        path.removeprefix(f"{name}/").split("/")[0]
        for path in arrays
        if path.startswith(f"{name}/")
    }
    composed: list[Any] = [
        alternative
        for alternative in (kind, *get_args(kind))
        if is_dataclass(alternative)
    ]
    if composed and not inside:
        return None
    if composed:
        hints = get_type_hints(composed[0])
        return composed[0](
            **{
                key: rebuilt(hint, arrays, f"{name}/{key}")
                for key, hint in hints.items()
            }
        )
    if getattr(kind, "__origin__", None) is tuple:
        return tuple(arrays[f"{name}/{number}"] for number in range(len(inside)))
    return arrays[name].item() if kind in (int, float) else arrays[name]
