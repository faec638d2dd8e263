"""Reports of many campaigns: a sweep, each result over each varied key; the chart of the contact models."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wearsim.quantities import QUANTITIES
from wearsim.report.figures.campaign import series_colour
from wearsim.report.html import Block, page
from wearsim.report.plates import Plate
from wearsim.report.style import (
    COLOURS,
    SERIES_COLOURS,
    WHEEL_LINES,
    capital,
    label_axes,
    panels,
    shown,
    with_unit,
)
from wearsim.report.tables import GIVEN, Table, given, table
from wearsim.report.texts import caption, lines, words
from wearsim.studies.sweep import sweep_dataset, sweep_rows
from wearsim.whole_files import write_whole

RESULTS = words("variables")["sweep"]
"""Results drawn over each varied key."""
_TABLED = ("max_wear_depth", "worn_area", "equivalent_conicity")
_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")


def write_sweep_report(directory: Path) -> Path:
    """Write `report.html` of the directory of a sweep, whatever of it has run; returns its path."""
    path = directory / "report.html"
    write_whole(path, render_sweep(sweep_dataset(directory)), "make room, or make the directory writable")
    return path


def render_sweep(dataset: xr.Dataset) -> str:
    """Make the page of a sweep, of a dataset of `wearsim.studies.sweep.sweep_dataset`."""
    states = Counter(map(str, dataset["state"].values))
    faults = [
        f"Case {number}: {fault}"
        for number, fault in zip(dataset["case"].values, dataset["fault"].values, strict=True)
        if fault
    ]
    ends = list(_extremes(dataset))
    said: dict[str, Any] = {"states": states.most_common(), "cases": dataset.sizes["case"], "ends": ends}
    answer = [Block("alerts", faults), Block("say", lines("sweep", **said))]
    sections = [("results", "Results over each key", list(_figures(dataset)))]
    appendix = [("cases", "All cases", [_cases(dataset)])]
    layers: Any = {"": [("answer", "Answer", answer)], "For engineers": sections, "Appendix": appendix}
    return page(str(dataset.attrs["title"]), layers)


def varied(dataset: xr.Dataset) -> list[str]:
    """Variables of the keys that have several values."""
    keys = (str(name) for name, variable in dataset.data_vars.items() if "key" in variable.attrs)
    return [name for name in keys if len(set(map(str, dataset[name].values))) > 1]


def _text(dataset: xr.Dataset, name: str, case: int) -> str:
    value = dataset[name].values[case]
    return f"{dataset[name].attrs['key']} = {value if isinstance(value, str) else given(value)}"


def _extremes(dataset: xr.Dataset) -> Iterator[tuple[str, str, list[tuple[float, str]]]]:
    """Campaign, quantity, and the smallest and largest value with its case, of wear depth and area."""
    roles = dataset["campaign_name"].values if "campaign" in dataset.dims else ()
    for (column, role), name in ((c, n) for c in enumerate(roles) for n in RESULTS[:2]):
        values = shown(name, dataset[name].values[:, column])
        both = values.max(axis=1) if name == RESULTS[0] else values.sum(axis=1)
        if np.isfinite(both).any():
            ends = [int(find(both)) for find in (np.nanargmin, np.nanargmax)]
            texts = [", ".join(_text(dataset, key, at) for key in varied(dataset)) for at in ends]
            quantity = with_unit(QUANTITIES[name].meaning, name)
            quantity = quantity[:1].lower() + quantity[1:]
            yield str(role), quantity, [(float(both[at]), text) for at, text in zip(ends, texts, strict=True)]


def _figures(dataset: xr.Dataset) -> Iterator[Plate]:
    """Figure of each varied key: all results over it, a line for each choice of the other keys."""
    if "campaign" not in dataset.dims:
        return
    roles = [str(role) for role in dataset["campaign_name"].values]
    results = [name for name in RESULTS if name in dataset and np.nan_to_num(dataset[name].values).any()]
    for key in varied(dataset):

        def draw(ax: Axes, row: int, column: int, key: str = key) -> None:
            plot_over_key(dataset, key, results[row], ax, campaign=column)
            if not row:
                ax.set_title(roles[column].capitalize())

        choices = len(set(_choices(dataset, key)))
        top = 0.45 + 0.17 * ((min(choices, len(SERIES_COLOURS)) + 1) // 2)  # for the legend
        figure = panels(
            len(results), len(roles), draw, height=1.75, between=0.2, sharex=True, sharey="row",
            edges=(0.95, 0.15, 0.5, top), gap=0.3, key_columns=2,
        )  # fmt: skip
        said = {"key": dataset[key].attrs["key"], "many": choices > len(SERIES_COLOURS)}
        yield Plate(f"sweep_{key}", figure, caption("figure", "sweep", **said))


def _choices(dataset: xr.Dataset, key: str) -> list[str]:
    """Choice of the other varied keys of each case, in words."""
    others, cases = [name for name in varied(dataset) if name != key], range(dataset.sizes["case"])
    return [", ".join(_text(dataset, name, case) for name in others) for case in cases]


def plot_over_key(dataset: xr.Dataset, key: str, name: str, ax: Axes, *, campaign: int = 0) -> Axes:
    """Draw a result over a varied key of a sweep: lines join the cases that differ in that key alone."""
    x, values = dataset[key].values, shown(name, dataset[name].values[:, campaign])
    texts = _choices(dataset, key)
    for index, text in enumerate(dict.fromkeys(texts)):
        known = index < len(SERIES_COLOURS)
        colour = series_colour(index) if known else COLOURS["new"]
        here = np.flatnonzero(np.array(texts) == text)
        here = here if x.dtype.kind in "OU" else here[np.argsort(x[here], kind="stable")]
        for wheel, column in enumerate(values[here].reshape(here.size, -1).T):
            line: dict[str, Any] = {"marker": ".", "ls": WHEEL_LINES[wheel], "color": colour}
            ax.plot(x[here], column, label=text if known and not wheel else "", **line)
    return label_axes(ax, str(dataset[key].attrs["key"]), with_unit(QUANTITIES[name].meaning, name))


def _cases(dataset: xr.Dataset) -> Table:
    """Rows of sweep.csv: varied keys, state, campaign, and the results of `_TABLED`."""
    frame = pd.DataFrame(sweep_rows(dataset), dtype=object)
    keys = [dataset[name].attrs["key"] for name in varied(dataset)]
    results = [name for name in frame if str(name).startswith(_TABLED)]
    frame = frame[["case", *keys, "state", "campaign", *results]]
    heads = [*keys, "State", "Campaign", *(capital(str(name)).replace("_", " ") for name in results)]
    digits = [GIVEN] * (1 + len(keys)) + [4] * (2 + len(results))
    return table("sweep_cases", frame.itertuples(index=False), *heads, look="numbers", digits=digits)


def render_chart(measured: pd.DataFrame, shown_columns: pd.DataFrame) -> str:
    """Make the page of `wearsim chart`: time against error, and its table as it is printed."""
    rows = shown_columns.astype(object).where(shown_columns.notna(), None).to_numpy().tolist()
    answer = Block("say", lines("chart", fronts=measured[measured["pareto"]]))
    chart = Plate("chart", plot_chart(measured), caption("figure", "chart"))
    times = table("chart", rows, *map(str, shown_columns.columns), digits=3)
    layers: Any = {
        "": [("answer", "Answer", [answer])],
        "For engineers": [("chart", "Measured", [chart, times])],
    }
    return page("Speed against accuracy of the contact models", layers)


def plot_chart(measured: pd.DataFrame) -> Figure:
    """Draw CPU time against the largest error of depth of each combination of models, by scene."""
    scenes, names = (list(dict.fromkeys(measured[column])) for column in ("scene", "models"))

    def draw(ax: Axes, _: int, column: int) -> None:
        rows = measured[(measured["scene"] == scenes[column]) & measured["time_ratio"].notna()]
        error = (100.0 * rows["depth_error"]).clip(lower=0.1)
        for name, ratio, percent in zip(rows["models"], rows["time_ratio"], error, strict=True):
            k = names.index(name)
            ax.plot(ratio, percent, _MARKERS[k % len(_MARKERS)], color=series_colour(k), ms=6, label=name)
        front = rows[rows["pareto"]].sort_values("time_ratio").index
        ax.plot(rows["time_ratio"][front], error[front], "--", lw=0.8, color="#555555")
        ax.set(xscale="log", yscale="log", title=scenes[column])
        for axis in (ax.xaxis, ax.yaxis):
            axis.set_major_formatter(lambda value, _: f"{value:g}")
            axis.set_minor_formatter(lambda value, _: f"{value:g}" if f"{value:e}"[0] in "25" else "")
        label_axes(ax, "CPU time over that of the half-space", "Largest error of the depth [%]")

    return panels(1, len(scenes), draw, height=3.6, edges=(0.95, 0.15, 0.5, 1.0), outer=True, key_columns=4)
