"""Text of profile files, the points in it, and the formats that are plain lists of points.

Axes of GENSYS after its manual pages `kpf` and `kpf_rot`, of UIC 519 after published tables of the reference
profiles of EN 15302, slices after the manual of the program CONTACT.
"""

from __future__ import annotations

import codecs
import re
from dataclasses import dataclass, field
from decimal import Context, Decimal
from pathlib import Path
from typing import Literal

import numpy as np

from wearsim.errors import Fault, ProfileError
from wearsim.profile.shape import FloatArray

MAX_BYTES = 20_000_000
MAX_LINES = 1_100_000  # 10^6 points and what may stand around them
MAX_POINTS = 1_000_000
MAX_CELL = 1000  # characters of one number
MAX_SLICES = 100_000
EXACT = Context(prec=400)
"""Digits enough to add 70 mm to any double without rounding."""

COMMA_TWICE = (
    "commas stand between the columns and for the decimal mark: separate the columns by semicolons, or write "
    "decimal points"
)
_SHOWN_FAULTS = 20  # lines of one message; a wrong separator would fault every line of a long file
_MOST_ALIKE = 3  # faults of the same kind; more are reported once
_MOST_FAULTS = 1000  # then reading stops
_CONTROL = re.compile(r"[\x00-\x08\x0b\x0e-\x1f\x7f]")  # all but tab, line ends and form feed
_LARGEST = 1e6  # in any unit; keeps sums and products of points finite
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]{1,3})?")
_NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity|1\.#\w*)", re.IGNORECASE)
_ALMOST_NUMBER = re.compile(r"[+-]?\.?\d")
_COMMENT = re.compile(r"[#!%].*")
_WHOLE = re.compile(r"[+-]?[0-9]+([eE][+-]?[0-9]+)?")
_SEPARATORS = {"": "blanks", ",": "commas", ";": "semicolons"}
_SLICE = re.compile(r"""(\S+)\s+(?:'([^']+)'|"([^"]+)")""")


@dataclass(frozen=True)
class Text:
    """Lines of a file without line ends, and notes on its encoding."""

    path: Path
    lines: tuple[str, ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Points:
    """Points as they stand in a file, before any axis or unit is settled."""

    lines: list[int]  # of each point
    y: list[str]  # decimals as written
    z: list[str]
    # directions by the rules of the format: y to the field side or the track centre, z down to the flange tip
    y_axis: Literal["field", "centre", "unknown"] = "unknown"
    z_axis: Literal["down", "up", "unknown"] = "unknown"
    shift_y: Decimal = Decimal(0)  # to be added to the file's numbers
    shift_z: Decimal = Decimal(0)
    mirror_y: bool = False  # sign to be changed after that
    mirror_z: bool = False
    metres: Decimal | None = None  # length of the file's unit [m]; None if the file does not say
    running_circle: Decimal | None = None  # distance from the flange back given in the file [mm]
    header: dict[str, str] = field(default_factory=dict)  # keys and values, unchanged
    notes: tuple[str, ...] = ()  # what to report


@dataclass(frozen=True)
class SliceFile:
    """Name of the file that holds a slice, the line that names it, header, and what to report."""

    file: str
    line: int
    header: dict[str, str]
    note: str


class Faults:
    """Faults of one file, reported all at once."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.count = 0
        self._alike: dict[str, list[tuple[str, int | None]]] = {}

    def add(self, message: str, line: int | None = None, like: str | None = None) -> None:
        """Note a fault; of many alike, by `like` or by their message, the first is reported."""
        self.count += 1
        self._alike.setdefault(like or message, []).append((message, line))
        if self.count == _MOST_FAULTS:
            self.add(f"reading stopped after {_MOST_FAULTS} faults", line)
            self.raise_any()

    def raise_any(self) -> None:
        """Raise `ProfileError` if there are faults."""
        if not self.count:
            return
        shown: list[tuple[str, int | None]] = []
        for alike in self._alike.values():
            message, line = alike[0]
            more = f"{message} (and {len(alike) - 1} more lines)"
            shown += alike if len(alike) <= _MOST_ALIKE else [(more, line)]
        lines = [str(Fault(message, str(self.path), line)) for message, line in shown[:_SHOWN_FAULTS]]
        if len(shown) > _SHOWN_FAULTS:
            lines.append(f"{self.path}: {len(shown) - _SHOWN_FAULTS} more faults of this file are not shown")
        raise ProfileError("\n".join(lines))


class Columns:
    """Collects the points of a file line by line."""

    def __init__(self, faults: Faults) -> None:
        self.faults = faults
        self.lines: list[int] = []
        self.y: list[str] = []
        self.z: list[str] = []
        self.skipped = 0  # lines that are there, but hold no point
        self.separator: str | None = None  # of the first line of numbers

    def cells(self, line: str) -> list[str]:
        """Cells of a line."""
        if self.separator is None:
            self.separator = separator_of(line)
        return split_cells(line, self.separator)

    def add(self, line: int, y: str, z: str, names: str = "yz") -> None:
        """Take the cells of one line, or note what is wrong with them."""
        if self.separator != ",":
            y, z = y.replace(",", "."), z.replace(",", ".")
        wrong = number_fault(y), number_fault(z)
        if wrong != (None, None):
            self.skipped += 1
            for name, cell, fault in zip(names, (y, z), wrong, strict=True):
                if fault is not None:
                    self.faults.add(f"{name} = {cell[:40]!r} {fault}", line, f"{name} {fault}")
            return
        self.lines.append(line)
        self.y.append(y)
        self.z.append(z)
        if len(self.lines) > MAX_POINTS:
            message = f"more than {MAX_POINTS} points, hardly one profile; give one cross-section"
            self.faults.add(message, line)
            self.faults.raise_any()


def read_text(path: Path) -> Text:
    """Read a text file of at most 20 MB: UTF-8, UTF-16 with a byte order mark, or Latin-1.

    Instruments write names of places and people in Latin-1; any encoding other than UTF-8 is noted. Raises
    `ProfileError` for no such file, one that is too large, or no text.
    """
    data = _bytes(path)
    if data.startswith((b"\x89HDF", b"CDF")):
        raise ProfileError(
            f"{path}: is a result file, not a profile; `wearsim inspect {path}` shows what it holds"
        )
    marked = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    try:
        text = data.decode("utf-16" if marked else "utf-8-sig")
        notes = ("text read as UTF-16",) if marked else ()
    except UnicodeDecodeError:
        text, notes = data.decode("latin-1"), ("text is not UTF-8: read as Latin-1",)
    text = text.removesuffix("\x1a")  # end mark of DOS files
    if (bad := _CONTROL.search(text)) is not None:
        line = text.count("\n", 0, bad.start()) + 1
        message = f"holds the control character {bad[0]!r}, so it is not UTF-8 text; save it as UTF-8"
        raise ProfileError(f"{path}:{line}: {message}")
    lines = tuple(text.replace("\r\n", "\n").replace("\r", "\n").split("\n"))
    return Text(path, lines, notes)


def _bytes(path: Path) -> bytes:
    """Content of the file; one that is too large is not read."""
    try:
        if not path.is_file():
            what = "is no regular file" if path.exists() else "does not exist"
            raise ProfileError(f"{path}: {what}; give the path of a profile file")
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        message = f"{path}: cannot be read ({error.strerror}); check the path and its permissions"
        raise ProfileError(message) from error
    large = len(data) > MAX_BYTES
    if large or max(data.count(b"\n"), data.count(b"\r")) > MAX_LINES:
        most = f"larger than {MAX_BYTES // 10**6} MB" if large else f"more than {MAX_LINES} lines"
        raise ProfileError(f"{path}: {most}, hardly one profile; give one cross-section")
    return data


def number_fault(cell: str) -> str | None:
    """Return what is wrong with a number, None if nothing is."""
    if len(cell) > MAX_CELL:
        return f"is longer than {MAX_CELL} characters"
    if _NUMBER.fullmatch(cell):
        return None if abs(float(cell)) <= _LARGEST else "is too large for a profile; check units and columns"
    if _NOT_FINITE.fullmatch(cell):
        return "is not a finite number; delete the line or repeat the measurement"
    return "is not a number" if cell else "is missing"


def is_number(cell: str) -> bool:
    """Whether a cell is a decimal number, with point or comma."""
    return len(cell) <= MAX_CELL and _NUMBER.fullmatch(cell.replace(",", ".")) is not None


def _looks_like_number(cell: str) -> bool:
    return _ALMOST_NUMBER.match(cell) is not None or _NOT_FINITE.fullmatch(cell[:20]) is not None


def separator_of(line: str) -> str:
    """Return the separator of the columns of the first line of numbers; "" means blanks and tabs."""
    if ";" in line:
        return ";"
    cells = line.split()
    # "12,5 3,1" has decimal commas, "12.5, 3.1" a comma between the columns
    if len(cells) >= 2 and not any(cell[0] == "," or cell[-1] == "," for cell in cells):
        return ""
    return "," if "," in line else ""


def one_line(text: str) -> str:
    """Text with single blanks and without characters that no reader takes."""
    return " ".join("".join(mark if mark.isprintable() else " " for mark in text).split())


def split_cells(line: str, separator: str) -> list[str]:
    """Cells of a line."""
    return [cell.strip() for cell in line.split(separator)] if separator else line.split()


def scaled(cells: list[str], shift: Decimal, factor: Decimal, offset: Decimal) -> FloatArray:
    """Exact (cell + shift) * factor + offset of decimals, each rounded once to a double; zeros are positive.

    The shift is in the unit of the file, the factor leads to metres (negative mirrors), the offset is in m.
    """
    sign, digits, exponent = factor.as_tuple()
    if shift == 0 and offset == 0 and digits == (1,) and isinstance(exponent, int):
        # moving the decimal point is exact and three times as fast as decimal arithmetic
        values = np.array([_moved(cell, exponent) for cell in cells])
        return (-values if sign else values) + 0.0
    add, multiply = EXACT.add, EXACT.multiply
    return np.array([float(add(multiply(add(Decimal(c), shift), factor), offset)) for c in cells]) + 0.0


def _moved(cell: str, places: int) -> float:
    """Value of a decimal with its point moved."""
    mantissa, _, exponent = cell.lower().partition("e")
    return float(f"{mantissa}e{int(exponent or 0) + places}")


def _columns_fault(points: Columns, cells: list[str]) -> str:
    """Return what is wrong with a line that has not two columns."""
    separator, count = points.separator or "", len(cells)
    if separator == "," and not points.lines and count in (3, 4) and all(map(_WHOLE.fullmatch, cells)):
        return COMMA_TWICE
    return f"number of columns (separated by {_SEPARATORS[separator]}) = {count} must be 2: y and z"


def _is_heading(line: str) -> bool:
    """Whether no cell of the line begins like a number."""
    return not any(_looks_like_number(cell) for cell in re.split(r"[;,\t ]+", line.strip(";, \t")))


def read_points(
    text: Text, faults: Faults, y_axis: Literal["field", "centre"], z_axis: Literal["down", "up"]
) -> Points:
    """Points of a plain list with the axes of its format.

    `#`, `!` and `%` begin comments; one line without numbers may precede the points.
    """
    points = Columns(faults)
    heading = ""
    for number, raw in enumerate(text.lines, start=1):
        commented = "#" in raw or "!" in raw or "%" in raw  # faster than the search, for long files
        line = (_COMMENT.sub("", raw) if commented else raw).strip()
        if not line:
            continue
        if points.separator is None and not heading and _is_heading(line):
            heading = line
            continue
        cells = points.cells(line)
        if len(cells) == 2:
            points.add(number, *cells)
        else:
            faults.add(_columns_fault(points, cells), number)
    first = (line.lstrip()[1:].strip() for line in text.lines[:20] if line.lstrip()[:1] in ("#", "!", "%"))
    about = {"comment": next(first, ""), "columns": heading}
    header = {key: value for key, value in about.items() if value}
    return Points(points.lines, points.y, points.z, y_axis, z_axis, header=header)


def is_slice_list(text: Text) -> bool:
    """Whether a file holds lines of position and quoted file name, as lists of slices of CONTACT do."""
    bare = [line for line in (_bare(raw) for raw in text.lines[:200]) if line]
    listed = [match for match in map(_SLICE.match, bare[4:]) if match and number_fault(match[1]) is None]
    return bool(bare) and len(_numbers(bare[0], 2)) == 2 and len(listed) > 0


def _bare(line: str) -> str:
    """Line without comment; a `%` or `!` in a file name is not expected."""
    return re.split(r"[!%]", line, maxsplit=1)[0].strip()


def _numbers(line: str, count: int) -> list[str]:
    """Return the first `count` cells of a line, or fewer if they are no numbers; words may follow."""
    cells = line.replace(",", " ").split()[:count]
    return [cell for cell in cells if number_fault(cell) is None]


def read_slice_list(text: Text, faults: Faults, number: int | None) -> SliceFile | None:
    """File of one slice (from 1) of a list of CONTACT: `.slcs` (rail along the track), `.slcw` (wheel).

    The text has offset and scale, number of slices, features, method, then one line per slice. None if no
    slice can be chosen; the fault says why.
    """
    rows = [(at, line) for at, line in ((k, _bare(raw)) for k, raw in enumerate(text.lines, 1)) if line]
    names = ("offset and scale", "the number of slices", "NFEAT NKINK NACCEL", "the method")
    for name, count, (at, line) in zip(names, (2, 1, 3, 1), rows, strict=False):
        if len(_numbers(line, count)) < count:
            faults.add(f"{count} number{'s are' if count > 1 else ' is'} needed here: {name}", at)
    if len(rows) < 4:
        faults.add(f"ends before {names[len(rows)]}: the file is cut off; copy it again", len(text.lines))
    if faults.count:
        return None
    total = float(_numbers(rows[1][1], 1)[0])
    if total != int(total) or not 1 <= total <= MAX_SLICES:
        faults.add(f"{total:g} slices; the number must be a whole one in 1 .. {MAX_SLICES}", rows[1][0])
        return None
    listed = []
    for at, line in rows[4 : 4 + int(total)]:
        match = _SLICE.match(line)
        if match is None or number_fault(match[1]) is not None:
            faults.add("position and quoted file name of a slice are needed here", at)
        else:
            listed.append((at, match[1], match[2] or match[3]))
    if len(rows) - 4 < int(total):
        missing = f"{int(total)} slices are promised, {len(rows) - 4} are listed: the file is cut off"
        faults.add(f"{missing}; copy it again", len(text.lines))
    if not faults.count and number is None and len(listed) > 1:
        first, last = listed[0][1], listed[-1][1]
        faults.add(f"lists {len(listed)} slices, position {first} to {last}; choose one with --slice 1 .. "
                   f"{len(listed)}")  # fmt: skip
    chosen = 1 if number is None else number
    if not faults.count and not 1 <= chosen <= len(listed):
        faults.add(f"--slice {chosen} must be in 1 .. {len(listed)}")
    if faults.count:
        return None
    at, position, name = listed[chosen - 1]
    header = {"slice": str(chosen), "slices": str(len(listed)), "position": position, "file": name}
    note = f"slice {chosen} of {len(listed)}, at position {position}: {name}"
    return SliceFile(name, at, header, note)
