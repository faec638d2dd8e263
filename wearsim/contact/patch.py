"""The contact patch and the fields on it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.kernel import kernel, plain

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Resolution:
    """Resolution of patches: strips and cells according to their size.

    Parameters
    ----------
    cell : float
        Largest width of a strip and length of a cell [m].
    strips, cells : int
        Strips across a patch and cells along each, at least.
    most : int
        Of either, at most.
    """

    cell: float
    strips: int
    cells: int
    most: int

    def strips_across(self, width: FloatArray) -> IntArray:
        """Count the strips of patches (m,) of a width [m]."""
        return self._count(width, self.strips)

    def cells_along(self, length: FloatArray) -> IntArray:
        """Count the cells along the strips of patches (m,) of a length [m]."""
        return self._count(length, self.cells)

    def _count(self, size: FloatArray, fewest: int) -> IntArray:
        # Rounding must not add a cell to a size that is a multiple of the cell.
        needed = np.ceil(size / self.cell * (1.0 - 1e-9))
        return np.minimum(np.maximum(needed, fewest), max(self.most, fewest)).astype(
            np.int64
        )


@dataclass(frozen=True)
class PatchGrid:
    """Pressure of patches on uniform grids in their contact planes.

    The rows of cells are the strips.

    Parameters
    ----------
    x_lead : (m,) array
        Leading end of the grid, alike for all strips of a patch [m].
    cell_length : (m,) array
        Of the cells of each patch [m].
    pressure : (m, nx, ny) array
        Mean pressure of each cell, x index from the leading end; zero where the
        surfaces are apart [Pa].
    """

    x_lead: FloatArray
    cell_length: FloatArray
    pressure: FloatArray

    @property
    def x(self) -> FloatArray:
        """Longitudinal position of the cell centres (m, nx) [m]."""
        count = self.pressure.shape[1]
        return self.x_lead[:, None] - self.cell_length[:, None] * (
            np.arange(count) + 0.5
        )


@dataclass(frozen=True)
class StripPlanes:
    """Strips along the rolling direction, in planes of their own or that of the patch.

    Widths of neighbours differ. Strips of a patch are in the order of rising y; after
    them the arrays are padded with strips of width 0.

    Parameters
    ----------
    y : (m, N) array
        Lateral position of the middle on the counterface's profile [m].
    station : (m, N) array
        Position of the middle along the arc of the counterface's profile, with one
        origin for all patches of a wheel [m].
    width : (m, N) array
        Along the arc; 0: padding [m].
    half : (m, N) array
        Half-length [m].
    middle : (m, N) array
        Longitudinal position of the strip's middle, from the patch's centre [m].
    peak : (m, N) array
        Factor p of the pressure p sqrt(1 - t^2), t from -1 to 1 along the strip [Pa].
    angle : (m, N) array
        Contact angle of the strip's plane, with the sign of that of the patch [rad].
    """

    y: FloatArray
    station: FloatArray
    width: FloatArray
    half: FloatArray
    middle: FloatArray
    peak: FloatArray
    angle: FloatArray

    @property
    def normal_force(self) -> FloatArray:
        """Normal force of each strip (m, N) [N]."""
        return 0.5 * np.pi * self.peak * self.half * self.width

    @property
    def offset(self) -> FloatArray:
        """Position of each strip (m, N) along the arc from the load centre [m].

        The load centre is the mean weighted with the normal force.
        """
        offset: FloatArray = (
            self.station - mean_over_planes(self.station, self.normal_force)[:, None]
        )
        return offset

    def stretched(self, scale: FloatArray, centre_y: FloatArray) -> StripPlanes:
        """Similar strips in the same planes.

        Lengths and pressures are scaled by (m,) from centres (m,).
        """
        wide, centre = scale[:, None], centre_y[:, None]
        return StripPlanes(
            y=self.y + (wide - 1.0) * (self.y - centre),
            station=self.station + (wide - 1.0) * self.offset,
            width=wide * self.width,
            half=wide * self.half,
            middle=wide * self.middle,
            peak=wide * self.peak,
            angle=self.angle,
        )


def mean_over_planes(value: FloatArray, normal_force: FloatArray) -> FloatArray:
    """Mean of a quantity (m, N, ...) over the planes of each patch.

    It is weighted with the normal forces (m, N).
    """
    if normal_force.shape[1] == 1:
        mean: FloatArray = value[:, 0]
        return mean
    share = normal_force / normal_force.sum(axis=1, keepdims=True)
    mean = np.einsum("mn...,mn->m...", value, share)
    return mean


@dataclass(frozen=True)
class Patch:
    """Contact patches in their planes, cut into `ny` strips in the rolling direction.

    Lateral positions are those in the contact plane from the pressure-weighted centre
    of the patch, positive to the field side; longitudinal ones positive in the rolling
    direction.

    Parameters
    ----------
    row : (m,) int array
        Row of the batch (one wheel at one operating point) each patch belongs to.
    y : (m, ny) array
        Strip centres [m].
    width : (m,) array
        Width of one strip [m].
    x_lead, x_trail : (m, ny) array
        Leading and trailing end of each strip [m].
    pressure_slope : (m, ny) array
        Factor c of p = c sqrt((x_lead - x)(x - x_trail)) of each strip [Pa/m];
        load-conserving on these strips.
    interpenetration : (m, ny) array
        Virtual interpenetration g of each strip, zero for models without one [m].
    strips, cells : (m,) int array
        Strips of each patch and cells along each strip. The other entries in the arrays
        of the batch are padding: strips without length and cells without pressure.
    grid : PatchGrid, optional
        Pressure of models that find it cell by cell; the strips then are those of
        `from_grid`.
    planes : StripPlanes, optional
        Of a patch that is bent: the strips the normal model solved, each in its own
        plane; `y` then is along the arc, from their mean station weighted with the
        normal forces. Of a patch with a `grid`: its rows. None: the patch lies in one
        plane, with one creepage and spin about its centre.
    """

    row: IntArray
    y: FloatArray
    width: FloatArray
    x_lead: FloatArray
    x_trail: FloatArray
    pressure_slope: FloatArray
    interpenetration: FloatArray
    strips: IntArray
    cells: IntArray
    grid: PatchGrid | None = None
    planes: StripPlanes | None = None

    @property
    def area(self) -> FloatArray:
        """Area of each patch (m,), summed over loaded cells or over strips [m2]."""
        if self.grid is None:
            return (self.x_lead - self.x_trail).sum(axis=1) * self.width
        cells: IntArray = (self.grid.pressure > 0.0).sum(axis=(1, 2))
        return cells * self.grid.cell_length * self.width

    @property
    def length(self) -> FloatArray:
        """Extent of each patch in the rolling direction (m,) [m]."""
        if self.grid is None:
            return (self.x_lead - self.x_trail).max(axis=1, initial=0.0)
        return _extent(self.grid.pressure.max(axis=2) > 0.0) * self.grid.cell_length

    @property
    def lateral_extent(self) -> FloatArray:
        """Extent of each patch across the rolling direction (m,) [m]."""
        if self.grid is None:
            return self.width * self.strips
        return _extent(self.grid.pressure.max(axis=1) > 0.0) * self.width


def _extent(loaded: NDArray[np.bool_]) -> IntArray:
    """Count the positions (m,) from the first to the last true one of each row."""
    count = loaded.shape[1]
    return count - np.argmax(loaded, axis=1) - np.argmax(loaded[:, ::-1], axis=1)


def from_grid(
    row: IntArray,
    y: FloatArray,
    width: FloatArray,
    grid: PatchGrid,
    strips: IntArray,
    cells: IntArray,
) -> Patch:
    """Patch of a model with pressure by cells, with strips of the same loads.

    Parameters
    ----------
    row, y, width, strips, cells
        As of `Patch`; the strips are the grid's rows of cells.
    grid : PatchGrid
        Pressures.

    Returns
    -------
    Patch
        Each strip carries the semi-ellipse whose load, middle and variance are those of
        its cells: a semi-ellipse of half length a has the variance a^2/4, and the
        staircase of its cells keeps all three within second order of the cell length,
        where its ends would be wrong to first order. A strip without contact has the
        length 0.
    """
    dx = grid.cell_length[:, None]
    place = grid.x[:, :, None]
    load = grid.pressure.sum(axis=1) * dx
    per_load = np.divide(dx, load, out=np.zeros_like(load), where=load > 0.0)
    middle = (grid.pressure * place).sum(axis=1) * per_load
    spread = (grid.pressure * (place - middle[:, None, :]) ** 2).sum(
        axis=1
    ) * per_load + dx**2 / 12.0
    half = np.where(load > 0.0, 2.0 * np.sqrt(spread), 0.0)
    slope = np.divide(
        2.0 * load, np.pi * half**2, out=np.zeros_like(load), where=load > 0.0
    )
    return Patch(
        row,
        y,
        width,
        middle + half,
        middle - half,
        slope,
        np.zeros_like(y),
        strips,
        cells,
        grid,
    )


def cells_of(
    resolution: Resolution, x_lead: FloatArray, x_trail: FloatArray
) -> IntArray:
    """Count the cells (m,) along the strips of patches.

    The number follows from the ends (m, ny) of their true strips [m].
    """
    return resolution.cells_along(
        x_lead.max(axis=1, initial=0.0) - x_trail.min(axis=1, initial=0.0)
    )


def ends_of(patch: Patch) -> tuple[FloatArray, FloatArray]:
    """Leading and trailing end (m,) of the strips of each patch [m]."""
    true = np.arange(patch.y.shape[1]) < patch.strips[:, None]
    lead: FloatArray = np.where(true, patch.x_lead, -np.inf).max(
        axis=1, initial=-np.inf
    )
    trail: FloatArray = np.where(true, patch.x_trail, np.inf).min(
        axis=1, initial=np.inf
    )
    return lead, trail


def on_grid(patch: Patch) -> PatchGrid:
    """Pressure of a patch on a uniform grid, its own if it has one.

    Parameters
    ----------
    patch : Patch
        m patches of ny strips, with `cells` from the foremost to the hindmost end of
        each.

    Returns
    -------
    PatchGrid
        Each cell holds the integral of its strip's semi-ellipse: the load is that of
        the patch.
    """
    if patch.grid is not None:
        return patch.grid
    lead, trail = ends_of(patch)
    share = np.arange(patch.cells.max(initial=1) + 1) / patch.cells[:, None]
    ends = lead[:, None] - (lead - trail)[:, None] * np.minimum(share, 1.0)
    half = 0.5 * (patch.x_lead - patch.x_trail)
    middle = 0.5 * (patch.x_lead + patch.x_trail)
    off = ends[:, :, None] - middle[:, None, :]
    share = np.divide(
        off, half[:, None, :], out=np.sign(off), where=half[:, None, :] > 0.0
    )
    share = np.clip(share, -1.0, 1.0)
    # integral of sqrt(1 - u^2) from 0 to u
    total = 0.5 * (share * np.sqrt(1.0 - share**2) + np.arcsin(share))
    load = (patch.pressure_slope * half**2)[:, None, :] * -np.diff(total, axis=1)
    dx = (lead - trail) / patch.cells
    return PatchGrid(lead, dx, np.maximum(load / dx[:, None, None], 0.0))


@dataclass(frozen=True)
class SurfaceFields:
    """Pressure, shear stress and slip in the cells of each patch.

    The x index counts from the leading edge.

    Parameters
    ----------
    pressure : (m, nx, ny) array
        Contact pressure, mean of the cell [Pa].
    shear_x, shear_y : (m, nx, ny) array
        Shear traction on the wheel, mean of the cell [Pa].
    slip_x, slip_y : (m, nx, ny) array
        Slip velocity of the wheel's surface relative to the counterface, over V [-].
    work_density : (m, nx, ny) array
        Frictional work per cell area and distance rolled, -shear . slip, after the
        scaling to the resultant power [J/m3 = Pa]; the local wear index of energy laws.
    x_lead : (m, ny) array
        Leading end of the row of cells of each strip [m].
    cell_length : (m, ny) array
        Length of the cells of each strip along the rolling direction [m].
    strip_width : (m,) array
        Width of the strips in the contact plane [m].
    speed : (m,) array
        Reference speed V [m/s].
    """

    pressure: FloatArray
    shear_x: FloatArray
    shear_y: FloatArray
    slip_x: FloatArray
    slip_y: FloatArray
    work_density: FloatArray
    x_lead: FloatArray
    cell_length: FloatArray
    strip_width: FloatArray
    speed: FloatArray

    @property
    def strip_work(self) -> FloatArray:
        """Frictional work per unit area and passage e(y), (m, ny) [J/m2]."""
        work = np.zeros(self.cell_length.shape)
        _sum_along(plain(self.work_density), work)
        work *= self.cell_length
        return work


@kernel
def _sum_along(cells: FloatArray, out: FloatArray) -> None:
    """Add the cells (m, nx, ny) of each strip to `out` (m, ny)."""
    for m in range(cells.shape[0]):
        for i in range(cells.shape[1]):
            for j in range(cells.shape[2]):
                out[m, j] += cells[m, i, j]


@lru_cache(maxsize=512)
def load_factor(cells: int) -> float:
    """Integral of a semi-ellipse over its trapezoidal sum of `cells` equal cells [-].

    Cell pressures multiplied by it carry exactly the load of the strip, so that a fully
    slipping patch carries exactly the friction coefficient times the normal force on
    any grid.

    Parameters
    ----------
    cells : int
        Cells along a strip.

    Returns
    -------
    float
        1 + O(cells^-1.5).
    """
    ends = np.linspace(-1.0, 1.0, cells + 1)
    return float(
        0.5 * np.pi / (2.0 / cells * np.sqrt(np.maximum(1.0 - ends**2, 0.0)).sum())
    )
