"""Profiles that a scene names: read, smoothed, placed, made into wheels and rails."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from wearsim.errors import Fault, ProfileError, SceneError, raise_any, shown
from wearsim.profile import placement, standard
from wearsim.profile.conicity import flange_clearance
from wearsim.profile.files import (
    ProfileReading,
    is_result,
    read_profile,
    text_of_profile,
)
from wearsim.profile.files.axes import Statements
from wearsim.profile.point_noise import noise_note
from wearsim.profile.shape import Kind, Profile, resample, resample_to
from wearsim.profile.smoothing import smoothed
from wearsim.scene import checks
from wearsim.scene.campaign import REPROFILING
from wearsim.scene.checks import Campaign, Clearance, Wheels
from wearsim.scene.implausible import side_warnings
from wearsim.scene.inputs import Files
from wearsim.scene.point_files import STATEMENTS, statements_of, with_keys
from wearsim.scene.route import Rails, rails_of
from wearsim.toml_faults import LARGEST_TABLE, KeyPath, table_name

_RIGHT, _LEFT = ("wheelset", "profile"), ("wheelset", "profile_left")
_TEMPLATE = (*REPROFILING, "profile")


@dataclass(frozen=True)
class ReadProfiles:
    """Profiles of a scene by the paths of their keys, of files without faults."""

    names: Mapping[KeyPath, str]
    pairs: dict[Rails, KeyPath]  # of rails, with the table that names them
    half_span: float  # from the track centre to the origin of the wheel profile [m]
    shapes: Mapping[KeyPath, Profile]
    readings: Mapping[KeyPath, ProfileReading]  # of files of points
    faults: tuple[Fault, ...]
    # shapes of files of points, with their points
    measured: Mapping[KeyPath, Profile] = field(default_factory=dict)

    @property
    def complete(self) -> bool:
        """Return True if all profiles were read."""
        return self.names.keys() == self.shapes.keys()

    @property
    def placed(self) -> dict[KeyPath, Rails]:
        """Pair of rails of each key that names one of its profiles."""
        return _placed(self.pairs)

    @property
    def diameters(self) -> dict[str, float]:
        """Wheel diameters [mm] that headers of files state, by name of the file."""
        return {
            self.names[key]: 1e3 * reading.diameter
            for key, reading in self.readings.items()
            if key[0] == "wheelset" and reading.diameter is not None
        }


@dataclass(frozen=True)
class Bodies:
    """Wheels, rails and templates of a scene; the wheels have equally many points."""

    wheels: Wheels
    rails: tuple[tuple[Profile, Profile | None], ...]  # the left one if it differs
    templates: Wheels | None
    clearances: tuple[Clearance, ...]  # on each pair of rails [m]

    @property
    def counterface(self) -> Profile:
        """The right one of the first pair of rails."""
        return self.rails[0][0]


def read_profiles(scene: Campaign, files: Files) -> ReadProfiles:
    """Read all profiles of a scene, those that wear with points at its spacing."""
    half_span = 0.5e-3 * scene.wheelset.back_to_back_mm + placement.RUNNING_CIRCLE
    spacing = 1e-3 * scene.campaign.point_spacing_mm
    pairs = rails_of(scene)[0]
    placed, names = _placed(pairs), _names(scene, pairs)
    shapes, readings = dict[KeyPath, Profile](), dict[KeyPath, ProfileReading]()
    measured = dict[KeyPath, Profile]()
    faults: list[Fault] = []
    for key, name in names.items():
        try:
            shape, reading = _read_profile(
                scene, key, name, half_span, files, placed.get(key)
            )
            if reading is not None:
                measured[key] = shape
            if key not in placed or scene.counterface.wear is not None:
                shape = resample(shape, spacing)
        except ProfileError as error:
            # both wheels of one result are named by one key
            of_right = key == _LEFT and scene.wheelset.profile_left is None
            at = _RIGHT if of_right else key
            lines = [
                f"{at[-1]} = {shown(name)}: {with_keys(line)}"
                for line in str(error).splitlines()
            ]
            shape_faults = [scene.fault(at, line) for line in lines]
            faults += [fault for fault in shape_faults if fault not in faults]
            continue
        shapes[key] = shape
        if reading is not None:
            readings[key] = reading
    return ReadProfiles(
        names, pairs, half_span, shapes, readings, tuple(faults), measured
    )


def _placed(pairs: Mapping[Rails, KeyPath]) -> dict[KeyPath, Rails]:
    sides = ("profile", "profile_left")
    return {(*path, side): pair for pair, path in pairs.items() for side in sides}


def _names(scene: Campaign, pairs: Mapping[Rails, KeyPath]) -> dict[KeyPath, str]:
    """Return the names of the profiles of a scene by the paths of their keys."""
    rules = scene.campaign.reprofiling
    names: dict[KeyPath, str | None] = {
        _RIGHT: scene.wheelset.profile,
        _LEFT: scene.wheelset.left,
        **{key: getattr(pair, str(key[-1])) for key, pair in _placed(pairs).items()},
        _TEMPLATE: None if rules is None else rules.profile,
    }
    return {key: name for key, name in names.items() if name is not None}


def with_radius(scene: Campaign, profiles: ReadProfiles) -> Campaign:
    """Return a scene with the wheel radius of its files if it gives none."""
    diameters = profiles.diameters
    if not diameters or "radius_mm" in scene.wheelset.model_fields_set:
        return scene
    radius = 0.5 * sum(diameters.values()) / len(diameters)
    wheelset = scene.wheelset.model_copy(update={"radius_mm": radius})
    return scene.model_copy(update={"wheelset": wheelset})


def bodies_in_track(scene: Campaign, profiles: ReadProfiles) -> Bodies:
    """Make wheels, rails and templates of the profiles of a scene, which are complete.

    Raises
    ------
    SceneError
        If the wheelset does not stand on its rails, or the profiles of wheels and
        template cannot have equally many points.
    """
    shapes, pairs = profiles.shapes, profiles.pairs
    right = shapes[_RIGHT]
    count = len(right.y)
    left = (
        _resampled_to_count(scene, profiles, _LEFT, count) if _LEFT in shapes else right
    )
    rails = [
        (shapes[*path, "profile"], shapes.get((*path, "profile_left")))
        for path in pairs.values()
    ]
    gauges: dict[float, KeyPath] = {
        pair.gauge_mm: (*pairs[pair], "gauge_mm") for pair in reversed(pairs)
    }
    raise_any(checks.fit_faults(scene, (right, left), rails[0][0], gauges))
    templates = None if scene.campaign.reprofiling is None else (right, left)
    if _TEMPLATE in shapes:
        template = _resampled_to_count(scene, profiles, _TEMPLATE, count)
        templates = template, template
    clearances = []
    for rail, left_rail in rails:
        free = flange_clearance(right, rail)
        unlike = left_rail is not None or _LEFT in shapes
        clearances.append(
            (free, flange_clearance(left, left_rail or rail) if unlike else free)
        )
    return Bodies((right, left), tuple(rails), templates, tuple(clearances))


def _resampled_to_count(
    scene: Campaign, profiles: ReadProfiles, key: KeyPath, count: int
) -> Profile:
    """Profile with a number of points, by a spacing that differs by up to 3 %."""
    shape, spacing = profiles.shapes[key], scene.campaign.point_spacing_mm
    with suppress(ProfileError):
        return resample_to(
            shape, count, 1e-3 * spacing * (len(shape.y) - 1) / (count - 1)
        )
    name = profiles.names[key]
    text = (
        f"{key[-1]} = {shown(name)} cannot be given as many points as the right wheel "
        f"({count}); change point_spacing_mm = {spacing:g} a little"
    )
    raise SceneError([scene.fault(key, text)])


def header_warnings(scene: Campaign, profiles: ReadProfiles) -> list[Fault]:
    """Warnings on diameters, sides and inclinations that files of a scene state."""
    headers: dict[str, tuple[str, Mapping[str, str]]] = {}
    for wheel in (_RIGHT, _LEFT):
        if wheel in profiles.names:
            reading = profiles.readings.get(wheel)
            header = {} if reading is None else reading.header
            headers[wheel[-1]] = profiles.names[wheel], header
    warnings = checks.header_warnings(scene, profiles.diameters) + side_warnings(
        scene, headers
    )
    for key, pair in profiles.placed.items():
        reading, slope = (
            profiles.readings.get(key),
            placement.slope_of(pair.inclination),
        )
        lean = None if reading is None else reading.lean
        if key in profiles.names and placement.tilt_to_add(lean, slope) != slope:
            name, words = profiles.names[key], placement.lean_words(lean or 0.0)
            text = (
                f"inclination = {shown(pair.inclination)} is without effect: the head "
                f'in {name} {words} already; write inclination = "none"'
            )
            warnings.append(scene.fault((*key[:-1], "inclination"), text))
    return warnings


def shape_warnings(
    scene: Campaign, profiles: ReadProfiles, files: Files
) -> list[Fault]:
    """Warnings of rails that were measured in part, and of smoothing without effect."""
    warnings = []
    for key in profiles.placed:
        if key in profiles.shapes and placement.is_partial(profiles.shapes[key].y):
            name, width = profiles.names[key], np.ptp(profiles.shapes[key].y)
            text = (
                f"{key[-1]} = {shown(name)} is {1e3 * width:.3g} mm wide: without "
                "gauge point its y counts from the running circle, and gauge_mm is "
                "without effect"
            )
            warnings.append(scene.fault(key, text))
        elif key in profiles.shapes and (
            note := placement.narrow_head(profiles.shapes[key].y)
        ):
            text = f"{key[-1]} = {shown(profiles.names[key])} is {note}"
            warnings.append(scene.fault(key, text))
    return warnings + _noise_notes(scene, profiles) + _without_effect(scene, files)


def _noise_notes(scene: Campaign, profiles: ReadProfiles) -> list[Fault]:
    """Warnings of noise in measured profiles that `noise_warnings` does not compare.

    Of left rails, rails of single classes, and the profile wheels are reprofiled to.
    """
    compared = (_RIGHT, _LEFT, ("counterface", "profile"))
    warnings = []
    for key, shape in profiles.measured.items():
        if key not in compared and (note := noise_note(shape)):
            table = "[counterface]" if key in profiles.placed else table_name(key[:-1])
            text = (
                f"{key[-1]} = {shown(profiles.names[key])}: {note}; write smooth_mm in "
                f"{table}"
            )
            warnings.append(scene.fault(key, text))
    return warnings


def _without_effect(scene: Campaign, files: Files) -> list[Fault]:
    """Warnings of keys on files of points in tables that name none."""
    warnings = []
    of_rails = ("counterface.", "vehicle.class.", "vehicle.each.")
    tables = {
        ("wheelset",): (scene.wheelset, ("wheelset.",)),
        ("counterface",): (scene.counterface, of_rails),
        REPROFILING: (scene.campaign.reprofiling, (f"{'.'.join(REPROFILING)}.",)),
    }
    for path, (table, roles) in tables.items():
        read = [file for file in files.read if file.role.startswith(roles)]
        measured = [file for file in read if not file.shipped]
        keys = list[str]()
        keys += ("smooth_mm",) if not measured else ()
        keys += STATEMENTS if all(is_result(file.name) for file in measured) else ()
        for key in keys:
            if getattr(table, key, None) is None:
                continue
            text = (
                f"{key} is without effect: no profile of {table_name(path)} was read "
                "from a file of points; delete it"
            )
            warnings.append(scene.fault((*path, key), text))
    return warnings


def _read_profile(
    scene: Campaign,
    key: KeyPath,
    name: str,
    half_span: float,
    files: Files,
    pair: Rails | None,
) -> tuple[Profile, ProfileReading | None]:
    """Profile of a key, smoothed, as a rail placed, and what its file says besides."""
    section, role, is_rail = (
        scene.counterface,
        ".".join(map(str, key)),
        pair is not None,
    )
    track = pair or section
    slope, depth = placement.slope_of(track.inclination), 1e-3 * section.gauge_height_mm
    placing, path = (1e-3 * track.gauge_mm, half_span), files.place(role, name)
    content = None
    if name in files.profiles:
        path, content = _profile_file(
            files.profiles[name], "rail" if is_rail else "wheel", name
        )
    elif path is not None and path.suffix == ".nc":
        path, content = _worn_wheel_file(path, key, scene.wheelset.at_km)
    reading = None
    if path is None or path.suffix == ".toml":
        short = _designation(name)
        shape = (
            standard.rail(short, slope, *placing, gauge_height=depth)
            if is_rail
            else standard.wheel(short)
        )
        path = standard.find_shipped(short)
    else:
        tables = {"wheelset": scene.wheelset, "campaign": scene.campaign.reprofiling}
        table = tables.get(str(key[0]), section)
        # the wheels of a result are written in the axes of wearsim
        stated = Statements() if is_result(name) else statements_of(table)
        reading = read_profile(
            path, "rail" if is_rail else "wheel", content=content, **stated
        )
        smooth = table.smooth_mm if table else None
        shape = smoothed(reading.profile, 1e-3 * (smooth or 0.0))
        if is_rail:
            lean = placement.tilt_to_add(reading.lean, slope)
            shape = placement.place_rail(shape, lean, *placing, depth)
    if is_rail and section.ends == "sharp":
        shape = placement.with_sharp_ends(shape)
    files.note(
        role, name, path, LARGEST_TABLE, None if content is None else content.encode()
    )
    return shape, reading


def _designation(name: str) -> str:
    """Designation of a shipped profile; a fault for the name of a missing file."""
    named_as_file = any(mark in name for mark in "/\\")
    named_as_file = named_as_file or Path(name).suffix not in ("", ".toml")
    if named_as_file and not standard.is_designation(name):
        raise ProfileError(
            "there is no such file as given, next to the scene file or among the "
            "shipped profiles"
        )
    return name.removesuffix(".toml")


def _profile_file(profile: Profile, kind: Kind, name: str) -> tuple[Path, str]:
    """Name and text of the file that stands for a profile of Python."""
    if profile.kind != kind:
        raise ProfileError(
            f"it is a {profile.kind} profile, a {kind} profile is needed"
        )
    return Path(name), text_of_profile(profile, Path(name), "two-column")


def _worn_wheel_file(path: Path, key: KeyPath, at_km: float | None) -> tuple[Path, str]:
    """Name and text of the file that a run keeps for a worn wheel of a result."""
    if key[0] != "wheelset":
        raise ProfileError(
            "a result file has worn wheels; name it as profile in [wheelset]"
        )
    from wearsim.translation.worn_wheel import (
        Side,
        worn_wheel,
    )  # needs xarray, a second to import

    side: Side = "left" if key[-1] == "profile_left" else "right"
    worn = worn_wheel(
        path, side, None if at_km is None else 1e3 * at_km, f"at_km = {at_km or 0.0:g}"
    )
    file = Path(f"{worn.profile.name}.whl")
    return file, text_of_profile(worn.profile, file, "miniprof", 2.0 * worn.radius)
