"""Time to find where wheelsets run, and to reduce a long record; printed, never
asserted.
"""

import time

import numpy as np
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

    def timed(*given, **named):
        began = time.process_time()
        try:
            return settle(*given, **named)
        finally:
            spent[0] += time.process_time() - began

    monkeypatch.setattr(module, "settled_state", timed)
    evolution = WheelsetEvolution(
        build(load_scene(shipped_path("workflows", name))), threads=1
    )
    state, taken = evolution.start()
    state, taken = evolution.advance(
        state, evolution.evaluate(state, taken)
    )  # compiles
    began, spent[0] = time.process_time(), 0.0
    for _ in range(STEPS):
        state, taken = evolution.advance(state, evolution.evaluate(state, taken))
    whole = time.process_time() - began
    show(
        f"{name}: {whole / STEPS:.2f} s per wear step, {spent[0] / whole:.0%} of it "
        "to find where axles run"
    )


def test_a_record_of_100_000_samples(show, tmp_path):
    """From the CSV file to the operating points of the shipped scene."""
    head, *lines = shipped_path("workflows", "recorded.csv").read_text().splitlines()
    first = np.array([line.split(",") for line in lines], dtype=float)
    many = np.tile(first, (-(-100_000 // len(first)), 1))[:100_000]
    many[:, 0] = first[0, 0] + (first[1, 0] - first[0, 0]) * np.arange(len(many))
    many[:, 1:] *= 1.0 + 0.01 * np.random.default_rng(1).standard_normal(
        many[:, 1:].shape
    )
    np.savetxt(
        tmp_path / "recorded.csv",
        many,
        fmt="%.8g",
        delimiter=",",
        header=head,
        comments="",
    )
    (tmp_path / "recorded.toml").write_text(
        shipped_path("workflows", "recorded.toml").read_text()
    )
    began = time.process_time()
    setup = build(load_scene(tmp_path / "recorded.toml"))
    taken, reduction = time.process_time() - began, setup.reduction
    show(
        f"{len(many)} samples to {len(setup.points.label)} points, binning error "
        f"{reduction.error:.1%}: CPU {taken:.1f} s (target < 60 s)"
    )
