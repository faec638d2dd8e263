"""Factors of damage: comparison wear laws and fatigue laws that both campaigns have."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from wearsim.quantities import QUANTITIES
from wearsim.translation.axes import CommonAxes, FloatArray
from wearsim.translation.compare import Pair, add_compared, along

_SETTINGS = {
    "comparison": ("coefficients", "form"),
    "fatigue": ("coefficients", "form", "crack_width", "crack_depth", "shear_yield"),
}
"""What laws of one name must share to be compared, with all their numbers."""


def common_laws(pair: Pair, group: str) -> tuple[list[str], list[str]]:
    """Laws that act in both campaigns.

    Parameters
    ----------
    pair : (Dataset, Dataset)
        Rig and field.
    group : {"comparison", "fatigue"}
        Group of variables of the result files.

    Returns
    -------
    same, other : list of str
        Names of laws with equal settings, and of those whose settings differ.
    """
    if any(f"{group}_name" not in data for data in pair):
        return [], []
    names = [[str(name) for name in data[f"{group}_name"].values] for data in pair]
    # older files do not have the numbers; the uncertain ones of them are variables
    known = all(f"{group}_numbers" in data.attrs for data in pair)
    same: list[str] = []
    other: list[str] = []
    for name in names[0]:
        if name in names[1]:
            one, two = (
                _settings(data, group, own.index(name), known) for data, own in zip(pair, names, strict=True)
            )
            (same if one == two else other).append(name)
    return same, other


def _settings(dataset: xr.Dataset, group: str, law: int, known: bool) -> list[str]:
    keys = _SETTINGS[group] if known else (*_SETTINGS[group], "warnings")
    named = [str(dataset[f"{group}_{key}"].values[law]) for key in keys]
    return [*named, str(dataset.attrs[f"{group}_numbers"]).split("\n")[law]] if known else named


def add_damage(out: dict[str, Any], pair: Pair, axes: CommonAxes) -> list[str]:
    """Add worn area by comparison laws, and fatigue damage, with their factors; return what to know of them.

    Parameters
    ----------
    out : dict
        Variables of the comparison; nothing is added where the campaigns have no law in common.
    pair : (Dataset, Dataset)
        Rig and field.
    axes : CommonAxes
        Distances where they are compared.

    Returns
    -------
    list of str
        Notes for the reader.
    """
    notes = []
    for group, what in (("comparison", "comparison wear law"), ("fatigue", "fatigue law")):
        same, other = common_laws(pair, group)
        notes += [f"{what} {name}: its settings differ, it is not compared" for name in other]
        if not same:
            continue
        out[f"{group}_name"] = (group, same, {"long_name": f"{what} of both campaigns"})
        wear = group == "comparison"
        for name in ("comparison_worn_area",) if wear else ("fatigue_damage", "fatigue_damage_rate"):
            values = along(pair, [_by_wheel(data, name, same) for data in pair], axes.distance)
            meaning = QUANTITIES[name].meaning.removesuffix(", by regime")
            add_compared(
                out, name, (group, "wheel_group"), values, axes, name,
                meaning if wear else f"largest {meaning} of the wheel",
                f"both wheels: {'sum' if wear else 'the larger one'}", scale_axis=(0, 1, 2),
            )  # fmt: skip
    return notes


def _by_wheel(dataset: xr.Dataset, name: str, laws: list[str]) -> FloatArray:
    """Values of some laws on the right wheel, the left wheel and both (step, law, 3)."""
    value = np.asarray(dataset[name].values, dtype=np.float64)
    if name == "comparison_worn_area":
        owner = np.array([str(text).split(": ", 1)[0] for text in dataset["comparison_regime_name"].values])
        wheels = np.stack([value[:, :, owner == law].sum(axis=2) for law in laws], axis=1)
        return np.concatenate([wheels, wheels.sum(axis=2, keepdims=True)], axis=2)
    own = [str(text) for text in dataset["fatigue_name"].values]
    wheels = value.max(axis=3)[:, :, [own.index(law) for law in laws]].swapaxes(1, 2)
    return np.concatenate([wheels, wheels.max(axis=2, keepdims=True)], axis=2)
