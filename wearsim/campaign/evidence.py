"""The wear increment of contact models against that of a reference."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import inf
from typing import Generic, TypeVar

import numpy as np

from wearsim.campaign.by_point import ModelsByPoint
from wearsim.campaign.rate import accumulate, solve_contact
from wearsim.campaign.smoothing import smooth_sides
from wearsim.campaign.state import State
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import ContactModels, Counterface, Wheelset
from wearsim.damage.wear import WearSettings, passage_depth
from wearsim.errors import ContactError, NumericalError
from wearsim.operation.points import OperatingPoints
from wearsim.profile.shape import vertex_lengths

ModelsT = TypeVar("ModelsT", bound=ContactModels | ModelsByPoint)


@dataclass(frozen=True)
class Evidence(Generic[ModelsT]):
    """How well one combination of models does on a sample of operating points.

    Parameters
    ----------
    models : ContactModels or ModelsByPoint
        The combination and its grid, or those of each point.
    depth_error : float
        Largest difference of the smoothed wear increment over the profiles of both wheels from that of
        the reference, over the reference's largest depth [-]; inf where it refuses. On the sample, or as
        estimated for the whole collective.
    work_error : float
        Integral of the absolute difference of the strip work over that of the reference's, on the sample [-].
    power_error : float
        Largest relative error of the frictional power of both wheels at a point of the sample [-].
    difference : (c, 2, n) array
        What each class of points adds to the difference of the increment over the largest depth [-];
        inf where it refuses.
    refusal : str
        Why it gives no answer; empty if it does.
    """

    models: ModelsT
    depth_error: float
    work_error: float
    power_error: float
    difference: FloatArray
    refusal: str = ""


@dataclass(frozen=True)
class Collective:
    """All operating points, of which the sample is a part.

    A fast model tells how the points that the sample leaves out differ from it: what is looked for on all
    points is the difference to that model on all, and that model's own difference on the sample alone.

    Parameters
    ----------
    points : OperatingPoints
        All n, those that only monitor, too; the sample's weights have to carry their work.
    point_class : (n,) int array
        Class of each, numbered as those of the sample.
    bridges : tuple of ContactModels
        Fast models, the best first; the first that answers at all points is taken. Normal models of those
        before it are refused in all combinations: they have no answer for the campaign.
    cheap : tuple of ContactModels
        Candidates that are solved at all points, whatever the bridge.
    """

    points: OperatingPoints
    point_class: IntArray
    bridges: tuple[ContactModels, ...]
    cheap: tuple[ContactModels, ...]


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
    wheelset: Wheelset,
    counterface: Counterface,
    wear: WearSettings,
    *,
    smoothing_wavelength: float,
    point_class: IntArray | None = None,
    collective: Collective | None = None,
    threads: int = 1,
) -> Iterator[Evidence[ModelsT]]:
    """Compare the wear increments of models with that of a reference, one after the other as asked for.

    Parameters
    ----------
    candidates : iterable of ContactModels or ModelsByPoint
        What to judge.
    reference : ContactModels
        What they are judged by.
    state : State
        Profiles of both wheels.
    points : OperatingPoints
        The sample of k points; its weights count.
    wheelset, counterface, wear
        What runs on what, by which wear law.
    smoothing_wavelength : float
        Of the increment, as in the campaign [m].
    point_class : (k,) int array, optional
        Class of each point of the sample, 0 to c - 1; without it all are of one.
    collective : Collective, optional
        Of which the points are a sample. Without it, or where all bridges refuse, the sample alone counts.
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
    classes = np.zeros(len(points.label), dtype=np.int64) if point_class is None else point_class

    count = int(classes.max()) + 1
    length = np.stack([vertex_lengths(state.y[wheel], state.z[wheel]) for wheel in (0, 1)])

    def increment(
        models: ContactModels | ModelsByPoint, points: OperatingPoints, classes: IntArray
    ) -> _Increment:
        solution = solve_contact(state, points, wheelset, counterface, models, threads=threads)
        passage = passage_depth(solution.fields, solution.area, wear)
        depth = np.zeros((count, *state.y.shape))
        work = np.zeros_like(state.y)
        for one in range(count):
            weight = np.where(classes == one, points.weight, 0.0)
            rate = accumulate(solution, points, weight, state, wheelset, wear, passage=passage)
            depth[one] = smooth_sides(state.y, state.z, rate.depth, smoothing_wavelength)
            work += rate.friction_work * length
        power = np.zeros(len(points.label))
        np.add.at(power, solution.point, solution.power)
        return _Increment(depth, work, power)

    truth = increment(reference, points, classes)
    left_out = np.zeros_like(truth.depth)
    of_all: dict[ContactModels | ModelsByPoint, _Increment] = {}
    refused: dict[str, str] = {}
    for bridge in () if collective is None else collective.bridges:
        assert collective is not None
        try:
            of_all[bridge] = increment(bridge, collective.points, collective.point_class)
            left_out = of_all[bridge].depth - increment(bridge, points, classes).depth
            break
        except (ContactError, NumericalError) as error:
            refused[bridge.normal] = str(error)
    deepest = float((truth.depth + left_out).sum(axis=0).max())
    for models in candidates:
        try:
            if isinstance(models, ContactModels) and models != reference and models.normal in refused:
                raise ContactError(refused[models.normal])
            answer = truth if models == reference else increment(models, points, classes)
            difference = answer.depth - truth.depth
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
            _share(np.abs(answer.work - truth.work).sum(), truth.work.sum()),
            max(_share(abs(a - b), b) for a, b in zip(answer.power, truth.power, strict=True)),
            difference / deepest if deepest > 0.0 else np.where(difference == 0.0, 0.0, inf),
        )


def _share(difference: float, whole: float) -> float:
    """Return the difference over the whole; 0 if there is neither."""
    if whole > 0.0:
        return float(difference / whole)
    return 0.0 if difference == 0.0 else float("inf")
