"""Files that are too large, too deep or too long are one line, soon; messages repeat
little of a file.
"""

import re
import time
from pathlib import Path

import netCDF4
import pytest

from wearsim import toml_faults
from wearsim.cli import main
from wearsim.errors import LONGEST_ECHO, MOST_FAULTS, Fault, SceneError

LONG = "a" * 500
DEEP = {
    "a key": ".".join("a" * 1000) + " = 1",
    "many parts": ".".join("a" * 100_000) + " = 1",
    "a table": f"[{'.'.join('b' * 1000)}]\nc = 1",
    "a list": f"a = {'[' * 200}{']' * 200}",
    "inline tables": "a = " + "{a = " * 200 + "1" + "}" * 200,
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def lines_of(capsys, *words):
    """Lines of a command that must be refused within 5 s."""
    began = time.monotonic()
    code = main(list(words))
    assert time.monotonic() - began < 5.0
    told = capsys.readouterr()
    assert code == 2, told
    assert "internal error" not in told.err
    return told.err.splitlines()


@pytest.mark.parametrize("case", DEEP)
def test_what_is_nested_too_deeply_is_one_line(folder, capsys, case):
    Path("scene.toml").write_text(f"# a scene\n{DEEP[case]}\n")
    for words in (
        ["check", "scene.toml"],
        ["profile", "S1002", "--limits", "scene.toml"],
    ):
        (line,) = lines_of(capsys, *words)
        assert "nested too deeply; write flat tables" in line
        assert "scene.toml:2: " in line or case not in (
            "a key",
            "many parts",
            "a table",
        )


def test_a_flag_of_a_thousand_parts_is_one_line(folder, capsys, scene_text):
    Path("scene.toml").write_text(scene_text({"shift_mm": 3, "distance_km": 1}))
    key = ".".join("a" * 1000)
    (line,) = lines_of(capsys, "check", "scene.toml", "--set", f"{key}=1")
    assert "the scene has no table for" in line


FOREIGN = {
    "a key": ("check", "scene.toml", f'[scene]\nkind = "rig"\n{LONG} = 1'),
    "a section": ("check", "scene.toml", f'[{LONG}]\na = 1\n[scene]\nkind = "rig"'),
    "a value": ("check", "scene.toml", f'[scene]\nkind = "{LONG}"'),
    "a list": ("check", "scene.toml", f'[scene]\nkind = ["{LONG}", "{LONG}"]'),
    "a key twice": ("check", "scene.toml", f"[{LONG}]\n[{LONG}]"),
    "a number": ("check", "scene.toml", f'[scene]\nkind = "rig"\ntitle = 1{"0" * 500}'),
    "limits": (
        "profile S1002 --limits",
        "limits.toml",
        f'title = "a"\n[{LONG}]\na = 1',
    ),
    "points": ("profile", "wheel.csv", f"1,{LONG}\n2,3\n"),
    "miniprof": (
        "profile",
        "wheel.whl",
        f"ColumnDef={LONG}\n{LONG}={LONG}\n1 {LONG}\n",
    ),
    "simpack": (
        "profile",
        "wheel.prw",
        f"header.begin\n {LONG} = {LONG}\nheader.end\nspline.begin\n{LONG}\n",
    ),
    "a sweep": (
        "check",
        "sweep.toml",
        (
            '[scene]\nkind = "sweep"\n[sweep]\nbase = "rig.toml"\n[sweep.vary]\n'
            f"{LONG} = 1"
        ),
    ),
    "a column": ("contact --table", "points.csv", f"{LONG},shift_mm\n1,{LONG}\n"),
}


@pytest.mark.parametrize("case", FOREIGN)
def test_messages_repeat_little_of_a_file(folder, capsys, case):
    command, name, text = FOREIGN[case]
    Path(name).write_text(text)
    for line in lines_of(capsys, *command.split(), name):
        assert not re.search(rf"([a0])\1{{{LONGEST_ECHO}}}", line), line


@pytest.mark.parametrize(
    ("command", "name", "most"),
    [
        ("check", "scene.toml", 2_000_000),
        ("profile", "wheel.csv", 20_000_000),
        ("profile S1002 --limits", "limits.toml", 2_000_000),
        ("contact --table", "points.csv", 3_000_000),
    ],
)
def test_a_file_that_is_too_large_is_one_line(
    folder, capsys, monkeypatch, command, name, most
):
    monkeypatch.setattr("wearsim.studies.contact_table.LARGEST_TABLE", 3_000_000)
    with open(name, "wb") as file:
        file.truncate(most + 1)
    (line,) = lines_of(capsys, *command.split(), name)
    assert f"larger than {most // 1_000_000} MB" in line


RECORDED = """[scene]
kind = "field"
[wheelset]
profile = "S1002"
[counterface]
profile = "60E1"
inclination = "1:40"
gauge_mm = 1435
[recorded]
file = "run.nc"
shift_positive = "right"
load_kN = 80
friction = 0.3
[recorded.columns]
time_s = "t"
shift_mm = "y"
speed_km_h = "v"
[campaign]
distance_km = 100
"""


def test_a_record_of_500_million_samples_is_one_line(folder, capsys):
    Path("scene.toml").write_text(RECORDED)
    with netCDF4.Dataset("run.nc", "w") as file:
        file.createDimension("sample", 500_000_000)
        for name in "tyv":
            file.createVariable(name, "f8", ("sample",), chunksizes=(1000,), zlib=True)
    (line,) = lines_of(capsys, "check", "scene.toml")
    assert "run.nc: cannot be read as netCDF (it is too large)" in line


def test_of_many_faults_the_first_are_told(folder, capsys):
    error = SceneError([Fault(f"fault {k}", "a.toml", k) for k in range(1, 101)])
    assert len(error.faults) == 100
    lines = str(error).splitlines()
    assert len(lines) == MOST_FAULTS + 1
    assert lines[-2:] == [
        "a.toml:20: fault 20",
        "and 80 more faults that are not shown",
    ]
    Path("points.csv").write_text("shift_mm\n" + "x\n" * 500)
    told = lines_of(capsys, "contact", "--table", "points.csv")
    assert len(told) == MOST_FAULTS + 1
    assert told[-1] == "and 480 more faults that are not shown"


def test_cells_that_a_spreadsheet_would_run_are_warned_of(folder, capsys):
    Path("wheels").mkdir()
    for name in ("=cmd|' -C calc'!A0.csv", "-1.csv"):
        assert (
            main(
                [
                    "profile",
                    "S1002",
                    "--convert",
                    "two-column",
                    "--out",
                    f"wheels/{name}",
                ]
            )
            == 0
        )
    capsys.readouterr()
    for target in ("table.csv", "-"):
        assert main(["profile", "--fleet", "wheels", "--csv", target]) == 0
        (line,) = [
            line
            for line in capsys.readouterr().err.splitlines()
            if line.startswith("warning: ")
        ]
        assert "would run the cell" in line
        assert "as a formula; import its columns as text" in line


def test_carried_cells_that_a_spreadsheet_would_run_are_warned_of(folder, capsys):
    Path("points.csv").write_text("shift_mm,remark\n-1,=1+1\n")
    assert main(["contact", "--table", "points.csv"]) == 0
    assert (
        "points.csv: a spreadsheet would run the cell '=1+1' as a formula"
        in capsys.readouterr().err
    )


def test_a_plain_scene_passes_all_of_these_limits():
    text = "[a.b.c]\nd.e = [[1, 2], [3]]\nx = {y = {z = 1}}\n# " + "word. " * 40
    assert toml_faults.toml_of(text, "a.toml")["a"]["b"]["c"]["d"] == {
        "e": [[1, 2], [3]]
    }


HIDDEN = {
    "a value": ("check", "scene.toml", '[scene]\nkind = "\u202e"'),
    "a key": ("check", "scene.toml", '[scene]\nkind = "rig"\n"\u202e" = 1'),
    "a cell": ("contact --table", "points.csv", "shift_mm\n\u202e\n"),
    "a column": ("sweep scene.toml --table", "cases.csv", "\u202e\n1\n"),
}


@pytest.mark.parametrize("case", HIDDEN)
def test_what_a_terminal_obeys_is_escaped(folder, capsys, scene_text, case):
    """The mark that turns the direction of writing, from which a message would look
    like another one.
    """
    Path("scene.toml").write_text(scene_text({"shift_mm": 3, "distance_km": 1}))
    command, name, text = HIDDEN[case]
    Path(name).write_text(text)
    lines = lines_of(capsys, *command.split(), name)
    assert all(line.isprintable() for line in lines)
    assert any("\\u202e" in line for line in lines)


def test_cells_of_a_sweep_are_escaped_where_cases_are_listed(
    folder, capsys, scene_text
):
    Path("scene.toml").write_text(scene_text({"shift_mm": 3, "distance_km": 1}))
    Path("cases.csv").write_text("wheelset.radius_mm\n4\u202e60\n")
    assert main(["sweep", "scene.toml", "--table", "cases.csv", "--list"]) == 2
    (line,) = capsys.readouterr().out.splitlines()
    assert line.isprintable()
    assert "radius_mm = 4\\u202e60: impossible" in line


def test_of_many_shares_the_first_are_summed(folder, capsys, scene_text):
    classes = [{"shift_mean_mm": 0, "shift_std_mm": 1, "share": 0.5}] * 100
    Path("scene.toml").write_text(scene_text(*classes, kind="field"))
    (line,) = lines_of(capsys, "check", "scene.toml")
    assert line.count("0.5 + ") == 10
    assert "... (90 more), must sum to 1 within" in line
