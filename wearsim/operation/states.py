r"""Where a wheelset runs under given forces: shift and wheel loads from the balance of one wheelset.

With the lateral force H at axle height and the axle load W, of which the boxes carry the moment
:math:`B = (V_R - V_L) b` about the longitudinal axis,

.. math::
    -H_c(y) = H, \qquad \sum Q_p = W, \qquad \sum (y_p Q_p + z_p T_p) = B

(`wearsim.operation.resultants`). The force over the shift is flat on the tread and not monotonic, so that up
to five shifts belong to one force: the branch is part of the state. The wheelset moves from where it was, at
first from the middle of the track, in the direction of the force that is missing, and stays at the first
shift that balances it with dH/dy > 0.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.equilibrium import falling_root
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import ContactConditions, ContactModels, ContactPatches, Counterface, Wheelset
from wearsim.contact.solve import ContactSolution, solve_each
from wearsim.contact.wheels import joined
from wearsim.errors import ContactError
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
_MOST_TRIALS = 24
_NOISE = 1e-8  # difference of shifts below which the roll's tolerance decides that of the forces [m]
_JUMP = 1e-6  # widest bracket in which the force jumps: it changes by more than `_STIFFEST` explains [m]
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
        found: NDArray[np.bool_] = np.isfinite(self.lateral_force) | np.isfinite(self.axle_load)
        return found

    def at(self, index: IntArray) -> Controlled:
        """Return forces and loads of the points at `index`; bogies are those of all points."""
        return Controlled(self.lateral_force[index], self.axle_load[index], self.box_moment[index])


class Corrected(NamedTuple):
    """Contact models of `n` points, and how the resultants of a reference differ from theirs."""

    chain: tuple[ContactModels, ...]
    model: IntArray  # (n,) number of that of each point
    differences: Differences


@dataclass(frozen=True)
class Running:
    """Where the wheelset runs at `n` operating points: the state that the next one starts from."""

    shift: FloatArray  # (n,) [m]
    load: FloatArray  # (n, 2) of the right and the left wheel [N]
    stiffness: FloatArray  # (n,) dH/dy where it runs; 0 where the shift is given [N/m]
    yaw: FloatArray  # (n,) [rad]

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

    def solve(
        self,
        rows: IntArray,
        shift: FloatArray,
        load: FloatArray,
        coarse: bool = False,
        yaw: FloatArray | None = None,
    ) -> tuple[Resultants, NDArray[np.bool_]]:
        """Resultants at shifts (k,) under loads (k, 2) of `rows` (k,), and which have a solution."""
        here = replace(
            self.conditions.at(rows), shift=shift, wheel_load=load, yaw=self.yaw[rows] if yaw is None else yaw
        )
        number, solved, parts = self.corrected.model[rows], np.ones(rows.size, dtype=bool), []
        for one in np.unique(number).tolist():
            models, index = self.corrected.chain[one], np.flatnonzero(number == one)
            if coarse:
                models = replace(models, strips=_COARSE, cells=_COARSE, cell_size=_COARSE_CELL)
            failed: dict[int, ContactError] = {}
            found: list[ContactPatches] = solve_each(
                here.at(index), self.wheelset, self.counterface, models, ContactSolution.patches,
                threads=self.threads, failed=failed,
            )  # fmt: skip
            parts += [replace(part, point=index[part.point]) for part in found]
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
    )  # fmt: skip
    alone = controlled.any
    if controlled.bogies is not None:
        alone = alone & ~np.isin(np.arange(count), controlled.bogies.points)
        _curved(search, controlled.bogies, start)
    rows = np.flatnonzero(alone)
    known = ~forced[rows] | (search.stiffness[rows] > 0.0)
    rest = np.concatenate([_corrected(search, rows[known], MOST_WARM), rows[~known]])
    if rest.size:
        _walked(search, np.sort(rest[forced[rest]]))
        rest = _corrected(search, np.sort(rest), 20)
    if rest.size:
        raise StateError(
            {int(k): "shift and wheel loads do not settle; smooth measured profiles" for k in rest}
        )
    return Running(search.shift, search.load, search.stiffness, search.yaw)


def _curved(search: Search, bogies: Bogies, start: Running) -> None:
    """Balance all bogies, in place, from where they ran before if they did.

    Raises
    ------
    StateError
        For the points of bogies without balance.
    """
    rows = bogies.points
    warm = bool((start.stiffness[rows] > 0.0).all())
    search.shift[rows], search.yaw[rows] = start.shift[rows], start.yaw[rows]
    left = curved(search, bogies, warm, TOLERANCE)
    if left.size and warm:
        left = left[curved(search, bogies.at(left), False, TOLERANCE)]
    if left.size:
        radius = 1.0 / search.conditions.track_curvature[bogies.leading[left]]
        text = (
            "no equilibrium of the bogie in the curve of {:.4g} m: the flange climbs or a wheel is unloaded"
        )
        places = zip(bogies.leading[left].tolist(), radius, strict=True)
        raise StateError({point: text.format(one) for point, one in places})
    search.stiffness[rows] = 1.0  # found before: the next search starts here


def _corrected(search: Search, rows: IntArray, most: int) -> IntArray:
    """Correct shifts and loads, in place; the rows that are not balanced then.

    Loads by their levers; shifts by secants, and by regula falsi (Illinois) once the force wanted lies
    between those of two shifts: such rows go on after `most` solutions. Where the force jumps past the one
    wanted, as that of a model whose patches merge, one side of the jump is taken.
    """
    count = search.shift.size
    before, moved = np.zeros(count), np.zeros(count)
    ends, off_ends = np.tile([-np.inf, np.inf], (count, 1)), np.zeros((count, 2))
    lost = rows[:0]
    for trial in range(_MOST_TRIALS):
        if trial >= most:
            found = np.isfinite(ends[rows]).all(axis=1)
            lost, rows = np.append(lost, rows[~found]), rows[found]
        if not rows.size:
            break
        shift, load = search.shift[rows], search.load[rows]
        forces, solved = search.solve(rows, shift, load)
        wanted = search.controlled.lateral_force[rows]
        forced = np.isfinite(wanted)
        off = np.where(forced, -forces.force - np.where(forced, wanted, 0.0), 0.0)
        after = search.loads(rows, forces, load)
        total = after.sum(axis=1)
        for side in (0, 1):
            here = forced & solved & ((off > 0.0) if side else (off < 0.0))
            again = here & (ends[rows, side] == shift - moved[rows])  # the other end did not move: halve it
            off_ends[rows, 1 - side] *= np.where(again, 0.5, 1.0)
            ends[rows, side] = np.where(here, shift, ends[rows, side])
            off_ends[rows, side] = np.where(here, off, off_ends[rows, side])
        low, high = ends[rows].T
        between = np.isfinite(low) & np.isfinite(high) & (low < high)
        width = np.where(between, high, 1.0) - np.where(between, low, 0.0)
        jumps = between & (width <= _JUMP) & (np.abs(off) > _STIFFEST * width)
        still = np.abs(after - load).max(axis=1) <= TOLERANCE * total
        still &= ((np.abs(off) <= TOLERANCE * total) | jumps) & solved
        known, tried = search.stiffness[rows], np.abs(moved[rows]) > _NOISE
        secant = (off - before[rows]) / np.where(tried, moved[rows], 1.0)
        usable = forced & tried & ~still & (secant > _GENTLE) & (secant < _STIFFEST)
        search.stiffness[rows] = np.where(usable, secant, np.minimum(known, _STIFFEST))
        step = np.clip(-off / np.maximum(search.stiffness[rows], _GENTLE), -_LONGEST, _LONGEST)
        low_off, high_off = off_ends[rows].T
        share = low_off / np.where(between, low_off - high_off, 1.0)
        step = np.where(between, np.where(between, low, 0.0) + share * width - shift, step)
        step = np.where(forced & solved & ~still, step, 0.0)
        least = _LEAST_LOAD * total[:, None]
        search.shift[rows] = shift + step
        search.load[rows] = np.where((solved & ~still)[:, None], np.maximum(after, least), load)
        before[rows], moved[rows] = off, step
        rows = rows[~still]
    return np.append(lost, rows)


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
                messages[int(row)] = (
                    f"the flange carries a lateral force of at most {1e-3 * way[row] * most[row]:.4g} kN: "
                    f"the wheel would climb over its crest"
                )
            else:
                left.append(row)
        last = np.searchsorted(rows, open_rows)
        at[last], force[last] = far[:, -1], reached[:, -1]
        open_rows = np.array(left, dtype=np.int64)
    for j in np.flatnonzero((with_force <= least).any(axis=1)).tolist():
        wheel = int(np.argmin(with_force[j]))
        largest = wanted[j] * without[j, wheel] / (without[j, wheel] - with_force[j, wheel])
        messages[int(rows[j])] = (
            f"the moment of the lateral force about the rails unloads the {('right', 'left')[wheel]} "
            f"wheel: the axle carries at most {1e-3 * largest:.4g} kN"
        )
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
