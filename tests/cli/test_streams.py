"""Closed, full and broken standard streams, terminals of few characters, names in other
encodings.
"""

import io
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import netCDF4
import pytest

from wearsim.cli import main

ROOT = Path(__file__).parents[2]


def run(command, **options):
    """Run a line of the shell in which W is wearsim; return exit code, output and
    messages.
    """
    program = f'W() {{ "{sys.executable}" -m wearsim "$@"; }}\n{command}'
    paths = {"PYTHONPATH": str(ROOT)} | options.pop("env", {})
    done = subprocess.run(
        ["bash", "-c", program],
        capture_output=True,
        timeout=60,
        env=os.environ | paths,
        **options,
    )
    return done.returncode, done.stdout, done.stderr.decode()


@pytest.mark.parametrize(
    ("command", "code", "message"),
    [
        (
            "W --help > /dev/full",
            2,
            "standard output cannot be written: No space left on device",
        ),
        pytest.param("W schema >&-", 0, "", marks=pytest.mark.slow),
        pytest.param("W check none.toml 2>&-", 2, "", marks=pytest.mark.slow),
        ("W check none.toml 2>/dev/full >&-", 2, ""),
        pytest.param(
            "W schema > /dev/full",
            2,
            "standard output cannot be written",
            marks=pytest.mark.slow,
        ),
        pytest.param("W --help >&- 2>&-", 0, "", marks=pytest.mark.slow),
        pytest.param(
            "W schema | head -1; exit ${PIPESTATUS[0]}", 0, "", marks=pytest.mark.slow
        ),
    ],
)
def test_a_stream_that_takes_nothing_is_no_fault_of_wearsim(
    tmp_path, command, code, message
):
    found, _, told = run(command, cwd=tmp_path)
    assert found == code, told
    assert told.startswith(message)
    assert len(told.splitlines()) == bool(message)
    assert os.listdir(tmp_path) == []


def test_a_campaign_goes_on_where_its_messages_cannot_be_written(
    tmp_path, monkeypatch, scene_text, undrawn
):
    (tmp_path / "scene.toml").write_text(
        scene_text({"shift_mm": 3, "distance_km": 1}, campaign="distance_km = 1")
    )
    with open("/dev/full", "w", encoding="utf-8", buffering=1) as full:
        monkeypatch.setattr(sys, "stderr", full)
        assert (
            main(["run", str(tmp_path / "scene.toml"), "--out", str(tmp_path / "out")])
            == 0
        )
    assert (tmp_path / "out" / "rig.nc").is_file()


def test_an_ascii_terminal_gets_escapes_and_json_stays_json(
    tmp_path, monkeypatch, write_campaign
):
    path = write_campaign(tmp_path / "rig.nc", "rig", 2, 10e-9)
    with netCDF4.Dataset(path, "a") as file:
        file.title = "µ ≤ 0.3"
    for words in (["inspect", str(path)], ["inspect", str(path), "--json"]):
        terminal = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
        monkeypatch.setattr(sys, "stdout", terminal)
        assert main(words) == 0
        shown = terminal.buffer.getvalue().decode("ascii")
        assert (
            json.loads(shown)["title"] == "µ ≤ 0.3"
            if "--json" in words
            else "\\xb5 \\u2264 0.3" in shown
        )


def test_names_in_another_encoding_are_escaped_where_they_are_shown(
    tmp_path, capsysbinary, monkeypatch, scene_text, undrawn
):
    """A scene and a wheel whose names are Latin-1."""
    monkeypatch.chdir(tmp_path)
    scene, wheel = (os.fsdecode(name) for name in (b"sc\xe9ne.toml", b"w\xe9.csv"))
    assert main(["profile", "S1002", "--convert", "two-column", "--out", wheel]) == 0
    text = scene_text({"shift_mm": 3, "distance_km": 1}, campaign="distance_km = 1")
    Path(scene).write_text(text)
    assert main(["run", scene, "--out", "out"]) == 0
    assert main(["inspect", "out/rig.nc"]) == 0
    assert main(["profile", wheel, "--plot", "w.svg"]) == 0
    assert (
        "w\\udce9" in Path("w.svg").read_text()
        or b"w\\udce9" in capsysbinary.readouterr().out
    )
    capsysbinary.readouterr()
    with netCDF4.Dataset(shutil.copy("out/rig.nc", "other.nc"), "a") as file:
        file["environment"][:] = 0.5
    for words in (
        ["run", scene, "--out"],
        ["translate", "out/rig.nc", "other.nc", "--out"],
    ):
        assert main([*words, os.fsdecode(b"r\xe9sults")]) == 2
        (line,) = [
            line
            for line in capsysbinary.readouterr().err.splitlines()
            if b"warning" not in line
        ]
        assert b"must be UTF-8; choose another" in line
