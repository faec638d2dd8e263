"""What `wearsim profile --json` prints of one profile, SI units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from wearsim.cli.profile_print import MEASURES
from wearsim.profile.measures import Measures
from wearsim.profile.shape import arc_length
from wearsim.studies.profile_examination import BACK_TO_BACK, GAUGE, Comparison, Examination
from wearsim.studies.profile_running import Running
from wearsim.studies.profile_subject import Subject
from wearsim.studies.profile_turning import TurnedWheel


def as_json(found: Examination) -> dict[str, Any]:
    """JSON value, SI units."""
    at = found.circumstances
    value: dict[str, Any] = {"profile": _subject_json(found.subject)}
    if found.left is not None:
        value["left"] = _subject_json(found.left)
    value["distances"] = asdict(at.distances)
    value["measures"] = _measures_json(found.measures)
    if found.left_measures is not None:
        value["left_measures"] = _measures_json(found.left_measures)
    if found.axle_measures is not None:
        value["axle_measures"] = _measures_json(found.axle_measures)
    if found.limits is not None:
        value["limits"] = {"name": found.limits.name, "title": found.limits.title}
        value["judgements"] = [
            {"wheel": wheel, **asdict(each)}
            for wheel, judgements in (
                ("right", found.judgements),
                ("left", found.left_judgements),
                ("axle", found.axle_judgements),
            )
            for each in judgements
        ]
        value["exceeded"] = list(found.exceeded)
        value["not_judged"] = list(found.not_judged)
    value["track"] = {
        "gauge": at.gauge or GAUGE,
        "back_to_back": at.back_to_back or BACK_TO_BACK,
        "back_to_back_stated": at.back_to_back is not None,
        "half_span": at.half_span,
    }
    value |= _running_json(found.running, found.trouble)
    if found.comparison is not None:
        value["against"] = _comparison_json(found.comparison)
    return value


def turned_json(template: Subject, wheels: Sequence[TurnedWheel]) -> dict[str, Any]:
    """JSON value of wheels on the lathe, SI units."""
    return {
        "template": _subject_json(template),
        "wheels": [
            {
                "wheel": each.side or "right",
                "diameter_loss": each.diameter_loss,
                "wheel_diameter": each.diameter,
                "place": each.turning.place,
                "slack": each.slack,
                "compared": [each.turning.start, each.turning.end],
            }
            for each in wheels
        ],
    }


def _subject_json(subject: Subject) -> dict[str, Any]:
    profile = subject.profile
    return {
        "given": subject.given,
        "name": profile.name,
        "kind": subject.kind,
        "format": subject.format,
        "title": subject.title,
        "notes": list(subject.notes),
        "header": dict(subject.header),
        "source": subject.source,
        "certainty": subject.certainty,
        "points": len(profile.y),
        "length": float(arc_length(profile.y, profile.z)[-1]),
        "y_range": [float(profile.y.min()), float(profile.y.max())],
        "z_range": [float(profile.z.min()), float(profile.z.max())],
    }


def _measures_json(measures: Measures | None) -> dict[str, Any] | None:
    if measures is None:
        return None
    return {
        **{
            name: measures.values.get(name)
            for name in MEASURES
            if name in measures.values or name in measures.missing
        },
        "missing": dict(measures.missing),
    }


def _running_json(run: Running | None, trouble: str) -> dict[str, Any]:
    if run is None:
        return {"running": None, "trouble": trouble}
    return {
        "running": {
            "wheel": run.wheel,
            "left": run.left or run.wheel,
            "rail": run.rail,
            "track": run.track,
            "rolling_radius_difference": [{"shift": shift, "value": value} for shift, value in run.at],
            "equivalent_conicity": [
                {"amplitude": amplitude, "value": value, "reason": why}
                for amplitude, value, why in run.conicity
            ],
        }
    }


def _comparison_json(comparison: Comparison) -> dict[str, Any]:
    alignment, wear = comparison.alignment, comparison.wear
    return {
        "profile": _subject_json(comparison.reference),
        "alignment": {
            "rule": alignment.rule, "dy": alignment.dy, "dz": alignment.dz, "angle": alignment.angle,
            "rms": alignment.rms, "note": alignment.note,
        },
        "worn_area": wear.worn_area,
        "zone_areas": dict(wear.zone_areas),
        "max_wear_depth": wear.max_depth,
        "max_wear_depth_y": wear.max_depth_y,
        "compared_length": wear.compared_length,
        "note": wear.note,
        "doubts": list(comparison.doubts),
        "measures": _measures_json(comparison.measures),
        **_running_json(comparison.running, ""),
    }  # fmt: skip
