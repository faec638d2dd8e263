"""CONTACT slices, GENSYS, UIC 519 tables, plain CSV; units, orientation and origin of any of them."""

import numpy as np
import pytest

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


# ---- CONTACT slices


def slices(names, method="1   S_METHOD (1=intpol, 2=approx)", features="0 0 0   NFEAT, NKINK, NACCEL"):
    return [
        "% a made-up crossing",
        "",
        "   0.000      1.0    S_OFFSET [m], S_SCALE [mm/mm]",
        f"   {len(names)}                NSLC",
        f"    {features}",
        f"    {method}",
        "! slices",
        *(f" {10.0 * k:.1f}    '{name}'   % remark" for k, name in enumerate(names)),
    ]


@pytest.fixture
def crossing(tmp_path):
    (tmp_path / "parts").mkdir()
    names = []
    for k in range(3):
        moved = type(RAIL)("r", "rail", RAIL.y + k * 1e-3, RAIL.z)
        names.append(f"parts/r{k + 1}.prr")
        write_profile(moved, tmp_path / names[-1], "simpack")
    return slices(names)


@pytest.mark.parametrize("name", ["c.slcs", "c.txt"])
@pytest.mark.parametrize("number", [1, 2, 3])
def test_one_slice(read, crossing, name, number):
    reading = read(crossing, "rail", name, slice=number)
    assert np.array_equal(reading.profile.y, RAIL.y + (number - 1) * 1e-3)
    assert reading.header["position"] == f"{10.0 * (number - 1):.1f}"
    assert reading.files[1].name == f"r{number}.prr"
    assert f"slice {number} of 3, at position {10.0 * (number - 1):.1f}: parts/r{number}.prr" in reading.notes


def test_several_slices_need_the_flag(fault, crossing):
    output = fault(crossing, "rail", "c.slcs")
    assert output == "c.slcs: lists 3 slices; choose one with --slice 1 .. 3"
    assert "c.slcs: --slice 4 must be in 1 .. 3" in fault(crossing, "rail", "c.slcs", slice=4)


def test_features_behind_the_slices_are_passed_over(read, crossing):
    lines = [*crossing, "-1  3   P_ACCEL", *(f" {10.0 * k}  0.0  33.0541  50.9" for k in range(3))]
    lines[4] = "3 0 2  NFEAT, NKINK, NACCEL"
    assert_is(read(lines, "rail", "c.slcs", slice=1), RAIL)


def test_wheel_slices_with_two_column_text(read, tmp_path):
    (tmp_path / "w.txt").write_text("\n".join(ours("wheel")))
    assert_is(read(slices(["w.txt"], "2 TH_METHOD"), "wheel", "c.slcw"), WHEEL)


def test_damaged_lists_of_slices(fault, crossing, tmp_path):
    cut = fault(crossing[:-1], "rail", "c.slcs", slice=1)
    place = f"c.slcs:{len(crossing) - 1}"
    assert cut.startswith(f"{place}: 3 slices are promised, 2 are listed with position and file name")
    crossing[3] = "many"
    assert "c.slcs:4: 1 number is needed here: the number of slices" in fault(crossing, "rail", "c.slcs")
    crossing[3] = "1e6"
    assert "must be a whole one in 1 .. 100000" in fault(crossing, "rail", "c.slcs")
    assert "c.slcs:2: ends before the number of slices" in fault(["0 1", ""], "rail", "c.slcs")
    missing = fault(slices(["none.prr"]), "rail", "c.slcs")
    assert (
        missing == "c.slcs:8: slice file 'none.prr' does not exist in the folder of the list; copy it there"
    )
    (tmp_path / "c.slcs").write_text("\n".join(slices(["c.slcs"])))
    assert "list of slices within a list" in fault(slices(["c.slcs"]), "rail", "c.slcs")


def test_kind_of_slices(fault, crossing):
    assert "c.slcw: .slcw is a wheel, a rail profile is needed" in fault(crossing, "rail", "c.slcw", slice=1)


def test_slice_of_a_file_that_is_none(fault):
    assert "--slice 2 is stated, but the file is no list of slices" in fault(ours("wheel"), slice=2)


# ---- GENSYS


def test_gensys_wheel(read):
    """From the field side to the flange, y towards the track centre, comments also behind numbers."""
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
    reading = read([*corner, *rows(-1e3 * WHEEL.y[inner], 1e3 * WHEEL.z[inner])[::-1]], "wheel", "w.wheel")
    assert reading.profile.z[-1] == -20e-3
    assert "straight piece of 12.4 mm without points near an end taken as it is" in reading.notes


def test_gensys_rail(read):
    lines = rows(-1e3 * RAIL.y - 32.5, 1e3 * RAIL.z)
    reading = read(lines, "rail", "uic60.rail")
    assert np.max(np.abs(reading.profile.y - (RAIL.y + 0.0325))) < ROUNDING
    assert "y towards the track centre, sign changed" in reading.notes


def test_switches_of_gensys_users(read):
    """YAXIS and ZAXIS of their files vary: the statements overrule the rule of the format."""
    reading = read(rows(1e3 * RAIL.y, -1e3 * RAIL.z), "rail", "r.rail", mirror=False)
    assert_is(reading, RAIL)
    assert "y not mirrored, as stated" in reading.notes


def test_gensys_extension_of_the_other_kind(fault):
    assert "w.wheel: .wheel is a wheel, a rail profile is needed" in fault(ours("rail"), "rail", "w.wheel")
    assert "r.kpf_rotr: .kpf_rotr is a rail" in fault(ours("wheel"), "wheel", "r.kpf_rotr")


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
@pytest.mark.parametrize("line", ["{y:.6e},{z:.6e}", "{y:.4f};{z:.4f}", "{y:.4f}\t{z:.4f}"])
def test_plain_csv(read, before, line):
    reading = read([*before, *ours("wheel", line)], name="fr.csv")
    assert reading.format == "two-column"
    assert_is(reading, WHEEL)
    assert reading.notes == ("format two columns",)


def test_decimal_commas(read):
    assert_is(read([row.replace(".", ",") for row in ours("wheel", "{y:.4f};{z:.4f}")]), WHEEL)


# ---- what the user states


def test_stated_format(read, fault):
    assert read(ours("wheel"), name="p.prw", format="two-column").format == "two-column"
    assert fault(ours("wheel"), format="minprof") == (
        "p.txt: format = 'minprof' is not one of simpack, miniprof-parts, miniprof, slices, gensys, uic519, "
        "two-column; did you mean 'miniprof'?"
    )


@pytest.mark.parametrize(("key", "value"), [("units", "furlong"), ("origin", "left")])
def test_unknown_statements(fault, key, value):
    assert f"p.txt: {key} = {value!r} is not one of " in fault(ours("wheel"), **{key: value})


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
    assert ("flange at the end of larger y, y mirrored" in reading.notes) == (side == -1)
    assert ("y counted from the flange back, 70 mm subtracted" in reading.notes) == (back == 70.0)
    assert ("points listed from the field side, order reversed" in reading.notes) == (order == -1)


def test_vertical_flange_back_and_rim_keep_their_place(read):
    """Points are never sorted by y: a scan may go down the flange back and the rim face."""
    y = 1e3 * np.concatenate((np.full(15, WHEEL.y[0]), WHEEL.y, np.full(10, WHEEL.y[-1])))
    down = np.linspace(-10.0, 9.0, 15)
    z = np.concatenate((down, 1e3 * WHEEL.z, 1e3 * WHEEL.z[-1] - np.arange(1.0, 11.0)))
    reading = read(rows(y, z))
    assert np.max(np.abs(reading.profile.z - 1e-3 * z)) < ROUNDING
    assert np.max(np.abs(reading.profile.y - 1e-3 * y)) < ROUNDING


def test_stated_origin(read, fault):
    assert_is(read(rows(1e3 * WHEEL.y + 70.0, 1e3 * WHEEL.z), origin="flange_back"), WHEEL)
    output = fault(rows(1e3 * WHEEL.y + 70.0, 1e3 * WHEEL.z), origin="running_circle")
    assert "subtract 70 mm from y" in output


def test_wheel_without_a_flange_tip(fault):
    tread = WHEEL.y > -0.0365
    output = fault(rows(1e3 * WHEEL.y[tread], 1e3 * WHEEL.z[tread]))
    assert output == (
        "p.txt: a flange tip stands out on neither side, so the sign of z is not known: state "
        "--z-up or --z-down"
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
    assert "state --mirror (flange at the end of larger y) or --no-mirror" in fault(tread_missing)


def test_rail_against_the_rule_of_its_format_is_refused(read, fault):
    """Plain columns should grow to the field side, but only the end of larger y can be the gauge side."""
    short = (RAIL.z < 20e-3) & ((RAIL.y < 0.01) | (RAIL.z < 9e-3))
    lines = rows(-1e3 * RAIL.y[short], 1e3 * RAIL.z[short])
    assert "is the one that does not reach 14 mm down: state --mirror" in fault(lines, "rail")
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
    assert from_file.source == "file head.ban (format MiniProf; z up, sign changed; head stands upright)"


def test_load_profile_does_not_tilt_a_head_that_leans_already(tmp_path):
    path = tmp_path / "head.ban"
    write_profile(RAIL, path, "miniprof")
    leaning, again = (load_profile(path, "rail", inclination=tilt) for tilt in (0.0, 1 / 40))
    assert np.array_equal(leaning.z, again.z)


def test_simpack_file_in_metres_tells_so(read):
    points = rows(WHEEL.y, WHEEL.z, "{y:.7f} {z:.7f}")
    block = ["spline.begin", "units.len.f = 1", "point.begin", *points, "point.end", "spline.end"]
    reading = read(block, name="w.prw")
    assert_is(reading, WHEEL)
    assert "units.len.f = 1: lengths in m" in reading.notes
