"""Reprofilings and service life in summaries and reports."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from wearsim.quantities import QUANTITIES, kilometres
from wearsim.report.style import (
    band_text,
    distance_text,
    estimate,
    in_terminal,
    plain,
    role_of,
    role_title,
)
from wearsim.report.tables import Table, limit_text, table
from wearsim.report.texts import environment_text
from wearsim.results.service_life import (
    PARTS,
    ServiceLife,
    reprofiling_table,
    service_life,
)

Bands = xr.Dataset | None

BEYOND = "beyond 10 times the distance run"
"""Place of the end of a life that is too far to be extrapolated."""

AT_LIMIT = "where a limit is met, at most 1 % or one loop of a programme later"
"""Place of a reprofiling at a limit."""


def summary_lines(life: Mapping[str, Any] | None) -> list[str]:
    """Write the service life of `wearsim.inspect` in two lines for a terminal."""
    if life is None:
        return []
    low, high = life["environment"]
    factor = f"{low:g}" if low == high else f"{low:g} to {high:g}"
    end = f"life: {_end_of(life)}; assumes the environment factor {factor}"
    count = life["reprofilings"]
    if not count:
        return [end, "not reprofiled so far"]
    shares = ", ".join(
        f"{name.replace('_', ' ')} {100 * share:.0f} %"
        for name, share in life["shares"].items()
    )
    mean, last = _km(life["interval"]), _km(life["last_interval"])
    when = f"{count} times, every {mean} (last interval {last})"
    place = f", {AT_LIMIT}" if life["at_limits"] else ""
    return [
        end,
        f"reprofiled {when if count > 1 else f'once, after {mean}'}{place}; "
        f"{_number(1e3 * life['loss'])} mm of diameter each time: {shares}",
    ]


def _end_of(life: Mapping[str, Any]) -> str:
    limit = life["limit"]
    if limit is None:
        return (
            "unknown without a limit at which the wheels are not reprofiled, such as "
            "diameter_mm in [campaign.limits]"
        )
    name = QUANTITIES[limit["name"]].meaning.removesuffix(" of the wheel")
    if life["distance"] is None:  # null in JSON: infinite
        return f"the limit of {name} is {BEYOND}"
    wheel = f" ({life['wheel']})" if life["wheel"] else ""
    count = life["expected"]
    after = "" if count is None else f", after {_count(count)}"
    about = "" if life["met"] else "about "
    text = f"{about}{_km(life['distance'])} to the limit of {name}{wheel}{after}"
    how = "; extrapolated: the last interval is repeated"
    return text if life["met"] else text + how


def _km(distance: float | None) -> str:
    return "an unknown distance" if distance is None else kilometres(distance)


def _number(value: float) -> str:
    return in_terminal(plain(value))


def _count(count: float) -> str:
    return f"{count:.0f} reprofiling{'' if count == 1 else 's'}"


def reprofilings(datasets: Sequence[xr.Dataset]) -> list[Table]:
    """Distance, cause and parts of the loss of diameter of each reprofiling."""
    tables = []
    for data in datasets:
        frame = reprofiling_table(data)
        if len(frame) == 0:
            continue
        frame.insert(
            0,
            "which",
            [
                f"{n}, {side}"
                for n, side in zip(
                    frame.pop("reprofiling"), frame.pop("wheel"), strict=True
                )
            ],
        )
        frame["cause"] = [
            "distance" if name not in QUANTITIES else QUANTITIES[name].meaning
            for name in frame["cause"]
        ]
        made = table(
            "reprofilings",
            frame.to_numpy().tolist(),
            context={"datasets": datasets},
            digits=(4, 4, 4, 4, 6, 6, 3, 3, 3, 3, 3, 4, 3),
        )
        tables.append(made.of(role_of(data), role_title(data)))
    return tables


def life(datasets: Sequence[xr.Dataset]) -> list[Table]:
    """Intervals, loss of diameter and end of the life, a column per campaign."""
    lives = [
        (data, campaign_life)
        for data in datasets
        if (campaign_life := service_life(data)) is not None
    ]
    if not lives:
        return []
    columns = [_rows(data, campaign_life) for data, campaign_life in lives]
    rows = [[name, *(column[name] for column in columns)] for name in columns[0]]
    heads = [role_title(data) for data, _ in lives]
    context = {"at_limits": any(campaign_life.at_limits for _, campaign_life in lives)}
    return [table("service_life", rows, *heads, look="text", context=context)]


def _rows(data: xr.Dataset, campaign_life: ServiceLife) -> dict[str, str | None]:
    made = campaign_life.reprofilings > 0
    values = [
        f"{plain(100.0 * campaign_life.shares[part], 3)} %" if made else None
        for part in PARTS
    ]
    heads = [f"Part of the loss: {part.replace('_', ' ')}" for part in PARTS]
    ends, at = None, None
    if campaign_life.limit is not None:
        wheel = f" ({campaign_life.wheel})" if campaign_life.wheel else ""
        ends = limit_text(campaign_life.limit.name, [campaign_life.limit.limit]) + wheel
        at = BEYOND
        if np.isfinite(campaign_life.distance):
            at = distance_text(campaign_life.distance)
            at += ", met" if campaign_life.met else ", extrapolated"
    return {
        "Reprofilings in the campaign": str(campaign_life.reprofilings),
        "Mean distance between them": distance_text(campaign_life.interval)
        if made
        else None,
        "Last distance between two": distance_text(campaign_life.last_interval)
        if made
        else None,
        "Loss of diameter each time": f"{plain(1e3 * campaign_life.loss)} mm"
        if made
        else None,
        **dict(zip(heads, values, strict=True)),
        "Life ends by": ends,
        "Distance to there": at,
        "Reprofilings until then": f"{campaign_life.expected:.0f}"
        if np.isfinite(campaign_life.expected)
        else None,
        "Assumed environment factor": environment_text(data),
    }


def sentences(datasets: Sequence[xr.Dataset], bands: Bands) -> list[str]:
    """State intervals and life with their bands; nothing without bands.

    Both are in inverse proportion to the environment factor, which is an assumption.
    """
    lines = []
    for data in datasets:
        role = role_of(data)
        for name, text in (
            ("reprofiling_interval", "Mean distance between reprofilings"),
            ("service_life", "Life of the wheels"),
        ):
            key = f"{role}_{name}"
            if bands is None or f"{key}_band" not in bands:
                continue
            middle = float(bands[key].values)
            low, _, high = (float(value) for value in bands[f"{key}_band"].values)
            if np.isfinite([low, middle]).all() and not np.isnan(high):
                ends = [1e-3 * low, 1e-3 * high]
                lines.append(
                    f"{text} ({role}): {estimate(1e-3 * middle)} km (90 %: "
                    f"{band_text(ends, 'km')})."
                )
    return lines
