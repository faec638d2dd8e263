"""The folder that reports of studies are written to."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from wearsim.errors import ResultError


@contextmanager
def report_folder(out: Path) -> Iterator[None]:
    """Make a folder and write to it within the context.

    Parameters
    ----------
    out : Path
        Folder; made if it is not there.

    Raises
    ------
    ResultError
        If it cannot be made or written to.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
        yield
    except OSError as error:
        raise ResultError(f"{out}: cannot be written ({error.strerror}); choose another --out") from error
