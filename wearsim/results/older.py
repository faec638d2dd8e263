"""Result files of earlier versions: the names their variables, dimensions and attributes have now."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from wearsim.quantities import QUANTITIES

if TYPE_CHECKING:
    import xarray as xr

OLDER_SCHEMAS = (3,)
"""Schemas that differ from the present one in names alone (wearsim 0.1)."""

RENAMED: Mapping[str, str] = {
    "op_label": "operating_point_name",
    **{
        f"op_{name}": name
        for name in (
            "shift", "yaw", "roll", "wheel_load", "speed", "friction", "track_curvature", "environment",
            "weight", "block_length",
        )
    },
    "patch_side": "side",
    "contact_x": "x",
    "patch_length": "length",
    "patch_width": "width",
    "beside": "comparison",
    "beside_regime": "comparison_regime",
    **{
        f"beside_{name}": f"comparison_{name}"
        for name in (
            "name", "coefficients", "source", "form", "regime_name", "wear_depth", "worn_area",
            "numbers", "materials", "validity", "departures",
        )
    },
    "beside_doubts": "comparison_warnings",
    "fatigue_doubts": "fatigue_warnings",
    "wear_coefficients_doubts": "wear_coefficients_warnings",
    "balanced_wear_rate": "magic_wear_rate",
    "counterface_turned_depth": "counterface_redressed_depth",
    "counterface_turnings": "counterface_redressed_count",
    "counterface_turned_at": "counterface_redressed_at",
    "last_turning": "last_reprofiling",
    "turning_limits": "reprofiling_limits",
    "turning_distances": "reprofiling_distances",
    "turning_least_cut": "reprofiling_least_cut",
}  # fmt: skip
"""Present name by the name of schema 3."""


def renamed(dataset: xr.Dataset) -> xr.Dataset:
    """Give a dataset of an older result or translation file the present names; others stay as they are.

    Parameters
    ----------
    dataset : Dataset
        As it was opened.
    """
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
