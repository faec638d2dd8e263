"""Geometry of the contact: gap between a yawed wheel and a rail or roller.

Wheel and counterface are surfaces of revolution. The counterface has curvature kappa =
1/s0 in the rolling direction (a rail: 0) and is unrolled: the height of a point above
its axis, measured from the profile's top, is ``zeta``; in the plane (y, zeta) rail and
roller are the same curve. Each circle of the wheel is nearest to the counterface where
the wheel's normal has no component along the rolling direction; these points form the
wheel's contact line, and the gap is the distance of it from the counterface profile.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.kernel import bare_kernel, inner_bare_kernel, plain
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.errors import ContactError
from wearsim.profile.shape import Profile, arc_length, spline_through

# Steeper parts of a profile (flange back, rail sides) cannot carry a wheel. They belong
# to its curve between parts that can, such as a step worn into a flange, and for a
# limited length at its ends.
_STEEPEST = np.tan(np.radians(86.0))
_LONGEST_STEP, _BESIDE = (
    10e-3,
    5e-3,
)  # length of a steep part between others, and of one at an end [m]
# least change of y per length; steeper and overhanging parts are hidden
_LEAST_ADVANCE = np.cos(np.radians(89.0))
# Share of a roller's radius below its top, beyond which there is no running surface.
_NEAREST_AXIS = 0.9
NO_WHEEL = (
    1.0  # gap [m] at lateral positions where there is no wheel above the counterface
)


class WheelSurface(NamedTuple):
    """Surface of a wheel: circles about its axle, from flange tip to field side.

    Parameters
    ----------
    y : (k,) array
        Lateral position on the wheel profile, rising [m].
    radius : (k,) array
        Rolling radius of each circle [m].
    slope : (k,) array
        dr/dy [-].
    """

    y: FloatArray
    radius: FloatArray
    slope: FloatArray


class CounterfaceProfile(NamedTuple):
    """Profile of a rail or roller on a grid of equal steps of arc length.

    Parameters
    ----------
    y : (g,) array
        Lateral position, rising [m].
    z : (g,) array
        Height of the profile, positive down [m].
    slope, angle : (g,) array
        dz/dy [-] and its arctangent, the contact angle about x [rad].
    """

    y: FloatArray
    z: FloatArray
    slope: FloatArray
    angle: FloatArray


class WheelsetPose(NamedTuple):
    """Pose of a wheelset in the axes of one wheel, one row each.

    A left wheel is mirrored.

    Parameters
    ----------
    shift, yaw, roll : (n,) array
        As in `ContactConditions` [m, rad, rad].
    """

    shift: FloatArray
    yaw: FloatArray
    roll: FloatArray


class Bodies(NamedTuple):
    """Wheel of a gap and its pose, for the gap away from the contact line.

    Parameters
    ----------
    wheel : WheelSurface
        The wheel.
    pose : WheelsetPose
        n rows.
    half_span, nominal_radius : float
        From the track centre to the origin of the profiles; radius of the running
        circle [m].
    """

    wheel: WheelSurface
    pose: WheelsetPose
    half_span: float
    nominal_radius: float


@dataclass(frozen=True)
class Gap:
    """Gap between contact line of the wheel and counterface profile.

    The wheel is at its design height.

    Parameters
    ----------
    counterface : CounterfaceProfile
        The counterface; its grid is that of the arrays below.
    curvature : float
        kappa of the counterface [1/m].
    gap : (n, g) array
        Vertical (radial, on a roller) distance; 1 m where there is no wheel [m].
    wheel_y : (n, g) array
        Position on the wheel profile that is nearest [m].
    sin_theta : (n, g) array
        Sine of its angle about the axle, from straight down, positive forwards [-].
    wheel_radius : (n, g) array
        Its rolling radius [m].
    x : (n, g) array
        Its longitudinal position, from the middle of the axle [m].
    bodies : Bodies, optional
        For `gap_surface`; none for a gap that is only a curve.
    """

    counterface: CounterfaceProfile
    curvature: float
    gap: FloatArray
    wheel_y: FloatArray
    sin_theta: FloatArray
    wheel_radius: FloatArray
    x: FloatArray
    bodies: Bodies | None = None

    @cached_property
    def lowest(self) -> FloatArray:
        """Smallest gap of each row (n,) [m]."""
        return np.asarray(self.gap.min(axis=1))

    def copy(self) -> Gap:
        """Return a copy of the gap with its own arrays."""
        return replace(
            self, **{name: getattr(self, name).copy() for name in _Nearest._fields}
        )


def _open_curve(
    profile: Profile, spacing: float, start: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return y, z and slope at equal arc steps along the visible part of a profile.

    The visible part can touch a counterpart; y rises along it.
    """
    try:
        return _curve(
            profile.kind, profile.y.tobytes(), profile.z.tobytes(), spacing, start
        )
    except ContactError as error:
        raise ContactError(f"profile {profile.name!r} {error}") from None


@lru_cache(
    maxsize=8
)  # cache for equal wheels, shared rails, and states solved repeatedly
def _curve(
    kind: str, of_y: bytes, of_z: bytes, spacing: float, start: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Spline through the points of a profile: see `_open_curve`."""
    points = np.frombuffer(of_y), np.frombuffer(of_z)
    arc = arc_length(*points)
    count = int(np.ceil((arc[-1] - arc[start]) / spacing)) + 1
    fine = np.linspace(arc[start], arc[-1], count)
    spline = spline_through(arc, np.column_stack(points))
    (y, z), (dy, dz) = plain(spline(fine).T), plain(spline(fine, 1).T)
    usable = (dy > 0) & (np.abs(dz) <= _STEEPEST * dy)
    middle = int(np.searchsorted(fine, 0.5 * (arc[start] + arc[-1])))
    if not usable[middle]:
        raise ContactError("is steeper than 86 degrees in its middle")
    if usable.all():
        return y, z, dz / dy
    step = (arc[-1] - arc[start]) / (count - 1)
    part = _extent(usable, middle, step)
    y, z, dy, dz, usable = y[part], z[part], dy[part], dz[part], usable[part]
    if usable.all():
        return y, z, dz / dy
    # Points behind the one nearest to the counterpart are hidden: y continues to rise.
    nearest = int(np.argmax(z) if kind == "wheel" else np.argmin(z))
    advance = _LEAST_ADVANCE * step * np.arange(y.size)
    rising = np.concatenate(
        (
            np.minimum.accumulate((y - advance)[nearest::-1])[::-1],
            np.maximum.accumulate((y - advance)[nearest:])[1:],
        )
    )
    moved = np.abs(rising + advance - y) > 1e-3 * advance[1]
    y = np.where(moved, rising + advance, y)
    exact = ~moved & (dy > 0) & (np.abs(dz) * _LEAST_ADVANCE <= dy)
    slope = np.where(exact, dz / np.where(exact, dy, 1.0), np.gradient(z, y))
    return y, z, slope


def _extent(usable: NDArray[np.bool_], middle: int, step: float) -> slice:
    """Usable points around the middle, short steps between them, and the rest.

    The rest lies beyond both ends.
    """
    first, last = middle, middle + 1
    for way in (-1, 1):
        side = usable[middle::way]
        ends = np.flatnonzero(side)
        gaps = np.flatnonzero(np.diff(ends) * step > _LONGEST_STEP)
        end = int(ends[gaps[0]] if gaps.size > 0 else ends[-1])
        end = min(end + int(_BESIDE / step), side.size - 1)
        first, last = (middle - end, last) if way < 0 else (first, middle + end + 1)
    return slice(first, last)


def wheel_surface(
    profile: Profile, radius: float, spacing: float = 1e-4
) -> WheelSurface:
    """Cut a wheel into circles about its axle, from the flange tip to the field side.

    Parameters
    ----------
    profile : Profile
        Of the wheel, in the axes of a right wheel.
    radius : float
        Of the running circle [m].
    spacing : float
        Distance of the circles along the profile [m].

    Returns
    -------
    WheelSurface
        Interpolated by cubic splines over arc length.

    Raises
    ------
    ContactError
        If the tread is steeper than 86 degrees.
    """
    tip = int(np.argmax(profile.z))
    y, z, slope = _open_curve(profile, spacing, tip)
    return WheelSurface(y, radius + z, slope)


def counterface_profile(profile: Profile, spacing: float = 1e-4) -> CounterfaceProfile:
    """Resample a rail or roller profile at equal arc steps, steep flanks included.

    Parameters
    ----------
    profile : Profile
        Inclined and placed, in the axes of the right side.
    spacing : float
        Of the grid, along the profile [m].

    Returns
    -------
    CounterfaceProfile
        The head, and of its sides what follows on it.
    """
    y, z, slope = _open_curve(profile, spacing, 0)
    return CounterfaceProfile(y, z, slope, np.arctan(slope))


def gap(
    wheel: WheelSurface,
    counterface: CounterfaceProfile,
    pose: WheelsetPose,
    *,
    half_span: float,
    nominal_radius: float,
    curvature: float,
    rows: IntArray | None = None,
    before: Gap | None = None,
) -> Gap:
    """Gap of wheel and counterface at each lateral position, for any shift, yaw, roll.

    Parameters
    ----------
    wheel : WheelSurface
        The wheel.
    counterface : CounterfaceProfile
        Rail or roller.
    pose : WheelsetPose
        Of the wheelset, n rows.
    half_span : float
        From the track centre to the origin of the profiles [m].
    nominal_radius : float
        Wheel radius at the running circle [m].
    curvature : float
        kappa = 1/s0 of the counterface [1/m]; 0 for a rail.
    rows : (k,) int array, optional
        Rows to search, by default all.
    before : Gap, optional
        Of other poses, used up: its arrays become those of the result, and keep what
        they hold of other rows.

    Returns
    -------
    Gap
        Where several parts of the wheel hide each other, that of the lowest one. A
        roller smaller than its profile is deep ends before its axle.
    """
    # An integer or a read-only array would compile another variant of each kernel.
    curvature = float(curvature)
    pose = WheelsetPose(plain(pose.shift), plain(pose.yaw), plain(pose.roll))
    bodies = Bodies(wheel, pose, float(half_span), float(nominal_radius))
    count = pose.shift.size
    nearest = _Nearest(
        *np.empty((5, count, counterface.y.size))
        if before is None
        else (getattr(before, name) for name in _Nearest._fields)
    )
    # Circles that cannot lie above the grid are omitted; shift, yaw and roll move their
    # points by this much.
    shift, yaw, roll = (np.abs(angle).max(initial=0.0) for angle in pose)
    aside = shift + (yaw + roll) * wheel.radius.max()
    aside += (yaw**2 + roll**2) * (half_span + np.abs(wheel.y).max())
    first, last = np.searchsorted(
        wheel.y, (counterface.y[0] - aside, counterface.y[-1] + aside)
    )
    circles = WheelSurface(
        *(samples[max(first - 1, 0) : last + 1] for samples in wheel)
    )
    line = _ContactLine(*np.empty((4, circles.y.size)))
    rows = np.arange(count) if rows is None else rows
    lowest = np.empty(counterface.y.size, dtype=np.int64)
    _search(
        bodies._replace(wheel=circles),
        counterface,
        curvature,
        rows,
        line,
        lowest,
        nearest,
    )
    nearest.gap[:, curvature * counterface.z > _NEAREST_AXIS] = NO_WHEEL
    return Gap(counterface, curvature, *nearest, bodies)


class _ContactLine(NamedTuple):
    """Points (k,) of wheel circles nearest to the counterface, in unrolled planes.

    A plane is that of the unrolled counterface.
    """

    y: FloatArray
    height: FloatArray
    sin_theta: FloatArray
    x: FloatArray


class _Nearest(NamedTuple):
    """Arrays (n, g) of a `Gap`."""

    gap: FloatArray
    wheel_y: FloatArray
    sin_theta: FloatArray
    wheel_radius: FloatArray
    x: FloatArray


@bare_kernel
def _search(
    bodies: Bodies,
    counterface: CounterfaceProfile,
    kappa: float,
    rows: IntArray,
    line: _ContactLine,
    circle: IntArray,
    nearest: _Nearest,
) -> None:
    """Contact line of each pose, and its lowest part over each grid point.

    The wheel position there is also returned.
    """
    y, radius, sine, x = bodies.wheel.y, bodies.wheel.radius, line.sin_theta, line.x
    for row in rows:
        _contact_line(bodies, row, kappa, line)
        _envelope(line, counterface, nearest.gap[row], circle)
        for i in range(circle.size):
            k = circle[i]
            if k < 0:
                nearest.gap[row, i] = NO_WHEEL
                nearest.wheel_y[row, i] = nearest.sin_theta[row, i] = nearest.x[
                    row, i
                ] = 0.0
                nearest.wheel_radius[row, i] = bodies.nominal_radius
                continue
            step = line.y[k + 1] - line.y[k]
            share = (counterface.y[i] - line.y[k]) / step if step != 0.0 else 0.0
            height = line.height[k] + share * (line.height[k + 1] - line.height[k])
            nearest.gap[row, i] = counterface.z[i] - height
            nearest.wheel_y[row, i] = y[k] + share * (y[k + 1] - y[k])
            nearest.wheel_radius[row, i] = radius[k] + share * (
                radius[k + 1] - radius[k]
            )
            nearest.sin_theta[row, i] = sine[k] + share * (sine[k + 1] - sine[k])
            nearest.x[row, i] = x[k] + share * (x[k + 1] - x[k])


@inner_bare_kernel
def _contact_line(bodies: Bodies, row: int, kappa: float, line: _ContactLine) -> None:
    """Contact line: points of circles whose normal meets both axles.

    At these points the wheel's normal has no component along the counterface. The
    normals of a circle meet in a point of the wheel's axle; the one sought also meets
    the counterface's axle. That is linear in sine and cosine of the angle about the
    axle: p sine + q cosine = w.
    """
    wheel, pose, half_span, nominal_radius = bodies
    shift = pose.shift[row]
    sy, cy = np.sin(pose.yaw[row]), np.cos(pose.yaw[row])
    sr, cr = np.sin(pose.roll[row]), np.cos(pose.roll[row])
    for k in range(wheel.y.size):
        r, t, b = wheel.radius[k], wheel.slope[k], half_span + wheel.y[k]
        # From the counterface's axle to the point of the wheel's, times kappa.
        ahead, above = (
            -kappa * sy * cr * (b + r * t),
            1.0 + kappa * (nominal_radius - sr * (b + r * t)),
        )
        p, q, w = (
            above * cy,
            above * sy * sr + ahead * cr,
            t * (ahead * sr - above * sy * cr),
        )
        square = p * p + q * q
        # A circle so steep that it has no nearest point ends at the height of the axle.
        if w * w > square:
            w = np.sqrt(square) if w > 0.0 else -np.sqrt(square)
        root = np.sqrt(max(square - w * w, 0.0))
        inverse = 1.0 / square
        sine, cosine = (p * w - q * root) * inverse, (q * w + p * root) * inverse
        x = cy * r * sine - sy * cr * b + sy * sr * r * cosine
        z = sr * b + cr * r * cosine - nominal_radius
        line.y[k] = (
            shift + sy * r * sine + cy * cr * b - cy * sr * r * cosine - half_span
        )
        if kappa != 0.0:  # a rail gives the same result in twice the time
            length = np.sqrt((kappa * x) ** 2 + (1.0 - kappa * z) ** 2)
            z = (2.0 * z - kappa * z * z - kappa * x * x) / (1.0 + length)
        line.height[k] = z
        line.sin_theta[k] = sine
        line.x[k] = x


@inner_bare_kernel
def _envelope(
    line: _ContactLine,
    counterface: CounterfaceProfile,
    gap: FloatArray,
    circle: IntArray,
) -> None:
    """First of the two circles around each grid point where the gap is smallest.

    It is -1 without a wheel. `gap` is a work array.
    """
    points, last = counterface.y.size, line.y.size - 1
    folded = 0
    for k in range(last):
        folded += line.y[k + 1] <= line.y[k]
    if folded == 0:
        k = 0
        for i in range(points):
            place = counterface.y[i]
            while k < last and line.y[k + 1] < place:
                k += 1
            circle[i] = k if k < last and line.y[k] <= place else -1
        return
    gap[:] = NO_WHEEL
    circle[:] = -1
    first = 0
    for k in range(last):
        left, right = line.y[k], line.y[k + 1]
        low, high = min(left, right), max(left, right)
        while first < points and counterface.y[first] < low:
            first += 1
        while first > 0 and counterface.y[first - 1] >= low:
            first -= 1
        i = first
        while i < points and counterface.y[i] <= high:
            share = (counterface.y[i] - left) / (right - left) if right != left else 0.0
            distance = counterface.z[i] - (
                line.height[k] + share * (line.height[k + 1] - line.height[k])
            )
            if distance < gap[i]:
                gap[i], circle[i] = distance, k
            i += 1
