r"""Elastic half-space under any gap: pressure by cells with Boussinesq's influence.

The reference among the normal models: no assumption on the shape of patch or pressure,
only that the bodies are half-spaces behind the contact plane, equal and frictionless.
The plane of a patch goes through its pressure-weighted centre, at the pressure-weighted
mean of the counterface's angle; the gap over it is the exact one in three dimensions
where the gap has its bodies. All patches of a wheel share one vertical displacement,
and their loads add up vertically.

Steps for each wheel, each of which determines the grids of the next: the overlap of the
rigid surfaces at a displacement found by trial, which contains every contact; lobes on
coarse grids over it; grids that fit the patches, grouped by `lobes`; and repetition of
the last step until planes and borders are unchanged.

References
----------
.. [1] I. A. Polonsky, L. M. Keer, Wear 231 (1999) 206-219,
       doi:10.1016/S0043-1648(99)00113-1.
.. [2] J. J. Kalker, Three-Dimensional Elastic Bodies in Rolling Contact, Kluwer 1990.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from wearsim.contact.geometry import NO_WHEEL, Gap
from wearsim.contact.normal.half_space.lobes import (
    Lobe,
    angle_of,
    gather,
    lobes_of,
    missed,
    place_grids,
)
from wearsim.contact.normal.half_space.pressure import (
    MOST_ITERATIONS,
    TOLERANCE,
    solve_pressure,
)
from wearsim.contact.normal.half_space.regions import (
    Region,
    Section,
    carried_over,
    coupling_of,
    fits,
    heights,
    origin_x,
    overlaps,
    plane_of,
    touches_edge,
    turned,
)
from wearsim.contact.normal.model import (
    AT_EDGE,
    FAINT,
    NO_CONTACT,
    NO_CONVERGENCE,
    NOT_SINGLE,
    NormalModel,
    NormalSolution,
    fault_of,
)
from wearsim.contact.patch import (
    FloatArray,
    IntArray,
    PatchGrid,
    Resolution,
    StripPlanes,
    from_grid,
)
from wearsim.profile.shape import arc_length

DEFAULTS = {
    "half_space_tolerance": TOLERANCE,
    "half_space_iterations": float(MOST_ITERATIONS),
}

_TRIALS = 20  # largest number of trial displacements
_FITS = 25  # largest number of fits of grids to patches
_STILL = 2e-4  # rotation of a plane that needs no further fit [rad]
_NEARLY = 5e-3  # rotation that is accepted in a rough solution [rad]
# number of fits after which grids that contain their patches keep their borders
_LAID = 4
# fits after which the grouping of lobes on grids and their coupling t are fixed
_GATHERED = 2
_ALIKE = 1e-3  # change of t below which it is fixed earlier


@dataclass(frozen=True)
class WheelPressure:
    """Patches of one wheel on their grids.

    Parameters
    ----------
    regions : tuple of Region
        Places of the grids.
    pressure : tuple of (nx, ny) arrays
        On them [Pa].
    vertical_displacement : float
        From initial contact [m].
    iterations : tuple of int
        Of conjugate gradients in each step; the first ones on coarse grids.
    """

    regions: tuple[Region, ...]
    pressure: tuple[FloatArray, ...]
    vertical_displacement: float
    iterations: tuple[int, ...]


def solve(gap: Gap, row: IntArray, load: FloatArray, **options: Any) -> NormalSolution:
    """Patches and pressures of every row; contract in `normal.model`.

    Strips are rows of cells, of which 1.5 on each side are kept free for the patch's
    edge; `patch.grid` has the pressure of the cells, `patch.planes` the rows: at their
    own positions on the profile, all in the plane of the patch. A rough solution is
    that of the search, or the first one on fitted grids. The parameters are
    "half_space_tolerance", the change of the pressures at which the iteration stops,
    3e-5 by default [-], and "half_space_iterations", its limit, 1000 by default.
    """
    states = [
        solve_wheel(gap, gap_row, weight, **options)
        for gap_row, weight in zip(row.tolist(), load.tolist(), strict=True)
    ]
    solution = _assembled(gap, row, states, options["vertical"])
    return (
        solution
        if options.get("rough")
        else replace(
            solution, patch=replace(solution.patch, planes=_rows(gap, solution))
        )
    )


def solve_wheel(
    gap: Gap,
    row: int,
    load: float,
    *,
    rough: bool = False,
    **options: Any,
) -> WheelPressure:
    """Pressures of one wheel.

    Parameters
    ----------
    gap, rough, **options
        As of `solve`.
    row : int
        Which row of the gap.
    load : float
        Of this row [N].

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
    if not curve[lowest] < NO_WHEEL:  # also true for NaN
        raise fault_of(NO_CONTACT, row)
    if (
        not 0 < lowest < curve.size - 1
        or max(curve[lowest - 1], curve[lowest + 1]) >= NO_WHEEL
    ):
        raise fault_of(AT_EDGE, row)
    task = _Task(gap, row, load, **options)
    state = task.searched()
    if rough:
        angle = list(map(partial(angle_of, gap), state.regions, state.pressure))
        if all(
            abs(new - old.angle) < _NEARLY
            for new, old in zip(angle, state.regions, strict=True)
        ):
            return task.turned(state, angle)
    return task.fitted(state, rough)


def _carried(state: WheelPressure, vertical: bool) -> float:
    """Load of a wheel: vertical, or the normal force [N]."""
    return sum(
        float(pressure.sum() * np.prod(region.cell))
        * (float(np.cos(region.angle)) if vertical else 1.0)
        for region, pressure in zip(state.regions, state.pressure, strict=True)
    )


@dataclass(frozen=True)
class _Task:
    """Gap, row, load and options of one wheel."""

    gap: Gap
    row: int
    load: float
    vertical: bool
    effective_modulus: float
    resolution: Resolution
    parameters: dict[str, float]

    def parameter(self, name: str) -> float:
        """Parameter of the model."""
        return {**DEFAULTS, **self.parameters}[name]

    def searched(self) -> WheelPressure:
        """Pressures on coarse grids over the overlap of the rigid surfaces."""
        level = (self.load / self.effective_modulus) ** (2.0 / 3.0) * 1.5
        counts: tuple[int, ...] = ()
        for trial in range(_TRIALS):
            regions = overlaps(self.gap, self.row, level)
            alone = np.zeros((len(regions), len(regions)))
            state = self.pressed(regions, alone, 0.0, None, 1e-3, counts)
            counts = state.iterations
            if 0.5 * level < state.vertical_displacement < level / 1.02:
                return state
            aim = 1.15 * min(
                max(state.vertical_displacement, 0.1 * level), 10.0 * level
            )
            # Where surfaces conform, the plane rotates with the level; half a step
            # avoids oscillation.
            level = aim if trial < 2 else float(np.sqrt(level * aim))
        raise fault_of(NO_CONVERGENCE, self.row)

    def fitted(self, state: WheelPressure, rough: bool) -> WheelPressure:
        """Fit grids to the patches of a state repeatedly until they are unchanged.

        Grids are coarse at first; rough solutions have no others.
        """
        gap, tolerance = self.gap, self.parameter("half_space_tolerance")
        fine, coarse = (
            (self.resolution, tolerance),
            (_coarser(self.resolution), max(tolerance, 1e-3)),
        )
        coupled, settled = np.zeros((0, 0)), False
        steps = [coarse, *[fine] * (_FITS - 1)]
        for fit, (resolution, tolerance) in enumerate(steps):
            old = list(zip(state.regions, state.pressure, strict=True))
            groups = [lobes_of(gap, region, pressure) for region, pressure in old]
            if not settled:
                before = coupled
                groups, coupled, outside = self.gathered(state, groups)
                same = _alike(before, coupled) and not outside
                settled = same or fit >= _GATHERED
            elif not all(groups):  # a grid without load
                kept = np.flatnonzero([bool(group) for group in groups])
                groups, coupled = [*filter(None, groups)], coupled[np.ix_(kept, kept)]
            regions = place_grids(gap, self.row, groups, coupled, resolution)
            inside = [not touches_edge(*pair) for pair in old]
            equal = len(regions) == len(old)
            fitting = (
                equal
                and all(inside)
                and (
                    fit > _LAID or all(map(partial(fits, gap), state.regions, regions))
                )
            )
            if settled and fitting and all(map(_still, state.regions, regions)):
                return self.turned(state, [region.angle for region in regions])
            if fit >= _LAID and equal:
                regions = _half_turned(state.regions, regions, inside)
            start = tuple(carried_over(gap, old, region) for region in regions)
            displacement = state.vertical_displacement
            state = self.pressed(
                regions, coupled, displacement, start, tolerance, state.iterations
            )
            if rough:
                return self.turned(
                    state, list(map(partial(angle_of, gap), regions, state.pressure))
                )
        raise fault_of(NO_CONVERGENCE, self.row)

    def gathered(
        self, state: WheelPressure, groups: list[list[Lobe]]
    ) -> tuple[list[list[Lobe]], FloatArray, bool]:
        """Group the lobes of a state by grid, with those outside of its grids.

        Returns groups, their coupling, and true if there are lobes outside.
        """
        outside = missed(
            self.gap,
            state.regions,
            state.pressure,
            state.vertical_displacement,
            self.effective_modulus,
        )
        inside = [lobe for group in groups for lobe in group]
        return *gather(self.gap, [*inside, *outside]), bool(outside)

    def pressed(
        self,
        regions: Sequence[Region],
        coupled: FloatArray,
        displacement: float,
        start: Sequence[FloatArray] | None,
        tolerance: float,
        iterations: tuple[int, ...],
    ) -> WheelPressure:
        """Pressures on grids, with heights at some displacement.

        `iterations` are those of the steps before.
        """
        grids = [heights(self.gap, region, displacement) for region in regions]
        solution = solve_pressure(
            grids,
            self.load if self.vertical else self.load * grids[0].cosine,
            self.effective_modulus,
            coupling=coupling_of(self.gap, regions, coupled, self.effective_modulus),
            start=start,
            tolerance=tolerance,
            limit=int(self.parameter("half_space_iterations")),
        )
        if not solution.converged:
            raise fault_of(NO_CONVERGENCE, self.row)
        displacement += solution.vertical_displacement
        counts = (*iterations, solution.iterations)
        return WheelPressure(tuple(regions), solution.pressure, displacement, counts)

    def turned(self, state: WheelPressure, angle: Sequence[float]) -> WheelPressure:
        """Rotate the planes of a state to angles nearby.

        Heights are exact to the second order; the load is unchanged.
        """
        regions = tuple(map(turned, state.regions, angle))
        share = self.load / _carried(replace(state, regions=regions), self.vertical)
        return replace(
            state,
            regions=regions,
            pressure=tuple(share * field for field in state.pressure),
        )


def _coarser(resolution: Resolution) -> Resolution:
    """Reduce the resolution to two thirds, for grids that locate the final ones."""
    strips, cells = (
        max(2 * count // 3, 8) for count in (resolution.strips, resolution.cells)
    )
    return Resolution(1.5 * resolution.cell, strips, cells, resolution.most)


def _alike(before: FloatArray, after: FloatArray) -> bool:
    """Return True if the coupling of grids has not changed."""
    return before.shape == after.shape and np.abs(after - before).max() < _ALIKE


def _half_turned(
    old: Sequence[Region], new: Sequence[Region], inside: Sequence[bool]
) -> list[Region]:
    """Rotate planes half a step, which avoids oscillation.

    Borders of patches inside their grids are kept.
    """
    return [
        turned(
            old_region,
            0.5 * (old_region.angle + new_region.angle),
            None if held else new_region,
        )
        for old_region, new_region, held in zip(old, new, inside, strict=True)
    ]


def _still(old: Region, new: Region) -> bool:
    """Return True if the rotation of a plane has a negligible effect on the load."""
    return abs(new.angle - old.angle) < _STILL * float(np.cos(old.angle))


def _assembled(
    gap: Gap, row: IntArray, states: list[WheelPressure], vertical: bool
) -> NormalSolution:
    """Patches of all rows in their order."""
    lines: list[dict[str, Any]] = []
    for gap_row, state in zip(row, states, strict=True):
        loaded = [
            pair
            for pair in zip(state.regions, state.pressure, strict=True)
            if pair[1].any()
        ]
        patches = [
            line
            for pair in loaded
            if (line := _line(gap, *pair, state.vertical_displacement))
        ]
        scale = 1.0
        # faint patches may lie at an edge, the others carry their load
        if len(patches) < len(loaded):
            load = _carried(state, vertical)
            kept = sum(
                line["force"] * (np.cos(line["angle"]) if vertical else 1.0)
                for line in patches
            )
            if not kept > (1.0 - FAINT) * load:
                raise fault_of(AT_EDGE, int(gap_row))
            scale = load / kept
        if len(patches) > 1 and not vertical:
            raise fault_of(NOT_SINGLE, int(gap_row))
        for line in sorted(patches, key=lambda line: -line["force"]):
            line |= {
                "scale": scale,
                "force": scale * line["force"],
                "pressure": scale * line["pressure"],
            }
            lines.append(line)

    cells, strips = (
        np.array([line["pressure"].shape for line in lines], dtype=np.int64)
        .reshape(-1, 2)
        .T
    )
    count, nx, ny = len(lines), cells.max(initial=1), strips.max(initial=1)
    y, edges, pressure = (
        np.zeros((count, ny)),
        np.zeros((count, ny + 1)),
        np.zeros((count, nx, ny)),
    )
    for m, line in enumerate(lines):
        y[m, : strips[m]], pressure[m, : cells[m], : strips[m]] = (
            line["y"],
            line["pressure"],
        )
        edges[m, : strips[m] + 1], edges[m, strips[m] + 1 :] = (
            line["edges"],
            line["edges"][-1],
        )

    def column(name: str) -> FloatArray:
        return np.array([line[name] for line in lines], dtype=np.float64)

    grid = PatchGrid(column("x_lead"), column("cell_length"), pressure)
    patch = from_grid(
        column("row").astype(np.int64), y, column("width"), grid, strips, cells
    )
    return NormalSolution(
        patch=patch,
        centre_y=column("centre"),
        contact_angle=column("angle"),
        approach=column("approach"),
        normal_force=column("force"),
        max_pressure=grid.pressure.max(axis=(1, 2)),
        edge_y=edges,
        load_scale=column("scale"),
        vertical_displacement=column("vertical_displacement"),
    )


def _rows(gap: Gap, solution: NormalSolution) -> StripPlanes:
    """Convert rows of cells to strips in the plane of their patch.

    Their positions are those of the rows on the profile.
    """
    patch, face = solution.patch, gap.counterface
    half = 0.5 * (patch.x_lead - patch.x_trail)
    station = np.interp(solution.centre_y, face.y, arc_length(face.y, face.z))
    return StripPlanes(
        y=0.5 * (solution.edge_y[:, 1:] + solution.edge_y[:, :-1]),
        station=station[:, None] + patch.y,
        width=np.where(half > 0.0, patch.width[:, None], 0.0),
        half=half,
        middle=0.5 * (patch.x_lead + patch.x_trail),
        peak=patch.pressure_slope * half,
        angle=np.repeat(solution.contact_angle[:, None], half.shape[1], axis=1),
    )


def _line(
    gap: Gap, region: Region, pressure: FloatArray, displacement: float
) -> dict[str, Any] | None:
    """Patch on one grid, if it is complete.

    Lengths count from its pressure-weighted centre and the contact line.
    """
    length, width = region.cell
    curve, grid = gap.gap[region.row], gap.counterface
    section, s, load = (
        Section(gap, region.y, region.angle),
        region.s,
        pressure.sum(axis=0),
    )
    middle = float((load * s).sum() / load.sum())
    centre = float(section.lateral(np.array([middle]))[0])
    edges = section.lateral(np.append(s - 0.5 * width, s[-1] + 0.5 * width))
    first_loaded, last_loaded = np.flatnonzero(load)[[0, -1]]
    first, last = (
        np.searchsorted(grid.y, edges[first_loaded]) - 2,
        np.searchsorted(grid.y, edges[last_loaded + 1]) + 2,
    )
    # Cells beyond the end of a profile carry no load: a patch within half a strip of it
    # is cut off.
    low, high = s[first_loaded] - width, s[last_loaded] + width
    cut = (section.part.start == 0 and low < section.ends[0]) or (
        section.part.stop == grid.y.size and high > section.ends[1]
    )
    if cut or first < 0 or last > grid.y.size or curve[first:last].max() >= NO_WHEEL:
        return None
    ahead = origin_x(gap, region) - float(np.interp(centre, grid.y, gap.x[region.row]))
    lowest = float(curve[first:last].min() - curve.min())
    return {
        "row": region.row,
        "centre": centre,
        "angle": region.angle,
        "approach": (displacement - lowest) * float(np.cos(region.angle)),
        "force": float(pressure.sum()) * length * width,
        "vertical_displacement": float(plane_of(gap, region).vertical_displacement[0])
        + displacement,
        "y": s - middle,
        "width": width,
        "edges": edges,
        "x_lead": region.x_high + ahead,
        "cell_length": length,
        "pressure": pressure,
    }


MODEL = NormalModel(
    name="half_space",
    title="half-space",
    solve=solve,
    parameters=DEFAULTS,
    fewest=8,
    chunk=2,
)
