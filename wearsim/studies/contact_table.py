"""Tables of `wearsim contact`.

Operating points in, one line per patch out, and JSON in SI units.
"""

from __future__ import annotations

import csv
import difflib
import io
import math
import re
import sys
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from wearsim.contact.patch import FloatArray
from wearsim.csv_tables import CsvTable, csv_table, unit_faults
from wearsim.errors import LONGEST_ECHO, Fault, SceneError, raise_any
from wearsim.profile.conicity import flange_clearance
from wearsim.profile.files import is_file
from wearsim.profile.inspection.inputs import placement_notes, read_input
from wearsim.profile.placement import narrow_head
from wearsim.quantities import QUANTITIES
from wearsim.studies.contact_flags import COLUMNS, FLAGS
from wearsim.studies.contact_points import (
    PATCH_NAMES,
    Points,
    Solution,
    conflicts,
    operating_points,
    profile_faults,
    profile_of,
    sources,
)
from wearsim.studies.creep_curve import MEASURED, curve_faults, row_faults
from wearsim.texts import text_table
from wearsim.toml_faults import (
    LARGEST_TABLE,
    content_of,
    decimal,
    of_at_most,
)

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


class Table(NamedTuple):
    """A table without faults.

    Its name for the user, its columns, line and carried cells of each row, its points,
    and warnings on it.
    """

    name: str
    columns: tuple[str, ...]
    lines: list[int]
    carried: pd.DataFrame
    points: Points
    warnings: list[str]

    @property
    def traction(self) -> FloatArray | None:
        """Measured traction coefficients (n,) of a creep curve [-], if it is one."""
        if MEASURED not in self.columns:
            return None
        return np.array([decimal(text) for text in self.carried[MEASURED]])


def read_table(source: str, flags: Mapping[str, str]) -> Table:
    """Read a table from a CSV file, or - for standard input, and check it.

    Its rows act before the texts of the flags, which are by column and without faults.
    SceneError holds all faults, each with its line.
    """
    name = "stdin" if source == "-" else source
    table = csv_table(_content(name, source), name)
    table = table._replace(header=[" ".join(column.split()) for column in table.header])
    columns = _checked(name, table)
    lines = [line for line, _ in table.rows]
    cells = pd.DataFrame([row for _, row in table.rows], lines, columns, dtype=object)
    if "table_line" in columns and "patch" in columns:  # further patches of a wheel
        cells = cells[cells["patch"].isin(("", "1"))]
    points, wrong = operating_points(_flag_texts(cells), flags)
    wrong += row_faults(cells)
    wrong += [
        (line, f"{column}: {message}")
        for line, column, message in profile_faults(points)
    ]
    wrong += conflicts(points)
    keys = {column: column for column in columns}
    faults = [*table.faults, *unit_faults(table, name, keys)]
    faults += [Fault(text, name, line) for line, text in wrong]
    if not faults and cells.empty:
        missing = "only a header" if columns else "nothing"
        faults = [
            Fault(
                f"holds {missing}; give a header with flags and a row per point", name
            )
        ]
    raise_any(sorted(faults, key=lambda fault: fault.line or 0))
    raise_any([Fault(text, name) for text in curve_faults(cells, points)])
    carried = [c for c in columns if c not in COLUMNS and c not in RESULT_COLUMNS]
    warnings = [f"read as {table.layout}"] if table.layout else []
    warnings += _warnings(columns)
    return Table(name, columns, list(cells.index), cells[carried], points, warnings)


def _flag_texts(cells: pd.DataFrame) -> pd.DataFrame:
    """Texts of the flags in a table, None where none is given.

    A measured creep curve may give the longitudinal creepage alone.
    """
    given = cells[[column for column in cells if column in COLUMNS]]
    if MEASURED in cells and "creepage" in given:
        given = given.assign(creepage=given["creepage"].map(_with_all_creepages))
    return given.where(given != "", None)


def _with_all_creepages(text: str) -> str:
    """Return creepages of which the longitudinal one may be given alone."""
    return f"{text},0,0" if math.isfinite(decimal(text)) else text


def _content(name: str, source: str) -> bytes:
    """Content of a file, or of standard input."""
    try:
        if source == "-":
            return of_at_most(
                sys.stdin.buffer.read(LARGEST_TABLE + 1),
                LARGEST_TABLE,
                "fewer rows",
                name,
            )
        return content_of(Path(source), "a CSV file, or - for stdin", LARGEST_TABLE)
    except OSError as error:
        raise SceneError(
            [Fault(f"cannot be read ({error.strerror}); give a CSV file", name)]
        ) from None


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
        near = [hint for column in columns if (hint := _nearest_flag(column))]
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


def _nearest_flag(column: str) -> str | None:
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
            else _nearest_flag(column)
        )
        if near is not None and near not in columns:
            message = (
                f"column {column[:LONGEST_ECHO]} is not a flag of wearsim and is "
                "carried through"
            )
            yield f"{message}; did you mean {near}?"


def patch_csv(table: Table, solution: Solution, flags: Mapping[str, str]) -> str:
    """Table with a line per patch as CSV.

    What was given, the side and roll that were solved, `RESULT_COLUMNS`.
    """
    patches, texts = solution.patches, table.points.texts
    lines = patches["point"]
    point = solution.points.reindex(lines)
    numbers = {column: patches[name] * factor for name, column, factor in _PATCH}
    numbers["roll"] = point["roll"] * 1e3
    numbers[_ROTATION] = point["rotation_speed"] * _ROTATION_FACTOR
    given = pd.concat([table.carried, texts], axis=1).loc[lines].fillna("")
    cells: dict[str, Any] = dict(given.items())  # type: ignore[arg-type]
    cells |= {name: patches[name] for name in ("side", "normal", "tangential")}
    cells |= {column: _twelve_digits(number) for column, number in numbers.items()}
    cells["table_line"] = lines
    cells["patch"] = 1 + patches.groupby(["point", "side"]).cumcount()
    # not of an earlier run; for the name of a pair both models stand
    gone = {*RESULT_COLUMNS, "model"}
    kept = [column for column in (*table.columns, *flags) if column not in gone]
    # all that was not a default becomes a column, too
    acting = texts.loc[solution.points.index]
    defaults = pd.Series({column: flag.default for column, flag in COLUMNS.items()})
    changed = (acting.notna() & acting.ne(defaults)).any()
    more = [column for column in texts.columns[changed] if column not in gone]
    order = (*kept, *more, "side", "roll", "normal", "tangential", *RESULT_COLUMNS)
    header = list(dict.fromkeys(order))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(zip(*(cells[column] for column in header), strict=True))
    return text.getvalue()


def _twelve_digits(numbers: pd.Series) -> list[str]:
    """Numbers with twelve digits, "" for missing ones."""
    return ["" if x != x else f"{x:.12g}" for x in numbers.tolist()]


def as_records(solution: Solution) -> dict[int, dict[str, Any]]:
    """Values of each point and its patches in SI units, by row."""
    records: dict[int, Any] = solution.points.to_dict("index")  # type: ignore[assignment]
    for record in records.values():
        past = record.pop("share_beyond_jump")
        record["patches"] = []
        if not math.isnan(past):
            record["share_beyond_jump"] = past
    for row, forces in solution.forces.to_dict("index").items():
        records[row]["wheelset"] = forces  # type: ignore[index]
    for patch in solution.patches.to_dict("records"):
        records[patch.pop("point")]["patches"].append(patch)
    return records


_GROUPS = {
    "place": ("wheel_y", "rail_y", "x", "contact_angle"),
    "patch": ("area", "max_pressure", "length", "width", "approach"),
    "creepage": ("creepage_x", "creepage_y", "spin"),
    "forces on the wheel": ("normal_force", "force_x", "force_y", "spin_moment"),
    "sliding": ("slip_area", "power", "power_balance"),
}
"""Numbers of a patch by the heading under which they are printed."""


def as_text(points: Points, solution: Solution) -> str:
    """Numbers of each patch as a column in groups, and those of the point, for people.

    Names are those of tables.
    """
    given = points.values.iloc[0]
    wheels = "both wheels" if given["side"] == "both" else f"{given['side']} wheel"
    rollers = given[["roller_radius", "roller_radius_left"]].dropna()
    radii = " and ".join(f"{1e3 * radius:g}" for radius in rollers)
    against = f"roller of {radii} mm" if radii else "rail"
    rotation = f"rotation {given['rotation']}"
    if isinstance(given["creepage"], tuple):
        rotation = "creepages given"
    roll = "free" if given["free_roll"] else "given"
    models = " and ".join(dict.fromkeys(given[["normal", "tangential"]]))
    patches = solution.patches
    table = [["", *patches["side"]]]
    columns = {name: (column, factor) for name, column, factor in _PATCH}
    for title, names in _GROUPS.items():
        table.append([title, *("" for _ in patches["side"])])
        for name in names:
            column, factor = columns[name]
            table.append([f"  {column}", *(patches[name] * factor).map(_four_digits)])
    state = pd.concat([solution.points, solution.forces], axis=1).iloc[0].dropna()
    point = []
    for quantity, value in state.items():
        column, factor = _column(str(quantity))
        point.append([f"  {column}", _four_digits(value * factor)])
    lines = [f"{wheels} on {against}; {rotation}, roll {roll}; {models}"]
    return "\n".join(
        [*lines, *text_table(table), "operating point", *text_table(point)]
    )


def _four_digits(value: float) -> str:
    """Write a number with four significant digits, whole from 1000 on."""
    return f"{value:.0f}" if abs(value) >= 1e3 else f"{value + 0.0:.4g}"


def notes(points: Points, solution: Solution) -> list[tuple[list[int], str]]:
    """Warnings on solved points: their rows, and the text on the first of them.

    On a measured rail, a narrow head, a wheel that climbs its flange, a force that no
    shift balances, pressures no steel carries, and a roller that runs in a curve.
    """
    state: Any = solution.points
    patches: Any = solution.patches
    values: Any = points.values.loc[state.index]
    if values.empty:
        return []
    warnings: list[tuple[list[int], str]] = []
    rails = zip(values["rail"], values["inclination"], strict=True)
    stands = {
        row: _placement_note(*rail)
        for row, rail in zip(values.index, rails, strict=True)
    }
    if rows := [row for row, stand in stands.items() if stand]:
        warnings.append((rows, f"{values.at[rows[0], 'rail']}: {stands[rows[0]]}"))
    heads = map(_narrow_head_note, sources(values, "rail"))
    narrow = {row: text for row, text in zip(values.index, heads, strict=True) if text}
    if rows := list(narrow):
        warnings.append((rows, f"{values.at[rows[0], 'rail']} is {narrow[rows[0]]}"))
    shift = state["shift"]
    pairs = map(_clearance, sources(values, "wheel"), sources(values, "rail"))
    free: Any = pd.Series(list(pairs), values.index)
    towards = patches["side"].map({"right": 1.0, "left": -1.0})
    towards *= shift.loc[patches["point"]].values
    climbing = patches[towards.values > free.loc[patches["point"]].values]
    if rows := climbing["point"].drop_duplicates().tolist():
        text = (
            f"shift {1e3 * shift[rows[0]]:.6g} mm is beyond the flange clearance of "
            f"{1e3 * free[rows[0]]:.3g} mm: the {climbing['side'].iloc[0]} wheel climbs "
            "its flange, which a wheelset in service does only while it derails"
        )
        warnings.append((rows, text))
    past = 100.0 * state["share_beyond_jump"]
    if rows := past.index[past > 0.0].tolist():
        text = (
            "the lateral force jumps past "
            f"{1e-3 * values.at[rows[0], 'lateral_force']:.6g} kN within a micrometre "
            "of this shift: the wheelset runs on both sides of the jump in turn, "
            f"{past[rows[0]]:.3g} % of the distance past it; shown is the side before it"
        )
        warnings.append((rows, text))
    highest = 1e-9 * patches.groupby("point")["max_pressure"].max()
    if rows := highest.index[highest > 1e-9 * _PLASTIC].tolist():
        text = (
            f"maximum pressure {highest[rows[0]]:.3g} GPa: wheel and rail steel yields "
            f"far below {1e-9 * _PLASTIC:g} GPa, and an elastic contact does not hold; "
            "check load and profiles"
        )
        warnings.append((rows, text))
    on_roller = values["counterface_curvature"] > 0.0
    if rows := values.index[on_roller & (values["track_curvature"] != 0.0)].tolist():
        text = (
            "a curve radius on a roller stands for rollers of both sides that rotate "
            "at different speeds"
        )
        warnings.append((rows, text))
    return sorted(warnings, key=lambda note: note[0][0])


@lru_cache(maxsize=64)
def _clearance(wheel: tuple[Any, ...], rail: tuple[Any, ...]) -> float:
    """Flange clearance, infinite where it is not known."""
    free = flange_clearance(profile_of(*wheel), profile_of(*rail))
    return math.inf if free is None else free


@lru_cache(maxsize=64)
def _narrow_head_note(rail: tuple[Any, ...]) -> str:
    """Note on a narrow head, "" for standard shapes and other files."""
    return narrow_head(profile_of(*rail).y) if is_file(rail[0]) else ""


@lru_cache(maxsize=64)
def _placement_note(rail: str, inclination: float) -> str:
    """Note on the placement of a measured rail, "" for standard shapes."""
    lines = (
        placement_notes(read_input(rail, "rail"), inclination) if is_file(rail) else ()
    )
    return lines[0] if lines else ""
