"""How a wheelset with given wheels runs on given rails: rolling radius difference and conicity."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from wearsim.contact.patch import FloatArray
from wearsim.errors import ProfileError
from wearsim.profile.conicity import equivalent_conicity, rolling_radius_difference
from wearsim.profile.measures import flange_height
from wearsim.profile.shape import Profile, extremum

AMPLITUDES = (1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3)
"""Amplitudes of the conicity, and shifts at which the radius difference is told [m]."""

_REACH = 8e-3  # shifts drawn [m]
_STEP = 0.1e-3


@dataclass(frozen=True)
class Running:
    """Running behaviour of a pair of wheels on a pair of rails.

    Parameters
    ----------
    wheel, left, rail : str
        Names; `left` is empty if both wheels are alike.
    shift, difference : (n,) array
        Lateral shift and rolling radius of the right minus that of the left wheel, as far as both stay on
        their profiles [m].
    at : tuple of (float, float or None)
        Shift and difference at `AMPLITUDES`, to either side if the wheels differ; None beyond the profiles
        [m].
    conicity : tuple of (float, float or None, str)
        Amplitude [m], equivalent conicity [-], and why there is none.
    track : str
        Rail, inclination, gauge and flange back distance in words.
    """

    wheel: str
    left: str
    rail: str
    shift: FloatArray = field(repr=False)
    difference: FloatArray = field(repr=False)
    at: tuple[tuple[float, float | None], ...]
    conicity: tuple[tuple[float, float | None, str], ...]
    track: str


def running(
    right: Profile,
    left: Profile | None,
    rail: Profile,
    track: str,
    diameter_difference: float = 0.0,
    amplitudes: tuple[float, ...] = AMPLITUDES,
) -> Running:
    """Compute rolling radius difference and equivalent conicity.

    Parameters
    ----------
    right, left : Profile
        Wheels in the axes of a right wheel; None: the left one is like the right one.
    rail : Profile
        Placed in the track.
    track : str
        The track in words.
    diameter_difference : float
        Diameter of the right minus that of the left wheel at their tape circles, as they are now [m].
    amplitudes : tuple of float
        Of the conicity, and shifts at which the radius difference is told [m].

    Returns
    -------
    Running
        Wheels that differ have equal radii at their tape circles but for the difference stated.
    """
    differ = left is not None or diameter_difference != 0.0
    if left is not None or differ:
        other = _from_tape(right if left is None else left)
        right = _from_tape(right)
        other = replace(other, z=other.z - 0.5 * diameter_difference)
    else:
        other = right
    shifts = [sign * each for sign in ((-1.0, 1.0) if differ else (1.0,)) for each in amplitudes]
    at = tuple((shift, _at(right, other, rail, shift)) for shift in sorted(shifts))
    shift, difference = _curve(right, other, rail)
    conicity = tuple(_conicity(right, other, rail, amplitude) for amplitude in amplitudes)
    name = left.name if left is not None else right.name if differ else ""
    return Running(right.name, name, rail.name, shift, difference, at, conicity, track)


def _from_tape(wheel: Profile) -> Profile:
    """Wheel with z counted from its own tape circle."""
    tip = extremum(wheel.y, wheel.z, int(np.argmax(wheel.z)))[1]
    return replace(wheel, z=wheel.z - (tip - flange_height(wheel.y, wheel.z)))


def _at(right: Profile, left: Profile, rail: Profile, shift: float) -> float | None:
    """Radius difference at one shift, None beyond the profiles."""
    try:
        return float(rolling_radius_difference(right, left, rail, np.array([shift]))[0])
    except ProfileError:
        return None


def _curve(right: Profile, left: Profile, rail: Profile) -> tuple[FloatArray, FloatArray]:
    """Radius difference over as much of the range of shifts as the profiles allow."""
    count = round(_REACH / _STEP)
    while count > 0:
        shift = _STEP * np.arange(-count, count + 1, dtype=np.float64)
        try:
            return shift, rolling_radius_difference(right, left, rail, shift)
        except ProfileError:
            count -= 2
    return np.empty(0), np.empty(0)


def _conicity(
    right: Profile, left: Profile, rail: Profile, amplitude: float
) -> tuple[float, float | None, str]:
    """Amplitude, conicity and why there is none."""
    try:
        value = equivalent_conicity(right, left, rail, amplitude=amplitude)
    except ProfileError:
        return amplitude, None, "a contact lies beyond the end of a profile"
    if value is None:
        return amplitude, None, "undefined: the wheelset is not led to and fro over this amplitude"
    return amplitude, value, ""
