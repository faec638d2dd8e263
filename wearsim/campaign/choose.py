"""Which contact models are good enough for a campaign: their wear increment against a half-space solution."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

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

SAMPLE = 10
"""Operating points that are solved with the reference, at most."""


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
) -> tuple[Evidence, ...]:
    """Compare the wear increments of models with that of a reference.

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

    Returns
    -------
    tuple of Evidence
        One for each candidate.

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
    found = []
    for models in candidates:
        try:
            answer = increment(models)
        except (ContactError, NumericalError) as error:
            found.append(Evidence(models, np.inf, np.inf, np.inf, str(error)))
            continue
        found.append(
            Evidence(
                models,
                _share(np.abs(answer.depth - truth.depth).max(), truth.depth.max()),
                _share(np.abs(answer.work - truth.work).sum(), truth.work.sum()),
                max(_share(abs(a - b), b) for a, b in zip(answer.power, truth.power, strict=True)),
            )
        )
    return tuple(found)


def _share(difference: float, whole: float) -> float:
    """Return the difference over the whole; 0 if there is neither."""
    if whole > 0.0:
        return float(difference / whole)
    return 0.0 if difference == 0.0 else float("inf")


def cheapest(evidence: Sequence[Evidence], tolerance: float) -> Evidence | None:
    """Return the first of the candidates, which come in the order of their cost, that keeps the tolerance.

    Parameters
    ----------
    evidence : sequence of Evidence
        From `judge`, by rising cost.
    tolerance : float
        On the depth error [-].

    Returns
    -------
    Evidence or None
        None if no candidate keeps it.
    """
    return next((one for one in evidence if one.depth_error <= tolerance), None)


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
