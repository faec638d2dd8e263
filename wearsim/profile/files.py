"""Profiles from and to files, in any of the formats of `wearsim.profile.formats`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from decimal import Decimal
from pathlib import Path
from typing import Literal

from wearsim.errors import Fault, ProfileError
from wearsim.profile import standard
from wearsim.profile.checks import points_faults
from wearsim.profile.formats import FORMATS, Choice, format_of, suffix_kind, two_column, write
from wearsim.profile.formats.axes import UNITS, Said, to_our_axes
from wearsim.profile.formats.points import Elsewhere, Points, scaled
from wearsim.profile.formats.text import MAX_BYTES, Faults, read_text
from wearsim.profile.placement import head_lean, lean_words, place_rail, tilt_to_add
from wearsim.profile.shape import Profile

__all__ = [
    "MAX_BYTES",
    "ProfileReading",
    "load_profile",
    "read_profile",
    "read_two_column",
    "write_profile",
    "write_two_column",
]


@dataclass(frozen=True)
class ProfileReading:
    """A profile from a file and what was found out on reading it.

    Parameters
    ----------
    profile : Profile
        In our axes [m]; a rail is not yet placed in the track.
    format : str
        Key of `wearsim.profile.formats.FORMATS`.
    header : mapping of str to str
        Keys and values of the file, unchanged.
    notes : tuple of str
        What was detected, changed or left out.
    files : tuple of Path
        The files read: the one given, and that of the slice.
    lean : float or None
        Of a rail head towards the track centre, see `placement.head_lean` [-].
    tape : float or None
        Distance of the tape circle from the flange back, if the header told it and y counts from there [m].
    """

    profile: Profile
    format: str
    header: Mapping[str, str] = field(repr=False)
    notes: tuple[str, ...]
    files: tuple[Path, ...]
    lean: float | None = None
    tape: float | None = None


def read_profile(
    path: str | Path,
    kind: Literal["wheel", "rail"],
    *,
    format: str | None = None,
    units: str | None = None,
    mirror: bool | None = None,
    z_up: bool | None = None,
    origin: Literal["tape", "back"] | None = None,
    part: int | str | None = None,
    slice: int | None = None,
) -> ProfileReading:
    """Read a profile from a file of any known format.

    Parameters
    ----------
    path : str or Path
        Text of at most 20 MB and 10^6 points.
    kind : {"wheel", "rail"}
        What it is.
    format : str, optional
        Key of `wearsim.profile.formats.FORMATS`; told by content, then by extension.
    units : {"mm", "m", "cm", "in"}, optional
        Told by the file, then by the size (mm, m or in).
    mirror : bool, optional
        Whether y of the file (after its own keys) grows towards the flange or gauge side, that is the
        track centre. Told by the flange of a wheel; of a rail by the format, or by the only side that
        reaches 14 mm down.
    z_up : bool, optional
        Whether z of the file grows upwards, away from the tip of the flange or the foot of the rail.
        Told by the flange tip or by the top of the head.
    origin : {"tape", "back"}, optional
        Where y of a wheel is counted from; told by the place of the flange tip.
    part : int or str, optional
        Number or name of a curve in a multi-part file.
    slice : int, optional
        Number of a slice in a list of slices, from 1.

    Returns
    -------
    ProfileReading
        Points in our axes, in the order along the profile.

    Raises
    ------
    ProfileError
        One line per fault, ``file:line: message``; what cannot be told names the flag that settles it.
    """
    path = Path(path)
    _check_statement(path, "units", units, tuple(UNITS))
    _check_statement(path, "origin", origin, ("tape", "back"))
    said, choice = Said(units, mirror, z_up, origin), Choice(part, slice)
    notes: list[str] = []
    header: dict[str, str] = {}
    files = [path]
    for depth in (0, 1):
        text = read_text(files[-1])
        name = format_of(text, format)
        faults = Faults(files[-1])
        if suffix_kind(name, files[-1]) not in ("", kind):
            faults.add(f"{files[-1].suffix} is a {suffix_kind(name, files[-1])}, a {kind} profile is needed")
        found = FORMATS[name].read(text, kind, faults, choice)
        faults.refuse()
        notes += [f"format {FORMATS[name].title}", *text.notes]
        if isinstance(found, Points):
            break
        if found is None or depth == 1:
            faults.add("is a list of slices within a list of slices; give the list itself")
            faults.refuse()
        assert isinstance(found, Elsewhere)
        header, format, choice = dict(found.header), None, Choice(part)
        notes += found.notes
        files.append(_slice_file(path, found))
    assert isinstance(found, Points)
    ours = to_our_axes(found, kind, said, faults)
    y, z = ours.y, ours.z
    notes += [*found.notes, *ours.notes]
    lean = None if kind == "wheel" else head_lean(y, z)
    notes += [] if lean is None else [f"head {lean_words(lean)}"]
    profile = Profile(path.stem, kind, y, z, _source(path, name, notes))
    return ProfileReading(
        profile, name, {**header, **found.header}, tuple(notes), tuple(files), lean, ours.tape
    )


def _check_statement(path: Path, key: str, value: str | None, known: tuple[str, ...]) -> None:
    """Refuse a statement that is none."""
    if value is not None and value not in known:
        listed = ", ".join(repr(each) for each in known)
        raise ProfileError(f"{path}: {key} = {value!r} is not one of {listed}")


def _slice_file(path: Path, found: Elsewhere) -> Path:
    """File of a slice, beside the list."""
    file = path.parent / found.file.replace("\\", "/")
    if not file.is_file():
        message = f"slice file {found.file[:200]!r} does not exist beside the list; copy it there"
        raise ProfileError(str(Fault(message, str(path), found.line)))
    return file


def _source(path: Path, name: str, notes: list[str]) -> str:
    """Where the shape comes from, with what was done to it."""
    told = notes[1:] if name == "two-column" else notes
    return f"file {path.name} ({'; '.join(told)})" if told else f"file {path.name}"


def read_two_column(path: str | Path, kind: Literal["wheel", "rail"], units: str = "mm") -> Profile:
    """Read a profile in our axes from a text file with two columns, y and z; nothing is detected.

    Parameters
    ----------
    path : str or Path
        UTF-8 text of at most 20 MB. Columns are separated by semicolon, tabs, blanks or comma; the
        decimal mark may be a comma if the separator is not. `#`, `!` and `%` begin comments; one
        header line may precede the numbers.
    kind : {"wheel", "rail"}
        Which axes `z` follows, see `Profile`.
    units : {"mm", "m"}
        Of both columns.

    Returns
    -------
    Profile
        In metres, points in the order along the profile, beginning at the end with smaller y. A point
        equal to the one before it is left out. A rail is not yet placed in the track.

    Raises
    ------
    ProfileError
        One line per fault, ``file:line: message``.

    Notes
    -----
    Numbers are scaled to metres as decimals and then rounded once, so that a file written by
    `write_two_column` gives back the same bits.
    """
    path = Path(path)
    _check_statement(path, "units", units, ("mm", "m"))
    faults = Faults(path)
    found, _ = two_column.columns(read_text(path, utf8_only=True), faults)
    faults.refuse()
    y, z = (scaled(cells, Decimal(0), UNITS[units], Decimal(0)) for cells in (found.y, found.z))
    kept = [k for k in range(len(y)) if k == 0 or y[k] != y[k - 1] or z[k] != z[k - 1]]
    y, z = y[kept], z[kept]
    other = "m" if units == "mm" else "mm"
    way_out = f"points are read as {units}: convert them if they are in {other}"
    for message, point in points_faults(kind, y, z, way_out):
        faults.add(message, None if point is None else found.lines[kept[point]])
    faults.refuse()
    if y[0] > y[-1]:
        y, z = y[::-1].copy(), z[::-1].copy()
    return Profile(path.stem, kind, y, z, f"file {path.name}")


def write_profile(profile: Profile, path: str | Path, format: str, *, overwrite: bool = False) -> None:
    """Write a profile.

    Parameters
    ----------
    profile : Profile
        Any profile with finite points.
    path : str or Path
        File to write; it is complete or not there.
    format : {"two-column", "miniprof", "simpack"}
        MiniProf: `.whl` or `.ban`; SIMPACK: `.prw` or `.prr`.
    overwrite : bool
        Whether an existing file may be replaced.

    Raises
    ------
    ProfileError
        The format is not written, the extension is that of the other kind, the file exists or cannot be
        written, or a point is not finite.

    Notes
    -----
    The shortest decimals that stand for the stored metres, moved by exact decimal arithmetic:
    `read_profile` returns the same bits.
    """
    write.write(profile, Path(path), format, overwrite=overwrite)


def write_two_column(profile: Profile, path: str | Path, *, overwrite: bool = False) -> None:
    """Write a profile as comma-separated text in mm, see `write_profile`.

    Parameters
    ----------
    profile : Profile
        Any profile with finite points.
    path : str or Path
        File to write; it is complete or not there.
    overwrite : bool
        Whether an existing file may be replaced.

    Raises
    ------
    ProfileError
        The file exists, cannot be written, or a point is not finite.
    """
    write.write(profile, Path(path), "two-column", overwrite=overwrite)


def load_profile(
    name_or_path: str | Path,
    kind: Literal["wheel", "rail"],
    *,
    units: str | None = None,
    mirror: bool | None = None,
    z_up: bool | None = None,
    format: str | None = None,
    origin: Literal["tape", "back"] | None = None,
    part: int | str | None = None,
    slice: int | None = None,
    inclination: float = 0.0,
    gauge: float = 1.435,
    half_span: float = 0.750,
    spacing: float = 0.25e-3,
) -> Profile:
    """Profile by the name of a standard shape or from a file of any known format.

    Parameters
    ----------
    name_or_path : str or Path
        An existing file or anything that looks like a path (with a folder or an extension) is read with
        `read_profile`; the rest is the name or designation of a shipped shape, such as "S1002/h30".
    kind : {"wheel", "rail"}
        What it is used as.
    units, mirror, z_up, format, origin, part, slice
        Statements on a file, see `read_profile`.
    inclination : float
        Of a rail towards the track centre [-]. One from a file is tilted, too, unless its head is seen to
        lean already, see `placement.tilt_to_add` (0: it stands as measured).
    gauge, half_span : float
        Placement of a rail, see `place_rail` [m].
    spacing : float
        Point distance of a shipped shape [m]; points of a file are kept.

    Returns
    -------
    Profile
        A rail is placed in the track.
    """
    path = Path(name_or_path)
    named = standard.is_designation(str(name_or_path))
    if path.is_file() or (not named and (path.suffix or len(path.parts) != 1)):
        reading = read_profile(
            path,
            kind,
            format=format,
            units=units,
            mirror=mirror,
            z_up=z_up,
            origin=origin,
            part=part,
            slice=slice,
        )
        if kind == "wheel":
            return reading.profile
        tilt = tilt_to_add(reading.lean, inclination)
        return _placed(reading.profile, path, tilt, gauge, half_span)
    if kind == "wheel":
        return standard.wheel(str(name_or_path), spacing)
    return standard.rail(str(name_or_path), inclination, gauge, half_span, spacing)


def _placed(profile: Profile, path: Path, inclination: float, gauge: float, half_span: float) -> Profile:
    """Place a rail from a file; the faults name the file."""
    try:
        placed = place_rail(profile, inclination, gauge, half_span)
    except ProfileError as error:
        raise ProfileError(str(Fault(str(error), str(path)))) from error
    return replace(placed, source=profile.source)
