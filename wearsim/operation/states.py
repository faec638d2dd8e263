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
within a micrometre, so that no shift balances it. The wheelset then runs at both sides of the jump in turn,
in shares of the distance whose mean force is the one wanted. So does its limit under ever shorter steps of
wear: each side wears towards the other (a sliding mode, [1]_).

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

from wearsim.contact.equilibrium import falling_root
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import (
    NEARBY,
    ContactConditions,
    ContactModels,
    ContactPatches,
    Counterface,
    Wheelset,
)
from wearsim.contact.solve import ContactSolution, solve_each
from wearsim.contact.tangential import TANGENTIAL_MODELS
from wearsim.contact.wheels import joined
from wearsim.errors import ContactError, say
from wearsim.operation.bogie import Bogies, curved
from wearsim.operation.resultants import Differences, Resultants, resultants

MOST_WARM = 5
"""Contact solutions of a point that starts where it ran before; what is not balanced then walks on."""
TOLERANCE = 1e-5
"""Of lateral force and wheel loads, over the axle load."""

_STRIDE, _STRIDES, _FURTHEST = 0.25e-3, 8, 16e-3  # of the walk [m]; strides solved together
_COARSE, _COARSE_CELL = 12, 2e-3  # strips, cells and their size of the walk: its end is solved as asked for
_LONGEST = 0.5e-3  # correction of the shift [m]
_STIFFEST = 1e9  # dH/dy that a correction takes [N/m]
_STEEP = 4.0  # times that at one side of a jump
_FURTHER = 8e-6  # that a jump moves by the force at one side of it [m]
_LOADS_LEFT = 0.1  # of a correction of the loads that the next one takes, at the same shift
_MOST_TRIALS = 24
_NOISE = 1e-8  # difference of shifts below which the roll's tolerance decides that of the forces [m]
_NO_ENDS = np.array([[-np.inf, np.nan], [np.inf, np.nan]])  # of a bracket: shifts and the force missing there
_JUMP = 1e-6  # widest bracket in which the force jumps: it changes by more than `_STIFFEST` explains [m]
# In a stage a last step without a solution is enough from these on:
_PROMISING = 2e-3  # force and loads missing, over the axle load
_SMALL_STEP = 10e-6  # length of that step [m]
_LEAST_LOAD = 0.02  # of a wheel, over the axle load: below it is unloaded
_GENTLE = 1e4  # dH/dy of a start without a known one [N/m]


@dataclass(frozen=True)
class Controlled:
    """What is controlled of `n` operating points in place of shift and wheel loads; NaN: those are given."""

    lateral_force: FloatArray  # (n,) on the wheelset at axle height, to the right [N]
    axle_load: FloatArray  # (n,) that both wheels carry [N]
    box_moment: FloatArray  # (n,) of the axle boxes, right side down positive [N m]
    bogies: Bogies | None = None  # points whose shift and yaw follow from the balance of a bogie

    @property
    def any(self) -> NDArray[np.bool_]:
        """Points (n,) whose shift or wheel loads follow from forces."""
        return np.isfinite(self.lateral_force) | np.isfinite(self.axle_load)

    def at(self, index: IntArray) -> Controlled:
        """Return forces and loads of the points at `index`; bogies are those of all points."""
        return Controlled(self.lateral_force[index], self.axle_load[index], self.box_moment[index])


class Corrected(NamedTuple):
    """Contact models of `n` points, and how the resultants of a reference differ from theirs."""

    chain: tuple[ContactModels, ...]
    model: IntArray  # (n,) number of that of each point
    differences: Differences


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
        return replace(conditions, shift=self.shift, yaw=self.yaw, wheel_load=load)


class StateError(ContactError):
    """No state carries the forces of some points; `messages` says why, by their number."""

    def __init__(self, messages: dict[int, str]) -> None:
        self.messages = messages
        super().__init__("; ".join(f"point {k}: {text}" for k, text in messages.items()))


@dataclass
class Search:
    """Points on their way to balance; arrays over all `n` of them."""

    conditions: ContactConditions
    controlled: Controlled
    wheelset: Wheelset
    counterface: Counterface
    corrected: Corrected
    threads: int
    shift: FloatArray
    yaw: FloatArray
    load: FloatArray
    stiffness: FloatArray
    beyond: FloatArray  # shift, both loads, share and gap past a jump (n, 5); NaN: there is none
    nearby: FloatArray  # (n, 14) what contact came to at last, as in `ContactPatches`; NaN: unknown
    begins: NDArray[np.bool_]  # (n,) whether it begins there; else anew

    def solve(
        self,
        rows: IntArray,
        shift: FloatArray,
        load: FloatArray,
        coarse: bool = False,
        yaw: FloatArray | None = None,
    ) -> tuple[Resultants, NDArray[np.bool_]]:
        """Resultants at shifts (k,) under loads (k, 2) of `rows` (k,), and which have a solution.

        With a `yaw` (k,) of their own they are for slopes: on the branch of the solution before.
        """
        here = replace(
            self.conditions.at(rows), shift=shift, wheel_load=load, yaw=self.yaw[rows] if yaw is None else yaw
        )
        number, solved, parts = self.corrected.model[rows], np.ones(rows.size, dtype=bool), []
        for one in np.unique(number).tolist():
            models, index = self.corrected.chain[one], np.flatnonzero(number == one)
            if coarse:
                models = replace(models, strips=_COARSE, cells=_COARSE, cell_size=_COARSE_CELL)
            # forces of coarse cells of the half-space would hang on where it began
            kept = not coarse and not TANGENTIAL_MODELS[models.tangential].warm
            begins = kept & (self.begins[rows] | (yaw is not None))
            nearby = np.where(begins[:, None], self.nearby[rows], np.nan) if begins.any() else None
            part_of = replace(here, nearby=nearby).at(index)
            failed: dict[int, ContactError] = {}
            found: list[ContactPatches] = solve_each(
                part_of, self.wheelset, self.counterface, models, ContactSolution.patches,
                threads=self.threads, failed=failed, fields="work",
            )  # fmt: skip
            parts += [replace(part, point=index[part.point]) for part in found]
            if kept and yaw is None:
                for part in found:
                    self.nearby[rows[index[part.point]]] = part.nearby
            solved[index[list(failed)]] = False
        forces = resultants(joined(parts), here, self.wheelset, self.counterface)
        difference = self.corrected.differences.at(rows, shift, here.yaw)
        return forces.plus(np.where(solved[:, None], difference, 0.0)), solved

    def loads(self, rows: IntArray, forces: Resultants, load: FloatArray, share: float = 1.0) -> FloatArray:
        """Wheel loads (k, 2) that balance the roll with the levers of `forces`, under the forces wanted.

        Where the lateral force is controlled its moment is that of the force wanted: what is still missing of
        it does not shift load. `share` of the force wanted acts.
        """
        own = self.controlled.at(rows)
        wanted, vertical = share * own.lateral_force, np.where(forces.vertical > 0.0, forces.vertical, 1.0)
        given = np.isfinite(wanted)
        arm = forces.roll_moment / vertical
        held = (forces.roll_moment - forces.height[:, None] * forces.lateral) / vertical
        arm = np.where(given[:, None], held, arm)
        moment = own.box_moment + np.where(given, forces.height * wanted, 0.0)
        apart = arm[:, 0] - arm[:, 1]  # 0 without a solution
        right = (moment - arm[:, 1] * own.axle_load) / np.where(apart == 0.0, 1.0, apart)
        both = np.stack((right, own.axle_load - right), axis=1)
        return np.where((np.isfinite(own.axle_load) & (apart != 0.0))[:, None], both, load)


def settle(
    conditions: ContactConditions,
    controlled: Controlled,
    wheelset: Wheelset,
    counterface: Counterface,
    models: ContactModels | Corrected,
    start: Running | None = None,
    *,
    stage: NDArray[np.bool_] | None = None,
    nearby: FloatArray | None = None,
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
        As in `wearsim.contact.solve.solve`; models may be those of each point, with differences.
    start : Running, optional
        Where the wheelset ran before; by default in the middle of the track.
    stage : (n,) bool array, optional
        Points that act in a stage of a wear step: only they move, and all bogies, and by a last step without
        solution where at most 2e-3 of the axle load were missing.
    nearby : (n, 14) array, optional
        Where the contact of each point begins, as in `ContactPatches`; what it came to at last is put there,
        of points that were solved by models that begin so, NaN at jumps. Where two solutions carry the same
        loads it stays with that which it began with; without it each contact is solved anew.
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
    if not isinstance(models, Corrected):
        models = Corrected((models,), np.zeros(count, dtype=np.int64), Differences.none(count))
    forced, loaded = np.isfinite(controlled.lateral_force), np.isfinite(controlled.axle_load)
    search = Search(
        conditions, controlled, wheelset, counterface, models, threads,
        np.where(forced, start.shift, conditions.shift), conditions.yaw.copy(),
        np.where(loaded[:, None], start.load, load), np.where(forced, start.stiffness, 0.0),
        np.full((count, 5), np.nan), np.full((count, NEARBY), np.nan) if nearby is None else nearby,
        np.full(count, nearby is not None),
    )  # fmt: skip
    if (two := start.beyond) is not None:
        search.beyond[two.point] = np.column_stack([two.shift, two.load, two.share, two.gap])
    alone = controlled.any
    if controlled.bogies is not None:
        axles = controlled.bogies.points
        alone = alone & ~np.isin(np.arange(count), axles)
        search.shift[axles], search.yaw[axles] = start.shift[axles], start.yaw[axles]
        _curved(search, controlled.bogies, start, stage is not None)
    rows = np.flatnonzero(alone if stage is None else alone & stage)
    known = ~forced[rows] | (search.stiffness[rows] > 0.0)
    rest = np.append(_corrected(search, rows[known], MOST_WARM, stage is not None), rows[~known])
    if rest.size:
        search.begins[:] = False
        _walked(search, np.sort(rest[forced[rest]]))
        rest = _corrected(search, np.sort(rest), 20)
    if rest.size:
        raise StateError(dict.fromkeys(rest.tolist(), say("state.unsettled")))
    at = np.flatnonzero(np.isfinite(search.beyond[:, 0]))
    past = search.beyond[at]
    beyond = BeyondJump(at, past[:, 0], past[:, 1:3], *past[:, 3:].T) if at.size else None
    return Running(search.shift, search.load, search.stiffness, search.yaw, beyond)


def _curved(search: Search, bogies: Bogies, start: Running, stage: bool) -> None:
    """Balance all bogies, in place, from where they ran before if they did.

    In a `stage` of a wear step soon, or not at all: a shorter step costs less.

    Raises
    ------
    StateError
        For the points of bogies without balance.
    """
    rows = bogies.points
    warm = bool((start.stiffness[rows] > 0.0).all())
    left = curved(search, bogies, warm, TOLERANCE, soon=stage)
    if left.size and warm and not stage:
        search.nearby[bogies.at(left).points] = np.nan
        left = left[curved(search, bogies.at(left), False, TOLERANCE)]
    if left.size:
        curvature = search.conditions.track_curvature
        lost = bogies.leading[left].tolist()
        raise StateError({point: say("state.no_curving", radius=1.0 / curvature[point]) for point in lost})
    search.stiffness[rows] = 1.0  # found before: the next search starts here


def _corrected(search: Search, rows: IntArray, most: int, stage: bool = False) -> IntArray:
    """Correct shifts and loads, in place; the rows that are not balanced then.

    Loads by their levers; shifts by secants, and within brackets once the force wanted lies between those of
    two shifts: such rows go on after `most` solutions. Where the force jumps past the one wanted, both sides
    of the jump are taken; a jump is looked for by what its sides missed before. The last step of steps that
    converge is not looked at, nor that of a `stage` which is short or comes after `most` solutions.
    """
    count = search.shift.size
    before, moved = np.zeros(count), np.zeros(count)
    # shifts on both sides of the one sought, and the force missing there
    ends = np.tile(_NO_ENDS, (count, 1, 1))
    third, end_loads, end_moves = np.full((count, 2), np.nan), np.zeros((count, 2, 4)), np.zeros((count, 2))
    beyond, lost = search.beyond.copy(), rows[:0]
    width_before = np.where(np.isfinite(beyond[:, 0]), beyond[:, 0] - search.shift, 0.0)
    search.beyond[rows] = np.nan
    limit = np.full(count, most)
    search.begins &= ~np.isfinite(beyond[:, 0])  # the place of a jump would hang on the branch of the contact
    for trial in range(_MOST_TRIALS):
        late = (trial >= limit[rows]) & ~np.isfinite(ends[rows, :, 0]).all(axis=1)
        lost, rows = np.append(lost, rows[late]), rows[~late]
        if not rows.size:
            break
        shift, load = search.shift[rows], search.load[rows]
        forces, solved = search.solve(rows, shift, load)
        wanted = search.controlled.lateral_force[rows]
        forced = np.isfinite(wanted)
        off = np.where(forced, -forces.force - np.where(forced, wanted, 0.0), 0.0)
        after = search.loads(rows, forces, load)
        total = after.sum(axis=1)
        after = np.where(solved[:, None], np.maximum(after, _LEAST_LOAD * total[:, None]), load)
        moves = np.abs(after - load).max(axis=1) / total
        for side in (0, 1):
            here = forced & solved & ((off > 0.0) if side else (off < 0.0))
            own = rows[here]
            third[own] = ends[own, side]
            ends[own, side] = np.column_stack([shift, off])[here]
            end_loads[own, side], end_moves[own, side] = np.hstack([load, after])[here], moves[here]
        (low, low_off), (high, high_off) = np.moveaxis(ends[rows], 0, 2)
        between = np.isfinite(low) & np.isfinite(high) & (low < high)
        width = np.where(between, high, 1.0) - np.where(between, low, 0.0)
        ending = trial == limit[rows] - 1
        widest = np.where(stage & ending, 2.0 * _JUMP, _JUMP)
        steep = between & (high_off - low_off > _STIFFEST * width)
        fresh = steep & search.begins[rows]  # sides of it are looked for once more
        jumps = steep & (width <= widest) & ~fresh
        worse = np.argmax(end_moves[rows], axis=1)  # of a jump the end whose loads are further off
        again = jumps & (end_moves[rows, worse] > _PROMISING)
        jumps &= ~again
        fits = np.abs(off) <= TOLERANCE * total
        balanced = fits & (moves <= TOLERANCE)
        still = solved & (balanced | jumps)
        jumped = np.isfinite(beyond[rows, 0]) & ~between  # near a jump at first, on the way to it
        known, tried = search.stiffness[rows], np.abs(moved[rows]) > _NOISE
        secant = (off - before[rows]) / np.where(tried, moved[rows], 1.0)
        usable = forced & tried & ~still & (secant > _GENTLE)
        usable &= secant < np.where(jumped & (off * before[rows] > 0.0), _STEEP, 1.0) * _STIFFEST
        search.stiffness[rows] = np.where(usable, secant, np.minimum(known, _STEEP * _STIFFEST))
        step = -off / np.maximum(search.stiffness[rows], _GENTLE)
        # the last one, not looked at, where steps so far converge: it leaves at most the share they left
        left = off**2 / np.maximum(np.abs(before[rows]), np.abs(off) + 1e-9)
        last = solved & (trial > 0) & (fits | (usable & (left <= TOLERANCE * total)))
        last &= (moves <= TOLERANCE / _LOADS_LEFT) & ~jumped
        # to a jump: as far as it was above the force here, and by its width
        share, gap = beyond[rows, 3:].T
        level = np.where(off < 0.0, -share * gap, (1.0 - share) * gap) - off
        level = np.abs(np.where(level * off < 0.0, level, 0.0))
        most_step = np.minimum(level / np.maximum(search.stiffness[rows], _GENTLE), _FURTHER)
        most_step += width_before[rows] * 4.0**trial
        most_step = np.where(jumped, most_step, _LONGEST)
        step = np.clip(step, -most_step, most_step)
        inside = _within(shift, off, ends[rows], third[rows], width_before[rows] > 0.0)
        step = np.where(between & ~(last & (step * inside > 0.0) & (np.abs(step) < width)), inside, step)
        two = jumped & (trial == 0) & (off < 0.0)  # next the other side of the jump
        step = np.where(again, ends[rows, worse, 0] - shift, step)
        step = np.where(forced & solved & ~still & (np.abs(off) > 0.5 * TOLERANCE * total), step, 0.0)
        small = (np.abs(step) <= _SMALL_STEP) & ~between
        small |= ending
        quick = stage & solved & small & ~jumped & (np.maximum(np.abs(off) / total, moves) <= _PROMISING)
        search.shift[rows] = shift + step
        search.load[rows] = np.where((still & balanced)[:, None], load, after)
        search.load[rows[two]] = beyond[rows[two], 1:3]
        search.load[rows[again]] = end_loads[rows, worse, 2:][again]
        before[rows], moved[rows] = off, step
        own = rows[still & ~balanced]
        if own.size:
            gap = ends[own, 1, 1] - ends[own, 0, 1]
            search.shift[own], search.load[own] = ends[own, 0, 0], end_loads[own, 0, :2]
            share = -ends[own, 0, 1] / gap
            search.beyond[own] = np.column_stack([ends[own, 1, 0], end_loads[own, 1, :2], share, gap])
            search.nearby[own] = np.nan
        own = rows[fresh]
        search.begins[own], ends[own], third[own], moved[own] = False, _NO_ENDS, np.nan, 0.0
        limit[own] = trial + 1 + most  # as many solutions as from the start
        rows = rows[~(still | quick | last)]
    return np.append(lost, rows)


def _within(
    at: FloatArray, off: FloatArray, ends: FloatArray, third: FloatArray, halved: NDArray[np.bool_]
) -> FloatArray:
    """Step (k,) from the newer end of brackets `ends` (k, 2, 2), shifts and values, by Chandrupatla's rule.

    Inverse quadratic interpolation with the `third` (k, 2) point, the end before, where that is safe, else
    bisection; linear interpolation as long as there is none, but for those (k,) to be `halved`.
    """
    rising = off < 0.0
    other, other_off = np.where(rising, ends[:, 1].T, ends[:, 0].T)
    before, before_off = third.T
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        place, value = (at - other) / (before - other), (off - other_off) / (before_off - other_off)
        safe = (value**2 < place) & ((1.0 - value) ** 2 < 1.0 - place)
        quadratic = off / (other_off - off) * before_off / (other_off - before_off)
        third_off = off / (before_off - off) * other_off / (before_off - other_off)
        quadratic += (before - at) / (other - at) * third_off
        share = np.where(
            safe, quadratic, np.where(np.isfinite(before) | halved, 0.5, off / (off - other_off))
        )
        step: FloatArray = share * (other - at)
    return step


def _walked(search: Search, rows: IntArray) -> None:
    """Walk to a shift near the first stable balance of the lateral force, in place.

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
    low, high = np.zeros(count), np.zeros(count)
    way, most = np.zeros(count), np.full(count, -np.inf)
    way[rows], at, force = direction, start.copy(), -forces.force
    low[rows] = start
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
                high[row] = far[j, passed[0]]
                low[row] = far[j, passed[0] - 1] if passed[0] else at[own][j]
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
    middle, half = 0.5 * (low[rows] + high[rows]), 0.5 * np.abs(high[rows] - low[rows])

    def missing(shift: FloatArray, asked: NDArray[np.bool_]) -> FloatArray:
        part = rows[asked]
        value = np.zeros(rows.size)
        if not part.size:
            return value
        forces, solved = search.solve(part, shift[asked], search.load[part])
        search.load[part] = np.maximum(search.loads(part, forces, search.load[part]), 1.0)
        value[asked] = np.where(solved, search.controlled.lateral_force[part] + forces.force, 0.0)
        return value

    root, _ = falling_root(
        missing, middle, half, goal=1e-3 * search.load[rows].sum(axis=1), narrow=np.full(rows.size, 1e-7),
        done=np.zeros(rows.size, bool),
    )  # fmt: skip
    search.shift[rows] = root
    step = 2e-6
    ends = [missing(root + side * step, np.ones(rows.size, bool)) for side in (-1.0, 1.0)]
    search.stiffness[rows] = np.clip((ends[0] - ends[1]) / (2.0 * step), _GENTLE, _STIFFEST)
