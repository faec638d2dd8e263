r"""Where wheelsets run under forces: shift, yaw, roll, wheel loads and rotation in one search.

Unknowns of a wheelset are those of `axle` (rotation speed, loads L of both wheels, roll) and, where forces
guide it, lateral shift and yaw. The residuals are torque, wheel loads against those that balance the roll,
difference of heights, and

.. math:: H_c + H = 0, \qquad M_c + M = 0

with the resultants :math:`H_c, M_c` of the contact and the forces of `Guidance`, which couple both axles of a
bogie. A wheelset on rollers that is held by an actuator, and the axles of a vehicle, are solved alike.

The search is Newton's method in pseudo-time [1]_: a wheelset that slides along its own creep forces,

.. math:: C_y \dot y = H_c + H, \quad C_\psi \dot\psi = M_c + M, \quad C_\omega \dot\omega = T_c - T,

moves as it does on the way to its stable equilibrium, and implicit Euler steps of a growing length become
Newton's. All other equations have no inertia. The length grows as long as the linear equations foretell
the residuals, shrinks otherwise, and is limited so that no step is longer than `_LONGEST`, which keeps the
search from circling where a second contact closes. Slopes are differences, improved by Broyden's rule while
each step halves the residual.

References
----------
.. [1] C. T. Kelley, D. E. Keyes, SIAM Journal on Numerical Analysis 35 (1998) 508-523.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.axle import LEFT, RIGHT, ROLL, ROLL_UNIT, SPEED, SPEED_UNIT
from wearsim.contact.guided_wheelsets import (
    DIFFERENCES,
    DISPLACEMENT,
    LATERAL,
    ROLL_MOMENT,
    SHIFT,
    SHIFT_UNIT,
    TORQUE,
    UNKNOWNS,
    VERTICAL,
    YAW,
    YAW_MOMENT,
    YAW_UNIT,
    Contact,
    Wheelsets,
)
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.wheels import Wheels, by_point, patches_where

ACCEPTED = 1e-4
"""Largest residual of a balance, over the axle load: of forces, moments at 1 m, and the torque at the wheel's
radius, or what its creep forces jump by if that is more."""
AT_JUMP = 5e-3
"""The same where the contact forces of a model jump, of one or both sides together."""
_LONGEST = np.array([2.0, 0.3, 0.3, 5.0, 5.0, 10.0])  # steps of unknowns: 0.5 mm, 1 mrad

# Creep coefficients of a wheelset: in pseudo-time, a distance, it moves by the force missing over them.
_SLIDING, _TURNING = 16e6, 9e6  # [N, N m]
_FIRST_LENGTH, _LONGEST_LENGTH = 5.0, 1e6  # of a step in pseudo-time [m]
_MOVING = SPEED, SHIFT, YAW  # unknowns with inertia in pseudo-time
_SHORTENED = 12  # times at most, so that no step is too long
_FORETOLD = np.array([0.25, 0.5, 0.8])  # error of the linear equations over the residual
_FACTOR = np.array([4.0, 2.0, 1.0, 0.25])  # of the length after it
_WITHOUT_CONTACT = 0.1  # factor of the length where a wheel has none
_MOST_STEPS, _GROWING = 120, 80  # steps, and those after which lengths do not grow: some circle a jump
# Steps of shift and yaw in their units: those that are taken even if residuals rise, as wheelsets pass jumps
# of the contact on their way, and between both sides of one; steps of all unknowns that end a search at one.
_SHORT, _BRACKET, _SMALLEST = 0.1, 1e-2, 1e-4
_KEPT = 0.5  # ratio of residuals up to which slopes are kept
LEAST_LOAD = 0.02  # of a wheel, over the axle load: with less it is unloaded
_NO_LOAD = 1e-6  # vertical force over the axle load that stands for none


@dataclass(frozen=True)
class Guided:
    """Wheelsets at the end of a search.

    Parameters
    ----------
    unknown : (n, 6) array
        Rotation speed, loads, roll, shift and yaw in their units.
    slope : (n, 6, 6) array
        Of the residuals of the contact.
    missing : (n,) array
        Largest residual over its tolerance, infinite without contact or with a wheel without load.
    load : (n, 2) array
        Vertical forces of both wheels that balance the roll [N].
    stiffness : (n,) array
        Change of the lateral force that guides the wheelset with its shift, all else but the yaw in balance,
        by the slopes at the end of the search, which are estimates [N/m].
    at_jump : (n,) bool array
        Whether the search ended where the contact forces of a model jump.
    share : (n,) array
        Of the distance that a wheelset runs on the other side of a jump of the contact, where the forces of
        both sides balance it together; NaN elsewhere [-].
    other_shift, other_load : (n,), (n, 2) array
        Shift [m] and wheel loads [N] there.
    """

    unknown: FloatArray
    slope: FloatArray
    missing: FloatArray
    load: FloatArray
    stiffness: FloatArray
    at_jump: NDArray[np.bool_]
    share: FloatArray
    other_shift: FloatArray
    other_load: FloatArray

    def at(self, index: IntArray) -> Guided:
        """Return the wheelsets at `index`."""
        return Guided(*(values[index] for values in vars(self).values()))

    def replaced(self, index: IntArray, other: Guided) -> Guided:
        """Return all wheelsets, those at `index` (k,) from another one of k."""
        whole = {name: values.copy() for name, values in vars(self).items()}
        for name, values in whole.items():
            values[index] = getattr(other, name)
        return Guided(**whole)

    @property
    def nearby(self) -> FloatArray:
        """Equilibria (n, 20) at the shifts, yaws and wheel loads found, for `ContactConditions`."""
        unknown = self.unknown[:, :SHIFT].copy()
        unknown[:, RIGHT:ROLL] += np.log(self.load.mean(axis=1, keepdims=True) / self.load)
        slope = self.slope[:, :SHIFT, :SHIFT].reshape(-1, SHIFT * SHIFT)
        return np.concatenate([unknown, slope], axis=1)

    @property
    def shift(self) -> FloatArray:
        """Lateral shift (n,) at the depth of the conditions [m]."""
        return SHIFT_UNIT * self.unknown[:, SHIFT]

    @property
    def yaw(self) -> FloatArray:
        """Yaw (n,) [rad]."""
        return YAW_UNIT * self.unknown[:, YAW]

    @property
    def roll(self) -> FloatArray:
        """Roll (n,) [rad]."""
        return ROLL_UNIT * self.unknown[:, ROLL]


def none_guided(count: int) -> Guided:
    """Return what stands for wheelsets that were not searched for: NaN."""
    nothing = np.full(count, np.nan)
    return Guided(
        unknown=np.full((count, UNKNOWNS), np.nan),
        slope=np.full((count, UNKNOWNS, UNKNOWNS), np.nan),
        missing=nothing,
        load=np.full((count, 2), np.nan),
        stiffness=nothing,
        at_jump=np.zeros(count, dtype=bool),
        share=nothing,
        other_shift=nothing,
        other_load=np.full((count, 2), np.nan),
    )


@dataclass(frozen=True)
class _Trial:
    """Wheelsets in a state."""

    unknown: FloatArray  # (n, 6)
    contact: Contact
    of_contact: FloatArray  # (n, 6) residuals without the forces that guide
    residual: FloatArray  # (n, 6), 0 of unknowns that are given
    missing: FloatArray  # (n,) the largest of a wheelset and its partner over the tolerance
    solved: NDArray[np.bool_]  # (n,) whether both have contact

    def merged(self, other: _Trial, taken: NDArray[np.bool_]) -> _Trial:
        """Return this state with the wheelsets `taken` (n,) of another one."""
        if taken.all():
            return other
        if not taken.any():
            return self
        return _Trial(
            np.where(taken[:, None], other.unknown, self.unknown),
            _merged(self.contact, other.contact, taken),
            np.where(taken[:, None], other.of_contact, self.of_contact),
            np.where(taken[:, None], other.residual, self.residual),
            np.where(taken, other.missing, self.missing),
            np.where(taken, other.solved, self.solved),
        )


def _merged(old: Contact, new: Contact, taken: NDArray[np.bool_]) -> Contact:
    """Contact of which wheelsets `taken` (n,) are those of a new one."""
    parts = [
        patches_where(one.wheels, mask[one.wheels.normal.patch.row])
        for one, mask in ((old, ~taken), (new, taken))
        if one.wheels is not None
    ]
    parts = [part for part in parts if part.place.size]
    return Contact(
        by_point(parts)[0] if parts else None,
        np.where(taken[:, None, None], new.forces, old.forces),
        np.where(taken, new.solved, old.solved),
    )


def balanced(
    problem: Wheelsets,
    unknown: FloatArray,
    tolerance: float,
    slope: FloatArray | None = None,
    *,
    near: bool = False,
) -> Guided:
    """Let wheelsets move to where the forces on them are in balance.

    Parameters
    ----------
    problem : Wheelsets
        n wheelsets and the forces on them.
    unknown : (n, 6) array
        To begin with.
    tolerance : float
        Of forces and moments (at 1 m) over the axle load, and of wheel loads over themselves.
    slope : (n, 6, 6) array, optional
        Of a state nearby; by default differences.
    near : bool
        Whether they begin so near to the balance that the first step can be one of Newton's.

    Returns
    -------
    Guided
        The states with the smallest residuals met.
    """
    count = len(unknown)
    tolerances = problem.tolerances(tolerance)
    length = np.full(count, _LONGEST_LENGTH if near else _FIRST_LENGTH)
    stuck = np.zeros(count, dtype=bool)
    now = best = _tried(problem, unknown, np.ones(count, dtype=bool), None, tolerances)
    sides = now, now  # both ends of the last step that was not foretold
    known = now.solved
    slopes = np.zeros((count, UNKNOWNS, UNKNOWNS)) if slope is None else slope.copy()
    if slope is None and known.any():
        slopes = _slopes(problem, now, known)
    partner = problem.guidance.partner
    for number in range(_MOST_STEPS):
        open_rows = (best.missing > 1.0) & now.solved & ~stuck
        if not open_rows.any():
            break
        asked = open_rows & ~known
        if asked.any():
            slopes[asked] = _slopes(problem, now, asked)[asked]
        step, length = _limited_step(problem, slopes, now.residual, length, open_rows)
        ahead = _tried(problem, now.unknown + step, open_rows, now.contact.wheels, tolerances)
        error = _error_of_foretold(problem, now, ahead, slopes, tolerances)
        solved = open_rows & ahead.solved
        short = _no_longer(step, _SHORT, partner)
        taken = solved & (short | (error < 1.0) | (ahead.missing < now.missing))
        slopes = _secant(slopes, ahead.of_contact - now.of_contact, step, solved)
        known = np.where(open_rows, solved & (ahead.missing < _KEPT * now.missing), known)
        factor = np.where(ahead.solved, _FACTOR[np.searchsorted(_FORETOLD, error)], _WITHOUT_CONTACT)
        growth = factor if number < _GROWING else np.minimum(factor, 1.0)
        length = np.where(open_rows, np.minimum(growth * length, _LONGEST_LENGTH), length)
        tiny = np.asarray((np.abs(step) <= _SMALLEST).all(axis=1))
        stuck |= open_rows & (factor < 1.0) & tiny & tiny[partner]
        best = best.merged(ahead, solved & (ahead.missing < best.missing))
        across = solved & (factor < 1.0)
        sides = sides[0].merged(now, across), sides[1].merged(ahead, across)
        now = now.merged(ahead, taken)
    return _ended(problem, best, now, sides, slopes, tolerances)


def _largest(share: FloatArray, partner: IntArray) -> FloatArray:
    """Largest of shares (n, 6) of a wheelset and its partner (n,)."""
    own = np.abs(share).max(axis=1, initial=0.0)
    return np.maximum(own, own[partner])


def _tried(
    problem: Wheelsets,
    unknown: FloatArray,
    rows: NDArray[np.bool_],
    start: Wheels | None,
    tolerances: FloatArray,
) -> _Trial:
    """Solve the contact of wheelsets `rows` (n,) in a state; the others have no residuals."""
    guidance = problem.guidance
    contact = problem.contact(unknown, rows, start)
    of_contact = _residuals(problem, contact.forces)
    residual = of_contact.copy()
    residual[:, SHIFT:] += guidance.forces(problem.position(unknown)) / guidance.axle_load[:, None]
    residual[~problem.wanted] = 0.0
    solved = contact.solved & contact.solved[guidance.partner]
    missing = np.where(solved, _largest(residual / tolerances, guidance.partner), np.inf)
    return _Trial(unknown, contact, of_contact, residual, missing, solved)


def _residuals(problem: Wheelsets, forces: FloatArray) -> FloatArray:
    """Residuals (n, 6) of the forces (n, 2, 6) of the contact, without those that guide."""
    guidance, chunk, wheelset = problem.guidance, problem.chunk, problem.task.wheelset
    weight = guidance.axle_load[:, None]
    wanted = guidance.wheel_loads(forces[:, :, VERTICAL], forces[:, :, ROLL_MOMENT])
    wanted = np.maximum(wanted, LEAST_LOAD * weight)
    carried = np.maximum(forces[:, :, VERTICAL], _NO_LOAD * weight)
    residual = np.zeros((len(forces), UNKNOWNS))
    torque = forces[:, :, TORQUE].sum(axis=1) - chunk.torque
    residual[:, SPEED] = torque / (chunk.traction_scale * wheelset.radius)
    residual[:, RIGHT:ROLL] = np.log(carried / wanted)
    apart = forces[:, 0, DISPLACEMENT] - forces[:, 1, DISPLACEMENT]
    residual[:, ROLL] = apart / (2.0 * wheelset.half_span * ROLL_UNIT)
    of_both = forces[:, :, [LATERAL, YAW_MOMENT]].sum(axis=1)
    residual[:, SHIFT:] = of_both / weight
    return residual


def _slopes(problem: Wheelsets, now: _Trial, rows: NDArray[np.bool_]) -> FloatArray:
    """Differences (n, 6, 6) of the residuals of the contact of `rows` (n,) over those of the unknowns."""
    slopes = np.zeros((len(rows), UNKNOWNS, UNKNOWNS))
    for column, there in enumerate(problem.by_unknown(now.unknown, now.contact, rows)):
        change = (_residuals(problem, there.forces) - now.of_contact) / DIFFERENCES[column]
        slopes[there.solved, :, column] = change[there.solved]
    return slopes


def _secant(slopes: FloatArray, change: FloatArray, step: FloatArray, rows: NDArray[np.bool_]) -> FloatArray:
    """Slopes (n, 6, 6) of `rows` (n,) after a step (n, 6) that changed residuals by (n, 6): Broyden's."""
    missed = change - (slopes @ step[:, :, None])[:, :, 0]
    square = (step**2).sum(axis=1)
    seen = rows & (square > 0.0)
    improved = slopes + missed[:, :, None] * step[:, None] / np.where(seen, square, 1.0)[:, None, None]
    return np.where(seen[:, None, None], improved, slopes)


def _inertia(problem: Wheelsets, length: FloatArray) -> FloatArray:
    """Change (n, 6) of residuals by unknowns that move in pseudo-time, in steps of lengths (n,) [m]."""
    weight = problem.guidance.axle_load
    inertia = np.zeros((length.size, UNKNOWNS))
    inertia[:, SPEED] = -_SLIDING * SPEED_UNIT / problem.chunk.traction_scale
    inertia[:, SHIFT] = _SLIDING * SHIFT_UNIT / weight
    inertia[:, YAW] = _TURNING * YAW_UNIT / weight
    inertia /= length[:, None]
    return inertia


def _limited_step(
    problem: Wheelsets, slopes: FloatArray, residual: FloatArray, length: FloatArray, rows: NDArray[np.bool_]
) -> tuple[FloatArray, FloatArray]:
    """Step (n, 6) of `rows` (n,), and lengths (n,) with which what has inertia does not go too far."""
    partner = problem.guidance.partner
    step = np.zeros_like(residual)
    moving = np.isin(np.arange(UNKNOWNS), _MOVING)
    todo = rows
    for _ in range(_SHORTENED):
        step[todo] = _newton_step(problem, slopes, residual, length, todo)
        longest = _largest(np.where(moving, step / _LONGEST, 0.0), partner)
        todo = rows & (longest > 1.0)
        if not todo.any():
            break
        length = np.where(todo, length / np.clip(longest, 1.5, 10.0), length)
    longest = _largest(step / _LONGEST, partner)
    return step / np.maximum(longest, 1.0)[:, None], length


def _newton_step(
    problem: Wheelsets,
    slopes: FloatArray,
    residual: FloatArray,
    length: FloatArray,
    rows: NDArray[np.bool_],
) -> FloatArray:
    """Step (k, 6) of each of `rows` (n,) together with its partner."""
    guidance, wanted = problem.guidance, problem.wanted
    partner, count = guidance.partner, len(residual)
    own = slopes.copy()
    each = np.arange(UNKNOWNS)
    own[:, each, each] -= _inertia(problem, length)
    by_own, by_partner = _guidance_slopes(problem)
    own[:, SHIFT:] += by_own
    own[~wanted] = 0.0
    own = np.where(wanted[:, None], own, 0.0)
    own[:, each, each] = np.where(wanted, own[:, each, each], 1.0)
    across = np.zeros_like(own)
    coupled = partner != np.arange(count)
    across[coupled, SHIFT:] = by_partner[coupled]
    across[~wanted] = 0.0
    across = np.where(wanted[partner][:, None], across, 0.0)
    whole = np.block([[own, across], [across[partner], own[partner]]])[rows]
    sides = np.concatenate([residual, residual[partner]], axis=1)[rows]
    try:
        step = np.linalg.solve(whole, -sides[:, :, None])[:, :, 0]
    except np.linalg.LinAlgError:  # of a wheel without any load
        step = -(np.linalg.pinv(whole) @ sides[:, :, None])[:, :, 0]
    return step[:, :UNKNOWNS]


def _guidance_slopes(problem: Wheelsets) -> tuple[FloatArray, FloatArray]:
    """Slopes (n, 2, 6) of the forces that guide, over the axle load, by own unknowns and the partner's."""
    guidance, chunk = problem.guidance, problem.chunk
    position = np.zeros((chunk.shift.size, 2, UNKNOWNS))  # of lateral position and yaw by the unknowns
    position[:, 0, SHIFT] = SHIFT_UNIT
    if chunk.shift_depth is not None:
        position[:, 0, ROLL] = chunk.shift_depth * ROLL_UNIT
    position[:, 1, YAW] = YAW_UNIT
    weight = guidance.axle_load[:, None, None]
    own = guidance.slope[:, :, :2] @ position / weight
    other = guidance.slope[:, :, 2:] @ position[guidance.partner] / weight
    return own, other


def _error_of_foretold(
    problem: Wheelsets, now: _Trial, ahead: _Trial, slopes: FloatArray, tolerances: FloatArray
) -> FloatArray:
    """Error (n,) of the residuals that the linear equations foretell, over what they were or should be."""
    guidance = problem.guidance
    step = ahead.unknown - now.unknown
    foretold = now.residual + (slopes @ step[:, :, None])[:, :, 0]
    moved = guidance.forces(problem.position(ahead.unknown)) - guidance.forces(problem.position(now.unknown))
    foretold[:, SHIFT:] += moved / guidance.axle_load[:, None]
    foretold[~problem.wanted] = 0.0
    error = _largest((ahead.residual - foretold) / tolerances, guidance.partner)
    scale = np.maximum(now.missing, _largest(foretold / tolerances, guidance.partner))
    return np.where(ahead.solved, error / np.maximum(scale, 1e-300), np.inf)


def _no_longer(step: FloatArray, longest: float, partner: IntArray) -> NDArray[np.bool_]:
    """Whether steps (n, 6) of a wheelset and its partner are no longer than this in shift and yaw."""
    short = np.asarray((np.abs(step[:, SHIFT:]) <= longest).all(axis=1))
    return np.asarray(short & short[partner])


def _ended(
    problem: Wheelsets,
    best: _Trial,
    now: _Trial,
    sides: tuple[_Trial, _Trial],
    slopes: FloatArray,
    tolerances: FloatArray,
) -> Guided:
    """End of a search: the best state, or both sides of a jump of the contact where it ended at one."""
    guidance = problem.guidance
    # a torque at a jump of the creep forces is as near to balance as it can be
    tolerances = tolerances.copy()
    accepted = problem.jump * tolerances[:, SHIFT] / ACCEPTED
    tolerances[:, SPEED] = np.maximum(tolerances[:, SPEED], accepted)
    missing = np.where(best.solved, _largest(best.residual / tolerances, guidance.partner), np.inf)
    one, other = sides
    share = _share_of_other(problem, one, other)
    both = one.residual + share[:, None] * (other.residual - one.residual)
    together = _largest(both / tolerances, guidance.partner)
    at_jump = problem.may_jump & (missing > ACCEPTED / tolerances[:, SHIFT]) & other.solved
    at_jump &= (other.unknown != one.unknown).any(axis=1)
    for side in sides:  # where the search ended
        at_jump &= _no_longer(side.unknown - now.unknown, _BRACKET, guidance.partner)
    two = at_jump & (together < missing)
    main = best.merged(one, two)
    load, other_load = (
        guidance.wheel_loads(*np.moveaxis(side.contact.forces[:, :, [VERTICAL, ROLL_MOMENT]], 2, 0))
        for side in (main, other)
    )
    missing = np.where(two, together, missing)
    unloaded = np.asarray((load < LEAST_LOAD * guidance.axle_load[:, None]).any(axis=1))
    return Guided(
        unknown=main.unknown,
        slope=slopes,
        missing=np.where(unloaded | unloaded[guidance.partner], np.inf, missing),
        load=load,
        stiffness=_stiffness(problem, slopes),
        at_jump=at_jump,
        share=np.where(two, share, np.nan),
        other_shift=SHIFT_UNIT * other.unknown[:, SHIFT],
        other_load=other_load,
    )


def _share_of_other(problem: Wheelsets, one: _Trial, other: _Trial) -> FloatArray:
    """Share (n,) of the second state with which least is missing, on a wheelset and its partner."""
    partner = problem.guidance.partner
    change = other.residual - one.residual
    along = (one.residual * change).sum(axis=1)
    square = (change**2).sum(axis=1)
    along, square = along + along[partner], square + square[partner]
    share: FloatArray = np.clip(-along / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    return share


def _stiffness(problem: Wheelsets, slopes: FloatArray) -> FloatArray:
    """Change (n,) of the lateral force with the shift, all but the yaw in balance; 0: given [N/m]."""
    rest = np.array([SPEED, RIGHT, LEFT, ROLL])
    wanted = problem.wanted
    inner = slopes[:, rest[:, None], rest]
    either = wanted[:, rest, None] & wanted[:, None, rest]
    inner = np.where(either, inner, np.eye(rest.size))
    by_shift = np.where(wanted[:, rest], slopes[:, rest, SHIFT], 0.0)
    moved = (np.linalg.pinv(inner) @ by_shift[:, :, None])[:, :, 0]
    change = slopes[:, SHIFT, SHIFT] - (slopes[:, SHIFT, rest] * moved).sum(axis=1)
    stiffness: FloatArray = -change * problem.guidance.axle_load / SHIFT_UNIT
    return np.where(wanted[:, SHIFT], stiffness, 0.0)
