"""Tables of the damage laws: what each wears, what each tires, how far they agree, largest fatigue index."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import xarray as xr

from wearsim.damage.fatigue import FATIGUE_LAWS
from wearsim.damage.fatigue.agreement import Agreement, agreement
from wearsim.damage.fatigue.balance import LIMITED_BY, balance
from wearsim.quantities import QUANTITIES
from wearsim.report.figures.campaign import WHEELS
from wearsim.report.style import shown, with_unit
from wearsim.report.tables import Table, table
from wearsim.results.checks import depth_by_regime, last_worn_row, new_row

SUBSURFACE = "subsurface_fatigue_index"


def wear_laws(dataset: xr.Dataset) -> list[Table]:
    """Compare the active law and the comparison laws."""
    row = last_worn_row(dataset)  # depth begins anew at a reprofiling, area goes on
    depth = [dataset["wear_depth"].values[row]]
    by_regime = depth_by_regime(dataset)
    total = by_regime.sum(axis=1, keepdims=True)
    # of the active law the file has depths by regime: their sums share out the exact area
    share = np.divide(by_regime, total, out=np.zeros_like(by_regime), where=total > 0.0)
    names = [f"{dataset.attrs.get('wear_law', 'law')}, active"]
    area = [share * dataset["worn_area"].values[-1][:, None]]
    regime_names = [[str(name) for name in dataset["regime_name"].values]]
    if "comparison_name" in dataset:
        pairs = [str(text).split(": ", 1) for text in dataset["comparison_regime_name"].values]
        for k, law in enumerate(str(name) for name in dataset["comparison_name"].values):
            here = [i for i, (owner, _) in enumerate(pairs) if owner == law]
            names.append(law)
            depth.append(dataset["comparison_wear_depth"].values[row, :, k])
            area.append(dataset["comparison_worn_area"].values[-1][:, here])
            regime_names.append([pairs[i][1] for i in here])
    rows = []
    for name, worn, deep, regimes in zip(names, area, depth, regime_names, strict=True):
        right_left, deepest = worn.sum(axis=1), deep.max(axis=1)
        rows.append([
            name, *shown("worn_area", right_left), _ratio(right_left.sum(), area[0].sum()),
            *shown("wear_depth", deepest), _ratio(deepest.max(), depth[0].max()),
            _shares(regimes, worn.sum(axis=0)),
        ])  # fmt: skip
    return [table("wear_laws", rows, context={"data": dataset}, digits=(4, 4, 4, 3, 4, 4, 3, 4))]


def fatigue_laws(dataset: xr.Dataset) -> Table:
    """Largest damage and damage rate of each fatigue law and where."""
    rows = []
    end = last_worn_row(dataset)
    y = dataset["profile_y"].values[new_row(dataset, end)]
    names = [str(name) for name in dataset["fatigue_name"].values]
    for k, name in enumerate(names):
        row: list[Any] = [name]
        for wheel in (0, 1):
            damage = dataset["fatigue_damage"].values[end, wheel, k]
            rate = dataset["fatigue_damage_rate"].values[end, wheel, k].max()
            place = 1e3 * y[wheel, damage.argmax()] if damage.max() > 0.0 else None
            row += [damage.max(), place, shown("fatigue_damage_rate", rate)[()]]
        rows.append([*row, 1e3 * dataset["fatigue_crack_width"].values[k]])
    return table("fatigue_laws", rows, context={"data": dataset}, digits=3)


def life(dataset: xr.Dataset) -> Table | None:
    """Say what limits the life of each wheel, from new at the rates of the last state; None if unknown."""
    rows, of_rails = [], []
    materials = str(dataset.attrs.get("fatigue_materials", "")).split("\n")
    end = last_worn_row(dataset)
    wear = dataset["wear_depth_rate"].values[end]
    y = dataset["profile_y"].values[new_row(dataset, end)]
    for k, name in enumerate(dataset["fatigue_name"].values):
        crack = float(dataset["fatigue_crack_depth"].values[k])
        limit = float(dataset["fatigue_wear_limit"].values[k])
        if not np.isfinite(crack):
            continue
        if any("rail" in steel and "wheel" not in steel for steel in materials[k : k + 1]):
            of_rails.append((str(name), materials[k], str(dataset["fatigue_coefficients"].values[k])))
        for wheel, side in enumerate(WHEELS):
            rate = dataset["fatigue_damage_rate"].values[end, wheel, k]
            half, result, double = (
                balance(part * rate, wear[wheel], crack_depth=crack, wear_limit=limit)
                for part in (0.5, 1.0, 2.0)  # of the width of a place
            )
            distances = {"wear": result.wear_distance, "cracks": result.crack_distance}
            first = min(distances, key=lambda what: distances[what].min())
            ends = np.isfinite(distances[first].min())
            acts = (rate > 0.0) | (wear[wheel] > 0.0)
            grown = (result.limited_by == LIMITED_BY.index("cracks")) & acts
            rows.append([
                f"{name}, {side} wheel", 1e3 * crack, 1e3 * limit, _distance(result.crack_distance),
                _distance(half.crack_distance), _distance(double.crack_distance),
                _distance(result.wear_distance), first if ends else "nothing",
                1e3 * y[wheel, distances[first].argmin()] if ends else None,
                100.0 * grown.sum() / acts.sum() if acts.any() else None,
                shown("magic_wear_rate", result.magic_wear_rate.max())[()],
            ])  # fmt: skip
    digits = (3, 3, 3, 4, 4, 4, 4, 3, 3, 3, 3)
    return table("life", rows, context={"of_rails": of_rails}, digits=digits) if rows else None


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
    rows = [[law, *shares] for law, shares in zip(common.laws, common.overlap, strict=True)]
    return table("agreement", rows, *common.laws, digits=3)


def fatigue_tables(dataset: xr.Dataset) -> list[Table]:
    """Return all tables on fatigue of a campaign, none if it has no fatigue laws."""
    if "fatigue_name" not in dataset:
        return []
    several = [overlaps(dataset)] if dataset.sizes["fatigue"] > 1 else []
    tables = [*fatigue_index(dataset), fatigue_laws(dataset), life(dataset), *several]
    return [table for table in tables if table is not None]


def _ratio(value: float, active: float) -> float | str:
    return value / active if active > 0.0 else "active law wears nothing"


def _distance(distances: np.ndarray) -> float | str:
    nearest = float(shown("distance", distances.min()))
    return nearest if np.isfinite(nearest) else "never"


def _shares(names: list[str], area: np.ndarray) -> str:
    if not area.sum() > 0.0:
        return "no wear"
    return ", ".join(f"{name} {part:.1%}" for name, part in zip(names, area / area.sum(), strict=True))


def quantity_of(law: str) -> str:
    """Return the quantity a law judges by, as `wearsim.quantities` names it."""
    return FATIGUE_LAWS[law].index_quantity if law in FATIGUE_LAWS else SUBSURFACE


def largest(dataset: xr.Dataset, row: int, law: int | None) -> list[tuple[float, float, str] | None]:
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
    for wheel in range(len(WHEELS)):
        here = np.where((dataset["side"].values[row] == wheel) & np.isfinite(index), index, -np.inf)
        at = np.unravel_index(int(here.argmax()), here.shape)
        monitored = dataset["weight"].values[at[0]] == 0.0
        point = f"{dataset['operating_point_name'].values[at[0]]}{' (monitored)' if monitored else ''}"
        indexes.append((float(here[at]), float(y[at]), point) if np.isfinite(here[at]) else None)
    return indexes


def _limit(numbers: str) -> float:
    """Index above which a law sees damage: 0, or the first break point of its damage function."""
    start = re.search(r"\bstart = ([^ ,]+)", numbers)
    return float(start[1]) if start else 0.0


def fatigue_index(dataset: xr.Dataset) -> list[Table]:
    """Largest index of each law and wheel of a campaign with fatigue laws, new and at the end."""
    numbers = str(dataset.attrs.get("fatigue_numbers", "")).split("\n")
    laws = [(k, str(name)) for k, name in enumerate(dataset["fatigue_name"].values)]
    rows = []
    for law, name in [*laws, (None, "below the surface")]:
        entry = QUANTITIES[quantity_of(name)]
        limit = "the steel's own" if law is None else _limit("".join(numbers[law : law + 1]))
        states = [largest(dataset, at, law) for at in (0, last_worn_row(dataset))]
        for wheel, side in enumerate(WHEELS):
            row: list[Any] = [f"{name}, {side} wheel: {entry.meaning}{with_unit('', entry.name)}", limit]
            for one in (state[wheel] for state in states):
                row += [None] * 3 if one is None else [shown(entry.name, one[0])[()], 1e3 * one[1], one[2]]
            rows.append(row)
    return [table("fatigue_index", rows, digits=(3, 4, 3, 3, 3, 3, 3, 3))]
