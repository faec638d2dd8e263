"""The chart of speed against accuracy: Pareto front, table, command, committed
report.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from wearsim.cli import main
from wearsim.scene import build, load_scene
from wearsim.studies import chart
from wearsim.studies.chart import pareto, speed_and_accuracy

REPOSITORY = Path(__file__).parents[2]


def test_the_front_holds_what_none_beats():
    cost = np.array([1.0, 2.0, 3.0, 2.5, np.nan, 1.0])
    error = np.array([0.5, 0.2, 0.1, 0.3, 0.0, 0.5])
    assert pareto(cost, error).tolist() == [True, True, True, False, False, True]
    other = np.array([0.5, 0.2, 0.1, 0.15, 0.0, 0.6])
    assert pareto(cost, error, other).tolist() == [True, True, True, True, False, False]


@pytest.fixture(scope="module")
def table(tmp_path_factory, scene_text):
    path = tmp_path_factory.mktemp("chart") / "rig.toml"
    campaign = "distance_km = 1e4\npoint_spacing_mm = 0.5"
    path.write_text(scene_text({"shift_mm": 1, "distance_km": 1e4}, campaign=campaign))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            chart, "_ENOUGH", 0.02
        )  # times from a few repeats: none is compared with another here
        return speed_and_accuracy([build(load_scene(path))], 4e-6)


def test_every_combination_has_times_and_an_error_or_a_refusal(table):
    fault = table["refusal"] != ""
    for name in ("time", "time_ratio", "steps", "depth_error"):
        assert (table[name].isna() == fault).all()
    assert (table["time_per_solution"].notna() == ~fault).all()
    true = table[table["models"] == "half_space + half_space"].iloc[0]
    assert true["time_ratio"] == 1.0
    assert true["depth_error"] < 0.03  # of its steps alone
    assert not table["pareto"][fault].any()
    assert table["pareto"].any()


def test_strips_that_slip_as_the_wheels_own_radius_are_nearer_than_patches_in_one_plane(
    table,
):
    """1 mm off centre on a wide tread, by 1 m rollers; rows of cells of the half-space
    slip so, too.
    """
    error = table.set_index("models")["depth_error"]
    assert (
        error["coupled_strips + coupled_strips"]
        < 0.4 * error["kik_piotrowski + half_space"]
    )
    assert error["half_space + coupled_strips"] < 0.5 * error["half_space + fastsim"]


@pytest.mark.parametrize("programme", [False, True])
def test_programmes_are_compared_at_ends_of_steps_that_both_have(programme):
    """One campaign goes through two blocks, of which the first wears, in one step over
    the whole loop.
    """
    ends, loops = np.array([0.0, 1.0, 2.0, 3.0, 4.0]), np.array([0.0, 2.0, 4.0])
    blocks, whole = np.array([0.0, 1.0, 1.0, 2.0, 2.0]), np.array([0.0, 1.0, 2.1])
    true, ours = (
        chart.Run(
            at, depth[:, None, None] * np.ones((1, 2, 3)), None, 0.0, 0, programme
        )
        for at, depth in ((ends, blocks), (loops, whole))
    )
    found, deepest = ours.differences(true)
    assert deepest[-1] == 2.0
    assert ours.error_from(true) == pytest.approx(found.max() / 2.0)
    if programme:
        assert found == pytest.approx([0.0, 0.1])
    else:
        assert found.max() > 0.3


def test_json_table_and_page_of_the_command(capsys, table, monkeypatch, tmp_path):
    monkeypatch.setattr(chart, "speed_and_accuracy", lambda *_, **__: table)
    assert main(["chart", "workflows/rig_given.toml", "--json"]) == 0
    message = json.loads(capsys.readouterr().out)
    assert [one["time"] is None for one in message["models"]] == table[
        "time"
    ].isna().tolist()
    assert main(["chart", "workflows/rig_given.toml"]) == 0
    assert capsys.readouterr().out.count("yes") == table["pareto"].sum()
    assert (
        main(
            [
                "chart",
                "workflows/rig_given.toml",
                "--report",
                str(tmp_path / "chart.html"),
            ]
        )
        == 0
    )
    page = (tmp_path / "chart.html").read_text()
    assert page.count(">yes</td>") == table["pareto"].sum()
    assert 'id="figure-chart"' in page


def test_wrong_flags_are_named(capsys):
    with pytest.raises(SystemExit) as caught:
        main(["chart", "--depth-um", "0"])
    assert caught.value.code == 2
    assert (
        "0 must be a number, at least 0.5 and at most 5000" in capsys.readouterr().err
    )
