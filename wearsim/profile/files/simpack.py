"""SIMPACK profiles `.prr` (rail) and `.prw` (wheel).

The keys are applied in the order in which the program CONTACT (open source) applies
them, which its users have checked against SIMPACK.
"""

from __future__ import annotations

import re
from decimal import Decimal

import numpy as np

from wearsim.profile.files.points import (
    Faults,
    Points,
    Row,
    Text,
    number_fault,
    read_columns,
)
from wearsim.profile.shape import Kind

SUFFIXES = {".prr": "rail", ".prw": "wheel"}
_BLOCK = re.compile(r"(header|spline|point)\.(begin|end)", re.IGNORECASE)
_KIND = {"0": "rail", "1": "wheel"}
_APPLIED = {
    "shift.y": "0",
    "shift.z": "0",
    "rotate": "0",
    "bound.y.min": "1",
    "bound.y.max": "0",
    "bound.z.min": "1",
    "bound.z.max": "0",
    "mirror.y": "0",
    "mirror.z": "0",
    "inversion": "0",
    "units.len.f": "1000",
}
"""Keys of the spline block that are applied, with their defaults.

Bounds whose lower limit exceeds the upper one are off.
"""


def recognises(text: Text) -> bool:
    """Return True if a file has the blocks of SIMPACK."""
    return any(
        line.strip().lower().startswith(("spline.begin", "header.begin"))
        for line in text.lines[:500]
    )


def read(text: Text, kind: Kind, faults: Faults) -> Points:
    """Read the points of the spline block, transformed by its keys, which are reported.

    The keys bound, shift, mirror or invert the points. `!` begins a comment; the blocks
    are `header`, `spline` and in it `point`.
    """
    header, lines, rows = _parts(text, faults)
    columns = read_columns(
        rows, faults, need="2 or 3: y, z, and weights, which are not used", most=3
    )
    _structure_faults(text, kind, header, lines, faults)
    keys = _applied(header, lines, faults)
    faults.raise_any()

    # exact decimals
    y, z = columns["y"] + keys["shift.y"], columns["z"] + keys["shift.z"]
    if keys["bound.z.min"] < keys["bound.z.max"]:
        z = np.array(
            [
                min(max(height, keys["bound.z.min"]), keys["bound.z.max"])
                for height in z
            ],
            dtype=object,
        )
    use = np.full(len(y), fill_value=True)
    if keys["bound.y.min"] < keys["bound.y.max"]:
        use = (keys["bound.y.min"] <= y) & (y <= keys["bound.y.max"])
    order = np.flatnonzero(use)[:: -1 if keys["inversion"] else 1]
    acting = [
        f"{name} = {header[name]}"
        for name in _APPLIED
        if keys[name] != Decimal(_APPLIED[name])
    ]
    notes = [f"applied: {', '.join(acting)}"] if acting else []
    if not header.get("units.len.f"):
        notes.append("units.len.f is not given: lengths are taken as mm")
    return Points(
        lines=[columns["lines"][k] for k in order],
        y=-y[order] if keys["mirror.y"] else y[order],
        z=-z[order] if keys["mirror.z"] else z[order],
        y_axis="field",
        z_axis="down",
        unit=(Decimal(1) / keys["units.len.f"]).normalize(),
        header=header,
        notes=tuple(notes),
    )


def _parts(
    text: Text, faults: Faults
) -> tuple[dict[str, str], dict[str, int], list[Row]]:
    """Values of the keys, lines of keys and of marks of blocks, and rows of points."""
    header: dict[str, str] = {}
    lines: dict[str, int] = {}
    rows: list[Row] = []
    inside = ""
    for number, raw in enumerate(text.lines, start=1):
        line = raw.split("!", 1)[0].strip()
        if match := _BLOCK.match(line):
            mark = match[0].lower()
            if mark in lines:
                first = f"a second {mark}, the first is in line {lines[mark]}"
                faults.add(f"{first}: two profiles are joined; give one", number)
            lines.setdefault(mark, number)
            inside = match[1].lower() if mark.endswith("begin") else ""
        elif line and inside == "point":
            rows.append((number, line))
        elif "=" in line:
            key, _, value = line.partition("=")
            name = (
                f"header.{key.strip().lower()}"
                if inside == "header"
                else key.strip().lower()
            )
            header[name], lines[name] = value.strip().strip("'"), number
        # some writers list keys without a value: the defaults apply
    return header, lines, rows


def _structure_faults(
    text: Text,
    kind: Kind,
    header: dict[str, str],
    lines: dict[str, int],
    faults: Faults,
) -> None:
    """Add faults of missing blocks and of the kind of the profile."""
    if "point.begin" not in lines:
        faults.add(
            "holds no point.begin block, so it is no SIMPACK profile; state another "
            "--format"
        )
    for end in ("point.end", "spline.end"):
        if end.replace("end", "begin") in lines and end not in lines:
            faults.add(
                f"{end} is missing: the file is cut off; copy it again", len(text.lines)
            )
            break
    stated = header.get("header.type", "")
    if _KIND.get(stated, kind) != kind:
        faults.add(
            f"type = {stated} says {_KIND[stated]}, a {kind} profile is needed",
            lines["header.type"],
        )


def _applied(
    header: dict[str, str], lines: dict[str, int], faults: Faults
) -> dict[str, Decimal]:
    """Values of the keys that are applied, with faults of their numbers."""
    keys: dict[str, Decimal] = {}
    for name, default in _APPLIED.items():
        text_of = header.get(name) or default
        if fault := number_fault(text_of):
            faults.add(f"{name} = {text_of[:40]!r} {fault}", lines[name])
        keys[name] = Decimal(default if fault else text_of)
    if keys["rotate"] != 0:
        message = (
            f"rotate = {header['rotate']} is not applied by this reader: turn the "
            "points first"
        )
        faults.add(message, lines["rotate"])
    if keys["units.len.f"] <= 0:
        message = f"units.len.f = {keys['units.len.f']} must be above 0 (1000 for mm)"
        faults.add(message, lines["units.len.f"])
    return keys


def framed(points: list[str], title: str, comment: str, kind: Kind) -> list[str]:
    """Lines of a file with these lines of points, and with keys at their defaults."""
    kinds = {word: number for number, word in _KIND.items()}
    keys = {
        "approx.smooth": "0",
        "comment": f"'{comment}'",
        "type": kinds[kind],
        "point.dist.min": "0",
    }
    spline = [
        f"  {key:<14} = {value}"
        for key, value in (keys | _APPLIED | {"units.ang.f": "1"}).items()
    ]
    header = ["  version       = 1", f"  type          = {kinds[kind]}"]
    head = [
        f"! {title}",
        "header.begin",
        *header,
        "header.end",
        "spline.begin",
        *spline,
        "  point.begin",
    ]
    return [*head, *points, "  point.end", "spline.end"]
