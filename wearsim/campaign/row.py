"""One row of the result file from one state of the wheelset."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from wearsim.campaign.choose import row_choice
from wearsim.campaign.comparison import ComparisonPassage, comparison_laws, comparison_row, patch_values
from wearsim.campaign.counterface_row import row_below
from wearsim.campaign.state import PatchWear, State, WearRate
from wearsim.contact.solve import ContactSolution
from wearsim.errors import ProfileError
from wearsim.profile import measures
from wearsim.profile.conicity import equivalent_conicity
from wearsim.results import FILL_FLOAT, FILL_INT, PATCH_SLOTS

if TYPE_CHECKING:
    from wearsim.scene import CampaignSetup

_MEASURES = (
    "max_wear_depth",
    "flange_height",
    "flange_thickness",
    "flange_gradient",
    "hollowing",
    "equivalent_conicity",
)

# variables of the result file that are fields of the solution
_PATCH_VALUES = (
    "wheel_y", "rail_y", "x", "contact_angle", "area", "max_pressure", "length", "width", "approach",
    "normal_force", "load_scale", "creepage_x", "creepage_y", "spin", "force_x", "force_y", "spin_moment",
    "slip_area", "power", "power_balance",
)  # fmt: skip


@dataclass(frozen=True)
class StepTaken:
    """The step that led to a state; zeros for the initial state.

    Parameters
    ----------
    length : float
        Distance [m].
    stability : float
        Stability number S [-].
    weight : (n,) array
        Share of each operating point [-].
    rejected : int
        How many longer steps were tried before, and failed the tolerance of the error.
    """

    length: float
    stability: float
    weight: np.ndarray
    rejected: int = 0


def no_step(count: int) -> StepTaken:
    """Return the step that led to the initial state of `count` operating points: none."""
    return StepTaken(0.0, 0.0, np.zeros(count))


def build_row(
    state: State,
    collective: WearRate,
    wear: PatchWear,
    taken: StepTaken,
    setup: CampaignSetup,
    measures: Mapping[str, np.ndarray],
    comparison: ComparisonPassage | None = None,
) -> dict[str, np.ndarray]:
    """Return all variables of one row.

    Parameters
    ----------
    state : State
        Both wheels.
    collective : WearRate
        In that state under the weights of the full collective.
    wear : PatchWear
        Wear of each patch of its solution.
    taken : StepTaken
        The step that led to the state.
    setup : CampaignSetup
        For operating points and counterface.
    measures : mapping of arrays
        Of the state, from `measures_told`.
    comparison : ComparisonPassage, optional
        What the comparison laws make of each patch.

    Returns
    -------
    dict of arrays
        As `wearsim.results.ROW` names them [SI units].
    """
    return {
        "distance": np.asarray(state.distance),
        "step_length": np.asarray(taken.length),
        "stability_number": np.asarray(taken.stability),
        "step_error": np.asarray(FILL_FLOAT if state.step_error is None else state.step_error),
        "rejected_steps": np.asarray(taken.rejected, dtype=np.int32),
        "active_weight": np.asarray(taken.weight, dtype=np.float64),
        "profile_y": state.y,
        "profile_z": state.z,
        "wear_depth": state.wear_depth,
        "wear_depth_by_regime": state.regime_depth,
        "friction_work": collective.friction_work,
        "worn_area": state.worn_area,
        "worn_mass": state.worn_mass,
        **{name: measures[name] for name in _MEASURES},
        **_turning(state, setup, measures),
        **summarise(
            collective.solution,
            wear,
            len(setup.points.label),
            {}
            if comparison is None
            else patch_values(collective.solution, comparison, comparison_laws(setup)),
        ),
        **row_choice(state.choice),
        **({} if comparison is None else comparison_row(state, collective, comparison_laws(setup))),
        **row_below(state.counterface),
    }


def summarise(
    solution: ContactSolution,
    wear: PatchWear,
    count: int,
    further: Mapping[str, np.ndarray] = MappingProxyType({}),
) -> dict[str, np.ndarray]:
    """Lay the patches of a solution out in slots per operating point.

    Parameters
    ----------
    solution : ContactSolution
        With `m` patches.
    wear : PatchWear
        Wear of each.
    count : int
        Number of operating points.
    further : mapping of (m, ...) arrays
        More values of each patch.

    Returns
    -------
    dict of arrays
        (count, PATCH_SLOTS), fill values where there is no patch; `n_patch` (count,). Of more patches
        than slots the most loaded are kept, in their order; `n_patch` counts all.
    """
    fields = solution.fields
    cell_area = fields.cell_length * fields.strip_width[:, None]
    work = (fields.work_density * cell_area[:, None, :]).sum(axis=(1, 2))
    values = {name: getattr(solution, name) for name in _PATCH_VALUES}
    values["wear_index_mean"] = work / solution.area
    values["wear_index_max"] = fields.work_density.max(axis=(1, 2), initial=0.0)

    values["wear_area_rate"] = wear.area_rate
    values["wear_depth_rate_max"] = wear.depth_rate_max
    values.update(further)
    flags = {
        "side": solution.side,
        "wear_regime": wear.regime,
        "wear_regime_highest": wear.regime_highest,
    }

    row = {
        name: np.full((count, PATCH_SLOTS, *value.shape[1:]), FILL_FLOAT) for name, value in values.items()
    }
    for name in flags:
        row[name] = np.full((count, PATCH_SLOTS), FILL_INT, dtype=np.int32)
    row["n_patch"] = np.bincount(solution.point, minlength=count).astype(np.int32)
    for point in range(count):
        patches = np.flatnonzero(solution.point == point)
        if patches.size > PATCH_SLOTS:
            loaded = np.argsort(-solution.normal_force[patches], kind="stable")[:PATCH_SLOTS]
            patches = patches[np.sort(loaded)]
        slots = slice(0, patches.size)
        for name, value in (*values.items(), *flags.items()):
            row[name][point, slots] = value[patches]
    return row


def measures_told(state: State, setup: CampaignSetup) -> dict[str, np.ndarray]:
    """Measures that the row of a state tells, or that a limit is on: computed once for both.

    Parameters
    ----------
    state, setup
        As for `measures_of`, which says what is returned.
    """
    turned = () if setup.templates is None else ("wheel_diameter",)
    return measures_of(state, setup, {*_MEASURES, *turned, *(name for name, _ in setup.control.limits)})


def measures_of(state: State, setup: CampaignSetup, names: Collection[str]) -> dict[str, np.ndarray]:
    """Measures of both wheels and the wheelset.

    Parameters
    ----------
    state : State
        Both wheels.
    setup : CampaignSetup
        For wheelset and counterface.
    names : collection of str
        Which of them.

    Returns
    -------
    dict of arrays
        By variable of the result file; fill values where a worn profile does not have them [SI].
    """
    wheelset = setup.wheelset

    def diameter(y: np.ndarray, z: np.ndarray) -> float:
        return 2.0 * (wheelset.radius + measures.running_circle_level(y, z))

    per_wheel: dict[str, Callable[..., float | None]] = {
        "flange_height": measures.flange_height,
        "flange_thickness": measures.flange_thickness,
        "flange_gradient": measures.flange_gradient,
        "hollowing": measures.hollowing,
        "wheel_diameter": diameter,
    }
    found: dict[str, np.ndarray] = {
        name: np.array([_or_missing(measure, state.y[w], state.z[w]) for w in (0, 1)])
        for name, measure in per_wheel.items()
        if name in names
    }
    if "max_wear_depth" in names:
        found["max_wear_depth"] = state.wear_depth.max(axis=1)
    if "fatigue_damage" in names and state.fatigue_damage:
        found["fatigue_damage"] = np.stack(state.fatigue_damage, axis=1)
    if "equivalent_conicity" in names:
        right = replace(wheelset.right, y=state.y[0], z=state.z[0])
        left = replace(wheelset.left, y=state.y[1], z=state.z[1])
        conicity = _or_missing(equivalent_conicity, right, left, setup.counterface.profile)
        found["equivalent_conicity"] = np.asarray(conicity)
    return found


def _turning(state: State, setup: CampaignSetup, measures: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Variables of campaigns whose wheels are turned."""
    if setup.templates is None:
        return {}
    return {
        "last_reprofiling": np.asarray(state.turned, dtype=np.int32),
        "wheel_diameter": measures["wheel_diameter"],
    }


def _or_missing(measure: Callable[..., float | None], *arguments: object) -> float:
    try:
        value = measure(*arguments)
    except ProfileError:
        return FILL_FLOAT
    return FILL_FLOAT if value is None else float(value)
