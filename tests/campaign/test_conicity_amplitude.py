"""Amplitude for which a campaign evaluates the equivalent conicity."""

from pathlib import Path

import numpy as np

from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.campaign.row import header_of, recorded_measures
from wearsim.profile.conicity import equivalent_conicity
from wearsim.scene import build, load_scene

RIG = Path(__file__).parents[1] / "data" / "scene_rig.toml"


def test_the_conicity_is_that_of_the_stated_amplitude(tmp_path):
    found = {}
    for amplitude in (3.0, 5.0):
        keys = {"wheelset.conicity_amplitude_mm": amplitude}
        setup = build(load_scene(RIG, overrides=keys))
        state, _ = WheelsetEvolution(setup).start()
        value = recorded_measures(state, setup)["equivalent_conicity"]
        wheels, rail = setup.wheelset, setup.counterface.profile
        expected = equivalent_conicity(
            wheels.right, wheels.left, rail, amplitude=1e-3 * amplitude
        )
        np.testing.assert_allclose(value, expected, rtol=1e-12)
        # results of 3 mm, as of all earlier versions, do not state it
        stated = header_of(setup, "").attributes.get("conicity_amplitude", 3e-3)
        assert stated == 1e-3 * amplitude
        found[amplitude] = float(value)
    assert abs(found[5.0] / found[3.0] - 1.0) > 0.02
