"""Operating points without contact solution: who acts for them, and what share of the
wear they carry.
"""

import numpy as np
import pytest

from wearsim.operation.points import carried_share, shared_weight

OF_CLASS = np.array([0, 0, 0, 1, 2])
WEIGHT = np.array([0.1, 0.2, 0.1, 0.5, 0.1])


def out(*numbers):
    return np.isin(np.arange(WEIGHT.size), numbers)


def test_weight_stays_in_the_class_and_a_class_that_is_out_has_none():
    assert shared_weight(WEIGHT, OF_CLASS, out()) is WEIGHT
    np.testing.assert_allclose(
        shared_weight(WEIGHT, OF_CLASS, out(0)),
        [0, 0.8 / 3, 0.4 / 3, 0.5, 0.1],
        rtol=1e-15,
    )
    np.testing.assert_array_equal(
        shared_weight(WEIGHT, OF_CLASS, out(3, 4)), [0.1, 0.2, 0.1, 0, 0]
    )


@pytest.mark.parametrize(
    ("rate", "numbers", "share"),
    [
        ([1, 1, 1, 1, 1], (), 0.0),
        ([4, 1, 1, 1, 1], (0,), 0.4 / 1.3),  # its own last rate
        ([np.nan, 1, 3, 1, 1], (0,), 0.3 / 1.4),  # the largest of its class
        ([1, 1, 1, 1, np.nan], (4,), 1.0),  # nothing of its class was ever solved
        ([0, 0, 0, 0, np.nan], (4,), 1.0),  # nor where nothing wears
        (
            [0, 3, 3, 0, 0],
            (0,),
            0.3 / 0.9,
        ),  # what the others of its class wear in its place
        ([0, 0, 0, 0, 0], (3,), 0.5),  # nothing wears: the distance
        ([np.nan] * 5, (0, 1, 2, 3, 4), 1.0),
    ],
)
def test_share_of_the_wear(rate, numbers, share):
    assert carried_share(
        WEIGHT, OF_CLASS, np.array(rate, float), out(*numbers)
    ) == pytest.approx(share, rel=1e-12)


def test_watched_points_carry_nothing():
    weight = np.where(OF_CLASS == 2, 0.0, WEIGHT)
    assert carried_share(weight, OF_CLASS, np.ones(5), out(4)) == 0.0
