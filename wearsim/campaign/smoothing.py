"""Smoothing of the wear increment, area kept."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solveh_banded

from wearsim.contact.patch import FloatArray

_MM = 1e-3


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
    Minimises :math:`\int (d - s)^2\,du + \lambda \int s''^2\,du`, transfer function
    :math:`1/(1 + \lambda q^4)`, so :math:`\lambda = (\Lambda/2\pi)^4` halves the amplitude at wavelength
    :math:`\Lambda`. The natural spline has knots at all vertices; it is found from its second
    derivatives, one symmetric pentadiagonal system for all rows [1]_, in millimetres for its condition.
    The small negative side lobes beside a worn band are cut off, then each row is scaled to its area.

    References
    ----------
    .. [1] C. H. Reinsch, Smoothing by spline functions, Numer. Math. 10 (1967) 177-183,
       doi:10.1007/BF02162161.
    """
    if wavelength == 0.0 or not depth.any():
        return depth.copy()
    penalty = (wavelength / _MM / (2.0 * np.pi)) ** 4
    gap = np.diff(arc) / _MM
    weight = length / _MM
    # Second-difference operator: column j of Q holds (low, mid, high) in rows j, j+1, j+2.
    low, high = 1.0 / gap[:-1], 1.0 / gap[1:]
    mid = -low - high
    inverse = penalty / weight
    m = gap.size - 1
    bands = np.zeros((3, m))  # upper form for solveh_banded: bands[2] is the diagonal
    bands[2] = (gap[:-1] + gap[1:]) / 3.0
    bands[2] += low**2 * inverse[:-2] + mid**2 * inverse[1:-1] + high**2 * inverse[2:]
    bands[1, 1:] = gap[1:-1] / 6.0
    bands[1, 1:] += mid[:-1] * low[1:] * inverse[1:-2] + high[:-1] * mid[1:] * inverse[2:-1]
    bands[0, 2:] = high[:-2] * low[2:] * inverse[2:-2]

    rows = depth.reshape(-1, depth.shape[-1])
    second = low * rows[:, :-2] + mid * rows[:, 1:-1] + high * rows[:, 2:]
    curvature = solveh_banded(bands, second.T, check_finite=False).T
    pull = np.zeros_like(rows)
    pull[:, :-2] += low * curvature
    pull[:, 1:-1] += mid * curvature
    pull[:, 2:] += high * curvature
    smoothed = np.maximum(rows - inverse * pull, 0.0)

    area = (rows * length).sum(axis=1)
    kept = (smoothed * length).sum(axis=1)
    scale = np.where(kept > 0.0, area / np.where(kept > 0.0, kept, 1.0), 0.0)
    result: FloatArray = (smoothed * scale[:, None]).reshape(depth.shape)
    return result
