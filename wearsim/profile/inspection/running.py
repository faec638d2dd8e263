"""Running behaviour of a wheelset: rolling radius difference and equivalent conicity."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from wearsim.errors import ProfileError
from wearsim.profile.conicity import equivalent_conicity, rolling_radius_difference
from wearsim.profile.measures import flange_height
from wearsim.profile.shape import FloatArray, Profile, extremum

AMPLITUDES = (1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3)
"""Amplitudes of the conicity, and shifts at which the radius difference is listed [m]."""

JUDGED_AMPLITUDE = 3e-3
"""Amplitude of the conicity that limits speak of [m]."""

_REACH, _STEP = 8e-3, 0.1e-3  # shifts drawn, and their distance [m]


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
        Shift and difference at the amplitudes, to either side if the wheels differ; None beyond the profiles
        [m].
    conicity : tuple of (float, float or None, str)
        Amplitude [m], equivalent conicity [-], and why there is none.
    track : str
        Rail, inclination, gauge and back-to-back distance in words.
    """

    wheel: str
    left: str
    rail: str
    shift: FloatArray = field(repr=False)
    difference: FloatArray = field(repr=False)
    at: tuple[tuple[float, float | None], ...]
    conicity: tuple[tuple[float, float | None, str], ...]
    track: str

    @property
    def judged_conicity(self) -> float | None:
        """Equivalent conicity at `JUDGED_AMPLITUDE` [-]."""
        return next((value for a, value, _ in self.conicity if a == JUDGED_AMPLITUDE), None)


def running(
    right: Profile,
    left: Profile | None,
    rail: Profile,
    track: str = "",
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
        Diameter of the right minus that of the left wheel at their running circles, as they are now [m].
    amplitudes : tuple of float
        Of the conicity, and shifts at which the radius difference is listed [m].

    Returns
    -------
    Running
        Wheels that differ have equal radii at their running circles but for the difference stated.
    """
    differ = left is not None or diameter_difference != 0.0
    other = right if left is None else left
    if differ:
        other, right = _from_running_circle(other), _from_running_circle(right)
        other = replace(other, z=other.z - 0.5 * diameter_difference)
    shifts = sorted(sign * each for sign in ((-1.0, 1.0) if differ else (1.0,)) for each in amplitudes)

    def difference_at(shift: float) -> float | None:
        try:
            return float(rolling_radius_difference(right, other, rail, np.array([shift]))[0])
        except ProfileError:
            return None  # beyond the profiles

    def conicity(amplitude: float) -> tuple[float, float | None, str]:
        try:
            value = equivalent_conicity(right, other, rail, amplitude=amplitude)
        except ProfileError:
            return amplitude, None, "a contact lies beyond the end of a profile"
        why = (
            "" if value is not None else ("undefined: the wheelset is not led to and fro over this amplitude")
        )
        return amplitude, value, why

    return Running(
        right.name,
        other.name if differ else "",
        rail.name,
        *_curve(right, other, rail),
        tuple((shift, difference_at(shift)) for shift in shifts),
        tuple(map(conicity, amplitudes)),
        track,
    )


def _from_running_circle(wheel: Profile) -> Profile:
    """Wheel with z counted from its own running circle."""
    tip = extremum(wheel.y, wheel.z, int(np.argmax(wheel.z)))[1]
    return replace(wheel, z=wheel.z - (tip - flange_height(wheel.y, wheel.z)))


def _curve(right: Profile, left: Profile, rail: Profile) -> tuple[FloatArray, FloatArray]:
    """Radius difference over as much of the range of shifts as the profiles allow."""
    for count in range(round(_REACH / _STEP), 0, -2):
        shift = _STEP * np.arange(-count, count + 1, dtype=np.float64)
        try:
            return shift, rolling_radius_difference(right, left, rail, shift)
        except ProfileError:
            continue
    return np.empty(0), np.empty(0)
