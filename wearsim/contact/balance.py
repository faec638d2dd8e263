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

moves as on its way to the stable equilibrium, and implicit Euler steps of a growing
length become Newton steps. A wheel that carries too little sinks, and the wheelset
rolls towards the wheel that is too high: near the locking of a flange, where the
heights fall with the roll and with the load that the roll calls for, Newton steps alone
lead away. The length grows as long as the linear equations predict the residuals, and
shrinks otherwise. It is limited so that no step is longer than `_LONGEST`, which keeps
the search from circling where a second contact closes. Steps of loads and roll are
shortened. Wheelsets in given positions begin with Newton steps, and go on in
pseudo-time where these are predicted badly.
Slopes are differences, updated by Broyden's rule [2]_ with their zeros kept [3]_ while
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
    DIFFERENCE,
    GUIDED,
    LEAST_LOAD,
    LEFT,
    RIGHT,
    ROLL,
    ROLL_UNIT,
    ROTATIONS,
    SHIFT,
    SHIFT_UNIT,
    SPEED,
    SPEED_UNIT,
    TORQUE,
    UNKNOWNS,
    YAW,
    YAW_UNIT,
    Contact,
    Wheelsets,
)
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import PLACED
from wearsim.contact.rotation import beyond_crest, free_rotation, rolling_speeds
from wearsim.contact.tangential import (
    TANGENTIAL_MODELS,
    TangentialModel,
    TangentialSolution,
)
from wearsim.contact.wheels import (
    Wheels,
    contact_joined,
    contact_where,
    forces_of,
    joined,
    patches_where,
    planes_of,
    stretched,
)
from wearsim.errors import ContactError, NumericalError

ACCEPTED = 1e-4
"""Largest residual of a balance, over the axle load.

It applies to forces, moments at 1 m, and the torque at the wheel's radius, or to the
jump of the creep forces if that is larger.
"""
AT_JUMP = 5e-3
"""Largest residual at a jump of the contact forces of a model.

It applies to one or both sides together.
"""
SCATTER = 1e-3
"""Largest residual of a wheelset that stays in its place.

On a steep flange forces change by as much within 0.1 um, and those of strips scatter.
"""
# longest steps of the unknowns in their units, 0.5 mm and 1 mrad for shift and yaw
_LONGEST = np.array([2.0, 0.3, 0.3, 5.0, 5.0, 10.0, 2.0])
TOLERANCE = 1e-6
"""Tolerance of the equilibrium of a wheelset in a given position.

It applies to vertical forces over the wheel load, and to torque over friction
coefficient x load x radius. For torque the tolerance of the tangential model counts if
it is larger.
"""

# Creep coefficients of a wheelset: in pseudo-time, which is a distance, it moves by the
# residual force over them.
_SLIDING, _TURNING = 16e6, 9e6  # [N, N m]
# Distances over which loads and roll change by residuals of forces and heights [m].
_SINKING, _LEVELLING = 1.0, 5.0
_FIRST_LENGTH, _LONGEST_LENGTH = 5.0, 1e6  # first and longest step in pseudo-time [m]
# unknowns whose longest steps limit the pseudo-time; those of loads and roll are
# shortened
_MOVING = SPEED, SHIFT, YAW, DIFFERENCE
_SHORTENED = 12  # largest number of shortenings of a step
# error of the linear equations over the residual, by which the step length changes
_FORETOLD = np.array([0.25, 0.5, 0.8])
_FACTOR = np.array([4.0, 2.0, 1.0, 0.25])  # factors on the step length for these errors
_WITHOUT_CONTACT = 0.1  # factor on the step length of a wheel without contact
# largest number of steps, and number after which lengths do not grow: some circle a
# jump
_MOST_STEPS, _GROWING = (
    120,
    80,
)
_MOST_OF_PLACED = 20  # largest number of steps of wheelsets in given positions
_AFRESH = 6  # steps of these wheelsets between two sets of differences
# Steps of shift and yaw in their units: steps that are taken even if residuals rise,
# because wheelsets pass jumps of the contact on their way; steps between both sides
# of a jump, and steps that look for one. Steps of all unknowns that end a search at a
# jump.
_SHORT, _BRACKET, _AT_REST, _SMALLEST = 0.1, 1e-2, 5e-3, 1e-4
# Steps that do not lower a residual that is enough to this share of itself, and end a
# search.
_IDLE, _LOWERED = 3, 0.8
# Steps of Newton's method in units of shift and yaw, 5 um and 5 urad, by which a
# wheelset stays in its place.
_IN_PLACE = 5e-2
_KEPT = 0.5  # ratio of residuals up to which slopes are kept
_FASTER = 1e-2  # change of the unknown rotation speed that shows the side of a crest
_HEIGHTS = 0.5  # weight of the residual of the heights among the others

# Last steps of a wheelset in a given position, in which patches are only stretched:
# residual from which the first step, which leaves 3 % of it, is usually enough; largest
# number of such steps; number of steps after which the rest counts as jump of the creep
# forces; logarithm of the load by which patches may be stretched then, as those of a
# model whose load jumps past the balance are; and accepted residual of the heights,
# 0.15 mm.
_PROMISING = 1.5e-5
_MOST_LAST, _JUMPS_FROM, _LARGEST_JUMP, _AT_REST_THEN = 14, 4, 0.1, 1.0
# logarithm of the load above which a stretch is recorded as load scale
_STRETCHED = 2e-3
_OF_LOAD = 0.3  # approximate friction limit of creep forces over the load
# Residuals by column, as shares of the friction limit, of the wheel loads, and of a
# unit of roll.
_MISSED = {
    SPEED: "torque",
    RIGHT: "right load",
    LEFT: "left load",
    ROLL: "roll",
    DIFFERENCE: "difference of the torques of both wheels",
}
# Columns of wheelsets in given positions.
_OF_PLACED = [SPEED, RIGHT, LEFT, ROLL, DIFFERENCE]


@dataclass(frozen=True)
class Equilibria:
    """Starting points of the searches of n wheelsets, NaN where unknown.

    Parameters
    ----------
    unknown : (n, 7) array
        Unknowns of `axle` in their units; the last two are NaN
        where they are given.
    slope : (n, 7, 7) array
        Of the residuals of the contact.
    drift : (n, 7) array
        Change of the unknowns with the distance that the wheels run, as their profiles
        wear; zeros where it is unknown [1/m].
    """

    unknown: FloatArray
    slope: FloatArray
    drift: FloatArray

    @classmethod
    def found(cls, unknown: FloatArray, slope: FloatArray) -> Equilibria:
        """Return the equilibria at the end of a search, of unknown drift."""
        return cls(unknown, slope, np.zeros_like(unknown))

    @classmethod
    def of_placed(cls, nearby: FloatArray) -> Equilibria:
        """Return the equilibria of wheelsets in given positions.

        `nearby` (n, 30) are the numbers of `placed`.
        """
        count = len(nearby)
        unknown = np.full((count, UNKNOWNS), np.nan)
        slope = np.full((count, UNKNOWNS, UNKNOWNS), np.nan)
        unknown[:, _OF_PLACED] = nearby[:, :PLACED]
        rows, columns = np.ix_(_OF_PLACED, _OF_PLACED)
        slope[:, rows, columns] = nearby[:, PLACED:].reshape(-1, PLACED, PLACED)
        return cls.found(unknown, slope)

    @property
    def placed(self) -> FloatArray:
        """Numbers (n, 30) of equilibria in given positions, for `ContactConditions`.

        Shifts, yaws and wheel loads are given.
        """
        rows, columns = np.ix_(_OF_PLACED, _OF_PLACED)
        of_placed = self.slope[:, rows, columns]
        return np.concatenate(
            [self.unknown[:, _OF_PLACED], of_placed.reshape(-1, PLACED * PLACED)],
            axis=1,
        )

    @property
    def of_guided(self) -> NDArray[np.bool_]:
        """True for wheelsets (n,) that have a starting shift and yaw."""
        return np.asarray(np.isfinite(self.unknown).all(axis=1))

    def at(self, index: IntArray) -> Equilibria:
        """Return the wheelsets at `index`."""
        return Equilibria(self.unknown[index], self.slope[index], self.drift[index])

    def ahead(self, distance: float, acts: NDArray[np.bool_]) -> Equilibria:
        """Return the equilibria as those that act (n,) drift over a distance [m].

        At most a fifth of the longest step of a search: the drift between two ends of
        searches that are near each other is that of their residuals.
        """
        moved = np.clip(distance * self.drift, -0.2 * _LONGEST, 0.2 * _LONGEST)
        return replace(self, unknown=self.unknown + np.where(acts[:, None], moved, 0.0))

    def with_drift(self, before: Equilibria, distance: float) -> Equilibria:
        """Return the equilibria with their drift from those a distance [m] before.

        Over no distance they keep the drift that they have.
        """
        if distance <= 0.0:
            return self
        drift = (self.unknown - before.unknown) / distance
        return replace(self, drift=np.nan_to_num(drift))

    def where(self, taken: NDArray[np.bool_], alternative: Equilibria) -> Equilibria:
        """Return these equilibria for wheelsets `taken` (n,), else the `alternative`."""
        return Equilibria(
            np.where(taken[:, None], self.unknown, alternative.unknown),
            np.where(taken[:, None, None], self.slope, alternative.slope),
            np.where(taken[:, None], self.drift, alternative.drift),
        )


@dataclass(frozen=True)
class Guided:
    """Wheelsets at the end of a search.

    Parameters
    ----------
    unknown : (n, 7) array
        Unknowns of `axle` in their units.
    slope : (n, 7, 7) array
        Of the residuals of the contact.
    residual : (n,) array
        Largest residual over the axle load, infinite without contact or with a wheel
        without load; see `ACCEPTED`.
    stiffness : (n,) array
        Change of the lateral force that guides the wheelset with its shift, all else
        but the yaw in balance, by the slopes at the end of the search, which are
        estimates [N/m].
    in_place : (n,) bool array
        True if the search ended in a place that is known more closely than forces are
        balanced: they jump there, or change by more than their tolerance within steps
        of `_IN_PLACE`.
    share : (n,) array
        Of the distance that a wheelset runs on the other side of a jump of the contact,
        where the forces of both sides balance it together; NaN elsewhere [-].
    other_shift : (n,) array
        Shift there [m].
    """

    unknown: FloatArray
    slope: FloatArray
    residual: FloatArray
    stiffness: FloatArray
    in_place: NDArray[np.bool_]
    share: FloatArray
    other_shift: FloatArray

    def at(self, index: IntArray) -> Guided:
        """Return the wheelsets at `index`."""
        return Guided(*(values[index] for values in vars(self).values()))

    def replaced(self, index: IntArray, replacement: Guided) -> Guided:
        """Return all wheelsets, with those at `index` (k,) replaced."""
        whole = {name: values.copy() for name, values in vars(self).items()}
        for name, values in whole.items():
            values[index] = getattr(replacement, name)
        return Guided(**whole)

    @property
    def equilibria(self) -> Equilibria:
        """Starting points of the next search."""
        return Equilibria.found(self.unknown, self.slope)

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
    """Return NaN values for wheelsets that were not solved for."""
    nothing = np.full(count, np.nan)
    return Guided(
        unknown=np.full((count, UNKNOWNS), np.nan),
        slope=np.full((count, UNKNOWNS, UNKNOWNS), np.nan),
        residual=nothing,
        stiffness=nothing,
        in_place=np.zeros(count, dtype=bool),
        share=nothing,
        other_shift=nothing,
    )


@dataclass(frozen=True)
class _Trial:
    """Trial state of wheelsets."""

    unknown: FloatArray  # (n, 7)
    contact: Contact
    guiding: FloatArray  # (n, 2) force and moment of the guidance
    of_contact: FloatArray  # (n, 7) residuals without the guiding forces
    residual: FloatArray  # (n, 7), 0 for given unknowns
    # (n,) largest residual of a wheelset and its partner over the tolerance
    missing: FloatArray
    solved: NDArray[np.bool_]  # (n,) True if both have contact

    def merged(self, replacement: _Trial, taken: NDArray[np.bool_]) -> _Trial:
        """Return this state with the wheelsets `taken` (n,) from another one."""
        if taken.all():
            return replacement
        if not taken.any():
            return self
        return _Trial(
            np.where(taken[:, None], replacement.unknown, self.unknown),
            self.contact.merged(replacement.contact, taken),
            np.where(taken[:, None], replacement.guiding, self.guiding),
            np.where(taken[:, None], replacement.of_contact, self.of_contact),
            np.where(taken[:, None], replacement.residual, self.residual),
            np.where(taken, replacement.missing, self.missing),
            np.where(taken, replacement.solved, self.solved),
        )


@dataclass(frozen=True)
class Settled:
    """Wheelsets in equilibrium in given positions.

    Parameters
    ----------
    wheels : Wheels
        Patches, those of a wheel by falling normal force.
    contact : TangentialSolution
        Their creep forces, with the fields of cells requested by the task.
    unknown : (n, 7) array
        Unknowns of `axle` in their units.
    slopes : (n, 7, 7) array
        Of the residuals.
    """

    wheels: Wheels
    contact: TangentialSolution
    unknown: FloatArray
    slopes: FloatArray


@dataclass(frozen=True)
class _Search:
    """End of a search: best and last states, slopes, and any jump.

    A jump is given by both ends of the last step across it. Wheelsets (n,) that stayed
    `in_place` did so in the last steps.
    """

    best: _Trial
    now: _Trial
    ends: tuple[_Trial, _Trial]
    slopes: FloatArray
    in_place: NDArray[np.bool_]


def balanced(
    problem: Wheelsets,
    unknown: FloatArray,
    tolerance: float,
    slope: FloatArray | None = None,
    *,
    near: bool = False,
    enough: float = 0.0,
) -> Guided:
    """Solve for the positions of wheelsets at which their forces are balanced.

    Parameters
    ----------
    problem : Wheelsets
        n wheelsets and the forces on them.
    unknown : (n, 7) array
        To begin with.
    tolerance : float
        Of forces and moments (at 1 m) over the axle load, and of wheel loads over
        themselves.
    slope : (n, 7, 7) array, optional
        Of a state nearby; by default differences.
    near : bool
        Whether they begin so near to the balance that the first step can be one of
        Newton's.
    enough : float
        Multiple of the tolerances, times `tolerance`, at which a search ends that does
        not come nearer: over the axle load for forces.

    Returns
    -------
    Guided
        The states with the smallest residuals met.
    """
    tolerances = _tolerances(problem, tolerance)
    search = _searched(
        problem,
        unknown,
        tolerances,
        slope,
        None,
        near=near,
        enough=enough / tolerance,
    )
    return _ended(problem, search, tolerances)


def settled(
    problem: Wheelsets,
    unknown: FloatArray,
    slope: FloatArray,
    contact: Contact | None = None,
) -> Settled:
    """Balance torque, loads and heights of wheelsets in given positions.

    Parameters
    ----------
    problem : Wheelsets
        n wheelsets.
    unknown : (n, 7) array
        To begin with.
    slope : (n, 7, 7) array
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
    tolerances[:, ROTATIONS] = max(_PROMISING, _tangential(problem).tolerance)
    tolerances[:, ROLL] = problem.resting
    search = _searched(problem, unknown, tolerances, slope, contact, near=True)
    end = search.best
    lost = ~end.solved | ((end.missing > 1.0) & ~search.now.solved)
    if lost.any():
        raise search.now.contact.faults[int(np.argmax(lost))]
    if problem.given is None and problem.task.models.friction_falls:
        search = _with_small_slip(problem, search, tolerances)
    return _with_last_steps(problem, search.best, search.slopes)


def _with_small_slip(
    problem: Wheelsets, search: _Search, tolerances: FloatArray
) -> _Search:
    """Return a search whose wheels run before the crest of their creep forces.

    Wheelsets that it left unsolved, or behind the crest, begin anew at the rotation
    speed nearest to rolling. Raises a CrestError where a torque is beyond the crest.
    """
    end = search.best
    assert end.contact.wheels is not None
    astray = (end.missing > 1.0) | ~_torque_rises(problem, end)
    astray &= problem.chunk.traction > 0.0
    if not astray.any():
        return search
    task, wheels = problem.task, end.contact.wheels

    def torque(speed: FloatArray, needed: NDArray[np.bool_]) -> FloatArray:
        part = patches_where(wheels, needed.ravel()[wheels.place])
        return forces_of(task, part, speed, _tangential(problem)).torque

    independent = problem.chunk.independent
    rotation = free_rotation(
        torque,
        problem.chunk,
        task.wheelset.radius,
        rolling_speeds(wheels, independent, problem.count),
        ~astray,
        crest=True,
    )
    if not rotation.solved.all():
        raise beyond_crest(problem.chunk.torque, rotation, ~rotation.solved)
    near_rolling = problem.with_speed(end.unknown, rotation.speed)
    begin = np.where(astray[:, None], near_rolling, end.unknown)
    every = np.ones(problem.count, dtype=bool)
    slopes, start = search.slopes.copy(), end.contact
    now = _tried(problem, begin, every, start, tolerances)
    slopes[astray] = problem.slopes(begin, now.contact, astray)[astray]
    return _searched(problem, begin, tolerances, slopes, now.contact, near=True)


def _torque_rises(problem: Wheelsets, end: _Trial) -> NDArray[np.bool_]:
    """Return True where the torques of wheelsets (n,) rise with their speeds."""
    assert end.contact.wheels is not None
    faster = end.unknown.copy()
    faster[:, SPEED] += _FASTER
    forces, _ = problem.forces(faster, end.contact.wheels)
    change = forces[:, :, TORQUE] - end.contact.forces[:, :, TORQUE]
    of_wheels = change if problem.chunk.independent else change.sum(axis=1)[:, None]
    return np.asarray((of_wheels > 0.0).all(axis=1))


def placed_step(
    problem: Wheelsets, slopes: FloatArray, residual: FloatArray
) -> FloatArray:
    """Newton step (n, 7) of wheelsets in given positions, limited in length.

    Parameters
    ----------
    problem : Wheelsets
        n wheelsets.
    slopes : (n, 7, 7) array
        Of the residuals.
    residual : (n, 7) array
        Of the contact.
    """
    columns = problem.wanted.copy()
    columns[:, GUIDED] = False
    every, endless = np.ones(problem.count, dtype=bool), np.full(problem.count, np.inf)
    return _shortened(_newton_step(problem, slopes, residual, endless, every, columns))


def _tolerances(problem: Wheelsets, tolerance: float) -> FloatArray:
    """Tolerances (n, 7) of the residuals, with that of forces over the axle load."""
    most = np.full((problem.count, UNKNOWNS), tolerance)
    at_radius = tolerance * problem.guidance.axle_load / problem.chunk.traction_scale
    of_torque = np.maximum(at_radius, _tangential(problem).tolerance)
    most[:, ROTATIONS] = of_torque[:, None]
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
    enough: float = 0.0,
) -> _Search:
    """Search the balance within tolerances (n, 7).

    A search also ends where the last steps have hardly lowered a residual that is
    `enough`, over its tolerance, or that of a wheelset which stays in its place: forces
    have kinks where strips gain and lose contact, around which Newton's method circles,
    a little nearer each time, and on a steep flange they change by several 1e-4 of the
    axle load within 0.1 um. The other parameters are those of `balanced` and `settled`.
    """
    count, placed = problem.count, problem.placed
    most = np.where(placed, _MOST_OF_PLACED, _MOST_STEPS)
    length = np.full(count, _LONGEST_LENGTH if near else _FIRST_LENGTH)
    stuck, idle = np.zeros(count, dtype=bool), np.zeros(count, dtype=int)
    in_place = np.zeros(count, dtype=bool)
    scatters = SCATTER / tolerances[:, SHIFT]
    now = best = _tried(
        problem, unknown, np.ones(count, dtype=bool), contact, tolerances
    )
    ends = now, now
    slopes = np.full((count, UNKNOWNS, UNKNOWNS), np.nan) if slope is None else slope
    has_slopes = now.solved & np.isfinite(slopes).all(axis=(1, 2))
    slopes = np.where(has_slopes[:, None, None], slopes, 0.0)
    # Slopes tell whether a balance is stable, also of one that is met at once.
    needs_slopes = now.solved & ~has_slopes & ~placed
    slopes = _by_differences(problem, now, slopes, needs_slopes)
    has_slopes |= needs_slopes
    partner = problem.guidance.partner
    for number in range(_MOST_STEPS):
        open_rows = (best.missing > 1.0) & now.solved & ~stuck & (number < most)
        if not open_rows.any():
            break
        waits = open_rows & ~placed & (idle >= _IDLE)
        near_balance = waits & (best.missing <= scatters)
        # Where a load jumps, differences oscillate across the jump; the secant does
        # not. Near the balance differences tell how far it is.
        needs_slopes = open_rows & ~has_slopes & (~placed | (number % _AFRESH == 0))
        needs_slopes |= near_balance
        slopes = _by_differences(problem, now, slopes, needs_slopes)
        step, length = _limited_step(problem, slopes, now.residual, length, open_rows)
        ahead = _tried(problem, now.unknown + step, open_rows, now.contact, tolerances)
        error = _error_of_foretold(problem, now, ahead, slopes, tolerances)
        solved = open_rows & ahead.solved
        short = _no_longer(step, _SHORT, partner)
        lost = open_rows & placed & ~ahead.solved
        taken = lost | (
            solved & (short | (error < 1.0) | (ahead.missing < now.missing))
        )
        stays = _stays(problem, slopes, now, best, near_balance)
        in_place |= stays
        stuck |= stays
        slopes = _secant(
            problem, slopes, ahead.of_contact - now.of_contact, step, solved
        )
        has_slopes = np.where(
            open_rows, solved & (ahead.missing < _KEPT * now.missing), has_slopes
        )
        factor = np.where(
            ahead.solved, _FACTOR[np.searchsorted(_FORETOLD, error)], _WITHOUT_CONTACT
        )
        length = np.where(
            open_rows, _next_length(length, factor, placed, number), length
        )
        tiny = np.asarray((np.abs(step) <= _SMALLEST).all(axis=1))
        stuck |= open_rows & (factor < 1.0) & tiny & tiny[partner]
        nearer = solved & (ahead.missing < _LOWERED * best.missing)
        best = best.merged(ahead, solved & (ahead.missing < best.missing))
        idle = np.where(nearer, 0, idle + 1)
        stuck |= (idle >= _IDLE) & (best.missing <= enough)
        share = _share_of_other(problem, now, ahead)
        across = solved & (factor < 1.0) & (share > 0.0) & (share < 1.0)
        ends = ends[0].merged(now, across), ends[1].merged(ahead, across)
        now = now.merged(ahead, taken)
        waits &= ~stuck
        if waits.any():
            near_best = _no_longer(best.unknown - now.unknown, _BRACKET, partner)
            at_rest = waits & near_best & _no_longer(step, _AT_REST, partner)
            stuck |= at_rest & _at_jump(problem, ends, now)
    return _Search(best, now, ends, slopes, in_place)


def _by_differences(
    problem: Wheelsets, now: _Trial, slopes: FloatArray, rows: NDArray[np.bool_]
) -> FloatArray:
    """Slopes (n, 7, 7), those of `rows` (n,) by differences about a state."""
    if not rows.any():
        return slopes
    afresh = problem.slopes(now.unknown, now.contact, rows)
    return np.where(rows[:, None, None], afresh, slopes)


def _next_length(
    length: FloatArray, factor: FloatArray, placed: NDArray[np.bool_], number: int
) -> FloatArray:
    """Lengths (n,) of the next step in pseudo-time, by their factors (n,) [m].

    Wheelsets in given positions begin with Newton's steps, which end as soon as one is
    predicted badly. Late in a search lengths do not grow: some circle a jump.
    """
    growth = factor if number < _GROWING else np.minimum(factor, 1.0)
    following: FloatArray = np.minimum(growth * length, _LONGEST_LENGTH)
    astray = placed & (factor < 1.0)
    return np.where(astray, np.minimum(following, _FIRST_LENGTH), following)


def _with_last_steps(problem: Wheelsets, end: _Trial, slopes: FloatArray) -> Settled:
    """Complete the balance of wheelsets near it by steps of speed and loads.

    In these steps patches are only stretched.
    """
    columns = problem.wanted.copy()
    columns[:, ROLL] = False
    unknown, residual, slopes = end.unknown, end.residual, slopes.copy()
    done: list[Wheels] = []
    contacts: list[TangentialSolution] = []
    open_rows = np.ones(problem.count, dtype=bool)
    endless = np.full(problem.count, np.inf)
    heavier = _friction_over_loads(problem, end.contact)
    for number in range(_MOST_LAST):
        limits = _last_limits(problem, number, heavier)
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
    return Settled(joined(done), contact_joined(contacts), unknown, slopes)


def _last_limits(problem: Wheelsets, number: int, heavier: FloatArray) -> FloatArray:
    """Largest residuals (n, 7) in the last step of a number.

    After some steps the rest of the torques and loads counts as jump of the creep
    forces. Torques are relative to a friction limit that is `heavier` (n,) times that
    under the wheel loads.
    """
    model = _tangential(problem)
    torque, load = max(model.tolerance, TOLERANCE), TOLERANCE
    if number >= _JUMPS_FROM:
        torque, load = max(model.jump, torque), max(_OF_LOAD * model.jump, load)
    limits = np.full((problem.count, UNKNOWNS), np.inf)
    limits[:, ROTATIONS] = torque * heavier[:, None]
    limits[:, [RIGHT, LEFT]] = load
    limits[:, ROLL] = _AT_REST_THEN
    return limits


def _friction_over_loads(problem: Wheelsets, contact: Contact) -> FloatArray:
    """Friction limit (n,) under normal forces over that under wheel loads, at least 1.

    The accuracy of creep forces is relative to the former, which may be several times
    as large on a flange.
    """
    assert contact.wheels is not None
    wheels = contact.wheels
    carried = (wheels.friction * planes_of(wheels.normal).normal_force).sum(axis=1)
    of_row = np.bincount(wheels.normal.patch.row, carried, problem.count)
    return np.maximum(0.5 * of_row / problem.chunk.traction_scale, 1.0)


def _shortened(step: FloatArray) -> FloatArray:
    """Return steps (n, 7) limited to the longest permitted ones."""
    longest = np.abs(step / _LONGEST).max(axis=1, initial=0.0)
    shortened: FloatArray = step / np.maximum(longest, 1.0)[:, None]
    return shortened


def _stretched_from(
    problem: Wheelsets, contact: Contact, rows: NDArray[np.bool_], unknown: FloatArray
) -> tuple[Wheels, FloatArray]:
    """Patches of wheelsets `rows` (n,) under other loads, and their largest stretch.

    The stretch is a logarithm. Where it is more than similarity of the patches permits,
    their load scale states how much.
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
    """Error of the wheels (n, 2) that are unloaded by the forces on their axle."""
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
    """Error of the points without balance, with their best residuals (n, 7)."""
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
    """Largest of shares (n, 7) of a wheelset and its partner (n,)."""
    largest = np.abs(share).max(axis=1, initial=0.0)
    return np.maximum(largest, largest[partner])


def _tried(
    problem: Wheelsets,
    unknown: FloatArray,
    rows: NDArray[np.bool_],
    near: Contact | None,
    tolerances: FloatArray,
) -> _Trial:
    """Solve the contact of wheelsets `rows` (n,) in a state.

    Other wheelsets have no residuals.
    """
    guidance = problem.guidance
    contact = problem.contact(unknown, rows, near)
    of_contact = problem.residuals(contact.forces)
    guiding = guidance.forces(problem.position(unknown))
    residual = of_contact.copy()
    residual[:, GUIDED] += guiding / guidance.axle_load[:, None]
    residual[~problem.wanted] = 0.0
    solved = contact.solved & contact.solved[guidance.partner]
    missing = np.where(
        solved, _largest(residual / tolerances, guidance.partner), np.inf
    )
    return _Trial(unknown, contact, guiding, of_contact, residual, missing, solved)


def _secant(
    problem: Wheelsets,
    slopes: FloatArray,
    change: FloatArray,
    step: FloatArray,
    rows: NDArray[np.bool_],
) -> FloatArray:
    """Slopes (n, 7, 7) of `rows` (n,) after a step, by Broyden's update.

    The step (n, 7) changed the residuals by (n, 7).
    """
    missed = change - (slopes @ step[:, :, None])[:, :, 0]
    part = np.where(problem.linked, step[:, None], 0.0)
    square = (part**2).sum(axis=2)
    seen = rows[:, None] & (square > 0.0)
    share = np.where(seen, missed / np.where(seen, square, 1.0), 0.0)
    improved: FloatArray = slopes + share[:, :, None] * part
    return improved


def _inertia(problem: Wheelsets, length: FloatArray) -> FloatArray:
    """Change (n, 7) of residuals due to unknowns that move in pseudo-time.

    The steps have lengths (n,) [m].
    """
    weight = problem.guidance.axle_load
    inertia = np.zeros((length.size, UNKNOWNS))
    turning = -_SLIDING * SPEED_UNIT / problem.chunk.traction_scale
    inertia[:, ROTATIONS] = turning[:, None]
    inertia[:, SHIFT] = _SLIDING * SHIFT_UNIT / weight
    inertia[:, YAW] = _TURNING * YAW_UNIT / weight
    inertia[:, RIGHT:ROLL] = -_SINKING
    inertia[:, ROLL] = _LEVELLING
    inertia /= length[:, None]
    return inertia


def _limited_step(
    problem: Wheelsets,
    slopes: FloatArray,
    residual: FloatArray,
    length: FloatArray,
    rows: NDArray[np.bool_],
) -> tuple[FloatArray, FloatArray]:
    """Step (n, 7) of `rows` (n,), and pseudo-time lengths (n,) that limit it.

    The lengths limit the steps of rotation, shift and yaw.
    """
    partner = problem.guidance.partner
    step = np.zeros_like(residual)
    moving = np.isin(np.arange(UNKNOWNS), _MOVING)
    columns = problem.wanted.copy()
    # A wheelset at rest keeps its roll and its patches while the others converge.
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
    """Newton step (k, 7) of `rows` (n,) with their partners, in some columns (n, 7)."""
    guidance = problem.guidance
    partner, diagonal = guidance.partner, np.arange(UNKNOWNS)
    by_wheelset, by_partner = _guidance_slopes(problem)
    jacobian = slopes.copy()
    jacobian[:, diagonal, diagonal] -= _inertia(problem, length)
    jacobian[:, GUIDED] += by_wheelset
    jacobian = np.where(columns[:, :, None] & columns[:, None], jacobian, 0.0)
    # given unknowns, and those without effect: the speed without friction
    idle = ~jacobian.any(axis=1)
    jacobian[:, diagonal, diagonal] = np.where(
        idle, 1.0, jacobian[:, diagonal, diagonal]
    )
    missing = np.where(columns, residual, 0.0)
    coupled = partner != np.arange(problem.count)
    # Equations of independent wheels are left out where there are none.
    size = UNKNOWNS if columns[:, DIFFERENCE].any() else DIFFERENCE
    step = np.zeros((int(rows.sum()), UNKNOWNS))
    jacobian, missing = jacobian[:, :size, :size], missing[:, :size]
    if not coupled.any():
        step[:, :size] = _solved(jacobian[rows], missing[rows])
        return step
    across = np.zeros_like(slopes)
    across[coupled, GUIDED] = by_partner[coupled]
    across = np.where(columns[:, :, None] & columns[partner][:, None], across, 0.0)
    across = across[:, :size, :size]
    whole = np.block([[jacobian, across], [across[partner], jacobian[partner]]])[rows]
    both = np.concatenate([missing, missing[partner]], axis=1)[rows]
    step[:, :size] = _solved(whole, both)[:, :size]
    return step


def _solved(slopes: FloatArray, residual: FloatArray) -> FloatArray:
    """Newton steps (k, m) from slopes (k, m, m) and residuals (k, m)."""
    try:
        return -np.asarray(
            np.linalg.solve(slopes, residual[:, :, None]), dtype=np.float64
        )[:, :, 0]
    except np.linalg.LinAlgError:  # raised for a wheel without load
        if len(slopes) == 1:
            return -(np.linalg.pinv(slopes) @ residual[:, :, None])[:, :, 0]
    parts = [_solved(slopes[[k]], residual[[k]]) for k in range(len(slopes))]
    return np.concatenate(parts)


def _guidance_slopes(problem: Wheelsets) -> tuple[FloatArray, FloatArray]:
    """Slopes (n, 2, 7) of the guiding forces over the axle load.

    They are derivatives by the unknowns of the wheelset and of its partner.
    """
    guidance, chunk = problem.guidance, problem.chunk
    # derivatives of lateral position and yaw by the unknowns
    position = np.zeros((chunk.shift.size, 2, UNKNOWNS))
    position[:, 0, SHIFT] = SHIFT_UNIT
    if chunk.shift_depth is not None:
        position[:, 0, ROLL] = chunk.shift_depth * ROLL_UNIT
    position[:, 1, YAW] = YAW_UNIT
    weight = guidance.axle_load[:, None, None]
    by_wheelset = guidance.slope[:, :, :2] @ position / weight
    by_partner = guidance.slope[:, :, 2:] @ position[guidance.partner] / weight
    return by_wheelset, by_partner


def _error_of_foretold(
    problem: Wheelsets,
    now: _Trial,
    ahead: _Trial,
    slopes: FloatArray,
    tolerances: FloatArray,
) -> FloatArray:
    """Error (n,) of residuals predicted by the linear equations.

    It is relative to their previous or required values.
    """
    guidance = problem.guidance
    step = ahead.unknown - now.unknown
    foretold = now.residual + (slopes @ step[:, :, None])[:, :, 0]
    foretold[:, GUIDED] += (ahead.guiding - now.guiding) / guidance.axle_load[:, None]
    foretold[~problem.wanted] = 0.0
    error = _largest((ahead.residual - foretold) / tolerances, guidance.partner)
    scale = np.maximum(now.missing, _largest(foretold / tolerances, guidance.partner))
    return np.where(ahead.solved, error / np.maximum(scale, 1e-300), np.inf)


def _no_longer(
    step: FloatArray, longest: float, partner: IntArray
) -> NDArray[np.bool_]:
    """Return True for steps (n, 7) of wheelset and partner within a limit.

    The limit applies to shift and yaw.
    """
    short = np.asarray((np.abs(step[:, GUIDED]) <= longest).all(axis=1))
    return np.asarray(short & short[partner])


def _stays(
    problem: Wheelsets,
    slopes: FloatArray,
    now: _Trial,
    best: _Trial,
    rows: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Return True for those of `rows` (n,) that a step of Newton's leaves in their place.

    Its length estimates the error of the place; a step in pseudo-time may be shorter.
    """
    if not rows.any():
        return rows
    partner, step = problem.guidance.partner, np.zeros_like(now.unknown)
    endless = np.full(problem.count, np.inf)
    step[rows] = _newton_step(
        problem, slopes, now.residual, endless, rows, problem.wanted
    )
    short = _no_longer(step, _IN_PLACE, partner)
    return rows & short & _no_longer(best.unknown - now.unknown, _IN_PLACE, partner)


def _at_jump(
    problem: Wheelsets, ends: tuple[_Trial, _Trial], now: _Trial
) -> NDArray[np.bool_]:
    """Return True for wheelsets (n,) that are near both ends of a step across a jump.

    There are none with contact models whose forces do not jump.
    """
    several = NORMAL_MODELS[problem.task.models.normal].several_solutions
    if not several and _tangential(problem).jump == 0.0:
        return np.zeros(problem.count, dtype=bool)
    partner = problem.guidance.partner
    before_jump, after_jump = ends
    apart = (after_jump.unknown != before_jump.unknown).any(axis=1)
    at_jump = after_jump.solved & (apart | apart[partner])
    for side in ends:
        at_jump &= _no_longer(side.unknown - now.unknown, _BRACKET, partner)
    return np.asarray(at_jump)


def _ended(problem: Wheelsets, search: _Search, tolerances: FloatArray) -> Guided:
    """End of a search: the best state, or both sides of a jump of the contact."""
    guidance, best = problem.guidance, search.best
    largest_jump = _tangential(problem).jump
    # A torque at a jump of the creep forces cannot be balanced more closely.
    tolerances = tolerances.copy()
    accepted = largest_jump * tolerances[:, SHIFT] / ACCEPTED
    tolerances[:, ROTATIONS] = np.maximum(tolerances[:, ROTATIONS], accepted[:, None])
    missing = np.where(
        best.solved, _largest(best.residual / tolerances, guidance.partner), np.inf
    )
    before_jump, after_jump = search.ends
    share = _share_of_other(problem, before_jump, after_jump)
    both = before_jump.residual + share[:, None] * (
        after_jump.residual - before_jump.residual
    )
    together = _largest(both / tolerances, guidance.partner)
    at_jump = missing > ACCEPTED / tolerances[:, SHIFT]
    at_jump &= _at_jump(problem, search.ends, search.now)
    two = at_jump & (together < missing)
    main = best.merged(before_jump, two)
    missing = np.where(two, together, missing)
    unloaded = np.asarray(problem.unloaded(main.contact.forces).any(axis=1))
    missing[unloaded | unloaded[guidance.partner]] = np.inf
    return Guided(
        unknown=main.unknown,
        slope=search.slopes,
        residual=missing * tolerances[:, SHIFT],
        stiffness=_stiffness(problem, search.slopes),
        in_place=at_jump | search.in_place,
        share=np.where(two, share, np.nan),
        other_shift=SHIFT_UNIT * after_jump.unknown[:, SHIFT],
    )


def _share_of_other(problem: Wheelsets, first: _Trial, second: _Trial) -> FloatArray:
    """Share (n,) of the second state for the smallest residual.

    Wheelset and partner have a common share.
    """
    partner = problem.guidance.partner
    change = second.residual - first.residual
    along = (first.residual * change).sum(axis=1)
    square = (change**2).sum(axis=1)
    along, square = along + along[partner], square + square[partner]
    share: FloatArray = np.clip(-along / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    return share


def _stiffness(problem: Wheelsets, slopes: FloatArray) -> FloatArray:
    """Lateral stiffness (n,) of the contact with all but the yaw in balance [N/m].

    It is 0 where the shift is given.
    """
    free = problem.wanted
    rest = np.array([SPEED, RIGHT, LEFT, ROLL])
    if free[:, DIFFERENCE].any():
        rest = np.append(rest, DIFFERENCE)
    inner = slopes[:, rest[:, None], rest]
    either = free[:, rest, None] & free[:, None, rest]
    inner = np.where(either, inner, np.eye(rest.size))
    by_shift = np.where(free[:, rest], slopes[:, rest, SHIFT], 0.0)
    moved = (np.linalg.pinv(inner) @ by_shift[:, :, None])[:, :, 0]
    change = slopes[:, SHIFT, SHIFT] - (slopes[:, SHIFT, rest] * moved).sum(axis=1)
    stiffness: FloatArray = -change * problem.guidance.axle_load / SHIFT_UNIT
    return np.where(free[:, SHIFT], stiffness, 0.0)
