"""Wheelsets on their way to balance: their unknowns, the forces of their contact, and how these change."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.axle import RIGHT, ROLL, ROLL_UNIT, SPEED, read, resting, written
from wearsim.contact.guidance import Guidance
from wearsim.contact.loaded import displacements, loads_of, solved_wheels
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import ContactConditions
from wearsim.contact.tangential import TANGENTIAL_MODELS
from wearsim.contact.track_forces import track_forces
from wearsim.contact.wheels import (
    Task,
    Wheels,
    forces_of,
    height,
    patches_where,
    planes_of,
    side_of,
    stretched,
)
from wearsim.errors import ContactError

SHIFT, YAW = 4, 5
UNKNOWNS = 6
SHIFT_UNIT, YAW_UNIT = 1e-4, 1e-4
"""Unknown 1 of shift [m] and yaw [rad]."""
TORQUE, VERTICAL, LATERAL, YAW_MOMENT, ROLL_MOMENT, DISPLACEMENT = range(6)
"""Columns of forces of the contact on a wheel."""
DIFFERENCES = np.array([1e-2, 1e-3, 1e-3, 5e-2, 1e-2, 1e-2])
"""Of the unknowns, over which slopes are taken."""
_HEIGHTS = 0.5  # weight of the residual of the heights among the others


@dataclass(frozen=True)
class Contact:
    """Contact of n wheelsets in a state.

    Parameters
    ----------
    wheels : Wheels or None
        Of those with contact; None: there is none.
    forces : (n, 2, 6) array
        Torque about the axle [N m], vertical and lateral force [N], moments about the vertical and the
        longitudinal axis [N m] and vertical displacement [m] of the right and the left wheel.
    solved : (n,) bool array
        Which wheelsets have contact.
    """

    wheels: Wheels | None
    forces: FloatArray
    solved: NDArray[np.bool_]


@dataclass(frozen=True)
class Wheelsets:
    """n wheelsets that forces guide, of which those of a bogie are both among them.

    Parameters
    ----------
    task : Task
        Wheelset, counterface and models.
    chunk : ContactConditions
        With shifts and yaws that are given.
    guidance : Guidance
        Forces on them.
    given : (n,) array, optional
        Rotation speed, negative when rolling forwards [rad/s]; None: free.
    """

    task: Task
    chunk: ContactConditions
    guidance: Guidance
    given: FloatArray | None

    @property
    def wanted(self) -> NDArray[np.bool_]:
        """Unknowns (n, 6) that are searched for."""
        free = np.ones((self.chunk.shift.size, UNKNOWNS), dtype=bool)
        free[:, SPEED] = self.given is None
        free[:, ROLL] = self.chunk.free_roll
        free[:, SHIFT:] = self.guidance.free
        return free

    def conditions(self, unknown: FloatArray) -> ContactConditions:
        """Conditions in the pose of unknowns."""
        return replace(
            self.chunk,
            shift=SHIFT_UNIT * unknown[:, SHIFT],
            yaw=YAW_UNIT * unknown[:, YAW],
            roll=ROLL_UNIT * unknown[:, ROLL],
        )

    @cached_property
    def _even(self) -> ContactConditions:
        """Conditions with half the axle load on each wheel, over which the unknowns of `axle` are taken."""
        return replace(self.chunk, wheel_load=0.5 * self.guidance.axle_load)

    def speed(self, unknown: FloatArray) -> FloatArray:
        """Rotation speed (n,), negative when rolling forwards [rad/s]."""
        return read(self.task, self._even, unknown)[0] if self.given is None else self.given

    def loads(self, unknown: FloatArray) -> FloatArray:
        """Return the loads L (n, 2) [N]."""
        return read(self.task, self._even, unknown)[1]

    def position(self, unknown: FloatArray) -> FloatArray:
        """Lateral position of the axle and yaw (n, 2) [m, rad]."""
        posed = self.conditions(unknown)
        return np.stack([posed.axle_shift(), posed.yaw], axis=1)

    def unknown(self, speed: FloatArray, load: FloatArray, roll: FloatArray) -> FloatArray:
        """Unknowns (n, 6) at the pose of the conditions.

        Parameters
        ----------
        speed, roll : (n,) array
            Rotation speed [rad/s] and roll [rad].
        load : (n, 2) array
            Loads L [N].
        """
        shift, yaw = self.chunk.shift / SHIFT_UNIT, self.chunk.yaw / YAW_UNIT
        return np.column_stack([written(self.task, self._even, speed, load, roll), shift, yaw])

    def tolerances(self, tolerance: float) -> FloatArray:
        """Tolerances (n, 6) of the residuals, with that of forces over the axle load."""
        most = np.full((self.chunk.shift.size, UNKNOWNS), tolerance)
        at_radius = tolerance * self.guidance.axle_load / self.chunk.traction_scale
        most[:, SPEED] = np.maximum(at_radius, TANGENTIAL_MODELS[self.task.models.tangential].tolerance)
        most[:, ROLL] = max(resting(self.task), tolerance / _HEIGHTS)
        return most

    @property
    def may_jump(self) -> bool:
        """Whether normal or creep forces jump with the pose, so that no pose may balance."""
        return NORMAL_MODELS[self.task.models.normal].several_solutions or self.jump > 0.0

    @property
    def jump(self) -> float:
        """Largest jump of the creep forces over what friction can carry."""
        return TANGENTIAL_MODELS[self.task.models.tangential].jump

    def contact(self, unknown: FloatArray, rows: NDArray[np.bool_], start: Wheels | None) -> Contact:
        """Solve the contact of wheelsets `rows` (n,) in a state (n, 6), from wheels nearby if known."""
        posed, load = self.conditions(unknown), self.loads(unknown)
        if NORMAL_MODELS[self.task.models.normal].several_solutions:
            start = None
        solved = rows.copy()
        while solved.any():
            index = np.flatnonzero(solved)
            both = np.repeat(solved[:, None], 2, axis=1)
            try:
                sides = [side_of(self.task, number, posed, index) for number in (0, 1)]
                wheels = solved_wheels(self.task, posed, sides, load, both, start)
                return Contact(wheels, self._forces(unknown, wheels), solved)
            except ContactError as error:
                if error.row is None:
                    raise
                solved[[error.row, *error.rows]] = False
        return Contact(None, np.zeros((len(unknown), 2, 6)), solved)

    def by_unknown(self, unknown: FloatArray, now: Contact, rows: NDArray[np.bool_]) -> list[Contact]:
        """Contact of wheelsets `rows` (n,) at `DIFFERENCES` from a state (n, 6), of each unknown in turn.

        Unknowns that none of them is searched for are left as they are.
        """
        assert now.wheels is not None
        wheels = patches_where(now.wheels, rows[now.wheels.normal.patch.row])
        wanted = np.asarray(self.wanted[rows].any(axis=0))
        heavier = stretched(wheels, np.exp(DIFFERENCES[RIGHT]) * loads_of(wheels, len(rows)))
        under_load = self._forces(unknown, heavier)
        found = []
        for column in range(UNKNOWNS):
            moved = unknown.copy()
            moved[:, column] += DIFFERENCES[column]
            forces = now.forces
            if column == SPEED and wanted[SPEED]:
                forces = self._forces(moved, wheels)
            elif RIGHT <= column < ROLL:
                forces = forces.copy()
                forces[:, column - RIGHT] = under_load[:, column - RIGHT]
            elif column >= ROLL and wanted[column]:
                found.append(self.contact(moved, rows, wheels))
                continue
            found.append(Contact(wheels, forces, rows))
        return found

    def _forces(self, unknown: FloatArray, wheels: Wheels) -> FloatArray:
        """Add up the forces (n, 2, 6) of the contact of wheels."""
        task, count = self.task, len(unknown)
        model = TANGENTIAL_MODELS[task.models.tangential]
        creep = forces_of(task, wheels, self.speed(unknown), model)
        planes, left = planes_of(wheels.normal), wheels.sign < 0.0
        z = height(task, left, wheels.normal.vertical_displacement, planes.y)
        curvature = np.where(left, task.curvature[1], task.curvature[0])
        track = track_forces(wheels, planes, creep.contact.plane_force, z, curvature)
        forces = np.zeros((2 * count, 6))
        for column, value in (
            (VERTICAL, track.vertical),
            (LATERAL, track.lateral),
            (YAW_MOMENT, track.yaw_moment),
            (ROLL_MOMENT, track.roll_moment),
        ):
            forces[:, column] = np.bincount(wheels.place, value, 2 * count)
        forces[:, TORQUE] = creep.torque.ravel()
        forces[:, DISPLACEMENT] = displacements(wheels, count).ravel()
        return forces.reshape(count, 2, 6)
