"""Set-points a rig programme may be made of, within the limits of the rig."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearsim.errors import Fault, SceneError, listed, raise_any
from wearsim.scene.inputs import inputs_of
from wearsim.scene.models import RigScene
from wearsim.scene.programme import ProgrammeSection
from wearsim.scene.rig import RigFile
from wearsim.toml_faults import read_toml

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class SetPoints:
    """Values of the actuators that the blocks of a programme may have."""

    shift: FloatArray  # evenly spaced [m]
    yaw: FloatArray  # [rad]
    load: FloatArray  # of a wheel [N]
    speed: float  # [m/s]
    friction: float  # [-]
    environment: float  # [-]
    limits: tuple[str, str, str]
    """What ends the range of shift, yaw and load: the rig, the flange or the scene."""

    @property
    def step(self) -> float:
        """Distance of the shifts [m]."""
        return float(self.shift[1] - self.shift[0]) if self.shift.size > 1 else 0.0


def set_points(scene: RigScene) -> SetPoints:
    """Set-points of [programme] within the limits of the rig that the scene names.

    Raises
    ------
    SceneError
        With all faults: values beyond the limits of the rig, actuators that it does not
        control, blocks of unlike friction or environment where one value is needed, or
        wheels without flange clearance where no largest shift is stated.
    """
    section = section_of(scene)
    rig = rig_of(scene)
    faults: list[Fault] = []
    shift, of_shift = _shifts(scene, section, rig, faults)
    yaw, of_yaw = _values(scene, section, rig, ("yaws_mrad", "yaw_mrad"), faults)
    load, of_load = _values(scene, section, rig, ("loads_kN", "load_kN"), faults)
    blocks = scene.operation.blocks
    speed, friction = running_of(scene, section, rig, faults)
    environments = {block.environment for block in blocks}
    if len(environments) > 1:
        text = (
            f"the blocks have several environment factors ({listed(environments)}); "
            "give all of them the same"
        )
        faults.append(scene.fault(("operation",), text))
    for key in ("friction_flange", "roll_mrad", "speed_difference_percent"):
        stated = [bool(getattr(block, key, None)) for block in blocks]
        if any(stated):
            text = f"{key} is not known to the design of programmes; delete it"
            place = ("operation", "block", stated.index(True), key)
            faults.append(scene.fault(place, text))
    if scene.counterface.wear is not None:
        text = "programmes are designed for rollers that keep their profile"
        faults.append(scene.fault(("counterface", "wear"), f"{text}; delete it"))
    raise_any(faults)
    return SetPoints(
        shift,
        1e-3 * np.array(yaw),
        1e3 * np.array(load),
        speed,
        friction,
        blocks[0].environment,
        (of_shift, of_yaw, of_load),
    )


def section_of(scene: RigScene) -> ProgrammeSection:
    """Return [programme] of a scene, by default with its defaults."""
    return scene.programme or ProgrammeSection.model_validate({})


def running_of(
    scene: RigScene,
    section: ProgrammeSection,
    rig: RigFile | None,
    faults: list[Fault],
) -> tuple[float, float]:
    """Return speed [m/s] and friction of set-points, those of the scene's blocks."""
    blocks = scene.operation.blocks
    speed = section.speed_km_h or max(block.speed_km_h for block in blocks)
    limit = None if rig is None else rig.limits.speed_km_h
    if limit is not None and speed > limit:
        text = f"speed_km_h = {speed:g} is beyond the rig, whose limit is {limit:g}"
        faults.append(scene.fault(("programme", "speed_km_h"), f"{text}; lower it"))
    frictions = {block.friction for block in blocks}
    if section.friction is None and len(frictions) > 1:
        text = (
            f"the blocks have several coefficients of friction ({listed(frictions)}); "
            "give friction in [programme]"
        )
        faults.append(scene.fault(("operation",), text))
    friction = blocks[0].friction if section.friction is None else section.friction
    return speed / 3.6, friction


def rig_of(scene: RigScene) -> RigFile | None:
    """Return the rig that a scene names, if any."""
    files = {file.role: file.path for file in inputs_of(scene).files}
    if "counterface.rig" not in files:
        return None
    rig, faults = read_toml(files["counterface.rig"], RigFile)
    if rig is None:
        raise SceneError(faults)
    return rig


def _shifts(
    scene: RigScene,
    section: ProgrammeSection,
    rig: RigFile | None,
    faults: list[Fault],
) -> tuple[FloatArray, str]:
    """Return evenly spaced shifts to both sides [m], and what ends them.

    Between the outermost one and the end is half a step, which a ramp runs.
    """
    controlled = rig is None or "shift_mm" in rig.controlled
    limit = None if rig is None else rig.limits.shift_mm
    clearance = flange_clearance(scene)
    ends: dict[str, float] = {}
    if limit is not None:
        ends["rig"] = limit
    if section.shift_mm is not None:
        ends["scene"] = abs(section.shift_mm)
        if limit is not None and abs(section.shift_mm) > limit:
            faults.append(beyond_rig(scene, "shift_mm", section.shift_mm, limit))
    elif clearance is not None:
        ends["flange"] = clearance
    if not controlled:
        return np.zeros(1), "rig"
    if not ends:
        faults.append(without_clearance(scene))
        return np.zeros(1), "scene"
    name = min(ends, key=lambda key: ends[key])
    step = section.shift_step_mm
    count = max(int(np.floor(ends[name] / step - 0.5 + 1e-9)), 0)
    return 1e-3 * step * np.arange(-count, count + 1, dtype=np.float64), name


def _values(
    scene: RigScene,
    section: ProgrammeSection,
    rig: RigFile | None,
    keys: tuple[str, str],
    faults: list[Fault],
) -> tuple[list[float], str]:
    """Return the values of a list of [programme], and what ends them.

    `keys` are that of [programme] and that of blocks and limits. Values of the default
    beyond the limit of the rig are left out.
    """
    ours, key = keys
    values: list[Any] = sorted(set(getattr(section, ours)))
    stated = ours in section.model_fields_set
    if rig is None:
        return values, "scene"
    if key not in rig.controlled and key == "yaw_mrad":
        if stated and values != [0.0]:
            text = f"the rig does not control {key}; write {ours} = [0]"
            faults.append(scene.fault(("programme", ours), text))
        return [0.0], "rig"
    limit = getattr(rig.limits, key)
    if limit is None:
        return values, "scene"
    beyond = [value for value in values if abs(value) > limit]
    if beyond and stated:
        faults.append(beyond_rig(scene, ours, beyond[-1], limit))
    within = [value for value in values if abs(value) <= limit]
    if not within:
        text = f"the limit of the rig, {key} = {limit:g}, leaves none of {ours}"
        faults.append(scene.fault(("programme",), f"{text}; give values below it"))
        within = [limit]
    return within, "rig" if beyond or within[-1] == limit else "scene"


def flange_clearance(scene: RigScene) -> float | None:
    """Return the least flange clearance of the wheels [mm], None without flanges."""
    clearances = [
        clearance
        for clearance in inputs_of(scene).clearances[0]
        if clearance is not None
    ]
    return 1e3 * min(clearances) if clearances else None


def without_clearance(scene: RigScene) -> Fault:
    """Return the fault of a scene whose largest shift nothing states."""
    text = "the wheels have no flange clearance; give shift_mm, the largest shift"
    return scene.fault(("programme",), text)


def beyond_rig(scene: RigScene, key: str, value: float, limit: float) -> Fault:
    """Return the fault of a value in [programme] beyond a limit of the rig."""
    text = f"{key} holds {value:g}, beyond the rig, whose limit is {limit:g}; lower it"
    return scene.fault(("programme", key), text)
