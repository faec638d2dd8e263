"""Cross-section as an ordered list of points, and its geometrical measures."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from wearsim.errors import NumericalError, ProfileError, shown

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

FloatArray = NDArray[np.float64]
Kind = Literal["wheel", "rail"]
_WIDEST = 1.0
"""Largest width or height of a cross-section [m].

In millimetres even a part of one is larger.
"""


@dataclass(frozen=True)
class Profile:
    """Cross-section of a wheel, rail or roller, as points ordered by arc length.

    Parameters
    ----------
    name : str
        Name given by the user.
    kind : {"wheel", "rail"}
        Which convention `z` follows.
    y : (n,) array
        Lateral position [m]; from the wheel profile's origin line, positive to the
        field side.
        Points run from the flange back (wheel) or the gauge side (rail) to the field
        side.
    z : (n,) array
        Wheel: positive radially outward, 0 at the running circle; rail: positive down,
        0 at the top [m].
    source : str
        Where the shape comes from.

    Raises
    ------
    ProfileError
        If y and z are not equally many finite numbers, or cannot be in metres.
    """

    name: str
    kind: Kind
    y: FloatArray = field(repr=False)
    z: FloatArray = field(repr=False)
    source: str = ""

    def __post_init__(
        self,
    ) -> None:  # takes some 20 us: campaigns make few profiles per step
        for key in ("y", "z"):
            given = getattr(self, key)
            try:
                values = np.asarray(given, dtype=np.float64)
            except (TypeError, ValueError):
                raise ProfileError(
                    f"profile {shown(self.name)}: {key} is no array of numbers; give "
                    "the coordinates of the points in metres"
                ) from None
            if values.ndim != 1 or values.size < 2:
                raise ProfileError(
                    f"profile {shown(self.name)}: {key} has the shape {values.shape}; "
                    "give a list of at least 2 coordinates in metres"
                )
            if not np.isfinite(values).all():
                place = int(np.flatnonzero(~np.isfinite(values))[0])
                raise ProfileError(
                    f"profile {shown(self.name)}: {key}[{place}] = {values[place]} "
                    "must be a finite number; delete the point from y and z"
                )
            if (span := float(values.max() - values.min())) > _WIDEST:
                raise ProfileError(
                    f"profile {shown(self.name)}: {key} spans {span:.4g} m, at most 1 "
                    "m is allowed: coordinates are in metres, and these look like "
                    "millimetres; divide y and z by 1000"
                )
            if values is not given:
                object.__setattr__(self, key, values)
        if self.y.size != self.z.size:
            raise ProfileError(
                f"profile {shown(self.name)}: y has {self.y.size} points and z has "
                f"{self.z.size}; give both coordinates of each point"
            )


def arc_length(y: FloatArray, z: FloatArray) -> FloatArray:
    """Arc length along each polygon (..., n) from its first to each vertex [m]."""
    edges = np.hypot(y[..., 1:] - y[..., :-1], z[..., 1:] - z[..., :-1])
    length = np.zeros((*edges.shape[:-1], edges.shape[-1] + 1))
    np.cumsum(edges, axis=-1, out=length[..., 1:])
    return length


def spline_through(place: FloatArray, values: FloatArray) -> PPoly:
    """Cubic spline through values (n, ...) at rising positions (n,), n at least 2.

    Raises
    ------
    ValueError
        As of `scipy.interpolate.CubicSpline`, if the places do not rise.

    Notes
    -----
    Its ends are not-a-knot: `scipy.interpolate.CubicSpline` to the last bit, in less
    than half of its time because little is checked. Profiles under wear take thousands.
    """
    from scipy.interpolate import (
        CubicSpline,
        PPoly,
    )  # slow import (0.5 s), only when it is needed
    from scipy.linalg.lapack import dgtsv

    at = values.reshape(len(place), -1)
    step = place[1:] - place[:-1]
    if len(place) < 4 or not step.min() > 0.0:
        return CubicSpline(place, values)
    wide = step[:, None]
    slope = (at[1:] - at[:-1]) / wide
    first, last = place[2] - place[0], place[-1] - place[-3]
    diagonal, lower, upper = (
        np.empty_like(place),
        np.empty_like(step),
        np.empty_like(step),
    )
    diagonal[0], diagonal[1:-1], diagonal[-1] = (
        step[1],
        2.0 * (step[:-1] + step[1:]),
        step[-2],
    )
    lower[:-1], lower[-1] = step[1:], last
    upper[0], upper[1:] = first, step[:-1]
    right = np.empty(at.shape, order="F")
    right[0] = (
        (step[0] + 2.0 * first) * step[1] * slope[0] + step[0] ** 2 * slope[1]
    ) / first
    right[1:-1] = 3.0 * (wide[1:] * slope[:-1] + wide[:-1] * slope[1:])
    right[-1] = (
        step[-1] ** 2 * slope[-2] + (2.0 * last + step[-1]) * step[-2] * slope[-1]
    ) / last
    *_, knots, _ = dgtsv(lower, diagonal, upper, right, True, True, True, True)
    bend = (knots[:-1] + knots[1:] - 2.0 * slope) / wide
    powers = np.empty((4, *slope.shape))
    powers[0], powers[1] = bend / wide, (slope - knots[:-1]) / wide - bend
    powers[2], powers[3] = knots[:-1], at[:-1]
    return PPoly.construct_fast(powers.reshape(4, -1, *values.shape[1:]), place, True)


def resample(profile: Profile, spacing: float) -> Profile:
    """Resample a profile at equal arc length on a cubic spline through its points.

    Parameters
    ----------
    profile : Profile
        At least two points, none repeated. Both ends and corners of more than 20
        degrees stay points.
    spacing : float
        Distance of the points [m]; the nearest one that divides the length is taken.

    Raises
    ------
    ProfileError
        The spacing is not above 0, or not below a tenth of the length.

    Notes
    -----
    y and z are splines of the chord length of the given points, so vertical parts
    (flange back, rail sides) keep their place in the order. A spline across a corner
    would overshoot by a tenth of the point distance; therefore it ends there and a new
    one begins.
    """
    if not np.isfinite(spacing) or spacing <= 0.0:
        raise ProfileError(
            f"{profile.name}: point spacing = {spacing * 1e3:g} mm must be above 0 mm"
        )
    s = arc_length(profile.y, profile.z)
    if spacing > 0.1 * s[-1]:
        raise ProfileError(
            f"{profile.name}: point spacing = {1e3 * spacing:g} mm must be below a "
            f"tenth of the profile's length of {1e3 * s[-1]:.4g} mm"
        )
    points = np.column_stack((profile.y, profile.z))
    pieces = []
    ends = [0, *corners(profile.y, profile.z), len(s) - 1]
    for first, last in pairwise(ends):
        part = slice(first, last + 1)
        count = max(1, round((s[last] - s[first]) / spacing))
        at = np.linspace(s[first], s[last], count + 1)
        piece = s[part], points[part]
        new = spline_through(*piece)(at) if last - first > 2 else _linear(at, *piece)
        new[0], new[-1] = points[first], points[last]
        pieces.append(new if last == len(s) - 1 else new[:-1])
    y, z = np.concatenate(pieces).T
    return replace(profile, y=np.ascontiguousarray(y), z=np.ascontiguousarray(z))


def resample_to(profile: Profile, count: int, guess: float | None = None) -> Profile:
    """Place a given number of points on a profile by a spacing near `guess`.

    The spacing lies within 3 % of the guess, which by default is the length over the
    number of intervals; see `resample`. A profile with that number of points is
    returned unchanged.

    Raises
    ------
    ProfileError
        If no spacing gives that many points.
    """
    if profile.y.size == count:
        return profile
    if guess is None:
        guess = float(arc_length(profile.y, profile.z)[-1]) / (count - 1)
    for part in sorted(np.linspace(-0.03, 0.03, 121), key=abs):
        resampled = resample(profile, guess * (1.0 + float(part)))
        if resampled.y.size == count:
            return resampled
    raise ProfileError(
        f"{profile.name} cannot be given {count} points; give wheels of as many points"
    )


def _linear(at: FloatArray, s: FloatArray, points: FloatArray) -> FloatArray:
    """Polygon at the arc lengths `at`, for pieces too short for a spline."""
    return np.column_stack(
        (np.interp(at, s, points[:, 0]), np.interp(at, s, points[:, 1]))
    )


def corners(y: FloatArray, z: FloatArray) -> list[int]:
    """Inner vertices at which the profile turns by more than 20 degrees.

    The angle must also be three times that of each of the three vertices on either
    side, so that noise of finely measured profiles does not count as corners.
    """
    heading = np.unwrap(np.arctan2(np.diff(z), np.diff(y)))
    turn = np.zeros(len(y))
    turn[1:-1] = np.abs(np.diff(heading))
    vertices = []
    for j in np.flatnonzero(turn > np.radians(20.0)):
        near = np.concatenate((turn[max(j - 3, 0) : j], turn[j + 1 : j + 4]))
        if turn[j] > 3.0 * near.max():
            vertices.append(int(j))
    return vertices


def _chords(y: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Chord P[j+1] - P[j-1] at each vertex, one-sided at the ends [m]."""
    dy, dz = np.empty_like(y), np.empty_like(z)
    for chord, at in ((dy, y), (dz, z)):
        chord[..., 1:-1] = at[..., 2:] - at[..., :-2]
        chord[..., 0], chord[..., -1] = (
            at[..., 1] - at[..., 0],
            at[..., -1] - at[..., -2],
        )
    return dy, dz


def vertex_normals(y: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the unit normals (..., n) into the material of wheels.

    Wear moves the vertices along them. They are perpendicular to the chord between the
    two neighbours of a vertex y, z (..., n), from the flange back to the field side;
    (0, -1) on a cylindrical tread.
    """
    dy, dz = _chords(y, z)
    length = np.hypot(dy, dz)
    return dz / length, -dy / length


def vertex_lengths(y: FloatArray, z: FloatArray) -> FloatArray:
    """Length of profile that belongs to each vertex [m].

    It is half the chord |P[j+1] - P[j-1]| between the neighbours, and half of the only
    edge at the ends.
    """
    return 0.5 * np.hypot(*_chords(y, z))


def polygon_area_between(
    y0: FloatArray, z0: FloatArray, y1: FloatArray, z1: FloatArray
) -> float:
    """Cross-section area between a wheel profile and the same vertices moved [m2].

    Parameters
    ----------
    y0, z0, y1, z1 : (n,) array
        Vertices before and after, from the flange back to the field side [m].

    Returns
    -------
    float
        Signed area of the loop along the old polygon, across, and back along the new
        one; positive where material (smaller z) was removed [m2].

    Notes
    -----
    Sum over the edges of half the cross product of the diagonals of the quadrilateral
    an edge sweeps: the shoelace formula, but free of the cancellation that absolute
    coordinates bring.
    """
    first_y, first_z = y1[1:] - y0[:-1], z1[1:] - z0[:-1]
    second_y, second_z = y0[1:] - y1[:-1], z0[1:] - z1[:-1]
    return float(0.5 * np.sum(first_y * second_z - first_z * second_y))


def offset_distance(y: FloatArray, z: FloatArray, depth: FloatArray) -> FloatArray:
    r"""Distance along each vertex normal by which the polygon loses a given area [m].

    Parameters
    ----------
    y, z : (n,) array
        Wheel profile from the flange back to the field side [m].
    depth : (n,) array
        Wear depth of the law at the vertices [m].

    Returns
    -------
    (n,) array
        Displacement d along `vertex_normals` [m].

    Raises
    ------
    NumericalError
        The depth comes near the radius of curvature: the offset curve would fold over.

    Notes
    -----
    Moving the vertices by :math:`d_j n_j` removes

    .. math:: A = \sum_j d_j l_j + \tfrac12 \sum_j d_j d_{j+1} \, n_j \times n_{j+1}

    with :math:`l_j` of `vertex_lengths`: the discrete form of the integral of d -
    curvature d²/2. Half of each cross term goes to either vertex, and vertex by vertex
    the area is made equal to :math:`h_j l_j`, h the law's depth, by fixed-point
    iteration.
    """
    ny, nz = vertex_normals(y, z)
    cross = ny[:-1] * nz[1:] - nz[:-1] * ny[1:]
    quarter = 0.25 / vertex_lengths(y, z)
    distance = np.array(depth, dtype=np.float64)
    for _ in range(60):
        share = np.zeros_like(distance)
        share[:-1] += distance[1:] * cross
        share[1:] += distance[:-1] * cross
        denominator = 1.0 + quarter * share
        if not np.all(denominator > 0.5):
            break
        new = depth / denominator
        change = np.max(np.abs(new - distance))
        distance = new
        if change <= 1e-15 * np.max(np.abs(new)):
            return distance
    raise NumericalError(
        f"wear depth of {1e3 * np.max(np.abs(depth)):.3g} mm in one step is too large "
        "for the curvature of the profile; shorten the step"
    )


def extremum(y: FloatArray, z: FloatArray, index: int) -> tuple[float, float]:
    """Position and value y, z [m] of a smooth extremum of z near the extreme vertex.

    It is the vertex of the parabola through that point and its neighbours, or the point
    itself where there is no such parabola (ends, plateaus, vertical edges).
    """
    if 0 < index < len(y) - 1:
        left, right = y[index] - y[index - 1], y[index + 1] - y[index]
        if left > 0.0 and right > 0.0:
            slope_left, slope_right = (
                (z[index] - z[index - 1]) / left,
                (z[index + 1] - z[index]) / right,
            )
            bend = (slope_right - slope_left) / (left + right)
            if bend != 0.0:
                slope = slope_left + bend * left
                offset = float(np.clip(-0.5 * slope / bend, -left, right))
                return float(y[index]) + offset, float(
                    z[index] + (slope + bend * offset) * offset
                )
    return float(y[index]), float(z[index])


def crossing(
    position: FloatArray, value: FloatArray, index: int, level: float
) -> float:
    """Position [m] at which `value` passes `level` between two vertices.

    The vertices are `index` and `index` + 1. The position is that of the cubic through
    the two vertices on each side where it is monotonic there, else that of the straight
    line, and never beyond the two vertices.
    """
    around = slice(max(index - 1, 0), index + 3)
    x, p = value[around], position[around]
    steps = np.diff(x)
    if len(x) < 4 or not (np.all(steps > 0.0) or np.all(steps < 0.0)):
        x, p = value[index : index + 2], position[index : index + 2]
    if len(x) == 2 and x[0] == x[1]:
        return float(p[0])
    total = 0.0
    for k, (node, at) in enumerate(zip(x.tolist(), p.tolist(), strict=True)):
        others = (neighbour for j, neighbour in enumerate(x.tolist()) if j != k)
        total += at * math.prod(
            (level - neighbour) / (node - neighbour) for neighbour in others
        )
    low, high = sorted((float(position[index]), float(position[index + 1])))
    return min(max(total, low), high)
