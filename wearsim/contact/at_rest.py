"""A wheelset that rests on both wheels: the roll at which these carry their loads in one place of its axle.

The roll is searched for around the equilibrium of both wheels (`balance`), or together with it from one
nearby: there two evaluations of normal and creep forces mostly are enough for all four unknowns.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.balance import Equilibrium, equilibrium, may_be_stretched, solved_wheels
from wearsim.contact.equilibrium import FIRST_ROLLS, QUICK_ROLLS, resting_roll
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import ContactConditions
from wearsim.contact.tangential import TANGENTIAL_MODELS, TangentialSolution
from wearsim.contact.unknowns import (
    LARGEST_STEP,
    newton_step,
    out_of_balance,
    promising,
    residuals,
    secant_slope,
    slopes_nearby,
    speed_and_load,
)
from wearsim.contact.wheels import (
    Side,
    Task,
    Wheels,
    by_point,
    by_row,
    contact_joined,
    forces_of,
    normal_of,
    patches_where,
    renumbered,
    side_of,
    stretched,
)
from wearsim.errors import ContactError, NumericalError

_RESTING = 1e-9  # m, between the wheels' displacements of a wheelset at rest
_OF_SCATTER = 0.5  # or this share of what displacements from unlike starts scatter by
_CLEAR = 4e-8  # m, of changes of their difference that say how it falls, or the scatter
_MOST_TRIALS = 6  # of all unknowns together
_NEAR_REST = 1e-6  # m, between the wheels' displacements with coarse patches and without creep forces


def at_rest(
    task: Task, chunk: ContactConditions, speed: FloatArray | None, start: Wheels | None
) -> tuple[Equilibrium, FloatArray, FloatArray]:
    """Equilibrium of a wheelset that rests on both wheels, its roll (n,) and its fall, see `resting_roll`.

    Without a roll nearby the search begins at that at which coarse patches carry the wheel loads; nearby all
    unknowns are searched for together first, from the wheels `start` if given. A row that rests is not solved
    again.
    """
    count, model = chunk.shift.size, TANGENTIAL_MODELS[task.models.tangential]
    if count == 0:  # every point of a chunk has failed
        nothing = equilibrium(task, chunk, [side_of(task, number, chunk) for number in (0, 1)], speed)
        return nothing, chunk.roll, chunk.roll
    scatter = NORMAL_MODELS[task.models.normal].scatter
    resting, clear = max(_RESTING, _OF_SCATTER * scatter), max(_CLEAR, scatter)
    turning, load = np.zeros(count), np.zeros((count, 2))
    slopes = np.zeros((count, 3, 3))
    wheels: list[Wheels] = []
    contacts: list[TangentialSolution] = []
    rolls: list[FloatArray] = []
    latest: list[tuple[IntArray, Equilibrium]] = []
    begun: list[tuple[IntArray, Equilibrium]] = []

    def keep(moving: NDArray[np.bool_]) -> None:
        """Put those that rest aside."""
        if not latest:
            return
        rows, balanced = latest.pop()
        turning[rows], load[rows], slopes[rows] = balanced.speed, balanced.load, balanced.slopes
        resting = np.flatnonzero(~moving[rows])
        if resting.size > 0:
            part = balanced.take(resting)
            wheels.append(renumbered(part.wheels, rows[resting]))
            if model.warm:
                contacts.append(part.contact)

    def begin(wanted: IntArray) -> Equilibrium | None:
        """Equilibrium to begin with: of the roll before at first, then of one and the same.

        So that displacements are a function of the roll, although they hang a little on where they began.
        """
        if not begun or len(rolls) > QUICK_ROLLS:
            return None
        rows, balanced = begun[-1]
        return balanced.take(np.searchsorted(rows, wanted))

    def displacements(angle: FloatArray, wanted: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray]:
        keep(wanted)
        rolls.append(angle)
        rows = np.flatnonzero(wanted)
        nearby = begin(rows)
        tilted = replace(chunk, roll=angle).at(rows)
        given = None if speed is None else speed[rows]
        try:
            sides = (
                still if still and len(rolls) == 1 else [side_of(task, number, tilted) for number in (0, 1)]
            )
            try:
                balanced = equilibrium(task, tilted, sides, given, nearby, False)
            except ContactError:
                if nearby is None or chunk.nearby is not None:  # a point then begins anew
                    raise
                balanced = equilibrium(task, tilted, sides, given, None, False)
        except ContactError as error:
            raise _of_whole(error, rows) from None
        latest.append((rows, balanced))
        if len(rolls) <= FIRST_ROLLS:
            begun.append(latest[-1])
        both = np.zeros((2, count))
        both[:, rows] = _displacements(balanced.wheels, rows.size)
        return both[0], both[1]

    if chunk.nearby is None:
        guess, fall, still = _near_rest(task, chunk)
    else:
        (guess, fall), still = chunk.nearby[:, :2].T.copy(), []
    rests = np.zeros(count, bool)
    if chunk.nearby is not None and speed is None and task.vertical and not model.warm:
        near, guess, rests = _all_at_once(task, chunk, start, guess, fall, resting)
        if rests.all():
            return near, guess, fall
        latest.append((np.arange(count), near))
        begun.append(latest[-1])
        keep(~rests)
    roll, solved = resting_roll(displacements, guess, task.wheelset.half_span, resting, fall, clear, rests)
    if not solved.all():
        raise NumericalError(
            "no roll of the wheelset lets normal and creep forces of both wheels carry their loads; lower "
            "friction, yaw or shift, or give the roll",
            row=int(np.argmin(solved)),
            rows=np.flatnonzero(~solved).tolist(),
        )
    keep(~solved)
    whole, order = by_point(wheels)
    if model.warm:
        contact = contact_joined(contacts, order)
    else:
        contact = forces_of(task, whole, turning, model, fields=True).contact
    return Equilibrium(whole, contact, turning, load, slopes), roll, fall


def _all_at_once(
    task: Task,
    chunk: ContactConditions,
    start: Wheels | None,
    roll: FloatArray,
    fall: FloatArray,
    resting: float,
) -> tuple[Equilibrium, FloatArray, NDArray[np.bool_]]:
    """Search for rotation speed, loads and roll together, by the slopes of an equilibrium nearby.

    The normal contact is solved in two rolls, from the wheels `start` if given; after that patches are
    stretched. Returns the equilibrium after the last step, the rolls (n,) of the points that rest in it or
    else to go on with, and which do.
    """

    def tilted(roll: FloatArray, load: FloatArray, start: Wheels | None) -> Wheels:
        here = replace(chunk, roll=roll)
        sides = [side_of(task, number, here) for number in (0, 1)]
        return solved_wheels(task, here, sides, load, np.ones((roll.size, 2), bool), start=start)

    model, columns = TANGENTIAL_MODELS[task.models.tangential], [0, 1, 2]
    assert chunk.nearby is not None
    count, span = roll.size, 2.0 * task.wheelset.half_span
    unknown, slope, moving = chunk.nearby[:, 2:5], slopes_nearby(chunk), np.ones(count, bool)
    last, step = np.zeros_like(unknown), np.zeros_like(unknown)
    speed, load = speed_and_load(task, chunk, unknown)
    wheels = tilted(roll, load, start)
    for trial in range(_MOST_TRIALS):
        residual = residuals(task, chunk, forces_of(task, wheels, speed, model), columns)
        if trial > 1:  # before, the residuals changed with the roll, too
            seen = secant_slope(slope, residual - last, step, columns)
            slope = np.where(moving[:, None, None], seen, slope)
        step = np.where(moving[:, None], newton_step(slope, residual, LARGEST_STEP), 0.0)
        unknown, last = unknown + step, residual
        speed, load = speed_and_load(task, chunk, unknown)
        wheels = stretched(wheels, load)
        if trial == 0:
            right, left = _displacements(wheels, count)
            roll, solved_for = roll + (right - left) / (span * fall), load
            wheels = tilted(roll, load, wheels)
            continue
        moving &= ~promising(residual, columns)
        if not moving.any():
            break
    right, left = _displacements(wheels, count)
    forces = forces_of(task, wheels, speed, model, fields=True)
    rests = ~moving & ~out_of_balance(residuals(task, chunk, forces, columns), columns, model)
    rests &= may_be_stretched(wheels, solved_for, load).all(axis=1) & (np.abs(right - left) <= resting)
    solved = Equilibrium(wheels, forces.contact, speed, load, slope)
    return solved, np.where(rests, roll, roll + (right - left) / (span * fall)), rests


def _near_rest(task: Task, chunk: ContactConditions) -> tuple[FloatArray, FloatArray, list[Side]]:
    """Roll (n,) at which coarse patches without creep forces carry the wheel loads [rad]; fall and sides."""
    fall = np.ones(chunk.shift.size)
    sides: dict[int, Side] = {}

    def displacements(angle: FloatArray, wanted: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray]:
        rows, tilted = np.flatnonzero(wanted), replace(chunk, roll=angle)
        both = np.zeros((2, wanted.size))
        for number in (0, 1):
            before = sides.get(number)
            try:
                side = side_of(task, number, tilted, rows, None if before is None else before.gap)
                normal = normal_of(task, side, rows, chunk.loads[rows, number], rough=True)
            except ContactError as error:
                error.side = number
                raise
            both[number, normal.patch.row] = normal.vertical_displacement
            if before is not None and before.rough is not None:
                kept = patches_where(before.rough, ~wanted[before.rough.patch.row])
                normal = by_row([kept, normal])
            sides[number] = replace(side, rough=normal)
        return both[0], both[1]

    roll, solved = resting_roll(displacements, chunk.roll, task.wheelset.half_span, _NEAR_REST, fall)
    if not solved.all():
        raise ContactError(
            "no roll of the wheelset lets both wheels carry their loads; "
            "check shift, gauge and profiles, or give the roll",
            int(np.argmin(solved)),
            rows=np.flatnonzero(~solved).tolist(),
        )
    return roll, fall, [sides[number] for number in (0, 1)]


def _of_whole(error: ContactError, rows: IntArray) -> ContactError:
    """Return the error of one of some rows with its place in the whole."""
    if error.row is not None:
        error.row = int(rows[error.row])
        error.rows = tuple(rows[list(error.rows)].tolist())
    return error


def _displacements(wheels: Wheels, count: int) -> tuple[FloatArray, FloatArray]:
    """Vertical displacements (n,) of both wheels [m]."""
    # Patches of a wheel are stretched on their own: the first one carries the most.
    first = np.searchsorted(wheels.place, np.arange(2 * count))
    both: FloatArray = wheels.normal.vertical_displacement[first]
    return both[::2], both[1::2]
