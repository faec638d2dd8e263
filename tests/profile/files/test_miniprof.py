import numpy as np
import pytest

from wearsim.profile.files import read_profile
from wearsim.profile.standard import rail, wheel

WHEEL = wheel("S1002", spacing=1e-3)
RAIL = rail("60E1", 1 / 40, 1.435, 0.750, spacing=1e-3)
# the gauge side is measured further down than the field side
SHORT = (RAIL.z < 20e-3) & ((RAIL.y < 0.01) | (RAIL.z < 9e-3))
ROUNDING = 0.51e-7  # of points written with four decimals of a mm [m]


def rows(x, y, line="{x:.4f} {y:.4f}"):
    return [line.format(x=a, y=b) for a, b in zip(x, y, strict=True)]


def wheel_rows(line="{x:.4f} {y:.4f}"):
    return rows(1e3 * WHEEL.y + 70.0, 1e3 * WHEEL.z, line)


def head(**keys):
    return [
        f"{key}={value}"
        for key, value in {"ProgramVer": "2.4", "MPTypeNo": "101", **keys}.items()
    ]


@pytest.fixture
def read(tmp_path):
    def reading(lines, name="w.whl", kind="wheel", encoding="utf-8", **statements):
        path = tmp_path / name
        path.write_bytes("\n".join(lines).encode(encoding))
        return read_profile(path, kind, **statements)

    return reading


def assert_is_wheel(reading):
    assert np.max(np.abs(reading.profile.y - WHEEL.y)) < ROUNDING
    assert np.max(np.abs(reading.profile.z - WHEEL.z)) < ROUNDING


def test_wheel_with_header_and_empty_line(read):
    reading = read(
        [*head(XYPoints=len(WHEEL.y), Stock="%Talent", Side="%L"), "", *wheel_rows()]
    )
    assert reading.format == "miniprof"
    assert_is_wheel(reading)
    assert (
        reading.header["Stock"] == "%Talent"
    )  # `%` begins a comment only among the points
    assert "y counted from the flange back, 70 mm subtracted" in reading.notes
    assert reading.profile.source == (
        "file w.whl (format MiniProf; y counted from the flange back, 70 mm subtracted)"
    )


@pytest.mark.parametrize("name", ["w.whl", "w.txt", "w.csv"])
def test_content_tells_the_format_whatever_the_extension(read, name):
    assert read([*head(), "", *wheel_rows()], name).format == "miniprof"


@pytest.mark.parametrize(
    "comment", ["# wheel profile w; file w.whl (format MiniProf)", "! from MINIPROF"]
)
def test_the_word_in_a_comment_is_no_miniprof_file(read, comment):
    lines = [comment, *rows(1e3 * WHEEL.y, 1e3 * WHEEL.z, "{x:.4f},{y:.4f}")]
    reading = read(lines, name="w.csv")
    assert reading.format == "two-column"
    assert_is_wheel(reading)


def test_missing_empty_line(read):
    assert_is_wheel(read([*head(), *wheel_rows()]))


def test_no_header_at_all(read):
    assert_is_wheel(read(wheel_rows()))


def test_points_in_the_other_direction_keep_their_places(read):
    reading = read([*head(), "", *wheel_rows()[::-1]])
    assert_is_wheel(reading)
    assert "points listed from the field side, order reversed" in reading.notes


def test_mirrored_x(read):
    reading = read([*head(), "", *rows(-1e3 * WHEEL.y - 70.0, 1e3 * WHEEL.z)])
    assert_is_wheel(reading)
    assert "flange at the end of larger y, y mirrored" in reading.notes


def test_wheel_with_y_up(read):
    reading = read([*head(), "", *rows(1e3 * WHEEL.y + 70.0, -1e3 * WHEEL.z)])
    assert_is_wheel(reading)
    assert "z up, sign changed" in reading.notes


@pytest.mark.parametrize("key", ["ColumnDef", "COLUMNDEF", "columndef"])
@pytest.mark.parametrize(
    ("definition", "line"),
    [
        ("X,Y", "{x:.4f} {y:.4f}"),
        ("X,Y", "{x:.4f},{y:.4f}"),
        ("X,Y,A", "{x:.4f}, {y:.4f}, 0.1"),
        ("X,Y,A,C", "{x:.4f} {y:.4f} 0.0933 -0.0341687982148268"),
        ("X,Y,A,C,N", "{x:.4f},{y:.4f},0.1,1e-3,7"),
        ("X,Y,K", "{x:.4f}\t{y:.4f}\t300"),
        ("A,Y,X", "0.2 {y:.4f} {x:.4f}"),
    ],
)
def test_columns(read, key, definition, line):
    assert_is_wheel(read([*head(**{key: definition}), "", *wheel_rows(line)]))


def test_more_columns_than_the_missing_definition_are_ignored(read):
    assert_is_wheel(read([*head(), "", *wheel_rows("{x:.4f} {y:.4f} 0.1 0.2")]))


def test_decimal_commas(read):
    assert_is_wheel(
        read([*head(), "", *(row.replace(".", ",") for row in wheel_rows())])
    )


def test_unknown_column(read):
    assert_is_wheel(
        read([*head(ColumnDef="X,Y,Q"), "", *wheel_rows("{x:.4f} {y:.4f} 5")])
    )


def test_definition_without_y(fault):
    assert "w.whl: ColumnDef = 'x,a' does not name X and Y" in fault(
        [*head(ColumnDef="X,A"), "", *wheel_rows()]
    ).replace("'X,A'", "'x,a'")


def test_comments_and_switched_off_lines(read):
    points = wheel_rows()
    points[10] += '" a remark'
    points[20] += " ! another"
    points[30] += " % a third"
    lines = [
        *head(XYPoints=len(points) + 2),
        '"ColumnDef=Y,X"',
        'CarNo=12" old: 11',
        '"RefPoint1="',
        "",
        *points[:50],
        '"-500.0 3.0',
        '"-600.0 3.0',
        *points[50:],
    ]
    reading = read(lines)
    assert_is_wheel(reading)
    assert reading.header["CarNo"] == "12"
    assert "RefPoint1" not in reading.header
    assert "2 switched-off points left out" in reading.notes


def test_all_keys_are_kept(read):
    reading = read([*head(UnknownKey="7", Sh_AlarmStatus="0"), "", *wheel_rows()])
    assert reading.header["UnknownKey"] == "7"
    assert reading.header["Sh_AlarmStatus"] == "0"


def test_x_already_counted_from_the_running_circle(read):
    assert_is_wheel(read([*head(), "", *rows(1e3 * WHEEL.y, 1e3 * WHEEL.z)]))


def test_names_in_latin_1_are_readable(read):
    reading = read([*head(Line="Höllental"), "", *wheel_rows()], encoding="latin-1")
    assert_is_wheel(reading)
    assert reading.header["Line"] == "Höllental"
    assert "text is not UTF-8: read as Latin-1" in reading.notes


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_marked_encodings(read, encoding):
    reading = read([*head(Line="Höllental"), "", *wheel_rows()], encoding=encoding)
    assert reading.header["Line"] == "Höllental"


OLD = ["MINIPROF 101 148 1994 3 24", "C:\\DATA\\W1.WHL", "Wheel of 4.5 tonnes", "1994"]


@pytest.mark.parametrize(
    "before",
    [
        [*OLD, "32.58 37.11 14.71 (Sd/Sh/qR)", ""],
        [*OLD, "32.58 37.11 14.71 (Sd/Sh/qR)"],
        [*OLD, '" 32.58 37.11 14.71', "(Sd/Sh/qR)", ""],
        [*OLD, "32.58 37.11 14.71", "(Sd/Sh/qR)", ""],
        [
            "#MINIWHEELPROF",
            "Car1_T(R).whl",
            "MINIPROF 2020",
            "Stock.......:",
            *OLD[3:],
            "(Sd/Sh/qR)",
            "",
        ],
    ],
)
def test_old_style(read, before):
    reading = read([*before, *wheel_rows()], "old.txt")
    assert reading.format == "miniprof"
    assert_is_wheel(reading)


def test_cut_off_file_is_refused(fault):
    lines = [*head(XYPoints=400), "", *wheel_rows()]
    assert fault(lines) == (
        f"w.whl:{len(lines)}: XYPoints = 400, but {len(WHEEL.y)} points are there: "
        "the file is cut off; copy it again, or correct XYPoints if points were "
        "taken out on purpose"
    )


def test_more_points_than_promised_are_told(read):
    reading = read([*head(XYPoints=100), "", *wheel_rows()])
    assert (
        f"XYPoints = 100, but {len(WHEEL.y)} points are there: all are taken"
        in reading.notes
    )


def test_cut_in_the_middle_of_a_line(fault):
    lines = [*head(XYPoints=400), "", *wheel_rows()[:-1], "133.1"]
    (message,) = fault(lines).splitlines()
    assert message.startswith(
        f"w.whl:{len(lines)}: number of columns (separated by blanks) = 1 must be at "
        "least 2"
    )
    assert "the file is cut off" in message


def test_text_among_the_points(fault):
    lines = [*head(), "", *wheel_rows()]
    lines[8], lines[12] = "Gauge=1435", "12.0 nan"
    message = fault(lines).splitlines()
    assert message[0].startswith("w.whl:9: ")
    assert message[1] == (
        "w.whl:13: Y = 'nan' is not a finite number; delete the line or repeat the "
        "measurement"
    )


def test_steps_back_of_the_instrument_are_left_out_and_told(read):
    points = wheel_rows()
    x, y = map(float, points[60].split())
    points.insert(61, f"{x - 0.3:.4f} {y:.4f}")
    reading = read([*head(), "", *points])
    assert_is_wheel(reading)
    assert "points stepping back left out: line 65" in reading.notes


def test_duplicates_are_left_out_and_counted(read):
    points = wheel_rows()
    reading = read([*head(), "", *points[:40], points[39], points[39], *points[40:]])
    assert_is_wheel(reading)
    assert "duplicate points left out: 2" in reading.notes


def rail_rows(sign_x=1, up=1, keep=slice(None)):
    return rows(sign_x * 1e3 * RAIL.y[keep], -up * 1e3 * RAIL.z[keep])


@pytest.mark.parametrize("up", [1, -1])
@pytest.mark.parametrize("side", [1, -1])
def test_rail_whose_gauge_side_is_told_by_its_depth(read, side, up):
    reading = read([*head(), "", *rail_rows(side, up, SHORT)], "r.ban", "rail")
    assert np.max(np.abs(reading.profile.y - RAIL.y[SHORT])) < ROUNDING
    assert np.max(np.abs(reading.profile.z - RAIL.z[SHORT])) < ROUNDING
    end = "smaller" if side == 1 else "larger"
    assert (
        f"gauge side at the end of {end} y: only there the head reaches 14 mm down"
        in reading.notes
    )
    assert ("z up, sign changed" in reading.notes) == (up == 1)


def test_roller_measured_with_a_jump_along_its_side(read, fault):
    """As in a published measurement of a roller: a few points far down the side, then
    12 mm without any.
    """
    x, z = 1e3 * RAIL.y[SHORT], 1e3 * RAIL.z[SHORT]
    start = np.argmax(z < 17.0)
    side = [f"{x[0] - 0.01 * k:.4f} {-31.2 + 0.3 * k:.4f}" for k in range(2)]
    points = rows(np.repeat(x[start:], 2)[:-1], -np.repeat(z[start:], 2)[:-1])
    reading = read([*head(), *side, *points], "r.ban", "rail")
    assert reading.profile.z.max() == pytest.approx(31.2e-3, abs=1e-9)
    hole = [*head(), *points[:60], *points[80:]]
    assert "without a point before point" in fault(hole, "r.ban", "rail")


def test_rail_whose_gauge_side_is_not_known_is_refused_with_the_flag(read, fault):
    lines = [*head(), "", *rail_rows()]
    assert fault(lines, "r.ban", "rail") == (
        "r.ban: both sides of the head could be the gauge side: state --mirror (gauge "
        "side at the end of larger y) or --no-mirror (at the end of smaller y)"
    )
    for mirror, sign in ((False, 1), (True, -1)):
        reading = read(lines, "r.ban", "rail", mirror=mirror)
        assert (
            np.max(np.abs(np.sort(sign * reading.profile.y) - np.sort(RAIL.y)))
            < ROUNDING
        )


def test_wheel_extension_for_a_rail(fault):
    output = fault([*head(), "", *wheel_rows()], "w.whl", "rail")
    assert "w.whl: .whl is a wheel, a rail profile is needed" in output


@pytest.mark.parametrize("value", ["66.0000", "73,0", "920.5", "73 mm"])
def test_another_running_circle_of_the_header_is_not_used_and_told(read, value):
    reading = read(
        [
            *head(WheelDiameterTaperline=value, DiameterTaperline="900"),
            "",
            *wheel_rows(),
        ]
    )
    (note,) = (note for note in reading.notes if "WheelDiameterTaperline" in note)
    assert note.endswith("of the header is not used: it is 70 mm here")
    assert reading.diameter is None
    assert_is_wheel(reading)


@pytest.mark.parametrize("value", ["0", "0.0000", "", "-", "70.0000"])
def test_a_running_circle_that_is_usual_or_not_set_is_not_told(read, value):
    reading = read([*head(WheelDiameterTaperline=value), "", *wheel_rows()])
    assert not any("WheelDiameterTaperline" in note for note in reading.notes)
