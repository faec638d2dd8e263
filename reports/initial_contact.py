"""Initial contact.

Where the right wheel and its rail or roller touch first as rigid bodies.
"""

import numpy as np

from wearsim.contact import equilibrium, geometry
from wearsim.contact.geometry import WheelsetPose
from wearsim.errors import ContactError


def initial_contact(wheelset, counterface, shift, yaw=0.0, free_roll=False):
    """Compute the initial contact of the right wheel.

    Parameters
    ----------
    wheelset, counterface : Wheelset, Counterface
        Both wheels; rails or rollers.
    shift : (n,) array
        Lateral shift, positive to the right [m].
    yaw : float
        [rad].
    free_roll : bool
        Whether the wheelset rests on both wheels; else its roll is 0.

    Returns
    -------
    dict of (n,) array
        `wheel_y`, `counterface_y`, `x` (from the middle of the axle),
        `wheel_radius` [m], `contact_angle`, `roll` [rad].

    Raises
    ------
    ContactError
        If the wheel does not touch, or no roll lets both wheels touch.
    """
    profile = geometry.counterface_profile(counterface.profile)
    wheels = [
        geometry.wheel_surface(wheel, wheelset.radius)
        for wheel in (wheelset.right, wheelset.left)
    ]

    def gap(side, angle):
        sign = -1.0 if side else 1.0
        pose = WheelsetPose(sign * shift, np.full_like(shift, sign * yaw), sign * angle)
        return geometry.gap(
            wheels[side],
            profile,
            pose,
            half_span=wheelset.half_span,
            nominal_radius=wheelset.radius,
            curvature=counterface.curvature,
        )

    angle = np.zeros_like(shift)
    if free_roll:
        angle, exists = equilibrium.resting_roll(
            lambda trial, _: (
                gap(0, trial).gap.min(axis=1),
                gap(1, trial).gap.min(axis=1),
            ),
            angle,
            wheelset.half_span,
        )
        if not exists.all():
            raise ContactError(
                f"shift {1e3 * shift[np.argmin(exists)]:g} mm: no roll lets both "
                "wheels touch"
            )
    right = gap(0, angle)
    lowest = right.gap.argmin(axis=1)
    if (
        right.gap.min() >= geometry.NO_WHEEL
        or lowest.min() == 0
        or lowest.max() == profile.y.size - 1
    ):
        raise ContactError(
            "the wheel touches the edge of a profile or nothing; choose smaller shifts"
        )
    # the vertex of the parabola through three points of the grid
    row = np.arange(shift.size)
    before, here, after = (right.gap[row, lowest + k] for k in (-1, 0, 1))
    bend = before - 2.0 * here + after
    move = np.divide(
        0.5 * (before - after), bend, out=np.zeros_like(bend), where=bend > 0.0
    )
    place = lowest + np.clip(move, -0.5, 0.5)
    grid = np.arange(profile.y.size, dtype=np.float64)
    on_wheel = {
        name: np.array(
            [np.interp(place[k], grid, getattr(right, name)[k]) for k in row]
        )
        for name in ("wheel_y", "x", "wheel_radius")
    }
    return {
        **on_wheel,
        "counterface_y": np.interp(place, grid, profile.y),
        "contact_angle": np.interp(place, grid, profile.angle),
        "roll": angle,
    }
