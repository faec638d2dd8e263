"""Control of wear steps off and on: the cases of reports/wear_step_stability.md, shorter."""

from pathlib import Path

import numpy as np
import pytest

from wearsim import cli
from wearsim.profile import standard
from wearsim.studies.wear_steps import RIPPLE, cases_of, ripple, solve_wear_steps

SCENE = """
noise_um = 0.05
strips = 40
cells = 10
[scene]
kind = "wear_steps"
title = "Steps"
[[model]]
normal = "kik_piotrowski"
beyond = 4
depth_um = 150
"""


@pytest.mark.parametrize(("wavelength", "kept"), [(2e-3, 1.0), (16e-3, 0.0)])
def test_ripple_is_the_short_waves_of_the_worn_depth(wavelength, kept):
    """Transfer function of the spline: 94 % at half its wavelength, 0.4 % at four times."""
    wheel = standard.wheel("S1002", spacing=0.25e-3)
    band = 100e-6 * np.exp(-((wheel.y / 15e-3) ** 4))
    wave = 1e-6 * np.sin(2.0 * np.pi * wheel.y / wavelength)
    without = ripple(wheel.y, wheel.z, band)
    found = ripple(wheel.y, wheel.z, band + wave * (band > 0.0))
    assert without < 0.03e-6
    assert found == pytest.approx(kept * 1e-6 / np.sqrt(2.0), abs=0.06e-6)
    assert RIPPLE == 4e-3


@pytest.mark.parametrize(
    ("normal", "beyond", "depth"), [("kik_piotrowski", 4.0, 150e-6), ("half_space", 8.0, 60e-6)]
)
def test_steps_beyond_the_limit_ripple_and_control_does_not(normal, beyond, depth):
    """Ten times the waves of the controlled campaign; semi-implicit steps as long stay within three times."""
    data = solve_wear_steps(cases_of(normal, beyond), depth, 0.05e-6, 60, 10)
    last = {text: float(np.nanmax(data["ripple"][k])) for k, text in enumerate(data["text"].values)}
    controlled = last["control on"]
    assert controlled < 0.5e-6
    assert last["beyond the limit, no smoothing"] > 10.0 * controlled
    if normal == "kik_piotrowski":
        assert last["beyond the limit, smoothed, semi-implicit"] < 3.0 * controlled
    else:  # smoothing lifts the limit of a half-space
        assert last["beyond the limit, smoothed"] < 2.0 * controlled


def test_report_is_written_with_its_figure(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("steps.toml").write_text(SCENE)
    assert cli.main(["check", "steps.toml"]) == 0
    assert "kik_piotrowski: beyond the limit, no smoothing (4 times), to 150 um" in capsys.readouterr().out
    assert cli.main(["run", "steps.toml"]) == 0
    text = Path("reports/steps.md").read_text()
    assert "| kik_piotrowski | control on |" in text
    assert "](steps.svg)" in text
    assert Path("reports/steps.svg").stat().st_size > 10_000


def test_a_model_that_never_leads_is_refused(tmp_path, capsys):
    (tmp_path / "steps.toml").write_text(SCENE.replace("kik_piotrowski", "hertz"))
    assert cli.main(["check", str(tmp_path / "steps.toml")]) == 2
    assert "steps.toml:9: " in capsys.readouterr().err
