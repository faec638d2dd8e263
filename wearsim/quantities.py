"""The one table of quantities.

Name, symbol, units, meaning, sign, place in result files, input range.

A quantity has one name in Python, JSON, result files and tables; dimensions tell apart
what shares a name: ``shift(operating_point)`` of a result file is the ``shift`` of
`wearsim contact --json`. Result files take units, long names and dimensions from here,
figures their labels and factors; scene files, flags and CSV columns the range of every
number they accept. Numbers are SI inside and in files, in the shown unit in scenes,
flags and tables.

The table is `quantities.csv`, a row for each quantity in the order of result files; its
columns are the parameters of `Quantity`. There a `?` behind the dimensions says that
values may be missing, and `allowed` is an interval in the shown unit, such as
``[0; 1]``, or ``(0; 1]`` without its lower end.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple, SupportsFloat


class InputRange(NamedTuple):
    """Values allowed as input, in the shown unit.

    `high` is included, `low` unless `above`.
    """

    low: float
    high: float
    above: bool = False


@dataclass(frozen=True)
class Quantity:
    """One quantity of the field.

    Parameters
    ----------
    name : str
        As in result files, in JSON and as the Python name.
    symbol : str
        As in the literature, Unicode.
    unit : str
        SI unit in UDUNITS form, "1" for ratios, "" for names and flags.
    shown_unit : str
        Unit people read and write.
    shown_factor : float
        Shown value = stored value * factor.
    meaning : str
        One short phrase; the `long_name` of result files.
    sign : str
        Sign convention or further remark, where there is one; the `comment` of result
        files.
    dimensions : tuple of str
        In result files, `step` first where it has one; empty if result files do not
        hold it.
    kind : {"f8", "i4", "str"}
        Type stored in result files.
    missing : bool
        Whether values of result files may be missing (no patch in the slot, quantity
        undefined).
    group : str
        Group of variables that only results of some scenes have, all or none; "" if all
        results have it.
    allowed : InputRange, optional
        Range allowed as input, if it is one.
    flags : tuple of str
        Meanings of the values 0, 1, ... of a flag, if they are the same in all results.
    """

    name: str
    symbol: str
    unit: str
    shown_unit: str
    shown_factor: float
    meaning: str
    sign: str = ""
    dimensions: tuple[str, ...] = ()
    kind: str = "f8"
    missing: bool = False
    group: str = ""
    allowed: InputRange | None = None
    flags: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        """Axis label: meaning, symbol and shown unit."""
        unit = f" [{self.shown_unit}]" if self.shown_unit not in ("", "1") else ""
        return (
            f"{self.meaning} {self.symbol}{unit}"
            if self.symbol
            else f"{self.meaning}{unit}"
        )

    @property
    def attributes(self) -> dict[str, str]:
        """Attributes of a variable of a dataset.

        `long_name`, `units` and, with a sign, `comment`.
        """
        texts = {"long_name": self.meaning, "units": self.unit, "comment": self.sign}
        return {key: text for key, text in texts.items() if text}

    @property
    def range(self) -> InputRange:
        """Range allowed as input, in the shown unit.

        Raises ValueError for what is no input.
        """
        if self.allowed is None:
            raise ValueError(f"{self.name} is no input")
        return self.allowed

    def fault(self, value: float, name: str = "") -> str:
        """Message if an input [SI unit] is not finite or out of its range, else empty.

        `name` is its own.
        """
        if not isinstance(value, SupportsFloat):
            return f"{name or self.name} = {value!r} must be a number"
        shown, unit = (
            value * self.shown_factor,
            self.shown_unit if self.shown_unit != "1" else "",
        )
        low, high, above = self.allowed or InputRange(-math.inf, math.inf)
        slack = 1e-9 * abs(shown)  # of the conversion
        if (
            math.isfinite(shown)
            and low - slack <= shown <= high + slack
            and not (above and shown <= low)
        ):
            return ""
        limits = f"{'above' if above else 'at least'} {low:g} and at most {high:g}"
        return (
            f"{name or self.name} = {shown:g} must be "
            f"{limits if self.allowed else 'finite'} {unit}"
        ).rstrip()

    @property
    def span(self) -> tuple[float, float]:
        """Lowest and highest input, in the shown unit."""
        return self.range[:2]


def duration(seconds: float) -> str:
    """Write a time [s] as people say it."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60} min"


NOT_IN_SIGHT = "not in sight"
"""An infinite distance in words."""


def kilometres(distance: float, digits: int = 4) -> str:
    """Write a distance [m] in km with its unit.

    It has some significant digits, whole kilometres in full. Thousands are set apart by
    spaces from 10 000 on. Less than a metre is said to be so.
    """
    km = 1e-3 * distance
    if 0.0 < float(f"{km:.{digits}g}") < 1e-3:
        return "< 0.001 km"
    whole = abs(km) >= 10.0**digits - 0.5
    text = f"{km:,.0f}" if whole else f"{km:,.{digits}g}"
    return text.replace(",", " " if abs(km) >= 9999.5 else "") + " km"


def _number(text: str) -> float:
    return int(text) if text.lstrip("-").isdigit() else float(text)


def _quantity(row: dict[str, str]) -> Quantity:
    """Quantity of a row of the table."""
    dimensions, limits = row["dimensions"].split(), row["allowed"]
    allowed = None
    if limits:
        low, high = limits[1:-1].split("; ")
        allowed = InputRange(_number(low), _number(high), above=limits.startswith("("))
    return Quantity(
        row["name"],
        row["symbol"],
        row["unit"],
        row["shown_unit"],
        float(row["shown_factor"]),
        row["meaning"],
        row["sign"],
        tuple(name for name in dimensions if name != "?"),
        row["kind"],
        "?" in dimensions,
        row["group"],
        allowed,
        tuple(row["flags"].split()),
    )


def _read(path: Path) -> tuple[Quantity, ...]:
    with path.open(encoding="utf-8", newline="") as file:
        rows = csv.DictReader(line for line in file if not line.startswith("#"))
        return tuple(map(_quantity, rows))


_ROWS = _read(Path(__file__).with_name("quantities.csv"))

QUANTITIES: Mapping[str, Quantity] = MappingProxyType({row.name: row for row in _ROWS})
"""All quantities by name."""

GRAVITY = 9.81
"""Acceleration of gravity [m/s2]."""

STEP_LIMITS = tuple(flag.replace("_", " ") for flag in QUANTITIES["step_limit"].flags)
"""What limits a wear step, in the order of the flags of `step_limit`; none in the
initial state.
"""
