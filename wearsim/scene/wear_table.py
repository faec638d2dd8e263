"""A wear table of the user's own, in a scene, a TOML or a CSV file: one model, all faults at once.

TOML: the keys of `WearTableSection`, columns as lists of equal length. CSV: the same keys as comment lines
such as ``# source = twin disc, our laboratory``, a line with the names of the columns, then the rows.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, Field, Strict, ValidationError

from wearsim.contact.patch import FloatArray
from wearsim.damage.wear.table import INDEX_COLUMNS, RATE_COLUMNS, WearTable
from wearsim.errors import Fault, SceneError
from wearsim.scene.section import Section, Text, number, words
from wearsim.toml_faults import (
    KeyPath,
    Lines,
    content_of,
    key_lines,
    line_of,
    text_of,
    toml_of,
    validation_faults,
)

Words = Annotated[Text, AfterValidator(str.strip)]
Column = Annotated[tuple[Annotated[float, Field(ge=0, le=1e12)], ...], Strict(False)]
PathFaults = list[tuple[KeyPath, str]]


def column(meaning: str, unit: str) -> Any:
    """Field of a column of a table that may be missing."""
    extra: Any = {"unit": unit}
    return Field(None, min_length=1, max_length=10000, description=meaning, json_schema_extra=extra)


class WearTableSection(Section):
    """[wear.table]: a wear law of one's own, one index column or two and one column of the wear rate."""

    source: Words = words("where the table comes from")
    certainty: Words = words("how sure it is, in words")
    validity: Words | None = words("what it holds for", None)
    materials: Words | None = words("wheel and rail, and the state of their surfaces", None)
    interpolation: Literal["linear", "step"] = Field(description="what holds between the rows")
    beyond: Literal["hold", "slope"] = Field(description="what holds beyond the last row")
    below: Literal["proportional", "hold", "zero"] | None = Field(
        None, description="what holds below the first row, where that is above 0"
    )
    hardness_GPa: float | None = number("hardness", "the hardness of the wheel", None)
    T_gamma_A_N_mm2: Column | None = column("frictional work per area and distance", "N/mm2")
    power_density_W_mm2: Column | None = column("frictional power per area", "W/mm2")
    slip_speed_m_s: Column | None = column("the sliding speed", "m/s")
    pressure_MPa: Column | None = column("the contact pressure", "MPa")
    mass_rate_ug_m_mm2: Column | None = column("mass lost per distance and area", "ug/m/mm2")
    energy_coefficient_mm3_kJ: Column | None = column("volume lost per frictional work", "mm3/kJ")
    wear_coefficient: Column | None = column("Archard's coefficient", "")


def wear_table(section: WearTableSection, name: str) -> tuple[WearTable | None, PathFaults]:
    """Make the wear table of a section, called `name` in results.

    Returns
    -------
    table : WearTable or None
        None if there are faults.
    faults : list of (path, str)
        Path of the key and message of each fault between the values.
    """
    given = {key: getattr(section, key) for key in (*INDEX_COLUMNS, *RATE_COLUMNS)}
    columns = {key: np.array(rows) for key, rows in given.items() if rows is not None}
    index = tuple(key for key in INDEX_COLUMNS if key in columns)
    rates = tuple(key for key in RATE_COLUMNS if key in columns)
    faults = list(_key_faults(section, index, rates))
    if faults:
        return None, faults
    (rate,) = rates
    lengths = {key: columns[key].size for key in (*index, rate)}
    if len(set(lengths.values())) > 1:
        counts = ", ".join(f"{key} has {count}" for key, count in lengths.items())
        return None, [((rate,), f"the columns must be equally long: {counts}")]
    axes, values = (_line if len(index) == 1 else _map)(index, columns, columns[rate], faults)
    faults += _below_faults(section, index, columns)
    if faults:
        return None, faults
    rows = (
        f"{columns[rate].size} rows, between them {section.interpolation}, beyond the last {section.beyond}"
    )
    rows += f", below the first {section.below}" if section.below else ""
    validity = section.validity or "As given by the user."
    return WearTable(
        name=name,
        laws=("table",),
        materials=section.materials or "as given",
        source=section.source,
        validity=f"{validity} Certainty: {section.certainty}. {rows}.",
        departures=(),
        values={},
        index=index,
        axes=tuple(axis * INDEX_COLUMNS[key] for axis, key in zip(axes, index, strict=True)),
        rate=rate,
        rates=values * RATE_COLUMNS[rate],
        interpolation=section.interpolation,
        beyond=section.beyond,
        below=section.below or "hold",
        hardness=1e9 * (section.hardness_GPa or 0.0),
        certainty=section.certainty,
    ), []


def _key_faults(
    section: WearTableSection, index: tuple[str, ...], rates: tuple[str, ...]
) -> Iterator[tuple[KeyPath, str]]:
    if len(index) != 1 and index != ("slip_speed_m_s", "pressure_MPa"):
        which = f"is {' and '.join(index)}" if index else "is missing"
        known = ", ".join(INDEX_COLUMNS)
        yield (), f"the index {which}; give one of {known}, or slip_speed_m_s and pressure_MPa for a map"
    if len(rates) != 1:
        which = f"is {' and '.join(rates)}" if rates else "is missing"
        yield (), f"the wear rate {which}; give one of {', '.join(RATE_COLUMNS)}"
    elif rates == ("wear_coefficient",) and section.hardness_GPa is None:
        yield (), "hardness_GPa is missing; wear_coefficient needs the hardness of the wheel, about 3"
    elif rates != ("wear_coefficient",) and section.hardness_GPa is not None:
        message = f"hardness_GPa acts with wear_coefficient only, not with {rates[0]}; delete it"
        yield ("hardness_GPa",), message
    if section.beyond == "slope" and (len(index) > 1 or section.interpolation == "step"):
        yield ("beyond",), 'beyond = "slope" is for one index with linear interpolation; write "hold"'


def _below_faults(
    section: WearTableSection, index: tuple[str, ...], columns: dict[str, FloatArray]
) -> Iterator[tuple[KeyPath, str]]:
    """Faults of the rule below the first row, which is stated where there is anything below it."""
    first = next((key for key in index if columns[key].min() > 0.0), None)
    if first is None and section.below is not None:
        yield ("below",), "below acts where the first row is above 0 only; delete it"
    if first is not None and section.below is None:
        row = int(columns[first].argmin())
        yield (
            (first, row),
            f"{first} = {columns[first][row]:g} is the first row, and nothing says what holds below it; "
            'write below = "proportional" (a straight line from 0), "hold" (its rate down to no slip) or '
            '"zero", or add a row at 0',
        )


def _line(
    index: tuple[str, ...], columns: dict[str, FloatArray], rates: FloatArray, faults: PathFaults
) -> tuple[tuple[FloatArray, ...], FloatArray]:
    """Axis and rates of a table of one index, whose rows must rise."""
    (key,) = index
    axis = columns[key]
    for row in np.flatnonzero(np.diff(axis) <= 0.0) + 1:
        message = f"{key} = {axis[row]:g} must be above {axis[row - 1]:g}, the row before"
        faults.append(((key, int(row)), message))
    return (axis,), rates


def _map(
    index: tuple[str, ...], columns: dict[str, FloatArray], rates: FloatArray, faults: PathFaults
) -> tuple[tuple[FloatArray, ...], FloatArray]:
    """Axes of a map and the rates on them; rows may come in any order."""
    one, other = index
    (first, i), (second, j) = (np.unique(columns[key], return_inverse=True) for key in index)
    grid = np.full((first.size, second.size), np.nan)

    def pair(a: int, b: int) -> str:
        return f"{one} = {first[a]:g} with {other} = {second[b]:g}"

    for row, at in enumerate(zip(i, j, strict=True)):
        if not np.isnan(grid[at]):
            faults.append(((one, row), f"{pair(*at)} is given twice; delete one"))
        grid[at] = rates[row]
    missing = np.argwhere(np.isnan(grid))
    faults += [((one,), f"no row for {pair(a, b)}; a map needs every pair") for a, b in missing]
    return (first, second), grid


def read_wear_table(path: str | Path) -> WearTable:
    """Read a wear table, named after its file, from TOML (suffix .toml) or CSV, see the head of this module.

    Raises
    ------
    SceneError
        All faults of the first stage that has any: syntax; keys, types and ranges; what does not fit
        together. ``file:line: message``.
    """
    path = Path(path)
    file = str(path)
    text = text_of(content_of(path, "a wear table"), file)
    if path.suffix.lower() == ".toml":
        data, lines = toml_of(text, file), key_lines(text)
    else:
        data, lines = _parsed_csv(file, text)
    try:
        section = WearTableSection.model_validate(data)
    except ValidationError as error:
        raise SceneError(validation_faults(error, WearTableSection, lines, file)) from None
    table, faults = wear_table(section, path.stem)
    if table is None:
        listed = [Fault(message, file, line_of(lines, at)) for at, message in faults]
        raise SceneError(sorted(listed, key=lambda fault: fault.line or 0))
    return table


def _parsed_csv(file: str, text: str) -> tuple[dict[str, Any], Lines]:
    data: dict[str, Any] = {}
    lines: Lines = {}
    faults: list[Fault] = []
    header: list[str] = []
    for line, row in enumerate(text.split("\n"), start=1):
        if row.startswith("#"):
            key, equals, value = row[1:].partition("=")
            if equals and key.strip() in WearTableSection.model_fields:
                data[key.strip()] = _number_or_text(value.strip().strip('"'))
                lines[key.strip(),] = line
            continue
        try:
            cells = [cell.strip() for cell in next(csv.reader([row]), [])]
        except csv.Error as error:
            faults.append(Fault(f"is not CSV: {error}", file, line))
            continue
        if not any(cells):
            continue
        if not header:
            header = cells
            for name in sorted({each for each in header if header.count(each) > 1}):
                faults.append(Fault(f"column {name} is given twice; delete one", file, line))
            for name in header:
                data[name], lines[name,] = [], line
        elif len(cells) != len(header):
            faults.append(Fault(f"has {len(cells)} cells where the header has {len(header)}", file, line))
        else:
            for name, cell in zip(header, cells, strict=True):
                lines[name, len(data[name])] = line
                data[name].append(_number_or_text(cell))
    if faults:
        raise SceneError(faults)
    return data, lines


def _number_or_text(cell: str) -> float | str:
    try:
        return float(cell)
    except ValueError:
        return cell
