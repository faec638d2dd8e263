"""`wearsim contact`: what it prints, and that all faulty flags are told at once."""

from __future__ import annotations

import json

import pytest

from wearsim.cli import main


def solved(capsys: pytest.CaptureFixture[str], *flags: str) -> dict:
    assert main(["contact", "--json", *flags]) == 0
    return json.loads(capsys.readouterr().out)["points"][0]


# Liu & Bruni (2016), table 3: shift [mm], roller radius [mm], area [mm2], maximum pressure [MPa].
TABLE_3 = [
    (0, None, 201, 598),
    (0, 1000, 176, 682),
    (0, 500, 159, 754),
    (3, None, 94, 1336),
    (3, 1000, 84, 1498),
    (3, 500, 78, 1632),
]


@pytest.mark.parametrize(("shift", "roller", "area", "pressure"), TABLE_3)
def test_area_and_pressure_of_the_seed_within_5_percent(shift, roller, area, pressure, capsys):
    """The same models as the paper's; the 60E1 it used and its grid are not known better than this."""
    on = [] if roller is None else ["--roller-radius-mm", str(roller)]
    point = solved(capsys, "--shift-mm", str(shift), "--wheel-load-kN", "80", "--inclination", "1:40", *on)
    assert len(point["patches"]) == 1
    assert point["patches"][0]["area"] == pytest.approx(area * 1e-6, rel=0.05)
    assert point["patches"][0]["max_pressure"] == pytest.approx(pressure * 1e6, rel=0.05)


def test_json_has_every_promised_key(capsys):
    point = solved(capsys, "--shift-mm", "3")
    keys = (
        "side wheel_y rail_y x contact_angle area max_pressure length width approach normal_force creepage_x "
    )
    keys += "creepage_y spin force_x force_y spin_moment slip_area power power_balance normal tangential"
    assert set(point["patches"][0]) == set(keys.split())
    assert set(point) == {
        "shift", "yaw", "roll", "wheel_load", "counterface_curvature", "rotation_speed", "patches",
    }  # fmt: skip
    assert point["shift"] == pytest.approx(0.003)
    assert point["wheel_load"] == pytest.approx(80e3)


def test_left_wheel_at_the_mirrored_state_is_the_mirror_image(capsys):
    right = solved(capsys, "--shift-mm", "2", "--yaw-mrad", "5")["patches"][0]
    left = solved(capsys, "--shift-mm", "-2", "--yaw-mrad", "-5", "--side", "left")["patches"][0]
    for name in ("area", "max_pressure", "power", "creepage_x", "force_x", "wheel_y"):
        assert left[name] == pytest.approx(right[name], rel=1e-9)
    for name in ("contact_angle", "creepage_y", "spin", "force_y", "spin_moment"):
        assert left[name] == pytest.approx(-right[name], rel=1e-9)


def test_normal_force_is_that_of_the_patch_and_wheel_load_its_vertical_part(capsys):
    point = solved(capsys, "--shift-mm", "3", "--normal-force-kN", "80")
    assert point["wheel_load"] is None
    assert point["patches"][0]["normal_force"] == pytest.approx(80e3, rel=1e-12)
    patch = solved(capsys, "--shift-mm", "3", "--wheel-load-kN", "80")["patches"][0]
    assert patch["normal_force"] > 80e3


def test_a_rotation_speed_may_be_given(capsys):
    ruled = solved(capsys, "--shift-mm", "3", "--rotation", "nominal")
    assert ruled["rotation_speed"] == pytest.approx(20.0 / 0.46, rel=1e-12)
    given = solved(capsys, "--shift-mm", "3", "--rotation", str(20.0 / 0.46))
    assert given["patches"][0]["creepage_x"] == pytest.approx(ruled["patches"][0]["creepage_x"], abs=1e-14)


def test_without_friction_nothing_is_transmitted(capsys):
    patch = solved(capsys, "--shift-mm", "3", "--yaw-mrad", "3", "--friction", "0")["patches"][0]
    assert (patch["force_x"], patch["force_y"], patch["power"]) == (0.0, 0.0, 0.0)
    assert patch["power_balance"] == 1.0


def test_table_for_people(capsys):
    assert main(["contact", "--shift-mm", "3", "--roller-radius-mm", "1000"]) == 0
    out = capsys.readouterr().out
    assert "right wheel on roller of 1000 mm, 1 patch" in out
    assert "pressure [MPa]" in out


def test_all_faulty_flags_at_once(capsys):
    flags = "--friction 2 --yaw-mrad 200 --wheel-load-kN -3 --inclination 3 --wheel S1003"
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
        ("--roller-radius-mm 5", "roller-radius-mm = 5 must be a number from 50"),
        ("--curve-radius-m 0", "leave it out on tangent track"),
        ("--shift-mm 5.1 --normal-force-kN 80", "give the wheel load instead"),
    ],
)
def test_states_without_an_answer_are_refused_in_one_line(flags, message, capsys):
    assert main(["contact", *flags.split()]) == 2
    captured = capsys.readouterr()
    assert message in captured.err
    assert len(captured.err.splitlines()) == 1
    assert captured.out == ""
