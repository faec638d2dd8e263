"""Words of a report, from `templates/texts.toml`, and what they say about results."""

from __future__ import annotations

import functools
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jinja2
import xarray as xr

from wearsim import texts
from wearsim.damage.titles import law_title
from wearsim.report.style import (
    capital,
    distance_text,
    plain,
    role_of,
    role_title,
    titles_of,
    unbroken,
)
from wearsim.results.checks import (
    closing_reprofiling,
    cracks_left,
    last_worn_row,
    new_row,
    percent,
    reprofiled_rows,
    result_warnings,
    shear_yield,
)


def environment_text(dataset: xr.Dataset) -> str:
    """Environment factor of the points that wear, as a range where they differ."""
    factor = dataset["environment"].values[dataset["weight"].values > 0.0]
    if factor.size == 0:
        return "none: no point wears"
    low, high = float(factor.min()), float(factor.max())
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"


def environments(datasets: Sequence[xr.Dataset]) -> str:
    """Environment factors of campaigns, one number where all have the same."""
    factors = [environment_text(data) for data in datasets]
    if len(set(factors)) == 1:
        return factors[0]
    return ", ".join(
        f"{factor} ({role_of(data)})"
        for factor, data in zip(factors, datasets, strict=True)
    )


def environment_note(datasets: Sequence[xr.Dataset]) -> str:
    """Sentence with the environment factors of all campaigns."""
    return f"Environment factor: {environments(datasets)}."


def run(dataset: xr.Dataset) -> str:
    """Distance run by a campaign."""
    return distance_text(dataset["distance"].values[-1])


def worn_since_reprofiling(dataset: xr.Dataset) -> bool:
    """Return True if the wear depth of the last worn row counts from a reprofiling."""
    return new_row(dataset, last_worn_row(dataset)) > 0


def worn_over(dataset: xr.Dataset) -> str:
    """Distance over which the wheels took the wear depth of the last worn row."""
    end = last_worn_row(dataset)
    start = new_row(dataset, end)
    if start == 0:
        return f"after {run(dataset)}"
    first, last = dataset["distance"].values[[start, end]]
    distance = distance_text(last - first)
    if end < dataset.sizes["step"] - 1:  # the campaign ends with a reprofiling
        return f"between the last two reprofilings, {distance}"
    return f"since the last reprofiling, {distance}"


def wears(dataset: xr.Dataset) -> bool:
    """Return True if the counterface of a campaign wears."""
    return "counterface_name" in dataset


def rolls(dataset: xr.Dataset) -> bool:
    """Return True if the counterface that wears is a pair of rollers."""
    return "roller" in str(dataset["counterface_name"].values[0])


def compares(dataset: xr.Dataset) -> bool:
    """Return True if a campaign has comparison laws."""
    return "comparison_name" in dataset


def stated_warnings(dataset: xr.Dataset) -> list[str]:
    """Warnings that a result states, one line each: a text of lines, or a list."""
    stated = dataset.attrs.get("warnings", "")
    texts = [stated] if isinstance(stated, str) else map(str, stated)
    lines = [line for text in texts for line in text.splitlines()]
    return [line.strip() for line in lines if line.strip()]


_SAYS = (
    capital,
    closing_reprofiling,
    cracks_left,
    environment_note,
    environment_text,
    environments,
    compares,
    distance_text,
    law_title,
    percent,
    plain,
    reprofiled_rows,
    result_warnings,
    role_of,
    role_title,
    rolls,
    run,
    shear_yield,
    stated_warnings,
    titles_of,
    unbroken,
    wears,
    worn_over,
    worn_since_reprofiling,
)
"""Functions that templates call, also as filters and tests."""


@functools.cache
def environment(autoescape: bool = True) -> jinja2.Environment:
    """Templates of the reports, for HTML or (without escapes) for text."""
    made = texts.environment("wearsim.report", autoescape)
    says = {function.__name__: function for function in _SAYS}
    made.globals |= says
    made.filters |= says
    made.tests |= says
    return made


@functools.cache
def _texts() -> dict[str, dict[str, Any]]:
    path = Path(__file__).with_name("templates") / "texts.toml"
    return tomllib.loads(path.read_text(encoding="utf-8"))


def words(name: str) -> dict[str, Any]:
    """Words by key that stand in the texts under a name."""
    return _texts()[name]


def lines(name: str, kind: str = "lines", **context: Any) -> list[str]:
    """Sentences of a name, those that apply."""
    text = environment(False).from_string(_texts()[kind][name]).render(**context)
    return [line.strip() for line in text.splitlines() if line.strip()]


def caption(kind: str, name: str, **context: Any) -> str:
    """Caption of a figure or table ("figure", "table") of a name; "" if it has none."""
    return " ".join(lines(name, kind, **context)) if name in _texts()[kind] else ""


def columns(name: str, **context: Any) -> list[str]:
    """Heads of the columns of a table, the first ones if others are of the data."""
    return [
        environment(False).from_string(text).render(**context)
        for text in _texts()["columns"][name]
    ]
