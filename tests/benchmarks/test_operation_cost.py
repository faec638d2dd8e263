"""Share of the time of a campaign in which it finds where its wheelsets run; printed, never asserted."""

import time

import pytest

from wearsim.campaign import evolution as module
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.profile.standard import shipped_path
from wearsim.scene import build, load_scene

pytestmark = pytest.mark.benchmark
STEPS = 3


@pytest.mark.parametrize("name", ["field.toml", "rig.toml"])
def test_share_of_operation(name, show, monkeypatch):
    spent, settle = [0.0], module.settled_state

    def timed(*given):
        began = time.process_time()
        try:
            return settle(*given)
        finally:
            spent[0] += time.process_time() - began

    monkeypatch.setattr(module, "settled_state", timed)
    evolution = WheelsetEvolution(build(load_scene(shipped_path("workflows", name))), threads=1)
    state, taken = evolution.start()
    state, taken = evolution.advance(state, evolution.evaluate(state, taken))  # compiles
    began, spent[0] = time.process_time(), 0.0
    for _ in range(STEPS):
        state, taken = evolution.advance(state, evolution.evaluate(state, taken))
    whole = time.process_time() - began
    show(f"{name}: {whole / STEPS:.2f} s per wear step, {spent[0] / whole:.0%} of it to find where axles run")
