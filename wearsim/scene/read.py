"""Scenes and the files they name.

Read, and checked with all faults of a stage at once.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from wearsim.csv_tables import layout_note
from wearsim.damage.wear.table import WearTable
from wearsim.errors import Fault, SceneError, listed, raise_any, shown, suggestion
from wearsim.profile import standard
from wearsim.profile.shape import Profile
from wearsim.scene import checks
from wearsim.scene.checks import by_line
from wearsim.scene.inputs import Files, Inputs, kept_files, named_profiles
from wearsim.scene.models import (
    AnyScene,
    CompareScene,
    FieldScene,
    Origin,
    PairScene,
    RigScene,
    find_file,
)
from wearsim.scene.overrides import (
    NOTE,
    Override,
    Overrides,
    as_overrides,
    at_its_source,
    merge,
    overridden_text,
    toml_text,
)
from wearsim.scene.profiles import (
    ReadProfiles,
    bodies_in_track,
    header_warnings,
    read_profiles,
    shape_warnings,
    with_radius,
)
from wearsim.scene.recorded import Record, read_record, samples_of_record
from wearsim.scene.rig import with_programme, with_rig
from wearsim.scene.route import Route, read_vehicle
from wearsim.scene.sweep import SweepScene, read_sweep
from wearsim.scene.wear_table import read_wear_table
from wearsim.toml_faults import (
    LARGEST_FILE,
    LARGEST_TABLE,
    Lines,
    content_of,
    is_key,
    key_lines,
    of_at_most,
    text_of,
    toml_of,
    unknown_key,
    validation_faults,
)

CampaignScene = RigScene | FieldScene | CompareScene
Scene = CampaignScene | PairScene | SweepScene

MODELS: dict[str, type[Scene]] = {
    "rig": RigScene,
    "field": FieldScene,
    "compare": CompareScene,
    "sweep": SweepScene,
}
"""Model of each kind of scene."""
_BLOCK = ("operation", "block")
_DICT = Path("scene.toml")  # name of a scene from a dict in results and run directories


def load_scene(
    path: str | Path | Mapping[str, Any],
    *,
    content: bytes | None = None,
    copied: bool = False,
    overrides: Overrides = (),
) -> Scene:
    """Read a scene, and the files it names, and check everything before a run.

    Parameters
    ----------
    path : str, Path or dict
        Scene file: as given, or below the shipped files, such as
        "workflows/rig_given.toml"; or its tables as dicts, which name files relative to
        the current folder. A `Profile` may stand for the name of one, also among
        overrides; rails and rollers are placed in the track like those of files.
    content : bytes, optional
        Of a scene file that need not exist, such as one from standard input.
    copied : bool
        Whether the file stands in a folder written from `files_to_copy`; the files it
        names are then those next to it, whatever happened to the originals.
    overrides : mapping or sequence of Override
        Values to read in place of those in the file, by dotted keys: {"contact.model":
        "fast"}; None removes a key. In a compare scene, keys act on both scenes it
        names, those that begin with rig or field on the one only. In a list of tables a
        name or a number from 1 selects one: "operation.block.curving.friction".

    Returns
    -------
    Scene
        By `kind` in [scene].

    Raises
    ------
    SceneError
        With all faults of the first stage that has any: syntax; keys, types and ranges;
        files and cross-checks. Faults name file and line, those of a dict the key.

    Examples
    --------
    >>> import wearsim
    >>> comparison = wearsim.load_scene("workflows/rig_vs_field.toml")
    >>> comparison.rig.contact.pair
    ('coupled_strips', 'coupled_strips')
    """
    profiles: dict[str, Profile] = {}
    if isinstance(overrides, Mapping):
        overrides = named_profiles(overrides, profiles)
    overrides, of_dict = as_overrides(overrides), ""
    if isinstance(path, Mapping):
        of_dict = toml_text(named_profiles(path, profiles))
        file, content = _DICT, of_dict.encode()
    elif content is None:
        file = _scene_file(path)
    else:
        file, content = (
            Path(path),
            of_at_most(content, LARGEST_FILE, "a scene file", str(path)),
        )
    kept = kept_files(file) if copied else {}
    try:
        scene = _read(file, "scene", overrides, content)
        if isinstance(scene, CompareScene):
            return _read_comparison(scene, kept, overrides, profiles)
        if isinstance(scene, SweepScene):
            scene._inputs = read_sweep(scene)
            return scene
        assert isinstance(scene, RigScene | FieldScene)
        return _with_inputs(scene, kept, profiles)
    except SceneError as error:
        faults = [at_its_source(fault) for fault in error.faults]
        if isinstance(path, Mapping):
            lines = key_lines(of_dict)
            faults = [by_key(fault, lines) for fault in faults]
        raise SceneError(faults) from error


def _scene_file(path: str | Path) -> Path:
    file = find_file(str(path), (), "workflows")
    if file is not None:
        return file
    shipped = list(standard.shipped_path("workflows").glob("*.toml"))
    names = ", ".join(sorted(item.name for item in shipped))
    what = "is a folder, not a scene file" if os.path.isdir(path) else "does not exist"
    message = (
        f"the scene file {what}, neither as given nor among the shipped workflows "
        f"({names})"
    )
    message += _similar_name_hint(Path(path), [item.name for item in shipped])
    raise SceneError([Fault(message, str(path))])


def _similar_name_hint(path: Path, shipped: Sequence[str]) -> str:
    """Return the question whether a scene file of a similar name was meant.

    Of the same folder or shipped.
    """
    try:
        neighbours = [item.name for item in path.parent.glob("*.toml")]
    except (OSError, ValueError):
        neighbours = []
    name = path.name if path.suffix == ".toml" else f"{path.name}.toml"
    return suggestion(name, [*neighbours, *shipped])


def by_key(fault: Fault, lines: Lines) -> Fault:
    """Fault of a scene from a dict with its key in place of a line.

    Of other files as they are.
    """
    if fault.file != str(_DICT):
        return fault
    path = max(
        (path for path, line in lines.items() if line == fault.line),
        key=len,
        default=(),
    )
    key = "".join(
        f"[{part}]" if isinstance(part, int) else f".{part}" for part in path
    ).removeprefix(".")
    return Fault(fault.message, key or None)


def load_campaign(
    path: str | Path | Mapping[str, Any],
    *,
    copied: bool = False,
    overrides: Overrides = (),
) -> CampaignScene:
    """Read the scene of a campaign, or of two to compare; see `load_scene`.

    Raises
    ------
    SceneError
        With all faults, or if the scene is a sweep.
    """
    scene = load_scene(path, copied=copied, overrides=overrides)
    if isinstance(scene, SweepScene):
        text = f"kind = {scene.scene.kind!r} is no campaign; run it with `wearsim run`"
        raise SceneError([scene.fault(("scene", "kind"), text)])
    if isinstance(scene, PairScene):
        text = (
            "both scenes are of one kind, each is a campaign of its own: run them with "
            "`wearsim run`, or name one of them here"
        )
        raise SceneError([scene.fault(("compare", "scenes"), text)])
    return scene


def _read(
    path: Path,
    role: str,
    overrides: Sequence[Override] = (),
    content: bytes | None = None,
) -> Scene:
    """Stages 1 and 2 of one file: syntax; keys, types and ranges."""
    file = str(path)
    content = content_of(path, "a scene file") if content is None else content
    text = text_of(content, file)
    data, lines = toml_of(text, file), key_lines(text)
    header = data.get("scene")
    kind = header.get("kind") if isinstance(header, dict) else None
    named = kind if isinstance(kind, str) else ""
    file_overrides, rows = _overrides_of(overrides, kind, role), list[Override]()
    if file_overrides:
        rows = [
            item
            for item in file_overrides
            if len(item.keys) > 2 and item.keys[:2] == _BLOCK
        ]
        data = merge(data, [item for item in file_overrides if item not in rows], lines)
        if not _has_programme(data):  # they act on the scene, not on rows of a file
            data, rows = merge(data, rows, lines), []
        content = overridden_text(data, file_overrides, text, rows).encode()
    model: type[Scene | AnyScene] = MODELS.get(named, AnyScene)
    try:
        scene = model.model_validate(data)
    except ValidationError as error:
        raise SceneError(validation_faults(error, model, lines, file)) from error
    assert not isinstance(
        scene, AnyScene
    )  # which has faults: the kind is none of those it allows
    # a removed key that is misspelt would act on nothing without a word
    raise_any(
        [
            Fault(unknown_key(item.keys, model), item.source or file, item.line)
            for item in file_overrides
            if item.value is None and not is_key(model, item.keys)
        ]
    )
    scene._origin = Origin(
        path, role, content, lines, tuple(rows), text.startswith(NOTE)
    )
    return scene


def _has_programme(data: Mapping[str, Any]) -> bool:
    """Return True if the blocks of a scene are the rows of a file."""
    operation = data.get("operation")
    return (
        isinstance(operation, dict)
        and "programme" in operation
        and not operation.get("block")
    )


def _overrides_of(
    overrides: Sequence[Override], kind: Any, role: str
) -> list[Override]:
    """Return overrides of one file, without rig or field at the start of their keys."""
    if kind == "compare":
        return [
            item
            for item in overrides
            if item.keys[0] in ("scene", "compare", "uncertainty")
        ]
    file_overrides = []
    for item in overrides:
        if item.keys[0] == kind and len(item.keys) > 1:
            file_overrides.append(replace(item, key=".".join(item.keys[1:])))
        elif role == "scene" or item.keys[0] not in (
            "rig",
            "field",
            "scene",
            "compare",
            "uncertainty",
        ):
            file_overrides.append(item)
    return file_overrides


def _read_comparison(
    scene: CompareScene,
    kept: Mapping[str, Path],
    overrides: Sequence[Override],
    profiles: Mapping[str, Profile],
) -> CompareScene | PairScene:
    """Read the two scenes of a comparison; their kinds decide what they are."""
    named, files = scene.compare, scene.compare.scenes
    roles = {"rig": named.rig or "", "field": named.field or ""}
    if files and not kept:
        kinds = [_kind_of(scene, file) for file in files]
        if sorted(kinds) != ["field", "rig"]:
            return _read_pair(scene, overrides, profiles)
        roles = dict(zip(kinds, files, strict=True))
    _read_compared(scene, roles, kept, overrides, profiles)
    return scene


_NOWHERE = (
    "does not exist as given, next to the scene file or among the shipped workflows"
)


def _named_file(scene: CompareScene, file: str) -> Path | None:
    """Scene file that a comparison names, None if there is none."""
    return find_file(file, (scene.origin.path.parent,), "workflows")


def _kind_of(scene: CompareScene, file: str) -> str:
    """Kind of a scene that `scenes` names, "" if it cannot be read."""
    path = _named_file(scene, file)
    if path is None:
        return ""
    header = toml_of(text_of(content_of(path, "a scene file"), str(path)), str(path))
    kind = header.get("scene", {})
    return str(kind.get("kind", "")) if isinstance(kind, dict) else ""


def _read_pair(
    scene: CompareScene,
    overrides: Sequence[Override],
    profiles: Mapping[str, Profile],
) -> PairScene:
    """Read two scenes of one kind, all stages; each is named after its file."""
    from wearsim.translation.side_by_side import column_fault, is_column

    place, files = ("compare", "scenes"), scene.compare.scenes
    names = [Path(file).stem for file in files]
    faults: list[Fault] = []
    if names[0] == names[1]:
        text = f"scenes: both files are called {shown(names[0])}; give them two names"
        faults.append(scene.fault(place, text))
    faults += [
        scene.fault(place, f"scenes: {column_fault(name)}")
        for name in names
        if is_column(name)
    ]
    if scene.compare.causes:
        text = "causes are of rig against field; delete it"
        faults.append(scene.fault(("compare", "causes"), text))
    if scene.uncertainty is not None:
        text = (
            "[uncertainty] of two scenes of one kind is not drawn here; move it into "
            "each of them, the same one for bands of their ratio"
        )
        faults.append(scene.fault(("uncertainty",), text))
    pair = PairScene(scene=scene.scene, compare=scene.compare)
    pair._origin = scene.origin
    for name, file in zip(names, files, strict=True):
        path = _named_file(scene, file)
        if path is None:
            text = f"scenes: {shown(file)} {_NOWHERE}"
            faults.append(scene.fault(place, text))
            continue
        with _gather_faults(faults):
            part = _read(path, "scene", of_part(overrides, name, names))
            if isinstance(part, RigScene | FieldScene):
                pair._pair[name] = _with_inputs(part, {}, profiles)
            else:
                text = f"scenes: {shown(file)} is a {part.scene.kind} scene"
                faults.append(scene.fault(place, f"{text}; name campaigns"))
    raise_any(faults)
    return pair


def of_part(
    overrides: Sequence[Override], name: str, names: Sequence[str]
) -> list[Override]:
    """Return overrides of one of two scenes of one kind, without its name."""
    part_overrides = []
    for item in overrides:
        first, *rest = item.keys
        if first == name and rest:
            part_overrides.append(replace(item, key=".".join(rest)))
        elif first not in (*names, "scene", "compare", "uncertainty"):
            part_overrides.append(item)
    return part_overrides


def _read_compared(
    scene: CompareScene,
    files: Mapping[str, str],
    kept: Mapping[str, Path],
    overrides: Sequence[Override],
    profiles: Mapping[str, Profile],
) -> None:
    """Read the two scenes that a compare scene names, all stages; files by role."""
    faults: list[Fault] = []
    for role in ("rig", "field"):
        file = files[role]
        given = f"{role} = {shown(file)}"
        place = ("compare", "scenes" if scene.compare.scenes else role)
        path = kept.get(role) or _named_file(scene, file)
        if path is None:
            faults.append(scene.fault(place, f"{given} {_NOWHERE}"))
            continue
        with _gather_faults(faults):
            part = _read(path, role, overrides)
            if isinstance(part, RigScene | FieldScene) and part.scene.kind == role:
                setattr(scene, f"_{role}", _with_inputs(part, kept, profiles))
            else:
                text = f"{given} is a {part.scene.kind} scene; name a {role} scene"
                faults.append(scene.fault(place, text))
    raise_any(faults)


@contextmanager
def _gather_faults(faults: list[Fault]) -> Iterator[None]:
    """Add the faults of what is done inside to those so far, and go on behind it."""
    try:
        yield
    except SceneError as error:
        faults += error.faults


@contextmanager
def _raise_together(faults: Sequence[Fault]) -> Iterator[None]:
    """Raise the faults of what is done inside together with those known so far."""
    try:
        yield
    except SceneError as error:
        raise SceneError(by_line([*faults, *error.faults])) from error


def _with_inputs(
    scene: RigScene | FieldScene,
    kept: Mapping[str, Path],
    profiles: Mapping[str, Profile],
) -> RigScene | FieldScene:
    """Read the files of a scene and check it with them.

    Raise a SceneError with all faults.

    The scene returned has the contents of the files, and the wheel radius of their
    headers if it gave none.
    """
    files = Files(scene, kept, profiles)
    if isinstance(scene, RigScene):
        scene = _with_rig(scene, files)
    scene, contents = _read_files(scene, files)
    scene._inputs = _checked(scene, contents)
    return scene


@dataclass
class _Contents:
    """Contents of the files that a scene names."""

    files: Files
    profiles: ReadProfiles
    warnings: list[Fault]
    wear_table: WearTable | None = None
    route: Route | None = None
    record: Record | None = None
    faults: list[Fault] = field(default_factory=list)
    faults_of_operation: list[Fault] = field(default_factory=list)


def _read_files(
    scene: RigScene | FieldScene, files: Files
) -> tuple[RigScene | FieldScene, _Contents]:
    """Read the files of a scene, which is returned with the wheel radius they give."""
    profiles = read_profiles(scene, files)
    contents = _Contents(files, profiles, header_warnings(scene, profiles))
    contents.faults += profiles.faults
    with _gather_faults(contents.faults):
        contents.wear_table = _wear_table(scene, files)
    scene = with_radius(scene, profiles)
    with _gather_faults(contents.faults_of_operation):
        if isinstance(scene, FieldScene):
            contents.route = _route_of(scene, files)
            contents.record = _record_of(scene, files)
    return scene, contents


def _checked(scene: RigScene | FieldScene, contents: _Contents) -> Inputs:
    """Return the contents of the files of a scene, or raise all faults of both."""
    profiles, notes = contents.profiles, list[str]()
    faults = contents.faults + checks.cross_faults(scene)
    if not profiles.complete:
        raise SceneError(by_line(faults))
    with _raise_together(faults):
        bodies = bodies_in_track(scene, profiles)
    clearance = bodies.clearances[0]
    faults += checks.geometry_faults(
        scene, bodies.wheels, bodies.templates, bodies.counterface
    )
    faults += contents.faults_of_operation
    samples = None
    with _gather_faults(faults):
        if contents.record is not None:
            path = contents.files.path_of("recorded.file")
            given = None if scene.recorded is None else scene.recorded.smooth_m
            samples, notes = samples_of_record(contents.record, path, clearance, given)
    fault_lines = {fault.line for fault in faults}
    climbing = checks.beyond_clearance(scene, clearance)[0]
    faults += [fault for fault in climbing if fault.line not in fault_lines]
    raise_any(by_line(faults))
    warnings = [*contents.warnings, *_layout_notes(scene, contents.files)]
    warnings += _record_warnings(scene, notes)
    return Inputs(
        *bodies.wheels,
        rails=bodies.rails,
        half_span=profiles.half_span,
        clearances=bodies.clearances,
        files=tuple(contents.files.read),
        wear_table=contents.wear_table,
        templates=bodies.templates,
        samples=samples,
        route=contents.route,
        measured={
            ".".join(map(str, key)): shape for key, shape in profiles.measured.items()
        },
        warnings=(*warnings, *shape_warnings(scene, profiles, contents.files)),
    )


_TABLES = (
    ("operation", "programme"),
    ("vehicle", "route"),
    ("wear", "table_file"),
    ("recorded", "file"),
)
"""Keys that name text tables."""


def _layout_notes(scene: RigScene | FieldScene, files: Files) -> list[Fault]:
    """Describe the layout of text tables that are not plain CSV."""
    notes = []
    for file in files.read:
        key = next((key for key in _TABLES if ".".join(key) == file.role), None)
        if key is None or file.path.suffix.lower() in (".toml", ".nc", ".nc4"):
            continue
        if layout := layout_note(file.content):
            text = f"{key[-1]} = {shown(file.name)}: read as {layout}"
            notes.append(scene.fault(key, text))
    return notes


def _record_warnings(scene: RigScene | FieldScene, notes: Sequence[str]) -> list[Fault]:
    if scene.recorded is None:
        return []
    given = f"file = {shown(scene.recorded.file)}"
    return [scene.fault(("recorded", "file"), f"{given}: {note}") for note in notes]


def _route_of(scene: FieldScene, files: Files) -> Route | None:
    """Read the vehicle of a scene and its route, if it has one.

    A scene has one way of operation.
    """
    given = {
        name: f"[{name}]"
        for name in ("vehicle", "recorded")
        if getattr(scene, name) is not None
    }
    given |= {"operation": "[[operation.class]]"} if scene.operation.classes else {}
    if not given:
        text = (
            "no operation: write [[operation.class]], [vehicle] with its track, or "
            "[recorded]"
        )
        raise SceneError([scene.fault(("operation",), text)])
    if len(given) > 1:
        text = f"{listed(given.values(), ' and ')} exclude each other; keep one of them"
        raise SceneError([scene.fault((next(iter(given)),), text)])
    if scene.vehicle is None:
        return None
    route = read_vehicle(scene, files.place)
    for file in route.files:
        files.note(*file)
    return route


def _record_of(scene: FieldScene, files: Files) -> Record | None:
    """Read the record of a scene, if it has one."""
    if scene.recorded is None:
        return None
    name, shipped = scene.recorded.file, find_file(scene.recorded.file, (), "workflows")
    path = files.found(("recorded", "file"), name, "a CSV or netCDF file", shipped)
    record = read_record(scene.recorded, path, scene.fault)
    files.note("recorded.file", name, path, LARGEST_TABLE)
    return record


def _with_rig(scene: RigScene, files: Files) -> RigScene:
    """Scene with its programme and its rig."""
    faults: list[Fault] = []
    with _gather_faults(faults):
        scene, path, content = with_programme(scene, files.place)
        if path is not None:
            files.note(
                "operation.programme",
                str(scene.operation.programme),
                path,
                content=content,
            )
    with _gather_faults(faults):
        scene, path = with_rig(scene, files.place)
        if path is not None:
            files.note("counterface.rig", str(scene.counterface.rig), path)
    raise_any(by_line(faults))
    return scene


def _wear_table(scene: RigScene | FieldScene, files: Files) -> WearTable | None:
    """Read the table that `table_file` names."""
    name = scene.wear.table_file
    if name is None:
        return None
    path = files.found(("wear", "table_file"), name, "a wear table")
    table = replace(read_wear_table(path), name=Path(name).name)
    files.note("wear.table_file", name, path)
    return table
