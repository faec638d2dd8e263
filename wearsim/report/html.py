"""The report: one HTML file that needs nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import xarray as xr

from wearsim.campaign.directory import read_status
from wearsim.errors import ResultError
from wearsim.report.sections import LAYERS, Campaigns
from wearsim.report.style import role_of, to_svg
from wearsim.report.tables import exact
from wearsim.report.texts import environment
from wearsim.results import load_results
from wearsim.translation.bands import known_bands
from wearsim.translation.translate import content_hash, translate, with_known_causes
from wearsim.whole_files import write_whole


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
    states = read_status(directory).get("campaigns") or {}
    datasets = []
    for path in (directory / "rig.nc", directory / "field.nc"):
        if path.exists():
            datasets.append(load_results(path))
    if not datasets:
        raise ResultError(f"{directory}: there is no rig.nc or field.nc; {_advice(directory, states)}")
    factors = None
    if len(datasets) == 2:
        factors = with_known_causes(translate(datasets[0], datasets[1]), directory / "translation.nc")
    hashes = {role_of(data): content_hash(data) for data in datasets}
    known = known_bands(directory, hashes)
    text = render(datasets, states, factors, known)
    path = directory / "report.html"
    write_whole(path, text, "make room, or make the directory writable")
    return path


def _advice(directory: Path, states: Mapping[str, Mapping[str, Any]]) -> str:
    """Say what to do with a directory without results."""
    if (directory / "sweep.json").is_file():
        cases = (path.parent for path in directory.glob("case_*/*.nc"))
        example = min(cases, default=directory / "case_0001")
        table = directory / "sweep.csv"
        whose = f", whose table is {table}" if table.is_file() else ""
        return (
            f"it is the directory of a sweep{whose}; report on one of its cases: `wearsim report {example}`"
        )
    if failures := [str(one.get("message")) for one in states.values() if one.get("state") == "failed"]:
        return f"the campaign failed: {'; '.join(failures)}"
    return f"`wearsim run SCENE --out {directory}` makes them"


def render(
    datasets: list[xr.Dataset],
    states: Mapping[str, Mapping[str, Any]] | None = None,
    factors: xr.Dataset | None = None,
    bands: tuple[xr.Dataset | None, pd.DataFrame] | None = None,
) -> str:
    """Make the HTML page of a report.

    Parameters
    ----------
    datasets : list of Dataset
        One result, or rig and field in this order.
    states : mapping of str to mapping, optional
        Status of the campaigns by role, as in `status.json`.
    factors : Dataset, optional
        Of two results, by default as `translate` makes them, without causes.
    bands : tuple, optional
        Bands and ranking of steels, from `known_bands`.
    """
    if factors is None and len(datasets) == 2:
        factors = translate(datasets[0], datasets[1])
    campaigns = Campaigns(datasets, factors, *(bands or (None, pd.DataFrame())), states or {})
    page = environment()
    page.filters |= {
        "svg": lambda plate: to_svg(plate.figure, plate.name),
        "exact": exact,
    }
    layers = {
        layer: [(one.key, one.title, blocks) for one in sections if (blocks := list(one.content(campaigns)))]
        for layer, sections in LAYERS.items()
    }
    return page.get_template("report.html.j2").render(
        title=" against ".join(str(data.attrs.get("title", role_of(data))) for data in datasets),
        datasets=datasets,
        layers=layers,
    )
