"""`wearsim contact --table`: same bits as single calls, columns carried through, faults
with their line.
"""

from __future__ import annotations

import csv
import io
import json
import sys
import types

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from wearsim.cli import main
from wearsim.errors import ContactError, NumericalError
from wearsim.studies import contact_points
from wearsim.studies.contact_flags import COLUMNS
from wearsim.studies.contact_table import RESULT_COLUMNS

COARSE = ("--model", "fast", "--strips", "16", "--cells", "12")


@pytest.fixture
def table(tmp_path):
    """Write a table; its path as text."""

    def write(content, name="table.csv"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return str(path)

    return write


@pytest.fixture
def run(capsys):
    """Exit code, standard output and error of a call."""

    def call(*flags):
        code = main(["contact", *COARSE, *flags])
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return call


def rows(out):
    return list(csv.DictReader(io.StringIO(out)))


TABLE = """\
shift_mm,yaw_mrad,roller_radius_mm,side,rotation,creepage,normal_force_kN,friction
0,0,,right,nominal,,,0.3
3,2,1000,both,free,,,
-3,0,,left,centred,,,0.2
5.1,0,500,right,43.4,,,
3,0,,right,,"-0.0016,0,-0.197",,
2,-1,,both,,,70,
1,1,1000,right,free,,,0.5
"""


def test_a_table_has_the_same_bits_as_single_calls(table, run):
    code, out, err = run("--json", "--table", table(TABLE))
    assert (code, err) == (0, "")
    points = json.loads(out)["points"]
    given_rows = rows(TABLE)
    assert len(points) == len(given_rows)
    for point, row in zip(points, given_rows, strict=True):
        flags = [f"--{COLUMNS[name].name}={text}" for name, text in row.items() if text]
        alone = json.loads(run("--json", *flags)[1])["points"][0]
        assert {name: point[name] for name in alone} == alone
        assert set(point) - set(alone) == {"line", "columns"}


def test_three_hundred_rows_in_one_call(table, run):
    shifts = np.linspace(-4.0, 4.0, 300)
    lines = [f"{y:.4f},{'' if k % 3 else 1000},p{k}" for k, y in enumerate(shifts)]
    code, out, err = run(
        "--table", table("shift_mm,roller_radius_mm,name\n" + "\n".join(lines) + "\n")
    )
    assert (code, err) == (0, "")
    solved = rows(out)
    assert [row["name"] for row in solved] == [f"p{k}" for k in range(300)]
    assert [int(row["table_line"]) for row in solved] == list(range(2, 302))
    area = np.array([float(row["area_mm2"]) for row in solved])
    assert np.all(
        area[3:-1:3] < 0.97 * np.minimum(area[2:-2:3], area[4::3])
    )  # rollers, rails beside them


def test_columns_are_carried_through_and_flags_fill_what_is_empty(table, run):
    content = 'place,shift_mm,note,friction\nA,1,"x, ""y""",\nB,,,0.2\n'
    _, out, _ = run(
        "--table", table(content), "--friction", "0.4", "--roller-radius-mm", "800"
    )
    first, second = rows(out)
    assert list(first)[:4] == ["place", "shift_mm", "note", "friction"]
    assert (first["place"], first["note"], first["friction"]) == ("A", 'x, "y"', "0.4")
    assert (second["place"], second["note"], second["friction"]) == ("B", "", "0.2")
    assert second["shift_mm"] == "0"  # the default that acted
    assert (
        first["roller_radius_mm"] == "800"
    )  # a flag beside the table becomes a column
    assert set(RESULT_COLUMNS) < set(first)


def test_units_of_the_csv_are_those_of_its_names(table, run):
    path = table("shift_mm,yaw_mrad\n3,1\n")
    row = rows(run("--table", path)[1])[0]
    patch = json.loads(run("--table", path, "--json")[1])["points"][0]["patches"][0]
    factors = {
        "wheel_y_mm": ("wheel_y", 1e3),
        "area_mm2": ("area", 1e6),
        "max_pressure_MPa": ("max_pressure", 1e-6),
        "contact_angle_mrad": ("contact_angle", 1e3),
        "approach_um": ("approach", 1e6),
        "patch_normal_force_kN": ("normal_force", 1e-3),
        "creepage_y": ("creepage_y", 1.0),
        "spin_per_m": ("spin", 1.0),
        "spin_moment_Nm": ("spin_moment", 1.0),
        "power_W": ("power", 1.0),
    }
    for column, (name, factor) in factors.items():
        assert float(row[column]) == pytest.approx(patch[name] * factor, rel=1e-11), (
            column
        )  # 12 digits


def test_output_is_input_again(table, run):
    """Side and roll of each patch are those that were solved.

    The same equilibrium, from another start: patches are kept up to a change of 2e-5 of
    their load.
    """
    _, first, _ = run(
        "--table", table("name,shift_mm,yaw_mrad\na,3,2\nb,-1,0\n"), "--side", "both"
    )
    code, second, err = run("--table", table(first, "again.csv"))
    assert (code, err) == (0, "")
    assert list(rows(second)[0]) == list(rows(first)[0])
    for one, other in zip(rows(first), rows(second), strict=True):
        assert (one["name"], one["side"], one["roll"]) == (
            other["name"],
            other["side"],
            other["roll"],
        )
        for column in ("area_mm2", "power_W", "force_y_kN", "rotation_speed_rad_per_s"):
            assert float(other[column]) == pytest.approx(float(one[column]), rel=3e-5)


def test_a_mirrored_table_holds_the_points_that_were_solved(table, run):
    """Its output solves the same points without the flag, and with it those of the
    first table.
    """
    path = table(
        "shift_mm,yaw_mrad,left_wheel,side,creepage\n3,2,EPS,right,\n-1,0,,left,\n"
        '2,,,right,"0.001,0.001,0.1"\n'
    )
    plain, image = run("--table", path)[1], run("--table", path, "--mirror")[1]
    again = run("--table", table(image, "image.csv"))[1]
    back = run("--table", table(image, "image.csv"), "--mirror")[1]
    assert [row["side"] for row in rows(image)] == ["left", "right", "left"]
    assert [
        (row["shift_mm"], row["wheel"], row["left_wheel"]) for row in rows(image)
    ] == [
        ("-3", "EPS", "S1002"),
        ("1", "S1002", ""),
        ("-2", "S1002", ""),
    ]
    assert rows(image)[2]["creepage"] == "0.001,-0.001,-0.1"
    assert [row["area_mm2"] for row in rows(again)] == [
        row["area_mm2"] for row in rows(image)
    ]
    for one, other in zip(rows(plain), rows(back), strict=True):
        assert one["side"] == other["side"]
        for name in ("area_mm2", "force_y_kN", "spin_per_m", "power_W"):
            assert float(other[name]) == pytest.approx(float(one[name]), rel=1e-9)


def test_a_row_without_an_answer_does_not_stop_the_others(table, run):
    path = table("shift_mm,name\n0,a\n60,b\n1,c\n0,d\n-60,e\n")
    code, out, err = run("--table", path)
    assert code == 2
    assert [row["name"] for row in rows(out)] == ["a", "c", "d"]
    lines = err.splitlines()
    assert len(lines) == 2
    assert lines[0].startswith(f"{path}:3: ")
    assert lines[1].startswith(f"{path}:6: ")
    assert all("edge of a profile" in line and "point" not in line for line in lines)
    code, out, _ = run("--table", path, "--json")
    assert code == 2
    assert [point["columns"]["name"] for point in json.loads(out)["points"]] == [
        "a",
        "c",
        "d",
    ]


def test_rows_that_fail_leave_the_others_as_they_are_alone(table, run):
    """More failures than are taken out one by one, in more than one chunk; padding
    changes the last bit.
    """
    shifts = [60 if k % 7 == 3 else -3 + k * 0.05 for k in range(100)]
    _, out, err = run(
        "--json", "--table", table("shift_mm\n" + "\n".join(map(str, shifts)) + "\n")
    )
    good = [y for y in shifts if y != 60]
    assert err.count("\n") == len(shifts) - len(good)
    _, clean, _ = run(
        "--json", "--table", table("shift_mm\n" + "\n".join(map(str, good)) + "\n")
    )
    among, alone = (json.loads(text)["points"] for text in (out, clean))
    assert len(among) == len(alone) == len(good)
    for one, other in zip(among, alone, strict=True):
        assert one["shift"] == other["shift"]
        for patch, same in zip(one["patches"], other["patches"], strict=True):
            words = {key for key, value in patch.items() if isinstance(value, str)}
            assert {key: patch[key] for key in words} == {
                key: same[key] for key in words
            }
            numbers = [key for key in patch if key not in words]
            assert [patch[key] for key in numbers] == pytest.approx(
                [same[key] for key in numbers], rel=1e-10, abs=1e-14
            )


def test_the_exit_code_is_that_of_the_worst_row(table, run, monkeypatch):
    errors = {
        ("right",): ContactError("no touch", 0),
        ("left",): NumericalError("no convergence", 0),
        ("right", "left"): ContactError("edge"),
    }

    def refused(*_, sides, **options):
        raise errors[sides]

    monkeypatch.setattr(contact_points, "solve_contact", refused)
    code, out, err = run("--table", table("side\nright\nleft\nboth\n"))
    assert code == 3
    assert out.count("\n") == 1  # the header
    assert [line.split(": ", 1)[1] for line in err.splitlines()] == [
        "no touch",
        "no convergence",
        "edge",
    ]


@pytest.mark.parametrize(
    ("content", "messages"),
    [
        ("shift_mm\nabc\n", [":2: shift_mm = abc must be a number from -100 to 100"]),
        ("shift_mm\n\n1\n,\n200\n", [":5: shift_mm = 200 must be a number from -100"]),
        (
            "shift_mm\nnan\ninf\n1_0\n",
            [":2: shift_mm = nan", ":3: shift_mm = inf", ":4: shift_mm = 1_0"],
        ),
        (
            'shift_mm\n"1,5"\n',
            [":2: shift_mm = 1,5 must be", "the decimal mark is a point"],
        ),
        (
            "shift_mm;name\n1.234;a\n1,5;b\n",
            [":2: 1.234 in a file with decimal commas"],
        ),
        ("one\ttwo\n1\t2\n", ["separate columns by commas"]),
        ("shift_mm,yaw_mrad,shift_mm\n1,2,3\n", [':1: column "shift_mm" stands twice']),
        ("shift_mm,my  note,my note\n1,a,b\n", [':1: column "my note" stands twice']),
        (
            "shift_mm,flange_back_mm\n1,1360\n",
            [":1: column flange_back_mm has a new name"],
        ),
        ("shift_mm,,yaw_mrad\n1,2,3\n", [":1: column 2 has no name"]),
        (
            "shift_mm,yaw_mrad\n1\n1,2,3\n",
            [":2: 1 cells, the header has 2", ":3: 3 cells, the header has 2"],
        ),
        ("1,2\n3,4\n", [":1: no column has the name of a flag"]),
        ("Shift mm,yaw\n3,4\n", ["did you mean shift_mm, yaw_mrad?"]),
        ("", ["holds nothing"]),
        ("\n\n", ["holds nothing"]),
        ("shift_mm\n", ["holds only a header"]),
        ('shift_mm,name\n1,"a\n2,b\n', [":2: is not well-formed CSV"]),
        ('shift_mm,name\n1,"a"b\n', [":2: is not well-formed CSV"]),
        (b"shift_mm,name\n1,a\n2,\x07\n", [":3: holds the control character"]),
        (
            "shift_mm,yaw_mrad\n[m],[mrad]\n1,2\n",
            [':2: column "shift_mm" is in [m] by the row of units'],
        ),
        ("side\nup\nboth\n", [":2: side = up must be one of right, left, both"]),
        (
            "wheel,rail\nS1003,60E1\nS1002,59E1\nS1003,60E1\n",
            [":2: wheel: 'S1003'", ":3: rail: '59E1'"],
        ),
        ("inclination\n0.0250\n", [":2: inclination = 0.0250 must be 1:N"]),
        ("rotation\nslow\n", [":2: rotation = slow must be free"]),
        (
            "roll\n200\nresting\n",
            [":2: roll = 200 must be free or", ":3: roll = resting"],
        ),
        ("strips\n5.5\n", [":2: strips = 5.5 must be a whole number"]),
        (
            "curve_radius_m\n0\n",
            [":2: curve_radius_m = 0 must be a number of magnitude"],
        ),
        (
            "wheel_load_kN,normal_force_kN\n80,80\n",
            [":2: normal_force_kN and wheel_load_kN exclude each"],
        ),
        (
            'rotation,creepage\nfree,"0,0,0"\n',
            [":2: creepage and rotation exclude each other"],
        ),
        (
            'side,creepage\nboth,"0,0,0"\n',
            [":2: creepages are given for the single patch of one wheel"],
        ),
        (
            'creepage\n"0,0"\n"0,2,0"\n',
            [":2: creepage = 0,0 must be three", ":3: creepage = 0,2,0"],
        ),
        ("normal\nhertzian\n", [":2: normal = hertzian must be one of"]),
    ],
)
def test_every_fault_of_the_input_is_one_line(content, messages, table, run):
    path = table(content)
    code, out, err = run("--table", path)
    assert code == 2
    assert out == ""
    lines = err.splitlines()
    assert all(line.startswith(f"{path}:") for line in lines)
    for message in messages:
        assert sum(message in line for line in lines) == 1, (message, lines)
    numbered = [message for message in messages if message.startswith(":")]
    assert len(lines) == max(len(numbered), 1)


def test_faults_of_flags_and_table_are_told_together(table, run):
    path = table("shift_mm\n1\nx\n")
    code, out, err = run("--table", path, "--friction", "2", "--plot", "picture.bmp")
    assert (code, out) == (2, "")
    for part in (
        "--friction = 2",
        "--plot and --table exclude",
        "--plot = picture.bmp",
        f"{path}:3: shift_mm = x",
    ):
        assert part in err
    assert len(err.splitlines()) == 4


def test_very_many_faults_are_counted(table, run):
    path = table("shift_mm\n" + "x\n" * 250)
    _, _, err = run("--table", path)
    assert len(err.splitlines()) == 21
    assert err.endswith("and 230 more faults that are not shown\n")


@pytest.mark.parametrize(
    ("columns", "hint"),
    [
        (
            "shift_m,yaw_mrad",
            (
                "column shift_m is not a flag of wearsim and is carried through; did "
                "you mean shift_mm?"
            ),
        ),
        ("shift_mm,yaw", "did you mean yaw_mrad?"),
        ("shift_mm,--yaw-mrad", "did you mean yaw_mrad?"),
        ("shift_mm,speed", "did you mean speed_km_h?"),
        ("shift_mm,Friction", "did you mean friction?"),
        ("shift_mm,spin", "creepages are given in one column creepage"),
    ],
)
def test_columns_that_are_nearly_flags_deserve_a_warning(columns, hint, table, run):
    code, out, err = run("--table", table(f"{columns}\n1,2\n"))
    assert code == 0
    assert len(err.splitlines()) == 1
    assert hint in err
    assert out.startswith(columns)


@pytest.mark.parametrize(
    "column", ["name", "date", "note", "id", "measured wear", "km"]
)
def test_other_columns_are_no_matter_for_warnings(column, table, run):
    assert run("--table", table(f"shift_mm,{column}\n1,2\n"))[2] == ""


@pytest.mark.parametrize(
    "content",
    [
        b"\xef\xbb\xbfshift_mm,name\r\n1,a\r\n\r\n2,b\r\n",
        b"shift_mm,name\r1,a\r2,b\r",
        b'"shift_mm", "name"\n 1 , a\n"2",b',
        b"shift_mm,name,,\n1,a,,\n,,,\n2,b,,\n",
    ],
)
def test_what_spreadsheets_write_is_read(content, table, run):
    code, out, err = run("--table", table(content))
    assert code == 0
    assert err == ""
    assert [(row["shift_mm"], row["name"]) for row in rows(out)] == [
        ("1", "a"),
        ("2", "b"),
    ]


def test_output_as_input_solves_each_wheel_once(table, run):
    """At 5.3 mm two patches close: two lines of output, one point of the next table."""
    _, first, _ = run("--table", table("shift_mm\n5.3\n3\n"))
    assert [row["patch"] for row in rows(first)] == ["1", "2", "1"]
    path = table(first, "solved.csv")
    code, second, err = run("--table", path)
    assert (code, err) == (0, "")
    assert [row["area_mm2"] for row in rows(second)] == [
        row["area_mm2"] for row in rows(first)
    ]
    assert {row["normal"] for row in rows(second)} == {"kik_piotrowski"}
    assert {row["tangential"] for row in rows(second)} == {"fastsim"}


def test_rows_that_deserve_a_second_look_are_noted_once_per_kind(table, run):
    path = table(
        "shift_mm,curve_radius_m,roller_radius_mm\n3,,\n7,,\n7.1,,\n0,500,1000\n"
    )
    code, out, err = run("--table", path)
    assert code == 0
    assert len(rows(out)) == 4
    climbing, curve = err.splitlines()
    assert climbing.startswith(
        f"{path}: note: line 3: shift 7 mm is beyond the flange clearance of 6.6 mm"
    )
    assert climbing.endswith(" (1 more row like it)")
    assert curve.startswith(
        f"{path}: note: line 5: a curve radius on a roller stands for"
    )


def test_a_line_in_quotes_counts_for_the_lines_after_it(table, run):
    path = table('shift_mm,note\n1,"two\nlines"\n60,b\n')
    code, out, err = run("--table", path)
    assert code == 2
    assert err.startswith(f"{path}:4: ")
    assert rows(out)[0]["note"] == "two\nlines"


def test_standard_input_is_a_table(run, monkeypatch, table):
    monkeypatch.setattr(
        sys, "stdin", types.SimpleNamespace(buffer=io.BytesIO(TABLE.encode()))
    )
    piped = run("--table", "-")
    assert piped[0] == 0
    assert piped == run("--table", table(TABLE))
    monkeypatch.setattr(
        sys, "stdin", types.SimpleNamespace(buffer=io.BytesIO(b"shift_mm\nx\n"))
    )
    assert run("--table", "-")[2].startswith("stdin:2: shift_mm = x")


@pytest.mark.parametrize(
    ("name", "printed_text"),
    [("missing.csv", "cannot be read"), (".", "Is a directory")],
)
def test_a_table_that_cannot_be_read(name, printed_text, tmp_path, run):
    code, out, err = run("--table", str(tmp_path / name))
    assert (code, out) == (2, "")
    assert printed_text in err
    assert err.count("\n") == 1


def test_a_row_goes_before_the_flags(table, run):
    """Also before a flag that the row excludes."""
    path = table('normal_force_kN,creepage\n70,\n,"0.001,0,0"\n')
    code, out, _ = run(
        "--json", "--table", path, "--wheel-load-kN", "90", "--rotation", "nominal"
    )
    first, second = json.loads(out)["points"]
    assert code == 0
    assert first["wheel_load"] is None
    assert first["patches"][0]["normal_force"] == pytest.approx(70e3, rel=1e-12)
    assert second["wheel_load"] == 90e3
    assert second["rotation_speed"] is None
    assert second["patches"][0]["creepage_x"] == 0.001


cell = st.one_of(
    st.sampled_from(
        [
            "",
            "0",
            "1",
            "-3",
            "both",
            "left",
            "free",
            "nan",
            "1e400",
            "S1002",
            "0,0,0",
            "1:40",
        ]
    ),
    st.text(max_size=8),
)


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    columns=st.lists(
        st.one_of(st.sampled_from(sorted(COLUMNS)), st.text(max_size=6)),
        min_size=1,
        max_size=4,
    ),
    body=st.lists(st.lists(cell, max_size=4), max_size=4),
    noise=st.binary(max_size=6),
    quoted=st.booleans(),
)
def test_garbage_is_never_a_traceback(
    columns, body, noise, quoted, tmp_path_factory, capsys
):
    path = tmp_path_factory.mktemp("garbage") / "table.csv"
    text = io.StringIO()
    csv.writer(text, quoting=csv.QUOTE_ALL if quoted else csv.QUOTE_MINIMAL).writerows(
        [columns, *body]
    )
    path.write_bytes(text.getvalue().encode("utf-8", "replace") + noise)
    code = main(["contact", "--strips", "5", "--cells", "5", "--table", str(path)])
    captured = capsys.readouterr()
    assert "internal error" not in captured.err
    assert code in (0, 2, 3)
    assert captured.err or code == 0
    printed_text = [
        line for line in captured.err.splitlines() if line.startswith(f"{path}:")
    ]
    assert printed_text == captured.err.splitlines()
    for row in rows(captured.out):
        numbers = [float(row[name]) for name in RESULT_COLUMNS if row[name] != ""]
        assert np.all(np.isfinite(numbers))
