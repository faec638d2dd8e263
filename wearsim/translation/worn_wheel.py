"""A worn wheel of a result file."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from wearsim.errors import ProfileError, ResultError
from wearsim.profile.measures import running_circle_level
from wearsim.profile.placement import RUNNING_CIRCLE
from wearsim.profile.shape import Profile
from wearsim.results import open_whole
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
    when: str  # distance, and which stored state it is


@signals_wait()
def worn_wheel(path: Path, side: Side, distance: float | None = None, given: str = "") -> WornWheel:
    """Return a wheel of a result file at a distance [m], by default the last one.

    Between two stored states each point is interpolated linearly over the distance; of two states at one
    distance the one after the reprofiling is taken.

    Raises
    ------
    ProfileError
        If the file is no result, or the distance was not run; `given` is how the user wrote it.
    """
    try:
        with open_whole(path) as data:
            run = data["distance"].values
            points = data[["profile_y", "profile_z"]].sel(wheel=side).load()
            attributes = data.attrs
    except ResultError as error:
        raise ProfileError(str(error)) from error
    end = float(run[-1])
    at = end if distance is None or math.isclose(distance, end, rel_tol=1e-9) else distance
    if not 0.0 <= at <= end:
        raise ProfileError(f"{given} must be 0 to {1e-3 * end:.10g} km, the distance run in {path}")
    y, z = (at_distances(run, points[name].values, np.array([at]))[0] for name in ("profile_y", "profile_z"))
    row = int(rows_at(run, np.array([at]))[0])
    km = f"{1e-3 * at:.10g} km"
    how = "the last stored state" if row == run.size - 1 else "a stored state"
    if run[row] < at:
        ends = f"{1e-3 * run[row]:.6g} km and {1e-3 * run[row + 1]:.6g} km"
        how = f"interpolated between the stored states at {ends}"
    elif row and run[row - 1] == at:
        how = "the stored state after the reprofiling there"
    radius = float(attributes["wheel_radius"])
    source = f"{side} wheel of {path.name} after {km}, {how}"
    return WornWheel(
        Profile(f"{path.stem}_{side}_{km.replace(' ', '')}", "wheel", y, z, source),
        radius,
        2.0 * (radius + running_circle_level(y, z)),
        2.0 * (float(attributes["half_span"]) - RUNNING_CIRCLE),
        f"{km}: {how}",
    )
