"""What tests of commands share."""

import pytest

from wearsim.studies.estimate import Estimate


@pytest.fixture
def untried(monkeypatch):
    """Scenes of which `wearsim check` tries no wear step: tests/cli/test_commands.py
    does so.
    """
    given = Estimate(1234, 100.0, "left", 0.6, "error", 20.4e6, "hollowing", 5678)
    pairs = [
        {"name": name, "seconds": 50.0, "wear_rate": off, "power": off, "pressure": off}
        for name, off in (("fast", 0.04), ("standard", -0.01), ("accurate", 0.0))
    ]
    models = {"points": 4, "wear_share": 0.9, "pairs": pairs}
    monkeypatch.setattr("wearsim.studies.plan.estimate", lambda *_: given)
    monkeypatch.setattr("wearsim.studies.plan.compared", lambda *_: models)
