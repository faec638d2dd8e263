"""The table of a campaign's convergence, for the report and as Markdown."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from wearsim.errors import ResultError
from wearsim.report.tables import Cell, number
from wearsim.results.plausibility import percent

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

CAPTION = (
    "Each row is the same campaign computed otherwise: by how much its end differs from the campaign as "
    "given, the larger difference of both sides, and that as a share of what wear changed (in the last "
    "column of the largest wear depth)."
)


@dataclass(frozen=True)
class Convergence:
    """Convergence of one campaign.

    Parameters
    ----------
    role : str
        rig or field.
    caption : str
        What was compared.
    head : tuple of str
        Titles of the columns.
    rows : list of lists of Cell
        First what wear changed, then one row per refinement.
    """

    role: str
    caption: str
    head: tuple[str, ...]
    rows: list[list[Cell]]


def read_convergence(directory: Path) -> list[Convergence]:
    """Read the tables a run directory holds.

    Parameters
    ----------
    directory : Path
        Run directory.

    Returns
    -------
    list of Convergence
        One per campaign; empty where `wearsim run --converge` was not run.
    """
    path = directory / TABLE
    if not path.is_file():
        return []
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
        return [_of_role(table, role) for role in table["given"]]
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise ResultError(
            f"{path} is no table of `wearsim run --converge` ({error}); remove it and run that again"
        ) from error


def markdown(tables: list[Convergence]) -> str:
    """Write the tables as Markdown.

    Parameters
    ----------
    tables : list of Convergence
        From `read_convergence`.
    """
    parts = ["# Convergence", CAPTION]
    for table in tables:
        lines = ["| " + " | ".join(table.head) + " |", "|" + " --- |" * len(table.head)]
        lines += ["| " + " | ".join(cell.text for cell in row) + " |" for row in table.rows]
        parts += [f"## {table.role.capitalize()}: {table.caption}", "\n".join(lines)]
    return "\n\n".join(parts) + "\n"


def _of_role(table: dict[str, Any], role: str) -> Convergence:
    given = table["given"][role]
    columns = [column for column in COLUMNS if column[0] in given["end"]]
    head = ("computed with", "wear steps", *(title for _, title, _ in columns), ANYWHERE)
    moved = [
        _largest([None if value is None else factor * value for value in given["moved"][name]])
        for name, _, factor in columns
    ]
    rows = [
        [
            Cell("what wear changed, as given"),
            Cell(str(given["steps"]), float(given["steps"])),
            *map(_plain, moved),
            Cell(""),
        ]
    ]
    for row in table["rows"]:
        if "ends" not in row:
            rows.append(
                [
                    Cell(row["text"]),
                    Cell(row.get("reason", row.get("told")) or "not run"),
                    *[Cell("") for _ in (*columns, ANYWHERE)],
                ]
            )
            continue
        found = row["ends"][role]
        cells = [_difference(given, found, name, factor) for name, _, factor in columns]
        steps = Cell(str(found["steps"]), float(found["steps"]))
        rows.append([Cell(row["text"]), steps, *cells, _anywhere(given, found)])
    short = ", shortened for this comparison" if table["shortened"] else ""
    return Convergence(role, f"{given['distance'] / 1e3:.6g} km{short}", head, rows)


def _difference(given: dict[str, Any], found: dict[str, Any], name: str, factor: float) -> Cell:
    differences: list[float | None] = []
    shares: list[float] = []
    for a, b, moved in zip(given["end"][name], found["end"][name], given["moved"][name], strict=True):
        differences.append(None if a is None or b is None else factor * (b - a))
        if a is not None and b is not None and moved:
            shares.append(abs((b - a) / moved))
    cell = _plain(_largest(differences))
    if cell.value is None or not shares:
        return cell
    return Cell(f"{cell.text} ({percent(max(shares))})", cell.value)


def _anywhere(given: dict[str, Any], found: dict[str, Any]) -> Cell:
    """Largest difference of the depth at one place, with its share of the largest depth as given."""
    difference, deepest = found["profile_difference"], given["end"]["max_wear_depth"]
    cell = number(1e6 * max(difference), 3)
    shares = [a / b for a, b in zip(difference, deepest, strict=True) if b]
    return Cell(f"{cell.text} ({percent(max(shares))})", cell.value) if shares else cell


def _largest(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return max(known, key=abs) if known else None


def _plain(value: float | None) -> Cell:
    return Cell("undefined") if value is None else number(value, 3)
