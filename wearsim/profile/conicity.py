"""Wheels on rails: rolling radius difference, equivalent conicity, flange clearance."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from wearsim.errors import ProfileError
from wearsim.profile.measures import EN_15313, MeasuringRule, flange_height
from wearsim.profile.shape import FloatArray, Profile, extremum, spline_through
from wearsim.quantities import QUANTITIES

_GRID = 0.05e-3  # lateral step of the contact search and of the shifts [m]
# steps near which the smallest gap is evaluated in detail
_CLOSE = np.linspace(-1.0, 1.0, 41)
# Change of the radius difference within a step, beyond its trend, that counts as a jump
# [m].
_JUMP = 2e-6
# Search range for the centre of the wheelset's motion about the track centre [m].
_CENTRE_RANGE = 4e-3
# Number of shifts that are evaluated together, so that their gaps fit the processor's
# cache.
_BATCH = 64
_PHASES = 400  # midpoints of the integral over half a wavelength
_WIDEST = 30e-3  # largest shift at which climbing is searched [m]

# contact angle above which a wheel climbs its flange
_CLIMBING_ANGLE = math.radians(60.0)


def _facing(profile: Profile) -> tuple[FloatArray, FloatArray]:
    """Part of a profile that can touch from above or below, as z over rising y [m].

    It extends from the extreme point (flange tip, rail top) outwards. Parts behind an
    overhang and the back of the flange are omitted.
    """
    y, z = profile.y, profile.z
    top = int(np.argmax(z)) if profile.kind == "wheel" else int(np.argmin(z))
    out_y, out_z = _beyond(y[top:], z[top:])
    if profile.kind == "wheel":
        return out_y, out_z
    in_y, in_z = _beyond(-y[top::-1], z[top::-1])
    return np.concatenate((-in_y[:0:-1], out_y)), np.concatenate((in_z[:0:-1], out_z))


def _beyond(y: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the points that lie further out than all before them."""
    reach = np.maximum.accumulate(y)
    keep = np.concatenate(([True], y[1:] > reach[:-1] + 1e-9))
    return y[keep], z[keep]


@lru_cache(maxsize=4)  # several wheel profiles wear on the same rails
def _rail_heights(
    of_y: bytes, of_z: bytes
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Grid along a rail, heights on it, and heights close to each grid point."""
    rail_y, rail_z = _facing(
        Profile("", "rail", np.frombuffer(of_y), np.frombuffer(of_z))
    )
    grid, spline = (
        np.arange(rail_y[0], rail_y[-1], _GRID),
        spline_through(rail_y, rail_z),
    )
    return grid, spline(grid), spline(grid[:, None] + _GRID * _CLOSE)


def _touching_heights(
    wheel: Profile, rail: Profile
) -> Callable[[FloatArray], FloatArray]:
    """Wheel height z [m] at the smallest gap to a right rail, over shifts (n,) [m].

    It is NaN beyond the profiles.
    """
    grid, rail_height, rail_close = _rail_heights(rail.y.tobytes(), rail.z.tobytes())
    wheel_y, wheel_z = _facing(wheel)
    wheel_height = spline_through(wheel_y, wheel_z)

    def height(place: FloatArray) -> FloatArray:
        inside = (place >= wheel_y[0]) & (place <= wheel_y[-1])
        return np.where(inside, wheel_height(place), -np.inf)

    # All shifts share one evaluation of the wheel at whole steps; between them it
    # deviates from the chord by `off`.
    first, last = (
        math.floor((end - grid[0]) / _GRID) for end in (wheel_y[0], wheel_y[-1])
    )
    table = np.pad(
        height(grid[0] + _GRID * np.arange(first, last + 2)),
        len(grid),
        constant_values=-np.inf,
    )
    windows = sliding_window_view(table, len(grid))
    off = 0.125 * _GRID**2 * float(np.abs(wheel_height(wheel_y, 2)).max()) + 1e-12

    def gaps(step: FloatArray) -> FloatArray:
        """Gap over the grid (n, k) at shifts of whole steps.

        It is infinite where there is no wheel.
        """
        row = np.minimum(
            np.maximum(len(grid) - first - step.astype(np.int64), 0), len(windows) - 1
        )
        gap: FloatArray = windows[row]
        return np.subtract(
            rail_height, gap, out=gap
        )  # reuse: a second array of this size would need new memory

    @lru_cache(maxsize=1)  # bisection of the same jumps with ever closer shifts
    def candidates(of_cells: bytes) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Grid positions that may have the smallest gap between whole steps.

        The second value is the end of the positions of each cell.
        """
        cell = np.frombuffer(of_cells)
        gap_at_start, gap_at_end = gaps(cell), gaps(cell + 1.0)
        most = (
            np.min(np.maximum(gap_at_start, gap_at_end), axis=1, keepdims=True)
            + 2.0 * off
        )
        row, among = np.nonzero(
            np.minimum(gap_at_start, gap_at_end, out=gap_at_start) <= most
        )
        return among, np.searchsorted(row, np.arange(len(cell) + 1))

    def nearest(shift: FloatArray) -> NDArray[np.intp]:
        """Grid position of the smallest gap at each shift."""
        steps = shift / _GRID
        whole = np.round(steps)
        if np.all(np.abs(steps - whole) < 1e-8):
            parts = [
                np.argmin(gaps(whole[i : i + _BATCH]), axis=1)
                for i in range(0, len(shift), _BATCH)
            ]
            return np.concatenate(parts)
        cell, of = np.unique(np.floor(steps), return_inverse=True)
        among, ends = candidates(cell.tobytes())
        count = np.diff(ends)[of]
        first = np.cumsum(count) - count
        of_shift = np.repeat(np.arange(len(shift)), count)
        place = among[np.arange(len(of_shift)) + (ends[of] - first)[of_shift]]
        gap = rail_height[place] - height(grid[place] - shift[of_shift])
        (least,) = np.nonzero(gap == np.minimum.reduceat(gap, first)[of_shift])
        return place[least[np.searchsorted(of_shift[least], np.arange(len(shift)))]]

    def heights(shift: FloatArray) -> FloatArray:
        result = np.full(len(shift), np.nan)
        least = nearest(shift)
        low, high = (grid[(least + side) % len(grid)] - shift for side in (-1, 1))
        good = (
            (least > 0)
            & (least < len(grid) - 1)
            & (low >= wheel_y[0])
            & (high <= wheel_y[-1])
        )
        # Edges and jumps of curvature attract the contact; a parabola over whole steps
        # would miss them.
        near = grid[least[good], None] + _GRID * _CLOSE
        close = rail_close[least[good]] - wheel_height(near - shift[good, None])
        result[good] = wheel_height(_least(near, close) - shift[good])
        return result

    return heights


def _least(at: FloatArray, value: FloatArray) -> FloatArray:
    """Position of the minimum in each row (n, k) of equidistant values.

    It is refined by a parabola.
    """
    rows = np.arange(len(value))
    k = np.clip(np.argmin(value, axis=1), 1, value.shape[1] - 2)
    left, middle, right = value[rows, k - 1], value[rows, k], value[rows, k + 1]
    bend = left - 2.0 * middle + right
    offset = np.zeros_like(bend)
    np.divide(0.5 * (left - right), bend, out=offset, where=bend > 0.0)
    step = at[:, 1] - at[:, 0]
    place: FloatArray = at[rows, k] + step * np.clip(offset, -1.0, 1.0)
    return place


def _with_jumps(
    shift: FloatArray, difference: FloatArray, fine: Callable[[FloatArray], FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Insert shifts around each jump of the radius difference, 0.1 um apart."""
    # A jump smeared over a step of 0.05 mm would change the conicity just behind it by
    # a half.
    change = np.abs(np.diff(difference))
    trend = np.maximum(
        np.concatenate((change[:1], change[:-1])),
        np.concatenate((change[1:], change[-1:])),
    )
    steps = np.flatnonzero(change > 3.0 * trend + _JUMP)
    if len(steps) == 0:
        return shift, difference
    jump = np.arange(len(steps))
    at, value = (
        np.stack((column[steps], column[steps + 1]), axis=1)
        for column in (shift, difference)
    )
    for _ in range(3):  # at all positions, three halvings at a time
        for _ in range(3):
            halves = np.repeat(at, 2, axis=1)[:, :-1]
            halves[:, 1::2] = 0.5 * (at[:, :-1] + at[:, 1:])
            at = halves
        value = np.column_stack(
            (value[:, 0], fine(at[:, 1:-1].ravel()).reshape(-1, 7), value[:, 1])
        )
        low = np.zeros_like(jump)
        for half in (4, 2, 1):
            lower_change, upper_change = (
                np.abs(value[jump, low + half] - value[jump, low + k])
                for k in (0, 2 * half)
            )
            low += half * ~(lower_change > upper_change)
        at, value = (
            np.stack((column[jump, low], column[jump, low + 1]), axis=1)
            for column in (at, value)
        )
    (low, high), (low_difference, high_difference) = at.T, value.T
    all_shift = np.concatenate((shift, low, high))
    order = np.argsort(all_shift, kind="stable")
    order = order[np.concatenate(([True], np.diff(all_shift[order]) > 0.0))]
    return all_shift[order], np.concatenate(
        (difference, low_difference, high_difference)
    )[order]


def rolling_radius_difference(
    wheel_right: Profile, wheel_left: Profile, rail: Profile
) -> Callable[[FloatArray], FloatArray]:
    """Compute the rolling radius difference of both wheels over the lateral shift [m].

    Parameters
    ----------
    wheel_right, wheel_left : Profile
        Both in the axes of a right wheel; equal radius at z = 0.
    rail : Profile
        Placed in the track (its half_span is that of the wheelset), both sides alike.

    Returns
    -------
    function
        Of shifts (n,), positive to the right [m]: rolling radius of the right minus
        that of the left wheel (n,) [m], NaN where a contact would lie beyond the end of
        its own or the rail's profile.

    Notes
    -----
    Rigid bodies, one contact per wheel at the smallest vertical gap, roll of the
    wheelset neglected, as [1]_ prescribes. The gap is searched in steps of 0.05 mm and
    refined by a parabola.

    References
    ----------
    .. [1] EN 15302, Railway applications: method for determining the equivalent
           conicity.
    """
    at_right = _touching_heights(wheel_right, rail)
    if not (
        np.array_equal(wheel_right.y, wheel_left.y)
        and np.array_equal(wheel_right.z, wheel_left.z)
    ):
        at_left = _touching_heights(wheel_left, rail)
        return lambda shift: at_right(shift) - at_left(-shift)

    def alike(shift: FloatArray) -> FloatArray:
        both = at_right(np.concatenate((shift, -shift)))
        return both[: len(shift)] - both[len(shift) :]

    return alike


def equivalent_conicity(
    wheel_right: Profile, wheel_left: Profile, rail: Profile, *, amplitude: float = 3e-3
) -> float | None:
    r"""Equivalent conicity after EN 15302 by integration of the wavelength.

    Parameters
    ----------
    wheel_right, wheel_left, rail : Profile
        As of `rolling_radius_difference`.
    amplitude : float
        Half of the lateral way between the turning points [m].

    Returns
    -------
    float or None
        :math:`\tan\gamma_e` [-]; None where it is undefined: the rolling radius
        difference does not lead the wheelset to and fro over this amplitude (as on
        cylindrical or deeply hollow treads).

    Raises
    ------
    ProfileError
        The contact leaves the profiles within the amplitude.

    Notes
    -----
    With :math:`S(u)` the integral of the radius difference, the turning points have
    equal S, and the yaw angle is :math:`\psi = \sqrt{(S_\mathrm{max} - S(u)) / (e
    r_0)}`. The wavelength :math:`L = 2 \int du/\psi` is integrated with :math:`u = c +
    A \sin\theta`, which leaves no singularity, and
    :math:`\tan\gamma_e = 4 \pi^2 e r_0 / L^2` does not depend on the half distance e of
    the running circles nor on the radius :math:`r_0` [1]_. The radius difference is
    linear between shifts of 0.05 mm. The centre c is searched within 4 mm of the track
    centre.

    References
    ----------
    .. [1] EN 15302, Railway applications: method for determining the equivalent
       conicity; the same definition in UIC 519.
    """
    if fault := QUANTITIES["amplitude"].fault(amplitude):
        raise ProfileError(fault)
    reach = math.ceil((amplitude + _CENTRE_RANGE) / _GRID)
    shift: FloatArray = _GRID * np.arange(-reach, reach + 1, dtype=np.float64)
    difference_at = rolling_radius_difference(wheel_right, wheel_left, rail)
    difference = difference_at(shift)
    lost = np.isnan(difference)
    first = int(np.max(np.flatnonzero(lost[:reach]), initial=-1)) + 1
    last = reach + int(np.min(np.flatnonzero(lost[reach:]), initial=reach + 1)) - 1
    if last <= reach or shift[last] - shift[first] < 2.0 * amplitude:
        raise ProfileError(
            f"{wheel_right.name} on {rail.name}: no contact within the profiles over "
            f"an amplitude of {1e3 * amplitude:g} mm; check gauge, back-to-back "
            "distance and the ends of the profiles"
        )
    shift, difference = _with_jumps(
        shift[first : last + 1], difference[first : last + 1], difference_at
    )
    step = np.diff(shift)
    potential = np.concatenate(
        ([0.0], np.cumsum(0.5 * step * (difference[1:] + difference[:-1])))
    )

    def at(u: FloatArray) -> FloatArray:
        """Integrate the piecewise linear difference exactly up to u."""
        k = np.searchsorted(shift[1:-1], u, side="right")
        t = u - shift[k]
        return potential[k] + t * (
            difference[k] + 0.5 * t / step[k] * (difference[k + 1] - difference[k])
        )

    centre = _centre(
        at, float(shift[0]) + amplitude, float(shift[-1]) - amplitude, amplitude
    )
    if centre is None:
        return None
    theta = (np.arange(_PHASES) + 0.5) * math.pi / _PHASES - 0.5 * math.pi
    highest = 0.5 * float(
        np.sum(at(np.array([centre - amplitude, centre + amplitude])))
    )
    depth = highest - at(centre + amplitude * np.sin(theta))
    if np.any(
        depth <= 1e-15 * amplitude
    ):  # rounding of the sums: a radius difference of 1e-15 m
        return None
    length = (
        2.0
        * math.pi
        / _PHASES
        * amplitude
        * float(np.sum(np.cos(theta) / np.sqrt(depth)))
    )
    # L = length * sqrt(e r0), so that e r0 drops out
    return 4.0 * math.pi**2 / length**2


def _centre(
    at: Callable[[FloatArray], FloatArray], low: float, high: float, amplitude: float
) -> float | None:
    """Centre of the motion nearest to the track centre.

    At its turning points the potential is equal.
    """

    def excess(c: FloatArray) -> FloatArray:
        return at(c + amplitude) - at(c - amplitude)

    grid = np.linspace(low, high, max(3, round((high - low) / _GRID) | 1))
    value = excess(grid)
    rising = np.flatnonzero((value[:-1] <= 0.0) & (value[1:] > 0.0))
    if len(rising) == 0:
        return None
    k = rising[np.argmin(np.abs(grid[rising] + grid[rising + 1]))]
    a, b = float(grid[k]), float(grid[k + 1])
    for _ in range(12):  # each pass cuts the bracket into 16 parts: down to 1e-19 m
        inner = np.linspace(a, b, 17)
        above = int(np.argmax(excess(inner)[1:] > 0.0)) + 1
        a, b = float(inner[above - 1]), float(inner[above])
    return 0.5 * (a + b)


def flange_clearance(wheel: Profile, rail: Profile) -> float | None:
    r"""Lateral shift at which a rigid wheel begins to climb its flange [m].

    The rail is placed in the track and thus includes gauge and back-to-back distance.
    The shift is 0 for a wheel that climbs at once, inf for one that does not climb
    within 30 mm, and None for a wheel whose flange is nowhere as steep as 60 degrees.

    Notes
    -----
    Rigid profiles without yaw and roll are in contact where the wheel must be lifted
    most, :math:`h(u) = \max_y (z_w(y - u) - z_r(y))`, and :math:`dh/du` is the tangent
    of the contact angle there. The clearance is the first shift at which this angle is
    60 degrees: less than the flank of any flange of EN 13715 (70 degrees), and more
    than the flange root has before the flank takes over. The value hardly depends on
    the choice: S1002 on 60E1 1:40 at gauge 1435 and back-to-back distance 1360 mm
    passes from 30 to 69 degrees between shifts of 6.55 and 6.65 mm. This definition is
    wearsim's own.
    """
    (wheel_y, wheel_z), (rail_y, rail_z) = _facing(wheel), _facing(rail)
    steep = math.tan(_CLIMBING_ANGLE)
    flank = wheel_y < 0.0
    if not np.any(np.diff(wheel_z[flank]) <= -steep * np.diff(wheel_y[flank])):
        return None
    grid = np.arange(rail_y[0], rail_y[-1], _GRID)
    counter = spline_through(rail_y, rail_z)(grid)
    height = spline_through(wheel_y, wheel_z)
    shift = _GRID * np.arange(round(_WIDEST / _GRID) + 1)
    at = grid - shift[:, None]
    inside = (at >= wheel_y[0]) & (at <= wheel_y[-1])
    lift = np.where(
        inside, height(np.clip(at, wheel_y[0], wheel_y[-1])) - counter, -np.inf
    ).max(axis=1)
    climbing = np.flatnonzero(np.diff(lift) >= steep * _GRID)
    return float(shift[climbing[0]]) if len(climbing) else math.inf


AMPLITUDES = (1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3)
"""Amplitudes of the conicity and shifts of the listed radius difference [m]."""

JUDGED_AMPLITUDE = 3e-3
"""Amplitude of the conicity to which limits refer [m]."""

_DRAWN = 0.1e-3 * np.arange(
    -80, 81, dtype=np.float64
)  # shifts of the curve that is drawn [m]


class RadiusDifference(NamedTuple):
    """Rolling radius difference at a shift [m].

    None if a contact lies beyond the end of a profile.
    """

    shift: float
    value: float | None


class Conicity(NamedTuple):
    """Equivalent conicity [-] at an amplitude [m], or why there is none."""

    amplitude: float
    value: float | None
    reason: str


@dataclass(frozen=True)
class Running:
    """Running behaviour of a pair of wheels on a pair of rails."""

    wheel: str
    left: str
    rail: str
    differ: bool  # whether the wheels do
    # lateral shift (n,), as far as both stay on their profiles, and right minus left
    # rolling radius (n,) [m]
    shift: FloatArray = field(repr=False)
    difference: FloatArray = field(repr=False)
    # at the amplitudes, to either side if they differ
    rolling_radius_difference: tuple[RadiusDifference, ...]
    equivalent_conicity: tuple[Conicity, ...]
    track: str  # rail, inclination, gauge and back-to-back distance in words

    @property
    def judged_conicity(self) -> float | None:
        """Equivalent conicity at `JUDGED_AMPLITUDE` [-]."""
        return next(
            (
                conicity.value
                for conicity in self.equivalent_conicity
                if conicity[0] == JUDGED_AMPLITUDE
            ),
            None,
        )


def running(
    right: Profile,
    left: Profile | None,
    rail: Profile,
    track: str = "",
    diameter_difference: float = 0.0,
    amplitudes: tuple[float, ...] = AMPLITUDES,
    rule: MeasuringRule = EN_15313,
) -> Running:
    """Compute rolling radius difference and equivalent conicity on a placed rail.

    Without a left wheel both are equal. Unequal wheels have equal radii at their
    running circles, apart from the stated right minus left difference of diameters
    there [m]. `amplitudes` [m] are those of the conicity, and the shifts at which the
    radius difference is listed. `track` describes the track in words, `rule` has the
    place of the running circle.
    """
    differ = left is not None or diameter_difference != 0.0
    left_wheel = right if left is None else left
    if differ:
        left_wheel, right = (
            _from_running_circle(wheel, rule) for wheel in (left_wheel, right)
        )
        left_wheel = replace(left_wheel, z=left_wheel.z - 0.5 * diameter_difference)
    shifts = sorted(
        sign * size
        for sign in ((-1.0, 1.0) if differ else (1.0,))
        for size in amplitudes
    )
    radius_difference = rolling_radius_difference(right, left_wheel, rail)
    differences = zip(shifts, radius_difference(np.array(shifts)), strict=True)
    drawn = radius_difference(_DRAWN)
    inside = np.abs(_DRAWN) < np.min(np.abs(_DRAWN)[np.isnan(drawn)], initial=np.inf)

    def conicity(amplitude: float) -> Conicity:
        try:
            value = equivalent_conicity(right, left_wheel, rail, amplitude=amplitude)
        except ProfileError:
            return Conicity(
                amplitude, None, "a contact lies beyond the end of a profile"
            )
        undefined = "undefined: the wheelset is not led to and fro over this amplitude"
        return Conicity(amplitude, value, undefined if value is None else "")

    return Running(
        right.name,
        left_wheel.name,
        rail.name,
        differ,
        _DRAWN[inside],
        drawn[inside],
        tuple(
            RadiusDifference(at, None if np.isnan(difference) else float(difference))
            for at, difference in differences
        ),
        tuple(map(conicity, amplitudes)),
        track,
    )


def _from_running_circle(wheel: Profile, rule: MeasuringRule) -> Profile:
    """Wheel with z counted from its own running circle."""
    tip = extremum(wheel.y, wheel.z, int(np.argmax(wheel.z)))[1]
    return replace(wheel, z=wheel.z - (tip - flange_height(wheel.y, wheel.z, rule)))
