r"""Equal operating points, and those that are mirror images of each other.

A train that is turned for half of its distance, and a wheelset that sways on straight
track, meet each contact twice: once on either side. With equal wheels and rails the
left wheel at the shift y and the yaw p is in the state of the right one at -y and -p,
so that one of the two is solved and the other one copied.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.axle import (
    DIFFERENCE,
    LEFT,
    RIGHT,
    ROLL,
    SHIFT,
    UNKNOWNS,
    YAW,
)
from wearsim.contact.balance import Equilibria, Guided
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import (
    ContactConditions,
    ContactPatches,
    Counterface,
    Wheelset,
)
from wearsim.profile.shape import Profile

# Relative difference up to which conditions are equal, and distance of equal profiles:
# those of wheels that wear equally differ in last bits.
_EQUAL, _SAME_PLACE = 1e-9, 1e-10  # [-, m]
# fields that are the same in the mirror image, and those that change their sign
_EVEN = "speed", "friction", "friction_flange", "shift_depth", "rail"
_ODD = (
    "shift",
    "yaw",
    "roll",
    "track_curvature",
    "drift",
    "speed_difference",
    "torque_difference",
)
_ODD_OF_PATCHES = (
    "contact_angle",
    "creepage_y",
    "spin",
    "force_y",
    "spin_moment",
    "track_lateral",
    "track_yaw_moment",
    "track_roll_moment",
    "roll",
)
# unknowns of a wheelset in the order and with the signs of its mirror image
_ORDER = np.arange(UNKNOWNS)
_ORDER[[RIGHT, LEFT]] = LEFT, RIGHT
_SIGN = np.ones(UNKNOWNS)
_SIGN[[ROLL, SHIFT, YAW, DIFFERENCE]] = -1.0


@dataclass(frozen=True)
class Images:
    """Which of n operating points are copies of others.

    Parameters
    ----------
    source : (n,) int array
        Point that each one is a copy of, its own number if of none.
    mirrored : (n,) bool array
        True for mirror images of the source; the others are like it.
    """

    source: IntArray
    mirrored: NDArray[np.bool_]

    @property
    def copied(self) -> NDArray[np.bool_]:
        """True for points (n,) that are copies."""
        return np.asarray(self.source != np.arange(self.source.size))

    def among(self, rows: IntArray, count: int) -> Images:
        """Return the images of the points `rows` (n,) among `count` of them."""
        source, mirrored = np.arange(count), np.zeros(count, dtype=bool)
        source[rows], mirrored[rows] = rows[self.source], self.mirrored
        return Images(source, mirrored)


def is_symmetric(wheelset: Wheelset, counterface: Counterface) -> bool:
    """Return True if the left sides of both bodies are like the right ones."""
    return (
        wheelset.diameter_difference == 0.0
        and _same(wheelset.right, wheelset.left)
        and all(
            pair.curvatures[0] == pair.curvatures[1] and _same(*pair.profiles)
            for pair in (counterface, *counterface.further)
        )
    )


def _same(right: Profile, left: Profile) -> bool:
    """Return True if two profiles have the same points."""
    return right is left or (
        right.y.size == left.y.size
        and np.abs(right.y - left.y).max() <= _SAME_PLACE
        and np.abs(right.z - left.z).max() <= _SAME_PLACE
    )


def images_of(
    conditions: ContactConditions,
    symmetric: bool,
    *,
    even: Sequence[FloatArray] = (),
    odd: Sequence[FloatArray] = (),
) -> Images:
    """Find the operating points that are copies of others.

    Parameters
    ----------
    conditions : ContactConditions
        Of n points.
    symmetric : bool
        Whether mirror images are copies, as the bodies are.
    even, odd : sequence of (n,) arrays
        Further conditions: those that are the same in a mirror image, and those that
        change their sign.

    Returns
    -------
    Images
        Of each group of copies the first point is the source.
    """
    count = conditions.shift.size
    points = np.arange(count)
    if conditions.creepage is not None or not count:
        return Images(points, np.zeros(count, dtype=bool))
    of_sides = conditions.loads
    moment = np.zeros(count)
    if conditions.box_moment is not None:
        moment = conditions.box_moment
    torque = np.broadcast_to(np.asarray(conditions.torque), count)
    same = [*even, of_sides.sum(axis=1), np.isfinite(moment), torque]
    given = {name: getattr(conditions, name) for name in (*_EVEN, *_ODD)}
    if conditions.free_roll:
        given["roll"] = None  # a first guess
    same += [given[name] for name in _EVEN if given[name] is not None]
    if isinstance(conditions.rotation, np.ndarray):
        same.append(conditions.rotation)
    signed = [*odd, of_sides[:, 0] - of_sides[:, 1], np.nan_to_num(moment)]
    signed += [given[name] for name in _ODD if given[name] is not None]
    unsigned, directed = _rounded(same), _rounded(signed)
    first = np.argmax(directed != 0.0, axis=1)
    flipped = symmetric & (directed[points, first] < 0.0)
    directed = np.where(flipped[:, None], -directed, directed) + 0.0
    _, begin, group = np.unique(
        np.concatenate([unsigned, directed], axis=1),
        axis=0,
        return_index=True,
        return_inverse=True,
    )
    finite = np.isfinite(unsigned).all(axis=1) & np.isfinite(directed).all(axis=1)
    source = np.where(finite, begin[group.ravel()], points)
    return Images(source, flipped != flipped[source])


def _rounded(columns: Sequence[FloatArray]) -> FloatArray:
    """Columns of numbers (n, k) in units of what counts as equal."""
    values = np.stack(columns, axis=1).astype(float)
    unit = _EQUAL * np.abs(np.nan_to_num(values)).max(axis=0)
    return np.round(values / np.where(unit > 0.0, unit, 1.0)) + 0.0


def copied_patches(
    patches: ContactPatches, mirrored: NDArray[np.bool_]
) -> ContactPatches:
    """Return patches (m,) of copies; those of mirror images are on the other side.

    Parameters
    ----------
    patches : ContactPatches
        Of the sources, one for each patch of the copies.
    mirrored : (m,) bool array
        Patches of mirror images.
    """
    sign = np.where(mirrored, -1.0, 1.0)
    changed = {name: sign * getattr(patches, name) + 0.0 for name in _ODD_OF_PATCHES}
    patch = patches.patch
    if patch.planes is not None:
        angle = sign[:, None] * patch.planes.angle + 0.0
        patch = replace(patch, planes=replace(patch.planes, angle=angle))
    nearby = Equilibria.of_placed(patches.nearby)
    return replace(
        patches,
        **changed,
        side=np.where(mirrored, 1 - patches.side, patches.side),
        nearby=_mirrored_equilibria(nearby, mirrored).placed,
        patch=patch,
    )


def copied_balances(balances: Guided, mirrored: NDArray[np.bool_]) -> Guided:
    """Return the ends of the searches of copies (n,), some of them mirror images.

    Parameters
    ----------
    balances : Guided
        Of the sources, one for each copy.
    mirrored : (n,) bool array
        Mirror images.
    """
    ends = _mirrored_equilibria(balances.equilibria, mirrored)
    other = np.where(mirrored, -balances.other_shift, balances.other_shift)
    return replace(balances, unknown=ends.unknown, slope=ends.slope, other_shift=other)


def _mirrored_equilibria(
    equilibria: Equilibria, mirrored: NDArray[np.bool_]
) -> Equilibria:
    """Equilibria (n,) of which those of mirror images are mirrored."""
    both_signs = _SIGN[:, None] * _SIGN
    image = Equilibria(
        _SIGN * equilibria.unknown[:, _ORDER],
        both_signs * equilibria.slope[:, _ORDER][:, :, _ORDER],
        _SIGN * equilibria.drift[:, _ORDER],
    )
    return image.where(mirrored, equilibria)
