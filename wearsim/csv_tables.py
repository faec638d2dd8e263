"""Tables of users as text: header and rows with their lines, and the faults of form.

Separator, decimal mark, encoding, comments and a row of units are detected.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from wearsim import table_layout
from wearsim.errors import Fault, shown

_CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f]")
_HEAD = 100_000  # characters by which a layout is described
_SAMPLE = 200  # records from which the usual number of cells is counted
_MOST_LISTED = 3  # rows of a wrong length that have a fault each

Rows = list[tuple[int, list[str]]]
"""Line and cells of rows."""


class CsvTable(NamedTuple):
    """A text table; cells are without blanks around them, decimals have points."""

    line: int  # of the header
    # names of the columns; empty ones at the end, as spreadsheets leave them, do not
    # count
    header: list[str]
    rows: Rows  # those that count and are as wide as the header
    faults: list[Fault]  # of its form
    layout: str = ""  # in words, "" for UTF-8 with commas and decimal points
    units: Mapping[str, str] = {}  # by column, of the row below the header
    units_line: int | None = None
    comments: tuple[tuple[int, str], ...] = ()  # lines of comments


def csv_table(
    content: bytes, file: str, *, short: bool = False, empty: bool = False
) -> CsvTable:
    """Read a text table of any common layout.

    Lines that begin with a mark of comments (#, !, %, //) do not count, unless the last
    one above rows of numbers has their number of cells: it is the header. Nor do lines
    of text above the header that have fewer cells.

    Parameters
    ----------
    content : bytes
        Content of the file.
    file : str
        Its name, for faults.
    short : bool
        Whether rows may end before the header does.
    empty : bool
        Whether rows of empty cells count; blank lines do not.
    """
    return _table(*table_layout.decoded(content), file, short=short, empty=empty)


def layout_note(content: bytes) -> str:
    """Describe the layout of a table in one line, by the first part of its text.

    "" for UTF-8 with commas and decimal points.
    """
    text, encoding = table_layout.decoded(content)
    if len(text) > _HEAD:
        text = text[:_HEAD].rpartition("\n")[0]
    return _table(text, encoding, "", short=True, empty=False).layout


def _table(
    text: str, encoding: str, file: str, *, short: bool, empty: bool
) -> CsvTable:
    """Table of a decoded text, see `csv_table`."""
    if (bad := _CONTROL.search(text)) is not None:
        line = text.count("\n", 0, bad.start()) + 1
        message = f"holds the control character {bad[0]!r}: no text; save it as text"
        return CsvTable(line, [], [], [Fault(message, file, line)])
    lines = text.split("\n")
    comments = tuple(
        (number, line.strip())
        for number, line in enumerate(lines, 1)
        if table_layout.is_comment(line)
    )
    for number, _ in comments:
        lines[number - 1] = ""
    separator = _stated_separator(lines) or table_layout.separator_of(lines)
    records, faults = _records(lines, separator, file, empty=empty)
    records, skipped = _from_header(records, comments, separator)
    commas = separator != "," and any(
        table_layout.has_comma(cell) for _, cells in records for cell in cells
    )
    (top, names), *rest = records or [(1, [])]
    header = list(names)
    while header and not header[-1]:
        header.pop()
    units: dict[str, str] = {}
    units_line = None
    if rest and table_layout.is_units(rest[0][1]):
        (units_line, cells), *rest = rest
        units = {name: cell for name, cell in zip(header, cells, strict=False) if cell}
    if commas:
        faults += _grouped(rest, file)
        rest = [(at, [*map(table_layout.with_points, cells)]) for at, cells in rest]
    faults += _twice(header, file, top)
    rows, uneven = _as_wide(rest, len(header), short=short)
    faults += _uneven(uneven, len(header), file, separator)
    words = table_layout.layout_words(encoding, separator, commas, units_line, skipped)
    return CsvTable(top, header, rows, faults, words, units, units_line, comments)


def unit_faults(table: CsvTable, file: str, keys: Mapping[str, str]) -> list[Fault]:
    """Find columns whose row of units contradicts their key; `keys` by column."""
    return [
        Fault(
            f"column {shown(name)} is in {table.units[name]} by the row of units, the "
            f"key {key} is in {table_layout.unit_of_key(key)}; state the unit of the "
            "file, or convert the column",
            file,
            table.units_line,
        )
        for name, key in keys.items()
        if table_layout.contradicts(key, table.units.get(name, ""))
    ]


def csv_text(table: CsvTable) -> str:
    """Write header and rows of a table as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table.header)
    writer.writerows(cells for _, cells in table.rows)
    return text.getvalue()


def _stated_separator(lines: list[str]) -> str:
    """Separator of a first line such as "sep=;" of spreadsheets, which is blanked."""
    if lines and (match := re.fullmatch(r'"?sep=(.)"?', lines[0].strip("\ufeff "))):
        lines[0] = ""
        return match[1] if match[1] in table_layout.SEPARATORS else ""
    return ""


def _records(
    lines: list[str], separator: str, file: str, *, empty: bool
) -> tuple[Rows, list[Fault]]:
    """Lines and cells of all rows that are not blank, and faults of quotes."""
    if separator == " ":
        rows = ((number, line.split()) for number, line in enumerate(lines, 1))
        return [(number, cells) for number, cells in rows if cells], []
    reader = csv.reader(
        (f"{line}\n" for line in lines),
        strict=True,
        skipinitialspace=separator != "\t",
        delimiter=separator,
    )
    records = Rows()
    faults = list[Fault]()
    line = 1
    try:
        for cells in reader:
            stripped = [cell.strip() for cell in cells]
            if any(stripped) or (empty and len(cells) > 1):
                records.append((line, stripped))
            line = reader.line_num + 1
    except csv.Error as error:
        message = (
            f"is not well-formed CSV ({error}); quotes within a quoted cell are "
            f"doubled, and {table_layout.SEPARATORS[separator].removesuffix('s')} or "
            "end of the line follows the last one"
        )
        faults.append(Fault(message, file, line))
    return records, faults


def _from_header(
    records: Rows, comments: tuple[tuple[int, str], ...], separator: str
) -> tuple[Rows, int]:
    """Return the records from the header on, and the number of those above it."""
    if not records:
        return records, 0
    top, first = records[0]
    if len(first) > 1 and all(map(table_layout.is_number, first)):
        above = [comment for comment in comments if comment[0] < top][-1:]
        for number, comment in above:
            bare = comment.lstrip("#!%/ \t")
            cells = table_layout.cells_of(bare, separator)
            if len(cells) == len(first) and not any(map(table_layout.is_number, cells)):
                return [(number, cells), *records], 0
        return records, 0
    widths = [len(cells) for _, cells in records[:_SAMPLE]]
    usual = max(set(widths), key=lambda width: (widths.count(width), width))
    for k, (_, cells) in enumerate(records):
        if any(map(table_layout.is_number, filter(None, cells))) and k:
            break
        if len(cells) >= usual:
            return records[k:], k
    return records, 0


def _grouped(rows: Rows, file: str) -> Iterator[Fault]:
    """Fault of the first number whose points may group thousands."""
    for line, cells in rows:
        for cell in cells:
            if table_layout.is_grouped(cell):
                yield Fault(
                    f"{cell} in a file with decimal commas: the point may group "
                    "thousands or be a decimal point; write numbers without groups "
                    "and with one decimal mark",
                    file,
                    line,
                )
                return


def _twice(header: list[str], file: str, top: int) -> list[Fault]:
    """Faults of columns of one name."""
    alike = [" ".join(name.split()) for name in header]
    twice = sorted({name for name in alike if name and alike.count(name) > 1})
    return [
        Fault(f"column {shown(name)} stands twice; delete one of them", file, top)
        for name in twice
    ]


def _as_wide(
    rows: Rows, wide: int, *, short: bool
) -> tuple[Rows, list[tuple[int, int]]]:
    """Rows as wide as the header; line and number of cells of the others."""
    even, uneven = Rows(), list[tuple[int, int]]()
    for line, cells in rows:
        if any(cells[wide:]) or (len(cells) < wide and not short):
            uneven.append((line, len(cells)))
        else:
            even.append((line, cells[:wide]))
    return even, uneven


def _uneven(
    uneven: list[tuple[int, int]], wide: int, file: str, separator: str
) -> list[Fault]:
    """Faults of rows that are not as wide as the header; of many one."""
    apart = table_layout.SEPARATORS[separator]
    fix = f"cells are separated by {apart}, texts with {apart} stand in quotes"
    if len(uneven) > _MOST_LISTED:
        (line, count), *more = uneven
        message = (
            f"{count} cells, the header has {wide} (and {len(more)} more rows of "
            f"another length); {fix}"
        )
        return [Fault(message, file, line)]
    return [
        Fault(f"{count} cells, the header has {wide}; {fix}", file, line)
        for line, count in uneven
    ]
