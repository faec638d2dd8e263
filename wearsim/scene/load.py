"""Scene files: read, checked with all faults at once, and made into the ingredients of a campaign."""

from __future__ import annotations

import json
import os
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from wearsim.errors import Fault, SceneError
from wearsim.scene.accuracy import AccuracyScene, read_accuracy
from wearsim.scene.changes import Change, changed_text
from wearsim.scene.inputs import find_file, read_inputs
from wearsim.scene.location import LocationScene, read_locations
from wearsim.scene.models import AnyScene, CompareScene, FieldScene, Origin, RigScene
from wearsim.scene.published import PublishedScene, read_published
from wearsim.scene.robustness import RobustnessScene
from wearsim.scene.setup import inputs_of
from wearsim.scene.sweep import SweepScene, read_sweep
from wearsim.scene.wear_steps import WearStepsScene
from wearsim.toml_faults import Lines, key_lines, shown, syntax_fault, validation_faults

CampaignScene = RigScene | FieldScene | CompareScene
StudyScene = PublishedScene | AccuracyScene | LocationScene | SweepScene | RobustnessScene | WearStepsScene
Scene = CampaignScene | StudyScene

_MODELS: dict[str, type[Scene]] = {
    "rig": RigScene,
    "field": FieldScene,
    "compare": CompareScene,
    "published": PublishedScene,
    "accuracy": AccuracyScene,
    "location": LocationScene,
    "sweep": SweepScene,
    "robustness": RobustnessScene,
    "wear_steps": WearStepsScene,
}
_LARGEST_FILE = 2_000_000
_INPUTS = "inputs.json"
_RESERVED = (_INPUTS, "manifest.json")


def load_scene(path: str | Path, *, copied: bool = False, changes: Sequence[Change] = ()) -> Scene:
    """Read a scene file, and those it names, and check everything that can be checked before a run.

    Parameters
    ----------
    path : str or Path
        Scene file: as given, or below the shipped files, such as "workflows/rig.toml".
    copied : bool
        Whether the file stands in a folder written from `files_to_copy`; the files it names are then
        those beside it, whatever happened to the originals.
    changes : sequence of Change
        Values to read in place of those in the file, as a sweep varies them. In a compare scene, keys act
        on both scenes it names, those that begin with rig or field on the one only.

    Returns
    -------
    Scene
        By `kind` in [scene].

    Raises
    ------
    SceneError
        With all faults of the first stage that has any: syntax; keys, types and ranges; files and
        cross-checks.
    """
    found = find_file(str(path), (), "workflows")
    if found is None:
        known = ", ".join(sorted(item.name for item in _shipped_scenes()))
        what = "is a folder, not a scene file" if os.path.isdir(path) else "does not exist"
        told = f"the scene file {what}, neither as given nor among the shipped workflows ({known})"
        raise SceneError([Fault(told, str(path))])
    kept = _kept_files(found) if copied else {}
    scene = _read(found, "scene", changes)
    faults: list[Fault] = []
    if isinstance(scene, CompareScene):
        for role in ("rig", "field"):
            faults += _read_compared(scene, role, kept, changes)
    elif isinstance(scene, PublishedScene):
        scene._inputs, faults = read_published(scene)
    elif isinstance(scene, AccuracyScene):
        scene._inputs, faults = read_accuracy(scene)
    elif isinstance(scene, LocationScene):
        scene._inputs, faults = read_locations(scene)
    elif isinstance(scene, SweepScene):
        scene._inputs, faults = read_sweep(scene)
    elif isinstance(scene, RobustnessScene | WearStepsScene):
        pass  # names no files
    else:
        faults = _read_files(scene, kept)
    if faults:
        raise SceneError(faults)
    return scene


def load_campaign(path: str | Path, *, copied: bool = False, changes: Sequence[Change] = ()) -> CampaignScene:
    """Read the scene of a campaign, or of two to compare; see `load_scene`.

    Parameters
    ----------
    path, copied, changes
        As for `load_scene`.

    Returns
    -------
    RigScene, FieldScene or CompareScene
        By `kind` in [scene].

    Raises
    ------
    SceneError
        With all faults, or if the scene is no campaign.
    """
    scene = load_scene(path, copied=copied, changes=changes)
    if isinstance(scene, StudyScene):
        told = f"kind = {scene.scene.kind!r} is no campaign; run it with `wearsim run`"
        raise SceneError([Fault(told, str(scene.origin.path), scene.line("scene", "kind"))])
    return scene


def files_to_copy(scene: CampaignScene) -> dict[str, bytes]:
    """Files with which a scene can be loaded again elsewhere, by `load_scene(..., copied=True)`.

    Parameters
    ----------
    scene : RigScene, FieldScene or CompareScene
        As loaded.

    Returns
    -------
    dict
        Content, as it was read, by plain file name; the scene file comes first. Shapes that wearsim
        ships are not among them.
    """
    named = [("scene", scene.origin.path, scene.origin.content)]
    parts: list[RigScene | FieldScene] = (
        [scene.rig, scene.field] if isinstance(scene, CompareScene) else [scene]
    )
    for part in parts:
        if part is not scene:
            named.append((part.origin.role, part.origin.path, part.origin.content))
        named += [
            (f"{part.origin.role}/{file.role}", file.path, file.content)
            for file in inputs_of(part).files[1:]
            if not file.shipped
        ]
    files: dict[str, bytes] = {}
    roles: dict[str, str] = {}
    for role, path, content in named:
        name, number = path.name, 1
        while name in _RESERVED or files.get(name, content) != content:
            number += 1
            name = f"{path.stem}-{number}{path.suffix}"
        files[name], roles[role] = content, name
    files[_INPUTS] = json.dumps(roles, indent=2).encode()
    return files


def scene_schema() -> dict[str, Any]:
    """JSON schema of the scene file, for editors.

    Returns
    -------
    dict
        Draft 2020-12; any of the kinds.
    """
    schema = TypeAdapter(Scene).json_schema(by_alias=True)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "wearsim scene file",
        **schema,
    }


def _read(path: Path, role: str, changes: Sequence[Change] = ()) -> Scene:
    """Stages 1 and 2 of one file: syntax; keys, types and ranges."""
    file = str(path)
    try:
        with path.open("rb") as stream:
            content = stream.read(_LARGEST_FILE + 1)
    except OSError as error:
        raise SceneError([Fault(f"the scene file cannot be read: {error.strerror}", file)]) from error
    if len(content) > _LARGEST_FILE:
        raise SceneError([Fault(f"larger than {_LARGEST_FILE // 1000000} MB; this is no scene file", file)])
    try:
        text = content.decode("utf-8-sig")
        data = tomllib.loads(text)
        lines: Lines = key_lines(text)
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise SceneError([Fault("not UTF-8 text; save the scene file as UTF-8", file, line)]) from error
    except ValueError as error:
        raise SceneError([syntax_fault(error, text, file)]) from error
    except RecursionError:
        raise SceneError([Fault("tables or lists are nested too deeply for a scene file", file)]) from None
    header = data.get("scene")
    kind = header.get("kind") if isinstance(header, dict) else None
    acting = _acting(changes, kind, role)
    if acting:
        changed = changed_text(text, acting)
        if changed.faults:
            raise SceneError(changed.faults)
        data, lines, content = tomllib.loads(changed.text), changed.lines, changed.text.encode()
    model = _MODELS.get(kind) if isinstance(kind, str) else None
    try:
        if model is None:
            AnyScene.model_validate(data)  # tells what is wrong with the kind
            raise AssertionError("a scene of unknown kind was accepted")
        scene = model.model_validate(data)
    except ValidationError as error:
        errors = error.errors(include_url=False)
        raise SceneError(validation_faults(errors, model or AnyScene, lines, file)) from error
    scene._origin = Origin(path, role, content, lines)
    return scene


def _acting(changes: Sequence[Change], kind: Any, role: str) -> list[Change]:
    """Pick the changes of one file, without the leading rig or field."""
    if kind == "compare":
        return [change for change in changes if change.keys[0] in ("scene", "compare")]
    acting = []
    for change in changes:
        if change.keys[0] == kind and len(change.keys) > 1:
            acting.append(change.below(change.keys[1:]))
        elif role == "scene" or change.keys[0] not in ("rig", "field", "scene", "compare"):
            acting.append(change)
    return acting


def _read_compared(
    scene: CompareScene, role: str, kept: Mapping[str, Path], changes: Sequence[Change]
) -> list[Fault]:
    """Read one of the scenes that a compare scene names, all stages."""
    name = getattr(scene.compare, role)
    place = (str(scene.origin.path), scene.line("compare", role))
    path = kept.get(role) or find_file(name, (scene.origin.path.parent,), "workflows")
    if path is None:
        told = (
            f"{role} = {shown(name)} does not exist as given, beside the scene or among the shipped workflows"
        )
        return [Fault(told, *place)]
    try:
        part = _read(path, role, changes)
    except SceneError as error:
        return list(error.faults)
    if role == "rig" and isinstance(part, RigScene):
        scene._rig = part
        return _read_files(part, kept)
    if role == "field" and isinstance(part, FieldScene):
        scene._field = part
        return _read_files(part, kept)
    told = f"{role} = {shown(name)} is a {part.scene.kind} scene; name a {role} scene"
    return [Fault(told, *place)]


def _read_files(scene: RigScene | FieldScene, kept: Mapping[str, Path]) -> list[Fault]:
    inputs, faults = read_inputs(scene, kept)
    scene._inputs = inputs
    return faults


def _kept_files(path: Path) -> dict[str, Path]:
    try:
        roles = json.loads((path.parent / _INPUTS).read_text(encoding="utf-8"))
        return {str(role): path.parent / str(name) for role, name in roles.items()}
    except (OSError, ValueError, AttributeError) as error:
        told = f"cannot be read ({error}); start the scene again with `wearsim run` and another --out"
        raise SceneError([Fault(told, str(path.parent / _INPUTS))]) from error


def _shipped_scenes() -> list[Path]:
    from wearsim.profile.standard import shipped_path

    return list(shipped_path("workflows").glob("*.toml"))
