"""Files of limits: gauge values with their bounds, the diameters they hold for, source and certainty.

A file of limits is TOML: `title`, `source` and `certainty` of the whole, then `[[limit]]` tables with
`measure`, `min_mm` and `max_mm` (`min` and `max` of quantities without unit), where needed the wheel
diameters it holds for, `diameter_mm = { above = 760, up_to = 840 }` (`above` and `below` exclude their
number, `from` and `up_to` include it), and where it differs its own `source` and `certainty`.
"""

from __future__ import annotations

import difflib
import math
import re
import tomllib
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from wearsim.errors import ProfileError
from wearsim.profile.formats.text import Faults, read_text
from wearsim.profile.standard import shipped_path
from wearsim.quantities import QUANTITIES

LIMITED = (
    "flange_height",
    "flange_thickness",
    "flange_gradient",
    "hollowing",
    "rim_width",
    "wheel_diameter",
    "wheel_diameter_difference",
    "back_to_back",
    "front_to_front",
    "equivalent_conicity",
)
"""Measures that may have limits; of a diameter difference its size counts."""

BOUNDS = ("min", "max")
_DIAMETER_DIGITS = 6  # diameters are compared in whole micrometres
_ENDS = ("above", "from", "up_to", "below")


@dataclass(frozen=True)
class DiameterRange:
    """Wheel diameters a limit holds for.

    Parameters
    ----------
    low, high : float
        Ends, 0 and inf where there is none [m].
    low_belongs, high_belongs : bool
        Whether the end itself is within.
    """

    low: float = 0.0
    high: float = math.inf
    low_belongs: bool = True
    high_belongs: bool = True

    def __contains__(self, diameter: float) -> bool:
        """Tell whether a diameter [m] is within."""
        d = round(diameter, _DIAMETER_DIGITS)
        above = d >= self.low if self.low_belongs else d > self.low
        return above and (d <= self.high if self.high_belongs else d < self.high)

    @property
    def text(self) -> str:
        """Such as "760 < D <= 840 mm"; empty if all diameters are within."""
        low = f"{self.low * 1e3:g} {'<=' if self.low_belongs else '<'} " if self.low > 0.0 else ""
        high = f" {'<=' if self.high_belongs else '<'} {self.high * 1e3:g}" if self.high < math.inf else ""
        if low and not high:
            return f"D {'>=' if self.low_belongs else '>'} {self.low * 1e3:g} mm"
        return f"{low}D{high} mm" if high else ""


@dataclass(frozen=True)
class Limit:
    """One limit.

    Parameters
    ----------
    measure : str
        Name in `wearsim.quantities`.
    least, most : float or None
        In SI units; None: no such bound.
    diameters : DiameterRange
        What it holds for.
    source, certainty : str
        Where it comes from and how sure it is.
    """

    measure: str
    least: float | None
    most: float | None
    diameters: DiameterRange
    source: str
    certainty: str


@dataclass(frozen=True)
class LimitSet:
    """Limits of one file.

    Parameters
    ----------
    name, title : str
        Name of the file and what it says it is.
    limits : tuple of Limit
        In the order of the file.
    """

    name: str
    title: str
    limits: tuple[Limit, ...]


def load_limits(name_or_path: str | Path = "TSI") -> LimitSet:
    """Limits by the name of a shipped set or from a file of the same form.

    Parameters
    ----------
    name_or_path : str or Path
        "TSI", or a path to a TOML file, see the head of this module.

    Returns
    -------
    LimitSet
        In SI units.

    Raises
    ------
    ProfileError
        All faults of the file, ``file:line: message``; or there is no such set.
    """
    path = Path(name_or_path)
    if not path.is_file() and not path.suffix and len(path.parts) == 1:
        folder = shipped_path("profiles", "limits")
        names = sorted(each.stem for each in folder.glob("*.toml"))
        if path.name not in names:
            near = difflib.get_close_matches(path.name, names, n=1, cutoff=0.5)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            raise ProfileError(
                f"{str(name_or_path)!r} is neither a file nor a shipped set of limits "
                f"({', '.join(names)}){hint}"
            )
        path = folder / f"{path.name}.toml"
    if not path.is_file():
        raise ProfileError(f"{path}: no such file of limits")
    lines = read_text(path, utf8_only=True).lines
    faults = Faults(path)
    try:
        data = tomllib.loads("\n".join(lines) + "\n")
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        place = re.search(r"\(at line (\d+), column \d+\)", str(error))
        text = str(error).replace(f" {place[0]}", "") if place else str(error) or "nested too deeply"
        faults.add(f"is not TOML: {text}", int(place[1]) if place else None)
        faults.refuse()
    result = _Reader(lines, faults).whole(path.stem, data)
    faults.refuse()
    return result


class _Reader:
    """Reads the data of one file and notes all faults with their lines."""

    def __init__(self, lines: tuple[str, ...], faults: Faults) -> None:
        self.lines = lines
        self.faults = faults
        heads = [k for k, line in enumerate(lines) if re.match(r"\s*\[\[\s*limit\s*\]\]", line)]
        self.blocks = list(pairwise([*heads, len(lines)]))
        self.top = (-1, heads[0] if heads else len(lines))

    def line(self, block: tuple[int, int] | None, key: str | None = None) -> int | None:
        """Line of a key in a block (of its head without key), None where it cannot be told."""
        if block is None:
            return None
        for k in range(block[0] + 1, block[1]) if key else ():
            if re.match(rf"\s*[\"']?{re.escape(str(key))}[\"']?\s*[=.]", self.lines[k]):
                return k + 1
        return block[0] + 1 if block[0] >= 0 else None

    def text(self, table: dict[str, Any], key: str, block: tuple[int, int] | None) -> str:
        """Text of a key that may be missing."""
        value = table.pop(key, "")
        if not isinstance(value, str):
            self.faults.add(f"{key} = {value!r} must be a text", self.line(block, key))
            return ""
        return value.strip()

    def number(self, value: object, words: str, line: int | None) -> float | None:
        """Return a positive number, or note what is wrong."""
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value < 1e6:
            self.faults.add(f"{words} = {value!r} must be a number of 0 or more", line)
            return None
        return float(value)

    def whole(self, name: str, data: dict[str, Any]) -> LimitSet:
        """Read the whole file."""
        title = self.text(data, "title", self.top) or name
        source = self.text(data, "source", self.top)
        certainty = self.text(data, "certainty", self.top)
        tables = data.pop("limit", [])
        for key in data:
            self.faults.add(
                f"{key} is none of title, source, certainty and [[limit]]; delete it",
                self.line(self.top, key),
            )
        if not isinstance(tables, list) or not all(isinstance(each, dict) for each in tables):
            self.faults.add("limit must be tables: begin each with [[limit]]", self.line(self.top, "limit"))
            tables = []
        elif not tables:
            self.faults.add("holds no limit; give at least one [[limit]] table")
        blocks = self.blocks if len(self.blocks) == len(tables) else [None] * len(tables)
        limits = [
            self.limit(dict(each), block, source, certainty)
            for each, block in zip(tables, blocks, strict=True)
        ]
        return LimitSet(name, title, tuple(each for each in limits if each is not None))

    def limit(
        self, table: dict[str, Any], block: tuple[int, int] | None, source: str, certainty: str
    ) -> Limit | None:
        """Read one `[[limit]]` table; None if it has faults."""
        before = len(self.faults.found)
        measure = table.pop("measure", None)
        if measure not in LIMITED:
            near = difflib.get_close_matches(str(measure), LIMITED, n=1, cutoff=0.5)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            told = "measure is missing" if measure is None else f"measure = {measure!r} is not known"
            self.faults.add(f"{told}; it is one of {', '.join(LIMITED)}{hint}", self.line(block, "measure"))
            return None
        length = QUANTITIES[measure].unit == "m"
        unit, per = ("_mm", 1e3) if length else ("", 1.0)
        bounds: list[float | None] = []
        for bound in BOUNDS:
            key = f"{bound}{unit}"
            value = table.pop(key, None)
            number = None if value is None else self.number(value, key, self.line(block, key))
            bounds.append(None if number is None else number / per)
        least, most = bounds
        diameters = self.diameters(table.pop("diameter_mm", None), self.line(block, "diameter_mm"))
        source = self.text(table, "source", block) or source
        certainty = self.text(table, "certainty", block) or certainty
        for key in table:
            self.faults.add(
                f"{key} is no key of a limit of {measure} (min{unit}, max{unit}, diameter_mm, source, "
                "certainty); delete it",
                self.line(block, key),
            )
        if len(self.faults.found) == before:
            if least is None and most is None:
                self.faults.add(f"gives no min{unit} and no max{unit} of {measure}", self.line(block))
            elif least is not None and most is not None and least > most:
                self.faults.add(
                    f"min{unit} = {least * per:g} is above max{unit} = {most * per:g}",
                    self.line(block, f"min{unit}"),
                )
            if not source or not certainty:
                self.faults.add(
                    f"the limit of {measure} has no {'certainty' if source else 'source'}; give it for "
                    "the limit or for the file",
                    self.line(block),
                )
        if len(self.faults.found) > before:
            return None
        return Limit(measure, least, most, diameters, source, certainty)

    def diameters(self, value: object, line: int | None) -> DiameterRange:
        """Read `diameter_mm`."""
        if value is None:
            return DiameterRange()
        form = "diameter_mm must be like { above = 760, up_to = 840 } (or from, below)"
        if not isinstance(value, dict) or not value or not set(value) <= set(_ENDS):
            self.faults.add(form, line)
            return DiameterRange()
        if {"above", "from"} <= set(value) or {"up_to", "below"} <= set(value):
            self.faults.add(f"{form}, with one lower and one upper end", line)
            return DiameterRange()
        ends = {key: self.number(each, f"diameter_mm.{key}", line) for key, each in value.items()}
        low = ends.get("above", ends.get("from", 0.0))
        high = ends.get("up_to", ends.get("below", math.inf))
        if low is None or high is None:
            return DiameterRange()
        if low >= high:
            self.faults.add(f"diameter_mm: {low:g} must be below {high:g}", line)
        return DiameterRange(low / 1e3, high / 1e3, "above" not in ends, "below" not in ends)
