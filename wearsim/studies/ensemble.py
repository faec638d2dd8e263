"""Many campaigns, each in a run directory of its own, by an executor of Python.

A case is a campaign like any other: it is locked, recorded and continued by itself, so
that the same call goes on after whatever stopped it.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import socket
import threading
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from concurrent import futures
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from wearsim import __version__
from wearsim.campaign.directory import (
    campaigns_of,
    is_claimed,
    is_locked,
    read_manifest,
    read_status,
    require_same_scene,
)
from wearsim.campaign.event import Event
from wearsim.campaign.record import readable_errors
from wearsim.campaign.run import Observer, run_scene, scene_files
from wearsim.contact.solve import available_cores
from wearsim.errors import Fault, ResultError, SceneError, WearsimError
from wearsim.plugins import Registered, register_all, registered
from wearsim.scene import load_campaign
from wearsim.scene.initial_contact import check_contact
from wearsim.scene.overrides import at_its_source
from wearsim.scene.sweep import Case

_THREADS = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
)
_MOST_LOSSES = 2
_LOST = (
    "its process died, killed or out of memory; its finished steps are safe, run the "
    "same command again"
)
_GONE = (
    "its workers or their scheduler are gone; its finished steps are safe, run the "
    "same command again"
)
_STOP = ".stop"
"""File in the folder of the run directories after Ctrl-C: where workers find it, they
stop after a step.
"""
_PATIENCE = 60.0  # of workers of other machines for the lock of a case [s]

_one_per_process = threading.Lock()
"""The netCDF library crashes when two threads use it; threads of one worker wait for
each other.
"""


@dataclass(frozen=True)
class Outcome:
    """State of the case of a number, and the fault if it failed.

    The state is "finished", "failed", "interrupted", "stopped" (killed), "running" or
    "not started"; the exit code is 2 for bad input, 3 for a numerical failure or
    internal error, 130 if interrupted, else 0.
    """

    number: int
    state: str
    fault: str = ""
    exit_code: int = 0


Report = Callable[[int, Outcome], None]
Task = Callable[[Case], Outcome]


def check_cases(cases: Iterable[Case], out: Path | None = None) -> tuple[Fault, ...]:
    """Check the scene of every case.

    And that no run directory in `out` belongs to another campaign.

    Returns
    -------
    tuple of Fault
        Warnings.

    Raises
    ------
    SceneError
        With the faults of all cases, each once with the numbers of its cases.
    ResultError
        If run directories belong to other campaigns; nothing is written then.
    """
    faults, warnings = (
        defaultdict[Fault, list[int]](list),
        defaultdict[Fault, list[int]](list),
    )
    foreign = []
    for case in cases:
        try:
            scene = load_campaign(case.base, overrides=case.overrides)
            if out is not None and is_claimed(out / case.name):
                require_same_scene(
                    out / case.name, read_manifest(out / case.name), scene_files(scene)
                )
            for warning in check_contact(scene):
                warnings[at_its_source(warning)].append(case.number)
        except SceneError as error:
            for fault in dict.fromkeys(error.faults):
                faults[fault].append(case.number)
        except ResultError as error:
            foreign.append(f"case {case.number}: {error}")
    if faults:
        listed = [_of_cases(fault, numbers) for fault, numbers in faults.items()]
        raise SceneError(
            sorted(listed, key=lambda fault: (fault.file or "", fault.line or 0))
        )
    if foreign:
        raise ResultError("\n".join(foreign))
    return tuple(_of_cases(warning, numbers) for warning, numbers in warnings.items())


@dataclass(frozen=True)
class Runner:
    """Runs many cases, or continues them; one that fails does not stop the others.

    Parameters
    ----------
    executor : concurrent.futures.Executor, optional
        That of Dask (`studies.ensemble.cluster`), of mpi4py, or any other, in place of
        processes of this machine. The directory of the cases must be the same for all
        its workers; threads of one process run one case at a time.
    jobs : int, optional
        Processes on this machine with one thread each, by default as many as it has
        cores to use.
    command : str
        Command line, for the history of the results.
    report : callable, optional
        Called with the number of cases submitted so far and the outcome of each case
        when it ends, and with state "running" when a process of this machine gets it.
    """

    executor: Executor | None = None
    jobs: int | None = None
    command: str = ""
    report: Report | None = None

    def run(
        self, cases: Sequence[Case], out: str | Path, before: int = 0
    ) -> tuple[Outcome, ...]:
        """Run cases, best checked by `check_cases` before.

        Parameters
        ----------
        cases : sequence of Case
        out : str or Path
            Existing directory; case 1 runs in `case_0001` in it.
        before : int
            Number of cases that were submitted before, for the report.

        Returns
        -------
        tuple of Outcome
            In the order of the cases.

        Raises
        ------
        KeyboardInterrupt
            After Ctrl-C, when the running cases have written their last step.
        """
        out, executor = Path(out).absolute(), self.executor
        with readable_errors(f"{out} cannot be written"):
            (out / _STOP).unlink(missing_ok=True)
        jobs = (
            min(self.jobs or available_cores(), max(len(cases), 1))
            if executor is None
            else len(cases)
        )
        task = partial(
            _run_on_worker,
            out=out,
            folder=Path.cwd(),
            version=__version__,
            patience=0.0 if executor is None else _PATIENCE,
            command=self.command,
            registered=registered(),
        )
        outcomes: dict[int, Outcome] = {}

        def ended(outcome: Outcome) -> None:
            outcomes[outcome.number] = outcome
            if self.report is not None and (
                executor is None or outcome.state != "running"
            ):
                self.report(before + len(cases), outcome)

        waiting, losses = list(cases), Counter[int]()
        loss_limit = _MOST_LOSSES if executor is None else 1  # that of Dask tries again
        while waiting:
            local_pool = _InProcess() if jobs == 1 else _processes(jobs)
            with (
                local_pool
                if executor is None
                else contextlib.nullcontext(executor) as pool
            ):
                lost = _run_on_executor(waiting, pool, jobs, task, ended, out)
            losses.update(case.number for case in lost)
            waiting[:0] = [case for case in lost if losses[case.number] < loss_limit]
            for case in lost:
                if losses[case.number] >= loss_limit:
                    why = _LOST if executor is None else _GONE
                    ended(Outcome(case.number, "failed", why, 3))
        return tuple(outcomes[case.number] for case in cases)

    def finish(
        self,
        cases: Sequence[Case],
        out: Path,
        count_text: str,
        advice: str,
        before: int = 0,
    ) -> None:
        """Run cases as `run` does; a ResultError has the first that fails.

        `count_text` is how many there are of what, for its text.
        """
        outcomes = self.run(cases, out, before)
        failed = [outcome for outcome in outcomes if outcome.state != "finished"]
        if failed:
            first = f"first {failed[0].number}: {failed[0].fault}"
            raise ResultError(
                f"{out}: {len(failed)} of {count_text} failed, {first}; {advice}"
            )


def run_case(
    case: Case,
    out: Path,
    *,
    command: str = "",
    threads: int = 1,
    observer: Observer | None = None,
) -> Outcome:
    """Run a case, or continue it, in this process; its outcome, whatever happens in it.

    `out` is the directory of the run directories; further parameters are those of
    `run_scene`.
    """
    try:
        run_scene(
            case.base,
            out / case.name,
            overrides=case.overrides,
            command=command,
            threads=threads,
            observer=observer,
            warn=_ignore_warning,
        )
    except WearsimError as error:
        return Outcome(
            case.number, "failed", " ".join(str(error).split("\n")), error.exit_code
        )
    except KeyboardInterrupt:
        return Outcome(case.number, "interrupted", exit_code=130)
    except Exception as error:
        text = f"internal error, {_error_text(error)}; this is a fault of wearsim"
        return Outcome(case.number, "failed", text, 3)
    return Outcome(case.number, "finished")


def _ignore_warning(_: Fault) -> None:
    """Leave a warning of one case to `check_cases`, which has those of all cases."""


def case_folders(folder: Path) -> dict[int, Path]:
    """Run directories of the cases in a folder, by their numbers."""
    numbered = {path.name.removeprefix("case_"): path for path in folder.glob("case_*")}
    return {
        int(number): path for number, path in numbered.items() if number.isdecimal()
    }


def outcome_in(directory: Path, number: int) -> Outcome:
    """State of a case by its run directory, which need not exist."""
    if not is_claimed(directory):
        return Outcome(number, "not started")
    try:
        names = campaigns_of(directory, read_manifest(directory))
    except ResultError as error:
        return Outcome(number, "failed", str(error), 2)
    campaigns = read_status(directory).get("campaigns") or {}
    for state, code in (("failed", 2), ("interrupted", 130)):
        for item in campaigns.values():
            if item.get("state") == state:
                return Outcome(number, state, str(item.get("message") or ""), code)
    done = all((campaigns.get(name) or {}).get("state") == "finished" for name in names)
    if done and (len(names) == 1 or (directory / "translation.nc").is_file()):
        return Outcome(number, "finished")
    return Outcome(number, "running" if is_locked(directory) else "stopped")


def shares_of(out: Path, leave: Collection[int] = ()) -> dict[int, float]:
    """Share of the way [-] of each case that was begun in a folder, by its number.

    Cases of the numbers `leave` are left out.
    """
    folders = case_folders(out)
    return {
        number: _share_of(folders[number]) for number in folders if number not in leave
    }


def _share_of(directory: Path) -> float:
    """Share of the way of a case, from its run directory; 0 where that says nothing."""
    try:
        names = campaigns_of(directory, read_manifest(directory))
    except (ResultError, OSError, KeyError):  # its process has just begun to write it
        return 0.0
    campaigns = read_status(directory).get("campaigns") or {}
    shares = []
    for name in names:
        item = campaigns.get(name) or {}
        ended = item.get("state") == "finished"
        way = float(item.get("distance", 0.0)) / float(item.get("target") or 1.0)
        shares.append(1.0 if ended else way)
    return sum(shares) / len(shares)


def running_text(out: Path) -> str:
    """Text on how far the cases in a directory are that run, on whatever machines."""
    running = [
        f"{status.parent.name}, {name} {item['distance'] / item['target']:.0%}"
        for status in sorted(out.glob("case_*/status.json"))
        for name, item in read_status(status.parent).get("campaigns", {}).items()
        if item["state"] == "running"
    ]
    return f"{len(running)} running: {'; '.join(running)}" if running else ""


def _of_cases(fault: Fault, numbers: list[int]) -> Fault:
    """Fault with the numbers of its cases, runs of them as 3-7."""
    runs: list[list[int]] = []
    for number in numbers:
        if not runs or number > runs[-1][1] + 1:
            runs.append([number, number])
        runs[-1][1] = number
    listed = ", ".join(
        str(first) if first == last else f"{first}-{last}" for first, last in runs
    )
    return replace(
        fault,
        message=f"{'case' if len(numbers) == 1 else 'cases'} {listed}: {fault.message}",
    )


def _error_text(error: Exception) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())}"


class _InProcess(Executor):
    """Runs at once what is handed to it."""

    def submit(self, task, /, *given, **named):  # type: ignore[no-untyped-def]
        done: Future[object] = Future()
        done.set_result(task(*given, **named))
        return done


def _run_on_executor(
    waiting: list[Case],
    executor: Executor,
    at_a_time: int,
    task: Task,
    ended: Callable[[Outcome], None],
    out: Path,
) -> list[Case]:
    """Let an executor run the first of the waiting cases, at most `at_a_time` in it.

    Returns the cases that it lost when it broke down; no further ones leave `waiting`
    then. After Ctrl-C the running cases are stopped and waited for; then
    KeyboardInterrupt is raised.
    """
    running: dict[Future[Outcome], Case] = {}
    lost: list[Case] = []
    interrupted = False
    while running or (waiting and not (lost or interrupted)):
        try:
            while waiting and len(running) < at_a_time and not (lost or interrupted):
                ended(Outcome(waiting[0].number, "running"))
                try:
                    running[executor.submit(task, waiting[0])] = waiting[0]
                except BrokenExecutor:
                    lost.append(waiting[0])
                waiting.pop(0)
            for future in futures.wait(
                running, return_when=futures.FIRST_COMPLETED
            ).done:
                case = running.pop(future)
                try:
                    outcome = future.result()
                except (BrokenExecutor, futures.CancelledError):
                    lost.append(case)
                    continue
                except Exception as error:
                    # of the executor: what the case itself raises is in its outcome
                    outcome = Outcome(case.number, "failed", _error_text(error), 3)
                interrupted = interrupted or outcome.state == "interrupted"
                ended(outcome)
        except KeyboardInterrupt:
            if interrupted:  # a second time: do not wait
                raise
            interrupted = True
        if interrupted:
            (out / _STOP).touch()
            for future, case in running.items():
                if not is_locked(out / case.name):
                    future.cancel()
    if interrupted:
        raise KeyboardInterrupt
    return lost


@contextlib.contextmanager
def _processes(jobs: int) -> Iterator[Executor]:
    """Pool of processes with one thread each."""
    kept = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))  # read once, when a worker starts
    try:
        context = multiprocessing.get_context("spawn")
        with futures.ProcessPoolExecutor(
            jobs, mp_context=context, initializer=_start_worker
        ) as executor:
            yield executor
    finally:
        for name, value in kept.items():
            os.environ.pop(name)
            if value is not None:
                os.environ[name] = value


def _start_worker() -> None:
    """Start a worker of this machine: Ctrl-C is for its parent, with which it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:

        def end_with_parent() -> None:
            parent.join()
            os._exit(1)  # as a kill: what is finished is safe

        threading.Thread(target=end_with_parent, daemon=True).start()


def _run_on_worker(
    case: Case,
    out: Path,
    folder: Path,
    version: str,
    patience: float,
    command: str,
    registered: Registered = (),
) -> Outcome:
    """Run a case where an executor has put it, as if in the current folder.

    Of the process that handed it out.

    A lock that is held there is waited for: file servers give back that of a machine
    that died with delay.
    """
    host, fault = socket.gethostname(), ""
    if version != __version__:
        fault = (
            f"its worker on {host} has wearsim {__version__}, not {version}; install "
            "the same one"
        )
    for place in (out, folder):
        if not place.is_dir():
            fault = (
                f"its worker on {host} has no folder {place}; take one that all "
                "machines share"
            )
    if fault:
        return Outcome(case.number, "failed", fault, 2)
    register_all(registered)
    with _one_per_process, contextlib.chdir(folder):
        until = time.monotonic() + patience
        while is_locked(out / case.name) and time.monotonic() < until:
            time.sleep(1.0)
        if (out / _STOP).exists():
            return Outcome(case.number, "interrupted", exit_code=130)
        return run_case(
            case, out, command=command, observer=partial(_stop_after_step, out / _STOP)
        )


def _stop_after_step(stop: Path, event: Event) -> None:
    """Stop a case after a step when the others were interrupted."""
    if event.kind == "step" and stop.exists():
        raise KeyboardInterrupt


@contextmanager
def cluster(address: str) -> Iterator[Executor]:
    """Connect to a Dask cluster, whose workers take cases.

    Dask gives a case whose worker died to another one, which continues it from its last
    finished step; after the deaths of `distributed.scheduler.allowed-failures` workers,
    3 by default, the case has failed.

    Parameters
    ----------
    address : str
        Address of the scheduler, such as tcp://node1:8786, or its scheduler file, which
        ends with .json.

    Raises
    ------
    ResultError
        If Dask is not installed, or no scheduler answers.
    """
    by_file, fix = (
        address.endswith(".json"),
        "start one with `dask scheduler`, and give its address",
    )
    if by_file and not Path(address).is_file():
        raise ResultError(
            f"{address}: there is no such file of a Dask scheduler; {fix}"
        )
    try:
        from distributed import Client
    except ImportError as error:
        raise ResultError(
            f"a cluster needs Dask, and {error.name} is not installed: pip install "
            "'wearsim[cluster]'"
        ) from error
    try:
        # not the default client, or xarray would ask it for its locks
        client = Client(
            **{"scheduler_file" if by_file else "address": address},
            set_as_default=False,
        )
    except (OSError, ValueError) as error:
        reason = str(error).partition("\n")[0]
        raise ResultError(
            f"{address}: no Dask scheduler answers ({reason}); {fix}"
        ) from error
    with client:
        yield client.get_executor(pure=False)
