"""What benchmarks share."""

import sys

import pytest


@pytest.fixture
def show(capsys):
    """Print past the capture of pytest."""

    def line(text):
        with capsys.disabled():
            sys.stdout.write(f"\n  {text}")

    return line
