"""What the report of two campaigns of one kind states of both together."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from wearsim.report.answer import Number, about_bands
from wearsim.report.style import band_text, capital, estimate, estimates
from wearsim.report.tables import Table, table
from wearsim.report.texts import caption
from wearsim.translation.side_by_side import BAND_ENDS, band_of

_FIRST = (
    "life",
    "mean distance between reprofilings",
    "loss of diameter each time",
    "worn area",
    "first crack",
    "limit of",
    "worn mass",
)
"""Rows of the table in the order in which they become large numbers, by how their names
begin.
"""
_LIVES = ("life", "mean distance between reprofilings", "limit of")
"""Rows in proportion to the environment factor: large numbers with bands alone."""
_NUMBERS = 3


def numbers(datasets: Sequence[xr.Dataset], rows: pd.DataFrame) -> list[Number]:
    """Give the large numbers of two campaigns side by side.

    `rows` is from `translation.side_by_side`, with bands or without.
    """
    large_numbers, names = [], list(rows.columns[2:4])
    for start in _FIRST:
        for row in rows.to_dict("records"):
            if str(row["quantity"]).startswith(start) and _is_number(row, names):
                large_numbers.append(_number(datasets, row, names, start))
                break
    return list(filter(None, large_numbers))[:_NUMBERS]


def _is_number(row: Mapping[Hashable, Any], names: Sequence[str]) -> bool:
    values = [row[name] for name in names]
    return all(isinstance(value, int | float) and value > 0.0 for value in values)


def _number(
    datasets: Sequence[xr.Dataset],
    row: Mapping[Hashable, Any],
    names: Sequence[str],
    start: str,
) -> Number | None:
    bands = [_band(row, name, row["unit"]) for name in names]
    if start in _LIVES and not all(bands):
        return None
    context: dict[str, Any] = {
        "assumed": about_bands(datasets, drawn=False),
        "quantity": row["quantity"],
        "names": names,
        "bands": bands,
        "ratio": estimate(row["ratio"]),
        "ratio_band": _band(row, "ratio"),
    }
    value = " / ".join(estimates(row[name] for name in names))
    text = caption("number", "pair", **context)
    sure = caption("number", "pair_sure", **context)
    return Number(value, row["unit"], text, sure)


def _band(row: Mapping[Hashable, Any], name: str, unit: str = "") -> str:
    """Write the ends of the band of a number, "" where there is none."""
    ends = band_of(row, name)
    return "" if ends is None else band_text(ends, unit)


def _cells(values: Sequence[Any], digits: int) -> list[str | None]:
    """Write numbers and texts of a row, None where there is none.

    Counts are exact, other numbers estimates in one format.
    """
    texts = iter(estimates(filter(_is_estimate, values), digits))
    return [next(texts) if _is_estimate(value) else _exact(value) for value in values]


def _is_estimate(value: Any) -> bool:
    return isinstance(value, float) and not np.isnan(value)


def _exact(value: Any) -> str | None:
    """Write a count, or give a text as it is."""
    if isinstance(value, int):
        return str(value)
    return None if pd.isna(value) else value


def has_bands(rows: pd.DataFrame | None) -> bool:
    """Return True for a table side by side with bands."""
    return rows is not None and any(
        str(name).endswith(BAND_ENDS) for name in rows.columns
    )


def side_by_side(rows: pd.DataFrame) -> Table:
    """Tabulate life, reprofiling and wear of both, with bands where there are any."""
    names = list(rows.columns[2:4])
    drawn = has_bands(rows)
    made = []
    for row in rows.to_dict("records"):
        unit = f" [{row['unit']}]" if row["unit"] else ""
        if all(row[name] == 0.0 for name in names):
            continue
        cells: list[Any] = [capital(row["quantity"]) + unit]
        texts = _cells([row[name] for name in names], 3 if drawn else 4)
        texts += _cells([row["ratio"]], 3)
        for name, text in zip((*names, "ratio"), texts, strict=True):
            cells.append(text)
            if drawn:
                cells.append(_band(row, name) or None)
        made.append(cells)
    heads = [
        head
        for name in (*names, "Ratio")
        for head in ((name, f"{name}, 90 %") if drawn else (name,))
    ]
    return table("side_by_side", made, *heads, look="numbers", context={"drawn": drawn})
