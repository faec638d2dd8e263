"""The ingredients of a campaign, in SI units, from a scene read and checked."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Literal

import numpy as np

from wearsim.contact.solve import ContactModels, Counterface, Wheelset
from wearsim.damage.fatigue import FatigueSettings
from wearsim.damage.wear import WearSettings
from wearsim.errors import Fault, shown
from wearsim.operation.points import OperatingPoints
from wearsim.operation.recorded import Reduction
from wearsim.operation.states import Running
from wearsim.profile.measures import EN_15313, MeasuringRule
from wearsim.profile.shape import Profile
from wearsim.quantities import kilometres
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
from wearsim.scene.checks import by_line, scene_warnings
from wearsim.scene.damage import (
    BrakeBlockSection,
    fatigue_settings,
    pressure_warnings,
    slip_warnings,
    wear_settings,
)
from wearsim.scene.inputs import inputs_of
from wearsim.scene.models import FieldScene, Origin, RigScene, RollerSection
from wearsim.scene.prepared import (
    Prepared,
    bodies_of,
    contact_models,
    prepare,
    set_points_of,
)
from wearsim.scene.recorded import RecordedSection
from wearsim.scene.vehicle import VehicleSection

_ON_STRAIGHT_TRACK = {
    "suspended": "held by its yaw stiffness",
    "kinematic": "free to roll",
    "guided": "held parallel while it moves",
    "shifted": "shifted without moving",
}
"""What wheelsets do on straight track, by `tangent` of [vehicle]."""


@dataclass(frozen=True)
class CampaignSetup:
    """Everything a campaign is run with."""

    kind: Literal["rig", "field"]
    wheelset: Wheelset  # new wheels, with points at the scene's spacing
    counterface: Counterface  # rail or roller, placed
    models: ContactModels
    wear: WearSettings
    # load collective with monitoring points, where the new wheelset runs
    points: OperatingPoints
    control: ControlSettings
    scene_text: str  # of the scene file
    title: str
    input_hashes: tuple[
        tuple[str, str], ...
    ]  # name and SHA-256 of the scene file and of every profile
    warnings: tuple[str, ...]  # what deserves a second look, one line each
    also_evaluate: tuple[
        WearSettings, ...
    ] = ()  # comparison laws, evaluated on the same contacts
    fatigue: tuple[FatigueSettings, ...] = ()
    counterface_wear: CounterfaceWear | None = (
        None  # None: rails or rollers stay as they are
    )
    templates: tuple[Profile, Profile] | None = (
        None  # that right and left wheel are reprofiled to
    )
    brake: BrakeBlockSection | None = None
    reduction: Reduction | None = None  # of a record to the operating points
    vehicle: str = ""  # name and source, and how it moves on straight track
    # places at which Sh, Sd, qR and the diameter are measured
    measuring: MeasuringRule = EN_15313
    conicity_amplitude: float = 3e-3  # of the lateral motion [m]
    running: Running | None = (
        None  # state of the new wheelset under controlled forces; None: nothing is
    )


def build(
    scene: RigScene | FieldScene, prepared: Prepared | None = None
) -> CampaignSetup:
    """Make the ingredients of a campaign, in SI units, from a scene of `load_scene`.

    Of a compare scene, build its `rig` or its `field`. By default, what is solved from
    the scene is solved here.
    """
    prepared = prepare(scene) if prepared is None else prepared
    inputs, section, (wheelset, counterface) = (
        inputs_of(scene),
        scene.vehicle,
        bodies_of(scene),
    )
    wear, *comparison = wear_settings(scene.wear, inputs.wear_table)
    vehicle = ""
    if section is not None and inputs.route is not None:
        motion = _ON_STRAIGHT_TRACK[section.tangent]
        vehicle = f"{inputs.route.about}; on straight track {motion}"
    warnings = warnings_of(scene, prepared)
    return CampaignSetup(
        vehicle=vehicle,
        kind=scene.scene.kind,
        wheelset=wheelset,
        measuring=scene.wheelset.measuring_rule,
        conicity_amplitude=1e-3 * scene.wheelset.conicity_amplitude_mm,
        counterface=counterface,
        models=contact_models(scene.contact),
        wear=wear,
        points=prepared.points,
        running=prepared.running,
        reduction=prepared.reduction,
        control=_control_settings(scene.campaign),
        scene_text=scene.origin.content.decode("utf-8-sig"),
        title=scene.scene.title or scene.origin.path.stem,
        input_hashes=tuple((file.label, file.sha256) for file in inputs.files),
        warnings=tuple(str(_in_results(warning, scene.origin)) for warning in warnings),
        also_evaluate=tuple(comparison),
        fatigue=fatigue_settings(scene.fatigue),
        counterface_wear=_counterface_wear(scene),
        templates=inputs.templates,
        brake=scene.wear.brake_block,
    )


def _in_results(warning: Fault, origin: Origin) -> Fault:
    """Warning with the name of its file without folders, which are private.

    A copy that was written with overrides has lines of its own, and is named with the
    folder of the copies.
    """
    path = Path(warning.file or origin.path)
    copied = path == origin.path and origin.with_overrides
    return replace(
        warning,
        file=f"{path.absolute().parent.name}/{path.name}" if copied else path.name,
    )


def warnings_of(
    scene: RigScene | FieldScene, prepared: Prepared | None = None
) -> tuple[Fault, ...]:
    """Warnings of a loaded scene, in its order, without those of `check_contact`.

    Those on classes of a record or a route only once it is prepared.
    """
    inputs = inputs_of(scene)
    warnings = scene_warnings(
        scene, (inputs.right, inputs.left), inputs.counterface, inputs.clearances[0]
    )
    # table, what stands for all samples or segments, and the error of that
    reduced_to: list[tuple[str, RecordedSection | VehicleSection, str, float]] = []
    if (
        scene.recorded is not None
        and prepared is not None
        and prepared.reduction is not None
    ):
        count = f"{len(prepared.reduction.group)} operating points"
        read = () if inputs.samples is None else inputs.samples.notes
        warnings += [
            scene.fault(("recorded", "file"), f"file = {scene.recorded.file}: {note}")
            for note in prepared.reduction.kept.notes
            if note not in read
        ]
        reduced_to.append(("recorded", scene.recorded, count, prepared.reduction.error))
    if scene.vehicle is not None and prepared is not None:
        reduced_to.append(
            ("vehicle", scene.vehicle, f"{len(prepared.track)} classes", prepared.error)
        )
    for table, section, count, error in reduced_to:
        if error > section.binning_tolerance:
            text = (
                f"binning_tolerance = {section.binning_tolerance:g}: {count} leave an "
                f"error of {error:.2g}"
            )
            warnings.append(scene.fault((table, "binning_tolerance"), text))
    normal, tangential = scene.contact.pair
    warnings += [
        scene.fault(*message)
        for message in slip_warnings(scene.wear, inputs.wear_table, tangential)
    ]
    warnings += [
        scene.fault(*message) for message in pressure_warnings(scene.fatigue, normal)
    ]
    if isinstance(scene, RigScene) and (text := _cut_loop(scene)):
        warnings.append(scene.fault(("campaign", "distance_km"), text))
    return tuple(by_line([*inputs.warnings, *warnings]))


def _cut_loop(scene: RigScene) -> str:
    """Say which blocks act, and for how much of the distance.

    Where it is shorter than a loop of them.
    """
    blocks = scene.operation.blocks
    lengths = np.array([set_points_of(scene, block)["distance"] for block in blocks])
    loop, distance = float(lengths.sum()), 1e3 * scene.campaign.distance_km
    if scene.operation.together or len(blocks) < 2 or distance >= loop * (1.0 - 1e-9):
        return ""
    acting = np.clip(distance - (np.cumsum(lengths) - lengths), 0.0, lengths)
    rows = [
        (
            f"{shown(block.name)} {100.0 * acted / distance:.3g} % (of the loop "
            f"{100.0 * length / loop:.3g} %)"
        )
        for block, acted, length in zip(blocks, acting, lengths, strict=True)
    ]
    more = f" and {len(rows) - 4} more" if len(rows) > 4 else ""
    return (
        f"distance_km = {1e-3 * distance:g} is less than one loop of the programme, "
        f"{kilometres(loop)}; of the distance act {', '.join(rows[:4])}{more}: give a "
        "longer distance, shorter blocks, or together = true in [operation]"
    )


def _control_settings(campaign: CampaignSection) -> ControlSettings:
    """Make the settings of the steps.

    The keys of [campaign] that `ControlSettings` has, and its tables.
    """
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
    field_names = {field.name for field in fields(ControlSettings)}
    return ControlSettings(
        **{name: value for name, value in values.items() if name in field_names}
    )


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
