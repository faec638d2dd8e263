"""CSV tables of users: header and rows with their lines, and the faults of their form.

Tables as CSV.
"""

from __future__ import annotations

import csv
import io
from typing import NamedTuple

from wearsim.errors import Fault, shown


class CsvTable(NamedTuple):
    """A CSV text; cells are without blanks around them."""

    line: int  # of the header
    # names of the columns; empty ones at the end, as spreadsheets leave them, do not
    # count
    header: list[str]
    rows: list[
        tuple[int, list[str]]
    ]  # line and cells of each row that counts and is as wide
    faults: list[Fault]  # of its form


def csv_table(
    text: str,
    file: str,
    *,
    comments: bool = False,
    short: bool = False,
    empty: bool = False,
) -> CsvTable:
    """Read a CSV text.

    Parameters
    ----------
    text, file : str
        The text, and the file it is from.
    comments : bool
        Whether lines that begin with # do not count.
    short : bool
        Whether rows may end before the header does.
    empty : bool
        Whether rows of empty cells count; blank lines do not.
    """
    lines = (
        "\n" if comments and line.lstrip().startswith("#") else line
        for line in io.StringIO(text)
    )
    reader, line = csv.reader(lines, strict=True, skipinitialspace=True), 1
    records, faults = list[tuple[int, list[str]]](), list[Fault]()
    try:
        for cells in reader:
            if any(stripped := [cell.strip() for cell in cells]) or (
                empty and len(cells) > 1
            ):
                records.append((line, stripped))
            line = reader.line_num + 1
    except csv.Error as error:
        message = (
            f"is not well-formed CSV ({error}); quotes within a quoted cell are "
            "doubled, and a comma or the end of the line follows the last one"
        )
        faults.append(Fault(message, file, line))
    (top, names), *rest = records or [(1, [])]
    header = list(names)
    while header and not header[-1]:
        header.pop()
    alike = [" ".join(name.split()) for name in header]
    twice = sorted({name for name in alike if name and alike.count(name) > 1})
    faults += [
        Fault(f"column {shown(name)} stands twice; delete one of them", file, top)
        for name in twice
    ]
    wide, rows = len(header), list[tuple[int, list[str]]]()
    for at, cells in rest:
        if any(cells[wide:]) or (len(cells) < wide and not short):
            message = (
                f"{len(cells)} cells, the header has {wide}; separate cells by commas, "
                "write decimals with a point, put texts with commas in quotes"
            )
            faults.append(Fault(message, file, at))
        else:
            rows.append((at, cells[:wide]))
    return CsvTable(top, header, rows, faults)


def csv_text(table: CsvTable) -> str:
    """Write header and rows of a table as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table.header)
    writer.writerows(cells for _, cells in table.rows)
    return text.getvalue()
