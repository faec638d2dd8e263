"""Page one of a report.

Question, answer, limits and distances to them, and what all that assumes.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from wearsim.report.figures.campaign import WHEELS
from wearsim.report.plates import Datasets
from wearsim.report.style import plain, role_of, role_title, shown, values_of
from wearsim.report.tables import Table, limit_text, table, wear_by_class
from wearsim.report.texts import lines
from wearsim.results.checks import (
    MOST_BEYOND_VALIDITY,
    last_worn_row,
    new_row,
    shares_beyond_validity,
)
from wearsim.results.fatigue import crack_distances, crack_numbers
from wearsim.results.limits import distances_to, limits_met
from wearsim.translation.bands import PER_KM, band_table
from wearsim.translation.translate import table as factor_table

MAIN_CAUSES = 3
"""Causes, or classes of operating points, that the answer names."""
MENTIONED = 0.01
"""Share of the wear beyond the validity of the models from which on it is stated."""
LIFE = "wheel_diameter"
"""Limit that ends the life of the wheels."""
MOST_LIMITS = 3
"""Limits on page one; the others are among the wheel measures."""


def limits(datasets: Datasets) -> list[Table]:
    """Nearest limits, the first crack among them.

    Each with the distance of the wheel that comes first.

    No table without limits: `sentences` state the first crack, and whose numbers it is
    counted with. The limit of the diameter ends the life of the wheels, which page one
    states with its band alone (`service_life.sentences`).
    """
    if not any(map(limits_met, datasets)):
        return []
    rows: dict[str, list[str | None]] = {}
    first_met: dict[str, float] = {}
    for column, data in enumerate(datasets):
        reached = {
            limit_text(one.name, [one.limit]): distances_to(data, one)
            for one in limits_met(data)
            if one.name != LIFE  # on page one with its band alone
        }
        for law, cracks in crack_distances(data).items():
            reached[f"First crack by fatigue ({law})"] = cracks, np.zeros(2, bool)
        for name, (at, met) in reached.items():
            first = int(np.argmin(at))
            wheel = f" ({WHEELS[first]})" if at.size == 2 else ""
            text = (
                f"{'met at' if met[first] else 'after'} "
                f"{plain(shown('distance', at[first]), 3)} km{wheel}"
            )
            cell = text if np.isfinite(at[first]) else "not in sight"
            rows.setdefault(name, [None] * len(datasets))[column] = cell
            first_met[name] = min(at[first], first_met.get(name, np.inf))
    most = [
        [name, *rows[name]]
        for name in sorted(rows, key=first_met.__getitem__)[:MOST_LIMITS]
    ]
    if not most:
        return []
    return [table("nearest_limits", most, *map(role_title, datasets), look="text")]


def sentences(
    datasets: Datasets,
    factors: xr.Dataset | None = None,
    bands: xr.Dataset | None = None,
) -> list[str]:
    """Answer in words.

    Wear, its band unless much of it is beyond validity, main causes, fatigue.
    """
    beyond = any(
        part > MOST_BEYOND_VALIDITY
        for data in datasets
        for part in shares_beyond_validity(data).values()
    )
    sure = [] if bands is None or beyond else band_table(bands).to_dict("records")
    said: dict[str, Any] = {
        "datasets": datasets,
        "without": bands is not None and beyond,
        "limited": any(map(limits_met, datasets)),
        "say": partial(plain, digits=3),
        "cracks": _first_cracks(datasets),
        "damage": {} if factors is None else _damage_factors(factors),
    }
    if factors is None:
        said |= {
            "bands": [row for row in sure if row["quantity"] == "largest wear depth"]
        }
        wear = lines("wear", **said, **_wear(datasets[0]))
        return [*wear, *lines("fatigue", **said), *lines("missing", **said)]
    rows = {
        (row["basis"], row["variable"]): row
        for row in factor_table(factors).to_dict("records")
    }
    for basis, alike in (("equal distance", ""), ("equal worn depth", "_alike")):
        for short, name in (
            ("run", "distance_run"),
            ("depth", "max_wear_depth"),
            ("area", "worn_area"),
        ):
            said[f"{short}{alike}"] = rows[basis, name]
    factor = factors["max_wear_depth_factor"].values[0, :, -1]
    said |= {
        "bands": sure[:1] if sure and sure[0]["variable"] in PER_KM else [],
        "causes": [],
    }
    if "cause_factor" in factors:
        shares = factors["cause_factor"].values[-1]
        order = np.argsort(-np.abs(np.log(shares)), kind="stable")
        said["causes"] = [
            (factors["cause_name"].values[k], shares[k]) for k in order[:MAIN_CAUSES]
        ]
        said["rest"] = np.exp(np.log(shares[order[MAIN_CAUSES:]]).sum())
        said["rate"] = factors["rate_factor"].values[-1]
    wear = lines("factor", **said, factor=factor[np.isfinite(factor)])
    return [*wear, *lines("fatigue", **said), *lines("missing", **said)]


def _first_cracks(datasets: Datasets) -> dict[tuple[str, str], list[tuple[str, float]]]:
    """Distance to the first crack [km] with the role of the campaign.

    By law and whose numbers it takes.
    """
    cracks: dict[tuple[str, str], list[tuple[str, float]]] = {}
    for data in datasets:
        for law, distance in crack_distances(data).items():
            first = float(shown("distance", distance.min()))
            cracks.setdefault((law, crack_numbers(data, law)), []).append(
                (role_of(data), first)
            )
    return cracks


def _damage_factors(factors: xr.Dataset) -> dict[str, float]:
    """Largest damage, rig over field, at the end of equal distance.

    Of the laws for which it is defined.
    """
    if "fatigue_damage_factor" not in factors:
        return {}
    values = factors["fatigue_damage_factor"].values[0, -1, :, -1]
    names = map(str, factors["fatigue_name"].values)
    return {
        law: float(value)
        for law, value in zip(names, values, strict=True)
        if np.isfinite(value)
    }


def _wear(dataset: xr.Dataset) -> dict[str, Any]:
    """Deepest place, worn area and mass of one campaign.

    And the classes of points that wear the most.
    """
    end = last_worn_row(dataset)
    depth = dataset["wear_depth"].values[end]
    wheel, point = np.unravel_index(int(depth.argmax()), depth.shape)
    y = shown(
        "profile_y", dataset["profile_y"].values[new_row(dataset, end), wheel, point]
    )
    area, mass = (
        values_of(dataset, name, -1).sum() for name in ("worn_area", "worn_mass")
    )
    most = [
        row
        for one in wear_by_class(dataset)
        for row in one.frame.to_numpy().tolist()[:MAIN_CAUSES]
    ]
    deep = shown("wear_depth", depth.max())
    return {
        "depth": deep,
        "wheel": WHEELS[wheel],
        "y": y,
        "area": area,
        "mass": mass,
        "classes": most,
    }


def assumptions(datasets: Datasets, warnings: int) -> list[str]:
    """Say what the answer rests on.

    `warnings` is their number in the sections below.
    """
    beyond: dict[str, list[tuple[str, float]]] = {}
    for data in datasets:
        for why, share in shares_beyond_validity(data).items():
            if share > MENTIONED:
                beyond.setdefault(why, []).append((role_of(data), share))
    keys = ("wear_law", "wear_coefficients_materials")
    laws = dict.fromkeys(
        tuple(data.attrs.get(key) for key in keys) for data in datasets
    )
    return lines(
        "assumptions", datasets=datasets, beyond=beyond, warnings=warnings, laws=laws
    )
