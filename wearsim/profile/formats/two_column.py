"""Two columns of numbers: plain text and CSV, GENSYS profiles, UIC 519 tables.

GENSYS axes after its manual pages `kpf` and `kpf_rot`; UIC 519 axes after published tables of the
reference profiles of EN 15302.
"""

from __future__ import annotations

import re
from typing import Literal

from wearsim.profile.formats.points import (
    COMMA_TWICE,
    Columns,
    Points,
    looks_like_number,
    separator_of,
    split_cells,
)
from wearsim.profile.formats.text import Faults, Text

_COMMENT = re.compile(r"[#!%].*")
_WHOLE = re.compile(r"[+-]?[0-9]+([eE][+-]?[0-9]+)?")
_NAMED = {"": "blanks", ",": "commas", ";": "semicolons"}

OWN_TABLES = {
    # beginning of the heading: what is written under it
    "arc_length_mm,y_mm,z_mm": "points or depths that wearsim profile --csv wrote",
    "file,wheel,kind,format": "the measures of many profiles that wearsim profile --fleet wrote",
}
"""Tables of this program that are no profiles."""

GENSYS_SUFFIXES = {".wheel": "wheel", ".rail": "rail", ".kpf_rotr": "rail"}
UIC_SUFFIXES = (".dat",)


def columns(text: Text, faults: Faults) -> tuple[Columns, str]:
    """Numbers of all lines and the header line.

    Parameters
    ----------
    text : Text
        `#`, `!` and `%` begin comments; one line without numbers may precede the points.
    faults : Faults
        Takes what is wrong.

    Returns
    -------
    found : Columns
        Cells and lines of the points.
    heading : str
        The header line, "" if there is none.
    """
    found = Columns(faults)
    separator: str | None = None
    heading = ""
    for number, raw in enumerate(text.lines, start=1):
        commented = "#" in raw or "!" in raw or "%" in raw  # faster than the search, for long files
        line = (_COMMENT.sub("", raw) if commented else raw).strip()
        if not line:
            continue
        if separator is None:
            if not heading and _is_heading(line):
                heading = line
                if own := next((what for start, what in OWN_TABLES.items() if line.startswith(start)), ""):
                    faults.add(f"a table of {own}, no profile; write one with --convert", number)
                    break
                continue
            separator = separator_of(line)
        cells = split_cells(line, separator)
        # asked in the order of their time, for long files
        if len(cells) == 2 and (looks_like_number(cells[0]) or not found.lines or not _is_heading(line)):
            found.add(number, cells[0], cells[1], separator)
        elif found.lines and (line == heading or (_is_heading(line) and _goes_on(text, number))):
            faults.add("a header line after points: two files are joined here; give one", number)
            break
        else:
            faults.add(_columns_fault(cells, separator, first=not found.lines), number)
    return found, heading


def _columns_fault(cells: list[str], separator: str, *, first: bool) -> str:
    """Tell what is wrong with a line that has not two columns."""
    if first and separator == "," and len(cells) in (3, 4) and all(_WHOLE.fullmatch(cell) for cell in cells):
        return COMMA_TWICE
    columns = f"{len(cells)} column{'' if len(cells) == 1 else 's'} separated by {_NAMED[separator]}"
    if len(cells) < 2:
        return f"{columns}, two are needed: y and z"
    return f"{columns}, two are read, y and z: delete the other{'s' if len(cells) > 3 else ''}"


def _goes_on(text: Text, number: int) -> bool:
    """Tell whether numbers follow a line."""
    following = (line.strip() for line in text.lines[number : number + 5])
    return any(looks_like_number(line) for line in following if line)


def _is_heading(line: str) -> bool:
    """Tell whether no cell of the line begins like a number."""
    return not any(looks_like_number(cell) for cell in re.split(r"[;,\t ]+", line.strip(";, \t")))


def _comments(text: Text) -> str:
    """First comment of the file."""
    for line in text.lines[:20]:
        if line.lstrip()[:1] in ("#", "!", "%"):
            return line.lstrip()[1:].strip()
    return ""


def _points(
    text: Text, faults: Faults, y_axis: Literal["field", "centre"], z: Literal["down", "up"]
) -> Points:
    found, heading = columns(text, faults)
    header = {key: value for key, value in (("comment", _comments(text)), ("columns", heading)) if value}
    return Points(found.lines, found.y, found.z, y_axis, z, header=header)


def recognises(text: Text, suffix: str) -> bool:
    """Tell whether the file may be plain text with two columns; the last format to be asked."""
    return bool(suffix or text.lines)


def read(text: Text, kind: Literal["wheel", "rail"], faults: Faults) -> Points:  # noqa: ARG001
    """Points of a plain two-column file; its axes should be ours."""
    return _points(text, faults, "field", "down")


def recognises_gensys(text: Text, suffix: str) -> bool:  # noqa: ARG001
    """Tell a GENSYS profile by its extension; its content is not marked."""
    return suffix in GENSYS_SUFFIXES


def read_gensys(text: Text, kind: Literal["wheel", "rail"], faults: Faults) -> Points:  # noqa: ARG001
    """Points of a GENSYS profile: y towards the track centre, z down, `#` comments."""
    return _points(text, faults, "centre", "down")


def recognises_uic(text: Text, suffix: str) -> bool:  # noqa: ARG001
    """Tell a table of UIC 519 or EN 15302 by its extension."""
    return suffix in UIC_SUFFIXES


def read_uic(text: Text, kind: Literal["wheel", "rail"], faults: Faults) -> Points:  # noqa: ARG001
    """Points of a table of UIC 519 or EN 15302: y to the field side, z up."""
    return _points(text, faults, "field", "up")
