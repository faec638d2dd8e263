"""Wear rate of one state of a campaign: contact, wear law, profile coordinates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearsim.campaign.comparison import ComparisonLaws, ComparisonPassage, comparison_laws, comparison_passage
from wearsim.campaign.counterface import with_counterface, worn_counterface
from wearsim.campaign.faint import faded
from wearsim.campaign.left_out import Failed, judged
from wearsim.campaign.state import PatchWear, PointHistory, State, WearRate, worn_wheels
from wearsim.campaign.vertices import sample, share_out, stretches
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import ContactPatches
from wearsim.contact.solve import ContactModels, ContactSolution, Counterface, Wheelset, solve_each
from wearsim.contact.wheels import joined
from wearsim.damage.wear import WearSettings, highest_regime, passage_depth, patch_regime
from wearsim.errors import ContactError
from wearsim.operation.left_out import mask_of, shared_weight
from wearsim.operation.points import OperatingPoints, select
from wearsim.profile.shape import arc_length, vertex_lengths
from wearsim.scene.campaign import CounterfaceWear

if TYPE_CHECKING:
    from wearsim.scene import CampaignSetup

# share of the largest interpenetration below which strips do not limit the step (spec 0.1)
_RIM = 0.05


@dataclass(frozen=True)
class ModelsByPoint:
    """Contact models of each operating point."""

    models: tuple[ContactModels, ...]  # combinations with their grids
    place: IntArray  # (n,) index in `models` of each point

    def at(self, index: IntArray) -> ModelsByPoint:
        """Return the models of the points at `index`."""
        return replace(self, place=self.place[index])

    def groups(self) -> list[tuple[ContactModels, IntArray]]:
        """Return each combination in use with the indices of its points."""
        whose = [(one, np.flatnonzero(self.place == k)) for k, one in enumerate(self.models)]
        return [(one, index) for one, index in whose if index.size]


@dataclass(frozen=True)
class Setup:
    """What a wear rate depends on besides state and operating points."""

    wheelset: Wheelset  # as new: names, radius and half span
    counterface: Counterface  # as new: rail or roller
    models: ContactModels | ModelsByPoint  # one combination for all points, or one for each
    wear: WearSettings  # active wear law: coefficients, form, density
    comparison: ComparisonLaws = field(default_factory=ComparisonLaws)
    counterface_wear: CounterfaceWear | None = None  # how the counterface wears, if it does
    threads: int = 1  # of the contact solver; their number does not change the bits of the result


def setup_of(campaign: CampaignSetup, threads: int = 1) -> Setup:
    """Return what the wear rate of a campaign depends on, with the contact models of its scene."""
    return Setup(
        campaign.wheelset,
        campaign.counterface,
        campaign.models,
        campaign.wear,
        comparison_laws(campaign),
        campaign.counterface_wear,
        threads,
    )


@dataclass(frozen=True)
class Passage:
    """One passage of each of `m` patches over the wheel: contact, and what the laws make of its cells."""

    contact: ContactPatches
    strip_work: FloatArray  # (m, ny) frictional work per area of each strip [J/m2]
    work_density_max: FloatArray  # (m,) of all cells [Pa]
    depth: tuple[FloatArray, ...]  # (m, ny) by the regimes of the active wear law, along the normal [m]
    comparison: ComparisonPassage
    weight: FloatArray  # (m,) with which each patch acts: below 1 where it is faint [-]
    lost: FloatArray  # (m, 3) share of load, power and wear that faint patches of its wheel lost [-]
    failed: Mapping[int, ContactError] = field(default_factory=dict)  # points without contact solution


def passage_of(solution: ContactSolution, setup: Setup) -> Passage:
    """Evaluate the laws of a setup on a contact solution, and let faint patches fade out."""
    fields = solution.fields
    whole = Passage(
        solution.patches(),
        fields.strip_work,
        fields.work_density.max(axis=(1, 2), initial=0.0),
        tuple(passage_depth(fields, solution.area, setup.wear)),
        comparison_passage(solution, setup.comparison),
        weight=np.ones(solution.point.size),
        lost=np.zeros((solution.point.size, 3)),
    )
    return faded(whole)


def solve_passage(state: State, points: OperatingPoints, setup: Setup) -> Passage:
    """Solve every operating point, whatever its weight, with the profiles of a state; evaluate the laws.

    The profiles replace those of the wheelset, and those of a counterface that wears. Patches are in the
    order of point, side and falling normal force. The laws run on the threads of the contact solver: no more
    cells exist at a time than those of the chunks being solved. With a history of the points those without
    contact solution are left out; those that failed before are solved by themselves, so that the others are
    not solved twice.
    """
    right, left = worn_wheels(setup.wheelset, state.y, state.z)
    bodies = (
        replace(setup.wheelset, right=right, left=left),
        worn_counterface(setup.counterface, state.counterface),
    )
    models = setup.models
    if isinstance(models, ContactModels):
        models = ModelsByPoint((models,), np.zeros(len(points.label), dtype=np.int64))
    parts: list[Passage] = []
    failed: Failed = {}
    groups, history = models.groups(), state.points
    if history is not None and history.left_out.any():
        before = history.left_out
        halves = ((one, index[before[index] == which]) for one, index in groups for which in (False, True))
        groups = [(one, index) for one, index in halves if index.size]
    for one, index in groups:
        own: Failed | None = None if history is None else {}
        conditions = select(points, index).conditions
        try:
            chunks = solve_each(
                conditions, *bodies, one, partial(passage_of, setup=setup), threads=setup.threads, failed=own
            )
        except ContactError as error:
            raise numbered(error, index) from None
        parts += [_placed(chunk, index) for chunk in chunks]
        failed |= {int(index[row]): numbered(error, index) for row, error in (own or {}).items()}
    order = np.argsort(np.concatenate([part.contact.point for part in parts]), kind="stable")
    whole: Passage = joined(parts, None if len(groups) == 1 else order)
    return replace(whole, failed=failed)


def _placed(passage: Passage, index: IntArray) -> Passage:
    """Return a passage of the points at `index` with their numbers in the batch."""
    contact = passage.contact
    point = index[contact.point]
    placed = replace(contact, point=point, patch=replace(contact.patch, row=point))
    failed = {int(index[row]): numbered(error, index) for row, error in passage.failed.items()}
    return replace(passage, contact=placed, failed=failed)


def accumulate(
    passage: Passage,
    points: OperatingPoints,
    weight: FloatArray,
    state: State,
    setup: Setup,
) -> WearRate:
    r"""Weigh the wear of all patches and carry it to the vertices of the wheel profiles.

    Parameters
    ----------
    passage : Passage
        Of all `n` points in this state.
    points : OperatingPoints
        Environment factors.
    weight : (n,) array
        Share of the distance each point acts for; that of points left out is shared within their class.
    state : State
        The profiles the contact was solved with.
    setup : Setup
        Radius at the running circle, wear law, and wear of the counterface.

    Returns
    -------
    WearRate
        Per metre run, without points of zero weight.

    Notes
    -----
    The environment factor acts on wear, not on fatigue.
    Depth per metre is the depth per passage over :math:`2 \pi r(y)`, :math:`r = r_0 + z` (spec 1.0). The
    area each strip removes is shared out over the stretches of arc length the vertices stand for, in
    proportion to the overlap: the sum over the vertices is the sum over the strips.
    """
    if passage.failed:
        weight = shared_weight(weight, points.of_class, mask_of(passage.failed, weight.size))
    solution, comparison, strip_work = passage.contact, passage.comparison, passage.strip_work
    gap = solution.patch.interpenetration
    rim = _RIM * gap.max(axis=1, keepdims=True, initial=0.0)
    full = passage.weight == 1.0
    load_bearing = (gap > rim) & full[:, None]  # a faint patch does not limit the step
    active = weight[solution.point] > 0.0

    n_regimes, n = len(passage.depth), state.y.shape[1]
    ends = np.cumsum([len(by_law) for by_law in comparison.depth], dtype=np.int64)
    wear_rows = int(ends[-1]) if ends.size else 0
    further = np.zeros((2, wear_rows + len(comparison.damage), n))
    depth = np.zeros((2, n_regimes, n))
    work = np.zeros((2, n))
    stability = np.zeros((2, n))
    for wheel in (0, 1):
        arc = arc_length(state.y[wheel], state.z[wheel])
        cell_edges = stretches(arc)
        at = np.flatnonzero(active & (solution.side == wheel))
        point = solution.point[at]
        share = (weight[point] * points.environment[point])[:, None]
        # a worn flank may overhang by rounding; interpolation needs a rising y
        rising_y = np.maximum.accumulate(state.y[wheel])
        strip_edges = np.interp(solution.strip_edges_wheel_y[at], rising_y, arc)

        law_depth = np.stack([regime[at] * share for regime in passage.depth])
        width = solution.patch.width[at][:, None]
        often = weight[point][:, None]
        further_rows = [
            *(regime[at] * share for by_law in comparison.depth for regime in by_law),
            *(damage[at] * often for damage in comparison.damage),
        ]
        carried = np.stack([*law_depth, strip_work[at] * often, *further_rows]) * width
        area = np.zeros((len(carried), n))
        share_out(strip_edges, cell_edges, carried, area)
        per_metre = 1.0 / (2.0 * np.pi * (setup.wheelset.radius + state.z[wheel]))
        per_vertex = area * (per_metre / vertex_lengths(state.y[wheel], state.z[wheel]))
        depth[wheel], work[wheel] = per_vertex[:n_regimes], per_vertex[n_regimes]
        further[wheel] = per_vertex[n_regimes + 1 :]

        inner = load_bearing[at]
        ratio = np.where(inner, law_depth.sum(axis=0) / np.where(inner, gap[at], 1.0), 0.0)
        sample(strip_edges, arc, ratio, stability[wheel])
        stability[wheel] *= per_metre
    result = WearRate(
        depth=depth.sum(axis=1),
        regime_depth=depth,
        friction_work=work,
        stability=stability,
        solution=solution,
        full=full,
        comparison=tuple(np.split(further[:, :wear_rows], ends[:-1], axis=1)) if wear_rows else (),
        fatigue=tuple(further[:, wear_rows + k] for k in range(len(comparison.damage))),
    )
    if setup.counterface_wear is None:
        return result
    every = (weight * points.environment)[solution.point]
    law = np.where(active, every, 0.0)[:, None] * np.sum(passage.depth, axis=0)
    over_gap = np.where(load_bearing, law / np.where(load_bearing, gap, 1.0), 0.0)
    return with_counterface(result, law, over_gap, state, setup.wheelset.radius, setup.counterface_wear)


def patch_wear(passage: Passage, state: State, wheelset: Wheelset) -> PatchWear:
    r"""Wear of each of `m` patches of a wheel that ran in its operating point alone.

    Neither weighted nor multiplied by an environment factor.

    Notes
    -----
    Depth per metre is the depth per passage over :math:`2 \pi r(y)` with :math:`r = r_0 + z` at the centre
    of the strip (spec 1.0); the area is the sum over the strips of depth times width.
    """
    solution, depth = passage.contact, np.stack(passage.depth)
    centre = 0.5 * (solution.strip_edges_wheel_y[:, 1:] + solution.strip_edges_wheel_y[:, :-1])
    height = np.empty_like(centre)
    for wheel in (0, 1):
        at = solution.side == wheel
        # a worn flank may overhang by rounding
        rising_y = np.maximum.accumulate(state.y[wheel])
        height[at] = np.interp(centre[at], rising_y, state.z[wheel])
    depth_rate = depth.sum(axis=0) / (2.0 * np.pi * (wheelset.radius + height))
    return PatchWear(
        area_rate=depth_rate.sum(axis=1) * solution.patch.width,
        depth_rate_max=depth_rate.max(axis=1, initial=0.0),
        regime=patch_regime(depth),
        regime_highest=highest_regime(depth),
    )


class Solved(NamedTuple):
    """Contact of one state, and what follows from it."""

    passage: Passage
    wear: PatchWear  # of its patches
    rate: WearRate
    points: PointHistory | None  # for the state after this one


def solved(
    state: State,
    points: OperatingPoints,
    weight: FloatArray,
    setup: Setup,
    *,
    among: NDArray[np.bool_] | None = None,
    raises: bool = True,
) -> Solved:
    """Solve the contact of some points and weigh the wear of those that act.

    Parameters
    ----------
    state : State
        Profiles of both wheels.
    points : OperatingPoints
        The `n` points of the collective.
    weight : (n,) array
        Share of the distance each point acts for.
    setup : Setup
        Bodies, models and laws.
    among : (n,) bool array, optional
        Points to solve, by default those that act; they keep their numbers.
    raises : bool
        Whether it is an error if points without contact solution carry too much of the wear.

    Raises
    ------
    ContactError
        If the points without contact solution carry too much of the wear.
    """
    passage = solve_points(state, points, weight > 0.0 if among is None else among, setup)
    wear, history = patch_wear(passage, state, setup.wheelset), state.points
    if history is not None:
        history = judged(history, points, passage, wear, state.distance, raises=raises)
    return Solved(passage, wear, accumulate(passage, points, weight, state, setup), history)


def rate(state: State, points: OperatingPoints, weight: FloatArray, setup: Setup) -> WearRate:
    """Return the wear rate of the acting points per metre run; see `solved`."""
    return solved(state, points, weight, setup).rate


def solve_points(state: State, points: OperatingPoints, among: NDArray[np.bool_], setup: Setup) -> Passage:
    """Return `solve_passage` of the points where `among` (n,), with their numbers among all points."""
    index = np.flatnonzero(among)
    own = setup
    if isinstance(setup.models, ModelsByPoint):
        own = replace(setup, models=setup.models.at(index))
    history = state.points
    try:
        passage = solve_passage(
            state if history is None else replace(state, points=history.at(index)), select(points, index), own
        )
    except ContactError as error:
        raise numbered(error, index) from None
    return _placed(passage, index)


def numbered(error: ContactError, index: IntArray) -> ContactError:
    """Return an error of the points at `index` of a batch with the number of its point in the batch."""
    if error.row is None:
        return error
    row, rows = int(index[error.row]), index[list(error.rows)].tolist()
    return type(error)(str(error).replace(f"point {error.row}, ", f"point {row}, ", 1), row, error.side, rows)
