"""Run or resume a campaign: evaluate, record and step until the distance is reached.

Progress is reported. Order of writing: the record of each step (atomic); at intervals
rows of the result file, and the status. The records up to the last finished step are
complete whenever the process ends. The next start compares the result file with them
bit by bit and rebuilds it if it differs.
"""

from __future__ import annotations

import contextlib
import logging
import math
import signal
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any

from wearsim import __version__
from wearsim.campaign.changes import (
    DISTANCE,
    Standing,
    changed_setups,
    text_of,
    with_changes,
)
from wearsim.campaign.control import reached
from wearsim.campaign.directory import (
    SCENE_FOLDER,
    Manifest,
    SceneFiles,
    campaigns_of,
    claim,
    locked,
    read_manifest,
    require_own_directory,
    require_same_scene,
    write_status,
)
from wearsim.campaign.evaluate import Evaluation
from wearsim.campaign.event import Event, Kind, line
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.campaign.record import (
    Writer,
    mark_of,
    outcome_of,
    read_mark,
    require_unchanged,
)
from wearsim.campaign.row import StepTaken
from wearsim.campaign.state import State
from wearsim.contact.solve import available_cores
from wearsim.errors import (
    ContactError,
    Fault,
    NumericalError,
    ProfileError,
    ResultError,
    SceneError,
    WearsimError,
    issue_warning,
)
from wearsim.quantities import STEP_LIMITS
from wearsim.results import check_row, load_results
from wearsim.scene import (
    CampaignScene,
    CampaignSetup,
    CompareScene,
    FieldScene,
    Prepared,
    RigScene,
    build,
    files_to_copy,
    load_campaign,
    prepare,
    prepare_again,
)
from wearsim.scene.initial_contact import check_contact
from wearsim.scene.overrides import Override, Overrides, as_overrides, at_its_source
from wearsim.scene.read import by_key
from wearsim.whole_files import raising_handlers, signals_wait

_PreparedScenes = tuple[tuple[RigScene | FieldScene, Prepared], ...]
"""Scenes of rig and field, and the solutions obtained from them."""


def run_scene(
    scene: str | Path | Mapping[str, Any] | CampaignScene,
    out: str | Path,
    *,
    command: str = "",
    observer: Observer | None = None,
    overrides: Overrides = (),
    threads: int | None = None,
    warn: Callable[[Fault], None] | None = None,
) -> tuple[Path, ...]:
    """Run a scene in a run directory, or resume it if it was started there.

    The logger "wearsim" writes a line on each step at level INFO. A scene that differs
    from the started one by a longer distance alone extends that campaign, finished or
    not: it continues from its last step, as by `resume` with the distance as override.

    Parameters
    ----------
    scene : str, Path, dict or scene
        A rig, field or compare scene: its file, its tables as dicts, or loaded by
        `load_scene`.
    out : str or Path
        Run directory.
    command : str
        Command line, for the history of the results; by default the call of this
        function.
    observer : callable, optional
        Called with an `Event` at each step.
    overrides : mapping or sequence of Override
        Values that replace those of a scene file or dict, as of `load_scene`:
        {"contact.model": "fast"}.
    threads : int, optional
        Threads of the contact solver, by default all available; their number does not
        change the bits.
    warn : callable, optional
        Called before the run with each warning of
        `scene.initial_contact.check_contact`; by default each is a `WearsimWarning` of
        Python.

    Returns
    -------
    tuple of Path
        Result files: rig.nc or field.nc; for a comparison rig.nc, field.nc and
        translation.nc.

    Raises
    ------
    SceneError
        With all faults of the scene, of the contact of its new wheels and of the noise
        of measured ones; nothing is written then.
    ResultError
        If `out` cannot be used; nothing in it is changed then.

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
    out, given, overrides = Path(out), scene, as_overrides(overrides)
    if not isinstance(scene, CampaignScene):
        scene = load_campaign(scene, overrides=overrides)
    elif overrides:
        raise SceneError(
            [Fault("overrides act on a scene file or a dict, not on a loaded scene")]
        )
    lines = scene.origin.lines if isinstance(given, Mapping) else None
    try:
        prepared = [prepare(part) for part in scene.parts]
        for warning in check_contact(scene, threads, prepared):
            placed = at_its_source(warning)
            (warn or issue_warning)(placed if lines is None else by_key(placed, lines))
    except SceneError as error:
        raise (
            error
            if lines is None
            else SceneError([by_key(fault, lines) for fault in error.faults])
        ) from None
    return run_prepared(
        scene,
        prepared,
        out,
        command=command or _call(given, out, overrides),
        observer=observer,
        threads=threads,
    )


def run_prepared(
    scene: CampaignScene,
    prepared: Sequence[Prepared],
    out: Path,
    *,
    command: str,
    observer: Observer | None = None,
    threads: int | None = None,
) -> tuple[Path, ...]:
    """Run a scene as `run_scene` does, once its contact is checked.

    `prepared` is what was solved from each of its parts; further parameters, files and
    errors are those of `run_scene`.
    """
    files = scene_files(scene)
    require_own_directory(out)
    with locked(out):
        manifest = claim(out, files, command)
        distances = _distances(scene, require_same_scene(out, manifest, files))
        prepared_scenes = tuple(zip(scene.parts, prepared, strict=True))
        return _continued(out, manifest, distances, observer, threads, prepared_scenes)


def _call(scene: object, out: Path, overrides: Sequence[Override]) -> str:
    """Return the call of `run_scene` for the history of the results.

    The history describes a scene that is not a file.
    """
    given = repr(str(scene)) if isinstance(scene, str | Path) else "scene"
    values = {override.key: override.value for override in overrides}
    changed = f", overrides={values}" if values else ""
    return f"wearsim.run({given}, {str(out)!r}{changed})"


def _distances(scene: CampaignScene, campaigns: Sequence[str]) -> tuple[Override, ...]:
    """Distances of some campaigns of a scene, as overrides from its files."""
    key = ("campaign", DISTANCE)
    faults = {
        part: part.fault(key, "")
        for part in scene.parts
        if part.scene.kind in campaigns
    }
    return tuple(
        Override(
            f"{part.scene.kind}.campaign.{DISTANCE}",
            part.campaign.distance_km,
            at.file,
            at.line,
        )
        for part, at in faults.items()
    )


def scene_files(scene: CampaignScene) -> SceneFiles:
    """Return the files of a loaded scene that a run directory keeps."""
    return SceneFiles(scene.origin.path.name, files_to_copy(scene))


def resume(
    out: str | Path, *, observer: Observer | None = None, overrides: Overrides = ()
) -> tuple[Path, ...]:
    """Resume the campaigns of a run directory.

    Finished ones stay unchanged unless their distance is increased.

    Parameters
    ----------
    out : str or Path
        Run directory.
    observer : callable, optional
        Called with an `Event` at each step.
    overrides : mapping or sequence of Override
        Other values, as of `load_scene`, for `campaign.changes.CHANGEABLE` keys
        of [campaign], from the next step on; they are stored with the number of that
        step. A longer `campaign.distance_km` lets finished campaigns go on from their
        last step, too.

    Returns
    -------
    tuple of Path
        Result files, as for `run_scene`.

    Raises
    ------
    ResultError
        If `out` is not a run directory, its copy of the scene was changed, or another
        version of wearsim left it unfinished.
    SceneError
        For overrides of other keys, or out of their range, such as a distance not above
        the one that was run; nothing is changed then.

    Examples
    --------
    >>> import wearsim
    >>> [path.name for path in wearsim.resume("out")]
    ['rig.nc', 'field.nc', 'translation.nc']
    """
    out = Path(out)
    read_manifest(out)
    with locked(out):
        return _continued(out, read_manifest(out), as_overrides(overrides), observer)


def _continued(
    out: Path,
    manifest: Manifest,
    overrides: Sequence[Override],
    observer: Observer | None,
    threads: int | None = None,
    prepared_scenes: _PreparedScenes = (),
) -> tuple[Path, ...]:
    """Continue the campaigns of a locked run directory.

    Changes of settings apply from their next step on. Solutions of its scenes are
    reused.
    """
    if manifest.version != __version__:
        return _finished_by_another_version(out, manifest, overrides, observer)
    if overrides:
        manifest = with_changes(
            out, manifest, overrides, partial(_standing, out, manifest, prepared_scenes)
        )
    return _run_claimed(out, manifest, observer, threads, prepared_scenes)


def _standing(
    out: Path,
    manifest: Manifest,
    prepared_scenes: _PreparedScenes,
    part: RigScene | FieldScene,
) -> Standing:
    """Progress of the campaign of a scene in a run directory."""
    prepared = _prepared(part, prepared_scenes)
    changed = changed_setups(out, manifest, part.scene.kind, prepared)
    controls = tuple((first, setup.control) for first, setup in changed)
    evolution = WheelsetEvolution(build(part, prepared), controls=controls)
    writer = Writer(evolution.header, out, part.scene.kind, evolution.digest)
    if writer.finished():
        outcome = outcome_of(writer.path)
        return Standing(outcome["step"] + 1, outcome["distance"], outcome["ended"])
    rows = writer.recorded()
    return Standing(
        rows, float(writer.records.row(rows - 1)["distance"]) if rows else 0.0
    )


def _prepared(
    part: RigScene | FieldScene, prepared_scenes: _PreparedScenes
) -> Prepared:
    """Return the solutions obtained from a scene, from a known scene if possible."""
    for scene, prepared in prepared_scenes:
        if scene.scene.kind == part.scene.kind:
            return prepare_again(part, scene, prepared)
    return prepare(part)


def _finished_by_another_version(
    out: Path,
    manifest: Manifest,
    overrides: Sequence[Override],
    observer: Observer | None,
) -> tuple[Path, ...]:
    """Return the unchanged results of a run directory finished by another version.

    A campaign is continued only by the version that began it.
    """
    names = campaigns_of(out, manifest)
    paths = [out / f"{name}.nc" for name in names]
    marks = [read_mark(mark_of(out, name)) for name in names]
    every = [*paths, out / "translation.nc"] if len(names) > 1 else paths
    if None in marks or not all(path.is_file() for path in every):
        if not manifest.version:
            raise ResultError(
                f"{out} was begun by a wearsim before 0.2.0, this is {__version__}: "
                "finish it with that one; nothing was changed"
            )
        raise ResultError(
            f"{out} was begun by wearsim {manifest.version}, this is {__version__}: "
            f"finish it with {manifest.version}; nothing was changed"
        )
    in_force = {
        f"{change.campaign}.{change.key}": change.new for change in manifest.changes
    }
    for override in overrides:
        keys = (
            [override.key]
            if override.keys[0] in names
            else [f"{name}.{override.key}" for name in names]
        )
        if any(in_force.get(key) != override.value for key in keys):
            raise ResultError(
                f"{out} was finished by wearsim {manifest.version}, this is "
                f"{__version__}: change it with {manifest.version}, or run the changed "
                "scene in another directory; nothing was changed"
            )
    for name, path, mark in zip(names, paths, marks, strict=True):
        assert mark is not None
        require_unchanged(path, mark)
        outcome = outcome_of(path)
        if observer is not None:
            observer(Event("complete", name, target=outcome["distance"], **outcome))
    return tuple(every)


def _run_claimed(
    out: Path,
    manifest: Manifest,
    observer: Observer | None,
    threads: int | None = None,
    prepared_scenes: _PreparedScenes = (),
) -> tuple[Path, ...]:
    # Read the copy also at the first start, so that run and resume cannot differ.
    scene = load_campaign(out / SCENE_FOLDER / manifest.main, copied=True)
    solved = [_prepared(part, prepared_scenes) for part in scene.parts]
    setups = [
        build(part, prepared)
        for part, prepared in zip(scene.parts, solved, strict=True)
    ]
    threads = threads or available_cores()
    paths = []
    for setup, prepared in zip(setups, solved, strict=True):
        changed = changed_setups(out, manifest, setup.kind, prepared)
        if changed:
            setup = replace(setup, warnings=changed[-1][1].warnings)
        controls = tuple(
            (first, changed_setup.control) for first, changed_setup in changed
        )
        text = text_of(manifest, setup.kind)
        evolution = WheelsetEvolution(setup, manifest.command, threads, controls, text)
        paths.append(run_evolution(evolution, out, setup.kind, observer))
    if isinstance(scene, CompareScene):
        paths.append(
            _translated(
                paths,
                out / "translation.nc",
                setups if scene.compare.causes else None,
                threads,
            )
        )
    return tuple(paths)


def _translated(
    results: Sequence[Path],
    file: Path,
    setups: Sequence[CampaignSetup] | None,
    threads: int,
) -> Path:
    """Write the factors of rig and field and return their file.

    Causes are added where setups are given.
    """
    from wearsim.campaign.causes import add_causes
    from wearsim.translation.translate import translate, with_known_causes, write

    rig, field = map(load_results, results)
    factors = translate(rig, field)
    if setups is not None:
        reused = with_known_causes(factors, file)
        has_causes = "cause_factor" in reused or "causes" in reused.attrs
        factors = (
            reused if has_causes else add_causes(factors, setups, (rig, field), threads)
        )
    return write(factors, file)


def run_evolution(
    evolution: WheelsetEvolution,
    directory: Path,
    name: str,
    observer: Observer | None = None,
) -> Path:
    """Run a campaign from its last step to its end and return its verified file.

    The directory is locked.
    """
    writer = Writer(evolution.header, directory, name, evolution.digest)
    progress = Progress(name, evolution.target, directory, observer)
    with _Interrupts() as interrupts:
        try:
            if writer.finished():
                progress.report("complete", **outcome_of(writer.path))
                return writer.path
            _loop(evolution, writer, progress, interrupts)
            progress.catch_up()
            progress.report("finished", ended=writer.finish(evolution.closing))
        except KeyboardInterrupt:
            with signals_wait(), contextlib.suppress(WearsimError):
                writer.flush()
                progress.close("interrupted")
            raise
        except WearsimError as error:
            with contextlib.suppress(WearsimError):
                writer.flush()
            progress.close("failed", str(error))
            if (
                isinstance(error, ContactError | ProfileError)
                and writer.records.path(0).exists()
            ):
                raise NumericalError(
                    str(error)
                ) from error  # the input was valid at the start
            raise
    return writer.path


def _loop(
    evolution: WheelsetEvolution,
    writer: Writer,
    progress: Progress,
    interrupts: _Interrupts,
) -> None:
    """Record the state and take the next wear step until the campaign ends.

    The first state is the last one recorded.
    """
    done = writer.recover()
    if done and writer.limit_met(writer.records.row(done - 1)):
        return
    state, taken = _first_state(evolution, writer, progress, done)
    interrupts.check()
    if taken is None and reached(state.distance, evolution.target):
        return
    while True:
        interrupts.check()
        evaluation = None
        if taken is not None:
            evaluation, ended = _recorded(evolution, writer, progress, state, taken)
            if ended:
                return
        state, taken = _next_state(evolution, state, evaluation)


def _first_state(
    evolution: WheelsetEvolution, writer: Writer, progress: Progress, done: int
) -> tuple[State, StepTaken | None]:
    """Return the last recorded state, without the step that led to it.

    Without records it is the new wheelset.
    """
    state, taken = (writer.records.state(done - 1), None) if done else evolution.start()
    progress.count(
        STEP_LIMITS[int(writer.records.row(index)["step_limit"])]
        for index in range(done)
    )
    progress.report("resumed" if done else "started", state)
    if writer.rebuilt:
        progress.report("rebuilt")
    return state, taken


def _recorded(
    evolution: WheelsetEvolution,
    writer: Writer,
    progress: Progress,
    state: State,
    taken: StepTaken,
) -> tuple[Evaluation, bool]:
    """Record a state; return its evaluation, and True if the campaign ends with it."""
    evaluation = evolution.evaluate(state, taken)
    row = evolution.row(state, evaluation, taken)
    check_row(writer.header, row)
    with signals_wait():
        waits = writer.write(state, row)
        progress.count([taken.reason])
        progress.report(
            "step",
            state,
            step_length=taken.length,
            step_limit=taken.reason,
            fastest=evolution.fastest(evaluation),
        )
    if waits:
        progress.report("deferred")
    ended = reached(state.distance, evolution.target) or bool(writer.limit_met(row))
    return evaluation, ended


def _next_state(
    evolution: WheelsetEvolution, before: State, evaluation: Evaluation | None
) -> tuple[State, StepTaken]:
    """Take the wear step from a state; return the state at its end and the step.

    A state that was not resumed is evaluated first.
    """
    if evaluation is None or evolution.ended(
        before
    ):  # also at a previous end of a campaign whose distance was increased
        before = evolution.resumed(before)
        evaluation = evolution.evaluate(before)
    state, taken = evolution.advance(before, evaluation)
    moved = state.distance > before.distance or state.reprofiled == state.step
    if not (moved and state.step == before.step + 1):
        raise NumericalError(
            f"the wear step at {before.distance:.6g} m is too short to change the "
            "distance; raise max_step_depth_um or stability in [campaign]"
        )
    return state, taken


class _Interrupts:
    """Signals that stop a run, stored until they are handled.

    Callbacks of compiled code discard exceptions.
    """

    def __enter__(self) -> _Interrupts:
        self._received: list[int] = []
        self._handlers = raising_handlers()
        for number in self._handlers:
            signal.signal(number, self._handle)
        return self

    def _handle(self, number: int, frame: FrameType | None) -> None:
        self._received.append(number)
        self._handlers[number](number, frame)

    def check(self) -> None:
        """Raise KeyboardInterrupt if a signal was received."""
        if self._received:
            raise KeyboardInterrupt

    def __exit__(self, *_: object) -> None:
        for number, handler in self._handlers.items():
            signal.signal(number, handler)


Observer = Callable[[Event], None]


_LOG = logging.getLogger("wearsim")

STATUS_INTERVAL = 0.2
"""Shortest time between two writes of the status file for steps [s]."""


class Progress:
    """Progress reports to observer and status file."""

    def __init__(
        self, name: str, target: float, directory: Path, observer: Observer | None
    ) -> None:
        self._event = Event("started", name, target=target)
        self._directory = directory
        self._observer = observer
        self._began = time.monotonic()
        self._passed: list[
            tuple[float, float]
        ] = []  # distance [m] and time [s] at each step of this session
        # time of the last write of the status file, by `_began` [s]
        self._written = -math.inf

    def count(self, reasons: Iterable[str]) -> None:
        """Count the limits of steps.

        "none", of initial states and reprofilings, is not a limit.
        """
        counts = Counter(self._event.step_limits)
        counts.update(reason for reason in reasons if reason != STEP_LIMITS[0])
        self._event = replace(self._event, step_limits=dict(counts.most_common()))

    def report(self, kind: Kind, state: State | None = None, **changes: Any) -> None:
        """Report an event in a state; other fields of `Event` keep their values."""
        if state is not None:
            worst = float(state.wear_depth.max())
            changes |= {
                "step": state.step,
                "distance": state.distance,
                "worst_depth": worst,
                "reprofiled": state.reprofiled > 0,
            }
            if state.points is not None:
                count = int(state.points.left_out.sum())
                changes |= {"left_out": count, "left_out_share": state.points.share}
        event = replace(self._event, kind=kind, **changes)
        elapsed, left = time.monotonic() - self._began, None
        if kind in ("started", "resumed", "step"):
            self._passed.append((event.distance, elapsed))
        if self._passed:
            place, moment = self._passed[3 * (len(self._passed) - 1) // 4]
            if event.distance > place:
                rest = max(event.target - event.distance, 0.0)
                left = (elapsed - moment) / (event.distance - place) * rest
        self._event = replace(event, elapsed=elapsed, time_left=left)
        if kind != "step" or elapsed >= self._written + STATUS_INTERVAL:
            self._written = elapsed
            self._status("finished" if kind in ("finished", "complete") else "running")
        _LOG.info("%s", line(self._event))
        if self._observer is not None:
            self._observer(self._event)

    def catch_up(self) -> None:
        """Write the status of the last step, if pending, before a long operation."""
        self._status("running")

    def close(self, state: str, message: str = "") -> None:
        """Write the end of the session to the status file, if possible."""
        with contextlib.suppress(WearsimError):  # keep the first error
            self._status(state, message)

    def _status(self, state: str, message: str = "") -> None:
        status = asdict(self._event)
        del status["kind"], status["name"]
        write_status(
            self._directory,
            self._event.name,
            {"state": state, **status, "message": message},
        )
