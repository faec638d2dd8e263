"""The turnings of the wheels in a result, and the spans of wear between them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class TurningMade:
    """One turning of both wheels.

    Parameters
    ----------
    distance : float
        Where it was [m].
    before, after : tuple of float or None
        Diameter of right and left wheel at the tape circle [m].
    """

    distance: float
    before: tuple[float | None, float | None]
    after: tuple[float | None, float | None]


def turned_rows(dataset: xr.Dataset) -> list[int]:
    """Return the rows that hold wheels as they come from the lathe.

    Parameters
    ----------
    dataset : Dataset
        From `results.open_results`.
    """
    if "last_reprofiling" not in dataset:
        return []
    last = dataset["last_reprofiling"].values
    return [int(row) for row in np.flatnonzero((last == np.arange(last.size)) & (last > 0))]


def turnings(dataset: xr.Dataset) -> tuple[TurningMade, ...]:
    """Tell each turning of the wheels.

    Parameters
    ----------
    dataset : Dataset
        From `results.open_results`.

    Returns
    -------
    tuple of TurningMade
        In order; none where wheels are not turned.
    """

    def diameters(row: int) -> tuple[float | None, float | None]:
        right, left = (float(value) for value in dataset["wheel_diameter"].values[row])
        return (right if np.isfinite(right) else None, left if np.isfinite(left) else None)

    return tuple(
        TurningMade(float(dataset["distance"].values[row]), diameters(row - 1), diameters(row))
        for row in turned_rows(dataset)
    )


def spans(dataset: xr.Dataset) -> Iterator[tuple[int, int]]:
    """Give first and last row of each span of wear, from a new or turned wheel to the last before the next.

    Parameters
    ----------
    dataset : Dataset
        From `results.open_results`.
    """
    rows = turned_rows(dataset)
    yield from zip([0, *rows], [*(row - 1 for row in rows), dataset.sizes["step"] - 1], strict=True)


def last_worn_row(dataset: xr.Dataset) -> int:
    """Return the last row whose wheels do not just come from the lathe.

    Parameters
    ----------
    dataset : Dataset
        From `results.open_results`.
    """
    last = dataset.sizes["step"] - 1
    return last - 1 if last in turned_rows(dataset) else last


def wear_steps(dataset: xr.Dataset) -> int:
    """Return how many wear steps a campaign has taken; a turning of the wheels is none.

    Parameters
    ----------
    dataset : Dataset
        From `results.open_results`.
    """
    return int(dataset.sizes["step"]) - 1 - len(turned_rows(dataset))


def new_row(dataset: xr.Dataset, row: int) -> int:
    """Return the row of the wheels as they were new, or came from the lathe, before a row.

    Parameters
    ----------
    dataset : Dataset
        From `results.open_results`.
    row : int
        Any; depth and damage in it stand at the points of that profile.
    """
    if "last_reprofiling" not in dataset:
        return 0
    return int(dataset["last_reprofiling"].values[row])


def closing_turning(dataset: xr.Dataset) -> str:
    """Say that a campaign ends with a turning and what of it is shown, "" if it does not."""
    if last_worn_row(dataset) == dataset.sizes["step"] - 1:
        return ""
    return "The campaign ends with a turning of the wheels: what is told of its end is the state before it."


def damage_left(dataset: xr.Dataset) -> dict[str, tuple[float, float]]:
    """Tell the damage that the lathe left, of laws that state the depth of their cracks.

    Parameters
    ----------
    dataset : Dataset
        From `results.open_results`.

    Returns
    -------
    dict of str to (float, float)
        By law the largest damage of wheels as they come from the lathe [-] and the depth of a crack of
        damage 1 [m]; empty without turnings.
    """
    rows = turned_rows(dataset)
    if not rows or "fatigue_name" not in dataset:
        return {}
    return {
        str(law): (float(dataset["fatigue_damage"].values[rows, :, k].max()), float(crack))
        for k, (law, crack) in enumerate(
            zip(dataset["fatigue_name"].values, dataset["fatigue_crack_depth"].values, strict=True)
        )
        if np.isfinite(crack)
    }


def cracks_left(dataset: xr.Dataset) -> str:
    """Say what the lathe made of fatigue damage, law by law; "" where there is none or no turning.

    Parameters
    ----------
    dataset : Dataset
        From `results.open_results`.
    """
    if not turned_rows(dataset) or "fatigue_name" not in dataset:
        return ""
    left, told = damage_left(dataset), []
    for law in dataset["fatigue_name"].values:
        if law not in left:
            why = "which states no depth of its cracks"
            told.append(f"The lathe is assumed to take all damage of {law}, {why}.")
            continue
        damage, crack = left[law]
        kept = f"left at most {damage:.3g} of it" if damage > 0.0 else "left none"
        reached = f"the damage its cut reached (1 is a crack of {1e3 * crack:g} mm)"
        told.append(f"Of {law} the lathe took {reached} and {kept}.")
    return " ".join(told)


def depth_by_regime(dataset: xr.Dataset) -> NDArray[np.float64]:
    """Wear depth by regime, summed along the profile and over all spans between turnings.

    Parameters
    ----------
    dataset : Dataset
        From `results.open_results`.

    Returns
    -------
    (2, n_regimes) array
        [m]; only the shares mean something: the points of a profile are equally apart.
    """
    rows = [last for _, last in spans(dataset)]
    return np.asarray(dataset["wear_depth_by_regime"].values[rows].sum(axis=(0, 3)))
