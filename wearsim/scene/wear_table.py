"""A wear table of the user's own, in a scene, a TOML or a CSV file.

One model, all faults at once.

TOML: the keys of `WearTableSection`, columns as lists of equal length. CSV: the same
keys as comment lines such as ``# source = twin disc, our laboratory``, a line with the
names of the columns, then the rows.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, Field, Strict, ValidationError

from wearsim.contact.patch import FloatArray
from wearsim.csv_tables import csv_table, unit_faults
from wearsim.damage.wear.table import INDEX_COLUMNS, RATE_COLUMNS, WearTable
from wearsim.errors import Fault, SceneError, listed, raise_any
from wearsim.scene.section import Section, Text, quantity, text_field
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
    return Field(
        None,
        min_length=1,
        max_length=10000,
        description=meaning,
        json_schema_extra=extra,
    )


class WearTableSection(Section):
    """[wear.table]: a wear law of one's own, one index column or two and one column of
    the wear rate.
    """

    source: Words = text_field("where the table comes from")
    certainty: Words = text_field("how sure it is, in words")
    validity: Words | None = text_field("what it holds for", None)
    materials: Words | None = text_field(
        "wheel and rail, and the state of their surfaces", None
    )
    interpolation: Literal["linear", "step"] = Field(
        description="what holds between the rows"
    )
    beyond: Literal["hold", "slope"] = Field(
        description="what holds beyond the last row"
    )
    below: Literal["proportional", "hold", "zero"] | None = Field(
        None, description="what holds below the first row, where that is above 0"
    )
    hardness_GPa: float | None = quantity("hardness", None)
    T_gamma_A_N_mm2: Column | None = column(
        "frictional work per area and distance", "N/mm2"
    )
    power_density_W_mm2: Column | None = column("frictional power per area", "W/mm2")
    slip_speed_m_s: Column | None = column("the sliding speed", "m/s")
    pressure_MPa: Column | None = column("the contact pressure", "MPa")
    mass_rate_ug_m_mm2: Column | None = column(
        "mass lost per distance and area", "ug/m/mm2"
    )
    energy_coefficient_mm3_kJ: Column | None = column(
        "volume lost per frictional work", "mm3/kJ"
    )
    wear_coefficient: Column | None = column("Archard's coefficient", "")


def wear_table(
    section: WearTableSection, name: str
) -> tuple[WearTable | None, PathFaults]:
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
    if len({rows.size for rows in columns.values()}) > 1:
        counts = ", ".join(f"{key} has {columns[key].size}" for key in (*index, rate))
        return None, [((rate,), f"the columns must be equally long: {counts}")]
    axes, values = [columns[key] for key in index], columns[rate]
    if len(index) == 1:
        faults += _line_faults(index[0], *axes)
    else:
        axes, values, faults = _map_axes(index, axes, values)
    faults += _first_row_faults(section, index, columns)
    if faults:
        return None, faults
    rows = _rows_in_words(section, columns[rate].size)
    return WearTable(
        name=name,
        laws=("table",),
        materials=section.materials or "as given",
        source=section.source,
        validity=(
            f"{section.validity or 'As given by the user.'} Certainty: "
            f"{section.certainty}. {rows}."
        ),
        departures=(),
        values={},
        index=index,
        axes=tuple(
            axis * INDEX_COLUMNS[key] for axis, key in zip(axes, index, strict=True)
        ),
        rate=rate,
        rates=values * RATE_COLUMNS[rate],
        interpolation=section.interpolation,
        beyond=section.beyond,
        below=section.below or "hold",
        hardness=1e9 * (section.hardness_GPa or 0.0),
        certainty=section.certainty,
    ), []


def _rows_in_words(section: WearTableSection, count: int) -> str:
    below_first = f", below the first {section.below}" if section.below else ""
    return (
        f"{count} rows, between them {section.interpolation}, beyond the last "
        f"{section.beyond}{below_first}"
    )


def _key_faults(
    section: WearTableSection, index: tuple[str, ...], rates: tuple[str, ...]
) -> Iterator[tuple[KeyPath, str]]:
    if len(index) != 1 and index != ("slip_speed_m_s", "pressure_MPa"):
        what = f"is {listed(index, ' and ')}" if index else "is missing"
        text = (
            f"the index {what}; give one of {listed(INDEX_COLUMNS)}, or slip_speed_m_s "
            "and pressure_MPa for a map"
        )
        yield (), text
    if len(rates) != 1:
        what = f"is {listed(rates, ' and ')}" if rates else "is missing"
        yield (), f"the wear rate {what}; give one of {listed(RATE_COLUMNS)}"
    elif rates == ("wear_coefficient",) and section.hardness_GPa is None:
        text = (
            "hardness_GPa is missing; wear_coefficient needs the hardness of the "
            "wheel, about 3"
        )
        yield (), text
    elif rates != ("wear_coefficient",) and section.hardness_GPa is not None:
        text = (
            f"hardness_GPa acts with wear_coefficient only, not with {rates[0]}; "
            "delete it"
        )
        yield ("hardness_GPa",), text
    if section.beyond == "slope" and (
        len(index) > 1 or section.interpolation == "step"
    ):
        text = (
            'beyond = "slope" is for one index with linear interpolation; write "hold"'
        )
        yield ("beyond",), text


def _first_row_faults(
    section: WearTableSection, index: tuple[str, ...], columns: dict[str, FloatArray]
) -> Iterator[tuple[KeyPath, str]]:
    """Faults of the rule below the first row, stated where there is any."""
    first = next((key for key in index if columns[key].min() > 0.0), None)
    if first is None and section.below is not None:
        yield ("below",), "below acts where the first row is above 0 only; delete it"
    if first is not None and section.below is None:
        row = int(columns[first].argmin())
        text = (
            f"{first} = {columns[first][row]:g} is the first row, and nothing says "
            'what holds below it; write below = "proportional" (a straight line from '
            '0), "hold" (its rate down to no slip) or "zero", or add a row at 0'
        )
        yield (first, row), text


def _line_faults(key: str, axis: FloatArray) -> PathFaults:
    """Faults of the rows of a table of one index, which must rise."""
    falling = (np.flatnonzero(np.diff(axis) <= 0.0) + 1).tolist()
    text = "{} = {:g} must be above {:g}, the row before"
    return [((key, row), text.format(key, axis[row], axis[row - 1])) for row in falling]


def _map_axes(
    index: tuple[str, ...], columns: list[FloatArray], rates: FloatArray
) -> tuple[list[FloatArray], FloatArray, PathFaults]:
    """Axes of a map, the rates on them and its faults; rows may come in any order."""
    (first, i), (second, j) = (
        np.unique(column, return_inverse=True) for column in columns
    )
    grid, faults = np.full((first.size, second.size), np.nan), PathFaults()

    def pair(a: int, b: int) -> str:
        return f"{index[0]} = {first[a]:g} with {index[1]} = {second[b]:g}"

    for row, at in enumerate(zip(i, j, strict=True)):
        if not np.isnan(grid[at]):
            faults.append(((index[0], row), f"{pair(*at)} is given twice; delete one"))
        grid[at] = rates[row]
    missing = np.argwhere(np.isnan(grid))
    faults += [
        ((index[0],), f"no row for {pair(a, b)}; a map needs every pair")
        for a, b in missing
    ]
    return [first, second], grid, faults


def read_wear_table(path: str | Path) -> WearTable:
    """Read a wear table, named after its file, from TOML (suffix .toml) or CSV.

    See the head of this module.

    Raises
    ------
    SceneError
        All faults of the first stage that has any: syntax; keys, types and ranges; what
        does not fit together. ``file:line: message``.
    """
    path = Path(path)
    file = str(path)
    content = content_of(path, "a wear table")
    if path.suffix.lower() == ".toml":
        text = text_of(content, file)
        data, lines = toml_of(text, file), key_lines(text)
    else:
        data, lines = _parsed_csv(file, content)
    try:
        section = WearTableSection.model_validate(data)
    except ValidationError as error:
        raise SceneError(
            validation_faults(error, WearTableSection, lines, file)
        ) from None
    table, faults = wear_table(section, path.stem)
    if table is None:
        listed = [Fault(message, file, line_of(lines, at)) for at, message in faults]
        raise SceneError(sorted(listed, key=lambda fault: fault.line or 0))
    return table


def _parsed_csv(file: str, content: bytes) -> tuple[dict[str, Any], Lines]:
    """Keys of the comment lines and columns of a CSV file, as in TOML, with lines."""
    data: dict[str, Any] = {}
    lines: Lines = {}
    table = csv_table(content, file)
    for line, row in table.comments:
        key, equals, value = (
            part.strip() for part in row.removeprefix("#").partition("=")
        )
        if equals and key in WearTableSection.model_fields:
            data[key], lines[key,] = _number_or_text(value.strip('"')), line
    names = {name: name for name in table.header}
    raise_any([*table.faults, *unit_faults(table, file, names)])
    for k, name in enumerate(table.header):
        data[name], lines[name,] = (
            [_number_or_text(cells[k]) for _, cells in table.rows],
            table.line,
        )
        lines |= {(name, row): line for row, (line, _) in enumerate(table.rows)}
    return data, lines


def _number_or_text(cell: str) -> float | str:
    try:
        return float(cell)
    except ValueError:
        return cell
