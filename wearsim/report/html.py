"""The report: one HTML file that needs nothing else, and what fills each of its sections.

Order and headings of sections are in [sections] of `templates/texts.toml`. To add one: its figure or table in
a file of its own subject, and an entry in `CONTENT`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd
import xarray as xr
from matplotlib.figure import Figure

from wearsim.campaign.directory import read_status
from wearsim.errors import ResultError
from wearsim.report import answer, plates, sources, tables, tables_damage, tables_translation
from wearsim.report.plates import Plate
from wearsim.report.style import role_of, role_title, to_svg
from wearsim.report.tables import Table, exact
from wearsim.report.texts import environment, lines, words
from wearsim.results import load_results
from wearsim.translation.bands import known_bands
from wearsim.translation.translate import content_hash, table, translate, with_known_causes
from wearsim.whole_files import write_whole


@dataclass(frozen=True)
class Block:
    """A part of a section: the macro of the template that writes it, and what it writes."""

    macro: str
    content: Any = None


@dataclass(frozen=True)
class Campaigns:
    """What a report is about: results, factors, bands, ranking of steels, status of each run."""

    datasets: list[xr.Dataset]
    factors: xr.Dataset | None = None
    bands: xr.Dataset | None = None
    materials: pd.DataFrame = field(default_factory=pd.DataFrame)
    states: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def each(self, make: Callable[[xr.Dataset], Iterable[Table]]) -> Iterator[Table]:
        """Tables of each campaign, with its role in name and caption."""
        for data in self.datasets:
            yield from (one.of(role_of(data), role_title(data)) for one in make(data))


Content = Iterable[Table | Block | Plate]


def figures(
    campaigns: Campaigns, *draw: Callable[..., Figure | None], of: xr.Dataset | None = None
) -> Iterator[Plate]:
    """Draw figures one after the other, those of factors or bands from that dataset, too."""
    yield from filter(None, (plates.plate(one, campaigns.datasets, of) for one in draw))


def _list(lines: list[str]) -> Content:
    return [Block("list", lines)] if lines else []


def _answer(c: Campaigns) -> Content:
    yield Block("alerts", lines("alerts", datasets=c.datasets, states=c.states))
    said: dict[str, Any] = {"datasets": c.datasets, "factors": c.factors}
    yield Block("lead", lines("question", **said))
    yield Block("say", answer.sentences(c.datasets, c.factors, c.bands))
    yield plates.worn_profiles(c.datasets)
    yield from answer.limits(c.datasets)
    yield Block("list", answer.assumptions(c.datasets, len(lines("warnings", **said))))


def _verdict(c: Campaigns) -> Content:
    if c.factors is None:
        yield tables.state(c.datasets)
    else:
        yield tables_translation.verdict(table(c.factors), c.factors, c.datasets)


def _settings(c: Campaigns) -> Content:
    yield tables.settings(c.datasets)
    yield from map(tables.operating_points, c.datasets)


def _running(c: Campaigns) -> Content:
    yield from c.each(tables.wear_by_class)
    yield from figures(c, plates.positions, plates.binning)
    yield from c.each(tables.running)
    yield Block("say", lines("about_running"))


def _wear(c: Campaigns) -> Content:
    yield from figures(c, plates.wear_depth, of=c.bands)
    yield from figures(
        c, plates.wear_over_distance, plates.wear_by_regime, plates.counterface_wear,
        plates.counterface_over_distance, plates.wear_laws,
    )  # fmt: skip
    yield from c.each(lambda data: [*tables_damage.wear_laws(data), *tables.counterface(data)])
    yield from _factors_of(c, "comparison")
    if c.factors is not None:
        about = tables_translation.regime_bands(c.factors, c.datasets[0])
        yield Block("list", [*lines("about_regimes"), *about])


def _factors_of(c: Campaigns, group: str) -> Content:
    if c.factors is not None:
        yield from tables_translation.damage_factors(c.factors, group)


def _measures(c: Campaigns) -> Content:
    yield from tables.limits(c.datasets)
    yield from tables.reprofiled_wheels(c.datasets)
    yield from figures(c, plates.measures)


def _fatigue(c: Campaigns) -> Content:
    if tired := [data for data in c.datasets if "fatigue_name" in data]:
        yield from c.each(tables_damage.fatigue_tables)
        yield from _factors_of(c, "fatigue")
        yield from figures(Campaigns(tired), plates.shakedown, plates.fatigue_damage, plates.balance)


def _factors(c: Campaigns) -> Content:
    if c.factors is None:
        return
    yield Block("say", lines("about_factors"))
    yield from tables_translation.causes(c.factors)
    yield from figures(
        c, plates.causes, plates.factors_wear, plates.equivalent_distance,
        plates.factors_at_points, of=c.factors,
    )  # fmt: skip
    yield from tables_translation.zones(c.factors)
    yield from tables_translation.power_causes(c.factors)


def _again(c: Campaigns) -> Content:
    yield Block("commands", sources.commands(c.datasets))
    yield sources.provenance(c.datasets)
    yield from (Block("scene", data) for data in c.datasets)


def _bands(c: Campaigns) -> Content:
    if c.bands is not None:
        yield tables_translation.bands_table(c.bands)
        yield from tables_translation.materials(c.materials)
        yield from figures(c, plates.bands, plates.sensitivity, of=c.bands)


def _quality(c: Campaigns) -> Content:
    yield tables.quality(c.datasets)
    yield from figures(c, plates.steps)


CONTENT: Mapping[str, Callable[[Campaigns], Content]] = {
    "answer": _answer,
    "warnings": lambda c: _list(lines("warnings", datasets=c.datasets, factors=c.factors)),
    "verdict": _verdict,
    "profiles": lambda c: figures(c, plates.profiles, of=c.factors),
    "wear": _wear,
    "measures": _measures,
    "running": _running,
    "contact": lambda c: figures(c, plates.contact, plates.wear_index),
    "fatigue": _fatigue,
    "factors": _factors,
    "bands": _bands,
    "quality": _quality,
    "settings": _settings,
    "coefficients": lambda c: [sources.laws(c.datasets), sources.coefficients(c.datasets)],
    "bibliography": lambda c: _list(sources.bibliography(c.datasets)),
    "again": _again,
}
"""What stands in each section, if anything."""

LAYERS = {
    layer: tuple((key, title, CONTENT[key]) for key, title in titles.items())
    for layer, titles in words("sections").items()
}
"""Sections by layer (page one, what engineers ask for, where it comes from): id, heading, content if any."""

SECTIONS = tuple(section for layer in LAYERS.values() for section in layer)


def all_figures(campaigns: Campaigns) -> list[Plate]:
    """Figures of all sections, in the order of the report."""
    blocks = (block for *_, content in SECTIONS for block in content(campaigns))
    return [block for block in blocks if isinstance(block, Plate)]


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
