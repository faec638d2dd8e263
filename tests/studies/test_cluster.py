"""A sweep on a Dask cluster: two worker processes here, one of which is killed."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import ExitStack
from pathlib import Path

import netCDF4
import numpy as np
import pytest

import wearsim
from wearsim import cli
from wearsim.errors import ResultError
from wearsim.results import ROW
from wearsim.scene.sweep import Case
from wearsim.studies.ensemble import _run_on_worker
from wearsim.studies.ensemble import cluster as connect

pytestmark = [
    # threads and sockets of Dask's client that end after the last reference is gone
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


@pytest.fixture
def folder(tmp_path, monkeypatch, coarse_rig):
    """Working directory with a coarse rig of some twenty steps."""
    (tmp_path / "rig.toml").write_text(coarse_rig(2, "max_step_km = 0.1"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def cluster(tmp_path):
    """Scheduler file, and the processes of two workers that nobody restarts."""
    file, log = tmp_path / "scheduler.json", (tmp_path / "dask.log").open("w")
    environment = {
        **os.environ,
        "OMP_NUM_THREADS": "1",
        "DASK_DISTRIBUTED__DASHBOARD__LINK": "",
    }

    def start(module, *flags):
        command = [
            sys.executable,
            "-m",
            f"distributed.cli.{module}",
            "--no-dashboard",
            "--scheduler-file",
            file,
        ]
        return stack.enter_context(
            subprocess.Popen(
                [*command, *flags], stderr=log, stdout=log, cwd="/", env=environment
            )
        )

    with log, ExitStack() as stack:
        processes = [start("dask_scheduler", "--host", "127.0.0.1", "--port", "0")]
        flags = (
            "--no-nanny",
            "--nthreads",
            "1",
            "--local-directory",
            tmp_path / "dask",
        )
        processes += [start("dask_worker", *flags) for _ in range(2)]
        try:
            while not file.is_file() and processes[0].poll() is None:
                time.sleep(0.05)
            yield file, processes[1:]
        finally:
            for process in processes:
                process.kill()


def steps(case):
    status = case / "status.json"
    return (
        json.loads(status.read_text())["campaigns"]["rig"]["step"]
        if status.is_file()
        else 0
    )


@pytest.mark.slow
def test_a_killed_worker_loses_no_step_and_the_bits_are_those_of_one_process(
    folder, cluster, capsys
):
    file, workers = cluster
    words = ["sweep", "rig.toml", "--vary", "wheelset.radius_mm=420,440,460"]
    killed, written = (
        [],
        set(),
    )  # the worker, and when the first step of its case was recorded

    def kill_one():
        case = Path("out", "case_0001")
        while steps(case) < 3:
            time.sleep(0.01)
        lock = str((case / ".lock").absolute())
        for worker in workers:
            if any(
                os.path.realpath(file) == lock
                for file in Path(f"/proc/{worker.pid}/fd").iterdir()
            ):
                os.kill(worker.pid, signal.SIGKILL)
                killed.append(worker)
        while steps(case) < 12:
            written.add(
                next((case / ".rig.records").glob("00000001.*")).stat().st_mtime_ns
            )
            time.sleep(0.01)

    killer = threading.Thread(target=kill_one, daemon=True)
    killer.start()
    assert cli.main([*words, "--out", "out", "--cluster", str(file)]) == 0
    message = capsys.readouterr()
    assert len(written) == 1  # never computed again
    (worker,) = killed
    assert worker.wait(1.0) == -signal.SIGKILL
    assert "3 cases: 3 finished" in message.out
    assert "(3 of 3)" in message.err
    assert cli.main([*words, "--out", "whole", "--jobs", "1"]) == 0
    for case in ("case_0001", "case_0002", "case_0003"):
        with (
            netCDF4.Dataset(f"out/{case}/rig.nc") as one,
            netCDF4.Dataset(f"whole/{case}/rig.nc") as other,
        ):
            assert one.dimensions["step"].size > 15
            assert all(np.array_equal(one[name][:], other[name][:]) for name in ROW)


LOAD = """[[uncertainty.input]]
name = "load"
key = "operation.load_kN"
acts = "factor"
distribution = "normal"
mean = 1.0
std = 0.03
"""


@pytest.mark.parametrize(
    "words",
    [
        ("sweep", "rig.toml", "--vary", "wheelset.radius_mm=420"),
        ("run", "rig.toml", "--bands"),
    ],
)
def test_no_scheduler_and_no_dask_are_one_line_and_nothing_is_run(
    folder, capsys, monkeypatch, words
):
    if "--bands" in words:
        with Path("rig.toml").open("a") as scene:
            scene.write(LOAD)
    words = [*words, "--out", "out", "--cluster"]
    assert cli.main([*words, "absent.json"]) == 2
    line = capsys.readouterr().err.splitlines()[-1]
    assert line.startswith(
        "absent.json: there is no such file of a Dask scheduler; start"
    )
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert cli.main([*words, "tcp://127.0.0.1:1"]) == 2
    line = capsys.readouterr().err.splitlines()[-1]
    assert line.endswith("pip install 'wearsim[cluster]'")
    assert not Path("out").exists()


@pytest.mark.slow
def test_an_address_where_nobody_listens_is_one_line(monkeypatch):
    pytest.importorskip(
        "distributed"
    )  # before the setting, which would take the defaults along when it ends
    import dask

    with (
        dask.config.set({"distributed.comm.timeouts.connect": "1s"}),
        pytest.raises(
            ResultError,
            match=r"^tcp://127\.0\.0\.1:1: no Dask scheduler answers \(.*address$",
        ),
        connect("tcp://127.0.0.1:1"),
    ):
        pass


def test_a_worker_of_another_version_or_without_the_folder_runs_nothing(folder):
    case = Case(1, folder / "rig.toml")
    given = {"patience": 0.0, "command": "", "folder": folder}
    other = _run_on_worker(case, out=folder, version="0.0.1", **given)
    away = _run_on_worker(
        case, out=folder / "away", version=wearsim.__version__, **given
    )
    assert "not 0.0.1; install the same one" in other.fault
    assert (
        f"no folder {folder / 'away'}; take one that all machines share" in away.fault
    )
    assert (other.exit_code, away.exit_code) == (2, 2)
    assert sorted(path.name for path in folder.iterdir()) == ["rig.toml"]


def test_after_ctrl_c_no_worker_begins_a_case(folder):
    (folder / ".stop").touch()
    given = {
        "version": wearsim.__version__,
        "patience": 0.0,
        "command": "",
        "folder": folder,
    }
    assert (
        _run_on_worker(Case(1, folder / "rig.toml"), out=folder, **given).state
        == "interrupted"
    )
    assert not (folder / "case_0001").exists()
