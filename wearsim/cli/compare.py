"""`wearsim compare`: two results of any kind side by side."""

from __future__ import annotations

import argparse
from collections.abc import Hashable, Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from wearsim.cli import print_json
from wearsim.cli.inspect import result_in
from wearsim.quantities import NOT_IN_SIGHT
from wearsim.report.style import band_text, estimates, in_terminal, plain
from wearsim.results import load_results
from wearsim.texts import wrapped
from wearsim.translation.side_by_side import (
    band_of,
    is_column,
    not_reprofiled,
    side_by_side,
)
from wearsim.whole_files import write_whole

_NAMES = 40  # least width of the column of quantities
_DRAWN = "  90 %"  # of the draws, name of the row of the bands


def execute(arguments: argparse.Namespace) -> int:
    """Print the table; write it on request."""
    paths = [result_in(Path(given)) for given in (arguments.first, arguments.second)]
    names = tuple(arguments.names or names_of(*paths))
    table = side_by_side(*map(load_results, paths), names=(names[0], names[1]))
    if arguments.csv is not None:
        write_whole(Path(arguments.csv), table.to_csv(index=False))
    if arguments.json:
        print_json(table.to_dict("records"))
    else:
        print(*table_lines(table), sep="\n")
    return 0


def names_of(first: Path, second: Path) -> tuple[str, str]:
    """Names of two results: of their files, or of their folders if these are alike.

    Names of columns of the table are left out.
    """
    paths = [path.absolute() for path in (first, second)]
    for names in ([path.stem for path in paths], [path.parent.name for path in paths]):
        if names[0] != names[1] and not any(map(is_column, names)):
            return names[0], names[1]
    return "first", "second"


def table_lines(table: pd.DataFrame) -> list[str]:
    """Write a table of `side_by_side` in 100 columns, below each row its bands."""
    names = [*table.columns[2:4], "ratio"]
    rows: list[list[str]] = [["", *names]]
    for row in table.to_dict("records"):
        unit = f" [{row['unit']}]" if row["unit"] else ""
        ratio = "" if pd.isna(row["ratio"]) else in_terminal(plain(row["ratio"], 3))
        values = [_cell(row[name]) for name in names[:2]]
        rows.append([row["quantity"] + unit, *values, ratio])
        bands = [_band(row, name) for name in names]
        if any(bands):
            rows.append([_DRAWN, *bands])
    # the first column of a band has the room of the names, too
    first = max(16, *(len(row[1]) + 2 for row in rows[1:] if row[0] != _DRAWN))
    second, third = (
        max(least, *(len(row[k]) + 2 for row in rows[1:]))
        for k, least in ((2, 16), (3, 8))
    )
    lines, longest = [], max(_NAMES, *(1 + len(row[0]) for row in rows))
    for name, *cells in rows:
        place = len(_DRAWN) if name == _DRAWN else longest
        widths = (longest - place + first, second, third)
        values = [
            f"{cell[: width - 1]:>{width}}"
            for cell, width in zip(cells, widths, strict=True)
        ]
        lines.append("".join([f"{name:<{place}}", *values]).rstrip())
    return [*lines, *map(wrapped, not_reprofiled(table))]


def _band(row: Mapping[Hashable, Any], name: str) -> str:
    """Write the ends of the band of a number, "" where there is none or no width."""
    ends = band_of(row, name)
    if ends is None:
        return ""
    low, high = estimates(ends)
    if low == high and low != NOT_IN_SIGHT:
        return ""
    return in_terminal(band_text(ends))


def _cell(value: Any) -> str:
    if value is None or (isinstance(value, float) and pd.isna(value)):
        return "-"
    if not isinstance(value, float):
        return str(value)
    return in_terminal(plain(value))
