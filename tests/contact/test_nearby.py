"""Points that begin at equilibria of like points: the same solutions with less work, none lost."""

from dataclasses import replace

import numpy as np
import pytest

from wearsim.contact import at_rest, balance
from wearsim.contact.solve import Begin, solve, solve_each
from wearsim.errors import ContactError

SHIFT, YAW = 1e-3 * np.array([0.0, 3.0, 5.9, 6.5]), 1e-3 * np.array([0.0, 1.0, 2.0, 3.0])


def first_of_each(solution):
    return solution.nearby[np.searchsorted(solution.point, np.arange(SHIFT.size))]


@pytest.fixture(params=[True, False], ids=["roll free", "roll given"])
def conditions(request, points):
    return replace(points(SHIFT, YAW, rotation="free"), free_roll=request.param)


@pytest.fixture
def solved(wheelset, counterface, coarse):
    return lambda conditions: solve(conditions, wheelset, counterface(2.0), coarse)


@pytest.fixture
def anew(solved, conditions):
    return solved(conditions)


@pytest.fixture
def nearby(anew, conditions):
    """Away from the equilibria as far as a deep wear step moves them."""
    away = np.array([2e-5, 0.05, 0.05, 3e-3, -3e-3, *[0.02] * 9])
    return replace(conditions, nearby=first_of_each(anew) + np.where(conditions.free_roll, away, -3e-3))


def test_solutions_are_those_from_the_wheel_loads(anew, solved, nearby):
    """Loads balance to 1e-6, both rolls to 1e-9 m between the wheels, which loads move by as much."""
    found = solved(nearby)
    np.testing.assert_array_equal(found.point, anew.point)
    np.testing.assert_allclose(found.normal_force, anew.normal_force, rtol=5e-6)
    between = (found.roll - anew.roll) * anew.nearby[:, 1] * 2.0 * 0.75
    np.testing.assert_allclose(between, 0.0, atol=3e-9)
    np.testing.assert_allclose(found.power, anew.power, rtol=1e-4, atol=1e-6 * anew.power.max())


def test_no_coarse_patch_is_asked_for(monkeypatch, solved, nearby):
    monkeypatch.setattr(at_rest, "_near_rest", None)
    asked = []
    normal_of = balance.normal_of

    def counted(*given, **options):
        asked.append(options["rough"])
        return normal_of(*given, **options)

    monkeypatch.setattr(balance, "normal_of", counted)
    solved(nearby)
    assert asked
    assert not any(asked)


def test_wheels_of_an_earlier_solution_save_work_and_change_nothing(
    monkeypatch, anew, conditions, wheelset, counterface, coarse
):
    """Nearby two rolls and their wheels are enough, which another solution may begin with."""
    begin = Begin(np.arange(SHIFT.size), {}, {})
    here = replace(conditions, free_roll=True, nearby=None)
    given = wheelset, counterface(2.0), coarse, lambda part: part
    (first,) = solve_each(here, *given, begin=begin)
    assert not begin.found  # nothing is known nearby
    there = replace(here, shift=SHIFT + 1e-6, nearby=first_of_each(first))
    (cold,) = solve_each(there, *given, begin=begin)
    starts = []
    normal_of = balance.normal_of

    def counted(*given, **options):
        starts.append(options["start"])
        return normal_of(*given, **options)

    monkeypatch.setattr(balance, "normal_of", counted)
    (warm,) = solve_each(there, *given, begin=Begin(begin.point, begin.found, {}))
    assert starts
    assert all(start is not None for start in starts)
    np.testing.assert_allclose(warm.normal_force, cold.normal_force, rtol=5e-6)
    np.testing.assert_allclose(warm.power, cold.power, rtol=1e-4, atol=1e-6 * cold.power.max())


def test_a_point_does_not_hang_on_the_others(solved, nearby):
    whole = solved(nearby)
    for k in range(SHIFT.size):
        alone, own = solved(nearby.at(np.array([k]))), whole.point == k
        np.testing.assert_allclose(alone.normal_force, whole.normal_force[own], rtol=1e-12)
        np.testing.assert_allclose(alone.roll, whole.roll[own], rtol=1e-12)


@pytest.mark.parametrize("wrong", [np.nan, -3.0], ids=["unknown", "no contact"])
def test_a_point_that_has_nothing_nearby_begins_anew(anew, solved, nearby, wrong):
    """Its bits are those without anything nearby; the others begin where they would."""
    lost = nearby.nearby.copy()
    lost[1] = wrong
    if not nearby.free_roll:
        lost[1, 3:] = np.where(np.isnan(wrong), np.nan, 30.0)  # loads that no wheel carries
    found, without = solved(replace(nearby, nearby=lost)), solved(nearby)
    own = found.point == 1
    assert np.array_equal(found.normal_force[own], anew.normal_force[own])
    assert np.array_equal(found.power[~own], without.power[~own])


def test_a_point_without_contact_is_the_error_it_is_without_anything_nearby(solved, nearby):
    off = replace(nearby, shift=np.array([0.0, 3e-3, 5.9e-3, 0.2]))
    with pytest.raises(ContactError) as wanted:
        solved(replace(off, nearby=None))
    with pytest.raises(ContactError) as caught:
        solved(off)
    assert (str(caught.value), caught.value.row) == (str(wanted.value), wanted.value.row)
