"""Which variables a result file has: dimensions, stored types, what may be missing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import netCDF4
import numpy as np

from wearsim.errors import NumericalError, ResultError

SCHEMA = 3
PATCH_SLOTS = 8
REGIME_FLAGS = ("wear_regime", "wear_regime_highest")

FILL_FLOAT = float(netCDF4.default_fillvals["f8"])
FILL_INT = int(netCDF4.default_fillvals["i4"])


@dataclass(frozen=True)
class Variable:
    """Place of one variable in the file.

    Parameters
    ----------
    dimensions : tuple of str
        Names of its dimensions, `step` first where it has one.
    kind : {"f8", "i4", "str"}
        Stored type.
    missing : bool
        Whether values may be missing (no patch in the slot, quantity undefined).
    """

    dimensions: tuple[str, ...]
    kind: str = "f8"
    missing: bool = False


def _layout() -> dict[str, Variable]:
    wheel = ("step", "wheel")
    along = (*wheel, "point")
    patch = ("step", "operating_point", "patch")
    layout = {
        "wheel_name": Variable(("wheel",), "str"),
        "regime_name": Variable(("regime",), "str"),
        "op_label": Variable(("operating_point",), "str"),
        "arc_length": Variable(("point",)),
        "counterface_y": Variable(("counterface_point",)),
        "counterface_z": Variable(("counterface_point",)),
    }
    for name in [
        "shift",
        "yaw",
        "roll",
        "wheel_load",
        "speed",
        "friction",
        "track_curvature",
        "environment",
        "weight",
        "block_length",
    ]:
        layout[f"op_{name}"] = Variable(("operating_point",))
    for name in ("distance", "step_length", "stability_number"):
        layout[name] = Variable(("step",))
    layout["step_error"] = Variable(("step",), missing=True)
    layout["rejected_steps"] = Variable(("step",), "i4")
    layout["contact_models"] = Variable(("step",), "i4")
    layout["contact_models_error"] = Variable(("step",), missing=True)
    layout["active_weight"] = Variable(("step", "operating_point"))
    for name in ("profile_y", "profile_z", "wear_depth", "friction_work"):
        layout[name] = Variable(along)
    layout["wear_depth_by_regime"] = Variable(("step", "wheel", "regime", "point"))
    for name in ("flange_height", "flange_thickness", "flange_gradient", "hollowing"):
        layout[name] = Variable(wheel, missing=True)
    for name in ("worn_area", "worn_mass", "max_wear_depth"):
        layout[name] = Variable(wheel)
    layout["equivalent_conicity"] = Variable(("step",), missing=True)
    layout["n_patch"] = Variable(("step", "operating_point"), "i4")
    layout["patch_side"] = Variable(patch, "i4", missing=True)
    for name in [
        "wheel_y",
        "rail_y",
        "contact_x",
        "contact_angle",
        "area",
        "max_pressure",
        "patch_length",
        "patch_width",
        "approach",
        "normal_force",
        "load_scale",
        "creepage_x",
        "creepage_y",
        "spin",
        "force_x",
        "force_y",
        "spin_moment",
        "slip_area",
        "power",
        "power_balance",
        "wear_index_mean",
        "wear_index_max",
        "wear_area_rate",
        "wear_depth_rate_max",
    ]:
        layout[name] = Variable(patch, missing=True)
    for name in REGIME_FLAGS:
        layout[name] = Variable(patch, "i4", missing=True)
    return layout


LAYOUT: Mapping[str, Variable] = _layout()
"""All variables of a result file."""

STATIC = tuple(name for name, variable in LAYOUT.items() if "step" not in variable.dimensions)
"""Names of the variables that are written once."""

ROW = tuple(name for name, variable in LAYOUT.items() if "step" in variable.dimensions)
"""Names of the variables of one row."""

COORDINATES = ("distance", "wheel_name", "regime_name", "op_label", "arc_length")
"""Coordinates; they never carry a fill value."""


@dataclass(frozen=True)
class Header:
    """All of a result file that does not change from step to step.

    Parameters
    ----------
    static : mapping
        The variables named in `STATIC`: arrays [SI units], or sequences of str.
    attributes : mapping
        Global attributes, str or number; empty ones are not written.
    """

    static: Mapping[str, Any]
    attributes: Mapping[str, str | int | float]

    @property
    def sizes(self) -> dict[str, int]:
        """Lengths of all fixed dimensions."""
        sizes = {"patch": PATCH_SLOTS}
        for name in STATIC:
            sizes[LAYOUT[name].dimensions[0]] = len(self.static[name])
        return sizes


Row = Mapping[str, np.ndarray]
"""The variables named in `ROW` for one step, without the step axis; missing values are fill values."""


def check_row(header: Header, row: Row) -> None:
    """Raise unless `row` has exactly the variables of the schema, in shape and free of NaN.

    Parameters
    ----------
    header : Header
        Of the file the row is for.
    row : mapping of arrays
        See `Row`.
    """
    sizes = header.sizes
    if set(row) != set(ROW):
        wrong = ", ".join(sorted(set(row) ^ set(ROW)))
        raise ResultError(f"a result row must have exactly the variables of the schema; check {wrong}")
    for name in ROW:
        value = np.asarray(row[name])
        shape = tuple(sizes[d] for d in LAYOUT[name].dimensions[1:])
        if value.shape != shape:
            raise ResultError(f"result variable {name} has shape {value.shape} where {shape} is needed")
        if not np.all(np.isfinite(value)):
            place = tuple(int(i) for i in np.argwhere(~np.isfinite(value))[0])
            raise NumericalError(
                f"{name}{list(place)} is not a finite number; nothing was written, the last step is safe"
            )
