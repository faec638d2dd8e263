"""Rigs as data files, and programmes as CSV tables: what a rig scene names in place of its own keys."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field

from wearsim.errors import Fault, SceneError, raise_any
from wearsim.scene.models import BlockSection, RigScene
from wearsim.scene.rows import read_rows
from wearsim.scene.section import Section, Text
from wearsim.scene.vehicle import Place, shipped_or_own
from wearsim.toml_faults import read_toml, shown


class RigLimits(Section):
    """[limits] of a rig: the largest magnitude of set-points of its blocks, under their names."""

    shift_mm: float | None = None
    yaw_mrad: float | None = None
    lateral_force_kN: float | None = None
    load_kN: float | None = None
    wheel_load_right_kN: float | None = None
    wheel_load_left_kN: float | None = None
    axle_load_kN: float | None = None
    axle_box_right_kN: float | None = None
    axle_box_left_kN: float | None = None
    axle_torque_kN_m: float | None = None
    speed_km_h: float | None = None
    speed_difference_percent: float | None = None


class RigFile(Section):
    """A roller rig: rollers, drive, what it controls and within which limits."""

    name: Text
    source: Text
    roller_radius_mm: float
    roller_radius_left_mm: float | None = None
    gauge_mm: float = 1435.0
    gauge_height_mm: float = 14.0
    drive: Literal["coupled", "independent"]
    controlled: tuple[str, ...]
    limits: RigLimits = Field(default_factory=lambda: RigLimits.model_validate({}))


def with_rig(scene: RigScene, place: Place) -> tuple[RigScene, Path | None]:
    """Scene with what its rig gives where the scene does not, and the rig's file.

    Raises
    ------
    SceneError
        If the rig is not known, its file has faults, or blocks are beyond it.
    """
    section, key = scene.counterface, ("counterface", "rig")
    if section.rig is None:
        if section.roller_radius_mm is None:
            text = "[counterface] needs roller_radius_mm, or rig = the name of a rig; add one of them"
            raise SceneError([scene.fault(("counterface",), text)])
        return scene, None
    path, text = shipped_or_own("rigs", place, "counterface.rig", section.rig)
    if path is None:
        text = f"rig = {shown(section.rig)} is no file, nor a shipped rig; {text}"
        raise SceneError([scene.fault(key, text)])
    rig, faults = read_toml(path, RigFile)
    if rig is None:
        raise SceneError(faults)
    given = section.model_fields_set
    radii = () if "roller_radius_mm" in given else ("roller_radius_mm", "roller_radius_left_mm")
    names = [name for name in (*radii, "gauge_mm", "gauge_height_mm", "drive") if name not in given]
    update = {name: getattr(rig, name) for name in names}
    scene = scene.model_copy(update={"counterface": section.model_copy(update=update)})
    faults = [fault for k in range(len(scene.operation.blocks)) for fault in _beyond(scene, rig, k)]
    raise_any(faults)
    return scene, path


def _beyond(scene: RigScene, rig: RigFile, k: int) -> list[Fault]:
    """Set-points of a block that the rig cannot control, or beyond its limits."""
    block, faults = scene.operation.blocks[k], []
    start = f"block {shown(block.name)}"
    for key in sorted(set(RigLimits.model_fields) & block.model_fields_set):
        value, limit = getattr(block, key), getattr(rig.limits, key)
        path = ("operation", "block", k, key)
        if value is not None and key not in rig.controlled and key != "speed_km_h":
            can = ", ".join(rig.controlled)
            text = f"{start}: {key} is not controlled by the rig {shown(rig.name)}; it controls {can}"
            faults.append(scene.fault(path, text))
        elif value is not None and limit is not None and abs(value) > limit:
            text = f"{key} = {value:g} is beyond the rig {shown(rig.name)}, whose limit is {limit:g}"
            faults.append(scene.fault(path, f"{start}: {text}; lower it"))
    return faults


def with_programme(scene: RigScene, place: Place) -> tuple[RigScene, Path | None]:
    """Scene with the blocks of the CSV file it names, and that file.

    Raises
    ------
    SceneError
        With all faults of the file, each with its line.
    """
    operation, key = scene.operation, ("operation", "programme")
    if operation.programme is None or operation.blocks:
        if not operation.blocks:
            text = "[operation] needs at least one [[operation.block]], or programme = a CSV file of blocks"
            raise SceneError([scene.fault(("operation",), f"{text}; add one of them")])
        if operation.programme is not None:
            text = "programme and [[operation.block]] exclude each other; delete one of them"
            raise SceneError([scene.fault(key, text)])
        return scene, None
    path = place("operation.programme", operation.programme)
    if path is None:
        text = f"programme = {shown(operation.programme)} does not exist as given or next to the scene file"
        raise SceneError([scene.fault(key, f"{text}; give a CSV file")])
    blocks = read_rows(path, BlockSection, "block")
    changed = operation.model_copy(update={"blocks": blocks})
    return scene.model_copy(update={"operation": changed}), path
