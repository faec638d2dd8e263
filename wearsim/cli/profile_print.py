"""What `wearsim profile` prints of one profile for people."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence

from wearsim.profile.limits import NO_DIAMETER, Judgement
from wearsim.profile.measures import Measures
from wearsim.profile.shape import arc_length
from wearsim.quantities import QUANTITIES
from wearsim.studies.profile_examination import Comparison, Examination
from wearsim.studies.profile_subject import Subject
from wearsim.studies.profile_turning import TurnedWheel

SYMBOLS = {"flange_height": "Sh", "flange_thickness": "Sd", "flange_gradient": "qR", "back_to_back": "AR",
           "front_to_front": "SR"}  # fmt: skip
MEASURES = (
    "flange_height", "flange_thickness", "flange_gradient", "hollowing", "rim_width", "wheel_diameter",
    "wheel_diameter_difference", "back_to_back", "front_to_front",
)  # fmt: skip
"""Order in tables."""

_SILENT = (
    "wheel_diameter",
    "wheel_diameter_difference",
    "back_to_back",
    "front_to_front",
)  # told only if known
_HEADER_KEYS = (
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


def as_text(found: Examination) -> str:
    """Everything in tables for people."""
    blocks = [_story(found.subject)]
    if found.left is not None:
        blocks.append(_story(found.left, "left wheel: "))
    if found.comparison is not None:
        blocks.append(_compared(found.comparison))
    if found.measures is not None:
        blocks.append(_measures(found))
        blocks.append(_limits(found))
    blocks.append(_running(found))
    return "\n\n".join("\n".join(block) for block in blocks)


def _story(subject: Subject, before: str = "") -> list[str]:
    """Tell what was read, and where it comes from."""
    profile = subject.profile
    length = 1e3 * float(arc_length(profile.y, profile.z)[-1])
    lines = [
        f"{before}{profile.name}, {subject.kind}, {subject.title}",
        f"  points     {len(profile.y)} over {length:.2f} mm along the profile, y "
        f"{1e3 * profile.y.min():.2f} to {1e3 * profile.y.max():.2f} mm, z {1e3 * profile.z.min():.2f} to "
        f"{1e3 * profile.z.max():.2f} mm",
    ]
    if subject.measured:
        lines.append(f"  file       {subject.given}")
    header = [f"{key} {value}" for key in _HEADER_KEYS if (value := subject.key(key))]
    if header:
        lines += wrapped("header", "; ".join(_one_line(text) for text in header))
    lines += _notes(subject)
    if subject.certainty:
        lines += wrapped("source", subject.source) + wrapped("certainty", subject.certainty)
    return lines


def _notes(subject: Subject) -> list[str]:
    """Tell what was found out on reading, a line each."""
    notes = subject.notes or ("nothing to be detected or changed",)
    return [line for k, note in enumerate(notes) for line in wrapped("" if k else "read", _one_line(note))]


def wrapped(word: str, text: str) -> list[str]:
    """Lines of a long text behind a word."""
    lines = textwrap.wrap(text, 97, break_long_words=False) or [""]
    return [f"  {word if k == 0 else '':<10} {line}" for k, line in enumerate(lines)]


def _one_line(text: str) -> str:
    """Text of a file without line breaks and control characters."""
    return " ".join("".join(mark if mark.isprintable() else " " for mark in text).split())[:300]


def _compared(comparison: Comparison) -> list[str]:
    """Alignment and wear."""
    alignment, wear = comparison.alignment, comparison.wear
    dy, dz, angle = (round(1e3 * each, 3) + 0.0 for each in (alignment.dy, alignment.dz, alignment.angle))
    moved = f"y {dy:+.3f} mm, z {dz:+.3f} mm, turned {angle:+.3f} mrad"
    rest = "" if alignment.rms is None else f"; {1e6 * alignment.rms:.1f} µm rms left"
    zones = ", ".join(f"{name} {1e6 * area:.2f}" for name, area in wear.zone_areas.items())
    lines = [
        f"against {comparison.reference.profile.name} ({comparison.reference.title})",
        *_notes(comparison.reference),
        *wrapped("aligned", f"{alignment.rule}: {alignment.note}"),
        f"  {'moved by':<10} {moved}{rest}",
        f"  {'':<10} measures and running behaviour below are of the profile as measured, not moved",
        f"  worn area  {1e6 * wear.worn_area:.2f} mm² ({zones})",
        f"  deepest    {1e3 * wear.max_depth:.3f} mm at y = {1e3 * wear.max_depth_y:.2f} mm",
        *wrapped("", wear.note),
        *(line for doubt in comparison.doubts for line in wrapped("NOTE", doubt)),
    ]
    return lines


def turned_text(template: Subject, wheels: Sequence[TurnedWheel]) -> str:
    """Tell what the lathe takes.

    Parameters
    ----------
    template : Subject
        What the wheels get.
    wheels : sequence of TurnedWheel
        One, or right and left.
    """
    lines = [f"turned to {template.profile.name} ({template.title}), least loss of diameter"]
    for each in wheels:
        word = f"{each.side} wheel: " if each.side else ""
        loss = round(1e3 * each.diameter_loss, 3) + 0.0
        after = "" if each.diameter is None else f", to {1e3 * each.diameter:.3f} mm"
        lines.append(f"  {word}the lathe takes {loss:.3f} mm of the diameter{after}")
    tight = min(wheels, key=lambda each: each.slack)
    whose = f" of the {tight.side} wheel" if tight.side else ""
    at, start, end = (1e3 * value for value in (tight.turning.place, tight.turning.start, tight.turning.end))
    lines += wrapped("", f"decided at y = {at:.2f} mm{whose}, where nothing is taken; compared from y = "
                         f"{start:.2f} to {end:.2f} mm, flange backs on each other")  # fmt: skip
    if len(wheels) == 2 and any(each.diameter is None for each in wheels):
        lines += wrapped("", "both diameters are not known (--diameter-mm, --left-diameter-mm): taken for "
                             "equal at the tape circles")  # fmt: skip
    return "\n".join(lines)


def _measures(found: Examination) -> list[str]:
    """Gauge values, of both wheels or against another."""
    assert found.measures is not None
    columns = [("right" if found.left_measures else found.subject.profile.name, found.measures)]
    if found.left_measures is not None:
        columns.append(("left", found.left_measures))
    if found.axle_measures is not None:
        columns.append(("axle", found.axle_measures))
    difference = None
    if found.comparison is not None and found.comparison.measures is not None:
        columns.append((found.comparison.reference.profile.name, found.comparison.measures))
        difference = (found.measures, found.comparison.measures)
    titles = [_cut(title) for title, _ in columns] + (["difference"] if difference else [])
    lines = [f"{'measures [mm]':<38}" + "".join(f"{title:>18}" for title in titles)]
    for name in MEASURES:
        if name in _SILENT and not any(name in each.values for _, each in columns):
            continue
        cells = [_value(each, name) for _, each in columns]
        if difference:
            known = all(name in each.values for each in difference)
            cells.append(_difference(*(each.values[name] for each in difference)) if known else "")
        lines.append(f"  {_named(name):<36}" + "".join(f"{cell:>18}" for cell in cells))
    lines += [f"  {why}" for why in _reasons(columns)]
    at = found.circumstances.distances
    lines.append(
        f"  tape circle {1e3 * at.flange_back:g} mm from the flange back; Sd {1e3 * at.level:g} mm above it; "
        f"qR from there to {1e3 * at.below_tip:g} mm below the flange tip"
    )
    return lines


def _limits(found: Examination) -> list[str]:
    """Each limit with what is left, and where it comes from."""
    if found.limits is None or not found.judgements:
        return ["no limits for these measures"]
    several = bool(found.left_judgements)
    lines = [f"{f'limits [mm] ({found.limits.name})':<42}{'value':>9}{'min':>8}{'max':>8}  margin"]
    for whose, judgements in (
        ("right ", found.judgements),
        ("left ", found.left_judgements),
        ("", found.axle_judgements),
    ):
        rows: dict[tuple[str, str], list[Judgement]] = {}
        for each in judgements:
            rows.setdefault((each.measure, each.source), []).append(each)
        for (measure, _), group in rows.items():
            named = (whose if several else "") + _named(measure)
            lines.append(f"  {named:<40}{_judgement(measure, group)}")
    lines.append(f"  {found.limits.title}")
    for source, certainty in dict.fromkeys((each.source, each.certainty) for each in found.judgements):
        lines += wrapped("source", source) + wrapped("certainty", certainty)
    return lines


def _judgement(measure: str, group: Sequence[Judgement]) -> str:
    """Value, limits and margin of one measure, or why it cannot be judged."""
    factor = QUANTITIES[measure].shown_factor
    value = group[0].value
    bounds = {each.bound: each.limit for each in group}
    cells = [
        "-" if value is None else f"{value * factor:.3f}",
        *("-" if (at := bounds.get(bound)) is None else f"{at * factor:g}" for bound in ("min", "max")),
    ]
    margins = [(each.margin, each) for each in group if each.margin is not None]
    told = []
    if margins:
        margin, least = min(margins, key=lambda pair: pair[0])
        size = abs(margin) * factor
        text = f"{size:.3f}" if size >= 0.0005 else "less than 0.001"
        told.append(f"EXCEEDED by {text}" if least.exceeded else f"{text} left to the {least.bound}")
        conditions = dict.fromkeys(each.condition for _, each in margins if each.condition)
        told += [f"for {condition}" for condition in conditions]
    for why in dict.fromkeys(each.reason for each in group if each.reason):
        of = [each.bound for each in group if each.reason == why]
        # of one bound it matters which, of all bounds it does not
        which = f"{of[0]} " if len(group) > len(of) else ""
        hint = f"{why} (--diameter-mm)" if why == NO_DIAMETER else why
        told.append(f"{which}not judged: {hint}")
    return f"{cells[0]:>9}{cells[1]:>8}{cells[2]:>8}  {'; '.join(told)}"


def _named(name: str) -> str:
    symbol = f" {SYMBOLS[name]}" if name in SYMBOLS else ""
    return QUANTITIES[name].meaning + symbol


def _difference(value: float, before: float) -> str:
    """Change in mm; what rounds to nothing has no sign."""
    return f"{round(1e3 * (value - before), 3) + 0.0:+.3f}"


def _cut(title: str, most: int = 17) -> str:
    return title if len(title) <= most else f"{title[: most - 1]}…"


def _value(measures: Measures, name: str) -> str:
    if name in measures.values:
        return f"{round(1e3 * measures.values[name], 3) + 0.0:.3f}"
    return "-" if name in measures.missing else ""


def _reasons(columns: Sequence[tuple[str, Measures]]) -> Iterable[str]:
    """Why measures are missing, each reason once."""
    missing: dict[tuple[str, str], list[str]] = {}
    for name in MEASURES:
        if name in _SILENT:
            continue
        for title, measures in columns:
            if name in measures.missing:
                whose = f" of {title}" if len(columns) > 1 else ""
                missing.setdefault((whose, measures.missing[name]), []).append(QUANTITIES[name].meaning)
    for (whose, why), names in missing.items():
        yield f"no {', '.join(names)}{whose}: {why}"


def _running(found: Examination) -> list[str]:
    """Tell rolling radius difference and conicity."""
    run = found.running
    if run is None:
        return [f"no rolling radius difference and conicity: {found.trouble}"]
    wheels = f"{run.wheel} and {run.left} (left)" if run.left else run.wheel
    lines = [f"{wheels} on {run.track}"]
    rows = [(run, "")]
    if found.comparison is not None and found.comparison.running is not None:
        rows.append((found.comparison.running, f", {_cut(found.comparison.reference.profile.name)}"))
    shifts = list(dict.fromkeys(shift for each, _ in rows for shift, _ in each.at))
    lines.append(f"{'  shift, to the right [mm]':<48}" + "".join(f"{1e3 * u:>8.0f}" for u in shifts))
    for each, title in rows:
        at = dict(each.at)
        cells = ["" if u not in at else _cell(at[u], 1e3) for u in shifts]
        lines.append(f"  {f'rolling radius difference{title} [mm]':<46}" + "".join(f"{c:>8}" for c in cells))
    lines.append(f"{'  amplitude [mm]':<48}" + "".join(f"{1e3 * a:>8.0f}" for a, _, _ in run.conicity))
    for each, title in rows:
        values = [_cell(value, 1.0) for _, value, _ in each.conicity]
        lines.append(f"  {f'equivalent conicity, EN 15302{title}':<46}" + "".join(f"{c:>8}" for c in values))
    whys = dict.fromkeys(why for each, _ in rows for _, _, why in each.conicity if why)
    lines += [f"  -: {why}" for why in whys]
    if run.left:
        lines.append("  equal diameters at both tape circles, but for a difference that is stated")
    return lines


def _cell(value: float | None, factor: float) -> str:
    return "-" if value is None else f"{round(value * factor, 3) + 0.0:.3f}"
