"""`wearsim profile` on a result file: the worn wheel at a distance, to be measured and written."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from wearsim.errors import ProfileError, ResultError
from wearsim.profile.inspection.inputs import ProfileInput
from wearsim.profile.inspection.request import Request, flag_of, is_result
from wearsim.profile.measures import running_circle_level
from wearsim.profile.placement import RUNNING_CIRCLE
from wearsim.profile.shape import Profile
from wearsim.results import open_results
from wearsim.toml_faults import decimal
from wearsim.translation.factors import at_distances, rows_at
from wearsim.whole_files import signals_wait


def read_wheel(request: Request, key: str, kind: str | None) -> ProfileInput | None:
    """Profile of a flag; of a result file the wheel, whose back-to-back distance acts if none is stated."""
    if not is_result(request.given[key]):
        return request.read(key, kind)
    if request.kind == "rail":
        request.faults.append(f"--kind rail: {request.given[key]} is a result file, its profiles are wheels")
    path, side = Path(request.given[key]), "left" if key == "left" else request.side
    found = request.take(lambda: worn_wheel(path, side, request.at_km), "" if key == "name" else flag_of(key))
    if found is None:
        return None
    wheel, back_to_back = found
    if key != "against":
        request.numbers.setdefault("back_to_back", back_to_back)
    return wheel


@signals_wait()
def worn_wheel(path: Path, side: str, at_km: str | None) -> tuple[ProfileInput, float]:
    """Wheel of a result file at a distance, and the back-to-back distance of its wheelset [m].

    Between two stored states each point is interpolated linearly over the distance; of two states at one
    distance the one after the reprofiling is taken. Raises `ProfileError`.
    """
    try:
        with open_results(path) as data:
            run = data["distance"].values
            points = data[["profile_y", "profile_z"]].sel(wheel=side).load()
            attributes = data.attrs
    except ResultError as error:
        raise ProfileError(str(error)) from error
    end, distance = float(run[-1]), run[-1] if at_km is None else 1e3 * decimal(at_km)
    if math.isclose(distance, end, rel_tol=1e-9):
        distance = end  # as --at-km of a distance that was printed
    if not 0.0 <= distance <= end:
        raise ProfileError(f"--at-km = {at_km} must be 0 to {1e-3 * end:.10g} km, the distance run in {path}")
    y, z = (
        at_distances(run, points[name].values, np.array([distance]))[0] for name in ("profile_y", "profile_z")
    )
    row = int(rows_at(run, np.array([distance]))[0])
    km = f"{1e-3 * distance:.10g} km"
    how = "the last stored state" if row == run.size - 1 else "a stored state"
    if run[row] < distance:
        ends = f"{1e-3 * run[row]:.6g} km and {1e-3 * run[row + 1]:.6g} km"
        how = f"interpolated between the stored states at {ends}"
    elif row and run[row - 1] == distance:
        how = "the stored state after the reprofiling there"
    radius = float(attributes["wheel_radius"])
    diameter = 2.0 * (radius + running_circle_level(y, z))
    back_to_back = 2.0 * (float(attributes["half_span"]) - RUNNING_CIRCLE)
    notes = (
        f"{side} wheel after {km}: {how}",
        f"z counts from the new running circle, radius {1e3 * radius:g} mm; now the diameter is "
        f"{1e3 * diameter:.3f} mm there",
        f"this diameter and the back-to-back distance {1e3 * back_to_back:g} mm are taken, if none is stated",
    )
    source = f"{side} wheel of {path.name} after {km}, {how}"
    profile = Profile(f"{path.stem}_{side}_{km.replace(' ', '')}", "wheel", y, z, source)
    wheel = ProfileInput(
        profile=profile, format="result", header={}, notes=notes, given=str(path),
        title="worn wheel of a result file", source=source, diameter=diameter,
    )  # fmt: skip
    return wheel, back_to_back
