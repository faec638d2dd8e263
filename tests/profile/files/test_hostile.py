"""Damaged and hostile files: one clear line per fault, bounded time and memory.

Generated ones: `tests/siege/siege_profiles.py`.
"""

import os
import tracemalloc

import numpy as np
import pytest
from siege_profiles import wheel_and_rail

from wearsim.errors import ProfileError
from wearsim.profile.files import read_profile, write_profile
from wearsim.profile.standard import wheel

TWO = "must be two: y and z, apart by blanks, semicolons, or commas with decimal points"
WHEEL, RAIL = wheel_and_rail()


def test_file_of_100_mb_is_refused_without_reading_all_of_it(tmp_path):
    path = tmp_path / "huge.whl"
    with path.open("wb") as file:
        file.truncate(100_000_000)
    tracemalloc.start()
    try:
        with pytest.raises(
            ProfileError, match=r"huge\.whl: larger than 20 MB, hardly one profile"
        ):
            read_profile(path, "wheel")
        largest = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert largest < 50_000_000


def test_what_is_no_file(tmp_path):
    with pytest.raises(ProfileError, match=r"none\.whl: does not exist"):
        read_profile(tmp_path / "none.whl", "wheel")
    with pytest.raises(ProfileError, match=r"is no regular file"):
        read_profile(tmp_path, "wheel")
    os.mkfifo(tmp_path / "pipe.whl")
    with pytest.raises(ProfileError, match=r"is no regular file"):
        read_profile(tmp_path / "pipe.whl", "wheel")


def fault(path, data, kind="wheel"):
    path.write_bytes(data)
    with pytest.raises(ProfileError) as caught:
        read_profile(path, kind)
    return str(caught.value).replace(f"{path.parent}/", "")


def test_lines_and_numbers_without_end(tmp_path):
    path = tmp_path / "p.csv"
    output = fault(path, b"# x\n" + b"1 " * 200_000)
    assert output == f"p.csv:2: number of columns (separated by blanks) = 200000 {TWO}"
    assert "is longer than 1000 characters" in fault(path, b"9" * 5000 + b" 1\n")
    assert "is too large for a profile" in fault(path, b"1e400 1\n")


def test_a_hopeless_file_stops_early(tmp_path):
    output = fault(tmp_path / "p.csv", b"1,a,b\n" * 1_000_000)
    assert output.startswith(
        "p.csv:1: number of columns (separated by commas) = 3 must be two"
    )
    assert output.endswith("(and 999 more lines)")


def text(profile=WHEEL, digits=4):
    return [
        f"{y:.{digits}f} {z:.{digits}f}"
        for y, z in zip(1e3 * profile.y, 1e3 * profile.z, strict=True)
    ]


def test_one_point_and_none(tmp_path):
    path = tmp_path / "p.csv"
    assert (
        fault(path, b"1 2\n")
        == "p.csv: number of points = 1 is too few for a profile; give at least 20"
    )
    assert (
        fault(path, b"")
        == "p.csv: number of points = 0 is too few for a profile; give at least 20"
    )
    assert (
        fault(tmp_path / "p.whl", b"")
        == "p.whl: number of points = 0 is too few for a profile; give at least 20"
    )


@pytest.mark.parametrize("kind", ["wheel", "rail"])
def test_two_profiles_joined_name_the_line_of_the_second(tmp_path, kind):
    lines = text(WHEEL if kind == "wheel" else RAIL)
    output = fault(tmp_path / "p.csv", "\n".join([*lines, *lines]).encode(), kind)
    assert output.startswith(f"p.csv:{len(lines) + 1}: ")
    assert "mm without a point" in output


def test_left_and_right_wheel_in_one_file(tmp_path):
    left = [f"{-float(a):.4f} {b}" for a, b in (line.split() for line in text()[::-1])]
    moved = [
        f"{float(a) + 1500.0:.4f} {b}" for a, b in (line.split() for line in text())
    ]
    output = fault(tmp_path / "p.csv", "\n".join([*left, *moved]).encode())
    assert output.startswith("p.csv: the wheel profile is 1630 mm wide")


def test_left_wheel_that_goes_on_as_the_right_one(tmp_path):
    right = text()
    left = [f"{-float(a):.4f} {b}" for a, b in (line.split() for line in right)]
    # from the flange back of the left to that of the right: the list turns at the field
    # side
    for lines in ([*right, *right[-2::-1]], [*left, *right[::-1]]):
        output = fault(tmp_path / "p.csv", "\n".join(lines).encode())
        assert (
            "without a point" in output
            or "list them in their order along the profile" in output
        )
        assert len(output.splitlines()) == 1


def test_two_files_joined_name_the_line_of_the_second_header(tmp_path):
    for name in ("miniprof", "two-column"):
        path = tmp_path / ("w.whl" if name == "miniprof" else "w.csv")
        write_profile(WHEEL, path, name)
        content = (
            path.read_text()
            if name == "miniprof"
            else "\n".join(["y;z", *text()]).replace(" ", ";")
        )
        content = content.rstrip() + "\n"
        second = content.count("\n") + 1
        output = fault(path, (content * 2).encode())
        wrong = (
            "number of columns (separated by blanks) = 1 must be at least 2"
            if name == "miniprof"
            else "y = 'y' is not a number"
        )
        assert output.startswith(f"{path.name}:{second}: {wrong}")


def test_one_nan_does_not_cut_a_file_off(tmp_path):
    path = tmp_path / "w.whl"
    lines = ["ProgramVer=1", "MPTypeNo=1", f"XYPoints={len(WHEEL.y)}", "", *text()]
    lines[30] = "1.0 NaN"
    output = fault(path, "\n".join(lines).encode())
    assert output == (
        "w.whl:31: Y = 'NaN' is not a finite number; delete the line or repeat "
        "the measurement"
    )


def test_many_faults_of_one_kind_are_one_line(tmp_path):
    path = tmp_path / "p.csv"
    output = fault(path, "\n".join(f"{line} 0.1" for line in text()).encode())
    more = len(text()) - 1
    columns = f"number of columns (separated by blanks) = 3 {TWO}"
    assert output == f"p.csv:1: {columns} (and {more} more lines)"
    output = fault(path, "\n".join(line.split()[0] + " x" for line in text()).encode())
    assert output == f"p.csv:1: z = 'x' is not a number (and {more} more lines)"


def test_commas_for_two_things(tmp_path):
    output = fault(
        tmp_path / "p.csv",
        "\n".join(text()).replace(".", ",").replace(" ", ",").encode(),
    )
    assert (
        "must be two: y and z, apart by blanks, semicolons, or commas with "
        "decimal points"
    ) in output
    assert len(output.splitlines()) == 1


def test_not_finite(tmp_path):
    lines = text()
    lines[30], lines[40] = "nan 1", "2 -inf"
    output = fault(tmp_path / "p.csv", "\n".join(lines).encode()).splitlines()
    assert [line.split(": ")[0] for line in output] == ["p.csv:31", "p.csv:41"]


def test_encodings_that_are_wrong(tmp_path):
    path = tmp_path / "p.csv"
    path.write_bytes("\n".join(text()).encode("utf-16-le"))
    assert "text is not UTF-8: read as UTF-16-LE" in read_profile(path, "wheel").notes
    assert "the control character" in fault(path, b"\xff\xfe1\x00\x00\xd8")
    assert "the control character '\\x07'" in fault(path, b"\x07 1\n")
    lines = [*text()[:30], "\xe4 1", *text()[30:]]
    output = fault(path, "\n".join(lines).encode("latin-1"))
    assert output == "p.csv:31: y = 'ä' is not a number"


@pytest.mark.slow
@pytest.mark.parametrize("n", [200_000, 1_000_000])
def test_a_million_points(tmp_path, n):
    """Even points of it keep the shape."""
    at = np.linspace(0, len(WHEEL.y) - 1, n)
    y, z = (
        np.interp(at, np.arange(len(WHEEL.y)), 1e3 * each)
        for each in (WHEEL.y, WHEEL.z)
    )
    path = tmp_path / "p.csv"
    path.write_text("\n".join(f"{a:.4f} {b:.4f}" for a, b in zip(y, z, strict=True)))
    reading = read_profile(path, "wheel")
    profile = reading.profile
    assert len(profile.y) == 20_000
    assert any("points taken, evenly" in note for note in reading.notes)
    tread = (WHEEL.y > -0.03) & (WHEEL.y < 0.059)
    off = np.interp(WHEEL.y[tread], profile.y, profile.z) - WHEEL.z[tread]
    assert np.max(np.abs(off)) < 0.2e-6  # chords of 8 um, and the fourth decimals


def test_more_points_than_are_read(tmp_path, monkeypatch):
    monkeypatch.setattr("wearsim.profile.files.points.MAX_POINTS", 100)
    output = fault(tmp_path / "p.csv", "\n".join(text()).encode())
    assert (
        output
        == "p.csv:101: more than 100 points, hardly one profile; give one cross-section"
    )


def test_a_file_that_ends_within_a_line_is_cut_off(tmp_path):
    """One reason, whether or not the header tells the number of points; a line that is
    there is no end.
    """
    rows = text()
    keys = ["ProgramVer=2.4", "MPTypeNo=101"]
    lines = [*keys, "", *rows[:100], "12.3"]
    short = (
        "number of columns (separated by blanks) = 1 must be at least 2 to hold X and Y"
    )
    expected = f"w.whl:104: {short}: the file is cut off; copy it again"
    assert fault(tmp_path / "w.whl", "\n".join(lines).encode()) == expected
    lines = [*keys, f"XYPoints={len(rows)}", "", *rows[:100], "12.3", ""]
    output = fault(tmp_path / "w.whl", "\n".join(lines).encode())
    assert output == expected.replace("104", "105")
    lines = [*keys, "", *rows[:100], "12.3", *rows[100:]]
    assert fault(tmp_path / "w.whl", "\n".join(lines).encode()) == f"w.whl:104: {short}"


def test_more_lines_than_are_read(tmp_path, monkeypatch):
    """Counted before any is looked at, whatever ends them."""
    monkeypatch.setattr("wearsim.profile.files.points.MAX_LINES", 100)
    expected = "p.csv: more than 100 lines, hardly one profile; give one cross-section"
    for end in ("\n", "\r", "\r\n"):
        assert fault(tmp_path / "p.csv", end.join(text()).encode()) == expected
    assert read_profile(
        write(tmp_path / "short.csv", text(wheel("S1002", spacing=2e-3))), "wheel"
    )


def write(path, rows):
    path.write_text("\n".join(rows))
    return path
