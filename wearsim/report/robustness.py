"""Report on where contact models fail: which model to take, what every model does where, what it refuses."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from wearsim.report.folder import report_folder
from wearsim.studies.accuracy import ERRORS
from wearsim.studies.robustness import (
    CRASHED,
    DEGRADED,
    REFUSED,
    RIGHT,
    STATED,
    UNPROVEN,
    UNSOUND,
    UNSTATED,
    WRONG,
    worst,
)

_SHORT = {"area": "A", "max_pressure": "p", "force": "F", "power": "P", "strip_work": "W"}
_PURPOSES = (
    ("forces and power", ("force", "power"), False),
    ("patch and pressure", ("area", "max_pressure"), False),
    ("wear (strip work)", ("strip_work",), True),
)
_BAD = {UNSOUND: "UNSOUND", CRASHED: "CRASHED"}


def write_robustness(
    found: xr.Dataset, steps: xr.Dataset, about: tuple[str, str], out: Path, stem: str, command: str
) -> Path:
    """Write the report on where contact models fail.

    Parameters
    ----------
    found : Dataset
        From `wearsim.studies.robustness.assess`.
    steps : Dataset
        From `wearsim.studies.step_limits.step_limits`.
    about : (str, str)
        Title, and a paragraph for the report.
    out : Path
        Folder; made if it is not there.
    stem : str
        Of the file names.
    command : str
        Command line, for the report.

    Returns
    -------
    Path
        The Markdown file; beside it a CSV file of all outcomes and errors.

    Raises
    ------
    ResultError
        If the folder cannot be written to.
    """
    with report_folder(out):
        values_table(found).to_csv(out / f"{stem}.csv", index=False, float_format="%.4g", lineterminator="\n")
        path = out / f"{stem}.md"
        path.write_text(markdown(found, steps, about, command, f"{stem}.csv"), encoding="utf-8")
    return path


def values_table(found: xr.Dataset) -> pd.DataFrame:
    """Table of all outcomes and errors, a row for each situation and model.

    Parameters
    ----------
    found : Dataset
        From `wearsim.studies.robustness.assess`.

    Returns
    -------
    DataFrame
        Errors relative, missing where there is no answer or no reference.
    """
    rows = []
    for k in range(found.sizes["situation"]):
        for j, model in enumerate(found["model"].values):
            rows.append(
                {
                    "kind": found["kind"].values[k],
                    "situation": found["title"].values[k],
                    "model": model,
                    "outcome": found["outcome"].values[k, j],
                    **{f"error_{name}": found[f"error_{name}"].values[k, j] for name in ERRORS},
                    "told": found["told"].values[k, j],
                }
            )
    return pd.DataFrame(rows)


def markdown(found: xr.Dataset, steps: xr.Dataset, about: tuple[str, str], command: str, values: str) -> str:
    """Write the report.

    Parameters
    ----------
    found, steps, about, command
        As for `write_robustness`.
    values : str
        File name of the table of all values.

    Returns
    -------
    str
        Markdown.
    """
    title, remarks = about
    numbers = _numbers(found)
    parts = [
        f"# {title}",
        "## Which model for which scene",
        _decision_intro(found),
        decision_table(found),
        _decision_notes(found),
        remarks,
        "## How it was found",
        _introduction(found, command, values),
        _counts(found),
        "## What each model does in each situation",
        _matrix(found, numbers),
        "## Wear steps within and beyond the limit of stability",
        _steps(steps),
        "## Messages",
        _messages(found, numbers),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _decision_intro(found: xr.Dataset) -> str:
    return (
        f"The cheapest combination of normal and tangential model that stays within "
        f"{100.0 * found.attrs['right']:g} % of the half-space solution in every situation of a kind, for "
        "what you want to know. Where none does, the one whose largest error is smallest, in brackets."
    )


def decision_table(found: xr.Dataset) -> str:
    """Table of the cheapest adequate models.

    Parameters
    ----------
    found : Dataset
        From `wearsim.studies.robustness.assess`, its models by rising cost.

    Returns
    -------
    str
        Markdown: a row for each kind of situation, a column for each purpose.
    """
    lines = [
        "| scene | " + " | ".join(purpose for purpose, _, _ in _PURPOSES) + " |",
        "|---|" + "---|" * len(_PURPOSES),
    ]
    for kind in dict.fromkeys(found["kind"].values):
        answered = ~np.isnan(found["error_area"].values).all(axis=1)
        rows = np.flatnonzero((found["kind"].values == kind) & answered)
        cells = [_choice(found, rows, names, leads) for _, names, leads in _PURPOSES]
        lines.append(f"| {kind} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _choice(found: xr.Dataset, rows: NDArray[np.int64], names: tuple[str, ...], leads: bool) -> str:
    """Cheapest combination for some errors in some situations."""
    if rows.size == 0:
        return "none: all refuse"
    stacked = np.stack([np.abs(found[f"error_{name}"].values[rows]) for name in names])
    largest = np.where(np.isnan(stacked), np.inf, stacked).max(axis=(0, 1))
    if leads:
        largest = np.where(found["leads"].values, largest, np.inf)
    good = np.flatnonzero(largest <= found.attrs["right"])
    if good.size:
        return f"`{found['model'].values[good[0]]}`"
    best = int(np.argmin(largest))
    if not np.isfinite(largest[best]):
        return "none answers everywhere"
    shown = float(f"{largest[best]:.4g}")  # as `values_table` has it, so that both round alike
    return f"`{found['model'].values[best]}` ({100.0 * shown:.0f} %)"


def _decision_notes(found: xr.Dataset) -> str:
    never = sorted(
        {str(n) for n, lead in zip(found["normal"].values, found["leads"].values, strict=True) if not lead}
    )
    banned = ", ".join(f"`{name}`" for name in never)
    return (
        f"{banned} is left out of the last column: it must not lead a profile update. Smooth measured "
        "profiles before they are used: no model gives the wear of a rough one, and the pressure is that of "
        "roughness that would yield. Situations that the half-space, or every model, refuses count for no "
        "choice. The choice rests on these situations alone: stay near them, or measure your own with "
        '`wearsim run` on a scene of kind "accuracy".'
    )


def _introduction(found: xr.Dataset, command: str, values: str) -> str:
    right, wrong = 100.0 * found.attrs["right"], 100.0 * found.attrs["wrong"]
    grid, fine = found.attrs["grid"], found.attrs["reference_grid"]
    return (
        f"{found.sizes['situation']} situations, {found.sizes['model']} combinations of models on {grid} "
        f"strips and {grid} cells, unless the situation is one of the grid. Right wheel; S1002 on 60E1 1:40 "
        "at a shift of 3 mm, 80 kN, friction 0.35, 20 m/s, steel, unless the situation says otherwise. "
        f"Reference: `half_space + half_space` on {fine} x {fine}; the column of `half_space + half_space` "
        "itself shows what the grid alone does.\n\n"
        "Errors: A area, p maximum pressure, P frictional power, relative; F creep force over friction "
        "coefficient times load; W strip work, the integral of the absolute difference over that of the "
        f"reference. A cell of the matrix holds `right` if all are within {right:g} %, else those that are "
        f"not, in per cent; bold if one is above {wrong:g} %. `refused` has the number of the message below. "
        "`unproven`: an answer where the reference refuses.\n\n"
        "Never allowed, and looked for in every answer: numbers that are not finite; a load that is not "
        "carried; negative pressure; traction beyond friction; power gained; strip work that does not add up "
        f"to the power; an error other than a refusal; more than {found.attrs['seconds']:g} s.\n\n"
        f"All values: [{values}]({values}). Written by `{command}`."
    )


def _counts(found: xr.Dataset) -> str:
    outcomes = (RIGHT, DEGRADED, WRONG, REFUSED, UNPROVEN, UNSOUND, CRASHED)
    stated = [f"{_SHORT[name]} stated [%]" for name in ERRORS]
    lines = [
        "| model | " + " | ".join((*outcomes, *stated)) + " |",
        "|---|" + "---|" * (len(outcomes) + len(stated)),
    ]
    for j, model in enumerate(found["model"].values):
        mine = found["outcome"].values[:, j]
        limits = STATED.get((str(found["normal"].values[j]), str(found["tangential"].values[j])), UNSTATED)
        cells = [str(int((mine == name).sum())) for name in outcomes]
        cells += [f"{100.0 * limits[name]:.0f}" for name in ERRORS]
        lines.append(f"| `{model}` | " + " | ".join(cells) + " |")
    return "\n".join(lines)


_PLACE = re.compile(r"^(right|left) wheel, shift [^:]*: ")
_VALUE = re.compile(r"-?\d[\d.]*(e[+-]?\d+)?")


def _general(message: str) -> str:
    """Return a message without its place and values: what it has in common with others of its sort."""
    return _VALUE.sub("#", _PLACE.sub("", message))


def _numbers(found: xr.Dataset) -> dict[str, int]:
    """Sorts of messages and their numbers."""
    numbers: dict[str, int] = {}
    for told in found["told"].values.ravel():
        if told:
            numbers.setdefault(_general(str(told)), len(numbers) + 1)
    return numbers


def _matrix(found: xr.Dataset, numbers: dict[str, int]) -> str:
    largest = worst(found)
    lines = [
        "| situation | "
        + " | ".join(str(model).replace(" + ", "<br>+ ") for model in found["model"].values)
        + " |",
        "|---|" + "---|" * found.sizes["model"],
    ]
    before = ""
    for k in range(found.sizes["situation"]):
        kind = str(found["kind"].values[k])
        if kind != before:
            lines.append(f"| **{kind}** |" + " |" * found.sizes["model"])
            before = kind
        cells = [_cell(found, k, j, numbers, float(largest[k, j])) for j in range(found.sizes["model"])]
        lines.append(f"| {found['title'].values[k]} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _cell(found: xr.Dataset, k: int, j: int, numbers: dict[str, int], largest: float) -> str:
    outcome, told = str(found["outcome"].values[k, j]), str(found["told"].values[k, j])
    if told:
        return f"{_BAD.get(outcome, outcome)} ({numbers[_general(told)]})"
    if outcome in (RIGHT, UNPROVEN):
        return outcome
    parts = []
    for name in ERRORS:
        error = float(found[f"error_{name}"].values[k, j])
        if abs(error) > found.attrs["right"]:
            sign = "" if name in ("force", "strip_work") else "+" if error > 0.0 else "-"
            parts.append(f"{_SHORT[name]} {sign}{100.0 * abs(error):.0f}")
    text = ", ".join(parts)
    return f"**{text}**" if largest > found.attrs["wrong"] else text


def _steps(steps: xr.Dataset) -> str:
    factors = steps["factor"].values
    waves = [f"{1e3 * wave:g} mm" for wave in steps["wavelength"].values]
    lines = [
        f"What one explicit step leaves of a waviness of 0.2 um, without smoothing, points "
        f"{1e3 * steps.attrs['spacing']:g} mm apart: 1 is all of it, more is growth. Steps in units of the "
        "longest one the limit in force allows; campaigns take none that is longer.\n",
        "| normal model | limit in force | depth at the limit [um] | wave | "
        + " | ".join(f"{factor:g} x" for factor in factors) + " |",
        "|---|---|---|---|" + "---|" * factors.size,
    ]  # fmt: skip
    for k, name in enumerate(steps["normal"].values):
        for j, wave in enumerate(waves):
            cells = [
                str(steps["told"].values[k, j, i]) or f"{float(steps['left'].values[k, j, i]):.2f}"
                for i in range(factors.size)
            ]
            depth = f"{1e6 * float(steps['depth'].values[k]):.1f}"
            row = [f"`{name}`", str(steps["limit"].values[k]), depth, wave, *cells]
            lines.append("| " + " | ".join(row) + " |")
    blind = sorted(_blind(steps))
    if blind:
        told = ", ".join(f"`{name}`" for name in blind)
        lines.append(
            f"\nWithin the limit, {told} leave{'s' if len(blind) == 1 else ''} 99 % or more of one of these "
            "waves: noise of a measured profile stays in it. Smooth such a profile before the run, and leave "
            "the smoothing of the increments on, so that steps add none."
        )
    return "\n".join(lines)


def _blind(steps: xr.Dataset) -> set[str]:
    """Models that do not wear off a wave within the limit."""
    left = steps["left"].values[:, :, 0]
    return {str(steps["normal"].values[k]) for k in range(left.shape[0]) if (left[k] > 0.99).any()}


def _messages(found: xr.Dataset, numbers: dict[str, int]) -> str:
    """Each sort of message as it was told first, and by whom how often."""
    lines = []
    for sort, number in numbers.items():
        same = np.array([[_general(str(told)) == sort for told in row] for row in found["told"].values])
        first = _PLACE.sub("", str(found["told"].values[tuple(np.argwhere(same)[0])]))
        by = [
            f"`{model}` {count}"
            for model, count in zip(found["model"].values, same.sum(axis=0), strict=True)
            if count
        ]
        lines.append(f"{number}. {first} ({', '.join(by)})")
    return "\n".join(lines)
