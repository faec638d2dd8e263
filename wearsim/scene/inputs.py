"""The files a scene names, and what only shows once they are read: the last stage of its checks."""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from wearsim.damage.wear import coefficient_set
from wearsim.errors import Fault, ProfileError, SceneError
from wearsim.profile import standard
from wearsim.profile.files import read_two_column
from wearsim.profile.measures import flange_thickness
from wearsim.profile.placement import place_rail
from wearsim.profile.shape import Profile, resample
from wearsim.scene.faults import shown
from wearsim.scene.models import FieldScene, Origin, RigScene

SMALLEST_ROLLER_MM = 50.0
"""Below this a roller is no longer large against a contact patch of 10 to 20 mm [mm]."""

FLANGE_BACK_TO_ORIGIN = 0.070
"""From the flange back to the origin line of a wheel profile [m]."""

LARGEST_SHIFT_MM = 20.0
WIDEST_POSITION_SPACING_MM = 2.0
"""About half the width of the narrower patches [mm]."""


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
    files : tuple of InputFile
        The scene file first.
    """

    right: Profile
    left: Profile
    counterface: Profile
    half_span: float
    files: tuple[InputFile, ...]


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
    half_span = 0.5e-3 * scene.wheelset.flange_back_mm + FLANGE_BACK_TO_ORIGIN
    faults: list[Fault] = []
    files = [InputFile("scene", origin.path.name, origin.path, origin.content)]
    spacing = 1e-3 * scene.campaign.point_spacing_mm

    def profile(section: str, key: str, name: str) -> Profile | None:
        role = f"{section}.{key}"
        try:
            found = _read_profile(scene, role, name, half_span, kept)
            shape = found[0] if section == "counterface" else resample(found[0], spacing)
        except ProfileError as error:
            faults.extend(
                Fault(f"{key} = {shown(name)}: {told}", str(origin.path), scene.line(section, key))
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
    faults += _cross_faults(scene)
    if right is None or left is None or counterface is None:
        return None, _sorted(faults)
    matched = _with_points(left, len(right.y), spacing)
    if matched is None:
        faults.append(
            _fault(
                scene,
                ("wheelset", "profile_left"),
                f"profile_left = {shown(wheelset.profile_left)} cannot be given as many points as the right "
                f"wheel ({len(right.y)}); change point_spacing_mm = "
                f"{scene.campaign.point_spacing_mm:g} a little",
            )
        )
        return None, _sorted(faults)
    faults += _fit_faults(scene, (right, matched), counterface)
    inputs = Inputs(right, matched, counterface, half_span, tuple(files))
    return (None if faults else inputs), _sorted(faults)


def scene_warnings(scene: RigScene | FieldScene) -> tuple[str, ...]:
    """Tell what is allowed but deserves a second look, one line each."""
    found = []
    runs = scene.operation.blocks if isinstance(scene, RigScene) else scene.operation.classes
    if all(run.friction == 0 for run in runs):
        found.append("friction = 0 everywhere: nothing will wear")
    if isinstance(scene, FieldScene):
        for index, run in enumerate(scene.operation.classes):
            step = 6.0 * run.shift_std_mm / (run.positions - 1)
            if step > WIDEST_POSITION_SPACING_MM:
                line = scene.line("operation", "class", index, "positions")
                found.append(
                    f"{scene.origin.path}:{line}: positions = {run.positions} lie {step:.2g} mm apart in "
                    f"class {shown(run.name)}; more than half a patch width (about "
                    f"{WIDEST_POSITION_SPACING_MM:g} mm) leaves ridges between them"
                )
    if scene.campaign.smoothing_wavelength_mm == 0:
        found.append("smoothing_wavelength_mm = 0: wear increments are not smoothed")
    return tuple(found)


def _sorted(faults: list[Fault]) -> list[Fault]:
    return sorted(faults, key=lambda fault: fault.line or 0)


def _fault(scene: RigScene | FieldScene, path: tuple[str | int, ...], message: str) -> Fault:
    return Fault(message, str(scene.origin.path), scene.line(*path))


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
        if looks_like_file:
            raise ProfileError(
                "there is no such file as given, beside the scene or among the shipped profiles"
            )
        short = name.removesuffix(".toml")
        shape = standard.rail(short, inclination, gauge, half_span) if is_rail else standard.wheel(short)
        path = standard.find_shipped("profiles", short)
        return shape, InputFile(role, name, path, path.read_bytes(), shipped=True)
    shape = read_two_column(path, kind)
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


def _cross_faults(scene: RigScene | FieldScene) -> list[Fault]:
    """Faults between values that are each in range."""
    found = []
    if isinstance(scene, RigScene):
        radius = scene.counterface.roller_radius_mm
        if radius < SMALLEST_ROLLER_MM:
            told = (
                f"roller_radius_mm = {radius:g} must be at least {SMALLEST_ROLLER_MM:g} mm: a smaller roller "
                f"is not large against the contact patch of 10 to 20 mm; give the radius of the rollers"
            )
            found.append(_fault(scene, ("counterface", "roller_radius_mm"), told))
    else:
        total = sum(run.share for run in scene.operation.classes)
        if abs(total - 1.0) > 1e-6:
            shares = " + ".join(f"{run.share:g}" for run in scene.operation.classes)
            told = f"share: the shares of all classes, {shares}, must sum to 1, not {total:.7g}; change them"
            found.append(_fault(scene, ("operation", "class", 0, "share"), told))
        for index, run in enumerate(scene.operation.classes):
            reach = abs(run.shift_mean_mm) + 3.0 * run.shift_std_mm
            if reach > LARGEST_SHIFT_MM:
                told = (
                    f"shift_std_mm = {run.shift_std_mm:g} reaches shifts of {reach:g} mm (mean + 3 standard "
                    f"deviations), at most {LARGEST_SHIFT_MM:g} mm; give a smaller mean or deviation"
                )
                found.append(_fault(scene, ("operation", "class", index, "shift_std_mm"), told))
    campaign = scene.campaign
    if 0 < campaign.smoothing_wavelength_mm < 2.0 * campaign.point_spacing_mm:
        told = (
            f"smoothing_wavelength_mm = {campaign.smoothing_wavelength_mm:g} must be 0 (no smoothing) or at "
            f"least twice point_spacing_mm = {campaign.point_spacing_mm:g}; shorter waves are not resolved"
        )
        found.append(_fault(scene, ("campaign", "smoothing_wavelength_mm"), told))
    try:
        coefficient_set(scene.wear.coefficients, scene.wear.law)
    except SceneError as error:
        found += [_fault(scene, ("wear", "coefficients"), fault.message) for fault in error.faults]
    return found


def _shifts(scene: RigScene | FieldScene) -> Iterator[tuple[tuple[str | int, ...], float]]:
    """Every shift of the scene that must find a counterface, with the key that sets it [mm]."""
    if isinstance(scene, RigScene):
        for index, block in enumerate(scene.operation.blocks):
            yield ("operation", "block", index, "shift_mm"), block.shift_mm
    else:
        for index, run in enumerate(scene.operation.classes):
            for side in (-3.0, 3.0):
                shift = run.shift_mean_mm + side * run.shift_std_mm
                yield ("operation", "class", index, "shift_mean_mm"), shift
    if scene.operation.monitor is not None:
        for index, shift in enumerate(scene.operation.monitor.shifts_mm):
            yield ("operation", "monitor", "shifts_mm", index), shift


def _fit_faults(
    scene: RigScene | FieldScene, wheels: tuple[Profile, Profile], counterface: Profile
) -> list[Fault]:
    """Faults of a wheelset that does not stand on its rails."""
    gauge = scene.counterface.gauge_mm
    try:
        thickness = [1e3 * flange_thickness(wheel.y, wheel.z) for wheel in wheels]
    except ProfileError as error:
        return [_fault(scene, ("wheelset", "profile"), f"no flange can be measured: {error}")]
    over_flanges = scene.wheelset.flange_back_mm + sum(thickness)
    if over_flanges >= gauge:
        told = (
            f"gauge_mm = {gauge:g} must be above {over_flanges:.4g} mm, the width over both flanges "
            f"(flange_back_mm = {scene.wheelset.flange_back_mm:g} + {thickness[0]:.4g} + {thickness[1]:.4g}"
            f"); give the gauge of the track or the flange back distance of the wheelset"
        )
        return [_fault(scene, ("counterface", "gauge_mm"), told)]
    top = float(counterface.y[np.argmin(counterface.z)])
    for (path, shift), (sign, wheel) in itertools.product(
        list(_shifts(scene)), zip((1.0, -1.0), wheels, strict=True)
    ):
        tread_end = float(wheel.y[-1]) + sign * 1e-3 * shift
        if tread_end < top:
            key = path[-1] if isinstance(path[-1], str) else path[-2]
            told = (
                f"{key}: at a shift of {shift:g} mm the tread ends {1e3 * (top - tread_end):.3g} mm short of "
                f"the counterface's top: the wheel does not touch it; "
                f"check gauge_mm = {gauge:g} and flange_back_mm = {scene.wheelset.flange_back_mm:g}"
            )
            return [_fault(scene, path, told)]
    return []
