"""What is solved from a scene before its campaign begins.

Its operating points, and where they run.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wearsim.contact.problem import PAIRS
from wearsim.contact.solve import ContactModels, Counterface, Wheelset, available_cores
from wearsim.damage.wear import WearSettings
from wearsim.errors import ContactError, ProfileError, SceneError
from wearsim.operation.points import (
    OperatingPoints,
    Run,
    collective,
    points_of,
    programme,
    recorded_points,
    where_it_runs,
    with_monitors,
)
from wearsim.operation.recorded import (
    Reducer,
    Reduction,
    Samples,
    reduce_samples,
    with_shifts,
)
from wearsim.operation.refusal import bogie_of, what_helps
from wearsim.operation.route import (
    LEAST_CONICITY,
    Curve,
    Motion,
    Tangent,
    creep_coefficients,
    klingel,
    reduced,
    route,
)
from wearsim.operation.states import Running, StateError, settle
from wearsim.profile.conicity import equivalent_conicity
from wearsim.profile.measures import running_circle_level
from wearsim.quantities import GRAVITY
from wearsim.scene.checks import by_line, places_of
from wearsim.scene.contact import ContactSection
from wearsim.scene.damage import wear_settings
from wearsim.scene.inputs import inputs_of
from wearsim.scene.models import FieldScene, RigScene
from wearsim.scene.route import Route
from wearsim.scene.section import Section
from wearsim.scene.vehicle import VehicleSection
from wearsim.toml_faults import KeyPath

_Bodies = tuple[Wheelset, Counterface]


@dataclass(frozen=True)
class Prepared:
    """Operating points and running state solved before a campaign begins."""

    # load collective with monitoring points, where the new wheelset runs
    points: OperatingPoints
    places: tuple[
        KeyPath, ...
    ]  # of each operating point: the path of its key in the scene
    running: Running | None = (
        None  # state of the new wheelset under controlled forces; None: nothing is
    )
    reduction: Reduction | None = None  # of a record to the operating points
    track: tuple[
        Curve | Tangent, ...
    ] = ()  # of a vehicle: its classes, those that stand for segments
    error: float = 0.0  # of the wear of classes that stand for segments [-]


def prepare(
    scene: RigScene | FieldScene,
    *,
    reduction: Reduction | None = None,
    track: tuple[Curve | Tangent, ...] | None = None,
) -> Prepared:
    """Solve what a campaign needs from a scene of `load_scene`.

    Points of a record or a route, their places. A reduction of the record, or classes
    of track that stand for the segments of the route, may be given; else they are
    chosen here.

    Raises
    ------
    SceneError
        With one fault for each block or class whose forces no state carries, and for a
        vehicle that has no motion on straight track or no balance in a curve.
    """
    inputs, section, bodies = inputs_of(scene), scene.vehicle, bodies_of(scene)
    reducer = _reducer(scene, bodies, wear_settings(scene.wear, inputs.wear_table)[0])
    classes, error = tuple[Curve | Tangent, ...](), 0.0
    if scene.recorded is not None and reduction is None:
        assert inputs.samples is not None
        samples = _with_shifts(scene, inputs.samples, reducer)
        tolerance = scene.recorded.binning_tolerance
        reduction = reduce_samples(samples, reducer, tolerance)
    if section is None:
        points = _points(scene, reduction)
    else:
        assert inputs.route is not None
        given = inputs.route if track is None else replace(inputs.route, track=track)
        by_segments = section.route is not None and track is None
        classes, error, points = _route_classes(
            scene, section, given, bodies, reducer, by_segments=by_segments
        )
    points = _coupled(scene, _monitored(scene, points), bodies[1])
    places = places_of(scene, points)
    running = _balanced_running(scene, points, places, bodies)
    points = where_it_runs(points, running)
    if section is not None and section.positions == "frozen":
        points, running = replace(points, controlled=None), None
    return Prepared(points, places, running, reduction, classes, error)


def _with_shifts(
    scene: RigScene | FieldScene, samples: Samples, reducer: Reducer
) -> Samples:
    """Find the shifts of samples that have the forces of an instrumented wheelset."""
    if "lateral_force" not in samples.values:
        return samples
    try:
        return with_shifts(samples, reducer)
    except StateError as error:
        share = 100.0 * len(error.messages) / samples.distance.size
        first = min(error.messages)
        force = 1e-3 * float(samples.values["lateral_force"][first])
        text = (
            f"no shift balances the lateral force of {share:.3g} % of the samples, the "
            f"first {force:.3g} kN: {error.messages[first]}; check signs, units and "
            "friction"
        )
        raise SceneError([scene.fault(("recorded", "file"), text)]) from None


def prepare_again(
    scene: RigScene | FieldScene,
    prepared_scene: RigScene | FieldScene,
    prepared: Prepared,
) -> Prepared:
    """Return what was solved from a known scene if the files of both are the same.

    Else solve the scene.
    """
    files, prepared_files = (
        [(file.role, file.sha256) for file in inputs_of(version).files]
        for version in (scene, prepared_scene)
    )
    return prepared if files == prepared_files else prepare(scene)


def bodies_of(scene: RigScene | FieldScene) -> tuple[Wheelset, Counterface]:
    """Return the new wheelset and the rails or rollers of a scene."""
    inputs, section = inputs_of(scene), scene.wheelset
    radius, rule = 1e-3 * section.radius_mm, section.measuring_rule
    if rule.circle_y != 0.0:  # radius_mm is that of the running circle, not of y = 0
        y, z = inputs.right.y, inputs.right.z
        radius -= running_circle_level(y, z, rule) - running_circle_level(y, z)
    wheelset = Wheelset(
        inputs.right,
        inputs.left,
        radius,
        inputs.half_span,
        1e-3 * section.wheel_diameter_difference_mm,
    )
    kappa, left_curvature = (
        scene.counterface.curvature,
        getattr(scene.counterface, "left_curvature", None),
    )
    first, *further = (
        Counterface(right, kappa, left, left_curvature=left_curvature)
        for right, left in inputs.rails
    )
    return wheelset, replace(first, further=tuple(further))


def contact_models(contact: ContactSection) -> ContactModels:
    """Contact models, grid and material of [contact], in SI units."""
    values = contact.si()
    return ContactModels(
        *contact.pair,
        **{key: values[key] for key in ("strips", "cells", "most_cells")},
        cell_size=values["cell"],
        youngs_modulus=values["youngs"],
        poisson_ratio=values["poisson"],
        kalker_factor=contact.kalker_factor,
        friction_ratio=contact.friction_ratio,
        friction_decrease=contact.friction_decrease_s_m,
        parameters=(
            ("virtual_penetration_factor", contact.virtual_penetration_factor),
        ),
    )


def _reducer(
    scene: RigScene | FieldScene, bodies: _Bodies, wear: WearSettings
) -> Reducer:
    """Make what weighs samples and segments.

    Coarse models, alike for all of them and for the points.
    """
    models = ContactModels.of(
        "fast",
        strips=12,
        cells=12,
        cell_size=1e-3,
        youngs_modulus=1e9 * scene.contact.youngs_GPa,
        poisson_ratio=scene.contact.poisson,
        kalker_factor=scene.contact.kalker_factor,
        friction_ratio=scene.contact.friction_ratio,
        friction_decrease=scene.contact.friction_decrease_s_m,
    )
    wavelength = 1e-3 * scene.campaign.smoothing_wavelength_mm
    return Reducer(*bodies, models, wear, wavelength, threads=available_cores())


def _points(
    scene: RigScene | FieldScene, reduction: Reduction | None
) -> OperatingPoints:
    """Operating points of blocks, classes or a record."""
    runs = [set_points_of(scene, section) for section in scene.operation.runs.values()]
    motion = _motion(scene, runs)
    motion["free_roll"] |= reduction is not None
    if scene.recorded is not None and reduction is not None:
        record_points, common = (
            reduction.points,
            np.full(reduction.points.distance.size, scene.recorded.environment),
        )
        set_points = {**record_points.values, "environment": common}
        if "lateral_force" in set_points:  # which guides the worn wheels, too
            set_points = {k: v for k, v in set_points.items() if k != "shift"}
        return recorded_points(
            set_points, record_points.distance, reduction.group, **motion
        )
    if not isinstance(scene, RigScene):
        return collective(runs, **motion)
    points = programme(runs, **motion)
    stationary = np.zeros_like(points.block_length)
    return (
        replace(points, block_length=stationary) if scene.operation.together else points
    )


def _route_classes(
    scene: RigScene | FieldScene,
    section: VehicleSection,
    given: Route,
    bodies: _Bodies,
    reducer: Reducer,
    *,
    by_segments: bool,
) -> tuple[tuple[Curve | Tangent, ...], float, OperatingPoints]:
    """Classes of the track of a vehicle.

    The error of their wear where they stand for segments, and their points.
    `by_segments` is True where the track is segments, which classes have to stand for.

    On straight track it moves as with new wheels.
    """
    inputs, (wheelset, counterface) = inputs_of(scene), bodies
    spread = max(
        (
            track_class.std
            for track_class in given.track
            if isinstance(track_class, Tangent)
        ),
        default=0.0,
    )
    models = contact_models(scene.contact)
    motions = []
    for rails, clearances in zip(
        (counterface, *counterface.further), inputs.clearances, strict=True
    ):
        clearance = min(
            (play for play in clearances if play is not None),
            default=math.inf,
        )
        amplitude = min(max(math.sqrt(2.0) * spread, 1e-3), clearance)
        try:
            profiles = wheelset.right, wheelset.left, rails.profile
            conicity = (
                equivalent_conicity(*profiles, amplitude=amplitude) or LEAST_CONICITY
            )
        except ProfileError as error:
            text = f"no equivalent conicity: {error}"
            raise SceneError([scene.fault(("vehicle", "tangent"), text)]) from None
        along, across = creep_coefficients(
            wheelset, rails, models, 0.5 * given.vehicle.axle_load
        )
        steers = scene.contact.rotation != "independent"
        motions.append(
            Motion(
                rule=section.tangent,
                wavelength=section.tangent_wavelength_m or klingel(wheelset, conicity),
                creep=(along if steers else 0.0, across),
                conicity=conicity,
                clearance=clearance,
            )
        )

    def on(track: Sequence[Curve | Tangent]) -> OperatingPoints:
        return route(
            track,
            given.vehicle,
            given.shares,
            motions,
            wheelset,
            scene.contact.rotation,
        )

    def worn(track: Sequence[Curve | Tangent]) -> np.ndarray:
        points = on(track)
        if points.controlled is not None:
            try:
                running = settle(
                    points.conditions,
                    points.controlled,
                    *bodies,
                    reducer.models,
                    threads=reducer.threads,
                )
            except StateError as error:
                text = _without_balance(
                    points, bodies, reducer.models, error, given.track
                )
                raise SceneError([scene.fault(("vehicle", "route"), text)]) from None
            points = where_it_runs(points, running)
        conditions, point, part = points.runs
        share = part * (points.weight * points.environment)[point]
        failed = dict[int, ContactError]()
        increments = share[:, None, None] * reducer.worn(conditions, failed)[0]
        if failed:
            row = min(failed)
            text = f"{points.label[point[row]]}: {failed[row]}"
            raise SceneError([scene.fault(("vehicle", "route"), text)])
        of_track = np.zeros((len(track), *increments.shape[1:]))
        np.add.at(of_track, np.array(points.of_track)[point], increments)
        return of_track

    if not by_segments:
        return given.track, 0.0, on(given.track)
    classes, class_error = reduced(given.track, worn, section.binning_tolerance)
    return classes, class_error, on(classes)


def _monitored(
    scene: RigScene | FieldScene, points: OperatingPoints
) -> OperatingPoints:
    """Operating points with those that are watched."""
    monitor = scene.operation.monitor
    if monitor is None:
        return points
    values = monitor.si()
    values["wheel_load"] = values.pop("load")
    return with_monitors(
        points, 1e-3 * np.array(monitor.shifts_mm, dtype=np.float64), **values
    )


def coupled_difference(scene: RigScene | FieldScene, counterface: Counterface) -> float:
    """Return the speed difference of rollers of one angular speed [-].

    It is 0 for rails, rollers of one radius, and rollers that are driven independently.
    """
    drive = getattr(scene.counterface, "drive", None)
    return 0.0 if drive == "independent" else counterface.coupled_difference


def _motion(
    scene: RigScene | FieldScene, runs: Sequence[Mapping[str, Any]]
) -> dict[str, Any]:
    """Rules of motion of runs, by [contact]; the roll of balanced ones is free."""
    contact = scene.contact
    balanced = any("axle_load" in run or "lateral_force" in run for run in runs)
    return {
        "rotation": contact.rotation,
        "torque": contact.torque_Nm,
        "free_roll": contact.roll == "free" or balanced,
    }


def points_on_rig(scene: RigScene, runs: Sequence[Run]) -> OperatingPoints:
    """Operating points of equal weight on a rig, not yet where forces balance.

    They follow the rules of the scene, in place of its blocks.
    """
    count = len(runs)
    label = tuple(str(k + 1) for k in range(count))
    weight = np.full(count, 1.0 / count)
    points = points_of(runs, _motion(scene, runs), weight, label, label)
    return _coupled(scene, points, bodies_of(scene)[1])


def _coupled(
    scene: RigScene | FieldScene, points: OperatingPoints, counterface: Counterface
) -> OperatingPoints:
    """Operating points on rollers of one angular speed.

    Those of unlike radii run at unlike speeds.
    """
    difference = coupled_difference(scene, counterface)
    if difference == 0.0:
        return points
    apart = np.full(points.weight.size, difference)
    return replace(
        points, conditions=replace(points.conditions, speed_difference=apart)
    )


def set_points_of(scene: RigScene | FieldScene, section: Section) -> dict[str, Any]:
    """Set-points of a block or class, SI units.

    Distance of any length, forces of boxes as axle load.
    """
    values = section.si()
    if "curve_radius" in values:
        values["track_curvature"] = 1.0 / values.pop("curve_radius")
    if "duration" in values:
        values["distance"] = values.pop("duration") * values["speed"]
    if "revolutions" in values:
        values["distance"] = (
            2e-3 * np.pi * scene.wheelset.radius_mm * values.pop("revolutions")
        )
    if "axle_box_right" in values:
        right, left = values.pop("axle_box_right"), values.pop("axle_box_left")
        mass, apart = (
            scene.wheelset.mass_kg or 0.0,
            scene.wheelset.axle_box_distance_mm or 0.0,
        )
        values["axle_load"] = right + left + GRAVITY * mass
        values["box_moment"] = 0.5e-3 * apart * (right - left)
    return values


def _balanced_running(
    scene: RigScene | FieldScene,
    points: OperatingPoints,
    places: Sequence[KeyPath],
    bodies: _Bodies,
) -> Running | None:
    """State of the new wheelset under the forces that are controlled.

    None if nothing is.

    Raises
    ------
    SceneError
        With one fault for each block or class whose forces no state carries.
    """
    if points.controlled is None:
        return None
    models = contact_models(scene.contact)
    normal, tangential = PAIRS["fast"]
    quick, start = replace(models, normal=normal, tangential=tangential), None
    if (
        quick != models
    ):  # a start near the end: the walk through the track is the dearest part
        with suppress(StateError):
            start = settle(points.conditions, points.controlled, *bodies, quick)
    try:
        return settle(points.conditions, points.controlled, *bodies, models, start)
    except StateError as error:
        first = {places[k]: k for k in sorted(error.messages, reverse=True)}
        if points.controlled.bogies is not None:
            given = inputs_of(scene).route
            by_file = scene.vehicle is not None and scene.vehicle.route is not None
            track = given.track if by_file and given is not None else ()
            texts = {
                path: _without_balance(points, bodies, models, error, track, k)
                for path, k in first.items()
            }
        else:
            fix = "lower lateral_force_kN, or raise the load"
            texts = {
                path: f"{points.label[k]}: {error.messages[k]}; {fix}"
                for path, k in first.items()
            }
        raise SceneError(
            by_line([scene.fault(*text) for text in texts.items()])
        ) from None


def _without_balance(
    points: OperatingPoints,
    bodies: _Bodies,
    models: ContactModels,
    error: StateError,
    track: Sequence[Curve | Tangent] = (),
    row: int | None = None,
) -> str:
    """Message on a bogie without balance.

    Class, the segment of `track` most like it, and what would help.
    """
    row = min(error.messages) if row is None else row
    bogie = bogie_of(points.controlled, row)
    if points.controlled is None or bogie is None:
        return f"{points.label[row]}: {error.messages[row]}"
    curves = [
        (k, segment) for k, segment in enumerate(track) if isinstance(segment, Curve)
    ]
    segment_text = ""
    if curves:
        curvature = abs(float(points.conditions.track_curvature[row]))
        acceleration = abs(float(bogie.acceleration[0]))
        line, segment = min(
            curves,
            key=lambda row: (
                abs(abs(row[1].curvature) - curvature),
                abs(abs(row[1].acceleration) - acceleration),
            ),
        )
        segment_text = f" (like line {line + 2} of the route, {segment.name})"
    fix = what_helps(points.conditions, points.controlled, bogie, bodies, models)
    return f"{points.label[row]}{segment_text}: {error.messages[row]}; {fix}"
