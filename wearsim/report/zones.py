"""Wear by block or class and zone of the wheel profile, in summaries and reports."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import xarray as xr

from wearsim.profile.worn import WHEEL_ZONES
from wearsim.report.figures.campaign import WHEELS
from wearsim.report.style import capital
from wearsim.report.tables import Table, table
from wearsim.results.zones import zone_table

MOST_ROWS = 6
"""Blocks or classes of a summary; the wear of the others is added up."""

_WIDTH, _NAME = 8, 32  # of a column of numbers, and of names, in a summary


def zones(dataset: xr.Dataset) -> dict[str, dict[str, dict[str, float]]]:
    """Share of each block or class, wheel and zone in the wear of both wheels [-]."""
    shares = zone_table(dataset)
    return {
        str(name): {
            wheel: {zone: float(row[wheel, zone]) for zone in WHEEL_ZONES}
            for wheel in WHEELS
        }
        for name, row in shares.iterrows()
    }


def summary_lines(shares: Mapping[str, Any], everything: bool) -> list[str]:
    """Write the shares of `zones` as a table for a terminal."""
    if not shares:
        return []
    rows = {
        name: [share for wheel in WHEELS for share in of[wheel].values()]
        for name, of in shares.items()
    }
    first = len(rows) if everything or len(rows) <= MOST_ROWS + 1 else MOST_ROWS
    shown = dict(list(rows.items())[:first])
    rest = list(rows.values())[first:]
    if rest:
        shown[f"{len(rest)} others"] = [
            sum(column) for column in zip(*rest, strict=True)
        ]
    if len(rows) > 1:
        shown["all"] = [sum(column) for column in zip(*rows.values(), strict=True)]
    heads = ["flange", "root", "tread", "field"] * len(WHEELS)
    wheels = [f"{wheel}:" for wheel in WHEELS for _ in WHEEL_ZONES]
    above = [text if k % len(WHEEL_ZONES) == 0 else "" for k, text in enumerate(wheels)]
    lines = [
        _line("Share of the wear by zone [%]", above),
        _line("", heads),
        *(
            _line(name, [f"{100.0 * share:.1f}" for share in row])
            for name, row in shown.items()
        ),
    ]
    return [line.rstrip() for line in lines]


def _line(name: str, cells: list[str]) -> str:
    short = name if len(name) < _NAME else f"{name[: _NAME - 4]}..."
    return f"{short:<{_NAME}}" + "".join(f"{cell:>{_WIDTH}}" for cell in cells)


def tables(dataset: xr.Dataset) -> list[Table]:
    """Tabulate the shares of the wear by block or class and zone of both wheels."""
    shares = zone_table(dataset)
    if shares.empty:
        return []
    rows = [[name, *(100.0 * row)] for name, row in shares.iterrows()]
    heads = [f"{capital(zone)} [%]" for _ in WHEELS for zone in WHEEL_ZONES]
    wheels = [(f"{capital(wheel)} wheel", len(WHEEL_ZONES)) for wheel in WHEELS]
    bands = [("", 1), *wheels]
    return [table("wear_by_zone", rows, *heads, digits=3, bands=bands)]
