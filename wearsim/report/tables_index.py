"""Largest fatigue index of each law and wheel: how large, where on the profile, at which operating point."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
import xarray as xr

from wearsim.damage.fatigue import FATIGUE_LAWS
from wearsim.quantities import QUANTITIES
from wearsim.report.figures import WHEELS
from wearsim.report.style import shown
from wearsim.report.tables import Cell, number
from wearsim.report.tables_damage import Table
from wearsim.results.turnings import last_worn_row

SUBSURFACE = "subsurface_fatigue_index"


@dataclass(frozen=True)
class LargestIndex:
    """Largest index of the patches of one wheel in one state.

    Parameters
    ----------
    value : float
        In the unit of its quantity.
    y : float
        Lateral position on the wheel profile; of the index below the surface that of the patch [m].
    point : str
        Label of the operating point.
    """

    value: float
    y: float
    point: str


def quantity_of(law: str) -> str:
    """Return the quantity a law judges by, as `wearsim.quantities` names it."""
    return FATIGUE_LAWS[law].index_quantity if law in FATIGUE_LAWS else SUBSURFACE


def largest(dataset: xr.Dataset, row: int, law: int | None) -> tuple[LargestIndex | None, ...]:
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
    tuple
        Right and left; None where no patch bears.
    """
    if law is None:
        index, y = dataset[SUBSURFACE].values[row], dataset["wheel_y"].values[row]
    else:
        name = quantity_of(str(dataset["fatigue_name"].values[law]))
        index, y = dataset[name].values[row, ..., law], dataset["fatigue_index_y"].values[row, ..., law]
    side = dataset["side"].values[row]
    found: list[LargestIndex | None] = []
    for wheel in range(len(WHEELS)):
        here = np.where((side == wheel) & np.isfinite(index), index, -np.inf)
        at = np.unravel_index(int(here.argmax()), here.shape)
        if not np.isfinite(here[at]):
            found.append(None)
            continue
        label = str(dataset["operating_point_name"].values[at[0]])
        monitored = dataset["weight"].values[at[0]] == 0.0
        found.append(
            LargestIndex(float(here[at]), float(y[at]), f"{label} (monitored)" if monitored else label)
        )
    return tuple(found)


def _limit(numbers: str) -> Cell:
    """Index above which a law sees damage: 0, or the first break point of its damage function."""
    start = re.search(r"\bstart = ([^ ,]+)", numbers)
    return number(float(start[1]) if start else 0.0)


def table(dataset: xr.Dataset) -> list[Table]:
    """Largest index of each law and wheel, new and at the end.

    Parameters
    ----------
    dataset : Dataset
        Result of a campaign.

    Returns
    -------
    list of Table
        None if it has no fatigue laws.
    """
    if "fatigue_name" not in dataset:
        return []
    numbers = str(dataset.attrs.get("fatigue_numbers", "")).split("\n")
    end = last_worn_row(dataset)
    laws = [(k, str(name)) for k, name in enumerate(dataset["fatigue_name"].values)]
    rows = []
    for law, name in [*laws, (None, "below the surface")]:
        entry = QUANTITIES[quantity_of(name)]
        unit = f" [{entry.shown_unit}]" if entry.shown_unit != "1" else ""
        limit = Cell("the steel's own") if law is None else _limit(numbers[law] if law < len(numbers) else "")
        states = [largest(dataset, row, law) for row in (0, end)]
        for wheel, side in enumerate(WHEELS):
            cells = [Cell(f"{name}, {side} wheel: {entry.meaning}{unit}"), limit]
            for found in states:
                one = found[wheel]
                if one is None:
                    cells += [Cell("–")] * 3
                    continue
                value = number(shown(entry.name, one.value), 3)
                cells += [value, number(shown("wheel_y", one.y), 3), Cell(one.point)]
            rows.append(cells)
    head = [
        "Fatigue law and wheel", "Damage above",
        *(f"{state}: {what}" for state in ("New", "End") for what in ("largest index", "at y [mm]", "point")),
    ]  # fmt: skip
    text = (
        "Largest index of any contact patch, with its place on the wheel profile and its operating point, "
        "monitoring points included. Below its limit the difference is the margin to damage."
    )
    return [Table("fatigue-index", text, head, rows)]
