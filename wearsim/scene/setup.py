"""The ingredients of a campaign, in SI units, from a scene that was read and checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, Literal

import numpy as np

from wearsim.contact.solve import ContactModels, Counterface, Wheelset
from wearsim.damage.fatigue import FatigueSettings
from wearsim.damage.wear import WearSettings
from wearsim.errors import Fault
from wearsim.operation.points import Block, OperatingPoints, TrackClass, collective, programme, with_monitors
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
from wearsim.scene.damage import fatigue_settings, wear_settings
from wearsim.scene.messages import by_line, scene_warnings
from wearsim.scene.models import ContactSection, FieldScene, RigScene, RollerSection
from wearsim.scene.read import inputs_of

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
    points: OperatingPoints  # load collective with monitoring points
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


def build(scene: RigScene | FieldScene) -> CampaignSetup:
    """Make the ingredients of a campaign, in SI units, from a scene of `load_scene`.

    Of a compare scene, build its `rig` or its `field`.
    """
    inputs, contact, curvature = inputs_of(scene), scene.contact, scene.counterface.curvature
    wear, *comparison = wear_settings(scene.wear, inputs.wear_table)
    models, *fallbacks = contact_models(contact)
    return CampaignSetup(
        tolerance=contact.tolerance if fallbacks else None,
        fallbacks=tuple(fallbacks),
        kind=scene.scene.kind,
        wheelset=Wheelset(inputs.right, inputs.left, 1e-3 * scene.wheelset.radius_mm, inputs.half_span),
        counterface=Counterface(inputs.counterface, curvature),
        models=models,
        wear=wear,
        points=_points(scene),
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
    )


def warnings_of(scene: RigScene | FieldScene) -> tuple[Fault, ...]:
    """Warnings of a loaded scene, in the order of the file, without those of `check_contact`."""
    inputs = inputs_of(scene)
    own = scene_warnings(scene, (inputs.right, inputs.left), inputs.counterface, inputs.clearance)
    return tuple(by_line([*inputs.warnings, *own]))


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
    return CounterfaceWear(radius=1e-3 * counterface.roller_radius_mm, **values)


def _points(scene: RigScene | FieldScene) -> OperatingPoints:
    contact, monitor = scene.contact, scene.operation.monitor
    runs = []
    for section in scene.operation.runs.values():
        values = section.si()
        values["wheel_load"] = values.pop("load")
        if "curve_radius" in values:
            values["track_curvature"] = 1.0 / values.pop("curve_radius")
        runs.append(values)
    motion: dict[str, Any] = {
        "rotation": contact.rotation,
        "torque": contact.torque_Nm,
        "free_roll": contact.roll == "free",
    }
    if isinstance(scene, RigScene):
        points = programme([Block(**values) for values in runs], **motion)
    else:
        points = collective([TrackClass(**values) for values in runs], **motion)
    if monitor is None:
        return points
    values = monitor.si()
    values["wheel_load"] = values.pop("load")
    return with_monitors(points, 1e-3 * np.array(monitor.shifts_mm, dtype=np.float64), **values)
