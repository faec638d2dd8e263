"""Durations of set-points for a pattern: closed forms, tolerance, few blocks, units."""

import itertools

import numpy as np
import pytest
from scipy.optimize import linprog

from wearsim.translation.guard import scaled
from wearsim.translation.programme import (
    Problem,
    few_blocks,
    fewer,
    greedy,
    pattern_error,
    shortest,
    smallest_error,
)

Y = np.linspace(-30e-3, 30e-3, 61)


def bumps(places, width=6e-3, rate=3e-10):
    """Wear curves (p, n) of candidates [m/m]."""
    return rate * np.exp(-0.5 * ((Y[:, None] - np.asarray(places)) / width) ** 2)


@pytest.fixture
def problem():
    """Overlapping curves, and the pattern of three of them, 50 um deep."""
    rates = bumps(np.linspace(-20e-3, 20e-3, 21))
    distance = np.zeros(21)
    distance[[3, 10, 16]] = 1.0, 2.0, 0.5
    target = rates @ distance
    return Problem(rates * 1.0, 50e-6 * target / target.max(), np.full(21, 1 / 20.0))


def test_independent_patterns_without_tolerance_return_the_durations_of_the_target():
    """Each candidate wears alone at its place."""
    rates = np.diag([1e-10, 2e-10, 4e-10])
    distance = np.array([3e5, 2e5, 1e5])
    found = shortest(Problem(rates, rates @ distance, np.ones(3)), 0.0)
    np.testing.assert_allclose(found.distance, distance, rtol=1e-9)


def test_one_candidate_runs_until_the_pattern_is_within_the_tolerance():
    """The shortest one stays the tolerance short of the deepest place."""
    rates = bumps([0.0])
    target = 1e5 * rates[:, 0]
    deepest = target.max()
    found = shortest(Problem(rates, target, np.full(1, 0.05)), 0.1 * deepest)
    np.testing.assert_allclose(found.distance, [0.9e5], rtol=1e-7)
    # at the deepest place alone more allowed depth saves time: 1 / rate / V
    np.testing.assert_allclose(found.shallower.max(), 0.05 / rates.max(), rtol=1e-6)
    assert not found.deeper.any()


def test_the_faster_of_two_equal_patterns_runs():
    rates = bumps([0.0, 0.0]) * [1.0, 3.0]
    target = 1e5 * rates[:, 0]
    found = shortest(Problem(rates, target, np.ones(2)), 0.0)
    np.testing.assert_allclose(found.distance, [0.0, 1e5 / 3.0], rtol=1e-7)
    dear = shortest(Problem(rates, target, np.array([1.0, 4.0])), 0.0)
    np.testing.assert_allclose(dear.distance, [1e5, 0.0], rtol=1e-7)


def test_the_pattern_of_a_hidden_programme_is_found(problem):
    error, distance = smallest_error(problem)
    assert error < 1e-9 * problem.target.max() + 1e-12
    assert pattern_error(problem.rates @ distance, problem.target).share < 1e-6


def test_tolerance_holds_and_time_falls_with_it(problem):
    times = []
    for share in (0.0, 0.02, 0.05, 0.1):
        found = shortest(problem, share * 50e-6)
        error = pattern_error(problem.rates @ found.distance, problem.target)
        assert error.share <= share + 1e-6
        times.append(problem.time @ found.distance)
    assert (np.diff(times) < 0.0).all()


def test_si_units_fail_without_a_word_and_ours_hold():
    """In SI HiGHS drops entries below 1e-9, and reports success beyond the bound."""
    places = np.linspace(-20e-3, 20e-3, 41)
    rates = np.hstack([bumps(places, 3e-3, 2e-9), bumps(places, 8e-3, 9e-10)])
    target = 50e-6 * np.exp(-0.5 * (Y / 9e-3) ** 2)
    bound = 0.05 * target.max()
    limit = np.concatenate([target + bound, bound - target])
    raw = linprog(
        np.ones(82), A_ub=np.vstack([rates, -rates]), b_ub=limit, method="highs"
    )
    assert raw.status == 0
    assert np.abs(rates @ raw.x - target).max() > 2.0 * bound
    found = shortest(Problem(rates, target, np.ones(82)), bound)
    assert np.abs(rates @ found.distance - target).max() <= bound * (1.0 + 1e-5)


def test_out_of_reach_is_none_and_the_smallest_error_is_where_nothing_wears():
    rates = bumps([-15e-3, -10e-3], width=3e-3)
    target = 40e-6 * np.exp(-0.5 * ((Y - 15e-3) / 3e-3) ** 2) + 1e5 * rates[:, 0]
    problem = Problem(rates, target, np.ones(2))
    assert shortest(problem, 5e-6) is None
    error, distance = smallest_error(problem)
    worst = pattern_error(rates @ distance, target)
    assert worst.largest == pytest.approx(error, rel=1e-9)
    assert Y[worst.at] == pytest.approx(15e-3, abs=1e-3)
    assert error == pytest.approx(40e-6, rel=0.01)


@pytest.mark.parametrize("blocks", [1, 2, 3])
def test_few_blocks_keep_to_their_number_and_to_the_error_they_state(problem, blocks):
    found = few_blocks(problem, 0.05 * 50e-6, blocks)
    assert 0 < len(found.blocks) <= blocks
    error = np.abs(problem.residual(found.distance)).max()
    assert error <= found.tolerance * (1.0 + 1e-5)
    assert (found.tolerance <= 0.05 * 50e-6) == (blocks == 3)


def test_no_two_blocks_are_much_faster():
    """Brute force over all pairs."""
    rates = bumps(np.linspace(-20e-3, 20e-3, 13)) * np.linspace(1.0, 3.0, 13)
    target = rates[:, [2, 9]] @ [1e5, 5e4]
    problem = Problem(rates, target, np.full(13, 0.05))
    tolerance = 0.1 * target.max()
    found = few_blocks(problem, tolerance, 2)
    assert found.tolerance == tolerance
    pairs = [np.array(pair) for pair in itertools.combinations(range(13), 2)]
    ways = [(one, shortest(problem.only(one), tolerance)) for one in pairs]
    times = [problem.time[one] @ way.distance for one, way in ways if way is not None]
    assert problem.time @ found.distance <= 1.05 * min(times)


def test_changeovers_cost_blocks(problem):
    dear = few_blocks(problem, 0.1 * 50e-6, 5, changeover=1e9)
    cheap = few_blocks(problem, 0.1 * 50e-6, 5)
    assert len(dear.blocks) <= len(cheap.blocks)


def test_greedy_finds_patterns_far_apart_and_leaving_out_keeps_the_best(
    problem,
):
    narrow = bumps(np.linspace(-20e-3, 20e-3, 21), width=1e-3)
    apart = Problem(narrow, narrow[:, [3, 10, 16]] @ [1e5, 2e5, 5e4], problem.time)
    assert greedy(apart, 3).tolist() == [3, 10, 16]
    kept = fewer(problem, np.array([0, 3, 10, 16, 20]), 3)
    assert kept.tolist() == [3, 10, 16]


def test_a_guard_keeps_a_candidate_to_its_share():
    """Of two equal patterns the fast one may bring 5 % of the wear."""
    rates = bumps([0.0, 0.0]) * [1.0, 3.0]
    worn = rates.sum(axis=0)
    guard = scaled((worn * [-0.05, 0.95])[None])
    target = 1e5 * rates[:, 0]
    found = shortest(Problem(rates, target, np.ones(2), guard), 0.0)
    brought = found.distance * worn
    assert brought[1] / brought.sum() == pytest.approx(0.05, rel=1e-6)
    assert found.guard[0] > 0.0


def test_the_error_of_a_pattern_is_over_its_deepest():
    target = np.array([0.0, 1.0, 4.0])
    error = pattern_error(np.array([0.2, 1.0, 3.0]), target)
    assert (error.largest, error.at, error.deepest) == (1.0, 2, 4.0)
    assert error.share == 0.25
    assert error.rms == pytest.approx(np.sqrt(0.5))
