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
from wearsim.contact.wheels import TREAD_ANGLE
from wearsim.operation.points import OperatingPoints
from wearsim.texts import text_table

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
    ("shift", "shift [mm]", 1e3, ".2f"),
    ("yaw", "yaw [mrad]", 1e3, ".2f"),
    ("lateral_force", "H [kN]", 1e-3, ".1f"),
    ("load_right", "Q right [kN]", 1e-3, ".1f"),
    ("load_left", "Q left [kN]", 1e-3, ".1f"),
    ("angle_right", "angle right [deg]", 180.0 / math.pi, ".0f"),
    ("angle_left", "left", 180.0 / math.pi, ".0f"),
    ("quotient_right", "Y/Q right", 1.0, ".2f"),
    ("quotient_left", "left", 1.0, ".2f"),
    ("steering_moment", "M [kN m]", 1e-3, ".1f"),
    ("wear_number", "wear number [N]", 1.0, ".0f"),
)


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
    found = []
    for number in dict.fromkeys(points.of_class[points.weight > 0.0].tolist()):
        own = np.flatnonzero(points.of_class == number)
        # the first of those that are alike: mirror images differ by rounding
        k = int(own[np.argmax(wear[own] >= (1.0 - _ALIKE) * wear[own].max())])
        if wear[k] < 0.0:
            continue
        load, angle = forces.vertical[k], forces.angle[k]
        marks = [
            f"{side} flange"
            for side, one in zip(_SIDES, angle, strict=True)
            if one > TREAD_ANGLE
        ]
        if points.beyond is not None and k in points.beyond.point:
            marks.append(
                "its force jumps past the one wanted: it runs on both sides of the "
                "jump in turn"
            )
        few = zip(_SIDES, load < _UNLOADED * load.mean(), strict=True)
        marks += [f"{side} wheel unloaded" for side, unloaded in few if unloaded]
        force = 0.5 * float(np.ptp(forces.longitudinal[k]))
        if force > _HELD * load.mean() and not on_bogie:
            marks.append(
                f"held against +-{1e-3 * force:.0f} kN along the track, which no free "
                "axle would have"
            )
        of_wheels = {
            "load": load,
            "angle": angle,
            "quotient": forces.derailment_quotient[k],
        }
        found.append(
            {
                "name": points.label[k],
                "points": int(own.size),
                "shift": float(shift[k]),
                "yaw": float(conditions.yaw[k]),
                "lateral_force": float(-forces.force[k]),
                **{
                    f"{name}_{side}": float(one)
                    for name, both in of_wheels.items()
                    for side, one in zip(_SIDES, both, strict=True)
                },
                "steering_moment": float(forces.moment[k]),
                "wear_number": float(wear[k]),
                "marks": marks,
            }
        )
    return found


def states_text(rows: Sequence[dict[str, Any]]) -> list[str]:
    """Lines of a table of what `states` returns."""
    table = [["  state", *(title for _, title, _, _ in _COLUMNS)]]
    for row in rows:
        cells = [
            format(row[key] * factor + 0.0, style) for key, _, factor, style in _COLUMNS
        ]
        name = (
            row["name"] if row["points"] == 1 else f"{row['name']} of {row['points']}"
        )
        table.append([f"  {name}", *cells])
    marks = ["", *("; ".join(row["marks"]) for row in rows)]
    lines = [
        f"{line}  {mark}".rstrip()
        for line, mark in zip(text_table(table), marks, strict=True)
    ]
    return lines if rows else []
