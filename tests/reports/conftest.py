"""Reports as their scripts write them, to be compared with the committed ones."""

import re
from pathlib import Path

import pytest

REPORTS = Path(__file__).parents[2] / "reports"
NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?")


def assert_same_numbers(written, committed, tolerance=1.5):
    """Equal words, numbers to units of the last printed digit: machines round
    differently.
    """
    assert NUMBER.sub("#", written) == NUMBER.sub("#", committed)
    for ours, theirs in zip(
        NUMBER.findall(written), NUMBER.findall(committed), strict=True
    ):
        if ours != theirs:
            unit = 10.0 ** -len(theirs.partition("e")[0].partition(".")[2])
            assert abs(float(ours) - float(theirs)) < tolerance * unit, (ours, theirs)


@pytest.fixture(scope="session")
def same_numbers():
    """Compare two texts: words exactly, numbers to their last digit."""
    return assert_same_numbers


@pytest.fixture(scope="session")
def reports():
    """Folder of the committed reports."""
    return REPORTS
