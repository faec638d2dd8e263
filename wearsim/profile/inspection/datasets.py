"""Inspected profiles as datasets in SI units: what their figures draw."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from wearsim.profile.alignment import Alignment
from wearsim.profile.conicity import Running
from wearsim.profile.inspection import Comparison, Inspection
from wearsim.profile.inspection.fleet import FleetRow
from wearsim.profile.inspection.inputs import ProfileInput
from wearsim.profile.limits import LimitSet
from wearsim.profile.measures import GaugeDistances
from wearsim.profile.shape import FloatArray, Profile, extremum
from wearsim.quantities import QUANTITIES

_GAUGED = ("flange_height", "flange_thickness", "flange_gradient")


def _gauge_points(profile: Profile, distances: GaugeDistances, values: Mapping[str, float]) -> FloatArray:
    """Flange tip, running circle, lower and upper point of the flank (4, 2) [m] of measured Sh, Sd and qR."""
    height, thickness, gradient = (values[name] for name in _GAUGED)
    tip_y, tip_z = extremum(profile.y, profile.z, int(np.argmax(profile.z)))
    base, flank = tip_z - height, thickness - distances.flange_back
    lower, upper = [flank, base + distances.level], [flank - gradient, tip_z - distances.below_tip]
    return np.array([[tip_y, tip_z], [0.0, base], lower, upper])


def profile_dataset(result: Inspection) -> xr.Dataset:
    """Dataset of an inspected profile.

    Returns
    -------
    Dataset
        `profile_y, profile_z (point)`; with a reference `reference_y, reference_z`, with a left wheel
        `left_y, left_z`; of a wheel `gauge_y, gauge_z (gauge_point)`, flange tip, running circle, lower and
        upper point of the flank, and the measures between them; with wear `arc_length, wear_y, wear_depth
        (wear_point)`; with running behaviour `shift`, `rolling_radius_difference (shift)`, `amplitude` and
        `equivalent_conicity (amplitude)`, amplitudes without a conicity left out; the same with names
        beginning with `reference_`.
    """
    given, left, comparison = result.given, result.left, result.comparison
    wheel = given.kind == "wheel"
    y_axis, z_axis = ("profile_y", "profile_z") if wheel else ("counterface_y", "counterface_z")
    data: dict[str, xr.Variable] = {}
    attributes: dict[str, Any] = {
        "label": given.profile.name,
        "reference_label": "",
        "left_label": "",
        "kind": given.kind,
        "title": f"{given.profile.name}: {given.kind}, {given.title}",
        "exceeded": " ".join(_exceeded(result, "right")),
    }
    drawn = {"profile": result.aligned}
    if comparison is not None:
        drawn["reference"] = comparison.reference.profile
        attributes["reference_label"] = comparison.reference.profile.name
    if left is not None:
        drawn["left"] = left.profile
        # its measures have no dimension lines: its label names those beyond a limit
        names = ", ".join(QUANTITIES[name].meaning for name in _exceeded(result, "left"))
        attributes["left_label"] = f"{left.profile.name} (left wheel)" + (
            f", beyond: {names} !" * bool(names)
        )
    for name, profile in drawn.items():
        dimension = "point" if name == "profile" else f"{name}_point"
        data[f"{name}_y"] = _variable(y_axis, dimension, profile.y)
        data[f"{name}_z"] = _variable(z_axis, dimension, profile.z)
    values, distances = result.measures["right"].values if wheel else {}, result.conditions.distances
    if all(name in values for name in _GAUGED):
        points = _gauge_points(given.profile, distances, values)
        points = points if comparison is None else _moved(points, comparison.alignment)
        data |= {name: _variable(name, (), values[name]) for name in _GAUGED}
        data["gauge_y"] = _variable(y_axis, "gauge_point", points[:, 0])
        data["gauge_z"] = _variable(z_axis, "gauge_point", points[:, 1])
        attributes |= {"level_distance": distances.level, "below_tip_distance": distances.below_tip,
                       "running_circle_distance": distances.flange_back}  # fmt: skip
    if comparison is not None:
        wear, alignment = comparison.wear, comparison.alignment
        data["arc_length"] = _variable("arc_length", "wear_point", wear.s)
        data["wear_y"] = _variable(y_axis, "wear_point", wear.y)
        data["wear_depth"] = _variable("wear_depth", "wear_point", wear.depth)
        data["worn_area"] = _variable("worn_area", (), wear.worn_area)
        laid = f"laid on {attributes['reference_label']}: {alignment.rule}, {alignment.note}"
        attributes |= {"subtitle": laid, "wear_note": wear.note}
    if not wheel:
        attributes["origin"] = _origin(given, comparison)
    if (run := result.running) is not None:
        data |= _running(run, "")
        wheels = f"{run.wheel} and {run.left} (left)" if run.left else run.wheel
        attributes["track"] = f"{wheels} on {run.track}"
    if comparison is not None and comparison.running is not None:
        data |= _running(comparison.running, "reference_")
    return xr.Dataset(data, attrs=attributes)


def _exceeded(result: Inspection, body: str) -> list[str]:
    """Names of the measures of a wheel that are beyond a limit."""
    return list(dict.fromkeys(each.measure for of, each in result.judgements if each.exceeded and of == body))


def _running(run: Running, before: str) -> dict[str, xr.Variable]:
    """Variables of the running behaviour, names beginning with `before`."""
    known = [(a, value) for a, value, _ in run.conicity if value is not None]
    shift, amplitude = f"{before}shift", f"{before}amplitude"
    return {
        shift: _variable("shift", shift, run.shift),
        f"{before}rolling_radius_difference": _variable("rolling_radius_difference", shift, run.difference),
        amplitude: _variable("amplitude", amplitude, [a for a, _ in known]),
        f"{before}equivalent_conicity": _variable("equivalent_conicity", amplitude, [c for _, c in known]),
    }


def fleet_dataset(
    rows: list[FleetRow], reference: ProfileInput | None, limits: LimitSet | None
) -> xr.Dataset:
    """Dataset of the rows that could be measured: what the small multiples draw.

    The reference is drawn grey behind each profile, the limits are those that exceeded measures refer to.

    Returns
    -------
    Dataset
        `profile_y, profile_z (wheel, point)`; `wheel_name` (that of the file where several say to be one
        wheel), `file`, `exceeded`, `not_judged`, `judged`, `kind (wheel)`; measures `(wheel)`, NaN-free:
        `known_<name> (wheel)` says where a measure is there, it is 0 elsewhere.
    """
    good = [row for row in rows if row.measured]
    often = Counter(row.wheel for row in good)
    data: dict[str, Any] = {
        f"profile_{axis}": _variable(
            f"profile_{axis}", ("wheel", "point"), np.array([getattr(row, axis) for row in good], ndmin=2)
        )
        for axis in "yz"
    }
    for name in dict.fromkeys(name for row in good for name in row.values):
        known = np.array([name in row.values for row in good], dtype=np.int8)
        data[name] = _variable(name, "wheel", [row.values.get(name, 0.0) for row in good])
        data[f"known_{name}"] = ("wheel", known, {"long_name": f"whether {name} is known"})
    attributes = {
        "reference_label": "",
        "reference_kind": "",
        "limits": "" if limits is None else limits.name,
        "faults": str(len(rows) - len(good)),
    }
    if reference is not None:
        profile = reference.profile
        data["reference_y"] = _variable("profile_y", "reference_point", profile.y)
        data["reference_z"] = _variable("profile_z", "reference_point", profile.z)
        attributes |= {"reference_label": profile.name, "reference_kind": profile.kind}
    data |= {
        "wheel_name": ("wheel", [row.file if often[row.wheel] > 1 else row.wheel for row in good]),
        "file": ("wheel", [row.file for row in good]),
        "kind": ("wheel", [row.identity["kind"] for row in good]),
        "exceeded": ("wheel", [" ".join(row.exceeded) for row in good]),
        "not_judged": ("wheel", [" ".join(row.not_judged) for row in good]),
        "judged": ("wheel", np.array([row.judged for row in good], dtype=np.int8)),
    }
    return xr.Dataset(data, attrs=attributes)


def _origin(rail: ProfileInput, comparison: Comparison | None) -> str:
    """Where the lateral position of a rail is counted from."""
    if comparison is not None:
        return "in the track" if comparison.reference.upright else f"of {comparison.reference.profile.name}"
    return "as measured" if rail.measured else "from the symmetry axis" if rail.upright else "in the track"


def _moved(points: FloatArray, alignment: Alignment) -> FloatArray:
    """Points of a profile after its alignment."""
    c, s = np.cos(alignment.angle), np.sin(alignment.angle)
    rotated = points @ np.array([[c, s], [-s, c]])
    return np.asarray(rotated + np.array([alignment.dy, alignment.dz]))


def _variable(name: str, dimensions: str | tuple[str, ...], values: Any) -> xr.Variable:
    return xr.Variable(dimensions, np.asarray(values, dtype=np.float64), QUANTITIES[name].attributes)
