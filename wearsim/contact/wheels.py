"""Wheels of operating points in the four problems: patches, kinematics, creep forces.

A left wheel is mirrored to the right one. Arrays of patches of different size are
padded when they are joined.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.creepage import ContactPoint, Kinematics, kinematics, moved
from wearsim.contact.friction import FLANGE_ANGLE, TREAD_ANGLE, falling_friction
from wearsim.contact.gap import between_points
from wearsim.contact.geometry import (
    CounterfaceProfile,
    Gap,
    WheelsetPose,
    WheelSurface,
    gap,
)
from wearsim.contact.kernel import kernel, plain
from wearsim.contact.normal import NORMAL_MODELS, NormalModel, NormalSolution
from wearsim.contact.normal.faint import faded_loads, similar
from wearsim.contact.patch import FloatArray, IntArray, Resolution, mean_over_planes
from wearsim.contact.problem import ContactConditions, ContactModels, Wheelset
from wearsim.contact.tangential import (
    TANGENTIAL_MODELS,
    StripMotion,
    TangentialModel,
    TangentialSolution,
    Wanted,
)
from wearsim.errors import ContactError, NumericalError

COARSE = Resolution(cell=1.0, strips=12, cells=12, most=12)
"""Resolution of rough solutions."""


@dataclass(frozen=True)
class Task:
    """Everything but the operating points.

    Pairs are for the right and the left side.
    """

    wheels: tuple[WheelSurface, ...]
    counterfaces: tuple[CounterfaceProfile, ...]
    wheelset: Wheelset
    curvature: tuple[float, ...]
    rolling_curvature: tuple[float, ...]
    models: ContactModels
    sides: tuple[int, ...]
    vertical: bool
    fields: Wanted = True  # of the solution


@dataclass(frozen=True)
class Side:
    """One side of n operating points; `sign` is -1 for a left wheel, which is mirrored.

    `rough` are its rough solutions under the wheel loads, if available.
    """

    number: int
    sign: float
    gap: Gap
    pose: WheelsetPose
    rough: NormalSolution | None = None

    def known_where(
        self, rows: NDArray[np.bool_], old_side: Side | None = None
    ) -> Side:
        """Return the side with the poses of an old one except at `rows` (n,).

        Without an old side they are NaN.
        """
        if rows.all():
            return self
        nothing = np.full(rows.size, np.nan)
        old = (
            WheelsetPose(nothing, nothing, nothing)
            if old_side is None
            else old_side.pose
        )
        pose = WheelsetPose(
            *(np.where(rows, new, was) for new, was in zip(self.pose, old, strict=True))
        )
        return replace(self, pose=pose)


class Planes(NamedTuple):
    """Contact planes of patches in the axes of a right wheel.

    There is one plane per patch, or one per strip.

    Parameters
    ----------
    y : (m, N) array
        Lateral position on the counterface's profile [m].
    angle : (m, N) array
        Contact angle [rad].
    normal_force : (m, N) array
        [N].
    middle : (m, N) array
        Longitudinal position of the normal force, from the patch's centre [m].
    """

    y: FloatArray
    angle: FloatArray
    normal_force: FloatArray
    middle: FloatArray


def planes_of(normal: NormalSolution) -> Planes:
    """Contact planes of patches; N is 1 if all of them lie in one plane."""
    strips = normal.patch.planes
    if strips is None:
        y, angle, force = normal.centre_y, normal.contact_angle, normal.normal_force
        return Planes(y[:, None], angle[:, None], force[:, None], np.zeros((y.size, 1)))
    return Planes(strips.y, strips.angle, strips.normal_force, strips.middle)


@dataclass(frozen=True)
class Wheels:
    """Normal contact and kinematics of patches in the axes of a right wheel.

    `sign` is -1 for left wheels. `place` is the index of the wheel of each patch in an
    array (n, 2) of points and sides, row by row. Kinematics and friction are those of
    `planes_of`: of strips in planes of their own if the tangential model takes them.
    """

    place: IntArray
    sign: FloatArray
    load: FloatArray  # L of the wheel [N]
    normal: NormalSolution
    kinematics: Kinematics
    friction: FloatArray  # (m, N)
    speed: FloatArray
    # lateral position of the counterface profile's origin, from the middle of the axle
    origin_y: FloatArray
    wheel_y: FloatArray
    edges_wheel_y: FloatArray


@dataclass(frozen=True)
class Forces:
    """Creep forces of patches, and their sums by point and side (n, 2).

    `torque` about the axle, by virtual work V F . d(creepage)/d(speed) [N m];
    `vertical` includes the normal forces [N].
    """

    contact: TangentialSolution
    torque: FloatArray
    vertical: FloatArray


def side_of(
    task: Task,
    number: int,
    chunk: ContactConditions,
    rows: IntArray | None = None,
    before: Gap | None = None,
) -> Side:
    """Gap of one side of operating points.

    It is computed for `rows` alone, if given, and is that of `before` for the others.
    """
    sign = -1.0 if number else 1.0
    pose = WheelsetPose(sign * chunk.axle_shift(), sign * chunk.yaw, sign * chunk.roll)
    side_gap = gap(
        task.wheels[number],
        task.counterfaces[number],
        pose,
        half_span=task.wheelset.half_span,
        nominal_radius=task.wheelset.radius,
        curvature=task.curvature[number],
        rows=rows,
        before=before,
    )
    return Side(number, sign, side_gap, pose)


def normal_of(
    task: Task,
    side: Side,
    row: IntArray,
    load: FloatArray,
    *,
    rough: bool = False,
) -> NormalSolution:
    """Solve the normal contact of rows of a side under loads (k,) [N].

    A row whose rough solution fails is solved in full; one without a full solution is
    solved by the substitute model. The others are unchanged.
    """
    models = task.models
    model = NORMAL_MODELS[models.normal]
    options: dict[str, Any] = {
        "vertical": task.vertical,
        "effective_modulus": models.effective_modulus,
        "parameters": dict(models.parameters),
    }
    try:
        resolution = COARSE if rough else models.resolution
        solution = model(
            side.gap, row, load, resolution=resolution, rough=rough, **options
        )
        solution = _faded(solution, task.vertical)
        return replace(solution, stood_in=np.zeros(solution.patch.row.size, dtype=bool))
    except ContactError as error:
        if error.row is None:
            raise
        if not rough and not (model.instead and isinstance(error, NumericalError)):
            raise
        failed = np.isin(row, error.rows)
    if rough:
        full = normal_of(task, side, row[failed], load[failed])
        # fields of rough solutions
        parts = [replace(full, patch=replace(full.patch, planes=None))]
    else:
        parts = [
            _stood_in(
                NORMAL_MODELS[model.instead],
                side.gap,
                row[failed],
                load[failed],
                models,
                options,
            )
        ]
    if not failed.all():
        parts.append(normal_of(task, side, row[~failed], load[~failed], rough=rough))
    return by_row(parts)


def _stood_in(
    model: NormalModel,
    gap: Gap,
    row: IntArray,
    load: FloatArray,
    models: ContactModels,
    options: dict[str, Any],
) -> NormalSolution:
    """Solution of a substitute model for one on strips.

    Its pressures are given on strips of the same loads.
    """
    fine = models.resolution
    resolution = replace(
        fine, strips=max(fine.strips, model.fewest), cells=max(fine.cells, model.fewest)
    )
    solution = model(gap, row, load, resolution=resolution, rough=False, **options)
    solution = _faded(solution, options["vertical"])
    stood_in = np.ones(solution.patch.row.size, dtype=bool)
    return replace(
        solution, patch=replace(solution.patch, grid=None), stood_in=stood_in
    )


def _faded(normal: NormalSolution, vertical: bool) -> NormalSolution:
    """Solution in which the faint patches of wheels have faded.

    Patches that have vanished are removed.
    """
    ratio = faded_loads(normal, vertical)
    if (ratio == 1.0).all():
        return normal
    kept = ratio > 0.0
    return similar(patches_where(normal, kept), ratio[kept])


def by_row(parts: list[NormalSolution]) -> NormalSolution:
    """Join normal solutions of a side, ordered by row."""
    order = np.argsort(
        np.concatenate([part.patch.row for part in parts]), kind="stable"
    )
    whole: NormalSolution = joined(parts, order)
    return whole


def wheels_of(
    task: Task,
    side: Side,
    chunk: ContactConditions,
    normal: NormalSolution,
    load: FloatArray,
) -> Wheels:
    """Solve the kinematic problem of patches of one side under wheel loads (n,) [N].

    Patches lie in one plane each where the tangential model does not use strips in
    planes of their own.
    """
    tangential = TANGENTIAL_MODELS[task.models.tangential]
    if normal.patch.planes is not None and not tangential.takes_strips_of(normal.patch):
        normal = replace(normal, patch=replace(normal.patch, planes=None))
    row, side_gap = normal.patch.row, side.gap
    planes = planes_of(normal)
    friction = np.repeat(chunk.friction[row, None], planes.angle.shape[1], axis=1)
    if chunk.friction_flange is not None:
        steep = np.clip(
            (np.abs(planes.angle) - TREAD_ANGLE) / (FLANGE_ANGLE - TREAD_ANGLE),
            0.0,
            1.0,
        )
        friction = friction + steep * (chunk.friction_flange[row, None] - friction)
    places = np.concatenate((normal.centre_y[:, None], normal.edge_y), axis=1)
    (wheel_y,) = between_points(side_gap, (side_gap.wheel_y,), row, places)
    return Wheels(
        place=2 * row + side.number,
        sign=np.full(row.size, side.sign),
        load=load[row],
        normal=normal,
        kinematics=_motion(task, side, chunk, normal, planes),
        friction=friction,
        speed=chunk.speed[row],
        origin_y=task.wheelset.half_span - side.pose.shift[row],
        wheel_y=wheel_y[:, 0],
        edges_wheel_y=wheel_y[:, 1:],
    )


def _motion(
    task: Task,
    side: Side,
    chunk: ContactConditions,
    normal: NormalSolution,
    planes: Planes,
) -> Kinematics:
    """Creepage of patches of one side about the centres of their planes."""
    row, side_gap, sign = normal.patch.row, side.gap, side.sign
    profile, strips, y = side_gap.counterface, normal.patch.planes, planes.y
    curves = (
        side_gap.gap,
        side_gap.x,
        side_gap.wheel_y,
        side_gap.wheel_radius,
        side_gap.sin_theta,
    )
    apart, x, wheel_y, wheel_radius, sin_theta = between_points(
        side_gap, curves, row, y
    )
    counterface_z = np.interp(y, profile.y, profile.z)
    approach = overlap = np.zeros_like(y)  # strips: the wheel's own points
    if strips is None:
        # The wheel moves straight down, the gap is measured along the roller's radius.
        kappa = side_gap.curvature
        slope = kappa * x / (1.0 - kappa * (counterface_z - apart))
        approach = normal.approach[:, None]
        overlap = (
            normal.vertical_displacement[:, None] / np.sqrt(1.0 + slope**2) - apart
        )
    motion = kinematics(
        ContactPoint(
            wheel_y=wheel_y,
            wheel_radius=wheel_radius,
            sin_theta=sin_theta,
            counterface_z=counterface_z,
            contact_angle=planes.angle,
            approach=approach,
            overlap=overlap,
        ),
        WheelsetPose(side.pose.shift[row], side.pose.yaw[row], side.pose.roll[row]),
        speed=chunk.speed[row],
        track_curvature=sign * chunk.track_curvature[row],
        half_span=task.wheelset.half_span,
        nominal_radius=task.wheelset.radius,
        curvature=task.rolling_curvature[side.number],
    )
    if (
        chunk.speed_difference is not None
    ):  # rollers have no curve: `at_rest` is pure rolling
        faster = 1.0 - 0.5 * sign * chunk.speed_difference[row]
        motion = replace(motion, at_rest=faster[:, None, None] * motion.at_rest)
    if chunk.drift is not None:
        motion.at_rest[:, :, 1] += sign * chunk.drift[row, None] * np.cos(planes.angle)
    if strips is not None:
        centre_x = between_points(side_gap, (side_gap.x,), row, normal.centre_y)[0]
        motion = moved(motion, centre_x[:, None] - motion.x, np.zeros_like(y))
    if chunk.creepage is not None:
        given = np.repeat(
            chunk.creepage[row, None] * np.array([1.0, sign, sign]), y.shape[1], axis=1
        )
        motion = replace(motion, at_rest=given, per_speed=np.zeros_like(given))
        if strips is not None:
            motion = moved(motion, np.zeros_like(y), strips.offset)
    return motion


def joined(
    parts: Sequence[Any], order: IntArray | slice | None = None, *, name: str = ""
) -> Any:
    """Concatenate arrays along the first axis.

    Tuples, mappings and dataclasses of arrays are traversed.

    Parameters
    ----------
    parts : sequence
        Of one kind, such as what `solve_each` returned.
    order : (m,) int array or slice, optional
        Another order of the whole, or a part of it, which a slice does not copy.
    name : str
        Of the arrays. Those of unlike strips or cells are padded with zeros: strips
        without length or width, cells without load; those with "edge" in their name
        with their last value.

    Returns
    -------
    array, tuple, dict or dataclass
        As the parts.
    """
    first = parts[0]
    kind: Any = type(first)
    if kind is np.ndarray:
        whole = _stacked(name, parts) if len(parts) > 1 else first
        if order is None:
            return whole
        return whole[order] if isinstance(order, slice) else whole.take(order, axis=0)
    if first is None or (order is None and len(parts) == 1):
        return first
    if isinstance(first, tuple):
        return tuple(
            joined(elements, order, name=name) for elements in zip(*parts, strict=True)
        )
    every = parts if kind is dict else [vars(part) for part in parts]
    values = {
        key: joined([mapping[key] for mapping in every], order, name=key)
        for key in every[0]
    }
    return values if kind is dict else kind(**values)


def _stacked(name: str, parts: Sequence[FloatArray]) -> FloatArray:
    """Concatenated arrays, padded to equal shape except in the first axis."""
    shapes = [part.shape[1:] for part in parts]
    if shapes.count(shapes[0]) == len(parts):
        return np.concatenate(parts)
    largest = map(max, zip(*shapes, strict=True))
    whole = np.zeros((sum(map(len, parts)), *largest), dtype=parts[0].dtype)
    begin = 0
    for part in parts:
        block = whole[begin : begin + len(part)]
        if "edge" in name:
            block[:] = part[:, -1:]
        block[tuple(map(slice, part.shape))] = part
        begin += len(part)
    return whole


def by_point(parts: list[Wheels]) -> tuple[Wheels, IntArray]:
    """Join patches in the order of point, side and falling normal force.

    The second value is their order among the parts.
    """
    place = np.concatenate([part.place for part in parts])
    force = np.concatenate([part.normal.normal_force for part in parts])
    order = np.lexsort((-force, place))
    return joined(parts, None if (order[1:] > order[:-1]).all() else order), order


def patches_where(part: Any, mask: NDArray[np.bool_]) -> Any:
    """Patches of a dataclass of arrays where a mask (m,) is true."""
    return part if mask.all() else joined([part], np.flatnonzero(mask))


def stretched(wheels: Wheels, load: FloatArray) -> Wheels:
    """Patches similar to those of wheels, under loads (n, 2) nearby."""
    ratio = load.ravel()[wheels.place] / wheels.load
    if (ratio == 1.0).all():
        return wheels
    before, motion, s = wheels.normal, wheels.kinematics, np.cbrt(ratio)
    planes, wide, middle = before.patch.planes, s[:, None], wheels.wheel_y[:, None]
    if planes is not None:  # strips move outwards in their planes
        motion = moved(
            motion, np.zeros_like(planes.station), (wide - 1.0) * planes.offset
        )
    lowered = (s**2 - 1.0) * before.approach / np.cos(before.contact_angle)
    normal = replace(
        similar(before, ratio),
        vertical_displacement=before.vertical_displacement + lowered,
    )
    return replace(
        wheels,
        load=ratio * wheels.load,
        normal=normal,
        kinematics=motion,
        edges_wheel_y=middle + wide * (wheels.edges_wheel_y - middle),
    )


def height(
    task: Task, left: NDArray[np.bool_], displacement: FloatArray, y: FloatArray
) -> FloatArray:
    """Vertical position (m, N) of points on the counterface's profile (m, N) [m].

    It counts downwards from the axle.
    """
    counterface_z = [
        np.interp(y, counterface.y, counterface.z) for counterface in task.counterfaces
    ]
    z: FloatArray = (
        task.wheelset.radius
        + np.where(left[:, None], counterface_z[1], counterface_z[0])
        - displacement[:, None]
    )
    return z


def forces_of(
    task: Task,
    wheels: Wheels,
    speed: FloatArray,
    model: TangentialModel,
    *,
    fields: bool = False,
) -> Forces:
    """Creep forces of patches at rotation speeds (n, 2) of both wheels [rad/s].

    The fields of the task are included on request.
    """
    contact = _contact_of(task, wheels, speed, model, fields and task.fields)
    motion, normal_force = wheels.kinematics, planes_of(wheels.normal).normal_force
    torque, vertical = np.zeros((2, speed.size))
    _add_up(
        plain(contact.plane_force),
        motion.per_speed,
        motion.down,
        plain(normal_force),
        wheels.speed,
        wheels.place,
        torque,
        vertical,
    )
    return Forces(contact, torque.reshape(-1, 2), vertical.reshape(-1, 2))


def _contact_of(
    task: Task,
    wheels: Wheels,
    speed: FloatArray,
    model: TangentialModel,
    fields: Wanted,
) -> TangentialSolution:
    """Tangential solution of patches.

    A wheel that fails is solved separately, the others without it.
    """
    row = wheels.normal.patch.row
    try:
        return _solved_by(model, task, wheels, speed, fields)
    except NumericalError as error:
        if not model.instead or error.row is None:
            raise
        failed = np.isin(row, error.rows)
    masks = [wheels.place == place for place in np.unique(wheels.place[failed])]
    parts = [
        _alone(task, patches_where(wheels, mask), speed, model, fields)
        for mask in masks
    ]
    if not failed.all():
        masks.append(~failed)
        parts.append(
            _contact_of(task, patches_where(wheels, ~failed), speed, model, fields)
        )
    return contact_joined(
        parts, np.argsort(np.concatenate([np.flatnonzero(mask) for mask in masks]))
    )


def _alone(
    task: Task, wheel: Wheels, speed: FloatArray, model: TangentialModel, fields: Wanted
) -> TangentialSolution:
    """Solve one wheel separately, by the substitute model if that fails."""
    try:
        return _solved_by(model, task, wheel, speed, fields)
    except NumericalError as error:
        patch = wheel.normal.patch
        try:
            solution = _solved_by(
                TANGENTIAL_MODELS[model.instead], task, wheel, speed, fields
            )
        except ContactError:
            raise error from None
    if patch.planes is not None:  # in one plane all strips have the same force per load
        share = patch.planes.normal_force / patch.planes.normal_force.sum(
            axis=1, keepdims=True
        )
        solution = replace(
            solution, strip_force=share[:, :, None] * solution.force[:, None]
        )
    return replace(solution, stood_in=np.ones(patch.row.size, dtype=bool))


def _solved_by(
    model: TangentialModel,
    task: Task,
    wheels: Wheels,
    speed: FloatArray,
    fields: Wanted,
) -> TangentialSolution:
    """Tangential solution of patches by a model."""
    patch, strips = wheels.normal.patch, None
    creepage = wheels.kinematics.creepage(speed.ravel()[wheels.place])
    friction = _friction_at(task.models, wheels, creepage)
    if patch.planes is not None and model.takes_strips_of(patch):
        strips = StripMotion(
            wheels.place, creepage, friction, wheels.kinematics.x[:, 0]
        )
    normal_force = planes_of(wheels.normal).normal_force
    solution = model(
        patch,
        mean_over_planes(creepage, normal_force),
        mean_over_planes(friction, normal_force),
        shear_modulus=task.models.creep_modulus,
        poisson_ratio=task.models.poisson_ratio,
        fields=fields,
        **({} if strips is None else {"strips": strips}),
    )
    return replace(solution, stood_in=np.zeros(patch.row.size, dtype=bool))


def _friction_at(
    models: ContactModels, wheels: Wheels, creepage: FloatArray
) -> FloatArray:
    """Friction coefficient (m, N) at the rigid slip of planes with creepages (m, N, 3).

    The slip is that at the centre of the patch, or the middle of the strip.
    """
    if not models.friction_falls:
        return wheels.friction
    slip = wheels.speed[:, None] * np.hypot(creepage[:, :, 0], creepage[:, :, 1])
    ratio, decrease = models.friction_ratio, models.friction_decrease
    return wheels.friction * falling_friction(slip, ratio, decrease)


@kernel
def _add_up(
    force: FloatArray,
    per_speed: FloatArray,
    down: FloatArray,
    normal: FloatArray,
    speed: FloatArray,
    place: IntArray,
    torque: FloatArray,
    vertical: FloatArray,
) -> None:
    """Torque about the axle and vertical force of patches, summed by wheel."""
    for m in range(place.size):
        for n in range(normal.shape[1]):
            x, y, moment = force[m, n]
            turning = (
                x * per_speed[m, n, 0]
                + y * per_speed[m, n, 1]
                + moment * per_speed[m, n, 2]
            )
            torque[place[m]] += turning * speed[m]
            vertical[place[m]] += (
                normal[m, n] * down[m, n, 2] - x * down[m, n, 0] - y * down[m, n, 1]
            )


def contact_where(
    contact: TangentialSolution, which: NDArray[np.bool_] | IntArray
) -> TangentialSolution:
    """Patches of a tangential solution by a mask (m,) or in an order.

    Cells have patches on the second axis.
    """
    if which.dtype == bool and which.all():
        return contact
    cells = None if contact.cells is None else contact.cells[:, which]
    order = np.arange(len(contact.force))[which]
    part: TangentialSolution = joined([replace(contact, cells=None)], order)
    return replace(part, cells=cells)


def contact_joined(
    parts: list[TangentialSolution], order: IntArray | None = None
) -> TangentialSolution:
    """Tangential solutions concatenated, or in another order."""
    by_patch = [
        np.moveaxis(part.cells, 0, 1) for part in parts if part.cells is not None
    ]
    whole: TangentialSolution = joined(
        [replace(part, cells=None) for part in parts], order
    )
    if not by_patch:
        return whole
    cells = joined(by_patch, order, name="cells")
    return replace(whole, cells=np.moveaxis(cells, 1, 0))
