"""Standard output and error of a command.

They end no run when they are closed, full or in ASCII.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any


class _Output:
    """A text stream that escapes what it has no characters for.

    What cannot be written is a ResultError.
    """

    def __init__(self, stream: Any, of_messages: bool) -> None:
        self._stream, self._of_messages = stream, of_messages
        with suppress(
            AttributeError, OSError
        ):  # no text file; a pipe that took the place of one
            stream.reconfigure(errors="backslashreplace")

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        return self._done("write", text) or 0

    def flush(self) -> None:
        self._done("flush")

    def _done(self, what: str, *texts: str) -> Any:
        try:
            return getattr(self._stream, what)(*texts)
        except OSError as error:
            with suppress(
                OSError, ValueError
            ):  # Python would complain once more when it closes the stream
                nowhere = os.open(os.devnull, os.O_WRONLY)
                os.dup2(nowhere, self._stream.fileno())
                os.close(nowhere)
            if self._of_messages:  # whose loss cannot be reported
                return None
            from wearsim.errors import (
                ResultError,
            )  # not for --help: dataclasses cost 10 ms

            if isinstance(
                error, BrokenPipeError
            ):  # the reader, such as `head`, has left
                raise
            text = (
                f"standard output cannot be written: {error.strerror}; make room, or "
                "write elsewhere"
            )
            raise ResultError(text) from error


def print_layout(path: str) -> None:
    """Print the layout of a text table that is not plain CSV."""
    from pathlib import Path

    from wearsim.csv_tables import layout_note

    if layout := layout_note(Path(path).read_bytes()):
        print(f"{path}: read as {layout}", file=sys.stderr)


def formula_warning(text: str, what: str) -> None:
    """Warn of cells of a CSV text that a spreadsheet would run.

    As names and headers of files may be.
    """
    import csv
    import re

    from wearsim.errors import brief

    if not re.search(r"[=@\t(|!]", text):  # in all of them
        return
    cells = (cell for row in csv.reader(text.splitlines()) for cell in row)
    formulas = [cell for cell in cells if re.match(r"[=@\t]|[+-].*[(|!]", cell)]
    if formulas:
        more = f" and {len(formulas) - 1} more" if len(formulas) > 1 else ""
        note = (
            f"{what}: a spreadsheet would run the cell {brief(formulas[0])!r}{more} "
            "as a formula"
        )
        print_warning(f"{note}; import its columns as text")


def print_warning(warning: object) -> None:
    """Print a warning on standard error."""
    print(f"warning: {warning}", file=sys.stderr)


@contextmanager
def standard_streams() -> Iterator[None]:
    """Guard both streams.

    A closed one becomes one to nowhere, before a file gets its number.
    """
    before = sys.stdout, sys.stderr
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            # - for the life of the process
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115
    after: Any = _Output(sys.stdout, False), _Output(sys.stderr, True)
    sys.stdout, sys.stderr = after
    try:
        yield
    finally:
        sys.stdout, sys.stderr = (
            old or new for old, new in zip(before, after, strict=True)
        )
