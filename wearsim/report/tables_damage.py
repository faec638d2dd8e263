"""Tables of the damage laws.

What each wears, what each tires, how far they agree, largest fatigue index.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import xarray as xr

from wearsim.damage.fatigue.balance import balance
from wearsim.damage.titles import law_title, set_title
from wearsim.quantities import QUANTITIES
from wearsim.report.figures.campaign import WHEELS
from wearsim.report.style import capital, shown, with_unit
from wearsim.report.tables import Table, given, table
from wearsim.results.checks import depth_by_regime, last_worn_row, new_row
from wearsim.results.fatigue import (
    cycles,
    damage_from,
    largest_index,
    of_rail_steel,
    quantity_of,
    steel_of,
)
from wearsim.results.limits import laws_of


def wear_laws(dataset: xr.Dataset) -> list[Table]:
    """Compare the active law and the comparison laws, where there are any."""
    if "comparison_name" not in dataset:
        return []
    row = last_worn_row(dataset)  # depth begins anew at a reprofiling, area goes on
    by_regime = depth_by_regime(dataset)
    total = by_regime.sum(axis=1, keepdims=True)
    # of the active law the file has depths by regime: their sums share out the exact
    # area
    share = np.divide(by_regime, total, out=np.zeros_like(by_regime), where=total > 0.0)
    active = share * dataset["worn_area"].values[-1][:, None]
    name = f"{law_title(str(dataset.attrs.get('wear_law', 'law')))}, active"
    laws = [
        (
            name,
            dataset["regime_name"].values.tolist(),
            dataset["wear_depth"].values[row],
            active,
        )
    ]
    pairs = [
        str(text).split(": ", 1) for text in dataset["comparison_regime_name"].values
    ]
    for k, law in enumerate(map(str, dataset["comparison_name"].values)):
        columns = [i for i, (owner, _) in enumerate(pairs) if owner == law]
        depth = dataset["comparison_wear_depth"].values[row, :, k]
        area = dataset["comparison_worn_area"].values[-1][:, columns]
        laws.append((law_title(law), [pairs[i][1] for i in columns], depth, area))
    whole, deepest = active.sum(axis=1).sum(), laws[0][2].max()
    rows = [
        [
            law,
            *shown("worn_area", area.sum(axis=1)),
            _ratio(area.sum(axis=1).sum(), whole),
            *shown("wear_depth", depth.max(axis=1)),
            _ratio(depth.max(), deepest),
            _shares(regimes, area.sum(axis=0)),
        ]
        for law, regimes, depth, area in laws
    ]
    return [
        table(
            "wear_laws",
            rows,
            context={"data": dataset},
            digits=(4, 4, 4, 3, 4, 4, 3, 4),
        )
    ]


def fatigue_laws(dataset: xr.Dataset) -> Table:
    """Largest damage of each fatigue law with its place, and its damage rate."""
    rows = []
    end = last_worn_row(dataset)
    y = dataset["profile_y"].values[new_row(dataset, end)]
    for k, law in enumerate(laws_of(dataset)):
        damage = dataset["fatigue_damage"].values[end, :, k]
        rate = dataset["fatigue_damage_rate"].values[end, :, k].max()
        wheel, point = np.unravel_index(int(damage.argmax()), damage.shape)
        worn = damage[wheel, point] > 0.0
        place = (WHEELS[wheel], 1e3 * y[wheel, point]) if worn else (None, None)
        rate = shown("fatigue_damage_rate", rate)[()]
        rows.append([law_title(law), damage[wheel, point], *place, rate])
    widths = np.unique(1e3 * dataset["fatigue_crack_width"].values)
    context = {"data": dataset, "widths": " and ".join(map(given, widths))}
    return table("fatigue_laws", rows, context=context, digits=3)


def life(dataset: xr.Dataset) -> Table | None:
    """Say what limits the life of each wheel, from new at the rates of the last state.

    None if unknown.
    """
    end = last_worn_row(dataset)
    wear, y = (
        dataset["wear_depth_rate"].values[end],
        dataset["profile_y"].values[new_row(dataset, end)],
    )
    rows = []
    of_rails = {}
    depths = {}
    for k, crack in enumerate(dataset["fatigue_crack_depth"].values.tolist()):
        name, limit = (
            str(dataset["fatigue_name"].values[k]),
            float(dataset["fatigue_wear_limit"].values[k]),
        )
        steel = steel_of(dataset, name)
        if np.isfinite(crack) and of_rail_steel(steel):
            of_rails[name] = (
                name,
                steel,
                set_title(str(dataset["fatigue_coefficients"].values[k])),
            )
        if np.isfinite(crack):
            depths[name] = (name, 1e3 * crack, 1e3 * limit)
        for wheel, side in enumerate(WHEELS) if np.isfinite(crack) else ():
            rate = dataset["fatigue_damage_rate"].values[end, wheel, k]
            result = balance(rate, wear[wheel], crack_depth=crack, wear_limit=limit)
            distances = {"wear": result.wear_distance, "cracks": result.crack_distance}
            first = min(distances, key=lambda what: distances[what].min())
            ends = np.isfinite(distances[first].min())
            rows.append(
                [
                    f"{law_title(name)}, {side} wheel",
                    _distance(result.crack_distance.min()),
                    _distance(result.wear_distance.min()),
                    first if ends else "nothing",
                    1e3 * y[wheel, distances[first].argmin()] if ends else None,
                    shown("magic_wear_rate", result.magic_wear_rate.max())[()],
                ]
            )
    digits = (3, 4, 4, 3, 3, 3)
    context = {"of_rails": of_rails.values(), "depths": depths.values()}
    return table("life", rows, context=context, digits=digits) if rows else None


def agreement(dataset: xr.Dataset) -> list[tuple[str, str, float]]:
    """Pairs of fatigue laws with the common part of their damage over load cycles."""
    laws = laws_of(dataset)
    common = cycles(dataset).overlap if len(laws) > 1 else np.empty((0, 0))
    return [
        (laws[i], laws[j], float(common[i, j]))
        for i, j in itertools.combinations(range(len(laws)), 2)
    ]


def fatigue_tables(dataset: xr.Dataset) -> list[Table]:
    """Return all tables on fatigue of a campaign, none if it has no fatigue laws."""
    if "fatigue_name" not in dataset:
        return []
    tables = [*fatigue_index(dataset), fatigue_laws(dataset), life(dataset)]
    return [table for table in tables if table is not None]


def _ratio(value: float, active: float) -> float | str:
    return value / active if active > 0.0 else "active law wears nothing"


def _distance(distance: float) -> float | str:
    return float(shown("distance", distance)) if np.isfinite(distance) else "never"


def _shares(names: list[str], area: np.ndarray) -> str:
    if not area.sum() > 0.0:
        return "no wear"
    return ", ".join(
        f"{name} {part:.1%}"
        for name, part in zip(names, area / area.sum(), strict=True)
    )


def fatigue_index(dataset: xr.Dataset) -> list[Table]:
    """Largest index of each law of a campaign with them, new and at the end.

    Of the wheel that has the larger one at the end.
    """
    numbers = str(dataset.attrs.get("fatigue_numbers", "")).split("\n")
    laws = [(k, str(name)) for k, name in enumerate(dataset["fatigue_name"].values)]
    rows = []
    for law, name in [*laws, (None, "below the surface")]:
        entry = QUANTITIES[quantity_of(name)]
        limit = (
            "depends on the steel"
            if law is None
            else damage_from("".join(numbers[law : law + 1]))
        )
        new, end = (
            largest_index(dataset, at, law) for at in (0, last_worn_row(dataset))
        )
        wheel = int(
            np.argmax([-np.inf if largest is None else largest[0] for largest in end])
        )
        row: list[Any] = [
            capital(entry.meaning + with_unit("", entry.name))
            if law is None
            else f"{law_title(name)}: {entry.meaning}{with_unit('', entry.name)}",
            WHEELS[wheel],
            limit,
        ]
        index = [
            None if largest is None else shown(entry.name, largest[0])[()]
            for largest in (new[wheel], end[wheel])
        ]
        last = end[wheel]
        place = [None, None] if last is None else [1e3 * last[1], last[2]]
        rows.append([*row, *index, *place])
    return [table("fatigue_index", rows, digits=(3, 3, 4, 3, 3, 3, 3))]
