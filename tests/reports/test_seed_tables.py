"""The tables of Liu & Bruni (2016): our values within stated limits of theirs, and
their conclusions.
"""

import re

import numpy as np
import pandas as pd
import pytest
import seed_tables
from seed_tables import CASES, TREND_SHIFTS, TRENDS, difference, ratios, trend

import wearsim


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The report as the script writes it."""
    out = tmp_path_factory.mktemp("reports") / "deep"
    seed_tables.main(["--out", str(out)])
    return out


@pytest.fixture(scope="module")
def ours(written):
    """Our values by rail and how creepages come about, cases in the order of the
    paper.
    """
    table = pd.read_csv(
        written / "seed_tables.csv", index_col=["model", "rail", "source"]
    ).sort_index()
    return table.loc["kik_piotrowski"]


@pytest.fixture(scope="module")
def half_space(written):
    """Values of the half-space on the first rail by how creepages come about."""
    table = pd.read_csv(
        written / "seed_tables.csv", index_col=["model", "rail", "source"]
    ).sort_index()
    return table.loc[("half_space", FIRST)]


@pytest.fixture(scope="module")
def trends():
    """Wheel totals on rail and rollers, without those between 1 m and 0.35 m."""
    return [trend(radius) for radius in (np.inf, 2.0, 1.5, 1.0, 0.35)]


PAPER = CASES.loc["paper"]
AT_3MM = slice(3, 6)  # rail, 1 m and 0.5 m roller: a single, nearly elliptic patch
FIRST = "60E1_benchmark"


@pytest.mark.slow
def test_the_script_writes_the_committed_report(written, reports, same_numbers):
    names = {
        "seed_tables.md",
        "seed_tables.csv",
        "seed_tables_patches.svg",
        "seed_tables_stress.svg",
    }
    assert {path.name for path in written.iterdir()} == names
    text = (reports / "seed_tables.md").read_text()
    assert all(f"({name})" in text for name in names if name.endswith(".svg"))
    same_numbers((written / "seed_tables.md").read_text(), text)
    committed, again = (
        pd.read_csv(folder / "seed_tables.csv") for folder in (reports, written)
    )
    pd.testing.assert_frame_equal(again, committed, rtol=1e-4, atol=1e-5)


def test_the_cases_are_those_of_the_paper():
    assert PAPER.shift_mm.tolist() == [0.0] * 3 + [3.0] * 3
    assert PAPER.roller_radius_mm.fillna(0.0).tolist() == [0.0, 1000.0, 500.0] * 2
    for source in ("contact", "contact_fine"):
        place = CASES.loc[source, ["shift_mm", "roller_radius_mm"]].to_numpy()
        np.testing.assert_array_equal(
            place, PAPER[["shift_mm", "roller_radius_mm"]].to_numpy()
        )


@pytest.mark.slow
def test_creepages_from_the_motion_are_those_of_table_2(ours):
    """5 % in longitudinal creepage and 3 % in spin: the paper's rail profile is not
    known exactly.
    """
    motion = ours.loc[(FIRST, "motion")][AT_3MM]
    np.testing.assert_allclose(motion.creepage_x, PAPER.creepage_x[AT_3MM], rtol=0.05)
    np.testing.assert_allclose(motion.spin_per_m, PAPER.spin_per_m[AT_3MM], rtol=0.03)


def test_there_is_no_lateral_creepage_without_yaw():
    shift = 1e-3 * PAPER.shift_mm.to_numpy()
    for radius in (np.inf, 1.0, 0.5):
        below = seed_tables.counterface(FIRST, radius)
        contact = wearsim.solve_contact(
            seed_tables.WHEELSET,
            below,
            seed_tables.conditions(shift),
            seed_tables.MODELS,
        )
        np.testing.assert_allclose(contact["creepage_y"], 0.0, atol=1e-15)


@pytest.mark.slow
@pytest.mark.parametrize("rail", seed_tables.RAILS)
@pytest.mark.parametrize("column", ["area_mm2", "max_pressure_MPa"])
def test_normal_contact_is_that_of_table_3(ours, column, rail):
    """5 % in all six cases, on both rails: the same model, implemented
    independently.
    """
    np.testing.assert_allclose(
        ours.loc[(rail, "centre"), column], PAPER[column], rtol=0.05
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("column", "limit"), [("force_x_kN", 0.05), ("force_y_kN", 0.10)]
)
def test_creep_forces_are_those_of_table_4(ours, column, limit):
    """At 3 mm; the paper's equivalent ellipse and slip definitions are not all
    given.
    """
    values = ours.loc[(FIRST, "centre"), column]
    np.testing.assert_allclose(values[AT_3MM], PAPER[column][AT_3MM], rtol=limit)


@pytest.mark.slow
def test_ratios_of_power_are_those_of_table_5(ours):
    """8 %: power depends on the definition of slip, its ratio much less."""
    values, theirs = (
        ratios(frame.to_numpy())
        for frame in (ours.loc[(FIRST, "centre"), "power_W"], PAPER.power_W)
    )
    assert np.isfinite(theirs).tolist() == [False, True, True] * 2
    np.testing.assert_allclose(values[4:], theirs[4:], rtol=0.08)


@pytest.mark.slow
def test_power_and_the_half_space_solution(ours, half_space):
    """Same creepages, centre and rail: FASTSIM within 6 % at 3 mm, which is what is
    left in partial slip.

    Too high, not by a third, where there are two lobes.
    """
    ratio = (
        ours.loc[(FIRST, "centre"), "power_W"].to_numpy()
        / half_space.loc["centre", "power_W"].to_numpy()
    )
    np.testing.assert_allclose(ratio[AT_3MM], 1.0, atol=0.06)
    assert np.all((ratio[:3] > 1.0) & (ratio[:3] < 1.3))


@pytest.mark.slow
def test_half_space_solutions_have_converged(written, half_space):
    """The finest cells change no pressure by 0.5 % and no power by 1 %, and are next to
    CONTACT's.

    On the rail, where CONTACT has converged, pressure to 0.5 %; area, which counts
    cells of 0.1 mm, to 1 %; power to 0.5 % at zero shift, to 4 % at 3 mm, where its
    creepages are held 0.1 to 0.2 mm elsewhere.
    """
    text = (written / "seed_tables.md").read_text()
    changes = re.search(
        r"pressure changes by more than ([\d.]+) %.* power by more\s+than ([\d.]+) %",
        text,
        re.S,
    )
    assert float(changes[1]) < 0.5
    assert float(changes[2]) < 1.0
    theirs, rail = (
        CASES.loc["contact_fine"],
        np.isnan(PAPER.roller_radius_mm.to_numpy()),
    )
    ratio = {
        name: half_space.loc["centre", name].to_numpy() / theirs[name].to_numpy()
        for name in ("max_pressure_MPa", "area_mm2", "power_W")
    }
    np.testing.assert_allclose(ratio["max_pressure_MPa"][rail], 1.0, atol=0.005)
    np.testing.assert_allclose(ratio["area_mm2"], 1.0, atol=0.01)
    np.testing.assert_allclose(ratio["power_W"][:3], 1.0, atol=0.005)
    np.testing.assert_allclose(ratio["power_W"][AT_3MM], 1.0, atol=0.04)


@pytest.mark.slow
def test_the_flat_contact_and_its_creepage_reference_point(ours, half_space):
    """At zero shift: initial contact millimetres off the centre, angle at the centre
    within 3 % of theirs.

    Creepage prescribed at the initial contact makes forces of kN of creepages called
    zero, as in the paper (whose sign is the other). Micrometres of profile move that
    point: sizes are tested, not values.
    """
    centre, touch = (
        ours.loc[(FIRST, source)][:3] for source in ("centre", "initial_contact")
    )
    assert np.all((centre.initial_contact_mm > 1.0) & (centre.initial_contact_mm < 5.0))
    np.testing.assert_allclose(
        np.abs(ours.loc[(FIRST, "motion"), "contact_angle_mrad"][:3]), 34.5, rtol=0.03
    )
    force = touch.force_x_kN.to_numpy()
    for other in (half_space.loc["initial_contact"], PAPER):
        size = np.abs(force / other.force_x_kN[:3].to_numpy())
        assert np.all((size > 0.5) & (size < 1.5))
    assert np.all(np.abs(centre.force_x_kN.to_numpy()) < 0.2 * np.abs(force))


@pytest.mark.slow
def test_the_paper_is_far_from_the_half_space_solution_where_the_contact_is_flat(
    ours, half_space
):
    """A third in pressure, which is the model's and not the paper's fault: ours is
    equally far.

    Elsewhere a tenth, as the report says.
    """
    reference = half_space.loc["centre", "max_pressure_MPa"].to_numpy()
    for values in (
        PAPER.max_pressure_MPa,
        ours.loc[(FIRST, "centre"), "max_pressure_MPa"],
    ):
        apart = values.to_numpy() / reference - 1.0
        np.testing.assert_allclose(apart[:3], -1.0 / 3.0, atol=0.02)
        assert np.all((apart[AT_3MM] < -0.05) & (apart[AT_3MM] > -0.1))


def test_trends_over_the_curvature_of_the_roller(trends, reports):
    """Area and length fall; pressure, width, slip share and power rise; except where
    two patches merge.
    """
    assert set(TRENDS) == {
        "area",
        "max_pressure",
        "length",
        "width",
        "slip_share",
        "power",
    }
    assert "468 steps, 1 of them exceptions" in (reports / "seed_tables.md").read_text()
    merged = [
        (1e3 * TREND_SHIFTS[i], j)
        for j in range(1, len(trends))
        for i in np.flatnonzero(trends[j].patches < trends[j - 1].patches)
    ]
    assert merged == [(5.0, 1)]  # from the rail to the roller of 2 m
    exceptions = [
        (name, 1e3 * TREND_SHIFTS[i], j)
        for name, (_, sign, _) in TRENDS.items()
        for j in range(1, len(trends))
        for i in np.flatnonzero(sign * (trends[j][name] - trends[j - 1][name]) <= 0.0)
    ]
    assert exceptions == [("slip_share", *merged[0])]  # two flexibilities become one


def test_width_rises_slightly(trends):
    """By less than 15 % where pressure rises by 30 %, one patch."""
    single = np.all([total.patches == 1 for total in trends], axis=0)
    rail, roller = trends[0][single], trends[-1][single]
    assert np.all(roller.width / rail.width < 1.15)
    assert np.all(roller.max_pressure / rail.max_pressure > 1.25)


def test_differences_need_something_to_differ_from():
    values = difference(
        np.array([1.1, 1.0, np.nan, -1.0]), np.array([1.0, 0.0, 1.0, 2.0])
    )
    assert values == ["+10.0 %", "-", "-", "other sign"]


def test_the_guide_quotes_the_report(reports):
    """Every number of its short table stands in the report."""
    rows = [
        line
        for line in (reports.parent / "workflows" / "README.md")
        .read_text()
        .splitlines()
        if " mm, r" in line
    ]
    assert len(rows) == 6
    cells = [
        cell.strip().removesuffix(" %")
        for line in (reports / "seed_tables.md").read_text().splitlines()
        for cell in line.split("|")
    ]
    printed = {
        float(cell) for cell in cells if cell.replace(".", "").lstrip("+-").isdigit()
    }
    for row in rows:
        quoted = [
            number
            for cell in row.split("|")[2:]
            for number in cell.split("·")
            if number.strip()
        ]
        assert len(quoted) in (9, 12)
        for number in quoted:
            assert float(number) in printed, number
