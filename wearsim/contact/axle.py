r"""Wheelsets approaching equilibrium: unknowns, contact, residuals and slopes.

Unknowns of a wheelset are the rotation speed, for each wheel the load L that its normal
forces would carry alone, the roll and, where forces guide it, lateral shift and yaw;
where its wheels rotate independently also the difference of their rotation speeds. The
residuals that belong to them are

- the torque of the creep forces of both wheels about the axle, less that applied, and
  for independent wheels the difference of the torques of both: each wheel has its own
  of the applied one,
- for each wheel the vertical force of normal and creep forces of its patches over the
  wheel load Q,

.. math:: \sum (N\cos\delta - F_y\sin\delta)\cos\alpha - F_x\sin\alpha = Q,

  with the inclination :math:`\alpha` of the rolling direction where a yawed wheel touches a roller off its
  top (rail: 0); Q is given, or balances the roll of the axle,
- the difference of the heights by which both wheels let the axle down,
- lateral force and yaw moment of the contact, to which `Guidance` adds its own.

Between trials patches are stretched or solved anew, see `loaded`.
`wearsim.contact.balance` searches for the equilibrium.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.guidance import Guidance
from wearsim.contact.loaded import (
    SIMILAR,
    displacements,
    loads_of,
    may_be_stretched,
    renewed,
    solved_wheels,
)
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import ContactConditions
from wearsim.contact.tangential import TANGENTIAL_MODELS, TangentialSolution, fastsim
from wearsim.contact.track_forces import track_forces
from wearsim.contact.wheels import (
    Side,
    Task,
    Wheels,
    by_point,
    forces_of,
    height,
    patches_where,
    planes_of,
    side_of,
    stretched,
)
from wearsim.errors import ContactError

SPEED, RIGHT, LEFT, ROLL, SHIFT, YAW, DIFFERENCE = range(7)
"""Columns of the unknowns.

Mean rotation speed of both wheels, both wheel loads, roll, shift, yaw, and half the
difference of the rotation speeds, right less left.
"""
UNKNOWNS = 7
ROTATIONS = [SPEED, DIFFERENCE]
"""Columns of the unknown rotation speeds."""
GUIDED = slice(SHIFT, DIFFERENCE)
"""Columns of the unknowns that forces guide: shift and yaw."""
SPEED_UNIT = 1e-3
"""Unit of the unknown rotation speeds, over the nominal one."""
ROLL_UNIT = 1e-4
"""Unit of the unknown roll [rad].

The displacement that it causes is the unit of the residual of heights.
"""
SHIFT_UNIT, YAW_UNIT = 1e-4, 1e-4
"""Units of the unknown shift [m] and yaw [rad]."""
TORQUE, VERTICAL, LATERAL, YAW_MOMENT, ROLL_MOMENT, DISPLACEMENT = range(6)
"""Columns of the contact forces on a wheel."""
LEAST_LOAD = 0.02
"""Vertical wheel force over the axle load below which a wheel counts as unloaded."""
RESTING = 1e-9
"""Largest difference of the displacements of both wheels at rest [m]."""

# differences of the unknowns for the slopes
_DIFFERENCES = np.array([1e-2, SIMILAR, SIMILAR, 5e-2, 1e-2, 1e-2, 1e-2])
# unknowns that move the wheels
_POSES = np.isin(np.arange(UNKNOWNS), [ROLL, SHIFT, YAW])
# ratio of the differences with coarse patches to these
_COARSER = np.array([1.0, 1.0, 1.0, 10.0, 10.0, 10.0, 1.0])
# accepted residual at rest, over the jump of displacements with the layout of strips
_OF_SCATTER = 0.5
_NO_LOAD = 1e-6  # vertical force over the axle load below which a wheel has no contact


@dataclass(frozen=True)
class Contact:
    """Contact of n wheelsets in a state.

    Parameters
    ----------
    wheels : Wheels or None
        Patches of those with contact under their loads; None: there is none.
    forces : (n, 2, 6) array
        Torque about the axle [N m], vertical and lateral force [N], moments about the
        vertical and the longitudinal axis [N m] and vertical displacement [m] of the
        right and the left wheel.
    solved : (n,) bool array
        Which wheelsets have contact.
    pose : (n, 3) array
        Lateral position [m], yaw and roll [rad] at which the patches were solved.
    load : (n, 2) array
        Loads L under which they were solved [N]; they are similar under those of
        `wheels`.
    sides : tuple of Side
        Gaps of both wheels in these poses.
    faults : mapping
        Why a wheelset has no contact, by its number.
    """

    wheels: Wheels | None
    forces: FloatArray
    solved: NDArray[np.bool_]
    pose: FloatArray
    load: FloatArray
    sides: tuple[Side, ...] = ()
    faults: Mapping[int, ContactError] = field(default_factory=dict)

    def to_begin_with(self) -> Contact:
        """Return this contact with its gaps, whose patches are solved anew."""
        return replace(self, load=np.full_like(self.load, np.nan))

    def merged(self, replacement: Contact, taken: NDArray[np.bool_]) -> Contact:
        """Return this contact with the wheelsets `taken` (n,) from another one."""
        parts = [
            patches_where(contact.wheels, mask[contact.wheels.normal.patch.row])
            for contact, mask in ((self, ~taken), (replacement, taken))
            if contact.wheels is not None
        ]
        parts = [part for part in parts if part.place.size]
        return Contact(
            by_point(parts)[0] if parts else None,
            np.where(taken[:, None, None], replacement.forces, self.forces),
            np.where(taken, replacement.solved, self.solved),
            np.where(taken[:, None], replacement.pose, self.pose),
            np.where(taken[:, None], replacement.load, self.load),
            replacement.sides,
            {**self.faults, **replacement.faults},
        )


@dataclass(frozen=True)
class Wheelsets:
    """Set of n wheelsets that are solved together, including both axles of a bogie.

    Parameters
    ----------
    task : Task
        Wheelset, counterface and models.
    chunk : ContactConditions
        With shifts, yaws and rolls that are given.
    guidance : Guidance
        Forces on them.
    given : (n, 2) array, optional
        Rotation speed of both wheels, negative when rolling forwards [rad/s]; None:
        free.
    sides : tuple of int
        Wheels that are looked at: 0 right, 1 left.
    coarse : bool
        Whether their patches are coarse and the creep forces are those of FASTSIM, to
        begin with.
    """

    task: Task
    chunk: ContactConditions
    guidance: Guidance
    given: FloatArray | None
    sides: tuple[int, ...] = (0, 1)
    coarse: bool = False

    @property
    def count(self) -> int:
        """Number n of wheelsets."""
        return int(self.chunk.shift.size)

    @cached_property
    def wanted(self) -> NDArray[np.bool_]:
        """Mask of the unknowns (n, 7) to be solved for."""
        free = np.zeros((self.count, UNKNOWNS), dtype=bool)
        free[:, SPEED] = self.given is None
        for side in self.sides:
            free[:, RIGHT + side] = self.task.vertical
        free[:, ROLL] = self.chunk.free_roll
        free[:, GUIDED] = self.guidance.free
        free[:, DIFFERENCE] = self.given is None and self.chunk.independent
        return free

    @cached_property
    def placed(self) -> NDArray[np.bool_]:
        """True for wheelsets (n,) with given shift and yaw."""
        return np.asarray(~self.guidance.free.any(axis=1))

    @cached_property
    def linked(self) -> NDArray[np.bool_]:
        """Mask of the residuals that depend on unknowns (n, 7, 7).

        Heights do not depend on the rotation; wheels act on each other through torque,
        roll and guidance alone.
        """
        linked = np.ones((self.count, UNKNOWNS, UNKNOWNS), dtype=bool)
        linked[:, ROLL, ROTATIONS] = False
        given = np.isfinite(self.guidance.wheel_load).all(axis=1)
        linked[given, RIGHT, LEFT] = False
        linked[given, LEFT, RIGHT] = False
        return linked

    def speed(self, unknown: FloatArray) -> FloatArray:
        """Rotation speed (n, 2) of both wheels [rad/s].

        It is negative when rolling forwards.
        """
        if self.given is not None:
            return self.given
        mean = unknown[:, SPEED]
        half = unknown[:, DIFFERENCE] if self.chunk.independent else 0.0
        faster = np.stack([mean + half, mean - half], axis=1)
        nominal = -self.chunk.speed / self.task.wheelset.radius
        speed: FloatArray = nominal[:, None] * (1.0 + SPEED_UNIT * faster)
        return speed

    def loads(self, unknown: FloatArray) -> FloatArray:
        """Return the loads L (n, 2) of both wheels [N]."""
        if not self.task.vertical:
            return self.chunk.loads
        half: FloatArray = 0.5 * self.guidance.axle_load[:, None]
        return half * np.exp(unknown[:, RIGHT:ROLL])

    def roll(self, unknown: FloatArray) -> FloatArray:
        """Roll (n,) [rad]."""
        return ROLL_UNIT * unknown[:, ROLL] if self.chunk.free_roll else self.chunk.roll

    def conditions(self, unknown: FloatArray) -> ContactConditions:
        """Conditions in the pose of unknowns; given values are kept."""
        free = self.guidance.free
        return replace(
            self.chunk,
            shift=np.where(
                free[:, 0], SHIFT_UNIT * unknown[:, SHIFT], self.chunk.shift
            ),
            yaw=np.where(free[:, 1], YAW_UNIT * unknown[:, YAW], self.chunk.yaw),
            roll=self.roll(unknown),
        )

    def position(self, unknown: FloatArray) -> FloatArray:
        """Lateral position of the axle and yaw (n, 2) [m, rad]."""
        posed = self.conditions(unknown)
        return np.stack([posed.axle_shift(), posed.yaw], axis=1)

    def with_speed(self, unknown: FloatArray, speed: FloatArray) -> FloatArray:
        """Return unknowns (n, 7) with other rotation speeds (n, 2) [rad/s]."""
        changed = unknown.copy()
        changed[:, ROTATIONS] = self._of_speed(speed)
        return changed

    def _of_speed(self, speed: FloatArray) -> FloatArray:
        """Unknown mean of rotation speeds (n, 2), and half their difference (n, 2)."""
        nominal = self.chunk.speed[:, None]
        slower = speed * -self.task.wheelset.radius / nominal - 1.0
        mean = 0.5 * (slower[:, 0] + slower[:, 1])
        apart = 0.5 * (slower[:, 0] - slower[:, 1])
        return np.stack([mean / SPEED_UNIT, apart / SPEED_UNIT], axis=1)

    def unknown(
        self, speed: FloatArray, load: FloatArray, roll: FloatArray
    ) -> FloatArray:
        """Unknowns (n, 7) at the shift and yaw of the conditions.

        Parameters
        ----------
        speed, load : (n, 2) array
            Rotation speeds [rad/s] and loads L [N] of both wheels.
        roll : (n,) array
            [rad].
        """
        mean, apart = self._of_speed(speed).T
        half = 0.5 * self.guidance.axle_load[:, None]
        shift, yaw = self.chunk.shift / SHIFT_UNIT, self.chunk.yaw / YAW_UNIT
        return np.column_stack(
            [
                mean,
                np.log(load / half),
                roll / ROLL_UNIT,
                shift,
                yaw,
                apart,
            ]
        )

    @property
    def resting(self) -> float:
        """Residual of the heights of a wheelset at rest."""
        apart = max(
            RESTING, _OF_SCATTER * NORMAL_MODELS[self.task.models.normal].scatter
        )
        return apart / (2.0 * self.task.wheelset.half_span * ROLL_UNIT)

    def contact(
        self,
        unknown: FloatArray,
        rows: NDArray[np.bool_],
        near: Contact | None,
    ) -> Contact:
        """Solve the contact of wheelsets in a state.

        Parameters
        ----------
        unknown : (n, 7) array
            The state.
        rows : (n,) bool array
            Wheelsets to solve; the others have no contact.
        near : Contact, optional
            In a state nearby: where the pose is the same its gaps are kept, and its
            patches are stretched if the load is similar.

        Returns
        -------
        Contact
            `faults` has the reason where there is none.
        """
        posed, load = self.conditions(unknown), self.loads(unknown)
        pose = _pose(posed)
        solved, faults = rows.copy(), dict[int, ContactError]()
        sides = self._sides(posed, rows, near)
        while solved.any() or not self.count:
            try:
                wheels, solved_for = self._wheels(
                    posed, pose, load, solved, sides, near
                )
                forces, _ = self.forces(unknown, wheels)
                return Contact(wheels, forces, solved, pose, solved_for, sides, faults)
            except ContactError as error:
                if error.row is None:
                    raise
                failed = list({error.row, *error.rows})
                faults.update(dict.fromkeys(failed, error))
                solved[failed] = False
        return Contact(
            None, np.zeros((self.count, 2, 6)), solved, pose, load, sides, faults
        )

    def of_wheels(
        self, unknown: FloatArray, wheels: Wheels, sides: tuple[Side, ...]
    ) -> Contact:
        """Contact of all wheelsets in a state (n, 7), from patches solved for it."""
        posed, every = self.conditions(unknown), np.ones(self.count, dtype=bool)
        forces, _ = self.forces(unknown, wheels)
        return Contact(wheels, forces, every, _pose(posed), self.loads(unknown), sides)

    def _sides(
        self, posed: ContactConditions, rows: NDArray[np.bool_], near: Contact | None
    ) -> tuple[Side, ...]:
        """Gaps of both wheels of `rows` (n,).

        Gaps of a nearby contact are reused where the pose is the same.
        """
        if near is None or not near.sides:
            index = None if rows.all() else np.flatnonzero(rows)
            sides = tuple(
                side_of(self.task, number, posed, index) for number in self.sides
            )
            return tuple(side.known_where(rows) for side in sides)
        nearby_side = near.sides[0]
        shift, yaw, roll = (nearby_side.sign * values for values in nearby_side.pose)
        moved = rows & (
            (shift != posed.axle_shift()) | (yaw != posed.yaw) | (roll != posed.roll)
        )
        if not moved.any():
            return near.sides
        index = None if moved.all() else np.flatnonzero(moved)
        return tuple(
            side_of(self.task, side.number, posed, index, side.gap.copy()).known_where(
                moved, side
            )
            for side in near.sides
        )

    def _wheels(
        self,
        posed: ContactConditions,
        pose: FloatArray,
        load: FloatArray,
        rows: NDArray[np.bool_],
        sides: tuple[Side, ...],
        near: Contact | None,
    ) -> tuple[Wheels, FloatArray]:
        """Patches of wheelsets `rows` (n,) under loads (n, 2).

        The second value is the loads for which they were solved.
        """
        included = np.zeros((self.count, 2), dtype=bool)
        included[:, list(self.sides)] = rows[:, None]
        if near is None or near.wheels is None:
            return solved_wheels(
                self.task, posed, sides, load, included, rough=self.coarse
            ), load
        same = rows & near.solved & (near.pose == pose).all(axis=1)
        similar = same[:, None] & may_be_stretched(near.wheels, near.load, load)
        wheels = renewed(
            self.task,
            posed,
            sides,
            near.wheels,
            load,
            included & ~similar,
            included & similar,
            rough=self.coarse,
        )
        return stretched(wheels, load), np.where(similar, near.load, load)

    def forces(
        self, unknown: FloatArray, wheels: Wheels, *, fields: bool = False
    ) -> tuple[FloatArray, TangentialSolution]:
        """Contact forces (n, 2, 6) of the wheels, and their creep forces.

        Fields are included on request.
        """
        task, count = self.task, self.count
        model = (
            fastsim.MODEL if self.coarse else TANGENTIAL_MODELS[task.models.tangential]
        )
        creep = forces_of(task, wheels, self.speed(unknown), model, fields=fields)
        planes, left = planes_of(wheels.normal), wheels.sign < 0.0
        z = height(task, left, wheels.normal.vertical_displacement, planes.y)
        curvature = np.where(left, task.curvature[1], task.curvature[0])
        track = track_forces(wheels, planes, creep.contact.plane_force, z, curvature)
        forces = np.zeros((2 * count, 6))
        for column, value in (
            (LATERAL, track.lateral),
            (YAW_MOMENT, track.yaw_moment),
            (ROLL_MOMENT, track.roll_moment),
        ):
            forces[:, column] = np.bincount(wheels.place, value, 2 * count)
        forces[:, TORQUE] = creep.torque.ravel()
        forces[:, VERTICAL] = creep.vertical.ravel()
        forces[:, DISPLACEMENT] = displacements(wheels, count).ravel()
        return forces.reshape(count, 2, 6), creep.contact

    def unloaded(self, forces: FloatArray) -> NDArray[np.bool_]:
        """Wheels (n, 2) that carry hardly any load with a balanced roll of the axle."""
        required_load = self.guidance.wheel_loads(
            forces[:, :, VERTICAL], forces[:, :, ROLL_MOMENT]
        )
        least = LEAST_LOAD * self.guidance.axle_load[:, None]
        return np.isnan(self.guidance.wheel_load) & (required_load < least)

    def residuals(self, forces: FloatArray) -> FloatArray:
        """Residuals (n, 7) of the contact forces (n, 2, 6), without the guiding forces.

        They are the torque over the friction limit, in the last column the difference
        of the torques of independent wheels; the logarithm of the vertical
        forces over the wheel load; the displacement of the right wheel less that of the
        left one, over their displacement by a unit of roll; the lateral force and the
        yaw moment (at 1 m) over the axle load.
        """
        guidance, chunk, wheelset = self.guidance, self.chunk, self.task.wheelset
        weight = guidance.axle_load[:, None]
        required_load = guidance.wheel_loads(
            forces[:, :, VERTICAL], forces[:, :, ROLL_MOMENT]
        )
        shared = np.isnan(guidance.wheel_load)
        required_load = np.where(
            shared, np.maximum(required_load, LEAST_LOAD * weight), required_load
        )
        carried = np.maximum(forces[:, :, VERTICAL], _NO_LOAD * weight)
        residual = np.zeros((self.count, UNKNOWNS))
        torque = forces[:, :, TORQUE].sum(axis=1) - chunk.torque
        friction_limit = chunk.traction_scale * wheelset.radius
        residual[:, SPEED] = torque / friction_limit
        if chunk.independent:
            apart = forces[:, 0, TORQUE] - forces[:, 1, TORQUE] - chunk.torque_apart
            residual[:, DIFFERENCE] = apart / friction_limit
        residual[:, RIGHT:ROLL] = np.log(carried / required_load)
        apart = forces[:, 0, DISPLACEMENT] - forces[:, 1, DISPLACEMENT]
        residual[:, ROLL] = apart / (2.0 * wheelset.half_span * ROLL_UNIT)
        of_both = forces[:, :, [LATERAL, YAW_MOMENT]].sum(axis=1)
        residual[:, GUIDED] = of_both / weight
        return residual

    def slopes(
        self, unknown: FloatArray, now: Contact, rows: NDArray[np.bool_]
    ) -> FloatArray:
        """Return the derivatives (n, 7, 7) of the contact residuals by the unknowns.

        They are those of `rows` (n,).

        Parameters
        ----------
        unknown : (n, 7) array
            The state.
        now : Contact
            In this state.
        rows : (n,) bool array
            Wheelsets with contact. Unknowns that none of them is searched for have no
            slopes.
        """
        assert now.wheels is not None
        wheels = patches_where(now.wheels, rows[now.wheels.normal.patch.row])
        differences = _DIFFERENCES * _COARSER if self.coarse else _DIFFERENCES
        free = np.asarray(self.wanted[rows].any(axis=0))
        # differences away from the middle: mirrored wheelsets have mirrored slopes
        away = (np.arange(UNKNOWNS) >= ROLL) & (unknown < 0.0)
        steps = np.where(away, -differences, differences)
        still = self.residuals(now.forces)
        slopes = np.zeros((self.count, UNKNOWNS, UNKNOWNS))
        if free[RIGHT:ROLL].any():
            heavier = stretched(
                wheels, np.exp(_DIFFERENCES[RIGHT]) * loads_of(wheels, self.count)
            )
            under_load, _ = self.forces(unknown, heavier)
        for column in np.flatnonzero(free & ~_POSES).tolist():
            if column in ROTATIONS:
                moved = unknown.copy()
                moved[:, column] += steps[:, column]
                forces, _ = self.forces(moved, wheels)
            else:
                forces = now.forces.copy()
                forces[:, column - RIGHT] = under_load[:, column - RIGHT]
            change = (self.residuals(forces) - still) / steps[:, [column]]
            slopes[rows, :, column] = change[rows]
        # wheelsets in all poses are solved together
        poses = np.flatnonzero(free & _POSES)
        if not poses.size:
            return slopes
        moving, row = (
            index.ravel() for index in np.meshgrid(poses, np.flatnonzero(rows))
        )
        several = self.at(row)
        step = steps[row, moving]
        moved = unknown[row]
        moved[np.arange(row.size), moving] += step
        contact = several.contact(moved, np.ones(row.size, dtype=bool), None)
        seen = contact.solved
        change = (several.residuals(contact.forces) - still[row]) / step[:, None]
        slopes[row[seen], :, moving[seen]] = change[seen]
        return slopes

    def at(self, index: IntArray) -> Wheelsets:
        """Return the wheelsets at `index`, each without its partner."""
        return replace(
            self,
            chunk=self.chunk.at(index),
            guidance=self.guidance.alone(index),
            given=None if self.given is None else self.given[index],
        )


def _pose(conditions: ContactConditions) -> FloatArray:
    """Lateral position of the axle [m], yaw and roll [rad] (n, 3)."""
    return np.stack([conditions.axle_shift(), conditions.yaw, conditions.roll], axis=1)
