r"""Equilibrium of wheelsets: shift, yaw, roll, wheel loads and rotation in one search.

Unknowns and residuals are those of `axle`. Where shift and yaw are not given, they
follow from

.. math:: H_c + H = 0, \qquad M_c + M = 0

with the resultants :math:`H_c, M_c` of the contact and the forces of `Guidance`, which
couple both axles of a bogie. A wheelset whose place is given, one on rollers that is
held by an actuator, and the axles of a vehicle are solved alike.

The search is Newton's method in pseudo-time [1]_: a wheelset that slides along its own
creep forces,

.. math:: C_y \dot y = H_c + H, \quad C_\psi \dot\psi = M_c + M, \quad C_\omega \dot\omega = T_c - T,

moves as it does on the way to its stable equilibrium, and implicit Euler steps of a
growing length become Newton's. All other equations have no inertia. The length grows as
long as the linear equations foretell the residuals, shrinks otherwise, and is limited
so that no step is longer than `_LONGEST`, which keeps the search from circling where a
second contact closes; steps of loads and roll, which have no inertia, are shortened.
Slopes are differences, improved by Broyden's rule [2]_ with their zeros kept [3]_ while
each step halves the residual.

References
----------
.. [1] C. T. Kelley, D. E. Keyes, SIAM Journal on Numerical Analysis 35 (1998) 508-523.
.. [2] C. G. Broyden, Mathematics of Computation 19 (1965) 577-593.
.. [3] L. K. Schubert, Mathematics of Computation 24 (1970) 27-30.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.axle import (
    LEAST_LOAD,
    LEFT,
    RIGHT,
    ROLL,
    ROLL_UNIT,
    SHIFT,
    SHIFT_UNIT,
    SPEED,
    SPEED_UNIT,
    UNKNOWNS,
    YAW,
    YAW_UNIT,
    Contact,
    Wheelsets,
)
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import PLACED
from wearsim.contact.tangential import (
    TANGENTIAL_MODELS,
    TangentialModel,
    TangentialSolution,
)
from wearsim.contact.wheels import (
    Wheels,
    by_point,
    contact_joined,
    contact_where,
    patches_where,
    planes_of,
    stretched,
)
from wearsim.errors import ContactError, NumericalError

ACCEPTED = 1e-4
"""Largest residual of a balance, over the axle load: of forces, moments at 1 m, and the
torque at the wheel's radius, or what its creep forces jump by if that is more.
"""
AT_JUMP = 5e-3
"""The same where the contact forces of a model jump, of one or both sides together."""
_LONGEST = np.array(
    [2.0, 0.3, 0.3, 5.0, 5.0, 10.0]
)  # steps of unknowns: 0.5 mm, 1 mrad
TOLERANCE = 1e-6
"""Of a wheelset whose place is given: vertical forces over the wheel load; torque over
friction coefficient x load x radius, or the tolerance of the tangential model if it is
larger.
"""

# Creep coefficients of a wheelset: in pseudo-time, a distance, it moves by the force
# missing over them.
_SLIDING, _TURNING = 16e6, 9e6  # [N, N m]
_FIRST_LENGTH, _LONGEST_LENGTH = 5.0, 1e6  # of a step in pseudo-time [m]
_MOVING = SPEED, SHIFT, YAW  # unknowns with inertia in pseudo-time
_SHORTENED = 12  # times at most, so that no step is too long
_FORETOLD = np.array(
    [0.25, 0.5, 0.8]
)  # error of the linear equations over the residual
_FACTOR = np.array([4.0, 2.0, 1.0, 0.25])  # of the length after it
_WITHOUT_CONTACT = 0.1  # factor of the length where a wheel has none
_MOST_STEPS, _GROWING = (
    120,
    80,
)  # steps, and those after which lengths do not grow: some circle a jump
_MOST_OF_PLACED = 20  # steps of wheelsets whose place is given
_AFRESH = 6  # steps of these from one set of differences to the next
# Steps of shift and yaw in their units: those that are taken even if residuals rise, as
# wheelsets pass jumps of the contact on their way, and between both sides of one; steps
# of all unknowns that end a search at one.
_SHORT, _BRACKET, _SMALLEST = 0.1, 1e-2, 1e-4
_KEPT = 0.5  # ratio of residuals up to which slopes are kept
_HEIGHTS = 0.5  # weight of the residual of the heights among the others

# Last steps of a wheelset whose place is given, in which patches are only stretched:
# residuals from which the first one, which leaves 3 % of them, is mostly enough; the
# most; those after which jumps of the creep forces are taken to be what is left;
# logarithm of the load by which patches may be stretched, as those of a model whose
# load jumps past the balance are; and the residual of the heights that is accepted
# then, 0.15 mm.
_PROMISING = 1.5e-5
_MOST_LAST, _JUMPS_FROM, _LARGEST_JUMP, _AT_REST_THEN = 14, 4, 0.1, 1.0
_STRETCHED = 2e-3  # logarithm of the load beyond which stretched patches say so
_OF_LOAD = 0.3  # creep forces that friction can carry over the load, about
# Residuals by column, as shares of what friction can carry, of the wheel loads, and of
# a unit of roll.
_MISSED = "torque", "right load", "left load", "roll"


@dataclass(frozen=True)
class Equilibria:
    """Where searches of n wheelsets can begin; NaN of those of which nothing is known.

    Parameters
    ----------
    unknown : (n, 6) array
        Rotation speed, loads, roll, shift and yaw in their units; the last two are NaN
        where they are given.
    slope : (n, 6, 6) array
        Of the residuals of the contact.
    """

    unknown: FloatArray
    slope: FloatArray

    @classmethod
    def of_placed(cls, nearby: FloatArray) -> Equilibria:
        """Return those (n,) of wheelsets in a given place.

        `nearby` (n, 20) holds the numbers of their contact.
        """
        count = len(nearby)
        unknown = np.full((count, UNKNOWNS), np.nan)
        slope = np.full((count, UNKNOWNS, UNKNOWNS), np.nan)
        unknown[:, :PLACED] = nearby[:, :PLACED]
        slope[:, :PLACED, :PLACED] = nearby[:, PLACED:].reshape(-1, PLACED, PLACED)
        return cls(unknown, slope)

    @property
    def placed(self) -> FloatArray:
        """Equilibria (n, 20) in given places, for `ContactConditions`.

        Shifts, yaws and wheel loads are given.
        """
        of_placed = self.slope[:, :PLACED, :PLACED].reshape(-1, PLACED * PLACED)
        return np.concatenate([self.unknown[:, :PLACED], of_placed], axis=1)

    @property
    def of_guided(self) -> NDArray[np.bool_]:
        """Which wheelsets (n,) have a shift and a yaw to begin with."""
        return np.asarray(np.isfinite(self.unknown).all(axis=1))

    def at(self, index: IntArray) -> Equilibria:
        """Return the wheelsets at `index`."""
        return Equilibria(self.unknown[index], self.slope[index])

    def where(self, taken: NDArray[np.bool_], other: Equilibria) -> Equilibria:
        """Return these of wheelsets `taken` (n,), and others of the rest."""
        return Equilibria(
            np.where(taken[:, None], self.unknown, other.unknown),
            np.where(taken[:, None, None], self.slope, other.slope),
        )


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
        Largest residual over its tolerance, infinite without contact or with a wheel
        without load.
    stiffness : (n,) array
        Change of the lateral force that guides the wheelset with its shift, all else
        but the yaw in balance, by the slopes at the end of the search, which are
        estimates [N/m].
    at_jump : (n,) bool array
        Whether the search ended where the contact forces of a model jump.
    share : (n,) array
        Of the distance that a wheelset runs on the other side of a jump of the contact,
        where the forces of both sides balance it together; NaN elsewhere [-].
    other_shift : (n,) array
        Shift there [m].
    """

    unknown: FloatArray
    slope: FloatArray
    missing: FloatArray
    stiffness: FloatArray
    at_jump: NDArray[np.bool_]
    share: FloatArray
    other_shift: FloatArray

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
    def equilibria(self) -> Equilibria:
        """Where the next search can begin."""
        return Equilibria(self.unknown, self.slope)

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
        stiffness=nothing,
        at_jump=np.zeros(count, dtype=bool),
        share=nothing,
        other_shift=nothing,
    )


@dataclass(frozen=True)
class _Trial:
    """Wheelsets in a state."""

    unknown: FloatArray  # (n, 6)
    contact: Contact
    of_contact: FloatArray  # (n, 6) residuals without the forces that guide
    residual: FloatArray  # (n, 6), 0 of unknowns that are given
    missing: (
        FloatArray  # (n,) the largest of a wheelset and its partner over the tolerance
    )
    solved: NDArray[np.bool_]  # (n,) whether both have contact

    def merged(self, other: _Trial, taken: NDArray[np.bool_]) -> _Trial:
        """Return this state with the wheelsets `taken` (n,) of another one."""
        if taken.all():
            return other
        if not taken.any():
            return self
        return _Trial(
            np.where(taken[:, None], other.unknown, self.unknown),
            self.contact.merged(other.contact, taken),
            np.where(taken[:, None], other.of_contact, self.of_contact),
            np.where(taken[:, None], other.residual, self.residual),
            np.where(taken, other.missing, self.missing),
            np.where(taken, other.solved, self.solved),
        )


@dataclass(frozen=True)
class Settled:
    """Wheelsets in equilibrium whose place is given.

    Parameters
    ----------
    wheels : Wheels
        Patches, ordered by point, side and falling normal force.
    contact : TangentialSolution
        Their creep forces, with the fields of cells that the task wants.
    unknown : (n, 6) array
        Rotation speed, loads, roll, shift and yaw in their units.
    slopes : (n, 6, 6) array
        Of the residuals.
    """

    wheels: Wheels
    contact: TangentialSolution
    unknown: FloatArray
    slopes: FloatArray


@dataclass(frozen=True)
class _Search:
    """End of a search.

    Best and last states, ends of the last step across a jump, if any, and slopes.
    """

    best: _Trial
    now: _Trial
    ends: tuple[_Trial, _Trial]
    slopes: FloatArray


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
        Of forces and moments (at 1 m) over the axle load, and of wheel loads over
        themselves.
    slope : (n, 6, 6) array, optional
        Of a state nearby; by default differences.
    near : bool
        Whether they begin so near to the balance that the first step can be one of
        Newton's.

    Returns
    -------
    Guided
        The states with the smallest residuals met.
    """
    tolerances = _tolerances(problem, tolerance)
    search = _searched(problem, unknown, tolerances, slope, None, near=near)
    return _ended(problem, search, tolerances)


def settled(
    problem: Wheelsets,
    unknown: FloatArray,
    slope: FloatArray,
    contact: Contact | None = None,
) -> Settled:
    """Balance torque, loads and heights of wheelsets whose place is given.

    Parameters
    ----------
    problem : Wheelsets
        n wheelsets.
    unknown : (n, 6) array
        To begin with.
    slope : (n, 6, 6) array
        Of the residuals there.
    contact : Contact, optional
        Nearby; its gaps are kept where the pose is the same.

    Raises
    ------
    ContactError
        If a wheel has no contact, or its flange locks: at a contact angle whose tangent
        times the friction coefficient reaches 1 creep forces lift the wheel whatever
        the normal force.
    NumericalError
        If the iteration does not converge.

    Notes
    -----
    A point does not depend on the others but for the last bits of sums over padding,
    nor a wheel on the other one if speed and roll are given.
    """
    tolerances = np.full((problem.count, UNKNOWNS), _PROMISING)
    tolerances[:, SPEED] = max(_PROMISING, _tangential(problem).tolerance)
    tolerances[:, ROLL] = problem.resting
    search = _searched(problem, unknown, tolerances, slope, contact, near=True)
    end = search.best
    lost = ~end.solved | ((end.missing > 1.0) & ~search.now.solved)
    if lost.any():
        raise search.now.contact.faults[int(np.argmax(lost))]
    return _with_last_steps(problem, end, search.slopes)


def placed_step(
    problem: Wheelsets, slopes: FloatArray, residual: FloatArray
) -> FloatArray:
    """Newton's step (n, 6) of wheelsets that stay, shortened to a longest.

    Parameters
    ----------
    problem : Wheelsets
        n wheelsets.
    slopes : (n, 6, 6) array
        Of the residuals.
    residual : (n, 6) array
        Of the contact.
    """
    columns = problem.wanted.copy()
    columns[:, SHIFT:] = False
    every, endless = np.ones(problem.count, dtype=bool), np.full(problem.count, np.inf)
    return _shortened(_newton_step(problem, slopes, residual, endless, every, columns))


def _tolerances(problem: Wheelsets, tolerance: float) -> FloatArray:
    """Tolerances (n, 6) of the residuals, with that of forces over the axle load."""
    most = np.full((problem.count, UNKNOWNS), tolerance)
    at_radius = tolerance * problem.guidance.axle_load / problem.chunk.traction_scale
    most[:, SPEED] = np.maximum(at_radius, _tangential(problem).tolerance)
    most[:, ROLL] = max(problem.resting, tolerance / _HEIGHTS)
    return most


def _tangential(problem: Wheelsets) -> TangentialModel:
    """Record of the tangential model."""
    return TANGENTIAL_MODELS[problem.task.models.tangential]


def _searched(
    problem: Wheelsets,
    unknown: FloatArray,
    tolerances: FloatArray,
    slope: FloatArray | None,
    contact: Contact | None,
    *,
    near: bool,
) -> _Search:
    """Search the balance within tolerances (n, 6).

    Other parameters as of `balanced` and `settled`.
    """
    count, placed = problem.count, problem.placed
    most = np.where(placed, _MOST_OF_PLACED, _MOST_STEPS)
    length = np.full(count, _LONGEST_LENGTH if near else _FIRST_LENGTH)
    stuck = np.zeros(count, dtype=bool)
    now = best = _tried(
        problem, unknown, np.ones(count, dtype=bool), contact, tolerances
    )
    ends = now, now
    slopes = np.full((count, UNKNOWNS, UNKNOWNS), np.nan) if slope is None else slope
    known = now.solved & np.isfinite(slopes).all(axis=(1, 2))
    slopes = np.where(known[:, None, None], slopes, 0.0)
    partner = problem.guidance.partner
    for number in range(_MOST_STEPS):
        open_rows = (best.missing > 1.0) & now.solved & ~stuck & (number < most)
        if not open_rows.any():
            break
        # where a load jumps, differences lead to and fro across it, and the secant does
        # not
        asked = open_rows & ~known & (~placed | (number % _AFRESH == 0))
        if asked.any():
            slopes[asked] = problem.slopes(now.unknown, now.contact, asked)[asked]
        step, length = _limited_step(problem, slopes, now.residual, length, open_rows)
        ahead = _tried(problem, now.unknown + step, open_rows, now.contact, tolerances)
        error = _error_of_foretold(problem, now, ahead, slopes, tolerances)
        solved = open_rows & ahead.solved
        short = _no_longer(step, _SHORT, partner)
        lost = open_rows & placed & ~ahead.solved
        taken = lost | (
            solved & (short | (error < 1.0) | (ahead.missing < now.missing))
        )
        slopes = _secant(
            problem, slopes, ahead.of_contact - now.of_contact, step, solved
        )
        known = np.where(
            open_rows, solved & (ahead.missing < _KEPT * now.missing), known
        )
        factor = np.where(
            ahead.solved, _FACTOR[np.searchsorted(_FORETOLD, error)], _WITHOUT_CONTACT
        )
        growth = factor if number < _GROWING else np.minimum(factor, 1.0)
        length = np.where(
            open_rows, np.minimum(growth * length, _LONGEST_LENGTH), length
        )
        tiny = np.asarray((np.abs(step) <= _SMALLEST).all(axis=1))
        stuck |= open_rows & (factor < 1.0) & tiny & tiny[partner]
        best = best.merged(ahead, solved & (ahead.missing < best.missing))
        share = _share_of_other(problem, now, ahead)
        across = solved & (factor < 1.0) & (share > 0.0) & (share < 1.0)
        ends = ends[0].merged(now, across), ends[1].merged(ahead, across)
        now = now.merged(ahead, taken)
    return _Search(best, now, ends, slopes)


def _with_last_steps(problem: Wheelsets, end: _Trial, slopes: FloatArray) -> Settled:
    """Wheelsets near their balance in it.

    By steps of speed and loads in which patches are only stretched.
    """
    model = _tangential(problem)
    columns = problem.wanted.copy()
    columns[:, ROLL] = False
    unknown, residual, slopes = end.unknown, end.residual, slopes.copy()
    done: list[Wheels] = []
    contacts: list[TangentialSolution] = []
    open_rows = np.ones(problem.count, dtype=bool)
    endless = np.full(problem.count, np.inf)
    heavier = _friction_over_loads(problem, end.contact)
    for number in range(_MOST_LAST):
        torque, load = max(model.tolerance, TOLERANCE), TOLERANCE
        if number >= _JUMPS_FROM:
            torque, load = max(model.jump, torque), max(_OF_LOAD * model.jump, load)
        limits = np.tile(
            [torque, load, load, _AT_REST_THEN, np.inf, np.inf], (problem.count, 1)
        )
        limits[:, SPEED] *= heavier
        missed = open_rows & (np.abs(residual) > limits).any(axis=1)
        step = np.zeros_like(unknown)
        if missed.any():
            step[missed] = _newton_step(
                problem, slopes, residual, endless, missed, columns
            )
        step = _shortened(step)
        unknown = unknown + step
        wheels, jump = _stretched_from(problem, end.contact, open_rows, unknown)
        forces, contact = problem.forces(unknown, wheels, fields=True)
        after = np.where(
            problem.wanted & open_rows[:, None], problem.residuals(forces), residual
        )
        balanced_now = (
            open_rows & (np.abs(after) <= limits).all(axis=1) & (jump <= _LARGEST_JUMP)
        )
        if balanced_now.any() or not problem.count:
            mask = balanced_now[wheels.normal.patch.row]
            done.append(patches_where(wheels, mask))
            contacts.append(contact_where(contact, mask))
        light = problem.unloaded(forces) & balanced_now[:, None]
        if light.any():
            raise _unloaded(light)
        open_rows = open_rows & ~balanced_now
        if not open_rows.any():
            break
        slopes = _secant(problem, slopes, after - residual, step, open_rows)
        residual = after
    else:
        raise _unbalanced(problem, end.residual, open_rows)
    whole, order = by_point(done)
    return Settled(whole, contact_joined(contacts, order), unknown, slopes)


def _friction_over_loads(problem: Wheelsets, contact: Contact) -> FloatArray:
    """Return the friction limit (n,) under normal forces over that under wheel loads.

    1 at least.

    Creep forces are as exact as the former, of which a flange may have several times as
    much.
    """
    assert contact.wheels is not None
    wheels = contact.wheels
    carried = (wheels.friction * planes_of(wheels.normal).normal_force).sum(axis=1)
    of_row = np.bincount(wheels.normal.patch.row, carried, problem.count)
    return np.maximum(0.5 * of_row / problem.chunk.traction_scale, 1.0)


def _shortened(step: FloatArray) -> FloatArray:
    """Return steps (n, 6) no longer than the longest one."""
    longest = np.abs(step / _LONGEST).max(axis=1, initial=0.0)
    shortened: FloatArray = step / np.maximum(longest, 1.0)[:, None]
    return shortened


def _stretched_from(
    problem: Wheelsets, contact: Contact, rows: NDArray[np.bool_], unknown: FloatArray
) -> tuple[Wheels, FloatArray]:
    """Patches of wheelsets `rows` (n,) under other loads.

    Also the largest logarithm of what stretches them.

    Where that is more than similar patches allow, their load scale says how far.
    """
    assert contact.wheels is not None
    near = patches_where(contact.wheels, rows[contact.wheels.normal.patch.row])
    wheels = stretched(near, problem.loads(unknown))
    ratio = wheels.load / contact.load.ravel()[wheels.place]
    jump = np.zeros(problem.count)
    np.maximum.at(jump, wheels.normal.patch.row, np.abs(np.log(ratio)))
    scale = np.where(np.abs(np.log(ratio)) > _STRETCHED, ratio, 1.0)
    normal = replace(wheels.normal, load_scale=scale * wheels.normal.load_scale)
    return replace(wheels, normal=normal), jump


def _unloaded(light: NDArray[np.bool_]) -> ContactError:
    """Error of the wheels (n, 2) that the forces on their axle leave without load."""
    row, side = np.argwhere(light)[0].tolist()
    return ContactError(
        f"the forces on the axle leave its {('right', 'left')[side]} wheel less than "
        f"{100.0 * LEAST_LOAD:g} % of the axle load; raise the load, or lower what "
        "tilts the axle",
        row=row,
        side=side,
        rows=np.flatnonzero(light[:, side]).tolist(),
    )


def _unbalanced(
    problem: Wheelsets, residual: FloatArray, open_rows: NDArray[np.bool_]
) -> NumericalError:
    """Error of the points that are not balanced, with the best residuals (n, 6)."""
    row = int(np.argmax(open_rows))
    rows = np.flatnonzero(open_rows).tolist()
    if problem.wanted[row, ROLL] and abs(residual[row, ROLL]) > _AT_REST_THEN:
        reason = (
            "no roll of the wheelset lets normal and creep forces of both wheels "
            "carry their loads; lower friction, yaw or shift, or give the roll"
        )
    else:
        left = ", ".join(
            f"{_MISSED[column]} {residual[row, column]:.1e}"
            for column in np.flatnonzero(problem.wanted[row]).tolist()
        )
        reason = (
            "wheel load and axle torque are not balanced by contact forces: left "
            f"over are {left}; smooth measured profiles, or lower friction, yaw or "
            "shift"
        )
    return NumericalError(reason, row=row, rows=rows)


def _largest(share: FloatArray, partner: IntArray) -> FloatArray:
    """Largest of shares (n, 6) of a wheelset and its partner (n,)."""
    own = np.abs(share).max(axis=1, initial=0.0)
    return np.maximum(own, own[partner])


def _tried(
    problem: Wheelsets,
    unknown: FloatArray,
    rows: NDArray[np.bool_],
    near: Contact | None,
    tolerances: FloatArray,
) -> _Trial:
    """Solve the contact of wheelsets `rows` (n,) in a state.

    The others have no residuals.
    """
    guidance = problem.guidance
    contact = problem.contact(unknown, rows, near)
    of_contact = problem.residuals(contact.forces)
    residual = of_contact.copy()
    residual[:, SHIFT:] += (
        guidance.forces(problem.position(unknown)) / guidance.axle_load[:, None]
    )
    residual[~problem.wanted] = 0.0
    solved = contact.solved & contact.solved[guidance.partner]
    missing = np.where(
        solved, _largest(residual / tolerances, guidance.partner), np.inf
    )
    return _Trial(unknown, contact, of_contact, residual, missing, solved)


def _secant(
    problem: Wheelsets,
    slopes: FloatArray,
    change: FloatArray,
    step: FloatArray,
    rows: NDArray[np.bool_],
) -> FloatArray:
    """Slopes (n, 6, 6) of `rows` (n,) after a step, by Broyden's update.

    The step (n, 6) changed the residuals by (n, 6).
    """
    missed = change - (slopes @ step[:, :, None])[:, :, 0]
    part = np.where(problem.linked, step[:, None], 0.0)
    square = (part**2).sum(axis=2)
    seen = rows[:, None] & (square > 0.0)
    share = np.where(seen, missed / np.where(seen, square, 1.0), 0.0)
    improved: FloatArray = slopes + share[:, :, None] * part
    return improved


def _inertia(problem: Wheelsets, length: FloatArray) -> FloatArray:
    """Change (n, 6) of residuals by unknowns that move in pseudo-time.

    In steps of lengths (n,) [m].
    """
    weight = problem.guidance.axle_load
    inertia = np.zeros((length.size, UNKNOWNS))
    inertia[:, SPEED] = -_SLIDING * SPEED_UNIT / problem.chunk.traction_scale
    inertia[:, SHIFT] = _SLIDING * SHIFT_UNIT / weight
    inertia[:, YAW] = _TURNING * YAW_UNIT / weight
    inertia /= length[:, None]
    return inertia


def _limited_step(
    problem: Wheelsets,
    slopes: FloatArray,
    residual: FloatArray,
    length: FloatArray,
    rows: NDArray[np.bool_],
) -> tuple[FloatArray, FloatArray]:
    """Step (n, 6) of `rows` (n,).

    Also lengths (n,) with which what has inertia does not go too far.
    """
    partner = problem.guidance.partner
    step = np.zeros_like(residual)
    moving = np.isin(np.arange(UNKNOWNS), _MOVING)
    columns = problem.wanted.copy()
    # a wheelset at rest keeps its roll while the others settle, and its patches with it
    columns[:, ROLL] &= ~(
        problem.placed & (np.abs(residual[:, ROLL]) <= problem.resting)
    )
    todo = rows
    for _ in range(_SHORTENED):
        step[todo] = _newton_step(problem, slopes, residual, length, todo, columns)
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
    columns: NDArray[np.bool_],
) -> FloatArray:
    """Step (k, 6) of `rows` (n,) together with its partner, in some columns (n, 6)."""
    guidance = problem.guidance
    partner, each = guidance.partner, np.arange(UNKNOWNS)
    by_own, by_partner = _guidance_slopes(problem)
    own = slopes.copy()
    own[:, each, each] -= _inertia(problem, length)
    own[:, SHIFT:] += by_own
    own = np.where(columns[:, :, None] & columns[:, None], own, 0.0)
    idle = ~own.any(
        axis=1
    )  # unknowns that are given, and those without effect: the speed without friction
    own[:, each, each] = np.where(idle, 1.0, own[:, each, each])
    missing = np.where(columns, residual, 0.0)
    coupled = partner != np.arange(problem.count)
    if not coupled.any():
        return _solved(own[rows], missing[rows])
    across = np.zeros_like(own)
    across[coupled, SHIFT:] = by_partner[coupled]
    across = np.where(columns[:, :, None] & columns[partner][:, None], across, 0.0)
    whole = np.block([[own, across], [across[partner], own[partner]]])[rows]
    both = np.concatenate([missing, missing[partner]], axis=1)[rows]
    return _solved(whole, both)[:, :UNKNOWNS]


def _solved(slopes: FloatArray, residual: FloatArray) -> FloatArray:
    """Newton's steps (k, m) from slopes (k, m, m) and residuals (k, m)."""
    try:
        return -np.asarray(
            np.linalg.solve(slopes, residual[:, :, None]), dtype=np.float64
        )[:, :, 0]
    except np.linalg.LinAlgError:  # of a wheel without any load
        if len(slopes) == 1:
            return -(np.linalg.pinv(slopes) @ residual[:, :, None])[:, :, 0]
    parts = [_solved(slopes[[k]], residual[[k]]) for k in range(len(slopes))]
    return np.concatenate(parts)


def _guidance_slopes(problem: Wheelsets) -> tuple[FloatArray, FloatArray]:
    """Slopes (n, 2, 6) of the forces that guide.

    Over the axle load, by own unknowns and the partner's.
    """
    guidance, chunk = problem.guidance, problem.chunk
    position = np.zeros(
        (chunk.shift.size, 2, UNKNOWNS)
    )  # of lateral position and yaw by the unknowns
    position[:, 0, SHIFT] = SHIFT_UNIT
    if chunk.shift_depth is not None:
        position[:, 0, ROLL] = chunk.shift_depth * ROLL_UNIT
    position[:, 1, YAW] = YAW_UNIT
    weight = guidance.axle_load[:, None, None]
    own = guidance.slope[:, :, :2] @ position / weight
    other = guidance.slope[:, :, 2:] @ position[guidance.partner] / weight
    return own, other


def _error_of_foretold(
    problem: Wheelsets,
    now: _Trial,
    ahead: _Trial,
    slopes: FloatArray,
    tolerances: FloatArray,
) -> FloatArray:
    """Error (n,) of the residuals that the linear equations foretell.

    Over what they were or should be.
    """
    guidance = problem.guidance
    step = ahead.unknown - now.unknown
    foretold = now.residual + (slopes @ step[:, :, None])[:, :, 0]
    moved = guidance.forces(problem.position(ahead.unknown)) - guidance.forces(
        problem.position(now.unknown)
    )
    foretold[:, SHIFT:] += moved / guidance.axle_load[:, None]
    foretold[~problem.wanted] = 0.0
    error = _largest((ahead.residual - foretold) / tolerances, guidance.partner)
    scale = np.maximum(now.missing, _largest(foretold / tolerances, guidance.partner))
    return np.where(ahead.solved, error / np.maximum(scale, 1e-300), np.inf)


def _no_longer(
    step: FloatArray, longest: float, partner: IntArray
) -> NDArray[np.bool_]:
    """Whether steps (n, 6) of a wheelset and its partner are short enough.

    No longer than this in shift and yaw.
    """
    short = np.asarray((np.abs(step[:, SHIFT:]) <= longest).all(axis=1))
    return np.asarray(short & short[partner])


def _ended(problem: Wheelsets, search: _Search, tolerances: FloatArray) -> Guided:
    """End of a search.

    The best state, or both sides of a jump of the contact where it ended at one.
    """
    guidance, best = problem.guidance, search.best
    largest_jump = _tangential(problem).jump
    may_jump = (
        NORMAL_MODELS[problem.task.models.normal].several_solutions
        or largest_jump > 0.0
    )
    # a torque at a jump of the creep forces is as near to balance as it can be
    tolerances = tolerances.copy()
    accepted = largest_jump * tolerances[:, SHIFT] / ACCEPTED
    tolerances[:, SPEED] = np.maximum(tolerances[:, SPEED], accepted)
    missing = np.where(
        best.solved, _largest(best.residual / tolerances, guidance.partner), np.inf
    )
    one, other = search.ends
    share = _share_of_other(problem, one, other)
    both = one.residual + share[:, None] * (other.residual - one.residual)
    together = _largest(both / tolerances, guidance.partner)
    at_jump = may_jump & (missing > ACCEPTED / tolerances[:, SHIFT]) & other.solved
    at_jump &= (other.unknown != one.unknown).any(axis=1)
    for side in search.ends:  # where the search ended
        at_jump &= _no_longer(
            side.unknown - search.now.unknown, _BRACKET, guidance.partner
        )
    two = at_jump & (together < missing)
    main = best.merged(one, two)
    missing = np.where(two, together, missing)
    unloaded = np.asarray(problem.unloaded(main.contact.forces).any(axis=1))
    return Guided(
        unknown=main.unknown,
        slope=search.slopes,
        missing=np.where(unloaded | unloaded[guidance.partner], np.inf, missing),
        stiffness=_stiffness(problem, search.slopes),
        at_jump=at_jump,
        share=np.where(two, share, np.nan),
        other_shift=SHIFT_UNIT * other.unknown[:, SHIFT],
    )


def _share_of_other(problem: Wheelsets, one: _Trial, other: _Trial) -> FloatArray:
    """Share (n,) of the second state with which least is missing.

    On a wheelset and its partner.
    """
    partner = problem.guidance.partner
    change = other.residual - one.residual
    along = (one.residual * change).sum(axis=1)
    square = (change**2).sum(axis=1)
    along, square = along + along[partner], square + square[partner]
    share: FloatArray = np.clip(-along / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    return share


def _stiffness(problem: Wheelsets, slopes: FloatArray) -> FloatArray:
    """Change (n,) of the lateral force with the shift, all but the yaw in balance.

    0: given [N/m].
    """
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
