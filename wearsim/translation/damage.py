"""Factors of damage: comparison wear laws and fatigue laws that both campaigns have."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from wearsim.quantities import QUANTITIES
from wearsim.translation.axes import FloatArray
from wearsim.translation.compare import Comparison

_SETTINGS = {
    "comparison": ("coefficients", "form"),
    "fatigue": ("coefficients", "form", "crack_width", "crack_depth", "shear_yield"),
}
"""What laws of one name must share to be compared, with all their numbers."""


def common_laws(pair: tuple[xr.Dataset, xr.Dataset], group: str) -> tuple[list[str], list[str]]:
    """Laws that act on the rig and in the field.

    Returns
    -------
    same, other : list of str
        Names of laws of a group, "comparison" or "fatigue", with equal settings, and with differing ones.
    """
    if any(f"{group}_name" not in data for data in pair):
        return [], []
    # older files do not have the numbers; the uncertain ones of them are variables
    known = all(f"{group}_numbers" in data.attrs for data in pair)
    rig, field = (_settings(data, group, known) for data in pair)
    both = [name for name in rig if name in field]
    same = [name for name in both if rig[name] == field[name]]
    return same, [name for name in both if name not in same]


def _settings(dataset: xr.Dataset, group: str, known: bool) -> dict[str, list[str]]:
    """Return the settings by law."""
    keys = _SETTINGS[group] if known else (*_SETTINGS[group], "warnings")
    columns: list[Any] = [dataset[f"{group}_{key}"].values for key in keys]
    if known:
        columns.append(dataset.attrs[f"{group}_numbers"].split("\n"))
    names = dataset[f"{group}_name"].values
    return {str(name): [str(column[k]) for column in columns] for k, name in enumerate(names)}


def add_damage(comparison: Comparison) -> None:
    """Add worn area by comparison laws, and fatigue damage, by laws of both campaigns with their factors."""
    for group, what in (("comparison", "comparison wear law"), ("fatigue", "fatigue law")):
        same, other = common_laws(comparison.pair, group)
        comparison.notes += [f"{what} {name}: its settings differ, it is not compared" for name in other]
        if not same:
            continue
        comparison.variables[f"{group}_name"] = (group, same, {"long_name": f"{what} of both campaigns"})
        wear = group == "comparison"
        for name in ("comparison_worn_area",) if wear else ("fatigue_damage", "fatigue_damage_rate"):
            meaning = QUANTITIES[name].meaning.removesuffix(", by regime")
            comparison.add_rows(
                name, (group, "wheel_group"), [_by_wheel(data, name, same) for data in comparison.pair], name,
                meaning if wear else f"largest {meaning} of the wheel",
                f"both wheels: {'sum' if wear else 'the larger one'}", scale_axis=(0, 1, 2),
            )  # fmt: skip


def _by_wheel(dataset: xr.Dataset, name: str, laws: list[str]) -> FloatArray:
    """Values of some laws on the right wheel, the left wheel and both (step, law, 3)."""
    value = dataset[name].values
    if name == "comparison_worn_area":
        owner = np.array([str(text).split(": ", 1)[0] for text in dataset["comparison_regime_name"].values])
        wheels = np.stack([value[:, :, owner == law].sum(axis=2) for law in laws], axis=1)
        return np.concatenate([wheels, wheels.sum(axis=2, keepdims=True)], axis=2)
    own = [str(text) for text in dataset["fatigue_name"].values]
    wheels = value.max(axis=3)[:, :, [own.index(law) for law in laws]].swapaxes(1, 2)
    return np.concatenate([wheels, wheels.max(axis=2, keepdims=True)], axis=2)
