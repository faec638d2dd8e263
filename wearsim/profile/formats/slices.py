"""Lists of slices of the program CONTACT: `.slcs` (rail along the track), `.slcw` (wheel around its axle)."""

from __future__ import annotations

import re
from typing import Literal

from wearsim.profile.formats.points import Elsewhere, number_fault
from wearsim.profile.formats.text import Faults, Text

SUFFIXES = {".slcs": "rail", ".slcw": "wheel"}
MAX_SLICES = 100_000
_SLICE = re.compile(r"""(\S+)\s+(?:'([^']+)'|"([^"]+)")""")


def recognises(text: Text, suffix: str) -> bool:
    """Tell a list of slices by its lines of position and quoted file name, or by its extension."""
    bare = [line for line in (_bare(raw) for raw in text.lines[:200]) if line]
    listed = [match for match in map(_SLICE.match, bare[4:]) if match and number_fault(match[1]) is None]
    begins = bool(bare) and len(_numbers(bare[0], 2)) == 2
    return (begins and len(listed) > 0) or suffix in SUFFIXES


def _bare(line: str) -> str:
    """Line without comment; a `%` or `!` in a file name is not expected."""
    return re.split(r"[!%]", line, maxsplit=1)[0].strip()


def _numbers(line: str, count: int) -> list[str]:
    """Return the first `count` cells of a line, or fewer if they are no numbers; words may follow."""
    cells = line.replace(",", " ").split()[:count]
    return [cell for cell in cells if number_fault(cell) is None]


def read(text: Text, kind: Literal["wheel", "rail"], faults: Faults, number: int | None) -> Elsewhere | None:
    """File of one slice.

    Parameters
    ----------
    text : Text
        Offset and scale, number of slices, features, method, then one line per slice.
    kind : {"wheel", "rail"}
        Not used: the slice itself tells.
    faults : Faults
        Takes what is wrong.
    number : int or None
        Which slice, from 1; needed if there are several.

    Returns
    -------
    Elsewhere or None
        None if no slice can be chosen; the fault says why.
    """
    del kind
    rows = [(at, line) for at, line in ((k, _bare(raw)) for k, raw in enumerate(text.lines, 1)) if line]
    names = ("offset and scale", "the number of slices", "NFEAT NKINK NACCEL", "the method")
    values: list[list[str]] = []
    for (name, count), (at, line) in zip(zip(names, (2, 1, 3, 1), strict=True), rows, strict=False):
        cells = _numbers(line, count)
        if len(cells) < count:
            faults.add(f"{count} number{'s are' if count > 1 else ' is'} needed here: {name}", at)
        values.append(cells)
    if len(rows) < 4:
        faults.add(f"ends before {names[len(rows)]}: the file is cut off; copy it again", len(text.lines))
    if faults.found:
        return None
    total = float(values[1][0])
    if total != int(total) or not 1 <= total <= MAX_SLICES:
        faults.add(f"{values[1][0]} slices; the number must be a whole one in 1 .. {MAX_SLICES}", rows[1][0])
        return None
    listed = []
    for at, line in rows[4 : 4 + int(total)]:
        match = _SLICE.match(line)
        if match is None or number_fault(match[1]) is not None:
            faults.add("position and quoted file name of a slice are needed here", at)
        else:
            listed.append((at, match[1], match[2] or match[3]))
    if len(rows) - 4 < int(total):
        missing = f"{int(total)} slices are promised, {len(rows) - 4} are listed: the file is cut off"
        faults.add(f"{missing}; copy it again", len(text.lines))
    if faults.found:
        return None
    if number is None and len(listed) > 1:
        faults.add(
            f"lists {len(listed)} slices, position {listed[0][1]} to {listed[-1][1]}; choose one with "
            f"--slice 1 .. {len(listed)}"
        )
        return None
    chosen = 1 if number is None else number
    if not 1 <= chosen <= len(listed):
        faults.add(f"--slice {chosen} must be in 1 .. {len(listed)}")
        return None
    at, position, name = listed[chosen - 1]
    header = {"slice": str(chosen), "slices": str(len(listed)), "position": position, "file": name}
    note = f"slice {chosen} of {len(listed)}, at position {position}: {name}"
    return Elsewhere(name, at, header, (note,))
