"""Text of a profile file, read in bounded time and memory, and the faults found in it."""

from __future__ import annotations

import codecs
import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from wearsim.errors import Fault, ProfileError

MAX_BYTES = 20_000_000
MAX_LINES = 1_100_000  # 10^6 points and what may stand around them
MAX_LINE = 100_000  # characters; a longer line is no text of a profile
_SHOWN_FAULTS = 20  # lines of one message; a wrong separator would fault every line of a long file
_MOST_ALIKE = 3  # faults of the same kind; more are told once
_MOST_FAULTS = 1000  # then reading stops
# All control characters but tab, line ends and form feed.
_CONTROL = re.compile(r"[\x00-\x08\x0b\x0e-\x1f\x7f]")


@dataclass(frozen=True)
class Text:
    """Lines of a file.

    Parameters
    ----------
    path : Path
        The file.
    lines : tuple of str
        Without line ends.
    notes : tuple of str
        What is worth telling about the encoding.
    """

    path: Path
    lines: tuple[str, ...]
    notes: tuple[str, ...] = ()


class Faults:
    """Faults of one file, told all at once."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.found: list[tuple[str, int | None]] = []
        self._like: list[str] = []

    def add(self, message: str, line: int | None = None, like: str | None = None) -> None:
        """Note a fault; so many that the file is hopeless are told at once.

        Faults of many lines that are alike, by `like` or by their message, are told by the first of them.
        """
        self.found.append((message, line))
        self._like.append(message if like is None else like)
        if len(self.found) >= _MOST_FAULTS:
            self.found.append((f"reading stopped after {_MOST_FAULTS} faults", line))
            self._like.append("")
            self.refuse()

    def refuse(self) -> None:
        """Raise `ProfileError` if there are faults, the first of them only if there are very many."""
        if not self.found:
            return
        count, collapsed = Counter(self._like), set[str]()
        told: list[tuple[str, int | None]] = []
        for like, (message, line) in zip(self._like, self.found, strict=True):
            if count[like] <= _MOST_ALIKE:
                told.append((message, line))
            elif like not in collapsed:
                told.append((f"{message} (and {count[like] - 1} more lines)", line))
                collapsed.add(like)
        lines = [str(Fault(message, str(self.path), line)) for message, line in told[:_SHOWN_FAULTS]]
        if len(told) > _SHOWN_FAULTS:
            more = len(told) - _SHOWN_FAULTS
            lines.append(f"{self.path}: {more} more faults of this file are not shown")
        raise ProfileError("\n".join(lines))


def read_text(path: Path, *, utf8_only: bool = False) -> Text:
    """Read a text file of at most 20 MB.

    Parameters
    ----------
    path : Path
        UTF-8, UTF-16 with a byte order mark, or Latin-1 (instruments write names of places and people
        so).
    utf8_only : bool
        Refuse the other two.

    Returns
    -------
    Text
        Lines, and a note on any encoding other than UTF-8.

    Raises
    ------
    ProfileError
        No such file, too large, or no text.
    """
    data = _bytes(path)
    if data.startswith((b"\x89HDF", b"CDF")):
        message = f"is a result file, not a profile; `wearsim inspect {path}` shows what it holds"
        raise ProfileError(str(Fault(message, str(path))))
    notes: tuple[str, ...] = ()
    marked = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    try:
        if marked and not utf8_only:
            text, notes = data.decode("utf-16"), ("text read as UTF-16",)
        else:
            text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        if utf8_only or marked:
            name = "UTF-8" if utf8_only else "UTF-16, as its first bytes say"
            line = data.count(b"\n", 0, error.start) + 1
            raise ProfileError(
                str(Fault(f"is not {name} text; save the file as UTF-8", str(path), line))
            ) from error
        text, notes = data.decode("latin-1"), ("text is not UTF-8: read as Latin-1",)
    text = text.removesuffix("\x1a")  # end mark of DOS files
    if (bad := _CONTROL.search(text)) is not None:
        what = "zero bytes" if bad[0] == "\0" else f"the control character {bad[0]!r}"
        line = text.count("\n", 0, bad.start()) + 1
        raise ProfileError(
            str(Fault(f"holds {what}, so it is not UTF-8 text; save it as UTF-8", str(path), line))
        )
    lines = tuple(text.replace("\r\n", "\n").replace("\r", "\n").split("\n"))
    for number, line_text in enumerate(lines, start=1):
        if len(line_text) > MAX_LINE:
            message = (
                f"a line of {len(line_text)} characters, at most {MAX_LINE} are read; one point per line"
            )
            raise ProfileError(str(Fault(message, str(path), number)))
    return Text(path, lines, notes)


def _bytes(path: Path) -> bytes:
    """Content of the file; one that is too large is not read."""
    try:
        if not path.is_file():
            what = "does not exist"
            if path.exists():
                what = "is a folder, not a file" if path.is_dir() else "is not a regular file"
            raise ProfileError(f"{path}: {what}; give the path of a profile file")
        size = path.stat().st_size
        if size <= MAX_BYTES:
            with path.open("rb") as file:
                data = file.read(MAX_BYTES + 1)
            size = len(data)
    except OSError as error:
        raise ProfileError(
            f"{path}: cannot be read ({error.strerror}); check the path and its permissions"
        ) from error
    if size > MAX_BYTES:
        raise ProfileError(
            f"{path}: larger than {MAX_BYTES // 10**6} MB, hardly one profile; give one cross-section"
        )
    if max(data.count(b"\n"), data.count(b"\r")) > MAX_LINES:
        raise ProfileError(f"{path}: more than {MAX_LINES} lines, hardly one profile; give one cross-section")
    return data
