"""Roll of a wheelset that rests on both wheels."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.patch import FloatArray
from wearsim.contact.root import falling_root

_HEIGHT_TOLERANCE = 1e-11  # m, between the descents of the two wheels


def resting(
    descents: Callable[[FloatArray], tuple[FloatArray, FloatArray]], guess: FloatArray, half_span: float
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Roll at which both loads push the axle down by the same height.

    Parameters
    ----------
    descents : callable
        For (n,) rolls [rad], the descents of the right and the left wheel from the axle's design height
        under their loads [m]; roll takes each of them along, so that their difference falls with it.
    guess : (n,) array
        First guess [rad].
    half_span : float
        Half the distance of the wheels, for the second guess [m].

    Returns
    -------
    roll : (n,) array
        [rad].
    found : (n,) bool array
        False where no roll lets both wheels carry their loads: a wheel that climbs its flange rises faster
        by moving sideways than it sinks by rolling.
    """

    def difference(roll: FloatArray) -> FloatArray:
        right, left = descents(roll)
        return right - left

    near = guess + difference(guess) / (2.0 * half_span)
    return falling_root(
        difference,
        near,
        np.maximum(0.05 * np.abs(near - guess), 1e-7),
        goal=np.full(guess.size, _HEIGHT_TOLERANCE),
        narrow=np.full(guess.size, 1e-15),
        done=np.zeros(guess.size, bool),
    )
