"""Control of wear steps off and on: the cases of reports/wear_step_stability.md, shorter."""

from pathlib import Path

import numpy as np
import pytest

from wearsim import cli
from wearsim.profile import standard
from wearsim.report.pages_wear_steps import markdown
from wearsim.scene import load_scene
from wearsim.studies.wear_steps import RIPPLE, cases_of, ripple, solve_scene, solve_wear_steps

REPOSITORY = Path(__file__).parents[2]
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


def rows_of(text):
    """Cells of the report's table by model and way of stepping."""
    lines = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| ")]
    return {(cells[0], cells[1]): cells[2:] for cells in lines if cells[0] not in ("model", "---")}


# Where nothing grows, the digits. A step beyond the limit multiplies every difference by up to 7: the last
# digits of the contact solutions, which a compiler may round otherwise, stand for per cents at the end.
GROWS = {
    "kik_piotrowski": {"4 times the limit, no smoothing", "4 times the limit, smoothed"},
    "half_space": {"8 times the limit, no smoothing", "8 times the limit, smoothed"},
}


@pytest.mark.slow
def test_the_committed_report_is_what_its_command_writes():
    """Controlled and semi-implicit rows to the printed digit, unstable ones to 5 % after as many steps."""
    committed = (REPOSITORY / "reports/wear_step_stability.md").read_text()
    scene = load_scene(REPOSITORY / "workflows/wear_step_stability.toml")
    command = "wearsim run workflows/wear_step_stability.toml"
    again = markdown(solve_scene(scene), scene.scene.title, scene.remarks, "wear_step_stability.svg", command)
    told, new = rows_of(committed), rows_of(again)
    assert told.keys() == new.keys()
    for (model, steps), cells in new.items():
        if steps not in GROWS[model]:
            assert told[model, steps] == cells
            continue
        assert (told[model, steps][0], told[model, steps][-1]) == (cells[0], cells[-1])
        numbers = [[float(cell) for cell in row[1:-1]] for row in (told[model, steps], cells)]
        np.testing.assert_allclose(*numbers, rtol=0.05, err_msg=f"{model}: {steps}")
    outside = [[line for line in text.splitlines() if line[:2] != "| "] for text in (committed, again)]
    assert outside[0] == outside[1]
