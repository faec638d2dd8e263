"""Limits of a campaign: the limited measures and the distance at which each is met."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearsim.damage.fatigue import counts_cycles
from wearsim.results.checks import reprofiled_rows
from wearsim.results.schema import FILL_FLOAT

if TYPE_CHECKING:
    import xarray as xr

LIMITED: Mapping[str, float] = {
    "max_wear_depth": 1.0,
    "tread_wear": 1.0,
    "root_wear": 1.0,
    "flange_wear": 1.0,
    "flange_height": 1.0,
    "flange_thickness": -1.0,
    "flange_gradient": -1.0,
    "hollowing": 1.0,
    "equivalent_conicity": 1.0,
    "fatigue_damage": 1.0,
    "wheel_diameter": -1.0,
}
"""Measures that may have a limit: 1 for an upper limit, -1 for a lower one."""

_ATTRIBUTE = "limit_"
SIDES = {1: ("",), 2: ("_right", "_left")}
END = "end_at_limit"
REPROFILED_AT = "reprofiling_limits"
"""Attribute that lists the limits at which wheels are reprofiled, space-separated."""
REPROFILED_PLACES = "reprofiling_distances"
"""Attribute that lists the reprofiling distances, space-separated [m]."""


def attributes_of(limits: Mapping[str, float], end: bool) -> dict[str, float | int]:
    """Return global attributes that state limits by measure [SI].

    They also state whether the first limit met ends the campaign.
    """
    return {
        **{_ATTRIBUTE + name: value for name, value in limits.items()},
        **({END: 1} if end else {}),
    }


def limits_of(attributes: Mapping[str, Any]) -> dict[str, float]:
    """Limits stated by global attributes, in the order of `LIMITED` [SI]."""
    return {
        name: float(attributes[_ATTRIBUTE + name])
        for name in LIMITED
        if _ATTRIBUTE + name in attributes
    }


def ending_limits(attributes: Mapping[str, Any]) -> dict[str, float]:
    """Return the limits that end a campaign, without those of reprofiling.

    The result is empty if the campaign does not end at limits.
    """
    if END not in attributes:
        return {}
    others = str(attributes.get(REPROFILED_AT, "")).split()
    return {
        name: value
        for name, value in limits_of(attributes).items()
        if name not in others
    }


def first_met(
    row: Mapping[str, NDArray[np.float64]],
    limits: Mapping[str, float],
    laws: Sequence[str] = (),
) -> str | None:
    """Name the first limit that a row has met on either wheel, None if there is none.

    Missing values meet no limit, nor does the damage of those of the row's fatigue
    `laws` that count no cycles.
    """
    for name, limit in limits.items():
        values = worst_of(name, row[name], laws)
        if (LIMITED[name] * (values[_defined(values)] - limit) >= 0.0).any():
            return name
    return None


def met_at(
    distance: NDArray[np.float64], values: NDArray[np.float64], name: str, limit: float
) -> float | None:
    """Distance [m] at which a measure first meets a limit, or None.

    The rows are arrays (n,). The distance is interpolated linearly between the rows
    before and after, or is that of the first row if it already meets the limit. Missing
    values (fill value or NaN) are skipped.
    """
    defined = _defined(values)
    run, over = distance[defined], LIMITED[name] * (values[defined] - limit)
    met = np.flatnonzero(over >= 0.0)
    if met.size == 0:
        return None
    at = int(met[0])
    if at == 0:
        return float(run[0])
    return float(
        run[at - 1] + (run[at] - run[at - 1]) * over[at - 1] / (over[at - 1] - over[at])
    )


def first_distance(
    distance: NDArray[np.float64],
    rows: Sequence[Mapping[str, NDArray[np.float64]]],
    limits: Mapping[str, float],
    laws: Sequence[str] = (),
) -> float | None:
    """Distance [m] at which rows at distances (n,) [m] first meet a limit, or None.

    It is interpolated, see `met_at`; `laws` as for `first_met`.
    """
    worst = {
        name: np.stack([worst_of(name, row[name], laws) for row in rows])
        for name in limits
    }
    met = _met(distance, worst, limits)
    places = [at for limit_met in met for at in limit_met.distance if at is not None]
    return min(places, default=None)


class LimitMet(NamedTuple):
    """Limit of a measure [SI] and the distances at which it was met [m].

    They are those of the right and the left wheel, or of the wheelset.
    """

    name: str
    limit: float
    distance: tuple[float | None, ...]  # None where it was not met


def limits_met(dataset: xr.Dataset) -> tuple[LimitMet, ...]:
    """Limits of a campaign, finished or not, and the distances at which they were met.

    They are in the order of `LIMITED`.
    """
    limits = limits_of(dataset.attrs)
    return _met(
        dataset["distance"].values,
        {name: _worst(dataset, name) for name in limits},
        limits,
    )


def _worst(dataset: xr.Dataset, name: str) -> NDArray[np.float64]:
    laws = laws_of(dataset)
    return np.stack([worst_of(name, row, laws) for row in dataset[name].values])


def distances_to(
    dataset: xr.Dataset, limit: LimitMet
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Distance at which each side, or the wheelset, meets a limit [m]; True if met.

    If a limit is not yet met, the distance follows from the mean rate over the last
    half of the distance, and where wheels are reprofiled from the mean change per
    reprofiling. It is infinite beyond ten times the distance run, and where nothing
    approaches the limit.
    """
    run, values = dataset["distance"].values, _worst(dataset, limit.name)
    if "last_reprofiling" in dataset:
        at = _through_reprofilings(dataset, limit, run, values)
    else:
        at = _at_mean_rate(run, values, limit.name, limit.limit)
    met = np.array([distance is not None for distance in limit.distance])
    met_distance = np.array([distance or 0.0 for distance in limit.distance])
    return np.where(met, met_distance, np.where(at > 10.0 * run[-1], np.inf, at)), met


def _at_mean_rate(
    run: NDArray[np.float64], values: NDArray[np.float64], name: str, limit: float
) -> NDArray[np.float64]:
    """Distance (sides,) to a limit at the mean rate of the last half of the rows [m].

    It is infinite if the limit is not approached.
    """
    half = int(np.argmin(np.abs(run - 0.5 * (run[0] + run[-1]))))
    gained, left = (
        LIMITED[name] * d for d in (values[-1] - values[half], limit - values[-1])
    )
    steps = np.divide(left, gained, out=np.full(left.shape, np.inf), where=gained > 0.0)
    at = run[-1] + (run[-1] - run[half]) * np.minimum(steps, 1e300)
    return np.where(gained > 0.0, at, np.inf)


def _through_reprofilings(
    dataset: xr.Dataset,
    limit: LimitMet,
    run: NDArray[np.float64],
    values: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Distance (sides,) to a limit that is not met, for wheels with reprofiling [m].

    It is infinite if the limit is not approached. The last span between two
    reprofilings is repeated, shifted by the mean change per reprofiling. The first span
    is repeated for the diameter alone, because the first wheel may differ from the
    reprofiled one. Until there is a span to repeat, the present one is extrapolated to
    its end.
    """
    begins = [0, *reprofiled_rows(dataset)]
    if len(begins) > 1 and run[begins[1]] == run[0]:  # reprofiled before the first step
        del begins[0]
    if len(begins) < (2 if limit.name == "wheel_diameter" else 3):
        span = slice(begins[-1], None)
        within = _at_mean_rate(run[span], values[span], limit.name, limit.limit)
        return np.where(within <= _next_reprofiling(dataset, span), within, np.inf)
    *before, last = begins if len(begins) == 2 else begins[1:]
    first = min(before, key=lambda row: abs(run[row] - 0.5 * run[last]))
    span = slice(before[-1], last)
    way = run[span] - run[before[-1]]
    change = (values[last] - values[first]) / (run[last] - run[first]) * way[-1]
    done = min(run[-1] - run[last], way[-1])
    at = [
        _in_later_spans(way, side_values - side_values[0], done, now, later, limit)
        for side_values, now, later in zip(
            values[span].T, values[-1], change, strict=True
        )
    ]
    return run[-1] + np.array(at)


def _in_later_spans(
    way: NDArray[np.float64],
    shape: NDArray[np.float64],
    done: float,
    now: float,
    change: float,
    limit: LimitMet,
) -> float:
    """Distance to a limit in later spans, infinite if none of them meets it [m].

    Each span is `way` (n,) long and changes a measure by `shape` (n,); the next one
    begins `change` further. The present span is `done` long and has brought the measure
    to the value of `now`.
    """
    begin = now - np.interp(done, way, shape)
    remaining = np.append(done, way[way > done])
    met = met_at(
        remaining - done,
        begin + np.interp(remaining, way, shape),
        limit.name,
        limit.limit,
    )
    if met is not None:
        return met
    short = LIMITED[limit.name] * (limit.limit - begin - shape)
    least = 1e-12 * max(abs(limit.limit), 1e-12)  # smaller changes are rounding
    if not LIMITED[limit.name] * change > least or not np.isfinite(short).any():
        return np.inf
    spans = max(1, math.ceil(np.nanmin(short) / abs(change)))
    met = met_at(way, begin + spans * change + shape, limit.name, limit.limit)
    # If rounding keeps the span short of the limit in the last bit, the limit is met at
    # the nearest point.
    place = way[np.nanargmin(short)] if met is None else met
    return float(spans * way[-1] - done + place)


def _next_reprofiling(dataset: xr.Dataset, span: slice) -> float:
    """Distance of the next reprofiling at the rates of the present span [m].

    It is infinite if no limit is approached.
    """
    run, limits = dataset["distance"].values, limits_of(dataset.attrs)
    places = map(float, str(dataset.attrs.get(REPROFILED_PLACES, "")).split())
    ahead = [place for place in places if place > run[-1]]
    for name in str(dataset.attrs.get(REPROFILED_AT, "")).split():
        at = _at_mean_rate(run[span], _worst(dataset, name)[span], name, limits[name])
        ahead.append(float(at.min()))
    return min(ahead, default=np.inf)


def met_attributes(
    rows: Iterable[Mapping[str, NDArray[np.float64]]],
    limits: Mapping[str, float],
    laws: Sequence[str] = (),
) -> dict[str, float]:
    """Global attributes that state where the rows of a result file met limits.

    `limit_<measure>_met_right`, `_left`, or `limit_<measure>_met` for a measure of the
    wheelset [m]; limits that are not met have none. `laws` as for `first_met`.
    """
    if not limits:
        return {}
    kept = [
        (row["distance"], *(worst_of(name, row[name], laws) for name in limits))
        for row in rows
    ]
    distance, *worst = (np.stack(column) for column in zip(*kept, strict=True))
    met = _met(distance, dict(zip(limits, worst, strict=True)), limits)
    return {
        f"{_ATTRIBUTE}{limit_met.name}_met{side}": at
        for limit_met in met
        for side, at in zip(
            SIDES[len(limit_met.distance)], limit_met.distance, strict=True
        )
        if at is not None
    }


def _met(
    distance: NDArray[np.float64],
    worst: Mapping[str, NDArray[np.float64]],
    limits: Mapping[str, float],
) -> tuple[LimitMet, ...]:
    return tuple(
        LimitMet(
            name,
            limit,
            tuple(met_at(distance, side, name, limit) for side in worst[name].T),
        )
        for name, limit in limits.items()
    )


def laws_of(dataset: xr.Dataset) -> tuple[str, ...]:
    """Return the names of the fatigue laws of a campaign."""
    return (
        tuple(str(law) for law in dataset["fatigue_name"].values)
        if "fatigue_name" in dataset
        else ()
    )


def worst_of(
    name: str, values: NDArray[np.float64], laws: Sequence[str]
) -> NDArray[np.float64]:
    """Return the value of each wheel, or of the wheelset.

    Of values along the profile, and by law, it is the worst.
    """
    values = np.atleast_1d(values)
    if name == "fatigue_damage":
        values = values[:, [k for k, law in enumerate(laws) if counts_cycles(law)]]
        if values.size == 0:
            return np.full(len(values), np.nan)
    if values.ndim == 1:
        return values
    flat = values.reshape(len(values), -1)
    worst: NDArray[np.float64] = (
        flat.max(axis=1) if LIMITED[name] > 0.0 else flat.min(axis=1)
    )
    return worst


def _defined(values: NDArray[np.float64]) -> NDArray[np.bool_]:
    defined: NDArray[np.bool_] = np.isfinite(values) & (values != FILL_FLOAT)
    return defined
