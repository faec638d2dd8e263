"""Which contact models are good enough for a campaign: their wear increment against a half-space solution."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from wearsim.campaign.rate import accumulate, select, solve_contact
from wearsim.campaign.smoothing import smooth
from wearsim.campaign.state import State
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import ContactModels, Counterface, Wheelset
from wearsim.damage.wear import WearSettings
from wearsim.errors import ContactError, NumericalError
from wearsim.operation.points import OperatingPoints
from wearsim.profile.shape import arc_length, vertex_lengths

if TYPE_CHECKING:
    from wearsim.scene import CampaignSetup

SAMPLE = 10
"""Operating points that are solved with the reference, at most."""

MARGIN = 0.8
"""Share of the tolerance that the error on a sample may take; the rest is for the points that it leaves out.
On 24 made-up collectives the error on all points was up to 1.25 times that on the sample, if it was large."""

REFERENCE_GRID = 40
"""Strips, and cells along each, of the half-space solution that judges."""

COST_ORDER = (
    ("kik_piotrowski", "fastsim", 20),
    ("knothe_le_the", "fastsim", 30),
    ("knothe_le_the", "fastsim", 50),
    ("half_space", "fastsim", 20),
    ("half_space", "fastsim", 40),
    ("half_space", "half_space", 20),
    ("half_space", "half_space", 30),
    ("half_space", "half_space", REFERENCE_GRID),
)
"""Normal model, tangential model and grid by rising time per solution in reports/speed_accuracy.md, without
those that another is both faster and closer than. The last one is the reference: it is always good enough."""

CHECKS = (0.25, 0.5, 0.75)
"""Shares of a campaign's distance at which the choice is looked at again."""


@dataclass(frozen=True)
class Evidence:
    """How well one combination of models does on a sample of operating points.

    Parameters
    ----------
    models : ContactModels
        The combination and its grid.
    depth_error : float
        Largest difference of the smoothed wear increment over the profiles of both wheels from that of
        the reference, over the reference's largest depth [-]; inf where it refuses.
    work_error : float
        Integral of the absolute difference of the strip work over that of the reference's [-].
    power_error : float
        Largest relative error of the frictional power of both wheels at an operating point [-].
    refusal : str
        Why it gives no answer; empty if it does.
    """

    models: ContactModels
    depth_error: float
    work_error: float
    power_error: float
    refusal: str = ""


@dataclass(frozen=True)
class _Increment:
    depth: FloatArray  # (2, n) after smoothing, per metre
    work: FloatArray  # (2, n) of strip work times length
    power: FloatArray  # (k,) of both wheels at each point


def sample(work: FloatArray, weight: FloatArray, count: int = SAMPLE) -> IntArray:
    """Operating points that stand for a load collective.

    Parameters
    ----------
    work : (n,) array
        Frictional work of each point per distance, by any model, of both wheels [J/m].
    weight : (n,) array
        Shares of the distance.
    count : int
        Of points to take.

    Returns
    -------
    (k,) int array
        All that act if they are at most `count`; else those at equal steps of the sorted, weighted work
        summed up, so that every part of the work is stood for by a point of its size. Rising.
    """
    acting = np.flatnonzero(weight > 0.0)
    if acting.size <= count:
        return acting
    share = (work * weight)[acting]
    order = np.argsort(share, kind="stable")
    summed = np.cumsum(share[order])
    total = summed[-1]
    if total <= 0.0:
        return acting[np.linspace(0, acting.size - 1, count).astype(np.int64)]
    steps = (np.arange(count) + 0.5) / count * total
    chosen: IntArray = np.unique(acting[order[np.searchsorted(summed, steps)]])
    return chosen


def judge(
    candidates: Sequence[ContactModels],
    reference: ContactModels,
    state: State,
    points: OperatingPoints,
    wheelset: Wheelset,
    counterface: Counterface,
    wear: WearSettings,
    *,
    smoothing_wavelength: float,
    threads: int = 1,
) -> Iterator[Evidence]:
    """Compare the wear increments of models with that of a reference, one after the other as asked for.

    Parameters
    ----------
    candidates : sequence of ContactModels
        What to judge.
    reference : ContactModels
        What they are judged by.
    state : State
        Profiles of both wheels.
    points : OperatingPoints
        The sample; its weights count.
    wheelset, counterface, wear
        What runs on what, by which wear law.
    smoothing_wavelength : float
        Of the increment, as in the campaign [m].
    threads : int
        They do not change the bits of the result.

    Yields
    ------
    Evidence
        Of each candidate, in their order.

    Raises
    ------
    ContactError, NumericalError
        If the reference does not solve a point.
    """

    def increment(models: ContactModels) -> _Increment:
        solution = solve_contact(state, points, wheelset, counterface, models, threads=threads)
        rate = accumulate(solution, points, points.weight, state, wheelset, wear)
        depth = np.empty_like(state.y)
        work = np.empty_like(state.y)
        for wheel in (0, 1):
            y, z = state.y[wheel], state.z[wheel]
            length = vertex_lengths(y, z)
            total = rate.regime_depth[wheel].sum(axis=0)
            depth[wheel] = smooth(arc_length(y, z), total, length, smoothing_wavelength)
            work[wheel] = rate.friction_work[wheel] * length
        power = np.zeros(len(points.label))
        np.add.at(power, solution.point, solution.power)
        return _Increment(depth, work, power)

    truth = increment(reference)
    for models in candidates:
        try:
            answer = truth if models == reference else increment(models)
        except (ContactError, NumericalError) as error:
            yield Evidence(models, np.inf, np.inf, np.inf, str(error))
            continue
        yield Evidence(
            models,
            _share(np.abs(answer.depth - truth.depth).max(), truth.depth.max()),
            _share(np.abs(answer.work - truth.work).sum(), truth.work.sum()),
            max(_share(abs(a - b), b) for a, b in zip(answer.power, truth.power, strict=True)),
        )


def _share(difference: float, whole: float) -> float:
    """Return the difference over the whole; 0 if there is neither."""
    if whole > 0.0:
        return float(difference / whole)
    return 0.0 if difference == 0.0 else float("inf")


def weighted(points: OperatingPoints, index: IntArray) -> OperatingPoints:
    """Operating points of a sample with weights that add up to 1.

    Parameters
    ----------
    points : OperatingPoints
        All of them.
    index : (k,) int array
        From `sample`.

    Returns
    -------
    OperatingPoints
        Those at `index`.
    """
    chosen = select(points, index)
    return replace(chosen, weight=chosen.weight / chosen.weight.sum())


def sample_of(setup: CampaignSetup, state: State, count: int = SAMPLE) -> OperatingPoints:
    """Operating points that stand for the collective of a campaign, by the work that a fast model finds.

    Parameters
    ----------
    setup : CampaignSetup
        The campaign.
    state : State
        Profiles of both wheels.
    count : int
        Operating points, at most.

    Returns
    -------
    OperatingPoints
        Their weights add up to 1.
    """
    fast = _models(setup.models, COST_ORDER[0])
    solution = solve_contact(state, setup.points, setup.wheelset, setup.counterface, fast)
    work = np.zeros(len(setup.points.label))
    np.add.at(work, solution.point, solution.power / setup.points.conditions.speed[solution.point])
    return weighted(setup.points, sample(work, setup.points.weight, count))


def candidates(base: ContactModels) -> tuple[ContactModels, ...]:
    """Return the combinations that may be chosen, by rising cost.

    Parameters
    ----------
    base : ContactModels
        Material and parameters.

    Returns
    -------
    tuple of ContactModels
        As of `COST_ORDER`; the last one is the reference.
    """
    return tuple(_models(base, one) for one in COST_ORDER)


def choice(setup: CampaignSetup, state: State, *, threads: int = 1) -> tuple[Evidence, ...]:
    """Look for the cheapest contact models whose wear increment keeps the tolerance of a campaign.

    Parameters
    ----------
    setup : CampaignSetup
        With a tolerance.
    state : State
        Profiles of both wheels.
    threads : int
        They do not change the bits of the result.

    Returns
    -------
    tuple of Evidence
        Of the candidates by rising cost; the last one is chosen. On a sample it keeps `MARGIN` times the
        tolerance.

    Raises
    ------
    ContactError, NumericalError
        If the reference does not solve a point.
    """
    assert setup.tolerance is not None  # the models are given otherwise
    models = candidates(setup.models)
    points = sample_of(setup, state)
    whole = len(points.label) == np.count_nonzero(setup.points.weight)
    bound = setup.tolerance if whole else MARGIN * setup.tolerance
    evidence = []
    for one in judge(
        models,
        models[-1],
        state,
        points,
        setup.wheelset,
        setup.counterface,
        setup.wear,
        smoothing_wavelength=setup.control.smoothing_wavelength,
        threads=threads,
    ):
        evidence.append(one)
        if one.depth_error <= bound:
            break
    return tuple(evidence)


def named(models: ContactModels) -> str:
    """Name a combination of models with its grid.

    Parameters
    ----------
    models : ContactModels
        Any.

    Returns
    -------
    str
        Normal model, tangential model, strips x cells.
    """
    return f"{models.normal} + {models.tangential}, {models.strips} x {models.cells}"


def _models(base: ContactModels, one: tuple[str, str, int]) -> ContactModels:
    normal, tangential, grid = one
    return replace(base, normal=normal, tangential=tangential, strips=grid, cells=grid)
