"""Reprofilings of the wheels in a result, and the spans of wear between them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Reprofiling:
    """One reprofiling of both wheels.

    Parameters
    ----------
    distance : float
        Distance run [m].
    before, after : tuple of float or None
        Diameter of right and left wheel at the running circle [m].
    """

    distance: float
    before: tuple[float | None, float | None]
    after: tuple[float | None, float | None]


def reprofiled_rows(dataset: xr.Dataset) -> list[int]:
    """Return the rows of reprofiled wheels before they run.

    Parameters
    ----------
    dataset : Dataset
        From `results.open_results`.
    """
    if "last_reprofiling" not in dataset:
        return []
    last = dataset["last_reprofiling"].values
    return [int(row) for row in np.flatnonzero((last == np.arange(last.size)) & (last > 0))]


def reprofilings(dataset: xr.Dataset) -> tuple[Reprofiling, ...]:
    """Return the reprofilings of the wheels.

    Parameters
    ----------
    dataset : Dataset
        From `results.open_results`.

    Returns
    -------
    tuple of Reprofiling
        In order; empty without reprofiling.
    """

    def diameters(row: int) -> tuple[float | None, float | None]:
        right, left = (float(value) for value in dataset["wheel_diameter"].values[row])
        return (right if np.isfinite(right) else None, left if np.isfinite(left) else None)

    return tuple(
        Reprofiling(float(dataset["distance"].values[row]), diameters(row - 1), diameters(row))
        for row in reprofiled_rows(dataset)
    )


def spans(dataset: xr.Dataset) -> Iterator[tuple[int, int]]:
    """Yield first and last row of each span of wear, from new or reprofiled wheels to the next reprofiling.

    Parameters
    ----------
    dataset : Dataset
        From `results.open_results`.
    """
    rows = reprofiled_rows(dataset)
    yield from zip([0, *rows], [*(row - 1 for row in rows), dataset.sizes["step"] - 1], strict=True)


def last_worn_row(dataset: xr.Dataset) -> int:
    """Return the last row whose wheels are not just reprofiled.

    Parameters
    ----------
    dataset : Dataset
        From `results.open_results`.
    """
    last = dataset.sizes["step"] - 1
    return last - 1 if last in reprofiled_rows(dataset) else last


def wear_steps(dataset: xr.Dataset) -> int:
    """Return the number of wear steps of a campaign, without reprofilings.

    Parameters
    ----------
    dataset : Dataset
        From `results.open_results`.
    """
    return int(dataset.sizes["step"]) - 1 - len(reprofiled_rows(dataset))


def new_row(dataset: xr.Dataset, row: int) -> int:
    """Return the row of the new or reprofiled wheels before a row.

    Parameters
    ----------
    dataset : Dataset
        From `results.open_results`.
    row : int
        Row whose depth and damage stand at the points of that profile.
    """
    if "last_reprofiling" not in dataset:
        return 0
    return int(dataset["last_reprofiling"].values[row])


def reprofiled_at_end(dataset: xr.Dataset) -> str:
    """Return the note on a campaign that ends with a reprofiling; empty otherwise."""
    if last_worn_row(dataset) == dataset.sizes["step"] - 1:
        return ""
    return "The campaign ends with a reprofiling of the wheels; its end is reported in the state before it."


def damage_left(dataset: xr.Dataset) -> dict[str, tuple[float, float]]:
    """Return the damage left by reprofiling, for laws that state the depth of their cracks.

    Parameters
    ----------
    dataset : Dataset
        From `results.open_results`.

    Returns
    -------
    dict of str to (float, float)
        By law the largest damage of reprofiled wheels [-] and the depth of a crack of damage 1 [m]; empty
        without reprofiling.
    """
    rows = reprofiled_rows(dataset)
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
    """Return the notes on fatigue damage left by reprofiling, law by law; empty without either.

    Parameters
    ----------
    dataset : Dataset
        From `results.open_results`.
    """
    if not reprofiled_rows(dataset) or "fatigue_name" not in dataset:
        return ""
    left, notes = damage_left(dataset), []
    for law in dataset["fatigue_name"].values:
        if law not in left:
            why = "which states no depth of its cracks"
            notes.append(f"Reprofiling is assumed to remove all damage of {law}, {why}.")
            continue
        damage, crack = left[law]
        kept = f"left at most {damage:.3g} of it" if damage > 0.0 else "left none"
        removed = f"the damage within its cut (1 is a crack of {1e3 * crack:g} mm)"
        notes.append(f"Of {law} reprofiling removed {removed} and {kept}.")
    return " ".join(notes)


def depth_by_regime(dataset: xr.Dataset) -> NDArray[np.float64]:
    """Wear depth by regime, summed along the profile and over all spans between reprofilings.

    Parameters
    ----------
    dataset : Dataset
        From `results.open_results`.

    Returns
    -------
    (2, n_regimes) array
        Sums over the points [m], for shares: the points of a profile are equally spaced.
    """
    rows = [last for _, last in spans(dataset)]
    return np.asarray(dataset["wear_depth_by_regime"].values[rows].sum(axis=(0, 3)))
