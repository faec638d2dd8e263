"""Which variables a result file has: dimensions, stored types, what may be missing."""

from __future__ import annotations

from collections.abc import Container, Mapping
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


def _groups() -> dict[str, dict[str, Variable]]:
    along = ("step", "wheel")
    patch = ("step", "operating_point", "patch")
    beside = {
        "beside_name": Variable(("beside",), "str"),
        "beside_coefficients": Variable(("beside",), "str"),
        "beside_source": Variable(("beside",), "str"),
        "beside_doubts": Variable(("beside",), "str"),
        "beside_form": Variable(("beside",), "str"),
        "beside_regime_name": Variable(("beside_regime",), "str"),
        "beside_wear_depth": Variable((*along, "beside", "point")),
        "beside_worn_area": Variable((*along, "beside_regime")),
    }
    fatigue = {
        "fatigue_name": Variable(("fatigue",), "str"),
        "fatigue_coefficients": Variable(("fatigue",), "str"),
        "fatigue_source": Variable(("fatigue",), "str"),
        "fatigue_doubts": Variable(("fatigue",), "str"),
        "fatigue_form": Variable(("fatigue",), "str"),
        "fatigue_crack_width": Variable(("fatigue",)),
        "fatigue_crack_depth": Variable(("fatigue",), missing=True),
        "fatigue_wear_limit": Variable(("fatigue",), missing=True),
        "fatigue_shear_yield": Variable(("fatigue",), missing=True),
        "fatigue_damage": Variable((*along, "fatigue", "point")),
        "fatigue_damage_rate": Variable((*along, "fatigue", "point")),
        "wear_depth_rate": Variable((*along, "point")),
        "balanced_wear_rate": Variable((*along, "fatigue", "point"), missing=True),
        "life_limited_by": Variable((*along, "fatigue", "point"), "i4", missing=True),
        "fatigue_damage_passage": Variable((*patch, "fatigue"), missing=True),
        "fatigue_index": Variable((*patch, "fatigue"), missing=True),
        "fatigue_index_stress": Variable((*patch, "fatigue"), missing=True),
        "fatigue_index_force": Variable((*patch, "fatigue"), missing=True),
        "fatigue_index_y": Variable((*patch, "fatigue"), missing=True),
        "subsurface_fatigue_index": Variable(patch, missing=True),
        "wear_number_without_spin": Variable(patch, missing=True),
        "wear_number_with_spin": Variable(patch, missing=True),
    }
    below = ("step", "wheel", "counterface_point")
    counterface = {
        "counterface_name": Variable(("wheel",), "str"),
        "counterface_profile_y": Variable(below),
        "counterface_profile_z": Variable(below),
        "counterface_wear_depth": Variable(below),
        "counterface_worn_area": Variable(along),
        "counterface_max_wear_depth": Variable(along),
        "counterface_turned_depth": Variable(along),
        "counterface_turnings": Variable(("step",), "i4"),
        "counterface_turned_at": Variable(("step",)),
    }
    turning = {
        "wheel_template": Variable(("wheel",), "str"),
        "last_turning": Variable(("step",), "i4"),
        "wheel_diameter": Variable(along, missing=True),
    }
    choice = {
        "contact_candidate": Variable(("candidate",), "str"),
        "contact_candidate_cost": Variable(("candidate",)),
        "contact_class": Variable(("contact_class",), "str"),
        "contact_point_class": Variable(("step", "operating_point"), "i4"),
        "contact_models": Variable(("step", "contact_class"), "i4"),
        "contact_models_error": Variable(("step",)),
        "contact_candidate_error": Variable(("step", "candidate"), missing=True),
    }
    return {
        "beside": beside,
        "fatigue": fatigue,
        "counterface": counterface,
        "turning": turning,
        "choice": choice,
    }


GROUPS: Mapping[str, Mapping[str, Variable]] = _groups()
"""Variables that only results of some scenes have: all of a group, or none. The first one tells."""


def layout_of(names: Container[str]) -> dict[str, Variable]:
    """Return all variables of a result file that has those called `names`.

    Parameters
    ----------
    names : container of str
        Variables of the file, or of its static part.
    """
    found = dict(LAYOUT)
    for group in GROUPS.values():
        if next(iter(group)) in names:
            found |= group
    return found


def row_names(names: Container[str]) -> tuple[str, ...]:
    """Return the variables of one row of a result file that has the variables `names`."""
    return tuple(name for name, variable in layout_of(names).items() if "step" in variable.dimensions)


COORDINATES = ("distance", "wheel_name", "regime_name", "op_label", "arc_length")
"""Coordinates; they never carry a fill value."""

LABELS = (*COORDINATES, *(next(iter(group)) for group in GROUPS.values()))
"""Coordinates with those of the groups."""


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
        for name, variable in layout_of(self.static).items():
            if "step" not in variable.dimensions:
                sizes[variable.dimensions[0]] = len(self.static[name])
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
    sizes, layout = header.sizes, layout_of(header.static)
    names = row_names(header.static)
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
