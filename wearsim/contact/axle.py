r"""Equilibrium of a wheelset: rotation speed, normal forces and roll that balance torque, loads and heights.

Normal and creep forces of the patches of a wheel carry its load Q together,

.. math:: \sum (N\cos\delta - F_y\sin\delta)\cos\alpha - F_x\sin\alpha = Q,

with the inclination :math:`\alpha` of the rolling direction where a yawed wheel touches a roller off its top
(rail: 0), the creep forces of both wheels balance the torque on the axle, and a wheelset that is free to roll
rests on both wheels: their loads push them down by the same height. Unknowns of each operating point are the
rotation speed, for each wheel the load L its normal forces would carry alone, and the roll. All of them are
searched for together: from an equilibrium nearby, or from that of coarse patches and FASTSIM (`rough_axle`),
whatever the models, whose slopes Broyden's method [1]_ improves, with their zeros kept [2]_. Between trials
patches are stretched or solved anew, see `loaded`. Where a model's load jumps past the balance, patches of
one side of the jump are stretched by up to a tenth of the load, which `load_scale` states.

References
----------
.. [1] C. G. Broyden, Mathematics of Computation 19 (1965) 577-593.
.. [2] L. K. Schubert, Mathematics of Computation 24 (1970) 27-30.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.loaded import (
    SIMILAR,
    displacements,
    loads_of,
    may_be_stretched,
    renewed,
    solved_wheels,
)
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import UNKNOWNS, ContactConditions
from wearsim.contact.tangential import TANGENTIAL_MODELS, TangentialModel, TangentialSolution
from wearsim.contact.wheels import (
    Forces,
    Side,
    Task,
    Wheels,
    by_point,
    contact_joined,
    contact_where,
    forces_of,
    patches_where,
    side_of,
    stretched,
)
from wearsim.errors import NumericalError

SPEED, RIGHT, LEFT, ROLL = range(4)
"""Columns of the unknowns: rotation speed, loads of both wheels, roll."""
ROLL_UNIT = 1e-4
"""Unknown 1 of the roll [rad]; residual 1 of the heights is what it moves them by."""
SPEED_UNIT = 1e-3
"""Unknown 1 of the rotation speed, over the nominal one."""
LARGEST_STEP = np.array([2.0, 0.2, 0.2, 5.0])
TOLERANCE = 1e-6
"""Of vertical forces over the wheel load; of the torque over friction coefficient x load x radius, or that of
the tangential model if it is larger."""
RESTING = 1e-9
"""Between the displacements of both wheels of a wheelset at rest [m]."""

_OF_SCATTER = 0.5  # of displacements from unlike starts, by which they may differ at rest, too
# Residuals below which one more step is enough: it leaves 3 % of those with a torque, 0.3 % of loads alone,
# mostly far less.
_PROMISING, _PROMISING_LOADS = 1.5e-5, 3e-4
_OF_LOAD = 0.3  # creep forces that friction can carry over the load, about
_MOST_TRIALS = 30
_FROZEN = 17  # trials after which patches are only stretched: a model whose load jumps has no other balance
_LARGEST_JUMP = 0.1  # of the logarithm of a load, by which patches may be stretched then
_AT_REST_THEN = 1.0  # residual of the heights that is accepted then
_LOOSER = 100.0, 10.0  # factors on the tolerance of warm models in the first trials
_AT_JUMP = 8  # trials after which jumps of the creep forces are taken to be what is left
_AFRESH = 6  # trials after which slopes are taken anew, by differences
# Residuals by column, as shares of what friction can carry, of the wheel loads, and of a unit of roll.
_MISSED = "torque", "right load", "left load", "roll"
# Residuals on the left that hang on unknowns above; the wheels act on each other through torque and roll.
_LINKED = np.array([[1, 1, 1, 1], [1, 1, 0, 1], [1, 0, 1, 1], [0, 1, 1, 1]], dtype=bool)


@dataclass(frozen=True)
class Axles:
    """Wheels in equilibrium, ordered by point, side and falling normal force.

    `contact` has the fields of cells if wanted; `unknown` (n, 4) are rotation speed, loads and roll in their
    units, see `read`; `slopes` (n, 4, 4) those of the residuals, of unit where they are not balanced.
    """

    wheels: Wheels
    contact: TangentialSolution
    unknown: FloatArray
    slopes: FloatArray


@dataclass(frozen=True)
class Begin:
    """Where a search begins: unknowns (n, 4), slopes (n, 4, 4), sides in that pose, and patches if known."""

    unknown: FloatArray
    slopes: FloatArray
    sides: tuple[Side, ...]
    wheels: Wheels | None


@dataclass(frozen=True)
class Balanced:
    """Sides that are balanced together, and the columns of their unknowns."""

    sides: tuple[int, ...]
    columns: list[int]


def balanced_together(
    task: Task, chunk: ContactConditions, sides: tuple[int, ...], given: FloatArray | None
) -> list[Balanced]:
    """Wheels on the same axle if its rotation speed or its roll is free, else each on its own."""
    together = given is None or chunk.free_roll
    return [
        Balanced(
            group,
            [SPEED] * (given is None)
            + [1 + side for side in group if task.vertical]
            + [ROLL] * chunk.free_roll,
        )
        for group in ([sides] if together else [(side,) for side in sides])
    ]


def written(
    task: Task, chunk: ContactConditions, speed: FloatArray, load: FloatArray, roll: FloatArray
) -> FloatArray:
    """Unknowns (n, 4) of like size: rotation speeds (n,), loads (n, 2) and rolls (n,)."""
    slower = speed * -task.wheelset.radius / chunk.speed - 1.0
    return np.column_stack([slower / SPEED_UNIT, np.log(load / chunk.loads), roll / ROLL_UNIT])


def read(
    task: Task, chunk: ContactConditions, unknown: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rotation speeds (n,), negative when rolling forwards [rad/s], loads (n, 2) [N] and rolls (n,) [rad]."""
    speed = -chunk.speed / task.wheelset.radius * (1.0 + SPEED_UNIT * unknown[:, SPEED])
    return speed, chunk.loads * np.exp(unknown[:, RIGHT:ROLL]), ROLL_UNIT * unknown[:, ROLL]


def residuals(
    task: Task, chunk: ContactConditions, wheels: Wheels, forces: Forces, columns: list[int]
) -> FloatArray:
    """Compute what is missed (n, k) in the columns of the unknowns.

    Torque over what friction can carry; logarithm of vertical forces over the wheel load; displacement of the
    right wheel less that of the left one, over what the unit of roll moves them by.
    """
    every = np.zeros((chunk.shift.size, UNKNOWNS))
    if SPEED in columns:
        scale = chunk.traction_scale * task.wheelset.radius
        every[:, SPEED] = (forces.torque.sum(axis=1) - chunk.torque) / scale
    every[:, RIGHT:ROLL] = np.log(np.maximum(forces.vertical / chunk.loads, 1e-9))
    if ROLL in columns:
        right, left = displacements(wheels, chunk.shift.size).T
        every[:, ROLL] = (right - left) / (2.0 * task.wheelset.half_span * ROLL_UNIT)
    return every[:, columns]


def newton_step(slope: FloatArray, residual: FloatArray, columns: list[int]) -> FloatArray:
    """Newton's step, shortened to the largest one."""
    if not columns:
        return residual
    alone = len(columns) == 1  # for which the library takes ten times as long
    idle = ~np.asarray(slope.any(axis=1))  # unknowns without effect: the speed without friction
    slope = np.where(idle[:, :, None] & np.eye(len(columns), dtype=bool), 1.0, slope)
    flat = ~(np.abs(slope[:, 0, 0] if alone else np.linalg.det(slope)) > 1e-12)
    slope = np.where(flat[:, None, None], np.eye(len(columns)), slope)
    step = -residual / slope[:, 0] if alone else -np.linalg.solve(slope, residual[:, :, None])[:, :, 0]
    longest = np.abs(step / LARGEST_STEP[columns]).max(axis=1)
    shortened: FloatArray = step / np.maximum(longest, 1.0)[:, None]
    return shortened


def secant_slope(slope: FloatArray, change: FloatArray, step: FloatArray, columns: list[int]) -> FloatArray:
    """Slopes (n, k, k) after a step (n, k) that changed the residuals by (n, k), by Broyden's rule."""
    missed = change - (slope @ step[:, :, None])[:, :, 0]
    part = np.where(_LINKED[np.ix_(columns, columns)], step[:, None], 0.0)
    square = np.maximum((part**2).sum(axis=2), 1e-300)
    result: FloatArray = slope + (missed / square)[:, :, None] * part
    return result


def slopes_by_differences(
    task: Task,
    chunk: ContactConditions,
    sides: tuple[Side, ...],
    wheels: Wheels,
    before: Forces,
    model: TangentialModel,
    speed: FloatArray,
    columns: list[int],
    *,
    rough: bool = False,
) -> FloatArray:
    """Differences (n, k, k) of the residuals over those of the unknowns.

    Parameters
    ----------
    task : Task
        Wheelset, counterface and models.
    chunk : ContactConditions
        n operating points.
    sides : tuple of Side
        In the pose of the wheels.
    wheels : Wheels
        Under their loads.
    before : Forces
        Of the tangential model at these wheels.
    model : TangentialModel
        For the forces beside them.
    speed : (n,) array
        Rotation speed [rad/s].
    columns : list of int
        Of the k unknowns.
    rough : bool
        Whether wheels at another roll are solved with coarse patches.

    Returns
    -------
    (n, k, k) array
        Those of unknowns without columns are left out.
    """
    turn, grow, tilt = 1e-2, SIMILAR, 5e-2
    count = speed.size
    load = loads_of(wheels, count)
    rows = list(range(UNKNOWNS if ROLL in columns else ROLL))  # residuals, whose slopes are taken
    still = residuals(task, chunk, wheels, before, rows)
    slope = np.tile(np.eye(UNKNOWNS), (count, 1, 1))
    if SPEED in columns:
        faster = speed - turn * SPEED_UNIT * chunk.speed / task.wheelset.radius
        after = residuals(task, chunk, wheels, forces_of(task, wheels, faster, model), rows)
        slope[:, rows, SPEED] = (after - still) / turn
    if RIGHT in columns or LEFT in columns:  # both at once: they act on each other through torque and roll
        heavier = stretched(wheels, np.exp(grow) * load)
        forces = forces_of(task, heavier, speed, model)
        after = residuals(task, chunk, heavier, forces, rows)
        scale = chunk.traction_scale * task.wheelset.radius
        slope[:, SPEED, RIGHT:ROLL] = (forces.torque - before.torque) / (grow * scale[:, None])
        slope[:, [RIGHT, LEFT], [RIGHT, LEFT]] = (after - still)[:, RIGHT:ROLL] / grow
        if ROLL in columns:
            lower = displacements(heavier, count) - displacements(wheels, count)
            slope[:, ROLL, RIGHT:ROLL] = (
                lower * [1.0, -1.0] / (grow * 2.0 * task.wheelset.half_span * ROLL_UNIT)
            )
    if ROLL in columns:
        roll = sides[0].sign * sides[0].pose.roll + tilt * ROLL_UNIT
        there = np.isin(np.arange(2 * count), wheels.place).reshape(-1, 2)
        beside = tuple(_tilted(task, chunk, side, roll, np.asarray(there.all(axis=1))) for side in sides)
        leaning = solved_wheels(task, chunk, beside, load, there, None if rough else wheels, rough)
        forces = forces_of(task, leaning, speed, model)
        slope[:, rows, ROLL] = (residuals(task, chunk, leaning, forces, rows) - still) / tilt
    return slope[:, columns][:, :, columns]


def settled(
    task: Task,
    chunk: ContactConditions,
    groups: list[Balanced],
    given: FloatArray | None,
    begin: list[Begin],
    *,
    near: bool,
) -> Axles:
    """Balance torque, loads and heights of every point of a chunk.

    Parameters
    ----------
    task : Task
        Wheelset, counterface and models.
    chunk : ContactConditions
        n operating points.
    groups : list of Balanced
        As of `balanced_together`.
    given : (n,) array, optional
        Rotation speed, negative when rolling forwards [rad/s]; None: free.
    begin : list of Begin
        Where the search of each group begins.
    near : bool
        Whether that is an equilibrium nearby.

    Returns
    -------
    Axles
        With the fields of cells that the task wants. With FASTSIM a point does not depend on the others but
        for the last bits of sums over padding, nor a wheel on the other one if speed and roll are given;
        with a warm tangential model within its tolerance.

    Raises
    ------
    ContactError
        If a wheel has no contact, or its flange locks: at a contact angle whose tangent times the friction
        coefficient reaches 1 creep forces lift the wheel whatever the normal force.
    NumericalError
        If the iteration does not converge.
    """
    model = TANGENTIAL_MODELS[task.models.tangential]
    every = np.ones(chunk.shift.size, bool)
    hasty = not (model.warm and near)
    wheels, contacts, unknown, slopes = _searched(task, chunk, groups, given, begin, every, hasty)
    whole, order = by_point(wheels)
    if model.warm:
        return Axles(whole, contact_joined(contacts, order), unknown, slopes)
    columns = [column for group in groups for column in group.columns]
    forces = forces_of(task, whole, _speed(task, chunk, unknown, given), model, fields=True)
    missed = _missed(task, residuals(task, chunk, whole, forces, columns), columns)
    if missed.any():  # a step promised too much
        again, _, corrected, renewed_slopes = _searched(task, chunk, groups, given, begin, missed, False)
        unknown[missed], slopes[missed] = corrected[missed], renewed_slopes[missed]
        if not missed.all():
            again = [patches_where(whole, ~missed[whole.normal.patch.row]), *again]
        whole, _ = by_point(again)
        forces = forces_of(task, whole, _speed(task, chunk, unknown, given), model, fields=True)
    return Axles(whole, forces.contact, unknown, slopes)


def _searched(
    task: Task,
    chunk: ContactConditions,
    groups: list[Balanced],
    given: FloatArray | None,
    begin: list[Begin],
    wanted: NDArray[np.bool_],
    hasty: bool,
) -> tuple[list[Wheels], list[TangentialSolution], FloatArray, FloatArray]:
    """Wheels in equilibrium of the points `wanted` (n,), from a search for each group; as of `_newton`.

    Slopes are those of all unknowns (n, 4, 4), and like the unknowns (n, 4) of points wanted alone.
    """
    unknown = begin[0].unknown.copy()
    slopes = np.tile(np.eye(UNKNOWNS), (wanted.size, 1, 1))
    wheels: list[Wheels] = []
    contacts: list[TangentialSolution] = []
    for group, start in zip(groups, begin, strict=True):
        parts, contact, solution, steepness = _newton(task, chunk, group, given, start, wanted, hasty)
        block = np.array(group.columns, dtype=np.int64)
        slopes[np.ix_(wanted, block, block)] = steepness[wanted]
        unknown[np.ix_(wanted, block)] = solution[wanted][:, block]
        wheels.extend(parts)
        contacts.extend(contact)
    return wheels, contacts, unknown, slopes


def _speed(task: Task, chunk: ContactConditions, unknown: FloatArray, given: FloatArray | None) -> FloatArray:
    """Rotation speeds (n,) that are given or searched for [rad/s]."""
    return read(task, chunk, unknown)[0] if given is None else given


def resting(task: Task) -> float:
    """Residual of the heights of a wheelset at rest."""
    apart = max(RESTING, _OF_SCATTER * NORMAL_MODELS[task.models.normal].scatter)
    return apart / (2.0 * task.wheelset.half_span * ROLL_UNIT)


def _missed(
    task: Task, residual: FloatArray, columns: list[int], *, at_jump: bool = False, frozen: bool = False
) -> NDArray[np.bool_]:
    """Whether points (n,) are out of balance by more than the tolerance, or a jump of the creep forces."""
    model = TANGENTIAL_MODELS[task.models.tangential]
    torque, load = max(model.tolerance, TOLERANCE), TOLERANCE
    if at_jump:
        torque, load = max(model.jump, torque), max(_OF_LOAD * model.jump, load)
    tolerance = np.array([torque, load, load, _AT_REST_THEN if frozen else resting(task)])[columns]
    beyond: NDArray[np.bool_] = np.abs(residual) > tolerance
    return np.asarray(beyond.any(axis=1))


def _promising(task: Task, residual: FloatArray, columns: list[int]) -> NDArray[np.bool_]:
    """Whether one more step from points (n,) with these residuals is enough, without another roll."""
    most = _PROMISING if SPEED in columns else _PROMISING_LOADS
    tolerance = np.array([most, most, most, resting(task)])[columns]
    return np.asarray((np.abs(residual) <= tolerance).all(axis=1))


def _tilted(
    task: Task, chunk: ContactConditions, side: Side, roll: FloatArray, moved: NDArray[np.bool_]
) -> Side:
    """Side of the same points at rolls (n,) [rad]; those that have not `moved` (n,) stay as they are."""
    rows = None if moved.all() else np.flatnonzero(moved)
    return side_of(task, side.number, replace(chunk, roll=roll), rows, side.gap)


def _newton(
    task: Task,
    chunk: ContactConditions,
    group: Balanced,
    given: FloatArray | None,
    begin: Begin,
    wanted: NDArray[np.bool_],
    hasty: bool,
) -> tuple[list[Wheels], list[TangentialSolution], FloatArray, FloatArray]:
    """Wheels in equilibrium in the order they got there, by Broyden's method, of the points `wanted` (n,).

    And creep forces of a warm model, unknowns (n, 4) and slopes (n, k, k). If `hasty`, a point whose
    residuals are promising takes one more step and is not looked at again; warm models are solved loosely in
    the first trials instead.
    """
    columns, model, sides = group.columns, TANGENTIAL_MODELS[task.models.tangential], begin.sides
    early, hasty = hasty and model.warm and bool(columns), hasty and not model.warm
    unknown, slope = begin.unknown.copy(), begin.slopes[:, columns][:, :, columns]
    count = chunk.shift.size
    here = np.zeros((count, 2), bool)
    here[:, list(group.sides)] = True
    open_rows = wanted.copy()
    roll = sides[0].sign * sides[0].pose.roll
    unmoved = resting(task) * ROLL_UNIT
    contact: TangentialSolution | None = None
    last, before = unknown, np.zeros((count, len(columns)))
    done: list[Wheels] = []
    contacts: list[TangentialSolution] = []
    for trial in range(_MOST_TRIALS):
        here &= open_rows[:, None]
        _, load, aim = read(task, chunk, unknown)
        speed = _speed(task, chunk, unknown, given)
        moved = np.zeros(count, bool)
        if ROLL in columns and trial <= _FROZEN:
            moved = open_rows & (np.abs(aim - roll) > unmoved)
        if moved.any():
            roll = np.where(moved, aim, roll)
            sides = tuple(_tilted(task, chunk, side, roll, moved) for side in sides)
        unknown[:, ROLL] = roll / ROLL_UNIT
        if trial == 0:
            wheels = solved_wheels(task, chunk, sides, load, here, start=begin.wheels)
        again = here & (moved[:, None] | ~may_be_stretched(wheels, loads_of(wheels, count), load))
        if hasty and trial > 0:
            sure = open_rows & ~again.any(axis=1) & _promising(task, before, columns)
            if sure.any():
                mask = sure[wheels.normal.patch.row]
                done.append(stretched(patches_where(wheels, mask), load))
                open_rows &= ~sure
                if not open_rows.any():
                    break
                wheels = patches_where(wheels, ~mask)
        if 0 < trial <= _FROZEN and again.any():
            old = wheels
            wheels = renewed(task, chunk, sides, wheels, load, again)
            contact = _matched(contact, old, wheels)
        similar = stretched(wheels, load)
        looser = _LOOSER[trial] if early and trial < len(_LOOSER) else 1.0
        options = {"start": contact, "looser": looser} if model.warm else {}
        forces = forces_of(task, similar, speed, model, fields=model.warm, **options)
        contact = forces.contact if model.warm else None
        residual = residuals(task, chunk, similar, forces, columns)
        frozen = trial > _FROZEN
        missed = _missed(task, residual, columns, at_jump=trial >= _AT_JUMP, frozen=frozen)
        settled = open_rows & ~missed & (looser == 1.0)
        settled &= not hasty or frozen  # else one more step costs nothing
        if frozen:
            similar, jump = _frozen(similar, wheels, count)
            settled &= jump <= _LARGEST_JUMP
        if settled.any() or count == 0:
            mask = settled[similar.normal.patch.row]
            done.append(patches_where(similar, mask))
            if contact is not None:
                contacts.append(contact_where(contact, mask))
                contact = contact_where(contact, ~mask)
            open_rows &= ~settled
            if not open_rows.any():
                break
            wheels = patches_where(wheels, ~mask)
        if trial > 0 and trial % _AFRESH == 0:
            similar = stretched(wheels, load)
            still = forces_of(task, similar, speed, model)
            found = slopes_by_differences(task, chunk, sides, similar, still, model, speed, columns)
            slope = np.where(open_rows[:, None, None], found, slope)
        elif trial > 0:
            step = (unknown - last)[:, columns]
            seen = secant_slope(slope, residual - before, step, columns)
            slope = np.where(open_rows[:, None, None], seen, slope)
        before, last = residual, unknown.copy()
        step = newton_step(*_with_roll_kept(slope, residual, columns, resting(task), frozen), columns)
        unknown[:, columns] += np.where(open_rows[:, None], step, 0.0)
    else:
        raise _unbalanced(residual, columns, open_rows)
    return done, contacts, unknown, slope


def _with_roll_kept(
    slope: FloatArray, residual: FloatArray, columns: list[int], resting: float, frozen: bool
) -> tuple[FloatArray, FloatArray]:
    """Slopes and residuals for a step of the other unknowns alone, of points (n,) that are at rest."""
    if ROLL not in columns:
        return slope, residual
    kept = np.abs(residual[:, -1]) <= (np.inf if frozen else resting)
    slope, residual = slope.copy(), residual.copy()
    residual[kept, -1] = slope[kept, -1] = slope[kept, :, -1] = 0.0
    slope[kept, -1, -1] = 1.0
    return slope, residual


def _unbalanced(residual: FloatArray, columns: list[int], open_rows: NDArray[np.bool_]) -> NumericalError:
    """Error of the points that are not balanced."""
    row = int(np.argmax(open_rows))
    rows = np.flatnonzero(open_rows).tolist()
    if ROLL in columns and abs(residual[row, -1]) > _AT_REST_THEN:
        reason = (
            "no roll of the wheelset lets normal and creep forces of both wheels carry their loads; lower "
            "friction, yaw or shift, or give the roll"
        )
    else:
        left = ", ".join(
            f"{_MISSED[column]} {value:.1e}" for column, value in zip(columns, residual[row], strict=True)
        )
        reason = (
            f"wheel load and axle torque are not balanced by contact forces: left over are {left} after "
            f"{_MOST_TRIALS} trials; smooth measured profiles, or lower friction, yaw or shift"
        )
    return NumericalError(reason, row=row, rows=rows)


def _frozen(near: Wheels, wheels: Wheels, count: int) -> tuple[Wheels, FloatArray]:
    """Stretched patches, their load scale saying how far, and its largest logarithm of each point."""
    ratio = near.load / wheels.load
    jump = np.zeros(count)
    np.maximum.at(jump, near.normal.patch.row, np.abs(np.log(ratio)))
    normal = replace(near.normal, load_scale=ratio * near.normal.load_scale)
    return replace(near, normal=normal), jump


def _matched(contact: TangentialSolution | None, old: Wheels, new: Wheels) -> TangentialSolution | None:
    """Tangential solution of wheels, as a start for the patches of others that are the same.

    The rest of them have no pressure in it: whether a patch has a start does not depend on other wheels.
    """
    if contact is None or contact.cells is None:
        return None
    known = {key: m for m, key in enumerate(_patch_keys(old))}
    of = np.array([known.get(key, -1) for key in _patch_keys(new)], dtype=np.int64)
    patch, same = new.normal.patch, of >= 0
    cells = np.zeros((5, of.size, int(patch.cells.max(initial=1)), patch.y.shape[1]))
    if patch.grid is not None:
        cells = np.zeros((5, *patch.grid.pressure.shape))
    along, across = np.minimum(cells.shape[2:], contact.cells.shape[2:])
    cells[:, same, :along, :across] = contact.cells[:, of[same], :along, :across]
    length = np.zeros_like(patch.y)
    return TangentialSolution(np.zeros((of.size, 3)), np.zeros(of.size), length, length, cells)


def _patch_keys(wheels: Wheels) -> list[tuple[int, ...]]:
    """Wheel, rank by force, strips and cells of each patch."""
    place, patch = wheels.place, wheels.normal.patch
    first = np.concatenate(([0], np.flatnonzero(np.diff(place)) + 1))
    rank = np.arange(place.size) - np.repeat(first, np.diff(np.append(first, place.size)))
    keys = np.column_stack((place, rank, patch.strips, patch.cells))
    return list(map(tuple, keys.tolist()))
