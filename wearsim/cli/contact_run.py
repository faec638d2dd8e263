"""`wearsim contact` on one operating point and on a table: validated, solved, printed, drawn."""

from __future__ import annotations

import json
import sys
from argparse import Namespace
from collections.abc import Iterator, Mapping
from pathlib import Path

from wearsim.cli.streams import formula_warning
from wearsim.errors import ContactError, Fault, SceneError
from wearsim.studies.contact_flags import COLUMNS
from wearsim.studies.contact_points import (
    PointResult,
    Request,
    bodies,
    faults_of,
    found_conditions,
    profile_faults,
    request_of,
    solve_batch,
)
from wearsim.studies.contact_table import (
    Row,
    as_json,
    as_text,
    notes,
    read_table,
    solved_rows,
    write_csv,
    write_json,
)

_FORMATS = ("png", "svg", "pdf")


def solve_and_print(arguments: Namespace) -> int:
    """Validate the flags, solve the point or the table, and print; the exit code."""
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


def _solve_point(request: Request, arguments: Namespace) -> None:
    contact, (result,) = solve_batch([request], fields=arguments.plot is not None)
    print(json.dumps({"points": [as_json(result)]}, indent=2) if arguments.json else as_text(result))
    sys.stdout.flush()  # kept even if the drawing fails
    for note in notes(result).values():
        print(f"note: {note}", file=sys.stderr)
    if arguments.plot is not None:
        from wearsim.report.figures.contact import contact_figure
        from wearsim.report.style import write_figure
        from wearsim.studies.contact_state import contact_state

        state = contact_state(found_conditions([request]), *bodies(request), contact)
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


def _solve_table(source: str, flags: Mapping[str, str], faults: list[Fault], in_json: bool) -> int:
    """Print the solution of every row as soon as it is there; the exit code is that of the worst row."""
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

    if in_json:
        write_json(results(), sys.stdout)
    else:
        formula_warning(table.text, table.name)  # other columns are carried through
        write_csv(table, flags, results(), sys.stdout)
    for first, *more in noted.values():
        rows = f" ({len(more)} more row{'s' if len(more) > 1 else ''} like it)" if more else ""
        print(f"{table.name}: note: {first}{rows}", file=sys.stderr)
    return worst
