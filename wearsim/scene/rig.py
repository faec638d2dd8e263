"""Rigs as data files, and programmes as CSV tables: what a rig scene names in place of its own keys."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field

from wearsim.errors import Fault, SceneError, raise_any, say
from wearsim.scene.models import BlockSection, RigScene
from wearsim.scene.section import Section, Text, read_rows
from wearsim.scene.vehicle import Place, shipped_or_own
from wearsim.toml_faults import read_toml


class RigLimits(Section):
    """[limits] of a rig: the largest magnitude of set-points of its blocks, under their names."""


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
            raise SceneError([scene.fault(("counterface",), say("rig.no_rollers"))])
        return scene, None
    path, text = shipped_or_own("rigs", place, "counterface.rig", section.rig)
    if path is None:
        raise SceneError([scene.fault(key, say("rig.no_rig", section=section, known=text))])
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
    for key in sorted(set(RigLimits.model_fields) & block.model_fields_set):
        value, limit = getattr(block, key), getattr(rig.limits, key)
        path = ("operation", "block", k, key)
        if value is not None and key not in rig.controlled and key != "speed_km_h":
            faults.append(scene.fault(path, say("rig.not_controlled", block=block, key=key, rig=rig)))
        elif value is not None and limit is not None and abs(value) > limit:
            values = {"block": block, "key": key, "value": value, "rig": rig, "limit": limit}
            faults.append(scene.fault(path, say("rig.beyond", **values)))
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
            raise SceneError([scene.fault(("operation",), say("rig.no_blocks"))])
        if operation.programme is not None:
            raise SceneError([scene.fault(key, say("rig.programme_and_blocks"))])
        return scene, None
    path = place("operation.programme", operation.programme)
    if path is None:
        raise SceneError([scene.fault(key, say("rig.no_programme", operation=operation))])
    blocks = read_rows(path, BlockSection, "block")
    changed = operation.model_copy(update={"blocks": blocks})
    return scene.model_copy(update={"operation": changed}), path
