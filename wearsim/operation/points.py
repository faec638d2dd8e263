"""Operating points: how the wheelset runs, for how large a share, in which environment."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from wearsim.contact.patch import FloatArray, IntArray
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


def select(points: OperatingPoints, index: IntArray) -> OperatingPoints:
    """Return the operating points at `index`, in that order; weights are not rescaled."""

    def chosen(one: Any) -> dict[str, Any]:
        values = {f.name: getattr(one, f.name) for f in fields(one)}
        return {name: value[index] for name, value in values.items() if isinstance(value, np.ndarray)}

    return replace(
        points,
        **chosen(points),
        conditions=replace(points.conditions, **chosen(points.conditions)),
        label=tuple(points.label[i] for i in index),
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
    """Append points of weight 0 to a load collective.

    Parameters
    ----------
    points : OperatingPoints
        Of `n` points.
    shift : (k,) array
        Lateral shifts to watch [m].
    wheel_load : float
        Vertical load of each wheel [N].
    speed : float
        [m/s]
    friction : float
        Coulomb coefficient [-].
    yaw : float
        [rad]

    Returns
    -------
    OperatingPoints
        Of `n + k` points; the new ones have weight 0, block length 0, environment factor 1, no roll
        and tangent track, so that two campaigns watch the same states. The rotation rule is that of
        `points`, and so is whether the roll is free.
    """
    shift = np.asarray(shift, dtype=np.float64)
    old = points.conditions
    if not isinstance(old.rotation, str):
        raise ValueError("monitoring points need a rotation rule, not given rotation speeds")

    def appended(values: FloatArray, value: float) -> FloatArray:
        return np.concatenate([values, np.full(shift.size, value)])

    conditions = replace(
        old,
        shift=np.concatenate([old.shift, shift]),
        yaw=appended(old.yaw, yaw),
        roll=appended(old.roll, 0.0),
        wheel_load=appended(old.wheel_load, wheel_load),
        speed=appended(old.speed, speed),
        friction=appended(old.friction, friction),
        track_curvature=appended(old.track_curvature, 0.0),
    )
    return OperatingPoints(
        conditions=conditions,
        weight=appended(points.weight, 0.0),
        environment=appended(points.environment, 1.0),
        block_length=appended(points.block_length, 0.0),
        label=points.label + tuple(f"monitor {1e3 * value:+.2f} mm" for value in shift),
    )
