"""Grids of half-space patches in their contact planes: heights of the gap, influence on each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from wearsim.contact.gap import ContactPlane, contact_plane, gap_surface
from wearsim.contact.geometry import NO_WHEEL, Gap
from wearsim.contact.normal.half_space.pressure import Coupling, HeightGrid
from wearsim.contact.normal.model import ALIKE
from wearsim.contact.patch import FloatArray, IntArray

_NODES = 8  # of the interpolation of the influence of one grid on another, in each direction
_GRAZING = 1.47  # rad to the contact plane, above which a profile is no longer its surface


@dataclass(frozen=True)
class Region:
    """A grid in a contact plane; lengths from the plane's origin on the contact line [m].

    Parameters
    ----------
    row : int
        Of the gap.
    y, angle : float
        Origin on the counterface's profile [m] and contact angle [rad].
    x_low, x_high, s_low, s_high : float
        Borders of the grid along and across [m].
    y_low, y_high : float
        Lateral positions the grid must not pass, because other grids begin there [m].
    """

    row: int
    y: float
    angle: float
    x_low: float
    x_high: float
    s_low: float
    s_high: float
    y_low: float = -np.inf
    y_high: float = np.inf

    def cell(self, shape: tuple[int, int]) -> tuple[float, float]:
        """Length and width of the cells [m]."""
        return (self.x_high - self.x_low) / shape[0], (self.s_high - self.s_low) / shape[1]

    def x(self, count: int) -> FloatArray:
        """Cell centres along, from the leading end (count,) [m]."""
        share = (np.arange(count, dtype=np.float64) + 0.5) / count
        return self.x_high - (self.x_high - self.x_low) * share

    def s(self, count: int) -> FloatArray:
        """Cell centres across (count,) [m]."""
        share = (np.arange(count, dtype=np.float64) + 0.5) / count
        return self.s_low + (self.s_high - self.s_low) * share


class Section:
    """Counterface profile in the axes of a contact plane: s along the plane for each lateral position."""

    def __init__(self, gap: Gap, y: float, angle: float) -> None:
        profile = gap.counterface
        self._y0, self._z0 = y, float(np.interp(y, profile.y, profile.z))
        self._cosine, self._sine = float(np.cos(angle)), float(np.sin(angle))
        middle = int(np.searchsorted(profile.y, y))
        away = np.flatnonzero(np.abs(profile.angle - angle) > _GRAZING)
        first = int(away[away < middle].max(initial=-1)) + 1
        self.part = slice(first, int(away[away >= middle].min(initial=profile.y.size)))
        self._profile = profile
        self._y = profile.y[self.part]
        self._s = (self._y - y) * self._cosine + (profile.z[self.part] - self._z0) * self._sine
        self.ends = float(self._s[0]), float(self._s[-1])

    def across(self, y: FloatArray) -> FloatArray:
        """Positions s of points of the profile [m]."""
        z: FloatArray = np.interp(y, self._profile.y, self._profile.z)
        return (y - self._y0) * self._cosine + (z - self._z0) * self._sine

    def lateral(self, s: FloatArray) -> FloatArray:
        """Lateral positions y of the profile over positions s; beyond its ends along its last slope [m]."""
        place: FloatArray = np.interp(s, self._s, self._y)
        before, after = np.minimum(s - self._s[0], 0.0), np.maximum(s - self._s[-1], 0.0)
        place += before * (self._y[1] - self._y[0]) / (self._s[1] - self._s[0])
        place += after * (self._y[-1] - self._y[-2]) / (self._s[-1] - self._s[-2])
        return place


def plane_of(gap: Gap, region: Region) -> ContactPlane:
    """Plane of a region, with the wheel at initial contact."""
    return contact_plane(gap, np.array([region.row]), np.array([region.y]), np.array([region.angle]))


def origin_x(gap: Gap, region: Region) -> float:
    """Longitudinal position of a plane's origin, on the contact line, from the middle of the axle [m]."""
    return float(np.interp(region.y, gap.counterface.y, gap.x[region.row]))


def heights(gap: Gap, region: Region, shape: tuple[int, int], displacement: float) -> HeightGrid:
    """Heights over the cells of a region.

    Parameters
    ----------
    gap : Gap
        With bodies, or a curve: then the sections along x are parabolas with the curvature of wheel and
        counterface at their lateral position.
    region : Region
        The grid's place.
    shape : (int, int)
        nx, ny cells.
    displacement : float
        How far the wheel is pushed down from initial contact [m].

    Returns
    -------
    HeightGrid
        Large where nothing faces the plane.
    """
    x, s = region.x(shape[0]), region.s(shape[1])
    length, width = region.cell(shape)
    cosine = float(np.cos(region.angle))
    plane = plane_of(gap, region)
    if gap.bodies is not None:
        pushed = plane._replace(vertical_displacement=plane.vertical_displacement + displacement)
        return HeightGrid(gap_surface(gap, pushed, x[None], s[None])[0], length, width, cosine)
    section = Section(gap, region.y, region.angle)
    y = section.lateral(s)
    curve = gap.gap[region.row]
    grid = gap.counterface
    gradient = np.interp(y, grid.y, grid.slope - np.gradient(curve, grid.y))
    here = np.interp(y, grid.y, curve)
    across = (here - float(plane.vertical_displacement[0]) - displacement) / (
        cosine + gradient * np.sin(region.angle)
    )
    bend = cosine * curvature_along(gap, region.row, y)
    off = x[:, None] + origin_x(gap, region) - np.interp(y, grid.y, gap.x[region.row])
    open_to = (here >= NO_WHEEL) | (s < section.ends[0]) | (s > section.ends[1])
    return HeightGrid(np.where(open_to, NO_WHEEL, across + 0.5 * bend * off**2), length, width, cosine)


def curvature_along(gap: Gap, row: int, y: FloatArray) -> FloatArray:
    """Curvature along x of wheel and counterface as a sum, vertically [1/m]."""
    z = np.interp(y, gap.counterface.y, gap.counterface.z)
    ring = np.interp(y, gap.counterface.y, gap.wheel_radius[row])
    value: FloatArray = 1.0 / ring + gap.curvature / (1.0 - gap.curvature * z)
    return value


def overlaps(gap: Gap, row: int, level: float) -> list[Region]:
    """Regions where the rigid surfaces overlap under a displacement: every contact lies in one of them.

    Parameters
    ----------
    gap : Gap
        n rows.
    row : int
        Which.
    level : float
        Vertical displacement of the wheel from initial contact [m].

    Returns
    -------
    list of Region
        From the flange to the field side. Overlaps are cut over the highest gap between minima whose angles
        differ by more than a grid may hold.
    """
    curve, grid = gap.gap[row], gap.counterface
    limit = float(curve.min()) + level
    inside = np.flatnonzero(curve < limit)
    runs = np.split(inside, np.flatnonzero(np.diff(inside) > 1) + 1)
    regions: list[Region] = []
    for run in runs:
        part = curve[run]
        inner = 1 + np.flatnonzero((part[1:-1] < part[:-2]) & (part[1:-1] <= part[2:]))
        cuts: list[int] = []
        for a, b in pairwise(inner):
            if abs(grid.angle[run[b]] - grid.angle[run[a]]) > ALIKE:
                cuts.append(int(a + np.argmax(part[a:b])))
        for piece in np.split(run, cuts):
            regions.append(_about(gap, row, piece, limit))
    for k, cut in enumerate(regions[:-1]):
        between = 0.5 * (cut.y_high + regions[k + 1].y_low)
        regions[k], regions[k + 1] = replace(cut, y_high=between), replace(regions[k + 1], y_low=between)
    if regions:
        regions[0], regions[-1] = replace(regions[0], y_low=-np.inf), replace(regions[-1], y_high=np.inf)
    return regions


def _about(gap: Gap, row: int, piece: IntArray, limit: float) -> Region:
    """Region around grid points where the surfaces overlap."""
    grid = gap.counterface
    first, last = max(int(piece[0]) - 1, 0), min(int(piece[-1]) + 1, grid.y.size - 1)
    depth = limit - gap.gap[row, piece]
    weight = depth * np.gradient(grid.y)[piece]
    y = float((weight * grid.y[piece]).sum() / weight.sum())
    angle = float((weight * grid.angle[piece]).sum() / weight.sum())
    s = Section(gap, y, angle).across(grid.y[[first, last]])
    # 1.15: circles are longer than parabolas, and yaw bends sections.
    half = 1.15 * np.sqrt(2.0 * depth / curvature_along(gap, row, grid.y[piece]))
    x = gap.x[row, piece] - float(np.interp(y, grid.y, gap.x[row]))
    return Region(
        row, y, angle, float((x - half).min()), float((x + half).max()), float(s[0]), float(s[1]),
        float(grid.y[first]), float(grid.y[last]),
    )  # fmt: skip


def rotated(region: Region, angle: float, wider: Region | None = None) -> Region:
    """Put the same grid into a plane of another angle, with room for another grid too if one is given."""
    if wider is None:
        return replace(region, angle=angle)
    return replace(
        region,
        angle=angle,
        x_low=min(region.x_low, wider.x_low),
        x_high=max(region.x_high, wider.x_high),
        s_low=min(region.s_low, wider.s_low),
        s_high=max(region.s_high, wider.s_high),
    )


def touches_edge(region: Region, pressure: FloatArray) -> bool:
    """Whether a patch reaches a border of its grid behind which there is no other grid."""
    along, across = pressure.max(axis=1) > 0.0, pressure.max(axis=0) > 0.0
    low = across[0] and not np.isfinite(region.y_low)
    high = across[-1] and not np.isfinite(region.y_high)
    return bool(along[0] or along[-1] or low or high)


def carried_over(
    gap: Gap, old: Sequence[tuple[Region, FloatArray]], region: Region, shape: tuple[int, int]
) -> FloatArray:
    """Pressures of other grids at the cells of a region, linear between their cells."""
    pressure = np.zeros(shape)
    y = Section(gap, region.y, region.angle).lateral(region.s(shape[1]))
    x = region.x(shape[0]) + origin_x(gap, region)
    for before, field in old:
        s = Section(gap, before.y, before.angle).across(y)
        along = _linear(x - origin_x(gap, before), before.x_high, before.x_low, field.shape[0])
        across = _linear(s, before.s_low, before.s_high, field.shape[1])
        pressure += along @ field @ across.T
    return pressure


def _linear(place: FloatArray, start: float, stop: float, count: int) -> FloatArray:
    """Weights (n, count) of linear interpolation between cell centres; zero outside the grid."""
    at = (place - start) / (stop - start) * count - 0.5
    return np.maximum(1.0 - np.abs(at[:, None] - np.arange(count)), 0.0)


def coupling_of(
    gap: Gap, regions: list[Region], coupled: FloatArray, shape: tuple[int, int], effective_modulus: float
) -> Coupling | None:
    """Influence of grids on each other, in the share in which they are coupled.

    Between grids that lie apart it is smooth: forces are passed on to 8 x 8 Chebyshev nodes of their grid,
    whose displacements 1/(pi E* distance) times the cosine between the planes spread over the other grid by
    the same polynomials, so that it stays symmetric.

    Parameters
    ----------
    gap : Gap
        n rows.
    regions : list of Region
        k grids.
    coupled : (k, k) array
        From `gather`.
    shape : (int, int)
        nx, ny cells.
    effective_modulus : float
        E* [Pa].

    Returns
    -------
    callable or None
        For `solve_pressure`; none if no grid influences another.
    """
    pairs = np.argwhere(coupled > 0.0)
    if pairs.size == 0:
        return None
    nodes = np.cos(np.pi * (np.arange(_NODES) + 0.5) / _NODES)
    inverse = np.linalg.inv(np.polynomial.chebyshev.chebvander(nodes, _NODES - 1))

    def weights(count: int) -> FloatArray:
        places = (np.arange(count) + 0.5) * (2.0 / count) - 1.0
        table: FloatArray = np.polynomial.chebyshev.chebvander(places, _NODES - 1) @ inverse
        return table

    along, across = weights(shape[0]), weights(shape[1])
    points = []
    for region in regions:
        x = 0.5 * (region.x_high + region.x_low) - 0.5 * (region.x_high - region.x_low) * nodes
        s = 0.5 * (region.s_high + region.s_low) + 0.5 * (region.s_high - region.s_low) * nodes
        x_all, s_all = np.meshgrid(x + origin_x(gap, region), s, indexing="ij")
        z = np.interp(region.y, gap.counterface.y, gap.counterface.z)
        y_all = region.y + s_all * np.cos(region.angle)
        points.append(np.stack((x_all, y_all, z + s_all * np.sin(region.angle))).reshape(3, -1))
    tables = {}
    for j, k in pairs:
        distance = np.sqrt(((points[j][:, :, None] - points[k][:, None, :]) ** 2).sum(axis=0))
        facing = coupled[j, k] * max(np.cos(regions[j].angle - regions[k].angle), 0.0)
        tables[int(j), int(k)] = facing / (np.pi * effective_modulus * distance)
    areas = [np.prod(region.cell(shape)) for region in regions]

    def add(pressures: list[FloatArray], moved: list[FloatArray]) -> None:
        forces = [areas[k] * (along.T @ field @ across).ravel() for k, field in enumerate(pressures)]
        for (j, k), table in tables.items():
            moved[j] += along @ (table @ forces[k]).reshape(_NODES, _NODES) @ across.T

    return add
