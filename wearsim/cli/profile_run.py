"""`wearsim profile NAME|FILE`: one profile measured, written, drawn."""

from __future__ import annotations

import csv
import io
import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np

from wearsim.cli.profile_flags import Request
from wearsim.errors import Fault, ProfileError, ResultError, SceneError
from wearsim.profile.alignment import ALIGNMENTS
from wearsim.profile.files import read_profile, write_profile
from wearsim.profile.limits import load_limits
from wearsim.profile.measures import GaugeDistances
from wearsim.profile.shape import arc_length
from wearsim.studies.profile_examination import Circumstances, Examination, counterpart_of, examine
from wearsim.studies.profile_subject import TAPE, Subject, is_file, read_subject
from wearsim.studies.profile_turning import turned

EXTENSIONS = {
    ("miniprof", "wheel"): ".whl",
    ("miniprof", "rail"): ".ban",
    ("simpack", "wheel"): ".prw",
    ("simpack", "rail"): ".prr",
    ("two-column", "wheel"): ".csv",
    ("two-column", "rail"): ".csv",
}
"""Usual extension of each written format."""

_WHEEL_ONLY = ("below_tip_mm", "level_mm", "tape_mm")
_T = TypeVar("_T")


class Collected:
    """Faults of all inputs, told together."""

    def __init__(self, faults: list[str]) -> None:
        self.faults = [Fault(fault) for fault in faults]

    def take(self, make: Callable[[], _T], flag: str = "") -> _T | None:
        """Value, or None with its faults kept, named by the flag."""
        try:
            return make()
        except ProfileError as error:
            before = f"{flag}: " if flag else ""
            self.faults += [Fault(f"{before}{line}") for line in str(error).splitlines()]
        return None

    def refuse(self) -> None:
        """Raise all faults, each once."""
        if self.faults:
            raise SceneError(list(dict.fromkeys(self.faults)))


def circumstances(request: Request) -> Circumstances:
    """Return what is stated in the flags."""
    numbers = request.numbers
    names = {"below_tip": "below_tip_mm", "level": "level_mm"}
    return Circumstances(
        distances=GaugeDistances(**{name: numbers[key] for name, key in names.items() if key in numbers}),
        tape=numbers.get("tape_mm"),
        back_to_back=numbers.get("flange_back_mm"),
        gauge=numbers.get("gauge_mm"),
        diameter=numbers.get("diameter_mm"),
        left_diameter=numbers.get("left_diameter_mm"),
        inclination=request.inclination,
        counterpart=request.rail or request.wheel,
        smooth=numbers.get("smooth_mm"),
        align=request.align or ("best_fit" if request.rotate else None),
        rotate=request.rotate,
        said=request.said,
        own_limits=request.limits is not None,
    )


def measure_one(request: Request, faults: list[str]) -> int:
    """Measure one profile, print it and write what is wanted; the exit code is 0."""
    found = Collected(faults)
    assert request.name is not None
    subject = found.take(lambda: read_subject(str(request.name), request.kind, request.said))
    kind = subject.kind if subject is not None else request.kind
    if kind is not None:
        found.faults += [Fault(fault) for fault in kind_faults(request, kind, request.name)]
    left = against = None
    if request.left is not None and kind != "rail":
        left = found.take(lambda: read_subject(str(request.left), "wheel", request.said), "--left")
    if request.against is not None:
        against = found.take(lambda: read_subject(str(request.against), kind, request.said), "--against")
    template = None
    if request.turn_to is not None and kind != "rail":
        template = found.take(lambda: read_subject(str(request.turn_to), "wheel", request.said), "--turn-to")
    limits = found.take(lambda: load_limits(request.limits or "TSI"), "--limits" if request.limits else "")
    at = found.take(lambda: circumstances(request))
    if at is not None and kind is not None and (request.rail or request.wheel):
        fitting = request.rail if kind == "wheel" else request.wheel
        if fitting is not None:
            found.take(lambda: counterpart_of(kind, at), "--rail" if kind == "wheel" else "--wheel")
    target = _target(request, subject)
    tape = request.numbers.get("tape_mm") or (subject.tape if subject is not None else TAPE)
    if request.convert is not None and tape != TAPE:
        found.faults.append(
            Fault(
                f"--convert writes wheels whose tape circle is {1e3 * TAPE:g} mm from the flange back, here "
                f"it is {1e3 * tape:g} mm: nothing would tell that in the file; leave it out"
            )
        )
    if target is not None and target.exists() and not request.overwrite:
        found.faults.append(
            Fault(f"--out = {target} exists already; choose another name or add --overwrite")
            if request.out
            else Fault(
                f"--convert: {target} exists already; choose another name with --out or add --overwrite"
            )
        )
    files = [name for name in (request.name, request.left, request.against, request.turn_to, request.rail,
                               request.wheel) if name is not None]  # fmt: skip
    if request.said and not any(map(is_file, files)):
        stated = ", ".join(f"--{key.replace('_', '-')}" for key in request.said)
        found.faults.append(Fault(f"{stated}: is a statement on a file, but no file is given; leave it out"))
    found.refuse()
    assert subject is not None
    assert at is not None
    assert limits is not None
    examination = examine(subject, at, limits, left=left, against=against)
    lathe = None if template is None else found.take(lambda: turned(examination, template), "--turn-to")
    found.refuse()
    written = _write(request, subject, examination, target)
    if request.json:
        from wearsim.cli.profile_json import as_json, turned_json

        value = as_json(examination) | ({"files": written} if written else {})
        if template is not None and lathe is not None:
            value["turned"] = turned_json(template, lathe)
        print(json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False))
        return 0
    if request.csv == "-":
        sys.stdout.write(_table(examination))
        told = sys.stderr
    else:
        from wearsim.cli.profile_print import as_text, turned_text

        print(as_text(examination))
        if template is not None and lathe is not None:
            print("\n" + turned_text(template, lathe))
        told = sys.stdout
    for line in written:
        print(f"wrote {line}", file=told)
    return 0


def kind_faults(request: Request, kind: str, name: str) -> list[str]:
    """Tell flags that say nothing about this kind of profile."""
    faults = []
    if kind == "rail":
        stated = [f"--{key.replace('_', '-')}" for key in _WHEEL_ONLY if key in request.numbers]
        stated += [f"--{key}" for key in ("left", "limits", "rail") if getattr(request, key) is not None]
        stated += ["--turn-to"] if request.turn_to is not None else []
        stated += ["--origin"] if "origin" in request.said else []
        faults += [
            f"{flag} belongs to wheels, {name} is a rail; "
            + ("give the wheel on it with --wheel" if flag == "--rail" else "leave it out")
            for flag in stated
        ]
    elif request.wheel is not None:
        faults.append(
            f"--wheel is the wheel on a rail, {name} is a wheel itself; give --left or --rail, or "
            "leave it out"
        )
    if "left_diameter_mm" in request.numbers and "diameter_mm" not in request.numbers:
        faults.append("--left-diameter-mm needs --diameter-mm, that of the right wheel")
    known = [name for name, rule in ALIGNMENTS.items() if kind in rule.kinds]
    if request.align is not None and request.align not in known:
        faults.append(f"--align = {' '.join(request.align.split())[:60]} must be one of {', '.join(known)}")
    return faults


def _target(request: Request, subject: Subject | None) -> Path | None:
    """File of the conversion."""
    if request.convert is None or subject is None:
        return None
    if request.out is not None:
        return request.out
    extension = EXTENSIONS.get((request.convert, subject.kind))
    stem = subject.profile.name.replace("/", "_").replace(":", "_").replace("%", "pct")
    return None if extension is None else Path(f"{stem}{extension}")


def _write(request: Request, subject: Subject, examination: Examination, target: Path | None) -> list[str]:
    """Write the converted profile, the table and the figure; tells what was written."""
    written = []
    if target is not None:
        assert request.convert is not None
        written.append(_convert(subject, request.convert, target, request.overwrite, examination, request))
    if request.csv not in (None, "-"):
        path = Path(str(request.csv))
        save(path, _table(examination))
        written.append(str(path))
    if request.plot is not None:
        from wearsim.report.pages_profile import profile_figure, write_figure
        from wearsim.studies.profile_state import examination_state

        write_figure(profile_figure(examination_state(examination)), request.plot)
        written.append(str(request.plot))
    return written


def _convert(
    subject: Subject,
    format: str,
    target: Path,
    overwrite: bool,
    examination: Examination,
    request: Request,
) -> str:
    """Write a profile, read it back and tell what came of it."""
    laid = request.against is not None and request.align is not None
    changed = laid or "smooth_mm" in request.numbers
    profile = examination.laid if laid else examination.subject.profile
    write_profile(profile, target, format, overwrite=overwrite)
    try:
        again = read_profile(target, subject.kind, format=format)
    except ProfileError as error:
        return f"{target} ({format}); wearsim itself would not read it back: {str(error).splitlines()[0]}"
    same = np.array_equal(again.profile.y, profile.y) and np.array_equal(again.profile.z, profile.z)
    if not same:
        return f"{target} ({format}); read back it differs: {'; '.join(again.notes[1:])}"
    how = [*(["aligned"] if laid else []), *(["smoothed"] if "smooth_mm" in request.numbers else [])]
    what = f"{' and '.join(how)} as told, " if changed else ""
    return f"{target} ({format}, {len(profile.y)} points, {what}read back with the same bits)"


def _table(examination: Examination) -> str:
    """CSV of the points, or of the wear depth along the profile."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    comparison = examination.comparison
    if comparison is None:
        profile = examination.subject.profile
        writer.writerow(["arc_length_mm", "y_mm", "z_mm"])
        columns = [arc_length(profile.y, profile.z), profile.y, profile.z]
    else:
        wear = comparison.wear
        writer.writerow(["arc_length_mm", "y_mm", "z_mm", "depth_mm"])
        columns = [wear.s, wear.y, wear.z, wear.depth]
    writer.writerows([f"{1e3 * value:.6f}" for value in row] for row in zip(*columns, strict=True))
    return text.getvalue()


def save(path: Path, text: str) -> None:
    """Write a file that is complete or not there."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.write_text(text, encoding="utf-8")
        part.replace(path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise ResultError(f"{path}: cannot be written ({error.strerror}); choose another folder") from error
