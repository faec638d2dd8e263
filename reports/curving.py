"""Vehicles in curves.

Whether the bogie is in balance, with how much force and moment left.

    python reports/curving.py [--jobs N] [--out DIR] [--from-csv]

writes curving.md and curving.csv, and curving_scans.csv if a combination has no
balance; some eight minutes of one core, and one more for each combination without
balance.
"""

import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context

import numpy as np
import pandas as pd
from scipy.optimize import least_squares
from writing import Table, options, write_csv, write_report

import wearsim
from wearsim.contact.problem import (
    ContactConditions,
    ContactModels,
    ContactSolution,
    Counterface,
    Wheelset,
)
from wearsim.contact.solve import solve_each
from wearsim.contact.wheels import joined
from wearsim.operation.bogie import Bogies, suspension
from wearsim.operation.controlled import Controlled
from wearsim.operation.resultants import resultants
from wearsim.operation.route import Curve
from wearsim.operation.states import StateError, settle
from wearsim.profile.placement import slope_of
from wearsim.profile.standard import shipped_path
from wearsim.scene.vehicle import VehicleFile
from wearsim.toml_faults import read_toml

TITLE = "Vehicles in curves: balance of the bogie"
VEHICLES = ("regional_multiple_unit", "passenger_coach", "freight_wagon", "locomotive")
PAIRS = (
    ("S1002", "60E1", "1:40"),
    ("S1002", "60E1", "1:20"),
    ("P8", "60E1", "1:40"),
    ("P8", "56E1", "1:20"),
    ("EPS", "60E1", "1:40"),
    ("EPS", "60E1", "1:20"),
    ("1in40", "60E1", "1:40"),
    ("S1002", "54E1", "1:20"),
)
RADII = (
    250,
    315,
    397,
    500,
    630,
    794,
    1000,
    1260,
    1587,
    2000,
    2520,
    3175,
    4000,
    5040,
    6350,
    8000,
)  # [m]
DEFICIENCY = 40.0  # [mm]
FURTHER_DEFICIENCIES = (
    60.0,
    80.0,
    100.0,
)  # of one vehicle on one pair of profiles [mm]
SPEED = 25.0  # [m/s]
FRICTION = 0.35
RADIUS = 0.46  # of the wheels [m]
MODELS = ("standard", "fast")
"""Pairs of contact models."""

TARGET = 1e-4
"""Residual of force and moment over the axle load, below which a bogie is in
balance.
"""
AXLES = ("leading", "trailing")
RESIDUALS = ("force_residual", "moment_residual", "roll_residual")
TARGETED = RESIDUALS[:2]  # what the target is for
OF_AXLE = ("shift_mm", "yaw_mrad", "share_beyond_jump", "wear_number_N")
SCANNED = (
    "scanned_axle",
    "cells_with_both_signs",
    "jumps",
    "force_step_kN",
    "moment_step_kN_m",
    "cause",
)
OF_GRID = ("shift_mm", "yaw_mrad", "force_N", "moment_N_m")
SCANS = "curving_scans.csv"
COLUMNS = (
    "model",
    "vehicle",
    "wheel",
    "rail",
    "inclination",
    "cant_deficiency_mm",
    "radius_m",
    "outcome",
    *(f"{axle}_{name}" for axle in AXLES for name in OF_AXLE),
    *RESIDUALS,
    *SCANNED,
)
BALANCED, AT_JUMP, REFUSED = "balanced", "at a jump", "refused"

NEIGHBOURS = 2  # radii from whose states the best state is looked for
DIFFERENCE = 1e-3  # for slopes: 1 um, 1 urad, a thousandth of the load
SHIFTS, SHIFT_STEP = 200, 1e-6  # of the scan [m]
YAWS, YAW_STEP = 20, 10e-6  # of the scan [rad]
PARTS = 10  # of a step of the shift, to tell a jump from a steep slope
THINNED = 10  # the table of the scans has one of so many shifts
CAUSES = {
    "search": (
        "the residuals of force and moment are zero together at a place without a "
        "jump: a balance exists, and the search does not find it"
    ),
    "jump": (
        "the force or the moment of the contact jumps where both residuals change "
        "sign: no position carries the forces, and the search does not find the pair "
        "of states on both sides of the jump"
    ),
    "none": (
        "the residuals of force and moment are nowhere zero together: no balance "
        "exists near the best state"
    ),
}

INTRODUCTION = f"""\
Four shipped vehicles on eight pairs of new profiles in {len(RADII)} curves to the right from {RADII[0]} to
{RADII[-1]} m: {{count}} combinations with {DEFICIENCY:g} mm of cant deficiency at {3.6 * SPEED:g} km/h,
friction {FRICTION:g}, wheel radius {1e3 * RADIUS:g} mm, each with the pairs of contact models `standard` and
`fast`. The search of every combination begins in the middle of the track. The residuals are computed apart
from the search: the contact is solved anew in the state that was found; its lateral force, yaw moment and
roll moment are added to those of suspension, inertia and axle boxes; the sums are divided by the axle load,
moments by the axle load at 1 m; and the larger value of both axles counts. Shifts are those at the height of
the rails. Where contact forces jump within a micrometre, the state nearest to balance is shown, or means over
both sides of the jump, weighted with their shares of the distance. The target is {TARGET:g}.
"""
"""With the number of combinations."""


@dataclass(frozen=True)
class Group:
    """One vehicle on one pair of profiles, in all curves of one cant deficiency."""

    vehicle: str
    wheel: str
    rail: str
    inclination: str
    deficiency: float = DEFICIENCY  # [mm]
    model: str = MODELS[0]  # pair of contact models

    @property
    def names(self):
        """Columns of the table that its rows have in common."""
        return {
            "model": self.model,
            "vehicle": self.vehicle,
            "wheel": self.wheel,
            "rail": self.rail,
            "inclination": self.inclination,
            "cant_deficiency_mm": self.deficiency,
        }


GROUPS = tuple(
    Group(*one, model=model)
    for model in MODELS
    for one in (
        *((vehicle, *pair) for pair in PAIRS for vehicle in VEHICLES),
        *((VEHICLES[0], *PAIRS[1], deficiency) for deficiency in FURTHER_DEFICIENCIES),
    )
)


@dataclass(frozen=True)
class Problem:
    """A bogie in each curve.

    Both axles of a bogie are operating points in turn, the leading one first.
    """

    conditions: ContactConditions
    controlled: Controlled
    wheelset: Wheelset
    counterface: Counterface
    models: ContactModels


def problem_of(group, radii):
    """Bogies of a group in curves to the right."""
    file, _ = read_toml(
        shipped_path("profiles", "vehicles", f"{group.vehicle}.toml"), VehicleFile
    )
    vehicle, curvature = file.vehicle, 1.0 / np.array(radii, dtype=float)
    acceleration = np.array(
        [Curve.of_deficiency(one, 1e-3 * group.deficiency) for one in curvature]
    )
    first, whole = 2 * np.arange(curvature.size), np.ones(2 * curvature.size)
    bogies = Bogies(vehicle, first, first + 1, acceleration, np.ones(curvature.size))
    conditions = ContactConditions.of(
        0.0 * whole,
        wheel_load=0.5 * vehicle.axle_load,
        friction=FRICTION,
        speed=SPEED,
        free_roll=True,
        shift_depth=RADIUS,
        track_curvature=np.repeat(curvature, 2),
        box_moment=np.repeat(vehicle.box_moment(acceleration, RADIUS), 2),
    )
    controlled = Controlled(np.nan * whole, bogies)
    wheelset = wearsim.wheelset(group.wheel, radius=RADIUS)
    counterface = wearsim.rails(group.rail, inclination=slope_of(group.inclination))
    models = ContactModels.of(group.model)
    return Problem(conditions, controlled, wheelset, counterface, models)


def settled(group, radii):
    """Radii of a group in which the bogie has a balance.

    Also the problem of these, and where the axles run.
    """
    problem = problem_of(group, radii)
    try:
        running = settle(
            problem.conditions,
            problem.controlled,
            problem.wheelset,
            problem.counterface,
            problem.models,
        )
    except StateError as error:
        refused = {point // 2 for point in error.messages}
        kept = [radius for k, radius in enumerate(radii) if k not in refused]
        return settled(group, kept) if kept else ([], None, None)
    return list(radii), problem, running


def contact_forces(problem, point, shift, yaw, load=None):
    """Resultants of the contact of operating points (k,), solved from nothing.

    Zero without contact.

    Under loads (k, 2), or those that balance the roll.
    """
    bodies = problem.wheelset, problem.counterface
    conditions = replace(problem.conditions.at(point), shift=shift, yaw=yaw)
    if load is not None:
        conditions = replace(conditions, wheel_load=load, box_moment=None)
    failed = {}
    patches = solve_each(
        conditions,
        *bodies,
        problem.models,
        ContactSolution.patches,
        failed=failed,
        fields="work",
    )
    return resultants(joined(patches), point.size)


def suspension_forces(problem, shift, yaw):
    """Lateral force [N], yaw moment [N m] (n, 2) of springs, inertia on axles (n,)."""
    bogies = problem.controlled.bogies
    state = np.stack([shift, yaw], axis=1).reshape(-1, 4)
    curvature = problem.conditions.track_curvature[bogies.leading]
    forces = suspension(
        bogies.vehicle, state, curvature, bogies.acceleration, bogies.in_front
    )
    return forces.reshape(-1, 2)


def of_axles(shift, forces):
    """Shifts (n,) of the axles themselves, of those at the height of the rails [m]."""
    return shift + RADIUS * np.sin(forces.roll)


def missing(problem, forces, shift, yaw):
    """Lateral force [N], yaw moment and roll moment [N m] (n, 3).

    What the balance of each axle lacks.
    """
    shift = of_axles(shift, forces)
    contact = np.stack([forces.force, forces.moment], axis=1)
    roll = forces.roll_moment.sum(axis=1) - problem.conditions.box_moment
    return np.column_stack([contact + suspension_forces(problem, shift, yaw), roll])


def found_rows(group, radii, problem, running):
    """Rows of the combinations in which the bogie has a balance."""
    count, beyond = running.shift.size, running.beyond
    point, share = np.arange(count), np.ones(count)
    shift, far = running.shift, np.full(count, np.nan)
    if beyond is not None:
        far[beyond.point] = beyond.share
        share[beyond.point] -= beyond.share
        point, share = np.append(point, beyond.point), np.append(share, beyond.share)
        shift = np.append(shift, beyond.shift)
    forces = contact_forces(problem, point, shift, running.yaw[point]).mean(
        point, share
    )
    place = np.bincount(point, share * shift)
    weight = problem.controlled.bogies.vehicle.axle_load
    residual = (
        np.abs(missing(problem, forces, place, running.yaw))
        .reshape(-1, 2, 3)
        .max(axis=1)
        / weight
    )
    values = np.column_stack(
        [1e3 * place, 1e3 * running.yaw, far, forces.power / SPEED]
    ).reshape(-1, 2, 4)
    for k, radius in enumerate(radii):
        row = {**group.names, "radius_m": radius}
        row["outcome"] = (
            AT_JUMP if np.isfinite(far[2 * k : 2 * k + 2]).any() else BALANCED
        )
        for axle, of_axle in zip(AXLES, values[k], strict=True):
            row |= {
                f"{axle}_{name}": value
                for name, value in zip(OF_AXLE, of_axle, strict=True)
            }
        yield row | dict(zip(RESIDUALS, residual[k], strict=True))


class OneBogie:
    """Residuals of the bogie of one combination near a state.

    A state (2, 3) has the shift at the height of the rails [mm] and the yaw [mrad] of
    both axles, and the load of their right wheels over half of the axle load [-].
    """

    def __init__(self, group, radius):
        self.problem = problem_of(group, [radius])
        self.weight = self.problem.controlled.bogies.vehicle.axle_load

    def residual(self, state):
        """Return what the balance lacks (6,), over the axle load; 1 without contact."""
        shift, yaw, part = state.reshape(2, 3).T
        shift, yaw, load = (
            1e-3 * shift,
            1e-3 * yaw,
            0.5 * self.weight * np.stack([part, 2.0 - part], axis=1),
        )
        forces = contact_forces(self.problem, np.arange(2), shift, yaw, load)
        if (forces.vertical == 0.0).any():
            return np.ones(6)
        return missing(self.problem, forces, shift, yaw).ravel() / self.weight

    def slope(self, state):
        """Differentiate the residual by the state (6, 6)."""
        base = self.residual(state)
        moved = [self.residual(state + DIFFERENCE * unit) - base for unit in np.eye(6)]
        return np.array(moved).T / DIFFERENCE

    def nearest(self, starts):
        """Best state that least squares lead to from any of the starts."""
        ends = [
            least_squares(self.residual, start.ravel(), self.slope, x_scale="jac")
            for start in starts
        ]
        return min(ends, key=lambda end: np.abs(end.fun).max()).x.reshape(2, 3)

    def residual_of_axle(self, state, axle, place):
        """Residuals (k, 2) of one axle at places (k, 2) of shift [m] and yaw [rad].

        The other axle stays as in the state; the wheel loads of each place balance the
        roll.
        """
        shift, yaw = place.T
        forces = contact_forces(self.problem, np.full(shift.size, axle), shift, yaw)
        touching = (forces.vertical > 0.0).all(axis=1)
        part = 0.5 * self.weight * state[:, 2]
        here = np.stack([part, self.weight - part], axis=1)
        still = 1e-3 * state[:, :2]
        still[:, 0] = of_axles(
            still[:, 0], contact_forces(self.problem, np.arange(2), *still.T, here)
        )
        springs = []
        for one_shift, one_yaw in zip(of_axles(shift, forces), yaw, strict=True):
            moved = still.copy()
            moved[axle] = one_shift, one_yaw
            springs.append(suspension_forces(self.problem, *moved.T)[axle])
        residual = np.stack([forces.force, forces.moment], axis=1) + np.array(springs)
        return np.where(touching[:, None], residual, np.nan)


def scan(bogie, state, axle, shifts=SHIFTS, yaws=YAWS):
    """Residuals of an axle on a grid around a state, and what they say of its balance.

    Returns
    -------
    tuple
        Columns of the row of the combination; places and residuals (shifts, yaws, 4) of
        the grid.
    """
    shift = 1e-3 * state[axle, 0] + SHIFT_STEP * (
        np.arange(shifts) - 0.5 * (shifts - 1)
    )
    yaw = 1e-3 * state[axle, 1] + YAW_STEP * (np.arange(yaws) - 0.5 * (yaws - 1))
    place = np.stack(np.meshgrid(shift, yaw, indexing="ij"), axis=-1)
    residual = bogie.residual_of_axle(state, axle, place.reshape(-1, 2)).reshape(
        place.shape
    )
    corners = np.stack(
        [residual[:-1, :-1], residual[1:, :-1], residual[:-1, 1:], residual[1:, 1:]]
    )
    with_both_signs = ((corners.min(axis=0) <= 0.0) & (corners.max(axis=0) >= 0.0)).all(
        axis=2
    )
    cells = np.argwhere(with_both_signs)
    jumps = np.array(
        [has_jump(bogie, state, axle, place[tuple(cell)]) for cell in cells], dtype=bool
    )
    roots = np.array([has_root(corners[:, i, j]) for i, j in cells], dtype=bool)
    cause = "search" if (roots & ~jumps).any() else "jump" if jumps.any() else "none"
    step = np.nanmax(np.abs(np.diff(residual, axis=0)), axis=(0, 1))
    row = {
        "scanned_axle": AXLES[axle],
        "cells_with_both_signs": len(cells),
        "jumps": int(jumps.sum()),
        "force_step_kN": 1e-3 * step[0],
        "moment_step_kN_m": 1e-3 * step[1],
        "cause": cause,
    }
    return row, np.concatenate([place, residual], axis=2)


def has_jump(bogie, state, axle, place):
    """Whether force or moment of an axle jumps in a step of the shift from a place."""
    parts = place + np.outer(np.linspace(0.0, SHIFT_STEP, PARTS + 1), [1.0, 0.0])
    change = np.abs(np.diff(bogie.residual_of_axle(state, axle, parts), axis=0))
    steepest = (change[1:] + change[:-1]).max(
        axis=0
    )  # of two parts: a jump may lie on the border of both
    return bool(
        (
            (steepest > 0.5 * change.sum(axis=0)) & (steepest > TARGET * bogie.weight)
        ).any()
    )


def has_root(corners):
    """Whether linear residuals (4, 2) vanish in a cell or just beside it.

    They are given at its corners and taken as linear between them.
    """
    by_shift = 0.5 * (corners[1] + corners[3] - corners[0] - corners[2])
    by_yaw = 0.5 * (corners[2] + corners[3] - corners[0] - corners[1])
    slope = np.stack([by_shift, by_yaw], axis=1)
    if np.linalg.det(slope) == 0.0:
        return False
    return bool(np.abs(np.linalg.solve(slope, corners.mean(axis=0))).max() <= 1.5)


def refused_row(group, radius, found):
    """Row of a combination without balance and rows of its scan, from rows found."""
    bogie = OneBogie(group, radius)
    nearest = sorted(found, key=lambda row: abs(np.log(row["radius_m"] / radius)))[
        :NEIGHBOURS
    ]
    starts = [
        np.array(
            [[row[f"{axle}_shift_mm"], row[f"{axle}_yaw_mrad"], 1.0] for axle in AXLES]
        )
        for row in nearest
    ]
    state = bogie.nearest(starts or [np.tile([0.0, 0.0, 1.0], (2, 1))])
    residual = np.abs(bogie.residual(state.ravel())).reshape(2, 3)
    axle = int(residual.max(axis=1).argmax())
    row, grid = scan(bogie, state, axle)
    row = {**group.names, "radius_m": radius, "outcome": REFUSED, **row}
    for name, (shift, yaw, _) in zip(AXLES, state, strict=True):
        row |= {f"{name}_shift_mm": shift, f"{name}_yaw_mrad": yaw}
    row |= dict(zip(RESIDUALS, residual.max(axis=0), strict=True))
    scale = [1e3, 1e3, 1.0, 1.0]
    rows = pd.DataFrame(scale * grid[::THINNED].reshape(-1, 4), columns=OF_GRID)
    return row, rows.assign(**group.names, radius_m=radius, axle=AXLES[axle])


def rows_of(group, radii=RADII):
    """Rows of the combinations of a group, and of scans of those without balance."""
    kept, problem, running = settled(group, radii)
    found = list(found_rows(group, kept, problem, running)) if kept else []
    refused = [
        refused_row(group, radius, found) for radius in radii if radius not in kept
    ]
    rows = sorted(
        [*found, *(row for row, _ in refused)], key=lambda row: row["radius_m"]
    )
    return pd.DataFrame(rows, columns=COLUMNS), [grid for _, grid in refused]


def read_rows(file):
    """Table of the report; names of profiles are texts, 60E1 is no number."""
    return pd.read_csv(file, dtype=dict.fromkeys(("wheel", "rail", "inclination"), str))


def cell_of(rows):
    """Text of a cell.

    Largest residual of force and moment, number of combinations at a jump and refused.
    """
    held = rows[rows["outcome"] != REFUSED]
    largest = held[list(TARGETED)].max(axis=None)
    parts = [] if held.empty else [f"{largest:.1e}"]
    counts = rows["outcome"].value_counts()
    return "; ".join(
        [
            *parts,
            *(
                f"{name}: {counts[name]}"
                for name in (AT_JUMP, REFUSED)
                if name in counts
            ),
        ]
    )


def tables(rows):
    """Tables by pair and vehicle, and of further cant deficiencies.

    For each model.
    """
    for model in MODELS:
        yield f"## Contact model `{model}`"
        own = rows[rows["model"] == model]
        yield summary(own)
        yield from tables_of_model(own)


def tables_of_model(rows):
    """Tables of the combinations with one pair of contact models."""
    usual = rows[rows["cant_deficiency_mm"] == DEFICIENCY]
    body = []
    for (wheel, rail, inclination), pair in usual.groupby(
        ["wheel", "rail", "inclination"], sort=False
    ):
        cells = [cell_of(pair[pair["vehicle"] == vehicle]) for vehicle in VEHICLES]
        body.append([f"{wheel}, {rail}, {inclination}", *cells])
    yield Table(
        [
            "wheel, rail, inclination",
            *(vehicle.replace("_", " ") for vehicle in VEHICLES),
        ],
        body,
        "lllll",
        (
            f"Largest residual of force and moment of {len(RADII)} radii; "
            "combinations at a jump and refused."
        ),
    )
    first = GROUPS[-1]
    same = rows[
        (rows["vehicle"] == first.vehicle)
        & (rows["wheel"] == first.wheel)
        & (rows["rail"] == first.rail)
        & (rows["inclination"] == first.inclination)
    ]
    by_deficiency = same.groupby("cant_deficiency_mm")
    vehicle = first.vehicle.replace("_", " ")
    yield Table(
        [f"{deficiency:g} mm" for deficiency, _ in by_deficiency],
        [[cell_of(some) for _, some in by_deficiency]],
        "llll",
        (
            f"The same by cant deficiency: {vehicle}, {first.wheel} on {first.rail} "
            f"{first.inclination}."
        ),
    )


def summary(rows):
    """Paragraph with the counts and the largest residuals of the combinations."""
    held = rows[rows["outcome"] != REFUSED]
    counts = rows["outcome"].value_counts()
    at_jump, refused = (int(counts.get(name, 0)) for name in (AT_JUMP, REFUSED))
    force, moment, roll = held[list(RESIDUALS)].max()
    away = held.loc[held["outcome"] == BALANCED, "roll_residual"].max()
    missed = int((held[list(TARGETED)] > TARGET).any(axis=1).sum())
    return (
        f"Of all {len(rows)} combinations, with those of further cant deficiencies, "
        f"{len(held)} have a balance, {at_jump} of them with an axle at a jump of the "
        f"contact, and {refused} are refused. The largest residual over the axle load "
        f"is {force:.1e} of the lateral force and {moment:.1e} of the yaw moment. "
        f"That of the roll moment is {away:.1e} without the axles at a jump and "
        f"{roll:.1e} with them. The target is missed by {missed} of them."
    )


def refusals(rows):
    """Section on the combinations without balance."""
    refused = rows[rows["outcome"] == REFUSED]
    if refused.empty:
        return ["None is refused."]
    body = [
        [
            (
                f"{row['vehicle'].replace('_', ' ')}, {row['wheel']} on {row['rail']} "
                f"{row['inclination']}"
            ),
            f"{row['radius_m']:g}",
            f"{row['cant_deficiency_mm']:g}",
            f"{row['force_residual']:.1e}, {row['moment_residual']:.1e}",
            row["scanned_axle"],
            f"{row['cells_with_both_signs']:.0f}",
            f"{row['jumps']:.0f}",
            f"{row['force_step_kN']:.3g}",
            f"{row['moment_step_kN_m']:.3g}",
            row["cause"],
        ]
        for row in refused.to_dict("records")
    ]
    head = [
        "combination",
        "R [m]",
        "cant deficiency [mm]",
        "force, moment",
        "axle",
        "cells",
        "with a jump",
        "force [kN]",
        "moment [kN m]",
        "cause",
    ]
    caption = (
        "Smallest residuals of force and moment; cells of the grid in which both "
        "change sign; largest changes of force and moment by a step of the shift."
    )
    causes = [
        f"- {name}: {text}."
        for name, text in CAUSES.items()
        if name in set(refused["cause"])
    ]
    return [
        f"Least squares from the balances of the {NEIGHBOURS} nearest radii lead to "
        f"the state with the smallest residuals. Around it {SHIFTS} x {YAWS} "
        f"positions of the axle with the larger residual, {1e6 * SHIFT_STEP:g} µm and "
        f"{1e6 * YAW_STEP:g} µrad apart, are solved, each with wheel loads that "
        "balance the roll, while the other axle stays. A change by a step of the "
        "shift is a jump if more than half of it lies within "
        f"{2e6 * SHIFT_STEP / PARTS:g} µm.",
        Table(head, body, "lrrrlrrrrl", caption),
        "\n".join(causes),
        f"Every {THINNED}th shift of the grids: [{SCANS}]({SCANS}).",
    ]


def main(arguments=None):
    """Compute or read the rows, and write the report."""
    more = {
        "jobs": {
            "type": int,
            "default": os.cpu_count(),
            "metavar": "N",
            "help": "processes (default: cores)",
        }
    }
    chosen = options(__file__, __doc__, arguments, from_csv=True, more=more)
    file, scans = chosen.out / "curving.csv", chosen.out / SCANS
    if not chosen.from_csv:
        with ProcessPoolExecutor(chosen.jobs, mp_context=get_context("spawn")) as pool:
            found = list(pool.map(rows_of, GROUPS))
        write_csv(pd.concat([rows for rows, _ in found]), file)
        grids = [grid for _, of_group in found for grid in of_group]
        scans.unlink(missing_ok=True)
        if grids:
            write_csv(pd.concat(grids), scans)
    rows = read_rows(file)
    usual = rows[rows["cant_deficiency_mm"] == DEFICIENCY]
    count = len(usual) // len(MODELS)
    blocks = [
        INTRODUCTION.format(count=count),
        *tables(rows),
        "## Combinations without balance",
        *refusals(rows),
        "All values: [curving.csv](curving.csv).",
    ]
    write_report(chosen.out, __file__, TITLE, blocks)


if __name__ == "__main__":
    main()
