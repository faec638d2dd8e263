"""What a user names - a standard shape, a definition or a measured file - as a profile with its origin.

Warnings on what was read: headers that contradict its use or its points, hollowing that is noise.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from wearsim.errors import ProfileError, suggestion
from wearsim.profile import measures, standard
from wearsim.profile.definitions import Definition, sample
from wearsim.profile.files import FORMATS, ProfileReading, is_file, place_file, read_profile
from wearsim.profile.files.points import number_fault
from wearsim.profile.placement import INCLINATION, RUNNING_CIRCLE, UPRIGHT, tilt_to_add
from wearsim.profile.shape import Kind, Profile
from wearsim.profile.smoothing import smoothed

_SPACING = 0.25e-3  # point distance of standard shapes [m]
_WRITTEN = re.compile(r"\s*[#!]\s*(wheel|rail) profile\b")
_FLANGE_HEIGHT = (20e-3, 45e-3)  # of a wheel, not of a rail head of the same size [m]
_WIDEST_HEAD = 0.1  # wider points without a flange might be a tread [m]
_HIGHEST_HEAD = 0.06  # higher points may be a wheel with its columns swapped [m]
_BOTH_SIDES = 8e-3  # a head falls off by this on both sides of its top [m]
_ONE_SIDE = 10e-3  # or by this on one side, and steeper there than a flange [m]
_STEEPEST_FLANGE = 78.0  # degrees
_HEADER_LINES = 5  # lines searched for a word on the kind
_NOISE_WAVELENGTH = 5e-3  # shorter waves are no hollowing: a contact band is ten times as wide [m]
_MOST_NOISE = 50e-6  # share of the hollowing that such waves may have without a warning [m]
_HEADER_MEASURES = {
    # key: name of the measure, difference that smoothing in an instrument does not make [m]
    "Sh": ("flange_height", 0.3e-3),
    "Sd": ("flange_thickness", 0.3e-3),
    "qR": ("flange_gradient", 0.5e-3),
}
_SAME_WHEEL = ("Stock", "CarNo", "AxleNo", "Side", "WheelID")  # keys that measurements of one wheel share
_SIDES = {
    **dict.fromkeys(("l", "left", "li", "links", "g", "gauche", "i", "izq"), "left"),
    **dict.fromkeys(("r", "right", "re", "rechts", "d", "droite", "der"), "right"),
}
_SHOWN = 40  # characters of a header value


@dataclass(frozen=True)
class ProfileInput:
    """A profile and where it comes from."""

    given: str  # what the user wrote
    profile: Profile  # in our axes [m]; a rail is not yet placed in the track
    format: str  # key of `wearsim.profile.files.FORMATS`, or "definition"
    title: str  # format or designation, for people
    notes: tuple[str, ...]  # what was detected, changed or left out
    header: Mapping[str, str] = field(repr=False)  # keys and values of a file, unchanged
    source: str
    certainty: str  # how sure the source is; not known of a file
    upright: bool = False  # whether it is a rail that needs an inclination in the track
    lean: float | None = None  # of a measured rail head, see `wearsim.profile.placement.head_lean` [-]
    running_circle: float = RUNNING_CIRCLE  # distance of y = 0 from the flange back [m]
    diameter: float | None = None  # of a wheel at the running circle, if the header states it [m]

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
        return _defined(given, _named(given, kind), kind)
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
    if tilt:
        why = " by --inclination" if inclination is not None else ", for it stands upright"
        other = " (--inclination none leaves it so)" if inclination is None else ""
        already = "" if rail.upright else "; state none for points that lean already"
        return (f"in the track inclined 1:{1.0 / tilt:.4g}{why}{other}{already}",)
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


def _named(given: str, kind: Kind | None) -> Definition:
    """Definition of a shipped shape; without a kind, of whichever it is."""
    kind = kind or standard.designation_kind(given)
    if kind is not None:
        return standard.definition(given, kind)
    names = {each: standard.shipped_names(each) for each in ("wheel", "rail")}
    hint = suggestion(given, [name for each in names.values() for name in each])
    listed = "; ".join(f"{each}s: {', '.join(each_names)}" for each, each_names in names.items())
    raise ProfileError(f"{given!r} is neither a file nor a shipped profile ({listed}){hint}")


def _defined(given: str, shape: Definition, kind: Kind | None) -> ProfileInput:
    if kind is not None and shape.kind != kind:
        raise ProfileError(f"{given}: is a {shape.kind} profile, a {kind} is needed")
    y, z = sample(shape, _SPACING)
    upright = shape.kind == "rail" and shape.inclined_gauge_y is None
    notes = [f"points every {_SPACING * 1e3:g} mm"]
    if shape.kind == "rail":
        notes.append("upright, y from the symmetry axis" if upright else "as it stands in the track")
    return ProfileInput(
        given, Profile(shape.name, shape.kind, y, z, shape.source), "definition", shape.title, tuple(notes),
        {}, shape.source, shape.certainty, upright,
    )  # fmt: skip


def _from_file(given: str, kind: Kind | None, statements: Mapping[str, Any]) -> ProfileInput:
    path = Path(given)
    detected, notes = (kind, ()) if kind is not None else _stated_kind(path)
    if detected is None:
        reading, notes = _either(path, statements)
    else:
        reading = read_profile(path, detected, **statements)
    lean = reading.lean
    result = ProfileInput(
        given, reading.profile, reading.format, FORMATS[reading.format].title, (*notes, *reading.notes[1:]),
        reading.header, f"file {path.name}", "", lean is not None and abs(lean) <= UPRIGHT, lean,
        reading.running_circle or RUNNING_CIRCLE, reading.diameter,
    )  # fmt: skip
    if result.diameter is None:
        return result
    return result.noted(
        f"wheel diameter {1e3 * result.diameter:g} mm of the header taken, if no other is stated"
    )


def _stated_kind(path: Path) -> tuple[Kind | None, tuple[str, ...]]:
    """Kind that the extension or a first comment stands for, with a note on it."""
    by_suffix = {kind for each in FORMATS.values() if (kind := each.suffixes.get(path.suffix.lower(), ""))}
    if len(by_suffix) == 1:
        return "wheel" if by_suffix == {"wheel"} else "rail", ()
    if not path.is_file():
        return None, ()  # a pipe would be waited for
    try:
        with path.open("rb") as file:
            head = file.read(2000).decode("utf-8", "replace").splitlines()[:_HEADER_LINES]
    except (OSError, ValueError):
        return None, ()  # the reader says what is wrong
    for line in head:
        if match := _WRITTEN.match(line):
            return "wheel" if match[1] == "wheel" else "rail", (f"a {match[1]} by its first comment",)
    return None, ()


def _either(path: Path, statements: Mapping[str, Any]) -> tuple[ProfileReading, tuple[str, ...]]:
    """Read a file that does not name its kind: by its content, or a question to the user."""
    readings: dict[Kind, ProfileReading] = {}
    errors: dict[Kind, str] = {}
    kinds: tuple[Kind, Kind] = ("wheel", "rail")
    for kind in kinds:
        try:
            readings[kind] = read_profile(path, kind, **statements)
        except ProfileError as error:
            errors[kind] = str(error)
            continue
        if kind == "wheel" and _has_flange(readings[kind].profile):
            return readings[kind], ("a wheel by its flange",)
    if len(errors) == 2:
        if errors["wheel"] == errors["rail"]:
            raise ProfileError(errors["wheel"])
        both = [line for line in errors["wheel"].splitlines() if line in errors["rail"].splitlines()]
        if both:
            raise ProfileError("\n".join(both))
        raise ProfileError(
            f"{path}: neither a wheel nor a rail: check the order of the columns, state --units, or see the "
            "faults with --kind wheel or --kind rail"
        )
    if "rail" not in readings:
        return readings["wheel"], ("a wheel, for it is no rail",)
    if "wheel" not in readings and _has_head(readings["rail"].profile):
        return readings["rail"], ("a rail by the shape of its head",)
    raise ProfileError(
        f"{path}: has neither the flange of a wheel nor crown and sides of a rail head; state --kind wheel "
        "or --kind rail, or check that the columns y and z are not swapped"
    )


def _has_head(profile: Profile) -> bool:
    """Whether a profile has the crown and the sides of a rail head."""
    y, z = profile.y, profile.z
    if np.ptp(y) > _WIDEST_HEAD or np.ptp(z) > _HIGHEST_HEAD:
        return False
    top = int(np.argmin(z))
    depths = [float(np.ptp(side)) for side in (z[: top + 1], z[top:])]
    if min(depths) >= _BOTH_SIDES:
        return True
    deep = slice(0, top + 1) if depths[0] > depths[1] else slice(top, len(z))
    side = z[deep] - z[top] >= 0.5 * _ONE_SIDE
    y_side, z_side = y[deep][side], z[deep][side]
    if max(depths) < _ONE_SIDE or len(y_side) < 2:
        return False
    # over the lower half of the side, which noise of single points does not turn
    lower = z_side >= 0.5 * (z_side.min() + z_side.max())
    across, down = float(np.ptp(y_side[lower])), float(np.ptp(z_side[lower]))
    return down > 0.0 and math.degrees(math.atan2(down, across)) > _STEEPEST_FLANGE


def _has_flange(profile: Profile) -> bool:
    """Whether a profile has the flange of a wheel."""
    try:
        height = measures.flange_height(profile.y, profile.z)
        measures.flange_thickness(profile.y, profile.z)
    except ProfileError:
        return False
    return bool(np.isfinite(height) and _FLANGE_HEIGHT[0] <= height <= _FLANGE_HEIGHT[1])


def side_of(given: ProfileInput) -> str:
    """Side given by the header of a file: "left", "right", or "" if it has none."""
    return _SIDES.get(given.key("Side").strip(" %.").lower(), "")


def axle_notes(right: ProfileInput, left: ProfileInput) -> tuple[str, ...]:
    """Contradictions between the sides of an axle and the headers of their files, and one file for both."""
    same = right.measured and left.measured and Path(right.given).resolve() == Path(left.given).resolve()
    one = (f"{right.given} is given for both wheels",) if same else ()
    return one + tuple(
        f"used as the {role} wheel, but the header of {each.given} says Side = {each.key('Side')[:_SHOWN]}"
        for role, each in (("right", right), ("left", left))
        if side_of(each) not in ("", role)
    )


def comparison_notes(given: ProfileInput, reference: ProfileInput) -> tuple[str, ...]:
    """One sentence with all keys that differ between the headers of two measurements of one wheel or rail."""
    differ = []
    for name in _SAME_WHEEL:
        here, there = (" ".join(each.key(name).split()) for each in (given, reference))
        if name == "Side" and side_of(given) and side_of(reference):
            here, there = side_of(given), side_of(reference)
        if here and there and here.lower() != there.lower():
            differ.append(f"{name} {here[:_SHOWN]!r} against {there[:_SHOWN]!r}")
    return (f"is it the same {given.kind}? The headers differ: {', '.join(differ)}",) if differ else ()


def header_notes(
    given: ProfileInput, values: Mapping[str, float], elsewhere: Collection[str] = ()
) -> tuple[str, ...]:
    """One sentence on gauge values of a wheel's header that contradict the measures [m] of its points.

    Measures of `elsewhere` were taken at other distances than the usual ones, which no header means.
    """
    differ = []
    for key, (name, most) in _HEADER_MEASURES.items():
        text = given.key(key).replace(",", ".")
        if name not in values or name in elsewhere or number_fault(text) is not None:
            continue
        header = 1e-3 * float(text)
        # instruments write 0 for what they did not measure
        if header > 0.0 and abs(header - values[name]) > most:
            differ.append((key, f"{1e3 * header:g}", f"{1e3 * values[name]:.2f}"))
    if not differ:
        return ()
    keys, stated, measured = (", ".join(words) for words in zip(*differ, strict=True))
    return (
        f"the header says {keys} = {stated} mm, the points give {measured} mm: it is old, of another wheel "
        "or taken at other distances",
    )


def hollowing_notes(given: ProfileInput, values: Mapping[str, float]) -> tuple[str, ...]:
    """Warning on a hollowing, among the measures [m] of a wheel, that is noise for a good part."""
    whole = values.get("hollowing", 0.0)
    if whole <= _MOST_NOISE or not given.measured:
        return ()
    try:
        profile = smoothed(given.profile, _NOISE_WAVELENGTH)
        rest = measures.hollowing(profile.y, profile.z)
    except ProfileError:
        return ()  # points too few to see short waves
    if whole - rest <= _MOST_NOISE:
        return ()
    wavelength = f"{1e3 * _NOISE_WAVELENGTH:g}"
    return (
        f"of {1e3 * whole:.3f} mm hollowing {1e3 * rest:.3f} mm are left without waves shorter than "
        f"{wavelength} mm: noise or dents (--smooth-mm {wavelength} takes them out)",
    )
