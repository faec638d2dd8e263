"""Tables of the damage laws: what each wears, what each tires, how far they agree, largest fatigue index."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
import xarray as xr

from wearsim.damage.fatigue import FATIGUE_LAWS
from wearsim.damage.fatigue.agreement import Agreement, agreement
from wearsim.damage.fatigue.balance import LIMITED_BY, balance
from wearsim.quantities import QUANTITIES
from wearsim.report.figures.campaign import WHEELS
from wearsim.report.style import capital, shown, with_unit
from wearsim.report.tables import NONE, Cell, Table, number
from wearsim.results.checks import (
    closing_reprofiling,
    depth_by_regime,
    last_worn_row,
    new_row,
    reprofiled_rows,
)

SUBSURFACE = "subsurface_fatigue_index"
_WIDTHS = (0.5, 2.0)
"""Shares of the width of a place for which the first crack is shown, too."""
_HOLDS = ("materials", "validity", "departures")
"""What a result file says of the coefficient set of a law, besides its numbers."""


def wear_laws(dataset: xr.Dataset) -> list[Table]:
    """Worn area, deepest depth and share of each regime by the active law and the comparison laws.

    Parameters
    ----------
    dataset : Dataset
        Result of a campaign.

    Returns
    -------
    list of Table
        What the laws wear, and where their numbers come from.
    """
    row = last_worn_row(dataset)  # depth begins anew at a reprofiling, area goes on
    depth = [dataset["wear_depth"].values[row]]
    by_regime = depth_by_regime(dataset)
    total = by_regime.sum(axis=1, keepdims=True)
    # of the active law the file has depths by regime: their sums share out the exact area
    share = np.divide(by_regime, total, out=np.zeros_like(by_regime), where=total > 0.0)
    names = [f"{dataset.attrs.get('wear_law', 'law')}, active"]
    area = [share * dataset["worn_area"].values[-1][:, None]]
    regime_names = [[str(name) for name in dataset["regime_name"].values]]
    keys = ("wear_form", "wear_coefficients", "wear_coefficients_source", "wear_coefficients_warnings")
    origin = [[str(dataset.attrs.get(key, "")) for key in keys]]
    if "comparison_name" in dataset:
        pairs = [str(text).split(": ", 1) for text in dataset["comparison_regime_name"].values]
        for k, law in enumerate(str(name) for name in dataset["comparison_name"].values):
            here = [i for i, (owner, _) in enumerate(pairs) if owner == law]
            names.append(law)
            depth.append(dataset["comparison_wear_depth"].values[row, :, k])
            area.append(dataset["comparison_worn_area"].values[-1][:, here])
            regime_names.append([pairs[i][1] for i in here])
            origin.append(_origin(dataset, "comparison", k))
    active = (float(area[0].sum()), float(depth[0].max()))
    rows = []
    for k, name in enumerate(names):
        worn, deepest = area[k].sum(axis=1), depth[k].max(axis=1)
        rows.append([
            Cell(name),
            *(number(value, 4) for value in shown("worn_area", worn)),
            _ratio(float(worn.sum()), active[0]),
            *(number(value, 4) for value in shown("wear_depth", deepest)),
            _ratio(float(deepest.max()), active[1]),
            Cell(_shares(regime_names[k], area[k].sum(axis=0))),
        ])  # fmt: skip
    head = [
        "Wear law", "Worn area, right [mm²]", "left [mm²]", "over active", "Deepest, right [mm]",
        "left [mm]", "over active", "Share of the worn area by regime",
    ]  # fmt: skip
    text = "Wear laws on the contacts of the campaign; the profile wears by the active law alone."
    if reprofiled_rows(dataset):
        text += " Area is of all wear, depth of the wear since the last reprofiling."
    active_set = [str(dataset.attrs.get(f"wear_coefficients_{key}", "")) for key in _HOLDS]
    validity = [active_set, *_validity(dataset, "comparison")]
    return [Table("wear-laws", text, head, rows), *_sources("wear", names, origin, validity)]


def fatigue_laws(dataset: xr.Dataset) -> list[Table]:
    """Largest damage and damage rate of each fatigue law, and where on the wheels.

    Parameters
    ----------
    dataset : Dataset
        Result of a campaign with fatigue laws.

    Returns
    -------
    list of Table
        What the laws give, and where their numbers come from.
    """
    rows = []
    end = last_worn_row(dataset)
    y = dataset["profile_y"].values[new_row(dataset, end)]
    names = [str(name) for name in dataset["fatigue_name"].values]
    for k, name in enumerate(names):
        damage = dataset["fatigue_damage"].values[end, :, k]
        rate = dataset["fatigue_damage_rate"].values[end, :, k]
        cells = [Cell(name)]
        for wheel in (0, 1):
            largest = float(damage[wheel].max())
            place = number(1e3 * y[wheel, int(damage[wheel].argmax())], 3) if largest > 0.0 else NONE
            cells += [
                number(largest, 3), place, number(shown("fatigue_damage_rate", rate[wheel].max()), 3)
            ]  # fmt: skip
        rows.append([*cells, number(1e3 * dataset["fatigue_crack_width"].values[k], 3)])
    what = ("largest damage", "at y [mm]", "largest rate at the end, before removal [1/1000 km]")
    head = [
        "Fatigue law", *(f"{side.capitalize()}: {text}" for side in WHEELS for text in what),
        "Width of a place [mm]",
    ]  # fmt: skip
    text = (
        "Fatigue laws along the profile. Damage 1 is a crack of visible size for wlrm; the other laws order "
        "passages and count no cycles to failure. The environment factor acts on wear, not on damage. Rates "
        "are before what wear removes of cracks of a stated depth. The width of a place is an assumption: "
        "damage at a point before removal is in proportion to it."
    )
    text = " ".join(filter(None, (text, closing_reprofiling(dataset))))
    origin = [_origin(dataset, "fatigue", k) for k in range(len(names))]
    validity = _validity(dataset, "fatigue")
    return [Table("fatigue-laws", text, head, rows), *_sources("fatigue", names, origin, validity)]


def _origin(dataset: xr.Dataset, group: str, law: int) -> list[str]:
    """Form, coefficients, their source and uncertain ones of a law."""
    return [
        str(dataset[f"{group}_{key}"].values[law]) for key in ("form", "coefficients", "source", "warnings")
    ]


def _validity(dataset: xr.Dataset, group: str) -> list[list[str]]:
    """Materials, validity and departures of each law of a group; empty in files without them."""
    count = dataset[f"{group}_name"].size if f"{group}_name" in dataset else 0
    columns = [str(dataset.attrs.get(f"{group}_{key}", "")).split("\n") for key in _HOLDS]
    return [[column[law] if law < len(column) else "" for column in columns] for law in range(count)]


def _sources(group: str, laws: list[str], origin: list[list[str]], validity: list[list[str]]) -> list[Table]:
    """Tables on where the numbers of laws come from and what they hold for."""
    what = f"{group.capitalize()} law"
    text = "Where the numbers of the laws come from"
    origin = [[form.replace("_", " "), *others] for form, *others in origin]
    return [
        Table(f"{group}-law-{name}", caption, [what, *head], [
            [Cell(law), *(Cell(one or "–") for one in texts)] for law, texts in zip(laws, rows, strict=True)
        ])
        for name, caption, head, rows in (
            ("numbers", f"{text}.", ("Form", "Coefficients", "Source", "Uncertain coefficients"), origin),
            ("validity", f"{text}: the materials they were measured on, what they hold for, and where our "
             "law departs from its source.",
             ("Materials", "Holds for", "Departures from the source"), validity),
        )
    ]  # fmt: skip


def life(dataset: xr.Dataset) -> Table | None:
    """Say what limits the life of each wheel, from new at the rates of the last state; None if unknown."""
    rows, steels = [], []
    end = last_worn_row(dataset)
    wear = dataset["wear_depth_rate"].values[end]
    y = dataset["profile_y"].values[new_row(dataset, end)]
    for k, name in enumerate(dataset["fatigue_name"].values):
        crack = float(dataset["fatigue_crack_depth"].values[k])
        limit = float(dataset["fatigue_wear_limit"].values[k])
        if not np.isfinite(crack):
            continue
        steels.append(_steel(dataset, k))
        for wheel, side in enumerate(WHEELS):
            rate = dataset["fatigue_damage_rate"].values[end, wheel, k]
            result = balance(rate, wear[wheel], crack_depth=crack, wear_limit=limit)
            ends = {
                "wear": (float(result.wear_distance.min()), int(result.wear_distance.argmin())),
                "cracks": (float(result.crack_distance.min()), int(result.crack_distance.argmin())),
            }
            first = min(ends, key=lambda what: ends[what][0])
            other = [
                balance(part * rate, wear[wheel], crack_depth=crack, wear_limit=limit).crack_distance.min()
                for part in _WIDTHS
            ]
            acts = (rate > 0.0) | (wear[wheel] > 0.0)
            grown = (result.limited_by == LIMITED_BY.index("cracks")) & acts
            rows.append([
                Cell(f"{name}, {side} wheel"),
                number(1e3 * crack, 3),
                number(1e3 * limit, 3),
                _distance(ends["cracks"][0]),
                *(_distance(float(distance)) for distance in other),
                _distance(ends["wear"][0]),
                Cell(first if np.isfinite(ends[first][0]) else "nothing"),
                number(1e3 * y[wheel, ends[first][1]], 3) if np.isfinite(ends[first][0]) else NONE,
                number(100.0 * grown.sum() / acts.sum(), 3) if acts.any() else NONE,
                number(shown("magic_wear_rate", result.magic_wear_rate.max()), 3),
            ])  # fmt: skip
    if not rows:
        return None
    head = [
        "Fatigue law and wheel", "Crack of damage 1 [mm]", "Depth that may wear [mm]",
        "First crack after [km]", "with half the width of a place [km]", "with double the width [km]",
        "Wear limit after [km]", "Life ends by", "at y [mm]",
        "Points limited by cracks [%]", "Largest magic wear rate [µm/1000 km]",
    ]  # fmt: skip
    text = (
        "Wear against fatigue, from a new wheel at the rates of the full collective in the last state: what "
        "is met first at any place of the profile. The magic wear rate is the one at which cracks just do "
        "not grow. The depth of a crack, the depth that may wear and the width of a place are assumptions: "
        "the distance to the wear limit is in proportion to the depth that may wear, and damage to the width."
    )
    return Table("life", " ".join([text, *filter(None, dict.fromkeys(steels))]), head, rows)


def _steel(dataset: xr.Dataset, law: int) -> str:
    """Sentence on numbers of a fatigue law that are of rails; empty where they are of wheels, or unknown."""
    materials = [entry[0] for entry in _validity(dataset, "fatigue")][law]
    if "rail" not in materials or "wheel" in materials:
        return ""
    name, numbers = (str(dataset[f"fatigue_{key}"].values[law]) for key in ("name", "coefficients"))
    return f"Cracks of {name} are counted with numbers of {materials} ({numbers}), not of wheel steel."


def cycles(dataset: xr.Dataset) -> Agreement:
    """Compare the fatigue laws over the load cycles of the worn wheels, weighted as they occur."""
    damage = dataset["fatigue_damage_passage"].values[last_worn_row(dataset)]
    here = np.isfinite(damage[..., 0])
    weight = np.broadcast_to(dataset["weight"].values[:, None], here.shape)[here]
    laws = [str(name) for name in dataset["fatigue_name"].values]
    return agreement({law: damage[here][:, k] for k, law in enumerate(laws)}, weight)


def overlaps(dataset: xr.Dataset) -> Table:
    """Compare each pair of laws: the common part of their damage over the load cycles."""
    common = cycles(dataset)
    rows = [
        [Cell(law), *(number(value, 3) for value in common.overlap[k])] for k, law in enumerate(common.laws)
    ]
    text = (
        "Agreement of the fatigue laws: common part of their distributions of damage over the load cycles of "
        "the worn wheels, weighted with the shares of the collective; 1 where they are the same, 0 where no "
        "cycle has damage by both."
    )
    return Table("agreement", text, ["Fatigue law", *common.laws], rows)


def wear_numbers(dataset: xr.Dataset) -> Table:
    """Largest wear numbers of each wheel, with and without spin."""
    end = last_worn_row(dataset)
    side = dataset["side"].values[end]
    rows = []
    for name in ("wear_number_without_spin", "wear_number_with_spin"):
        values = shown(name, dataset[name].values[end])
        largest = (number(values[side == wheel].max(initial=0.0)) for wheel in (0, 1))
        rows.append([Cell(capital(str(dataset[name].attrs["long_name"]))), *largest])
    text = "Largest wear number of any contact patch at the end, monitoring points included."
    return Table("wear-numbers", text, ["Wear number", "Right wheel [N]", "Left wheel [N]"], rows)


def fatigue_tables(dataset: xr.Dataset) -> list[Table]:
    """Return all tables on fatigue of a campaign, none if it has no fatigue laws."""
    if "fatigue_name" not in dataset:
        return []
    several = [overlaps(dataset)] if dataset.sizes["fatigue"] > 1 else []
    tables = [*fatigue_index(dataset), *fatigue_laws(dataset), life(dataset), *several, wear_numbers(dataset)]
    return [table for table in tables if table is not None]


def _ratio(value: float, active: float) -> Cell:
    return number(value / active, 3) if active > 0.0 else Cell("active law wears nothing")


def _distance(value: float) -> Cell:
    return number(shown("distance", value), 4) if np.isfinite(value) else Cell("never")


def _shares(names: list[str], area: np.ndarray) -> str:
    if not area.sum() > 0.0:
        return "no wear"
    return ", ".join(f"{name} {part:.1%}" for name, part in zip(names, area / area.sum(), strict=True))


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
        Right and left; None where no patch carries load.
    """
    if law is None:
        index, y = dataset[SUBSURFACE].values[row], dataset["wheel_y"].values[row]
    else:
        name = quantity_of(str(dataset["fatigue_name"].values[law]))
        index, y = dataset[name].values[row, ..., law], dataset["fatigue_index_y"].values[row, ..., law]
    side = dataset["side"].values[row]
    indexes: list[LargestIndex | None] = []
    for wheel in range(len(WHEELS)):
        here = np.where((side == wheel) & np.isfinite(index), index, -np.inf)
        at = np.unravel_index(int(here.argmax()), here.shape)
        point = str(dataset["operating_point_name"].values[at[0]])
        if dataset["weight"].values[at[0]] == 0.0:
            point += " (monitored)"
        known = np.isfinite(here[at])
        indexes.append(LargestIndex(float(here[at]), float(y[at]), point) if known else None)
    return tuple(indexes)


def _limit(numbers: str) -> Cell:
    """Index above which a law sees damage: 0, or the first break point of its damage function."""
    start = re.search(r"\bstart = ([^ ,]+)", numbers)
    return number(float(start[1]) if start else 0.0)


def fatigue_index(dataset: xr.Dataset) -> list[Table]:
    """Largest index of each law and wheel of a campaign with fatigue laws, new and at the end."""
    numbers = str(dataset.attrs.get("fatigue_numbers", "")).split("\n")
    laws = [(k, str(name)) for k, name in enumerate(dataset["fatigue_name"].values)]
    rows = []
    for law, name in [*laws, (None, "below the surface")]:
        entry = QUANTITIES[quantity_of(name)]
        limit = Cell("the steel's own") if law is None else _limit(numbers[law] if law < len(numbers) else "")
        states = [largest(dataset, row, law) for row in (0, last_worn_row(dataset))]
        for wheel, side in enumerate(WHEELS):
            row = [Cell(f"{name}, {side} wheel: {entry.meaning}{with_unit('', entry.name)}"), limit]
            for state in states:
                one = state[wheel]
                if one is None:
                    row += [NONE] * 3
                else:
                    value = number(shown(entry.name, one.value), 3)
                    row += [value, number(shown("wheel_y", one.y), 3), Cell(one.point)]
            rows.append(row)
    head = [
        "Fatigue law and wheel", "Damage above",
        *(f"{state}: {what}" for state in ("New", "End") for what in ("largest index", "at y [mm]", "point")),
    ]  # fmt: skip
    text = (
        "Largest index of any contact patch, with its place on the wheel profile and its operating point, "
        "monitoring points included. Below its limit the difference is the margin to damage."
    )
    return [Table("fatigue-index", text, head, rows)]
