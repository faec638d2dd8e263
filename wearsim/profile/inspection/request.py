"""What is asked of `wearsim profile`: flags validated, values in SI units."""

from __future__ import annotations

import errno
from argparse import Namespace
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

from wearsim.errors import Fault, ProfileError, SceneError
from wearsim.profile.alignment import ALIGNMENTS
from wearsim.profile.files import FORMATS, WRITTEN_FORMATS
from wearsim.profile.files.axes import ORIGINS, UNITS
from wearsim.profile.files.points import MAX_SLICES
from wearsim.profile.inspection import Conditions, counterpart_of
from wearsim.profile.inspection.inputs import ProfileInput, read_input
from wearsim.profile.limits import LimitSet, load_limits
from wearsim.profile.measures import GaugeDistances
from wearsim.profile.placement import slope_of
from wearsim.quantities import QUANTITIES
from wearsim.toml_faults import decimal

_PICTURES = (".png", ".svg", ".pdf")
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
_SINGLE = ("name", "left", "convert", "out", "part", "slice", "left_diameter_mm", "reprofile_to", "at_km")
_WHEEL_ONLY = ("below_tip_mm", "level_mm", "running_circle_mm", "left", "limits", "rail", "reprofile_to",
               "origin")  # fmt: skip
_CHOICES = {"units": UNITS, "origin": ORIGINS, "format": FORMATS, "kind": ("wheel", "rail"),
            "convert": WRITTEN_FORMATS}  # fmt: skip
_NEEDS = {  # each acts with one of the others only
    "out": ("convert",), "overwrite": ("convert", "csv"), "align": ("against",), "rotate": ("against",),
    "left_diameter_mm": ("diameter_mm", "wheel_radius_mm"),
}  # fmt: skip
_EXCLUDE = (
    ("rail", "wheel"), ("diameter_mm", "wheel_radius_mm"), ("mirror", "no_mirror"), ("z_up", "z_down"),
    *(("fleet", single) for single in _SINGLE),
)  # fmt: skip
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
        self.faults = list(self._name_faults())
        self.raise_any()  # nothing can be looked up under such names, and more messages would only repeat it
        self.side = "right"  # wheel of a result file
        self._take_side()
        for key, known in _CHOICES.items():
            text = self.given[key]
            if text is not None and text not in known:
                self.faults.append(f"{flag_of(key)} = {_short(text)} must be one of {', '.join(known)}")
                self.given[key] = None
        self.statements = self._statements()
        self.numbers = self._numbers()
        self.inclination = None
        if self.given["inclination"] is not None:
            try:
                self.inclination = slope_of(self.given["inclination"].strip())
            except ValueError as error:
                self.faults.append(f"--inclination = {_short(self.given['inclination'])} {error}")
        self.faults += [*self._pair_faults(), *self._output_faults()]
        if "wheel_radius_mm" in self.numbers:
            self.numbers["diameter_mm"] = 2.0 * self.numbers.pop("wheel_radius_mm")

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
        flag = "" if key == "name" else flag_of(key)
        return self.take(lambda: read_input(self.given[key], kind, self.statements), flag)

    def raise_any(self) -> None:
        """Raise all faults, each once."""
        if self.faults:
            raise SceneError([Fault(fault) for fault in dict.fromkeys(self.faults)])

    def conditions(self) -> Conditions:
        """Return what is stated in the flags."""
        lengths = {key.removesuffix("_mm"): length for key, length in self.numbers.items()}
        gauge = {key: lengths.pop(key) for key in ("below_tip", "level") if key in lengths}
        return Conditions(
            GaugeDistances(**gauge),
            **lengths,
            inclination=self.inclination,
            counterpart=self.rail or self.wheel,
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
                    self.faults.append(f"{flag_of(key)} belongs to wheels, {name} is a rail; {fix}")
        elif self.wheel is not None:
            self.faults.append(f"--wheel is the wheel on a rail, {name} is a wheel; give --left or --rail")
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

    def _take_side(self) -> None:
        """Take --wheel for the side where a result file is asked for one: it has no other wheel on a rail."""
        asked = [key for key in ("name", "left", "against") if is_result(self.given[key])]
        if not asked and self.at_km is not None:
            self.faults.append("--at-km picks a state of a result file (.nc), none is given; leave it out")
        if not set(asked) - {"left"} or self.wheel is None:
            return
        side, self.given["wheel"] = self.wheel, None
        if side not in ("right", "left"):
            self.faults.append(f"--wheel = {_short(side)} must be right or left of a result file")
        elif side == "left" and self.left is not None:
            self.faults.append("--wheel left and --left exclude each other; give one of them")
        else:
            self.side = side

    def _name_faults(self) -> Iterator[str]:
        """Names that the operating system does not accept."""
        for key in _NAMES:
            text = self.given[key]
            if text is not None and not text.strip():
                yield f"{flag_of(key)} = {text!r} must not be empty"
            elif text is not None:
                try:
                    Path(text).stat()
                except ValueError:
                    yield f"{flag_of(key)} = {_short(text)!r} must not hold zero bytes"
                except OSError as error:
                    if error.errno == errno.ENAMETOOLONG:
                        yield f"{flag_of(key)} = {_short(text)}... is too long a name; give a shorter one"

    def _pair_faults(self) -> Iterator[str]:
        """List flags that need or exclude others."""
        given = self.given
        if given["fleet"] is None and given["name"] is None:
            yield "give a profile, NAME or FILE, or a folder with --fleet DIR"
        for key, others in _NEEDS.items():
            if given[key] and not any(given[other] for other in others):
                yield f"{flag_of(key)} acts with {' or '.join(map(flag_of, others))} only; leave it out"
        for pair in _EXCLUDE:
            if all(given[key] for key in pair):
                yield f"{' and '.join(map(flag_of, pair))} exclude each other; give one of them"
        if self.rotate and self.align not in (None, "best_fit"):
            yield f"--rotate belongs to --align best_fit, not to {_short(self.align)}; leave one out"

    def _output_faults(self) -> Iterator[str]:
        """Files that must not be written."""
        if self.json and self.csv == "-":
            yield "--json and --csv - exclude each other on stdout; give --csv a file"
        if self.plot and Path(self.plot).suffix.lower() not in _PICTURES:
            yield f"--plot = {_short(self.plot)} must end with {', '.join(_PICTURES)}"
        files = {
            key: Path(self.given[key]) for key in ("out", "csv", "plot") if self.given[key] not in (None, "-")
        }
        for key, path in files.items():
            named = f"--{key} = {_short(str(path))}"
            if not path.parent.is_dir():
                yield f"{named}: the folder does not exist; make it first"
            elif path.is_dir():
                yield f"{named} is a folder; give the name of a file in it"
            elif key == "csv" and path.exists() and not self.overwrite:
                yield f"{named} exists already; choose another name or add --overwrite"
            elif key == "csv" and self.fleet and path.resolve().parent == Path(self.fleet).resolve():
                yield f"{named} lies in the folder of --fleet, whose next run would read it; choose another"
        if len(set(files.values())) < len(files):
            yield "--out, --csv and --plot must not name the same file"

    def _statements(self) -> dict[str, Any]:
        """Arguments of `read_profile`."""
        keys = ("format", "units", "origin", "part")
        statements = {key: self.given[key] for key in keys if self.given[key] is not None}
        for key, no in (("mirror", "no_mirror"), ("z_up", "z_down")):
            if self.given[key] or self.given[no]:
                statements[key] = bool(self.given[key])
        if self.slice is not None:
            number = decimal(self.slice)
            if 1.0 <= number <= MAX_SLICES and number.is_integer():
                statements["slice"] = int(number)
            else:
                self.faults.append(f"--slice = {_short(self.slice)} must be a whole number from 1")
        return statements

    def _numbers(self) -> dict[str, float]:
        """Stated lengths [m]."""
        numbers = {}
        for key, quantity in _NUMBERS.items():
            text = self.given[key]
            if text is None:
                continue
            (low, high), number = QUANTITIES[quantity].span, decimal(text)
            if low <= number <= high:
                numbers[key] = number * 1e-3
            else:
                self.faults.append(f"{flag_of(key)} = {_short(text)} must be {low:g} to {high:g} mm")
        return numbers


def is_result(name: str | None) -> bool:
    """Whether a name is that of a result file."""
    return name is not None and Path(name).suffix.lower() == ".nc"


def flag_of(key: str) -> str:
    """Flag as the user writes it."""
    return "NAME|FILE" if key == "name" else f"--{key.replace('_', '-')}"


def _short(text: str) -> str:
    return " ".join(text.split())[:60]
