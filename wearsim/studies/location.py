"""Where rigid wheels touch rail and rollers over the lateral shift, and at which shifts they touch twice."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from wearsim import __version__
from wearsim.contact import equilibrium, geometry
from wearsim.contact.geometry import CounterfaceProfile, Gap, WheelsetPose, WheelSurface
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import Wheelset
from wearsim.errors import ContactError
from wearsim.scene.location import Locations

_JUMP = 1e-3  # m on the wheel; less within _CLOSE is a contact that moves fast
_CLOSE = 1e-7  # m of shift

VALUES = {
    "wheel_y": ("m", "lateral position of the contact on the wheel profile"),
    "counterface_y": ("m", "lateral position of the contact on the profile of rail or roller"),
    "x": ("m", "longitudinal position of the contact, from the middle of the axle"),
    "contact_angle": ("rad", "contact angle about the rolling direction"),
    "wheel_radius": ("m", "rolling radius"),
    "roll": ("rad", "roll of the wheelset"),
}
"""Unit and meaning of what is found at each shift."""


def solve_locations(cases: Locations) -> xr.Dataset:
    """Find the point where the right wheel touches first, on rail and rollers, and its jumps.

    Parameters
    ----------
    cases : Locations
        From a scene of kind "location".

    Returns
    -------
    Dataset
        Over `counterface_curvature` and `shift`: `VALUES`. Over `jump`: curvature, shift and the values on
        both sides (`before_*`, `after_*`) of each two-point contact, a shift at which two points touch at
        once and the contact leaves one for the other.

    Raises
    ------
    ContactError
        If a wheel does not touch, or no roll lets both wheels touch.
    """
    tables = [locate(cases, curvature, cases.shift) for curvature in cases.curvatures]
    jumps: list[dict[str, float]] = []
    for curvature, table in zip(cases.curvatures, tables, strict=True):
        for i in np.flatnonzero(np.abs(np.diff(table["wheel_y"])) > _JUMP):
            jumps += _jumps(cases, curvature, cases.shift[i], cases.shift[i + 1])
    values: dict[str, Any] = {
        name: (
            ("counterface_curvature", "shift"),
            np.stack([table[name] for table in tables]),
            {"units": unit, "long_name": meaning},
        )
        for name, (unit, meaning) in VALUES.items()
    }
    for name in (
        "curvature",
        "shift",
        *(f"{side}_{name}" for side in ("before", "after") for name in VALUES),
    ):
        values[f"jump_{name}"] = ("jump", np.array([jump[name] for jump in jumps]))
    coordinates = {
        "counterface_curvature": ("counterface_curvature", np.array(cases.curvatures), {"units": "m-1"}),
        "shift": ("shift", cases.shift, {"units": "m", "long_name": "lateral shift, positive to the right"}),
    }
    about = {
        "title": cases.title,
        "yaw": cases.yaw,
        "scene": cases.scene_text,
        "source": f"wearsim {__version__}",
    }
    return xr.Dataset(values, coordinates, about | {"free_roll": int(cases.free_roll)})


def locate(cases: Locations, curvature: float, shift: FloatArray) -> dict[str, FloatArray]:
    """Find where the right wheel touches first.

    Parameters
    ----------
    cases : Locations
        Wheelset, profile, yaw and rule for the roll.
    curvature : float
        Of the counterface [1/m].
    shift : (n,) array
        [m].

    Returns
    -------
    dict
        `VALUES` at each shift.

    Raises
    ------
    ContactError
        If a wheel does not touch, or no roll lets both wheels touch.
    """
    wheelset, ground = cases.wheelset, geometry.counterface_profile(cases.profile)
    wheels = [geometry.wheel_surface(wheel, wheelset.radius) for wheel in (wheelset.right, wheelset.left)]

    def gap(side: int, angle: FloatArray) -> Gap:
        sign = -1.0 if side else 1.0
        pose = WheelsetPose(sign * shift, np.full_like(shift, sign * cases.yaw), sign * angle)
        return _gap(wheels[side], ground, pose, wheelset, curvature)

    angle = np.zeros_like(shift)
    if cases.free_roll:

        def descents(trial: FloatArray) -> tuple[FloatArray, FloatArray]:
            return gap(0, trial).gap.min(axis=1), gap(1, trial).gap.min(axis=1)

        angle, found = equilibrium.resting_roll(descents, angle, wheelset.half_span)
        if not found.all():
            raise ContactError(
                f"shift {1e3 * shift[int(np.argmin(found))]:g} mm: no roll lets both wheels touch; "
                'choose smaller shifts or roll = "none"'
            )
    right = gap(0, angle)
    lowest = right.gap.argmin(axis=1)
    if right.gap.min() >= geometry.NO_WHEEL or lowest.min() == 0 or lowest.max() == ground.y.size - 1:
        raise ContactError("the wheel touches the edge of a profile or nothing; choose smaller shifts")
    place = _vertex(right.gap, lowest)
    grid = np.arange(ground.y.size, dtype=np.float64)
    rows = range(shift.size)
    return {
        "wheel_y": np.array([np.interp(place[k], grid, right.wheel_y[k]) for k in rows]),
        "counterface_y": np.interp(place, grid, ground.y),
        "x": np.array([np.interp(place[k], grid, right.x[k]) for k in rows]),
        "contact_angle": np.interp(place, grid, ground.angle),
        "wheel_radius": np.array([np.interp(place[k], grid, right.wheel_radius[k]) for k in rows]),
        "roll": angle,
    }


def _gap(
    wheel: WheelSurface, ground: CounterfaceProfile, pose: WheelsetPose, wheelset: Wheelset, curvature: float
) -> Gap:
    return geometry.gap(
        wheel,
        ground,
        pose,
        half_span=wheelset.half_span,
        nominal_radius=wheelset.radius,
        curvature=curvature,
    )


def _vertex(gap: FloatArray, lowest: IntArray) -> FloatArray:
    """Lowest place of each row as a fractional grid position, by the parabola through three points."""
    row = np.arange(lowest.size)
    before, here, after = (gap[row, lowest + k] for k in (-1, 0, 1))
    bend = before - 2.0 * here + after
    move = np.divide(0.5 * (before - after), bend, out=np.zeros_like(bend), where=bend > 0.0)
    place: FloatArray = lowest + np.clip(move, -0.5, 0.5)
    return place


def _jumps(cases: Locations, curvature: float, low: float, high: float) -> list[dict[str, float]]:
    """Two-point contacts between two shifts."""
    shift = np.linspace(low, high, 11)
    table = locate(cases, curvature, shift)
    found = []
    for i in np.flatnonzero(np.abs(np.diff(table["wheel_y"])) > _JUMP):
        if shift[i + 1] - shift[i] > _CLOSE:
            found += _jumps(cases, curvature, shift[i], shift[i + 1])
        else:
            sides = {
                f"{side}_{name}": float(table[name][k])
                for side, k in (("before", i), ("after", i + 1))
                for name in VALUES
            }
            found.append({"curvature": curvature, "shift": 0.5 * float(shift[i] + shift[i + 1]), **sides})
    return found
