"""The geometrical problem: where a yawed wheel comes close to a rail or roller.

Wheel and counterface are surfaces of revolution. The counterface has curvature kappa = 1/s0 in the rolling
direction (a rail: 0) and is unrolled: the height of a point above its axis, measured from the profile's
top, is ``zeta``; in the plane (y, zeta) rail and roller are the same curve. Each circle of the wheel is
nearest to the counterface where the wheel's normal has no component along the rolling direction; these
points form the wheel's contact line, and the gap is the distance of it from the counterface profile.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from wearsim.contact.kernel import kernel, plain
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.errors import ContactError
from wearsim.profile.shape import Profile

# Steeper parts of a profile (flange back, rail sides) cannot carry a wheel.
_STEEPEST = np.tan(np.radians(86.0))
_NEAREST_AXIS = 0.9  # share of a roller's radius below its top, beyond which there is nothing to run on
NO_WHEEL = 1.0  # gap [m] at lateral positions where there is no wheel above the counterface


@dataclass(frozen=True)
class WheelSurface:
    """Surface of a wheel: circles about its axle, from the flange tip to the field side.

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


@dataclass(frozen=True)
class CounterfaceProfile:
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


@dataclass(frozen=True)
class WheelsetPose:
    """Pose of a wheelset in the axes of one wheel, one row each; a left wheel is mirrored first.

    Parameters
    ----------
    shift, yaw, roll : (n,) array
        As in `ContactConditions` [m, rad, rad].
    """

    shift: FloatArray
    yaw: FloatArray
    roll: FloatArray


@dataclass(frozen=True)
class Bodies:
    """The wheel of a gap and its pose, for the gap away from the contact line.

    Parameters
    ----------
    wheel : WheelSurface
        The wheel.
    pose : WheelsetPose
        n rows.
    half_span, nominal_radius : float
        From the track centre to the origin of the profiles; radius of the running circle [m].
    """

    wheel: WheelSurface
    pose: WheelsetPose
    half_span: float
    nominal_radius: float


@dataclass(frozen=True)
class Gap:
    """Gap between contact line of the wheel and counterface profile, with the wheel at its design height.

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

    def take(self, row: IntArray) -> Gap:
        """Gap of some rows."""
        if row.size == self.gap.shape[0]:
            return self
        curves = {
            name: getattr(self, name)[row] for name in ("gap", "wheel_y", "sin_theta", "wheel_radius", "x")
        }
        bodies = self.bodies
        if bodies is not None:
            pose = bodies.pose
            bodies = replace(bodies, pose=WheelsetPose(pose.shift[row], pose.yaw[row], pose.roll[row]))
        return replace(self, bodies=bodies, **curves)


def _steep_free(profile: Profile, spacing: float, start: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return y, z and slope at equal steps of arc length along the part that can carry a wheel."""
    step = np.hypot(np.diff(profile.y), np.diff(profile.z))
    arc = np.concatenate(([0.0], np.cumsum(step)))
    count = int(np.ceil((arc[-1] - arc[start]) / spacing)) + 1
    fine = np.linspace(arc[start], arc[-1], count)
    y_of, z_of = CubicSpline(arc, profile.y), CubicSpline(arc, profile.z)
    y, z, dy, dz = y_of(fine), z_of(fine), y_of(fine, 1), z_of(fine, 1)
    usable = (dy > 0) & (np.abs(dz) <= _STEEPEST * dy)
    middle = int(np.searchsorted(fine, 0.5 * (arc[start] + arc[-1])))
    if not usable[middle]:
        raise ContactError(f"profile {profile.name!r} is steeper than 86 degrees in its middle")
    blocked = np.flatnonzero(~usable)
    first = int(blocked[blocked < middle].max(initial=-1)) + 1
    last = int(blocked[blocked > middle].min(initial=count))
    part = slice(first, last)
    return y[part], z[part], dz[part] / dy[part]


def wheel_surface(profile: Profile, radius: float, spacing: float = 1e-4) -> WheelSurface:
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
    y, z, slope = _steep_free(profile, spacing, tip)
    return WheelSurface(np.ascontiguousarray(y), radius + z, np.ascontiguousarray(slope))


def counterface_profile(profile: Profile, spacing: float = 1e-4) -> CounterfaceProfile:
    """Put a rail or roller profile on a grid of equal steps along its arc, steep flanks included.

    Parameters
    ----------
    profile : Profile
        Inclined and placed, in the axes of the right side.
    spacing : float
        Of the grid, along the profile [m].

    Returns
    -------
    CounterfaceProfile
        The part of the head less steep than 86 degrees.
    """
    y, z, slope = _steep_free(profile, spacing, 0)
    return CounterfaceProfile(y, z, slope, np.arctan(slope))


def gap(
    wheel: WheelSurface,
    counterface: CounterfaceProfile,
    pose: WheelsetPose,
    *,
    half_span: float,
    nominal_radius: float,
    curvature: float,
) -> Gap:
    """Gap between wheel and counterface at every lateral position, for any shift, yaw and roll.

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

    Returns
    -------
    Gap
        Where several parts of the wheel hide each other, that of the lowest one. A roller smaller than its
        profile is deep ends before its axle.
    """
    rows, points = pose.shift.size, counterface.y.size
    shape = (rows, points)
    # An integer or an array that may not be written would compile another variant of each kernel.
    curvature = float(curvature)
    pose = WheelsetPose(plain(pose.shift), plain(pose.yaw), plain(pose.roll))
    result = Gap(
        counterface=counterface,
        curvature=curvature,
        gap=np.empty(shape),
        wheel_y=np.zeros(shape),
        sin_theta=np.zeros(shape),
        wheel_radius=np.full(shape, nominal_radius),
        x=np.zeros(shape),
        bodies=Bodies(wheel, pose, half_span, nominal_radius),
    )
    height, offset, lever, along = (np.empty(wheel.y.size) for _ in range(4))
    _raster(
        wheel.y, wheel.radius, wheel.slope, counterface.y, counterface.z, pose.shift, pose.yaw, pose.roll,
        half_span, nominal_radius, curvature, offset, height, lever, along, result.gap, result.wheel_y,
        result.sin_theta, result.wheel_radius, result.x,
    )  # fmt: skip
    result.gap[:, curvature * counterface.z > _NEAREST_AXIS] = NO_WHEEL
    return result


@kernel
def _envelope(
    ring_y: FloatArray, ring_radius: FloatArray, offset: FloatArray, height: FloatArray, lever: FloatArray,
    along: FloatArray, grid_y: FloatArray, grid_z: FloatArray, gap_out: FloatArray, wheel_y_out: FloatArray,
    sin_theta_out: FloatArray, radius_out: FloatArray, x_out: FloatArray,
) -> None:  # fmt: skip
    """Lowest part of the wheel's contact line over each grid point."""
    points = grid_y.size
    gap_out[:] = NO_WHEEL
    first = 0
    for k in range(ring_y.size - 1):
        left, right = offset[k], offset[k + 1]
        low, high = min(left, right), max(left, right)
        while first < points and grid_y[first] < low:
            first += 1
        while first > 0 and grid_y[first - 1] >= low:
            first -= 1
        i = first
        while i < points and grid_y[i] <= high:
            share = (grid_y[i] - left) / (right - left) if right != left else 0.0
            distance = grid_z[i] - (height[k] + share * (height[k + 1] - height[k]))
            if distance < gap_out[i]:
                gap_out[i] = distance
                wheel_y_out[i] = ring_y[k] + share * (ring_y[k + 1] - ring_y[k])
                sin_theta_out[i] = lever[k] + share * (lever[k + 1] - lever[k])
                radius_out[i] = ring_radius[k] + share * (ring_radius[k + 1] - ring_radius[k])
                x_out[i] = along[k] + share * (along[k + 1] - along[k])
            i += 1


@kernel
def _raster(
    ring_y: FloatArray, ring_radius: FloatArray, ring_slope: FloatArray, grid_y: FloatArray,
    grid_z: FloatArray, shift: FloatArray, yaw: FloatArray, roll: FloatArray, half_span: float,
    nominal_radius: float, kappa: float, offset: FloatArray, height: FloatArray, lever: FloatArray,
    along: FloatArray, gap_out: FloatArray, wheel_y_out: FloatArray, sin_theta_out: FloatArray,
    radius_out: FloatArray, x_out: FloatArray,
) -> None:  # fmt: skip
    """Contact line of the yawed wheel in the unrolled plane, then its upper envelope on the grid."""
    for row in range(shift.size):
        sy, cy = np.sin(yaw[row]), np.cos(yaw[row])
        sr, cr = np.sin(roll[row]), np.cos(roll[row])
        for k in range(ring_y.size):
            r, t, b = ring_radius[k], ring_slope[k], half_span + ring_y[k]
            # Small-angle root of (1 - kappa z) n_x + kappa x n_z = 0, then Newton in sin(theta).
            sine = (kappa * sy * b - sy * cr * t - sy * sr) / (1.0 + kappa * r)
            for _ in range(3):
                sine = min(max(sine, -0.9), 0.9)
                cosine = np.sqrt(1.0 - sine * sine)
                x = cy * r * sine - sy * cr * b + sy * sr * r * cosine
                z = sr * b + cr * r * cosine - nominal_radius
                n_x = cy * sine + sy * cr * t + sy * sr * cosine
                n_z = cr * cosine - sr * t
                fall = -sine / cosine
                function = (1.0 - kappa * z) * n_x + kappa * x * n_z
                derivative = (
                    -kappa * cr * r * fall * n_x
                    + (1.0 - kappa * z) * (cy + sy * sr * fall)
                    + kappa * (cy * r + sy * sr * r * fall) * n_z
                    + kappa * x * cr * fall
                )
                sine -= function / derivative
            sine = min(max(sine, -0.9), 0.9)
            cosine = np.sqrt(1.0 - sine * sine)
            x = cy * r * sine - sy * cr * b + sy * sr * r * cosine
            z = sr * b + cr * r * cosine - nominal_radius
            offset[k] = shift[row] + sy * r * sine + cy * cr * b - cy * sr * r * cosine - half_span
            height[k] = (2.0 * z - kappa * z * z - kappa * x * x) / (
                1.0 + np.sqrt((kappa * x) ** 2 + (1.0 - kappa * z) ** 2)
            )
            lever[k] = sine
            along[k] = x
        _envelope(
            ring_y, ring_radius, offset, height, lever, along, grid_y, grid_z, gap_out[row], wheel_y_out[row],
            sin_theta_out[row], radius_out[row], x_out[row],
        )  # fmt: skip
