"""Start of the search for wheelset equilibrium, with coarse patches and FASTSIM.

These are used whatever the contact models.

The first step solves for the roll at which coarse patches without creep forces carry
the wheel loads. Then the loads are bracketed with creep forces, and for each of them
the rotation speed is solved.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.axle import Contact, Wheelsets
from wearsim.contact.balance import placed_step
from wearsim.contact.equilibrium import resting_roll
from wearsim.contact.loaded import lifted, loads_of, renewed, solved_wheels
from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import ContactConditions
from wearsim.contact.rotation import free_rotation, rolling_speeds
from wearsim.contact.tangential import fastsim
from wearsim.contact.wheels import (
    Forces,
    Side,
    Task,
    Wheels,
    by_row,
    forces_of,
    normal_of,
    patches_where,
    side_of,
    stretched,
)
from wearsim.errors import ContactError

# Logarithm of vertical force over wheel load at which the requested models start.
_NEAR = 0.05
_MOST_LOADS = 40  # largest number of load brackets
_HIGHEST = np.log(10.0)  # logarithm of the largest trial ratio L/Q
# change of the logarithm of a load above which coarse patches are solved anew
_FAR = 0.2
# Accepted difference of the wheels' displacements without creep forces [m].
_NEAR_REST = 1e-6


def begun_with_coarse_patches(
    problem: Wheelsets,
) -> tuple[FloatArray, FloatArray, Contact]:
    """Start of the search for the equilibrium of wheelsets.

    Parameters
    ----------
    problem : Wheelsets
        n wheelsets, at the shifts and yaws of their conditions.

    Returns
    -------
    unknown : (n, 7) array
        Near the balance of torque, loads and heights.
    slopes : (n, 7, 7) array
        Of the residuals.
    contact : Contact
        Of coarse patches; the search keeps its gaps.

    Raises
    ------
    ContactError
        If a wheel has no contact, its flange locks, or no roll lets both wheels carry
        their loads.
    NumericalError
        If no rotation speed balances the torque.
    """
    task, chunk = problem.task, problem.chunk
    if chunk.free_roll and chunk.shift.size > 0:
        sides = _near_rest(task, chunk)
    else:
        sides = tuple(side_of(task, number, chunk) for number in problem.sides)
    speed, load, wheels = _bracketed(task, chunk, sides, problem.given)
    coarse, every = replace(problem, coarse=True), np.ones(problem.count, dtype=bool)
    unknown = coarse.unknown(speed, load, sides[0].sign * sides[0].pose.roll)
    still = tuple(replace(side, rough=None) for side in sides)
    contact = coarse.of_wheels(unknown, wheels, still)
    slopes = coarse.slopes(unknown, contact, every)
    unknown = unknown + placed_step(coarse, slopes, coarse.residuals(contact.forces))
    return unknown, slopes, contact.to_begin_with()


def _near_rest(task: Task, chunk: ContactConditions) -> tuple[Side, ...]:
    """Both sides at the roll at which coarse patches carry the wheel loads.

    Creep forces are omitted.
    """
    sides: dict[int, Side] = {}

    def displacements(
        angle: FloatArray, moving: NDArray[np.bool_]
    ) -> tuple[FloatArray, FloatArray]:
        rows, tilted = np.flatnonzero(moving), replace(chunk, roll=angle)
        both = np.zeros((2, moving.size))
        for number in (0, 1):
            before = sides.get(number)
            try:
                side = side_of(
                    task, number, tilted, rows, None if before is None else before.gap
                )
                normal = normal_of(
                    task, side, rows, chunk.loads[rows, number], rough=True
                )
            except ContactError as error:
                error.side = number
                raise
            both[number, normal.patch.row] = normal.vertical_displacement
            if before is not None and before.rough is not None:
                kept = patches_where(before.rough, ~moving[before.rough.patch.row])
                normal = by_row([kept, normal])
            sides[number] = replace(side, rough=normal)
        return both[0], both[1]

    _, solved = resting_roll(
        displacements, chunk.roll, task.wheelset.half_span, _NEAR_REST
    )
    if not solved.all():
        raise ContactError(
            "no roll of the wheelset lets both wheels carry their loads; "
            "check shift, gauge and profiles, or give the roll",
            int(np.argmin(solved)),
            rows=np.flatnonzero(~solved).tolist(),
        )
    return tuple(sides[number] for number in (0, 1))


def _bracketed(
    task: Task,
    chunk: ContactConditions,
    sides: tuple[Side, ...],
    given: FloatArray | None,
) -> tuple[FloatArray, FloatArray, Wheels]:
    """Rotation speeds and loads (n, 2) near equilibrium, with coarse patches."""
    count = chunk.shift.size
    wheel_load = chunk.loads.copy()
    load = tried = wheel_load
    included = np.zeros((count, 2), bool)
    included[:, [side.number for side in sides]] = True
    rough = solved_wheels(task, chunk, sides, load, included, rough=True)
    # normal contact under the wheel loads
    sides = tuple(replace(side, rough=None) for side in sides)
    nominal = np.repeat(-chunk.speed[:, None] / task.wheelset.radius, 2, axis=1)
    speed = nominal if given is None else given
    low, high = np.full((count, 2), -np.inf), np.full((count, 2), np.inf)
    open_rows = np.ones(count, bool)
    far = included & task.vertical
    for _ in range(_MOST_LOADS):
        again = (
            included
            & open_rows[:, None]
            & (np.abs(np.log(load / loads_of(rough, count))) > _FAR)
        )
        rough = renewed(task, chunk, sides, rough, load, again, ~again, rough=True)
        near = stretched(patches_where(rough, open_rows[rough.normal.patch.row]), load)
        tried = np.where(open_rows[:, None], load, tried)
        speed, forces = _turning(task, chunk, near, speed, ~open_rows, given is None)
        if not task.vertical:
            break
        excess = np.log(np.maximum(forces.vertical / wheel_load, 1e-9))
        load_logarithm = np.log(load / wheel_load)
        now = far & open_rows[:, None]
        low = np.where(now & (excess < 0.0), np.maximum(low, load_logarithm), low)
        high = np.where(now & (excess >= 0.0), np.minimum(high, load_logarithm), high)
        aim = load_logarithm - np.clip(excess, -1.0, 1.0)
        outside = np.isfinite(low) & np.isfinite(high) & ~((low < aim) & (aim < high))
        aim[outside] = 0.5 * (low[outside] + high[outside])
        load = np.where(now, wheel_load * np.exp(aim), load)
        locked = now & (aim > _HIGHEST)
        if locked.any():
            rows = np.flatnonzero(locked.any(axis=1)).tolist()
            reason = "no normal force up to ten times the wheel load balances it"
            raise lifted(near, rows[0], int(np.argmax(locked[rows[0]])), reason, rows)
        open_rows = np.asarray((now & (np.abs(excess) > _NEAR)).any(axis=1))
        if not open_rows.any():
            break
    return speed, tried, stretched(rough, tried)


def _turning(
    task: Task,
    chunk: ContactConditions,
    wheels: Wheels,
    speed: FloatArray,
    done: NDArray[np.bool_],
    free: bool,
) -> tuple[FloatArray, Forces]:
    """Rotation speeds (n, 2) near which FASTSIM balances the torque, and its forces.

    Only free rotation speeds are changed.
    """
    if not free:
        return speed, forces_of(task, wheels, speed, fastsim.MODEL)
    latest: list[Forces] = []

    def torque(turning: FloatArray, new: NDArray[np.bool_]) -> FloatArray:
        few = bool(latest) and 0 < 2 * new.sum() < new.size
        part = patches_where(wheels, new.ravel()[wheels.place]) if few else wheels
        forces = forces_of(task, part, turning, fastsim.MODEL)
        if latest:  # rows that have found their speed are unchanged
            kept = latest.pop()
            about_axle, vertical = np.where(
                new, (forces.torque, forces.vertical), (kept.torque, kept.vertical)
            )
            forces = Forces(forces.contact, about_axle, vertical)
        latest.append(forces)
        return forces.torque

    crest = task.models.friction_falls
    if crest:
        rolling = rolling_speeds(wheels, chunk.independent, chunk.shift.size)
        speed = np.where(done[:, None], speed, rolling)
    rotation = free_rotation(
        torque, chunk, task.wheelset.radius, speed, done, crest=crest
    )
    return rotation.speed, latest[0]
