"""Many campaigns: each case of a sweep in a run directory of its own, through any executor.

A case is a campaign like any other: it is locked, recorded, continued and found finished by itself, so
that a sweep is repeated with the same command whatever stopped it.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from wearsim.campaign.directory import is_claimed, read_manifest, refuse_other
from wearsim.campaign.progress import Event, Observer
from wearsim.campaign.run import available_cores, run_scene, scene_files
from wearsim.errors import Fault, ResultError, SceneError, WearsimError
from wearsim.scene import load_campaign
from wearsim.scene.changes import ChangedLine
from wearsim.scene.sweep import Case, Sweep
from wearsim.scene.touch import check_contact
from wearsim.studies.sweep_directory import (
    Outcome,
    locked_sweep,
    outcomes_of,
    plan_of,
    read_plan,
    refuse_run_directory,
    write_plan,
)
from wearsim.studies.sweep_table import write_tables

if TYPE_CHECKING:
    from multiprocessing.synchronize import Event as Signal

PATIENCE = 60.0
"""Tasks of a job array wait for each other so long when they write which cases there are [s]."""

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
_MOST_LOSSES = 2
_LOST = "its process died, killed or out of memory; its finished steps are safe, run the same command again"

_one_per_process = threading.Lock()
"""The netCDF library crashes when two threads use it; threads of one worker wait for each other."""

Told = Callable[[Outcome], None]


def check_cases(sweep: Sweep, out: Path | None = None, only: int | None = None) -> tuple[Fault, ...]:
    """Check the scene of every case, and that none would meet another campaign in its directory.

    Parameters
    ----------
    sweep : Sweep
        The cases.
    out : Path, optional
        Directory of the sweep.
    only : int, optional
        Check this case only.

    Returns
    -------
    tuple of Fault
        Warnings.

    Raises
    ------
    SceneError
        With the faults of all cases, each told once with the numbers of its cases.
    ResultError
        If run directories belong to other campaigns; nothing is touched then.
    """
    faults: dict[Fault, list[int]] = {}
    warnings: dict[Fault, list[int]] = {}
    refused = []
    for case in chosen(sweep, only):
        try:
            scene = load_campaign(case.base, changes=case.changes)
            if out is not None and is_claimed(out / case.name):
                refuse_other(out / case.name, read_manifest(out / case.name), scene_files(scene))
            for warning in check_contact(scene):
                warnings.setdefault(_placed(warning), []).append(case.number)
        except SceneError as error:
            for fault in error.faults:
                numbers = faults.setdefault(_placed(fault), [])
                if case.number not in numbers:
                    numbers.append(case.number)
        except ResultError as error:
            refused.append(f"case {case.number}: {error}")
    if faults:
        told = [_of_cases(fault, numbers) for fault, numbers in faults.items()]
        raise SceneError(sorted(told, key=lambda fault: (fault.file or "", fault.line or 0)))
    if refused:
        raise ResultError("\n".join(refused))
    return tuple(_of_cases(warning, numbers) for warning, numbers in warnings.items())


def fault_of(sweep: Sweep, number: int, out: Path | None = None) -> str:
    """Return what makes a case impossible, in one line; empty if it can run.

    Parameters
    ----------
    sweep : Sweep
        The cases.
    number : int
        Of the case, from 1.
    out : Path, optional
        Directory of the sweep.
    """
    try:
        check_cases(sweep, out, number)
    except WearsimError as error:
        return "; ".join(str(error).splitlines()).replace(f"case {number}: ", "", 1)
    return ""


def chosen(sweep: Sweep, only: int | None) -> tuple[Case, ...]:
    """Return all cases, or the one of this number.

    Parameters
    ----------
    sweep : Sweep
        The cases.
    only : int, optional
        Number of a case, from 1.

    Raises
    ------
    SceneError
        If there is no such case.
    """
    if only is None:
        return sweep.cases
    if not 1 <= only <= len(sweep.cases):
        told = f"there is no case {only}; give --case 1 to {len(sweep.cases)}"
        raise SceneError([Fault(told, sweep.file)])
    return (sweep.cases[only - 1],)


def run_sweep(
    sweep: Sweep,
    out: str | Path,
    *,
    jobs: int | None = None,
    executor: Executor | None = None,
    command: str = "",
    told: Told | None = None,
) -> tuple[Outcome, ...]:
    """Run all cases of a sweep, or continue them, each in its run directory.

    Parameters
    ----------
    sweep : Sweep
        The cases; `check_cases` tells all their faults before.
    out : str or Path
        Directory; case 1 runs in `case_0001` in it, `sweep.csv` and `sweep.nc` have a row for each.
    jobs : int, optional
        Processes on this machine with one thread each, by default as many as it has cores to use.
    executor : concurrent.futures.Executor, optional
        Runs the cases in place of processes of this machine: that of Dask (`Client.get_executor()`), of
        mpi4py, or any other. `out` must be the same directory for all its workers; threads of one process
        run one case at a time.
    command : str
        Command line, for the history of the results.
    told : callable, optional
        Called with the outcome of each case when it ends, and with state "running" when it is handed over.

    Returns
    -------
    tuple of Outcome
        In the order of the cases; one that fails does not stop the others.

    Raises
    ------
    ResultError
        If the directory cannot be written, or another sweep runs in it.
    KeyboardInterrupt
        After Ctrl-C, when the running cases have written their last step.
    """
    out = Path(out).absolute()
    refuse_run_directory(out)
    if not sweep.cases:
        raise ResultError(f"{sweep.file}: a sweep without cases")
    with locked_sweep(out, 0.0):
        write_plan(sweep, out, {})
        outcomes: dict[int, Outcome] = {}

        def ended(outcome: Outcome) -> None:
            if outcome.state != "running":
                outcomes[outcome.number] = outcome
                if outcome.state == "failed":
                    failed = {number: item for number, item in outcomes.items() if item.state == "failed"}
                    write_plan(sweep, out, failed)
            if told is not None:
                told(outcome)

        task = _Task(out, command)
        try:
            if executor is not None:
                _hand_out(sweep.cases, executor, len(sweep.cases), task, ended)
            else:
                _run_here(sweep.cases, min(jobs or available_cores(), len(sweep.cases)), task, ended)
        finally:
            write_tables(out)
        found = outcomes_of(out)
    return tuple(outcomes.get(item.number, item) for item in found)


def run_case(
    sweep: Sweep, number: int, out: str | Path, *, command: str = "", observer: Observer | None = None
) -> Outcome:
    """Run one case of a sweep in this process, or continue it, whatever the others do.

    Parameters
    ----------
    sweep : Sweep
        The cases.
    number : int
        Of the case, from 1: what a job array counts.
    out : str or Path
        Directory of the sweep.
    command : str
        Command line, for the history of the results.
    observer : callable, optional
        Called with an `Event` at each step.

    Returns
    -------
    Outcome
        Of this case. The tables are written by `run_sweep`, which finds it.
    """
    out = Path(out).absolute()
    (case,) = chosen(sweep, number)
    refuse_run_directory(out)
    if read_plan(out).get("cases") != plan_of(sweep)["cases"]:
        with locked_sweep(out, PATIENCE):
            write_plan(sweep, out, {})
    return _Task(out, command, available_cores(), observer)(case)


@dataclass(frozen=True)
class _Task:
    """Runs a case; travels to other processes and machines."""

    out: Path
    command: str
    threads: int = 1
    observer: Observer | None = None

    def __call__(self, case: Case) -> Outcome:
        try:
            with _one_per_process:
                run_scene(
                    case.base,
                    self.out / case.name,
                    command=self.command,
                    observer=self.observer or _obey,
                    changes=case.changes,
                    threads=self.threads,
                )
        except WearsimError as error:
            return Outcome(case.number, "failed", " ".join(str(error).split("\n")), error.exit_code)
        except KeyboardInterrupt:
            return Outcome(case.number, "interrupted", exit_code=130)
        except Exception as error:
            fault = f"internal error, {type(error).__name__}: {' '.join(str(error).split())}"
            return Outcome(case.number, "failed", f"{fault}; this is a fault of wearsim", 3)
        return Outcome(case.number, "finished")


class _InProcess(Executor):
    """Runs at once what is handed to it."""

    def submit(self, task, /, *given, **named):  # type: ignore[no-untyped-def]
        done: Future[object] = Future()
        done.set_result(task(*given, **named))
        return done


def _run_here(cases: tuple[Case, ...], jobs: int, task: _Task, ended: Told) -> None:
    """Run cases in processes of this machine; those whose process dies are tried once more."""
    if jobs == 1:
        _hand_out(cases, _InProcess(), 1, task, ended)
        return
    losses: Counter[int] = Counter()
    while cases:
        with _processes(jobs) as (executor, stop):
            left = _hand_out(cases, executor, jobs, _InChild(task), ended, stop)
        lost = [case for case, died in left if died]
        losses.update(case.number for case in lost)
        for case in lost:
            if losses[case.number] >= _MOST_LOSSES:
                ended(Outcome(case.number, "failed", _LOST, 3))
        cases = tuple(case for case, _ in left if losses[case.number] < _MOST_LOSSES)


def _hand_out(
    cases: Iterable[Case],
    executor: Executor,
    at_a_time: int,
    task: Callable[[Case], Outcome],
    ended: Told,
    stop: Signal | None = None,
) -> list[tuple[Case, bool]]:
    """Let an executor run cases, no more than `at_a_time` waiting in it.

    Returns the cases without outcome, and whether they were running: of a pool of ours that broke down.
    After Ctrl-C the running cases are told to stop and waited for; then KeyboardInterrupt is raised.
    """
    waiting = list(cases)[::-1]
    running: dict[Future[Outcome], Case] = {}
    left: list[tuple[Case, bool]] = []
    interrupted = False
    while running or (waiting and not interrupted):
        try:
            while waiting and len(running) < at_a_time and not interrupted:
                ended(Outcome(waiting[-1].number, "running"))
                try:
                    running[executor.submit(task, waiting[-1])] = waiting[-1]
                except BrokenExecutor:
                    break
                waiting.pop()
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                case = running.pop(future)
                try:
                    outcome = future.result()
                except BrokenExecutor:
                    left.append((case, True))
                    continue
                except CancelledError:
                    continue
                except Exception as error:  # of the executor: what the case itself raises is in its outcome
                    told = " ".join(str(error).split())
                    outcome = Outcome(case.number, "failed", f"{type(error).__name__}: {told}", 3)
                interrupted = interrupted or outcome.state == "interrupted"
                ended(outcome)
        except KeyboardInterrupt:
            if interrupted:  # a second time: do not wait
                raise
            interrupted = True
        if interrupted:
            if stop is not None:
                stop.set()
            for future in running:
                future.cancel()
        if left and not running:
            break
    if interrupted:
        raise KeyboardInterrupt
    left += [(case, False) for case in reversed(waiting)]
    if left and stop is None:
        for case, _ in left:
            ended(Outcome(case.number, "failed", _LOST, 3))
        return []
    return left


_stop: Signal | None = None


@contextlib.contextmanager
def _processes(jobs: int) -> Iterator[tuple[Executor, Signal]]:
    """Pool of processes with one thread each, and the signal at which their cases stop after a step."""
    context = multiprocessing.get_context("spawn")
    stop = context.Event()
    kept = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))  # read once, when a worker starts
    try:
        with ProcessPoolExecutor(jobs, mp_context=context, initializer=_begin, initargs=(stop,)) as executor:
            yield executor, stop
    finally:
        for name, value in kept.items():
            os.environ.pop(name)
            if value is not None:
                os.environ[name] = value


def _begin(stop: Signal) -> None:
    """Start a worker: Ctrl-C reaches it while a case runs only, and it does not outlive its parent."""
    global _stop
    _stop = stop
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:

        def end_with_parent() -> None:
            parent.join()
            os._exit(1)  # as a kill: what is finished is safe

        threading.Thread(target=end_with_parent, daemon=True).start()


@dataclass(frozen=True)
class _InChild:
    """Runs a case in a worker process."""

    task: _Task

    def __call__(self, case: Case) -> Outcome:
        try:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            return self.task(case)
        except KeyboardInterrupt:
            return Outcome(case.number, "interrupted", exit_code=130)
        finally:
            signal.signal(signal.SIGINT, signal.SIG_IGN)


def _obey(event: Event) -> None:
    """Stop a case of a worker process after a step when its sweep was interrupted."""
    if event.kind == "step" and _stop is not None and _stop.is_set():
        raise KeyboardInterrupt


def _placed(fault: Fault) -> Fault:
    """Fault at the place that asks for the value, if it was changed."""
    if not isinstance(fault.line, ChangedLine):
        return fault
    change = fault.line.change
    where = f" (in {Path(fault.file).name})" if fault.file else ""
    return Fault(f"{fault.message}{where}", change.file or fault.file, change.line)


def _of_cases(fault: Fault, numbers: list[int]) -> Fault:
    """Fault with the numbers of the cases it stands in, runs of them as 3-7."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][1] + 1:
            runs[-1][1] = number
        else:
            runs.append([number, number])
    told = ", ".join(str(first) if first == last else f"{first}-{last}" for first, last in runs)
    return replace(fault, message=f"{'case' if len(numbers) == 1 else 'cases'} {told}: {fault.message}")
