"""Gauge values of wheels and wheelsets: Sh, Sd and qR after EN 15313 and UIC 510-2."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from wearsim.errors import ProfileError
from wearsim.profile.placement import RUNNING_CIRCLE
from wearsim.profile.shape import FloatArray, Profile, crossing, extremum
from wearsim.quantities import QUANTITIES

LEVEL = 10e-3
"""Height of Sd and of the lower point of qR above the running circle [m].

It is that of EN 15313; other railways measure Sd at another height.
"""

BELOW_TIP = 2e-3
"""Depth of the upper point of qR below the flange tip [m]."""

HOLLOWING_REACH = 50e-3
"""Lateral position up to which the tread must be measured for its hollowing [m].

No contact band reaches so far.
"""

_LEAST_FLANGE = 5e-3
"""Least height of a flange [m].

Below it the body is a disc, a roller, or a profile without its flange.
"""


@dataclass(frozen=True)
class MeasuringRule:
    """Places at which the gauge values of a wheel are measured.

    The running circle is the level of Sh, Sd and qR and the place of the diameter. The
    lower point of qR stays at `LEVEL` above it, as EN 15313 defines qR.
    """

    height: float = LEVEL  # of Sd above the running circle [m]
    running_circle: float = RUNNING_CIRCLE  # distance from the flange back [m]

    @property
    def circle_y(self) -> float:
        """Lateral position of the running circle on the wheel profile [m]."""
        return self.running_circle - RUNNING_CIRCLE


EN_15313 = MeasuringRule()
"""Sd at 10 mm above the running circle, which is 70 mm from the flange back."""

# slope above which the end of a profile is rim chamfer or outer face, not tread
_FACE_SLOPE = math.radians(30.0)


def _tread_side(y: FloatArray, z: FloatArray, circle: float = 0.0) -> int:
    """Vertex of the flange tip, which must lie before the running circle at y [m]."""
    tip = int(np.argmax(z))
    if not (y[tip] < circle < y[-1]):
        raise ProfileError(
            f"the wheel profile has its largest z at y = {1e3 * y[tip]:.4g} mm; a "
            "flange at negative y and a tread beyond the running circle (y = "
            f"{1e3 * circle:.4g}) are needed"
        )
    return tip


def running_circle_level(
    y: FloatArray, z: FloatArray, rule: MeasuringRule = EN_15313
) -> float:
    """Height z of a wheel profile y, z (n,) at its running circle [m].

    The rolling radius there is that at z = 0 plus this height.
    """
    circle = rule.circle_y
    tip = _tread_side(y, z, circle)
    before = tip + int(np.flatnonzero(y[tip:] <= circle)[-1])
    return crossing(z, y, before, circle)


def flange_height(
    y: FloatArray, z: FloatArray, rule: MeasuringRule = EN_15313
) -> float:
    """Flange height Sh of a wheel profile y, z (n,), all in m.

    Sh is the height of the flange tip above the running circle; 28 mm for a new S1002.
    """
    tip = _tread_side(y, z, rule.circle_y)
    return extremum(y, z, tip)[1] - running_circle_level(y, z, rule)


def _flank_at(
    y: FloatArray, z: FloatArray, rule: MeasuringRule, level: float, measure: str
) -> float:
    """Lateral position of the active flank at a height above the running circle [m]."""
    tip = _tread_side(y, z, rule.circle_y)
    height = z - running_circle_level(y, z, rule)
    above = np.flatnonzero((height[tip:] >= level) & (y[tip:] < rule.circle_y))
    if len(above) == 0:
        raise ProfileError(
            f"the flange does not reach {level * 1e3:g} mm above the running circle "
            f"for {measure}"
        )
    return crossing(y, height, tip + int(above[-1]), level)


def flange_thickness(
    y: FloatArray, z: FloatArray, rule: MeasuringRule = EN_15313
) -> float:
    """Flange thickness Sd of a wheel profile y, z (n,) from the flange back, all in m.

    It counts from the nominal flange back, at the height of the rule above the running
    circle; 32.5 mm for a new S1002 at 10 mm.
    """
    return RUNNING_CIRCLE + _flank_at(y, z, rule, rule.height, "Sd")


def flange_gradient(
    y: FloatArray, z: FloatArray, rule: MeasuringRule = EN_15313
) -> float:
    """Flange gradient qR of a wheel profile y, z (n,), all in m.

    qR is the lateral distance of two points of the flank, one at the height `LEVEL`
    above the running circle, the other `BELOW_TIP` below the flange tip; 10.794 mm for
    a new S1002, less for a steeper flank. Raises `ProfileError` for a flank without one
    of them.
    """
    tip = _tread_side(y, z, rule.circle_y)
    upper = extremum(y, z, tip)[1] - BELOW_TIP
    under = np.flatnonzero(z[tip:] < upper)
    if len(under) == 0:
        raise ProfileError(
            f"the flange has no point {BELOW_TIP * 1e3:g} mm below its tip for qR"
        )
    return _flank_at(y, z, rule, LEVEL, "qR") - crossing(
        y, z, tip + int(under[0]) - 1, upper
    )


def hollowing(
    y: FloatArray, z: FloatArray, *, start: float = -30e-3, end: float = 60e-3
) -> float:
    """Hollow wear of a wheel profile y, z (n,), all in m.

    Hollow wear is the largest rise of the radius to the field side, the maximum of
    z(y2) - z(y1) over y1 < y2 within the tread from `start` to `end`; 0 for a new
    S1002. Raises `ProfileError` if no point lies there.
    """
    tread = z[(y >= start) & (y <= end)]
    if len(tread) == 0:
        raise ProfileError(
            f"the wheel profile has no tread within {start * 1e3:g} .. {end * 1e3:g} mm"
        )
    return float(np.max(tread - np.minimum.accumulate(tread)))


GAUGE_VALUES = ("flange_height", "flange_thickness", "flange_gradient", "hollowing")
"""Gauge values that a campaign stores, and that may have a limit."""


def gauge_value(name: str, y: FloatArray, z: FloatArray, rule: MeasuringRule) -> float:
    """Gauge value of a wheel profile y, z (n,) by its name in `GAUGE_VALUES` [m]."""
    values: dict[str, Callable[[], float]] = {
        "flange_height": partial(flange_height, y, z, rule),
        "flange_thickness": partial(flange_thickness, y, z, rule),
        "flange_gradient": partial(flange_gradient, y, z, rule),
        "hollowing": partial(hollowing, y, z),
    }
    return values[name]()


@dataclass(frozen=True)
class Measures:
    """Gauge values [m] by their names in `wearsim.quantities`.

    Missing values have the reason why they could not be measured.
    """

    values: Mapping[str, float]
    missing: Mapping[str, str]


def measure(
    profile: Profile,
    *,
    diameter: float | None = None,
    measuring_height: float = LEVEL,
    running_circle: float = RUNNING_CIRCLE,
) -> Measures:
    """Gauge values of a wheel as EN 15313 and UIC 510-2 define them, and its hollowing.

    Parameters
    ----------
    profile : Profile
        Wheel with the flange back at y = -70 mm, as standard shapes, worn wheels of
        results and profiles aligned to such have it.
    diameter : float, optional
        At the running circle as it is now, which is not in the profile [m].
    measuring_height : float
        Height of Sd above the running circle [m]: 10 mm after EN 15313, 12 mm for the
        Chinese LMA.
    running_circle : float
        Distance of the running circle from the flange back [m].

    Returns
    -------
    Measures
        `values` [m] by name: flange_height, flange_thickness, flange_gradient,
        hollowing, rim_width and wheel_diameter, as far as they can be measured;
        `missing` has the reason for each of the others.

    Raises
    ------
    ProfileError
        If the profile is no wheel, or a height or distance is out of its range.

    Examples
    --------
    >>> import wearsim
    >>> found = wearsim.measure(wearsim.standard_profile("S1002"))
    >>> round(1e3 * found.values["flange_thickness"], 2), round(1e3 * found.values["flange_height"], 2)
    (32.5, 28.0)
    """
    if not isinstance(profile, Profile) or profile.kind != "wheel":
        raise ProfileError("the measures are those of a wheel; give the profile of one")
    for name, value in (
        ("measuring_height", measuring_height),
        ("running_circle", running_circle),
    ):
        if fault := QUANTITIES[name].fault(value):
            raise ProfileError(fault)
    rule = MeasuringRule(measuring_height, running_circle)
    return wheel_measures(profile, diameter=diameter, rule=rule)


def wheel_measures(
    profile: Profile, *, diameter: float | None = None, rule: MeasuringRule = EN_15313
) -> Measures:
    """Gauge values of one wheel; missing values have their reason.

    Parameters
    ----------
    profile : Profile
        Wheel with the flange back at y = -70 mm, see `wearsim.profile.alignment`.
    diameter : float, optional
        At the running circle as it is now, which is not in the profile [m].
    rule : MeasuringRule
        Height of Sd and place of the running circle.
    """
    gauge: dict[str, Callable[[FloatArray, FloatArray], float]] = {
        "flange_height": partial(flange_height, rule=rule),
        "flange_thickness": partial(flange_thickness, rule=rule),
        "flange_gradient": partial(flange_gradient, rule=rule),
        "hollowing": _whole_hollowing,
        "rim_width": _rim_width,
    }
    values: dict[str, float] = {}
    missing: dict[str, str] = {}
    for name, measure in gauge.items():
        try:
            if name != "hollowing":
                _check_flange(
                    profile.y,
                    profile.z,
                    tip=name in ("flange_height", "flange_gradient"),
                )
            values[name] = float(measure(profile.y, profile.z))
        except ProfileError as error:
            missing[name] = str(error)
    return Measures(
        values if diameter is None else {**values, "wheel_diameter": diameter}, missing
    )


def axle_measures(
    right: Measures, left: Measures, back_to_back: float | None = None
) -> Measures:
    """Measures of an axle from its wheels and back-to-back distance AR, if known [m].

    They are back_to_back; front_to_front, which is AR + Sd of the right + Sd of the
    left wheel, at the level of Sd; and wheel_diameter_difference, right minus left.
    Raises `ProfileError` for a distance out of its range.
    """
    values: dict[str, float] = {}
    both = right.values.keys() & left.values.keys()
    if back_to_back is not None:
        if fault := QUANTITIES["back_to_back"].fault(back_to_back):
            raise ProfileError(fault)
        values["back_to_back"] = back_to_back
        if "flange_thickness" in both:
            sides = right.values["flange_thickness"], left.values["flange_thickness"]
            values["front_to_front"] = back_to_back + sides[0] + sides[1]
    if "wheel_diameter" in both:
        values["wheel_diameter_difference"] = (
            right.values["wheel_diameter"] - left.values["wheel_diameter"]
        )
    return Measures(values, {})


def _check_flange(y: FloatArray, z: FloatArray, *, tip: bool) -> None:
    """Raise an error for a profile without a flange.

    It is also raised if points on either side of a required flange tip are missing.
    """
    height = flange_height(y, z)
    if height < _LEAST_FLANGE:
        raise ProfileError(
            f"there is no flange: the top lies {height * 1e3:.2f} mm above the "
            "running circle"
        )
    if tip and int(np.argmax(z)) == 0:
        raise ProfileError(
            f"it begins at its highest point (y = {y[0] * 1e3:.4g} mm): no flange tip"
        )


def _whole_hollowing(y: FloatArray, z: FloatArray) -> float:
    """Hollowing of a tread that is measured over the required width."""
    if y.max() < HOLLOWING_REACH:
        raise ProfileError(
            f"the profile ends at y = {1e3 * y.max():.4g} mm; hollowing needs the "
            f"tread up to {1e3 * HOLLOWING_REACH:g} mm"
        )
    return hollowing(y, z)


def _rim_width(y: FloatArray, z: FloatArray) -> float:
    """Rim width from the nominal flange back to the outermost point, or None.

    That point must be on the chamfer or the outer face.
    """
    end = int(np.argmax(y))
    before = int(np.flatnonzero(y[: end + 1] <= y[end] - 1e-3)[-1])
    if z[before] - z[end] < math.tan(_FACE_SLOPE) * (y[end] - y[before]):
        raise ProfileError(
            f"the profile ends on the tread at y = {1e3 * y[end]:.4g} mm; the width "
            "needs the rim chamfer or the outer face"
        )
    return RUNNING_CIRCLE + float(y[end])
