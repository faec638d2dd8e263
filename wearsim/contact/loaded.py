"""Wheels under load: normal contact solved or stretched from a nearby load.

Between evaluations patches are stretched by similarity (lengths and pressures with the
cube root of the load, exact for a quadratic gap) as long as the load changes by at most
`SIMILAR`, with several patches by a fiftieth of that. Beyond it they are solved anew.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import ContactConditions
from wearsim.contact.wheels import (
    Side,
    Task,
    Wheels,
    by_point,
    normal_of,
    patches_where,
    planes_of,
    wheels_of,
)
from wearsim.errors import ContactError

SIMILAR = 1e-3
"""Change of the logarithm of a load up to which patches are stretched.

Beyond it they are solved anew.
"""
# Factor on it for a wheel with several patches, between which the load shifts.
_SEVERAL = 0.02
# ratio L/Q above which a wheel without solution counts as lifted by creep forces
_RAISED = 1.5


def solved_wheels(
    task: Task,
    chunk: ContactConditions,
    sides: Sequence[Side],
    load: FloatArray,
    included: NDArray[np.bool_],
    rough: bool = False,
) -> Wheels:
    """Solve the normal and the kinematic problem of the wheels `included` (n, 2).

    The loads are (n, 2). The solution of a point does not depend on the other points.
    """
    parts = []
    for side in sides:
        row = np.flatnonzero(included[:, side.number])
        if row.size == 0 and chunk.shift.size > 0:
            continue
        part = load[:, side.number]
        try:
            normal = side.rough
            if normal is None:
                normal = normal_of(task, side, row, part[row], rough=rough)
            several = np.flatnonzero(np.diff(normal.patch.row) == 0)
            if chunk.creepage is not None and several.size > 0 and not rough:
                raise ContactError(
                    (
                        "several patches close: given creepages belong to one; leave "
                        "them out"
                    ),
                    row=int(normal.patch.row[several[0]]),
                )
        except ContactError as error:
            error.side = side.number
            raise
        parts.append(wheels_of(task, side, chunk, normal, part))
    return by_point(parts)[0]


def loads_of(wheels: Wheels, count: int) -> FloatArray:
    """Return the loads (n, 2) of wheels, 1 N for absent wheels."""
    load = np.ones(2 * count)
    load[wheels.place] = wheels.load
    return load.reshape(-1, 2)


def renewed(
    task: Task,
    chunk: ContactConditions,
    sides: Sequence[Side],
    wheels: Wheels,
    load: FloatArray,
    again: NDArray[np.bool_],
    kept: NDArray[np.bool_],
    *,
    rough: bool = False,
) -> Wheels:
    """Wheels `kept` (n, 2), and those solved `again` (n, 2) under their loads."""
    unchanged = kept.ravel()[wheels.place]
    if not again.any():
        return patches_where(wheels, unchanged)
    try:
        solved = solved_wheels(task, chunk, sides, load, again, rough=rough)
    except ContactError as error:
        if error.row is None or error.side is None:
            raise
        times = load[error.row, error.side] / chunk.loads[error.row, error.side]
        shared = chunk.box_moment is not None and np.isfinite(
            chunk.box_moment[error.row]
        )
        if times <= _RAISED or shared:
            raise
        reason = f"at {times:.1f} times the wheel load {error}"
        raise lifted(wheels, error.row, error.side, reason) from None
    if not unchanged.any():
        return solved
    return by_point([patches_where(wheels, unchanged), solved])[0]


def may_be_stretched(
    wheels: Wheels, solved: FloatArray, load: FloatArray
) -> NDArray[np.bool_]:
    """Return True for wheels whose patches may be stretched to other loads.

    They were solved for loads (n, 2).
    """
    several = np.bincount(wheels.place, minlength=load.size).reshape(-1, 2) > 1
    most = np.where(several, _SEVERAL * SIMILAR, SIMILAR)
    return np.asarray(np.abs(np.log(load / solved)) <= most)


def displacements(wheels: Wheels, count: int) -> FloatArray:
    """Vertical displacements (n, 2) of both wheels of each point [m].

    They are 0 for wheels that are absent.
    """
    both = np.zeros(2 * count)
    # Patches of a wheel are stretched separately; the first one, which carries most, is
    # set last.
    both[wheels.place[::-1]] = wheels.normal.vertical_displacement[::-1]
    return both.reshape(-1, 2)


def lifted(
    wheels: Wheels, row: int, side: int, reason: str, rows: Sequence[int] = ()
) -> ContactError:
    """Error of a wheel that normal forces cannot hold down, with the reason."""
    on_wheel = (wheels.normal.patch.row == row) & (wheels.sign == 1.0 - 2.0 * side)
    angles = np.abs(planes_of(wheels.normal).angle[on_wheel])
    angle, friction = angles.max(), wheels.friction[on_wheel].flat[np.argmax(angles)]
    product = friction * np.tan(angle)
    return ContactError(
        f"{'flange locks: ' if product >= 1.0 else ''}at a contact angle of "
        f"{np.degrees(angle):.1f} degrees and a friction coefficient of {friction:g}, "
        f"friction x tan(angle) = {product:.2f}, creep forces lift the wheel, and "
        f"{reason}; lower friction, yaw or shift",
        row=row,
        side=side,
        rows=rows,
    )
