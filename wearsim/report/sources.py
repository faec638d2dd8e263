"""Provenance of a report.

Coefficients and their certainty, literature, commands and files.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import xarray as xr

from wearsim.contact.friction import falling_friction
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.tangential import TANGENTIAL_MODELS
from wearsim.damage.coefficients import COEFFICIENT_SETS
from wearsim.damage.fatigue.shakedown import boundaries
from wearsim.damage.titles import law_title, set_title
from wearsim.report.style import role_of, role_title
from wearsim.report.tables import Table, table
from wearsim.report.texts import words
from wearsim.results import loaded
from wearsim.results.settings import SETTINGS
from wearsim.translation.translate import Result, content_hash

_SET = (
    "form",
    "coefficients",
    "materials",
    "validity",
    "departures",
    "numbers",
    "source",
    "warnings",
)
"""What a result file says of a law: form, and name, texts and numbers of its
coefficient set.
"""
_ACTIVE = {
    "form": "wear_form",
    "coefficients": "wear_coefficients",
    "numbers": "wear_law_numbers",
}


def _laws(dataset: xr.Dataset) -> Iterator[tuple[str, dict[str, str]]]:
    """Name of each wear and fatigue law of a campaign, the active one first.

    With what is said of it.
    """
    attrs = dataset.attrs
    active = {
        key: str(attrs.get(_ACTIVE.get(key, f"wear_coefficients_{key}"), ""))
        for key in _SET
    }
    yield str(attrs.get("wear_law", "law")), active
    for group in ("comparison", "fatigue"):
        for k, law in enumerate(
            dataset[f"{group}_name"].values if f"{group}_name" in dataset else ()
        ):
            lines = {key: attrs.get(f"{group}_{key}", "").split("\n") for key in _SET}
            lines |= {
                key: dataset[f"{group}_{key}"].values
                for key in _SET
                if f"{group}_{key}" in dataset
            }
            yield (
                str(law),
                {
                    key: str(texts[k]) if k < len(texts) else ""
                    for key, texts in lines.items()
                },
            )


def _of_all(
    datasets: Sequence[xr.Dataset],
) -> dict[tuple[str, str], tuple[dict[str, str], list[str]]]:
    """Laws of all campaigns by name and numbers, what is said of each.

    And the roles that have it.
    """
    statements: dict[tuple[str, str], tuple[dict[str, str], list[str]]] = {}
    for data in datasets:
        for law, texts in _laws(data):
            statements.setdefault((law, texts["numbers"]), (texts, []))[1].append(
                role_of(data)
            )
    return statements


def laws(datasets: Sequence[xr.Dataset]) -> Table:
    """Set of coefficients of each law.

    What it was measured on, holds for, and where we depart from it.
    """
    rows = []
    for (law, _), (said, roles) in _of_all(datasets).items():
        texts = (said[key] or None for key in ("materials", "validity", "departures"))
        rows.append(
            [
                f"{law_title(law)} ({', '.join(roles)})",
                said["form"].replace("_", " "),
                set_title(said["coefficients"]) or None,
                *texts,
            ]
        )
    return table("law_sources", rows, look="text")


def coefficients(datasets: Sequence[xr.Dataset]) -> Table:
    """Every coefficient that acted, with its range, certainty and source."""
    rows: list[list[Any]] = []
    certain = words("certainty")
    for (law, _), (said, _) in _of_all(datasets).items():
        published = COEFFICIENT_SETS.get(said["coefficients"])
        for number in filter(None, said["numbers"].split(", ")):
            symbol, _, value = number.partition(" = ")
            coefficient = published.values.get(symbol) if published else None
            if (
                coefficient is None
                or value != f"{coefficient.value:.10g}{coefficient.unit_after}"
            ):
                user_note = (
                    said["warnings"] if published is None else ""
                )  # of a set of the user's own
                rows.append(
                    [
                        law_title(law),
                        symbol,
                        value,
                        None,
                        user_note or certain["given"],
                        None,
                    ]
                )
                continue
            limits = (
                f"{coefficient.limits[0]:g} to {coefficient.limits[1]:g}"
                if coefficient.limits
                else None
            )
            rows.append(
                [
                    law_title(law),
                    symbol,
                    value,
                    limits,
                    certain[coefficient.certainty],
                    coefficient.place,
                ]
            )
    if any("fatigue_name" in data for data in datasets):
        for curve in boundaries(0.6):
            rows.append(
                [
                    "shakedown map",
                    curve.label,
                    None,
                    None,
                    certain[curve.certainty],
                    None,
                ]
            )
    return table("coefficients", rows, look="text")


def bibliography(datasets: Sequence[xr.Dataset]) -> list[str]:
    """Publications behind coefficients and contact models of campaigns, each once."""
    publications = [
        said["source"].rstrip(".")
        for said, _ in _of_all(datasets).values()
        if said["source"]
    ]
    for data in datasets:
        for models, key in (
            (NORMAL_MODELS, "contact_normal"),
            (TANGENTIAL_MODELS, "contact_tangential"),
        ):
            model: Any = models.get(str(data.attrs.get(key)))
            if model:
                publications += _stated_by(model.solve)
        if {"kalker_factor", "friction_ratio"} & data.attrs.keys():
            publications += _stated_by(falling_friction)
    return sorted({" ".join(publication.split()) for publication in publications})


def _stated_by(function: Callable[..., Any]) -> list[str]:
    """Publications that the module of a function states."""
    return re.findall(
        r"^\.\. \[\d+\] (.+?)\.?$(?=\n\.\. \[|\n*\Z)",
        str(inspect.getdoc(inspect.getmodule(function))),
        re.DOTALL | re.MULTILINE,
    )


def citations(results: Result | Sequence[Result]) -> list[str]:
    """Publications to cite with results.

    Those behind their coefficients, laws and contact models.

    Parameters
    ----------
    results : str, Path or Dataset, or sequence of them
        Result files, or results as `wearsim.open_results` gives them.

    Returns
    -------
    list of str
        Each publication once, in the order of the alphabet.

    Raises
    ------
    ResultError
        If a file is missing, damaged or not a whole result of this version of wearsim.

    Examples
    --------
    >>> import wearsim
    >>> any("FASTSIM" in one or "Kalker" in one for one in wearsim.citations("out/rig.nc"))
    True
    """
    several = [results] if isinstance(results, str | Path | xr.Dataset) else results
    return bibliography([loaded(result) for result in several])


def commands(datasets: Sequence[xr.Dataset]) -> list[str]:
    """Commands that made the results, and the one that writes the report again."""
    made = [
        str(data.attrs["history"]) for data in datasets if data.attrs.get("history")
    ]
    return [*dict.fromkeys(made), "wearsim report DIR"]


def provenance(datasets: Sequence[xr.Dataset]) -> Table:
    """Title, versions and files of each campaign."""
    rows = [
        [setting.title, *(data.attrs.get(setting.name) or None for data in datasets)]
        for setting in SETTINGS.values()
        if setting.use == "provenance"
        and any(data.attrs.get(setting.name) for data in datasets)
    ]
    rows.append(["SHA-256 of the result values", *map(content_hash, datasets)])
    return table("provenance", rows, *map(role_title, datasets), look="text")
