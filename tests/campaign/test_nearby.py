"""Where the contact of a state is expected: a line through those of the states before."""

from dataclasses import replace

import numpy as np
import pytest

from wearsim.campaign.nearby import expected, found, rate_to, remembered
from wearsim.contact.problem import NEARBY

LATEST = [1, *range(5, NEARBY)]  # columns that follow no line


@pytest.fixture
def contact(solution):
    """Function that gives a contact whose three points were solved at a place (3, 14)."""
    return lambda nearby: replace(solution, nearby=nearby[solution.point])


@pytest.fixture
def begun(state):
    return replace(state, active_weight=np.array([1.0, 0.0, 0.0]))


def test_contact_is_expected_on_the_line_through_two_states(begun, contact):
    first = np.arange(3.0 * NEARBY).reshape(3, NEARBY)
    per_metre = 1e-3 * (first + 1.0)
    here = remembered(begun, contact(first), 3)
    stage, end = (replace(here, distance=here.distance + metres) for metres in (20.0, 50.0))
    latest = found(contact(first + 20.0 * per_metre), here.nearby)
    rate = rate_to(here, stage, latest)
    there = expected(here, end, rate, latest)
    line = first + 50.0 * per_metre
    line[:, LATEST] = latest[:, LATEST]
    np.testing.assert_allclose(there.nearby, line, rtol=1e-12)
    # the next step goes on at that rate with the points that acted; the others stay where they were
    after = remembered(there, contact(line), 3)
    np.testing.assert_allclose(after.nearby_rate[0], rate[0])
    assert not after.nearby_rate[1:].any()


def test_points_without_a_contact_so_far_have_none_until_they_are_solved(begun, contact):
    first = np.arange(3.0 * NEARBY).reshape(3, NEARBY)
    one = contact(first)
    only = replace(one, point=np.zeros_like(one.point))
    here = remembered(begun, only, 3)
    assert np.isnan(here.nearby[1:]).all()
    ahead = replace(here, distance=here.distance + 10.0)
    latest = found(one, here.nearby)
    rate = rate_to(here, ahead, latest)
    assert np.isfinite(rate).all()
    assert np.isnan(expected(here, ahead, rate, latest).nearby[1:, 0]).all()
    assert np.isfinite(remembered(ahead, one, 3).nearby).all()


def test_nothing_is_expected_on_new_profiles(begun):
    nowhere = np.zeros((0, NEARBY))
    assert expected(begun, begun, nowhere, nowhere) is begun
