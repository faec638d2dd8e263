"""The four contact problems in sequence for a batch of points, on several threads."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.axle import UNKNOWNS, Wheelsets
from wearsim.contact.balance import (
    ACCEPTED,
    Equilibria,
    Guided,
    Settled,
    balanced,
    settled,
)
from wearsim.contact.equilibrium import rotation_without_creepage
from wearsim.contact.guidance import Guidance, in_given_place
from wearsim.contact.kernel import leaf_kernel, plain
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.patch import FloatArray, IntArray, SurfaceFields, mean_over_planes
from wearsim.contact.problem import (
    ContactConditions,
    ContactModels,
    ContactSolution,
    Counterface,
    Wheelset,
)
from wearsim.contact.rough_axle import begun_with_coarse_patches
from wearsim.contact.tangential import TANGENTIAL_MODELS, TangentialSolution, Wanted
from wearsim.contact.track_forces import track_forces
from wearsim.contact.wheels import (
    Task,
    Wheels,
    by_point,
    contact_joined,
    contact_where,
    height,
    joined,
    patches_where,
    planes_of,
)
from wearsim.errors import ContactError

__all__ = [
    "CHUNK",
    "ContactConditions",
    "ContactModels",
    "ContactSolution",
    "Counterface",
    "Wheelset",
    "available_cores",
    "solve",
    "solve_each",
    "solve_guided",
]

# Largest number of operating points per task. It does not depend on the number of
# threads, so that the bits are the same.
CHUNK = 256

# Allocated and freed at once: glibc keeps freed blocks up to the size of the largest
# one it has seen, at most 32 MB. Without this, memory that each chunk takes from the
# system costs two threads a sixth of their time.
np.empty(2**22 - 2**13)

Result = TypeVar("Result")
Chunk = TypeVar("Chunk")


def solve(
    conditions: ContactConditions,
    wheelset: Wheelset,
    counterface: Counterface,
    models: ContactModels,
    *,
    sides: tuple[int, ...] = (0, 1),
    vertical: bool = True,
    threads: int = 1,
) -> ContactSolution:
    """Solve the contact of every operating point.

    Parameters
    ----------
    conditions : ContactConditions
        n operating points.
    wheelset : Wheelset
        Both wheels; free rotation and free roll need both even if `sides` is one.
    counterface : Counterface
        Rails or rollers.
    models : ContactModels
        Normal and tangential model, grid and material.
    sides : tuple of int
        Wheels in the solution: 0 right, 1 left.
    vertical : bool
        Whether `wheel_load` is the vertical load of the wheel, carried by normal and
        creep forces of its patches, or the normal force of its single patch.
    threads : int
        Chunks of points are solved on so many threads; the result has the same bits for
        any number.

    Returns
    -------
    ContactSolution
        Every patch of every wheel.

    Raises
    ------
    ContactError
        If a wheel is not in contact, its patch reaches the edge of a profile, or
        creepages are given and several patches close; the message names the point, and
        `row` of the error is its index.
    """
    parts = solve_each(
        conditions,
        wheelset,
        counterface,
        models,
        lambda part: part,
        sides=sides,
        vertical=vertical,
        threads=threads,
    )
    return parts[0] if len(parts) == 1 else joined(parts)


def available_cores() -> int:
    """Return the number of cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def solve_each(
    conditions: ContactConditions,
    wheelset: Wheelset,
    counterface: Counterface,
    models: ContactModels,
    summary: Callable[[ContactSolution], Result],
    *,
    sides: tuple[int, ...] = (0, 1),
    vertical: bool = True,
    threads: int = 1,
    failed: dict[int, ContactError] | None = None,
    fields: Wanted = True,
) -> list[Result]:
    """Solve chunk by chunk and keep only the `summary` of each chunk's solution.

    The fields of a batch of points need a hundred times the memory of the rest. A
    caller that needs only a sum of them passes it as `summary`, which runs on the
    chunk's thread. Points without a solution are omitted and put into `failed` with
    their errors, where it is given; the rest of their chunk is solved without them.
    With `fields` "work" pressure, shear and slip are undefined: models need not compute
    them. Other parameters: see `solve`.

    Returns
    -------
    list
        What `summary` returned, in the order of the points.
    """
    moment = conditions.box_moment
    if not vertical and moment is not None and np.isfinite(moment).any():
        raise ContactError(
            "box moments share vertical loads; leave them out where normal forces are "
            "given"
        )
    count = conditions.shift.size
    rail = _rails_of(conditions)
    tasks = _tasks(
        rail,
        wheelset,
        counterface,
        models,
        sides=sides,
        vertical=vertical,
        fields=fields,
    )
    # chunks of points on the same rails
    size = _largest_chunk(models)
    starts = sorted(
        {*range(0, max(count, 1), size), *(np.flatnonzero(np.diff(rail)) + 1).tolist()}
    )
    ends = dict(zip(starts, [*starts[1:], count], strict=True))

    def part(start: int) -> Result:
        index = np.arange(start, ends[start])
        task = tasks[int(rail[start]) if count else 0]
        while True:
            try:
                solution = _solve_chunk(task, conditions.at(index), index)
                break
            except ContactError as error:
                if failed is None or error.row is None:
                    raise
                failed.update(dict.fromkeys(error.rows, error))
                index = index[~np.isin(index, error.rows)]
        return summary(solution)

    return _on_threads(part, starts, threads)


def _on_threads(
    solved: Callable[[Chunk], Result], chunks: Sequence[Chunk], threads: int
) -> list[Result]:
    """Solve chunks on threads, in their order."""
    if threads > 1 and len(chunks) > 1:
        with ThreadPoolExecutor(threads) as pool:
            return list(pool.map(solved, chunks))
    return [solved(chunk) for chunk in chunks]


def _largest_chunk(models: ContactModels) -> int:
    """Return the largest number of points that are solved together with some models."""
    return min(
        CHUNK,
        NORMAL_MODELS[models.normal].chunk,
        TANGENTIAL_MODELS[models.tangential].chunk,
    )


def _rails_of(conditions: ContactConditions) -> IntArray:
    """Pair of rails (n,) that each point runs on."""
    return (
        np.zeros(conditions.shift.size, dtype=np.int64)
        if conditions.rail is None
        else conditions.rail
    )


def _tasks(
    rail: IntArray,
    wheelset: Wheelset,
    counterface: Counterface,
    models: ContactModels,
    *,
    sides: tuple[int, ...] = (0, 1),
    vertical: bool = True,
    fields: Wanted = True,
) -> dict[int, Task]:
    """Tasks on each of the pairs of rails (n,) of the points.

    Options are those of `solve_each`.
    """
    rails = (counterface, *counterface.further)
    return {
        k: Task(
            wheelset.surfaces,
            rails[k].surfaces,
            wheelset,
            rails[k].curvatures,
            rails[k].seen_in_motion,
            models,
            sides,
            vertical,
            fields,
        )
        for k in np.unique(rail).tolist() or [0]
    }


def solve_guided(
    conditions: ContactConditions,
    guidance: Guidance,
    wheelset: Wheelset,
    counterface: Counterface,
    models: ContactModels,
    tolerance: float,
    *,
    near: bool = False,
    nearby: Equilibria | None = None,
    threads: int = 1,
) -> Guided:
    """Solve for the positions of wheelsets under guiding forces.

    Parameters
    ----------
    conditions : ContactConditions
        n operating points; shifts, yaws and wheel loads that follow from forces are
        where the search begins.
    guidance : Guidance
        Forces on them. Both axles of a bogie run on the same rails.
    wheelset, counterface, models
        As in `solve`.
    tolerance : float
        Of forces, over the axle load.
    near : bool
        Whether the wheelsets begin near the balance.
    nearby : Equilibria, optional
        Of like points, to begin with, with slopes or NaN in their place; by default the
        search begins with coarse patches.
    threads : int
        Of the solution; the result has the same bits for any number.

    Returns
    -------
    Guided
        Of all points; `residual` is infinite where there is no contact to begin with.
    """
    rail = _rails_of(conditions)
    tasks = _tasks(rail, wheelset, counterface, models, fields="work")
    chunks = _chunks_with_partners(
        rail, guidance.partner, max(2, _largest_chunk(models))
    )

    def part(index: IntArray) -> Guided:
        task, chunk = tasks[int(rail[index[0]])], conditions.at(index)
        chunk_guidance = guidance.at(index)
        if nearby is None:
            return _guided_anew(task, chunk, chunk_guidance, index, tolerance, near)
        problem = Wheelsets(
            task, chunk, chunk_guidance, _given_speed(task, chunk, index)
        )
        slope = nearby.slope[index]
        return balanced(
            problem,
            nearby.unknown[index],
            tolerance,
            slope,
            near=True,
            enough=ACCEPTED,
        )

    whole: Guided = joined(
        _on_threads(part, chunks, threads),
        np.argsort(np.concatenate(chunks), kind="stable"),
    )
    return whole


def _chunks_with_partners(
    rail: IntArray, partner: IntArray, size: int
) -> list[IntArray]:
    """Points in chunks of up to a size on the same rails, each before its partner."""
    first = np.minimum(np.arange(partner.size), partner)
    order = np.lexsort((np.arange(partner.size), first, rail))
    chunks: list[IntArray] = []
    begin = 0
    while begin < order.size:
        end = min(
            begin + size,
            int(np.searchsorted(rail[order], rail[order[begin]], side="right")),
        )
        if end < order.size and partner[order[end - 1]] == order[end]:
            end -= 1
        chunks.append(order[begin:end])
        begin = end
    return chunks


def _guided_anew(
    task: Task,
    chunk: ContactConditions,
    guidance: Guidance,
    index: IntArray,
    tolerance: float,
    near: bool,
) -> Guided:
    """Restart the search from coarse patches at the positions of the wheelsets.

    A wheelset without contact there starts at the track centre.
    """
    speed = _given_speed(task, chunk, index)
    unknown, slopes, begun = _begun(Wheelsets(task, chunk, guidance, speed))
    if not begun.all():
        middle = np.where(begun | ~guidance.free[:, 0], chunk.shift, 0.0)
        chunk = replace(chunk, shift=middle)
        rest = np.flatnonzero(~begun)
        of_rest = Wheelsets(task, chunk, guidance, speed).at(rest)
        unknown[rest], slopes[rest], _ = _begun(of_rest)
    return balanced(
        Wheelsets(task, chunk, guidance, speed), unknown, tolerance, slopes, near=near
    )


def _begun(problem: Wheelsets) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """Unknowns (n, 7) and slopes (n, 7, 7) of coarse patches, and their mask (n,).

    They are 0 for wheelsets without coarse patches.
    """
    unknown = np.zeros((problem.count, UNKNOWNS))
    slopes = np.zeros((problem.count, UNKNOWNS, UNKNOWNS))
    begun = np.ones(problem.count, dtype=bool)
    while begun.any():
        rows = np.flatnonzero(begun)
        try:
            unknown[rows], slopes[rows], _ = begun_with_coarse_patches(problem.at(rows))
            break
        except ContactError as error:
            if error.row is None:
                raise
            begun[rows[[error.row, *error.rows]]] = False
    return unknown, slopes, begun


def _placed(
    error: ContactError, chunk: ContactConditions, index: IntArray
) -> ContactError:
    """Return the error with the number of its operating point."""
    row, side = error.row or 0, error.side
    wheel = "" if side is None else "left wheel, " if side else "right wheel, "
    place = (
        f"{wheel}shift {1e3 * chunk.axle_shift()[row]:g} mm, yaw "
        f"{1e3 * chunk.yaw[row]:g} mrad"
    )
    point = int(index[row])
    return error.of_point(
        point,
        index[list(error.rows)].tolist(),
        place=place,
        numbered=point > 0 or chunk.shift.size > 1,  # a single point needs no number
    )


def _solve_chunk(
    task: Task, chunk: ContactConditions, index: IntArray
) -> ContactSolution:
    """Solve all four problems for the points at `index`.

    The search starts from nearby equilibria if there are any.
    """
    if chunk.nearby is None:
        return _solved_from(task, chunk, index)
    near = np.isfinite(chunk.nearby).all(axis=1)
    parts: list[ContactSolution] = []
    while near.any() and not parts:
        try:
            parts.append(
                _solved_from(task, chunk.at(np.flatnonzero(near)), index[near])
            )
        except ContactError as error:
            near &= ~np.isin(index, error.rows) & (error.row is not None)
    if not parts or not near.all():
        anew = replace(chunk, nearby=None).at(np.flatnonzero(~near))
        parts.append(_solved_from(task, anew, index[~near]))
    place = np.concatenate([2 * part.point + part.side for part in parts])
    whole: ContactSolution = joined(
        parts, np.argsort(place, kind="stable") if len(parts) > 1 else None
    )
    return whole


def _solved_from(
    task: Task, chunk: ContactConditions, index: IntArray
) -> ContactSolution:
    """Solve a chunk from its starting point."""
    speed = _given_speed(task, chunk, index)
    numbers = (0, 1) if _bound(chunk, speed) else task.sides
    problems = _together(task, chunk, numbers, speed)
    try:
        parts = [_settled(problem) for problem in problems]
    except ContactError as error:
        if error.row is None:  # a fault of the grid, not of a point
            raise
        raise _placed(error, chunk, index) from None
    wheels, order = by_point([part.wheels for part in parts])
    contact = contact_joined([part.contact for part in parts], order)
    if numbers != task.sides:
        on_sides = np.isin(wheels.sign < 0.0, np.array(task.sides) == 1)
        wheels, contact = (
            patches_where(wheels, on_sides),
            contact_where(contact, on_sides),
        )
    nearby = Equilibria.found(parts[0].unknown, parts[0].slopes).placed
    for problem, part in zip(problems[1:], parts[1:], strict=True):
        searched: FloatArray = problem.wanted.astype(np.float64)
        of_problem = Equilibria.found(
            searched, searched[:, None] * searched[:, :, None]
        ).placed
        nearby = np.where(
            of_problem == 1.0,
            Equilibria.found(part.unknown, part.slopes).placed,
            nearby,
        )
    turning, roll = (
        problems[0].speed(parts[0].unknown),
        problems[0].roll(parts[0].unknown),
    )
    return _finish(task, wheels, contact, nearby, turning, roll, index)


def _bound(chunk: ContactConditions, speed: FloatArray | None) -> bool:
    """Return True if rotation speed, roll or load sharing couple the two wheels."""
    shared = chunk.box_moment is not None and bool(np.isfinite(chunk.box_moment).any())
    return speed is None or chunk.free_roll or shared


def _together(
    task: Task,
    chunk: ContactConditions,
    sides: tuple[int, ...],
    speed: FloatArray | None,
) -> list[Wheelsets]:
    """Wheelsets of a chunk.

    Wheels without coupling are solved separately.
    """
    placed = in_given_place(chunk)
    groups = [sides] if _bound(chunk, speed) else [(side,) for side in sides]
    return [Wheelsets(task, chunk, placed, speed, group) for group in groups]


def _settled(problem: Wheelsets) -> Settled:
    """Balance wheelsets, from coarse patches or from an equilibrium nearby."""
    nearby = problem.chunk.nearby
    if nearby is None:
        return settled(problem, *begun_with_coarse_patches(problem))
    begin = Equilibria.of_placed(nearby)
    return settled(problem, np.nan_to_num(begin.unknown), np.nan_to_num(begin.slope))


def _given_speed(
    task: Task, chunk: ContactConditions, index: IntArray
) -> FloatArray | None:
    """Rotation speed (n, 2) that does not follow from torques [rad/s], or None."""
    if chunk.rotates_freely:
        return None
    return np.repeat(_rotation_speed(task, chunk, index)[:, None], 2, axis=1)


def _rotation_speed(
    task: Task, chunk: ContactConditions, index: IntArray
) -> FloatArray:
    """Prescribed rotation speed (n,), negative when rolling forwards [rad/s].

    It does not follow from the torque.
    """
    if not isinstance(chunk.rotation, str) and chunk.creepage is None:
        return -np.asarray(chunk.rotation, dtype=float)
    nominal: FloatArray = -chunk.speed / task.wheelset.radius
    if chunk.creepage is None and chunk.rotation == "centred":
        still = np.zeros_like(chunk.shift)
        central = replace(
            chunk,
            shift=still,
            yaw=still,
            roll=still,
            track_curvature=still,
            nearby=None,
            free_roll=False,
            box_moment=None,
        )
        try:
            both = np.repeat(nominal[:, None], 2, axis=1)
            (problem,) = _together(task, central, task.sides[:1], both)
            wheels = _settled(problem).wheels
        except ContactError as error:
            if error.row is None:
                raise
            raise _placed(error, central, index) from None
        normal_force = planes_of(wheels.normal).normal_force
        return rotation_without_creepage(
            wheels.kinematics, normal_force, wheels.normal.patch.row, still.size
        )
    return nominal


def _finish(
    task: Task,
    solved: Wheels,
    contact: TangentialSolution,
    nearby: FloatArray,
    speed: FloatArray,
    roll: FloatArray,
    index: IntArray,
) -> ContactSolution:
    """Resultants, power and fields of all patches, mirrored back for left wheels."""
    normal, sign = solved.normal, solved.sign
    patch, planes, force = normal.patch, planes_of(normal), contact.plane_force
    turning = speed.ravel()[solved.place]
    motion = solved.kinematics.creepage(turning)
    creepage = mean_over_planes(motion, planes.normal_force)
    # Adding 0.0 below converts a mirrored -0.0 to 0.0.
    power = np.maximum(-(force * motion).sum(axis=2).sum(axis=1) * solved.speed, 0.0)
    assert contact.cells is not None
    assert normal.stood_in is not None
    assert contact.stood_in is not None
    cells, local_power = plain(contact.cells), np.empty(power.size)
    work = np.empty(cells.shape[1:]) if len(cells) > 1 else cells[0]
    cell_area = contact.cell_length * patch.width[:, None]
    left = sign < 0.0
    z = height(task, left, normal.vertical_displacement, planes.y)
    curvature = np.where(left, task.curvature[1], task.curvature[0])
    on_track = track_forces(solved, planes, force, z, curvature)
    if patch.planes is not None:
        z = height(task, left, normal.vertical_displacement, normal.centre_y[:, None])
        patch = replace(
            patch,
            planes=replace(
                patch.planes, angle=sign[:, None] * patch.planes.angle + 0.0
            ),
        )
    _scale_work(cells, cell_area, solved.speed, power, sign, work, local_power)
    if len(cells) == 1:
        cells = np.broadcast_to(np.nan, (5, *work.shape))
    fields = SurfaceFields(
        cells[0],
        cells[1],
        cells[2],
        cells[3],
        cells[4],
        work,
        contact.x_lead,
        contact.cell_length,
        patch.width,
        solved.speed,
    )
    return ContactSolution(
        point=index[patch.row],
        side=left.astype(np.int64),
        wheel_y=solved.wheel_y,
        rail_y=normal.centre_y,
        x=solved.kinematics.x[:, 0],
        z=z[:, 0],
        contact_angle=sign * normal.contact_angle + 0.0,
        area=patch.area,
        max_pressure=normal.max_pressure,
        length=patch.length,
        width=patch.lateral_extent,
        approach=normal.approach,
        normal_force=normal.normal_force,
        load_scale=normal.load_scale,
        stood_in=(normal.stood_in | contact.stood_in).astype(np.int64),
        creepage_x=creepage[:, 0],
        creepage_y=sign * creepage[:, 1] + 0.0,
        spin=sign * creepage[:, 2] + 0.0,
        force_x=contact.force[:, 0],
        force_y=sign * contact.force[:, 1] + 0.0,
        spin_moment=sign * contact.force[:, 2] + 0.0,
        slip_area=contact.slip_area,
        track_lateral=on_track.lateral + 0.0,
        track_vertical=on_track.vertical,
        track_longitudinal=on_track.longitudinal,
        track_yaw_moment=on_track.yaw_moment + 0.0,
        track_roll_moment=on_track.roll_moment + 0.0,
        power=power,
        power_balance=np.where(
            power > 0.0, local_power / np.where(power > 0.0, power, 1.0), 1.0
        ),
        roll=roll[patch.row],
        nearby=nearby[patch.row],
        rotation_speed=-turning,
        strip_edges_wheel_y=solved.edges_wheel_y,
        strip_edges_rail_y=normal.edge_y,
        patch=replace(patch, row=index[patch.row]),
        fields=fields,
    )


@leaf_kernel
def _scale_work(
    fields: FloatArray,
    cell_area: FloatArray,
    speed: FloatArray,
    power: FloatArray,
    sign: FloatArray,
    work: FloatArray,
    local_power: FloatArray,
) -> None:
    """Scale the work density of each cell to the patch's power.

    Lateral shear and slip are mirrored in place. `work` (m, nx, ny) is filled unless it
    is the only one of the fields; `local_power` (m,) is the sum over cells before
    scaling.
    """
    whole = fields.shape[0] > 1
    patches, cells, strips = work.shape
    for m in range(patches):
        total = 0.0
        for i in range(cells):
            for j in range(strips if whole else 0):
                value = (
                    fields[1, m, i, j] * fields[3, m, i, j]
                    + fields[2, m, i, j] * fields[4, m, i, j]
                )
                work[m, i, j] = -value
            for j in range(strips):
                total += work[m, i, j] * cell_area[m, j]
        local_power[m] = total * speed[m]
        scale = power[m] / local_power[m] if local_power[m] > 0.0 else 0.0
        for i in range(cells):
            for j in range(strips):
                work[m, i, j] *= scale
        for i in range(
            cells if sign[m] < 0.0 and whole else 0
        ):  # arrays would take seconds to compile
            for j in range(strips):
                fields[2, m, i, j] *= -1.0
                fields[4, m, i, j] *= -1.0
