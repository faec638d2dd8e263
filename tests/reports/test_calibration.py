"""Calibrations of the report: the committed tables, their targets, sampled rows."""

import calibration
import numpy as np
import pandas as pd
import pytest


@pytest.fixture(scope="module")
def committed(reports):
    return {
        name: pd.read_csv(reports / f"calibration_{name}.csv")
        for name in calibration.PARTS
    }


def test_the_report_is_what_its_tables_say(reports, tmp_path):
    for file in reports.glob("calibration_*.csv"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    calibration.main(["--from-csv", "--out", str(tmp_path)])
    written = (tmp_path / "calibration.md").read_text()
    assert written == (reports / "calibration.md").read_text()


def test_intervals_of_closed_form_rigs_cover(committed):
    """Five inputs of each rig, 90 %: within 3 standard errors of independent ones."""
    rows = committed["rigs"]
    held = np.array([rows[f"{name}_held"] for name in calibration.rig.NAMES])
    error = np.sqrt(0.9 * 0.1 / held.size)
    assert held.mean() == pytest.approx(0.9, abs=3.0 * error)


def test_intervals_cover_the_hidden_inputs_whatever_the_noise(committed):
    rows = committed["noises"]
    held = np.array([rows[f"{name}_held"] for name in calibration.INPUTS])
    assert held.mean() >= 0.86


@pytest.mark.xfail(
    strict=True,
    reason="measured 1.39 to 1.67 for a wear coefficient of 1.37: the shipped noise",
)
def test_the_shipped_measurements_recover_the_wear_coefficient(committed):
    shipped = committed["noises"].iloc[0]
    assert shipped["wear coefficient_held"] == 1


@pytest.mark.slow
def test_rigs_of_the_report_computed_again(committed):
    rows = calibration.of_rigs(5).drop(columns="seconds")
    held = committed["rigs"].head(5)[rows.columns]
    # ranks among 99 draws that machines round differently
    assert np.abs(rows.to_numpy() - held.to_numpy()).max() <= 3


def test_the_models_leave_less_than_another_scene_is_widened_by(committed):
    """Truths by the half-space: of `standard` less than 3 % of the wear coefficient."""
    rows = committed["models"]
    left = (rows["off_ln_k"] - rows["prior_pull_ln_k"]).groupby(rows["model"]).mean()
    for model, mean in left.items():
        assert abs(mean) < calibration.calibration.MODEL_DEVIATION[model]
    assert rows.groupby("model").size().tolist() == [5, 5]
