"""Profiles measured with MiniProf: `.whl`, `.ban` and multi-part `.mpt`."""

from __future__ import annotations

import re
from collections.abc import Iterable
from decimal import Decimal
from typing import Literal

from wearsim.profile.checks import MIN_POINTS
from wearsim.profile.formats.points import (
    COMMA_TWICE,
    Columns,
    Points,
    is_number,
    number_fault,
    separator_of,
    split_cells,
)
from wearsim.profile.formats.text import Faults, Text

SUFFIXES = {".whl": "wheel", ".ban": "rail"}
PART_SUFFIXES = {".mpt": ""}

# Key by which a file written here says whither X grows; other programs skip keys they do not know.
AXIS_KEY = "AxisX"
AXIS_FIELD = "field side"

_KNOWN_KEY = re.compile(
    r"^\s*(xypoints|columndef|mptypeno|mpserno|mpcaldate|programver|xoffset)\s*=",
    re.IGNORECASE | re.MULTILINE,
)
_KEY = re.compile(r"\s*[A-Za-z]\w*\s*=")
_LEAST_TAPE, _MOST_TAPE = 60.0, 80.0  # tape line from the flange back [mm]
_COLUMNS = {"x", "y", "a", "c", "k", "n"}
_OLD_STYLE = "(sd/sh/qr)"
# The word in a comment of another format tells only where its points come from.
_OLD_TITLE = re.compile(r"[^#!%=,;]*\bMINI[ _-]?PROF[^=]*$", re.IGNORECASE)
_SECTION = re.compile(r"\[(.+)\]")
_PART = re.compile(r"profile(\d+)(info|points)", re.IGNORECASE)
_ELEMENT = re.compile(r"mpd\d+", re.IGNORECASE)


def recognises(text: Text, suffix: str) -> bool:
    """Tell a MiniProf file by its header, or by its extension."""
    head = "\n".join(text.lines[:200])[:20_000]
    if any(_OLD_TITLE.match(line) for line in text.lines[:3]):
        return True
    return len({key.lower() for key in _KNOWN_KEY.findall(head)}) >= 2 or suffix in SUFFIXES


def recognises_parts(text: Text, suffix: str) -> bool:
    """Tell a multi-part file by its sections, or by its extension."""
    found = any(_PART.fullmatch(name) for line in text.lines[:50_000] if (name := _section(line)))
    return found or suffix in PART_SUFFIXES


def read(text: Text, kind: Literal["wheel", "rail"], faults: Faults) -> Points:
    """Points and header of a `.whl` or `.ban` file.

    Parameters
    ----------
    text : Text
        Header of ``key=value`` lines (or of the old style), an empty line that may be missing, points.
    kind : {"wheel", "rail"}
        Settles which way Y should grow.
    faults : Faults
        Takes what is wrong.

    Returns
    -------
    Points
        X is counted from the flange back on wheels.
    """
    numbered = list(enumerate(text.lines, start=1))
    first = _first_point(text)
    header = _header(line for _, line in numbered[: first - 1])
    return _points(numbered[first - 1 :], header, kind, faults)


def read_part(
    text: Text, kind: Literal["wheel", "rail"], faults: Faults, part: int | str | None
) -> Points | None:
    """Points and header of one curve of a multi-part file.

    Parameters
    ----------
    text : Text
        Sections `[ProfilekInfo]` and `[ProfilekPoints]`.
    kind : {"wheel", "rail"}
        Settles which way Y should grow.
    faults : Faults
        Takes what is wrong.
    part : int, str or None
        Number or name of the curve; needed if there are several.

    Returns
    -------
    Points or None
        None if no curve can be chosen; the fault says why.
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
            key, found, value = line.partition("=")
            # the elements a curve was drawn from are as many as its points and not needed here
            if found and not _ELEMENT.fullmatch(key.strip()):
                info.setdefault(where, {})[key.strip()] = value.strip()
    chosen = _choose(rows, {k: _value(keys, "mpdn") or "" for k, keys in info.items()}, part, faults)
    if chosen is None:
        return None
    return _points(rows[chosen], {**info[0], **info.get(chosen, {})}, kind, faults)


def _choose(
    rows: dict[int, list[tuple[int, str]]], names: dict[int, str], part: int | str | None, faults: Faults
) -> int | None:
    """Return the number of the wanted curve."""
    known = ", ".join(f"{k} {names.get(k, '')!r}" for k in sorted(rows)[:30])
    if not rows:
        faults.add("holds no [Profile1Points] section; give a multi-part file of MiniProf with points")
        return None
    if part is None:
        if len(rows) == 1:
            return next(iter(rows))
        faults.add(f"holds {len(rows)} curves ({known}), which are never joined; choose one with --part")
        return None
    wanted = str(part).strip()
    for k in rows:
        if wanted in (str(k), names.get(k, "")):
            return k
    faults.add(f"--part {wanted} is not among its curves ({known})")
    return None


def _section(line: str) -> str | None:
    """Name of a section, None on other lines."""
    match = _SECTION.fullmatch(line.strip()) if line.lstrip()[:1] == "[" else None
    return match[1].strip() if match else None


def _first_point(text: Text) -> int:
    """Line of the first point: numbers only and no `=`; behind the measures of the old style."""
    start = 0
    for k, line in enumerate(text.lines[:1000]):
        if _OLD_STYLE in line.lower():
            start = k + 1
            break
    for k in range(start, len(text.lines)):
        if _is_data(text.lines[k]):
            return k + 1
    return len(text.lines) + 1


def _is_data(line: str) -> bool:
    """Tell whether a line holds two numbers or more and nothing else."""
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
        key, found, value = line.partition("=")
        if found:
            header[key.strip()] = value.strip()
        elif line:
            free += 1
            header[f"line {free}"] = line
    return header


def _value(header: dict[str, str], key: str) -> str | None:
    """Value of a key in any case of letters."""
    for name, value in header.items():
        if name.lower() == key:
            return value
    return None


def _points(
    numbered: list[tuple[int, str]], header: dict[str, str], kind: Literal["wheel", "rail"], faults: Faults
) -> Points:
    """Points of the lines behind a header."""
    notes: list[str] = []
    column_x, column_y, names = _column_definition(header, faults, notes)
    joined = cut = False
    needed = max(column_x, column_y) + 1
    found, off, short = Columns(faults), 0, 0
    separator: str | None = None
    last = next((number for number, raw in reversed(numbered) if raw.strip()), 0)
    for number, raw in numbered:
        line = _bare(raw)
        if not line:
            off += raw.lstrip()[:1] == '"' and _is_data(raw.lstrip()[1:])
            continue
        if len(found.lines) >= MIN_POINTS and _begins_a_file(raw):
            faults.add("a header after the points: two files are joined here; give one", number)
            joined = True
            break
        if separator is None:
            separator = separator_of(line)
        cells = split_cells(line, separator)
        if separator == "," and names and len(cells) == 2 * len(names):
            faults.add(COMMA_TWICE, number)
            short += 1
            continue
        if len(cells) < needed and number == last and len(found.lines) >= MIN_POINTS:
            cut = True  # in the middle of a line
            short += 1
            continue
        if len(cells) < needed:
            columns = f"{len(cells)} column{'' if len(cells) == 1 else 's'}"
            faults.add(f"{columns}, {needed} are needed to find X and Y", number)
            short += 1
            continue
        found.add(number, cells[column_x], cells[column_y], separator, "XY")
    before = len(faults.found)
    if not joined:
        _check_count(header, len(found.lines), off, short + found.refused, last, faults, notes)
    if cut and len(faults.found) == before:
        faults.add("ends in the middle of a line: the file is cut off; copy it again", last)
    if off:
        notes.append(f"{off} switched-off points left out")
    for key in ("xoffset", "yoffset"):
        value = _value(header, key)
        if value and number_fault(value) is None and float(value) != 0.0:
            notes.append(f"{key} = {value} of the header is not added to the points")
    axis = _value(header, AXIS_KEY.lower())
    return Points(
        found.lines,
        found.y,
        found.z,
        y_axis="field" if axis == AXIS_FIELD else "unknown",
        z_axis="down" if kind == "wheel" else "up",
        tape=_tape(header, notes) if kind == "wheel" else None,
        header=header,
        notes=tuple(notes),
    )


def _begins_a_file(line: str) -> bool:
    """Tell the first line of a header."""
    return _KEY.match(line) is not None or ("=" not in line and "MINIPROF" in line.upper())


def _column_definition(
    header: dict[str, str], faults: Faults, notes: list[str]
) -> tuple[int, int, list[str]]:
    """Columns of X and Y, and the names of all if there are any."""
    definition = _value(header, "columndef")
    if not definition:
        return 0, 1, []
    names = [name for name in re.split(r"[,;\s]+", definition.lower()) if name]
    if "x" not in names or "y" not in names:
        faults.add(f"ColumnDef = {definition[:40]!r} does not name X and Y")
        return 0, 1, []
    unknown = sorted(set(names) - _COLUMNS)
    if unknown:
        notes.append(f"columns {', '.join(unknown)[:60]} of ColumnDef are not known and left out")
    return names.index("x"), names.index("y"), names


def _check_count(
    header: dict[str, str], found: int, off: int, short: int, last: int, faults: Faults, notes: list[str]
) -> None:
    """Compare the points with the number promised by the header."""
    promised = _value(header, "xypoints")
    if not promised or not re.fullmatch(r"\d{1,9}", promised):
        return
    there = found + off + short
    if there < int(promised):
        faults.add(
            f"XYPoints = {promised}, but {there} points are there: the file is cut off; copy it again, or "
            "correct XYPoints if points were taken out on purpose",
            last,
        )
    elif found > int(promised):
        notes.append(f"XYPoints = {promised}, but {found} points are there: all are taken")


def _tape(header: dict[str, str], notes: list[str]) -> Decimal | None:
    """Distance of the tape line from the flange back, if the header tells a plausible one [mm]."""
    value = (_value(header, "wheeldiametertaperline") or "").replace(",", ".")
    if number_fault(value) is None:
        if _LEAST_TAPE <= float(value) <= _MOST_TAPE:
            return Decimal(value)
        if float(value) == 0.0:
            return None  # not set
    if value.strip("-?"):
        notes.append(
            f"WheelDiameterTaperline = {value[:40]} of the header is not within {_LEAST_TAPE:g} .. "
            f"{_MOST_TAPE:g} mm and not used: state --tape-mm, and --origin if y does not count from the "
            "flange back"
        )
    return None
