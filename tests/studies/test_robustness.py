"""Where contact models fail: the committed report, what counts as unsound, wear steps, the command."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from wearsim.cli import main
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.reference import hertz
from wearsim.contact.solve import solve
from wearsim.report.robustness import decision_table, markdown, values_table
from wearsim.scene import load_scene
from wearsim.studies import robustness
from wearsim.studies.accuracy import ERRORS
from wearsim.studies.robustness import (
    COMBINATIONS,
    CRASHED,
    DEGRADED,
    REFUSED,
    RIGHT,
    UNSOUND,
    WRONG,
    Limits,
    answer,
    assess,
    outcome_of,
    unsound,
)
from wearsim.studies.situations import SITUATIONS, over_rail, parabola, tread
from wearsim.studies.step_limits import step_limits

REPOSITORY = Path(__file__).parents[2]
SCENE = REPOSITORY / "workflows/where_methods_fail.toml"
REPORT = REPOSITORY / "reports/where_methods_fail.md"

SAMPLE = [
    "shift 3 mm",
    "shift 0",
    "shift 5 mm, yaw 3 mrad, roller 1 m",
    "shift 6.5 mm",
    "flat on flat",
    "1 um, smoothed over 3 mm",
    "10 kN",
    "1 1/m",
    "5 strips, 5 cells",
    "radius 20 mm",
    "100 mrad",
]


@pytest.fixture(scope="module")
def committed():
    return pd.read_csv(REPORT.with_suffix(".csv"), keep_default_na=False, na_values={
        f"error_{name}": [""] for name in ERRORS
    })  # fmt: skip


@pytest.fixture(scope="module")
def scene():
    return load_scene(SCENE)


def test_sampled_rows_of_the_committed_report(committed, scene):
    """Outcomes are the same; errors to 1 % of the reference: rounding moves the cells of half-spaces."""
    chosen = [situation for situation in SITUATIONS if situation.title in SAMPLE]
    assert len(chosen) == len(SAMPLE)
    found = values_table(assess(scene.grids.models, scene.grids.reference, Limits(), chosen))
    old = committed.set_index(["situation", "model"]).loc[
        list(zip(found["situation"], found["model"], strict=True))
    ]
    errors = [f"error_{name}" for name in ERRORS]
    np.testing.assert_allclose(found[errors], old[errors], rtol=0.0, atol=0.01)
    near = np.abs(np.abs(found[errors].to_numpy()).max(axis=1) - Limits().right) < 0.01
    same = found["outcome"].to_numpy() == old["outcome"].to_numpy()
    assert (same | near).all()
    assert list(found["told"]) == list(old["told"])


def test_the_committed_report_has_every_situation_and_model_and_its_own_decisions(committed, scene):
    assert len(committed) == len(SITUATIONS) * len(COMBINATIONS)
    assert list(committed["situation"][:: len(COMBINATIONS)]) == [s.title for s in SITUATIONS]
    assert list(committed["kind"][:: len(COMBINATIONS)]) == [s.kind for s in SITUATIONS]
    assert not committed["outcome"].isin([UNSOUND, CRASHED]).any()
    text = REPORT.read_text(encoding="utf-8")
    assert text.startswith(f"# {scene.scene.title}\n\n## Which model for which scene\n")
    shape = (len(SITUATIONS), len(COMBINATIONS))
    kept = xr.Dataset(
        {
            name: (("situation", "model"), committed[name].to_numpy().reshape(shape))
            for name in ("outcome", "told", *(f"error_{error}" for error in ERRORS))
        },
        coords={
            "kind": ("situation", [s.kind for s in SITUATIONS]),
            "model": [f"{normal} + {tangential}" for normal, tangential in COMBINATIONS],
            "leads": ("model", [normal != "hertz" for normal, _ in COMBINATIONS]),
        },
        attrs={"right": 0.01 * scene.limits.right_percent},
    )
    assert decision_table(kept) in text


def test_the_reference_is_the_closed_form_where_there_is_one():
    """Hertz's ellipse to 2 %: what 50 cells cost; full slip carries friction times load to 1e-6."""
    case = over_rail(lambda y: parabola(y, 0.0, 0.3))
    found = answer(case, "half_space", "half_space", 50).wheel
    radius = 0.46 + float(np.interp(0.0, case.wheel.y, case.wheel.z))
    ellipse = hertz(0.5 / radius, 0.5 / 0.3, 80e3, 210e9 / (2.0 * (1.0 - 0.3**2)))
    assert found.area == pytest.approx(np.pi * ellipse.semi_axis_x * ellipse.semi_axis_y, rel=0.02)
    assert found.max_pressure == pytest.approx(ellipse.max_pressure, rel=0.02)
    for creepage in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)):
        slid = tread(creepage=creepage)
        solution = solve(
            slid.conditions, slid.wheelset, slid.counterface,
            slid.models("half_space", "half_space", 30), sides=(0,),
        )  # fmt: skip
        assert np.hypot(solution.force_x, solution.force_y) == pytest.approx(
            0.35 * solution.normal_force, rel=1e-6
        )


@pytest.fixture(scope="module")
def sound():
    case = tread()
    models = case.models("kik_piotrowski", "fastsim", 20)
    return case, solve(case.conditions, case.wheelset, case.counterface, models, sides=(0,))


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda s: {"area": s.area * np.nan}, "not finite"),
        (lambda s: {"normal_force": 1.001 * s.normal_force}, "carries"),
        (lambda s: {"area": 0.0 * s.area}, "not positive"),
        (lambda s: {"fields": replace(s.fields, pressure=-s.fields.pressure)}, "not positive"),
        (lambda s: {"force_x": 3.0 * s.force_x}, "above friction"),
        (lambda s: {"force_x": -s.force_x, "force_y": -s.force_y, "spin_moment": -s.spin_moment}, "gains"),
        (lambda s: {"power": 1.01 * s.power}, "does not add up"),
    ],
)
def test_every_law_is_looked_at(sound, change, told):
    case, solution = sound
    assert unsound(solution, case) == []
    faults = unsound(replace(solution, **change(solution)), case)
    assert len(faults) >= 1
    assert any(told in fault for fault in faults)


def test_whatever_happens_is_an_outcome(monkeypatch):
    def broken(*_, **__):
        raise ZeroDivisionError("float division")

    monkeypatch.setattr(robustness, "solve", broken)
    found = answer(tread(), "hertz", "fastsim", 20)
    assert (found.outcome, found.told, found.wheel) == (CRASHED, "ZeroDivisionError: float division", None)


def test_borders_between_outcomes():
    limits = Limits(right=0.1, wrong=1.0)
    for error, outcome in ((0.1, RIGHT), (-0.1, RIGHT), (0.11, DEGRADED), (-1.0, DEGRADED), (1.01, WRONG)):
        assert outcome_of({"area": 0.0, "power": error}, limits) == outcome


def test_a_refusal_has_the_number_of_its_message():
    flat = [s for s in SITUATIONS if s.title == "flat on flat"]
    found = assess(10, 10, Limits(), flat, [("hertz", "fastsim"), ("kik_piotrowski", "fastsim")])
    assert (found["outcome"].values == REFUSED).all()
    text = markdown(found, step_limits(["hertz"], 20), ("Title", ""), "command", "values.csv")
    assert "| flat on flat | refused (1) | refused (1) |" in text
    assert "1. the contact patch reaches the edge of a profile" in text
    assert "| no or negative curvature | none: all refuse |" in text


def test_steps_within_the_limit_let_no_leading_model_grow_a_wave():
    """1 %: knothe_le_the does not see the wave of two points; hertz, which never leads, lets one grow."""
    steps = step_limits()
    assert list(steps["normal"].values) == sorted(NORMAL_MODELS)
    left = steps["left"].values[:, :, 0]
    assert (left[steps["leads"].values] < 1.01).all()
    assert left[list(steps["normal"].values).index("hertz")].max() > 1.01
    by_name = dict(zip(steps["normal"].values, steps["left"].values, strict=True))
    for name in ("kik_piotrowski", "half_space"):  # both waves wear off, and the longer one grows far beyond
        assert (by_name[name][:, 0] < 0.9).all()
        assert by_name[name][1, -1] > 2.0


def test_run_and_check_as_a_user_calls_them(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(robustness.assess, "__defaults__", (SITUATIONS[:2], COMBINATIONS[:2]))
    scene = tmp_path / "fail.toml"
    scene.write_text(SCENE.read_text().replace("models = 50", "models = 10").replace("= 80", "= 12"))
    assert main(["run", str(scene), "--out", str(tmp_path / "out")]) == 0
    assert capsys.readouterr().out == f"report: {tmp_path / 'out' / 'fail.md'}\n"
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"fail.md", "fail.csv"}
    assert len(pd.read_csv(tmp_path / "out/fail.csv")) == 4
    assert main(["check", str(scene)]) == 0
    told = capsys.readouterr().out
    assert f"{len(SITUATIONS)} situations, {len(COMBINATIONS)} combinations of models" in told


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("models = 50", "models = 5", "models = 5 must be"),
        ("right_percent = 10", "right_percent = 0", "right_percent = 0 must be"),
        ("seconds = 20", "second = 20", "did you mean seconds?"),
    ],
)
def test_faults_are_told_in_a_line(tmp_path, capsys, old, new, told):
    text = SCENE.read_text()
    assert old in text
    scene = tmp_path / "fail.toml"
    scene.write_text(text.replace(old, new, 1))
    assert main(["check", str(scene)]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert "Traceback" not in error
