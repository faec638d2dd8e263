"""Leading and trailing ends of strips under a yawed wheel, each from the three-dimensional gap."""

from __future__ import annotations

import numpy as np

from wearsim.contact.gap_surface import place_in, smooth_at
from wearsim.contact.kernel import kernel
from wearsim.contact.patch import FloatArray

_STEPS = 12  # of Newton's method, at most
_DONE = 1e-4  # a last step, over the length: what it leaves is the half of its square, 5e-9
_STILL = 1e-8  # m, likewise: its square over a radius of 10 mm is 1e-14 m


@kernel
def on_the_wheel(
    y: float,
    z: float,
    gap: float,
    along: float,
    pose: FloatArray,
    rings: tuple[FloatArray, FloatArray, FloatArray],
    point: FloatArray,
) -> None:
    """Point of the wheel nearest to a place of the counterface, and the directions of its section there.

    `pose` is (sin yaw, cos yaw, sin roll, cos roll, shift, half span, nominal radius, kappa). Fills `point`
    (12,): components along the wheelset's axes (forward, axle, down) of the point, of the rolling direction
    and of the normal to the roller's top, the curvature of the roller's section, -1 if no wheel is there,
    and the ring.
    """
    sy, cy, sr, cr = pose[0], pose[1], pose[2], pose[3]
    shift, half_span, nominal_radius, kappa = pose[4], pose[5], pose[6], pose[7]
    sine = kappa * along / (1.0 - kappa * (z - gap))
    cosine = np.sqrt(1.0 - sine * sine)
    point[3], point[4], point[5] = cy * cosine, -sy * cr * cosine + sr * sine, sy * sr * cosine + cr * sine
    point[6], point[7], point[8] = -cy * sine, sy * cr * sine + sr * cosine, -sy * sr * sine + cr * cosine
    point[9] = kappa / (1.0 - kappa * z)
    # From the counterface, straight down on a rail, along the radius on a roller.
    x0 = along * (1.0 - kappa * z) / (1.0 - kappa * (z - gap))
    y0 = y - shift + half_span
    z0 = z * cosine + kappa * x0 * x0 / ((1.0 - kappa * z) ** 2 * (1.0 + cosine)) + nominal_radius
    f = cy * x0 + sy * y0
    a = -sy * cr * x0 + cy * cr * y0 + sr * z0 - half_span
    d = sy * sr * x0 - cy * sr * y0 + cr * z0
    n = -gap
    ring = int(point[11])
    point[10] = -1.0
    for _ in range(_STEPS):
        ring = place_in(rings[0], a + n * point[7], ring)
        if ring < 0:
            return
        radius, slope = smooth_at(rings[0], rings[1], rings[2], ring, a + n * point[7])
        forward, down = f + n * point[6], d + n * point[8]
        length = np.sqrt(forward * forward + down * down)
        move = (radius - length) / ((forward * point[6] + down * point[8]) / length - slope * point[7])
        n += move
        if abs(move) < _STILL:
            point[10] = 1.0
            break
    point[0], point[1], point[2] = f + n * point[6], a + n * point[7], d + n * point[8]
    point[11] = ring


@kernel
def end_of_strip(
    depth: float,
    circle: float,
    factor: float,
    point: FloatArray,
    rings: tuple[FloatArray, FloatArray, FloatArray],
) -> float:
    """Where the section through `point` leaves the counterface when the wheel is pushed in by `depth`.

    As a multiple of `circle`, the end for circles, whose sign tells which end. Searched from the multiple
    `factor` and, if that leads nowhere, from 1; 1 if there is no end up to five times as far.
    """
    start = factor * circle
    x = start
    ring = int(point[11])
    for _ in range(2 * _STEPS):
        root = np.sqrt(1.0 - (point[9] * x) ** 2)
        n = point[9] * x * x / (1.0 + root) - depth
        tilt = point[9] * x / root
        f = point[0] + x * point[3] + n * point[6]
        a = point[1] + x * point[4] + n * point[7]
        d = point[2] + x * point[5] + n * point[8]
        ring = place_in(rings[0], a, ring)
        opening, move = 0.0, 0.0
        if ring >= 0:
            radius, slope = smooth_at(rings[0], rings[1], rings[2], ring, a)
            length = np.sqrt(f * f + d * d)
            opening = (f * (point[3] + tilt * point[6]) + d * (point[5] + tilt * point[8])) / length
            opening -= slope * (point[4] + tilt * point[7])
            move = (radius - length) / opening
        if opening * circle <= 0.0 or (x + move) / circle < 0.2 or (x + move) / circle > 5.0:
            if start == circle:
                return 1.0
            x = start = circle
            ring = int(point[11])
            continue
        x += move
        if abs(move) < _DONE * abs(x):
            break
    return x / circle
