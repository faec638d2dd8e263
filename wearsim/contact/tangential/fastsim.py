r"""FASTSIM on any outline, with three flexibilities and the elliptic traction bound.

Simplified theory: surface displacement is proportional to traction. From the leading
end of each strip the traction grows with the rigid slip and is cut back to the bound
:math:`\mu p`; where it is cut back the surfaces slip. Where nothing slips the tractions
are (38) of [3]_. Origin of the split into three flexibilities is the pressure-weighted
centre of the patch.

References
----------
.. [1] J. J. Kalker, Vehicle System Dynamics 11 (1982) 1-13,
       doi:10.1080/00423118208968684.
.. [2] J. Piotrowski, H. Chollet, Vehicle System Dynamics 43 (2005) 455-483,
   doi:10.1080/00423110500141144 (equivalent ellipse).
.. [3] B. Liu, S. Bruni, Urban Rail Transit 1 (2016) 215-226.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from wearsim.contact.kernel import kernel, leaf_kernel, plain
from wearsim.contact.patch import FloatArray, IntArray, Patch, load_factor
from wearsim.contact.tangential.kalker import KNOTS, interpolate, logarithms
from wearsim.contact.tangential.model import (
    StripMotion,
    TangentialModel,
    TangentialSolution,
    Wanted,
)

MOST_STRIPS = 512
# Distance of the rows in the kernel's buffer: the rows of 50 strips then do not share
# cache lines.
_ROW = MOST_STRIPS + 56


def flexibilities(
    patch: Patch, shear_modulus: float, poisson_ratio: float
) -> FloatArray:
    r"""Flexibilities L1, L2 and L3 of the equivalent ellipses of patches.

    Parameters
    ----------
    patch : Patch
        m patches.
    shear_modulus : float
        G of both bodies [Pa].
    poisson_ratio : float
        Of both bodies [-].

    Returns
    -------
    (3, m) array
        [m3/N].

    Notes
    -----
    :math:`L_1 = 8a/(3 G C_{11})`, :math:`L_2 = 8a/(3 G C_{22})`,
    :math:`L_3 = \pi a\sqrt{a/b}/(4 G C_{23})` with an ellipse of the same area and the
    same ratio of length to width as the patch [1]_, [2]_.

    References
    ----------
    .. [1] J. J. Kalker, Vehicle System Dynamics 11 (1982) 1-13,
           doi:10.1080/00423118208968684.
    .. [2] J. Piotrowski, H. Chollet, Vehicle System Dynamics 43 (2005) 455-483,
       doi:10.1080/00423110500141144.
    """
    work, result = np.empty((6, patch.width.size)), np.empty((3, patch.width.size))
    _of_ellipses(
        plain(patch.x_lead),
        plain(patch.x_trail),
        plain(patch.width),
        plain(patch.strips, np.int64),
        float(shear_modulus),
        KNOTS,
        logarithms(poisson_ratio),
        work[0],
        work[1],
        work[2:],
        result,
    )
    return result


@kernel
def _of_ellipses(
    x_lead: FloatArray,
    x_trail: FloatArray,
    width: FloatArray,
    strips: IntArray,
    modulus: float,
    knots: FloatArray,
    table: FloatArray,
    a: FloatArray,
    ratio: FloatArray,
    c: FloatArray,
    out: FloatArray,
) -> None:
    """Semi-axis a of the equivalent ellipse of each patch, and its ratio to b.

    Coefficients and flexibilities are also returned. Padding is omitted.
    """
    for m in range(strips.size):
        total, longest = 0.0, 0.0
        for j in range(strips[m]):
            length = x_lead[m, j] - x_trail[m, j]
            total += length
            longest = max(longest, length)
        ratio[m] = longest / (width[m] * strips[m])
        a[m] = np.sqrt(total * width[m] / np.pi * ratio[m])
    interpolate(ratio, knots, table, c)
    for m in range(a.size):
        out[0, m] = 8.0 * a[m] / (3.0 * modulus * c[0, m])
        out[1, m] = 8.0 * a[m] / (3.0 * modulus * c[1, m])
        out[2, m] = np.pi * a[m] * np.sqrt(ratio[m]) / (4.0 * modulus * c[2, m])


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

    Tractions are known at the cell ends and averaged over the cell; so is the traction
    that the slip is multiplied with, which makes the balance of power exact on any grid
    for a single flexibility.
    """
    flexibility = flexibilities(patch, shear_modulus, poisson_ratio)
    count, ny = patch.y.shape
    kinds = 1 if fields == "work" else 5
    out = np.empty(
        (kinds, count, patch.cells.max(initial=1), ny) if fields else (5, 0, 0, 0)
    )
    force, slip_area = np.zeros((count, 3)), np.zeros(count)
    slope = (
        patch.pressure_slope
        * _load_factors(int(patch.cells.max(initial=2)))[patch.cells][:, None]
    )
    creepage, mean = plain(creepage), np.empty(count)
    _average(creepage, flexibility, mean)
    _march(
        plain(patch.y),
        plain(patch.width),
        plain(patch.x_lead),
        plain(patch.x_trail),
        plain(friction),
        plain(slope),
        creepage,
        flexibility,
        mean,
        plain(patch.strips, np.int64),
        plain(patch.cells, np.int64),
        bool(fields),
        rows_for_march(),
        out,
        force,
        slip_area,
    )
    length = (patch.x_lead - patch.x_trail) / patch.cells[:, None]
    return TangentialSolution(
        force, slip_area, patch.x_lead, length, out if fields else None
    )


def rows_for_march() -> FloatArray:
    """Buffer of the kernel, aligned to 64 bytes.

    Without alignment vector instructions take a tenth longer.
    """
    buffer = np.empty(15 * _ROW + 7)
    first = -buffer.__array_interface__["data"][0] // 8 % 8
    return buffer[first : first + 15 * _ROW]


@lru_cache(maxsize=16)
def _load_factors(most: int) -> FloatArray:
    """Load factors (most + 1,) by the number of cells.

    One cell has no pressure between its ends.
    """
    return np.array([0.0, 0.0, *map(load_factor, range(2, most + 1))])


@kernel
def _average(creepage: FloatArray, flexibility: FloatArray, mean: FloatArray) -> None:
    """Flexibility (m,) that converts excess traction to slip of its direction.

    It is the mean of both directions, weighted by creepage.
    """
    for m in range(mean.size):
        # Spin alone: unweighted mean.
        along, across = abs(creepage[m, 0]) + 1e-12, abs(creepage[m, 1]) + 1e-12
        mean[m] = (along * flexibility[0, m] + across * flexibility[1, m]) / (
            along + across
        )


@leaf_kernel
def _march(
    y: FloatArray,
    width: FloatArray,
    x_lead: FloatArray,
    x_trail: FloatArray,
    friction: FloatArray,
    slope: FloatArray,
    creepage: FloatArray,
    flexibility: FloatArray,
    mean: FloatArray,
    strip_count: IntArray,
    cell_count: IntArray,
    keep: bool,
    rows: FloatArray,
    out: FloatArray,
    force: FloatArray,
    slip_area: FloatArray,
) -> None:
    """March from the leading to the trailing end, all strips of a patch side by side.

    All operands of the inner loop lie in `rows`, one buffer of rows a constant number
    of places apart: only then does the compiler see that rows do not overlap, and uses
    vector instructions. Tractions there are over the largest bound of their strip, and
    strips are filled up to a multiple of eight. Rows: 0 to 2 what rigid slip adds to
    the traction over a cell (longitudinal; lateral at the middle; lateral per place), 3
    and 4 traction at the upstream cell end, 5 to 8 sums along the strip (both
    tractions, moment of the lateral one, cells that slip), 9 the flexibility over the
    cell length, 10 to 13 the means of traction and slip in the cell, 14 the largest
    bound. One field in `out` is the frictional work, five are pressure, traction and
    slip.
    """
    whole = out.shape[0] > 1
    for m in range(y.shape[0]):
        strips, cells = strip_count[m], cell_count[m]
        filled = (strips + 7) // 8 * 8
        rate_x = creepage[m, 0] / flexibility[0, m]
        rate_y = creepage[m, 1] / flexibility[1, m]
        rate_s = creepage[m, 2] / flexibility[2, m]
        flex = mean[m] * 0.5 * cells
        for k in range(15):
            for j in range(filled):
                rows[k * _ROW + j] = 0.0
        for j in range(strips):
            half, middle = (
                0.5 * (x_lead[m, j] - x_trail[m, j]),
                0.5 * (x_lead[m, j] + x_trail[m, j]),
            )
            largest = slope[m, j] * half
            if largest > 0.0:
                per_cell = half * (2.0 / cells) / largest
                rows[j] = (rate_x - rate_s * y[m, j]) * per_cell
                rows[_ROW + j] = (rate_y + rate_s * middle) * per_cell
                rows[2 * _ROW + j] = rate_s * half * per_cell
                rows[9 * _ROW + j] = flex / half * largest
                rows[14 * _ROW + j] = largest
        root_before = 0.0
        for i in range(cells):
            # Middle and downstream end of this cell, in half lengths from the middle of
            # the strip.
            place, behind = 1.0 - (2.0 * i + 1.0) / cells, 1.0 - 2.0 * (i + 1) / cells
            # Exactly zero at the trailing end: the root of a rounding error would be
            # 1e-8.
            root = np.sqrt(max(1.0 - behind * behind, 0.0)) if i < cells - 1 else 0.0
            limit, mean_root = friction[m] * root, 0.5 * (root_before + root)
            root_before = root
            for j in range(filled):
                old_x, old_y = rows[3 * _ROW + j], rows[4 * _ROW + j]
                trial_x = old_x - rows[j]
                trial_y = old_y - (rows[_ROW + j] + place * rows[2 * _ROW + j])
                size = np.sqrt(trial_x * trial_x + trial_y * trial_y)
                share = limit / size if size > limit else 1.0
                new_x, new_y = trial_x * share, trial_y * share
                rows[3 * _ROW + j] = new_x
                rows[4 * _ROW + j] = new_y
                rows[5 * _ROW + j] += new_x
                rows[6 * _ROW + j] += new_y
                rows[7 * _ROW + j] += behind * new_y
                rows[8 * _ROW + j] += 1.0 if size > limit else 0.0
                if keep:
                    largest, excess = (
                        0.5 * rows[14 * _ROW + j],
                        (share - 1.0) * rows[9 * _ROW + j],
                    )
                    rows[10 * _ROW + j] = (old_x + new_x) * largest
                    rows[11 * _ROW + j] = (old_y + new_y) * largest
                    rows[12 * _ROW + j] = trial_x * excess
                    rows[13 * _ROW + j] = trial_y * excess
            if keep and whole:
                for j in range(strips):
                    out[0, m, i, j] = mean_root * rows[14 * _ROW + j]
                for k in range(1, 5):
                    for j in range(strips):
                        out[k, m, i, j] = rows[(9 + k) * _ROW + j]
            elif keep:
                for j in range(strips):
                    out[0, m, i, j] = -(
                        rows[10 * _ROW + j] * rows[12 * _ROW + j]
                        + rows[11 * _ROW + j] * rows[13 * _ROW + j]
                    )
        if keep:  # exclude padding
            out[:, m, cells:] = 0.0
            out[:, m, :cells, strips:] = 0.0
        f_x, f_y, moment, slipping = 0.0, 0.0, 0.0, 0.0
        for j in range(
            strips
        ):  # traction is zero at both ends of a strip: its sum is that of the means
            half, middle = (
                0.5 * (x_lead[m, j] - x_trail[m, j]),
                0.5 * (x_lead[m, j] + x_trail[m, j]),
            )
            area = half * (2.0 / cells) * width[m]
            bound = rows[14 * _ROW + j] * area
            f_x += rows[5 * _ROW + j] * bound
            f_y += rows[6 * _ROW + j] * bound
            arm = middle * rows[6 * _ROW + j] + half * rows[7 * _ROW + j]
            moment += (arm - y[m, j] * rows[5 * _ROW + j]) * bound
            slipping += rows[8 * _ROW + j] * area
        force[m, 0], force[m, 1], force[m, 2], slip_area[m] = f_x, f_y, moment, slipping


MODEL = TangentialModel(
    name="fastsim",
    title="FASTSIM",
    solve=solve,
    fewest=2,
    most_strips=MOST_STRIPS,
    bounded_slip=False,
)
