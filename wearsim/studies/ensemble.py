"""Many campaigns, each in a run directory of its own, through any executor of `concurrent.futures`.

A case is a campaign like any other: it is locked, recorded and continued by itself, so that the same call
goes on after whatever stopped it.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
import tomllib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
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
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from wearsim.campaign.directory import (
    SCENE_FOLDER,
    is_claimed,
    is_locked,
    read_manifest,
    read_status,
    require_same_scene,
)
from wearsim.campaign.run import Event, Observer, run_scene, scene_files
from wearsim.contact.solve import available_cores
from wearsim.errors import Fault, ResultError, SceneError, WearsimError
from wearsim.scene import load_campaign
from wearsim.scene.initial_contact import check_contact
from wearsim.scene.overrides import at_its_source
from wearsim.scene.sweep import Case

if TYPE_CHECKING:
    from multiprocessing.synchronize import Event as Signal

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
_MOST_LOSSES = 2
_LOST = "its process died, killed or out of memory; its finished steps are safe, run the same command again"

_one_per_process = threading.Lock()
"""The netCDF library crashes when two threads use it; threads of one worker wait for each other."""


@dataclass(frozen=True)
class Outcome:
    """How the case of a number stands, and why it failed.

    The state is "finished", "failed", "interrupted", "stopped" (killed), "running" or "not started"; the exit
    code is 2 for bad input, 3 for a numerical failure or internal error, 130 if interrupted, else 0.
    """

    number: int
    state: str
    fault: str = ""
    exit_code: int = 0


Report = Callable[[Outcome], None]
Task = Callable[[Case], Outcome]


def check_cases(cases: Iterable[Case], out: Path | None = None) -> tuple[Fault, ...]:
    """Check the scene of every case, and that no run directory in `out` belongs to another campaign.

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
    faults: dict[Fault, list[int]] = {}
    warnings: dict[Fault, list[int]] = {}
    foreign = []
    for case in cases:
        try:
            scene = load_campaign(case.base, overrides=case.overrides)
            if out is not None and is_claimed(out / case.name):
                require_same_scene(out / case.name, read_manifest(out / case.name), scene_files(scene))
            for warning in check_contact(scene):
                warnings.setdefault(at_its_source(warning), []).append(case.number)
        except SceneError as error:
            for fault in dict.fromkeys(error.faults):
                faults.setdefault(fault, []).append(case.number)
        except ResultError as error:
            foreign.append(f"case {case.number}: {error}")
    if faults:
        listed = [_of_cases(fault, numbers) for fault, numbers in faults.items()]
        raise SceneError(sorted(listed, key=lambda fault: (fault.file or "", fault.line or 0)))
    if foreign:
        raise ResultError("\n".join(foreign))
    return tuple(_of_cases(warning, numbers) for warning, numbers in warnings.items())


def run_cases(
    cases: Sequence[Case],
    out: str | Path,
    executor: Executor | None = None,
    *,
    jobs: int | None = None,
    command: str = "",
    report: Report | None = None,
) -> tuple[Outcome, ...]:
    """Run cases, or continue them; one that fails does not stop the others.

    Parameters
    ----------
    cases : sequence of Case
        Best checked by `check_cases` before.
    out : str or Path
        Existing directory; case 1 runs in `case_0001` in it.
    executor : concurrent.futures.Executor, optional
        That of Dask (`Client.get_executor()`), of mpi4py, or any other, in place of processes of this
        machine. `out` must be the same directory for all its workers; threads of one process run one case
        at a time.
    jobs : int, optional
        Processes on this machine with one thread each, by default as many as it has cores to use.
    command : str
        Command line, for the history of the results.
    report : callable, optional
        Called with the outcome of each case when it ends, and with state "running" when it is handed over.

    Returns
    -------
    tuple of Outcome
        In the order of the cases.

    Raises
    ------
    KeyboardInterrupt
        After Ctrl-C, when the running cases have written their last step.
    """
    outcomes: dict[int, Outcome] = {}

    def ended(outcome: Outcome) -> None:
        outcomes[outcome.number] = outcome
        if report is not None:
            report(outcome)

    task = partial(run_case, out=Path(out).absolute(), command=command)
    jobs = min(jobs or available_cores(), max(len(cases), 1))
    if executor is not None:
        for case, _ in _hand_out(cases, executor, len(cases), task, ended):
            ended(Outcome(case.number, "failed", _LOST, 3))
    elif jobs == 1:
        _hand_out(cases, _InProcess(), 1, task, ended)
    else:
        _in_processes(cases, jobs, task, ended)
    return tuple(outcomes[case.number] for case in cases)


def run_case(
    case: Case, out: Path, *, command: str = "", threads: int = 1, observer: Observer | None = None
) -> Outcome:
    """Run a case, or continue it, in this process; its outcome, whatever happens in it.

    `out` is the directory of the run directories; further parameters are those of `run_scene`.
    """
    try:
        with _one_per_process:
            run_scene(
                case.base,
                out / case.name,
                command=command,
                observer=observer or _obey,
                overrides=case.overrides,
                threads=threads,
            )
    except WearsimError as error:
        return Outcome(case.number, "failed", " ".join(str(error).split("\n")), error.exit_code)
    except KeyboardInterrupt:
        return Outcome(case.number, "interrupted", exit_code=130)
    except Exception as error:
        fault = f"internal error, {type(error).__name__}: {' '.join(str(error).split())}"
        return Outcome(case.number, "failed", f"{fault}; this is a fault of wearsim", 3)
    return Outcome(case.number, "finished")


def outcome_in(directory: Path, number: int) -> Outcome:
    """How a case stands, from what its run directory says, which need not exist."""
    if not is_claimed(directory):
        return Outcome(number, "not started")
    try:
        names = campaigns_of(directory)
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


def campaigns_of(directory: Path) -> tuple[str, ...]:
    """Names of the campaigns of a run directory: rig, field or both."""
    main = read_manifest(directory).main
    kind = tomllib.loads((directory / SCENE_FOLDER / main).read_text(encoding="utf-8-sig"))["scene"]["kind"]
    return ("rig", "field") if kind == "compare" else (str(kind),)


def _of_cases(fault: Fault, numbers: list[int]) -> Fault:
    """Fault with the numbers of its cases, runs of them as 3-7."""
    runs: list[list[int]] = []
    for number in numbers:
        if not runs or number > runs[-1][1] + 1:
            runs.append([number, number])
        runs[-1][1] = number
    listed = ", ".join(str(first) if first == last else f"{first}-{last}" for first, last in runs)
    return replace(fault, message=f"{'case' if len(numbers) == 1 else 'cases'} {listed}: {fault.message}")


class _InProcess(Executor):
    """Runs at once what is handed to it."""

    def submit(self, task, /, *given, **named):  # type: ignore[no-untyped-def]
        done: Future[object] = Future()
        done.set_result(task(*given, **named))
        return done


def _in_processes(cases: Sequence[Case], jobs: int, task: Task, ended: Report) -> None:
    """Run cases in processes of this machine; those whose process dies are tried once more."""
    losses: Counter[int] = Counter()
    while cases:
        with _processes(jobs) as (executor, stop):
            left = _hand_out(cases, executor, jobs, partial(_in_child, task), ended, stop)
        losses.update(case.number for case, died in left if died)
        for case, died in left:
            if died and losses[case.number] >= _MOST_LOSSES:
                ended(Outcome(case.number, "failed", _LOST, 3))
        cases = [case for case, _ in left if losses[case.number] < _MOST_LOSSES]


def _hand_out(
    cases: Iterable[Case],
    executor: Executor,
    at_a_time: int,
    task: Task,
    ended: Report,
    stop: Signal | None = None,
) -> list[tuple[Case, bool]]:
    """Let an executor run cases, no more than `at_a_time` waiting in it.

    Returns the cases without outcome, and whether they were running, where the executor broke down. After
    Ctrl-C the running cases are stopped and waited for; then KeyboardInterrupt is raised.
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
                    message = f"{type(error).__name__}: {' '.join(str(error).split())}"
                    outcome = Outcome(case.number, "failed", message, 3)
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
    return left + [(case, False) for case in reversed(waiting)]


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
    """Start a worker: Ctrl-C reaches it while a case runs only, and it ends with its parent."""
    global _stop
    _stop = stop
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:

        def end_with_parent() -> None:
            parent.join()
            os._exit(1)  # as a kill: what is finished is safe

        threading.Thread(target=end_with_parent, daemon=True).start()


def _in_child(task: Task, case: Case) -> Outcome:
    """Run a case in a worker process."""
    try:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        return task(case)
    except KeyboardInterrupt:
        return Outcome(case.number, "interrupted", exit_code=130)
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def _obey(event: Event) -> None:
    """Stop a case of a worker process after a step when the others were interrupted."""
    if event.kind == "step" and _stop is not None and _stop.is_set():
        raise KeyboardInterrupt
