"""Roll and rotation speed of a wheelset from the equilibrium of its wheels."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.creepage import Kinematics
from wearsim.contact.patch import FloatArray, IntArray, mean_over_planes
from wearsim.errors import NumericalError

_MOST_WIDENINGS, _MOST_STEPS = 12, 60
# Strides of the search of a nearest root, their growth, and golden sections at a crest:
# strides of 0.02 % of the speed and more go to 26 %, sections to 1e-4 of a stride.
_MOST_STRIDES, _GROWTH, _MOST_SECTIONS = 16, 1.5, 20
_MOST_ROLLS = 20
# Largest last change of the roll [rad]: where loads jump with the roll it does not
# converge.
_LARGEST_CHANGE = 1e-4
# limits of the slope of the height difference by the roll, over the wheel distance
_LEAST_FALL, _LARGEST_FALL = (
    0.1,
    5.0,
)


def falling_root(
    function: Callable[[FloatArray, NDArray[np.bool_]], FloatArray],
    first: FloatArray,
    step: FloatArray,
    *,
    goal: FloatArray,
    narrow: FloatArray,
    done: NDArray[np.bool_],
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Root of a decreasing function by regula falsi (Illinois), bracketed by row.

    Parameters
    ----------
    function : callable
        Values (n,) at arguments (n,) of the rows in a mask (n,); values of other rows
        are ignored. The value of a row depends on its own argument only.
    first, step : (n,) array
        Middle and half width of the first bracket; it is widened up to 4096 times where
        it holds no root.
    goal : (n,) array
        A row is done where the value's magnitude is at most this,
    narrow : (n,) array
        or its bracket at most this wide.
    done : (n,) bool array
        Rows that keep `first`.

    Returns
    -------
    root : (n,) array
        With the same bits whatever other rows are in the batch.
    solved : (n,) bool array
        False where no bracket holds a root.
    """
    low, high = first - step, first + step
    value_at_low, value_at_high = function(low, ~done), function(high, ~done)
    for _ in range(_MOST_WIDENINGS):
        wide_low, wide_high = (
            (value_at_low < 0.0) & ~done,
            (value_at_high > 0.0) & ~done,
        )
        if not (wide_low.any() or wide_high.any()):
            break
        step = 2.0 * step
        low = np.where(wide_low, low - step, low)
        high = np.where(wide_high, high + step, high)
        value_at_low = np.where(wide_low, function(low, wide_low), value_at_low)
        value_at_high = np.where(wide_high, function(high, wide_high), value_at_high)
    solved = ((value_at_low >= 0.0) & (value_at_high <= 0.0)) | done
    root = _refined(
        function,
        first,
        (low, high),
        (value_at_low, value_at_high),
        goal=goal,
        narrow=narrow,
        done=done | ~solved,
    )
    return root, solved


def _refined(
    function: Callable[[FloatArray, NDArray[np.bool_]], FloatArray],
    first: FloatArray,
    bracket: tuple[FloatArray, FloatArray],
    values: tuple[FloatArray, FloatArray],
    *,
    goal: FloatArray,
    narrow: FloatArray,
    done: NDArray[np.bool_],
) -> FloatArray:
    """Root (n,) within brackets, whose values are above and below 0.

    Other parameters are those of `falling_root`.
    """
    (low, high), (value_at_low, value_at_high) = bracket, values
    root, last = first.copy(), np.zeros(first.size)
    for _ in range(_MOST_STEPS):
        width = value_at_low - value_at_high
        flat = width <= 0.0
        share = np.where(flat, 0.5, value_at_low / np.where(flat, 1.0, width))
        # A converged row keeps its root, so that it does not depend on its neighbours
        # in the batch.
        root = np.where(done, root, low + share * (high - low))
        value = function(root, ~done)
        done |= (np.abs(value) <= goal) | (np.abs(high - low) <= narrow)
        if done.all():
            break
        rising = value > 0.0
        low, high = np.where(rising, root, low), np.where(rising, high, root)
        # Illinois: halve the value kept at the end that did not move twice in a row.
        value_at_high = np.where(
            rising, np.where(last > 0, 0.5 * value_at_high, value_at_high), value
        )
        value_at_low = np.where(
            rising, value, np.where(last < 0, 0.5 * value_at_low, value_at_low)
        )
        last = np.where(rising, 1.0, -1.0)
    return root


def nearest_root(
    function: Callable[[FloatArray, NDArray[np.bool_]], FloatArray],
    first: FloatArray,
    step: FloatArray,
    *,
    goal: FloatArray,
    narrow: FloatArray,
    done: NDArray[np.bool_],
) -> tuple[FloatArray, NDArray[np.bool_], FloatArray]:
    """Root nearest to `first` of a function with a crest.

    Strides of growing length go from `first` to where the magnitude falls. Where none
    holds a root the value nearest to 0 is found by golden section: that of a crest.

    Parameters
    ----------
    function, goal, narrow, done
        As of `falling_root`.
    first, step : (n,) array
        Argument to begin with, and length of the first stride.

    Returns
    -------
    root : (n,) array
        Or the argument of the value nearest to 0.
    solved : (n,) bool array
        False where there is no root.
    missing : (n,) array
        Value nearest to 0 where there is none, else 0.
    """
    value = function(first, ~done)
    sign = np.where(value > 0.0, 1.0, -1.0)
    left = ~done & (np.abs(value) > goal)
    height = sign * value
    further = sign * function(first + sign * step, left)
    way = np.where(further > height, -sign, sign)
    near, far = first.copy(), first.copy()
    stops, heights = [first], [height]
    for number in range(_MOST_STRIDES):
        if not left.any():
            break
        ahead = stops[-1] + way * _GROWTH**number * step
        height_ahead = sign * function(ahead, left)
        crossed = left & (height_ahead <= 0.0)
        near, far = np.where(crossed, stops[-1], near), np.where(crossed, ahead, far)
        left = left & ~crossed
        stops.append(ahead)
        heights.append(np.where(left, height_ahead, np.inf))
    if left.any():
        # neighbours of the stop nearest to the root
        lowest = np.argmin(heights, axis=0)
        rows = np.arange(first.size)
        behind = np.array(stops)[np.maximum(lowest - 1, 0), rows]
        beyond = np.array(stops)[np.minimum(lowest + 1, len(stops) - 1), rows]
        place, height, crossed = _lowest(function, sign, behind, beyond, left)
        near, far = np.where(crossed, behind, near), np.where(crossed, place, far)
        left = left & ~crossed
        first = np.where(left, place, first)
        function(first, left)  # the last evaluation of a row is at its root
    bracketed = ~done & (near != far)
    low, high = np.minimum(near, far), np.maximum(near, far)
    falls = sign * way  # -1: the function rises at the root

    def falling(argument: FloatArray, rows: NDArray[np.bool_]) -> FloatArray:
        return falls * function(argument, rows)

    root = _refined(
        falling,
        first,
        (low, high),
        (falling(low, bracketed), falling(high, bracketed)),
        goal=goal,
        narrow=narrow,
        done=~bracketed,
    )
    return root, ~left, np.where(left, sign * height, 0.0)


def _lowest(
    function: Callable[[FloatArray, NDArray[np.bool_]], FloatArray],
    sign: FloatArray,
    start: FloatArray,
    end: FloatArray,
    rows: NDArray[np.bool_],
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """Argument and value of the lowest sign * function between two arguments (n,).

    By golden section, of `rows` (n,). The last value is the mask of the rows in which
    it is at most 0, for which the search ends there.
    """
    golden = 0.5 * (np.sqrt(5.0) - 1.0)
    crossed = np.zeros(rows.size, dtype=bool)
    inner = [start + (1.0 - golden) * (end - start), start + golden * (end - start)]
    heights = [sign * function(place, rows) for place in inner]
    for _ in range(_MOST_SECTIONS):
        place = np.where(heights[0] <= heights[1], *inner)
        height = np.minimum(*heights)
        crossed = rows & (height <= 0.0)
        left = rows & ~crossed
        if not left.any():
            break
        nearer = heights[0] <= heights[1]
        end = np.where(left & nearer, inner[1], end)
        start = np.where(left & ~nearer, inner[0], start)
        new = np.where(
            nearer,
            start + (1.0 - golden) * (end - start),
            start + golden * (end - start),
        )
        new_height = sign * function(np.where(left, new, place), left)
        inner, heights = (
            [np.where(nearer, new, inner[1]), np.where(nearer, inner[0], new)],
            [
                np.where(nearer, new_height, heights[1]),
                np.where(nearer, heights[0], new_height),
            ],
        )
        inner = [np.where(left, value, place) for value in inner]
        heights = [np.where(left, value, height) for value in heights]
    return place, height, crossed


def resting_roll(
    displacements: Callable[
        [FloatArray, NDArray[np.bool_]], tuple[FloatArray, FloatArray]
    ],
    guess: FloatArray,
    half_span: float,
    tolerance: float = 1e-9,
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Roll at which both loads give the axle the same vertical displacement [rad].

    It is solved by the bracketed secant method.

    Parameters
    ----------
    displacements : callable
        For (n,) rolls [rad], the displacements of the right and the left wheel from the
        axle's design height under their loads [m], of the rows in a mask (n,). The roll
        moves each of them, so that their difference falls with it. Rows at rest are not
        evaluated again.
    guess : (n,) array
        First guess [rad].
    half_span : float
        Half the distance of the wheels, for the second guess [m].
    tolerance : float
        Of the difference [m].

    Returns
    -------
    roll : (n,) array
        [rad].
    solved : (n,) bool array
        False where no roll lets both wheels carry their loads: a wheel that climbs its
        flange rises faster by moving sideways than it sinks by rolling.
    """
    roll, span = guess.copy(), 2.0 * half_span
    moving = np.ones(guess.size, bool)
    low, high = np.full(guess.size, -np.inf), np.full(guess.size, np.inf)
    before, step, fall = np.zeros(guess.size), np.ones(guess.size), np.ones(guess.size)
    for trial in range(_MOST_ROLLS):
        right, left = displacements(roll, moving)
        off = np.where(moving, right - left, 0.0)
        low, high = (
            np.where(off > 0.0, roll, low),
            np.where(moving & (off <= 0.0), roll, high),
        )
        if trial > 0:
            clear = moving & (np.abs(before - off) > tolerance)
            seen = (before - off) / (np.where(clear, step, 1.0) * span)
            likely = np.where(
                seen > 0.0, np.clip(seen, _LEAST_FALL, _LARGEST_FALL), 1.0
            )
            fall = np.where(clear, likely, fall)
        aim = roll + off / (span * fall)
        outside = moving & ~((low < aim) & (aim < high)) & (off != 0.0)
        aim[outside] = 0.5 * (low[outside] + high[outside])
        moving = moving & (np.abs(off) > tolerance)
        if trial == _MOST_ROLLS - 1:
            moving &= np.abs(aim - roll) > _LARGEST_CHANGE
        if not moving.any():
            break
        before, step = off, np.where(moving, aim - roll, 1.0)
        roll = np.where(moving, aim, roll)
    return roll, ~moving


RULES = ("free", "independent", "centred", "nominal")
"""Rules of the rotation speed."""
TORQUE_RULES = ("free", "independent")
"""Rules with which it follows from torques."""

# first bracket of the torque, over friction coefficient x wheel load x radius
_TOLERANCE = 1e-2


def rotation_without_creepage(
    motion: Kinematics, normal_force: FloatArray, row: IntArray, rows: int
) -> FloatArray:
    """Rotation speed without longitudinal creepage in the first patch of each row.

    The first patch is the most loaded one.

    Parameters
    ----------
    motion : Kinematics
        Of (m,) patches, ordered by row and falling normal force.
    normal_force : (m, N) array
        In the planes of each patch, whose mean longitudinal creepage is that of the
        patch [N].
    row : (m,) int array
        Row of each patch.
    rows : int
        Number of rows.

    Returns
    -------
    (rows,) array
        [rad/s].
    """
    first = np.searchsorted(row, np.arange(rows))
    load = normal_force[first]
    at_rest = mean_over_planes(motion.at_rest[first, :, 0], load)
    speed: FloatArray = -at_rest / mean_over_planes(motion.per_speed[first, :, 0], load)
    return speed


def check_torque(applied: float | FloatArray, scale: FloatArray) -> None:
    """Raise a NumericalError for an axle torque beyond what friction can carry.

    Parameters
    ----------
    applied : float or (n,) array
        Applied to the axle in the rolling direction [N m].
    scale : (n,) array
        Friction coefficient x wheel load x radius [N m].
    """
    applied = np.broadcast_to(applied, scale.shape)
    beyond = (np.abs(applied) > 2.1 * scale) | ((scale == 0.0) & (applied != 0.0))
    if beyond.any():
        row = int(np.argmax(beyond))
        raise NumericalError(
            f"an axle torque of {applied[row]:g} N m is more than friction can carry "
            f"({2.0 * scale[row]:.3g} N m); lower the torque or raise the friction "
            "coefficient",
            row=row,
            rows=np.flatnonzero(beyond).tolist(),
        )


def balanced_rotation(
    torque: Callable[[FloatArray, NDArray[np.bool_]], FloatArray],
    first: FloatArray,
    nominal: FloatArray,
    applied: FloatArray,
    scale: FloatArray,
    done: NDArray[np.bool_],
    *,
    crest: bool = False,
) -> tuple[FloatArray, NDArray[np.bool_], FloatArray]:
    """Rotation speed near which the creep forces balance the applied torque.

    They are those of both wheels of an axle, or of one wheel.

    Parameters
    ----------
    torque : callable
        Torque of the creep forces about the axle [N m] for (n,) rotation speeds
        [rad/s], of the rows in a mask (n,); it falls with the speeds. The last
        evaluation of a row is at the speed returned.
    first : (n,) array
        First guess [rad/s].
    nominal : (n,) array
        V / r0 with its sign [rad/s].
    applied : (n,) array
        Applied torque in the rolling direction [N m].
    scale : (n,) array
        Friction coefficient x wheel load x radius: what one wheel can carry at most,
        about [N m].
    done : (n,) bool array
        Rows that keep the first guess.
    crest : bool
        Whether the torque has a crest: then its speed is the nearest one to the first
        guess.

    Returns
    -------
    speed : (n,) array
        [rad/s].
    solved : (n,) bool array
        False where no speed balances the torque.
    missing : (n,) array
        Applied torque less the nearest one of the creep forces; 0 without crest [N m].
    """
    # without friction any speed balances a zero torque: keep the nominal one
    nothing = scale == 0.0
    goal = np.maximum(scale, 1e-300) * _TOLERANCE
    narrow = 1e-14 * np.abs(nominal)

    def excess(speed: FloatArray, rows: NDArray[np.bool_]) -> FloatArray:
        return torque(speed, rows) - applied

    if crest:
        speed, solved, missing = nearest_root(
            excess,
            first,
            np.abs(nominal) * 2e-4,
            goal=goal,
            narrow=narrow,
            done=nothing | done,
        )
        return speed, solved, -missing
    speed, solved = falling_root(
        excess,
        first,
        np.abs(nominal) * 2e-3,
        goal=goal,
        narrow=narrow,
        done=nothing | done,
    )
    return speed, solved, np.zeros(scale.size)
