"""Shifts of a scene beyond the flange clearance: where a wheel climbs its flange, and where it derails."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from wearsim.errors import Fault
from wearsim.operation.points import REACH
from wearsim.scene.models import FieldScene, RigScene

FURTHEST_CLIMB_MM = 4.0
"""How far beyond the clearance a shift is still solved [mm]: on S1002 the straight flank of 70 degrees ends
there, the wheel stands 10 mm high, and what follows over the rounded tip is derailment, not wear."""


@dataclass(frozen=True)
class _Reach:
    """The shifts that one key leads to: its path, key and value as the user reads them, both ends [mm]."""

    path: tuple[str | int, ...]
    told: str
    low: float
    high: float


def beyond_clearance(
    scene: RigScene | FieldScene, clearance: tuple[float | None, float | None]
) -> tuple[list[Fault], list[Fault]]:
    """Tell the shifts at which a wheel climbs its flange.

    Parameters
    ----------
    scene : RigScene or FieldScene
        With valid keys, types and ranges.
    clearance : (float or None, float or None)
        Of the right and the left wheel, see `wearsim.profile.clearance.flange_clearance` [m].

    Returns
    -------
    faults, warnings : list of Fault
        At most one for each block, class or watched shift: a fault where it is hopeless, a warning where
        the contact can still be solved.
    """
    faults, warnings = [], []
    file = str(scene.origin.path)
    right, left = (math.inf if free is None else 1e3 * free for free in clearance)
    for reach in _reaches(scene):
        to_right = reach.high - right >= -reach.low - left
        shift, free = (reach.high, right) if to_right else (reach.low, left)
        beyond = abs(shift) - free
        if beyond <= 0:
            continue
        told = f"{reach.told} {shift:.4g} mm," if reach.high > reach.low else f"{reach.told} is"
        wheel = "right" if to_right else "left"
        way_out = (
            f"give smaller shifts, or check gauge_mm = {scene.counterface.gauge_mm:g} and "
            f"back_to_back_mm = {scene.wheelset.back_to_back_mm:g}"
        )
        if beyond > FURTHEST_CLIMB_MM:
            message = (
                f"{told} more than {FURTHEST_CLIMB_MM:g} mm beyond the flange clearance of {free:.4g} mm: "
                f"the {wheel} wheel has climbed off its flank, on the way to derailment; {way_out}"
            )
            faults.append(Fault(message, file, scene.line(*reach.path)))
        else:
            message = (
                f"{told} beyond the flange clearance of {free:.4g} mm: the {wheel} wheel climbs its flange; "
                f"{way_out}"
            )
            warnings.append(Fault(message, file, scene.line(*reach.path)))
    for key, value in zip(("profile", "profile_left"), clearance, strict=True):
        if value is None and (key == "profile" or scene.wheelset.profile_left is not None):
            message = (
                f"{key}: no part of the flange is as steep as 60 degrees: shifts are not checked for climbing"
            )
            warnings.append(Fault(message, file, scene.line("wheelset", key)))
    return faults, warnings


def _reaches(scene: RigScene | FieldScene) -> Iterator[_Reach]:
    if isinstance(scene, RigScene):
        for index, block in enumerate(scene.operation.blocks):
            shift = block.shift_mm
            yield _Reach(("operation", "block", index, "shift_mm"), f"shift_mm = {shift:g}", shift, shift)
    else:
        for index, run in enumerate(scene.operation.classes):
            mean, spread = run.shift_mean_mm, REACH * run.shift_std_mm
            told, key = f"shift_mean_mm = {mean:g}", "shift_mean_mm"
            if spread > 0:
                key = "shift_std_mm"
                told = (
                    f"shift_std_mm = {run.shift_std_mm:g}: {REACH:g} standard deviations about {told} reach"
                )
            yield _Reach(("operation", "class", index, key), told, mean - spread, mean + spread)
    if scene.operation.monitor is not None:
        for index, shift in enumerate(scene.operation.monitor.shifts_mm):
            path = ("operation", "monitor", "shifts_mm", index)
            yield _Reach(path, f"shifts_mm[{index}] = {shift:g}", shift, shift)
