"""Speed against accuracy: Pareto front, table, figure, committed report."""

import numpy as np
import pandas as pd
import pytest
import speed_accuracy
from speed_accuracy import pareto, speed_and_accuracy

from wearsim.scene import build, load_scene


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
            speed_accuracy, "_ENOUGH", 0.02
        )  # times from a few repeats: none is compared with another here
        return speed_and_accuracy([build(load_scene(path))], 4e-6, [0.1, 0.02])


def test_every_combination_has_times_and_an_error_or_a_refusal(table):
    fault = table["refusal"] != ""
    for name in ("time", "time_ratio", "steps", "depth_error"):
        assert (table[name].isna() == fault).all()
    fixed = ~table["models"].str.startswith("auto")
    assert (table["time_per_solution"].notna() == (fixed & ~fault)).all()
    assert table["models"].str.startswith("auto").sum() == 2
    true = table[table["models"] == "half_space + half_space"].iloc[0]
    assert true["time_ratio"] == 1.0
    assert true["depth_error"] < 0.03  # of its steps alone
    assert not table["pareto"][fault].any()
    assert table["pareto"].any()


def test_auto_is_nearer_than_the_fast_models_alone(table):
    error = table.set_index("models")["depth_error"]
    assert error["auto, 2 %"] < 0.5 * error["kik_piotrowski + fastsim"]


@pytest.mark.parametrize("programme", [False, True])
def test_programmes_are_compared_at_ends_of_steps_that_both_have(programme):
    """One campaign goes through two blocks, of which the first wears, in one step over the whole loop."""
    ends, loops = np.array([0.0, 1.0, 2.0, 3.0, 4.0]), np.array([0.0, 2.0, 4.0])
    blocks, whole = np.array([0.0, 1.0, 1.0, 2.0, 2.0]), np.array([0.0, 1.0, 2.1])
    true, ours = (
        speed_accuracy.Run(at, depth[:, None, None] * np.ones((1, 2, 3)), None, 0.0, 0, programme)
        for at, depth in ((ends, blocks), (loops, whole))
    )
    found, deepest = ours.differences(true)
    assert deepest[-1] == 2.0
    assert ours.error_from(true) == pytest.approx(found.max() / 2.0)
    if programme:
        assert found == pytest.approx([0.0, 0.1])
    else:
        assert found.max() > 0.3


def test_the_figure_is_the_table():
    table = pd.DataFrame({
        "scene": ["rig"] * 3, "models": ["a", "b", "c"], "time_ratio": [0.1, 1.0, np.nan],
        "depth_error": [0.05, 1e-6, np.nan], "pareto": [True, True, False],
    })  # fmt: skip
    lines = speed_accuracy.plot_chart(table).axes[0].lines
    assert [line.get_xydata().tolist() for line in lines[:2]] == [[[0.1, 5.0]], [[1.0, 0.1]]]
    assert lines[2].get_xdata().tolist() == [0.1, 1.0]


@pytest.fixture(scope="module")
def committed(reports):
    return pd.read_csv(reports / "speed_accuracy.csv").set_index(["scene", "models"])


RIG, FIELD = "S1002 on 1 m rollers, 60E1 1:40", "S1002 in service on 60E1 1:40"


@pytest.mark.parametrize("scene", [RIG, FIELD])
def test_auto_at_three_per_cent_keeps_it_in_the_committed_report(committed, scene):
    assert committed.loc[(scene, "auto, 3 %"), "depth_error"] <= 0.03


@pytest.mark.parametrize("scene", [RIG, FIELD])
def test_auto_is_faster_than_the_half_space_at_every_point_in_the_committed_report(committed, scene):
    assert committed.loc[(scene, "auto, 3 %"), "time_ratio"] < 1.0
