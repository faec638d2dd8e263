"""`wearsim profile --fleet DIR`: a folder of measurements as one table, and a page of small figures."""

from __future__ import annotations

import csv
import io
import json
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from wearsim.cli.profile_flags import Request
from wearsim.cli.profile_run import Collected, circumstances, kind_faults, save
from wearsim.errors import Fault
from wearsim.profile.limits import load_limits
from wearsim.quantities import QUANTITIES
from wearsim.studies.profile_examination import counterpart_of
from wearsim.studies.profile_fleet import FleetRow, fleet_rows, fleet_state, profile_files
from wearsim.studies.profile_subject import Subject, read_subject

COLUMNS = {
    # column: quantity, digits
    "Sh_mm": ("flange_height", 3),
    "Sd_mm": ("flange_thickness", 3),
    "qR_mm": ("flange_gradient", 3),
    "hollowing_mm": ("hollowing", 3),
    "rim_width_mm": ("rim_width", 3),
    "diameter_mm": ("wheel_diameter", 3),
    "conicity_3mm": ("equivalent_conicity", 4),
    "worn_area_mm2": ("worn_area", 3),
    "max_wear_depth_mm": ("max_wear_depth", 4),
    "rms_um": ("alignment_rms", 1),
}
"""Measures of the table."""

_IDENTITY = ("wheel", "kind", "format", "stock", "car", "axle", "side", "align")
_SHOWN = {"Sh_mm": "Sh", "Sd_mm": "Sd", "qR_mm": "qR", "hollowing_mm": "hollow", "diameter_mm": "D",
          "conicity_3mm": "conicity", "worn_area_mm2": "area mm²", "max_wear_depth_mm": "depth",
          "rms_um": "rms µm"}  # fmt: skip
_SHORT = {"flange_height": "Sh", "flange_thickness": "Sd", "flange_gradient": "qR", "hollowing": "hollow",
          "rim_width": "rim", "wheel_diameter": "D", "equivalent_conicity": "conicity",
          "back_to_back": "AR", "front_to_front": "SR"}  # fmt: skip


def measure_fleet(request: Request) -> int:
    """Measure a folder and print its table; the exit code is 2 if nothing could be measured."""
    assert request.fleet is not None
    found = Collected([])
    folder = request.fleet
    against: Subject | None = None
    if request.against is not None:
        against = found.take(
            lambda: read_subject(str(request.against), request.kind, request.said), "--against"
        )
    kind = request.kind or (against.kind if against is not None else "wheel")
    found.faults += [Fault(fault) for fault in kind_faults(request, kind, folder.name or str(folder))]
    limits = found.take(lambda: load_limits(request.limits or "TSI"), "--limits" if request.limits else "")
    at = found.take(lambda: circumstances(request))
    if at is not None and at.counterpart is not None:
        found.take(lambda: counterpart_of(kind, at), "--rail" if kind == "wheel" else "--wheel")
    listed = found.take(lambda: profile_files(folder, every="format" in request.said))
    if listed is not None and not listed[0]:
        found.faults.append(
            Fault(f"--fleet = {folder} holds no profile files (.whl, .ban, .prw, .csv, ...); give another "
                  "folder, or the format of all its files with --format")
        )  # fmt: skip
    found.refuse()
    assert at is not None
    assert listed is not None
    rows = []
    for row in fleet_rows(listed[0], at, limits, kind=request.kind, against=against):
        rows.append(row)
        if sys.stderr.isatty():
            print(f"\r{len(rows)} of {len(listed[0])} files", end="", file=sys.stderr, flush=True)
    if sys.stderr.isatty():
        print("\r" + " " * 40 + "\r", end="", file=sys.stderr)
    _print(request, rows)
    _plot(request, rows, against, limits)
    faulty = sum(1 for row in rows if not row.measured)
    doubtful = sum(1 for row in rows if row.measured and row.fault)
    told = [f"{len(rows)} files: {len(rows) - faulty} measured, {faulty} with faults"]
    told += [f"{doubtful} not compared"] if doubtful else []
    told += [f"{len(listed[1])} other files or folders left out ({_some(listed[1])})"] if listed[1] else []
    print("; ".join(told), file=sys.stderr)
    return 0 if faulty < len(rows) else 2


def _some(names: Sequence[str]) -> str:
    return ", ".join(names[:3]) + (", ..." if len(names) > 3 else "")


def _print(request: Request, rows: list[FleetRow]) -> None:
    """Print the table in the form wanted, or write it."""
    if request.csv not in (None, "-"):
        save(Path(str(request.csv)), _csv(rows))
        print(f"wrote {request.csv}", file=sys.stderr)
    if request.json:
        print(
            json.dumps(
                {"wheels": [_json(row) for row in rows]}, indent=2, ensure_ascii=False, allow_nan=False
            )
        )
    elif request.csv == "-":
        sys.stdout.write(_csv(rows))
    else:
        print(_text(rows))


def _plot(request: Request, rows: list[FleetRow], against: Subject | None, limits: object) -> None:
    """Draw all measured profiles on as many pages as it takes."""
    if request.plot is None or not any(row.measured for row in rows):
        return
    from wearsim.profile.limits import LimitSet
    from wearsim.report.pages_fleet import write_fleet

    state = fleet_state(rows, against, limits if isinstance(limits, LimitSet) else None)
    pages, drawn = write_fleet(state, request.plot)
    total = sum(1 for row in rows if row.measured)
    missing = f" of {total} measured" if drawn < total else ""
    print(f"wrote {', '.join(map(str, pages))}: {drawn}{missing} profiles drawn", file=sys.stderr)


def _cells(row: FleetRow) -> dict[str, str]:
    """Cells of a row by column."""
    cells = {"file": row.file, "wheel": row.wheel}
    cells |= {key: row.identity.get(key, "") for key in _IDENTITY[1:]}
    for column, (name, digits) in COLUMNS.items():
        value = row.values.get(name)
        factor = QUANTITIES[name].shown_factor
        cells[column] = "" if value is None else f"{value * factor:.{digits}f}"
    cells["exceeded"] = " ".join(_SHORT.get(name, name) for name in row.exceeded)
    cells["not_judged"] = " ".join(_SHORT.get(name, name) for name in row.not_judged)
    cells["notes"] = "; ".join(row.notes)
    cells["fault"] = row.fault
    return cells


def _csv(rows: Iterable[FleetRow]) -> str:
    text = io.StringIO()
    columns = ["file", *_IDENTITY, *COLUMNS, "exceeded", "not_judged", "notes", "fault"]
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(_cells(row) for row in rows)
    return text.getvalue()


def _json(row: FleetRow) -> dict[str, object]:
    """SI values of a row."""
    return {
        "file": row.file,
        "wheel": row.wheel,
        **row.identity,
        **{name: row.values.get(name) for name, _ in COLUMNS.values()},
        "exceeded": list(row.exceeded),
        "not_judged": list(row.not_judged),
        "notes": list(row.notes),
        "fault": row.fault or None,
    }


def _text(rows: list[FleetRow]) -> str:
    """Table for people: columns that hold something, faults in their row."""
    cells = [_cells(row) for row in rows]
    used = [column for column in _SHOWN if any(cell[column] for cell in cells)]
    width = {
        "file": max([4, *(len(row.file) for row in rows)]),
        "wheel": max([5, *(len(r.wheel) for r in rows)]),
    }
    width = {key: min(value, 32) for key, value in width.items()}
    lines = [
        f"{'file':<{width['file']}}  {'wheel':<{width['wheel']}}"
        + "".join(f"{_SHOWN[column]:>10}" for column in used)
        + "  beyond limits, faults"
    ]
    for row, cell in zip(rows, cells, strict=True):
        name, wheel = (_cut(cell[key], width[key]) for key in ("file", "wheel"))
        start = f"{name:<{width['file']}}  {wheel if row.measured else '':<{width['wheel']}}"
        told = [cell["exceeded"]] if cell["exceeded"] else []
        told += [f"not judged: {cell['not_judged']}"] if cell["not_judged"] else []
        told += ["wear doubtful"] if row.doubts else []
        told += [f"FAULT {cell['fault']}"] if cell["fault"] else []
        numbers = "".join(f"{cell[column] or '-':>10}" for column in used) if row.measured else ""
        lines.append(f"{start}{numbers}  {'; '.join(told)}".rstrip())
    if any(row.not_judged and "wheel_diameter" not in row.values for row in rows):
        lines.append(
            "not judged: some limits depend on the wheel diameter, which is not given (--diameter-mm)"
        )
    if any(row.doubts for row in rows):
        lines += [f"wear doubtful: {doubt}" for doubt in _doubts(rows)]
    lines.append("lengths in mm" + ("" if "conicity_3mm" not in used else "; conicity at 3 mm, EN 15302"))
    return "\n".join(lines)


def _doubts(rows: list[FleetRow]) -> list[str]:
    """Tell doubts that all rows with doubts share; else where they are told."""
    each = [set(row.doubts) for row in rows if row.doubts]
    shared = set.intersection(*each)
    told = [doubt for row in rows for doubt in row.doubts if doubt in shared]
    more = (
        []
        if all(doubts == shared for doubts in each)
        else ["the reasons are in the notes of --csv and --json"]
    )
    return [*dict.fromkeys(told), *more]


def _cut(text: str, most: int) -> str:
    return text if len(text) <= most else f"{text[: most - 1]}…"
