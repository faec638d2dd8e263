"""One contact solution as a dataset.

Patches, their fields, and the profiles placed on each other.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from wearsim.contact import geometry
from wearsim.contact.dataset import variable
from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import ContactConditions, Counterface, Wheelset
from wearsim.errors import ContactError
from wearsim.profile.shape import Profile

_SECTIONS = (
    # variable, quantity, dimension
    ("wheel_section_y", "section_y", "wheel_point"),
    ("wheel_section_z", "section_z", "wheel_point"),
    ("counterface_section_y", "section_y", "counterface_point"),
    ("counterface_section_z", "section_z", "counterface_point"),
)


def contact_state(
    conditions: ContactConditions,
    wheelset: Wheelset,
    counterface: Counterface,
    contact: xr.Dataset,
    *,
    point: int = 0,
    label: str = "",
) -> xr.Dataset:
    """Dataset of one operating point: what `wearsim.report.figures.contact` draws.

    Parameters
    ----------
    conditions, wheelset, counterface : ContactConditions, Wheelset, Counterface
        What was solved.
    contact : Dataset
        From `wearsim.solve_contact` with fields, of one side or both.
    point : int
        Index of the operating point in the batch.
    label : str
        Name of the state in figures that show several; "rail" or the roller's radius if
        empty.

    Returns
    -------
    Dataset
        SI units. Over `patch`: side (0 right, 1 left) and the summary of result files.
        Over (patch, strip) and (patch, cell, strip): the fields, cells from the leading
        edge, lateral directions those of the track, so that those of a left wheel are
        mirrored. Over `wheel` and points: wheel and counterface in the plane across the
        track, the wheel in initial contact.

    Raises
    ------
    ContactError
        If the solution holds no patch of the point.
    """
    rows = np.flatnonzero(contact["point"] == point)
    if rows.size == 0:
        raise ContactError(f"point {point} is not in the solution")
    solution = contact.isel(patch=rows, operating_point=point).drop_vars("point")
    cells, kappas = solution.sizes["cell"], dict.fromkeys(counterface.curvatures)
    along = xr.Variable("cell", (np.arange(cells) + 0.5) / cells)
    place = solution["cells_lead"] - along * (
        solution["cells_lead"] - solution["cells_trail"]
    )
    edges = solution["strip_wheel_y_edges"].values
    slip = np.hypot(solution["slip_x"].values, solution["slip_y"].values)
    strip, cell = ("patch", "strip"), ("patch", "cell", "strip")
    data = {
        "side": (("patch",), (solution["side"].values == "left").astype(np.int64)),
        "strip_wheel_y": (strip, 0.5 * (edges[:, 1:] + edges[:, :-1])),
        "longitudinal": (cell, place.transpose(*cell).values),
        "slipping": (cell, (slip > 0.0).astype(np.int8)),
        "counterface_curvature": ((), counterface.curvature),
    }
    state = solution.reset_coords("side").assign(
        {name: variable(name, *content) for name, content in data.items()}
    )
    radii = " and ".join(f"{1e3 / kappa:.6g}" for kappa in kappas if kappa)
    against = f"roller {radii} mm" if radii else "rail"
    return state.assign(_sections(wheelset, counterface, state)).assign_attrs(
        label=label or against,
        counterface="roller" if radii else "rail",
        creepage_given=int(conditions.creepage is not None),
        free_roll=int(conditions.free_roll),
    )


def _sections(
    wheelset: Wheelset, counterface: Counterface, state: xr.Dataset
) -> dict[str, xr.Variable]:
    """Wheel and counterface across the track, of each solved side."""
    sides = np.unique(state["side"])
    shift, yaw, roll = (float(state[name]) for name in ("shift", "yaw", "roll"))
    lines = []
    for side in sides:
        kappa = counterface.curvatures[side]
        sign = -1.0 if side else 1.0
        profile, rail = (
            (wheelset.right, wheelset.left)[side],
            counterface.profiles[side],
        )
        surface, pose = (
            counterface.surfaces[side],
            sign * np.array([[shift], [yaw], [roll]]),
        )
        gap = geometry.gap(
            wheelset.surfaces[side],
            surface,
            geometry.WheelsetPose(*pose),
            half_span=wheelset.half_span,
            nominal_radius=wheelset.radius,
            curvature=kappa,
        )
        height = float(gap.gap.min())
        y, z = _trace(profile, wheelset, kappa, *pose[:, 0])
        lines.append((sign * y, z + height, sign * rail.y, rail.z))
    variables = {
        "wheel": xr.Variable(
            "wheel", sides, {"long_name": "wheel", "comment": "0 right, 1 left"}
        )
    }
    for (name, quantity, along), values in zip(
        _SECTIONS, zip(*lines, strict=True), strict=True
    ):
        variables[name] = variable(quantity, ("wheel", along), np.stack(values))
    return variables


def _trace(
    profile: Profile,
    wheelset: Wheelset,
    curvature: float,
    shift: float,
    yaw: float,
    roll: float,
) -> tuple[FloatArray, FloatArray]:
    """Whole wheel profile in the plane across the track.

    Each circle of it at its smallest gap.

    The nearest point of a circle is taken to first order in the angles (second order:
    below 0.01 mm at a yaw of 10 mrad); the flange back, which is never in contact, is
    cut below the axle.
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
    length = np.sqrt((curvature * x) ** 2 + (1.0 - curvature * z) ** 2)
    height = (2.0 * z - curvature * (z * z + x * x)) / (1.0 + length)
    return y, height
