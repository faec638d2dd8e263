"""Scenes and the files they name: read, and checked with all faults of a stage at once."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ValidationError
from pydantic.json_schema import JsonSchemaMode, models_json_schema

from wearsim.damage.wear.table import WearTable
from wearsim.errors import Fault, ProfileError, SceneError
from wearsim.profile import standard
from wearsim.profile.conicity import flange_clearance
from wearsim.profile.files import read_profile
from wearsim.profile.placement import RUNNING_CIRCLE, place_rail, slope_of
from wearsim.profile.shape import Profile, resample
from wearsim.scene.messages import (
    beyond_clearance,
    by_line,
    cross_faults,
    fit_faults,
    limit_faults,
    template_faults,
)
from wearsim.scene.models import AnyScene, CompareScene, FieldScene, Origin, RigScene, find_file
from wearsim.scene.overrides import Override, at_its_source, merge, overridden_text, toml_text
from wearsim.scene.sweep import SweepScene, read_sweep
from wearsim.scene.wear_table import read_wear_table
from wearsim.toml_faults import (
    Lines,
    content_of,
    is_key,
    key_lines,
    line_of,
    shown,
    text_of,
    toml_of,
    unknown_key,
    validation_faults,
)

CampaignScene = RigScene | FieldScene | CompareScene
Scene = CampaignScene | SweepScene

_MODELS: dict[str, type[Scene]] = {
    "rig": RigScene,
    "field": FieldScene,
    "compare": CompareScene,
    "sweep": SweepScene,
}
_SCRIPTS = {
    "published": "seed_tables.py",
    "location": "seed_figure_2.py",
    "accuracy": "contact_accuracy.py",
    "robustness": "where_methods_fail.py",
    "wear_steps": "wear_step_stability.py",
}
"""Kinds of scenes of before: the script in reports/ that writes their report now."""

_DICT = Path("scene.toml")  # name of a scene from a dict in results and run directories
_INPUTS = "inputs.json"
_RESERVED = (_INPUTS, "manifest.json")


@dataclass(frozen=True)
class InputFile:
    """A file behind a campaign, as it was read.

    Parameters
    ----------
    role : str
        What names it: "scene", "rig", "field", or a key such as "wheelset.profile".
    name : str
        As the scene writes it.
    path : Path
        Its place.
    content : bytes
        What it held.
    shipped : bool
        Whether it is a definition that comes with wearsim.
    """

    role: str
    name: str
    path: Path
    content: bytes
    shipped: bool = False

    @property
    def sha256(self) -> str:
        """Hash of the content."""
        return hashlib.sha256(self.content).hexdigest()


@dataclass(frozen=True)
class Inputs:
    """Profiles of a campaign and the files they come from.

    Parameters
    ----------
    right, left : Profile
        Wheels, with points at the scene's spacing, equally many.
    counterface : Profile
        Placed in the track.
    half_span : float
        From the track centre to the origin of the wheel profile [m].
    clearance : (float or None, float or None)
        Flange clearance of the right and the left wheel [m].
    files : tuple of InputFile
        The scene file first.
    wear_table : WearTable or None
        Of the file that `table_file` names.
    templates : (Profile, Profile) or None
        Profiles that the right and the left wheel are reprofiled to, with the points of the wheels.
    """

    right: Profile
    left: Profile
    counterface: Profile
    half_span: float
    clearance: tuple[float | None, float | None]
    files: tuple[InputFile, ...]
    wear_table: WearTable | None = None
    templates: tuple[Profile, Profile] | None = None


def load_scene(
    path: str | Path | Mapping[str, Any], *, copied: bool = False, overrides: Sequence[Override] = ()
) -> Scene:
    """Read a scene, and the files it names, and check everything that can be checked before a run.

    Parameters
    ----------
    path : str, Path or dict
        Scene file: as given, or below the shipped files, such as "workflows/rig.toml"; or its tables as
        dicts, which name files relative to the current folder.
    copied : bool
        Whether the file stands in a folder written from `files_to_copy`; the files it names are then
        those next to it, whatever happened to the originals.
    overrides : sequence of Override
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
        cross-checks. Faults name file and line, those of a dict the key.

    Examples
    --------
    >>> import wearsim
    >>> comparison = wearsim.load_scene("workflows/rig_vs_field.toml")
    >>> comparison.rig.contact.normal
    'kik_piotrowski'
    """
    if isinstance(path, Mapping):
        return _load_dict(path, overrides)
    file = find_file(str(path), (), "workflows")
    if file is None:
        known = ", ".join(sorted(item.name for item in standard.shipped_path("workflows").glob("*.toml")))
        what = "is a folder, not a scene file" if os.path.isdir(path) else "does not exist"
        message = f"the scene file {what}, neither as given nor among the shipped workflows ({known})"
        raise SceneError([Fault(message, str(path))])
    kept = _kept_files(file) if copied else {}
    return _with_files(_read(file, "scene", overrides), kept, overrides)


def _load_dict(data: Mapping[str, Any], overrides: Sequence[Override]) -> Scene:
    """Load the TOML text of a scene that is given as dicts."""
    text = toml_text(data)
    try:
        return _with_files(_read(_DICT, "scene", overrides, text.encode()), {}, overrides)
    except SceneError as error:
        lines = key_lines(text)
        raise SceneError([_by_key(fault, lines) for fault in error.faults]) from None


def _by_key(fault: Fault, lines: Lines) -> Fault:
    """Fault of a dict with its key in place of a line, others as they are."""
    if fault.file != str(_DICT):
        return fault
    path = max((path for path, line in lines.items() if line == fault.line), key=len, default=())
    key = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).removeprefix(".")
    return Fault(fault.message, key or None)


def _with_files(scene: Scene, kept: Mapping[str, Path], overrides: Sequence[Override]) -> Scene:
    """Stage 3: the files that a scene names, and cross-checks."""
    faults: list[Fault] = []
    if isinstance(scene, CompareScene):
        for role in ("rig", "field"):
            faults += _read_compared(scene, role, kept, overrides)
    elif isinstance(scene, SweepScene):
        scene._inputs, faults = read_sweep(scene)
    else:
        faults = _read_files(scene, kept)
    if faults:
        raise SceneError([at_its_source(fault) for fault in faults])
    return scene


def load_campaign(
    path: str | Path | Mapping[str, Any], *, copied: bool = False, overrides: Sequence[Override] = ()
) -> CampaignScene:
    """Read the scene of a campaign, or of two to compare; see `load_scene`.

    Parameters
    ----------
    path, copied, overrides
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
    scene = load_scene(path, copied=copied, overrides=overrides)
    if isinstance(scene, SweepScene):
        text = f"kind = {scene.scene.kind!r} is no campaign; run it with `wearsim run`"
        raise SceneError([scene.fault(("scene", "kind"), text)])
    return scene


def files_to_copy(scene: CampaignScene) -> dict[str, bytes]:
    """Files with which a scene can be loaded again elsewhere, by `load_scene(..., copied=True)`.

    Parameters
    ----------
    scene : RigScene, FieldScene or CompareScene
        From `load_scene`.

    Returns
    -------
    dict
        Content, as it was read, by plain file name; the scene file comes first. Shapes that wearsim
        ships are not among them.
    """
    named = [("scene", scene.origin.path, scene.origin.content)]
    for part in scene.parts:
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
        Draft 2020-12. The kind in [scene] selects the model by if and then, so that an editor shows the
        faults of that kind only.
    """
    mode: JsonSchemaMode = "validation"
    models: list[tuple[type[BaseModel], JsonSchemaMode]] = [(model, mode) for model in _MODELS.values()]
    definitions = models_json_schema(models, by_alias=True)[1]["$defs"]

    def of_kind(kind: dict[str, Any]) -> dict[str, Any]:
        scene = {"type": "object", "properties": {"kind": kind}, "required": ["kind"]}
        return {"type": "object", "properties": {"scene": scene}, "required": ["scene"]}

    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "wearsim scene file",
        **of_kind({"enum": list(_MODELS)}),
        "allOf": [
            {"if": of_kind({"const": kind}), "then": {"$ref": f"#/$defs/{model.__name__}"}}
            for kind, model in _MODELS.items()
        ],
        "$defs": definitions,
    }


def _read(path: Path, role: str, overrides: Sequence[Override] = (), content: bytes | None = None) -> Scene:
    """Stages 1 and 2 of one file: syntax; keys, types and ranges."""
    file = str(path)
    content = content_of(path, "a scene file") if content is None else content
    text = text_of(content, file)
    data, lines = toml_of(text, file), key_lines(text)
    header = data.get("scene")
    kind = header.get("kind") if isinstance(header, dict) else None
    if isinstance(kind, str) and kind in _SCRIPTS:
        message = (
            f'kind = "{kind}" is no scene any more: `python reports/{_SCRIPTS[kind]}` of the repository '
            f"writes its report; a scene is one of {', '.join(_MODELS)}"
        )
        raise SceneError([Fault(message, file, line_of(lines, ("scene", "kind")))])
    own = _overrides_of(overrides, kind, role)
    if own:
        data = merge(data, own, lines)
        content = overridden_text(data, own).encode()
    model = _MODELS.get(kind) if isinstance(kind, str) else None
    try:
        if model is None:
            AnyScene.model_validate(data)  # raises what is wrong with the kind
            raise AssertionError("a scene of unknown kind was accepted")
        scene = model.model_validate(data)
        unknown = [item for item in own if item.value is None and not is_key(model, item.keys)]
        if unknown:  # a removed key that is misspelt would act on nothing without a word
            raise SceneError(
                [Fault(unknown_key(item.keys, model), item.source or file, item.line) for item in unknown]
            )
    except ValidationError as error:
        errors = error.errors(include_url=False)
        faults = validation_faults(errors, model or AnyScene, lines, file)
        raise SceneError([at_its_source(fault) for fault in faults]) from error
    scene._origin = Origin(path, role, content, lines)
    return scene


def _overrides_of(overrides: Sequence[Override], kind: Any, role: str) -> list[Override]:
    """Return the overrides of one file, without rig or field at the start of their keys."""
    if kind == "compare":
        return [item for item in overrides if item.keys[0] in ("scene", "compare")]
    own = []
    for item in overrides:
        if item.keys[0] == kind and len(item.keys) > 1:
            own.append(item.below(item.keys[1:]))
        elif role == "scene" or item.keys[0] not in ("rig", "field", "scene", "compare"):
            own.append(item)
    return own


def _read_compared(
    scene: CompareScene, role: str, kept: Mapping[str, Path], overrides: Sequence[Override]
) -> list[Fault]:
    """Read one of the scenes that a compare scene names, all stages."""
    name = getattr(scene.compare, role)
    path = kept.get(role) or find_file(name, (scene.origin.path.parent,), "workflows")
    if path is None:
        text = "does not exist as given, next to the scene file or among the shipped workflows"
        return [scene.fault(("compare", role), f"{role} = {shown(name)} {text}")]
    try:
        part = _read(path, role, overrides)
    except SceneError as error:
        return list(error.faults)
    if role == "rig" and isinstance(part, RigScene):
        scene._rig = part
        return _read_files(part, kept)
    if role == "field" and isinstance(part, FieldScene):
        scene._field = part
        return _read_files(part, kept)
    text = f"{role} = {shown(name)} is a {part.scene.kind} scene; name a {role} scene"
    return [scene.fault(("compare", role), text)]


def inputs_of(scene: RigScene | FieldScene) -> Inputs:
    """Contents of the files of a scene that `load_scene` has read."""
    inputs = scene._inputs
    if not isinstance(inputs, Inputs):
        raise ValueError("a scene is built after load_scene has read its files")
    return inputs


class _UnfitError(Exception):
    """Faults after which nothing further can be checked."""

    def __init__(self, *faults: Fault) -> None:
        self.faults = faults


def _read_files(scene: RigScene | FieldScene, kept: Mapping[str, Path]) -> list[Fault]:
    """Read the files of a scene, which become its inputs, and cross-check its values."""
    faults: list[Fault] = []
    try:
        inputs = _inputs(scene, kept, faults)
    except _UnfitError as error:
        faults += error.faults
    if not faults:
        scene._inputs = inputs
    return by_line(faults)


def _inputs(scene: RigScene | FieldScene, kept: Mapping[str, Path], faults: list[Fault]) -> Inputs:
    """Read the files of a scene; all faults are appended to `faults`."""
    origin, wheelset, rules = scene.origin, scene.wheelset, scene.campaign.reprofiling
    half_span = 0.5e-3 * wheelset.back_to_back_mm + RUNNING_CIRCLE
    spacing = 1e-3 * scene.campaign.point_spacing_mm
    files = [InputFile("scene", origin.path.name, origin.path, origin.content)]

    def profile(name: str, *path: str) -> Profile | None:
        try:
            shape, file = _read_profile(scene, ".".join(path), name, half_span, kept)
            if path[0] != "counterface" or scene.counterface.wear is not None:
                shape = resample(shape, spacing)
        except ProfileError as error:
            lines = str(error).splitlines()
            faults.extend(scene.fault(path, f"{path[-1]} = {shown(name)}: {line}") for line in lines)
            return None
        files.append(file)
        return shape

    def matched(shape: Profile, name: str | None, *path: str) -> Profile:
        """Profile with as many points as the right wheel."""
        assert right is not None
        other = _with_points(shape, len(right.y), spacing)
        if other is None:
            text = f"{path[-1]} = {shown(name)} cannot be given as many points as the right wheel "
            text += (
                f"({len(right.y)}); change point_spacing_mm = {scene.campaign.point_spacing_mm:g} a little"
            )
            raise _UnfitError(scene.fault(path, text))
        return other

    right = profile(wheelset.profile, "wheelset", "profile")
    left = right
    if wheelset.profile_left is not None:
        left = profile(wheelset.profile_left, "wheelset", "profile_left")
    counterface = profile(scene.counterface.profile, "counterface", "profile")
    named = None if rules is None else rules.profile
    place = ("campaign", "reprofiling", "profile")
    template = None if named is None else profile(named, *place)
    table = _wear_table(scene, kept, files, faults)
    faults += cross_faults(scene)
    if right is None or left is None or counterface is None or (named is not None and template is None):
        raise _UnfitError
    wheels = right, matched(left, wheelset.profile_left, "wheelset", "profile_left")
    unfit = fit_faults(scene, wheels, counterface)
    if unfit:
        raise _UnfitError(*unfit)
    templates = None if rules is None else wheels
    if template is not None:
        templates = (matched(template, named, *place),) * 2
    if templates is not None:
        faults += template_faults(scene, templates, counterface)
    free = flange_clearance(right, counterface)
    clearance = (free, free if left is right else flange_clearance(wheels[1], counterface))
    faults += limit_faults(scene, wheels, counterface, end=True)
    lines = {fault.line for fault in faults}
    faults += [fault for fault in beyond_clearance(scene, clearance)[0] if fault.line not in lines]
    return Inputs(*wheels, counterface, half_span, clearance, tuple(files), table, templates)


def _wear_table(
    scene: RigScene | FieldScene, kept: Mapping[str, Path], files: list[InputFile], faults: list[Fault]
) -> WearTable | None:
    """Read the table that `table_file` names, and note its file."""
    name, role, origin = scene.wear.table_file, "wear.table_file", scene.origin
    if name is None:
        return None
    path = kept.get(f"{origin.role}/{role}") or find_file(name, (origin.path.parent,), "profiles")
    if path is None:
        text = (
            f"table_file = {shown(name)} does not exist as given or next to the scene file; give a wear table"
        )
        faults.append(scene.fault(("wear", "table_file"), text))
        return None
    try:
        table = replace(read_wear_table(path), name=Path(name).name)
        files.append(InputFile(role, name, path, path.read_bytes()))
        return table
    except OSError as error:
        faults.append(Fault(f"cannot be read ({error.strerror}); give a wear table", str(path)))
    except SceneError as error:
        faults += error.faults
    return None


def _read_profile(
    scene: RigScene | FieldScene, role: str, name: str, half_span: float, kept: Mapping[str, Path]
) -> tuple[Profile, InputFile]:
    origin: Origin = scene.origin
    counterface = scene.counterface
    is_rail = role.startswith("counterface")
    kind: Literal["wheel", "rail"] = "rail" if is_rail else "wheel"
    inclination = slope_of(counterface.inclination)
    gauge = 1e-3 * counterface.gauge_mm
    path = kept.get(f"{origin.role}/{role}") or find_file(name, (origin.path.parent,), "profiles")
    if path is None or path.suffix == ".toml":
        looks_like_file = any(mark in name for mark in "/\\") or Path(name).suffix not in ("", ".toml")
        if looks_like_file and not standard.is_designation(name):
            raise ProfileError(
                "there is no such file as given, next to the scene file or among the shipped profiles"
            )
        short = name.removesuffix(".toml")
        shape = standard.rail(short, inclination, gauge, half_span) if is_rail else standard.wheel(short)
        path = standard.find_shipped(short)
        return shape, InputFile(role, name, path, path.read_bytes(), shipped=True)
    reading = read_profile(path, kind)
    shape, path = reading.profile, reading.files[-1]  # of a list of slices, the slice
    if is_rail:
        shape = place_rail(shape, inclination, gauge, half_span)
    try:
        return shape, InputFile(role, name, path, path.read_bytes())
    except OSError as error:
        raise ProfileError(f"{path} cannot be read: {error.strerror}") from error


def _with_points(profile: Profile, count: int, spacing: float) -> Profile | None:
    """Set `count` points on a profile by a slightly different spacing; None if none within 3 % does."""
    if len(profile.y) == count:
        return profile
    guess = spacing * (len(profile.y) - 1) / (count - 1)
    for part in sorted(np.linspace(-0.03, 0.03, 121), key=abs):
        shape = resample(profile, guess * (1.0 + float(part)))
        if len(shape.y) == count:
            return shape
    return None


def _kept_files(path: Path) -> dict[str, Path]:
    try:
        roles = json.loads((path.parent / _INPUTS).read_text(encoding="utf-8"))
        return {str(role): path.parent / str(name) for role, name in roles.items()}
    except (OSError, ValueError, AttributeError) as error:
        message = f"cannot be read ({error}); start the scene again with `wearsim run` and another --out"
        raise SceneError([Fault(message, str(path.parent / _INPUTS))]) from error
