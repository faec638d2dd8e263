"""Dataset of a rig programme: pattern, copy, price of guard and blocks, limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from wearsim.campaign.state import State
from wearsim.contact.dataset import SIDES
from wearsim.errors import NumericalError
from wearsim.studies.copies import Copy, copied_forces, copied_positions
from wearsim.studies.design import Block, Design
from wearsim.translation.guard import zone_of
from wearsim.translation.programme import (
    few_blocks,
    fewer,
    greedy,
    pattern_error,
    smallest_error,
)

FloatArray = NDArray[np.float64]

GUARDS = (1.1, 1.3, 1.5, 2.0, 0.0)
"""Guards whose price is stated; 0 is none."""
BLOCK_COUNTS = (6, 12, 18, 24)
"""Numbers of blocks whose error is stated."""


def _curves(design: Design) -> dict[str, Any]:
    """Price of the guard, and error over the number of blocks, on new wheels."""
    depth = min(design.stage_depth, design.target.deepest)
    part = design.target.stage(0.0, depth)
    wear = design.new
    deepest = float(part.depth.max())
    within = design.section.tolerance * deepest
    guards = GUARDS if part.pressure is not None else (0.0,)
    errors, distances = [], []
    for guard in guards:
        problem, _, single = wear.problem(part.depth, part, guard)
        try:
            durations = few_blocks(problem.only(single), within, 0)
        except NumericalError:  # a point of a curve is no reason to lose the programme
            errors.append(np.nan)
            distances.append(np.nan)
            continue
        errors.append(durations.tolerance / deepest)
        distances.append(float(durations.distance.sum()))
    problem, _, single = wear.problem(part.depth, part, design.section.guard)
    part_of = problem.only(single)
    left = few_blocks(part_of, within, 0).blocks
    by_count = []
    for count in sorted(BLOCK_COUNTS, reverse=True):
        left = fewer(part_of, left, count)
        ways = (greedy(problem, count), single[left])
        by_count.append(min(smallest_error(problem.only(way))[0] for way in ways))
    return {
        "guard": ("guard", list(guards)),
        "guard_error": ("guard", errors),
        "guard_rig_distance": ("guard", distances),
        "count": ("count", sorted(BLOCK_COUNTS)),
        "blocks_error": ("count", np.array(by_count[::-1]) / deepest),
    }


def programme_dataset(
    design: Design,
    blocks: Sequence[Block],
    rows: Sequence[Mapping[str, float]],
    state: State,
) -> xr.Dataset:
    """Dataset of a designed programme, see `programme`."""
    target = design.target
    copies = {"copy": copied_positions(design), "copy_forces": copied_forces(design)}
    end, along = target.depth[-1], ("wheel", "point")
    rig = float(sum(block.distance for block in blocks))
    error = pattern_error(state.wear_depth, end)
    values: dict[str, Any] = {
        "target": (along, end, _attrs("wear depth of the target", "m")),
        "depth": (along, state.wear_depth, _attrs("wear depth of the programme", "m")),
        "profile_y": (
            along,
            target.y,
            _attrs("lateral position on the new wheel", "m"),
        ),
        "profile_z": (along, target.z, _attrs("height of the new wheel", "m")),
    }
    for name, copy in copies.items():
        if copy.depth is not None:
            about = _attrs(f"wear depth of {copy.what} of the field on the rig", "m")
            values[name] = (along, copy.depth, about)
    for name, (meaning, unit) in _OF_STAGE.items():
        column = [row[name] for row in rows]
        values[name] = ("stage", column, _attrs(meaning, unit))
    by_force = design.set_points.by_force
    what, unit = ("lateral_force", "N") if by_force else ("shift", "m")
    word = what.replace("_", " ")
    columns: dict[str, tuple[list[Any], str, str]] = {
        "block_stage": ([block.stage + 1 for block in blocks], "stage", "1"),
        f"{what}_begin": (
            [block.lateral[0] for block in blocks],
            f"first {word}",
            unit,
        ),
        f"{what}_end": ([block.lateral[1] for block in blocks], f"last {word}", unit),
        "positions": ([block.positions for block in blocks], "points of a ramp", "1"),
        "yaw": ([block.yaw for block in blocks], "yaw angle", "rad"),
        "wheel_load": ([block.load for block in blocks], "load of a wheel", "N"),
        "distance": ([block.distance for block in blocks], "distance run", "m"),
    }
    for name, (column, meaning, unit) in columns.items():
        values[name] = ("block", column, _attrs(meaning, unit))
    values |= _curves(design)
    field_run = float(target.distance[-1])
    environment = design.set_points.environment / target.environment()
    runs = sum(row["blocks"] * row["loops"] for row in rows)
    changeovers = 60.0 * design.section.changeover_min * max(runs - 1.0, 0.0)
    numbers: dict[str, Any] = {
        "target_name": target.name,
        "target_distance": field_run,
        "rig_distance": rig,
        "rig_time": rig / design.set_points.speed + changeovers,
        "acceleration": field_run / rig,
        "acceleration_environment": environment,
        "acceleration_mechanism": field_run / rig / environment,
        "largest_error": error.share,
        "rms_error": error.rms / error.deepest,
        "tolerance": design.section.tolerance,
        "guard": design.section.guard if target.field is not None else 0.0,
        "candidates": int(design.candidates.first.size),
        "history": "wearsim.programme",
    }
    for name, copy in copies.items():
        numbers |= _of_copy(name, copy, field_run, end)
    lines = {
        "limits": _limits_that_bind(design, blocks),
        "missed": missed(design, state.wear_depth),
        "warnings": _warnings(rows),
    }
    numbers |= {name: "\n".join(texts) for name, texts in lines.items()}
    names = {"wheel": list(SIDES), "stage": np.arange(1, len(rows) + 1)}
    return xr.Dataset(values, coords=names, attrs=numbers).set_coords(
        ["profile_y", "profile_z", "guard", "count"]
    )


def _of_copy(
    name: str, copy: Copy, field_run: float, end: FloatArray
) -> dict[str, Any]:
    """Attributes of a copy of the field; NaN and a reason where there is none."""
    error = np.nan
    if copy.depth is not None:
        error = pattern_error(copy.depth, end).share
    return {
        f"{name}_of": copy.what,
        f"{name}_distance": copy.distance,
        f"{name}_acceleration": field_run / copy.distance,
        f"{name}_error": error,
        f"{name}_reason": copy.reason,
    }


_OF_STAGE = {
    "target_depth": ("largest depth of the target at the end of the stage", "m"),
    "field_distance": ("distance of the field at the end of the stage", "m"),
    "rig_distance": ("distance of the rig in the stage", "m"),
    "tolerance": ("largest error allowed", "m"),
    "loops": ("number of loops of the blocks", "1"),
    "kept_error": ("error that the durations keep by linear wear", "m"),
    "largest_error": ("largest error after the stage was run", "m"),
    "blocks": ("number of blocks", "1"),
    "guard_binds": ("1 where the guard limits the durations", "1"),
}


def _attrs(meaning: str, unit: str) -> dict[str, str]:
    return {"long_name": meaning, "units": unit}


def _limits_that_bind(design: Design, blocks: Sequence[Block]) -> list[str]:
    """Lines on the ends of the ranges of set-points at which blocks run."""
    set_points, run = design.set_points, sum(block.distance for block in blocks)
    ends = set_points.lateral[-1], np.abs(set_points.yaw).max(), set_points.load[-1]
    values = (
        [max(abs(lateral) for lateral in block.lateral) for block in blocks],
        [abs(block.yaw) for block in blocks],
        [block.load for block in blocks],
    )
    texts = []
    for name, factor, unit, end, column, reason in zip(
        ("lateral force" if set_points.by_force else "shift", "yaw", "load"),
        (1e-3 if set_points.by_force else 1e3, 1e3, 1e-3),
        ("kN" if set_points.by_force else "mm", "mrad", "kN"),
        ends,
        values,
        set_points.limits,
        strict=True,
    ):
        at = sum(
            block.distance
            for block, value in zip(blocks, column, strict=True)
            if value >= end * (1.0 - 1e-9)
        )
        if at > 0.0 and end > 0.0:
            limit = _LIMITS[reason]
            texts.append(
                f"{name} at its largest, {factor * end:.4g} {unit} ({limit}), over "
                f"{100.0 * at / run:.3g} % of the distance"
            )
    return texts


_LIMITS = {
    "rig": "the limit of the rig",
    "flange": "the flange clearance",
    "scene": "the end of the range in [programme]",
}


def missed(design: Design, depth: FloatArray) -> list[str]:
    """Lines on the zones in which the pattern is off by more than the tolerance.

    The worst one comes first.
    """
    end = design.target.depth[-1]
    error = (depth - end) / end.max()
    zone = zone_of(design.target.y)
    texts: list[tuple[float, str]] = []
    reach = design.new.depth.max(axis=0)
    for wheel, side in enumerate(SIDES):
        for number in np.unique(zone[wheel]):
            place = np.flatnonzero(zone[wheel] == number)
            worst = place[int(np.abs(error[wheel, place]).argmax())]
            deviation = error[wheel, worst]
            if abs(deviation) <= design.section.tolerance:
                continue
            y = 1e3 * design.target.y[wheel, worst]
            how = "too deep" if deviation > 0.0 else "too shallow"
            why = "no durations within tolerance, blocks and guard do better"
            if deviation < 0.0 and reach[wheel, worst] < 1e-3 * reach.max():
                why = "no set-point within the limits wears there"
            text = (
                f"{side} wheel, y = {y:.3g} mm: {100.0 * abs(deviation):.3g} % of the "
            )
            texts.append((abs(deviation), f"{text}deepest {how}; {why}"))
    return [text for _, text in sorted(texts, key=lambda entry: -entry[0])]


def _warnings(rows: Sequence[Mapping[str, float]]) -> list[str]:
    """Lines on stages whose tolerance is out of reach."""
    texts = []
    for number, row in enumerate(rows, start=1):
        if row["kept_error"] > row["tolerance"] * (1.0 + 1e-6):
            cause = "set-points, blocks and guard together"
            texts.append(
                f"stage {number}: {1e6 * row['tolerance']:.3g} um are out of reach of "
                f"the {cause}; {1e6 * row['kept_error']:.3g} um are kept"
            )
    return texts
