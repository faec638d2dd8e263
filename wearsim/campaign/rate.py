"""What wears per metre in one state of the campaign: contact, wear law, profile coordinates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from wearsim.campaign.by_point import ModelsByPoint, join, numbered
from wearsim.campaign.comparison import ComparisonLaws, ComparisonPassage, comparison_passage
from wearsim.campaign.counterface import with_counterface, worn_counterface
from wearsim.campaign.state import PatchWear, State, WearRate
from wearsim.campaign.vertices import sample, share_out, stretches
from wearsim.contact.patch import FloatArray
from wearsim.contact.solve import (
    ContactConditions,
    ContactModels,
    ContactSolution,
    Counterface,
    Wheelset,
    solve,
)
from wearsim.damage.wear import WearSettings, highest_regime, passage_depth, patch_regime
from wearsim.errors import ContactError
from wearsim.operation.counterface import CounterfaceWear
from wearsim.operation.points import OperatingPoints
from wearsim.profile.shape import arc_length, vertex_lengths

# Strips at the rim of a patch have hardly any interpenetration and would demand vanishing steps, although
# they only decide where the patch ends (spec 0.1).
_RIM = 0.05


def solve_contact(
    state: State,
    points: OperatingPoints,
    wheelset: Wheelset,
    counterface: Counterface,
    models: ContactModels | ModelsByPoint,
    *,
    threads: int = 1,
) -> ContactSolution:
    """Solve every operating point with the profiles of a state.

    Parameters
    ----------
    state : State
        Its profiles replace those of the wheelset, and of the counterface if that wears.
    points : OperatingPoints
        All of them, whatever their weight.
    wheelset : Wheelset
        Names, radius and half span.
    counterface : Counterface
        Rail or roller.
    models : ContactModels or ModelsByPoint
        One combination for all points, or one for each.
    threads : int
        They do not change the bits of the result.

    Returns
    -------
    ContactSolution
        Patches of both wheels at all points.
    """
    worn = replace(
        wheelset,
        right=replace(wheelset.right, y=state.y[0], z=state.z[0]),
        left=replace(wheelset.left, y=state.y[1], z=state.z[1]),
    )
    below = worn_counterface(counterface, state.counterface)
    if isinstance(models, ContactModels):
        return solve(points.conditions, worn, below, models, threads=threads)
    parts = []
    for one, index in models.groups():
        try:
            part = solve(select(points, index).conditions, worn, below, one, threads=threads)
        except ContactError as error:
            raise numbered(error, index) from None
        parts.append((part, index))
    return join(parts)


def accumulate(
    solution: ContactSolution,
    points: OperatingPoints,
    weight: FloatArray,
    state: State,
    wheelset: Wheelset,
    wear: WearSettings,
    *,
    passage: FloatArray | None = None,
    comparison: ComparisonPassage | None = None,
    counterface_wear: CounterfaceWear | None = None,
) -> WearRate:
    r"""Weigh the wear of all patches and carry it to the vertices of the wheel profiles.

    Parameters
    ----------
    solution : ContactSolution
        Of all `n` points in this state; several weightings may share it.
    points : OperatingPoints
        For the environment factors.
    weight : (n,) array
        Share of the distance each point acts for.
    state : State
        The profiles the contact was solved with.
    wheelset : Wheelset
        For the radius at the tape circle.
    wear : WearSettings
        Law, coefficients, form, density.
    passage : (n_regimes, m, ny) array, optional
        Depth per passage of `damage.wear.passage_depth`, if it is known already [m].
    comparison : ComparisonPassage, optional
        What the comparison laws make of the same passages.
    counterface_wear : CounterfaceWear, optional
        How the counterface of the state wears, if it does.

    Returns
    -------
    WearRate
        Per metre run; points of zero weight do not enter.

    Notes
    -----
    The environment factor acts on wear, not on fatigue.
    Depth per metre is the depth per passage over :math:`2 \pi r(y)`, :math:`r = r_0 + z` (spec 1.0). The
    area each strip removes is shared out over the stretches of arc length the vertices stand for, in
    proportion to the overlap: the sum over the vertices is the sum over the strips.
    """
    comparison = ComparisonPassage() if comparison is None else comparison
    if passage is None:
        passage = passage_depth(solution.fields, solution.area, wear)
    strip_work = solution.fields.strip_work
    gap = solution.patch.interpenetration
    rim = _RIM * gap.max(axis=1, keepdims=True, initial=0.0)
    load_bearing = gap > rim
    # at the rim as if it had the least interpenetration that counts: without a jump there
    floor = np.maximum(gap, rim)
    floor[floor == 0.0] = np.inf
    active = weight[solution.point] > 0.0

    n_regimes, n = passage.shape[0], state.y.shape[1]
    ends = np.cumsum([len(by_law) for by_law in comparison.depth], dtype=np.int64)
    wear_rows = int(ends[-1]) if ends.size else 0
    further = np.zeros((2, wear_rows + len(comparison.damage), n))
    depth = np.zeros((2, n_regimes, n))
    work = np.zeros((2, n))
    stability = np.zeros((2, n))
    damping = np.zeros((2, n))
    for wheel in (0, 1):
        arc = arc_length(state.y[wheel], state.z[wheel])
        cell_edges = stretches(arc)
        at = np.flatnonzero(active & (solution.side == wheel))
        point = solution.point[at]
        share = (weight[point] * points.environment[point])[:, None]
        # A worn flank may overhang by rounding; the mapping from y to arc length must not turn back.
        rising_y = np.maximum.accumulate(state.y[wheel])
        strip_edges = np.interp(solution.strip_edges_wheel_y[at], rising_y, arc)

        law_depth = passage[:, at] * share
        width = solution.fields.strip_width[at][:, None]
        over_gap = law_depth.sum(axis=0) / floor[at]
        often = weight[point][:, None]
        further_rows = [
            *(regime * share for by_law in comparison.depth for regime in by_law[:, at]),
            *(damage[at] * often for damage in comparison.damage),
        ]
        carried = np.stack([*law_depth, strip_work[at] * often, over_gap, *further_rows]) * width
        area = np.zeros((len(carried), n))
        share_out(strip_edges, cell_edges, carried, area)
        per_metre = 1.0 / (2.0 * np.pi * (wheelset.radius + state.z[wheel]))
        per_vertex = area * (per_metre / vertex_lengths(state.y[wheel], state.z[wheel]))
        depth[wheel], further[wheel] = per_vertex[:n_regimes], per_vertex[n_regimes + 2 :]
        work[wheel], damping[wheel] = per_vertex[n_regimes : n_regimes + 2]

        bears = load_bearing[at]
        ratio = np.where(bears, law_depth.sum(axis=0) / np.where(bears, gap[at], 1.0), 0.0)
        sample(strip_edges, arc, ratio, stability[wheel])
        stability[wheel] *= per_metre
    result = WearRate(
        depth=depth.sum(axis=1),
        regime_depth=depth,
        friction_work=work,
        stability=stability,
        damping=damping,
        solution=solution,
        comparison=tuple(np.split(further[:, :wear_rows], ends[:-1], axis=1)) if wear_rows else (),
        fatigue=tuple(further[:, wear_rows + k] for k in range(len(comparison.damage))),
    )
    if counterface_wear is None:
        return result
    every = (weight * points.environment)[solution.point]
    law = np.where(active, every, 0.0)[:, None] * passage.sum(axis=0)
    over_gap = np.stack([law / floor, np.where(load_bearing, law / floor, 0.0)])
    return with_counterface(result, law, over_gap, state, wheelset.radius, counterface_wear)


def patch_wear(solution: ContactSolution, passage: FloatArray, state: State, wheelset: Wheelset) -> PatchWear:
    r"""Tell what each patch would wear if the wheel ran in its operating point alone.

    Parameters
    ----------
    solution : ContactSolution
        Of `m` patches, in this state.
    passage : (n_regimes, m, ny) array
        Depth per passage of `damage.wear.passage_depth` [m].
    state : State
        The profiles the contact was solved with.
    wheelset : Wheelset
        For the radius at the tape circle.

    Returns
    -------
    PatchWear
        Neither weighted nor multiplied by an environment factor: states compare, whatever the share and
        the environment of their point.

    Notes
    -----
    Depth per metre is the depth per passage over :math:`2 \pi r(y)` with :math:`r = r_0 + z` at the centre
    of the strip (spec 1.0); the area is the sum over the strips of depth times width.
    """
    centre = 0.5 * (solution.strip_edges_wheel_y[:, 1:] + solution.strip_edges_wheel_y[:, :-1])
    height = np.empty_like(centre)
    for wheel in (0, 1):
        at = solution.side == wheel
        # A worn flank may overhang by rounding; interpolation needs a rising y.
        rising_y = np.maximum.accumulate(state.y[wheel])
        height[at] = np.interp(centre[at], rising_y, state.z[wheel])
    depth_rate = passage.sum(axis=0) / (2.0 * np.pi * (wheelset.radius + height))
    return PatchWear(
        area_rate=depth_rate.sum(axis=1) * solution.fields.strip_width,
        depth_rate_max=depth_rate.max(axis=1, initial=0.0),
        regime=patch_regime(passage),
        regime_highest=highest_regime(passage),
    )


def rate(
    state: State,
    points: OperatingPoints,
    weight: FloatArray,
    wheelset: Wheelset,
    counterface: Counterface,
    models: ContactModels | ModelsByPoint,
    wear: WearSettings,
    *,
    comparison: ComparisonLaws | None = None,
    counterface_wear: CounterfaceWear | None = None,
    threads: int = 1,
) -> WearRate:
    """Solve the points that act and give what wears per metre.

    Parameters
    ----------
    state : State
        Profiles of both wheels.
    points : OperatingPoints
        The `n` points of the collective.
    weight : (n,) array
        Share of the distance each point acts for; points of zero weight are not solved.
    wheelset, counterface, models, wear
        What runs on what, by which models.
    comparison : ComparisonLaws, optional
        Comparison laws.
    counterface_wear : CounterfaceWear, optional
        How the counterface wears, if it does.
    threads : int
        They do not change the bits of the result.

    Returns
    -------
    WearRate
        Per metre run; its solution holds the acting points only, numbered among themselves.
    """
    acting = np.flatnonzero(weight > 0.0)
    chosen = select(points, acting)
    if isinstance(models, ModelsByPoint):
        models = models.at(acting)
    solution = solve_contact(state, chosen, wheelset, counterface, models, threads=threads)
    further = comparison_passage(solution, ComparisonLaws() if comparison is None else comparison)
    return accumulate(
        solution,
        chosen,
        weight[acting],
        state,
        wheelset,
        wear,
        comparison=further,
        counterface_wear=counterface_wear,
    )


def select(points: OperatingPoints, index: np.ndarray) -> OperatingPoints:
    """Return the operating points at `index`, in that order; weights are not rescaled."""
    conditions = points.conditions
    rotation = conditions.rotation
    return OperatingPoints(
        conditions=ContactConditions(
            shift=conditions.shift[index],
            yaw=conditions.yaw[index],
            roll=conditions.roll[index],
            wheel_load=conditions.wheel_load[index],
            speed=conditions.speed[index],
            friction=conditions.friction[index],
            track_curvature=conditions.track_curvature[index],
            rotation=rotation if isinstance(rotation, str) else rotation[index],
            torque=conditions.torque,
            free_roll=conditions.free_roll,
        ),
        weight=points.weight[index],
        environment=points.environment[index],
        block_length=points.block_length[index],
        label=tuple(points.label[i] for i in index),
    )
