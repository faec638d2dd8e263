"""Profiles in two-column text files."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, replace
from decimal import Decimal
from itertools import pairwise
from pathlib import Path
from typing import Literal

import numpy as np

from wearsim.errors import Fault, ProfileError
from wearsim.profile import standard
from wearsim.profile.checks import points_faults
from wearsim.profile.placement import place_rail
from wearsim.profile.shape import Profile

MAX_BYTES = 20_000_000
_MOST_FAULTS = 20  # lines of one message; a wrong separator would fault every line of a long file
_EXPONENT = {"mm": -3, "m": 0}
_COMMENT = re.compile(r"[#!%].*")
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]{1,3})?")
_NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity|1\.#\w*)", re.IGNORECASE)


@dataclass(frozen=True)
class _Row:
    """Two numbers as they stand in a line of the file."""

    line: int
    y: float
    z: float


def read_two_column(path: str | Path, kind: Literal["wheel", "rail"], units: str = "mm") -> Profile:
    """Read a profile from a text file with two columns, y and z.

    Parameters
    ----------
    path : str or Path
        UTF-8 text of at most 20 MB. Columns are separated by semicolon, tab, blanks or comma; the
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
    if units not in _EXPONENT:
        raise ProfileError(f"{path}: units = {units!r} is not one of 'mm', 'm'")
    rows = _distinct(_rows(path, _text(path), _EXPONENT[units]))
    y = np.array([row.y for row in rows])
    z = np.array([row.z for row in rows])
    faults = points_faults(kind, y, z)
    if faults:
        other = "m" if units == "mm" else "mm"
        _refuse(
            path,
            [
                (
                    message.replace(
                        "state the right units",
                        f"points are read as {units}: convert them if they are in {other}",
                    ),
                    None if point is None else rows[point].line,
                )
                for message, point in faults
            ],
        )
    if y[0] > y[-1]:
        y, z = y[::-1].copy(), z[::-1].copy()
    return Profile(path.stem, kind, y, z, f"file {path.name}")


def _refuse(path: Path, faults: list[tuple[str, int | None]]) -> None:
    """Raise all faults of a file, the first of them only if there are very many."""
    lines = [str(Fault(message, str(path), line)) for message, line in faults[:_MOST_FAULTS]]
    if len(faults) > _MOST_FAULTS:
        lines.append(f"{path}: {len(faults) - _MOST_FAULTS} more faults of this file are not shown")
    raise ProfileError("\n".join(lines))


def _text(path: Path) -> str:
    """Content of the file."""
    try:
        if not path.is_file():
            what = "is a folder, not a file" if path.is_dir() else "does not exist"
            raise ProfileError(f"{path}: {what}; give the path of a two-column text file")
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise ProfileError(
            f"{path}: cannot be read ({error.strerror}); check the path and its permissions"
        ) from error
    if len(data) > MAX_BYTES:
        raise ProfileError(
            f"{path}: larger than {MAX_BYTES // 10**6} MB, hardly one profile; give one cross-section"
        )
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise ProfileError(
            str(Fault("is not UTF-8 text; save the file as UTF-8", str(path), line))
        ) from error
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise ProfileError(
            str(Fault("holds zero bytes, so it is not UTF-8 text; save it as UTF-8", str(path), line))
        )
    return text


def _rows(path: Path, text: str, exponent: int) -> list[_Row]:
    """Numbers of all lines [m]; all faults at once."""
    rows: list[_Row] = []
    faults: list[tuple[str, int | None]] = []
    separator: str | None = None
    header_seen = False
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    for number, raw in enumerate(lines, start=1):
        line = _COMMENT.sub("", raw).strip()
        if not line:
            continue
        if separator is None:
            if not header_seen and _is_header(line):
                header_seen = True
                continue
            separator = _separator(line)
        cells = _split(line, separator)
        if len(cells) != 2:
            named = {"": "blanks", "\t": "tabs", ",": "commas", ";": "semicolons"}[separator]
            faults.append((f"{len(cells)} columns separated by {named}, two are needed: y and z", number))
            continue
        values = []
        for axis, cell in zip("yz", cells, strict=True):
            value = _number(cell, separator, exponent)
            if isinstance(value, str):
                faults.append((f"{axis} = {cell[:40]!r} {value}", number))
            else:
                values.append(value)
        if len(values) == 2:
            rows.append(_Row(number, *values))
    if faults:
        _refuse(path, faults)
    return rows


def _is_header(line: str) -> bool:
    """Tell whether no cell of the line begins like a number."""
    cells = re.split(r"[;,\t ]+", line.strip(";, \t"))
    return not any(re.match(r"[+-]?\.?\d", cell) or _NOT_FINITE.fullmatch(cell) for cell in cells)


def _separator(line: str) -> str:
    """Separator of the columns, told from the first line of numbers; "" means blanks."""
    for mark in (";", "\t"):
        if mark in line:
            return mark
    cells = line.split()
    # "12,5 3,1" has decimal commas, "12.5, 3.1" a comma between the columns
    if len(cells) == 2 and not cells[0].endswith(",") and not cells[1].startswith(","):
        return ""
    return "," if "," in line else ""


def _split(line: str, separator: str) -> list[str]:
    """Cells of a line."""
    if separator == "":
        return line.split()
    cells = [cell.strip() for cell in line.split(separator)]
    if separator == "\t":  # several tabs are used to align columns
        cells = [cell for cell in cells if cell]
    return cells


def _number(cell: str, separator: str, exponent: int) -> float | str:
    """Value in metres, or what is wrong with it."""
    plain = cell if separator == "," else cell.replace(",", ".")
    if _NUMBER.fullmatch(plain):
        value = float(Decimal(plain).scaleb(exponent))
        # 1 km is beyond any profile in any unit; the bound keeps sums and products of points finite
        return value if abs(value) <= 1e3 else "is too large for a profile; check units and columns"
    if _NOT_FINITE.fullmatch(plain):
        return "is not a finite number; delete the line or repeat the measurement"
    return "is not a number" if cell else "is missing"


def _distinct(rows: list[_Row]) -> list[_Row]:
    """Leave out points equal to the one before them (instruments at rest)."""
    return rows[:1] + [row for before, row in pairwise(rows) if (row.y, row.z) != (before.y, before.z)]


def write_two_column(profile: Profile, path: str | Path, *, overwrite: bool = False) -> None:
    """Write a profile as comma-separated text in mm.

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

    Notes
    -----
    The shortest decimals that stand for the stored metres, moved by three places: `read_two_column`
    returns the same bits.
    """
    path = Path(path)
    if not (np.all(np.isfinite(profile.y)) and np.all(np.isfinite(profile.z))):
        raise ProfileError(
            f"{path}: profile {profile.name!r} holds points that are not finite; nothing was written"
        )
    if path.exists() and not overwrite:
        raise ProfileError(f"{path}: exists already; choose another name or allow overwriting")
    axes = "z radially outward" if profile.kind == "wheel" else "z down"
    about = " ".join(
        f"{profile.kind} profile {profile.name}; y to the field side, {axes}; {profile.source}".split()
    )
    lines = [f"# {about}", "y_mm,z_mm"]
    lines.extend(f"{_millimetres(y)},{_millimetres(z)}" for y, z in zip(profile.y, profile.z, strict=True))
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.write_text("\n".join(lines) + "\n", encoding="utf-8")
        part.replace(path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise ProfileError(f"{path}: cannot be written ({error.strerror}); choose another folder") from error


def _millimetres(metres: float) -> str:
    """Exact decimal of the shortest representation, times 1000."""
    return f"{Decimal(repr(float(metres))).scaleb(3):f}"


def load_profile(
    name_or_path: str | Path,
    kind: Literal["wheel", "rail"],
    *,
    units: str = "mm",
    inclination: float = 0.0,
    gauge: float = 1.435,
    half_span: float = 0.750,
    spacing: float = 0.25e-3,
) -> Profile:
    """Profile by the name of a standard shape or from a file.

    Parameters
    ----------
    name_or_path : str or Path
        An existing file or anything that looks like a path (with a folder or an extension) is read as
        a two-column file; the rest is the name of a shipped shape.
    kind : {"wheel", "rail"}
        What it is used as.
    units : {"mm", "m"}
        Of a file.
    inclination : float
        Tilt of a rail towards the track centre, also of one from a file (0: its points are inclined
        already, or it stands upright) [-].
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
    if path.is_file() or path.suffix or len(path.parts) != 1:
        profile = read_two_column(path, kind, units)
        return profile if kind == "wheel" else _placed(profile, path, inclination, gauge, half_span)
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
