"""Tables of `wearsim contact`.

Operating points in, one line per patch out, and JSON in SI units.
"""

from __future__ import annotations

import difflib
import math
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from wearsim.contact.patch import FloatArray
from wearsim.csv_tables import CsvTable, csv_table
from wearsim.errors import LONGEST_ECHO, Fault, SceneError, raise_any
from wearsim.profile.conicity import flange_clearance
from wearsim.profile.files import is_file
from wearsim.profile.inspection.inputs import placement_notes, read_input
from wearsim.quantities import QUANTITIES
from wearsim.studies.contact_flags import COLUMNS, FLAGS
from wearsim.studies.contact_points import (
    PATCH_NAMES,
    Request,
    Result,
    profile_faults,
    profile_of,
    request_of,
)
from wearsim.studies.creep_curve import MEASURED, curve_fault, row_faults
from wearsim.texts import text_table
from wearsim.toml_faults import (
    LARGEST_TABLE,
    content_of,
    decimal,
    of_at_most,
    text_of,
)

_MOST_FAULTS = 1000  # then reading stops
_LOWER = {
    name.lower(): flag.column
    for field, flag in FLAGS.items()
    for name in (flag.column, field)
}
_CREEPAGES = ("creepage_x", "creepage_y", "spin")
_ENDINGS = {
    "mm": "_mm",
    "mm²": "_mm2",
    "1/m": "_per_m",
    "mrad": "_mrad",
    "rad/s": "_rad_per_s",
    "kN": "_kN",
    "N m": "_Nm",
    "kN m": "_kN_m",
    "N": "_N",
    "MPa": "_MPa",
    "W": "_W",
    "µm": "_um",
}
_RENAMED = {"normal_force_kN": "patch_normal_force_kN"}  # the first is a flag

_PLASTIC = 4e9
"""Maximum pressure [Pa] above which an elastic contact does not hold: a surface is
fully plastic at a mean pressure of 2.8 times the yield stress (K. L. Johnson, Contact
Mechanics, 1985, 6.3, doi:10.1017/CBO9781139171731), in an ellipse two thirds of the
maximum; with 0.95 GPa, high for wheel and rail steel, that is 4 GPa.
"""


def _column(name: str) -> tuple[str, float]:
    """Name of a result with its unit, and the factor from SI."""
    quantity = QUANTITIES[re.sub("_(right|left)$", "", name)]
    if quantity.shown_unit not in _ENDINGS:  # ratios, also those shown in thousandths
        return name, 1.0
    column = name + _ENDINGS[quantity.shown_unit]
    return _RENAMED.get(column, column), quantity.shown_factor


_ROTATION, _ROTATION_FACTOR = _column("rotation_speed")
_PATCH = tuple((name, *_column(name)) for name in PATCH_NAMES)

RESULT_COLUMNS = (
    "table_line",
    "patch",
    _ROTATION,
    *(column for _, column, _ in _PATCH),
)
"""Columns that follow those of the table; none is the name of a flag, so that output
can be input again.
"""


class Row(NamedTuple):
    """One row: its line, its columns that are no flags, and its point."""

    line: int
    carried: dict[str, str]
    request: Request


class Table(NamedTuple):
    """A table without faults.

    Its name for the user, its columns, its rows, and warnings on it.
    """

    name: str
    columns: tuple[str, ...]
    rows: list[Row]
    warnings: list[str]

    @property
    def traction(self) -> FloatArray | None:
        """Measured traction coefficients (n,) of a creep curve [-], if it is one."""
        if MEASURED not in self.columns:
            return None
        return np.array([decimal(row.carried[MEASURED]) for row in self.rows])


def read_table(source: str, flags: Mapping[str, str]) -> Table:
    """Read a table from a CSV file, or - for standard input, and check it.

    Its rows are merged into the texts of the flags, which are by column and without
    faults. SceneError holds all faults, each with its line.
    """
    name = "stdin" if source == "-" else source
    table = csv_table(_text(name, source), name)
    table = table._replace(header=[" ".join(column.split()) for column in table.header])
    columns = _checked(name, table)
    carried = [
        column for column in columns if column not in (*COLUMNS, *RESULT_COLUMNS)
    ]
    rows, faults, seen = list[Row](), list(table.faults), set[tuple[str, str]]()
    for line, cells in table.rows:
        values = dict(zip(columns, cells, strict=True))
        if "table_line" not in values or values.get("patch", "1") in (
            "",
            "1",
        ):  # else a further patch
            request, wrong = _point_of(flags, values)
            rows.append(
                Row(line, {column: values[column] for column in carried}, request)
            )
            new = [fault for fault in profile_faults(request) if fault not in seen]
            seen.update(new)
            texts = [*wrong, *map(": ".join, new), request.conflict]
            faults += [Fault(text, name, line) for text in texts if text]
        if len(faults) >= _MOST_FAULTS:
            break
    if not faults and not rows:
        missing = "only a header" if columns else "nothing"
        faults = [
            Fault(
                f"holds {missing}; give a header with flags and a row per point", name
            )
        ]
    raise_any(sorted(faults, key=lambda fault: fault.line or 0))
    if MEASURED in columns and (text := curve_fault([row.request for row in rows])):
        raise SceneError([Fault(text, name)])
    return Table(name, columns, rows, list(_warnings(columns)))


def _point_of(
    flags: Mapping[str, str], values: Mapping[str, str]
) -> tuple[Request, list[str]]:
    """Point of the cells of a row by column, with its faults."""
    given = {
        column: cell for column, cell in values.items() if column in COLUMNS and cell
    }
    if MEASURED not in values:
        return request_of(flags, given)
    if math.isfinite(decimal(given.get("creepage", ""))):  # the longitudinal one alone
        given["creepage"] += ",0,0"
    request, wrong = request_of(flags, given)
    return request, [*row_faults(values), *wrong]


def _text(name: str, source: str) -> str:
    """Text of a file, or of standard input."""
    try:
        if source == "-":
            content = of_at_most(
                sys.stdin.buffer.read(LARGEST_TABLE + 1),
                LARGEST_TABLE,
                "fewer rows",
                name,
            )
        else:
            content = content_of(
                Path(source), "a CSV file, or - for stdin", LARGEST_TABLE
            )
    except OSError as error:
        raise SceneError(
            [Fault(f"cannot be read ({error.strerror}); give a CSV file", name)]
        ) from None
    return text_of(content, name)


def _checked(name: str, table: CsvTable) -> tuple[str, ...]:
    """Names of the columns; raises their faults."""
    columns = table.header
    faults = [fault.message for fault in table.faults if fault.line == table.line]
    faults += [
        f"column {k} has no name" for k, column in enumerate(columns, 1) if not column
    ]
    if "flange_back_mm" in columns:
        faults.append("column flange_back_mm has a new name; write back_to_back_mm")
    elif columns and not any(column in COLUMNS for column in columns):
        near = [hint for column in columns if (hint := _nearest(column))]
        hint = (
            f"did you mean {', '.join(near[:5])}?"
            if near
            else "separate columns by commas"
        )
        faults.append(
            "no column has the name of a flag, such as shift_mm or wheel_load_kN; "
            f"{hint}"
        )
    if faults:
        raise SceneError([Fault(fault, name, table.line) for fault in faults])
    return tuple(columns)


def _nearest(column: str) -> str | None:
    """Flag that a column probably meant, by its name with or without the unit."""
    plain = column.strip("-").replace("-", "_").replace(" ", "_").lower()
    near = (
        [plain]
        if plain in _LOWER
        else difflib.get_close_matches(plain, list(_LOWER), n=1, cutoff=0.75)
    )
    return _LOWER[near[0]] if near else None


def _warnings(columns: tuple[str, ...]) -> Iterator[str]:
    if any(column in columns for column in _CREEPAGES) and "patch" not in columns:
        yield 'creepages are given in one column creepage, as "XI_X,XI_Y,SPIN" in quotes'
    for column in columns:
        near = (
            None
            if column in (*COLUMNS, *RESULT_COLUMNS, *_CREEPAGES, MEASURED)
            else _nearest(column)
        )
        if near is not None and near not in columns:
            message = (
                f"column {column[:LONGEST_ECHO]} is not a flag of wearsim and is "
                "carried through"
            )
            yield f"{message}; did you mean {near}?"


def patch_table(
    solved: Sequence[tuple[Row, Result]],
    columns: Sequence[str],
    flags: Mapping[str, str],
) -> pd.DataFrame:
    """Table with a line per patch.

    What was given, the side and roll that were solved, `RESULT_COLUMNS`.
    """
    lines = []
    for row, result in solved:
        point: dict[str, Any] = row.request.texts | row.carried
        point |= {"roll": result["roll"] * 1e3, "table_line": row.line}
        point |= {"normal": row.request.normal, "tangential": row.request.tangential}
        speed = result["rotation_speed"]
        point[_ROTATION] = None if speed is None else speed * _ROTATION_FACTOR
        count = dict.fromkeys(("right", "left"), 0)
        for patch in result["patches"]:
            count[patch["side"]] += 1
            numbers = {column: patch[name] * factor for name, column, factor in _PATCH}
            lines.append(
                point | {"side": patch["side"], "patch": count[patch["side"]]} | numbers
            )
    # not of an earlier run; for the name of a pair both models stand
    gone = {*RESULT_COLUMNS, "model"}
    kept = [column for column in (*columns, *flags) if column not in gone]
    # all that was not a default becomes a column, too
    acting = {
        column
        for row, _ in solved
        for column, text in row.request.texts.items()
        if text != COLUMNS[column].default
    }
    given = (column for column in COLUMNS if column in acting - gone)
    order = (*kept, *given, "side", "roll", "normal", "tangential", *RESULT_COLUMNS)
    return pd.DataFrame(lines, columns=list(dict.fromkeys(order)))


_GROUPS = {
    "place": ("wheel_y", "rail_y", "x", "contact_angle"),
    "patch": ("area", "max_pressure", "length", "width", "approach"),
    "creepage": ("creepage_x", "creepage_y", "spin"),
    "forces on the wheel": ("normal_force", "force_x", "force_y", "spin_moment"),
    "sliding": ("slip_area", "power", "power_balance"),
}
"""Numbers of a patch by the heading under which they are printed."""


def as_text(request: Request, result: Result) -> str:
    """Numbers of each patch as a column in groups, and those of the point, for people.

    Names are those of tables.
    """
    who = "both wheels" if request.side == "both" else f"{request.side} wheel"
    rollers = (request.roller_radius, request.roller_radius_left)
    radii = " and ".join(f"{1e3 * s0:g}" for s0 in rollers if s0)
    against = f"roller of {radii} mm" if radii else "rail"
    rotation = f"rotation {request.rotation}"
    if request.creepage is not None:
        rotation = "creepages given"
    roll = "free" if request.free_roll else "given"
    models = " and ".join(dict.fromkeys((request.normal, request.tangential)))
    patches = result["patches"]
    table = [["", *(str(patch["side"]) for patch in patches)]]
    columns = {name: (column, factor) for name, column, factor in _PATCH}
    named = {name for names in _GROUPS.values() for name in names}
    rest = tuple(name for name in columns if name not in named)
    for title, names in {**_GROUPS, "other": rest}.items():
        if names:
            table.append([title, *("" for _ in patches)])
        for name in names:
            column, factor = columns[name]
            cells = (_shown(patch[name] * factor) for patch in patches)
            table.append([f"  {column}", *cells])
    point = []
    for name, value in (result | result.get("wheelset", {})).items():
        if isinstance(value, float):
            column, factor = _column(name)
            point.append([f"  {column}", _shown(value * factor)])
    lines = [f"{who} on {against}; {rotation}, roll {roll}; {models}"]
    return "\n".join(
        [*lines, *text_table(table), "operating point", *text_table(point)]
    )


def _shown(value: float) -> str:
    """Write a number with four significant digits, whole from 1000 on."""
    return f"{value:.0f}" if abs(value) >= 1e3 else f"{value + 0.0:.4g}"


def notes(request: Request, result: Result) -> dict[str, str]:
    """Warnings on one solved point, by kind.

    On a measured rail, a wheel that climbs its flange, a force that no shift balances,
    pressures no steel carries, and a roller that runs in a curve.
    """
    lines, shift = {}, result["shift"]
    if line := _stand(request.rail, request.inclination):
        lines["measured rail"] = f"{request.rail}: {line}"
    free = _clearance(request.source("wheel"), request.source("rail"))
    towards = {"right": shift, "left": -shift}
    climbing = [
        patch["side"] for patch in result["patches"] if towards[patch["side"]] > free
    ]
    if climbing:
        lines["flange clearance"] = (
            f"shift {1e3 * shift:.6g} mm is beyond the flange clearance of "
            f"{1e3 * free:.3g} mm: the {climbing[0]} wheel climbs its flange, which a "
            "wheelset in service does only while it derails"
        )
    past, force = result.get("share_beyond_jump"), request.lateral_force
    if past and force is not None:
        lines["jump"] = (
            f"the lateral force jumps past {1e-3 * force:.6g} kN "
            "within a micrometre of this shift: the wheelset runs on both sides of the "
            f"jump in turn, {100.0 * past:.3g} % of the distance past it; shown is the "
            "side before it"
        )
    highest = max(patch["max_pressure"] for patch in result["patches"])
    if highest > _PLASTIC:
        lines["pressure"] = (
            f"maximum pressure {1e-9 * highest:.3g} GPa: wheel and rail steel yields "
            f"far below {1e-9 * _PLASTIC:g} GPa, and an elastic contact does not hold; "
            "check load and profiles"
        )
    if request.track_curvature != 0.0 and request.counterface_curvature > 0.0:
        lines["curve"] = (
            "a curve radius on a roller stands for rollers of both sides that rotate "
            "at different speeds"
        )
    return lines


@lru_cache(maxsize=64)
def _clearance(wheel: tuple[Any, ...], rail: tuple[Any, ...]) -> float:
    """Flange clearance, infinite where it is not known."""
    free = flange_clearance(profile_of(*wheel), profile_of(*rail))
    return math.inf if free is None else free


@lru_cache(maxsize=64)
def _stand(rail: str, inclination: float) -> str:
    """How a measured rail is put into the track, "" for standard shapes."""
    lines = (
        placement_notes(read_input(rail, "rail"), inclination) if is_file(rail) else ()
    )
    return lines[0] if lines else ""
