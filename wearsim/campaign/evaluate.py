"""Wear rate of one state of a campaign: contact, wear law, profile coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from wearsim.campaign.comparison import ComparisonLaws, ComparisonPassage, comparison_laws, comparison_passage
from wearsim.campaign.counterface import with_counterface, worn_counterface
from wearsim.campaign.state import PatchWear, State, WearRate, worn_wheels
from wearsim.campaign.vertices import sample, share_out, stretches
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.solve import ContactModels, ContactSolution, Counterface, Wheelset, solve
from wearsim.damage.wear import WearSettings, highest_regime, passage_depth, patch_regime
from wearsim.errors import ContactError
from wearsim.operation.points import OperatingPoints, select
from wearsim.profile.shape import arc_length, vertex_lengths
from wearsim.scene.campaign import CounterfaceWear

if TYPE_CHECKING:
    from wearsim.scene import CampaignSetup

# share of the largest interpenetration below which strips do not limit the step (spec 0.1)
_RIM = 0.05

_CELL_FIELDS = ("pressure", "shear_x", "shear_y", "slip_x", "slip_y", "work_density")


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


def solve_contact(state: State, points: OperatingPoints, setup: Setup) -> ContactSolution:
    """Solve every operating point, whatever its weight, with the profiles of a state.

    They replace those of the wheelset, and those of a counterface that wears.
    """
    right, left = worn_wheels(setup.wheelset, state.y, state.z)
    bodies = (
        replace(setup.wheelset, right=right, left=left),
        worn_counterface(setup.counterface, state.counterface),
    )
    if isinstance(setup.models, ContactModels):
        return solve(points.conditions, *bodies, setup.models, threads=setup.threads)
    parts = []
    for models, index in setup.models.groups():
        try:
            part = solve(select(points, index).conditions, *bodies, models, threads=setup.threads)
        except ContactError as error:
            raise numbered(error, index) from None
        parts.append((part, index))
    return join(parts)


def accumulate(
    solution: ContactSolution,
    points: OperatingPoints,
    weight: FloatArray,
    state: State,
    setup: Setup,
    *,
    passage: FloatArray | None = None,
    comparison: ComparisonPassage | None = None,
) -> WearRate:
    r"""Weigh the wear of all patches and carry it to the vertices of the wheel profiles.

    Parameters
    ----------
    solution : ContactSolution
        Of all `n` points in this state.
    points : OperatingPoints
        Environment factors.
    weight : (n,) array
        Share of the distance each point acts for.
    state : State
        The profiles the contact was solved with.
    setup : Setup
        Radius at the running circle, wear law, and wear of the counterface.
    passage : (n_regimes, m, ny) array, optional
        Depth per passage of `damage.wear.passage_depth`, if computed before [m].
    comparison : ComparisonPassage, optional
        Depth and damage of the same passages by the comparison laws.

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
    comparison = ComparisonPassage() if comparison is None else comparison
    if passage is None:
        passage = passage_depth(solution.fields, solution.area, setup.wear)
    strip_work = solution.fields.strip_work
    gap = solution.patch.interpenetration
    rim = _RIM * gap.max(axis=1, keepdims=True, initial=0.0)
    load_bearing = gap > rim
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
        # a worn flank may overhang by rounding; interpolation needs a rising y
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
        per_metre = 1.0 / (2.0 * np.pi * (setup.wheelset.radius + state.z[wheel]))
        per_vertex = area * (per_metre / vertex_lengths(state.y[wheel], state.z[wheel]))
        depth[wheel], further[wheel] = per_vertex[:n_regimes], per_vertex[n_regimes + 2 :]
        work[wheel], damping[wheel] = per_vertex[n_regimes : n_regimes + 2]

        inner = load_bearing[at]
        ratio = np.where(inner, law_depth.sum(axis=0) / np.where(inner, gap[at], 1.0), 0.0)
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
    if setup.counterface_wear is None:
        return result
    every = (weight * points.environment)[solution.point]
    law = np.where(active, every, 0.0)[:, None] * passage.sum(axis=0)
    over_gap = np.stack([law / floor, np.where(load_bearing, law / floor, 0.0)])
    return with_counterface(result, law, over_gap, state, setup.wheelset.radius, setup.counterface_wear)


def patch_wear(solution: ContactSolution, passage: FloatArray, state: State, wheelset: Wheelset) -> PatchWear:
    r"""Wear of each of `m` patches of a wheel that ran in its operating point alone.

    Neither weighted nor multiplied by an environment factor. `passage` is (n_regimes, m, ny), the depth per
    passage of `damage.wear.passage_depth` [m].

    Notes
    -----
    Depth per metre is the depth per passage over :math:`2 \pi r(y)` with :math:`r = r_0 + z` at the centre
    of the strip (spec 1.0); the area is the sum over the strips of depth times width.
    """
    centre = 0.5 * (solution.strip_edges_wheel_y[:, 1:] + solution.strip_edges_wheel_y[:, :-1])
    height = np.empty_like(centre)
    for wheel in (0, 1):
        at = solution.side == wheel
        # a worn flank may overhang by rounding
        rising_y = np.maximum.accumulate(state.y[wheel])
        height[at] = np.interp(centre[at], rising_y, state.z[wheel])
    depth_rate = passage.sum(axis=0) / (2.0 * np.pi * (wheelset.radius + height))
    return PatchWear(
        area_rate=depth_rate.sum(axis=1) * solution.fields.strip_width,
        depth_rate_max=depth_rate.max(axis=1, initial=0.0),
        regime=patch_regime(passage),
        regime_highest=highest_regime(passage),
    )


def rate(state: State, points: OperatingPoints, weight: FloatArray, setup: Setup) -> WearRate:
    """Solve the contact of the acting points and return the wear rate per metre run.

    Parameters
    ----------
    state : State
        Profiles of both wheels.
    points : OperatingPoints
        The `n` points of the collective.
    weight : (n,) array
        Share of the distance each point acts for; points of zero weight are not solved.
    setup : Setup
        Bodies, models and laws.

    Returns
    -------
    WearRate
        Its solution holds the acting points only, numbered among themselves.
    """
    acting = np.flatnonzero(weight > 0.0)
    points = select(points, acting)
    if isinstance(setup.models, ModelsByPoint):
        setup = replace(setup, models=setup.models.at(acting))
    solution = solve_contact(state, points, setup)
    comparison = comparison_passage(solution, setup.comparison)
    return accumulate(solution, points, weight[acting], state, setup, comparison=comparison)


def numbered(error: ContactError, index: IntArray) -> ContactError:
    """Return an error of the points at `index` of a batch with the number of its point in the batch."""
    if error.row is None:
        return error
    row = int(index[error.row])
    return type(error)(str(error).replace(f"point {error.row}, ", f"point {row}, ", 1), row=row)


def join(parts: Sequence[tuple[ContactSolution, IntArray]]) -> ContactSolution:
    """Join solutions of different operating points, each with the places (k,) of its points in the batch.

    Returns
    -------
    ContactSolution
        Ordered by point, side and falling normal force. All have the largest number of strips and cells:
        missing ones are added at the field side and the trailing end, without width, pressure and slip. The
        patches have no grid of a half-space model.
    """
    ((solution, index), *others) = parts
    if not others and np.array_equal(index, np.arange(index.size)):
        return solution
    strips = max(one.patch.y.shape[1] for one, _ in parts)
    cells = max(one.fields.pressure.shape[1] for one, _ in parts)
    padded = [_padded(one, strips, cells) for one, _ in parts]
    point = np.concatenate([index[one.point] for one, index in parts])
    order = np.argsort(point, kind="stable")
    whole: ContactSolution = _stacked(padded, order)
    return replace(whole, point=point[order], patch=replace(whole.patch, row=point[order]))


def _padded(solution: ContactSolution, strips: int, cells: int) -> ContactSolution:
    """Add strips without width and cells without load."""
    patch, fields_ = solution.patch, solution.fields
    more = strips - patch.y.shape[1]
    further = cells - fields_.pressure.shape[1]
    centre = patch.y[:, -1:] + patch.width[:, None] * np.arange(1, more + 1)

    cells_and_strips = [(0, 0), (0, further), (0, more)]

    def same(value: FloatArray) -> FloatArray:
        return np.pad(value, [(0, 0), (0, more)], mode="edge")

    return replace(
        solution,
        strip_edges_wheel_y=same(solution.strip_edges_wheel_y),
        strip_edges_rail_y=same(solution.strip_edges_rail_y),
        patch=replace(
            patch,
            y=np.concatenate([patch.y, centre], axis=1),
            x_lead=same(patch.x_lead),
            x_trail=np.concatenate([patch.x_trail, np.repeat(patch.x_lead[:, -1:], more, axis=1)], axis=1),
            pressure_slope=np.pad(patch.pressure_slope, [(0, 0), (0, more)]),
            interpenetration=np.pad(patch.interpenetration, [(0, 0), (0, more)]),
            grid=None,
        ),
        fields=replace(
            fields_,
            **{name: np.pad(getattr(fields_, name), cells_and_strips) for name in _CELL_FIELDS},
            x_lead=same(fields_.x_lead),
            cell_length=same(fields_.cell_length),
        ),
    )


def _stacked(parts: Sequence[Any], order: IntArray) -> Any:
    """Concatenate dataclasses of arrays along the first axis, in another order."""
    first = parts[0]
    if first is None:
        return None
    if isinstance(first, np.ndarray):
        return np.concatenate(parts)[order]
    joined = {f.name: _stacked([getattr(part, f.name) for part in parts], order) for f in fields(first)}
    return type(first)(**joined)
