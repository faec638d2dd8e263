"""`wearsim contact`: what it prints, and that all faulty flags are listed at once."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from wearsim.cli import main
from wearsim.operation.states import BeyondJump
from wearsim.profile.files import write_profile
from wearsim.profile.inspection.inputs import read_input
from wearsim.profile.standard import rail
from wearsim.studies import contact_points
from wearsim.studies.contact_flags import FLAGS
from wearsim.studies.contact_points import PATCH_NAMES


def solved(capsys: pytest.CaptureFixture[str], *flags: str) -> dict:
    assert main(["contact", "--json", *flags]) == 0
    return json.loads(capsys.readouterr().out)["points"][0]


# Liu & Bruni (2016), table 3: shift [mm], roller radius [mm], area [mm2], maximum
# pressure [MPa].
TABLE_3 = [
    (0, None, 201, 598),
    (0, 1000, 176, 682),
    (0, 500, 159, 754),
    (3, None, 94, 1336),
    (3, 1000, 84, 1498),
    (3, 500, 78, 1632),
]


@pytest.mark.parametrize(("shift", "roller", "area", "pressure"), TABLE_3)
def test_area_and_pressure_of_the_seed_within_5_percent(
    shift, roller, area, pressure, capsys
):
    """The same models as the paper's; the 60E1 it used and its grid are not known
    better than this.
    """
    on = [] if roller is None else ["--roller-radius-mm", str(roller)]
    flags = ["--model", "fast", "--wheel-load-kN", "80", "--inclination", "1:40"]
    point = solved(capsys, "--shift-mm", str(shift), *flags, *on)
    assert len(point["patches"]) == 1
    assert point["patches"][0]["area"] == pytest.approx(area * 1e-6, rel=0.05)
    assert point["patches"][0]["max_pressure"] == pytest.approx(
        pressure * 1e6, rel=0.05
    )


def test_json_has_every_promised_key(capsys):
    point = solved(capsys, "--shift-mm", "3")
    keys = (
        "side wheel_y rail_y x contact_angle area max_pressure length width approach "
        "normal_force creepage_x "
    )
    keys += (
        "creepage_y spin force_x force_y spin_moment slip_area power power_balance "
        "normal tangential"
    )
    assert set(point["patches"][0]) == set(keys.split())
    assert set(point) == {
        "shift",
        "yaw",
        "roll",
        "wheel_load",
        "counterface_curvature",
        "rotation_speed",
        "patches",
    }
    assert point["shift"] == pytest.approx(0.003)
    assert point["wheel_load"] == pytest.approx(80e3)


def test_left_wheel_at_the_mirrored_state_is_the_mirror_image(capsys):
    right = solved(capsys, "--shift-mm", "2", "--yaw-mrad", "5")["patches"][0]
    left = solved(capsys, "--shift-mm", "-2", "--yaw-mrad", "-5", "--side", "left")[
        "patches"
    ][0]
    for name in ("area", "max_pressure", "power", "creepage_x", "force_x", "wheel_y"):
        assert left[name] == pytest.approx(right[name], rel=1e-9)
    for name in ("contact_angle", "creepage_y", "spin", "force_y", "spin_moment"):
        assert left[name] == pytest.approx(-right[name], rel=1e-9)


def test_normal_force_is_that_of_the_patch_and_wheel_load_its_vertical_part(capsys):
    point = solved(capsys, "--shift-mm", "3", "--normal-force-kN", "80")
    assert point["wheel_load"] is None
    assert point["patches"][0]["normal_force"] == pytest.approx(80e3, rel=1e-12)
    for model, within in (("fast", 1e-6), ("standard", 1e-3)):  # that bends patches
        patch = solved(
            capsys, "--shift-mm", "3", "--wheel-load-kN", "80", "--model", model
        )["patches"][0]
        angle = patch["contact_angle"]
        carried = patch["normal_force"] * np.cos(angle) - patch["force_y"] * np.sin(
            angle
        )
        assert carried == pytest.approx(80e3, rel=within)


def test_a_rotation_speed_may_be_given(capsys):
    ruled = solved(capsys, "--shift-mm", "3", "--rotation", "nominal")
    assert ruled["rotation_speed"] == pytest.approx(20.0 / 0.46, rel=1e-12)
    given = solved(capsys, "--shift-mm", "3", "--rotation", str(20.0 / 0.46))
    assert given["patches"][0]["creepage_x"] == pytest.approx(
        ruled["patches"][0]["creepage_x"], abs=1e-14
    )


def test_a_gauge_measured_further_down_acts_as_a_wider_one(capsys):
    """By twice the distance that the gauge face of the inclined 60E1 recedes; printed
    to 0.001 um.
    """
    face = (
        rail("60E1", 1 / 40, 1.435, 0.75, gauge_height=15.875e-3).y[0]
        - rail("60E1", 1 / 40, 1.435, 0.75).y[0]
    )
    assert face == pytest.approx(111.1e-6, abs=0.1e-6)
    lower = solved(capsys, "--shift-mm", "5", "--gauge-height-mm", "15.875")
    wider = solved(
        capsys, "--shift-mm", "5", "--gauge-mm", f"{1435.0 + 2e3 * face:.6f}"
    )
    plain = solved(capsys, "--shift-mm", "5")
    for name in ("wheel_y", "rail_y", "area", "power"):
        assert lower["patches"][0][name] == pytest.approx(
            wider["patches"][0][name], rel=1e-4
        ), name
        assert abs(lower["patches"][0][name] / plain["patches"][0][name] - 1.0) > 1e-3


EVEN = (
    "area",
    "max_pressure",
    "power",
    "creepage_x",
    "force_x",
    "wheel_y",
    "rail_y",
    "normal_force",
    "slip_area",
)
ODD = ("contact_angle", "creepage_y", "spin", "force_y", "spin_moment")


def assert_mirror_image(point, image, rel):
    """Patches of the right wheel are those of the left one; directions across the track
    turned round.
    """
    other = {"right": "left", "left": "right"}
    for name in ("shift", "yaw", "roll"):
        assert image[name] == pytest.approx(-point[name], rel=rel, abs=2e-11)
    for side in other:
        ours = [patch for patch in point["patches"] if patch["side"] == side]
        theirs = [patch for patch in image["patches"] if patch["side"] == other[side]]
        assert len(ours) == len(theirs)
        for here, there in zip(ours, theirs, strict=True):
            for sign, names in ((1.0, EVEN), (-1.0, ODD)):
                for name in names:
                    assert there[name] == pytest.approx(
                        sign * here[name], rel=rel, abs=1e-12
                    ), name


@pytest.mark.parametrize(
    ("flags", "rel"),
    [
        ("--shift-mm 2 --yaw-mrad 5 --roll 1 --curve-radius-m 300", 1e-9),
        ("--shift-mm 3 --creepage=-0.0016,1e-3,-0.197", 1e-9),
        (  # free roll: up to the tolerance on its height, 1e-11 m over 1.5 m
            "--shift-mm 4 --yaw-mrad 2 --side both --left-wheel EPS --curve-radius-m "
            "800 --wheel-load-right-kN 90 --wheel-load-left-kN 70",
            1e-5,
        ),
        (
            "--lateral-force-kN 10 --axle-load-kN 160 --side both",
            3.2e-4,
        ),  # of the balance: 3.2 N of 10 kN
    ],
)
def test_mirror_gives_the_mirror_image(flags, rel, capsys):
    point, image = (
        solved(capsys, *flags.split()),
        solved(capsys, *flags.split(), "--mirror"),
    )
    assert_mirror_image(point, image, rel)


def test_faults_of_a_mirrored_point_name_the_flags_that_were_given(capsys):
    assert (
        main(
            [
                "contact",
                "--mirror",
                "--left-wheel",
                "S1003",
                "--side",
                "up",
                "--shift-mm",
                "x",
            ]
        )
        == 2
    )
    starts = [line.split()[0] for line in capsys.readouterr().err.splitlines()]
    assert sorted(starts) == ["--left-wheel:", "--shift-mm", "--side"]


def test_without_friction_nothing_is_transmitted(capsys):
    patch = solved(capsys, "--shift-mm", "3", "--yaw-mrad", "3", "--friction", "0")[
        "patches"
    ][0]
    assert (patch["force_x"], patch["force_y"], patch["power"]) == (0.0, 0.0, 0.0)
    assert patch["power_balance"] == 1.0


def test_table_for_people(capsys):
    assert main(["contact", "--shift-mm", "3", "--roller-radius-mm", "1000"]) == 0
    out = capsys.readouterr().out
    assert "right wheel on roller of 1000 mm; rotation free, roll given" in out
    assert "max_pressure_MPa" in out


def test_all_faulty_flags_at_once(capsys):
    flags = (
        "--friction 2 --yaw-mrad 200 --wheel-load-kN -3 --inclination 3 --wheel S1003"
    )
    flags += " --strips 4.5 --rotation slow --normal none --shift-mm nan"
    assert main(["contact", *flags.split()]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    lines = captured.err.splitlines()
    for flag in (
        "friction",
        "yaw-mrad",
        "wheel-load-kN",
        "inclination",
        "wheel:",
        "strips",
        "rotation",
        "normal",
        "shift-mm",
    ):
        assert sum(line.startswith(f"--{flag}") for line in lines) == 1, flag
    assert "from 0 to 1" in captured.err


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        ("--gauge-mm 1700", "does not touch"),
        ("--shift-mm 60", "edge of a profile"),
        ("--wheel-load-kN 80 --normal-force-kN 80", "exclude each other"),
        ("--roller-radius-mm 4", "roller-radius-mm = 4 must be a number from 5"),
        ("--roller-radius-left-mm 900", "give that of the right one"),
        ("--curve-radius-m 0", "without it: tangent"),
        ("--shift-mm 5.1 --normal-force-kN 80", "give the wheel load instead"),
        ("--shift-mm 5.1 --creepage=0,0,0", "given creepages belong to one"),
        (
            "--creepage=0,0,0 --rotation free",
            "--creepage and --rotation exclude each other",
        ),
        ("--creepage=0,0,0 --side both", "choose the right or the left side"),
        ("--creepage=0,0", "must be three numbers"),
        ("--side up", "--side = up must be one of right, left, both"),
        ("--roll 101", "--roll = 101 must be free or a number from -100 to 100"),
        ("--plot picture.jpg", "must end with .png, .svg, .pdf"),
        ("--plot missing/picture.png", "the folder does not exist"),
    ],
)
def test_states_without_an_answer_are_refused_in_one_line(flags, message, capsys):
    assert main(["contact", *flags.split()]) == 2
    captured = capsys.readouterr()
    assert message in captured.err
    assert len(captured.err.splitlines()) == 1
    assert captured.out == ""


def test_both_wheels_with_free_roll_are_mirror_images(capsys):
    """Up to the tolerance on height of the roll, 1e-11 m over 1.5 m."""
    one = solved(capsys, "--shift-mm", "3", "--yaw-mrad", "2", "--side", "both")
    other = solved(capsys, "--shift-mm", "-3", "--yaw-mrad", "-2", "--side", "both")
    assert [patch["side"] for patch in one["patches"]] == ["right", "left"]
    assert one["roll"] == pytest.approx(-other["roll"], abs=2e-11)
    assert one["roll"] < -1e-4
    for here, there in ((0, 1), (1, 0)):
        for name in ("area", "power", "force_x", "wheel_y"):
            assert one["patches"][here][name] == pytest.approx(
                other["patches"][there][name], rel=1e-6
            )
        for name in ("contact_angle", "force_y", "spin"):
            assert one["patches"][here][name] == pytest.approx(
                -other["patches"][there][name], rel=1e-6
            )


def test_both_wheels_balance_the_axle(capsys):
    """Rule free: no torque about the axle; rolling radii from the tape circle differ by
    below 1 mm of 460.
    """
    patches = solved(capsys, "--shift-mm", "2", "--side", "both")["patches"]
    assert sum(patch["force_x"] for patch in patches) == pytest.approx(
        0.0, abs=3e-3 * abs(patches[0]["force_x"])
    )


def test_roll_is_nothing_for_one_wheel_and_free_for_both(capsys):
    assert solved(capsys, "--shift-mm", "2")["roll"] == 0.0
    free = solved(capsys, "--shift-mm", "2", "--roll", "free")
    both = solved(capsys, "--shift-mm", "2", "--side", "both")
    assert free["roll"] == both["roll"] != 0.0
    assert free["patches"] == both["patches"][:1]
    given = solved(capsys, "--shift-mm", "2", "--side", "both", "--roll", "-1")
    assert given["roll"] == pytest.approx(-1e-3, rel=1e-15)


def test_normal_force_of_both_wheels_is_that_of_each(capsys):
    point = solved(
        capsys, "--shift-mm", "2", "--side", "both", "--normal-force-kN", "70"
    )
    forces = [patch["normal_force"] for patch in point["patches"]]
    assert forces == pytest.approx([70e3, 70e3], rel=1e-12)


def test_given_creepages_are_those_of_the_patch(capsys):
    """The mean over strips in planes of their own, weighted with the normal force."""
    point = solved(capsys, "--shift-mm", "3", "--creepage=-0.0016,1e-3,-0.197")
    assert point["rotation_speed"] is None
    patch = point["patches"][0]
    given = [patch[name] for name in ("creepage_x", "creepage_y", "spin")]
    assert given == pytest.approx([-0.0016, 1e-3, -0.197], rel=1e-9)
    assert main(["contact", "--shift-mm", "3", "--creepage=0,0,0"]) == 0
    assert "creepages given" in capsys.readouterr().out


def test_negative_values_need_no_equals_sign(capsys):
    point = solved(capsys, "--shift-mm", "-1e-1", "--creepage", "-0.001,0,-.1")
    assert point["shift"] == pytest.approx(-1e-4, rel=1e-15)
    assert point["patches"][0]["creepage_x"] == pytest.approx(-0.001, rel=1e-9)


def test_anchors_of_the_conventions(capsys):
    """Right wheel, S1002 on 60E1 1:40, 3 mm: sizes to the rounding they are printed
    with.

    The power is that of forces and creepages of the patch where it lies in one plane.
    """
    point = solved(
        capsys, "--shift-mm", "3", "--rotation", "nominal", "--model", "fast"
    )
    patch = point["patches"][0]
    assert patch["creepage_x"] == pytest.approx(-0.0016, abs=1e-4)
    assert patch["spin"] == pytest.approx(-0.197, abs=6e-3)
    assert patch["contact_angle"] == pytest.approx(-0.09, abs=2e-3)
    assert patch["force_x"] > 0.0
    assert patch["force_y"] == pytest.approx(5.5e3, rel=0.08)
    assert patch["power"] == pytest.approx(
        -20.0
        * sum(
            patch[force] * patch[creepage]
            for force, creepage in (
                ("force_x", "creepage_x"),
                ("force_y", "creepage_y"),
                ("spin_moment", "spin"),
            )
        ),
        rel=1e-12,
    )


def test_table_for_people_shows_sides_and_roll(capsys):
    assert main(["contact", "--shift-mm", "3", "--side", "both"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith(
        "both wheels on rail; rotation free, roll free; coupled_strips"
    )
    assert lines[1].split() == ["right", "left"]
    point = lines.index("operating point")
    heads = [line for line in lines[2:point] if not line.startswith(" ")]
    assert heads == ["place", "patch", "creepage", "forces on the wheel", "sliding"]
    numbers = [line.split() for line in lines[2:point] if line.startswith(" ")]
    assert len(numbers) == len(PATCH_NAMES)
    for _, *cells in numbers:
        assert len(cells) == 2
        for cell in cells:  # at most four digits
            assert f"{float(cell):.4g}" == cell or abs(float(cell)) >= 1e3
    assert max(map(len, lines)) <= 100


@pytest.mark.parametrize(
    ("ending", "patches"),
    [
        ("png", 1),
        pytest.param("svg", 3, marks=pytest.mark.slow),
        pytest.param("pdf", 1, marks=pytest.mark.slow),
    ],
)
def test_plots_are_files_of_their_kind(ending, patches, tmp_path, capsys):
    path = tmp_path / f"contact.{ending}"
    where = {1: ("--shift-mm", "3"), 3: ("--shift-mm", "5.1", "--side", "both")}[
        patches
    ]
    point = solved(capsys, *where, "--plot", str(path))
    assert len(point["patches"]) == patches
    start = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}[ending]
    assert path.read_bytes().startswith(start)


@pytest.mark.parametrize(
    "tangential", [pytest.param("fastsim", marks=pytest.mark.slow), "half_space"]
)
def test_a_half_space_of_two_lobes_is_drawn(tangential, tmp_path, capsys):
    """Strips without contact between the lobes; cells beside the patch carry
    nothing.
    """
    path = tmp_path / "contact.svg"
    flags = (
        "--shift-mm",
        "5",
        "--roller-radius-mm",
        "1000",
        "--strips",
        "40",
        "--cells",
        "40",
    )
    point = solved(
        capsys,
        *flags,
        "--normal",
        "half_space",
        "--tangential",
        tangential,
        "--plot",
        str(path),
    )
    assert len(point["patches"]) == 1
    assert path.read_text().count("<svg") == 1


def test_a_negative_number_of_any_form_is_a_value_and_no_flag(capsys):
    """argparse by itself takes -1e-3 and -0.001,0,-0.2 for flags."""
    joined = solved(capsys, "--shift-mm=3", "--creepage=-1e-3,0,-0.2")
    assert solved(capsys, "--shift-mm", "3", "--creepage", "-1e-3,0,-0.2") == joined
    assert solved(capsys, "--shift-mm", "-.5") == solved(capsys, "--shift-mm=-0.5")


@pytest.mark.parametrize(
    ("flags", "output"),
    [
        (
            ("--shift-mm", "7"),
            (
                "note: shift 7 mm is beyond the flange clearance of 6.6 mm: the right "
                "wheel"
            ),
        ),
        (
            ("--shift-mm", "-7", "--side", "left"),
            "note: shift -7 mm is beyond the flange clearance of 6.6 mm",
        ),
        (
            ("--shift-mm", "6", "--wheel-load-kN", "300", "--roller-radius-mm", "100"),
            "note: maximum pressure 4.8",
        ),
        (
            ("--curve-radius-m", "500", "--roller-radius-mm", "1000"),
            "note: a curve radius on a roller",
        ),
    ],
)
def test_what_deserves_a_second_look_is_noted(flags, output, capsys):
    assert main(["contact", "--model", "fast", *flags]) == 0
    notes = capsys.readouterr().err
    assert notes.startswith(output)
    assert notes.count("\n") == 1
    assert (
        main(["contact", "--shift-mm", "-7"]) == 0
    )  # the right wheel runs on its tread
    assert capsys.readouterr().err == ""


def test_a_plot_that_cannot_be_written_is_told_in_one_line(tmp_path, capsys):
    (tmp_path / "contact.png").mkdir()
    assert main(["contact", "--plot", str(tmp_path / "contact.png")]) == 2
    captured = capsys.readouterr()
    assert "cannot be written" in captured.err
    assert captured.err.count("\n") == 1


def test_help_shows_every_flag_with_its_default(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "400")  # lines break at hyphens, too
    with pytest.raises(SystemExit):
        main(["contact", "--help"])
    output = " ".join(capsys.readouterr().out.split())
    for flag in FLAGS.values():
        assert f"--{flag.name} X" in output
        assert flag.default is None or f"(default {flag.default})" in output
    assert "wearsim contact --table points.csv" in output


@pytest.mark.parametrize(
    ("command", "old", "new"),
    [
        ("contact", "--flange-back-mm", "--back-to-back-mm"),
        ("profile", "--flange-back-mm", "--back-to-back-mm"),
        ("profile", "--turn-to", "--reprofile-to"),
    ],
)
@pytest.mark.parametrize("value", [[], ["1360"], ["S1002"]])
def test_old_flags_are_errors_that_name_the_new_one(command, old, new, value, capsys):
    with pytest.raises(SystemExit) as stop:
        main([command, old, *value])
    assert stop.value.code == 2
    lines = capsys.readouterr().err.splitlines()
    assert lines == [
        (
            f"wearsim {command}: {old} has a new name; write {new}; see `wearsim "
            f"{command} --help`"
        )
    ]


def test_flags_of_the_architecture():
    """Section 7, in its order."""
    names = (
        "wheel rail inclination gauge-mm back-to-back-mm wheel-radius-mm "
        "roller-radius-mm curve-radius-m"
    )
    names += (
        " shift-mm yaw-mrad wheel-load-kN normal-force-kN friction speed-km-h "
        "rotation youngs-GPa poisson"
    )
    names += " side normal tangential creepage roll"
    assert set(names.split()) <= {flag.name for flag in FLAGS.values()}


def test_a_measured_rail_tells_how_it_stands(tmp_path, capsys):
    path = tmp_path / "head.ban"
    write_profile(read_input("60E1").profile, path, "miniprof")
    for stated, output in (
        ([], "inclined 1:40 by --inclination"),
        (["--inclination", "none"], "as measured"),
    ):
        assert main(["contact", "--rail", str(path), *stated]) == 0
        assert f"note: {path}: in the track {output}" in capsys.readouterr().err


def test_a_state_by_force_is_that_of_a_reference(capsys):
    """`tests/data/operation_rig.csv`: 10 kN, no yaw, a roller of 1 m gives 5.0764
    mm.
    """
    force = [
        "--lateral-force-kN",
        "10",
        "--axle-load-kN",
        "160",
        "--roller-radius-mm",
        "1000",
    ]
    assert (
        main(
            [
                "contact",
                "--model",
                "fast",
                *force,
                "--side",
                "both",
                "--cell-mm",
                "1000",
                "--json",
            ]
        )
        == 0
    )
    (point,) = json.loads(capsys.readouterr().out)["points"]
    assert point["shift"] == pytest.approx(5.0764e-3, abs=1e-6)
    forces = point["wheelset"]
    assert forces["lateral_force"] == pytest.approx(10e3, abs=5.0)
    assert forces["wheel_load_right"] == pytest.approx(84.97e3, abs=10.0)
    assert forces["steering_moment"] == pytest.approx(-29.87e3, abs=10.0)
    assert forces["axle_wear_number"] == pytest.approx(173.8, rel=1e-3)


def test_a_force_that_two_shifts_of_the_axle_carry_is_held(capsys):
    """P8 on 60E1 between 46 and 56 kN, which one place at the height of the rails
    carries.
    """
    for force in (45.0, 49.0, 53.0, 57.0):
        flags = [
            "--wheel",
            "P8",
            "--lateral-force-kN",
            f"{force}",
            "--axle-load-kN",
            "160",
            "--side",
            "both",
        ]
        assert main(["contact", "--model", "fast", *flags, "--json"]) == 0
        (point,) = json.loads(capsys.readouterr().out)["points"]
        assert point["share_beyond_jump"] == 0.0
        assert point["wheelset"]["lateral_force"] == pytest.approx(1e3 * force, abs=5.0)


def test_a_jump_of_the_force_is_noted_with_the_share_of_the_far_side(
    capsys, monkeypatch
):
    settled = contact_points.settle

    def at_a_jump(*given):
        running = settled(*given)
        past = BeyondJump(np.array([0]), running.shift + 1e-7, np.array([0.25]))
        return replace(running, beyond=past)

    monkeypatch.setattr(contact_points, "settle", at_a_jump)
    flags = ["--lateral-force-kN", "10", "--axle-load-kN", "160", "--side", "both"]
    assert main(["contact", "--model", "fast", *flags]) == 0
    output = capsys.readouterr().err
    assert "jumps past 10 kN" in output
    assert "25 % of the distance past it" in output


def test_loads_and_friction_by_side_and_zone_act(capsys):
    loads = [
        "--wheel-load-right-kN",
        "90",
        "--wheel-load-left-kN",
        "70",
        "--left-wheel",
        "EPS",
    ]
    assert (
        main(
            ["contact", *loads, "--side", "both", "--friction-flange", "0.1", "--json"]
        )
        == 0
    )
    (point,) = json.loads(capsys.readouterr().out)["points"]
    assert point["wheelset"]["wheel_load_right"] == pytest.approx(90e3, rel=1e-5)
    assert point["wheelset"]["wheel_load_left"] == pytest.approx(70e3, rel=1e-5)


@pytest.mark.parametrize(
    ("flags", "fault"),
    [
        (
            ["--lateral-force-kN", "300", "--axle-load-kN", "160"],
            "unloads the left wheel",
        ),
        (["--wheel-load-right-kN", "80"], "give those of both"),
        (["--wheel-load-kN", "80", "--axle-load-kN", "160"], "exclude each other"),
        (["--shift-mm", "1", "--lateral-force-kN", "5"], "exclude each other"),
        (["--axle-load-kN", "160", "--roll", "1"], "leave out the roll"),
        (["--torque-Nm", "500", "--rotation", "nominal"], "a torque has no effect"),
        (["--friction-ratio", "0.4"], "friction decrease above 0; give both"),
        (["--kalker-factor", "0.1"], "--kalker-factor = 0.1 must be a number from 0.2"),
        (
            [
                "--torque-Nm",
                "35000",
                "--friction-ratio=0.4",
                "--friction-decrease-s-m=0.6",
                "--lateral-force-kN=3",
                "--model=fast",
            ],
            "an axle torque of 35000 N m is beyond the crest of the creep forces",
        ),
    ],
)
def test_forces_that_do_not_fit_are_told(flags, fault, capsys):
    assert main(["contact", *flags]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert fault in line


@pytest.mark.parametrize(
    ("flags", "pair"),
    [
        ([], ["coupled_strips", "coupled_strips"]),
        (["--model", "fast"], ["kik_piotrowski", "fastsim"]),
        (["--model", "accurate"], ["half_space", "half_space"]),
        (["--tangential", "fastsim"], ["coupled_strips", "fastsim"]),
    ],
)
def test_models_by_the_name_of_their_pair(flags, pair, capsys):
    (patch,) = solved(capsys, "--strips", "10", "--cells", "10", *flags)["patches"]
    assert [patch["normal"], patch["tangential"]] == pair


def test_a_pair_of_models_and_one_of_them_exclude_each_other(capsys):
    assert main(["contact", "--model", "fast", "--normal", "half_space"]) == 2
    assert "--normal and --model exclude each other" in capsys.readouterr().err


def test_independent_wheels_state_their_rotation_speeds(capsys):
    """In a curve to the right the left wheel runs faster, by 2 l/R of the speed."""
    coarse = ["--model", "fast", "--strips", "10", "--cells", "10", "--side", "both"]
    assert (
        main(
            [
                "contact",
                *coarse,
                "--rotation",
                "independent",
                "--curve-radius-m",
                "50",
                "--json",
            ]
        )
        == 0
    )
    (point,) = json.loads(capsys.readouterr().out)["points"]
    wheels = point["wheelset"]
    right, left = (wheels[f"rotation_speed_{side}"] for side in ("right", "left"))
    assert left - right == pytest.approx(1.5 / 50.0 * 20.0 / 0.46, rel=0.01)
    assert point["rotation_speed"] == pytest.approx(0.5 * (right + left))
