"""Segments of standard shapes and their construction: arcs, polynomials, tables.

Lengths are in mm, as printed in the standards.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from wearsim.errors import ProfileError
from wearsim.profile.shape import FloatArray


@dataclass(frozen=True)
class Segment(ABC):
    """Segment of a definition: z over y from `start` to `end` [mm].

    `zone` is its name in the standard.
    """

    zone: str
    start: float
    end: float

    @abstractmethod
    def height(self, y: FloatArray) -> FloatArray:
        """Return z [mm] at y [mm]."""

    @abstractmethod
    def angle(self, y: FloatArray) -> FloatArray:
        """Return the tangent angle [rad] at y [mm].

        It is +-pi/2 where an arc ends vertically.
        """

    @abstractmethod
    def moved(self, dy: float, dz: float) -> Self:
        """Return the segment shifted by dy to the field side and by dz upwards [mm]."""

    def between(self, start: float, end: float) -> Self:
        """Return the same curve over another range [mm]."""
        return replace(self, start=start, end=end)

    def abscissae(self, spacing: float) -> FloatArray:
        """Return y [mm] of points equidistant in arc length, `spacing` [mm] apart.

        The distance is approximate; both ends are included.
        """
        fine = np.linspace(self.start, self.end, 2001)
        stretch = 1.0 / np.cos(self.angle(fine))
        s = np.concatenate(
            ([0.0], np.cumsum(0.5 * (stretch[1:] + stretch[:-1]) * np.diff(fine)))
        )
        count = max(1, round(s[-1] / spacing))
        y = np.interp(np.linspace(0.0, s[-1], count + 1), s, fine)
        y[0], y[-1] = self.start, self.end
        return np.asarray(y)


@dataclass(frozen=True)
class Arc(Segment):
    """Circular arc, z = centre_z + branch * sqrt(radius^2 - (y - centre_y)^2) [mm]."""

    centre: tuple[float, float]
    radius: float
    branch: int

    def height(self, y: FloatArray) -> FloatArray:
        """Return z [mm] at y [mm]."""
        root = np.sqrt(np.maximum(self.radius**2 - (y - self.centre[0]) ** 2, 0.0))
        return self.centre[1] + self.branch * root

    def angle(self, y: FloatArray) -> FloatArray:
        """Return the tangent angle [rad] at y [mm].

        It is +-pi/2 where the arc ends vertically.
        """
        sine = np.clip((y - self.centre[0]) / self.radius, -1.0, 1.0)
        return np.asarray(-self.branch * np.arcsin(sine))

    def moved(self, dy: float, dz: float) -> Arc:
        """Return the arc shifted by dy to the field side and by dz upwards [mm]."""
        centre = (self.centre[0] + dy, self.centre[1] + dz)
        return replace(self, start=self.start + dy, end=self.end + dy, centre=centre)

    def mirrored(self) -> Arc:
        """Return the arc with y reversed."""
        return replace(
            self,
            start=-self.end,
            end=-self.start,
            centre=(-self.centre[0], self.centre[1]),
        )

    def abscissae(self, spacing: float) -> FloatArray:
        """Return y [mm] of points equidistant in arc length, `spacing` [mm] apart.

        The distance is approximate; both ends are included.
        """
        ends = np.array([self.start, self.end])
        a0, a1 = np.arcsin(np.clip((ends - self.centre[0]) / self.radius, -1, 1))
        count = max(1, round(self.radius * (a1 - a0) / spacing))
        y = self.centre[0] + self.radius * np.sin(np.linspace(a0, a1, count + 1))
        y[0], y[-1] = self.start, self.end
        return np.asarray(y)


@dataclass(frozen=True)
class Polynomial(Segment):
    """Polynomial, z = sum of c_k (y - origin)^k, with c_k in mm^(1-k).

    Two coefficients give a straight line.
    """

    coefficients: tuple[float, ...]
    origin: float = 0.0

    def height(self, y: FloatArray) -> FloatArray:
        """Return z [mm] at y [mm]."""
        # Horner: zone C of S1002 cancels terms of 4e3 to 5
        return np.asarray(polyval(y - self.origin, self.coefficients))

    def angle(self, y: FloatArray) -> FloatArray:
        """Return the tangent angle [rad] at y [mm]."""
        return np.arctan(polyval(y - self.origin, polyder(self.coefficients)))

    def moved(self, dy: float, dz: float) -> Polynomial:
        """Return the curve shifted by dy to the field side and by dz upwards [mm]."""
        coefficients = (self.coefficients[0] + dz, *self.coefficients[1:])
        return replace(
            self,
            start=self.start + dy,
            end=self.end + dy,
            origin=self.origin + dy,
            coefficients=coefficients,
        )

    def mirrored(self) -> Polynomial:
        """Return the curve with y reversed."""
        odd_reversed = tuple(c * (-1.0) ** k for k, c in enumerate(self.coefficients))
        return replace(
            self,
            start=-self.end,
            end=-self.start,
            coefficients=odd_reversed,
            origin=-self.origin,
        )


def line(zone: str, start: tuple[float, float], end: tuple[float, float]) -> Polynomial:
    """Straight line from point to point (y, z), start before end [mm]."""
    slope = (end[1] - start[1]) / (end[0] - start[0])
    return Polynomial(zone, start[0], end[0], (start[1], slope), start[0])


@dataclass(frozen=True)
class Spline(Segment):
    """Clamped cubic spline through a table with equal steps.

    Knots and heights are in mm; the slopes at both ends are dz/dy.
    """

    knots: tuple[float, ...]
    heights: tuple[float, ...]
    end_slopes: tuple[float, float]

    def height(self, y: FloatArray) -> FloatArray:
        """Return z [mm] at y [mm]."""
        return self._value(y, 0)

    def angle(self, y: FloatArray) -> FloatArray:
        """Return the tangent angle [rad] at y [mm]."""
        return np.arctan(self._value(y, 1))

    def moved(self, dy: float, dz: float) -> Spline:
        """Return the curve shifted by dy to the field side and by dz upwards [mm]."""
        knots = tuple(k + dy for k in self.knots)
        heights = tuple(h + dz for h in self.heights)
        return replace(
            self, start=self.start + dy, end=self.end + dy, knots=knots, heights=heights
        )

    def _value(self, y: FloatArray, derivative: int) -> FloatArray:
        from scipy.interpolate import (
            CubicSpline,
        )  # slow import (0.5 s), only when it is needed

        ends = ((1, self.end_slopes[0]), (1, self.end_slopes[1]))
        return np.asarray(
            CubicSpline(self.knots, self.heights, bc_type=ends)(y, derivative)
        )


def height_at(piece: Segment, y: float) -> float:
    """Height z [mm] of a segment at one y [mm]."""
    return float(piece.height(np.array([y]))[0])


def tangent_arc(
    zone: str, before: Arc, after: Polynomial, radius: float, branch: int
) -> Arc:
    r"""Arc of a radius [mm] tangent to the preceding arc and the following line.

    Only the far end of each neighbour counts; `branch` is 1 for a cap (z = centre +
    root), -1 for a bowl. Raises `ProfileError` where there is no such arc, or more than
    one.

    Notes
    -----
    With n the unit normal (positive z) at a point P, the centre of an arc through P is
    :math:`P - b R n` (b: branch). Tangent arcs share P and n, so the new centre lies on
    a circle of radius :math:`|b_1 R_1 - b R|` around that of the arc before, and on a
    line parallel to the one after at distance R; it is where these two meet.
    """
    bend, (cy, cz) = branch * radius, before.centre
    to_centre = before.branch * before.radius - bend
    # slope of the line, which has one coefficient or none
    slope = sum(after.coefficients[1:])
    stretch = math.hypot(1.0, slope)
    value = after.coefficients[0] - slope * after.origin - bend * stretch
    # The common chord lies at a distance from the centre of the circle, across a
    # direction.
    distance, direction = (
        (value + slope * cy - cz) / stretch,
        (-slope / stretch, 1.0 / stretch),
    )
    square = abs(to_centre) ** 2 - distance**2
    half = math.sqrt(square) if square >= 0.0 else math.nan
    foot = (cy + distance * direction[0], cz + distance * direction[1])
    arcs = []
    for side in (-1, 1):
        centre = (
            foot[0] - side * half * direction[1],
            foot[1] + side * half * direction[0],
        )
        first = centre[0] + bend * ((centre[0] - cy) / to_centre)
        last = centre[0] + bend * (-slope / stretch)
        if (
            centre[1] - cz
        ) / to_centre > 0.0 and before.start <= first < last <= after.end:
            arcs.append(Arc(zone, first, last, centre, radius, branch))
    if len(arcs) != 1:
        raise ProfileError(
            f"zone {zone!r}: {len(arcs)} arcs of radius {radius:g} mm are tangent to "
            "its neighbours"
        )
    return arcs[0]


def rail_head(
    radii: Sequence[float],
    junction_widths: Sequence[float],
    side: float,
    side_depth: float,
) -> tuple[Segment, ...]:
    """Symmetric rail head of tangent arcs, from the left side to the right one [mm].

    `radii` are ordered from the crown, whose arc is centred on the axis, to the corner.
    The widths are those of the head at the end of each arc but the last. The slope
    dz/dy is that of the straight sides, which extend to `side_depth` below the top.

    Notes
    -----
    At a junction both centres lie on one normal, so the centre moves along it by the
    difference of the radii; the last arc ends where its tangent has the slope of the
    side.
    """
    half_widths = [0.5 * width for width in junction_widths]
    centre = (0.0, radii[0])
    half: list[Arc | Polynomial] = []
    start = 0.0
    for k, radius in enumerate(radii):
        sine = (
            (half_widths[k] - centre[0]) / radius
            if k < len(half_widths)
            else side / math.hypot(side, 1.0)
        )
        end = centre[0] + radius * sine
        half.append(Arc(f"R{radius:g}", start, end, centre, radius, -1))
        start = end
        if k + 1 < len(radii):
            step = radius - radii[k + 1]
            centre = (
                centre[0] + step * sine,
                centre[1] - step * math.sqrt(1.0 - sine**2),
            )
    z_end = height_at(half[-1], start)
    half.append(
        Polynomial(
            "side",
            start,
            start + (side_depth - z_end) / side,
            (z_end - side * start, side),
        )
    )
    crown = half[0].between(-half[0].end, half[0].end)
    return (*(piece.mirrored() for piece in reversed(half[1:])), crown, *half[1:])


def part_moved(
    chain: Sequence[Segment],
    start: float,
    end: float,
    by: float,
    join_zone: str,
    join_end: float,
) -> tuple[Segment, ...]:
    """Shape with a part moved towards the flange back, for thinner flanges [mm].

    The part begins at `start` on a cap: the cap stays, and the moved one meets it half
    way. From the end of the part, moved `by` (below 0), a straight line `join_zone`
    leads to the unmoved shape at `join_end`.
    """
    stays, rest = _split(chain, start)
    part, rest = _split(rest, end)
    moved = [piece.moved(by, 0.0) for piece in part]
    cap, shifted = stays[-1], moved[0]
    assert isinstance(cap, Arc)
    assert isinstance(shifted, Arc)
    meet = 0.5 * (cap.centre[0] + shifted.centre[0])
    last = moved[-1]
    outside = _split(rest, join_end)[1]
    join = line(
        join_zone,
        (last.end, height_at(last, last.end)),
        (join_end, height_at(outside[0], join_end)),
    )
    return (
        *stays[:-1],
        cap.between(cap.start, meet),
        shifted.between(meet, shifted.end),
        *moved[1:],
        join,
        *outside,
    )


def _split(chain: Sequence[Segment], at: float) -> tuple[list[Segment], list[Segment]]:
    """Parts on both sides of a lateral position."""
    before = [
        p if p.end <= at else p.between(p.start, at) for p in chain if p.start < at
    ]
    behind = [p if p.start >= at else p.between(at, p.end) for p in chain if p.end > at]
    return before, behind
