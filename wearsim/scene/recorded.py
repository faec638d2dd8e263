"""[recorded]: samples of a simulated or measured run, in place of classes of track."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from pydantic import Field

from wearsim.contact.patch import FloatArray
from wearsim.csv_tables import csv_table
from wearsim.errors import Fault, SceneError, listed, raise_any, shown
from wearsim.operation.recorded import Samples, samples_of
from wearsim.quantities import QUANTITIES
from wearsim.results.file import UNREADABLE
from wearsim.scene.section import Messages, Section, Text, quantity, text_field
from wearsim.table_layout import contradicts
from wearsim.toml_faults import LARGEST_TABLE, KeyPath, content_of, suggestion
from wearsim.whole_files import NETCDF_LOCK, signals_wait

_UNITS: dict[str, tuple[str, float]] = {
    "time_s": ("time", 1.0),
    "time_h": ("time", 3600.0),
    "distance_m": ("place", 1.0),
    "distance_km": ("place", 1e3),
    "speed_km_h": ("speed", 1 / 3.6),
    "speed_m_s": ("speed", 1.0),
    "shift_mm": ("shift", 1e-3),
    "shift_m": ("shift", 1.0),
    "yaw_mrad": ("yaw", 1e-3),
    "yaw_rad": ("yaw", 1.0),
    "curve_radius_m": ("curve_radius", 1.0),
    "track_curvature_per_m": ("track_curvature", 1.0),
    "track_curvature_per_km": ("track_curvature", 1e-3),
    "friction": ("friction", 1.0),
    "wheel_load_right_kN": ("wheel_load_right", 1e3),
    "wheel_load_right_N": ("wheel_load_right", 1.0),
    "wheel_load_left_kN": ("wheel_load_left", 1e3),
    "wheel_load_left_N": ("wheel_load_left", 1.0),
    "lateral_force_right_kN": ("lateral_force_right", 1e3),
    "lateral_force_right_N": ("lateral_force_right", 1.0),
    "lateral_force_left_kN": ("lateral_force_left", 1e3),
    "lateral_force_left_N": ("lateral_force_left", 1.0),
    "axle_torque_kN_m": ("axle_torque", 1e3),
    "axle_torque_N_m": ("axle_torque", 1.0),
}
"""Quantity and factor to SI of each key of [recorded.columns]."""

_SIGNS = {
    "shift": "shift_positive",
    "yaw": "yaw_positive",
    "lateral_force_right": "lateral_force_positive",
    "lateral_force_left": "lateral_force_positive",
    "curve_radius": "curve_positive",
    "track_curvature": "curve_positive",
}
_RANGES = {
    **{
        name: name
        for name in (
            "speed",
            "shift",
            "yaw",
            "friction",
            "axle_torque",
            "track_curvature",
        )
    },
    **{f"wheel_load_{side}": "wheel_load" for side in ("right", "left")},
    **{f"lateral_force_{side}": "lateral_force" for side in ("right", "left")},
}
"""Quantity whose range a column must keep."""

_REQUIRED = ("speed", "friction", "wheel_load_right", "wheel_load_left")
"""Quantities that a column or a key of [recorded] has to give, besides the shift."""
_FORCES = ("lateral_force_right", "lateral_force_left")
"""Quantities that an instrumented wheelset records in place of the shift."""
_COLUMNS = ("recorded", "columns")


class RecordColumns(Section):
    """[recorded.columns]: the column of the file by quantity, with its unit; what has
    none is constant.
    """

    time_s: Text | None = text_field("the time", None)
    time_h: Text | None = text_field("the time", None)
    distance_m: Text | None = text_field("the distance run", None)
    distance_km: Text | None = text_field("the distance run", None)
    speed_km_h: Text | None = text_field("the speed", None)
    speed_m_s: Text | None = text_field("the speed", None)
    shift_mm: Text | None = text_field("the lateral shift", None)
    shift_m: Text | None = text_field("the lateral shift", None)
    yaw_mrad: Text | None = text_field("the yaw", None)
    yaw_rad: Text | None = text_field("the yaw", None)
    curve_radius_m: Text | None = text_field(
        "the curve radius, 0 on straight track, too", None
    )
    track_curvature_per_m: Text | None = text_field("the track curvature", None)
    track_curvature_per_km: Text | None = text_field("the track curvature", None)
    friction: Text | None = text_field("the coefficient of friction", None)
    wheel_load_right_kN: Text | None = text_field(
        "the vertical load of the right wheel", None
    )
    wheel_load_right_N: Text | None = text_field(
        "the vertical load of the right wheel", None
    )
    wheel_load_left_kN: Text | None = text_field(
        "the vertical load of the left wheel", None
    )
    wheel_load_left_N: Text | None = text_field(
        "the vertical load of the left wheel", None
    )
    lateral_force_right_kN: Text | None = text_field(
        "the lateral force of the right wheel on its rail, in place of the shift", None
    )
    lateral_force_right_N: Text | None = text_field(
        "the lateral force of the right wheel on its rail, in place of the shift", None
    )
    lateral_force_left_kN: Text | None = text_field(
        "the lateral force of the left wheel on its rail, in place of the shift", None
    )
    lateral_force_left_N: Text | None = text_field(
        "the lateral force of the left wheel on its rail, in place of the shift", None
    )
    axle_torque_kN_m: Text | None = text_field("the torque on the axle", None)
    axle_torque_N_m: Text | None = text_field("the torque on the axle", None)

    @property
    def given(self) -> dict[str, str]:
        """Columns by key, of those that are given."""
        return {
            key: name
            for key in type(self).model_fields
            if (name := getattr(self, key)) is not None
        }


class RecordedSection(Section):
    """[recorded]: samples of a simulated or measured run, in place of classes."""

    file: Text = text_field("the CSV or netCDF file of the samples")
    columns: RecordColumns
    shift_positive: Literal["right", "left"] | None = Field(
        None, description="to which side shifts count positive"
    )
    yaw_positive: Literal["right", "left"] | None = Field(
        None, description="to which side the yaw counts positive"
    )
    curve_positive: Literal["right", "left"] | None = Field(
        None, description="which curves count positive"
    )
    load_sign: Literal["positive", "negative"] = Field(
        "positive",
        description="the sign of a wheel load that presses the wheel on the rail; "
        "negative for forces on the wheel with z down",
    )
    lateral_force_positive: Literal["right", "left", "outwards", "inwards"] | None = (
        Field(
            None,
            description="to which side the lateral force of a wheel on its rail counts "
            "positive; outwards: away from the track centre on both rails",
        )
    )
    smooth_m: float | None = quantity(
        "motion_wavelength",
        None,
        "the wavelength below which shift and yaw are smoothed before their rates are "
        "taken, by default 2 m, at least 4 distances of samples",
    )
    load_kN: float | None = quantity(
        "wheel_load", None, "the vertical load of each wheel, if no column has it"
    )
    speed_km_h: float | None = quantity("speed", None, "the speed, if no column has it")
    yaw_mrad: float = quantity(
        "yaw", 0.0, "the yaw of the wheelset, if no column has it"
    )
    friction: float | None = quantity(
        "friction", None, "Coulomb's coefficient, if no column has it"
    )
    friction_flange: float | None = quantity("friction_flange", None)
    environment: float = quantity(
        "environment",
        1.0,
        "the factor on the wear depth, 1 for dry laboratory coefficients",
    )
    binning_tolerance: float = quantity(
        "binning_error",
        0.02,
        "the largest error of the wear of the operating points that stand for all "
        "samples",
    )


Record = dict[str, FloatArray]
"""Values (n,) of a record by quantity [SI], constant ones where no column has them."""


def read_record(
    section: RecordedSection, path: Path, fault: Callable[[KeyPath, str], Fault]
) -> Record:
    """Read the record of a scene; `fault` makes the faults of its keys.

    Raises
    ------
    SceneError
        With all faults of [recorded], else of the names of its columns, else of values.
    """
    raise_any([fault(*message) for message in recorded_faults(section)])
    columns = _columns(path)
    raise_any([fault(*message) for message in _name_faults(section, columns)])
    record = _in_si(section, columns.values)
    faults = _value_faults(section, record, columns.lines)
    raise_any([Fault(text, str(path), line) for text, line in faults])
    if set(_FORCES) <= record.keys():
        right, left = (record.pop(name) for name in _FORCES)
        record["lateral_force"] = right + left
    return _with_constants(section, record)


def recorded_faults(section: RecordedSection) -> Messages:
    """Path and message of what does not fit together within [recorded]."""
    keys = section.columns.given
    named = {_UNITS[key][0]: key for key in keys}
    forces = [name for name in _FORCES if name in named]
    for key in keys:
        if (second_key := named[_UNITS[key][0]]) != key:
            text = f"{key} and {second_key} are one quantity; delete one of them"
            yield (*_COLUMNS, key), text
    for name, sign in _SIGNS.items():
        if name in named and getattr(section, sign) is None:
            key = named[name]
            text = (
                f'{key} needs {sign} = "right" or "left" in [recorded]: the sign '
                "convention is stated, not guessed"
            )
            if name in _FORCES:
                text += "; outwards and inwards count from the track centre"
            yield (*_COLUMNS, key), text
    if len(forces) == 1 or (forces and "shift" in named):
        text = (
            "lateral forces of both wheels stand in place of the shift; name either "
            "the columns of both forces, or that of the shift"
        )
        yield (*_COLUMNS, named[forces[0]]), text
    constants = _constants(section)
    missing = [
        name for name in _REQUIRED if name not in named and name not in constants
    ]
    if "shift" not in named and not forces:
        text = (
            "no column for shift; name shift_mm in [recorded.columns], or, of an "
            "instrumented wheelset, lateral_force_right_kN and lateral_force_left_kN"
        )
        yield _COLUMNS, text
    if missing:
        text = (
            f"no column for {listed(missing)}; name one in [recorded.columns], or give "
            "the constant"
        )
        yield _COLUMNS, text
    if not {"time", "place"} & set(named):
        text = (
            "no distance: name a column for time_s or distance_m, for what distance "
            "each sample stands"
        )
        yield _COLUMNS, text


class _Columns(NamedTuple):
    """Columns of a file by name, the lines of its rows, and units that it states."""

    values: dict[str, FloatArray]
    lines: Sequence[int] = ()
    units: Mapping[str, str] = {}


def _name_faults(section: RecordedSection, columns: _Columns) -> Messages:
    """Faults of columns that the file does not have, or has in another unit."""
    for key, name in section.columns.given.items():
        if name not in columns.values:
            hint = suggestion(name, list(columns.values))
            text = f"{key} = {shown(name)} is no column of {section.file}; {hint}"
            yield (*_COLUMNS, key), text
        elif contradicts(key, unit := columns.units.get(name, "")):
            text = (
                f"{key} = {shown(name)}: {section.file} states the unit "
                f"{unit.strip('[]()')}; name the column for the key of that unit"
            )
            yield (*_COLUMNS, key), text


def _in_si(section: RecordedSection, columns: Mapping[str, FloatArray]) -> Record:
    """Values of the columns that are named, with the signs of wearsim [SI]."""
    record: Record = {}
    for key, name in section.columns.given.items():
        quantity_name, factor = _UNITS[key]
        record[quantity_name] = columns[name] * factor
    if "curve_radius" in record:  # 0 stands for straight track, too
        radius = record.pop("curve_radius")
        straight = np.zeros(radius.size)
        curved = radius != 0.0
        record["track_curvature"] = np.divide(1.0, radius, out=straight, where=curved)
    for name, sign in _SIGNS.items():
        side = getattr(section, sign)
        left = name.endswith("_left")  # whose outer side is the left
        if name in record and (
            side == "left"
            or (side == "outwards" and left)
            or (side == "inwards" and not left)
        ):
            record[name] = -record[name]
    if section.load_sign == "negative":
        for name in ("wheel_load_right", "wheel_load_left"):
            if name in record:
                record[name] = -record[name]
    return record


def _value_faults(
    section: RecordedSection, record: Record, lines: Sequence[int]
) -> Iterator[tuple[str, int | None]]:
    """Messages on values that are no numbers or out of range, with their lines."""
    keys = {_UNITS[key][0]: (key, name) for key, name in section.columns.given.items()}
    for name, values in record.items():
        finite = np.isfinite(values)
        key, column = keys.get(name, (name, name))
        if not finite.all():
            row = int(np.argmin(finite))
            count = int((~finite).sum())
            more = f" (and {count - 1} more rows)" if count > 1 else ""
            text = (
                f"column {shown(column)}: {name} is not a number in row {row + 1}"
                f"{more}; leave out such rows"
            )
            yield text, lines[row] if lines else None
        elif name.startswith("wheel_load") and (values <= 0.0).all():
            given = section.load_sign
            sign = "negative" if given == "positive" else "positive"
            text = (
                f"column {shown(column)}: all loads of {key} press away from the rail "
                f"by load_sign = {shown(given)}; write load_sign = {shown(sign)} in "
                "[recorded]"
            )
            yield text, None
        elif name in _RANGES:
            column_quantity = QUANTITIES[_RANGES[name]]
            if name == "speed":  # standstill does not count
                slowest = column_quantity.span[0] / column_quantity.shown_factor
                values = values[np.abs(values) >= slowest]
            ends = (values.min(), values.max()) if values.size else ()
            texts = (column_quantity.fault(float(end), name) for end in ends)
            if text := next(filter(None, texts), ""):
                yield f"column {shown(column)}: {text}; check its unit", None


def _constants(section: RecordedSection) -> dict[str, float]:
    """Values of [recorded] that hold where no column has the quantity [SI]."""
    load, speed = section.load_kN, section.speed_km_h
    given = {
        "speed": None if speed is None else speed * (1 / 3.6),
        "friction": section.friction,
        "wheel_load_right": None if load is None else load * 1e3,
        "wheel_load_left": None if load is None else load * 1e3,
        "friction_flange": section.friction_flange,
    }
    return {name: value for name, value in given.items() if value is not None}


def _with_constants(section: RecordedSection, record: Record) -> Record:
    count = next(iter(record.values())).size
    constants = {**_constants(section), "yaw": 1e-3 * section.yaw_mrad}
    missing = {name: value for name, value in constants.items() if name not in record}
    return record | {name: np.full(count, value) for name, value in missing.items()}


def samples_of_record(
    record: Record,
    path: Path,
    clearance: tuple[float | None, float | None],
    wavelength: float | None = None,
) -> tuple[Samples, list[str]]:
    """Make samples of a record, and notes on it.

    Parameters
    ----------
    record : dict
        Of `read_record`.
    path : Path
        Of the record, for faults.
    clearance : pair
        Flange clearance of the right and the left wheel [m]: a wheelset that was
        recorded on other profiles may have run further.
    wavelength : float, optional
        Below which the motion is smoothed, see `samples_of` [m].

    Raises
    ------
    SceneError
        If no distance is run.
    """
    right, left = (np.inf if free is None else free for free in clearance)
    beyond = np.zeros(0, dtype=bool)
    if "shift" in record:
        shift = record["shift"]
        beyond = (shift > right) | (shift < -left)
        record = {**record, "shift": np.clip(shift, -left, right)}
    try:
        samples = samples_of(record, wavelength)
    except ValueError as error:
        text = f"{error}; give a record of a run"
        raise SceneError([Fault(text, str(path))]) from None
    notes = list(samples.notes)
    if beyond.any():
        notes.append(
            f"{100.0 * beyond.mean():.3g} % of the samples lie beyond the flange "
            "clearance; moved to it"
        )
    if "lateral_force" in record:
        notes.append(
            "the shift follows from the lateral force of both wheels, with a lateral "
            "velocity of 0"
        )
    return samples, notes


@signals_wait()
def _columns(path: Path) -> _Columns:
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
                units = {str(name): data[name].attrs.get("units", "") for name in flat}
                values = {str(name): data[name].values.astype(float) for name in flat}
                return _Columns(values, units={k: str(v) for k, v in units.items()})
        except UNREADABLE as error:
            text = f"cannot be read as netCDF ({error}); give a CSV file"
            raise SceneError([Fault(text, str(path))]) from None
    table = csv_table(content_of(path, "a CSV file", LARGEST_TABLE), str(path))
    raise_any(table.faults)
    if len(table.rows) < 2:
        raise SceneError(
            [Fault("holds no samples; give a header and a row for each", str(path))]
        )
    values = {
        name: np.array([_number(row[k]) for _, row in table.rows])
        for k, name in enumerate(table.header)
    }
    return _Columns(values, [line for line, _ in table.rows], table.units)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return np.nan
