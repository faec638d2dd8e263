"""The ingredients of a campaign, in SI units, from a scene that was read and checked."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from typing import Any, Literal

import numpy as np

from wearsim.contact.problem import PAIRS
from wearsim.contact.solve import ContactModels, Counterface, Wheelset, available_cores
from wearsim.damage.fatigue import FatigueSettings
from wearsim.damage.wear import WearSettings
from wearsim.errors import Fault, ProfileError, SceneError, say, shown
from wearsim.operation.bogie import GRAVITY
from wearsim.operation.points import (
    OperatingPoints,
    collective,
    programme,
    recorded_points,
    where_it_runs,
    with_monitors,
)
from wearsim.operation.recorded import Reducer, Reduction, reduce_samples
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
from wearsim.profile.shape import Profile
from wearsim.scene.campaign import (
    HALF_SPACE_DEPTHS,
    LIMIT_KEYS,
    STABILITY,
    CampaignSection,
    ControlSettings,
    CounterfaceWear,
    RailWearSection,
    ReprofilingRules,
)
from wearsim.scene.damage import (
    BrakeBlockSection,
    fatigue_settings,
    pressure_warnings,
    slip_warnings,
    wear_settings,
)
from wearsim.scene.inputs import inputs_of
from wearsim.scene.messages import by_line, scene_warnings, shift_ranges
from wearsim.scene.models import ContactSection, FieldScene, RecordedSection, RigScene, RollerSection
from wearsim.scene.section import Section
from wearsim.scene.vehicle import VehicleSection

_Bodies = tuple[Wheelset, Counterface]


@dataclass(frozen=True)
class CampaignSetup:
    """Everything a campaign is run with."""

    kind: Literal["rig", "field"]
    wheelset: Wheelset  # new wheels, with points at the scene's spacing
    counterface: Counterface  # rail or roller, placed
    models: ContactModels
    wear: WearSettings
    points: OperatingPoints  # load collective with monitoring points, where the new wheelset runs
    control: ControlSettings
    scene_text: str  # of the scene file
    title: str
    input_hashes: tuple[tuple[str, str], ...]  # name and SHA-256 of the scene file and of every profile
    warnings: tuple[str, ...]  # what deserves a second look, one line each
    also_evaluate: tuple[WearSettings, ...] = ()  # comparison laws, evaluated on the same contacts
    fatigue: tuple[FatigueSettings, ...] = ()
    counterface_wear: CounterfaceWear | None = None  # None: rails or rollers stay as they are
    templates: tuple[Profile, Profile] | None = None  # that right and left wheel are reprofiled to
    brake: BrakeBlockSection | None = None
    reduction: Reduction | None = None  # of a record to the operating points
    vehicle: str = ""  # name and source, and how it moves on straight track
    running: Running | None = None  # state of the new wheelset under controlled forces; None: nothing is


def build(scene: RigScene | FieldScene) -> CampaignSetup:
    """Make the ingredients of a campaign, in SI units, from a scene of `load_scene`.

    Of a compare scene, build its `rig` or its `field`.
    """
    inputs, contact, section = inputs_of(scene), scene.contact, scene.vehicle
    wear, *comparison = wear_settings(scene.wear, inputs.wear_table)
    models = contact_models(contact)
    wheelset = Wheelset(
        inputs.right, inputs.left, 1e-3 * scene.wheelset.radius_mm, inputs.half_span,
        1e-3 * scene.wheelset.wheel_diameter_difference_mm,
    )  # fmt: skip
    kappa, other = scene.counterface.curvature, getattr(scene.counterface, "left_curvature", None)
    first, *further = (Counterface(right, kappa, left, left_curvature=other) for right, left in inputs.rails)
    bodies = wheelset, replace(first, further=tuple(further))
    if scene.recorded is not None and scene._reduction is None:
        tolerance = scene.recorded.binning_tolerance
        scene._reduction = reduce_samples(scene._samples, _reducer(scene, bodies, wear), tolerance)
    points = _points(scene) if section is None else _on_route(scene, section, bodies, wear)
    points = _coupled(scene, _monitored(scene, points), bodies[1])
    running = _settled(scene, points, bodies)
    points = where_it_runs(points, running)
    if section is not None and section.positions == "frozen":
        points, running = replace(points, controlled=None), None
    return CampaignSetup(
        vehicle="" if section is None else f"{scene._route.about}; on straight track {section.tangent}",
        kind=scene.scene.kind,
        wheelset=wheelset,
        counterface=bodies[1],
        models=models,
        wear=wear,
        points=points,
        running=running,
        reduction=scene._reduction,
        control=_control_settings(scene.campaign),
        scene_text=scene.origin.content.decode("utf-8-sig"),
        title=scene.scene.title or scene.origin.path.stem,
        input_hashes=tuple((file.label, file.sha256) for file in inputs.files),
        # results name the file without its folder: the run reads a copy, and folders are private
        warnings=tuple(str(replace(one, file=scene.origin.path.name)) for one in warnings_of(scene)),
        also_evaluate=tuple(comparison),
        fatigue=fatigue_settings(scene.fatigue),
        counterface_wear=_counterface_wear(scene),
        templates=inputs.templates,
        brake=scene.wear.brake_block,
    )


def warnings_of(scene: RigScene | FieldScene) -> tuple[Fault, ...]:
    """Warnings of a loaded scene, in the order of the file, without those of `check_contact`."""
    inputs = inputs_of(scene)
    own = scene_warnings(scene, (inputs.right, inputs.left), inputs.counterface, inputs.clearances[0])
    # table, what stands for all samples or segments, and the error of that
    reduced_to: list[tuple[str, RecordedSection | VehicleSection, str, float]] = []
    if scene.recorded is not None and scene._reduction is not None:
        count = f"{len(scene._reduction.group)} operating points"
        reduced_to.append(("recorded", scene.recorded, count, scene._reduction.error))
    if scene.vehicle is not None:
        reduced_to.append(("vehicle", scene.vehicle, f"{len(scene._track)} classes", scene._error))
    for table, section, count, error in reduced_to:
        if error > section.binning_tolerance:
            text = say("scene.binning", section=section, count=count, error=error)
            own.append(scene.fault((table, "binning_tolerance"), text))
    normal, tangential = scene.contact.pair
    own += [scene.fault(*one) for one in slip_warnings(scene.wear, inputs.wear_table, tangential)]
    own += [scene.fault(*one) for one in pressure_warnings(scene.fatigue, normal)]
    if isinstance(scene, RigScene) and (text := _cut_loop(scene)):
        own.append(scene.fault(("campaign", "distance_km"), text))
    return tuple(by_line([*inputs.warnings, *own]))


def _cut_loop(scene: RigScene) -> str:
    """Say which blocks act, and for how much of the distance, where it is shorter than a loop of them."""
    blocks = scene.operation.blocks
    lengths = np.array([_run(scene, block)["distance"] for block in blocks])
    loop, distance = float(lengths.sum()), 1e3 * scene.campaign.distance_km
    if scene.operation.together or len(blocks) < 2 or distance >= loop * (1.0 - 1e-9):
        return ""
    acting = np.clip(distance - (np.cumsum(lengths) - lengths), 0.0, lengths)
    rows = [
        f"{shown(block.name)} {100.0 * own / distance:.3g} % (of the loop {100.0 * length / loop:.3g} %)"
        for block, own, length in zip(blocks, acting, lengths, strict=True)
    ]
    more = f" and {len(rows) - 4} more" if len(rows) > 4 else ""
    return say("scene.cut_loop", distance=1e-3 * distance, loop=loop, rows=", ".join(rows[:4]) + more)


def contact_models(contact: ContactSection) -> ContactModels:
    """Contact models, grid and material of [contact], in SI units."""
    values = contact.si()
    return ContactModels(
        *contact.pair,
        **{key: values[key] for key in ("strips", "cells", "most_cells")},
        cell_size=values["cell"],
        youngs_modulus=values["youngs"],
        poisson_ratio=values["poisson"],
        parameters=(("virtual_penetration_factor", contact.virtual_penetration_factor),),
    )


def _control_settings(campaign: CampaignSection) -> ControlSettings:
    """Make the settings of the steps: the keys of [campaign] that `ControlSettings` has, and its tables."""
    values, limits, rules = campaign.si(), campaign.limits, campaign.reprofiling
    values |= {"depth_cap": values["max_step_depth"], "reprofiling": None}
    values["first_depth"] = values["first_step_depth"]
    values.setdefault("stability", STABILITY[campaign.integrator][0])
    values["half_space_depths"] = HALF_SPACE_DEPTHS[campaign.integrator]
    values["limits"] = () if limits is None else tuple(limits.values.items())
    values["end_at_limit"] = limits is not None and limits.end
    if rules is not None:
        names = {key: name for name, key in LIMIT_KEYS.items()}
        values["reprofiling"] = ReprofilingRules(
            limits=tuple(names[key] for key in rules.at_limits),
            places=tuple(1e3 * place for place in rules.at_km),
            cut=1e-3 * rules.cut_mm,
        )
    own = {field.name for field in fields(ControlSettings)}
    return ControlSettings(**{name: value for name, value in values.items() if name in own})


def _counterface_wear(scene: RigScene | FieldScene) -> CounterfaceWear | None:
    counterface = scene.counterface
    if counterface.wear is None:
        return None
    if isinstance(counterface.wear, RailWearSection):
        return CounterfaceWear(area_rate=1e-12 * counterface.wear.area_mm2_per_1000km)
    values = counterface.wear.si()
    if "redress_every" in values:
        values["redress_distance"] = values.pop("redress_every")
    assert isinstance(counterface, RollerSection)
    return CounterfaceWear(radius=1.0 / counterface.curvature, **values)


def _reducer(scene: RigScene | FieldScene, bodies: _Bodies, wear: WearSettings) -> Reducer:
    """Make what weighs samples and segments: coarse models, alike for all of them and for the points."""
    models = ContactModels.of(
        "fast", strips=12, cells=12, cell_size=1e-3, youngs_modulus=1e9 * scene.contact.youngs_GPa,
        poisson_ratio=scene.contact.poisson,
    )  # fmt: skip
    wavelength = 1e-3 * scene.campaign.smoothing_wavelength_mm
    return Reducer(*bodies, models, wear, wavelength, threads=available_cores())


def _points(scene: RigScene | FieldScene) -> OperatingPoints:
    """Operating points of blocks, classes or a record."""
    contact, reduction = scene.contact, scene._reduction
    runs = [_run(scene, section) for section in scene.operation.runs.values()]
    balanced = any("axle_load" in run or "lateral_force" in run for run in runs)
    motion: dict[str, Any] = {
        "rotation": contact.rotation,
        "torque": contact.torque_Nm,
        "free_roll": contact.roll == "free" or balanced or reduction is not None,
    }
    if scene.recorded is not None and reduction is not None:
        found, common = reduction.points, np.full(reduction.points.distance.size, scene.recorded.environment)
        set_points = {**found.values, "environment": common}
        return recorded_points(set_points, found.distance, reduction.group, **motion)
    if not isinstance(scene, RigScene):
        return collective(runs, **motion)
    points = programme(runs, **motion)
    stationary = np.zeros_like(points.block_length)
    return replace(points, block_length=stationary) if scene.operation.together else points


def _on_route(
    scene: RigScene | FieldScene, section: VehicleSection, bodies: _Bodies, wear: WearSettings
) -> OperatingPoints:
    """Operating points of a vehicle on its route; on straight track it moves as with new wheels."""
    given, inputs, (wheelset, counterface) = scene._route, inputs_of(scene), bodies
    spread = max((one.std for one in given.track if isinstance(one, Tangent)), default=0.0)
    models = contact_models(scene.contact)
    motions = []
    for rails, clearances in zip((counterface, *counterface.further), inputs.clearances, strict=True):
        clearance = min((one for one in clearances if one is not None), default=math.inf)
        amplitude = min(max(math.sqrt(2.0) * spread, 1e-3), clearance)
        try:
            profiles = wheelset.right, wheelset.left, rails.profile
            conicity = equivalent_conicity(*profiles, amplitude=amplitude) or LEAST_CONICITY
        except ProfileError as error:
            text = f"no equivalent conicity: {error}"
            raise SceneError([scene.fault(("vehicle", "tangent"), text)]) from None
        motions.append(
            Motion(
                rule=section.tangent,
                wavelength=section.tangent_wavelength_m or klingel(wheelset, conicity),
                creep=creep_coefficients(wheelset, rails, models, 0.5 * given.vehicle.axle_load),
                conicity=conicity,
                clearance=clearance,
            )
        )

    def on(track: Sequence[Curve | Tangent]) -> OperatingPoints:
        return route(track, given.vehicle, given.shares, motions, wheelset, scene.contact.rotation)

    def worn(track: Sequence[Curve | Tangent]) -> np.ndarray:
        points = on(track)
        where = points.conditions
        if points.controlled is not None:
            try:
                found = settle(where, points.controlled, *bodies, reducer.models, threads=reducer.threads)
            except StateError as error:
                text = _without_balance(points, bodies, reducer.models, error, given.track)
                raise SceneError([scene.fault(("vehicle", "route"), text)]) from None
            where = found.conditions(where)
        share = points.weight * points.environment
        return np.tensordot(share, reducer.worn(where)[0], axes=1)

    if not scene._track:
        reducer = _reducer(scene, bodies, wear)
        scene._track, scene._error = reduced(given.track, worn, section.binning_tolerance)
    points = on(scene._track)
    scene._of_track = points.of_track
    return points


def _monitored(scene: RigScene | FieldScene, points: OperatingPoints) -> OperatingPoints:
    """Operating points with those that are watched."""
    monitor = scene.operation.monitor
    if monitor is None:
        return points
    values = monitor.si()
    values["wheel_load"] = values.pop("load")
    return with_monitors(points, 1e-3 * np.array(monitor.shifts_mm, dtype=np.float64), **values)


def _coupled(scene: RigScene | FieldScene, points: OperatingPoints, below: Counterface) -> OperatingPoints:
    """Operating points on rollers that turn alike: those of unlike radii run at unlike speeds."""
    if below.coupled_difference == 0.0 or getattr(scene.counterface, "drive", None) == "independent":
        return points
    apart = np.full(points.weight.size, below.coupled_difference)
    return replace(points, conditions=replace(points.conditions, speed_difference=apart))


def _run(scene: RigScene | FieldScene, section: Section) -> dict[str, Any]:
    """Set-points of a block or class, SI units: the distance of any length, forces on boxes as axle load."""
    values = section.si()
    if "curve_radius" in values:
        values["track_curvature"] = 1.0 / values.pop("curve_radius")
    if "duration" in values:
        values["distance"] = values.pop("duration") * values["speed"]
    if "revolutions" in values:
        values["distance"] = 2e-3 * np.pi * scene.wheelset.radius_mm * values.pop("revolutions")
    if "axle_box_right" in values:
        right, left = values.pop("axle_box_right"), values.pop("axle_box_left")
        mass, apart = scene.wheelset.mass_kg or 0.0, scene.wheelset.axle_box_distance_mm or 0.0
        values["axle_load"] = right + left + GRAVITY * mass
        values["box_moment"] = 0.5e-3 * apart * (right - left)
    return values


def take_over(scene: RigScene | FieldScene, known: RigScene | FieldScene) -> None:
    """Take over what `build` searched for from a scene that was built, if the files of both are the same."""
    ours, theirs = ([(file.role, file.sha256) for file in inputs_of(one).files] for one in (scene, known))
    if ours == theirs:
        scene._running, scene._reduction = known._running, known._reduction
        scene._track, scene._error = known._track, known._error


def _settled(scene: RigScene | FieldScene, points: OperatingPoints, bodies: _Bodies) -> Running | None:
    """Where the new wheelset runs under the forces that are controlled; None if nothing is.

    Raises
    ------
    SceneError
        With one fault for each block or class whose forces no state carries.
    """
    if points.controlled is not None and scene._running is None:
        models = contact_models(scene.contact)
        normal, tangential = PAIRS["fast"]
        quick, start = replace(models, normal=normal, tangential=tangential), None
        if quick != models:  # a start near the end: the walk through the track is the dearest part
            with suppress(StateError):
                start = settle(points.conditions, points.controlled, *bodies, quick)
        try:
            scene._running = settle(points.conditions, points.controlled, *bodies, models, start)
        except StateError as error:
            places = [path for path, _, _, count in shift_ranges(scene) for _ in range(count)]
            first = {places[k]: k for k in sorted(error.messages, reverse=True)}
            if points.controlled.bogies is not None:
                by_file = scene.vehicle is not None and scene.vehicle.route is not None
                track = scene._route.track if by_file else ()
                texts = {
                    path: _without_balance(points, bodies, models, error, track, k)
                    for path, k in first.items()
                }
            else:
                fix = "lower lateral_force_kN, or raise the load"
                texts = {path: f"{points.label[k]}: {error.messages[k]}; {fix}" for path, k in first.items()}
            raise SceneError(by_line([scene.fault(*text) for text in texts.items()])) from None
    return scene._running


def _without_balance(
    points: OperatingPoints,
    bodies: _Bodies,
    models: ContactModels,
    error: StateError,
    track: Sequence[Curve | Tangent] = (),
    row: int | None = None,
) -> str:
    """Message on a bogie without balance: class, the segment of `track` most like it, and what would help."""
    row = min(error.messages) if row is None else row
    bogie = bogie_of(points.controlled, row)
    if points.controlled is None or bogie is None:
        return f"{points.label[row]}: {error.messages[row]}"
    curves = [(k, segment) for k, segment in enumerate(track) if isinstance(segment, Curve)]
    like = ""
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
        like = say("state.segment", line=line + 2, name=segment.name)
    fix = what_helps(points.conditions, points.controlled, bogie, bodies, models)
    return f"{points.label[row]}{like}: {error.messages[row]}; {fix}"
