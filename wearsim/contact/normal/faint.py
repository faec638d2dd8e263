r"""Fading of faint patches from the contact of a wheel; the others carry their load.

Measured and worn profiles touch in slivers that carry next to nothing. The weight of a
patch follows from its share s of the sum of the normal forces of its wheel,

.. math:: w = t^2 (3 - 2 t), \qquad t = \operatorname{clip}(\lg(10 s / s_f), 0, 1)

with :math:`s_f` = `FAINT`: 1 from there on, 0 up to a tenth of it, once continuously
differentiable. Normal forces are multiplied by w and by the factor that keeps the load
of the wheel; patches are stretched to theirs by similarity. The wheel stays where it
is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from wearsim.contact.normal.model import FAINT, NormalSolution
from wearsim.contact.patch import FloatArray, PatchGrid


def weight_of(share: FloatArray) -> FloatArray:
    """Weight of patches by their share of the normal force of their wheel [-].

    Parameters
    ----------
    share : (m,) array
        [-].

    Returns
    -------
    (m,) array
        0 to 1 [-].
    """
    t = np.clip(1.0 + np.log10(np.maximum(share, 0.1 * FAINT) / FAINT), 0.0, 1.0)
    weight: FloatArray = t * t * (3.0 - 2.0 * t)
    return weight


def faded_loads(solution: NormalSolution, vertical: bool) -> FloatArray:
    """Load factors of patches after the faint ones of their wheels have faded.

    They are relative to the loads carried before.

    Parameters
    ----------
    solution : NormalSolution
        Of m patches.
    vertical : bool
        Whether the vertical load of each wheel is kept; else the sum of its normal
        forces.

    Returns
    -------
    (m,) array
        0 for patches to leave out; 1 for all patches of a wheel without faint ones [-].
    """
    row, force = solution.patch.row, solution.normal_force
    share = force / np.bincount(row, force)[row]
    if (share >= FAINT).all():
        return np.ones(row.size)
    weight = weight_of(share)
    load = force * np.cos(solution.contact_angle) if vertical else force
    kept: FloatArray = weight * (
        np.bincount(row, load)[row] / np.bincount(row, weight * load)[row]
    )
    return kept


def similar(solution: NormalSolution, ratio: FloatArray) -> NormalSolution:
    """Patches similar to those of a solution.

    Parameters
    ----------
    solution : NormalSolution
        Of m patches.
    ratio : (m,) array
        Of their loads to those of the solution [-].

    Returns
    -------
    NormalSolution
        Lengths and pressures are multiplied by the cube root of the ratio, depths by
        its square: exact for a quadratic gap. Patches of ratio 1 are the same to the
        last bit. The vertical displacement is that of the solution.
    """
    patch, s = solution.patch, np.cbrt(ratio)
    wide = s[:, None]
    grid, planes = patch.grid, patch.planes
    if grid is not None:
        pressure = wide[:, :, None] * grid.pressure
        grid = PatchGrid(s * grid.x_lead, s * grid.cell_length, pressure)
    if planes is not None:
        planes = planes.stretched(s, solution.centre_y)
    patch = replace(
        patch,
        y=wide * patch.y,
        width=s * patch.width,
        x_lead=wide * patch.x_lead,
        x_trail=wide * patch.x_trail,
        interpenetration=wide**2 * patch.interpenetration,
        grid=grid,
        planes=planes,
    )
    return replace(
        solution,
        patch=patch,
        approach=s**2 * solution.approach,
        normal_force=ratio * solution.normal_force,
        max_pressure=s * solution.max_pressure,
        edge_y=solution.edge_y
        + (wide - 1.0) * (solution.edge_y - solution.centre_y[:, None]),
    )
