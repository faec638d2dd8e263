"""Cheapest contact models that keep the tolerance of a campaign."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil, inf, isfinite
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from wearsim.campaign.comparison import ComparisonLaws
from wearsim.campaign.evaluate import ModelsByPoint, Setup, accumulate, setup_of, solve_passage
from wearsim.campaign.left_out import new_history
from wearsim.campaign.state import Choice, State
from wearsim.campaign.vertices import lengths_of_sides, smooth_sides
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import ContactModels, ContactPatches
from wearsim.errors import ContactError, NumericalError
from wearsim.operation.left_out import mask_of
from wearsim.operation.points import OperatingPoints, select
from wearsim.results import FILL_FLOAT

if TYPE_CHECKING:
    from wearsim.scene import CampaignSetup

LEAST_SAMPLE = 2
"""Least number of operating points of each class that are solved with the reference."""

MARGIN = 0.8
"""Share of the tolerance allowed to the error on a sample; the rest is for the other points."""

REFERENCE_GRID = 40
"""Strips, and cells along each, of the reference, a half-space solution."""

COST_ORDER = (
    ("kik_piotrowski", "fastsim", 20, 1.0),
    ("knothe_le_the", "fastsim", 20, 3.0),
    ("knothe_le_the", "fastsim", 30, 3.1),
    ("knothe_le_the", "half_space", 20, 32.0),
    ("half_space", "fastsim", 30, 43.0),
    ("half_space", "half_space", 20, 57.0),
    ("knothe_le_the", "half_space", 30, 72.0),
    ("half_space", "half_space", 30, 100.0),
    ("half_space", "half_space", REFERENCE_GRID, 160.0),
)
"""Normal model, tangential model, grid and relative time per solution (reports/speed_accuracy.md), by rising
cost. The last one is the reference."""

BRIDGES = (2, 4)
"""Indices in `COST_ORDER` of the fast models for all points; the second where the first is not applicable."""

CHECKS = (0.25, 0.5, 0.75)
"""Shares of the distance of a campaign at which the models are chosen again."""


@dataclass(frozen=True)
class Sample:
    """Sample of the operating points of a collective."""

    points: OperatingPoints  # the k points; their weights carry the work of all
    index: IntArray  # (k,) in the collective
    point_class: IntArray  # (n,) class of every point of the collective; each has a point in the sample


@dataclass(frozen=True)
class Verdict:
    """Contact models that keep the tolerance of a campaign, and the evidence."""

    # on one candidate for all points each, by rising cost; the last one keeps the tolerance
    evidence: tuple[Evidence[ContactModels], ...]
    choice: Choice  # models of the classes
    points: tuple[int, ...]  # number of operating points of each class
    cost: float  # mean relative cost of a solution by the choice


def sample_size(tolerance: float) -> int:
    """Return the number of operating points of each class solved with the reference.

    Each stands for a share of the work of about the tolerance of the wear increment [-].
    """
    return max(LEAST_SAMPLE, ceil(1.0 / (len(CLASSES) * tolerance)))


def sample(
    work: FloatArray, weight: FloatArray, point_class: IntArray, count: int
) -> tuple[IntArray, FloatArray]:
    """Sample of the operating points of a load collective.

    Parameters
    ----------
    work : (n,) array
        Frictional work of each point per distance, both wheels [J/m].
    weight : (n,) array
        Shares of the distance.
    point_class : (n,) int array
        Class of each point; each class is sampled for itself.
    count : int
        Number of points of each class.

    Returns
    -------
    (k,) int array
        Of each class all acting points if they are at most `count`, otherwise those at equal steps of the
        cumulated, sorted, weighted work. Rising.
    (k,) array
        Their weights, which carry the work of the parts they stand for.
    """
    own = np.zeros(work.size)
    for one in np.unique(point_class):
        acting = np.flatnonzero((point_class == one) & (weight > 0.0))
        share = (work * weight)[acting]
        if acting.size <= count:
            own[acting] = weight[acting]
            continue
        if share.sum() <= 0.0:
            taken = acting[np.unique(np.linspace(0, acting.size - 1, count).astype(np.int64))]
            own[taken] = weight[acting].sum() / taken.size
            continue
        order = np.argsort(share, kind="stable")
        summed = np.cumsum(share[order])
        steps = (np.arange(count) + 0.5) / count * summed[-1]
        place, times = np.unique(order[np.searchsorted(summed, steps)], return_counts=True)
        own[acting[place]] = weight[acting[place]] * times / share[place] * summed[-1] / count
    chosen = np.flatnonzero(own)
    return chosen, own[chosen]


def sample_of(setup: CampaignSetup, state: State, count: int) -> Sample:
    """Sample at most `count` operating points of each class, by the frictional work of a fast model.

    Classes without acting points join the next one, or the last one.
    """
    points = setup.points
    solution = _first_solution(setup, replace(state, points=None))
    work = np.zeros(len(points.label))
    np.add.at(work, solution.point, solution.power / points.conditions.speed[solution.point])
    work *= points.environment
    own = point_classes(work, points.weight)
    index, weight = sample(work, points.weight, own, count)
    there = np.unique(own[index])
    chosen = replace(select(points, index), weight=weight)
    return Sample(chosen, index, there[_nearest(there, own)])


def _first_solution(setup: CampaignSetup, state: State) -> ContactPatches:
    """Solve all operating points by the cheapest applicable models."""
    *models, reference = (replace(setup_of(setup), models=one) for one in candidates(setup.models))
    for one in models:
        try:
            return solve_passage(state, setup.points, one).contact
        except (ContactError, NumericalError):
            continue
    return solve_passage(state, setup.points, reference).contact


def _solvable(setup: CampaignSetup, state: State, threads: int) -> NDArray[np.bool_]:
    """Whether any of the candidates solves each point: the cheapest all, the next ones what that leaves."""
    rest = np.arange(len(setup.points.label))
    for one in candidates(setup.models):
        here = replace(setup_of(setup, threads), models=one)
        part = select(setup.points, rest)
        rest = rest[sorted(solve_passage(replace(state, points=new_history(part)), part, here).failed)]
        if rest.size == 0:
            break
    return ~mask_of(rest, len(setup.points.label))


def _nearest(there: IntArray, values: IntArray) -> IntArray:
    """Return the index in rising `there` of the first that is not smaller than each value; else the last."""
    place: IntArray = np.minimum(np.searchsorted(there, values), there.size - 1)
    return place


def candidates(base: ContactModels) -> tuple[ContactModels, ...]:
    """Return the models of `COST_ORDER` with material and parameters; the last one is the reference."""
    return tuple(
        replace(base, normal=normal, tangential=tangential, strips=grid, cells=grid)
        for normal, tangential, grid, _ in COST_ORDER
    )


def choice(setup: CampaignSetup, state: State, *, threads: int = 1) -> Verdict:
    """Choose the cheapest contact models whose wear increment keeps the tolerance of a campaign.

    Returns
    -------
    Verdict
        One combination for all points, or one for each class where that is cheaper. On a sample they keep
        `MARGIN` times the tolerance. Points that no models solve, which a campaign may leave out, do not
        count; they belong to the last class.

    Raises
    ------
    ContactError, NumericalError
        If the reference has no solution of a point.
    """
    assert setup.tolerance is not None
    kept = np.flatnonzero(_solvable(setup, state, threads)) if state.points else np.arange(0)
    if 0 < kept.size < len(setup.points.label):
        rest = replace(setup, points=select(setup.points, kept))
        verdict = choice(rest, replace(state, points=None), threads=threads)
        place = np.full(len(setup.points.label), len(CLASSES) - 1, dtype=np.int64)
        place[kept] = verdict.choice.point_class
        return replace(verdict, choice=replace(verdict.choice, point_class=place))
    models = candidates(setup.models)
    part = sample_of(setup, state, sample_size(setup.tolerance))
    whole = part.index.size == np.count_nonzero(setup.points.weight)
    bound = setup.tolerance if whole else MARGIN * setup.tolerance
    there, classes = np.unique(part.point_class, return_inverse=True)
    bridges = tuple(models[place] for place in BRIDGES)
    judged = judge(
        models,
        models[-1],
        state,
        part.points,
        setup_of(setup, threads),
        smoothing_wavelength=setup.control.smoothing_wavelength,
        point_class=classes[part.index],
        collective=Collective(setup.points, classes, bridges, models[: BRIDGES[0] + 1]),
    )
    evidence = []
    for one in judged:
        evidence.append(one)
        if one.depth_error <= bound:
            break
    # the candidates tried, and the reference
    places = sorted({*range(len(evidence)), len(models) - 1})
    difference = np.zeros((len(places), *evidence[0].difference.shape))
    difference[: len(evidence)] = [one.difference for one in evidence]
    cost = [COST_ORDER[place][3] for place in places]
    count = np.bincount(classes)
    taken, error = cheapest(difference, cost, count.tolist(), bound)
    of_class = np.array([places[k] for k in taken])[_nearest(there, np.arange(len(CLASSES)))]
    known = [one.depth_error if isfinite(one.depth_error) else None for one in evidence]
    errors = (*known, *[None] * (len(models) - len(known)))
    return Verdict(
        tuple(evidence),
        Choice(tuple(of_class.tolist()), part.point_class, error, errors),
        tuple(np.bincount(part.point_class, minlength=len(CLASSES)).tolist()),
        float(count @ np.array(cost)[list(taken)]) / part.point_class.size,
    )


def models_of(base: ContactModels, chosen: Choice | None) -> ContactModels | ModelsByPoint:
    """Return the contact models of the operating points: as chosen, or `base` where they are given."""
    if chosen is None:
        return base
    return ModelsByPoint(candidates(base), np.array(chosen.models)[chosen.point_class])


def static_choice(setup: CampaignSetup) -> dict[str, Any]:
    """Return the static variables of a result file on the candidates."""
    if setup.tolerance is None:
        return {}
    return {
        "contact_candidate": tuple(named(one) for one in candidates(setup.models)),
        "contact_candidate_cost": np.array([cost for *_, cost in COST_ORDER]),
        "contact_class": CLASSES,
    }


def row_choice(chosen: Choice | None) -> dict[str, np.ndarray]:
    """Return the variables of one row on the choice."""
    if chosen is None:
        return {}
    known = [FILL_FLOAT if error is None else error for error in chosen.candidate_error]
    return {
        "contact_point_class": chosen.point_class.astype(np.int32),
        "contact_models": np.array(chosen.models, dtype=np.int32),
        "contact_models_error": np.asarray(chosen.error),
        "contact_candidate_error": np.array(known),
    }


def choice_of(row: Mapping[str, np.ndarray]) -> Choice | None:
    """Return the choice of a row, bit by bit."""
    if "contact_models" not in row:
        return None
    return Choice(
        tuple(row["contact_models"].tolist()),
        row["contact_point_class"].astype(np.int64),
        float(row["contact_models_error"]),
        tuple(None if error == FILL_FLOAT else error for error in row["contact_candidate_error"].tolist()),
    )


def named(models: ContactModels) -> str:
    """Return the name of a combination: normal model, tangential model, strips x cells."""
    return f"{models.normal} + {models.tangential}, {models.strips} x {models.cells}"


CLASSES = ("least", "minor", "major", "leading")
"""Classes by the work of their points; monitoring points belong to the last one."""

EDGES = (0.1, 0.3, 0.6)
"""Largest shares of the work of the first class, of the first two classes, and so on."""


def point_classes(work: FloatArray, weight: FloatArray) -> IntArray:
    """Sort operating points into classes by their share of the work, per distance (n,) [J/m].

    Returns
    -------
    (n,) int array
        Index in `CLASSES`: the points of least weighted work, up to the first share of `EDGES` together, are
        in the first class, the next ones in the second, and so on. Points without weight are in the last
        one, and so are all points without any work.
    """
    share = work * weight
    order = np.argsort(share, kind="stable")
    summed = np.cumsum(share[order])
    place = np.full(share.size, len(EDGES), dtype=np.int64)
    if summed[-1] > 0.0:
        place[order] = np.searchsorted(EDGES, summed / summed[-1], side="left")
        place[weight <= 0.0] = len(EDGES)
    return place


def cheapest(
    difference: FloatArray, cost: Sequence[float], count: Sequence[int], bound: float
) -> tuple[tuple[int, ...], float]:
    """Return the models of each class that are cheapest together and keep a bound.

    Parameters
    ----------
    difference : (k, c, ...) array
        Difference of the contribution of class c by candidate k from that by a reference; infinite where the
        candidate is not applicable.
    cost : (k,) sequence of float
        Cost of one solution by each candidate, rising.
    count : (c,) sequence of int
        Number of operating points of each class, by rising work.
    bound : float
        Bound of the largest sum of the differences over the classes.

    Returns
    -------
    tuple of int
        Candidate of each class, not falling from class to class.
    float
        Largest sum of their differences.

    Raises
    ------
    ValueError
        If no candidate keeps the bound; the reference always does.
    """
    candidates, classes = difference.shape[:2]

    def price(chosen: tuple[int, ...]) -> float:
        return sum(cost[k] * number for k, number in zip(chosen, count, strict=True))

    rising = itertools.combinations_with_replacement(range(candidates), classes)
    for chosen in sorted(rising, key=price):
        error = float(np.abs(sum(difference[k, c] for c, k in enumerate(chosen))).max())
        if error <= bound:
            return chosen, error
    raise ValueError("no candidate keeps the bound")


ModelsT = TypeVar("ModelsT", bound=ContactModels | ModelsByPoint)


@dataclass(frozen=True)
class Evidence(Generic[ModelsT]):
    """Error of one combination of models on a sample of operating points; inf where it is not applicable."""

    models: ModelsT  # combination with its grid, or those of each point
    # largest difference of the smoothed wear increment over the profiles of both wheels from that of the
    # reference, over its largest depth, on the sample or as estimated for the whole collective [-]
    depth_error: float
    # integral of the absolute difference of the strip work over that of the reference's, on the sample [-]
    work_error: float
    power_error: float  # largest relative error of the power of both wheels at a point of the sample [-]
    # (c, 2, n) contribution of each class of points to the difference of the increment, over the largest
    # depth [-]
    difference: FloatArray
    message: str = ""  # why the models are not applicable; empty if they are


@dataclass(frozen=True)
class Collective:
    """All operating points, of which the sample is a part.

    The difference of a model on all points is estimated as its difference from a fast model on all points
    plus the difference of that fast model on the sample.
    """

    points: OperatingPoints  # all n points, monitoring points included
    point_class: IntArray  # (n,) class of each, numbered as in the sample
    # fast models, the best first; the first applicable one is used, the normal models of those before it are
    # excluded in all combinations
    bridges: tuple[ContactModels, ...]
    cheap: tuple[ContactModels, ...]  # candidates solved at all points


@dataclass(frozen=True)
class _Increment:
    depth: FloatArray  # (c, 2, n) of each class after smoothing, per metre
    work: FloatArray  # (2, n) of strip work times length
    power: FloatArray  # (k,) of both wheels at each point


def judge(
    candidates: Iterable[ModelsT],
    reference: ContactModels,
    state: State,
    points: OperatingPoints,
    setup: Setup,
    *,
    smoothing_wavelength: float,
    point_class: IntArray | None = None,
    collective: Collective | None = None,
) -> Iterator[Evidence[ModelsT]]:
    """Compare the wear increments of models with that of a reference, one after the other.

    Parameters
    ----------
    candidates : iterable of ContactModels or ModelsByPoint
        Models to compare.
    reference : ContactModels
        Reference.
    state : State
        Profiles of both wheels.
    points : OperatingPoints
        Sample of k points with weights.
    setup : Setup
        Bodies and wear law; its models are not used.
    smoothing_wavelength : float
        Wavelength of the smoothing of the increment [m].
    point_class : (k,) int array, optional
        Class of each point of the sample, 0 to c - 1; by default one class.
    collective : Collective, optional
        Collective of the sample. Without it, or where no bridge is applicable, the sample alone counts.

    Yields
    ------
    Evidence
        Evidence on each candidate, in order.

    Raises
    ------
    ContactError, NumericalError
        If the reference has no solution of a point.
    """
    classes = np.zeros(len(points.label), dtype=np.int64) if point_class is None else point_class
    still = replace(setup, comparison=ComparisonLaws(), counterface_wear=None)
    state = replace(state, points=None)  # models that fail at a point are not applicable
    count = int(classes.max()) + 1
    length = lengths_of_sides(state.y, state.z)

    def increment(
        models: ContactModels | ModelsByPoint, points: OperatingPoints, classes: IntArray
    ) -> _Increment:
        passage = solve_passage(state, points, replace(still, models=models))
        depth = np.zeros((count, *state.y.shape))
        work = np.zeros_like(state.y)
        for one in range(count):
            weight = np.where(classes == one, points.weight, 0.0)
            rate = accumulate(passage, points, weight, state, still)
            depth[one] = smooth_sides(state.y, state.z, rate.depth, smoothing_wavelength)
            work += rate.friction_work * length
        power = np.zeros(len(points.label))
        np.add.at(power, passage.contact.point, passage.contact.power)
        return _Increment(depth, work, power)

    truth = increment(reference, points, classes)
    left_out = np.zeros_like(truth.depth)
    of_all: dict[ContactModels | ModelsByPoint, _Increment] = {}
    excluded: dict[str, str] = {}
    for bridge in () if collective is None else collective.bridges:
        assert collective is not None
        try:
            of_all[bridge] = increment(bridge, collective.points, collective.point_class)
            left_out = of_all[bridge].depth - increment(bridge, points, classes).depth
            break
        except (ContactError, NumericalError) as error:
            excluded[bridge.normal] = str(error)
    deepest = float((truth.depth + left_out).sum(axis=0).max())
    for models in candidates:
        try:
            if isinstance(models, ContactModels) and models != reference and models.normal in excluded:
                raise ContactError(excluded[models.normal])
            increments = truth if models == reference else increment(models, points, classes)
            difference = increments.depth - truth.depth
            if collective is not None and (models in collective.cheap or models in of_all):
                if models not in of_all:
                    of_all[models] = increment(models, collective.points, collective.point_class)
                difference = of_all[models].depth - left_out - truth.depth
        except (ContactError, NumericalError) as error:
            yield Evidence(models, inf, inf, inf, np.full_like(truth.depth, inf), str(error))
            continue
        yield Evidence(
            models,
            _share(np.abs(difference.sum(axis=0)).max(), deepest),
            _share(np.abs(increments.work - truth.work).sum(), truth.work.sum()),
            max(_share(abs(a - b), b) for a, b in zip(increments.power, truth.power, strict=True)),
            difference / deepest if deepest > 0.0 else np.where(difference == 0.0, 0.0, inf),
        )


def _share(difference: float, whole: float) -> float:
    """Return the difference over the whole; 0 if there is neither."""
    if whole > 0.0:
        return float(difference / whole)
    return 0.0 if difference == 0.0 else inf
