import numpy as np
import pytest

from wearsim.damage.coefficients import COEFFICIENT_SETS
from wearsim.damage.wear import WEAR_LAWS, WearSettings, coefficient_set, passage_depth
from wearsim.damage.wear.table import rate_at
from wearsim.damage.wear.table_file import read_wear_table, wear_table
from wearsim.errors import SceneError

STATED = {"source": "twin disc", "certainty": "measured", "interpolation": "linear", "beyond": "hold"}
KTH = """\
# Regions of the wear map over sliding speed and pressure, as rows of a grid.
# source = map of jendel_2002, written as a table
# certainty = uncertain
# interpolation = step
# beyond = hold
# hardness_GPa = 3.0
slip_speed_m_s, pressure_MPa, wear_coefficient
0.0, 0, 5e-4
0.2, 0, 35e-4
0.7, 0, 5e-4
0.7, 2400, 350e-4
0.2, 2400, 350e-4
0.0, 2400, 350e-4
"""


def made(**columns):
    table, faults = wear_table({**STATED, **columns}, "mine")
    assert not faults
    return table


@pytest.mark.parametrize("form", ["local", "patch_mean"])
@pytest.mark.parametrize("peak", [0.02e6, 0.3e6, 5e6])
def test_map_of_a_paper_written_as_a_table_is_the_law(tmp_path, form, peak, patches):
    """Archard's law with the KTH map, 1e-12, in a CSV file with its rows in any order."""
    path = tmp_path / "kth.csv"
    path.write_text(KTH)
    table = read_wear_table(path)
    fields, area = patches(peak)
    fields.pressure[0, :, :5] = 2.5e9
    law = WEAR_LAWS["archard"](fields, area, COEFFICIENT_SETS["jendel_2002"], form=form)
    depth = WEAR_LAWS["table"](fields, area, table, form=form)
    np.testing.assert_allclose(depth[1], law.sum(axis=0), rtol=1e-12)
    assert not depth[[0, 2]].any()  # a step table holds by intention


@pytest.mark.parametrize("form", ["local", "patch_mean"])
def test_sheffields_law_as_a_table(tmp_path, form, patches):
    """Three straight branches, the last one going on; 0.2 % is the printed jump at 10.4 N/mm2."""
    path = tmp_path / "usfd.toml"
    path.write_text(
        'source = "lewis_dwyer_joyce_2004"\ncertainty = "confirmed"\n'
        'interpolation = "linear"\nbeyond = "slope"\n'
        "T_gamma_A_N_mm2 = [0, 10.4, 77.2,\n  177.2]\nmass_rate_ug_m_mm2 = [0, 55, 55, 6245]\n"
    )
    table = read_wear_table(path)
    assert table.name == "usfd"
    fields, area = patches(250e6)
    law = WEAR_LAWS["usfd"](fields, area, COEFFICIENT_SETS["lewis_dwyer_joyce_2004"], form=form)
    depth = WEAR_LAWS["table"](fields, area, table, form=form)
    np.testing.assert_allclose(depth.sum(axis=0), law.sum(axis=0), rtol=0.0022)
    assert depth[2].any() == (form == "local")  # cells beyond 177.2 N/mm2, no mean


def test_two_level_law_as_a_table(patches):
    table = made(
        interpolation="step",
        power_density_W_mm2=[0, 4],
        energy_coefficient_mm3_kJ=[7e-10 / 7850 * 1e12, 21e-10 / 7850 * 1e12],
    )
    fields, area = patches(2e6)
    law = WEAR_LAWS["energy"](fields, area, COEFFICIENT_SETS["zobory_1997"])
    np.testing.assert_allclose(WEAR_LAWS["table"](fields, area, table)[1], law.sum(axis=0), rtol=1e-12)
    assert law[1].any()


@pytest.mark.parametrize(
    ("interpolation", "beyond", "below", "expected"),
    [
        ("linear", "hold", "hold", [10.0, 10.0, 15.0, 20.0, 20.0]),
        ("linear", "slope", "proportional", [5.0, 10.0, 15.0, 20.0, 30.0]),
        ("linear", "hold", "zero", [0.0, 10.0, 15.0, 20.0, 20.0]),
        ("step", "hold", "hold", [10.0, 10.0, 10.0, 20.0, 20.0]),
        ("step", "hold", "proportional", [5.0, 10.0, 10.0, 20.0, 20.0]),
        ("step", "hold", "zero", [0.0, 10.0, 10.0, 20.0, 20.0]),
    ],
)
def test_interpolation_as_stated(interpolation, beyond, below, expected):
    table = made(
        interpolation=interpolation,
        beyond=beyond,
        below=below,
        T_gamma_A_N_mm2=[1, 2],
        mass_rate_ug_m_mm2=[10, 20],
    )
    found = rate_at((np.array([0.5, 1.0, 1.5, 2.0, 3.0]) * 1e6,), table)
    np.testing.assert_allclose(found / 1e-3, expected, rtol=1e-12)
    assert table.validity.endswith(f"below the first {below}.")
    assert f"below the first {below}" in table.numbers


@pytest.mark.parametrize("form", ["local", "patch_mean"])
def test_wear_below_the_first_row_is_a_regime_of_its_own(form, patches):
    """One row above all indices: "proportional" is the line from the origin to it, 1e-12, "hold" its rate."""
    fields, area = patches(0.3e6)
    row = {"T_gamma_A_N_mm2": [10.0], "mass_rate_ug_m_mm2": [50.0]}
    line = made(T_gamma_A_N_mm2=[0.0, 10.0], mass_rate_ug_m_mm2=[0.0, 50.0])
    depth = {
        below: WEAR_LAWS["table"](fields, area, made(below=below, **row), form=form)
        for below in ("proportional", "hold", "zero")
    }
    for found in depth.values():
        assert not found[1:].any()
    expected = WEAR_LAWS["table"](fields, area, line, form=form)
    assert expected[1].any()
    np.testing.assert_allclose(depth["proportional"][0], expected[1], rtol=1e-12)
    assert depth["hold"][0].sum() > 5.0 * depth["proportional"][0].sum()
    assert not depth["zero"].any()


def test_a_map_that_starts_above_zero_is_in_proportion_to_what_is_below():
    v, p = np.meshgrid([0.5, 2.0], [800.0, 1000.0], indexing="ij")
    keys = {"hardness_GPa": 3, "slip_speed_m_s": v.ravel().tolist(), "pressure_MPa": p.ravel().tolist()}
    table = made(below="proportional", wear_coefficient=[1e-4, 2e-4, 3e-4, 4e-4], **keys)
    found = rate_at((np.array([0.25, 0.25, 2.0]), np.array([1000e6, 400e6, 200e6])), table)
    np.testing.assert_allclose(found, [1e-4, 0.25e-4, 0.75e-4], rtol=1e-12)


def test_what_holds_below_the_first_row_is_asked_for(tmp_path):
    """At the line of that row, with the way out; where nothing is below it, the key is refused."""
    path = tmp_path / "own.csv"
    text = KTH.replace("\n0.0, 0,", "\n0.1, 0,").replace("\n0.0, 2400,", "\n0.1, 2400,")
    path.write_text(text)
    (told,) = faults_of(path)
    assert told.startswith(":8: slip_speed_m_s = 0.1 is the first row, and nothing says what holds below it")
    assert 'write below = "proportional"' in told
    path.write_text(text.replace("# beyond", "# below = none\n# beyond"))
    (told,) = faults_of(path)
    assert told.startswith(':5: below = \'none\' must be "proportional" or "hold" or "zero"')
    path.write_text(KTH.replace("# beyond", "# below = hold\n# beyond"))
    assert faults_of(path) == [":5: below acts where the first row is above 0 only; delete it"]


def test_a_falling_slope_never_wears_less_than_nothing():
    table = made(beyond="slope", below="hold", T_gamma_A_N_mm2=[1, 2], mass_rate_ug_m_mm2=[20, 10])
    assert rate_at((np.array([10e6]),), table) == [0.0]


def test_map_is_bilinear_between_its_rows():
    """Exact for a + b v + c p + d v p, 1e-12; held outside."""
    v, p = np.meshgrid([0.0, 0.5, 2.0], [0.0, 1000.0], indexing="ij")
    table = made(
        hardness_GPa=3,
        slip_speed_m_s=v.ravel().tolist(),
        pressure_MPa=p.ravel().tolist(),
        wear_coefficient=(1 + 2 * v + 3e-3 * p + 4e-3 * v * p).ravel().tolist(),
    )
    found = rate_at((np.array([0.3, 1.7, 9.0]), np.array([250e6, 900e6, 5e9])), table)
    expected = [1 + 0.6 + 0.75 + 0.3, 1 + 3.4 + 2.7 + 6.12, 1 + 4 + 3 + 8]
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_nothing_wears_where_nothing_slides_whatever_the_first_row_says(patches):
    table = made(T_gamma_A_N_mm2=[0], mass_rate_ug_m_mm2=[7])
    fields, area = patches(1e6)
    depth = passage_depth(fields, area, WearSettings("table", table))
    assert depth[2, 0].any()  # beyond the only row
    assert not depth[:2].any()
    assert not depth[:, 2].any()


def test_table_tells_its_story():
    table = made(T_gamma_A_N_mm2=[0, 1], mass_rate_ug_m_mm2=[0, 5], validity="up to 1 N/mm2")
    assert coefficient_set(table, "table") is table
    assert table.source == "twin disc"
    expected = "up to 1 N/mm2 Certainty: measured. 2 rows, between them linear, beyond the last hold."
    assert table.validity == expected


def faults_of(path):
    with pytest.raises(SceneError) as caught:
        read_wear_table(path)
    return [line.removeprefix(f"{path}") for line in str(caught.value).splitlines()]


def test_all_faults_of_a_toml_table_with_their_lines(tmp_path):
    path = tmp_path / "own.toml"
    path.write_text(
        'sourse = "x"\ncertainty = ""\ninterpolation = "cubic"\n'
        "T_gamma_A_N_mm2 = [0,\n  -1,  # a comment, with a comma\n  nan]\nmass_rate_ug_m_mm2 = [0, 1, 2]\n"
        "hardness_GPa = 3\n"
    )
    told = faults_of(path)
    assert ":1: sourse is no key of a wear table; did you mean source?" in told
    assert ":2: certainty = '' must be one line of text" in told
    assert any(line.startswith(":3: interpolation = 'cubic' must be") for line in told)
    assert ":5: T_gamma_A_N_mm2 = -1 must be a number of 0 or more, at most 1e12" in told
    assert ":6: T_gamma_A_N_mm2 = nan must be a number of 0 or more, at most 1e12" in told
    assert any(line.startswith(":8: hardness_GPa acts with wear_coefficient only") for line in told)
    assert any(line.startswith(": source is missing") for line in told)
    assert any(line.startswith(": beyond is missing") for line in told)
    assert len(told) == 8


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("0.7, 2400, 350e-4\n", ""), ":7: no row for slip_speed_m_s = 0.7 with pressure_MPa = 2400"),
        (("0.2, 2400", "0.7, 2400"), ":12: slip_speed_m_s = 0.7 with pressure_MPa = 2400 is given twice"),
        (("0.2, 0, 35e-4", "0.2, 0"), ":9: has 2 cells where the header has 3"),
        (("35e-4\n", "much\n"), ":9: wear_coefficient = 'much' must be a number"),
        (("# hardness_GPa = 3.0\n", ""), ": hardness_GPa is missing"),
        (("pressure_MPa", "power_density_W_mm2"), ": the index is power_density_W_mm2 and slip_speed_m_s"),
        (("wear_coefficient", "slip_speed_m_s"), ":7: column slip_speed_m_s is given twice"),
    ],
)
def test_faults_of_a_csv_table(tmp_path, change, told):
    path = tmp_path / "own.csv"
    assert change[0] in KTH
    path.write_text(KTH.replace(*change, 1))
    assert any(line.startswith(told) for line in faults_of(path))


@pytest.mark.parametrize(
    ("columns", "told"),
    [
        ({"T_gamma_A_N_mm2": [0, 2, 2], "mass_rate_ug_m_mm2": [0, 1, 1]}, "must be above 2, the row before"),
        ({"T_gamma_A_N_mm2": [0, 2], "mass_rate_ug_m_mm2": [0, 1, 1]}, "must be equally long"),
        ({"T_gamma_A_N_mm2": [], "mass_rate_ug_m_mm2": []}, "must be a list of numbers"),
        ({"mass_rate_ug_m_mm2": [1]}, "the index is missing"),
        ({"T_gamma_A_N_mm2": [1]}, "the wear rate is missing"),
        (
            {
                "interpolation": "step",
                "beyond": "slope",
                "T_gamma_A_N_mm2": [1],
                "energy_coefficient_mm3_kJ": [1],
            },
            'beyond = "slope" is for one index with linear',
        ),
        (
            {"slip_speed_m_s": [1], "wear_coefficient": [1], "hardness_GPa": True},
            "hardness_GPa = True must be a number",
        ),
    ],
)
def test_faults_of_the_keys(columns, told):
    table, faults = wear_table({**STATED, **columns}, "mine")
    assert table is None
    assert any(told in fault.message for fault in faults)


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"a = = 1", ":1: is not TOML"),
        (b"x = 1\n\xff", ":2: is not UTF-8"),
        (b" " * 1_000_001, ": is larger than 1 MB"),
        (None, ": cannot be read"),
    ],
)
def test_files_that_are_no_tables(tmp_path, content, told):
    path = tmp_path / "own.toml"
    if content is not None:
        path.write_bytes(content)
    assert faults_of(path)[0].startswith(told)
