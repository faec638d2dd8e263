"""`wearsim sweep` and `wearsim status` on its directory."""

import csv
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import filelock
import netCDF4
import numpy as np
import pytest

from wearsim import cli
from wearsim.profile.standard import shipped_path
from wearsim.results import ROW, open_results

DATA = Path(__file__).parents[1] / "data"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Working directory with the shipped sweep, coarser and shorter."""
    for name in ("rig_given.toml", "sweep_rig.toml"):
        text = shipped_path("workflows", name).read_text()
        for old, new in (
            ("[500, 1000, 5000]", "[500, 1000]"),
            ("distance_km = [90]", "distance_km = [6]\ncampaign.max_step_km = [2]"),
            ("strips = [20]", "strips = [8]"),
            ("cells = [20]", "cells = [8]"),
        ):
            assert name == "rig_given.toml" or old in text
            text = text.replace(old, new)
        text = text.replace('model = "standard"', 'model = "fast"')
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def rows(out):
    with open(out / "sweep.csv", newline="") as file:
        return list(csv.DictReader(file))


def test_the_shipped_sweep_is_right(capsys):
    assert cli.main(["check", "workflows/sweep_rig.toml"]) == 0
    message = capsys.readouterr().out
    assert "6 cases" in message
    assert (
        "case 6: rig_given.toml, counterface.roller_radius_mm = 5000, "
        "operation.block.friction = 0.35"
    ) in message


def test_cases_of_a_spreadsheet_with_decimal_commas(folder, capsys):
    Path("cases.csv").write_text(
        "operation.block.friction;counterface.roller_radius_mm\n0,2;500\n0,35;1000\n"
    )
    given = [
        "sweep",
        "rig_given.toml",
        "--table",
        "cases.csv",
        "--out",
        "out",
        "--list",
    ]
    assert cli.main(given) == 0
    message = capsys.readouterr()
    layout = "cases.csv: read as columns separated by semicolons, decimal commas"
    assert message.err.strip() == layout
    assert "friction = 0.35" in message.out


def test_a_sweep_runs_tells_its_table_and_its_status(folder, capsys):
    scene = Path("sweep_rig.toml")
    scene.write_text(scene.read_text().replace("[0.2, 0.35]", "[0.2]"))
    assert cli.main(["sweep", "sweep_rig.toml", "--out", "out", "--list"]) == 0
    listed = capsys.readouterr().out.splitlines()
    assert len(listed) == 2
    assert all(line.endswith(": not started") for line in listed)
    assert not Path("out").exists()
    assert cli.main(["sweep", "sweep_rig.toml", "--out", "out", "--case", "2"]) == 0
    assert "case 2: finished" in capsys.readouterr().out
    assert cli.main(["status", "out"]) == 0
    assert (
        capsys.readouterr().out.splitlines()[-1] == "2 cases: 1 not started, 1 finished"
    )
    assert cli.main(["sweep", "sweep_rig.toml", "--out", "out", "--jobs", "1"]) == 0
    message = capsys.readouterr()
    assert "2 cases: 2 finished" in message.out
    assert "case 1: begun, roller_radius_mm = 500, friction = 0.2" in message.err
    assert [row["state"] for row in rows(folder / "out")] == ["finished"] * 2
    assert (
        cli.main(["sweep", "sweep_rig.toml", "--out", "out", "--jobs", "1", "--json"])
        == 0
    )
    message = json.loads(capsys.readouterr().out)
    assert [row["counterface.roller_radius_mm"] for row in message] == [500, 1000]
    assert cli.main(["status", "out"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 3
    with open_results(next(Path("out").glob("**/rig.nc"))) as data:
        steps = data.sizes["step"] - 1
    assert steps > 2
    assert lines[0].startswith("case 1, rig: finished, 6 of 6 km (100 %), worst depth ")
    assert lines[0].endswith(f", step {steps}")
    assert cli.main(["status", "out", "--json"]) == 0
    message = json.loads(capsys.readouterr().out)
    assert [case["state"] for case in message["cases"]] == ["finished"] * 2
    assert message["cases"][0]["campaigns"]["rig"]["step"] == steps
    assert cli.main(["sweep", "sweep_rig.toml", "--out", "out", "--list"]) == 0
    assert all(
        line.endswith(": finished") for line in capsys.readouterr().out.splitlines()
    )
    assert cli.main(["report", "out"]) == 0
    text = Path("out/report.html").read_text()
    assert "2 cases: 2 finished." in text
    assert 'id="figure-sweep_counterface_roller_radius_mm"' in text


@pytest.mark.slow
def test_a_case_that_cannot_run_gives_the_exit_code_at_the_end(folder, capsys):
    (folder / "out" / "case_0001").mkdir(parents=True)
    with filelock.FileLock(folder / "out" / "case_0001" / ".lock"):
        code = cli.main(["sweep", "sweep_rig.toml", "--out", "out", "--jobs", "1"])
        assert cli.main(["sweep", "sweep_rig.toml", "--out", "out", "--case", "1"]) == 2
    assert code == 2
    message = capsys.readouterr()
    assert "4 cases: 1 failed, 3 finished" in message.out
    assert [row["state"] for row in rows(folder / "out")] == [
        "failed",
        "finished",
        "finished",
        "finished",
    ]
    assert "another wearsim run works in" in rows(folder / "out")[0]["fault"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["rig_given.toml"], "rig_given.toml: say what to vary"),
        (["sweep_rig.toml", "--vary", "wear.law=usfd"], "leave --vary and --table out"),
        (["sweep_rig.toml", "--case", "5"], "there is no case 5; give --case 1 to 4"),
        (
            ["rig_given.toml", "--vary", "wear.law=usfd,nothing"],
            'case 2: law = "nothing" is not',
        ),
        (["rig_given.toml", "--table", "no.csv"], "no.csv: cannot be read"),
        (["no.toml"], "no.toml: the scene file does not exist"),
    ],
)
def test_faults_are_one_line_and_nothing_is_written(folder, capsys, words, message):
    assert cli.main(["sweep", *words, "--out", "out"]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert message in lines[0]
    assert not Path("out").exists()


def test_the_example_of_the_help_can_run_as_it_stands(folder, capsys):
    """The words of `wearsim sweep --help`, listed, which checks every case."""
    with pytest.raises(SystemExit):
        cli.main(["sweep", "--help"])
    (example,) = [
        line
        for line in capsys.readouterr().out.splitlines()
        if " --vary wheelset" in line
    ]
    words = example.split()
    assert words[:2] == ["wearsim", "sweep"]
    assert cli.main([*words[1:], "--list"]) == 0
    listed = capsys.readouterr().out.splitlines()
    assert len(listed) == 4
    assert all(line.endswith(": not started") for line in listed)


def test_list_tells_impossible_cases(folder, capsys):
    words = [
        "sweep",
        "rig_given.toml",
        "--vary",
        "wear.law=usfd,energy",
        "--out",
        "out",
        "--list",
    ]
    assert cli.main(words) == 2
    good, bad = capsys.readouterr().out.splitlines()
    assert good.endswith("wear.law = usfd: not started")
    assert "wear.law = energy: impossible; " in bad
    assert 'coefficients = "lewis_dwyer_joyce_2004" belong to usfd' in bad
    assert cli.main([*words, "--json"]) == 2
    message = json.loads(capsys.readouterr().out)["cases"]
    assert [case["state"] for case in message] == ["not started", "impossible"]
    assert message[0]["fault"] == ""
    assert not Path("out").exists()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)]
)
def test_signals_leave_all_valid_and_the_same_command_goes_on_to_the_same_bits(
    folder, capsys, number, code
):
    """The signal reaches the parent only, as from a scheduler; its workers stop after a
    step.
    """
    text = Path("sweep_rig.toml").read_text()
    Path("sweep_rig.toml").write_text(
        text.replace("max_step_km = [2]", "max_step_km = [0.3]")
    )
    command = [
        sys.executable,
        "-m",
        "wearsim",
        "sweep",
        "sweep_rig.toml",
        "--jobs",
        "2",
        "--out",
        "out",
    ]
    status = folder / "out" / "case_0001" / "status.json"
    with subprocess.Popen(
        command, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        deadline = time.monotonic() + 300.0
        while process.poll() is None and time.monotonic() < deadline:
            if (
                status.is_file()
                and json.loads(status.read_text())["campaigns"]["rig"]["step"] >= 1
            ):
                break
            time.sleep(0.05)
        os.kill(process.pid, number)
        _, message = process.communicate()
        assert process.returncode == code, message
    assert "leaked" not in message  # semaphores, says Python
    assert "the same command goes on" in message
    assert "Traceback" not in message
    states = [row["state"] for row in rows(folder / "out")]
    assert "interrupted" in states
    assert states[3] == "not started"
    with netCDF4.Dataset("out/case_0001/rig.nc") as file:
        assert len(file.dimensions["step"]) >= 2
    assert cli.main(["sweep", "sweep_rig.toml", "--out", "out", "--case", "1"]) == 0
    assert cli.main(["sweep", "sweep_rig.toml", "--out", "whole", "--case", "1"]) == 0
    with (
        netCDF4.Dataset("out/case_0001/rig.nc") as one,
        netCDF4.Dataset("whole/case_0001/rig.nc") as other,
    ):
        assert all(np.array_equal(one[name][:], other[name][:]) for name in ROW)
