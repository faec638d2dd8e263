"""Two campaigns of any kind side by side: reprofiling, life, wear by zone, wear."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from wearsim.damage.titles import law_title
from wearsim.errors import ResultError, brief, listed
from wearsim.profile.worn import WHEEL_ZONES
from wearsim.quantities import NOT_IN_SIGHT, QUANTITIES, kilometres
from wearsim.results.fatigue import crack_distances
from wearsim.results.file import loaded
from wearsim.results.limits import limits_met
from wearsim.results.service_life import service_life
from wearsim.results.zones import zone_table
from wearsim.translation.bands import quantiles_of, some_ended_before
from wearsim.translation.factors import FloatArray, at_distances

COLUMNS = ("quantity", "unit", "ratio")
"""Columns of the table that have names of their own."""

BAND_ENDS = (" 5%", " 95%")
"""Ends of the names of the columns with both ends of a band."""

NOT_REPROFILED = " not reprofiled"
"""End of the name of a column with the draws of a campaign that were not reprofiled."""

_NOT_MET = "not met"
_LIMIT = "limit of"  # begin of the rows of limits without reprofiling
_LOSS = "loss of diameter each time"
_LOSSES = {
    "wear": f"{_LOSS} by wear",
    "profile": f"{_LOSS} for the profile",
    "other_wheel": f"{_LOSS} for the partner",
    "cracks": f"{_LOSS} for cracks",
    "allowance": f"{_LOSS} as allowance",
}
"""Rows of the parts of the loss of diameter."""
_REPROFILING = {
    "mean distance between reprofilings": "km",
    "last distance between reprofilings": "km",
    _LOSS: "mm",
}
_INTERVALS = [name for name, unit in _REPROFILING.items() if unit == "km"]
Row = tuple[str, str, Any]


def side_by_side(
    a: str | Path | xr.Dataset,
    b: str | Path | xr.Dataset,
    *,
    names: tuple[str, str] = ("a", "b"),
) -> pd.DataFrame:
    """Service life and wear of two campaigns of any kind, side by side [km, mm, %].

    For two wheel profiles, two rules of maintenance, or two rigs. `compare` has their
    ratios over distance, depth and area; `translate` those of rig and field.

    Parameters
    ----------
    a, b : str, Path or Dataset
        Result files, or results as `wearsim.open_results` gives them.
    names : pair of str
        Heads of their columns.

    Returns
    -------
    DataFrame
        Columns quantity, unit, both names, and ratio, the first over the second; NaN
        where there is none. Life, reprofilings and their loss of diameter where the
        scenes have reprofiling; the first crack by each fatigue law that counts cycles,
        in both; worn area and mass of both wheels at equal distance; the shares of the
        zones in the wear; the environment factors, which all distances contain.

    Raises
    ------
    ResultError
        If a file is missing, damaged or not a whole result, or the names are equal, or
        one is that of a column: quantity, unit, ratio.

    Examples
    --------
    >>> import wearsim
    >>> files = "out/rig.nc", "out/field.nc"
    >>> table = wearsim.side_by_side(*files, names=("rig", "field"))
    >>> table.columns.tolist()
    ['quantity', 'unit', 'rig', 'field', 'ratio']
    """
    if len(set(names)) != 2:
        raise ResultError(f"names = {brief(repr(names))} must be two different names")
    if taken := [name for name in names if is_column(name)]:
        raise ResultError(column_fault(taken[0]))
    pair = loaded(a), loaded(b)
    common = float(min(data["distance"].values[-1] for data in pair))
    columns = [
        {(what, unit): value for what, unit, value in _rows(data, common)}
        for data in pair
    ]
    keys = _in_order(*columns)
    rows = []
    for what, unit in keys:
        values = [column.get((what, unit)) for column in columns]
        rows.append([what, unit, *values, _ratio(*values)])
    return pd.DataFrame(rows, columns=["quantity", "unit", *names, "ratio"])


def with_bands(
    table: pd.DataFrame,
    draws: Iterable[tuple[xr.Dataset, xr.Dataset]],
    *,
    nominal: pd.DataFrame,
    paired: bool,
) -> pd.DataFrame:
    """Add the bands of draws to a table of two campaigns.

    Parameters
    ----------
    table : DataFrame
        From `side_by_side`.
    draws : iterable of pairs of Dataset
        Results of both campaigns in each draw, at least `translation.bands.SCRAMBLES`.
    nominal : DataFrame
        From `side_by_side`: both campaigns by the contact models of the draws. Draws
        count by their ratio to it.
    paired : bool
        True if draws of one number have the same values of the uncertain inputs in
        both campaigns; only then the ratio has a band.

    Returns
    -------
    DataFrame
        The table with columns `NAME 5%` and `NAME 95%` of both names and of ratio, NaN
        where any draw has no number: a band of the others would be biased. The distance
        to an event beyond the end of a draw is infinite: to the end of a life or a
        first crack that is not in sight, a limit that is not met, a reprofiling that
        was not due. A draw that ended before others met the limit or were reprofiled
        has no such distance. A column `NAME not reprofiled` states how many draws were
        not reprofiled, such as "2 of 16", where any is.
    """
    a, b = table.columns[2:4]
    keys = ["quantity", "unit"]
    rows = pd.MultiIndex.from_frame(table[keys])
    drawn: dict[str, list[FloatArray]] = {name: [] for name in (a, b, "ratio")}
    ends: dict[str, list[float]] = {name: [] for name in (a, b)}
    for pair in draws:
        draw = side_by_side(*pair, names=(a, b)).set_index(keys).reindex(rows)
        drawn["ratio"].append(_numbers(draw["ratio"]))
        for name, data in zip((a, b), pair, strict=True):
            drawn[name].append(_with_events_beyond(draw[name], data))
            ends[name].append(1e-3 * float(data["distance"].values[-1]))
    by_draws = nominal.set_index(keys).reindex(rows)
    banded = table.copy()
    for name in (a, b, "ratio"):
        numbers, nominal_numbers = _numbers(table[name]), _numbers(by_draws[name])
        same = (numbers == nominal_numbers) | (
            np.isnan(numbers) & np.isnan(nominal_numbers)
        )
        factor = np.where(
            same,
            1.0,
            numbers / np.where(nominal_numbers == 0.0, np.nan, nominal_numbers),
        )
        values = np.stack(drawn[name])
        if name == "ratio":
            values = values if paired else np.full_like(values, np.nan)
        else:
            observed = _between_reprofilings(rows) | _limits(rows)
            values[:, observed & some_ended_before(values, ends[name])] = np.nan
            counts = np.where(_between_reprofilings(rows), np.isinf(values).sum(0), 0)
            if counts.any():
                banded[f"{name}{NOT_REPROFILED}"] = [
                    f"{count} of {len(values)}" if count else "" for count in counts
                ]
        low, _, high = quantiles_of(factor * values)[0]
        for end, value in zip(BAND_ENDS, (low, high), strict=True):
            banded[f"{name}{end}"] = value
    return banded


def _with_events_beyond(column: pd.Series, data: xr.Dataset) -> FloatArray:
    """Numbers of a draw, infinite for distances to events beyond its end."""
    values = _numbers(column)
    beyond = column.isin([NOT_IN_SIGHT, _NOT_MET]).to_numpy()
    if "last_reprofiling" in data:
        beyond = beyond | np.isnan(values) & _between_reprofilings(column.index)
    return np.where(beyond, np.inf, values)


def _between_reprofilings(rows: pd.Index) -> np.ndarray:
    """Return True for the rows of distances between reprofilings."""
    return rows.get_level_values("quantity").isin(_INTERVALS)


def _limits(rows: pd.Index) -> np.ndarray:
    """Return True for the rows of limits."""
    return rows.get_level_values("quantity").str.startswith(_LIMIT)


def not_reprofiled(table: pd.DataFrame) -> list[str]:
    """State the draws of each campaign that were not reprofiled, a sentence each."""
    sentences = []
    for name in table.columns[2:4]:
        counts = [str(count) for count in table.get(f"{name}{NOT_REPROFILED}", ())]
        if not (count := next(filter(None, counts), "")):
            continue
        text = f"{name}: {count} draws were not reprofiled in the distance run"
        sentences.append(f"{text} and count as {NOT_IN_SIGHT}.")
    return sentences


def band_of(row: Mapping[Hashable, Any], name: str) -> tuple[float, float] | None:
    """Give the ends of the band of a name in a row of `with_bands`, None without."""
    low, high = (float(row.get(f"{name}{end}", np.nan)) for end in BAND_ENDS)
    return None if np.isnan([low, high]).any() else (low, high)


def _numbers(column: pd.Series) -> FloatArray:
    """Numbers of a column, NaN in place of texts and what is missing."""
    return np.array(
        [value if isinstance(value, int | float) else np.nan for value in column],
        dtype=np.float64,
    )


def is_column(name: str) -> bool:
    """Return True for a name that a column of the table has, with bands or without."""
    return name in COLUMNS or name.endswith((NOT_REPROFILED, *BAND_ENDS))


def column_fault(name: str) -> str:
    """Message on a name of a campaign that is that of a column."""
    return (
        f'"{name}" is the name of a column of the table ({listed(COLUMNS)}, and those '
        f'that end in "{NOT_REPROFILED.strip()}", "5%" or "95%"); give the campaign '
        "another name"
    )


def _in_order(
    first: Iterable[tuple[str, str]], second: Iterable[tuple[str, str]]
) -> list[tuple[str, str]]:
    """Keys of both, those of the second alone behind the one they follow there."""
    keys = list(first)
    place = 0
    for key in second:
        if key not in keys:
            keys.insert(place, key)
        place = keys.index(key) + 1
    return keys


def _ratio(a: Any, b: Any) -> float:
    numbers = [value for value in (a, b) if isinstance(value, int | float)]
    return a / b if len(numbers) == 2 and b != 0.0 else np.nan


def _rows(data: xr.Dataset, common: float) -> Iterator[Row]:
    """Rows of a campaign; wear at a distance that both have run [m]."""
    yield from _life_rows(data)
    for law, distance in crack_distances(data).items():
        first = float(distance.min())
        value = 1e-3 * first if np.isfinite(first) else NOT_IN_SIGHT
        yield f"first crack by {law_title(law)}", "km", value
    end = f"at {kilometres(common)}"
    for name in ("worn_area", "worn_mass"):
        values = at_distances(
            data["distance"].values, data[name].values, np.array([common])
        )
        quantity = QUANTITIES[name]
        total = quantity.shown_factor * float(values.sum())
        yield f"{name.replace('_', ' ')} {end}", quantity.shown_unit, total
    shares = zone_table(data)
    if not shares.empty:
        for zone in WHEEL_ZONES:
            share = sum(float(shares[side][zone].sum()) for side in ("right", "left"))
            yield f"share of the wear: {zone}", "%", 100.0 * share
    acts = data["environment"].values[data["weight"].values > 0.0]
    if acts.size:
        low, high = float(acts.min()), float(acts.max())
        factor = f"{low:g}" if low == high else f"{low:g} to {high:g}"
        yield "assumed environment factor", "", factor


def _life_rows(data: xr.Dataset) -> Iterator[Row]:
    """Rows on life and reprofilings, or on each limit without reprofiling."""
    life = service_life(data)
    if life is None:
        for limit in limits_met(data):
            met = [at for at in limit.distance if at is not None]
            name = limit.name.replace("_", " ")
            yield f"{_LIMIT} {name}", "km", 1e-3 * min(met) if met else _NOT_MET
        return
    if life.limit is not None:
        finite = np.isfinite(life.distance)
        yield "life", "km", 1e-3 * life.distance if finite else NOT_IN_SIGHT
        yield "life ends by", "", life.limit.name.replace("_", " ")
        if finite:
            yield "end of life", "", "met" if life.met else "extrapolated"
    if np.isfinite(life.expected):
        yield "reprofilings until the end of life", "", int(life.expected)
    if not life.reprofilings:
        return
    values = (1e-3 * life.interval, 1e-3 * life.last_interval, 1e3 * life.loss)
    for (name, unit), value in zip(_REPROFILING.items(), values, strict=True):
        yield name, unit, value
    for part, name in _LOSSES.items():
        yield name, "mm", 1e3 * life.loss * life.shares[part]
