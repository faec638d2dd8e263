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
from wearsim.report.style import capital, shown
from wearsim.report.tables import NONE, UNDEFINED, Cell, Table, count, number, role_title, span
from wearsim.results.checks import (
    LOAD_TOLERANCE,
    load_scaling,
    percent,
    reprofiled_rows,
    spans,
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
    rows = [[Cell(text), *(column.get(text, NONE) for column in columns)] for text in names]
    return Table("quality", "", ["Check", *map(role_title, datasets)], rows, "numbers")


def _checks(dataset: xr.Dataset) -> dict[str, Cell]:
    steps = wear_steps(dataset)
    rows = {"Wear steps": count(steps)}
    if steps:
        depth = dataset["wear_depth"].values
        rows["Largest stability number S"] = number(dataset["stability_number"].values[1:].max())
        rows["Largest depth in one step [µm]"] = number(1e6 * np.diff(depth, axis=0).max())
        error = shown("step_error", dataset["step_error"].values[1:])
        if np.isfinite(error).any():
            rows["Largest estimated error of one step [µm]"] = number(np.nanmax(error), 2)
        rows["Steps repeated because of their error"] = count(dataset["rejected_steps"].values.sum())
        length = np.delete(dataset["step_length"].values, [0, *reprofiled_rows(dataset)])
        rows["Shortest and longest step [km]"] = span(shown("distance", length))
    for wheel, side in enumerate(WHEELS):
        law = float(dataset["worn_area"].values[-1, wheel])
        y, z = (dataset[f"profile_{c}"].values[:, wheel] for c in "yz")
        polygon = sum(polygon_area_between(y[a], z[a], y[b], z[b]) for a, b in spans(dataset))
        text = f"Worn area by the law against the profiles, {side} wheel [relative difference]"
        rows[text] = number(abs(polygon - law) / law, 2) if law > 0.0 else Cell("no wear")
    scaling = load_scaling(dataset)
    text = f"Distance run with normal forces scaled to the wheel load by more than {LOAD_TOLERANCE:.0%} [%]"
    rows[text] = number(100.0 * scaling.distance_share, 2) if scaling else Cell("none")
    tread = tread_wear(dataset)
    if tread is not None:
        rows["Largest wear depth on the tread per 100 000 km [mm]"] = number(1e3 * tread, 3)
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
    places = [f"{number(value, 4).text} km" for value in shown("distance", dataset["distance"].values[steps])]
    rows = []
    for step, place in zip(steps, places, strict=True):
        error = number(100.0 * float(dataset["contact_models_error"].values[step]), 2)
        for one in classes(dataset, step):
            rows.append([
                Cell(f"{place}, {one['class']}"), count(one["points"]), Cell(one["models"]),
                count(one["rank"]), number(one["cost"], 3), error,
            ])  # fmt: skip
    tolerance = 100.0 * float(dataset.attrs["contact_tolerance"])
    models = Table(
        "choice",
        "contact models of the classes of operating points, by rising share of the work, wherever they were "
        "looked for; depth error: of the wear increment by all of them together, estimated from a sample; "
        f"tolerance {tolerance:.3g} %",
        ["From, class", "Points", "Contact models", "Rank", "Cost", "Depth error [%]"],
        rows,
    )
    errors = dataset["contact_candidate_error"].values[steps]
    tried = np.flatnonzero(np.isfinite(errors).any(axis=0))
    evidence = Table(
        "candidates",
        "error of the wear increment if one combination solved all points, against half-space solutions of "
        "a sample, of fast ones by what they differ from each other at all points, too; cost in "
        "units of the cheapest one's time per solution",
        ["Contact models", "Rank", "Cost", *(f"Depth error at {place} [%]" for place in places)],
        [
            [
                Cell(str(dataset["contact_candidate"].values[k])),
                count(k + 1),
                number(float(dataset["contact_candidate_cost"].values[k]), 3),
                *(number(100.0 * error, 2) if np.isfinite(error) else NONE for error in errors[:, k]),
            ]
            for k in tried
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
    moved = [
        _largest([None if value is None else factor * value for value in given["moved"][name]])
        for name, _, factor in columns
    ]
    rows = [[Cell("what wear changed, as given"), count(given["steps"]), *map(_plain, moved), Cell("")]]
    for row in table["rows"]:
        if "ends" not in row:
            empty = [Cell("")] * (len(columns) + 1)
            rows.append([Cell(row["text"]), Cell(row.get("reason", row.get("told")) or "not run"), *empty])
            continue
        end = row["ends"][role]
        cells = [_difference(given, end, name, factor) for name, _, factor in columns]
        rows.append([Cell(row["text"]), count(end["steps"]), *cells, _anywhere(given, end)])
    short = ", shortened for this comparison" if table["shortened"] else ""
    title = f"{_TITLE}{role}: {given['distance'] / 1e3:.6g} km{short}"
    return Table(f"convergence-{role}", CAPTION, head, rows, "numbers", title=title)


def _difference(given: dict[str, Any], end: dict[str, Any], name: str, factor: float) -> Cell:
    differences: list[float | None] = []
    shares: list[float] = []
    for a, b, moved in zip(given["end"][name], end["end"][name], given["moved"][name], strict=True):
        differences.append(None if a is None or b is None else factor * (b - a))
        if a is not None and b is not None and moved:
            shares.append(abs((b - a) / moved))
    cell = _plain(_largest(differences))
    if cell.value is None or not shares:
        return cell
    return Cell(f"{cell.text} ({percent(max(shares))})", cell.value)


def _anywhere(given: dict[str, Any], end: dict[str, Any]) -> Cell:
    """Largest difference of the depth at one place, with its share of the largest depth as given."""
    difference, deepest = end["profile_difference"], given["end"]["max_wear_depth"]
    cell = number(1e6 * max(difference), 3)
    shares = [a / b for a, b in zip(difference, deepest, strict=True) if b]
    return Cell(f"{cell.text} ({percent(max(shares))})", cell.value) if shares else cell


def _largest(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return max(known, key=abs) if known else None


def _plain(value: float | None) -> Cell:
    return Cell(UNDEFINED) if value is None else number(value, 3)
