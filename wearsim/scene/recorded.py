"""Records of simulated or measured runs: columns with stated units and signs become samples."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from wearsim.contact.patch import FloatArray
from wearsim.csv_tables import csv_table
from wearsim.errors import Fault, SceneError, listed, raise_any, shown
from wearsim.operation.recorded import Samples, samples_of
from wearsim.quantities import QUANTITIES
from wearsim.results.file import UNREADABLE
from wearsim.scene.models import FieldScene
from wearsim.toml_faults import LARGEST_TABLE, content_of, suggestion, text_of
from wearsim.whole_files import NETCDF_LOCK, signals_wait

_UNITS: dict[str, tuple[str, float]] = {
    "time_s": ("time", 1.0), "time_h": ("time", 3600.0), "distance_m": ("place", 1.0),
    "distance_km": ("place", 1e3), "speed_km_h": ("speed", 1 / 3.6), "speed_m_s": ("speed", 1.0),
    "shift_mm": ("shift", 1e-3), "shift_m": ("shift", 1.0), "yaw_mrad": ("yaw", 1e-3),
    "yaw_rad": ("yaw", 1.0),
    "curve_radius_m": ("curve_radius", 1.0), "track_curvature_per_m": ("track_curvature", 1.0),
    "track_curvature_per_km": ("track_curvature", 1e-3), "friction": ("friction", 1.0),
    "wheel_load_right_kN": ("wheel_load_right", 1e3), "wheel_load_right_N": ("wheel_load_right", 1.0),
    "wheel_load_left_kN": ("wheel_load_left", 1e3), "wheel_load_left_N": ("wheel_load_left", 1.0),
    "axle_torque_kN_m": ("axle_torque", 1e3), "axle_torque_N_m": ("axle_torque", 1.0),
}  # fmt: skip
"""Quantity and factor to SI of each key of [recorded.columns]."""

_SIGNS = {"yaw": "yaw_positive", "curve_radius": "curve_positive", "track_curvature": "curve_positive"}
_RANGES = {
    **{name: name for name in ("speed", "shift", "yaw", "friction", "axle_torque", "track_curvature")},
    **{f"wheel_load_{side}": "wheel_load" for side in ("right", "left")},
}
"""Quantity whose range a column must keep."""


def read_record(
    scene: FieldScene, path: Path, clearance: tuple[float | None, float | None]
) -> tuple[Samples, list[Fault]]:
    """Read the record of a scene: its samples, and warnings.

    Parameters
    ----------
    path : Path
        Of the record.
    clearance : pair
        Flange clearance of the right and the left wheel [m]: a wheelset that was recorded on other profiles
        may have run further.

    Raises
    ------
    SceneError
        With all faults.
    """
    section = scene.recorded
    assert section is not None
    where = ("recorded", "columns")
    faults = []
    columns_of = section.columns.given
    named = {_UNITS[key][0]: key for key in columns_of}
    for key in columns_of:
        if (other := named[_UNITS[key][0]]) != key:
            text = f"{key} and {other} are one quantity; delete one of them"
            faults.append(scene.fault((*where, key), text))
    for quantity, sign in _SIGNS.items():
        if quantity in named and getattr(section, sign) is None:
            text = (
                f'{named[quantity]} needs {sign} = "right" or "left" in [recorded]: '
                "signs are not guessed"
            )
            faults.append(scene.fault((*where, named[quantity]), text))
    constants = {"speed": section.speed_km_h, "friction": section.friction}
    for side in ("right", "left"):
        constants[f"wheel_load_{side}"] = section.load_kN
    missing = [name for name, value in constants.items() if value is None and name not in named]
    if "shift" not in named:
        missing.insert(0, "shift")
    if missing:
        text = (
            f"no column for {listed(missing)}; name one in [recorded.columns], or give "
            "the constant"
        )
        faults.append(scene.fault(where, text))
    if not {"time", "place"} & set(named):
        text = (
            "no distance: name a column for time_s or distance_m, for what distance "
            "each sample stands"
        )
        faults.append(scene.fault(where, text))
    raise_any(faults)
    columns = _columns(path)
    for key, name in columns_of.items():
        if name not in columns:
            text = f"{key} = {shown(name)} is no column of {section.file}; {suggestion(name, list(columns))}"
            faults.append(scene.fault((*where, key), text))
    raise_any(faults)
    values = {_UNITS[key][0]: columns[name] * _UNITS[key][1] for key, name in columns_of.items()}
    if "curve_radius" in values:  # 0 stands for straight track, too
        radius = values.pop("curve_radius")
        values["track_curvature"] = np.divide(1.0, radius, out=np.zeros(radius.size), where=radius != 0.0)
    for quantity, sign in {"shift": "shift_positive", **_SIGNS}.items():
        if quantity in values and getattr(section, sign) == "left":
            values[quantity] = -values[quantity]
    for quantity, value in values.items():
        if not np.isfinite(value).all():
            row = int(np.argmin(np.isfinite(value)))
            faults.append(Fault(f"row {row + 1}: {quantity} is not a number; leave out such rows", str(path)))
        elif quantity in _RANGES:
            known = QUANTITIES[_RANGES[quantity]]
            if quantity == "speed":  # standstill does not count
                value = value[np.abs(value) >= known.span[0] / known.shown_factor]
            ends = (value.min(), value.max()) if value.size else ()
            wrong = [text for one in ends if (text := known.fault(float(one), quantity))]
            faults += [Fault(f"{text}; check the unit of its column", str(path)) for text in wrong[:1]]
    count = next(iter(values.values())).size
    factors = {"speed": 1 / 3.6, "friction": 1.0, "wheel_load_right": 1e3, "wheel_load_left": 1e3}
    for name, one in (*constants.items(), ("friction_flange", section.friction_flange)):
        if one is not None and name not in values:
            values[name] = np.full(count, one * factors.get(name, 1.0))
    values.setdefault("yaw", np.full(count, 1e-3 * section.yaw_mrad))
    low, high = (np.inf if free is None else free for free in reversed(clearance))
    beyond = (values["shift"] > high) | (values["shift"] < -low)
    values["shift"] = np.clip(values["shift"], -low, high)
    if not faults:
        try:
            samples = samples_of(values)
        except ValueError as error:
            faults.append(Fault(f"{error}; give a record of a run", str(path)))
    raise_any(faults)
    notes = list(samples.notes)
    if beyond.any():
        notes.append(
            f"{100.0 * beyond.mean():.3g} % of the samples lie beyond the flange "
            "clearance; moved to it"
        )
    file = ("recorded", "file")
    return samples, [scene.fault(file, f"file = {shown(section.file)}: {note}") for note in notes]


@signals_wait()
def _columns(path: Path) -> dict[str, FloatArray]:
    """Columns of a CSV or netCDF file by name; a cell that is no number is NaN."""
    if path.suffix.lower() in (".nc", ".nc4"):
        import xarray as xr

        try:
            with NETCDF_LOCK, xr.open_dataset(path, decode_times=False) as data:
                flat = [name for name in data.variables if data[name].ndim == 1]
                if sum(data[name].nbytes for name in flat) > LARGEST_TABLE:
                    raise ValueError("it is too large")
                if len({data[name].size for name in flat}) > 1:
                    raise ValueError("its variables have unlike lengths")
                return {str(name): data[name].values.astype(float) for name in flat}
        except UNREADABLE as error:
            text = f"cannot be read as netCDF ({error}); give a CSV file"
            raise SceneError([Fault(text, str(path))]) from None
    text = text_of(content_of(path, "a CSV file", LARGEST_TABLE), str(path))
    table = csv_table(text, str(path))
    raise_any(table.faults)
    if len(table.rows) < 2:
        raise SceneError([Fault("holds no samples; give a header and a row for each", str(path))])
    return {name: np.array([_number(row[k]) for _, row in table.rows]) for k, name in enumerate(table.header)}


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return np.nan
