"""The result file: created, appended to row by row, verified, opened.

A campaign creates the file once, then opens, appends one row and closes it at each
step, so that the file can be read at any time between steps. Variables, units and long
names come from `wearsim.quantities`. Readers use `open_results`, which gives a lazy
xarray Dataset.

Threads of a process take turns at netCDF files (`NETCDF_LOCK`), and all readers of a
file in a process share one handle of it: with two, HDF5 reads texts of the one that was
closed, which ends the interpreter (https://github.com/Unidata/netcdf-c/issues/2510).
"""

from __future__ import annotations

import errno
import math
import os
import shutil
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import netCDF4
import numpy as np

from wearsim import __version__
from wearsim.errors import ResultError
from wearsim.quantities import Quantity
from wearsim.results import schema
from wearsim.results.schema import (
    FILL_FLOAT,
    FILL_INT,
    KINDS,
    LABELS,
    PACKED,
    REGIME_FLAGS,
    SCHEMA,
    Header,
    Row,
    check_row,
    layout_of,
    row_names,
    structure_fault,
    value_fault,
)
from wearsim.whole_files import NETCDF_LOCK, replacing, require_utf8, signals_wait, utf8

if TYPE_CHECKING:
    import xarray as xr
    from xarray.backends import CachingFileManager

RETRY_SECONDS = 1.5
"""Time for which reader and writer of one file wait for each other [s]."""

_BATCH, _BATCH_BYTES = 64, 2**22
"""Largest number of rows that are written or read together, and their bytes.

A batch ends when either is reached.
"""

_NUMBERED = {
    "step": "number of the wear step",
    "point": "number of the point of the wheel profile",
}
"""Dimensions with numbers as coordinate variable, by which viewers plot.

In xarray they are not an index.
"""

_RESERVE = 1_000_000
"""Free disk space required besides the rows themselves, for HDF5 metadata [B]."""

_CACHE = 2**18
"""Cache of chunks per variable of an open file [B].

The 16 MB of HDF5 would be 1 GB for all variables.
"""

UNREADABLE = (OSError, RuntimeError, ValueError, AttributeError, KeyError)
"""Exceptions raised when a damaged netCDF file is read.

Its libraries detect damage in many places.
"""

_ADVICE = (
    "finished steps are safe, make room or give write access and run the same command "
    "again, or choose another --out"
)
_T = TypeVar("_T")


def create(path: Path, header: Header, rows: Iterable[Row] = ()) -> None:
    """Write a result file with `rows` atomically.

    At any time `path` is either the complete new file or the previous one.

    Parameters
    ----------
    path : Path
        Result file; replaced if it exists.
    header : Header
        Static part.
    rows : iterable of mappings
        First rows, see `Row`; taken a few at a time.
    """
    with NETCDF_LOCK, replacing(path, _ADVICE) as temporary:
        with netCDF4.Dataset(temporary, "w", format="NETCDF4") as file:
            _define_layout(file, header)
            _limit_memory(file)
            for first, batch in _batched(rows):
                for row in batch:
                    check_row(header, row)
                _need_room(path, batch)
                _write_rows(file, first, batch)
        with open(temporary, "rb") as written:
            os.fsync(written.fileno())


def append(
    path: Path,
    header: Header,
    rows: Sequence[Row],
    first: int,
    patience: float | None = None,
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
    patience : float, optional
        How long to retry while a reader holds the file, by default `RETRY_SECONDS` [s].

    Raises
    ------
    OSError
        If a reader holds the file longer than that, or the file is damaged; nothing was
        written then.
    ResultError
        If the disk has no room for the rows, or a write failed; the file may be damaged
        then.
    """

    def write() -> None:
        with NETCDF_LOCK:
            file = netCDF4.Dataset(
                path, "a"
            )  # also an OSError: a reader has the file open, or it is damaged
            try:
                with file:
                    _limit_memory(file)
                    _write_rows(file, first, rows)
            except (
                OSError,
                RuntimeError,
            ) as error:  # part of a write: HDF5 may crash if it continues with the file
                raise _not_written(path, _reason(error)) from error

    for row in rows:
        check_row(header, row)
    _need_room(path, rows)
    if not path.is_file():  # the netCDF library would create an empty file
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
    _with_retries(write, patience)


def row_count(path: Path) -> int:
    """Return how many rows (wear steps + 1) a result file has.

    Raises
    ------
    ResultError
        If it is missing, damaged or not a result of wearsim.
    """
    try:
        with _opened(path) as file:
            return len(file.dimensions["step"])
    except RuntimeError as error:  # raised on closing if a previous write failed
        raise ResultError(f"{path} is damaged: {_reason(error)}") from error


def attribute_of(path: Path, name: str) -> str:
    """Return an attribute of a result file, or an empty one if it is missing.

    This takes a tenth of the time of opening the whole file.
    """
    with _opened(path) as file:
        return str(getattr(file, name, ""))


def verify(path: Path, rows: Sequence[Callable[[], Row]]) -> int | None:
    """Count the rows of a file that holds exactly the first of `rows`, bit by bit.

    Parameters
    ----------
    path : Path
        Result file.
    rows : sequence of functions
        Each gives one expected row (they are read one at a time: a campaign need not
        fit in memory).

    Returns
    -------
    int or None
        None if the file is missing, damaged, longer or different in any bit.
    """
    try:
        with _opened(path) as file:
            count = len(file.dimensions["step"])
            if count > len(rows):
                return None
            _limit_memory(file)
            for first, batch in _batched(read() for read in rows[:count]):
                for name in row_names(file.variables):
                    stored = np.asarray(
                        file.variables[name][first : first + len(batch)]
                    )
                    if not np.array_equal(
                        stored, np.stack([row[name] for row in batch])
                    ):
                        return None
            return count
    except (ResultError, OSError, RuntimeError, KeyError, IndexError):
        return None


def stored_rows(path: Path) -> Iterator[Row]:
    """Read the rows of a result file unchanged, with fill values where missing.

    Raises
    ------
    ResultError
        If it is missing, damaged or not a result of wearsim.
    """
    with _opened(path) as file:
        _limit_memory(file)
        names = row_names(file.variables)
        for index in range(len(file.dimensions["step"])):
            yield {name: np.asarray(file.variables[name][index]) for name in names}


def open_results(path: str | Path) -> xr.Dataset:
    """Open a result file as a lazy xarray Dataset, also while the campaign is running.

    Parameters
    ----------
    path : str or Path
        A `.nc` file that a campaign wrote, or a part of it that xarray saved.

    Returns
    -------
    xarray.Dataset
        SI units, `units` and `long_name` on every variable; empty patch slots and
        undefined quantities are NaN. `distance` is the index of `step`, the names of
        wheels, operating points, regimes and laws are those of their dimensions: `.sel`
        takes them all. `method="nearest"` is for the distance, of two steps at one
        distance (before and after a reprofiling) it takes the later one;
        `wearsim.at_distance` interpolates between steps. `profile_y` is a coordinate.
        Values are read when they are used: `.load()` reads them all, and frees the file
        for the writer of a running campaign when used as a context manager.

    Raises
    ------
    ResultError
        If the file is missing, damaged or not a result of this version of wearsim.

    Examples
    --------
    >>> import wearsim
    >>> with wearsim.open_results("out/rig.nc") as rig:
    ...     state = rig.sel(distance=900.0, operating_point="right", method="nearest")
    ...     pressure = state["max_pressure"].isel(patch=0).load()
    ...     line = rig.wear_depth.sel(distance=900.0, wheel="right", method="nearest").plot(x="profile_y")
    >>> pressure.attrs["units"]
    'Pa'
    """
    return _dataset(Path(path), part=True)


def open_whole(path: Path) -> xr.Dataset:
    """Open a result file with all variables, which `open_results` need not have."""
    return _dataset(path, part=False)


def _dataset(path: Path, part: bool) -> xr.Dataset:
    """Open a result file, or a `part` of one, see `open_results`."""
    from wearsim.results.index import INDEXES, DistanceIndex, NameIndex

    with _opened(path, part) as file:
        try:
            for variable in file.variables.values():
                if "step" in variable.dimensions:
                    variable[
                        -1:
                    ]  # left unreadable by a process killed during an append
            # A row cut short by a killed writer has no distance; the campaign repairs
            # it when resumed.
            sound = int(
                np.count_nonzero(np.asarray(file.variables["distance"][:]) < FILL_FLOAT)
            )
        except RuntimeError as error:
            raise _unreadable(
                path, "was damaged while it was written", error
            ) from error
        if sound == 0:
            raise _damaged(path, "distance has no value")
        try:
            opened = _lazy_content(path, decode_times=False)
            # also if all rows are intact: the file may have grown when they are read
            dataset = opened.isel(step=slice(0, sound), missing_dims="ignore")
            named = [
                dimension
                for dimension in INDEXES
                if dimension in dataset.dims
                and f"{dimension}_name" in dataset.variables
            ]
            names = {
                dimension: dataset[f"{dimension}_name"].load() for dimension in named
            }
        except UNREADABLE as error:
            raise _unreadable(path, "cannot be read", error) from error
    for dimension, name in names.items():
        dataset = dataset.drop_vars(dimension, errors="ignore")
        dataset = dataset.assign_coords(
            {dimension: (dimension, name.values, name.attrs)}
        )
        dataset = dataset.drop_indexes(dimension).set_xindex(dimension, NameIndex)
    # steps of two results are compared by distance; points of two wheels are not
    # comparable
    dataset = dataset.drop_indexes(
        [name for name in _NUMBERED if name in dataset.xindexes]
    )
    if "step" in dataset["distance"].dims:
        dataset = dataset.set_xindex("distance", DistanceIndex)
    if "profile_y" in dataset:
        dataset = dataset.set_coords("profile_y")
    for array in dataset.variables.values():
        array.encoding.setdefault(
            "_FillValue", None
        )  # xarray would add a fill value to a saved part
    dataset.encoding.pop("unlimited_dims", None)  # a part may be without steps
    dataset.set_close(opened.close)
    return dataset


@signals_wait()
def load_results(path: str | Path) -> xr.Dataset:
    """Read a whole result file into memory and check its values.

    `open_results` leaves the values on the disk.

    Raises
    ------
    ResultError
        If the file is missing, damaged, not a result of this version of wearsim, or
        holds impossible values.
    """
    path = Path(path)
    with open_whole(path) as dataset:
        for name, variable in dataset.variables.items():
            try:
                variable.load()
            except UNREADABLE as error:
                raise _unreadable(path, f"is damaged in {name}", error) from error
            if fault := value_fault(str(name), variable.values, dataset.sizes):
                raise _damaged(path, fault)
        if fault := _patch_fault(dataset):
            raise _damaged(path, fault)
    return dataset


def _patch_fault(dataset: xr.Dataset) -> str:
    """State if patches wear more area than their largest depth can hold, or ""."""
    needed = ("wear_area_rate", "wear_depth_rate_max", "profile_y", "profile_z")
    area, depth, y, z = (dataset[name].values for name in needed)
    longest = np.hypot(np.diff(y[0]), np.diff(z[0])).sum(axis=-1).max()
    if not np.any(area > depth * longest):
        return ""
    return "wear_area_rate is more than wear_depth_rate_max along the whole profile"


def loaded(results: str | Path | xr.Dataset) -> xr.Dataset:
    """Return the whole of a result, from its file or a dataset of `open_results`.

    Raises `ResultError` for a part of a result.
    """
    import xarray as xr

    if not isinstance(results, xr.Dataset):
        return load_results(results)
    layout = layout_of([str(name) for name in results.variables])
    for name, quantity in layout.items():
        if name in schema.LATER and name not in results:
            continue
        if name not in results or results[name].dims != quantity.dimensions:
            raise ResultError(
                f"a part of a result is not enough: {name} is not whole; give the "
                "result file"
            )
    return results.load()


@signals_wait()
def load_derived(path: Path) -> xr.Dataset:
    """Load factors or bands; ValueError if the file states more than its size holds."""
    with _handle(path) as file:
        unpacked = 8 * sum(
            math.prod(variable.shape) for variable in file.variables.values()
        )
        if unpacked > PACKED * path.stat().st_size:
            raise ValueError("it states more values than a file of its size holds")
        if any(
            len(set(variable.dimensions)) < len(variable.dimensions)
            for variable in file.variables.values()
        ):
            raise ValueError("a variable has a dimension twice")
        return _lazy_content(path).load()


def _shared_handle(path: Path) -> CachingFileManager[Any]:
    """Return the handle of a file shared by all its readers in this process.

    A closed file is opened again.
    """
    from xarray.backends import CachingFileManager

    status, place = path.stat(), os.path.realpath(path)
    # detects a file that was replaced in the meantime
    same = f"{status.st_dev} {status.st_ino}"
    return CachingFileManager(
        netCDF4.Dataset, place, mode="r", lock=NETCDF_LOCK, manager_id=same
    )


@contextmanager
def _handle(path: Path) -> Iterator[netCDF4.Dataset]:
    """Open a netCDF file for reading, and close it afterwards.

    Lazy datasets of the file reopen it when they are read.
    """
    with NETCDF_LOCK:
        shared = _shared_handle(path)
        file = _with_retries(shared.acquire)
        try:
            yield file
        finally:
            shared.close()


def _lazy_content(path: Path, **decoding: Any) -> xr.Dataset:
    """Content of an open netCDF file, with values read on use."""
    import xarray as xr
    from xarray.backends import NetCDF4DataStore

    store = NetCDF4DataStore(_shared_handle(path), lock=NETCDF_LOCK)  # type: ignore[no-untyped-call]
    return xr.open_dataset(store, engine="store", **decoding)


@contextmanager
def _opened(path: Path, part: bool = False) -> Iterator[netCDF4.Dataset]:
    """Open a result file for reading, with exact, unmasked values.

    Raises the fault of the file if it cannot be read.

    It may be a `part` of a result that xarray saved.
    """
    require_utf8(path)
    if not path.exists():
        raise ResultError(
            f"{path} does not exist; `wearsim run SCENE --out DIR` writes result files"
        )
    if not path.is_file():
        raise ResultError(
            f"{path} is not a file; give a .nc file that `wearsim run` wrote"
        )
    with ExitStack() as stack:
        try:
            file = stack.enter_context(_handle(path))
        except (OSError, RuntimeError) as error:
            raise _unreadable(path, "cannot be read as netCDF", error) from error
        try:
            file.set_auto_maskandscale(False)
            fault = _format_fault(file, path, part)
        except UNREADABLE as error:
            fault = _unreadable(path, "is damaged", error)
        if fault is not None:
            raise fault
        yield file


def _format_fault(file: netCDF4.Dataset, path: Path, part: bool) -> ResultError | None:
    """Return why a netCDF file is no result file of this version, or None."""
    stated = getattr(file, "wearsim_schema", None)
    number = int(stated) if isinstance(stated, np.integer) else None
    needed = ["distance"] if part else _required_variables(file)
    missing = [name for name in needed if name not in file.variables]
    if number == SCHEMA and not missing:
        fault = structure_fault(file, path.stat().st_size, part)
        return _damaged(path, fault) if fault else None
    another = "run its scene again in another directory"
    if number is None or number == SCHEMA:
        without = f" of this version (without {missing[0]})" if missing else ""
        return ResultError(
            f"{path} is not a result file of a wearsim campaign{without}; give a .nc "
            "that `wearsim run` wrote, or run its scene again in another directory"
        )
    if number > SCHEMA:
        return ResultError(
            f"{path} has schema {number}, this wearsim reads {SCHEMA}; update wearsim"
        )
    older = (
        f"was written by an older wearsim (schema {number}, this one reads {SCHEMA})"
    )
    return ResultError(f"{path} {older}; {another}")


def _required_variables(file: netCDF4.Dataset) -> Iterable[str]:
    """Names of the variables without which a file is no result file.

    A file of an earlier version need not have variables introduced later. Variables
    removed since it was written are ignored.
    """
    is_current = str(getattr(file, "source", "")).startswith(f"wearsim {__version__} ")
    return [
        name
        for name in layout_of(file.variables)
        if is_current or name not in schema.LATER
    ]


def _unreadable(path: Path, what: str, error: Exception) -> ResultError:
    return ResultError(
        f"{path} {what}: {_reason(error)}; a damaged file is rebuilt by `wearsim "
        f"resume {path.parent}` from the records of its steps while its campaign is "
        "unfinished"
    )


def _damaged(path: Path, fault: str) -> ResultError:
    return ResultError(
        f"{path}: {fault}: the file is damaged or was changed; give it as `wearsim "
        "run` wrote it, or run its scene again in another directory"
    )


def _define_layout(file: netCDF4.Dataset, header: Header) -> None:
    file.createDimension("step", None)
    for name, size in header.sizes.items():
        file.createDimension(name, size)
    attributes = {
        "Conventions": "CF-1.11",
        "wearsim_schema": np.int32(SCHEMA),
        **header.attributes,
    }
    for name, value in attributes.items():
        if value != "":
            file.setncattr(name, utf8(value) if isinstance(value, str) else value)
    for name, meaning in _NUMBERED.items():
        numbers: Any = file.createVariable(name, "i4", (name,))
        numbers.setncatts({"units": "1", "long_name": meaning})
    file.variables["point"][:] = np.arange(header.sizes["point"])
    for name, variable in layout_of(header.static).items():
        stored = _defined(file, name, variable, header)
        if "step" not in variable.dimensions:
            value = header.static[name]
            texts = variable.kind == "str"
            stored[:] = (
                np.array([*map(str, value)], dtype=object)
                if texts
                else np.asarray(value, dtype=float)
            )
    file.set_auto_maskandscale(False)


def _defined(
    file: netCDF4.Dataset, name: str, variable: Quantity, header: Header
) -> Any:
    """Define a variable with its attributes."""
    options: dict[str, Any] = {}
    if "step" in variable.dimensions:
        inner = [header.sizes[d] for d in variable.dimensions[1:]]
        # Long chunks have one step each. Short ones share a chunk, which each append
        # rewrites. Empty slots of patches compress better unshuffled, digits of
        # profiles shuffled. Level 4 takes half as long again.
        shuffle = variable.dimensions[-1] in ("point", "counterface_point")
        options = {"chunksizes": [1 if np.prod(inner) >= 64 else 16, *inner]}
        options |= {"zlib": True, "shuffle": shuffle, "complevel": 1}
    if variable.missing:
        options["fill_value"] = {"f8": FILL_FLOAT, "i4": FILL_INT}[variable.kind]
    stored: Any = file.createVariable(
        name, KINDS[variable.kind], variable.dimensions, **options
    )
    stored.setncatts(variable.attributes)
    # CF 5: coordinates that are not dimensions are named by the variables that have
    # them
    layout = layout_of(header.static)
    labels = [
        c
        for c in LABELS
        if c in layout and set(layout[c].dimensions) <= set(variable.dimensions)
    ]
    if name not in LABELS and labels:
        stored.coordinates = " ".join(labels)
    meanings, first = list(variable.flags), 0
    if name in REGIME_FLAGS:
        meanings = [
            "none",
            *(str(text).replace(" ", "_") for text in header.static["regime_name"]),
        ]
        first = -1
    if meanings:
        stored.flag_values = np.arange(first, first + len(meanings), dtype=np.int32)
        stored.flag_meanings = " ".join(meanings)
    return stored


def _need_room(path: Path, rows: Sequence[Row]) -> None:
    """Raise an error before a write for which the disk has no room.

    HDF5 would leave a damaged file, or crash.
    """
    needed = _RESERVE + sum(
        np.asarray(value).nbytes for row in rows for value in row.values()
    )
    try:
        free = shutil.disk_usage(path.parent).free
    except OSError:  # a file system that does not report it
        return
    if free < needed:
        raise _not_written(path, f"the disk is full, {free / 1e6:.1f} MB left")


def _not_written(path: Path, reason: str) -> ResultError:
    return ResultError(f"{path} cannot be written: {reason}; {_ADVICE}")


def _limit_memory(file: netCDF4.Dataset) -> None:
    """Limit the memory of an open file, however many rows are written or read."""
    for name in row_names(file.variables):
        file.variables[name].set_var_chunk_cache(size=_CACHE)


def _write_rows(file: netCDF4.Dataset, first: int, rows: Sequence[Row]) -> None:
    file.set_auto_maskandscale(False)
    # The step dimension grows with the first variable written. Distance is written
    # last, so that a row cut short has no distance.
    file.variables["step"][first : first + len(rows)] = np.arange(
        first, first + len(rows)
    )
    for name in sorted(row_names(file.variables), key="distance".__eq__):
        file.variables[name][first : first + len(rows)] = np.stack(
            [row[name] for row in rows]
        )


def _batched(rows: Iterable[Row]) -> Iterator[tuple[int, list[Row]]]:
    """Yield the index of the first row and the rows, in batches.

    Batches need few netCDF calls and never hold a whole campaign in memory.
    """
    batch: list[Row] = []
    first = size = 0
    for row in rows:
        batch.append(row)
        size += sum(value.nbytes for value in row.values())
        if len(batch) == _BATCH or size >= _BATCH_BYTES:
            yield first, batch
            first, size, batch = first + len(batch), 0, []
    if batch:
        yield first, batch


def _with_retries(action: Callable[[], _T], patience: float | None = None) -> _T:
    """Run `action`; retry while the other side (reader or writer) has the file open."""
    deadline = time.monotonic() + (RETRY_SECONDS if patience is None else patience)
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
