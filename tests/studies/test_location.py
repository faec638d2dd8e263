"""Contact locations: the committed figure of the seed paper, jumps of the contact, the command."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from wearsim.cli import main
from wearsim.report.pages_location import markdown, values_table
from wearsim.scene import load_scene
from wearsim.scene.location import locations_of
from wearsim.studies.location import VALUES, locate, solve_locations

REPOSITORY = Path(__file__).parents[2]
SCENE = REPOSITORY / "workflows/seed_figure_2.toml"
REPORT = REPOSITORY / "reports/seed_figure_2.md"


@pytest.fixture(scope="module")
def cases():
    return locations_of(load_scene(SCENE))


@pytest.fixture(scope="module")
def found(cases):
    return solve_locations(cases)


def test_the_committed_report_is_what_the_command_writes(found, cases):
    """Positions to 1 um and 0.2 um printed; the flat tread amplifies rounding."""
    committed = pd.read_csv(REPORT.with_suffix(".csv"))
    table = values_table(found)
    assert list(table.columns) == list(committed.columns)
    assert (table["counterface"] == committed["counterface"]).all()
    np.testing.assert_allclose(table.iloc[:, 1:], committed.iloc[:, 1:], rtol=0.0, atol=1e-3)
    written = markdown(found, cases.remarks, "wearsim run workflows/seed_figure_2.toml", "seed_figure_2")
    assert written.splitlines()[:12] == REPORT.read_text().splitlines()[:12]
    assert REPORT.with_suffix(".svg").is_file()


def test_two_point_contact_comes_at_about_5_mm_and_earlier_on_the_roller(found):
    """The paper: about 5 mm on the rail, slightly different on the roller."""
    assert found["jump_curvature"].values.tolist() == [0.0, 1.0]
    rail, roller = 1e3 * found["jump_shift"].values
    assert rail == pytest.approx(5.36, abs=0.02)
    assert roller == pytest.approx(5.20, abs=0.02)
    assert (found["jump_before_x"] < 0.0).all()
    assert (found["jump_after_x"] > 20e-3).all()  # the flange, ahead of the axle
    assert (found["jump_after_contact_angle"] < -1.1).all()


def test_both_points_touch_at_the_jump(found, cases):
    """The wheelset's roll has none: on the climbing flange it changes by 7 rad per metre of shift."""
    for k in range(found.sizes["jump"]):
        at, curvature = float(found["jump_shift"][k]), float(found["jump_curvature"][k])
        sides = locate(cases, curvature, at + np.array([-1e-7, 1e-7]))
        assert abs(np.diff(sides["roll"])[0]) < 2e-6
        assert abs(np.diff(sides["wheel_y"])[0]) > 40e-3


def test_without_yaw_the_contact_lies_under_the_axle_alike_on_rail_and_roller(cases):
    still = replace(cases, yaw=0.0, shift=np.linspace(-5e-3, 5e-3, 11))
    table = solve_locations(still)
    assert not table["x"].values.any()
    for name in VALUES:
        np.testing.assert_allclose(table[name].values[0], table[name].values[1], rtol=0.0, atol=1e-12)


def test_the_tread_contact_lies_where_the_cone_and_the_curvature_put_it(cases):
    """First order in yaw: x = -yaw b / (1 + kappa r) - yaw r' r / (1 + kappa r), b to the track's middle."""
    little = replace(cases, yaw=1e-3, shift=np.array([0.0]), free_roll=False)
    for curvature in little.curvatures:
        table = locate(little, curvature, little.shift)
        radius, reach = table["wheel_radius"][0], 0.75 + table["wheel_y"][0]
        lag = 1e-3 * (reach + np.tan(table["contact_angle"][0]) * radius) / (1.0 + curvature * radius)
        assert table["x"][0] == pytest.approx(-lag, rel=1e-3)


def edited(tmp_path, old, new):
    text = SCENE.read_text()
    assert old in text
    path = tmp_path / "scene.toml"
    path.write_text(text.replace(old, new, 1))
    return path


def test_run_and_check_as_a_user_calls_them(tmp_path, capsys):
    scene = edited(tmp_path, "shift_step_mm = 0.1", "shift_step_mm = 1.0")
    assert main(["run", str(scene), "--out", str(tmp_path / "out")]) == 0
    assert capsys.readouterr().out == f"report: {tmp_path / 'out' / 'scene.md'}\n"
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"scene.md", "scene.svg", "scene.csv"}
    assert "| roller 1 m | 5.20 |" in (tmp_path / "out/scene.md").read_text()
    assert main(["check", str(scene)]) == 0
    assert "17 shifts on 2 counterfaces" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("shift_to_mm = 8.0", "shift_to_mm = -9.0", "shift_to_mm = -9 must be above shift_from_mm = -8"),
        ('"60E1"', '"61E1"', "'61E1' is neither a file nor a shipped rail profile"),
        ('roll = "free"', 'roll = "fixed"', "roll = "),
    ],
)
def test_faults_are_told_in_a_line(tmp_path, capsys, old, new, told):
    scene = edited(tmp_path, old, new)
    assert main(["run", str(scene), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert "Traceback" not in error
