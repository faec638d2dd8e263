"""The sections of a report, in order: each is one entry of `SECTIONS` and the function that fills it.

To add a section: its figure or table in a file of its own subject, and an entry here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import xarray as xr

from wearsim.report import plates, tables, tables_damage, tables_quality, tables_translation
from wearsim.report.plates import Plate
from wearsim.report.style import capital, plain, role_of, role_title, shown, values_of
from wearsim.report.tables import Table
from wearsim.results import result_warnings
from wearsim.results.checks import closing_reprofiling, last_worn_row, wear_steps
from wearsim.results.schema import CHANGES
from wearsim.translation.translate import content_hash, table

_PROVENANCE = {
    "title": "Title",
    "history": "Command",
    "source": "Versions",
    "input_hashes": "Input files",
    "wear_coefficients": "Wear coefficients",
    "wear_coefficients_source": "Source of the coefficients",
    "wear_coefficients_materials": "Materials of the coefficients",
    "wear_coefficients_validity": "Validity of the coefficients",
    "wear_coefficients_departures": "Departures from the source",
    "wear_coefficients_warnings": "Uncertain coefficients",
    CHANGES: "Changed settings",
    "finished": "Finished",
}


@dataclass(frozen=True)
class Block:
    """A part of a section: the macro of the template that writes it, and what it writes."""

    macro: str
    content: Any = None


@dataclass(frozen=True)
class Campaigns:
    """What a report is about: one result or rig and field, their factors, tables of `read_convergence`."""

    datasets: list[xr.Dataset]
    factors: xr.Dataset | None = None
    convergence: Sequence[Table] = ()

    def each(self, make: Callable[[xr.Dataset], Iterable[Table]]) -> Iterator[Table]:
        """Tables of each campaign, with its role in name and caption."""
        for data in self.datasets:
            yield from (one.of(role_of(data), role_title(data)) for one in make(data))


Content = Iterator[Table | Block | Plate | tables_translation.Verdict]


@dataclass(frozen=True)
class Section:
    """A section of a report: its id, its heading, and what it consists of; absent if that is nothing."""

    key: str
    title: str
    content: Callable[[Campaigns], Content]


def figures(
    campaigns: Campaigns, *draw: Callable[..., Plate | None], factors: bool = False
) -> Iterator[Plate]:
    """Draw figures one after the other, those of factors from the translation, too."""
    given = (campaigns.datasets, campaigns.factors) if factors else (campaigns.datasets,)
    yield from filter(None, (one(*given) for one in draw))


def summary_line(dataset: xr.Dataset) -> str:
    """Distance, wear steps and depth of a campaign."""
    run = values_of(dataset, "distance", -1)
    depth = shown("max_wear_depth", dataset["max_wear_depth"].values[last_worn_row(dataset)].max())
    return f"{plain(run)} km in {wear_steps(dataset)} wear steps, {plain(depth, 3)} mm deep"


def warnings(datasets: list[xr.Dataset], translation: xr.Dataset | None) -> list[str]:
    """All a reader must know before trusting the numbers, one line each."""
    lines = []
    for data in datasets:
        role = role_title(data)
        text = str(data.attrs.get("warnings", "")).replace("\n", "; ")
        lines += [f"{role}: {line.strip()}" for line in text.split("; ") if line.strip()]
        lines += [f"{role}: {line}." for line in result_warnings(data)]
        if closing := closing_reprofiling(data):
            lines.append(f"{role}: {closing}")
        if "finished" not in data.attrs:
            run = values_of(data, "distance", -1)
            lines.append(f"{role}: the campaign is unfinished, these are the first {plain(run)} km.")
    if translation is None:
        return lines
    lines += [f"{capital(line)}." for line in str(translation.attrs.get("warnings", "")).splitlines()]
    environment = [plates.environment_text(data) for data in datasets]
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


def _verdict(c: Campaigns) -> Content:
    environment = plates.environment_note(c.datasets)
    if c.factors is None:
        data = c.datasets[0]
        yield Block("lead", f"{role_title(data)}: {summary_line(data)}.")
        yield Block("warnings", warnings(c.datasets, None))
        yield tables.state(data, f"The wheels at the end of the campaign. {environment}")
        return
    rows = table(c.factors)
    for line in tables_translation.verdict_sentences(rows, c.factors):
        yield Block("lead", line)
    yield Block("warnings", warnings(c.datasets, c.factors))
    yield tables_translation.verdict(rows, c.factors, environment)
    yield Block("note", tables_translation.patch_rules())


def _settings(c: Campaigns) -> Content:
    yield tables.settings(c.datasets)
    yield from map(tables.operating_points, c.datasets)


def _running(c: Campaigns) -> Content:
    yield from figures(c, plates.positions)
    yield from c.each(tables.running)


def _wear(c: Campaigns) -> Content:
    yield from figures(
        c, plates.wear_depth, plates.wear_over_distance, plates.wear_by_regime, plates.counterface_wear,
        plates.counterface_over_distance, plates.wear_laws,
    )  # fmt: skip
    yield from c.each(lambda data: [*tables_damage.wear_laws(data), *tables.counterface(data)])
    yield from _factors_of(c, "comparison")


def _factors_of(c: Campaigns, group: str) -> Content:
    if c.factors is not None:
        yield from tables_translation.damage_factors(c.factors, group)


def _measures(c: Campaigns) -> Content:
    yield from tables.limits(c.datasets)
    yield from tables.reprofiled_wheels(c.datasets)
    yield from figures(c, plates.measures, plates.conicity)


def _fatigue(c: Campaigns) -> Content:
    campaigns = Campaigns([data for data in c.datasets if "fatigue_name" in data])
    if not campaigns.datasets:
        return
    yield from c.each(tables_damage.fatigue_tables)
    yield from _factors_of(c, "fatigue")
    draw = (plates.shakedown, plates.fatigue_damage, plates.fatigue_cycles, plates.balance)
    yield from figures(campaigns, *draw)


def _factors(c: Campaigns) -> Content:
    if c.factors is None:
        return
    yield Block("about_factors")
    yield from figures(
        c, plates.factors_wear, plates.factors_contact, plates.equivalent_distance,
        plates.factor_along_profile, plates.factors_at_points, factors=True,
    )  # fmt: skip
    yield from tables_translation.factors_at_points(c.factors)


def _regimes(c: Campaigns) -> Content:
    if c.factors is None:
        return
    yield Block("about_regimes")
    yield Block("list", tables_translation.regime_bands(c.factors, c.datasets[0]))
    by_point = tables_translation.regimes(c.factors)
    yield from by_point
    if not by_point:
        yield Block("no_equal_points")


def _quality(c: Campaigns) -> Content:
    yield tables_quality.quality(c.datasets)
    yield from c.each(tables_quality.chosen)
    yield from c.convergence
    yield from figures(c, plates.steps)


def _provenance(c: Campaigns) -> Content:
    for data in c.datasets:
        attrs = data.attrs
        rows = [(text, str(attrs[key])) for key, text in _PROVENANCE.items() if str(attrs.get(key, ""))]
        rows.append(("SHA-256 of the result values", content_hash(data)))
        scene = str(attrs.get("scene_text", ""))
        yield Block(
            "provenance", {"role": role_of(data), "heading": role_title(data), "rows": rows, "scene": scene}
        )


SECTIONS = (
    Section("verdict", "Verdict", _verdict),
    Section("settings", "Settings", _settings),
    Section("profiles", "Profiles", lambda c: figures(c, plates.profiles, factors=True)),
    Section("wear", "Wear", _wear),
    Section("measures", "Wheel measures", _measures),
    Section("running", "Where the wheelset runs", _running),
    Section("contact", "Contact", lambda c: figures(c, plates.contact)),
    Section("fatigue", "Rolling contact fatigue", _fatigue),
    Section("factors", "Factors from rig to field", _factors),
    Section("regimes", "Wear regimes", _regimes),
    Section("quality", "Numerical quality", _quality),
    Section("provenance", "Provenance", _provenance),
)
"""Sections of the report of rig against field, in order."""


def all_figures(campaigns: Campaigns) -> list[Plate]:
    """Figures of all sections, in the order of the report."""
    blocks = (block for section in SECTIONS for block in section.content(campaigns))
    return [block for block in blocks if isinstance(block, Plate)]
