"""What `wearsim contact` prints: a table for people, JSON in SI units, CSV with the unit in each name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from wearsim.cli.contact_points import PATCH_NAMES, PointResult
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


def _column(name: str) -> tuple[str, float]:
    """Name of a result with its unit, and the factor from SI."""
    quantity = QUANTITIES[name]
    if quantity.shown_unit not in _ENDINGS:  # ratios, also those shown in thousandths
        return name, 1.0
    told = name + _ENDINGS[quantity.shown_unit]
    return _RENAMED.get(told, told), quantity.shown_factor


_ROTATION, _ROTATION_FACTOR = _column("rotation_speed")
_PATCH = tuple((name, *_column(name)) for name in PATCH_NAMES)

RESULT_COLUMNS = ("table_line", "patch", _ROTATION, *(told for _, told, _ in _PATCH))
"""Columns that follow those of the table; none is the name of a flag, so that output can be input again."""


def result_cells(result: PointResult, line: int) -> list[dict[str, str]]:
    """Cells of each patch: the side and roll that were solved, and `RESULT_COLUMNS`."""
    rows: list[dict[str, str]] = []
    count = {"right": 0, "left": 0}
    for patch in result.patches:
        count[patch.side] += 1
        cells = {"side": patch.side, "roll": _cell(result.roll * 1e3)}
        cells |= {"table_line": str(line), "patch": str(count[patch.side])}
        speed = result.rotation_speed
        cells[_ROTATION] = "" if speed is None else _cell(speed * _ROTATION_FACTOR)
        cells |= {told: _cell(patch.values[name] * factor) for name, told, factor in _PATCH}
        rows.append(cells)
    return rows


def _cell(value: float) -> str:
    """Twelve digits: far beyond any tolerance, without the noise of the change of units."""
    return format(value, ".12g")


def as_json(result: PointResult) -> dict[str, Any]:
    """JSON value of a point, SI units."""
    point = result.point
    models = {"normal": point.settings.normal, "tangential": point.settings.tangential}
    return {
        "shift": point.shift,
        "yaw": point.yaw,
        "roll": result.roll,
        "wheel_load": point.load if point.vertical else None,
        "counterface_curvature": point.settings.curvature,
        "rotation_speed": result.rotation_speed,
        "patches": [{"side": patch.side} | patch.values | models for patch in result.patches],
    }


def row_json(result: PointResult, line: int, carried: Mapping[str, str]) -> dict[str, Any]:
    """JSON value of a row of a table: the point, its line and the carried columns."""
    value = as_json(result)
    patches = value.pop("patches")
    return value | {"line": line, "columns": dict(carried), "patches": patches}


def as_text(result: PointResult) -> str:
    """Table of the patches for people."""
    width = [max(len(title), 10) for title, *_ in _PRINTED]
    lines = ["side   " + "  ".join(title.rjust(w) for (title, *_), w in zip(_PRINTED, width, strict=True))]
    for patch in result.patches:
        cells = [
            format(patch.values[name] * factor, style).rjust(w)
            for (_, name, factor, style), w in zip(_PRINTED, width, strict=True)
        ]
        lines.append(f"{patch.side:5}  " + "  ".join(cells))
    return "\n".join([*lines, *_notes(result)])


def _notes(result: PointResult) -> list[str]:
    point = result.point
    side, kappa = point.settings.side, point.settings.curvature
    against = "rail" if kappa == 0.0 else f"roller of {1e3 / kappa:g} mm"
    count = "1 patch" if len(result.patches) == 1 else f"{len(result.patches)} patches"
    who = "both wheels" if side == "both" else f"{side} wheel"
    speed = result.rotation_speed
    turning = "creepages given" if speed is None else f"rotation {speed:.4f} rad/s"
    if speed is not None and isinstance(point.rotation, str):
        turning += f" ({point.rotation})"
    roll = f"roll {result.roll * 1e3:.4f} mrad" + (" (free)" if point.roll is None else "")
    return [
        f"{who} on {against}, {count}; {turning}; {roll}",
        f"{point.settings.normal}, {point.settings.tangential}; forces act on the wheel",
    ]
