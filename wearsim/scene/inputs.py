"""The files a scene names, and what only shows once they are read: the last stage of its checks."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from wearsim.damage.wear.table import WearTable
from wearsim.errors import Fault, ProfileError, SceneError
from wearsim.profile import standard
from wearsim.profile.conicity import flange_clearance
from wearsim.profile.files import read_profile
from wearsim.profile.placement import place_rail
from wearsim.profile.shape import Profile, resample
from wearsim.scene.clearance import beyond_clearance
from wearsim.scene.cross_checks import cross_faults, fault_at, fit_faults, limit_faults
from wearsim.scene.models import FieldScene, Origin, RigScene
from wearsim.scene.reprofiling import template_faults
from wearsim.scene.wear_table import read_wear_table
from wearsim.toml_faults import shown

FLANGE_BACK_TO_ORIGIN = 0.070
"""From the flange back to the origin line of a wheel profile [m]."""


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
        Where it was found.
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
        What the right and the left wheel are turned to, with the points of the wheels.
    """

    right: Profile
    left: Profile
    counterface: Profile
    half_span: float
    clearance: tuple[float | None, float | None]
    files: tuple[InputFile, ...]
    wear_table: WearTable | None = None
    templates: tuple[Profile, Profile] | None = None


def find_file(name: str, folders: tuple[Path, ...], shipped: str) -> Path | None:
    """Existing file of a name: as given, beside the scene, among the shipped files.

    Parameters
    ----------
    name : str
        As written by the user.
    folders : tuple of Path
        Folders of scene files to look beside.
    shipped : str
        Folder of the shipped files: "profiles" or "workflows".

    Returns
    -------
    Path or None
        The first that exists.
    """
    places = (Path(name), *(folder / name for folder in folders))
    places += (standard.shipped_path(name), standard.shipped_path(shipped, name))
    try:
        return next((place for place in places if place.is_file()), None)
    except (OSError, ValueError):  # a name too long, or with a zero byte
        return None


def read_inputs(scene: RigScene | FieldScene, kept: Mapping[str, Path]) -> tuple[Inputs | None, list[Fault]]:
    """Read the profiles of a scene and cross-check its values.

    Parameters
    ----------
    scene : RigScene or FieldScene
        With valid keys, types and ranges.
    kept : mapping
        Path by role of files kept with a copied scene; they come before any other place.

    Returns
    -------
    inputs : Inputs or None
        None if there are faults.
    faults : list of Fault
        All that were found.
    """
    origin = scene.origin
    half_span = 0.5e-3 * scene.wheelset.back_to_back_mm + FLANGE_BACK_TO_ORIGIN
    faults: list[Fault] = []
    files = [InputFile("scene", origin.path.name, origin.path, origin.content)]
    spacing = 1e-3 * scene.campaign.point_spacing_mm

    def profile(section: str, key: str, name: str) -> Profile | None:
        role = f"{section}.{key}"
        try:
            found = _read_profile(scene, role, name, half_span, kept)
            stays = section == "counterface" and scene.counterface.wear is None
            shape = found[0] if stays else resample(found[0], spacing)
        except ProfileError as error:
            faults.extend(
                Fault(
                    f"{key} = {shown(name)}: {told}", str(origin.path), scene.line(*section.split("."), key)
                )
                for told in str(error).splitlines()
            )
            return None
        files.append(found[1])
        return shape

    wheelset = scene.wheelset
    right = profile("wheelset", "profile", wheelset.profile)
    left = (
        right if wheelset.profile_left is None else profile("wheelset", "profile_left", wheelset.profile_left)
    )
    counterface = profile("counterface", "profile", scene.counterface.profile)
    turning = scene.campaign.reprofiling
    named = None if turning is None else turning.profile
    template = None if named is None else profile("campaign.reprofiling", "profile", named)
    table, told_of_table = _wear_table(scene, kept, files)
    faults += told_of_table
    faults += cross_faults(scene)
    if right is None or left is None or counterface is None or (named is not None and template is None):
        return None, _sorted(faults)
    matched = _with_points(left, len(right.y), spacing)
    if matched is None:
        faults.append(
            fault_at(
                scene,
                ("wheelset", "profile_left"),
                _unmatched("profile_left", wheelset.profile_left, scene, len(right.y)),
            )
        )
        return None, _sorted(faults)
    unfit = fit_faults(scene, (right, matched), counterface)
    if unfit:
        return None, _sorted(faults + unfit)
    templates = None if turning is None else (right, matched)
    if template is not None and turning is not None:
        with_points = _with_points(template, len(right.y), spacing)
        if with_points is None:
            path = ("campaign", "reprofiling", "profile")
            faults.append(fault_at(scene, path, _unmatched("profile", named, scene, len(right.y))))
            return None, _sorted(faults)
        templates = (with_points, with_points)
    if turning is not None and templates is not None:
        limits = scene.campaign.limits
        faults += [
            fault_at(scene, path, one)
            for path, one in template_faults(turning, limits, templates, counterface)
        ]
    free = flange_clearance(right, counterface)
    clearance = (free, free if left is right else flange_clearance(matched, counterface))
    faults += limit_faults(scene, (right, matched), counterface, end=True)
    told = {fault.line for fault in faults}
    faults += [fault for fault in beyond_clearance(scene, clearance)[0] if fault.line not in told]
    inputs = Inputs(right, matched, counterface, half_span, clearance, tuple(files), table, templates)
    return (None if faults else inputs), _sorted(faults)


def _unmatched(key: str, name: str | None, scene: RigScene | FieldScene, count: int) -> str:
    return (
        f"{key} = {shown(name)} cannot be given as many points as the right wheel ({count}); "
        f"change point_spacing_mm = {scene.campaign.point_spacing_mm:g} a little"
    )


def _wear_table(
    scene: RigScene | FieldScene, kept: Mapping[str, Path], files: list[InputFile]
) -> tuple[WearTable | None, list[Fault]]:
    """Read the table that `table_file` names, and note its file."""
    name, role = scene.wear.table_file, "wear.table_file"
    if name is None:
        return None, []
    origin: Origin = scene.origin
    path = kept.get(f"{origin.role}/{role}") or find_file(name, (origin.path.parent,), "profiles")
    if path is None:
        told = f"table_file = {shown(name)} does not exist as given or beside the scene; give a wear table"
        return None, [fault_at(scene, ("wear", "table_file"), told)]
    try:
        table = replace(read_wear_table(path), name=Path(name).name)
        files.append(InputFile(role, name, path, path.read_bytes()))
    except OSError as error:
        return None, [Fault(f"cannot be read ({error.strerror}); give a wear table", str(path))]
    except SceneError as error:
        return None, list(error.faults)
    return table, []


def _sorted(faults: list[Fault]) -> list[Fault]:
    return sorted(faults, key=lambda fault: fault.line or 0)


def _read_profile(
    scene: RigScene | FieldScene, role: str, name: str, half_span: float, kept: Mapping[str, Path]
) -> tuple[Profile, InputFile]:
    origin: Origin = scene.origin
    counterface = scene.counterface
    is_rail = role.startswith("counterface")
    kind: Literal["wheel", "rail"] = "rail" if is_rail else "wheel"
    inclination = 0.0 if counterface.inclination == "none" else 1.0 / float(counterface.inclination[2:])
    gauge = 1e-3 * counterface.gauge_mm
    path = kept.get(f"{origin.role}/{role}") or find_file(name, (origin.path.parent,), "profiles")
    if path is None or path.suffix == ".toml":
        looks_like_file = any(mark in name for mark in "/\\") or Path(name).suffix not in ("", ".toml")
        if looks_like_file and not standard.is_designation(name):
            raise ProfileError(
                "there is no such file as given, beside the scene or among the shipped profiles"
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
