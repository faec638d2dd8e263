"""Many measured profiles as one table: a row each, whatever is wrong with some of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from wearsim.errors import ProfileError, WearsimError
from wearsim.profile.conicity import JUDGED_AMPLITUDE
from wearsim.profile.files import FORMATS
from wearsim.profile.inspection import Conditions, Inspection, inspect_profile
from wearsim.profile.inspection.inputs import ProfileInput, read_input
from wearsim.profile.limits import LimitSet
from wearsim.profile.shape import FloatArray, Kind, arc_length
from wearsim.whole_files import utf8

# extensions of text files that are tried as well as those of the known formats
_PLAIN_SUFFIXES = (".csv", ".txt", ".dat", ".asc", ".tsv", ".xy", ".prf")
_OUTLINE = 240  # points of an outline kept for small figures
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
    # outline of `_OUTLINE` points at even arc length [m]
    y: FloatArray = field(repr=False, default_factory=lambda: np.empty(0))
    z: FloatArray = field(repr=False, default_factory=lambda: np.empty(0))

    @property
    def wheel(self) -> str:
        """Wheel by its header: stock, car, axle and side; the file name without extension else."""
        words = {"car": "car ", "axle": "axle "}
        parts = [words.get(key, "") + self.identity[key] for key in _ID_KEYS if self.identity.get(key)]
        return " ".join(parts) or utf8(Path(self.file).stem)


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
        raise ProfileError(
            f"{folder} cannot be read ({error.strerror}); give a folder of profiles"
        ) from error
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
        try:
            given = read_input(str(path), kind, at.statements)
        except WearsimError as error:
            yield FleetRow(path.name, fault=_one_line(path, error))
        else:
            yield _row(path, given, at, limits, against)


def _one_line(path: Path, error: WearsimError) -> str:
    """First fault of a file, without its folder, and how many there are."""
    first, *rest = str(error).replace(str(path), path.name).splitlines()
    return f"{first} (and {len(rest)} more)" if rest else first


def _row(
    path: Path, given: ProfileInput, at: Conditions, limits: LimitSet | None, against: ProfileInput | None
) -> FleetRow:
    """Row of a file that could be read."""
    identity = {key: " ".join(given.key(name).split())[:60] for key, name in _ID_KEYS.items()}
    identity = {key: text for key, text in identity.items() if text}
    identity |= {"kind": given.kind, "format": given.format}
    if against is not None and against.kind != given.kind:
        given = given.noted(f"a {given.kind}, not compared with the {against.kind} {against.profile.name}")
        against = None
    inspect = partial(
        inspect_profile, given, at, limits, amplitudes=(JUDGED_AMPLITUDE,), measure_reference=False
    )
    fault = ""
    try:
        try:
            result = inspect(against=against)
        except WearsimError as error:  # where it cannot be compared, it is measured alone
            fault = _one_line(path, error)
            result = inspect()
    except WearsimError as error:
        return FleetRow(path.name, identity, notes=given.notes, fault=_one_line(path, error))
    notes, warnings = result.given.notes, tuple[str, ...]()
    if result.measures:
        # of what every wheel has; a diameter that nobody stated is no fault
        missing = result.measures["right"].missing
        notes += tuple(dict.fromkeys(missing[name] for name in _EXPECTED if name in missing))
    if result.comparison is not None:
        warnings = result.comparison.warnings
        identity["align"] = result.comparison.alignment.rule
    judged = (result.exceeded, result.not_judged, bool(result.judgements))
    s = arc_length(result.aligned.y, result.aligned.z)
    at_even = np.linspace(0.0, s[-1], _OUTLINE)
    y, z = (np.interp(at_even, s, line) for line in (result.aligned.y, result.aligned.z))
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
        values |= {"worn_area": wear.worn_area, "max_wear_depth": wear.max_wear_depth}
        values |= {} if rms is None else {"alignment_rms": rms}
    return values
