"""Operating points that fail: left out while they carry little of the wear, the end of
the run beyond.
"""

import re
from dataclasses import replace

import numpy as np
import pytest

from wearsim.campaign.directory import read_status
from wearsim.campaign.evaluate import accumulate, setup_of, solve_passage
from wearsim.campaign.run import resume, run_scene
from wearsim.cli import main
from wearsim.contact import solve as solver
from wearsim.errors import ContactError, NumericalError, SceneError
from wearsim.operation.points import select
from wearsim.results import ROW, open_results, result_warnings
from wearsim.scene.initial_contact import check_contact
from wearsim.scene.read import load_campaign

# its points from 6 mm on lock: friction x tan(contact angle) is above 1 on the flange
SWITCH = """
[[operation.class]]
name = "switch"
shift_mean_mm = 4
shift_std_mm = 1
positions = 10
load_kN = 80
speed_km_h = 30
friction = 0.5
yaw_mrad = -30
share = {share}
"""
FIELD = """
[scene]
kind = "field"
[wheelset]
profile = "S1002"
[counterface]
profile = "60E1"
inclination = "1:40"
[contact]
model = "standard"
strips = 10
cells = 10
[campaign]
distance_km = 60
point_spacing_mm = 0.5
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
RIG = """
[scene]
kind = "rig"
[wheelset]
profile = "S1002"
[counterface]
profile = "60E1"
inclination = "1:40"
roller_radius_mm = 1000
[contact]
model = "standard"
strips = 10
cells = 10
[campaign]
distance_km = {distance}
point_spacing_mm = 0.5
max_step_depth_um = 20
stability = 1.0
[[operation.block]]
name = "long"
shift_mm = 3
load_kN = 80
speed_km_h = 72
friction = 0.35
distance_km = 4
[[operation.block]]
name = "short"
shift_mm = -1
load_kN = 80
speed_km_h = 72
friction = 0.35
distance_km = {short}
"""


@pytest.fixture
def locks_when_worn(monkeypatch):
    """The block to the left has no contact solution on wheels worn by more than 30
    um.
    """
    solve_chunk, new = solver._solve_chunk, []

    def locking(task, chunk, index):
        new.append(task.wheelset.right.z)
        locked = np.flatnonzero(chunk.shift == -1e-3)
        if locked.size > 0 and np.abs(task.wheelset.right.z - new[0]).max() > 30e-6:
            raise ContactError(
                f"point {index[locked[0]]}, right wheel: flange locks",
                int(index[locked[0]]),
            )
        return solve_chunk(task, chunk, index)

    monkeypatch.setattr(solver, "_solve_chunk", locking)


def rows_of(path):
    with open_results(path) as data:
        data.load()
        return {
            name: data[name].values
            for name in (*ROW, "left_out", "left_out_share", "last_wear_area_rate")
        }


def test_other_points_of_the_class_act_for_one_that_fails(evolution_of):
    evolution = evolution_of(FIELD + SWITCH.format(share=0.001))
    points, (state, _) = evolution.setup.points, evolution.start()
    evaluation = evolution.evaluate(state)
    out = sorted(evaluation.passage.failed)
    assert out == [19]  # 7 mm
    assert 0.0 < evaluation.points.share < 0.01
    # the collective without it, its weight given to the others of its class
    kept = np.setdiff1d(np.arange(20), out)
    setup, weight = setup_of(evolution.setup), points.weight.copy()
    weight[10:] *= weight[10:].sum() / weight[10:19].sum()
    alone = select(points, kept)
    rate = accumulate(
        solve_passage(replace(state, points=None), alone, setup),
        alone,
        weight[kept],
        state,
        setup,
    )
    # one point less in a batch: last bits of sums over padding
    np.testing.assert_allclose(
        evaluation.collective.depth, rate.depth, rtol=0, atol=1e-9 * rate.depth.max()
    )
    heavy = evolution_of(FIELD + SWITCH.format(share=0.0099))
    start = heavy.start()[0]
    with pytest.raises(
        ContactError,
        match=r"after 0 km .* switch \+7.00 mm .* carries [1-9].* flange locks",
    ):
        heavy.evaluate(start)


def test_check_lists_them_with_their_share_and_as_faults_beyond(tmp_path):
    file = tmp_path / "field.toml"
    file.write_text(FIELD + SWITCH.format(share=0.001))
    (warning,) = [
        fault
        for fault in check_contact(load_campaign(file))
        if "left out" in fault.message
    ]
    assert re.search(
        r"shift of 7 mm .* locks: .* left out, together they carry 0\.\d+ %",
        warning.message,
    )
    file.write_text(FIELD + SWITCH.format(share=0.0099))
    with pytest.raises(SceneError, match=r"shift of 7 mm .* locks: "):
        check_contact(load_campaign(file))


def test_a_class_that_was_never_solved_is_a_fault_however_short_it_is(
    evolution_of, tmp_path
):
    switch = SWITCH.format(share=1e-5).replace("shift_mean_mm = 4", "shift_mean_mm = 7")
    switch = switch.replace("shift_std_mm = 1\npositions = 10", "shift_std_mm = 0")
    evolution = evolution_of(FIELD + switch)
    with pytest.raises(
        ContactError,
        match=r"switch .* no point of its .* was ever solved, so that .* locks",
    ):
        evolution.evaluate(evolution.start()[0])
    (tmp_path / "field.toml").write_text(FIELD + switch)
    with pytest.raises(SceneError, match=r"shift of 7 mm .* locks: "):
        check_contact(load_campaign(tmp_path / "field.toml"))


def test_points_that_fail_are_dropped_chunk_by_chunk_whatever_the_threads(
    evolution_of, monkeypatch
):
    monkeypatch.setattr(solver, "CHUNK", 4)
    evolution = evolution_of(FIELD + SWITCH.format(share=0.001))
    state, setup = evolution.start()[0], setup_of(evolution.setup)
    points = replace(evolution.setup.points)
    points.conditions.shift[[1, 13, 14]] = 0.08  # far off the rail
    passages = [
        solve_passage(state, points, replace(setup, threads=threads))
        for threads in (1, 2)
    ]
    failed = passages[0].failed
    assert sorted(failed) == [1, 13, 14, 19]
    assert all(error.row in failed for error in failed.values())
    for one, two in zip(passages[0].depth, passages[1].depth, strict=True):
        np.testing.assert_array_equal(one, two)
    with pytest.raises(ContactError, match="point 1, "):
        solve_passage(replace(state, points=None), points, setup)


def test_block_that_locks_while_it_carries_little_wear_is_left_out_and_resumes_to_the_same_bits(
    locks_when_worn, tmp_path, stopped_at
):
    (tmp_path / "rig.toml").write_text(RIG.format(distance=60, short=0.05))
    whole, stopped = tmp_path / "whole", tmp_path / "stopped"
    run_scene(tmp_path / "rig.toml", whole, threads=2)
    rows = rows_of(whole / "rig.nc")
    first = int(np.argmax(rows["left_out"].any(axis=1)))
    assert first > 1
    assert (rows["left_out"][first:] == [0, 1]).all()
    assert (rows["left_out_share"][first:] > 0.0).all()
    assert (rows["left_out_share"] < 0.01).all()
    rate = rows["last_wear_area_rate"][first:, 1]
    assert (rate == rate[0]).all()  # known from the last state in which it was solved
    assert (rows["distance"][-1], (rows["n_patch"][first:, 1] == 0).all()) == (
        60e3,
        True,
    )
    with open_results(whole / "rig.nc") as data:
        (warning,) = [line for line in result_warnings(data) if "left out" in line]
    assert warning.startswith(
        "1 of 2 operating points had no contact solution and were left out (short)"
    )
    status = read_status(whole)["campaigns"]["rig"]
    assert (status["left_out"], status["left_out_share"]) == (
        1,
        rows["left_out_share"][-1],
    )
    with stopped_at(first) as observer:
        run_scene(tmp_path / "rig.toml", stopped, observer=observer, threads=1)
    resume(stopped)
    again = rows_of(stopped / "rig.nc")
    for name, values in rows.items():
        np.testing.assert_array_equal(again[name], values, err_msg=name)


def test_block_that_locks_and_carries_more_ends_the_run_with_its_reason(
    locks_when_worn, tmp_path, capsys
):
    (tmp_path / "rig.toml").write_text(RIG.format(distance=60, short=2))
    out = tmp_path / "out"
    assert (
        main(["run", str(tmp_path / "rig.toml"), "--out", str(out)])
        == NumericalError.exit_code
        == 3
    )
    reason = capsys.readouterr().err.splitlines()[-1]
    assert "short" in reason
    assert "flange locks" in reason
    status = read_status(out)["campaigns"]["rig"]
    assert (status["state"], status["message"]) == ("failed", reason)
    assert status["step"] >= 1
    page = (out / "report.html").read_text()
    assert reason in page.split("<h2>")[0].replace("&gt;", ">")
    assert main(["status", str(out)]) == 0
    assert reason in capsys.readouterr().out
    assert main(["resume", str(out)]) == 3  # the state is kept
    assert "continued at step" in capsys.readouterr().err
