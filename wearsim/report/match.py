"""Text and tables of a contact of the field that is matched on a rig."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from wearsim.studies.match import ACTUATORS, ERRORS, WORDS
from wearsim.texts import text_table, wrapped

_WHEEL = {
    "max_pressure": ("largest pressure", 1e-6, "MPa"),
    "wear_number": ("wear number", 1.0, "N"),
    "place": ("place of contact", 1e3, "mm"),
    "area": ("area", 1e6, "mm2"),
    "contact_angle": ("contact angle", 1e3, "mrad"),
    "creepage_x": ("longitudinal creepage", 1e3, "1e-3"),
    "creepage_y": ("lateral creepage", 1e3, "1e-3"),
    "spin": ("spin", 1.0, "1/m"),
}
_ERRORS = {
    "shift": "shift 0.1 mm",
    "yaw": "yaw 0.2 mrad",
    "wheel_load": "load 1 %",
    "speed_difference": "difference 0.1 %",
}
_STATES = ("field", "copied", "matched")


def match_lines(made: xr.Dataset) -> list[str]:
    """Lines of a dataset of `wearsim.match_contact`, in 100 columns."""
    table = [["", *_STATES, "limits of the rig"]]
    for name, (word, factor, unit) in WORDS.items():
        cells = [_number(factor * value) for value in made[name].values]
        of = made.sel(actuator=name)
        low, high = (factor * float(of[end]) for end in ("low", "high"))
        limits = f"{low:.4g} to {high:.4g}" if high > low else f"{low:.4g}, fixed"
        if not int(of["controlled"]):
            limits = "not controlled"
        table.append([f"{word} [{unit}]", *cells, limits])
    for wheel in made["wheel"].values:
        table.append([f"{wheel} wheel", "", "", "", ""])
        for name, (word, factor, unit) in _WHEEL.items():
            row = factor * made[name].sel(wheel=wheel).values
            mark = " *" if name in made["quantity"].values else ""
            table.append([f"  {word} [{unit}]{mark}", *map(_number, row), ""])
    lines = [f"rig: {made.attrs['rig']}", *text_table(table)]
    lines += [
        "* to be matched, within 1 % of pressure and wear number, 0.5 mm of place",
        "",
    ]
    lines += _sensitivity_lines(made)
    return [*lines, "", *(wrapped(line) for line in verdict(made))]


def verdict(made: xr.Dataset) -> list[str]:
    """Sentences on what is matched, limits that bind, and the missing actuator."""
    sentences = ["matched"] if made.attrs["reached"] else [f"not matched: {_off(made)}"]
    sentences += [f"limit that binds: {line}" for line in _split(made, "limits")]
    sentences += [f"missing actuator: {line}" for line in _split(made, "missing")]
    if unlike := int(made.attrs["unlike_creepages"]):
        sentences.append(f"creepages of other sign than in the field: {unlike}")
    if made.attrs["copy_reason"]:
        sentences.append(
            f"the copied set-point has no contact: {made.attrs['copy_reason']}"
        )
    return sentences + [f"note: {line}" for line in _split(made, "wheels")]


def _split(made: xr.Dataset, name: str) -> list[str]:
    return [line for line in str(made.attrs[name]).split("\n") if line]


def _off(made: xr.Dataset) -> str:
    """List the quantities beyond their tolerance, and by how much."""
    parts = []
    for wheel in made["wheel"].values:
        for name in made["quantity"].values:
            off = float(made["difference"].sel(wheel=wheel, quantity=name))
            if abs(off) <= made.attrs[f"tolerance_{name}"]:
                continue
            if name == "place":
                to = "field side" if off > 0.0 else "flange"
                how = f"{1e3 * abs(off):.3g} mm to the {to}"
            else:
                how = f"{100.0 * abs(off):.3g} % too {'high' if off > 0.0 else 'low'}"
            parts.append(f"{_WHEEL[name][0]} of the {wheel} wheel {how}")
    return "; ".join(parts)


def _sensitivity_lines(made: xr.Dataset) -> list[str]:
    """Table of the change of each matched quantity by the error of each set-point."""
    has_sensitivity = made["sensitivity"].notnull().any(["quantity", "wheel"])
    names = made["actuator"].values[has_sensitivity.values].tolist()
    table = [["change by an error of", *(_ERRORS[name] for name in names)]]
    for wheel in made["wheel"].values:
        for name in made["quantity"].values:
            row = made["sensitivity"].sel(wheel=wheel, quantity=name)
            cells = [
                _change(name, float(row.sel(actuator=actuator))) for actuator in names
            ]
            table.append([f"  {_WHEEL[name][0]}, {wheel} wheel", *cells])
    return text_table(table)


def _change(name: str, value: float) -> str:
    if not np.isfinite(value):
        return "-"
    return f"{1e3 * value:.2g} mm" if name == "place" else f"{100.0 * value:.2g} %"


def _changes(made: xr.Dataset, quantity: str, wheel: str) -> list[float]:
    """Return the changes of a quantity of a wheel by the error of each set-point."""
    change = made["sensitivity"].sel(quantity=quantity, wheel=wheel)
    return [float(value) for value in change.values]


def _number(value: float) -> str:
    return f"{value + 0.0:.4g}" if np.isfinite(value) else "-"


def match_table(made: xr.Dataset) -> pd.DataFrame:
    """Table of set-points and quantities of each wheel, in SI units.

    Set-points have the ends of their ranges, matched quantities the changes by the
    error of each set-point; what does not apply is empty.
    """
    rows: list[dict[str, Any]] = []
    for name in ACTUATORS:
        of = made.sel(actuator=name)
        row = {"quantity": name, "unit": made[name].attrs["units"], "wheel": ""}
        row |= dict(zip(_STATES, made[name].values.tolist(), strict=True))
        rows.append(row | {end: float(of[end]) for end in ("low", "high")})
    for wheel in made["wheel"].values.tolist():
        for name in _WHEEL:
            contact = made[name].sel(wheel=wheel)
            row = {"quantity": name, "unit": contact.attrs["units"], "wheel": wheel}
            row |= dict(zip(_STATES, contact.values.tolist(), strict=True))
            if name in made["quantity"].values:
                keys = [f"change_by_{actuator}" for actuator in ACTUATORS]
                row |= dict(zip(keys, _changes(made, name, wheel), strict=True))
            rows.append(row)
    return pd.DataFrame(rows)


def match_record(made: xr.Dataset) -> dict[str, Any]:
    """Numbers of a match for JSON, in SI units; NaN where there is none."""
    states = {}
    for k, state in enumerate(_STATES):
        of = made.isel(state=k)
        wheels = {
            wheel: {name: float(of[name].sel(wheel=wheel)) for name in _WHEEL}
            for wheel in made["wheel"].values.tolist()
        }
        states[state] = {name: float(of[name]) for name in ACTUATORS} | {
            "wheels": wheels
        }
    limits = {
        name: {
            "low": float(made["low"].sel(actuator=name)),
            "high": float(made["high"].sel(actuator=name)),
            "controlled": bool(made["controlled"].sel(actuator=name)),
        }
        for name in ACTUATORS
    }
    by_wheel = {
        wheel: {
            name: {
                "difference": float(made["difference"].sel(quantity=name, wheel=wheel)),
                "sensitivity": dict(
                    zip(ACTUATORS, _changes(made, name, wheel), strict=True)
                ),
            }
            for name in made["quantity"].values.tolist()
        }
        for wheel in made["wheel"].values.tolist()
    }
    return {
        "rig": made.attrs["rig"],
        "matched": bool(made.attrs["reached"]),
        "states": states,
        "limits": limits,
        "errors": ERRORS,
        "quantities": by_wheel,
        "verdict": verdict(made),
    }
