"""The report: one HTML file that needs nothing else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
    paths = (directory / "rig.nc", directory / "field.nc")
    datasets = [load_results(path) for path in paths if path.exists()]
    if not datasets:
        failures = [str(one.get("message")) for one in states.values() if one.get("state") == "failed"]
        why = f"the campaign failed: {'; '.join(failures)}"
        advice = why if failures else f"`wearsim run SCENE --out {directory}` makes them"
        raise ResultError(f"{directory}: there is no rig.nc or field.nc; {advice}")
    factors = None
    if len(datasets) == 2:
        factors = with_known_causes(translate(datasets[0], datasets[1]), directory / "translation.nc")
    hashes = {role_of(data): content_hash(data) for data in datasets}
    known = known_bands(directory, hashes)
    text = render(datasets, states, factors, known)
    path = directory / "report.html"
    write_whole(path, text, "make room, or make the directory writable")
    return path


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
    layers = {
        layer: [(key, title, list(content(campaigns))) for key, title, content in sections]
        for layer, sections in LAYERS.items()
    }
    return page(" against ".join(str(data.attrs.get("title", role_of(data))) for data in datasets), layers)


def page(title: str, layers: Mapping[str, Sequence[tuple[str, str, Sequence[Any]]]]) -> str:
    """Write the sections of each layer: id, heading and blocks, left out where there are none."""
    templates = environment()
    templates.filters |= {"svg": lambda plate: to_svg(plate.figure, plate.name), "exact": exact}
    layers = {layer: [one for one in sections if one[2]] for layer, sections in layers.items()}
    return templates.get_template("report.html.j2").render(title=title, layers=layers)
