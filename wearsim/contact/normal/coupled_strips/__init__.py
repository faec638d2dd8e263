r"""Strips with semi-elliptic pressure, coupled elastically by the half-space.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.geometry import Gap
from wearsim.contact.kernel import plain
from wearsim.contact.normal import kik_piotrowski
from wearsim.contact.normal.coupled_strips.influence import influence_table
from wearsim.contact.normal.coupled_strips.patches import Cut, cut_patches, measure_patches, nodes_for
from wearsim.contact.normal.coupled_strips.wheel import (
    NO_ROOM,
    PATCH,
    Start,
    Wheels,
    solve_wheels,
    work_for,
)
from wearsim.contact.normal.model import NO_BALANCE, NormalModel, NormalSolution, ReferencePoint, raise_first
from wearsim.contact.patch import FloatArray, IntArray, Patch, Resolution, cells_of

DEFAULTS = {"least_strips": 16.0}

_FEWEST, _MOST = 6, 40
_ROOMS = 128, 512, 2048  # strips of a wheel, for which room is made one after the other


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

    Own parameter: "least_strips", strips solved for in the widest part of the profile in contact, 16 by
    default, more where the gap bends; those of the solution carry integrals of them. Rough solutions are
    those of `kik_piotrowski`.
    """
    if rough:
        return kik_piotrowski.solve(
            gap, row, load, vertical=vertical, effective_modulus=effective_modulus, resolution=resolution,
            parameters=parameters, rough=True,
        )  # fmt: skip
    count = int(min(max({**DEFAULTS, **parameters}["least_strips"], _FEWEST), _MOST))
    wheels, begin = _wheels(gap, vertical), _begin(start, row, effective_modulus)
    rows = load.size
    asked = plain(2.0 / (np.pi**2 * effective_modulus) * load)
    for most in _ROOMS:
        work = work_for(most, begin.square.size, gap.counterface.y.size, influence_table())
        number, fault = np.zeros((2, rows), np.int64)
        patches, kept = np.zeros((rows, most // 4), PATCH), np.empty((3, rows, most))
        solve_wheels(wheels, row, asked, begin, count, work, number, fault, patches, kept)
        if not (fault == NO_ROOM).any():
            break
    of_gap = np.zeros(gap.gap.shape[0], np.int64)
    of_gap[row] = np.where(fault == NO_ROOM, NO_BALANCE, fault)
    raise_first(of_gap)
    measure_patches(wheels, row, asked, number, patches, kept)
    place = np.repeat(np.arange(rows), number)
    patches = patches[np.arange(patches.shape[1]) < number[:, None]]
    strips = resolution.strips_across(patches["width"])
    shape = (place.size, int(strips.max(initial=0)))
    y, half, middle, slope = np.empty((4, *shape))
    out = Cut(y, half, middle, slope, np.empty((shape[0], shape[1] + 1)))
    cut_patches(
        wheels, row, place, asked, effective_modulus, strips, patches, kept, nodes_for(most),
        work.share, out,
    )  # fmt: skip
    lead, trail = middle + half, middle - half
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
        reference_point=ReferencePoint(
            column["point"], column["point_approach"], column["across"], column["along"]
        ),
    )


def _wheels(gap: Gap, vertical: bool) -> Wheels:
    """Gap, counterface and wheel as the kernels take them."""
    face = gap.counterface
    if gap.bodies is None:
        sin_yaw, surface_y, surface_slope = np.zeros(gap.gap.shape[0]), face.y, face.slope
    else:
        sin_yaw = np.sin(gap.bodies.pose.yaw)
        surface_y, surface_slope = gap.bodies.wheel.y, gap.bodies.wheel.slope
    return Wheels(
        face.y, face.z, face.slope, face.angle, gap.gap, gap.wheel_radius, gap.x, gap.wheel_y, gap.sin_theta,
        gap.lowest, sin_yaw, surface_y, surface_slope, float(gap.curvature), vertical,
    )  # fmt: skip


def _begin(start: NormalSolution | None, row: IntArray, modulus: float) -> Start:
    """Strips of a solution of this kind, each wheel's along its profile; none of another kind."""
    if start is None or start.patch.grid is not None or start.patch.interpenetration.any():
        none = np.zeros((0, 1))
        return Start(np.zeros(row.size + 1, np.int64), np.zeros(0, np.int64), none, none, none, np.zeros(0))
    patch = start.patch
    order = np.lexsort((start.edge_y[:, 0], patch.row))
    return Start(
        np.searchsorted(patch.row[order], np.append(row, row[-1:] + 1)),
        patch.strips[order],
        start.edge_y[order],
        (0.25 * (patch.x_lead - patch.x_trail) ** 2)[order],
        patch.pressure_slope[order] / (np.pi * modulus),
        start.vertical_displacement[order],
    )


_SCATTER = 1e-8  # m, of vertical displacements

MODEL = NormalModel(name="coupled_strips", solve=solve, parameters=DEFAULTS, scatter=_SCATTER)
