r"""Where the axles of a bogie run in a curve: quasi-static balance of two wheelsets and their frame.

With lateral positions y, yaw p of the leading (1) and the trailing wheelset (2) against the local track,
those of the frame :math:`y_b, p_b`, half the wheelbase a and the curvature k, the springs are extended by

.. math::
    d_1 &= y_b + a p_b - k a^2/2 - y_1, & t_1 &= p_b - k a - p_1 \\
    d_2 &= y_b - a p_b - k a^2/2 - y_2, & t_2 &= p_b + k a - p_2

and with the unbalanced acceleration A the wheelsets and the frame balance

.. math::
    H_{c,i} + k_y d_i + m_w A &= 0, \qquad M_{c,i} + k_p t_i = 0 \\
    -k_y (d_1 + d_2) + (m_b + m_c/2) A &= 0 \\
    -a k_y (d_1 - d_2) - k_p (t_1 + t_2) + K_s (\mp k c - p_b) &= 0

where :math:`H_c, M_c` are the resultants of the contact (`wearsim.operation.resultants`). The frame is
eliminated; what is left is solved by implicit steps of a transient whose length grows, Newton's method in the
end.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.patch import FloatArray, IntArray

if TYPE_CHECKING:
    from wearsim.operation.states import Search

GRAVITY = 9.81  # [m/s2]

_DAMPING = np.array(
    [16e6, 9e6, 16e6, 9e6]
)  # creep of wheelsets, 2 f22 [N] and 2 f11 l2 [N m2]: sets the pace
_STEPS = np.array([2e-6, 2e-6])  # of differences [m, rad]
_LONGEST = np.array([0.5e-3, 1e-3, 0.5e-3, 1e-3])  # [m, rad]
_SCALE = 1e4  # of residuals [N, N m]
_MOST, _SOON = 80, 20  # solutions of all contacts until a balance is given up
_KEPT = 0.6  # of the residual before, up to which the slope is kept
_SMALL = 1e-2  # of the scale: from here on Newton's steps in full
_ENDLESS = 1e9
_BACK = 0.25  # product of steps in turn, over the longest ones, from which they go back and forth


@dataclass(frozen=True)
class Vehicle:
    """A vehicle of two bogies of two axles; stiffness is that of both springs of an axle."""

    half_wheelbase: float  # of a bogie [m]
    half_pivot_distance: float  # of both bogies [m]
    wheelset_mass: float  # [kg]
    bogie_mass: float
    body_mass: float
    bogie_height: float  # of the centre of gravity above the rails [m]
    body_height: float
    lateral_stiffness: float  # of the primary suspension, per axle [N/m]
    yaw_stiffness: float  # of the primary suspension, per axle [N m/rad]
    secondary_yaw_stiffness: float = 0.0  # of a bogie against the body [N m/rad]
    roll_coefficient: float = 0.0
    axle_yaw_offset: float = 0.0  # of the leading axle in its bogie, -1 times that of the trailing one [rad]

    @property
    def axle_load(self) -> float:
        """Vertical load of each axle on straight track [N]."""
        return GRAVITY * (self.wheelset_mass + self.bogie_mass / 2.0 + self.body_mass / 4.0)

    def box_moment(self, acceleration: FloatArray, wheel_radius: float) -> FloatArray:
        """Moment (n,) of what is above an axle about the longitudinal axis at axle height [N m]."""
        bogie = self.bogie_mass * (self.bogie_height - wheel_radius)
        body = self.body_mass / 2.0 * (self.body_height - wheel_radius) * (1.0 + self.roll_coefficient)
        return acceleration * (bogie + body) / 2.0


@dataclass(frozen=True)
class Bogies:
    """Pairs of operating points that are the axles of a bogie, `m` of them."""

    vehicle: Vehicle
    leading: IntArray  # (m,) operating points
    trailing: IntArray
    acceleration: FloatArray  # (m,) unbalanced, to the right, of forces on the vehicle [m/s2]
    in_front: FloatArray  # (m,) 1 for the leading bogie of the vehicle, -1 for the trailing one

    @property
    def points(self) -> IntArray:
        """Operating points (2 m,) of all axles, leading ones first."""
        return np.concatenate([self.leading, self.trailing])

    def at(self, index: IntArray) -> Bogies:
        """Return the bogies at `index`."""
        ends = self.leading[index], self.trailing[index]
        return Bogies(self.vehicle, *ends, self.acceleration[index], self.in_front[index])


def suspension(
    vehicle: Vehicle, state: FloatArray, curvature: FloatArray, acceleration: FloatArray, in_front: FloatArray
) -> FloatArray:
    """Give forces and moments of springs and inertia on both wheelsets, the frame in balance.

    Parameters
    ----------
    vehicle : Vehicle
        With its stiffness.
    state : (m, 4) array
        Lateral position and yaw of the leading, then of the trailing wheelset [m, rad].
    curvature, acceleration, in_front : (m,) array
        Of the track, positive to the right [1/m]; unbalanced, to the right [m/s2]; see `Bogies`.

    Returns
    -------
    (m, 4) array
        Lateral force and yaw moment on the leading, then on the trailing wheelset [N, N m].
    """
    y1, p1, y2, p2 = state.T
    a, ky, kp, ks = (
        vehicle.half_wheelbase, vehicle.lateral_stiffness, vehicle.yaw_stiffness,
        vehicle.secondary_yaw_stiffness,
    )  # fmt: skip
    sprung = (vehicle.bogie_mass + vehicle.body_mass / 2.0) * acceleration
    p1, p2 = p1 - vehicle.axle_yaw_offset, p2 + vehicle.axle_yaw_offset  # as the springs see them
    frame_y = 0.5 * (sprung / ky + curvature * a * a + y1 + y2)
    turned = a * ky * (y1 - y2) + kp * (p1 + p2) - ks * in_front * curvature * vehicle.half_pivot_distance
    frame_yaw = turned / (2.0 * a * a * ky + 2.0 * kp + ks)
    middle = frame_y - curvature * a * a / 2.0
    own = vehicle.wheelset_mass * acceleration
    return np.stack(
        [
            ky * (middle + a * frame_yaw - y1) + own,
            kp * (frame_yaw - curvature * a - p1),
            ky * (middle - a * frame_yaw - y2) + own,
            kp * (frame_yaw + curvature * a - p2),
        ],
        axis=1,
    )


def curved(search: Search, bogies: Bogies, warm: bool, tolerance: float, soon: bool = False) -> IntArray:
    """Find the balance of all bogies, in place of shift, yaw and loads of a search.

    Parameters
    ----------
    search : Search
        Over all operating points.
    bogies : Bogies
        Its points are rows of the search.
    warm : bool
        Whether the search starts where the axles ran before.
    tolerance : float
        Of forces and moments (at 1 m), over the axle load.
    soon : bool
        Whether to give up soon.

    Returns
    -------
    IntArray
        Bogies without balance.
    """
    vehicle, count = bogies.vehicle, bogies.leading.size
    curvature = search.conditions.track_curvature[bogies.leading]
    axles = np.stack([bogies.leading, bogies.trailing], axis=1)  # (m, 2)
    if not warm:
        lean = np.minimum(np.abs(curvature) * search.wheelset.radius * search.wheelset.half_span / 0.2, 5e-3)
        search.shift[axles] = -np.sign(curvature)[:, None] * lean[:, None]
        search.yaw[axles] = 0.0
    weight, springs = vehicle.axle_load, spring_slope(vehicle)
    pace, growth = np.full(count, _ENDLESS if warm else 1.0), np.full(count, 4.0)
    last, before = np.full(count, np.inf), np.full((count, 4), np.nan)
    slope, known = np.zeros((count, 4, 4)), np.zeros(count, dtype=bool)
    taken, turned = np.zeros((count, 4)), np.zeros(count, dtype=bool)  # the steps before
    rest = np.arange(count)
    for _ in range(_SOON if soon else _MOST):
        rows = axles[rest].ravel()
        state = np.stack([search.shift[rows], search.yaw[rows]], axis=1).reshape(-1, 4)
        load = search.load[rows]
        forces, solved = search.solve(rows, search.shift[rows], load)
        found = np.stack([forces.force, forces.moment], axis=1).reshape(-1, 4)
        whole = np.asarray(solved.reshape(-1, 2).all(axis=1))
        own = (curvature[rest], bogies.acceleration[rest], bogies.in_front[rest])
        residual = found + suspension(vehicle, state, *own)
        balanced = search.loads(rows, forces, load)
        shifted = np.abs(balanced - load).max(axis=1).reshape(-1, 2).max(axis=1)
        size = np.abs(residual).max(axis=1)
        done = whole & (size <= tolerance * weight) & (shifted <= tolerance * weight)
        norm: FloatArray = size / _SCALE
        # a slope that still brings the balance nearer is kept: it costs two more contacts of each axle
        asked = np.flatnonzero(whole & ~done & ~(known[rest] & (norm <= _KEPT * last[rest])))
        if asked.size:
            slope[rest[asked]], known[rest[asked]] = _slope(search, axles[rest[asked]], found[asked])
        whole &= known[rest] | done
        worse = np.asarray((norm > last[rest]) | turned[rest])
        paced = np.clip(pace[rest] * np.where(worse, 0.25, growth[rest]), 0.02, _ENDLESS)
        pace[rest] = np.where(norm < _SMALL, _ENDLESS, paced)
        growth[rest] = np.where(worse, np.maximum(1.3, 0.7 * growth[rest]), growth[rest])
        last[rest] = norm
        implicit = -(slope[rest] + springs)
        implicit[:, range(4), range(4)] += _DAMPING / pace[rest][:, None]
        step = np.linalg.solve(implicit, residual[:, :, None])[:, :, 0]
        step /= np.maximum(np.abs(step / _LONGEST).max(axis=1), 1.0)[:, None]
        # without contact half way back to where there was one
        back = np.where(np.isfinite(before[rest]), 0.5 * (before[rest] - state), -0.5 * state)
        step = np.where(whole[:, None], step, back)
        pace[rest] = np.where(whole, pace[rest], 0.25 * pace[rest])
        before[rest] = np.where(whole[:, None], state, before[rest])
        step[done] = 0.0
        # back and forth by long steps, as at the kink of a second patch: shorter ones
        scaled = step / _LONGEST
        turned[rest] = ((scaled * taken[rest]).sum(axis=1) < -_BACK) & whole
        taken[rest] = scaled
        search.shift[rows], search.yaw[rows] = (state + step).reshape(-1, 2).T
        on_way = np.repeat(whole & ~done, 2)[:, None]
        search.load[rows] = np.where(on_way, np.maximum(balanced, 0.02 * weight), load)
        rest = rest[~done]
        if not rest.size:
            break
    return rest


def spring_slope(vehicle: Vehicle) -> FloatArray:
    """Differentiate the forces of `suspension`, which are linear, by the state (4, 4)."""
    step = 1e-3
    state = np.concatenate([step * np.eye(4), np.zeros((1, 4))])
    force = suspension(replace(vehicle, axle_yaw_offset=0.0), state, *[np.zeros(5)] * 3)
    return np.asarray((force[:4] - force[4]).T / step)


def _slope(search: Search, axles: IntArray, found: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Differentiate force and moment of both axles (m, 2) by their shift and yaw (m, 4, 4).

    `found` (m, 4) are those where the axles are; False where there is no contact near by.
    """
    rows, count = axles.ravel(), len(axles)
    moved = np.diag(_STEPS)
    shift, yaw = (
        (values[rows] + moved[:, j, None]).ravel() for j, values in enumerate((search.shift, search.yaw))
    )
    load = np.tile(search.load[rows], (2, 1))
    forces, solved = search.solve(np.tile(rows, 2), shift.ravel(), load, yaw=yaw.ravel())
    near = np.stack([forces.force, forces.moment], axis=1).reshape(2, -1, 2, 2)
    slope = np.zeros((count, 4, 4))
    for j in (0, 1):
        change = (near[j] - found.reshape(-1, 2, 2)) / _STEPS[j]
        for axle in (0, 1):
            slope[:, 2 * axle : 2 * axle + 2, 2 * axle + j] = change[:, axle]
    return slope, np.asarray(solved.reshape(2, -1, 2).all(axis=(0, 2)))
