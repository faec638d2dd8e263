"""File formats of profiles: one registry, asked by content first and by extension second."""

from __future__ import annotations

import difflib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from wearsim.errors import ProfileError
from wearsim.profile.formats import miniprof, simpack, slices, two_column
from wearsim.profile.formats.points import Elsewhere, Points
from wearsim.profile.formats.text import Faults, Text

Kind = Literal["wheel", "rail"]


@dataclass(frozen=True)
class Choice:
    """Which profile of a file with several is wanted.

    Parameters
    ----------
    part : int, str or None
        Number or name of a curve of a multi-part file.
    slice : int or None
        Number of a slice, from 1.
    """

    part: int | str | None = None
    slice: int | None = None


@dataclass(frozen=True)
class Format:
    """How one format is told and read.

    Parameters
    ----------
    title : str
        For users.
    recognises : callable
        ``recognises(text, suffix) -> bool``; with an empty suffix only the content decides.
    read : callable
        ``read(text, kind, faults, choice) -> Points``, or `Elsewhere`, or None with faults.
    suffixes : dict of str to str
        Extensions and the kind they stand for ("" for both).
    """

    title: str
    recognises: Callable[[Text, str], bool]
    read: Callable[[Text, Kind, Faults, Choice], Points | Elsewhere | None]
    suffixes: dict[str, str]


def _whole(read: Callable[[Text, Kind, Faults], Points]) -> Callable[[Text, Kind, Faults, Choice], Points]:
    """Reader of a format with one profile in a file."""

    def reader(text: Text, kind: Kind, faults: Faults, choice: Choice) -> Points:
        if choice.part is not None:
            faults.add(f"--part {choice.part} is stated, but the file holds one profile: leave it out")
        if choice.slice is not None:
            faults.add(f"--slice {choice.slice} is stated, but the file is no list of slices: leave it out")
        return read(text, kind, faults)

    return reader


FORMATS: dict[str, Format] = {
    "simpack": Format("SIMPACK", simpack.recognises, _whole(simpack.read), simpack.SUFFIXES),
    "miniprof-parts": Format(
        "MiniProf multi-part",
        miniprof.recognises_parts,
        lambda text, kind, faults, choice: miniprof.read_part(text, kind, faults, choice.part),
        miniprof.PART_SUFFIXES,
    ),
    "miniprof": Format("MiniProf", miniprof.recognises, _whole(miniprof.read), miniprof.SUFFIXES),
    "slices": Format(
        "CONTACT slices",
        slices.recognises,
        lambda text, kind, faults, choice: slices.read(text, kind, faults, choice.slice),
        slices.SUFFIXES,
    ),
    "gensys": Format(
        "GENSYS", two_column.recognises_gensys, _whole(two_column.read_gensys), two_column.GENSYS_SUFFIXES
    ),
    "uic519": Format(
        "UIC 519 table",
        two_column.recognises_uic,
        _whole(two_column.read_uic),
        dict.fromkeys(two_column.UIC_SUFFIXES, ""),
    ),
    "two-column": Format("two columns", two_column.recognises, _whole(two_column.read), {}),
}


def format_of(text: Text, name: str | None) -> str:
    """Name of the format of a file.

    Parameters
    ----------
    text : Text
        Its lines.
    name : str or None
        What the user states.

    Returns
    -------
    str
        Key of `FORMATS`.

    Raises
    ------
    ProfileError
        There is no format of that name.
    """
    if name is not None:
        return known_format(name, FORMATS, text.path)
    for key, each in FORMATS.items():
        if key != "two-column" and each.recognises(text, ""):
            return key
    suffix = text.path.suffix.lower()
    return next(key for key, each in FORMATS.items() if each.recognises(text, suffix))


def known_format(name: str, known: dict[str, Format] | dict[str, str], path: Path) -> str:
    """Return the name if it is known, else list what there is."""
    if name in known:
        return name
    near = difflib.get_close_matches(name.lower(), list(known), n=1, cutoff=0.4)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    raise ProfileError(f"{path}: format = {name!r} is not one of {', '.join(known)}{hint}")


def suffix_kind(name: str, path: Path) -> str:
    """Kind of profile that the extension stands for in a format, "" if it says nothing."""
    return FORMATS[name].suffixes.get(path.suffix.lower(), "")
