"""`wearsim compare`: two results of any kind side by side."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import pandas as pd

from wearsim.cli import print_json
from wearsim.cli.inspect import results_in
from wearsim.errors import ResultError
from wearsim.quantities import spaced
from wearsim.report.style import plain
from wearsim.results import load_results
from wearsim.translation.side_by_side import COLUMNS, side_by_side
from wearsim.whole_files import write_whole


def execute(arguments: argparse.Namespace) -> int:
    """Print the table; write it on request."""
    paths = [_result(Path(given)) for given in (arguments.first, arguments.second)]
    names = tuple(arguments.names or names_of(*paths))
    table = side_by_side(*map(load_results, paths), names=(names[0], names[1]))
    if arguments.csv is not None:
        write_whole(Path(arguments.csv), table.to_csv(index=False))
    if arguments.json:
        print_json(table.to_dict("records"))
    else:
        print(*table_lines(table), sep="\n")
    return 0


def _result(given: Path) -> Path:
    """Return a result file, or the only one of a run directory."""
    if not given.is_dir():
        return given
    results = results_in(given)
    if len(results) > 1:
        raise ResultError(f"{given} holds two; give {' or '.join(map(str, results))}")
    return results[0]


def names_of(first: Path, second: Path) -> tuple[str, str]:
    """Names of two results: of their files, or of their folders if these are alike.

    Names of columns of the table are left out.
    """
    paths = [path.absolute() for path in (first, second)]
    for names in ([path.stem for path in paths], [path.parent.name for path in paths]):
        if names[0] != names[1] and not {*names} & {*COLUMNS}:
            return names[0], names[1]
    return "first", "second"


def table_lines(table: pd.DataFrame) -> list[str]:
    """Write a table of `side_by_side` in 100 columns."""
    first, second = table.columns[2:4]
    widths = [
        max(16, *(len(_cell(value)) + 2 for value in table[name]))
        for name in (first, second)
    ]
    lines = [
        f"{'':<40}{first[: widths[0] - 1]:>{widths[0]}}"
        f"{second[: widths[1] - 1]:>{widths[1]}}{'ratio':>8}"
    ]
    for row in table.to_dict("records"):
        unit = f" [{row['unit']}]" if row["unit"] else ""
        ratio = "" if pd.isna(row["ratio"]) else f"{row['ratio']:.3g}"
        lines.append(
            f"{row['quantity'] + unit:<40}{_cell(row[first]):>{widths[0]}}"
            f"{_cell(row[second]):>{widths[1]}}{ratio:>8}".rstrip()
        )
    return lines


def _cell(value: Any) -> str:
    if value is None or (isinstance(value, float) and pd.isna(value)):
        return "-"
    if not isinstance(value, float):
        return str(value)
    text = plain(value) if abs(value) < 1e4 else spaced(value)
    return text.replace("\N{MINUS SIGN}", "-")
