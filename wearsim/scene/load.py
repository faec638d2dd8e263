"""Scene files: read, checked with all faults at once, and made into the ingredients of a campaign."""

from __future__ import annotations

import json
import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import TypeAdapter, ValidationError

from wearsim.contact.solve import ContactModels, Counterface, Wheelset
from wearsim.damage.wear import WearSettings
from wearsim.errors import Fault, SceneError
from wearsim.operation.field import TrackClass, collective
from wearsim.operation.monitor import with_monitors
from wearsim.operation.points import ControlSettings, OperatingPoints
from wearsim.operation.rig import Block, programme
from wearsim.scene.cross_checks import scene_warnings
from wearsim.scene.faults import key_lines, shown, syntax_fault, validation_faults
from wearsim.scene.inputs import InputFile, Inputs, find_file, read_inputs
from wearsim.scene.models import AnyScene, CompareScene, FieldScene, Origin, RigScene

Scene = RigScene | FieldScene | CompareScene

_MODELS: dict[str, type[RigScene] | type[FieldScene] | type[CompareScene]] = {
    "rig": RigScene,
    "field": FieldScene,
    "compare": CompareScene,
}
_LARGEST_FILE = 2_000_000
_INPUTS = "inputs.json"
_RESERVED = (_INPUTS, "manifest.json")


@dataclass(frozen=True)
class CampaignSetup:
    """Everything a campaign is run with.

    Parameters
    ----------
    kind : {"rig", "field"}
        Of the scene.
    wheelset : Wheelset
        New wheels, with points at the scene's spacing.
    counterface : Counterface
        Rail or roller, placed.
    models : ContactModels
        Of the contact.
    wear : WearSettings
        Law, coefficients, form, density.
    points : OperatingPoints
        Load collective with monitoring points.
    control : ControlSettings
        Distance and steps.
    scene_text : str
        The scene file.
    title : str
        Of the campaign.
    input_hashes : tuple of (str, str)
        Name and SHA-256 of the scene file and of every profile.
    warnings : tuple of str
        What deserves a second look, one line each.
    """

    kind: Literal["rig", "field"]
    wheelset: Wheelset
    counterface: Counterface
    models: ContactModels
    wear: WearSettings
    points: OperatingPoints
    control: ControlSettings
    scene_text: str
    title: str
    input_hashes: tuple[tuple[str, str], ...]
    warnings: tuple[str, ...]


def load_scene(path: str | Path, *, copied: bool = False) -> Scene:
    """Read a scene file, and those it names, and check everything that can be checked before a run.

    Parameters
    ----------
    path : str or Path
        Scene file: as given, or below the shipped files, such as "workflows/rig.toml".
    copied : bool
        Whether the file stands in a folder written from `files_to_copy`; the files it names are then
        those beside it, whatever happened to the originals.

    Returns
    -------
    RigScene, FieldScene or CompareScene
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
    scene = _read(found, "scene")
    faults: list[Fault] = []
    if isinstance(scene, CompareScene):
        for role in ("rig", "field"):
            faults += _read_compared(scene, role, kept)
    else:
        faults = _read_files(scene, kept)
    if faults:
        raise SceneError(faults)
    return scene


def files_to_copy(scene: Scene) -> dict[str, bytes]:
    """Files with which a scene can be loaded again elsewhere, by `load_scene(..., copied=True)`.

    Parameters
    ----------
    scene : Scene
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
            for file in _inputs(part).files[1:]
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


def build(scene: RigScene | FieldScene) -> CampaignSetup:
    """Make the ingredients of a campaign from a scene, in SI units.

    Parameters
    ----------
    scene : RigScene or FieldScene
        As loaded; of a compare scene, its `rig` or its `field`.

    Returns
    -------
    CampaignSetup
        What the campaign is run with.
    """
    inputs = _inputs(scene)
    contact, campaign, header = scene.contact, scene.campaign, scene.scene
    rig = isinstance(scene, RigScene)
    return CampaignSetup(
        kind="rig" if rig else "field",
        wheelset=Wheelset(inputs.right, inputs.left, 1e-3 * scene.wheelset.radius_mm, inputs.half_span),
        counterface=Counterface(
            inputs.counterface,
            1e3 / scene.counterface.roller_radius_mm if isinstance(scene, RigScene) else 0.0,
        ),
        models=ContactModels(
            normal=contact.normal,
            tangential=contact.tangential,
            strips=contact.strips,
            cells=contact.cells,
            youngs_modulus=1e9 * contact.youngs_GPa,
            poisson_ratio=contact.poisson,
            parameters=(("virtual_penetration_factor", contact.virtual_penetration_factor),),
        ),
        wear=WearSettings(
            law=scene.wear.law,
            coefficients=scene.wear.coefficients,
            form=scene.wear.form,
            density=scene.wear.density_kg_m3,
        ),
        points=_points(scene),
        control=ControlSettings(
            distance=1e3 * campaign.distance_km,
            depth_cap=1e-6 * campaign.max_step_depth_um,
            stability=campaign.stability,
            smoothing_wavelength=1e-3 * campaign.smoothing_wavelength_mm,
            integrator=campaign.integrator,
            **({} if campaign.max_step_km is None else {"max_step": 1e3 * campaign.max_step_km}),
        ),
        scene_text=scene.origin.content.decode("utf-8-sig"),
        title=header.title or scene.origin.path.stem,
        input_hashes=tuple((_hash_name(file), file.sha256) for file in inputs.files),
        warnings=tuple(
            # results tell the file by its name alone: the run reads a copy, and folders are nobody's business
            str(replace(warning, file=scene.origin.path.name))
            for warning in warnings_of(scene)
        ),
    )


def warnings_of(scene: RigScene | FieldScene) -> tuple[Fault, ...]:
    """Tell what a scene may hold, but deserves a second look.

    Parameters
    ----------
    scene : RigScene or FieldScene
        As loaded.

    Returns
    -------
    tuple of Fault
        In the order of the file; `wearsim.scene.touch.check_contact` adds what only the contact tells.
    """
    return scene_warnings(scene, _inputs(scene).clearance)


def scene_schema() -> dict[str, Any]:
    """JSON schema of the scene file, for editors.

    Returns
    -------
    dict
        Draft 2020-12; any of the three kinds.
    """
    schema = TypeAdapter(Scene).json_schema(by_alias=True)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "wearsim scene file",
        **schema,
    }


def _points(scene: RigScene | FieldScene) -> OperatingPoints:
    rotation, torque = scene.contact.rotation, scene.contact.torque_Nm
    if isinstance(scene, RigScene):
        points = programme(
            [
                Block(
                    name=run.name,
                    shift=1e-3 * run.shift_mm,
                    wheel_load=1e3 * run.load_kN,
                    speed=run.speed_km_h / 3.6,
                    friction=run.friction,
                    distance=1e3 * run.distance_km,
                    yaw=1e-3 * run.yaw_mrad,
                    roll=1e-3 * run.roll_mrad,
                    environment=run.environment,
                )
                for run in scene.operation.blocks
            ],
            rotation=rotation,
            torque=torque,
        )
    else:
        points = collective(
            [
                TrackClass(
                    name=run.name,
                    shift_mean=1e-3 * run.shift_mean_mm,
                    shift_std=1e-3 * run.shift_std_mm,
                    wheel_load=1e3 * run.load_kN,
                    speed=run.speed_km_h / 3.6,
                    friction=run.friction,
                    share=run.share,
                    track_curvature=0.0 if run.curve_radius_m is None else 1.0 / run.curve_radius_m,
                    positions=run.positions,
                    yaw=1e-3 * run.yaw_mrad,
                    roll=1e-3 * run.roll_mrad,
                    environment=run.environment,
                )
                for run in scene.operation.classes
            ],
            rotation=rotation,
            torque=torque,
        )
    monitor = scene.operation.monitor
    if monitor is None:
        return points
    return with_monitors(
        points,
        1e-3 * np.array(monitor.shifts_mm, dtype=np.float64),
        wheel_load=1e3 * monitor.load_kN,
        speed=monitor.speed_km_h / 3.6,
        friction=monitor.friction,
        yaw=1e-3 * monitor.yaw_mrad,
    )


def _read(path: Path, role: str) -> Scene:
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
        lines = key_lines(text)
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise SceneError([Fault("not UTF-8 text; save the scene file as UTF-8", file, line)]) from error
    except ValueError as error:
        raise SceneError([syntax_fault(error, text, file)]) from error
    except RecursionError:
        raise SceneError([Fault("tables or lists are nested too deeply for a scene file", file)]) from None
    header = data.get("scene")
    kind = header.get("kind") if isinstance(header, dict) else None
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


def _read_compared(scene: CompareScene, role: str, kept: Mapping[str, Path]) -> list[Fault]:
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
        part = _read(path, role)
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


def _inputs(scene: RigScene | FieldScene) -> Inputs:
    inputs = scene._inputs
    if not isinstance(inputs, Inputs):
        raise ValueError("a scene is built after load_scene has read its files")
    return inputs


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


def _hash_name(file: InputFile) -> str:
    return file.path.name if file.role == "scene" else f"{file.role} {file.name}"
