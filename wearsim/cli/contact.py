"""`wearsim contact`.

Contact solutions of one operating point, or of a table of them.
"""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from wearsim.cli import print_json
from wearsim.cli.match import match_faults, print_match
from wearsim.cli.streams import formula_warning
from wearsim.errors import Fault, SceneError, raise_any
from wearsim.studies.contact_flags import COLUMNS
from wearsim.studies.contact_noise import noise_notes
from wearsim.studies.contact_points import (
    Points,
    conditions,
    conflicts,
    mirrored,
    operating_points,
    problem_of,
    profile_faults,
    solve_batch,
    solve_points,
)
from wearsim.studies.contact_table import (
    as_records,
    as_text,
    notes,
    patch_csv,
    read_table,
)
from wearsim.studies.creep_curve import fitted

_FORMATS = ("png", "svg", "pdf")


def execute(arguments: Namespace) -> int:
    """Validate the flags, solve the point or the table, and print; the exit code."""
    flags = {
        column: text.strip()
        for column in COLUMNS
        if (text := getattr(arguments, column)) is not None
    }
    points, wrong = operating_points(pd.DataFrame([flags], dtype=object), dashes=True)
    faults = [text for _, text in wrong]
    if arguments.plot is not None:
        faults += _plot_faults(arguments.plot, arguments.table)
    faults += match_faults(arguments)
    if arguments.table is None:
        faults += [text for _, text in conflicts(points)]
    faults += [
        f"--{COLUMNS[column].name}: {message}"
        for _, column, message in profile_faults(points)
    ]
    if arguments.table is not None:
        return _solve_table(arguments, flags, [Fault(fault) for fault in faults])
    raise_any([Fault(fault) for fault in faults])
    points = mirrored(points) if arguments.mirror else points
    if arguments.match is not None:
        print_match(points.values, arguments)
    else:
        _solve_point(points, arguments)
    return 0


def _solve_point(points: Points, arguments: Namespace) -> None:
    values = points.values
    contact, solution = solve_batch(values, fields=arguments.plot is not None)
    if arguments.json:
        print_json({"points": list(as_records(solution).values())})
    else:
        print(as_text(points, solution))
    sys.stdout.flush()  # kept even if the drawing fails
    for _, note in notes(points, solution) + noise_notes(points, solution):
        print(f"note: {note}", file=sys.stderr)
    if arguments.plot is not None:
        from wearsim.report.figures.contact import contact_figure
        from wearsim.report.style import write_figure
        from wearsim.studies.contact_state import contact_state

        state = contact_state(conditions(values)[0], *problem_of(values)[:2], contact)
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
    if arguments.mirror:
        table = table._replace(points=mirrored(table.points))
    for warning in table.warnings:
        print(f"{table.name}: {warning}", file=sys.stderr)
    solution = solve_points(table.points)
    for line, reason in solution.errors.items():
        print(Fault(str(reason), table.name, line), file=sys.stderr)
    curve = None
    if table.traction is not None and not solution.errors:
        curve = fitted(table.points, table.traction)
    if arguments.json:
        carried = table.carried.to_dict("index")
        records = as_records(solution).items()
        lined = [{"line": k, "columns": carried[k]} | record for k, record in records]
        fit = {} if curve is None else {"creep_curve": curve._asdict()}
        print_json({"points": lined} | fit)
    else:
        text = patch_csv(table, solution, flags)
        formula_warning(text, table.name)  # other columns are carried through
        sys.stdout.write(text)
    if curve is not None:
        print(f"{table.name}: fitted creep curve: {curve.text}", file=sys.stderr)
    line_notes = notes(table.points, solution) + noise_notes(table.points, solution)
    for lines, note in line_notes:
        more = f"{len(lines) - 1} more row{'s' if len(lines) > 2 else ''}"
        others = f" ({more} like it)" if len(lines) > 1 else ""
        print(f"{table.name}: note: line {lines[0]}: {note}{others}", file=sys.stderr)
    return max((reason.exit_code for reason in solution.errors.values()), default=0)
