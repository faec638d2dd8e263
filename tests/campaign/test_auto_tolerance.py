"""The tolerance of `model = "auto"` on collectives that were not used in its making."""

import csv
import importlib.util
from pathlib import Path

import numpy as np
import pytest

from wearsim.campaign.choose import CLASSES

PROGRAM = Path(__file__).parent / "auto_scenes.py"


@pytest.fixture(scope="module")
def made_up():
    spec = importlib.util.spec_from_file_location("auto_scenes", PROGRAM)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def rows(made_up):
    with open(made_up.TABLE, newline="") as file:
        return list(csv.DictReader(file))


def test_the_table_has_all_scenes(made_up, rows):
    assert [(int(row["scene"]), row["kind"], float(row["tolerance"])) for row in rows] == [
        (number, kind, tolerance) for number, kind, _, tolerance in made_up.SCENES
    ]


def kept(rows):
    """Errors over the tolerance, 1 at most where it is kept."""
    return np.array([float(row["whole"]) / float(row["tolerance"]) for row in rows])


@pytest.mark.parametrize("tolerance", [0.1, 0.05])
def test_the_tolerance_is_kept_on_95_percent_of_the_collectives(rows, tolerance):
    share = kept([row for row in rows if float(row["tolerance"]) == tolerance])
    assert share.size >= 50
    assert share.max() < 1.5  # a miss is a near one
    assert np.mean(share <= 1.0) >= 0.95


def test_the_tolerance_is_kept_on_95_percent_of_the_collectives_that_had_no_part_in_the_making(made_up, rows):
    """Those from `UNSEEN` on were drawn after the last change; ten with 10 %, of which one missed it."""
    share = kept([row for row in rows if int(row["scene"]) >= made_up.UNSEEN])
    assert share.size >= 30
    assert np.mean(share <= 1.0) >= 0.95


def test_not_always_the_same_models_are_chosen(rows):
    assert len({row["alone"] for row in rows}) >= 3
    assert len({row["leading"] for row in rows}) >= 3


def test_classes_save_solutions_where_these_are_dear(rows):
    """One combination for all points is among them: never dearer; where it needs a half-space, far less."""
    cost, alone = (np.array([float(row[name]) for row in rows]) for name in ("cost", "alone_cost"))
    assert np.all(cost <= alone)
    dear = alone > 10.0
    assert dear.sum() >= 3
    assert np.median(cost[dear] / alone[dear]) < 0.6


@pytest.mark.slow
@pytest.mark.parametrize("number", [7, 98])
def test_rows_are_found_again(made_up, rows, tmp_path, number):
    row = made_up.outcome(number, tmp_path)
    for name in ("alone", *CLASSES, "points"):
        assert row[name] == rows[number][name]
    for name in ("alone_whole", "sample", "whole"):
        assert float(row[name]) == pytest.approx(
            float(rows[number][name]), abs=2e-4
        )  # rounding, other processors
