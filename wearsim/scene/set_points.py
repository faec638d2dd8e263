"""Set-points a rig programme may be made of, within the limits of the rig."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearsim.errors import Fault, SceneError, listed, raise_any
from wearsim.scene.inputs import inputs_of
from wearsim.scene.models import RigScene
from wearsim.scene.operation import BlockSection
from wearsim.scene.programme import ProgrammeSection
from wearsim.scene.rig import RigFile
from wearsim.toml_faults import read_toml

FloatArray = NDArray[np.float64]

TORQUES = ("axle_torque_kN_m", "wheel_torque_right_kN_m", "wheel_torque_left_kN_m")
"""Keys of the torques of blocks."""

STATED = (*TORQUES, "friction_flange", "roll_mrad", "speed_difference_percent")
"""Keys that the blocks of a programme take from those of the scene."""


@dataclass(frozen=True)
class SetPoints:
    """Values of the actuators that the blocks of a programme may have."""

    lateral: FloatArray  # evenly spaced shifts [m], or lateral forces [N]
    yaw: FloatArray  # [rad]
    load: FloatArray  # of a wheel [N]
    speed: float  # [m/s]
    friction: float  # [-]
    environment: float  # [-]
    limits: tuple[str, str, str]
    """What ends the range of shift or force, yaw and load: the rig, the flange or the
    scene."""
    by_force: bool = False  # whether blocks control lateral forces in place of shifts
    stated: Mapping[str, float] = field(default_factory=dict)
    """Further keys of the blocks, with the value that all of them have."""

    @property
    def step(self) -> float:
        """Distance of the shifts [m], or forces [N]."""
        return float(self.lateral[1] - self.lateral[0]) if self.lateral.size > 1 else 0


def set_points(scene: RigScene) -> SetPoints:
    """Set-points of [programme] within the limits of the rig that the scene names.

    Raises
    ------
    SceneError
        With all faults: values beyond the limits of the rig, actuators that it does not
        control, blocks of unlike friction, torque or environment where one value is
        needed, wheels without flange clearance where no largest shift is stated, or no
        largest lateral force where the rig controls it in place of the shift.
    """
    section = section_of(scene)
    rig = rig_of(scene)
    faults: list[Fault] = []
    by_force = _is_by_force(section, rig)
    ends = _forces if by_force else _shifts
    lateral, of_lateral = ends(scene, section, rig, faults)
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
    stated = common_values(scene, STATED, faults)
    raise_any(faults)
    return SetPoints(
        lateral,
        1e-3 * np.array(yaw),
        1e3 * np.array(load),
        speed,
        friction,
        blocks[0].environment,
        (of_lateral, of_yaw, of_load),
        by_force,
        stated,
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


def common_values(
    scene: RigScene, keys: Sequence[str], faults: list[Fault]
) -> dict[str, float]:
    """Return the values of keys that all blocks of a scene have in common.

    Keys that have their default in all of them are left out; values that differ are
    faults.
    """
    common: dict[str, float] = {}
    for key in keys:
        values = dict.fromkeys(getattr(block, key) for block in scene.operation.blocks)
        first = next(iter(values))
        if len(values) > 1:
            shown = listed("none" if value is None else value for value in values)
            text = f"the blocks have several {key} ({shown}); give all of them the same"
            faults.append(scene.fault(("operation",), text))
        elif first != BlockSection.model_fields[key].default:
            common[key] = first
    return common


def rig_of(scene: RigScene) -> RigFile | None:
    """Return the rig that a scene names, if any."""
    files = {file.role: file.path for file in inputs_of(scene).files}
    if "counterface.rig" not in files:
        return None
    rig, faults = read_toml(files["counterface.rig"], RigFile)
    if rig is None:
        raise SceneError(faults)
    return rig


def _is_by_force(section: ProgrammeSection, rig: RigFile | None) -> bool:
    """Return whether blocks control lateral forces in place of shifts."""
    if section.lateral_force_kN is not None:
        return True
    controlled = ("shift_mm",) if rig is None else rig.controlled
    return "shift_mm" not in controlled and "lateral_force_kN" in controlled


def _forces(
    scene: RigScene,
    section: ProgrammeSection,
    rig: RigFile | None,
    faults: list[Fault],
) -> tuple[FloatArray, str]:
    """Return evenly spaced lateral forces to both sides [N], and what ends them."""
    key = "lateral_force_kN"
    stated, limit = section.lateral_force_kN, None
    if rig is not None:
        limit = rig.limits.lateral_force_kN
        if key not in rig.controlled:
            text = f"the rig does not control {key}; delete it"
            faults.append(scene.fault(("programme", key), text))
    if stated is not None and limit is not None and abs(stated) > limit:
        faults.append(beyond_rig(scene, key, stated, limit))
    if stated is None and limit is None:
        text = f"the rig has no limit of {key}; give {key}, the largest lateral force"
        faults.append(scene.fault(("programme",), text))
    end = abs(stated if stated is not None else limit or 0.0)
    step = section.lateral_force_step_kN
    count = int(np.floor(end / step + 1e-9))
    forces = 1e3 * step * np.arange(-count, count + 1, dtype=np.float64)
    return forces, "rig" if stated is None or end == limit else "scene"


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
    section_key, rig_key = keys
    values: list[Any] = sorted(set(getattr(section, section_key)))
    stated = section_key in section.model_fields_set
    if rig is None:
        return values, "scene"
    if rig_key not in rig.controlled and rig_key == "yaw_mrad":
        if stated and values != [0.0]:
            text = f"the rig does not control {rig_key}; write {section_key} = [0]"
            faults.append(scene.fault(("programme", section_key), text))
        return [0.0], "rig"
    limit = getattr(rig.limits, rig_key)
    if limit is None:
        return values, "scene"
    beyond = [value for value in values if abs(value) > limit]
    if beyond and stated:
        faults.append(beyond_rig(scene, section_key, beyond[-1], limit))
    within = [value for value in values if abs(value) <= limit]
    if not within:
        text = (
            f"the limit of the rig, {rig_key} = {limit:g}, leaves none of {section_key}"
        )
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
