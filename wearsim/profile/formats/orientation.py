"""Which way the axes of a file point, told from its points, its format or the user."""

from __future__ import annotations

from decimal import Decimal
from typing import Literal

import numpy as np

from wearsim.profile.checks import head_faults
from wearsim.profile.formats.points import EXACT, Points
from wearsim.profile.formats.text import Faults
from wearsim.profile.placement import GAUGE_DEPTH
from wearsim.profile.shape import FloatArray

TAPE = Decimal(70)  # tape line from the flange back [mm]
# Flange tip of a wheel counted from the flange back and from the tape circle [m].
_TIP_FROM_BACK = (-0.010, 0.040)
_TIP_FROM_TAPE = (-0.080, -0.030)
_TIP_RISE = 3e-3  # a flange tip stands out on both sides by more than this [m]
_SYMMETRIC = 20e-6  # a head this symmetric is the same mirrored [m]
_FLANGE_RISE = 10e-3  # a flange without its back stands off the tread by more than this [m]


def flip_z(
    kind: Literal["wheel", "rail"],
    y: FloatArray,
    z: FloatArray,
    axis: str,
    z_up: bool | None,
    faults: Faults,
    notes: list[str],
) -> bool:
    """Tell whether z is to change its sign.

    Parameters
    ----------
    kind : {"wheel", "rail"}
        What the points are.
    y, z : (n,) array
        Points [m].
    axis : {"down", "up", "unknown"}
        Whither z grows by the rule of the format.
    z_up : bool or None
        What the user states.
    faults : Faults
        Takes what cannot be told, with the flag that settles it.
    notes : list of str
        Takes what was found out.

    Returns
    -------
    bool
        True if z grows upwards in the file.
    """
    if z_up is not None:
        notes.append(f"z {'up, sign changed' if z_up else 'down'}, as stated")
        return z_up
    up = _wheel_points_up(z) if kind == "wheel" else _rail_points_up(y, z)
    expected = axis == "up"
    if up is None:
        what = (
            "a flange tip stands out on neither side"
            if kind == "wheel"
            else "the head is as flat as its ends"
        )
        if kind == "wheel" or axis == "unknown":
            faults.add(f"{what}, so the sign of z is not known: state --z-up or --z-down")
            return False
        notes.append(f"{what}: z taken as {axis}, the rule of the format")
        return expected
    if up:
        notes.append("z up, sign changed")
    elif expected:
        notes.append("z down, although the rule of the format is up")
    return up


def _wheel_points_up(z: FloatArray) -> bool | None:
    """Whether the flange tip is at the smallest z; None if there is no tip."""
    down, up = _tip_rise(z), _tip_rise(-z)
    if max(down, up) < _TIP_RISE or max(down, up) < 3.0 * min(down, up):
        # the profile may begin at the tip: then the flange is what lies furthest off the tread
        tread = float(np.median(z))
        down, up = float(z.max()) - tread, tread - float(z.min())
        if max(down, up) < _FLANGE_RISE or max(down, up) < 2.5 * min(down, up):
            return None
    return up > down


def _tip_rise(z: FloatArray) -> float:
    """Height of the highest point over the lowest on its lower side; 0 at an end of the list."""
    tip = int(np.argmax(z))
    return float(z[tip] - max(z[: tip + 1].min(), z[tip:].min()))


def _rail_points_up(y: FloatArray, z: FloatArray) -> bool | None:
    """Whether the top is at larger z than the ends; None if the head is nearly level with them."""
    middle = 0.5 * (float(y.min()) + float(y.max()))
    inner = np.abs(y - middle) < 0.2 * np.ptp(y)
    if not np.any(inner):
        return None
    fall = 0.5 * (float(z[0]) + float(z[-1])) - float(np.median(z[inner]))
    return None if abs(fall) < 0.05 * float(np.ptp(z)) else fall < 0.0


def wheel_flip_y(
    y: FloatArray, z: FloatArray, axis: str, mirror: bool | None, faults: Faults, notes: list[str]
) -> bool:
    """Tell whether y of a wheel is to change its sign: the flange belongs to the end of smaller y.

    Parameters
    ----------
    y, z : (n,) array
        Points [m], z towards the flange tip.
    axis : {"field", "centre", "unknown"}
        Whither y grows by the rule of the format.
    mirror : bool or None
        What the user states.
    faults : Faults
        Takes what cannot be told, with the flag that settles it.
    notes : list of str
        Takes what was found out.

    Returns
    -------
    bool
        True if the flange is at the end of larger y.
    """
    if mirror is not None:
        notes.append("y mirrored as stated" if mirror else "y not mirrored, as stated")
        return mirror
    place = (float(y[int(np.argmax(z))]) - float(y.min())) / float(np.ptp(y))
    if 0.4 < place < 0.6:
        faults.add(
            "the flange tip is in the middle of the profile, so its side is not known: state --mirror "
            "(flange at the end of larger y) or --no-mirror"
        )
        return False
    if place > 0.5:
        notes.append("flange at the end of larger y, y mirrored")
    elif axis == "centre":
        notes.append("y towards the field side, although the rule of the format is the track centre")
    return place > 0.5


def wheel_offset(
    y: FloatArray, z: FloatArray, points: Points, origin: str | None, notes: list[str]
) -> Decimal:
    """Shift that lets y of a wheel begin at the tape circle.

    Parameters
    ----------
    y, z : (n,) array
        Points [m], flange at smaller y, z towards its tip.
    points : Points
        May tell the distance of the tape line from the flange back.
    origin : {"tape", "back"} or None
        What the user states.
    notes : list of str
        Takes what was found out.

    Returns
    -------
    Decimal
        To be added to y [m].
    """
    tape = points.tape if points.tape is not None else TAPE
    offset = -EXACT.multiply(tape, Decimal("0.001"))
    if origin is not None:
        notes.append(f"y counted from the {'tape circle' if origin == 'tape' else 'flange back'}, as stated")
        return offset if origin == "back" else Decimal(0)
    tip = float(y[int(np.argmax(z))])
    from_back = _TIP_FROM_BACK[0] <= tip <= _TIP_FROM_BACK[1]
    if points.tape is not None and not from_back:
        from_back = _TIP_FROM_TAPE[0] <= tip + float(offset) <= _TIP_FROM_TAPE[1] and not (
            _TIP_FROM_TAPE[0] <= tip <= _TIP_FROM_TAPE[1]
        )
    if not from_back:
        return Decimal(0)
    told = f"{float(tape):g} mm subtracted"
    header = " (header)" if points.tape is not None else ""
    notes.append(f"y counted from the flange back, {told}{header}")
    return offset


def rail_flip_y(
    y: FloatArray, z: FloatArray, axis: str, mirror: bool | None, faults: Faults, notes: list[str]
) -> bool:
    """Tell whether y of a rail is to change its sign: the gauge side belongs to the end of smaller y.

    Parameters
    ----------
    y, z : (n,) array
        Points [m], z down.
    axis : {"field", "centre", "unknown"}
        Whither y grows by the rule of the format.
    mirror : bool or None
        What the user states.
    faults : Faults
        Takes what cannot be told, with the flag that settles it.
    notes : list of str
        Takes what was found out.

    Returns
    -------
    bool
        True if the gauge side is at the end of larger y.
    """
    if mirror is not None:
        notes.append("y mirrored as stated" if mirror else "y not mirrored, as stated")
        return mirror
    if head_faults(y, z):
        return axis == "centre"  # refused by the checks
    top = int(np.argmin(z))
    low = y <= y[top]
    # depth of the flanks below the top, at the ends of smaller and of larger y
    depth = [float(z[side].max() - z[top]) if np.any(side) else 0.0 for side in (low, ~low)]
    gauge_at_larger = None if (depth[0] >= GAUGE_DEPTH) == (depth[1] >= GAUGE_DEPTH) else depth[1] > depth[0]
    if axis == "unknown":
        if gauge_at_larger is not None:
            end = "larger" if gauge_at_larger else "smaller"
            notes.append(f"gauge side at the end of {end} y: only there the head reaches 14 mm down")
            if gauge_at_larger:
                notes.append("y mirrored")
            return gauge_at_larger
        if _symmetric(y, z, top):
            notes.append("head symmetric: it does not matter which side is the gauge side")
            return False
        faults.add(
            "both sides of the head could be the gauge side: state --mirror (gauge side at the end of "
            "larger y) or --no-mirror (at the end of smaller y)"
        )
        return False
    flip = axis == "centre"
    if gauge_at_larger is not None and gauge_at_larger != flip:
        faults.add(
            f"the gauge side should be at the end of {'larger' if flip else 'smaller'} y by the rule of the "
            "format, but only the other side of the head reaches 14 mm down: state --mirror (gauge side at "
            "the end of larger y) or --no-mirror"
        )
    if flip:
        notes.append("y towards the track centre, sign changed")
    return flip


def _symmetric(y: FloatArray, z: FloatArray, top: int) -> bool:
    """Tell whether a head is its own mirror image."""
    head = z - z[top] < 0.010
    left, right = float(y[head].min()), float(y[head].max())
    axis, half = 0.5 * (left + right), 0.5 * (right - left)
    order = np.argsort(y[head], kind="stable")
    at = np.linspace(0.0, 0.97 * half, 200)
    z_left = np.interp(axis - at, y[head][order], z[head][order])
    z_right = np.interp(axis + at, y[head][order], z[head][order])
    return bool(np.max(np.abs(z_left - z_right)) < _SYMMETRIC)
