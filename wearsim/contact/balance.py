r"""Equilibrium of the wheels of a wheelset: normal forces and rotation speed that balance loads and torque.

Normal and creep forces of the patches of a wheel carry its load Q together,

.. math:: \sum (N\cos\delta - F_y\sin\delta)\cos\alpha - F_x\sin\alpha = Q,

with the inclination :math:`\alpha` of the rolling direction where a yawed wheel touches a roller off its top
(rail: 0), and the creep forces of both wheels balance the torque on the axle. Unknowns of each operating
point are the rotation speed, and for each wheel the load L its normal forces would carry alone. First they
are bracketed with coarse patches and FASTSIM, whatever the models, or they are those of a like point; from
there Broyden's method [1]_, with the zeros of the slopes kept [2]_, takes two or three evaluations of the
true ones. Between evaluations patches are stretched by similarity (lengths and pressures with the cube root
of the load, exact for a quadratic gap) as long as the load changes by at most `SIMILAR`, with several patches
by a fiftieth of that; beyond they are solved anew. Where a model's load jumps past the balance, patches of
one side of the jump are stretched by up to a tenth of the load, which `load_scale` states.

References
----------
.. [1] C. G. Broyden, Mathematics of Computation 19 (1965) 577-593.
.. [2] L. K. Schubert, Mathematics of Computation 24 (1970) 27-30.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.equilibrium import balanced_rotation
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import ContactConditions
from wearsim.contact.tangential import TANGENTIAL_MODELS, TangentialModel, TangentialSolution, fastsim
from wearsim.contact.unknowns import (
    LARGEST_STEP,
    SPEED_UNIT,
    newton_step,
    out_of_balance,
    promising,
    residuals,
    secant_slope,
    slopes_nearby,
    speed_and_load,
    unknowns,
)
from wearsim.contact.wheels import (
    Forces,
    Side,
    Task,
    Wheels,
    by_point,
    contact_joined,
    contact_where,
    forces_of,
    joined,
    normal_of,
    patches_where,
    planes_of,
    renumbered,
    stretched,
    wheels_of,
)
from wearsim.errors import ContactError, NumericalError

SIMILAR = 1e-3
"""Change of the logarithm of a load up to which patches are stretched instead of solved anew."""
_SEVERAL = 0.02  # of it for a wheel on several patches: one takes more of a load than the other
_NEAR = 0.05  # logarithm of vertical force over wheel load with which the true models can begin
_MOST_LOADS = 40  # brackets of the load
_HIGHEST = np.log(10.0)  # logarithm of the largest load L over Q that is tried
_RAISED = 1.5  # L over Q from which a wheel without solution is one that creep forces lift
_MOST_TRIALS = 30
_FROZEN = 17  # trials after which patches are only stretched: a model whose load jumps has no other balance
_LARGEST_JUMP = 0.1  # of the logarithm of a load, by which patches may be stretched then
_LOOSER = 100.0, 10.0  # factors on the tolerance of warm models in the first trials
_AT_JUMP = 8  # trials after which jumps of the creep forces are taken to be what is left
_AFRESH = 6  # trials after which slopes are taken anew, by differences
_FAR = 0.2  # change of the logarithm of a load beyond which coarse patches are solved anew

# unknowns (n, 3), slopes of the residuals and patches, which are made at the first trial if there are none
_Begin = tuple[FloatArray, FloatArray, Wheels | None]


@dataclass(frozen=True)
class Equilibrium:
    """Wheels in equilibrium, ordered by point, side and falling normal force.

    `contact` has the fields of cells if wanted, `speed` (n,) is the rotation speed [rad/s], `load` (n, 2) the
    L of both wheels [N], `slopes` (n, 3, 3) those of the residuals, of unit where they are not balanced.
    """

    wheels: Wheels
    contact: TangentialSolution
    speed: FloatArray
    load: FloatArray
    slopes: FloatArray

    def take(self, rows: IntArray) -> Equilibrium:
        """Equilibrium of some points, in rising order; what it says of others is lost."""
        if rows.size == self.speed.size:
            return self
        place = np.full(self.speed.size, -1)
        place[rows] = np.arange(rows.size)
        taken = place[self.wheels.normal.patch.row]
        return Equilibrium(
            renumbered(patches_where(self.wheels, taken >= 0), place),
            contact_where(self.contact, taken >= 0),
            self.speed[rows],
            self.load[rows],
            self.slopes[rows],
        )


def equilibrium(
    task: Task,
    chunk: ContactConditions,
    sides: list[Side],
    speed: FloatArray | None,
    nearby: Equilibrium | None = None,
    fields: bool = True,
) -> Equilibrium:
    """Balance loads, and torque if the rotation speed is not given, for every point of a chunk.

    Parameters
    ----------
    task : Task
        Wheelset, counterface and models.
    chunk : ContactConditions
        n operating points.
    sides : list of Side
        Those that are balanced; both for free rotation.
    speed : (n,) array, optional
        Rotation speed, negative when rolling forwards [rad/s]; None: free.
    nearby : Equilibrium, optional
        Of the same points in another pose, to begin with instead of coarse patches.
    fields : bool
        Whether fields of cells are wanted; warm models have them anyway.

    Returns
    -------
    Equilibrium
        With FASTSIM a point does not depend on the others but for the last bits of sums over padding, nor a
        wheel on the other one if the speed is given; with a warm tangential model within its tolerance.

    Raises
    ------
    ContactError
        If a wheel has no contact, or its flange locks: at a contact angle whose tangent times the friction
        coefficient reaches 1 creep forces lift the wheel whatever the normal force.
    NumericalError
        If no rotation speed balances the torque, or the iteration does not converge.
    """
    model = TANGENTIAL_MODELS[task.models.tangential]
    groups = _together(task, sides, speed)
    every = np.ones(chunk.shift.size, bool)
    load = chunk.loads.copy()
    turning = -chunk.speed / task.wheelset.radius if speed is None else speed.copy()
    if nearby is None:
        begin = [_bracketed(task, chunk, group, columns, speed) for group, columns in groups]
    else:
        unknown = unknowns(task, chunk, nearby.speed, nearby.load)
        begin = [(unknown, nearby.slopes[:, columns][:, :, columns], nearby.wheels) for _, columns in groups]
    slopes = np.tile(np.eye(3), (every.size, 1, 1))
    wheels: list[Wheels] = []
    contacts: list[TangentialSolution] = []

    def refine(wanted: NDArray[np.bool_], hasty: bool) -> None:
        for (group, columns), near in zip(groups, begin, strict=True):
            parts, fields, turned, carried, steepness = _refined(
                task, chunk, group, columns, speed, near, wanted, hasty
            )
            block = np.array(columns, dtype=np.int64)
            slopes[np.ix_(wanted, block, block)] = steepness[wanted]
            wheels.extend(parts)
            contacts.extend(fields)
            for side in group:
                load[wanted, side.number] = carried[wanted, side.number]
            turning[wanted] = turned[wanted]

    refine(every, hasty=not model.warm or (nearby is None and chunk.nearby is None))
    whole, order = by_point(wheels)
    if model.warm:
        return Equilibrium(whole, contact_joined(contacts, order), turning, load, slopes)
    forces = forces_of(task, whole, turning, model, fields=fields)
    columns = [column for _, some in groups for column in some]
    missed = out_of_balance(residuals(task, chunk, forces, columns), columns, model)
    if missed.any():  # a step promised too much
        wheels = [patches_where(whole, ~missed[whole.normal.patch.row])] if not missed.all() else []
        refine(missed, hasty=False)
        whole, _ = by_point(wheels)
        forces = forces_of(task, whole, turning, model, fields=fields)
    return Equilibrium(whole, forces.contact, turning, load, slopes)


def _together(task: Task, sides: list[Side], speed: FloatArray | None) -> list[tuple[list[Side], list[int]]]:
    """Sides that are balanced together, and the columns of their unknowns: speed, right and left load."""
    groups = [sides] if speed is None else [[side] for side in sides]
    return [
        (group, [0] * (speed is None) + [1 + side.number for side in group if task.vertical])
        for group in groups
    ]


def solved_wheels(
    task: Task,
    chunk: ContactConditions,
    sides: list[Side],
    load: FloatArray,
    wanted: NDArray[np.bool_],
    start: Wheels | None = None,
    rough: bool = False,
) -> Wheels:
    """Solve normal and kinematical problem of the wheels `wanted` (n, 2) under loads (n, 2), by point."""
    parts = []
    for side in sides:
        row = np.flatnonzero(wanted[:, side.number])
        if row.size == 0 and chunk.shift.size > 0:
            continue
        earlier = None
        if start is not None:
            mask = (start.sign == side.sign) & wanted[start.normal.patch.row, side.number]
            earlier = patches_where(start.normal, mask)
        part = load[:, side.number]
        try:
            normal = side.rough if rough and start is None else None
            if normal is None:
                normal = normal_of(task, side, row, part[row], start=earlier, rough=rough)
            several = np.flatnonzero(np.diff(normal.patch.row) == 0)
            if chunk.creepage is not None and several.size > 0 and not rough:
                raise ContactError(
                    "several patches close: given creepages belong to one; leave them out",
                    row=int(normal.patch.row[several[0]]),
                )
        except ContactError as error:
            error.side = side.number
            if (
                start is None
                or error.row is None
                or load[error.row, side.number] <= _RAISED * chunk.loads[error.row, side.number]
            ):
                raise
            times = load[error.row, side.number] / chunk.loads[error.row, side.number]
            raise _lifted(
                start, error.row, side.number, f"at {times:.1f} times the wheel load {error}"
            ) from None
        parts.append(wheels_of(task, side, chunk, normal, part))
    return by_point(parts)[0]


def loads_of(wheels: Wheels, count: int) -> FloatArray:
    """Return the loads (n, 2) of wheels, 1 N of those that are not there."""
    load = np.ones(2 * count)
    load[wheels.place] = wheels.load
    return load.reshape(-1, 2)


def _renewed(
    task: Task,
    chunk: ContactConditions,
    sides: list[Side],
    wheels: Wheels,
    load: FloatArray,
    again: NDArray[np.bool_],
    *,
    rough: bool = False,
) -> Wheels:
    """Solve some of the wheels (n, 2) anew under their loads."""
    kept = ~again.ravel()[wheels.place]
    solved = solved_wheels(task, chunk, sides, load, again, start=wheels, rough=rough)
    whole: Wheels = joined([patches_where(wheels, kept), solved]) if kept.any() else solved
    return whole


def _bracketed(
    task: Task,
    chunk: ContactConditions,
    sides: list[Side],
    columns: list[int],
    given: FloatArray | None,
) -> _Begin:
    """Unknowns (n, 3) near equilibrium, slopes of the residuals, and the coarse patches they are of."""
    if chunk.nearby is not None:
        return chunk.nearby[:, 2:5], slopes_nearby(chunk)[:, columns][:, :, columns], None
    count = chunk.shift.size
    wheel_load = chunk.loads.copy()
    load = tried = wheel_load
    here = np.zeros((count, 2), bool)
    here[:, [side.number for side in sides]] = True
    rough = solved_wheels(task, chunk, sides, load, here, rough=True)
    speed = -chunk.speed / task.wheelset.radius if given is None else given
    low, high = np.full((count, 2), -np.inf), np.full((count, 2), np.inf)
    asked = open_rows = np.ones(count, bool)
    far = here & task.vertical
    for _ in range(_MOST_LOADS):
        again = here & open_rows[:, None] & (np.abs(np.log(load / loads_of(rough, count))) > _FAR)
        if again.any():
            rough = _renewed(task, chunk, sides, rough, load, again, rough=True)
        near = stretched(patches_where(rough, open_rows[rough.normal.patch.row]), load)
        tried = np.where(open_rows[:, None], load, tried)
        speed, forces = _turning(task, chunk, near, speed, ~open_rows, given is None)
        if not task.vertical:
            break
        excess = np.log(np.maximum(forces.vertical / wheel_load, 1e-9))
        here_log = np.log(load / wheel_load)
        now = far & open_rows[:, None]
        low = np.where(now & (excess < 0.0), np.maximum(low, here_log), low)
        high = np.where(now & (excess >= 0.0), np.minimum(high, here_log), high)
        aim = here_log - np.clip(excess, -1.0, 1.0)
        outside = np.isfinite(low) & np.isfinite(high) & ~((low < aim) & (aim < high))
        aim[outside] = 0.5 * (low[outside] + high[outside])
        load = np.where(now, wheel_load * np.exp(aim), load)
        locked = now & (aim > _HIGHEST)
        if locked.any():
            rows = np.flatnonzero(locked.any(axis=1)).tolist()
            reason = "no normal force up to ten times the wheel load balances it"
            raise _lifted(near, rows[0], int(np.argmax(locked[rows[0]])), reason, rows)
        asked = open_rows
        open_rows = np.asarray((now & (np.abs(excess) > _NEAR)).any(axis=1))
        if not open_rows.any():
            break
    if not asked.all():  # the last forces are of the points alone that took longest
        near = stretched(rough, tried)
        forces = forces_of(task, near, speed, fastsim.MODEL)
    slope = _slopes(task, chunk, near, forces, fastsim.MODEL, speed, columns)
    unknown = unknowns(task, chunk, speed, tried)
    unknown[:, columns] += newton_step(slope, residuals(task, chunk, forces, columns), LARGEST_STEP[columns])
    return unknown, slope, rough


def _turning(
    task: Task,
    chunk: ContactConditions,
    wheels: Wheels,
    speed: FloatArray,
    done: NDArray[np.bool_],
    free: bool,
) -> tuple[FloatArray, Forces]:
    """Rotation speeds (n,) near which FASTSIM balances the torque, if they are free, and its forces there."""
    if not free:
        return speed, forces_of(task, wheels, speed, fastsim.MODEL)
    latest: list[Forces] = []

    def torque(speed: FloatArray, wanted: NDArray[np.bool_]) -> FloatArray:
        few = bool(latest) and 0 < 2 * wanted.sum() < wanted.size
        part = patches_where(wheels, wanted[wheels.normal.patch.row]) if few else wheels
        forces = forces_of(task, part, speed, fastsim.MODEL)
        if latest:  # those of the points that found their speed stay as they are
            kept, new = latest.pop(), wanted[:, None]
            turning, vertical = np.where(new, (forces.torque, forces.vertical), (kept.torque, kept.vertical))
            forces = Forces(forces.contact, turning, vertical)
        latest.append(forces)
        total: FloatArray = forces.torque.sum(axis=1)
        return total

    radius = task.wheelset.radius
    most = chunk.traction * radius
    return balanced_rotation(torque, speed, -chunk.speed / radius, chunk.torque, most, done), latest[0]


def _lifted(wheels: Wheels, row: int, side: int, reason: str, rows: Sequence[int] = ()) -> ContactError:
    """Error of a wheel that normal forces cannot hold down for a reason."""
    own = (wheels.normal.patch.row == row) & (wheels.sign == 1.0 - 2.0 * side)
    angles = np.abs(planes_of(wheels.normal).angle[own])
    angle, friction = angles.max(), wheels.friction[own].flat[np.argmax(angles)]
    product = friction * np.tan(angle)
    return ContactError(
        f"{'flange locks: ' if product >= 1.0 else ''}at a contact angle of {np.degrees(angle):.1f} degrees "
        f"and a friction coefficient of {friction:g}, friction x tan(angle) = {product:.2f}, creep forces "
        f"lift the wheel, and {reason}; lower friction, yaw or shift",
        row=row,
        side=side,
        rows=rows,
    )


def _slopes(
    task: Task,
    chunk: ContactConditions,
    wheels: Wheels,
    before: Forces,
    model: TangentialModel,
    speed: FloatArray,
    columns: list[int],
) -> FloatArray:
    """Differences (n, k, k) of the residuals over those of the unknowns, from the forces of wheels."""
    turn, grow, every = 1e-2, SIMILAR, [0, 1, 2]
    still = residuals(task, chunk, before, every)
    slope = np.zeros((speed.size, 3, 3))
    slope[:, every, every] = 1.0
    if 0 in columns:
        faster = speed - turn * SPEED_UNIT * chunk.speed / task.wheelset.radius
        slope[:, :, 0] = (
            residuals(task, chunk, forces_of(task, wheels, faster, model), every) - still
        ) / turn
    if columns[-1:] > [0]:  # both loads at once: the wheels act on each other through the torque alone
        more = np.exp(grow) * loads_of(wheels, speed.size)
        forces = forces_of(task, stretched(wheels, more), speed, model)
        after = residuals(task, chunk, forces, every)
        scale = chunk.traction_scale * task.wheelset.radius
        slope[:, 0, 1:] = (forces.torque - before.torque) / (grow * scale[:, None])
        slope[:, [1, 2], [1, 2]] = (after - still)[:, 1:] / grow
    return slope[:, columns][:, :, columns]


def _refined(
    task: Task,
    chunk: ContactConditions,
    sides: list[Side],
    columns: list[int],
    given: FloatArray | None,
    near: _Begin,
    wanted: NDArray[np.bool_],
    hasty: bool,
) -> tuple[list[Wheels], list[TangentialSolution], FloatArray, FloatArray, FloatArray]:
    """Wheels in equilibrium in the order they got there, by Broyden's method, of the points `wanted` (n,).

    And creep forces of a warm model, rotation speeds (n,), loads (n, 2) and slopes. `near` is as of
    `_bracketed`.
    If `hasty`, a point whose residuals are `promising` takes one more step and is not looked at again; warm
    models are solved loosely in the first trials instead.
    """
    unknown, slope, rough = near[0].copy(), near[1].copy(), near[2]
    model = TANGENTIAL_MODELS[task.models.tangential]
    early, hasty = hasty and model.warm, hasty and not model.warm
    count = chunk.shift.size
    here = np.zeros((count, 2), bool)
    here[:, [side.number for side in sides]] = True
    here &= wanted[:, None]
    contact: TangentialSolution | None = None
    open_rows = wanted.copy()
    before, step = np.zeros((count, len(columns))), np.zeros((count, len(columns)))
    done: list[Wheels] = []
    contacts: list[TangentialSolution] = []
    for trial in range(_MOST_TRIALS):
        speed, load = speed_and_load(task, chunk, unknown)
        speed = speed if given is None else given
        if trial == 0:
            wheels = solved_wheels(task, chunk, sides, load, here, start=rough)
        here &= open_rows[:, None]
        again = here & ~may_be_stretched(wheels, loads_of(wheels, count), load)
        if hasty and trial > 0:
            sure = open_rows & ~again.any(axis=1) & promising(before, columns)
            if sure.any():
                mask = sure[wheels.normal.patch.row]
                done.append(stretched(patches_where(wheels, mask), load))
                open_rows &= ~sure
                if not open_rows.any():
                    break
                wheels = patches_where(wheels, ~mask)
        if 0 < trial <= _FROZEN and again.any():
            old = wheels
            wheels = _renewed(task, chunk, sides, wheels, load, again)
            contact = _matched(contact, old, wheels)
        similar = stretched(wheels, load)
        looser = _LOOSER[trial] if early and columns and trial < len(_LOOSER) else 1.0
        options = {"start": contact, "looser": looser} if model.warm else {}
        forces = forces_of(task, similar, speed, model, fields=model.warm, **options)
        contact = forces.contact if model.warm else None
        residual = residuals(task, chunk, forces, columns)
        missed = out_of_balance(residual, columns, model, at_jump=trial >= _AT_JUMP)
        settled = open_rows & ~missed & (looser == 1.0)
        settled &= not hasty or trial > _FROZEN  # else one more step costs nothing
        if trial > _FROZEN:
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
            afresh = _slopes(task, chunk, similar, still, model, speed, columns)
            slope = np.where(open_rows[:, None, None], afresh, slope)
        elif trial > 0:
            updated = secant_slope(slope, residual - before, step, columns)
            slope = np.where(open_rows[:, None, None], updated, slope)
        step = newton_step(slope, residual, LARGEST_STEP[columns])
        before = residual
        unknown[:, columns] += np.where(open_rows[:, None], step, 0.0)
    else:
        row = int(np.argmax(open_rows))
        raise NumericalError(
            "wheel load and axle torque are not balanced by contact forces: residuals "
            f"{', '.join(f'{value:.1e}' for value in residual[row])} after {_MOST_TRIALS} trials; smooth "
            "measured profiles, or lower friction, yaw or shift",
            row=row,
            rows=np.flatnonzero(open_rows).tolist(),
        )
    return done, contacts, speed, load, slope


def may_be_stretched(wheels: Wheels, solved: FloatArray, load: FloatArray) -> NDArray[np.bool_]:
    """Whether patches of wheels that were solved for loads (n, 2) may be stretched to others."""
    several = np.bincount(wheels.place, minlength=load.size).reshape(-1, 2) > 1
    most = np.where(several, _SEVERAL * SIMILAR, SIMILAR)
    return np.asarray(np.abs(np.log(load / solved)) <= most)


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
