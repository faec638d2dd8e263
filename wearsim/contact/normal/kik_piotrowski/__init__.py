r"""Virtual penetration after Kik and Piotrowski, with the strip ends for rollers of Liu and Bruni.

The surfaces are pushed into each other by :math:`\varepsilon\delta`; where they intersect is the patch [1]_,
[2]_, with strip ends after (4)-(6) of [3]_. Pressure is semi-elliptic along each strip,
:math:`p = c\sqrt{x_l(y)^2 - x^2}`, (7) of [3]_, and the approach
:math:`\delta` follows from the half-space displacement at the point of first contact:

.. math:: N = \pi E^* \delta \frac{\iint\sqrt{x_l^2-x^2}\,dx\,dy}
          {\iint\sqrt{x_l^2-x^2}/\sqrt{x^2+y^2}\,dx\,dy}.

Yaw: at each lateral position both ends of the strip are those of the three-dimensional gap there, and the
displacement is that of strips which lie ahead of or behind the point.

Rule for several patches, continuous in every position and load. The gap flooded from below has basins; each
joins a deeper one over a saddle. The deepest basin k = 1 is filled up to the rim
:math:`r_1 = h_1 + \varepsilon\delta`. A basin of initial contact at :math:`h_k` that joins its deeper
neighbour j over a saddle of height H is separate by

.. math:: w = \frac{H - \max(h_k, r_j)}{\varepsilon\delta} \in [0, 1],
   \qquad r_k = r_j + w\,(h_k + \varepsilon(\delta - h_k + h_1) - r_j) .

w = 1 is a patch of its own, which shares the rigid approach less the height of its initial contact; a basin
whose saddle lies under the neighbour's rim is one patch with it; in between, the approach is
:math:`(r_k - h_k)/\varepsilon`, and plane and pressure slope are mixed in the share w from those of separate
and of common patches. Patches with a common slope meet the condition of displacement in the mean over their
points of first contact, each weighted by :math:`((H - h_k)/(H - h_j) \cdot (r_k - h_k)/(r_j - h_j))^3`, 1 for
the deepest. Loads add up. A patch appears and vanishes with no load. Measured accuracy:
reports/contact_models.md.

References
----------
.. [1] W. Kik, J. Piotrowski, 2nd Mini-Conference on Contact Mechanics and Wear, Budapest 1996.
.. [2] J. Piotrowski, W. Kik, Vehicle System Dynamics 46 (2008) 27-48, doi:10.1080/00423110701586444.
.. [3] B. Liu, S. Bruni, Urban Rail Transit 1 (2016) 215-226, sign of (4) corrected.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.geometry import Gap
from wearsim.contact.kernel import kernel
from wearsim.contact.normal.kik_piotrowski.strips import (
    SECTION,
    WORK_ROWS,
    cell_of,
    end_of_strip,
    on_the_wheel,
    strip_half_length_squared,
)
from wearsim.contact.normal.kik_piotrowski.wheel_load import LINE, balance
from wearsim.contact.normal.model import MOST_PATCHES, NormalModel, NormalSolution, raise_first
from wearsim.contact.patch import FloatArray, IntArray, Patch, Resolution, cells_of

DEFAULTS = {"virtual_penetration_factor": 0.55}


def solve(
    gap: Gap,
    row: IntArray,
    load: FloatArray,
    *,
    vertical: bool,
    effective_modulus: float,
    resolution: Resolution,
    parameters: dict[str, float],
    start: NormalSolution | None = None,
    rough: bool = False,
) -> NormalSolution:
    """Patches and pressures of every row; contract in `normal.model`.

    Own parameter: "virtual_penetration_factor", epsilon of [1]_, 0.55 by default.
    """
    rows, of, gap, strips = load.size, row, gap.take(row), resolution.strips
    factor = {**DEFAULTS, **parameters}["virtual_penetration_factor"]
    points = gap.counterface.y.size
    count, fault = np.zeros(rows, np.int64), np.zeros(rows, np.int64)
    patches = np.zeros((rows, MOST_PATCHES, LINE))
    counterface = gap.counterface
    profile = (counterface.y, counterface.z, counterface.slope, counterface.angle)
    wheel, poses = _bodies(gap)
    balance(
        profile, gap.gap, gap.wheel_radius, gap.x, poses, wheel, gap.curvature, load, vertical, factor,
        effective_modulus, np.empty((WORK_ROWS, points)), np.zeros((points, SECTION)), count, fault, patches,
    )  # fmt: skip
    raise_first(fault)
    row = np.repeat(np.arange(rows), count)
    lines = patches[np.arange(MOST_PATCHES) < count[:, None]]
    y, lead, trail, depth = (np.empty((row.size, strips)) for _ in range(4))
    edges = np.empty((row.size, strips + 1))
    centre, angle, maximum = (np.empty(row.size) for _ in range(3))
    slope = np.empty(row.size)
    _cut_strips(
        row, lines, gap.curvature, profile, gap.gap, gap.wheel_radius, gap.x, poses, wheel, y, lead, trail,
        depth, edges, centre, angle, maximum, slope,
    )  # fmt: skip
    patch = Patch(
        row=of[row],
        y=y,
        width=y[:, 1] - y[:, 0],
        x_lead=lead,
        x_trail=trail,
        pressure_slope=np.repeat(slope[:, None], strips, axis=1),
        interpenetration=depth,
        strips=np.full(row.size, strips),
        cells=cells_of(resolution, lead, trail),
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
        vertical_displacement=lines[:, 12].copy(),
    )


def _bodies(gap: Gap) -> tuple[tuple[FloatArray, FloatArray, FloatArray], FloatArray]:
    """Surface of the wheel and the pose (n, 8) of each row, as `on_the_wheel` takes them."""
    poses = np.zeros((gap.gap.shape[0], 8))
    if gap.bodies is None:
        none = np.empty(0)
        return (none, none, none), poses
    at = gap.bodies.pose
    poses[:, 0], poses[:, 1] = np.sin(at.yaw), np.cos(at.yaw)
    poses[:, 2], poses[:, 3] = np.sin(at.roll), np.cos(at.roll)
    poses[:, 4], poses[:, 5] = at.shift, gap.bodies.half_span
    poses[:, 6], poses[:, 7] = gap.bodies.nominal_radius, gap.curvature
    wheel = gap.bodies.wheel
    return (wheel.y, wheel.radius, wheel.slope), poses


@kernel
def _cut_strips(
    rows: IntArray, lines: FloatArray, kappa: float,
    profile: tuple[FloatArray, FloatArray, FloatArray, FloatArray], gaps: FloatArray, radii: FloatArray,
    alongs: FloatArray, poses: FloatArray, wheel: tuple[FloatArray, FloatArray, FloatArray],
    strip_y: FloatArray, strip_lead: FloatArray, strip_trail: FloatArray, strip_depth: FloatArray,
    edges: FloatArray, centres: FloatArray, angles: FloatArray, maximum: FloatArray,
    pressure_slope: FloatArray,
) -> None:  # fmt: skip
    """Cut patches into strips of equal width in their contact planes and make the pressure fit the load."""
    strips = strip_y.shape[1]
    grid_y, grid_z, slope = profile[0], profile[1], profile[2]
    section = np.zeros(SECTION)
    for m in range(rows.size):
        line = lines[m]
        skewed = wheel[0].size > 0 and poses[rows[m], 0] != 0.0
        gap, radius, along = gaps[rows[m]], radii[rows[m]], alongs[rows[m]]
        start, stop = int(line[0]), int(line[1])
        centre, delta, left, right, limit = line[2], line[3], line[6], line[7], line[10]
        force = line[9]
        cosine, sine = np.cos(delta), np.sin(delta)
        k = cell_of(grid_y, centre, start, stop)
        share = (centre - grid_y[k]) / (grid_y[k + 1] - grid_y[k])
        centre_z = grid_z[k] + share * (grid_z[k + 1] - grid_z[k])
        width = (right - left) / strips
        i = start - 1
        s_here = (grid_y[i] - centre) * cosine + (grid_z[i] - centre_z) * sine
        s_next = (grid_y[i + 1] - centre) * cosine + (grid_z[i + 1] - centre_z) * sine
        section[13] = section[14] = 1.0
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
            bend = kappa / (1.0 - kappa * height)
            half = np.sqrt(strip_half_length_squared(depth, ring / cosine, bend * cosine))
            middle = along[i] + share * (along[i + 1] - along[i])
            lead, trail = half, -half
            if skewed:
                place = grid_y[i] + share * (grid_y[i + 1] - grid_y[i])
                on_the_wheel(place, height, here, middle, poses[rows[m]], wheel, section)
                if section[10] > 0.0 and depth > 0.0:
                    circle = np.sqrt(strip_half_length_squared(limit - here, ring, section[9]))
                    section[13] = end_of_strip(limit - here, circle, section[13], section, wheel)
                    section[14] = end_of_strip(limit - here, -circle, section[14], section, wheel)
                    lead, trail = half * section[13], -half * section[14]
            strip_y[m, j // 2] = s
            strip_lead[m, j // 2] = middle + lead
            strip_trail[m, j // 2] = middle + trail
            strip_depth[m, j // 2] = depth
            half = 0.25 * (lead - trail) ** 2
            volume += half * width
            moment += half * width * s
        for j in range(strips):
            strip_y[m, j] -= moment / volume
        centres[m] = centre + moment / volume * cosine
        # Longitudinal positions count from the contact line at the centre.
        k = cell_of(grid_y, centres[m], start, stop)
        share = (centres[m] - grid_y[k]) / (grid_y[k + 1] - grid_y[k])
        centre_x = along[k] + share * (along[k + 1] - along[k])
        for j in range(strips):
            strip_lead[m, j] -= centre_x
            strip_trail[m, j] -= centre_x
        angles[m] = delta
        pressure_slope[m] = force / (0.5 * np.pi * volume)
        # The deepest point of the outline, not of a strip's centre.
        maximum[m] = force / (0.5 * np.pi * line[5]) * np.sqrt(line[8])


MODEL = NormalModel(name="kik_piotrowski", solve=solve, cost=1.0, local=True, parameters=DEFAULTS)
