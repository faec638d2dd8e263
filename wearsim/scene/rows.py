"""CSV files whose columns are keys of a table: each row becomes what a table of the scene file would."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from wearsim.errors import Fault, raise_any
from wearsim.scene.section import Section
from wearsim.texts import shown
from wearsim.toml_faults import content_of, decimal, suggestion, text_of, validation_faults

Row = TypeVar("Row", bound=Section)


def read_rows(
    path: Path, model: type[Row], what: str, defaults: Mapping[str, Any] | None = None
) -> tuple[Row, ...]:
    """Read the rows of a CSV file, each a table of `model` with `defaults` for cells that are empty.

    Raises
    ------
    SceneError
        With all faults of the file, each with its line; also if it has no rows.
    """
    rows = list(csv.reader(io.StringIO(text_of(content_of(path, f"a table of {what}s"), str(path)))))
    header = [cell.strip() for cell in rows[0]] if rows else []
    known = list(model.model_fields)
    unknown = [name for name in header if name not in known]
    faults = [
        Fault(f"column {shown(name)} is no key of a {what}; {suggestion(name, known)}", str(path), 1)
        for name in unknown
    ]
    twice = [name for name in dict.fromkeys(header) if header.count(name) > 1]
    faults += [
        Fault(f"column {shown(name)} stands twice; delete one of them", str(path), 1) for name in twice
    ]
    long = [line for line, cells in enumerate(rows[1:], 2) if len(cells) > len(header)]
    text = f"more cells than the header has, {len(header)}; write decimals with a point"
    faults += [Fault(text, str(path), line) for line in long]
    found = []
    for line, cells in enumerate(rows[1:], 2) if not unknown else ():
        if not any(cell.strip() for cell in cells):
            continue
        values = {
            name: _cell(name, cell.strip()) for name, cell in zip(header, cells, strict=False) if cell.strip()
        }
        try:
            found.append(model.model_validate({**(defaults or {}), **values}))
            found[-1]._place = str(path), line
        except ValidationError as error:
            faults += [
                Fault(one.message, str(path), line) for one in validation_faults(error, model, {}, str(path))
            ]
    if not faults and not found:
        text = f"holds no {what}s; give a header with keys of {what}s and one row for each"
        faults.append(Fault(text, str(path)))
    raise_any(faults)
    return tuple(found)


def _cell(name: str, text: str) -> Any:
    """Value of a cell: text, whole number, or decimal; what is neither stays text, which is a fault."""
    if name == "name":
        return text
    value = decimal(text)
    if math.isnan(value) and "nan" not in text.lower():
        return text
    return int(value) if name == "positions" and value.is_integer() else value
