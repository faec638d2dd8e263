"""[operation] of a scene: blocks of a rig, classes of track, monitoring points."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, ClassVar

from pydantic import Field

from wearsim.errors import listed, shown
from wearsim.scene.section import (
    Messages,
    Section,
    SetPoints,
    Text,
    quantity,
    range_of,
    text_field,
)
from wearsim.scene.vehicle import SHARES_ROUNDED, CurveRadius
from wearsim.toml_faults import KeyPath

WHEEL_TORQUES = ("wheel_torque_right_kN_m", "wheel_torque_left_kN_m")
"""Keys of the torques on wheels that rotate independently, right and left."""

Shift = Annotated[float, Field(**range_of("shift"))]


class Running(SetPoints):
    """How the wheelset runs, alike in blocks and classes."""

    yaw_mrad: float = quantity("yaw", 0.0)
    roll_mrad: float = quantity("roll", 0.0)
    load_kN: float | None = quantity("wheel_load", None)
    wheel_load_right_kN: float | None = quantity(
        "wheel_load", None, "the vertical load of the right wheel"
    )
    wheel_load_left_kN: float | None = quantity(
        "wheel_load", None, "the vertical load of the left wheel"
    )
    axle_load_kN: float | None = quantity("axle_load", None)
    wheel_torque_right_kN_m: float | None = quantity(
        "wheel_torque",
        None,
        "the drive or brake torque on the right wheel, driving forward, of wheels with "
        'rotation = "independent" in [contact], in place of axle_torque_kN_m',
    )
    wheel_torque_left_kN_m: float | None = quantity(
        "wheel_torque",
        None,
        "the drive or brake torque on the left wheel, as that on the right one",
    )

    @property
    def balanced(self) -> bool:
        """Return True if the shift or the wheel loads follow from forces."""
        keys = ("lateral_force_kN", "axle_box_right_kN", "axle_load_kN")
        return any(getattr(self, key, None) is not None for key in keys)

    @property
    def loads_kN(self) -> tuple[float, float]:
        """Loads of the right and left wheel as stated, infinite where they follow.

        Half of the axle load where that is stated.
        """
        right, left = self.wheel_load_right_kN, self.wheel_load_left_kN
        if right is not None and left is not None:
            return right, left
        load = 0.5 * self.axle_load_kN if self.axle_load_kN else self.load_kN
        return (math.inf, math.inf) if load is None else (load, load)


class BlockSection(Running):
    """[[operation.block]]: one block of the rig programme."""

    shift_mm: float | None = quantity(
        "shift", None, "the lateral shift, + to the right"
    )
    lateral_force_kN: float | None = quantity(
        "lateral_force",
        None,
        "the lateral force at axle height, + to the right, in place of the shift",
    )
    axle_box_right_kN: float | None = quantity(
        "axle_load", None, "the vertical force on the right axle box"
    )
    axle_box_left_kN: float | None = quantity(
        "axle_load", None, "the vertical force on the left axle box"
    )
    speed_difference_percent: float | None = quantity("speed_difference", None)
    distance_km: float | None = quantity(
        "block_length", None, "the distance run in this block of the loop"
    )
    duration_h: float | None = quantity(
        "duration", None, "the time of this block, in place of its distance"
    )
    revolutions: float | None = quantity("revolutions", None)
    positions: int | None = quantity("ramp_positions", None)


class ClassSection(Running):
    """[[operation.class]]: one class of track in the field."""

    curve_radius_m: CurveRadius | None = Field(
        None,
        description="the curve radius, + to the right; none in tangent track",
        json_schema_extra={"unit": "m"},
    )
    shift_mean_mm: float = quantity(
        "shift", meaning="the mean lateral shift, + to the right"
    )
    shift_std_mm: float = quantity("shift_std")
    positions: int = quantity(
        "positions", 15, "the number of lateral positions within 3 standard deviations"
    )
    share: float = quantity("weight", meaning="the share of the distance")


class MonitorSection(Section):
    """[operation.monitor]: points solved and stored for comparison, which wear
    nothing.
    """

    shifts_mm: tuple[Shift, ...] = Field(
        description="the lateral shifts to watch",
        min_length=1,
        max_length=200,
        strict=False,
        json_schema_extra={"unit": "mm"},
    )
    yaw_mrad: float = quantity("yaw", 0.0)
    load_kN: float = quantity("wheel_load", meaning="the vertical load of one wheel")
    speed_km_h: float = quantity("speed", meaning="the speed")
    friction: float = quantity("friction", meaning="Coulomb's coefficient of friction")


class RigOperation(Section):
    """[operation] of a rig: a programme of blocks, looped until the distance is run."""

    not_here: ClassVar[dict[str, str]] = {
        "class": "classes belong to a field scene; write [[operation.block]], or kind "
        '= "field" in [scene]',
    }
    programme: Text | None = text_field(
        "a CSV file of blocks, one a row, with columns named as their keys", None
    )
    blocks: tuple[BlockSection, ...] = Field(
        (),
        alias="block",
        description="the blocks of the rig programme",
        max_length=1000,
        strict=False,
    )
    together: bool = Field(
        False,
        description="weigh all blocks by their share of the loop in every step, not "
        "one after another",
    )
    monitor: MonitorSection | None = None

    @property
    def runs(self) -> dict[KeyPath, BlockSection | ClassSection]:
        """Blocks by their path in the scene."""
        return {("operation", "block", k): block for k, block in enumerate(self.blocks)}


class FieldOperation(Section):
    """[operation] in the field: classes of track, each with a distribution of the
    shift.
    """

    not_here: ClassVar[dict[str, str]] = {
        "block": "blocks belong to a rig scene; write [[operation.class]], or kind = "
        '"rig" in [scene]',
    }
    classes: tuple[ClassSection, ...] = Field(
        (),
        alias="class",
        description="the classes of track",
        max_length=1000,
        strict=False,
    )
    monitor: MonitorSection | None = None

    @property
    def runs(self) -> dict[KeyPath, BlockSection | ClassSection]:
        """Classes by their path in the scene."""
        return {("operation", "class", k): run for k, run in enumerate(self.classes)}


Runs = Mapping[KeyPath, BlockSection | ClassSection]
"""Blocks or classes by their path in the scene."""


def _sum_text(shares: Sequence[float]) -> str:
    """Write a sum of the first few shares."""
    more = f" + ... ({len(shares) - 10} more)" if len(shares) > 10 else ""
    return f"{' + '.join(f'{share:g}' for share in shares[:10])}{more}"


def share_faults(runs: Runs) -> Messages:
    """Faults of the shares of classes."""
    shares = [run.share for run in runs.values() if isinstance(run, ClassSection)]
    if shares and abs(sum(shares) - 1.0) > SHARES_ROUNDED:
        text = (
            f"share: the shares of all classes, {_sum_text(shares)}, must sum to 1 "
            f"within {100.0 * SHARES_ROUNDED:g} %, not {sum(shares):.7g}; change them"
        )
        yield ("operation", "class", 0, "share"), text


_LOADS = (
    ("load_kN",),
    ("axle_load_kN",),
    ("wheel_load_right_kN", "wheel_load_left_kN"),
    ("axle_box_right_kN", "axle_box_left_kN"),
)
"""Keys of which a run has those of one line."""


def load_faults(runs: Runs, *, of_boxes: bool) -> Messages:
    """Faults of loads; `of_boxes` says whether forces on boxes give loads of wheels."""
    for path, run in runs.items():
        named = f"{path[1]} {shown(run.name)}"
        given = [
            key
            for line in _LOADS
            for key in line
            if getattr(run, key, None) is not None
        ]
        lines = [line for line in _LOADS if set(line) & set(given)]
        if len(lines) != 1:
            alternatives = " or ".join(
                " and ".join(line) for line in _LOADS if hasattr(run, line[0])
            )
            text = f"{', '.join(given)} exclude each other" if given else "has no load"
            yield (*path, *given[-1:]), f"{named}: {text}; give either {alternatives}"
        elif len(given) < len(lines[0]):
            missing = next(key for key in lines[0] if key not in given)
            yield (
                (*path, given[0]),
                f"{named}: {given[0]} is that of one side; give {missing}, too",
            )
        elif given[0] == "axle_box_right_kN" and not of_boxes:
            text = (
                f"{named}: forces on axle boxes need mass_kg and axle_box_distance_mm "
                "in [wheelset]; add them"
            )
            yield (*path, given[0]), text


def torque_faults(runs: Runs, *, rotation: str) -> Messages:
    """Faults of torques on wheels, which need wheels that rotate independently."""
    for path, run in runs.items():
        named = f"{path[1]} {shown(run.name)}"
        given = [key for key in WHEEL_TORQUES if getattr(run, key) is not None]
        if not given:
            continue
        text = ""
        if rotation != "independent":
            text = (
                f'{given[0]} needs rotation = "independent" in [contact]; write that, '
                "or axle_torque_kN_m in its place"
            )
        elif run.axle_torque_kN_m is not None:
            text = (
                f"{given[0]} and axle_torque_kN_m exclude each other; delete one of "
                "them"
            )
        elif len(given) == 1:
            missing = next(key for key in WHEEL_TORQUES if key not in given)
            text = f"{given[0]} is that of one side; give {missing}, too"
        if text:
            yield (*path, given[0]), f"{named}: {text}"


_WHERE = ("shift_mm", "lateral_force_kN")
_LENGTHS = ("distance_km", "duration_h", "revolutions")


def block_faults(runs: Runs, *, independent: bool) -> Messages:
    """Faults of blocks; `independent` says whether the drive is."""
    blocks = [
        (path, run) for path, run in runs.items() if isinstance(run, BlockSection)
    ]
    set_point_keys = {key for line in (*_LOADS, _WHERE) for key in line}
    for number, (path, run) in enumerate(blocks):
        for keys in (_WHERE, _LENGTHS):
            given = [key for key in keys if getattr(run, key) is not None]
            if len(given) != 1:
                what = (
                    f"{' and '.join(given)} exclude each other"
                    if given
                    else f"needs {' or '.join(keys)}"
                )
                yield (
                    (*path, *given[-1:]),
                    f"block {shown(run.name)}: {what}; give exactly one of them",
                )
        if run.speed_difference_percent and not independent:
            text = (
                f"block {shown(run.name)}: speed_difference_percent needs rollers that "
                'turn apart; write drive = "independent", or delete it'
            )
            yield (*path, "speed_difference_percent"), text
        following = blocks[(number + 1) % len(blocks)][1]
        have, need = (
            {k for k in set_point_keys if getattr(block, k) is not None}
            for block in (run, following)
        )
        if run.positions is not None and have != need:
            text = (
                f"block {shown(run.name)}: a ramp goes to {shown(following.name)}, "
                "which does not give the same set-points "
                f"({listed(sorted(have ^ need))}); give them in both"
            )
            yield (*path, "positions"), text
