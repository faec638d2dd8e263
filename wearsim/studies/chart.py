"""Speed against accuracy: time per solution and error of the wear increment of every model and grid."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import product

import numpy as np
import pandas as pd

from wearsim.campaign import choose
from wearsim.campaign.choose import CLASSES, judge
from wearsim.campaign.evaluate import setup_of, solve_passage
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.campaign.state import State
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import ContactModels
from wearsim.contact.solve import CHUNK
from wearsim.contact.tangential import TANGENTIAL_MODELS
from wearsim.operation.points import OperatingPoints, select
from wearsim.results.checks import percent
from wearsim.scene import CampaignSetup

POINTS = 40
"""Operating points that stand for each scene, at most: all of a shipped one that act."""

MODEL = ["normal", "tangential", "grid"]
"""What tells combinations apart."""

ERRORS = ["depth_error", "work_error", "power_error"]

_ENOUGH = 0.5  # seconds of repeats after which a time is taken as known
_MOST_REPEATS = 40
_FAST = 0.05  # seconds of a batch below which the overhead of calls would count


def combinations(base: ContactModels, grids: Sequence[int]) -> tuple[ContactModels, ...]:
    """Every registered normal model with every tangential one, on every grid, with the material of `base`."""
    return tuple(
        replace(base, normal=normal, tangential=tangential, strips=grid, cells=grid, most_cells=grid)
        for normal, tangential, grid in product(sorted(NORMAL_MODELS), sorted(TANGENTIAL_MODELS), grids)
    )


def speed_and_accuracy(
    setups: Sequence[CampaignSetup],
    grids: Sequence[int],
    reference_grid: int,
    *,
    points: int = POINTS,
    report: Callable[[str], None] | None = None,
) -> pd.DataFrame:
    """Time every combination of models and compare its wear increment on new profiles.

    Parameters
    ----------
    setups : sequence of CampaignSetup
        Scenes: their operating points, wear law and smoothing count.
    grids : sequence of int
        Strips, and cells along each strip.
    reference_grid : int
        Of the half-space solution that all are compared with.
    points : int
        Largest number of operating points for each scene, but at least one of each class of them.
    report : callable
        Takes a line of progress for each combination.

    Returns
    -------
    DataFrame
        A row for each scene and combination: names, time per solution of one wheel at one operating point on
        one thread (mean over the scenes) [s], errors of the depth, the strip work and the power over their
        largest [-], whether it lies on the Pareto front of time, largest depth error and largest strip-work
        error of the scenes (`pareto_depth`: without the last). Where a combination does not solve a point of
        a scene its values are missing, with the message in `refusal`; `attrs` names the reference.

    Raises
    ------
    ContactError, NumericalError
        If the reference does not solve a scene.
    """
    rows = []
    for setup in setups:
        state, _ = WheelsetEvolution(replace(setup, tolerance=None)).start()
        few = np.count_nonzero(setup.points.weight) <= points
        chosen = choose.sample_of(setup, state, points if few else max(points // len(CLASSES), 1)).points
        truth = replace(
            setup.models, normal="half_space", tangential="half_space", strips=reference_grid,
            cells=reference_grid, most_cells=reference_grid,
        )  # fmt: skip
        evidence = judge(
            combinations(setup.models, grids), truth, state, chosen, setup_of(setup),
            smoothing_wavelength=setup.control.smoothing_wavelength,
        )  # fmt: skip
        for one in evidence:
            models, known = one.models, not one.message
            seconds = time_per_solution(setup, state, chosen, models) if known else np.nan
            rows.append(
                {
                    "scene": setup.title or setup.kind,
                    "normal": models.normal,
                    "tangential": models.tangential,
                    "grid": models.strips,
                    "time": seconds,
                    **{name: getattr(one, name) if known else np.nan for name in ERRORS},
                    "can_update_profile": NORMAL_MODELS[models.normal].can_update_profile,
                    "refusal": one.message,
                }
            )
            if known and report is not None:
                report(
                    f"{setup.kind}: {models.normal} + {models.tangential}, {models.strips}: "
                    f"{1e3 * seconds:.3g} ms, depth error {percent(one.depth_error)}"
                )
    table = pd.DataFrame(rows)
    by_model = table.groupby(MODEL, sort=False)
    # NaN where a scene is not solved
    table["time"] = by_model["time"].transform("mean", skipna=False)
    worst = worst_scene(table)
    for name, errors in (("pareto", ["depth_error", "work_error"]), ("pareto_depth", ["depth_error"])):
        front = pareto(worst["time"].to_numpy(), *(worst[error].to_numpy() for error in errors))
        table[name] = np.resize(front, len(table))  # of each scene the same models in the same order
    table.attrs["reference"] = f"half_space + half_space, {reference_grid} x {reference_grid}"
    return table


def worst_scene(table: pd.DataFrame) -> pd.DataFrame:
    """Time and largest errors of each combination in any scene, NaN where it does not solve one of them."""
    by_model = table.groupby(MODEL, sort=False)[["time", *ERRORS]]
    return by_model.max(skipna=False).reset_index()


def time_per_solution(
    setup: CampaignSetup, state: State, points: OperatingPoints, models: ContactModels
) -> float:
    """Shortest of several wall times of a batch over the number of solutions, on one thread [s].

    Fast models get their points several times over, in a batch as campaigns with many points have it.
    """
    best, spent, batch = np.inf, 0.0, points
    for repeat in range(_MOST_REPEATS):
        start = time.perf_counter()
        solve_passage(state, batch, replace(setup_of(setup), models=models))
        took = time.perf_counter() - start
        spent += took
        if repeat == 0 and took < _FAST:
            batch = select(points, np.resize(np.arange(len(points.label)), CHUNK))
            continue
        best = min(best, took / (2 * len(batch.label)))
        if spent > _ENOUGH:
            break
    return best


def pareto(cost: FloatArray, *errors: FloatArray) -> np.ndarray:
    """Return which combinations no other beats in cost and all errors, of (n,) arrays; NaN never does.

    Returns
    -------
    (n,) bool array
        True where no other is at most as dear and at most as wrong in every way, and better in one.
    """
    values = np.stack([cost, *errors])
    known = np.all(np.isfinite(values), axis=0)
    one, other = values[:, :, np.newaxis], values[:, np.newaxis, :]
    beats = np.all(one <= other, axis=0) & np.any(one < other, axis=0) & known[:, np.newaxis]
    return np.asarray(known & ~np.any(beats, axis=0))
