"""The ingredients of a campaign, in SI units, from a scene that was read and checked."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Literal

import numpy as np

from wearsim.contact.solve import ContactModels, Counterface, Wheelset, available_cores
from wearsim.damage.fatigue import FatigueSettings
from wearsim.damage.wear import WearSettings
from wearsim.errors import Fault, ProfileError, SceneError
from wearsim.operation.bogie import GRAVITY, Vehicle
from wearsim.operation.points import (
    OperatingPoints,
    collective,
    programme,
    recorded_points,
    where_it_runs,
    with_monitors,
)
from wearsim.operation.recorded import Reducer, Reduction, Samples, reduce_samples
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
    LIMIT_KEYS,
    STABILITY,
    CampaignSection,
    ControlSettings,
    CounterfaceWear,
    RailWearSection,
    ReprofilingRules,
)
from wearsim.scene.damage import BrakeBlockSection, fatigue_settings, wear_settings
from wearsim.scene.messages import by_line, scene_warnings, shift_ranges
from wearsim.scene.models import ContactSection, FieldScene, RigScene, RollerSection
from wearsim.scene.read import inputs_of
from wearsim.scene.section import Section
from wearsim.scene.vehicle import Route
from wearsim.toml_faults import shown

OF_BOGIES = "raise curve_radius_m, lower cant_deficiency_mm or friction, or give another vehicle"
"""What to do where a bogie has no balance."""

CHAINS: Mapping[str, tuple[tuple[str, str], ...]] = {
    "auto": (("kik_piotrowski", "fastsim"), ("knothe_le_the", "fastsim"), ("half_space", "half_space")),
    "accurate": (("half_space", "half_space"),),
}
"""Normal and tangential models of each `model` of [contact], in the order in which they are tried; all but
the last are corrected by the last."""


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
    fallbacks: tuple[ContactModels, ...] = ()  # in order, where `models` have no solution
    # error of the wear depth over the largest one at which the correction by the last fallback aims [-]
    tolerance: float | None = None
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
    inputs, contact, curvature = inputs_of(scene), scene.contact, scene.counterface.curvature
    wear, *comparison = wear_settings(scene.wear, inputs.wear_table)
    models, *fallbacks = contact_models(contact)
    wheelset = Wheelset(
        inputs.right, inputs.left, 1e-3 * scene.wheelset.radius_mm, inputs.half_span,
        1e-3 * scene.wheelset.wheel_diameter_difference_mm,
    )  # fmt: skip
    first, *further = (Counterface(right, curvature, left) for right, left in inputs.rails)
    counterface = replace(first, further=tuple(further))
    reduction = None
    if isinstance(scene, FieldScene) and scene.recorded is not None:
        reduction = _reduced(scene, (wheelset, counterface), wear)
    vehicle = scene.vehicle if isinstance(scene, FieldScene) else None
    if isinstance(scene, FieldScene) and vehicle is not None:
        points = _monitored(scene, _on_route(scene, (wheelset, counterface), wear))
    else:
        points = _monitored(scene, _points(scene, reduction))
    running = _settled(scene, points, (wheelset, counterface))
    if vehicle is not None and vehicle.positions == "frozen":
        points, running = replace(where_it_runs(points, running), controlled=None), None
    return CampaignSetup(
        vehicle=_about_vehicle(scene),
        tolerance=contact.tolerance if fallbacks else None,
        fallbacks=tuple(fallbacks),
        kind=scene.scene.kind,
        wheelset=wheelset,
        counterface=counterface,
        models=models,
        wear=wear,
        points=where_it_runs(points, running),
        running=running,
        reduction=reduction,
        control=_control_settings(scene.campaign),
        scene_text=scene.origin.content.decode("utf-8-sig"),
        title=scene.scene.title or scene.origin.path.stem,
        input_hashes=tuple((file.label, file.sha256) for file in inputs.files),
        warnings=tuple(
            # results name the file without its folder: the run reads a copy, and folders are private
            str(replace(warning, file=scene.origin.path.name))
            for warning in warnings_of(scene)
        ),
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
    if isinstance(scene, FieldScene) and scene.recorded is not None:
        found, tolerance = scene._reduction, scene.recorded.binning_tolerance
        if isinstance(found, Reduction) and found.error > tolerance:
            text = f"binning_tolerance = {tolerance:g}: {len(found.group)} operating points leave an error of"
            own.append(scene.fault(("recorded", "binning_tolerance"), f"{text} {found.error:.2g}"))
    route = scene.vehicle if isinstance(scene, FieldScene) else None
    if isinstance(scene, FieldScene) and route is not None and scene._error > route.binning_tolerance:
        text = (
            f"binning_tolerance = {route.binning_tolerance:g}: {len(scene._track)} classes leave an error of"
        )
        own.append(scene.fault(("vehicle", "binning_tolerance"), f"{text} {scene._error:.2g}"))
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
    return (
        f"distance_km = {1e-3 * distance:g} is less than one loop of the programme, {1e-3 * loop:g} km; of "
        f"the distance act {', '.join(rows[:4])}{more}: give a longer distance, shorter blocks, or together"
        " = true in [operation]"
    )


def contact_models(contact: ContactSection) -> list[ContactModels]:
    """Contact models in the order in which they are tried, grid and material of [contact], in SI units."""
    given = ContactModels(
        normal=contact.normal,
        tangential=contact.tangential,
        strips=contact.strips,
        cells=contact.cells,
        cell_size=1e-3 * contact.cell_mm,
        most_cells=contact.most_cells,
        youngs_modulus=1e9 * contact.youngs_GPa,
        poisson_ratio=contact.poisson,
        parameters=(("virtual_penetration_factor", contact.virtual_penetration_factor),),
    )
    pairs = CHAINS[contact.model] if contact.model else ((contact.normal, contact.tangential),)
    return [replace(given, normal=normal, tangential=tangential) for normal, tangential in pairs]


def _control_settings(campaign: CampaignSection) -> ControlSettings:
    """Make the settings of the steps: the keys of [campaign] that `ControlSettings` has, and its tables."""
    values, limits, rules = campaign.si(), campaign.limits, campaign.reprofiling
    values |= {"depth_cap": values["max_step_depth"], "reprofiling": None}
    values["first_depth"] = values["first_step_depth"]
    values.setdefault("stability", STABILITY[campaign.integrator][0])
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


def _reduced(scene: FieldScene, bodies: tuple[Wheelset, Counterface], wear: WearSettings) -> Reduction:
    """Reduce the record of a scene to operating points, once."""
    samples, section = scene._samples, scene.recorded
    assert isinstance(samples, Samples)
    assert section is not None
    if scene._reduction is None:
        scene._reduction = reduce_samples(samples, _reducer(scene, bodies, wear), section.binning_tolerance)
    reduction = scene._reduction
    assert isinstance(reduction, Reduction)
    return reduction


def _about_vehicle(scene: RigScene | FieldScene) -> str:
    if isinstance(scene, RigScene) or scene.vehicle is None or not isinstance(scene._route, Route):
        return ""
    return f"{scene._route.about}; on straight track {scene.vehicle.tangent}"


def _reducer(scene: FieldScene, bodies: tuple[Wheelset, Counterface], wear: WearSettings) -> Reducer:
    """Make what weighs samples and segments: coarse models, alike for all of them and for the points."""
    models = ContactModels(
        strips=12, cells=12, cell_size=1e-3, youngs_modulus=1e9 * scene.contact.youngs_GPa,
        poisson_ratio=scene.contact.poisson,
    )  # fmt: skip
    wavelength = 1e-3 * scene.campaign.smoothing_wavelength_mm
    return Reducer(*bodies, models, wear, wavelength, threads=available_cores())


def _points(scene: RigScene | FieldScene, reduction: Reduction | None) -> OperatingPoints:
    contact = scene.contact
    runs = [_run(scene, section) for section in scene.operation.runs.values()]
    balanced = any("axle_load" in run or "lateral_force" in run for run in runs)
    motion: dict[str, Any] = {
        "rotation": contact.rotation,
        "torque": contact.torque_Nm,
        "free_roll": contact.roll == "free" or balanced or reduction is not None,
    }
    if reduction is not None:
        assert isinstance(scene, FieldScene)
        assert scene.recorded is not None
        found, common = reduction.points, np.full(reduction.points.distance.size, scene.recorded.environment)
        set_points = {**found.values, "environment": common}
        return recorded_points(set_points, found.distance, reduction.group, **motion)
    if not isinstance(scene, RigScene):
        return collective(runs, **motion)
    points = programme(runs, **motion)
    stationary = np.zeros_like(points.block_length)
    return replace(points, block_length=stationary) if scene.operation.together else points


def _on_route(scene: FieldScene, bodies: tuple[Wheelset, Counterface], wear: WearSettings) -> OperatingPoints:
    """Operating points of a vehicle on its route; on straight track it moves as with new wheels."""
    section, given = scene.vehicle, scene._route
    assert section is not None
    assert isinstance(given, Route)
    vehicle, (wheelset, counterface) = given.vehicle, bodies
    rails = zip((counterface, *counterface.further), inputs_of(scene).clearances, strict=True)
    motions = [_motion(scene, vehicle, wheelset, *one) for one in rails]

    def on(track: Sequence[Curve | Tangent]) -> OperatingPoints:
        return route(track, vehicle, given.shares, motions, wheelset, scene.contact.rotation)

    def worn(track: Sequence[Curve | Tangent]) -> np.ndarray:
        points = on(track)
        where = points.conditions
        if points.controlled is not None:
            found = settle(where, points.controlled, *bodies, reducer.models, threads=reducer.threads)
            where = found.conditions(where)
        share = points.weight * points.environment
        return np.tensordot(share, reducer.worn(where)[0], axes=1)

    if not scene._track:
        reducer = _reducer(scene, bodies, wear)
        try:
            scene._track, scene._error = reduced(given.track, worn, section.binning_tolerance)
        except StateError as error:
            text = next(iter(error.messages.values()))
            raise SceneError([scene.fault(("vehicle", "route"), f"{text}; {OF_BOGIES}")]) from None
    points = on(scene._track)
    scene._of_track = points.of_track
    return points


def _motion(
    scene: FieldScene,
    vehicle: Vehicle,
    wheelset: Wheelset,
    rails: Counterface,
    clearances: tuple[float | None, float | None],
) -> Motion:
    """Motion of a vehicle on straight track, on one pair of rails."""
    section, given = scene.vehicle, scene._route
    assert section is not None
    assert isinstance(given, Route)
    spread = max((one.std for one in given.track if isinstance(one, Tangent)), default=0.0)
    clearance = min((one for one in clearances if one is not None), default=math.inf)
    amplitude = min(max(math.sqrt(2.0) * spread, 1e-3), clearance)
    try:
        conicity = equivalent_conicity(wheelset.right, wheelset.left, rails.profile, amplitude=amplitude)
    except ProfileError as error:
        raise SceneError([scene.fault(("vehicle", "tangent"), f"no equivalent conicity: {error}")]) from None
    conicity, (models, *_) = conicity or LEAST_CONICITY, contact_models(scene.contact)
    return Motion(
        rule=section.tangent,
        wavelength=section.tangent_wavelength_m or klingel(wheelset, conicity),
        creep=creep_coefficients(wheelset, rails, models, 0.5 * vehicle.axle_load),
        conicity=conicity,
        clearance=clearance,
    )


def _monitored(scene: RigScene | FieldScene, points: OperatingPoints) -> OperatingPoints:
    """Operating points with those that are watched."""
    monitor = scene.operation.monitor
    if monitor is None:
        return points
    values = monitor.si()
    values["wheel_load"] = values.pop("load")
    return with_monitors(points, 1e-3 * np.array(monitor.shifts_mm, dtype=np.float64), **values)


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


def _settled(
    scene: RigScene | FieldScene, points: OperatingPoints, bodies: tuple[Wheelset, Counterface]
) -> Running | None:
    """Where the new wheelset runs under the forces that are controlled; None if nothing is.

    Raises
    ------
    SceneError
        With one fault for each block or class whose forces no state carries.
    """
    if points.controlled is None:
        return None
    if scene._running is None:
        models, *_ = contact_models(scene.contact)
        try:
            scene._running = settle(points.conditions, points.controlled, *bodies, models)
        except StateError as error:
            places = [path for path, _, _, count in shift_ranges(scene) for _ in range(count)]
            texts = {
                places[k]: f"{points.label[k]}: {text}" for k, text in sorted(error.messages.items())[::-1]
            }
            fix = "lower lateral_force_kN, or raise the load"
            if points.controlled.bogies is not None:
                fix = OF_BOGIES
            faults = [scene.fault(path, f"{text}; {fix}") for path, text in texts.items()]
            raise SceneError(by_line(faults)) from None
    running = scene._running
    assert isinstance(running, Running)
    return running
