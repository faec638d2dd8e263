"""Content of a result file: variables, static part, one row, and their checks.

The variables are those of `wearsim.quantities`.
"""

from __future__ import annotations

import math
from collections.abc import Container, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import netCDF4
import numpy as np

from wearsim.errors import NumericalError, ResultError, brief
from wearsim.quantities import QUANTITIES, Quantity
from wearsim.results.settings import SETTINGS, attribute_fault

SCHEMA = 5
PATCH_SLOTS = 8

FILL_FLOAT = float(netCDF4.default_fillvals["f8"])
FILL_INT = int(netCDF4.default_fillvals["i4"])

_STORED = [quantity for quantity in QUANTITIES.values() if quantity.dimensions]

LAYOUT: Mapping[str, Quantity] = {
    quantity.name: quantity for quantity in _STORED if not quantity.group
}
"""Variables that every result file has."""

GROUPS: Mapping[str, Mapping[str, Quantity]] = {
    group: {quantity.name: quantity for quantity in _STORED if quantity.group == group}
    for group in dict.fromkeys(quantity.group for quantity in _STORED if quantity.group)
}
"""Variables of results of some scenes only: all of a group, or none.

The first variable decides.
"""

ROW = tuple(name for name, quantity in LAYOUT.items() if "step" in quantity.dimensions)
"""Names of the variables of one row."""

CHANGES = "settings_changed"
"""Attribute that lists settings changed between steps."""

COORDINATES = (
    "distance",
    "wheel_name",
    "regime_name",
    "operating_point_name",
    "arc_length",
)
"""Coordinates; they never have a fill value."""

LATER: frozenset[str] = frozenset(
    {
        "curve_curvature",
        "force_residual",
        "stood_in",
        "wear_number_with_spin",
        "wear_number_without_spin",
        "tread_wear",
        "root_wear",
        "flange_wear",
        "wheel_diameter",
    }
)
"""Variables introduced after version 0.2.0.

They may be absent in result files of earlier versions.
"""

LABELS = (*COORDINATES, *(next(iter(group)) for group in GROUPS.values()))
"""Coordinates, including those of the groups."""


def layout_of(names: Container[str]) -> dict[str, Quantity]:
    """Return all variables of a result file that has those called `names`.

    The names are those of rows or of the static part.
    """
    layout = dict(LAYOUT)
    for group in GROUPS.values():
        if next(iter(group)) in names:
            layout |= group
    return layout


def row_names(names: Container[str]) -> tuple[str, ...]:
    """Variables of one row of a result file that has the variables `names`."""
    return tuple(
        name
        for name, quantity in layout_of(names).items()
        if "step" in quantity.dimensions
    )


@dataclass(frozen=True)
class Header:
    """Static part of a result file, which does not change from step to step."""

    static: Mapping[
        str, Any
    ]  # variables without the dimension `step`: arrays [SI], or sequences of str
    attributes: Mapping[
        str, str | int | float
    ]  # global ones; empty ones are not written

    @cached_property
    def sizes(self) -> dict[str, int]:
        """Lengths of all fixed dimensions."""
        static = {
            n: q.dimensions
            for n, q in layout_of(self.static).items()
            if "step" not in q.dimensions
        }
        return {"patch": PATCH_SLOTS} | {
            dims[0]: len(self.static[name]) for name, dims in static.items()
        }

    @cached_property
    def row_shapes(self) -> dict[str, tuple[int, ...]]:
        """Shapes of the variables of a row."""
        layout, sizes = layout_of(self.static), self.sizes
        return {
            n: tuple(sizes[d] for d in layout[n].dimensions[1:])
            for n in row_names(self.static)
        }


Row = Mapping[str, np.ndarray]
"""Variables named in `ROW` for one step, without the step axis.

Missing values are fill values.
"""


def check_row(header: Header, row: Row) -> None:
    """Raise an error unless `row` has all variables of the file, in shape.

    Values must not be NaN.
    """
    shapes = header.row_shapes
    if set(row) != set(shapes):
        wrong = ", ".join(sorted(set(row) ^ set(shapes)))
        raise ResultError(
            f"a result row must have exactly the variables of the schema; check {wrong}"
        )
    for name, shape in shapes.items():
        value = np.asarray(row[name])
        if value.shape != shape:
            raise ResultError(
                f"result variable {name} has shape {value.shape} where {shape} is "
                "needed"
            )
        if not np.isfinite(value).all():
            place = tuple(int(i) for i in np.argwhere(~np.isfinite(value))[0])
            raise NumericalError(
                f"{name}{list(place)} is not a finite number; nothing was written, "
                "the last step is safe"
            )


KINDS: dict[str, Any] = {"f8": np.dtype("f8"), "i4": np.dtype("i4"), "str": str}
"""Types of variables in result files by the kind of their quantity."""

LEAST_LENGTHS: Mapping[str, int] = {"point": 4, "counterface_point": 4}
"""Smallest lengths of dimensions that need more than one value."""

NUMBERED: Mapping[str, str] = {
    "wear_regime": "regime",
    "wear_regime_highest": "regime",
    "last_reprofiling": "step",
}
"""Variables whose values are numbers along a dimension, -1 for none."""

REGIME_FLAGS = tuple(name for name, dim in NUMBERED.items() if dim == "regime")
"""Variables whose values are regime numbers."""

PACKED = 1100
"""Largest ratio of unpacked to packed bytes of a result file: deflate reaches 1030."""


def structure_fault(file: netCDF4.Dataset, size: int, part: bool = False) -> str:
    """State how a file of `size` [B] deviates from the table of quantities, or "".

    In a `part` of a result dimensions may be selected away.
    """
    for name, variable in file.variables.items():
        if len(set(variable.dimensions)) < len(variable.dimensions):
            return f"{name} has a dimension twice"
    unpacked = 0
    for name, quantity in layout_of(file.variables).items():
        if name not in file.variables:  # of another version
            continue
        variable = file.variables[name]
        if fault := _shape_fault(variable, quantity, part):
            return f"{name} has {fault}"
        unpacked += 8 * math.prod(variable.shape)
        if unpacked > PACKED * size:
            return (
                f"{name} has {variable.shape} values, more than a file of {size} "
                "bytes holds"
            )
        if fault := _attribute_fault(variable, quantity):
            return f"{name} has {fault}"
    names = file.ncattrs()
    for name, setting in SETTINGS.items():
        if setting.required and name not in names and not part:
            return f"attribute {name} is missing"
    faults = (attribute_fault(name, file.getncattr(name)) for name in names)
    return next(filter(None, faults), "")


def _shape_fault(
    variable: netCDF4.Variable[Any], quantity: Quantity, part: bool
) -> str:
    """Deviation of dimensions, type and lengths of a variable, or ""."""
    selected = part and set(variable.dimensions) <= set(quantity.dimensions)
    if variable.dimensions != quantity.dimensions and not selected:
        needed = quantity.dimensions
        return f"dimensions {variable.dimensions} where {needed} are needed"
    if variable.dtype != KINDS[quantity.kind]:
        return f"type {variable.dtype} where {quantity.kind} is needed"
    for dimension, length in zip(variable.dimensions, variable.shape, strict=True):
        least = 0 if part else LEAST_LENGTHS.get(dimension, 1)
        if length < least or (dimension == "wheel" and length != 2 and not part):
            return f"{length} values along {dimension}"
    return ""


def _attribute_fault(variable: netCDF4.Variable[Any], quantity: Quantity) -> str:
    """Deviation of units and of packing of a variable, or ""."""
    units = getattr(variable, "units", "")
    if not isinstance(units, str) or units != quantity.unit:
        needed = quantity.unit or "none"
        return f"units {brief(str(units))} where {needed} are needed"
    names = {*variable.ncattrs()}
    packing = {"scale_factor", "add_offset", "missing_value", "_Unsigned", "dtype"}
    decoded = packing & names
    if decoded or ("_FillValue" in names) != quantity.missing:
        return f"another {(*decoded, '_FillValue')[0]} than wearsim writes"
    return ""


def value_fault(name: str, values: np.ndarray, sizes: Mapping[Any, int]) -> str:
    """Return the fault of a variable's values in a file of some sizes, or "".

    Missing values are NaN.
    """
    quantity = QUANTITIES.get(name)
    if quantity is None or quantity.kind == "str":
        return ""
    if not quantity.missing and not np.all(np.abs(values) < FILL_FLOAT):
        return f"{name} has values that are missing or no numbers"
    if np.isinf(values).any():
        return f"{name} has infinite values"
    if quantity.flags or name in NUMBERED:
        low, count = (
            (0, len(quantity.flags)) if quantity.flags else (-1, sizes[NUMBERED[name]])
        )
        if np.any((values < low) | (values >= count)):
            return f"{name} has values beyond {low} to {count - 1}"
    falls = {
        "distance": lambda step: step < 0.0,
        "arc_length": lambda step: step <= 0.0,
    }
    if name in falls and falls[name](np.diff(values)).any():
        return f"{name} does not rise"
    return ""
