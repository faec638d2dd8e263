"""Kalker factor and falling friction fitted to a measured creep curve."""

import json

import numpy as np
import pandas as pd
import pytest

from wearsim.cli import main
from wearsim.studies.contact_points import operating_points, solve_points
from wearsim.studies.creep_curve import CreepCurve, fitted

CREEPAGE = [5e-4, 1e-3, 2e-3, 3e-3, 5e-3, 8e-3, 0.012, 0.02, 0.03, 0.05, 0.08, 0.12]
FLAGS = {"model": "fast", "strips": "12", "cells": "12", "cell_mm": "1"}
TRUE = {"kalker_factor": 0.4, "friction": 0.38}
FALLING = {"friction_ratio": 0.45, "friction_decrease": 0.7}


def points_of(direction="{},0,0", **texts):
    given = {key: str(value) for key, value in texts.items()}
    if "friction_decrease" in given:
        given["friction_decrease_s_m"] = given.pop("friction_decrease")
    table = pd.DataFrame({"creepage": [direction.format(size) for size in CREEPAGE]})
    points, faults = operating_points(table.assign(**given), FLAGS)
    assert not faults
    return points


def traction_of(points):
    patches = solve_points(points).patches
    force = np.hypot(patches["force_x"], patches["force_y"])
    return (force / patches["normal_force"]).to_numpy()


@pytest.mark.parametrize("direction", ["{},0,0", "{0},-{0},0"])
@pytest.mark.parametrize("falling", [{}, FALLING])
def test_a_computed_curve_gives_its_own_numbers_back(direction, falling):
    """Interpolation between 40 multiples, and lateral forces that lift: 2 %."""
    traction = traction_of(points_of(direction, **TRUE, **falling))
    curve = fitted(points_of(direction), traction)
    for name, value in TRUE.items():
        assert getattr(curve, name) == pytest.approx(value, rel=0.02)
    expected = falling or {"friction_ratio": 1.0, "friction_decrease": 0.0}
    for name, value in expected.items():
        assert getattr(curve, name) == pytest.approx(value, rel=0.02, abs=1e-9)
    assert curve.deviation < 2e-3


def test_numbers_at_a_limit_are_said_to_be_there():
    """Traction that falls with the square of the creepage: no friction is left."""
    points = points_of()
    slip = points.values["speed"].to_numpy() * np.array(CREEPAGE)
    traction = traction_of(points_of(friction=0.38)) * np.exp(-((slip / 1.5) ** 2))
    curve = fitted(points, traction)
    assert curve.friction_ratio == 0.0
    assert "friction_ratio = 0 (at its lower limit)" in curve.text
    assert "limit" not in CreepCurve(0.4, 0.38, 1.0, 0.0, 1e-3).text


def table(rows, head="creepage,traction_coefficient"):
    return "\n".join([head, *rows]) + "\n"


COARSE = [f"--{key.replace('_', '-')}={value}" for key, value in FLAGS.items()]


def test_a_table_with_a_measured_curve_states_its_numbers(tmp_path, capsys):
    traction = traction_of(points_of(**TRUE, **FALLING))
    rows = [f"{c},{t:.6f}" for c, t in zip(CREEPAGE, traction, strict=True)]
    path = tmp_path / "curve.csv"
    path.write_text(table(rows))
    assert main(["contact", "--table", str(path), *COARSE]) == 0
    out, err = capsys.readouterr()
    assert len(out.splitlines()) == 1 + len(rows)
    assert f"{path}: fitted creep curve: kalker_factor = 0." in err
    assert "friction_ratio = 0.4" in err
    assert main(["contact", "--table", str(path), *COARSE, "--json"]) == 0
    curve = json.loads(capsys.readouterr().out)["creep_curve"]
    assert curve["kalker_factor"] == pytest.approx(0.4, rel=0.03)
    assert curve["friction_decrease"] == pytest.approx(0.7, rel=0.05)


GOOD = [f"{size},0.2" for size in CREEPAGE]


@pytest.mark.parametrize(
    ("rows", "line", "output"),
    [
        ([*GOOD, "0.2,1.4"], 14, "traction_coefficient = 1.4 must be a number from 0"),
        ([*GOOD, "0.2,-0.1"], 14, "traction_coefficient = -0.1 must be a number from"),
        ([*GOOD, "0.2,"], 14, "traction_coefficient = nothing must be a number from"),
        ([*GOOD, ",0.2"], 14, "needs its creepage"),
        ([*GOOD, "much,0.2"], 14, "creepage = much must be three numbers"),
        (GOOD[:5], None, "a creep curve of 5 rows has too few for its four numbers"),
        (["0,0.0"] * 6, None, "needs rows with creepage"),
    ],
)
def test_measured_curves_that_are_refused(tmp_path, capsys, rows, line, output):
    path = tmp_path / "curve.csv"
    path.write_text(table(rows))
    assert main(["contact", "--table", str(path), *COARSE]) == 2
    (message,) = capsys.readouterr().err.splitlines()
    assert message.startswith(f"{path}{'' if line is None else f':{line}'}: ")
    assert output in message


def test_rows_of_different_models_are_no_curve(tmp_path, capsys):
    path = tmp_path / "curve.csv"
    rows = [f"{row},{wheel}" for row, wheel in zip(GOOD, [460, 450] * 6, strict=True)]
    path.write_text(table(rows, "creepage,traction_coefficient,wheel_radius_mm"))
    assert main(["contact", "--table", str(path), *COARSE]) == 2
    assert "are one creep curve" in capsys.readouterr().err
