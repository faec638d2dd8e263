"""The tables of a report as rows of cells; every number keeps its exact value with its text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

from wearsim.quantities import QUANTITIES
from wearsim.report.plates import COUNTERFACE_MEASURES, environment_text, rolls, wears
from wearsim.report.style import capital, plain, role_of, shown, with_unit
from wearsim.results.checks import cracks_left, last_worn_row, reprofilings
from wearsim.results.limits import LIMITED, LimitMet, limits_met

UNDEFINED = "undefined"


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
    caption : str
        What it holds.
    head : sequence of str
        Of all columns.
    rows : list of list of Cell
        As many cells as the head.
    look : {"laws", "points", "regimes", "text", "numbers"}
        How it looks: "text" without columns of numbers, "numbers" with nothing but those.
    fold : str
        Title it is folded under, "" if it is not.
    unfolded : bool
        Whether the fold is open.
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


def number(value: Any, digits: int = 4) -> Cell:
    """Cell of a number with some significant digits, "undefined" where there is none."""
    text = plain(value, digits)
    return Cell(text) if text == UNDEFINED else Cell(text, float(value))


def count(value: Any) -> Cell:
    """Cell of a whole number."""
    return Cell(str(int(value)), float(value))


def given(value: Any) -> Cell:
    """Cell of a number somebody chose: shown as it was given, without digits it does not have."""
    value = float(value)
    text = f"{value:.6g}".replace("-", "\N{MINUS SIGN}")
    return Cell(text, value) if np.isfinite(value) else Cell(UNDEFINED)


def span(values: np.ndarray, digits: int = 4) -> Cell:
    """Cell of the smallest and the largest of some numbers."""
    return Cell(f"{number(values.min(), digits).text} to {number(values.max(), digits).text}")


def role_title(dataset: xr.Dataset) -> str:
    """Heading of the column of a campaign."""
    return role_of(dataset).capitalize()


def operating_points(dataset: xr.Dataset) -> Table:
    """Operating points of a campaign."""
    names = [
        "shift", "yaw", "roll", "wheel_load", "speed", "friction", "track_curvature",
        "environment", "weight", "block_length",
    ]  # fmt: skip
    head = ["Operating point", *(with_unit(str(dataset[name].attrs["long_name"]), name) for name in names)]
    columns = [shown(name, dataset[name].values) for name in names]
    labels = dataset["operating_point_name"].values
    rows = [[Cell(str(text)), *(given(column[k]) for column in columns)] for k, text in enumerate(labels)]
    fold = f"{role_title(dataset)}: all {len(rows)} operating points"
    return Table("", "", head, rows, "numbers", fold)


_SETTINGS = (
    "wheel_profile_right", "wheel_profile_left", "counterface_profile", "counterface_wear_factor",
    "redress_distance", "redress_depth", "counterface_area_rate", "wheel_radius", "half_span",
    "rotation_rule", "roll_rule", "contact_normal", "contact_tangential", "contact_parameters", "strips",
    "cells", "cell_size", "most_cells", "axle_torque", "youngs_modulus", "poisson_ratio", "wheel_density",
    "wear_law", "wear_form", "wear_coefficients", "seizure_cap", "integrator", "depth_cap", "first_depth",
    "stability_limit", "error_tolerance", "smoothing_wavelength",
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
    rows = [
        [
            Cell("Counterface"),
            *(Cell(f"roller, radius {1e3 / k:.4g} mm") if k else Cell("rail") for k in roller),
        ]
    ]
    for name in ("shift", "yaw", "wheel_load", "speed", "friction", "track_curvature"):
        text = with_unit(str(datasets[0][name].attrs["long_name"]), name)
        ranges = [_range(name, data[name].values[data["weight"].values > 0.0]) for data in datasets]
        rows.append([Cell(text), *ranges])
    environment = [Cell(environment_text(data)) for data in datasets]
    rows.append([Cell("Environment factor on the wear depth"), *environment])
    for key in _SETTINGS:
        values = [data.attrs.get(key) for data in datasets]
        if any(value is not None for value in values):
            quantity = QUANTITIES.get(_QUANTITY_OF.get(key, key))
            text = _SETTING_TEXTS.get(key, quantity.meaning if quantity else key.replace("_", " "))
            text = with_unit(text, quantity.name) if quantity else capital(text)
            factor = quantity.shown_factor if quantity else 1.0
            rows.append([Cell(text), *(_setting(value, factor) for value in values)])
    differ = frozenset(k for k, row in enumerate(rows) if len({cell.text for cell in row[1:]}) > 1)
    caption = f"What was computed{'; shaded rows differ' if len(datasets) > 1 else ''}."
    return Table("settings", caption, ["Setting", *map(role_title, datasets)], rows, "text", shaded=differ)


def _setting(value: Any, factor: float) -> Cell:
    if value is None:
        return Cell("not given")
    return Cell(value) if isinstance(value, str) else given(float(value) * factor)


def _range(name: str, values: np.ndarray) -> Cell:
    if values.size == 0:
        return Cell("none")
    low, high = shown(name, [values.min(), values.max()])
    return given(low) if low == high else Cell(f"{given(low).text} to {given(high).text}")


def limits(datasets: list[xr.Dataset]) -> list[Table]:
    """Limits and where each campaign meets them, for limits that any of them has."""
    met = [{limit.name: limit for limit in limits_met(data)} for data in datasets]
    rows = []
    for name in LIMITED:
        if any(name in campaign for campaign in met):
            values = sorted({campaign[name].limit for campaign in met if name in campaign})
            cells = [_where_met(campaign.get(name)) for campaign in met]
            rows.append([Cell(limit_text(name, values)), *cells])
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

    def cells(before: float | None, after: float | None) -> list[Cell]:
        if before is None or after is None:
            return [Cell(UNDEFINED)] * 3
        return [number(1e3 * value, 6) for value in (before, after)] + [number(1e3 * (before - after))]

    text = "Reprofilings of the wheels: diameter at the running circle [mm]. Wear depth counts from the last."
    caption = " ".join([text, *filter(None, map(cracks_left, datasets))])
    head = [
        "Distance [km]",
        *(text for side in ("right", "left") for text in (f"{side}, before", "after", "lost")),
    ]
    tables = []
    for data in datasets:
        rows = [
            [number(shown("distance", one.distance)), *cells(one.before[0], one.after[0]),
             *cells(one.before[1], one.after[1])]
            for one in reprofilings(data)
        ]  # fmt: skip
        tables += [Table(f"reprofilings-{role_of(data)}", caption, head, rows, "numbers")] if rows else []
    return tables


def counterface(dataset: xr.Dataset) -> list[Table]:
    """Depth, area, and what was redressed, of both rails or rollers, if they wear."""
    if not wears(dataset):
        return []
    times = int(dataset["counterface_redressed_count"].values[-1])
    rows = [
        [Cell(with_unit(QUANTITIES[name].meaning, name)), *map(number, shown(name, dataset[name].values[-1]))]
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
    rows: list[list[Cell]] = []
    names = (
        "max_wear_depth", "worn_area", "worn_mass", "flange_height", "flange_thickness", "flange_gradient",
        "hollowing", "equivalent_conicity",
    )  # fmt: skip
    for name in names:
        values = shown(name, dataset[name].values[[0, last_worn_row(dataset)]])
        text = with_unit(str(dataset[name].attrs["long_name"]), name)
        columns = (
            [("", values)] if values.ndim == 1 else [(", right", values[:, 0]), (", left", values[:, 1])]
        )
        rows += [
            [Cell(text + suffix), number(v[0]), number(v[1]), number(v[1] - v[0])] for suffix, v in columns
        ]
    return Table("verdict", caption, ["Quantity", "New", "Worn", "Change"], rows, "numbers")
