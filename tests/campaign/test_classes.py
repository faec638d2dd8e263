"""Classes of operating points by their work, and the cheapest models that keep a bound together."""

import numpy as np
import pytest

from wearsim.campaign.classes import CLASSES, cheapest, point_classes


def test_the_least_points_that_do_a_fifth_of_the_work_are_minor():
    """Shares 0.02, 0.18 | 0.3 | 0.5, the last one without weight; not in order."""
    found = point_classes(np.array([30.0, 2.0, 50.0, 18.0, 400.0]), np.array([1.0, 1.0, 1.0, 1.0, 0.0]))
    assert [CLASSES[k] for k in found] == ["middle", "minor", "leading", "minor", "leading"]


def test_one_point_that_does_all_leads_and_so_do_all_if_none_works():
    assert point_classes(np.array([1.0, 0.0]), np.array([0.5, 0.5])).tolist() == [2, 0]
    assert point_classes(np.zeros(3), np.full(3, 1.0)).tolist() == [2, 2, 2]


def test_the_cheapest_is_found_among_all_assignments():
    """Against a search by hand: 4 candidates, 3 classes, random differences; the bound is that of the sum."""
    random = np.random.default_rng(6)
    difference = random.normal(0.0, 1.0, (4, 3, 2, 5)) * np.array([1.0, 0.3, 0.1, 0.0])[:, None, None, None]
    cost, count = [1.0, 1.5, 20.0, 70.0], [7, 2, 3]
    for bound in (0.05, 0.3, 0.6, 1.5):
        chosen, error = cheapest(difference, cost, count, bound)
        assert error == pytest.approx(np.abs(sum(difference[k, c] for c, k in enumerate(chosen))).max())
        assert error <= bound
        price = np.dot([cost[k] for k in chosen], count)
        for other in np.ndindex(4, 4, 4):
            if np.dot([cost[k] for k in other], count) < price - 1e-9:
                assert np.abs(sum(difference[k, c] for c, k in enumerate(other))).max() > bound


def test_refusing_candidates_are_not_taken_and_a_bound_nobody_keeps_is_an_error():
    difference = np.array([[np.inf, 0.1], [0.2, 0.1]])
    assert cheapest(difference, [1.0, 2.0], [1, 1], 0.5)[0] == (1, 0)
    with pytest.raises(ValueError, match="no candidate"):
        cheapest(difference, [1.0, 2.0], [1, 1], 0.05)
