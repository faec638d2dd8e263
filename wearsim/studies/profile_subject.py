"""What a user names - a standard shape, a definition or a measured file - as a profile with its story."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from wearsim.errors import Fault, ProfileError
from wearsim.profile import measures, standard
from wearsim.profile.definition import Definition
from wearsim.profile.files import ProfileReading, read_profile
from wearsim.profile.formats import FORMATS
from wearsim.profile.formats.axes import IN_CM
from wearsim.profile.placement import UPRIGHT, place_rail, tilt_to_add
from wearsim.profile.shape import Profile

Kind = Literal["wheel", "rail"]

INCLINATION = 1.0 / 40.0
"""Of an upright rail, if nothing else is stated [-]."""

TAPE = 70e-3
"""Distance of the tape circle from the flange back, if nothing else is told [m]."""

SPACING = 0.25e-3
"""Point distance of standard shapes [m]."""

_WRITTEN = re.compile(r"\s*[#!]\s*(wheel|rail) profile\b")
_FLANGE_HEIGHT = (20e-3, 45e-3)  # what tells a wheel from a rail head of the same size [m]
_WIDEST_HEAD = 0.1  # wider points without a flange might be a tread [m]
_HIGHEST_HEAD = 0.06  # higher points may be a wheel with its columns swapped [m]
_BOTH_SIDES = 8e-3  # a head falls off by this on both sides of its top [m]
_ONE_SIDE = 10e-3  # or by this on one side, and steeper there than a flange [m]
_STEEPEST_FLANGE = 78.0  # degrees
_HEADER_LINES = 5  # lines looked at for a word on the kind
_MOST_SHOWN = 90  # characters
_NUMBER = re.compile(r"\d{2,4}(\.\d+)?")
_DIAMETER_RANGE = (0.3, 1.5)  # plausible diameters of a header [m]


@dataclass(frozen=True)
class Subject:
    """A profile and how it came to be.

    Parameters
    ----------
    given : str
        What the user wrote.
    profile : Profile
        In our axes [m]; a rail is not yet placed in the track.
    format : str
        Key of `wearsim.profile.formats.FORMATS`, or "definition".
    title : str
        Format or designation, for people.
    notes : tuple of str
        What was detected, changed or left out.
    header : mapping of str to str
        Keys and values of a file, unchanged.
    source, certainty : str
        Where the shape comes from and how sure it is; no certainty is known of a file.
    upright : bool
        Whether it is a rail that stands upright, so that it needs an inclination in the track.
    lean : float or None
        Of a measured rail head, see `wearsim.profile.placement.head_lean` [-].
    header_tape : float or None
        Distance of the tape circle from the flange back that the header told and that acted [m].
    """

    given: str
    profile: Profile
    format: str
    title: str
    notes: tuple[str, ...]
    header: Mapping[str, str] = field(repr=False)
    source: str
    certainty: str
    upright: bool = False
    lean: float | None = None
    header_tape: float | None = None

    @property
    def kind(self) -> Kind:
        """Wheel or rail."""
        return self.profile.kind

    @property
    def measured(self) -> bool:
        """Whether the points come from a file, not from a definition."""
        return self.format != "definition"

    def key(self, *names: str) -> str:
        """Value of the first of these header keys that says something, in any case of letters."""
        lower = {name.lower(): value.strip() for name, value in self.header.items()}
        return next((lower[name.lower()] for name in names if lower.get(name.lower())), "")

    @property
    def tape(self) -> float:
        """Distance of the tape circle, y = 0, from the flange back: that of the header, else `TAPE` [m]."""
        return TAPE if self.header_tape is None else self.header_tape

    @property
    def diameter(self) -> float | None:
        """Wheel diameter at the tape circle that the instrument wrote down [m]."""
        text = self.key("DiameterTaperline").replace(",", ".")
        if self.kind != "wheel" or not _NUMBER.fullmatch(text):
            return None
        value = 1e-3 * float(text)
        return value if _DIAMETER_RANGE[0] <= value <= _DIAMETER_RANGE[1] else None


def is_file(given: str) -> bool:
    """Tell whether a text is taken for a path, by the rule of `load_profile`."""
    path = Path(given)
    return path.is_file() or (
        not standard.is_designation(given) and (bool(path.suffix) or len(path.parts) != 1)
    )


def read_subject(
    given: str, kind: Kind | None = None, said: Mapping[str, Any] | None = None, *, spacing: float = SPACING
) -> Subject:
    """Profile by the name of a standard shape, from a definition (`.toml`) or from a measured file.

    Parameters
    ----------
    given : str
        Name, designation such as "S1002/h30", or path.
    kind : {"wheel", "rail"}, optional
        What it is; told by the definition, the extension or the content of a file.
    said : mapping, optional
        Statements on a file, as arguments of `read_profile`.
    spacing : float
        Point distance of a standard shape [m].

    Returns
    -------
    Subject
        A rail is upright if it comes from a definition, and as it was measured if it comes from a file,
        upright or not.

    Raises
    ------
    ProfileError
        One line per fault.
    """
    said = {} if said is None else said
    if Path(given).is_dir():
        raise ProfileError(f"{given}: is a folder; measure all its files with --fleet {given}")
    if is_file(given):
        path = Path(given)
        if path.suffix.lower() == ".toml" and path.is_file():
            return _defined(given, _definition_of_file(path), kind, spacing)
        return _from_file(given, kind, said)
    return _defined(given, _named(given, kind), kind, spacing)


def tilt_of(rail: Subject, inclination: float | None) -> float:
    """Tilt that brings a rail into the track.

    Parameters
    ----------
    rail : Subject
        Standard or measured.
    inclination : float or None
        As stated; None: `INCLINATION` for a rail that stands upright, else 0, for measured points stand as
        they were measured.

    Returns
    -------
    float
        Towards the track centre [-]; 0 for a head that leans already.
    """
    if inclination is None:
        return INCLINATION if rail.upright else 0.0
    return tilt_to_add(rail.lean, inclination)


def told_stand(rail: Subject, inclination: float | None) -> tuple[str, ...]:
    """Tell how a measured rail is put into the track.

    Parameters
    ----------
    rail : Subject
        Any profile.
    inclination : float or None
        As stated [-].

    Returns
    -------
    tuple of str
        One sentence; none on wheels and standard shapes.
    """
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
    way = "" if inclination is not None else "; if it was measured upright, state --inclination 1:40"
    return (f"in the track as measured{way}",)


def placed(subject: Subject, inclination: float | None, gauge: float, half_span: float) -> Profile:
    """Rail profile in the track.

    Parameters
    ----------
    subject : Subject
        A rail.
    inclination : float or None
        Of the rail, see `tilt_of` [-].
    gauge, half_span : float
        See `wearsim.profile.placement.place_rail` [m].
    """
    tilt = tilt_of(subject, inclination)
    if not subject.measured and not is_file(subject.given):
        return standard.rail(subject.given, tilt, gauge, half_span)
    try:
        profile = place_rail(subject.profile, tilt, gauge, half_span)
    except ProfileError as error:
        raise ProfileError(str(Fault(str(error), subject.given))) from error
    return replace(profile, source=subject.profile.source)


def _named(given: str, kind: Kind | None) -> Definition:
    """Definition of a shipped shape; without a kind, of whichever it is."""
    if kind is not None:
        return standard.definition(given, kind)
    names = {each: standard.shipped_names(each) for each in ("wheel", "rail")}
    if standard.is_designation(given):
        parts = [part.strip() for part in given.split("/")]
        bases = {"/".join(parts[:count]) for count in range(1, len(parts) + 1)}
        return standard.definition(given, "rail" if bases & set(names["rail"]) else "wheel")
    known = {name.lower(): name for each in names.values() for name in each}
    near = difflib.get_close_matches(given.lower(), list(known), n=1, cutoff=0.5)
    hint = f"; did you mean {known[near[0]]!r}?" if near else ""
    listed = "; ".join(f"{each}s: {', '.join(each_names)}" for each, each_names in names.items())
    raise ProfileError(f"{given!r} is neither a file nor a shipped profile ({listed}){hint}")


def _definition_of_file(path: Path) -> Definition:
    """Definition in a file of the user."""
    from wearsim.profile.definition_file import read_definition

    return read_definition(path)


def _defined(given: str, shape: Definition, kind: Kind | None, spacing: float) -> Subject:
    """Subject of a definition."""
    if kind is not None and shape.kind != kind:
        raise ProfileError(f"{given}: is a {shape.kind} profile, a {kind} is needed")
    y, z = standard.sample(shape, spacing)
    profile = Profile(shape.name, shape.kind, y, z, shape.source)
    upright = shape.kind == "rail" and shape.inclined_gauge_y is None
    notes: tuple[str, ...] = (f"points every {spacing * 1e3:g} mm",)
    if shape.kind == "rail":
        notes += ("upright, y from the symmetry axis" if upright else "as it stands in the track",)
    return Subject(
        given, profile, "definition", shape.title, notes, {}, shape.source, shape.certainty, upright
    )


def _from_file(given: str, kind: Kind | None, said: Mapping[str, Any]) -> Subject:
    """Subject of a measured file."""
    path = Path(given)
    notes: tuple[str, ...] = ()
    told = kind
    if told is None:
        told, notes = _told_kind(path)
    if told is None:
        reading, notes = _either(path, said)
    else:
        reading = read_profile(path, told, **said)
    subject = Subject(
        given,
        reading.profile,
        reading.format,
        FORMATS[reading.format].title,
        (*notes, *reading.notes[1:]),
        reading.header,
        f"file {path.name}",
        "",
        reading.lean is not None and abs(reading.lean) <= UPRIGHT,
        reading.lean,
        reading.tape,
    )
    if subject.diameter is None:
        return subject
    note = f"wheel diameter {1e3 * subject.diameter:g} mm of the header taken, if no other is stated"
    return replace(subject, notes=(*subject.notes, note))


def _told_kind(path: Path) -> tuple[Kind | None, tuple[str, ...]]:
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
            return "wheel" if match[1] == "wheel" else "rail", (f"a {match[1]}, told by its first comment",)
    return None, ()


def _either(path: Path, said: Mapping[str, Any]) -> tuple[ProfileReading, tuple[str, ...]]:
    """Read a file that says nothing on its kind: by its content, or a question to the user."""
    readings: dict[Kind, ProfileReading] = {}
    errors: dict[Kind, str] = {}
    kinds: tuple[Kind, Kind] = ("wheel", "rail")
    for kind in kinds:
        try:
            readings[kind] = read_profile(path, kind, **said)
        except ProfileError as error:
            errors[kind] = str(error)
            continue
        if kind == "wheel" and _has_flange(readings[kind].profile):
            return readings[kind], ("a wheel, told by its flange",)
    if len(errors) == 2:
        if errors["wheel"] == errors["rail"]:
            raise ProfileError(errors["wheel"])
        both = [line for line in errors["wheel"].splitlines() if line in errors["rail"].splitlines()]
        if both:
            raise ProfileError("\n".join(both))
        why = {kind: _short(text.splitlines()[0].removeprefix(f"{path}:")) for kind, text in errors.items()}
        sized = [kind for kind, text in errors.items() if IN_CM in text]
        hint = f"; if it is a {' or '.join(sized)} in cm, state --units cm" if sized else ""
        raise ProfileError(
            f"{path}: neither a wheel ({why['wheel']}) nor a rail ({why['rail']}): check units and order of "
            f"the columns, or see all faults with --kind wheel or --kind rail{hint}"
        )
    if "wheel" in readings and "rail" not in readings:
        return readings["wheel"], ("a wheel, for it is no rail",)
    if "wheel" not in readings and _has_head(readings["rail"].profile):
        return readings["rail"], ("a rail, told by the shape of its head",)
    raise ProfileError(
        f"{path}: has neither the flange of a wheel nor crown and sides of a rail head; state --kind wheel "
        "or --kind rail, or check that the columns y and z are not swapped"
    )


def _short(fault: str) -> str:
    """Beginning of a fault, for a message that holds two."""
    first = re.split(r"; |: | \(|, so |, which ", fault.strip(), maxsplit=1)[0]
    return first if len(first) <= _MOST_SHOWN else f"{first[: _MOST_SHOWN - 3]}..."


def _has_head(profile: Profile) -> bool:
    """Tell whether a profile has the crown and the sides of a rail head."""
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
    """Tell whether a profile has the flange of a wheel."""
    try:
        height = measures.flange_height(profile.y, profile.z)
        measures.flange_thickness(profile.y, profile.z)
    except ProfileError:
        return False
    return bool(np.isfinite(height) and _FLANGE_HEIGHT[0] <= height <= _FLANGE_HEIGHT[1])
