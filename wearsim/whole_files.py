"""Files that are written as a whole or not at all; what the system cannot write is one line with advice."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from wearsim.errors import ResultError

_LARGEST_JSON = 20_000_000


def read_json(path: Path) -> Any:
    """Content of a JSON file of a run directory; a ValueError if it is none, or far too large for one."""
    with path.open("rb") as file:
        content = file.read(_LARGEST_JSON + 1)
    if len(content) > _LARGEST_JSON:
        raise ValueError(f"larger than {_LARGEST_JSON // 1_000_000} MB")
    try:
        return json.loads(content)
    except RecursionError:
        raise ValueError("lists nested too deeply") from None


def utf8(text: str) -> str:
    """Text with bytes escaped that Python has taken over from a file name in another encoding."""
    return text.encode("utf-8", "backslashreplace").decode()


def require_utf8(path: Path) -> None:
    """Raise a ResultError for a name that the netCDF libraries cannot open: one that is not UTF-8."""
    name = os.path.abspath(path)
    if utf8(name) != name:
        raise ResultError(f"{name}: names of netCDF files and of their folders must be UTF-8; choose another")


@contextmanager
def replacing(path: Path, advice: str = "choose another folder") -> Iterator[Path]:
    """Give the file to write in place of `path`, which it becomes if all goes well; else nothing is left.

    What a link leads to is replaced, not the link; a device or a pipe is written itself.

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
    except (OSError, RuntimeError) as error:  # the netCDF library knows a failed write as RuntimeError
        reason = getattr(error, "strerror", None) or str(error).partition("\n")[0]
        raise ResultError(f"{path} cannot be written: {reason}; {advice}") from error
    finally:
        if whole:
            with suppress(OSError):
                part.unlink()


def write_whole(
    path: Path, content: str | bytes, advice: str = "choose another folder", *, durable: bool = False
) -> None:
    """Write a file so that `path` always has the complete old or the complete new content.

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
