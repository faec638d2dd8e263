"""Points as they stand in a file, before any axis or unit is settled."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from decimal import Context, Decimal
from typing import Literal

import numpy as np

from wearsim.profile.formats.text import Faults
from wearsim.profile.shape import FloatArray

MAX_POINTS = 1_000_000
MAX_CELL = 1000  # characters of one number
_LARGEST = 1e6  # in any unit; keeps sums and products of points finite
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]{1,3})?")
_NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity|1\.#\w*)", re.IGNORECASE)
_ALMOST_NUMBER = re.compile(r"[+-]?\.?\d")
COMMA_TWICE = (
    "commas stand between the columns and for the decimal mark: separate the columns by semicolons, or write "
    "decimal points"
)
# Digits enough to add 70 mm to any double without rounding.
EXACT = Context(prec=400)


@dataclass(frozen=True)
class Points:
    """What a reader of one format found.

    Parameters
    ----------
    lines : list of int
        Line of each point.
    y, z : list of str
        Decimals of the lateral and the vertical coordinate, as written.
    y_axis : {"field", "centre", "unknown"}
        Whither the file's y grows by the rules of its format: to the field side or towards the track
        centre.
    z_axis : {"down", "up", "unknown"}
        Whither its z grows; down is towards the flange tip of a wheel.
    shift_y, shift_z : Decimal
        To be added to the file's numbers (keys of SIMPACK).
    mirror_y, mirror_z : bool
        Signs to be changed after that (keys of SIMPACK).
    metres : Decimal or None
        Length of the file's unit [m]; None if the file does not say.
    tape : Decimal or None
        Distance of the tape line from the flange back told in the file [mm].
    header : dict of str to str
        Keys and values, unchanged.
    notes : tuple of str
        What the user should be told.
    """

    lines: list[int]
    y: list[str]
    z: list[str]
    y_axis: Literal["field", "centre", "unknown"] = "unknown"
    z_axis: Literal["down", "up", "unknown"] = "unknown"
    shift_y: Decimal = Decimal(0)
    shift_z: Decimal = Decimal(0)
    mirror_y: bool = False
    mirror_z: bool = False
    metres: Decimal | None = None
    tape: Decimal | None = None
    header: dict[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Elsewhere:
    """A profile that stands in another file (a slice).

    Parameters
    ----------
    file : str
        Its name, relative to the file read.
    line : int
        Where it is named.
    header : dict of str to str
        Keys and values.
    notes : tuple of str
        What the user should be told.
    """

    file: str
    line: int
    header: dict[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


class Columns:
    """Collects the points of a file line by line."""

    def __init__(self, faults: Faults) -> None:
        self.faults = faults
        self.lines: list[int] = []
        self.y: list[str] = []
        self.z: list[str] = []
        self.refused = 0  # lines that are there, but hold no point

    def add(self, line: int, y: str, z: str, separator: str, names: str = "yz") -> None:
        """Take the cells of one line, or note what is wrong with them."""
        if separator != ",":
            y, z = y.replace(",", "."), z.replace(",", ".")
        wrong = number_fault(y), number_fault(z)
        if wrong != (None, None):
            self.refused += 1
            for name, cell, fault in zip(names, (y, z), wrong, strict=True):
                if fault is not None:
                    self.faults.add(f"{name} = {cell[:40]!r} {fault}", line, f"{name} {fault}")
            return
        self.lines.append(line)
        self.y.append(y)
        self.z.append(z)
        if len(self.lines) > MAX_POINTS:
            self.faults.add(
                f"more than {MAX_POINTS} points, hardly one profile; give one cross-section", line
            )
            self.faults.refuse()


def number_fault(cell: str) -> str | None:
    """Tell what is wrong with a number, None if nothing is."""
    if len(cell) > MAX_CELL:
        return f"is longer than {MAX_CELL} characters"
    if _NUMBER.fullmatch(cell):
        # 1 km is beyond any profile in any unit
        if abs(float(cell)) <= _LARGEST:
            return None
        return "is too large for a profile; check units and columns"
    if _NOT_FINITE.fullmatch(cell):
        return "is not a finite number; delete the line or repeat the measurement"
    return "is not a number" if cell else "is missing"


def is_number(cell: str) -> bool:
    """Tell whether a cell is a decimal number, with point or comma."""
    return len(cell) <= MAX_CELL and _NUMBER.fullmatch(cell.replace(",", ".")) is not None


def looks_like_number(cell: str) -> bool:
    """Tell whether a cell begins like a number or stands for one that is not finite."""
    return _ALMOST_NUMBER.match(cell) is not None or _NOT_FINITE.fullmatch(cell[:20]) is not None


def separator_of(line: str) -> str:
    """Separator of the columns, told from the first line of numbers; "" means blanks and tabs."""
    if ";" in line:
        return ";"
    cells = line.split()
    # "12,5 3,1" has decimal commas, "12.5, 3.1" a comma between the columns
    if len(cells) >= 2 and not any(cell[0] == "," or cell[-1] == "," for cell in cells):
        return ""
    return "," if "," in line else ""


def split_cells(line: str, separator: str) -> list[str]:
    """Cells of a line."""
    if separator == "":
        return line.split()
    return [cell.strip() for cell in line.split(separator)]


def as_floats(cells: list[str]) -> FloatArray:
    """Numbers in the unit of the file."""
    return np.array([float(cell) for cell in cells])


def scaled(cells: list[str], shift: Decimal, factor: Decimal, offset: Decimal) -> FloatArray:
    """Exact (cell + shift) * factor + offset, each rounded once to a double.

    Parameters
    ----------
    cells : list of str
        Decimals.
    shift : Decimal
        In the unit of the file.
    factor : Decimal
        To metres; negative mirrors.
    offset : Decimal
        Added at last [m].

    Returns
    -------
    (n,) array
        In metres; zeros are positive.
    """
    sign, digits, exponent = factor.as_tuple()
    if shift == 0 and offset == 0 and digits == (1,) and isinstance(exponent, int):
        # moving the decimal point is exact and three times as fast as decimal arithmetic
        values = np.array([_moved(cell, exponent) for cell in cells])
        return (-values if sign else values) + 0.0
    exact = [
        float(EXACT.add(EXACT.multiply(EXACT.add(Decimal(cell), shift), factor), offset)) for cell in cells
    ]
    return np.array(exact) + 0.0


def _moved(cell: str, places: int) -> float:
    """Value of a decimal with its point moved."""
    mantissa, _, exponent = cell.lower().partition("e")
    return float(f"{mantissa}e{int(exponent or 0) + places}")
