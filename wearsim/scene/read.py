"""Scenes and the files they name: read, and checked with all faults of a stage at once."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ValidationError
from pydantic.json_schema import JsonSchemaMode, models_json_schema

from wearsim.damage.wear.table import WearTable
from wearsim.errors import Fault, ProfileError, SceneError
from wearsim.profile import standard
from wearsim.profile.conicity import flange_clearance
from wearsim.profile.files import ProfileReading, read_profile
from wearsim.profile.placement import (
    RUNNING_CIRCLE,
    is_partial,
    lean_words,
    place_rail,
    slope_of,
    tilt_to_add,
)
from wearsim.profile.shape import Profile, resample
from wearsim.profile.smoothing import smoothed
from wearsim.profile.standard import shipped_path
from wearsim.scene.messages import (
    beyond_clearance,
    by_line,
    cross_faults,
    fit_faults,
    header_warnings,
    limit_faults,
    template_faults,
)
from wearsim.scene.models import AnyScene, CompareScene, FieldScene, Origin, RigScene, find_file
from wearsim.scene.overrides import Override, at_its_source, merge, overridden_text, toml_text
from wearsim.scene.recorded import read_record
from wearsim.scene.rig import with_programme, with_rig
from wearsim.scene.sides import side_warnings
from wearsim.scene.sweep import SweepScene, read_sweep
from wearsim.scene.vehicle import read_vehicle
from wearsim.scene.wear_table import read_wear_table
from wearsim.toml_faults import (
    Lines,
    content_of,
    is_key,
    key_lines,
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
_DICT = Path("scene.toml")  # name of a scene from a dict in results and run directories
_INPUTS = "inputs.json"
_RESERVED = (_INPUTS, "manifest.json")


@dataclass(frozen=True)
class InputFile:
    """A file behind a campaign, as it was read.

    Its role is what names it: "scene", "rig", "field", or a key such as "wheelset.profile"; its name is as
    the scene writes it; a shipped one is a definition that comes with wearsim.
    """

    role: str
    name: str
    path: Path
    content: bytes
    shipped: bool = False

    @property
    def label(self) -> str:
        """Name in results, without its folder."""
        return self.path.name if self.role == "scene" else f"{self.role} {self.name}"

    @property
    def sha256(self) -> str:
        """Hash of the content."""
        return hashlib.sha256(self.content).hexdigest()


@dataclass(frozen=True)
class Inputs:
    """Profiles of a campaign and the files they come from.

    The wheels have points at the scene's spacing, equally many; their flange clearances and templates, the
    profiles they are reprofiled to, are right and left.
    """

    right: Profile
    left: Profile
    counterface: Profile  # placed in the track
    half_span: float  # from the track centre to the origin of the wheel profile [m]
    clearance: tuple[float | None, float | None]  # [m]
    files: tuple[InputFile, ...]  # the scene file first
    wear_table: WearTable | None = None  # of the file that `table_file` names
    templates: tuple[Profile, Profile] | None = None
    warnings: tuple[Fault, ...] = ()  # of what the files say


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
    content, kept = None, {}
    if isinstance(path, Mapping):
        file, content = _DICT, toml_text(path).encode()
    else:
        file = _scene_file(path)
        kept = _kept_files(file) if copied else {}
    try:
        scene = _read(file, "scene", overrides, content)
        if isinstance(scene, CompareScene):
            _read_compared(scene, kept, overrides)
        elif isinstance(scene, SweepScene):
            scene._inputs = read_sweep(scene)
        else:
            return _with_inputs(scene, kept)
    except SceneError as error:
        faults = [at_its_source(fault) for fault in error.faults]
        if content is not None:
            lines = key_lines(content.decode())
            faults = [by_key(fault, lines) for fault in faults]
        raise SceneError(faults) from error
    return scene


def _scene_file(path: str | Path) -> Path:
    file = find_file(str(path), (), "workflows")
    if file is not None:
        return file
    known = ", ".join(sorted(item.name for item in standard.shipped_path("workflows").glob("*.toml")))
    what = "is a folder, not a scene file" if os.path.isdir(path) else "does not exist"
    message = f"the scene file {what}, neither as given nor among the shipped workflows ({known})"
    raise SceneError([Fault(message, str(path))])


def by_key(fault: Fault, lines: Lines) -> Fault:
    """Fault of a scene from a dict with its key in place of a line; of other files as they are."""
    if fault.file != str(_DICT):
        return fault
    path = max((path for path, line in lines.items() if line == fault.line), key=len, default=())
    key = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).removeprefix(".")
    return Fault(fault.message, key or None)


def load_campaign(
    path: str | Path | Mapping[str, Any], *, copied: bool = False, overrides: Sequence[Override] = ()
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
    return scene


def files_to_copy(scene: CampaignScene) -> dict[str, bytes]:
    """Files with which a scene can be loaded again elsewhere, by `load_scene(..., copied=True)`.

    Contents, as they were read, by plain file name; the scene file comes first. Shapes that wearsim ships are
    not among them.
    """
    named: dict[str, Origin | InputFile] = {"scene": scene.origin}
    for part in scene.parts:
        named[part.origin.role] = part.origin
        named |= {f"{part.origin.role}/{f.role}": f for f in inputs_of(part).files[1:] if not f.shipped}
    files: dict[str, bytes] = {}
    roles: dict[str, str] = {}
    for role, file in named.items():
        name, number = file.path.name, 1
        while name in _RESERVED or files.get(name, file.content) != file.content:
            number += 1
            name = f"{file.path.stem}-{number}{file.path.suffix}"
        files[name], roles[role] = file.content, name
    files[_INPUTS] = json.dumps(roles, indent=2).encode()
    return files


def scene_schema() -> dict[str, Any]:
    """JSON schema of the scene file, draft 2020-12, for editors.

    The kind in [scene] selects the model by if and then: an editor shows the faults of that kind only.
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
    named = kind if isinstance(kind, str) else ""
    own = _overrides_of(overrides, kind, role)
    if own:
        data = merge(data, own, lines)
        content = overridden_text(data, own).encode()
    model: type[Scene | AnyScene] = _MODELS.get(named, AnyScene)
    try:
        scene = model.model_validate(data)
    except ValidationError as error:
        raise SceneError(validation_faults(error, model, lines, file)) from error
    assert not isinstance(scene, AnyScene)  # which has faults: the kind is none of those it allows
    unknown = [item for item in own if item.value is None and not is_key(model, item.keys)]
    if unknown:  # a removed key that is misspelt would act on nothing without a word
        raise SceneError(
            [Fault(unknown_key(item.keys, model), item.source or file, item.line) for item in unknown]
        )
    scene._origin = Origin(path, role, content, lines)
    return scene


def _overrides_of(overrides: Sequence[Override], kind: Any, role: str) -> list[Override]:
    """Return the overrides of one file, without rig or field at the start of their keys."""
    if kind == "compare":
        return [item for item in overrides if item.keys[0] in ("scene", "compare", "uncertainty")]
    own = []
    for item in overrides:
        if item.keys[0] == kind and len(item.keys) > 1:
            own.append(replace(item, key=".".join(item.keys[1:])))
        elif role == "scene" or item.keys[0] not in ("rig", "field", "scene", "compare", "uncertainty"):
            own.append(item)
    return own


def _read_compared(scene: CompareScene, kept: Mapping[str, Path], overrides: Sequence[Override]) -> None:
    """Read the two scenes that a compare scene names, all stages."""
    faults: list[Fault] = []
    for role in ("rig", "field"):
        name = getattr(scene.compare, role)
        path = kept.get(role) or find_file(name, (scene.origin.path.parent,), "workflows")
        if path is None:
            text = "does not exist as given, next to the scene file or among the shipped workflows"
            faults.append(scene.fault(("compare", role), f"{role} = {shown(name)} {text}"))
            continue
        try:
            part = _read(path, role, overrides)
            if isinstance(part, RigScene | FieldScene) and part.scene.kind == role:
                setattr(scene, f"_{role}", _with_inputs(part, kept))
            else:
                text = f"{role} = {shown(name)} is a {part.scene.kind} scene; name a {role} scene"
                faults.append(scene.fault(("compare", role), text))
        except SceneError as error:
            faults += error.faults
    if faults:
        raise SceneError(faults)


def inputs_of(scene: RigScene | FieldScene) -> Inputs:
    """Contents of the files of a scene that `load_scene` has read."""
    inputs = scene._inputs
    if not isinstance(inputs, Inputs):
        raise ValueError("a scene is built after load_scene has read its files")
    return inputs


def _with_inputs(scene: RigScene | FieldScene, kept: Mapping[str, Path]) -> RigScene | FieldScene:
    """Read the files of a scene and cross-check its values; raise a SceneError with all faults.

    The scene returned has the contents of the files, and the wheel radius of their headers if it gave none.
    """
    named: dict[str, tuple[str, Path]] = {}
    if isinstance(scene, RigScene):
        scene = _with_rig(scene, kept, named)
    origin, wheelset, rules = scene.origin, scene.wheelset, scene.campaign.reprofiling
    half_span = 0.5e-3 * wheelset.back_to_back_mm + RUNNING_CIRCLE
    spacing = 1e-3 * scene.campaign.point_spacing_mm
    files = [InputFile("scene", origin.path.name, origin.path, origin.content)]
    rigs = shipped_path("profiles", "rigs")
    files += [
        InputFile(role, name, path, content_of(path, "another file"), shipped=path.parent == rigs)
        for role, (name, path) in named.items()
    ]
    faults: list[Fault] = []
    leaning: list[Fault] = []
    diameters: dict[str, float] = {}
    headers: dict[str, tuple[str, Mapping[str, str]]] = {}

    def profile(name: str, *path: str) -> Profile | None:
        try:
            shape, file, reading = _read_profile(scene, ".".join(path), name, half_span, kept)
            if path[0] == "wheelset":
                headers[path[-1]] = name, {} if reading is None else reading.header
            if reading is not None and reading.diameter is not None and path[0] == "wheelset":
                diameters[name] = 1e3 * reading.diameter
            if path[0] == "counterface" and reading is not None:
                slope = slope_of(scene.counterface.inclination)
                if tilt_to_add(reading.lean, slope) != slope:
                    text = (
                        f"inclination = {shown(scene.counterface.inclination)} is without effect: the head "
                    )
                    text += f'in {name} {lean_words(reading.lean or 0.0)} already; write inclination = "none"'
                    leaning.append(scene.fault(("counterface", "inclination"), text))
            if path[0] != "counterface" or scene.counterface.wear is not None:
                shape = resample(shape, spacing)
        except ProfileError as error:
            lines = str(error).splitlines()
            faults.extend(scene.fault(path, f"{path[-1]} = {shown(name)}: {line}") for line in lines)
            return None
        files.append(file)
        return shape

    def matched(shape: Profile, count: int, name: str | None, *path: str) -> Profile:
        """Profile with as many points as the right wheel, by a spacing that differs by up to 3 %."""
        if len(shape.y) == count:
            return shape
        guess = spacing * (len(shape.y) - 1) / (count - 1)
        for part in sorted(np.linspace(-0.03, 0.03, 121), key=abs):
            other = resample(shape, guess * (1.0 + float(part)))
            if len(other.y) == count:
                return other
        text = f"{path[-1]} = {shown(name)} cannot be given as many points as the right wheel ({count})"
        fix = f"change point_spacing_mm = {scene.campaign.point_spacing_mm:g} a little"
        raise SceneError(by_line([*faults, scene.fault(path, f"{text}; {fix}")]))

    right = left = profile(wheelset.profile, "wheelset", "profile")
    if wheelset.profile_left is not None:
        left = profile(wheelset.profile_left, "wheelset", "profile_left")
    counterface = profile(scene.counterface.profile, "counterface", "profile")
    shape_name = None if rules is None else rules.profile
    place = ("campaign", "reprofiling", "profile")
    template = None if shape_name is None else profile(shape_name, *place)
    table = _wear_table(scene, kept, files, faults)
    noted = [*header_warnings(scene, diameters), *side_warnings(scene, headers), *leaning]
    if diameters and "radius_mm" not in wheelset.model_fields_set:
        radius = 0.5 * sum(diameters.values()) / len(diameters)
        scene = scene.model_copy(update={"wheelset": wheelset.model_copy(update={"radius_mm": radius})})
    faults += cross_faults(scene)
    if right is None or left is None or counterface is None or (shape_name is not None and template is None):
        raise SceneError(by_line(faults))
    wheels = right, matched(left, len(right.y), wheelset.profile_left, "wheelset", "profile_left")
    unfit = fit_faults(scene, wheels, counterface)
    if unfit:
        raise SceneError(by_line(faults + unfit))
    templates = None if rules is None else wheels
    if template is not None:
        templates = (matched(template, len(right.y), shape_name, *place),) * 2
    if templates is not None:
        faults += template_faults(scene, templates, counterface)
    free = flange_clearance(right, counterface)
    clearance = (free, free if left is right else flange_clearance(wheels[1], counterface))
    faults += limit_faults(scene, wheels, counterface, end=True)
    if isinstance(scene, FieldScene):
        try:
            noted += _operated(scene, kept, clearance, files)
        except SceneError as error:
            faults += error.faults
    lines = {fault.line for fault in faults}
    faults += [fault for fault in beyond_clearance(scene, clearance)[0] if fault.line not in lines]
    if faults:
        raise SceneError(by_line(faults))
    if is_partial(counterface.y):
        text = f"profile = {shown(scene.counterface.profile)} is {1e3 * np.ptp(counterface.y):.3g} mm wide"
        text += ": without gauge point its y counts from the running circle, and gauge_mm is without effect"
        noted.append(scene.fault(("counterface", "profile"), text))
    noted += [
        scene.fault(
            (key, "smooth_mm"),
            f"smooth_mm is without effect: no profile of [{key}] was read from a file of points; delete it",
        )
        for key in ("wheelset", "counterface")
        if getattr(scene, key).smooth_mm is not None
        and all(file.shipped for file in files if file.role.startswith(f"{key}."))
    ]
    scene._inputs = Inputs(
        *wheels, counterface, half_span, clearance, tuple(files), table, templates, tuple(noted)
    )
    return scene


def _operated(
    scene: FieldScene,
    kept: Mapping[str, Path],
    clearance: tuple[float | None, float | None],
    files: list[InputFile],
) -> list[Fault]:
    """Read the record or the vehicle of a scene, if it has one, and note its file; warnings."""
    section, classes = scene.recorded, scene.operation.classes
    names = {"vehicle": scene.vehicle, "recorded": section}
    given = {name: f"[{name}]" for name, one in names.items() if one is not None}
    given |= {"operation": "[[operation.class]]"} if classes else {}
    if not given:
        text = "no operation: write [[operation.class]], [vehicle] with its track, or [recorded]"
        raise SceneError([scene.fault(("operation",), text)])
    if len(given) > 1:
        text = f"{' and '.join(given.values())} exclude each other; keep one of them"
        raise SceneError([scene.fault((next(iter(given)),), text)])
    if scene.vehicle is not None:
        route = read_vehicle(scene, lambda role, name: _place_of(scene, role, name, kept))
        scene._route, scene._track = route, route.track if scene.vehicle.route is None else ()
        vehicles = shipped_path("profiles", "vehicles")
        files += [
            InputFile(role, name, path, content_of(path, "another file"), shipped=path.parent == vehicles)
            for role, name, path in route.files
        ]
    if section is None:
        return []
    role = "recorded.file"
    path = _place_of(scene, role, section.file, kept)
    path = path or find_file(section.file, (), "workflows")
    if path is None:
        text = f"file = {shown(section.file)} does not exist as given or next to the scene file"
        raise SceneError([scene.fault(("recorded", "file"), f"{text}; give a CSV or netCDF file")])
    samples, notes = read_record(scene, path, clearance)
    scene._samples = samples
    files.append(InputFile(role, section.file, path, path.read_bytes()))
    return notes


def _with_rig(scene: RigScene, kept: Mapping[str, Path], named: dict[str, tuple[str, Path]]) -> RigScene:
    """Scene with its programme and its rig, whose files are noted in `named` by role."""

    def place(role: str, name: str) -> Path | None:
        return _place_of(scene, role, name, kept)

    faults: list[Fault] = []
    for role, key, step in (
        ("operation.programme", scene.operation.programme, with_programme),
        ("counterface.rig", scene.counterface.rig, with_rig),
    ):
        try:
            scene, path = step(scene, place)
        except SceneError as error:
            faults += error.faults
            continue
        if path is not None and key is not None:
            named[role] = key, path
    if faults:
        raise SceneError(by_line(faults))
    return scene


def _place_of(scene: RigScene | FieldScene, role: str, name: str, kept: Mapping[str, Path]) -> Path | None:
    """File that a key of a scene names; in a run directory the copy of it."""
    origin = scene.origin
    return kept.get(f"{origin.role}/{role}") or find_file(name, (origin.path.parent,), "profiles")


def _wear_table(
    scene: RigScene | FieldScene, kept: Mapping[str, Path], files: list[InputFile], faults: list[Fault]
) -> WearTable | None:
    """Read the table that `table_file` names, and note its file."""
    name, role = scene.wear.table_file, "wear.table_file"
    if name is None:
        return None
    path = _place_of(scene, role, name, kept)
    if path is None:
        text = f"table_file = {shown(name)} does not exist as given or next to the scene file"
        faults.append(scene.fault(("wear", "table_file"), f"{text}; give a wear table"))
        return None
    try:
        table = replace(read_wear_table(path), name=Path(name).name)
        files.append(InputFile(role, name, path, content_of(path, "a wear table")))
        return table
    except SceneError as error:
        faults += error.faults
    return None


def _read_profile(
    scene: RigScene | FieldScene, role: str, name: str, half_span: float, kept: Mapping[str, Path]
) -> tuple[Profile, InputFile, ProfileReading | None]:
    """Profile of a key, smoothed and placed in the track, its file, and what that says besides."""
    is_rail = role.startswith("counterface")
    section = scene.counterface
    slope, placing = slope_of(section.inclination), (1e-3 * section.gauge_mm, half_span)
    depth = 1e-3 * section.gauge_height_mm
    path = _place_of(scene, role, name, kept)
    if path is None or path.suffix == ".toml":
        looks_like_file = any(mark in name for mark in "/\\") or Path(name).suffix not in ("", ".toml")
        if looks_like_file and not standard.is_designation(name):
            raise ProfileError(
                "there is no such file as given, next to the scene file or among the shipped profiles"
            )
        short = name.removesuffix(".toml")
        shape = (
            standard.rail(short, slope, *placing, gauge_height=depth) if is_rail else standard.wheel(short)
        )
        path = standard.find_shipped(short)
        return shape, InputFile(role, name, path, path.read_bytes(), shipped=True), None
    reading = read_profile(path, "rail" if is_rail else "wheel")
    path = reading.files[-1]  # of a list of slices, the slice
    smooth = {"wheelset": scene.wheelset.smooth_mm, "counterface": section.smooth_mm}
    shape = smoothed(reading.profile, 1e-3 * (smooth.get(role.partition(".")[0]) or 0.0))
    shape = place_rail(shape, tilt_to_add(reading.lean, slope), *placing, depth) if is_rail else shape
    try:
        return shape, InputFile(role, name, path, path.read_bytes()), reading
    except OSError as error:
        raise ProfileError(f"{path} cannot be read: {error.strerror}") from error


def _kept_files(path: Path) -> dict[str, Path]:
    try:
        roles = json.loads((path.parent / _INPUTS).read_text(encoding="utf-8"))
        return {str(role): path.parent / str(name) for role, name in roles.items()}
    except (OSError, ValueError, AttributeError) as error:
        message = f"cannot be read ({error}); start the scene again with `wearsim run` and another --out"
        raise SceneError([Fault(message, str(path.parent / _INPUTS))]) from error
