"""Sweeps: through any executor, continued by themselves, with a row for every case."""

import csv
import json
import shutil
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import filelock
import netCDF4
import numpy as np
import pytest
import xarray as xr

import wearsim
from wearsim.campaign.directory import read_status
from wearsim.campaign.run import run_scene
from wearsim.errors import NumericalError, ResultError, SceneError
from wearsim.results import ROW, open_results
from wearsim.scene.sweep import sweep_of_flags
from wearsim.studies import ensemble
from wearsim.studies.ensemble import Runner, check_cases
from wearsim.studies.sweep import (
    chosen,
    outcomes_of,
    run_one,
    run_sweep,
    sweep_dataset,
    sweep_rows,
)

DATA = Path(__file__).parents[1] / "data"
VARY = ["wheelset.radius_mm=420,460", "operation.block.friction=0.2,0.35"]


@pytest.fixture(scope="module")
def rig(coarse_rig):
    """Coarse rig of two steps."""
    return coarse_rig(2, "max_step_km = 1")


@pytest.fixture
def folder(tmp_path, monkeypatch, rig):
    (tmp_path / "rig.toml").write_text(rig)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def sweep(folder):
    return sweep_of_flags("rig.toml", VARY, None)


@pytest.fixture(scope="module")
def swept(tmp_path_factory, rig):
    """Directory of the sweep, its outcomes and what was reported."""
    folder = tmp_path_factory.mktemp("swept")
    (folder / "rig.toml").write_text(rig)
    reported = []
    sweep = sweep_of_flags(str(folder / "rig.toml"), VARY, None)
    outcomes = run_sweep(
        sweep,
        folder / "out",
        Runner(
            jobs=1,
            command="a command",
            report=lambda _, outcome: reported.append(outcome),
        ),
    )
    return folder / "out", outcomes, reported


@pytest.fixture
def cases(folder, swept):
    """Function that copies finished cases of the sweep into "out"."""

    def copy(*numbers):
        for number in numbers:
            name = f"case_{number:04d}"
            shutil.copytree(swept[0] / name, folder / "out" / name, dirs_exist_ok=True)

    return copy


def same_bits(one, other):
    with netCDF4.Dataset(one) as first, netCDF4.Dataset(other) as second:
        for file in (first, second):
            file.set_auto_maskandscale(False)
        assert {
            name for name in ROW if not np.array_equal(first[name][:], second[name][:])
        } == set()


@pytest.fixture
def pair(folder):
    """The least a sweep has."""
    return sweep_of_flags("rig.toml", VARY[:1], None)


class AtOnce:
    """The least of an executor."""

    def submit(self, task, *given):
        future = Future()
        future.set_result(task(*given))
        return future


def contents(out):
    return {path.name: path.read_bytes() for path in out.glob("*/*.nc")}


@pytest.mark.slow
def test_processes_give_the_bits_of_this_process(sweep, folder, swept):
    outcomes = run_sweep(sweep, "out", Runner(jobs=2))
    assert [outcome.state for outcome in outcomes] == ["finished"] * 4
    for case in sweep.cases:
        same_bits(
            folder / "out" / case.name / "rig.nc", swept[0] / case.name / "rig.nc"
        )


def test_cases_have_the_bits_of_a_single_run_and_are_found_finished(
    sweep, folder, swept, cases
):
    _, outcomes, reported = swept
    cases(1, 2, 3, 4)
    assert [(outcome.number, outcome.state) for outcome in outcomes] == [
        (k, "finished") for k in (1, 2, 3, 4)
    ]
    assert sorted(
        outcome.number for outcome in reported if outcome.state == "finished"
    ) == [1, 2, 3, 4]
    changed = (
        (folder / "rig.toml")
        .read_text()
        .replace("friction = 0.35", "friction = 0.2", 1)
    )
    changed = changed.replace("friction = 0.3\n", "friction = 0.2\n", 1)
    changed = changed.replace('profile = "S1002"', 'profile = "S1002"\nradius_mm = 460')
    Path("single.toml").write_text(changed)
    (single,) = run_scene("single.toml", "single")
    same_bits(single, folder / "out" / "case_0003" / "rig.nc")
    with open_results(folder / "out" / "case_0003" / "rig.nc") as result:
        assert result.attrs["history"] == "a command"
        assert "radius_mm = 460" in result.attrs["scene_text"]
    before = contents(folder / "out")
    again = run_sweep(sweep, "out", Runner(executor=ThreadPoolExecutor(2)))
    assert again == outcomes
    assert contents(folder / "out") == before


def test_the_table_has_the_varied_values_and_the_last_row_of_each_case(swept):
    out, outcomes, _ = swept
    with xr.open_dataset(out / "sweep.nc") as table:
        assert table["wheelset_radius_mm"].values.tolist() == [420, 420, 460, 460]
        assert table["operation_block_friction"].values.tolist() == [
            0.2,
            0.35,
            0.2,
            0.35,
        ]
        assert table["campaign_name"].values.tolist() == ["rig"]
        assert table["worn_area"].dims == ("case", "campaign", "wheel")
        assert table["worn_area"].units == "m2"
        for at, case in enumerate(outcomes):
            with open_results(out / f"case_{case.number:04d}" / "rig.nc") as result:
                for name in (
                    "worn_area",
                    "max_wear_depth",
                    "flange_height",
                    "distance",
                ):
                    assert np.array_equal(table[name][at, 0], result[name][-1])
    with open(out / "sweep.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["case"] for row in rows] == ["1", "2", "3", "4"]
    assert {row["state"] for row in rows} == {"finished"}
    assert [float(row["wheelset.radius_mm"]) for row in rows] == [420, 420, 460, 460]
    depth = [
        [float(row[f"max_wear_depth_mm_{wheel}"]) for wheel in ("right", "left")]
        for row in rows
    ]
    np.testing.assert_allclose(
        depth, 1e3 * sweep_dataset(out)["max_wear_depth"][:, 0], rtol=1e-8
    )
    assert all(float(row["distance_km"]) == 2.0 for row in rows)


def test_the_table_states_each_version_that_computed_a_case_once(swept, monkeypatch):
    """The versions are those of the results, not of what gathers them."""
    directory, *_ = swept
    monkeypatch.setattr("wearsim.__version__", "99.0")
    with open_results(directory / "case_0001" / "rig.nc") as result:
        assert sweep_dataset(directory).attrs["source"] == result.attrs["source"]


@pytest.mark.slow
def test_the_table_has_what_rollers_lost_where_any_wear(folder):
    """Last rows of both cases, and no such columns in a sweep whose rollers stay as
    new.
    """
    text = (folder / "rig.toml").read_text()
    (folder / "worn.toml").write_text(
        text.replace("[wear]", "[counterface.wear]\nfactor = 0.5\n[wear]")
    )
    sweep = sweep_of_flags("worn.toml", ["counterface.wear.factor=0.5,1"], None)
    run_sweep(sweep, "out", Runner(jobs=1))
    with (
        xr.open_dataset("out/sweep.nc") as table,
        open("out/sweep.csv", newline="") as file,
    ):
        rows = list(csv.DictReader(file))
        for at, case in enumerate(sweep.cases):
            with open_results(f"out/{case.name}/rig.nc") as result:
                for name in ("counterface_max_wear_depth", "counterface_worn_area"):
                    np.testing.assert_array_equal(table[name][at, 0], result[name][-1])
                    assert table[name].values[at, 0].max() > 0.0
        depth = table["counterface_max_wear_depth"].values[:, 0]
    columns = [f"counterface_max_wear_depth_mm_{wheel}" for wheel in ("right", "left")]
    message = [[float(row[column]) for column in columns] for row in rows]
    np.testing.assert_allclose(message, 1e3 * depth, rtol=1e-8)
    run_sweep(
        sweep_of_flags("rig.toml", ["wheelset.radius_mm=460"], None),
        "plain",
        Runner(jobs=1),
    )
    assert not any(
        name.startswith("counterface_max")
        for name in sweep_rows(sweep_dataset("plain"))[0]
    )


def test_a_case_that_fails_is_a_row_and_the_others_run(
    sweep, folder, monkeypatch, cases
):
    cases(1, 4)

    def run(path, out, **named):
        if out.name == "case_0002":
            raise NumericalError("the iteration of a test did not end")
        if out.name == "case_0003":
            raise ZeroDivisionError("a fault")
        return run_scene(path, out, **named)

    monkeypatch.setattr(ensemble, "run_scene", run)
    outcomes = run_sweep(sweep, "out", Runner(jobs=1))
    assert [outcome.state for outcome in outcomes] == [
        "finished",
        "failed",
        "failed",
        "finished",
    ]
    assert [outcome.exit_code for outcome in outcomes] == [0, 3, 3, 0]
    rows = sweep_rows(sweep_dataset("out"))
    assert [row["fault"] for row in rows[:2]] == [
        "",
        "the iteration of a test did not end",
    ]
    assert "ZeroDivisionError: a fault" in rows[2]["fault"]
    assert [row["worn_area_mm2_right"] is None for row in rows] == [
        False,
        True,
        True,
        False,
    ]
    monkeypatch.undo()
    monkeypatch.chdir(folder)
    cases(2, 3)
    assert {outcome.state for outcome in run_sweep(sweep, "out", Runner(jobs=1))} == {
        "finished"
    }
    assert {outcome.state for outcome in outcomes_of(folder / "out")} == {"finished"}


def test_a_case_another_process_works_in_is_told_and_left(pair, folder):
    (folder / "out" / "case_0001").mkdir(parents=True)
    with filelock.FileLock(folder / "out" / "case_0001" / ".lock"):
        outcomes = run_sweep(pair, "out", Runner(jobs=1))
    assert [outcome.exit_code for outcome in outcomes] == [2, 0]
    assert "another wearsim run works in" in outcomes[0].fault


@pytest.mark.slow
def test_single_cases_make_up_the_sweep(sweep, folder, cases):
    cases(1, 3)
    for number in (3, 1, 4):
        assert run_one(sweep, sweep.cases[number - 1], "out").state == "finished"
    assert [item.state for item in outcomes_of(folder / "out")] == [
        "finished",
        "not started",
        "finished",
        "finished",
    ]
    before = contents(folder / "out")
    run_sweep(sweep, "out", Runner(jobs=1))
    after = contents(folder / "out")
    assert {name: after[name] for name in before} == before
    assert len(sweep_rows(sweep_dataset("out"))) == 4


@pytest.mark.parametrize("number", [0, 5, -1])
def test_a_case_that_is_not_there_is_refused(sweep, number):
    with pytest.raises(
        SceneError, match=f"there is no case {number}; give --case 1 to 4"
    ):
        chosen(sweep, number)


def test_faults_of_all_cases_are_told_once_each_before_anything_is_written(folder):
    vary = ["wheelset.radius_mm=420,-1,460", "wear.law=usfd,usdf"]
    with pytest.raises(SceneError) as caught:
        check_cases(sweep_of_flags("rig.toml", vary, None).cases, folder / "out")
    lines = str(caught.value).splitlines()
    assert len(lines) == 2
    assert any("cases 3-4: radius_mm = -1 must be at least 5" in line for line in lines)
    assert any('cases 2, 4, 6: law = "usdf" is not' in line for line in lines)
    assert not (folder / "out").exists()


def test_a_changed_sweep_keeps_out_of_the_directories_of_the_old_one(
    sweep, folder, cases
):
    cases(1)
    before = contents(folder / "out")
    other = sweep_of_flags("rig.toml", ["wheelset.radius_mm=430,460"], None)
    with pytest.raises(ResultError, match=r"case 1: .*belongs to another campaign"):
        check_cases(other.cases, folder / "out")
    longer = sweep_of_flags("rig.toml", [VARY[0] + ",500", VARY[1]], None)
    check_cases(longer.cases, folder / "out")
    assert contents(folder / "out") == before


def test_a_second_sweep_in_the_same_directory_is_refused(sweep, folder):
    (folder / "out").mkdir()
    with (
        filelock.FileLock(folder / "out" / ".sweep.lock"),
        pytest.raises(
            ResultError, match=r"another wearsim sweep runs in .*wearsim status"
        ),
    ):
        run_sweep(sweep, "out", Runner(jobs=1))


def test_a_run_directory_is_no_directory_for_a_sweep(sweep, folder, cases):
    cases(1)
    (folder / "out" / "case_0001").rename(folder / "run")
    (folder / "out").rmdir()
    (folder / "run").rename(folder / "out")
    with pytest.raises(ResultError, match="is the run directory of a campaign"):
        run_sweep(sweep, "out", Runner(jobs=1))


@pytest.mark.slow
def test_ctrl_c_stops_after_the_running_case_and_the_rest_follows(
    sweep, folder, monkeypatch, cases
):
    def run(path, out, *, observer, **named):
        def pressed(event):
            observer(event)
            if event.kind == "step" and event.step == 1:
                raise KeyboardInterrupt

        return run_scene(path, out, observer=pressed, **named)

    cases(1)

    monkeypatch.setattr(ensemble, "run_scene", run)
    with pytest.raises(KeyboardInterrupt):
        run_sweep(sweep, "out", Runner(jobs=1))
    states = [item.state for item in outcomes_of(folder / "out")]
    assert states == ["finished", "interrupted", "not started", "not started"]
    assert [row["state"] for row in sweep_rows(sweep_dataset("out"))] == states
    monkeypatch.undo()
    monkeypatch.chdir(folder)
    cases(3, 4)
    assert {outcome.state for outcome in run_sweep(sweep, "out", Runner(jobs=1))} == {
        "finished"
    }


def test_a_killed_campaign_is_stopped_not_running(pair, folder):
    """Its status file says running; only the lock shows whether anybody works in the
    directory.
    """
    case = folder / "out" / "case_0001"
    run_one(pair, pair.cases[0], "out")
    status = json.loads((case / "status.json").read_text())
    status["campaigns"]["rig"]["state"] = "running"
    (case / "status.json").write_text(json.dumps(status))
    with filelock.FileLock(case / ".lock"):
        assert outcomes_of(folder / "out")[0].state == "running"
        assert read_status(case)["campaigns"]["rig"]["state"] == "running"
    assert outcomes_of(folder / "out")[0].state == "stopped"
    assert read_status(case)["campaigns"]["rig"]["state"] == "stopped"
    assert run_one(pair, pair.cases[0], "out").state == "finished"
    assert read_status(case)["campaigns"]["rig"]["state"] == "finished"


class Dying(AtOnce):
    """An executor whose workers die under one of the cases."""

    def submit(self, task, case):
        if case.number != 1:
            return super().submit(task, case)
        future = Future()
        future.set_exception(BrokenProcessPool("a process was killed"))
        return future


def test_a_case_whose_workers_died_says_so(pair, folder):
    outcomes = run_sweep(pair, "out", Runner(executor=Dying()))
    assert [outcome.exit_code for outcome in outcomes] == [3, 0]
    assert "its workers or their scheduler are gone" in outcomes[0].fault


@pytest.mark.slow
def test_a_comparison_has_a_row_for_each_of_its_campaigns(folder):
    field = (DATA / "scene_field.toml").read_text()
    (folder / "field.toml").write_text(field)
    (folder / "compare.toml").write_text((DATA / "scene_compare.toml").read_text())
    coarse = [
        "contact.strips=8",
        "contact.cells=8",
        "campaign.distance_km=2",
        "campaign.integrator=euler",
    ]
    sweep = sweep_of_flags("compare.toml", [*coarse, "wheelset.radius_mm=460"], None)
    (outcome,) = run_sweep(sweep, "out", Runner(jobs=1))
    assert outcome.state == "finished", outcome.fault
    assert [row["campaign"] for row in sweep_rows(sweep_dataset("out"))] == [
        "rig",
        "field",
    ]
    assert (folder / "out" / "case_0001" / "translation.nc").is_file()


@pytest.mark.cf
def test_the_table_of_a_sweep_is_cf(pair, folder, assert_cf):
    run_sweep(pair, "out", Runner(jobs=1))
    assert_cf("out/sweep.nc")


def test_the_plan_of_another_program_is_refused(sweep, folder):
    (folder / "out").mkdir()
    (folder / "out" / "sweep.json").write_text(json.dumps({"cases": 3}))
    with pytest.raises(ResultError, match="is not that of a wearsim sweep"):
        outcomes_of(folder / "out")


def test_python_sweeps_scenes_and_files_of_sweeps(folder):
    found = wearsim.sweep(
        "rig.toml", "out", {"operation.block.friction": [0.2, 0.35]}, jobs=1
    )
    assert found["state"].values.tolist() == ["finished", "finished"]
    depth = found["max_wear_depth"].values
    assert depth.shape == (2, 1, 2)
    (own,) = run_scene("rig.toml", "one", overrides={"operation.block.friction": 0.2})
    with open_results(own) as data:
        np.testing.assert_array_equal(depth[0, 0], data["max_wear_depth"][-1])
    tables = {
        "base": "rig.toml",
        "vary": {"operation": {"block": {"friction": [0.2, 0.35]}}},
    }
    again = wearsim.sweep(
        {"scene": {"kind": "sweep", "title": "rig"}, "sweep": tables}, "out"
    )
    np.testing.assert_array_equal(again["max_wear_depth"], depth)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: wearsim.sweep("rig.toml", "out"), "no sweep; give what to vary"),
        (
            lambda: wearsim.sweep({}, "out", {"a.b": [1]}),
            "vary needs the file of a scene",
        ),
        (
            lambda: wearsim.sweep("rig.toml", "out", {"wheelset.radius": [1]}),
            "unknown key radius",
        ),
        (
            lambda: wearsim.sweep("rig.toml", "out", {"wheelset.radius_mm": [-1, 460]}),
            "case 1: radius_mm = -1",
        ),
        (
            lambda: wearsim.sweep("none.toml", "out", {"wheelset.radius_mm": [460]}),
            "none.toml. does not exist",
        ),
        (lambda: wearsim.run_many("rig.toml", "out"), "scenes are a list of files"),
        (lambda: wearsim.run_many(["none.toml"], "out"), "none.toml. does not exist"),
    ],
)
def test_faults_of_python_sweeps_come_before_anything_is_written(folder, call, message):
    with pytest.raises(wearsim.WearsimError, match=message):
        call()
    assert not (folder / "out").exists()
