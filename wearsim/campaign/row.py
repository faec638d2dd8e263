"""Static part and rows of the result file: from setup and state."""

from __future__ import annotations

import platform
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from wearsim.campaign.comparison import (
    SET_TEXTS,
    comparison_attributes,
    comparison_laws,
    comparison_row,
    static_comparison,
)
from wearsim.campaign.counterface import (
    counterface_row,
    static_counterface,
)
from wearsim.campaign.evaluate import Evaluation
from wearsim.campaign.left_out import row_left_out
from wearsim.campaign.passage import Passage
from wearsim.campaign.running import row_running
from wearsim.campaign.state import PatchWear, State, worn_wheels
from wearsim.contact.problem import ContactConditions, ContactModels
from wearsim.damage.fatigue import WEAR_NUMBERS
from wearsim.damage.wear import WEAR_LAWS, WearSettings, coefficients_of
from wearsim.errors import ProfileError
from wearsim.profile import measures
from wearsim.profile.conicity import equivalent_conicity
from wearsim.profile.shape import arc_length
from wearsim.profile.worn import WHEEL_ZONES, WORN_AMOUNTS, worn_amounts
from wearsim.quantities import STEP_LIMITS
from wearsim.results import FILL_FLOAT, FILL_INT, PATCH_SLOTS, Header
from wearsim.results.limits import REPROFILED_AT, REPROFILED_PLACES, attributes_of
from wearsim.results.settings import SETTINGS

if TYPE_CHECKING:
    from wearsim.scene import CampaignSetup

_MEASURES = (
    "max_wear_depth",
    *WORN_AMOUNTS,
    *measures.GAUGE_VALUES,
    "wheel_diameter",
    "equivalent_conicity",
)

# variables of the result file that are fields of the state
_OF_STATE = {
    "distance": "distance",
    "profile_y": "y",
    "profile_z": "z",
    "wear_depth": "wear_depth",
    "wear_depth_by_regime": "regime_depth",
    "worn_area": "worn_area",
    "worn_mass": "worn_mass",
    "active_weight": "active_weight",
    "point_length": "point_length",
    "point_error": "point_error",
    "point_stiffness": "point_stiffness",
}

# variables that are fields of the contact conditions
_CONDITIONS = ("yaw", "roll", "speed", "friction", "track_curvature")

# variables of the result file that are fields of the solution
_PATCH_VALUES = (
    "wheel_y",
    "rail_y",
    "x",
    "contact_angle",
    "area",
    "max_pressure",
    "length",
    "width",
    "approach",
    "normal_force",
    "load_scale",
    "creepage_x",
    "creepage_y",
    "spin",
    "force_x",
    "force_y",
    "spin_moment",
    "slip_area",
    "power",
    "power_balance",
)


@dataclass(frozen=True)
class StepTaken:
    """Step that led to a state; zeros for the initial state."""

    length: float  # [m]
    stability: float  # stability number S [-]
    error: float | None = None  # estimated, of the depth [m]
    rejected: int = 0  # number of longer steps that were rejected
    stages: int = 0  # of the rule
    reason: str = STEP_LIMITS[0]  # limit of the step length, one of `STEP_LIMITS`
    # contact of the state after the step, if it was kept
    end: Evaluation | None = None


NO_STEP = StepTaken(0.0, 0.0)
"""Step of length 0 to a state without wear."""


def build_row(
    state: State, evaluation: Evaluation, taken: StepTaken, setup: CampaignSetup
) -> dict[str, np.ndarray]:
    """Return all variables of the row of a state [SI units].

    Their names are those of `wearsim.results.ROW`.
    """
    collective, measures, laws = (
        evaluation.collective,
        evaluation.measures,
        comparison_laws(setup),
    )
    row = {
        "step_length": np.asarray(taken.length),
        "stability_number": np.asarray(taken.stability),
        "step_error": np.asarray(FILL_FLOAT if taken.error is None else taken.error),
        "step_limit": np.asarray(STEP_LIMITS.index(taken.reason), dtype=np.int32),
        "stages": np.asarray(taken.stages, dtype=np.int32),
        "rejected_steps": np.asarray(taken.rejected, dtype=np.int32),
        "friction_work": collective.friction_work,
        **{
            name: np.asarray(getattr(state, field)) for name, field in _OF_STATE.items()
        },
        **{name: measures[name] for name in _MEASURES},
        **summarise(evaluation.passage, evaluation.wear, len(setup.points.label)),
        **comparison_row(state, collective, laws),
        **counterface_row(state.counterface),
        **row_left_out(state.points),
        **row_running(
            state, setup, evaluation.weight, evaluation.passage, evaluation.wear
        ),
    }
    if setup.templates is not None:
        row["last_reprofiling"] = np.asarray(state.reprofiled, dtype=np.int32)
    return row


def summarise(passage: Passage, wear: PatchWear, count: int) -> dict[str, np.ndarray]:
    """Arrange the `m` patches of a passage and their wear in slots of operating points.

    There are `count` operating points.

    Returns
    -------
    dict of arrays
        (count, PATCH_SLOTS, ...), fill values without patch; `n_patch` (count,) counts
        all patches, of which the most loaded are kept.
    """
    contact, width = passage.contact, passage.contact.patch.width
    values = {
        **{name: getattr(contact, name) for name in _PATCH_VALUES},
        **{
            f"wear_number_{name}": number(contact)
            for name, number in WEAR_NUMBERS.items()
        },
        "wear_index_mean": passage.strip_work.sum(axis=1)
        * width
        / (contact.area * passage.share),
        "wear_index_max": passage.work_density_max,
        "wear_area_rate": wear.area_rate,
        "wear_depth_rate_max": wear.depth_rate_max,
        **passage.comparison.patches,
        "side": contact.side,
        "stood_in": contact.stood_in,
        "wear_regime": wear.regime,
        "wear_regime_highest": wear.regime_highest,
        "zone_share": wear.zone_share,
    }
    point = contact.point
    by_load = np.lexsort((-contact.normal_force, point))
    kept = np.sort(by_load[_rank(point[by_load]) < PATCH_SLOTS])
    place = point[kept], _rank(point[kept])

    row: dict[str, np.ndarray] = {
        "n_patch": np.bincount(point, minlength=count).astype(np.int32)
    }
    for name, value in values.items():
        whole = np.issubdtype(value.dtype, np.integer)
        fill, kind = (FILL_INT, np.int32) if whole else (FILL_FLOAT, np.float64)
        row[name] = np.full((count, PATCH_SLOTS, *value.shape[1:]), fill, dtype=kind)
        row[name][place] = value[kept]
    return row


def _rank(point: np.ndarray) -> np.ndarray:
    """Rank (n,) of each element among equal ones in a rising sequence."""
    return np.arange(point.size) - np.searchsorted(point, point)


def recorded_measures(state: State, setup: CampaignSetup) -> dict[str, np.ndarray]:
    """Measures of wheels and wheelset that are in a row or may have a limit [SI].

    They are named by variable of the result file. A measure that does not exist on a
    worn profile has the fill value.
    """
    wheelset, rule = setup.wheelset, setup.measuring

    def diameter(y: np.ndarray, z: np.ndarray) -> float:
        return 2.0 * (wheelset.radius + measures.running_circle_level(y, z, rule))

    per_wheel: dict[str, Callable[..., float | None]] = {
        **{
            name: partial(measures.gauge_value, name, rule=rule)
            for name in measures.GAUGE_VALUES
        },
        "wheel_diameter": diameter,
    }
    values: dict[str, np.ndarray] = {
        name: np.array([_or_missing(measure, state.y[w], state.z[w]) for w in (0, 1)])
        for name, measure in per_wheel.items()
    }
    values["max_wear_depth"] = state.wear_depth.max(axis=1)
    amounts = [worn_amounts(state.y[w], state.wear_depth[w]) for w in (0, 1)]
    values |= {
        name: np.array([wheel_amounts[name] for wheel_amounts in amounts])
        for name in WORN_AMOUNTS
    }
    if state.fatigue_damage:
        values["fatigue_damage"] = np.stack(state.fatigue_damage, axis=1)
    wheels = worn_wheels(wheelset, state.y, state.z)
    at_amplitude = partial(equivalent_conicity, amplitude=setup.conicity_amplitude)
    conicity = _or_missing(at_amplitude, *wheels, setup.counterface.profile)
    values["equivalent_conicity"] = np.asarray(conicity)
    return values


def _or_missing(measure: Callable[..., float | None], *arguments: object) -> float:
    try:
        value = measure(*arguments)
    except ProfileError:
        return FILL_FLOAT
    return FILL_FLOAT if value is None else float(value)


def versions() -> str:
    """Return the versions of the programs on whose arithmetic a result depends."""
    import numba
    import scipy

    import wearsim

    return (
        f"wearsim {wearsim.__version__} (Python {platform.python_version()}, numpy "
        f"{np.__version__}, scipy {scipy.__version__}, numba {numba.__version__})"
    )


def header_of(setup: CampaignSetup, command: str) -> Header:
    """Return the static part of the result file of a campaign."""
    points, conditions = setup.points, setup.points.conditions
    static = {
        "wheel_name": ("right", "left"),
        "regime_name": WEAR_LAWS[setup.wear.law].regimes,
        "operating_point_name": points.label,
        "operating_point_class": points.classes,
        "shift": conditions.axle_shift(),
        **{name: getattr(conditions, name) for name in _CONDITIONS},
        "curve_curvature": points.curvature,
        "wheel_load": conditions.loads.mean(axis=1),
        "flange_friction": (
            conditions.friction
            if conditions.friction_flange is None
            else conditions.friction_flange
        ),
        **_turning(conditions),
        **_wheel_torques(conditions),
        "environment": points.environment,
        "weight": points.weight,
        "block_length": points.block_length,
        "arc_length": arc_length(setup.wheelset.right.y, setup.wheelset.right.z),
        "counterface_y": setup.counterface.profile.y,
        "counterface_z": setup.counterface.profile.z,
        "zone_name": tuple(WHEEL_ZONES),
        **static_comparison(comparison_laws(setup)),
        **static_counterface(setup),
        **(
            {}
            if setup.templates is None
            else {"wheel_template": [template.name for template in setup.templates]}
        ),
        **_static_binning(setup),
    }
    return Header(static, _attributes(setup, command))


def _attributes(setup: CampaignSetup, command: str) -> dict[str, str | int | float]:
    """Return the settings of a campaign and its limits as attributes [SI units]."""
    values = {
        setting.name: _value_at(setup, setting.in_setup)
        for setting in SETTINGS.values()
        if setting.in_setup
    }
    values |= {"history": command, **_computed(setup)}
    attributes = {
        name: value
        for name, value in values.items()
        if value not in (None, SETTINGS[name].absent)
    }
    control = setup.control
    return attributes | attributes_of(dict(control.limits), control.end_at_limit)


def _value_at(setup: CampaignSetup, place: str) -> Any:
    """Value of an attribute of the setup such as "models.strips".

    None if a part of its way is None.
    """
    value: Any = setup
    for name in place.split("."):
        value = None if value is None else getattr(value, name)
    return value


def _computed(setup: CampaignSetup) -> dict[str, Any]:
    """Values of the settings that are no attributes of the setup."""
    conditions, rules = setup.points.conditions, setup.control.reprofiling
    rotation = conditions.rotation
    values: dict[str, Any] = {
        "title": setup.title or f"wear campaign, {setup.kind}",
        "source": versions(),
        "input_hashes": "; ".join(
            f"{name} sha256:{value}" for name, value in setup.input_hashes
        ),
        **_wear_attributes(setup.wear),
        "contact_parameters": ", ".join(
            f"{name} = {value:g}" for name, value in setup.models.parameters
        ),
        "rotation_rule": rotation if isinstance(rotation, str) else "given",
        "roll_rule": "free" if conditions.free_roll else "given",
        "axle_torque": float(np.mean(conditions.torque)),
        "friction_note": _friction_note(setup.models),
        "attribute_units": "SI: m, m-1, Pa, N m, kg m-3, s m-1",
        "warnings": "\n".join(str(warning) for warning in setup.warnings),
        **comparison_attributes(comparison_laws(setup)),
    }
    if setup.reduction is not None:
        values["recorded_samples"] = float(setup.reduction.samples)
    if rules is not None:
        values[REPROFILED_AT] = " ".join(rules.limits)
        values[REPROFILED_PLACES] = " ".join(f"{place:.12g}" for place in rules.places)
    return values


def _friction_note(models: ContactModels) -> str:
    """Text on the friction coefficient of a patch."""
    falling = ", which falls with its rigid slip velocity (Polach 2005)"
    return (
        "one Coulomb coefficient in a patch, by its contact angle that of tread or "
        f"flange{falling if models.friction_falls else ''}"
    )


def _turning(conditions: ContactConditions) -> dict[str, np.ndarray]:
    """Torque and speed difference of the rollers of each point, if there are any."""
    shape, apart = conditions.shift.shape, conditions.speed_difference
    given = {
        "applied_torque": conditions.torque,
        "roller_speed_difference": 0.0 if apart is None else apart,
    }
    return (
        {key: np.broadcast_to(value, shape) for key, value in given.items()}
        if any(map(np.any, given.values()))
        else {}
    )


def _wheel_torques(conditions: ContactConditions) -> dict[str, np.ndarray]:
    """Difference of the torques on both wheels of each point, if there is one."""
    apart = conditions.torque_difference
    if apart is None or not apart.any():
        return {}
    return {"applied_torque_difference": apart}


def _static_binning(setup: CampaignSetup) -> dict[str, np.ndarray]:
    """Wear of the samples of a record and of the operating points that represent them.

    It is computed with the worn wheels at the end.
    """
    if setup.reduction is None:
        return {}
    samples, points = setup.reduction.increments
    later = np.full_like(samples, FILL_FLOAT)
    return {
        "binning_y": setup.reduction.reducer.grid,
        "binning_depth_samples": samples,
        "binning_depth_points": points,
        "binning_depth_samples_worn": later,
        "binning_depth_points_worn": later,
    }


def _wear_attributes(wear: WearSettings) -> dict[str, str]:
    law = WEAR_LAWS[wear.law]
    if not law.wears:
        return {}
    texts = {key: text(coefficients_of(wear)) for key, text in SET_TEXTS.items()}
    numbers, name = texts.pop("numbers"), texts.pop("coefficients")
    return {
        "wear_coefficients": name,
        **{f"wear_coefficients_{key}": text for key, text in texts.items()},
        "wear_law_numbers": numbers,
        "wear_form": wear.form,
        "seizure_cap": wear.seizure_cap if "seizure_cap" in law.parameters else "",
    }
