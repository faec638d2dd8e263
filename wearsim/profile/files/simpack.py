"""SIMPACK profiles `.prr` (rail) and `.prw` (wheel).

The keys are applied in the order in which the program CONTACT (open source) applies them, which its users
have checked against SIMPACK.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from decimal import Decimal

from wearsim.profile.files.points import EXACT, Columns, Faults, Points, Text, number_fault
from wearsim.profile.shape import Kind

SUFFIXES = {".prr": "rail", ".prw": "wheel"}
_BLOCK = re.compile(r"(header|spline|point)\.(begin|end)", re.IGNORECASE)
_KIND = {"0": "rail", "1": "wheel"}
_Row = tuple[int, str, str]


@dataclass
class _Header:
    """Keys of the blocks with their lines."""

    faults: Faults
    values: dict[str, str] = field(default_factory=dict)
    lines: dict[str, int] = field(default_factory=dict)

    def number(self, name: str, default: str = "0") -> Decimal:
        """Value of a key; an empty one stands for the default."""
        value = self.values.get(name) or default
        wrong = number_fault(value)
        if wrong is not None:
            self.faults.add(f"{name} = {value[:40]!r} {wrong}", self.lines.get(name))
            return Decimal(default)
        return Decimal(value)


def recognises(text: Text) -> bool:
    """Whether a file has the blocks of SIMPACK."""
    return any(line.strip().lower().startswith(("spline.begin", "header.begin")) for line in text.lines[:500])


def read(text: Text, kind: Kind, faults: Faults) -> Points:
    """Points of the spline block: thinned, bounded and inverted; shifts, mirrors and unit are reported.

    `!` begins a comment; blocks are `header`, `spline` and in it `point`.
    """
    header, points = _Header(faults), Columns(faults)
    weights: set[str] = set()
    marks: dict[str, int] = {}  # lines of point.begin and so on
    inside = ""
    for number, raw in enumerate(text.lines, start=1):
        line = raw.split("!", 1)[0].strip()
        if match := _BLOCK.match(line):
            mark = match[0].lower()
            if mark in marks:
                first = f"a second {mark}, the first is in line {marks[mark]}"
                faults.add(f"{first}: two profiles are joined; give one", number)
            marks.setdefault(mark, number)
            inside = match[1].lower() if mark.endswith("begin") else ""
        elif line and inside == "point":
            cells = points.cells(line)
            if len(cells) in (2, 3):
                points.add(number, cells[0], cells[1])
                weights.update(cells[2:])
            else:
                faults.add(f"number of columns = {len(cells)} must be 2 or 3: y, z, and weights", number)
        elif "=" in line:
            key, _, value = line.partition("=")
            name = f"header.{key.strip().lower()}" if inside == "header" else key.strip().lower()
            header.values[name], header.lines[name] = value.strip().strip("'"), number
        # some writers leave bare keys without a value: the defaults hold
    if "point.begin" not in marks:
        faults.add("holds no point.begin block, so it is no SIMPACK profile; state another --format")
    for end in ("point.end", "spline.end"):
        if end.replace("end", "begin") in marks and end not in marks:
            faults.add(f"{end} is missing: the file is cut off; copy it again", len(text.lines))
            break
    stated = header.values.get("header.type", "")
    if _KIND.get(stated, kind) != kind:
        message = f"type = {stated} says {_KIND[stated]}, a {kind} profile is needed"
        faults.add(message, header.lines["header.type"])
    return _applied(points, header, ["weights of the points are not used"] if weights - {"1", "1.0"} else [])


def _applied(points: Columns, header: _Header, notes: list[str]) -> Points:
    """Apply the keys of the spline block in their order."""
    key, values, faults = header.number, header.values, header.faults
    shift_y, shift_z = key("shift.y"), key("shift.z")
    rows = _thinned(
        list(zip(points.lines, points.y, points.z, strict=True)), float(key("point.dist.min")), notes
    )
    if key("rotate") != 0:
        message = f"rotate = {values['rotate']} is not applied by this reader: turn the points first"
        faults.add(message, header.lines["rotate"])
    low, high = key("bound.y.min", "1") - shift_y, key("bound.y.max") - shift_y
    if low < high:
        within = [row for row in rows if low <= Decimal(row[1]) <= high]
        if len(within) < len(rows):
            notes.append(f"{len(rows) - len(within)} points outside bound.y left out")
        rows = within
    low, high = key("bound.z.min", "1") - shift_z, key("bound.z.max") - shift_z
    if low < high:
        outside = sum(not low <= Decimal(z) <= high for _, _, z in rows)
        rows = [(line, y, str(min(max(Decimal(z), low), high))) for line, y, z in rows]
        if outside:
            notes.append(f"{outside} points clipped to bound.z")
    notes += [f"{name} = {values[name]} added"
              for name, by in (("shift.y", shift_y), ("shift.z", shift_z)) if by != 0]  # fmt: skip
    mirror_y, mirror_z, inversion = (key(name) != 0 for name in ("mirror.y", "mirror.z", "inversion"))
    notes += [f"{name} applied" for name, on in (("mirror.y", mirror_y), ("mirror.z", mirror_z)) if on]
    if inversion:
        rows.reverse()
    per_metre = key("units.len.f", "1000")
    if per_metre <= 0:
        faults.add(f"units.len.f = {per_metre} must be above 0 (1000 for mm)", header.lines["units.len.f"])
        per_metre = Decimal(1000)
    elif not values.get("units.len.f"):
        notes.append("units.len.f is not given: lengths are taken as mm")
    elif per_metre != 1000:
        notes.append(f"units.len.f = {per_metre}: lengths in {'m' if per_metre == 1 else f'1/{per_metre} m'}")
    lines, y, z = (list(column) for column in zip(*rows, strict=True)) if rows else ([], [], [])
    return Points(
        lines, y, z, "field", "down", shift_y, shift_z, mirror_y, mirror_z,
        metres=EXACT.divide(Decimal(1), per_metre).normalize(), header=values, notes=tuple(notes),
    )  # fmt: skip


def _thinned(rows: list[_Row], least: float, notes: list[str]) -> list[_Row]:
    """Leave out points closer than `least` to the one kept before them."""
    if least <= 0.0 or not rows:
        return rows
    kept = rows[:1]
    for row in rows[1:]:
        if math.dist(*([float(cell) for cell in each[1:]] for each in (row, kept[-1]))) >= least:
            kept.append(row)
    if len(kept) < len(rows):
        notes.append(f"{len(rows) - len(kept)} points closer than point.dist.min left out")
    return kept
