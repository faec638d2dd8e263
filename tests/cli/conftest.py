"""What tests of commands share."""

import pytest


@pytest.fixture(autouse=True)
def brief_trials(monkeypatch):
    """`wearsim check` runs campaigns for a moment; how well it foretells them is tested in tests/studies."""
    monkeypatch.setattr("wearsim.studies.plan._EFFORT", 0.1)
