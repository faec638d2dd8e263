"""`wearsim profile`.

Measures, limits, running behaviour, wear, conversion and figures of profiles.
"""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from wearsim.cli import print_json
from wearsim.cli.streams import formula_warning
from wearsim.profile.files import WRITTEN_FORMATS, is_file, is_result, write_profile
from wearsim.profile.inspection import (
    Inspection,
    ReprofiledWheel,
    inspect_profile,
    reprofiled_wheels,
    tables,
)
from wearsim.profile.inspection.inputs import ProfileInput
from wearsim.profile.inspection.request import Request, flag_of
from wearsim.profile.inspection.tables import FleetRow, fleet_rows, profile_files
from wearsim.toml_faults import decimal
from wearsim.translation.worn_wheel import Side, WornWheel, worn_wheel
from wearsim.whole_files import write_whole


def read_wheel(request: Request, key: str, kind: str | None) -> ProfileInput | None:
    """Profile of a flag.

    Of a result file the wheel, whose back-to-back distance acts if none is stated.
    """
    if not is_result(request.given[key]):
        return request.read(key, kind)
    if request.kind == "rail":
        request.faults.append(
            f"--kind rail: {request.given[key]} is a result file, its profiles are "
            "wheels"
        )
    path = Path(request.given[key])
    side: Side = "left" if "left" in (key, request.side) else "right"
    wheel_input = request.take(
        lambda: input_of(path, side, request.at_km),
        "" if key == "name" else flag_of(key),
    )
    if wheel_input is None:
        return None
    wheel, worn = wheel_input
    if key != "against":
        request.numbers.setdefault("back_to_back", worn.back_to_back)
        request.numbers.setdefault("measuring_height", worn.rule.height)
        request.numbers.setdefault("running_circle", worn.rule.running_circle)
    return wheel


def input_of(
    path: Path, side: Side, at_km: str | None
) -> tuple[ProfileInput, WornWheel]:
    """Wheel of a result file, see `worn_wheel`, and what the file states of it."""
    distance = None if at_km is None else 1e3 * decimal(at_km)
    worn = worn_wheel(path, side, distance, f"--at-km = {at_km}")
    notes = (
        f"{side} wheel after {worn.when}",
        f"z counts from the new running circle, radius {1e3 * worn.radius:g} mm; now "
        f"the diameter is {1e3 * worn.diameter:.3f} mm there",
        f"this diameter and the back-to-back distance {1e3 * worn.back_to_back:g} mm "
        "are taken, if none is stated",
    )
    wheel = ProfileInput(
        profile=worn.profile,
        format="result",
        header={},
        notes=notes,
        given=str(path),
        title="worn wheel of a result file",
        source=worn.profile.source,
        diameter=worn.diameter,
    )
    return wheel, worn


def execute(arguments: Namespace) -> int:
    """Measure and print; write what is asked for."""
    return (
        measure_one(arguments) if arguments.fleet is None else measure_fleet(arguments)
    )


def measure_one(arguments: Namespace) -> int:
    """Measure one profile, print it and write what is asked for; the exit code is 0."""
    request = Request(arguments)
    if request.name is None:
        request.raise_any()
    given = read_wheel(request, "name", request.kind)
    kind = given.kind if given is not None else request.kind
    if kind is not None:
        request.check_kind(kind, arguments.name)
    left = read_wheel(request, "left", "wheel") if kind != "rail" else None
    against = read_wheel(request, "against", kind)
    template = request.read("reprofile_to", "wheel") if kind != "rail" else None
    at, limits = request.common(kind)
    _check_statements(request)
    target = None if given is None else _target(request, given)
    request.raise_any()
    assert given is not None
    if (
        is_result(request.name)
        and against
        and against.format in ("definition", "result")
    ):
        at = replace(
            at, align=at.align or "none"
        )  # both are in the axes in which wheels wear
    result = inspect_profile(given, at, limits, left=left, against=against)
    wheels = template and request.take(
        lambda: reprofiled_wheels(result, template), "--reprofile-to"
    )
    request.raise_any()
    written = _write(request, result, target)
    reprofiled = (template, wheels) if template and wheels else None
    if request.json:
        value = tables.as_json(result) | ({"files": written} if written else {})
        if reprofiled:
            value["reprofiled"] = tables.reprofiled_json(*reprofiled)
        print_json(value)
    else:
        _print_text(request, result, reprofiled, written)
    return 0


def _print_text(
    request: Request,
    result: Inspection,
    reprofiled: tuple[ProfileInput, Sequence[ReprofiledWheel]] | None,
    written: Sequence[str],
) -> None:
    """Print tables, or the points as CSV, and the files that were written."""
    if request.csv == "-":
        sys.stdout.write(tables.points_csv(result))
    else:
        print(tables.as_text(result))
        if reprofiled:
            print("\n" + tables.reprofiled_text(*reprofiled))
    for line in written:
        print(f"wrote {line}", file=sys.stderr if request.csv == "-" else sys.stdout)


def _check_statements(request: Request) -> None:
    """Record a fault of statements on files where none is given."""
    keys = ("name", "left", "against", "reprofile_to", "rail", "wheel")
    names = [request.given[key] for key in keys if request.given[key]]
    if request.statements and not any(
        is_file(name) and not is_result(name) for name in names
    ):
        stated = ", ".join(map(flag_of, request.statements))
        request.faults.append(
            f"{stated}: is a statement on a file of points, but none is given; leave "
            "it out"
        )


def _target(request: Request, given: ProfileInput) -> Path | None:
    """Path of the converted profile; a fault is recorded if it exists."""
    if request.out or request.convert is None:
        return Path(request.out) if request.out else None
    stem = given.profile.name.replace("/", "_").replace(":", "_").replace("%", "pct")
    target = Path(f"{stem}{WRITTEN_FORMATS[request.convert][given.kind]}")
    request.check_new("convert", target)
    return target


def _write(request: Request, result: Inspection, target: Path | None) -> list[str]:
    """Write the converted profile, the table and the figure.

    Returns what was written.
    """
    written = []
    if target is not None:
        aligned = request.against is not None and request.align is not None
        profile = result.aligned if aligned else result.given.profile
        write_profile(
            profile, target, request.convert, overwrite=bool(request.overwrite)
        )
        changes = [
            word
            for word, is_so in (("aligned", aligned), ("smoothed", request.smooth_mm))
            if is_so
        ]
        changed = f", {' and '.join(changes)} as stated" if changes else ""
        written.append(
            f"{target} ({request.convert}, {len(profile.y)} points{changed})"
        )
    if request.csv not in (None, "-"):
        write_whole(Path(request.csv), tables.points_csv(result))
        written.append(request.csv)
    if request.plot is not None:
        from wearsim.report.figures.profile import profile_figure
        from wearsim.report.style import write_figure

        write_figure(profile_figure(result), Path(request.plot))
        written.append(request.plot)
    return written


def measure_fleet(arguments: Namespace) -> int:
    """Measure a folder and print its table.

    The exit code is 2 if nothing could be measured.
    """
    request = Request(arguments)
    request.raise_any()
    folder = Path(arguments.fleet)
    against = request.read("against", request.kind)
    kind = request.kind or (against.kind if against is not None else "wheel")
    request.check_kind(kind, folder.name or str(folder))
    at, limits = request.common(kind)
    files, skipped = request.take(
        lambda: profile_files(folder, "format" in request.statements)
    ) or ([], [])
    if not files and not request.faults:
        request.faults.append(
            f"--fleet = {folder} holds no profile files (.whl, .ban, .prw, .csv, ...); "
            "give another folder, or the format of all its files with --format"
        )
    request.raise_any()
    rows = []
    for row in fleet_rows(files, at, limits, kind=request.kind, against=against):
        rows.append(row)
        _show_progress(len(rows), len(files))
    table = tables.fleet_csv(rows)
    if request.csv is not None:
        formula_warning(table, "--csv")
    if request.csv not in (None, "-"):
        write_whole(Path(request.csv), table)
        print(f"wrote {request.csv}", file=sys.stderr)
    if request.json:
        print_json({"wheels": list(map(tables.fleet_json, rows))})
    elif request.csv == "-":
        sys.stdout.write(table)
    else:
        print(tables.fleet_text(rows))
    measured = [row for row in rows if row.profile is not None]
    if request.plot is not None and measured:
        from wearsim.report.figures.profile import fleet_figure
        from wearsim.report.style import write_figure

        write_figure(
            fleet_figure(measured, against.profile if against else None),
            Path(request.plot),
        )
        print(f"wrote {request.plot}: {len(measured)} profiles drawn", file=sys.stderr)
    print(_summary(rows, skipped, at.no_limits), file=sys.stderr)
    return 0 if measured else 2


def _show_progress(done: int, count: int) -> None:
    if sys.stderr.isatty():
        end = "" if done < count else "\r" + " " * 40 + "\r"
        text = f"\r{done} of {count} files"
        print(text, end=end, file=sys.stderr, flush=True)


def _summary(rows: Sequence[FleetRow], skipped: Sequence[str], no_limits: str) -> str:
    """Count files, faults and files that are left out; say why limits are not used."""
    measured = [row for row in rows if row.profile is not None]
    faulty = len(rows) - len(measured)
    alone = sum(1 for row in measured if row.values["fault"])
    summary = [f"{len(rows)} files: {len(measured)} measured, {faulty} with faults"]
    summary += [f"{alone} not compared"] if alone else []
    summary += [f"no limits compared: {no_limits}"] if no_limits else []
    if skipped:
        names = ", ".join(skipped[:3]) + (", ..." if len(skipped) > 3 else "")
        summary.append(f"{len(skipped)} other files or folders left out ({names})")
    return "; ".join(summary)
