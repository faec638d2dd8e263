r"""Virtual penetration after Kik and Piotrowski, with the strip ends for rollers of Liu and Bruni.

The surfaces are pushed into each other by :math:`\varepsilon\delta`; where they intersect is the patch.
Pressure is semi-elliptic along each strip, :math:`p = c\sqrt{x_l(y)^2 - x^2}`, and the approach
:math:`\delta` follows from the half-space displacement at the point of first contact:

.. math:: N = \pi E^* \delta \frac{\iint\sqrt{x_l^2-x^2}\,dx\,dy}
          {\iint\sqrt{x_l^2-x^2}/\sqrt{x^2+y^2}\,dx\,dy}.

Rule for several patches: minima of the gap whose saddle lies inside the virtual penetration of the deeper
one form one patch; others are patches of their own that share the rigid vertical approach, less the
height at which they touch. Loads add up.

References
----------
.. [1] W. Kik, J. Piotrowski, 2nd Mini-Conference on Contact Mechanics and Wear, Budapest 1996.
.. [2] J. Piotrowski, W. Kik, Vehicle System Dynamics 46 (2008) 27-48.
.. [3] B. Liu, S. Bruni, Urban Rail Transit 1 (2016) 215-226, equations (1)-(7), sign of (4) corrected.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.geometry import Gap
from wearsim.contact.kernel import kernel
from wearsim.contact.normal.model import NormalSolution
from wearsim.contact.normal.refusal import MOST_PATCHES, raise_first
from wearsim.contact.normal.virtual_penetration import balance, cell_of, strip_half_length_squared
from wearsim.contact.patch import FloatArray, IntArray, Patch

DEFAULTS = {"virtual_penetration_factor": 0.55}


def solve(
    gap: Gap,
    load: FloatArray,
    *,
    vertical: bool,
    effective_modulus: float,
    strips: int,
    parameters: dict[str, float],
) -> NormalSolution:
    """Patches and pressures of every row.

    Parameters
    ----------
    gap : Gap
        n rows on a grid of g points.
    load : (n,) array
        Vertical load of the wheel, balanced by the vertical parts of the normal forces of all its
        patches, or (`vertical` false) the normal force of its only patch [N].
    vertical : bool
        Which of the two `load` is.
    effective_modulus : float
        E* = E / (2 (1 - nu^2)) of two equal bodies [Pa].
    strips : int
        Strips per patch.
    parameters : dict
        "virtual_penetration_factor": epsilon of [1]_, 0.55 by default.

    Returns
    -------
    NormalSolution
        The leading axis is the patch.

    Raises
    ------
    ContactError
        If a wheel does not touch, its patch reaches the edge of a profile, or `vertical` is false and
        several patches close.
    """
    rows = load.size
    factor = {**DEFAULTS, **parameters}["virtual_penetration_factor"]
    points = gap.contour.y.size
    count, fault = np.zeros(rows, np.int64), np.zeros(rows, np.int64)
    patches = np.zeros((rows, MOST_PATCHES, 13))
    balance(
        gap.contour.y,
        gap.contour.z,
        gap.contour.slope,
        gap.contour.angle,
        gap.gap,
        gap.wheel_radius,
        gap.curvature,
        load,
        vertical,
        factor,
        effective_modulus,
        np.empty((5, points)),
        count,
        fault,
        patches,
    )
    raise_first(fault)
    row = np.repeat(np.arange(rows), count)
    lines = patches[np.arange(MOST_PATCHES) < count[:, None]]
    y, half, skew, depth = (np.empty((row.size, strips)) for _ in range(4))
    edges = np.empty((row.size, strips + 1))
    centre, angle, maximum = (np.empty(row.size) for _ in range(3))
    slope = np.empty(row.size)
    _lay_strips(
        row,
        lines,
        gap.curvature,
        gap.contour.y,
        gap.contour.z,
        gap.contour.slope,
        gap.gap,
        gap.wheel_radius,
        gap.x,
        y,
        half,
        skew,
        depth,
        edges,
        centre,
        angle,
        maximum,
        slope,
    )
    patch = Patch(
        row=row,
        y=y,
        width=y[:, 1] - y[:, 0],
        x_lead=skew + half,
        x_trail=skew - half,
        pressure_slope=np.repeat(slope[:, None], strips, axis=1),
        interpenetration=depth,
    )
    return NormalSolution(
        patch=patch,
        centre_y=centre,
        contact_angle=angle,
        approach=lines[:, 4].copy(),
        normal_force=lines[:, 9].copy(),
        max_pressure=maximum,
        edge_y=edges,
        load_scale=lines[:, 11].copy(),
        descent=lines[:, 12].copy(),
    )


@kernel
def _lay_strips(
    rows: IntArray,
    lines: FloatArray,
    kappa: float,
    grid_y: FloatArray,
    grid_z: FloatArray,
    slope: FloatArray,
    gaps: FloatArray,
    radii: FloatArray,
    alongs: FloatArray,
    strip_y: FloatArray,
    strip_half: FloatArray,
    strip_skew: FloatArray,
    strip_depth: FloatArray,
    edges: FloatArray,
    centres: FloatArray,
    angles: FloatArray,
    maximum: FloatArray,
    pressure_slope: FloatArray,
) -> None:
    """Cut patches into strips of equal width in their contact planes and make the pressure fit the load."""
    strips = strip_y.shape[1]
    for m in range(rows.size):
        line = lines[m]
        gap, radius, along = gaps[rows[m]], radii[rows[m]], alongs[rows[m]]
        start, stop = int(line[0]), int(line[1])
        centre, delta, left, right, limit = line[2], line[3], line[6], line[7], line[10]
        force = line[9]
        cosine, sine = np.cos(delta), np.sin(delta)
        k = cell_of(grid_y, centre, start, stop)
        share = (centre - grid_y[k]) / (grid_y[k + 1] - grid_y[k])
        centre_z = grid_z[k] + share * (grid_z[k + 1] - grid_z[k])
        centre_x = along[k] + share * (along[k + 1] - along[k])
        width = (right - left) / strips
        i = start - 1
        s_here = (grid_y[i] - centre) * cosine + (grid_z[i] - centre_z) * sine
        s_next = (grid_y[i + 1] - centre) * cosine + (grid_z[i + 1] - centre_z) * sine
        volume, moment = 0.0, 0.0
        for j in range(2 * strips + 1):  # strip edges and centres in turn
            s = left + 0.5 * j * width
            while s > s_next and i < stop:
                i += 1
                s_here = s_next
                s_next = (grid_y[i + 1] - centre) * cosine + (grid_z[i + 1] - centre_z) * sine
            share = (s - s_here) / (s_next - s_here)
            if j % 2 == 0:
                edges[m, j // 2] = grid_y[i] + share * (grid_y[i + 1] - grid_y[i])
                continue
            here = gap[i] + share * (gap[i + 1] - gap[i])
            opening = (gap[i + 1] - gap[i]) / (grid_y[i + 1] - grid_y[i])
            gradient = slope[i] + share * (slope[i + 1] - slope[i]) - opening
            depth = max((limit - here) / (cosine + gradient * sine), 0.0)
            height = grid_z[i] + share * (grid_z[i + 1] - grid_z[i])
            ring = radius[i] + share * (radius[i + 1] - radius[i])
            half = strip_half_length_squared(depth, ring / cosine, kappa / (1.0 - kappa * height) * cosine)
            strip_y[m, j // 2] = s
            strip_half[m, j // 2] = np.sqrt(half)
            strip_skew[m, j // 2] = along[i] + share * (along[i + 1] - along[i]) - centre_x
            strip_depth[m, j // 2] = depth
            volume += half * width
            moment += half * width * s
        for j in range(strips):
            strip_y[m, j] -= moment / volume
        centres[m] = centre + moment / volume * cosine
        angles[m] = delta
        pressure_slope[m] = force / (0.5 * np.pi * volume)
        # The deepest point of the outline, not of a strip's centre.
        maximum[m] = force / (0.5 * np.pi * line[5]) * np.sqrt(line[8])
