"""A worn wheel of a result file."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import xarray as xr

from wearsim.errors import ProfileError, ResultError, brief
from wearsim.profile.measures import LEVEL, MeasuringRule, running_circle_level
from wearsim.profile.placement import RUNNING_CIRCLE
from wearsim.profile.shape import Profile
from wearsim.quantities import kilometres
from wearsim.results import open_results
from wearsim.translation.factors import at_distances, rows_at
from wearsim.whole_files import signals_wait

Side = Literal["right", "left"]


@dataclass(frozen=True)
class WornWheel:
    """A wheel of a result at a distance."""

    profile: Profile
    radius: float  # of the new wheel at the running circle, from which z counts [m]
    diameter: float  # of the worn wheel there [m]
    back_to_back: float  # distance of the wheelset [m]
    rule: MeasuringRule  # places at which the campaign measures
    when: str  # distance, and which stored state it is


def worn_profile(
    results: str | Path | xr.Dataset,
    wheel: Side = "right",
    distance: float | None = None,
) -> Profile:
    """Profile of a wheel of a campaign at a distance.

    Parameters
    ----------
    results : str, Path or Dataset
        Result file, or a result as `wearsim.open_results` gives it.
    wheel : {"right", "left"}
        In the axes of a right wheel, too.
    distance : float, optional
        Within the distance run, by default its end [m].

    Returns
    -------
    Profile
        Each point is linear between the two stored states; of two states at one
        distance the one after the reprofiling is taken. `source` states which.

    Raises
    ------
    ProfileError
        If the file is no result, it does not hold that wheel, or the distance was not
        run.

    Examples
    --------
    >>> import wearsim
    >>> worn = wearsim.worn_profile("out/rig.nc", "right", 1500.0)
    >>> worn.kind, worn.name
    ('wheel', 'rig_right_1.5km')
    >>> wearsim.export_profile(worn, "worn.prw")
    """
    given = "" if distance is None else f"distance = {distance:.10g} m"
    return worn_wheel(results, wheel, distance, given).profile


@signals_wait()
def worn_wheel(
    results: str | Path | xr.Dataset,
    side: Side,
    distance: float | None = None,
    given: str = "",
) -> WornWheel:
    """Wheel of a result at a distance [m], by default the last one, see `worn_profile`.

    Raises
    ------
    ProfileError
        If the file is no result, or the distance was not run; `given` is how the user
        wrote it.
    """
    if side not in ("right", "left"):
        raise ProfileError(f"wheel = {brief(repr(side))} is not one of right, left")
    if isinstance(results, xr.Dataset):
        name = f"the result {brief(str(results.attrs.get('title', '')))!r}"
        return _worn_wheel(
            results,
            side,
            distance,
            given,
            (str(results.attrs.get("scene_kind", "result")), name, name),
        )
    path = Path(results)
    try:
        with open_results(path) as data:
            return _worn_wheel(
                data, side, distance, given, (path.stem, path.name, str(path))
            )
    except ResultError as error:
        raise ProfileError(str(error)) from error


def _worn_wheel(
    data: xr.Dataset,
    side: Side,
    distance: float | None,
    given: str,
    names: tuple[str, str, str],
) -> WornWheel:
    """Wheel of an open result, with its names for those of the profile.

    For its source and for messages.
    """
    stem, name, path = names
    if not {"step", "wheel", "point"} <= set(data.dims) or not {
        "profile_y",
        "profile_z",
    } <= set(data.variables):
        raise ProfileError(
            f"{path} is a part of a result without profiles of both wheels over its "
            "steps"
        )
    run, attributes = data["distance"].values, data.attrs
    try:
        points = data[["profile_y", "profile_z"]].sel(wheel=side).load()
    except KeyError:
        raise ProfileError(
            f"{path} is a part of a result without the {side} wheel"
        ) from None
    end = float(run[-1])
    at = (
        end
        if distance is None or math.isclose(distance, end, rel_tol=1e-9)
        else distance
    )
    if not 0.0 <= at <= end:
        raise ProfileError(
            f"{given} must be 0 to {1e-3 * end:.10g} km, the distance run in {path}"
        )
    y, z = (
        at_distances(run, points[name].values, np.array([at]))[0]
        for name in ("profile_y", "profile_z")
    )
    row = int(rows_at(run, np.array([at]))[0])
    km = f"{1e-3 * at:.10g} km"
    how = "the last stored state" if row == run.size - 1 else "a stored state"
    if run[row] < at:
        ends = f"{kilometres(run[row])} and {kilometres(run[row + 1])}"
        how = f"interpolated between the stored states at {ends}"
    elif row and run[row - 1] == at:
        how = "the stored state after the reprofiling there"
    radius = float(attributes["wheel_radius"])
    rule = MeasuringRule(
        float(attributes.get("measuring_height", LEVEL)),
        float(attributes.get("running_circle", RUNNING_CIRCLE)),
    )
    source = f"{side} wheel of {name} after {km}, {how}"
    return WornWheel(
        Profile(f"{stem}_{side}_{km.replace(' ', '')}", "wheel", y, z, source),
        radius,
        2.0 * (radius + running_circle_level(y, z, rule)),
        2.0 * (float(attributes["half_span"]) - RUNNING_CIRCLE),
        rule,
        f"{km}: {how}",
    )
