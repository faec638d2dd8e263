"""Fatigue results: first crack, largest index, agreement of the laws."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wearsim.damage.fatigue import FATIGUE_LAWS, counts_cycles
from wearsim.damage.fatigue.agreement import Agreement, agreement
from wearsim.errors import brief
from wearsim.results.checks import last_worn_row
from wearsim.results.limits import laws_of, met_at

if TYPE_CHECKING:
    import xarray as xr

SUBSURFACE = "subsurface_fatigue_index"


def crack_distances(dataset: xr.Dataset) -> dict[str, NDArray[np.float64]]:
    """Distance to the first crack of each wheel, by each law that counts cycles [m].

    It is computed for a new wheel at the rates of the last worn state, less the removal
    by wear of cracks of a stated depth, and infinite if no crack grows.
    """
    end, distances = last_worn_row(dataset), {}
    for k, law in enumerate(laws_of(dataset)):
        if counts_cycles(law):
            depth = float(dataset["fatigue_crack_depth"].values[k])
            removed = (
                dataset["wear_depth_rate"].values[end] / depth
                if np.isfinite(depth)
                else 0.0
            )
            grown = (dataset["fatigue_damage_rate"].values[end, :, k] - removed).max(
                axis=1
            )
            with np.errstate(divide="ignore"):
                distances[law] = 1.0 / np.maximum(grown, 0.0)
    return distances


def first_cracks(
    dataset: xr.Dataset,
) -> dict[str, tuple[NDArray[np.float64], NDArray[np.bool_]]]:
    r"""Distance to damage 1 of each wheel [m]; True where the campaign has reached it.

    By each law that counts cycles; what is not reached is that of `crack_distances`, at
    the rates of the last state.

    Notes
    -----
    Damage D of passages is summed; a crack of visible size has formed at
    :math:`\sum D = 1` [1]_.

    References
    ----------
    .. [1] M. Burstow, Whole Life Rail Model application and development for RSSB, AEA
           Technology 2003-2004.
    """
    cracks = {}
    for law, ahead in crack_distances(dataset).items():
        damage = dataset["fatigue_damage"].values[:, :, laws_of(dataset).index(law)]
        reached = [
            met_at(dataset["distance"].values, side, "fatigue_damage", 1.0)
            for side in damage.max(axis=-1).T
        ]
        met = np.array([at is not None for at in reached])
        cracks[law] = (np.where(met, [at or 0.0 for at in reached], ahead), met)
    return cracks


def steel_of(dataset: xr.Dataset, law: str) -> str:
    """Materials of the coefficients of a fatigue law, "" in files without them."""
    materials = str(dataset.attrs.get("fatigue_materials", "")).split("\n")
    at = laws_of(dataset).index(law)
    return materials[at] if at < len(materials) else ""


def of_rail_steel(materials: str) -> bool:
    """Return True if coefficients are those of rail steel alone."""
    return "rail" in materials and "wheel" not in materials


def crack_numbers(dataset: xr.Dataset, law: str) -> str:
    """State the origin of the crack growth coefficients of a law.

    It names the steels, or the user's set, and the certainty.
    """
    warning = str(dataset["fatigue_warnings"].values[laws_of(dataset).index(law)])
    _, separator, certainty = warning.partition("given by the user, who says: ")
    if separator:
        return f"numbers of the scene, certainty: {brief(certainty)}"
    steel = steel_of(dataset, law)
    if not steel:
        return ""
    return f"numbers of {steel}" + (
        ", not of wheel steel" if of_rail_steel(steel) else ""
    )


def cycles(dataset: xr.Dataset) -> Agreement:
    """Compare fatigue laws over the weighted load cycles of the worn wheels."""
    damage = dataset["fatigue_damage_passage"].values[last_worn_row(dataset)]
    loaded = np.isfinite(damage[..., 0])
    weight = np.broadcast_to(dataset["weight"].values[:, None], loaded.shape)[loaded]
    laws = [str(name) for name in dataset["fatigue_name"].values]
    return agreement({law: damage[loaded][:, k] for k, law in enumerate(laws)}, weight)


def quantity_of(law: str) -> str:
    """Return the index quantity of a law, named as in `wearsim.quantities`."""
    return FATIGUE_LAWS[law].index_quantity if law in FATIGUE_LAWS else SUBSURFACE


def largest_index(
    dataset: xr.Dataset, row: int, law: int | None
) -> list[tuple[float, float, str] | None]:
    """Find the largest index of each wheel among all patches of a state.

    Patches of monitoring points are included.

    Parameters
    ----------
    dataset : Dataset
        Result of a campaign with fatigue laws.
    row : int
        Step.
    law : int or None
        Fatigue law; None: the index below the surface.

    Returns
    -------
    list
        Of the right and the left wheel: index in the unit of its quantity; lateral
        position on the wheel profile, of the index below the surface that of the
        patch [m]; label of the operating point. None where no patch carries load.
    """
    if law is None:
        index, y = dataset[SUBSURFACE].values[row], dataset["wheel_y"].values[row]
    else:
        name = quantity_of(str(dataset["fatigue_name"].values[law]))
        index, y = (
            dataset[name].values[row, ..., law],
            dataset["fatigue_index_y"].values[row, ..., law],
        )
    indexes: list[tuple[float, float, str] | None] = []
    for wheel in range(2):
        wheel_index = np.where(
            (dataset["side"].values[row] == wheel) & np.isfinite(index), index, -np.inf
        )
        at = np.unravel_index(int(wheel_index.argmax()), wheel_index.shape)
        monitored = dataset["weight"].values[at[0]] == 0.0
        point = f"{dataset['operating_point_name'].values[at[0]]}{' (monitored)' if monitored else ''}"
        indexes.append(
            (float(wheel_index[at]), float(y[at]), point)
            if np.isfinite(wheel_index[at])
            else None
        )
    return indexes


def damage_from(numbers: str) -> float:
    """Return the index above which a law gives damage.

    It is 0, or the first break point of the damage function.
    """
    start = re.search(r"\bstart = ([^ ,]+)", numbers)
    return float(start[1]) if start else 0.0
