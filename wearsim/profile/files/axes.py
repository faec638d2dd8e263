"""Conversion of the axes, units and origin of a file to those of `Profile`.

Everything detected is reported.
"""

from __future__ import annotations

from decimal import Decimal
from typing import Literal, TypedDict, get_args

import numpy as np
from numpy.typing import NDArray

from wearsim.errors import listed
from wearsim.profile import checks
from wearsim.profile.files.points import Decimals, Faults, Points
from wearsim.profile.placement import GAUGE_DEPTH, is_partial, narrow_head
from wearsim.profile.shape import FloatArray, Kind

FormatName = Literal["simpack", "miniprof", "gensys", "uic519", "two-column"]
UnitName = Literal["mm", "m", "cm", "in"]
OriginName = Literal["running_circle", "flange_back", "gauge_point"]
UNITS: dict[UnitName, Decimal] = {
    "mm": Decimal("0.001"),
    "m": Decimal(1),
    "cm": Decimal("0.01"),
    "in": Decimal("0.0254"),
}
ORIGINS = get_args(OriginName)
RUNNING_CIRCLE = Decimal("0.070")
"""Distance of the running circle from the flange back [m]."""

MOST_POINTS = 20_000
"""Largest number of points that is kept unchanged.

Points on a profile of 160 mm are then 8 um apart.
"""

_DETECTED: tuple[UnitName, ...] = (
    "mm",
    "m",
    "in",
)  # cm are read on request only: rails in cm and in inches overlap
_STATE_UNITS = "state them with --units"
_MOST_STUTTER = 50  # a list of any length may lose this many points
_MOST_BACK = 1e-3  # a longer step back is not an error of the instrument [m]
_TIP_FROM_BACK = (
    -0.010,
    0.040,
)  # flange tip of a wheel whose y counts from the flange back [m]
_BACK_FACE = (0.3e-3, 2e-3)  # width and least height of the back of a flange [m]
_TIP_RISE = 3e-3  # least height of a flange tip above both sides [m]
_FLANGE_RISE = 10e-3  # a flange without back is at least this far from the tread [m]


class Statements(TypedDict, total=False):
    """Statements of the user on a file; what is missing or None is detected.

    `format`: key of `wearsim.profile.files.FORMATS`, else by content, then by
    extension. `units`: mm, m, cm, in, else by the file, then by the size (mm, m, in).
    `mirror`: whether y of the file, after its own keys, grows towards the flange or
    gauge side, that is the track centre; else by the flange of a wheel, of a rail by
    the format or by the only side that reaches 14 mm down. `z_up`: whether z grows
    upwards, away from the tip of the flange or the foot of the rail; else by the flange
    tip or by the top of the head. `origin`: "running_circle" or "flange_back", where y
    of a wheel counts from, or "gauge_point", where y and z count from a point of the
    flange, as in APTA PR-M-S-015: y is then counted from the flange back of the points,
    z from their running circle; else by the place of the flange tip. `offset_y`,
    `offset_z`: lengths that are added to y and z of a wheel in wearsim's axes, so that
    they count from the running circle [m].
    """

    format: FormatName | None
    units: UnitName | None
    mirror: bool | None
    z_up: bool | None
    origin: OriginName | None
    offset_y: float | None
    offset_z: float | None


class Conversion:
    """Conversion of the points of a file to the axes of `Profile`.

    Each step adds its notes or its fault. Statements of the user override the file and
    all detection. Detection uses rounded numbers; the result is computed from the
    decimals of the file by exact arithmetic and rounded once, so that written profiles
    are read back to the bit.
    """

    def __init__(
        self, points: Points, kind: Kind, stated: Statements, faults: Faults
    ) -> None:
        self.points, self.wheel, self.kind, self.faults = (
            points,
            kind == "wheel",
            kind,
            faults,
        )
        self.stated, self.notes = stated, list(points.notes)

    def result(self) -> tuple[FloatArray, FloatArray]:
        """Points y, z (n,) [m] from the flange back or gauge side to the field side.

        Raises all faults.
        """
        exact = np.array([self.points.y, self.points.z]) * self._unit()
        y, z = exact.astype(np.float64)
        kept = self._without_stutter(y, z)
        if len(kept) > MOST_POINTS:
            self.notes.append(f"{MOST_POINTS} of {len(y)} points taken, evenly")
            kept = kept[np.linspace(0, len(kept) - 1, MOST_POINTS).astype(np.intp)]
        exact, y, z, lines = (
            exact[:, kept],
            y[kept],
            z[kept],
            [self.points.lines[k] for k in kept],
        )
        self._check(checks.shape_faults(self.kind, y, z, _STATE_UNITS), lines)
        if self._points_up(y, z):
            exact[1], z = -exact[1], -z
        if self._at_larger_y(y, z):
            exact[0], y = -exact[0], -y
        exact = self._from_running_circle(exact, y, z) if self.wheel else exact
        y, z = exact.astype(np.float64) + 0.0  # adding 0.0 removes negative zeros
        self._check(checks.points_faults(self.kind, y, z, _STATE_UNITS), lines)
        if y[0] > y[-1]:
            # Some formats prescribe this order; it is reported nevertheless, as users
            # often ask.
            self.notes.append("points listed from the field side, order reversed")
            y, z = y[::-1].copy(), z[::-1].copy()
        if not self.wheel and is_partial(y):
            self.notes.append(
                f"{1e3 * np.ptp(y):.3g} mm wide: part of a head without gauge point, y "
                "counted from the running circle"
            )
        elif not self.wheel and (text := narrow_head(y)):
            self.notes.append(text)
        return y, z

    def _check(self, point_faults: list[checks.PointFault], lines: list[int]) -> None:
        for message, point in point_faults:
            self.faults.add(message, None if point is None else lines[point])
        self.faults.raise_any()

    def _unit(self) -> Decimal:
        """Length of the file's unit [m]."""
        name = self.stated.get("units")
        if name is not None:
            self.notes.append(f"units {name} as stated")
            return UNITS[name]
        if self.points.unit is not None or not self.points.lines:
            return self.points.unit or UNITS["mm"]
        width, height = (
            float(max(coordinate) - min(coordinate))
            for coordinate in (self.points.y, self.points.z)
        )
        fits = [
            name for name in _DETECTED if _plausible(self.kind, width, height, name)
        ]
        if len(fits) > 1:
            self.faults.stop(
                f"the profile is {width:.4g} wide and {height:.4g} high, which fits "
                f"{listed(fits, ' and ')}: {_STATE_UNITS}"
            )
        if fits == ["mm"] or not fits:
            return UNITS["mm"]  # if no unit fits, the checks state the reason
        self.notes.append(f"units {fits[0]} by the size")
        return UNITS[fits[0]]

    def _without_stutter(self, y: FloatArray, z: FloatArray) -> NDArray[np.intp]:
        """Remove repeated points and, for at most one in fifty, small steps back."""
        moved = (np.diff(y) != 0.0) | (np.diff(z) != 0.0)
        kept = np.flatnonzero(
            np.concatenate((np.ones(min(len(y), 1), dtype=bool), moved))
        )
        if len(kept) < len(y):
            self.notes.append(f"duplicate points left out: {len(y) - len(kept)}")
        most = min(max(3, len(kept) // 50), _MOST_STUTTER)
        rest, back = kept, checks.turns(y[kept], z[kept])
        while 0 < len(back) <= 2 * most and len(kept) - len(rest) < most:
            around = rest[back[0] - 1 : back[0] + 2]
            if np.min(np.hypot(np.diff(y[around]), np.diff(z[around]))) > _MOST_BACK:
                break
            # Either the point after the step back or the one before it is the outlier.
            choices = [np.delete(rest, back[0] + 1), np.delete(rest, back[0])]
            rest = min(
                choices, key=lambda choice: len(checks.turns(y[choice], z[choice]))
            )
            back = checks.turns(y[rest], z[rest])
        if len(back) or len(rest) == len(kept):
            # If the list stays disordered, no point is removed and a fault is raised.
            return kept
        where = ", ".join(
            str(self.points.lines[k]) for k in np.setdiff1d(kept, rest)[:10]
        )
        self.notes.append(f"points stepping back left out: line {where}")
        return rest

    def _points_up(self, y: FloatArray, z: FloatArray) -> bool:
        """Return True if z points upwards in the file."""
        up = self.stated.get("z_up")
        if up is not None:
            self.notes.append(f"z {'up, sign changed' if up else 'down'}, as stated")
            return up
        up = _wheel_points_up(z) if self.wheel else _rail_points_up(y, z)
        if up is None and self.wheel:
            self.faults.stop(
                "a flange tip stands out on neither side, so the sign of z is not "
                "known: state --z-up or --z-down"
            )
        if up is None:
            self.notes.append(
                f"the head is as flat as its ends: z taken as {self.points.z_axis}, "
                "the rule of the format"
            )
            return self.points.z_axis == "up"
        self.notes += ["z up, sign changed"] if up else []
        return up

    def _at_larger_y(self, y: FloatArray, z: FloatArray) -> bool:
        """Return True if the flange or the gauge side is at larger y.

        In `Profile` it is at smaller y.
        """
        mirror, axis = self.stated.get("mirror"), self.points.y_axis
        if mirror is not None:
            self.notes.append(
                "y mirrored as stated" if mirror else "y not mirrored, as stated"
            )
            return mirror
        if self.wheel:
            place = (float(y[int(np.argmax(z))]) - float(y.min())) / float(np.ptp(y))
            if 0.4 < place < 0.6:
                self.faults.stop(
                    "the flange tip is in the middle of the profile, so its side is "
                    "not known: state --mirror (flange at the end of larger y) or "
                    "--no-mirror"
                )
            self.notes += (
                ["flange at the end of larger y, y mirrored"] if place > 0.5 else []
            )
            return place > 0.5
        if axis != "unknown" or checks.head_faults(y, z):  # raised by the checks
            self.notes += (
                ["y towards the track centre, sign changed"] if axis == "centre" else []
            )
            return axis == "centre"
        # Check if the flanks at the ends of smaller and of larger y reach down to the
        # gauge depth.
        deep, top = z - z.min() >= GAUGE_DEPTH, y[np.argmin(z)]
        smaller, larger = bool(np.any(deep[y <= top])), bool(np.any(deep[y > top]))
        if smaller == larger:
            self.faults.stop(
                "both sides of the head could be the gauge side: state --mirror (gauge "
                "side at the end of larger y) or --no-mirror (at the end of smaller y)"
            )
        end = "larger" if larger else "smaller"
        self.notes.append(
            f"gauge side at the end of {end} y: only there the head reaches 14 mm down"
        )
        self.notes += ["y mirrored"] if larger else []
        return larger

    def _from_running_circle(
        self, exact: Decimals, y: FloatArray, z: FloatArray
    ) -> Decimals:
        """Points (2, n) of a wheel counted from the running circle [m]."""
        offsets = self.stated.get("offset_y"), self.stated.get("offset_z")
        if offsets != (None, None):
            if self.stated.get("origin") is not None:
                self.faults.stop(
                    "origin and offsets exclude each other; state one of them"
                )
            moved = [Decimal(repr(float(value or 0.0))) for value in offsets]
            words = " and ".join(f"{1e3 * float(offset):g}" for offset in moved)
            self.notes.append(f"{words} mm added to y and z, as stated")
            return exact + np.array(moved, dtype=object)[:, None]
        if self.stated.get("origin") != "gauge_point":
            if self._from_flange_back(y, z):
                exact = exact.copy()
                exact[0] = exact[0] - RUNNING_CIRCLE
            return exact
        back = int(np.argmin(y))
        face = y < y[back] + _BACK_FACE[0]
        if float(np.ptp(z[face])) < _BACK_FACE[1]:
            self.faults.stop(
                "origin gauge_point needs the flange back, from which the running "
                "circle lies 70 mm away, and the points have none: state --offset-y-mm "
                "and --offset-z-mm"
            )
        rows = np.argsort(y, kind="stable")
        circle = float(y[back]) + float(RUNNING_CIRCLE)
        height = float(np.interp(circle, y[rows], z[rows]))
        self.notes.append(
            f"y and z counted from the gauge point, as stated: flange back at y = "
            f"{1e3 * y[back]:.3f} mm, running circle at z = {1e3 * height:.3f} mm"
        )
        level = Decimal(f"{height:.9f}")
        shift = np.array([exact[0][back] + RUNNING_CIRCLE, level], dtype=object)
        return exact - shift[:, None]

    def _from_flange_back(self, y: FloatArray, z: FloatArray) -> bool:
        """Return True if y of a wheel begins at the flange back.

        Otherwise it begins at the running circle.
        """
        origin = self.stated.get("origin")
        if origin is not None:
            self.notes.append(
                f"y counted from the {origin.replace('_', ' ')}, as stated"
            )
            return origin == "flange_back"
        back = _TIP_FROM_BACK[0] <= float(y[int(np.argmax(z))]) <= _TIP_FROM_BACK[1]
        self.notes += (
            ["y counted from the flange back, 70 mm subtracted"] if back else []
        )
        return back


def _plausible(kind: Kind, width: float, height: float, name: UnitName) -> bool:
    """Return True if the size is plausible for a unit."""
    unit = float(UNITS[name])
    # Above 76 mm, a rail stated in inches may as well be in cm.
    most = 0.076 if (kind, name) == ("rail", "in") else checks.WIDTH_RANGE[kind][1]
    least = max(
        checks.PARTIAL, checks.WIDTH_RANGE[kind][0]
    )  # narrower profiles may be in another unit
    low, high = checks.HEIGHT_RANGE[kind]
    return least <= width * unit <= most and low <= height * unit <= high


def _wheel_points_up(z: FloatArray) -> bool | None:
    """Return True if the flange tip is at the smallest z; None if there is no tip."""
    down, up = _tip_rise(z), _tip_rise(-z)
    if max(down, up) < _TIP_RISE or max(down, up) < 3.0 * min(down, up):
        # the profile may begin at the tip: then the flange is what lies furthest off
        # the tread
        tread = float(np.median(z))
        down, up = float(z.max()) - tread, tread - float(z.min())
        if max(down, up) < _FLANGE_RISE or max(down, up) < 2.5 * min(down, up):
            return None
    return up > down


def _tip_rise(z: FloatArray) -> float:
    """Height of the highest point above the lowest on its lower side.

    It is 0 at an end of the list.
    """
    tip = int(np.argmax(z))
    return float(z[tip] - max(z[: tip + 1].min(), z[tip:].min()))


def _rail_points_up(y: FloatArray, z: FloatArray) -> bool | None:
    """Return True if the top is at larger z than the ends.

    None if the head is nearly level with its ends.
    """
    fall = checks.head_fall(y, z)
    return None if abs(fall) < 0.05 * float(np.ptp(z)) else fall < 0.0
