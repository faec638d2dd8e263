"""The chart of speed against accuracy: Pareto front, table, command, committed report."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from wearsim.campaign.choose import judge

from wearsim.campaign import choose
from wearsim.campaign.evaluate import setup_of
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.cli import main
from wearsim.contact.problem import ContactModels
from wearsim.scene import build, load_scene
from wearsim.studies import chart
from wearsim.studies.chart import ERRORS, pareto, speed_and_accuracy

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
def table():
    return speed_and_accuracy([build(load_scene("workflows/rig.toml"))], [12], 16, points=4)


def test_every_combination_has_a_time_and_errors_or_a_refusal(table):
    fault = table["refusal"] != ""
    assert fault.any()  # hertz, at zero shift
    for name in ("time", *ERRORS):
        assert (table[name].isna() == fault).all()
    assert (table["time"][~fault] > 0.0).all()
    assert (table["can_update_profile"] == (table["normal"] != "hertz")).all()
    assert not table["pareto"][fault].any()


def test_json_and_table_of_the_command(capsys, table, monkeypatch):
    monkeypatch.setattr(chart, "speed_and_accuracy", lambda *_, **__: table)
    asked = ["chart", "workflows/rig.toml", "--grids", "12", "--reference-grid", "16"]
    assert main([*asked, "--json"]) == 0
    message = json.loads(capsys.readouterr().out)
    assert message["reference"] == "half_space + half_space, 16 x 16"
    assert [model["time"] is None for model in message["models"]] == table["time"].isna().tolist()
    assert main(asked) == 0
    text = capsys.readouterr().out
    assert text.count("refused") == 4 * (table["refusal"] != "").sum()
    assert text.count("yes") == table["pareto"].sum()


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        (["--grids", "20,3"], "3 must be a whole number, at least 5 and at most 200"),
        (["--grids", "50", "--reference-grid", "40"], "--reference-grid = 40 must be at least the finest"),
        (["--points", "0"], "0 must be a whole number, at least 1 and at most 500"),
    ],
)
def test_wrong_flags_are_told(flags, message, capsys):
    try:
        code = main(["chart", *flags])
    except SystemExit as error:
        code = error.code
    assert code == 2
    assert message in capsys.readouterr().err


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
    rig = build(load_scene("workflows/rig.toml"))
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
