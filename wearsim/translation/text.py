"""A comparison of rig and field as text: the answer in a few lines, and all tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from wearsim.quantities import kilometres
from wearsim.texts import WIDTH, text_table, wrapped
from wearsim.translation.bands import PER_KM, QUANTILES
from wearsim.translation.compare import CAMPAIGN
from wearsim.translation.translate import BASIS

_SHORT = {"largest wear depth": "depth", "worn area": "area"}
"""Measures of wear of `wearsim.translation.compare.answers` in one word."""
_FACTORS = {"max_wear_depth": "largest depth", "worn_area": "worn area"}
"""Rows of the table of factors."""
_BASES = ("equal distance", "equal depth", "equal area")
_PLACE = {"rig": "on the rig", "field": "in the field"}


def answer_lines(
    factors: xr.Dataset,
    rows: pd.DataFrame,
    bands: pd.DataFrame,
    ends: Mapping[str, float],
    answers: Mapping[str, pd.DataFrame],
) -> list[str]:
    """Answer of a comparison in lines of at most `WIDTH` columns.

    Parameters
    ----------
    factors : Dataset
        From `wearsim.translation.translate.translate`.
    rows, bands : DataFrame
        From `table` and `band_table`; bands may be empty.
    ends : dict
        Distance that each campaign has run [km], by "rig" and "field".
    answers : dict
        Of each campaign whose distance is asked for, the result of `compare.answers`.

    Returns
    -------
    list of str
        Equivalent distance, distances run, answers, bands, factors and causes.
    """
    depth = 1e3 * float(factors["worn_depth"].values[1, -1, 0])
    at = rows.set_index(["basis", "variable"])
    lines = [
        wrapped(_equivalent(at, depth)),
        "run: "
        + ", ".join(f"{role} {kilometres(1e3 * km)}" for role, km in ends.items()),
    ]
    for campaign, equivalents in answers.items():
        lines.append(wrapped(_equivalent_sentence(equivalents, campaign, ends)))
    if len(bands):
        lines += [wrapped(line) for line in _band_lines(bands)]
    head = ["factor rig/field", *_BASES]
    table = [
        [name, *(_number(at["factor"][basis, variable]) for basis in BASIS)]
        for variable, name in _FACTORS.items()
    ]
    lines += text_table([head, *([f"  {row[0]}", *row[1:]] for row in table)])
    if "cause_factor" in factors:
        lines.append(wrapped(_product(factors)))
    return lines


def _equivalent(at: pd.DataFrame, depth: float) -> str:
    """Distance in the field of 1 km on the rig, by depth and by area."""
    by_depth, by_area = (
        1.0 / at["factor"][basis, "distance_run"] for basis in BASIS[1:]
    )
    if not np.isfinite(by_depth):
        status = at["status"][BASIS[1], "distance_run"].replace("_", " ")
        return f"no equivalent distance: no equal wear of rig and field ({status})"
    area = f"{_number(by_area)} by worn area" if np.isfinite(by_area) else ""
    reached = f"equal depth {_number(depth)} mm"
    reason = "; ".join(filter(None, [reached, area]))
    return f"1 km on the rig = {_number(by_depth)} km in the field ({reason})"


def _equivalent_sentence(
    equivalents: pd.DataFrame, campaign: str, ends: Mapping[str, float]
) -> str:
    """Sentence on a distance of one campaign and that of the other with equal wear."""
    counterpart = CAMPAIGN[1 - CAMPAIGN.index(campaign)]
    distance_km = float(equivalents[f"{campaign}_km"].iloc[0])
    parts = []
    for row in equivalents.to_dict("records"):
        by = _SHORT[row["quantity"]]
        if row[f"{campaign}_km_missing"] > 0.0:
            longer = _missing_distances(row, campaign, counterpart, ends)
            parts.append(f"by {by} no answer: run {longer} longer")
        else:
            km = kilometres(1e3 * row[f"{counterpart}_km"], 4)
            parts.append(f"{km} {_PLACE[counterpart]} by {by}")
    sign = ":" if "no answer" in parts[0] else " ="
    return (
        f"{kilometres(1e3 * distance_km, 10)} {_PLACE[campaign]}{sign} "
        f"{'; '.join(parts)}"
    )


def _missing_distances(
    row: Mapping[Any, Any], campaign: str, counterpart: str, ends: Mapping[str, float]
) -> str:
    """Distances that the campaigns lack, of the other one at its mean rate so far."""
    distance_km, reach = row[f"{campaign}_km"], row[f"{campaign}_km_within_reach"]
    lacks = []
    if distance_km > ends[campaign]:
        lacks.append(
            f"the {campaign} {kilometres(1e3 * (distance_km - ends[campaign]), 10)}"
        )
    if reach < ends[campaign] and reach > 0.0:  # the other one ends before
        more = (distance_km - reach) * ends[counterpart] / reach
        lacks.append(f"the {counterpart} about {kilometres(1e3 * more, 2)}")
    return " and ".join(lacks) or f"the {counterpart}"


def _band_lines(bands: pd.DataFrame) -> Iterator[str]:
    """Bands of the equivalent distance, or of the factors where there is none."""
    per_km = bands[bands["variable"].isin(PER_KM)]
    for row in (per_km if len(per_km) else bands).head(2).to_dict("records"):
        low, high = (_number(row[f"{q:.0%}"]) for q in (QUANTILES[0], QUANTILES[-1]))
        span = f"{low} to {high}"
        why = f", decided by {row['decided by']}" if row["decided by"] else ""
        yield f"90 % of the draws: {span}, {row['quantity']}, {row['where']}{why}"


def _product(factors: xr.Dataset) -> str:
    """Causes at the end as a product, largest first; those that read 1.00 left out."""
    parts = factors["cause_factor"].values[-1]
    total_factor = _number(float(factors["rate_factor"].values[-1]))
    names = [_short_cause(str(name)) for name in factors["cause_name"].values]
    order = np.argsort(-np.abs(np.log(parts)), kind="stable")
    texts = [f"{names[k]} {parts[k]:.2f}" for k in order if f"{parts[k]:.2f}" != "1.00"]
    product = " x ".join(texts) or "none"
    return f"causes: {product} = {total_factor} (worn area per km at equal depth)"


def _short_cause(name: str) -> str:
    return name.split(" (")[0].replace("roller curvature: ", "roller ")


def all_tables(tables: Mapping[str, pd.DataFrame]) -> str:
    """All tables of a comparison by their titles, wide ones in blocks of columns."""
    return "\n\n".join(
        f"{title}:\n{_text(frame)}" for title, frame in tables.items() if len(frame)
    )


def factor_tables(rows: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Values and factors where both campaigns end, a table for each basis."""
    tables = {}
    for basis, part in rows.groupby("basis", sort=False):
        units = [f" [{unit}]" if unit not in ("", "1") else "" for unit in part["unit"]]
        names = part["quantity"].str.removesuffix(", collective mean") + units
        frame = part[[*CAMPAIGN, "factor"]].set_axis(names.rename(None), axis=0)
        tables[f"Rig over field at {basis}, contact as means of the collective"] = frame
    return tables


def by_shift(points: pd.DataFrame) -> pd.DataFrame:
    """Factors of one state, a row a quantity and wheel, a column an operating point."""
    names = points.drop_duplicates(["variable", "wheel"])
    names = names.sort_values("wheel", ascending=False, kind="stable")
    factor = points.set_index(["variable", "wheel"])["factor"]
    # labels and shifts may be given twice: only their order distinguishes points
    first = points["variable"] == names["variable"].iloc[0]
    places = points[first & (points["wheel"] == "right")]
    twice = bool(places["shift"].duplicated().any())
    keys = list(zip(names["variable"], names["wheel"], strict=True))
    quantities = names["variable"].str.removesuffix("_point").str.replace("_", " ")
    return pd.DataFrame(
        [factor.loc[[key]].to_numpy() for key in keys],
        index=[quantities, names["wheel"]],
        columns=list(places["point"]) if twice else [f"{s:g}" for s in places["shift"]],
    ).rename_axis(index=["", ""])


def _text(frame: pd.DataFrame) -> str:
    text: str = frame.to_string(
        index=not isinstance(frame.index, pd.RangeIndex),
        na_rep="-",
        float_format=_number,
        line_width=WIDTH,
    )
    return "\n".join(line.rstrip() for line in text.splitlines() if line.strip())


def _number(value: float, digits: int = 3) -> str:
    """Write a number with some significant digits, from 1000 on in full."""
    if not np.isfinite(value):
        return "-"
    if abs(value) >= 10.0**digits:
        return f"{value:.0f}"
    return f"{value:.{digits}g}"


def undefined_lines(rows: pd.DataFrame) -> list[str]:
    """Quantities without factor, with the reason."""
    missing = rows[rows["status"] != "defined"]
    reasons = missing.groupby("status", sort=False)["quantity"].unique()
    return [
        wrapped(f"no factor ({str(status).replace('_', ' ')}): {', '.join(names)}")
        for status, names in reasons.items()
    ]
