"""Files that are written as a whole or not at all.

What the system cannot write is one line with advice.

Signals wait for the netCDF library: one that interrupts xarray where it takes a lock
leaves it locked, and the file is never closed. Threads wait for each other there: the
library is not thread-safe.
"""

from __future__ import annotations

import json
import math
import os
import signal
import threading
from collections.abc import Callable, Hashable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wearsim.errors import ResultError

if TYPE_CHECKING:
    import xarray as xr

_LARGEST_JSON = 20_000_000

STOPPING_SIGNALS = [
    getattr(signal, name)
    for name in ("SIGINT", "SIGTERM", "SIGHUP")
    if hasattr(signal, name)
]
"""Signals of terminals and batch systems after which a run stops in a valid state,
where they raise.
"""


class _ProcessLock:
    """Reentrant lock of which a process has one.

    A copy, or what a pickle gives, is the lock itself.
    """

    def __init__(self) -> None:
        self._lock = threading.RLock()

    def acquire(self, blocking: bool = True, timeout: float = -1.0) -> bool:
        """Take the lock; return whether it is taken."""
        return self._lock.acquire(blocking, timeout)

    def release(self) -> None:
        """Release what `acquire` took."""
        self._lock.release()

    def __enter__(self) -> None:
        self.acquire()

    def __exit__(self, *_: object) -> None:
        self.release()

    def __reduce__(self) -> str:
        return "NETCDF_LOCK"  # lazy datasets hold it, and are copied and pickled


NETCDF_LOCK = _ProcessLock()
"""Held wherever a netCDF file is read or written: two threads in the library end the
interpreter.
"""


NO_FILL = {"_FillValue": None}
"""Encoding of coordinates, which have values everywhere."""


def raising_handlers() -> dict[int, Callable[..., Any]]:
    """Handlers of `STOPPING_SIGNALS`, but those ignored, as under nohup, or kill."""
    main = threading.current_thread() is threading.main_thread()
    handlers = {number: signal.getsignal(number) for number in STOPPING_SIGNALS if main}
    return {
        number: handler for number, handler in handlers.items() if callable(handler)
    }


@contextmanager
def signals_wait() -> Iterator[None]:
    """Let signals wait for the end of a block, or of the function this decorates."""
    received, handlers = list[int](), raising_handlers()
    try:
        _handle(dict.fromkeys(handlers, lambda number, _: received.append(number)))
        yield
    finally:
        try:
            _handle(handlers)
        finally:
            _handle(handlers)  # all, where a signal came between them
        for (
            number
        ) in received:  # whatever the block raises: an interruption goes before it
            handlers[number](number, None)


def _handle(handlers: Mapping[int, Callable[..., Any]]) -> None:
    for number, handler in handlers.items():
        signal.signal(number, handler)


def read_json(path: Path) -> Any:
    """Content of a JSON file of a run directory.

    A ValueError if it is none, or far too large for one.
    """
    with path.open("rb") as file:
        content = file.read(_LARGEST_JSON + 1)
    if len(content) > _LARGEST_JSON:
        raise ValueError(f"larger than {_LARGEST_JSON // 1_000_000} MB")
    try:
        return json.loads(content)
    except RecursionError:
        raise ValueError("lists nested too deeply") from None


def json_value(value: Any) -> Any:
    """Value as JSON knows it.

    Records as dicts of what their repr shows, None for a number that is none.
    """
    if is_dataclass(value):
        value = {
            field.name: getattr(value, field.name)
            for field in fields(value)
            if field.repr
        }
    elif hasattr(value, "_asdict"):
        value = value._asdict()
    elif hasattr(value, "tolist"):  # NumPy scalars and arrays
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): json_value(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [json_value(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def utf8(text: str) -> str:
    """Text with bytes escaped that Python took from a file name in another encoding."""
    return text.encode("utf-8", "backslashreplace").decode()


def require_utf8(path: Path) -> None:
    """Raise a ResultError for a name that the netCDF libraries cannot open.

    One that is not UTF-8.
    """
    name = os.path.abspath(path)
    if utf8(name) != name:
        raise ResultError(
            f"{name}: names of netCDF files and of their folders must be UTF-8; "
            "choose another"
        )


@contextmanager
def replacing(path: Path, advice: str = "choose another folder") -> Iterator[Path]:
    """Give the file to write in place of `path`, which it becomes if all goes well.

    Else nothing is left.

    What a link leads to is replaced, not the link; a device or a pipe is written
    itself.

    Raises
    ------
    ResultError
        With reason and advice where the system cannot write.
    """
    target = Path(os.path.realpath(path))
    whole = target.is_file() or not target.exists()
    part = target.with_name(f".{target.name}.tmp") if whole else target
    try:
        yield part
        if whole:
            part.replace(target)
    except (
        OSError,
        RuntimeError,
    ) as error:  # the netCDF library knows a failed write as RuntimeError
        reason = getattr(error, "strerror", None) or str(error).partition("\n")[0]
        raise ResultError(f"{path} cannot be written: {reason}; {advice}") from error
    finally:
        if whole:
            with suppress(OSError):
                part.unlink()


@signals_wait()
def write_netcdf(
    dataset: xr.Dataset, path: Path, advice: str, encoding: Mapping[Hashable, Any]
) -> None:
    """Write a dataset as netCDF-4 whole or not at all.

    `path` always has the complete old or the complete new one.
    """
    with NETCDF_LOCK, replacing(path, advice) as part:
        dataset.to_netcdf(part, engine="netcdf4", format="NETCDF4", encoding=encoding)


def write_whole(
    path: Path,
    content: str | bytes,
    advice: str = "choose another folder",
    *,
    durable: bool = False,
) -> None:
    """Write a file so that `path` always has the complete old or new content.

    Parameters
    ----------
    path : Path
        File to write.
    content : str or bytes
        New content; texts as UTF-8, in which file names of other encodings are escaped.
    advice : str
        What to do where the system cannot write.
    durable : bool
        Whether to wait for the disk, so that the file survives a power failure.
    """
    if isinstance(content, str):
        content = utf8(content).encode()
    with replacing(path, advice) as part, open(part, "wb") as file:
        file.write(content)
        if durable:
            file.flush()
            os.fsync(file.fileno())
