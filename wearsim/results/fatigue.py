"""What a result says of fatigue: first crack, what ends a life, largest index, agreement of the laws."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearsim.damage.fatigue import FATIGUE_LAWS, counts_cycles
from wearsim.damage.fatigue.agreement import Agreement, agreement
from wearsim.damage.fatigue.balance import LIMITED_BY, balance
from wearsim.results.checks import last_worn_row, new_row
from wearsim.results.limits import laws_of

if TYPE_CHECKING:
    import xarray as xr

SUBSURFACE = "subsurface_fatigue_index"


def crack_distances(dataset: xr.Dataset) -> dict[str, NDArray[np.float64]]:
    """Distance to the first crack of each wheel by each law that counts cycles, infinite if none grows [m].

    From a new wheel at the rates of the last worn state, less what wear removes of cracks of a stated depth.
    """
    end, found = last_worn_row(dataset), {}
    for k, law in enumerate(laws_of(dataset)):
        if counts_cycles(law):
            depth = float(dataset["fatigue_crack_depth"].values[k])
            removed = dataset["wear_depth_rate"].values[end] / depth if np.isfinite(depth) else 0.0
            grown = (dataset["fatigue_damage_rate"].values[end, :, k] - removed).max(axis=1)
            with np.errstate(divide="ignore"):
                found[law] = 1.0 / np.maximum(grown, 0.0)
    return found


class Life(NamedTuple):
    """What ends the life of a wheel by one law, from new at the rates of the last worn state [SI]."""

    law: int  # index of the law
    wheel: int
    crack_depth: float
    wear_limit: float
    crack_distances: tuple[float, ...]  # with the stated width of a place, half and double of it
    wear_distance: float
    ended_by: str  # cracks, wear or nothing
    y: float | None  # where on the wheel profile
    cracked: float | None  # share of the points that wear or tire which cracks limit
    magic_wear_rate: float  # largest along the profile


def lives(dataset: xr.Dataset) -> Iterator[Life]:
    """Give the life of each wheel by the laws that state the depth of their cracks."""
    end = last_worn_row(dataset)
    wear = dataset["wear_depth_rate"].values[end]
    y = dataset["profile_y"].values[new_row(dataset, end)]
    for k, crack in enumerate(dataset["fatigue_crack_depth"].values):
        limit = float(dataset["fatigue_wear_limit"].values[k])
        for wheel in range(2) if np.isfinite(crack) else ():
            rate = dataset["fatigue_damage_rate"].values[end, wheel, k]
            result, half, double = (
                balance(part * rate, wear[wheel], crack_depth=float(crack), wear_limit=limit)
                for part in (1.0, 0.5, 2.0)  # of the width of a place
            )
            distances = {"wear": result.wear_distance, "cracks": result.crack_distance}
            first = min(distances, key=lambda what: distances[what].min())
            ends = np.isfinite(distances[first].min())
            acts = (rate > 0.0) | (wear[wheel] > 0.0)
            grown = (result.limited_by == LIMITED_BY.index("cracks")) & acts
            yield Life(
                law=k, wheel=wheel, crack_depth=float(crack), wear_limit=limit,
                crack_distances=tuple(float(one.crack_distance.min()) for one in (result, half, double)),
                wear_distance=float(result.wear_distance.min()), ended_by=first if ends else "nothing",
                y=float(y[wheel, distances[first].argmin()]) if ends else None,
                cracked=float(grown.sum() / acts.sum()) if acts.any() else None,
                magic_wear_rate=float(result.magic_wear_rate.max()),
            )  # fmt: skip


def cycles(dataset: xr.Dataset) -> Agreement:
    """Compare the fatigue laws over the load cycles of the worn wheels, weighted as they occur."""
    damage = dataset["fatigue_damage_passage"].values[last_worn_row(dataset)]
    here = np.isfinite(damage[..., 0])
    weight = np.broadcast_to(dataset["weight"].values[:, None], here.shape)[here]
    laws = [str(name) for name in dataset["fatigue_name"].values]
    return agreement({law: damage[here][:, k] for k, law in enumerate(laws)}, weight)


def quantity_of(law: str) -> str:
    """Return the quantity a law judges by, as `wearsim.quantities` names it."""
    return FATIGUE_LAWS[law].index_quantity if law in FATIGUE_LAWS else SUBSURFACE


def largest_index(dataset: xr.Dataset, row: int, law: int | None) -> list[tuple[float, float, str] | None]:
    """Find the largest index of each wheel among all patches of a state, monitoring points included.

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
        Of the right and the left wheel: index in the unit of its quantity; lateral position on the wheel
        profile, of the index below the surface that of the patch [m]; label of the operating point. None
        where no patch carries load.
    """
    if law is None:
        index, y = dataset[SUBSURFACE].values[row], dataset["wheel_y"].values[row]
    else:
        name = quantity_of(str(dataset["fatigue_name"].values[law]))
        index, y = dataset[name].values[row, ..., law], dataset["fatigue_index_y"].values[row, ..., law]
    indexes: list[tuple[float, float, str] | None] = []
    for wheel in range(2):
        here = np.where((dataset["side"].values[row] == wheel) & np.isfinite(index), index, -np.inf)
        at = np.unravel_index(int(here.argmax()), here.shape)
        monitored = dataset["weight"].values[at[0]] == 0.0
        point = f"{dataset['operating_point_name'].values[at[0]]}{' (monitored)' if monitored else ''}"
        indexes.append((float(here[at]), float(y[at]), point) if np.isfinite(here[at]) else None)
    return indexes


def damage_from(numbers: str) -> float:
    """Return the index above which a law sees damage: 0, or the first break point of its damage function."""
    start = re.search(r"\bstart = ([^ ,]+)", numbers)
    return float(start[1]) if start else 0.0
