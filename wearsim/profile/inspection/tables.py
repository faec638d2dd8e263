"""What `wearsim profile` prints: tables for people, CSV, and JSON in SI units."""

from __future__ import annotations

import csv
import io
import textwrap
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from wearsim.profile.conicity import Running
from wearsim.profile.files.points import one_line
from wearsim.profile.inspection import IF_STATED, Comparison, Inspection, ReprofiledWheel
from wearsim.profile.inspection.fleet import FleetRow
from wearsim.profile.inspection.inputs import ProfileInput
from wearsim.profile.limits import NO_DIAMETER, Judgement
from wearsim.profile.measures import Measures
from wearsim.profile.placement import BACK_TO_BACK
from wearsim.profile.shape import arc_length
from wearsim.quantities import QUANTITIES

MEASURES = {
    "flange_height": "Sh", "flange_thickness": "Sd", "flange_gradient": "qR", "hollowing": "hollow",
    "rim_width": "rim", "wheel_diameter": "D", "wheel_diameter_difference": "ΔD", "back_to_back": "AR",
    "front_to_front": "SR",
}  # fmt: skip
"""Measures in the order of tables, with their short names."""

_SYMBOLS = ("Sh", "Sd", "qR", "AR", "SR")

_HEADER_KEYS = ("Stock", "CarNo", "AxleNo", "Side", "WheelID", "Sh", "Sd", "qR", "Line", "Date", "Time",
                "UOF1", "comment")  # fmt: skip
_FLEET = {
    # column of the CSV: quantity, digits, title on screen
    "Sh_mm": ("flange_height", 3, "Sh"),
    "Sd_mm": ("flange_thickness", 3, "Sd"),
    "qR_mm": ("flange_gradient", 3, "qR"),
    "hollowing_mm": ("hollowing", 3, "hollow"),
    "rim_width_mm": ("rim_width", 3, ""),
    "diameter_mm": ("wheel_diameter", 3, "D"),
    "conicity_3mm": ("equivalent_conicity", 4, "conicity"),
    "worn_area_mm2": ("worn_area", 3, "area mm²"),
    "max_wear_depth_mm": ("max_wear_depth", 4, "depth"),
    "rms_um": ("alignment_rms", 1, "rms µm"),
}
_IDENTITY = ("wheel", "kind", "format", "stock", "car", "axle", "side", "align")


def as_text(result: Inspection) -> str:
    """Return everything in tables for people."""
    blocks = [_origin(result.given)]
    if result.left is not None:
        blocks.append(_origin(result.left, "left wheel: "))
    if result.comparison is not None:
        blocks.append(_comparison(result.comparison))
    if result.measures:
        blocks += [_measures(result), _limits(result)]
    blocks.append(_running(result))
    return "\n\n".join("\n".join(block) for block in blocks)


def _origin(given: ProfileInput, before: str = "") -> list[str]:
    """Return what was read, and where it comes from."""
    y, z = given.profile.y, given.profile.z
    lines = [
        f"{before}{given.profile.name}, {given.kind}, {given.title}",
        f"  points     {len(y)} over {1e3 * arc_length(y, z)[-1]:.2f} mm along the profile, y "
        f"{1e3 * y.min():.2f} to {1e3 * y.max():.2f} mm, z {1e3 * z.min():.2f} to {1e3 * z.max():.2f} mm",
    ]
    if given.measured:
        lines.append(f"  file       {given.given}")
    header = [f"{key} {value}" for key in _HEADER_KEYS if (value := given.key(key))]
    if header:
        lines += _wrapped("header", "; ".join(one_line(each)[:300] for each in header))
    lines += _notes(given)
    if given.certainty:
        lines += _wrapped("source", given.source) + _wrapped("certainty", given.certainty)
    return lines


def _notes(given: ProfileInput) -> list[str]:
    notes = given.notes or ("nothing to be detected or changed",)
    words = [_wrapped("" if k else "read", one_line(note)[:300]) for k, note in enumerate(notes)]
    return [line for lines in words for line in lines]


def _wrapped(word: str, text: str) -> list[str]:
    """Lines of a long text behind a word."""
    first = f"  {word:<10} "
    lines = textwrap.wrap(
        text, 110, initial_indent=first, subsequent_indent=" " * len(first), break_long_words=False
    )
    return lines or [first]


def _table(rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines of a table, its first column to the left and the others to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join([row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])]).rstrip() for row in rows
    ]


def _number(value: float | None, form: str = ".3f", factor: float = 1e3) -> str:
    """Length in mm, - for none; what rounds to nothing has no sign."""
    return "-" if value is None else f"{round(factor * value, 3) + 0.0:{form}}"


def _comparison(comparison: Comparison) -> list[str]:
    """Alignment and wear."""
    alignment, wear = comparison.alignment, comparison.wear
    dy, dz, angle = (_number(each, "+.3f") for each in (alignment.dy, alignment.dz, alignment.angle))
    rest = "" if alignment.rms is None else f"; {1e6 * alignment.rms:.1f} µm rms left"
    zones = ", ".join(f"{name} {1e6 * area:.2f}" for name, area in wear.zone_areas.items())
    return [
        f"against {comparison.reference.profile.name} ({comparison.reference.title})",
        *_notes(comparison.reference),
        *_wrapped("aligned", f"{alignment.rule}: {alignment.note}"),
        f"  {'moved by':<10} y {dy} mm, z {dz} mm, rotated by {angle} mrad{rest}",
        f"  {'':<10} measures and running behaviour below are of the profile as measured, not moved",
        f"  worn area  {1e6 * wear.worn_area:.2f} mm² ({zones})",
        f"  deepest    {1e3 * wear.max_wear_depth:.3f} mm at y = {1e3 * wear.max_wear_depth_y:.2f} mm",
        *_wrapped("", wear.note),
        *(line for warning in comparison.warnings for line in _wrapped("WARNING", warning)),
    ]


def reprofiled_text(template: ProfileInput, wheels: Sequence[ReprofiledWheel]) -> str:
    """Return what the lathe takes of one wheel, or of right and left."""
    lines = [f"reprofiled to {template.profile.name} ({template.title}), least loss of diameter"]
    for each in wheels:
        word = f"{each.side} wheel: " if each.side else ""
        after = "" if each.diameter is None else f", to {1e3 * each.diameter:.3f} mm"
        lines.append(f"  {word}the lathe takes {_number(each.diameter_loss)} mm of the diameter{after}")
    tight = min(wheels, key=lambda each: each.reprofiling.slack)
    whose, cut = f" of the {tight.side} wheel" if tight.side else "", tight.reprofiling
    lines += _wrapped("", f"decided at y = {1e3 * cut.place:.2f} mm{whose}, where nothing is taken; compared "
                          f"from {1e3 * cut.start:.2f} to {1e3 * cut.end:.2f} mm, flange backs on each "
                          "other")  # fmt: skip
    if len(wheels) == 2 and any(each.diameter is None for each in wheels):
        lines += _wrapped("", "both diameters are not known (--diameter-mm, --left-diameter-mm): taken for "
                              "equal at the running circles")  # fmt: skip
    return "\n".join(lines)


def _measures(result: Inspection) -> list[str]:
    """Gauge values, of both wheels or against another."""
    several, comparison = len(result.measures) > 1, result.comparison
    columns = {body if several else result.given.profile.name: each for body, each in result.measures.items()}
    before = None if comparison is None else comparison.measures
    rows = [["measures [mm]", *columns]]
    if comparison is not None and before is not None:
        rows[0] += [comparison.reference.profile.name, "difference"]
    for name in MEASURES:
        values = [each.values.get(name) for each in columns.values()]
        old = None if before is None else before.values.get(name)
        if old is None and all(value is None for value in values):
            continue
        row = [f"  {_named(name)}", *map(_number, values)]
        if before is not None:
            now = values[0]
            change = None if now is None or old is None else now - old
            row += [_number(old), _number(change, "+.3f")]
        rows.append(row)
    whys = [
        f"  no {QUANTITIES[name].meaning}{f' of {body}' if several else ''}: {why}"
        for body, each in columns.items()
        for name, why in each.missing.items()
        if name not in IF_STATED
    ]
    at = result.conditions.distances
    return [
        *_table(rows),
        *whys,
        f"  running circle {1e3 * at.flange_back:g} mm from the flange back; Sd {1e3 * at.level:g} mm above "
        f"it; qR from there to {1e3 * at.below_tip:g} mm below the flange tip",
    ]


def _named(name: str) -> str:
    symbol = MEASURES.get(name)
    return f"{QUANTITIES[name].meaning} {symbol}" if symbol in _SYMBOLS else QUANTITIES[name].meaning


def _limits(result: Inspection) -> list[str]:
    """Each limit with what is left, and where it comes from."""
    if result.limits is None or not result.judgements:
        return ["no limits for these measures"]
    rows = [[f"limits [mm] ({result.limits.name})", "value", "limit"]]
    for body, each in result.judgements:
        factor = QUANTITIES[each.measure].shown_factor
        whose = f"{body} " if len(result.measures) > 1 and body != "axle" else ""
        limit = "-" if each.limit is None else f"{each.limit * factor:g}"
        rows.append(
            [f"  {whose}{_named(each.measure)}", _number(each.value, factor=factor), f"{each.bound} {limit}"]
        )
    remarks = ["margin", *(_margin(each) for _, each in result.judgements)]
    lines = [f"{line}  {remark}" for line, remark in zip(_table(rows), remarks, strict=True)]
    lines.append(f"  {result.limits.title}")
    for source, certainty in dict.fromkeys((each.source, each.certainty) for _, each in result.judgements):
        lines += _wrapped("source", source) + _wrapped("certainty", certainty)
    return lines


def _margin(judgement: Judgement) -> str:
    """Return what is left to a limit, or why it cannot be checked."""
    if judgement.margin is None:
        flag = " (--diameter-mm)" if judgement.reason == NO_DIAMETER else ""
        return f"not checked: {judgement.reason}{flag}"
    size = abs(judgement.margin) * QUANTITIES[judgement.measure].shown_factor
    text = f"{size:.3f}" if size >= 0.0005 else "less than 0.001"
    condition = f", for {judgement.condition}" if judgement.condition else ""
    return (f"EXCEEDED by {text}" if judgement.exceeded else f"{text} left") + condition


def _running(result: Inspection) -> list[str]:
    """Return rolling radius difference and conicity."""
    run = result.running
    if run is None:
        return [f"no rolling radius difference and conicity: {result.trouble}"]
    runs = {"": run}
    if result.comparison is not None and result.comparison.running is not None:
        runs[f", {result.comparison.reference.profile.name}"] = result.comparison.running
    shifts = list(dict.fromkeys(shift for each in runs.values() for shift, _ in each.at))
    differences = [["  shift, to the right [mm]", *(f"{1e3 * u:.0f}" for u in shifts)]]
    conicities = [["  amplitude [mm]", *(f"{1e3 * a:.0f}" for a, _, _ in run.conicity)]]
    for title, each in runs.items():
        at = dict(each.at)
        cells = [_number(at[u]) if u in at else "" for u in shifts]
        differences.append([f"  rolling radius difference{title} [mm]", *cells])
        values = [_number(value, factor=1.0) for _, value, _ in each.conicity]
        conicities.append([f"  equivalent conicity, EN 15302{title}", *values])
    whys = dict.fromkeys(f"  -: {why}" for each in runs.values() for _, _, why in each.conicity if why)
    equal = "  equal diameters at both running circles, but for a difference that is stated"
    wheels = f"{run.wheel} and {run.left} (left)" if run.left else run.wheel
    return [
        f"{wheels} on {run.track}", *_table(differences), *_table(conicities), *whys,
        *([equal] if run.left else []),
    ]  # fmt: skip


def points_csv(result: Inspection) -> str:
    """Return the points, or the wear depth along the profile, as CSV."""
    profile = result.given.profile
    columns = {"arc_length_mm": arc_length(profile.y, profile.z), "y_mm": profile.y, "z_mm": profile.z}
    if result.comparison is not None:
        wear = result.comparison.wear
        columns = {"arc_length_mm": wear.s, "y_mm": wear.y, "z_mm": wear.z, "depth_mm": wear.depth}
    rows = [",".join(f"{1e3 * value:.6f}" for value in row) for row in zip(*columns.values(), strict=True)]
    return "\n".join([",".join(columns), *rows]) + "\n"


def as_json(result: Inspection) -> dict[str, Any]:
    """Return the JSON value of one profile, SI units."""
    at = result.conditions
    value: dict[str, Any] = {"profile": _profile_json(result.given)}
    if result.left is not None:
        value["left"] = _profile_json(result.left)
    value |= {"distances": asdict(at.distances), "measures": None}
    for body, measures in result.measures.items():
        value["measures" if body == "right" else f"{body}_measures"] = _measures_json(measures)
    if result.limits is not None:
        value["limits"] = {"name": result.limits.name, "title": result.limits.title}
        value["judgements"] = [{"wheel": body, **asdict(each)} for body, each in result.judgements]
        value |= {"exceeded": list(result.exceeded), "not_judged": list(result.not_judged)}
    value["track"] = _picked(at, "gauge", "half_span") | {
        "back_to_back": at.back_to_back or BACK_TO_BACK, "back_to_back_stated": at.back_to_back is not None
    }  # fmt: skip
    value |= _running_json(result.running, result.trouble)
    if result.comparison is not None:
        value["against"] = _comparison_json(result.comparison)
    return value


def reprofiled_json(template: ProfileInput, wheels: Sequence[ReprofiledWheel]) -> dict[str, Any]:
    """Return the JSON value of wheels on the lathe, SI units."""
    rows = [
        {"wheel": each.side or "right", "diameter_loss": each.diameter_loss, "wheel_diameter": each.diameter,
         **_picked(each.reprofiling, "place", "slack"),
         "compared": [each.reprofiling.start, each.reprofiling.end]}
        for each in wheels
    ]  # fmt: skip
    return {"template": _profile_json(template), "wheels": rows}


def _profile_json(given: ProfileInput) -> dict[str, Any]:
    y, z = given.profile.y, given.profile.z
    return {
        "name": given.profile.name,
        **_picked(given, "given", "kind", "format", "title", "source", "certainty", "notes", "header"),
        "points": len(y),
        "length": float(arc_length(y, z)[-1]),
        "y_range": [float(y.min()), float(y.max())],
        "z_range": [float(z.min()), float(z.max())],
    }


def _picked(record: object, *names: str) -> dict[str, Any]:
    """Take some fields of a record."""
    return {name: getattr(record, name) for name in names}


def _measures_json(measures: Measures | None) -> dict[str, Any] | None:
    if measures is None:
        return None
    known = {**dict.fromkeys(measures.missing), **measures.values}
    return {**{name: known[name] for name in MEASURES if name in known}, "missing": dict(measures.missing)}


def _running_json(run: Running | None, trouble: str) -> dict[str, Any]:
    if run is None:
        return {"running": None, "trouble": trouble}
    return {
        "running": {
            **_picked(run, "wheel", "rail", "track"),
            "left": run.left or run.wheel,
            "rolling_radius_difference": [
                dict(zip(("shift", "value"), each, strict=True)) for each in run.at
            ],
            "equivalent_conicity": [
                dict(zip(("amplitude", "value", "reason"), each, strict=True)) for each in run.conicity
            ],
        }
    }


def _comparison_json(comparison: Comparison) -> dict[str, Any]:
    return {
        "profile": _profile_json(comparison.reference),
        "alignment": _picked(comparison.alignment, "rule", "dy", "dz", "angle", "rms", "note"),
        **_picked(comparison.wear, "worn_area", "zone_areas", "max_wear_depth", "max_wear_depth_y",
                  "compared_length", "note"),
        "warnings": list(comparison.warnings),
        "measures": _measures_json(comparison.measures),
        **_running_json(comparison.running, ""),
    }  # fmt: skip


def fleet_json(row: FleetRow) -> dict[str, object]:
    """Return the SI values of a row."""
    return {
        "file": row.file,
        "wheel": row.wheel,
        **row.identity,
        **{name: row.values.get(name) for name, _, _ in _FLEET.values()},
        **_picked(row, "exceeded", "not_judged", "notes"),
        "fault": row.fault or None,
    }


def _fleet_cells(row: FleetRow) -> dict[str, str]:
    """Cells of a row by column of the CSV."""
    cells = {"file": row.file, **dict.fromkeys(_IDENTITY, ""), "wheel": row.wheel, **row.identity}
    for column, (name, digits, _) in _FLEET.items():
        value = row.values.get(name)
        cells[column] = "" if value is None else f"{value * QUANTITIES[name].shown_factor:.{digits}f}"
    short = {**MEASURES, "equivalent_conicity": "conicity"}
    cells["exceeded"] = " ".join(short.get(name, name) for name in row.exceeded)
    cells["not_judged"] = " ".join(short.get(name, name) for name in row.not_judged)
    return {**cells, "notes": "; ".join(row.notes), "fault": row.fault}


def fleet_csv(rows: Sequence[FleetRow]) -> str:
    """Return all rows as CSV."""
    text = io.StringIO()
    writer = csv.DictWriter(text, [*_fleet_cells(FleetRow(""))], lineterminator="\n")
    writer.writeheader()
    writer.writerows(map(_fleet_cells, rows))
    return text.getvalue()


def fleet_text(rows: Sequence[FleetRow]) -> str:
    """Return the table for people: columns that hold something, faults in their row."""
    cells = [_fleet_cells(row) for row in rows]
    used = {key: title for key, (_, _, title) in _FLEET.items() if title and any(cell[key] for cell in cells)}
    table = [["file", *used.values()]]
    table += [[cell["file"], *(cell[key] or "-" for key in used)] for cell in cells]
    remarks = ["wheel, beyond limits, faults", *map(_remarks, rows, cells)]
    lines = [f"{line}  {remark}".rstrip() for line, remark in zip(_table(table), remarks, strict=True)]
    if any(row.not_judged and "wheel_diameter" not in row.values for row in rows):
        lines.append("not checked: some limits need the wheel diameter, which is not given (--diameter-mm)")
    if any(row.warnings for row in rows):
        lines.append("wear uncertain: the reasons are in the notes of --csv and --json")
    lines.append("lengths in mm" + ("; conicity at 3 mm, EN 15302" if "conicity_3mm" in used else ""))
    return "\n".join(lines)


def _remarks(row: FleetRow, cell: dict[str, str]) -> str:
    """Return what stands behind the numbers of a row."""
    words = [
        cell["wheel"] if row.measured else "",
        f"beyond limits: {cell['exceeded']}" if row.exceeded else "",
        f"not checked: {cell['not_judged']}" if row.not_judged else "",
        "wear uncertain" if row.warnings else "",
        f"FAULT {row.fault}" if row.fault else "",
    ]
    return "; ".join(filter(None, words))
