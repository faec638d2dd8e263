"""`wearsim contact`: contact solutions of one operating point, or of a table of them."""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from wearsim.cli import Commands, add_command, add_renamed
from wearsim.studies.contact_flags import COLUMNS, FLAGS

if TYPE_CHECKING:
    from wearsim.errors import Fault
    from wearsim.studies.contact_points import PointResult, Request
    from wearsim.studies.contact_table import Row

_FORMATS = ("png", "svg", "pdf")

_ABOUT_TABLES = """\
Tables: a CSV file with a header, columns named like the flags (shift_mm, yaw_mrad, roll, creepage, ...), one
row per operating point. An empty cell takes the flag's value; other columns are carried through. What a row
gives goes before the flags. Nothing is computed before the whole table is free of faults; a row whose contact
has no solution is named on stderr, the others are printed, the exit code is 2 (3 if a computation failed).
The output holds one line per patch and is a table for this command again: lines of further patches of a
wheel (patch 2, 3, ...) are then left out.
"""

_EXAMPLES = """\
wearsim contact --wheel S1002 --rail 60E1 --inclination 1:40 --shift-mm 3
wearsim contact --shift-mm 3 --roller-radius-mm 1000 --json
wearsim contact --shift-mm 3 --yaw-mrad 2 --side both
wearsim contact --shift-mm 3 --creepage=-0.0016,0,-0.197
wearsim contact --shift-mm 5 --plot contact.png
wearsim contact --table points.csv --roller-radius-mm 500 > solved.csv"""


def add_parser(commands: Commands) -> None:
    """Add the command."""
    parser = add_command(
        commands,
        "contact",
        "solve the contact of one or both wheels with rail or roller, at one operating point or a table of "
        "them",
        _EXAMPLES,
    )
    # argparse takes only plain negative numbers for values, neither -1e-3 nor -0.001,0,0.2
    parser._negative_number_matcher = re.compile(r"-\.?\d")
    parser.epilog = f"{_ABOUT_TABLES}\n{parser.epilog}"
    groups: dict[str, argparse._ArgumentGroup] = {}
    for flag in FLAGS:
        if flag.group not in groups:
            groups[flag.group] = parser.add_argument_group(flag.group)
        default = "" if flag.default is None else f" (default {flag.default})"
        groups[flag.group].add_argument(
            f"--{flag.name}", metavar="X", dest=flag.column, default=None, help=flag.meaning + default
        )
    add_renamed(parser, {"--flange-back-mm": "--back-to-back-mm"})
    output = parser.add_argument_group("tables and output")
    output.add_argument("--table", metavar="CSV", help="solve every row of a table, - for stdin; prints CSV")
    output.add_argument("--json", action="store_true", help="print JSON, SI units")
    output.add_argument("--plot", metavar="FILE", help="draw the contact of one point: .png, .svg or .pdf")


def execute(arguments: argparse.Namespace) -> int:
    """Solve and print."""
    from wearsim.errors import Fault, SceneError
    from wearsim.studies.contact_points import faults_of, profile_faults, request_of

    flags = {column: text.strip() for column in COLUMNS if (text := getattr(arguments, column)) is not None}
    request, wrong = request_of(flags)
    faults = faults_of(flags, wrong, as_flags=True)
    if arguments.plot is not None:
        faults += _plot_faults(arguments.plot, arguments.table)
    if request.conflict and arguments.table is None:
        faults.append(request.conflict)
    faults += [f"--{column}: {message}" for column, message in profile_faults(request)]
    if arguments.table is not None:
        right = {column: text for column, text in flags.items() if column not in wrong}
        return _solve_table(arguments.table, right, [Fault(fault) for fault in faults], arguments.json)
    if faults:
        raise SceneError([Fault(fault) for fault in faults])
    _solve_point(request, arguments)
    return 0


def _solve_point(request: Request, arguments: argparse.Namespace) -> None:
    import json
    import sys

    from wearsim.studies.contact_points import bodies, conditions, solve_batch
    from wearsim.studies.contact_table import as_json, as_text, notes

    contact, (result,) = solve_batch([request], fields=arguments.plot is not None)
    print(json.dumps({"points": [as_json(result)]}, indent=2) if arguments.json else as_text(result))
    sys.stdout.flush()  # kept even if the drawing fails
    for note in notes(result).values():
        print(f"note: {note}", file=sys.stderr)
    if arguments.plot is not None:
        from wearsim.report.figures.contact import contact_figure
        from wearsim.report.style import write_figure
        from wearsim.studies.contact_state import contact_state

        state = contact_state(conditions([request]), *bodies(request), contact)
        write_figure(contact_figure(state), Path(arguments.plot))


def _plot_faults(plot: str, table: str | None) -> list[str]:
    faults = []
    if table is not None:
        faults.append("--plot and --table exclude each other; draw one point at a time")
    if Path(plot).suffix[1:].lower() not in _FORMATS:
        faults.append(f"--plot = {plot} must end with .{', .'.join(_FORMATS)}")
    if not Path(plot).parent.is_dir():
        faults.append(f"--plot = {plot}: the folder does not exist; make it first")
    return faults


def _solve_table(source: str, flags: Mapping[str, str], faults: list[Fault], as_json: bool) -> int:
    """Print the solution of every row as soon as it is there; the exit code is that of the worst row."""
    import sys

    from wearsim.errors import ContactError, Fault, SceneError
    from wearsim.studies.contact_table import notes, read_table, solved_rows, write_csv, write_json

    try:
        table = read_table(source, flags)
    except SceneError as error:
        raise SceneError([*faults, *error.faults]) from None
    if faults:
        raise SceneError(faults)
    for warning in table.warnings:
        print(f"{table.name}: {warning}", file=sys.stderr)
    worst = 0
    noted: dict[str, list[str]] = {}

    def results() -> Iterator[tuple[Row, PointResult]]:
        nonlocal worst
        for row, result in solved_rows(table, flags):
            if isinstance(result, ContactError):
                worst = max(worst, result.exit_code)
                print(Fault(str(result), table.name, row.line), file=sys.stderr)
                continue
            for kind, note in notes(result).items():
                noted.setdefault(kind, []).append(f"line {row.line}: {note}")
            yield row, result

    if as_json:
        write_json(results(), sys.stdout)
    else:
        write_csv(table, flags, results(), sys.stdout)
    for first, *more in noted.values():
        rows = f" ({len(more)} more row{'s' if len(more) > 1 else ''} like it)" if more else ""
        print(f"{table.name}: note: {first}{rows}", file=sys.stderr)
    return worst
