"""Page one of a report: three numbers, limits and what all that rests on.

The figures of page one are in `wearsim.report.plates`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from wearsim.damage.titles import law_title
from wearsim.quantities import NOT_IN_SIGHT, QUANTITIES
from wearsim.report.figures.campaign import WHEELS
from wearsim.report.plates import Datasets
from wearsim.report.style import (
    band_text,
    capital,
    distance_text,
    estimate,
    estimates,
    role_of,
    role_title,
    shown,
    values_of,
    with_unit,
)
from wearsim.report.tables import GIVEN, Table, given, table
from wearsim.report.texts import caption, lines
from wearsim.results.checks import (
    MOST_BEYOND_VALIDITY,
    last_worn_row,
    new_row,
    reprofiled_rows,
    shares_beyond_validity,
)
from wearsim.results.fatigue import crack_numbers, first_cracks
from wearsim.results.limits import (
    distances_to,
    laws_of,
    limits_met,
    worst_of,
)
from wearsim.scene.input_names import input_title
from wearsim.translation.bands import PER_KM, band_table
from wearsim.translation.translate import table as factor_table

NEVER = 1e12
"""Distance beyond which no crack is taken to come [km]: wear removes it."""
NUMBERS = 3
"""Large numbers on page one."""
MENTIONED = 0.01
"""Share of the wear beyond the validity of the models from which on it is stated."""
LIFE = "wheel_diameter"
"""Limit that ends the life of the wheels."""


@dataclass(frozen=True)
class Number:
    """A large number: value with unit, what it is, its band or what is assumed."""

    value: str
    unit: str
    meaning: str
    sure: str


@dataclass(frozen=True)
class Reached:
    """A limit of a campaign, or a first crack, at the wheel that meets it first.

    Parameters
    ----------
    variable : str
        Of the result, or the fatigue law.
    measure : str
        What is limited, in words.
    wheel : str
        Right or left, "" for the wheelset.
    values : tuple of float
        New, now, and the limit, in shown units.
    distance : float
        Where it is met [km], infinite if that is not in sight.
    met : bool
        False for a distance that is extrapolated.
    """

    variable: str
    measure: str
    wheel: str
    values: tuple[float, float, float]
    distance: float
    met: bool


def numbers(
    datasets: Datasets,
    factors: xr.Dataset | None = None,
    bands: xr.Dataset | None = None,
) -> list[Number]:
    """Give the three numbers of page one, of a campaign or of a comparison."""
    rows = {} if bands is None else _band_rows(bands)
    note = about_bands(datasets, drawn=bands is not None)
    all_numbers = (
        _of_campaign(datasets[0], rows, note)
        if factors is None
        else _of_comparison(datasets, factors, rows, note)
    )
    return list(all_numbers)[:NUMBERS]


def about_bands(datasets: Datasets, *, drawn: bool) -> str:
    """State what numbers without band assume, or what the bands do not cover."""
    exceedances = [
        (share, reason, role_of(data))
        for data in datasets
        for reason, share in shares_beyond_validity(data).items()
        if share > MOST_BEYOND_VALIDITY
    ]
    context = {"datasets": datasets, "beyond": max(exceedances, default=None)}
    return caption("number", "without" if drawn else "assumed", **context)


def _band_rows(bands: xr.Dataset) -> dict[str, dict[str, Any]]:
    """Rows of the table of bands by variable."""
    frame = band_table(bands)
    rows = frame.astype(object).to_numpy().tolist()
    named = [dict(zip(frame.columns, row, strict=True)) for row in rows]
    return {row["variable"]: row for row in named}


def _sure(row: dict[str, Any] | None, note: str, unit: str) -> str:
    """Write the band of a number with what it does not cover, or what it assumes."""
    if row is None:
        return note
    if np.isnan([row["5%"], row["95%"]]).any():
        return caption("number", "no_band", note=note)
    context = {"band": band_text((row["5%"], row["95%"]), unit), "note": note}
    context["decides"] = input_title(row["decided by"].rpartition(" (")[0])
    return caption("number", "band", **context)


def _of_campaign(
    dataset: xr.Dataset, rows: dict[str, dict[str, Any]], note: str
) -> Iterator[Number]:
    """Depth, first limit, first crack, worn area, lost mass."""
    role, end = role_of(dataset), last_worn_row(dataset)
    depth = dataset["wear_depth"].values[end]
    wheel, point = np.unravel_index(int(depth.argmax()), depth.shape)
    place = dataset["profile_y"].values[new_row(dataset, end), wheel, point]
    context = {
        "data": dataset,
        "wheel": WHEELS[wheel],
        "y": 1e3 * place,
        "say": estimate,
    }
    yield Number(
        estimate(1e3 * depth.max()),
        "mm",
        caption("number", "depth", **context),
        _sure(rows.get(f"{role}_max_wear_depth"), note, "mm"),
    )
    # a life that is extrapolated is no large number: it stands with its band alone
    near = [limit for limit in limits_of(dataset) if not _life_ahead(limit)]
    first = min(near, key=lambda limit: limit.distance, default=None)
    if first is not None and first.distance < NEVER:
        yield Number(
            estimate(first.distance),
            "km",
            caption("number", "limit", first=first, limit=_limit(first)),
            _sure(rows.get(f"{role}_{first.variable}_met"), note, "km"),
        )
    yield from _cracks([dataset])
    area = values_of(dataset, "worn_area", -1).sum()
    text = caption("number", "area", data=dataset)
    band = _sure(rows.get(f"{role}_worn_area"), note, "mm²")
    yield Number(estimate(area), "mm²", text, band)
    mass = values_of(dataset, "worn_mass", -1).sum()
    assumed = about_bands([dataset], drawn=False)
    yield Number(estimate(mass), "kg", caption("number", "mass", data=dataset), assumed)


def _of_comparison(
    datasets: Datasets,
    factors: xr.Dataset,
    rows: dict[str, dict[str, Any]],
    note: str,
) -> Iterator[Number]:
    """Equivalent distance, factors of depth and of damage, first cracks, area."""
    factor_rows = {
        (row["basis"], row["variable"]): row
        for row in factor_table(factors).to_dict("records")
    }
    run, depth = (
        {
            basis: factor_rows[basis, name]
            for basis in ("equal distance", "equal worn depth")
        }
        for name in ("distance_run", "max_wear_depth")
    )
    equal_depth = run["equal worn depth"]
    if equal_depth["status"] == "defined" and equal_depth["rig"] > 0.0:
        runs = estimates(equal_depth[role] for role in ("rig", "field"))
        context = {"runs": runs, "depth": depth["equal worn depth"]["rig"]}
        yield Number(
            estimate(equal_depth["field"] / equal_depth["rig"]),
            "km",
            caption("number", "equivalent", say=estimate, **context),
            _sure(rows.get(next(iter(PER_KM))), note, "km"),
        )
    for name in ("max_wear_depth", "worn_area"):
        row = factor_rows["equal distance", name]
        if row["status"] == "defined":
            context = {"row": row, "run": run["equal distance"]["rig"]}
            yield Number(
                estimate(row["factor"]),
                "times",
                caption("number", name, say=estimate, **context),
                _sure(rows.get(f"{name}_factor"), note, "times"),
            )
        if name == "max_wear_depth":
            yield from _cracks(datasets)


def _cracks(datasets: Datasets) -> Iterator[Number]:
    """Distances to the first crack of campaigns, by each law that counts cycles."""
    by_law: dict[tuple[str, str], list[tuple[str, float]]] = {}
    for data in datasets:
        for crack in cracks_of(data):
            place = (crack.variable, crack_numbers(data, crack.variable))
            by_law.setdefault(place, []).append((role_of(data), crack.distance))
    for (law, origin), ends in by_law.items():
        reached = [(role, km) for role, km in ends if km < NEVER]
        near = iter(estimates(km for _, km in reached))
        value = " / ".join(next(near) if km < NEVER else NOT_IN_SIGHT for _, km in ends)
        context = {"law": law, "origin": origin, "roles": [role for role, _ in ends]}
        yield Number(
            value,
            "km" if reached else "",
            caption("number", "crack", **context),
            caption("number", "crack_assumes", **context),
        )


def limits_of(dataset: xr.Dataset) -> list[Reached]:
    """Limits of a campaign, each of the wheel that meets it first."""
    laws = laws_of(dataset)
    end = last_worn_row(dataset)
    reached = []
    for limit in limits_met(dataset):
        distance, met = distances_to(dataset, limit)
        first = int(np.argmin(distance))
        new, now = (
            float(shown(limit.name, worst_of(limit.name, row, laws)[first]))
            for row in dataset[limit.name].values[[0, end]]
        )
        reached.append(
            Reached(
                variable=limit.name,
                measure=QUANTITIES[limit.name].meaning.removesuffix(" of the wheel"),
                wheel=WHEELS[first] if distance.size == len(WHEELS) else "",
                values=(new, now, float(shown(limit.name, limit.limit))),
                distance=float(shown("distance", distance[first])),
                met=bool(met[first]),
            )
        )
    return reached


def cracks_of(dataset: xr.Dataset) -> list[Reached]:
    """First crack of a campaign by each law that counts cycles: damage 1."""
    end, cracks = last_worn_row(dataset), []
    for law, (distance, met) in first_cracks(dataset).items():
        first = int(np.argmin(distance))
        index = laws_of(dataset).index(law)
        damage = float(dataset["fatigue_damage"].values[end, first, index].max())
        cracks.append(
            Reached(
                variable=law,
                measure=f"damage by {law_title(law)}, 1 is the first crack",
                wheel=WHEELS[first],
                values=(0.0, damage, 1.0),
                distance=float(shown("distance", distance[first])),
                met=bool(met[first]),
            )
        )
    return cracks


def _life_ahead(reached: Reached) -> bool:
    """Return True for the end of a life that the campaign has not met."""
    return reached.variable == LIFE and not reached.met


def limits(datasets: Datasets, *, drawn: bool = False) -> list[Table]:
    """All limits and first cracks of campaigns, the nearest first.

    Last come the lives that are extrapolated: their distances need bands, which are
    there if `drawn`.
    """
    every = [
        (reached, data)
        for data in datasets
        for reached in (*limits_of(data), *cracks_of(data))
    ]
    if not every:
        return []
    rows = [
        [
            _measure(reached),
            _wheel(reached, data),
            *reached.values,
            _where(reached, drawn=drawn),
        ]
        for reached, data in sorted(
            every, key=lambda pair: (_life_ahead(pair[0]), pair[0].distance)
        )
    ]
    return [table("nearest_limits", rows, digits=(4, 4, 4, 4, GIVEN, 4))]


def _measure(reached: Reached) -> str:
    return (
        with_unit(reached.measure, reached.variable)
        if reached.variable in QUANTITIES
        else capital(reached.measure)
    )


def _limit(reached: Reached) -> str:
    unit = QUANTITIES[reached.variable].shown_unit
    return given(reached.values[2]) + ("" if unit in ("", "1") else f" {unit}")


def _wheel(reached: Reached, dataset: xr.Dataset) -> str:
    return ", ".join(filter(None, (role_title(dataset), reached.wheel)))


def _where(reached: Reached, *, drawn: bool) -> str:
    if _life_ahead(reached) and not drawn:
        return "needs bands"
    if not reached.distance < NEVER:
        return NOT_IN_SIGHT
    if reached.met:
        return distance_text(1e3 * reached.distance)
    return f"after about {distance_text(1e3 * float(f'{reached.distance:.3g}'))}"


def assumptions(datasets: Datasets, warnings: int) -> list[str]:
    """Say what the answer rests on.

    `warnings` is their number in the sections below.
    """
    exceedances: dict[str, list[tuple[str, float]]] = {}
    for data in datasets:
        for reason, share in shares_beyond_validity(data).items():
            if share > MENTIONED:
                exceedances.setdefault(reason, []).append((role_of(data), share))
    keys = ("wear_law", "wear_coefficients_materials")
    laws = dict.fromkeys(
        tuple(data.attrs.get(key) for key in keys) for data in datasets
    )
    return lines(
        "assumptions",
        datasets=datasets,
        beyond=exceedances,
        warnings=warnings,
        laws=laws,
    )


def absent(
    datasets: Datasets,
    factors: xr.Dataset | None = None,
    *,
    drawn: bool = False,
    uncertain: bool = False,
) -> list[str]:
    """Name in one line what the report lacks.

    `drawn` is True if there are bands, `uncertain` if the scene states uncertain
    inputs.
    """
    undefined = False
    if factors is not None:
        rows = factor_table(factors)
        compared = rows["variable"].isin(["max_wear_depth", "worn_area"])
        compared &= rows["basis"] == "equal distance"
        undefined = bool((rows["status"][compared] != "defined").any())
    cracks = any(map(cracks_of, datasets))
    return lines(
        "absent",
        limited=any(map(limits_met, datasets)),
        drawn=drawn,
        uncertain=uncertain,
        reprofiled=any(map(reprofiled_rows, datasets)),
        cracks=cracks,
        undefined=undefined,
    )
