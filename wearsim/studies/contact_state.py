"""One contact solution as a dataset: patches, their fields, and the profiles placed on each other."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from wearsim.contact import geometry
from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import ContactConditions, ContactSolution, Counterface, Wheelset
from wearsim.errors import ContactError
from wearsim.profile.shape import Profile
from wearsim.quantities import QUANTITIES

_SCALARS = (
    "wheel_y", "rail_y", "x", "contact_angle", "area", "max_pressure", "length", "width", "approach",
    "normal_force", "creepage_x", "creepage_y", "spin", "force_x", "force_y", "spin_moment", "slip_area",
    "power", "power_balance",
)  # fmt: skip
_SECTIONS = {
    # variable: quantity, dimension
    "wheel_section_y": ("section_y", "wheel_point"),
    "wheel_section_z": ("section_z", "wheel_point"),
    "counterface_section_y": ("section_y", "counterface_point"),
    "counterface_section_z": ("section_z", "counterface_point"),
    "gap_rail_y": ("rail_y", "gap_point"),
    "gap": ("gap", "gap_point"),
}
_GAP_SPAN = 1.5  # patch widths of gap on either side of the patches


def contact_state(
    conditions: ContactConditions,
    wheelset: Wheelset,
    counterface: Counterface,
    solution: ContactSolution,
    *,
    point: int = 0,
    label: str = "",
) -> xr.Dataset:
    """Dataset of one operating point: what `wearsim.report.figures_contact` draws.

    Parameters
    ----------
    conditions, wheelset, counterface : ContactConditions, Wheelset, Counterface
        What was solved.
    solution : ContactSolution
        Of these conditions, of one side or both.
    point : int
        Index of the operating point in the batch.
    label : str
        Name of the state in figures that show several; "rail" or the roller's radius if empty.

    Returns
    -------
    Dataset
        SI units. Over `patch`: side (0 right, 1 left) and the summary of result files. Over (patch, strip)
        and (patch, cell, strip): the fields, cells from the leading edge, lateral directions those of the
        track, so that those of a left wheel are mirrored. Over `wheel` and points: wheel and counterface in
        the plane across the track, the wheel just touching, and the gap around the patches.

    Raises
    ------
    ContactError
        If the solution holds no patch of the point.
    """
    rows = np.flatnonzero(solution.point == point)
    if rows.size == 0:
        raise ContactError(f"point {point} is not in the solution")
    sign = np.where(solution.side[rows] == 1, -1.0, 1.0)
    fields, patch = solution.fields, solution.patch
    edges = solution.strip_edges_wheel_y[rows]
    cells = fields.pressure.shape[1]
    lead = fields.x_lead[rows]
    trail = lead - cells * fields.cell_length[rows]
    along = (np.arange(cells) + 0.5) / cells
    speed = np.hypot(fields.slip_x[rows], fields.slip_y[rows])
    strip, cell = ("patch", "strip"), ("patch", "cell", "strip")
    data: dict[str, Any] = {
        "side": _variable("side", ("patch",), solution.side[rows]),
        **{name: _variable(name, ("patch",), getattr(solution, name)[rows]) for name in _SCALARS},
        "lateral": _variable("lateral", strip, sign[:, None] * patch.y[rows]),
        "strip_wheel_y": _variable("strip_wheel_y", strip, 0.5 * (edges[:, 1:] + edges[:, :-1])),
        "strip_width": _variable("strip_width", ("patch",), patch.width[rows]),
        "x_lead": _variable("x_lead", strip, patch.x_lead[rows]),
        "x_trail": _variable("x_trail", strip, patch.x_trail[rows]),
        "cells_lead": _variable("cells_lead", strip, lead),
        "cells_trail": _variable("cells_trail", strip, trail),
        "longitudinal": _variable(
            "longitudinal", cell, lead[:, None, :] - along[:, None] * (lead - trail)[:, None, :]
        ),
        **{
            name: _variable(name, cell, getattr(fields, name)[rows])
            for name in ("pressure", "shear_x", "shear_y", "slip_x", "slip_y", "work_density")
        },
        "slipping": _variable("slipping", cell, (speed > 0.0).astype(np.int8)),
        **_point(conditions, solution, counterface, point, rows[0]),
        **_sections(conditions, wheelset, counterface, solution, point, rows),
    }
    kappa = counterface.curvature
    against = "rail" if kappa == 0.0 else f"roller {1e3 / kappa:.6g} mm"
    return xr.Dataset(data, attrs={
        "label": label or against,
        "counterface": "rail" if kappa == 0.0 else "roller",
        "wheel_profile": wheelset.right.name,
        "counterface_profile": counterface.profile.name,
        "rotation_rule": conditions.rotation if isinstance(conditions.rotation, str) else "given",
        "creepage_given": int(conditions.creepage is not None),
        "free_roll": int(conditions.free_roll),
    })  # fmt: skip


def _variable(name: str, dimensions: tuple[str, ...], values: Any) -> xr.Variable:
    quantity = QUANTITIES[name]
    attributes = {"long_name": quantity.meaning, "units": quantity.unit or "1"}
    if quantity.sign:
        attributes["comment"] = quantity.sign
    return xr.Variable(dimensions, np.asarray(values), attributes)


def _point(
    conditions: ContactConditions, solution: ContactSolution, counterface: Counterface, point: int, row: int
) -> dict[str, xr.Variable]:
    """Operating point as scalars."""
    values = {
        name: getattr(conditions, name)[point]
        for name in ("shift", "yaw", "wheel_load", "speed", "friction", "track_curvature")
    }
    values["roll"] = solution.roll[row]
    values["rotation_speed"] = solution.rotation_speed[row]
    values["counterface_curvature"] = counterface.curvature
    return {name: _variable(name, (), float(value)) for name, value in values.items()}


def _sections(
    conditions: ContactConditions,
    wheelset: Wheelset,
    counterface: Counterface,
    solution: ContactSolution,
    point: int,
    rows: Any,
) -> dict[str, xr.Variable]:
    """Wheel and counterface across the track, and the gap around the patches, of each solved side."""
    sides = np.unique(solution.side[rows])
    parts: dict[str, list[FloatArray]] = {}
    grounds, spread, touch = [], [], []
    for side in sides:
        sign = -1.0 if side else 1.0
        angles = (conditions.yaw[point], solution.roll[rows[0]])
        shift, yaw, roll = sign * np.array([conditions.shift[point], *angles])
        profile = wheelset.left if side else wheelset.right
        below = counterface.profiles[side]
        ground = geometry.contour(below)
        gap = geometry.gap(
            geometry.rings(profile, wheelset.radius),
            ground,
            geometry.Attitude(np.array([shift]), np.array([yaw]), np.array([roll])),
            half_span=wheelset.half_span,
            nominal_radius=wheelset.radius,
            curvature=counterface.curvature,
        )
        descent = float(gap.gap.min())
        y, z = _trace(profile, wheelset, counterface.curvature, shift, yaw, roll)
        own = rows[solution.side[rows] == side]
        half = 0.5 * solution.width[own]
        low, high = (solution.rail_y[own] - half).min(), (solution.rail_y[own] + half).max()
        margin = _GAP_SPAN * float(half.max())
        grounds.append(ground)
        spread.append((low - margin, high + margin))
        touch.append((gap.gap[0] - descent) * np.cos(ground.angle))
        for name, values in (
            ("wheel_section_y", sign * y),
            ("wheel_section_z", z + descent),
            ("counterface_section_y", sign * below.y),
            ("counterface_section_z", below.z),
        ):
            parts.setdefault(name, []).append(values)
    for ground, (low, high), distance in zip(grounds, spread, touch, strict=True):
        at = np.linspace(max(low, ground.y[0]), min(high, ground.y[-1]), 401)
        parts.setdefault("gap_rail_y", []).append(at)
        parts.setdefault("gap", []).append(np.interp(at, ground.y, distance))
    meaning = {"long_name": "wheel", "comment": "0 right, 1 left"}
    variables = {"wheel": xr.Variable(("wheel",), sides, meaning)}
    for name, lines in parts.items():
        row, along = _SECTIONS[name]
        variables[name] = _variable(row, ("wheel", along), np.stack(lines))
    return variables


def _trace(
    profile: Profile, wheelset: Wheelset, curvature: float, shift: float, yaw: float, roll: float
) -> tuple[FloatArray, FloatArray]:
    """Whole wheel profile in the plane across the track: each ring where it comes nearest to the ground.

    The nearest point of a ring is taken to first order in the angles (second order: below 0.01 mm at a yaw
    of 10 mrad); the flange back, which touches nothing, is cut below the axle.
    """
    b, r = wheelset.half_span + profile.y, wheelset.radius + profile.z
    dy, dz = np.gradient(profile.y), np.gradient(profile.z)
    steep = np.tan(np.radians(86.0))
    slope = np.clip(dz / np.where(np.abs(dy) > 1e-12, dy, 1e-12), -steep, steep)
    slope[: int(np.argmax(profile.z))] = 0.0
    sy, cy, sr, cr = np.sin(yaw), np.cos(yaw), np.sin(roll), np.cos(roll)
    sine = (curvature * sy * b - sy * cr * slope - sy * sr) / (1.0 + curvature * r)
    cosine = np.sqrt(1.0 - sine**2)
    x = cy * r * sine - sy * cr * b + sy * sr * r * cosine
    y = shift + sy * r * sine + cy * cr * b - cy * sr * r * cosine - wheelset.half_span
    z = sr * b + cr * r * cosine - wheelset.radius
    height = (2.0 * z - curvature * (z * z + x * x)) / (
        1.0 + np.sqrt((curvature * x) ** 2 + (1.0 - curvature * z) ** 2)
    )
    return y, height
