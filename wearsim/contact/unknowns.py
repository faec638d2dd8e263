"""Unknowns of the balance of wheel loads and axle torque: what they miss, its slopes, and the next step.

Of each operating point: rotation speed and the loads of both wheels, in units of like size. Sides that are
balanced together have columns of them. Equations and sources: see `balance`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import ContactConditions
from wearsim.contact.tangential import TangentialModel
from wearsim.contact.wheels import Forces, Task

TOLERANCE = 1e-6
"""Of vertical forces over the wheel load; of the torque over friction coefficient x load x radius, or that of
the tangential model if it is larger."""

# Residuals below which one more step is enough: it leaves 3 % of those with a torque, 0.3 % of loads alone,
# mostly far less.
_PROMISING, _PROMISING_LOADS = 1.5e-5, 3e-4
_OF_LOAD = 0.3  # creep forces that friction can carry over the load, about
SPEED_UNIT = 1e-3  # of the nominal rotation speed: unknowns of like size
LARGEST_STEP = np.array([2.0, 0.2, 0.2])


def unknowns(task: Task, chunk: ContactConditions, speed: FloatArray, load: FloatArray) -> FloatArray:
    """Rotation speeds (n,) and loads (n, 2) in units of like size (n, 3)."""
    slower = speed * -task.wheelset.radius / chunk.speed - 1.0
    return np.column_stack([slower / SPEED_UNIT, np.log(load / chunk.loads)])


def slopes_nearby(chunk: ContactConditions) -> FloatArray:
    """Slopes (n, 3, 3) of the residuals where a chunk begins."""
    assert chunk.nearby is not None
    return chunk.nearby[:, 5:].reshape(-1, 3, 3)


def speed_and_load(
    task: Task, chunk: ContactConditions, unknown: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Rotation speeds (n,) and loads (n, 2) of what `unknowns` returns."""
    speed = -chunk.speed / task.wheelset.radius * (1.0 + SPEED_UNIT * unknown[:, 0])
    return speed, chunk.loads * np.exp(unknown[:, 1:])


def residuals(task: Task, chunk: ContactConditions, forces: Forces, columns: list[int]) -> FloatArray:
    """Torque over what friction can carry, and logarithm of vertical forces over the wheel load, (n, k)."""
    vertical: FloatArray = np.log(np.maximum(forces.vertical / chunk.loads, 1e-9))
    if 0 not in columns:
        return vertical[:, [column - 1 for column in columns]]
    torque = (forces.torque.sum(axis=1) - chunk.torque) / (chunk.traction_scale * task.wheelset.radius)
    both: FloatArray = np.concatenate([torque[:, None], vertical], axis=1)
    return both[:, columns]


def promising(residual: FloatArray, columns: list[int]) -> NDArray[np.bool_]:
    """Whether one more step from points (n,) with these residuals is enough."""
    most = _PROMISING if 0 in columns else _PROMISING_LOADS
    return np.asarray((np.abs(residual) <= most).all(axis=1))


def out_of_balance(
    residual: FloatArray, columns: list[int], model: TangentialModel, at_jump: bool = False
) -> NDArray[np.bool_]:
    """Whether points (n,) are out of balance by more than the tolerance, or a jump of the creep forces."""
    torque, load = max(model.tolerance, TOLERANCE), TOLERANCE
    if at_jump:
        torque, load = max(model.jump, torque), max(_OF_LOAD * model.jump, load)
    tolerance = np.array([torque, load, load])[columns]
    beyond: NDArray[np.bool_] = np.abs(residual) > tolerance
    return np.asarray(beyond.any(axis=1))


def secant_slope(slope: FloatArray, change: FloatArray, step: FloatArray, columns: list[int]) -> FloatArray:
    """Slopes (n, k, k) after a step (n, k) that changed the residuals by (n, k), by Broyden's rule."""
    # The torque hangs on all unknowns, a vertical force on the speed and its own load.
    linked = np.array([[i in (0, j) or j == 0 for j in columns] for i in columns], dtype=bool)
    missed = change - (slope @ step[:, :, None])[:, :, 0]
    part = np.where(linked, step[:, None], 0.0)
    square = np.maximum((part**2).sum(axis=2), 1e-300)
    result: FloatArray = slope + (missed / square)[:, :, None] * part
    return result


def newton_step(slope: FloatArray, residual: FloatArray, largest: FloatArray) -> FloatArray:
    """Newton's step, shortened to the largest one."""
    if residual.shape[1] == 0:
        return residual
    alone = residual.shape[1] == 1  # for which the library takes ten times as long
    flat = ~(np.abs(slope[:, 0, 0] if alone else np.linalg.det(slope)) > 1e-12)
    slope = np.where(flat[:, None, None], np.eye(residual.shape[1]), slope)
    step = -residual / slope[:, 0] if alone else -np.linalg.solve(slope, residual[:, :, None])[:, :, 0]
    shortened: FloatArray = step / np.maximum(np.abs(step / largest).max(axis=1), 1.0)[:, None]
    return shortened
