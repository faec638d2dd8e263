"""The report: one HTML file that needs nothing else."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import jinja2
import xarray as xr

from wearsim.campaign.directory import read_status
from wearsim.errors import ResultError
from wearsim.report import (
    pages,
    pages_counterface,
    pages_damage,
    tables,
    tables_choice,
    tables_damage,
    tables_index,
)
from wearsim.report.convergence import CAPTION, Convergence, read_convergence
from wearsim.report.style import plain, role_of, shown, to_svg
from wearsim.results import doubts, open_results
from wearsim.results.turnings import closing_turning, cracks_left, last_worn_row, wear_steps
from wearsim.translation.translate import content_hash, table, translate

SECTIONS = (
    ("verdict", "Verdict"),
    ("settings", "Settings"),
    ("profiles", "Profiles"),
    ("wear", "Wear"),
    ("measures", "Wheel measures"),
    ("contact", "Contact"),
    ("fatigue", "Rolling contact fatigue"),
    ("factors", "Factors from rig to field"),
    ("regimes", "Wear regimes"),
    ("quality", "Numerical quality"),
    ("provenance", "Provenance"),
)
"""Sections of the report of rig against field, in order."""

_PROVENANCE = (
    ("title", "Title"),
    ("history", "Command"),
    ("source", "Versions"),
    ("input_hashes", "Input files"),
    ("wear_coefficients", "Wear coefficients"),
    ("wear_coefficients_source", "Source of the coefficients"),
    ("wear_coefficients_materials", "Materials of the coefficients"),
    ("wear_coefficients_validity", "Validity of the coefficients"),
    ("wear_coefficients_departures", "Departures from the source"),
    ("wear_coefficients_warnings", "Uncertain coefficients"),
    ("finished", "Finished"),
)


def write_report(directory: str | Path) -> Path:
    """Write `report.html` from the results in a run directory.

    Parameters
    ----------
    directory : path
        Holds rig.nc, field.nc or both; with both, the report compares them.

    Returns
    -------
    Path
        The report: one file without links to others; equal results give an equal file.

    Raises
    ------
    ResultError
        No result file in the directory, or one that cannot be read.
    """
    directory = Path(directory)
    found = [directory / f"{name}.nc" for name in ("rig", "field") if (directory / f"{name}.nc").exists()]
    failures = {
        name: str(item.get("message") or "no reason is stored")
        for name, item in (read_status(directory).get("campaigns") or {}).items()
        if item.get("state") == "failed"
    }
    if not found:
        raise ResultError(f"{directory}: there is no rig.nc or field.nc; {_advice(directory, failures)}")
    datasets = []
    for path in found:
        with open_results(path) as data:
            datasets.append(data.load())
    text = render(datasets, read_convergence(directory), failures)
    return _write(text, directory / "report.html")


def _advice(directory: Path, failures: Mapping[str, str]) -> str:
    """Say what to do with a directory without results."""
    if (directory / "sweep.json").is_file():
        cases = sorted(path.parent for path in directory.glob("case_*/*.nc"))
        example = cases[0] if cases else directory / "case_0001"
        return (
            f"it is the directory of a sweep, whose table is {directory / 'sweep.csv'}; report on one of its "
            f"cases: `wearsim report {example}`"
        )
    if failures:
        return f"the campaign failed: {'; '.join(failures.values())}"
    return f"`wearsim run SCENE --out {directory}` makes them"


def render(
    datasets: list[xr.Dataset],
    convergence: Sequence[Convergence] = (),
    failures: Mapping[str, str] | None = None,
) -> str:
    """Make the text of a report.

    Parameters
    ----------
    datasets : list of Dataset
        One result, or rig and field in this order.
    convergence : sequence of Convergence
        Results of `wearsim run --converge`.
    failures : mapping of str to str, optional
        Why campaigns failed, by role.

    Returns
    -------
    str
        The HTML page.
    """
    translation = translate(datasets[0], datasets[1]) if len(datasets) == 2 else None
    quality = [tables.quality(data) for data in datasets]
    absent = () if translation is not None else ("factors", "regimes")
    if not any("fatigue_name" in data for data in datasets):
        absent = (*absent, "fatigue")
    context: dict[str, Any] = {
        "title": " against ".join(str(data.attrs.get("title", role_of(data))) for data in datasets),
        "roles": [role_of(data) for data in datasets],
        "headings": [tables.role_title(data) for data in datasets],
        "sections": [s for s in SECTIONS if s[0] not in absent],
        "wear_tables": [
            *(tables_damage.wear_laws(data) + pages_counterface.table(data) for data in datasets),
            tables_damage.damage_factors(translation, "comparison"),
        ],
        "fatigue_tables": [
            *(tables_index.table(data) + tables_damage.fatigue_tables(data) for data in datasets),
            tables_damage.damage_factors(translation, "fatigue"),
        ],
        "choice_tables": [tables_choice.chosen(data) for data in datasets],
        "plates": _plates(datasets, translation),
        "summary": [_campaign_line(data) for data in datasets],
        "failures": [
            f"{role.capitalize()}: the campaign failed: {text}" for role, text in (failures or {}).items()
        ],
        "warnings": warnings(datasets, translation),
        "environment": pages.environment_note(datasets),
        "settings": tables.settings(datasets),
        "points": [tables.operating_points(data) for data in datasets],
        "quality": [dict(rows) for rows in quality],
        "quality_names": list(dict.fromkeys(text for rows in quality for text, _ in rows)),
        "limits": tables.limits(datasets),
        "turnings": [tables.turned_wheels(data) for data in datasets],
        "cracks_left": " ".join(filter(None, map(cracks_left, datasets))),
        "convergence": convergence,
        "convergence_caption": CAPTION,
        "provenance": [_provenance(data) for data in datasets],
        "scenes": [str(data.attrs.get("scene_text", "")) for data in datasets],
    }
    if translation is None:
        context["state"] = tables.state(datasets[0])
    else:
        rows = table(translation)
        context |= {
            "sentences": tables.verdict_sentences(rows, translation),
            "verdict": tables.grouped(tables.verdict(rows)),
            "ends": _ends(translation),
            "patch_rules": tables.patch_rules(),
            "point_factors": tables.factors_at_points(translation),
            "regime_rows": [tables.regimes(translation, 0), tables.regimes(translation, -1)],
            "regime_bands": tables.regime_bands(translation, datasets[0]),
        }
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("wearsim.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    name = "single.html.j2" if translation is None else "compare.html.j2"
    return environment.get_template(name).render(context)


def warnings(datasets: list[xr.Dataset], translation: xr.Dataset | None) -> list[str]:
    """All a reader must know before trusting the numbers, one line each."""
    lines = []
    for data in datasets:
        role = role_of(data).capitalize()
        text = str(data.attrs.get("warnings", "")).replace("\n", "; ")
        lines += [f"{role}: {line.strip()}" for line in text.split("; ") if line.strip()]
        lines += [f"{role}: {line}." for line in doubts(data)]
        if told := closing_turning(data):
            lines.append(f"{role}: {told}")
        if "finished" not in data.attrs:
            run = shown("distance", data["distance"].values[-1])
            lines.append(f"{role}: the campaign is unfinished, these are the first {plain(run)} km.")
    if translation is None:
        return lines
    lines += [
        f"{line[:1].upper()}{line[1:]}." for line in str(translation.attrs.get("warnings", "")).splitlines()
    ]
    environment = [pages.environment_text(data) for data in datasets]
    if environment[0] != environment[1]:
        lines.append(
            f"The environment factors differ: {environment[0]} on the rig, {environment[1]} in the field. "
            "Wear factors contain this assumption; contact factors do not."
        )
    if bool((translation["regime_profile_differs"].values[:, -1] == 1).any()):
        lines.append(
            "Rig and field wear in different regimes at some places: factors there depend on the wear law."
        )
    return lines


def _plates(datasets: list[xr.Dataset], translation: xr.Dataset | None) -> dict[str, list[dict[str, str]]]:
    """Figures by section as SVG text."""
    sections: dict[str, list[dict[str, str]]] = {name: [] for name, _ in SECTIONS}
    further = [*pages_counterface.plates(datasets), *pages_damage.plates(datasets)]
    for plate in [*pages.plates(datasets, translation), *further]:
        svg = to_svg(plate.figure, plate.name)
        sections[plate.section].append({"name": plate.name, "svg": svg, "caption": plate.caption})
    return sections


def _campaign_line(dataset: xr.Dataset) -> str:
    run = shown("distance", dataset["distance"].values[-1])
    depth = shown("max_wear_depth", dataset["max_wear_depth"].values[last_worn_row(dataset)].max())
    return f"{plain(run)} km in {wear_steps(dataset)} wear steps, {plain(depth, 3)} mm deep"


def _ends(translation: xr.Dataset) -> list[str]:
    run = float(shown("distance", translation["distance_run"].values[0, -1, 0]))
    depth = float(shown("max_wear_depth", translation["worn_depth"].values[1, -1, 0]))
    return [f"{plain(run)} km each", f"{plain(depth, 3)} mm each"]


def _provenance(dataset: xr.Dataset) -> list[tuple[str, str]]:
    rows = [(text, str(dataset.attrs[key])) for key, text in _PROVENANCE if str(dataset.attrs.get(key, ""))]
    return [*rows, ("SHA-256 of the result values", content_hash(dataset))]


def _write(text: str, path: Path) -> Path:
    part = path.with_name(f".{path.name}.part")
    try:
        part.write_text(text, encoding="utf-8")
        os.replace(part, path)
    except OSError as fault:
        raise ResultError(
            f"{path}: cannot be written ({fault.strerror}); make the directory writable"
        ) from fault
    return path
