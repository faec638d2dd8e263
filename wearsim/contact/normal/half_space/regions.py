"""Grids of half-space patches in contact planes: gap heights and mutual influence."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from wearsim.contact.gap import ContactPlane, contact_plane, gap_surface
from wearsim.contact.geometry import NO_WHEEL, CounterfaceProfile, Gap
from wearsim.contact.influence import multiply
from wearsim.contact.kernel import inner_kernel, kernel, plain
from wearsim.contact.normal.half_space.pressure import NODES, HeightGrid
from wearsim.contact.patch import FloatArray, IntArray

ALIKE = 0.2
"""Angle between two neighbouring contacts below which they share a plane [rad]."""

_COARSE = 16, 32, 96  # cells of the search along the strips, fewest and most across
_COARSE_CELL = 1e-3  # width of these cells [m]
_FITTING = 0.25  # tolerance of the borders of a grid in cells
# angle to the contact plane above which a profile is not part of its surface [rad]
_GRAZING = 1.47


@dataclass(frozen=True)
class Region:
    """Grid in a contact plane.

    Lengths count from the plane's origin on the contact line [m].

    Parameters
    ----------
    row : int
        Of the gap.
    y, angle : float
        Origin on the counterface's profile [m] and contact angle [rad].
    x_low, x_high, s_low, s_high : float
        Borders of the grid along and across [m].
    nx, ny : int
        Cells along and across.
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
    nx: int
    ny: int
    y_low: float = -np.inf
    y_high: float = np.inf

    @property
    def cell(self) -> tuple[float, float]:
        """Length and width of the cells [m]."""
        return (self.x_high - self.x_low) / self.nx, (
            self.s_high - self.s_low
        ) / self.ny

    @property
    def x(self) -> FloatArray:
        """Cell centres in the rolling direction, from the leading end (nx,) [m]."""
        return np.asarray(self.x_high - self.cell[0] * (np.arange(self.nx) + 0.5))

    @property
    def s(self) -> FloatArray:
        """Lateral cell centres (ny,) [m]."""
        return np.asarray(self.s_low + self.cell[1] * (np.arange(self.ny) + 0.5))


class Section:
    """Counterface profile in the axes of a contact plane.

    s is the position along the plane for each lateral position.
    """

    def __init__(self, gap: Gap, y: float, angle: float) -> None:
        self._profile, self._y, self._angle = gap.counterface, float(y), float(angle)
        self._z, first, stop, *ends = _part(self._profile, self._y, self._angle)
        self.part, self.ends = slice(first, stop), tuple(ends)

    def across(self, y: FloatArray) -> FloatArray:
        """Positions s of points of the profile [m]."""
        z: FloatArray = np.interp(y, self._profile.y, self._profile.z)
        return (y - self._y) * math.cos(self._angle) + (z - self._z) * math.sin(
            self._angle
        )

    def lateral(self, s: FloatArray) -> FloatArray:
        """Lateral positions y of the profile over positions s [m].

        Beyond its ends they continue with its last slope.
        """
        place, (first, stop) = np.empty(s.size), (self.part.start, self.part.stop)
        _fill_lateral(
            self._profile, self._y, self._z, self._angle, first, stop, plain(s), place
        )
        return place


@inner_kernel
def _along(
    profile: CounterfaceProfile, y: float, z: float, angle: float, k: int
) -> float:
    """Position of a point of the profile along a plane through (y, z)."""
    return float(
        (profile.y[k] - y) * np.cos(angle) + (profile.z[k] - z) * np.sin(angle)
    )


@kernel
def _part(
    profile: CounterfaceProfile, y: float, angle: float
) -> tuple[float, int, int, float, float]:
    """Height z at y, and the part of the profile around y that faces the plane.

    The positions of the ends of this part are also returned.
    """
    middle = 1
    while middle < profile.y.size - 1 and profile.y[middle] < y:
        middle += 1
    share = (y - profile.y[middle - 1]) / (profile.y[middle] - profile.y[middle - 1])
    z = profile.z[middle - 1] + share * (profile.z[middle] - profile.z[middle - 1])
    first, stop = middle, middle
    while first > 0 and abs(profile.angle[first - 1] - angle) <= _GRAZING:
        first -= 1
    while stop < profile.y.size and abs(profile.angle[stop] - angle) <= _GRAZING:
        stop += 1
    return (
        z,
        first,
        stop,
        _along(profile, y, z, angle, first),
        _along(profile, y, z, angle, stop - 1),
    )


@kernel
def _fill_lateral(
    profile: CounterfaceProfile,
    y: float,
    z: float,
    angle: float,
    first: int,
    stop: int,
    s: FloatArray,
    out: FloatArray,
) -> None:
    """Fill lateral positions of a part of the profile over positions along a plane."""
    for j in range(s.size):
        low, high = first, stop - 1
        while high - low > 1:
            middle = (low + high) // 2
            if _along(profile, y, z, angle, middle) <= s[j]:
                low = middle
            else:
                high = middle
        start, end = (
            _along(profile, y, z, angle, low),
            _along(profile, y, z, angle, high),
        )
        out[j] = profile.y[low] + (s[j] - start) / (end - start) * (
            profile.y[high] - profile.y[low]
        )


def plane_of(gap: Gap, region: Region) -> ContactPlane:
    """Plane of a region, with the wheel at initial contact."""
    return contact_plane(
        gap, np.array([region.row]), np.array([region.y]), np.array([region.angle])
    )


def origin_x(gap: Gap, region: Region) -> float:
    """Longitudinal position of a plane's origin from the middle of the axle [m].

    The origin is on the contact line.
    """
    return float(np.interp(region.y, gap.counterface.y, gap.x[region.row]))


def heights(gap: Gap, region: Region, displacement: float) -> HeightGrid:
    """Heights over the cells of a region.

    Parameters
    ----------
    gap : Gap
        With bodies, or a curve: then the sections along x are parabolas with the
        curvature of wheel and counterface at their lateral position.
    region : Region
        The grid's place.
    displacement : float
        How far the wheel is pushed down from initial contact [m].

    Returns
    -------
    HeightGrid
        Large where nothing faces the plane.
    """
    x, s = region.x, region.s
    length, width = region.cell
    cosine = float(np.cos(region.angle))
    plane = plane_of(gap, region)
    if gap.bodies is not None:
        pushed = plane._replace(
            vertical_displacement=plane.vertical_displacement + displacement
        )
        return HeightGrid(
            gap_surface(gap, pushed, x[None], s[None])[0], length, width, cosine
        )
    section = Section(gap, region.y, region.angle)
    y = section.lateral(s)
    curve = gap.gap[region.row]
    grid = gap.counterface
    gradient = np.interp(y, grid.y, grid.slope - np.gradient(curve, grid.y))
    opening = np.interp(y, grid.y, curve)
    across = (opening - float(plane.vertical_displacement[0]) - displacement) / (
        cosine + gradient * np.sin(region.angle)
    )
    bend = cosine * curvature_along(gap, region.row, y)
    off = x[:, None] + origin_x(gap, region) - np.interp(y, grid.y, gap.x[region.row])
    open_to = (opening >= NO_WHEEL) | (s < section.ends[0]) | (s > section.ends[1])
    return HeightGrid(
        np.where(open_to, NO_WHEEL, across + 0.5 * bend * off**2), length, width, cosine
    )


def curvature_along(gap: Gap, row: int, y: FloatArray) -> FloatArray:
    """Curvature along x of wheel and counterface as a sum, vertically [1/m]."""
    z = np.interp(y, gap.counterface.y, gap.counterface.z)
    ring = np.interp(y, gap.counterface.y, gap.wheel_radius[row])
    return 1.0 / ring + gap.curvature / (1.0 - gap.curvature * z)


def overlaps(gap: Gap, row: int, level: float) -> list[Region]:
    """Regions where the rigid surfaces overlap under a displacement.

    Every contact lies in one of them.

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
        From the flange to the field side. Overlaps are cut over the highest gap between
        minima whose angles differ by more than a grid may hold.
    """
    curve, grid = gap.gap[row], gap.counterface
    limit = float(curve.min()) + level
    inside = np.flatnonzero(curve < limit)
    runs = np.split(inside, np.flatnonzero(np.diff(inside) > 1) + 1)
    regions: list[Region] = []
    for run in runs:
        part = curve[run]
        inner = 1 + np.flatnonzero((part[1:-1] < part[:-2]) & (part[1:-1] <= part[2:]))
        unlike = np.abs(np.diff(grid.angle[run[inner]])) > ALIKE
        cuts = [
            a + int(np.argmax(part[a:b]))
            for a, b in np.stack((inner[:-1], inner[1:]), axis=1)[unlike]
        ]
        regions += [_about(gap, row, piece, limit) for piece in np.split(run, cuts)]
    for k, cut in enumerate(regions[:-1]):
        between = 0.5 * (cut.y_high + regions[k + 1].y_low)
        regions[k], regions[k + 1] = (
            replace(cut, y_high=between),
            replace(regions[k + 1], y_low=between),
        )
    if regions:
        regions[0], regions[-1] = (
            replace(regions[0], y_low=-np.inf),
            replace(regions[-1], y_high=np.inf),
        )
    return regions


def _about(gap: Gap, row: int, piece: IntArray, limit: float) -> Region:
    """Region around grid points at which the surfaces overlap."""
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
    nx, fewest, most = _COARSE
    ny = min(max(int((s[1] - s[0]) / _COARSE_CELL), fewest), most)
    return Region(
        row,
        y,
        angle,
        float((x - half).min()),
        float((x + half).max()),
        float(s[0]),
        float(s[1]),
        nx,
        ny,
        float(grid.y[first]),
        float(grid.y[last]),
    )


def turned(region: Region, angle: float, wider: Region | None = None) -> Region:
    """Rotate a grid to a plane of another angle.

    If another grid is given, there is room for it too.
    """
    turned = replace(region, angle=angle)
    if wider is None:
        return turned
    lower, higher = ("x_low", "s_low"), ("x_high", "s_high", "nx", "ny")
    least = {name: min(getattr(region, name), getattr(wider, name)) for name in lower}
    return replace(
        turned,
        **least,
        **{n: max(getattr(region, n), getattr(wider, n)) for n in higher},
    )


def fits(gap: Gap, old: Region, new: Region) -> bool:
    """Return True if a grid has nearly the required cells and borders."""
    length, width = old.cell
    x = origin_x(gap, new) - origin_x(gap, old)
    s = (new.y - old.y) / float(np.cos(old.angle))
    off_x = max(abs(new.x_low + x - old.x_low), abs(new.x_high + x - old.x_high))
    off_s = max(abs(new.s_low + s - old.s_low), abs(new.s_high + s - old.s_high))
    alike = (
        abs(new.nx - old.nx) <= 0.05 * old.nx and abs(new.ny - old.ny) <= 0.1 * old.ny
    )
    return alike and off_x < _FITTING * length and off_s < _FITTING * width


def touches_edge(region: Region, pressure: FloatArray) -> bool:
    """Return True if a patch reaches a border of its grid with no grid behind it."""
    along, across = pressure.max(axis=1) > 0.0, pressure.max(axis=0) > 0.0
    low = across[0] and not np.isfinite(region.y_low)
    high = across[-1] and not np.isfinite(region.y_high)
    return bool(along[0] or along[-1] or low or high)


def carried_over(
    gap: Gap, old: Sequence[tuple[Region, FloatArray]], region: Region
) -> FloatArray:
    """Pressures of other grids interpolated linearly at the cells of a region."""
    pressure, part = np.zeros((region.nx, region.ny)), np.empty((region.nx, region.ny))
    y = Section(gap, region.y, region.angle).lateral(region.s)
    x = region.x + origin_x(gap, region)
    for before, field in old:
        s = Section(gap, before.y, before.angle).across(y)
        along = _linear(
            x - origin_x(gap, before), before.x_high, before.x_low, before.nx
        )
        across = _linear(s, before.s_low, before.s_high, before.ny)
        half = np.empty((region.nx, before.ny))
        multiply(along, plain(field), half)
        multiply(half, plain(across.T), part)
        pressure += part
    return pressure


def _linear(place: FloatArray, start: float, stop: float, count: int) -> FloatArray:
    """Weights (n, count) of linear interpolation between cell centres.

    They are zero outside the grid.
    """
    at = (place - start) / (stop - start) * count - 0.5
    return np.maximum(1.0 - np.abs(at[:, None] - np.arange(count)), 0.0)


def coupling_of(
    gap: Gap, regions: Sequence[Region], coupled: FloatArray, effective_modulus: float
) -> FloatArray | None:
    """Influence of grids on each other, weighted with their coupling.

    Between separate grids it is smooth: forces are transferred to 8 x 8 Chebyshev nodes
    of their grid, whose displacements 1/(pi E* distance) times the cosine between the
    planes are distributed over the other grid by the same polynomials, so that it stays
    symmetric.

    Parameters
    ----------
    gap : Gap
        n rows.
    regions : sequence of Region
        k grids.
    coupled : (k, k) array
        From `gather`.
    effective_modulus : float
        E* [Pa].

    Returns
    -------
    (64 k, 64 k) array or None
        For `solve_pressure`; none if no grid influences another [m/N].
    """
    if not coupled.any():
        return None
    nodes = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
    points = []
    for region in regions:
        x = (
            0.5 * (region.x_high + region.x_low)
            - 0.5 * (region.x_high - region.x_low) * nodes
        )
        s = (
            0.5 * (region.s_high + region.s_low)
            + 0.5 * (region.s_high - region.s_low) * nodes
        )
        x_all, s_all = np.meshgrid(x + origin_x(gap, region), s, indexing="ij")
        z = np.interp(region.y, gap.counterface.y, gap.counterface.z)
        y_all = region.y + s_all * np.cos(region.angle)
        points.append(
            np.stack((x_all, y_all, z + s_all * np.sin(region.angle))).reshape(3, -1)
        )
    count = NODES * NODES
    table = np.zeros((len(regions) * count, len(regions) * count))
    for j, k in np.argwhere(coupled > 0.0):
        distance = np.sqrt(
            ((points[j][:, :, None] - points[k][:, None, :]) ** 2).sum(axis=0)
        )
        facing = coupled[j, k] * max(np.cos(regions[j].angle - regions[k].angle), 0.0)
        part = slice(j * count, (j + 1) * count), slice(k * count, (k + 1) * count)
        table[part] = facing / (np.pi * effective_modulus * distance)
    return table
