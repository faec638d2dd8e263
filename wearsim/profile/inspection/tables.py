"""Output of `wearsim profile` for one profile or a folder: tables, CSV and JSON.

CSV and JSON are in SI units.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from wearsim.errors import ProfileError, WearsimError
from wearsim.profile.conicity import Running
from wearsim.profile.files import FORMATS
from wearsim.profile.files.points import one_line, value_of
from wearsim.profile.inspection import (
    Conditions,
    Inspection,
    ReprofiledWheel,
    inspect_profile,
)
from wearsim.profile.inspection.inputs import ProfileInput, read_input
from wearsim.profile.limits import NO_DIAMETER, Judgement, LimitSet
from wearsim.profile.measures import BELOW_TIP, LEVEL, Measures
from wearsim.profile.placement import BACK_TO_BACK
from wearsim.profile.shape import Kind, Profile, arc_length
from wearsim.quantities import QUANTITIES
from wearsim.texts import WIDTH, text_table, wrapped, written
from wearsim.whole_files import json_value, utf8

# Extensions of text files that are read in addition to those of the known formats.
_PLAIN_SUFFIXES = (".csv", ".txt", ".dat", ".asc", ".tsv", ".xy", ".prf")
_ID_KEYS = {"stock": "Stock", "car": "CarNo", "axle": "AxleNo", "side": "Side"}
_WORDS = {"car": "car ", "axle": "axle "}


@dataclass(frozen=True)
class FleetRow:
    """File of a folder: its JSON values and, if measured, its aligned profile.

    `file`, `wheel` by its header (else the file name without extension), `stock`,
    `car`, `axle`, `side`, `kind`, `format`, `align`; measures in SI units; `exceeded`
    and `not_judged`, names of measures; `notes` and `warnings`; `fault`, the reason why
    it was not measured or not compared.
    """

    values: dict[str, Any]
    profile: Profile | None = field(default=None, repr=False)


def profile_files(folder: Path, every: bool = False) -> tuple[list[Path], list[str]]:
    """Sorted profile files of a folder, and the names of the other entries.

    Names of folders end with "/". Hidden files are omitted; `every` includes files with
    any extension. Raises `ProfileError` for a folder that cannot be read.
    """
    suffixes = {
        suffix for file_format in FORMATS.values() for suffix in file_format.suffixes
    } | set(_PLAIN_SUFFIXES)
    try:
        paths = sorted(
            path for path in folder.iterdir() if not path.name.startswith(".")
        )
    except OSError as error:
        raise ProfileError(
            f"{folder} cannot be read ({error.strerror}); give a folder of profiles"
        ) from error
    folders = [path for path in paths if path.is_dir()]
    taken = [
        path
        for path in paths
        if path not in folders and (every or path.suffix.lower() in suffixes)
    ]
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
    """Measure files one after the other, each against a reference of its kind.

    `kind` applies to all files if it is stated.
    """
    for path in files:
        row: dict[str, Any] = {
            "file": path.name,
            "wheel": utf8(path.stem),
            "notes": [],
            "warnings": [],
            "exceeded": [],
            "not_judged": [],
            "fault": None,
        }
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
    """Fill the row of a readable file; return its aligned profile."""
    identity = {
        key: " ".join(value_of(given.header, name).split())[:60]
        for key, name in _ID_KEYS.items()
    }
    identity = {key: text for key, text in identity.items() if text}
    row |= identity | {
        "kind": given.kind,
        "format": given.format,
        "notes": list(given.notes),
    }
    row["wheel"] = (
        " ".join(_WORDS.get(key, "") + text for key, text in identity.items())
        or row["wheel"]
    )
    if against is not None and against.kind != given.kind:
        given = given.noted(
            f"a {given.kind}, not compared with the {against.kind} "
            f"{against.profile.name}"
        )
        against = None
    try:
        result = inspect_profile(given, at, limits, against=against, brief=True)
    except WearsimError as error:  # without comparison the profile is measured alone
        row["fault"] = _one_line(Path(given.given), error)
        result = inspect_profile(given, at, limits, brief=True)
    row |= {
        "exceeded": result.beyond(),
        "not_judged": result.not_judged,
        "notes": list(result.given.notes),
    }
    for measures in result.measures.values():
        row |= measures.values
        row["notes"] += dict.fromkeys(measures.missing.values())
    if result.running is not None:
        row["equivalent_conicity"] = result.running.judged_conicity
    if (comparison := result.comparison) is not None:
        row |= {
            "align": comparison.alignment.rule,
            "alignment_rms": comparison.alignment.rms,
            "worn_area": comparison.wear.worn_area,
            "max_wear_depth": comparison.wear.max_wear_depth,
            "warnings": list(comparison.warnings),
        }
    return result.aligned


MEASURES = {
    "flange_height": "Sh",
    "flange_thickness": "Sd",
    "flange_gradient": "qR",
    "hollowing": "hollow",
    "rim_width": "rim",
    "wheel_diameter": "D",
    "wheel_diameter_difference": "ΔD",
    "back_to_back": "AR",
    "front_to_front": "SR",
}
"""Measures in the order of tables, with their short names."""
_SYMBOLS = ("Sh", "Sd", "qR", "AR", "SR")
"""Short names that are those of the standards."""


class FleetColumn(NamedTuple):
    """Column of the CSV file of a fleet.

    `title` is its heading on screen, "" if it is not shown there.
    """

    quantity: str
    digits: int
    title: str


_FLEET = {
    "Sh_mm": FleetColumn("flange_height", 3, "Sh"),
    "Sd_mm": FleetColumn("flange_thickness", 3, "Sd"),
    "qR_mm": FleetColumn("flange_gradient", 3, "qR"),
    "hollowing_mm": FleetColumn("hollowing", 3, "hollow"),
    "rim_width_mm": FleetColumn("rim_width", 3, ""),
    "diameter_mm": FleetColumn("wheel_diameter", 3, "D"),
    "conicity_3mm": FleetColumn("equivalent_conicity", 4, "conicity"),
    "worn_area_mm2": FleetColumn("worn_area", 3, "area mm²"),
    "max_wear_depth_mm": FleetColumn("max_wear_depth", 4, "depth"),
    "rms_um": FleetColumn("alignment_rms", 1, "rms µm"),
}
_IDENTITY = ("file", "wheel", "kind", "format", "stock", "car", "axle", "side", "align")
"""Columns of the CSV of a fleet before those of the measures."""
_HEADER = (
    "Stock",
    "CarNo",
    "AxleNo",
    "Side",
    "WheelID",
    "Sh",
    "Sd",
    "qR",
    "Line",
    "Date",
    "Time",
    "UOF1",
    "comment",
)
"""Keys of the file header that are shown."""
_ROOM = "wearsim.profile.inspection"
_SHORT = {**MEASURES, "equivalent_conicity": "conicity"}


def as_text(result: Inspection) -> str:
    """Return all tables as text."""
    values: dict[str, Any] = {
        "r": result,
        "verdict": _verdict(result),
        "measures": _measures(result),
        "limits": _limits(result),
    }
    if result.running is not None:
        values |= {"track": track_text(result.running)} | _running(
            result, result.running
        )
    sources = dict.fromkeys(
        (judgement.source, judgement.certainty) for judgement in result.judgements
    )
    return written(
        _ROOM,
        "profile.txt.j2",
        **_SAYS,
        **values,
        sources=sources,
        header=_header,
        margin=_margin,
        arc_length=arc_length,
        quantities=QUANTITIES,
        circle=result.conditions.running_circle,
        level=result.conditions.measuring_height,
        level_qr=LEVEL,
        below_tip=BELOW_TIP,
    )


def reprofiled_text(template: ProfileInput, wheels: Sequence[ReprofiledWheel]) -> str:
    """Return the material removed from one wheel, or from right and left, as text."""
    return written(
        _ROOM, "reprofiled.txt.j2", **_SAYS, template=template, wheels=wheels
    )


def _header(given: ProfileInput) -> list[str]:
    texts = ((key, value_of(given.header, key)) for key in _HEADER)
    return [one_line(f"{key} {value}")[:300] for key, value in texts if value]


def _wrapped(word: str, text: str) -> str:
    """Wrap the lines of a long text after a word."""
    first = f"  {word:<10} "
    lines = textwrap.wrap(
        text,
        WIDTH,
        initial_indent=first,
        subsequent_indent=" " * len(first),
        break_long_words=False,
    )
    return "\n".join(lines or [first])


def _number(value: float | None, form: str = ".3f", factor: float = 1e3) -> str:
    """Length in mm, "-" if missing; a value that rounds to zero has no sign."""
    return "-" if value is None else f"{round(factor * value, 3) + 0.0:{form}}"


_SAYS: dict[str, Any] = {
    "number": _number,
    "wrapped": _wrapped,
    "in_lines": wrapped,
    "one_line": one_line,
}


def _measures(result: Inspection) -> list[str]:
    """Table of the gauge values, of both wheels or against another."""
    several, comparison = len(result.measures) > 1, result.comparison
    columns = [
        (body if several else result.given.profile.name, side_measures.values, ".3f")
        for body, side_measures in result.measures.items()
    ]
    if comparison is not None and comparison.measures is not None:
        now, old = result.measures["right"].values, comparison.measures.values
        change = {name: now[name] - old[name] for name in now.keys() & old.keys()}
        columns += [
            (comparison.reference.profile.name, old, ".3f"),
            ("difference", change, "+.3f"),
        ]
    rows = [["measures [mm]", *(title for title, _, _ in columns)]]
    for name in MEASURES:
        if any(name in values for _, values, _ in columns):
            cells = (_number(values.get(name), form) for _, values, form in columns)
            rows.append([f"  {_named(name)}", *cells])
    return text_table(rows)


def _named(name: str) -> str:
    meaning, symbol = QUANTITIES[name].meaning, MEASURES.get(name)
    return f"{meaning} {symbol}" if symbol in _SYMBOLS else meaning


def _limits(result: Inspection) -> list[str]:
    """Table of the limits."""
    rows = [
        [
            f"limits [mm] ({result.limits.name})" if result.limits else "",
            "value",
            "limit",
        ]
    ]
    for judgement in result.judgements:
        factor = QUANTITIES[judgement.measure].shown_factor
        whose = (
            f"{judgement.wheel} "
            if len(result.measures) > 1 and judgement.wheel != "axle"
            else ""
        )
        limit = "-" if judgement.limit is None else f"{judgement.limit * factor:g}"
        value = _number(judgement.value, factor=factor)
        rows.append(
            [
                f"  {whose}{_named(judgement.measure)}",
                value,
                f"{judgement.bound} {limit}",
            ]
        )
    return text_table(rows)


def _verdict(result: Inspection) -> list[str]:
    """First lines on the limits: what is beyond them, or the least margin."""
    if result.conditions.no_limits and result.measures:
        return [wrapped(f"no limits compared: {result.conditions.no_limits}")]
    if not result.judgements or result.limits is None:
        return []
    name, several = result.limits.name, len(result.measures) > 1
    compared = [
        judgement for judgement in result.judgements if judgement.margin is not None
    ]
    beyond = [
        _against(judgement, several) for judgement in compared if judgement.exceeded
    ]
    lines = [f"BEYOND LIMITS ({name}): {text}" for text in beyond]
    if not beyond and compared:
        least = min(compared, key=lambda judgement: judgement.margin or 0.0)
        part = ", some left out" if result.limits.left_out else ""
        nearest = _against(least, several)
        lines = [f"within the limits ({name}{part}); nearest: {nearest}"]
    if result.not_judged:
        names = ", ".join(_named(measure) for measure in result.not_judged)
        lines.append(f"limits left open: {names} (reasons in the table)")
    return [wrapped(line) for line in lines]


def _against(judgement: Judgement, several: bool) -> str:
    """Value of a measure, its limit, and how far it is from it or beyond it."""
    quantity = QUANTITIES[judgement.measure]
    factor = quantity.shown_factor
    unit = "" if quantity.shown_unit == "1" else f" {quantity.shown_unit}"
    whose = f"{judgement.wheel} " if several and judgement.wheel != "axle" else ""
    value = _number(judgement.value, factor=factor) + unit
    limit = f"{judgement.bound} {(judgement.limit or 0.0) * factor:g}"
    margin = f"{abs(judgement.margin or 0.0) * factor:.3f}"
    off = f"by {margin}" if judgement.exceeded else f"{margin} left"
    return f"{whose}{_named(judgement.measure)} {value}, {limit}, {off}"


def _margin(judgement: Judgement) -> str:
    """Return the margin to a limit, or why it cannot be checked."""
    if judgement.margin is None:
        if judgement.reason == NO_DIAMETER:
            return "not checked: diameter not given (--diameter-mm)"
        return f"not checked: {judgement.reason}"
    size = abs(judgement.margin) * QUANTITIES[judgement.measure].shown_factor
    text = f"{size:.3f}" if size >= 0.0005 else "less than 0.001"
    condition = f", for {judgement.condition}" if judgement.condition else ""
    return (f"EXCEEDED by {text}" if judgement.exceeded else f"{text} left") + condition


def track_text(run: Running) -> str:
    """Describe which wheels run on which rails."""
    wheels = f"{run.wheel} and {run.left} (left)" if run.differ else run.wheel
    return f"{wheels} on {run.track}"


def _running(result: Inspection, run: Running) -> dict[str, Any]:
    """Tables of rolling radius difference and conicity, and why values are missing."""
    before, runs = result.comparison, {"": run}
    if before is not None and before.running is not None:
        runs[f", {before.reference.profile.name}"] = before.running
    shifts = dict.fromkeys(
        at.shift
        for compared_run in runs.values()
        for at in compared_run.rolling_radius_difference
    )
    # to both sides of wheels that differ: a table each, else the lines are too long
    sides = [[at for at in shifts if at < 0.0], [at for at in shifts if at >= 0.0]]
    lines = [line for side in sides if side for line in _differences(runs, side)]
    conicities = [["  amplitude [mm]"]]
    conicities[0] += [f"{1e3 * at.amplitude:g}" for at in run.equivalent_conicity]
    whys: dict[str, None] = {}
    for title, compared_run in runs.items():
        values = [
            _number(at.value, factor=1.0) for at in compared_run.equivalent_conicity
        ]
        conicities.append([f"  equivalent conicity, EN 15302{title}", *values])
        whys |= {
            at.reason: None for at in compared_run.equivalent_conicity if at.reason
        }
    return {"running": lines + text_table(conicities), "undefined": whys}


def _differences(runs: Mapping[str, Running], shifts: Sequence[float]) -> list[str]:
    """Table of the rolling radius differences at some shifts [m]."""
    table = [["  shift, to the right [mm]", *(f"{1e3 * at:g}" for at in shifts)]]
    for title, run in runs.items():
        difference_at = {at.shift: at.value for at in run.rolling_radius_difference}
        cells = (
            _number(difference_at[at]) if at in difference_at else "" for at in shifts
        )
        table.append([f"  rolling radius difference{title} [mm]", *cells])
    return text_table(table)


def points_csv(result: Inspection) -> str:
    """Return the points, or the wear depth along the profile, as CSV."""
    profile = result.given.profile
    columns = {
        "arc_length_mm": arc_length(profile.y, profile.z),
        "y_mm": profile.y,
        "z_mm": profile.z,
    }
    if result.comparison is not None:
        wear = result.comparison.wear
        columns = {
            "arc_length_mm": wear.s,
            "y_mm": wear.y,
            "z_mm": wear.z,
            "depth_mm": wear.depth,
        }
    return _csv(1e3 * pd.DataFrame(columns), "%.6f")


def _csv(table: pd.DataFrame, form: str | None = None) -> str:
    return table.to_csv(index=False, float_format=form, lineterminator="\n")


def as_json(result: Inspection) -> dict[str, Any]:
    """Return the JSON value of one profile, SI units."""
    at, comparison = result.conditions, result.comparison
    value: dict[str, Any] = {"profile": _profile_json(result.given)}
    if result.left is not None:
        value["left"] = _profile_json(result.left)
    value["measures"] = _measures_json(result.measures.get("right"))
    value |= {
        f"{body}_measures": _measures_json(result.measures[body])
        for body in list(result.measures)[1:]
    }
    if result.limits is not None:
        value |= {
            "limits": {
                "name": result.limits.name,
                "title": result.limits.title,
                "left_out": result.limits.left_out,
            },
            "judgements": json_value(result.judgements),
            "exceeded": result.beyond(),
            "not_judged": result.not_judged,
        }
    elif at.no_limits:
        value["no_limits"] = at.no_limits
    value["measuring"] = {
        "measuring_height": at.measuring_height,
        "running_circle": at.running_circle,
    }
    value["track"] = {
        "gauge": at.gauge,
        "half_span": at.half_span,
        "back_to_back": at.back_to_back or BACK_TO_BACK,
        "back_to_back_stated": at.back_to_back is not None,
    }
    value |= {"running": json_value(result.running), "trouble": result.trouble}
    if comparison is not None:
        value["against"] = {
            "profile": _profile_json(comparison.reference),
            "alignment": json_value(comparison.alignment),
            **json_value(comparison.wear),
            "warnings": list(comparison.warnings),
            "measures": _measures_json(comparison.measures),
            "running": json_value(comparison.running),
        }
    return value


def reprofiled_json(
    template: ProfileInput, wheels: Sequence[ReprofiledWheel]
) -> dict[str, Any]:
    """Return the JSON value of reprofiled wheels, SI units."""
    return {"template": _profile_json(template), "wheels": json_value(wheels)}


def _profile_json(given: ProfileInput) -> dict[str, Any]:
    y, z = given.profile.y, given.profile.z
    names = (
        "given",
        "kind",
        "format",
        "title",
        "source",
        "certainty",
        "notes",
        "header",
    )
    return {
        "name": given.profile.name,
        **{name: getattr(given, name) for name in names},
        "points": len(y),
        "length": float(arc_length(y, z)[-1]),
        "y_range": [float(y.min()), float(y.max())],
        "z_range": [float(z.min()), float(z.max())],
    }


def _measures_json(measures: Measures | None) -> dict[str, Any] | None:
    if measures is None:
        return None
    return {
        **{name: measures.values.get(name) for name in MEASURES},
        "missing": dict(measures.missing),
    }


def fleet_json(row: FleetRow) -> dict[str, Any]:
    """Return the SI values of a row."""
    return dict.fromkeys(column.quantity for column in _FLEET.values()) | row.values


def _fleet_cells(row: FleetRow) -> dict[str, str]:
    """Cells of a row by column of the CSV."""
    value = row.values
    cells = {key: value.get(key, "") for key in _IDENTITY}
    for column, (name, digits, _) in _FLEET.items():
        number = value.get(name)
        cells[column] = (
            ""
            if number is None
            else f"{number * QUANTITIES[name].shown_factor:.{digits}f}"
        )
    for key in ("exceeded", "not_judged"):
        cells[key] = " ".join(_SHORT.get(name, name) for name in value[key])
    return {
        **cells,
        "notes": "; ".join(value["notes"] + value["warnings"]),
        "fault": value["fault"] or "",
    }


def fleet_csv(rows: Sequence[FleetRow]) -> str:
    """Return all rows as CSV."""
    return _csv(_fleet_table(rows))


def _fleet_table(rows: Sequence[FleetRow]) -> pd.DataFrame:
    return pd.DataFrame(map(_fleet_cells, rows))


def fleet_text(rows: Sequence[FleetRow]) -> str:
    """Return the table as text: columns that are not empty, faults in their row."""
    cells = _fleet_table(rows)
    filled = cells.columns[(cells != "").any()]
    used = {key: column.title for key, column in _FLEET.items() if key in filled}
    used = {"file": "file"} | {key: title for key, title in used.items() if title}
    table = [list(used.values()), *cells[[*used]].replace("", "-").values.tolist()]
    remarks = ["wheel, beyond limits, faults", *map(_remark, rows)]
    lines = [
        f"{line}  {remark}".rstrip()
        for line, remark in zip(text_table(table), remarks, strict=True)
    ]
    values = [row.values for row in rows]
    if any(
        row_values["not_judged"] and "wheel_diameter" not in row_values
        for row_values in values
    ):
        lines.append(
            "not checked: some limits need the wheel diameter, which is not given "
            "(--diameter-mm)"
        )
    if any(row_values["warnings"] for row_values in values):
        lines.append("wear uncertain: the reasons are in the notes of --csv and --json")
    return "\n".join([*lines, "lengths in mm; conicity at 3 mm, EN 15302"])


def _remark(row: FleetRow) -> str:
    """Name the wheel of a row, its measures beyond limits and its fault."""
    cells = _fleet_cells(row)
    parts = {
        cells["wheel"]: row.profile is not None,
        f"beyond limits: {cells['exceeded']}": cells["exceeded"],
        f"not checked: {cells['not_judged']}": cells["not_judged"],
        "wear uncertain": row.values["warnings"],
        f"FAULT {cells['fault']}": cells["fault"],
    }
    return "; ".join(text for text, applies in parts.items() if applies)
