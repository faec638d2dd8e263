"""Positions of worn wheelsets: the committed report, and its targets."""

import numpy as np
import pandas as pd
import positions
import pytest


@pytest.fixture(scope="module")
def committed(reports):
    return pd.read_csv(reports / "positions.csv")


def test_the_report_is_what_its_table_says(reports, tmp_path):
    (tmp_path / "positions.csv").write_bytes((reports / "positions.csv").read_bytes())
    positions.main(["--from-csv", "--out", str(tmp_path)])
    assert (tmp_path / "positions.md").read_text() == (
        reports / "positions.md"
    ).read_text()


def test_thirty_worn_wheelsets_are_compared(committed):
    assert committed.groupby("scene").size().to_dict() == {"rig": 20, "field": 10}
    assert np.isfinite(committed.select_dtypes("number")).all(axis=None)


def test_differences_are_those_of_the_table():
    rows = pd.DataFrame(
        {
            "standard_shift_mm": [1.0, 2.0],
            "accurate_shift_mm": [1.01, 2.0],
            "standard_wear_number_N": [11.0, 0.6],
            "accurate_wear_number_N": [10.0, 0.5],
        }
    )
    shift, power = positions.differences(rows)
    assert shift.to_numpy() == pytest.approx([-10.0, 0.0])
    assert power.to_numpy() == pytest.approx([10.0, 10.0])  # of 10 N and of 1 N


@pytest.mark.parametrize(
    "scene",
    [
        pytest.param(
            "rig",
            marks=pytest.mark.xfail(
                strict=True, reason="measured 278 um and 36 %, target 20 um and 3 %"
            ),
        ),
        pytest.param(
            "field",
            marks=pytest.mark.xfail(
                strict=True, reason="measured 20.1 um and 4.2 %, target 20 um and 3 %"
            ),
        ),
    ],
)
def test_strips_let_wheelsets_run_where_the_half_space_does(committed, scene):
    shift, power = positions.differences(committed[committed["scene"] == scene])
    assert np.abs(shift).max() <= positions.SHIFT_TARGET
    assert np.abs(power).max() <= positions.POWER_TARGET


def test_nearly_all_axles_of_bogies_run_where_the_half_space_lets_them(committed):
    shift, power = positions.differences(committed[committed["scene"] == "field"])
    assert np.abs(shift).median() <= 0.5 * positions.SHIFT_TARGET
    assert (np.abs(power) <= positions.POWER_TARGET).mean() >= 0.9
