"""What `wearsim profile` prints: tables for people, CSV, and JSON in SI units."""

from __future__ import annotations

import csv
import io
import textwrap
from collections.abc import Iterable, Sequence
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


def _mm(value: float, form: str = ".3f", factor: float = 1e3) -> str:
    """Length in mm; what rounds to nothing has no sign."""
    return f"{round(factor * value, 3) + 0.0:{form}}"


def _comparison(comparison: Comparison) -> list[str]:
    """Alignment and wear."""
    alignment, wear = comparison.alignment, comparison.wear
    dy, dz, angle = (_mm(each, "+.3f") for each in (alignment.dy, alignment.dz, alignment.angle))
    rest = "" if alignment.rms is None else f"; {1e6 * alignment.rms:.1f} µm rms left"
    zones = ", ".join(f"{name} {1e6 * area:.2f}" for name, area in wear.zone_areas.items())
    return [
        f"against {comparison.reference.profile.name} ({comparison.reference.title})",
        *_notes(comparison.reference),
        *_wrapped("aligned", f"{alignment.rule}: {alignment.note}"),
        f"  {'moved by':<10} y {dy} mm, z {dz} mm, rotated by {angle} mrad{rest}",
        f"  {'':<10} measures and running behaviour below are of the profile as measured, not moved",
        f"  worn area  {1e6 * wear.worn_area:.2f} mm² ({zones})",
        f"  deepest    {1e3 * wear.max_depth:.3f} mm at y = {1e3 * wear.max_depth_y:.2f} mm",
        *_wrapped("", wear.note),
        *(line for warning in comparison.warnings for line in _wrapped("WARNING", warning)),
    ]


def reprofiled_text(template: ProfileInput, wheels: Sequence[ReprofiledWheel]) -> str:
    """Return what the lathe takes of one wheel, or of right and left."""
    lines = [f"reprofiled to {template.profile.name} ({template.title}), least loss of diameter"]
    for each in wheels:
        word = f"{each.side} wheel: " if each.side else ""
        after = "" if each.diameter is None else f", to {1e3 * each.diameter:.3f} mm"
        lines.append(f"  {word}the lathe takes {_mm(each.diameter_loss)} mm of the diameter{after}")
    tight = min(wheels, key=lambda each: each.reprofiling.slack)
    whose, cut = f" of the {tight.side} wheel" if tight.side else "", tight.reprofiling
    lines += _wrapped("", f"decided at y = {1e3 * cut.place:.2f} mm{whose}, where nothing is taken; compared "
                          f"from y = {1e3 * cut.start:.2f} to {1e3 * cut.end:.2f} mm, flange backs on each "
                          "other")  # fmt: skip
    if len(wheels) == 2 and any(each.diameter is None for each in wheels):
        lines += _wrapped("", "both diameters are not known (--diameter-mm, --left-diameter-mm): taken for "
                              "equal at the running circles")  # fmt: skip
    return "\n".join(lines)


def _row(title: str, cells: Iterable[str], width: int, first: int) -> str:
    return f"{title:<{first}}" + "".join(f"{cell:>{width}}" for cell in cells)


def _measures(result: Inspection) -> list[str]:
    """Gauge values, of both wheels or against another."""
    several = len(result.measures) > 1
    columns = [
        (_cut(body if several else result.given.profile.name), each) for body, each in result.measures.items()
    ]
    comparison, more = result.comparison, list[str]()
    if comparison is not None and comparison.measures is not None:
        columns.append((_cut(comparison.reference.profile.name), comparison.measures))
        more = ["difference"]
    lines = [_row("measures [mm]", [*(title for title, _ in columns), *more], 18, 38)]
    for name in MEASURES:
        values = [each.values.get(name) for _, each in columns]
        if name in IF_STATED and not any(value is not None for value in values):
            continue
        cells = [_mm(value) if value is not None else "-" if name in each.missing else ""
                 for value, (_, each) in zip(values, columns, strict=True)]  # fmt: skip
        first, last = values[0], values[-1]
        if more and first is not None and last is not None:
            cells.append(_mm(first - last, "+.3f"))
        lines.append(_row(f"  {_named(name)}", cells, 18, 38))
    lines += [f"  {why}" for why in _reasons(columns)]
    at = result.conditions.distances
    lines.append(
        f"  running circle {1e3 * at.flange_back:g} mm from the flange back; Sd {1e3 * at.level:g} mm above "
        f"it; qR from there to {1e3 * at.below_tip:g} mm below the flange tip"
    )
    return lines


def _reasons(columns: Sequence[tuple[str, Measures]]) -> Iterable[str]:
    """Why measures are missing, each reason once."""
    missing: dict[tuple[str, str], list[str]] = {}
    for name in MEASURES:
        for title, measures in columns:
            if name in measures.missing and name not in IF_STATED:
                whose = f" of {title}" if len(columns) > 1 else ""
                missing.setdefault((whose, measures.missing[name]), []).append(QUANTITIES[name].meaning)
    return (f"no {', '.join(names)}{whose}: {why}" for (whose, why), names in missing.items())


def _named(name: str) -> str:
    symbol = MEASURES.get(name)
    return f"{QUANTITIES[name].meaning} {symbol}" if symbol in _SYMBOLS else QUANTITIES[name].meaning


def _cut(title: str, most: int = 17) -> str:
    return title if len(title) <= most else f"{title[: most - 1]}…"


def _limits(result: Inspection) -> list[str]:
    """Each limit with what is left, and where it comes from."""
    if result.limits is None or not result.judgements:
        return ["no limits for these measures"]
    lines = [f"{f'limits [mm] ({result.limits.name})':<42}{'value':>9}{'min':>8}{'max':>8}  margin"]
    rows: dict[tuple[str, str, str], list[Judgement]] = {}
    for body, each in result.judgements:
        whose = f"{body} " if len(result.measures) > 1 and body != "axle" else ""
        rows.setdefault((whose, each.measure, each.source), []).append(each)
    for (whose, measure, _), group in rows.items():
        lines.append(f"  {whose + _named(measure):<40}{_judgement(measure, group)}")
    lines.append(f"  {result.limits.title}")
    for source, certainty in dict.fromkeys(
        (each.source, each.certainty) for body, each in result.judgements if body == "right"
    ):
        lines += _wrapped("source", source) + _wrapped("certainty", certainty)
    return lines


def _judgement(measure: str, group: Sequence[Judgement]) -> str:
    """Value, limits and margin of one measure, or why it cannot be checked."""
    factor = QUANTITIES[measure].shown_factor
    value = group[0].value
    bounds = {each.bound: each.limit for each in group}
    least, most = ("-" if (at := bounds.get(key)) is None else f"{at * factor:g}" for key in ("min", "max"))
    margins = [(each.margin, each) for each in group if each.margin is not None]
    texts = []
    if margins:
        margin, nearest = min(margins, key=lambda pair: pair[0])
        size = abs(margin) * factor
        text = f"{size:.3f}" if size >= 0.0005 else "less than 0.001"
        texts.append(f"EXCEEDED by {text}" if nearest.exceeded else f"{text} left to the {nearest.bound}")
        texts += dict.fromkeys(f"for {each.condition}" for _, each in margins if each.condition)
    for why in dict.fromkeys(each.reason for each in group if each.reason):
        of = [each.bound for each in group if each.reason == why]
        # of one bound it matters which, of all bounds it does not
        which = f"{of[0]} " if len(group) > len(of) else ""
        texts.append(f"{which}not checked: {why}{' (--diameter-mm)' if why == NO_DIAMETER else ''}")
    shown = "-" if value is None else f"{value * factor:.3f}"
    return f"{shown:>9}{least:>8}{most:>8}  {'; '.join(texts)}"


def _running(result: Inspection) -> list[str]:
    """Return rolling radius difference and conicity."""
    run = result.running
    if run is None:
        return [f"no rolling radius difference and conicity: {result.trouble}"]
    rows = [(run, "")]
    if result.comparison is not None and result.comparison.running is not None:
        rows.append((result.comparison.running, f", {_cut(result.comparison.reference.profile.name)}"))
    shifts = list(dict.fromkeys(shift for each, _ in rows for shift, _ in each.at))
    lines = [
        f"{run.wheel} and {run.left} (left) on {run.track}" if run.left else f"{run.wheel} on {run.track}"
    ]
    lines.append(_row("  shift, to the right [mm]", (f"{1e3 * u:.0f}" for u in shifts), 8, 48))
    for each, title in rows:
        at = dict(each.at)
        cells = ["" if u not in at else _cell(at[u], 1e3) for u in shifts]
        lines.append(_row(f"  rolling radius difference{title} [mm]", cells, 8, 48))
    lines.append(_row("  amplitude [mm]", (f"{1e3 * a:.0f}" for a, _, _ in run.conicity), 8, 48))
    for each, title in rows:
        values = (_cell(value, 1.0) for _, value, _ in each.conicity)
        lines.append(_row(f"  equivalent conicity, EN 15302{title}", values, 8, 48))
    lines += dict.fromkeys(f"  -: {why}" for each, _ in rows for _, _, why in each.conicity if why)
    if run.left:
        lines.append("  equal diameters at both running circles, but for a difference that is stated")
    return lines


def _cell(value: float | None, factor: float) -> str:
    return "-" if value is None else _mm(value, factor=factor)


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
    value["track"] = {
        "gauge": at.gauge,
        "back_to_back": at.back_to_back or BACK_TO_BACK,
        "back_to_back_stated": at.back_to_back is not None,
        "half_span": at.half_span,
    }
    value |= _running_json(result.running, result.trouble)
    if result.comparison is not None:
        value["against"] = _comparison_json(result.comparison)
    return value


def reprofiled_json(template: ProfileInput, wheels: Sequence[ReprofiledWheel]) -> dict[str, Any]:
    """Return the JSON value of wheels on the lathe, SI units."""
    rows = [
        {
            "wheel": each.side or "right",
            "diameter_loss": each.diameter_loss,
            "wheel_diameter": each.diameter,
            "place": each.reprofiling.place,
            "slack": each.reprofiling.slack,
            "compared": [each.reprofiling.start, each.reprofiling.end],
        }
        for each in wheels
    ]
    return {"template": _profile_json(template), "wheels": rows}


def _profile_json(given: ProfileInput) -> dict[str, Any]:
    y, z = given.profile.y, given.profile.z
    fields = ("given", "kind", "format", "title", "source", "certainty")
    return {
        "name": given.profile.name,
        **{key: getattr(given, key) for key in fields},
        "notes": list(given.notes),
        "header": dict(given.header),
        "points": len(y),
        "length": float(arc_length(y, z)[-1]),
        "y_range": [float(y.min()), float(y.max())],
        "z_range": [float(z.min()), float(z.max())],
    }


def _measures_json(measures: Measures | None) -> dict[str, Any] | None:
    if measures is None:
        return None
    known = {**dict.fromkeys(measures.missing), **measures.values}
    return {**{name: known[name] for name in MEASURES if name in known}, "missing": dict(measures.missing)}


def _running_json(run: Running | None, trouble: str) -> dict[str, Any]:
    if run is None:
        return {"running": None, "trouble": trouble}
    names = {"wheel": run.wheel, "left": run.left or run.wheel, "rail": run.rail, "track": run.track}
    return {
        "running": {
            **names,
            "rolling_radius_difference": [{"shift": shift, "value": value} for shift, value in run.at],
            "equivalent_conicity": [
                {"amplitude": a, "value": value, "reason": why} for a, value, why in run.conicity
            ],
        }
    }


def _comparison_json(comparison: Comparison) -> dict[str, Any]:
    alignment, wear = comparison.alignment, comparison.wear
    return {
        "profile": _profile_json(comparison.reference),
        "alignment": {key: getattr(alignment, key) for key in ("rule", "dy", "dz", "angle", "rms", "note")},
        "worn_area": wear.worn_area,
        "zone_areas": dict(wear.zone_areas),
        "max_wear_depth": wear.max_depth,
        "max_wear_depth_y": wear.max_depth_y,
        "compared_length": wear.compared_length,
        "note": wear.note,
        "warnings": list(comparison.warnings),
        "measures": _measures_json(comparison.measures),
        **_running_json(comparison.running, ""),
    }


def fleet_json(row: FleetRow) -> dict[str, object]:
    """Return the SI values of a row."""
    return {
        "file": row.file,
        "wheel": row.wheel,
        **row.identity,
        **{name: row.values.get(name) for name, _, _ in _FLEET.values()},
        "exceeded": list(row.exceeded),
        "not_judged": list(row.not_judged),
        "notes": list(row.notes),
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
    wide = {key: min(max(len(key), *(len(cell[key]) for cell in cells)), 32) for key in ("file", "wheel")}
    start = f"{'file':<{wide['file']}}  {'wheel':<{wide['wheel']}}"
    lines = [_row(start, used.values(), 10, 0) + "  beyond limits, faults"]
    for row, cell in zip(rows, cells, strict=True):
        remarks = [cell["exceeded"]] if cell["exceeded"] else []
        remarks += [f"not checked: {cell['not_judged']}"] if cell["not_judged"] else []
        remarks += ["wear uncertain"] if row.warnings else []
        remarks += [f"FAULT {cell['fault']}"] if cell["fault"] else []
        wheel = _cut(cell["wheel"], wide["wheel"]) if row.measured else ""
        start = f"{_cut(row.file, wide['file']):<{wide['file']}}  {wheel:<{wide['wheel']}}"
        numbers = [cell[column] or "-" for column in used] if row.measured else []
        lines.append(f"{_row(start, numbers, 10, 0)}  {'; '.join(remarks)}".rstrip())
    if any(row.not_judged and "wheel_diameter" not in row.values for row in rows):
        lines.append(
            "not checked: some limits depend on the wheel diameter, which is not given (--diameter-mm)"
        )
    lines += [f"wear uncertain: {warning}" for warning in _shared_warnings(rows)]
    lines.append("lengths in mm" + ("; conicity at 3 mm, EN 15302" if "conicity_3mm" in used else ""))
    return "\n".join(lines)


def _shared_warnings(rows: Sequence[FleetRow]) -> list[str]:
    """Warnings that all rows with warnings share, and where the others are."""
    each = [row.warnings for row in rows if row.warnings]
    if not each:
        return []
    shared = [warning for warning in each[0] if all(warning in other for other in each)]
    others = any(len(set(warnings)) > len(shared) for warnings in each)
    return shared + (["the reasons are in the notes of --csv and --json"] if others else [])
