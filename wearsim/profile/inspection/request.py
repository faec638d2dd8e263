"""Request to `wearsim profile`: flags validated, values in SI units."""

from __future__ import annotations

import os
from argparse import Namespace
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

from wearsim.errors import Fault, ProfileError, SceneError, listed
from wearsim.profile.alignment import ALIGNMENTS
from wearsim.profile.files import FORMATS, WRITTEN_FORMATS, is_result
from wearsim.profile.files.axes import ORIGINS, UNITS
from wearsim.profile.inspection import Conditions, counterpart_of
from wearsim.profile.inspection.inputs import ProfileInput, read_input
from wearsim.profile.limits import (
    DEFAULT_LIMITS,
    LimitSet,
    load_limits,
    shipped_limits,
)
from wearsim.profile.placement import slope_of
from wearsim.quantities import QUANTITIES
from wearsim.toml_faults import decimal

_PICTURES = (".png", ".svg", ".pdf")
_NAMES = (
    "name",
    "left",
    "rail",
    "wheel",
    "against",
    "reprofile_to",
    "limits",
    "fleet",
    "out",
    "csv",
    "plot",
)
"""Flags that name a profile, a file or a folder."""
_LENGTHS = {
    "gauge_mm": "gauge",
    "back_to_back_mm": "back_to_back",
    "diameter_mm": "wheel_diameter",
    "left_diameter_mm": "wheel_diameter",
    "smooth_mm": "noise_wavelength",
    "measuring_height_mm": "measuring_height",
    "running_circle_mm": "running_circle",
}
"""Flags with a length, and the quantity whose input range applies."""
_WHEEL_ONLY = (
    "left",
    "limits",
    "rail",
    "reprofile_to",
    "origin",
    "offset_y_mm",
    "offset_z_mm",
    "measuring_height_mm",
    "running_circle_mm",
)
_OFFSETS = ("offset_y_mm", "offset_z_mm")
_NEEDS = {
    "out": ("convert",),
    "overwrite": ("convert", "csv"),
    "align": ("against",),
    "rotate": ("against",),
    "left_diameter_mm": ("diameter_mm",),
}
"""Flags that need one of some other flags."""
_EXCLUDE = (
    ("rail", "wheel"),
    ("mirror", "no_mirror"),
    ("z_up", "z_down"),
    ("fleet", "name"),
    ("fleet", "left"),
    ("fleet", "convert"),
    ("fleet", "out"),
    ("fleet", "left_diameter_mm"),
    ("fleet", "reprofile_to"),
    ("fleet", "at_km"),
    ("origin", "offset_y_mm"),
    ("origin", "offset_z_mm"),
    ("fleet", "amplitude_mm"),
)
"""Pairs of flags that exclude each other."""
_CHOICES = {
    "units": UNITS,
    "origin": ORIGINS,
    "format": FORMATS,
    "kind": ("wheel", "rail"),
    "convert": WRITTEN_FORMATS,
    "align": ALIGNMENTS,
}
# Bytes of a file name, with room for the extension of a temporary file.
_LONGEST = 250
_T = TypeVar("_T")


class Request:
    """Request to `wearsim profile` in SI units, with all its faults.

    Attributes with the names of flags are their values, None if they are not given.

    Parameters
    ----------
    arguments : Namespace
        From the command line.
    """

    def __init__(self, arguments: Namespace) -> None:
        self.given: dict[str, Any] = {
            key: None if value is False else value
            for key, value in vars(arguments).items()
        }
        self.faults: list[str] = []
        self._check_names()
        self.side = "right"  # wheel of a result file
        self._take_side()
        for key, choices in _CHOICES.items():
            text = self.given[key]
            if text is not None and text not in choices:
                self.faults.append(
                    f"{flag_of(key)} = {_short(text)} must be one of "
                    f"{', '.join(choices)}"
                )
                self.given[key] = None
        keys = ("format", "units", "origin")
        self.statements: dict[str, Any] = {
            key: self.given[key] for key in keys if self.given[key] is not None
        }
        self.statements |= dict(self._offsets())
        for key, no in (("mirror", "no_mirror"), ("z_up", "z_down")):
            if self.given[key] or self.given[no]:
                self.statements[key] = bool(self.given[key])
        self.numbers = dict[str, float](self._lengths())  # stated lengths [m]
        self.amplitudes = self._amplitudes()
        self.inclination = None
        if self.given["inclination"] is not None:
            try:
                self.inclination = slope_of(self.given["inclination"].strip())
            except ValueError as error:
                self.faults.append(
                    f"--inclination = {_short(self.given['inclination'])} {error}"
                )
        self.faults += self._pair_faults()
        if self.plot and Path(self.plot).suffix.lower() not in _PICTURES:
            self.faults.append(
                f"--plot = {_short(self.plot)} must end with {', '.join(_PICTURES)}"
            )
        for key in ("out", "csv"):
            if self.given[key] not in (None, "-"):
                self.check_new(key, Path(self.given[key]))

    def __getattr__(self, key: str) -> Any:
        """Value of a flag, None if it is not given."""
        return self.given[key]

    def take(self, make: Callable[[], _T], flag: str = "") -> _T | None:
        """Value of a flag, or None with its faults recorded under the flag."""
        try:
            return make()
        except ProfileError as error:
            before = f"{flag}: " if flag else ""
            self.faults += [f"{before}{line}" for line in str(error).splitlines()]
        return None

    def read(self, key: str, kind: Any) -> ProfileInput | None:
        """Read the profile of a flag."""
        if self.given[key] is None:
            return None
        flag = "" if key == "name" else flag_of(key)
        return self.take(
            lambda: read_input(self.given[key], kind, self.statements), flag
        )

    def raise_any(self) -> None:
        """Raise all faults, each once."""
        if self.faults:
            raise SceneError([Fault(fault) for fault in dict.fromkeys(self.faults)])

    def check_new(self, key: str, path: Path) -> None:
        """Record a fault for a file that would be overwritten without request."""
        if os.path.exists(path) and not self.overwrite:
            self.faults.append(
                f"--{key}: {path} exists already; choose another name or add "
                "--overwrite"
            )

    def check_kind(self, kind: str, name: str) -> None:
        """Record faults of flags that do not apply to this kind of profile."""
        if kind == "rail":
            for key in _WHEEL_ONLY:
                if self.given[key] is not None:
                    fix = (
                        "give the wheel on it with --wheel"
                        if key == "rail"
                        else "leave it out"
                    )
                    self.faults.append(
                        f"{flag_of(key)} belongs to wheels, {name} is a rail; {fix}"
                    )
        elif self.wheel is not None:
            self.faults.append(
                f"--wheel is the wheel on a rail, {name} is a wheel; give --left or "
                "--rail"
            )

    def common(self, kind: Any) -> tuple[Conditions, LimitSet | None]:
        """Conditions and limits; the counterpart is read for a check."""
        limits = self.take(
            lambda: load_limits(self.limits or DEFAULT_LIMITS),
            "--limits" if self.limits else "",
        )
        foreign, numbers = "", dict(self.numbers)
        if limits is not None and self.limits is None:
            gauge, distance = (numbers.get(key) for key in ("gauge", "back_to_back"))
            foreign = limits.foreign(gauge, distance)
            if foreign:
                names = listed(shipped_limits())
                foreign += f"; name the set that applies, --limits NAME ({names})"
                limits = None
        if limits is not None and limits.measuring_height is not None:
            numbers.setdefault("measuring_height", limits.measuring_height)
        at = Conditions(
            **numbers,
            amplitudes=self.amplitudes,
            no_limits=foreign,
            inclination=self.inclination,
            counterpart=self.rail or self.wheel,
            align=self.align or ("best_fit" if self.rotate else None),
            rotate=bool(self.rotate),
            statements=self.statements,
        )
        key = "rail" if kind == "wheel" else "wheel"
        if kind is not None and self.given[key] is not None:
            self.take(lambda: counterpart_of(kind, at), flag_of(key))
        return at, limits

    def _amplitudes(self) -> tuple[float, ...]:
        """Amplitudes of --amplitude-mm [m], with faults for those out of range."""
        text = self.given["amplitude_mm"]
        if text is None:
            return ()
        (low, high), numbers = (
            QUANTITIES["amplitude"].span,
            [decimal(part) for part in text.split(",")],
        )
        if not all(low <= number <= high for number in numbers):
            self.faults.append(
                f"--amplitude-mm = {_short(text)} must be {low:g} to {high:g} mm, or "
                "several of such numbers with commas between them"
            )
        return tuple(1e-3 * number for number in numbers)

    def _take_side(self) -> None:
        """Interpret --wheel as the side of a wheelset if a result file is inspected.

        Otherwise the flag names the wheel on a rail.
        """
        result_flags = [
            key for key in ("name", "left", "against") if is_result(self.given[key])
        ]
        if not result_flags and self.at_km is not None:
            self.faults.append(
                "--at-km picks a state of a result file (.nc), none is given; leave "
                "it out"
            )
        if not set(result_flags) - {"left"} or self.wheel is None:
            return
        side, self.given["wheel"] = self.wheel, None
        if side not in ("right", "left"):
            self.faults.append(
                f"--wheel = {_short(side)} must be right or left of a result file"
            )
        elif side == "left" and self.left is not None:
            self.faults.append(
                "--wheel left and --left exclude each other; give one of them"
            )
        else:
            self.side = side

    def _lengths(self) -> Iterator[tuple[str, float]]:
        """Stated lengths [m]; faults of those out of range are recorded."""
        for key, quantity in _LENGTHS.items():
            if (text := self.given[key]) is None:
                continue
            (low, high), number = QUANTITIES[quantity].span, decimal(text)
            if not low <= number <= high:
                self.faults.append(
                    f"{flag_of(key)} = {_short(text)} must be {low:g} to {high:g} mm"
                )
            yield key.removesuffix("_mm"), number * 1e-3

    def _offsets(self) -> Iterator[tuple[str, float]]:
        """Stated offsets [m]; faults of those out of range are recorded."""
        for key in _OFFSETS:
            if (text := self.given[key]) is None:
                continue
            (low, high), number = QUANTITIES["profile_offset"].span, decimal(text)
            if not low <= number <= high:
                self.faults.append(
                    f"{flag_of(key)} = {_short(text)} must be {low:g} to {high:g} mm"
                )
            yield key.removesuffix("_mm"), round(number, 9) * 1e-3

    def _check_names(self) -> None:
        """Raise faults of names that cannot be looked up.

        Further messages would repeat them.
        """
        for key in _NAMES:
            name = self.given[key]
            if name is not None and (
                not name.strip()
                or "\0" in name
                or max(map(len, os.fsencode(name).split(b"/"))) > _LONGEST
            ):
                self.faults.append(
                    f"{flag_of(key)} = {name[:60]!r} must not be empty, hold zero "
                    "bytes or be too long for a file"
                )
        self.raise_any()

    def _pair_faults(self) -> Iterator[str]:
        """List flags that need or exclude others."""
        given = self.given
        if given["fleet"] is None and given["name"] is None:
            yield "give a profile, NAME or FILE, or a folder with --fleet DIR"
        for key, others in _NEEDS.items():
            if given[key] and not any(given[needed] for needed in others):
                yield (
                    f"{flag_of(key)} acts with {' or '.join(map(flag_of, others))} "
                    "only; leave it out"
                )
        for pair in _EXCLUDE:
            if all(given[key] for key in pair):
                yield (
                    f"{' and '.join(map(flag_of, pair))} exclude each other; give one "
                    "of them"
                )
        if self.rotate and self.align not in (None, "best_fit"):
            yield (
                f"--rotate belongs to --align best_fit, not to {_short(self.align)}; "
                "leave one out"
            )
        if self.json and self.csv == "-":
            yield "--json and --csv - exclude each other on stdout; give --csv a file"


def flag_of(key: str) -> str:
    """Flag as the user writes it."""
    return "NAME|FILE" if key == "name" else f"--{key.replace('_', '-')}"


def _short(text: str) -> str:
    return " ".join(text.split())[:60]
