"""Tables of a report on contact models that were chosen: for which points, from when on, on what evidence."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from wearsim.report.style import shown
from wearsim.report.tables import Cell, number
from wearsim.report.tables_damage import Table

_NONE = Cell("–")


def chosen(dataset: xr.Dataset) -> list[Table]:
    """Contact models of each class of operating points, and the error of each candidate.

    Parameters
    ----------
    dataset : Dataset
        Result of a campaign.

    Returns
    -------
    list of Table
        None if the contact models were given.
    """
    if "contact_candidate" not in dataset:
        return []
    steps = looked_at(dataset)
    places = [f"{number(value, 4).text} km" for value in shown("distance", dataset["distance"].values[steps])]
    rows = []
    for step, place in zip(steps, places, strict=True):
        error = number(100.0 * float(dataset["contact_models_error"].values[step]), 2)
        for one in classes(dataset, step):
            rows.append([
                Cell(f"{place}, {one['class']}"), Cell(str(one["points"]), float(one["points"])),
                Cell(one["models"]), Cell(str(one["rank"]), float(one["rank"])), number(one["cost"], 3),
                error,
            ])  # fmt: skip
    tolerance = 100.0 * float(dataset.attrs["contact_tolerance"])
    models = Table(
        "choice",
        "contact models of the classes of operating points, by rising share of the work, wherever they were "
        "looked for; depth error: of the wear increment by all of them together, estimated from a sample; "
        f"tolerance {tolerance:.3g} %",
        ["From, class", "Points", "Contact models", "Rank", "Cost", "Depth error [%]"],
        rows,
    )
    errors = dataset["contact_candidate_error"].values[steps]
    tried = np.flatnonzero(np.isfinite(errors).any(axis=0))
    evidence = Table(
        "candidates",
        "error of the wear increment if one combination solved all points, against half-space solutions of "
        "a sample, of fast ones by what they differ from each other at all points, too; cost in "
        "units of the cheapest one's time per solution",
        ["Contact models", "Rank", "Cost", *(f"Depth error at {place} [%]" for place in places)],
        [
            [
                Cell(str(dataset["contact_candidate"].values[k])),
                Cell(str(k + 1), k + 1.0),
                number(float(dataset["contact_candidate_cost"].values[k]), 3),
                *(number(100.0 * error, 2) if np.isfinite(error) else _NONE for error in errors[:, k]),
            ]
            for k in tried
        ],
    )
    return [models, evidence]


def looked_at(dataset: xr.Dataset) -> list[int]:
    """Return the steps at which the contact models were looked for, the start first.

    Parameters
    ----------
    dataset : Dataset
        Result of a campaign whose contact models were chosen.
    """
    evidence = np.column_stack([
        dataset["contact_models_error"].values, dataset["contact_candidate_error"].fillna(-1.0).values,
    ])  # fmt: skip
    return [0, *(np.flatnonzero(np.any(np.diff(evidence, axis=0) != 0.0, axis=1)) + 1).tolist()]


def classes(dataset: xr.Dataset, step: int) -> list[dict[str, Any]]:
    """Tell the contact models of each class that has operating points at a step.

    Parameters
    ----------
    dataset : Dataset
        Result of a campaign whose contact models were chosen.
    step : int
        Row of the result.

    Returns
    -------
    list of dict
        Name of the class, number of its points, its models, their rank by rising cost from 1 and their cost.
    """
    count = np.bincount(
        dataset["contact_point_class"].values[step].astype(int), minlength=dataset.sizes["contact_class"]
    )
    place = dataset["contact_models"].values[step].astype(int)
    return [
        {
            "class": str(name),
            "points": int(number_),
            "models": str(dataset["contact_candidate"].values[k]),
            "rank": int(k) + 1,
            "cost": float(dataset["contact_candidate_cost"].values[k]),
        }
        for name, number_, k in zip(dataset["contact_class"].values, count, place, strict=True)
        if number_
    ]
