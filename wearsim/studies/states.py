"""States of the blocks and classes of a scene.

Forces, angles and wear numbers, and what stands out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from wearsim.campaign.evaluate import forces_of
from wearsim.campaign.passage import Passage
from wearsim.contact.friction import TREAD_ANGLE
from wearsim.operation.points import OperatingPoints
from wearsim.texts import text_table, wrapped

_ALIKE = 1e-3  # relative difference of wear numbers that counts for nothing
_UNLOADED = 0.1
"""Share of the mean wheel load below which a wheel is marked as unloaded."""
_HELD = 0.25
"""Longitudinal force of a wheel over its load, against that of the other one, from
which the pair is marked: a free axle would steer it away, and suspensions that hold
more are rare.
"""

_SIDES = ("right", "left")

_COLUMNS = (
    ("shift", "shift", "[mm]", 1e3, ".2f"),
    ("yaw", "yaw", "[mrad]", 1e3, ".2f"),
    ("lateral_force", "H", "[kN]", 1e-3, ".1f"),
    ("load_right", "Q", "right", 1e-3, ".1f"),
    ("load_left", "[kN]", "left", 1e-3, ".1f"),
    ("angle_right", "angle", "right", 180.0 / math.pi, ".0f"),
    ("angle_left", "[deg]", "left", 180.0 / math.pi, ".0f"),
    ("quotient_right", "Y/Q", "right", 1.0, ".2f"),
    ("quotient_left", "", "left", 1.0, ".2f"),
    ("steering_moment", "M", "[kN m]", 1e-3, ".1f"),
    ("wear_number", "Tγ", "[N]", 1.0, ".0f"),
)
"""Key, two lines of the head of its column, factor to the unit shown, format."""

_LEGEND = (
    "  H lateral force of the wheelset, Q wheel loads, M steering moment, "
    "Tγ wear number of both wheels"
)

_MOST_ROWS = 20
"""States that are listed, of more those of the largest wear numbers."""
_NAME_WIDTH = 29
_MOST_NAMES = 6
"""Names of states that a mark lists."""


def states(points: OperatingPoints, passage: Passage) -> list[dict[str, Any]]:
    """State of each block or class, of a class at its place of largest wear number.

    Parameters
    ----------
    points : OperatingPoints
        Where they run.
    passage : Passage
        Of all of them.

    Returns
    -------
    list of dict
        SI units, with `marks` on what deserves a second look; points without contact
        solution are not in it.
    """
    conditions, forces = points.conditions, forces_of(passage, points)
    forces.vertical[list(passage.failed)] = (
        0.0  # of two sides of a jump one alone says nothing
    )
    shift = conditions.axle_shift(forces.roll)
    wear = np.where(
        forces.vertical.min(axis=1) > 0.0, forces.power / conditions.speed, -1.0
    )
    on_bogie = points.controlled is not None and points.controlled.bogies is not None
    rows = []
    for number in dict.fromkeys(points.of_class[points.weight > 0.0].tolist()):
        members = np.flatnonzero(points.of_class == number)
        # the first of those that are alike: mirror images differ by rounding
        k = int(
            members[np.argmax(wear[members] >= (1.0 - _ALIKE) * wear[members].max())]
        )
        if wear[k] < 0.0:
            continue
        load, angle = forces.vertical[k], forces.angle[k]
        marks = [
            f"{side} flange"
            for side, side_angle in zip(_SIDES, angle, strict=True)
            if side_angle > TREAD_ANGLE
        ]
        if points.beyond is not None and k in points.beyond.point:
            marks.append(
                "its force jumps past the one wanted: it runs on both sides of the "
                "jump in turn"
            )
        unloaded_sides = zip(_SIDES, load < _UNLOADED * load.mean(), strict=True)
        marks += [
            f"{side} wheel unloaded" for side, unloaded in unloaded_sides if unloaded
        ]
        force = 0.5 * float(np.ptp(forces.longitudinal[k]))
        if force > _HELD * load.mean() and not on_bogie:
            marks.append(
                f"the guides react longitudinal creep forces of +-{1e-3 * force:.0f} "
                "kN; a free wheelset would yaw"
            )
        of_wheels = {
            "load": load,
            "angle": angle,
            "quotient": forces.derailment_quotient[k],
        }
        rows.append(
            {
                "name": points.label[k],
                "points": int(members.size),
                "shift": float(shift[k]),
                "yaw": float(conditions.yaw[k]),
                "lateral_force": float(-forces.force[k]),
                **{
                    f"{name}_{side}": float(value)
                    for name, both in of_wheels.items()
                    for side, value in zip(_SIDES, both, strict=True)
                },
                "steering_moment": float(forces.moment[k]),
                "wear_number": float(wear[k]),
                "marks": marks,
            }
        )
    return rows


def states_text(rows: Sequence[dict[str, Any]], every: bool = False) -> list[str]:
    """Lines of a table of what `states` returns, in 100 columns, with its marks below.

    States that read alike share a row. At most 20 rows are listed, in the order of the
    scene, unless `every` one is asked for.
    """
    equal_rows: dict[tuple[str, ...], list[dict[str, Any]]] = {}
    for k, row in enumerate(rows):
        texts = [
            _cell(row[key] * factor, style) for key, _, _, factor, style in _COLUMNS
        ]
        equal_rows.setdefault((*texts, str(k) if every else ""), []).append(row)
    groups = list(equal_rows.items())
    kept = groups
    if not every and len(groups) > _MOST_ROWS:
        order = sorted(groups, key=lambda group: -group[1][0]["wear_number"])
        heaviest = {cells for cells, _ in order[:_MOST_ROWS]}
        kept = [group for group in groups if group[0] in heaviest]
    table = [
        ["  state", *(head for _, head, _, _, _ in _COLUMNS)],
        ["", *(unit for _, _, unit, _, _ in _COLUMNS)],
    ]
    for cells, same in kept:
        table.append([f"  {_name(same)}", *cells[:-1]])
    if not rows:
        return []
    lines = text_table(table, " ")
    if len(kept) < len(groups):
        left = sum(len(same) for _, same in groups) - sum(len(same) for _, same in kept)
        lines.append(f"  {left} more of lower wear number Tγ; all with --all")
    return [*lines, _LEGEND, *_mark_lines(rows)]


def _cell(value: float, style: str) -> str:
    """Write the number of a cell, without sign if it rounds to zero."""
    text = format(value, style)
    return text.lstrip("-") if float(text) == 0.0 else text


def _name(same: Sequence[dict[str, Any]]) -> str:
    """Name of a state, with the number of its points, or of the states like it."""
    first = same[0]
    after = f" of {first['points']}" if first["points"] > 1 else ""
    if len(same) > 1:
        after = f", {len(same) - 1} more like it"
    name = first["name"]
    room = _NAME_WIDTH - len(after)
    return (name if len(name) <= room else f"{name[: room - 3]}...") + after


def _mark_lines(rows: Sequence[dict[str, Any]]) -> list[str]:
    """Lines on what deserves a second look, each with the states that it is of."""
    names: dict[str, list[str]] = {}
    for row in rows:
        for mark in row["marks"]:
            names.setdefault(mark, []).append(row["name"])
    lines = []
    for mark, state_names in names.items():
        more = (
            f" and {len(state_names) - _MOST_NAMES} more"
            if len(state_names) > _MOST_NAMES
            else ""
        )
        text = f"  {mark}: {', '.join(state_names[:_MOST_NAMES])}{more}"
        lines.append(wrapped(text, "    "))
    return lines
