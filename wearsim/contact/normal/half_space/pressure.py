r"""Pressure of elastic half-spaces on several grids, by conjugate gradients.

The wheel has a rigid displacement.

On each grid the height h of the gap, the surface displacement u and the vertical
displacement D of the wheel leave

.. math:: g = h + u - D c \ge 0, \qquad p \ge 0, \qquad g p = 0, \qquad \sum A c p = N,

with the cell area A and the cosine c of the contact angle, so that N is vertical. The
iteration of Polonsky and Keer [1]_: conjugate gradients on the cells that carry
pressure, whose mean residual gives D; cells with tension leave, cells that overlap
enter, the load is restored by scaling. Each iteration costs one product with the
influence; what the few cells that enter or leave add is summed up cell by cell, and
only where they are many takes a second product.

References
----------
.. [1] I. A. Polonsky, L. M. Keer, Wear 231 (1999) 206-219,
       doi:10.1016/S0043-1648(99)00113-1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from wearsim.contact.influence import (
    field_of,
    multiply,
    normal_influence,
    scalar_product,
    spectrum,
    wave_table,
    waves_of,
)
from wearsim.contact.kernel import inner_kernel, kernel
from wearsim.contact.patch import FloatArray, IntArray

TOLERANCE = 3e-5  # gives the maximum pressure within 1e-4 of its limit
MOST_ITERATIONS = 1000
# number of interpolation nodes between two grids, in each direction
NODES = 8
# Number of cells whose influence is summed directly, which is faster than transforms.
_FEW = 20


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
    """Pressures in equilibrium with the load.

    Parameters
    ----------
    pressure : tuple of (nx, ny) arrays
        One for each grid, mean of each cell [Pa].
    vertical_displacement : float
        D [m].
    iterations : int
        Of conjugate gradients.
    converged : bool
        True if the change fell below the tolerance before the iteration limit.
    """

    pressure: tuple[FloatArray, ...]
    vertical_displacement: float
    iterations: int
    converged: bool


class _Cells(NamedTuple):
    """Concatenated cells of all grids, and their tables."""

    first: IntArray  # first cell of each grid, and the total number
    shape: IntArray  # (k, 2) cells along and across
    height: FloatArray
    area: FloatArray
    cosine: FloatArray
    influence: FloatArray  # influence of the first cell of each grid
    factor: FloatArray  # transform of the influence
    # (k, 4, longest) waves along and across, interpolation along and across
    tables: FloatArray
    # (k 64, k 64) displacements at the nodes under forces on them, or empty
    coupling: FloatArray


@lru_cache(maxsize=512)
def interpolation(count: int) -> FloatArray:
    """Weights (n, NODES) of Chebyshev nodes at the cells of a row.

    The result is flat and includes the transposed weights.
    """
    nodes = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
    places = (np.arange(count) + 0.5) * (2.0 / count) - 1.0
    chebvander = np.polynomial.chebyshev.chebvander
    table = chebvander(places, NODES - 1) @ np.linalg.inv(chebvander(nodes, NODES - 1))
    return np.concatenate((table.ravel(), table.T.ravel()))


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
        Displacement at the 8 x 8 nodes of each of k grids under forces on those of all;
        symmetric [m/N].
    start : sequence of (nx, ny) arrays, optional
        Pressures to start from, such as those carried over from other grids; any load.
        The result depends on them within the tolerance.
    tolerance : float
        Largest change of the pressures in the last iteration, its mean as a share of
        their mean [-].
    limit : int
        Most iterations.

    Returns
    -------
    GridPressure
    """
    cells = _gathered(
        grids, effective_modulus, np.empty((0, 0)) if coupling is None else coupling
    )
    if start is None:
        pressure = _first_guess(cells, load, effective_modulus)
    else:
        pressure = np.concatenate([field.ravel() for field in start])
    result = _iterate(cells, float(load), tolerance, limit, pressure)
    parts = np.split(pressure, cells.first[1:-1])
    fields = (
        part.reshape(grid.height.shape) for part, grid in zip(parts, grids, strict=True)
    )
    return GridPressure(tuple(fields), *result)


def _gathered(
    grids: Sequence[HeightGrid], modulus: float, coupling: FloatArray
) -> _Cells:
    """Concatenate grids and the tables of their influence."""
    shape = np.array([grid.height.shape for grid in grids], dtype=np.int64)
    sizes = shape.prod(axis=1)
    needed = [
        (*map(wave_table, pair), *map(interpolation, pair)) for pair in shape.tolist()
    ]
    tables = np.zeros(
        (
            len(grids),
            4,
            max(table.size for grid_tables in needed for table in grid_tables),
        )
    )
    for k, grid_tables in enumerate(needed):
        for row, table in zip(tables[k], grid_tables, strict=True):
            row[: table.size] = table.ravel()
    influences = [
        normal_influence(grid.cell_length, grid.cell_width, grid.height.shape, modulus)
        for grid in grids
    ]
    return _Cells(
        np.append(0, np.cumsum(sizes)),
        shape,
        np.concatenate([grid.height.ravel() for grid in grids]),
        np.repeat([grid.cell_length * grid.cell_width for grid in grids], sizes),
        np.repeat([float(grid.cosine) for grid in grids], sizes),
        np.concatenate([table.ravel() for table in influences]),
        np.concatenate([spectrum(table).ravel() for table in influences]),
        tables,
        coupling,
    )


def _first_guess(cells: _Cells, load: float, modulus: float) -> FloatArray:
    """Approximate virtual penetration: area of overlap times depth carries the load."""
    first = low = float((cells.height / cells.cosine).min())
    high = first + 16.0 * (load / modulus) ** (2.0 / 3.0)
    for _ in range(12):
        level = 0.5 * (low + high)
        region = cells.area[cells.height < level * cells.cosine].sum()
        # N = pi/2 E* b delta for a circle; the region of half the approach is the
        # contact itself
        if 2.0 * modulus * np.sqrt(region) * (level - first) < load:
            low = level
        else:
            high = level
    return np.sqrt(np.maximum(high * cells.cosine - cells.height, 0.0))


@inner_kernel
def _deflection(cells: _Cells, pressure: FloatArray, moved: FloatArray) -> None:
    """Displacements under pressures."""
    count = cells.coupling.shape[0] // NODES**2
    force, depth = np.zeros((count, NODES, NODES)), np.empty((count, NODES, NODES))
    for k in range(len(cells.shape)):
        (nx, ny), first, behind = cells.shape[k], cells.first[k], cells.first[k + 1]
        along, across, field = (
            cells.tables[k, 0],
            cells.tables[k, 1],
            pressure[first:behind].reshape(nx, ny),
        )
        waves = waves_of(field, along, across)
        for p in range(2):
            for q in range(2):
                for i in range(nx):
                    for j in range(ny):
                        waves[p, q, i, j] *= cells.factor[first + i * ny + j]
        field_of(waves, along, across, moved[first:behind].reshape(nx, ny))
        if count > 0:
            half, to_x, of_y = (
                np.empty((nx, NODES)),
                cells.tables[k, 2, nx * NODES :],
                cells.tables[k, 3],
            )
            multiply(field, of_y[: ny * NODES].reshape(ny, NODES), half)
            multiply(to_x[: nx * NODES].reshape(NODES, nx), half, force[k])
    for i in range(force.size):
        force.reshape(-1)[i] *= cells.area[cells.first[i // NODES**2]]
    for i in range(force.size):
        depth.reshape(-1)[i] = scalar_product(cells.coupling[i], force.reshape(-1))
    for k in range(count):
        nx, ny = cells.shape[k]
        half, deep, to_y = (
            np.empty((NODES, ny)),
            np.empty((nx, ny)),
            cells.tables[k, 3, ny * NODES :],
        )
        multiply(depth[k], to_y[: ny * NODES].reshape(NODES, ny), half)
        multiply(cells.tables[k, 2, : nx * NODES].reshape(nx, NODES), half, deep)
        for i in range(deep.size):
            moved[cells.first[k] + i] += deep.reshape(-1)[i]


@kernel
def _iterate(
    cells: _Cells, load: float, tolerance: float, limit: int, pressure: FloatArray
) -> tuple[float, int, bool]:
    """Conjugate gradients from `pressure`, which is scaled to the load.

    `pressure` becomes the solution.
    """
    area, cosine, size = cells.area, cells.cosine, pressure.size
    residual, direction, beyond = np.empty(size), np.zeros(size), np.empty(size)
    moved, image = np.empty(size), np.empty(size)
    _carry(cells, load, pressure)
    _deflection(cells, pressure, moved)
    last, restart, count, converged = 1.0, True, 0, False
    while count < limit and not converged:
        count += 1
        _, norm = _residual(cells, moved, pressure, residual)
        for i in range(size):
            turned = 0.0 if restart else norm / last * direction[i]
            direction[i] = residual[i] + turned if pressure[i] > 0.0 else 0.0
        last = norm
        _deflection(cells, direction, image)
        # Step length at a constant mean displacement.
        lifted, whole, force, along, denominator = 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(size):
            if pressure[i] > 0.0:
                lift = area[i] * cosine[i]
                lifted, whole = lifted + lift * image[i], whole + lift * cosine[i]
                force, along = (
                    force + lift * direction[i],
                    along + area[i] * residual[i] * direction[i],
                )
                denominator += area[i] * image[i] * direction[i]
        denominator -= lifted / whole * force
        step = along / denominator if denominator > 0.0 else 0.0
        # Move; `beyond` is the movement of cells that enter or leave, apart from the
        # direction.
        restart, others, change = False, 0, 0.0
        for i in range(size):
            straight = new_pressure = pressure[i] - step * direction[i]
            if pressure[i] <= 0.0 and residual[i] < 0.0:
                restart, new_pressure = True, new_pressure - step * residual[i]
            new_pressure = max(new_pressure, 0.0)
            beyond[i] = new_pressure - straight
            others += beyond[i] != 0.0
            change += area[i] * cosine[i] * abs(new_pressure - pressure[i])
            pressure[i] = new_pressure
        scale = _carry(cells, load, pressure)
        if others > (_FEW if len(cells.shape) == 1 else 0):
            _deflection(cells, pressure, moved)
        else:
            for i in range(size):
                moved[i] -= step * image[i]
            if others > 0:
                _add(
                    beyond,
                    cells.influence.reshape(cells.shape[0, 0], cells.shape[0, 1]),
                    moved,
                )
            for i in range(size):
                moved[i] *= scale
        converged = (change / load + abs(scale - 1.0)) < tolerance and not restart
    # Heights under the last pressures.
    displacement, _ = _residual(cells, moved, pressure, residual)
    return displacement, count, converged


@inner_kernel
def _carry(cells: _Cells, load: float, pressure: FloatArray) -> float:
    """Scale pressures to the load; return the factor."""
    total = 0.0
    for i in range(pressure.size):
        total += cells.area[i] * cells.cosine[i] * pressure[i]
    scale = load / total
    for i in range(pressure.size):
        pressure[i] *= scale
    return scale


@kernel
def _residual(
    cells: _Cells, moved: FloatArray, pressure: FloatArray, residual: FloatArray
) -> tuple[float, float]:
    """Fill `residual` with the remaining gap.

    Return the displacement and the squared residual over loaded cells.
    """
    gap, whole, square = 0.0, 0.0, 0.0
    for i in range(residual.size):
        residual[i] = cells.height[i] + moved[i]
        if pressure[i] > 0.0:
            lift = cells.area[i] * cells.cosine[i]
            gap, whole = gap + lift * residual[i], whole + lift * cells.cosine[i]
    displacement = gap / whole
    for i in range(residual.size):
        residual[i] -= displacement * cells.cosine[i]
        if pressure[i] > 0.0:
            square += cells.area[i] * residual[i] * residual[i]
    return displacement, square


@inner_kernel
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
