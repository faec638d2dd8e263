r"""Equilibrium of wheelsets under given forces: shift, yaw and wheel loads.

With the lateral force H at axle height and the axle load W, of which the boxes carry
the moment :math:`B = (V_R - V_L) b` about the longitudinal axis,

.. math::
    -H_c(y) = H, \qquad \sum Q_p = W, \qquad \sum (y_p Q_p + z_p T_p) = B

(`wearsim.operation.resultants`); both axles of a bogie balance their suspension
(`wearsim.operation.bogie`). Solved shifts are those at the height of the rails, where
the roll does not move the wheels sideways. On a flank of more than 60 degrees a wheel
that moves sideways rises faster than the other wheel sinks by the roll, and two
contacts carry the same loads at one shift of the axle.

`wearsim.contact.balance` solves all equations together. The force over the shift is
flat on the tread and not monotonic, so that up to five shifts belong to one force. The
wheelset moves from its previous position, at first from the track centre, in the
direction of its own creep forces. From an unstable balance it is pushed away.

Where the contact forces of a model jump within a micrometre, no shift may balance the
wheelset. It then runs on both sides of the jump alternately, in shares of the distance
whose mean force equals the prescribed one. This is its limit under ever shorter steps
of wear: each side wears towards the other (a sliding mode, [1]_).

References
----------
.. [1] A. F. Filippov, Differential Equations with Discontinuous Righthand Sides, Kluwer
   1988, doi:10.1007/978-94-015-7793-9.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.axle import LEAST_LOAD, UNKNOWNS
from wearsim.contact.balance import ACCEPTED, AT_JUMP, Equilibria, Guided, none_guided
from wearsim.contact.guidance import Guidance
from wearsim.contact.mirror import Images, copied_balances, images_of, is_symmetric
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import (
    ContactConditions,
    ContactModels,
    Counterface,
    Wheelset,
)
from wearsim.contact.rotation import CrestError
from wearsim.contact.solve import ContactSolution, solve_each, solve_guided
from wearsim.contact.wheels import joined
from wearsim.errors import ContactError
from wearsim.operation.controlled import Controlled
from wearsim.operation.resultants import Resultants, resultants

TOLERANCE = 2e-5
"""Residual of force, moment (at 1 m) and wheel load that ends a search [-].

It is relative to the axle load. A search that comes no nearer ends at `ACCEPTED`, or
where the wheelset stays in its place at `SCATTER`. Where none is found, the wheelset
runs at the smallest residual up to `AT_JUMP`.
"""
_PUSH = 0.1e-3  # shift that pushes a wheelset out of an unstable balance [m]
_FURTHEST_AHEAD = 0.5e-3  # largest extrapolated motion of a wheelset [m]
# step and number of the shifts that are searched for the largest flange force [m]
_STRIDE, _STRIDES = (
    0.25e-3,
    64,
)
# least share of the distance on one side of a jump; below it the axle runs on the other
# side
_LEAST_SHARE = 1e-3
_UNSETTLED = "shift and wheel loads do not settle; smooth measured profiles"


@dataclass(frozen=True)
class BeyondJump:
    """States of `k` points beyond a jump of the contact forces, further to the right.

    Each runs there for a share of the distance.
    """

    point: IntArray  # (k,)
    shift: FloatArray  # (k,) [m]
    share: FloatArray  # (k,) of the distance of the point, between 0 and 1 [-]


@dataclass(frozen=True)
class Running:
    """States of wheelsets at `n` operating points; the next search starts from them."""

    shift: FloatArray  # (n,) [m]
    stiffness: FloatArray  # (n,) dH/dy where it runs; 0 where the shift is given [N/m]
    yaw: FloatArray  # (n,) [rad]
    # (n,) largest residual of forces over the axle load; 0 where the place is given
    residual: FloatArray
    beyond: BeyondJump | None = None  # of points that run at two shifts
    # (n,) depth of `ContactConditions` [m], and roll of the wheelsets of bogies [rad];
    # empty: at the axle
    shift_depth: FloatArray = field(default_factory=lambda: np.zeros(0))
    roll: FloatArray = field(default_factory=lambda: np.zeros(0))
    # (n,) derivative of the shift by the distance [-]
    rate: FloatArray = field(default_factory=lambda: np.zeros(0))
    distance: float = 0.0  # distance of the campaign at this state [m]

    def at(self, distance: float) -> Running:
        """Return the state of the wheelset extrapolated to another distance."""
        if not self.rate.size:
            return self
        moved = self.rate * (distance - self.distance)
        moved = np.clip(moved, -_FURTHEST_AHEAD, _FURTHEST_AHEAD)
        beyond = self.beyond
        if beyond is not None:
            beyond = replace(beyond, shift=beyond.shift + moved[beyond.point])
        return replace(self, shift=self.shift + moved, beyond=beyond)

    def moved(
        self,
        rows: IntArray,
        *,
        shift: FloatArray,
        stiffness: FloatArray,
        yaw: FloatArray,
        residual: FloatArray,
        roll: FloatArray,
    ) -> Running:
        """Return the states with points `rows` (k,) moved, on one side of any jump."""
        beyond = self.beyond
        if beyond is not None:
            stays = np.flatnonzero(~np.isin(beyond.point, rows))
            beyond = joined([beyond], stays) if stays.size else None
        return replace(
            self,
            shift=_with(self.shift, rows, shift),
            stiffness=_with(self.stiffness, rows, stiffness),
            yaw=_with(self.yaw, rows, yaw),
            residual=_with(self.residual, rows, residual),
            roll=_with(self.roll, rows, roll) if self.roll.size else self.roll,
            beyond=beyond,
        )

    def replaced(self, rows: IntArray, source: Running) -> Running:
        """Return the states with points `rows` (k,) taken from other states.

        The points are then on one side of any jump.
        """
        return self.moved(
            rows,
            shift=source.shift[rows],
            stiffness=source.stiffness[rows],
            yaw=source.yaw[rows],
            residual=source.residual[rows],
            roll=source.roll[rows] if source.roll.size else source.roll,
        )

    def conditions(self, conditions: ContactConditions) -> ContactConditions:
        """Contact conditions of the `n` points where the wheelset runs."""
        running_conditions = replace(conditions, shift=self.shift, yaw=self.yaw)
        if not self.shift_depth.size:
            return running_conditions
        return replace(running_conditions, shift_depth=self.shift_depth, roll=self.roll)


class StateError(ContactError):
    """Error: no state balances the forces of some points.

    `messages` gives the reason by the number of the point.
    """

    def __init__(self, messages: dict[int, str]) -> None:
        self.messages = messages
        # bodies of a campaign in this state; None without a campaign
        self.bodies: tuple[Wheelset, Counterface] | None = None
        super().__init__(
            "; ".join(f"point {k}: {text}" for k, text in messages.items())
        )


def settle(
    conditions: ContactConditions,
    controlled: Controlled,
    wheelset: Wheelset,
    counterface: Counterface,
    models: ContactModels,
    start: Running | None = None,
    *,
    threads: int = 1,
) -> Running:
    """Solve for the shift and yaw at which the controlled forces are balanced.

    Parameters
    ----------
    conditions : ContactConditions
        Of n points, free to roll where something is controlled; shifts that follow from
        forces are without effect.
    controlled : Controlled
        Forces and what they replace.
    wheelset, counterface, models
        As in `wearsim.contact.solve.solve`.
    start : Running, optional
        Where the wheelset ran before; by default in the middle of the track.
    threads : int
        Of the contact solver; their number does not change the bits.

    Returns
    -------
    Running
        The shifts and yaws found; those that are given are as given.

    Raises
    ------
    StateError
        If no state carries the forces: the crest of the flange is reached or a wheel is
        unloaded.
    """
    bodies = wheelset, counterface
    return settle_nearby(
        conditions, controlled, bodies, models, start, None, threads=threads
    )[0]


def settle_rows(
    conditions: ContactConditions,
    controlled: Controlled,
    wheelset: Wheelset,
    counterface: Counterface,
    models: ContactModels,
    start: Running | None = None,
) -> tuple[Running, IntArray]:
    """Return where points run as `settle` does, and those (k,) without a balance.

    The latter are where the search left them.
    """
    bodies = wheelset, counterface
    given = _given(conditions, controlled, bodies, models, 1)
    running, left, _ = _searched(given, start, None, controlled.any, TOLERANCE)
    return running, left


def settle_nearby(
    conditions: ContactConditions,
    controlled: Controlled,
    bodies: tuple[Wheelset, Counterface],
    models: ContactModels,
    start: Running | None,
    nearby: Equilibria | None,
    *,
    stage: NDArray[np.bool_] | None = None,
    threads: int = 1,
) -> tuple[Running, Guided]:
    """Solve the balance of forces from the end of a nearby search.

    Parameters
    ----------
    conditions, controlled, models, start, threads
        As in `settle`.
    bodies : (Wheelset, Counterface)
        In contact.
    nearby : Equilibria, optional
        Of the same points in a state nearby: saves work and changes nothing beyond
        `ACCEPTED`.
    stage : (n,) bool array, optional
        Points that act in a stage of a wear step: only they move, and all bogies, and
        to a coarser tolerance.

    Returns
    -------
    Running, Guided
        As of `settle`, and the end of its search.

    Raises
    ------
    StateError
        As in `settle`.
    """
    given = _given(conditions, controlled, bodies, models, threads)
    acts = (
        controlled.any
        if stage is None
        else controlled.any & (stage | controlled.on_bogies)
    )
    tolerance = TOLERANCE if stage is None else ACCEPTED
    running, left, ends = _searched(given, start, nearby, acts, tolerance)
    if left.size:
        raise StateError(_reasons(given, running, left))
    return running, ends


def _given(
    conditions: ContactConditions,
    controlled: Controlled,
    bodies: tuple[Wheelset, Counterface],
    models: ContactModels,
    threads: int,
) -> _Given:
    """Return inputs of a search; shifts by force are those at the rails."""
    guidance = controlled.guidance(conditions)
    moves = guidance.free[:, 0]
    if moves.any():
        depth = (
            np.zeros(moves.size)
            if conditions.shift_depth is None
            else conditions.shift_depth
        )
        conditions = replace(
            conditions, shift_depth=np.where(moves, bodies[0].radius, depth)
        )
    return _Given(conditions, controlled, guidance, *bodies, models, threads)


def _searched(
    given: _Given,
    start: Running | None,
    nearby: Equilibria | None,
    acts: NDArray[np.bool_],
    tolerance: float,
) -> tuple[Running, IntArray, Guided]:
    """Search the balance of points (n,) that act; as `_settled`.

    Of equal points, and mirror images, one is searched and the others are copied; where
    it has no balance each of them is searched.
    """
    images = _images(given, np.flatnonzero(acts))
    searched = acts & ~images.copied
    running, left, ends = _searched_alone(given, start, nearby, searched, tolerance)
    copies = np.flatnonzero(images.copied)
    if not copies.size:
        return running, left, ends
    of_lost = np.isin(images.source[copies], left)
    lost, copies = copies[of_lost], copies[~of_lost]
    balances = copied_balances(ends.at(images.source[copies]), images.mirrored[copies])
    running = _running_at(running, copies, balances)
    ends = ends.replaced(copies, balances)
    if not lost.size:
        return running, left, ends
    searched = np.isin(np.arange(acts.size), lost)
    running, more, others = _searched_alone(given, running, nearby, searched, tolerance)
    return running, np.union1d(left, more), ends.replaced(lost, others.at(lost))


def _images(given: _Given, rows: IntArray) -> Images:
    """Find those of the points `rows` (k,) that are copies of others of them.

    Where forces guide a wheelset its shift and yaw follow from them. Both axles of a
    bogie are copies of those of one other bogie.
    """
    controlled, free = given.controlled, given.guidance.free
    count = controlled.lateral_force.size
    conditions = replace(
        given.conditions,
        shift=np.where(free[:, 0], 0.0, given.conditions.shift),
        yaw=np.where(free[:, 1], 0.0, given.conditions.yaw),
    )
    force = controlled.lateral_force
    acceleration, axle, in_front = np.zeros((3, count))
    symmetric = is_symmetric(given.wheelset, given.counterface)
    if (bogies := controlled.bogies) is not None:
        symmetric &= bogies.vehicle.axle_yaw_offset == 0.0
        axle[bogies.leading], axle[bogies.trailing] = 1.0, 2.0
        for ends in (bogies.leading, bogies.trailing):
            acceleration[ends], in_front[ends] = bogies.acceleration, bogies.in_front
    images = images_of(
        conditions.at(rows),
        symmetric,
        even=[values[rows] for values in (axle, in_front, np.isfinite(force))],
        odd=[values[rows] for values in (acceleration, np.nan_to_num(force))],
    ).among(rows, count)
    source, mirrored = images.source, images.mirrored
    partner = given.guidance.partner
    together = source[partner] == partner[source]
    together &= mirrored[partner] == mirrored
    return Images(np.where(together, source, np.arange(count)), mirrored & together)


def _searched_alone(
    given: _Given,
    start: Running | None,
    nearby: Equilibria | None,
    acts: NDArray[np.bool_],
    tolerance: float,
) -> tuple[Running, IntArray, Guided]:
    """Search the balance of points (n,) that act, each by itself; as `_settled`.

    A point that no search balances runs where its residual was smallest, up to
    `AT_JUMP`: contact forces scatter, and less is known of the forces on a wheelset.
    """
    middle = _in_the_middle(given)
    running = middle if start is None else _where_it_ran(start, given, middle)
    left, ends = np.flatnonzero(acts), none_guided(acts.size)
    if nearby is not None:
        running, left, ends = _settled(
            given, running, left, tolerance, ends, nearby=nearby
        )
    if start is not None:
        running, left, ends = _settled(given, running, left, tolerance, ends, near=True)
        running = running.replaced(left, middle)
    running, left, ends = _settled(given, running, left, tolerance, ends)
    # A wheelset without stiffness there climbs the flange.
    runs = (ends.residual <= AT_JUMP) & ~_without_stiffness(ends, given.guidance)
    done = left[runs[left]]
    return _running_at(running, done, ends.at(done)), np.setdiff1d(left, done), ends


@dataclass(frozen=True)
class _Given:
    """Arguments of `settle` with the depth of the shifts in the solution."""

    conditions: ContactConditions
    controlled: Controlled
    guidance: Guidance  # controlled forces as guiding forces
    wheelset: Wheelset
    counterface: Counterface
    models: ContactModels
    threads: int


def _in_the_middle(given: _Given) -> Running:
    """Wheelsets at the track centre where forces are prescribed, else as given."""
    conditions = given.conditions
    shift = np.where(given.guidance.free[:, 0], 0.0, conditions.shift)
    zeros = np.zeros(shift.size)
    still = Running(shift, zeros, conditions.yaw, zeros)
    if conditions.shift_depth is None:
        return still
    return replace(still, shift_depth=conditions.shift_depth, roll=conditions.roll)


def _where_it_ran(start: Running, given: _Given, middle: Running) -> Running:
    """Wheelsets at their previous position where forces control it, else as given."""
    guidance = given.guidance
    ran = replace(
        middle,
        shift=np.where(guidance.free[:, 0], start.shift, middle.shift),
        yaw=np.where(guidance.free[:, 1], start.yaw, middle.yaw),
        stiffness=np.where(guidance.free[:, 0], start.stiffness, 0.0),
        residual=np.where(guidance.free[:, 0], start.residual, 0.0),
        beyond=start.beyond,
    )
    return replace(ran, roll=start.roll) if start.roll.size and ran.roll.size else ran


def _settled(
    given: _Given,
    begin: Running,
    rows: IntArray,
    tolerance: float,
    ends: Guided,
    *,
    near: bool = False,
    nearby: Equilibria | None = None,
) -> tuple[Running, IntArray, Guided]:
    """Solve the balance of forces of points `rows` (k,).

    With `nearby`, only the points that it contains are solved.

    Returns
    -------
    Running, IntArray, Guided
        Where all points run; those of `rows` that have no balance; ends of the searches
        of all points, those of the smallest residuals where there are several.
    """
    to_solve = rows if nearby is None else rows[nearby.of_guided[rows]]
    if not to_solve.size:
        return begin, rows, ends
    guidance = given.guidance.at(to_solve)
    conditions = begin.conditions(given.conditions).at(to_solve)
    start = None if nearby is None else nearby.at(to_solve)
    balance = _found(given, conditions, guidance, tolerance, near, start)
    accepted = _accepted(balance, guidance)
    done = to_solve[accepted]
    nearest = accepted | ~(balance.residual >= ends.residual[to_solve])
    return (
        _running_at(begin, done, balance.at(np.flatnonzero(accepted))),
        np.setdiff1d(rows, done),
        ends.replaced(to_solve[nearest], balance.at(np.flatnonzero(nearest))),
    )


def _accepted(balance: Guided, guidance: Guidance) -> NDArray[np.bool_]:
    """Return True for wheelsets (n,) that balance their forces, with their partners."""
    most = np.where(balance.in_place, AT_JUMP, ACCEPTED)
    accepted = np.asarray(balance.residual <= most)
    return accepted & accepted[guidance.partner]


def _without_stiffness(balance: Guided, guidance: Guidance) -> NDArray[np.bool_]:
    """Return True for wheelsets (n,) under a lateral force alone that no force centres.

    The lateral force of the contact does not rise with their shift.
    """
    alone = guidance.free[:, 0] & ~guidance.free[:, 1]
    return np.asarray(alone & (balance.stiffness <= 0.0))


def _found(
    given: _Given,
    conditions: ContactConditions,
    guidance: Guidance,
    tolerance: float,
    near: bool,
    nearby: Equilibria | None,
) -> Guided:
    """Search the balance of some points.

    A point at an unstable balance is pushed away from it.
    """
    bodies = given.wheelset, given.counterface, given.models
    balance = solve_guided(
        conditions,
        guidance,
        *bodies,
        tolerance,
        near=near,
        nearby=nearby,
        threads=given.threads,
    )
    doubtful = np.flatnonzero(
        _without_stiffness(balance, guidance) & np.isfinite(balance.residual)
    )
    if not doubtful.size:
        return balance
    doubtful_guidance = guidance.at(doubtful)
    # slopes by differences decide if the balance is unstable
    start = Equilibria.found(
        balance.unknown[doubtful], np.full((doubtful.size, UNKNOWNS, UNKNOWNS), np.nan)
    )
    judged = solve_guided(
        conditions.at(doubtful),
        doubtful_guidance,
        *bodies,
        tolerance,
        nearby=start,
        threads=given.threads,
    )
    balance = balance.replaced(doubtful, judged)
    unstable = np.flatnonzero(judged.stiffness <= 0.0)
    if not unstable.size:
        return balance
    pushed, pushed_guidance = doubtful[unstable], doubtful_guidance.at(unstable)
    push = np.where(pushed_guidance.force[:, 0] < 0.0, -_PUSH, _PUSH)
    off = replace(conditions.at(pushed), shift=judged.shift[unstable] + push)
    again = solve_guided(
        off, pushed_guidance, *bodies, tolerance, threads=given.threads
    )
    better = np.flatnonzero(_accepted(again, pushed_guidance))
    return balance.replaced(pushed[better], again.at(better))


def _running_at(begin: Running, rows: IntArray, balance: Guided) -> Running:
    """Return the running states, with those of points `rows` (k,) replaced."""
    share = balance.share
    at_jump = np.isfinite(share)
    other_alone = at_jump & (share > 1.0 - _LEAST_SHARE)
    two = at_jump & ~other_alone & (share >= _LEAST_SHARE)
    # the main state is the one further left
    swapped = two & (balance.other_shift < balance.shift)
    main = other_alone | swapped
    running = begin.moved(
        rows,
        shift=np.where(main, balance.other_shift, balance.shift),
        stiffness=balance.stiffness,
        yaw=balance.yaw,
        residual=balance.residual,
        roll=balance.roll,
    )
    if not two.any():
        return running
    past = BeyondJump(
        rows[two],
        np.where(swapped, balance.shift, balance.other_shift)[two],
        np.where(swapped, 1.0 - share, share)[two],
    )
    if running.beyond is not None:
        points = np.concatenate([running.beyond.point, past.point])
        past = joined([running.beyond, past], np.argsort(points, kind="stable"))
    return replace(running, beyond=past)


def _with(values: FloatArray, rows: IntArray, new: FloatArray) -> FloatArray:
    """Return a copy of values (n, ...) with new ones (k, ...) at `rows` (k,)."""
    copy = values.copy()
    copy[rows] = new
    return copy


def _reasons(given: _Given, running: Running, rows: IntArray) -> dict[int, str]:
    """State why points `rows` (k,) have no balance, by their number."""
    controlled, messages = given.controlled, dict[int, str]()
    forced = np.isfinite(controlled.lateral_force)
    bogies = controlled.bogies
    for row in rows.tolist():
        if torque := _beyond_crest(given, running, row):
            messages[row] = torque
        elif forced[row]:
            messages[row] = _why_no_shift(given, running, row)
        elif bogies is None or row not in bogies.points:
            messages[row] = _UNSETTLED
        elif row in bogies.leading:
            messages[row] = (
                "no equilibrium of the bogie in the curve of "
                f"{1.0 / given.conditions.track_curvature[row]:.4g} m was found"
            )
    return messages


def _beyond_crest(given: _Given, running: Running, row: int) -> str:
    """Fault of a torque beyond the crest of the creep forces, or ""."""
    if not (given.models.friction_falls and given.conditions.rotates_freely):
        return ""
    conditions = running.conditions(given.conditions).at(np.array([row]))
    bodies = given.wheelset, given.counterface
    try:
        solve_each(conditions, *bodies, given.models, lambda part: part, fields="work")
    except CrestError as error:
        return str(error)
    except ContactError:
        return ""
    return ""


def _why_no_shift(given: _Given, running: Running, row: int) -> str:
    """Reason why a lateral force has no balance.

    The largest force it states is that under equal wheel loads.
    """
    lateral_force = float(given.controlled.lateral_force[row])
    many = np.full(_STRIDES, row)
    conditions = running.conditions(given.conditions).at(many)
    middle = _in_the_middle(given)
    direction = 1.0 if lateral_force >= 0.0 else -1.0
    shift = middle.shift[row] + direction * _STRIDE * np.arange(_STRIDES)
    conditions = replace(conditions, shift=shift, box_moment=None)
    failed: dict[int, ContactError] = {}
    patches = solve_each(
        conditions,
        given.wheelset,
        given.counterface,
        given.models,
        ContactSolution.patches,
        threads=given.threads,
        failed=failed,
        fields="work",
    )
    end = min(failed, default=_STRIDES)
    if end == 0:
        return _UNSETTLED
    forces = resultants(joined(patches), _STRIDES)
    largest = float((-direction * forces.force[:end]).max())
    unloaded = _unloaded_by(forces, given.guidance.at(np.array([row])))
    if unloaded is not None and not largest < abs(lateral_force) < abs(unloaded[1]):
        wheel, most = unloaded
        if most == 0.0:
            return (
                f"the vertical forces on the axle boxes unload the {wheel} wheel "
                "already without a lateral force; make them more alike"
            )
        return (
            f"the moment of the lateral force about the rails unloads the {wheel} "
            f"wheel: the axle carries at most {1e-3 * most:.4g} kN"
        )
    if largest < abs(lateral_force):
        return (
            f"the flange carries a lateral force of at most {1e-3 * largest:.4g} kN: "
            "the wheel would climb over its crest"
        )
    return _UNSETTLED


def _unloaded_by(forces: Resultants, guidance: Guidance) -> tuple[str, float] | None:
    """Wheel that the lateral force unloads, and the largest force.

    The levers are those of the first position. The force is 0 if the wheel has no load
    without it. None if no wheel is unloaded or the wheel loads are given.
    """
    if np.isfinite(guidance.wheel_load).all():
        return None
    lateral_force, height = guidance.force[:, 0], forces.height[:1]
    held = forces.roll_moment[:1] - height * forces.lateral[:1]
    loaded, unloaded = (
        replace(guidance, box_moment=guidance.box_moment + height * force).wheel_loads(
            forces.vertical[:1], held
        )[0]
        for force in (lateral_force, 0.0)
    )
    wheel = int(np.argmin(loaded))
    side, least = ("right", "left")[wheel], LEAST_LOAD * guidance.axle_load[0]
    if loaded[wheel] > least:
        return None
    if unloaded[wheel] <= least:
        return side, 0.0
    largest = lateral_force[0] * unloaded[wheel] / (unloaded[wheel] - loaded[wheel])
    return side, float(largest)
