"""Smoothing of the wear increment, area kept."""

from __future__ import annotations

import numpy as np

from wearsim.contact.patch import FloatArray
from wearsim.profile.shape import arc_length, vertex_lengths
from wearsim.profile.smoothing import smoothing_spline


def smooth(arc: FloatArray, depth: FloatArray, length: FloatArray, wavelength: float) -> FloatArray:
    r"""Cubic smoothing spline of a wear increment over arc length, its area kept.

    Parameters
    ----------
    arc : (n,) array
        Arc length at the vertices, strictly rising [m].
    depth : (..., n) array
        Wear depth, not negative [m]; each row is smoothed on its own.
    length : (n,) array
        Length of profile each vertex stands for [m].
    wavelength : float
        Wavelength whose amplitude is halved [m]; 0 returns `depth` as it is.

    Returns
    -------
    (..., n) array
        Smoothed depth, nowhere negative, with the same sum(depth * length) in each row [m].

    Notes
    -----
    `wearsim.profile.smoothing.smoothing_spline`: the amplitude at wavelength :math:`\Lambda` is halved.
    The small negative side lobes beside a worn band are cut off, then each row is scaled to its area.
    """
    if wavelength == 0.0 or not depth.any():
        return depth.copy()
    rows = depth.reshape(-1, depth.shape[-1])
    smoothed = np.maximum(smoothing_spline(arc, rows, length, wavelength), 0.0)

    area = (rows * length).sum(axis=1)
    kept = (smoothed * length).sum(axis=1)
    scale = np.where(kept > 0.0, area / np.where(kept > 0.0, kept, 1.0), 0.0)
    result: FloatArray = (smoothed * scale[:, None]).reshape(depth.shape)
    return result


def smooth_sides(y: FloatArray, z: FloatArray, depth: FloatArray, wavelength: float) -> FloatArray:
    """Smooth a wear increment along the profiles of both sides.

    Parameters
    ----------
    y, z : (2, n) array
        Profiles of the right and left body [m].
    depth : (2, ..., n) array
        At their vertices, not negative [m].
    wavelength : float
        As for `smooth` [m].

    Returns
    -------
    (2, ..., n) array
        Smoothed depth [m].
    """
    return np.stack([
        smooth(arc_length(y[side], z[side]), depth[side], vertex_lengths(y[side], z[side]), wavelength)
        for side in (0, 1)
    ])  # fmt: skip
