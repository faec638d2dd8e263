"""The four contact problems in a row, for a batch of operating points, on several threads."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar

import numpy as np

from wearsim.contact import geometry
from wearsim.contact.creepage import ContactPoint, Kinematics, kinematics, moved
from wearsim.contact.equilibrium import balanced_rotation, resting_roll, rotation_without_creepage
from wearsim.contact.geometry import CounterfaceProfile, WheelsetPose, WheelSurface
from wearsim.contact.kernel import kernel
from wearsim.contact.normal import NORMAL_MODELS, NormalSolution
from wearsim.contact.patch import FloatArray, IntArray, SurfaceFields
from wearsim.contact.problem import ContactConditions, ContactModels, ContactSolution, Counterface, Wheelset
from wearsim.contact.tangential import TANGENTIAL_MODELS, TangentialSolution
from wearsim.errors import ContactError

__all__ = [
    "CHUNK",
    "ContactConditions",
    "ContactModels",
    "ContactSolution",
    "Counterface",
    "Wheelset",
    "join",
    "solve",
    "solve_each",
]

CHUNK = 64  # operating points per task, whatever the number of threads: same bits for any number of them


Result = TypeVar("Result")


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
        Whether `wheel_load` is the vertical load of the wheel, carried by the vertical parts of the
        normal forces of its patches, or the normal force of its single patch.
    threads : int
        Chunks of points are solved on so many threads; the result has the same bits for any number.

    Returns
    -------
    ContactSolution
        Every patch of every wheel.

    Raises
    ------
    ContactError
        If a wheel is not in contact, its patch reaches the edge of a profile, or creepages are given and
        several patches close; the message names the point, and `row` of the error is its index.
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
    solution: ContactSolution = join(parts)
    return solution


def solve_each(
    conditions: ContactConditions,
    wheelset: Wheelset,
    counterface: Counterface,
    models: ContactModels,
    each: Callable[[ContactSolution], Result],
    *,
    sides: tuple[int, ...] = (0, 1),
    vertical: bool = True,
    threads: int = 1,
) -> list[Result]:
    """Solve chunk by chunk and keep only what `each` makes of a chunk's solution.

    The fields of a batch of points fill a hundred times the memory of the rest; whoever needs them only
    for a sum passes that sum as `each`, which runs on the chunk's thread. Other parameters: see `solve`.

    Returns
    -------
    list
        What `each` returned, in the order of the points.
    """
    count = conditions.shift.size
    task = _Task(
        wheels=tuple(geometry.wheel_surface(one, wheelset.radius) for one in (wheelset.right, wheelset.left)),
        counterfaces=_counterface_profiles(counterface),
        wheelset=wheelset,
        curvature=counterface.curvature,
        models=models,
        sides=sides,
        vertical=vertical,
    )
    starts = range(0, max(count, 1), CHUNK)

    def part(start: int) -> Result:
        chunk = _part(conditions, slice(start, min(start + CHUNK, count)))
        return each(_solve_chunk(task, chunk, start))

    if threads > 1 and len(starts) > 1:
        with ThreadPoolExecutor(threads) as pool:
            return list(pool.map(part, starts))
    return [part(start) for start in starts]


@dataclass(frozen=True)
class _Task:
    """Everything but the operating points; pairs are for the right and the left side."""

    wheels: tuple[WheelSurface, ...]
    counterfaces: tuple[CounterfaceProfile, ...]
    wheelset: Wheelset
    curvature: float
    models: ContactModels
    sides: tuple[int, ...]
    vertical: bool


def _counterface_profiles(counterface: Counterface) -> tuple[CounterfaceProfile, CounterfaceProfile]:
    right = geometry.counterface_profile(counterface.profile)
    return right, right if counterface.left is None else geometry.counterface_profile(counterface.left)


def _part(conditions: ContactConditions, part: slice) -> ContactConditions:
    changed = {
        f.name: getattr(conditions, f.name)[part]
        for f in fields(conditions)
        if isinstance(getattr(conditions, f.name), np.ndarray)
    }
    return replace(conditions, **changed)


def join(parts: Sequence[Any], order: IntArray | None = None, *, name: str = "") -> Any:
    """Put arrays behind one another along the first axis, and those in tuples, mappings and dataclasses.

    Parameters
    ----------
    parts : sequence
        Of one kind, such as what `solve_each` returned.
    order : (m,) int array, optional
        Another order of the whole.
    name : str
        Of the arrays: names with "edge" are filled up with their last value, others with zeros, where arrays
        have different numbers of strips or cells.

    Returns
    -------
    array, tuple, dict or dataclass
        As the parts.
    """
    first = parts[0]
    if first is None:
        return None
    if isinstance(first, np.ndarray):
        whole = np.concatenate(_padded(name, parts)) if len(parts) > 1 else first
        return whole if order is None else whole[order]
    if isinstance(first, tuple):
        return tuple(join(each, order, name=name) for each in zip(*parts, strict=True))
    if isinstance(first, dict):
        return {key: join([part[key] for part in parts], order, name=key) for key in first}
    joined = {
        f.name: join([getattr(part, f.name) for part in parts], order, name=f.name) for f in fields(first)
    }
    return type(first)(**joined)


def _padded(name: str, parts: Sequence[FloatArray]) -> Sequence[FloatArray]:
    """Arrays of equal shape but for the first axis: strips without length or width, cells without load."""
    if len({part.shape[1:] for part in parts}) == 1:
        return parts
    size = np.max([part.shape[1:] for part in parts], axis=0)
    mode: Any = "edge" if "edge" in name else "constant"
    return [
        np.pad(part, [(0, 0), *((0, new - old) for old, new in zip(part.shape[1:], size, strict=True))], mode)
        for part in parts
    ]


@dataclass(frozen=True)
class _Wheels:
    """Normal contact and kinematics of patches in the axes of a right wheel; `sign` is -1 for left ones."""

    sign: FloatArray
    normal: NormalSolution
    kinematics: Kinematics
    friction: FloatArray
    speed: FloatArray
    wheel_y: FloatArray
    edges_wheel_y: FloatArray


def _placed(
    error: ContactError, chunk: ContactConditions, start: int, side: int | None, hint: str = ""
) -> ContactError:
    """Return the same error with its operating point."""
    row = error.row or 0
    wheel = "" if side is None else "left wheel" if side else "right wheel"
    shift, yaw = 1e3 * chunk.shift[row], 1e3 * chunk.yaw[row]
    place = f"shift {shift:g} mm, yaw {yaw:g} mrad"
    place = f"{wheel}, {place}" if wheel else place
    if start > 0 or chunk.shift.size > 1:  # a single point needs no number
        place = f"point {start + row}, {place}"
    return type(error)(f"{place}: {error}{hint}", row=start + row)


def _solve_side(task: _Task, side: int, chunk: ContactConditions, start: int) -> _Wheels:
    """Geometrical, normal and kinematical problem of one side; a left wheel is mirrored to the right."""
    profile, models = task.counterfaces[side], task.models
    sign = -1.0 if side else 1.0
    pose = WheelsetPose(sign * chunk.shift, sign * chunk.yaw, sign * chunk.roll)
    span = {
        "half_span": task.wheelset.half_span,
        "nominal_radius": task.wheelset.radius,
        "curvature": task.curvature,
    }
    gap = geometry.gap(task.wheels[side], profile, pose, **span)
    try:
        normal = NORMAL_MODELS[models.normal](
            gap,
            np.arange(chunk.shift.size),
            chunk.wheel_load,
            vertical=task.vertical,
            effective_modulus=models.effective_modulus,
            resolution=models.resolution,
            parameters=dict(models.parameters),
        )
    except ContactError as error:
        raise _placed(error, chunk, start, side) from None
    row = normal.patch.row
    grid = profile.y

    def at(table: FloatArray, y: FloatArray) -> FloatArray:
        index = np.clip(np.searchsorted(grid, y, side="right") - 1, 0, grid.size - 2)
        share = (y - grid[index]) / (grid[index + 1] - grid[index])
        line = row.reshape((-1,) + (1,) * (y.ndim - 1))
        return table[line, index] + share * (table[line, index + 1] - table[line, index])

    reference = normal.reference_point
    centre = normal.centre_y if reference is None else reference.y
    counterface_z, apart = np.interp(centre, grid, profile.z), at(gap.gap, centre)
    # The wheel goes straight down, the gap is measured along the roller's radius there.
    slope = task.curvature * at(gap.x, centre) / (1.0 - task.curvature * (counterface_z - apart))
    motion = kinematics(
        ContactPoint(
            wheel_y=at(gap.wheel_y, centre),
            wheel_radius=at(gap.wheel_radius, centre),
            sin_theta=at(gap.sin_theta, centre),
            counterface_z=counterface_z,
            contact_angle=normal.contact_angle,
            approach=normal.approach if reference is None else reference.approach,
            overlap=normal.vertical_displacement / np.sqrt(1.0 + slope**2) - apart,
        ),
        WheelsetPose(pose.shift[row], pose.yaw[row], pose.roll[row]),
        speed=chunk.speed[row],
        track_curvature=sign * chunk.track_curvature[row],
        **span,
    )
    if reference is not None:
        motion = moved(motion, reference.along, reference.across)
    if chunk.creepage is not None:
        shared = np.flatnonzero(np.diff(row) == 0)
        if shared.size > 0:
            several = ContactError("several patches close", row=int(row[shared[0]]))
            raise _placed(several, chunk, start, side, ": given creepages belong to one; leave them out")
        given = chunk.creepage[row] * np.array([1.0, sign, sign])
        motion = replace(motion, at_rest=given, per_speed=np.zeros_like(given))
    return _Wheels(
        sign=np.full(row.size, sign),
        normal=normal,
        kinematics=motion,
        friction=chunk.friction[row],
        speed=chunk.speed[row],
        wheel_y=at(gap.wheel_y, normal.centre_y),
        edges_wheel_y=at(gap.wheel_y, normal.edge_y),
    )


def _solve_chunk(task: _Task, chunk: ContactConditions, start: int) -> ContactSolution:
    """All four problems for one chunk."""
    models, radius, sides = task.models, task.wheelset.radius, task.sides
    balance = isinstance(chunk.rotation, str) and chunk.rotation == "free" and chunk.creepage is None
    needed = (0, 1) if balance else sides
    if chunk.free_roll:
        chunk = replace(chunk, roll=_free_roll(task, chunk, start))
    solved = {side: _solve_side(task, side, chunk, start) for side in needed}
    both = _by_point([solved[side] for side in needed])

    def tangential(part: _Wheels, speed: FloatArray, fields: bool) -> TangentialSolution:
        return TANGENTIAL_MODELS[models.tangential](
            part.normal.patch,
            part.kinematics.creepage(speed[part.normal.patch.row]),
            part.friction,
            shear_modulus=models.shear_modulus,
            poisson_ratio=models.poisson_ratio,
            fields=fields,
        )

    def torque(speed: FloatArray) -> FloatArray:
        """Torque of the creep forces about the axle, by virtual work: V F . d(creepage)/d(speed)."""
        total = np.zeros_like(speed)
        work = (tangential(both, speed, False).force * both.kinematics.per_speed).sum(axis=1) * both.speed
        np.add.at(total, both.normal.patch.row, work)
        return total

    nominal = -chunk.speed / radius
    if chunk.creepage is not None:
        speed = nominal
    elif not isinstance(chunk.rotation, str):
        speed = -np.asarray(chunk.rotation, dtype=float)
    elif chunk.rotation == "nominal":
        speed = nominal
    elif chunk.rotation == "centred":
        still = np.zeros_like(chunk.shift)
        central = replace(chunk, shift=still, yaw=still, roll=still, track_curvature=still)
        middle = _solve_side(task, sides[0], central, start)
        speed = rotation_without_creepage(middle.kinematics, middle.normal.patch.row, chunk.shift.size)
    else:
        most = chunk.friction * chunk.wheel_load * radius
        try:
            speed = balanced_rotation(torque, nominal, chunk.torque, most)
        except ContactError as error:
            raise _placed(error, chunk, start, None) from None
    asked = both if needed == sides else _by_point([solved[side] for side in sides])
    try:
        contact = tangential(asked, speed, True)
    except ContactError as error:
        if error.row is None:  # the grid: a fault of no point
            raise
        raise _placed(error, chunk, start, None) from None
    return _finish(asked, contact, chunk.roll, speed, start)


def _free_roll(task: _Task, chunk: ContactConditions, start: int) -> FloatArray:
    """Roll of the wheelset that rests on both wheels."""
    rows = np.arange(chunk.shift.size)

    def displacements(angle: FloatArray) -> tuple[FloatArray, FloatArray]:
        tilted = replace(chunk, roll=angle, creepage=None)
        sides = [_solve_side(task, side, tilted, start).normal for side in (0, 1)]
        right, left = (one.vertical_displacement[np.searchsorted(one.patch.row, rows)] for one in sides)
        return right, left

    angle, solved = resting_roll(displacements, chunk.roll, task.wheelset.half_span)
    if not solved.all():
        error = ContactError(
            "no roll of the wheelset lets both wheels carry their loads", int(np.argmin(solved))
        )
        raise _placed(error, chunk, start, None, "; check shift, gauge and profiles, or give the roll")
    return angle


def _by_point(parts: list[_Wheels]) -> _Wheels:
    """Patches of one or both sides, ordered by point, side and falling normal force."""
    row = np.concatenate([part.normal.patch.row for part in parts])
    right_first = np.concatenate([-part.sign for part in parts])
    force = np.concatenate([part.normal.normal_force for part in parts])
    joined: _Wheels = join(parts, np.lexsort((-force, right_first, row)))
    return joined


def _finish(
    solved: _Wheels, contact: TangentialSolution, roll: FloatArray, speed: FloatArray, start: int
) -> ContactSolution:
    """Resultants, power and fields of all patches, mirrored back for left wheels."""
    normal, sign = solved.normal, solved.sign
    patch = normal.patch
    creepage = solved.kinematics.creepage(speed[patch.row])
    # Adding 0.0 below turns a mirrored -0.0 into 0.0.
    power = np.maximum(-(contact.force * creepage).sum(axis=1) * solved.speed, 0.0)
    assert contact.cells is not None
    pressure, shear_x, shear_y, slip_x, slip_y = contact.cells
    local, local_power = np.empty(pressure.shape), np.empty(power.size)
    cell_area = contact.cell_length * patch.width[:, None]
    _scale_work(shear_x, shear_y, slip_x, slip_y, cell_area, solved.speed, power, sign, local, local_power)
    return ContactSolution(
        point=start + patch.row,
        side=(sign < 0.0).astype(np.int64),
        wheel_y=solved.wheel_y,
        rail_y=normal.centre_y,
        x=solved.kinematics.x,
        contact_angle=sign * normal.contact_angle + 0.0,
        area=patch.area,
        max_pressure=normal.max_pressure,
        length=patch.length,
        width=patch.lateral_extent,
        approach=normal.approach,
        normal_force=normal.normal_force,
        load_scale=normal.load_scale,
        creepage_x=creepage[:, 0],
        creepage_y=sign * creepage[:, 1] + 0.0,
        spin=sign * creepage[:, 2] + 0.0,
        force_x=contact.force[:, 0],
        force_y=sign * contact.force[:, 1] + 0.0,
        spin_moment=sign * contact.force[:, 2] + 0.0,
        slip_area=contact.slip_area,
        power=power,
        power_balance=np.where(power > 0.0, local_power / np.where(power > 0.0, power, 1.0), 1.0),
        roll=roll[patch.row],
        rotation_speed=-speed[patch.row],
        strip_edges_wheel_y=solved.edges_wheel_y,
        strip_edges_rail_y=normal.edge_y,
        patch=replace(patch, row=start + patch.row),
        fields=SurfaceFields(
            pressure=pressure,
            shear_x=shear_x,
            shear_y=shear_y,
            slip_x=slip_x,
            slip_y=slip_y,
            work_density=local,
            x_lead=contact.x_lead,
            cell_length=contact.cell_length,
            strip_width=patch.width,
            speed=solved.speed,
        ),
    )


@kernel
def _scale_work(
    shear_x: FloatArray, shear_y: FloatArray, slip_x: FloatArray, slip_y: FloatArray, cell_area: FloatArray,
    speed: FloatArray, power: FloatArray, sign: FloatArray, work: FloatArray, local_power: FloatArray,
) -> None:  # fmt: skip
    """Work density of each cell, scaled to the patch's power; lateral shear and slip mirrored in place.

    Fills `work` (m, nx, ny) and `local_power` (m,), what the cells add up to before the scaling.
    """
    patches, cells, strips = work.shape
    for m in range(patches):
        total = 0.0
        for i in range(cells):
            for j in range(strips):
                value = -(shear_x[m, i, j] * slip_x[m, i, j] + shear_y[m, i, j] * slip_y[m, i, j])
                work[m, i, j] = value
                total += value * cell_area[m, j]
        local_power[m] = total * speed[m]
        scale = power[m] / local_power[m] if local_power[m] > 0.0 else 0.0
        for i in range(cells):
            for j in range(strips):
                work[m, i, j] *= scale
                shear_y[m, i, j] *= sign[m]
                slip_y[m, i, j] *= sign[m]
