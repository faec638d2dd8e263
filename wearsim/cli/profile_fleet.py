"""`wearsim profile --fleet`: every profile of a folder measured, printed as one table, written."""

from __future__ import annotations

import sys
from argparse import Namespace
from pathlib import Path

from wearsim.cli import print_json
from wearsim.cli.streams import formula_warning
from wearsim.profile.inspection import tables
from wearsim.profile.inspection.fleet import fleet_rows, profile_files
from wearsim.profile.inspection.request import Request
from wearsim.whole_files import write_whole


def measure_fleet(arguments: Namespace) -> int:
    """Measure a folder and print its table; the exit code is 2 if nothing could be measured."""
    request = Request(arguments)
    request.raise_any()
    folder = Path(request.fleet)
    against = request.read("against", request.kind)
    kind = request.kind or (against.kind if against is not None else "wheel")
    request.check_kind(kind, folder.name or str(folder))
    at, limits = request.common(kind)
    listed = request.take(lambda: profile_files(folder, every="format" in request.statements))
    if listed is not None and not listed[0]:
        request.faults.append(
            f"--fleet = {folder} holds no profile files (.whl, .ban, .prw, .csv, ...); give another folder, "
            "or the format of all its files with --format"
        )
    request.raise_any()
    assert at is not None and listed is not None  # noqa: PT018 - both follow from the line above
    files, skipped = listed
    rows = []
    for row in fleet_rows(files, at, limits, kind=request.kind, against=against):
        rows.append(row)
        if sys.stderr.isatty():
            end = "" if len(rows) < len(files) else "\r" + " " * 40 + "\r"
            print(f"\r{len(rows)} of {len(files)} files", end=end, file=sys.stderr, flush=True)
    if request.csv is not None:
        formula_warning(tables.fleet_csv(rows), "--csv")
    if request.csv not in (None, "-"):
        write_whole(Path(request.csv), tables.fleet_csv(rows))
        print(f"wrote {request.csv}", file=sys.stderr)
    if request.json:
        print_json({"wheels": [tables.fleet_json(row) for row in rows]}, allow_nan=False)
    elif request.csv == "-":
        sys.stdout.write(tables.fleet_csv(rows))
    else:
        print(tables.fleet_text(rows))
    measured = [row for row in rows if row.measured]
    if request.plot is not None and measured:
        from wearsim.profile.inspection.datasets import fleet_dataset
        from wearsim.report.figures.fleet import write_fleet

        pages, drawn = write_fleet(fleet_dataset(rows, against, limits), Path(request.plot))
        of_all = f" of {len(measured)} measured" if drawn < len(measured) else ""
        print(f"wrote {', '.join(map(str, pages))}: {drawn}{of_all} profiles drawn", file=sys.stderr)
    faulty, alone = len(rows) - len(measured), sum(1 for row in measured if row.fault)
    summary = [f"{len(rows)} files: {len(measured)} measured, {faulty} with faults"]
    summary += [f"{alone} not compared"] if alone else []
    if skipped:
        names = ", ".join(skipped[:3]) + (", ..." if len(skipped) > 3 else "")
        summary.append(f"{len(skipped)} other files or folders left out ({names})")
    print("; ".join(summary), file=sys.stderr)
    return 0 if measured else 2
