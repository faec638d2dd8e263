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
_MARGIN = 1.05  # of the error allowed over the smallest one, if that is too large
_ALONE = 1e-3  # of a row of the guard, by which a single candidate may exceed it
_NONE = (2, 4)  # of HiGHS: infeasible, or open where the tolerance is at its border
_POOL = 75  # candidates that the integer programme chooses from
_NODES = 20  # of its tree: a limit in seconds would depend on the machine
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
    """(q, n) rows of order 1 whose product with the distances must not be positive."""

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
        """Guard (q, n), without rows where there is none."""
        return self.guard if self.guard.size else np.zeros((0, self.time.size))


@dataclass(frozen=True)
class Durations:
    """Distances of candidates [m], and what limits them."""

    distance: FloatArray  # (n,) [m]
    tolerance: float  # within which the pattern is reproduced [m]
    deeper: FloatArray  # (p,) time saved per metre more of allowed depth [s/m]
    shallower: FloatArray  # (p,) time saved per metre less of required depth [s/m]
    guard: FloatArray  # (q,) price of each row of the guard, 0 if it is slack [s/m]

    def price(self, problem: Problem) -> FloatArray:
        """Reduced cost of candidates (n,), those not among the solution, too [s/m]."""
        worth = problem.rates.T @ (self.deeper - self.shallower)
        return problem.time + worth + problem.guard_rows.T @ self.guard

    @property
    def blocks(self) -> IntArray:
        """Candidates with a distance."""
        return np.flatnonzero(self.distance > _LEAST * self.distance.max(initial=0.0))


@dataclass(frozen=True)
class PatternError:
    """Error of a wear pattern against its target [m]."""

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
    count, ones = rates.shape[1], np.ones((target.size, 1))
    guard = problem.guard_rows
    above = np.block(
        [[rates, -ones], [-rates, -ones], [guard, np.zeros((len(guard), 1))]]
    )
    limit = np.concatenate([target, -target, np.zeros(len(guard))])
    solution = linprog(
        np.append(np.zeros(count), 1.0), A_ub=above, b_ub=limit, method="highs"
    )
    if solution.status != 0:
        raise NumericalError(
            f"the linear programme of the smallest error failed: {solution.message}"
        )
    distance = np.maximum(solution.x[:count], 0.0) / _LENGTH
    return float(np.abs(problem.residual(distance)).max()), distance


def shortest(problem: Problem, tolerance: float) -> Durations | None:
    """Distances of least time within a tolerance [m] of the target, or None.

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
    solution = linprog(_HOURS * problem.time, A_ub=above, b_ub=limit, method="highs")
    if solution.status in _NONE:
        return None
    if solution.status != 0:
        raise NumericalError(
            f"the linear programme of the durations failed: {solution.message}"
        )
    distance = np.maximum(solution.x, 0.0) / _LENGTH
    _check_tolerance(problem, distance, tolerance)
    dual = -solution.ineqlin.marginals  # h/um, of the guard h/km
    places, to_seconds = target.size, 3600.0 * _DEPTH
    deeper, shallower = to_seconds * dual[: 2 * places].reshape(2, places)
    binding = dual[2 * places :] / _HOURS
    return Durations(distance, tolerance, deeper, shallower, binding)


def _check_tolerance(problem: Problem, distance: FloatArray, tolerance: float) -> None:
    """Raise a NumericalError if distances miss the tolerance they should keep."""
    error = float(np.abs(problem.residual(distance)).max())
    if error > tolerance + _SLACK * (tolerance + float(np.abs(problem.target).max())):
        raise NumericalError(
            "the linear programme returned durations with an error of "
            f"{_DEPTH * error:.4g} um at a tolerance of {_DEPTH * tolerance:.4g} um"
        )


def greedy(problem: Problem, blocks: int, swaps: int = 2) -> IntArray:
    """Candidates whose pattern comes near the target by least squares.

    At most `blocks` of them. Each is the one that fits best what those before leave;
    after each, all are exchanged in turn for the best one in their place, `swaps`
    times. Candidates that alone violate the guard are left out.
    """
    allowed = np.flatnonzero(problem.guard_rows.max(axis=0, initial=0.0) <= _ALONE)
    rates, target = _RATE * problem.rates[:, allowed], _DEPTH * problem.target
    length = np.linalg.norm(rates, axis=0)
    length = np.where(length > 0.0, length, np.inf)
    chosen: list[int] = []

    def best(others: list[int]) -> int:
        part = rates[:, others]
        residual = target - part @ nnls(part, target)[0] if others else target
        gain = (residual @ rates) / length
        gain[others] = -np.inf
        return int(gain.argmax())

    for _ in range(min(blocks, allowed.size)):
        chosen.append(best(chosen))
        for k in list(range(len(chosen))) * swaps:
            chosen[k] = best(chosen[:k] + chosen[k + 1 :])
    return np.asarray(allowed[sorted(chosen)], dtype=np.int64)


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
    spanning: IntArray | None = None,
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
    spanning : (k,) int array, optional
        Candidates of which all others are mixtures: they alone decide the linear
        programme without limit of the blocks.

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
    count = problem.time.size
    candidates = np.arange(count) if spanning is None else spanning
    part = problem.only(candidates)
    within, free = tolerance, shortest(part, tolerance)
    if free is None:
        within = max(tolerance, _MARGIN * smallest_error(part)[0])
        free = shortest(part, within)
    if free is None:
        raise NumericalError("no durations within the smallest error that was found")
    if not blocks or len(free.blocks) <= blocks:
        return _durations_of_all(free, candidates, count)
    picked, kept = greedy(problem, blocks), fewer(part, free.blocks, blocks)
    ways = [picked, candidates[kept]]
    errors = [smallest_error(problem.only(way))[0] for way in ways]
    chosen, error = ways[int(np.argmin(errors))], min(errors)
    cheapest = np.argsort(free.price(problem), kind="stable")[:_POOL]
    pool = list(dict.fromkeys([*candidates[free.blocks], *picked, *cheapest]))[:_POOL]
    selection = _integer(problem.only(np.array(pool)), within, blocks, changeover)
    if selection is not None:
        chosen, error = np.array(pool)[selection], 0.0
    chosen = np.sort(chosen)
    best = shortest(problem.only(chosen), max(within, _MARGIN * error))
    if best is None:
        raise NumericalError("the blocks of the integer programme miss its tolerance")
    return _durations_of_all(best, chosen, count)


def _durations_of_all(durations: Durations, chosen: IntArray, count: int) -> Durations:
    """Durations of some of `count` candidates as those of all."""
    distance = np.zeros(count)
    distance[chosen] = durations.distance
    return replace(durations, distance=distance)


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
    identity = np.eye(count)
    rows = [
        LinearConstraint(
            csr_array(np.hstack([rates, np.zeros_like(rates)])),
            target - within,
            target + within,
        ),
        LinearConstraint(
            csr_array(np.hstack([identity, -np.diag(longest)])), -np.inf, 0.0
        ),
        LinearConstraint(
            np.append(np.zeros(count), np.ones(count))[None], 0.0, float(blocks)
        ),
    ]
    if len(guard):
        rows.append(
            LinearConstraint(np.hstack([guard, np.zeros_like(guard)]), -np.inf, 0.0)
        )
    options: dict[str, Any] = {"node_limit": _NODES, "mip_rel_gap": _GAP}
    solution = milp(
        np.append(_HOURS * problem.time, np.full(count, _TIME * changeover)),
        constraints=rows,
        integrality=np.append(np.zeros(count), np.ones(count)),
        bounds=Bounds(np.zeros(2 * count), np.append(longest, np.ones(count))),
        options=options,
    )
    if solution.x is None:
        return None
    return [int(k) for k in np.flatnonzero(solution.x[count:] > 0.5)]
