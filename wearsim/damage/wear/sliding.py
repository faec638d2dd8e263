"""What wear laws take from the fields of a patch besides the frictional work."""

from __future__ import annotations

import numpy as np

from wearsim.contact.patch import FloatArray, SurfaceFields


def relative_slip(fields: SurfaceFields) -> FloatArray:
    r"""Magnitude of the slip over V that belongs to the frictional work of the fields.

    Parameters
    ----------
    fields : SurfaceFields
        On the cells of `m` patches.

    Returns
    -------
    (m, nx, ny) array
        |s|/V [-].

    Notes
    -----
    Under spin, tangential models give slip whose work differs from that of the resultants;
    `work_density` is scaled to the latter, patch by patch. The slip here is scaled by the same factor, so
    that laws of sliding distance and laws of work see one slip: where Coulomb's bound is reached,
    :math:`\mu p |s|/V` is the work density. Without friction there is no work to compare; the slip then
    is that of the model.
    """
    size: FloatArray = np.sqrt(fields.slip_x**2 + fields.slip_y**2)
    unscaled = -(fields.shear_x * fields.slip_x + fields.shear_y * fields.slip_y)
    local = (unscaled.sum(axis=1) * fields.cell_length).sum(axis=1)
    work = fields.strip_work.sum(axis=1)
    # NaN compares false, and so goes through to the check of the depth
    scale = np.where(local <= 0.0, 1.0, work / np.where(local <= 0.0, 1.0, local))
    return size * scale[:, None, None]


def along_strips(density: FloatArray, fields: SurfaceFields) -> FloatArray:
    """Integrate cells along the rolling direction.

    Parameters
    ----------
    density : (..., m, nx, ny) array
        Per length.
    fields : SurfaceFields
        On these cells.

    Returns
    -------
    (..., m, ny) array
        Integral over x of each strip.
    """
    total: FloatArray = density.sum(axis=-2) * fields.cell_length
    return total


def patch_total(strips: FloatArray, fields: SurfaceFields) -> FloatArray:
    """Integrate strips across the patch, (..., m, ny) to (..., m)."""
    total: FloatArray = strips.sum(axis=-1) * fields.strip_width
    return total


def mean_of(total: FloatArray, measure: FloatArray) -> FloatArray:
    """Return total over measure, zero where the measure is zero."""
    positive = measure > 0.0
    mean: FloatArray = np.where(positive, total / np.where(positive, measure, 1.0), 0.0)
    return np.where(np.isnan(measure), np.nan, mean)


def spread(total: FloatArray, strips: FloatArray, fields: SurfaceFields) -> FloatArray:
    """Spread a total over the strips of each patch in proportion to `strips`.

    Parameters
    ----------
    total : (..., m) array
        Of each patch.
    strips : (m, ny) array
        Never negative; a patch where they are all zero gets nothing.
    fields : SurfaceFields
        For the width of the strips.

    Returns
    -------
    (..., m, ny) array
        Whose integral over the width is the total.
    """
    share = mean_of(strips, patch_total(strips, fields)[:, None])
    return total[..., None] * share
