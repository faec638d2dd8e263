"""Errors of contact models against a reference: definitions, classes, refusals, report."""

import numpy as np
import pytest

from wearsim.report.accuracy import classes, markdown
from wearsim.report.pages_accuracy import values_table, write_accuracy
from wearsim.scene import load_scene
from wearsim.scene.accuracy import matrix_of
from wearsim.studies.accuracy import ERRORS, solve_accuracy

TEXT = """\
[scene]
kind = "accuracy"
title = "Coarse against fine"
[wheelset]
profile = "S1002"
[matrix]
roller_radii_mm = [500]
shifts_mm = [-4, 0, 3, 5.3]
yaws_mrad = [0, 10]
[reference]
normal = "kik_piotrowski"
tangential = "fastsim"
strips = 60
cells = 60
[[model]]
normal = "kik_piotrowski"
tangential = "fastsim"
strips = 60
cells = 60
[[model]]
normal = "kik_piotrowski"
tangential = "fastsim"
strips = 20
cells = 20
[[model]]
normal = "hertz"
tangential = "fastsim"
"""


@pytest.fixture(scope="module")
def matrix(tmp_path_factory):
    path = tmp_path_factory.mktemp("accuracy") / "accuracy.toml"
    path.write_text(TEXT)
    return matrix_of(load_scene(path))


@pytest.fixture(scope="module")
def dataset(matrix):
    return solve_accuracy(matrix)


def test_the_reference_has_no_error_against_itself(dataset):
    for name in ERRORS:
        assert np.all(dataset[f"error_{name}"].values[0] == 0.0)


def test_a_coarse_grid_has_errors_of_its_size(dataset):
    """20 against 60 strips and cells: FASTSIM's power is off by up to 5 %, strip work by its bins, too."""
    for name, most in {
        "area": 0.01,
        "max_pressure": 1e-9,
        "force": 0.03,
        "power": 0.05,
        "strip_work": 0.12,
    }.items():
        error = np.abs(dataset[f"error_{name}"].values[1])
        assert np.all(error < most), name
        assert name == "max_pressure" or np.all(error > 0.0), name


def test_strip_work_is_at_least_as_wrong_as_the_power(dataset):
    """Its error holds that of the sum: the power over speed is the integral of the strip work."""
    power, work = np.abs(dataset["error_power"].values[1]), dataset["error_strip_work"].values[1]
    assert np.all(work > power - 1e-9)


def test_refusals_are_kept_apart(dataset):
    refused = dataset["refusal"].values[2] != ""
    at_zero = dataset["shift"].values == 0.0
    assert np.all(refused[at_zero])
    assert not np.all(refused)
    for name in ERRORS:
        assert np.array_equal(np.isnan(dataset[f"error_{name}"].values[2]), refused)
    assert "no contact ellipse" in dataset["refusal"].values[2][refused][0]


def test_some_cases_alone_give_the_same_values(matrix, dataset):
    some = solve_accuracy(matrix, [1, 6, 13])
    for name in ("reference_power", "reference_slip_share", "shift", "yaw", "counterface_curvature"):
        np.testing.assert_array_equal(some[name].values, dataset[name].values[[1, 6, 13]])
    for name in ("power", "error_strip_work"):
        np.testing.assert_array_equal(some[name].values, dataset[name].values[:, [1, 6, 13]])


def test_classes_part_the_cases(dataset):
    found = classes(dataset)
    assert np.array_equal(found["slip below 0.9"], ~found["slip above 0.9"])
    assert np.array_equal(found["single patch"], ~found["split patch"])
    assert found["split patch"].sum() >= 1  # two patches at 5.3 mm


def test_report_and_table_hold_every_model_and_case(dataset, tmp_path):
    path = write_accuracy(dataset, tmp_path / "new", "accuracy", "wearsim run accuracy.toml")
    text = path.read_text()
    for model in dataset["model"].values:
        assert f"| `{model}` | all |" in text
    assert "refuses 4 of 16 cases" in text
    assert (tmp_path / "new" / "accuracy.svg").read_text().startswith("<?xml")
    table = values_table(dataset)
    assert len(table) == 16 * 4
    assert list(table["model"].unique()) == ["reference", *dataset["model"].values]


def test_quantiles_of_the_report_are_those_of_the_errors(dataset):
    text = markdown(dataset, "wearsim run accuracy.toml", ("accuracy.svg", "Errors"))
    row = next(line for line in text.splitlines() if "20 x 20` | all" in line)
    middle, most = np.quantile(np.abs(dataset["error_power"].values[1]), [0.5, 0.95])
    assert f"{100 * middle:.1f} · {100 * most:.1f}" == row.split(" | ")[6]
