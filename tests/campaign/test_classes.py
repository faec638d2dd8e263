"""Classes of operating points by their work, and the cheapest models that keep a bound together."""

import numpy as np
import pytest

from wearsim.campaign.choose import CLASSES, cheapest, point_classes


def test_classes_part_the_work_in_rising_order():
    """Shares 0.01, 0.09 | 0.2 | 0.3 | 0.4, and a point without weight; not in order."""
    found = point_classes(np.array([20.0, 1.0, 40.0, 9.0, 400.0, 30.0]), np.array([1.0, 1, 1, 1, 0, 1]))
    assert [CLASSES[k] for k in found] == ["minor", "least", "leading", "least", "leading", "major"]


def test_one_point_that_does_all_leads_and_so_do_all_if_none_works():
    assert [CLASSES[k] for k in point_classes(np.array([1.0, 0.0]), np.array([0.5, 0.5]))] == [
        "leading",
        "least",
    ]
    assert [CLASSES[k] for k in point_classes(np.zeros(3), np.full(3, 1.0))] == ["leading"] * 3


def test_the_cheapest_is_found_among_all_with_better_models_for_more_work():
    """Against a search by hand: 4 candidates, 3 classes, random differences; the bound is that of the sum."""
    random = np.random.default_rng(6)
    difference = random.normal(0.0, 1.0, (4, 3, 2, 5)) * np.array([1.0, 0.3, 0.1, 0.0])[:, None, None, None]
    cost, count = [1.0, 1.5, 20.0, 70.0], [7, 2, 3]
    found = set()
    for bound in (0.05, 0.2, 0.3, 0.6, 1.5, 9.0):
        chosen, error = cheapest(difference, cost, count, bound)
        found.add(chosen)
        assert error == pytest.approx(np.abs(sum(difference[k, c] for c, k in enumerate(chosen))).max())
        assert error <= bound
        assert list(chosen) == sorted(chosen)
        price = np.dot([cost[k] for k in chosen], count)
        for other in np.ndindex(4, 4, 4):
            if list(other) == sorted(other) and np.dot([cost[k] for k in other], count) < price - 1e-9:
                assert np.abs(sum(difference[k, c] for c, k in enumerate(other))).max() > bound
    assert len(found) >= 4


def test_refusing_candidates_are_not_taken_and_a_bound_nobody_keeps_is_an_error():
    difference = np.array([[np.inf, 0.1], [0.2, 0.1]])
    assert cheapest(difference, [1.0, 2.0], [1, 1], 0.5)[0] == (1, 1)
    with pytest.raises(ValueError, match="no candidate"):
        cheapest(difference, [1.0, 2.0], [1, 1], 0.05)
