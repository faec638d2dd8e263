"""Profiles measured with MiniProf: `.whl`, `.ban` and multi-part `.mpt`."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from decimal import Decimal
from typing import Literal

from wearsim.errors import brief
from wearsim.profile.files.points import (
    Columns,
    Faults,
    Points,
    Text,
    is_number,
    number_fault,
    separator_of,
    split_cells,
)
from wearsim.profile.shape import Kind

SUFFIXES = {".whl": "wheel", ".ban": "rail"}


AXIS_KEY = "AxisX"
"""Key by which a file written here gives the direction of X; other programs skip keys they do not know."""
AXIS_FIELD = "field side"

_KNOWN_KEY = re.compile(
    r"^\s*(xypoints|columndef|mptypeno|mpserno|mpcaldate|programver|xoffset)\s*=",
    re.IGNORECASE | re.MULTILINE,
)
_LEAST_CIRCLE, _MOST_CIRCLE = 60.0, 80.0  # running circle from the flange back [mm]
_DIAMETER = re.compile(r"\d{3,4}([.,]\d+)?")
_LEAST_DIAMETER, _MOST_DIAMETER = 300.0, 1500.0  # [mm]
_OLD_STYLE = "(sd/sh/qr)"
# the word in a comment of another format says only where its points come from
_OLD_TITLE = re.compile(r"[^#!%=,;]*\bMINI[ _-]?PROF[^=]*$", re.IGNORECASE)
_SECTION = re.compile(r"\[(.+)\]")
_PART = re.compile(r"profile(\d+)(info|points)", re.IGNORECASE)
_ELEMENT = re.compile(r"mpd\d+", re.IGNORECASE)


def recognises(text: Text) -> bool:
    """Whether a file has the header of MiniProf."""
    if any(_OLD_TITLE.match(line) for line in text.lines[:3]):
        return True
    head = "\n".join(text.lines[:200])[:20_000]
    return len({key.lower() for key in _KNOWN_KEY.findall(head)}) >= 2


def recognises_parts(text: Text) -> bool:
    """Whether a file has the sections of a multi-part file."""
    return any(_PART.fullmatch(name) for line in text.lines[:50_000] if (name := _section(line)))


def read(text: Text, kind: Kind, faults: Faults) -> Points:
    """Points and header of a `.whl` or `.ban` file; X counts from the flange back on wheels.

    The header has ``key=value`` lines (or is of the old style); an empty line before points may be missing.
    """
    start = next((k + 1 for k, line in enumerate(text.lines[:1000]) if _OLD_STYLE in line.lower()), 0)
    first = next((k for k in range(start, len(text.lines)) if _is_data(text.lines[k])), len(text.lines))
    numbered = list(enumerate(text.lines, start=1))
    return _points(numbered[first:], _header(line for _, line in numbered[:first]), kind, faults)


def wheel_diameter(header: Mapping[str, str]) -> float | None:
    """Wheel diameter at the running circle that a header states, if it is plausible [m]."""
    text = (_value(header, "diametertaperline") or "").strip()
    if not _DIAMETER.fullmatch(text):
        return None
    value = float(text.replace(",", "."))
    return 1e-3 * value if _LEAST_DIAMETER <= value <= _MOST_DIAMETER else None


def read_part(text: Text, kind: Kind, faults: Faults, part: int | str | None) -> Points | None:
    """Points and header of one curve of a multi-part file; None if no curve can be chosen.

    Sections are `[ProfilekInfo]` and `[ProfilekPoints]`; `part` is the number or name of the curve, needed
    if there are several.
    """
    info: dict[int, dict[str, str]] = {0: {}}  # 0: of the whole file
    rows: dict[int, list[tuple[int, str]]] = {}
    where, points = 0, False
    for number, line in enumerate(text.lines, start=1):
        name = _section(line)
        if name:
            match = _PART.fullmatch(name)
            where = int(match[1][:9]) if match else 0
            points = match is not None and match[2].lower() == "points"
            if points:
                rows.setdefault(where, [])
        elif points:
            rows[where].append((number, line))
        else:
            key, equals, value = line.partition("=")
            # the elements a curve was drawn from are as many as its points and not needed here
            if equals and not _ELEMENT.fullmatch(key.strip()):
                info.setdefault(where, {})[key.strip()] = value.strip()
    names = {k: _value(keys, "mpdn") or "" for k, keys in info.items()}
    known = ", ".join(f"{k} {brief(names.get(k, ''))!r}" for k in sorted(rows)[:30])
    chosen = next(iter(rows), None)
    if chosen is None:
        faults.add("holds no [Profile1Points] section; give a multi-part file of MiniProf with points")
        return None
    if part is None and len(rows) > 1:
        faults.add(f"holds {len(rows)} curves ({known}), which are never joined; choose one with --part")
        return None
    if part is not None:
        asked = str(part).strip()
        chosen = next((k for k in rows if asked in (str(k), names.get(k, ""))), None)
        if chosen is None:
            faults.add(f"--part {asked} is not among its curves ({known})")
            return None
    return _points(rows[chosen], {**info[0], **info.get(chosen, {})}, kind, faults)


def _section(line: str) -> str | None:
    """Name of a section, None on other lines."""
    match = _SECTION.fullmatch(line.strip()) if line.lstrip()[:1] == "[" else None
    return match[1].strip() if match else None


def _is_data(line: str) -> bool:
    """Whether a line holds two numbers or more and nothing else."""
    bare = _bare(line)
    if not bare or "=" in bare or not (bare[0].isdigit() or bare[0] in "+-."):
        return False
    cells = split_cells(bare, separator_of(bare))
    return len(cells) >= 2 and all(is_number(cell) for cell in cells)


def _bare(line: str) -> str:
    """Line of points without its comment."""
    return re.split(r'["!%#]', line, maxsplit=1)[0].strip()


def _header(lines: Iterable[str]) -> dict[str, str]:
    """Keys and values; a quotation mark ends the line, `%` and `!` belong to values."""
    header: dict[str, str] = {}
    free = 0
    for raw in lines:
        line = raw.split('"', 1)[0].strip()
        key, equals, value = line.partition("=")
        if equals:
            header[key.strip()] = value.strip()
        elif line:
            free += 1
            header[f"line {free}"] = line
    return header


def _value(header: Mapping[str, str], key: str) -> str | None:
    """Value of a key in any case of letters."""
    return next((value for name, value in header.items() if name.lower() == key), None)


def _points(numbered: list[tuple[int, str]], header: dict[str, str], kind: Kind, faults: Faults) -> Points:
    """Points of the lines behind a header."""
    notes: list[str] = []
    column_x, column_y = _column_definition(header, faults)
    needed = max(column_x, column_y) + 1
    points, off = Columns(faults), 0
    last = next((number for number, raw in reversed(numbered) if raw.strip()), 0)
    for number, raw in numbered:
        line = _bare(raw)
        if not line:
            off += raw.lstrip()[:1] == '"' and _is_data(raw.lstrip()[1:])
            continue
        cells = points.cells(line)
        if len(cells) >= needed:
            points.add(number, cells[column_x], cells[column_y], "XY")
            continue
        points.skipped += 1
        end = ": the file is cut off; copy it again" if number == last else ""
        faults.add(f"number of columns = {len(cells)} must be at least {needed} to hold X and Y{end}", number)
    there = len(points.lines) + off + points.skipped
    _check_count(_value(header, "xypoints") or "", len(points.lines), there, last, faults, notes)
    if off:
        notes.append(f"{off} switched-off points left out")
    for key in ("xoffset", "yoffset"):
        value = _value(header, key)
        if value and number_fault(value) is None and float(value) != 0.0:
            notes.append(f"{key} = {value} of the header is not added to the points")
    axes: tuple[Literal["field", "unknown"], Literal["down", "up"]] = (
        "field" if _value(header, AXIS_KEY.lower()) == AXIS_FIELD else "unknown",
        "down" if kind == "wheel" else "up",
    )
    circle = _running_circle(header, notes) if kind == "wheel" else None
    return Points(
        points.lines, points.y, points.z, *axes, running_circle=circle, header=header, notes=tuple(notes)
    )


def _column_definition(header: dict[str, str], faults: Faults) -> tuple[int, int]:
    """Columns of X and Y; others are not read."""
    definition = _value(header, "columndef") or "X,Y"
    names = [name for name in re.split(r"[,;\s]+", definition.lower()) if name]
    if "x" in names and "y" in names:
        return names.index("x"), names.index("y")
    faults.add(f"ColumnDef = {definition[:40]!r} does not name X and Y")
    return 0, 1


def _check_count(promised: str, taken: int, there: int, last: int, faults: Faults, notes: list[str]) -> None:
    """Compare the points with the number promised by the header."""
    if not re.fullmatch(r"\d{1,9}", promised):
        return
    if there < int(promised) and not faults.count:
        faults.add(
            f"XYPoints = {promised}, but {there} points are there: the file is cut off; copy it again, or "
            "correct XYPoints if points were taken out on purpose",
            last,
        )
    elif taken > int(promised):
        notes.append(f"XYPoints = {promised}, but {taken} points are there: all are taken")


def _running_circle(header: dict[str, str], notes: list[str]) -> Decimal | None:
    """Distance of the running circle from the flange back, if the header gives a plausible one [mm]."""
    value = (_value(header, "wheeldiametertaperline") or "").replace(",", ".")
    if number_fault(value) is None:
        if _LEAST_CIRCLE <= float(value) <= _MOST_CIRCLE:
            return Decimal(value)
        if float(value) == 0.0:
            return None  # not set
    if value.strip("-?"):
        notes.append(
            f"WheelDiameterTaperline = {value[:40]} of the header is not within {_LEAST_CIRCLE:g} .. "
            f"{_MOST_CIRCLE:g} mm and not used: state --running-circle-mm, and --origin if y does not count "
            "from the flange back"
        )
    return None
