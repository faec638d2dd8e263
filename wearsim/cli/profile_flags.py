"""Flags of `wearsim profile`: what may be given, what contradicts what, SI values."""

from __future__ import annotations

import argparse
import errno
import math
from pathlib import Path
from typing import Any, NamedTuple

from wearsim.quantities import QUANTITIES

PICTURES = ("png", "svg", "pdf")
WRITTEN = ("two-column", "miniprof", "simpack")
"""Formats of `--convert`."""


class Number(NamedTuple):
    """A flag that takes a number with a unit in its name."""

    name: str
    meaning: str
    low: float
    high: float
    factor: float = 1e-3

    @property
    def key(self) -> str:
        """Name among the parsed arguments."""
        return self.name.replace("-", "_")


_DIAMETERS = QUANTITIES["wheel_diameter"].span
BELOW_TIP = Number(
    "below-tip-mm",
    "depth of the upper point of qR below the flange tip (default 2)",
    *QUANTITIES["below_tip"].span,
)
LEVEL = Number(
    "level-mm",
    "height of Sd and of the lower point of qR above the tape circle (default 10)",
    *QUANTITIES["level"].span,
)
TAPE = Number(
    "tape-mm",
    "distance of the tape circle from the flange back (default 70)",
    *QUANTITIES["flange_back"].span,
)
GAUGE = Number("gauge-mm", "gauge, 14 mm below the top (default 1435)", *QUANTITIES["gauge"].span)
FLANGE_BACK = Number(
    "flange-back-mm",
    "distance of the flange backs; stated, it is judged, too (default 1360)",
    *QUANTITIES["back_to_back"].span,
)
RADIUS = Number("wheel-radius-mm", "wheel radius at the tape circle", *QUANTITIES["wheel_radius"].span)
DIAMETER = Number("diameter-mm", "wheel diameter at the tape circle, instead of the radius", *_DIAMETERS)
LEFT_DIAMETER = Number("left-diameter-mm", "diameter of the left wheel, if it differs", *_DIAMETERS)
SMOOTH = Number(
    "smooth-mm",
    "take out waves shorter than this before anything is measured",
    *QUANTITIES["noise_wavelength"].span,
)

_GAUGE_DISTANCES = (BELOW_TIP, LEVEL, TAPE)
_WHEELSET = (GAUGE, FLANGE_BACK, RADIUS, DIAMETER, LEFT_DIAMETER)
_NUMBERS = (*_GAUGE_DISTANCES, *_WHEELSET, SMOOTH)
_STATEMENTS = ("format", "units", "mirror", "z_up", "origin", "part", "slice")
_SINGLE = ("left", "convert", "out", "part", "slice", "left_diameter_mm", "turn_to")
"""Flags of one profile, not of a folder."""


class Request(NamedTuple):
    """What is asked for, SI units; `numbers` holds what was stated, by the key of its flag."""

    name: str | None
    fleet: Path | None
    kind: Any  # "wheel", "rail" or None
    said: dict[str, Any]
    numbers: dict[str, float]
    left: str | None
    rail: str | None
    wheel: str | None
    inclination: float | None
    against: str | None
    turn_to: str | None
    align: str | None
    rotate: bool
    limits: str | None
    convert: str | None
    out: Path | None
    overwrite: bool
    csv: str | None
    json: bool
    plot: Path | None


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add all flags in groups."""
    parser.add_argument(
        "name", metavar="NAME|FILE", nargs="?", help="standard shape (S1002, S1002/h30, 60E1, ...) or file"
    )
    reading = parser.add_argument_group(
        "reading of files (stated for every file given; else told by extension, header and points)"
    )
    reading.add_argument("--kind", metavar="KIND", help="wheel or rail")
    reading.add_argument("--format", metavar="FORMAT", help="simpack, miniprof, miniprof-parts, slices, "
                         "gensys, uic519 or two-column")  # fmt: skip
    reading.add_argument("--units", metavar="UNIT", help="mm, m, cm or in")
    reading.add_argument("--mirror", action="store_const", const=True, default=None,
                         help="flange (wheel) or gauge side (rail) at the end of larger y")  # fmt: skip
    reading.add_argument("--no-mirror", action="store_const", const=True, default=None,
                         help="at the end of smaller y")  # fmt: skip
    reading.add_argument("--z-up", action="store_const", const=True, default=None,
                         help="z grows away from the flange tip or the foot of the rail")  # fmt: skip
    reading.add_argument(
        "--z-down", action="store_const", const=True, default=None, help="z grows towards it"
    )
    reading.add_argument("--origin", metavar="ORIGIN", help="y of a wheel counts from the tape or the back")
    reading.add_argument("--part", metavar="N", help="number or name of a curve in a multi-part file")
    reading.add_argument("--slice", metavar="N", help="number of a slice in a list of slices")
    measured = parser.add_argument_group("measures of a wheel")
    for flag in _GAUGE_DISTANCES:
        measured.add_argument(f"--{flag.name}", metavar="X", help=flag.meaning)
    measured.add_argument("--limits", metavar="FILE", help="limits (TOML) instead of the shipped ones")
    track = parser.add_argument_group("wheelset and track")
    track.add_argument(
        "--left", metavar="FILE", help="left wheel, if it differs (NAME|FILE is the right one)"
    )
    track.add_argument("--rail", metavar="NAME", help="rail under a wheel (default 60E1)")
    track.add_argument("--wheel", metavar="NAME", help="wheel on a rail (default S1002)")
    track.add_argument("--inclination", metavar="1:N", help="of the rail, or none (default 1:40; measured "
                       "rails: none, they stand as measured)")  # fmt: skip
    for flag in _WHEELSET:
        track.add_argument(f"--{flag.name}", metavar="X", help=flag.meaning)
    compared = parser.add_argument_group("comparison")
    compared.add_argument(
        "--against", metavar="NAME|FILE", help="earlier or new profile: wear between the two"
    )
    compared.add_argument("--align", metavar="RULE", help="how NAME|FILE is laid on it: none, flange_back, "
                          "back_and_tip, flange_tip, tape_line, best_fit, top (default best_fit for measured "
                          "profiles, else none)")  # fmt: skip
    compared.add_argument("--rotate", action="store_true",
                          help="best_fit may turn it, too: for profiles measured at a tilt")  # fmt: skip
    compared.add_argument("--turn-to", metavar="NAME", help="template a worn wheel is turned to with the "
                          "least loss of diameter; with --left both wheels to one diameter")  # fmt: skip
    compared.add_argument(f"--{SMOOTH.name}", metavar="X", help=SMOOTH.meaning)
    output = parser.add_argument_group("output")
    output.add_argument(
        "--convert",
        metavar="FORMAT",
        help=f"write the profile (aligned, if --align is stated) as {', '.join(WRITTEN)}",
    )
    output.add_argument("--out", metavar="FILE", help="file of --convert (default: the name with the "
                        "extension of the format, in this folder)")  # fmt: skip
    output.add_argument("--overwrite", action="store_true", help="replace existing files of --out and --csv")
    output.add_argument("--csv", metavar="FILE", help="points, or depth along the profile with --against, or "
                        "the table of --fleet; - for stdout")  # fmt: skip
    output.add_argument("--json", action="store_true", help="print JSON, SI units")
    output.add_argument("--plot", metavar="FILE", help="draw it: .png, .svg or .pdf")
    output.add_argument("--fleet", metavar="DIR", help="every profile file of a folder as one table")


def request_of(arguments: argparse.Namespace) -> tuple[Request | None, list[str]]:
    """Return what is asked for, and all that is wrong with it, one line each; None under unusable names."""
    given = dict(vars(arguments))
    faults = _unusable(given)
    if faults:
        # nothing can be looked up under such names, and more messages would only repeat it
        return None, faults
    faults = _subject_faults(given) + _output_faults(given)
    said, wrong = _statements(given)
    numbers, off = _numbers(given)
    inclination, slanted = _inclination(given["inclination"])
    faults += [*wrong, *off, *([slanted] if slanted else [])]
    if given["align"] is not None and given["against"] is None:
        faults.append("--align needs --against: it says how the profile is laid on the other")
    if given["rotate"] and given["against"] is None:
        faults.append("--rotate needs --against: it says how the profile is laid on the other")
    elif given["rotate"] and given["align"] not in (None, "best_fit"):
        faults.append(f"--rotate belongs to --align best_fit, not to {_short(given['align'])}; leave one out")
    if given["kind"] not in (None, "wheel", "rail"):
        faults.append(f"--kind = {_short(given['kind'])} must be wheel or rail")
    if {"diameter_mm", "wheel_radius_mm"} <= numbers.keys():
        faults.append("--diameter-mm and --wheel-radius-mm exclude each other; give one of them")
    if "wheel_radius_mm" in numbers:
        numbers["diameter_mm"] = 2.0 * numbers.pop("wheel_radius_mm")
    if given["rail"] is not None and given["wheel"] is not None:
        faults.append("--rail and --wheel exclude each other; give the counterpart of the profile")
    kept: dict[str, Any] = {
        key: None if given[key] is None else Path(given[key]) for key in ("fleet", "out", "plot")
    }
    kept |= {
        key: given[key]
        for key in ("left", "rail", "wheel", "against", "turn_to", "align", "limits", "convert")
    }
    request = Request(
        name=given["name"],
        kind=given["kind"] if given["kind"] in ("wheel", "rail") else None,
        said=said,
        numbers=numbers,
        inclination=inclination,
        overwrite=given["overwrite"],
        rotate=given["rotate"],
        csv=given["csv"],
        json=given["json"],
        **kept,
    )
    return request, faults


def _short(text: str) -> str:
    return " ".join(text.split())[:60]


def _unusable(given: dict[str, Any]) -> list[str]:
    """Tell names that the operating system takes for none."""
    faults = []
    for key in (
        "name",
        "left",
        "rail",
        "wheel",
        "against",
        "turn_to",
        "limits",
        "fleet",
        "out",
        "csv",
        "plot",
    ):
        text = given[key]
        if text is None:
            continue
        word = "NAME|FILE" if key == "name" else f"--{key.replace('_', '-')}"
        if not text.strip() or "\0" in text:
            faults.append(f"{word} = {_short(text)!r} must not be empty or hold zero bytes")
            continue
        try:
            Path(text).stat()
        except OSError as error:
            if error.errno == errno.ENAMETOOLONG:
                faults.append(f"{word} = {_short(text)}... is too long a name; give a shorter one")
    return faults


def _subject_faults(given: dict[str, Any]) -> list[str]:
    """Check what is looked at: one profile or a folder."""
    faults = []
    if given["fleet"] is None:
        if given["name"] is None:
            faults.append("give a profile, NAME or FILE, or a folder with --fleet DIR")
        return faults
    if given["name"] is not None:
        faults.append(
            f"--fleet and a profile ({_short(given['name'])}) exclude each other; the reference of a fleet "
            "is given with --against"
        )
    faults += [
        f"--{key.replace('_', '-')} belongs to one profile, --fleet measures many; leave one of them out"
        for key in _SINGLE
        if given[key] is not None
    ]
    table = given["csv"]
    if table not in (None, "-") and Path(table).resolve().parent == Path(given["fleet"]).resolve():
        faults.append(
            f"--csv = {_short(table)} lies in the folder of --fleet, whose next run would take the table for "
            "a profile; choose another folder"
        )
    if not faults and not Path(given["fleet"]).is_dir():
        exists = Path(given["fleet"]).exists()
        faults.append(f"--fleet = {given['fleet']} {'is no folder' if exists else 'does not exist'}; give a "
                      "folder of profile files")  # fmt: skip
    return faults


def _output_faults(given: dict[str, Any]) -> list[str]:
    faults = []
    if given["convert"] is not None and given["convert"] not in WRITTEN:
        faults.append(f"--convert = {_short(given['convert'])} must be one of {', '.join(WRITTEN)}")
    if given["out"] is not None and given["convert"] is None:
        faults.append("--out needs --convert: it names the file that is written")
    if given["overwrite"] and given["convert"] is None and given["csv"] in (None, "-"):
        faults.append("--overwrite needs --convert or --csv: nothing else is guarded")
    if given["json"] and given["csv"] == "-":
        faults.append("--json and --csv - exclude each other on stdout; give --csv a file")
    if given["plot"] is not None and Path(given["plot"]).suffix[1:].lower() not in PICTURES:
        faults.append(f"--plot = {_short(given['plot'])} must end with .{', .'.join(PICTURES)}")
    for key in ("out", "csv", "plot"):
        text = given[key]
        if text in (None, "-") or "\0" in text:
            continue
        if not Path(text).parent.is_dir():
            faults.append(f"--{key} = {_short(text)}: the folder does not exist; make it first")
        elif Path(text).is_dir():
            faults.append(f"--{key} = {_short(text)} is a folder; give the name of a file in it")
        elif key == "csv" and Path(text).exists() and not given["overwrite"]:
            faults.append(f"--csv = {_short(text)} exists already; choose another name or add --overwrite")
    named = [str(Path(given[key])) for key in ("out", "csv", "plot") if given[key] not in (None, "-")]
    if len(set(named)) < len(named):
        faults.append("--out, --csv and --plot must not name the same file")
    return faults


def _statements(given: dict[str, Any]) -> tuple[dict[str, Any], list[str]]:
    """Arguments of `read_profile`, and what is wrong with them."""
    said = {key: given[key] for key in ("format", "units", "origin", "part") if given[key] is not None}
    faults = []
    for key, yes, no in (("mirror", "mirror", "no_mirror"), ("z_up", "z_up", "z_down")):
        if given[yes] and given[no]:
            faults.append(f"--{yes.replace('_', '-')} and --{no.replace('_', '-')} contradict each other")
        elif given[yes] or given[no]:
            said[key] = bool(given[yes])
    for key, known in (("units", ("mm", "m", "cm", "in")), ("origin", ("tape", "back"))):
        if key in said and said[key] not in known:
            faults.append(f"--{key} = {_short(said.pop(key))} must be one of {', '.join(known)}")
    if "format" in said:
        from wearsim.profile.formats import FORMATS

        if said["format"] not in FORMATS:
            faults.append(f"--format = {_short(said.pop('format'))} must be one of {', '.join(FORMATS)}")
    if given["slice"] is not None:
        text = given["slice"].strip()
        if text.isascii() and text.isdecimal() and 1 <= int(text[:9]) <= 100_000:
            said["slice"] = int(text)
        else:
            faults.append(f"--slice = {_short(text)} must be a whole number from 1")
    return said, faults


def _numbers(given: dict[str, Any]) -> tuple[dict[str, float], list[str]]:
    """Return the stated numbers in SI units, and what is wrong with them."""
    numbers, faults = {}, []
    for flag in _NUMBERS:
        text = given[flag.key]
        if text is None:
            continue
        try:
            number = float(text) if text.isascii() and "_" not in text else math.nan
        except ValueError:
            number = math.nan
        if flag.low <= number <= flag.high:
            numbers[flag.key] = number * flag.factor
        else:
            comma = "; the decimal mark is a point" if "," in text else ""
            meaning = flag.meaning.partition(" (default")[0]
            faults.append(
                f"--{flag.name} = {_short(text)} must be a number from {flag.low:g} to {flag.high:g} "
                f"({meaning}){comma}"
            )
    return numbers, faults


def _inclination(text: str | None) -> tuple[float | None, str | None]:
    """Slope of the rail from 1:N or none, by the rule of `wearsim contact`."""
    if text is None:
        return None, None
    from wearsim.cli.contact_request import inclination

    try:
        return inclination(text.strip()), None
    except ValueError as error:
        return None, f"--inclination = {_short(text)} {error}"
