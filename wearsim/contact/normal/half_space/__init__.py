r"""Elastic half-spaces under any gap: the pressure that Boussinesq's influence asks for, cell by cell.

The reference among the normal models: no assumption on the shape of patch or pressure, only that the bodies
are half-spaces behind the contact plane, equal and frictionless. The plane of a patch goes through its
pressure-weighted centre, at the pressure-weighted mean of the counterface's angle; the gap over it is the
exact one in three dimensions where the gap has its bodies. All patches of a wheel share one vertical
displacement, and their loads add up vertically.

Steps for each wheel, each of which fixes where the next one lays its grids: the overlap of the rigid
surfaces under a displacement searched by trial, which holds every contact; lobes on coarse grids over it;
grids that fit the patches, `lobes` says which lobes share one; the same again from there until planes and
borders stay.

References
----------
.. [1] I. A. Polonsky, L. M. Keer, Wear 231 (1999) 206-219, doi:10.1016/S0043-1648(99)00113-1.
.. [2] J. J. Kalker, Three-Dimensional Elastic Bodies in Rolling Contact, Kluwer 1990.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wearsim.contact.geometry import NO_WHEEL, Gap
from wearsim.contact.normal.half_space.lobes import gather, lobes_of, missed, place_grids
from wearsim.contact.normal.half_space.pressure import (
    MOST_ITERATIONS,
    TOLERANCE,
    GridPressure,
    solve_pressure,
)
from wearsim.contact.normal.half_space.regions import (
    Region,
    Section,
    carried_over,
    coupling_of,
    heights,
    origin_x,
    overlaps,
    plane_of,
    rotated,
    touches_edge,
)
from wearsim.contact.normal.model import (
    AT_EDGE,
    MOST_PATCHES,
    NO_CONTACT,
    NO_CONVERGENCE,
    NOT_SINGLE,
    TOO_MANY,
    NormalModel,
    NormalSolution,
    fault_of,
)
from wearsim.contact.patch import FloatArray, IntArray, PatchGrid, Resolution, from_grid

DEFAULTS = {
    "half_space_tolerance": TOLERANCE,
    "half_space_iterations": float(MOST_ITERATIONS),
}

_COARSE = (24, 32)
_TRIALS = 20  # of the displacement
_NEAR = 1e-3  # m, by which patches move from one state to the next at most
_FITS = 25  # of grids to patches
_STILL = 1e-5  # rad, a plane that stays in place
_LAID = 4  # fits after which grids keep their borders if they hold their patches
_GATHERED = 2  # fits after which it is settled which lobes share a grid, and in which share t


@dataclass(frozen=True)
class WheelPressure:
    """Patches of one wheel on their grids, a state to start neighbours from.

    Parameters
    ----------
    regions : tuple of Region
        Places of the grids.
    pressure : tuple of (nx, ny) arrays
        On them [Pa].
    vertical_displacement : float
        From initial contact [m].
    initial_contact : float
        Lateral position of initial contact [m].
    iterations : tuple of int
        Of conjugate gradients in each step; the first ones on coarse grids unless a start was given.
    """

    regions: tuple[Region, ...]
    pressure: tuple[FloatArray, ...]
    vertical_displacement: float
    initial_contact: float
    iterations: tuple[int, ...]


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

    Strips are rows of cells, of which 1.5 on each side are left free for the patch's edge; `patch.grid` has
    the pressure of the cells. Own parameters: "half_space_tolerance", change of the pressures at which the
    iteration stops, 3e-5 by default [-]; "half_space_iterations", its limit, 1000 by default.
    """
    options: dict[str, Any] = {"vertical": vertical, "effective_modulus": effective_modulus}
    shape = (resolution.cells, resolution.strips)
    states = [
        solve_wheel(gap, here, weight, shape=shape, parameters=parameters, **options)
        for here, weight in zip(row.tolist(), load.tolist(), strict=True)
    ]
    return _assembled(gap, row, states, vertical)


def solve_wheel(
    gap: Gap,
    row: int,
    load: float,
    *,
    vertical: bool,
    effective_modulus: float,
    shape: tuple[int, int],
    parameters: dict[str, float],
    start: WheelPressure | None = None,
) -> WheelPressure:
    """Pressures of one wheel.

    Parameters
    ----------
    gap, vertical, effective_modulus, parameters
        As of `solve`.
    shape : (int, int)
        Cells along and strips across each patch.
    row : int
        Which row of the gap.
    load : float
        Of this row [N].
    start : WheelPressure, optional
        Of a neighbouring state, on any grids: skips the search for patches. The result depends on it within
        the tolerance, which is why `solve` never uses one. Where the start does not hold all overlaps, it
        is not used.

    Returns
    -------
    WheelPressure

    Raises
    ------
    ContactError, NumericalError
        As `solve`.
    """
    curve = gap.gap[row]
    lowest = int(curve.argmin())
    if not curve[lowest] < NO_WHEEL:  # or not a number
        raise fault_of(NO_CONTACT, row)
    if not 0 < lowest < curve.size - 1 or max(curve[lowest - 1], curve[lowest + 1]) >= NO_WHEEL:
        raise fault_of(AT_EDGE, row)
    task = _Task(gap, row, load, vertical, effective_modulus, {**DEFAULTS, **parameters})
    if start is not None:
        # Patches move along with the point of initial contact, unless it jumps to another lobe.
        place = float(gap.counterface.y[lowest])
        move = place - start.initial_contact
        move = move if abs(move) < _NEAR else 0.0
        moved = tuple(replace(region, row=row, y=region.y + move) for region in start.regions)
        solution = _fit(task, replace(start, regions=moved, initial_contact=place, iterations=()), shape)
        if not missed(
            gap, solution.regions, solution.pressure, solution.vertical_displacement, effective_modulus
        ):
            return solution
    return _fit(task, _search(task), shape)


@dataclass(frozen=True)
class _Task:
    """Gap, row, load and options of one wheel."""

    gap: Gap
    row: int
    load: float
    vertical: bool
    modulus: float
    parameters: dict[str, float]

    def pressures(
        self,
        regions: list[Region],
        coupled: FloatArray,
        shape: tuple[int, int],
        displacement: float,
        start: list[FloatArray] | None,
        tolerance: float,
    ) -> GridPressure:
        """Pressures on grids; the displacement is in addition to that of the heights."""
        grids = [heights(self.gap, region, shape, displacement) for region in regions]
        load = self.load if self.vertical else self.load * grids[0].cosine
        solution = solve_pressure(
            grids,
            load,
            self.modulus,
            coupling=coupling_of(self.gap, regions, coupled, shape, self.modulus),
            start=start,
            tolerance=tolerance,
            limit=int(self.parameters["half_space_iterations"]),
        )
        if not solution.converged:
            raise fault_of(NO_CONVERGENCE, self.row)
        return solution


def _search(task: _Task) -> WheelPressure:
    """Pressures on coarse grids over the overlap of the rigid surfaces."""
    level = (task.load / task.modulus) ** (2.0 / 3.0) * 1.5
    counts = []
    for trial in range(_TRIALS):
        regions = overlaps(task.gap, task.row, level)
        uncoupled = np.zeros((len(regions), len(regions)))
        solution = task.pressures(regions, uncoupled, _COARSE, 0.0, None, 1e-3)
        counts.append(solution.iterations)
        if 0.5 * level < solution.vertical_displacement < level / 1.02:
            initial_contact = float(task.gap.counterface.y[task.gap.gap[task.row].argmin()])
            return WheelPressure(
                tuple(regions),
                solution.pressure,
                solution.vertical_displacement,
                initial_contact,
                tuple(counts),
            )
        aim = 1.15 * min(max(solution.vertical_displacement, 0.1 * level), 10.0 * level)
        # Where surfaces conform, the plane turns with the level: half the way, so as not to go to and fro.
        level = aim if trial < 2 else float(np.sqrt(level * aim))
    raise fault_of(NO_CONVERGENCE, task.row)


def _fit(task: _Task, state: WheelPressure, shape: tuple[int, int]) -> WheelPressure:
    """Fit grids to the patches of a state, and again to the patches on them, until they stay."""
    gap, row = task.gap, task.row
    tolerance = task.parameters["half_space_tolerance"]
    counts, coupled, settled = list(state.iterations), np.zeros((0, 0)), 0
    for fit in range(_FITS):
        old = list(zip(state.regions, state.pressure, strict=True))
        groups = [lobes_of(gap, region, pressure) for region, pressure in old]
        if not settled:
            outside = missed(gap, state.regions, state.pressure, state.vertical_displacement, task.modulus)
            groups, coupled = gather(gap, [*(lobe for group in groups for lobe in group), *outside])
            single = len(groups) == 1 and len(old) == 1 and not outside
            settled = fit if fit >= _GATHERED or (fit > 0 and single) else 0
        elif not all(groups):  # a grid without load
            kept = [k for k, group in enumerate(groups) if group]
            groups, coupled = [groups[k] for k in kept], coupled[np.ix_(kept, kept)]
        regions = place_grids(gap, row, groups, coupled, shape)
        if settled and len(regions) == len(old):
            inside = [not touches_edge(*was) for was in old]
            before = np.array([was.angle for was in state.regions])
            off = np.array([new.angle for new in regions]) - before
            if np.abs(off).max() < _STILL and all(inside) and fit > 1:
                return state
            if fit >= _LAID:  # half the way and in the same borders, so as not to go to and fro
                regions = [
                    rotated(was, float(before[k] + 0.5 * off[k]), None if inside[k] else regions[k])
                    for k, was in enumerate(state.regions)
                ]
        start = [carried_over(gap, old, region, shape) for region in regions]
        near = tolerance if fit > 0 else max(tolerance, 3e-4)
        solution = task.pressures(regions, coupled, shape, state.vertical_displacement, start, near)
        counts.append(solution.iterations)
        displacement = state.vertical_displacement + solution.vertical_displacement
        state = WheelPressure(
            tuple(regions), solution.pressure, displacement, state.initial_contact, tuple(counts)
        )
    raise fault_of(NO_CONVERGENCE, row)


def _assembled(gap: Gap, row: IntArray, states: list[WheelPressure], vertical: bool) -> NormalSolution:
    """Patches of all rows in their order."""
    lines: list[_Line] = []
    for here, state in zip(row, states, strict=True):
        patches = [
            _line(gap, region, pressure, state.vertical_displacement)
            for region, pressure in zip(state.regions, state.pressure, strict=True)
            if pressure.any()
        ]
        if len(patches) > MOST_PATCHES:
            raise fault_of(TOO_MANY, int(here))
        if len(patches) > 1 and not vertical:
            raise fault_of(NOT_SINGLE, int(here))
        lines.extend(sorted(patches, key=lambda line: -line.force))

    def column(name: str) -> FloatArray:
        return np.array([getattr(line, name) for line in lines])

    grid = PatchGrid(column("x_lead"), column("cell_length"), column("pressure"))
    count, cells, strips = grid.pressure.shape
    patch = from_grid(
        column("row").astype(np.int64), column("y"), column("width"), grid,
        np.full(count, strips), np.full(count, cells),
    )  # fmt: skip
    return NormalSolution(
        patch=patch,
        centre_y=column("centre"),
        contact_angle=column("angle"),
        approach=column("approach"),
        normal_force=column("force"),
        max_pressure=grid.pressure.max(axis=(1, 2)),
        edge_y=column("edges"),
        load_scale=np.ones(len(lines)),
        vertical_displacement=column("vertical_displacement"),
    )


@dataclass(frozen=True)
class _Line:
    """One patch; names as in `NormalSolution`, `Patch` and `PatchGrid`."""

    row: int
    centre: float
    angle: float
    approach: float
    force: float
    vertical_displacement: float
    y: FloatArray
    width: float
    edges: FloatArray
    x_lead: float
    cell_length: float
    pressure: FloatArray


def _line(gap: Gap, region: Region, pressure: FloatArray, displacement: float) -> _Line:
    """Patch on one grid; lengths from its pressure-weighted centre and the contact line there."""
    nx, ny = pressure.shape
    length, width = region.cell((nx, ny))
    curve, grid = gap.gap[region.row], gap.counterface
    section = Section(gap, region.y, region.angle)
    s = region.s(ny)
    load = pressure.sum(axis=0)
    middle = float((load * s).sum() / load.sum())
    centre = float(section.lateral(np.array([middle]))[0])
    edges = section.lateral(region.s_low + width * np.arange(ny + 1))
    loaded = np.flatnonzero(load)
    ends = edges[[loaded[0], loaded[-1] + 1]]
    first, last = int(np.searchsorted(grid.y, ends[0])) - 2, int(np.searchsorted(grid.y, ends[1])) + 2
    if first < 0 or last > grid.y.size or curve[first:last].max() >= NO_WHEEL:
        raise fault_of(AT_EDGE, region.row)
    ahead = origin_x(gap, region) - float(np.interp(centre, grid.y, gap.x[region.row]))
    lowest = float(curve[first:last].min() - curve.min())
    return _Line(
        row=region.row,
        centre=centre,
        angle=region.angle,
        approach=(displacement - lowest) * float(np.cos(region.angle)),
        force=float(pressure.sum()) * length * width,
        vertical_displacement=float(plane_of(gap, region).vertical_displacement[0]) + displacement,
        y=s - middle,
        width=width,
        edges=edges,
        x_lead=region.x_high + ahead,
        cell_length=length,
        pressure=pressure,
    )


MODEL = NormalModel(name="half_space", solve=solve, cost=60.0, parameters=DEFAULTS, fewest=8)
