"""Many measured profiles as one table: a row each, whatever is wrong with some of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from wearsim.errors import ProfileError, WearsimError
from wearsim.profile.files import FORMATS
from wearsim.profile.files.points import value_of
from wearsim.profile.inspection import Conditions, inspect_profile
from wearsim.profile.inspection.inputs import ProfileInput, read_input
from wearsim.profile.limits import LimitSet
from wearsim.profile.shape import Kind, Profile
from wearsim.whole_files import utf8

# extensions of text files that are tried as well as those of the known formats
_PLAIN_SUFFIXES = (".csv", ".txt", ".dat", ".asc", ".tsv", ".xy", ".prf")
_ID_KEYS = {"stock": "Stock", "car": "CarNo", "axle": "AxleNo", "side": "Side"}
_WORDS = {"car": "car ", "axle": "axle "}


@dataclass(frozen=True)
class FleetRow:
    """One file of a folder: its values as JSON prints them, and the profile as aligned, if it was measured.

    `file`, `wheel` by its header (else the file name without extension), `stock`, `car`, `axle`, `side`,
    `kind`, `format`, `align`; measures in SI units; `exceeded` and `not_judged`, names of measures; `notes`
    and `warnings`; `fault`, why it was not measured or not compared.
    """

    values: dict[str, Any]
    profile: Profile | None = field(default=None, repr=False)


def profile_files(folder: Path, every: bool = False) -> tuple[list[Path], list[str]]:
    """Files of a folder that can be profiles, sorted, and the names of the others; folders end with "/".

    Hidden files are left out; `every` takes files with any extension. Raises `ProfileError` for a folder
    that cannot be read.
    """
    known = {suffix for each in FORMATS.values() for suffix in each.suffixes} | set(_PLAIN_SUFFIXES)
    try:
        paths = sorted(path for path in folder.iterdir() if not path.name.startswith("."))
    except OSError as error:
        raise ProfileError(
            f"{folder} cannot be read ({error.strerror}); give a folder of profiles"
        ) from error
    folders = [path for path in paths if path.is_dir()]
    taken = [path for path in paths if path not in folders and (every or path.suffix.lower() in known)]
    others = [path.name for path in paths if path not in folders and path not in taken]
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

    `kind` is that of all files, if it is stated.
    """
    for path in files:
        row: dict[str, Any] = {"file": path.name, "wheel": utf8(path.stem), "notes": [], "warnings": [],
                               "exceeded": [], "not_judged": [], "fault": None}  # fmt: skip
        try:
            given = read_input(str(path), kind, at.statements)
            yield FleetRow(row, _measured(row, given, at, limits, against))
        except WearsimError as error:
            row["fault"] = _one_line(path, error)
            yield FleetRow(row)


def _one_line(path: Path, error: WearsimError) -> str:
    """First fault of a file, without its folder, and how many there are."""
    first, *rest = str(error).replace(str(path), path.name).splitlines()
    return f"{first} (and {len(rest)} more)" if rest else first


def _measured(
    row: dict[str, Any],
    given: ProfileInput,
    at: Conditions,
    limits: LimitSet | None,
    against: ProfileInput | None,
) -> Profile:
    """Fill the row of a file that could be read; its profile as aligned."""
    identity = {key: " ".join(value_of(given.header, name).split())[:60] for key, name in _ID_KEYS.items()}
    identity = {key: text for key, text in identity.items() if text}
    row |= identity | {"kind": given.kind, "format": given.format, "notes": list(given.notes)}
    row["wheel"] = " ".join(_WORDS.get(key, "") + text for key, text in identity.items()) or row["wheel"]
    if against is not None and against.kind != given.kind:
        given = given.noted(f"a {given.kind}, not compared with the {against.kind} {against.profile.name}")
        against = None
    try:
        result = inspect_profile(given, at, limits, against=against, brief=True)
    except WearsimError as error:  # where it cannot be compared, it is measured alone
        row["fault"] = _one_line(Path(given.given), error)
        result = inspect_profile(given, at, limits, brief=True)
    row |= {"exceeded": result.beyond(), "not_judged": result.not_judged, "notes": list(result.given.notes)}
    for measures in result.measures.values():
        row |= measures.values
        row["notes"] += dict.fromkeys(measures.missing.values())
    if result.running is not None:
        row["equivalent_conicity"] = result.running.judged_conicity
    if (comparison := result.comparison) is not None:
        row |= {"align": comparison.alignment.rule, "alignment_rms": comparison.alignment.rms,
                "worn_area": comparison.wear.worn_area, "max_wear_depth": comparison.wear.max_wear_depth,
                "warnings": list(comparison.warnings)}  # fmt: skip
    return result.aligned
