"""What benchmarks share."""

import os
import sys
import time

import pytest

SHARE = float(os.environ.get("WEARSIM_LONG_RUNS", "1"))
"""Of the repetitions here and of what test_long_runs.py takes; CI sets little, which
tells no speed.
"""


@pytest.fixture
def cell_sizes():
    """Sides of the cells [m] half-space problems are timed with, and repetitions; the
    finest take longest.
    """
    sizes = ((1e-3, 7), (0.5e-3, 7), (0.25e-3, 3), (0.2e-3, 3), (0.1e-3, 1))
    return sizes if SHARE == 1.0 else sizes[:-1]


@pytest.fixture
def show(capsys):
    """Print past the capture of pytest."""

    def line(text):
        with capsys.disabled():
            sys.stdout.write(f"\n  {text}")

    return line


@pytest.fixture(scope="session")
def best():
    """Shortest of several wall times [s]: what the machine can do, not what else it
    does.
    """

    def shortest(function, repeats=7):
        times = []
        for _ in range(max(round(SHARE * repeats), 1)):
            start = time.perf_counter()
            function()
            times.append(time.perf_counter() - start)
        return min(times)

    return shortest
