"""Where contact models fail: the committed report, rows of it computed again, what
counts as unsound.
"""

import numpy as np
import pytest
import wear_step_stability
import where_methods_fail
from closed_forms import hertz
from where_methods_fail import (
    CRASHED,
    DEGRADED,
    ERRORS,
    MODELS,
    NOT_APPLICABLE,
    RIGHT,
    RIGHT_WITHIN,
    SITUATIONS,
    UNSOUND,
    WRONG,
    assess,
    outcome_of,
    problem_of,
    read_table,
    solve,
    violated_laws,
)

import wearsim

TABLES = ("where_methods_fail.csv", "where_methods_fail_steps.csv")
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
    "wheel ends 1 mm beyond the middle of the patch",
    "radius 20 mm",
    "100 mrad",
]


def named(title):
    (situation,) = (row for row in SITUATIONS if row["situation"] == title)
    return situation


@pytest.fixture(scope="module")
def committed(reports):
    return read_table(reports / TABLES[0])


@pytest.mark.slow
def test_sampled_rows_of_the_report(committed):
    """Outcomes are the same; errors to 1 % of the reference: rounding moves the cells
    of half-spaces.
    """
    table = assess([named(title) for title in SAMPLE])
    rows = committed.set_index(["situation", "model"]).loc[
        list(zip(table["situation"], table["model"], strict=True))
    ]
    errors = [f"error_{name}" for name in ERRORS]
    np.testing.assert_allclose(table[errors], rows[errors], rtol=0.0, atol=0.01)
    near = np.abs(np.abs(table[errors].to_numpy()).max(axis=1) - RIGHT_WITHIN) < 0.01
    assert ((table["outcome"].to_numpy() == rows["outcome"].to_numpy()) | near).all()
    assert list(table["message"]) == list(rows["message"])


def test_the_report_holds_every_situation_and_is_what_its_tables_say(
    committed, reports, tmp_path
):
    assert list(committed["situation"][:: len(MODELS)]) == [
        row["situation"] for row in SITUATIONS
    ]
    assert list(committed["kind"][:: len(MODELS)]) == [
        row["kind"] for row in SITUATIONS
    ]
    assert list(committed["model"]) == list(MODELS) * len(SITUATIONS)
    assert not committed["outcome"].isin([UNSOUND, CRASHED]).any()
    for name in TABLES:
        (tmp_path / name).write_bytes((reports / name).read_bytes())
    where_methods_fail.main(["--from-csv", "--out", str(tmp_path)])
    written, text = (
        (folder / "where_methods_fail.md").read_text() for folder in (tmp_path, reports)
    )
    assert written == text
    assert "| flat on flat |" + " n/a (2) |" * len(MODELS) in text
    assert "2. the contact patch reaches the edge of a profile" in text


@pytest.mark.parametrize(
    "normal", ["kik_piotrowski", pytest.param("half_space", marks=pytest.mark.slow)]
)
def test_wear_steps_of_the_report(reports, normal):
    """To 1 %: long steps multiply the last digits of the contact solutions."""
    steps = read_table(reports / TABLES[1])
    rows = steps[steps["normal"] == normal].reset_index(drop=True)
    again = wear_step_stability.wave_after_one_step(normal)
    assert again[["limit", "message"]].equals(rows[["limit", "message"]])
    for name in ("depth", "wavelength", "factor", "left"):
        np.testing.assert_allclose(again[name], rows[name], rtol=0.01, err_msg=name)


def test_steps_within_the_limit_let_no_wave_grow_under_a_model_that_updates_the_profile(
    reports,
):
    """1 %: coupled_strips leave the wave of two points; hertz, which never updates,
    lets one grow.
    """
    steps = read_table(reports / TABLES[1])
    assert set(steps["normal"]) == {normal for normal, _ in MODELS.values()}
    left = steps.pivot_table(
        index=["normal", "wavelength"], columns="factor", values="left"
    )
    assert (left.drop("hertz")[1.0] < 1.01).all()
    assert left.loc["hertz"][1.0].max() > 1.01
    for name in (
        "kik_piotrowski",
        "half_space",
    ):  # both waves wear off, and the longer one grows far beyond
        assert (left.loc[name][1.0] < 0.9).all()
        assert left.loc[name][10.0].iloc[1] > 2.0


def test_the_reference_is_the_closed_form_where_there_is_one():
    """Hertz's ellipse to 2 %: what 50 cells cost; full slip carries friction times load
    to 1e-6.
    """
    situation = named("ellipse: relative radius 0.3 m")
    sums = solve(situation, "half_space", "half_space", 50).sums
    wheel = problem_of(situation)[0].right
    radius = 0.46 + float(np.interp(0.0, wheel.y, wheel.z))
    ellipse = hertz(0.5 / radius, 0.5 / 0.3, 80e3, 210e9 / (2.0 * (1.0 - 0.3**2)))
    assert sums.area == pytest.approx(
        np.pi * ellipse.semi_axis_x * ellipse.semi_axis_y, rel=0.02
    )
    assert sums.max_pressure == pytest.approx(ellipse.max_pressure, rel=0.02)
    for slid in ("1 along", "1 across"):
        models = wearsim.ContactModels("half_space", "half_space", 30, 30)
        contact = wearsim.solve_contact(
            *problem_of(named(slid)), models, sides=("right",)
        )
        force = np.hypot(contact["force_x"], contact["force_y"])
        np.testing.assert_allclose(force, 0.35 * contact["normal_force"], rtol=1e-6)


@pytest.fixture(scope="module")
def sound():
    wheelset, counterface, conditions = problem_of(named("shift 3 mm"))
    models = wearsim.ContactModels("kik_piotrowski", "fastsim", 20, 20)
    contact = wearsim.solve_contact(
        wheelset, counterface, conditions, models, sides="right", fields=True
    )
    return contact, conditions


@pytest.mark.parametrize(
    ("names", "factor", "law"),
    [
        (["area"], np.nan, "not finite"),
        (["track_vertical"], 1.001, "carries"),
        (["area"], 0.0, "not positive"),
        (["pressure"], -1.0, "not positive"),
        (["force_x"], 3.0, "above friction"),
        (["force_x", "force_y", "spin_moment"], -1.0, "gains"),
        (["power"], 1.01, "does not add up"),
    ],
)
def test_every_law_is_checked(sound, names, factor, law):
    contact, conditions = sound
    assert violated_laws(contact, conditions) == []
    broken = contact.assign({name: factor * contact[name] for name in names})
    assert any(law in violated for violated in violated_laws(broken, conditions))


def test_whatever_happens_is_an_outcome(monkeypatch):
    def broken(*_, **__):
        raise ZeroDivisionError("float division")

    monkeypatch.setattr(wearsim, "solve_contact", broken)
    solution = solve(named("shift 3 mm"), "hertz", "fastsim", 20)
    assert (solution.outcome, solution.sums) == (CRASHED, None)
    assert solution.message == "ZeroDivisionError: float division"


def test_borders_between_outcomes():
    for error, outcome in (
        (0.1, RIGHT),
        (-0.1, RIGHT),
        (0.11, DEGRADED),
        (-1.0, DEGRADED),
        (1.01, WRONG),
    ):
        assert outcome_of({"area": 0.0, "power": error}) == outcome


def test_a_kind_without_an_applicable_model_has_no_choice():
    table = assess(
        [named("flat on flat")], {"hertz + fastsim": ("hertz", "fastsim")}, 10, 10
    )
    assert list(table["outcome"]) == [NOT_APPLICABLE]
    ((kind, *choices),) = where_methods_fail.decision_table(table).rows
    assert kind == "no or negative curvature"
    assert set(choices) == {"none: no model is applicable"}
