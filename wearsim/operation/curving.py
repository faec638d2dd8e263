r"""Lateral position and yaw of the axles of a bogie in a curve, from its quasi-static balance.

Unknowns of each axle are its lateral shift at the height of the rails, its yaw and the load of its right
wheel; the shift of the axle itself, which the suspension sees, follows with the roll. Residuals are the
lateral force and the yaw moment of contact and suspension (`wearsim.operation.bogie.suspension`), and the
right wheel load at which the axle does not roll, less the load itself. All six of a bogie are solved
together by Newton's method. Every contact is solved anew, so that the forces of a state do not depend on
the way to it. Slopes are differences; they are kept while a step halves the error. Steps are halved until
the error falls, measured by the residual or by the next step under the same slopes (the natural
monotonicity test of [1]_), as the residual alone leads along curved valleys in short steps where a flange
is a hundred times as stiff as the tread.

The roll of the axle moves its wheels sideways. On a flank of more than 60 degrees a wheel moved so rises
faster than the other one sinks by the roll: with the shift given at the axle two contacts carry the same
loads there, and forces jump from one to the other. At the height of the rails the wheels keep their place.

Without a state nearby the balance is continued from straight track: curvature and unbalanced acceleration
grow together from zero, along the secant through the last two states.

The contact forces of a model with one plane and one ellipse per patch can jump within a micrometre, so that
no shift balances the bogie. The axle is then on both sides of the jump in turn, and its share of the
distance on the right side takes the place of the shift as the unknown: the limit under ever shorter steps
of wear [2]_. If such a jump blocks the search, it is restarted from four states around its start.

References
----------
.. [1] P. Deuflhard, Newton Methods for Nonlinear Problems, Springer 2004, section 3.3.
.. [2] A. F. Filippov, Differential Equations with Discontinuous Righthand Sides, Kluwer 1988,
   doi:10.1007/978-94-015-7793-9.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.patch import FloatArray, IntArray
from wearsim.operation.bogie import Bogies, spring_slope, suspension
from wearsim.operation.search import Search

TOLERANCE = 2e-5
"""Largest residual of force, moment (at 1 m) and wheel load at the end of a wear step, over the axle load."""
ACCEPTED = 1e-4
"""Largest residual of a balance, and of one in a stage of a wear step, over the axle load."""
IN_STAGES_AT_JUMP, _ACCEPTED_AT_JUMP = 2e-3, 5e-3  # the same of an axle on a jump, looked for and accepted
# Where two contacts carry the same loads over a tenth of a micrometre, the place of the jump, and with it the
# force on a stiff flange, is not known any better.

_ON_THE_WAY = 1e-3  # largest residual of a state from which the balance is continued, over the axle load
_FIRST_PART, _LEAST_PART = 0.25, 5e-3  # of the curvature by which it is continued
_ITERATIONS, _HALVINGS = 40, 6
_DIFFERENCES = np.array([1e-6, 1e-6, 1e-3])  # for slopes: shift [m], yaw [rad], load over the axle load
_LONGEST = np.array([0.5e-3, 1e-3, 0.1])  # step of shift [m], yaw [rad], load over the axle load
_FURTHEST = 4.0  # times that along the secant
_LONGEST_SHARE = 0.3  # step of the share on the right of a jump
_WITHOUT_GAIN = 3  # steps in turn after which a bogie on a jump is left where it is best
_KEPT = 0.5  # ratio of two full steps in turn up to which slopes are kept
_SMALL_PART = 0.1  # of a step: progress by less may be that along a jump
_GROWTH = 4.0  # of the residual by a step that is taken
_AROUND = np.array([[-20e-6, -0.1e-3], [-20e-6, 0.1e-3], [20e-6, -0.1e-3], [20e-6, 0.1e-3]])  # [m, rad]
_LEAST_LOAD = 0.02  # of a wheel, over the axle load: with less it is unloaded

# A jump is looked for on one grid of shifts and located on two finer ones.
_REACH, _POINTS, _FINER_POINTS = 4e-6, 17, (17, 17)  # [m]
WIDTH = 0.5e-6
"""Between the shifts on both sides of a jump of the contact: some are ramps of a tenth of it [m]."""
_BESIDE = 0.1e-6  # distance from a jump at which an axle leaves it [m]
_ABRUPT = 5.0  # change between two shifts, over the median one, that is a jump
_LEAST_JUMP = 200.0  # change between two shifts that is a jump [N, N m]
_WIDER = 20.0  # times the difference of yaw for slopes at a jump, whose place scatters


@dataclass(frozen=True)
class Balance:
    """States of `m` bogies, and by how much they are out of balance."""

    state: FloatArray  # (m, 2, 3) of both axles: shift at the rails [m], yaw [rad], right wheel load [N]
    share: FloatArray  # (m, 2) of the distance on the right of a jump of the contact; NaN: there is none [-]
    # (m, 2, 4) lateral force [N], yaw moment [N m], right load without roll [N], and shift of the axle itself
    # to the right of that at the rails [m]
    contact: FloatArray
    jump: FloatArray  # (m, 2, 4) change of these across the jump
    residual: FloatArray  # (m, 2, 3) force [N], moment [N m] and load [N] that are missing
    size: FloatArray  # (m,) the largest of them, over the axle load; infinite without contact [-]

    @property
    def on_jump(self) -> NDArray[np.bool_]:
        """Axles (m, 2) that are on both sides of a jump in turn."""
        return np.isfinite(self.share)

    @property
    def accepted(self) -> NDArray[np.bool_]:
        """Bogies (m,) that are in balance as nearly as it can be found."""
        return np.asarray(self.size <= self.tolerance(ACCEPTED, _ACCEPTED_AT_JUMP))

    def tolerance(self, smooth: float, at_jump: float) -> FloatArray:
        """Tolerance (m,) of bogies whose contact is smooth, or of those with an axle on a jump if larger."""
        return np.where(self.on_jump.any(axis=1), max(at_jump, smooth), smooth)

    def better(self, other: Balance) -> NDArray[np.bool_]:
        """Bogies (m,) that are accepted where the other is not, or nearer to balance than it."""
        nearer = (self.accepted == other.accepted) & (self.size < other.size)
        return np.asarray((self.accepted & ~other.accepted) | nearer)

    def improved(self, rows: IntArray, other: Balance) -> Balance:
        """Return all bogies, those at `rows` from `other` where it is better."""
        better = other.better(self.at(rows))
        return self.replaced(rows[better], other.at(better))

    def at(self, rows: IntArray | NDArray[np.bool_]) -> Balance:
        """Return the bogies at `rows`."""
        return Balance(*(values[rows] for values in vars(self).values()))

    def replaced(self, rows: IntArray | NDArray[np.bool_], other: Balance) -> Balance:
        """Return all bogies, those at `rows` from `other`."""
        whole = {name: values.copy() for name, values in vars(self).items()}
        for name, values in whole.items():
            values[rows] = getattr(other, name)
        return Balance(**whole)


def evaluated(search: Search, bogies: Bogies, state: FloatArray, share: FloatArray) -> Balance:
    """Solve the contact of bogies in given states.

    Parameters
    ----------
    search : Search
        Over all operating points, in the curves of the bogies.
    bogies : Bogies
        `m` of them; their points are rows of the search.
    state, share
        As in `Balance`; axles with a share are moved to the jump nearest to their state.
    """
    rows = np.stack([bogies.leading, bogies.trailing], axis=1)
    state, contact, change = state.copy(), np.zeros((*share.shape, 4)), np.zeros((*share.shape, 4))
    solved, on_jump = np.zeros(share.shape, dtype=bool), np.isfinite(share)
    if not on_jump.all():
        alone = ~on_jump
        contact[alone], solved[alone] = _contact(search, bogies, rows[alone], state[alone])
    if on_jump.any():
        jump = _jump_near(search, bogies, rows[on_jump], state[on_jump])
        part = share[on_jump][:, None]
        contact[on_jump] = (1.0 - part) * jump.left + part * jump.right
        change[on_jump] = jump.right - jump.left
        state[on_jump, 0], solved[on_jump] = jump.shift, jump.found
    curvature = search.conditions.track_curvature[bogies.leading]
    sprung = state[:, :, :2].copy()
    sprung[:, :, 0] += contact[:, :, 3]
    springs = suspension(
        bogies.vehicle, sprung.reshape(-1, 4), curvature, bogies.acceleration, bogies.in_front
    )
    residual = contact[:, :, :3].copy()
    residual[:, :, :2] += springs.reshape(-1, 2, 2)
    residual[:, :, 2] -= state[:, :, 2]
    size = np.abs(residual).max(axis=(1, 2)) / bogies.vehicle.axle_load
    size = np.where(solved.all(axis=1), size, np.inf)
    return Balance(state, share.copy(), contact, change, residual, size)


def evaluated_nearby(search: Search, bogies: Bogies, state: FloatArray, share: FloatArray) -> Balance:
    """Solve the contact of bogies as `evaluated`, off the jumps of their axles where these are gone."""
    found = evaluated(search, bogies, state, share)
    gone = np.isinf(found.size) & found.on_jump.any(axis=1)
    if gone.any():
        nothing = np.full_like(share[gone], np.nan)
        found = found.replaced(gone, evaluated(search, bogies.at(np.flatnonzero(gone)), state[gone], nothing))
    return found


def _contact(
    search: Search, bogies: Bogies, rows: IntArray, state: FloatArray
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Contact (k, 4) of axles in states (k, 3), as in `Balance`, and which have one."""
    load = np.stack([state[:, 2], bogies.vehicle.axle_load - state[:, 2]], axis=1)
    forces, solved = search.solve(rows, state[:, 0], load, yaw=state[:, 1])
    right = search.loads(rows, forces, load)[:, 0]
    aside = search.conditions.at(rows).axle_shift(forces.roll) - search.conditions.shift[rows]
    return np.stack([forces.force, forces.moment, right, aside], axis=1), solved


class _Jump(NamedTuple):
    """Jumps of the contact of axles (k,)."""

    shift: FloatArray  # (k,) of the jump [m]
    left: FloatArray  # (k, 4) contact half of `WIDTH` further left
    right: FloatArray  # (k, 4) contact half of `WIDTH` further right
    found: NDArray[np.bool_]


def _jump_near(search: Search, bogies: Bogies, rows: IntArray, state: FloatArray) -> _Jump:
    """Locate the jump of the contact that is nearest to the shift of each axle."""

    def contacts(shift: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
        count = shift.shape[1]
        moved = np.repeat(state, count, axis=0)
        moved[:, 0] = shift.ravel()
        value, solved = _contact(search, bogies, np.repeat(rows, count), moved)
        return value.reshape(-1, count, 4), solved.reshape(-1, count)

    each, grid = np.arange(rows.size), np.linspace(-_REACH, _REACH, _POINTS)
    value, solved = contacts(state[:, :1] + grid)
    change = np.abs(np.diff(value[:, :, :2], axis=1))
    change[~(solved[:, 1:] & solved[:, :-1])] = 0.0
    abrupt = change / (_ABRUPT * np.median(change, axis=1, keepdims=True) + _LEAST_JUMP)
    distance = np.abs(grid[1:] + grid[:-1])
    left = np.where(abrupt.max(axis=2) > 1.0, distance, np.inf).argmin(axis=1)
    column = abrupt[each, left].argmax(axis=1)  # the force or the moment
    found = abrupt[each, left, column] > 1.0
    # half way between levels a spacing further out: some are ramps, or two jumps within one spacing
    first, last = np.maximum(left - 1, 0), np.minimum(left + 2, _POINTS - 1)
    level = 0.5 * (value[each, first, column] + value[each, last, column])
    low, width = state[:, 0] + grid[first], grid[last] - grid[first]
    for points in _FINER_POINTS:
        value, _ = contacts(low[:, None] + width[:, None] * np.linspace(0.0, 1.0, points))
        above = value[each, :, column] - level[:, None]
        left = (above[:, 1:] * above[:, :1] <= 0.0).argmax(axis=1)
        width = width / (points - 1)
        low = low + width * left
    shift = low + 0.5 * width
    value, solved = contacts(shift[:, None] + np.array([-0.5, 0.5]) * WIDTH)
    return _Jump(shift, value[:, 0], value[:, 1], found & solved.all(axis=1))


def _slopes(search: Search, bogies: Bogies, now: Balance) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Slopes (m, 6, 6) of the residuals of bogies by their unknowns, and for which they are known."""
    count, weight, on_jump = now.size.size, bogies.vehicle.axle_load, now.on_jump
    apart = np.tile(_DIFFERENCES * np.array([1.0, 1.0, weight]), (count, 2, 1))
    apart[on_jump, 1] *= _WIDER
    state = np.tile(now.state, (3, 1, 1))
    for column in range(3):
        state[column * count : (column + 1) * count, :, column] += apart[:, :, column]
    # the slope by the share is known, so that shifts are moved off jumps
    share = np.concatenate([np.full_like(now.share, np.nan), now.share, now.share])
    there = evaluated(search, bogies.at(np.tile(np.arange(count), 3)), state, share)
    springs = spring_slope(bogies.vehicle).reshape(2, 2, 2, 2)
    slope = np.zeros((count, 2, 3, 2, 3))
    for axle in (0, 1):
        # slopes by the unknowns of the axle
        of_contact, of_sprung = np.zeros((count, 4, 3)), np.zeros((count, 2, 3))
        for column in range(3):
            moved = there.contact[column * count : (column + 1) * count, axle]
            of_contact[:, :, column] = (moved - now.contact[:, axle]) / apart[:, axle, column, None]
        across = on_jump[:, axle]
        of_contact[across, :, 0] = now.jump[across, axle]
        of_sprung[:, 0] = of_contact[:, 3]
        of_sprung[~across, 0, 0] += 1.0
        of_sprung[:, 1, 1] = 1.0
        slope[:, :, :2, axle, :] = np.einsum("bfx,mxu->mbfu", springs[:, :, axle, :], of_sprung)
        slope[:, axle, :, axle, :] += of_contact[:, :3]
        slope[:, axle, 2, axle, 2] -= 1.0
    known = np.isfinite(there.size).reshape(3, count).all(axis=0)
    return slope.reshape(count, 6, 6), np.asarray(known)


def _newton_step(slope: FloatArray, residual: FloatArray, weight: float) -> FloatArray:
    """Step (m, 2, 3) that solves linear equations for the residual (m, 2, 3)."""
    scale = np.tile(_LONGEST * np.array([1.0, 1.0, weight]), 2)
    # of like size, and with a step of least length where they are singular
    inverse = np.linalg.pinv(slope * (scale / weight), rcond=1e-12)
    step: FloatArray = -scale * np.einsum("mij,mj->mi", inverse, residual.reshape(-1, 6) / weight)
    return step.reshape(-1, 2, 3)


def _length(step: FloatArray, longest: FloatArray) -> FloatArray:
    """Lengths (m,) of steps (m, 2, 3) over the longest ones."""
    length: FloatArray = np.sqrt(((step / longest) ** 2).sum(axis=(1, 2)))
    return length


def _moved(now: Balance, step: FloatArray, weight: float) -> tuple[FloatArray, FloatArray]:
    """States (m, 2, 3) and shares (m, 2) after steps (m, 2, 3), of axles on a jump with that of the share."""
    state, share, on_jump = now.state + step, now.share + step[:, :, 0], now.on_jump
    state[:, :, 2] = np.clip(state[:, :, 2], _LEAST_LOAD * weight, (1.0 - _LEAST_LOAD) * weight)
    # where neither side nor a mean of both balances, the axle leaves the jump as its force moves it
    leaving = ((now.share <= 0.0) & (share < 0.0)) | ((now.share >= 1.0) & (share > 1.0))
    beside = np.sign(now.residual[:, :, 0]) * (0.5 * WIDTH + _BESIDE)
    stays = now.state[:, :, 0] + np.where(leaving, beside, 0.0)
    state[:, :, 0] = np.where(on_jump, stays, state[:, :, 0])
    return state, np.where(leaving, np.nan, np.clip(share, 0.0, 1.0))


class _Stepped(NamedTuple):
    """Bogies after a step of Newton's method."""

    now: Balance
    kept: NDArray[np.bool_]  # (m,) slopes that remain good
    stuck: NDArray[np.bool_]  # (m,) bogies that no part of their step brings nearer to the balance
    slow: NDArray[np.bool_]  # (m,) bogies that a small part of it brings little nearer


def _stepped(
    search: Search, bogies: Bogies, now: Balance, slope: FloatArray, exact: NDArray[np.bool_]
) -> _Stepped:
    """Take a step of Newton's method, halved until the error falls; `exact` slopes are those of the state."""
    weight = bogies.vehicle.axle_load
    step = _newton_step(slope, now.residual, weight)
    longest = np.tile(_LONGEST * np.array([1.0, 1.0, weight]), (*now.share.shape, 1))
    longest[now.on_jump, 0] = _LONGEST_SHARE
    length = _length(step, longest)
    whole = 1.0 / np.maximum(np.abs(step / longest).max(axis=(1, 2)), 1.0)
    part = whole.copy()
    kept, rest = np.zeros(now.size.size, dtype=bool), np.arange(now.size.size)
    result = now
    for _ in range(_HALVINGS):
        before = now.at(rest)
        trial = evaluated(
            search, bogies.at(rest), *_moved(before, part[rest, None, None] * step[rest], weight)
        )
        ratio = _length(_newton_step(slope[rest], trial.residual, weight), longest[rest]) / length[rest]
        left = (before.on_jump & ~trial.on_jump).any(axis=1) & np.isfinite(trial.size)
        falls = (trial.size < before.size) | (ratio < 1.0 - 0.25 * part[rest])
        better = left | (falls & (trial.size < _GROWTH * before.size))
        result = result.replaced(rest[better], trial.at(better))
        kept[rest[better]] = (~left & (ratio <= 1.0 - (1.0 - _KEPT) * part[rest]))[better]
        rest = rest[~better & exact[rest]]  # with old slopes new ones come first
        if not rest.size:
            break
        part[rest] *= 0.5
    stuck = np.isin(np.arange(now.size.size), rest)
    slow = (part <= _SMALL_PART * whole) & (result.size > _KEPT * now.size)
    return _Stepped(result, kept, stuck, slow)


def balanced(
    search: Search, bogies: Bogies, start: Balance, tolerance: float, at_jump: float = ACCEPTED
) -> Balance:
    """Balance bogies from states nearby.

    Parameters
    ----------
    search : Search
        Over all operating points, in the curves of the bogies.
    bogies : Bogies
        `m` of them.
    start : Balance
        Evaluated states to begin with.
    tolerance : float
        Residual from which on a bogie is balanced, over the axle load.
    at_jump : float
        The same of a bogie with an axle on a jump of the contact.

    Returns
    -------
    Balance
        The states with the smallest residuals met.
    """
    now = best = start
    count = start.size.size
    slope, known = np.zeros((count, 6, 6)), np.zeros(count, dtype=bool)
    rest = np.flatnonzero((now.size > now.tolerance(tolerance, at_jump)) & np.isfinite(now.size))
    without_gain = np.zeros(count, dtype=np.int64)  # steps in turn
    for _ in range(_ITERATIONS):
        asked = rest[~known[rest]]
        if asked.size:
            slope[asked], known[asked] = _slopes(search, bogies.at(asked), now.at(asked))
        rest = rest[known[rest]]
        if not rest.size:
            break
        found = _stepped(search, bogies.at(rest), now.at(rest), slope[rest], np.isin(rest, asked))
        now = now.replaced(rest, found.now)
        known[rest] = found.kept
        stopped = rest[found.stuck | found.slow]
        stopped = stopped[~best.accepted[stopped]]
        dropped = rest[found.stuck]
        if stopped.size:
            on_jumps = _put_on_jumps(search, bogies.at(stopped), now.at(stopped))
            new = np.asarray((on_jumps.on_jump & ~now.on_jump[stopped]).any(axis=1))
            now = now.replaced(stopped[new], on_jumps.at(new))
            best = best.replaced(stopped[new], on_jumps.at(new))
            known[stopped[new]] = False
            dropped = np.setdiff1d(dropped, stopped[new])
        rest = np.setdiff1d(rest, dropped)
        smaller = now.size < best.size
        without_gain = np.where(now.size < _KEPT * best.size, 0, without_gain + 1)
        best = best.replaced(smaller, now.at(smaller))
        enough = best.accepted & best.on_jump.any(axis=1) & (without_gain >= _WITHOUT_GAIN)
        done = enough | (now.size <= now.tolerance(tolerance, at_jump))
        rest = rest[~done[rest]]
    return best


def balanced_from_around(
    search: Search, bogies: Bogies, start: Balance, tolerance: float, at_jump: float
) -> Balance:
    """Balance bogies from four states around a start whose way to the balance a jump of the contact blocks.

    Parameters as of `balanced`.

    Returns
    -------
    Balance
        Of those within the tolerance, else of those accepted, the one nearest to the start; otherwise that
        with the smallest residual.
    """
    count, many = start.size.size, np.tile(np.arange(start.size.size), len(_AROUND))
    state = start.state[many]
    state[:, 0, :2] += np.repeat(_AROUND, count, axis=0)
    own = bogies.at(many)
    begun = evaluated(search, own, state, np.full((many.size, 2), np.nan))
    found = balanced(search, own, begun, tolerance, at_jump)
    longest = _LONGEST * np.array([1.0, 1.0, bogies.vehicle.axle_load])
    away = _length(found.state - start.state[many], longest)
    near = away / (1.0 + away)
    within = found.size <= found.tolerance(tolerance, at_jump)
    rank = np.where(within, near, np.where(found.accepted, 1.0 + near, 2.0 + found.size))
    first = rank.reshape(len(_AROUND), count).argmin(axis=0)
    return found.at(first * count + np.arange(count))


def _put_on_jumps(search: Search, bogies: Bogies, now: Balance) -> Balance:
    """Put bogies with one of their axles on the jump of the contact near it, where there is one."""
    result = now
    for axle in (0, 1):
        share = now.share.copy()
        share[:, axle] = np.where(np.isfinite(share[:, axle]), share[:, axle], 0.5)
        there = evaluated(search, bogies, now.state, share)
        found = np.isfinite(there.size)
        result = result.replaced(found, there.at(found))
    return result


def in_part_of_curve(search: Search, bogies: Bogies, part: FloatArray) -> tuple[Search, Bogies]:
    """Return search and bogies in curves of parts (m,) of their curvature and unbalanced acceleration."""
    curvature, moment = search.conditions.track_curvature.copy(), search.controlled.box_moment.copy()
    for rows in (bogies.leading, bogies.trailing):
        curvature[rows] *= part
        moment[rows] *= part
    conditions = replace(search.conditions, track_curvature=curvature)
    there = replace(search, conditions=conditions, controlled=replace(search.controlled, box_moment=moment))
    return there, replace(bogies, acceleration=part * bogies.acceleration)


def continued(search: Search, bogies: Bogies, tolerance: float) -> Balance:
    """Balance bogies by continuation from straight track to their curves.

    Parameters and result as of `balanced`; bogies that did not reach their curve have an infinite size.
    """
    count, weight = bogies.leading.size, bogies.vehicle.axle_load
    state, part, advance = np.zeros((count, 2, 3)), np.zeros(count), np.full(count, _FIRST_PART)
    state[:, :, 2] = 0.5 * weight
    there = in_part_of_curve(search, bogies, part)
    now = balanced(*there, evaluated(*there, state, np.full((count, 2), np.nan)), _ON_THE_WAY)
    rate, longest = np.zeros_like(state), _FURTHEST * _LONGEST * np.array([1.0, 1.0, weight])
    rest = np.flatnonzero(now.size <= _ON_THE_WAY)
    while rest.size:
        here = now.at(rest)
        ahead = np.minimum(part[rest] + advance[rest], 1.0)
        gone = ahead - part[rest]
        move = gone[:, None, None] * rate[rest]
        move /= np.maximum(np.abs(move / longest).max(axis=(1, 2)), 1.0)[:, None, None]
        there = in_part_of_curve(search, bogies.at(rest), ahead)
        begun = evaluated(*there, here.state + move, here.share)
        none = np.isinf(begun.size)
        if none.any():
            own = there[1].at(np.flatnonzero(none))
            again = evaluated_nearby(there[0], own, here.state[none], here.share[none])
            begun = begun.replaced(none, again)
        found = balanced(*there, begun, _ON_THE_WAY)
        good = found.size <= _ON_THE_WAY
        rows = rest[good]
        rate[rows] = (found.state - here.state)[good] / gone[good, None, None]
        now = now.replaced(rows, found.at(good))
        part[rows] = ahead[good]
        advance[rest] = np.where(good, 2.0, 0.25) * gone
        rest = rest[(part[rest] < 1.0) & (advance[rest] >= _LEAST_PART)]
    arrived = np.flatnonzero(part == 1.0)
    now = replace(now, size=np.where(part == 1.0, now.size, np.inf))
    return now.replaced(arrived, balanced(search, bogies.at(arrived), now.at(arrived), tolerance))
