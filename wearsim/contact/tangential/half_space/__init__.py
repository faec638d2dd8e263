r"""Steady rolling on the elastic half-space: Cerruti's influence, Coulomb's bound cell by cell.

The reference for the faster models: no flexibilities, no equivalent ellipse, any outline and pressure. Both
bodies have the same elastic constants, so that tractions do not change the normal problem.

Each cell carries a constant traction. The slip over V is :math:`s = w + (u(x) - u(x + \Delta x))/\Delta x`
with the difference u of surface displacements, also ahead of the contact, where no traction acts: it belongs
to the upstream edge of the cell, half a cell ahead of the centre that stands for the traction [1]_, [2]_. The
rigid slip :math:`w = (\xi_x - \varphi y, \xi_y + \varphi x)` is taken a sixth of a cell ahead of the
centre: under spin the lateral force errs in one direction with the centre and in the other with the edge,
and this place leaves about the least. Errors of the forces are of first order in the cell length, as if the
contact reached half a cell farther at its trailing end. Agreement with the program CONTACT:
reports/half_space_fields.md.

References
----------
.. [1] J. J. Kalker, Three-dimensional elastic bodies in rolling contact, Kluwer 1990.
.. [2] E. A. H. Vollebregt, user guide of CONTACT, Vtech CMCC.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.kernel import kernel
from wearsim.contact.patch import FloatArray, Patch, on_grid
from wearsim.contact.tangential.half_space import steady_rolling
from wearsim.contact.tangential.half_space.steady_rolling import RollingSolution, SlipOperator
from wearsim.contact.tangential.kalker import coefficients
from wearsim.contact.tangential.model import TangentialModel, TangentialSolution, Wanted
from wearsim.errors import ContactError, NumericalError

PLACE = 1.0 / 6.0  # of the rigid slip, ahead of the cell's centre, in cells
_APPROACH = (0.1, 0.3, 0.6, 1.0)  # shares of the creepage where the direct way fails


def solve(
    patch: Patch,
    creepage: FloatArray,
    friction: FloatArray,
    *,
    shear_modulus: float,
    poisson_ratio: float,
    fields: Wanted,
    start: TangentialSolution | None = None,
) -> TangentialSolution:
    """Shear, slip and creep forces of each patch; contract in `tangential.model`.

    A cell that sticks has exactly no slip, one that slips has it against the traction; what particles slide
    is that between the cell edges. Forces and moment are those of the tractions at the centres. A start has
    to have fields.
    """
    grid = on_grid(patch)
    count, nx, ny = grid.pressure.shape
    fault = ~(np.isfinite(creepage).all(axis=1) & np.isfinite(friction))
    if fault.any():
        raise ContactError(
            "creepage and friction coefficient must be finite", row=int(patch.row[np.argmax(fault)])
        )
    length, x = grid.cell_length, grid.x
    force, slip_area = np.zeros((count, 3)), np.zeros(count)
    out = np.zeros((5, count, nx, ny)) if fields else None
    known = None if start is None else start.cells
    warm = np.zeros(count, bool) if known is None else known[0].any(axis=(1, 2))
    first = np.empty((3, 0)) if warm.all() else _first_guess(patch, shear_modulus, poisson_ratio)
    for m in range(count):
        box = _box(grid.pressure[m])
        pressure = np.ascontiguousarray(grid.pressure[m][box])
        place_x, place_y = x[m][box[0]][:, None], patch.y[m][box[1]]
        dx, dy = float(length[m]), float(patch.width[m])
        bound = friction[m] * pressure
        if friction[m] > 0.0:
            operator = steady_rolling.slip_operator(
                (bound.shape[0], bound.shape[1]), dx, dy, shear_modulus, poisson_ratio
            )
            ahead = _rigid_slip(creepage[m], place_x + PLACE * dx, place_y, pressure)
            if known is not None and warm[m]:
                guess = _carried_over(known[:3, m][(slice(None), *box)], pressure)
            else:
                guess = _march(ahead, creepage[m], place_x[:, 0], first[:, m], bound, dx)
            rolling = _rolled(operator, ahead, bound, guess, int(patch.row[m]))
            traction, slipping = rolling.traction, rolling.slipping
            force[m, :2] = traction.sum(axis=(1, 2)) * (dx * dy)
            force[m, 2] = (place_x * traction[1] - place_y * traction[0]).sum() * (dx * dy)
            slip = _centred(rolling)
        else:
            slip = _rigid_slip(creepage[m], place_x, place_y, pressure)
            traction, slipping = np.zeros_like(slip), (slip != 0.0).any(axis=0)
        slip_area[m] = np.count_nonzero(slipping) * dx * dy
        if out is not None:
            out[(slice(None), m, *box)] = np.concatenate((pressure[None], traction, slip))
    lead, size = (np.repeat(part[:, None], ny, axis=1) for part in (grid.x_lead, length))
    return TangentialSolution(force, slip_area, lead, size, out)


def _box(pressure: FloatArray) -> tuple[slice, slice]:
    """Rows and strips from the first to the last cell in contact."""
    loaded = pressure > 0.0
    along, across = np.flatnonzero(loaded.any(axis=1)), np.flatnonzero(loaded.any(axis=0))
    return slice(int(along[0]), int(along[-1]) + 1), slice(int(across[0]), int(across[-1]) + 1)


def _rigid_slip(creepage: FloatArray, x: FloatArray, y: FloatArray, pressure: FloatArray) -> FloatArray:
    """Slip (2, nx, ny) without deformation, zero outside the contact."""
    slip = np.empty((2, *pressure.shape))
    slip[0] = creepage[0] - creepage[2] * y
    slip[1] = creepage[1] + creepage[2] * x
    slip[:, pressure <= 0.0] = 0.0
    return slip


def _first_guess(patch: Patch, shear_modulus: float, poisson_ratio: float) -> FloatArray:
    """Flexibilities L1, L2, L3 (3, m) [m3/N] of simplified theory, for ellipses of like area and sides."""
    ratio = patch.length / patch.lateral_extent
    a = np.sqrt(patch.area / np.pi * ratio)
    c11, c22, c23, _ = coefficients(ratio, poisson_ratio)
    along, across = 8.0 * a / (3.0 * shear_modulus * c11), 8.0 * a / (3.0 * shear_modulus * c22)
    return np.array([along, across, np.pi * a * np.sqrt(ratio) / (4.0 * shear_modulus * c23)])


def _march(
    rigid_slip: FloatArray,
    creepage: FloatArray,
    x: FloatArray,
    flexibility: FloatArray,
    bound: FloatArray,
    dx: float,
) -> FloatArray:
    """Tractions (2, nx, ny) of simplified theory: near enough to start from."""
    traction = np.empty_like(rigid_slip)
    along = rigid_slip[0] * (dx / flexibility[0])
    across = (creepage[1] / flexibility[1] + creepage[2] / flexibility[2] * x) * dx
    _cut_march(along, across, bound, traction)
    return traction


@kernel
def _cut_march(along: FloatArray, across: FloatArray, bound: FloatArray, traction: FloatArray) -> None:
    """From the leading end downstream, cut back to the bound."""
    for i in range(bound.shape[0]):
        for j in range(bound.shape[1]):
            t_x, t_y = -along[i, j], -across[i]
            if i > 0:
                t_x += traction[0, i - 1, j]
                t_y += traction[1, i - 1, j]
            size = np.sqrt(t_x * t_x + t_y * t_y)
            share = bound[i, j] / size if size > bound[i, j] else 1.0
            traction[0, i, j], traction[1, i, j] = share * t_x, share * t_y


def _carried_over(cells: FloatArray, pressure: FloatArray) -> FloatArray:
    """Tractions of a neighbouring state, in proportion to the pressure."""
    old = cells[0]
    share = np.divide(pressure, old, out=np.zeros_like(pressure), where=old > 0.0)
    traction: FloatArray = cells[1:] * share
    return traction


def _rolled(
    operator: SlipOperator, rigid_slip: FloatArray, bound: FloatArray, guess: FloatArray, row: int
) -> RollingSolution:
    """Solution from a guess; if the iteration stalls, by way of smaller creepages."""
    most = {"most_steps": steady_rolling.MOST_STEPS}
    rolling = steady_rolling.solve(operator, rigid_slip, bound, guess, **most)
    if rolling.residual <= steady_rolling.TOLERANCE:
        return rolling
    best, done, guess = rolling.residual, 0.0, np.zeros_like(guess)
    for share in _APPROACH:
        if done > 0.0:
            guess = rolling.traction * (share / done)
        rolling = steady_rolling.solve(operator, share * rigid_slip, bound, guess, **most)
        done = share
    if rolling.residual <= steady_rolling.TOLERANCE:
        return rolling
    raise NumericalError(
        f"steady rolling on the half-space did not converge: residual {min(best, rolling.residual):.1e} of "
        f"the tractions, allowed {steady_rolling.TOLERANCE:.0e}; try another number of cells, or fastsim",
        row=row,
    )


def _centred(rolling: RollingSolution) -> FloatArray:
    """Slip of whole cells, against the traction, from that at their upstream edges."""
    # Particles slide the same way as by the trapezoidal rule from edge to edge: a cell that slips has the
    # mean of its edges, the first behind a stretch of stick also the half that the rule gives the last cell
    # of stick, and behind the last cell of a strip the slip goes on in a straight line.
    slip, slipping = rolling.slip, rolling.slipping
    size = np.hypot(rolling.traction[0], rolling.traction[1])
    loaded = slipping | (size > 0.0)
    ahead, behind = np.zeros_like(slip), np.zeros_like(slip)
    ahead[:, 1:], behind[:, :-1] = slip[:, :-1], slip[:, 1:]
    follows, last = np.zeros_like(slipping), np.ones_like(slipping)
    follows[1:], last[:-1] = loaded[:-1], ~loaded[1:]
    behind = np.where(last, np.where(follows, 2.0 * slip - ahead, slip), behind)
    first = follows.copy()
    first[1:] &= ~slipping[:-1]
    mean = 0.5 * (slip + behind) + np.where(first, 0.5 * slip, 0.0)
    unit = np.divide(rolling.traction, size, out=np.zeros_like(slip), where=slipping & (size > 0.0))
    centred: FloatArray = np.minimum((unit * mean).sum(axis=0), 0.0) * unit
    return centred


MODEL = TangentialModel(name="half_space", solve=solve, tolerance=1e-5, warm=True, fewest=8, chunk=2)
