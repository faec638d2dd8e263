"""What tests of commands share."""

import pytest


@pytest.fixture(autouse=True)
def brief_trials(monkeypatch):
    """`wearsim check` runs campaigns for a moment; how well it foretells them is tested in tests/studies."""
    monkeypatch.setattr("wearsim.studies.plan._EFFORT", 0.1)


@pytest.fixture
def untried(monkeypatch):
    """Scenes of which `wearsim check` tries no wear steps: tests/cli/test_commands.py does so."""
    keys = ("steps", "seconds", "slowest", "end", "limit", "bytes_per_step")
    monkeypatch.setattr(
        "wearsim.studies.plan._foreseen", lambda *_: {**dict.fromkeys(keys), "trial_fault": "not tried"}
    )
