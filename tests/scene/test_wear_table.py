import pytest

from wearsim.damage.wear.table import INDEX_COLUMNS, RATE_COLUMNS
from wearsim.errors import SceneError
from wearsim.scene.wear_table import WearTableSection, read_wear_table, wear_table

STATED = {
    "source": "twin disc",
    "certainty": "measured",
    "interpolation": "linear",
    "beyond": "hold",
}
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


def faults_of(path):
    with pytest.raises(SceneError) as caught:
        read_wear_table(path)
    return [line.removeprefix(f"{path}") for line in str(caught.value).splitlines()]


def test_what_holds_below_the_first_row_is_asked_for(tmp_path):
    """At the line of that row, with the way out; where nothing is below it, the key is
    refused.
    """
    path = tmp_path / "own.csv"
    text = KTH.replace("\n0.0, 0,", "\n0.1, 0,").replace("\n0.0, 2400,", "\n0.1, 2400,")
    path.write_text(text)
    (output,) = faults_of(path)
    assert output.startswith(
        ":8: slip_speed_m_s = 0.1 is the first row, and nothing says what holds below "
        "it"
    )
    assert 'write below = "proportional"' in output
    path.write_text(text.replace("# beyond", "# below = none\n# beyond"))
    assert faults_of(path) == [
        ':5: below = "none" is not allowed; known: proportional, hold, zero'
    ]
    path.write_text(KTH.replace("# beyond", "# below = hold\n# beyond"))
    assert faults_of(path) == [
        ":5: below acts where the first row is above 0 only; delete it"
    ]


def test_all_faults_of_a_toml_table_with_their_lines(tmp_path):
    path = tmp_path / "own.toml"
    path.write_text(
        'sourse = "x"\ncertainty = ""\ninterpolation = "cubic"\n'
        "T_gamma_A_N_mm2 = [0,\n  -1,  # a comment, with a comma\n  nan]\n"
        "mass_rate_ug_m_mm2 = [0, 1, 2]\n"
        "hardness_GPa = 3\n"
    )
    output = faults_of(path)
    number = (
        "at least 0 and at most 1e+12 N/mm2; give frictional work per area and distance"
    )
    assert ":1: unknown key sourse in the file; did you mean source?" in output
    assert ":2: certainty is empty; give how sure it is, in words" in output
    assert ':3: interpolation = "cubic" is not allowed; known: linear, step' in output
    assert f":5: T_gamma_A_N_mm2[1] = -1 must be {number}" in output
    assert f":6: T_gamma_A_N_mm2[2] = nan must be a finite number, {number}" in output
    assert (
        ":1: key source is missing in the file; give where the table comes from"
        in output
    )
    assert any(
        line.startswith(":1: key beyond is missing in the file; give what holds")
        for line in output
    )
    assert len(output) == 7


@pytest.mark.parametrize(
    ("change", "output"),
    [
        (
            ("0.7, 2400, 350e-4\n", ""),
            ":7: no row for slip_speed_m_s = 0.7 with pressure_MPa = 2400",
        ),
        (
            ("0.2, 2400", "0.7, 2400"),
            ":12: slip_speed_m_s = 0.7 with pressure_MPa = 2400 is given twice",
        ),
        (("0.2, 0, 35e-4", "0.2, 0"), ":9: 2 cells, the header has 3"),
        (
            ("35e-4\n", "much\n"),
            ':9: wear_coefficient[1] = "much" must be a number, at least 0',
        ),
        (("# hardness_GPa = 3.0\n", ""), ":1: hardness_GPa is missing"),
        (
            ("pressure_MPa", "power_density_W_mm2"),
            ":1: the index is power_density_W_mm2 and slip_speed_m_s",
        ),
        (
            ("wear_coefficient", "mass_rate_ug_m_mm2"),
            ":6: hardness_GPa acts with wear_coefficient only",
        ),
        (
            ("pressure_MPa", "presure_MPa"),
            ":7: unknown key presure_MPa in the file; did you mean pressure",
        ),
        (
            ("wear_coefficient", "slip_speed_m_s"),
            ':7: column "slip_speed_m_s" stands twice',
        ),
    ],
)
def test_faults_of_a_csv_table(tmp_path, change, output):
    path = tmp_path / "own.csv"
    assert change[0] in KTH
    path.write_text(KTH.replace(*change, 1))
    assert any(line.startswith(output) for line in faults_of(path))


@pytest.mark.parametrize(
    ("columns", "output"),
    [
        (
            {"T_gamma_A_N_mm2": [0, 2, 2], "mass_rate_ug_m_mm2": [0, 1, 1]},
            "must be above 2, the row before",
        ),
        (
            {"T_gamma_A_N_mm2": [0, 2], "mass_rate_ug_m_mm2": [0, 1, 1]},
            "must be equally long",
        ),
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
    ],
)
def test_faults_of_the_keys(columns, output):
    table, faults = wear_table(WearTableSection(**{**STATED, **columns}), "mine")
    assert table is None
    assert any(output in message for _, message in faults)


def test_lists_and_numbers_of_a_toml_table_have_limits(tmp_path):
    path = tmp_path / "own.toml"
    head = "".join(f'{key} = "{value}"\n' for key, value in STATED.items())
    path.write_text(
        head + "hardness_GPa = true\nslip_speed_m_s = []\nwear_coefficient = 1\n"
    )
    hardness, empty, lone = faults_of(path)
    assert hardness.startswith(
        ":5: hardness_GPa = true must be a number, at least 0.1 and at most 20 GPa"
    )
    assert empty == ":6: slip_speed_m_s has 0 entries, needs at least 1"
    assert lone == ":7: wear_coefficient = 1 must be a list, such as [1]"


def test_no_more_than_twenty_faults_are_shown(tmp_path):
    path = tmp_path / "own.csv"
    path.write_text(KTH + "0.1, 0, much\n" * 30)
    output = faults_of(path)
    assert len(output) == 21
    assert output[-1] == "and 10 more faults that are not shown"


def test_every_column_is_a_key_of_the_table():
    assert {*INDEX_COLUMNS, *RATE_COLUMNS} < set(WearTableSection.model_fields)


@pytest.mark.parametrize(
    ("content", "output"),
    [
        (b"a = = 1", ":1: not valid TOML: Invalid value"),
        (b"x = 1\n\xff", ":2: is not UTF-8"),
        (b" " * 2_000_001, ": is larger than 2 MB"),
        (None, ": cannot be read"),
    ],
)
def test_files_that_are_no_tables(tmp_path, content, output):
    path = tmp_path / "own.toml"
    if content is not None:
        path.write_bytes(content)
    assert faults_of(path)[0].startswith(output)


def test_a_table_is_its_own_dump():
    """What is not given is None, and None may be given."""
    section = WearTableSection(
        **STATED, T_gamma_A_N_mm2=[0, 1], mass_rate_ug_m_mm2=[0, 5]
    )
    dump = section.model_dump(mode="json")
    assert dump["pressure_MPa"] is None
    assert WearTableSection.model_validate(dump) == section
