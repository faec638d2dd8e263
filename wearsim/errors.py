"""Errors that reach the user.

One line each, naming the input, the value, the limit and the fix.

A message is an f-string where the fault is found; `shown`, `listed` and `brief` write
the values in it.
"""

from __future__ import annotations

import difflib
import json
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Self


@dataclass(frozen=True)
class Fault:
    """One fault of an input file.

    Parameters
    ----------
    message : str
        What is wrong: key, value, allowed range and fix, in one line.
    file : str, optional
        The file that holds the fault.
    line : int, optional
        Its line, counted from 1.
    """

    message: str
    file: str | None = None
    line: int | None = None

    def __str__(self) -> str:
        """Return ``file:line: message``."""
        place = (
            ""
            if self.file is None
            else self.file
            if self.line is None
            else f"{self.file}:{self.line}"
        )
        return printable(f"{place}: {self.message}" if place else self.message)


def printable(text: str) -> str:
    """Text of a line with escapes for what a terminal obeys or hides.

    Control characters, directions.
    """
    return "".join(
        c if c.isprintable() else c.encode("unicode_escape").decode() for c in text
    )


def suggestion(name: str, known: Iterable[str]) -> str:
    """Return "; did you mean 'S1002'?".

    With the known name nearest to an unknown one, "" if none is near.
    """
    by_lower = {candidate.lower(): candidate for candidate in known}
    near = difflib.get_close_matches(name.lower(), list(by_lower), n=1, cutoff=0.5)
    return f"; did you mean {brief(by_lower[near[0]])!r}?" if near else ""


MOST_FAULTS = 20
"""Lines of one message: a wrong unit or separator is a fault of every line of a long
file.
"""

LONGEST_ECHO = 40
"""Characters of a file that a message repeats."""


def brief(text: str) -> str:
    """Text of a file as a message repeats it, in one line and shortened."""
    text = printable(text)
    return text if len(text) <= LONGEST_ECHO else f"{text[: LONGEST_ECHO - 3]}..."


def shown(value: object) -> str:
    """Value as TOML would write it, on one line, shortened."""
    if isinstance(value, Mapping):
        return "(a table)"
    if isinstance(value, str | bool):
        text = json.dumps(value, ensure_ascii=False)
        return text if len(text) <= LONGEST_ECHO else f'{text[: LONGEST_ECHO - 4]}..."'
    if isinstance(value, list | tuple):
        text = f"[{', '.join(map(shown, value))}]"
        return "(a list)" if len(value) > 4 or len(text) > LONGEST_ECHO else text
    return brief(str(value))


def listed(values: Iterable[object], between: str = ", ") -> str:
    """Values one after the other, with commas, " and " or " or " between them."""
    return between.join(map(str, values))


class WearsimWarning(UserWarning):
    """What deserves a second look in a scene that runs.

    File, line, key, what is doubtful, a way out.
    """


def issue_warning(warning: Fault, stacklevel: int = 3) -> None:
    """Issue a warning of Python, by default of the line two calls above."""
    warnings.warn(str(warning), WearsimWarning, stacklevel=stacklevel)


class WearsimError(Exception):
    """Base of all errors with a message for the user.

    `exit_code` is what the command line returns.
    """

    exit_code = 2

    def __str__(self) -> str:
        """Return the message, a line for each fault."""
        return "\n".join(map(printable, super().__str__().split("\n")))


def first_of(lines: Sequence[str]) -> list[str]:
    """Return the first lines of a message, and how many more there are."""
    more = len(lines) - MOST_FAULTS
    return [
        *lines[:MOST_FAULTS],
        *([f"and {more} more faults that are not shown"] if more > 0 else []),
    ]


class SceneError(WearsimError):
    """A scene file, or a set of flags, with one or more faults.

    Of these the first are listed.
    """

    def __init__(self, faults: Sequence[Fault]) -> None:
        self.faults = tuple(faults)
        super().__init__("\n".join(first_of([str(fault) for fault in self.faults])))


def raise_any(faults: Sequence[Fault]) -> None:
    """Raise a SceneError with all faults, if there are any."""
    if faults:
        raise SceneError(faults)


class ProfileError(WearsimError):
    """A profile that cannot be read or used."""


class ContactError(WearsimError):
    """A contact problem without a solution.

    No contact, patch at the edge of a profile, unusable input.

    `row` is the row of the batch it belongs to, where a model knows it; `side` its
    wheel, 0 right, 1 left. `rows` are all rows of the batch that are known to fail in
    the same way, `row` among them. The text is the `reason`, after the `place` of the
    operating point where it is known, and after its number in a batch of several.
    """

    def __init__(
        self,
        message: str,
        row: int | None = None,
        side: int | None = None,
        rows: Iterable[int] = (),
    ) -> None:
        self.row, self.side = row, side
        self.rows = tuple(rows) or (() if row is None else (row,))
        self.reason, self.place, self.numbered = message, "", False
        super().__init__(message)

    @property
    def text(self) -> str:
        """Place and reason, without the number of the operating point."""
        return f"{self.place}: {self.reason}" if self.place else self.reason

    def __str__(self) -> str:
        """Return the text with the number of the operating point."""
        return f"point {self.row}, {self.text}" if self.numbered else self.text

    def of_point(
        self, row: int, rows: Iterable[int], *, place: str = "", numbered: bool = True
    ) -> Self:
        """Return the error of an operating point, with its number in a batch.

        Without a place the error keeps the one it has, and whether it is numbered.
        """
        error = type(self)(self.reason, row, self.side, rows)
        error.place = place or self.place
        error.numbered = numbered if place else self.numbered
        return error


class NumericalError(ContactError):
    """An iteration that did not converge or a step that cannot be made small enough."""

    exit_code = 3


class PluginError(WearsimError):
    """A model or law of a plug-in or a script that fails, or gives not what it must."""


class ResultError(WearsimError):
    """A result file or run directory that cannot be opened, continued or written."""
