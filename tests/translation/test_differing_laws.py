"""Laws of one name and other numbers are no equal laws: tables, hardness, caps, break
points.
"""

from pathlib import Path

import numpy as np
import pytest

from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.scene import build, load_scene
from wearsim.translation.compare import common_laws
from wearsim.translation.translate import translate

SCENE = (Path(__file__).parents[1] / "data" / "scene_rig.toml").read_text()
TABLE = """
[wear.table]
source = "twin disc"
certainty = "measured"
interpolation = "linear"
beyond = "hold"
T_gamma_A_N_mm2 = [0, 10, {last}]
mass_rate_ug_m_mm2 = [0, 55, 60]
"""
POINTS = """
[fatigue.damage_function]
source = "our wheels"
certainty = "{certainty}"
start_N = {start}
peak_N = 80
end_N = 200
peak_damage = 5e-6
"""


@pytest.fixture
def header(tmp_path):
    """Function that gives static variables and attributes of the result file of a
    scene.
    """

    def of(text):
        path = tmp_path / "scene.toml"
        path.write_text(SCENE + text)
        return WheelsetEvolution(build(load_scene(path))).header

    return of


def notes(rig, field, mine, theirs):
    """Notes of a comparison whose campaigns have the wear law of two headers."""
    keys = (
        "wear_law",
        "wear_coefficients",
        "wear_law_numbers",
        "wear_form",
        "seizure_cap",
    )
    one, other = (
        data.assign_attrs({key: head.attributes[key] for key in keys})
        for data, head in ((rig, mine), (field, theirs))
    )
    return translate(one, other).attrs.get("warnings", "").splitlines()


def test_tables_with_other_rows_differ(rig, field, header):
    one, other = (
        header('[wear]\nlaw = "table"\n' + TABLE.format(last=last)) for last in (20, 21)
    )
    lines = notes(rig, field, one, other)
    assert len(lines) == 1
    assert lines[0].startswith("wear law numbers differs: 3 rows sha256:")
    assert not notes(rig, field, one, one)


def test_hardness_of_the_wheel_differs(rig, field, header):
    archard = '[wear]\nlaw = "archard"\nhardness_GPa = {}\n'
    lines = notes(rig, field, header(archard.format(2.7)), header(archard.format(3.1)))
    assert lines == [
        (
            "wear law numbers differs: hardness = 2.7 GPa on the rig, hardness = 3.1 "
            "GPa in the field"
        )
    ]


def test_cap_of_seizure_differs(rig, field, header):
    capped = header('[wear]\nlaw = "archard"\nseizure_cap = "regime"\n')
    lines = notes(rig, field, header('[wear]\nlaw = "archard"\n'), capped)
    assert lines == ["seizure cap differs: none on the rig, regime in the field"]


def test_numbers_of_laws_that_differ_by_name_are_not_listed(rig, field, header):
    lines = notes(
        rig,
        field,
        header('[wear]\nlaw = "archard"\n'),
        header('[wear]\nlaw = "usfd"\n'),
    )
    assert not any("numbers" in line for line in lines)


def with_laws(dataset, head, group):
    """Dataset with what the header of a campaign says of its comparison laws."""
    static = {
        key: (key, np.array(value))
        for key, value in head.static.items()
        if key.startswith(f"{group}_")
    }
    return dataset.assign(static).assign_attrs(
        {f"{group}_numbers": head.attributes[f"{group}_numbers"]}
    )


def test_comparison_tables_with_other_rows_are_not_compared(rig, field, header):
    text = '[wear]\nalso_evaluate = ["archard", "table"]\nhardness_GPa = 3\n'
    one, other = (header(text + TABLE.format(last=last)) for last in (20, 21))
    pair = (with_laws(rig, one, "comparison"), with_laws(field, other, "comparison"))
    assert common_laws(pair, "comparison") == (["archard"], ["table"])
    assert common_laws((pair[0], pair[0]), "comparison") == (["archard", "table"], [])


def test_break_points_of_ones_own_are_compared_by_number(rig, field, header):
    laws = '[fatigue]\nlaws = ["surface_fatigue_index", "wlrm"]\n'
    one, moved, reworded = (
        with_laws(
            field,
            header(laws + POINTS.format(start=start, certainty=certainty)),
            "fatigue",
        )
        for start, certainty in (
            (20, "a guess"),
            (25, "a guess"),
            (20, "our own guess"),
        )
    )
    assert common_laws((one, moved), "fatigue") == (["surface_fatigue_index"], ["wlrm"])
    assert common_laws((one, reworded), "fatigue") == (
        ["surface_fatigue_index", "wlrm"],
        [],
    )


def test_yield_stress_beside_equal_names_is_compared(rig, field, header):
    laws = '[fatigue]\nlaws = ["surface_fatigue_index"]\nshear_yield_MPa = {}\n'
    one, other = (
        with_laws(field, header(laws.format(value)), "fatigue") for value in (300, 310)
    )
    assert common_laws((one, other), "fatigue") == ([], ["surface_fatigue_index"])
