"""Reports of campaigns, sweeps and charts.

One HTML file that needs nothing else, and its sections.

Order and headings of sections are in [sections] of `templates/texts.toml`. To add one:
its figure or table in a file of its own subject, and an entry in `CONTENT`.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wearsim import __version__
from wearsim.campaign.directory import (
    has_uncertainty,
    names_of_pair,
    read_status,
)
from wearsim.errors import ResultError
from wearsim.quantities import QUANTITIES
from wearsim.report import (
    answer,
    learned,
    pair,
    plates,
    service_life,
    sources,
    tables,
    tables_damage,
    tables_translation,
    zones,
)
from wearsim.report.figures.campaign import series_colour
from wearsim.report.plates import Plate
from wearsim.report.rail_wear import rail_tables
from wearsim.report.style import (
    COLOURS,
    SERIES_COLOURS,
    WHEEL_LINES,
    as_pair,
    capital,
    label_axes,
    panels,
    role_of,
    role_title,
    shown,
    titles_of,
    to_svg,
    with_unit,
)
from wearsim.report.tables import GIVEN, Table, exact, given, table
from wearsim.report.texts import caption, environment, lines, words
from wearsim.results import load_results
from wearsim.scene.input_names import (
    input_heading,
    input_title,
    input_unit,
    input_value,
)
from wearsim.studies.learned import FILE as POSTERIOR_FILE
from wearsim.studies.learned import load_posterior
from wearsim.studies.pair import compared
from wearsim.studies.sweep import SWEEP_FILE, sweep_dataset, sweep_rows
from wearsim.translation.bands import known_bands
from wearsim.translation.side_by_side import not_reprofiled
from wearsim.translation.translate import content_hash, translate, with_known_causes
from wearsim.translation.translate import table as factor_table
from wearsim.whole_files import write_whole


@dataclass(frozen=True)
class Block:
    """A part of a section.

    The macro of the template that writes it, and what it writes.
    """

    macro: str
    content: Any = None


@dataclass(frozen=True)
class Campaigns:
    """Contents of a report.

    Results, factors, bands, ranking of steels, status of each run, date of the results,
    True if the scene states uncertain inputs.
    """

    datasets: list[xr.Dataset]
    factors: xr.Dataset | None = None
    bands: xr.Dataset | None = None
    materials: pd.DataFrame = field(default_factory=pd.DataFrame)
    states: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    date: str = ""
    uncertain: bool = False
    side_by_side: pd.DataFrame | None = None  # of two campaigns of one kind

    def campaign_tables(
        self, make: Callable[[xr.Dataset], Iterable[Table]]
    ) -> Iterator[Table]:
        """Tables of each campaign, with its role in name and caption."""
        for data in self.datasets:
            yield from (
                campaign_table.of(role_of(data), role_title(data))
                for campaign_table in make(data)
            )


Content = Iterable[Table | Block | Plate]


def figures(
    campaigns: Campaigns,
    *draw: Callable[..., Figure | None],
    of: xr.Dataset | None = None,
) -> Iterator[Plate]:
    """Draw figures one after the other, of factors or bands too."""
    yield from filter(
        None, (plates.plate(plot, campaigns.datasets, of) for plot in draw)
    )


def _list(lines: list[str]) -> Content:
    return [Block("list", lines)] if lines else []


def _head(datasets: Sequence[xr.Dataset], date: str, question: list[str]) -> Content:
    """Date and versions of results, and the question that they answer."""
    sources = " ".join(str(data.attrs.get("source", "")) for data in datasets)
    versions = set(re.findall(r"wearsim [\w.+]+", sources))
    yield Block("issued", lines("issued", date=date, versions=sorted(versions)))
    yield Block("lead", question)


def _answer(c: Campaigns) -> Content:
    context: dict[str, Any] = {
        "datasets": c.datasets,
        "factors": c.factors,
        "paired": c.side_by_side is not None,
    }
    yield Block("alerts", lines("alerts", states=c.states, **context))
    yield from _head(c.datasets, c.date, lines("question", **context))
    if c.side_by_side is None:
        yield Block("numbers", answer.numbers(c.datasets, c.factors, c.bands))
    else:
        yield Block("numbers", pair.numbers(c.datasets, c.side_by_side))
    yield from figures(c, plates.wheels, of=c.bands)
    if c.side_by_side is not None and pair.has_bands(c.side_by_side):
        yield pair.side_by_side(c.side_by_side)
        yield from _list(not_reprofiled(c.side_by_side))
    yield from _list(service_life.sentences(c.datasets, c.bands))
    drawn = c.bands is not None or pair.has_bands(c.side_by_side)
    yield from answer.limits(c.datasets, drawn=drawn)
    yield from figures(c, plates.main_causes, of=c.factors)
    warnings = len(lines("warnings", **context))
    yield Block("text", answer.assumptions(c.datasets, warnings))
    lacks = answer.absent(c.datasets, c.factors, drawn=drawn, uncertain=c.uncertain)
    yield Block("text", lacks)
    yield Block("signatures")


def _verdict(c: Campaigns) -> Content:
    if c.side_by_side is not None:
        if not pair.has_bands(c.side_by_side):  # distances are no answer without bands
            yield pair.side_by_side(c.side_by_side)
        yield from c.campaign_tables(lambda data: [tables.state([data])])
    elif c.factors is None:
        yield tables.state(c.datasets)
    else:
        yield tables_translation.verdict(factor_table(c.factors), c.factors, c.datasets)


def _profiles(c: Campaigns) -> Content:
    if c.factors is not None:
        yield from figures(c, plates.profiles, of=c.factors)


def _settings(c: Campaigns) -> Content:
    yield tables.settings(c.datasets)
    yield from c.campaign_tables(tables.running)


def _running(c: Campaigns) -> Content:
    yield from c.campaign_tables(zones.tables)
    yield from figures(c, plates.positions, plates.binning)
    yield Block("say", lines("about_running"))


def _wear(c: Campaigns) -> Content:
    yield from figures(c, plates.wear_depth, of=c.bands)
    yield from figures(
        c,
        plates.wear_over_distance,
        plates.wear_by_regime,
        plates.counterface_wear,
        plates.counterface_over_distance,
        plates.wear_laws,
    )
    yield from c.campaign_tables(
        lambda data: [*tables_damage.wear_laws(data), *tables.counterface(data)]
    )
    yield from _factors_of(c, "comparison")
    if c.factors is not None:
        about = tables_translation.regime_bands(c.factors, c.datasets[0])
        yield Block("list", [*lines("about_regimes"), *about])


def _factors_of(c: Campaigns, group: str) -> Content:
    if c.factors is not None:
        yield from tables_translation.damage_factors(c.factors, group)


def _measures(c: Campaigns) -> Content:
    yield from tables.limits(c.datasets)
    yield from service_life.life(c.datasets)
    yield from service_life.reprofilings(c.datasets)
    yield from figures(c, plates.measures)


def _fatigue(c: Campaigns) -> Content:
    if tired := [data for data in c.datasets if "fatigue_name" in data]:
        yield from c.campaign_tables(tables_damage.fatigue_tables)
        agree = [
            (*pair, role_of(data))
            for data in tired
            for pair in tables_damage.agreement(data)
        ]
        yield Block("text", lines("about_fatigue", agreement=agree))
        yield from _factors_of(c, "fatigue")
        yield from figures(
            Campaigns(tired), plates.shakedown, plates.fatigue_damage, plates.balance
        )


def _factors(c: Campaigns) -> Content:
    if c.factors is None:
        return
    yield Block("say", lines("about_factors"))
    yield from tables_translation.causes(c.factors)
    yield from figures(
        c,
        plates.factors_wear,
        plates.equivalent_distance,
        plates.factors_at_points,
        of=c.factors,
    )
    yield from tables_translation.zones(c.factors)


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
    "warnings": lambda c: _list(
        lines("warnings", datasets=c.datasets, factors=c.factors)
    ),
    "verdict": _verdict,
    "profiles": _profiles,
    "wear": _wear,
    "measures": _measures,
    "running": _running,
    "contact": lambda c: figures(c, plates.contact),
    "fatigue": _fatigue,
    "factors": _factors,
    "bands": _bands,
    "rails": lambda c: rail_tables(c.datasets),
    "quality": _quality,
    "settings": _settings,
    "coefficients": lambda c: [
        sources.laws(c.datasets),
        sources.coefficients(c.datasets),
    ],
    "bibliography": lambda c: _list(sources.bibliography(c.datasets)),
    "again": _again,
}
"""What stands in each section, if anything."""

LAYERS = {
    layer: tuple((key, title, CONTENT[key]) for key, title in titles.items())
    for layer, titles in words("sections").items()
}
"""Sections by layer (page one, what engineers ask for, where it comes from): id,
heading, content if any.
"""

SECTIONS = tuple(section for layer in LAYERS.values() for section in layer)


def all_figures(campaigns: Campaigns) -> list[Plate]:
    """Figures of all sections, in the order of the report."""
    blocks = (block for *_, content in SECTIONS for block in content(campaigns))
    return [block for block in blocks if isinstance(block, Plate)]


def write_report(
    directory: str | Path,
    loaded: Mapping[Path, xr.Dataset] | None = None,
    *,
    side_by_side: pd.DataFrame | None = None,
) -> Path:
    """Write `report.html` from the directory of a campaign, a comparison or a sweep.

    Parameters
    ----------
    directory : str or Path
        Holds rig.nc, field.nc or both, which the report compares; or the folders of two
        campaigns of one kind; or the cases of a sweep; or the posterior of a
        calibration.
    loaded : mapping of Path to Dataset, optional
        Those of these files that `load_results` has read already.
    side_by_side : DataFrame, optional
        Table of two campaigns of one kind, if it has been made already.

    Returns
    -------
    Path
        The report: one file without links to others; equal results give an equal file.

    Raises
    ------
    ResultError
        No result file in the directory, or one that cannot be read.

    Examples
    --------
    >>> import wearsim
    >>> wearsim.write_report("out").name
    'report.html'
    """
    directory = Path(directory)
    if (directory / SWEEP_FILE).is_file():
        date = _date([directory / SWEEP_FILE, *directory.glob("sweep.csv")])
        text = render_sweep(sweep_dataset(directory), date)
    elif (directory / POSTERIOR_FILE).is_file():
        date = _date([directory / POSTERIOR_FILE])
        text = render_calibration(load_posterior(directory), date)
    elif names := names_of_pair(directory):
        text = _of_pair(directory, names, loaded or {}, side_by_side)
    else:
        text = _of_campaigns(directory, loaded or {})
    path = directory / "report.html"
    write_whole(path, text, "make room, or make the directory writable")
    return path


def _of_campaigns(directory: Path, read: Mapping[Path, xr.Dataset]) -> str:
    """Make the page of a run directory, some results of which are read already."""
    states, paths = _states(directory), _results_in(directory)
    datasets = [read[path] if path in read else load_results(path) for path in paths]
    factors = None
    if len(datasets) == 2:
        factors = with_known_causes(
            translate(datasets[0], datasets[1]), directory / "translation.nc"
        )
    hashes = {role_of(data): content_hash(data) for data in datasets}
    date = _date(paths)
    bands, uncertain = known_bands(directory, hashes), has_uncertainty(directory)
    return render(datasets, states, factors, bands, date, uncertain=uncertain)


def _of_pair(
    directory: Path,
    names: Sequence[str],
    read: Mapping[Path, xr.Dataset],
    side_by_side: pd.DataFrame | None,
) -> str:
    """Make the page of two campaigns of one kind, which have pages of their own."""
    paths = {name: _results_in(directory / name)[0] for name in names}
    datasets = {
        name: read[path] if path in read else load_results(path)
        for name, path in paths.items()
    }
    states = {
        name: state for name in names for state in _states(directory / name).values()
    }
    campaigns = Campaigns(
        as_pair(datasets),
        states=states,
        date=_date(paths.values()),
        uncertain=any(has_uncertainty(directory / name) for name in names),
        side_by_side=compared(paths) if side_by_side is None else side_by_side,
    )
    return _page_of(" against ".join(titles_of(campaigns.datasets)), campaigns)


def _states(directory: Path) -> Mapping[str, Mapping[str, Any]]:
    """Status of the campaigns of a run directory by role."""
    return read_status(directory).get("campaigns") or {}


def _results_in(directory: Path) -> list[Path]:
    """Find the results in a run directory, that of the rig first; at least one."""
    paths = [directory / "rig.nc", directory / "field.nc"]
    existing = [path for path in paths if path.exists()]
    if not existing:
        raise _without_results(directory)
    return existing


def _date(paths: Iterable[Path]) -> str:
    """Date of the newest of some files."""
    made = max(path.stat().st_mtime for path in paths)
    return f"{datetime.fromtimestamp(made, UTC):%Y-%m-%d}"


def _without_results(directory: Path) -> ResultError:
    """Error of a run directory without results, with why its campaigns failed."""
    failures = [
        str(state.get("message"))
        for state in _states(directory).values()
        if state.get("state") == "failed"
    ]
    reason = f"the campaign failed: {'; '.join(failures)}"
    advice = reason if failures else f"`wearsim run SCENE --out {directory}` makes them"
    return ResultError(f"{directory}: there is no rig.nc or field.nc; {advice}")


def render(
    datasets: list[xr.Dataset],
    states: Mapping[str, Mapping[str, Any]] | None = None,
    factors: xr.Dataset | None = None,
    bands: tuple[xr.Dataset | None, pd.DataFrame] | None = None,
    date: str = "",
    *,
    uncertain: bool = False,
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
    date : str
        Of the results, "" if it is not known.
    uncertain : bool
        True if the scene states uncertain inputs.
    """
    if factors is None and len(datasets) == 2:
        factors = translate(datasets[0], datasets[1])
    campaigns = Campaigns(
        datasets,
        factors,
        *(bands or (None, pd.DataFrame())),
        states or {},
        date,
        uncertain,
    )
    return _page_of(" against ".join(titles_of(datasets)), campaigns)


def _page_of(title: str, campaigns: Campaigns) -> str:
    """Make the page of campaigns with all sections."""
    layers = {
        layer: [
            (key, heading, list(content(campaigns)))
            for key, heading, content in sections
        ]
        for layer, sections in LAYERS.items()
    }
    return page(title, layers)


def page(
    title: str, layers: Mapping[str, Sequence[tuple[str, str, Sequence[Any]]]]
) -> str:
    """Write the sections of each layer.

    Id, heading and blocks, left out where there are none.
    """
    templates = environment()
    templates.filters |= {
        "svg": lambda plate: to_svg(plate.figure, plate.name),
        "exact": exact,
    }
    layers = {
        layer: [section for section in sections if section[2]]
        for layer, sections in layers.items()
    }
    return templates.get_template("report.html.j2").render(
        title=title, layers=layers, version=__version__
    )


RESULTS = words("variables")["sweep"]
"""Results drawn over each varied key."""
_TABLED = ("max_wear_depth", "worn_area", "equivalent_conicity")
_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")


def render_sweep(dataset: xr.Dataset, date: str = "") -> str:
    """Page of a sweep by a dataset of `wearsim.studies.sweep.sweep_dataset`.

    `date` is that of its results, "" if it is not known.
    """
    states = Counter(map(str, dataset["state"].values))
    faults = [
        f"Case {number}: {fault}"
        for number, fault in zip(
            dataset["case"].values, dataset["fault"].values, strict=True
        )
        if fault
    ]
    ends = list(_extremes(dataset))
    context: dict[str, Any] = {
        "states": states.most_common(),
        "cases": dataset.sizes["case"],
        "ends": ends,
    }
    names = [input_title(str(dataset[name].attrs["key"])) for name in varied(dataset)]
    answer = [
        Block("alerts", faults),
        *_head([dataset], date, lines("question_sweep", names=names)),
        Block("say", lines("sweep", **context)),
    ]
    sections = [("results", "Results over each key", list(_figures(dataset)))]
    appendix = [("cases", "All cases", [_cases(dataset)])]
    layers: Any = {
        "": [("answer", "Answer", answer)],
        "For engineers": sections,
        "Appendix": appendix,
    }
    return page(str(dataset.attrs["title"]), layers)


def render_calibration(calibration: xr.Dataset, date: str = "") -> str:
    """Make the page of a calibration, of a dataset of `wearsim.calibrate`.

    `date` is that of the calibration, "" if it is not known.
    """
    answer = [
        *_head(
            [calibration], date, lines("question_calibration", calibration=calibration)
        ),
        Block("say", learned.sentences(calibration)),
        learned.inputs(calibration),
    ]
    sections = [
        ("measured", "Measured and predicted", list(learned.figures(calibration))),
        ("next", "Worth of a further measurement", [learned.worth(calibration)]),
        ("correlations", "Correlations", [learned.correlations(calibration)]),
    ]
    appendix = [
        ("checks", "Checks", [learned.checks(calibration)]),
        ("files", "Files", [learned.files(calibration)]),
    ]
    layers: Any = {
        "": [("answer", "Answer", answer)],
        "For engineers": sections,
        "Appendix": appendix,
    }
    return page(str(calibration.attrs["title"]), layers)


def varied(dataset: xr.Dataset) -> list[str]:
    """Variables of the keys that have several values."""
    keys = (
        str(name)
        for name, variable in dataset.data_vars.items()
        if "key" in variable.attrs
    )
    return [name for name in keys if len(set(map(str, dataset[name].values))) > 1]


def _text(dataset: xr.Dataset, name: str, case: int) -> str:
    """Key of a case in words, with its value and unit."""
    key, value = str(dataset[name].attrs["key"]), dataset[name].values[case]
    text = input_value(key, value) if isinstance(value, str) else given(value)
    return f"{input_title(key)} {text} {input_unit(key)}".strip()


def _key_label(dataset: xr.Dataset, name: str) -> str:
    """Key of a sweep in words, with its unit, for an axis."""
    key = str(dataset[name].attrs["key"])
    unit = input_unit(key)
    return input_heading(key) + (f" [{unit}]" if unit else "")


def _drawn_over(dataset: xr.Dataset, name: str) -> np.ndarray:
    """Values of a key over the cases, as people read them."""
    values = dataset[name].values
    if values.dtype.kind not in "OU":
        return np.asarray(values)
    key = str(dataset[name].attrs["key"])
    return np.array([input_value(key, str(value)) for value in values], dtype=object)


def _extremes(
    dataset: xr.Dataset,
) -> Iterator[tuple[str, str, list[tuple[float, str]]]]:
    """Campaign, quantity, and the smallest and largest value with its case.

    Of wear depth and area.
    """
    roles = dataset["campaign_name"].values if "campaign" in dataset.dims else ()
    for (column, role), name in ((c, n) for c in enumerate(roles) for n in RESULTS[:2]):
        values = shown(name, dataset[name].values[:, column])
        both = values.max(axis=1) if name == RESULTS[0] else values.sum(axis=1)
        if np.isfinite(both).any():
            ends = [int(find(both)) for find in (np.nanargmin, np.nanargmax)]
            texts = [
                ", ".join(_text(dataset, key, at) for key in varied(dataset))
                for at in ends
            ]
            quantity = with_unit(QUANTITIES[name].meaning, name)
            quantity = quantity[:1].lower() + quantity[1:]
            yield (
                str(role),
                quantity,
                [(float(both[at]), text) for at, text in zip(ends, texts, strict=True)],
            )


def _figures(dataset: xr.Dataset) -> Iterator[Plate]:
    """Figure of each varied key.

    All results over it, a line for each choice of the other keys.
    """
    if "campaign" not in dataset.dims:
        return
    roles = [str(role) for role in dataset["campaign_name"].values]
    results = [
        name
        for name in RESULTS
        if name in dataset and np.nan_to_num(dataset[name].values).any()
    ]
    for key in varied(dataset):

        def draw(ax: Axes, row: int, column: int, key: str = key) -> None:
            plot_over_key(dataset, key, results[row], ax, campaign=column)
            if not row:
                ax.set_title(roles[column].capitalize())

        choices = len(set(_choices(dataset, key)))
        top = 0.45 + 0.17 * (
            (min(choices, len(SERIES_COLOURS)) + 1) // 2
        )  # for the legend
        figure = panels(
            len(results),
            len(roles),
            draw,
            height=1.75,
            between=0.2,
            sharex=True,
            sharey="row",
            edges=(0.95, 0.15, 0.5, top),
            gap=0.3,
            key_columns=2,
        )
        context = {
            "key": input_title(str(dataset[key].attrs["key"])),
            "many": choices > len(SERIES_COLOURS),
        }
        yield Plate(f"sweep_{key}", figure, caption("figure", "sweep", **context))


def _choices(dataset: xr.Dataset, key: str) -> list[str]:
    """Choice of the other varied keys of each case, in words."""
    others, cases = (
        [name for name in varied(dataset) if name != key],
        range(dataset.sizes["case"]),
    )
    return [", ".join(_text(dataset, name, case) for name in others) for case in cases]


def plot_over_key(
    dataset: xr.Dataset, key: str, name: str, ax: Axes, *, campaign: int = 0
) -> Axes:
    """Draw a result over a varied key of a sweep.

    Lines join the cases that differ in that key alone.
    """
    x, values = (
        _drawn_over(dataset, key),
        shown(name, dataset[name].values[:, campaign]),
    )
    texts = _choices(dataset, key)
    for index, text in enumerate(dict.fromkeys(texts)):
        has_colour = index < len(SERIES_COLOURS)
        colour = series_colour(index) if has_colour else COLOURS["new"]
        rows = np.flatnonzero(np.array(texts) == text)
        rows = (
            rows if x.dtype.kind in "OU" else rows[np.argsort(x[rows], kind="stable")]
        )
        for wheel, column in enumerate(values[rows].reshape(rows.size, -1).T):
            line: dict[str, Any] = {
                "marker": ".",
                "ls": WHEEL_LINES[wheel],
                "color": colour,
            }
            ax.plot(
                x[rows], column, label=text if has_colour and not wheel else "", **line
            )
    return label_axes(
        ax, _key_label(dataset, key), with_unit(QUANTITIES[name].meaning, name)
    )


def _cases(dataset: xr.Dataset) -> Table:
    """Rows of sweep.csv: varied keys, state, campaign, and the results of `_TABLED`."""
    frame = pd.DataFrame(sweep_rows(dataset), dtype=object)
    names = varied(dataset)
    keys = [dataset[name].attrs["key"] for name in names]
    results = [name for name in frame if str(name).startswith(_TABLED)]
    frame = frame[["case", *keys, "state", "campaign", *results]]
    heads = [
        *(_key_label(dataset, name) for name in names),
        "State",
        "Campaign",
        *(capital(str(name)).replace("_", " ") for name in results),
    ]
    digits = [GIVEN] * (1 + len(keys)) + [4] * (2 + len(results))
    return table(
        "sweep_cases",
        frame.itertuples(index=False),
        *heads,
        look="numbers",
        digits=digits,
    )


def render_chart(measured: pd.DataFrame, shown_columns: pd.DataFrame) -> str:
    """Make the page of `wearsim chart`.

    Time against error, and its table as it is printed.
    """
    rows = (
        shown_columns.astype(object)
        .where(shown_columns.notna(), None)
        .to_numpy()
        .tolist()
    )
    answer = Block("say", lines("chart", fronts=measured[measured["pareto"]]))
    chart = Plate("chart", plot_chart(measured), caption("figure", "chart"))
    times = table("chart", rows, *map(str, shown_columns.columns), digits=3)
    layers: Any = {
        "": [("answer", "Answer", [answer])],
        "For engineers": [("chart", "Measured", [chart, times])],
    }
    return page("Speed against accuracy of the contact models", layers)


def plot_chart(measured: pd.DataFrame) -> Figure:
    """Draw CPU time against the depth error of each pair of models, by scene."""
    scenes, names = (
        list(dict.fromkeys(measured[column])) for column in ("scene", "models")
    )

    def draw(ax: Axes, _: int, column: int) -> None:
        rows = measured[
            (measured["scene"] == scenes[column]) & measured["time_ratio"].notna()
        ]
        error = (100.0 * rows["depth_error"]).clip(lower=0.1)
        for name, ratio, percent in zip(
            rows["models"], rows["time_ratio"], error, strict=True
        ):
            k = names.index(name)
            ax.plot(
                ratio,
                percent,
                _MARKERS[k % len(_MARKERS)],
                color=series_colour(k),
                ms=6,
                label=name,
            )
        front = rows[rows["pareto"]].sort_values("time_ratio").index
        ax.plot(rows["time_ratio"][front], error[front], "--", lw=0.8, color="#555555")
        ax.set(xscale="log", yscale="log", title=scenes[column])
        for axis in (ax.xaxis, ax.yaxis):
            axis.set_major_formatter(lambda value, _: f"{value:g}")
            axis.set_minor_formatter(
                lambda value, _: f"{value:g}" if f"{value:e}"[0] in "25" else ""
            )
        label_axes(
            ax, "CPU time over that of the half-space", "Largest error of the depth [%]"
        )

    return panels(
        1,
        len(scenes),
        draw,
        height=3.6,
        edges=(0.95, 0.15, 0.5, 0.4 + 0.17 * -(-len(names) // 3)),
        outer=True,
        key_columns=3,
    )
