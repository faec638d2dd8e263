"""How far a campaign can be trusted as a computation: steps, choice of contact models, convergence."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from wearsim.errors import ResultError
from wearsim.profile.shape import polygon_area_between
from wearsim.report.figures.campaign import WHEELS
from wearsim.report.style import capital, plain, role_title, shown, values_of
from wearsim.report.tables import UNDEFINED, Cell, Table, cell, cells, span
from wearsim.results.checks import (
    LOAD_TOLERANCE,
    load_scaling,
    percent,
    reprofiled_rows,
    spans,
    step_limits,
    tread_wear,
    wear_steps,
)

TABLE = "convergence.json"
COLUMNS = (
    ("flange_thickness", "flange thickness Sd [µm]", 1e6),
    ("flange_height", "flange height Sh [µm]", 1e6),
    ("max_wear_depth", "largest wear depth [µm]", 1e6),
    ("worn_area", "worn area [mm²]", 1e6),
    ("equivalent_conicity", "equivalent conicity [10⁻³]", 1e3),
    ("counterface_max_wear_depth", "largest depth of the counterface [µm]", 1e6),
    ("counterface_worn_area", "worn area of the counterface [mm²]", 1e6),
)
"""Measures, those of a counterface where it wears."""
ANYWHERE = "wear depth anywhere on the profile [µm]"

_TITLE = "Convergence, "
CAPTION = (
    "Each row is the same campaign computed otherwise: by how much its end differs from the campaign as "
    "given, the larger difference of both sides, and that as a share of what wear changed (in the last "
    "column of the largest wear depth)."
)


def quality(datasets: list[xr.Dataset]) -> Table:
    """List the checks of the computation, a column per campaign."""
    columns = [_checks(data) for data in datasets]
    names = dict.fromkeys(text for column in columns for text in column)
    rows = [cells(text, *(column.get(text) for column in columns)) for text in names]
    return Table("quality", "", ["Check", *map(role_title, datasets)], rows, "numbers")


def _checks(dataset: xr.Dataset) -> dict[str, Cell | str | float]:
    steps = wear_steps(dataset)
    rows: dict[str, Any] = {"Wear steps": steps}
    if held := step_limits(dataset):
        rows["Wear steps held by"] = ", ".join(f"{limit} {count}" for limit, count in held.items())
    if steps:
        rows["Largest stability number S"] = dataset["stability_number"].values[1:].max()
        rows["Largest depth in one step [µm]"] = 1e6 * np.diff(dataset["wear_depth"].values, axis=0).max()
        error = shown("step_error", dataset["step_error"].values[1:])
        if np.isfinite(error).any():
            rows["Largest estimated error of one step [µm]"] = cell(np.nanmax(error), 2)
        rows["Steps repeated because of their error"] = int(dataset["rejected_steps"].values.sum())
        length = np.delete(dataset["step_length"].values, [0, *reprofiled_rows(dataset)])
        rows["Shortest and longest step [km]"] = span(shown("distance", length))
    for wheel, side in enumerate(WHEELS):
        law = float(dataset["worn_area"].values[-1, wheel])
        y, z = (dataset[f"profile_{c}"].values[:, wheel] for c in "yz")
        polygon = sum(polygon_area_between(y[a], z[a], y[b], z[b]) for a, b in spans(dataset))
        text = f"Worn area by the law against the profiles, {side} wheel [relative difference]"
        rows[text] = cell(abs(polygon - law) / law, 2) if law > 0.0 else "no wear"
    scaling = load_scaling(dataset)
    text = f"Distance run with normal forces scaled to the wheel load by more than {LOAD_TOLERANCE:.0%} [%]"
    rows[text] = cell(100.0 * scaling.distance_share, 2) if scaling else "none"
    if "faint_load" in dataset:
        for name in ("load", "power", "wear"):
            shares = [100.0 * float(dataset[f"faint_{name}{of}"].values.max()) for of in ("", "_max")]
            text = f"Largest share of the {name} that faint patches lost, in all and of a wheel [%]"
            rows[text] = ", ".join(f"{share:.2g}" for share in shares) if max(shares) > 0.0 else "none"
    tread = tread_wear(dataset)
    if tread is not None:
        rows["Largest wear depth on the tread per 100 000 km [mm]"] = cell(1e3 * tread, 3)
    balance = dataset["power_balance"].values
    balance = balance[np.isfinite(balance)]
    if balance.size:
        rows["Local over resultant frictional power before scaling"] = span(balance, 3)
    return rows


def chosen(dataset: xr.Dataset) -> list[Table]:
    """Contact models of each class of operating points and errors of the candidates, if they were chosen."""
    if "contact_candidate" not in dataset:
        return []
    steps = looked_at(dataset)
    places = [f"{plain(value)} km" for value in values_of(dataset, "distance", steps)]
    rows = []
    for step, place in zip(steps, places, strict=True):
        error = cell(100.0 * float(dataset["contact_models_error"].values[step]), 2)
        for one in classes(dataset, step):
            at = f"{place}, {one['class']}"
            rows.append(cells(at, one["points"], one["models"], one["rank"], cell(one["cost"], 3), error))
    tolerance = 100.0 * float(dataset.attrs["contact_tolerance"])
    models = Table(
        "choice",
        "contact models of the classes of operating points, by rising share of the work, wherever they were "
        "looked for; depth error: of the wear increment by all of them together, estimated from a sample; "
        f"tolerance {tolerance:.3g} %",
        ["From, class", "Points", "Contact models", "Rank", "Cost", "Depth error [%]"],
        rows,
    )
    errors = 100.0 * dataset["contact_candidate_error"].values[steps]
    names, costs = (dataset[f"contact_candidate{part}"].values for part in ("", "_cost"))
    evidence = Table(
        "candidates",
        "error of the wear increment if one combination solved all points, against half-space solutions of "
        "a sample, of fast ones by what they differ from each other at all points, too; cost in "
        "units of the cheapest one's time per solution",
        ["Contact models", "Rank", "Cost", *(f"Depth error at {place} [%]" for place in places)],
        [
            cells(names[k], k + 1, cell(costs[k], 3))
            + cells(*(error if np.isfinite(error) else None for error in errors[:, k]), digits=2)
            for k in np.flatnonzero(np.isfinite(errors).any(axis=0))
        ],
    )
    return [models, evidence]


def looked_at(dataset: xr.Dataset) -> list[int]:
    """Return the steps at which the contact models were looked for, the start first."""
    evidence = np.column_stack([
        dataset["contact_models_error"].values, dataset["contact_candidate_error"].fillna(-1.0).values,
    ])  # fmt: skip
    return [0, *(np.flatnonzero(np.any(np.diff(evidence, axis=0) != 0.0, axis=1)) + 1).tolist()]


def classes(dataset: xr.Dataset, step: int) -> list[dict[str, Any]]:
    """Classes with operating points at a step: number of points, models, their rank by cost, their cost."""
    count = np.bincount(
        dataset["contact_point_class"].values[step].astype(int), minlength=dataset.sizes["contact_class"]
    )
    place = dataset["contact_models"].values[step].astype(int)
    return [
        {
            "class": str(name),
            "points": int(size),
            "models": str(dataset["contact_candidate"].values[k]),
            "rank": int(k) + 1,
            "cost": float(dataset["contact_candidate_cost"].values[k]),
        }
        for name, size, k in zip(dataset["contact_class"].values, count, place, strict=True)
        if size
    ]


def read_convergence(directory: Path) -> list[Table]:
    """Read the tables of `wearsim run --converge` in a run directory, one per campaign, if there are any."""
    path = directory / TABLE
    if not path.is_file():
        return []
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
        return [_convergence(table, role) for role in table["given"]]
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise ResultError(
            f"{path} is no table of `wearsim run --converge` ({error}); remove it and run that again"
        ) from error


def markdown(tables: list[Table]) -> str:
    """Write the tables of `read_convergence` as Markdown."""
    parts = ["# Convergence", CAPTION]
    for table in tables:
        rows = [" | ".join(cell.text for cell in row) for row in table.rows]
        lines = [
            f"| {' | '.join(table.head)} |",
            "|" + " --- |" * len(table.head),
            *(f"| {row} |" for row in rows),
        ]
        parts += [f"## {capital(table.title.removeprefix(_TITLE))}", "\n".join(lines)]
    return "\n\n".join(parts) + "\n"


def _convergence(table: dict[str, Any], role: str) -> Table:
    given = table["given"][role]
    columns = [column for column in COLUMNS if column[0] in given["end"]]
    head = ("computed with", "wear steps", *(title for _, title, _ in columns), ANYWHERE)
    moved = (
        _largest([None if value is None else factor * value for value in given["moved"][name]])
        for name, _, factor in columns
    )
    rows = [cells("what wear changed, as given", given["steps"], *moved, "")]
    for row in table["rows"]:
        if "ends" not in row:
            reason = row.get("reason", row.get("told")) or "not run"
            rows.append(cells(row["text"], reason, *[""] * (len(columns) + 1)))
            continue
        end = row["ends"][role]
        differences = (_difference(given, end, name, factor) for name, _, factor in columns)
        rows.append(cells(row["text"], end["steps"], *differences, _anywhere(given, end)))
    short = ", shortened for this comparison" if table["shortened"] else ""
    title = f"{_TITLE}{role}: {given['distance'] / 1e3:.6g} km{short}"
    return Table(f"convergence-{role}", CAPTION, head, rows, "numbers", title=title)


def _difference(given: dict[str, Any], end: dict[str, Any], name: str, factor: float) -> Cell:
    """Largest difference of a measure, with the largest share of what wear changed."""
    sides = zip(given["end"][name], end["end"][name], given["moved"][name], strict=True)
    known = [(a, b, moved) for a, b, moved in sides if a is not None and b is not None]
    shares = [abs((b - a) / moved) for a, b, moved in known if moved]
    return _with_share(_largest([factor * (b - a) for a, b, _ in known]), shares)


def _anywhere(given: dict[str, Any], end: dict[str, Any]) -> Cell:
    """Largest difference of the depth at one place, with its share of the largest depth as given."""
    difference, deepest = end["profile_difference"], given["end"]["max_wear_depth"]
    shares = [a / b for a, b in zip(difference, deepest, strict=True) if b]
    return _with_share(cell(1e6 * max(difference), 3), shares)


def _with_share(difference: Cell, shares: list[float]) -> Cell:
    if difference.value is None or not shares:
        return difference
    return Cell(f"{difference.text} ({percent(max(shares))})", difference.value)


def _largest(values: list[float | None]) -> Cell:
    known = [value for value in values if value is not None]
    return cell(max(known, key=abs) if known else UNDEFINED, 3)
