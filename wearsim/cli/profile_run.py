"""Requests of `wearsim profile`: validated, measured, written."""

from __future__ import annotations

import errno
import json
import math
import os
import sys
from argparse import Namespace
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from wearsim.cli import profile_tables
from wearsim.errors import Fault, ProfileError, ResultError, SceneError
from wearsim.profile.alignment import ALIGNMENTS
from wearsim.profile.files import FORMATS, WRITTEN_FORMATS, is_file, read_profile, write_profile
from wearsim.profile.files.axes import ORIGINS, UNITS
from wearsim.profile.inspection import (
    Conditions,
    Inspection,
    counterpart_of,
    inspect_profile,
    reprofiled_wheels,
)
from wearsim.profile.inspection.fleet import fleet_rows, profile_files
from wearsim.profile.inspection.inputs import ProfileInput, read_input
from wearsim.profile.limits import LimitSet, load_limits
from wearsim.profile.measures import GaugeDistances
from wearsim.profile.placement import RUNNING_CIRCLE
from wearsim.quantities import QUANTITIES

_PICTURES = ("png", "svg", "pdf")
_NUMBERS = {  # quantity whose input range holds
    "below_tip_mm": "below_tip",
    "level_mm": "level",
    "running_circle_mm": "flange_back",
    "gauge_mm": "gauge",
    "back_to_back_mm": "back_to_back",
    "wheel_radius_mm": "wheel_radius",
    "diameter_mm": "wheel_diameter",
    "left_diameter_mm": "wheel_diameter",
    "smooth_mm": "noise_wavelength",
}
_NAMES = ("name", "left", "rail", "wheel", "against", "reprofile_to", "limits", "fleet", "out", "csv", "plot")
_SINGLE = ("left", "convert", "out", "part", "slice", "left_diameter_mm", "reprofile_to")  # not of a folder
_WHEEL_ONLY = ("below_tip_mm", "level_mm", "running_circle_mm", "left", "limits", "rail", "reprofile_to",
               "origin")  # fmt: skip
_CHOICES = {"units": UNITS, "origin": ORIGINS, "format": FORMATS, "kind": ("wheel", "rail"),
            "convert": WRITTEN_FORMATS}  # fmt: skip
_T = TypeVar("_T")


class Request:
    """What is asked for, in SI units, and all that is wrong with it.

    Parameters
    ----------
    arguments : Namespace
        From the command line.
    """

    def __init__(self, arguments: Namespace) -> None:
        self.given: dict[str, Any] = {
            key: None if value is False else value for key, value in vars(arguments).items()
        }
        self.faults: list[str] = []
        self._check_names()
        self.raise_any()  # nothing can be looked up under such names, and more messages would only repeat it
        self._check_subject()
        self._check_outputs()
        for key, known in _CHOICES.items():
            text = self.given[key]
            if text is not None and text not in known:
                self.faults.append(f"{_flag(key)} = {_short(text)} must be one of {', '.join(known)}")
                self.given[key] = None
        self.statements = self._statements()
        self.numbers = self._numbers()
        self.inclination = self._inclination()
        self._check_comparison()

    def __getattr__(self, key: str) -> Any:
        """Value of a flag, None if it is not given."""
        return self.given[key]

    def take(self, make: Callable[[], _T], flag: str = "") -> _T | None:
        """Value, or None with its faults kept, named by the flag."""
        try:
            return make()
        except ProfileError as error:
            before = f"{flag}: " if flag else ""
            self.faults += [f"{before}{line}" for line in str(error).splitlines()]
        return None

    def read(self, key: str, kind: Any) -> ProfileInput | None:
        """Profile of a flag."""
        if self.given[key] is None:
            return None
        flag = "" if key == "name" else _flag(key)
        return self.take(lambda: read_input(self.given[key], kind, self.statements), flag)

    def raise_any(self) -> None:
        """Raise all faults, each once."""
        if self.faults:
            raise SceneError([Fault(fault) for fault in dict.fromkeys(self.faults)])

    def conditions(self) -> Conditions:
        """Return what is stated in the flags."""
        numbers = self.numbers
        distances = {key: numbers[f"{key}_mm"] for key in ("below_tip", "level") if f"{key}_mm" in numbers}
        return Conditions(
            GaugeDistances(**distances),
            running_circle=numbers.get("running_circle_mm"),
            back_to_back=numbers.get("back_to_back_mm"),
            gauge=numbers.get("gauge_mm"),
            diameter=numbers.get("diameter_mm"),
            left_diameter=numbers.get("left_diameter_mm"),
            inclination=self.inclination,
            counterpart=self.rail or self.wheel,
            smooth=numbers.get("smooth_mm"),
            align=self.align or ("best_fit" if self.rotate else None),
            rotate=bool(self.rotate),
            statements=self.statements,
            own_limits=self.limits is not None,
        )

    def check_kind(self, kind: str, name: str) -> None:
        """Note flags that say nothing about this kind of profile."""
        if kind == "rail":
            for key in _WHEEL_ONLY:
                if self.given[key] is not None:
                    fix = "give the wheel on it with --wheel" if key == "rail" else "leave it out"
                    self.faults.append(f"{_flag(key)} belongs to wheels, {name} is a rail; {fix}")
        elif self.wheel is not None:
            self.faults.append(
                f"--wheel is the wheel on a rail, {name} is a wheel itself; give --left or --rail, or leave "
                "it out"
            )
        if "left_diameter_mm" in self.numbers and "diameter_mm" not in self.numbers:
            self.faults.append("--left-diameter-mm needs --diameter-mm, that of the right wheel")
        known = [rule for rule, each in ALIGNMENTS.items() if kind in each.kinds]
        if self.align is not None and self.align not in known:
            self.faults.append(f"--align = {_short(self.align)} must be one of {', '.join(known)}")

    def common(self, kind: Any) -> tuple[Conditions | None, LimitSet | None]:
        """Conditions and limits, the counterpart tried."""
        limits = self.take(lambda: load_limits(self.limits or "TSI"), "--limits" if self.limits else "")
        at = self.take(self.conditions)
        if at is not None and kind is not None and (self.rail if kind == "wheel" else self.wheel) is not None:
            self.take(lambda: counterpart_of(kind, at), "--rail" if kind == "wheel" else "--wheel")
        return at, limits

    def _exclude(self, *rules: tuple[Any, str]) -> None:
        self.faults += [message for broken, message in rules if broken]

    def _check_names(self) -> None:
        """Note names that the operating system takes for none."""
        for key in _NAMES:
            text = self.given[key]
            if text is None:
                continue
            if not text.strip() or "\0" in text:
                self.faults.append(f"{_flag(key)} = {_short(text)!r} must not be empty or hold zero bytes")
                continue
            try:
                Path(text).stat()
            except OSError as error:
                if error.errno == errno.ENAMETOOLONG:
                    self.faults.append(
                        f"{_flag(key)} = {_short(text)}... is too long a name; give a shorter one"
                    )

    def _check_subject(self) -> None:
        """Check what is inspected: one profile or a folder."""
        if self.fleet is None:
            if self.name is None:
                self.faults.append("give a profile, NAME or FILE, or a folder with --fleet DIR")
            return
        if self.name is not None:
            self.faults.append(
                f"--fleet and a profile ({_short(self.name)}) exclude each other; the reference of a fleet "
                "is given with --against"
            )
        self.faults += [
            f"{_flag(key)} belongs to one profile, --fleet measures many; leave one of them out"
            for key in _SINGLE
            if self.given[key] is not None
        ]
        folder = Path(self.fleet)
        if self.csv not in (None, "-") and Path(self.csv).resolve().parent == folder.resolve():
            self.faults.append(
                f"--csv = {_short(self.csv)} lies in the folder of --fleet, whose next run would take the "
                "table for a profile; choose another folder"
            )
        if not self.faults and not folder.is_dir():
            what = "is no folder" if folder.exists() else "does not exist"
            self.faults.append(f"--fleet = {self.fleet} {what}; give a folder of profile files")

    def _check_outputs(self) -> None:
        faults, plot, csv = self.faults, self.plot, self.csv
        self._exclude(
            (self.out and not self.convert, "--out needs --convert: it names the file that is written"),
            (
                self.overwrite and not self.convert and csv in (None, "-"),
                "--overwrite needs --convert or --csv: nothing else is guarded",
            ),
            (self.json and csv == "-", "--json and --csv - exclude each other on stdout; give --csv a file"),
            (
                plot and Path(plot).suffix[1:].lower() not in _PICTURES,
                f"--plot = {_short(plot or '')} must end with .{', .'.join(_PICTURES)}",
            ),
        )
        files = {key: self.given[key] for key in ("out", "csv", "plot") if self.given[key] not in (None, "-")}
        for key, text in files.items():
            if not Path(text).parent.is_dir():
                faults.append(f"--{key} = {_short(text)}: the folder does not exist; make it first")
            elif Path(text).is_dir():
                faults.append(f"--{key} = {_short(text)} is a folder; give the name of a file in it")
            elif key == "csv" and Path(text).exists() and not self.overwrite:
                faults.append(
                    f"--csv = {_short(text)} exists already; choose another name or add --overwrite"
                )
        if len({str(Path(text)) for text in files.values()}) < len(files):
            faults.append("--out, --csv and --plot must not name the same file")

    def _check_comparison(self) -> None:
        lone = "needs --against: it says how the profile is laid on the other"
        other = self.align not in (None, "best_fit")
        self._exclude(
            (self.align and not self.against, f"--align {lone}"),
            (self.rotate and not self.against, f"--rotate {lone}"),
            (
                self.rotate and self.against and other,
                f"--rotate belongs to --align best_fit, not to {_short(self.align or '')}; leave one out",
            ),
            (
                self.rail and self.wheel,
                "--rail and --wheel exclude each other; give the counterpart of the profile",
            ),
            (
                {"diameter_mm", "wheel_radius_mm"} <= self.numbers.keys(),
                "--diameter-mm and --wheel-radius-mm exclude each other; give one of them",
            ),
        )
        if "wheel_radius_mm" in self.numbers:
            self.numbers["diameter_mm"] = 2.0 * self.numbers.pop("wheel_radius_mm")

    def _statements(self) -> dict[str, Any]:
        """Arguments of `read_profile`."""
        keys = ("format", "units", "origin", "part")
        statements = {key: self.given[key] for key in keys if self.given[key] is not None}
        for key, no in (("mirror", "no_mirror"), ("z_up", "z_down")):
            if self.given[key] and self.given[no]:
                self.faults.append(f"{_flag(key)} and {_flag(no)} contradict each other")
            elif self.given[key] or self.given[no]:
                statements[key] = bool(self.given[key])
        if self.slice is not None:
            text = self.slice.strip()
            if text.isascii() and text.isdecimal() and 1 <= int(text[:9]) <= 100_000:
                statements["slice"] = int(text)
            else:
                self.faults.append(f"--slice = {_short(text)} must be a whole number from 1")
        return statements

    def _numbers(self) -> dict[str, float]:
        """Return the stated lengths [m]."""
        numbers = {}
        for key, quantity in _NUMBERS.items():
            low, high = QUANTITIES[quantity].span
            text = self.given[key]
            if text is None:
                continue
            try:
                number = float(text) if text.isascii() and "_" not in text else math.nan
            except ValueError:
                number = math.nan
            if low <= number <= high:
                numbers[key] = number * 1e-3
            else:
                comma = "; the decimal mark is a point" if "," in text else ""
                self.faults.append(
                    f"{_flag(key)} = {_short(text)} must be a number from {low:g} to {high:g} mm{comma}"
                )
        return numbers

    def _inclination(self) -> Any:
        """Slope of the rail from 1:N or none, by the rule of `wearsim contact`."""
        if self.given["inclination"] is None:
            return None
        from wearsim.cli.contact_request import inclination

        text = self.given["inclination"]
        try:
            return inclination(text.strip())
        except ValueError as error:
            self.faults.append(f"--inclination = {_short(text)} {error}")
            return None


def _flag(key: str) -> str:
    return "NAME|FILE" if key == "name" else f"--{key.replace('_', '-')}"


def _short(text: str) -> str:
    return " ".join(text.split())[:60]


def measure_one(arguments: Namespace) -> int:
    """Measure one profile, print it and write what is asked for; the exit code is 0."""
    request = Request(arguments)
    if request.name is None:
        request.raise_any()
    given = request.read("name", request.kind)
    kind = given.kind if given is not None else request.kind
    if kind is not None:
        request.check_kind(kind, request.name)
    left = request.read("left", "wheel") if kind != "rail" else None
    against = request.read("against", kind)
    template = request.read("reprofile_to", "wheel") if kind != "rail" else None
    at, limits = request.common(kind)
    target = _target(request, given)
    files = [request.given[key] for key in ("name", "left", "against", "reprofile_to", "rail", "wheel")]
    if request.statements and not any(is_file(name) for name in files if name is not None):
        stated = ", ".join(map(_flag, request.statements))
        request.faults.append(f"{stated}: is a statement on a file, but no file is given; leave it out")
    request.raise_any()
    assert given is not None
    inspection = inspect_profile(given, at, limits, left=left, against=against)
    wheels = None
    if template is not None:
        reference = template
        wheels = request.take(lambda: reprofiled_wheels(inspection, reference), "--reprofile-to")
    request.raise_any()
    written = _write(request, inspection, target)
    if request.json:
        value = profile_tables.as_json(inspection) | ({"files": written} if written else {})
        if template is not None and wheels is not None:
            value["reprofiled"] = profile_tables.reprofiled_json(template, wheels)
        print(json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False))
        return 0
    if request.csv == "-":
        sys.stdout.write(profile_tables.points_csv(inspection))
    else:
        print(profile_tables.as_text(inspection))
        if template is not None and wheels is not None:
            print("\n" + profile_tables.reprofiled_text(template, wheels))
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
        _save(Path(request.csv), profile_tables.points_csv(inspection))
        written.append(request.csv)
    if request.plot is not None:
        from wearsim.profile.inspection.datasets import profile_dataset
        from wearsim.report.figures.profile import profile_figure
        from wearsim.report.style import write_figure

        write_figure(profile_figure(profile_dataset(inspection)), Path(request.plot))
        written.append(request.plot)
    return written


def _convert(request: Request, inspection: Inspection, target: Path) -> str:
    """Write a profile, read it back and report the result."""
    format = request.convert
    aligned = request.against is not None and request.align is not None
    profile = inspection.aligned if aligned else inspection.given.profile
    write_profile(profile, target, format, overwrite=bool(request.overwrite))
    try:
        again = read_profile(target, profile.kind, format=format)
    except ProfileError as error:
        return f"{target} ({format}); wearsim itself would not read it back: {str(error).splitlines()[0]}"
    if not (np.array_equal(again.profile.y, profile.y) and np.array_equal(again.profile.z, profile.z)):
        return f"{target} ({format}); read back it differs: {'; '.join(again.notes[1:])}"
    changes = [*(["aligned"] if aligned else []), *(["smoothed"] if "smooth_mm" in request.numbers else [])]
    changed = f"{' and '.join(changes)} as stated, " if changes else ""
    return f"{target} ({format}, {len(profile.y)} points, {changed}read back with the same bits)"


def _save(path: Path, text: str) -> None:
    """Write a file that is complete or not there."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.write_text(text, encoding="utf-8")
        part.replace(path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise ResultError(f"{path}: cannot be written ({error.strerror}); choose another folder") from error


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
    if request.csv not in (None, "-"):
        _save(Path(request.csv), profile_tables.fleet_csv(rows))
        print(f"wrote {request.csv}", file=sys.stderr)
    if request.json:
        value = {"wheels": [profile_tables.fleet_json(row) for row in rows]}
        print(json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False))
    elif request.csv == "-":
        sys.stdout.write(profile_tables.fleet_csv(rows))
    else:
        print(profile_tables.fleet_text(rows))
    measured = [row for row in rows if row.measured]
    if request.plot is not None and measured:
        from wearsim.profile.inspection.datasets import fleet_dataset
        from wearsim.report.figures.fleet import write_fleet

        pages, drawn = write_fleet(fleet_dataset(rows, against, limits), Path(request.plot))
        of_all = f" of {len(measured)} measured" if drawn < len(measured) else ""
        print(f"wrote {', '.join(map(str, pages))}: {drawn}{of_all} profiles drawn", file=sys.stderr)
    faulty, apart = len(rows) - len(measured), sum(1 for row in measured if row.fault)
    summary = [f"{len(rows)} files: {len(measured)} measured, {faulty} with faults"]
    summary += [f"{apart} not compared"] if apart else []
    if skipped:
        names = ", ".join(skipped[:3]) + (", ..." if len(skipped) > 3 else "")
        summary.append(f"{len(skipped)} other files or folders left out ({names})")
    print("; ".join(summary), file=sys.stderr)
    return 0 if measured else 2
