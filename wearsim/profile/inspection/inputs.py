"""What a user names - a standard shape, a definition or a measured file - as a profile with its origin.

Warnings on what was read: headers that contradict its use or its points, hollowing that is noise.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from wearsim.errors import ProfileError
from wearsim.profile import measures, standard
from wearsim.profile.definitions import Definition, sample
from wearsim.profile.files import FORMATS, ProfileReading, is_file, place_file, read_profile
from wearsim.profile.files.points import number_fault, read_text
from wearsim.profile.placement import INCLINATION, UPRIGHT, tilt_to_add
from wearsim.profile.shape import Kind, Profile
from wearsim.profile.smoothing import smoothed

_SPACING = 0.25e-3  # point distance of standard shapes [m]
_WRITTEN = re.compile(r"^\s*[#!]\s*(wheel|rail) profile\b", re.MULTILINE)
_FLANGE_HEIGHT = (20e-3, 45e-3)  # of a wheel, not of a rail head of the same size [m]
_HEAD = (0.1, 0.06)  # largest width and height of a rail head [m]; a wheel may be wider or higher
_BOTH_SIDES = 8e-3  # a head falls off by this on both sides of its top [m]
_HEADER_LINES = 5  # lines searched for a word on the kind
_NOISE_WAVELENGTH = 5e-3  # shorter waves are no hollowing: a contact band is ten times as wide [m]
_MOST_NOISE = 50e-6  # share of the hollowing that such waves may have without a warning [m]
_HEADER_MEASURES = {"Sh": "flange_height", "Sd": "flange_thickness", "qR": "flange_gradient"}
_HEADER_TOLERANCE = 0.5e-3  # smoothing in an instrument makes no larger difference [m]
_SAME_WHEEL = ("Stock", "CarNo", "AxleNo", "WheelID")  # keys that measurements of one wheel share
_SIDES = {"l": "left", "r": "right"}  # by the first letter of a header's word
_SHOWN = 40  # characters of a header value


@dataclass(frozen=True, kw_only=True)
class ProfileInput(ProfileReading):
    """A profile and where it comes from; a definition has the format "definition"."""

    given: str  # what the user wrote
    title: str  # format or designation, for people
    source: str
    certainty: str = ""  # how sure the source is; not known of a file

    @property
    def upright(self) -> bool:
        """Whether it is a rail that needs an inclination in the track."""
        return self.lean is not None and abs(self.lean) <= UPRIGHT

    @property
    def kind(self) -> Kind:
        """Wheel or rail."""
        return self.profile.kind

    @property
    def measured(self) -> bool:
        """Whether the points come from a file, not from a definition."""
        return self.format != "definition"

    def key(self, name: str) -> str:
        """Value of a header key in any case of letters, empty if it has none."""
        return {key.lower(): value.strip() for key, value in self.header.items()}.get(name.lower(), "")

    def noted(self, *notes: str) -> ProfileInput:
        """Return the same with further notes."""
        return replace(self, notes=(*self.notes, *notes))


def read_input(
    given: str, kind: Kind | None = None, statements: Mapping[str, Any] | None = None
) -> ProfileInput:
    """Profile by the name of a standard shape, from a definition (`.toml`) or from a measured file.

    Parameters
    ----------
    given : str
        Name, designation such as "S1002/h30", or path.
    kind : {"wheel", "rail"}, optional
        What it is; detected by the definition, the extension or the content of a file.
    statements : mapping, optional
        On a file, as arguments of `read_profile`.

    Raises
    ------
    ProfileError
        One line per fault.
    """
    path = Path(given)
    if path.is_dir():
        raise ProfileError(f"{given}: is a folder; measure all its files with --fleet {given}")
    if not is_file(given):
        return _defined(given, standard.definition(given, kind), kind)
    if path.suffix.lower() == ".toml" and path.is_file():
        return _defined(given, standard.read_definition(path), kind)
    return _from_file(given, kind, statements or {})


def tilt_of(rail: ProfileInput, inclination: float | None) -> float:
    """Tilt [-] that brings a rail into the track; 0 for a head that leans already.

    Where no inclination is stated, `INCLINATION` for a rail that stands upright, else 0, for measured points
    stand as they were measured.
    """
    if inclination is None:
        return INCLINATION if rail.upright else 0.0
    return tilt_to_add(rail.lean, inclination)


def placement_notes(rail: ProfileInput, inclination: float | None) -> tuple[str, ...]:
    """How a measured rail is put into the track at the stated inclination; empty for other profiles."""
    if rail.kind == "wheel" or not rail.measured:
        return ()
    tilt = tilt_of(rail, inclination)
    if tilt and inclination is None:
        return (
            f"in the track inclined 1:{1.0 / tilt:.4g}, for it is upright (--inclination none leaves it)",
        )
    if tilt:
        already = "" if rail.upright else "; state none for points that lean already"
        return (f"in the track inclined 1:{1.0 / tilt:.4g} by --inclination{already}",)
    if rail.lean is not None and rail.lean > UPRIGHT:
        again = " and is not tilted again" if inclination else ""
        return (f"in the track as measured: the head leans 1:{1.0 / rail.lean:.3g} already{again}",)
    hint = "" if inclination is not None else "; if it was measured upright, state --inclination 1:40"
    return (f"in the track as measured{hint}",)


def placed(rail: ProfileInput, inclination: float | None, gauge: float, half_span: float) -> Profile:
    """Rail profile in the track at an inclination, see `tilt_of`; the rest in m as of `place_rail`."""
    tilt = tilt_of(rail, inclination)
    if rail.measured or is_file(rail.given):
        return place_file(rail.profile, rail.given, tilt, gauge, half_span)
    return standard.rail(rail.given, tilt, gauge, half_span)


def _defined(given: str, shape: Definition, kind: Kind | None) -> ProfileInput:
    if kind is not None and shape.kind != kind:
        raise ProfileError(f"{given}: is a {shape.kind} profile, a {kind} is needed")
    y, z = sample(shape, _SPACING)
    upright = shape.kind == "rail" and shape.inclined_gauge_y is None
    notes = [f"points every {_SPACING * 1e3:g} mm"]
    if shape.kind == "rail":
        notes.append("upright, y from the symmetry axis" if upright else "as it stands in the track")
    return ProfileInput(
        profile=Profile(shape.name, shape.kind, y, z, shape.source), format="definition", header={}, files=(),
        notes=tuple(notes), lean=0.0 if upright else None, given=given, title=shape.title,
        source=shape.source, certainty=shape.certainty,
    )  # fmt: skip


def _from_file(given: str, kind: Kind | None, statements: Mapping[str, Any]) -> ProfileInput:
    path = Path(given)
    detected, notes = (kind, ()) if kind is not None else _stated_kind(path)
    if detected is None:
        reading, notes = _either(path, statements)
    else:
        reading = read_profile(path, detected, **statements)
    notes = (*notes, *reading.notes[1:])
    if reading.diameter is not None:
        of = f"wheel diameter {1e3 * reading.diameter:g} mm of the header"
        notes += (f"{of} taken, if no other is stated",)
    title, source = FORMATS[reading.format].title, f"file {path.name}"
    return ProfileInput(**vars(reading) | {"notes": notes}, given=given, title=title, source=source)


def _stated_kind(path: Path) -> tuple[Kind | None, tuple[str, ...]]:
    """Kind that the extension or a first comment stands for, with a note on it."""
    by_suffix = {kind for each in FORMATS.values() if (kind := each.suffixes.get(path.suffix.lower(), ""))}
    if len(by_suffix) == 1:
        return "wheel" if by_suffix == {"wheel"} else "rail", ()
    # what is wrong with the file is said by its reader
    head = "\n".join(read_text(path).lines[:_HEADER_LINES])
    if match := _WRITTEN.search(head):
        return "wheel" if match[1] == "wheel" else "rail", (f"a {match[1]} by its first comment",)
    return None, ()


def _either(path: Path, statements: Mapping[str, Any]) -> tuple[ProfileReading, tuple[str, ...]]:
    """Read a file that does not name its kind: by its content, or a question to the user."""
    readings: dict[Kind, ProfileReading] = {}
    faults: list[list[str]] = []
    kinds: tuple[Kind, Kind] = ("wheel", "rail")
    for kind in kinds:
        try:
            readings[kind] = read_profile(path, kind, **statements)
        except ProfileError as error:
            faults.append(str(error).splitlines())
    if "wheel" in readings and ("rail" not in readings or _has_flange(readings["wheel"].profile)):
        return readings["wheel"], ("a wheel by its flange",)
    if "wheel" not in readings and "rail" in readings and _has_head(readings["rail"].profile):
        return readings["rail"], ("a rail by the shape of its head",)
    if len(faults) == 2 and (both := [line for line in faults[0] if line in faults[1]]):
        raise ProfileError("\n".join(both))
    raise ProfileError(
        f"{path}: has neither the flange of a wheel nor crown and both sides of a rail head; state --kind "
        "wheel or --kind rail to see its faults, or check the units and the order of the columns y and z"
    )


def _has_head(profile: Profile) -> bool:
    """Whether a profile has the crown and the sides of a rail head."""
    y, z = profile.y, profile.z
    top = int(np.argmin(z))
    fall = min(float(np.ptp(side)) for side in (z[: top + 1], z[top:]))
    return bool(np.ptp(y) <= _HEAD[0] and np.ptp(z) <= _HEAD[1] and fall >= _BOTH_SIDES)


def _has_flange(profile: Profile) -> bool:
    """Whether a profile has the flange of a wheel."""
    try:
        height = measures.flange_height(profile.y, profile.z)
        measures.flange_thickness(profile.y, profile.z)
    except ProfileError:
        return False
    return _FLANGE_HEIGHT[0] <= height <= _FLANGE_HEIGHT[1]


def axle_notes(right: ProfileInput, left: ProfileInput) -> tuple[str, ...]:
    """Contradictions between the sides of an axle and the headers of their files."""
    return tuple(
        f"used as the {role} wheel, but the header of {each.given} says Side = {side}"
        for role, each in (("right", right), ("left", left))
        if (side := each.key("Side").strip(" %.")[:_SHOWN]) and _SIDES.get(side[0].lower(), role) != role
    )


def comparison_notes(given: ProfileInput, reference: ProfileInput) -> tuple[str, ...]:
    """One sentence with all keys that differ between the headers of two measurements of one wheel or rail."""
    differ = [
        f"{name} {here!r} against {there!r}"
        for name in _SAME_WHEEL
        if (here := given.key(name)[:_SHOWN]) and (there := reference.key(name)[:_SHOWN]) and here != there
    ]
    return (f"is it the same {given.kind}? The headers differ: {', '.join(differ)}",) if differ else ()


def header_notes(
    given: ProfileInput, values: Mapping[str, float], elsewhere: Collection[str] = ()
) -> tuple[str, ...]:
    """Gauge values of a wheel's header that contradict the measures [m] of its points.

    Measures of `elsewhere` were taken at other distances than the usual ones, which no header means.
    """
    notes = []
    for key, name in _HEADER_MEASURES.items():
        text = given.key(key).replace(",", ".")
        # instruments write 0 for what they did not measure
        header = 0.0 if number_fault(text) else 1e-3 * float(text)
        compared = header > 0.0 and name in values and name not in elsewhere
        if compared and abs(header - values[name]) > _HEADER_TOLERANCE:
            notes.append(
                f"the header says {key} = {1e3 * header:g} mm, the points give {1e3 * values[name]:.2f} mm: "
                "it is old, of another wheel or taken at other distances"
            )
    return tuple(notes)


def hollowing_notes(given: ProfileInput, values: Mapping[str, float]) -> tuple[str, ...]:
    """Warning on a hollowing, among the measures [m] of a wheel, that is noise for a good part."""
    whole = values.get("hollowing", 0.0)
    if whole <= _MOST_NOISE or not given.measured:
        return ()
    try:
        profile = smoothed(given.profile, _NOISE_WAVELENGTH)
    except ProfileError:
        return ()  # points too few to see short waves
    rest = measures.hollowing(profile.y, profile.z)
    if whole - rest <= _MOST_NOISE:
        return ()
    wavelength = f"{1e3 * _NOISE_WAVELENGTH:g}"
    return (
        f"of {1e3 * whole:.3f} mm hollowing {1e3 * rest:.3f} mm are left without waves shorter than "
        f"{wavelength} mm: noise or dents (--smooth-mm {wavelength} takes them out)",
    )
