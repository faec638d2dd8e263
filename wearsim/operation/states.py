r"""Where a wheelset runs under given forces: shift and wheel loads from the balance of one wheelset.

With the lateral force H at axle height and the axle load W, of which the boxes carry the moment
:math:`B = (V_R - V_L) b` about the longitudinal axis,

.. math::
    -H_c(y) = H, \qquad \sum Q_p = W, \qquad \sum (y_p Q_p + z_p T_p) = B

(`wearsim.operation.resultants`). The force over the shift is flat on the tread and not monotonic, so that up
to five shifts belong to one force: the branch is part of the state. The wheelset moves from where it was, at
first from the middle of the track or from where the fast models let it run, in the direction of the force
that is missing, and stays at the first shift that balances it with dH/dy > 0.

Where the contact moves on a worn flank, or a second patch closes, the force may jump past the one wanted
within a micrometre, or past shifts without contact solution, so that no shift balances it. The wheelset then
runs at both sides of the jump in turn, in shares of the distance whose mean force is the one wanted. So does
its limit under ever shorter steps of wear: each side wears towards the other (a sliding mode, [1]_).

Contact is solved anew in each trial: begun from that of the trial before it would stay on its branch, and the
force at a shift would hang on the way there.

References
----------
.. [1] A. F. Filippov, Differential Equations with Discontinuous Righthand Sides, Kluwer 1988,
   doi:10.1007/978-94-015-7793-9.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import (
    ContactConditions,
    ContactModels,
    Counterface,
    Wheelset,
)
from wearsim.errors import ContactError, say
from wearsim.operation import curving
from wearsim.operation.bogie import Bogies
from wearsim.operation.curving import ACCEPTED, TOLERANCE
from wearsim.operation.search import Controlled, Search

_STRIDE, _STRIDES, _FURTHEST = 0.25e-3, 8, 16e-3  # of the walk [m]; strides solved together
_LONGEST = 0.5e-3  # step of the shift [m]
_STIFFEST, _GENTLE = 1e9, 1e4  # dH/dy that steps are taken with [N/m]
_FALL = 0.5  # of the force missing, by which steps along its slope go on
_GROWTH = 4.0  # of steps along which it does not fall so
_MOST_TRIALS = 60
_JUMP = 1e-6  # widest bracket in which the force jumps: it changes by more than `_STIFFEST` explains [m]
_JUMP_IN_STAGE = 4e-6  # the same in a stage, whose places are not kept [m]
_NARROWEST = 1e-8  # bracket: what is missing at its ends is taken for a jump [m]
_LOADS_OFF = 2e-3  # of loads, over the axle load, beyond which the force does not say where to go
_PROMISING = 1e-3  # over the axle load: what may be missing before the last step in a stage
_SMALL_STEP = 10e-6  # length of that step [m]
_MOST_UNSOLVED = 6  # trials without contact in one direction
_MOST_STAYS = 3  # at a shift with other loads
_LEAST_SHARE = 1e-3  # of the distance on one side of a jump: with less an axle runs on the other one alone
_LEAST_LOAD = 0.02  # of a wheel, over the axle load: below it is unloaded


@dataclass(frozen=True)
class BeyondJump:
    """Where `k` points run for a share of their distance: past a jump of the lateral force, further right."""

    point: IntArray  # (k,)
    shift: FloatArray  # (k,) [m]
    load: FloatArray  # (k, 2) [N]
    share: FloatArray  # (k,) of the distance of the point, between 0 and 1 [-]
    gap: FloatArray  # (k,) between the lateral forces at both shifts [N]


@dataclass(frozen=True)
class Running:
    """Where the wheelset runs at `n` operating points: the state that the next one starts from."""

    shift: FloatArray  # (n,) [m]
    load: FloatArray  # (n, 2) of the right and the left wheel [N]
    stiffness: FloatArray  # (n,) dH/dy where it runs; 0 where the shift is given [N/m]
    yaw: FloatArray  # (n,) [rad]
    beyond: BeyondJump | None = None  # of points that run at two shifts
    # (n,) depth of `ContactConditions` [m], and roll of the wheelsets of bogies [rad]; empty: at the axle
    shift_depth: FloatArray = field(default_factory=lambda: np.zeros(0))
    roll: FloatArray = field(default_factory=lambda: np.zeros(0))
    rate: FloatArray = field(default_factory=lambda: np.zeros(0))  # (n,) of the shift over the distance [-]
    distance: float = 0.0  # at which it ran there [m]

    def at(self, distance: float) -> Running:
        """Where the wheelset is expected to run at another distance."""
        if not self.rate.size:
            return self
        moved, beyond = np.clip(self.rate * (distance - self.distance), -_LONGEST, _LONGEST), self.beyond
        if beyond is not None:
            beyond = replace(beyond, shift=beyond.shift + moved[beyond.point])
        return replace(self, shift=self.shift + moved, beyond=beyond)

    def conditions(self, conditions: ContactConditions) -> ContactConditions:
        """Contact conditions of the `n` points where the wheelset runs."""
        alike = conditions.wheel_load.ndim == 1 and bool((self.load == conditions.loads).all())
        load = conditions.wheel_load if alike else self.load
        found = replace(conditions, shift=self.shift, yaw=self.yaw, wheel_load=load)
        if not self.shift_depth.size:
            return found
        return replace(found, shift_depth=self.shift_depth, roll=self.roll)


class StateError(ContactError):
    """No state carries the forces of some points; `messages` says why, by their number."""

    def __init__(self, messages: dict[int, str]) -> None:
        self.messages = messages
        self.bodies: tuple[Wheelset, Counterface] | None = None  # of a campaign, that were in contact
        super().__init__("; ".join(f"point {k}: {text}" for k, text in messages.items()))


def settle(
    conditions: ContactConditions,
    controlled: Controlled,
    wheelset: Wheelset,
    counterface: Counterface,
    models: ContactModels,
    start: Running | None = None,
    *,
    stage: NDArray[np.bool_] | None = None,
    threads: int = 1,
) -> Running:
    """Shift and wheel loads at which the controlled forces are balanced.

    Parameters
    ----------
    conditions : ContactConditions
        Of n points, free to roll where something is controlled; shifts and wheel loads that follow from
        forces are without effect.
    controlled : Controlled
        Forces and what they replace.
    wheelset, counterface, models
        As in `wearsim.contact.solve.solve`.
    start : Running, optional
        Where the wheelset ran before; by default in the middle of the track.
    stage : (n,) bool array, optional
        Points that act in a stage of a wear step: only they move, and all bogies, and by a last step of up to
        10 um without solution where at most 1e-3 of the axle load were missing.
    threads : int
        Of the contact solver; their number does not change the bits.

    Returns
    -------
    Running
        The shifts and wheel loads found; those that are given are as given.

    Raises
    ------
    StateError
        If no state carries the forces: the crest of the flange is reached or a wheel is unloaded.
    """
    count = conditions.shift.size
    load = conditions.loads.copy()
    if start is None:
        half = 0.5 * controlled.axle_load[:, None]
        half = np.where(np.isfinite(controlled.axle_load)[:, None], half, load)
        start = Running(np.zeros(count), half, np.zeros(count), conditions.yaw)
    forced, loaded = np.isfinite(controlled.lateral_force), np.isfinite(controlled.axle_load)
    depth = conditions.shift_depth
    if controlled.bogies is not None:
        depth = np.zeros(count) if depth is None else depth.copy()
        depth[controlled.bogies.points] = wheelset.radius
        conditions = replace(conditions, shift_depth=depth)
    search = Search(
        conditions, controlled, wheelset, counterface, models, threads,
        np.where(forced, start.shift, conditions.shift), conditions.yaw.copy(), conditions.roll.copy(),
        np.where(loaded[:, None], start.load, load), np.where(forced, start.stiffness, 0.0),
        np.full((count, 5), np.nan),
    )  # fmt: skip
    if (two := start.beyond) is not None:
        search.beyond[two.point] = np.column_stack([two.shift, two.load, two.share, two.gap])
    alone = controlled.any
    if controlled.bogies is not None:
        axles = controlled.bogies.points
        alone = alone & ~np.isin(np.arange(count), axles)
        ran = bool((start.stiffness[axles] > 0.0).all())
        _curved(search, controlled.bogies, start if ran else None, stage is not None)
    rows = np.flatnonzero(alone if stage is None else alone & stage)
    known = ~forced[rows] | (search.stiffness[rows] > 0.0)
    rest = np.sort(np.append(_corrected(search, rows[known], stage is not None), rows[~known]))
    if rest.size:
        _walked(search, rest[forced[rest]])
        rest = _corrected(search, rest, stage is not None)
    if rest.size:
        raise StateError(dict.fromkeys(rest.tolist(), say("state.unsettled")))
    at = np.flatnonzero(np.isfinite(search.beyond[:, 0]))
    past = search.beyond[at]
    beyond = BeyondJump(at, past[:, 0], past[:, 1:3], *past[:, 3:].T) if at.size else None
    if depth is None:
        return Running(search.shift, search.load, search.stiffness, search.yaw, beyond)
    return Running(search.shift, search.load, search.stiffness, search.yaw, beyond, depth, search.roll)


def _curved(search: Search, bogies: Bogies, start: Running | None, stage: bool) -> None:
    """Balance all bogies, in place, from where they ran before if they did.

    In a `stage` of a wear step to a coarser tolerance, and from where they ran alone: there a shorter step
    costs less.

    Raises
    ------
    StateError
        For the points of bogies without balance.
    """
    axles = np.stack([bogies.leading, bogies.trailing], axis=1)
    search.beyond[axles] = np.nan
    tolerance = curving.ACCEPTED if stage else curving.TOLERANCE
    at_jump = curving.IN_STAGES_AT_JUMP if stage else curving.ACCEPTED
    if start is None:
        before = found = curving.continued(search, bogies, tolerance)
    else:
        before = _where_it_ran(search, bogies, start)
        found = curving.balanced(search, bogies, before, tolerance, at_jump)
    left = np.flatnonzero(found.size > found.tolerance(curving.ACCEPTED, at_jump))
    if left.size:
        around = curving.balanced_from_around(search, bogies.at(left), before.at(left), tolerance, at_jump)
        found = found.improved(left, around)
    left = np.flatnonzero(~found.accepted)
    if left.size and start is not None and not stage:
        anew = curving.continued(search, bogies.at(left), tolerance)
        found = found.improved(left, anew)
    right = found.state[:, :, 2]
    search.shift[axles], search.yaw[axles] = found.state[:, :, 0], found.state[:, :, 1]
    assert search.conditions.shift_depth is not None
    search.roll[axles] = np.arcsin(found.contact[:, :, 3] / search.conditions.shift_depth[axles])
    search.load[axles] = np.stack([right, bogies.vehicle.axle_load - right], axis=2)
    search.stiffness[axles] = 1.0  # found: the next search starts here
    share = np.where(found.on_jump, found.share, 0.5)
    side = np.where(share < _LEAST_SHARE, -0.5, np.where(share > 1.0 - _LEAST_SHARE, 0.5, 0.0))
    search.shift[axles] += np.where(found.on_jump, side * curving.WIDTH, 0.0)
    jumps = found.on_jump & (side == 0.0)
    two_sided = axles[jumps]
    gap = np.abs(found.jump[jumps, 0])
    search.shift[two_sided] -= 0.5 * curving.WIDTH
    right = search.shift[two_sided] + curving.WIDTH
    search.beyond[two_sided] = np.column_stack([right, search.load[two_sided], share[jumps], gap])
    left = np.flatnonzero(~found.accepted)
    if left.size:
        curvature = search.conditions.track_curvature
        lost = bogies.leading[left].tolist()
        raise StateError({point: say("state.no_curving", radius=1.0 / curvature[point]) for point in lost})


def _where_it_ran(search: Search, bogies: Bogies, start: Running) -> curving.Balance:
    """Bogies where they ran before, on the jumps of the contact they were on if those are still there."""
    axles = np.stack([bogies.leading, bogies.trailing], axis=1)
    state = np.stack([start.shift[axles], start.yaw[axles], start.load[axles, 0]], axis=2)
    share = np.full(search.shift.size, np.nan)
    if start.beyond is not None:
        share[start.beyond.point] = start.beyond.share
    state[:, :, 0] += np.where(np.isfinite(share[axles]), 0.5 * curving.WIDTH, 0.0)
    return curving.evaluated_nearby(search, bogies, state, share[axles])


class _Trial(NamedTuple):
    """Contact solved at a shift under loads, and what is missing there."""

    shift: float  # [m]
    load: FloatArray  # (2,) [N]
    off: float  # lateral force beyond the one wanted, 0 where none is [N]
    levers: FloatArray  # (2,) loads that balance the roll [N]
    solved: bool

    @property
    def loads_off(self) -> float:
        """What the loads are off, over the axle load."""
        return float(abs(self.levers[0] - self.load[0]) / self.levers.sum())

    @property
    def missing(self) -> float:
        """Lateral force or load that is off, whichever is more, over the axle load."""
        return max(float(abs(self.off) / self.levers.sum()), self.loads_off) if self.solved else np.inf


@dataclass
class _Course:
    """One point on its way to balance."""

    forced: bool  # whether its shift follows from a force
    stiffness: float  # slope of the force seen last [N/m]
    beyond: FloatArray  # (3,) shift and loads past a jump where it ran before; NaN: there was none
    widest: float  # bracket that is taken for a jump [m]
    left: _Trial | None = None  # latest one with less force than wanted
    right: _Trial | None = None  # latest one with more
    last: _Trial | None = None  # at the shift before
    best: _Trial | None = None
    step: float = 0.0  # from the shift before [m]
    stays: int = 0  # at a shift, with other loads
    hole: list[float] = field(default_factory=list)  # shifts without contact [m]
    turned: float = 0.0  # correction of the loads before, at the same shift [N]
    halved: bool = True  # the shifts between left and right, rather than interpolated

    def next(self, here: _Trial) -> tuple[float, FloatArray] | None:
        """Shift and loads of the trial after `here`; None where contact has no solution any more."""
        if not here.solved:
            return self._around(here)
        if self.best is None or here.missing < self.best.missing:
            self.best = here
        turn = float(here.levers[0] - here.load[0])
        swings = turn * self.turned < -0.5 * self.turned**2  # about a jump of the levers
        self.turned = turn
        if not self.forced or (here.loads_off > _LOADS_OFF and self.stays < _MOST_STAYS):
            self.stays += 1
            return here.shift, 0.5 * (here.load + here.levers) if swings else here.levers
        self.stays, self.turned = 0, 0.0
        return self._beside(here)

    def _around(self, here: _Trial) -> tuple[float, FloatArray] | None:
        """Next shift and loads where contact has no solution: nearer to one with it, or on past a gap."""
        self.hole.append(here.shift)
        if self.left is not None and self.right is not None:
            return self._between(self.left, self.right, halved=True)
        if not self.forced or len(self.hole) > _MOST_UNSOLVED:
            return None
        if self.step == 0.0:  # towards the middle of the track
            self.step = -np.sign(here.shift) * _JUMP / _GROWTH
        self.step = float(np.clip(_GROWTH * self.step, -_LONGEST, _LONGEST))
        return here.shift + self.step, here.load

    def _beside(self, here: _Trial) -> tuple[float, FloatArray]:
        """Next shift, from a trial to the left or to the right of the one sought, and loads."""
        rising, last, self.last = self.seen(here), self.last, here
        falls = last is not None and abs(here.off) <= _FALL * abs(last.off)
        if here.off < 0.0:
            self.left = here
        else:
            self.right = here
        if self.left is not None and self.right is not None:
            self.halved = not (self.halved or falls)
            return self._between(self.left, self.right, self.halved)
        width = float(self.beyond[0]) - here.shift  # of a jump known before
        if last is None and width > 0.0:
            if here.off < 0.0:  # to its other side
                self.step = width
                return float(self.beyond[0]), self.beyond[1:]
            self.step = -width
        elif last is None or (rising and falls):
            self.step = -here.off / self.stiffness
        else:
            self.step *= _GROWTH
        self.step = float(np.clip(self.step, -_LONGEST, _LONGEST))
        load = here.levers
        if last is not None and here.shift != last.shift:
            load = load + (load - last.levers) * self.step / (here.shift - last.shift)
        return here.shift + self.step, load

    def _between(self, left: _Trial, right: _Trial, halved: bool) -> tuple[float, FloatArray]:
        """Next shift and loads between two: at an edge of the gap without contact if there is one."""
        if gap := self._gap:
            near, edge = (left, gap[0]) if gap[0] - left.shift > right.shift - gap[1] else (right, gap[1])
            return 0.5 * (near.shift + edge), near.levers
        share = 0.5 if halved else left.off / (left.off - right.off)
        load = left.levers + share * (right.levers - left.levers)
        return left.shift + share * (right.shift - left.shift), load

    @property
    def _gap(self) -> tuple[float, float] | None:
        """Outermost shifts without contact between both ends."""
        if self.left is None or self.right is None:
            return None
        inside = [shift for shift in self.hole if self.left.shift < shift < self.right.shift]
        return (min(inside), max(inside)) if inside else None

    def seen(self, here: _Trial) -> bool:
        """Note the slope of the force since the shift before; whether it rises."""
        if self.last is None or here.shift == self.last.shift:
            return False
        slope = (here.off - self.last.off) / (here.shift - self.last.shift)
        if slope > _GENTLE:
            self.stiffness = min(slope, _STIFFEST)
        return slope > _GENTLE

    def may_end(self, here: _Trial) -> bool:
        """Whether the step after a trial is short enough not to be looked at, in a stage."""
        free = not np.isfinite(self.beyond[0]) and (self.left is None or self.right is None)
        return free and here.missing <= _PROMISING and abs(self.step) <= _SMALL_STEP

    @property
    def jump(self) -> tuple[_Trial, _Trial] | None:
        """Both sides of a jump of the force past the one wanted, or of a gap without contact."""
        if self.left is None or self.right is None:
            return None
        width, gap = self.right.shift - self.left.shift, self.right.off - self.left.off
        found = width <= _NARROWEST or (width <= self.widest and gap > _STIFFEST * width)
        if hole := self._gap:
            found |= max(hole[0] - self.left.shift, self.right.shift - hole[1]) <= self.widest
        return (self.left, self.right) if found else None


def _corrected(search: Search, rows: IntArray, stage: bool) -> IntArray:
    """Find shifts and loads that balance what is controlled, in place; return the rows that have none.

    Wheel loads follow their levers. The shift goes in the direction of the force that is missing: along the
    slope seen last as long as that halves what is missing, else in growing steps, which pass where the force
    falls. Once the force wanted lies between those at two shifts, interpolation and bisection in turn close
    in on it, or on a jump past it, of which both sides are taken. Rows that do not come to the tolerance take
    the best place seen if it is accepted. In a `stage` a short last step is not looked at, and jumps
    are found within a wider bracket.
    """
    wanted = search.controlled.lateral_force
    slope = np.clip(search.stiffness, _GENTLE, _STIFFEST)
    widest = _JUMP_IN_STAGE if stage else _JUMP
    courses = {
        row: _Course(bool(np.isfinite(wanted[row])), slope[row], search.beyond[row, :3].copy(), widest)
        for row in rows.tolist()
    }
    search.beyond[rows] = np.nan
    start, lost = search.shift.copy(), list[int]()
    for _ in range(_MOST_TRIALS):
        if not rows.size:
            break
        shift, load = search.shift[rows], search.load[rows]
        forces, solved = search.solve(rows, shift, load)
        off = np.where(np.isfinite(wanted[rows]), -forces.force - wanted[rows], 0.0)
        levers = search.loads(rows, forces, load)
        levers = np.maximum(levers, _LEAST_LOAD * levers.sum(axis=1, keepdims=True))
        left = []
        for k, row in enumerate(rows.tolist()):
            course, here = courses[row], _Trial(shift[k], load[k], off[k], levers[k], bool(solved[k]))
            if here.missing <= TOLERANCE:
                course.seen(here)
                continue
            ahead = course.next(here)
            if ahead is None:
                lost.append(row)
            elif course.jump is not None:
                _both_sides(search, row, *course.jump)
            else:
                search.shift[row], search.load[row] = ahead
                if not (stage and course.may_end(here)):
                    left.append(row)
        rows = np.array(left, dtype=np.int64)
    for row in rows.tolist():
        best = courses[row].best
        if best is None or best.missing > ACCEPTED:
            lost.append(row)
            continue
        search.shift[row], search.load[row] = best.shift, best.load
    for row, course in courses.items():
        if course.forced:
            search.stiffness[row] = course.stiffness
    search.shift[lost] = start[lost]
    return np.array(lost, dtype=np.int64)


def _both_sides(search: Search, row: int, left: _Trial, right: _Trial) -> None:
    """Let a point run on both sides of a jump, in shares whose mean force is the one wanted."""
    gap = right.off - left.off
    search.shift[row], search.load[row] = left.shift, left.load
    search.beyond[row] = [right.shift, *right.load, -left.off / gap, gap]


def _walked(search: Search, rows: IntArray) -> None:
    """Walk to within half a stride of the first stable balance of the lateral force, in place.

    Raises
    ------
    StateError
        With the largest force of the points whose flange does not carry theirs.
    """
    if not rows.size:
        return
    count, messages = search.shift.size, dict[int, str]()
    start, load = search.shift[rows], search.load[rows]
    for _ in range(3):  # levers where it starts
        forces, solved = search.solve(rows, start, load, coarse=True)
        with_force, without = (search.loads(rows, forces, load, share) for share in (1.0, 0.0))
        least = _LEAST_LOAD * with_force.sum(axis=1, keepdims=True)
        load = np.where(solved[:, None], np.maximum(with_force, least), load)
    search.load[rows] = load
    wanted = search.controlled.lateral_force[rows]
    direction = np.where(wanted >= -forces.force, 1.0, -1.0)
    way, most = np.zeros(count), np.full(count, -np.inf)
    way[rows], at, force = direction, start.copy(), -forces.force
    open_rows = rows.copy()
    while open_rows.size:
        own = np.isin(rows, open_rows)
        far = at[own][:, None] + way[open_rows][:, None] * _STRIDE * np.arange(1, _STRIDES + 1)
        many = np.repeat(open_rows, _STRIDES)
        forces, solved = search.solve(many, far.ravel(), search.load[many], coarse=True)
        reached = (-forces.force).reshape(far.shape)
        ahead = np.where(solved.reshape(far.shape), way[open_rows][:, None] * reached, np.nan)
        goal = way[open_rows] * search.controlled.lateral_force[open_rows]
        left = []
        for j, row in enumerate(open_rows):
            fine = np.isfinite(ahead[j])
            end = int(np.argmin(fine)) if not fine.all() else _STRIDES
            passed = np.flatnonzero(ahead[j, :end] >= goal[j])
            most[row] = max(most[row], way[row] * force[np.searchsorted(rows, row)], *ahead[j, :end])
            if passed.size:
                search.shift[row] = far[j, passed[0]] - 0.5 * way[row] * _STRIDE
                ends = np.append(way[row] * force[np.searchsorted(rows, row)], ahead[j])[passed[0] :][:2]
                search.stiffness[row] = (ends[1] - ends[0]) / _STRIDE
            elif end < _STRIDES or abs(far[j, -1]) > _FURTHEST:
                messages[int(row)] = say("state.flange", most=way[row] * most[row])
            else:
                left.append(row)
        last = np.searchsorted(rows, open_rows)
        at[last], force[last] = far[:, -1], reached[:, -1]
        open_rows = np.array(left, dtype=np.int64)
    for j in np.flatnonzero((with_force <= least).any(axis=1)).tolist():
        wheel = int(np.argmin(with_force[j]))
        largest = wanted[j] * without[j, wheel] / (without[j, wheel] - with_force[j, wheel])
        side = ("right", "left")[wheel]
        messages[int(rows[j])] = say("state.unloaded", side=side, largest=largest)
    if messages:
        raise StateError(messages)
