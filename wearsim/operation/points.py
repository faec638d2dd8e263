"""Operating points: rig programme, field load collective and monitoring points.

Omitted operating points and their weights are included.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.solve import ContactConditions
from wearsim.operation.controlled import Controlled
from wearsim.operation.states import BeyondJump, Running

SIDES = ("right", "left")
REACH = 3.0
"""Standard deviations from the mean to the outermost positions."""


@dataclass(frozen=True)
class OperatingPoints:
    """Load collective of a campaign.

    Parameters
    ----------
    conditions : ContactConditions
        Of the `n` points.
    weight : (n,) array
        Share of the distance; the shares of a collective sum to 1. Monitoring points
        have 0: they are solved and stored, and cause no wear.
    environment : (n,) array
        Environment factor on the wear depth [-], 1 = dry laboratory coefficients.
    block_length : (n,) array
        Length of the block in the programme's loop [m], 0 for points of a stationary
        collective (field classes) and monitoring points.
    label : tuple of str
        One per point.
    class_name : tuple of str
        Block or class of each point; by default its label.
    controlled : Controlled, optional
        Forces from which the places of points follow; None: all of them are given.
    of_track : tuple of int
        Number of the class of a vehicle's track of each point.
    beyond : BeyondJump, optional
        Where some points run for a share of their distance.
    curve_curvature : (n,) array, optional
        Curvature of the track itself [1/m], positive to the right; by default that of
        `conditions`, which on straight track is that of the path of the wheelset.
    """

    conditions: ContactConditions
    weight: FloatArray
    environment: FloatArray
    block_length: FloatArray
    label: tuple[str, ...]
    class_name: tuple[str, ...] = ()
    controlled: Controlled | None = None
    of_track: tuple[int, ...] = ()
    beyond: BeyondJump | None = None
    curve_curvature: FloatArray | None = None

    @property
    def curvature(self) -> FloatArray:
        """Curvature (n,) of the track itself at each point [1/m]."""
        if self.curve_curvature is None:
            return self.conditions.track_curvature
        return self.curve_curvature

    @property
    def runs(self) -> tuple[ContactConditions, IntArray, FloatArray]:
        """Conditions of all positions (n + k), their points and distance shares."""
        count, two = len(self.label), self.beyond
        point, share = np.arange(count), np.ones(count)
        if two is None:
            return self.conditions, point, share
        point, share[two.point] = np.append(point, two.point), 1.0 - two.share
        shift = np.append(self.conditions.shift, two.shift)
        runs = replace(self.conditions.at(point), shift=shift)
        return runs, point, np.append(share, two.share)

    @property
    def classes(self) -> tuple[str, ...]:
        """Block or class (n,) of each point; its own name where it has none."""
        return self.class_name or self.label

    @property
    def of_class(self) -> IntArray:
        """Number of the block or class (n,) of each point."""
        return np.unique(np.array(self.classes, dtype=str), return_inverse=True)[1]


def recorded_points(
    values: Mapping[str, FloatArray],
    distance: FloatArray,
    group: Sequence[str],
    **rules: Any,
) -> OperatingPoints:
    """Operating points of a recorded run.

    The set-points (n,) are given by name, with the distance and the group of each.
    """
    runs = [
        {name: float(value[k]) for name, value in values.items()}
        for k in range(distance.size)
    ]
    label = tuple(f"{name} {k + 1}" for k, name in enumerate(group))
    return points_of(runs, rules, distance / distance.sum(), label, tuple(group))


def select(points: OperatingPoints, index: IntArray) -> OperatingPoints:
    """Return the operating points at `index`, in that order.

    Weights are not rescaled.
    """
    return replace(
        points,
        conditions=points.conditions.at(index),
        weight=points.weight[index],
        environment=points.environment[index],
        block_length=points.block_length[index],
        label=tuple(points.label[i] for i in index),
        class_name=tuple(points.class_name[i] for i in index)
        if points.class_name
        else (),
        controlled=None if points.controlled is None else points.controlled.at(index),
        curve_curvature=points.curvature[index],
    )


def where_it_runs(points: OperatingPoints, running: Running | None) -> OperatingPoints:
    """Operating points with the positions that balance the controlled forces."""
    if running is None:
        return points
    return replace(
        points, conditions=running.conditions(points.conditions), beyond=running.beyond
    )


def with_monitors(
    points: OperatingPoints,
    shift: FloatArray,
    *,
    wheel_load: float,
    speed: float,
    friction: float,
    yaw: float = 0.0,
) -> OperatingPoints:
    """Append monitoring points at the shifts (k,) [m] to a load collective.

    Parameters
    ----------
    points : OperatingPoints
        Of `n` points.
    shift, wheel_load, speed, friction, yaw
        As in `ContactConditions`.

    Returns
    -------
    OperatingPoints
        `n + k` points; the new ones have weight 0, block length 0, environment factor
        1, no roll and tangent track. The rotation rule is that of `points`, and so is
        whether the roll is free.
    """
    shift = np.asarray(shift, dtype=np.float64)
    old = points.conditions
    if not isinstance(old.rotation, str):
        raise ValueError(
            "monitoring points need a rotation rule, not given rotation speeds"
        )

    def appended(values: FloatArray, value: float) -> FloatArray:
        return np.concatenate(
            [values, np.full((shift.size, *values.shape[1:]), value, values.dtype)]
        )

    values = {
        "yaw": yaw,
        "wheel_load": wheel_load,
        "speed": speed,
        "friction": friction,
    }
    values |= {"roll": 0.0, "track_curvature": 0.0}
    optional = {
        "friction_flange": friction,
        "torque": 0.0,
        "torque_difference": 0.0,
        "drift": 0.0,
        "speed_difference": 0.0,
        "rail": 0,
        "box_moment": np.nan,
    }
    values |= {
        name: value
        for name, value in optional.items()
        if isinstance(getattr(old, name), np.ndarray)
    }
    new: dict[str, Any] = {
        name: appended(getattr(old, name), value) for name, value in values.items()
    }
    controlled = points.controlled
    if controlled is not None:
        controlled = replace(
            controlled, lateral_force=appended(controlled.lateral_force, np.nan)
        )
    return OperatingPoints(
        conditions=replace(old, shift=np.concatenate([old.shift, shift]), **new),
        weight=appended(points.weight, 0.0),
        environment=appended(points.environment, 1.0),
        block_length=appended(points.block_length, 0.0),
        label=points.label + tuple(f"monitor {1e3 * value:+.2f} mm" for value in shift),
        class_name=points.classes + ("monitor",) * shift.size,
        controlled=controlled,
        curve_curvature=appended(points.curvature, 0.0),
    )


def normal_positions(
    mean: float, std: float, count: int
) -> tuple[FloatArray, FloatArray]:
    """Equally spaced positions over a normal distribution, with weights.

    Parameters
    ----------
    mean, std : float
        Of the distribution [m].
    count : int
        Number of positions; 1 only for a `std` of 0.

    Returns
    -------
    position : (k,) array
        From three standard deviations below the mean to three above [m]; the mean alone
        for `std` 0.
    weight : (k,) array
        In proportion to the density at each position, symmetric about the mean; sums
        to 1.

    Notes
    -----
    Densities sampled at equal spacing keep the moments of a normal distribution far
    better than probabilities of the cells between them, which widen it by a twelfth of
    the spacing squared. The cut-off beyond three standard deviations (0.27 %) lowers
    the variance by 2.7 % for a fine spacing.
    """
    if std < 0 or (std > 0 and count < 2):
        raise ValueError(
            "a spread of positions needs a standard deviation >= 0 and at least two "
            "positions"
        )
    if std == 0:
        return np.array([mean], dtype=np.float64), np.ones(1)
    half = np.arange(count, dtype=np.float64) - 0.5 * (
        count - 1
    )  # exactly antisymmetric
    reduced = half * (2.0 * REACH / (count - 1))
    weight = np.exp(-0.5 * reduced**2)
    return mean + std * reduced, weight / weight.sum()


Run = Mapping[str, Any]
"""Set-points of a block or class by their names in the scene, in SI units.

They always have speed and friction, and `load` of each wheel, or `wheel_load_right` and
`wheel_load_left`, or `axle_load` of both, which their balance distributes, with
`box_moment`. Those of a block and of a class are listed at `programme` and
`collective`; the others are optional, as the fields of `ContactConditions`.
"""


def programme(blocks: Sequence[Run], **rules: Any) -> OperatingPoints:
    """Operating points of a rig programme.

    Its blocks are repeated until the distance of the campaign is reached.

    Parameters
    ----------
    blocks : sequence of Run
        In the order of the programme, each with `name`, `distance` and `shift` or
        `lateral_force`. A block with `positions` is a ramp of that number of points,
        from its set-points to those of the next block.
    **rules
        `rotation`, `torque` and `free_roll` of `ContactConditions`; by default free,
        without torque, the roll as given.

    Returns
    -------
    OperatingPoints
        One point per block, those of ramps in their place; the weight is the share of
        the loop, the track curvature 0.
    """
    distance = np.array([block["distance"] for block in blocks], dtype=np.float64)
    if distance.size == 0 or not np.all(distance > 0):
        raise ValueError("a programme needs blocks, each with a distance above 0")
    runs = [part for k in range(len(blocks)) for part in _ramp(blocks, k)]
    distance = np.array([run["distance"] for run in runs], dtype=np.float64)
    label = tuple(run["name"] for run in runs)
    names = tuple(run.get("block", run["name"]) for run in runs)
    points = points_of(runs, rules, distance / distance.sum(), label, names)
    return replace(points, block_length=distance)


def _ramp(blocks: Sequence[Run], k: int) -> list[Run]:
    """Return the block itself, or the points of a ramp.

    The set-points of a ramp lead to those of the next block.
    """
    block, after = blocks[k], blocks[(k + 1) % len(blocks)]
    count = block.get("positions")
    if count is None:
        return [block]
    parts: list[Run] = []
    for j in range(count):
        way = (j + 0.5) / count
        values = {
            key: value + way * (after.get(key, value) - value)
            for key, value in block.items()
            if isinstance(value, float)
        }
        name = f"{block['name']} {j + 1}"
        parts.append(
            {
                **values,
                "name": name,
                "block": block["name"],
                "distance": block["distance"] / count,
            }
        )
    return parts


def points_of(
    runs: Sequence[Run],
    rules: Mapping[str, Any],
    weight: FloatArray,
    label: tuple[str, ...],
    class_name: tuple[str, ...],
) -> OperatingPoints:
    """Operating points from set-points, one point for each."""

    def column(name: str, default: float = 0.0) -> FloatArray:
        return np.array([run.get(name, default) for run in runs], dtype=np.float64)

    def given(name: str) -> bool:
        return any(name in run for run in runs)

    axle_load, force = column("axle_load", np.nan), column("lateral_force", np.nan)
    load = column("load", np.nan)
    load = np.where(np.isfinite(axle_load), 0.5 * axle_load, load)
    if given("wheel_load_right"):
        sides = (column(f"wheel_load_{side}", np.nan) for side in SIDES)
        load = np.stack(
            [np.where(np.isfinite(side), side, load) for side in sides], axis=1
        )
    values: dict[str, Any] = {"wheel_load": load, **rules}
    values |= {
        name: column(name)
        for name in ("shift", "yaw", "roll", "speed", "friction", "track_curvature")
    }
    values |= {
        name: column(name) for name in ("drift", "speed_difference") if given(name)
    }
    if given("friction_flange"):
        flange = column("friction_flange", np.nan)
        values["friction_flange"] = np.where(
            np.isfinite(flange), flange, values["friction"]
        )
    if any(run.get("rail") for run in runs):
        values["rail"] = column("rail").astype(np.int64)
    if given("axle_torque") or given("wheel_torque_right"):
        values["torque"] = column("axle_torque", float(rules.get("torque", 0.0)))
    if given("wheel_torque_right"):
        right, left = (column(f"wheel_torque_{side}", np.nan) for side in SIDES)
        stated = np.isfinite(right)
        values["torque"] = np.where(stated, right + left, values["torque"])
        values["torque_difference"] = np.where(stated, right - left, 0.0)
    if given("axle_load"):
        values["box_moment"] = np.where(
            np.isfinite(axle_load), column("box_moment"), np.nan
        )
    controlled = Controlled(force)
    curvature = column("curve_curvature", np.nan)
    return OperatingPoints(
        conditions=ContactConditions(**values),
        weight=weight,
        environment=column("environment", 1.0),
        block_length=np.zeros(len(runs)),
        label=label,
        class_name=class_name,
        controlled=controlled if controlled.any.any() else None,
        curve_curvature=np.where(
            np.isfinite(curvature), curvature, values["track_curvature"]
        ),
    )


def collective(classes: Sequence[Run], **rules: Any) -> OperatingPoints:
    """Stationary load collective of all classes and their lateral positions.

    Parameters
    ----------
    classes : sequence of Run
        At least one, each with `name`, `share` of the distance, which are normalised,
        `shift_mean`, `shift_std` and `positions`: mean, standard deviation [m] and
        number of its lateral positions.
    **rules
        As in `programme`.

    Returns
    -------
    OperatingPoints
        Class by class, positions from left to right; weight = share of the class x
        weight of the position, block length 0.
    """
    if not classes:
        raise ValueError("a collective needs at least one class")
    share = np.array([item["share"] for item in classes], dtype=np.float64)
    runs: list[Run] = []
    weights = []
    for item, part in zip(classes, share / share.sum(), strict=True):
        position, weight = normal_positions(
            item["shift_mean"], item["shift_std"], item.get("positions", 15)
        )
        runs += [{**item, "shift": place} for place in position]
        weights.append(part * weight)
    label = tuple(f"{run['name']} {1e3 * run['shift']:+.2f} mm" for run in runs)
    return points_of(
        runs,
        rules,
        np.concatenate(weights),
        label,
        tuple(str(run["name"]) for run in runs),
    )


LARGEST_SHARE = 0.01
"""Largest share of the wear of all operating points without a solution together."""


def mask_of(failed: Iterable[int], count: int) -> NDArray[np.bool_]:
    """Return a mask of `count` points that is True for those that failed."""
    return np.isin(np.arange(count), list(failed))


def shared_weight(
    weight: FloatArray, of_class: IntArray, out: NDArray[np.bool_]
) -> FloatArray:
    """Redistribute the weight of the points `out` (n,) among the rest of their class.

    The weight (n,) is distributed in proportion to theirs. A class or block that is out
    as a whole has no weight: its distance passes without wear, and the error is the
    wear it would carry.
    """
    if not out.any():
        return weight
    kept = np.where(out, 0.0, weight)
    whole, left = (np.bincount(of_class, weights) for weights in (weight, kept))
    factor = np.divide(whole, left, out=np.zeros_like(whole), where=left > 0.0)
    return kept * factor[of_class]


def never_solved(
    weight: FloatArray, of_class: IntArray, rate: FloatArray, out: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Points (n,) that are out, as in `carried_share`, in a class never solved."""
    solved = np.bincount(of_class, np.isfinite(rate)) > 0.0
    return out & (weight > 0.0) & ~solved[of_class]


def carried_share(
    weight: FloatArray, of_class: IntArray, rate: FloatArray, out: NDArray[np.bool_]
) -> float:
    """Share of the wear that the points `out` (n,) carry together [-].

    Parameters
    ----------
    weight : (n,) array
        Shares of the distance, times the environment factors.
    of_class : (n,) int array
        Number of the class or block of each point.
    rate : (n,) array
        Worn area per distance of each point alone [m2/m]; of points that are out the
        last known value. NaN without one: the largest rate of the class is then used.
    out : (n,) bool array
        Points without a contact solution.

    Returns
    -------
    float
        Of the larger one of what these points wore and what the others of their class
        wear in their place [-]. By the weights where nothing wears; 1 where a class is
        out of which nothing was ever solved.
    """
    if not (weight[out] > 0.0).any():
        return 0.0
    if never_solved(weight, of_class, rate, out).any():
        return 1.0
    has_rate = np.isfinite(rate)
    if not rate[has_rate].any():
        return float(weight[out].sum() / weight.sum())
    largest = np.zeros(int(of_class.max()) + 1)
    np.maximum.at(largest, of_class[has_rate], rate[has_rate])
    worn = weight * np.where(has_rate, rate, largest[of_class])
    instead = shared_weight(weight, of_class, out) - np.where(out, 0.0, weight)
    lost = np.bincount(of_class, np.where(out, worn, 0.0))
    added = np.bincount(
        of_class, np.where(out, 0.0, instead * np.where(has_rate, rate, 0.0))
    )
    return float(np.maximum(lost, added).sum() / worn.sum())
