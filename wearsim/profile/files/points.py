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

from wearsim.errors import Fault, ProfileError, first_of
from wearsim.profile.shape import FloatArray

MAX_BYTES = 20_000_000
MAX_LINES = 1_100_000  # 10^6 points and what may stand around them
MAX_POINTS = 1_000_000
MAX_CELL = 1000  # characters of one number
MAX_SLICES = 100_000
EXACT = Context(prec=400)
"""Digits enough to add 70 mm to any double without rounding."""

_MOST_FAULTS = 1000  # then reading stops
_CONTROL = re.compile(r"[\x00-\x08\x0b\x0e-\x1f\x7f]")  # all but tab, line ends and form feed
_LARGEST = 1e6  # in any unit; keeps sums and products of points finite
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]{1,3})?")
_NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity|1\.#\w*)", re.IGNORECASE)
_COMMENT = re.compile(r"[#!%].*")
_NUMBERS_BEGIN = re.compile(r"(^|[;,\s])[+-]?(\.?\d|nan\b|inf)", re.IGNORECASE)
_SEPARATORS = {"": "blanks", ",": "commas", ";": "semicolons"}
_SLICE = re.compile(r"""([-+.\deE]+)\s+(?:'([^']+)'|"([^"]+)")""")


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
        self.faults: list[Fault] = []

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self.faults)

    def add(self, message: str, line: int | None = None) -> None:
        """Note a fault; reading stops after many."""
        self.faults.append(Fault(message, str(self.path), line))
        if self.count >= _MOST_FAULTS:
            self.raise_any()

    def raise_any(self) -> None:
        """Raise `ProfileError` if there are faults: those alike in one line, of many the first."""
        alike: dict[str, list[Fault]] = {}
        for fault in self.faults:
            alike.setdefault(fault.message, []).append(fault)
        lines = [f"{same[0]} (and {len(same) - 1} more lines)" if len(same) > 1 else str(same[0])
                 for same in alike.values()]  # fmt: skip
        if lines:
            raise ProfileError("\n".join(first_of(lines)))


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
        wrong = [
            f"{name} = {cell[:40]!r} {fault}"
            for name, cell in zip(names, (y, z), strict=True)
            if (fault := number_fault(cell)) is not None
        ]
        if wrong:
            self.skipped += 1
            for message in wrong:
                self.faults.add(message, line)
            return
        self.lines.append(line)
        self.y.append(y)
        self.z.append(z)
        if len(self.lines) > MAX_POINTS:
            self.faults.add(
                f"more than {MAX_POINTS} points, hardly one profile; give one cross-section", line
            )
            self.faults.raise_any()


def read_text(path: Path) -> Text:
    """Read a text file of at most 20 MB: UTF-8, UTF-16 with a byte order mark, or Latin-1.

    Instruments write names of places and people in Latin-1; any encoding other than UTF-8 is noted. Raises
    `ProfileError` for no such file, one that is too large, or no text.
    """
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
    if data.startswith((b"\x89HDF", b"CDF")):
        write = f"`wearsim profile {path} --convert miniprof`"
        raise ProfileError(
            f"{path}: is a result file, not a file of points; {write} writes its worn wheel as one"
        )
    marked = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    try:
        text = data.decode("utf-16" if marked else "utf-8-sig")
        notes = ("text read as UTF-16",) if marked else ()
    except UnicodeDecodeError:
        text, notes = data.decode("latin-1"), ("text is not UTF-8: read as Latin-1",)
    text = text.removesuffix("\x1a").replace("\r\n", "\n").replace("\r", "\n")  # end mark of DOS files
    if (bad := _CONTROL.search(text)) is not None:
        line = text.count("\n", 0, bad.start()) + 1
        message = f"holds the control character {bad[0]!r}, so it is not UTF-8 text; save it as UTF-8"
        raise ProfileError(f"{path}:{line}: {message}")
    return Text(path, tuple(text.split("\n")), notes)


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
    add, multiply = EXACT.add, EXACT.multiply
    return np.array([float(add(multiply(add(Decimal(c), shift), factor), offset)) for c in cells]) + 0.0


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
        if points.separator is None and not heading and not _NUMBERS_BEGIN.search(line):
            heading = line
            continue
        cells = points.cells(line)
        if len(cells) == 2:
            points.add(number, *cells)
        else:
            by = _SEPARATORS[points.separator or ""]
            fix = "two: y and z, apart by blanks, semicolons, or commas with decimal points"
            faults.add(f"number of columns (separated by {by}) = {len(cells)} must be {fix}", number)
    first = (line.lstrip()[1:].strip() for line in text.lines[:20] if line.lstrip()[:1] in ("#", "!", "%"))
    about = {"comment": next(first, ""), "columns": heading}
    header = {key: value for key, value in about.items() if value}
    return Points(points.lines, points.y, points.z, y_axis, z_axis, header=header)


def is_slice_list(text: Text) -> bool:
    """Whether a file holds lines of position and quoted file name, as lists of slices of CONTACT do."""
    bare = [line for line in (_bare(raw) for raw in text.lines[:200]) if line]
    return bool(bare) and len(_numbers(bare[0], 2)) == 2 and any(map(_SLICE.match, bare[4:]))


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
    listed = [(at, match) for at, line in rows[4:] if (match := _SLICE.match(line))][: int(total)]
    if total not in range(1, MAX_SLICES + 1):
        faults.add(f"{total:g} slices; the number must be a whole one in 1 .. {MAX_SLICES}", rows[1][0])
    elif len(listed) < total:
        missing = f"{total:g} slices are promised, {len(listed)} are listed with position and file name"
        faults.add(f"{missing}: the file is cut off; copy it again", len(text.lines))
    elif number is None and total > 1:
        faults.add(f"lists {total:g} slices; choose one with --slice 1 .. {total:g}")
    elif number is not None and not 1 <= number <= total:
        faults.add(f"--slice {number} must be in 1 .. {total:g}")
    if faults.count:
        return None
    chosen = number or 1
    at, match = listed[chosen - 1]
    position, name = match[1], match[2] or match[3]
    header = {"slice": str(chosen), "slices": f"{total:g}", "position": position, "file": name}
    note = f"slice {chosen} of {total:g}, at position {position}: {name}"
    return SliceFile(name, at, header, note)
