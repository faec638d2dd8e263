"""The tables of Liu & Bruni (2016): our values within stated limits of theirs, and their conclusions."""

from pathlib import Path

import numpy as np
import pytest

from wearsim.report.published import difference, markdown, ratios_to_rail
from wearsim.scene import load_scene
from wearsim.scene.published import published_cases
from wearsim.studies.published import TRENDS, solve_published, trend_exceptions

REPOSITORY = Path(__file__).parents[2]
SCENE = REPOSITORY / "workflows/seed_tables.toml"
REPORT = REPOSITORY / "reports/seed_tables.md"


@pytest.fixture(scope="module")
def tables():
    return solve_published(published_cases(load_scene(SCENE)))


@pytest.fixture(scope="module")
def at_3mm(tables):
    """Rail, 1 m and 0.5 m roller: a single, nearly elliptic patch."""
    return tables.isel(case=np.flatnonzero(tables["shift"].values == 3e-3), profile=0)


def test_the_workflow_holds_the_cases_of_the_paper(tables):
    assert tables["shift"].values.tolist() == [0.0] * 3 + [3e-3] * 3
    assert tables["counterface_curvature"].values.tolist() == [0.0, 1.0, 2.0] * 2
    assert tables["profile"].values.tolist() == ["60E1_benchmark", "60E1"]


def test_creepages_from_the_motion_are_those_of_table_2(at_3mm):
    """5 % in longitudinal creepage and 3 % in spin: the paper's rail profile is not known exactly."""
    told = at_3mm["prescribed_creepage"].values
    np.testing.assert_allclose(at_3mm["motion_creepage_x"], told[:, 0], rtol=0.05)
    np.testing.assert_allclose(at_3mm["motion_creepage_y"], told[:, 1], atol=1e-15)
    np.testing.assert_allclose(at_3mm["motion_spin"], told[:, 2], rtol=0.03)


@pytest.mark.parametrize("profile", [0, 1])
@pytest.mark.parametrize("name", ["area", "max_pressure"])
def test_normal_contact_is_that_of_table_3(tables, name, profile):
    """5 % in all six cases, on both rails: the same model, implemented independently."""
    ours = tables[name].sel(about="centre").isel(profile=profile)
    np.testing.assert_allclose(ours, tables[f"published_{name}"], rtol=0.05)


@pytest.mark.parametrize(("name", "limit"), [("force_x", 0.05), ("force_y", 0.10)])
def test_creep_forces_are_those_of_table_4(at_3mm, name, limit):
    """At 3 mm; the paper's equivalent ellipse and slip definitions are not all told."""
    np.testing.assert_allclose(at_3mm[name].sel(about="centre"), at_3mm[f"published_{name}"], rtol=limit)


def test_ratios_of_power_are_those_of_table_5(at_3mm):
    """8 %: power depends on the definition of slip, its ratio much less."""
    ours = ratios_to_rail(at_3mm, at_3mm["power"].sel(about="centre").values)
    told = ratios_to_rail(at_3mm, at_3mm["published_power"].values)
    assert np.isfinite(told).tolist() == [False, True, True]
    np.testing.assert_allclose(ours[1:], told[1:], rtol=0.08)


def test_power_beside_the_half_space_solution(tables):
    """Same creepages and rail: within 3 % at 3 mm; too high, not by a third, where there are two lobes."""
    ratio = tables["power"].sel(about="centre").values[0] / tables["half_space_centre_power"].values
    np.testing.assert_allclose(ratio[3:], 1.0, atol=0.03)
    assert np.all((ratio[:3] > 1.0) & (ratio[:3] < 1.3))


def test_the_flat_contact_is_held_at_its_centre(tables):
    """At zero shift: touching point millimetres off the centre, angle at the centre within 3 % of theirs.

    Holding creepage at the touching point makes forces of kN of creepages called zero, as in the paper
    (whose sign is the other). Micrometres of profile move that point: sizes are tested, not values.
    """
    flat = tables.isel(case=slice(0, 3), profile=0)
    assert np.all((flat["touch_offset"] > 1e-3) & (flat["touch_offset"] < 5e-3))
    np.testing.assert_allclose(np.abs(flat["motion_contact_angle"]), 0.0345, rtol=0.03)
    touch = flat["force_x"].sel(about="touch").values
    for other in ("half_space_touch_force_x", "published_force_x"):
        size = np.abs(touch / flat[other].values)
        assert np.all((size > 0.5) & (size < 1.5)), other
    assert np.all(np.abs(flat["force_x"].sel(about="centre")) < 0.2 * np.abs(touch))


def test_the_paper_is_far_from_the_half_space_solution_where_the_contact_is_flat(tables):
    """A third in pressure, which is the model's and not the paper's fault: ours is equally far."""
    reference = tables["half_space_centre_max_pressure"].values
    for values in (
        tables["published_max_pressure"].values,
        tables["max_pressure"].sel(about="centre").values[0],
    ):
        np.testing.assert_allclose(values[:3] / reference[:3] - 1.0, -1.0 / 3.0, atol=0.1)


def test_trends_over_the_curvature_of_the_roller(tables):
    """Area and length fall; pressure, width, slip share and power rise; except where two patches merge."""
    assert tables.sizes["trend_shift"] * (tables.sizes["trend_curvature"] - 1) == 78
    merged = np.diff(tables["trend_patches"].values, axis=1) < 0
    assert [
        (float(tables["trend_shift"][i]), float(1.0 / tables["trend_curvature"][j + 1]))
        for i, j in np.argwhere(merged)
    ] == [(5e-3, 2.0)]
    exceptions = trend_exceptions(tables)
    assert {(i, j) for _, i, j in exceptions} == {(i, j + 1) for i, j in np.argwhere(merged)}
    assert [name for name, _, _ in exceptions] == ["slip_share"]  # two flexibilities become one


def test_width_rises_slightly(tables):
    """By less than 15 % where pressure rises by 30 %, one patch."""
    single = np.all(tables["trend_patches"].values == 1, axis=1)
    width, pressure = (tables[f"trend_{name}"].values[single] for name in ("width", "max_pressure"))
    assert np.all(width[:, -1] / width[:, 0] < 1.15)
    assert np.all(pressure[:, -1] / pressure[:, 0] > 1.25)
    assert set(TRENDS) == {"area", "max_pressure", "length", "width", "slip_share", "power"}


def test_differences_need_something_to_differ_from():
    values = difference(np.array([1.1, 1.0, np.nan, -1.0]), np.array([1.0, 0.0, 1.0, 2.0]))
    assert values == ["+10.0 %", "-", "-", "other sign"]


def numbers(text):
    """Cells of all tables: words as they are, numbers apart."""
    cells = [cell.strip() for line in text.splitlines() if line.startswith("|") for cell in line.split("|")]
    return [cell.removesuffix(" %") for cell in cells]


def test_the_committed_report_is_what_the_command_writes(tables):
    """Text exactly; numbers to one unit of the last printed digit, since machines may round differently."""
    written, committed = markdown(tables, "wearsim run workflows/seed_tables.toml"), REPORT.read_text()
    plain = [
        [line for line in text.splitlines() if not line.startswith(("|", "!", "*"))]
        for text in (written, committed)
    ]
    assert [line for line in plain[0] if line] == [line for line in plain[1] if line]
    ours, theirs = numbers(written), numbers(committed)
    assert len(ours) == len(theirs) > 400
    for one, other in zip(ours, theirs, strict=True):
        if one != other:
            digits = len(other.partition(".")[2])
            assert abs(float(one) - float(other)) < 1.5 * 10.0**-digits, (one, other)


def test_the_readme_quotes_the_report():
    """Every number of its short table stands in the report."""
    rows = [line for line in (REPOSITORY / "README.md").read_text().splitlines() if " mm, r" in line]
    assert len(rows) == 6
    printed = {
        float(cell) for cell in numbers(REPORT.read_text()) if cell.replace(".", "").lstrip("+-").isdigit()
    }
    for row in rows:
        quoted = [number for cell in row.split("|")[2:] for number in cell.split("·") if number.strip()]
        assert len(quoted) in (9, 12)
        for number in quoted:
            assert float(number) in printed, number
