import numpy as np
import pytest

from wearsim.profile.standard import rail, wheel

WHEEL = wheel("S1002", spacing=1e-3)
RAIL = rail("60E1", 1 / 40, 1.435, 0.750, spacing=1e-3)
ROUNDING = 0.51e-7  # of points written with four decimals of a mm [m]


def simpack(profile, sign_y=1, scale=1e3, digits=4, weight="", reverse=False, **keys):
    """Lines of a file; keys with `_` for `.`."""
    lines = [
        "! SIMPACK",
        "header.begin",
        " version = 1",
        f" type = {int(profile.kind == 'wheel')} ! flag",
    ]
    lines += ["header.end", "spline.begin"]
    lines += [
        f" {key.replace('_', '.')} = {value} ! remark" for key, value in keys.items()
    ]
    lines += [" point.begin", " ! y z weight"]
    rows = [
        f"{sign_y * y * scale:.{digits}f}\t{z * scale:.{digits}f}{weight}"
        for y, z in zip(profile.y, profile.z, strict=True)
    ]
    return [*lines, *(rows[::-1] if reverse else rows), " point.end", "spline.end"]


def assert_is(reading, profile, tolerance=ROUNDING):
    assert reading.format == "simpack"
    assert np.max(np.abs(reading.profile.y - profile.y)) < tolerance
    assert np.max(np.abs(reading.profile.z - profile.z)) < tolerance


@pytest.mark.parametrize("name", ["p.txt", "p.prw"])
@pytest.mark.parametrize("weight", ["", " 1.0", " 0.5"])
def test_wheel(read, name, weight):
    reading = read(
        simpack(WHEEL, weight=weight, units_len_f="+1.0E+03", comment="'a % sign'"),
        name=name,
    )
    assert_is(reading, WHEEL)
    assert reading.header["comment"] == "a % sign"


def test_rail_is_in_our_axes(read):
    assert_is(read(simpack(RAIL, units_len_f=1000), "rail"), RAIL)


def test_mirrored_wheel_as_in_the_manchester_benchmark(read):
    reading = read(
        simpack(WHEEL, sign_y=-1, mirror_y=1, units_len_f=1000, reverse=True)
    )
    assert_is(reading, WHEEL)
    assert "applied: mirror.y = 1" in reading.notes


def test_mirrored_rail(read):
    assert_is(read(simpack(RAIL, sign_y=-1, mirror_y=1, inversion=1), "rail"), RAIL)


def test_mirror_z(read):
    up = type(WHEEL)("up", "wheel", WHEEL.y, -WHEEL.z)
    assert_is(read(simpack(up, mirror_z=1)), WHEEL)


def test_metres(read):
    assert_is(read(simpack(WHEEL, scale=1.0, digits=7, units_len_f=1)), WHEEL)


def test_inches_by_the_unit_factor(read):
    reading = read(simpack(WHEEL, scale=1e3 / 25.4, digits=6, units_len_f=1e3 / 25.4))
    assert_is(reading, WHEEL, 0.51e-6 * 0.0254)


def test_missing_unit_factor_is_said(read):
    reading = read(simpack(WHEEL))
    assert_is(reading, WHEEL)
    assert "units.len.f is not given: lengths are taken as mm" in reading.notes


def test_bare_keys_stand_for_their_defaults(read):
    lines = simpack(WHEEL, units_len_f="1000")
    lines[6:6] = ["approx.smooth", "file", "shift.y =", "shift.z", "bound.y.min ="]
    assert_is(read(lines), WHEEL)


def test_shift_comes_before_mirror(read):
    """Points are listed at -(y - 5); adding -5 and then mirroring gives y back."""
    moved = type(WHEEL)("moved", "wheel", WHEEL.y - 5e-3, WHEEL.z - 2e-3)
    reading = read(simpack(moved, sign_y=-1, shift_y=-5, shift_z=2, mirror_y=1))
    assert_is(reading, WHEEL)
    assert "applied: shift.y = -5, shift.z = 2, mirror.y = 1" in reading.notes


def test_bounds_of_y_apply_after_the_shift_and_before_the_mirror(read):
    lines = simpack(
        WHEEL, sign_y=-1, shift_y=1, bound_y_min=-50, bound_y_max=200, mirror_y=1
    )
    y = read(lines).profile.y
    inside = (-WHEEL.y + 1e-3 >= -50e-3) & (-WHEEL.y + 1e-3 <= 200e-3)
    assert np.max(np.abs(y - (WHEEL.y[inside] - 1e-3))) < ROUNDING


def test_bounds_with_min_above_max_are_off(read):
    assert_is(
        read(
            simpack(WHEEL, bound_y_min=1, bound_y_max=0, bound_z_min=1, bound_z_max=0)
        ),
        WHEEL,
    )


def test_z_is_clipped_to_its_bounds(read):
    reading = read(simpack(WHEEL, bound_z_min=-2, bound_z_max=27))
    assert reading.profile.z.max() == 27e-3
    assert reading.profile.z.min() == -2e-3
    assert any("bound.z.min = -2" in note for note in reading.notes)


def test_rotation_is_refused(fault):
    assert "p.txt:7: rotate = 0.02 is not applied by this reader" in fault(
        simpack(WHEEL, rotate=0.02)
    )


@pytest.mark.parametrize("end", [1, 2, 40])
def test_cut_off_file_is_refused(fault, end):
    lines = simpack(WHEEL, units_len_f=1000)[:-end]
    last = "spline" if end == 1 else "point"
    assert fault(lines) == (
        f"p.txt:{len(lines)}: {last}.end is missing: the file is cut off; copy it again"
    )


def test_two_files_in_one(fault):
    lines = simpack(WHEEL)
    message = fault([*lines, *lines])
    assert (
        f"p.txt:{len(lines) + 6}: a second spline.begin, the first is in line 6: "
        "two profiles"
    ) in message


def test_all_faults_at_once(fault):
    lines = simpack(WHEEL, shift_y="much", units_len_f=-1)
    lines[15], lines[20] = "1 2 3 4", "nan 1"
    assert [line.split(": ", 1)[0] for line in fault(lines).splitlines()] == [
        "p.txt:16",
        "p.txt:21",
        "p.txt:7",
        "p.txt:8",
    ]


def test_kind_of_the_header_and_of_the_extension(fault):
    assert "p.txt:4: type = 1 says wheel, a rail profile is needed" in fault(
        simpack(WHEEL), "rail"
    )
    assert "p.prr: .prr is a rail, a wheel profile is needed" in fault(
        simpack(WHEEL), name="p.prr"
    )


def test_extension_without_the_blocks(fault):
    assert "holds no point.begin block, so it is no SIMPACK profile" in fault(
        ["1 2"] * 30, name="p.prw"
    )


def test_keys_of_a_benchmark_header(read):
    """Layout of the published SIMPACK files: padded keys, exponents, tabs between the
    columns.
    """
    lines = [
        *simpack(RAIL)[:6],
        "    approx.smooth  = +0.000000000000000e+00   ! Approximation smoothing value",
        "    file           = 'x.rai.txt'              ! Original data file",
        "    file.mtime     =  0                       ! Time",
        "    type           =  0                       ! Original data file type",
        "    bound.y.min    = +1.000000000000000e+00   ! 4: y boundary min",
        "    bound.y.max    = +0.000000000000000e+00   ! 4: y boundary max",
        "!   units.len      = 'mm'                     ! 7: Unit name",
        "    units.len.f    = +1.000000000000000e+03   ! 7: Unit factor",
        "    point.begin",
        *(f"{1e3 * y:.7E}\t{1e3 * z:.7E}" for y, z in zip(RAIL.y, RAIL.z, strict=True)),
        "    point.end",
        "  spline.end",
    ]
    reading = read(lines, "rail")
    assert_is(reading, RAIL)
    assert "units.len" not in reading.header
