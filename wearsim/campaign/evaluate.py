"""Wear rate of one state of a campaign: contact, wear law, profile coordinates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wearsim.campaign.comparison import (
    ComparisonLaws,
    comparison_laws,
    comparison_passage,
)
from wearsim.campaign.counterface import with_counterface, worn_counterface
from wearsim.campaign.left_out import Failed, judged
from wearsim.campaign.passage import Passage, shared
from wearsim.campaign.state import PatchWear, PointHistory, State, WearRate, worn_wheels
from wearsim.campaign.vertices import sample, share_out, stretches, strip_heights
from wearsim.campaign.zones import zone_shares
from wearsim.contact.mirror import Images, copied_patches, images_of, is_symmetric
from wearsim.contact.normal.model import FAINT
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.solve import (
    ContactModels,
    ContactSolution,
    Counterface,
    Wheelset,
    solve_each,
)
from wearsim.contact.wheels import joined
from wearsim.damage.wear import (
    WearSettings,
    highest_regime,
    passage_depth,
    patch_regime,
)
from wearsim.errors import ContactError
from wearsim.operation.points import OperatingPoints, mask_of, shared_weight
from wearsim.operation.resultants import Resultants, resultants
from wearsim.profile.shape import arc_length, vertex_lengths
from wearsim.scene.campaign import CounterfaceWear
from wearsim.scene.damage import BrakeBlockSection

if TYPE_CHECKING:
    from wearsim.scene import CampaignSetup

# Share of the largest interpenetration below which strips do not limit the step.
_RIM = 0.05


@dataclass(frozen=True)
class Setup:
    """Inputs of a wear rate besides state and operating points."""

    wheelset: Wheelset  # new wheelset: names, radius and half span
    counterface: Counterface  # new rails or rollers
    models: ContactModels  # contact models of all points
    wear: WearSettings  # active wear law: coefficients, form, density
    comparison: ComparisonLaws = field(default_factory=ComparisonLaws)
    # wear law of the counterface, None if it does not wear
    counterface_wear: CounterfaceWear | None = None
    # threads of the contact solver; their number does not change the bits of the result
    threads: int = 1
    brake: BrakeBlockSection | None = None

    @property
    def options(self) -> dict[str, Any]:
        """Options of `solve_each`: threads, and the fields that the laws use."""
        laws = self.wear, *self.comparison.wear, *self.comparison.fatigue
        whole = any(getattr(law, "needs_fields", True) for law in laws)
        return {"threads": self.threads, "fields": whole or "work"}


def setup_of(campaign: CampaignSetup, threads: int = 1) -> Setup:
    """Return the inputs of the wear rate of a campaign.

    They have the contact models of its scene.
    """
    return Setup(
        campaign.wheelset,
        campaign.counterface,
        campaign.models,
        campaign.wear,
        comparison_laws(campaign),
        campaign.counterface_wear,
        threads,
        campaign.brake,
    )


def passage_of(solution: ContactSolution, setup: Setup) -> Passage:
    """Evaluate the laws of a setup on a contact solution."""
    fields = solution.fields
    return Passage(
        solution.patches(),
        fields.strip_work,
        fields.work_density.max(axis=(1, 2), initial=0.0),
        tuple(passage_depth(fields, solution.area, setup.wear)),
        comparison_passage(solution, setup.comparison),
        share=np.ones(solution.point.size),
    )


def worn_bodies(state: State, setup: Setup) -> tuple[Wheelset, Counterface]:
    """Return wheelset and counterface of a setup with the profiles of a state."""
    right, left = worn_wheels(setup.wheelset, state.y, state.z)
    wheelset = replace(setup.wheelset, right=right, left=left)
    return wheelset, worn_counterface(setup.counterface, state.counterface)


def solve_passage(
    state: State,
    points: OperatingPoints,
    setup: Setup,
    among: NDArray[np.bool_] | None = None,
) -> Passage:
    """Solve the contact of operating points in a state, and apply the laws.

    Points are solved whatever their weight. The profiles of the state replace those of
    the wheelset, and those of a counterface that wears. Patches are in the order of
    point, side and falling normal force; with `among` (n,) only those points are
    solved, which keep their numbers. The laws run on the threads of the contact solver,
    so that only the cells of the chunks being solved exist at a time. With a history of
    the points, those without a contact solution are omitted. Points that failed before
    are solved separately, so that the others are not solved twice. Of equal
    points, and mirror images, one is solved and the others are copied.
    """
    count = len(points.label)
    to_solve = np.ones(count, dtype=bool) if among is None else among
    bodies = worn_bodies(state, setup)
    one_place = np.ones(count, dtype=bool)
    if points.beyond is not None:
        one_place[points.beyond.point] = False
    rows = np.flatnonzero(to_solve & one_place)
    images = images_of(points.conditions.at(rows), is_symmetric(*bodies))
    images = images.among(rows, count)
    solved = _solved_among(state, points, setup, bodies, to_solve & ~images.copied)
    lost = mask_of(solved.failed, count)[images.source] & images.copied
    if lost.any():
        others = _solved_among(state, points, setup, bodies, lost)
        solved = _joined_passages([solved, others])
    return _with_copies(solved, images, np.flatnonzero(images.copied & ~lost))


def _with_copies(solved: Passage, images: Images, copies: IntArray) -> Passage:
    """Passage with the patches of points that are `copies` (k,) of solved ones."""
    if not copies.size:
        return solved
    source, point = images.source[copies], solved.contact.point
    begin, end = (np.searchsorted(point, source, side) for side in ("left", "right"))
    number = end - begin
    of_copy = np.repeat(copies, number)
    index = np.arange(of_copy.size) + np.repeat(
        begin - np.cumsum(number) + number, number
    )
    passage = joined([replace(solved, failed={})], index)
    contact = copied_patches(passage.contact, images.mirrored[of_copy])
    contact = replace(contact, point=of_copy, patch=replace(contact.patch, row=of_copy))
    return _joined_passages([solved, replace(passage, contact=contact)])


def _joined_passages(parts: list[Passage]) -> Passage:
    """Passages of different points in the order of point, side and normal force."""
    wheel = np.concatenate(
        [2 * part.contact.point + part.contact.side for part in parts]
    )
    failed = {point: error for part in parts for point, error in part.failed.items()}
    order = np.argsort(wheel, kind="stable")
    # A passage without patches, of points that all failed, has no strips.
    bare = [replace(part, failed={}) for part in parts]
    bare = [part for part in bare if part.contact.point.size] or bare[:1]
    whole: Passage = joined(bare, None if (order[1:] > order[:-1]).all() else order)
    return replace(whole, failed=failed)


def _solved_among(
    state: State,
    points: OperatingPoints,
    setup: Setup,
    bodies: tuple[Wheelset, Counterface],
    to_solve: NDArray[np.bool_],
) -> Passage:
    """Solve the points `to_solve` (n,), each by itself."""
    every = list[Passage]()
    failed: Failed = {}
    conditions, of, share = points.runs
    if conditions.nearby is not None:
        nearby = conditions.nearby.copy()
        nearby[len(points.label) :] = np.nan  # positions beyond a jump
        conditions = replace(conditions, nearby=nearby)
    before = np.zeros_like(to_solve) if state.points is None else state.points.left_out
    for out in (False, True):
        index = np.flatnonzero(to_solve[of] & (before[of] == out))
        if not index.size:
            continue
        rows: Failed | None = None if state.points is None else {}
        evaluated = partial(_passage_at, of[index], share[index], setup, state)
        try:
            every += solve_each(
                conditions.at(index),
                *bodies,
                setup.models,
                evaluated,
                failed=rows,
                **setup.options,
            )
        except ContactError as error:
            raise _numbered(error, of[index]) from None
        failed |= {
            int(of[index[row]]): _numbered(error, of[index])
            for row, error in (rows or {}).items()
        }
    return replace(_joined_passages(every), failed=failed)


def _passage_at(
    index: IntArray,
    share: FloatArray,
    setup: Setup,
    state: State,
    solution: ContactSolution,
) -> Passage:
    """Passage of the points at `index`, with their numbers in the batch."""
    passage = shared(passage_of(solution, setup), share)
    contact = passage.contact
    point = index[contact.point]
    placed = replace(contact, point=point, patch=replace(contact.patch, row=point))
    edges, arc = (
        np.empty_like(contact.strip_edges_wheel_y),
        arc_length(state.y, state.z),
    )
    for wheel in (0, 1):
        at = np.flatnonzero(contact.side == wheel)
        edges[at] = _edges(passage, at, wheel, state, arc)
    return replace(
        passage,
        contact=placed,
        wear=patch_wear(passage, state, setup.wheelset),
        strip_edges_arc=edges,
    )


def _numbered(error: ContactError, index: IntArray) -> ContactError:
    """Replace the point number of an error by the number of the point in a batch.

    The points of the error are those at `index` of the batch.
    """
    if error.row is None:
        return error
    return error.of_point(int(index[error.row]), index[list(error.rows)].tolist())


def accumulate(
    passage: Passage,
    points: OperatingPoints,
    weight: FloatArray,
    state: State,
    setup: Setup,
) -> WearRate:
    r"""Sum the weighted wear of all patches at the vertices of the wheel profiles.

    Parameters
    ----------
    passage : Passage
        Of all `n` points in this state.
    points : OperatingPoints
        Environment factors.
    weight : (n,) array
        Share of the distance each point acts for; that of points left out is shared
        within their class.
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
    The environment factor applies to wear, not to fatigue. Wear by brake blocks is in
    the first regime of each law, whatever the environment.

    Depth per metre is the depth per passage over :math:`2 \pi r(y)`,
    :math:`r = r_0 + z`. The area removed by each strip is distributed over the arc
    lengths of the vertices in proportion to the overlap: the sum over the vertices is
    the sum over the strips.
    """
    if passage.failed:
        weight = shared_weight(
            weight, points.of_class, mask_of(passage.failed, weight.size)
        )
    solution, point = passage.contact, passage.contact.point
    every = weight * points.environment
    scale = np.stack([every[point], weight[point]])
    total = carried(passage, scale, state, setup)
    laws = [len(passage.depth), *(len(by_law) for by_law in passage.comparison.depth)]
    depth, *comparison = np.split(total, np.cumsum(laws), axis=1)
    work_and_damage = comparison.pop()
    if setup.brake is not None:
        for law in (depth, *comparison):
            law[:, 0] += setup.brake.depth(state.y)

    law = scale[0][:, None] * np.sum(passage.depth, axis=0)
    relative = _over_gap_and_strain(passage, law, setup)
    stability, waves = _sampled(passage, relative, scale[1] > 0.0, state, setup)
    result = WearRate(
        depth.sum(axis=1),
        depth,
        work_and_damage[:, 0],
        stability,
        waves,
        solution,
        comparison=tuple(comparison),
        fatigue=tuple(np.moveaxis(work_and_damage[:, 1:], 1, 0)),
    )
    if setup.counterface_wear is None:
        return result
    radius = setup.wheelset.radius
    return with_counterface(
        result, law, relative, state, radius, setup.counterface_wear
    )


def _over_gap_and_strain(
    passage: Passage, law: FloatArray, setup: Setup
) -> tuple[FloatArray, FloatArray]:
    """Wear depths (m, ny) of strips by which the length of a step is limited.

    They are over the interpenetration [1/m] and, of patches without one, over the
    largest pressure over E* [-]; of faint patches they are 0.
    """
    solution = passage.contact
    gap, full = solution.patch.interpenetration, _full(passage)
    rim = _RIM * gap.max(axis=1, keepdims=True, initial=0.0)
    load_bearing = (gap > rim) & full[:, None]
    over_gap = np.where(load_bearing, law / np.where(load_bearing, gap, 1.0), 0.0)
    strain = solution.max_pressure / setup.models.effective_modulus
    stiff = full & ~(gap > 0.0).any(axis=1)
    over_strain = np.where(
        stiff[:, None], law / np.where(stiff, strain, 1.0)[:, None], 0.0
    )
    return over_gap, over_strain


def _sampled(
    passage: Passage,
    of_strips: tuple[FloatArray, FloatArray],
    acts: NDArray[np.bool_],
    state: State,
    setup: Setup,
) -> tuple[FloatArray, FloatArray]:
    """Values of strips at the vertices (2, n), summed over patches that act (m,).

    They are per metre run.
    """
    first, second = np.zeros_like(state.y), np.zeros_like(state.y)
    arc = arc_length(state.y, state.z)
    for wheel in (0, 1):
        at = np.flatnonzero(acts & (passage.contact.side == wheel))
        edges = _edges(passage, at, wheel, state, arc)
        sample(edges, arc[wheel], of_strips[0][at], first[wheel])
        sample(edges, arc[wheel], of_strips[1][at], second[wheel])
    around = 2.0 * np.pi * (setup.wheelset.radius + state.z)
    return first / around, second / around


def _full(passage: Passage) -> NDArray[np.bool_]:
    """Return True for patches (m,) that are not faint among those of their wheel.

    The length of the run in which they occur does not matter.
    """
    force = passage.contact.normal_force
    wheel = 2 * passage.contact.point + passage.contact.side
    full: NDArray[np.bool_] = (
        force >= FAINT * passage.share * np.bincount(wheel, force)[wheel]
    )
    return full


def carried(
    passage: Passage, scale: FloatArray, state: State, setup: Setup
) -> FloatArray:
    """Transfer patch values to the vertices of the wheels, per metre run.

    Parameters
    ----------
    passage : Passage
        Of `m` patches.
    scale : (2, m) array
        Factors of each patch on wear depths, and on work and damage; patches without
        the latter are left out.
    state : State
        The profiles the contact was solved with.
    setup : Setup
        Radius at the running circle.

    Returns
    -------
    (2, q, n) array
        Of each wheel: depth by the regimes of the active law and of the comparison
        laws [m/m],
        work [J/m3], fatigue damage by law [1/m].
    """
    laws = [
        *passage.depth,
        *(regime for by_law in passage.comparison.depth for regime in by_law),
    ]
    rows = [*laws, passage.strip_work, *passage.comparison.damage]
    solution = passage.contact
    result = np.zeros((2, len(rows), state.y.shape[1]))
    arc, length = arc_length(state.y, state.z), vertex_lengths(state.y, state.z)
    for wheel in (0, 1):
        at = np.flatnonzero((scale[1] > 0.0) & (solution.side == wheel))
        of_rows = [scale[0, at, None]] * len(laws) + [scale[1, at, None]] * (
            len(rows) - len(laws)
        )
        amount = np.stack(
            [row[at] * factor for row, factor in zip(rows, of_rows, strict=True)]
        )
        amount *= solution.patch.width[at][:, None]
        area, edges = np.zeros(result.shape[1:]), _edges(passage, at, wheel, state, arc)
        share_out(edges, stretches(arc[wheel]), amount, area)
        per_metre = 1.0 / (2.0 * np.pi * (setup.wheelset.radius + state.z[wheel]))
        result[wheel] = area * (per_metre / length[wheel])
    return result


def _edges(
    passage: Passage, at: IntArray, wheel: int, state: State, arc: FloatArray
) -> FloatArray:
    """Arc length at the strip edges of patches `at` of a wheel [m].

    It is interpolated from the arc length of the vertices (2, n).
    """
    if passage.strip_edges_arc is not None:
        return passage.strip_edges_arc[at]
    # a worn flank may overhang by rounding; interpolation needs a rising y
    rising_y = np.maximum.accumulate(state.y[wheel])
    return np.interp(passage.contact.strip_edges_wheel_y[at], rising_y, arc[wheel])


def forces_of(passage: Passage, points: OperatingPoints) -> Resultants:
    """Resultants of the points of a passage."""
    return resultants(passage.contact, points.conditions.shift.size)


def patch_wear(passage: Passage, state: State, wheelset: Wheelset) -> PatchWear:
    r"""Wear of each of `m` patches of a wheel that runs in its operating point alone.

    It is neither weighted nor multiplied by an environment factor.

    Notes
    -----
    Depth per metre is the depth per passage over :math:`2 \pi r(y)` with
    :math:`r = r_0 + z` at the centre of the strip (spec 1.0); the area is the sum over
    the strips of depth times width.
    """
    solution, depth = passage.contact, np.stack(passage.depth)
    height = strip_heights(solution, state.y, state.z)
    depth_rate = depth.sum(axis=0) / (2.0 * np.pi * (wheelset.radius + height))
    return PatchWear(
        area_rate=depth_rate.sum(axis=1) * solution.patch.width,
        depth_rate_max=depth_rate.max(axis=1, initial=0.0),
        regime=patch_regime(depth),
        regime_highest=highest_regime(depth),
        zone_share=zone_shares(solution.strip_edges_wheel_y, depth_rate),
    )


@dataclass(frozen=True)
class Evaluation:
    """Contact of one state, with the resulting wear rate and measures."""

    collective: WearRate  # of the points solved with their weights
    # (n,) weights of the step that led to the state; in the initial state, after a
    # reprofiling and at the end of the distance those of the full collective.
    weight: FloatArray
    passage: Passage
    wear: PatchWear  # wear of the patches
    points: PointHistory | None  # for the state after this one
    # measures of the wheels, `row.recorded_measures`
    measures: Mapping[str, np.ndarray] = field(default_factory=dict)


def fastest_wear(evaluation: Evaluation, points: OperatingPoints) -> str:
    """Name the operating point of the fastest wear, "" without wear."""
    at = evaluation.passage.contact.point
    wear_weight = (evaluation.weight * points.environment)[at]
    rate = wear_weight * evaluation.wear.depth_rate_max
    if not (rate > 0.0).any():
        return ""
    return points.label[int(at[np.nanargmax(rate)])]


def solved(
    state: State,
    points: OperatingPoints,
    weight: FloatArray,
    setup: Setup,
    *,
    among: NDArray[np.bool_] | None = None,
    raises: bool = True,
) -> Evaluation:
    """Solve the contact of some points and sum the weighted wear of the active ones.

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
        Whether it is an error if points without contact solution carry too much of the
        wear.

    Raises
    ------
    ContactError
        If the points without contact solution carry too much of the wear.
    """
    passage = solve_passage(
        state, points, setup, weight > 0.0 if among is None else among
    )
    wear, history = passage.wear, state.points
    assert wear is not None
    if history is not None:
        history = judged(history, points, passage, wear, state.distance, raises=raises)
    collective = accumulate(passage, points, weight, state, setup)
    return Evaluation(collective, weight, passage, wear, history)


def rate(
    state: State, points: OperatingPoints, weight: FloatArray, setup: Setup
) -> WearRate:
    """Return the wear rate of the active points per metre run; see `solved`."""
    return solved(state, points, weight, setup).collective
