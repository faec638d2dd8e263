"""What only shows between the values of a scene: faults that forbid a run, warnings that do not."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np

from wearsim.contact.normal import NORMAL_MODELS
from wearsim.damage.fatigue import FATIGUE_LAWS, counts_cycles
from wearsim.damage.wear import WEAR_LAWS
from wearsim.errors import Fault, ProfileError
from wearsim.operation.points import REACH
from wearsim.profile.measures import flange_thickness
from wearsim.profile.shape import Profile
from wearsim.scene.campaign import campaign_faults
from wearsim.scene.clearance import beyond_clearance
from wearsim.scene.counterface import counterface_faults, counterface_warnings
from wearsim.scene.damage import damage_faults
from wearsim.scene.limits import met_by_wheels
from wearsim.scene.models import (
    BlockSection,
    ClassSection,
    FieldScene,
    MonitorSection,
    RigOperation,
    RigScene,
)
from wearsim.scene.reprofiling import reprofiling_faults, reprofiling_warnings, turned_at
from wearsim.toml_faults import shown

SHARES_ROUNDED = 0.01
"""Shares of classes that sum to 1 within this are taken for rounded ones and normalised."""

WIDEST_POSITION_SPACING_MM = 2.0
"""About half the width of the narrower patches [mm]."""


def scene_warnings(
    scene: RigScene | FieldScene, clearance: tuple[float | None, float | None]
) -> tuple[Fault, ...]:
    """Tell what is allowed but deserves a second look, one line each.

    Parameters
    ----------
    scene : RigScene or FieldScene
        Without faults.
    clearance : (float or None, float or None)
        Flange clearance of the right and the left wheel [m].

    Returns
    -------
    tuple of Fault
        In the order of the file.
    """
    found = beyond_clearance(scene, clearance)[1]
    runs = scene.operation.blocks if isinstance(scene, RigScene) else scene.operation.classes
    key = "block" if isinstance(scene, RigScene) else "class"
    if all(run.friction == 0 for run in runs) and WEAR_LAWS[scene.wear.law].needs_friction:
        path = ("operation", key, 0, "friction")
        found.append(fault_at(scene, path, "friction = 0 everywhere: nothing will wear"))
    contact = scene.contact
    if contact.torque_Nm != 0 and contact.rotation != "free":
        told = (
            f"torque_Nm = {contact.torque_Nm:g} is without effect where rotation = {shown(contact.rotation)} "
            f'gives the speed; write rotation = "free", or delete it'
        )
        found.append(fault_at(scene, ("contact", "torque_Nm"), told))
    if isinstance(scene, FieldScene):
        total = sum(run.share for run in scene.operation.classes)
        if abs(total - 1.0) > 1e-6:
            message = f"share: the shares of all classes sum to {total:.7g}; they are normalised to 1"
            found.append(fault_at(scene, ("operation", "class", 0, "share"), message))
        for index, run in enumerate(scene.operation.classes):
            step = 2.0 * REACH * run.shift_std_mm / (run.positions - 1)
            if step > WIDEST_POSITION_SPACING_MM:
                told = (
                    f"positions = {run.positions} lie {step:.2g} mm apart in "
                    f"class {shown(run.name)}; more than half a patch width (about "
                    f"{WIDEST_POSITION_SPACING_MM:g} mm) leaves ridges between them"
                )
                found.append(fault_at(scene, ("operation", "class", index, "positions"), told))
    found += [
        fault_at(scene, path, told)
        for path, told in counterface_warnings(scene.counterface.wear, scene.campaign.distance_km)
    ]
    turning = reprofiling_warnings(scene.campaign.reprofiling, scene.campaign.distance_km)
    found += [fault_at(scene, path, told) for path, told in turning]
    if scene.campaign.smoothing_wavelength_mm == 0:
        told = "smoothing_wavelength_mm = 0: wear increments are not smoothed"
        found.append(fault_at(scene, ("campaign", "smoothing_wavelength_mm"), told))
    return tuple(sorted(found, key=lambda fault: fault.line or 0))


def cross_faults(scene: RigScene | FieldScene) -> list[Fault]:
    """Faults between values that are each in range."""
    found = []
    if isinstance(scene, FieldScene):
        total = sum(run.share for run in scene.operation.classes)
        if abs(total - 1.0) > SHARES_ROUNDED:
            shares = " + ".join(f"{run.share:g}" for run in scene.operation.classes)
            told = (
                f"share: the shares of all classes, {shares}, must sum to 1 within "
                f"{100 * SHARES_ROUNDED:g} %, not {total:.7g}; change them"
            )
            found.append(fault_at(scene, ("operation", "class", 0, "share"), told))
    found += _contact_faults(scene)
    found += [
        fault_at(scene, path, told)
        for path, told in campaign_faults(
            scene.campaign, None if scene.contact.model == "auto" else scene.contact.normal
        )
    ]
    damage = None if scene.campaign.limits is None else scene.campaign.limits.damage
    laws = scene.fatigue.laws if scene.fatigue else ()
    if damage is not None and not any(counts_cycles(law) for law in laws):
        given = f"; {', '.join(laws)} orders passages and counts none" if laws else ""
        told = (
            f"damage = {damage:g} needs a fatigue law that counts cycles{given}; write "
            f"{' or '.join(filter(counts_cycles, FATIGUE_LAWS))} among the laws of [fatigue], or delete it"
        )
        found.append(fault_at(scene, ("campaign", "limits", "damage"), told))
    turning = reprofiling_faults(
        scene.campaign.reprofiling,
        scene.campaign.limits,
        diameter_mm=2.0 * scene.wheelset.radius_mm,
        rotation=scene.contact.rotation,
        compared=scene.origin.role != "scene",
    )
    found += [fault_at(scene, path, told) for path, told in turning]
    found += [fault_at(scene, path, told) for path, told in damage_faults(scene.wear, scene.fatigue)]
    found += [
        fault_at(scene, path, told)
        for path, told in counterface_faults(scene.counterface.wear, scene.wear.law)
    ]
    return found


def _contact_faults(scene: RigScene | FieldScene) -> list[Fault]:
    """Faults of [contact] that show only beside the rest of the scene."""
    found = []
    contact = scene.contact
    if contact.model == "auto":
        for key in sorted(contact.model_fields_set & {"normal", "tangential", "strips", "cells"}):
            told = f'{key} and model = "auto" exclude each other: auto chooses it; delete one of them'
            found.append(fault_at(scene, ("contact", key), told))
    elif contact.tolerance is not None:
        told = f'tolerance = {contact.tolerance:g} is for model = "auto"; write that, too, or delete it'
        found.append(fault_at(scene, ("contact", "tolerance"), told))
    model = NORMAL_MODELS[contact.normal]
    if not model.can_update_profile:
        others = " or ".join(
            f"normal = {shown(name)}" for name, one in NORMAL_MODELS.items() if one.can_update_profile
        )
        told = f"normal = {shown(contact.normal)} cannot lead a campaign: {model.reason}; write {others}"
        found.append(fault_at(scene, ("contact", "normal"), told))
    if contact.roll == "free":
        runs = scene.operation.blocks if isinstance(scene, RigScene) else scene.operation.classes
        key = "block" if isinstance(scene, RigScene) else "class"
        for index, run in enumerate(runs):
            if "roll_mrad" in run.model_fields_set:
                told = (
                    f'roll_mrad = {run.roll_mrad:g} and roll = "free" of [contact] exclude each other: a '
                    f"wheelset free to roll rests on both wheels; delete one of them"
                )
                found.append(fault_at(scene, ("operation", key, index, "roll_mrad"), told))
    if contact.rotation == "free":
        weakest, place = min(_friction_torques(scene), key=lambda entry: entry[0])
        if abs(contact.torque_Nm) > weakest:
            told = (
                f"torque_Nm = {contact.torque_Nm:g} is more than friction can carry in {place}: "
                f"2 x friction x load_kN x radius_mm = {weakest:.4g} N m; lower the torque"
            )
            found.append(fault_at(scene, ("contact", "torque_Nm"), told))
    return found


def _friction_torques(scene: RigScene | FieldScene) -> Iterator[tuple[float, str]]:
    """Largest torque that friction can carry in each block, class and watched state [N m], and its name."""
    rig = isinstance(scene, RigScene)
    operation = scene.operation
    states: list[tuple[str, BlockSection | ClassSection | MonitorSection]] = [
        (f"{'block' if rig else 'class'} {shown(run.name)}", run)
        for run in (operation.blocks if isinstance(operation, RigOperation) else operation.classes)
    ]
    if operation.monitor is not None:
        states.append(("[operation.monitor]", operation.monitor))
    for name, run in states:
        yield 2.0 * run.friction * run.load_kN * scene.wheelset.radius_mm, name  # kN mm = N m


def _shifts(scene: RigScene | FieldScene) -> Iterator[tuple[tuple[str | int, ...], float]]:
    """Every shift of the scene that must find a counterface, with the key that sets it [mm]."""
    if isinstance(scene, RigScene):
        for index, block in enumerate(scene.operation.blocks):
            yield ("operation", "block", index, "shift_mm"), block.shift_mm
    else:
        for index, run in enumerate(scene.operation.classes):
            for side in (-REACH, REACH):
                shift = run.shift_mean_mm + side * run.shift_std_mm
                yield ("operation", "class", index, "shift_mean_mm"), shift
    if scene.operation.monitor is not None:
        for index, shift in enumerate(scene.operation.monitor.shifts_mm):
            yield ("operation", "monitor", "shifts_mm", index), shift


def fit_faults(
    scene: RigScene | FieldScene, wheels: tuple[Profile, Profile], counterface: Profile
) -> list[Fault]:
    """Faults of a wheelset that does not stand on its rails."""
    gauge = scene.counterface.gauge_mm
    try:
        thickness = [1e3 * flange_thickness(wheel.y, wheel.z) for wheel in wheels]
    except ProfileError as error:
        return [fault_at(scene, ("wheelset", "profile"), f"no flange can be measured: {error}")]
    over_flanges = scene.wheelset.back_to_back_mm + sum(thickness)
    if over_flanges >= gauge:
        told = (
            f"gauge_mm = {gauge:g} must be above {over_flanges:.4g} mm, the width over both flanges "
            f"(back_to_back_mm = {scene.wheelset.back_to_back_mm:g} + {thickness[0]:.4g} + {thickness[1]:.4g}"
            f"); give the gauge of the track or the flange back distance of the wheelset"
        )
        return [fault_at(scene, ("counterface", "gauge_mm"), told)]
    top = float(counterface.y[np.argmin(counterface.z)])
    for (path, shift), (sign, wheel) in itertools.product(
        list(_shifts(scene)), zip((1.0, -1.0), wheels, strict=True)
    ):
        tread_end = float(wheel.y[-1]) + sign * 1e-3 * shift
        if tread_end < top:
            key = path[-1] if isinstance(path[-1], str) else path[-2]
            told = (
                f"{key}: at a shift of {shift:g} mm the tread ends {1e3 * (top - tread_end):.3g} mm short of "
                f"the counterface's top: the wheel does not touch it; "
                f"check gauge_mm = {gauge:g} and back_to_back_mm = {scene.wheelset.back_to_back_mm:g}"
            )
            return [fault_at(scene, path, told)]
    return []


def limit_faults(
    scene: RigScene | FieldScene, wheels: tuple[Profile, Profile], counterface: Profile, *, end: bool
) -> list[Fault]:
    """Limits that the new wheels meet already: faults where the campaign would end at them, else warnings.

    Parameters
    ----------
    scene : RigScene or FieldScene
        As read.
    wheels : (Profile, Profile)
        New, right and left.
    counterface : Profile
        Placed.
    end : bool
        Whether to tell of a campaign that ends at its limits, or of one that goes on.
    """
    section = scene.campaign.limits
    if section is None or section.end is not end:
        return []
    found = []
    turned = turned_at(scene.campaign.reprofiling, section) if end else ()
    for key, who in met_by_wheels(section, wheels, counterface).items():
        if key in turned:
            continue
        told = f"{key} = {getattr(section, key):g} is met by {who} already"
        if end:
            told += ", and the campaign would end before it begins; change the limit, or delete end = true"
        found.append(fault_at(scene, ("campaign", "limits", key), told))
    return found


def fault_at(scene: RigScene | FieldScene, path: tuple[str | int, ...], message: str) -> Fault:
    """Fault or warning at the line of a key of the scene.

    Parameters
    ----------
    scene : RigScene or FieldScene
        As read.
    path : tuple
        Key, as in `SceneModel.line`.
    message : str
        See `Fault`.
    """
    return Fault(message, str(scene.origin.path), scene.line(*path))
