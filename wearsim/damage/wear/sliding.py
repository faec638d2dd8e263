"""Slip and distribution over strips, derived from the fields of a patch."""

from __future__ import annotations

import numpy as np

from wearsim.contact.patch import FloatArray, SurfaceFields


def relative_slip(fields: SurfaceFields) -> FloatArray:
    r"""Relative slip (m, nx, ny) that gives the frictional work of the fields [-].

    Notes
    -----
    Under spin, tangential models give slip whose work differs from that of the
    resultants; `work_density` is scaled to the latter, patch by patch. The slip here is
    scaled by the same factor, so that laws of sliding distance and laws of work see one
    slip: where Coulomb's bound is reached, :math:`\mu p |s|/V` is the work density.
    Without friction there is no work to compare; the slip then is that of the model.
    """
    size: FloatArray = np.sqrt(fields.slip_x**2 + fields.slip_y**2)
    unscaled = -(fields.shear_x * fields.slip_x + fields.shear_y * fields.slip_y)
    local = (unscaled.sum(axis=1) * fields.cell_length).sum(axis=1)
    work = fields.strip_work.sum(axis=1)
    # NaN compares false and is detected by the check of the depth
    scale = np.where(local <= 0.0, 1.0, work / np.where(local <= 0.0, 1.0, local))
    return size * scale[:, None, None]


def along_strips(density: FloatArray, fields: SurfaceFields) -> FloatArray:
    """Integrate cells along the rolling direction, (..., m, nx, ny) to (..., m, ny)."""
    return density.sum(axis=-2) * fields.cell_length


def patch_total(strips: FloatArray, fields: SurfaceFields) -> FloatArray:
    """Integrate strips across the patch, (..., m, ny) to (..., m)."""
    return strips.sum(axis=-1) * fields.strip_width


def mean_of(total: FloatArray, measure: FloatArray) -> FloatArray:
    """Return total over measure, zero where the measure is zero."""
    positive = measure > 0.0
    mean: FloatArray = np.where(positive, total / np.where(positive, measure, 1.0), 0.0)
    return np.where(np.isnan(measure), np.nan, mean)


def spread(total: FloatArray, strips: FloatArray, fields: SurfaceFields) -> FloatArray:
    """Distribute patch totals (..., m) over strips (..., m, ny).

    The distribution is proportional to `strips` (m, ny), which are never negative, and
    its integral over the width is the total. A patch whose `strips` are all zero gets
    zeros.
    """
    return total[..., None] * share_of(strips, fields)


def share_of(strips: FloatArray, fields: SurfaceFields) -> FloatArray:
    """Strip values (m, ny) divided by their integral across the patch [1/m].

    The result is zero where all values are zero.
    """
    return mean_of(strips, patch_total(strips, fields)[:, None])
