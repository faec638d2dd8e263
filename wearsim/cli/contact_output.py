"""What `wearsim contact` prints: a table, JSON in SI units, CSV with the unit in each name, and notes."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from wearsim.cli.contact_points import PATCH_NAMES, PointResult, rail_profile, wheel_profile
from wearsim.quantities import QUANTITIES

_PRINTED = (
    # column, name, factor to the shown unit, format
    ("wheel y [mm]", "wheel_y", 1e3, ".3f"),
    ("angle [mrad]", "contact_angle", 1e3, ".2f"),
    ("load [kN]", "normal_force", 1e-3, ".3f"),
    ("area [mm2]", "area", 1e6, ".1f"),
    ("pressure [MPa]", "max_pressure", 1e-6, ".0f"),
    ("creepage x", "creepage_x", 1.0, ".3e"),
    ("creepage y", "creepage_y", 1.0, ".3e"),
    ("spin [1/m]", "spin", 1.0, ".4f"),
    ("Fx [kN]", "force_x", 1e-3, ".3f"),
    ("Fy [kN]", "force_y", 1e-3, ".3f"),
    ("power [W]", "power", 1.0, ".1f"),
)
_ENDINGS = {
    "mm": "_mm", "mm²": "_mm2", "1/m": "_per_m", "mrad": "_mrad", "rad/s": "_rad_per_s", "kN": "_kN",
    "N m": "_Nm", "MPa": "_MPa", "W": "_W", "µm": "_um",
}  # fmt: skip
_RENAMED = {"normal_force_kN": "patch_normal_force_kN"}  # the first is a flag

_PLASTIC = 4e9
"""Maximum pressure [Pa] above which an elastic contact is no answer: a surface is fully plastic at a mean
pressure of 2.8 times the yield stress (K. L. Johnson, Contact Mechanics, 1985, 6.3,
doi:10.1017/CBO9781139171731), in an ellipse two thirds of the maximum; with 0.95 GPa, high for wheel and rail
steel, that is 4 GPa."""


def _column(name: str) -> tuple[str, float]:
    """Name of a result with its unit, and the factor from SI."""
    quantity = QUANTITIES[name]
    if quantity.shown_unit not in _ENDINGS:  # ratios, also those shown in thousandths
        return name, 1.0
    column = name + _ENDINGS[quantity.shown_unit]
    return _RENAMED.get(column, column), quantity.shown_factor


_ROTATION, _ROTATION_FACTOR = _column("rotation_speed")
_PATCH = tuple((name, *_column(name)) for name in PATCH_NAMES)

RESULT_COLUMNS = ("table_line", "patch", _ROTATION, *(column for _, column, _ in _PATCH))
"""Columns that follow those of the table; none is the name of a flag, so that output can be input again."""


def result_cells(result: PointResult, line: int) -> list[dict[str, str]]:
    """Cells of each patch: the side and roll that were solved, and `RESULT_COLUMNS`."""
    rows: list[dict[str, str]] = []
    speed = result.rotation_speed
    for patch in result.patches:
        number = 1 + sum(row["side"] == patch["side"] for row in rows)
        cells = {"side": patch["side"], "roll": _cell(result.roll * 1e3)}
        cells |= {"table_line": str(line), "patch": str(number)}
        cells[_ROTATION] = "" if speed is None else _cell(speed * _ROTATION_FACTOR)
        rows.append(cells | {column: _cell(patch[name] * factor) for name, column, factor in _PATCH})
    return rows


def _cell(value: float) -> str:
    """Twelve digits: far beyond any tolerance, without the noise of the change of units."""
    return format(value, ".12g")


def as_json(
    result: PointResult, line: int | None = None, carried: Mapping[str, str] | None = None
) -> dict[str, Any]:
    """JSON value of a point, SI units; of a row of a table with its line and the carried columns."""
    request = result.request
    row = {} if line is None else {"line": line, "columns": dict(carried or {})}
    models = {"normal": request.normal, "tangential": request.tangential}
    return {
        "shift": request.shift,
        "yaw": request.yaw,
        "roll": result.roll,
        "wheel_load": request.load if request.normal_force is None else None,
        "counterface_curvature": request.counterface_curvature,
        "rotation_speed": result.rotation_speed,
        **row,
        "patches": [patch | models for patch in result.patches],
    }


def as_text(result: PointResult) -> str:
    """Table of the patches for people."""
    width = [max(len(title), 10) for title, *_ in _PRINTED]
    lines = ["side   " + "  ".join(title.rjust(w) for (title, *_), w in zip(_PRINTED, width, strict=True))]
    for patch in result.patches:
        cells = [
            format(patch[name] * factor, style).rjust(w)
            for (_, name, factor, style), w in zip(_PRINTED, width, strict=True)
        ]
        lines.append(f"{patch['side']:5}  " + "  ".join(cells))
    request, speed, count = result.request, result.rotation_speed, len(result.patches)
    kappa = request.counterface_curvature
    against = "rail" if kappa == 0.0 else f"roller of {1e3 / kappa:g} mm"
    who = "both wheels" if request.side == "both" else f"{request.side} wheel"
    turning = "creepages given" if speed is None else f"rotation {speed:.4f} rad/s"
    if speed is not None and isinstance(request.rule, str):
        turning += f" ({request.rule})"
    roll = f"roll {result.roll * 1e3:.4f} mrad" + (" (free)" if request.free_roll else "")
    lines.append(f"{who} on {against}, {count} patch{'' if count == 1 else 'es'}; {turning}; {roll}")
    lines.append(f"{request.normal}, {request.tangential}; forces act on the wheel")
    return "\n".join(lines)


def notes(result: PointResult) -> dict[str, str]:
    """Return what deserves a second look in one solved point, by kind.

    Parameters
    ----------
    result : PointResult
        Of any point.

    Returns
    -------
    dict
        On a measured rail, a wheel that climbs its flange, pressures no steel carries, and a roller that
        runs in a curve.
    """
    request, lines = result.request, {}
    stand = _stand(request.rail, request.inclination)
    if stand is not None:
        lines["measured rail"] = f"{request.rail}: {stand}"
    free = _clearance(request.wheel, *request.placed_rail)
    towards = {"right": request.shift, "left": -request.shift}
    climbing = [
        patch["side"] for patch in result.patches if free is not None and towards[patch["side"]] > free
    ]
    if climbing and free is not None:
        lines["flange clearance"] = (
            f"shift {1e3 * request.shift:g} mm is beyond the flange clearance of {1e3 * free:.3g} mm: the "
            f"{climbing[0]} wheel climbs its flange, which a wheelset in service does only while it derails"
        )
    highest = max(patch["max_pressure"] for patch in result.patches)
    if highest > _PLASTIC:
        lines["pressure"] = (
            f"maximum pressure {1e-9 * highest:.3g} GPa: wheel and rail steel yields far below "
            f"{1e-9 * _PLASTIC:g} GPa, and an elastic contact is no answer; check load and profiles"
        )
    if request.track_curvature != 0.0 and request.counterface_curvature > 0.0:
        lines["curve"] = (
            "a curve radius on a roller stands for rollers of both sides that turn at different speeds"
        )
    return lines


@lru_cache(maxsize=64)
def _clearance(wheel: str, *placed_rail: Any) -> float | None:
    from wearsim.profile.conicity import flange_clearance

    return flange_clearance(wheel_profile(wheel), rail_profile(*placed_rail))


@lru_cache(maxsize=64)
def _stand(rail: str, inclination: float) -> str | None:
    """How a measured rail is put into the track, None for standard shapes."""
    from wearsim.profile.files import is_file
    from wearsim.profile.inspection.inputs import placement_notes, read_input

    lines = placement_notes(read_input(rail, "rail"), inclination) if is_file(rail) else ()
    return lines[0] if lines else None
