"""The chart of speed against accuracy: Pareto front, dataset, report, command."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from wearsim.campaign import choose
from wearsim.campaign.choose import judge
from wearsim.campaign.evaluate import setup_of
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.cli import main
from wearsim.contact.problem import ContactModels
from wearsim.report.chart import markdown, peers, write_chart
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


@pytest.fixture(scope="module", autouse=True)
def few_repeats():
    """Times from a few repeats: none is compared with another here."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chart, "_ENOUGH", 0.02)
        yield


@pytest.fixture(scope="module")
def dataset():
    return speed_and_accuracy([build(load_scene("workflows/rig_by_shift.toml"))], [12], 16, points=4)


def test_every_combination_has_a_time_and_errors_or_a_refusal(dataset):
    fault = (dataset["refusal"].values != "")[0]
    assert fault.any()  # hertz, at zero shift
    for name in ("time", "worst_depth_error"):
        assert np.array_equal(np.isnan(dataset[name].values), fault)
    assert np.all(dataset["time"].values[~fault] > 0.0)
    names = dataset["normal"].values
    assert np.array_equal(dataset["can_update_profile"].values, names != "hertz")
    assert not dataset["pareto"].values[fault].any()


def test_report_holds_what_has_an_answer_and_what_has_not(dataset, tmp_path):
    text = markdown(dataset, "wearsim chart", ("chart.svg", "Chart"))
    assert "| kik_piotrowski | fastsim | 12 |" in text
    assert "- hertz + fastsim, 12: " in text
    path = write_chart(dataset, tmp_path / "new", "chart", "wearsim chart")
    assert (tmp_path / "new" / "chart.svg").is_file()
    assert path.read_text().startswith("# Speed against accuracy")


def test_peers_have_times_and_errors():
    for row in peers():
        assert float(row["time"]) > 0.0
        assert row["power_error"] == "" or 0.0 <= float(row["power_error"]) < 1.0


def test_json_of_the_command(capsys):
    flags = ["--grids", "8", "--reference-grid", "10", "--points", "1", "--json"]
    assert main(["chart", "workflows/rig_by_shift.toml", *flags]) == 0
    message = json.loads(capsys.readouterr().out)
    assert message["reference"] == "half_space + half_space, 10 x 10"
    assert {model["grid"] for model in message["models"]} == {8}
    assert all(model["scenes"][0]["refusal"] or model["time"] > 0.0 for model in message["models"])


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        (
            ["--grids", "3,x"],
            ["--grids = 3 must be a whole number, at least 5 and at most 200", "--grids = x must be"],
        ),
        (["--grids", "50", "--reference-grid", "40"], ["--reference-grid = 40 must be at least the finest"]),
        (["--points", "0"], ["--points = 0 must be a whole number, at least 1 and at most 500"]),
    ],
)
def test_wrong_flags_are_told_all_at_once(flags, message, capsys):
    assert main(["chart", *flags]) == 2
    error = capsys.readouterr().err
    assert all(part in error for part in message)


@pytest.fixture(scope="module")
def committed():
    return pd.read_csv(REPOSITORY / "reports/speed_accuracy.csv").set_index(["normal", "tangential", "grid"])


def test_defaults_lie_on_the_front_of_the_committed_chart(committed):
    models = ContactModels()
    assert models.strips == models.cells
    assert committed.loc[(models.normal, models.tangential, models.strips), "pareto"].all()


def test_candidates_of_auto_lie_on_the_front_of_the_committed_chart(committed):
    """Those with the half-space where the strip model refuses: none without strips is faster and closer."""
    charted = [one[:3] for one in choose.COST_ORDER if one[:3] in committed.index]
    assert len(charted) >= 7
    worst = committed.groupby(level=[0, 1, 2])[["time_ratio", "depth_error", "work_error"]].max()
    others = worst[worst.index.get_level_values("normal") != "knothe_le_the"]
    behind = [name for name in charted if not committed.loc[name, "pareto"].all()]
    assert {normal for normal, *_ in behind} <= {"half_space"}
    for name in behind:
        assert not ((others <= worst.loc[name]).all(axis=1) & (others < worst.loc[name]).any(axis=1)).any()


@pytest.mark.slow
def test_errors_of_the_committed_chart_are_found_again():
    """Fast combinations on the rig: iterations of the half-space, and a wear law that magnifies them where it
    has steps."""
    message = pd.read_csv(REPOSITORY / "reports/speed_accuracy.csv")
    rig = build(load_scene("workflows/rig_by_shift.toml"))
    state, _ = WheelsetEvolution(rig).start()
    grid = {"strips": 60, "cells": 60, "most_cells": 60}
    truth = replace(rig.models, normal="half_space", tangential="half_space", **grid)
    rows = message[
        (message["scene"] == rig.title) & (message["tangential"] == "fastsim") & (message["grid"] == 30)
    ]
    rows = rows[rows["refusal"].isna()]
    assert len(rows) >= 3
    grid = {"strips": 30, "cells": 30, "most_cells": 30}
    models = [replace(rig.models, normal=name, **grid) for name in rows["normal"]]
    evidence = judge(
        models, truth, state, choose.sample_of(rig, state, 10).points,
        setup_of(rig), smoothing_wavelength=rig.control.smoothing_wavelength,
    )  # fmt: skip
    for one, (_, row) in zip(evidence, rows.iterrows(), strict=True):
        assert one.depth_error == pytest.approx(row["depth_error"], abs=2e-3)
        assert one.work_error == pytest.approx(row["work_error"], abs=5e-4)
        assert one.power_error == pytest.approx(row["power_error"], abs=5e-4)
