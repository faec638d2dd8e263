"""Tables of operating points for `wearsim contact --table`: read twice, first for faults, then to solve."""

from __future__ import annotations

import csv
import difflib
import shutil
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, NamedTuple

from wearsim.cli.contact_flags import COLUMNS, conflict, faults_of, merged, point, without_faults
from wearsim.cli.contact_points import profile_faults
from wearsim.cli.contact_print import RESULT_COLUMNS
from wearsim.errors import Fault, SceneError

_LONGEST_LINE = 1_000_000  # characters; longer ones are no table of operating points
_MOST_FAULTS = 100  # lines of one message; a wrong unit would fault every row of a long table
_CREEPAGES = ("creepage_x", "creepage_y", "spin")


class Row(NamedTuple):
    """One row: its line, the texts of its flags that are not empty, and its other columns."""

    line: int
    given: dict[str, str]
    carried: dict[str, str]


class Table(NamedTuple):
    """A table whose header was read.

    Parameters
    ----------
    name : str
        What the user calls it.
    stream : file
        Of bytes, that can be read again.
    columns : tuple of str
        Of the header, in its order.
    warnings : tuple of str
        What deserves a second look, one line each.
    """

    name: str
    stream: BinaryIO
    columns: tuple[str, ...]
    warnings: tuple[str, ...]

    @property
    def kept(self) -> tuple[str, ...]:
        """Columns that are flags or carried through; results of an earlier run are not."""
        return tuple(column for column in self.columns if column not in RESULT_COLUMNS)


@contextmanager
def opened(source: str) -> Iterator[tuple[str, BinaryIO]]:
    """Open a table so that it can be read twice; standard input (-) and pipes are copied first.

    Yields
    ------
    name : str
        For messages.
    stream : file
        Of bytes.
    """
    if source == "-":
        with tempfile.TemporaryFile() as copy:
            shutil.copyfileobj(sys.stdin.buffer, copy)
            yield "stdin", copy
        return
    path = Path(source)
    try:
        if path.is_dir():
            raise SceneError([Fault("is a folder, not a table; give a CSV file", source)])
        stream = path.open("rb")
    except (OSError, ValueError) as error:
        told = getattr(error, "strerror", None) or error
        raise SceneError(
            [Fault(f"cannot be read ({told}); give a CSV file, or - for stdin", source)]
        ) from None
    with stream:
        if path.is_file():
            yield source, stream
            return
        with tempfile.TemporaryFile() as copy:
            shutil.copyfileobj(stream, copy)
            yield source, copy


def checked(name: str, stream: BinaryIO, flags: Mapping[str, str]) -> Table:
    """Read a whole table and refuse it with all its faults.

    Parameters
    ----------
    name : str
        For messages.
    stream : file
        Of bytes.
    flags : mapping
        Texts of the flags given beside the table, by column, without faults.

    Raises
    ------
    SceneError
        All faults, each with its line.
    """
    faults: list[Fault] = []
    rest = 0
    columns: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    rows, further, empty = 0, 0, list[int]()
    seen: set[tuple[object, ...]] = set()
    try:
        for line, cells in _records(name, stream):
            if not columns and any(cell.strip() for cell in cells):
                columns = _header(name, line, cells)
                warnings = tuple(_warnings(columns))
                continue
            if not any(cell.strip() for cell in cells):
                empty.append(line)
                continue
            if _is_further(columns, cells):
                further += 1
                continue
            rows += 1
            for message in _row_faults(columns, line, cells, flags, seen):
                if len(faults) < _MOST_FAULTS:
                    faults.append(Fault(message, name, line))
                else:
                    rest += 1
    except SceneError as error:
        faults += error.faults
    else:
        if rows == 0:
            missing = "only a header" if columns else "nothing"
            faults.append(Fault(f"holds {missing}; give a header with flags and a row per point", name))
    if further:
        warnings += (f"{further} lines of further patches (column patch above 1) are left out",)
    if empty:
        told = f"{len(empty)} rows of empty cells are left out, the first is line {empty[0]}"
        warnings += (told + "; a row of defaults needs one value",)
    if rest:
        faults.append(Fault(f"{rest} more faults are not shown", name))
    if faults:
        raise SceneError(faults)
    return Table(name, stream, columns, warnings)


def rows_of(table: Table) -> Iterator[Row]:
    """Rows of a checked table, one after the other."""
    header = True
    for line, cells in _records(table.name, table.stream):
        if not any(cell.strip() for cell in cells) or (not header and _is_further(table.columns, cells)):
            continue
        if header:
            header = False
        else:
            yield _row(table.columns, line, cells)


def _is_further(columns: tuple[str, ...], cells: list[str]) -> bool:
    """Whether a row is the second or a later patch of a point in the output of an earlier run."""
    if not {"patch", "table_line"} <= set(columns):
        return False
    cell = dict(zip(columns, cells, strict=False)).get("patch", "").strip()
    return cell.isdecimal() and int(cell) > 1


def _row(columns: tuple[str, ...], line: int, cells: list[str]) -> Row:
    pairs = list(zip(columns, cells, strict=False))
    given = {column: cell.strip() for column, cell in pairs if column in COLUMNS and cell.strip()}
    carried = {c: cell for c, cell in pairs if c not in COLUMNS and c not in RESULT_COLUMNS}
    return Row(line, given, carried)


def _row_faults(
    columns: tuple[str, ...],
    line: int,
    cells: list[str],
    flags: Mapping[str, str],
    seen: set[tuple[object, ...]],
) -> list[str]:
    """All that is wrong with one row; profiles are told at the first row that uses them."""
    if len(cells) < len(columns) or any(cell.strip() for cell in cells[len(columns) :]):
        return [f"{len(cells)} cells, the header has {len(columns)}; quote cells that hold commas"]
    given = _row(columns, line, cells).given
    faults = faults_of(given, as_flags=False)
    texts = merged(flags, without_faults(given))
    wrong = conflict(texts)
    settings = point(texts).settings
    key = (settings.wheel, settings.rail, settings.inclination, settings.gauge, settings.half_span)
    if key not in seen:
        seen.add(key)
        for column, message in profile_faults(settings):
            told = (column, message)
            if told not in seen:
                seen.add(told)
                faults.append(f"{column}: {message}")
    return faults + ([wrong] if wrong else [])


def _header(name: str, line: int, cells: list[str]) -> tuple[str, ...]:
    """Names of the columns; empty ones at the end, as spreadsheets leave them, do not count."""
    columns = [cell.strip() for cell in cells]
    while columns and not columns[-1]:
        columns.pop()
    only = " ".join(cells)
    for mark, called in ((";", "semicolons"), ("\t", "tabs")):
        if len(columns) == 1 and mark in only:
            told = f"columns are separated by {called}; save the table with commas between columns and points"
            raise SceneError([Fault(told + " as decimal marks", name, line)])
    faults = [f"column {k} has no name" for k, column in enumerate(columns, 1) if not column]
    twice = sorted({column for column in columns if column and columns.count(column) > 1})
    faults += [f"column {_short(column)} stands there more than once; keep one" for column in twice]
    if not any(column in COLUMNS for column in columns):
        told = "no column has the name of a flag, such as shift_mm, yaw_mrad or wheel_load_kN"
        near = [hint for column in columns if (hint := _nearest(column))]
        faults.append(told + (f"; did you mean {', '.join(near[:5])}?" if near else ""))
    if faults:
        raise SceneError([Fault(fault, name, line) for fault in faults])
    return tuple(columns)


def _short(text: str) -> str:
    """Name of a column as it fits into a line."""
    return " ".join(text.split())[:60]


def _nearest(column: str) -> str | None:
    """Flag that a column was probably meant to be."""
    plain = column.strip("-").replace("-", "_").replace(" ", "_").lower()
    by_lower = {known.lower(): known for known in COLUMNS}
    if plain in by_lower:
        return by_lower[plain]
    for known in COLUMNS:
        stem = known.rsplit("_", 1)[0] if known not in ("roll", "rotation") else known
        if plain in (stem.lower(), known.split("_mm")[0].lower(), known.split("_km_h")[0].lower()):
            return known
    near = difflib.get_close_matches(plain, list(by_lower), n=1, cutoff=0.75)
    return by_lower[near[0]] if near else None


def _warnings(columns: tuple[str, ...]) -> Iterator[str]:
    earlier = [column for column in columns if column in RESULT_COLUMNS]
    if earlier:
        names = ", ".join(earlier[:4]) + (", ..." if len(earlier) > 4 else "")
        yield f"columns {names} are results of an earlier run; they are computed anew"
    if any(column in columns for column in _CREEPAGES) and "patch" not in columns:
        yield 'creepages are given in one column creepage, as "XI_X,XI_Y,SPIN" in quotes'
    for column in columns:
        if column in COLUMNS or column in RESULT_COLUMNS or column in _CREEPAGES:
            continue
        near = _nearest(column)
        if near is not None and near not in columns:
            told = f"column {_short(column)} is not a flag of wearsim and is carried through"
            yield f"{told}; did you mean {near}?"


def _records(name: str, stream: BinaryIO) -> Iterator[tuple[int, list[str]]]:
    """Line and cells of each record that holds anything, be it empty cells."""
    stream.seek(0)
    count = 0

    def lines() -> Iterator[str]:
        nonlocal count
        while raw := stream.readline(_LONGEST_LINE + 1):
            if len(raw) > _LONGEST_LINE:
                told = "is too long a line for a table of operating points"
                raise SceneError([Fault(told, name, count + 1)])
            try:
                text = raw.decode("utf-8-sig" if count == 0 else "utf-8")
            except UnicodeDecodeError:
                told = "is not UTF-8 text; save the table as CSV in UTF-8"
                raise SceneError([Fault(told, name, count + 1)]) from None
            text = text.replace("\r\n", "\n").replace("\r", "\n")
            for line in text.removesuffix("\n").split("\n"):
                count += 1
                if "\0" in line:
                    told = "holds zero bytes; save the table as CSV in UTF-8"
                    raise SceneError([Fault(told, name, count)])
                yield line + "\n"

    start = 1
    reader = csv.reader(lines(), strict=True, skipinitialspace=True)
    try:
        for cells in reader:
            if len(cells) > 1 or any(cell.strip() for cell in cells):
                yield start, cells
            start = count + 1
    except csv.Error as error:
        told = f"is not well-formed CSV ({error}); quotes within a quoted cell are doubled"
        raise SceneError([Fault(told, name, start)]) from None
