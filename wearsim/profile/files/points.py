"""Text files of profiles, their columns of numbers, and formats of plain point lists.

Axes of GENSYS after its manual pages `kpf` and `kpf_rot`, of UIC 519 after published
tables of the reference profiles of EN 15302.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from pathlib import Path
from typing import Any, Literal, NoReturn

import numpy as np
from numpy.typing import NDArray

from wearsim import table_layout
from wearsim.errors import Fault, ProfileError, first_of
from wearsim.profile.shape import Kind

MAX_BYTES = 20_000_000
MAX_LINES = 1_100_000  # 10^6 points and the lines around them
MAX_POINTS = 1_000_000
MAX_CELL = 1000  # characters of one number
_SAMPLE = 200  # lines by which the layout is detected
_MOST_FAULTS = 1000  # reading stops after this many faults
_CONTROL = re.compile(
    r"[\x00-\x08\x0b\x0e-\x1f\x7f]"
)  # all but tab, line ends and form feed
_LARGEST = 1e6  # in any unit; sums and products of points stay finite
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]{1,3})?")
_NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity|1\.#\w*)", re.IGNORECASE)
_COMMENT = re.compile(r"[#!%].*")
_NUMBERS_BEGIN = re.compile(r"(^|[;,\s])[+-]?(\.?\d|nan\b|inf)", re.IGNORECASE)
_DECIMAL = r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?"
# two numbers and text beside them, which begins with a letter, bracket or quote
_TEXT_BESIDE = re.compile(
    rf"({_DECIMAL}(?:\s*[;,]\s*|\s+){_DECIMAL})[\s;,]+(?!nan\b|inf)(?:[^\W\d_]|[('\"\[]).*",
    re.IGNORECASE,
)
_TEXT_LINE = re.compile(r"(?!nan\b|inf\b)(?:[^\W\d_]|[\"'(\[])", re.IGNORECASE)
_UNITS = {"mm": "0.001", "m": "1", "cm": "0.01", "in": "0.0254"}

Decimals = NDArray[np.object_]
"""Exact decimals, as written in a file."""
Row = tuple[int, str]
"""Number of a line, and its text without comment."""


@dataclass(frozen=True)
class Text:
    """Lines of a file without line ends, and notes on its encoding."""

    lines: tuple[str, ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Points:
    """Points (n,) as written in a file, and the axes stated by its format."""

    lines: list[int]  # of each point
    y: Decimals
    z: Decimals
    # directions by the rules of the format: y to the field side or the track centre, z
    # down to the flange tip
    y_axis: Literal["field", "centre", "unknown"]
    z_axis: Literal["down", "up"]
    unit: Decimal | None = (
        None  # length of the file's unit [m]; None if the file does not say
    )
    header: dict[str, str] = field(default_factory=dict)  # keys and values, unchanged
    notes: tuple[str, ...] = ()  # what to report


class Faults:
    """Faults of one file, reported all at once."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.faults: list[Fault] = []

    def add(self, message: str, line: int | None = None) -> None:
        """Record a fault; reading stops after many."""
        self.faults.append(Fault(message, str(self.path), line))
        if len(self.faults) >= _MOST_FAULTS:
            self.raise_any()

    def stop(self, message: str, line: int | None = None) -> NoReturn:
        """Raise all faults, this one last."""
        self.add(message, line)
        self.raise_any()
        raise AssertionError(message)

    def raise_any(self) -> None:
        """Raise `ProfileError` if there are faults.

        Equal faults share one line; of many faults the first are listed.
        """
        alike: dict[str, list[Fault]] = {}
        for fault in self.faults:
            alike.setdefault(fault.message, []).append(fault)
        lines = [
            f"{same[0]} (and {len(same) - 1} more lines)"
            if len(same) > 1
            else str(same[0])
            for same in alike.values()
        ]
        if lines:
            raise ProfileError("\n".join(first_of(lines)))


def read_text(path: Path) -> Text:
    """Read a text file of at most 20 MB, see `table_layout.decoded`.

    Any encoding other than UTF-8 is noted. Raises `ProfileError` for a missing file,
    one that is too large, or one that is no text.
    """
    try:
        if not path.is_file():
            what = "is no regular file" if path.exists() else "does not exist"
            raise ProfileError(f"{path}: {what}; give the path of a profile file")
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise ProfileError(
            f"{path}: cannot be read ({error.strerror}); check the path and its "
            "permissions"
        ) from error
    large = len(data) > MAX_BYTES
    if large or max(data.count(b"\n"), data.count(b"\r")) > MAX_LINES:
        most = (
            f"larger than {MAX_BYTES // 10**6} MB"
            if large
            else f"more than {MAX_LINES} lines"
        )
        raise ProfileError(
            f"{path}: {most}, hardly one profile; give one cross-section"
        )
    if data.startswith((b"\x89HDF", b"CDF")):
        raise ProfileError(
            f"{path}: is a result file, not a file of points; `wearsim profile {path} "
            "--convert miniprof` writes its worn wheel as one"
        )
    text, encoding = table_layout.decoded(data)
    notes = () if encoding == "UTF-8" else (f"text is not UTF-8: read as {encoding}",)
    if (bad := _CONTROL.search(text)) is not None:
        line = text.count("\n", 0, bad.start()) + 1
        raise ProfileError(
            f"{path}:{line}: holds the control character {bad[0]!r}, so it is not "
            "UTF-8 text; save it as UTF-8"
        )
    return Text(tuple(text.split("\n")), notes)


def number_fault(cell: str) -> str | None:
    """Return the fault of a number, or None."""
    if len(cell) > MAX_CELL:
        return f"is longer than {MAX_CELL} characters"
    if _NUMBER.fullmatch(cell):
        return (
            None
            if abs(float(cell)) <= _LARGEST
            else "is too large for a profile; check units and columns"
        )
    if _NOT_FINITE.fullmatch(cell):
        return "is not a finite number; delete the line or repeat the measurement"
    return "is not a number" if cell else "is missing"


def value_of(header: Mapping[str, str], key: str) -> str:
    """Value of a header key in any case of letters, empty if it has none."""
    return next(
        (
            value.strip()
            for name, value in header.items()
            if name.lower() == key.lower()
        ),
        "",
    )


def one_line(text: str) -> str:
    """Text with single blanks and without characters that readers cannot process."""
    return " ".join(
        "".join(mark if mark.isprintable() else " " for mark in text).split()
    )


def separator_of(lines: Sequence[str]) -> str:
    """Return the separator of columns of numbers; tabs count as blanks."""
    separator = table_layout.separator_of([line.replace("\t", " ") for line in lines])
    if separator == "," and not any("," in line for line in lines):
        return " "
    return separator


def cells_of(line: str, separator: str) -> list[str]:
    """Cells of a line with decimal points."""
    if separator == " ":
        return [cell.replace(",", ".") for cell in line.split()]
    cells = [cell.strip() for cell in line.split(separator)]
    return cells if separator == "," else [cell.replace(",", ".") for cell in cells]


def read_columns(
    rows: list[Row],
    faults: Faults,
    *,
    need: str,
    most: int,
    take: tuple[int, int] = (0, 1),
    names: str = "yz",
) -> dict[str, Any]:
    """Read line numbers, y and z of points from two columns of numbers.

    Anything that is not a number is a fault of its line. Rows have at least the columns
    required (`need` in words) and at most `most`.
    """
    separator = separator_of([line for _, line in rows[:_SAMPLE]])
    lines: list[int] = []
    pairs: list[tuple[Decimal, Decimal]] = []
    for number, line in rows:
        cells = cells_of(line, separator)
        if not max(take) < len(cells) <= most:
            cut = (
                ": the file is cut off; copy it again"
                if len(cells) < 2 and number == rows[-1][0]
                else ""
            )
            apart = table_layout.SEPARATORS[separator]
            what = f"number of columns (separated by {apart}) = {len(cells)}"
            faults.add(f"{what} must be {need}{cut}", number)
            continue
        y, z = (cells[column] for column in take)
        wrong = [
            (name, cell, number_fault(cell))
            for name, cell in zip(names, (y, z), strict=True)
        ]
        for name, cell, fault in wrong:
            if fault is not None:
                faults.add(f"{name} = {cell[:40]!r} {fault}", number)
        if wrong[0][2] is wrong[1][2] is None:
            lines.append(number)
            pairs.append((Decimal(y), Decimal(z)))
        if len(lines) > MAX_POINTS:
            faults.stop(
                (
                    f"more than {MAX_POINTS} points, hardly one profile; give one "
                    "cross-section"
                ),
                number,
            )
    columns = np.array(pairs, dtype=object).reshape(-1, 2).T
    return {"lines": lines, "y": columns[0], "z": columns[1]}


def read_points(
    text: Text,
    _kind: Kind,
    faults: Faults,
    *,
    towards_centre: bool = False,
    upwards: bool = False,
) -> Points:
    """Points of a plain list for wheel or rail, with the axes of its format.

    `#`, `!` and `%` begin comments. Lines of text and a row of units may precede the
    points, text may stand beside them.
    """
    bare = (
        (number, _COMMENT.sub("", raw).strip())
        for number, raw in enumerate(text.lines, start=1)
    )
    rows = [row for row in bare if row[1]]
    rows, heading, unit, notes = _without_text(rows)
    need = "two: y and z, apart by blanks, semicolons, or commas with decimal points"
    columns = read_columns(rows, faults, need=need, most=2)
    first = (
        line.lstrip()[1:].strip()
        for line in text.lines[:20]
        if line.lstrip()[:1] in ("#", "!", "%")
    )
    about = {"comment": next(first, ""), "columns": heading}
    return Points(
        **columns,
        y_axis="centre" if towards_centre else "field",
        z_axis="up" if upwards else "down",
        unit=unit,
        header={key: value for key, value in about.items() if value},
        notes=tuple(notes),
    )


def _without_text(
    rows: list[Row],
) -> tuple[list[Row], str, Decimal | None, list[str]]:
    """Rows of numbers alone, the heading, the unit of a row of units, and notes."""
    above = 0
    while above < len(rows) and (
        _TEXT_LINE.match(rows[above][1])
        or (not above and not _NUMBERS_BEGIN.search(rows[above][1]))
    ):
        above += 1
    texts, rows = rows[:above], rows[above:]
    heading = ""
    unit = None
    notes = list[str]()
    for number, text in texts:
        cells = re.split(r"[;,\t]|\s+", text)
        names = {table_layout.unit_named(cell) for cell in cells if cell}
        if table_layout.is_units(cells) and len(names) == 1 and names <= set(_UNITS):
            unit = Decimal(_UNITS[name := names.pop()])
            notes.append(f"units {name} by line {number}")
        else:
            heading = heading or text
    plain = [
        (number, match[1] if (match := _TEXT_BESIDE.fullmatch(line)) else line)
        for number, line in rows
    ]
    beside = sum(row != plain_row for row, plain_row in zip(rows, plain, strict=True))
    notes += _layout_notes([line for _, line in plain[:_SAMPLE]], beside)
    return plain, heading, unit, notes


def _layout_notes(lines: list[str], beside: int) -> Iterator[str]:
    """Describe the layout of the first rows, and the lines with text beside numbers."""
    if beside:
        count = f"{beside} lines" if beside > 1 else "1 line"
        yield f"text beside the numbers of {count} left out"
    separator = separator_of(lines)
    if separator in (";", "|"):
        yield f"columns separated by {table_layout.SEPARATORS[separator]}"
    if separator != "," and any("," in line for line in lines):
        yield "decimal commas"
