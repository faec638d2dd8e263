"""Run a campaign: evaluate, record, append, step, until the distance is reached; continue it at any moment.

Order of writing at each step: record (atomic), row of the result file, status.  Whatever moment the
process dies at, the records up to the last finished step are whole; on the next start the result file is
compared with them bit by bit and rebuilt if it differs.
"""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator
from pathlib import Path

from wearsim.campaign.evolution import EvaluationT, Evolution
from wearsim.campaign.progress import Observer, Progress
from wearsim.campaign.record import state_of
from wearsim.campaign.row import StepTaken
from wearsim.campaign.writer import Writer
from wearsim.errors import NumericalError, WearsimError
from wearsim.results import check_row


def run_evolution(
    evolution: Evolution[EvaluationT], directory: Path, name: str, observer: Observer | None = None
) -> Path:
    """Run a campaign to its end, from wherever it stands in `directory`.

    Parameters
    ----------
    evolution : Evolution
        The physics.
    directory : Path
        Where `<name>.nc` is written; the caller holds its lock.
    name : str
        Of the campaign.
    observer : callable, optional
        Called with an `Event` at each step.

    Returns
    -------
    Path
        The finished, verified result file.
    """
    writer = Writer(evolution.header, directory, name, evolution.digest)
    progress = Progress(name, evolution.target, directory, observer)
    try:
        if writer.finished():
            progress.tell("found", *writer.outcome())
            return writer.path
        _loop(evolution, writer, progress)
        writer.finish()
        progress.tell("finished")
    except KeyboardInterrupt:
        with _uninterrupted(), contextlib.suppress(WearsimError):
            writer.flush()
            progress.close("interrupted")
        raise
    except WearsimError as error:
        with contextlib.suppress(WearsimError):
            writer.flush()
        progress.close("failed", str(error))
        raise
    return writer.path


def _loop(evolution: Evolution[EvaluationT], writer: Writer, progress: Progress) -> None:
    done = writer.recover()
    taken: StepTaken | None
    if done:
        state, taken = state_of(writer.records.row(done - 1), done - 1), None
        progress.start("resumed", state)
    else:
        state, taken = evolution.start()
        progress.start("started", state)
    if writer.rebuilt:
        progress.tell("rebuilt")
    target = evolution.target
    while True:
        reached = state.distance >= target * (1.0 - 1e-12)
        if taken is None and reached:
            return
        evaluation = evolution.evaluate(state)
        if taken is not None:
            row = evolution.row(state, evaluation, taken)
            check_row(writer.header, row)
            with _uninterrupted():
                deferred = writer.write(state.step, row)
                progress.step(state, taken.length)
            if deferred:
                progress.tell("deferred")
            if reached:
                return
        before = state
        state, taken = evolution.advance(before, evaluation)
        if not (state.distance > before.distance and state.step == before.step + 1):
            raise NumericalError(
                f"the wear step at {before.distance:.6g} m could not be made long enough to move on; "
                f"raise max_step_depth_um or stability in [campaign]"
            )


@contextlib.contextmanager
def _uninterrupted() -> Iterator[None]:
    """Hold Ctrl-C back until record and row are both written, so that the file stays whole."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    received: list[int] = []
    previous = signal.signal(signal.SIGINT, lambda number, _: received.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, previous)
    if received:
        raise KeyboardInterrupt
