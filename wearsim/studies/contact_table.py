"""Tables of `wearsim contact`: operating points in, one line per patch out, and JSON in SI units."""

from __future__ import annotations

import csv
import difflib
import io
import itertools
import json
import math
import sys
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple, TextIO

from wearsim.errors import LONGEST_ECHO, ContactError, Fault, SceneError
from wearsim.profile.conicity import flange_clearance
from wearsim.profile.files import is_file
from wearsim.profile.inspection.inputs import placement_notes, read_input
from wearsim.quantities import QUANTITIES
from wearsim.studies.contact_flags import COLUMNS
from wearsim.studies.contact_points import (
    PATCH_NAMES,
    PointResult,
    faults_of,
    profile_faults,
    rail_profile,
    request_of,
    solve_points,
    texts_of,
    wheel_profile,
)
from wearsim.toml_faults import LARGEST_TABLE, content_of, of_at_most, text_of

_WINDOW = 64
"""Rows of a table solved and written together; besides the text of the table, only they are in memory."""

_MOST_FAULTS = 1000  # then reading stops
_LONGEST_LINE = 1_000_000  # characters; longer ones are no table of operating points
_LOWER = {name.lower(): known for known, flag in COLUMNS.items() for name in (known, flag.field)}
_CREEPAGES = ("creepage_x", "creepage_y", "spin")
_PRINTED = (
    # column, name, factor to the shown unit, format
    ("wheel y [mm]", "wheel_y", 1e3, ".3f"),
    ("angle [mrad]", "contact_angle", 1e3, ".2f"),
    ("load [kN]", "normal_force", 1e-3, ".3f"),
    ("area [mm2]", "area", 1e6, ".1f"),
    ("pressure [MPa]", "max_pressure", 1e-6, ".0f"),
    ("creepage x", "creepage_x", 1.0, ".3e"),
    ("creepage y", "creepage_y", 1.0, ".3e"),
    ("spin [1/m]", "spin", 1.0, ".4f"),
    ("Fx [kN]", "force_x", 1e-3, ".3f"),
    ("Fy [kN]", "force_y", 1e-3, ".3f"),
    ("power [W]", "power", 1.0, ".1f"),
)
_ENDINGS = {
    "mm": "_mm", "mm²": "_mm2", "1/m": "_per_m", "mrad": "_mrad", "rad/s": "_rad_per_s", "kN": "_kN",
    "N m": "_Nm", "MPa": "_MPa", "W": "_W", "µm": "_um",
}  # fmt: skip
_RENAMED = {"normal_force_kN": "patch_normal_force_kN"}  # the first is a flag

_PLASTIC = 4e9
"""Maximum pressure [Pa] above which an elastic contact does not hold: a surface is fully plastic at a mean
pressure of 2.8 times the yield stress (K. L. Johnson, Contact Mechanics, 1985, 6.3,
doi:10.1017/CBO9781139171731), in an ellipse two thirds of the maximum; with 0.95 GPa, high for wheel and rail
steel, that is 4 GPa."""


def _column(name: str) -> tuple[str, float]:
    """Name of a result with its unit, and the factor from SI."""
    quantity = QUANTITIES[name]
    if quantity.shown_unit not in _ENDINGS:  # ratios, also those shown in thousandths
        return name, 1.0
    column = name + _ENDINGS[quantity.shown_unit]
    return _RENAMED.get(column, column), quantity.shown_factor


_ROTATION, _ROTATION_FACTOR = _column("rotation_speed")
_PATCH = tuple((name, *_column(name)) for name in PATCH_NAMES)

RESULT_COLUMNS = ("table_line", "patch", _ROTATION, *(column for _, column, _ in _PATCH))
"""Columns that follow those of the table; none is the name of a flag, so that output can be input again."""


class Row(NamedTuple):
    """One row: its line, the texts of its flags that are not empty, and its other columns."""

    line: int
    given: dict[str, str]
    carried: dict[str, str]


class Table(NamedTuple):
    """A table without faults: its name for the user, its text, its columns, and warnings on it."""

    name: str
    text: str
    columns: tuple[str, ...]
    warnings: list[str]

    def rows(self) -> Iterator[Row]:
        """Give the rows to solve one after the other, so that they are never all in memory."""
        records = (item for item in _records(self.name, self.text) if any(cell.strip() for cell in item[1]))
        next(records)  # the header
        for line, cells in records:
            record = dict(zip(self.columns, cells, strict=False))
            if not _is_further(record):
                yield _row(line, record)


def read_table(source: str, flags: Mapping[str, str]) -> Table:
    """Read a whole table from a CSV file, or - for standard input, and check it.

    Its rows are merged into the texts of the flags, which are by column and without faults. SceneError holds
    all faults, each with its line.
    """
    name, text = _text(source)
    columns: tuple[str, ...] = ()
    faults, broken, empty = list[Fault](), list[Fault](), list[int]()
    rows, further = 0, 0
    seen: set[tuple[object, ...]] = set()
    try:
        for line, cells in _records(name, text):
            record = dict(zip(columns, cells, strict=False))
            if not any(cell.strip() for cell in cells):
                empty += [line] if columns else []
            elif not columns:
                columns = _header(name, line, cells)
            elif _is_further(record):
                further += 1
            else:
                rows += 1
                wrong = _row_faults(columns, _row(line, record), cells, flags, seen)
                faults += [Fault(fault, name, line) for fault in wrong]
                if len(faults) >= _MOST_FAULTS:
                    break
    except SceneError as error:
        broken = [*error.faults]
    else:
        if rows == 0:
            missing = "only a header" if columns else "nothing"
            broken = [Fault(f"holds {missing}; give a header with flags and a row per point", name)]
    if faults or broken:
        raise SceneError([*faults, *broken])
    warnings = list(_warnings(columns))
    if further:
        warnings.append(f"{further} lines of further patches (column patch above 1) are left out")
    if empty:
        listed = f"{len(empty)} rows of empty cells are left out, the first is line {empty[0]}"
        warnings.append(f"{listed}; a row of defaults needs one value")
    return Table(name, text, columns, warnings)


def _text(source: str) -> tuple[str, str]:
    """Name for messages, and text with plain ends of lines."""
    name = "stdin" if source == "-" else source
    try:
        if Path(source).is_dir():
            raise SceneError([Fault("is a folder, not a table; give a CSV file", source)])
        if source == "-":
            content = of_at_most(sys.stdin.buffer.read(LARGEST_TABLE + 1), LARGEST_TABLE, "fewer rows", name)
        else:
            content = content_of(Path(source), "a CSV file, or - for stdin", LARGEST_TABLE)
    except OSError as error:
        raise SceneError([Fault(f"cannot be read ({error.strerror}); give a CSV file", name)]) from None
    text = text_of(content, name)
    if "\0" in text:
        line = text[: text.index("\0")].count("\n") + 1
        raise SceneError([Fault("holds zero bytes; save the table as CSV in UTF-8", name, line)])
    return name, text


def _is_further(record: Mapping[str, str]) -> bool:
    """Whether a row is the second or a later patch of a point in the output of an earlier run."""
    patch = record.get("patch", "").strip()
    return "table_line" in record and patch.isdecimal() and int(patch) > 1


def _row(line: int, record: Mapping[str, str]) -> Row:
    given = {column: cell.strip() for column, cell in record.items() if column in COLUMNS and cell.strip()}
    known = {*COLUMNS, *RESULT_COLUMNS}
    return Row(line, given, {column: cell for column, cell in record.items() if column not in known})


def _row_faults(
    columns: tuple[str, ...],
    row: Row,
    cells: list[str],
    flags: Mapping[str, str],
    seen: set[tuple[object, ...]],
) -> list[str]:
    """All that is wrong with one row; faults of profiles only at the first row that uses them."""
    if len(cells) < len(columns) or any(cell.strip() for cell in cells[len(columns) :]):
        return [f"{len(cells)} cells, the header has {len(columns)}; quote cells that hold commas"]
    request, wrong = request_of(flags, row.given)
    faults = faults_of(row.given, wrong, as_flags=False)
    profiles = (request.wheel, request.left_wheel, *request.placed_rail)
    if profiles not in seen:
        new = [fault for fault in profile_faults(request) if fault not in seen]
        faults += map(": ".join, new)
        seen |= {profiles, *new}
    return faults + ([request.conflict] if request.conflict else [])


def _header(name: str, line: int, cells: list[str]) -> tuple[str, ...]:
    """Names of the columns; empty ones at the end, as spreadsheets leave them, do not count."""
    columns = [cell.strip() for cell in cells]
    while columns and not columns[-1]:
        columns.pop()
    for mark, called in ((";", "semicolons"), ("\t", "tabs")):
        if len(columns) == 1 and mark in " ".join(cells):
            fix = "save the table with commas between columns and points as decimal marks"
            raise SceneError([Fault(f"columns are separated by {called}; {fix}", name, line)])
    faults = [f"column {k} has no name" for k, column in enumerate(columns, 1) if not column]
    twice = sorted({column for column in columns if column and columns.count(column) > 1})
    faults += [f"column {_short(column)} stands there more than once; keep one" for column in twice]
    if "flange_back_mm" in columns:
        faults.append("column flange_back_mm has a new name; write back_to_back_mm")
    elif not any(column in COLUMNS for column in columns):
        message = "no column has the name of a flag, such as shift_mm, yaw_mrad or wheel_load_kN"
        near = [hint for column in columns if (hint := _nearest(column))]
        faults.append(message + (f"; did you mean {', '.join(near[:5])}?" if near else ""))
    if faults:
        raise SceneError([Fault(fault, name, line) for fault in faults])
    return tuple(columns)


def _short(text: str) -> str:
    """Name of a column as it fits into a line."""
    return " ".join(text.split())[:LONGEST_ECHO]


def _nearest(column: str) -> str | None:
    """Flag that a column was probably meant to be, by its name with or without the unit."""
    plain = column.strip("-").replace("-", "_").replace(" ", "_").lower()
    if plain in _LOWER:
        return _LOWER[plain]
    near = difflib.get_close_matches(plain, [known.lower() for known in COLUMNS], n=1, cutoff=0.75)
    return _LOWER[near[0]] if near else None


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
            message = f"column {_short(column)} is not a flag of wearsim and is carried through"
            yield f"{message}; did you mean {near}?"


def _records(name: str, text: str) -> Iterator[tuple[int, list[str]]]:
    """Line and cells of each record that holds anything, be it empty cells."""

    def lines() -> Iterator[str]:
        for number, line in enumerate(io.StringIO(text), 1):
            if len(line) > _LONGEST_LINE:
                raise SceneError([Fault("is too long a line for a table of operating points", name, number)])
            yield line

    start = 1
    reader = csv.reader(lines(), strict=True, skipinitialspace=True)
    try:
        for cells in reader:
            if len(cells) > 1 or any(cell.strip() for cell in cells):
                yield start, cells
            start = reader.line_num + 1
    except csv.Error as error:
        message = f"is not well-formed CSV ({error}); quotes within a quoted cell are doubled"
        raise SceneError([Fault(message, name, start)]) from None


def result_cells(result: PointResult, line: int) -> list[dict[str, str]]:
    """Cells of each patch: the side and roll that were solved, and `RESULT_COLUMNS`."""
    rows: list[dict[str, str]] = []
    speed = result.rotation_speed
    for patch in result.patches:
        number = 1 + sum(row["side"] == patch["side"] for row in rows)
        cells = {"side": patch["side"], "roll": _cell(result.roll * 1e3)}
        cells |= {"table_line": str(line), "patch": str(number)}
        cells[_ROTATION] = "" if speed is None else _cell(speed * _ROTATION_FACTOR)
        rows.append(cells | {column: _cell(patch[name] * factor) for name, column, factor in _PATCH})
    return rows


def _cell(value: float) -> str:
    """Twelve digits: far beyond any tolerance, without the noise of the change of units."""
    return format(value, ".12g")


def as_json(
    result: PointResult, line: int | None = None, carried: Mapping[str, str] | None = None
) -> dict[str, Any]:
    """JSON value of a point, SI units; of a row of a table with its line and the carried columns."""
    request = result.request
    row = {} if line is None else {"line": line, "columns": dict(carried or {})}
    models = {"normal": request.normal, "tangential": request.tangential}
    return {
        "shift": result.shift,
        "yaw": request.yaw,
        "roll": result.roll,
        "wheel_load": request.load if request.normal_force is None else None,
        "counterface_curvature": request.counterface_curvature,
        "rotation_speed": result.rotation_speed,
        **({"wheelset": result.wheelset} if result.wheelset else {}),
        **row,
        "patches": [patch | models for patch in result.patches],
    }


def as_text(result: PointResult) -> str:
    """Table of the patches for people."""
    rows = [["side", *(title for title, *_ in _PRINTED)]]
    for patch in result.patches:
        rows.append([patch["side"], *(format(patch[name] * f, style) for _, name, f, style in _PRINTED)])
    width = [max(len(title), 10) for title in rows[0][1:]]
    lines = [
        f"{side:5}  " + "  ".join(cell.rjust(w) for cell, w in zip(cells, width, strict=True))
        for side, *cells in rows
    ]
    request, speed, count = result.request, result.rotation_speed, len(result.patches)
    kappa = request.counterface_curvature
    against = "rail" if kappa == 0.0 else f"roller of {1e3 / kappa:g} mm"
    who = "both wheels" if request.side == "both" else f"{request.side} wheel"
    rotation = "creepages given" if speed is None else f"rotation {speed:.4f} rad/s"
    if speed is not None and isinstance(request.rule, str):
        rotation += f" ({request.rule})"
    roll = f"roll {result.roll * 1e3:.4f} mrad" + (" (free)" if request.free_roll else "")
    lines.append(f"{who} on {against}, {count} patch{'' if count == 1 else 'es'}; {rotation}; {roll}")
    if forces := result.wheelset:
        lines.append(
            f"shift {1e3 * result.shift:.4f} mm, lateral force H {1e-3 * forces['lateral_force']:.3f} kN at "
            f"axle height, Y/Q {forces['derailment_quotient_right']:.3f} right and "
            f"{forces['derailment_quotient_left']:.3f} left, steering moment "
            f"{1e-3 * forces['steering_moment']:.3f} kN m, wear number {forces['axle_wear_number']:.1f} N"
        )
    lines.append(f"{request.normal}, {request.tangential}; forces act on the wheel")
    return "\n".join(lines)


def notes(result: PointResult) -> dict[str, str]:
    """Warnings on one solved point, by kind.

    On a measured rail, a wheel that climbs its flange, pressures no steel carries, and a roller that runs in
    a curve.
    """
    request, lines = result.request, {}
    stand = _stand(request.rail, request.inclination)
    if stand is not None:
        lines["measured rail"] = f"{request.rail}: {stand}"
    free = _clearance(request.smoothed_wheel, request.placed_rail)
    towards = {"right": result.shift, "left": -result.shift}
    climbing = [patch["side"] for patch in result.patches if towards[patch["side"]] > free]
    if climbing:
        lines["flange clearance"] = (
            f"shift {1e3 * result.shift:.6g} mm is beyond the flange clearance of {1e3 * free:.3g} mm: the "
            f"{climbing[0]} wheel climbs its flange, which a wheelset in service does only while it derails"
        )
    highest = max(patch["max_pressure"] for patch in result.patches)
    if highest > _PLASTIC:
        lines["pressure"] = (
            f"maximum pressure {1e-9 * highest:.3g} GPa: wheel and rail steel yields far below "
            f"{1e-9 * _PLASTIC:g} GPa, and an elastic contact does not hold; check load and profiles"
        )
    if request.track_curvature != 0.0 and request.counterface_curvature > 0.0:
        lines["curve"] = (
            "a curve radius on a roller stands for rollers of both sides that rotate at different speeds"
        )
    return lines


@lru_cache(maxsize=64)
def _clearance(smoothed_wheel: Any, placed_rail: Any) -> float:
    """Flange clearance, infinite where it is not known."""
    free = flange_clearance(wheel_profile(*smoothed_wheel), rail_profile(*placed_rail))
    return math.inf if free is None else free


@lru_cache(maxsize=64)
def _stand(rail: str, inclination: float) -> str | None:
    """How a measured rail is put into the track, None for standard shapes."""
    lines = placement_notes(read_input(rail, "rail"), inclination) if is_file(rail) else ()
    return lines[0] if lines else None


def solved_rows(table: Table, flags: Mapping[str, str]) -> Iterator[tuple[Row, PointResult | ContactError]]:
    """Rows with their solutions, or why they have none; solved a window at a time."""
    rows = table.rows()
    while window := list(itertools.islice(rows, _WINDOW)):
        requests = [request_of(flags, row.given)[0] for row in window]
        yield from zip(window, solve_points(requests), strict=True)


def write_csv(
    table: Table, flags: Mapping[str, str], results: Iterator[tuple[Row, PointResult]], stream: TextIO
) -> None:
    """Write a line per patch: what was given, and `RESULT_COLUMNS`."""
    # flags given with the table become columns, too: the output holds all that was not a default
    stated = ("side", "roll", "normal", "tangential")
    kept = [column for column in table.columns if column not in RESULT_COLUMNS]  # not of an earlier run
    columns = list(dict.fromkeys([*kept, *flags, *stated, *RESULT_COLUMNS]))
    writer = csv.DictWriter(stream, columns, restval="", extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    for row, result in results:
        given = texts_of(flags, row.given) | row.carried
        writer.writerows(given | cells for cells in result_cells(result, row.line))
        stream.flush()


def write_json(results: Iterator[tuple[Row, PointResult]], stream: TextIO) -> None:
    """Write all points as one JSON value."""
    between = "\n"
    stream.write('{"points": [')
    for row, result in results:
        stream.write(between + json.dumps(as_json(result, row.line, row.carried)))
        between = ",\n"
    stream.write("\n]}\n")
