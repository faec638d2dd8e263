"""The ingredients of a campaign, in SI units, from a scene that was read and checked."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from wearsim.contact.solve import ContactModels, Counterface, Wheelset
from wearsim.damage.fatigue import FatigueSettings
from wearsim.damage.wear import WearSettings
from wearsim.errors import Fault
from wearsim.operation.control import ControlSettings, CounterfaceWear
from wearsim.operation.points import Block, OperatingPoints, TrackClass, collective, programme, with_monitors
from wearsim.profile.shape import Profile
from wearsim.scene.campaign import control_settings
from wearsim.scene.counterface import counterface_wear
from wearsim.scene.cross_checks import limit_faults, scene_warnings
from wearsim.scene.damage import comparison_settings, fatigue_settings, wear_settings
from wearsim.scene.inputs import InputFile, Inputs
from wearsim.scene.models import ContactSection, FieldScene, RigScene


@dataclass(frozen=True)
class CampaignSetup:
    """Everything a campaign is run with.

    Parameters
    ----------
    kind : {"rig", "field"}
        Of the scene.
    wheelset : Wheelset
        New wheels, with points at the scene's spacing.
    counterface : Counterface
        Rail or roller, placed.
    models : ContactModels
        Of the contact.
    wear : WearSettings
        Law, coefficients, form, density.
    points : OperatingPoints
        Load collective with monitoring points.
    control : ControlSettings
        Distance and steps.
    scene_text : str
        The scene file.
    title : str
        Of the campaign.
    input_hashes : tuple of (str, str)
        Name and SHA-256 of the scene file and of every profile.
    warnings : tuple of str
        What deserves a second look, one line each.
    also_evaluate : tuple of WearSettings
        Comparison laws: further wear laws evaluated on the same contacts.
    fatigue : tuple of FatigueSettings
        Fatigue laws.
    templates : (Profile, Profile), optional
        What right and left wheel are turned to, where they are.
    tolerance : float, optional
        Of the wear increment, if the models are chosen by `campaign.choose` instead of given [-].
    counterface_wear : CounterfaceWear, optional
        How rails or rollers wear; without it they stay as they are.
    """

    kind: Literal["rig", "field"]
    wheelset: Wheelset
    counterface: Counterface
    models: ContactModels
    wear: WearSettings
    points: OperatingPoints
    control: ControlSettings
    scene_text: str
    title: str
    input_hashes: tuple[tuple[str, str], ...]
    warnings: tuple[str, ...]
    also_evaluate: tuple[WearSettings, ...] = ()
    fatigue: tuple[FatigueSettings, ...] = ()
    tolerance: float | None = None
    counterface_wear: CounterfaceWear | None = None
    templates: tuple[Profile, Profile] | None = None


def build(scene: RigScene | FieldScene) -> CampaignSetup:
    """Make the ingredients of a campaign from a scene, in SI units.

    Parameters
    ----------
    scene : RigScene or FieldScene
        As loaded; of a compare scene, its `rig` or its `field`.

    Returns
    -------
    CampaignSetup
        What the campaign is run with.
    """
    inputs = inputs_of(scene)
    contact, campaign, header = scene.contact, scene.campaign, scene.scene
    rig = isinstance(scene, RigScene)
    return CampaignSetup(
        tolerance=_tolerance(contact),
        kind="rig" if rig else "field",
        wheelset=Wheelset(inputs.right, inputs.left, 1e-3 * scene.wheelset.radius_mm, inputs.half_span),
        counterface=Counterface(
            inputs.counterface,
            1e3 / scene.counterface.roller_radius_mm if isinstance(scene, RigScene) else 0.0,
        ),
        models=contact_models(contact),
        wear=wear_settings(scene.wear, inputs.wear_table),
        points=_points(scene),
        control=control_settings(campaign),
        scene_text=scene.origin.content.decode("utf-8-sig"),
        title=header.title or scene.origin.path.stem,
        input_hashes=tuple((_hash_name(file), file.sha256) for file in inputs.files),
        warnings=tuple(
            # results tell the file by its name alone: the run reads a copy, and folders are nobody's business
            str(replace(warning, file=scene.origin.path.name))
            for warning in warnings_of(scene)
        ),
        also_evaluate=comparison_settings(scene.wear, inputs.wear_table),
        fatigue=fatigue_settings(scene.fatigue),
        counterface_wear=counterface_wear(
            scene.counterface.wear,
            1e-3 * scene.counterface.roller_radius_mm if isinstance(scene, RigScene) else math.inf,
        ),
        templates=inputs.templates,
    )


def warnings_of(scene: RigScene | FieldScene) -> tuple[Fault, ...]:
    """Tell what a scene may hold, but deserves a second look.

    Parameters
    ----------
    scene : RigScene or FieldScene
        As loaded.

    Returns
    -------
    tuple of Fault
        In the order of the file; `wearsim.scene.touch.check_contact` adds what only the contact tells.
    """
    inputs = inputs_of(scene)
    found = [
        *scene_warnings(scene, inputs.clearance),
        *limit_faults(scene, (inputs.right, inputs.left), inputs.counterface, end=False),
    ]
    return tuple(sorted(found, key=lambda fault: fault.line or 0))


def _tolerance(contact: ContactSection) -> float | None:
    """Tolerance of the wear increment where models are chosen, 5 % unless the scene says otherwise."""
    if contact.model is None:
        return None
    return 0.05 if contact.tolerance is None else contact.tolerance


def contact_models(contact: ContactSection) -> ContactModels:
    """Contact models of a scene, in SI units.

    Parameters
    ----------
    contact : ContactSection
        [contact] of the scene.

    Returns
    -------
    ContactModels
        Models, grid and material.
    """
    return ContactModels(
        normal=contact.normal,
        tangential=contact.tangential,
        strips=contact.strips,
        cells=contact.cells,
        youngs_modulus=1e9 * contact.youngs_GPa,
        poisson_ratio=contact.poisson,
        parameters=(("virtual_penetration_factor", contact.virtual_penetration_factor),),
    )


def _points(scene: RigScene | FieldScene) -> OperatingPoints:
    rotation, torque = scene.contact.rotation, scene.contact.torque_Nm
    if isinstance(scene, RigScene):
        points = programme(
            [
                Block(
                    name=run.name,
                    shift=1e-3 * run.shift_mm,
                    wheel_load=1e3 * run.load_kN,
                    speed=run.speed_km_h / 3.6,
                    friction=run.friction,
                    distance=1e3 * run.distance_km,
                    yaw=1e-3 * run.yaw_mrad,
                    roll=1e-3 * run.roll_mrad,
                    environment=run.environment,
                )
                for run in scene.operation.blocks
            ],
            rotation=rotation,
            torque=torque,
            free_roll=scene.contact.roll == "free",
        )
    else:
        points = collective(
            [
                TrackClass(
                    name=run.name,
                    shift_mean=1e-3 * run.shift_mean_mm,
                    shift_std=1e-3 * run.shift_std_mm,
                    wheel_load=1e3 * run.load_kN,
                    speed=run.speed_km_h / 3.6,
                    friction=run.friction,
                    share=run.share,
                    track_curvature=0.0 if run.curve_radius_m is None else 1.0 / run.curve_radius_m,
                    positions=run.positions,
                    yaw=1e-3 * run.yaw_mrad,
                    roll=1e-3 * run.roll_mrad,
                    environment=run.environment,
                )
                for run in scene.operation.classes
            ],
            rotation=rotation,
            torque=torque,
            free_roll=scene.contact.roll == "free",
        )
    monitor = scene.operation.monitor
    if monitor is None:
        return points
    return with_monitors(
        points,
        1e-3 * np.array(monitor.shifts_mm, dtype=np.float64),
        wheel_load=1e3 * monitor.load_kN,
        speed=monitor.speed_km_h / 3.6,
        friction=monitor.friction,
        yaw=1e-3 * monitor.yaw_mrad,
    )


def inputs_of(scene: RigScene | FieldScene) -> Inputs:
    """Return what the files of a scene hold, read by `load_scene`."""
    inputs = scene._inputs
    if not isinstance(inputs, Inputs):
        raise ValueError("a scene is built after load_scene has read its files")
    return inputs


def _hash_name(file: InputFile) -> str:
    return file.path.name if file.role == "scene" else f"{file.role} {file.name}"
