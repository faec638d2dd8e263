"""What a scene would run: `wearsim check` as a dict of JSON values and as text."""

from __future__ import annotations

from collections.abc import Sequence
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
from wearsim.texts import written


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


def _context(item: dict[str, Any]) -> dict[str, Any]:
    named = [entry["name"].split(" ", 1) for entry in item["inputs"][1:]]
    return {
        "p": item,
        "shapes": [name for role, name in named if ".profile" in role and "campaign" not in role],
        "states": states_text(item["states"]),
        "chains": CHAINS,
        "quantities": QUANTITIES,
        "percent": percent,
        "duration": duration,
        "round": lambda value: float(f"{value:.2g}"),
    }


def plan_text(item: dict[str, Any]) -> str:
    """Lines for people from what `plan` returns."""
    return written("wearsim.studies", "plan.txt.j2", **_context(item))


def steps_text(item: dict[str, Any]) -> str:
    """Text on the steps of what `plan` returns and their time."""
    return written("wearsim.studies", "steps.txt.j2", **_context(item))
