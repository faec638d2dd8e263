r"""Virtual penetration after Kik and Piotrowski, with rollers after Liu and Bruni.

Liu and Bruni give the strip ends for rollers.

The surfaces are pushed into each other by :math:`\varepsilon\delta`; where they
intersect is the patch [1]_, [2]_, with strip ends after (4)-(6) of [3]_, the sign of
(4) corrected. Pressure is semi-elliptic along each strip,
:math:`p = c\sqrt{x_l(y)^2 - x^2}`, (7) of [3]_, and the approach :math:`\delta` follows
from the half-space displacement at the point of first contact:

.. math:: N = \pi E^* \delta \frac{\iint\sqrt{x_l^2-x^2}\,dx\,dy}
          {\iint\sqrt{x_l^2-x^2}/\sqrt{x^2+y^2}\,dx\,dy}.

Yaw: at each lateral position both ends of the strip are those of the three-dimensional
gap there, searched at about every millimetre and linear in between as multiples of the
ends of circles; the displacement is that of strips which lie ahead of or behind the
point.

Rule for several patches, continuous in every position and load. The gap flooded from
below has basins; each joins a deeper one over a saddle. The deepest basin k = 1 is
filled up to the rim :math:`r_1 = h_1 + \varepsilon\delta`. A basin of initial contact
at :math:`h_k` that joins its deeper neighbour j over a saddle of height H is separate
by

.. math:: w = \frac{H - \max(h_k, r_j)}{\varepsilon\delta} \in [0, 1],
   \qquad r_k = r_j + w\,(h_k + \varepsilon(\delta - h_k + h_1) - r_j) .

w = 1 is a patch of its own, which shares the rigid approach less the height of its
initial contact; a basin whose saddle lies under the neighbour's rim is one patch with
it; in between, the approach is :math:`(r_k - h_k)/\varepsilon`, and plane and pressure
slope are mixed in the share w from those of separate and of common patches. Patches
with a common slope meet the condition of displacement in the mean over their points of
first contact, each weighted by :math:`((H - h_k)/(H - h_j) \cdot (r_k - h_k)/(r_j -
h_j))^3`, 1 for the deepest. Loads add up. A patch appears and vanishes with no load.
Measured accuracy: reports/contact_models.md.

References
----------
.. [1] W. Kik, J. Piotrowski, 2nd Mini-Conference on Contact Mechanics and Wear,
       Budapest 1996.
.. [2] J. Piotrowski, W. Kik, Vehicle System Dynamics 46 (2008) 27-48,
       doi:10.1080/00423110701586444.
.. [3] B. Liu, S. Bruni, Urban Rail Transit 1 (2016) 215-226.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.contact.geometry import CounterfaceProfile, Gap, WheelSurface
from wearsim.contact.kernel import bare_kernel, plain
from wearsim.contact.normal.kik_piotrowski.strips import (
    PATCH,
    POSE,
    SECTION,
    Records,
    Strips,
    between,
    share_at,
    strip_half_length_squared,
)
from wearsim.contact.normal.kik_piotrowski.wheel_load import BASIN, Work, balance
from wearsim.contact.normal.model import NormalModel, NormalSolution, raise_first
from wearsim.contact.patch import FloatArray, IntArray, Patch, Resolution

DEFAULTS = {"virtual_penetration_factor": 0.55}

_PITCH = 1.2e-3  # distance of the sections of a yawed wheel along the profile [m]


def solve(
    gap: Gap,
    row: IntArray,
    load: FloatArray,
    *,
    vertical: bool,
    effective_modulus: float,
    resolution: Resolution,
    parameters: dict[str, float],
    rough: bool = False,
) -> NormalSolution:
    """Patches and pressures of every row; contract in `normal.model`.

    The parameter "virtual_penetration_factor" is epsilon of [1]_, 0.55 by default.
    Rough solutions have strips without skew and carry the load to 4 %.
    """
    factor = {**DEFAULTS, **parameters}["virtual_penetration_factor"]
    profile = gap.counterface
    wheel, poses = _bodies(gap)
    points = profile.y.size
    spacing = float(
        np.hypot(profile.y[-1] - profile.y[0], profile.z[-1] - profile.z[0])
    ) / (points - 1)
    ends = np.empty((2, load.size, points))
    most = points // 2  # largest number of minima of a gap
    work = Work(
        Strips(*np.empty((9, points))),
        np.zeros(0 if rough else points, SECTION),
        np.empty(most, BASIN),
        np.empty(most, PATCH),
        np.empty(most, np.int64),
        np.empty((2, most)),
    )
    count, fault = np.zeros(load.size, np.int64), np.zeros(gap.gap.shape[0], np.int64)
    patches = np.empty(load.size * most, PATCH)  # unused entries remain undefined
    balance(
        row,
        plain(load),
        vertical,
        rough,
        factor,
        effective_modulus,
        gap.gap,
        gap.lowest,
        gap.wheel_radius,
        gap.x,
        poses,
        ends,
        profile,
        wheel,
        max(round(_PITCH / spacing), 1),
        work,
        count,
        fault,
        patches,
    )
    raise_first(fault)
    place = np.repeat(np.arange(load.size), count)
    patches = patches[: place.size]
    strips = resolution.strips_across(patches["right"] - patches["left"])
    shape = (place.size, int(strips.max(initial=0)))
    y, lead, trail, depth, slope = np.empty((5, *shape))
    centre, length = np.empty((2, place.size))
    out = _Cut(
        y, lead, trail, depth, slope, np.empty((shape[0], shape[1] + 1)), centre, length
    )
    _cut_strips(
        row[place],
        place,
        strips,
        patches,
        gap.curvature,
        profile,
        gap.gap,
        gap.wheel_radius,
        gap.x,
        ends,
        rough,
        wheel.y.size > 0,
        poses,
        out,
    )
    patch = Patch(
        row=row[place],
        y=y,
        width=(patches["right"] - patches["left"]) / strips,
        x_lead=lead,
        x_trail=trail,
        pressure_slope=slope,
        interpenetration=depth,
        strips=strips,
        cells=resolution.cells_along(length),
    )
    return NormalSolution(
        patch=patch,
        centre_y=centre,
        contact_angle=patches["angle"].copy(),
        approach=patches["approach"].copy(),
        normal_force=patches["force"].copy(),
        # Deepest point of the outline, which need not be a strip centre.
        max_pressure=patches["force"]
        / (0.5 * np.pi * patches["volume"])
        * np.sqrt(patches["deepest"]),
        edge_y=out.edge,
        load_scale=patches["scale"].copy(),
        vertical_displacement=patches["displacement"].copy(),
    )


def _bodies(gap: Gap) -> tuple[WheelSurface, Records]:
    """Surface of the wheel and the pose of each row."""
    poses = np.zeros(gap.gap.shape[0], POSE)
    poses["kappa"] = gap.curvature
    if gap.bodies is None:
        return WheelSurface(*np.empty((3, 0))), poses
    at, wheel = gap.bodies.pose, gap.bodies.wheel
    poses["sin_yaw"], poses["cos_yaw"] = np.sin(at.yaw), np.cos(at.yaw)
    poses["sin_roll"], poses["cos_roll"] = np.sin(at.roll), np.cos(at.roll)
    poses["shift"], poses["half_span"] = at.shift, gap.bodies.half_span
    poses["nominal_radius"] = gap.bodies.nominal_radius
    return wheel, poses


class _Cut(NamedTuple):
    """Strips of equal width: centres, ends, depth, pressure slope and edges.

    Centre and length are those of the patches.
    """

    y: FloatArray
    lead: FloatArray
    trail: FloatArray
    depth: FloatArray
    slope: FloatArray
    edge: FloatArray
    centre: FloatArray
    length: FloatArray


@bare_kernel
def _cut_strips(
    rows: IntArray,
    places: IntArray,
    counts: IntArray,
    patches: Records,
    kappa: float,
    profile: CounterfaceProfile,
    gaps: FloatArray,
    radii: FloatArray,
    alongs: FloatArray,
    ends: FloatArray,
    rough: bool,
    bodies: bool,
    poses: Records,
    out: _Cut,
) -> None:
    """Cut patches into strips of equal width in contact planes, and fit the pressure.

    The pressure is fitted to the load. Entries after the last strip of a patch are
    padding.
    """
    for m in range(rows.size):
        patch, strips = patches[m], counts[m]
        skewed = bodies and not rough and poses[rows[m]].sin_yaw != 0.0
        gap, radius, along = gaps[rows[m]], radii[rows[m]], alongs[rows[m]]
        ahead, behind = ends[0, places[m]], ends[1, places[m]]
        cosine, sine = np.cos(patch.angle), np.sin(patch.angle)
        k, share = share_at(profile.y, patch.centre, patch.first, patch.last)
        base = between(profile.z, k, share)
        width = (patch.right - patch.left) / strips
        i = patch.first - 1
        s_here = (profile.y[i] - patch.centre) * cosine + (profile.z[i] - base) * sine
        s_next = (profile.y[i + 1] - patch.centre) * cosine + (
            profile.z[i + 1] - base
        ) * sine
        volume, moment = 0.0, 0.0
        for n in range(2 * strips + 1):  # strip edges and centres in turn
            s, j = patch.left + 0.5 * n * width, n // 2
            while s > s_next and i < patch.last:
                i += 1
                s_here = s_next
                s_next = (profile.y[i + 1] - patch.centre) * cosine + (
                    profile.z[i + 1] - base
                ) * sine
            share = (s - s_here) / (s_next - s_here)
            if n % 2 == 0:
                out.edge[m, j] = between(profile.y, i, share)
                continue
            opening = (gap[i + 1] - gap[i]) / (profile.y[i + 1] - profile.y[i])
            gradient = between(profile.slope, i, share) - opening
            depth = max(
                (patch.rim - between(gap, i, share)) / (cosine + gradient * sine), 0.0
            )
            bend = kappa / (1.0 - kappa * between(profile.z, i, share))
            half = np.sqrt(
                strip_half_length_squared(
                    depth, between(radius, i, share) / cosine, bend * cosine
                )
            )
            middle = between(along, i, share)
            lead, trail = half, half
            if skewed:
                first, last = max(i, patch.first), min(i + 1, patch.last)
                lead *= ahead[first] + share * (ahead[last] - ahead[first])
                trail *= behind[first] + share * (behind[last] - behind[first])
            out.y[m, j], out.depth[m, j] = s, depth
            out.lead[m, j], out.trail[m, j] = middle + lead, middle - trail
            square = 0.25 * (lead + trail) ** 2
            volume += square * width
            moment += square * width * s
        centre = out.centre[m] = patch.centre + moment / volume * cosine
        # Longitudinal positions count from the contact line at the centre.
        k, share = share_at(profile.y, centre, patch.first, patch.last)
        centre_x = between(along, k, share)
        foremost, hindmost = 0.0, 0.0
        for j in range(strips):
            out.y[m, j] -= moment / volume
            out.lead[m, j] -= centre_x
            out.trail[m, j] -= centre_x
            foremost, hindmost = (
                max(foremost, out.lead[m, j]),
                min(hindmost, out.trail[m, j]),
            )
        out.length[m] = foremost - hindmost
        last = strips - 1
        for j in range(strips, out.y.shape[1]):
            out.y[m, j], out.depth[m, j] = out.y[m, last], 0.0
            out.lead[m, j] = out.trail[m, j] = 0.5 * (
                out.lead[m, last] + out.trail[m, last]
            )
            out.edge[m, j + 1] = out.edge[m, strips]
        out.slope[m, :] = patch.force / (0.5 * np.pi * volume)


MODEL = NormalModel(
    name="kik_piotrowski",
    title="Kik and Piotrowski",
    solve=solve,
    parameters=DEFAULTS,
    several_solutions=True,
    underrates_pressure=True,
)
