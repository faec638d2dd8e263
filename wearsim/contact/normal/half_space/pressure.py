r"""Pressure of elastic half-spaces under a rigid displacement, by conjugate gradients on several grids.

On each grid the height h of the gap, the surface displacement u and the vertical displacement D of the wheel
leave

.. math:: g = h + u - D c \ge 0, \qquad p \ge 0, \qquad g p = 0, \qquad \sum A c p = N,

with the cell area A and the cosine c of the contact angle, so that N is vertical. The iteration of Polonsky
and Keer [1]_: conjugate gradients on the cells that carry pressure, whose mean residual gives D; cells with
tension leave, cells that overlap enter, the load is restored by scaling. Each iteration costs one product
with the influence; what the few cells that enter or leave add is summed up cell by cell, and only where they
are many takes a second product.

References
----------
.. [1] I. A. Polonsky, L. M. Keer, Wear 231 (1999) 206-219, doi:10.1016/S0043-1648(99)00113-1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.influence import (
    field_of,
    normal_influence,
    scalar_product,
    spectrum,
    wave_table,
    waves_of,
)
from wearsim.contact.kernel import kernel
from wearsim.contact.patch import FloatArray

TOLERANCE = 3e-5  # the maximum pressure then is within 1e-4 of its limit
MOST_ITERATIONS = 1000
NODES = 8  # of the interpolation of the influence of one grid on another, in each direction
_FEW = 20  # cells whose influence is summed up rather than transformed: less work on any grid


@dataclass(frozen=True)
class HeightGrid:
    """Heights of the gap on a uniform grid in a contact plane.

    Parameters
    ----------
    height : (nx, ny) array
        At the cell centres, before the displacement [m].
    cell_length, cell_width : float
        Size of the cells along x and across [m].
    cosine : float
        Of the contact angle: the share of the vertical displacement along the normal.
    """

    height: FloatArray
    cell_length: float
    cell_width: float
    cosine: float = 1.0


@dataclass(frozen=True)
class GridPressure:
    """Pressures that carry the load.

    Parameters
    ----------
    pressure : tuple of (nx, ny) arrays
        One for each grid, mean of each cell [Pa].
    vertical_displacement : float
        D [m].
    iterations : int
        Of conjugate gradients.
    converged : bool
        Whether the change fell below the tolerance before the iteration limit.
    """

    pressure: tuple[FloatArray, ...]
    vertical_displacement: float
    iterations: int
    converged: bool


_GRID = np.dtype(
    [(name, np.int64) for name in ("first", "nx", "ny", "along", "across", "node_x", "node_y")]
    + [(name, np.float64) for name in ("area", "cosine")]
)
"""A grid: first cell, cells, places of its tables (waves, interpolation), area of a cell, cosine."""


class _Cells(NamedTuple):
    """Cells of all grids behind one another, and their tables."""

    grids: NDArray[np.void]  # of _GRID
    height: FloatArray
    area: FloatArray
    cosine: FloatArray
    influence: FloatArray  # of the first cell of each grid
    factor: FloatArray  # its transform
    tables: FloatArray
    coupling: FloatArray  # (k 64, k 64) displacements at the nodes under forces on them, or empty


@lru_cache(maxsize=512)
def interpolation(count: int) -> FloatArray:
    """Weights (n, NODES) of Chebyshev nodes at the cells of a row."""
    nodes = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
    places = (np.arange(count) + 0.5) * (2.0 / count) - 1.0
    chebvander = np.polynomial.chebyshev.chebvander
    table: FloatArray = chebvander(places, NODES - 1) @ np.linalg.inv(chebvander(nodes, NODES - 1))
    return table


def solve_pressure(
    grids: Sequence[HeightGrid],
    load: float,
    effective_modulus: float,
    *,
    coupling: FloatArray | None = None,
    start: Sequence[FloatArray] | None = None,
    tolerance: float = TOLERANCE,
    limit: int = MOST_ITERATIONS,
) -> GridPressure:
    """Find the pressures of all grids under a common displacement.

    Parameters
    ----------
    grids : sequence of HeightGrid
        One or several grids; where surfaces do not face each other the height is large.
    load : float
        N: the sum over all grids of force times `cosine` [N].
    effective_modulus : float
        E* [Pa].
    coupling : (64 k, 64 k) array, optional
        Displacement at the 8 x 8 nodes of each of k grids under forces on those of all; symmetric [m/N].
    start : sequence of (nx, ny) arrays, optional
        Pressures to start from, such as those of a neighbouring state; any load. The result depends on them
        within the tolerance.
    tolerance : float
        Largest change of the pressures in the last iteration, its mean as a share of their mean [-].
    limit : int
        Most iterations.

    Returns
    -------
    GridPressure
    """
    cells = _gathered(grids, effective_modulus, np.empty((0, 0)) if coupling is None else coupling)
    pressure = np.zeros(cells.height.size)
    if start is None:
        _first_guess(cells.height, cells.area, cells.cosine, float(load), effective_modulus, pressure)
    else:
        np.concatenate([field.ravel() for field in start], out=pressure)
    result = _iterate(cells, float(load), tolerance, limit, pressure)
    fields = tuple(
        part.reshape(grid.height.shape)
        for part, grid in zip(np.split(pressure, cells.grids["first"][1:]), grids, strict=True)
    )
    return GridPressure(fields, *result)


def _gathered(grids: Sequence[HeightGrid], modulus: float, coupling: FloatArray) -> _Cells:
    """Put grids and what their influence takes behind one another."""
    rows = np.zeros(len(grids), dtype=_GRID)
    tables: list[FloatArray] = []
    first = length = 0
    for row, grid in zip(rows, grids, strict=True):
        nx, ny = grid.height.shape
        row["first"], row["nx"], row["ny"] = first, nx, ny
        row["area"], row["cosine"] = grid.cell_length * grid.cell_width, grid.cosine
        first += nx * ny
        needed = {"along": wave_table(nx), "across": wave_table(ny)}
        if coupling.size > 0:
            needed |= {"node_x": interpolation(nx), "node_y": interpolation(ny)}
        for name, table in needed.items():
            row[name] = length
            tables.append(table.ravel())
            length += table.size
    influences = [
        normal_influence(grid.cell_length, grid.cell_width, grid.height.shape, modulus) for grid in grids
    ]
    sizes = [grid.height.size for grid in grids]
    return _Cells(
        rows,
        np.concatenate([grid.height.ravel() for grid in grids]),
        np.repeat(rows["area"], sizes),
        np.repeat(rows["cosine"], sizes),
        np.concatenate([table.ravel() for table in influences]),
        np.concatenate([spectrum(table).ravel() for table in influences]),
        np.concatenate(tables),
        coupling,
    )


@kernel
def _first_guess(
    height: FloatArray, area: FloatArray, cosine: FloatArray, load: float, modulus: float, pressure:
    FloatArray,
) -> None:  # fmt: skip
    """Virtual penetration, roughly: the overlap region's size squared times its depth carries the load."""
    first = np.inf
    for i in range(height.size):
        first = min(first, height[i] / cosine[i])
    low, high = first, first + 16.0 * (load / modulus) ** (2.0 / 3.0)
    for _ in range(12):
        level = 0.5 * (low + high)
        region = 0.0
        for i in range(height.size):
            if height[i] < level * cosine[i]:
                region += area[i]
        # N = pi/2 E* b delta for a circle; the region of half the approach is the contact itself
        if 2.0 * modulus * np.sqrt(region) * (level - first) < load:
            low = level
        else:
            high = level
    for i in range(height.size):
        pressure[i] = np.sqrt(max(high * cosine[i] - height[i], 0.0))


@kernel
def _deflection(cells: _Cells, pressure: FloatArray, moved: FloatArray) -> None:
    """Displacements under pressures."""
    force = np.empty(cells.coupling.shape[0])
    for k in range(cells.grids.size):
        grid = cells.grids[k]
        nx, ny, first = grid["nx"], grid["ny"], grid["first"]
        part = slice(first, first + nx * ny)
        field, factor = pressure[part].reshape(nx, ny), cells.factor[part].reshape(nx, ny)
        along, across = _wave_tables(cells, grid)
        waves = waves_of(field, along, across)
        for p in range(2):
            for q in range(2):
                waves[p, q] *= factor
        field_of(waves, along, across, moved[part].reshape(nx, ny))
        if force.size > 0:
            along, across = _node_tables(cells, grid)
            here = force[k * NODES * NODES : (k + 1) * NODES * NODES].reshape(NODES, NODES)
            here[:] = grid["area"] * np.dot(along.T, np.dot(field, across))
    if force.size > 0:
        depth = np.empty(force.size)
        for i in range(force.size):
            depth[i] = scalar_product(cells.coupling[i], force)
        for k in range(cells.grids.size):
            grid = cells.grids[k]
            along, across = _node_tables(cells, grid)
            here = depth[k * NODES * NODES : (k + 1) * NODES * NODES].reshape(NODES, NODES)
            field = moved[grid["first"] : grid["first"] + grid["nx"] * grid["ny"]].reshape(
                grid["nx"], grid["ny"]
            )
            field += np.dot(along, np.dot(here, across.T))


@kernel
def _wave_tables(cells: _Cells, grid: NDArray[np.void]) -> tuple[FloatArray, FloatArray]:
    sizes = 4 * grid["nx"] * ((grid["nx"] + 1) // 2), 4 * grid["ny"] * ((grid["ny"] + 1) // 2)
    along = cells.tables[grid["along"] : grid["along"] + sizes[0]]
    return along, cells.tables[grid["across"] : grid["across"] + sizes[1]]


@kernel
def _node_tables(cells: _Cells, grid: NDArray[np.void]) -> tuple[FloatArray, FloatArray]:
    along = cells.tables[grid["node_x"] : grid["node_x"] + grid["nx"] * NODES].reshape(grid["nx"], NODES)
    return along, cells.tables[grid["node_y"] : grid["node_y"] + grid["ny"] * NODES].reshape(
        grid["ny"], NODES
    )


@kernel
def _iterate(
    cells: _Cells, load: float, tolerance: float, limit: int, pressure: FloatArray
) -> tuple[float, int, bool]:
    """Conjugate gradients from `pressure`, which it scales to the load and brings to the solution."""
    height, area, cosine = cells.height, cells.area, cells.cosine
    size = height.size
    residual, direction, beyond = np.empty(size), np.zeros(size), np.empty(size)
    moved, image = np.empty(size), np.empty(size)
    carried = 0.0
    for i in range(size):
        carried += area[i] * cosine[i] * pressure[i]
    for i in range(size):
        pressure[i] *= load / carried
    _deflection(cells, pressure, moved)
    last, restart, displacement, count, converged = 1.0, True, 0.0, 0, False
    while count < limit and not converged:
        count += 1
        displacement, norm = _residual(cells, moved, pressure, residual)
        share = 0.0 if restart else norm / last
        for i in range(size):
            direction[i] = residual[i] + share * direction[i] if pressure[i] > 0.0 else 0.0
        last = norm
        _deflection(cells, direction, image)
        # Length of the step, at a constant mean displacement.
        above, below, whole, weight, part = 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(size):
            if pressure[i] > 0.0:
                above += area[i] * residual[i] * direction[i]
                below += area[i] * image[i] * direction[i]
                whole += area[i] * cosine[i] * image[i]
                weight += area[i] * cosine[i] * cosine[i]
                part += area[i] * cosine[i] * direction[i]
        below -= whole / weight * part
        step = above / below if below > 0.0 else 0.0
        # Move; `beyond` is what cells that leave or enter move otherwise than along the direction.
        others, restart, carried, change = 0, False, 0.0, 0.0
        for i in range(size):
            old, new, extra = pressure[i], 0.0, 0.0
            if old > 0.0:
                new = old - step * direction[i]
                if new <= 0.0:
                    extra, new = -new, 0.0
                    others += 1
            elif residual[i] < 0.0:
                new = extra = -step * residual[i]
                restart = True
                others += 1
            pressure[i], beyond[i] = new, extra
            carried += area[i] * cosine[i] * new
            change += area[i] * cosine[i] * abs(new - old)
        scale = load / carried
        for i in range(size):
            pressure[i] *= scale
        if others > (_FEW if cells.grids.size == 1 else 0):
            _deflection(cells, pressure, moved)
        else:
            for i in range(size):
                moved[i] -= step * image[i]
            if others > 0:
                _add(beyond, cells.influence.reshape(cells.grids[0]["nx"], cells.grids[0]["ny"]), moved)
            for i in range(size):
                moved[i] *= scale
        converged = (change / load + abs(scale - 1.0)) < tolerance and not restart
    # The heights that the last pressures leave.
    displacement, _ = _residual(cells, moved, pressure, residual)
    return displacement, count, converged


@kernel
def _residual(
    cells: _Cells, moved: FloatArray, pressure: FloatArray, residual: FloatArray
) -> tuple[float, float]:
    """Fill `residual` with the gap that is left; return the displacement and the square over loaded cells."""
    height, area, cosine = cells.height, cells.area, cells.cosine
    above, below = 0.0, 0.0
    for i in range(height.size):
        if pressure[i] > 0.0:
            above += area[i] * cosine[i] * (height[i] + moved[i])
            below += area[i] * cosine[i] * cosine[i]
    displacement = above / below
    norm = 0.0
    for i in range(height.size):
        left = height[i] + moved[i] - displacement * cosine[i]
        residual[i] = left
        if pressure[i] > 0.0:
            norm += area[i] * left * left
    return displacement, norm


@kernel
def _add(pressure: FloatArray, influence: FloatArray, moved: FloatArray) -> None:
    """Add the displacement under a few pressures on one grid."""
    nx, ny = influence.shape
    for k in range(pressure.size):
        if pressure[k] != 0.0:
            row, column = k // ny, k % ny
            for i in range(nx):
                away = abs(i - row)
                for j in range(column):
                    moved[i * ny + j] += pressure[k] * influence[away, column - j]
                for j in range(column, ny):
                    moved[i * ny + j] += pressure[k] * influence[away, j - column]
