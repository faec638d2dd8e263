"""The tables of a report as rows of cells; every number keeps its exact value with its text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

from wearsim.quantities import QUANTITIES
from wearsim.report.plates import COUNTERFACE_MEASURES, environment_text, rolls, wears
from wearsim.report.style import capital, label, plain, role_of, role_title, shown, values_of, with_unit
from wearsim.results.checks import cracks_left, last_worn_row, reprofilings
from wearsim.results.limits import LIMITED, LimitMet, limits_met

UNDEFINED = "undefined"
MEASURES = (
    "max_wear_depth", "worn_area", "worn_mass", "flange_height", "flange_thickness", "flange_gradient",
    "hollowing",
)  # fmt: skip
"""Measures of each wheel."""


@dataclass(frozen=True)
class Cell:
    """One cell of a table: what is shown, and the exact number behind it (None for words)."""

    text: str
    value: float | None = None

    @property
    def exact(self) -> str:
        """The number with all its digits."""
        return "" if self.value is None else repr(float(self.value))


NONE = Cell("–")


@dataclass(frozen=True)
class Table:
    """A table; the first cell of a row names it.

    Parameters
    ----------
    name : str
        Unique in the report, with the role of its campaign where it is of one.
    caption, head : str, sequence of str
        What it holds, as a whole and in each column.
    rows : list of list of Cell
        As many cells as the head.
    look : {"laws", "points", "regimes", "text", "numbers"}
        How it looks: "text" without columns of numbers, "numbers" with nothing but those.
    fold, unfolded : str, bool
        Title it is folded under, "" if it is not; whether the fold is open.
    shaded : set of int
        Rows that stand out.
    title : str
        Heading before it, if it has one.
    """

    name: str
    caption: str
    head: Sequence[str]
    rows: list[list[Cell]]
    look: str = "laws"
    fold: str = ""
    unfolded: bool = False
    shaded: frozenset[int] = frozenset()
    title: str = ""

    macro = "table"

    def numeric(self, column: int) -> bool:
        """Whether a column is one of numbers: any row has one there."""
        if self.look in ("text", "numbers"):
            return self.look == "numbers"
        return any(row[column].value is not None for row in self.rows)

    def of(self, role: str, heading: str) -> Table:
        """Give the table of a campaign, with its role in name and caption."""
        return replace(self, name=f"{self.name}-{role}", caption=f"{heading}: {self.caption}")


def cell(value: Any, digits: int = 4) -> Cell:
    """Cell of words, a whole number or another with some digits; a dash for None."""
    if isinstance(value, Cell):
        return value
    if value is None:
        return NONE
    if isinstance(value, str):
        return Cell(value)
    if isinstance(value, int | np.integer):
        return Cell(str(value), float(value))
    text = plain(value, digits)
    return Cell(text) if text == UNDEFINED else Cell(text, float(value))


def cells(*values: Any, digits: int = 4) -> list[Cell]:
    """Cells of a row."""
    return [cell(value, digits) for value in values]


def given(value: Any) -> Cell:
    """Cell of a number somebody chose: shown as it was given, without digits it does not have."""
    value = float(value)
    text = f"{value:.6g}".replace("-", "\N{MINUS SIGN}")
    return Cell(text, value) if np.isfinite(value) else Cell(UNDEFINED)


def span(values: np.ndarray, digits: int = 4) -> str:
    """Write the smallest and the largest of some numbers."""
    return f"{plain(values.min(), digits)} to {plain(values.max(), digits)}"


def operating_points(dataset: xr.Dataset) -> Table:
    """Operating points of a campaign."""
    names = [
        "shift", "yaw", "roll", "wheel_load", "speed", "friction", "track_curvature",
        "environment", "weight", "block_length",
    ]  # fmt: skip
    columns = [map(given, values_of(dataset, name)) for name in names]
    rows = [cells(*row) for row in zip(dataset["operating_point_name"].values, *columns, strict=True)]
    head = ["Operating point", *(label(dataset, name) for name in names)]
    return Table("", "", head, rows, "numbers", f"{role_title(dataset)}: all {len(rows)} operating points")


def running(dataset: xr.Dataset) -> list[Table]:
    """Where the wheelset ran at the end, and the forces on it; nothing of results that do not hold it."""
    if "lateral_position" not in dataset:
        return []
    row = last_worn_row(dataset)
    acting = dataset["weight"].values > 0.0
    names = ["lateral_position", "lateral_force", "steering_moment", "axle_wear_number", "wear_share"]
    columns = [values_of(dataset, name, row) for name in names]
    quotient = values_of(dataset, "derailment_quotient", row)
    head = ["Operating point", *(label(dataset, name) for name in names), "Y/Q right", "left"]
    values = np.column_stack([*columns, quotient])[acting]
    points = dataset["operating_point_name"].values[acting]
    rows = [cells(name, *numbers, digits=3) for name, numbers in zip(points, values, strict=True)]
    caption = "Lateral position, forces and wear number of the operating points at the end"
    return [Table("running", "", head, rows, "numbers", caption)]


_SETTINGS = (
    "wheel_profile_right", "wheel_profile_left", "counterface_profile", "counterface_wear_factor",
    "redress_distance", "redress_depth", "counterface_area_rate", "wheel_radius", "half_span",
    "rotation_rule", "roll_rule", "contact_normal", "contact_tangential", "contact_parameters", "strips",
    "cells", "cell_size", "most_cells", "axle_torque", "youngs_modulus", "poisson_ratio", "wheel_density",
    "wear_law", "wear_form", "wear_coefficients", "seizure_cap", "integrator", "depth_cap", "first_depth",
    "stability_limit", "error_tolerance", "smoothing_wavelength", "recorded_samples", "binning_error",
)  # fmt: skip
"""Attributes of a result file, in order; texts and units are those of the quantity of that name."""

_QUANTITY_OF = {
    "wheel_density": "density", "stability_limit": "stability_number", "error_tolerance": "step_error",
}  # fmt: skip
_SETTING_TEXTS = {
    "wheel_profile_right": "Wheel profile, right", "wheel_profile_left": "Wheel profile, left",
    "rotation_rule": "Rule of the wheel rotation", "roll_rule": "Roll of the wheelset",
    "contact_normal": "Normal contact model", "contact_tangential": "Tangential contact model",
    "contact_parameters": "Parameters of the contact models", "wear_form": "Form of the wear law",
    "seizure_cap": "Cap that keeps out the seizure regime",
    "stability_limit": "Limit of the stability number", "error_tolerance": "Tolerance of the error of a step",
}  # fmt: skip
"""Texts of those that are no quantity, and not their name with spaces."""


def settings(datasets: list[xr.Dataset]) -> Table:
    """Show what was computed, a column per campaign; rows that differ are shaded."""
    roller = [float(data.attrs.get("counterface_curvature", 0.0)) for data in datasets]
    rows = [cells("Counterface", *(f"roller, radius {1e3 / k:.4g} mm" if k else "rail" for k in roller))]
    for name in ("shift", "yaw", "wheel_load", "speed", "friction", "track_curvature"):
        ranges = (_range(name, data[name].values[data["weight"].values > 0.0]) for data in datasets)
        rows.append(cells(label(datasets[0], name), *ranges))
    rows.append(cells("Environment factor on the wear depth", *map(environment_text, datasets)))
    for key in _SETTINGS:
        values = [data.attrs.get(key) for data in datasets]
        if any(value is not None for value in values):
            quantity = QUANTITIES.get(_QUANTITY_OF.get(key, key))
            text = _SETTING_TEXTS.get(key, quantity.meaning if quantity else key.replace("_", " "))
            text = with_unit(text, quantity.name) if quantity else capital(text)
            factor = quantity.shown_factor if quantity else 1.0
            rows.append(cells(text, *(_setting(value, factor) for value in values)))
    differ = frozenset(k for k, row in enumerate(rows) if len({cell.text for cell in row[1:]}) > 1)
    caption = f"What was computed{'; shaded rows differ' if len(datasets) > 1 else ''}."
    return Table("settings", caption, ["Setting", *map(role_title, datasets)], rows, "text", shaded=differ)


def _setting(value: Any, factor: float) -> Cell | str:
    if value is None or isinstance(value, str):
        return "not given" if value is None else value
    return given(float(value) * factor)


def _range(name: str, values: np.ndarray) -> Cell | str:
    if values.size == 0:
        return "none"
    low, high = shown(name, [values.min(), values.max()])
    return given(low) if low == high else f"{given(low).text} to {given(high).text}"


def limits(datasets: list[xr.Dataset]) -> list[Table]:
    """Limits and where each campaign meets them, for limits that any of them has."""
    met = [{limit.name: limit for limit in limits_met(data)} for data in datasets]
    rows = []
    for name in LIMITED:
        if any(name in campaign for campaign in met):
            values = sorted({campaign[name].limit for campaign in met if name in campaign})
            rows.append(cells(limit_text(name, values), *(_where_met(one.get(name)) for one in met)))
    caption = "Limits and the distance at which each is met, linear between two wear steps."
    head = ["Limit", *map(role_title, datasets)]
    return [Table("limits", caption, head, rows, "numbers")] if rows else []


def limit_text(name: str, values: Sequence[float]) -> str:
    """Write a limit, or the limits of several campaigns, on one measure."""
    quantity = QUANTITIES[name]
    unit = "" if quantity.shown_unit == "1" else f" {quantity.shown_unit}"
    most = "at most" if LIMITED[name] > 0.0 else "at least"
    texts = " or ".join(f"{value:g}" for value in shown(name, values))
    return f"{capital(quantity.meaning)}, {most} {texts}{unit}"


def _where_met(limit: LimitMet | None) -> Cell:
    if limit is None:
        return Cell("not given")
    sides = ("right: ", "left: ") if len(limit.distance) == 2 else ("",)
    unit = QUANTITIES["distance"].shown_unit
    met = [
        "not met" if at is None else f"{plain(float(shown('distance', at)))} {unit}" for at in limit.distance
    ]
    texts = [side + text for side, text in zip(sides, met, strict=True)]
    return Cell("; ".join(texts), min((at for at in limit.distance if at is not None), default=None))


def reprofiled_wheels(datasets: list[xr.Dataset]) -> list[Table]:
    """Diameter before, after and lost by each reprofiling of the wheels, for campaigns that have any."""

    def diameters(before: float | None, after: float | None) -> list[Cell]:
        if before is None or after is None:
            return cells(*[UNDEFINED] * 3)
        return cells(cell(1e3 * before, 6), cell(1e3 * after, 6), 1e3 * (before - after))

    text = "Reprofilings of the wheels: diameter at the running circle [mm]. Wear depth counts from the last."
    caption = " ".join([text, *filter(None, map(cracks_left, datasets))])
    columns = (text for side in ("right", "left") for text in (f"{side}, before", "after", "lost"))
    head = ["Distance [km]", *columns]
    tables = []
    for data in datasets:
        rows = [
            cells(shown("distance", one.distance))
            + diameters(one.before[0], one.after[0])
            + diameters(one.before[1], one.after[1])
            for one in reprofilings(data)
        ]
        tables += [Table(f"reprofilings-{role_of(data)}", caption, head, rows, "numbers")] if rows else []
    return tables


def counterface(dataset: xr.Dataset) -> list[Table]:
    """Depth, area, and what was redressed, of both rails or rollers, if they wear."""
    if not wears(dataset):
        return []
    times = int(dataset["counterface_redressed_count"].values[-1])
    rows = [
        cells(with_unit(QUANTITIES[name].meaning, name), *values_of(dataset, name, -1))
        for name in COUNTERFACE_MEASURES[: 3 if times else 2]
    ]
    caption = "wear of the counterface at the end of the campaign"
    if rolls(dataset):
        often = "once" if times == 1 else f"{times} times"
        caption += f"; the rollers were redressed {often}" if times else "; the rollers were never redressed"
    head = ["Measure", *(capital(str(name)) for name in dataset["counterface_name"].values)]
    return [Table("counterface", f"{caption}.", head, rows)]


def state(dataset: xr.Dataset, caption: str) -> Table:
    """Measures of one campaign, new, worn and their change, by wheel where they differ."""
    rows = []
    for name in (*MEASURES, "equivalent_conicity"):
        new, worn = shown(name, dataset[name].values[[0, last_worn_row(dataset)]])
        sides = (", right", ", left") if new.ndim else ("",)
        for side, start, end in zip(sides, np.atleast_1d(new), np.atleast_1d(worn), strict=True):
            rows.append(cells(label(dataset, name) + side, start, end, end - start))
    return Table("verdict", caption, ["Quantity", "New", "Worn", "Change"], rows, "numbers")
