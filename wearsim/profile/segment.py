"""Pieces of a standard shape: arcs, polynomials, tables; lengths in mm as printed in the standards."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from wearsim.profile.shape import FloatArray


@dataclass(frozen=True)
class Segment(ABC):
    """One piece of a definition, z as a function of y.

    Parameters
    ----------
    zone : str
        Its letter or name in the standard.
    start, end : float
        Lateral range, start < end [mm].
    """

    zone: str
    start: float
    end: float

    @abstractmethod
    def height(self, y: FloatArray) -> FloatArray:
        """Return z [mm] at y [mm]."""

    @abstractmethod
    def angle(self, y: FloatArray) -> FloatArray:
        """Return the tangent angle [rad] at y [mm]; +-pi/2 where an arc ends vertically."""

    @abstractmethod
    def moved(self, dy: float, dz: float) -> Self:
        """Return the same piece further to the field side by dy and higher in z by dz [mm]."""

    def between(self, start: float, end: float) -> Self:
        """Return the same curve over another range [mm]."""
        return replace(self, start=start, end=end)

    def abscissae(self, spacing: float) -> FloatArray:
        """Return y [mm] of points at even arc length, about `spacing` [mm] apart, both ends included."""
        fine = np.linspace(self.start, self.end, 2001)
        stretch = 1.0 / np.cos(self.angle(fine))
        s = np.concatenate(([0.0], np.cumsum(0.5 * (stretch[1:] + stretch[:-1]) * np.diff(fine))))
        count = max(1, round(s[-1] / spacing))
        y = np.interp(np.linspace(0.0, s[-1], count + 1), s, fine)
        y[0], y[-1] = self.start, self.end
        return np.asarray(y)


@dataclass(frozen=True)
class Arc(Segment):
    """Arc of a circle, z = centre_z + branch * sqrt(radius^2 - (y - centre_y)^2).

    Parameters
    ----------
    centre : tuple of float
        (y, z) [mm].
    radius : float
        Above 0 [mm].
    branch : int
        Sign of the root.
    """

    centre: tuple[float, float]
    radius: float
    branch: int

    def height(self, y: FloatArray) -> FloatArray:
        """Return z [mm] at y [mm]."""
        root = np.sqrt(np.maximum(self.radius**2 - (y - self.centre[0]) ** 2, 0.0))
        return self.centre[1] + self.branch * root

    def angle(self, y: FloatArray) -> FloatArray:
        """Return the tangent angle [rad] at y [mm]; +-pi/2 where the arc ends vertically."""
        sine = np.clip((y - self.centre[0]) / self.radius, -1.0, 1.0)
        return np.asarray(-self.branch * np.arcsin(sine))

    def moved(self, dy: float, dz: float) -> Arc:
        """Return the same arc further to the field side by dy and higher in z by dz [mm]."""
        centre = (self.centre[0] + dy, self.centre[1] + dz)
        return replace(self, start=self.start + dy, end=self.end + dy, centre=centre)

    def mirrored(self) -> Arc:
        """Return the arc with y reversed."""
        return replace(self, start=-self.end, end=-self.start, centre=(-self.centre[0], self.centre[1]))

    def abscissae(self, spacing: float) -> FloatArray:
        """Return y [mm] of points at even arc length, about `spacing` [mm] apart, both ends included."""
        ends = np.array([self.start, self.end])
        a0, a1 = np.arcsin(np.clip((ends - self.centre[0]) / self.radius, -1, 1))
        count = max(1, round(self.radius * (a1 - a0) / spacing))
        y = self.centre[0] + self.radius * np.sin(np.linspace(a0, a1, count + 1))
        y[0], y[-1] = self.start, self.end
        return np.asarray(y)


@dataclass(frozen=True)
class Polynomial(Segment):
    """Polynomial, z = sum of c_k (y - origin)^k; of two coefficients: a straight line.

    Parameters
    ----------
    coefficients : tuple of float
        c_k [mm^(1-k)].
    origin : float
        Lateral position from which y counts in the powers [mm].
    """

    coefficients: tuple[float, ...]
    origin: float = 0.0

    def height(self, y: FloatArray) -> FloatArray:
        """Return z [mm] at y [mm]."""
        at = y - self.origin
        z = np.zeros_like(at)
        for c in reversed(self.coefficients):  # Horner: zone C of S1002 cancels terms of 4e3 to 5
            z = z * at + c
        return z

    def angle(self, y: FloatArray) -> FloatArray:
        """Return the tangent angle [rad] at y [mm]."""
        at = y - self.origin
        slope = np.zeros_like(at)
        for k in range(len(self.coefficients) - 1, 0, -1):
            slope = slope * at + k * self.coefficients[k]
        return np.arctan(slope)

    def moved(self, dy: float, dz: float) -> Polynomial:
        """Return the same curve further to the field side by dy and higher in z by dz [mm]."""
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
        return replace(self, start=-self.end, end=-self.start, coefficients=odd_reversed, origin=-self.origin)


def line(zone: str, start: tuple[float, float], end: tuple[float, float]) -> Polynomial:
    """Straight line from point to point.

    Parameters
    ----------
    zone : str
        Its name.
    start, end : tuple of float
        Points (y, z), start before end [mm].

    Returns
    -------
    Polynomial
        z(y) with y counted from the start.
    """
    slope = (end[1] - start[1]) / (end[0] - start[0])
    return Polynomial(zone, start[0], end[0], (start[1], slope), start[0])


@dataclass(frozen=True)
class Spline(Segment):
    """Clamped cubic spline through a table of equal steps.

    Parameters
    ----------
    knots : tuple of float
        Lateral positions of the table, rising [mm].
    heights : tuple of float
        z at the knots [mm].
    end_slopes : tuple of float
        dz/dy at the first and at the last knot [-].
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
        """Return the same curve further to the field side by dy and higher in z by dz [mm]."""
        knots = tuple(k + dy for k in self.knots)
        heights = tuple(h + dz for h in self.heights)
        return replace(self, start=self.start + dy, end=self.end + dy, knots=knots, heights=heights)

    def _value(self, y: FloatArray, derivative: int) -> FloatArray:
        from scipy.interpolate import CubicSpline  # 0.5 s to import, only spent where it is needed

        ends = ((1, self.end_slopes[0]), (1, self.end_slopes[1]))
        return np.asarray(CubicSpline(self.knots, self.heights, bc_type=ends)(y, derivative))
