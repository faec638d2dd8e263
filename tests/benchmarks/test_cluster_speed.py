"""Many short cases on Dask workers of this machine: rate of two against one, overhead
per case.
"""

import os
import subprocess
import sys
import time
from contextlib import ExitStack

import pytest

from wearsim.scene.sweep import sweep_of_flags
from wearsim.studies.ensemble import Runner, check_cases, cluster

pytestmark = [
    pytest.mark.benchmark,
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]
CASES = max(int(500 * float(os.environ.get("WEARSIM_LONG_RUNS", "1"))), 4)


def rate(sweep, out, workers, file):
    """Cases per second on so many workers, with everything compiled and imported in
    each.
    """
    flags = [
        "--no-dashboard",
        "--no-nanny",
        "--nthreads",
        "1",
        "--scheduler-file",
        file,
    ]
    command = [sys.executable, "-m", "distributed.cli.dask_worker", *map(str, flags)]
    alone = {**os.environ, "OMP_NUM_THREADS": "1"}  # as Dask's nannies set it
    with ExitStack() as stack:
        processes = [
            stack.enter_context(
                subprocess.Popen(
                    command,
                    env=alone,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                )
            )
            for _ in range(workers)
        ]
        try:
            with cluster(str(file)) as executor:
                (out / "warm").mkdir(parents=True)
                executor._client.wait_for_workers(workers)
                Runner(executor).run(sweep.cases[:workers], out / "warm")
                began = time.perf_counter()
                outcomes = Runner(executor).run(sweep.cases, out)
                took = time.perf_counter() - began
            assert {outcome.state for outcome in outcomes} == {"finished"}
            return len(outcomes) / took
        finally:
            for process in processes:
                process.kill()


def test_short_cases(tmp_path, show, coarse_rig):
    """Overhead: what one worker takes per case beyond the same cases in this
    process.
    """
    (tmp_path / "rig.toml").write_text(coarse_rig(1))
    radii = ",".join(f"{400 + 0.1 * number:g}" for number in range(CASES))
    sweep = sweep_of_flags(
        str(tmp_path / "rig.toml"), [f"wheelset.radius_mm={radii}"], None
    )
    began = time.perf_counter()
    check_cases(sweep.cases)
    checked = (time.perf_counter() - began) / CASES
    (tmp_path / "here").mkdir()
    Runner(jobs=1).run(sweep.cases[:1], tmp_path / "here")
    few = sweep.cases[1 : 1 + max(CASES // 5, 2)]
    began = time.perf_counter()
    Runner(jobs=1).run(few, tmp_path / "here")
    alone = (time.perf_counter() - began) / len(few)
    file = tmp_path / "scheduler.json"
    command = [
        sys.executable,
        "-m",
        "distributed.cli.dask_scheduler",
        "--host",
        "127.0.0.1",
        "--port",
        "0",
    ]
    command += ["--no-dashboard", "--scheduler-file", str(file)]
    with subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as scheduler:
        try:
            while not file.is_file():
                time.sleep(0.1)
            one, two = (
                rate(sweep, tmp_path / f"of {count}", count, file) for count in (1, 2)
            )
        finally:
            scheduler.kill()
    show(
        f"{CASES} cases: {alone:.3f} s per case in this process, {checked:.3f} s to "
        "check one before"
    )
    show(
        f"one worker: {1 / one:.3f} s per case, overhead "
        f"{1e3 * (1 / one - alone):.0f} ms"
    )
    show(f"two workers: {two / (2 * one):.1%} of twice the rate of one worker")
