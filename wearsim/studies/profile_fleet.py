"""Many measured profiles as one table: a row each, whatever is wrong with some of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from wearsim.contact.patch import FloatArray
from wearsim.errors import ProfileError, WearsimError
from wearsim.profile.formats import FORMATS
from wearsim.profile.limits import LimitSet
from wearsim.profile.shape import Profile, arc_length
from wearsim.quantities import QUANTITIES
from wearsim.studies.profile_examination import JUDGED_AMPLITUDE, Circumstances, Examination, examine
from wearsim.studies.profile_subject import Kind, Subject, read_subject

PLAIN_SUFFIXES = (".csv", ".txt", ".dat", ".asc", ".tsv", ".xy", ".prf")
"""Extensions of text files that are tried, beside those of the known formats."""

OUTLINE = 240
"""Points of an outline kept for figures."""

_ID_KEYS = (("stock", "Stock"), ("car", "CarNo"), ("axle", "AxleNo"), ("side", "Side"))


@dataclass(frozen=True)
class FleetRow:
    """One file of a folder.

    Parameters
    ----------
    file : str
        Its name in the folder.
    identity : mapping of str to str
        stock, car, axle and side of the header, as far as they are there, kind and format, and with a
        comparison the rule of alignment.
    values : mapping of str to float
        By their names in `wearsim.quantities`, SI; what could not be measured is left out.
    exceeded : tuple of str
        Names of measures beyond a limit.
    not_judged : tuple of str
        Names of measures that have limits, of which it cannot be told whether they are beyond.
    judged : bool
        Whether there was anything to be judged by limits; False for rails.
    notes : tuple of str
        What was detected on reading, what could not be told, and the doubts.
    doubts : tuple of str
        What speaks against the wear.
    fault : str
        Why it was not measured or not compared; empty if nothing is wrong.
    measured : bool
        Whether it could be read.
    y, z : (k,) array
        Outline of at most `OUTLINE` points [m].
    """

    file: str
    identity: Mapping[str, str]
    values: Mapping[str, float]
    exceeded: tuple[str, ...]
    not_judged: tuple[str, ...]
    judged: bool
    notes: tuple[str, ...]
    doubts: tuple[str, ...]
    fault: str
    measured: bool
    y: FloatArray = field(repr=False)
    z: FloatArray = field(repr=False)

    @property
    def wheel(self) -> str:
        """Wheel by its header: stock, car, axle and side; the file name without extension else."""
        words = {"car": "car ", "axle": "axle "}
        parts = [words.get(key, "") + self.identity[key] for key, _ in _ID_KEYS if self.identity.get(key)]
        return " ".join(parts) or Path(self.file).stem


def profile_files(folder: Path, every: bool = False) -> tuple[list[Path], list[str]]:
    """Files of a folder that can be profiles.

    Parameters
    ----------
    folder : Path
        Not searched below.
    every : bool
        Whether to take files with any extension.

    Returns
    -------
    files : list of Path
        Sorted by name, hidden ones left out.
    skipped : list of str
        Names of the others; folders end with "/".
    """
    known = {suffix for each in FORMATS.values() for suffix in each.suffixes} | set(PLAIN_SUFFIXES)
    try:
        # links to nothing and pipes are listed, too: their rows tell what they are
        found = sorted((path for path in folder.iterdir() if not path.is_dir()), key=lambda path: path.name)
        folders = [path for path in folder.iterdir() if path.is_dir()]
    except OSError as error:
        raise ProfileError(f"{folder}: cannot be read ({error.strerror}); check its permissions") from error
    visible = [path for path in found if not path.name.startswith(".")]
    taken = [path for path in visible if every or path.suffix.lower() in known]
    others = [path.name for path in visible if path not in set(taken)]
    return taken, others + sorted(f"{path.name}/" for path in folders if not path.name.startswith("."))


def fleet_rows(
    files: list[Path],
    at: Circumstances,
    limits: LimitSet | None,
    *,
    kind: Kind | None = None,
    against: Subject | None = None,
) -> Iterator[FleetRow]:
    """Measure files one after the other; nothing but the rows is kept.

    Parameters
    ----------
    files : list of Path
        In the order wanted.
    at : Circumstances
        As for one profile.
    limits : LimitSet, optional
        To judge by.
    kind : {"wheel", "rail"}, optional
        Of all files, if it is stated.
    against : Subject, optional
        Reference of all files of its kind.

    Yields
    ------
    FleetRow
        Of each file.
    """
    for path in files:
        if not path.is_file():
            what = "is a link to nothing" if path.is_symlink() else "is no regular file"
            yield _faulty(path, f"{what}; it was not read")
            continue
        try:
            subject = read_subject(str(path), kind, at.said)
        except WearsimError as error:
            yield _faulty(path, str(error))
            continue
        yield _row(path, subject, at, limits, against)


def _faulty(path: Path, fault: str) -> FleetRow:
    none: FloatArray = np.empty(0)
    return FleetRow(path.name, {}, {}, (), (), False, (), (), _one_line(path, fault), False, none, none)


def _one_line(path: Path, text: str) -> str:
    """First fault of a file, without its path, and how many there are."""
    lines = [line.replace(f"{path}:", "", 1).strip() for line in text.splitlines()]
    rest = f" (and {len(lines) - 1} more)" if len(lines) > 1 else ""
    first = f"line {lines[0]}" if lines[0].partition(":")[0].isdecimal() else lines[0]
    return first + rest


def _row(
    path: Path, subject: Subject, at: Circumstances, limits: LimitSet | None, against: Subject | None
) -> FleetRow:
    """Row of a file that could be read."""
    fault, apart = "", tuple[str, ...]()
    reference = against if against is not None and against.kind == subject.kind else None
    if against is not None and reference is None:
        apart = (f"a {subject.kind}, not compared with the {against.kind} {against.profile.name}",)
    # a rail has no measures of its own: only its wear is told
    try:
        found = examine(
            subject,
            at,
            limits,
            against=reference,
            amplitudes=(JUDGED_AMPLITUDE,),
            measure_reference=False,
        )
    except WearsimError as error:
        fault = _one_line(path, str(error))
        try:
            found = examine(subject, at, limits, amplitudes=(JUDGED_AMPLITUDE,))
        except WearsimError as again:
            notes = (*subject.notes, *apart)
            return replace(_faulty(path, str(again)), identity=_identity(subject), notes=notes)
    notes = (*found.subject.notes, *apart)
    if found.measures is not None:
        # of what every wheel has; a diameter that nobody stated is no fault
        missing = found.measures.missing
        notes += tuple(dict.fromkeys(missing[name] for name in _EXPECTED if name in missing))
    identity, doubts = _identity(subject), tuple[str, ...]()
    if found.comparison is not None:
        doubts = found.comparison.doubts
        identity["align"] = found.comparison.alignment.rule
    return FleetRow(
        path.name,
        identity,
        _values(found),
        found.exceeded,
        found.not_judged,
        bool(found.judgements),
        (*notes, *doubts),
        doubts,
        fault,
        True,
        *_outline(found.laid),
    )


_EXPECTED = ("flange_height", "flange_thickness", "flange_gradient", "hollowing", "rim_width")


def _identity(subject: Subject) -> dict[str, str]:
    """Header keys that say which wheel it is."""
    told = {key: " ".join(subject.key(name).split())[:60] for key, name in _ID_KEYS}
    return {
        **{key: text for key, text in told.items() if text},
        "kind": subject.kind,
        "format": subject.format,
    }


def _values(found: Examination) -> dict[str, float]:
    values: dict[str, float] = {}
    if found.measures is not None:
        values |= found.measures.values
    for amplitude, conicity, _ in found.running.conicity if found.running is not None else ():
        if amplitude == JUDGED_AMPLITUDE and conicity is not None:
            values["equivalent_conicity"] = conicity
    if found.comparison is not None:
        wear = found.comparison.wear
        values |= {"worn_area": wear.worn_area, "max_wear_depth": wear.max_depth}
        if found.comparison.alignment.rms is not None:
            values["alignment_rms"] = found.comparison.alignment.rms
    return values


def _outline(profile: Profile) -> tuple[FloatArray, FloatArray]:
    """Points at even arc length, few enough for small figures of hundreds of profiles."""
    s = arc_length(profile.y, profile.z)
    if len(s) <= OUTLINE:
        return profile.y, profile.z
    at = np.linspace(0.0, s[-1], OUTLINE)
    return np.interp(at, s, profile.y), np.interp(at, s, profile.z)


def fleet_state(rows: list[FleetRow], reference: Subject | None, limits: LimitSet | None) -> xr.Dataset:
    """Dataset of the rows that could be measured: what the small multiples draw.

    Parameters
    ----------
    rows : list of FleetRow
        Any number.
    reference : Subject, optional
        Drawn grey behind each profile.
    limits : LimitSet, optional
        That exceeded measures refer to.

    Returns
    -------
    Dataset
        `profile_y, profile_z (wheel, point)`, the last point repeated on shorter outlines; `wheel_name`
        (that of the file where several say to be one wheel), `file`, `exceeded`, `not_judged`, `judged`,
        `kind (wheel)`; measures `(wheel)`, NaN-free:
        `known_<name> (wheel)` tells where a measure is there, it is 0 elsewhere.
    """
    good = [row for row in rows if row.measured]
    longest = max((len(row.y) for row in good), default=0)

    def padded(values: FloatArray) -> FloatArray:
        return np.concatenate((values, np.repeat(values[-1:], longest - len(values))))

    often = Counter(row.wheel for row in good)
    texts: dict[str, Any] = {
        "wheel_name": ("wheel", [row.file if often[row.wheel] > 1 else row.wheel for row in good]),
        "file": ("wheel", [row.file for row in good]),
        "kind": ("wheel", [row.identity["kind"] for row in good]),
        "exceeded": ("wheel", [" ".join(row.exceeded) for row in good]),
        "not_judged": ("wheel", [" ".join(row.not_judged) for row in good]),
        "judged": ("wheel", np.array([row.judged for row in good], dtype=np.int8)),
    }
    data: dict[str, Any] = {}
    for name in ("profile_y", "profile_z"):
        lines = [padded(getattr(row, name[-1])) for row in good]
        values = np.stack(lines) if lines else np.empty((0, 0))
        data[name] = (("wheel", "point"), values, _attributes(name))
    for name in dict.fromkeys(name for row in good for name in row.values):
        known = np.array([name in row.values for row in good])
        values = np.array([row.values.get(name, 0.0) for row in good])
        data[name] = ("wheel", values, _attributes(name))
        data[f"known_{name}"] = ("wheel", known.astype(np.int8), {"long_name": f"whether {name} is known"})
    attributes = {
        "reference_label": "",
        "reference_kind": "",
        "limits": "" if limits is None else limits.name,
    }
    if reference is not None:
        profile = reference.profile
        data["reference_y"] = ("reference_point", profile.y, _attributes("profile_y"))
        data["reference_z"] = ("reference_point", profile.z, _attributes("profile_z"))
        attributes |= {"reference_label": profile.name, "reference_kind": profile.kind}
    attributes["faults"] = str(len(rows) - len(good))
    return xr.Dataset(data | texts, attrs=attributes)


@lru_cache(maxsize=64)
def _attributes(name: str) -> dict[str, str]:
    quantity = QUANTITIES[name]
    return {"long_name": quantity.meaning, "units": quantity.unit or "1"}
