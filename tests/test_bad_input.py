"""Bad input end to end: exit code 2, one line per fault with its place and the way out,
nothing written.
"""

import re
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from wearsim.cli import main
from wearsim.profile import standard
from wearsim.profile.files import write_profile

ROOT = Path(__file__).parents[1]

SCENE = """\
[scene]
kind = "rig"
[wheelset]
profile = "S1002"
[counterface]
profile = "60E1"
inclination = "1:40"
gauge_mm = 1435
roller_radius_mm = 1000
[contact]
model = "fast"
strips = 10
cells = 10
[[operation.block]]
name = "curving"
shift_mm = 3
yaw_mrad = 1
load_kN = 80
speed_km_h = 72
friction = 0.35
distance_km = 1
[campaign]
distance_km = 0.5
"""

COMPARISON = """\
[scene]
kind = "compare"
[compare]
rig = "rig.toml"
field = "service.toml"
"""

WHEEL_POINTS = "\n".join(f"{y},{-y / 40}" for y in range(-30, 60))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def line_of(text, part):
    """Line of the only line that holds `part`, counted from 1."""
    (line,) = [
        number for number, line in enumerate(text.splitlines(), 1) if part in line
    ]
    return line


def written(old=None, new=None, name="rig.toml", text=SCENE):
    """Write the scene with one change; return the line where it stands."""
    line = 1
    if old is not None:
        assert text.count(old) == 1
        line = line_of(text, old)
        text = text.replace(old, new)
    Path(name).write_text(text)
    return line


def snapshot(folder):
    """Every file below a folder with content and time of change."""
    return {
        path.relative_to(folder): (path.read_bytes(), path.stat().st_mtime_ns)
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name != ".lock"
    }


def error_of(capsys, *words):
    """Run a command that must be refused; return the lines it tells, none of which may
    be a traceback.
    """
    code = main(list(words))
    message = capsys.readouterr()
    assert code == 2, message
    assert message.out == ""
    assert "Traceback" not in message.err
    assert "internal error" not in message.err
    lines = message.err.splitlines()
    assert all(lines)
    return lines


BAD_VALUES = {
    "unknown key": (
        "load_kN = 80",
        "lod_kN = 80",
        ["unknown key lod_kN", "did you mean load_kN?"],
    ),
    "unknown section": (
        "[contact]",
        "[contacts]",
        ["unknown section [contacts]", "did you mean contact?"],
    ),
    "wrong type": (
        "load_kN = 80",
        'load_kN = "80"',
        ['load_kN = "80" must be a number', "kN"],
    ),
    "true is no number": (
        "friction = 0.35",
        "friction = true",
        ["friction = true must be a number"],
    ),
    "value out of range": (
        "gauge_mm = 1435",
        "gauge_mm = 143.5",
        ["at least 500 and at most 2000 mm"],
    ),
    "unit mistaken": (
        "speed_km_h = 72",
        "speed_km_h = 72000",
        ["at least 0.1 and at most 500 km/h"],
    ),
    "not finite": (
        "shift_mm = 3",
        "shift_mm = nan",
        ["shift_mm = nan must be a finite number", "mm"],
    ),
    "infinite": (
        "distance_km = 0.5",
        "distance_km = inf",
        ["distance_km = inf must be a finite number"],
    ),
    "negative load": (
        "load_kN = 80",
        "load_kN = -80",
        ["load_kN = -80", "at least 0.1", "kN"],
    ),
    "no load": ("load_kN = 80", "load_kN = 0", ["load_kN = 0", "at least 0.1"]),
    "load below the grid": (
        "load_kN = 80",
        "load_kN = 0.0001",
        ["load_kN = 0.0001", "at least 0.1"],
    ),
    "hardly any speed": (
        "speed_km_h = 72",
        "speed_km_h = 1e-300",
        ["at least 0.1 and at most 500 km/h"],
    ),
    "flange climbed": (
        "shift_mm = 3",
        "shift_mm = 15",
        [
            "more than 4 mm beyond the flange clearance of 6.6 mm",
            "right wheel",
            "give smaller shifts",
        ],
    ),
    "torque beyond friction": (
        "strips = 10",
        "torque_Nm = 26000",
        [
            "torque_Nm = 26000",
            "more than friction can carry in block",
            "2.576e+04 N m",
            "lower the torque",
        ],
    ),
    "friction 2": (
        "friction = 0.35",
        "friction = 2",
        ["friction = 2", "at least 0 and at most 1"],
    ),
    "yaw beyond 100 mrad": (
        "yaw_mrad = 1",
        "yaw_mrad = 101",
        ["yaw_mrad = 101", "at most 100 mrad"],
    ),
    "yaw below -100 mrad": (
        "yaw_mrad = 1",
        "yaw_mrad = -101",
        ["yaw_mrad = -101", "at least -100"],
    ),
    "unknown wear law": (
        "[contact]",
        '[wear]\nlaw = "usdf"\n[contact]',
        ['did you mean "usfd"?'],
    ),
    "roller smaller than the patch": (
        "roller_radius_mm = 1000",
        "roller_radius_mm = 4",
        ["roller_radius_mm = 4 must be at least 5 and", "give the radius"],
    ),
    "unknown profile": ('"S1002"', '"S1003"', ["S1003", "S1002"]),
    "missing profile file": (
        '"S1002"',
        '"worn.csv"',
        ['profile = "worn.csv"', "no such file", "next to"],
    ),
    "no TOML": ("strips = 10", "strips = = 10", ["not valid TOML", "key = value"]),
    "gauge narrower than the wheelset": (
        "gauge_mm = 1435",
        "gauge_mm = 1420",
        ["width over both flanges"],
    ),
    "wheel off the rail": (
        "gauge_mm = 1435",
        "gauge_mm = 1700",
        ["shift of 3 mm", "no contact", "check gauge_mm = 1700"],
    ),
}


@pytest.mark.parametrize(
    "command", [["check"], ["run", "--out", "out"]], ids=["check", "run"]
)
@pytest.mark.parametrize("case", sorted(BAD_VALUES))
def test_a_bad_value_is_one_line_with_its_place_and_nothing_is_written(
    folder, capsys, case, command
):
    old, new, message = BAD_VALUES[case]
    line = written(old, new)
    if case == "unknown wear law":
        line += 1
    if case == "wheel off the rail":
        line = line_of(SCENE, "shift_mm")
    before = snapshot(folder)
    faults = error_of(capsys, command[0], "rig.toml", *command[1:])
    # a misspelt required key is two faults: as unknown, and as missing at the table it
    # belongs to
    first = next(fault for fault in faults if fault.startswith(f"rig.toml:{line}: "))
    assert all(part in first for part in message), first
    if case == "unknown key":
        faults = [fault for fault in faults if "key load_kN is missing" not in fault]
    assert faults == [first]
    assert snapshot(folder) == before
    assert not Path("out").exists()


def test_all_faults_are_told_at_once_in_the_order_of_the_file(folder, capsys):
    text = SCENE.replace("load_kN = 80", "load_kN = -1").replace(
        "friction = 0.35", "friction = 2"
    )
    text = text.replace("gauge_mm = 1435", "gauge_m = 1.435").replace(
        "cells = 10", 'cells = "ten"'
    )
    Path("rig.toml").write_text(text)
    places = [
        fault.split(": ")[0]
        for fault in error_of(capsys, "run", "rig.toml", "--out", "out")
    ]
    parts = ("gauge_m =", "cells", "load_kN", "friction")
    assert places == [f"rig.toml:{line_of(text, part)}" for part in parts]


def test_faults_of_both_compared_scenes_are_told_with_their_file(folder, capsys):
    Path("both.toml").write_text(COMPARISON)
    line = written("friction = 0.35", "friction = 2")
    (rig, field) = error_of(capsys, "run", "both.toml", "--out", "out")
    assert rig.startswith(f"rig.toml:{line}: friction = 2")
    assert field.startswith("both.toml:5: ")
    assert "service.toml" in field
    assert not Path("out").exists()


def test_a_missing_scene_file_is_told_with_the_shipped_ones(folder, capsys):
    (fault,) = error_of(capsys, "run", "absent.toml", "--out", "out")
    assert fault.startswith("absent.toml: ")
    assert "rig_vs_field.toml" in fault
    assert not Path("out").exists()


BAD_PROFILES = {
    "too few points": (
        "0,0\n1,0.1\n2,0.2\n",
        None,
        ["number of points = 3 is too few", "at least 20"],
    ),
    "not a number": (
        WHEEL_POINTS.replace("\n10,", "\nnan,"),
        41,
        ["not a finite number", "delete the line"],
    ),
    "text": (WHEEL_POINTS.replace("\n10,", "\nten,"), 41, ["'ten' is not a number"]),
    "mixed units": (
        WHEEL_POINTS.replace("\n10,-0.25\n", "\n0.010,-0.00025\n"),
        41,
        ["off both neighbours", "give all points in one unit"],
    ),
    "metres": (
        "\n".join(f"{y / 1000},{-y / 40000}" for y in range(-30, 60)),
        None,
        ["if the numbers were 1000 times as large", "state them with units"],
    ),
    "empty": ("", None, ["number of points = 0 is too few"]),
}


@pytest.mark.parametrize("case", sorted(BAD_PROFILES))
def test_a_bad_profile_is_told_with_its_key_its_file_and_its_line(folder, capsys, case):
    text, row, message = BAD_PROFILES[case]
    Path("worn.csv").write_text(text)
    line = written('"S1002"', '"worn.csv"')
    (fault,) = error_of(capsys, "run", "rig.toml", "--out", "out")
    place = "worn.csv" if row is None else f"worn.csv:{row}"
    assert fault.startswith(f'rig.toml:{line}: profile = "worn.csv": {place}: ')
    assert all(part in fault for part in message), fault
    assert not Path("out").exists()


def half_rail():
    """Write half a rail head: wheels that run on its missing half have no contact to
    solve.
    """
    rail = standard.rail("60E1", 0.0, 1.435, 0.750)
    inner = rail.y < rail.y[np.argmin(rail.z)] + 2e-3
    write_profile(replace(rail, y=rail.y[inner], z=rail.z[inner]), "half.csv")


def test_a_class_and_a_watched_shift_without_contact_are_told_once_each(folder, capsys):
    """The right wheel leaves the half rail at shifts to the left, the left wheel at
    those to the right.
    """
    half_rail()
    text = (
        (ROOT / "workflows" / "field_given.toml")
        .read_text()
        .replace('"60E1"', '"half.csv"')
    )
    monitor = text.index("[operation.monitor]")
    text = text[:monitor] + text[monitor:].replace(
        "shifts_mm = [", "shifts_mm = [\n", 1
    )
    Path("field.toml").write_text(text)
    faults = error_of(capsys, "check", "field.toml")
    lines = text.splitlines()
    message = [lines[int(fault.split(":")[1]) - 1] for fault in faults]
    means = [line for line in lines if line.startswith("shift_mean_mm")]
    assert message[: len(means)] == means
    assert len(set(message)) == len(means) + 1  # and the line of the watched shifts


@pytest.mark.parametrize(
    "command", [["check"], ["run", "--out", "out"]], ids=["check", "run"]
)
def test_a_patch_at_the_edge_of_a_profile_is_told_at_every_shift_that_causes_it(
    folder, capsys, command
):
    half_rail()
    block = SCENE[SCENE.index("[[operation") : SCENE.index("[campaign]")]
    text = SCENE.replace('"60E1"', '"half.csv"').replace(
        "[campaign]", block + "[campaign]"
    )
    text = text.replace("shift_mm = 3", "shift_mm = -3", 1)
    Path("rig.toml").write_text(text)
    before = snapshot(folder)
    faults = error_of(capsys, command[0], "rig.toml", *command[1:])
    lines = [
        number for number, line in enumerate(text.splitlines(), 1) if "shift_mm" in line
    ]
    assert [fault.split(": ")[0] for fault in faults] == [
        f"rig.toml:{line}" for line in lines
    ]
    assert "shift of -3 mm" in faults[0]
    assert all("edge of a profile" in fault for fault in faults)
    assert all("check the shift, gauge_mm = 1435" in fault for fault in faults)
    assert snapshot(folder) == before
    assert not Path("out").exists()


def test_friction_0_is_allowed_warned_of_and_wears_nothing(folder, capsys, undrawn):
    from wearsim import open_results

    written("friction = 0.35", "friction = 0")
    assert main(["check", "rig.toml"]) == 0
    assert "friction = 0 everywhere: nothing will wear" in capsys.readouterr().out
    assert main(["run", "rig.toml", "--out", "out"]) == 0
    with open_results("out/rig.nc") as rig:
        assert float(rig["distance"][-1]) == pytest.approx(500.0, rel=1e-12)
        assert not rig["wear_depth"].any()
        assert not rig["worn_area"].any()
        assert float(rig["normal_force"].max()) > 79e3  # it did run, loaded


@pytest.mark.parametrize("out", ["file", "file/below", "n" * 300])
def test_an_output_directory_that_cannot_be_written_is_refused(folder, capsys, out):
    written()
    Path("file").write_text("somebody's")
    before = snapshot(folder)
    (fault,) = error_of(capsys, "run", "rig.toml", "--out", out)
    assert fault.startswith(f"{out} ")
    assert "choose another --out" in fault
    assert snapshot(folder) == before


def test_the_output_directory_of_another_campaign_is_refused_and_left_as_it_is(
    folder, capsys, undrawn
):
    written()
    assert main(["run", "rig.toml", "--out", "out"]) == 0
    capsys.readouterr()
    written("yaw_mrad = 1", "yaw_mrad = 2")
    before = snapshot(folder)
    (fault,) = error_of(capsys, "run", "rig.toml", "--out", "out")
    assert fault.startswith("out belongs to another campaign: ")
    assert "rig.toml" in fault
    assert "nothing was changed" in fault
    assert "choose another --out" in fault
    assert "wearsim resume out" in fault
    assert snapshot(folder) == before


@pytest.mark.parametrize("name", ["rig.nc", "report.html", "status.json"])
def test_files_of_our_names_that_are_not_ours_are_not_overwritten(folder, capsys, name):
    written()
    Path("out").mkdir()
    Path("out", name).write_text("somebody's")
    before = snapshot(folder)
    (fault,) = error_of(capsys, "run", "rig.toml", "--out", "out")
    assert fault.startswith(f"out already holds {name}")
    assert "choose another --out" in fault
    assert snapshot(folder) == before


# Ctrl-C is ignored in what a shell starts in the background, also by the tests' own
# shell.
RUN_AS_FROM_A_TERMINAL = """\
import signal, sys
from wearsim.cli import main
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.exit(main())
"""


@pytest.mark.slow
def test_a_second_run_in_one_directory_is_refused_and_the_first_goes_on(folder, capsys):
    """The first run is a process of its own; Ctrl-C ends it, and its directory is still
    a valid one.
    """
    written("distance_km = 0.5", "distance_km = 1e6\nmax_step_km = 0.01")
    words = [
        sys.executable,
        "-c",
        RUN_AS_FROM_A_TERMINAL,
        "run",
        "rig.toml",
        "--out",
        "out",
    ]
    with subprocess.Popen(
        words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    ) as first:
        try:
            limit = time.monotonic() + 120
            while not Path("out", "status.json").exists() and time.monotonic() < limit:
                assert first.poll() is None, first.stderr.read()
                time.sleep(0.05)
            (fault,) = error_of(capsys, "run", "rig.toml", "--out", "out")
            assert first.poll() is None
        finally:
            first.send_signal(signal.SIGINT)
            _, message = first.communicate(timeout=120)
    assert fault.startswith("another wearsim run works in out; ")
    assert "choose another --out" in fault
    assert first.returncode == 130
    assert "wearsim resume" in message
    assert main(["status", "out"]) == 0


ABSENT = {
    "resume": ["resume", "out"],
    "status": ["status", "out"],
    "report": ["report", "out"],
    "inspect": ["inspect", "rig.nc"],
    "translate": ["translate", "rig.nc", "field.nc"],
}


@pytest.mark.parametrize("command", sorted(ABSENT))
def test_a_missing_directory_or_result_is_one_line_with_the_way_out(
    folder, capsys, command
):
    (fault,) = error_of(capsys, *ABSENT[command])
    assert re.match(rf"{ABSENT[command][1]}:? ", fault)
    assert "wearsim run" in fault
    assert list(folder.iterdir()) == []


def test_a_file_that_is_no_result_is_refused(folder, capsys, impatient):
    Path("rig.nc").write_text("not netCDF")
    (fault,) = error_of(capsys, "inspect", "rig.nc")
    assert fault.startswith("rig.nc cannot be read as netCDF")
