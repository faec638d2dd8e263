"""Service life of wheels that are reprofiled: distances, loss of diameter, its end.

The loss of diameter from one reprofiling to the next has five parts, which add up:

- *wear*: at the running circle, since the wheel was new or last reprofiled;
- *profile*: cut so that the worn wheel contains its template;
- *other wheel*: cut so that both wheels of the axle keep one diameter;
- *cracks*: cut below the cracks of fatigue laws that state a crack depth, where the
  scene reprofiles at a limit of damage;
- *allowance*: the least depth of a cut, `cut_mm` in [campaign.reprofiling].
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from wearsim.profile.reprofiling import Reprofiling, reprofile
from wearsim.profile.shape import Profile
from wearsim.results.checks import reprofiled_rows
from wearsim.results.file import loaded
from wearsim.results.limits import (
    REPROFILED_AT,
    REPROFILED_PLACES,
    LimitMet,
    distances_to,
    first_met,
    laws_of,
    limits_met,
    limits_of,
)

if TYPE_CHECKING:
    import xarray as xr

LEAST_CUT = "reprofiling_least_cut"
"""Attribute that states the allowance of each reprofiling [m]."""

AT_DISTANCE = "distance"
"""Cause of a reprofiling at a prescribed distance."""

PARTS = ("wear", "profile", "other_wheel", "cracks", "allowance")
"""Parts of the loss of diameter, in order."""

_SIDES = ("right", "left")
_ROUNDING = 1e-9  # of a cut [m], and of a distance relative to it


@dataclass(frozen=True)
class ServiceLife:
    """Reprofilings of a wheelset, and the distance at which its life ends.

    Parameters
    ----------
    reprofilings : int
        Number in the campaign.
    interval : float
        Mean distance between reprofilings, the first one counted from the start [m].
    last_interval : float
        Distance between the last two [m].
    at_limits : bool
        True if a limit was the cause of one of them: the campaign reprofiles at the end
        of the wear step in which the limit is met, and interval and wear go beyond it
        by a part of this step.
    loss : float
        Mean loss of diameter from one reprofiling to the next, of both wheels [m].
    shares : dict of str to float
        Share of each of `PARTS` in the loss of diameter [-].
    environment : (float, float)
        Smallest and largest environment factor on the wear [-].
    limit : LimitMet or None
        Limit that ends the life first; None if the scene states none but those at
        which the wheels are reprofiled.
    wheel : str
        Wheel that meets it first, "" for a limit of the wheelset.
    distance : float
        Where the limit is met; infinite if it is not in sight, NaN without limit [m].
    met : bool
        True if the campaign met it, False if the distance is extrapolated.
    expected : float
        Number of reprofilings up to there; NaN if the life is unknown.
    """

    reprofilings: int
    interval: float
    last_interval: float
    at_limits: bool
    loss: float
    shares: dict[str, float]
    environment: tuple[float, float]
    limit: LimitMet | None
    wheel: str
    distance: float
    met: bool
    expected: float


def reprofilings(results: str | Path | xr.Dataset) -> pd.DataFrame:
    """Distance and loss of diameter of each reprofiling and wheel [km, mm].

    Parameters
    ----------
    results : str, Path or Dataset
        Result file of a campaign, finished or not, or a result as
        `wearsim.open_results` gives it.

    Returns
    -------
    DataFrame
        A row for each reprofiling and wheel, none without reprofilings: `reprofiling`,
        its number; `wheel`; `distance_km`; `interval_km`, the distance since the one
        before or the start; `cause`, the measure that met its limit, or "distance";
        `diameter_before_mm` and `diameter_after_mm` at the running circle; the loss of
        diameter since the one before, `loss_mm`, and its parts: `wear_mm` of the
        running circle, and the cut of the lathe for the template (`profile_mm`), for
        the diameter of the other wheel (`other_wheel_mm`), for cracks (`cracks_mm`)
        and as allowance (`allowance_mm`); `tightest_place_y_mm`, the place where the
        worn wheel just contains its template.

    Raises
    ------
    ResultError
        If the file is missing, damaged or not a whole result of this version of
        wearsim.

    Notes
    -----
    Cracks are cut where the scene reprofiles at a limit of damage, below the cracks of
    fatigue laws that state a crack depth.

    Examples
    --------
    >>> import wearsim
    >>> wearsim.reprofilings("out/rig.nc").empty
    True
    """
    return reprofiling_table(loaded(results))


def reprofiling_table(dataset: xr.Dataset) -> pd.DataFrame:
    """Tabulate the reprofilings of a loaded result, see `reprofilings`."""
    rows = reprofiled_rows(dataset)
    entries = []
    for number, (start, row) in enumerate(itertools.pairwise([0, *rows]), start=1):
        run = dataset["distance"].values[[start, row]]
        cuts = _cuts(dataset, row)
        diameter = dataset["wheel_diameter"].values
        for wheel, side in enumerate(_SIDES):
            new, before, after = diameter[[start, row - 1, row], wheel]
            loss = {"wear": new - before, **cuts[wheel]}
            loss["profile"] += before - after
            entries.append(
                {
                    "reprofiling": number,
                    "wheel": side,
                    "distance_km": 1e-3 * run[1],
                    "interval_km": 1e-3 * (run[1] - run[0]),
                    "cause": _cause(dataset, row - 1),
                    "diameter_before_mm": 1e3 * before,
                    "diameter_after_mm": 1e3 * after,
                    **{f"{part}_mm": 1e3 * loss[part] for part in PARTS},
                    "loss_mm": 1e3 * (new - after),
                    "tightest_place_y_mm": 1e3 * cuts[wheel]["place"],
                }
            )
    columns = [
        *("reprofiling", "wheel", "distance_km", "interval_km", "cause"),
        *("diameter_before_mm", "diameter_after_mm"),
        *(f"{part}_mm" for part in PARTS),
        *("loss_mm", "tightest_place_y_mm"),
    ]
    return pd.DataFrame(entries, columns=columns)


def _cuts(dataset: xr.Dataset, row: int) -> list[dict[str, float]]:
    """Parts of the cut of each wheel in diameter, to be taken off the whole cut [m].

    `profile` is what the other parts leave, and `place` the y of the tightest place.
    """
    needs = [_reprofiling(dataset, row, wheel) for wheel in (0, 1)]
    # Both wheels were cut to one diameter: what neither of them needs is the
    # allowance, and what cracks need beyond it.
    spare = max(-max(need.depth for need in needs), 0.0)
    allowance = min(float(dataset.attrs.get(LEAST_CUT, 0.0)), spare)
    cracks = spare - allowance if spare - allowance > _ROUNDING else 0.0
    parts = []
    for need in needs:
        excess = max(-need.depth, 0.0) - spare
        part = {
            "other_wheel": 2.0 * (excess if excess > _ROUNDING else 0.0),
            "cracks": 2.0 * cracks,
            "allowance": 2.0 * allowance,
        }
        parts.append({"profile": -sum(part.values()), **part, "place": need.place})
    return parts


def _reprofiling(dataset: xr.Dataset, row: int, wheel: int) -> Reprofiling:
    """Reprofile a worn wheel to the profile it had after its reprofiling.

    Minus its depth is the radius removed beyond what that profile needed [m].
    """
    worn, template = (
        Profile(
            _SIDES[wheel],
            "wheel",
            *(dataset[f"profile_{axis}"].values[at, wheel] for axis in "yz"),
        )
        for at in (row - 1, row)
    )
    return reprofile(worn, template)


def _cause(dataset: xr.Dataset, row: int) -> str:
    """Name the limit at which the wheels of a row are reprofiled, or the distance."""
    places = map(float, str(dataset.attrs.get(REPROFILED_PLACES, "")).split())
    run = float(dataset["distance"].values[row])
    if any(math.isclose(run, place, rel_tol=_ROUNDING) for place in places):
        return AT_DISTANCE
    names = str(dataset.attrs.get(REPROFILED_AT, "")).split()
    limits = {
        name: limit for name, limit in limits_of(dataset.attrs).items() if name in names
    }
    values = {name: dataset[name].values[row] for name in limits}
    return first_met(values, limits, laws_of(dataset)) or AT_DISTANCE


def service_life(dataset: xr.Dataset) -> ServiceLife | None:
    """Mean distance between reprofilings, and the distance at which life ends [m].

    Parameters
    ----------
    dataset : Dataset
        Result of a campaign, loaded.

    Returns
    -------
    ServiceLife or None
        None for campaigns whose scene has no reprofiling.

    Notes
    -----
    Life ends at the first limit at which the wheels are not reprofiled, such as the
    least diameter. Where the campaign does not meet it, the last span between two
    reprofilings is repeated, each shifted by the mean change per reprofiling
    (`wearsim.results.limits.distances_to`).
    """
    if "last_reprofiling" not in dataset:
        return None
    table = reprofiling_table(dataset)
    intervals = table["interval_km"].to_numpy()[::2] * 1e3
    cycles = intervals[intervals > 0.0]
    loss = np.array([table[f"{part}_mm"].sum() for part in PARTS]) * 1e-3
    shares = loss / loss.sum() if loss.sum() > 0.0 else np.full(loss.shape, np.nan)
    acts = dataset["environment"].values[dataset["weight"].values > 0.0]
    limit, wheel, distance, met = _life_end(dataset)
    mean = float(cycles.mean()) if cycles.size else np.nan
    last = float(table["distance_km"].max()) * 1e3 if len(table) else 0.0
    expected = np.nan
    if np.isfinite(distance) and cycles.size:
        reprofiling_count = np.sum(np.cumsum(intervals) < distance * (1.0 - _ROUNDING))
        ahead = np.ceil((distance - last) / cycles[-1] - 1e-6) - 1.0
        expected = float(
            reprofiling_count if met else reprofiling_count + max(ahead, 0.0)
        )
    return ServiceLife(
        reprofilings=len(intervals),
        interval=mean,
        last_interval=float(cycles[-1]) if cycles.size else np.nan,
        at_limits=bool((table["cause"] != AT_DISTANCE).any()),
        loss=float(1e-3 * table["loss_mm"].mean()) if len(table) else np.nan,
        shares=dict(zip(PARTS, shares.tolist(), strict=True)),
        environment=(float(acts.min()), float(acts.max())) if acts.size else (1.0, 1.0),
        limit=limit,
        wheel=wheel,
        distance=distance,
        met=met,
        expected=expected,
    )


def _life_end(dataset: xr.Dataset) -> tuple[LimitMet | None, str, float, bool]:
    """Limit that ends the life first, its wheel, its distance [m]; True if it is met.

    Limits at which the wheels are reprofiled do not end it.
    """
    causes = str(dataset.attrs.get(REPROFILED_AT, "")).split()
    first: tuple[LimitMet | None, str, float, bool] = None, "", np.nan, False
    for limit in limits_met(dataset):
        if limit.name in causes:
            continue
        at, met = distances_to(dataset, limit)
        side = int(np.argmin(at))
        if first[0] is None or at[side] < first[2]:
            wheel = _SIDES[side] if at.size == len(_SIDES) else ""
            first = limit, wheel, float(at[side]), bool(met[side])
    return first
