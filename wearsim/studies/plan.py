"""What a scene would run, how long and where.

`wearsim check` as a dict of JSON values and as text.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from wearsim.campaign.evaluate import setup_of, solve_passage
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.contact.solve import available_cores
from wearsim.contact.titles import normal_title, tangential_title
from wearsim.damage import fatigue, wear
from wearsim.damage.fatigue import FATIGUE_LAWS, FatigueSettings
from wearsim.damage.titles import law_title, set_title
from wearsim.errors import Fault, WearsimError
from wearsim.plugins import plug_ins_of
from wearsim.quantities import QUANTITIES, duration, kilometres
from wearsim.results.checks import percent
from wearsim.scene import CampaignSetup, FieldScene, Prepared, RigScene, build
from wearsim.studies.estimate import estimate
from wearsim.studies.models import compared, table_lines
from wearsim.studies.states import states, states_text
from wearsim.texts import wrapped, written


def silent(_: str) -> None:
    """Tell nothing of what is being done."""


def plan(
    scene: RigScene | FieldScene,
    prepared: Prepared,
    warnings: Sequence[Fault],
    threads: int | None = None,
    report: Callable[[str], None] = silent,
) -> dict[str, Any]:
    """Return what a scene would run, with what is solved from it.

    And the warnings of `check_contact`.

    `report` is called with what is being done.

    Returns
    -------
    dict
        JSON values, SI units; `settings` holds every value that would act, defaults
        included. Steps, their time and the end, with the limit met there, are estimates
        for `threads`, by default those of `run_scene`; null where the step that is
        tried fails, `trial_fault` states why. `models` compares the pairs of contact
        models (`wearsim.studies.models.compared`); null where the new profiles fail.
    """
    setup = build(scene, prepared)
    points = setup.points
    count = len(points.label)
    foreseen = _foreseen(setup, threads or available_cores(), report)
    return {
        "kind": setup.kind,
        "title": setup.title,
        "scene": str(scene.origin.path),
        "distance": setup.control.distance,
        "points": count,
        "monitoring_points": int((points.weight == 0).sum()),
        "environment": sorted(
            {float(value) for value in points.environment[points.weight > 0]}
        ),
        "wheels": 2,
        "profile_points": len(setup.wheelset.right.y),
        "inputs": [
            {"name": name, "sha256": digest} for name, digest in setup.input_hashes
        ],
        "wear_coefficients": wear.coefficients_of(setup.wear).name,
        "wear_form": setup.wear.form,
        "comparison_laws": [
            {
                "law": law.law,
                "form": law.form,
                "coefficients": wear.coefficients_of(law).name,
            }
            for law in setup.also_evaluate
        ],
        "fatigue": [_fatigue(law) for law in setup.fatigue],
        "settings": scene.model_dump(by_alias=True, mode="json"),
        "plug_ins": plug_ins_of(
            setup.models, (setup.wear, *setup.also_evaluate), setup.fatigue
        ),
        "contact_models": [setup.models.normal, setup.models.tangential],
        "recorded": None
        if setup.reduction is None
        else {
            "samples": setup.reduction.samples,
            "binning_error": setup.reduction.error,
        },
        "free_roll": points.conditions.free_roll,
        **foreseen,
        "warnings": [str(warning) for warning in warnings],
    }


def _fatigue(settings: FatigueSettings) -> dict[str, Any]:
    name = fatigue.coefficients_of(settings).name
    shown = {
        "law": settings.law,
        "coefficients": name,
        "crack_width": settings.crack_width,
    }
    if FATIGUE_LAWS[settings.law].contains_removal:
        shown |= {"branch": settings.branch, "wear_number": settings.wear_number}
    if settings.crack_depth is not None:
        shown |= {
            "crack_depth": settings.crack_depth,
            "wear_limit": settings.wear_limit,
        }
    return shown


def _foreseen(
    setup: CampaignSetup, threads: int, report: Callable[[str], None]
) -> dict[str, Any]:
    """States on new profiles, estimated steps and time, and the models compared."""
    keys = ("steps", "seconds", "slowest", "end", "limit", "bytes_per_step", "models")
    unknown: dict[str, Any] = dict.fromkeys(keys)
    start, _ = WheelsetEvolution(setup, threads=threads).start()
    report("contact of the new profiles")
    try:
        evaluation = WheelsetEvolution(setup, threads=threads).evaluate(start)
    except WearsimError as error:
        passage = solve_passage(start, setup.points, setup_of(setup, threads))
        return {
            **unknown,
            "states": states(setup.points, passage),
            "trial_fault": str(error),
        }
    foreseen = {
        **unknown,
        "states": states(setup.points, evaluation.passage),
        "threads": threads,
    }
    report("one step on new profiles")
    try:
        estimated = estimate(setup, start, evaluation, threads)._asdict()
        slowest = {
            "name": estimated["slowest"],
            "share": estimated.pop("share"),
            "held_by": estimated.pop("held_by"),
        }
        foreseen |= {**estimated, "slowest": slowest}
    except WearsimError as error:
        foreseen["trial_fault"] = str(error)
    report("contact by all models")
    return foreseen | {
        "models": compared(setup, start, evaluation, foreseen["seconds"], threads)
    }


def _context(item: dict[str, Any], details: bool) -> dict[str, Any]:
    named = [entry["name"].split(" ", 1) for entry in item["inputs"][1:]]
    return {
        "p": item,
        "details": details,
        "shapes": [
            name
            for role, name in named
            if ".profile" in role and "campaign" not in role
        ],
        "states": states_text(item["states"], details),
        "models": table_lines(item["models"]) if item["models"] else [],
        "quantities": QUANTITIES,
        "law_title": law_title,
        "set_title": set_title,
        "normal_title": normal_title,
        "tangential_title": tangential_title,
        "percent": percent,
        "duration": duration,
        "kilometres": kilometres,
        "round": lambda value: float(f"{value:.2g}"),
    }


def verdict_text(item: dict[str, Any]) -> str:
    """Verdict on a scene from what `wearsim.check` returns.

    Its time and its warnings.
    """
    plans = item.get("campaigns") or item["first"]
    messages = [str(warning) for part in plans for warning in part["warnings"]]
    warnings = list(dict.fromkeys(item.get("warnings", messages)))
    parts = [f"{item['scene']}: no faults ({item['kind']})"]
    seconds = [part["seconds"] for part in plans]
    scope = " for case 1" if "first" in item else ""
    if None in seconds:
        parts.append(f"time{scope} unknown: the first step fails")
    elif seconds:
        threads = plans[0]["threads"]
        unit = "threads" if threads > 1 else "thread"
        parts.append(
            f"about {duration(max(sum(seconds), 1.0))}{scope} on {threads} {unit}"
        )
    if warnings:
        parts.append(f"{len(warnings)} warning{'s' if len(warnings) > 1 else ''}")
    # a path is not broken
    lines = [
        ", ".join(parts),
        *(wrapped(f"warning: {message}") for message in warnings),
    ]
    return "\n".join(lines)


def plan_text(item: dict[str, Any], details: bool = False) -> str:
    """Format what `plan` returns as lines, with every state and cell if detailed."""
    text = written("wearsim.studies", "plan.txt.j2", **_context(item, details))
    return "\n".join(wrapped(line, " " * 22) for line in text.splitlines())


def steps_text(item: dict[str, Any]) -> str:
    """Text on the steps of what `plan` returns and their time."""
    return written("wearsim.studies", "steps.txt.j2", **_context(item, False))
