"""GENSYS, UIC 519 tables, plain CSV; units, orientation and origin of any of them."""

import numpy as np
import pytest

from wearsim.errors import ProfileError
from wearsim.profile.files import load_profile, write_profile
from wearsim.profile.standard import rail, wheel

WHEEL = wheel("S1002", spacing=1e-3)
RAIL = rail("60E1", 1 / 40, 1.435, 0.750, spacing=1e-3)
ROUNDING = 0.51e-7  # of points written with four decimals of a mm [m]
SHAPES = {"wheel": WHEEL, "rail": RAIL}


def rows(y, z, line="{y:.4f} {z:.4f}"):
    return [line.format(y=a, z=b) for a, b in zip(y, z, strict=True)]


def ours(kind, line="{y:.4f} {z:.4f}"):
    return rows(1e3 * SHAPES[kind].y, 1e3 * SHAPES[kind].z, line)


def assert_is(reading, profile, tolerance=ROUNDING):
    assert np.max(np.abs(reading.profile.y - profile.y)) < tolerance
    assert np.max(np.abs(reading.profile.z - profile.z)) < tolerance


# ---- GENSYS


def test_gensys_wheel(read):
    """From the field side to the flange, y towards the track centre, comments also
    behind numbers.
    """
    lines = [
        "# nominal S1002",
        "#BP 101204",
        *rows(-1e3 * WHEEL.y, 1e3 * WHEEL.z, "  {y:.5f}   {z:.5f}")[::-1],
    ]
    lines[9] += "  # tread"
    reading = read(lines, "wheel", "S1002.wheel")
    assert reading.format == "gensys"
    assert_is(reading, WHEEL)
    assert "flange at the end of larger y, y mirrored" in reading.notes
    assert reading.header["comment"] == "nominal S1002"


def test_gensys_wheel_with_a_drawn_corner(read):
    """Rim face and chamfer of two points each, as in the published S1002.wheel."""
    inner = WHEEL.y <= 60e-3
    corner = ["-65.0 -20.0", "-65.0 -7.63568", "-61.0 -3.63568"]
    reading = read(
        [*corner, *rows(-1e3 * WHEEL.y[inner], 1e3 * WHEEL.z[inner])[::-1]],
        "wheel",
        "w.wheel",
    )
    assert reading.profile.z[-1] == -20e-3


def test_gensys_rail(read):
    lines = rows(-1e3 * RAIL.y - 32.5, 1e3 * RAIL.z)
    reading = read(lines, "rail", "uic60.rail")
    assert np.max(np.abs(reading.profile.y - (RAIL.y + 0.0325))) < ROUNDING
    assert "y towards the track centre, sign changed" in reading.notes


def test_switches_of_gensys_users(read):
    """YAXIS and ZAXIS of their files vary: the statements overrule the rule of the
    format.
    """
    reading = read(rows(1e3 * RAIL.y, -1e3 * RAIL.z), "rail", "r.rail", mirror=False)
    assert_is(reading, RAIL)
    assert "y not mirrored, as stated" in reading.notes


def test_gensys_extension_of_the_other_kind(fault):
    assert "w.wheel: .wheel is a wheel, a rail profile is needed" in fault(
        ours("rail"), "rail", "w.wheel"
    )
    assert "r.kpf_rotr: .kpf_rotr is a rail" in fault(
        ours("wheel"), "wheel", "r.kpf_rotr"
    )


# ---- tables of UIC 519 and EN 15302


@pytest.mark.parametrize("line", ["  {y:.5f}   {z:.5f}", "{y:.5f}\t{z:.5f}"])
@pytest.mark.parametrize("kind", ["wheel", "rail"])
def test_uic_table(read, tmp_path, kind, line):
    """Both with z up; the last line has no end."""
    profile = SHAPES[kind]
    lines = rows(1e3 * profile.y, -1e3 * profile.z, line)
    lines[50] = lines[50].replace("\t", " ")  # published tables mix blanks and tabs
    reading = read(lines, kind, "T.dat")
    assert reading.format == "uic519"
    assert not (tmp_path / "T.dat").read_text().endswith("\n")
    assert_is(reading, profile)
    assert "z up, sign changed" in reading.notes


# ---- plain CSV


@pytest.mark.parametrize("before", [[], [""], ["y,z"], ["", "y [mm],z [mm]"]])
@pytest.mark.parametrize(
    "line", ["{y:.6e},{z:.6e}", "{y:.4f};{z:.4f}", "{y:.4f}\t{z:.4f}"]
)
def test_plain_csv(read, before, line):
    reading = read([*before, *ours("wheel", line)], name="fr.csv")
    assert reading.format == "two-column"
    assert_is(reading, WHEEL)
    semicolons = ("columns separated by semicolons",) if ";" in line else ()
    assert reading.notes == ("format two columns", *semicolons)


def test_decimal_commas(read):
    assert_is(
        read([row.replace(".", ",") for row in ours("wheel", "{y:.4f};{z:.4f}")]), WHEEL
    )


# ---- what the user states


def test_stated_format(read, fault):
    assert read(ours("wheel"), name="p.prw", format="two-column").format == "two-column"
    assert fault(ours("wheel"), format="minprof") == (
        "p.txt: format = 'minprof' is not one of simpack, miniprof, gensys, uic519, "
        "two-column; did you mean 'miniprof'?"
    )


@pytest.mark.parametrize(("key", "value"), [("units", "furlong"), ("origin", "left")])
def test_unknown_statements(fault, key, value):
    assert f"p.txt: {key} = {value!r} is not one of " in fault(
        ours("wheel"), **{key: value}
    )


# ---- units


@pytest.mark.parametrize("kind", ["wheel", "rail"])
@pytest.mark.parametrize(("unit", "length"), [("m", 1.0), ("in", 0.0254), ("cm", 0.01)])
def test_units_by_size_or_statement(read, fault, kind, unit, length):
    profile = SHAPES[kind]
    lines = rows(profile.y / length, profile.z / length, "{y:.7f} {z:.7f}")
    assert_is(read(lines, kind, units=unit), profile)
    if unit == "cm":
        assert "10 times as large (cm)" in fault(lines, kind)
    else:
        assert f"units {unit} by the size" in read(lines, kind).notes


def test_wrong_units_are_refused_with_the_flag(fault):
    assert "state them with --units" in fault(ours("wheel"), units="m")


def test_exact_inches(read):
    """One inch is 25.4 mm exactly, and the product is rounded once."""
    lines = rows(WHEEL.y / 0.0254, WHEEL.z / 0.0254, "{y:.4f} {z:.4f}")
    y = read(lines, units="in").profile.y
    assert all(
        value == float(f"{int(row.split()[0].replace('.', '')) * 254}e-8")
        for row, value in zip(lines, y, strict=True)
    )


# ---- orientation and origin


@pytest.mark.parametrize("back", [0.0, 70.0])
@pytest.mark.parametrize("up", [1, -1])
@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("order", [1, -1])
def test_every_wheel_axis_is_detected(read, side, up, back, order):
    reading = read(rows(side * (1e3 * WHEEL.y + back), up * 1e3 * WHEEL.z)[::order])
    assert_is(reading, WHEEL)
    assert ("z up, sign changed" in reading.notes) == (up == -1)
    assert ("flange at the end of larger y, y mirrored" in reading.notes) == (
        side == -1
    )
    assert ("y counted from the flange back, 70 mm subtracted" in reading.notes) == (
        back == 70.0
    )
    assert ("points listed from the field side, order reversed" in reading.notes) == (
        order == -1
    )


def test_vertical_flange_back_and_rim_keep_their_place(read):
    """Points are never sorted by y: a scan may go down the flange back and the rim
    face.
    """
    y = 1e3 * np.concatenate(
        (np.full(15, WHEEL.y[0]), WHEEL.y, np.full(10, WHEEL.y[-1]))
    )
    down = np.linspace(-10.0, 9.0, 15)
    z = np.concatenate((down, 1e3 * WHEEL.z, 1e3 * WHEEL.z[-1] - np.arange(1.0, 11.0)))
    reading = read(rows(y, z))
    assert np.max(np.abs(reading.profile.z - 1e-3 * z)) < ROUNDING
    assert np.max(np.abs(reading.profile.y - 1e-3 * y)) < ROUNDING


def test_stated_origin(read, fault):
    assert_is(
        read(rows(1e3 * WHEEL.y + 70.0, 1e3 * WHEEL.z), origin="flange_back"), WHEEL
    )
    output = fault(rows(1e3 * WHEEL.y + 70.0, 1e3 * WHEEL.z), origin="running_circle")
    assert "subtract 70 mm from y" in output


def test_wheel_without_a_flange_tip(fault):
    tread = WHEEL.y > -0.0365
    output = fault(rows(1e3 * WHEEL.y[tread], 1e3 * WHEEL.z[tread]))
    assert output == (
        "p.txt: a flange tip stands out on neither side, so the sign of z is not "
        "known: state --z-up or --z-down"
    )


@pytest.mark.parametrize("up", [1, -1])
@pytest.mark.parametrize("side", [1, -1])
def test_wheel_measured_from_the_flange_tip_on(read, side, up):
    seen = WHEEL.y >= -0.055
    reading = read(rows(side * 1e3 * WHEEL.y[seen], up * 1e3 * WHEEL.z[seen]))
    assert np.max(np.abs(reading.profile.y - WHEEL.y[seen])) < ROUNDING
    assert np.max(np.abs(reading.profile.z - WHEEL.z[seen])) < ROUNDING


def test_wheel_with_the_tip_in_its_middle(fault):
    inner = WHEEL.y < -0.04
    tread_missing = rows(4e3 * (WHEEL.y[inner] + 0.055), 1e3 * WHEEL.z[inner])
    assert "state --mirror (flange at the end of larger y) or --no-mirror" in fault(
        tread_missing
    )


def test_rail_against_the_rule_of_its_format_is_refused_in_the_track(read, tmp_path):
    """Plain columns should grow to the field side, but only the end of larger y can be
    the gauge side.
    """
    short = (RAIL.z < 20e-3) & ((RAIL.y < 0.01) | (RAIL.z < 9e-3))
    lines = rows(-1e3 * RAIL.y[short], 1e3 * RAIL.z[short])
    (tmp_path / "r.csv").write_text("\n".join(lines))
    with pytest.raises(ProfileError, match="the gauge side of the rail head reaches"):
        load_profile(tmp_path / "r.csv", "rail")
    reading = read(lines, "rail", mirror=True)
    assert np.max(np.abs(reading.profile.y - RAIL.y[short])) < ROUNDING


@pytest.mark.parametrize("z_up", [None, True])
def test_rail_with_z_up(read, z_up):
    assert_is(read(rows(1e3 * RAIL.y, -1e3 * RAIL.z), "rail", z_up=z_up), RAIL)


def test_half_head_by_its_only_flank(read):
    half = RAIL.y < RAIL.y[np.argmin(RAIL.z)] + 2e-3
    reading = read(rows(1e3 * RAIL.y[half], 1e3 * RAIL.z[half]), "rail")
    assert np.max(np.abs(reading.profile.y - RAIL.y[half])) < ROUNDING


def test_load_profile_takes_every_format_and_places_rails(tmp_path):
    path = tmp_path / "head.ban"
    upright = rail("60E1", 0.0, 1.5, 0.7)
    write_profile(upright, path, "miniprof")
    from_file = load_profile(path, "rail", inclination=1 / 40)
    by_name = load_profile("60E1", "rail", inclination=1 / 40)
    # gauge and top are found on chords of 0.25 mm, to 0.001 um
    assert from_file.y == pytest.approx(by_name.y, abs=1e-9)
    assert from_file.z == pytest.approx(by_name.z, abs=1e-9)
    assert (
        from_file.source
        == "file head.ban (format MiniProf; z up, sign changed; head stands upright)"
    )


def test_load_profile_does_not_tilt_a_head_that_leans_already(tmp_path):
    path = tmp_path / "head.ban"
    write_profile(RAIL, path, "miniprof")
    leaning, again = (
        load_profile(path, "rail", inclination=tilt) for tilt in (0.0, 1 / 40)
    )
    assert np.array_equal(leaning.z, again.z)


def test_simpack_file_in_metres_tells_so(read):
    points = rows(WHEEL.y, WHEEL.z, "{y:.7f} {z:.7f}")
    block = [
        "spline.begin",
        "units.len.f = 1",
        "point.begin",
        *points,
        "point.end",
        "spline.end",
    ]
    reading = read(block, name="w.prw")
    assert_is(reading, WHEEL)
    assert "applied: units.len.f = 1" in reading.notes
