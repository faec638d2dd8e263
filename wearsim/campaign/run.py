"""Run a campaign: evaluate, record, append, step, until the distance is reached; continue it at any moment.

Order of writing at each step: record (atomic), row of the result file, status.  Whatever moment the
process dies at, the records up to the last finished step are whole; on the next start the result file is
compared with them bit by bit and rebuilt if it differs.
"""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from wearsim.campaign.control import reached
from wearsim.campaign.directory import (
    SCENE_FOLDER,
    Manifest,
    SceneFiles,
    claim,
    locked,
    read_manifest,
    refuse_foreign,
)
from wearsim.campaign.evolution import EvaluationT, Evolution, WheelsetEvolution
from wearsim.campaign.progress import Observer, Progress
from wearsim.campaign.record import state_of
from wearsim.campaign.row import StepTaken
from wearsim.campaign.writer import Writer
from wearsim.errors import Fault, NumericalError, SceneError, WearsimError
from wearsim.results import check_row
from wearsim.results.limits import ending_limits, first_met
from wearsim.scene import (
    CampaignScene,
    CampaignSetup,
    CompareScene,
    build,
    files_to_copy,
    load_campaign,
)
from wearsim.scene.overrides import Override


def run_scene(
    scene: str | Path | Mapping[str, Any] | CampaignScene,
    out: str | Path,
    *,
    command: str = "",
    observer: Observer | None = None,
    overrides: Sequence[Override] = (),
    threads: int | None = None,
) -> tuple[Path, ...]:
    """Run a scene in a run directory, or continue it if it was begun there.

    Parameters
    ----------
    scene : str, Path, dict or scene
        A rig, a field or a comparison: its file, its tables as dicts, or loaded by `load_scene`.
    out : str or Path
        Run directory.
    command : str
        Command line, for the history of the results.
    observer : callable, optional
        Called with an `Event` at each step.
    overrides : sequence of Override
        Values that replace those of a scene file or dict.
    threads : int, optional
        Of the contact solver, by default all the process may use; they do not change a bit.

    Returns
    -------
    tuple of Path
        Result files: rig.nc or field.nc; for a comparison rig.nc, field.nc and translation.nc.

    Raises
    ------
    SceneError
        With all faults of the scene; nothing is written then.
    ResultError
        If `out` cannot be used; nothing in it is touched then.

    Examples
    --------
    >>> import wearsim
    >>> paths = wearsim.run("workflows/rig_vs_field.toml", "out")  # doctest: +SKIP
    >>> scene = {
    ...     "scene": {"kind": "rig"},
    ...     "wheelset": {"profile": "S1002"},
    ...     "counterface": {"profile": "60E1", "inclination": "1:40", "roller_radius_mm": 1000},
    ...     "contact": {"strips": 10, "cells": 10},
    ...     "operation": {"block": [{"name": "right", "shift_mm": 3, "load_kN": 80, "speed_km_h": 72,
    ...                              "friction": 0.35, "distance_km": 1}]},
    ...     "campaign": {"distance_km": 1},
    ... }
    >>> [path.name for path in wearsim.run(scene, "rig")]
    ['rig.nc']
    """
    out = Path(out)
    if not isinstance(scene, CampaignScene):
        scene = load_campaign(scene, overrides=overrides)
    elif overrides:
        raise SceneError([Fault("overrides act on a scene file or a dict, not on a scene that is loaded")])
    files = scene_files(scene)
    refuse_foreign(out)
    with locked(out):
        return _run_claimed(out, claim(out, files, command), observer, threads)


def scene_files(scene: CampaignScene) -> SceneFiles:
    """Return the files that make up a scene, as a run directory keeps them.

    Parameters
    ----------
    scene : RigScene, FieldScene or CompareScene
        As loaded.
    """
    return SceneFiles(scene.origin.path.name, files_to_copy(scene))


def resume(out: str | Path, *, observer: Observer | None = None) -> tuple[Path, ...]:
    """Continue what was begun in a run directory; what is finished stays as it is.

    Parameters
    ----------
    out : str or Path
        Run directory.
    observer : callable, optional
        Called with an `Event` at each step.

    Returns
    -------
    tuple of Path
        Result files, as for `run_scene`.

    Raises
    ------
    ResultError
        If `out` is no run directory, or its copy of the scene was changed.

    Examples
    --------
    >>> import wearsim
    >>> [path.name for path in wearsim.resume("out")]
    ['rig.nc', 'field.nc', 'translation.nc']
    """
    out = Path(out)
    read_manifest(out)
    with locked(out):
        return _run_claimed(out, read_manifest(out), observer)


def _run_claimed(
    out: Path, manifest: Manifest, observer: Observer | None, threads: int | None = None
) -> tuple[Path, ...]:
    # from the copy also at the first start, so that run and resume cannot differ
    scene = load_campaign(out / SCENE_FOLDER / manifest.main, copied=True)
    parts = (scene.rig, scene.field) if isinstance(scene, CompareScene) else (scene,)
    setups = [build(part) for part in parts]
    paths = [
        run_campaign(setup, out, setup.kind, observer, command=manifest.command, threads=threads)
        for setup in setups
    ]
    if isinstance(scene, CompareScene):
        from wearsim.translation.translate import translate_files

        paths.append(translate_files(paths[0], paths[1], out / "translation.nc"))
    return tuple(paths)


def run_campaign(
    setup: CampaignSetup,
    directory: str | Path,
    name: str,
    observer: Observer | None = None,
    *,
    command: str = "",
    threads: int | None = None,
) -> Path:
    """Run one campaign to its end, from wherever it stands in `directory`.

    Parameters
    ----------
    setup : CampaignSetup
        As `wearsim.scene.build` gives it.
    directory : str or Path
        Existing directory for `<name>.nc`; the caller sees to it that nobody else works there.
    name : str
        Of the campaign.
    observer : callable, optional
        Called with an `Event` at each step.
    command : str
        Command line, for the history attribute.
    threads : int, optional
        Of the contact solver, by default all the process may use; they do not change a bit.

    Returns
    -------
    Path
        The finished, verified result file.
    """
    evolution = WheelsetEvolution(setup, command, threads or available_cores())
    return run_evolution(evolution, Path(directory), name, observer)


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
        progress.tell("finished", ended=writer.finish())
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
    limits = ending_limits(writer.header.attributes)
    laws = writer.header.static.get("fatigue_name", ())
    if done:
        last = writer.records.row(done - 1)
        if first_met(last, limits, laws):
            return
        state, taken = state_of(last, done - 1), None
        progress.start("resumed", state)
    else:
        state, taken = evolution.start()
        progress.start("started", state)
    if writer.rebuilt:
        progress.tell("rebuilt")
    target = evolution.target
    while True:
        ended = reached(state.distance, target)
        if taken is None and ended:
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
            if ended or first_met(row, limits, laws):
                return
        before = state
        state, taken = evolution.advance(before, evaluation)
        moved = state.distance > before.distance or state.turned == state.step
        if not (moved and state.step == before.step + 1):
            raise NumericalError(
                f"the wear step at {before.distance:.6g} m could not be made long enough to move on; "
                f"raise max_step_depth_um or stability in [campaign]"
            )


def available_cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextlib.contextmanager
def _uninterrupted() -> Iterator[None]:
    """Hold Ctrl-C back until record and row are both written, so that the file stays whole."""
    ignored = signal.getsignal(signal.SIGINT) is signal.SIG_IGN  # a run in the background, under nohup
    if ignored or threading.current_thread() is not threading.main_thread():
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
