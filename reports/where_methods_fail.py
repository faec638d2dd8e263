"""Where contact models fail.

Every combination of models in the situations of where_methods_fail_cases.csv.

python reports/where_methods_fail.py              solves all: where_methods_fail.csv, _steps.csv and .md
python reports/where_methods_fail.py --from-csv   writes the text from both tables as they stand
"""

import re
import time
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from contact_accuracy import ERRORS, WheelSums, errors_of, wheel_sums
from wear_step_stability import one_step_section, read_table, wave_after_one_step
from writing import HERE, Table, options, write_csv, write_report

import wearsim
from wearsim.errors import ContactError
from wearsim.profile.shape import resample
from wearsim.profile.smoothing import smoothed

TITLE = "Where contact models fail, and which one to take"
SITUATIONS = pd.read_csv(
    HERE / "where_methods_fail_cases.csv", dtype=str, keep_default_na=False
)
SITUATIONS = SITUATIONS.to_dict("records")
GRID, REFERENCE_GRID = 50, 80
RIGHT_WITHIN, WRONG_ABOVE = 0.1, 1.0  # borders of the largest error
SECONDS = 20.0  # longest time of a solution
SPEED, FRICTION = 20.0, 0.35
WHEEL = wearsim.standard_profile("S1002")
RAIL = wearsim.standard_profile("60E1", inclination=1.0 / 40.0, gauge=1.435)
MIDDLE = -12.5e-3  # of the patch on the tread at a shift of 3 mm, on the wheel [m]

OUTCOMES = (
    "right",
    "degraded",
    "wrong",
    "not applicable",
    "unproven",
    "unsound",
    "crashed",
)
RIGHT, DEGRADED, WRONG, NOT_APPLICABLE, UNPROVEN, UNSOUND, CRASHED = OUTCOMES
# share of friction times load times speed below which there is no power to speak of
STILL = 1e-8
LOAD, WORK = 2e-6, 1e-4  # relative tolerances on load, strip work against power
# Strips in planes of their own: their normal forces add up to less than their sum;
# relative tolerance on the friction bound. Power gained may be what the half-space's
# tangential solution leaves open, 1e-6.
BOUND, GAIN = 5e-3, 1e-6

STATED = {
    ("kik_piotrowski", "fastsim"): (0.25, 0.45, 0.1, 0.2, 0.5),
    ("coupled_strips", "fastsim"): (0.06, 0.2, 0.25, 0.3, 0.35),
    ("hertz", "fastsim"): (0.35, 0.2, 0.15, 0.4, 0.7),
    ("kik_piotrowski", "coupled_strips"): (0.25, 0.45, 0.2, 0.3, 0.5),
    ("coupled_strips", "coupled_strips"): (0.06, 0.2, 0.15, 0.2, 0.35),
    ("hertz", "coupled_strips"): (0.35, 0.2, 0.2, 0.25, 0.7),
    ("half_space", "fastsim"): (0.03, 0.08, 0.25, 0.3, 0.25),
    ("half_space", "coupled_strips"): (0.03, 0.08, 0.05, 0.1, 0.2),
    ("kik_piotrowski", "half_space"): (0.25, 0.45, 0.2, 0.3, 0.5),
    ("coupled_strips", "half_space"): (0.06, 0.2, 0.15, 0.2, 0.35),
    ("hertz", "half_space"): (0.35, 0.2, 0.2, 0.25, 0.7),
    ("half_space", "half_space"): (0.03, 0.08, 0.02, 0.08, 0.2),
}
"""Every combination of normal and tangential model, the cheapest first as in
speed_accuracy.md at 50 x 50, with the errors it keeps within on 30 strips and cells or
more, but for known failures the tests name.
"""
MODELS = {
    f"{normal} + {tangential}": (normal, tangential) for normal, tangential in STATED
}
CANNOT_UPDATE = ("hertz",)  # normal models that cannot update the profile
PLACE = re.compile(r"^(right|left) wheel, shift [^:]*: ")  # of a message
SYMBOLS = dict(zip(ERRORS, "ApFPW", strict=True))
PURPOSES = {
    "forces and power": ("force", "power"),
    "patch and pressure": ("area", "max_pressure"),
    "wear (strip work)": ("strip_work",),
}

DECISION = f"""\
The cheapest combination of normal and tangential model that stays within {100.0 * RIGHT_WITHIN:g} % of the
half-space solution in every situation of a kind, by what is needed. Where none does, the one whose largest
error is smallest, in brackets.
"""
DECISION_NOTES = """\
`hertz` is left out of the last column: it cannot update the profile. Smooth measured profiles before they
are used: no model gives the wear of a rough one, and the pressure is that of roughness that would yield.
Situations the half-space, or every model, is not applicable to count for no choice. The choice rests on
these situations alone: stay near them, or compare the models on your own contacts with
`wearsim.solve_contact`, as contact_accuracy.py does.
"""
METHOD = f"""\
{len(SITUATIONS)} situations, {len(MODELS)} combinations of models on {GRID} strips and {GRID} cells, unless
the situation is one of the grid. Right wheel; S1002 on 60E1 1:40 at a shift of 3 mm, 80 kN, friction
{FRICTION:g}, {SPEED:g} m/s, steel, unless the situation says otherwise. Reference:
`half_space + half_space` on {REFERENCE_GRID} x {REFERENCE_GRID}; the column of `half_space + half_space`
itself shows what the grid alone does.

Errors: A area, p maximum pressure, P frictional power, relative; F creep force over friction coefficient
times load; W strip work, the integral of the absolute difference over that of the reference. A cell of the
matrix holds `right` if all are within {100.0 * RIGHT_WITHIN:g} %, else those that are not, in per cent;
bold if one is above {100.0 * WRONG_ABOVE:g} %. `n/a`: the model is not applicable, for the reason with that
number below. `unproven`: a solution where the reference is not applicable.

Never allowed, and checked in every solution: numbers that are not finite; a load that is not carried;
negative pressure; traction beyond friction; power gained; strip work that does not add up to the power; an
error other than a ContactError; more than {SECONDS:g} s.

Situations: [where_methods_fail_cases.csv](where_methods_fail_cases.csv); all values:
[where_methods_fail.csv](where_methods_fail.csv),
[where_methods_fail_steps.csv](where_methods_fail_steps.csv).
"""


@dataclass(frozen=True)
class Solution:
    """What one combination of models makes of a situation.

    `sums` is None if there is no sound solution.
    """

    sums: WheelSums | None
    outcome: str  # empty if there is one
    message: str
    seconds: float


def off_the_rail(gap):
    """Wheel with a given gap to the rail at every lateral position, and the rail."""
    part = np.abs(RAIL.y) < 33e-3
    y = RAIL.y[part]
    return wearsim.Profile(
        "designed", "wheel", y, RAIL.z[part] - gap(y), "the rail less a given gap"
    ), RAIL


def parabolic_gap(radius, centre):
    """Gap of a relative radius."""
    return off_the_rail(lambda y: 0.5 * (y - centre) ** 2 / radius)


def two_wells(apart, height):
    """Gap with a maximum in the middle.

    Two contacts, between them a wheel more hollow than the rail.
    """
    return off_the_rail(lambda y: height * ((y / (0.5 * apart)) ** 2 - 1.0) ** 2)


def flat():
    """Cylinder on a flat: both without curvature across the rail."""
    y = np.linspace(-35e-3, 35e-3, 281)
    return tuple(
        wearsim.Profile("flat", kind, y, 0.0 * y, "a straight line")
        for kind in ("wheel", "rail")
    )


def hollow(depth):
    """S1002 with a hollow of 60 mm width on the tread."""
    worn = np.where(np.abs(WHEEL.y) < 30e-3, np.cos(np.pi * WHEEL.y / 60e-3) ** 2, 0.0)
    facing = np.arange(WHEEL.y.size) > int(np.argmax(WHEEL.z))
    return replace(WHEEL, name="hollow", z=WHEEL.z - depth * worn * facing), RAIL


def noisy(height, smoothing):
    """S1002 with normally distributed noise on points 0.25 mm apart.

    Smoothed over a wavelength if any.
    """
    wheel = resample(WHEEL, 0.25e-3)
    noise = height * np.random.default_rng(6).standard_normal(wheel.y.size)
    return smoothed(replace(wheel, name="measured", z=wheel.z + noise), smoothing), RAIL


def cut(beyond):
    """S1002 that ends `beyond` the middle of the patch on the tread."""
    part = WHEEL.y < MIDDLE + beyond
    return replace(WHEEL, name="cut", y=WHEEL.y[part], z=WHEEL.z[part]), RAIL


PROFILES = {f.__name__: f for f in (parabolic_gap, two_wells, flat, hollow, noisy, cut)}


def problem_of(situation):
    """Wheelset, counterface and point of a row of where_methods_fail_cases.csv."""
    name, *numbers = situation["profiles"].split() or [""]
    wheel, rail = PROFILES[name](*map(float, numbers)) if name else (WHEEL, RAIL)
    motion = {
        "shift": 3e-3,
        "yaw": 0.0,
        "roll": 0.0,
        "wheel_load": 80e3,
        "speed": SPEED,
    }
    motion |= {"friction": FRICTION, "track_curvature": 0.0}
    motion |= {
        key: float(situation[key])
        for key in ("shift", "yaw", "wheel_load")
        if situation[key]
    }
    creepage = None
    if situation["spin"]:
        creepage = np.array(
            [[float(situation[key]) for key in ("creepage_x", "creepage_y", "spin")]]
        )
    curvature = (
        1.0 / float(situation["roller_radius"]) if situation["roller_radius"] else 0.0
    )
    # not ContactConditions.of, which limits the input: what lies beyond is to be solved
    # here
    conditions = wearsim.ContactConditions(
        **{key: np.array([value]) for key, value in motion.items()},
        rotation="nominal",
        creepage=creepage,
    )
    wheelset = wearsim.wheelset(wheel, radius=0.46, back_to_back=1.36)
    return wheelset, wearsim.Counterface(rail, curvature), conditions


def solve(situation, normal, tangential, grid, problem=None):
    """Solve the right wheel of a situation.

    Whatever happens, on `grid` strips and cells or its own.

    `problem` is what `problem_of` returns for it, if that has been made.
    """
    wheelset, counterface, conditions = problem or problem_of(situation)
    material = {
        key: float(situation[key])
        for key in ("youngs_modulus", "poisson_ratio")
        if situation[key]
    }
    strips, cells = (int(situation[key] or grid) for key in ("strips", "cells"))
    most = min(
        strips, cells
    )  # leaves both counts as they are, whatever the size of a patch
    models = wearsim.ContactModels(
        normal, tangential, strips, cells, most_cells=most, **material
    )
    sums, outcome, start = None, "", time.perf_counter()
    try:
        contact = wearsim.solve_contact(
            wheelset, counterface, conditions, models, sides="right", fields=True
        )
        jump = wearsim.TANGENTIAL_MODELS[tangential].jump
        message = "; ".join(violated_laws(contact, conditions, LOAD + 0.3 * jump))
        if message:
            outcome = UNSOUND
        else:
            (sums,) = wheel_sums(contact)
    except ContactError as error:
        outcome, message = NOT_APPLICABLE, str(error)
    except Exception as error:  # any other error is what is looked for
        outcome, message = CRASHED, f"{type(error).__name__}: {error}"
    return Solution(sums, outcome, message, time.perf_counter() - start)


def violated_laws(contact, conditions, within=LOAD):
    """Return the laws any solution must obey.

    Whatever the model, that this one of a wheel does not.

    It carries the load `within` a share of it, more where creep forces of the model
    jump.
    """
    if not all(
        np.isfinite(v).all() for v in contact.variables.values() if v.dtype.kind == "f"
    ):
        return ["numbers that are not finite"]
    friction, load = float(conditions.friction[0]), float(conditions.wheel_load[0])
    speed = float(conditions.speed[0])
    normal, power = contact["normal_force"], float(contact["power"].sum())
    carried = float(contact["track_vertical"].sum())
    creep_force = np.hypot(contact["force_x"], contact["force_y"])
    pairs = (
        ("force_x", "creepage_x"),
        ("force_y", "creepage_y"),
        ("spin_moment", "spin"),
    )
    gained = float(
        (
            sum(contact[force] * contact[creepage] for force, creepage in pairs) * speed
        ).max()
    )
    work = float((contact["strip_work"] * contact["strip_width"]).sum()) * speed
    still = STILL * friction * load * speed
    laws = {
        f"carries {carried:g} N of {load:g} N": abs(carried - load) <= within * load,
        "area or pressure not positive": (contact["area"] > 0.0).all()
        and (contact["pressure"] >= 0.0).all(),
        "creep force above friction coefficient times normal force": (
            creep_force <= friction * normal * (1.0 + BOUND)
        ).all(),
        f"gains {gained:.3g} W from friction": gained <= GAIN * friction * load * speed,
        "strip work does not add up to the power": abs(work - power)
        <= WORK * power + still,
    }
    return [law for law, obeyed in laws.items() if not obeyed]


def errors_between(sums, reference, conditions):
    """Errors by the names of `ERRORS`.

    Of power and strip work 0 where neither dissipates to speak of.
    """
    limit = float(conditions.friction[0] * conditions.wheel_load[0])
    errors = errors_of(sums, reference, limit)
    if max(sums.power, reference.power) < STILL * limit * float(conditions.speed[0]):
        errors |= {"power": 0.0, "strip_work": 0.0}
    return errors


def outcome_of(errors):
    """Outcome of a sound solution by its largest error."""
    largest = max(abs(error) for error in errors.values())
    return (
        RIGHT
        if largest <= RIGHT_WITHIN
        else DEGRADED
        if largest <= WRONG_ABOVE
        else WRONG
    )


def assess(
    situations=SITUATIONS, models=MODELS, grid=GRID, reference_grid=REFERENCE_GRID
):
    """Table of outcomes and errors.

    A row for each situation and combination of models.
    """
    for normal, tangential in models.values():
        solve(
            SITUATIONS[0], normal, tangential, grid
        )  # compiles, so that no time below includes it
    rows = []
    for situation in situations:
        problem = problem_of(situation)
        usual_grid = {"strips": "", "cells": ""}
        reference = solve(
            situation | usual_grid, "half_space", "half_space", reference_grid, problem
        )
        for name, (normal, tangential) in models.items():
            solution = solve(situation, normal, tangential, grid, problem)
            outcome, message, errors = solution.outcome, solution.message, {}
            if solution.sums is not None and reference.sums is not None:
                errors = errors_between(solution.sums, reference.sums, problem[2])
                outcome = outcome_of(errors)
            elif solution.sums is not None:
                outcome = UNPROVEN
            if solution.seconds > SECONDS:
                outcome, message = CRASHED, f"took longer than {SECONDS:g} s"
            row = {
                "kind": situation["kind"],
                "situation": situation["situation"],
                "model": name,
            }
            row |= {"outcome": outcome} | {
                f"error_{error}": errors.get(error, np.nan) for error in ERRORS
            }
            rows.append(row | {"message": message})
    return pd.DataFrame(rows)


def decision_table(table):
    """Table of the cheapest adequate models.

    A row for each kind of situation, a column for each purpose.
    """
    rows = []
    for kind, part in table.groupby("kind", sort=False):
        rows.append([kind])
        solved = part.groupby("situation")["error_area"].transform("count") > 0
        if not solved.any():
            rows[-1] += ["none: no model is applicable"] * len(PURPOSES)
            continue
        for purpose, names in PURPOSES.items():
            errors = (
                part[solved][[f"error_{name}" for name in names]].abs().fillna(np.inf)
            )
            largest = errors.max(axis=1).groupby(part["model"]).max().reindex(MODELS)
            if purpose == "wear (strip work)":
                largest[
                    [
                        name
                        for name, (normal, _) in MODELS.items()
                        if normal in CANNOT_UPDATE
                    ]
                ] = np.inf
            rows[-1].append(_choice(largest))
    return Table(["scene", *PURPOSES], rows, "llll")


def _choice(largest):
    """Cheapest combination by the largest error of each, the cheapest first."""
    adequate = largest.index[largest <= RIGHT_WITHIN]
    if len(adequate):
        return f"`{adequate[0]}`"
    best = largest.idxmin()
    if np.isinf(largest[best]):
        return "none solves every situation"
    return f"`{best}` ({100.0 * largest[best]:.0f} %)"


def count_table(table):
    """Table of situations by outcome, and stated errors, of each combination."""
    counts = pd.crosstab(table["model"], table["outcome"]).reindex(
        columns=list(OUTCOMES), fill_value=0
    )
    rows = [
        [
            f"`{name}`",
            *counts.loc[name],
            *(f"{100.0 * limit:.0f}" for limit in STATED[models]),
        ]
        for name, models in MODELS.items()
    ]
    return Table(
        ["model", *OUTCOMES, *(f"{symbol} stated [%]" for symbol in SYMBOLS.values())],
        rows,
    )


def general(message):
    """Return a message without its place and values.

    What it has in common with others of its sort.
    """
    return re.sub(r"-?\d[\d.]*(e[+-]?\d+)?", "#", PLACE.sub("", message))


def message_list(table):
    """List of the sorts of messages.

    With how often each model raises it, and the number of each sort.
    """
    sorts = table[table["message"] != ""].groupby(
        table["message"].map(general), sort=False
    )
    lines = []
    for number, (_, part) in enumerate(sorts, start=1):
        by = part["model"].value_counts().reindex(MODELS).dropna()
        models = ", ".join(f"`{model}` {count:.0f}" for model, count in by.items())
        lines.append(f"{number}. {PLACE.sub('', part['message'].iloc[0])} ({models})")
    return "\n".join(lines), {
        sort: number for number, sort in enumerate(sorts.groups, start=1)
    }


def matrix(table, numbers):
    """Table of what each combination does in each situation."""
    rows = []
    for kind, of_kind in table.groupby("kind", sort=False):
        rows.append([f"**{kind}**", *[""] * len(MODELS)])
        for situation, part in of_kind.groupby("situation", sort=False):
            rows.append(
                [situation, *(_cell(row, numbers) for row in part.to_dict("records"))]
            )
    return Table(
        ["situation", *(name.replace(" + ", "<br>+ ") for name in MODELS)],
        rows,
        "l" * 9,
    )


def _cell(row, numbers):
    if row["message"]:
        shown = "n/a" if row["outcome"] == NOT_APPLICABLE else row["outcome"].upper()
        return f"{shown} ({numbers[general(row['message'])]})"
    if row["outcome"] in (RIGHT, UNPROVEN):
        return row["outcome"]
    parts = []
    for name, symbol in SYMBOLS.items():
        error = row[f"error_{name}"]
        if abs(error) > RIGHT_WITHIN:
            sign = (
                "" if name in ("force", "strip_work") else "+" if error > 0.0 else "-"
            )
            parts.append(f"{symbol} {sign}{100.0 * abs(error):.0f}")
    text = ", ".join(parts)
    return f"**{text}**" if row["outcome"] == WRONG else text


def main(arguments=None):
    """Write the report."""
    chosen = options(__file__, __doc__, arguments, from_csv=True)
    files = {
        name: chosen.out / f"where_methods_fail{name}.csv" for name in ("", "_steps")
    }
    if not chosen.from_csv:
        normals = sorted({normal for normal, _ in MODELS.values()})
        steps = pd.concat([wave_after_one_step(normal) for normal in normals])
        for name, values in (("", assess()), ("_steps", steps)):
            write_csv(values, files[name], "%.4g")
    table, steps = map(read_table, files.values())
    messages, numbers = message_list(table)
    blocks = [
        "## Which model for which scene",
        DECISION,
        decision_table(table),
        DECISION_NOTES,
        "## How it was measured",
        METHOD,
        count_table(table),
        "## What each model does in each situation",
        matrix(table, numbers),
        "## Wear steps within and beyond the limit of stability",
        *one_step_section(steps),
        "## Messages",
        messages,
    ]
    write_report(chosen.out, __file__, TITLE, blocks)


if __name__ == "__main__":
    main()
