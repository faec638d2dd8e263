"""What tests of commands share."""

from types import SimpleNamespace

import pytest

from wearsim.studies.plan import Estimate


@pytest.fixture(autouse=True)
def brief_trials(monkeypatch):
    """`wearsim check` runs campaigns for a moment; how well it foretells them is tested in tests/studies."""
    monkeypatch.setattr("wearsim.studies.plan._EFFORT", 0.1)


@pytest.fixture
def untried(monkeypatch):
    """Scenes of which `wearsim check` tries no wear steps: tests/cli/test_commands.py does so."""
    given = Estimate(1234, 100.0, "left", 0.6, "error", 20.4e6, "hollowing", 5678)
    monkeypatch.setattr("wearsim.studies.plan.estimate", lambda *_: given)
    begun = SimpleNamespace(start=lambda: (None, None))
    monkeypatch.setattr("wearsim.studies.plan.WheelsetEvolution", lambda *_, **__: begun)
