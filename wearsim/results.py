"""The result file of a campaign: netCDF-4 after CF-1.11, one row per wear step.

A campaign creates the file once, then opens, appends one row and closes it at each step, so that the
file can be read at any time between steps.  Quantities, units and long names come from
`wearsim.nomenclature`; the dimensions of each variable stand in `LAYOUT` below.  Readers use
`open_results`, which gives a lazy xarray Dataset.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import netCDF4
import numpy as np

from wearsim.errors import NumericalError, ResultError
from wearsim.nomenclature import NOMENCLATURE

if TYPE_CHECKING:
    import xarray as xr

SCHEMA = 1
PATCH_SLOTS = 8
RETRY_SECONDS = 1.5

FILL_FLOAT = float(netCDF4.default_fillvals["f8"])
FILL_INT = int(netCDF4.default_fillvals["i4"])

_T = TypeVar("_T")


@dataclass(frozen=True)
class Variable:
    """Place of one variable in the file.

    Parameters
    ----------
    dimensions : tuple of str
        Names of its dimensions, `step` first where it has one.
    kind : {"f8", "i4", "str"}
        Stored type.
    missing : bool
        Whether values may be missing (no patch in the slot, quantity undefined).
    """

    dimensions: tuple[str, ...]
    kind: str = "f8"
    missing: bool = False


def _layout() -> dict[str, Variable]:
    wheel = ("step", "wheel")
    along = (*wheel, "point")
    patch = ("step", "operating_point", "patch")
    layout = {
        "wheel_name": Variable(("wheel",), "str"),
        "regime_name": Variable(("regime",), "str"),
        "op_label": Variable(("operating_point",), "str"),
        "arc_length": Variable(("point",)),
        "counterface_y": Variable(("counterface_point",)),
        "counterface_z": Variable(("counterface_point",)),
    }
    for name in [
        "shift",
        "yaw",
        "roll",
        "wheel_load",
        "speed",
        "friction",
        "track_curvature",
        "environment",
        "weight",
        "block_length",
    ]:
        layout[f"op_{name}"] = Variable(("operating_point",))
    for name in ("distance", "step_length", "stability_number"):
        layout[name] = Variable(("step",))
    layout["active_weight"] = Variable(("step", "operating_point"))
    for name in ("profile_y", "profile_z", "wear_depth", "friction_work"):
        layout[name] = Variable(along)
    layout["wear_depth_by_regime"] = Variable(("step", "wheel", "regime", "point"))
    for name in ("flange_height", "flange_thickness", "flange_gradient", "hollowing"):
        layout[name] = Variable(wheel, missing=True)
    for name in ("worn_area", "worn_mass", "max_wear_depth"):
        layout[name] = Variable(wheel)
    layout["equivalent_conicity"] = Variable(("step",), missing=True)
    layout["n_patch"] = Variable(("step", "operating_point"), "i4")
    layout["patch_side"] = Variable(patch, "i4", missing=True)
    for name in [
        "wheel_y",
        "rail_y",
        "contact_x",
        "contact_angle",
        "area",
        "max_pressure",
        "patch_length",
        "patch_width",
        "approach",
        "normal_force",
        "creepage_x",
        "creepage_y",
        "spin",
        "force_x",
        "force_y",
        "spin_moment",
        "slip_area",
        "power",
        "power_balance",
        "wear_index_mean",
        "wear_index_max",
    ]:
        layout[name] = Variable(patch, missing=True)
    layout["wear_regime"] = Variable(patch, "i4", missing=True)
    return layout


LAYOUT: Mapping[str, Variable] = _layout()
"""All variables of a result file."""

STATIC = tuple(name for name, variable in LAYOUT.items() if "step" not in variable.dimensions)
"""Names of the variables that are written once."""

ROW = tuple(name for name, variable in LAYOUT.items() if "step" in variable.dimensions)
"""Names of the variables of one row."""

COORDINATES = ("distance", "wheel_name", "regime_name", "op_label", "arc_length")
"""Coordinates; they never carry a fill value."""


@dataclass(frozen=True)
class Header:
    """All of a result file that does not change from step to step.

    Parameters
    ----------
    static : mapping
        The variables named in `STATIC`: arrays [SI units], or sequences of str.
    attributes : mapping
        Global attributes, str or number; empty ones are not written.
    """

    static: Mapping[str, Any]
    attributes: Mapping[str, str | int | float]

    @property
    def sizes(self) -> dict[str, int]:
        """Lengths of all fixed dimensions."""
        sizes = {"patch": PATCH_SLOTS}
        for name in STATIC:
            sizes[LAYOUT[name].dimensions[0]] = len(self.static[name])
        return sizes


Row = Mapping[str, np.ndarray]
"""The variables named in `ROW` for one step, without the step axis; missing values are fill values."""


def check_row(header: Header, row: Row) -> None:
    """Raise unless `row` has exactly the variables of the schema, in shape and free of NaN.

    Parameters
    ----------
    header : Header
        Of the file the row is for.
    row : mapping of arrays
        See `Row`.
    """
    sizes = header.sizes
    if set(row) != set(ROW):
        wrong = ", ".join(sorted(set(row) ^ set(ROW)))
        raise ResultError(f"a result row must have exactly the variables of the schema; check {wrong}")
    for name in ROW:
        value = np.asarray(row[name])
        shape = tuple(sizes[d] for d in LAYOUT[name].dimensions[1:])
        if value.shape != shape:
            raise ResultError(f"result variable {name} has shape {value.shape} where {shape} is needed")
        if not np.all(np.isfinite(value)):
            place = tuple(int(i) for i in np.argwhere(~np.isfinite(value))[0])
            raise NumericalError(
                f"{name}{list(place)} is not a finite number; nothing was written, the last step is safe"
            )


def create(path: Path, header: Header, rows: Iterable[Row] = ()) -> None:
    """Write a result file with `rows`, atomically: `path` is the whole new file or what it was.

    Parameters
    ----------
    path : Path
        Result file; replaced if it exists.
    header : Header
        Static part.
    rows : iterable of mappings
        First rows, see `Row`; taken one at a time.
    """
    temporary = path.with_name(f".{path.name}.tmp")
    try:
        temporary.unlink(missing_ok=True)
        with netCDF4.Dataset(temporary, "w", format="NETCDF4") as file:
            _define(file, header)
            for index, row in enumerate(rows):
                check_row(header, row)
                _write_row(file, index, row)
        with open(temporary, "rb") as written:
            os.fsync(written.fileno())
        os.replace(temporary, path)
    except OSError as error:
        raise ResultError(f"{path} cannot be written: {_reason(error)}; choose another --out") from error


def append(
    path: Path, header: Header, rows: Sequence[Row], first: int, patience: float = RETRY_SECONDS
) -> None:
    """Append rows to a result file: open, write, close.

    Parameters
    ----------
    path : Path
        Result file with `first` rows.
    header : Header
        Its static part.
    rows : sequence of mappings
        Rows `first`, `first` + 1, ...
    first : int
        Index of the first row to write.
    patience : float
        How long to retry while a reader holds the file [s].

    Raises
    ------
    OSError
        If a reader holds the file longer than that, or the file is damaged; nothing was written then.
    """

    def write() -> None:
        with netCDF4.Dataset(path, "a") as file:
            for offset, row in enumerate(rows):
                _write_row(file, first + offset, row)

    for row in rows:
        check_row(header, row)
    _with_retries(write, patience)


def set_attribute(path: Path, name: str, value: str) -> None:
    """Set one global attribute of a result file.

    Parameters
    ----------
    path : Path
        Result file.
    name, value : str
        Attribute.
    """

    def write() -> None:
        with netCDF4.Dataset(path, "a") as file:
            file.setncattr(name, value)

    _with_retries(write)


def row_count(path: Path) -> int:
    """Return how many rows (wear steps + 1) a result file has.

    Parameters
    ----------
    path : Path
        Result file.

    Raises
    ------
    ResultError
        If it is missing, damaged or not a result of wearsim.
    """
    with _open(path) as file:
        return len(file.dimensions["step"])


def read_row(path: Path, index: int) -> dict[str, np.ndarray]:
    """Read one row with its fill values.

    Parameters
    ----------
    path : Path
        Result file.
    index : int
        Step.
    """
    with _open(path) as file:
        return {name: np.asarray(file.variables[name][index]) for name in ROW}


def verify(path: Path, rows: Sequence[Callable[[], Row]]) -> int | None:
    """Count the rows of a file that holds exactly the first of `rows`, bit by bit.

    Parameters
    ----------
    path : Path
        Result file.
    rows : sequence of functions
        Each gives one expected row (they are read one at a time: a campaign need not fit in memory).

    Returns
    -------
    int or None
        How many rows the file has; None if it is missing, damaged, longer or different in any bit.
    """
    try:
        with _open(path) as file:
            count = len(file.dimensions["step"])
            if count > len(rows):
                return None
            for index in range(count):
                expected = rows[index]()
                for name in ROW:
                    if not np.array_equal(np.asarray(file.variables[name][index]), expected[name]):
                        return None
            return count
    except (ResultError, OSError, RuntimeError, KeyError, IndexError):
        return None


def open_results(path: str | Path) -> xr.Dataset:
    """Open a result file as a lazy xarray Dataset, also while the campaign is running.

    Parameters
    ----------
    path : str or Path
        A `.nc` file that a campaign wrote.

    Returns
    -------
    xarray.Dataset
        SI units, `units` and `long_name` on every variable; empty patch slots and undefined
        quantities are NaN.  Values are read when they are used: `.load()` brings them all, and frees the
        file for the writer of a running campaign when used as a context manager.
    """
    import xarray as xr

    path = Path(path)
    with _open(path) as file:
        # a row that a killed writer cut short has no distance; the campaign mends it when resumed
        sound = int(np.count_nonzero(np.asarray(file.variables["distance"][:]) < FILL_FLOAT))
    dataset = _with_retries(lambda: xr.open_dataset(path, engine="netcdf4"))
    return dataset if dataset.sizes["step"] == sound else dataset.isel(step=slice(0, sound))


def _open(path: Path) -> netCDF4.Dataset:
    """Open for reading, exact values unmasked, or tell what is wrong with the file."""
    if not path.exists():
        raise ResultError(f"{path} does not exist; `wearsim run SCENE --out DIR` writes result files")
    if not path.is_file():
        raise ResultError(f"{path} is not a file; give a .nc file that `wearsim run` wrote")
    try:
        file = _with_retries(lambda: netCDF4.Dataset(path, "r"))
    except (OSError, RuntimeError) as error:
        raise ResultError(
            f"{path} cannot be read as netCDF: {_reason(error)}; a damaged file is rebuilt by "
            f"`wearsim resume {path.parent}` while its campaign is unfinished"
        ) from error
    file.set_auto_maskandscale(False)
    missing = [name for name in LAYOUT if name not in file.variables]
    if "wearsim_schema" not in file.ncattrs() or missing:
        file.close()
        raise ResultError(
            f"{path} is not a result file of a wearsim campaign; give a .nc that `wearsim run` wrote"
        )
    schema = int(file.getncattr("wearsim_schema"))
    if schema > SCHEMA:
        file.close()
        raise ResultError(f"{path} has schema {schema}, this wearsim reads up to {SCHEMA}; update wearsim")
    return file


def _define(file: netCDF4.Dataset, header: Header) -> None:
    file.createDimension("step", None)
    for name, size in header.sizes.items():
        file.createDimension(name, size)
    attributes = {"Conventions": "CF-1.11", "wearsim_schema": np.int32(SCHEMA), **header.attributes}
    for name, value in attributes.items():
        if value != "":
            file.setncattr(name, value)
    for name, variable in LAYOUT.items():
        _define_variable(file, name, variable, header)
    for name in STATIC:
        value = header.static[name]
        if LAYOUT[name].kind == "str":
            file.variables[name][:] = np.array([str(text) for text in value], dtype=object)
        else:
            file.variables[name][:] = np.asarray(value, dtype=np.float64)
    file.set_auto_maskandscale(False)


def _define_variable(file: netCDF4.Dataset, name: str, variable: Variable, header: Header) -> None:
    quantity = NOMENCLATURE[name]
    if variable.kind == "str":
        made = file.createVariable(name, str, variable.dimensions)
    else:
        chunks = None
        if "step" in variable.dimensions:
            inner = [header.sizes[d] for d in variable.dimensions[1:]]
            # a chunk per step for the long ones; short ones share a chunk of some hundred steps
            chunks = [1 if np.prod(inner) >= 64 else 256, *inner]
        fill = {"f8": FILL_FLOAT, "i4": FILL_INT}[variable.kind] if variable.missing else None
        made = file.createVariable(
            name,
            variable.kind,
            variable.dimensions,
            zlib=bool(chunks),
            complevel=4,
            shuffle=True,
            chunksizes=chunks,
            fill_value=fill,
        )
    if quantity.unit:
        made.units = quantity.unit
    made.long_name = quantity.meaning
    if quantity.sign:
        made.comment = quantity.sign
    # CF 5: coordinates that are not dimensions are named by the variables that have them
    labels = [c for c in COORDINATES if c != name and set(LAYOUT[c].dimensions) <= set(variable.dimensions)]
    if name not in COORDINATES and labels:
        made.coordinates = " ".join(labels)
    if name == "patch_side":
        made.flag_values = np.array([0, 1], dtype=np.int32)
        made.flag_meanings = "right left"
    if name == "wear_regime":
        regimes = [str(text).replace(" ", "_") for text in header.static["regime_name"]]
        made.flag_values = np.arange(-1, len(regimes), dtype=np.int32)
        made.flag_meanings = " ".join(["none", *regimes])


def _write_row(file: netCDF4.Dataset, index: int, row: Row) -> None:
    file.set_auto_maskandscale(False)
    # the step dimension grows with the first variable written; distance comes last so that a row cut
    # short shows itself by a missing distance
    for name in sorted(ROW, key="distance".__eq__):
        file.variables[name][index] = row[name]


def _with_retries(action: Callable[[], _T], patience: float = RETRY_SECONDS) -> _T:
    """Run `action`; retry while the other side (reader or writer) holds the file."""
    deadline = time.monotonic() + patience
    pause = 0.005
    while True:
        try:
            return action()
        except (OSError, RuntimeError):
            if time.monotonic() >= deadline:
                raise
        time.sleep(pause)
        pause = min(2.0 * pause, 0.1)


def _reason(error: Exception) -> str:
    text = getattr(error, "strerror", None) or str(error)
    return str(text).splitlines()[0]
