"""Rotation speeds at which creep forces balance the torque on an axle, or its wheels.

The creep forces of an axle, or of a wheel that rotates independently, grow with the
slip up to friction. Where friction falls with the slip velocity they have a crest: a
torque below it is balanced on two branches, of which wheels run on that of small slip;
the other one is unstable.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.equilibrium import balanced_rotation, check_torque
from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import ContactConditions
from wearsim.contact.wheels import Wheels, planes_of
from wearsim.errors import NumericalError, listed

Torque = Callable[[FloatArray, NDArray[np.bool_]], FloatArray]
"""Torque (n, 2) of the creep forces of both wheels [N m].

Its arguments are rotation speeds [rad/s], and the mask of the wheels that are needed.
"""


class CrestError(NumericalError):
    """Error: a torque on an axle is beyond the crest of its creep forces."""


class Rotation(NamedTuple):
    """Rotation speeds of n wheelsets.

    Parameters
    ----------
    speed : (n, 2) array
        Of both wheels, negative when rolling forwards; nearest to the balance where
        there is none [rad/s].
    solved : (n,) bool array
        True where the torque is balanced.
    missing : (n,) array
        Torque on the axle less the nearest one of the creep forces [N m].
    """

    speed: FloatArray
    solved: NDArray[np.bool_]
    missing: FloatArray


def free_rotation(
    torque: Torque,
    chunk: ContactConditions,
    radius: float,
    first: FloatArray,
    done: NDArray[np.bool_],
    *,
    crest: bool,
) -> Rotation:
    """Solve for the rotation speeds near which creep forces balance the torque.

    Parameters
    ----------
    torque : callable
        Of the creep forces; the last evaluation of a wheel is at the speed returned.
    chunk : ContactConditions
        n points, whose rotation follows from torques.
    radius : float
        Of the wheels [m].
    first : (n, 2) array
        First guess [rad/s]; with a crest, speeds of rolling without slip.
    done : (n,) bool array
        Wheelsets that keep the first guess.
    crest : bool
        Whether friction falls with the slip velocity.

    Raises
    ------
    NumericalError
        Without crest, if no speed balances a torque.
    """
    count = chunk.shift.size
    columns = 2 if chunk.independent else 1  # of wheels, or of an axle

    def of_wheels(values: NDArray[Any]) -> NDArray[Any]:
        return np.broadcast_to(values.reshape(count, columns), (count, 2))

    def of_columns(values: float | FloatArray) -> FloatArray:
        return np.repeat(np.broadcast_to(values, count), columns)

    def total(speed: FloatArray, needed: NDArray[np.bool_]) -> FloatArray:
        both = torque(of_wheels(speed), of_wheels(needed))
        of_each: FloatArray = both.reshape(count, columns, 2 // columns).sum(axis=2)
        return of_each.ravel()

    most = chunk.traction * radius
    applied = of_columns(np.asarray(chunk.torque) / columns)
    if chunk.independent:
        apart = of_columns(chunk.torque_apart)
        applied = applied + 0.5 * apart * np.tile([1.0, -1.0], count)
    if not crest:
        check_torque(chunk.torque, most)
    speed, solved, missing = balanced_rotation(
        total,
        first[:, :columns].ravel(),
        of_columns(-chunk.speed / radius),
        applied,
        of_columns(most),
        np.repeat(done, columns),
        crest=crest,
    )
    every = np.asarray(of_wheels(solved).all(axis=1))
    if not (every.all() or crest):
        row = int(np.argmin(every))
        torques = [f"{one:g}" for one in applied.reshape(count, columns)[row]]
        who = "wheels (right, left)" if chunk.independent else "axle"
        raise NumericalError(
            f"no rotation speed balances the torque of {listed(torques)} N m on the "
            f"{who}; lower it, or raise the friction coefficient",
            row=row,
            rows=np.flatnonzero(~every).tolist(),
        )
    short = missing.reshape(count, columns)
    furthest = np.take_along_axis(
        short, np.abs(short).argmax(axis=1)[:, None], axis=1
    ).ravel()
    return Rotation(of_wheels(speed), every, columns * furthest)


def rolling_speeds(wheels: Wheels, independent: bool, count: int) -> FloatArray:
    """Rotation speeds (n, 2) without mean longitudinal creepage [rad/s].

    The mean is weighted with the normal forces of an axle, or of each of its wheels.
    """
    weight = planes_of(wheels.normal).normal_force
    at_rest, per_speed = (
        np.bincount(
            wheels.place, (weight * part[:, :, 0]).sum(axis=1), 2 * count
        ).reshape(-1, 2)
        for part in (wheels.kinematics.at_rest, wheels.kinematics.per_speed)
    )
    if not independent:
        at_rest, per_speed = (
            np.repeat(part.sum(axis=1, keepdims=True), 2, axis=1)
            for part in (at_rest, per_speed)
        )
    turns = per_speed != 0.0
    speed: FloatArray = -np.where(turns, at_rest, 0.0) / np.where(turns, per_speed, 1.0)
    return speed


def beyond_crest(
    applied: float | FloatArray, rotation: Rotation, rows: NDArray[np.bool_]
) -> CrestError:
    """Error of the wheelsets `rows` (n,) whose torque is beyond the crest."""
    row = int(np.argmax(rows))
    torque = float(np.broadcast_to(applied, rows.shape)[row])
    return CrestError(
        f"an axle torque of {torque:g} N m is beyond the crest of the creep forces, "
        f"{torque - rotation.missing[row]:.0f} N m, behind which friction falls with "
        "the slip; lower the torque, or raise the friction coefficient",
        row=row,
        rows=np.flatnonzero(rows).tolist(),
    )
