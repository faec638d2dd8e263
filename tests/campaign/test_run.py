"""Whole campaigns with the real physics, coarse and short, in run directories of all
kinds.
"""

import json
import os
import signal
import tomllib
from pathlib import Path

import netCDF4
import numpy as np
import pytest
import xarray as xr

from wearsim.campaign.directory import read_status
from wearsim.campaign.run import resume, run_scene
from wearsim.campaign.step import tableau_of
from wearsim.errors import ResultError, SceneError
from wearsim.results import LAYOUT, ROW, open_results
from wearsim.results.settings import SETTINGS
from wearsim.scene import load_scene

COMMON = """
[wheelset]
profile = "S1002"
[counterface]
profile = "60E1"
inclination = "1:40"
gauge_mm = 1435
{roller}
[contact]
model = "fast"
strips = 12
cells = 12
[campaign]
distance_km = {distance}
point_spacing_mm = 0.5
max_step_depth_um = 20
stability = 1.0
[operation.monitor]
shifts_mm = [0, 3]
load_kN = 80
speed_km_h = 72
friction = 0.35
"""
RIG = """
[scene]
kind = "rig"
title = "short rig"
[[operation.block]]
name = "left"
shift_mm = -3
load_kN = 80
speed_km_h = 72
friction = {friction}
distance_km = 2
[[operation.block]]
name = "right"
shift_mm = 3
yaw_mrad = 1
load_kN = 80
speed_km_h = 72
friction = {friction}
distance_km = 3
"""
FIELD = """
[scene]
kind = "field"
[[operation.class]]
name = "tangent"
shift_mean_mm = 0
shift_std_mm = 2
positions = 10
load_kN = 80
speed_km_h = 72
friction = 0.35
share = 1
"""
COMPARE = """
[scene]
kind = "compare"
[compare]
rig = "rig.toml"
field = "field.toml"
"""


def rig_text(friction=0.35, distance=200):
    return RIG.format(friction=friction) + COMMON.format(
        roller="roller_radius_mm = 1000", distance=distance
    )


def field_text(distance=500):
    return FIELD + COMMON.format(roller="", distance=distance)


@pytest.fixture(scope="module")
def scenes(tmp_path_factory):
    folder = tmp_path_factory.mktemp("scenes")
    (folder / "rig.toml").write_text(rig_text())
    (folder / "field.toml").write_text(field_text())
    (folder / "compare.toml").write_text(COMPARE)
    (folder / "other.toml").write_text(rig_text(distance=201))
    (folder / "frictionless.toml").write_text(rig_text(friction=0))
    return folder


@pytest.fixture(scope="module")
def finished(scenes, tmp_path_factory):
    """A finished comparison."""
    out = tmp_path_factory.mktemp("finished") / "out"
    run_scene(
        scenes / "compare.toml", out, command="wearsim run compare.toml --out out"
    )
    return out


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def assert_same_bits(path, reference):
    with netCDF4.Dataset(path) as one, netCDF4.Dataset(reference) as other:
        for file in (one, other):
            file.set_auto_maskandscale(False)
        for name in LAYOUT:
            assert np.array_equal(one[name][:], other[name][:]), name
        for name in {*one.ncattrs(), *other.ncattrs()} - {"history"}:
            assert np.array_equal(one.getncattr(name), other.getncattr(name)), name


def test_comparison_leaves_both_campaigns_their_translation_and_nothing_half_done(
    scenes, finished
):
    names = sorted(path.name for path in finished.iterdir() if path.name != ".lock")
    assert names == [
        ".field.finished.json",
        ".field.last.record",
        ".rig.finished.json",
        ".rig.last.record",
        "field.nc",
        "rig.nc",
        "scene",
        "status.json",
        "translation.nc",
    ]
    for name in ("compare.toml", "rig.toml", "field.toml"):
        assert (finished / "scene" / name).read_bytes() == (scenes / name).read_bytes()
    states = {
        name: item["state"] for name, item in read_status(finished)["campaigns"].items()
    }
    assert states == {"rig": "finished", "field": "finished"}


@pytest.mark.parametrize("kind", ["rig", "field"])
def test_rows_agree_with_each_other_and_with_the_load(finished, kind):
    with open_results(finished / f"{kind}.nc") as data:
        assert float(data["distance"][-1]) == pytest.approx(
            {"rig": 200e3, "field": 500e3}[kind], rel=1e-12
        )
        np.testing.assert_allclose(
            data["distance"], data["step_length"].cumsum(), rtol=1e-12
        )
        assert data.sizes["step"] > 3
        assert bool((data["worn_area"].diff("step") > 0).all())
        depth = data["wear_depth"].values
        np.testing.assert_array_equal(data["max_wear_depth"], depth.max(axis=-1))
        # regimes are summed in another order than the total was accumulated
        np.testing.assert_allclose(
            data["wear_depth_by_regime"].sum("regime"),
            depth,
            rtol=0,
            atol=1e-12 * depth.max(),
        )
        # every step has the stages that its stability number asks for
        asked = [
            tableau_of("rkc", float(number)) for number in data["stability_number"][1:]
        ]
        assert data["stages"].values[1:].tolist() == [
            len(rule.shares) - 1 for rule in asked
        ]
        # all points in the first and the last row, the acting ones and the monitoring
        # points in each
        solved = (data["n_patch"] > 0).values
        assert bool((solved[[0, -1]]).all())
        assert bool(
            (
                solved[1:-1]
                == ((data["active_weight"] > 0) | (data["weight"] == 0)).values[1:-1]
            ).all()
        )
        # normal and creep forces carry the wheel load to 1e-6; on a roller off its top
        # the rolling direction dips, by an angle that leaves out the height of the
        # profile here, below 1 mm
        angle, dip = (
            data["contact_angle"],
            data["x"] * data.attrs["counterface_curvature"],
        )
        vertical = data["normal_force"] * np.cos(angle) - data["force_y"] * np.sin(
            angle
        )
        vertical = vertical * np.cos(dip) - data["force_x"] * np.sin(dip)
        for wheel in (0, 1):
            carried = (
                vertical.where(data["side"] == wheel).sum("patch") / data["wheel_load"]
            )
            np.testing.assert_allclose(carried.values[solved], 1.0, rtol=2e-6)
        assert bool((data["n_patch"] == data["area"].notnull().sum("patch")).all())
        assert bool(data["power"].min() >= 0)
        mean, largest = data["wear_index_mean"], data["wear_index_max"]
        np.testing.assert_allclose(
            (mean * data["area"] * data["speed"]), data["power"], rtol=1e-9, atol=1e-9
        )
        assert bool(((mean <= largest * (1 + 1e-12)) | mean.isnull()).all())


def test_wear_factors_at_equal_points_follow_from_the_power(finished):
    """Mild USFD is linear: per metre run, power / V times 5.3e-9 m3/kg over density and
    circumference.

    The radius at the running circle stands for that of the strips, which lie within 3
    mm of it: 0.7 %.
    """
    data = [
        xr.open_dataset(finished / f"{name}.nc")
        for name in ("rig", "field", "translation")
    ]
    rig, field, translation = (part.load() for part in data)
    for part in data:
        part.close()
    rate = []
    for result in (rig, field):
        watched = result.isel(step=0, operating_point=slice(-2, None))
        assert set(
            np.unique(watched["wear_regime_highest"].dropna("patch", how="all"))
        ) <= {0.0}
        power = np.stack(
            [watched["power"].where(watched["side"] == w).sum("patch") for w in (0, 1)],
            1,
        )
        expected = 5.3e-9 * power / 20.0 / 7850.0 / (2 * np.pi * 0.46)
        stored = [
            watched["wear_area_rate"].where(watched["side"] == w).sum("patch").values
            for w in (0, 1)
        ]
        np.testing.assert_allclose(np.stack(stored, 1), expected, rtol=7e-3)
        rate.append(expected)
    order = np.argsort(translation["shift"].values)
    assert translation["shift"].values[order] == pytest.approx([0.0, 3e-3])
    outcome = translation["wear_area_rate_point_factor"].values[0, 0, order]
    # the radius error all but cancels: the running bands of rig and field differ by
    # some 0.1 mm in height
    np.testing.assert_allclose(outcome, rate[0] / rate[1], rtol=1e-3)


def test_new_wheel_has_the_measures_of_s1002(finished):
    """Known values of the profile standard and the conicity benchmark; 0.5 mm points
    limit the accuracy.
    """
    with open_results(finished / "rig.nc") as data:
        assert float(data["flange_height"][0, 0]) == pytest.approx(28e-3, abs=0.05e-3)
        assert float(data["flange_thickness"][0, 0]) == pytest.approx(
            32.5e-3, abs=0.05e-3
        )
        assert float(data["equivalent_conicity"][0]) == pytest.approx(0.174, abs=0.003)
        assert float(data["hollowing"][0].max()) < 1e-6


def test_weights_of_blocks_and_monitoring_points(finished):
    with open_results(finished / "rig.nc") as data:
        np.testing.assert_allclose(data["weight"], [0.4, 0.6, 0.0, 0.0])
        np.testing.assert_allclose(data["block_length"], [2000.0, 3000.0, 0.0, 0.0])
        np.testing.assert_allclose(
            data["active_weight"].sum("operating_point")[1:], 1.0, rtol=1e-12
        )
        assert float(data["active_weight"][0].sum()) == 0.0
        assert float(data["active_weight"][:, 2:].max()) == 0.0
        assert bool(
            (data["n_patch"][:, 2:] >= 2).all()
        )  # solved at each step all the same


def test_global_attributes_tell_where_the_result_comes_from(finished, scenes):
    with netCDF4.Dataset(finished / "rig.nc") as file:
        assert file.scene_text == (scenes / "rig.toml").read_text()
        assert (
            tomllib.loads(file.scene_text)["scene"]["title"]
            == file.title
            == "short rig"
        )
        assert file.history == "wearsim run compare.toml --out out"
        assert file.finished == "distance reached"
        assert "numpy" in file.source
        assert "sha256" in file.input_hashes
        assert file.wear_law == "usfd"
        assert "467-478" in file.wear_coefficients_source
        assert file.counterface_curvature == 1.0
        assert all(str(file.getncattr(name)) for name in file.ncattrs())
        settings = {*file.ncattrs()} - {"Conventions", "wearsim_schema"}
        assert settings <= SETTINGS.keys()
        assert {one.name for one in SETTINGS.values() if one.required} <= settings


def test_resuming_or_repeating_what_is_finished_is_a_success_and_changes_nothing(
    finished, scenes
):
    before = {
        name: data
        for name, data in contents(finished).items()
        if name.endswith("d.nc") or name == "rig.nc"
    }
    kinds = []
    resume(finished, observer=lambda event: kinds.append(event.kind))
    run_scene(
        scenes / "compare.toml",
        finished,
        observer=lambda event: kinds.append(event.kind),
    )
    assert kinds == ["complete"] * 4
    after = contents(finished)
    assert all(after[name] == data for name, data in before.items())


KILLED = """
import os, signal, sys
from wearsim.campaign.run import run_scene
def kill(event):
    if event.kind == "step" and event.name == {name!r} and event.step == {step}:
        os.kill(os.getpid(), signal.{signal})
run_scene({scene!r}, {out!r}, command="wearsim run compare.toml --out out", observer=kill)
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "step", "how"), [("rig", 2, "SIGKILL"), ("field", 1, "SIGINT")]
)
def test_killed_comparison_resumes_to_the_same_bits(
    scenes, finished, tmp_path, forked, name, step, how, monkeypatch
):
    """Also from another working directory, with another number of threads."""
    out = tmp_path / "out"
    code = KILLED.format(
        name=name,
        step=step,
        signal=how,
        scene=str(scenes / "compare.toml"),
        out=str(out),
    )
    process, printed = forked(code)
    with printed:
        output = printed.read()
    process.join()
    assert process.exitcode == {"SIGKILL": -signal.SIGKILL, "SIGINT": 1}[how], output
    assert ("KeyboardInterrupt" in output) == (how == "SIGINT")
    expected = "interrupted" if how == "SIGINT" else "stopped"
    assert read_status(out)["campaigns"][name]["state"] == expected
    events = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("wearsim.campaign.run.available_cores", lambda: 1)
    paths = resume("out", observer=events.append)
    first = next(event for event in events if event.name == name)
    assert (first.kind, first.step) == ("resumed", step)
    assert [path.name for path in paths] == ["rig.nc", "field.nc", "translation.nc"]
    for file in ("rig.nc", "field.nc"):
        assert_same_bits(out / file, finished / file)


def test_profile_file_of_the_user_is_kept_with_the_scene(scenes, tmp_path):
    """The originals are gone when the campaign is resumed."""
    with open_results(
        Path(run_scene(scenes / "frictionless.toml", tmp_path / "first")[0])
    ) as data:
        y, z = (
            1e3 * data["profile_y"][0, 0].values,
            1e3 * data["profile_z"][0, 0].values,
        )
    wheel = tmp_path / "elsewhere" / "measured.txt"
    wheel.parent.mkdir()
    wheel.write_text("".join(f"{a:.9f} {b:.9f}\n" for a, b in zip(y, z, strict=True)))
    scene = tmp_path / "scene.toml"
    scene.write_text(rig_text(distance=20).replace('"S1002"', f'"{wheel}"'))

    def stop(event):
        if event.kind == "step":
            raise InterruptedError

    with pytest.raises(InterruptedError):
        run_scene(scene, tmp_path / "out", observer=stop)
    scene.unlink()
    wheel.unlink()
    (path,) = resume(tmp_path / "out")
    with open_results(path) as data:
        assert float(data["distance"][-1]) == pytest.approx(20e3, rel=1e-12)


def test_friction_zero_wears_nothing_and_leaves_no_nan(scenes, tmp_path):
    (path,) = run_scene(scenes / "frictionless.toml", tmp_path / "out")
    with netCDF4.Dataset(path) as file:
        file.set_auto_maskandscale(False)
        assert file["distance"][-1] == pytest.approx(200e3, rel=1e-12)
        assert float(np.abs(file["wear_depth"][:]).max()) == 0.0
        assert all(np.isfinite(file[name][:]).all() for name in ROW)
        for name in ("wear_regime", "wear_regime_highest"):
            assert set(np.unique(file[name][:, :2, :2])) == {-1}
            assert (
                file[name][:, 2:, :2].min() >= 0
            )  # the monitoring points have friction
        for name in ("wear_area_rate", "wear_depth_rate_max"):
            assert not file[name][:, :2, :2].any()
            assert file[name][:, 2:, :2].min() > 0.0
        assert (
            file.warnings
            == "frictionless.toml:10: friction = 0 everywhere: nothing will wear"
        )


def test_directory_of_another_campaign_is_not_touched(finished, scenes):
    before = contents(finished)
    with pytest.raises(
        ResultError, match=r"another campaign: .*other\.toml.*choose another --out"
    ):
        run_scene(scenes / "other.toml", finished)
    assert contents(finished) == before


def test_changed_scene_of_the_same_name_is_another_campaign(scenes, tmp_path):
    scene = tmp_path / "rig.toml"
    scene.write_text(rig_text(friction=0))
    run_scene(scene, tmp_path / "out")
    before = contents(tmp_path / "out")
    scene.write_text(rig_text(friction=0) + "\n# a remark\n")
    with pytest.raises(
        ResultError, match=r"another campaign: not the same as .*: rig\.toml; nothing"
    ):
        run_scene(scene, tmp_path / "out")
    assert contents(tmp_path / "out") == before


@pytest.mark.parametrize("name", ["rig.nc", "field.nc", "report.html"])
def test_directory_with_foreign_files_of_our_names_is_not_touched(
    scenes, tmp_path, name
):
    (tmp_path / name).write_text("precious")
    with pytest.raises(
        ResultError, match=r"not a run directory of wearsim; nothing was changed"
    ):
        run_scene(scenes / "rig.toml", tmp_path)
    assert contents(tmp_path) == {name: b"precious"}


def test_faulty_scene_leaves_no_directory(scenes, tmp_path):
    (tmp_path / "bad.toml").write_text(rig_text(friction=2))
    with pytest.raises(SceneError):
        run_scene(tmp_path / "bad.toml", tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("place", ["below a file", "in /proc", "is a file"])
def test_impossible_directories_are_told_in_one_line(scenes, tmp_path, place):
    """Root may write anywhere, so these are places where nobody may."""
    (tmp_path / "file").write_text("")
    places = {
        "below a file": tmp_path / "file" / "out",
        "in /proc": Path("/proc/out"),
        "is a file": tmp_path / "file",
    }
    with pytest.raises(ResultError, match=r"choose another --out") as caught:
        run_scene(scenes / "rig.toml", places[place])
    assert "\n" not in str(caught.value)
    assert caught.value.exit_code == 2


def test_two_runs_in_one_directory_exclude_each_other(scenes, tmp_path, forked):
    out = tmp_path / "out"
    code = (
        "from pathlib import Path\nfrom wearsim.campaign.directory import locked\n"
        f"with locked(Path({str(out)!r})):\n"
        "    print('held', flush=True); signal.pause()\n"
    )
    process, printed = forked("import signal\n" + code)
    with printed:
        assert printed.readline() == "held\n"
        with pytest.raises(ResultError, match="another wearsim run works in"):
            run_scene(scenes / "frictionless.toml", out)
        assert set(os.listdir(out)) <= {".lock"}
        process.kill()
        process.join()
    run_scene(scenes / "frictionless.toml", out)  # the lock went with its holder


def test_start_killed_while_the_scene_was_copied_begins_anew(scenes, tmp_path):
    out = tmp_path / "out"
    (out / ".scene.tmp").mkdir(parents=True)
    (out / ".scene.tmp" / "rig.toml").write_text("half a sce")
    run_scene(scenes / "frictionless.toml", out)
    assert not (out / ".scene.tmp").exists()
    assert (
        load_scene(out / "scene" / "frictionless.toml", copied=True).scene.title
        == "short rig"
    )


def test_resume_of_what_is_no_run_directory(tmp_path):
    with pytest.raises(ResultError, match=r"is not a run directory.*wearsim run"):
        resume(tmp_path)
    with pytest.raises(ResultError, match="is not a run directory"):
        resume(tmp_path / "absent")
    assert not (tmp_path / "absent").exists()


def test_changed_copy_of_the_scene_stops_the_resume(scenes, tmp_path):
    out = tmp_path / "out"
    run_scene(scenes / "frictionless.toml", out)
    (out / "scene" / "frictionless.toml").write_text(rig_text(friction=0, distance=300))
    with pytest.raises(ResultError, match="changed since the campaign started"):
        resume(out)
    (out / "scene" / "manifest.json").write_text("{")
    with pytest.raises(ResultError, match="cannot be read"):
        resume(out)


def test_status_is_valid_json_for_other_programs(finished):
    status = json.loads((finished / "status.json").read_text())
    item = status["campaigns"]["field"]
    assert item["distance"] == item["target"] == 500e3
    assert item["time_left"] in (0.0, None)


def test_a_campaign_starts_without_libraries_it_does_not_need(forked):
    """They cost a second at every start of the command line, and in every process of a
    sweep.
    """
    process, printed = forked(
        "import wearsim.campaign.run; print({'matplotlib', 'pandas', 'xarray'} & "
        "set(sys.modules))"
    )
    with printed:
        assert printed.read().strip() == "set()"
    process.join()
    assert process.exitcode == 0
