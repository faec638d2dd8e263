"""What a result file holds: variables by `wearsim.quantities`, its static part, one row, and their check."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import netCDF4
import numpy as np

from wearsim.errors import NumericalError, ResultError
from wearsim.quantities import QUANTITIES, Quantity

if TYPE_CHECKING:
    import xarray as xr

SCHEMA = 5
CONVERGENCE = "convergence.json"
"""Table of `wearsim run --converge` in a run directory."""
PATCH_SLOTS = 8
REGIME_FLAGS = ("wear_regime", "wear_regime_highest")

FILL_FLOAT = float(netCDF4.default_fillvals["f8"])
FILL_INT = int(netCDF4.default_fillvals["i4"])

_STORED = [quantity for quantity in QUANTITIES.values() if quantity.dimensions]

LAYOUT: Mapping[str, Quantity] = {each.name: each for each in _STORED if not each.group}
"""Variables that every result file has."""

GROUPS: Mapping[str, Mapping[str, Quantity]] = {
    group: {each.name: each for each in _STORED if each.group == group}
    for group in dict.fromkeys(each.group for each in _STORED if each.group)
}
"""Variables that only results of some scenes have: all of a group, or none. The first one decides."""

ROW = tuple(name for name, quantity in LAYOUT.items() if "step" in quantity.dimensions)
"""Names of the variables of one row."""

CHANGES = "settings_changed"
"""Attribute that lists settings which were changed between steps."""

COORDINATES = ("distance", "wheel_name", "regime_name", "operating_point_name", "arc_length")
"""Coordinates; they never carry a fill value."""

LABELS = (*COORDINATES, *(next(iter(group)) for group in GROUPS.values()))
"""Coordinates with those of the groups."""


def layout_of(names: Container[str]) -> dict[str, Quantity]:
    """Return all variables of a result file that has those called `names`, or has them in its static part."""
    layout = dict(LAYOUT)
    for group in GROUPS.values():
        if next(iter(group)) in names:
            layout |= group
    return layout


def row_names(names: Container[str]) -> tuple[str, ...]:
    """Return the variables of one row of a result file that has the variables `names`."""
    return tuple(name for name, quantity in layout_of(names).items() if "step" in quantity.dimensions)


@dataclass(frozen=True)
class Header:
    """All of a result file that does not change from step to step."""

    static: Mapping[str, Any]  # variables without the dimension `step`: arrays [SI], or sequences of str
    attributes: Mapping[str, str | int | float]  # global ones; empty ones are not written

    @property
    def sizes(self) -> dict[str, int]:
        """Lengths of all fixed dimensions."""
        static = {n: q.dimensions for n, q in layout_of(self.static).items() if "step" not in q.dimensions}
        return {"patch": PATCH_SLOTS} | {dims[0]: len(self.static[name]) for name, dims in static.items()}


Row = Mapping[str, np.ndarray]
"""The variables named in `ROW` for one step, without the step axis; missing values are fill values."""


def check_row(header: Header, row: Row) -> None:
    """Raise unless `row` has exactly the variables of the file, in shape and free of NaN."""
    sizes, layout, names = header.sizes, layout_of(header.static), row_names(header.static)
    if set(row) != set(names):
        wrong = ", ".join(sorted(set(row) ^ set(names)))
        raise ResultError(f"a result row must have exactly the variables of the schema; check {wrong}")
    for name in names:
        value = np.asarray(row[name])
        shape = tuple(sizes[d] for d in layout[name].dimensions[1:])
        if value.shape != shape:
            raise ResultError(f"result variable {name} has shape {value.shape} where {shape} is needed")
        if not np.all(np.isfinite(value)):
            place = tuple(int(i) for i in np.argwhere(~np.isfinite(value))[0])
            raise NumericalError(
                f"{name}{list(place)} is not a finite number; nothing was written, the last step is safe"
            )


OLDER_SCHEMAS = (3, 4)
"""Schemas that differ from the present one in names and variables added since alone (3: wearsim 0.1)."""

FAINT = tuple(f"faint_{name}{largest}" for name in ("load", "power", "wear") for largest in ("", "_max"))
"""Variables on what faint patches lost."""

ADDED = (*FAINT, "step_limit", "stages", "point_length", "point_error", "point_stiffness")
"""Variables that older schemas do not have."""

RENAMED: Mapping[str, str] = {
    **{each.formerly: each.name for each in QUANTITIES.values() if each.formerly},
    "beside": "comparison",
    "beside_regime": "comparison_regime",
    **{f"beside_{name}": f"comparison_{name}" for name in ("numbers", "materials", "validity", "departures")},
    "wear_coefficients_doubts": "wear_coefficients_warnings",
    **{f"turning_{name}": f"reprofiling_{name}" for name in ("limits", "distances", "least_cut")},
}
"""Present name by the name of schema 3."""


def renamed(dataset: xr.Dataset) -> xr.Dataset:
    """Give a dataset of an older result or translation file the present names; others stay as they are."""
    names = {str(name) for name in (*dataset.variables, *dataset.dims)}
    new = {old: present for old, present in RENAMED.items() if old in names}
    if not new:
        return dataset
    dataset = dataset.rename(new)
    dataset.attrs = {RENAMED.get(str(key), key): value for key, value in dataset.attrs.items()}
    for name in new.values():
        if name in QUANTITIES and name in dataset:
            dataset[name].attrs["long_name"] = QUANTITIES[name].meaning
    return dataset
