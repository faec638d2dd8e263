"""Scenes with a set-point moved by its error, the same in all that state it.

An offset of a sensor moves a set-point by the same amount everywhere. What was chosen
by its wear, the operating points of a record and the classes of a route, stays chosen:
their set-points are moved, not those of the samples or segments that they stand for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wearsim.errors import Fault, brief, listed, raise_any, shown
from wearsim.operation.route import Curve, Tangent
from wearsim.quantities import QUANTITIES, Quantity
from wearsim.scene import CampaignSetup, FieldScene, RigScene, build, prepare
from wearsim.scene.inputs import inputs_of
from wearsim.scene.route import read_vehicle
from wearsim.scene.vehicle import VehicleSection


@dataclass(frozen=True)
class SetPoint:
    """A set-point of blocks or classes that may be known with an error.

    Parameters
    ----------
    title : str
        Name in the head of a column.
    of : str
        Name of its quantity, which has the unit and the range allowed.
    error : float or None
        Error in the unit of the key where none is given; None if it has none then.
    """

    title: str
    of: str
    error: float | None = None

    @property
    def quantity(self) -> Quantity:
        """Quantity with the unit and the range allowed."""
        return QUANTITIES[self.of]

    @property
    def unit(self) -> str:
        """Unit of the key, with a space before it; "" without unit."""
        unit = self.quantity.shown_unit
        return "" if unit in ("", "1") else f" {unit}"


SET_POINTS: Mapping[str, SetPoint] = {
    "shift_mm": SetPoint("shift", "shift", 0.1),
    "shift_mean_mm": SetPoint("shift", "shift", 0.1),
    "shift_std_mm": SetPoint("shift std", "shift_std"),
    "lateral_force_kN": SetPoint("force", "lateral_force", 0.5),
    "yaw_mrad": SetPoint("yaw", "yaw", 0.2),
    "roll_mrad": SetPoint("roll", "roll"),
    "load_kN": SetPoint("load", "wheel_load", 1.0),
    "axle_load_kN": SetPoint("axle load", "axle_load", 2.0),
    "wheel_load_right_kN": SetPoint("load right", "wheel_load", 1.0),
    "wheel_load_left_kN": SetPoint("load left", "wheel_load", 1.0),
    "axle_box_right_kN": SetPoint("axle box right", "axle_load", 1.0),
    "axle_box_left_kN": SetPoint("axle box left", "axle_load", 1.0),
    "speed_km_h": SetPoint("speed", "speed"),
    "speed_difference_percent": SetPoint("speed difference", "speed_difference"),
    "friction": SetPoint("friction", "friction"),
    "friction_flange": SetPoint("friction flange", "friction_flange"),
    "cant_mm": SetPoint("cant", "cant", 10.0),
    "cant_deficiency_mm": SetPoint("cant deficiency", "cant_deficiency", 10.0),
}
"""Set-points that may have errors, by their keys."""

_OF_SAMPLES = {
    "shift_mm": "shift",
    "lateral_force_kN": "lateral_force",
    "yaw_mrad": "yaw",
    "roll_mrad": "roll",
    "wheel_load_right_kN": "wheel_load_right",
    "wheel_load_left_kN": "wheel_load_left",
    "speed_km_h": "speed",
    "friction": "friction",
    "friction_flange": "friction_flange",
}
"""Set-points of samples of a record by their keys."""


@dataclass(frozen=True)
class Movable:
    """A scene whose set-points can be moved.

    Parameters
    ----------
    base : CampaignSetup
        The campaign with nothing moved.
    stated : mapping
        Name of each block, class or group of samples with its value in the unit of the
        key, by the keys of the set-points that any of them states.
    moved : callable
        Gives the campaign with the set-point of a key moved by an amount in its unit.
    """

    base: CampaignSetup
    stated: Mapping[str, Sequence[tuple[str, float]]]
    moved: Callable[[str, float], CampaignSetup]


def movable(scene: RigScene | FieldScene) -> Movable:
    """Make the set-points of a scene movable, whatever gives its operating points.

    Raises
    ------
    SceneError
        For faults of the scene.
    """
    if scene.recorded is not None:
        return _record(scene)
    if scene.vehicle is not None and scene.vehicle.route is not None:
        return _route(scene)
    return _runs(scene)


def errors_of(scene: Movable, errors: Mapping[str, float]) -> dict[str, float]:
    """Errors of the set-points that a scene states, given or by default [key's unit].

    Raises
    ------
    SceneError
        For errors of keys that it does not state, errors that are not above 0 and those
        that move a set-point beyond the range allowed.
    """
    faults = [
        Fault(f"no block has the set-point {brief(key)}; give {listed(scene.stated)}")
        for key in errors
        if key not in scene.stated
    ]
    given = {key: errors.get(key, SET_POINTS[key].error) for key in scene.stated}
    sizes = {key: error for key, error in given.items() if error is not None}
    for key, error in sizes.items():
        if 0.0 < error < np.inf:
            faults += _range_faults(scene.stated[key], key, error)
        else:
            faults.append(Fault(f"the error of {key}, {error:g}, must be above 0"))
    raise_any(faults)
    return sizes


def _range_faults(
    values: Sequence[tuple[str, float]], key: str, error: float
) -> Iterator[Fault]:
    """Fault of the first block or class that an error moves beyond the range."""
    quantity = SET_POINTS[key].quantity
    for name, value in values:
        for moved in (value + error, value - error):
            text = quantity.fault(moved / quantity.shown_factor, key)
            if text:
                yield Fault(
                    f"the error {key}={error:g} moves {shown(name)} out of the range: "
                    f"{text}; give a smaller error"
                )
                return


def _runs(scene: RigScene | FieldScene) -> Movable:
    """Blocks, given classes, or classes of track of a vehicle."""
    vehicle = scene.vehicle
    runs = vehicle.track if vehicle else tuple(scene.operation.runs.values())
    stated = {
        key: [
            (run.name, value)
            for run in runs
            if (value := getattr(run, key, None)) is not None
        ]
        for key in SET_POINTS
    }

    def moved(key: str, change: float) -> CampaignSetup:
        changed = tuple(
            run
            if getattr(run, key, None) is None
            else run.model_copy(update={key: getattr(run, key) + change})
            for run in runs
        )
        if vehicle is not None:
            on_track = vehicle.model_copy(update={"track": changed})
            return build(_on_track(scene, on_track))
        name = "blocks" if isinstance(scene, RigScene) else "classes"
        operation = scene.operation.model_copy(update={name: changed})
        return build(scene.model_copy(update={"operation": operation}))

    return Movable(build(scene), _stated_set_points(stated), moved)


def _on_track(
    scene: RigScene | FieldScene, vehicle: VehicleSection
) -> RigScene | FieldScene:
    """Scene with another [vehicle], whose classes of track are made anew."""
    moved, inputs = scene.model_copy(update={"vehicle": vehicle}), inputs_of(scene)
    assert isinstance(moved, FieldScene)
    paths = {file.role: file.path for file in inputs.files}
    route = read_vehicle(moved, lambda role, _: paths.get(role))
    moved._inputs = replace(inputs, route=route)
    return moved


def _record(scene: RigScene | FieldScene) -> Movable:
    """Operating points that stand for the samples of a record."""
    base = prepare(scene)
    reduction = base.reduction
    assert reduction is not None
    values = reduction.points.values
    names = {key: name for key, name in _OF_SAMPLES.items() if name in values}
    if "lateral_force_kN" in names:  # the shift follows from it
        names.pop("shift_mm", None)
    stated = {
        key: _named(reduction.group, values[name] * _factor(key))
        for key, name in names.items()
    }

    def moved(key: str, change: float) -> CampaignSetup:
        name = names[key]
        shifted = {**values, name: values[name] + change / _factor(key)}
        points = replace(reduction.points, values=shifted)
        return build(scene, prepare(scene, reduction=replace(reduction, points=points)))

    return Movable(build(scene, base), stated, moved)


def _route(scene: RigScene | FieldScene) -> Movable:
    """Classes that stand for the segments of a route."""
    base = prepare(scene)
    classes = base.track
    stated: dict[str, list[tuple[str, float]]] = {key: [] for key in SET_POINTS}
    for track_class in classes:
        for key, value in _values_of(track_class).items():
            stated[key].append((track_class.name, value))

    def moved(key: str, change: float) -> CampaignSetup:
        track = tuple(_moved_class(track_class, key, change) for track_class in classes)
        return build(scene, prepare(scene, track=track))

    return Movable(build(scene, base), _stated_set_points(stated), moved)


def _values_of(track: Curve | Tangent) -> dict[str, float]:
    """Set-points of a class of track that may be moved, by their keys [key's unit]."""
    values = {"speed_km_h": track.speed, "friction": track.friction}
    if track.friction_flange != track.friction:
        values["friction_flange"] = track.friction_flange
    if isinstance(track, Curve):
        unit = Curve.of_deficiency(track.curvature, 1.0)
        values["cant_deficiency_mm"] = track.acceleration / unit
    else:
        values["shift_std_mm"] = track.std
    return {key: float(value * _factor(key)) for key, value in values.items()}


def _moved_class(track: Curve | Tangent, key: str, change: float) -> Curve | Tangent:
    """Class of track with a set-point moved, if it has that."""
    if key not in _values_of(track):
        return track
    by = change / _factor(key)
    values: dict[str, Any] = {}
    if key == "cant_deficiency_mm":
        assert isinstance(track, Curve)
        more = Curve.of_deficiency(track.curvature, by)
        values["acceleration"] = track.acceleration + more
    elif key == "shift_std_mm":
        assert isinstance(track, Tangent)
        values["std"] = track.std + by
    elif key == "speed_km_h":
        values["speed"] = track.speed + by
    elif key == "friction_flange" or track.friction_flange == track.friction:
        values["friction_flange"] = track.friction_flange + by
    if key == "friction":
        values["friction"] = track.friction + by
    return replace(track, **values)


def _factor(key: str) -> float:
    """Value in the unit of a key over that in SI units."""
    return SET_POINTS[key].quantity.shown_factor


def _named(names: Sequence[str], values: Any) -> list[tuple[str, float]]:
    return [(name, float(value)) for name, value in zip(names, values, strict=True)]


def _stated_set_points(
    stated: Mapping[str, Sequence[tuple[str, float]]],
) -> dict[str, Sequence[tuple[str, float]]]:
    """Leave out set-points that nothing states."""
    return {key: values for key, values in stated.items() if values}
