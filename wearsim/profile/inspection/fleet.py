"""Many measured profiles as one table: a row each, whatever is wrong with some of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from wearsim.errors import ProfileError, WearsimError
from wearsim.profile.conicity import JUDGED_AMPLITUDE
from wearsim.profile.files import FORMATS
from wearsim.profile.inspection import Conditions, Inspection, inspect_profile
from wearsim.profile.inspection.inputs import ProfileInput, read_input
from wearsim.profile.limits import LimitSet
from wearsim.profile.shape import FloatArray, Kind, Profile, arc_length

# extensions of text files that are tried as well as those of the known formats
_PLAIN_SUFFIXES = (".csv", ".txt", ".dat", ".asc", ".tsv", ".xy", ".prf")
_OUTLINE = 240  # points of an outline kept for figures
_ID_KEYS = {"stock": "Stock", "car": "CarNo", "axle": "AxleNo", "side": "Side"}
_EXPECTED = ("flange_height", "flange_thickness", "flange_gradient", "hollowing", "rim_width")


@dataclass(frozen=True)
class FleetRow:
    """One file of a folder."""

    file: str  # its name in the folder
    # stock, car, axle and side of the header, kind, format and, with a comparison, the rule of alignment
    identity: Mapping[str, str] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)  # by names in `wearsim.quantities`, SI
    exceeded: tuple[str, ...] = ()  # names of measures beyond a limit
    not_judged: tuple[str, ...] = ()  # names of measures that could not be compared with their limits
    judged: bool = False  # whether there was anything to be judged by limits; not of rails
    notes: tuple[str, ...] = ()  # what was detected, what could not be measured, and the warnings
    warnings: tuple[str, ...] = ()  # what speaks against the wear
    fault: str = ""  # why it was not measured or not compared
    measured: bool = False  # whether it could be read
    # outline of at most `_OUTLINE` points [m]
    y: FloatArray = field(repr=False, default_factory=lambda: np.empty(0))
    z: FloatArray = field(repr=False, default_factory=lambda: np.empty(0))

    @property
    def wheel(self) -> str:
        """Wheel by its header: stock, car, axle and side; the file name without extension else."""
        words = {"car": "car ", "axle": "axle "}
        parts = [words.get(key, "") + self.identity[key] for key in _ID_KEYS if self.identity.get(key)]
        return " ".join(parts) or Path(self.file).stem


def profile_files(folder: Path, every: bool = False) -> tuple[list[Path], list[str]]:
    """Files of a folder that can be profiles, sorted, and the names of the others; folders end with "/".

    Hidden files are left out; `every` takes files with any extension. Raises `ProfileError` for a folder
    that cannot be read.
    """
    known = {suffix for each in FORMATS.values() for suffix in each.suffixes} | set(_PLAIN_SUFFIXES)
    try:
        paths = sorted(path for path in folder.iterdir() if not path.name.startswith("."))
        folders = [path for path in paths if path.is_dir()]
    except OSError as error:
        raise ProfileError(f"{folder}: cannot be read ({error.strerror}); check its permissions") from error
    # links to nothing and pipes are listed, too: their rows say what they are
    files = [path for path in paths if path not in folders]
    taken = [path for path in files if every or path.suffix.lower() in known]
    others = [path.name for path in files if path not in taken]
    return taken, others + [f"{path.name}/" for path in folders]


def fleet_rows(
    files: list[Path],
    at: Conditions,
    limits: LimitSet | None,
    *,
    kind: Kind | None = None,
    against: ProfileInput | None = None,
) -> Iterator[FleetRow]:
    """Measure files one after the other, as one profile, against a reference of their kind.

    Nothing but the rows is kept; `kind` is that of all files, if it is stated.
    """
    for path in files:
        if not path.is_file():
            what = "is a link to nothing" if path.is_symlink() else "is no regular file"
            yield FleetRow(path.name, fault=f"{what}; it was not read")
            continue
        try:
            given = read_input(str(path), kind, at.statements)
        except WearsimError as error:
            yield FleetRow(path.name, fault=_one_line(path, str(error)))
            continue
        yield _row(path, given, at, limits, against)


def _one_line(path: Path, text: str) -> str:
    """First fault of a file, without its path, and how many there are."""
    lines = [line.replace(f"{path}:", "", 1).strip() for line in text.splitlines()]
    rest = f" (and {len(lines) - 1} more)" if len(lines) > 1 else ""
    first = f"line {lines[0]}" if lines[0].partition(":")[0].isdecimal() else lines[0]
    return first + rest


def _row(
    path: Path, given: ProfileInput, at: Conditions, limits: LimitSet | None, against: ProfileInput | None
) -> FleetRow:
    """Row of a file that could be read."""
    fault, apart = "", tuple[str, ...]()
    reference = against if against is not None and against.kind == given.kind else None
    if against is not None and reference is None:
        apart = (f"a {given.kind}, not compared with the {against.kind} {against.profile.name}",)
    identity = {key: " ".join(given.key(name).split())[:60] for key, name in _ID_KEYS.items()}
    identity = {key: text for key, text in identity.items() if text}
    identity |= {"kind": given.kind, "format": given.format}
    amplitudes = (JUDGED_AMPLITUDE,)
    for other in (reference, None):  # where it cannot be compared, it is measured alone
        try:
            result = inspect_profile(
                given, at, limits, against=other, amplitudes=amplitudes, measure_reference=False
            )
            break
        except WearsimError as error:
            fault = _one_line(path, str(error))
    else:
        return FleetRow(path.name, identity, notes=(*given.notes, *apart), fault=fault)
    notes, warnings = (*result.given.notes, *apart), tuple[str, ...]()
    if result.measures:
        # of what every wheel has; a diameter that nobody stated is no fault
        missing = result.measures["right"].missing
        notes += tuple(dict.fromkeys(missing[name] for name in _EXPECTED if name in missing))
    if result.comparison is not None:
        warnings = result.comparison.warnings
        identity["align"] = result.comparison.alignment.rule
    judged = (result.exceeded, result.not_judged, bool(result.judgements))
    y, z = _outline(result.aligned)
    return FleetRow(
        path.name, identity, _values(result), *judged, (*notes, *warnings), warnings, fault, True, y, z
    )


def _values(result: Inspection) -> dict[str, float]:
    values = dict(result.measures["right"].values) if result.measures else {}
    conicity = result.running.judged_conicity if result.running is not None else None
    if conicity is not None:
        values["equivalent_conicity"] = conicity
    if result.comparison is not None:
        wear, rms = result.comparison.wear, result.comparison.alignment.rms
        values |= {"worn_area": wear.worn_area, "max_wear_depth": wear.max_depth}
        values |= {} if rms is None else {"alignment_rms": rms}
    return values


def _outline(profile: Profile) -> tuple[FloatArray, FloatArray]:
    """Points at even arc length, few enough for small figures of hundreds of profiles."""
    s = arc_length(profile.y, profile.z)
    if len(s) <= _OUTLINE:
        return profile.y, profile.z
    at = np.linspace(0.0, s[-1], _OUTLINE)
    return np.interp(at, s, profile.y), np.interp(at, s, profile.z)
