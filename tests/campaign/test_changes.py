"""Settings that `wearsim resume` changes between two steps."""

import json
import shutil

import numpy as np
import pytest

from wearsim.campaign import run as session
from wearsim.campaign.changes import CHANGEABLE
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.campaign.run import resume, run_scene
from wearsim.cli import main
from wearsim.errors import ResultError, SceneError
from wearsim.results import open_results
from wearsim.scene.overrides import Override

SCENE = """
[scene]
kind = "rig"
[wheelset]
profile = "S1002"
[counterface]
profile = "60E1"
inclination = "1:40"
roller_radius_mm = 1000
[contact]
strips = 10
cells = 10
[campaign]
distance_km = 60
point_spacing_mm = 0.5
max_step_depth_um = 20
first_step_depth_um = 20
stability = 1.0
[[operation.block]]
name = "right"
shift_mm = 3
load_kN = 80
speed_km_h = 72
friction = 0.35
distance_km = 60
"""


def values_of(path):
    with open_results(path) as data:
        data.load()
        return data.attrs, {
            name: data[name].values for name in data.variables if data[name].dtype.kind in "if"
        }


def assert_same_bits(path, reference):
    (attributes, values), (expected, wanted) = values_of(path), values_of(reference)
    assert attributes["settings_changed"] == expected["settings_changed"]
    for name, value in wanted.items():
        np.testing.assert_array_equal(values[name], value, err_msg=name)


@pytest.fixture(scope="module")
def begun(tmp_path_factory, stopped_at):
    """Run directory of a campaign that was stopped after its second step, and its scene."""
    folder = tmp_path_factory.mktemp("begun")
    (folder / "rig.toml").write_text(SCENE)
    with stopped_at(2) as observer:
        run_scene(folder / "rig.toml", folder / "out", observer=observer)
    return folder


@pytest.fixture
def stopped(begun, tmp_path):
    """Function that gives a copy of the run directory of that campaign."""
    return lambda name: shutil.copytree(begun / "out", tmp_path / name)


CHANGES = (Override("campaign.max_step_depth_um", 5), Override("campaign.smoothing_wavelength_mm", 4.0))


def test_change_acts_from_its_step_on_and_is_stored_with_it(stopped, begun, monkeypatch, tmp_path):
    once = stopped("once")
    resume(once, overrides=CHANGES)
    attributes, values = values_of(once / "rig.nc")
    assert attributes["settings_changed"] == (
        "from step 3 on campaign.max_step_depth_um = 5 instead of 20; "
        "from step 3 on campaign.smoothing_wavelength_mm = 4 instead of 2.5"
    )
    assert attributes["depth_cap"] == pytest.approx(2e-5)  # of the scene
    grown = np.diff(values["wear_depth"], axis=0).max(axis=(1, 2))
    assert (grown[:2] > 5e-6).all()
    assert (grown[2:] < 5.001e-6).all()

    # the same settings given to the steps in one session, without the manifest
    control = session.build(session.load_campaign(begun / "rig.toml", overrides=CHANGES)).control

    class Changed(WheelsetEvolution):
        def _in_force(self, state):
            setup = super()._in_force(state)
            return setup if state.step < 2 else session.replace(setup, control=control)

    monkeypatch.setattr(session, "WheelsetEvolution", Changed)
    run_scene(begun / "rig.toml", tmp_path / "at_once")
    _, wanted = values_of(tmp_path / "at_once" / "rig.nc")
    for name, value in wanted.items():
        np.testing.assert_array_equal(values[name], value, err_msg=name)


def test_stopped_after_a_change_or_with_lost_records_it_resumes_to_the_same_bits(stopped, stopped_at):
    once, often = stopped("once"), stopped("often")
    resume(once, overrides=CHANGES)
    with stopped_at(4) as observer:
        resume(often, overrides=CHANGES, observer=observer)
    assert "step 3" in values_of(often / "rig.nc")[0]["settings_changed"]  # in the unfinished file
    (often / ".rig.records" / "00000002.record").unlink()  # step 2 is computed again as before the change
    resume(often)
    assert_same_bits(often / "rig.nc", once / "rig.nc")


def test_change_from_the_command_line_is_in_report_and_manifest(stopped, capsys):
    out = stopped("out")
    assert main(["resume", str(out), "--set", "campaign.stability=0.8"]) == 0
    line = "from step 3 on campaign.stability = 0.8 instead of 1"
    assert line in (out / "report.html").read_text()
    stored = json.loads((out / "scene" / "manifest.json").read_text())["changes"]
    wanted = {"campaign": "rig", "step": 3, "key": "campaign.stability", "old": 1.0, "new": 0.8}
    assert stored == [wanted]
    with pytest.raises(ResultError, match="is finished"):
        resume(out, overrides=[Override("campaign.stability", 0.5)])


def test_keys_and_values_that_cannot_change_are_faults_and_nothing_changes(stopped, capsys):
    out = stopped("out")
    manifest = (out / "scene" / "manifest.json").read_bytes()
    for text in ("campaign.distance_km=9", "wheelset.radius_mm=400", "operation.block.1.friction=0.1"):
        assert main(["resume", str(out), "--set", text]) == 2
        message = capsys.readouterr().err
        assert f"--set {text}" in message
        assert message.count("\n") == 1
        assert all(f"campaign.{key}" in message for key in CHANGEABLE)
    assert main(["resume", str(out), "--set", "campaign.stability=1000"]) == 2
    assert "--set campaign.stability=1000" in capsys.readouterr().err
    with pytest.raises(SceneError):
        resume(out, overrides=[Override("other.campaign.stability", 0.5)])
    assert (out / "scene" / "manifest.json").read_bytes() == manifest
