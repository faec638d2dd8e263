"""Placement of a rail head in the track: inclination, highest point and gauge."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from typing import SupportsFloat

import numpy as np

from wearsim.errors import ProfileError
from wearsim.profile.checks import PARTIAL
from wearsim.profile.shape import FloatArray, Profile, crossing, extremum
from wearsim.quantities import QUANTITIES

INCLINATION = 1.0 / 40.0
"""Default inclination of an upright rail towards the track centre [-]."""
GAUGE = 1.435
"""Default track gauge [m]."""
BACK_TO_BACK = 1.360
"""Default back-to-back distance, between the inner wheel faces [m]."""
RUNNING_CIRCLE = 70e-3
"""Default distance of the running circle from the flange back [m]."""

GAUGE_DEPTH = 14e-3
"""Default depth below the rail top above which the gauge is measured [m].

The gauge is the distance of the innermost points of both heads.
"""

UPRIGHT = 1.0 / 200.0
"""Lean below which a head counts as upright [-].

Rails are laid at 1:40 to 1:20, or upright in switches.
"""

_MOST_LEAN = 0.1  # range of leans searched [-]
_SIDE_DEPTH = 10e-3  # the axis is midway between the sides of a head at this depth [m]
# largest deviation of mirrored halves for which the lean is defined [m]
_MIRRORED = 0.1e-3
_END_STEP, _END_STEPS = 0.05e-3, 20  # of the sides of a body that ends sharply [m]
_NARROWEST = 55e-3  # width of the narrowest heads of running rails [m]
_HEAD_POINTS = 2000  # number of points taken from a longer list


def slope_of(text: str) -> float:
    """Slope of a rail's axis from "1:N", or 0 from "none".

    Raises ValueError with the end of a message.
    """
    if text == "none":
        return 0.0
    ratio = re.fullmatch(r"1\s*:\s*([0-9]+(?:\.[0-9]+)?)", text)
    low, high = QUANTITIES["inclination_ratio"].span
    if not (ratio and low <= float(ratio[1]) <= high):
        raise ValueError(
            f"must be 1:N with N from {low:g} to {high:g}, or none; 60E1 mostly lies "
            "at 1:40"
        )
    return 1.0 / float(ratio[1])


@dataclass(frozen=True)
class Placement:
    """Tilt of a rail [rad] about its origin, followed by a shift [m].

    A positive tilt moves the top towards the track centre.
    """

    tilt: float
    shift_y: float
    shift_z: float

    def apply(self, y: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Tilt and shift points y, z [m] of a right rail."""
        c, s = math.cos(self.tilt), math.sin(self.tilt)
        return y * c + z * s + self.shift_y, -y * s + z * c + self.shift_z


def placement(
    y: FloatArray,
    z: FloatArray,
    inclination: float,
    gauge: float,
    half_span: float,
    gauge_height: float = GAUGE_DEPTH,
) -> Placement:
    """Placement of a right rail head: top at z = 0, gauge point at gauge/2 - half_span.

    Parameters
    ----------
    y, z : (n,) array
        Rail head from the gauge side to the field side, z down [m].
    inclination : float
        Tangent of the tilt towards the track centre, such as 1/40; 0 leaves the head as
        it is [-].
    gauge, half_span : float
        Between the gauge points of both rails; from the track centre to the wheel
        profile's origin [m].
    gauge_height : float
        Depth below the top of the rail at which the gauge is measured: 14 mm after EN
        13848-1, 5/8 in. in North America [m].

    Raises
    ------
    ProfileError
        Inclination, gauge, half span or gauge height is out of its range.

    Notes
    -----
    The gauge point is the innermost point of the inclined head in the band from its
    highest point down to the gauge height, convention of EN 13848-1. Part of a head,
    see `is_partial`, has none and keeps its y: that of the wheel profile, from the
    running circle.
    """
    steepest = 1.0 / QUANTITIES["inclination_ratio"].range.low
    if not (isinstance(inclination, SupportsFloat) and 0.0 <= inclination <= steepest):
        raise ProfileError(
            f"rail inclination = {inclination} must be in 0 .. {steepest:g} (1:40 is "
            "0.025)"
        )
    for name, value in (
        ("gauge", gauge),
        ("half_span", half_span),
        ("gauge_height", gauge_height),
    ):
        if fault := QUANTITIES[name].fault(value):
            raise ProfileError(fault)
    tilt = math.atan(inclination)
    y_tilted, z_tilted = Placement(tilt, 0.0, 0.0).apply(y, z)
    top = int(np.argmin(z_tilted))
    _, z_top = extremum(y_tilted, z_tilted, top)
    if is_partial(y):
        return Placement(tilt, 0.0, -z_top)
    gauge_y = _innermost(y_tilted[: top + 1], z_tilted[: top + 1] - z_top, gauge_height)
    return Placement(tilt, 0.5 * gauge - half_span - gauge_y, -z_top)


def is_partial(y: FloatArray) -> bool:
    """Return True if points of a rail or roller are too narrow for a gauge point.

    Points (n,) are in m.
    """
    return float(np.ptp(y)) < PARTIAL


def narrow_head(y: FloatArray) -> str:
    """Note on a head narrower than that of any running rail, "" for others.

    Points (n,) are in m.
    """
    width = float(np.ptp(y))
    if not PARTIAL <= width < _NARROWEST:
        return ""
    return (
        f"{1e3 * width:.3g} mm wide, narrower than the head of any running rail (60 to "
        "75 mm): of a nose, a blade or part of a head the place in the track is not "
        "that of the file, for its inner side is placed at the gauge"
    )


def _innermost(y: FloatArray, z: FloatArray, gauge_height: float) -> float:
    """Smallest y in the gauge band from the gauge side to the top, where z = 0 [m]."""
    deeper = np.flatnonzero(z >= gauge_height)
    if len(deeper) == 0:
        raise ProfileError(
            f"the gauge side of the rail head reaches {1e3 * z.max():.2f} mm below its "
            f"highest point; the gauge is measured down to {1e3 * gauge_height:g} mm: "
            "measure further down"
        )
    last = int(deeper[-1])
    return min(crossing(y, z, last, gauge_height), float(y[last + 1 :].min()))


def head_lean(y: FloatArray, z: FloatArray) -> float | None:
    """Lean of a rail head y, z (n,) in m: tangent of its tilt to symmetry [-].

    It is positive towards the track centre. None for a head worn or measured so that no
    tilt makes its halves mirror images, and for part of a head.
    """
    if is_partial(y):
        return None
    near = np.flatnonzero(z - float(z.min()) < 2.0 * _SIDE_DEPTH)
    near = near[:: 1 + len(near) // _HEAD_POINTS]
    y, z = y[near], z[near]
    low, high, count = -_MOST_LEAN, _MOST_LEAN, 81
    lean, off = 0.0, math.inf
    for _ in range(4):  # four refinements, down to 1e-6
        tried = np.linspace(low, high, count)
        apart = [
            halves_apart(y, z, float(trial_lean), 0.45, 100) for trial_lean in tried
        ]
        best = int(np.argmin(apart))
        lean, off = float(tried[best]), apart[best]
        step = (high - low) / (count - 1)
        low, high, count = lean - step, lean + step, 21
    return lean if off < _MIRRORED else None


def lean_words(lean: float) -> str:
    """Describe how a head leans [-]."""
    if abs(lean) <= UPRIGHT:
        return "stands upright"
    if lean < 0.0:
        return (
            f"leans 1:{-1.0 / lean:.3g} away from the track centre: is --mirror right?"
        )
    return f"leans 1:{1.0 / lean:.3g} towards the track centre"


def tilt_to_add(lean: float | None, inclination: float) -> float:
    """Tilt that brings a measured rail to the stated inclination [-].

    `lean` is that of `head_lean`. The tilt is 0 if the head leans towards the track
    centre already, because it is then in its measured position.
    """
    return 0.0 if lean is not None and lean > UPRIGHT else inclination


def halves_apart(
    y: FloatArray, z: FloatArray, lean: float, share: float, count: int
) -> float:
    """Largest height difference of the halves of an upright head [m].

    Only a share of the head width is compared.
    """
    y, z = Placement(-math.atan(lean), 0.0, 0.0).apply(y, z)
    head = z - float(z.min()) < _SIDE_DEPTH
    y, z = y[head], z[head]
    left, right = float(y.min()), float(y.max())
    axis, at = 0.5 * (left + right), np.linspace(0.0, share * (right - left), count)
    order = np.argsort(y, kind="stable")
    y, z = y[order], z[order]
    return float(
        np.max(np.abs(np.interp(axis - at, y, z) - np.interp(axis + at, y, z)))
    )


def with_sharp_ends(profile: Profile) -> Profile:
    """Profile of a body that ends where its points end: both sides fall at 45 degrees.

    They fall by 1 mm, which is beyond any contact.
    """
    y, z = profile.y, profile.z
    fall = _END_STEP * np.arange(1, _END_STEPS + 1)
    return replace(
        profile,
        y=np.concatenate((y[0] - fall[::-1], y, y[-1] + fall)),
        z=np.concatenate((z[0] + fall[::-1], z, z[-1] + fall)),
    )


def place_rail(
    profile: Profile,
    inclination: float,
    gauge: float,
    half_span: float,
    gauge_height: float = GAUGE_DEPTH,
) -> Profile:
    """Incline a rail head and place it in the track, see `placement`.

    The origin of the points is arbitrary. The inclination is a further tilt: 0 if the
    points are inclined already [-].
    """
    where = placement(profile.y, profile.z, inclination, gauge, half_span, gauge_height)
    y, z = where.apply(profile.y, profile.z)
    return replace(profile, y=y, z=z)
