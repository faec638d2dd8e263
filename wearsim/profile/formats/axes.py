"""From the axes, units and origin of a file to ours; whatever is found out about them is said."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from wearsim.profile.checks import (
    HEIGHT_RANGE,
    MIN_POINTS,
    WIDTH_RANGE,
    points_faults,
    shape_faults,
)
from wearsim.profile.formats.orientation import flip_z, rail_flip_y, wheel_flip_y, wheel_offset
from wearsim.profile.formats.points import EXACT, Points, as_floats, scaled
from wearsim.profile.formats.text import Faults
from wearsim.profile.formats.thinning import thinned
from wearsim.profile.shape import FloatArray

IndexArray = NDArray[np.intp]

UNITS: dict[str, Decimal] = {
    "mm": Decimal("0.001"),
    "m": Decimal(1),
    "cm": Decimal("0.01"),
    "in": Decimal("0.0254"),
}
_TOLD_APART = ("mm", "m", "in")  # cm are read on request only: rails in cm and in inches overlap
_SPOKEN = {"mm": "mm", "m": "metres", "cm": "cm", "in": "inches"}
_UNITS_WAY = "state them with --units"
IN_CM = "it has the size of one in cm"
"""In the message on a size that fits no unit but this one."""
_MOST_STUTTER = 50  # points left out of a list of any length
_MOST_BACK = 1e-3  # a longer step back is no stutter of the instrument [m]


@dataclass(frozen=True)
class Said:
    """What the user states about a file; None is left to detection.

    Parameters
    ----------
    units : str or None
        One of `UNITS`.
    mirror : bool or None
        Whether the file's y grows towards the flange or gauge side.
    z_up : bool or None
        Whether the file's z grows upwards, away from the tip of a flange or the foot of a rail.
    origin : {"tape", "back"} or None
        Where y of a wheel is counted from: tape circle or flange back.
    """

    units: str | None = None
    mirror: bool | None = None
    z_up: bool | None = None
    origin: Literal["tape", "back"] | None = None


@dataclass(frozen=True)
class OurAxes:
    """Points of a file in the axes of `Profile`.

    Parameters
    ----------
    y, z : (n,) array
        Points in metres, from the flange back or gauge side to the field side.
    notes : tuple of str
        What was detected and done, one sentence each.
    tape : float or None
        Distance of the tape circle from the flange back that the header told, if y counts from there [m].
    """

    y: FloatArray
    z: FloatArray
    notes: tuple[str, ...]
    tape: float | None


def to_our_axes(points: Points, kind: Literal["wheel", "rail"], said: Said, faults: Faults) -> OurAxes:
    """Points of a file in the axes of `Profile`.

    Parameters
    ----------
    points : Points
        As read.
    kind : {"wheel", "rail"}
        What they are.
    said : Said
        Statements of the user; they overrule the file and all detection.
    faults : Faults
        Takes what is wrong; raised here.

    Returns
    -------
    OurAxes
        Points and what was found out on them.

    Notes
    -----
    Detection works on rounded numbers; the result comes from the decimals of the file by exact
    arithmetic, rounded once, so that written profiles are read back to the bit.
    """
    notes: list[str] = []
    rough_y = _rough(points.y, points.shift_y, points.mirror_y)
    rough_z = _rough(points.z, points.shift_z, points.mirror_z)
    unit = _unit(points, kind, rough_y, rough_z, said.units, faults, notes)
    y, z = rough_y * float(unit), rough_z * float(unit)
    kept = _distinct(y, z, notes)
    kept = _without_stutter(y, z, kept, points.lines, notes)
    lines = [points.lines[int(k)] for k in kept]
    y, z = y[kept], z[kept]

    def refuse(found: list[tuple[str, int | None]]) -> None:
        for message, point in found:
            faults.add(message, None if point is None else lines[point])
        faults.refuse()

    refuse(shape_faults(kind, y, z, _UNITS_WAY))
    longest = float(np.max(np.hypot(np.diff(y), np.diff(z))))
    if longest > 5e-3:
        notes.append(f"straight piece of {longest * 1e3:.3g} mm without points near an end taken as it is")
    upside = flip_z(kind, y, z, points.z_axis, said.z_up, faults, notes)
    faults.refuse()
    z = -z if upside else z
    if kind == "wheel":
        flip_y = wheel_flip_y(y, z, points.y_axis, said.mirror, faults, notes)
        offset = Decimal(0)
        if not faults.found:
            offset = wheel_offset(-y if flip_y else y, z, points, said.origin, notes)
    else:
        flip_y = rail_flip_y(y, z, points.y_axis, said.mirror, faults, notes)
        offset = Decimal(0)
    faults.refuse()
    factor_y = EXACT.multiply(unit, Decimal(-1 if flip_y != points.mirror_y else 1))
    factor_z = EXACT.multiply(unit, Decimal(-1 if upside != points.mirror_z else 1))
    y = scaled([points.y[int(k)] for k in kept], points.shift_y, factor_y, offset)
    z = scaled([points.z[int(k)] for k in kept], points.shift_z, factor_z, Decimal(0))
    refuse(points_faults(kind, y, z, _UNITS_WAY))
    if y[0] > y[-1]:
        # some formats prescribe this order; it is told all the same, for it is a frequent doubt
        notes.append("points listed from the field side, order reversed")
        y, z = y[::-1].copy(), z[::-1].copy()
    thin, deviation = thinned(y, z)
    if len(thin) < len(y):
        notes.append(
            f"{len(thin)} of {len(y)} points taken, the others lie within {deviation * 1e6:.2g} um of the "
            "lines between them"
        )
        y, z = y[thin], z[thin]
    counted = points.tape is not None and offset != 0
    return OurAxes(y, z, tuple(notes), 1e-3 * float(points.tape) if points.tape and counted else None)


def _rough(cells: list[str], shift: Decimal, mirror: bool) -> FloatArray:
    """Coordinate after the file's own keys, in its unit."""
    values = as_floats(cells) + float(shift)
    return -values if mirror else values


def _unit(
    points: Points,
    kind: Literal["wheel", "rail"],
    y: FloatArray,
    z: FloatArray,
    said: str | None,
    faults: Faults,
    notes: list[str],
) -> Decimal:
    """Length of the file's unit [m]."""
    if said is not None:
        notes.append(f"units {said} as stated")
        return UNITS[said]
    if points.metres is not None:
        return points.metres
    if len(y) < MIN_POINTS:
        return UNITS["mm"]  # refused for that
    fits = [name for name in _TOLD_APART if _plausible(kind, y, z, float(UNITS[name]), name)]
    if fits == ["mm"]:
        return UNITS["mm"]
    if len(fits) == 1:
        notes.append(f"units {fits[0]} by the size")
        return UNITS[fits[0]]
    # a wild point or mixed units spoil the size, and their line is the better message
    if any(point is not None for _, point in shape_faults(kind, y * 1e-3, z * 1e-3)):
        return UNITS["mm"]
    low, high = WIDTH_RANGE[kind]
    if low <= float(np.ptp(y)) * 1e-3 <= high:
        return UNITS["mm"]  # only the height is wrong, which the checks of the shape tell better
    wide = [_SPOKEN[name] for name in UNITS if low <= float(np.ptp(y)) * float(UNITS[name]) <= high]
    hint = f"; the width alone would fit {' or '.join(wide)}" if wide and not fits else ""
    if not fits and _plausible(kind, y, z, float(UNITS["cm"]), "cm"):
        hint = f"; {IN_CM}{' or inches' if 'inches' in wide else ''}"
    faults.add(
        f"the {kind} profile is {np.ptp(y):.4g} wide and {np.ptp(z):.4g} high, which fits "
        f"{'several units' if fits else 'no unit'} (a {kind} is {low * 1e3:g} .. {high * 1e3:g} mm wide and "
        f"{HEIGHT_RANGE[kind][0] * 1e3:g} .. {HEIGHT_RANGE[kind][1] * 1e3:g} mm high){hint}: check the "
        f"columns and state --units {', '.join(UNITS)}"
    )
    faults.refuse()
    return UNITS["mm"]


def _plausible(kind: str, y: FloatArray, z: FloatArray, unit: float, name: str) -> bool:
    """Tell whether the size fits a unit."""
    width, height = float(np.ptp(y)) * unit, float(np.ptp(z)) * unit
    # above 76 mm, a rail said to be in inches might as well be one in cm
    most = 0.076 if (kind, name) == ("rail", "in") else WIDTH_RANGE[kind][1]
    return WIDTH_RANGE[kind][0] <= width <= most and HEIGHT_RANGE[kind][0] <= height <= HEIGHT_RANGE[kind][1]


def _distinct(y: FloatArray, z: FloatArray, notes: list[str]) -> IndexArray:
    """Return the indices of the points that differ from the one before them (instruments at rest)."""
    keep = np.ones(len(y), dtype=bool)
    keep[1:] = (np.diff(y) != 0.0) | (np.diff(z) != 0.0)
    left_out = len(y) - int(np.count_nonzero(keep))
    if left_out:
        notes.append(f"{left_out} duplicate point{'s' if left_out > 1 else ''} left out")
    return np.flatnonzero(keep)


def _without_stutter(
    y: FloatArray, z: FloatArray, kept: IndexArray, lines: list[int], notes: list[str]
) -> IndexArray:
    """Leave out single points where the instrument stepped back a little, at most one in fifty."""
    most = min(max(3, len(kept) // 50), _MOST_STUTTER)
    dropped: list[int] = []
    rest = kept
    back = _turns(y[rest], z[rest])
    while 0 < len(back) <= 2 * most and len(dropped) < most:
        j = int(back[0])
        around = rest[j - 1 : j + 2]
        if np.min(np.hypot(np.diff(y[around]), np.diff(z[around]))) > _MOST_BACK:
            break
        # either the point before the step back or the one behind it is the odd one
        choices = [np.delete(rest, j + 1), np.delete(rest, j)]
        turns = [_turns(y[each], z[each]) for each in choices]
        odd = int(len(turns[1]) < len(turns[0]))
        dropped.append(int(rest[j + 1 - odd]))
        rest, back = choices[odd], turns[odd]
    if len(back) or not dropped:
        return kept  # nothing is left out of a list that does not come right by that; the checks refuse it
    told = ", ".join(str(lines[k]) for k in sorted(dropped)[:10])
    plural = "s" if len(dropped) > 1 else ""
    notes.append(f"{len(dropped)} point{plural} stepping back left out (line{plural} {told})")
    return rest


def _turns(y: FloatArray, z: FloatArray) -> IndexArray:
    """Return the points at which a list turns back by more than 154 degrees, as `shape_faults` sees it."""
    dy, dz = np.diff(y), np.diff(z)
    step = np.hypot(dy, dz)
    return np.flatnonzero(dy[1:] * dy[:-1] + dz[1:] * dz[:-1] < -0.9 * step[1:] * step[:-1]) + 1
