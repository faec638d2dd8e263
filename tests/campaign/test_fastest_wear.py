"""Operating point of the fastest wear, which a campaign that crawls names."""

from types import SimpleNamespace

import numpy as np

from wearsim.campaign.evaluate import fastest_wear

POINTS = SimpleNamespace(
    label=("straight", "curve", "monitor"), environment=np.array([1.0, 0.2, 1.0])
)


def named(weight, rate):
    """Name of the point of the fastest wear, with two patches of the curve."""
    contact = SimpleNamespace(point=np.array([0, 1, 1, 2]))
    evaluation = SimpleNamespace(
        weight=np.array(weight),
        passage=SimpleNamespace(contact=contact),
        wear=SimpleNamespace(depth_rate_max=np.array(rate)),
    )
    return fastest_wear(evaluation, POINTS)


def test_the_point_counts_with_its_weight_and_environment_factor():
    assert named([0.5, 0.5, 0.0], [1.0, 2.0, 4.0, 99.0]) == "straight"
    assert named([0.5, 0.5, 0.0], [1.0, 2.0, 6.0, 99.0]) == "curve"
    assert named([0.1, 0.9, 0.0], [1.0, 2.0, 4.0, 99.0]) == "curve"


def test_no_wear_has_no_name():
    assert named([0.5, 0.5, 0.0], [0.0, 0.0, 0.0, 0.0]) == ""
