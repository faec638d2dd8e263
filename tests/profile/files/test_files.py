import re

import numpy as np
import pytest

from wearsim.errors import ProfileError, ResultError
from wearsim.profile.checks import points_faults
from wearsim.profile.files import load_profile, read_profile, write_profile
from wearsim.profile.shape import Profile
from wearsim.profile.standard import rail, wheel

TWO = "must be two: y and z, apart by blanks, semicolons, or commas with decimal points"
WHEEL = wheel("S1002", spacing=1e-3)
RAIL = rail("60E1", 1 / 40, 1.435, 0.750, spacing=1e-3)


def read_two_column(path, kind, units="mm"):
    """Points whose axes and units are all stated, so that nothing is detected."""
    stated = {
        "mirror": False,
        "z_up": False,
        "origin": "running_circle" if kind == "wheel" else None,
    }
    return read_profile(path, kind, format="two-column", units=units, **stated).profile


def text(profile=WHEEL, line="{y},{z}", scale=1e3, digits=4):
    rows = zip(
        np.round(profile.y * scale, digits),
        np.round(profile.z * scale, digits),
        strict=True,
    )
    return [line.format(y=y, z=z) for y, z in rows]


@pytest.fixture
def fault(tmp_path):
    """Write lines to a file, read it, and return the message."""

    def check(lines, kind="wheel", units="mm", encoding="utf-8"):
        path = tmp_path / "p.csv"
        path.write_bytes("\n".join(lines).encode(encoding))
        with pytest.raises(ProfileError) as caught:
            read_two_column(path, kind, units)
        message = str(caught.value)
        assert caught.value.exit_code == 2
        assert all(
            line.startswith((str(path), "and ")) for line in message.splitlines()
        )
        return message.replace(str(path), "p.csv")

    return check


@pytest.mark.parametrize(
    "line",
    [
        "{y},{z}",
        "{y}, {z}",
        "{y} , {z}",
        "{y} {z}",
        "  {y}   {z}  ",
        "{y}\t{z}",
        "{y}\t\t{z}",
        "{y};{z}",
        "{y} ; {z} # x",
    ],
)
@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
def test_separators_and_line_ends(tmp_path, line, ending):
    path = tmp_path / "w.txt"
    path.write_bytes((ending.join(text(line=line)) + ending).encode())
    profile = read_two_column(path, "wheel")
    assert np.max(np.abs(profile.y - np.round(WHEEL.y, 7))) < 1e-16
    assert np.max(np.abs(profile.z - np.round(WHEEL.z, 7))) < 1e-16


@pytest.mark.parametrize("line", ["{y} {z}", "{y}\t{z}", "{y};{z}"])
def test_decimal_commas(tmp_path, line):
    path = tmp_path / "w.txt"
    path.write_text("\n".join(row.replace(".", ",") for row in text(line=line)))
    assert (
        np.max(np.abs(read_two_column(path, "wheel").z - np.round(WHEEL.z, 7))) < 1e-16
    )


@pytest.mark.parametrize(
    "before",
    [
        ["y_mm,z_mm"],
        ["# a", "", "% b", "! c", "Y Z"],
        ["\ufeff# marked", "y;z"],
        ["", "x [mm]\ty [mm]"],
    ],
)
def test_comments_and_one_header_line(tmp_path, before):
    path = tmp_path / "w.txt"
    path.write_text("\n".join([*before, *text()]), encoding="utf-8")
    assert len(read_two_column(path, "wheel").y) == len(WHEEL.y)


def test_metres_and_exponents(tmp_path):
    path = tmp_path / "w.txt"
    path.write_text(
        "\n".join(f"{y:.9e} {z:+.9E}" for y, z in zip(WHEEL.y, WHEEL.z, strict=True))
    )
    assert read_two_column(path, "wheel", units="m").y == pytest.approx(
        WHEEL.y, abs=1e-11
    )


def test_points_from_field_side_to_flange_are_reversed(tmp_path):
    path = tmp_path / "w.txt"
    path.write_text("\n".join(reversed(text())))
    profile = read_two_column(path, "wheel")
    assert profile.y[0] == -0.070
    assert profile.y[-1] == 0.065


def test_points_at_rest_are_left_out(tmp_path):
    path, lines = tmp_path / "w.txt", text()
    path.write_text("\n".join([*lines[:50], lines[49], *lines[50:]]))
    assert len(read_two_column(path, "wheel").y) == len(WHEEL.y)


@pytest.mark.parametrize("profile", [WHEEL, RAIL, wheel("S1002", 0.1e-3)])
def test_round_trip_gives_the_same_bits(tmp_path, profile):
    path = tmp_path / "p.csv"
    write_profile(profile, path)
    back = read_two_column(path, profile.kind)
    assert np.array_equal(back.y, profile.y)
    assert np.array_equal(back.z, profile.z)


def test_nothing_is_overwritten_or_left_half_written(tmp_path):
    path = tmp_path / "p.csv"
    path.write_text("mine")
    with pytest.raises(ProfileError, match=r"p\.csv: exists already"):
        write_profile(WHEEL, path)
    assert path.read_text() == "mine"
    with pytest.raises(ResultError, match=r"cannot be written"):
        write_profile(WHEEL, tmp_path / "none" / "p.csv")
    write_profile(WHEEL, path, overwrite=True)
    assert [entry.name for entry in tmp_path.iterdir()] == ["p.csv"]


def test_all_faults_of_the_numbers_are_told_with_their_lines(fault):
    lines = text()
    lines[3], lines[7], lines[9], lines[11] = "nan,1", "1,2,3", "-66,x2", "-65,"
    assert fault(lines).splitlines() == [
        (
            "p.csv:4: y = 'nan' is not a finite number; delete the line or repeat the "
            "measurement"
        ),
        f"p.csv:8: number of columns (separated by commas) = 3 {TWO}",
        "p.csv:10: z = 'x2' is not a number",
        "p.csv:12: z = '' is missing",
    ]


@pytest.mark.parametrize("word", ["nan", "NaN", "-inf", "Infinity", "1.#QNAN"])
def test_what_is_not_finite_is_refused(fault, word):
    lines = ["# head", *text()]
    lines[20] = f"-60.0,{word}"
    # `#` begins a comment, so what is left of 1.#QNAN is a plain 1, off its neighbours
    # by 25 mm
    assert fault(lines).startswith("p.csv:21: ")


def test_a_hopeless_file_does_not_flood_the_screen(fault):
    message = fault([f"{k}{',1' * (k % 40)}" for k in range(2, 500)]).splitlines()
    assert len(message) == 21
    assert message[-1] == "and 19 more faults that are not shown"


@pytest.mark.parametrize("lines", [[], ["# nothing"], ["y,z"], text()[:19]])
def test_too_few_points(fault, lines):
    assert re.search(
        r"p\.csv: number of points = \d+ is too few for a profile; give at least 20",
        fault(lines),
    )


def test_whole_file_in_other_units(fault):
    assert "1000 times as large: state them with --units" in fault(
        text(scale=1.0, digits=7)
    )
    assert "1000 times as small: state them with --units" in fault(text(), units="m")
    assert "25.4 times as large (inches)" in fault(text(scale=1e3 / 25.4, digits=6))


def test_unknown_units(fault):
    assert (
        fault(text(), units="ft") == "p.csv: units = 'ft' is not one of mm, m, cm, in"
    )


@pytest.mark.parametrize(
    "rows", [slice(30, 31), slice(30, 33), slice(0, 60), slice(100, None)]
)
def test_mixed_units_are_refused(fault, rows):
    lines, metres = text(), text(scale=1.0, digits=7)
    lines[rows] = metres[rows]
    assert len(fault(lines).splitlines()) == 1


def test_mixed_units_of_the_columns(fault):
    lines = [f"{y * 1e3:.4f},{z:.7f}" for y, z in zip(WHEEL.y, WHEEL.z, strict=True)]
    assert (
        "high, which is not within 15 .. 150 mm; it would fit if the numbers were 1000"
        in fault(lines)
    )


def test_a_wild_point_is_named(fault):
    lines = text()
    lines[90] = lines[90].split(",")[0] + ",9.0"
    assert re.match(r"p\.csv:91: point 91 lies .* mm off both neighbours", fault(lines))


def test_order_of_the_points(fault):
    lines = text()
    lines[40], lines[41] = lines[41], lines[40]
    assert (
        "p.csv:41: the points turn back at point 41 (and at 1 more); list them"
        in fault(lines)
    )
    shuffled = [text()[k] for k in np.random.default_rng(0).permutation(len(lines))]
    assert "list them in their order along the profile" in fault(shuffled)
    closed = fault([*text(), text()[0]])
    assert "mm without a point before point" in closed


def test_a_hole_in_the_profile_is_named(fault):
    lines = text()
    message = fault(lines[:80] + lines[95:])
    assert re.match(
        r"p\.csv:81: 1\d(\.\d+)? mm without a point before point 81", message
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda y, z: (-y, z), "change the sign of y"),
        (lambda y, z: (y, -z), "change the sign of z"),
        (lambda y, z: (y + 70.0, z), "subtract 70 mm from y"),
        (lambda y, z: (y + 40.0, z), "state the origin gauge_point, or offsets"),
        (lambda y, z: (y - 40.0, z), "y counts from the running circle"),
        (
            lambda y, z: (y, z + 20.0),
            "z counts from the running circle of the new wheel",
        ),
        (
            lambda y, z: (y[y < 15.0], z[y < 15.0]),
            "the tread is needed up to 20 mm at least",
        ),
    ],
)
def test_wheels_in_other_axes_are_refused_with_the_way_out(fault, change, message):
    y, z = change(np.round(WHEEL.y * 1e3, 4), np.round(WHEEL.z * 1e3, 4))
    assert message in fault([f"{a},{b}" for a, b in zip(y, z, strict=True)])


def test_a_rail_upside_down_is_refused(fault):
    lines = [
        f"{y * 1e3:.4f} {-z * 1e3:.4f}" for y, z in zip(RAIL.y, RAIL.z, strict=True)
    ]
    assert "change the sign of z" in fault(lines, kind="rail")


def test_files_that_are_no_text(fault, tmp_path):
    assert fault([*text()[:5], "ä,1"], encoding="latin-1").startswith(
        "p.csv:6: y = 'ä' is not a number"
    )
    huge = tmp_path / "huge.csv"
    with huge.open("wb") as file:
        file.truncate(20_000_001)
    with pytest.raises(ProfileError, match=r"larger than 20 MB"):
        read_two_column(huge, "wheel")


def test_missing_files_and_folders(tmp_path):
    with pytest.raises(ProfileError, match=r"none\.csv: does not exist"):
        read_two_column(tmp_path / "none.csv", "wheel")
    with pytest.raises(ProfileError, match=r"is no regular file"):
        read_two_column(tmp_path, "wheel")


def test_load_profile_by_name_or_file(tmp_path):
    path = tmp_path / "head.csv"
    write_profile(rail("60E1", 0.0, 1.5, 0.7), path)
    from_file = load_profile(path, "rail", inclination=1 / 40)
    by_name = load_profile("60E1", "rail", inclination=1 / 40)
    # gauge and top are found on chords of 0.25 mm, to 0.001 um
    assert from_file.y == pytest.approx(by_name.y, abs=1e-9)
    assert from_file.z == pytest.approx(by_name.z, abs=1e-9)
    assert from_file.source == "file head.csv (head stands upright)"
    assert np.array_equal(load_profile("S1002", "wheel", spacing=1e-3).y, WHEEL.y)


def test_load_profile_names_the_file_of_a_rail_that_cannot_be_placed(tmp_path):
    path = tmp_path / "head.csv"
    keep = RAIL.z < 10e-3
    write_profile(Profile("short", "rail", RAIL.y[keep], RAIL.z[keep]), path)
    with pytest.raises(
        ProfileError, match=r"head\.csv: the gauge side of the rail head reaches"
    ):
        load_profile(path, "rail")


def test_points_of_what_is_shipped_have_no_faults_and_nan_is_one():
    assert (
        points_faults("wheel", WHEEL.y, WHEEL.z)
        == points_faults("rail", RAIL.y, RAIL.z)
        == []
    )
    z = WHEEL.z.copy()
    z[4] = np.nan
    assert points_faults("wheel", WHEEL.y, z)[0][0].startswith("point 5 is not finite")
    assert points_faults("wheel", WHEEL.y, WHEEL.z[1:])[0][0].startswith(
        "y and z must be two lists of equal length"
    )
