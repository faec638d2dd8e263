"""Text tables of any common layout are read as the same table."""

from pathlib import Path

import pytest

from wearsim.csv_tables import csv_table, layout_note, unit_faults

EXPORTS = Path(__file__).parent / "data/exports"
PLAIN = "time,y,name\n0,-1.5e-3,a\n0.5,2.25,b\n"
HEADER, ROWS = ["time", "y", "name"], [["0", "-1.5e-3", "a"], ["0.5", "2.25", "b"]]
COMMAS = PLAIN.replace(",", ";").replace(".", ",")


def table_of(text, encoding="utf-8", **options):
    return csv_table(text.encode(encoding), "t.csv", **options)


@pytest.mark.parametrize(
    ("text", "encoding", "layout"),
    [
        (PLAIN, "utf-8", ""),
        (PLAIN, "utf-8-sig", ""),
        (PLAIN.replace("\n", "\r\n"), "utf-8", ""),
        (PLAIN, "utf-16", "text in UTF-16"),
        (PLAIN, "utf-16-le", "text in UTF-16-LE"),
        (PLAIN, "utf-16-be", "text in UTF-16-BE"),
        (COMMAS, "utf-8", "columns separated by semicolons, decimal commas"),
        (
            f"sep=;\n{COMMAS}",
            "utf-8",
            "columns separated by semicolons, decimal commas",
        ),
        (PLAIN.replace(",", "\t"), "utf-8", "columns separated by tabs"),
        (f"# made by a program\n! and another\n{PLAIN}", "utf-8", ""),
        (
            PLAIN.replace("\n0,", "\n[s],[mm],\n0,", 1),
            "utf-8",
            "units in line 2",
        ),
        (PLAIN.replace("\n0,", "\ns,m/s^2,-\n0,", 1), "utf-8", "units in line 2"),
        (
            f"Export of a program\ndate,2024-01-01\n\n{PLAIN}",
            "utf-8",
            "2 lines of text above the header left out",
        ),
    ],
)
def test_layouts_of_one_table(text, encoding, layout):
    table = table_of(text, encoding)
    assert table.faults == []
    assert (table.header, [cells for _, cells in table.rows]) == (HEADER, ROWS)
    assert table.layout == layout_note(text.encode(encoding)) == layout


def test_a_header_in_a_comment_and_columns_apart_by_blanks():
    table = table_of("# time  y\n 0.0   1.5\n 0.5  -2,5\n")
    assert table.header == ["time", "y"]
    assert table.rows == [(2, ["0.0", "1.5"]), (3, ["0.5", "-2.5"])]
    assert table.layout == "columns separated by blanks, decimal commas"


def test_exports_of_a_multibody_program_and_of_an_instrument():
    table = csv_table((EXPORTS / "multibody.csv").read_bytes(), "t.csv")
    assert table.header == ["time", "$WS1.y", "$WS1.yaw", "$WS1.Q_r", "$WS1.Q_l"]
    assert table.rows[1] == (
        4,
        ["0.010000", "0.000128", "0.000767", "70348.278742", "69651.721258"],
    )
    assert dict(table.units)["$WS1.Q_r"] == "[N]"
    table = csv_table((EXPORTS / "instrumented_gbk.csv").read_bytes(), "t.csv")
    assert table.header[:2] == ["速度", "里程"]
    assert table.layout == "text in GBK"


def test_text_in_latin_1_keeps_its_names():
    table = table_of("Weg,Kräfte\n1,2\n", "latin-1")
    assert table.header == ["Weg", "Kräfte"]
    assert table.layout == "text in Latin-1"


@pytest.mark.parametrize(
    ("unit", "keys"),
    [
        ("[mm]", ["shift_mm", "shift"]),
        ("(km/h)", ["speed_km_h"]),
        ("kN m", ["axle_torque_kN_m"]),
        ("[N·m]", ["axle_torque_N_m"]),
        ("[something]", ["shift_mm", "speed_km_h"]),
    ],
)
def test_a_row_of_units_is_held_against_the_keys(unit, keys):
    table = table_of(f"a,b\n{unit},[-]\n1,2\n")
    assert [unit_faults(table, "t.csv", {"a": key}) for key in keys] == [[]] * len(keys)
    wrong = unit_faults(table, "t.csv", {"a": "time_h"})
    assert len(wrong) == (unit != "[something]")
    assert all("the key time_h is in h; state the unit" in str(one) for one in wrong)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (
            "a,b\n" + "1,2,3\n" * 9,
            "t.csv:2: 3 cells, the header has 2 (and 8 more",
        ),
        ("a;b\n1,5;2.000\n", "t.csv:2: 2.000 in a file with decimal commas"),
        ("a,b\n1,\x00\n", "t.csv:2: holds the control character '\\x00'"),
    ],
)
def test_bad_layouts_are_one_line(text, fault):
    (only,) = table_of(text).faults
    assert str(only).startswith(fault)
