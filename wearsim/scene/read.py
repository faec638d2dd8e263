"""Scenes and the files they name: read, and checked with all faults of a stage at once."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from wearsim.damage.wear.table import WearTable
from wearsim.errors import (
    Fault,
    ProfileError,
    SceneError,
    listed,
    raise_any,
    shown,
    suggestion,
)
from wearsim.operation.recorded import Samples
from wearsim.profile import placement, standard
from wearsim.profile.conicity import flange_clearance
from wearsim.profile.shape import Profile, resample, resample_to
from wearsim.scene import messages
from wearsim.scene.implausible import side_warnings
from wearsim.scene.inputs import Files, Inputs, kept_files, named_profiles, read_profile_of
from wearsim.scene.messages import by_line
from wearsim.scene.models import AnyScene, CompareScene, FieldScene, Origin, RigScene, find_file
from wearsim.scene.overrides import (
    Override,
    Overrides,
    as_overrides,
    at_its_source,
    merge,
    overridden_text,
    toml_text,
)
from wearsim.scene.recorded import read_record
from wearsim.scene.rig import with_programme, with_rig
from wearsim.scene.route import Rails, Route, rails_of, read_vehicle
from wearsim.scene.sweep import SweepScene, read_sweep
from wearsim.scene.wear_table import read_wear_table
from wearsim.toml_faults import (
    LARGEST_FILE,
    LARGEST_TABLE,
    KeyPath,
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
Scene = CampaignScene | SweepScene

MODELS: dict[str, type[Scene]] = {
    "rig": RigScene, "field": FieldScene, "compare": CompareScene, "sweep": SweepScene,
}  # fmt: skip
"""Model of each kind of scene."""
_DICT = Path("scene.toml")  # name of a scene from a dict in results and run directories
_RIGHT, _LEFT = ("wheelset", "profile"), ("wheelset", "profile_left")
_TEMPLATE = ("campaign", "reprofiling", "profile")


def load_scene(
    path: str | Path | Mapping[str, Any],
    *,
    content: bytes | None = None,
    copied: bool = False,
    overrides: Overrides = (),
) -> Scene:
    """Read a scene, and the files it names, and check everything that can be checked before a run.

    Parameters
    ----------
    path : str, Path or dict
        Scene file: as given, or below the shipped files, such as "workflows/rig_given.toml"; or its tables as
        dicts, which name files relative to the current folder. A `Profile` may stand for the name of one,
        also among overrides; rails and rollers are placed in the track like those of files.
    content : bytes, optional
        Of a scene file that need not exist, such as one from standard input.
    copied : bool
        Whether the file stands in a folder written from `files_to_copy`; the files it names are then
        those next to it, whatever happened to the originals.
    overrides : mapping or sequence of Override
        Values to read in place of those in the file, by dotted keys: {"contact.model": "fast"}; None removes
        a key. In a compare scene, keys act on both scenes it names, those that begin with rig or field on the
        one only. In a list of tables a name or a number from 1 selects one:
        "operation.block.curving.friction".

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
        file, content = Path(path), of_at_most(content, LARGEST_FILE, "a scene file", str(path))
    kept = kept_files(file) if copied else {}
    try:
        scene = _read(file, "scene", overrides, content)
        if isinstance(scene, CompareScene):
            _read_compared(scene, kept, overrides, profiles)
        elif isinstance(scene, SweepScene):
            scene._inputs = read_sweep(scene)
        else:
            return _with_inputs(scene, kept, profiles)
    except SceneError as error:
        faults = [at_its_source(fault) for fault in error.faults]
        if isinstance(path, Mapping):
            lines = key_lines(of_dict)
            faults = [by_key(fault, lines) for fault in faults]
        raise SceneError(faults) from error
    return scene


def _scene_file(path: str | Path) -> Path:
    file = find_file(str(path), (), "workflows")
    if file is not None:
        return file
    shipped = list(standard.shipped_path("workflows").glob("*.toml"))
    known = ", ".join(sorted(item.name for item in shipped))
    what = "is a folder, not a scene file" if os.path.isdir(path) else "does not exist"
    message = f"the scene file {what}, neither as given nor among the shipped workflows ({known})"
    message += _near(Path(path), [item.name for item in shipped])
    raise SceneError([Fault(message, str(path))])


def _near(path: Path, shipped: Sequence[str]) -> str:
    """Return the question whether a scene file of a similar name was meant, of the same folder or shipped."""
    try:
        there = [item.name for item in path.parent.glob("*.toml")]
    except (OSError, ValueError):
        there = []
    name = path.name if path.suffix == ".toml" else f"{path.name}.toml"
    return suggestion(name, [*there, *shipped])


def by_key(fault: Fault, lines: Lines) -> Fault:
    """Fault of a scene from a dict with its key in place of a line; of other files as they are."""
    if fault.file != str(_DICT):
        return fault
    path = max((path for path, line in lines.items() if line == fault.line), key=len, default=())
    key = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).removeprefix(".")
    return Fault(fault.message, key or None)


def load_campaign(
    path: str | Path | Mapping[str, Any], *, copied: bool = False, overrides: Overrides = ()
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


def _read(path: Path, role: str, overrides: Sequence[Override] = (), content: bytes | None = None) -> Scene:
    """Stages 1 and 2 of one file: syntax; keys, types and ranges."""
    file = str(path)
    content = content_of(path, "a scene file") if content is None else content
    text = text_of(content, file)
    data, lines = toml_of(text, file), key_lines(text)
    header = data.get("scene")
    kind = header.get("kind") if isinstance(header, dict) else None
    named = kind if isinstance(kind, str) else ""
    own, rows = _overrides_of(overrides, kind, role), list[Override]()
    if own:
        rows = [item for item in own if item.keys[:2] == ("operation", "block") and len(item.keys) > 2]
        data = merge(data, [item for item in own if item not in rows], lines)
        operation = data.get("operation")
        of_file = isinstance(operation, dict) and "programme" in operation and not operation.get("block")
        if not of_file:  # they act on the scene, not on the rows of its programme
            data, rows = merge(data, rows, lines), []
        content = overridden_text(data, own, text, rows).encode()
    model: type[Scene | AnyScene] = MODELS.get(named, AnyScene)
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
    scene._origin = Origin(path, role, content, lines, tuple(rows))
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


def _read_compared(
    scene: CompareScene,
    kept: Mapping[str, Path],
    overrides: Sequence[Override],
    profiles: Mapping[str, Profile],
) -> None:
    """Read the two scenes that a compare scene names, all stages."""
    faults: list[Fault] = []
    for role in ("rig", "field"):
        given = f"{role} = {shown(getattr(scene.compare, role))}"
        places = (scene.origin.path.parent,)
        path = kept.get(role) or find_file(getattr(scene.compare, role), places, "workflows")
        if path is None:
            text = (
                f"{given} does not exist as given, next to the scene file or among the "
                "shipped workflows"
            )
            faults.append(scene.fault(("compare", role), text))
            continue
        with _gathered(faults):
            part = _read(path, role, overrides)
            if isinstance(part, RigScene | FieldScene) and part.scene.kind == role:
                setattr(scene, f"_{role}", _with_inputs(part, kept, profiles))
            else:
                text = f"{given} is a {part.scene.kind} scene; name a {role} scene"
                faults.append(scene.fault(("compare", role), text))
    raise_any(faults)


@contextmanager
def _gathered(faults: list[Fault]) -> Iterator[None]:
    """Add the faults of what is done inside to those known so far, and go on behind it."""
    try:
        yield
    except SceneError as error:
        faults += error.faults


def _with_inputs(
    scene: RigScene | FieldScene, kept: Mapping[str, Path], profiles: Mapping[str, Profile]
) -> RigScene | FieldScene:
    """Read the files of a scene and cross-check its values; raise a SceneError with all faults.

    The scene returned has the contents of the files, and the wheel radius of their headers if it gave none.
    """
    files, faults, leaning = Files(scene, kept, profiles), list[Fault](), list[Fault]()
    if isinstance(scene, RigScene):
        scene = _with_rig(scene, files)
    wheelset, section, rules = scene.wheelset, scene.counterface, scene.campaign.reprofiling
    half_span = 0.5e-3 * wheelset.back_to_back_mm + placement.RUNNING_CIRCLE
    spacing = 1e-3 * scene.campaign.point_spacing_mm
    pairs, sides = rails_of(scene)[0], ("profile", "profile_left")
    placed: dict[KeyPath, Rails] = {(*path, side): pair for pair, path in pairs.items() for side in sides}
    names: dict[KeyPath, str | None] = {
        _RIGHT: wheelset.profile,
        _LEFT: wheelset.left,
        **{key: getattr(pair, str(key[-1])) for key, pair in placed.items()},
        _TEMPLATE: None if rules is None else rules.profile,
    }
    diameters: dict[str, float] = {}
    headers: dict[str, tuple[str, Mapping[str, str]]] = {}
    shapes: dict[KeyPath, Profile] = {}
    for key, name in names.items():
        if name is None:
            continue
        try:
            shape, reading = read_profile_of(scene, key, name, half_span, files, placed.get(key))
            if key[0] == "wheelset":
                headers[str(key[-1])] = name, {} if reading is None else reading.header
            if key not in placed or section.wear is not None:
                shape = resample(shape, spacing)
        except ProfileError as error:
            at = key if key != _LEFT or wheelset.profile_left is not None else _RIGHT  # of one result
            found = [scene.fault(at, f"{at[-1]} = {shown(name)}: {line}") for line in str(error).splitlines()]
            faults += [fault for fault in found if fault not in faults]
            continue
        shapes[key] = shape
        if reading is not None and reading.diameter is not None and key[0] == "wheelset":
            diameters[name] = 1e3 * reading.diameter
        inclination = (placed.get(key) or section).inclination
        slope, lean = placement.slope_of(inclination), None if reading is None else reading.lean
        if key in placed and placement.tilt_to_add(lean, slope) != slope:
            words = placement.lean_words(lean or 0.0)
            text = (
                f"inclination = {shown(inclination)} is without effect: the head in "
                f'{name} {words} already; write inclination = "none"'
            )
            leaning.append(scene.fault((*key[:-1], "inclination"), text))

    def matched(key: KeyPath, count: int) -> Profile:
        """Profile with as many points as the right wheel, by a spacing that differs by up to 3 %."""
        shape = shapes[key]
        with suppress(ProfileError):
            return resample_to(shape, count, spacing * (len(shape.y) - 1) / (count - 1))
        spaced = scene.campaign.point_spacing_mm
        text = (
            f"{key[-1]} = {shown(names[key])} cannot be given as many points as the "
            f"right wheel ({count}); change point_spacing_mm = {spaced:g} a little"
        )
        raise SceneError(by_line([*faults, scene.fault(key, text)]))

    table = None
    with _gathered(faults):
        table = _wear_table(scene, files)
    noted = [*messages.header_warnings(scene, diameters), *side_warnings(scene, headers), *leaning]
    if diameters and "radius_mm" not in wheelset.model_fields_set:
        radius = 0.5 * sum(diameters.values()) / len(diameters)
        scene = scene.model_copy(update={"wheelset": wheelset.model_copy(update={"radius_mm": radius})})
    faults += messages.cross_faults(scene)
    if any(name is not None and key not in shapes for key, name in names.items()):
        raise SceneError(by_line(faults))
    rails = [(shapes[*path, "profile"], shapes.get((*path, "profile_left"))) for path in pairs.values()]
    right, counterface = shapes[_RIGHT], rails[0][0]
    wheels = right, matched(_LEFT, len(right.y)) if _LEFT in shapes else right
    gauges: dict[float, KeyPath] = {one.gauge_mm: (*pairs[one], "gauge_mm") for one in reversed(pairs)}
    if unfit := messages.fit_faults(scene, wheels, counterface, gauges):
        raise SceneError(by_line(faults + unfit))
    templates = None if rules is None else wheels
    if _TEMPLATE in shapes:
        templates = (matched(_TEMPLATE, len(right.y)),) * 2
    if templates is not None:
        faults += messages.template_faults(scene, templates, counterface)
    clearances = []
    for rail, other in rails:
        free, unlike = flange_clearance(right, rail), other is not None or _LEFT in shapes
        clearances.append((free, flange_clearance(wheels[1], other or rail) if unlike else free))
    clearance = clearances[0]
    faults += messages.limit_faults(scene, wheels, counterface, end=True)
    samples, track = None, None
    with _gathered(faults):
        if isinstance(scene, FieldScene):
            track = _route_of(scene, files)
            samples, notes = _record_of(scene, clearance, files)
            noted += notes
    known = {fault.line for fault in faults}
    faults += [fault for fault in messages.beyond_clearance(scene, clearance)[0] if fault.line not in known]
    raise_any(by_line(faults))
    for key in placed:
        if key in shapes and placement.is_partial(shapes[key].y):
            text = (
                f"{key[-1]} = {shown(names[key])} is "
                f"{1e3 * np.ptp(shapes[key].y):.3g} mm wide: without gauge point its y "
                "counts from the running circle, and gauge_mm is without effect"
            )
            noted.append(scene.fault(key, text))
    of_rails = ("counterface.", "vehicle.class.", "vehicle.each.")
    for body, roles in (("wheelset", ("wheelset.",)), ("counterface", of_rails)):
        shipped = all(file.shipped for file in files.read if file.role.startswith(roles))
        if getattr(scene, body).smooth_mm is not None and shipped:
            text = (
                f"smooth_mm is without effect: no profile of [{body}] was read from a "
                "file of points; delete it"
            )
            noted.append(scene.fault((body, "smooth_mm"), text))
    scene._inputs = Inputs(
        *wheels, tuple(rails), half_span, tuple(clearances), tuple(files.read), table, templates, samples,
        track, tuple(noted),
    )  # fmt: skip
    return scene


def _route_of(scene: FieldScene, files: Files) -> Route | None:
    """Read the vehicle of a scene and its route, if it has one; a scene has one way of operation."""
    given = {name: f"[{name}]" for name in ("vehicle", "recorded") if getattr(scene, name) is not None}
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
    found = read_vehicle(scene, files.place)
    for file in found.files:
        files.note(*file)
    return found


def _record_of(
    scene: FieldScene, clearance: tuple[float | None, float | None], files: Files
) -> tuple[Samples | None, list[Fault]]:
    """Read the record of a scene, if it has one: its samples, and warnings."""
    if scene.recorded is None:
        return None, []
    name, shipped = scene.recorded.file, find_file(scene.recorded.file, (), "workflows")
    path = files.found(("recorded", "file"), name, "a CSV or netCDF file", shipped)
    found = read_record(scene, path, clearance)
    files.note("recorded.file", name, path, LARGEST_TABLE)
    return found


def _with_rig(scene: RigScene, files: Files) -> RigScene:
    """Scene with its programme and its rig."""
    faults: list[Fault] = []
    with _gathered(faults):
        scene, path, content = with_programme(scene, files.place)
        if path is not None:
            files.note("operation.programme", str(scene.operation.programme), path, content=content)
    with _gathered(faults):
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
