r"""Pressure of elastic half-spaces under a rigid displacement, by conjugate gradients on several grids.

On each grid the height h of the gap, the surface displacement u and the vertical displacement D of the wheel
leave

.. math:: g = h + u - D c \ge 0, \qquad p \ge 0, \qquad g p = 0, \qquad \sum A c p = N,

with the cell area A and the cosine c of the contact angle, so that N is vertical. The iteration of Polonsky
and Keer [1]_: conjugate gradients on the cells that carry pressure, whose mean residual gives D; cells with
tension leave, cells that overlap enter, the load is restored by scaling. Each iteration costs one product
with the influence, n log n; what the few cells that enter or leave add is summed up cell by cell, and only
where they are many takes a second product.

References
----------
.. [1] I. A. Polonsky, L. M. Keer, Wear 231 (1999) 206-219, doi:10.1016/S0043-1648(99)00113-1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from wearsim.contact.influence import grid_influence, normal_influence
from wearsim.contact.kernel import kernel
from wearsim.contact.patch import FloatArray

TOLERANCE = 3e-5  # the maximum pressure then is within 1e-4 of its limit
MOST_ITERATIONS = 1000
_FEW = 64  # cells whose influence is summed up rather than transformed: less work on any grid


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


Coupling = Callable[[list[FloatArray], list[FloatArray]], None]
"""Adds to displacements (second) what pressures (first) of the other grids cause, in place."""


def solve_pressure(
    grids: Sequence[HeightGrid],
    load: float,
    effective_modulus: float,
    *,
    coupling: Coupling | None = None,
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
    coupling : callable, optional
        Displacement of the grids by the pressures of each other; must be self-adjoint in the cell area.
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
    tables = [
        normal_influence(grid.cell_length, grid.cell_width, grid.height.shape, effective_modulus)
        for grid in grids
    ]
    influences = [grid_influence(table, (table.shape[0], table.shape[1])) for table in tables]
    ends = np.cumsum([0] + [grid.height.size for grid in grids])
    shapes = [grid.height.shape for grid in grids]
    parts = [slice(a, b) for a, b in pairwise(ends)]
    height = np.concatenate([grid.height.ravel() for grid in grids])
    area, cosine = np.empty(height.size), np.empty(height.size)
    for part, grid in zip(parts, grids, strict=True):
        area[part], cosine[part] = grid.cell_length * grid.cell_width, grid.cosine

    def deflection(pressure: FloatArray) -> FloatArray:
        fields = [pressure[part].reshape(shape) for part, shape in zip(parts, shapes, strict=True)]
        moved = [influence(field) for influence, field in zip(influences, fields, strict=True)]
        if coupling is not None:
            moved = [np.ascontiguousarray(field) for field in moved]
            coupling(fields, moved)
        return np.concatenate([field.ravel() for field in moved])

    if start is None:
        # Half the overlap of a first guess, as in virtual penetration.
        depth = np.maximum(_overlap(height, area, cosine, load, effective_modulus) * cosine - height, 0.0)
        pressure = np.sqrt(depth)
    else:
        pressure = np.concatenate([field.ravel() for field in start])
    pressure *= load / (area * cosine * pressure).sum()
    moved = deflection(pressure)
    direction, residual = np.zeros_like(pressure), np.empty_like(pressure)
    beyond = np.empty_like(pressure)
    last, restart, displacement, count, converged = 1.0, True, 0.0, 0, False
    while count < limit and not converged:
        count += 1
        displacement, norm = _residual(height, moved, pressure, area, cosine, residual)
        _turn(residual, pressure, 0.0 if restart else norm / last, direction)
        last = norm
        image = deflection(direction)
        step = _step(residual, direction, image, pressure, area, cosine)
        others, restart, carried, change = _advance(step, residual, direction, pressure, area, cosine, beyond)
        scale = load / carried
        pressure *= scale
        if others > (_FEW if len(grids) == 1 else 0):
            moved = deflection(pressure)
        else:
            _follow(moved, step, image, scale, beyond, others, tables[0])
        converged = (change / load + abs(scale - 1.0)) < tolerance and not restart
    # The heights that the last pressures leave.
    displacement, _ = _residual(height, moved, pressure, area, cosine, residual)
    fields = tuple(pressure[part].reshape(shape) for part, shape in zip(parts, shapes, strict=True))
    return GridPressure(fields, displacement, count, converged)


def _overlap(height: FloatArray, area: FloatArray, cosine: FloatArray, load: float, modulus: float) -> float:
    """Rough virtual penetration: the overlap region's size squared times its depth carries the load."""
    depth = height / cosine
    first = float(depth.min())
    low, high = first, first + 16.0 * float((load / modulus) ** (2.0 / 3.0))
    for _ in range(30):
        level = 0.5 * (low + high)
        region = float(area[depth < level].sum())
        # N = pi/2 E* b delta for a circle; the region of half the approach is the contact itself
        if 2.0 * modulus * np.sqrt(region) * (level - first) < load:
            low = level
        else:
            high = level
    return high


@kernel
def _residual(
    height: FloatArray,
    moved: FloatArray,
    pressure: FloatArray,
    area: FloatArray,
    cosine: FloatArray,
    residual: FloatArray,
) -> tuple[float, float]:
    """Fill `residual` with the gap that is left; return the displacement and the square over loaded cells."""
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
def _turn(residual: FloatArray, pressure: FloatArray, share: float, direction: FloatArray) -> None:
    """Next conjugate direction, on loaded cells only."""
    for i in range(residual.size):
        direction[i] = residual[i] + share * direction[i] if pressure[i] > 0.0 else 0.0


@kernel
def _step(
    residual: FloatArray,
    direction: FloatArray,
    image: FloatArray,
    pressure: FloatArray,
    area: FloatArray,
    cosine: FloatArray,
) -> float:
    """Length of the step along the direction, at a constant mean displacement."""
    above, below = 0.0, 0.0
    for i in range(residual.size):
        if pressure[i] > 0.0:
            above += area[i] * cosine[i] * image[i]
            below += area[i] * cosine[i] * cosine[i]
    mean = above / below
    above, below = 0.0, 0.0
    for i in range(residual.size):
        if pressure[i] > 0.0:
            above += area[i] * residual[i] * direction[i]
            below += area[i] * (image[i] - mean * cosine[i]) * direction[i]
    return above / below if below > 0.0 else 0.0


@kernel
def _advance(
    step: float,
    residual: FloatArray,
    direction: FloatArray,
    pressure: FloatArray,
    area: FloatArray,
    cosine: FloatArray,
    beyond: FloatArray,
) -> tuple[int, bool, float, float]:
    """Move the pressures.

    Returns how many cells left or entered, whether any entered, the load carried and the change of it;
    `beyond` is what such cells moved otherwise than along the direction, zero for all others.
    """
    others, entered, carried, change = 0, False, 0.0, 0.0
    for i in range(residual.size):
        old = pressure[i]
        new, beyond[i] = 0.0, 0.0
        if old > 0.0:
            new = old - step * direction[i]
            if new <= 0.0:
                beyond[i] = -new
                new, others = 0.0, others + 1
        elif residual[i] < 0.0:
            new, entered = -step * residual[i], True
            beyond[i] = new
            others += 1
        pressure[i] = new
        carried += area[i] * cosine[i] * new
        change += area[i] * cosine[i] * abs(new - old)
    return others, entered, carried, change


@kernel
def _follow(
    moved: FloatArray,
    step: float,
    image: FloatArray,
    scale: float,
    beyond: FloatArray,
    others: int,
    table: FloatArray,
) -> None:
    """Displacement after a step; `table` is the influence on one grid of the cells that left or entered."""
    for i in range(moved.size):
        moved[i] -= step * image[i]
    if others > 0:
        nx, ny = table.shape
        for k in range(beyond.size):
            if beyond[k] != 0.0:
                row, column = k // ny, k % ny
                for i in range(nx):
                    away = abs(i - row)
                    for j in range(column):
                        moved[i * ny + j] += beyond[k] * table[away, column - j]
                    for j in range(column, ny):
                        moved[i * ny + j] += beyond[k] * table[away, j - column]
    for i in range(moved.size):
        moved[i] *= scale
