"""What a scene would run, how long and where: `wearsim check` as a dict of JSON values and as text."""

from __future__ import annotations

import math
import time
from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearsim.campaign.control import error_limit, present_block, reached
from wearsim.campaign.evaluate import Evaluation
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.campaign.row import NO_STEP
from wearsim.campaign.state import State
from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import ContactPatches
from wearsim.contact.solve import ContactSolution, available_cores, solve_each
from wearsim.contact.wheels import TREAD_ANGLE, joined
from wearsim.damage import fatigue, wear
from wearsim.damage.fatigue import FATIGUE_LAWS, FatigueSettings
from wearsim.errors import ContactError, Fault, WearsimError, say
from wearsim.operation.points import OperatingPoints
from wearsim.operation.resultants import resultants
from wearsim.quantities import QUANTITIES, duration
from wearsim.results.checks import percent
from wearsim.results.limits import LIMITED, ending_limits, worst_of
from wearsim.results.schema import FILL_FLOAT
from wearsim.scene import CampaignSetup, FieldScene, Prepared, RigScene, build
from wearsim.texts import text_table, written

_EFFORT = 6.0
"""Time for the steps that are tried [s]; each block has at least one within twice that."""


class Estimate(NamedTuple):
    """What a campaign takes, about."""

    steps: int  # to its end
    seconds: float  # for these steps [s]
    slowest: str  # block or class of operating points that takes most of the time
    share: float  # of the time that it takes [-]
    held_by: str  # what holds most of its steps, one of `quantities.STEP_LIMITS`
    end: float  # distance of the campaign, or where a limit ends it [m]
    limit: str | None  # measure whose limit ends it
    bytes_per_step: int  # of a row of the result file


@dataclass
class _Leg:
    """Steps with the same acting points."""

    contact: ContactPatches  # at the end of the last one
    run: float = 0.0  # by those tried [m]
    length: float = math.inf  # to which the next one is held, whatever its growth [m]
    later: str = ""  # what holds it
    seconds: list[float] = field(default_factory=list)  # of each step
    changes: list[tuple[float, FloatArray]] = field(default_factory=list)  # of the margins in lengths [m]
    reasons: Counter[str] = field(default_factory=Counter)  # what held the steps, those to come as well

    def extend(self, whole: float, lives: float, passes: float) -> None:
        """Count the steps to come over `whole` [m] in each of the lives of new profiles, and one per pass."""
        known, further = max(self.run, self.length), max(whole - self.run, 0.0) / self.length
        if self.later in ("error", "depth cap") and whole > known:
            further = max(2.0 * (math.sqrt(whole * known) - known) + known - self.run, 0.0) / self.length
        tried = self.reasons.total()
        self.reasons[self.later] += round(lives * (tried + further)) - tried
        self.reasons["block border"] += max(math.ceil(passes) - self.reasons.total(), 0)

    def slope(self) -> FloatArray:
        """Return the change of the margins per metre over the second half of the steps tried."""
        late = self.changes[len(self.changes) // 2 :]
        return np.sum([each for _, each in late], axis=0) / sum(length for length, _ in late)

    def time(self) -> float:
        """Return that of all its steps [s], without the first one tried, which may have compiled."""
        rest = self.seconds[1:] or self.seconds
        return self.reasons.total() * sum(rest) / len(rest)


def estimate(setup: CampaignSetup, start: State, threads: int = 1) -> Estimate:
    r"""Estimate steps, time and end of a campaign.

    Parameters
    ----------
    setup : CampaignSetup
        The campaign.
    start : State
        At its start.
    threads : int
        Of the contact solver.

    Notes
    -----
    The campaign is run for some seconds, in the first loop of a programme for a share of them in each block,
    whose rest is skipped. If it ends within them, that is its end. Else steps held by error or depth are
    taken to grow with the root of the distance, :math:`n = 2 (\sqrt{s s_0} - s_0) / \Delta s_0`, because wear
    slows down while patches widen: an empirical rule. Others keep their length, all their time. Measures with
    a limit go on as in the last steps tried, lives of reprofiled wheels are like the first one; redressings
    at a depth are not looked for.
    """
    evolution = WheelsetEvolution(setup, threads=threads)
    lengths, total = setup.points.block_length, setup.control.distance
    loop = float(lengths.sum())
    blocks = np.count_nonzero((lengths > 0.0) & (np.cumsum(lengths) - lengths < total))
    evaluation = evolution.evaluate(start)  # compiles most
    row = evolution.row(start, evaluation, NO_STEP)
    limits, margin = _margins(setup, evaluation)
    ending = np.isin(limits, list(ending_limits(evolution.header.attributes)))
    state, legs, lathe = start, dict[bytes, _Leg](), [(0.0, margin)]
    block, until, began = -1, 0.0, time.perf_counter()
    now = began
    while not legs or not (reached(state.distance, total) or (margin[ending] <= 0.0).any()):
        here, rest = present_block(state.distance, lengths) if loop else (0, 0.0)
        entered, first = here != block, state.distance < loop * (1.0 - 1e-9)
        if entered and first:  # one share is left for whole loops
            until = now + max(began + _EFFORT - now, 0.0) / (blocks + (total > loop) - len(legs))
        elif not first:
            until = began + _EFFORT
        if now > began + 2.0 * _EFFORT or (now > until and not entered and not first):
            break
        if now > until and not entered:
            state, block = _skipped(state, min(rest, total - state.distance)), -1
            continue
        old, block = state, here
        state, taken = evolution.advance(old, evaluation)
        evaluation = evolution.evaluate(state, taken)
        before, now, earlier, margin = now, time.perf_counter(), margin, _margins(setup, evaluation)[1]
        if state.reprofiled == state.step:
            lathe.append((state.distance, margin))
            continue
        leg = legs.setdefault(state.active_weight.tobytes(), _Leg(evaluation.passage.contact))
        depth = float((state.wear_depth - old.wear_depth).max())
        leg.length, leg.later = min(
            (error_limit(taken.length, taken.error or 0.0, setup.control), "error"),
            (setup.control.depth_cap * taken.length / max(depth, 1e-30), "depth cap"),
            (setup.control.max_step, "max step"),
            # of models without interpenetration by another measure
            (taken.length if taken.reason == "stability" else math.inf, "stability"),
        )
        leg.contact, leg.run = evaluation.passage.contact, leg.run + taken.length
        leg.seconds.append(now - before)
        leg.changes.append((taken.length, margin - earlier))
        leg.reasons[taken.reason] += 1
    met = limits[ending & (margin <= 0.0)].tolist()
    end, limit = state.distance, met[0] if met else None
    if not met and not reached(sum(leg.run for leg in legs.values()), total):
        weight = {key: np.frombuffer(key) for key in legs}
        many = [key for key in legs if not loop or np.count_nonzero(weight[key]) > 1]
        parts = [(1.0 if many else float(lengths @ weight[key]) / loop, legs[key]) for key in many or legs]
        slope = sum((share * leg.slope() for share, leg in parts), np.zeros(margin.size))
        end, limit, lives = _end_of(setup, (limits, ending, margin, slope), state.distance, lathe)
        for key, leg in legs.items():
            passes = 1.0 if many else max(end / min(state.distance, loop), 1.0)
            if len(lathe) > 1:  # whole lives were tried
                more = end / state.distance
                leg.reasons = Counter({why: round(n * more) for why, n in leg.reasons.items()})
            elif key in many:
                leg.run = state.distance
                leg.extend(end / lives, lives, lives)
            else:
                leg.extend(passes * float(lengths @ weight[key]) / (1.0 if many else lives), lives, passes)
    seconds: dict[str, float] = defaultdict(float)
    held_by = {}
    for key, leg in legs.items():
        for name, share in _shares(setup.points, leg.contact, np.frombuffer(key)).items():
            seconds[name] += share * leg.time()
            held_by[name] = leg.reasons.most_common(1)[0][0]
    slowest, whole = max(seconds, key=seconds.__getitem__), sum(seconds.values())
    steps = sum(leg.reasons.total() for leg in legs.values())
    size, share = sum(values.nbytes for values in row.values()), seconds[slowest] / whole
    return Estimate(steps, whole, slowest, share, held_by[slowest], end, limit, size)


def _margins(setup: CampaignSetup, evaluation: Evaluation) -> tuple[NDArray[np.str_], FloatArray]:
    """Measures with a limit, by wheel where they have two values, and how far they are from it [SI]."""
    laws = [law.law for law in setup.fatigue]
    pairs = [
        (name, math.nan if value == FILL_FLOAT else LIMITED[name] * (limit - value))
        for name, limit in setup.control.limits
        for value in worst_of(name, evaluation.measures[name], laws).tolist()
    ]
    names, left = [name for name, _ in pairs], [value for _, value in pairs]
    return np.array(names, dtype=np.str_), np.array(left, dtype=np.float64)


def _skipped(state: State, rest: float) -> State:
    """Return the state behind the rest of a block [m]."""
    rollers = state.counterface
    if rollers is not None:
        rollers = replace(rollers, redressed_at=rollers.redressed_at + rest)
    return replace(state, distance=state.distance + rest, counterface=rollers)


def _end_of(
    setup: CampaignSetup,
    limits: tuple[NDArray[np.str_], NDArray[np.bool_], FloatArray, FloatArray],
    far: float,
    lathe: list[tuple[float, FloatArray]],
) -> tuple[float, str | None, float]:
    """Distance at the end [m], the limit met there, and how many lives of new profiles come before.

    Of measures with a limit: their names, whether they end the campaign, how `far` on [m] they are from it
    and the slope of that; `lathe` has where the wheels were new, and the distances from the limits then.
    """
    (name, ending, margin, slope), rules, total = limits, setup.control.reprofiling, setup.control.distance
    at = np.where(slope < 0.0, far - margin / np.where(slope < 0.0, slope, 1.0), np.inf)
    life, lives = total, len(lathe) - 1
    if rules is not None:
        by_limit = at[np.isin(name, rules.limits)].min(initial=total / (1 + len(rules.places)))
        life = lathe[-1][0] / lives if lives else float(by_limit)
        at[at > lathe[-1][0] + life] = np.inf
        for k in np.flatnonzero(name == "wheel_diameter") if life < total else ():  # falls at the lathe, too
            spare, worn = float(lathe[0][1][k]), max(-float(slope[k]) * life, 1e-9)
            loss = (spare - float(lathe[-1][1][k])) / lives if lives else 2.0 * rules.cut + worn
            before = max(math.ceil((spare - worn) / loss), 0)
            at[k] = life * (before + max(spare - before * loss, 0.0) / worn)
    first = min(np.flatnonzero(ending & (at < total)), key=at.__getitem__, default=None)
    end, limit = (total, None) if first is None else (float(at[first]), str(name[first]))
    redressed = 0.0 if setup.counterface_wear is None else end / setup.counterface_wear.redress_distance
    return end, limit, max(end / life, 1.0 + math.floor(redressed))


def _shares(points: OperatingPoints, contact: ContactPatches, weight: FloatArray) -> dict[str, float]:
    """Share of the time of a step by block or class of the acting points: of the cells of their patches."""
    names, patch = np.array(points.class_name or points.label), contact.patch
    cells = np.bincount(contact.point, patch.strips * patch.cells, names.size) * (weight > 0.0)
    return {
        str(name): float(cells[names == name].sum() / cells.sum()) for name in np.unique(names[cells > 0.0])
    }


_ALIKE = 1e-3  # relative difference of wear numbers that counts for nothing
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
    forces = resultants(joined(parts), runs.shift.size).mean(of, share)
    forces.vertical[of[list(failed)]] = 0.0  # of two sides of a jump one alone says nothing
    shift = conditions.axle_shift(forces.roll)
    wear = np.where(forces.vertical.min(axis=1) > 0.0, forces.power / conditions.speed, -1.0)
    on_bogie = points.controlled is not None and points.controlled.bogies is not None
    found = []
    for number in dict.fromkeys(points.of_class[points.weight > 0.0].tolist()):
        own = np.flatnonzero(points.of_class == number)
        # the first of those that are alike: mirror images differ by rounding
        k = int(own[np.argmax(wear[own] >= (1.0 - _ALIKE) * wear[own].max())])
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
            marks.append(say("state.held", force=force))
        of_wheels = {"load": load, "angle": angle, "quotient": forces.derailment_quotient[k]}
        found.append({
            "name": points.label[k],
            "points": int(own.size),
            "shift": float(shift[k]),
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
    table = [["  state", *(title for _, title, _, _ in _COLUMNS)]]
    for row in rows:
        cells = [format(row[key] * factor + 0.0, style) for key, _, factor, style in _COLUMNS]
        name = row["name"] if row["points"] == 1 else f"{row['name']} of {row['points']}"
        table.append([f"  {name}", *cells])
    marks = ["", *("; ".join(row["marks"]) for row in rows)]
    lines = [f"{line}  {mark}".rstrip() for line, mark in zip(text_table(table), marks, strict=True)]
    return lines if rows else []


def plan(
    scene: RigScene | FieldScene,
    prepared: Prepared,
    warnings: Sequence[Fault],
    threads: int | None = None,
) -> dict[str, Any]:
    """Return what a scene would run, with what is solved from it and the warnings of `check_contact`.

    Returns
    -------
    dict
        JSON values, SI units; `settings` holds every value that would act, defaults included. Steps, their
        time and the end, with the limit met there, are estimates for `threads`, by default those of
        `run_scene`; null where one of the first steps fails, `trial_fault` states why.
    """
    setup = build(scene, prepared)
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
        "contact_models": [setup.models.normal, setup.models.tangential],
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
