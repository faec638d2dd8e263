"""Monitoring points: solved and stored at every step, so that campaigns compare, but wearing nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from wearsim.contact.patch import FloatArray
from wearsim.operation.points import OperatingPoints


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
