"""What a scene would run: `wearsim check` as a dict of JSON values and as text."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.contact.solve import available_cores
from wearsim.damage import fatigue, wear
from wearsim.damage.fatigue import FATIGUE_LAWS, FatigueSettings
from wearsim.errors import Fault, WearsimError
from wearsim.quantities import QUANTITIES, duration
from wearsim.results.checks import percent
from wearsim.scene import CampaignSetup, FieldScene, RigScene, build
from wearsim.scene.models import CHAINS
from wearsim.studies.estimate import estimate
from wearsim.studies.states import states, states_text

_Rows = Iterator[tuple[str, str]]


def plan(
    scene: RigScene | FieldScene, warnings: Sequence[Fault], threads: int | None = None
) -> dict[str, Any]:
    """Return what a scene would run, with the warnings of `check_contact`.

    Returns
    -------
    dict
        JSON values, SI units; `settings` holds every value that would act, defaults included. Steps, their
        time and the end, with the limit met there, are estimates for `threads`, by default those of
        `run_scene`; null where one of the first steps fails, `trial_fault` states why.
    """
    setup = build(scene)
    points = setup.points
    count = len(points.label)
    foreseen = _foreseen(setup, threads or available_cores())
    return {
        "kind": setup.kind,
        "title": setup.title,
        "scene": str(scene.origin.path),
        "distance": setup.control.distance,
        "points": count,
        "monitoring_points": int((points.weight == 0).sum()),
        "environment": sorted({float(value) for value in points.environment[points.weight > 0]}),
        "wheels": 2,
        "profile_points": len(setup.wheelset.right.y),
        "inputs": [{"name": name, "sha256": digest} for name, digest in setup.input_hashes],
        "wear_coefficients": wear.coefficients_of(setup.wear).name,
        "wear_form": setup.wear.form,
        "comparison_laws": [
            {"law": one.law, "form": one.form, "coefficients": wear.coefficients_of(one).name}
            for one in setup.also_evaluate
        ],
        "fatigue": [_fatigue(one) for one in setup.fatigue],
        "settings": scene.model_dump(by_alias=True, mode="json"),
        "tolerance": setup.tolerance,
        "recorded": None
        if setup.reduction is None
        else {"samples": setup.reduction.samples, "binning_error": setup.reduction.error},
        "free_roll": points.conditions.free_roll,
        "states": states(setup),
        **foreseen,
        "warnings": [str(warning) for warning in warnings],
    }


def _fatigue(settings: FatigueSettings) -> dict[str, Any]:
    name = fatigue.coefficients_of(settings).name
    shown = {"law": settings.law, "coefficients": name, "crack_width": settings.crack_width}
    if FATIGUE_LAWS[settings.law].contains_removal:
        shown |= {"branch": settings.branch, "wear_number": settings.wear_number}
    if settings.crack_depth is not None:
        shown |= {"crack_depth": settings.crack_depth, "wear_limit": settings.wear_limit}
    return shown


def _foreseen(setup: CampaignSetup, threads: int) -> dict[str, Any]:
    """Estimated steps and time."""
    try:
        state, _ = WheelsetEvolution(setup, threads=threads).start()
        one = estimate(setup, state, threads)._asdict()
    except WearsimError as error:
        keys = ("steps", "seconds", "slowest", "end", "limit", "bytes_per_step")
        return {**dict.fromkeys(keys), "trial_fault": str(error)}
    slowest = {"name": one["slowest"], "share": one.pop("share"), "held_by": one.pop("held_by")}
    return one | {"slowest": slowest, "threads": threads}


def plan_text(item: dict[str, Any]) -> str:
    """Lines for people from what `plan` returns."""
    lines = [f"{item['kind']}: {item['title']}", *(f"  {name:<20}{value}" for name, value in _rows(item))]
    lines += states_text(item["states"])
    return "\n".join(lines + [f"  warning: {warning}" for warning in item["warnings"]])


def _rows(item: dict[str, Any]) -> _Rows:
    campaign, wear = item["settings"]["campaign"], item["settings"]["counterface"]["wear"]
    yield "distance", f"{item['distance'] / 1e3:g} km"
    named = [entry["name"].split(" ", 1) for entry in item["inputs"][1:]]
    shapes = [name for role, name in named if ".profile" in role and "campaign" not in role]
    yield "wheel, counterface", ", ".join(shapes)
    bodies = (("wheels", item["settings"]["wheelset"]), ("counterface", item["settings"]["counterface"]))
    waves = [f"{name} below {one['smooth_mm']:g} mm" for name, one in bodies if one["smooth_mm"] is not None]
    if waves:
        yield "smoothed", f"waves on {', on '.join(waves)}"
    yield "wheel radius", f"{item['settings']['wheelset']['radius_mm']:g} mm"
    yield "operating points", f"{item['points']}, of which {item['monitoring_points']} only monitor"
    if (record := item["recorded"]) is not None:
        stand = f"stand for {record['samples']} samples, binning error {percent(record['binning_error'])}"
        yield "", f"{item['points'] - item['monitoring_points']} {stand}"
    yield "environment factor", ", ".join(f"{value:g}" for value in item["environment"])
    yield from _models(item)
    yield from _laws(item)
    yield "steps", steps_text(item)
    if (slowest := item["slowest"]) is not None:
        share = f"{100.0 * slowest['share']:.0f} % of the time"
        yield "slowest", f"{slowest['name']}: {share}, steps held by {slowest['held_by']}"
    if (met := item["limit"]) is not None:
        about = float(f"{item['end'] / 1e3:.2g}")
        yield "end", f"about {about:.12g} km: limit of {QUANTITIES[met].meaning} met"
    if (limits := campaign["limits"]) is not None:
        given = [f"{key} = {value:g}" for key, value in limits.items() if key != "end" and value is not None]
        effect = "the first that is met ends the campaign"
        effect = effect if limits["end"] else "the distance at which each is met is reported"
        yield "limits", f"{', '.join(given)}; {effect}"
    if (rules := campaign["reprofiling"]) is not None:
        when = list(rules["at_limits"])
        when += [f"at {', '.join(f'{at:g}' for at in rules['at_km'])} km"] if rules["at_km"] else []
        profile = rules["profile"] or item["settings"]["wheelset"]["profile"]
        yield "reprofiled to", f"{profile}: {', '.join(when)}"
    if wear is not None and "area_mm2_per_1000km" in wear:
        yield "rails", f"each loses {wear['area_mm2_per_1000km']:g} mm2 per 1000 km where the wheels wear"
    elif wear is not None:
        when = [f"every {wear['redress_every_km']:g} km"] if wear["redress_every_km"] else []
        when += [f"{wear['redress_depth_um']:g} um deep"] if wear["redress_depth_um"] else []
        redressed = f"redressed to their new profile {' or '.join(when)}" if when else "never redressed"
        yield "rollers", f"wear {wear['factor']:g} times as deep per passage as the wheels; {redressed}"
    if item["bytes_per_step"] is not None:
        yield "result file", f"{item['bytes_per_step'] / 1e6:.2g} MB per step before compression"


def steps_text(item: dict[str, Any]) -> str:
    """Text on the steps of what `plan` returns and their time."""
    if item["steps"] is None:
        return f"one of the first fails: {item['trial_fault']}"
    steps, seconds, threads = float(f"{item['steps']:.2g}"), max(item["seconds"], 1.0), item["threads"]
    return f"about {steps:.0f}, {duration(seconds)} on {threads} thread{'s' if threads > 1 else ''}"


def _models(item: dict[str, Any]) -> _Rows:
    """Lines on the contact models."""
    tolerance, contact = item["tolerance"], item["settings"]["contact"]
    names = f"{contact['normal']}, {contact['tangential']}"
    if contact["model"] is not None:
        fast, *_, reference = (" + ".join(one) for one in 2 * CHAINS[contact["model"]])
        names = fast if tolerance is None else f"{fast}, corrected by {reference} to {percent(tolerance)}"
    roll = "free" if item["free_roll"] else "given"
    yield "contact models", f"{names}; rotation {contact['rotation']}, roll {roll}"
    grid = f"{contact['strips']} strips x {contact['cells']} cells per patch, more if they would be larger"
    yield "cells", f"{grid} than {contact['cell_mm']:g} mm, {contact['most_cells']} at most"


def _laws(item: dict[str, Any]) -> _Rows:
    law = item["settings"]["wear"]["law"]
    yield "wear law", f"{law} ({item['wear_form']}), {item['wear_coefficients']}"
    for one in item["comparison_laws"]:
        yield "comparison law", f"{one['law']} ({one['form']}), {one['coefficients']}"
    for one in item["fatigue"]:
        text = f"{one['law']}, {one['coefficients']}"
        if "branch" in one:
            text += f", {one['branch']} form, wear number {one['wear_number'].replace('_', ' ')}"
        if "crack_depth" in one:
            text += f", wear removes cracks of {1e3 * one['crack_depth']:g} mm"
        text += f"; assumed: places {1e3 * one['crack_width']:g} mm wide"
        text += f", {1e3 * one['wear_limit']:g} mm may wear" if "wear_limit" in one else ""
        yield "fatigue law", text
