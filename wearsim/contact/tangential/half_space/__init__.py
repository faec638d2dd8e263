r"""Steady rolling on the elastic half-space: Cerruti's influence, Coulomb's bound.

The bound applies to each cell.

The reference for the faster models: no flexibilities, no equivalent ellipse, any
outline and pressure. Both bodies have the same elastic constants, so that tractions do
not change the normal problem.

Each cell carries a constant traction. The slip over V is
:math:`s = w + (u(x) - u(x + \Delta x))/\Delta x` with the difference u of surface
displacements, also ahead of the contact, where there is no traction. It belongs to the
upstream edge of the cell, half a cell ahead of the centre that represents the traction
[1]_, [2]_. The rigid slip :math:`w = (\xi_x - \varphi y, \xi_y + \varphi x)` is
evaluated a sixth of a cell ahead of the centre: under spin the error of the lateral
force has one sign at the centre and the other at the edge, and is nearly least at this
position. Errors of the forces are of first order in the cell length, as if the contact
extended half a cell farther at its trailing end. Agreement with the program CONTACT:
reports/half_space_fields.md.

Rows of cells that are strips of the normal model have the creepage of their own place
on the wheel: the rigid slip :math:`w = (\xi_x, \xi_y + \varphi x)` of a row is that of
its own rolling radius. Tractions act on each other in one plane.

References
----------
.. [1] J. J. Kalker, Three-dimensional elastic bodies in rolling contact, Kluwer 1990.
.. [2] E. A. H. Vollebregt, user guide of CONTACT, Vtech CMCC.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.kernel import kernel, plain
from wearsim.contact.patch import FloatArray, Patch, on_grid
from wearsim.contact.tangential.half_space import steady_rolling
from wearsim.contact.tangential.half_space.steady_rolling import (
    RollingSolution,
    SlipOperator,
)
from wearsim.contact.tangential.kalker import coefficients
from wearsim.contact.tangential.model import (
    StripMotion,
    TangentialModel,
    TangentialSolution,
    Wanted,
    unconverged,
)
from wearsim.errors import ContactError

PLACE = 1.0 / 6.0  # position of the rigid slip ahead of the cell's centre, in cells
_APPROACH = (0.1, 0.3, 0.6, 1.0)  # shares of the creepage if the direct solution fails


def solve(
    patch: Patch,
    creepage: FloatArray,
    friction: FloatArray,
    *,
    shear_modulus: float,
    poisson_ratio: float,
    fields: Wanted,
    strips: StripMotion | None = None,
) -> TangentialSolution:
    """Shear, slip and creep forces of each patch; contract in `tangential.model`.

    A cell that sticks has exactly zero slip, one that slips has slip opposed to the
    traction; the sliding of particles is that between the cell edges. Forces and moment
    are those of the tractions at the centres.
    """
    grid = on_grid(patch)
    count, nx, ny = grid.pressure.shape
    fault = ~(np.isfinite(creepage).all(axis=1) & np.isfinite(friction))
    if strips is not None:
        fault |= ~(
            np.isfinite(strips.creepage).all(axis=(1, 2))
            & np.isfinite(strips.friction).all(axis=1)
        )
    if fault.any():
        row = int(patch.row[np.argmax(fault)])
        raise ContactError("creepage and friction coefficient must be finite", row=row)
    force, slip_area = np.zeros((count, 3)), np.zeros(count)
    out = np.zeros((5, count, nx, ny))
    rows, coefficient = _of_rows(patch, creepage, friction, strips)
    of_rows = np.zeros((count, ny, 3))
    first = _first_guess(patch, shear_modulus, poisson_ratio)
    for m in range(count):
        box = _box(grid.pressure[m])
        cells, dx, dy = (
            out[(slice(None), m, *box)],
            float(grid.cell_length[m]),
            float(patch.width[m]),
        )
        cells[0] = pressure = np.ascontiguousarray(grid.pressure[m][box])
        x, y = (
            grid.x_lead[m] - dx * (np.arange(box[0].start, box[0].stop) + 0.5),
            plain(patch.y[m][box[1]]),
        )
        rigid, guess = np.empty((2, 2, *pressure.shape))
        moving, bound = plain(rows[m, box[1]]), coefficient[m, box[1]] * pressure
        if bound.any():
            operator = steady_rolling.slip_operator(
                bound.shape, dx, dy, shear_modulus, poisson_ratio
            )
            _rigid_slip(moving, x + PLACE * dx, pressure, rigid)
            _march(rigid[0], moving, x, plain(first[:, m]), bound, dx, guess)
            rolling = _rolled(operator, rigid, bound, guess, int(patch.row[m]))
            sums = of_rows[m, box[1]]
            slipping = _sum_up(
                rolling.traction,
                rolling.slip,
                rolling.slipping,
                x,
                y,
                cells,
                force[m],
                sums,
            )
            force[m] *= dx * dy
            sums *= dx * dy
        else:
            _rigid_slip(moving, x, pressure, rigid)
            cells[3:], slipping = rigid, int((rigid != 0.0).any(axis=0).sum())
        slip_area[m] = slipping * dx * dy
    lead, size = (
        np.repeat(part[:, None], ny, axis=1) for part in (grid.x_lead, grid.cell_length)
    )
    return TangentialSolution(
        force,
        slip_area,
        lead,
        size,
        out if fields else None,
        of_rows if strips is not None else None,
    )


def _of_rows(
    patch: Patch, creepage: FloatArray, friction: FloatArray, strips: StripMotion | None
) -> tuple[FloatArray, FloatArray]:
    """Creepage (m, ny, 3) and friction (m, ny) of rows of cells, at their centres."""
    if strips is not None:
        return strips.creepage, strips.friction
    rows = np.repeat(creepage[:, None], patch.y.shape[1], axis=1)
    rows[:, :, 0] -= creepage[:, 2, None] * patch.y
    return rows, np.repeat(friction[:, None], patch.y.shape[1], axis=1)


def _box(pressure: FloatArray) -> tuple[slice, slice]:
    """Range of rows and strips from the first to the last cell in contact."""
    loaded = pressure > 0.0
    along, across = (
        np.flatnonzero(loaded.any(axis=1)),
        np.flatnonzero(loaded.any(axis=0)),
    )
    return slice(int(along[0]), int(along[-1]) + 1), slice(
        int(across[0]), int(across[-1]) + 1
    )


@kernel
def _rigid_slip(
    creepage: FloatArray, x: FloatArray, pressure: FloatArray, slip: FloatArray
) -> None:
    """Fill the rigid slip (2, nx, ny) of rows (ny, 3), zero outside the contact."""
    for i in range(x.size):
        for j in range(len(creepage)):
            loaded = pressure[i, j] > 0.0
            slip[0, i, j] = creepage[j, 0] if loaded else 0.0
            slip[1, i, j] = creepage[j, 1] + creepage[j, 2] * x[i] if loaded else 0.0


def _first_guess(
    patch: Patch, shear_modulus: float, poisson_ratio: float
) -> FloatArray:
    """Flexibilities L1, L2, L3 (3, m) of simplified theory [m3/N].

    The ellipses have equal area and aspect ratio.
    """
    ratio = patch.length / patch.lateral_extent
    a = np.sqrt(patch.area / np.pi * ratio)
    c11, c22, c23, _ = coefficients(ratio, poisson_ratio)
    along, across = (
        8.0 * a / (3.0 * shear_modulus * c11),
        8.0 * a / (3.0 * shear_modulus * c22),
    )
    return np.array(
        [along, across, np.pi * a * np.sqrt(ratio) / (4.0 * shear_modulus * c23)]
    )


@kernel
def _march(
    slip_x: FloatArray,
    creepage: FloatArray,
    x: FloatArray,
    flexibility: FloatArray,
    bound: FloatArray,
    dx: float,
    traction: FloatArray,
) -> None:
    """Fill starting tractions (2, nx, ny) by simplified theory.

    They are computed from the leading end downstream.
    """
    for i in range(bound.shape[0]):
        for j in range(bound.shape[1]):
            across = (
                creepage[j, 1] / flexibility[1] + creepage[j, 2] / flexibility[2] * x[i]
            ) * dx
            t_x, t_y = -slip_x[i, j] * (dx / flexibility[0]), -across
            if i > 0:
                t_x += traction[0, i - 1, j]
                t_y += traction[1, i - 1, j]
            size = np.sqrt(t_x * t_x + t_y * t_y)
            share = bound[i, j] / size if size > bound[i, j] else 1.0
            traction[0, i, j], traction[1, i, j] = share * t_x, share * t_y


def _rolled(
    operator: SlipOperator,
    rigid_slip: FloatArray,
    bound: FloatArray,
    guess: FloatArray,
    row: int,
) -> RollingSolution:
    """Solution from a guess; if the iteration stalls, through smaller creepages."""
    tolerance = steady_rolling.TOLERANCE
    rule: dict[str, Any] = {
        "most_steps": steady_rolling.MOST_STEPS,
        "tolerance": tolerance,
    }
    rolling = steady_rolling.solve(operator, rigid_slip, bound, guess, **rule)
    if rolling.residual <= tolerance:
        return rolling
    best, done, guess = rolling.residual, 0.0, np.zeros_like(guess)
    for share in _APPROACH:
        if done > 0.0:
            guess = rolling.traction * (share / done)
        rolling = steady_rolling.solve(
            operator, share * rigid_slip, bound, guess, **rule
        )
        done = share
    if rolling.residual <= tolerance:
        return rolling
    raise unconverged(min(best, rolling.residual), tolerance, row)


@kernel
def _sum_up(
    traction: FloatArray,
    slip: FloatArray,
    slipping: NDArray[np.bool_],
    x: FloatArray,
    y: FloatArray,
    cells: FloatArray,
    force: FloatArray,
    rows: FloatArray,
) -> int:
    """Fill the cells (5, nx, ny) except the pressure, and sum tractions and moment.

    Return also the number of cells that slip. Moments of the rows (ny, 3) are about
    their own middles. The slip of whole cells, opposed to the traction, follows from
    that at their upstream edges.
    """
    # The sliding of particles is that of the trapezoidal rule from edge to edge: a cell
    # that slips has the mean of its edges, the first one behind a stretch of stick also
    # the half that the rule assigns to the last cell of stick; behind the last cell of
    # a strip the slip is extrapolated linearly.
    count, (nx, ny) = 0, slipping.shape
    for j in range(ny):
        # True if the cell ahead carries load, and if it slips
        follows, ahead_slips = (
            False,
            False,
        )
        for i in range(nx):
            t_x, t_y = traction[0, i, j], traction[1, i, j]
            force[0], force[1] = force[0] + t_x, force[1] + t_y
            force[2] += x[i] * t_y - y[j] * t_x
            rows[j, 0], rows[j, 1] = rows[j, 0] + t_x, rows[j, 1] + t_y
            rows[j, 2] += x[i] * t_y
            cells[1, i, j], cells[2, i, j] = t_x, t_y
            size = np.sqrt(t_x * t_x + t_y * t_y)
            if slipping[i, j] and size > 0.0:
                last = i == nx - 1 or not (
                    slipping[i + 1, j]
                    or traction[0, i + 1, j] != 0.0
                    or traction[1, i + 1, j] != 0.0
                )
                along = 0.0
                for c in range(2):
                    upstream, behind = slip[c, i, j], slip[c, i, j]
                    if not last:
                        behind = slip[c, i + 1, j]
                    elif follows:
                        behind = 2.0 * upstream - slip[c, i - 1, j]
                    mean = 0.5 * (upstream + behind) + (
                        0.5 * upstream if follows and not ahead_slips else 0.0
                    )
                    along += traction[c, i, j] / size * mean
                along = min(along, 0.0) / size
                cells[3, i, j], cells[4, i, j] = along * t_x, along * t_y
            count += slipping[i, j]
            follows, ahead_slips = slipping[i, j] or size > 0.0, slipping[i, j]
    return count


MODEL = TangentialModel(
    name="half_space",
    title="half-space",
    solve=solve,
    tolerance=1e-5,
    fewest=8,
    chunk=2,
    by_strips=True,
    on_rows=True,
)
