"""Profiles measured with MiniProf: `.whl` and `.ban`."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from wearsim.profile.files import points
from wearsim.profile.files.points import Faults, Points, Text, value_of
from wearsim.profile.shape import Kind

SUFFIXES = {".whl": "wheel", ".ban": "rail"}
RUNNING_CIRCLE = 70
"""Distance of the running circle from the flange back, where y counts from [mm]."""
AXIS_KEY = "AxisX"
"""Key by which files written here state the direction of X.

Other programs skip unknown keys.
"""
AXIS_FIELD = "field side"
CIRCLE_KEY, DIAMETER_KEY = "WheelDiameterTaperline", "DiameterTaperline"
_KNOWN_KEY = re.compile(
    r"^\s*(xypoints|columndef|mptypeno|mpserno|mpcaldate|programver|xoffset)\s*=",
    re.IGNORECASE | re.MULTILINE,
)
_DIAMETERS = (300.0, 1500.0)  # plausible range [mm]
_OLD_STYLE = "(sd/sh/qr)"
# In a comment of another format the word only names the origin of the points.
_OLD_TITLE = re.compile(r"[^#!%=,;]*\bMINI[ _-]?PROF[^=]*$", re.IGNORECASE)


def recognises(text: Text) -> bool:
    """Return True if a file has the header of MiniProf."""
    if any(_OLD_TITLE.match(line) for line in text.lines[:3]):
        return True
    head = "\n".join(text.lines[:200])[:20_000]
    return len({key.lower() for key in _KNOWN_KEY.findall(head)}) >= 2


def read(text: Text, kind: Kind, faults: Faults) -> Points:
    """Read points and header of a `.whl` or `.ban` file.

    X of a wheel counts from the flange back.

    The header has ``key=value`` lines (or is of the old style); an empty line before
    points may be missing.
    """
    first = _first_point(text)
    header = _header(text.lines[:first])
    definition = value_of(header, "columndef") or "X,Y"
    names = [name for name in re.split(r"[,;\s]+", definition.lower()) if name]
    if "x" not in names or "y" not in names:
        faults.add(f"ColumnDef = {definition[:40]!r} does not name X and Y")
        names = ["x", "y"]
    take = (names.index("x"), names.index("y"))
    rows = [
        (k, bare)
        for k, raw in enumerate(text.lines[first:], start=first + 1)
        if (bare := _bare(raw))
    ]
    need = f"at least {max(take) + 1} to hold X and Y"
    columns = points.read_columns(
        rows, faults, need=need, most=10**6, take=take, names="XY"
    )
    off = sum(
        raw.lstrip()[:1] == '"' and _is_data(raw.lstrip()[1:])
        for raw in text.lines[first:]
    )
    notes = [f"{off} switched-off points left out"] if off else []
    taken, last = len(columns["lines"]), rows[-1][0] if rows else None
    notes += _count_notes(value_of(header, "xypoints"), taken, off, last, faults)
    if kind == "wheel" and (circle := _other_circle(header)):
        unused = f"{CIRCLE_KEY} = {circle[:40]} of the header is not used"
        notes.append(f"{unused}: it is {RUNNING_CIRCLE} mm here")
    return Points(
        **columns,
        y_axis="field" if value_of(header, AXIS_KEY) == AXIS_FIELD else "unknown",
        z_axis="down" if kind == "wheel" else "up",
        header=header,
        notes=tuple(notes),
    )


def _first_point(text: Text) -> int:
    """Place of the first line of points, after the title of files of the old style."""
    start = next(
        (
            k + 1
            for k, line in enumerate(text.lines[:1000])
            if _OLD_STYLE in line.lower()
        ),
        0,
    )
    return next(
        (k for k in range(start, len(text.lines)) if _is_data(text.lines[k])),
        len(text.lines),
    )


def _count_notes(
    promised: str, taken: int, off: int, last: int | None, faults: Faults
) -> list[str]:
    """Compare the number of points with XYPoints: a fault of too few, a note of more.

    `taken` are the points taken, `off` those switched off, `last` is the line of the
    last point.
    """
    if not re.fullmatch(r"\d{1,9}", promised) or faults.faults:
        return []
    if taken + off < int(promised):
        message = (
            f"XYPoints = {promised}, but {taken + off} points are there: the file "
            "is cut off; copy it again, or correct XYPoints if points were taken "
            "out on purpose"
        )
        faults.add(message, last)
    elif taken > int(promised):
        return [f"XYPoints = {promised}, but {taken} points are there: all are taken"]
    return []


def wheel_diameter(header: Mapping[str, str]) -> float | None:
    """Wheel diameter at the running circle stated in the header, if plausible [m]."""
    text = value_of(header, DIAMETER_KEY).replace(",", ".")
    if points.number_fault(text) or _other_circle(header):
        return None
    return 1e-3 * float(text) if _DIAMETERS[0] <= float(text) <= _DIAMETERS[1] else None


def _other_circle(header: Mapping[str, str]) -> str:
    """Distance of the running circle from the flange back stated in the header.

    "" if it is not set or has the usual value.
    """
    text = value_of(header, CIRCLE_KEY).replace(",", ".")
    unset = not text.strip("-?") or (
        points.number_fault(text) is None and float(text) in (0.0, RUNNING_CIRCLE)
    )
    return "" if unset else text


def _is_data(line: str) -> bool:
    """Return True if a line has two numbers or more and nothing else."""
    bare = _bare(line)
    if not bare or "=" in bare or not (bare[0].isdigit() or bare[0] in "+-."):
        return False
    cells = points.cells_of(bare, points.separator_of([bare]))
    return len(cells) >= 2 and not any(points.number_fault(cell) for cell in cells)


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
