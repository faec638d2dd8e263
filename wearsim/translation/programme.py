"""Durations of rig set-points that reproduce a wear pattern, by linear programming.

The wear depth of a programme is linear in the distances its blocks run while the
profiles hardly change, which is why programmes are made in stages of depth. Rates and
depths are SI outside; HiGHS gets um and km, because it drops matrix entries below 1e-9
without a word.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import Bounds, LinearConstraint, linprog, milp, nnls
from scipy.sparse import csr_array

from wearsim.errors import NumericalError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_RATE = 1e9  # um/km of m/m
_DEPTH = 1e6  # um of m
_LENGTH = 1e-3  # km of m
_HOURS = 1e3 / 3600.0  # h/km of s/m
_TIME = 1.0 / 3600.0  # h of s
_POOL = 75  # candidates that the integer programme chooses from
_NODES = 200  # of its tree: a limit in seconds would make results depend on the machine
_GAP = 0.02  # relative, at which it is good enough
_SLACK = 1e-6  # of the tolerance by which a point of HiGHS may miss it
_LEAST = 1e-6  # of the longest block, below which another one does not count


@dataclass(frozen=True)
class Problem:
    """Wear rates of n candidates at p places, and the pattern wanted there."""

    rates: FloatArray  # (p, n), not negative [m/m]
    target: FloatArray  # (p,) depth still to be worn; negative where it is exceeded [m]
    time: FloatArray  # (n,) that each candidate takes [s/m]
    guard: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    """(q, n) rows whose product with the distances must not be positive."""

    def only(self, chosen: IntArray) -> Problem:
        """Return the problem with some candidates alone."""
        guard = self.guard[:, chosen] if self.guard.size else self.guard
        return replace(
            self, rates=self.rates[:, chosen], time=self.time[chosen], guard=guard
        )

    def residual(self, distance: FloatArray) -> FloatArray:
        """Depth of distances (n,) [m] less the target (p,) [m]."""
        return self.rates @ distance - self.target

    @property
    def guard_rows(self) -> FloatArray:
        """Guard (q, n) with a largest entry of 1 in each row."""
        count = self.rates.shape[1]
        if not self.guard.size:
            return np.zeros((0, count))
        largest = np.abs(self.guard).max(axis=1, keepdims=True)
        return self.guard / np.where(largest > 0.0, largest, 1.0)


@dataclass(frozen=True)
class Durations:
    """Distances of candidates, and what limits them."""

    distance: FloatArray  # (n,) [m]
    tolerance: float  # within which the pattern is reproduced [m]
    price: FloatArray  # (n,) reduced cost of each candidate [s/m]
    deeper: FloatArray  # (p,) time saved per metre more of allowed depth [s/m]
    shallower: FloatArray  # (p,) time saved per metre less of required depth [s/m]
    guard: FloatArray  # (q,) price of each row of the guard; 0 where it does not bind

    @property
    def blocks(self) -> IntArray:
        """Candidates with a distance."""
        return np.flatnonzero(self.distance > _LEAST * self.distance.max(initial=0.0))


@dataclass(frozen=True)
class PatternError:
    """How far a pattern is off its target."""

    largest: float  # [m]
    at: int  # place of it
    rms: float  # over the places with more than 2 % of the deepest target [m]
    deepest: float  # target [m]

    @property
    def share(self) -> float:
        """Largest error over the deepest target [-]."""
        return self.largest / self.deepest if self.deepest > 0.0 else np.inf


def pattern_error(depth: FloatArray, target: FloatArray) -> PatternError:
    """Error of a depth against its target (p,) [m]."""
    error, deepest = np.abs(depth - target).ravel(), float(target.max())
    worn = target.ravel() > 0.02 * deepest
    rms = float(np.sqrt(np.mean(error[worn] ** 2))) if worn.any() else 0.0
    return PatternError(float(error.max()), int(error.argmax()), rms, deepest)


def smallest_error(problem: Problem) -> tuple[float, FloatArray]:
    """Smallest largest error of any distances [m], and those distances (n,) [m].

    Raises
    ------
    NumericalError
        If HiGHS does not solve it.
    """
    rates, target = _RATE * problem.rates, _DEPTH * problem.target
    count, one = rates.shape[1], np.ones((target.size, 1))
    guard = problem.guard_rows
    above = np.block(
        [[rates, -one], [-rates, -one], [guard, np.zeros((len(guard), 1))]]
    )
    limit = np.concatenate([target, -target, np.zeros(len(guard))])
    found = linprog(
        np.append(np.zeros(count), 1.0), A_ub=above, b_ub=limit, method="highs"
    )
    if found.status != 0:
        raise NumericalError(
            f"the linear programme of the smallest error failed: {found.message}"
        )
    distance = np.maximum(found.x[:count], 0.0) / _LENGTH
    return float(np.abs(problem.residual(distance)).max()), distance


def shortest(problem: Problem, tolerance: float) -> Durations | None:
    """Distances of least time within a tolerance [m] of the target everywhere, or None.

    Raises
    ------
    NumericalError
        If HiGHS fails, or calls a point a solution that our own product shows not to be
        one.
    """
    rates, target, within = (
        _RATE * problem.rates,
        _DEPTH * problem.target,
        _DEPTH * tolerance,
    )
    guard = problem.guard_rows
    above = np.vstack([rates, -rates, guard])
    limit = np.concatenate([target + within, within - target, np.zeros(len(guard))])
    found = linprog(_HOURS * problem.time, A_ub=above, b_ub=limit, method="highs")
    if found.status == 2:
        return None
    if found.status != 0:
        raise NumericalError(
            f"the linear programme of the durations failed: {found.message}"
        )
    distance = np.maximum(found.x, 0.0) / _LENGTH
    _check(problem, distance, tolerance)
    dual = found.ineqlin.marginals  # h/um of the first two parts
    places, to_seconds = target.size, 3600.0 * _DEPTH
    price = _HOURS * problem.time - above.T @ dual
    return Durations(
        distance,
        tolerance,
        price / _HOURS,
        -to_seconds * dual[:places],
        -to_seconds * dual[places : 2 * places],
        -dual[2 * places :],
    )


def _check(problem: Problem, distance: FloatArray, tolerance: float) -> None:
    """Raise a NumericalError if distances miss the tolerance they should keep."""
    error = float(np.abs(problem.residual(distance)).max())
    if error > tolerance + _SLACK * (tolerance + float(np.abs(problem.target).max())):
        raise NumericalError(
            "the linear programme returned durations with an error of "
            f"{_DEPTH * error:.4g} um at a tolerance of {_DEPTH * tolerance:.4g} um"
        )


def greedy(problem: Problem, blocks: int, swaps: int = 1) -> IntArray:
    """Candidates whose pattern comes near the target by least squares.

    At most `blocks` of them. Each is the one that fits best what those before leave;
    each is then exchanged for the best one in its place. The guard is not regarded.
    """
    rates, target = _RATE * problem.rates, _DEPTH * problem.target
    length = np.linalg.norm(rates, axis=0)
    length = np.where(length > 0.0, length, np.inf)
    chosen: list[int] = []

    def best(others: list[int]) -> int:
        rest = (
            target - rates[:, others] @ nnls(rates[:, others], target)[0]
            if others
            else target
        )
        gain = (rates.T @ rest) / length
        gain[others] = -np.inf
        return int(gain.argmax())

    for _ in range(min(blocks, rates.shape[1])):
        chosen.append(best(chosen))
    for _ in range(swaps):
        for k in range(len(chosen)):
            chosen[k] = best(chosen[:k] + chosen[k + 1 :])
    return np.array(sorted(chosen), dtype=np.int64)


def fewer(problem: Problem, chosen: IntArray, blocks: int) -> IntArray:
    """Drop the chosen candidates that wear least, one after the other."""
    while True:
        part = problem.only(chosen)
        distance = smallest_error(part)[1]
        brought = part.rates.sum(axis=0) * distance
        chosen, brought = chosen[brought > 0.0], brought[brought > 0.0]
        if len(chosen) <= blocks:
            return chosen
        chosen = np.delete(chosen, brought.argmin())


def few_blocks(
    problem: Problem,
    tolerance: float,
    blocks: int,
    changeover: float = 0.0,
    margin: float = 1.05,
) -> Durations:
    """Durations of at most `blocks` candidates, of least time with the changeovers.

    Parameters
    ----------
    problem : Problem
        Candidates and target.
    tolerance : float
        Largest error allowed [m].
    blocks : int
        Largest number of candidates used; 0 for any number.
    changeover : float
        Time from one block to the next [s].
    margin : float
        Where the tolerance is out of reach: the error allowed over the smallest one
        found.

    Returns
    -------
    Durations
        Its `tolerance` is the one kept: larger than the one given where that is out of
        reach.

    Notes
    -----
    The integer programme chooses from a pool: the solution of the linear programme, the
    candidates of least reduced cost, and the greedy ones. Where it finds none within
    the tolerance, the better one of the greedy candidates and of those left of the
    linear programme is taken.
    """
    within = max(tolerance, margin * smallest_error(problem)[0])
    free = shortest(problem, within)
    if free is None:
        raise NumericalError(
            "no durations within the smallest error, though it was found"
        )
    if not blocks or len(free.blocks) <= blocks:
        return free
    picked = greedy(problem, blocks)
    cheapest = np.argsort(free.price, kind="stable")[:_POOL]
    pool = np.array(list(dict.fromkeys([*free.blocks, *picked, *cheapest]))[:_POOL])
    ways = [picked, fewer(problem, free.blocks, blocks)]
    errors = [smallest_error(problem.only(way))[0] for way in ways]
    chosen, error = ways[int(np.argmin(errors))], min(errors)
    if found := _integer(problem.only(pool), within, blocks, changeover):
        chosen, error = pool[found], 0.0
    chosen = np.sort(chosen)
    best = shortest(problem.only(chosen), max(within, margin * error))
    assert best is not None
    distance = np.zeros(problem.rates.shape[1])
    distance[chosen] = best.distance
    return replace(best, distance=distance, price=free.price)


def _integer(
    problem: Problem, tolerance: float, blocks: int, changeover: float
) -> list[int] | None:
    """Return at most `blocks` candidates of least time, None if none are found."""
    rates, target, within = (
        _RATE * problem.rates,
        _DEPTH * problem.target,
        _DEPTH * tolerance,
    )
    count, guard = rates.shape[1], problem.guard_rows
    room = np.where(
        rates > 0.0,
        (target + within)[:, None] / np.where(rates > 0.0, rates, 1.0),
        np.inf,
    )
    longest = np.clip(
        room.min(axis=0), 0.0, 1e9
    )  # alone it would exceed the target beyond it
    one = np.eye(count)
    rows = [
        LinearConstraint(
            csr_array(np.hstack([rates, np.zeros_like(rates)])),
            target - within,
            target + within,
        ),
        LinearConstraint(csr_array(np.hstack([one, -np.diag(longest)])), -np.inf, 0.0),
        LinearConstraint(
            np.append(np.zeros(count), np.ones(count))[None], 0.0, float(blocks)
        ),
    ]
    if len(guard):
        rows.append(
            LinearConstraint(np.hstack([guard, np.zeros_like(guard)]), -np.inf, 0.0)
        )
    options: dict[str, Any] = {"node_limit": _NODES, "mip_rel_gap": _GAP}
    found = milp(
        np.append(_HOURS * problem.time, np.full(count, _TIME * changeover)),
        constraints=rows,
        integrality=np.append(np.zeros(count), np.ones(count)),
        bounds=Bounds(np.zeros(2 * count), np.append(longest, np.ones(count))),
        options=options,
    )
    if found.x is None:
        return None
    return [int(k) for k in np.flatnonzero(found.x[count:] > 0.5)]
