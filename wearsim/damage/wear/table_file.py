"""Reading a user's wear table: TOML, CSV, or the keys of a scene; all faults at once.

TOML: `source`, `certainty`, `interpolation`, `beyond`, where the first row is above 0 `below`, for Archard's
coefficient `hardness_GPa`, and the columns as lists of equal length. CSV: the same keys as comment lines
such as ``# source = twin disc, our laboratory``, a line with the names of the columns, then the rows.
"""

from __future__ import annotations

import csv
import difflib
import math
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from wearsim.damage.wear.table import BELOW, BEYOND, INDEX_COLUMNS, INTERPOLATIONS, RATE_COLUMNS, WearTable
from wearsim.errors import Fault, SceneError

MAX_BYTES = 1_000_000
_MOST_FAULTS = 20  # lines of one message; a wrong column would fault every row

TEXT_KEYS = ("source", "certainty", "validity", "materials")
KEYS = (*TEXT_KEYS, "interpolation", "beyond", "below", "hardness_GPa", *INDEX_COLUMNS, *RATE_COLUMNS)


@dataclass(frozen=True)
class TableFault:
    """A fault of a wear table before it is known where the table stands.

    Parameters
    ----------
    key : str or None
        The key or column; None for the table as a whole.
    row : int or None
        Element of the column, counted from 0.
    message : str
        What is wrong, allowed range and way out.
    """

    key: str | None
    row: int | None
    message: str


def wear_table(data: Mapping[str, Any], name: str) -> tuple[WearTable | None, tuple[TableFault, ...]]:
    """Make a wear table of its keys.

    Parameters
    ----------
    data : mapping
        Texts, numbers and columns by key, as a TOML table gives them.
    name : str
        What results call the table.

    Returns
    -------
    table : WearTable or None
        None if there are faults.
    faults : tuple of TableFault
        All of them.
    """
    faults: list[TableFault] = []

    def fault(message: str, key: str | None = None, row: int | None = None) -> None:
        faults.append(TableFault(key, row, message))

    for key in data:
        if key not in KEYS:
            near = difflib.get_close_matches(str(key), KEYS, n=1, cutoff=0.5)
            hint = f"; did you mean {near[0]}?" if near else "; delete it"
            fault(f"{key} is no key of a wear table{hint}", key)
    texts = {key: _text(data, key, fault) for key in TEXT_KEYS}
    for key in ("source", "certainty"):
        if key not in data:
            fault(f'{key} is missing; say where the table comes from and how sure it is, {key} = "..."')
    words = {
        "interpolation": _word(data, "interpolation", INTERPOLATIONS, fault),
        "beyond": _word(data, "beyond", BEYOND, fault),
    }
    index = tuple(key for key in INDEX_COLUMNS if key in data)
    rates = tuple(key for key in RATE_COLUMNS if key in data)
    if len(index) != 1 and index != ("slip_speed_m_s", "pressure_MPa"):
        told = "is missing" if not index else f"is {' and '.join(index)}"
        fault(
            f"the index {told}; give one of {', '.join(INDEX_COLUMNS)}, or slip_speed_m_s and pressure_MPa "
            "for a map"
        )
    if len(rates) != 1:
        told = "is missing" if not rates else f"is {' and '.join(rates)}"
        fault(f"the wear rate {told}; give one of {', '.join(RATE_COLUMNS)}")
    hardness = _hardness(data, rates, fault)
    columns = {key: _column(data[key], key, fault) for key in (*index, *rates)}
    if faults:
        return None, tuple(faults)
    lengths = {key: len(column) for key, column in columns.items()}
    if len(set(lengths.values())) > 1:
        told = ", ".join(f"{key} has {count}" for key, count in lengths.items())
        fault(f"the columns must be equally long: {told}", rates[0])
        return None, tuple(faults)
    axes, values = _gridded(index, columns, rates[0], fault)
    if words["beyond"] == "slope" and (len(index) > 1 or words["interpolation"] == "step"):
        fault('beyond = "slope" is for one index with linear interpolation; write "hold"', "beyond")
    below = _below(data, index, columns, axes, fault)
    if faults:
        return None, tuple(faults)
    return (
        WearTable(
            name=name,
            laws=("table",),
            materials=texts["materials"] or "as given",
            source=texts["source"],
            validity=(
                f"{texts['validity'] or 'As given by the user.'} Certainty: {texts['certainty']}. "
                f"{len(columns[rates[0]])} rows, between them {words['interpolation']}, beyond the last "
                f"{words['beyond']}{f', below the first {below}' if any(a[0] > 0.0 for a in axes) else ''}."
            ),
            departures=(),
            values=MappingProxyType({}),
            index=index,
            axes=tuple(axis * INDEX_COLUMNS[key] for axis, key in zip(axes, index, strict=True)),
            rate=rates[0],
            rates=values * RATE_COLUMNS[rates[0]],
            interpolation=words["interpolation"],
            beyond=words["beyond"],
            below=below,
            hardness=1e9 * hardness,
            certainty=texts["certainty"],
        ),
        (),
    )


def _text(data: Mapping[str, Any], key: str, fault: Any) -> str:
    value = data.get(key, "")
    if not isinstance(value, str) or not value.isprintable() or (key in data and not value.strip()):
        fault(f"{key} = {value!r} must be one line of text", key)
        return ""
    return value.strip()


def _word(data: Mapping[str, Any], key: str, allowed: Sequence[str], fault: Any) -> str:
    choice = " or ".join(f'"{word}"' for word in allowed)
    if key not in data:
        fault(f"{key} is missing; write {key} = {choice}")
    elif data[key] not in allowed:
        fault(f"{key} = {data[key]!r} must be {choice}", key)
    else:
        return str(data[key])
    return allowed[0]


def _below(
    data: Mapping[str, Any],
    index: tuple[str, ...],
    columns: Mapping[str, list[float]],
    axes: tuple[np.ndarray, ...],
    fault: Any,
) -> str:
    """Rule below the first row, which is stated where there is anything below it."""
    first = next(
        ((key, float(axis[0])) for key, axis in zip(index, axes, strict=True) if axis[0] > 0.0), None
    )
    if first is None:
        if "below" in data:
            fault("below acts where the first row is above 0 only; delete it", "below")
        return "hold"
    if "below" in data:
        return _word(data, "below", BELOW, fault)
    key, value = first
    fault(
        f"{key} = {value:g} is the first row, and nothing says what holds below it; write below = "
        f'"proportional" (a straight line from 0), "hold" (its rate down to no slip) or "zero", or add a row '
        f"at 0",
        key,
        columns[key].index(value),
    )
    return "hold"


def _hardness(data: Mapping[str, Any], rates: tuple[str, ...], fault: Any) -> float:
    needed = rates == ("wear_coefficient",)
    value = data.get("hardness_GPa")
    if value is None:
        if needed:
            fault("hardness_GPa is missing; wear_coefficient needs the hardness of the wheel, about 3")
        return 0.0
    if not needed and len(rates) == 1:
        fault(f"hardness_GPa acts with wear_coefficient only, not with {rates[0]}; delete it", "hardness_GPa")
        return 0.0
    if not _is_number(value) or not 0.1 <= value <= 20.0:
        fault(f"hardness_GPa = {value!r} must be a number from 0.1 to 20 GPa", "hardness_GPa")
        return 0.0
    return float(value)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _column(value: object, key: str, fault: Any) -> list[float]:
    if not isinstance(value, list | tuple) or not value:
        fault(f"{key} must be a list of numbers, such as [0, 10.4, 77.2]", key)
        return []
    for row, number in enumerate(value):
        if not _is_number(number) or not 0.0 <= number <= 1e12:
            fault(f"{key} = {number!r} must be a number of 0 or more, at most 1e12", key, row)
    return [float(number) if _is_number(number) else 0.0 for number in value]


def _gridded(
    index: tuple[str, ...], columns: Mapping[str, list[float]], rate: str, fault: Any
) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
    """Axes and the rates on them; rows of a map may come in any order, those of a line must rise."""
    if len(index) == 1:
        axis = columns[index[0]]
        for row in range(1, len(axis)):
            if axis[row] <= axis[row - 1]:
                told = f"{index[0]} = {axis[row]:g} must be above {axis[row - 1]:g}, the row before"
                fault(told, index[0], row)
        return (np.array(axis),), np.array(columns[rate])
    first, second = (np.unique(columns[key]) for key in index)
    rates = np.full((first.size, second.size), np.nan)
    for row, (a, b) in enumerate(zip(columns[index[0]], columns[index[1]], strict=True)):
        at = (int(np.searchsorted(first, a)), int(np.searchsorted(second, b)))
        if not np.isnan(rates[at]):
            fault(f"{index[0]} = {a:g} with {index[1]} = {b:g} is given twice; delete one", index[0], row)
        rates[at] = columns[rate][row]
    for i, j in np.argwhere(np.isnan(rates)):
        told = f"no row for {index[0]} = {first[i]:g} with {index[1]} = {second[j]:g}; a map needs every pair"
        fault(told, index[0])
    return (first, second), rates


def read_wear_table(path: str | Path) -> WearTable:
    """Read a wear table from a file.

    Parameters
    ----------
    path : str or Path
        TOML (suffix .toml) or CSV, see the head of this module.

    Returns
    -------
    WearTable
        Named after the file.

    Raises
    ------
    SceneError
        All faults, ``file:line: message``.
    """
    path = Path(path)
    text = _file_text(path)
    read = _read_toml if path.suffix.lower() == ".toml" else _read_csv
    data, lines = read(path, text)
    table, faults = wear_table(data, path.stem)
    if table is None:
        told = [
            Fault(f.message, str(path), lines.get((f.key, f.row)) or lines.get((f.key, None))) for f in faults
        ]
        _refuse(told, path)
        raise AssertionError  # _refuse raises
    return table


def _refuse(faults: list[Fault], path: Path) -> None:
    more = len(faults) - _MOST_FAULTS
    shown = sorted(faults, key=lambda fault: fault.line or 0)[:_MOST_FAULTS]
    if more > 0:
        shown.append(Fault(f"{more} more faults of this file are not shown", str(path)))
    raise SceneError(shown)


def _file_text(path: Path) -> str:
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        told = getattr(error, "strerror", None) or error
        raise SceneError([Fault(f"cannot be read ({told}); give a wear table", str(path))]) from None
    if len(content) > MAX_BYTES:
        raise SceneError([Fault("is larger than 1 MB, hardly one wear table", str(path))])
    try:
        return content.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise SceneError([Fault("is not UTF-8 text; save it as UTF-8", str(path), line)]) from None


Lines = dict[tuple[str | None, int | None], int]


def _read_toml(path: Path, text: str) -> tuple[dict[str, Any], Lines]:
    try:
        data = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        place = re.search(r"\(at line (\d+), column \d+\)", str(error))
        told = str(error).replace(f" {place[0]}", "") if place else str(error)
        line = int(place[1]) if place else None
        raise SceneError([Fault(f"is not TOML: {told}", str(path), line)]) from None
    lines: Lines = {}
    rows = text.split("\n")
    for key in data:
        start = next(
            (k for k, row in enumerate(rows) if re.match(rf"\s*[\"']?{re.escape(key)}[\"']?\s*=", row)), None
        )
        if start is None:
            continue
        lines[key, None] = start + 1
        if isinstance(data[key], list):
            _element_lines(rows, start, key, len(data[key]), lines)
    return data, lines


def _element_lines(rows: list[str], start: int, key: str, count: int, lines: Lines) -> None:
    """Note the line of each element of a list of numbers, which may go over several lines."""
    element = 0
    for k in range(start, len(rows)):
        row = rows[k].split("#")[0]
        for _ in re.findall(r"[^\s,\[\]]+", row.partition("=")[2] if k == start else row):
            lines[key, element] = k + 1
            element += 1
            if element == count:
                return


def _read_csv(path: Path, text: str) -> tuple[dict[str, Any], Lines]:
    data: dict[str, Any] = {}
    lines: Lines = {}
    faults: list[Fault] = []
    header: list[str] = []
    for number, row in enumerate(text.split("\n"), start=1):
        if row.startswith("#"):
            key, equals, value = row[1:].partition("=")
            if equals and key.strip() in KEYS:
                data[key.strip()] = _number_or_text(value.strip().strip('"'))
                lines[key.strip(), None] = number
            continue
        try:
            cells = [cell.strip() for cell in next(csv.reader([row]), [])]
        except csv.Error as error:
            faults.append(Fault(f"is not CSV: {error}", str(path), number))
            continue
        if not any(cells):
            continue
        if not header:
            header = cells
            for column in sorted({each for each in header if header.count(each) > 1}):
                faults.append(Fault(f"column {column} is given twice; delete one", str(path), number))
            for column in header:
                data[column] = []
                lines[column, None] = number
            continue
        if len(cells) != len(header):
            told = f"has {len(cells)} cells where the header has {len(header)}"
            faults.append(Fault(told, str(path), number))
            continue
        for column, cell in zip(header, cells, strict=True):
            lines[column, len(data[column])] = number
            data[column].append(_number_or_text(cell))
    if faults:
        _refuse(faults, path)
    return data, lines


def _number_or_text(cell: str) -> float | str:
    try:
        return float(cell)
    except ValueError:
        return cell
