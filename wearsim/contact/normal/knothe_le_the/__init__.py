r"""Strips with semi-elliptic pressure, coupled elastically by the half-space.

As in the method of Knothe and Le The [1]_ the patch is cut into strips along the rolling direction, each with
:math:`p = p_j\sqrt{1-(x/a_j)^2}`, pressure and half-length unknown. Both follow from the residual gap: that
between the displaced surfaces, weighted along each strip with the derivatives of its pressure by
:math:`p_j` and by :math:`a_j`, is zero, :math:`\int r \sqrt{1-t^2}\,dt = \int r\,t^2/\sqrt{1-t^2}\,dt = 0`.
There is no fitted factor, and an ellipse of any ratio of axes is met but for the width of the strips.
Neglected: the middle line of the pressure is that of the smallest gap, and the surface is flat.

Solution: it starts from a solution nearby, or the patches of virtual penetration, under less load where those
of all of it lead nowhere (soft bodies); pressures that never pull for given lengths, and lengths for given
pressures, in turn, converge from anywhere; then Newton's method, each Jacobian kept as long as its steps
shrink fast, the influence of strips whose lengths hardly change, over the width of a strip, expanded to
second order. A coarse set of strips locates the ends of the patch, a finer one is fitted to it. The outermost
strip takes its ratio :math:`p/a` from its neighbour: alone it could shrink to a point between overlapping
surfaces. The fine set is fitted again until the ends of the patch lie at their place in the outermost strips,
to 3 % of a width, or between two places as near to each other, and the plane is that of the pressures, to
1e-4 rad: the solution depends on the state, not on the way to it. Wide patches have narrower strips, because
profiles change their radius within them.

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
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.geometry import Gap
from wearsim.contact.kernel import plain
from wearsim.contact.normal import kik_piotrowski
from wearsim.contact.normal.knothe_le_the.equations import Pairs, Work, influence_table
from wearsim.contact.normal.knothe_le_the.strips import NO_ROOM, PATCH, PLANE, SPAN, STRIP
from wearsim.contact.normal.knothe_le_the.wheel import Cut, Start, cut_patches, solve_wheels
from wearsim.contact.normal.model import (
    NO_BALANCE,
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
    if rough:
        return _nearby(gap, row, load, vertical, effective_modulus, resolution, parameters)
    solved = int(min(max({**DEFAULTS, **parameters}["solved_strips"], _FEWEST), _MOST))
    rows = load.size
    surface, lowest = gap.counterface, gap.gap.min(axis=1)
    profile = (surface.y, surface.z, surface.slope, surface.angle)
    trial = np.zeros(rows, np.int64)
    while True:
        carried, last = _TRIALS[trial] * load, start is not None or trial.max(initial=0) == _TRIALS.size - 1
        try:
            near = start or _nearby(gap, row, carried, vertical, effective_modulus, _COARSE, parameters)
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
            patches = np.zeros((rows, parts), PATCH)
            nodes = np.empty((3, rows, parts, most + 2))
            work = _work(most, parts, given * near.patch.y.shape[1])
            solve_wheels(
                row, plain(load), begin, vertical, effective_modulus, solved, profile, gap.gap, lowest,
                gap.wheel_radius, gap.x, gap.curvature, influence_table(), work, number, fault, patches,
                nodes,
            )  # fmt: skip
            if not (fault == NO_ROOM).any():
                break
        if last or not fault.any():
            break
        trial += fault[row] > 0
    raise_first(np.where(fault == NO_ROOM, NO_BALANCE, fault))
    used = np.arange(parts) < number[:, None]
    place, rank = np.nonzero(used)
    patches, of = patches[used], row[place]
    width = patches["stop"] - patches["start"]
    strips = resolution.strips_across(width)
    shape = (place.size, int(strips.max(initial=0)))
    y, half, middle, slope = np.empty((4, *shape))
    out = Cut(y, half, middle, slope, np.empty((shape[0], shape[1] + 1)))
    cut_patches(
        of, place, rank, strips, patches, nodes, profile, gap.gap, lowest, gap.x, np.empty(most + 2),
        work.share, out,
    )  # fmt: skip
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
    return NormalSolution(
        patch=patch,
        centre_y=patches["centre"].copy(),
        contact_angle=patches["angle"].copy(),
        approach=patches["approach"].copy(),
        normal_force=patches["force"].copy(),
        max_pressure=patches["pressure"].copy(),
        edge_y=out.edge,
        load_scale=patches["scale"].copy(),
        vertical_displacement=lowest[of] + patches["displacement"],
        reference_point=ReferencePoint(
            patches["point"].copy(),
            patches["point_approach"].copy(),
            patches["across"].copy(),
            patches["along"].copy(),
        ),
    )


def _nearby(
    gap: Gap, row: IntArray, load: FloatArray, vertical: bool, modulus: float, resolution: Resolution,
    parameters: dict[str, float],
) -> NormalSolution:  # fmt: skip
    """Patches of virtual penetration."""
    return kik_piotrowski.solve(
        gap, row, load, vertical=vertical, effective_modulus=modulus, resolution=resolution,
        parameters=parameters, rough=True,
    )  # fmt: skip


def _begin(start: NormalSolution, row: IntArray, modulus: float) -> Start:
    """Patches of a solution, each wheel's along its profile, as the strip model takes them."""
    order = np.lexsort((start.edge_y[:, 0], start.patch.row))
    patch = start.patch
    square = (0.25 * (patch.x_lead - patch.x_trail) ** 2)[order]
    return Start(
        np.searchsorted(patch.row[order], np.append(row, row[-1:] + 1)),
        patch.strips[order],
        start.edge_y[order],
        square,
        patch.pressure_slope[order] * square / (np.pi * modulus),
        start.vertical_displacement[order],
    )


def _work(most: int, parts: int, given: int) -> Work:
    """Room for the strips of a wheel in parts of the profile, and their equations."""

    def square(size: int) -> FloatArray:
        return np.empty((size, size))

    unknowns = 2 * most + 1
    return Work(
        strips=np.zeros(most, STRIP),
        pairs=Pairs(square(most), square(most), square(most)),
        before=np.zeros(most, STRIP),
        old=np.zeros(max(most, given), STRIP),
        spans=np.zeros(parts, SPAN),
        fresh=np.zeros(parts, SPAN),
        planes=np.zeros(parts, PLANE),
        share=np.eye(parts),
        active=np.empty(most, np.int64),
        made_for=np.zeros(most + 1, np.int64),
        scale=np.empty(4),
        alone=np.zeros(1, np.int64),
        steps=np.log(np.abs(np.arange(most + 1) - 0.5)),
        matrix=square(unknowns),
        right=np.empty(unknowns),
        taken=np.empty(unknowns),
        left=np.empty(1),
        barred=np.empty(most),
        plain=square(most + 1),
        near=square(most),
        far=square(most),
        bow=np.empty(most),
        logs=np.empty(most),
        base=np.empty(most),
        terms=np.zeros((6, most, most)),
        sums=np.empty((3, most)),
    )


MODEL = NormalModel(name="knothe_le_the", solve=solve, parameters=DEFAULTS)
