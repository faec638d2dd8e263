"""Inspected profiles as datasets in SI units: what their figures draw."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from wearsim.profile.alignment import Alignment
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
    reference = None if comparison is None else comparison.reference
    wheel = given.kind == "wheel"
    axes = ("profile_y", "profile_z") if wheel else ("counterface_y", "counterface_z")
    data: dict[str, Any] = {}
    drawn = {
        "profile": result.aligned,
        "reference": None if reference is None else reference.profile,
        "left": None if left is None else left.profile,
    }
    for name, profile in drawn.items():
        if profile is not None:
            dimension = "point" if name == "profile" else f"{name}_point"
            data[f"{name}_y"] = _variable(axes[0], (dimension,), profile.y)
            data[f"{name}_z"] = _variable(axes[1], (dimension,), profile.z)
    distances = result.conditions.distances
    beyond = [each for body, each in result.judgements if each.exceeded and body == "left"]
    attributes: dict[str, Any] = {
        "label": given.profile.name,
        "reference_label": "" if reference is None else reference.profile.name,
        "left_label": "" if left is None else f"{left.profile.name} (left wheel)",
        "kind": given.kind,
        "title": f"{given.profile.name}: {given.kind}, {given.title}",
        "exceeded": " ".join(dict.fromkeys(
            each.measure for body, each in result.judgements if each.exceeded and body == "right"
        )),
    }  # fmt: skip
    if left is not None and beyond:
        # its measures have no dimension lines: its label names them
        names = dict.fromkeys(QUANTITIES[each.measure].meaning for each in beyond)
        attributes["left_label"] += f", beyond: {', '.join(names)} !"
    values = result.measures["right"].values if wheel else {}
    if all(name in values for name in _GAUGED):
        points = _gauge_points(given.profile, distances, values)
        points = points if comparison is None else _moved(points, comparison.alignment)
        data |= {name: _variable(name, (), values[name]) for name in _GAUGED}
        data["gauge_y"] = _variable(axes[0], ("gauge_point",), points[:, 0])
        data["gauge_z"] = _variable(axes[1], ("gauge_point",), points[:, 1])
        attributes |= {"level_distance": distances.level, "below_tip_distance": distances.below_tip,
                       "running_circle_distance": distances.flange_back}  # fmt: skip
    if comparison is not None:
        wear, alignment = comparison.wear, comparison.alignment
        data["arc_length"] = _variable("arc_length", ("wear_point",), wear.s)
        data["wear_y"] = _variable(axes[0], ("wear_point",), wear.y)
        data["wear_depth"] = _variable("wear_depth", ("wear_point",), wear.depth)
        data["worn_area"] = _variable("worn_area", (), wear.worn_area)
        attributes["subtitle"] = (
            f"laid on {comparison.reference.profile.name}: {alignment.rule}, {alignment.note}"
        )
        attributes["wear_note"] = wear.note
    if not wheel:
        attributes["origin"] = _origin(given, comparison)
    for before, run in (
        ("", result.running),
        ("reference_", None if comparison is None else comparison.running),
    ):
        if run is None:
            continue
        known = [(a, value) for a, value, _ in run.conicity if value is not None]
        shifts, amplitudes = f"{before}shift", f"{before}amplitude"
        for name, dimension, numbers in (
            ("shift", shifts, run.shift),
            ("rolling_radius_difference", shifts, run.difference),
            ("amplitude", amplitudes, [a for a, _ in known]),
            ("equivalent_conicity", amplitudes, [value for _, value in known]),
        ):
            data[before + name] = _variable(name, (dimension,), numbers)
    if result.running is not None:
        run = result.running
        wheels = f"{run.wheel} and {run.left} (left)" if run.left else run.wheel
        attributes["track"] = f"{wheels} on {run.track}"
    return xr.Dataset(data, attrs=attributes)


def fleet_dataset(
    rows: list[FleetRow], reference: ProfileInput | None, limits: LimitSet | None
) -> xr.Dataset:
    """Dataset of the rows that could be measured: what the small multiples draw.

    The reference is drawn grey behind each profile, the limits are those that exceeded measures refer to.

    Returns
    -------
    Dataset
        `profile_y, profile_z (wheel, point)`, the last point repeated on shorter outlines; `wheel_name`
        (that of the file where several say to be one wheel), `file`, `exceeded`, `not_judged`, `judged`,
        `kind (wheel)`; measures `(wheel)`, NaN-free: `known_<name> (wheel)` says where a measure is there,
        it is 0 elsewhere.
    """
    good = [row for row in rows if row.measured]
    longest = max((len(row.y) for row in good), default=0)
    often = Counter(row.wheel for row in good)
    data: dict[str, Any] = {}
    for name in ("profile_y", "profile_z"):
        lines = [getattr(row, name[-1]) for row in good]
        padded = [np.concatenate((line, np.repeat(line[-1:], longest - len(line)))) for line in lines]
        data[name] = _variable(name, ("wheel", "point"), np.stack(padded) if padded else np.empty((0, 0)))
    for name in dict.fromkeys(name for row in good for name in row.values):
        known = np.array([name in row.values for row in good], dtype=np.int8)
        data[name] = _variable(name, ("wheel",), [row.values.get(name, 0.0) for row in good])
        data[f"known_{name}"] = ("wheel", known, {"long_name": f"whether {name} is known"})
    attributes = {
        "reference_label": "",
        "reference_kind": "",
        "limits": "" if limits is None else limits.name,
        "faults": str(len(rows) - len(good)),
    }
    if reference is not None:
        profile = reference.profile
        data["reference_y"] = _variable("profile_y", ("reference_point",), profile.y)
        data["reference_z"] = _variable("profile_z", ("reference_point",), profile.z)
        attributes |= {"reference_label": profile.name, "reference_kind": profile.kind}
    texts = {
        "wheel_name": [row.file if often[row.wheel] > 1 else row.wheel for row in good],
        "file": [row.file for row in good],
        "kind": [row.identity["kind"] for row in good],
        "exceeded": [" ".join(row.exceeded) for row in good],
        "not_judged": [" ".join(row.not_judged) for row in good],
        "judged": np.array([row.judged for row in good], dtype=np.int8),
    }
    return xr.Dataset(data | {name: ("wheel", text) for name, text in texts.items()}, attrs=attributes)


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


def _variable(name: str, dimensions: tuple[str, ...], values: Any) -> xr.Variable:
    return xr.Variable(dimensions, np.asarray(values, dtype=np.float64), QUANTITIES[name].attributes)
