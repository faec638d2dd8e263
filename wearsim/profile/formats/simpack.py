"""SIMPACK profiles `.prr` (rail) and `.prw` (wheel).

The keys are applied in the order in which the program CONTACT (open source) applies them, which its users
have checked against SIMPACK.
"""

from __future__ import annotations

import math
import re
from decimal import Decimal
from typing import Literal

from wearsim.profile.formats.points import (
    EXACT,
    Columns,
    Points,
    number_fault,
    separator_of,
    split_cells,
)
from wearsim.profile.formats.text import Faults, Text

SUFFIXES = {".prr": "rail", ".prw": "wheel"}
_BLOCK = re.compile(r"(header|spline|point)\.(begin|end)", re.IGNORECASE)
_KIND = {"0": "rail", "1": "wheel"}


def recognises(text: Text, suffix: str) -> bool:
    """Tell a SIMPACK file by its blocks, or by its extension."""
    lines = (line.strip().lower() for line in text.lines[:500])
    return any(line.startswith(("spline.begin", "header.begin")) for line in lines) or suffix in SUFFIXES


def read(text: Text, kind: Literal["wheel", "rail"], faults: Faults) -> Points:
    """Points of the spline block, with its keys applied.

    Parameters
    ----------
    text : Text
        `!` begins a comment; blocks `header`, `spline` and in it `point`.
    kind : {"wheel", "rail"}
        What is expected; the header may contradict.
    faults : Faults
        Takes what is wrong.

    Returns
    -------
    Points
        Thinned, bounded and inverted; shifts, mirrors and the unit of length are told.
    """
    header: dict[str, str] = {}
    at: dict[str, int] = {}
    found = Columns(faults)
    weights: set[str] = set()
    seen: dict[str, int] = {}
    inside: list[str] = []
    separator: str | None = None
    for number, raw in enumerate(text.lines, start=1):
        line = raw.split("!", 1)[0].strip()
        if not line:
            continue
        block = _BLOCK.match(line)
        if block:
            _enter(block[1].lower(), block[2].lower(), number, inside, seen, faults)
        elif inside and inside[-1] == "point":
            separator = separator_of(line) if separator is None else separator
            cells = split_cells(line, separator)
            if len(cells) in (2, 3):
                found.add(number, cells[0], cells[1], separator)
                weights.update(cells[2:])
            else:
                faults.add(
                    f"{len(cells)} columns in the point block, y, z and at most a weight are read", number
                )
        elif "=" in line:
            key, _, value = line.partition("=")
            key = key.strip().lower()
            name = f"header.{key}" if inside == ["header"] else key
            header[name], at[name] = value.strip().strip("'"), number
        # some writers leave bare keys without a value: the defaults hold
    if "point" not in seen:
        faults.add("holds no point.begin block, so it is no SIMPACK profile; state another --format")
    elif inside:
        faults.add(f"{inside[-1]}.end is missing: the file is cut off; copy it again", len(text.lines))
    notes = [] if not weights - {"1", "1.0"} else ["weights of the points are not used"]
    _check_kind(header, at, kind, faults)
    return _applied(found, header, at, faults, notes)


def _enter(
    block: str, mark: str, number: int, inside: list[str], seen: dict[str, int], faults: Faults
) -> None:
    """Open or close a block."""
    if mark == "end":
        if inside[-1:] == [block]:
            inside.pop()
        else:
            faults.add(f"{block}.end without {block}.begin", number)
        return
    if block in seen:
        faults.add(
            f"a second {block}.begin, the first is in line {seen[block]}: two profiles are joined; give one",
            number,
        )
    seen.setdefault(block, number)
    inside.append(block)


def _check_kind(header: dict[str, str], at: dict[str, int], kind: str, faults: Faults) -> None:
    """Refuse a rail where a wheel is needed."""
    told = _KIND.get(header.get("header.type", ""))
    if told is not None and told != kind:
        faults.add(
            f"type = {header['header.type']} says {told}, a {kind} profile is needed", at["header.type"]
        )


def _key(header: dict[str, str], at: dict[str, int], name: str, default: str, faults: Faults) -> Decimal:
    """Value of a key; an empty one stands for the default."""
    value = header.get(name) or default
    wrong = number_fault(value)
    if wrong is not None:
        faults.add(f"{name} = {value[:40]!r} {wrong}", at.get(name))
        return Decimal(default)
    return Decimal(value)


def _applied(
    found: Columns, header: dict[str, str], at: dict[str, int], faults: Faults, notes: list[str]
) -> Points:
    """Apply the keys of the spline block in their order."""

    def key(name: str, default: str = "0") -> Decimal:
        return _key(header, at, name, default, faults)

    shift_y, shift_z = key("shift.y"), key("shift.z")
    rows = list(zip(found.lines, found.y, found.z, strict=True))
    rows = _thinned(rows, float(key("point.dist.min")), notes)
    if key("rotate") != 0:
        faults.add(
            f"rotate = {header['rotate']} is not applied by this reader: turn the points and set it to 0",
            at["rotate"],
        )
    low, high = key("bound.y.min", "1"), key("bound.y.max")
    if low < high:
        kept = [row for row in rows if low <= Decimal(row[1]) + shift_y <= high]
        if len(kept) < len(rows):
            notes.append(f"{len(rows) - len(kept)} points outside bound.y left out")
        rows = kept
    low, high = key("bound.z.min", "1"), key("bound.z.max")
    if low < high:
        rows, clipped = _clipped(rows, low - shift_z, high - shift_z)
        if clipped:
            notes.append(f"{clipped} points clipped to bound.z")
    for name, value in (("shift.y", shift_y), ("shift.z", shift_z)):
        if value != 0:
            notes.append(f"{name} = {header[name]} added")
    mirror_y, mirror_z, inversion = (key(name) != 0 for name in ("mirror.y", "mirror.z", "inversion"))
    for name, on in (("mirror.y", mirror_y), ("mirror.z", mirror_z)):
        if on:
            notes.append(f"{name} applied")
    if inversion:
        rows.reverse()
    per_metre = key("units.len.f", "1000")
    if per_metre <= 0:
        faults.add(f"units.len.f = {per_metre} must be above 0 (1000 for mm)", at.get("units.len.f"))
        per_metre = Decimal(1000)
    if per_metre != Decimal(1000):
        unit = "m" if per_metre == 1 else f"1/{per_metre} m"
        notes.append(f"units.len.f = {per_metre}: lengths in {unit}")
    if not header.get("units.len.f"):
        notes.append("units.len.f is not given: lengths are taken as mm")
    metres = EXACT.divide(Decimal(1), per_metre).normalize()
    return Points(
        [row[0] for row in rows],
        [row[1] for row in rows],
        [row[2] for row in rows],
        "field",
        "down",
        shift_y,
        shift_z,
        mirror_y,
        mirror_z,
        metres,
        header=header,
        notes=tuple(notes),
    )


def _thinned(rows: list[tuple[int, str, str]], least: float, notes: list[str]) -> list[tuple[int, str, str]]:
    """Leave out points closer than `least` to the one kept before them."""
    if least <= 0.0 or not rows:
        return rows
    kept = rows[:1]
    y, z = float(rows[0][1]), float(rows[0][2])
    for row in rows[1:]:
        y_new, z_new = float(row[1]), float(row[2])
        if math.hypot(y_new - y, z_new - z) >= least:
            kept.append(row)
            y, z = y_new, z_new
    if len(kept) < len(rows):
        notes.append(f"{len(rows) - len(kept)} points closer than point.dist.min left out")
    return kept


def _clipped(
    rows: list[tuple[int, str, str]], low: Decimal, high: Decimal
) -> tuple[list[tuple[int, str, str]], int]:
    """Bring z into the bounds."""
    out, count = [], 0
    for line, y, z in rows:
        inside = min(max(Decimal(z), low), high)
        changed = inside != Decimal(z)
        count += changed
        out.append((line, y, str(inside) if changed else z))
    return out, count
