r"""Strips with semi-elliptic pressure on a half-space, solved by Newton's method.

The wheel is cut into strips along the rolling direction, as in the method of Knothe and
Le The [1]_ and in Kalker's strip theory [2]_. Strip j carries
:math:`p = c_j\sqrt{q_j - (x - m_j)^2}` about the contact line :math:`m_j`, q being its
half-length squared, uniform across its width :math:`w_j`. By Boussinesq's solution [3]_
the surface under the middle of strip i is displaced by

.. math:: u_i = \frac{1}{\pi E^*}\sum_j \cos(\delta_i - \delta_j)\,c_j\,q_j\,
   [f(\xi_{ij}, \eta_{ij}^+) - f(\xi_{ij}, \eta_{ij}^-)],
   \qquad f(\xi, \eta) = \int_{-1}^{1}\sqrt{1-t^2}\;\mathrm{arsinh}\frac{\eta}{|\xi-t|}\,dt,

with the distances along and across, of the edges of strip j, over its half-length. Each
strip lies in a plane of its own, at the contact angle :math:`\delta` of the counterface
there. Distances across are along the arc of the profile, and the displacement along one
normal counts along another one by the cosine: the half-space, bent along with the
profile. Contacts of a wheel act on each other however far they are apart. The height of
the wheel over the counterface along the strip's normal, at the vertical displacement D,
is :math:`h_i = (g_i - D)\,T_i`, with :math:`T = 1/(\cos\delta + r'\sin\delta)` and the
slope r' of the wheel. Along the rolling direction it has the curvature

.. math:: k = T\left[\frac{\cos^2\psi - (r'^2 + r\,r'')\sin^2\psi}{r\cos\theta}
          + \frac{\kappa}{1 - \kappa z}\right],

psi being the yaw, r(y) the profile of the wheel, r'' its mean over the section, theta
its angle about the axle and kappa the curvature of the counterface. Two conditions are
met [4]_:

- :math:`h_i + u_i = 0` where :math:`q_i > 0`, and :math:`\geq 0` elsewhere, under the
  load :math:`\sum \frac{\pi}{2} c\,q\,w \cos\delta = N`. For given c the displacement
  is concave in q and the load linear: Newton's method on the active strips has q and D
  as unknowns.
- The displaced surface has the curvature of the gap:
  :math:`k\beta^2 q / 2(u(0) - u(\pm\beta a)) = 1` on every strip,
  :math:`\beta^2 = 3/4`. Between Newton's steps c is multiplied by this ratio. It is
  smooth, a constant in an ellipse of Hertz. A strip next to one that hardly carries has
  the c of its other neighbour: the surfaces do not determine it at the edge. Waves of c
  from strip to strip, which they hardly determine either, are damped, the more the
  shorter they are.

The layout of the strips follows from the gap and the displacement of virtual
penetration [5]_ alone, both continuous in the pose of the wheel. There are 20 strips or
more over the width of all contacts: that of a parabola of the same overlap, or, where a
ridge stands out of a wide contact, of a step of the same mean and mean square overlap.
They are at most 1.2 mm wide, and narrower where the gap bends, so that it deviates from
its chord over a strip by 0.2 % of the displacement, but not narrower than a sixth of
the part of a yawed wheel's profile that lies in a section. The middle line of a strip
is the mean of the contact line over its width, which jumps where the wheel is concave.
Ratios of such strips may go to and fro; they are then changed by less and less, until
a step changes less than 1e-3 of the load (3e-5 elsewhere; 1 % if it still does after
40 steps), and have no solution if present and required curvature differ by more than
5 % in the mean over the load.
They are counted from the middle of that penetration. Contacts begin, end, split and
join wherever strips gain and lose pressure, so that forces are continuous in shift and
yaw: elastic contact has no jumps. A run of loaded strips is a patch, which is a unit of
reports; below 1e-5 of the load it is omitted. Patches are returned on strips of equal
width along the arc, which carry integrals of the solved ones, and with the solved
strips themselves, combined in pairs, in their own planes.

A wheel whose strips have no solution is solved by `half_space`, in one plane per patch.

Limits: sections along the rolling direction are parabolas, which fails on the flange at
large yaw (60 mrad: 8 % of the pressure). Where the contact line runs at an angle to the
rolling direction, pressures are too low: in an ellipse of Hertz by 5 % at 45 degrees,
13 % at 70 degrees. On wheels worn to the shape of a steep gauge
face (-80 degrees and more) the strips move by their width within a few micrometres of
shift, and forces scatter by 1 to 2e-3 of the load. A second lobe ahead of or behind the
first is ignored. Asperities under 0.5 mm wide, such as unsmoothed measurement noise,
are not resolved.

References
----------
.. [1] K. Knothe, H. Le The, Computers and Structures 18 (1984) 1025-1033.
.. [2] J. J. Kalker, Three-Dimensional Elastic Bodies in Rolling Contact, Kluwer 1990.
.. [3] K. L. Johnson, Contact Mechanics, Cambridge 1985, doi:10.1017/CBO9781139171731.
.. [4] I. A. Polonsky, L. M. Keer, Wear 231 (1999) 206-219,
       doi:10.1016/S0043-1648(99)00113-1.
.. [5] J. Piotrowski, W. Kik, Vehicle System Dynamics 46 (2008) 27-48,
       doi:10.1080/00423110701586444.
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from wearsim.contact.geometry import CounterfaceProfile, Gap
from wearsim.contact.kernel import plain
from wearsim.contact.normal import kik_piotrowski
from wearsim.contact.normal.coupled_strips.influence import influence_table
from wearsim.contact.normal.coupled_strips.patches import (
    Cut,
    cut_patches,
    fill_planes,
    measure_patches,
    nodes_for,
)
from wearsim.contact.normal.coupled_strips.strips import Records
from wearsim.contact.normal.coupled_strips.wheel import (
    NO_ROOM,
    PATCH,
    Wheels,
    solve_wheels,
    work_for,
)
from wearsim.contact.normal.model import (
    NO_BALANCE,
    NormalModel,
    NormalSolution,
    raise_first,
)
from wearsim.contact.patch import (
    FloatArray,
    IntArray,
    Patch,
    Resolution,
    StripPlanes,
    cells_of,
)
from wearsim.profile.shape import arc_length

DEFAULTS = {"least_strips": 20.0}

_FEWEST, _MOST = 6, 40
_ROOMS = 128, 512, 2048  # numbers of strips for which arrays are allocated, in turn


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

    The parameter "least_strips" is the least number of strips over the width of all
    contacts of a wheel, 20 by default; there are more where the gap bends. Rough
    solutions are those of `kik_piotrowski`.
    """
    if rough:
        return kik_piotrowski.solve(
            gap,
            row,
            load,
            vertical=vertical,
            effective_modulus=effective_modulus,
            resolution=resolution,
            parameters=parameters,
            rough=True,
        )
    count = float(min(max({**DEFAULTS, **parameters}["least_strips"], _FEWEST), _MOST))
    wheels = _wheels(gap, vertical)
    rows = load.size
    scaled_load = plain(2.0 / (np.pi**2 * effective_modulus) * load)
    for most in _ROOMS:
        work = work_for(most, gap.counterface.y.size, influence_table().ravel())
        number, fault = np.zeros((2, rows), np.int64)
        patches, kept = np.zeros((rows, most // 4), PATCH), np.empty((7, rows, most))
        solve_wheels(
            wheels, row, scaled_load, count, work, number, fault, patches, kept
        )
        if not (fault == NO_ROOM).any():
            break
    if fault.any():
        of_gap = np.zeros(gap.gap.shape[0], np.int64)
        of_gap[row] = np.where(fault == NO_ROOM, NO_BALANCE, fault)
        raise_first(of_gap)
    measure_patches(wheels, number, patches, kept)
    place = np.repeat(np.arange(rows), number)
    patches = patches[np.arange(patches.shape[1]) < number[:, None]]
    strips = resolution.strips_across(patches["width"])
    shape = (place.size, int(strips.max(initial=0)))
    y, half, middle, slope = np.empty((4, *shape))
    out = Cut(y, half, middle, slope, np.empty((shape[0], shape[1] + 1)))
    cut_patches(
        wheels,
        row,
        place,
        scaled_load,
        effective_modulus,
        strips,
        patches,
        kept,
        nodes_for(most),
        out,
    )
    lead, trail = middle + half, middle - half
    planes = np.zeros((len(fields(StripPlanes)), place.size, _most_strips(patches)))
    solved = np.zeros(place.size, np.int64)
    fill_planes(wheels, place, effective_modulus, patches, kept, solved, planes)
    planes = planes[:, :, : int(solved.max(initial=1))]
    patch = Patch(
        row=row[place],
        y=y,
        width=patches["width"] / strips,
        x_lead=lead,
        x_trail=trail,
        pressure_slope=slope,
        interpenetration=np.zeros(shape),
        strips=strips,
        cells=cells_of(resolution, lead, trail),
        planes=StripPlanes(*(plane_field.copy() for plane_field in planes)),
    )
    column = {name: patches[name].copy() for name in PATCH.names or ()}
    return NormalSolution(
        patch=patch,
        centre_y=column["centre"],
        contact_angle=column["angle"],
        approach=column["approach"],
        normal_force=column["force"],
        max_pressure=column["pressure"],
        edge_y=out.edge,
        load_scale=column["scale"],
        vertical_displacement=column["displacement"],
    )


def _wheels(gap: Gap, vertical: bool) -> Wheels:
    """Gap, counterface and wheel in the form that kernels use."""
    face = gap.counterface
    if gap.bodies is None:
        sin_yaw, surface_y, surface_slope = (
            np.zeros(gap.gap.shape[0]),
            face.y,
            face.slope,
        )
    else:
        sin_yaw = np.sin(gap.bodies.pose.yaw)
        surface_y, surface_slope = gap.bodies.wheel.y, gap.bodies.wheel.slope
    return Wheels(
        face.y,
        face.z,
        face.slope,
        face.angle,
        gap.gap,
        gap.wheel_radius,
        gap.x,
        gap.wheel_y,
        gap.sin_theta,
        gap.lowest,
        sin_yaw,
        surface_y,
        surface_slope,
        float(gap.curvature),
        _step(face),
        vertical,
    )


def _most_strips(patches: Records) -> int:
    """Count the strips of the widest patch."""
    return int((patches["last"] - patches["first"]).max(initial=0)) + 1


def _step(face: CounterfaceProfile) -> float:
    """Arc distance of the points of a counterface's profile [m]."""
    return float(arc_length(face.y, face.z)[-1]) / (face.y.size - 1)


# Scatter of vertical displacements [m]: over small shifts at most 4e-9 was observed,
# where patches split.
_SCATTER = 3e-8

MODEL = NormalModel(
    name="coupled_strips",
    solve=solve,
    parameters=DEFAULTS,
    scatter=_SCATTER,
    instead="half_space",
)
