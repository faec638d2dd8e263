"""Profiles named by a user: standard shape, definition or measured file.

Warnings concern the input: headers that contradict the points, hollowing by noise.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from wearsim.errors import ProfileError
from wearsim.profile import measures, standard
from wearsim.profile.files import (
    FORMATS,
    ProfileReading,
    is_file,
    place_file,
    read_profile,
)
from wearsim.profile.files.points import number_fault, read_text, value_of
from wearsim.profile.placement import INCLINATION, UPRIGHT, tilt_to_add
from wearsim.profile.shape import Kind, Profile
from wearsim.profile.smoothing import smoothed
from wearsim.profile.standard import Definition, sample

_SPACING = 0.25e-3  # point distance of standard shapes [m]
_WRITTEN = re.compile(r"\s*[#!]\s*(wheel|rail) profile\b")
# shorter waves are not hollowing: a contact band is ten times as wide [m]
_NOISE_WAVELENGTH = 5e-3
# height of the hollowing due to such waves that needs no warning [m]
_MOST_NOISE = 50e-6
_HEADER_MEASURES = {
    "Sh": "flange_height",
    "Sd": "flange_thickness",
    "qR": "flange_gradient",
}
_HEADER_TOLERANCE = 0.5e-3  # smoothing in an instrument causes smaller differences [m]


@dataclass(frozen=True, kw_only=True)
class ProfileInput(ProfileReading):
    """Profile and its origin; a definition has the format "definition"."""

    given: str  # text given by the user
    title: str  # format or designation, for display
    source: str
    certainty: str = ""  # certainty of the source; unknown for a file

    @property
    def upright(self) -> bool:
        """True for a rail that needs an inclination in the track."""
        return self.lean is not None and abs(self.lean) <= UPRIGHT

    @property
    def kind(self) -> Kind:
        """Wheel or rail."""
        return self.profile.kind

    @property
    def measured(self) -> bool:
        """True if the points come from a file, not from a definition."""
        return self.format != "definition"

    def noted(self, *notes: str) -> ProfileInput:
        """Return the profile input with further notes."""
        return replace(self, notes=(*self.notes, *notes))


def read_input(
    given: str, kind: Kind | None = None, statements: Mapping[str, Any] | None = None
) -> ProfileInput:
    """Read a profile: name of a standard shape, definition (`.toml`) or measured file.

    Parameters
    ----------
    given : str
        Name, designation such as "S1002/h30", or path.
    kind : {"wheel", "rail"}, optional
        Kind of the profile; by default that of the definition or of the extension or
        first comment of a file.
    statements : mapping, optional
        On a file, as arguments of `read_profile`.

    Raises
    ------
    ProfileError
        One line per fault.
    """
    path = Path(given)
    if is_file(given) and path.is_dir():
        raise ProfileError(
            f"{given}: is a folder; measure all its files with --fleet {given}"
        )
    if not is_file(given):
        return _defined(given, standard.definition(given, kind))
    if path.suffix.lower() == ".toml" and path.is_file():
        shape = standard.read_definition(path)
        if kind not in (None, shape.kind):
            raise ProfileError(
                f"{given}: is a {shape.kind} profile, a {kind} is needed"
            )
        return _defined(given, shape)
    reading = read_profile(path, kind or _kind_of(path), **(statements or {}))
    notes = reading.notes[1:]
    if reading.diameter is not None:
        of = f"wheel diameter {1e3 * reading.diameter:g} mm of the header"
        notes += (f"{of} taken, if no other is stated",)
    title, source = FORMATS[reading.format].title, f"file {path.name}"
    return ProfileInput(
        **vars(reading) | {"notes": notes}, given=given, title=title, source=source
    )


def _defined(given: str, shape: Definition) -> ProfileInput:
    y, z = sample(shape, _SPACING)
    upright = shape.kind == "rail" and shape.inclined_gauge_y is None
    notes = [f"points every {_SPACING * 1e3:g} mm"]
    if shape.kind == "rail":
        notes.append(
            "upright, y from the symmetry axis"
            if upright
            else "as it stands in the track"
        )
    return ProfileInput(
        profile=Profile(shape.name, shape.kind, y, z, shape.source),
        format="definition",
        header={},
        notes=tuple(notes),
        lean=0.0 if upright else None,
        given=given,
        title=shape.title,
        source=shape.source,
        certainty=shape.certainty,
    )


def _kind_of(path: Path) -> Kind:
    """Kind of profile implied by the extension or the first comment of a file.

    The comment is that written by wearsim.
    """
    kinds = {
        kind
        for file_format in FORMATS.values()
        if (kind := file_format.suffixes.get(path.suffix.lower()))
    }
    if not kinds and (match := _WRITTEN.match(read_text(path).lines[0])):
        kinds = {match[1]}
    if not kinds:
        raise ProfileError(
            f"{path}: neither extension nor first line says what it is: state --kind "
            "wheel or rail"
        )
    return "wheel" if kinds == {"wheel"} else "rail"


def tilt_of(rail: ProfileInput, inclination: float | None) -> float:
    """Tilt [-] that inclines a rail in the track; 0 for a head already inclined.

    Without a stated inclination it is `INCLINATION` for an upright rail, else 0,
    because measured points keep their orientation.
    """
    if inclination is None:
        return INCLINATION if rail.upright else 0.0
    return tilt_to_add(rail.lean, inclination)


def placement_notes(rail: ProfileInput, inclination: float | None) -> tuple[str, ...]:
    """State how a measured rail is placed in the track at the stated inclination.

    Empty for other profiles.
    """
    if rail.kind == "wheel" or not rail.measured:
        return ()
    if tilt := tilt_of(rail, inclination):
        why = ", for it is upright (--inclination none leaves it)"
        if inclination is not None:
            already = (
                "" if rail.upright else "; state none for points that lean already"
            )
            why = f" by --inclination{already}"
        return (f"in the track inclined 1:{1.0 / tilt:.4g}{why}",)
    if rail.lean is not None and rail.lean > UPRIGHT:
        again = " and is not tilted again" if inclination else ""
        return (
            (
                f"in the track as measured: the head leans 1:{1.0 / rail.lean:.3g} "
                f"already{again}"
            ),
        )
    hint = (
        ""
        if inclination is not None
        else "; if it was measured upright, state --inclination 1:40"
    )
    return (f"in the track as measured{hint}",)


def placed(
    rail: ProfileInput, inclination: float | None, gauge: float, half_span: float
) -> Profile:
    """Rail profile placed in the track at an inclination, see `tilt_of`.

    The other arguments are those of `place_rail` [m].
    """
    tilt = tilt_of(rail, inclination)
    if rail.measured or is_file(rail.given):
        return place_file(rail.profile, rail.given, tilt, gauge, half_span)
    return standard.rail(rail.given, tilt, gauge, half_span)


def measure_notes(given: ProfileInput, values: Mapping[str, float]) -> tuple[str, ...]:
    """Warnings on measures [m] of a wheel.

    They name header values that contradict the measures, and hollowing due to noise.
    """
    notes = []
    for key, name in _HEADER_MEASURES.items():
        text = value_of(given.header, key).replace(",", ".")
        # Instruments write 0 for values that were not measured.
        header = 0.0 if number_fault(text) else 1e-3 * float(text)
        if (
            header > 0.0
            and name in values
            and abs(header - values[name]) > _HEADER_TOLERANCE
        ):
            notes.append(
                f"the header says {key} = {1e3 * header:g} mm, the points give "
                f"{1e3 * values[name]:.2f} mm: it is old, of another wheel or taken at "
                "other distances"
            )
    whole = values.get("hollowing", 0.0)
    try:
        profile = smoothed(
            given.profile,
            _NOISE_WAVELENGTH if given.measured and whole > _MOST_NOISE else 0.0,
        )
    except ProfileError:
        return tuple(notes)  # too few points to resolve short waves
    rest = measures.hollowing(profile.y, profile.z) if "hollowing" in values else 0.0
    if whole - rest > _MOST_NOISE:
        notes.append(
            f"of {1e3 * whole:.3f} mm hollowing {1e3 * rest:.3f} mm are left without "
            f"waves shorter than {1e3 * _NOISE_WAVELENGTH:g} mm: noise or dents "
            f"(--smooth-mm {1e3 * _NOISE_WAVELENGTH:g} takes them out)"
        )
    return tuple(notes)
