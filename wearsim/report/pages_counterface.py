"""What a report tells of rails or rollers that wear: figures and a table, where a scene asks for it."""

from __future__ import annotations

import numpy as np
import xarray as xr

from wearsim.quantities import QUANTITIES
from wearsim.report import figures, figures_counterface
from wearsim.report.pages import Plate, environment_note
from wearsim.report.style import capital, grid, legend, role_of, shown, style
from wearsim.report.tables import Cell, number
from wearsim.report.tables_damage import Table

MEASURES = ("counterface_max_wear_depth", "counterface_worn_area", "counterface_redressed_depth")


def wears(dataset: xr.Dataset) -> bool:
    """Tell whether the counterface of a campaign wears."""
    return "counterface_name" in dataset


def rolls(dataset: xr.Dataset) -> bool:
    """Tell whether the counterface that wears is a pair of rollers."""
    return "roller" in str(dataset["counterface_name"].values[0])


def table(dataset: xr.Dataset) -> list[Table]:
    """Depth, area, and what was turned off, of both rails or rollers.

    Parameters
    ----------
    dataset : Dataset
        Result of a campaign.

    Returns
    -------
    list of Table
        None if the counterface does not wear.
    """
    if not wears(dataset):
        return []
    names = [str(name) for name in dataset["counterface_name"].values]
    turnings = int(dataset["counterface_redressed_count"].values[-1])
    rows = []
    for name in MEASURES if turnings else MEASURES[:2]:
        unit = QUANTITIES[name].shown_unit
        values = shown(name, dataset[name].values[-1])
        text = f"{capital(QUANTITIES[name].meaning)} [{unit}]"
        rows.append([Cell(text), *(number(value, 4) for value in values)])
    told = f"the rollers were turned {turnings} times" if turnings != 1 else "the rollers were turned once"
    caption = "wear of the counterface at the end of the campaign"
    if rolls(dataset):
        caption += f"; {told if turnings else 'the rollers were never turned'}"
    return [Table("counterface", f"{caption}.", ["Measure", *(capital(name) for name in names)], rows)]


def plates(datasets: list[xr.Dataset]) -> list[Plate]:
    """Draw depth along the profile and over the distance for campaigns whose counterface wears.

    Parameters
    ----------
    datasets : list of Dataset
        One result, or rig and field.

    Returns
    -------
    list of Plate
        None if no counterface wears.
    """
    worn = [data for data in datasets if wears(data)]
    return [_along(worn), _over_distance(worn)] if worn else []


def _along(datasets: list[xr.Dataset]) -> Plate:
    with style():
        figure, axes = grid(len(datasets), 2, height=1.8, gap=0.3, sharey="row")
        for row, data in enumerate(datasets):
            for side in range(len(figures.WHEELS)):
                ax = figures_counterface.plot_counterface_depth(data, axes[row, side], side=side)
                ax.set_xlim(_worn_range(data, side))
                ax.set_title(f"{role_of(data).capitalize()}, {data['counterface_name'].values[side]}")
                if side:
                    ax.set_ylabel("")
        legend(figure)
    since = "since it was new"
    if any(map(rolls, datasets)):
        since += " or last turned; faint lines are what it had when it was turned, or"
    else:
        since += "; faint lines are what it had"
    text = (
        f"Wear depth of the counterface along its profile, {since} a quarter, half and three quarters of the "
        "way."
    )
    return Plate("counterface_wear", "wear", figure, " ".join([text, *_notes(datasets)]))


def _notes(datasets: list[xr.Dataset]) -> list[str]:
    """Sentences on what the depths are: those of rollers by the law, of rails an area that is stated."""
    rollers = [data for data in datasets if rolls(data)]
    rails = [data for data in datasets if not rolls(data)]
    notes = [environment_note(rollers)] if rollers else []
    if rails:
        told = ", ".join(role_of(data) for data in rails)
        notes.append(
            f"Rails ({told}) lose the area that is stated, where the contacts wear: the amount is as given "
            "and contains no environment factor, its place is from the contacts."
        )
    return notes


def _over_distance(datasets: list[xr.Dataset]) -> Plate:
    names = MEASURES[:2]
    with style():
        figure, axes = grid(len(names), len(datasets), height=1.75, gap=0.6, between=0.2, sharex="col")
        for column, data in enumerate(datasets):
            for row, name in enumerate(names):
                ax = figures_counterface.plot_counterface_over_distance(data, name, axes[row, column])
                if row < len(names) - 1:
                    ax.set_xlabel("")
            axes[0, column].set_title(role_of(data).capitalize())
        legend(figure)
    text = "Largest wear depth and worn area of the counterface over the distance run"
    if any(map(rolls, datasets)):
        text += "; the depth falls to 0 where rollers are turned back to their new profile"
    text += "."
    return Plate("counterface_over_distance", "wear", figure, text)


def _worn_range(dataset: xr.Dataset, side: int) -> tuple[float, float]:
    """Limits of the lateral axis around all that is worn in the states shown [mm]."""
    rows = figures_counterface.states_shown(dataset)
    depth = dataset["counterface_wear_depth"].values[rows, side].max(axis=0)
    y = shown("counterface_y", dataset["counterface_profile_y"].values[0, side])
    worn = y[depth > 0.005 * depth.max()] if depth.max() > 0.0 else y
    margin = 0.08 * float(np.ptp(worn)) + 1.0
    return float(worn.min()) - margin, float(worn.max()) + margin
