"""The report: one HTML file that needs nothing else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import jinja2
import xarray as xr

from wearsim.campaign.directory import read_status
from wearsim.errors import ResultError
from wearsim.report.plates import Plate
from wearsim.report.sections import SECTIONS, Block, Campaigns, summary_line
from wearsim.report.style import capital, role_of, role_title, to_svg, write_text
from wearsim.report.tables import Table
from wearsim.report.tables_quality import read_convergence
from wearsim.results import open_results
from wearsim.translation.translate import translate


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
    failures = {
        name: str(item.get("message") or "no reason is stored")
        for name, item in (read_status(directory).get("campaigns") or {}).items()
        if item.get("state") == "failed"
    }
    datasets = []
    for path in (directory / "rig.nc", directory / "field.nc"):
        if path.exists():
            with open_results(path) as data:
                datasets.append(data.load())
    if not datasets:
        raise ResultError(f"{directory}: there is no rig.nc or field.nc; {_advice(directory, failures)}")
    text = render(datasets, read_convergence(directory), failures)
    return write_text(text, directory / "report.html")


def _advice(directory: Path, failures: Mapping[str, str]) -> str:
    """Say what to do with a directory without results."""
    if (directory / "sweep.json").is_file():
        cases = (path.parent for path in directory.glob("case_*/*.nc"))
        example = min(cases, default=directory / "case_0001")
        table = directory / "sweep.csv"
        whose = f", whose table is {table}" if table.is_file() else ""
        return (
            f"it is the directory of a sweep{whose}; report on one of its cases: `wearsim report {example}`"
        )
    if failures:
        return f"the campaign failed: {'; '.join(failures.values())}"
    return f"`wearsim run SCENE --out {directory}` makes them"


def render(
    datasets: list[xr.Dataset], convergence: Sequence[Table] = (), failures: Mapping[str, str] | None = None
) -> str:
    """Make the HTML page of a report.

    Parameters
    ----------
    datasets : list of Dataset
        One result, or rig and field in this order.
    convergence : sequence of Table
        Results of `wearsim run --converge`.
    failures : mapping of str to str, optional
        Why campaigns failed, by role.
    """
    factors = translate(datasets[0], datasets[1]) if len(datasets) == 2 else None
    lines = [f"{capital(role)}: the campaign failed: {text}" for role, text in (failures or {}).items()]
    template = environment().get_template("report.html.j2")
    return template.render(
        title=" against ".join(str(data.attrs.get("title", role_of(data))) for data in datasets),
        campaigns=[(role_of(data), role_title(data), summary_line(data)) for data in datasets],
        failures=lines,
        sections=_contents(Campaigns(datasets, factors, convergence)),
    )


def _contents(campaigns: Campaigns) -> list[dict[str, Any]]:
    """Key, title and blocks of the sections that have any; figures are drawn here."""
    sections = []
    for section in SECTIONS:
        blocks = [
            Block("figure", {"name": b.name, "caption": b.caption, "svg": to_svg(b.figure, b.name)})
            if isinstance(b, Plate)
            else b
            for b in section.content(campaigns)
        ]
        if blocks:
            sections.append({"key": section.key, "title": section.title, "blocks": blocks})
    return sections


def environment(autoescape: bool = True) -> jinja2.Environment:
    """Templates of the reports, for HTML or (without escapes) for text."""
    return jinja2.Environment(
        loader=jinja2.PackageLoader("wearsim.report"),
        autoescape=autoescape,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
