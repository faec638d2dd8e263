"""Gap in three dimensions over a contact plane: exact heights of wheel and counterface.

The wheel may be yawed.

`geometry.gap` is the gap along the line where each lateral position comes nearest. Here
every point of the plane is a ray along the contact normal, cut with both surfaces of
revolution by Newton's method; circles of the wheel and profiles are joined by cubic
polynomials through positions and slopes, so that the surfaces are smooth.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.contact.geometry import NO_WHEEL, Bodies, CounterfaceProfile, Gap
from wearsim.contact.kernel import inner_kernel, kernel, plain
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.errors import ContactError

_STEPS = 30  # largest number of Newton steps
_DONE = 1e-14  # length of a negligible step [m]
_FLATTEST = 0.05  # cosine between ray and surface normal below which a ray is grazing


class ContactPlane(NamedTuple):
    """Planes through points of the counterface, along the rolling direction there.

    Parameters
    ----------
    row : (m,) int array
        Row of the gap (one wheel at one operating point).
    y : (m,) array
        Point on the counterface's profile [m].
    x : (m,) array
        Longitudinal position, from the middle of the axle, of the wheel's point above
        it [m].
    angle : (m,) array
        Contact angle about the rolling direction [rad].
    vertical_displacement : (m,) array
        How far the wheel is pushed down from its design height [m].
    """

    row: IntArray
    y: FloatArray
    x: FloatArray
    angle: FloatArray
    vertical_displacement: FloatArray


def between_points(
    gap: Gap, curves: tuple[FloatArray, ...], row: IntArray, y: FloatArray
) -> FloatArray:
    """Interpolate curves of a gap at the same positions.

    Parameters
    ----------
    gap : Gap
        n rows.
    curves : tuple of (n, g) array
        k of them, such as its `wheel_y`.
    row : (m,) int array
        Row of each patch.
    y : (m, ...) array
        Lateral positions of each; quickest where they rise [m].

    Returns
    -------
    (k, m, ...) array
        Linear between the points of the grid, and beyond its ends.
    """
    places = plain(y).reshape(row.size, y.size // max(row.size, 1))
    out = np.empty((len(curves), *places.shape))
    _interpolate(gap.counterface.y, tuple(map(plain, curves)), row, places, out)
    return out.reshape(len(curves), *y.shape)


@kernel
def _interpolate(
    grid: FloatArray,
    curves: tuple[FloatArray, ...],
    row: IntArray,
    y: FloatArray,
    out: FloatArray,
) -> None:
    """Fill `out` (k, m, j) with the rows of `curves` at positions (m, j)."""
    for m in range(row.size):
        k = 0
        for j in range(y.shape[1]):
            k = place_in(grid, min(max(y[m, j], grid[0]), grid[-1]), k)
            share = (y[m, j] - grid[k]) / (grid[k + 1] - grid[k])
            for n in range(len(curves)):
                left, right = curves[n][row[m], k], curves[n][row[m], k + 1]
                out[n, m, j] = left + share * (right - left)


def contact_plane(
    gap: Gap, row: IntArray, y: FloatArray, angle: FloatArray
) -> ContactPlane:
    """Plane on the contact line, with the wheel lowered to its initial contact.

    Parameters
    ----------
    gap : Gap
        n rows.
    row : (m,) int array
        Row of each plane.
    y : (m,) array
        Its point on the counterface's profile [m].
    angle : (m,) array
        Its contact angle [rad].

    Returns
    -------
    ContactPlane
        With x on the contact line x(y) and the displacement of initial contact: the
        lowest value of the row's gap, which is measured along the roller's radius, over
        the cosine of that radius from straight down.
    """
    x = between_points(gap, (gap.x,), row, y)[0]
    lowest = gap.gap[row].argmin(axis=1)
    low = gap.gap[row, lowest]
    _, cosine, _ = roller_angle(
        gap.x[row, lowest], gap.counterface.z[lowest] - low, gap.curvature
    )
    return ContactPlane(row, y, x, angle, low / cosine)


def gap_surface(
    gap: Gap, plane: ContactPlane, x: FloatArray, s: FloatArray
) -> FloatArray:
    """Gap of wheel and counterface along the contact normal, on a grid in each plane.

    Parameters
    ----------
    gap : Gap
        From `geometry.gap`.
    plane : ContactPlane
        m planes.
    x : (m, nx) array
        Positions along the rolling direction, from the plane's origin [m].
    s : (m, ny) array
        Positions across it, positive to the field side [m].

    Returns
    -------
    (m, nx, ny) array
        Positive where the surfaces are apart, negative where they overlap [m]. A rigid
        approach along the normal lowers it evenly. 1 m where a ray meets no wheel or no
        counterface, or only grazes it.

    Raises
    ------
    ContactError
        If the gap has no bodies, because it was not made by `geometry.gap`.
    """
    if gap.bodies is None:
        raise ContactError(
            "this gap is a curve without bodies; its surface needs one of geometry.gap"
        )
    out = np.empty((plane.row.size, x.shape[1], s.shape[1]))
    _fill(
        plane,
        gap.bodies,
        gap.counterface,
        gap.curvature,
        x,
        s,
        np.empty((2, s.shape[1])),
        out,
    )
    return out


@inner_kernel
def place_in(grid: FloatArray, value: float, near: int) -> int:
    """Cell of a rising grid that contains `value`, searched from cell `near`.

    It is -1 outside of the grid.
    """
    last = grid.size - 2
    if not grid[0] <= value <= grid[last + 1]:
        return -1
    k = min(max(near, 0), last)
    if abs(value - grid[k]) > 1e-2:
        low, high = 0, last + 1
        while high - low > 1:
            middle = (low + high) // 2
            if grid[middle] <= value:
                low = middle
            else:
                high = middle
        return low
    while k < last and grid[k + 1] <= value:
        k += 1
    while k > 0 and grid[k] > value:
        k -= 1
    return k


@inner_kernel
def smooth_at(
    grid: FloatArray, height: FloatArray, slope: FloatArray, k: int, value: float
) -> tuple[float, float]:
    """Cubic by heights and slopes at both ends of cell `k`: value and derivative."""
    step = grid[k + 1] - grid[k]
    t = (value - grid[k]) / step
    rise = height[k + 1] - height[k]
    a = slope[k] * step - rise
    b = rise - slope[k + 1] * step
    u = 1.0 - t
    y = height[k] + t * rise + t * u * (a * u + b * t)
    derivative = (rise + (u - t) * (a * u + b * t) + t * u * (b - a)) / step
    return y, derivative


@kernel
def roller_angle(x: float, z: float, kappa: float) -> tuple[float, float, float]:
    """Sine and cosine of a point's angle about a roller's axle, sine over kappa [m]."""
    length = np.sqrt((kappa * x) ** 2 + (1.0 - kappa * z) ** 2)
    reach = x / length
    return kappa * reach, (1.0 - kappa * z) / length, reach


@kernel
def _fill(
    plane: ContactPlane,
    bodies: Bodies,
    counterface: CounterfaceProfile,
    kappa: float,
    x_grid: FloatArray,
    s_grid: FloatArray,
    guess: FloatArray,
    out: FloatArray,
) -> None:
    """Intersect the rays of every plane with the surfaces.

    They are solved from the middle outwards, each from its neighbour's solution.
    """
    wheel, pose, half_span, nominal_radius = bodies
    grid_y, grid_z, grid_slope, _ = counterface
    lengths, widths = out.shape[1], out.shape[2]
    for m in range(plane.row.size):
        row = plane.row[m]
        sy, cy = np.sin(pose.yaw[row]), np.cos(pose.yaw[row])
        sr, cr = np.sin(pose.roll[row]), np.cos(pose.roll[row])
        # Plane with its origin on the counterface, below the wheel's point.
        origin_cell = place_in(grid_y, plane.y[m], 0)
        if origin_cell < 0:
            out[m] = NO_WHEEL
            continue
        top, _ = smooth_at(grid_y, grid_z, grid_slope, origin_cell, plane.y[m])
        sine, cosine, reach = roller_angle(plane.x[m], top, kappa)
        origin_x = (1.0 - kappa * top) * reach
        origin_z = top * cosine + kappa * reach * reach / (1.0 + cosine)
        axle = nominal_radius - plane.vertical_displacement[m]
        sd, cd = np.sin(plane.angle[m]), np.cos(plane.angle[m])
        s_x, s_y, s_z = -sd * sine, cd, sd * cosine
        n_x, n_y, n_z = -cd * sine, -sd, cd * cosine
        # Components of the normal along the wheelset's axes: forward, axle, down.
        n_f = cy * n_x + sy * n_y
        n_a = -sy * cr * n_x + cy * cr * n_y + sr * n_z
        n_d = sy * sr * n_x - cy * sr * n_y + cr * n_z
        first_x = int(np.argmin(np.abs(x_grid[m])))
        first_s = int(np.argmin(np.abs(s_grid[m])))
        ring, cell = 0, origin_cell
        for turn in range(lengths):
            # first_x, ..., last, then first_x - 1, ..., 0
            i = first_x + turn if first_x + turn < lengths else lengths - 1 - turn
            for step in range(widths):
                j = first_s + step if first_s + step < widths else widths - 1 - step
                if turn == 0:
                    start_w, start_c = 0.0, 0.0
                    if step > 0:
                        neighbour = j - 1 if j > first_s else j + 1
                        start_w, start_c = guess[0, neighbour], guess[1, neighbour]
                else:
                    start_w, start_c = guess[0, j], guess[1, j]
                x, s = x_grid[m, i], s_grid[m, j]
                p_x = origin_x + x * cosine + s * s_x
                p_y = plane.y[m] + s * s_y
                p_z = origin_z + x * sine + s * s_z
                # Point on the counterface.
                n = start_c
                met = False
                for _ in range(_STEPS):
                    y, z, along = p_y + n * n_y, p_z + n * n_z, p_x + n * n_x
                    cell = place_in(grid_y, y, cell)
                    if cell < 0:
                        break
                    height, slope = smooth_at(grid_y, grid_z, grid_slope, cell, y)
                    length = np.sqrt((kappa * along) ** 2 + (1.0 - kappa * z) ** 2)
                    depth = (2.0 * z - kappa * z * z - kappa * along * along) / (
                        1.0 + length
                    )
                    fall = (
                        n_z * (1.0 - kappa * z) - n_x * kappa * along
                    ) / length - slope * n_y
                    if fall < _FLATTEST:
                        break
                    move = (height - depth) / fall
                    n += move
                    if abs(move) < _DONE:
                        met = True
                        break
                counterface_distance = n
                # Point on the wheel.
                q_x, q_y, q_z = p_x, p_y - pose.shift[row] + half_span, p_z + axle
                f = cy * q_x + sy * q_y
                a = -sy * cr * q_x + cy * cr * q_y + sr * q_z - half_span
                d = sy * sr * q_x - cy * sr * q_y + cr * q_z
                n = start_w
                on_wheel = False
                for _ in range(_STEPS):
                    ring = place_in(wheel.y, a + n * n_a, ring)
                    if ring < 0:
                        break
                    radius, slope = smooth_at(
                        wheel.y, wheel.radius, wheel.slope, ring, a + n * n_a
                    )
                    forward, down = f + n * n_f, d + n * n_d
                    length = np.sqrt(forward * forward + down * down)
                    fall = (forward * n_f + down * n_d) / length - slope * n_a
                    if fall < _FLATTEST:
                        break
                    move = (radius - length) / fall
                    n += move
                    if abs(move) < _DONE:
                        on_wheel = True
                        break
                guess[0, j] = n if on_wheel else start_w
                guess[1, j] = counterface_distance if met else start_c
                out[m, i, j] = (
                    counterface_distance - n if met and on_wheel else NO_WHEEL
                )
