"""`wearsim profile` on one profile: measured, printed, written."""

from __future__ import annotations

import sys
from argparse import Namespace
from dataclasses import replace
from functools import partial
from pathlib import Path

from wearsim.cli import print_json
from wearsim.cli.profile_result import read_wheel
from wearsim.profile.files import WRITTEN_FORMATS, is_file, write_profile
from wearsim.profile.inspection import Inspection, inspect_profile, reprofiled_wheels, tables
from wearsim.profile.inspection.inputs import ProfileInput
from wearsim.profile.inspection.request import Request, flag_of, is_result
from wearsim.profile.placement import RUNNING_CIRCLE
from wearsim.whole_files import write_whole


def measure_one(arguments: Namespace) -> int:
    """Measure one profile, print it and write what is asked for; the exit code is 0."""
    request = Request(arguments)
    if request.name is None:
        request.raise_any()
    given = read_wheel(request, "name", request.kind)
    kind = given.kind if given is not None else request.kind
    if kind is not None:
        request.check_kind(kind, request.name)
    left = read_wheel(request, "left", "wheel") if kind != "rail" else None
    against = read_wheel(request, "against", kind)
    template = request.read("reprofile_to", "wheel") if kind != "rail" else None
    at, limits = request.common(kind)
    target = _target(request, given)
    files = [request.given[key] for key in ("name", "left", "against", "reprofile_to", "rail", "wheel")]
    if request.statements and not any(is_file(name) and not is_result(name) for name in files if name):
        stated = ", ".join(map(flag_of, request.statements))
        request.faults.append(
            f"{stated}: is a statement on a file of points, but none is given; leave it out"
        )
    request.raise_any()
    assert given is not None
    if at is not None and is_result(request.name) and against and against.format in ("definition", "result"):
        at = replace(at, align=at.align or "none")  # both are in the axes in which wheels wear
    inspection = inspect_profile(given, at, limits, left=left, against=against)
    reprofile = partial(reprofiled_wheels, inspection)
    wheels = request.take(partial(reprofile, template), "--reprofile-to") if template is not None else None
    request.raise_any()
    written = _write(request, inspection, target)
    if request.json:
        value = tables.as_json(inspection) | ({"files": written} if written else {})
        if template is not None and wheels is not None:
            value["reprofiled"] = tables.reprofiled_json(template, wheels)
        print_json(value, allow_nan=False)
        return 0
    if request.csv == "-":
        sys.stdout.write(tables.points_csv(inspection))
    else:
        print(tables.as_text(inspection))
        if template is not None and wheels is not None:
            print("\n" + tables.reprofiled_text(template, wheels))
    for line in written:
        print(f"wrote {line}", file=sys.stderr if request.csv == "-" else sys.stdout)
    return 0


def _target(request: Request, given: ProfileInput | None) -> Path | None:
    """File of the conversion, checked."""
    if request.convert is None:
        return None
    circle = request.numbers.get("running_circle_mm") or (given.running_circle if given else RUNNING_CIRCLE)
    if circle != RUNNING_CIRCLE:
        request.faults.append(
            f"--convert writes wheels whose running circle is {1e3 * RUNNING_CIRCLE:g} mm from the flange "
            f"back, here it is {1e3 * circle:g} mm: the file would not say so; leave it out"
        )
    if given is None:
        return None
    stem = given.profile.name.replace("/", "_").replace(":", "_").replace("%", "pct")
    target = Path(request.out or f"{stem}{WRITTEN_FORMATS[request.convert][given.kind]}")
    if target.exists() and not request.overwrite:
        named = f"--out = {target}" if request.out else f"--convert: {target}"
        other = "" if request.out else " with --out"
        request.faults.append(f"{named} exists already; choose another name{other} or add --overwrite")
    return target


def _write(request: Request, inspection: Inspection, target: Path | None) -> list[str]:
    """Write the converted profile, the table and the figure; returns what was written."""
    written = [] if target is None else [_convert(request, inspection, target)]
    if request.csv not in (None, "-"):
        write_whole(Path(request.csv), tables.points_csv(inspection))
        written.append(request.csv)
    if request.plot is not None:
        from wearsim.profile.inspection.datasets import profile_dataset
        from wearsim.report.figures.profile import profile_figure
        from wearsim.report.style import write_figure

        write_figure(profile_figure(profile_dataset(inspection)), Path(request.plot))
        written.append(request.plot)
    return written


def _convert(request: Request, inspection: Inspection, target: Path) -> str:
    """Write a profile and say what was written."""
    aligned = request.against is not None and request.align is not None
    profile = inspection.aligned if aligned else inspection.given.profile
    write_profile(profile, target, request.convert, overwrite=bool(request.overwrite))
    changes = [*(["aligned"] if aligned else []), *(["smoothed"] if "smooth_mm" in request.numbers else [])]
    changed = f", {' and '.join(changes)} as stated" if changes else ""
    return f"{target} ({request.convert}, {len(profile.y)} points{changed})"
