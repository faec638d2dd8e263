"""Speed against accuracy.

Time and error of short campaigns by every combination of contact models.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
import pandas as pd
from scipy.interpolate import PchipInterpolator

from wearsim.campaign.control import reached
from wearsim.campaign.evaluate import setup_of, solve_passage
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.campaign.state import State
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import PAIRS
from wearsim.contact.solve import CHUNK
from wearsim.contact.tangential import TANGENTIAL_MODELS
from wearsim.errors import WearsimError
from wearsim.operation.points import select
from wearsim.results.checks import percent
from wearsim.scene import CampaignSetup

DEPTH = 60e-6
"""Largest wear depth at the end of the campaigns [m]."""

# of the campaign with which all are compared: a scene's tolerance of steps over its
# own, its fewest steps
_FINER, _STEPS = 8.0, 20

_ERROR = 1.0 / 250.0  # of a step over the depth of the campaign, at most

_PLACES = 10  # of a campaign, at which depths are compared
_SAME = 1e-9  # of a distance, within which ends of steps are the same
_ENOUGH = 0.5  # seconds of repeats after which a time is taken as known
_MOST_REPEATS = 40
_FAST = 0.05  # seconds of a batch below which the overhead of calls would count


@dataclass(frozen=True)
class Run:
    """A campaign without files."""

    distance: FloatArray  # (k,) of each step [m]
    depth: FloatArray  # (k, 2, n) [m]
    state: State  # the last one
    seconds: float  # CPU time
    solved: int  # operating points in the stages of all steps
    programme: bool  # of blocks

    def differences(self, reference: Run) -> tuple[FloatArray, FloatArray]:
        """Largest depth difference and largest depth (k,) [m], the end last.

        Ten places of a collective. In a programme the ends of steps that both campaigns
        have: between them one may be halfway through a step over whole loops where the
        other is in a block, and depths interpolated there differ whatever the contact.
        """
        places = np.linspace(0.0, reference.distance[-1], _PLACES + 1)[1:]
        if self.programme:
            both = np.isclose(
                reference.distance[:, None], self.distance, rtol=_SAME, atol=0.0
            ).any(axis=1)
            places = reference.distance[both & (reference.distance > 0.0)]
        depth, reference_depth = (
            PchipInterpolator(run.distance, run.depth)(places)
            for run in (self, reference)
        )
        return np.abs(depth - reference_depth).max(axis=(1, 2)), reference_depth.max(
            axis=(1, 2)
        )

    def error_from(self, reference: Run) -> float:
        """Largest of the differences over the largest depth at the end [-]."""
        difference, depth = self.differences(reference)
        return float(difference.max() / depth[-1])


def run_short(setup: CampaignSetup, depth: float = np.inf) -> Run:
    """Run a campaign on one thread to its end.

    Or to the end of the step that reaches a depth [m].
    """
    evolution, began, solved = WheelsetEvolution(setup), time.process_time(), 0
    state, taken = evolution.start()
    states = [state]
    while (
        not reached(state.distance, evolution.target) and state.wear_depth.max() < depth
    ):
        state, taken = evolution.advance(state, evolution.evaluate(state, taken))
        states.append(state)
        solved += taken.stages * int(np.count_nonzero(state.active_weight))
    seconds = time.process_time() - began
    return Run(
        np.array([state.distance for state in states]),
        np.array([state.wear_depth for state in states]),
        state,
        seconds,
        solved,
        bool(setup.points.block_length.any()),
    )


def combinations(setup: CampaignSetup) -> Iterator[tuple[str, CampaignSetup]]:
    """Name and setup of every registered combination of models that wears a profile."""
    for normal, tangential in product(sorted(NORMAL_MODELS), sorted(TANGENTIAL_MODELS)):
        if NORMAL_MODELS[normal].can_update_profile:
            models = replace(setup.models, normal=normal, tangential=tangential)
            yield f"{normal} + {tangential}", replace(setup, models=models)


def speed_and_accuracy(
    setups: Sequence[CampaignSetup],
    depth: float = DEPTH,
    *,
    report: Callable[[str], None] | None = None,
) -> pd.DataFrame:
    """Time short campaigns by every combination of models and compare their depths.

    Parameters
    ----------
    setups : sequence of CampaignSetup
        Scenes.
    depth : float
        Largest depth at the end of the campaign by the half-space at every point, in
        finer steps, with which the others are compared over the same distance [m].
    report : callable
        Takes a line of progress for each combination.

    Returns
    -------
    DataFrame
        A row for each scene and combination: CPU time of the campaign and its ratio to
        that of the half-space, time per solution of one wheel at one operating point on
        the new profiles [s], steps, largest difference of depth over the largest
        depth [-], whether no other is both faster and nearer. Missing where a
        combination does not solve the scene, with the message in `refusal`.

    Raises
    ------
    ContactError, NumericalError
        If the half-space does not solve a scene.
    """
    rows = []
    for setup in setups:
        setup = replace(
            setup,
            control=replace(setup.control, reprofiling=None, limits=()),
            templates=None,
        )
        normal, tangential = PAIRS["accurate"]
        models = replace(setup.models, normal=normal, tangential=tangential)
        accurate = replace(setup, models=models)
        # of a short campaign the error of steps is the same share of the depth as that
        # of a long one
        control = replace(
            setup.control,
            error_tolerance=min(setup.control.error_tolerance, _ERROR * depth),
        )
        finer = control.error_tolerance / _FINER
        fine = replace(
            control,
            error_tolerance=finer,
            depth_cap=min(control.depth_cap, depth / _STEPS),
        )
        reference = run_short(replace(accurate, control=fine), depth)
        control = replace(control, distance=float(reference.distance[-1]))
        given = run_short(replace(accurate, control=control))
        for name, combination in combinations(replace(setup, control=control)):
            row: dict[str, Any] = {
                "scene": setup.title or setup.kind,
                "models": name,
                "refusal": "",
            }
            try:
                ran = given if combination.models == models else run_short(combination)
                row |= {
                    "time_per_solution": time_per_solution(combination),
                    "time": ran.seconds,
                    "time_ratio": ran.seconds / given.seconds,
                    "steps": ran.state.step,
                    "depth_error": ran.error_from(reference),
                }
            except WearsimError as error:
                row["refusal"] = str(error)
            rows.append(row)
            if report is not None and not row["refusal"]:
                report(
                    f"{setup.kind}: {name}: {row['time']:.3g} s, depth error "
                    f"{percent(row['depth_error'])}"
                )
    table = pd.DataFrame(rows)
    of_scene = [
        group.index[pareto(*group[["time", "depth_error"]].to_numpy().T)]
        for _, group in table.groupby("scene", sort=False)
    ]
    table["pareto"] = table.index.isin(np.concatenate(of_scene))
    return table


def time_per_solution(setup: CampaignSetup) -> float:
    """Shortest of CPU times of a batch over the solutions, on one thread [s].

    Fast models get their points several times over, in a batch as campaigns with many
    points have it.
    """
    state, _ = WheelsetEvolution(setup).start()
    acting = np.flatnonzero(setup.points.weight)
    best, spent, batch = np.inf, 0.0, select(setup.points, acting)
    for _ in range(_MOST_REPEATS):
        start = time.process_time()
        solve_passage(replace(state, points=None), batch, setup_of(setup))
        took = time.process_time() - start
        spent += took
        count = len(batch.label)
        if took < _FAST and count < CHUNK:
            more = min(CHUNK, int(np.ceil(2.0 * count * _FAST / took)))
            batch = select(setup.points, np.resize(acting, more))
            continue
        best = min(best, took / (2 * count))
        if spent > _ENOUGH:
            break
    return best


def pareto(cost: FloatArray, *errors: FloatArray) -> np.ndarray:
    """Return which combinations no other beats in cost and all errors, of (n,) arrays.

    NaN never does.

    Returns
    -------
    (n,) bool array
        True where no other is at most as dear and at most as wrong in every way, and
        better in one.
    """
    values = np.stack([cost, *errors])
    finite = np.all(np.isfinite(values), axis=0)
    first, second = values[:, :, np.newaxis], values[:, np.newaxis, :]
    beats = (
        np.all(first <= second, axis=0)
        & np.any(first < second, axis=0)
        & finite[:, np.newaxis]
    )
    return np.asarray(finite & ~np.any(beats, axis=0))
