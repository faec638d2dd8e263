"""Points that begin at equilibria of like points: the same solutions with less work,
none lost.
"""

from dataclasses import replace

import numpy as np
import pytest

from wearsim.contact import loaded
from wearsim.contact import solve as of_chunks
from wearsim.contact.axle import ROLL
from wearsim.contact.problem import PLACED
from wearsim.contact.solve import solve
from wearsim.errors import ContactError

SHIFT, YAW = (
    1e-3 * np.array([0.0, 3.0, 5.9, 6.5]),
    1e-3 * np.array([0.0, 1.0, 2.0, 3.0]),
)


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


@pytest.fixture(params=[1.0, 1e-3], ids=["deep step", "small step"])
def nearby(request, anew, conditions):
    """Away from the equilibria as far as a deep wear step moves them, or a small
    one.
    """
    away = np.array([0.05, 3e-3, -3e-3, 0.2, 0.05, *[0.02] * PLACED**2])
    moved = np.where(conditions.free_roll, away, -3e-3) * request.param
    return replace(conditions, nearby=first_of_each(anew) + moved)


def test_solutions_are_those_from_the_wheel_loads(anew, solved, nearby):
    """Loads balance to 1e-6, both rolls to 1e-9 m between the wheels, which last steps
    move by as much.
    """
    found = solved(nearby)
    np.testing.assert_array_equal(found.point, anew.point)
    np.testing.assert_allclose(found.normal_force, anew.normal_force, rtol=5e-6)
    falls = -anew.nearby[:, PLACED + PLACED * ROLL + ROLL]
    between = (found.roll - anew.roll) * falls * 2.0 * 0.75
    np.testing.assert_allclose(between, 0.0, atol=4e-9)
    np.testing.assert_allclose(
        found.power, anew.power, rtol=1e-4, atol=1e-6 * anew.power.max()
    )


def test_no_coarse_patch_is_asked_for(monkeypatch, solved, nearby):
    monkeypatch.setattr(of_chunks, "begun_with_coarse_patches", None)
    asked = []
    normal_of = loaded.normal_of

    def counted(*given, **options):
        asked.append(options["rough"])
        return normal_of(*given, **options)

    monkeypatch.setattr(loaded, "normal_of", counted)
    solved(nearby)
    assert asked
    assert not any(asked)


@pytest.fixture
def free(points):
    return replace(points(SHIFT, YAW, rotation="free"), free_roll=True)


def test_slopes_of_an_equilibrium_are_kept_where_it_is_solved_again(free, solved):
    """What the residuals do with the roll is not taken for what they do with speed and
    loads.
    """
    here = first_of_each(solved(free))
    again = first_of_each(solved(replace(free, nearby=here)))
    np.testing.assert_allclose(again[:, PLACED:], here[:, PLACED:], atol=0.02)


def test_a_point_that_fails_in_the_second_roll_begins_anew(monkeypatch, free, solved):
    """It alone: its bits are those from the wheel loads."""
    anew = solved(free)
    away = np.where(np.arange(PLACED + PLACED**2) == ROLL, 0.1, 0.0)
    nearby, normal_of, sides = (
        replace(free, nearby=first_of_each(anew) + away),
        loaded.normal_of,
        [],
    )

    def failing(task, side, *given, **options):
        sides.append(side.number)
        if len(sides) == 4:
            raise ContactError("no contact", row=2)
        return normal_of(task, side, *given, **options)

    monkeypatch.setattr(loaded, "normal_of", failing)
    found = solved(nearby)
    assert sides[:4] == [0, 1, 0, 1]
    same = {
        point: np.array_equal(
            *(one.normal_force[one.point == point] for one in (found, anew))
        )
        for point in range(SHIFT.size)
    }
    assert same == {0: False, 1: False, 2: True, 3: False}


def test_a_point_does_not_hang_on_the_others(solved, nearby):
    whole = solved(nearby)
    for k in range(SHIFT.size):
        alone, own = solved(nearby.at(np.array([k]))), whole.point == k
        np.testing.assert_allclose(
            alone.normal_force, whole.normal_force[own], rtol=1e-12
        )
        np.testing.assert_allclose(alone.roll, whole.roll[own], rtol=1e-12)


@pytest.mark.parametrize(
    "wrong", [np.nan, 30.0], ids=["unknown", "loads that no wheel carries"]
)
def test_a_point_that_has_nothing_nearby_begins_anew(anew, solved, nearby, wrong):
    """Its bits are those without anything nearby; the others begin where they would."""
    lost = nearby.nearby.copy()
    lost[1] = wrong
    found, without = solved(replace(nearby, nearby=lost)), solved(nearby)
    own = found.point == 1
    assert np.array_equal(found.normal_force[own], anew.normal_force[own])
    assert np.array_equal(found.power[~own], without.power[~own])


def test_a_point_without_contact_is_the_error_it_is_without_anything_nearby(
    solved, nearby
):
    off = replace(nearby, shift=np.array([0.0, 3e-3, 5.9e-3, 0.2]))
    with pytest.raises(ContactError) as wanted:
        solved(replace(off, nearby=None))
    with pytest.raises(ContactError) as caught:
        solved(off)
    assert (str(caught.value), caught.value.row) == (
        str(wanted.value),
        wanted.value.row,
    )


def test_given_normal_forces_are_carried_whatever_is_nearby(
    points, wheelset, counterface, coarse
):
    """What begins at an equilibrium of vertical loads has the normal force that is
    asked for.
    """
    conditions = points(np.array([1e-3, 2e-3]), np.array([0.0, 5e-3]))
    near = solve(conditions, wheelset, counterface(), coarse)
    first = near.nearby[np.searchsorted(near.point, [0, 1])]
    found = solve(
        replace(conditions, nearby=first),
        wheelset,
        counterface(),
        coarse,
        vertical=False,
    )
    np.testing.assert_allclose(found.normal_force, 80e3, rtol=1e-9)
