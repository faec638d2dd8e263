"""Rigs as data files, and programmes as CSV tables.

What a rig scene names in place of its own keys.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from wearsim.csv_tables import CsvTable, csv_text
from wearsim.errors import Fault, SceneError, listed, raise_any, shown
from wearsim.scene.models import RigScene
from wearsim.scene.operation import BlockSection
from wearsim.scene.overrides import OverriddenLine, Override, toml_value
from wearsim.scene.section import (
    Section,
    Text,
    csv_rows,
    quantity,
    text_field,
    validated_rows,
)
from wearsim.scene.vehicle import Place, shipped_or_own
from wearsim.toml_faults import Lines, line_of, read_toml, unknown_key


class RigLimits(Section):
    """[limits] of a rig: the largest magnitude of set-points of its blocks, under their
    names.
    """

    shift_mm: float | None = quantity("shift", None, "the largest shift")
    yaw_mrad: float | None = quantity("yaw", None, "the largest yaw")
    lateral_force_kN: float | None = Field(
        None, description="the largest lateral force", gt=0.0
    )
    load_kN: float | None = quantity("wheel_load", None, "the largest load of a wheel")
    wheel_load_right_kN: float | None = quantity(
        "wheel_load", None, "the largest load of the right wheel"
    )
    wheel_load_left_kN: float | None = quantity(
        "wheel_load", None, "the largest load of the left wheel"
    )
    axle_load_kN: float | None = quantity("axle_load", None, "the largest axle load")
    axle_box_right_kN: float | None = quantity(
        "axle_load", None, "the largest force on the right axle box"
    )
    axle_box_left_kN: float | None = quantity(
        "axle_load", None, "the largest force on the left axle box"
    )
    axle_torque_kN_m: float | None = Field(
        None, description="the largest torque on the axle", gt=0.0
    )
    speed_km_h: float | None = quantity("speed", None, "the highest speed")
    speed_difference_percent: float | None = quantity(
        "speed_difference", None, "the largest difference"
    )


class RigFile(Section):
    """A roller rig: rollers, drive, what it controls and within which limits."""

    name: Text = text_field("the name of the rig")
    source: Text = text_field("where its data are from")
    roller_radius_mm: float = quantity(
        "roller_radius", meaning="the radius of the rollers at the profile's top"
    )
    roller_radius_left_mm: float | None = quantity(
        "roller_radius", None, "the radius of the left roller, if it differs"
    )
    gauge_mm: float = quantity("gauge", 1435.0)
    gauge_height_mm: float = quantity(
        "gauge_height", 14.0, "the depth below the top at which it is measured"
    )
    drive: Literal["coupled", "independent"] = Field(
        description="whether both rollers turn alike"
    )
    controlled: tuple[str, ...] = Field(
        description="the set-points of its blocks that it can control"
    )
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
            message = (
                "[counterface] needs roller_radius_mm, or rig = the name of a rig; add "
                "one of them"
            )
            raise SceneError([scene.fault(("counterface",), message)])
        return scene, None
    path, text = shipped_or_own("rigs", place, "counterface.rig", section.rig)
    if path is None:
        message = f"rig = {shown(section.rig)} is no file, nor a shipped rig; {text}"
        raise SceneError([scene.fault(key, message)])
    rig, faults = read_toml(path, RigFile)
    if rig is None:
        raise SceneError(faults)
    given = section.model_fields_set
    radii = (
        ()
        if "roller_radius_mm" in given
        else ("roller_radius_mm", "roller_radius_left_mm")
    )
    names = [
        name
        for name in (*radii, "gauge_mm", "gauge_height_mm", "drive")
        if name not in given
    ]
    update = {name: getattr(rig, name) for name in names}
    scene = scene.model_copy(update={"counterface": section.model_copy(update=update)})
    faults = [
        fault
        for k in range(len(scene.operation.blocks))
        for fault in _rig_limit_faults(scene, rig, k)
    ]
    raise_any(faults)
    return scene, path


def _rig_limit_faults(scene: RigScene, rig: RigFile, k: int) -> list[Fault]:
    """Set-points of a block that the rig cannot control, or beyond its limits."""
    block, faults = scene.operation.blocks[k], []
    for key in sorted(set(RigLimits.model_fields) & block.model_fields_set):
        value, limit = getattr(block, key), getattr(rig.limits, key)
        path = ("operation", "block", k, key)
        if value is not None and key not in rig.controlled and key != "speed_km_h":
            text = (
                f"block {shown(block.name)}: {key} is not controlled by the rig "
                f"{shown(rig.name)}; it controls {listed(rig.controlled)}"
            )
            faults.append(scene.fault(path, text))
        elif value is not None and limit is not None and abs(value) > limit:
            text = (
                f"block {shown(block.name)}: {key} = {value:g} is beyond the rig "
                f"{shown(rig.name)}, whose limit is {limit:g}; lower it"
            )
            faults.append(scene.fault(path, text))
    return faults


def with_programme(
    scene: RigScene, place: Place
) -> tuple[RigScene, Path | None, bytes | None]:
    """Scene with the blocks of the CSV file it names.

    That file, and its content where overrides change it.

    Raises
    ------
    SceneError
        With all faults of the file, each with its line, and the overrides of rows that
        it has not.
    """
    operation, key = scene.operation, ("operation", "programme")
    if operation.programme is None or operation.blocks:
        if not operation.blocks:
            text = (
                "[operation] needs at least one [[operation.block]], or programme = a "
                "CSV file of blocks; add one of them"
            )
            raise SceneError([scene.fault(("operation",), text)])
        if operation.programme is not None:
            text = (
                "programme and [[operation.block]] exclude each other; delete one of "
                "them"
            )
            raise SceneError([scene.fault(key, text)])
        return scene, None, None
    path = place("operation.programme", operation.programme)
    if path is None:
        text = (
            f"programme = {shown(operation.programme)} does not exist as given or next "
            "to the scene file; give a CSV file"
        )
        raise SceneError([scene.fault(key, text)])
    table, file, lines = csv_rows(path, "block"), str(path), list[Lines]()
    content = None
    if scene.origin.row_overrides and not table.faults:
        table, lines = _overridden(table, file, scene.origin.row_overrides)
        content = csv_text(table).encode()
    blocks = validated_rows(table, file, BlockSection, "block", lines=lines)
    changed = operation.model_copy(update={"blocks": blocks})
    return scene.model_copy(update={"operation": changed}), path, content


def _cell(value: Any) -> str:
    """Write a value as a cell of a table, empty for none."""
    if value is None:
        return ""
    return value if isinstance(value, str) else toml_value(value)


def _overridden(
    table: CsvTable, file: str, overrides: Sequence[Override]
) -> tuple[CsvTable, list[Lines]]:
    """Programme with the values of overrides, and the lines of each of its rows by key.

    Raises a SceneError with the overrides of rows and keys that are not there.
    """
    header, faults = list(table.header), list[Fault]()
    rows = [dict(zip(header, cells, strict=False)) for _, cells in table.rows]
    lines: list[Lines] = [{(): line} for line, _ in table.rows]
    for override in overrides:
        *selected, key = override.keys[2:]
        names = [row.get("name", "") for row in rows]
        numbered = bool(selected) and selected[0].isdecimal()
        places = range(1, len(rows) + 1)
        labels = list(map(str, places)) if numbered else names
        chosen = [k for k, name in enumerate(labels) if selected in ([], [name])]
        if key not in BlockSection.model_fields:
            text = unknown_key(("operation", "block", "1", key), RigScene)
            faults.append(Fault(text, override.source or file, override.line))
        elif not chosen:
            text = (
                f"{Path(file).name} has no row {shown('.'.join(selected))}; rows are "
                f"selected by their name ({listed(names)}), or by their number counted "
                "from 1"
            )
            faults.append(Fault(text, override.source or file, override.line))
        if key not in header:
            header.append(key)
        for k in chosen:
            rows[k][key] = _cell(override.value)
            lines[k][(key,)] = OverriddenLine.of(line_of(lines[k], ()), override)
    raise_any(faults)
    cells = [[row.get(key, "") for key in header] for row in rows]
    numbers = [line for line, _ in table.rows]
    return CsvTable(
        table.line, header, list(zip(numbers, cells, strict=True)), table.faults
    ), lines
