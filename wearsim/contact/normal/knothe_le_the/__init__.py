r"""Strips with semi-elliptic pressure, coupled elastically by the half-space.

As in the method of Knothe and Le The [1]_ the patch is cut into strips along the rolling direction, each with
:math:`p = p_j\sqrt{1-(x/a_j)^2}`, pressure and half-length unknown. Both follow from the residual gap: that
between the displaced surfaces, weighted along each strip with the derivatives of its pressure by
:math:`p_j` and by :math:`a_j`, is zero, :math:`\int r \sqrt{1-t^2}\,dt = \int r\,t^2/\sqrt{1-t^2}\,dt = 0`.
There is no fitted factor, and an ellipse of any ratio of axes is met but for the width of the strips.
Neglected: the middle line of the pressure is that of the smallest gap, and the surface is flat.

Solution: it starts from a solution nearby, or the patches of virtual penetration, under less load where those
of all of it lead nowhere (soft bodies); pressures that never pull for given lengths, and lengths for given
pressures, in turn, converge from anywhere, each step of the lengths made from the five before, also on the
set of strips before, by least squares as in the method of Anderson [2]_ [3]_; no derivatives are asked for,
of which the shortest waves of narrow strips are nearly without. The influence of strips whose lengths hardly
change, over the width of a strip, is expanded to second order. A coarse set of strips locates the ends of the
patch, which go out 0.7 of how far surfaces overlap beyond it, as its pressures are those of a patch too
narrow; a finer set is fitted to it; a start of this model takes the place of the coarse set. The outermost
strip takes its ratio :math:`p/a` from its neighbour, as alone it could shrink to a point between overlapping
surfaces; from 0.6 to 0.9 of the neighbour's load on it goes over to its own equations: of two strips that
take it from each other neither would know its length. No strip is sharper than 20 times two cylinders, and
none moves to less than a third or more than three times what its pressure asks for: steps common to all do
not see the shortest ones. The fine set is fitted again until the ends of the patch lie at their place in the
outermost strips, to 1.5 % of a width, or between two places as near to each other, and the plane is that of
the pressures, to 1e-4 rad: the solution depends on the state, not on the way to it, unless ends find no place
in 16 sets: then those of the last are taken. Strips are at most 0.65 mm wide, because profiles change their
radius within wide patches, and 0.3 mm where the gap of worn profiles is rough: with wider ones its ends find
no place and displacements scatter by 1e-6 m, fifty times what the roll of a wheelset is searched to. Parts
much narrower than the widest have fewer strips.

Rule for several patches: parts of the profile in contact 0.3 mm or more from each other have strips of their
own and share the vertical displacement; parts that come nearer are one. A part with 0.3 mm and more without
pressure between its loaded strips is split once. Planes of parts lean towards each other in the share in
which `half_space.lobes` couples them, and patches in one plane have one creepage reference point (share to
the fourth power, as it moves far). Strips have full influence on each other while their planes differ by less
than 20 degrees, none from 40 on; where they are 10 mm apart, by less than 0.2 and from 0.3 rad on, as planes
are shared. A run of loaded strips is a patch; below 5e-4 of the load it is left out. Where the flange climbs
through the rail's corner no solution is stable: there is one part, over 60 degrees of the profile, whose ends
do not settle.

Measured accuracy, and the cases the thresholds were set on: reports/contact_models.md.

References
----------
.. [1] K. Knothe, H. Le The, Computers and Structures 18 (1984) 1025-1033.
.. [2] D. G. Anderson, Journal of the ACM 12 (1965) 547-560, doi:10.1145/321296.321305.
.. [3] H. F. Walker, P. Ni, SIAM Journal on Numerical Analysis 49 (2011) 1715-1735, doi:10.1137/10078356X.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from wearsim.contact.geometry import Gap
from wearsim.contact.kernel import plain
from wearsim.contact.normal import kik_piotrowski
from wearsim.contact.normal.knothe_le_the.equations import influence_table
from wearsim.contact.normal.knothe_le_the.strips import NO_ROOM, PATCH, work_for
from wearsim.contact.normal.knothe_le_the.wheel import Cut, Start, Wheels, cut_patches, solve_wheels
from wearsim.contact.normal.model import (
    NO_BALANCE,
    Layout,
    NormalModel,
    NormalSolution,
    ReferencePoint,
    raise_first,
)
from wearsim.contact.patch import FloatArray, IntArray, Patch, Resolution, cells_of
from wearsim.errors import ContactError

DEFAULTS = {"solved_strips": 20.0}

_FEWEST, _MOST = 10, 60
_PARTS = 6, 12, 24, 48  # of the profile with strips, for which room is made one after the other
_COARSE = Resolution(1.0, 20, 20, 20)  # of the patches it starts from
_TRIALS = np.array([1.0, 0.03, 0.06, 0.12, 0.25, 0.5])  # of the load they carry: less where all of it fails


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

    Own parameter: "solved_strips", strips solved for in each part of the profile in contact, 20 by default;
    the strips of the solution are interpolated from them. Rough solutions are those of
    `kik_piotrowski`.
    """

    def nearby(load: FloatArray, resolution: Resolution) -> NormalSolution:
        """Patches of virtual penetration."""
        options: Any = {"vertical": vertical, "effective_modulus": effective_modulus}
        return kik_piotrowski.solve(
            gap, row, load, resolution=resolution, parameters=parameters, rough=True, **options
        )

    if rough:
        return nearby(load, resolution)
    solved = int(min(max({**DEFAULTS, **parameters}["solved_strips"], _FEWEST), _MOST))
    rows, surface, lowest = load.size, gap.counterface, gap.gap.min(axis=1)
    wheels = Wheels(*surface, gap.gap, lowest, gap.wheel_radius, gap.x, gap.curvature, vertical)
    trial = np.zeros(rows, np.int64)
    while True:
        last = start is not None or trial.max(initial=0) == _TRIALS.size - 1
        try:
            near = start or nearby(_TRIALS[trial] * load, _COARSE)
        except ContactError as error:
            if last or not error.rows:
                raise
            trial += np.isin(row, error.rows)
            continue
        begin = _begin(near, row, effective_modulus)
        given = int(np.diff(begin.first).max(initial=1))
        for parts in [room for room in _PARTS if room >= given] or [given]:
            most = 4 * solved * parts // _PARTS[0]
            number, fault = np.zeros(rows, np.int64), np.zeros(gap.gap.shape[0], np.int64)
            patches, nodes = np.zeros((rows, parts), PATCH), np.empty((3, rows, parts, most + 2))
            work = work_for(most, parts, given * near.patch.y.shape[1], surface.y.size)
            solve_wheels(
                wheels, row, plain(load), begin, effective_modulus, solved, influence_table(), work, number,
                fault, patches, nodes,
            )  # fmt: skip
            if not (fault == NO_ROOM).any():
                break
        if last or not fault.any():
            break
        trial += fault[row] > 0
    raise_first(np.where(fault == NO_ROOM, NO_BALANCE, fault))
    used = np.arange(parts) < number[:, None]
    # one kind of array: those of several places are views of one table
    place, rank = (plain(each, np.int64) for each in np.nonzero(used))
    patches, of = patches[used], row[place]
    width = patches["stop"] - patches["start"]
    strips = resolution.strips_across(width)
    shape = (place.size, int(strips.max(initial=0)))
    y, half, middle, slope = np.empty((4, *shape))
    out = Cut(y, half, middle, slope, np.empty((shape[0], shape[1] + 1)))
    cut_patches(wheels, of, place, rank, strips, patches, nodes, work, out)
    lead, trail = out.middle + out.half, out.middle - out.half
    patch = Patch(
        row=of,
        y=out.y,
        width=width / strips,
        x_lead=lead,
        x_trail=trail,
        pressure_slope=out.slope,
        interpenetration=np.zeros(shape),
        strips=strips,
        cells=cells_of(resolution, lead, trail),
    )
    column = {name: patches[name].copy() for name in PATCH.names or ()}
    reference = ReferencePoint(column["point"], column["point_approach"], column["across"], column["along"])
    return NormalSolution(
        patch=patch,
        centre_y=column["centre"],
        contact_angle=column["angle"],
        approach=column["approach"],
        normal_force=column["force"],
        max_pressure=column["pressure"],
        edge_y=out.edge,
        load_scale=column["scale"],
        vertical_displacement=lowest[of] + column["displacement"],
        reference_point=reference,
        layout=Layout(column["strips"], column["ends"], column["beyond"]),
    )


def _begin(start: NormalSolution, row: IntArray, modulus: float) -> Start:
    """Patches of a solution, each wheel's along its profile, as the strip model takes them."""
    order = np.lexsort((start.edge_y[:, 0], start.patch.row))
    patch, layout = start.patch, start.layout
    if layout is None:
        layout = Layout(np.zeros(order.size, np.int64), *np.zeros((2, order.size, 2)))
    square = (0.25 * (patch.x_lead - patch.x_trail) ** 2)[order]
    return Start(
        not patch.interpenetration.any(),
        np.searchsorted(patch.row[order], np.append(row, row[-1:] + 1)),
        patch.strips[order],
        start.edge_y[order],
        square,
        patch.pressure_slope[order] * square / (np.pi * modulus),
        start.vertical_displacement[order],
        layout.strips[order],
        layout.ends[order],
        layout.beyond[order],
        start.contact_angle[order],
    )


_SCATTER = 4e-8  # m, of vertical displacements on worn profiles, where the ends of a patch are not sharp

MODEL = NormalModel(name="knothe_le_the", solve=solve, parameters=DEFAULTS, scatter=_SCATTER)
