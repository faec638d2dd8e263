"""Short flags, JSON of a run, scenes from standard input, run directories to inspect,
the nearest names.
"""

import io
import json
import subprocess
import sys
from pathlib import Path

import pytest

from wearsim.cli import main


@pytest.fixture
def text(scene_text):
    return scene_text({"shift_mm": 3, "distance_km": 1}, campaign="distance_km = 1")


@pytest.fixture
def stdin(monkeypatch, tmp_path):
    """Function that gives a text to the command line."""
    monkeypatch.chdir(tmp_path)

    def give(text):
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text.encode())))

    return give


def test_a_run_from_standard_input_prints_json_and_resumes(
    stdin, text, capsys, undrawn
):
    stdin(f"# from a script\n{text}")
    assert (
        main(
            ["run", "-", "-o", "out", "-q", "--json", "--set", "campaign.distance_km=2"]
        )
        == 0
    )
    message = capsys.readouterr()
    assert message.err == ""
    value = json.loads(message.out)
    assert value["results"] == {"rig": "out/rig.nc"}
    assert value["report"] == "out/report.html"
    assert value["warnings"] == {"rig": []}
    assert value["campaigns"]["rig"]["state"] == "finished"
    assert value["campaigns"]["rig"]["distance"] == 2000.0
    assert "# from a script" in Path("out/scene/stdin.toml").read_text()
    assert main(["resume", "out", "-q", "--set", "campaign.distance_km=2.5"]) == 0
    assert capsys.readouterr() == ("report: out/report.html\n", "")


def test_a_scene_from_standard_input_is_checked_with_its_lines(stdin, text, capsys):
    stdin(text.replace('kind = "rig"', 'kind = "rig"\nkinds = 3'))
    assert main(["check", "-"]) == 2
    line = text[: text.index('kind = "rig"')].count("\n") + 2
    assert capsys.readouterr().err.startswith(
        f"stdin.toml:{line}: unknown key kinds in [scene]"
    )
    stdin(text)
    assert main(["check", "-", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["kind"] == "rig"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["run", "-"], "a scene from stdin has no name; give --out DIR"),
        (
            ["run", "-", "-o", "out", "--bands"],
            "--bands reads the scene again for each draw; give a file",
        ),
    ],
)
def test_what_standard_input_cannot_give_is_one_line(
    stdin, text, capsys, words, message
):
    stdin(text)
    assert main(words) == 2
    assert capsys.readouterr().err.startswith(message)
    assert not Path("out").exists()


def test_a_run_directory_is_inspected(stdin, text, tmp_path, capsys, undrawn):
    Path("own.toml").write_text(text)
    assert main(["run", "own.toml", "-o", "out", "-q"]) == 0
    capsys.readouterr()
    assert main(["inspect", "out/rig.nc", "--json"]) == 0
    of_file = json.loads(capsys.readouterr().out)
    assert main(["inspect", "out", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"rig": of_file}
    assert main(["inspect", "out/rig.nc"]) == 0
    summary = capsys.readouterr().out
    assert main(["inspect", "out"]) == 0
    assert capsys.readouterr().out == summary
    assert main(["inspect", str(tmp_path)]) == 2
    assert "is not a run directory" in capsys.readouterr().err
    Path("out/rig.nc").unlink()
    assert main(["inspect", "out"]) == 2
    assert (
        capsys.readouterr().err == "out has no result yet; see `wearsim status out`\n"
    )


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (["chek", "rig.toml"], "check"),
        (["new", "feild"], "field"),
        (["run", "rig.toml", "--smoothing", "of"], "off"),
        (["contact", "--wheel-lod-kN", "80"], "--wheel-load-kN"),
    ],
)
def test_the_nearest_command_or_choice_is_named(words, meant, capsys):
    with pytest.raises(SystemExit) as caught:
        main(words)
    assert caught.value.code == 2
    assert f"; did you mean '{meant}'?; see `wearsim" in capsys.readouterr().err


def test_an_unknown_argument_is_a_fault_of_its_command(capsys):
    with pytest.raises(SystemExit) as caught:
        main(["run", "rig.toml", "more"])
    assert caught.value.code == 2
    expected = "wearsim run: unrecognized arguments: more; see `wearsim run --help`\n"
    assert capsys.readouterr().err == expected


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("workflows/rig_vs_feild.toml", "rig_vs_field.toml"),
        ("fatige", "fatigue.toml"),
        ("mine/our_whel.toml", "our_wheel.toml"),
    ],
)
def test_the_nearest_scene_is_named(tmp_path, monkeypatch, capsys, name, meant):
    monkeypatch.chdir(tmp_path)
    Path("mine").mkdir()
    Path("mine/our_wheel.toml").touch()
    assert main(["check", name]) == 2
    assert capsys.readouterr().err.endswith(f"; did you mean '{meant}'?\n")


def test_many_cases_are_quiet_but_for_those_that_fail(stdin, text, capsys):
    Path("own.toml").write_text(text)
    words = [
        "sweep",
        "own.toml",
        "--vary",
        "wear.scale=1,2",
        "-j",
        "1",
        "-q",
        "-o",
        "out",
    ]
    assert main(words) == 0
    message = capsys.readouterr()
    assert message.err == ""
    assert message.out.startswith("2 cases: 2 finished\n")


COMPLETED = """
source {script}
complete_of() {{
    COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)) COMPREPLY=()
    _shtab_wearsim
    printf '%s\n' "${{COMPREPLY[@]}}"
}}
complete_of wearsim ch
echo
complete_of wearsim translate --fi
echo
complete_of wearsim run sc
"""


def test_a_shell_completes_commands_flags_and_files(tmp_path, capsys):
    with pytest.raises(SystemExit, match="0"):
        main(["--print-completion", "bash"])
    script = tmp_path / "completion.bash"
    script.write_text(capsys.readouterr().out)
    (tmp_path / "scene.toml").write_text("")
    done = subprocess.run(
        ["bash", "-c", COMPLETED.format(script=script)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    commands, flags, files = done.stdout.split("\n\n")
    assert set(commands.split()) == {"check", "chart"}
    assert flags.split() == ["--field-km"]
    assert files.split() == ["scene.toml"]
