"""From the axes, units and origin of a file to those of `Profile`; whatever is detected is reported."""

from __future__ import annotations

from decimal import Decimal
from typing import Literal, NamedTuple, NoReturn, TypedDict

import numpy as np
from numpy.typing import NDArray

from wearsim.profile import checks
from wearsim.profile.files.points import EXACT, Faults, Points, scaled
from wearsim.profile.placement import GAUGE_DEPTH, halves_apart, is_partial
from wearsim.profile.shape import FloatArray, Kind

UNITS: dict[str, Decimal] = {
    "mm": Decimal("0.001"), "m": Decimal(1), "cm": Decimal("0.01"), "in": Decimal("0.0254")
}  # fmt: skip
ORIGINS = ("running_circle", "flange_back")
RUNNING_CIRCLE = Decimal(70)
"""Distance of the running circle from the flange back [mm]."""

MOST_POINTS = 20_000
"""Lists up to here are taken as they are; 160 mm of profile are then 8 um from point to point."""

_DETECTED = ("mm", "m", "in")  # cm are read on request only: rails in cm and in inches overlap
_STATE_UNITS = "state them with --units"
_MOST_STUTTER = 50  # points left out of a list of any length
_MOST_BACK = 1e-3  # a longer step back is no stutter of the instrument [m]
# flange tip of a wheel counted from the flange back and from the running circle [m]
_TIP_FROM_BACK, _TIP_FROM_CIRCLE = (-0.010, 0.040), (-0.080, -0.030)
_TIP_RISE = 3e-3  # a flange tip stands out on both sides by more than this [m]
_FLANGE_RISE = 10e-3  # a flange without its back stands off the tread by more than this [m]
_SYMMETRIC = 20e-6  # a head this symmetric is the same mirrored [m]


class Statements(TypedDict, total=False):
    """Statements of the user on a file; what is missing or None is detected.

    `format`: key of `wearsim.profile.files.FORMATS`, else by content, then by extension. `units`: mm, m, cm,
    in, else by the file, then by the size (mm, m, in). `mirror`: whether y of the file, after its own keys,
    grows towards the flange or gauge side, that is the track centre; else by the flange of a wheel, of a rail
    by the format or by the only side that reaches 14 mm down. `z_up`: whether z grows upwards, away from the
    tip of the flange or the foot of the rail; else by the flange tip or by the top of the head. `origin`:
    "running_circle" or "flange_back", where y of a wheel counts from; else by the place of the flange tip.
    `part`: number or name of a curve in a multi-part file. `slice`: number of a slice in a list, from 1.
    """

    format: str | None
    units: str | None
    mirror: bool | None
    z_up: bool | None
    origin: Literal["running_circle", "flange_back"] | None
    part: int | str | None
    slice: int | None


class OurAxes(NamedTuple):
    """Points of a file in the axes of `Profile` [m], what was detected, place of the running circle [m]."""

    y: FloatArray
    z: FloatArray
    notes: tuple[str, ...]
    running_circle: float


class Conversion:
    """Points of a file on their way to the axes of `Profile`; each question adds its notes or its fault.

    Statements of the user overrule the file and all detection. Detection works on rounded numbers; the
    result comes from the decimals of the file by exact arithmetic, rounded once, so that written profiles
    are read back to the bit.
    """

    def __init__(self, points: Points, kind: Kind, stated: Statements, faults: Faults) -> None:
        self.points, self.kind, self.stated, self.faults = points, kind, stated, faults
        self.notes: list[str] = []

    def result(self) -> OurAxes:
        """Points from the flange back or gauge side to the field side; all faults are raised."""
        points, notes, wheel = self.points, self.notes, self.kind == "wheel"
        y = np.array([float(cell) for cell in points.y]) + float(points.shift_y)
        z = np.array([float(cell) for cell in points.z]) + float(points.shift_z)
        y, z = -y if points.mirror_y else y, -z if points.mirror_z else z
        unit = self._unit(y, z)
        y, z = y * float(unit), z * float(unit)
        kept = self._without_stutter(y, z, self._distinct(y, z))
        kept = kept[np.linspace(0, len(kept) - 1, min(len(kept), MOST_POINTS)).astype(np.intp)]
        if len(kept) == MOST_POINTS < len(y):
            notes.append(f"{len(kept)} of {len(y)} points taken, evenly")
        y, z, lines = y[kept], z[kept], [points.lines[int(k)] for k in kept]
        self._check(checks.shape_faults(self.kind, y, z, _STATE_UNITS), lines)
        longest = float(np.max(np.hypot(np.diff(y), np.diff(z))))
        if longest > 5e-3:
            notes.append(
                f"straight piece of {longest * 1e3:.3g} mm without points near an end taken as it is"
            )
        upside = self._flip_z(y, z)
        z = -z if upside else z
        if (mirror := self.stated.get("mirror")) is not None:
            flip = mirror
            notes.append("y mirrored as stated" if mirror else "y not mirrored, as stated")
        else:
            flip = self._flip_wheel(y, z) if wheel else self._flip_rail(y, z)
        offset = self._wheel_offset(-y if flip else y, z) if wheel else Decimal(0)
        factor_y = EXACT.multiply(unit, Decimal(-1 if flip != points.mirror_y else 1))
        factor_z = EXACT.multiply(unit, Decimal(-1 if upside != points.mirror_z else 1))
        y = scaled([points.y[int(k)] for k in kept], points.shift_y, factor_y, offset)
        z = scaled([points.z[int(k)] for k in kept], points.shift_z, factor_z, Decimal(0))
        self._check(checks.points_faults(self.kind, y, z, _STATE_UNITS), lines)
        if y[0] > y[-1]:
            # some formats prescribe this order; it is reported all the same, for people often wonder
            notes.append("points listed from the field side, order reversed")
            y, z = y[::-1].copy(), z[::-1].copy()
        if not wheel and is_partial(y):
            notes.append(
                f"{1e3 * float(np.ptp(y)):.3g} mm wide: part of a head without gauge point, y counted from "
                "the running circle"
            )
        circle = float(points.running_circle or RUNNING_CIRCLE) if offset != 0 else float(RUNNING_CIRCLE)
        return OurAxes(y, z, tuple(notes), 1e-3 * circle)

    def _check(self, messages: list[tuple[str, int | None]], lines: list[int]) -> None:
        for message, point in messages:
            self.faults.add(message, None if point is None else lines[point])
        self.faults.raise_any()

    def _stop(self, message: str) -> NoReturn:
        self.faults.add(message)
        self.faults.raise_any()
        raise AssertionError(message)

    def _unit(self, y: FloatArray, z: FloatArray) -> Decimal:
        """Length of the file's unit [m]."""
        stated = self.stated.get("units")
        if stated is not None:
            self.notes.append(f"units {stated} as stated")
            return UNITS[stated]
        if self.points.metres is not None:
            return self.points.metres
        fits = [name for name in _DETECTED if _plausible(self.kind, y, z, name)] if len(y) else []
        if len(fits) > 1:
            size = f"{np.ptp(y):.4g} wide and {np.ptp(z):.4g} high"
            self._stop(f"the profile is {size}, which fits {' and '.join(fits)}: {_STATE_UNITS}")
        if fits == ["mm"] or not fits:
            return UNITS["mm"]  # where no unit fits, the checks tell why
        self.notes.append(f"units {fits[0]} by the size")
        return UNITS[fits[0]]

    def _distinct(self, y: FloatArray, z: FloatArray) -> NDArray[np.intp]:
        """Return the indices of the points that differ from the one before them (instruments at rest)."""
        keep = np.ones(len(y), dtype=bool)
        keep[1:] = (np.diff(y) != 0.0) | (np.diff(z) != 0.0)
        left_out = len(y) - int(np.count_nonzero(keep))
        if left_out:
            self.notes.append(f"duplicate points left out: {left_out}")
        return np.flatnonzero(keep)

    def _without_stutter(self, y: FloatArray, z: FloatArray, kept: NDArray[np.intp]) -> NDArray[np.intp]:
        """Leave out single points where the instrument stepped back a little, at most one in fifty."""
        most = min(max(3, len(kept) // 50), _MOST_STUTTER)
        dropped: list[int] = []
        rest, back = kept, checks.turns(y[kept], z[kept])
        while 0 < len(back) <= 2 * most and len(dropped) < most:
            j = int(back[0])
            around = rest[j - 1 : j + 2]
            if np.min(np.hypot(np.diff(y[around]), np.diff(z[around]))) > _MOST_BACK:
                break
            # either the point before the step back or the one behind it is the odd one
            choices = [np.delete(rest, j + 1), np.delete(rest, j)]
            left = [checks.turns(y[each], z[each]) for each in choices]
            odd = int(len(left[1]) < len(left[0]))
            dropped.append(self.points.lines[int(rest[j + 1 - odd])])
            rest, back = choices[odd], left[odd]
        if len(back) or not dropped:
            return kept  # nothing is left out of a list that does not come right by that: a fault
        where = ", ".join(map(str, sorted(dropped)[:10]))
        self.notes.append(f"points stepping back left out: line {where}")
        return rest

    def _flip_z(self, y: FloatArray, z: FloatArray) -> bool:
        """Whether z grows upwards in the file."""
        stated, axis, wheel = self.stated.get("z_up"), self.points.z_axis, self.kind == "wheel"
        if stated is not None:
            self.notes.append(f"z {'up, sign changed' if stated else 'down'}, as stated")
            return stated
        up = _wheel_points_up(z) if wheel else _rail_points_up(y, z)
        if up is None:
            what = "a flange tip stands out on neither side" if wheel else "the head is as flat as its ends"
            if wheel or axis == "unknown":
                self._stop(f"{what}, so the sign of z is not known: state --z-up or --z-down")
            self.notes.append(f"{what}: z taken as {axis}, the rule of the format")
            return axis == "up"
        self.notes += ["z up, sign changed"] if up else []
        return up

    def _flip_wheel(self, y: FloatArray, z: FloatArray) -> bool:
        """Whether the flange is at the end of larger y; it belongs to that of smaller y."""
        place = (float(y[int(np.argmax(z))]) - float(y.min())) / float(np.ptp(y))
        if 0.4 < place < 0.6:
            self._stop(
                "the flange tip is in the middle of the profile, so its side is not known: state --mirror "
                "(flange at the end of larger y) or --no-mirror"
            )
        if place > 0.5:
            self.notes.append("flange at the end of larger y, y mirrored")
        return place > 0.5

    def _wheel_offset(self, y: FloatArray, z: FloatArray) -> Decimal:
        """Shift that lets y of a wheel begin at the running circle [m]."""
        header, origin = self.points.running_circle, self.stated.get("origin")
        circle = RUNNING_CIRCLE if header is None else header
        offset = -EXACT.multiply(circle, Decimal("0.001"))
        if origin is not None:
            self.notes.append(f"y counted from the {origin.replace('_', ' ')}, as stated")
            return offset if origin == "flange_back" else Decimal(0)
        tip = float(y[int(np.argmax(z))])
        from_back = _TIP_FROM_BACK[0] <= tip <= _TIP_FROM_BACK[1]
        if header is not None and not from_back:
            low, high = _TIP_FROM_CIRCLE
            from_back = low <= tip + float(offset) <= high and not low <= tip <= high
        if not from_back:
            return Decimal(0)
        of_header = "" if header is None else " (header)"
        self.notes.append(f"y counted from the flange back, {float(circle):g} mm subtracted{of_header}")
        return offset

    def _flip_rail(self, y: FloatArray, z: FloatArray) -> bool:
        """Whether the gauge side is at the end of larger y; it belongs to that of smaller y."""
        axis = self.points.y_axis
        if checks.head_faults(y, z):
            return axis == "centre"  # an error of the checks
        top = int(np.argmin(z))
        low = y <= y[top]
        # depth of the flanks below the top, at the ends of smaller and of larger y
        depth = [float(z[side].max() - z[top]) if np.any(side) else 0.0 for side in (low, ~low)]
        deep = [each >= GAUGE_DEPTH for each in depth]
        larger = None if deep[0] == deep[1] else depth[1] > depth[0]
        if axis == "unknown":
            if larger is not None:
                end = "larger" if larger else "smaller"
                self.notes.append(f"gauge side at the end of {end} y: only there the head reaches 14 mm down")
                self.notes += ["y mirrored"] if larger else []
                return larger
            if halves_apart(y, z, 0.0, 0.485, 200) < _SYMMETRIC:
                self.notes.append("head symmetric: it does not matter which side is the gauge side")
                return False
        flip = axis == "centre"
        if axis == "unknown" or larger not in (None, flip):
            why = "both sides of the head could be the gauge side"
            if axis != "unknown":
                why = "by the rule of the format the gauge side is the one that does not reach 14 mm down"
            self._stop(
                f"{why}: state --mirror (gauge side at the end of larger y) or --no-mirror (at the end of "
                "smaller y)"
            )
        self.notes += ["y towards the track centre, sign changed"] if flip else []
        return flip


def _plausible(kind: Kind, y: FloatArray, z: FloatArray, name: str) -> bool:
    """Whether the size fits a unit."""
    unit = float(UNITS[name])
    width, height = float(np.ptp(y)) * unit, float(np.ptp(z)) * unit
    # above 76 mm, a rail said to be in inches might as well be one in cm
    most = 0.076 if (kind, name) == ("rail", "in") else checks.WIDTH_RANGE[kind][1]
    least = max(checks.PARTIAL, checks.WIDTH_RANGE[kind][0])  # narrower points may as well be in another unit
    return least <= width <= most and checks.HEIGHT_RANGE[kind][0] <= height <= checks.HEIGHT_RANGE[kind][1]


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
