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
from wearsim.scene import prepare, setup
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
model = "fast"
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
            name: data[name].values
            for name in data.variables
            if data[name].dtype.kind in "if"
        }


def assert_same_bits(path, reference):
    (attributes, values), (expected, wanted) = values_of(path), values_of(reference)
    assert attributes["settings_changed"] == expected["settings_changed"]
    for name, value in wanted.items():
        np.testing.assert_array_equal(values[name], value, err_msg=name)


@pytest.fixture(scope="module")
def begun(tmp_path_factory, stopped_at):
    """Run directory of a campaign that was stopped after its second step, and its
    scene.
    """
    folder = tmp_path_factory.mktemp("begun")
    (folder / "rig.toml").write_text(SCENE)
    with stopped_at(2) as observer:
        run_scene(folder / "rig.toml", folder / "out", observer=observer)
    return folder


@pytest.fixture
def stopped(begun, tmp_path):
    """Function that gives a copy of the run directory of that campaign."""
    return lambda name: shutil.copytree(begun / "out", tmp_path / name)


CHANGES = (
    Override("campaign.max_step_depth_um", 5),
    Override("campaign.smoothing_wavelength_mm", 4.0),
)


def test_change_acts_from_its_step_on_and_is_stored_with_it(
    stopped, begun, monkeypatch, tmp_path
):
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
    control = session.build(
        session.load_campaign(begun / "rig.toml", overrides=CHANGES)
    ).control

    class Changed(WheelsetEvolution):
        def _in_force(self, state):
            setup = super()._in_force(state)
            return setup if state.step < 2 else session.replace(setup, control=control)

    monkeypatch.setattr(session, "WheelsetEvolution", Changed)
    run_scene(begun / "rig.toml", tmp_path / "at_once")
    _, wanted = values_of(tmp_path / "at_once" / "rig.nc")
    for name, value in wanted.items():
        np.testing.assert_array_equal(values[name], value, err_msg=name)


def test_changed_steps_solve_nothing_of_the_scene_again(stopped, monkeypatch):
    """What is solved from a scene is solved where it is loaded: for its standing, and
    for the run.
    """
    solved = []
    monkeypatch.setattr(
        session, "prepare", lambda part: solved.append(part) or prepare(part)
    )
    monkeypatch.setattr(
        setup, "prepare", lambda part: pytest.fail("solved again by build")
    )
    resume(stopped("once"), overrides=CHANGES)
    assert len(solved) == 2


def test_stopped_after_a_change_or_with_lost_records_it_resumes_to_the_same_bits(
    stopped, stopped_at
):
    once, often = stopped("once"), stopped("often")
    resume(once, overrides=CHANGES)
    with stopped_at(4) as observer:
        resume(often, overrides=CHANGES, observer=observer)
    assert (
        "step 3" in values_of(often / "rig.nc")[0]["settings_changed"]
    )  # in the unfinished file
    (
        often / ".rig.records" / "00000002.record"
    ).unlink()  # step 2 is computed again as before the change
    resume(often)
    assert_same_bits(often / "rig.nc", once / "rig.nc")


def test_change_from_the_command_line_is_in_report_and_manifest(stopped, capsys):
    out = stopped("out")
    assert main(["resume", str(out), "--set", "campaign.stability=0.8"]) == 0
    line = "from step 3 on campaign.stability = 0.8 instead of 1"
    assert line in (out / "report.html").read_text()
    stored = json.loads((out / "scene" / "manifest.json").read_text())["changes"]
    wanted = {
        "campaign": "rig",
        "step": 3,
        "key": "campaign.stability",
        "old": 1.0,
        "new": 0.8,
    }
    assert stored == [wanted]
    with pytest.raises(ResultError, match="is finished"):
        resume(out, overrides=[Override("campaign.stability", 0.5)])


def test_keys_and_values_that_cannot_change_are_faults_and_nothing_changes(
    stopped, capsys
):
    out = stopped("out")
    manifest = (out / "scene" / "manifest.json").read_bytes()
    for text in (
        "campaign.point_spacing_mm=1",
        "wheelset.radius_mm=400",
        "operation.block.1.friction=0.1",
    ):
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


LONGER = (Override("campaign.distance_km", 40),)


def scene_of(distance, more="max_step_km = 10"):
    return SCENE.replace(
        "distance_km = 60\npoint", f"distance_km = {distance}\n{more}\npoint"
    )


def assert_equal_numbers(path, reference):
    """All numbers are the same to the last bit, but for the name of what limited the
    step to the old end.
    """
    (_, values), (_, wanted) = values_of(path), values_of(reference)
    for name in wanted.keys() - {"step_limit"}:
        np.testing.assert_array_equal(values[name], wanted[name], err_msg=name)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """Run directory of a finished campaign of 20 km, beside its scene and that of a
    campaign of 40 km.
    """
    folder = tmp_path_factory.mktemp("finished")
    for distance in (20, 40):
        (folder / f"{distance}.toml").write_text(scene_of(distance))
    run_scene(folder / "20.toml", folder / "out")
    return folder


@pytest.fixture
def done(finished, tmp_path):
    return shutil.copytree(finished / "out", tmp_path / "done")


@pytest.fixture(scope="module")
def longer(finished):
    """Result of the campaign that was made longer in one go."""
    out = shutil.copytree(finished / "out", finished / "longer")
    (path,) = resume(out, overrides=LONGER)
    return path


def test_made_longer_at_the_end_of_a_step_it_is_the_campaign_that_was_longer_from_the_start(
    finished, longer
):
    (path,) = run_scene(finished / "40.toml", finished / "at_once")
    attributes, values = values_of(longer)
    assert values["distance"].max() == pytest.approx(40e3)
    assert attributes["target_distance"] == 40e3
    assert (
        attributes["settings_changed"]
        == "from step 3 on campaign.distance_km = 40 instead of 20"
    )
    assert_equal_numbers(longer, path)


def test_longer_scene_in_the_same_directory_continues_it_under_another_name_too(
    finished, longer, done
):
    kinds = []
    (path,) = run_scene(
        finished / "40.toml", done, observer=lambda event: kinds.append(event.kind)
    )
    assert kinds[0] == "resumed"
    assert kinds.count("step") == len(values_of(longer)[1]["distance"]) - 3
    assert_same_bits(path, longer)
    before = path.read_bytes()
    for again in (
        lambda: run_scene(finished / "40.toml", done),
        lambda: resume(done, overrides=LONGER),
    ):
        again()
        assert path.read_bytes() == before


def test_stopped_while_it_is_made_longer_it_resumes_to_the_same_bits(
    finished, longer, done, stopped_at
):
    before = resume(shutil.copytree(done, done.parent / "again"))[0].read_bytes()

    def killed(records, index, *_):
        if index == 1:
            raise KeyboardInterrupt

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("wearsim.campaign.record.Records.write_row", killed)
        with pytest.raises(KeyboardInterrupt):
            resume(done, overrides=LONGER)
    assert (done / "rig.nc").read_bytes() == before  # nothing is lost
    with stopped_at(3) as observer:
        resume(done, observer=observer)
    (
        done / ".rig.records" / "00000003.record"
    ).unlink()  # the first step of the longer campaign
    resume(done)
    assert_same_bits(done / "rig.nc", longer)


def test_begun_campaign_is_made_longer_too_and_its_old_end_is_computed_again_as_it_was(
    tmp_path, stopped_at
):
    """The last step to the old distance was cut short; it stays as long where its
    record is lost.
    """
    (tmp_path / "rig.toml").write_text(scene_of(22, "max_step_km = 8"))
    for name, lost in (("whole", False), ("lost", True)):
        run_scene(tmp_path / "rig.toml", tmp_path / name)
        with stopped_at(5) as observer:
            resume(tmp_path / name, overrides=LONGER, observer=observer)
        if lost:
            for record in sorted((tmp_path / name / ".rig.records").iterdir())[-3:]:
                record.unlink()
        resume(tmp_path / name)
    assert 22e3 in values_of(tmp_path / "whole" / "rig.nc")[1]["distance"]
    assert_same_bits(tmp_path / "lost" / "rig.nc", tmp_path / "whole" / "rig.nc")


@pytest.mark.slow
def test_rollers_that_are_redressed_where_it_ended_are_redressed_before_it_goes_on(
    tmp_path,
):
    wear = "[counterface.wear]\nfactor = 1\nredress_every_km = 20\n[contact]"
    (tmp_path / "rig.toml").write_text(scene_of(20).replace("[contact]", wear))
    (tmp_path / "longer.toml").write_text(scene_of(40).replace("[contact]", wear))
    for out, scenes in (("longer", ("rig", "longer")), ("at_once", ("longer",))):
        for name in scenes:
            run_scene(tmp_path / f"{name}.toml", tmp_path / out)
    one, other = (values_of(tmp_path / out / "rig.nc") for out in ("longer", "at_once"))
    assert "redressed" not in one[0].get(
        "warnings", ""
    )  # as the shorter one said: never
    assert list(one[1]["counterface_redressed_count"]) == [
        0,
        0,
        0,
        1,
        1,
    ]  # the third row was its end
    for name in (
        "profile_z",
        "counterface_profile_z",
        "counterface_redressed_depth",
        "wear_area_rate",
    ):
        np.testing.assert_array_equal(
            one[1][name][3:], other[1][name][3:], err_msg=name
        )


@pytest.mark.parametrize("distance", ["20", "15"])
def test_distance_that_was_run_is_one_line(finished, done, distance, capsys):
    longer = shutil.copytree(finished / "longer", done.parent / "longer")
    before = (
        (longer / "rig.nc").read_bytes(),
        (longer / "scene" / "manifest.json").read_bytes(),
    )
    assert (
        main(["resume", str(longer), "--set", f"campaign.distance_km={distance}"]) == 2
    )
    message = capsys.readouterr().err
    assert (
        f"--set campaign.distance_km={distance}: distance_km = {distance} is not "
        "above the 40 km"
    ) in message
    assert message.count("\n") == 1
    scene = done.parent / "shorter.toml"
    scene.write_text(scene_of(15))
    with pytest.raises(
        SceneError,
        match=r"shorter.toml:15: distance_km = 15 is not above the 40 km that the rig",
    ):
        run_scene(scene, longer)
    after = (
        (longer / "rig.nc").read_bytes(),
        (longer / "scene" / "manifest.json").read_bytes(),
    )
    assert after == before


def test_campaign_that_ended_by_a_limit_is_not_made_longer(tmp_path):
    limits = "\n[campaign.limits]\ndepth_mm = 0.01\nend = true\n[[oper"
    (tmp_path / "rig.toml").write_text(scene_of(20).replace("[[oper", limits))
    run_scene(tmp_path / "rig.toml", tmp_path / "out")
    with pytest.raises(
        SceneError, match=r"distance_km = 40 does not continue .* \(limit of .* met\)"
    ):
        resume(tmp_path / "out", overrides=LONGER)


def test_without_its_last_state_a_finished_campaign_stays_as_it_is(done):
    (done / ".rig.last.record").unlink()
    before = (done / "rig.nc").read_bytes()
    with pytest.raises(ResultError, match=r"cannot be made longer.*another --out"):
        resume(done, overrides=LONGER)
    assert (done / "rig.nc").read_bytes() == before


@pytest.mark.slow
def test_longer_comparison_makes_both_campaigns_and_their_factors_longer(tmp_path):
    of_class = {
        "shift_mm = 3": "shift_mean_mm = 3\nshift_std_mm = 1\npositions = 10\nshare = 1"
    }
    of_field = {
        '"rig"': '"field"',
        "roller_radius_mm = 1000\n": "",
        "operation.block": "operation.class",
    }
    field = SCENE.removesuffix("distance_km = 60\n")
    for old, new in (of_class | of_field).items():
        field = field.replace(old, new)
    (tmp_path / "compare.toml").write_text(
        '[scene]\nkind = "compare"\n[compare]\nrig = "rig.toml"\nfield = "field.toml"\n'
    )
    for distance in (10, 20):
        (tmp_path / "rig.toml").write_text(scene_of(distance, ""))
        (tmp_path / "field.toml").write_text(
            field.replace("_km = 60", f"_km = {2 * distance}")
        )
        paths = run_scene(tmp_path / "compare.toml", tmp_path / "out")
    ends = [values_of(path)[1]["distance"].max() for path in paths[:2]]
    assert ends == pytest.approx([20e3, 40e3])
    resume(tmp_path / "out", overrides=[Override("rig.campaign.distance_km", 25)])
    ends = [values_of(path)[1]["distance"].max() for path in paths[:2]]
    assert ends == pytest.approx([25e3, 40e3])
