"""What a scene would run: `wearsim check` as a dict of JSON values and as text."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.contact.solve import ContactSolution, available_cores, solve_each
from wearsim.contact.wheels import TREAD_ANGLE, joined
from wearsim.damage import fatigue, wear
from wearsim.damage.fatigue import FATIGUE_LAWS, FatigueSettings
from wearsim.errors import ContactError, Fault, WearsimError
from wearsim.operation.resultants import resultants
from wearsim.quantities import QUANTITIES, duration
from wearsim.results.checks import percent
from wearsim.scene import CampaignSetup, FieldScene, RigScene, build
from wearsim.scene.models import CHAINS
from wearsim.studies.estimate import estimate
from wearsim.texts import written

_UNLOADED = 0.1
"""Share of the mean wheel load below which a wheel is marked as unloaded."""
_HELD = 0.25
"""Longitudinal force of a wheel over its load, against that of the other one, from which the pair is marked:
a free axle would steer it away, and suspensions that hold more are rare."""

_SIDES = ("right", "left")

_COLUMNS = (
    ("shift", "shift [mm]", 1e3, ".2f"),
    ("yaw", "yaw [mrad]", 1e3, ".2f"),
    ("lateral_force", "H [kN]", 1e-3, ".1f"),
    ("load_right", "Q right [kN]", 1e-3, ".1f"),
    ("load_left", "Q left [kN]", 1e-3, ".1f"),
    ("angle_right", "angle right [deg]", 180.0 / math.pi, ".0f"),
    ("angle_left", "left", 180.0 / math.pi, ".0f"),
    ("quotient_right", "Y/Q right", 1.0, ".2f"),
    ("quotient_left", "left", 1.0, ".2f"),
    ("steering_moment", "M [kN m]", 1e-3, ".1f"),
    ("wear_number", "wear number [N]", 1.0, ".0f"),
)


def states(setup: CampaignSetup) -> list[dict[str, Any]]:
    """State of each block or class, of a class at its position of the largest wear number.

    Returns
    -------
    list of dict
        SI units, with `marks` on what deserves a second look; points without contact solution are not in it.
    """
    points, failed, bodies = setup.points, dict[int, ContactError](), (setup.wheelset, setup.counterface)
    conditions, (runs, of, share) = points.conditions, points.runs
    parts = solve_each(runs, *bodies, setup.models, ContactSolution.patches, failed=failed, fields="work")
    forces = resultants(joined(parts), runs, *bodies).mean(of, share)
    forces.vertical[of[list(failed)]] = 0.0  # of two sides of a jump one alone says nothing
    wear = np.where(forces.vertical.min(axis=1) > 0.0, forces.power / conditions.speed, -1.0)
    on_bogie = points.controlled is not None and points.controlled.bogies is not None
    found = []
    for number in dict.fromkeys(points.of_class[points.weight > 0.0].tolist()):
        own = np.flatnonzero(points.of_class == number)
        k = int(own[np.argmax(wear[own])])
        if wear[k] < 0.0:
            continue
        load, angle = forces.vertical[k], forces.angle[k]
        marks = [f"{side} flange" for side, one in zip(_SIDES, angle, strict=True) if one > TREAD_ANGLE]
        if points.beyond is not None and k in points.beyond.point:
            marks.append("its force jumps past the one wanted: it runs on both sides of the jump in turn")
        few = zip(_SIDES, load < _UNLOADED * load.mean(), strict=True)
        marks += [f"{side} wheel unloaded" for side, unloaded in few if unloaded]
        force = 0.5 * float(np.ptp(forces.longitudinal[k]))
        if force > _HELD * load.mean() and not on_bogie:
            text = f"held against +-{1e-3 * force:.0f} kN along the track, which no free axle would have"
            marks.append(text)
        of_wheels = {"load": load, "angle": angle, "quotient": forces.derailment_quotient[k]}
        found.append({
            "name": points.label[k],
            "points": int(own.size),
            "shift": float(conditions.shift[k]),
            "yaw": float(conditions.yaw[k]),
            "lateral_force": float(-forces.force[k]),
            **{f"{name}_{side}": float(one) for name, both in of_wheels.items()
               for side, one in zip(_SIDES, both, strict=True)},
            "steering_moment": float(forces.moment[k]),
            "wear_number": float(wear[k]),
            "marks": marks,
        })  # fmt: skip
    return found


def states_text(rows: Sequence[dict[str, Any]]) -> list[str]:
    """Lines of a table of what `states` returns."""
    table = [["state", *(title for _, title, _, _ in _COLUMNS), ""]]
    for row in rows:
        cells = [format(row[key] * factor + 0.0, style) for key, _, factor, style in _COLUMNS]
        name = row["name"] if row["points"] == 1 else f"{row['name']} of {row['points']}"
        table.append([name, *cells, "; ".join(row["marks"])])
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    style = "  ".join(["  {:{}}", *("{:>{}}" for _ in _COLUMNS), "{:{}}"])
    lines = [style.format(*(each for pair in zip(line, widths, strict=True) for each in pair)).rstrip()
             for line in table]  # fmt: skip
    return lines if rows else []


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
