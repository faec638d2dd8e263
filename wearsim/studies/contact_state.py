"""One contact solution as a dataset: patches, their fields, and the profiles placed on each other."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from wearsim.contact import geometry
from wearsim.contact.dataset import patch_columns, variable
from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import ContactConditions, ContactSolution, Counterface, Wheelset
from wearsim.errors import ContactError
from wearsim.profile.shape import Profile

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
    """Dataset of one operating point: what `wearsim.report.figures.contact` draws.

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
        the plane across the track, the wheel in initial contact, and the gap around the patches.

    Raises
    ------
    ContactError
        If the solution holds no patch of the point.
    """
    rows = np.flatnonzero(solution.point == point)
    if rows.size == 0:
        raise ContactError(f"point {point} is not in the solution")
    data = {
        name: variable(name, dimensions, values[rows])
        for name, (dimensions, values) in patch_columns(solution, fields=True).items()
        if name not in ("point", "roll", "rotation_speed")
    }
    cells = data["pressure"].sizes["cell"]
    along = xr.Variable("cell", (np.arange(cells) + 0.5) / cells)
    lead, trail = data["cells_lead"], data["cells_trail"]
    place = lead - along * (lead - trail)
    edges = solution.strip_edges_wheel_y[rows]
    slip = np.hypot(data["slip_x"].values, data["slip_y"].values)
    strip, cell = ("patch", "strip"), ("patch", "cell", "strip")
    data |= {
        "side": variable("side", ("patch",), solution.side[rows]),
        "strip_wheel_y": variable("strip_wheel_y", strip, 0.5 * (edges[:, 1:] + edges[:, :-1])),
        "longitudinal": variable("longitudinal", cell, place.transpose(*cell).values),
        "slipping": variable("slipping", cell, (slip > 0.0).astype(np.int8)),
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
    return {name: variable(name, (), float(value)) for name, value in values.items()}


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
    surfaces, spread, distances = [], [], []
    for side in sides:
        sign = -1.0 if side else 1.0
        angles = (conditions.yaw[point], solution.roll[rows[0]])
        shift, yaw, roll = sign * np.array([conditions.shift[point], *angles])
        profile = wheelset.left if side else wheelset.right
        rail = counterface.profiles[side]
        surface = geometry.counterface_profile(rail)
        gap = geometry.gap(
            geometry.wheel_surface(profile, wheelset.radius),
            surface,
            geometry.WheelsetPose(np.array([shift]), np.array([yaw]), np.array([roll])),
            half_span=wheelset.half_span,
            nominal_radius=wheelset.radius,
            curvature=counterface.curvature,
        )
        height = float(gap.gap.min())
        y, z = _trace(profile, wheelset, counterface.curvature, shift, yaw, roll)
        own = rows[solution.side[rows] == side]
        half = 0.5 * solution.width[own]
        low, high = (solution.rail_y[own] - half).min(), (solution.rail_y[own] + half).max()
        margin = _GAP_SPAN * float(half.max())
        surfaces.append(surface)
        spread.append((low - margin, high + margin))
        distances.append((gap.gap[0] - height) * np.cos(surface.angle))
        for name, values in (
            ("wheel_section_y", sign * y),
            ("wheel_section_z", z + height),
            ("counterface_section_y", sign * rail.y),
            ("counterface_section_z", rail.z),
        ):
            parts.setdefault(name, []).append(values)
    for surface, (low, high), distance in zip(surfaces, spread, distances, strict=True):
        at = np.linspace(max(low, surface.y[0]), min(high, surface.y[-1]), 401)
        parts.setdefault("gap_rail_y", []).append(at)
        parts.setdefault("gap", []).append(np.interp(at, surface.y, distance))
    meaning = {"long_name": "wheel", "comment": "0 right, 1 left"}
    variables = {"wheel": xr.Variable(("wheel",), sides, meaning)}
    for name, lines in parts.items():
        row, along = _SECTIONS[name]
        variables[name] = variable(row, ("wheel", along), np.stack(lines))
    return variables


def _trace(
    profile: Profile, wheelset: Wheelset, curvature: float, shift: float, yaw: float, roll: float
) -> tuple[FloatArray, FloatArray]:
    """Whole wheel profile in the plane across the track: each circle of it at its smallest gap.

    The nearest point of a circle is taken to first order in the angles (second order: below 0.01 mm at a yaw
    of 10 mrad); the flange back, which is never in contact, is cut below the axle.
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
