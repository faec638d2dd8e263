"""`wearsim contact`.

Contact solutions of one operating point, or of a table of them.
"""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Mapping
from pathlib import Path

from wearsim.cli import print_json
from wearsim.cli.streams import formula_warning
from wearsim.errors import ContactError, Fault, SceneError, raise_any
from wearsim.studies.contact_flags import COLUMNS
from wearsim.studies.contact_points import (
    Request,
    Result,
    conditions,
    mirrored,
    profile_faults,
    request_of,
    solve_batch,
    solve_points,
)
from wearsim.studies.contact_table import Row, as_text, notes, patch_table, read_table
from wearsim.studies.creep_curve import fitted

_FORMATS = ("png", "svg", "pdf")


def execute(arguments: Namespace) -> int:
    """Validate the flags, solve the point or the table, and print; the exit code."""
    flags = {
        column: text.strip()
        for column in COLUMNS
        if (text := getattr(arguments, column)) is not None
    }
    request, faults = request_of(flags, dashes=True)
    if arguments.plot is not None:
        faults += _plot_faults(arguments.plot, arguments.table)
    if request.conflict and arguments.table is None:
        faults.append(request.conflict)
    faults += [
        f"--{COLUMNS[column].name}: {message}"
        for column, message in profile_faults(request)
    ]
    if arguments.table is not None:
        return _solve_table(arguments, flags, [Fault(fault) for fault in faults])
    if faults:
        raise SceneError([Fault(fault) for fault in faults])
    _solve_point(mirrored(request) if arguments.mirror else request, arguments)
    return 0


def _solve_point(request: Request, arguments: Namespace) -> None:
    contact, (result,) = solve_batch([request], fields=arguments.plot is not None)
    if arguments.json:
        print_json({"points": [result]})
    else:
        print(as_text(request, result))
    sys.stdout.flush()  # kept even if the drawing fails
    for note in notes(request, result).values():
        print(f"note: {note}", file=sys.stderr)
    if arguments.plot is not None:
        from wearsim.report.figures.contact import contact_figure
        from wearsim.report.style import write_figure
        from wearsim.studies.contact_state import contact_state

        state = contact_state(conditions([request])[0], *request.problem[:2], contact)
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


def _solve_table(
    arguments: Namespace, flags: Mapping[str, str], faults: list[Fault]
) -> int:
    """Print the solutions of all rows; the exit code is that of the worst row."""
    try:
        table = read_table(arguments.table, {} if faults else flags)
    except SceneError as error:
        raise SceneError([*faults, *error.faults]) from None
    raise_any(faults)
    points = [
        row._replace(request=mirrored(row.request)) if arguments.mirror else row
        for row in table.rows
    ]
    for warning in table.warnings:
        print(f"{table.name}: {warning}", file=sys.stderr)
    worst, solved = 0, list[tuple[Row, Result]]()
    noted: dict[str, list[str]] = {}
    for row, result in zip(
        points, solve_points([row.request for row in points]), strict=True
    ):
        if isinstance(result, ContactError):
            worst = max(worst, result.exit_code)
            print(Fault(str(result), table.name, row.line), file=sys.stderr)
            continue
        solved.append((row, result))
        for kind, note in notes(row.request, result).items():
            noted.setdefault(kind, []).append(f"line {row.line}: {note}")
    curve = None
    if table.traction is not None and worst == 0:
        curve = fitted([row.request for row in points], table.traction)
    if arguments.json:
        lines = [
            {"line": row.line, "columns": row.carried} | result
            for row, result in solved
        ]
        fit = {} if curve is None else {"creep_curve": curve._asdict()}
        print_json({"points": lines} | fit)
    else:
        patches = patch_table(solved, table.columns, flags)
        text = patches.to_csv(index=False, float_format="%.12g", lineterminator="\n")
        formula_warning(text, table.name)  # other columns are carried through
        sys.stdout.write(text)
    if curve is not None:
        print(f"{table.name}: fitted creep curve: {curve.text}", file=sys.stderr)
    for first, *more in noted.values():
        rows = (
            f" ({len(more)} more row{'s' if len(more) > 1 else ''} like it)"
            if more
            else ""
        )
        print(f"{table.name}: note: {first}{rows}", file=sys.stderr)
    return worst
