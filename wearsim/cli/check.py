"""`wearsim check`: all faults of a scene, or what would be run."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from wearsim.cli import Commands, add_command
from wearsim.cli.overrides import add_override_flags, load_overridden

if TYPE_CHECKING:
    from wearsim.damage.fatigue import FatigueSettings
    from wearsim.errors import Fault
    from wearsim.scene import CampaignSetup, FieldScene, RigScene

_PATCH_VALUES = 25
"""Values stored per patch slot: positions, forces, creepages, wear index and the like."""


def add_parser(commands: Commands) -> None:
    """Add the command."""
    parser = add_command(
        commands,
        "check",
        "show all faults of a scene file, or what it would run",
        "wearsim check workflows/rig_vs_field.toml\nwearsim check rig.toml --json",
    )
    parser.add_argument("scene", metavar="SCENE", help="scene file (TOML)")
    parser.add_argument("--json", action="store_true", help="print JSON, with every value that would act")
    add_override_flags(parser)


def execute(arguments: argparse.Namespace) -> int:
    """Check the scene and print what it would run."""
    import json

    from wearsim.cli import sweep
    from wearsim.scene import CompareScene, SweepScene
    from wearsim.scene.touch import check_contact

    scene, _ = load_overridden(arguments)
    told: dict[str, Any]
    if isinstance(scene, SweepScene):
        told = sweep.plan(scene)
        texts = [sweep.text(told)]
    else:
        warnings = check_contact(scene)
        parts: list[RigScene | FieldScene]
        parts = [scene.rig, scene.field] if isinstance(scene, CompareScene) else [scene]
        plans = [
            plan(part, [item for item in warnings if item.file == str(part.origin.path)]) for part in parts
        ]
        told, texts = {"campaigns": plans}, [_text(item) for item in plans]
    kind = scene.scene.kind
    if arguments.json:
        told = {"scene": str(scene.origin.path), "kind": kind, **told}
        print(json.dumps(told, indent=2, ensure_ascii=False))
    else:
        print("\n\n".join([f"{scene.origin.path}: no faults ({kind})", *texts]))
    return 0


def plan(scene: RigScene | FieldScene, warnings: Sequence[Fault]) -> dict[str, Any]:
    """Tell what a scene would run.

    Parameters
    ----------
    scene : RigScene or FieldScene
        As loaded.
    warnings : sequence of Fault
        What `check_contact` warned of.

    Returns
    -------
    dict
        JSON values, SI units; `settings` holds every value that would act, defaults included.
    """
    from wearsim.damage.wear import WEAR_LAWS, coefficients_of
    from wearsim.scene import build

    setup = build(scene)
    points = setup.points
    count = len(points.label)
    vertices = len(setup.wheelset.right.y)
    evaluations = 2  # at both ends of a step: for the mean of both rates, or for the error of Euler's rule
    # two wheels: y, z, depth, work, depth by regime; eight patch slots per point
    values = 2 * vertices * (4 + len(WEAR_LAWS[setup.wear.law].regimes)) + count * (8 * _PATCH_VALUES + 2)
    laws = len(setup.fatigue)
    values += 2 * vertices * (len(setup.also_evaluate) + (1 + 4 * laws if laws else 0))
    # wear numbers and the index below the surface; of each law damage, place and index in three units
    values += count * 8 * (3 + 5 * laws) if laws else 0
    if setup.counterface_wear is not None:  # its y, z and depth
        values += 2 * 3 * len(setup.counterface.profile.y)
    return {
        "kind": setup.kind,
        "title": setup.title,
        "scene": str(scene.origin.path),
        "distance": setup.control.distance,
        "points": count,
        "monitoring_points": int((points.weight == 0).sum()),
        "environment": sorted({float(value) for value in points.environment[points.weight > 0]}),
        "wheels": 2,
        "evaluations_per_step": evaluations,
        "solutions_per_step": 2 * count * evaluations,
        "steps": None,
        "profile_points": vertices,
        "bytes_per_step": 8 * values,
        "inputs": [{"name": name, "sha256": digest} for name, digest in setup.input_hashes],
        "wear_coefficients": coefficients_of(setup.wear).name,
        "wear_form": setup.wear.form,
        "comparison_laws": [
            {"law": one.law, "form": one.form, "coefficients": coefficients_of(one).name}
            for one in setup.also_evaluate
        ],
        "fatigue": [_fatigue(one) for one in setup.fatigue],
        "settings": scene.model_dump(by_alias=True, mode="json"),
        "choice": _choice(setup),
        "warnings": [str(warning) for warning in warnings],
    }


def _fatigue(settings: FatigueSettings) -> dict[str, Any]:
    from wearsim.damage.fatigue import FATIGUE_LAWS, coefficients_of

    shown: dict[str, Any] = {"law": settings.law, "coefficients": coefficients_of(settings).name}
    shown["crack_width"] = settings.crack_width
    if FATIGUE_LAWS[settings.law].contains_removal:
        shown |= {"branch": settings.branch, "wear_number": settings.wear_number}
    if settings.crack_depth is not None:
        shown |= {"crack_depth": settings.crack_depth, "wear_limit": settings.wear_limit}
    return shown


def _laws(item: dict[str, Any]) -> list[tuple[str, str]]:
    """Lines on the comparison laws and on fatigue."""
    laws = item["comparison_laws"]
    lines = [("comparison law", f"{one['law']} ({one['form']}), {one['coefficients']}") for one in laws]
    for one in item["fatigue"]:
        form = f", {one['branch']} form, wear number {one['wear_number']}" if "branch" in one else ""
        removal = f", wear removes cracks of {1e3 * one['crack_depth']:g} mm" if "crack_depth" in one else ""
        assumed = f"; assumed: places {1e3 * one['crack_width']:g} mm wide"
        assumed += f", {1e3 * one['wear_limit']:g} mm may wear" if "wear_limit" in one else ""
        told = f"{one['law']}, {one['coefficients']}{form.replace('_', ' ')}{removal}{assumed}"
        lines.append(("fatigue law", told))
    return lines


def _choice(setup: CampaignSetup) -> dict[str, Any] | None:
    """Contact models that would be chosen for the new wheelset, and the evidence; None if they are given."""
    import math

    from wearsim.campaign import choose
    from wearsim.campaign.choose import CLASSES
    from wearsim.campaign.evolution import WheelsetEvolution

    if setup.tolerance is None:
        return None
    state, _ = WheelsetEvolution(replace(setup, tolerance=None)).start()
    verdict = choose.choice(setup, state)
    candidates = choose.candidates(setup.models)
    taken = [choose.named(candidates[place]) for place in verdict.choice.models]
    alone = verdict.evidence[-1]
    return {
        "tolerance": setup.tolerance,
        "classes": [
            {"class": name, "points": count, "models": models}
            for name, count, models in zip(CLASSES, verdict.points, taken, strict=True)
        ],
        "depth_error": verdict.choice.error,
        "cost": verdict.cost,
        "cost_of_one_for_all": choose.COST_ORDER[candidates.index(alone.models)][3],
        "evidence": [
            {
                "models": choose.named(one.models),
                "cost": choose.COST_ORDER[candidates.index(one.models)][3],
                "depth_error": one.depth_error if math.isfinite(one.depth_error) else None,
                "strip_work_error": one.work_error if math.isfinite(one.work_error) else None,
                "refusal": one.message,
            }
            for one in verdict.evidence
        ],
    }


def _models(choice: dict[str, Any] | None, contact: dict[str, Any]) -> list[tuple[str, str]]:
    """Lines on the contact models: as given, or the choice and why."""
    motion = f"rotation {contact['rotation']}, roll {contact['roll']}"
    if choice is None:
        return [
            ("contact models", f"{contact['normal']}, {contact['tangential']}; {motion}"),
            ("cells", f"{contact['strips']} strips x {contact['cells']} cells per patch"),
        ]
    from wearsim.results.plausibility import percent

    lines = [("contact models", f"chosen for a tolerance of {100.0 * choice['tolerance']:.3g} %; {motion}")]
    for one in choice["classes"]:
        if one["points"]:
            lines.append(("", f"{one['points']} {one['class']} points: {one['models']}"))
    lines.append(
        (
            "",
            f"depth error {percent(choice['depth_error'])}, estimated from a sample, "
            f"cost {choice['cost']:.3g}; one for all would cost {choice['cost_of_one_for_all']:.3g}",
        )
    )
    lines.append(("for all points", "in units of the cheapest one's time per solution"))
    for one in choice["evidence"]:
        error = one["depth_error"]
        told = f"depth error {percent(error)}" if error is not None else f"no answer: {one['refusal']}"
        lines.append(("", f"{one['models']}: {told}, cost {one['cost']:g}"))
    return lines


def _limits(given: dict[str, Any] | None) -> list[tuple[str, str]]:
    """Line on the limits of a campaign, if there are any."""
    if given is None:
        return []
    told = ", ".join(
        f"{key} = {value:g}" for key, value in given.items() if key != "end" and value is not None
    )
    end = "the first that is met ends the campaign" if given["end"] else "told where they are met"
    return [("limits", f"{told}; {end}")]


def _counterface(wear: dict[str, Any] | None) -> list[tuple[str, str]]:
    """Line on the wear of the counterface, if it wears."""
    if wear is None:
        return []
    if "area_mm2_per_1000km" in wear:
        return [
            ("rails", f"each loses {wear['area_mm2_per_1000km']:g} mm2 per 1000 km where the wheels wear")
        ]
    when = [
        text
        for text in (
            wear["redress_every_km"] and f"every {wear['redress_every_km']:g} km",
            wear["redress_depth_um"] and f"{wear['redress_depth_um']:g} um deep",
        )
        if text
    ]
    turned = f"turned back to their new profile {' or '.join(when)}" if when else "never turned"
    return [("rollers", f"wear {wear['factor']:g} times as deep per passage as the wheels; {turned}")]


def _turning(given: dict[str, Any] | None, profile: str) -> list[tuple[str, str]]:
    """Line on the turning of the wheels, if there is any."""
    if given is None:
        return []
    when = [
        *given["at_limits"],
        *([f"at {', '.join(f'{at:g}' for at in given['at_km'])} km"] if given["at_km"] else []),
    ]
    return [("turned to", f"{given['profile'] or profile}: {', '.join(when)}")]


def _text(item: dict[str, Any]) -> str:
    campaign, contact, wear = (item["settings"][name] for name in ("campaign", "contact", "wear"))
    environment = ", ".join(f"{value:g}" for value in item["environment"])
    rows = [
        ("distance", f"{item['distance'] / 1e3:g} km"),
        ("wheel, counterface", ", ".join(entry["name"].split(" ", 1)[1] for entry in item["inputs"][1:3])),
        ("operating points", f"{item['points']}, of which {item['monitoring_points']} only monitor"),
        ("environment factor", environment),
        *_models(item["choice"], contact),
        ("wear law", f"{wear['law']} ({item['wear_form']}), {item['wear_coefficients']}"),
        *_laws(item),
        (
            "solutions per step",
            f"{item['points']} points x 2 wheels x {item['evaluations_per_step']} evaluations "
            f"({campaign['integrator']}) = {item['solutions_per_step']}",
        ),
        (
            "steps",
            f"not known before the run: depth below {campaign['max_step_depth_um']:g} um, S below "
            f"{campaign['stability']:g} and error below {campaign['error_tolerance_um']:g} um set each",
        ),
        *_limits(campaign["limits"]),
        *_counterface(item["settings"]["counterface"]["wear"]),
        *_turning(campaign["reprofiling"], item["settings"]["wheelset"]["profile"]),
        ("result file", f"about {item['bytes_per_step'] / 1e6:.2g} MB per step before compression"),
    ]
    lines = [f"{item['kind']}: {item['title']}"]
    lines += [f"  {name:<20}{value}" for name, value in rows]
    lines += [f"  warning: {warning}" for warning in item["warnings"]]
    return "\n".join(lines)
